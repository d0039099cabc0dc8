//! What arrives from one flat light at many points: batches of sixteen, and a queue of what is not good enough yet.
//!
//! ```text
//! points ── classify ──▶ nothing arrives
//!              │ cells of the light
//!              ▼
//!             fit ──▶ seen whole: mean and error estimate ─────────────────┐
//!              │ polynomials, panels                                       ▼
//!              ▼                                                         judge ──▶ accepted
//!             rows ──▶ seen in part: sums and error estimate ──────────────┘ │ halved cells, halved panels
//!              ▲                                                             │
//!              └────────────────────────── next round ◀──────────────────────┘
//! ```
//!
//! Two certificates stand apart: whether the light is known on a cell (the end of its series), and whether what is seen
//! of the cell is (two rules for the rows of each panel). What is asked again is asked with everything else that is.

use std::f32::consts::FRAC_1_SQRT_2;

use arrayvec::ArrayVec;
use fearless_simd::{Level, Simd};

use super::Sums;
use super::batch::{Block, Members, ShadingPoint, ViewBlock};
use super::classify::{Class, Obstacles, classify};
use super::emitter::Emitter;
use super::fit::{Cell, Fits, MOMENTS, Polynomial, coarse, fit};
use super::panels::{Between, Blocked, Panel, PanelSums, cut, rows};
use super::tolerance::{Tolerance, Weight};
use super::view::{Outline, Receiver, View};
use crate::color::DisplaySteps;
use crate::material::{Lobe, Moments};
use crate::math::{LANES, dispatch_wide, square};

/// How much of a light shines on a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Illumination {
    /// Nothing: all is below a horizon, or the point is behind the light.
    Below,
    /// Nothing: something hides all of it.
    Hidden,
    /// All of it is seen.
    Full,
    /// A part of it, known in closed form.
    Partial,
    /// Something is in the way that has no closed form here.
    Unknown,
}

/// What arrives at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrived {
    pub sums: Sums,
    pub illumination: Illumination,
    /// Whether the same is proved for all places within the point's reach.
    pub proved: bool,
    /// See [`Class::motion`].
    pub motion: f32,
    /// How far the light is away, and the point from its plane.
    pub distance: f32,
    pub height: f32,
}

impl Arrived {
    /// What arrives of two parts of a light.
    fn and(&self, other: &Arrived) -> Arrived {
        let illumination = match (self.illumination, other.illumination) {
            (one, other) if one == other => one,
            (Illumination::Unknown, _) | (_, Illumination::Unknown) => Illumination::Unknown,
            _ => Illumination::Partial,
        };
        Arrived {
            sums: self.sums + other.sums,
            illumination,
            proved: self.proved && other.proved && illumination != Illumination::Partial,
            motion: self.motion.max(other.motion),
            ..*self
        }
    }
}

/// A light as it is asked.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    pub emitter: &'a Emitter,
    pub obstacles: &'a Obstacles<'a>,
    /// What of trees may be in the way, if anything is.
    pub near: Option<&'a Obstacles<'a>>,
    pub lobe: &'a Lobe,
    pub steps: &'a DisplaySteps,
    pub tolerance: &'a Tolerance,
    /// In display steps: how far this light may be wrong at a point that stands for a pixel.
    pub allowed: f32,
    /// The value that many steps above black.
    pub least: f32,
    /// Whether others can take the light away.
    pub shadows: bool,
}

/// The memory of [`evaluate`](Evaluator::evaluate), used again and again.
#[derive(Default)]
pub(crate) struct Evaluator {
    /// Point by point.
    views: Vec<ViewBlock>,
    between: Vec<Between>,
    state: Vec<State>,
    /// Cells that are seen whole, to be asked: those on which light is smooth enough that few nodes may tell it, and
    /// others.
    smooth: Vec<Cell>,
    whole: Vec<Cell>,
    /// All cells that are seen in part, with their polynomials as far as they were asked, and how much is seen of each.
    cut: Vec<Cell>,
    polynomials: Vec<[Polynomial; MOMENTS]>,
    seen: Vec<f32>,
    /// Panels to be asked.
    panels: Vec<Panel>,
    /// What was asked in one round.
    smooth_fits: Vec<Fits>,
    fits: Vec<Fits>,
    cut_fits: Vec<Fits>,
    panel_sums: Vec<PanelSums>,
    next_whole: Vec<Cell>,
    next_panels: Vec<Panel>,
    spare: Vec<Block>,
    /// Of the far half of a ball.
    far: Vec<Arrived>,
}

/// What is known of one point.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    accepted: Sums,
    /// With all that is not accepted yet.
    estimate: Sums,
    weight: Weight,
    /// The round that the last two are of.
    round: u32,
    cells: u32,
}

impl Evaluator {
    /// Adds to `arrived` what of a light arrives at each point.
    pub fn evaluate(&mut self, level: Level, light: &Asked, points: &[ShadingPoint], arrived: &mut Vec<Arrived>) {
        let is_cut = || light.obstacles.touch_ball() || light.near.is_some_and(Obstacles::touch_ball);
        let Some([near, far]) = light.emitter.halves().filter(|_| light.shadows && is_cut()) else {
            return self.evaluate_one(level, light, points, arrived);
        };
        // Both halves of a ball: what reaches into it hides more of the far one
        let half = |emitter| Asked { emitter, allowed: light.allowed * FRAC_1_SQRT_2, ..*light };
        let first = arrived.len();
        self.evaluate_one(level, &half(&near), points, arrived);
        let mut behind = std::mem::take(&mut self.far);
        behind.clear();
        self.evaluate_one(level, &half(&far), points, &mut behind);
        for (one, other) in arrived[first..].iter_mut().zip(&behind) {
            *one = one.and(other);
        }
        self.far = behind;
    }

    fn evaluate_one(&mut self, level: Level, light: &Asked, points: &[ShadingPoint], arrived: &mut Vec<Arrived>) {
        let first = arrived.len();
        self.look(level, light, points, arrived);
        let arrived = &mut arrived[first..];
        let mut round = 0;
        while !(self.smooth.is_empty()
            && self.whole.is_empty()
            && self.polynomials.len() == self.cut.len()
            && self.panels.is_empty())
        {
            round += 1;
            let new = self.polynomials.len();
            self.ask(level, light);
            self.judge(light, points, new, round);
        }
        for (arrived, state) in arrived.iter_mut().zip(&self.state) {
            arrived.sums = state.accepted.at_least_0();
        }
    }

    /// Finds out how each point sees the light, and queues the cells it is asked by.
    fn look(&mut self, level: Level, light: &Asked, points: &[ShadingPoint], arrived: &mut Vec<Arrived>) {
        // Blocks are written where they are read: nothing of what is left in them counts
        if self.views.len() < points.len().div_ceil(LANES) {
            self.views.resize(points.len().div_ceil(LANES), ViewBlock::default());
        }
        self.between.clear();
        self.state.clear();
        self.state.resize(points.len(), State::default());
        self.smooth.clear();
        self.whole.clear();
        self.cut.clear();
        self.panels.clear();
        self.polynomials.clear();
        self.seen.clear();
        for (block, points) in points.chunks(LANES).enumerate() {
            let start = block * LANES;
            let mut seen: ArrayVec<Option<View>, LANES> = ArrayVec::new();
            for (k, point) in points.iter().enumerate() {
                seen.push(view(light, point));
                if let Some(view) = &seen[k] {
                    self.views[block].set(k, point.p, view);
                }
            }
            let mut classes = [Class::default(); LANES];
            if light.shadows {
                let mut arriving = 0;
                for (k, view) in seen.iter().enumerate() {
                    arriving |= u64::from(view.as_ref().is_some_and(View::arrives)) << k;
                }
                let views = &self.views;
                classes = dispatch_wide!(level, simd => {
                    let members = Members::new(views, |k| (start + k) as u32);
                    simd.vectorize(
                        #[inline(always)]
                        || classify(simd, light.obstacles, light.near, light.emitter, &members, points, arriving),
                    )
                });
            }
            for (k, view) in seen.iter().enumerate() {
                let class = &classes[k];
                let mut one = Arrived {
                    sums: Sums::default(),
                    illumination: Illumination::Below,
                    proved: false,
                    motion: 0.0,
                    distance: 0.0,
                    height: 0.0,
                };
                if light.emitter.surrounds(points[k].p) {
                    one.illumination = Illumination::Unknown;
                }
                let mut between = Between::default();
                if let Some(view) = view {
                    (one.distance, one.height) = (view.nearest(), view.height);
                }
                if let Some(view) = view.as_ref().filter(|view| view.arrives()) {
                    one.motion = class.motion;
                    between = class.between;
                    one.illumination = match class {
                        Class { hidden: true, .. } => Illumination::Hidden,
                        Class { other: true, .. } => Illumination::Unknown,
                        _ if between == Between::default() && view.is_above_horizon() => Illumination::Full,
                        _ => Illumination::Partial,
                    };
                    if matches!(one.illumination, Illumination::Full | Illumination::Partial) {
                        let is_open = between == Between::default();
                        self.state[start + k].cells = self.grade(light, view, (start + k) as u32, is_open);
                    }
                }
                if let Some(view) = view {
                    one.proved = points[k].reach == 0.0 || is_proved(view, &points[k], &one);
                }
                self.between.push(between);
                arrived.push(one);
            }
        }
    }

    /// Asks all cells and panels of this round.
    fn ask(&mut self, level: Level, light: &Asked) {
        let Evaluator { views, between, smooth, whole, cut: cut_cells, polynomials, panels, spare, .. } = self;
        let falloff = light.emitter.falloff();
        let outline = light.emitter.outline();
        let Obstacles { occluders, ball, cuts, .. } = light.obstacles;
        let near = light.near.map_or(&[][..], |near| &near.occluders);
        let cuts = cuts | light.near.map_or(0, |near| near.cuts << occluders.len());
        let ball = ball.map(|(center, radius)| (center, radius, light.emitter.shows_far_half()));
        let blocked = Blocked { occluders: [occluders, near], ball, cuts, outline, between };
        let moments = light.lobe.moment_count();
        self.smooth_fits.clear();
        self.fits.clear();
        self.cut_fits.clear();
        self.panel_sums.clear();
        let (smooth_fits, fits) = (&mut self.smooth_fits, &mut self.fits);
        let (cut_fits, panel_sums) = (&mut self.cut_fits, &mut self.panel_sums);
        // Those of the cut cells that are new; others have their polynomials
        let new = cut_cells[polynomials.len()..].chunks(LANES).map(|cells| (cells, true));
        let asked = whole.chunks(LANES).map(|cells| (cells, false)).chain(new);
        // Each kernel is called at one place: so there is one copy of it for each instruction set
        dispatch_wide!(level, simd => {
            for cells in smooth.chunks(LANES) {
                let members = Members::new(views, |k| cells[k.min(cells.len() - 1)].point);
                smooth_fits.push(simd.vectorize(
                    #[inline(always)]
                    || coarse(simd, light.lobe, falloff, &members, cells),
                ));
            }
            for (cells, is_cut) in asked {
                let members = Members::new(views, |k| cells[k.min(cells.len() - 1)].point);
                let first = polynomials.len() as u32;
                let wanted = is_cut.then_some(&mut *polynomials);
                let fitted = simd.vectorize(
                    #[inline(always)]
                    || fit(simd, light.lobe, falloff, &members, cells, wanted),
                );
                if is_cut {
                    cut_fits.push(fitted);
                    cut(simd, &blocked, &members, cells, first, spare, panels);
                } else {
                    fits.push(fitted);
                }
            }
            for some in panels.chunks(LANES) {
                let point = |k: usize| cut_cells[some[k.min(some.len() - 1)].cell as usize].point;
                let members = Members::new(views, point);
                panel_sums.push(simd.vectorize(
                    #[inline(always)]
                    || rows(simd, &blocked, &members, cut_cells, polynomials, some, moments),
                ));
            }
        });
    }

    /// Accepts what is good enough, and queues the halves of what is not. Cut cells from `new` on were asked for the
    /// first time.
    fn judge(&mut self, light: &Asked, points: &[ShadingPoint], new: usize, round: u32) {
        let tolerance = light.tolerance;
        // What arrives as far as is known now, and how much of each new cell is seen
        for (k, cell) in self.smooth.iter().enumerate() {
            self.state[cell.point as usize].expect(lane(&self.smooth_fits[k / LANES].sums, k), round);
        }
        for (k, cell) in self.whole.iter().enumerate() {
            self.state[cell.point as usize].expect(lane(&self.fits[k / LANES].sums, k), round);
        }
        self.seen.resize(self.cut.len(), 0.0);
        for (k, panel) in self.panels.iter().enumerate() {
            let sums = &self.panel_sums[k / LANES];
            let cell = panel.cell as usize;
            self.state[self.cut[cell].point as usize].expect(lane(&sums.sums, k), round);
            if cell >= new {
                self.seen[cell] += sums.seen[k % LANES];
            }
        }
        // How much errors weigh at such a brightness
        let (states, cut) = (&mut self.state, &self.cut);
        let asked = self.smooth.iter().chain(&self.whole).map(|cell| cell.point);
        let asked = asked.chain(self.panels.iter().map(|panel| cut[panel.cell as usize].point));
        for point in asked {
            let state = &mut states[point as usize];
            if state.round == round {
                state.round += WEIGHED;
                let ShadingPoint { worth, base, share, .. } = &points[point as usize];
                let value = worth.onto(*base, &state.estimate);
                let allowed = light.allowed / share.max(tolerance.least_share).sqrt();
                state.weight = Weight::new(light.steps, value, worth, allowed, light.least);
            }
        }
        // Cells that are seen whole
        self.next_whole.clear();
        for (k, cell) in self.smooth.iter().enumerate() {
            let fits = &self.smooth_fits[k / LANES];
            let state = &mut self.state[cell.point as usize];
            if coarse_error(state.weight, fits, k) * tolerance.fit_coarse > state.part(tolerance) {
                self.next_whole.push(*cell);
            } else {
                state.accept(lane(&fits.sums, k));
            }
        }
        self.smooth.clear();
        for (k, cell) in self.whole.iter().enumerate() {
            let fits = &self.fits[k / LANES];
            let state = &mut self.state[cell.point as usize];
            let error = fit_error(state.weight, fits, k, 1.0, [tolerance.fit_seen, tolerance.fit_seen_slow]);
            let is_off = error[0] + error[1] > state.part(tolerance) && state.may_halve(cell, tolerance);
            if let Some(halves) = halves(cell, error[1] > error[0]).filter(|_| is_off) {
                state.cells += 1;
                self.next_whole.extend(halves);
            } else {
                state.accept(lane(&fits.sums, k));
            }
        }
        // Cells that are seen in part: those whose light is not known well enough are asked anew
        let asked = self.cut.len();
        for k in new..asked {
            let cell = self.cut[k];
            let fits = &self.cut_fits[(k - new) / LANES];
            let state = &mut self.state[cell.point as usize];
            let shares = [tolerance.fit_cut, tolerance.fit_cut_slow];
            let error = fit_error(state.weight, fits, k - new, self.seen[k], shares);
            let is_off = error[0] + error[1] > state.part(tolerance) && state.may_halve(&cell, tolerance);
            if let Some(halves) = halves(&cell, error[1] > error[0]).filter(|_| is_off) {
                state.cells += 1;
                self.cut.extend(halves);
                self.seen[k] = f32::NAN;
            }
        }
        self.next_panels.clear();
        for (k, panel) in self.panels.iter().enumerate() {
            if self.seen[panel.cell as usize].is_nan() {
                continue;
            }
            let sums = &self.panel_sums[k / LANES];
            let state = &mut self.state[self.cut[panel.cell as usize].point as usize];
            let value = lane(&sums.sums, k);
            let differences = lane(&sums.differences, k);
            // The finer rule is better than the difference says, the more the closer both are
            let error = std::array::from_fn(|moment| {
                let (difference, value) = (differences[moment], value[moment].abs());
                let rounding = tolerance.rounding * state.estimate.0[moment].abs();
                if difference <= rounding { 0.0 } else { difference * (2.0 * (difference / value).sqrt()).min(1.0) }
            });
            let middle = 0.5 * (panel.y[0] + panel.y[1]);
            if state.weight.of(error) > state.part(tolerance)
                && panel.depth < tolerance.panel_depth
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

/// The numbers of the `k`-th of all that was asked in a round, from the block it is in.
fn lane(block: &[Block; MOMENTS], k: usize) -> [f32; MOMENTS] {
    block.map(|numbers| numbers[k % LANES])
}

/// How far the fit of the `k`-th cell can be wrong along x and along y, as parts of what is allowed, where so much of
/// it is `seen`: so much of the end of its series, and more where the series falls slowly, which says less of what
/// comes after its end.
fn fit_error(weight: Weight, fits: &Fits, k: usize, seen: f32, [share, slow_share]: [f32; 2]) -> [f32; 2] {
    let sums = lane(&fits.sums, k);
    fits.tails.map(|tails| {
        let tails = lane(&tails, k);
        weight.of(std::array::from_fn(|moment| {
            let slow = (tails[moment] / sums[moment].abs()).min(1.0);
            seen * tails[moment] * (share + slow_share * slow)
        }))
    })
}

/// The same by few nodes, along both axes: what they miss is the third power of the end of the series, where that is
/// small beside the sum.
fn coarse_error(weight: Weight, fits: &Fits, k: usize) -> f32 {
    let sums = lane(&fits.sums, k);
    let [x, y] = fits.tails.map(|tails| {
        let tails = lane(&tails, k);
        weight.of(std::array::from_fn(|moment| tails[moment] * square((tails[moment] / sums[moment].abs()).min(1.0))))
    });
    x + y
}

/// Added to the number of a round once the weight is known.
const WEIGHED: u32 = 1 << 31;

impl State {
    /// Counts on what was asked in a round.
    fn expect(&mut self, sums: [f32; MOMENTS], round: u32) {
        if self.round != round {
            (self.round, self.estimate) = (round, self.accepted);
        }
        self.estimate += Moments(sums);
    }

    fn accept(&mut self, sums: [f32; MOMENTS]) {
        self.accepted += Moments(sums);
    }

    /// What one part of the light may use up: where there are many, their errors add up.
    fn part(&self, tolerance: &Tolerance) -> f32 {
        tolerance.part / (self.cells as f32 / tolerance.few_cells).max(1.0).sqrt()
    }

    fn may_halve(&self, cell: &Cell, tolerance: &Tolerance) -> bool {
        cell.depth < tolerance.cell_depth && self.cells < tolerance.most_cells
    }
}

/// Both halves of a cell, along x or along y: at 0, from where places are counted, or in the middle. `None` where no
/// number is left between.
fn halves(cell: &Cell, along_y: bool) -> Option<[Cell; 2]> {
    let [from, to] = if along_y { cell.y } else { cell.x };
    let middle = if from < 0.0 && to > 0.0 { 0.0 } else { 0.5 * (from + to) };
    let half = |range: [f32; 2]| {
        let depth = cell.depth + 1;
        if along_y { Cell { y: range, depth, ..*cell } } else { Cell { x: range, depth, ..*cell } }
    };
    (from < middle && middle < to).then(|| [half([from, middle]), half([middle, to])])
}

/// How much of a cell is seen where nothing is in the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    None,
    Some,
    All,
}

impl Part {
    /// Of a rectangle of a light's square.
    fn of(view: &View, x: [f32; 2], y: [f32; 2]) -> Part {
        let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
        let mut part = Part::All;
        for line in [&view.cos, &view.horizon] {
            let above = corners.map(|[x, y]| line.at(x, y) > 0.0);
            if above == [false; 4] {
                return Part::None;
            } else if above != [true; 4] {
                part = Part::Some;
            }
        }
        if view.outline == Outline::Disk {
            let [ox, oy] = view.origin;
            let far2 = corners.into_iter().fold(0.0f32, |far, [x, y]| far.max(square(x + ox) + square(y + oy)));
            let gap = |[from, to]: [f32; 2], o: f32| (from + o).max(-(to + o)).max(0.0);
            if square(gap(x, ox)) + square(gap(y, oy)) >= 1.0 {
                return Part::None;
            } else if far2 > 1.0 {
                part = Part::Some;
            }
        }
        part
    }
}

impl Evaluator {
    /// Queues the cells that a light is asked by at first: none is wide beside its distance, or beside a highlight on
    /// it. With nothing in the way (`is_open`), those of which all is seen are told apart. Returns how many there are.
    fn grade(&mut self, light: &Asked, view: &View, point: u32, is_open: bool) -> u32 {
        let tolerance = light.tolerance;
        let sharpness = view.lobe.sharpness(view.cos_o);
        let mirror = if sharpness > 0.0 { view.mirror() } else { None };
        let (mut count, mut halved) = (0, 0);
        let mut open: ArrayVec<Cell, { MAX_GRADED + 2 }> = ArrayVec::new();
        let [x, y] = view.whole();
        open.push(Cell { point, x, y, depth: 0 });
        while let Some(cell) = open.pop() {
            let [[x0, x1], [y0, y1]] = view.around([cell.x, cell.y]);
            let (half_x, half_y) = (0.5 * (x1 - x0) * view.la, 0.5 * (y1 - y0) * view.lb);
            let lean = 0.5 * (y1 - y0) * view.skew.abs();
            let (x, y) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
            let gap = |off: f32, half: f32| (off.abs() - half).max(0.0);
            let gap_x = gap(view.fa + x * view.la + y * view.skew, half_x + lean);
            let gap_y = gap(view.fb + y * view.lb, half_y);
            let distance2 = square(gap_x) + square(gap_y) + square(view.height);
            let size2 = square(half_x + lean) + square(half_y);
            let mut is_wide = size2 > square(tolerance.widest_cell) * distance2;
            let mut is_smooth = size2 < tolerance.smooth_cell * distance2;
            if sharpness * size2 > tolerance.smooth_cell * distance2 {
                // How far off the highlight's middle the cell begins
                let is_far = mirror.is_some_and(|mirror| {
                    let l = view.l(x, y);
                    let cos = (l.dot(mirror) / l.length()).clamp(-1.0, 1.0);
                    let apart = (2.0 * (1.0 - cos)).sqrt() - (size2 / l.length_squared()).sqrt();
                    sharpness * square(apart.max(0.0)) >= tolerance.highlight_end
                });
                is_wide |= mirror.is_some() && !is_far && sharpness * size2 > tolerance.widest_highlight * distance2;
                is_smooth &= is_far;
            }
            let part = Part::of(view, [x0, x1], [y0, y1]);
            if part == Part::None {
                continue;
            }
            is_wide &= cell.depth < tolerance.cell_depth && halved < tolerance.most_cells && open.len() < MAX_GRADED;
            // The longer edge, in metres, or on the sphere
            let along_y = match view.outline {
                Outline::Sphere => cell.y[1] - cell.y[0] > cell.x[1] - cell.x[0],
                Outline::Parallelogram | Outline::Disk => square(half_y) + square(lean) > square(half_x),
            };
            if let Some([one, other]) = halves(&cell, along_y).filter(|_| is_wide) {
                halved += 1;
                open.extend([other, one]);
            } else {
                count += 1;
                let queue = match is_open && part == Part::All {
                    true if is_smooth => &mut self.smooth,
                    true => &mut self.whole,
                    false => &mut self.cut,
                };
                queue.push(cell);
            }
        }
        count
    }
}

/// The most cells that wait to be halved: each halving leaves one behind.
const MAX_GRADED: usize = 72;

/// Whether a point's illumination is that of all places within its reach.
fn is_proved(view: &View, point: &ShadingPoint, arrived: &Arrived) -> bool {
    let far = view.corners().iter().fold(0.0f32, |far, l| far.max(l.length()));
    let room = point.reach + point.turn * (far + point.reach);
    let is_beside = view.height > point.reach || (view.facing.is_infinite() && !view.physical);
    match arrived.illumination {
        Illumination::Below => {
            view.max(&view.horizon) < -room || view.max(&view.cos) < -room || view.facing < -point.reach
        }
        Illumination::Hidden => arrived.motion == 0.0 && is_beside,
        Illumination::Full => {
            arrived.motion == 0.0 && is_beside && view.min(&view.horizon) > room && view.min(&view.cos) > room
        }
        Illumination::Partial | Illumination::Unknown => false,
    }
}

/// The light as one point sees it.
fn view(light: &Asked, point: &ShadingPoint) -> Option<View> {
    let flat = light.emitter.flat(point.p)?;
    let ShadingPoint { p, error, horizon, ns, wo, .. } = *point;
    Some(View::new(&flat, &Receiver { p, error, horizon, ns, wo, lobe: *light.lobe }))
}
