//! The cells of a light that rays ask points in: halves of halves of it, large where nothing happens and small where
//! the edge of a shadow runs. The cells of a rung lie in one order, that of [`FineCell`], and so do leaves.

use super::ladder::CellBits;
use crate::light::FineCell;
use crate::math::LANES;

/// What is left of a light once cells were halved: each leaf holds one point of each ray.
#[derive(Debug)]
pub(super) struct Leaves {
    cells: Vec<FineCell>,
    /// How often the light was halved to make each of them.
    pub levels: Vec<u32>,
    /// The part of the light that each of them is, and 0 up to a multiple of sixteen.
    pub parts: Vec<f32>,
}

/// Leaves of one size that were halved.
#[derive(Debug, Default)]
pub(super) struct Halved {
    pub level: u32,
    /// Their numbers among all cells of that size.
    pub cells: Vec<u64>,
    /// The numbers of their first halves, which the second ones follow, among all leaves that are there now.
    pub first: Vec<u32>,
    /// Whether they were thought to be away from edges.
    pub away: Vec<bool>,
}

impl Leaves {
    /// All cells of one size.
    pub fn of(level: u32) -> Leaves {
        let count = 1u64 << level;
        let mut leaves = Leaves {
            cells: (0..count).map(|cell| FineCell::first_of(cell, level)).collect(),
            levels: vec![level; count as usize],
            parts: Vec::new(),
        };
        leaves.weigh();
        leaves
    }

    pub fn count(&self) -> usize {
        self.cells.len()
    }

    /// The place of a leaf that is nearest to one.
    pub fn nearest(&self, leaf: usize, to: FineCell) -> [f64; 2] {
        to.nearest_in(self.cells[leaf], self.levels[leaf]).middle()
    }

    fn weigh(&mut self) {
        self.parts.clear();
        self.parts.extend(self.levels.iter().map(|level| 1.0 / (1u64 << level) as f32));
        self.parts.resize(self.count().next_multiple_of(LANES), 0.0);
    }

    /// Halves those leaves of which `is` says whether they are away from edges, by their number and level. Says which
    /// they were, and which of each size.
    pub fn halve(&mut self, is: impl Fn(usize, u32) -> Option<bool>) -> (Vec<u32>, Vec<Halved>) {
        let (mut parted, mut halved) = (Vec::new(), Vec::<Halved>::new());
        for (leaf, (cell, level)) in self.cells.iter().zip(&self.levels).enumerate() {
            let Some(away) = is(leaf, *level) else { continue };
            let of = halved.iter().position(|halved| halved.level == *level).unwrap_or_else(|| {
                halved.push(Halved { level: *level, ..Halved::default() });
                halved.len() - 1
            });
            halved[of].cells.push(cell.part_of(1 << level) as u64);
            halved[of].first.push((leaf + parted.len()) as u32);
            halved[of].away.push(away);
            parted.push(leaf as u32);
        }
        let before = self.count();
        self.cells.resize(before + parted.len(), FineCell::default());
        self.levels.resize(before + parted.len(), 0);
        follow(&mut self.cells, before, &parted);
        follow(&mut self.levels, before, &parted);
        for Halved { level, cells, first, .. } in &halved {
            for (cell, first) in cells.iter().zip(first) {
                for half in 0..2 {
                    let leaf = *first as usize + half;
                    self.levels[leaf] = level + 1;
                    self.cells[leaf] = FineCell::first_of(2 * cell + half as u64, level + 1);
                }
            }
        }
        self.weigh();
        (parted, halved)
    }
}

impl Halved {
    /// The cells as a set of all of that size.
    pub fn bits(&self) -> CellBits {
        let mut bits = vec![0; (1usize << self.level).div_ceil(LANES)];
        for cell in &self.cells {
            bits[*cell as usize / LANES] |= 1 << (*cell as usize % LANES);
        }
        bits
    }
}

/// Moves the numbers of so many leaves to where these are once some are `parted`, and gives both halves those of the
/// whole.
pub(super) fn follow<T: Copy>(of: &mut [T], count: usize, parted: &[u32]) {
    let mut end = count;
    for (before, leaf) in parted.iter().enumerate().rev() {
        let leaf = *leaf as usize;
        of.copy_within(leaf + 1..end, leaf + before + 2);
        let whole = of[leaf];
        of[leaf + before..leaf + before + 2].fill(whole);
        end = leaf;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_fill_the_light_in_order() {
        let mut leaves = Leaves::of(4);
        let mut numbers: Vec<usize> = (0..19).collect();
        let (parted, halved) = leaves.halve(|leaf, _| [0, 5, 15].contains(&leaf).then_some(true));
        follow(&mut numbers, 16, &parted);
        assert_eq!(
            (halved[0].level, &halved[0].cells[..], &halved[0].first[..]),
            (4, &[0, 5, 15][..], &[0, 6, 17][..])
        );
        assert_eq!((&numbers[..9], &numbers[17..]), (&[0, 0, 1, 2, 3, 4, 5, 5, 6][..], &[15, 15][..]));
        let (_, halved) = leaves.halve(|leaf, _| [1, 6, 8].contains(&leaf).then_some(true));
        assert_eq!(
            halved.iter().map(|halved| (halved.level, halved.cells.len())).collect::<Vec<_>>(),
            [(5, 2), (4, 1)]
        );
        assert_eq!(leaves.parts.iter().sum::<f32>(), 1.0);
        assert!((1..leaves.count()).all(|k| leaves.cells[k - 1] < leaves.cells[k]));
        assert_eq!(leaves.parts.len(), 32);
    }
}
