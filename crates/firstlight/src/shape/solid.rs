//! The shapes that curve or have several sides, as one family: how rays meet them, in f64, each in its own space.

use glam::DVec2;

use super::ball::Ball;
use super::cuboid::Cuboid;
use super::disk::Disk;
use super::frustum::Frustum;
use super::plane::Plane;
use super::surface::UvEdge;
use super::torus::Torus;
use crate::math::{DRay, DVec3};

/// A shape, ready to be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Solid {
    Plane(Plane),
    Disk(Disk),
    Cuboid(Cuboid),
    /// Cylinders and cones.
    Frustum(Frustum),
    Torus(Torus),
    Ball(Ball),
}

/// Where a ray meets a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SolidHit {
    /// The ray's `o + t d`.
    pub t: f64,
    /// Which side of it, as the shape numbers them.
    pub part: u8,
}

/// A point of a shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SolidPoint {
    /// On the surface: what the ray's length has cost is taken back.
    pub p: DVec3,
    /// Unit normal of the front, which is the outside of what has an inside.
    pub normal: DVec3,
    /// Texture coordinate.
    pub uv: DVec2,
    /// The change of `p` with u. No length where u has no meaning: at a centre, at an apex, at a pole.
    pub dpdu: DVec3,
    /// The change of `p` with v.
    pub dpdv: DVec3,
    /// What lies beyond 0 and 1 of u and of v.
    pub edges: [UvEdge; 2],
    /// The absolute size of what `p` was summed up from, for [`ErrorBound::of_rounded`](crate::math::ErrorBound::of_rounded).
    pub terms: DVec3,
}

impl SolidPoint {
    /// The change of uv with a step `dp` along the surface. What lies off the surface is left out; once around is the most
    /// that a step makes of a coordinate with an end.
    pub fn uv_step(&self, dp: DVec3) -> DVec2 {
        let across = self.dpdu.cross(self.dpdv);
        let area2 = across.length_squared();
        let step = if area2 > 0.0 {
            DVec2::new(dp.cross(self.dpdv).dot(across), self.dpdu.cross(dp).dot(across)) / area2
        } else {
            // One of them has no length: a step there is once around
            let along = |way: DVec3| if way == DVec3::ZERO { 1.0 } else { dp.dot(way) / way.length_squared() };
            DVec2::new(along(self.dpdu), along(self.dpdv))
        };
        let limit = |step: f64, edge| if edge == UvEdge::Unbounded { step } else { step.clamp(-1.0, 1.0) };
        DVec2::new(limit(step.x, self.edges[0]), limit(step.y, self.edges[1]))
    }
}

/// One expression for every kind.
macro_rules! each {
    ($solid:expr, $shape:ident => $answer:expr) => {
        match $solid {
            Solid::Plane($shape) => $answer,
            Solid::Disk($shape) => $answer,
            Solid::Cuboid($shape) => $answer,
            Solid::Frustum($shape) => $answer,
            Solid::Torus($shape) => $answer,
            Solid::Ball($shape) => $answer,
        }
    };
}

impl Solid {
    /// The nearest hit with `t_min` < t < `t_max`. `single_sided`: what is seen from behind is let through.
    #[inline]
    pub fn intersect(&self, ray: &DRay, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        each!(self, shape => shape.intersect(ray, t_min, t_max, single_sided))
    }

    /// Whether there is any hit, from either side, with `t_min` < t < `t_max`.
    #[inline]
    pub fn blocks(&self, ray: &DRay, t_min: f64, t_max: f64) -> bool {
        self.intersect(ray, t_min, t_max, false).is_some()
    }

    /// The point of a hit of [`intersect`](Self::intersect) with the same ray.
    #[inline]
    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        each!(self, shape => shape.point(ray, hit))
    }

    /// The smallest box around it, to within rounding; `None` if it has no end.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        each!(self, shape => shape.bounds())
    }

    /// Whether all of it lies on one side of the tangent plane of each of its points. Then no ray that leaves such a shape
    /// on its front meets it again, whatever rounding says; nor does one that leaves a flat shape on its back.
    pub fn is_convex(&self) -> bool {
        match self {
            Solid::Plane(_) | Solid::Disk(_) | Solid::Cuboid(_) | Solid::Ball(_) => true,
            Solid::Frustum(frustum) => frustum.capped,
            Solid::Torus(_) => false,
        }
    }

    /// Whether it has no thickness: both sides of it can be left without meeting it again.
    pub fn is_flat(&self) -> bool {
        matches!(self, Solid::Plane(_) | Solid::Disk(_))
    }
}

/// The part of a line inside a convex shape, made by cutting away what is outside of one side after another. A line through
/// the inside has both ends, so no ray slips out where sides meet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chord {
    pub enter: SolidHit,
    pub leave: SolidHit,
}

impl Chord {
    /// The whole line.
    pub const LINE: Chord =
        Chord { enter: SolidHit { t: f64::NEG_INFINITY, part: 0 }, leave: SolidHit { t: f64::INFINITY, part: 0 } };

    /// None of it.
    pub const NOTHING: Chord =
        Chord { enter: SolidHit { t: f64::INFINITY, part: 0 }, leave: SolidHit { t: f64::NEG_INFINITY, part: 0 } };

    /// What is left between the sides `enter` and `leave`.
    #[inline(always)]
    pub fn cut(&mut self, enter: SolidHit, leave: SolidHit) {
        if enter.t > self.enter.t {
            self.enter = enter;
        }
        if leave.t < self.leave.t {
            self.leave = leave;
        }
    }

    /// What is left between two planes, where a coordinate that is `o` + t `d` has the values `low` and `high`.
    #[inline(always)]
    pub fn cut_slab(&mut self, o: f64, d: f64, low: f64, high: f64, part_low: u8, part_high: u8) {
        if d == 0.0 {
            if !(o >= low && o <= high) {
                *self = Chord::NOTHING;
            }
            return;
        }
        let at_low = SolidHit { t: (low - o) / d, part: part_low };
        let at_high = SolidHit { t: (high - o) / d, part: part_high };
        if d > 0.0 { self.cut(at_low, at_high) } else { self.cut(at_high, at_low) }
    }

    /// Whether nothing is left.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        !(self.enter.t <= self.leave.t)
    }

    /// The first end with `t_min` < t < `t_max`; only where the line enters, if `single_sided`. `shift` is added to every t.
    #[inline(always)]
    pub fn first(&self, shift: f64, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        if self.is_empty() {
            return None;
        }
        let within = |hit: SolidHit| {
            let t = hit.t + shift;
            (t > t_min && t < t_max).then_some(SolidHit { t, part: hit.part })
        };
        within(self.enter).or_else(|| if single_sided { None } else { within(self.leave) })
    }
}

/// u for an angle around an axis, counted from the x and towards the y of its frame: 1/2 at x, rising, as on a sphere.
#[inline(always)]
pub(crate) fn turn(x: f64, y: f64) -> f64 {
    use std::f64::consts::PI;
    0.5 + pxfm::f_atan2(y, x) / (2.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_in_uv_are_bounded_where_u_has_no_meaning() {
        let mut point = SolidPoint {
            p: DVec3::ZERO,
            normal: DVec3::Z,
            uv: DVec2::ZERO,
            dpdu: DVec3::X * 4.0,
            dpdv: DVec3::new(1.0, 2.0, 0.0),
            edges: [UvEdge::Periodic, UvEdge::Bounded],
            terms: DVec3::ZERO,
        };
        // Skewed, and with a part along the normal
        assert_eq!(point.uv_step(DVec3::new(0.5, 1.0, 9.0)), DVec2::new(0.0, 0.5));
        assert_eq!(point.uv_step(DVec3::new(1.0, 0.0, 0.0)), DVec2::new(0.25, 0.0));
        assert_eq!(point.uv_step(DVec3::new(100.0, -100.0, 0.0)), DVec2::new(1.0, -1.0));
        point.dpdu = DVec3::ZERO;
        assert_eq!(point.uv_step(DVec3::new(0.2, 0.4, 0.0)), DVec2::new(1.0, 0.2));
        point.dpdu = DVec3::X * 1e-200;
        assert!(point.uv_step(DVec3::new(0.2, 0.4, 0.0)).is_finite());
    }
}
