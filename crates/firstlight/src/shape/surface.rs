//! The surface at a hit, as materials and lights need it.

use super::bump_shadowing::BumpShadowing;
use crate::color::Rgb;
use crate::describe::words;
use crate::ids::{MaterialId, SurfaceId};
use crate::math::{DVec3, ErrorBound, Facet, LightEnd, ShadowRay, Vec2, Vec3};

words! {
    /// What is made of the border of light and dark on facets with smooth normals.
    pub enum ShadowTerminator {
        /// Light is gathered from the round surface that the normals speak of: no facet shadows itself or its
        /// neighbours there.
        Smooth = "smooth",
        /// Light is gathered from the facets, and each is dark as soon as it is turned away, whatever its normals say.
        Hard = "hard",
    }
}

/// What lies beyond 0 and 1 of a texture coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UvEdge {
    /// Nothing: the surface ends there, or another begins, at a rim or the edge of a face.
    Bounded,
    /// More of the shape, but the coordinate turns back: at the poles of a sphere.
    Folded,
    /// The other end of the shape: it closes on itself.
    Periodic,
    /// More of the shape: it has no end, and 0 and 1 are places like any other.
    Unbounded,
}

/// The patch of texture that a camera ray stands for: the parallelogram around `uv` with these sides.
#[derive(Clone, Copy, Debug)]
pub struct Footprint {
    /// The step in uv from one ray of the grid to the next to the right.
    pub dx: Vec2,
    /// The step in uv from one ray of the grid to the next below.
    pub dy: Vec2,
    /// What lies beyond 0 and 1 of u and of v.
    pub edges: [UvEdge; 2],
}

/// How many sets of the texture coordinates of a mesh textures may name. glTF asks programs for two; each takes 24
/// bytes of every surface that is seen.
pub(crate) const UV_SETS: usize = 4;

/// A place on textures: the texture coordinate of one set, and its steps from one ray of the grid to the next, as in
/// [`Footprint`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TexturePoint {
    pub uv: Vec2,
    pub dx: Vec2,
    pub dy: Vec2,
}

/// What a normal map counts from at a point of a shape, world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NormalFrame {
    /// The direction in which u runs along the surface, that of v, and the normal of the front. Of meshes these are
    /// blended between the corners and not unit.
    pub t: DVec3,
    /// See `t`.
    pub b: DVec3,
    /// See `t`.
    pub n: DVec3,
    /// How the point moves with u and with v.
    pub dp: [DVec3; 2],
}

impl NormalFrame {
    /// The frame of a unit normal, where a point moves so with u and with v: u keeps its direction. `None` where
    /// neither has one.
    pub fn new(n: DVec3, dp: [DVec3; 2]) -> Option<NormalFrame> {
        let [dpdu, dpdv] = dp;
        let on_plane = |d: DVec3| (d - n * n.dot(d)).normalize_or_zero();
        let side = if dpdu.cross(dpdv).dot(n) < 0.0 { -1.0 } else { 1.0 };
        let (along_u, along_v) = (on_plane(dpdu), on_plane(dpdv));
        let t = if along_u == DVec3::ZERO { along_v.cross(n) * side } else { along_u };
        (t != DVec3::ZERO).then(|| NormalFrame { t, b: n.cross(t) * side, n, dp })
    }
}

/// A point of a shape, before it is turned to the viewer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShapePoint {
    /// On the surface, world space.
    pub p: Vec3,
    /// How sure we are of `p`.
    pub error: ErrorBound,
    /// Unit normal of the front.
    pub normal: Vec3,
    /// Unit normal that light sees, on the same side.
    pub shading: Vec3,
    /// Where light is gathered, on the viewer's side, if that is not `p`: see [`SurfaceInteraction::lit_from`].
    pub lifted: Option<Vec3>,
    /// Texture coordinate.
    pub uv: Vec2,
    /// See [`Footprint`].
    pub footprint: Footprint,
    /// Multiplies the colours of the material.
    pub color: Rgb,
    /// Multiplies its alpha, 0 to 1.
    pub alpha: f32,
}

/// A surface seen from one side.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceInteraction {
    /// The point, world space.
    pub p: Vec3,
    /// How sure we are of `p`.
    pub(crate) error: ErrorBound,
    /// Geometric normal: unit, on the viewer's side.
    pub ng: Vec3,
    /// Shading normal: unit, turned together with `ng`.
    pub ns: Vec3,
    /// Shading normal of the highlight: `ns`, turned so that it mirrors the viewer above the surface where a map bends
    /// it.
    pub(crate) lobe_ns: Vec3,
    /// Bump shadowing of `ns` and `lobe_ns`.
    pub(crate) bump_shadowing: BumpShadowing,
    /// Where light is gathered: `p`, or where it is lifted to from a facet that stands for something round; see
    /// [`ShadowTerminator`].
    pub lit_from: Vec3,
    /// The normal of the horizon that light comes from above of: `ng`, or `ns` where the point is lifted.
    pub horizon: Vec3,
    /// What does not stand in the way from there: the facet that was hit. It is flat, and light comes from above it.
    pub(crate) facet: Facet,
    /// To the viewer, unit.
    pub wo: Vec3,
    /// Texture coordinate, 0 to 1 on the shape.
    pub uv: Vec2,
    /// The patch of texture that the camera ray stands for.
    pub footprint: Footprint,
    /// The same of the sets that textures of the material name; those of others are 0.
    pub(crate) uv_sets: [TexturePoint; UV_SETS],
    /// How many times as long and as wide the patch is that a pixel stands for.
    pub(crate) footprints_per_pixel: f32,
    /// How much larger the variance of the slopes of microfacets is than the material says: that of the normals within
    /// the pixel.
    pub(crate) slope_variance: f32,
    /// Shading normal of the clear coat, bent by its own map, its variance of slopes and its bump shadowing.
    pub(crate) coat_ns: Vec3,
    pub(crate) coat_slope_variance: f32,
    pub(crate) coat_bump_shadowing: BumpShadowing,
    /// Multiplies the colours of the material: linear Rec. 709.
    pub color: Rgb,
    /// Multiplies the alpha of the material: 0 to 1.
    pub alpha: f32,
    /// What was hit.
    pub surface: SurfaceId,
    /// Its material.
    pub material: MaterialId,
    /// Whether other things, and itself, can take its light away.
    pub receives_shadow: bool,
}

impl SurfaceInteraction {
    /// The texture coordinate, and the patch of texture, of a set that a texture of the material names; without one,
    /// those of the set that the mesh chooses.
    #[inline(always)]
    pub(crate) fn texture_point(&self, set: Option<u8>) -> (Vec2, Footprint) {
        match set {
            None => (self.uv, self.footprint),
            Some(set) => {
                let TexturePoint { uv, dx, dy } = self.uv_sets[usize::from(set) % UV_SETS];
                // Beyond set 0 there are only meshes, which have no edges
                (uv, Footprint { dx, dy, ..self.footprint })
            }
        }
    }

    /// The same surface with patches of texture that are `part` times as long and as wide.
    pub(crate) fn with_footprints(self, part: f32) -> SurfaceInteraction {
        let Footprint { dx, dy, edges } = self.footprint;
        let scaled = |at: TexturePoint| TexturePoint { dx: at.dx * part, dy: at.dy * part, ..at };
        let footprint = Footprint { dx: dx * part, dy: dy * part, edges };
        SurfaceInteraction { footprint, uv_sets: self.uv_sets.map(scaled), ..self }
    }

    /// Where rays to lights start.
    #[inline(always)]
    pub(crate) fn shadow_start(&self) -> Vec3 {
        self.error.offset(self.lit_from, self.ng).as_vec3()
    }

    /// A ray from here towards a light along `l`, up to `t_max` times its length.
    #[inline(always)]
    pub(crate) fn shadow_ray(&self, to: LightEnd, l: Vec3, t_max: f32) -> ShadowRay {
        let start = self.shadow_start();
        ShadowRay { p: self.lit_from, error: self.error, start, l, t_max, to, but: self.facet }
    }
}

/// How a camera ray changes from one ray of the grid to the next: the change of its unnormalised direction, over that
/// direction's length, and the change of its origin. The default is 0: a ray that stands for a point alone.
#[derive(Clone, Copy, Debug, Default)]
pub struct RayDifferential {
    /// Of the direction, to the ray on the right.
    pub dx: Vec3,
    /// Of the direction, to the ray below.
    pub dy: Vec3,
    /// Of the origin, to the ray on the right; 0 where all rays come from one eye.
    pub origin_dx: Vec3,
    /// Of the origin, to the ray below.
    pub origin_dy: Vec3,
    /// How many of these steps there are from one pixel to the next. The default is 0: no pixel.
    pub steps_per_pixel: f32,
}

impl RayDifferential {
    /// Whether the ray stands for a point alone.
    #[inline(always)]
    pub(crate) fn is_zero(&self) -> bool {
        [self.dx, self.dy, self.origin_dx, self.origin_dy] == [Vec3::ZERO; 4]
    }

    /// The steps from one pixel to the next; `None` without a pixel.
    pub(crate) fn of_pixel(&self) -> Option<RayDifferential> {
        let RayDifferential { dx, dy, origin_dx, origin_dy, steps_per_pixel: n } = *self;
        let is_known = n > 0.0 && !self.is_zero();
        let [dx, dy, origin_dx, origin_dy] = [dx * n, dy * n, origin_dx * n, origin_dy * n];
        is_known.then_some(RayDifferential { dx, dy, origin_dx, origin_dy, steps_per_pixel: 1.0 })
    }

    /// The steps, on the plane through the hit with normal `n`, from the point `t d` to where the neighbours meet it:
    /// dp = dO + t dD - d (n.(dO + t dD)) / (n.d).
    ///
    /// Source: Igehy, "Tracing ray differentials", SIGGRAPH 1999, eq. 10 to 12. Edge-on the step is as long as `limit`.
    #[inline(always)]
    pub(crate) fn on_plane(&self, d: Vec3, t: f32, n: Vec3, limit: f32) -> [Vec3; 2] {
        let cos = n.dot(d);
        let along_plane = |v: Vec3| v - d * (n.dot(v) / cos);
        let step = |dd: Vec3, origin: Vec3| {
            let mut step = along_plane(dd) * t;
            // Where all rays come from one eye there are no divisions for it
            if origin != Vec3::ZERO {
                step += along_plane(origin);
            }
            let length2 = step.length_squared();
            // Also where the division gave infinity or no number
            if length2 <= limit * limit {
                step
            } else if length2.is_finite() {
                step * (limit / length2.sqrt())
            } else {
                // Edge-on: along the line of sight, as far as allowed
                (d - n * cos) * limit
            }
        };
        // Written out: a map of the array is not inlined
        [step(self.dx, self.origin_dx), step(self.dy, self.origin_dy)]
    }
}
