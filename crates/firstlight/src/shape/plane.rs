//! Infinite planes.

use super::common::shape_table;
use super::rectangle::facing;
use super::solid::{Solid, SolidHit, SolidPoint};
use super::surface::UvEdge;
use crate::context::CompileContext;
use crate::math::{Axes, DRay, DVec3};

shape_table! {
    /// A plane without end (it is let go 1e9 m from `point`). The texture coordinate is the distance from `point` in
    /// metres, to the right and up as seen from the side the normal points to; it goes on for ever, and so does a
    /// checkerboard.
    ///
    /// ```toml
    /// [[plane]]
    /// point = [0, 0, 0]
    /// normal = [0, 1, 0]
    /// material = "floor"
    /// ```
    pub struct PlaneDesc {
        /// A point of it, in metres, world space, where u = v = 0.
        pub point: [f64; 3] = [0.0, 0.0, 0.0],
        /// The direction its front faces, of any length above 1e-9.
        pub normal: [f64; 3] = [0.0, 1.0, 0.0],
        /// The direction of v, made perpendicular to `normal`; not parallel to it. Without it +y; of a plane that faces
        /// straight up -z, straight down +z.
        pub up: Option<[f64; 3]> = None,
    }
}

/// A plane, ready to be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UnboundedPlane {
    /// Where u = v = 0.
    point: DVec3,
    /// u, v and the normal.
    frame: Axes,
}

impl PlaneDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Solid {
        cx.point("point", self.point);
        Solid::Plane(UnboundedPlane { point: self.point.into(), frame: facing(cx, self.normal, self.up) })
    }
}

/// What is farther from `point` than this is not computed with, in metres: squares of squares of coordinates stay
/// finite in f32. Far beyond where any pixel could tell.
const REACH: f64 = 1e9;

impl UnboundedPlane {
    /// How far in front of it a ray begins, and by how much it gains height with t.
    #[inline(always)]
    pub fn approach(&self, ray: &DRay) -> [f64; 2] {
        [self.frame.z.dot(ray.o - self.point), self.frame.z.dot(ray.d)]
    }

    #[inline(always)]
    pub fn intersect(&self, ray: &DRay, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        let [height, cos] = self.approach(ray);
        if single_sided && cos >= 0.0 {
            return None;
        }
        let from = ray.o - self.point;
        let t = -height / cos;
        if !(t > t_min && t < t_max) {
            return None;
        }
        let near = (from + ray.d * t).length_squared() <= REACH * REACH;
        near.then_some(SolidHit { t, part: 0 })
    }

    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        // In the frame the point is on the plane, however far the ray has come
        let hit = self.frame.local(ray.o - self.point + ray.d * hit.t).truncate();
        let offset = self.frame.x * hit.x + self.frame.y * hit.y;
        SolidPoint {
            p: self.point + offset,
            normal: self.frame.z,
            uv: hit,
            dpdu: self.frame.x,
            dpdv: self.frame.y,
            edges: [UvEdge::Unbounded; 2],
            terms: self.point.abs() + self.frame.x.abs() * hit.x.abs() + self.frame.y.abs() * hit.y.abs(),
        }
    }

    /// A point of it, and its normal.
    pub fn place(&self) -> (DVec3, DVec3) {
        (self.point, self.frame.z)
    }

    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        None
    }

    /// The most that `d` . x is over it, to within rounding.
    pub fn support(&self, d: DVec3) -> f64 {
        // Only in its own normal's direction it has an end
        let along = self.frame.x.dot(d).abs().max(self.frame.y.dot(d).abs());
        if along <= 1e-6 * d.length() { self.point.dot(d) } else { f64::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::{KnownSolid, Random, faults, made, never};
    use super::*;

    fn plane(point: DVec3, normal: DVec3) -> Solid {
        let desc = PlaneDesc { point: point.into(), normal: normal.into(), ..PlaneDesc::default() };
        made(|cx| desc.compile(cx))
    }

    #[test]
    fn rays_meet_it_where_the_formula_says() {
        let mut random = Random::new(1);
        for _ in 0..10_000 {
            let (point, normal) = (random.in_ball() * random.magnitude(1e-3, 1e6), random.direction());
            let solid = plane(point, normal * random.magnitude(1e-3, 1e3));
            let size = point.length().max(1.0);
            let ray = DRay { o: random.in_ball() * size, d: random.direction() };
            let t = normal.dot(point - ray.o) / normal.dot(ray.d);
            let hit = solid.intersect(&ray, 0.0, f64::INFINITY, false);
            if t > 0.0 && t < 100.0 * size {
                let hit = hit.expect("it lies ahead");
                assert!((hit.t - t).abs() <= 1e-14 * size * (1.0 + t / size) / normal.dot(ray.d).abs(), "{hit:?} {t}");
                let single_sided = solid.intersect(&ray, 0.0, f64::INFINITY, true);
                assert_eq!(single_sided.is_some(), normal.dot(ray.d) < 0.0);
                // The point has forgotten the length of the ray, and uv leads back to it
                let p = solid.point(&ray, &hit);
                assert!((p.p - point).dot(normal).abs() <= 1e-15 * p.terms.length());
                assert!((point + p.dpdu * p.uv.x + p.dpdv * p.uv.y - p.p).length() <= 1e-15 * p.terms.length());
            } else if t < 0.0 {
                assert!(hit.is_none());
            }
        }
    }

    #[test]
    fn the_ground_is_measured_in_metres() {
        let solid = plane(DVec3::new(1.0, 2.0, 3.0), DVec3::Y);
        let ray = DRay { o: DVec3::new(3.5, 10.0, 2.0), d: DVec3::NEG_Y };
        let p = solid.point(&ray, &solid.intersect(&ray, 0.0, f64::INFINITY, false).expect("it lies below"));
        assert_eq!((p.uv.x, p.uv.y, p.normal), (2.5, 1.0, DVec3::Y));
        assert_eq!((p.dpdu, p.dpdv), (DVec3::X, DVec3::NEG_Z));
        assert!(solid.bounds().is_none());
        // A ray along it meets nothing, also one that lies in it
        for y in [2.0, 3.0] {
            assert!(!solid.blocks(&DRay { o: DVec3::new(0.0, y, 0.0), d: DVec3::X }, 0.0, f64::INFINITY));
        }
    }

    #[test]
    fn rays_leave_it() {
        let mut random = Random::new(2);
        for _ in 0..300 {
            let center = random.in_ball() * random.magnitude(1e-8, 1e8);
            let solid = plane(center, random.direction());
            let size = random.magnitude(1e-8, 1e8);
            KnownSolid { solid, distance: &|_| 0.0, center, size }.is_left_by_rays(40, &never);
        }
    }

    #[test]
    fn up_along_the_normal_is_a_fault() {
        let desc = PlaneDesc { up: Some([0.0, -2.0, 0.0]), ..PlaneDesc::default() };
        let found = faults(|cx| desc.compile(cx));
        assert!(
            found[0].0 == "up" && found[0].1.contains("[0, -2, 0] is parallel to the normal [0, 1, 0]"),
            "{found:?}"
        );
        let desc = PlaneDesc { normal: [0.0; 3], ..PlaneDesc::default() };
        assert_eq!(faults(|cx| desc.compile(cx))[0].0, "normal");
    }
}
