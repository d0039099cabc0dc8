//! The integral of a flat light row by row: what is left of each row is a few intervals, and along an interval the
//! light is smooth.
//!
//! Rows lie at the nodes of a Kronrod rule, sixteen lanes for fifteen rows, on panels that end where something changes
//! its course: where a hidden part begins, has a corner or touches the light's edge. The Gauss rule inside the Kronrod
//! rule says how far a panel can be wrong; the worst panel is halved until the whole is good enough. Where one thing at
//! most is in the way, and so all corners are known, seven rows a panel are tried first, two panels in sixteen lanes.
//!
//! Source of the rules: Piessens et al., "QUADPACK", 1983, qk15; Kronrod, "Nodes and Weights of Quadrature Formulas",
//! 1965, for seven.

use arrayvec::ArrayVec;
use fearless_simd::{f32x16, prelude::*};

use super::hider::{Hider, Interval};
use super::rules::{
    EMBEDDED_PAIR_WEIGHTS, EMBEDDED_WEIGHTS, KRONROD, KRONROD_PAIR, KRONROD_PAIR_WEIGHTS, KRONROD_WEIGHTS, gauss,
};
use super::tensor::sharpness;
use super::view::{Outline, View};
use super::{Sums, Wanted};
use crate::material::Lobe;
use crate::math::{LANES, square};

/// The most things in the way that are settled row by row.
pub(crate) const MAX_HIDERS: usize = 8;

/// The most panels that a light is cut into.
const MAX_PANELS: usize = 64;

/// Highlights narrower than this, in half heights of the light and standard deviations, may lie between the rows of a
/// panel.
const BETWEEN_ROWS: f32 = 0.1;
/// Points nearer to a light than this, in half heights of the light, are right below it.
const BELOW: f32 = 0.15;
/// Below a light that is very near, each panel is this many times as far from the foot of the point as the one before.
const WIDER: f32 = 8.0;

/// The part of a light that is integrated, and in how many pieces along a row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Region {
    /// Of x.
    pub x: [f32; 2],
    /// Of y.
    pub y: [f32; 2],
    /// Pieces of equal length that an interval is cut into: for a highlight that is narrow beside the region.
    pub pieces: usize,
}

impl Region {
    /// All of a light.
    pub fn whole(view: &View) -> Region {
        Region { x: view.x, y: view.y, pieces: 1 }
    }
}

/// An integral over a part of a light.
#[derive(Clone, Copy, Debug, Default)]
struct Panel {
    t: [f32; 2],
    sums: Sums,
    error: Sums,
    /// Of seven rows.
    coarse: bool,
}

/// Sixteen rows: lane k is row `nodes[k]` of the panel with that `middle` and `half` length.
struct Rows {
    nodes: [f32; LANES],
    middle: [f32; LANES],
    half: [f32; LANES],
}

impl Rows {
    fn panel(t: [f32; 2]) -> Rows {
        Rows { nodes: KRONROD, middle: [middle(t); LANES], half: [half(t); LANES] }
    }

    fn pair(one: [f32; 2], other: [f32; 2]) -> Rows {
        let lanes = |f: fn([f32; 2]) -> f32| std::array::from_fn(|k| f(if k < LANES / 2 { one } else { other }));
        Rows { nodes: KRONROD_PAIR, middle: lanes(middle), half: lanes(half) }
    }
}

fn middle(t: [f32; 2]) -> f32 {
    0.5 * (t[0] + t[1])
}

fn half(t: [f32; 2]) -> f32 {
    0.5 * (t[1] - t[0])
}

/// The integral of what nothing hides of a light over a region, and a bound of its error.
///
/// `enough(sums, error)` says whether an error will do.
pub(crate) fn integrate<S: Simd>(
    simd: S,
    view: &View,
    hiders: &[Hider],
    region: &Region,
    wanted: Wanted,
    enough: &dyn Fn(&Sums, &Sums) -> bool,
) -> (Sums, Sums) {
    let cuts = cuts(view, hiders, region, wanted);
    let mut panels: ArrayVec<Panel, MAX_PANELS> = ArrayVec::new();
    let (mut sums, mut error) = (Sums::default(), Sums::default());
    let lit = Lit { view, hiders, region, wanted };
    // Seven rows tell what is wide: a light that is not near, and no narrow highlight on it
    let (size2, distance2) = (square(view.la.max(view.lb)), square(view.nearest()));
    if hiders.len() <= 1 && size2 <= distance2 && sharpness(view) * size2 <= distance2 {
        for t in cuts.windows(2).step_by(2).zip(cuts.windows(2).skip(1).step_by(2).map(Some).chain([None])) {
            let (one, other) = (t.0, t.1);
            let [one, other] = lit.pair(simd, [one[0], one[1]], other.map_or([one[1]; 2], |t| [t[0], t[1]]));
            panels.push(one);
            if t.1.is_some() {
                panels.push(other);
            }
        }
    } else {
        panels.extend(cuts.windows(2).map(|t| lit.panel(simd, [t[0], t[1]])));
    }
    for panel in &panels {
        sums = sums + panel.sums;
        error = error + panel.error;
    }
    while !enough(&sums, &error) && panels.len() < MAX_PANELS {
        // Halve the worst
        let size = |panel: &Panel| panel.error.diffuse + panel.error.specular;
        let mut worst = 0;
        for i in 1..panels.len() {
            if size(&panels[i]) > size(&panels[worst]) {
                worst = i;
            }
        }
        let [from, to] = panels[worst].t;
        let middle = middle([from, to]);
        if panels[worst].coarse {
            panels[worst] = lit.panel(simd, [from, to]);
        } else if from < middle && middle < to {
            panels[worst] = lit.panel(simd, [from, middle]);
            panels.push(lit.panel(simd, [middle, to]));
        } else {
            break;
        }
        // Anew, so that nothing is left over of what was taken away
        (sums, error) = (Sums::default(), Sums::default());
        for panel in &panels {
            sums = sums + panel.sums;
            error = error + panel.error;
        }
    }
    (sums, error)
}

/// Where panels begin and end: in the light's own parameter of rows.
fn cuts(view: &View, hiders: &[Hider], region: &Region, wanted: Wanted) -> ArrayVec<f32, { MAX_PANELS / 2 }> {
    let mut cuts = ArrayVec::new();
    let spread = Spread::new(view);
    let [from, to] = region.y.map(|y| spread.parameter(y));
    // Below a light that is very near, rows are as wide as they are far from the foot of the point
    let near = if view.is_near { view.l0.length() / view.lb } else { 0.0 };
    // Shorter panels are not worth their rows
    let least = if near > 0.0 {
        0.1 * spread.parameter(if region.y[1] > -region.y[0] { near } else { -near }).abs()
    } else {
        (to - from) * 1e-4
    };
    let mut offer = |y: f64| {
        let t = spread.parameter(y as f32);
        if t > from + least && t < to - least && !cuts.is_full() && cuts.iter().all(|c: &f32| (c - t).abs() > least) {
            cuts.push(t);
        }
    };
    let mut off = near;
    while off > 0.0 && off < 2.0 {
        offer(f64::from(-off));
        offer(f64::from(off));
        off *= WIDER;
    }
    for hider in hiders {
        hider.corners(view, &mut offer);
    }
    for line in [&view.cos, &view.horizon] {
        for x in view.x {
            let y = -(line.c + line.x * x) / line.y;
            offer(f64::from(y));
        }
    }
    // Below a light that is near, most comes from around the foot of the point, between all rows of a panel
    if !view.is_near && view.nearest() < BELOW * view.lb {
        let (foot, width) = (-view.fb / view.lb, view.height / view.lb);
        for off in [2.0 * width, 8.0 * width] {
            offer(f64::from(foot - off));
            offer(f64::from(foot + off));
        }
    }
    // A highlight on a light that is near may lie between all rows of a panel, and they would agree that there is none
    let sharpness = sharpness(view);
    let spread = 1.0 / (2.0 * sharpness).sqrt();
    if wanted.specular
        && sharpness > 0.0
        && view.height * spread < BETWEEN_ROWS * view.lb
        && region.y == view.y
        && let Some((y, distance)) = view.highlight()
    {
        // Across the line of sight, and along it
        let width = 4.0 * spread * distance / view.lb;
        for off in [width, width * distance / view.height] {
            offer(f64::from(y - off));
            offer(f64::from(y + off));
        }
    }
    // Room for both ends
    cuts.truncate(MAX_PANELS / 2 - 2);
    cuts.push(from);
    cuts.push(to);
    cuts.sort_unstable_by(f32::total_cmp);
    cuts
}

impl View {
    /// The row on which the direction of a highlight's middle meets the light's plane, if it does, and how far away
    /// that is.
    fn highlight(&self) -> Option<(f32, f32)> {
        let m = self.mirror()?;
        let n = self.a.cross(self.b);
        let n = n / n.length();
        let t = n.dot(self.l0) / n.dot(m);
        let along_b = (self.b - self.a * (self.skew / self.la)) / self.lb;
        let y = (t * m.dot(along_b) - self.fb) / self.lb;
        (t > 0.0 && y.is_finite()).then_some((y, t))
    }
}

/// How rows are spread. On a disk so that their lengths change smoothly up to the rim: y = (3 t - t^3) / 2, whose half
/// length is (1 - t^2) sqrt(4 - t^2) / 2; y and t are counted from where places are.
#[derive(Clone, Copy)]
struct Spread {
    outline: Outline,
    /// The row that the others are counted from, from the middle, and its t.
    y: f32,
    t: f32,
}

impl Spread {
    fn new(view: &View) -> Spread {
        let y = view.origin[1];
        Spread {
            outline: view.outline,
            y,
            t: if view.outline != Outline::Parallelogram { parameter_of_disk(y) } else { y },
        }
    }

    /// The parameter of row `y`.
    fn parameter(&self, y: f32) -> f32 {
        match self.outline {
            Outline::Parallelogram => y,
            Outline::Disk | Outline::Sphere if self.t == 0.0 => parameter_of_disk(y),
            Outline::Disk | Outline::Sphere => {
                let (low, high) = (-1.0 - self.t, 1.0 - self.t);
                if y <= -1.0 - self.y {
                    return low;
                } else if y >= 1.0 - self.y {
                    return high;
                }
                // Halving is slow and sure
                let (mut from, mut to) = if y < 0.0 { (low, 0.0) } else { (0.0, high) };
                for _ in 0..60 {
                    let middle = 0.5 * (from + to);
                    *(if self.row(middle) < y { &mut from } else { &mut to }) = middle;
                }
                0.5 * (from + to)
            }
        }
    }

    /// The row of a parameter, of a disk.
    fn row(&self, t: f32) -> f32 {
        t * (self.straight() - self.bent() * t - t * t) * 0.5
    }

    /// (3 t - t^3) / 2, counted from t0, is t (3 - 3 t0^2 - 3 t0 t - t^2) / 2.
    fn straight(&self) -> f32 {
        3.0 - 3.0 * self.t * self.t
    }

    fn bent(&self) -> f32 {
        3.0 * self.t
    }
}

/// The t of row `y` of a disk, both from its middle.
fn parameter_of_disk(y: f32) -> f32 {
    let y = y.clamp(-1.0, 1.0);
    // Newton's way, from the sine that the cubic is close to
    let mut t = y * 0.75;
    for _ in 0..30 {
        let slope = 1.5 * (1.0 - t * t);
        if slope < 1e-3 {
            break;
        }
        t = (t - (0.5 * t * (3.0 - t * t) - y) / slope).clamp(-1.0, 1.0);
    }
    if y.abs() == 1.0 { y } else { t }
}

/// A light, what hides it, and what is asked for.
#[derive(Clone, Copy)]
struct Lit<'a> {
    view: &'a View,
    hiders: &'a [Hider],
    region: &'a Region,
    wanted: Wanted,
}

impl Lit<'_> {
    /// A panel by fifteen rows.
    fn panel<S: Simd>(&self, simd: S, t: [f32; 2]) -> Panel {
        let rows = sixteen_rows(simd, self, &Rows::panel(t));
        panel_of(&rows, t, &KRONROD_WEIGHTS, &EMBEDDED_WEIGHTS, false)
    }

    /// Two panels by seven rows each.
    fn pair<S: Simd>(&self, simd: S, one: [f32; 2], other: [f32; 2]) -> [Panel; 2] {
        let rows = sixteen_rows(simd, self, &Rows::pair(one, other));
        let [first, second] = &KRONROD_PAIR_WEIGHTS;
        let [first_inner, second_inner] = &EMBEDDED_PAIR_WEIGHTS;
        [panel_of(&rows, one, first, first_inner, true), panel_of(&rows, other, second, second_inner, true)]
    }
}

/// The sum over the rows of a panel, and how far it may be off.
fn panel_of(
    rows: &[[f32; LANES]; 2],
    t: [f32; 2],
    weights: &[f32; LANES],
    inner: &[f32; LANES],
    coarse: bool,
) -> Panel {
    let sum =
        |values: &[f32; LANES], weights: &[f32; LANES]| values.iter().zip(weights).map(|(v, w)| v * w).sum::<f32>();
    let [diffuse, specular] = [0, 1].map(|i| (sum(&rows[i], weights), sum(&rows[i], inner)));
    let trust = if coarse { 1.0 } else { TRUST };
    let off = |(fine, inner): (f32, f32)| (fine - inner).abs() * trust;
    let sums = Sums { diffuse: diffuse.0, specular: specular.0 };
    Panel { t, sums, error: Sums { diffuse: off(diffuse), specular: off(specular) }, coarse }
}

/// What sixteen rows of a light send, diffuse and specular. Not inlined: one copy for each instruction set is enough.
#[inline(never)]
fn sixteen_rows<S: Simd>(simd: S, lit: &Lit, rows: &Rows) -> [[f32; LANES]; 2] {
    simd.vectorize(
        #[inline(always)]
        || sixteen_rows_now(simd, lit, rows),
    )
}

#[inline(always)]
fn sixteen_rows_now<S: Simd>(simd: S, lit: &Lit, rows: &Rows) -> [[f32; LANES]; 2] {
    let Lit { view, hiders, region, wanted } = *lit;
    let splat = |v: f32| simd.splat_f32x16(v);
    let half = f32x16::simd_from(simd, rows.half);
    let t_rows = f32x16::simd_from(simd, rows.nodes) * half + f32x16::simd_from(simd, rows.middle);
    // The rows, and how densely they lie
    let (y, [from, to], density) = match view.outline {
        Outline::Parallelogram => (t_rows, view.x.map(splat), half),
        Outline::Disk | Outline::Sphere => {
            let spread = Spread::new(view);
            let y = t_rows * (spread.straight() - t_rows * spread.bent() - t_rows * t_rows) * 0.5;
            let t = t_rows + spread.t;
            let tt = t * t;
            let inside = (1.0 - tt).max(splat(0.0));
            let reach = inside * (4.0 - tt).sqrt() * 0.5;
            (y, [-reach - view.origin[0], reach - view.origin[0]], inside * (half * 1.5))
        }
    };
    let row = Row::new(simd, view, y);
    // What is above the horizon, in the region, and in the light
    let mut all = Interval { from: from.max(splat(region.x[0])), to: to.min(splat(region.x[1])) };
    all.clip(row.cos, view.cos.x);
    all.clip(y * view.horizon.y + view.horizon.c, view.horizon.x);
    // Near the light, pieces that grow with the distance from the point's foot
    let nearest = least(row.rest).sqrt();
    let length = view.la * (region.x[1] - region.x[0]);
    let foot = row.along * (-1.0 / view.la);
    let steps = if length > NEAR * nearest { nearest / view.la } else { 0.0 };
    let order = if length * 1.5 > NEAR * nearest || region.pieces > 1 {
        5
    } else if length * FAR > nearest || sharpness(view) * length * length > SHARP * nearest * nearest {
        4
    } else {
        3
    };
    // Each visible interval in turn
    let mut hidden: ArrayVec<Interval<S>, MAX_HIDERS> = ArrayVec::new();
    for hider in hiders {
        let interval = hider.hidden(simd, y);
        if (interval.from.simd_lt(interval.to) & interval.from.simd_lt(all.to) & interval.to.simd_gt(all.from))
            .any_true()
        {
            hidden.push(interval);
        }
    }
    let mut visible: ArrayVec<Interval<S>, { MAX_HIDERS + 1 }> = ArrayVec::new();
    let mut at = all.from;
    for _ in 0..=hidden.len() {
        // Past all that hides the place
        for _ in 0..hidden.len() {
            for interval in &hidden {
                let covers = interval.from.simd_le(at) & interval.to.simd_gt(at);
                at = covers.select(interval.to, at);
            }
        }
        let mut end = all.to;
        for interval in &hidden {
            let ahead = interval.from.simd_gt(at) & interval.from.simd_lt(interval.to);
            end = ahead.select(interval.from.min(end), end);
        }
        if at.simd_lt(end).any_true() {
            visible.push(Interval { from: at, to: end });
        }
        at = end;
        if !at.simd_lt(all.to).any_true() {
            break;
        }
    }
    let mut sums = [splat(0.0); 2];
    // Rings around the foot, each as wide as it is far away; or all at once
    let (mut inner, mut outer) = (0.0, if steps > 0.0 { steps } else { f32::INFINITY });
    let mut side = 1.0;
    loop {
        let (a, b) = if outer == f32::INFINITY {
            (splat(-f32::MAX), splat(f32::MAX))
        } else {
            let (near, far) = (foot + inner * side, foot + outer * side);
            (near.min(far), near.max(far))
        };
        for interval in &visible {
            let (from, to) = (interval.from.max(a), interval.to.min(b));
            if from.simd_lt(to).any_true() {
                row.add(simd, view, from, to, region.pieces, order, wanted, &mut sums);
            }
        }
        if outer == f32::INFINITY {
            break;
        }
        side = -side;
        if side > 0.0 {
            if !((foot + outer).simd_lt(all.to) | (foot - outer).simd_gt(all.from)).any_true() {
                break;
            }
            (inner, outer) = (outer, outer * 2.0 + steps);
        }
    }
    sums.map(|sums| (sums * density * view.measure).to_array())
}

/// The Kronrod rule's own error is this part of its difference to the Gauss rule, or less: at a corner, where both are
/// at their worst, a fourth.
const TRUST: f32 = 0.3;
/// Rows longer than this many times the point's distance from them are cut into pieces that grow with the distance.
const NEAR: f32 = 2.0;
/// Rows this many times shorter than the point's distance from them, across which a highlight falls by less than
/// exp(-0.2), take three nodes; see the tables in [`tensor`](super::tensor).
const FAR: f32 = 2.5;
const SHARP: f32 = 0.8;

/// The least of the lanes.
#[inline(always)]
fn least<S: Simd>(v: f32x16<S>) -> f32 {
    v.to_array().into_iter().fold(f32::INFINITY, |a, b| if b < a { b } else { a })
}

/// What does not change along a row.
struct Row<S: Simd> {
    /// Of x = 0, along the light's first edge from the point's foot.
    along: f32x16<S>,
    /// |l|^2 without the part along the row.
    rest: f32x16<S>,
    /// ns.l of x = 0.
    cos: f32x16<S>,
    /// wo.l of x = 0.
    out: f32x16<S>,
}

impl<S: Simd> Row<S> {
    #[inline(always)]
    fn new(simd: S, view: &View, y: f32x16<S>) -> Self {
        let across = y * view.lb + view.fb;
        Row {
            along: y * view.skew + view.fa,
            rest: across * across + simd.splat_f32x16(view.height * view.height),
            cos: y * view.cos.y + view.cos.c,
            out: y * view.out.y + view.out.c,
        }
    }

    /// Adds the integral along an interval.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "an interval of a row of a light, and how it is cut")]
    fn add(
        &self,
        simd: S,
        view: &View,
        from: f32x16<S>,
        to: f32x16<S>,
        pieces: usize,
        order: usize,
        wanted: Wanted,
        sums: &mut [f32x16<S>; 2],
    ) {
        match order {
            3 => self.add_nodes::<3>(simd, view, [from, to], pieces, wanted, sums),
            4 => self.add_nodes::<4>(simd, view, [from, to], pieces, wanted, sums),
            _ => self.add_nodes::<5>(simd, view, [from, to], pieces, wanted, sums),
        }
    }

    /// The same by the rule of so many nodes.
    #[inline(always)]
    fn add_nodes<const NODES: usize>(
        &self,
        simd: S,
        view: &View,
        [from, to]: [f32x16<S>; 2],
        pieces: usize,
        wanted: Wanted,
        sums: &mut [f32x16<S>; 2],
    ) {
        let zero = simd.splat_f32x16(0.0);
        let half = ((to - from) * (0.5 / pieces as f32)).max(zero);
        let rule = gauss(NODES);
        for piece in 0..pieces {
            let middle = from + half * (2 * piece + 1) as f32;
            let (mut shares, mut cos_i, mut cos_io) = ([zero; NODES], [zero; NODES], [zero; NODES]);
            for k in 0..NODES {
                let x = middle + half * rule.nodes[k];
                let s = x * view.la + self.along;
                let distance2 = s * s + self.rest;
                let inverse = 1.0 / distance2.max(simd.splat_f32x16(f32::MIN_POSITIVE)).sqrt();
                shares[k] = half * rule.weights[k];
                if view.physical {
                    shares[k] *= inverse * inverse * (inverse * view.height);
                }
                // Rounding may lead below the horizon, on it nothing arrives
                cos_i[k] = ((x * view.cos.x + self.cos) * inverse).max(zero);
                cos_io[k] = (x * view.out.x + self.out) * inverse;
            }
            if wanted.diffuse {
                for (cos_i, share) in cos_i.iter().zip(&shares) {
                    sums[0] += *cos_i * *share;
                }
            }
            if wanted.specular && !matches!(view.lobe, Lobe::None) {
                let lobes = view.lobe.eval_lanes(cos_i, simd.splat_f32x16(view.cos_o), cos_io);
                for (lobe, share) in lobes.iter().zip(&shares) {
                    sums[1] += *lobe * *share;
                }
            }
        }
    }
}
