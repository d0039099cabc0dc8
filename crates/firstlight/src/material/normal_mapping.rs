//! Normal maps and bump maps: what bends the shading normal of a surface without moving it.
//!
//! A map turns the front normal n into normalize(x T + y B + z n), T the direction in which u runs along the surface,
//! B that of v. Row 0 of a picture is v = 1, so v runs up in the picture and green is up, as in glTF and OpenGL. On the
//! back the mapped normal is turned together with the shading normal.

use crate::context::CompileContext;
use crate::describe::{NumberParam, words};
use crate::ids::TextureId;
use crate::math::{DVec3, Vec3};
use crate::shape::{NormalFrame, SurfaceInteraction};
use crate::texture::{Param, Params, Texture};

words! {
    /// What is made of shading normals that face away from the viewer, or mirror the viewer below the surface.
    pub enum NormalFix {
        /// They are turned to the viewer, those of highlights until they mirror the viewer above the surface, and the
        /// bumps of a map shadow each other.
        Raise = "raise",
        /// They stay as they are: pixels there may be black.
        None = "none",
    }
}

/// The largest factor of a normal map's slopes, and of a bump map's heights.
const MAX_SCALE: f64 = 1e4;

/// The least length of a mean of unit normals that is a direction: opposite ones cancel.
const LEAST_LENGTH: f32 = 1e-3;

/// What bends the shading normal of a material.
#[derive(Clone, Copy, Debug, Default)]
pub struct NormalMapping {
    /// A picture of unit normals, and the factor of their slopes.
    pub map: Option<(TextureId, f32)>,
    /// The heights in metres over the surface.
    pub bump: Option<Param<f32>>,
}

impl NormalMapping {
    /// From what a material says. `None` where nothing bends normals.
    pub(super) fn compile(
        cx: &mut CompileContext,
        params: &mut impl Params,
        (map, normal_scale): (Option<&str>, f64),
        (param, bump_scale): (&NumberParam, f64),
    ) -> Option<NormalMapping> {
        let map = compile_map(cx, params, ("normal_map", map), ("normal_scale", normal_scale));
        let mut height = params.number(cx, "bump_map", param, [-MAX_SCALE, MAX_SCALE]);
        let hint = "metres for 1 of the texture's value";
        cx.between("bump_scale", bump_scale, -MAX_SCALE, MAX_SCALE, Some(hint));
        if height.texture.is_none() && param.texture.is_none() && height.factor != 0.0 {
            let message = "one height for all of the surface makes no bumps";
            cx.advise("bump_map", message, Some("write bump_map = { texture = \"NAME\" }"));
        }
        height.factor *= bump_scale as f32;
        let bump = (height.texture.is_some() && height.factor != 0.0).then_some(height);
        (map.is_some() || bump.is_some()).then_some(NormalMapping { map, bump })
    }

    /// From a normal map alone, a field and what it says, and its scale. `None` where there is no map.
    pub(super) fn of_map(
        cx: &mut CompileContext,
        params: &mut impl Params,
        map: (&str, Option<&str>),
        scale: (&str, f64),
    ) -> Option<NormalMapping> {
        let map = compile_map(cx, params, map, scale)?;
        Some(NormalMapping { map: Some(map), bump: None })
    }

    /// The textures of its maps.
    pub(super) fn textures(&self) -> [Option<TextureId>; 2] {
        [self.map.map(|(texture, _)| texture), self.bump.and_then(|height| height.texture)]
    }

    /// The bent normal of the front at a surface, unit, and the variance of the slopes of the normals that it is the
    /// mean of, over the pixel's footprint. `frame` is what a map that is laid by a set of texture coordinates counts
    /// from; `None` where that has no direction for u of any map.
    ///
    /// The variance is s^2 = (1 - |n|) / |n| of a mean normal of length |n|: Toksvig, "Mipmapping normal maps", Journal
    /// of Graphics Tools 10(3), 2005. Between the texels of a picture that is magnified a mean is shorter as well, but
    /// no normals vary there: the variance is multiplied by min(w, 1)^2, with w the longer side of the footprint in
    /// texels, and by the square of the map's scale.
    ///
    /// A bump map h has the normal n - dh/ds, the gradient over the surface: Mikkelsen, "Bump mapping unparametrized
    /// surfaces on the GPU", Journal of Graphics Tools 15(1), 2010.
    pub(crate) fn bent(
        &self,
        si: &SurfaceInteraction,
        frame: impl Fn(Option<u8>) -> Option<NormalFrame>,
        textures: &[Texture],
    ) -> Option<(Vec3, f32)> {
        let set_of = |texture: TextureId| textures[texture.index()].uv_set;
        let [of_map, of_bump] = self.textures().map(|texture| texture.map(set_of));
        let map_frame = of_map.and_then(&frame);
        // Mostly one for both
        let bump_frame = of_bump.and_then(|set| if of_map == Some(set) { map_frame } else { frame(set) });
        let mut bent = map_frame.or(bump_frame)?.n;
        let mut variance = 0.0;
        if let (Some((texture, scale)), Some(frame)) = (self.map, &map_frame) {
            let texture = &textures[texture.index()];
            let [x, y, z, _] = texture.value(si, si.footprints_per_pixel);
            let length = (x * x + y * y + z * z).sqrt();
            if length > LEAST_LENGTH {
                let cover = texture.texels_across(si, si.footprints_per_pixel).min(1.0);
                variance = ((1.0 - length) / length).max(0.0) * (cover * cover) * (scale * scale);
                let [x, y, z] = [x * scale, y * scale, z].map(f64::from);
                bent = frame.t * x + frame.b * y + frame.n * z;
            }
        }
        if let (Some(height), Some(frame)) = (&self.bump, &bump_frame) {
            let [du, dv] = height.slopes(si, textures).map(f64::from);
            // The gradient of the height over the surface, across the normal
            let (n, [dpdu, dpdv]) = (frame.n.normalize_or_zero(), frame.dp);
            let gradient = (dpdv.cross(n) * du + n.cross(dpdu) * dv) / n.dot(dpdu.cross(dpdv));
            if gradient.is_finite() {
                // Slopes add
                bent -= gradient * bent.dot(n).max(0.0);
            }
        }
        let bent = bent.normalize_or_zero();
        (bent != DVec3::ZERO).then(|| (bent.as_vec3(), variance))
    }
}

/// The texture of a normal map and the factor of its slopes. `None` where there is no map, or none of its slopes.
fn compile_map(
    cx: &mut CompileContext,
    params: &mut impl Params,
    (field, map): (&str, Option<&str>),
    (scale_field, scale): (&str, f64),
) -> Option<(TextureId, f32)> {
    let hint = "1 takes the picture as it is, 0 leaves the surface smooth, below 0 bumps become holes";
    cx.between(scale_field, scale, -MAX_SCALE, MAX_SCALE, Some(hint));
    let texture = map.and_then(|name| params.normals(cx, field, name));
    texture.map(|texture| (texture, scale as f32)).filter(|(_, scale)| *scale != 0.0)
}
