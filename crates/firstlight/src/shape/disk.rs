//! Disks and rings.

use std::f64::consts::PI;

use fearless_simd::{mask32x16, prelude::*};
use glam::DVec2;

use super::common::shape_table;
use super::solid::{Canonical, Solid, SolidHit, SolidPoint, turn};
use super::surface::UvEdge;
use crate::context::CompileContext;
use crate::math::{Axes, DAffine3, DMat3, DRay, DVec3, ErrorBound, UNIT_ROUNDOFF, Vec3, Vec3x16};

shape_table! {
    /// A flat disk, or a ring. u runs around it counterclockwise as seen from the front, v from 0 at the rim to 1 at
    /// the centre, or at the inner edge of a ring. u is 1/2 towards +x, or towards +y where the normal is within 26
    /// degrees of the x axis.
    ///
    /// ```toml
    /// [[disk]]
    /// center = [0, 0, 0]
    /// normal = [0, 1, 0]
    /// radius = 2
    /// inner_radius = 0.5
    /// ```
    pub struct DiskDesc {
        /// Centre, in metres, world space.
        pub center: [f64; 3],
        /// The direction its front faces, of any length above 1e-9.
        pub normal: [f64; 3] = [0.0, 1.0, 0.0],
        /// Radius in metres, 1e-9 to 2.5e8.
        pub radius: f64,
        /// The radius of the hole in the middle, in metres; 0 or more, and smaller than `radius`.
        pub inner_radius: f64 = 0.0,
    }
}

/// A disk, ready to be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Disk {
    center: DVec3,
    /// z is the normal, angles are counted from x.
    frame: Axes,
    radius: f64,
    inner: f64,
}

impl DiskDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Solid {
        cx.point("center", self.center);
        cx.edge("normal", self.normal);
        let before = cx.fault_count();
        let radius = cx.positive("radius", self.radius, "the radius is in metres");
        let inner = self.inner_radius;
        if cx.fault_count() == before && !(inner >= 0.0 && inner < radius) {
            let message = format!("{inner} is outside [0, {radius})");
            cx.error("inner_radius", message, Some("the hole is smaller than the disk; 0 is no hole"));
        }
        let frame = Axes::around(DVec3::from(self.normal).normalize_or(DVec3::Y));
        Solid::Disk(Disk { center: self.center.into(), frame, radius, inner })
    }
}

impl Disk {
    /// Without a hole. z of the frame is the normal.
    pub fn new(center: DVec3, frame: Axes, radius: f64) -> Self {
        Disk { center, frame, radius, inner: 0.0 }
    }

    /// See [`Solid::canonical`].
    pub fn canonical(&self) -> (DAffine3, Canonical) {
        let Axes { x, y, z } = self.frame;
        let axes = DMat3::from_cols(x * self.radius, y * self.radius, z * self.radius);
        let hole = (self.inner / self.radius) as f32;
        (DAffine3::from_mat3_translation(axes, self.center), Canonical::Disk { hole })
    }

    /// What this disk, without its hole, needs to know of a point that asks for light.
    #[inline(always)]
    pub fn shadow(&self, p: Vec3, error: ErrorBound) -> DiskShadow {
        // In f64, so that the side the point is on is wrong by the point's own rounding only
        let from = p.as_dvec3() - self.center;
        let s = self.frame.z.dot(from);
        let n = if s < 0.0 { -self.frame.z } else { self.frame.z }.as_vec3();
        let (x, y) = (self.frame.x / self.radius, self.frame.y / self.radius);
        DiskShadow {
            n,
            height: s.abs() as f32,
            margin: n.abs().dot(error.0),
            abs_n: n.abs() * (10.0 * UNIT_ROUNDOFF),
            x: x.as_vec3(),
            y: y.as_vec3(),
            at: [from.dot(x) as f32, from.dot(y) as f32],
        }
    }

    #[inline(always)]
    pub fn intersect(&self, ray: &DRay, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        let cos = self.frame.z.dot(ray.d);
        if single_sided && cos >= 0.0 {
            return None;
        }
        let from = ray.o - self.center;
        let t = -self.frame.z.dot(from) / cos;
        if !(t > t_min && t < t_max) {
            return None;
        }
        let distance2 = (from + ray.d * t).length_squared();
        let inside = distance2 <= self.radius * self.radius && distance2 >= self.inner * self.inner;
        inside.then_some(SolidHit { t, part: 0 })
    }

    /// Whether [`intersect`](Self::intersect) finds anything, from either side. Without branches.
    #[inline(always)]
    pub fn blocks(&self, ray: &DRay, t_min: f64, t_max: f64) -> bool {
        let from = ray.o - self.center;
        let t = -self.frame.z.dot(from) / self.frame.z.dot(ray.d);
        let distance2 = (from + ray.d * t).length_squared();
        let inside = (distance2 <= self.radius * self.radius) & (distance2 >= self.inner * self.inner);
        (t > t_min) & (t < t_max) & inside
    }

    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        let hit = self.frame.local(ray.o - self.center + ray.d * hit.t).truncate();
        let on = ring_point(hit, self.radius, self.inner);
        let world = |v: DVec2| self.frame.x * v.x + self.frame.y * v.y;
        SolidPoint {
            p: self.center + world(on.p),
            normal: self.frame.z,
            uv: on.uv,
            dpdu: world(on.dpdu),
            dpdv: world(on.dpdv),
            edges: [UvEdge::Periodic, UvEdge::Bounded],
            terms: self.center.abs() + self.frame.disk_reach() * self.radius,
        }
    }

    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let reach = self.frame.disk_reach() * self.radius;
        Some([self.center - reach, self.center + reach])
    }

    /// The most that `d` . x is over it, to within rounding.
    pub fn support(&self, d: DVec3) -> f64 {
        self.center.dot(d) + self.radius * self.frame.across(d)
    }
}

/// A disk as an obstacle to light, seen from one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DiskShadow {
    /// The normal on the point's side.
    n: Vec3,
    /// How far the point is from the plane, 0 or more.
    height: f32,
    /// How far `height` can be wrong.
    margin: f32,
    /// How far n.l can be wrong, for each length along an axis.
    abs_n: Vec3,
    /// Two perpendicular directions of the plane, over the radius.
    x: Vec3,
    y: Vec3,
    /// Where the point is along them, in radii from the middle.
    at: [f32; 2],
}

/// What has to hold for a way l to be blocked by a disk: -n.l above `height` and `room` (above 0, of a way without an
/// end), and (x.l)^2 + (y.l)^2 at most (n.l)^2.
pub(crate) struct DiskBounds {
    pub n: Vec3,
    pub x: Vec3,
    pub y: Vec3,
    pub height: f32,
    /// How far behind the plane an end has to lie, at most, to count as behind it.
    pub room: f32,
    /// How far all these products together can be wrong, for ways with coordinates up to some bound.
    pub wrong: f32,
}

impl DiskShadow {
    /// The same as products with l, for ways with coordinates up to `longest`. `None` if no way is blocked.
    pub(crate) fn bounds(&self, longest: f32) -> Option<DiskBounds> {
        const DOT: f32 = 64.0 * UNIT_ROUNDOFF;
        if !(self.height > self.margin) {
            return None;
        }
        let one = |v: Vec3| v.abs().element_sum();
        let n = one(self.n);
        let [x, y] = [(self.x, self.at[0]), (self.y, self.at[1])].map(|(x, at)| x * self.height - self.n * at);
        let size = |x: Vec3, at: f32| one(x) * self.height + n * at.abs();
        let sizes = n + size(self.x, self.at[0]) + size(self.y, self.at[1]);
        let wrong = (sizes * longest + self.height) * DOT;
        let room = self.margin + one(self.abs_n) * longest;
        Some(DiskBounds { n: self.n, x, y, height: self.height, room, wrong })
    }

    /// Whether the disk stands between the point and the end of `l` (finite), or anywhere along it (not finite). Point
    /// and end have to be on different sides of the plane, by more than their errors.
    ///
    /// The plane is crossed at the height / descent part of `l`: everything times `descent`, there is no division.
    #[inline(always)]
    pub fn blocks(&self, l: Vec3, finite: bool) -> bool {
        let descent = -self.n.dot(l);
        let beyond = descent - self.height;
        let crosses = if finite { beyond > self.margin + self.abs_n.dot(l.abs()) } else { descent > 0.0 };
        let x = self.at[0] * descent + l.dot(self.x) * self.height;
        let y = self.at[1] * descent + l.dot(self.y) * self.height;
        self.height > self.margin && crosses && x * x + y * y <= descent * descent
    }

    /// [`blocks`](Self::blocks) for sixteen finite `l`: the same answers.
    #[inline(always)]
    pub fn blocks_lanes<S: Simd>(&self, l: Vec3x16<S>) -> mask32x16<S> {
        let simd = l.x.token();
        if !(self.height > self.margin) {
            return simd.splat_mask32x16(false);
        }
        let splat = |v: Vec3| Vec3x16::splat(simd, v);
        let descent = -splat(self.n).dot(l);
        let beyond = descent - self.height;
        let wrong = l.abs().dot(splat(self.abs_n));
        let crosses = beyond.simd_gt(simd.splat_f32x16(self.margin) + wrong);
        let x = descent * self.at[0] + l.dot(splat(self.x)) * self.height;
        let y = descent * self.at[1] + l.dot(splat(self.y)) * self.height;
        crosses & (x * x + y * y).simd_le(descent * descent)
    }
}

/// A point of a ring around the origin, with its texture coordinate.
pub(super) struct RingPoint {
    pub p: DVec2,
    pub uv: DVec2,
    pub dpdu: DVec2,
    pub dpdv: DVec2,
}

/// u around, v from 0 at `radius` to 1 at `inner`, where `p` is moved to if rounding has put it outside.
pub(super) fn ring_point(p: DVec2, radius: f64, inner: f64) -> RingPoint {
    let outwards = p.normalize_or(DVec2::X);
    let distance = p.length().clamp(inner, radius);
    RingPoint {
        p: outwards * distance,
        uv: DVec2::new(turn(outwards.x, outwards.y), (radius - distance) / (radius - inner)),
        dpdu: outwards.perp() * (2.0 * PI * distance),
        dpdv: outwards * (inner - radius),
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::{KnownSolid, Random, faults, made, never};
    use super::*;

    fn disk(center: DVec3, normal: DVec3, radius: f64, inner_radius: f64) -> Solid {
        let desc = DiskDesc { normal: normal.into(), inner_radius, ..DiskDesc::new(center.into(), radius) };
        made(|cx| desc.compile(cx))
    }

    #[test]
    fn rays_meet_it_where_the_formula_says() {
        let mut random = Random::new(1);
        let mut hits = 0;
        for _ in 0..20_000 {
            let (radius, normal) = (random.magnitude(1e-3, 1e5), random.direction());
            let center = random.in_ball() * (10.0 * radius);
            let inner = radius * random.between(-0.5, 0.9).max(0.0);
            let solid = disk(center, normal, radius, inner);
            let o = center + random.direction() * (radius * random.magnitude(0.1, 100.0));
            let ray = DRay { o, d: (center + random.in_ball() * radius * 1.2 - o).normalize() };
            let cos = normal.dot(ray.d);
            let t = normal.dot(center - ray.o) / cos;
            let distance = (ray.at(t) - center).length() / radius;
            let unsure = 1e-12 / cos.abs();
            let hit = solid.intersect(&ray, 0.0, f64::INFINITY, false);
            let ring = inner / radius;
            if t <= 0.0 || distance > 1.0 + unsure || distance < ring - unsure {
                assert!(hit.is_none(), "{ray:?} {solid:?}");
            } else if distance < 1.0 - unsure && distance > ring + unsure {
                hits += 1;
                let hit = hit.expect("it lies ahead");
                assert!((hit.t - t).abs() * cos.abs() < 1e-11 * radius, "{hit:?} {t}");
                let single_sided = solid.intersect(&ray, 0.0, f64::INFINITY, true);
                assert_eq!(single_sided.is_some(), cos < 0.0);
                let p = solid.point(&ray, &hit);
                let v = (1.0 - distance) / (1.0 - ring);
                assert!((p.uv.y - v).abs() < 10.0 * unsure / (1.0 - ring) && (0.0..=1.0).contains(&p.uv.x));
                assert!((p.p - center).dot(normal).abs() < 1e-15 * p.terms.length());
            }
        }
        assert!(hits > 4000, "{hits}");
    }

    #[test]
    fn u_runs_around_and_v_inwards() {
        let solid = disk(DVec3::ZERO, DVec3::Y, 2.0, 1.0);
        let at = |x: f64, z: f64| {
            let ray = DRay { o: DVec3::new(x, 1.0, z), d: DVec3::NEG_Y };
            solid.intersect(&ray, 0.0, 2.0, true).map(|hit| solid.point(&ray, &hit).uv)
        };
        assert_eq!(at(2.0, 0.0), Some(DVec2::new(0.5, 0.0)));
        assert_eq!(at(0.0, -1.5), Some(DVec2::new(0.75, 0.5)));
        assert_eq!(at(0.0, 1.0), Some(DVec2::new(0.25, 1.0)));
        assert_eq!(at(0.5, 0.0), None);
    }

    #[test]
    fn derivatives_and_bounds_hold_and_rays_leave_it() {
        let mut random = Random::new(3);
        for _ in 0..200 {
            let size = random.magnitude(1e-6, 1e6);
            let center = random.in_ball() * random.magnitude(1e-8, 1e8);
            let normal = random.direction();
            let solid = disk(center, normal, size, size * 0.3);
            let known = KnownSolid { solid, distance: &|_| 0.0, center, size };
            known.is_left_by_rays(40, &never);
            if center.length() < 10.0 * size {
                known.derivatives_hold(500);
                let side = normal.any_orthonormal_vector();
                known.bounds_are_tight(4000, &|x| {
                    let (sin, cos) = pxfm::f_sincos(x * 2.0 * PI);
                    center + (side * cos + normal.cross(side) * sin) * size
                });
            }
        }
    }

    #[test]
    fn a_hole_as_large_as_the_disk_is_a_fault() {
        let desc = DiskDesc { inner_radius: 1.0, ..DiskDesc::new([0.0; 3], 1.0) };
        let found = faults(|cx| desc.compile(cx));
        assert!(found[0].0 == "inner_radius" && found[0].1.contains("1 is outside [0, 1)"), "{found:?}");
        assert_eq!(faults(|cx| DiskDesc::new([0.0; 3], -1.0).compile(cx))[0].0, "radius");
    }
}
