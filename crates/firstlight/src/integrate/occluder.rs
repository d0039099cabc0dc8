//! Things in the way of a light: what they hide of it, row by row, for sixteen points at once.
//!
//! What a point sees of a convex thing on a light's plane is convex, so a row of the light has one hidden interval at
//! most, and its ends are roots of a linear function or of a quadratic. What has a hole hides two.
//!
//! Source of the quadratic of a sphere: the cone that touches it, r^2 |l|^2 - |l x s|^2 >= 0, as in Heidrich, Brabec,
//! Seidel, "Soft Shadow Maps for Linear Lights", 2000, for one row; the rest is ours.

use std::f32::consts::PI;

use arrayvec::ArrayVec;
use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::batch::{Block, Linear16, ViewNumber, Views};
use super::hull::{Hull, SolidOccluder};
use super::torus::TorusShadow;
use crate::math::{DVec3, Vec3, Vec3x16, sin_cos};
use crate::shape::Canonical;

/// A vector of doubles as two of floats: the difference to a point loses nothing where the two are close.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Exact {
    high: Vec3,
    low: Vec3,
}

impl Exact {
    pub fn new(v: DVec3) -> Exact {
        let high = v.as_vec3();
        Exact { high, low: (v - high.as_dvec3()).as_vec3() }
    }

    /// The way there from sixteen points.
    #[inline(always)]
    pub fn seen_from<S: Simd>(self, simd: S, p: Vec3x16<S>) -> Vec3x16<S> {
        let (h, l) = (Vec3x16::splat(simd, self.high), Vec3x16::splat(simd, self.low));
        Vec3x16 { x: (h.x - p.x) + l.x, y: (h.y - p.y) + l.y, z: (h.z - p.z) + l.z }
    }
}

/// A thing that may stand in the way.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Occluder {
    Sphere {
        center: Exact,
        radius: f32,
    },
    /// A parallelogram by its corners, around.
    Flat {
        corners: [Exact; 4],
    },
    Solid(SolidOccluder),
}

/// The ways to four corners from sixteen points.
#[inline(always)]
pub(crate) fn corners_from<S: Simd>(simd: S, [a, b, c, d]: &[Exact; 4], p: Vec3x16<S>) -> [Vec3x16<S>; 4] {
    [a.seen_from(simd, p), b.seen_from(simd, p), c.seen_from(simd, p), d.seen_from(simd, p)]
}

/// An interval of x on each of sixteen rows; empty where it ends before it begins.
#[derive(Clone, Copy)]
pub(crate) struct Interval16<S: Simd> {
    pub from: f32x16<S>,
    pub to: f32x16<S>,
}

/// Farther than any x that is asked about.
pub(crate) const FAR: f32 = 1e30;
/// Slopes below this are none: their reciprocals have no bound.
const FLAT: f32 = 1e-30;

impl<S: Simd> Interval16<S> {
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        Interval16 { from: simd.splat_f32x16(FAR), to: simd.splat_f32x16(-FAR) }
    }

    /// The hull of two intervals, those aside that are as good as empty: rounding makes such where a rim is seen edge
    /// on, far from all else.
    #[inline(always)]
    pub fn join(&mut self, other: &Self) {
        let is_there = (other.to - other.from).simd_gt((other.from.abs() + other.to.abs()) * 1e-3);
        self.from = is_there.select(self.from.min(other.from), self.from);
        self.to = is_there.select(self.to.max(other.to), self.to);
    }

    #[inline(always)]
    pub fn all(simd: S) -> Self {
        Interval16 { from: simd.splat_f32x16(-FAR), to: simd.splat_f32x16(FAR) }
    }

    /// What is left where `slope` x + `c` >= 0.
    #[inline(always)]
    pub fn clip(&mut self, c: f32x16<S>, slope: f32x16<S>) {
        let simd = c.token();
        let (far, zero) = (simd.splat_f32x16(FAR), simd.splat_f32x16(0.0));
        let (rises, falls) = (slope.simd_gt(FLAT), slope.simd_lt(-FLAT));
        let is_level = !(rises | falls);
        let edge = -c / is_level.select(simd.splat_f32x16(1.0), slope);
        self.from = rises.select(self.from.max(edge), self.from);
        self.to = falls.select(self.to.min(edge), self.to);
        self.to = (is_level & c.simd_lt(zero)).select(-far, self.to);
    }
}

/// c + 2 (x X + y Y) + x^2 XX + 2 x y XY + y^2 YY, in lanes.
#[derive(Clone, Copy)]
pub(crate) struct Quadratic16<S: Simd> {
    c: f32x16<S>,
    x: f32x16<S>,
    y: f32x16<S>,
    xx: f32x16<S>,
    xy: f32x16<S>,
    yy: f32x16<S>,
}

/// Real roots: the smaller and the larger, and where there are any.
#[derive(Clone, Copy)]
pub(crate) struct Roots<S: Simd> {
    pub low: f32x16<S>,
    pub high: f32x16<S>,
    pub any: mask32x16<S>,
}

/// Where a y^2 + 2 b y + c is 0. Not quite 0 stands for a = 0, so that one root may be far away and nothing is divided
/// by 0.
#[inline(always)]
fn roots<S: Simd>(a: f32x16<S>, b: f32x16<S>, c: f32x16<S>) -> Roots<S> {
    let simd = a.token();
    let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
    let least = (b.abs() + c.abs()) * 1e-12 + f32::MIN_POSITIVE;
    let a = a.abs().simd_lt(least).select(least.copysign(a), a);
    let discriminant = b * b - c * a;
    let root = discriminant.max(zero).sqrt();
    // -(b + sign(b) root): nothing cancels
    let q = b.simd_lt(zero).select(root - b, -(root + b));
    let first = q / a;
    let is_zero = q.simd_eq(zero);
    let second = is_zero.select(zero, c / is_zero.select(one, q));
    Roots { low: first.min(second), high: first.max(second), any: discriminant.simd_gt(zero) }
}

impl<S: Simd> Quadratic16<S> {
    /// The product of two vectors that are linear over the light.
    #[inline(always)]
    pub fn dot(p: [Vec3x16<S>; 3], q: [Vec3x16<S>; 3]) -> Self {
        Quadratic16 {
            c: p[0].dot(q[0]),
            x: (p[0].dot(q[1]) + p[1].dot(q[0])) * 0.5,
            y: (p[0].dot(q[2]) + p[2].dot(q[0])) * 0.5,
            xx: p[1].dot(q[1]),
            xy: (p[1].dot(q[2]) + p[2].dot(q[1])) * 0.5,
            yy: p[2].dot(q[2]),
        }
    }

    /// The product of two things that are linear over the light.
    #[inline(always)]
    pub fn product(p: &Linear16<S>, q: &Linear16<S>) -> Self {
        Quadratic16 {
            c: p.c * q.c,
            x: (p.c * q.x + p.x * q.c) * 0.5,
            y: (p.c * q.y + p.y * q.c) * 0.5,
            xx: p.x * q.x,
            xy: (p.x * q.y + p.y * q.x) * 0.5,
            yy: p.y * q.y,
        }
    }

    /// What is linear over the light.
    #[inline(always)]
    fn line(line: &Linear16<S>) -> Self {
        let zero = line.c.token().splat_f32x16(0.0);
        Quadratic16 { c: line.c, x: line.x * 0.5, y: line.y * 0.5, xx: zero, xy: zero, yy: zero }
    }

    /// The square of what is linear over the light.
    #[inline(always)]
    pub fn square(line: &Linear16<S>) -> Self {
        Quadratic16 {
            c: line.c * line.c,
            x: line.c * line.x,
            y: line.c * line.y,
            xx: line.x * line.x,
            xy: line.x * line.y,
            yy: line.y * line.y,
        }
    }

    #[inline(always)]
    pub fn combined(self, k: f32x16<S>, o: Self, m: f32x16<S>) -> Self {
        Quadratic16 {
            c: self.c * k + o.c * m,
            x: self.x * k + o.x * m,
            y: self.y * k + o.y * m,
            xx: self.xx * k + o.xx * m,
            xy: self.xy * k + o.xy * m,
            yy: self.yy * k + o.yy * m,
        }
    }

    /// One that is below 0 everywhere.
    #[inline(always)]
    fn below_0(simd: S) -> Self {
        let (zero, minus) = (simd.splat_f32x16(0.0), simd.splat_f32x16(-1.0));
        Quadratic16 { c: minus, x: zero, y: zero, xx: minus, xy: zero, yy: minus }
    }

    #[inline(always)]
    fn select(is: mask32x16<S>, a: Self, b: Self) -> Self {
        Quadratic16 {
            c: is.select(a.c, b.c),
            x: is.select(a.x, b.x),
            y: is.select(a.y, b.y),
            xx: is.select(a.xx, b.xx),
            xy: is.select(a.xy, b.xy),
            yy: is.select(a.yy, b.yy),
        }
    }

    #[inline(always)]
    pub fn at(&self, x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
        self.c + (x * self.x + y * self.y) * 2.0 + x * x * self.xx + x * y * self.xy * 2.0 + y * y * self.yy
    }

    /// What is inside of a cone on sixteen rows: where the quadratic is above 0 and `ahead` as well.
    #[inline(always)]
    pub fn cone_on_row(&self, simd: S, ahead: &Linear16<S>, y: f32x16<S>) -> Interval16<S> {
        let (zero, far) = (simd.splat_f32x16(0.0), simd.splat_f32x16(FAR));
        let Roots { low, high, any } = self.on_row(y);
        // Between the roots, or beyond one of them
        let is_between = self.xx.simd_lt(zero);
        let is_ahead = ahead.x.simd_gt(zero);
        let all = Interval16::all(simd);
        let mut interval = Interval16 {
            from: is_between.select(any.select(low, far), (any & is_ahead).select(high, all.from)),
            to: is_between.select(any.select(high, -far), (any & !is_ahead).select(low, all.to)),
        };
        interval.clip(y * ahead.y + ahead.c, ahead.x);
        interval
    }

    #[inline(always)]
    pub fn on_row(&self, y: f32x16<S>) -> Roots<S> {
        roots(self.xx, y * self.xy + self.x, y * (y * self.yy + self.y * 2.0) + self.c)
    }

    /// The rows on which the line x = `x` crosses 0.
    #[inline(always)]
    fn crossings(&self, x: f32x16<S>) -> Roots<S> {
        roots(self.yy, x * self.xy + self.y, x * (x * self.xx + self.x * 2.0) + self.c)
    }

    /// The rows that only touch 0.
    #[inline(always)]
    fn tangents(&self) -> Roots<S> {
        roots(
            self.xy * self.xy - self.xx * self.yy,
            self.x * self.xy - self.xx * self.y,
            self.x * self.x - self.xx * self.c,
        )
    }
}

/// Sides of cells that are halves of ellipses: x + `origin[0]` = `width` sqrt(1 - (y + `origin[1]`)^2), one on each
/// side.
#[derive(Clone, Copy)]
pub(crate) struct RoundSides<S: Simd> {
    pub width: [f32x16<S>; 2],
    pub origin: [f32x16<S>; 2],
}

/// Rows at which something begins, ends, has a corner, or meets the sides of cells; not a number where there is none.
pub(crate) struct Breaks<'a, S: Simd> {
    /// The sides of the cells, if they are straight, or of boxes around them.
    pub x: [f32x16<S>; 2],
    pub is_straight: bool,
    /// Their first and last rows.
    pub y: [f32x16<S>; 2],
    pub round: Option<RoundSides<S>>,
    /// Whose rows are looked for.
    pub of: mask32x16<S>,
    pub rows: &'a mut Vec<Block>,
}

/// Round sides are looked at in so many places, evenly in their angle.
const PLACES: usize = 13;
/// Sine and cosine of those angles, from -pi/2 to pi/2: steps of 15 degrees.
const ANGLES: [[f32; 2]; PLACES] = {
    const QUARTER: [f32; 7] = [0.0, 0.258_819_04, 0.5, 0.707_106_77, 0.866_025_4, 0.965_925_8, 1.0];
    let mut angles = [[0.0; 2]; PLACES];
    let mut i = 0;
    while i < 7 {
        angles[6 + i] = [QUARTER[i], QUARTER[6 - i]];
        angles[6 - i] = [-QUARTER[i], QUARTER[6 - i]];
        i += 1;
    }
    angles
};

/// In radians: from one of those angles to the next.
const STEP: f32 = PI / (PLACES - 1) as f32;
/// How often a root between two places is looked for.
const REFINED: usize = 4;

/// The place of a round side that lies so far on, in radians, from an angle with that sine and cosine.
#[inline(always)]
fn on_arc<S: Simd>(
    t: f32x16<S>,
    [from_sin, from_cos]: [f32; 2],
    width: f32x16<S>,
    origin: [f32x16<S>; 2],
) -> [f32x16<S>; 2] {
    let (s, c) = sin_cos(t);
    [width * (c * from_cos - s * from_sin) - origin[0], s * from_cos + c * from_sin - origin[1]]
}

/// Where `f` is 0 between two places at which it has different signs, and these values.
///
/// Source: the Illinois method, Dowell, Jarratt, "A modified regula falsi method for computing the root of an
/// equation", 1971.
#[inline(always)]
pub(super) fn root_between<S: Simd>(
    [mut a, mut b]: [f32x16<S>; 2],
    [mut fa, mut fb]: [f32x16<S>; 2],
    f: impl Fn(f32x16<S>) -> f32x16<S>,
) -> f32x16<S> {
    let (zero, mut t) = (a.token().splat_f32x16(0.0), a);
    for _ in 0..REFINED {
        t = a + (b - a) * (fa / (fa - fb));
        let ft = f(t);
        // The root is before t, or after it; the end that stays counts half
        let is_first = ft.simd_lt(zero) ^ fa.simd_lt(zero);
        (b, fb) = (is_first.select(t, b), is_first.select(ft, fb * 0.5));
        (a, fa) = (is_first.select(a, t), is_first.select(fa * 0.5, ft));
    }
    t
}

impl<S: Simd> Breaks<'_, S> {
    /// The sides that are straight.
    #[inline(always)]
    fn straight(&self) -> ArrayVec<f32x16<S>, 2> {
        let mut sides = ArrayVec::new();
        if self.is_straight {
            sides.extend(self.x);
        }
        sides
    }

    #[inline(always)]
    pub fn tell_if(&mut self, row: f32x16<S>, is: mask32x16<S>) {
        self.rows.push((is & self.of).select(row, row.token().splat_f32x16(f32::NAN)).to_array());
    }

    #[inline(always)]
    pub fn quadratic(&mut self, quadratic: &Quadratic16<S>, of: mask32x16<S>) {
        let tangents = quadratic.tangents();
        for y in [tangents.low, tangents.high] {
            // Where the row touches
            let x = -(y * quadratic.xy + quadratic.x) / quadratic.xx;
            let room = (self.x[1] - self.x[0]) * 1e-3;
            self.tell_if(y, of & tangents.any & x.simd_gt(self.x[0] - room) & x.simd_lt(self.x[1] + room));
        }
        for x in self.straight() {
            let crossings = quadratic.crossings(x);
            self.tell_if(crossings.low, of & crossings.any);
            self.tell_if(crossings.high, of & crossings.any);
        }
        self.on_round_sides(quadratic, of, &[]);
    }

    /// Where a quadratic is 0 on round sides, and some lines are above it. Not inlined: one copy for each instruction
    /// set is enough.
    #[inline(never)]
    fn on_round_sides(&mut self, quadratic: &Quadratic16<S>, of: mask32x16<S>, inside: &[Linear16<S>]) {
        let Some(sides) = self.round else { return };
        self.of.token().vectorize(
            #[inline(always)]
            || {
                for width in sides.width {
                    self.on_side(quadratic, of, inside, width, sides.origin);
                }
            },
        );
    }

    #[inline(always)]
    fn on_side(
        &mut self,
        quadratic: &Quadratic16<S>,
        of: mask32x16<S>,
        inside: &[Linear16<S>],
        width: f32x16<S>,
        origin: [f32x16<S>; 2],
    ) {
        let simd = width.token();
        let zero = simd.splat_f32x16(0.0);
        let mut before = zero;
        for (k, [sin, cos]) in ANGLES.iter().enumerate() {
            let here = quadratic.at(width * *cos - origin[0], *sin - origin[1]);
            let changes = of & (here.simd_lt(zero) ^ before.simd_lt(zero));
            if k > 0 && changes.any_true() {
                let from = ANGLES[k - 1];
                let root = root_between(
                    [zero, simd.splat_f32x16(STEP)],
                    [before, here],
                    #[inline(always)]
                    |t| {
                        let [x, y] = on_arc(t, from, width, origin);
                        quadratic.at(x, y)
                    },
                );
                let [x, y] = on_arc(root, from, width, origin);
                let mut is = changes;
                for line in inside {
                    is &= line.at(x, y).simd_ge((line.c.abs() + line.x.abs() + line.y.abs()) * -1e-3);
                }
                self.tell_if(y, is);
            }
            before = here;
        }
    }

    /// The corners of a flat thing, and where its sides cross those of a cell.
    #[inline(always)]
    pub fn polygon(&mut self, lines: &[Linear16<S>; 5]) {
        let zero = lines[0].c.token().splat_f32x16(0.0);
        for (i, p) in lines.iter().enumerate() {
            for x in self.straight() {
                let y = -(p.c + x * p.x) / p.y;
                self.tell_if(y, is_inside(lines, x, y, [i, i]));
            }
            if self.round.is_some() {
                self.on_round_sides(&Quadratic16::line(p), self.of, lines);
            }
        }
        for (i, j) in [(0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1)] {
            let (p, q) = (&lines[i], &lines[j]);
            let area = p.x * q.y - p.y * q.x;
            let (x, y) = ((p.y * q.c - p.c * q.y) / area, (p.c * q.x - q.c * p.x) / area);
            let is_beside = x.simd_ge(self.x[0]) & x.simd_le(self.x[1]);
            self.tell_if(y, !area.simd_eq(zero) & is_beside & is_inside(lines, x, y, [i, j]));
        }
    }

    /// Where a line crosses the sides of a cell.
    #[inline(always)]
    pub fn line(&mut self, line: &Linear16<S>) {
        let all = self.of;
        for x in self.straight() {
            self.tell_if(-(line.c + x * line.x) / line.y, all);
        }
        if self.round.is_some() {
            self.on_round_sides(&Quadratic16::line(line), all, &[]);
        }
    }
}

/// A thing as sixteen points see it on a light.
pub(crate) enum Shadow<S: Simd> {
    /// Of a sphere.
    Cone {
        quadratic: Quadratic16<S>,
        ahead: Linear16<S>,
        /// Where the light's plane cuts the sphere of any of the points: what is behind the light's places, and what is
        /// inside of the sphere; and whose it is.
        cut: Option<([Quadratic16<S>; 2], mask32x16<S>)>,
        /// Inside of the sphere, for points within it.
        inside: Quadratic16<S>,
    },
    /// Of a flat thing: above 0 on all of these lines. The first is that of its plane.
    Edges {
        lines: [Linear16<S>; 5],
    },
    Hull(Hull<S>),
    Torus(TorusShadow<S>),
}

/// What has to be 0 or more on a light for a flat thing with these corners, around, to be in the way: behind its plane,
/// inside of all its sides.
#[inline(always)]
pub(crate) fn edges<S: Simd>(q: [Vec3x16<S>; 4], l: &[Vec3x16<S>; 3]) -> [Linear16<S>; 5] {
    let simd = q[0].x.token();
    let zero = simd.splat_f32x16(0.0);
    // The plane: l has to pass it. The sides turn with it
    let n = (q[1] - q[0]).cross(q[3] - q[0]);
    let distance = n.dot(q[0]);
    let sign = distance.simd_lt(zero).select(simd.splat_f32x16(-1.0), simd.splat_f32x16(1.0));
    let mut lines = [Linear16::along(n * sign, l); 5];
    lines[0].c -= distance.abs();
    for i in 0..4 {
        lines[i + 1] = Linear16::along(q[i].cross(q[(i + 1) % 4]) * sign, l);
    }
    lines
}

/// Whether a place is inside of all lines but two, or nearly so.
#[inline(always)]
fn is_inside<S: Simd>(lines: &[Linear16<S>; 5], x: f32x16<S>, y: f32x16<S>, but: [usize; 2]) -> mask32x16<S> {
    let mut is = x.simd_eq(x);
    for (i, line) in lines.iter().enumerate() {
        if i != but[0] && i != but[1] {
            is &= line.at(x, y).simd_ge((line.c.abs() + line.x.abs() + line.y.abs()) * -1e-6);
        }
    }
    is
}

/// The three vectors of a view.
#[inline(always)]
pub(crate) fn ways<S: Simd>(simd: S, views: &impl Views) -> [Vec3x16<S>; 3] {
    use ViewNumber::*;
    // Written out, here and below: a map of an array is not inlined, and each operation becomes a call
    [views.vectors(simd, [L0x, L0y, L0z]), views.vectors(simd, [Ax, Ay, Az]), views.vectors(simd, [Bx, By, Bz])]
}

impl<S: Simd> Shadow<S> {
    /// What `occluder` does to lights with these ways, from `p`.
    #[inline(always)]
    pub fn new(simd: S, occluder: &Occluder, p: Vec3x16<S>, l: &[Vec3x16<S>; 3]) -> Shadow<S> {
        match occluder {
            Occluder::Sphere { center, radius } => Shadow::cone(simd, center.seen_from(simd, p), *radius, l),
            Occluder::Flat { corners } => Shadow::Edges { lines: edges(corners_from(simd, corners, p), l) },
            Occluder::Solid(solid) => {
                let (to, l) = solid.seen_from(simd, p, l);
                match solid.kind {
                    Canonical::Ball => Shadow::cone(simd, to, 1.0, &l),
                    Canonical::Torus { tube } => Shadow::Torus(TorusShadow::new(to, &l, tube)),
                    _ => Shadow::Hull(Hull::new(solid, to, &l)),
                }
            }
        }
    }

    /// Of a sphere, `s` the way to its middle. Not inlined: one copy for each instruction set is enough.
    #[inline(never)]
    pub fn cone(simd: S, s: Vec3x16<S>, r: f32, l: &[Vec3x16<S>; 3]) -> Shadow<S> {
        simd.vectorize(
            #[inline(always)]
            || Shadow::cone_now(simd, s, r, l),
        )
    }

    #[inline(always)]
    fn cone_now(simd: S, s: Vec3x16<S>, r: f32, l: &[Vec3x16<S>; 3]) -> Shadow<S> {
        let r2 = r * r;
        let cross = [l[0].cross(s), l[1].cross(s), l[2].cross(s)];
        let ll = Quadratic16::dot(*l, *l);
        let ahead = Linear16 { c: s.dot(l[0]), x: s.dot(l[1]), y: s.dot(l[2]) };
        // r^2 |l|^2 - |l x s|^2 is (r^2 - |s|^2) |l|^2 + (l.s)^2, which is small by itself where the point is close
        let power = simd.splat_f32x16(r2) - s.dot(s);
        let squared = Quadratic16::square(&ahead);
        let (one, minus) = (simd.splat_f32x16(1.0), simd.splat_f32x16(-1.0));
        let near = ll.combined(power, squared, one);
        let far = ll.combined(simd.splat_f32x16(r2), Quadratic16::dot(cross, cross), minus);
        let quadratic = Quadratic16::select(power.abs().simd_lt(0.5 * r2), near, far);
        // r^2 - |l - s|^2
        let from_center = [l[0] - s, l[1], l[2]];
        let inside = Quadratic16::dot(from_center, from_center);
        let inside = Quadratic16 {
            c: simd.splat_f32x16(r2) - inside.c,
            x: -inside.x,
            y: -inside.y,
            xx: -inside.xx,
            xy: -inside.xy,
            yy: -inside.yy,
        };
        // How far the middle is from the light's plane
        let n = l[1].cross(l[2]);
        let off = n.dot(from_center[0]);
        let cuts = (off * off).simd_lt(n.dot(n) * r2);
        // What is all beyond that plane hides nothing
        let is_beyond = (off * n.dot(l[0])).simd_lt(0.0) & !cuts;
        let quadratic = Quadratic16::select(is_beyond, Quadratic16::below_0(simd), quadratic);
        let cut = if cuts.any_true() {
            let zero = simd.splat_f32x16(0.0);
            let ls = Quadratic16 { c: ahead.c, x: ahead.x * 0.5, y: ahead.y * 0.5, xx: zero, xy: zero, yy: zero };
            Some(([ll.combined(one, ls, minus), inside], cuts))
        } else {
            None
        };
        Shadow::Cone { quadratic, ahead, cut, inside }
    }

    /// What is hidden of sixteen rows, seen from outside: one interval, or two around a hole.
    #[inline(always)]
    pub fn hidden(&self, simd: S, y: f32x16<S>) -> [Interval16<S>; 2] {
        match self {
            Shadow::Hull(hull) => hull.hidden(simd, y),
            Shadow::Torus(torus) => torus.hidden(simd, y),
            Shadow::Edges { .. } | Shadow::Cone { .. } => [self.interval(simd, y), Interval16::none(simd)],
        }
    }

    /// Whether what is hidden may have a hole.
    pub fn has_hole(&self) -> bool {
        match self {
            Shadow::Hull(hull) => hull.has_hole(),
            Shadow::Torus(_) => true,
            Shadow::Cone { .. } | Shadow::Edges { .. } => false,
        }
    }

    /// What a convex thing hides of sixteen rows.
    #[inline(always)]
    fn interval(&self, simd: S, y: f32x16<S>) -> Interval16<S> {
        match self {
            Shadow::Hull(hull) => hull.hidden(simd, y)[0],
            Shadow::Torus(torus) => torus.hidden(simd, y)[0],
            Shadow::Edges { lines } => {
                let mut interval = Interval16::all(simd);
                for line in lines {
                    interval.clip(y * line.y + line.c, line.x);
                }
                interval
            }
            Shadow::Cone { quadratic, ahead, cut, .. } => {
                let far = simd.splat_f32x16(FAR);
                let interval = quadratic.cone_on_row(simd, ahead, y);
                let Some(([before, inside], cuts)) = cut else { return interval };
                // Without what is behind the light, and with what is inside the sphere: together they are convex again
                let b = before.on_row(y);
                let any = b.any & *cuts;
                let from =
                    (any & interval.from.simd_gt(b.low) & interval.from.simd_lt(b.high)).select(b.high, interval.from);
                let to = (any & interval.to.simd_gt(b.low) & interval.to.simd_lt(b.high)).select(b.low, interval.to);
                let is_left = from.simd_lt(to);
                let i = inside.on_row(y);
                let any = i.any & *cuts;
                let (i0, i1) = (any.select(i.low, far), any.select(i.high, -far));
                Interval16 { from: is_left.select(from, far).min(i0), to: is_left.select(to, -far).max(i1) }
            }
        }
    }

    /// What is seen of sixteen rows from within a sphere.
    #[inline(always)]
    pub fn within(&self, simd: S, y: f32x16<S>) -> Interval16<S> {
        let far = simd.splat_f32x16(FAR);
        match self {
            Shadow::Edges { .. } | Shadow::Hull(_) | Shadow::Torus(_) => Interval16::all(simd),
            Shadow::Cone { inside, .. } => {
                let i = inside.on_row(y);
                Interval16 { from: i.any.select(i.low, far), to: i.any.select(i.high, -far) }
            }
        }
    }

    /// Whether a place of the light is hidden, seen from outside.
    #[inline(always)]
    pub fn hides(&self, x: f32x16<S>, y: f32x16<S>) -> mask32x16<S> {
        let zero = x.token().splat_f32x16(0.0);
        match self {
            Shadow::Edges { lines } => {
                let mut all = x.simd_eq(x);
                for line in lines {
                    all &= line.at(x, y).simd_ge(zero);
                }
                all
            }
            Shadow::Hull(hull) => hull.hides(x, y),
            Shadow::Torus(torus) => torus.hides(x, y),
            Shadow::Cone { quadratic, ahead, cut, .. } => {
                let on_line = quadratic.at(x, y).simd_ge(zero) & ahead.at(x, y).simd_gt(zero);
                match cut {
                    None => on_line,
                    Some(([before, inside], cuts)) => {
                        on_line & (before.at(x, y).simd_gt(zero) | !*cuts) | inside.at(x, y).simd_ge(zero) & *cuts
                    }
                }
            }
        }
    }

    /// Of a disk light, counted from (`x`, `y`): x^2 + y^2 <= 1.
    #[inline(always)]
    pub fn rim(origin: [f32x16<S>; 2]) -> Quadratic16<S> {
        let [x, y] = origin;
        let simd = x.token();
        let (zero, minus) = (simd.splat_f32x16(0.0), simd.splat_f32x16(-1.0));
        Quadratic16 { c: simd.splat_f32x16(1.0) - (x * x + y * y), x: -x, y: -y, xx: minus, xy: zero, yy: minus }
    }

    /// Whether a place of the light is inside of a sphere; of flat things nothing is.
    #[inline(always)]
    pub fn holds(&self, x: f32x16<S>, y: f32x16<S>) -> mask32x16<S> {
        let zero = x.token().splat_f32x16(0.0);
        match self {
            Shadow::Edges { .. } | Shadow::Hull(_) | Shadow::Torus(_) => x.simd_lt(x),
            Shadow::Cone { inside, .. } => inside.at(x, y).simd_gt(zero),
        }
    }

    /// Tells the rows at which the hidden part begins, ends, has a corner or meets the sides of a cell; some in vain.
    #[inline(always)]
    pub fn breaks(&self, breaks: &mut Breaks<S>) {
        match self {
            Shadow::Cone { quadratic, cut, .. } => {
                breaks.quadratic(quadratic, breaks.of);
                if let Some(([before, inside], cuts)) = cut {
                    breaks.quadratic(before, *cuts);
                    breaks.quadratic(inside, *cuts);
                }
            }
            Shadow::Edges { lines } => breaks.polygon(lines),
            Shadow::Hull(hull) => hull.breaks(breaks),
            Shadow::Torus(torus) => torus.breaks(breaks),
        }
    }
}
