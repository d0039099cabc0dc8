//! Irradiance moments from one area light at many points: adaptive quadrature in batches of sixteen, with a queue
//! of cells and panels whose error estimate is too large.
//!
//! ```text
//! points ── classify ──▶ below the horizon, or in the umbra: 0
//!              │ cells of the light
//!              ▼
//!          integrate ──▶ fully visible: sum and error estimate ─────────────┐
//!              │ polynomials, panels                                        ▼
//!              ▼                                                          judge ──▶ accepted
//!        integrate_rows ──▶ partially visible: sum and error estimate ──────┘ │ halved cells, halved panels
//!              ▲                                                              │
//!              └────────────────────────── next round ◀───────────────────────┘
//! ```
//!
//! There are two error estimates: of the radiance on a cell (the last coefficients of its Legendre series), and of
//! the visible part of a cell (an embedded pair of rules on the rows of each panel).

use arrayvec::ArrayVec;
use fearless_simd::{Level, Simd};

use super::batch::{LaneNumbers, LightFrame16, Members};
use super::cell::{Cell, CellQuadrature, MOMENTS, NodeValues, PartialCells, integrate};
use super::classify::{LightOccluders, OcclusionClass, classify};
use super::emitter::Emitter;
use super::light_frame::LightFrame;
use super::panels::{OccludedLight, OccluderMask, Panel, PanelSums, integrate_rows, split_panels};
use super::subdivide::{CellMetrics, cell_metrics, halves, test_horizons, whole_light};
use super::tolerance::{COSTS, TOLERANCE, Weight};
use crate::color::{DisplaySteps, Rgb};
use crate::material::{LobeKind, Moments, PerMoment, ShadingPoint};
use crate::math::{LANES, dispatch_wide};
use crate::visibility::Visibility;

/// What one light sends to one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightIntegral {
    /// The irradiance moments; 0 where they were not computed: see [`ShadingPoint::most_motion`].
    pub sums: Moments,
    pub visibility: Visibility,
    /// Whether `visibility` is proved for all places within the point's reach.
    pub proved: bool,
    /// See [`OcclusionClass::motion`].
    pub motion: f32,
    /// The distance to the light, and of the point from the light's plane, in metres.
    pub distance: f32,
    pub height: f32,
}

impl LightIntegral {
    /// The sum over two parts of a light.
    fn and(&self, other: &LightIntegral) -> LightIntegral {
        let visibility = match (self.visibility, other.visibility) {
            (one, other) if one == other => one,
            (Visibility::Partial, _) | (_, Visibility::Partial) => Visibility::Partial,
            _ => Visibility::Listed,
        };
        LightIntegral {
            sums: self.sums + other.sums,
            visibility,
            proved: self.proved && other.proved && visibility != Visibility::Listed,
            motion: self.motion.max(other.motion),
            ..*self
        }
    }
}

/// A light to be integrated, with its occluders and the allowed error.
#[derive(Clone, Copy)]
pub(crate) struct LightTask<'a> {
    pub emitter: &'a Emitter,
    pub listed: &'a LightOccluders<'a>,
    /// The kind of the points' lobes.
    pub lobe: Option<LobeKind>,
    /// Factor of the moments, before the colours of a surface.
    pub scale: Rgb,
    pub steps: &'a DisplaySteps,
    /// In display steps: the largest error of this light at a point that stands for a pixel.
    pub allowed: f32,
    /// The value `allowed` steps above black.
    pub least: f32,
    /// Whether occluders are tested.
    pub shadows: bool,
    /// Whether moments are computed, or the visibility alone.
    pub sums: bool,
}

impl LightTask<'_> {
    /// The most cells and panels of one point at which a light that contributes `steps` display steps is integrated;
    /// beyond that, sampling is cheaper. Half of the number at which both cost the same, since the evaluations are
    /// wasted where the limit is exceeded.
    fn max_evaluations(steps: f32) -> f32 {
        COSTS.asked + COSTS.asked_per_step * steps
    }

    /// The light with its occluders and their masks, point by point.
    fn occluded_light<'b>(&'b self, masks: &'b [OccluderMask]) -> OccludedLight<'b> {
        OccludedLight { occluders: &self.listed.occluders, outline: self.emitter.outline(), masks }
    }
}

/// The most halvings of a cell and of a panel, and the most cells of a light for one point.
const CELL_DEPTH: u32 = 64;
const PANEL_DEPTH: u32 = 12;
const MOST_CELLS: u32 = 2048;
/// In display steps: the largest contribution of a light.
const LARGEST_CODE: f32 = u8::MAX as f32;

/// The buffers of [`evaluate`](AreaLightIntegrator::evaluate), which are kept from call to call.
#[derive(Default)]
pub(crate) struct AreaLightIntegrator {
    /// Point by point.
    frames: Vec<LightFrame16>,
    masks: Vec<OccluderMask>,
    state: Vec<PointSum>,
    /// Cells to be subdivided, their metrics, and the halves of those that are too wide.
    uncut: Vec<Cell>,
    metrics: Vec<CellMetrics>,
    next_uncut: Vec<Cell>,
    /// Fully visible cells to be integrated.
    whole: Vec<Cell>,
    /// All partially visible cells, the polynomials of those that were integrated, and the visible area of each. The
    /// cells of a round begin at a multiple of sixteen.
    partial: Vec<Cell>,
    kept: Vec<PartialCells>,
    seen: Vec<f32>,
    /// Panels to be integrated.
    panels: Vec<Panel>,
    /// Results of one round.
    whole_sums: Vec<CellQuadrature>,
    partial_sums: Vec<CellQuadrature>,
    panel_sums: Vec<PanelSums>,
    nodes: NodeValues,
    next_whole: Vec<Cell>,
    next_panels: Vec<Panel>,
    spare: Vec<LaneNumbers>,
    /// The integrals of one face of a cube around points inside of a sphere light.
    part: Vec<LightIntegral>,
}

/// The state of the integration at one point.
#[derive(Clone, Copy, Debug, Default)]
struct PointSum {
    accepted: Moments,
    /// `accepted`, with the sums of the current round.
    estimate: Moments,
    weight: Weight,
    /// The round in which `estimate` and `weight` were computed.
    round: u32,
    cells: u32,
    /// The number of cells and panels that were evaluated, and the largest allowed.
    evaluations: f32,
    max_evaluations: f32,
}

impl AreaLightIntegrator {
    /// Appends the integral of a light at each point to `integrals`.
    pub fn evaluate(
        &mut self,
        level: Level,
        task: &LightTask,
        points: &[ShadingPoint],
        integrals: &mut Vec<LightIntegral>,
    ) {
        let first = integrals.len();
        self.evaluate_one(level, task, points, integrals);
        let Some(faces) = task.emitter.faces() else { return };
        let is_inside = |point: &ShadingPoint| task.emitter.surrounds(point.p);
        let inside: Vec<ShadingPoint> = points.iter().filter(|point| is_inside(point)).copied().collect();
        if inside.is_empty() {
            return;
        }
        let mut seen: Vec<LightIntegral> = Vec::new();
        for emitter in &faces {
            let mut through = std::mem::take(&mut self.part);
            through.clear();
            let face = LightTask { emitter, allowed: task.allowed / 6f32.sqrt(), ..*task };
            self.evaluate_one(level, &face, &inside, &mut through);
            if seen.is_empty() {
                seen.extend_from_slice(&through);
            } else {
                seen.iter_mut().zip(&through).for_each(|(one, other)| *one = one.and(other));
            }
            self.part = through;
        }
        let places = integrals[first..].iter_mut().zip(points);
        let places = places.filter_map(|(place, point)| Some((place, task.emitter.depth(point.p)?)));
        for ((place, distance), seen) in places.zip(seen) {
            *place = LightIntegral { distance, height: distance, ..seen };
        }
    }

    /// The same with points inside of a sphere light left [`Visibility::Partial`].
    fn evaluate_one(
        &mut self,
        level: Level,
        task: &LightTask,
        points: &[ShadingPoint],
        integrals: &mut Vec<LightIntegral>,
    ) {
        let first = integrals.len();
        self.project_light(level, task, points, integrals);
        let integrals = &mut integrals[first..];
        let is_bounded = points.iter().any(ShadingPoint::is_bounded);
        let mut round = 0;
        while !(self.whole.is_empty() && self.kept.len() * LANES == self.partial.len() && self.panels.is_empty()) {
            round += 1;
            let new = self.kept.len() * LANES;
            if is_bounded {
                self.count_cells(integrals);
            }
            self.integrate_cells(level, task);
            if is_bounded {
                if round == 1 {
                    self.bound_evaluations(task, points);
                }
                self.count_panels(integrals);
            }
            self.integrate_panels(level, task);
            self.judge(task, points, new, round);
        }
        for (integrals, state) in integrals.iter_mut().zip(&self.state) {
            integrals.sums = state.accepted.at_least_0();
        }
    }

    /// Computes the light's coordinates from each point, classifies the occluders, and queues the first cells.
    fn project_light(
        &mut self,
        level: Level,
        task: &LightTask,
        points: &[ShadingPoint],
        integrals: &mut Vec<LightIntegral>,
    ) {
        // Blocks are written where they are read: nothing of what is left in them counts
        if self.frames.len() < points.len().div_ceil(LANES) {
            self.frames.resize(points.len().div_ceil(LANES), LightFrame16::default());
        }
        self.masks.clear();
        self.state.clear();
        self.state.resize(points.len(), PointSum::default());
        self.whole.clear();
        self.partial.clear();
        self.panels.clear();
        self.kept.clear();
        self.seen.clear();
        let outline = task.emitter.outline();
        for (block, points) in points.chunks(LANES).enumerate() {
            let start = block * LANES;
            let there = self.project(level, task, block, points);
            let frames = &self.frames[block];
            let (horizons, classes) = dispatch_wide!(level, simd => {
                simd.vectorize(
                    #[inline(always)]
                    || {
                        let mut horizons = test_horizons(simd, frames, task.emitter.is_physical(), points);
                        horizons.arrives &= there;
                        let asked = if task.shadows { horizons.arrives } else { 0 };
                        let classes = classify(simd, task.listed, task.emitter, frames, points, asked);
                        (horizons, classes)
                    },
                )
            });
            for (k, (point, class)) in points.iter().zip(&classes).enumerate() {
                let is = |bits: u64| bits >> k & 1 == 1;
                let mut one = LightIntegral {
                    sums: Moments::default(),
                    visibility: Visibility::BelowHorizon,
                    proved: point.reach == 0.0,
                    motion: 0.0,
                    distance: if is(there) { horizons.nearest[k] } else { 0.0 },
                    height: if is(there) { horizons.height[k] } else { 0.0 },
                };
                let is_open = class.mask == OccluderMask::default();
                if is(horizons.arrives) {
                    one.motion = class.motion;
                    one.visibility = match class {
                        OcclusionClass { hidden: true, .. } => Visibility::None,
                        OcclusionClass { other: true, .. } => Visibility::Partial,
                        _ if is_open && is(horizons.above) => Visibility::Full,
                        _ => Visibility::Listed,
                    };
                } else if task.emitter.surrounds(point.p) {
                    one.visibility = Visibility::Partial;
                }
                // The same for all places within the point's reach
                one.proved |= match one.visibility {
                    Visibility::BelowHorizon => is(there & horizons.below_around),
                    Visibility::None => is(horizons.beside_around) && one.motion == 0.0,
                    Visibility::Full => is(horizons.above_around) && one.motion == 0.0,
                    Visibility::Listed | Visibility::Partial => false,
                };
                let max_evaluations = LightTask::max_evaluations(LARGEST_CODE) * point.closed_form_budget;
                let is_wanted = task.sums && (one.proved || one.motion <= point.most_motion);
                if is_wanted && matches!(one.visibility, Visibility::Full | Visibility::Listed) {
                    let number = (start + k) as u32;
                    self.state[start + k].cells = 1;
                    self.uncut.push(whole_light(outline, number, self.frames[block].square(k)));
                }
                let state = &mut self.state[start + k];
                state.max_evaluations = max_evaluations;
                self.masks.push(class.mask);
                integrals.push(one);
            }
        }
        self.subdivide(level, task);
    }

    /// Computes the light's coordinates from a block of points. Returns the points from which the light has any, as
    /// bits.
    fn project(&mut self, level: Level, task: &LightTask, block: usize, points: &[ShadingPoint]) -> u64 {
        let frames = &mut self.frames[block];
        let (mut there, mut one_by_one) = (0, u64::MAX);
        if let Emitter::Flat(flat) = task.emitter {
            there = u64::MAX;
            one_by_one = dispatch_wide!(level, simd => simd.vectorize(
                #[inline(always)]
                || frames.project(simd, flat, points),
            ));
        }
        for (k, point) in points.iter().enumerate().filter(|(k, _)| one_by_one >> k & 1 == 1) {
            if let Some(flat) = task.emitter.flat(point.p) {
                there |= 1 << k;
                frames.set(k, point, &LightFrame::new(&flat, point));
            }
        }
        there
    }

    /// Halves cells until none is too wide, and queues them: cells of which all is above the horizon and nothing
    /// occludes are fully visible.
    fn subdivide(&mut self, level: Level, task: &LightTask) {
        let outline = task.emitter.outline();
        while !self.uncut.is_empty() {
            self.metrics.clear();
            let (metrics, frames) = (&mut self.metrics, &self.frames);
            dispatch_wide!(level, simd => {
                for cells in self.uncut.chunks(LANES) {
                    let members = Members::new(frames, cells.len(), |k| cells[k].point);
                    metrics.push(simd.vectorize(
                        #[inline(always)]
                        || cell_metrics(simd, task.lobe, outline, &members, cells),
                    ));
                }
            });
            for (k, cell) in self.uncut.iter().enumerate() {
                let metrics = &self.metrics[k / LANES];
                let is = |bits: u64| bits >> (k % LANES) & 1 == 1;
                let state = &mut self.state[cell.point as usize];
                if is(metrics.nothing) {
                    state.cells -= 1;
                    continue;
                }
                let is_wide = is(metrics.wide) && state.may_halve(cell);
                if let Some(halves) = halves(cell, is(metrics.along_y)).filter(|_| is_wide) {
                    state.cells += 1;
                    self.next_uncut.extend(halves);
                    continue;
                }
                let is_open = self.masks[cell.point as usize] == OccluderMask::default();
                if is_open && is(metrics.all) { &mut self.whole } else { &mut self.partial }.push(*cell);
            }
            self.uncut.clear();
            std::mem::swap(&mut self.uncut, &mut self.next_uncut);
        }
    }

    /// Limits the evaluations of each point by the unoccluded light there, after all first cells were integrated.
    fn bound_evaluations(&mut self, task: &LightTask, points: &[ShadingPoint]) {
        let Self { state, whole, whole_sums, partial, partial_sums, .. } = self;
        let mut sent = vec![Moments::default(); points.len()];
        for (cells, whole_sums) in [(whole, whole_sums), (partial, partial_sums)] {
            for (k, cell) in cells.iter().enumerate() {
                sent[cell.point as usize] += PerMoment(lane(&whole_sums[k / LANES].sums, k).map(f32::abs));
            }
        }
        for ((state, point), sent) in state.iter_mut().zip(points).zip(&sent) {
            let error = (task.scale * point.bsdf.colors).of(sent);
            let steps = task.steps.of_color(point.base + error * 0.5, error);
            state.max_evaluations = LightTask::max_evaluations(steps) * point.closed_form_budget;
        }
    }

    /// Counts the cells of this round, and drops those of points beyond their limit.
    fn count_cells(&mut self, integrals: &mut [LightIntegral]) {
        let new = self.kept.len() * LANES;
        for cell in self.whole.iter().chain(&self.partial[new..]) {
            self.state[cell.point as usize].evaluations += 1.0;
        }
        if self.give_up(integrals) {
            let state = &self.state;
            let is_asked = |cell: &Cell| state[cell.point as usize].cells != PointSum::GIVEN_UP;
            self.whole.retain(is_asked);
            let mut kept = self.partial.split_off(new);
            kept.retain(is_asked);
            self.partial.append(&mut kept);
            self.drop_panels();
        }
    }

    /// The same for panels.
    fn count_panels(&mut self, integrals: &mut [LightIntegral]) {
        for panel in &self.panels {
            let state = &mut self.state[panel.point as usize];
            state.evaluations += 1.0;
        }
        if self.give_up(integrals) {
            self.drop_panels();
        }
    }

    /// Leaves points whose occluded light takes more evaluations than allowed to be sampled: [`Visibility::Partial`].
    /// Returns whether there was any.
    fn give_up(&mut self, integrals: &mut [LightIntegral]) -> bool {
        let mut is_any = false;
        for ((state, mask), integrals) in self.state.iter_mut().zip(&self.masks).zip(integrals) {
            let is_occluded = *mask != OccluderMask::default() && integrals.visibility == Visibility::Listed;
            if is_occluded && state.evaluations > state.max_evaluations {
                state.cells = PointSum::GIVEN_UP;
                integrals.visibility = Visibility::Partial;
                is_any = true;
            }
        }
        is_any
    }

    fn drop_panels(&mut self) {
        let Self { state, panels, .. } = self;
        panels.retain(|panel| state[panel.point as usize].cells != PointSum::GIVEN_UP);
    }

    /// Integrates all cells of this round, and splits the new partially visible ones into panels.
    fn integrate_cells(&mut self, level: Level, task: &LightTask) {
        let Self { frames, masks, whole, partial, kept, panels, nodes, spare, .. } = self;
        let falloff = task.emitter.falloff();
        let light = task.occluded_light(masks);
        self.whole_sums.clear();
        self.partial_sums.clear();
        let (whole_sums, partial_sums) = (&mut self.whole_sums, &mut self.partial_sums);
        // Those of the cut cells that are new
        let new = partial[kept.len() * LANES..].chunks(LANES).map(|cells| (cells, true));
        let asked = whole.chunks(LANES).map(|cells| (cells, false)).chain(new);
        // Each kernel is called at one place: so there is one copy of it for each instruction set
        dispatch_wide!(level, simd => {
            for (cells, is_partial) in asked {
                let members = Members::new(frames, cells.len(), |k| cells[k].point);
                let first = (kept.len() * LANES) as u32;
                let wanted = is_partial.then_some(&mut *kept);
                let fitted = simd.vectorize(
                    #[inline(always)]
                    || integrate(simd, task.lobe, falloff, &members, cells, nodes, wanted),
                );
                if is_partial {
                    partial_sums.push(fitted);
                    split_panels(simd, &light, &members, cells, first, spare, panels);
                } else {
                    whole_sums.push(fitted);
                }
            }
        });
    }

    /// Integrates all panels of this round.
    fn integrate_panels(&mut self, level: Level, task: &LightTask) {
        let Self { frames, masks, kept, panels, panel_sums, .. } = self;
        let light = task.occluded_light(masks);
        let moments = LobeKind::moments(task.lobe);
        panel_sums.clear();
        dispatch_wide!(level, simd => {
            for some in panels.chunks(LANES) {
                let members = Members::new(frames, some.len(), |k| some[k].point);
                let cells = Members::new(kept, some.len(), |k| some[k].cell);
                panel_sums.push(simd.vectorize(
                    #[inline(always)]
                    || integrate_rows(simd, &light, &members, &cells, some, moments),
                ));
            }
        });
    }

    /// Accepts results whose error estimate is small enough, and queues the halves of the others. Partially visible
    /// cells from `new` on were integrated in this round.
    fn judge(&mut self, task: &LightTask, points: &[ShadingPoint], new: usize, round: u32) {
        // The estimate at each point, and the visible part of each new cell
        for (k, cell) in self.whole.iter().enumerate() {
            self.state[cell.point as usize].add_estimate(lane(&self.whole_sums[k / LANES].sums, k), round);
        }
        self.seen.resize(self.partial.len(), 0.0);
        for (k, panel) in self.panels.iter().enumerate() {
            let sums = &self.panel_sums[k / LANES];
            let cell = panel.cell as usize;
            self.state[panel.point as usize].add_estimate(lane(&sums.sums, k), round);
            if cell >= new {
                self.seen[cell] += sums.seen[k % LANES];
            }
        }
        // The weight of errors at this brightness
        let states = &mut self.state;
        let asked = self.whole.iter().map(|cell| cell.point);
        let asked = asked.chain(self.panels.iter().map(|panel| panel.point));
        for point in asked {
            let state = &mut states[point as usize];
            if state.round == round {
                state.round += WEIGHED;
                let ShadingPoint { bsdf, base, share, .. } = &points[point as usize];
                let worth = task.scale * bsdf.colors;
                let value = worth.onto(*base, &state.estimate);
                let allowed = task.allowed / share.max(TOLERANCE.least_share).sqrt();
                state.weight = Weight::new(task.steps, value, &worth, allowed, task.least);
            }
        }
        // Fully visible cells
        self.next_whole.clear();
        for (k, cell) in self.whole.iter().enumerate() {
            let whole_sums = &self.whole_sums[k / LANES];
            let state = &mut self.state[cell.point as usize];
            let parts = state.split(cell, fit_error(state.weight, whole_sums, k));
            if parts.is_empty() {
                state.accept(lane(&whole_sums.sums, k));
            }
            self.next_whole.extend(parts);
        }
        // Partially visible cells: halve those whose fit is refused
        let asked = self.partial.len();
        self.partial.resize(self.kept.len() * LANES, Cell::default());
        for k in new..asked {
            let cell = self.partial[k];
            let whole_sums = &self.partial_sums[(k - new) / LANES];
            let state = &mut self.state[cell.point as usize];
            let error = fit_error(state.weight, whole_sums, k - new).map(|error| error * self.seen[k]);
            let parts = state.split(&cell, error);
            if !parts.is_empty() {
                self.seen[k] = f32::NAN;
            }
            self.partial.extend(parts);
        }
        self.next_panels.clear();
        for (k, panel) in self.panels.iter().enumerate() {
            if self.seen[panel.cell as usize].is_nan() {
                continue;
            }
            let sums = &self.panel_sums[k / LANES];
            let state = &mut self.state[panel.point as usize];
            let value = lane(&sums.sums, k);
            let differences = lane(&sums.differences, k);
            // The finer rule has a smaller error than the difference, the more so the closer both are; but where
            // outlines cross, both may agree by chance
            let error = || {
                std::array::from_fn(|moment| {
                    let (difference, value) = (differences[moment], value[moment].abs());
                    difference * (4.0 * (difference / value.max(f32::MIN_POSITIVE)).sqrt()).min(1.0)
                })
            };
            let middle = 0.5 * (panel.y[0] + panel.y[1]);
            if state.weight.of(differences) > TOLERANCE.part
                && state.weight.of(error()) > TOLERANCE.part
                && panel.depth < PANEL_DEPTH
                && panel.y[0] < middle
                && middle < panel.y[1]
            {
                let half = |y: [f32; 2]| Panel { y, depth: panel.depth + 1, ..*panel };
                self.next_panels.extend([half([panel.y[0], middle]), half([middle, panel.y[1]])]);
            } else {
                state.accept(value);
            }
        }
        std::mem::swap(&mut self.whole, &mut self.next_whole);
        std::mem::swap(&mut self.panels, &mut self.next_panels);
    }
}

/// The numbers of the `k`-th member of a round, from its block.
fn lane(block: &[LaneNumbers; MOMENTS], k: usize) -> [f32; MOMENTS] {
    std::array::from_fn(|moment| block[moment][k % LANES])
}

/// The error estimate of the `k`-th cell along x and along y, as parts of the allowed error.
fn fit_error(weight: Weight, whole_sums: &CellQuadrature, k: usize) -> [f32; 2] {
    [0, 1].map(|axis| weight.of(lane(&whole_sums.errors[axis], k)))
}

/// Added to the number of a round once the weight is computed.
const WEIGHED: u32 = 1 << 31;

impl PointSum {
    /// In place of the number of cells: the point is not integrated any more.
    const GIVEN_UP: u32 = u32::MAX;

    /// Adds a sum of this round to the estimate.
    fn add_estimate(&mut self, sums: [f32; MOMENTS], round: u32) {
        if self.round != round {
            (self.round, self.estimate) = (round, self.accepted);
        }
        self.estimate += PerMoment(sums);
    }

    fn accept(&mut self, sums: [f32; MOMENTS]) {
        self.accepted += PerMoment(sums);
    }

    /// The halves of a cell with error estimates along x and y, across the axis of the larger one; none if the cell is
    /// accepted.
    fn split(&mut self, cell: &Cell, [x, y]: [f32; 2]) -> ArrayVec<Cell, 2> {
        let is_refused = x + y > TOLERANCE.part && self.may_halve(cell);
        let halves = is_refused.then(|| halves(cell, y > x)).flatten();
        self.cells += u32::from(halves.is_some());
        halves.into_iter().flatten().collect()
    }

    fn may_halve(&self, cell: &Cell) -> bool {
        cell.depth < CELL_DEPTH && self.cells < MOST_CELLS
    }
}
