//! A point of a surface, as lights need it.

use super::{Ambient, Bsdf, Moments};
use crate::color::Rgb;
use crate::ids::SurfaceId;
use crate::math::{ErrorBound, Facet, Vec3};
use crate::shape::{BumpShadowing, SurfaceInteraction};

/// A point of a surface to be lit: where it is, what it reflects, and the footprint that it represents. World space,
/// metres; all directions are unit vectors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadingPoint {
    /// Where light is gathered, and its error bound.
    pub p: Vec3,
    pub error: ErrorBound,
    /// Light from below the plane with this normal does not count.
    pub horizon: Vec3,
    /// Geometric normal, on the viewer's side.
    pub ng: Vec3,
    /// The facet that the point lies on, or was lifted from: it casts no shadow on the point.
    pub facet: Facet,
    /// Shading normal.
    pub ns: Vec3,
    /// Of the bumps that bend it.
    pub bump_shadowing: BumpShadowing,
    /// To the viewer.
    pub wo: Vec3,
    pub surface: SurfaceId,
    /// Whether occluders take light away.
    pub receives_shadow: bool,
    /// The material; of a footprint over which colours vary, the brightest reflectances and the darkest ambient one.
    pub bsdf: Bsdf,
    /// A lower bound of the linear radiance towards the viewer beside the light at hand.
    pub base: Rgb,
    /// Radius of the footprint in metres, and by how many radians normals vary over it; 0 for a point alone.
    pub reach: f32,
    pub turn: f32,
    /// The share of a pixel by which errors at the point are judged: that of all rays of its fragment, whose errors are
    /// not independent.
    pub share: f32,
    /// How far silhouettes may move on the light over the footprint, as a part of the light's size: where they move
    /// farther, and visibility is not proved, the integral is not computed.
    pub most_motion: f32,
    /// The part of the pixel's budget of evaluations of closed forms that the point has: beyond it the light is
    /// sampled. Infinite: it is never sampled for that.
    pub closed_form_budget: f32,
}

impl ShadingPoint {
    /// A point alone that represents a pixel, with one normal `n` for all purposes, beside no other light.
    pub fn new(p: Vec3, error: ErrorBound, n: Vec3, wo: Vec3, bsdf: &Bsdf) -> ShadingPoint {
        ShadingPoint {
            p,
            error,
            horizon: n,
            ng: n,
            facet: Facet::NONE,
            ns: n,
            bump_shadowing: BumpShadowing::default(),
            wo,
            surface: SurfaceId(0),
            receives_shadow: true,
            bsdf: *bsdf,
            base: Rgb::BLACK,
            reach: 0.0,
            turn: 0.0,
            share: 1.0,
            most_motion: f32::INFINITY,
            closed_form_budget: f32::INFINITY,
        }
    }

    /// Where a ray meets a surface, under `ambient` light.
    #[inline(always)]
    pub fn of(si: &SurfaceInteraction, bsdf: &Bsdf, ambient: &Ambient) -> ShadingPoint {
        let SurfaceInteraction { lit_from, error, horizon, ng, facet, ns, wo, .. } = *si;
        let SurfaceInteraction { bump_shadowing, surface, receives_shadow, .. } = *si;
        let base = bsdf.base(ambient);
        let point = ShadingPoint::new(lit_from, error, ns, wo, bsdf);
        ShadingPoint { bump_shadowing, horizon, ng, facet, surface, receives_shadow, base, ..point }
    }

    /// The same of a highlight that has a normal of its own.
    pub fn of_highlight(si: &SurfaceInteraction, bsdf: &Bsdf, ambient: &Ambient) -> ShadingPoint {
        ShadingPoint { ns: si.lobe_ns, ..ShadingPoint::of(si, bsdf, ambient) }
    }

    /// The same of the clear coat.
    pub fn of_coat(si: &SurfaceInteraction, bsdf: &Bsdf, ambient: &Ambient) -> ShadingPoint {
        let bump_shadowing = si.coat_bump_shadowing;
        ShadingPoint { ns: si.coat_ns, bump_shadowing, ..ShadingPoint::of(si, bsdf, ambient) }
    }

    /// The moments of light from `l` away, above the horizon, of such a weight. `inverse_distance` is 1 / |l|.
    #[inline(always)]
    pub fn moments(&self, l: Vec3, inverse_distance: f32, weight: f32) -> Moments {
        let (cos_i, cos_io) = (self.ns.dot(l) * inverse_distance, self.wo.dot(l) * inverse_distance);
        let weight = weight * self.bump_shadowing.factor(self.horizon.dot(l) * inverse_distance);
        self.bsdf.lobe.eval(cos_i, self.ns.dot(self.wo), cos_io) * weight
    }

    /// Whether the closed form is given up where it costs too much.
    pub fn is_bounded(&self) -> bool {
        self.closed_form_budget < f32::INFINITY
    }

    /// Where rays to lights start.
    #[inline(always)]
    pub fn shadow_start(&self) -> Vec3 {
        self.error.offset(self.p, self.ng).as_vec3()
    }
}
