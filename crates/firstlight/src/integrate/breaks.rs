//! Break points of a cell: rows at which the outline of an occluder begins, ends, has a corner or leaves the cell.
//! Panels end there, so that the integrand is smooth within each.

use std::f32::consts::PI;

use arrayvec::ArrayVec;
use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::batch::{LaneNumbers, Linear16};
use super::row::{Quadratic16, root_between};
use crate::math::sin_cos;

/// Sides of cells that are half ellipses: x + `origin[0]` = `width` sqrt(1 - (y + `origin[1]`)^2), one for each
/// `width`.
#[derive(Clone, Copy)]
pub(crate) struct RoundSides<S: Simd> {
    pub width: [f32x16<S>; 2],
    pub origin: [f32x16<S>; 2],
}

/// Break points of sixteen cells; not a number where a lane has none.
pub(crate) struct Breaks<'a, S: Simd> {
    /// The sides of the cells if they are straight, else of their bounding boxes.
    pub x: [f32x16<S>; 2],
    pub is_straight: bool,
    pub round: Option<RoundSides<S>>,
    /// The lanes whose break points are added.
    pub of: mask32x16<S>,
    pub rows: &'a mut Vec<LaneNumbers>,
}

/// Round sides are sampled at so many angles, evenly spaced, to bracket roots.
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

/// In radians: between two of those angles.
const STEP: f32 = PI / (PLACES - 1) as f32;

/// The place of a round side `t` radians beyond the angle with that sine and cosine.
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
    pub fn add_if(&mut self, row: f32x16<S>, is: mask32x16<S>) {
        self.rows.push((is & self.of).select(row, row.token().splat_f32x16(f32::NAN)).to_array());
    }

    #[inline(always)]
    pub fn quadratic(&mut self, quadratic: &Quadratic16<S>, of: mask32x16<S>) {
        let tangents = quadratic.tangents();
        for y in [tangents.low, tangents.high] {
            // Where the row touches
            let x = -(y * quadratic.xy + quadratic.x) / quadratic.xx;
            let room = (self.x[1] - self.x[0]) * 1e-3;
            self.add_if(y, of & tangents.any & x.simd_gt(self.x[0] - room) & x.simd_lt(self.x[1] + room));
        }
        for x in self.straight() {
            let crossings = quadratic.crossings(x);
            self.add_if(crossings.low, of & crossings.any);
            self.add_if(crossings.high, of & crossings.any);
        }
        self.on_round_sides(quadratic, of);
    }

    /// Zeros of a quadratic on round sides. Not inlined: one copy for each instruction set is enough.
    #[inline(never)]
    fn on_round_sides(&mut self, quadratic: &Quadratic16<S>, of: mask32x16<S>) {
        let Some(sides) = self.round else { return };
        self.of.token().vectorize(
            #[inline(always)]
            || {
                for width in sides.width {
                    self.on_side(quadratic, of, width, sides.origin);
                }
            },
        );
    }

    /// Intersections of a line with round sides, of those that `matters` selects. On a side the line is a cos t + b sin
    /// t + c.
    #[inline(always)]
    fn line_on_round_sides(&mut self, line: &Linear16<S>, matters: impl Fn(f32x16<S>, f32x16<S>) -> mask32x16<S>) {
        let Some(RoundSides { width, origin }) = self.round else { return };
        let zero = line.c.token().splat_f32x16(0.0);
        let (b, c) = (line.y, line.c - (origin[0] * line.x + origin[1] * line.y));
        for width in width {
            let a = width * line.x;
            let length2 = a * a + b * b;
            let square = length2 - c * c;
            let root = square.max(zero).sqrt();
            for root in [root, -root] {
                let (cos, sin) = (-(a * c + b * root) / length2, (a * root - b * c) / length2);
                let (x, y) = (width * cos - origin[0], sin - origin[1]);
                let is = square.simd_gt(zero) & cos.simd_ge(zero) & matters(x, y);
                if is.any_true() {
                    self.add_if(y, is);
                }
            }
        }
    }

    #[inline(always)]
    fn on_side(&mut self, quadratic: &Quadratic16<S>, of: mask32x16<S>, width: f32x16<S>, origin: [f32x16<S>; 2]) {
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
                let [_, y] = on_arc(root, from, width, origin);
                self.add_if(y, changes);
            }
            before = here;
        }
    }

    /// The corners of a polygon, and the intersections of its edges with the sides of a cell.
    #[inline(always)]
    pub fn polygon(&mut self, lines: &[Linear16<S>; 5]) {
        let zero = lines[0].c.token().splat_f32x16(0.0);
        for (i, p) in lines.iter().enumerate() {
            for x in self.straight() {
                let y = -(p.c + x * p.x) / p.y;
                self.add_if(y, is_inside(lines, x, y, [i, i]));
            }
            self.line_on_round_sides(
                p,
                #[inline(always)]
                |x, y| is_inside(lines, x, y, [i, i]),
            );
        }
        for (i, j) in [(0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1)] {
            let (p, q) = (&lines[i], &lines[j]);
            let area = p.x * q.y - p.y * q.x;
            let (x, y) = ((p.y * q.c - p.c * q.y) / area, (p.c * q.x - q.c * p.x) / area);
            let is_beside = x.simd_ge(self.x[0]) & x.simd_le(self.x[1]);
            self.add_if(y, !area.simd_eq(zero) & is_beside & is_inside(lines, x, y, [i, j]));
        }
    }

    /// The intersections of a line with the sides of a cell.
    #[inline(always)]
    pub fn line(&mut self, line: &Linear16<S>) {
        let all = self.of;
        for x in self.straight() {
            self.add_if(-(line.c + x * line.x) / line.y, all);
        }
        self.line_on_round_sides(
            line,
            #[inline(always)]
            |_, _| all,
        );
    }
}

/// Whether a place is on the inner side of all lines but two, within rounding.
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
