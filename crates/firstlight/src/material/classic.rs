//! Materials of a diffuse part and a highlight that is a power of a cosine.

use super::{Ambient, BlinnPhongLobe, Bsdf, Colors, Lobe, LobeKind, PerMoment, PhongLobe, ViewGeometry};
use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::{ColorParam, NumberParam};
use crate::ids::TextureId;
use crate::shape::SurfaceInteraction;
use crate::texture::{Param, Params, Texture};

/// A diffuse part and a highlight, their parameters still to be looked up.
#[derive(Clone, Copy, Debug)]
pub struct Classic {
    /// Reflected in all directions.
    pub diffuse: Param<Rgb>,
    /// The strength of the highlight.
    pub specular: Param<Rgb>,
    /// The answer to the scene's ambient light; the diffuse colour where it is `None`.
    pub ambient: Option<Param<Rgb>>,
    /// The highlight's exponent.
    pub shininess: Param<f32>,
    /// The highlight's shape.
    pub lobe: LobeKind,
}

/// The largest exponent of a highlight.
const MAX_SHININESS: f32 = 1e6;

impl Classic {
    pub(super) fn new(
        cx: &mut CompileContext,
        params: &mut impl Params,
        [diffuse, specular]: [&ColorParam; 2],
        ambient: &Option<ColorParam>,
        shininess: &NumberParam,
        lobe: LobeKind,
    ) -> Classic {
        Classic {
            diffuse: params.color(cx, "diffuse", diffuse),
            specular: params.color(cx, "specular", specular),
            ambient: ambient.as_ref().map(|a| params.color(cx, "ambient", a)),
            shininess: params.number(cx, "shininess", shininess, [0.0, MAX_SHININESS as f64]),
            lobe,
        }
    }

    /// That of shapes without a material.
    pub(super) fn matte() -> Classic {
        Classic {
            diffuse: Param::constant(Rgb::gray(0.8)),
            specular: Param::constant(Rgb::BLACK),
            ambient: None,
            shininess: Param::constant(1.0),
            lobe: LobeKind::Phong,
        }
    }

    /// In numbers. Where the slopes of mapped normals vary within a pixel, the highlight is wider: Toksvig, "Mipmapping
    /// normal maps", Journal of Graphics Tools 10(3), 2005, eq. 3. `ambient`: see
    /// [`Material::evaluate`](super::Material).
    #[inline(always)]
    pub(super) fn evaluate(
        &self,
        color: impl Fn(&Param<Rgb>) -> Rgb,
        tint: Rgb,
        number: impl Fn(&Param<f32>) -> f32,
        ambient: Option<(&Ambient, ViewGeometry)>,
        slope_variance: f32,
    ) -> Bsdf {
        let base = color(&self.diffuse);
        // The same texture in both is looked up once: config 11 has it so everywhere
        let mut specular = match (self.specular.texture, self.diffuse.texture) {
            (Some(s), Some(d)) if s == d && self.specular.factor == self.diffuse.factor => base,
            _ => color(&self.specular),
        };
        let lobe = if specular.is_black() {
            Lobe::None
        } else {
            let mut shininess = number(&self.shininess).clamp(0.0, MAX_SHININESS);
            if slope_variance > 0.0 {
                // 1 over the exponent is the variance of slopes; around the mirror direction a normal counts twice
                let times = if self.lobe == LobeKind::Phong { 4.0 } else { 1.0 };
                let wide = shininess / (1.0 + shininess * (slope_variance * times));
                // As much light in all
                specular = specular * ((1.0 + wide) / (1.0 + shininess));
                shininess = wide;
            }
            match self.lobe {
                LobeKind::Phong => Lobe::Phong(PhongLobe::new(shininess)),
                _ => Lobe::BlinnPhong(BlinnPhongLobe::new(shininess)),
            }
        };
        let diffuse = base * tint;
        let answer = self.ambient.as_ref().map_or(diffuse, |ambient| color(ambient) * tint);
        let ambient = ambient.map_or(answer, |(ambient, view)| ambient.answer(&view, answer, Rgb::BLACK));
        let colors = PerMoment([diffuse, specular, Rgb::BLACK]);
        Bsdf { colors, ambient, lobe }
    }

    /// The roughness of a microfacet highlight of the same width: with alpha^2 = 2 / (s + 2) the distributions of GGX
    /// and of Blinn-Phong of exponent s agree at the peak to second order. Phong's highlight is as wide as
    /// Blinn-Phong's of 4 times the exponent. 1 without a highlight.
    ///
    /// Source: Walter, Marschner, Li, Torrance, "Microfacet models for refraction", 2007 (the exponent).
    pub(super) fn roughness(&self, si: &SurfaceInteraction, textures: &[Texture]) -> f32 {
        if self.specular.color(si, textures).is_black() {
            return 1.0;
        }
        let shininess = self.shininess.number(si, textures, 1.0).clamp(0.0, MAX_SHININESS);
        let exponent = if self.lobe == LobeKind::Phong { 4.0 * shininess } else { shininess };
        (2.0 / (exponent + 2.0)).sqrt().sqrt()
    }

    /// The textures of its colours, and of its numbers.
    pub(super) fn textures(&self) -> [Option<TextureId>; 4] {
        let ambient = self.ambient.and_then(|ambient| ambient.texture);
        [self.diffuse.texture, self.specular.texture, ambient, self.shininess.texture]
    }

    /// How far the colours of the moments differ all over it, and the answer to ambient light, where `contrast` knows
    /// that of the textures; `None` where more than colours varies.
    pub(super) fn contrast(&self, contrast: impl Fn(&Param<Rgb>) -> Option<Rgb>) -> Option<(Colors, Rgb)> {
        let [diffuse, specular] = [contrast(&self.diffuse)?, contrast(&self.specular)?];
        let ambient = self.ambient.as_ref().map_or(Some(diffuse), contrast)?;
        self.shininess.texture.is_none().then_some((PerMoment([diffuse, specular, Rgb::BLACK]), ambient))
    }
}
