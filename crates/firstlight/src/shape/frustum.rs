//! What cylinders and cones are: round about an axis, with a radius that changes evenly from one end to the other.

use std::f64::consts::PI;

use glam::DVec2;

use super::disk::ring_point;
use super::solid::{Canonical, Chord, SolidHit, SolidPoint, turn};
use super::surface::UvEdge;
use crate::context::{CompileContext, show};
use crate::math::{Axes, DAffine3, DMat3, DRay, DVec3};

/// A cylinder or a cone, ready to be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frustum {
    /// The end where z = 0.
    p0: DVec3,
    /// z is the axis, angles are counted from x.
    frame: Axes,
    /// The length of the axis.
    height: f64,
    /// The radii at z = 0 and at z = `height`.
    radii: [f64; 2],
    /// (radii[1] - radii[0]) / height.
    slope: f64,
    /// Whether the ends are closed.
    pub capped: bool,
    /// What the ends are: the caps, or where there is an apex, the mantle.
    caps: [u8; 2],
}

/// The round side.
const MANTLE: u8 = 0;
/// The end where z = 0.
const CAP0: u8 = 1;
/// The end where z = height.
const CAP1: u8 = 2;

/// Ends nearer to each other than this have no axis.
const MIN_LENGTH: f64 = 1e-9;

/// A ray in the frame of the axis.
struct Near {
    o: DVec3,
    d: DVec3,
    /// What is added to t for that of the ray.
    shift: f64,
    /// Room for the rounding of heights.
    slack: f64,
}

impl Frustum {
    /// From the ends of the axis, which are checked, and the radii there, which have been.
    pub(super) fn compile(cx: &mut CompileContext, p0: [f64; 3], p1: [f64; 3], radii: [f64; 2], capped: bool) -> Self {
        let before = cx.fault_count();
        cx.point("p0", p0);
        cx.point("p1", p1);
        let axis = DVec3::from(p1) - DVec3::from(p0);
        if cx.fault_count() == before && !(axis.length() >= MIN_LENGTH) {
            let message = format!("{} is p0 = {}: there is no axis between them", show(&p1), show(&p0));
            cx.error("p1", message, Some("the ends are 1e-9 m apart or more"));
        }
        let height = axis.length();
        Frustum {
            p0: p0.into(),
            frame: Axes::around(axis.normalize_or(DVec3::Y)),
            height,
            radii,
            slope: (radii[1] - radii[0]) / height,
            capped,
            caps: [if radii[0] > 0.0 { CAP0 } else { MANTLE }, if radii[1] > 0.0 { CAP1 } else { MANTLE }],
        }
    }

    /// The radius at z; negative beyond the apex.
    #[inline(always)]
    fn radius(&self, z: f64) -> f64 {
        self.radii[0] + (self.radii[1] - self.radii[0]) * (z / self.height)
    }

    #[inline(always)]
    pub fn intersect(&self, ray: &DRay, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        let Near { o, d, shift, slack } = self.near(ray);
        let mantle = self.mantle(o, d);
        if self.capped {
            let mut chord = Chord::LINE;
            let [cap0, cap1] = self.caps;
            chord.cut_slab(o.z, d.z, 0.0, self.height, cap0, cap1);
            let [enter, leave] = mantle.map(|t| SolidHit { t, part: MANTLE });
            chord.cut(enter, leave);
            return chord.first(shift, t_min, t_max, single_sided);
        }
        // Open: the ends of what is inside the mantle, where they lie between the ends of the axis. Two tubes that
        // share an end overlap by the rounding, so that no ray slips between them
        let [enter, leave] = mantle;
        if !(enter <= leave) {
            return None;
        }
        let within = |end: f64| {
            let (z, t) = (o.z + d.z * end, end + shift);
            (z >= -slack && z <= self.height + slack && t > t_min && t < t_max).then_some(SolidHit { t, part: MANTLE })
        };
        within(enter).or_else(|| if single_sided { None } else { within(leave) })
    }

    /// A ray in the frame of the axis, counted from its point nearest to the middle.
    #[inline(always)]
    fn near(&self, ray: &DRay) -> Near {
        let middle = self.p0 + self.frame.z * (0.5 * self.height);
        let (near, shift) = ray.nearest_to(middle);
        let (mut o, d) = (self.frame.local(near.o), self.frame.local(near.d));
        o.z += 0.5 * self.height;
        let slack = 8.0 * f64::EPSILON * (self.height + (ray.o - middle).length());
        Near { o, d, shift, slack }
    }

    /// Whether [`intersect`](Self::intersect) finds anything, from either side. Without branches.
    #[inline(always)]
    pub fn blocks(&self, ray: &DRay, t_min: f64, t_max: f64) -> bool {
        let Near { o, d, shift, slack } = self.near(ray);
        let mantle = self.mantle(o, d);
        if self.capped {
            let slab = Chord::slab(o.z, d.z, 0.0, self.height);
            return Chord::has_end(Chord::cut_ends(slab, mantle), shift, t_min, t_max);
        }
        let within = |end: f64| {
            let (z, t) = (o.z + d.z * end, end + shift);
            (z >= -slack) & (z <= self.height + slack) & (t > t_min) & (t < t_max)
        };
        (mantle[0] <= mantle[1]) & (within(mantle[0]) | within(mantle[1]))
    }

    /// The part of the line o + t d inside the mantle, which is thought to go on beyond the ends, up to the apex.
    ///
    /// In the plane across the axis, with the radius R + D t: |o + t d| = R + D t, or a t^2 + 2 b t + c = 0 with
    /// a = d.d - D^2, b = o.d - D R, c = o.o - R^2. The discriminant b^2 - a c cancels where the line grazes the
    /// mantle, and near the apex; written as |R d - D o|^2 - |o x d|^2 it does not. The ends of it, without
    /// branches.
    #[inline(always)]
    fn mantle(&self, o: DVec3, d: DVec3) -> [f64; 2] {
        let choose = |is: bool, one: [f64; 2], other: [f64; 2]| {
            [if is { one[0] } else { other[0] }, if is { one[1] } else { other[1] }]
        };
        let (radius, change) = (self.radius(o.z), self.slope * d.z);
        let (o, d) = (o.truncate(), d.truncate());
        let (width, speed) = (o.length(), d.length());
        let a = (speed - change.abs()) * (speed + change.abs());
        let b = o.dot(d) - change * radius;
        let c = (width - radius) * (width + radius);
        let (reach, miss) = ((d * radius - o * change).length(), o.perp_dot(d).abs());
        let discriminant = (reach - miss) * (reach + miss);
        let (none, all) = (f64::NEG_INFINITY, f64::INFINITY);
        // Along the mantle, or along the axis of a cylinder: one end, or none
        let end = -0.5 * c / b;
        let is_in = (c <= 0.0) & (radius >= 0.0);
        let along = choose(b < 0.0, [end, all], choose(is_in, [none, all], Chord::NO_ENDS));
        let along = choose(b > 0.0, [none, end], along);
        let root = discriminant.max(0.0).sqrt();
        let q = if b > 0.0 { -b - root } else { root - b };
        let [t0, t1] = choose(q == 0.0, [0.0; 2], [q / a, c / q]);
        let (first, last) = (t0.min(t1), t0.max(t1));
        // Both on the same side of the apex; beyond it there is nothing
        let is_there = (radius + change * (-b / a) >= 0.0) | (self.slope == 0.0);
        let between = choose(is_there & (discriminant >= 0.0), [first, last], Chord::NO_ENDS);
        // Steeper than the mantle: it comes in through one nappe, and the other is not part of the shape
        let steep = choose(change > 0.0, [last, all], [none, first]);
        choose(a == 0.0, along, choose(a > 0.0, between, steep))
    }

    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        let at = self.frame.local(ray.o - self.p0 + ray.d * hit.t);
        let world = |v: DVec3| self.frame.world(v);
        let edges = [UvEdge::Periodic, UvEdge::Bounded];
        let terms = self.p0.abs()
            + self.frame.disk_reach() * self.radii[0].max(self.radii[1])
            + self.frame.z.abs() * self.height;
        if hit.part != MANTLE {
            let (z, radius, side) = match hit.part {
                CAP0 => (0.0, self.radii[0], -1.0),
                _ => (self.height, self.radii[1], 1.0),
            };
            let on = ring_point(at.truncate(), radius, 0.0);
            return SolidPoint {
                p: self.p0 + world(on.p.extend(z)),
                normal: self.frame.z * side,
                uv: on.uv,
                dpdu: world(on.dpdu.extend(0.0)),
                dpdv: world(on.dpdv.extend(0.0)),
                edges,
                terms,
            };
        }
        // Back to the mantle along its normal, which is (1, -slope) in the plane of the axis and the point
        let outwards = at.truncate().normalize_or(DVec2::X);
        let lean = 1.0 + self.slope * self.slope;
        let above = at.truncate().length() - self.radius(at.z);
        let z = (at.z + above * (self.slope / lean)).clamp(0.0, self.height);
        let radius = self.radius(z).max(0.0);
        SolidPoint {
            p: self.p0 + world((outwards * radius).extend(z)),
            normal: world(outwards.extend(-self.slope) / lean.sqrt()),
            uv: DVec2::new(turn(outwards.x, outwards.y), z / self.height),
            dpdu: world((outwards.perp() * (2.0 * PI * radius)).extend(0.0)),
            dpdv: world((outwards * (self.radii[1] - self.radii[0])).extend(self.height)),
            edges,
            terms,
        }
    }

    /// See [`Solid::canonical`](super::solid::Solid::canonical).
    pub fn canonical(&self) -> (DAffine3, Canonical) {
        let widest = self.radii[0].max(self.radii[1]);
        let Axes { x, y, z } = self.frame;
        let axes = DMat3::from_cols(x * widest, y * widest, z * self.height);
        let radii = self.radii.map(|r| (r / widest) as f32);
        let kind = Canonical::Frustum { radii, open: !self.capped };
        (DAffine3::from_mat3_translation(axes, self.p0), kind)
    }

    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let p1 = self.p0 + self.frame.z * self.height;
        let reach = self.radii.map(|r| self.frame.disk_reach() * r);
        Some([(self.p0 - reach[0]).min(p1 - reach[1]), (self.p0 + reach[0]).max(p1 + reach[1])])
    }

    /// The most that `d` . x is over it, to within rounding.
    pub fn support(&self, d: DVec3) -> f64 {
        let [one, other] = self.radii.map(|r| r * self.frame.across(d));
        (self.p0.dot(d) + one).max((self.p0 + self.frame.z * self.height).dot(d) + other)
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::{KnownSolid, Random, made, never};
    use super::super::cone::ConeDesc;
    use super::super::solid::Solid;
    use super::*;

    #[derive(Clone, Copy, Debug)]
    struct Made {
        p0: DVec3,
        p1: DVec3,
        radii: [f64; 2],
    }

    impl Made {
        fn random(random: &mut Random, center: DVec3, scale: f64) -> Self {
            let half = random.direction() * (scale * random.magnitude(0.05, 2.0));
            let wide = scale * random.magnitude(0.05, 2.0);
            let radii = match random.unit() {
                x if x < 0.3 => [wide, wide],
                x if x < 0.5 => [wide, 0.0],
                x if x < 0.7 => [0.0, wide],
                _ => [wide, wide * random.unit()],
            };
            Made { p0: center - half, p1: center + half, radii }
        }

        fn solid(&self, capped: bool) -> Solid {
            let desc = ConeDesc {
                radius1: self.radii[1],
                capped,
                ..ConeDesc::new(self.p0.into(), self.p1.into(), self.radii[0])
            };
            made(|cx| desc.compile(cx))
        }

        fn center(&self) -> DVec3 {
            (self.p0 + self.p1) * 0.5
        }

        fn size(&self) -> f64 {
            let half = (self.p1 - self.p0).length() * 0.5;
            DVec2::new(half, self.radii[0].max(self.radii[1])).length()
        }

        /// Distance from the axis, and along it.
        fn profile(&self, p: DVec3) -> DVec2 {
            let axis = (self.p1 - self.p0).normalize();
            let along = (p - self.p0).dot(axis);
            DVec2::new((p - self.p0 - axis * along).length(), along)
        }

        /// The distance to the outline in the plane of the axis, whose left half is the mirror of the right one.
        fn distance(&self, p: DVec3) -> f64 {
            let (q, height) = (self.profile(p), (self.p1 - self.p0).length());
            let corners = [
                DVec2::new(-self.radii[0], 0.0),
                DVec2::new(self.radii[0], 0.0),
                DVec2::new(self.radii[1], height),
                DVec2::new(-self.radii[1], height),
            ];
            let (mut nearest, mut inside) = (f64::INFINITY, true);
            for i in 0..4 {
                let (a, b) = (corners[i], corners[(i + 1) % 4]);
                let (side, to) = (b - a, q - a);
                if side.length_squared() > 0.0 {
                    let along = (to.dot(side) / side.length_squared()).clamp(0.0, 1.0);
                    nearest = nearest.min((to - side * along).length());
                    inside &= side.perp_dot(to) > 0.0;
                }
            }
            if inside { -nearest } else { nearest }
        }

        /// A point around the rim of an end.
        fn rim(&self, x: f64) -> DVec3 {
            let (end, radius) = if x < 0.5 { (self.p0, self.radii[0]) } else { (self.p1, self.radii[1]) };
            let axis = (self.p1 - self.p0).normalize();
            let side = axis.any_orthonormal_vector();
            let (sin, cos) = pxfm::f_sincos(x * 4.0 * PI);
            end + (side * cos + axis.cross(side) * sin) * radius
        }

        fn inside(&self, x: f64) -> DVec3 {
            // Nearer to the wide end, where a cone has its inside
            let wide = if self.radii[0] >= self.radii[1] { self.p0 } else { self.p1 };
            wide + (self.center() - wide) * (0.5 + 0.5 * x)
        }
    }

    #[test]
    fn closed_ones_keep_what_solids_promise() {
        let mut random = Random::new(1);
        for round in 0..40 {
            let center = if round % 4 == 3 { DVec3::new(148376.0, 1234.0, -223423.0) } else { DVec3::ZERO };
            let scale = [1e-3, 1.0, 1e6][round % 3];
            let made = Made::random(&mut random, center, scale);
            let distance = |p| made.distance(p);
            let (solid, size) = (made.solid(true), made.size());
            let known = KnownSolid { solid, distance: &distance, center: made.center(), size };
            known.is_closed(10_000, &|x| made.rim(x), &|x| made.inside(x));
            if center.length() < 1e3 * scale {
                known.meets_rays(3000);
                known.derivatives_hold(2000);
                known.bounds_are_tight(4000, &|x| made.rim(x));
            }
        }
    }

    #[test]
    fn open_ones_are_the_mantle_of_closed_ones() {
        let mut random = Random::new(2);
        let mut hits = 0;
        for _ in 0..200 {
            let made = Made::random(&mut random, DVec3::ZERO, 1.0);
            let (open, closed) = (made.solid(false), made.solid(true));
            for _ in 0..200 {
                let o = random.direction() * (made.size() * random.between(0.0, 3.0));
                let ray = DRay { o, d: random.in_ball() * made.size() - o };
                let first = closed.intersect(&ray, 0.0, f64::INFINITY, false);
                let second = first.and_then(|hit| closed.intersect(&ray, hit.t, f64::INFINITY, false));
                let expected = [first, second].into_iter().flatten().find(|hit| hit.part == MANTLE);
                let hit = open.intersect(&ray, 0.0, f64::INFINITY, false);
                let height = (made.p1 - made.p0).length();
                let at_rim = |hit: SolidHit| {
                    let z = made.profile(ray.at(hit.t)).y;
                    z.min(height - z).abs() < 1e-13 * made.size()
                };
                if hit != expected {
                    assert!(hit.or(expected).is_some_and(at_rim), "{ray:?} {made:?}: {hit:?} {expected:?}");
                }
                hits += usize::from(hit.is_some());
                let from_outside = open.intersect(&ray, 0.0, f64::INFINITY, true);
                if let Some(hit) = from_outside {
                    assert!(open.point(&ray, &hit).normal.dot(ray.d) <= 1e-6 * ray.d.length());
                }
            }
        }
        assert!(hits > 10_000, "{hits}");
    }

    #[test]
    fn rays_leave_them() {
        let mut random = Random::new(3);
        for _ in 0..1000 {
            let (scale, center) = (random.magnitude(1e-6, 1e6), random.in_ball() * random.magnitude(1e-8, 1e8));
            let made = Made::random(&mut random, center, scale);
            if made.p0 == made.p1 || (made.p1 - made.p0).length() < 1e-3 * scale {
                continue;
            }
            let known = KnownSolid { solid: made.solid(true), distance: &|_| 0.0, center, size: made.size() };
            known.is_left_by_rays(50, &never);
        }
    }

    #[test]
    fn the_texture_stands_upright_on_a_pillar() {
        let made = Made { p0: DVec3::ZERO, p1: DVec3::new(0.0, 4.0, 0.0), radii: [2.0, 2.0] };
        let solid = made.solid(true);
        let look = |o: DVec3, d: DVec3| {
            let ray = DRay { o, d };
            let hit = solid.intersect(&ray, 0.0, f64::INFINITY, true).expect("it is ahead");
            (hit, solid.point(&ray, &hit))
        };
        let (hit, side) = look(DVec3::new(10.0, 1.0, 0.0), DVec3::NEG_X);
        assert_eq!((hit, side.uv, side.normal), (SolidHit { t: 8.0, part: MANTLE }, DVec2::new(0.5, 0.25), DVec3::X));
        // u to the right as seen from outside, v up
        assert!((side.dpdu - DVec3::NEG_Z * 4.0 * PI).length() < 1e-14 && side.dpdv == DVec3::Y * 4.0);
        assert_eq!(look(DVec3::new(0.0, 2.0, 9.0), DVec3::NEG_Z).1.uv, DVec2::new(0.25, 0.5));
        let (hit, top) = look(DVec3::new(1.0, 9.0, 0.0), DVec3::NEG_Y);
        assert_eq!((hit, top.uv, top.normal), (SolidHit { t: 5.0, part: CAP1 }, DVec2::new(0.5, 0.5), DVec3::Y));
        let (hit, bottom) = look(DVec3::new(2.0, -9.0, 0.0), DVec3::Y);
        assert_eq!(
            (hit, bottom.uv, bottom.normal),
            (SolidHit { t: 9.0, part: CAP0 }, DVec2::new(0.5, 0.0), DVec3::NEG_Y)
        );
    }

    #[test]
    fn lines_through_the_apex_and_along_the_mantle_are_met() {
        let made = Made { p0: DVec3::ZERO, p1: DVec3::new(0.0, 1.0, 0.0), radii: [1.0, 0.0] };
        let solid = made.solid(true);
        // Onto the tip from above, along the mantle from outside and in it, level with the tip
        let hits = |o: [f64; 3], d: [f64; 3]| solid.intersect(&DRay { o: o.into(), d: d.into() }, 0.0, 100.0, false);
        assert_eq!(hits([0.0, 5.0, 0.0], [0.0, -1.0, 0.0]), Some(SolidHit { t: 4.0, part: MANTLE }));
        let tip = DRay { o: DVec3::Y * 5.0, d: DVec3::NEG_Y };
        assert_eq!(solid.point(&tip, &SolidHit { t: 4.0, part: MANTLE }).uv, DVec2::new(0.5, 1.0));
        assert!(hits([0.0, 1.5, 0.0], [1.0, -1.0, 0.0]).is_none());
        assert!(hits([-1.0, 2.0, 0.0], [1.0, -1.0, 0.0]).is_some());
        assert!(hits([-5.0, 1.0 + 1e-12, 0.0], [1.0, 0.0, 0.0]).is_none());
        assert_eq!(hits([-5.0, 0.5, 0.0], [1.0, 0.0, 0.0]).map(|hit| hit.t), Some(4.5));
        // The other nappe is not there
        assert!(hits([-5.0, 1.5, 0.0], [1.0, 0.0, 0.0]).is_none());
        assert!(hits([0.0, 3.0, 0.0], [0.01, 1.0, 0.0]).is_none());
    }
}
