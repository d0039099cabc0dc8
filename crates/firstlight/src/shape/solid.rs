//! The shapes that curve or have several sides, as one family: how rays meet them, in f64, each in its own space.

use glam::DVec2;

use super::Placement;
use super::ball::Ball;
use super::cuboid::Cuboid;
use super::disk::Disk;
use super::frustum::Frustum;
use super::plane::UnboundedPlane;
use super::surface::UvEdge;
use super::torus::Torus;
use crate::accel::RayPacket16;
use crate::math::{Axes, DAffine3, DMat3, DRay, DVec3, LANES};

/// A shape, ready to be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Solid {
    Plane(UnboundedPlane),
    Disk(Disk),
    Cuboid(Cuboid),
    /// Cylinders and cones.
    Frustum(Frustum),
    Torus(Torus),
    Ball(Ball),
}

/// What a solid is an affine image of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Canonical {
    /// z = 0.
    Plane,
    /// From `hole`^2 to 1 is x^2 + y^2, z = 0.
    Disk { hole: f32 },
    /// All coordinates from -1 to 1.
    Box,
    /// x^2 + y^2 + z^2 <= 1.
    Ball,
    /// z from 0 to 1, with these radii at both ends, which may be open.
    Frustum { radii: [f32; 2], open: bool },
}

impl Canonical {
    /// Whether a point is inside, or no farther outside than `room`, which may be below 0.
    pub fn holds(&self, p: DVec3, room: f64) -> bool {
        match self {
            Canonical::Plane | Canonical::Disk { .. } => false,
            Canonical::Box => p.abs().max_element() < 1.0 + room,
            Canonical::Ball => p.length() < 1.0 + room,
            Canonical::Frustum { radii, .. } => {
                let [first, last] = radii.map(f64::from);
                p.z > -room && p.z < 1.0 + room && p.truncate().length() < first + (last - first) * p.z + room
            }
        }
    }

    /// Whether light can pass through it.
    pub fn has_hole(&self) -> bool {
        match self {
            Canonical::Disk { hole } => *hole > 0.0,
            Canonical::Frustum { open, .. } => *open,
            Canonical::Plane | Canonical::Box | Canonical::Ball => false,
        }
    }

    /// Whether it has no inside: its plane is z = 0.
    pub fn is_flat(&self) -> bool {
        matches!(self, Canonical::Plane | Canonical::Disk { .. })
    }
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
    /// The absolute size of what `p` was summed up from, for
    /// [`ErrorBound::of_rounded`](crate::math::ErrorBound::of_rounded).
    pub terms: DVec3,
}

impl SolidPoint {
    /// The change of uv with a step `dp` along the surface. What lies off the surface is left out; once around is the
    /// most that a step makes of a coordinate that comes back.
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
        let comes_back = |edge| matches!(edge, UvEdge::Periodic | UvEdge::Folded);
        let limit = |step: f64, edge| if comes_back(edge) { step.clamp(-1.0, 1.0) } else { step };
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
        match self {
            Solid::Plane(plane) => plane.intersect(ray, t_min, t_max, false).is_some(),
            Solid::Disk(disk) => disk.blocks(ray, t_min, t_max),
            Solid::Cuboid(cuboid) => cuboid.blocks(ray, t_min, t_max),
            Solid::Frustum(frustum) => frustum.blocks(ray, t_min, t_max),
            Solid::Torus(torus) => torus.blocks(ray, t_min, t_max),
            Solid::Ball(ball) => ball.blocks(ray, t_min, t_max),
        }
    }

    /// Which of sixteen lines that are `asked` it blocks between 0 and the ends of each, bit by bit: the same answers
    /// as those of [`blocks`](Self::blocks). In lanes where it is called within `vectorize`.
    #[inline(always)]
    pub fn blocks_lanes(&self, lines: &LineLanes, asked: u16) -> u16 {
        macro_rules! each_line {
            ($line:ident, $end:ident => $is:expr) => {
                lines.each(
                    #[inline(always)]
                    |$line, $end| $is,
                )
            };
        }
        let [blocked, is_told] = match self {
            Solid::Plane(_) => [0, 0],
            Solid::Disk(disk) => each_line!(line, end => [disk.blocks(line, 0.0, end), true]),
            Solid::Cuboid(cuboid) => each_line!(line, end => [cuboid.blocks(line, 0.0, end), true]),
            Solid::Frustum(frustum) => each_line!(line, end => [frustum.blocks(line, 0.0, end), true]),
            Solid::Torus(torus) => each_line!(line, end => torus.blocks_at_once(line, 0.0, end)),
            Solid::Ball(ball) => each_line!(line, end => [ball.blocks(line, 0.0, end), true]),
        };
        let rest = (0..LANES).filter(|k| (asked & !is_told) >> k & 1 == 1);
        let blocks = |k: usize| self.blocks(&lines.line(k), 0.0, lines.end[k]);
        asked & blocked | rest.fold(0, |bits, k| bits | u16::from(blocks(k)) << k)
    }

    /// The point of a hit of [`intersect`](Self::intersect) with the same ray.
    #[inline]
    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        each!(self, shape => shape.point(ray, hit))
    }

    /// What it is an image of, and by which map; `None` of a torus with next to no hole.
    pub fn canonical(&self) -> Option<(DAffine3, Canonical)> {
        let map = |x, y, z, to| DAffine3::from_mat3_translation(DMat3::from_cols(x, y, z), to);
        match self {
            Solid::Plane(plane) => {
                let (at, n) = plane.place();
                let Axes { x, y, z } = Axes::around(n);
                Some((map(x, y, z, at), Canonical::Plane))
            }
            Solid::Disk(disk) => Some(disk.canonical()),
            Solid::Cuboid(cuboid) => {
                let half = cuboid.half();
                let [x, y, z] = [DVec3::X * half.x, DVec3::Y * half.y, DVec3::Z * half.z];
                Some((map(x, y, z, cuboid.middle()), Canonical::Box))
            }
            Solid::Frustum(frustum) => Some(frustum.canonical()),
            Solid::Ball(_) => Some((DAffine3::IDENTITY, Canonical::Ball)),
            Solid::Torus(_) => None,
        }
    }

    /// A point of an infinite plane, and its normal.
    pub fn plane(&self) -> Option<(DVec3, DVec3)> {
        if let Solid::Plane(plane) = self { Some(plane.place()) } else { None }
    }

    /// The smallest box around it, to within rounding; `None` if it has no end.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        each!(self, shape => shape.bounds())
    }

    /// The most that `d` . x is over it, to within rounding: how far it reaches in a direction.
    pub fn support(&self, d: DVec3) -> f64 {
        each!(self, shape => shape.support(d))
    }

    /// Whether all of it lies on one side of the tangent plane of each of its points. Then no ray that leaves such a
    /// shape on its front meets it again, whatever rounding says; nor does one that leaves a flat shape on its back.
    #[cfg(test)]
    pub fn is_convex(&self) -> bool {
        match self {
            Solid::Plane(_) | Solid::Disk(_) | Solid::Cuboid(_) | Solid::Ball(_) => true,
            Solid::Frustum(frustum) => frustum.capped,
            Solid::Torus(_) => false,
        }
    }

    /// Whether it has no thickness: both sides of it can be left without meeting it again.
    #[cfg(test)]
    pub fn is_flat(&self) -> bool {
        matches!(self, Solid::Plane(_) | Solid::Disk(_))
    }
}

/// Sixteen lines in the space of a shape.
pub(crate) struct LineLanes {
    o: [[f64; LANES]; 3],
    d: [[f64; LANES]; 3],
    /// Where each ends.
    end: [f64; LANES],
}

impl LineLanes {
    /// Rays of the world in the space of what is placed so. In lanes where it is called within `vectorize`.
    #[inline(always)]
    pub fn new(placement: &Placement, rays: &RayPacket16, t_end: &[f32; LANES]) -> LineLanes {
        let mut lines = LineLanes { o: [[0.0; LANES]; 3], d: [[0.0; LANES]; 3], end: t_end.map(f64::from) };
        for k in 0..LANES {
            let DRay { o, d } = placement.line(rays.o(k), rays.d(k));
            for axis in 0..3 {
                (lines.o[axis][k], lines.d[axis][k]) = (o[axis], d[axis]);
            }
        }
        lines
    }

    /// Some of them in single precision, for trees.
    pub fn rays(&self, active: u16) -> RayPacket16 {
        let mut rays = RayPacket16::ZERO;
        for k in (0..LANES).filter(|k| active >> k & 1 == 1) {
            let DRay { o, d } = self.line(k);
            rays.set(k, o.as_vec3(), d.as_vec3());
        }
        rays
    }

    #[inline(always)]
    fn line(&self, k: usize) -> DRay {
        let [o, d] = [&self.o, &self.d].map(|v| DVec3::new(v[0][k], v[1][k], v[2][k]));
        DRay { o, d }
    }

    /// For which of them each of two things is true, bit by bit, up to the end of each.
    #[inline(always)]
    pub fn each(&self, is: impl Fn(&DRay, f64) -> [bool; 2]) -> [u16; 2] {
        let [mut one, mut other] = [[0u64; LANES]; 2];
        for k in 0..LANES {
            [one[k], other[k]] = is(&self.line(k), self.end[k]).map(u64::from);
        }
        [one, other].map(|lanes| lanes.iter().enumerate().fold(0, |bits, (k, lane)| bits | (*lane as u16) << k))
    }

    #[cfg(test)]
    pub fn of(lines: &[DRay; LANES], end: f64) -> LineLanes {
        let each = |of: fn(&DRay) -> DVec3| std::array::from_fn(|axis| std::array::from_fn(|k| of(&lines[k])[axis]));
        LineLanes { o: each(|line| line.o), d: each(|line| line.d), end: [end; LANES] }
    }
}

/// The part of a line inside a convex shape, made by cutting away what is outside of one side after another. A line
/// through the inside has both ends, so no ray slips out where sides meet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chord {
    pub enter: SolidHit,
    pub leave: SolidHit,
}

impl Chord {
    /// The whole line.
    pub const LINE: Chord =
        Chord { enter: SolidHit { t: f64::NEG_INFINITY, part: 0 }, leave: SolidHit { t: f64::INFINITY, part: 0 } };

    /// The ends of none of it.
    pub const NO_ENDS: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

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
        let [enter, leave] = Self::slab(o, d, low, high);
        let [part_enter, part_leave] = if d > 0.0 { [part_low, part_high] } else { [part_high, part_low] };
        self.cut(SolidHit { t: enter, part: part_enter }, SolidHit { t: leave, part: part_leave });
    }

    /// The ends of the part of a line between two planes, without branches.
    #[inline(always)]
    pub fn slab(o: f64, d: f64, low: f64, high: f64) -> [f64; 2] {
        let (at_low, at_high) = ((low - o) / d, (high - o) / d);
        let (enter, leave) = if d > 0.0 { (at_low, at_high) } else { (at_high, at_low) };
        let along = if (o >= low) & (o <= high) { f64::NEG_INFINITY } else { f64::INFINITY };
        if d == 0.0 { [along, -along] } else { [enter, leave] }
    }

    /// What [`cut`](Self::cut) leaves of a part of a line between other ends, without branches.
    #[inline(always)]
    pub fn cut_ends(way: [f64; 2], [enter, leave]: [f64; 2]) -> [f64; 2] {
        [if enter > way[0] { enter } else { way[0] }, if leave < way[1] { leave } else { way[1] }]
    }

    /// Whether [`first`](Self::first) finds an end of such a part, from either side.
    #[inline(always)]
    pub fn has_end([enter, leave]: [f64; 2], shift: f64, t_min: f64, t_max: f64) -> bool {
        let within = |t: f64| (t + shift > t_min) & (t + shift < t_max);
        (enter <= leave) & (within(enter) | within(leave))
    }

    /// Whether nothing is left.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        !(self.enter.t <= self.leave.t)
    }

    /// The first end with `t_min` < t < `t_max`; only where the line enters, if `single_sided`. `shift` is added to
    /// every t.
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
            edges: [UvEdge::Periodic, UvEdge::Folded],
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

    #[test]
    fn whatever_compiles_answers_with_numbers() {
        use super::super::check::{Random, made};
        use super::super::{BoxDesc, ConeDesc, DiskDesc, SphereUv, TorusDesc};
        let mut random = Random::new(1);
        let mut hits = 0;
        for i in 0..20_000 {
            // Any two sizes that a scene may say, anywhere
            let mut length = || random.magnitude(1.01e-9, 2.4e8);
            let (a, b, c) = (length(), length(), length());
            let at = random.in_ball() * random.magnitude(1e-9, 2.4e8);
            let axis = random.direction();
            let solid = match i % 6 {
                0 => made(|cx| DiskDesc { normal: axis.into(), ..DiskDesc::new(at.into(), a) }.compile(cx)),
                1 => made(|cx| BoxDesc { size: [a, b, c], ..BoxDesc::new(at.into()) }.compile(cx)),
                2 => made(|cx| TorusDesc { axis: axis.into(), ..TorusDesc::new(at.into(), a, b) }.compile(cx)),
                3 => Solid::Ball(Ball { uv: SphereUv::Angles }),
                _ => {
                    let tip = at + axis * c.max(at.length() * 1e-6);
                    let tip = tip.clamp(DVec3::splat(-2.5e8), DVec3::splat(2.5e8));
                    if (tip - at).length() < 1e-9 {
                        continue;
                    }
                    let radius1 = if i % 3 == 0 { 0.0 } else { b };
                    let cone = ConeDesc { radius1, capped: i % 2 == 0, ..ConeDesc::new(at.into(), tip.into(), a) };
                    made(|cx| cone.compile(cx))
                }
            };
            let [low, high] = solid.bounds().expect("it has an end");
            for _ in 0..8 {
                let o = (low + high) * 0.5 + random.direction() * random.magnitude(1e-9, 4e8);
                let inside = low + (high - low) * DVec3::new(random.unit(), random.unit(), random.unit());
                let d = if random.unit() < 0.2 { random.direction() } else { inside - o };
                let ray = DRay { o, d };
                let Some(hit) = solid.intersect(&ray, 0.0, f64::INFINITY, false) else { continue };
                hits += 1;
                let point = solid.point(&ray, &hit);
                assert!(hit.t > 0.0 && hit.t.is_finite(), "{solid:?} {ray:?} {hit:?}");
                let fine = point.p.is_finite() && point.dpdu.is_finite() && point.dpdv.is_finite();
                assert!(fine && (point.normal.length() - 1.0).abs() < 1e-9, "{solid:?} {ray:?} {point:?}");
                assert!(point.uv.clamp(DVec2::ZERO, DVec2::ONE) == point.uv, "{solid:?} {ray:?} {point:?}");
                assert!(point.uv_step(random.in_ball()).is_finite());
            }
        }
        assert!(hits > 10_000, "{hits}");
    }

    #[test]
    fn no_description_breaks_compiling() {
        use super::super::check::faults;
        use super::super::{BoxDesc, ConeDesc, CylinderDesc, DiskDesc, PlaneDesc, RectangleShapeDesc, TorusDesc};
        let numbers = [0.0, -1.0, 1e-300, 1e30, 1e308, f64::INFINITY, f64::NAN];
        for x in numbers {
            for y in numbers {
                let (v, w) = ([x, y, 0.0], [y, 1.0, x]);
                let plane = PlaneDesc { point: v, normal: w, up: Some([x; 3]), ..PlaneDesc::default() };
                let disk = DiskDesc { normal: v, inner_radius: y, ..DiskDesc::new(w, x) };
                let rectangle =
                    RectangleShapeDesc { normal: w, up: Some([y; 3]), ..RectangleShapeDesc::new(v, [x, y]) };
                let cuboid = BoxDesc { size: v, ..BoxDesc::new(w) };
                let cone = ConeDesc { radius1: y, ..ConeDesc::new(v, w, x) };
                let torus = TorusDesc { axis: v, ..TorusDesc::new(w, x, y) };
                let found = faults(|cx| plane.compile(cx));
                assert!(!found.is_empty() || x.abs() <= 1.0 && y.abs() <= 1.0);
                assert!(!faults(|cx| disk.compile(cx)).is_empty());
                assert!(!faults(|cx| rectangle.compile(cx)).is_empty());
                assert!(!faults(|cx| cuboid.compile(cx)).is_empty());
                assert!(!faults(|cx| cone.compile(cx)).is_empty());
                assert!(!faults(|cx| torus.compile(cx)).is_empty());
                assert!(!faults(|cx| CylinderDesc::new(v, w, x).compile(cx)).is_empty());
            }
        }
    }
}
