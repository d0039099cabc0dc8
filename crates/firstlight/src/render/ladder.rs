//! The points of area lights that are integrated behind things: for each light sixteen series of them, which are
//! stratified together, in rungs that each double their number. A rung holds one point in each of as many cells of the
//! light as there are points before it, so that any of its cells may be asked alone. Up to [`LAST`] the points of a
//! series are those of a sequence, and kept; beyond, where few cells are asked, they are made as they are.

use std::ops::Deref;
use std::sync::OnceLock;

use fearless_simd::Level;

use super::leaves::Halved;
use crate::light::{Area, FineCell, Points, SERIES, series_by_cell, with_gaps};
use crate::math::{LANES, Vec3};
use crate::scene::Scene;
use crate::visibility::{ShadowView, Target, Viewpoint};

/// The cells of the first rung at least, and those of the last whose points are kept.
pub(super) const FIRST: usize = 16;
const LAST: usize = 1 << 11;
const RUNGS: usize = (LAST / FIRST).ilog2() as usize + 1;

/// The points of one light, series by series, each rung made when it is first asked for: those that begin a series, and
/// those that double what is asked already.
#[derive(Default)]
pub(super) struct Ladder {
    series: [[[OnceLock<Box<Rung>>; 2]; RUNGS]; SERIES],
}

/// Some points of one light, in the order of its cells, each of which holds one.
pub(super) struct Rung {
    pub points: Points,
    /// Where they are.
    pub cells: Vec<FineCell>,
    /// Which half of its cell each point lies in, as bits.
    pub halves: CellBits,
    target: OnceLock<Target>,
}

/// A rung, kept or made for once.
pub(super) enum AskedRung<'a> {
    Kept(&'a Rung),
    Made(Box<Rung>),
}

impl Deref for AskedRung<'_> {
    type Target = Rung;

    fn deref(&self) -> &Rung {
        match self {
            AskedRung::Kept(rung) => rung,
            AskedRung::Made(rung) => rung,
        }
    }
}

/// Some cells of a light: a bit for each, sixteen by sixteen.
pub(super) type CellBits = Vec<u16>;

/// The numbers of the cells that are in a set.
pub(super) fn cells_in(bits: &[u16]) -> impl Iterator<Item = usize> {
    let lanes = |(block, bits): (usize, &u16)| {
        let bits = *bits;
        (0..LANES).filter(move |lane| bits >> lane & 1 == 1).map(move |lane| block * LANES + lane)
    };
    bits.iter().enumerate().flat_map(lanes)
}

/// Bits of a block of cells as those of two blocks of halves: of each cell the first or, where `second` says so, the
/// second.
pub(super) fn to_halves(bits: u16, second: u16) -> [u16; 2] {
    let halves = with_gaps((bits & !second).into()) | with_gaps((bits & second).into()) << 1;
    [halves as u16, (halves >> LANES) as u16]
}

/// Whether a cell is in a set.
pub(super) fn is_in(bits: &[u16], cell: usize) -> bool {
    bits[cell / LANES] >> (cell % LANES) & 1 == 1
}

impl Rung {
    fn new(cells: Vec<FineCell>, halves: CellBits, points: Points) -> Box<Rung> {
        Box::new(Rung { points, cells, halves, target: OnceLock::new() })
    }
}

/// One light, as points ask for it.
#[derive(Clone, Copy)]
pub(super) struct Asker<'a> {
    pub scene: &'a Scene,
    pub level: Level,
    pub area: &'a Area,
    pub target: &'a Target,
    pub ladder: &'a Ladder,
}

impl<'a> Asker<'a> {
    /// The first points of a series, one in each of so many cells.
    pub fn first(&self, series: usize, cells: usize) -> AskedRung<'a> {
        self.rung(series, 0, cells)
    }

    /// One more point of a series in each of so many cells, where the first ones are asked.
    pub fn second(&self, series: usize, cells: usize) -> AskedRung<'a> {
        self.rung(series, cells, cells)
    }

    /// One more point of a series in each of those cells that were halved, or in more of them: see
    /// [`asked`](Self::asked). `at` is where each leaf has its point.
    pub fn next(&self, series: usize, halved: &Halved, at: &[FineCell]) -> AskedRung<'a> {
        if Self::keeps(halved.level) {
            return self.second(series, 1 << halved.level);
        }
        let second = |first: &u32| at[*first as usize].second(series, halved.level);
        let cells: Vec<_> = halved.first.iter().map(second).collect();
        let points = self.area.points_at(cells.iter().map(|cell| cell.middle()));
        AskedRung::Made(Rung::new(cells, CellBits::new(), points))
    }

    /// Which of the points of [`next`](Self::next) are asked.
    pub fn asked(halved: &Halved) -> CellBits {
        if Self::keeps(halved.level) {
            return halved.bits();
        }
        let mut bits = vec![u16::MAX; halved.cells.len().div_ceil(LANES)];
        // The last sixteen may be fewer
        if let (Some(last), more @ 1..) = (bits.last_mut(), halved.cells.len() % LANES) {
            *last = (1 << more) - 1;
        }
        bits
    }

    /// Whether points in all cells of a level, and one more in each, are kept.
    pub fn keeps(level: u32) -> bool {
        2 << level <= LAST
    }

    /// The first point of a series in one of so many cells.
    pub fn point(&self, series: usize, cells: usize, cell: usize) -> Vec3 {
        self.first(series, cells).points.get(cell)
    }

    fn rung(&self, series: usize, first: usize, count: usize) -> AskedRung<'a> {
        let kept = &self.ladder.series[series][(count / FIRST).ilog2() as usize][usize::from(first > 0)];
        AskedRung::Kept(kept.get_or_init(|| {
            let places = series_by_cell(series, first as u32, count as u32);
            let points = self.area.points_at(places.iter().copied());
            let cells: Vec<FineCell> = places.into_iter().map(FineCell::of).collect();
            let half = |block: &[FineCell]| {
                let bits = block.iter().enumerate().map(|(lane, cell)| (cell.half(count.ilog2()) as u16) << lane);
                bits.fold(0, |all, bit| all | bit)
            };
            let halves = cells.chunks(LANES).map(half).collect();
            Rung::new(cells, halves, points)
        }))
    }

    /// Which of a rung's points that are `asked` are hidden from a point, by what is in its view; says how many rays
    /// were traced.
    pub fn mask(&self, rung: &Rung, asked: &[u16], view: &mut ShadowView, point: &Viewpoint) -> u64 {
        if !view.asks_points() {
            view.hidden.clear();
            return 0;
        }
        let target = rung.target.get_or_init(|| self.target.with_neighbours(&rung.points));
        view.mask(self.level, self.scene, target, Some(asked), point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_of_cells_become_those_of_halves() {
        assert_eq!(to_halves(0b1011, 0b0010), [0b0100_1001, 0]);
        assert_eq!(to_halves(0x8001, 0x8000), [1, 0x8000]);
        let [first, second] = [0, u16::MAX].map(|second| to_halves(u16::MAX, second));
        assert_eq!((first, second), ([0x5555; 2], [0xaaaa; 2]));
    }
}
