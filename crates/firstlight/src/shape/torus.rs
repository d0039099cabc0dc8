//! Tori.

use std::f64::consts::PI;

use arrayvec::ArrayVec;
use glam::DVec2;

use super::common::shape_table;
use super::solid::{Solid, SolidHit, SolidPoint, turn};
use super::surface::UvEdge;
use crate::context::CompileContext;
use crate::math::{Axes, DRay, DVec3, bracketed, depressed_cubic};

shape_table! {
    /// A ring: a tube bent round into a circle. Where the tube is thicker than the circle the ring has no hole, and
    /// only its outside counts.
    ///
    /// u runs around the axis, to the right as seen from outside with the axis upwards; it is 1/2 towards +x, or
    /// towards +y where the axis is within 26 degrees of the x axis. v runs around the tube, upwards as seen from
    /// outside: 1/2 farthest from the axis, 3/4 at the top, 0 and 1 where the tube is nearest to the axis.
    ///
    /// ```toml
    /// [[torus]]
    /// center = [0, 0.25, 0]
    /// major_radius = 1
    /// minor_radius = 0.25
    /// material = "rubber"
    /// ```
    pub struct TorusDesc {
        /// Centre, in metres, world space.
        pub center: [f64; 3],
        /// The direction the ring is round about, of any length above 1e-9.
        pub axis: [f64; 3] = [0.0, 1.0, 0.0],
        /// From the centre to the middle of the tube, in metres, 1e-9 to 2.5e8.
        pub major_radius: f64,
        /// The radius of the tube, in metres, 1e-9 to 2.5e8.
        pub minor_radius: f64,
    }
}

/// A torus, ready to be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Torus {
    center: DVec3,
    /// z is the axis, angles are counted from x.
    frame: Axes,
    major: f64,
    minor: f64,
}

/// A line's way past a torus, seen from there: its point nearest to the centre, its direction, of length one, from
/// where to where on it it may be in the tube, in metres; and how those are to be had as `t` of the ray.
struct Way {
    o: DVec3,
    d: DVec3,
    low: f64,
    high: f64,
    speed: f64,
    shift: f64,
}

impl Way {
    /// The part of it between two values of t, in metres.
    #[inline(always)]
    fn ends(&self, t_min: f64, t_max: f64) -> [f64; 2] {
        let at = |t: f64| (t - self.shift) * self.speed;
        [self.low.max(at(t_min)), self.high.min(at(t_max))]
    }
}

/// What the Bernstein coefficients of a polynomial say of its signs: that it is negative somewhere, or positive, or one
/// of them everywhere.
struct Signs {
    is_in: bool,
    is_out: bool,
    is_one: bool,
}

/// Whether the ends of a part of a line lie on different sides of the surface, and whether signs tell of it.
struct Ends {
    differ: bool,
    tell: bool,
}

/// The Bernstein coefficients of both halves of a polynomial, as de Casteljau found them: the first of each row of
/// means, and the last.
#[inline(always)]
fn halves(of: &[f64; 5]) -> [[f64; 5]; 2] {
    let (mut row, mut first, mut second) = (*of, *of, *of);
    for n in 1..5 {
        for i in 0..5 - n {
            row[i] = 0.5 * (row[i] + row[i + 1]);
        }
        (first[n], second[4 - n]) = (row[0], row[4 - n]);
    }
    [first, second]
}

impl Signs {
    #[inline(always)]
    fn of(coefficients: &[f64; 5], margin: f64) -> Signs {
        let [a, b, c, d, e] = *coefficients;
        let (below, above) = (|v: f64| v < -margin, |v: f64| v > margin);
        let all_below = below(a) & below(b) & below(c) & below(d) & below(e);
        let all_above = above(a) & above(b) & above(c) & above(d) & above(e);
        Signs { is_in: below(a) | below(e), is_out: above(a) | above(e), is_one: all_below | all_above }
    }
}

/// The part of its size, and that to the fourth, to which polynomials are not trusted.
const CLOSE: f64 = 1e-9;
/// How often a way is halved to find out whether it meets the tube.
const HALVINGS: usize = 10;

impl TorusDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Solid {
        cx.point("center", self.center);
        cx.edge("axis", self.axis);
        let major =
            cx.positive("major_radius", self.major_radius, "from the centre to the middle of the tube, in metres");
        let minor = cx.positive("minor_radius", self.minor_radius, "the radius of the tube, in metres");
        let frame = Axes::around(DVec3::from(self.axis).normalize_or(DVec3::Y));
        Solid::Torus(Torus { center: self.center.into(), frame, major, minor })
    }
}

impl Torus {
    /// How far a point is from the surface, negative inside the tube, and how that changes along `d`.
    #[inline(always)]
    fn distance(&self, p: DVec3, d: DVec3) -> (f64, f64) {
        let from_axis = p.truncate().length();
        let from_circle = DVec2::new(from_axis - self.major, p.z);
        let distance = from_circle.length();
        let slope = from_circle.dot(DVec2::new(p.truncate().dot(d.truncate()) / from_axis, d.z)) / distance;
        (distance - self.minor, slope)
    }

    /// How far a point is from the surface, negative inside the tube.
    #[inline(always)]
    fn height(&self, p: DVec3) -> f64 {
        DVec2::new(p.truncate().length() - self.major, p.z).length() - self.minor
    }

    /// The part of a line on which it may be in the tube; `None` if there is none.
    #[inline]
    fn way(&self, ray: &DRay) -> Option<Way> {
        let (way, is_any) = self.way_there(ray);
        is_any.then_some(way)
    }

    /// The same, and whether there is any; without branches.
    #[inline(always)]
    fn way_there(&self, ray: &DRay) -> (Way, bool) {
        let (near, shift) = ray.nearest_to(self.center);
        // The line's way through the ball around the torus, in metres
        let outer = (self.major + self.minor) * (1.0 + 1e-9);
        let half2 = outer * outer - near.o.length_squared();
        let speed = near.d.length();
        let (o, d) = (self.frame.local(near.o), self.frame.local(near.d) / speed);
        let half = half2.max(0.0).sqrt();
        // And through the slab that it fills
        let thick = self.minor * (1.0 + 1e-9);
        let (a, b) = ((-thick - o.z) / d.z, (thick - o.z) / d.z);
        let is_level = d.z == 0.0;
        let low = if is_level { -half } else { (-half).max(a.min(b)) };
        let high = if is_level { half } else { half.min(a.max(b)) };
        let is_any = (half2 >= 0.0) & !(is_level & (o.z.abs() > thick)) & (low < high);
        (Way { o, d, low, high, speed, shift }, is_any)
    }

    /// The line meets the torus where a polynomial of degree four is 0. Its coefficients know the roots badly where two
    /// are close, so they are asked only where the line turns around in it: the three roots of its derivative, which as
    /// a cubic in the distance from the point nearest to the centre has no square. Between those the torus is entered
    /// or left at most once, and the signs of the distance to the torus, which loses nothing, say whether; the place is
    /// found by Newton's method on the distance, held between the two.
    #[inline]
    pub fn intersect(&self, ray: &DRay, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        self.meet(&self.way(ray)?, t_min, t_max, single_sided)
    }

    fn meet(&self, way: &Way, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        let Way { o, d, low, high, speed, shift } = *way;
        // With s the way from the nearest point: F = (s^2 + k)^2 - 4 R^2 |(o + s d) across the axis|^2, a quarter of
        // whose derivative is s^3 + (k - 2 R^2 d.d) s - 2 R^2 o.d
        let (across, major2) = (d.truncate(), self.major * self.major);
        let k = o.length_squared() + (self.major - self.minor) * (self.major + self.minor);
        let p = k - 2.0 * major2 * across.length_squared();
        let q = -2.0 * major2 * o.truncate().dot(across);
        let (count, turns) = depressed_cubic(p, q, low, high);
        // From piece to piece, as long as they lie before t_max
        let at = |s: f64| self.distance(o + d * s, d);
        let mut start = low;
        let mut inside = false;
        let ends = turns[..count].iter().map(|s| (*s, at(*s).0 < 0.0)).chain([(high, false)]);
        for (end, ends_inside) in ends {
            if ends_inside != inside {
                let t = bracketed(start, end, inside, at) / speed + shift;
                // Leaving it is to see it from behind
                if t > t_min && (ends_inside || !single_sided) {
                    return (t < t_max).then_some(SolidHit { t, part: 0 });
                }
            }
            (start, inside) = (end, ends_inside);
        }
        None
    }

    /// Whether [`intersect`](Self::intersect) finds anything, from either side. Where the polynomial has one sign it
    /// does not, and where it has both it does; only where rounding hides that, or a root is close to an end, are roots
    /// looked for.
    #[inline]
    pub fn blocks(&self, ray: &DRay, t_min: f64, t_max: f64) -> bool {
        let Some(way) = self.way(ray) else { return false };
        match self.changes_sides(&way, way.ends(t_min, t_max)) {
            Some(changes) => changes,
            None => self.meet(&way, t_min, t_max, false).is_some(),
        }
    }

    /// What [`blocks`](Self::blocks) says where that is seen at once, and whether it is; without branches.
    #[inline(always)]
    pub fn blocks_at_once(&self, ray: &DRay, t_min: f64, t_max: f64) -> [bool; 2] {
        let (way, is_any) = self.way_there(ray);
        let [from, to] = way.ends(t_min, t_max);
        let [first, second] = halves(&self.bernstein(&way, from, to));
        let (mut is_in, mut is_out, mut is_one) = (false, false, true);
        for half in [first, second] {
            for quarter in halves(&half) {
                let signs = Signs::of(&quarter, self.margin());
                (is_in, is_out, is_one) = (is_in | signs.is_in, is_out | signs.is_out, is_one & signs.is_one);
            }
        }
        let least = CLOSE * (self.major + self.minor);
        let is_long = is_any & (to - from > least);
        let ends = self.ends(&way, [from, to]);
        let is_through = is_long & (ends.differ | ends.tell & is_in & (is_out | self.fills_hole()));
        let is_past = !is_any | (from - to > least) | is_long & ends.tell & is_one;
        [is_through, is_through | is_past]
    }

    /// A tube that fills the hole has another sheet within it.
    #[inline(always)]
    fn fills_hole(&self) -> bool {
        self.minor >= self.major
    }

    /// What the ends of a part of a line say, if the tube fills the hole: there the polynomial is positive outside and
    /// in the inner sheet, so its signs tell only of a line with both ends outside for sure.
    #[inline(always)]
    fn ends(&self, way: &Way, ends: [f64; 2]) -> Ends {
        let least = CLOSE * (self.major + self.minor);
        let [one, other] = ends.map(|s| self.height(way.o + way.d * s));
        let differ = (one > least) & (other < -least) | (one < -least) & (other > least);
        let fills = self.fills_hole();
        Ends { differ: fills & differ, tell: !fills | (one > least) & (other > least) }
    }

    /// The part of F to which it is not trusted.
    #[inline(always)]
    fn margin(&self) -> f64 {
        let size = self.major + self.minor;
        CLOSE * (size * size * size * size)
    }

    /// F between two places of a line, as the sum of Bernstein's polynomials of degree four.
    #[inline(always)]
    fn bernstein(&self, way: &Way, from: f64, to: f64) -> [f64; 5] {
        let (across, o) = (way.d.truncate(), way.o.truncate());
        let major2 = 4.0 * self.major * self.major;
        let k = way.o.length_squared() + (self.major - self.minor) * (self.major + self.minor);
        // F and its derivatives at `from`, by powers of the part of the way
        let (h, s2) = (to - from, from * from + k);
        let a = s2 * s2 - major2 * (o + across * from).length_squared();
        let b = (4.0 * from * s2 - 2.0 * major2 * (o.dot(across) + across.length_squared() * from)) * h;
        let c = (4.0 * from * from + 2.0 * s2 - major2 * across.length_squared()) * (h * h);
        let (d, e) = (4.0 * from * (h * h * h), h * h * h * h);
        [a, a + 0.25 * b, a + 0.5 * b + c / 6.0, a + 0.75 * b + 0.5 * c + 0.25 * d, a + b + c + d + e]
    }

    /// Whether a line is in the tube on some part of its way from one place to another, and not on another; `None` if
    /// that is not for certain.
    ///
    /// Source of the bounds: Farin, "Curves and Surfaces for CAGD", 2002, sections 5.1 and 4.2: a polynomial lies
    /// between the least and the greatest of its Bernstein coefficients, and de Casteljau's way halves it.
    fn changes_sides(&self, way: &Way, [from, to]: [f64; 2]) -> Option<bool> {
        if !((to - from).abs() > CLOSE * (self.major + self.minor)) {
            return None;
        }
        if to < from {
            return Some(false);
        }
        match self.ends(way, [from, to]) {
            Ends { differ: true, .. } => return Some(true),
            Ends { tell: false, .. } => return None,
            Ends { .. } => {}
        }
        let margin = self.margin();
        let (mut is_in, mut is_out) = (false, self.fills_hole());
        let mut rest: ArrayVec<[f64; 5], HALVINGS> = ArrayVec::from_iter([self.bernstein(way, from, to)]);
        while let Some(of) = rest.pop() {
            let signs = Signs::of(&of, margin);
            (is_in, is_out) = (is_in | signs.is_in, is_out | signs.is_out);
            if is_in && is_out {
                return Some(true);
            }
            if signs.is_one {
                continue;
            }
            if rest.remaining_capacity() < 2 {
                return None;
            }
            let [first, second] = halves(&of);
            rest.extend([second, first]);
        }
        Some(false)
    }

    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        let at = self.frame.local(ray.o - self.center + ray.d * hit.t);
        // The direction to the point of the circle, then that to the surface of the tube
        let outwards = at.truncate().normalize_or(DVec2::X);
        let tube = DVec2::new(at.truncate().length() - self.major, at.z).normalize_or(DVec2::X);
        let from_axis = self.major + self.minor * tube.x;
        let world = |along: f64, z: f64| self.frame.world((outwards * along).extend(z));
        SolidPoint {
            p: self.center + world(from_axis, self.minor * tube.y),
            normal: world(tube.x, tube.y),
            uv: DVec2::new(turn(outwards.x, outwards.y), turn(tube.x, tube.y)),
            dpdu: self.frame.world(outwards.perp().extend(0.0)) * (2.0 * PI * from_axis),
            dpdv: world(-tube.y, tube.x) * (2.0 * PI * self.minor),
            edges: [UvEdge::Periodic; 2],
            terms: self.center.abs() + DVec3::splat(self.major + self.minor),
        }
    }

    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let reach = self.frame.disk_reach() * self.major + DVec3::splat(self.minor);
        Some([self.center - reach, self.center + reach])
    }

    /// The most that `d` . x is over it, to within rounding.
    pub fn support(&self, d: DVec3) -> f64 {
        self.center.dot(d) + self.major * self.frame.across(d) + self.minor * d.length()
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::{KnownSolid, Random, faults, made};
    use super::*;

    fn torus(center: DVec3, axis: DVec3, major: f64, minor: f64) -> Solid {
        made(|cx| TorusDesc { axis: axis.into(), ..TorusDesc::new(center.into(), major, minor) }.compile(cx))
    }

    fn distance(p: DVec3, axis: DVec3, major: f64, minor: f64) -> f64 {
        let z = p.dot(axis);
        DVec2::new((p - axis * z).length() - major, z).length() - minor
    }

    #[test]
    fn it_keeps_what_solids_promise() {
        let mut random = Random::new(1);
        for round in 0..24 {
            let center = if round % 4 == 3 { DVec3::new(148376.0, 1234.0, -223423.0) } else { DVec3::ZERO };
            let scale = [1e-3, 1.0, 1e6][round % 3];
            let axis = random.direction();
            // Thin ones, fat ones, and ones without a hole
            let (major, minor) = (scale, scale * [0.01, 0.3, 0.9, 1.0, 1.7][round % 5]);
            let distance = |p| distance(p - center, axis, major, minor);
            let size = major + minor;
            let known = KnownSolid { solid: torus(center, axis, major, minor), distance: &distance, center, size };
            let side = axis.any_orthonormal_vector();
            let around = |x: f64| {
                let (sin, cos) = pxfm::f_sincos(x * 2.0 * PI);
                side * cos + axis.cross(side) * sin
            };
            // Its highest circle, where rays along it touch, and its innermost one
            let rims = |x: f64| {
                let hole = if minor < major { major - minor } else { major + minor };
                center + if x < 0.5 { around(2.0 * x) * major + axis * minor } else { around(2.0 * x) * hole }
            };
            known.is_closed(5000, &rims, &|x| center + around(x) * major);
            if center.length() < 1e3 * scale {
                known.meets_rays(4000);
                known.derivatives_hold(4000);
                known.bounds_are_tight(8000, &|x| {
                    // It is a ball moved along the circle
                    let i = (x * 6.0) as usize;
                    let pole = [DVec3::X, DVec3::Y, DVec3::Z][i / 2] * if i.is_multiple_of(2) { minor } else { -minor };
                    center + around(x * 6.0) * major + pole
                });
            }
        }
    }

    #[test]
    fn all_four_crossings_are_found() {
        let (axis, mut random) = (DVec3::Y, Random::new(2));
        let mut four = 0;
        for _ in 0..20_000 {
            let minor = random.magnitude(1e-4, 0.9);
            let solid = torus(DVec3::ZERO, axis, 1.0, minor);
            // From one side through the tube, or just past it
            let o =
                DVec3::new(random.between(-3.0, -2.5), random.between(-0.5, 0.5) * minor, random.between(-0.3, 0.3));
            let target = DVec3::new(random.between(0.5, 1.5), minor * random.between(-1.05, 1.05), 0.0);
            let ray = DRay { o, d: (target - o).normalize() };
            let mut found = Vec::new();
            let mut after = 0.0;
            while let Some(hit) = solid.intersect(&ray, after, f64::INFINITY, false) {
                found.push(hit.t);
                after = hit.t;
            }
            // By small steps along the ray
            let (steps, mut expected) = (3000, 0);
            let mut inside = false;
            let mut shallow = f64::INFINITY;
            for i in 0..=steps {
                let d = distance(ray.at(6.0 * i as f64 / steps as f64), axis, 1.0, minor);
                shallow = if (d < 0.0) != inside { f64::INFINITY } else { shallow.min(d.abs()) };
                expected += usize::from((d < 0.0) != inside);
                inside = d < 0.0;
            }
            assert!(found.len() % 2 == 0 && found.len() >= expected, "{ray:?} {minor}: {found:?} {expected}");
            for t in &found {
                assert!(distance(ray.at(*t), axis, 1.0, minor).abs() < 1e-14);
            }
            four += usize::from(found.len() == 4);
        }
        assert!(four > 2000, "{four}");
    }

    #[test]
    fn what_blocks_is_what_is_met() {
        let mut random = Random::new(4);
        let (mut met, mut close) = (0, 0);
        for round in 0..100_000 {
            let minor = [1e-3, 0.05, 0.3, 0.7, 0.999, 1.0, 1.3][round % 7];
            let scale = [1e-3, 1.0, 1e5][round % 3];
            let center = if round % 5 == 0 { DVec3::new(5e5, -2e5, 1e5) } else { DVec3::ZERO };
            let solid = torus(center, random.direction(), scale, scale * minor);
            let Solid::Torus(of) = solid else { unreachable!("it is a torus") };
            let at = |random: &mut Random| center + random.direction() * (scale * random.between(0.0, 2.0));
            let (o, to) = (at(&mut random), at(&mut random));
            let ray = DRay { o, d: to - o };
            let t_max = [1.0, f64::INFINITY, random.between(0.0, 1.0)][round % 3];
            let is_met = solid.intersect(&ray, 0.0, t_max, false).is_some();
            assert_eq!(of.blocks(&ray, 0.0, t_max), is_met, "{round}");
            met += usize::from(is_met);
            let [is_through, is_told] = of.blocks_at_once(&ray, 0.0, t_max);
            assert!(!is_told || is_through == is_met, "{round}");
            if let Some(way) = of.way(&ray) {
                let is_told = of.changes_sides(&way, way.ends(0.0, f64::INFINITY)).is_some();
                close += usize::from(!is_told && minor < 1.0);
            }
        }
        // Roots are looked for where there are any doubts, and those are few
        assert!((20_000..80_000).contains(&met) && close < 1_000, "{met} {close}");
    }

    #[test]
    fn grazing_rays_are_decided_to_the_last_digits() {
        let mut random = Random::new(3);
        for _ in 0..10_000 {
            let minor = random.magnitude(1e-4, 0.9);
            let solid = torus(DVec3::ZERO, DVec3::Y, 1.0, minor);
            // Across the top of the tube, a little below and a little above; tangent to the outermost circle
            let gap = (minor * random.magnitude(1e-12, 1e-3)).max(1e-14);
            let rays = |sign: f64| {
                [
                    DRay { o: DVec3::new(0.0, minor + sign * gap, 4.0), d: DVec3::NEG_Z },
                    DRay { o: DVec3::new(1.0 + minor + sign * gap, 0.0, 4.0), d: DVec3::NEG_Z },
                    DRay { o: DVec3::new(1.0 + minor + sign * gap, 4.0, 0.0), d: DVec3::NEG_Y },
                ]
            };
            for ray in rays(1.0) {
                assert!(!solid.blocks(&ray, 0.0, f64::INFINITY), "{ray:?} {minor} {gap}");
            }
            for ray in rays(-1.0) {
                assert!(solid.blocks(&ray, 0.0, f64::INFINITY), "{ray:?} {minor} {gap}");
            }
        }
    }

    #[test]
    fn rays_leave_it() {
        let mut random = Random::new(4);
        for _ in 0..400 {
            let (scale, center) = (random.magnitude(1e-6, 1e6), random.in_ball() * random.magnitude(1e-8, 1e8));
            let minor = random.magnitude(0.1, 0.8);
            let solid = torus(center, random.direction(), scale, minor * scale);
            let known = KnownSolid { solid, distance: &|_| 0.0, center, size: (1.0 + minor) * scale };
            // Around the hole the surface curves towards the ray, no more than a circle of that radius
            known.is_left_by_rays(50, &|cos| 0.9 * cos * (1.0 - minor) / (1.0 + minor));
        }
    }

    #[test]
    fn the_texture_stands_upright() {
        let solid = torus(DVec3::ZERO, DVec3::Y, 2.0, 0.5);
        let look = |o: [f64; 3], d: [f64; 3]| {
            let ray = DRay { o: o.into(), d: d.into() };
            let hit = solid.intersect(&ray, 0.0, f64::INFINITY, true).expect("it is ahead");
            solid.point(&ray, &hit)
        };
        let outside = look([9.0, 0.0, 0.0], [-1.0, 0.0, 0.0]);
        assert!((outside.uv - DVec2::new(0.5, 0.5)).length() < 1e-15 && (outside.p.x - 2.5).abs() < 1e-15);
        assert!(outside.dpdu.normalize().dot(DVec3::NEG_Z) > 0.9999 && outside.dpdv.normalize().dot(DVec3::Y) > 0.9999);
        let top = look([0.0, 9.0, 2.0], [0.0, -1.0, 0.0]);
        assert!((top.uv - DVec2::new(0.25, 0.75)).length() < 1e-9 && (top.normal - DVec3::Y).length() < 1e-7);
    }

    #[test]
    fn radii_are_checked() {
        let found = faults(|cx| TorusDesc::new([0.0; 3], 0.0, -1.0).compile(cx));
        assert_eq!(found.iter().map(|f| f.0.as_str()).collect::<Vec<_>>(), ["major_radius", "minor_radius"]);
    }
}
