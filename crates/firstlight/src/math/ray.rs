//! Rays, and how sure we are of where they start.

use super::{DVec3, UNIT_ROUNDOFF, Vec3};
use crate::ids::LightId;

/// A camera ray in the world: the points `o + t d`, 0 < t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldRay {
    /// Origin, world space.
    pub o: DVec3,
    /// Direction, unit.
    pub d: Vec3,
}

/// A camera ray: the points `o + t d`, 0 < t.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    /// Origin, in a scene's own coordinates: those of the world less the scene's origin.
    pub o: Vec3,
    /// Direction, unit.
    pub d: Vec3,
}

impl Ray {
    /// The same ray in the world, where the scene's coordinates count from `origin`.
    #[inline(always)]
    pub fn in_world(&self, origin: DVec3) -> WorldRay {
        WorldRay { o: origin + self.o.as_dvec3(), d: self.d }
    }
}

/// The points `o + t d`, in f64, in world space or in the space of a shape. `d` is of any length except 0, so that `t`
/// means the same in both.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DRay {
    pub o: DVec3,
    pub d: DVec3,
}

impl DRay {
    /// The point at `t`.
    #[inline(always)]
    pub fn at(&self, t: f64) -> DVec3 {
        self.o + self.d * t
    }

    /// The same ray, counted from its point nearest to `center`, with `center` as the origin of space; and the `t` of
    /// that point. What is computed from it loses nothing to the distance of `o`.
    #[inline(always)]
    pub fn nearest_to(&self, center: DVec3) -> (DRay, f64) {
        let f = self.o - center;
        let shift = -f.dot(self.d) / self.d.length_squared();
        (DRay { o: f + self.d * shift, d: self.d }, shift)
    }
}

/// A bound on how far a computed point can be from the surface it stands for, along each axis, in metres.
///
/// A surface nearer to a point than this cannot be told from the one the point lies on, so it cannot shadow the point.
/// That is what keeps a ray from hitting its own starting point, at every scale, without a constant of the scene.
#[derive(Clone, Copy, Debug)]
pub struct ErrorBound(pub Vec3);

impl ErrorBound {
    /// Of a point that was found in f64 from terms of these absolute values, and then rounded to `p`. Nearly always the
    /// last rounding alone: it grows neither with the distance of the camera nor with the size of the shape.
    #[inline(always)]
    pub fn of_rounded(p: Vec3, terms: DVec3) -> Self {
        ErrorBound(p.abs() * (4.0 * UNIT_ROUNDOFF) + (terms * (8.0 * f64::EPSILON)).as_vec3())
    }

    /// The same, larger by `rounding` along each axis: what lies in one plane with the point's surface may be off by
    /// the rounding of its own shape, however well the point is known.
    #[inline(always)]
    pub fn widened(self, rounding: f32) -> Self {
        ErrorBound(self.0 + Vec3::splat(rounding))
    }

    /// Where a ray that leaves `p` on the side of the unit normal `ng` starts: `p`, lifted until the whole box of the
    /// bound is below the plane through the new point. What the surface curves away from cannot be hit again from
    /// there.
    ///
    /// The lift is the least that does it: the reach of the box along the normal.
    /// Source: Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th edition, 6.8.6.
    #[inline(always)]
    pub fn offset(self, p: Vec3, ng: Vec3) -> DVec3 {
        let n = ng.as_dvec3();
        p.as_dvec3() + n * n.abs().dot(self.0.as_dvec3())
    }
}

/// The light that a shadow ray leads to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightEnd {
    pub light: LightId,
    /// Unit normal of the plane that all of the light lies in, of either sign; 0 of a light that is not flat.
    pub plane: Vec3,
}

/// A ray from a surface towards a light: the points `p + t l`, 0 < t < t_max.
/// [`Scene::shadow_rays`](crate::Scene::shadow_rays) and [`Scene::shadow_ray_to`](crate::Scene::shadow_ray_to) make
/// them, for [`Scene::occluded`](crate::Scene::occluded).
#[derive(Clone, Copy, Debug)]
pub struct ShadowRay {
    /// Where it starts, on a surface.
    pub(crate) p: Vec3,
    /// How sure we are of `p`.
    pub(crate) error: ErrorBound,
    /// Where it starts for what cannot tell one side of a surface from the other by the bound: [`ErrorBound::offset`].
    pub(crate) start: Vec3,
    /// Towards the light, of any length.
    pub(crate) l: Vec3,
    /// 1 where `l` reaches the light, infinite where the light is infinitely far away.
    pub(crate) t_max: f32,
    /// The light: not everything casts shadows for every one.
    pub(crate) to: LightEnd,
    /// What does not stand in the way: the facet that the ray starts on.
    pub(crate) but: Facet,
}

/// A triangle of a mesh in its place, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Facet {
    /// 0 is the mesh of the world, others are what is placed, counted from 1.
    pub source: u32,
    pub triangle: u32,
}

impl Facet {
    pub const NONE: Facet = Facet { source: u32::MAX, triangle: u32::MAX };

    /// The number of the triangle, if it is one of this mesh; else one that no triangle has.
    #[inline(always)]
    pub fn of(self, source: u32) -> u32 {
        if self.source == source { self.triangle } else { u32::MAX }
    }
}

impl ShadowRay {
    /// From the surface to the light's point, in metres, world space; a unit vector if that is infinitely far away.
    pub fn direction(&self) -> Vec3 {
        self.l
    }

    /// Its line.
    pub(crate) fn line(&self) -> Ray {
        Ray { o: self.start, d: self.l }
    }

    /// The light it leads to.
    pub fn light(&self) -> LightId {
        self.to.light
    }

    /// Whether the light is at the end of [`direction`](Self::direction), and not infinitely far away.
    #[inline(always)]
    pub fn is_finite(&self) -> bool {
        self.t_max == 1.0
    }

    /// The ray's `t_max` for tests that have no margin of their own at the light: short of what the light lies on, by
    /// the rounding of both ends. What lies in the plane of a flat light hides none of it, so there that is a distance
    /// from the plane, however flat the ray meets it.
    #[inline(always)]
    pub(crate) fn end(&self) -> f32 {
        if !self.is_finite() {
            return f32::INFINITY;
        }
        let (o, l) = (self.start.abs(), self.l.abs());
        let length = l.x + l.y + l.z;
        let approach = if self.to.plane == Vec3::ZERO { length } else { self.to.plane.dot(self.l).abs() };
        1.0 - (o.x + o.y + o.z + length) / approach * (32.0 * UNIT_ROUNDOFF)
    }
}
