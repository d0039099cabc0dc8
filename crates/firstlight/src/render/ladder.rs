//! The points of area lights that are integrated behind things: for each light sixteen series of them, which are
//! stratified together, in rungs that each double their number. A rung holds one point in each of as many cells of the
//! light as there are points before it, sixteen cells in a block, so that any of its blocks may be asked alone. Up to
//! [`LAST`] the points of a series are those of a sequence, and kept; beyond, where few blocks are asked, they are made
//! as they are.

use std::ops::Deref;
use std::sync::OnceLock;

use fearless_simd::Level;

use super::leaves::{Halved, HalvedBlock};
use crate::accel::dispatch_all;
use crate::light::{Area, FineCell, Points, SERIES, SeriesPart, with_gaps};
use crate::math::{LANES, Vec3};
use crate::parallel;
use crate::scene::Scene;
use crate::visibility::{ShadowView, Target, Viewpoint};

/// The cells of the first rung at least, and those of the last whose points are kept.
pub(super) const FIRST: usize = 16;
pub(super) const LAST: usize = 1 << 11;
const RUNGS: usize = (LAST / FIRST).ilog2() as usize + 1;

/// For each series and each rung something that is made when it is first asked for: of the points that begin a series,
/// and of those that double what is asked already.
type OfRungs<T> = [[[OnceLock<T>; 2]; RUNGS]; SERIES];

/// Where on any light they are.
static PARTS: OfRungs<SeriesPart> = [const { [const { [const { OnceLock::new() }; 2] }; RUNGS] }; SERIES];

/// The points of one light.
#[derive(Default)]
pub(super) struct Ladder {
    series: OfRungs<Box<Rung>>,
}

/// Some points of one light, in the order of its cells, each of which holds one.
pub(super) struct Rung {
    pub points: Points,
    /// Where they are, block by block.
    pub cells: Vec<[FineCell; LANES]>,
    /// Whether each point lies in the second half of its cell, as bits.
    pub halves: Vec<u16>,
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

impl AskedRung<'_> {
    /// Which of its blocks holds one more point for each leaf of the `k`-th block that was halved.
    pub fn block_of(&self, k: usize, block: &HalvedBlock) -> usize {
        match self {
            AskedRung::Kept(_) => block.cell as usize,
            AskedRung::Made(_) => k,
        }
    }

    /// Which of its points are asked, block by block, where those blocks were halved.
    pub fn asked(&self, halved: &Halved) -> Vec<u16> {
        let mut asked = vec![0; self.cells.len()];
        halved.blocks.iter().enumerate().for_each(|(k, block)| asked[self.block_of(k, block)] = u16::MAX);
        asked
    }
}

/// The numbers of those that are in a set, sixteen bits by sixteen.
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

impl Rung {
    /// Of points in cells that are parts of cells of such a level.
    fn new(cells: Vec<[FineCell; LANES]>, level: u32, points: Points) -> Box<Rung> {
        let bit = |(lane, cell): (usize, &FineCell)| (cell.half(level) as u16) << lane;
        let half = |block: &[FineCell; LANES]| block.iter().enumerate().map(bit).fold(0, |all, bit| all | bit);
        let halves = cells.iter().map(half).collect();
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

    /// One more point of a series in each leaf of those blocks that were halved, or in more of them. `at` is where each
    /// of their leaves has its point, by the number of their first half.
    pub fn next<'t>(&self, series: usize, halved: &Halved, at: impl Fn(u32) -> &'t [FineCell; LANES]) -> AskedRung<'a> {
        if Self::keeps(halved.level) {
            return self.rung(series, 1 << halved.level, 1 << halved.level);
        }
        let mut cells = Vec::with_capacity(halved.blocks.len());
        let points = dispatch_all!(self.level, _simd => {
            for block in &halved.blocks {
                cells.push(FineCell::seconds(at(block.halves[0]), series, halved.level));
            }
            self.area.points_at(cells.iter().map(FineCell::middles))
        });
        AskedRung::Made(Rung::new(cells, halved.level, points))
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
            let part = &PARTS[series][(count / FIRST).ilog2() as usize][usize::from(first > 0)];
            let part = parallel::kept(part, || SeriesPart::new(series, first as u32, count as u32));
            Rung::new(part.cells.clone(), count.ilog2(), self.area.points_at(part.places.iter().copied()))
        }))
    }

    /// Which of a rung's points that are `asked` are hidden from a point, by what is in its view; says how many rays
    /// were traced.
    pub fn mask(&self, rung: &Rung, asked: &[u16], view: &mut ShadowView, point: &Viewpoint) -> u64 {
        if !view.needs_mask() {
            view.hidden.clear();
            return 0;
        }
        let target = rung.target.get_or_init(|| self.target.with_neighbours(self.level, &rung.points));
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
