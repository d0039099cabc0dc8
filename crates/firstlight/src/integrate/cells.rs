//! The integral of a light behind anything, cell by cell: cells of the light's square in which something changes are
//! cut into four, until what is left to doubt is small enough.
//!
//! Each cell has one point, at a place of its own, that says whether something is in the way; what the cell would send
//! is taken from its middle. A cell is in doubt where one next to it answers otherwise. Doubt halves from one level to
//! the next where an edge of a shadow runs: after k levels it is 2^(-1.5 k) of what it was, for 2^k times the rays.
//! Points that are doubled in number all over the light (tried, and still the way to begin with) need 2^(2 k) times the
//! rays for that.

use crate::material::{MOMENTS, Moments};
use crate::math::{LANES, Vec3};

/// Cells along a side to begin with; as many as there may be all over the light, so that nothing small is overlooked;
/// and at the end, where there is doubt.
const FIRST: usize = 32;
const EVERYWHERE: usize = 128;
/// The same where what is lit is a smaller part than this: a sliver that few cells meet falls apart when those are cut
/// that met it, and what lies between is lost.
const EVERYWHERE_THIN: usize = 256;
const THIN: f64 = 0.02;
const LAST: usize = 1024;
/// Standard deviations that an answer may be wrong by.
const SURE: f64 = 3.0;
/// Cells that are rougher than this part of the mean are cut where they are too rough together.
const SMOOTHER: f64 = 0.25;
/// Cells that send more than so many times the mean are heavy.
const HEAVY: f64 = 4.0;
/// The most cells in doubt that are cut.
const MOST: usize = 1 << 17;
/// Cells are cut that are no farther from a highlight's middle than so many times their width, until they are as narrow
/// as that part of its spread: so what lies on its skirt, or between all cells of the first size, is not overlooked.
const SKIRT: f32 = 3.0;
const FINE: f32 = 0.5;

/// What a point of a light would send, before anything is in the way.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PointSent {
    /// The way to it.
    pub way: Vec3,
    /// For each part of the light's measure: diffuse and specular.
    pub sums: [f32; MOMENTS],
}

/// A light whose points are those of the unit square, equal areas for equal areas.
pub(super) trait PointSource {
    /// What the point would send; `None` from below the horizon, or from a side that does not emit.
    fn sent(&self, at: [f32; 2]) -> Option<PointSent>;

    /// The highlight that its points make, if that may be narrow beside the first cells, and nothing else says what it
    /// makes in all.
    fn highlight(&self) -> Option<MirrorSpot> {
        None
    }

    /// Which of sixteen points something hides.
    fn hidden(&self, places: &[[f32; 2]; LANES], ways: &[Vec3; LANES], active: u16) -> u16;
}

/// Where a highlight comes from.
#[derive(Clone, Copy, Debug)]
pub(super) struct MirrorSpot {
    /// The way to its middle: unit.
    pub way: Vec3,
    /// Its standard deviation, in radians.
    pub spread: f32,
}

impl MirrorSpot {
    /// Marks those of some cells, four of them a square, that have to be cut for it.
    fn mark(&self, cells: &[PointCell], side: usize, marks: &mut [bool]) {
        for (four, marks) in cells.chunks_exact(4).zip(marks.chunks_exact_mut(4)) {
            let ways: [Vec3; 4] = std::array::from_fn(|k| four[k].way.normalize_or_zero());
            let there = || ways.iter().filter(|way| **way != Vec3::ZERO);
            let apart = |one: &Vec3| there().fold(0.0f32, |most, other| most.max((*other - *one).length()));
            let across = there().fold(0.0f32, |most, way| most.max(apart(way)));
            // One alone does not tell how wide it is
            let width = if across > 0.0 { across } else { std::f32::consts::TAU / side as f32 };
            if width > FINE * self.spread {
                for (way, mark) in ways.iter().zip(marks) {
                    *mark |= *way != Vec3::ZERO && (*way - self.way).length() < SKIRT * width;
                }
            }
        }
    }
}

/// What a cell's point says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PointState {
    Lit,
    Hidden,
    /// It sends nothing.
    Dark,
}

#[derive(Clone, Copy, Debug)]
struct PointCell {
    at: [u32; 2],
    state: PointState,
    /// What its middle sends, each for all of the light's measure.
    sums: [f32; MOMENTS],
    /// How far that is from the mean over it.
    rough: [f32; MOMENTS],
    /// The way to its middle; zero where nothing is sent.
    way: Vec3,
}

impl PointCell {
    /// How rough cells are whose four middles send this together, where the middle of all four sends `middle`: it is
    /// off by four times as much as they are.
    fn roughness(four: &[PointCell], middle: [f32; MOMENTS]) -> [f32; MOMENTS] {
        let mean = |k: usize| four.iter().map(|cell| cell.sums[k]).sum::<f32>() * 0.25;
        std::array::from_fn(|k| (mean(k) - middle[k]).abs() * (1.0 / 3.0))
    }
}

/// The states of all cells of one size, `side` along each side; where none was asked, those of larger ones.
struct CellStates {
    side: usize,
    states: Vec<PointState>,
}

impl CellStates {
    fn get(&self, at: [u32; 2]) -> PointState {
        self.states[at[1] as usize * self.side + at[0] as usize]
    }

    fn set(&mut self, at: [u32; 2], state: PointState) {
        self.states[at[1] as usize * self.side + at[0] as usize] = state;
    }

    /// With cells half as wide.
    fn halved(&self) -> CellStates {
        let side = 2 * self.side;
        let mut states = Vec::with_capacity(side * side);
        for row in self.states.chunks_exact(self.side) {
            for _ in 0..2 {
                states.extend(row.iter().flat_map(|state| [*state; 2]));
            }
        }
        CellStates { side, states }
    }

    /// The cells next to one, over corners as well.
    fn around(&self, [x, y]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> + use<> {
        let last = self.side as u32 - 1;
        let range = move |w: u32| w.saturating_sub(1)..=(w + 1).min(last);
        range(y).flat_map(move |j| range(x).map(move |i| [i, j])).filter(move |at| *at != [x, y])
    }
}

/// Sums over cells, in parts of the light's measure.
#[derive(Clone, Copy, Default)]
struct Totals {
    all: [f64; MOMENTS],
    lit: [f64; MOMENTS],
    /// How far they may be off because cells are rough: what is lit of them, what is hidden.
    rough: [[f64; MOMENTS]; 2],
}

impl Totals {
    fn add(&mut self, cell: &PointCell, area: f64) {
        if cell.state == PointState::Dark {
            return;
        }
        for (k, sum) in cell.sums.iter().enumerate() {
            self.all[k] += f64::from(*sum) * area;
            if cell.state == PointState::Lit {
                self.lit[k] += f64::from(*sum) * area;
            }
            self.rough[usize::from(cell.state == PointState::Hidden)][k] += f64::from(cell.rough[k]) * area;
        }
    }

    /// What is a part of one of the sums, as a share of all.
    fn share(&self, k: usize, part: f64) -> f64 {
        if self.all[k] > 0.0 { part / self.all[k] } else { 0.0 }
    }
}

/// A number from 0 to 1 for each cell of each level, as if by chance.
///
/// Source of the mixing: Wellons, "Prospecting for hash functions", 2018, `lowbias32`.
fn chance([x, y]: [u32; 2], side: usize, dimension: u32) -> f32 {
    let mut h = x ^ y.rotate_left(12) ^ (side as u32).rotate_left(16) ^ (dimension << 31);
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^= h >> 16;
    (h >> 8) as f32 * (1.0 / (1 << 24) as f32)
}

/// Asks the points of some cells, four of them a square.
fn ask(source: &impl PointSource, side: usize, places: &[[u32; 2]], cells: &mut Vec<PointCell>) {
    let width = 1.0 / side as f32;
    for places in places.chunks(LANES) {
        let (mut points, mut ways, mut active) = ([[0.0; 2]; LANES], [Vec3::ZERO; LANES], 0u16);
        let from = cells.len();
        for (lane, at) in places.iter().enumerate() {
            let point = [0, 1].map(|k| (at[k] as f32 + chance(*at, side, k as u32)) * width);
            let middle = at.map(|w| (w as f32 + 0.5) * width);
            let mut cell = PointCell {
                at: *at,
                state: PointState::Dark,
                sums: [0.0; MOMENTS],
                rough: [0.0; MOMENTS],
                way: Vec3::ZERO,
            };
            if let Some(sent) = source.sent(point) {
                (points[lane], ways[lane]) = (point, sent.way);
                active |= 1 << lane;
                // A middle below the horizon is near it
                let sent = source.sent(middle).unwrap_or(sent);
                (cell.state, cell.sums, cell.way) = (PointState::Lit, sent.sums, sent.way);
            }
            cells.push(cell);
        }
        let hidden = if active == 0 { 0 } else { source.hidden(&points, &ways, active) };
        for (lane, cell) in cells[from..].iter_mut().enumerate() {
            if hidden & active & (1 << lane) != 0 {
                cell.state = PointState::Hidden;
            }
        }
    }
}

/// What arrives, and how far it may be wrong: three times its standard deviation, if the points were chosen by chance.
/// Both are parts of the light's measure; or, where `whole` says what would arrive with nothing in the way, as much as
/// that makes.
pub(super) fn integrate(
    source: &impl PointSource,
    whole: Option<&Moments>,
    enough: &dyn Fn(&Moments, &Moments) -> bool,
) -> (Moments, Moments) {
    let mut cells = all(source, FIRST as u32);
    let mut grid = CellStates { side: FIRST, states: vec![PointState::Dark; FIRST * FIRST] };
    cells.iter().for_each(|cell| grid.set(cell.at, cell.state));
    let mut settled = Totals::default();
    let highlight = source.highlight();
    loop {
        let area = 1.0 / (grid.side * grid.side) as f64;
        let mut totals = settled;
        let mut doubt = [0.0f64; MOMENTS];
        let mut doubtful = vec![false; cells.len()];
        for (cell, doubtful) in cells.iter().zip(&mut doubtful) {
            totals.add(cell, area);
            *doubtful = grid.around(cell.at).any(|at| grid.get(at) != cell.state);
            if *doubtful {
                for (doubt, sum) in doubt.iter_mut().zip(cell.sums) {
                    *doubt += (f64::from(sum) * area) * (f64::from(sum) * area);
                }
            }
        }
        // A cell that an edge runs through at random is wrong by a root of a sixth, and about half of these have one
        let edges = doubt.map(|doubt| SURE * (doubt * (1.0 / 12.0)).sqrt());
        let [lit, hidden] = totals.rough;
        let rough = std::array::from_fn(|k| {
            let share = totals.share(k, totals.lit[k]);
            // Where the whole is known, only the share is in doubt: what is lit of it against what is not
            if whole.is_some() { lit[k] * (1.0 - share) + hidden[k] * share } else { lit[k] }
        });
        let whole = whole.copied().unwrap_or_else(|| Moments(totals.all.map(|sum| sum as f32)));
        let part =
            |part: [f64; MOMENTS]| Moments(std::array::from_fn(|k| whole.0[k] * totals.share(k, part[k]) as f32));
        let (sums, by_edges, by_roughness) = (part(totals.lit), part(edges), part(rough));
        let error = by_edges + by_roughness;
        // What stands in one more cell, and was not met by its point
        let one = whole * area as f32;
        let lit = totals.share(0, totals.lit[0]);
        let is_thin = lit > 0.0 && lit < THIN;
        let everywhere = if is_thin { EVERYWHERE_THIN } else { EVERYWHERE };
        if grid.side < everywhere && !enough(&sums, &one) {
            doubtful.fill(true);
        } else if grid.side == LAST {
            return (sums, error);
        } else {
            let is_enough = enough(&sums, &error);
            if is_enough {
                doubtful.fill(false);
            } else if !enough(&sums, &(by_roughness + by_roughness)) {
                // Those that are not much smoother than the mean
                let roughness = |cell: &PointCell| {
                    let shares = cell.rough.iter().enumerate().map(|(k, rough)| totals.share(k, f64::from(*rough)));
                    if cell.state == PointState::Dark { 0.0 } else { shares.sum() }
                };
                let mean = cells.iter().map(roughness).sum::<f64>() / cells.len() as f64;
                for (cell, doubtful) in cells.iter().zip(&mut doubtful) {
                    *doubtful |= roughness(cell) > SMOOTHER * mean;
                }
            }
            // One that sends far more than others is looked at more closely
            for (cell, doubtful) in cells.iter().zip(&mut doubtful) {
                let is_heavy = (0..MOMENTS).any(|k| totals.share(k, f64::from(cell.sums[k])) > HEAVY);
                if is_heavy && cell.state != PointState::Dark && !*doubtful {
                    *doubtful = !enough(&sums, &part(cell.sums.map(|sum| f64::from(sum) * area)));
                }
            }
            if let Some(highlight) = &highlight {
                highlight.mark(&cells, grid.side, &mut doubtful);
            }
            let count = doubtful.iter().filter(|doubtful| **doubtful).count();
            if count == 0 || count > MOST {
                return (sums, error);
            }
        }
        (cells, grid) = cut(source, &cells, doubtful, &grid, &mut settled);
    }
}

/// All cells of one size.
fn all(source: &impl PointSource, side: u32) -> Vec<PointCell> {
    let half = side / 2;
    let squares = (0..half * half).map(|k| [k % half, k / half]);
    let places: Vec<[u32; 2]> = squares.clone().flat_map(four).collect();
    let mut cells = Vec::with_capacity(places.len());
    ask(source, side as usize, &places, &mut cells);
    for (four, at) in cells.chunks_exact_mut(4).zip(squares) {
        let middle = source.sent(at.map(|w| (w as f32 + 0.5) / half as f32)).map_or([0.0; MOMENTS], |sent| sent.sums);
        let rough = PointCell::roughness(four, middle);
        four.iter_mut().for_each(|cell| cell.rough = rough);
    }
    cells
}

/// The quarters of a cell.
fn four([x, y]: [u32; 2]) -> [[u32; 2]; 4] {
    let [x, y] = [2 * x, 2 * y];
    [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]]
}

/// Cuts the doubtful cells into four, and those next to them where the new ones bring doubt. What is not cut is
/// settled.
fn cut(
    source: &impl PointSource,
    cells: &[PointCell],
    mut doubtful: Vec<bool>,
    grid: &CellStates,
    settled: &mut Totals,
) -> (Vec<PointCell>, CellStates) {
    let mut finer = grid.halved();
    let mut new: Vec<PointCell> = Vec::new();
    // Where each cell of this level stands in `cells`
    const NONE: u32 = u32::MAX;
    let mut number = vec![NONE; grid.states.len()];
    let index = |at: [u32; 2]| at[1] as usize * grid.side + at[0] as usize;
    for (i, cell) in cells.iter().enumerate() {
        number[index(cell.at)] = i as u32;
    }
    let mut places: Vec<[u32; 2]> = Vec::new();
    let mut queue: Vec<usize> = (0..cells.len()).filter(|i| doubtful[*i]).collect();
    while !queue.is_empty() {
        places.clear();
        places.extend(queue.iter().flat_map(|i| four(cells[*i].at)));
        let from = new.len();
        ask(source, finer.side, &places, &mut new);
        for (four, i) in new[from..].chunks_exact_mut(4).zip(queue.drain(..)) {
            let rough = PointCell::roughness(four, cells[i].sums);
            four.iter_mut().for_each(|cell| cell.rough = rough);
        }
        for cell in &new[from..] {
            finer.set(cell.at, cell.state);
        }
        for cell in &new[from..] {
            for at in finer.around(cell.at) {
                let parent = number[index(at.map(|w| w / 2))];
                if parent != NONE && !doubtful[parent as usize] && finer.get(at) != cell.state {
                    doubtful[parent as usize] = true;
                    queue.push(parent as usize);
                }
            }
        }
    }
    let area = 1.0 / (grid.side * grid.side) as f64;
    for (cell, _) in cells.iter().zip(&doubtful).filter(|(_, doubtful)| !**doubtful) {
        settled.add(cell, area);
    }
    (new, finer)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A light of which nothing is seen but where this is so.
    struct Through<F: Fn(f32, f32) -> bool>(F);

    impl<F: Fn(f32, f32) -> bool> PointSource for Through<F> {
        fn sent(&self, [x, y]: [f32; 2]) -> Option<PointSent> {
            Some(PointSent { way: Vec3::Z, sums: [1.0, x + y] })
        }

        fn hidden(&self, places: &[[f32; 2]; LANES], _: &[Vec3; LANES], active: u16) -> u16 {
            (0..LANES).fold(0, |bits, lane| bits | u16::from(!(self.0)(places[lane][0], places[lane][1])) << lane)
                & active
        }
    }

    #[track_caller]
    fn check(shape: impl Fn(f32, f32) -> bool, truth: f64, wanted: f32) {
        let whole = Moments::bounds(1.0, 1.0);
        for whole in [None, Some(&whole)] {
            let (sums, error) = integrate(&Through(&shape), whole, &|_, error| error.cosine() <= wanted);
            let off = f64::from(sums.cosine()) - truth;
            assert!(error.cosine() <= wanted, "an error of {} remains", error.cosine());
            // Three standard deviations
            assert!(off.abs() <= f64::from(wanted), "{} is off by {off:e}", sums.cosine());
        }
    }

    #[test]
    fn edges_are_found_wherever_they_run() {
        let pi = std::f64::consts::PI;
        for wanted in [1e-3, 1e-4] {
            check(|x, _| x > 0.371_3, 1.0 - 0.371_3, wanted);
            check(|_, y| y < 0.5, 0.5, wanted);
            check(|x, y| x + 2.0 * y < 1.0, 0.25, wanted);
            check(|x, y| (x - 0.5) * (x - 0.5) + (y - 0.4) * (y - 0.4) < 0.09, 0.09 * pi, wanted);
            // A slit, a hole
            check(|x, y| (x - 0.3 * y - 0.4).abs() < 0.006, 0.012, wanted);
            check(|x, y| (x - 0.7) * (x - 0.7) + (y - 0.2) * (y - 0.2) < 4e-4, 4e-4 * pi, wanted);
        }
        check(|_, _| true, 1.0, 1e-5);
        check(|_, _| false, 0.0, 1e-5);
    }
}
