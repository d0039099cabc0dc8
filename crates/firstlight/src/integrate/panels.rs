//! The visible part of a light's cells, integrated row by row, for sixteen panels at once.
//!
//! A panel is a range of rows of one cell between two break points; where the outlines of two occluders cross
//! within it, the rules of an embedded pair differ, and the panel is halved. On each of seven rows, the nodes of a
//! Kronrod rule, the hidden intervals are united, and the antiderivative of the cell's polynomial is summed over
//! the ends of the remaining ones. The embedded Gauss rule of three nodes gives the error estimate. Where all rows
//! are hidden, but their intervals overlap less towards one row, the radiance through a possible gap between two
//! rows is added to it. Outlines begin and end at break points as square roots do, so the rows are transformed by
//! y^2 (3 - 2 y).
//!
//! Source of the rule: Kronrod, "Nodes and Weights of Quadrature Formulas", 1965; of the transformation: Davis,
//! Rabinowitz, "Methods of Numerical Integration", 1984, section 2.12.

use arrayvec::ArrayVec;
use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::batch::{FrameLanes, FrameNumber, LaneNumbers, LightFrame16, Members, light_vectors};
use super::breaks::{Breaks, RoundSides};
use super::cell::{Cell, MOMENTS, PartialCells, sides};
use super::light_frame::Outline;
use super::occluder::{Occluder, Shadow};
use super::row::{FAR, Interval16};
use crate::math::{LANES, Vec3x16, asin, sin_cos};

/// Rows of a panel: the Kronrod rule of seven nodes.
const ROWS: usize = 7;
const KRONROD: [(f64, f64, f64); 4] = [
    // Node, weight, weight in the Gauss rule of three
    (0.960_491_268_708_020_3, 0.104_656_226_026_467_3, 0.0),
    (0.774_596_669_241_483_4, 0.268_488_089_868_333_4, 0.555_555_555_555_555_6),
    (0.434_243_749_346_802_6, 0.401_397_414_775_962_2, 0.0),
    (0.0, 0.450_916_538_658_474_1, 0.888_888_888_888_889),
];

/// The transformed place of each row in a panel, 0 to 1, and its weights in both rules.
const SPREAD: [[f32; 3]; ROWS] = {
    let mut rows = [[0.0; 3]; ROWS];
    let mut i = 0;
    while i < ROWS {
        let (node, fine, coarse) = KRONROD[if i < 4 { i } else { 6 - i }];
        let t = 0.5 + if i < 4 { -0.5 * node } else { 0.5 * node };
        let dense = 0.5 * (6.0 * t * (1.0 - t));
        rows[i] = [(t * t * (3.0 - 2.0 * t)) as f32, (fine * dense) as f32, (coarse * dense) as f32];
        i += 1;
    }
    rows
};

/// A range of rows of one partially visible cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Panel {
    /// Indices of the cell and of the point.
    pub cell: u32,
    pub point: u32,
    pub y: [f32; 2],
    /// The number of halvings.
    pub depth: u32,
}

/// The occluders that may hide a part of a light from one point, as bits: those the point is outside of, and spheres
/// that it is in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct OccluderMask {
    pub outside: u64,
    pub within: u64,
}

impl OccluderMask {
    /// The indices of the occluders.
    #[inline(always)]
    fn occluders(self) -> impl Iterator<Item = usize> {
        let mut any = self.outside | self.within;
        std::iter::from_fn(move || {
            let first = (any != 0).then_some(any.trailing_zeros() as usize);
            any &= any.wrapping_sub(1);
            first
        })
    }
}

/// A light's outline and its occluders, for all points.
#[derive(Clone, Copy)]
pub(crate) struct OccludedLight<'a> {
    pub occluders: &'a [Occluder],
    pub outline: Outline,
    /// Point by point.
    pub masks: &'a [OccluderMask],
}

/// Integrals over sixteen panels, their error estimates, and the visible part of the light's square in each.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PanelSums {
    pub sums: [LaneNumbers; MOMENTS],
    pub differences: [LaneNumbers; MOMENTS],
    pub seen: LaneNumbers,
}

/// The most hidden intervals of a row: one for each occluder, two if it has a hole.
pub(crate) const MAX_INTERVALS: usize = 48;

/// The occluders of sixteen panels or cells, with the masks of their points.
struct Batch<'a, S: Simd> {
    light: &'a OccludedLight<'a>,
    masks: [OccluderMask; LANES],
    p: Vec3x16<S>,
    l: [Vec3x16<S>; 3],
}

impl<'a, S: Simd> Batch<'a, S> {
    #[inline(always)]
    fn new(
        simd: S,
        light: &'a OccludedLight<'a>,
        members: &Members<LightFrame16>,
        point: impl Fn(usize) -> u32,
    ) -> Self {
        use FrameNumber::*;
        let mut masks = [OccluderMask::default(); LANES];
        for (k, mask) in masks.iter_mut().enumerate() {
            *mask = light.masks[point(k) as usize];
        }
        Batch { light, masks, p: members.vectors(simd, [Px, Py, Pz]), l: light_vectors(simd, members) }
    }

    /// The indices of the occluders of any of the points.
    #[inline(always)]
    fn occluders(&self) -> impl Iterator<Item = usize> + use<S> {
        let mut any = OccluderMask::default();
        for mask in &self.masks {
            any.outside |= mask.outside;
            any.within |= mask.within;
        }
        any.occluders()
    }

    /// One occluder projected onto the light, and the lanes of points outside of it and within.
    #[inline(always)]
    fn shadow(&self, simd: S, occluder: usize) -> (Shadow<S>, mask32x16<S>, mask32x16<S>) {
        let (mut outside, mut within) = (0, 0);
        for (k, mask) in self.masks.iter().enumerate() {
            outside |= (mask.outside >> occluder & 1) << k;
            within |= (mask.within >> occluder & 1) << k;
        }
        (
            Shadow::new(simd, &self.light.occluders[occluder], self.p, &self.l),
            mask32x16::from_bitmask(simd, outside),
            mask32x16::from_bitmask(simd, within),
        )
    }
}

/// Splits up to sixteen cells into panels at their break points. `spare` is a buffer.
#[inline(never)]
pub(crate) fn split_panels<S: Simd>(
    simd: S,
    light: &OccludedLight,
    members: &Members<LightFrame16>,
    cells: &[Cell],
    first: u32,
    spare: &mut Vec<LaneNumbers>,
    panels: &mut Vec<Panel>,
) {
    spare.clear();
    simd.vectorize(
        #[inline(always)]
        || breaks(simd, light, members, cells, spare),
    );
    for (k, cell) in cells.iter().enumerate() {
        let least = (cell.y[1] - cell.y[0]) * LEAST;
        let is_inside = |y: &f32| *y > cell.y[0] + least && *y < cell.y[1] - least;
        let mut rows: ArrayVec<f32, MAX_PANELS> =
            spare.iter().map(|rows| rows[k]).filter(is_inside).take(MAX_PANELS - 1).collect();
        rows.sort_unstable_by(f32::total_cmp);
        rows.push(cell.y[1]);
        let mut from = cell.y[0];
        for to in rows {
            if to - from > least || to == cell.y[1] {
                panels.push(Panel { cell: first + k as u32, point: cell.point, y: [from, to], depth: 0 });
                from = to;
            }
        }
    }
}

#[inline(always)]
fn breaks<S: Simd>(
    simd: S,
    light: &OccludedLight,
    members: &Members<LightFrame16>,
    cells: &[Cell],
    rows: &mut Vec<LaneNumbers>,
) {
    use FrameNumber::*;
    let [x0, x1, ..] = sides(cells).map(|side| f32x16::simd_from(simd, side));
    let x = [x0, x1];
    let zero = simd.splat_f32x16(0.0);
    let (x, round) = match light.outline {
        Outline::Parallelogram => (x, None),
        Outline::Disk => {
            let origin = [members.lanes(simd, OriginX), members.lanes(simd, OriginY)];
            (x, Some(RoundSides { width: [simd.splat_f32x16(-1.0), simd.splat_f32x16(1.0)], origin }))
        }
        Outline::Sphere => {
            let width = [sin_cos(x[0]).0, sin_cos(x[1]).0];
            ([width[0].min(zero), width[1].max(zero)], Some(RoundSides { width, origin: [zero; 2] }))
        }
    };
    let is_straight = light.outline != Outline::Sphere;
    let batch = Batch::new(simd, light, members, |k| cells[k.min(cells.len() - 1)].point);
    for occluder in batch.occluders() {
        let (shadow, outside, within) = batch.shadow(simd, occluder);
        let mut breaks = Breaks { x, is_straight, round, of: outside | within, rows };
        shadow.breaks(&mut breaks);
    }
    let all = x[0].simd_eq(x[0]);
    let mut breaks = Breaks { x, is_straight, round, of: all, rows };
    breaks.line(&members.linear(simd, [CosC, CosX, CosY]));
    breaks.line(&members.linear(simd, [HorizonC, HorizonX, HorizonY]));
    if light.outline == Outline::Disk {
        let origin = [members.lanes(simd, OriginX), members.lanes(simd, OriginY)];
        breaks.round = None;
        breaks.quadratic(&Shadow::rim(origin), all);
    }
    if light.outline == Outline::Sphere {
        for row in rows.iter_mut() {
            *row = asin(f32x16::simd_from(simd, *row)).to_array();
        }
    }
}

/// The most panels of a new cell.
const MAX_PANELS: usize = 48;
/// As a part of the cell: panels that are shorter are joined to the next.
const LEAST: f32 = 1e-4;

#[inline(always)]
fn antiderivative<S: Simd>([a, b, c, d, e]: &[f32x16<S>; 5], u: f32x16<S>) -> f32x16<S> {
    u * (*a + u * (*b + u * (*c + u * (*d + u * *e))))
}

/// Integrates up to sixteen panels. To be called within `vectorize`.
#[inline(always)]
pub(crate) fn integrate_rows<S: Simd>(
    simd: S,
    light: &OccludedLight,
    members: &Members<LightFrame16>,
    cells: &Members<PartialCells>,
    panels: &[Panel],
    moments: usize,
) -> PanelSums {
    use FrameNumber::*;
    let splat = |v: f32| simd.splat_f32x16(v);
    let end = |end: usize| std::array::from_fn::<f32, LANES, _>(|k| panels[k.min(panels.len() - 1)].y[end]);
    let [from, to] = [f32x16::simd_from(simd, end(0)), f32x16::simd_from(simd, end(1))];
    let (zero, one, far) = (splat(0.0), splat(1.0), splat(FAR));
    let [x0, x1, y0, y1] = [0, 1, 2, 3].map(
        #[inline(always)]
        |side| cells.number(simd, PartialCells::SIDES[side]),
    );
    let (xm, xh) = ((x0 + x1) * 0.5, (x1 - x0) * 0.5);
    let (ym, yh) = ((y0 + y1) * 0.5, (y1 - y0) * 0.5);
    let batch = Batch::new(simd, light, members, |k| panels[k.min(panels.len() - 1)].point);
    let cos = members.linear(simd, [CosC, CosX, CosY]);
    let horizon = members.linear(simd, [HorizonC, HorizonX, HorizonY]);
    let origin = [members.lanes(simd, OriginX), members.lanes(simd, OriginY)];
    // The polynomials: [moment][power of x][power of y]
    let mut powers: ArrayVec<[[f32x16<S>; 5]; 5], MOMENTS> = ArrayVec::new();
    for moment in 0..moments {
        powers.push([[zero; 5]; 5]);
        for (x, powers) in powers[moment].iter_mut().enumerate() {
            for (y, power) in powers.iter_mut().enumerate() {
                *power = cells.number(simd, PartialCells::power(moment, x, y));
            }
        }
    }
    let is_sphere = light.outline == Outline::Sphere;
    // The y of each row, and on a sphere the half length of its parallel
    let (mut y_of, mut wide) = ([zero; ROWS], [one; ROWS]);
    for (row, [place, ..]) in SPREAD.into_iter().enumerate() {
        y_of[row] = (to - from) * place + from;
        if is_sphere {
            (y_of[row], wide[row]) = sin_cos(y_of[row]);
        }
    }
    let [west, east] = if is_sphere { [sin_cos(x0).0, sin_cos(x1).0] } else { [x0, x1] };
    // Clip each row to the horizons and to the light's outline
    let mut open = [Interval16 { from: west, to: east }; ROWS];
    for (row, all) in open.iter_mut().enumerate() {
        let y = y_of[row];
        if is_sphere {
            *all = Interval16 { from: west * wide[row], to: east * wide[row] };
        }
        all.clip(y * cos.y + cos.c, cos.x);
        all.clip(y * horizon.y + horizon.c, horizon.x);
        if light.outline == Outline::Disk {
            let across = y + origin[1];
            let reach = (1.0 - across * across).max(zero).sqrt();
            all.from = all.from.max(-reach - origin[0]);
            all.to = all.to.min(reach - origin[0]);
        }
    }
    // The hidden intervals of each row, sorted by where they begin
    let mut hidden: [ArrayVec<Interval16<S>, MAX_INTERVALS>; ROWS] = std::array::from_fn(|_| ArrayVec::new());
    for occluder in batch.occluders() {
        let (shadow, outside, within) = batch.shadow(simd, occluder);
        let (some_outside, some_within) = (outside.any_true(), within.any_true());
        for row in 0..ROWS {
            let y = y_of[row];
            if some_within {
                let (all, inside) = (&mut open[row], shadow.within(simd, y));
                all.from = within.select(all.from.max(inside.from), all.from);
                all.to = within.select(all.to.min(inside.to), all.to);
            }
            if some_outside {
                let parts = if shadow.has_hole() { 2 } else { 1 };
                for interval in &shadow.hidden(simd, y)[..parts] {
                    let mut interval = *interval;
                    let is_there = outside & interval.from.simd_lt(interval.to);
                    interval.from = is_there.select(interval.from, far);
                    interval.to = is_there.select(interval.to, far);
                    for before in hidden[row].iter_mut() {
                        let swap = interval.from.simd_lt(before.from);
                        let (f, t) = (before.from, before.to);
                        before.from = swap.select(interval.from, f);
                        before.to = swap.select(interval.to, t);
                        interval.from = swap.select(f, interval.from);
                        interval.to = swap.select(t, interval.to);
                    }
                    // Empty intervals come last, so that no lane has more than its point has occluders
                    if interval.from.simd_lt(far).any_true() && !hidden[row].is_full() {
                        hidden[row].push(interval);
                    }
                }
            }
        }
    }
    let mut fine = [zero; MOMENTS];
    let mut coarse = [zero; MOMENTS];
    let mut seen = zero;
    let inverse = 1.0 / xh;
    // The widest gap of each row, negative where hidden intervals overlap; and the radiance of a unit of it
    let mut gap = [-far; ROWS];
    let mut radiant = [[zero; MOMENTS]; ROWS];
    for (row_of, ((all, hidden), [place, weight, inner])) in open.iter().zip(&hidden).zip(SPREAD).enumerate() {
        let y = (to - from) * place + from;
        // Sum the antiderivative over the ends of what is left
        let v = (y - ym) / yh;
        let mut row = [[zero; 5]; MOMENTS];
        for moment in 0..moments {
            for (power, [a, b, c, d, e]) in row[moment].iter_mut().zip(&powers[moment]) {
                *power = *a + v * (*b + v * (*c + v * (*d + v * *e)));
            }
            radiant[row_of][moment] = row[moment][0].abs() * inverse * weight;
        }
        let mut sums = [zero; MOMENTS];
        let mut length = zero;
        let mut begin = all.from;
        for k in 0..=hidden.len() {
            // Up to the next hidden interval, or to the end
            let (end, next) = match hidden.get(k) {
                Some(interval) => (interval.from.min(all.to), begin.max(interval.to)),
                None => (all.to, begin),
            };
            let is_there = begin.simd_lt(end);
            gap[row_of] = gap[row_of].max(end - begin);
            let (mut first, mut last) = (begin, end);
            if is_sphere {
                (first, last) = (asin(begin / wide[row_of]), asin(end / wide[row_of]));
            }
            // Both ends are equal where nothing is left
            let from = ((first - xm) * inverse).max(-one).min(one);
            let to = is_there.select(((last - xm) * inverse).max(-one).min(one), from);
            for moment in 0..moments {
                let row = &row[moment];
                sums[moment] += antiderivative(row, to) - antiderivative(row, from);
            }
            length += to - from;
            begin = next;
        }
        for moment in 0..moments {
            fine[moment] += sums[moment] * weight;
            coarse[moment] += sums[moment] * inner;
        }
        seen += length * weight;
    }
    // Gaps that open and close between two rows
    let mut missed = [zero; MOMENTS];
    for row in 1..ROWS - 1 {
        let rises = [gap[row] - gap[row - 1], gap[row] - gap[row + 1]];
        let is_peak = rises[0].simd_ge(zero) & rises[1].simd_ge(zero) & gap[row].simd_lt(zero);
        let peak = is_peak.select(gap[row] + (rises[0] + rises[1]) * 0.5, zero).max(zero).min(xh);
        for moment in 0..moments {
            missed[moment] += radiant[row][moment] * peak;
        }
    }
    // A cell is 2 high in its own coordinates
    let share = (to - from) / yh;
    let mut result = PanelSums::default();
    for moment in 0..moments {
        result.sums[moment] = (fine[moment] * share).to_array();
        result.differences[moment] = (((fine[moment] - coarse[moment]).abs() + missed[moment]) * share).to_array();
    }
    result.seen = (seen * share * 0.25).to_array();
    result
}
