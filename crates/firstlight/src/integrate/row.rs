//! Intervals, quadratic forms and their roots along the rows of a light, for sixteen points at once.

use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::batch::Linear16;
use crate::math::Vec3x16;

/// An interval of x on each of sixteen rows; empty where `to` is less than `from`.
#[derive(Clone, Copy)]
pub(crate) struct Interval16<S: Simd> {
    pub from: f32x16<S>,
    pub to: f32x16<S>,
}

/// Beyond any x of a light.
pub(crate) const FAR: f32 = 1e30;

/// Slopes below this count as 0: their reciprocals overflow.
const FLAT: f32 = 1e-30;

impl<S: Simd> Interval16<S> {
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        Interval16 { from: simd.splat_f32x16(FAR), to: simd.splat_f32x16(-FAR) }
    }

    /// The hull of two intervals. Nearly empty intervals of `other` are left out: rounding makes such where a rim is
    /// seen edge on.
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

    /// Clips the interval to where `slope` x + `c` >= 0.
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

/// The quadratic form c + 2 (x X + y Y) + x^2 XX + 2 x y XY + y^2 YY, in lanes.
#[derive(Clone, Copy)]
pub(crate) struct Quadratic16<S: Simd> {
    pub(super) c: f32x16<S>,
    pub(super) x: f32x16<S>,
    pub(super) y: f32x16<S>,
    pub(super) xx: f32x16<S>,
    pub(super) xy: f32x16<S>,
    pub(super) yy: f32x16<S>,
}

/// Real roots: the smaller, the larger, and the lanes that have them.
#[derive(Clone, Copy)]
pub(crate) struct Roots<S: Simd> {
    pub low: f32x16<S>,
    pub high: f32x16<S>,
    pub any: mask32x16<S>,
}

/// Roots of a y^2 + 2 b y + c. A tiny number replaces a = 0, so that one root is far away and nothing is divided by 0.
#[inline(always)]
pub(super) fn roots<S: Simd>(a: f32x16<S>, b: f32x16<S>, c: f32x16<S>) -> Roots<S> {
    let simd = a.token();
    let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
    let least = (b.abs() + c.abs()) * 1e-12 + f32::MIN_POSITIVE;
    // The sign of a zero does not count: forms with a >= 0 are those that open beyond their roots
    let tiny = a.simd_lt(zero).select(-least, least);
    let a = a.abs().simd_lt(least).select(tiny, a);
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

    /// The square of a linear quantity.
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

    /// `k` times the form plus `m` times `o`.
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

    /// A form that is negative everywhere.
    #[inline(always)]
    pub(super) fn below_0(simd: S) -> Self {
        let (zero, minus) = (simd.splat_f32x16(0.0), simd.splat_f32x16(-1.0));
        Quadratic16 { c: minus, x: zero, y: zero, xx: minus, xy: zero, yy: minus }
    }

    #[inline(always)]
    pub(super) fn select(is: mask32x16<S>, a: Self, b: Self) -> Self {
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

    /// The interval inside of a cone on sixteen rows: where the form and `ahead` are positive.
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

    /// The roots on the rows `y`.
    #[inline(always)]
    pub fn on_row(&self, y: f32x16<S>) -> Roots<S> {
        roots(self.xx, y * self.xy + self.x, y * (y * self.yy + self.y * 2.0) + self.c)
    }

    /// The y at which the form is 0 on the line x = `x`.
    #[inline(always)]
    pub(super) fn crossings(&self, x: f32x16<S>) -> Roots<S> {
        roots(self.yy, x * self.xy + self.y, x * (x * self.xx + self.x * 2.0) + self.c)
    }

    /// The rows that touch the curve on which the form is 0.
    #[inline(always)]
    pub(super) fn tangents(&self) -> Roots<S> {
        roots(
            self.xy * self.xy - self.xx * self.yy,
            self.x * self.xy - self.xx * self.y,
            self.x * self.x - self.xx * self.c,
        )
    }
}

/// Steps of the root finder.
const REFINED: usize = 4;

/// The root of `f` between `a` and `b`, at which it has the values `fa` and `fb` of different signs.
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

/// The projection of a polygon with these corners onto a light: the place (x, y) is hidden where all five linear
/// functions, of the plane and of the four edges, are 0 or more.
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
