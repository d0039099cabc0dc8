//! The cells of a light that rays ask points in: halves of halves of it, large where nothing happens and small where
//! the edge of a shadow runs. Sixteen that are neighbours, a larger cell of their own, are a block: blocks are halved
//! as a whole, so that all that is told of them is told in lanes.

use crate::light::FineCell;
use crate::math::LANES;

/// How often a block is halved to make its leaves.
const WITHIN: u32 = LANES.ilog2();

/// Sixteen leaves: one larger cell of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LeafBlock {
    /// The number of that cell among all of its size.
    pub cell: u64,
    /// How often the light was halved to make the leaves.
    pub level: u32,
}

impl LeafBlock {
    /// The part of the light that each of its leaves is.
    pub fn part(&self) -> f32 {
        1.0 / (1u64 << self.level) as f32
    }

    /// The place of the block that is nearest to one.
    pub fn nearest(&self, to: FineCell) -> [f64; 2] {
        let level = self.level - WITHIN;
        to.nearest_in(FineCell::first_of(self.cell, level), level).middle()
    }

    fn half(&self, half: u64) -> LeafBlock {
        LeafBlock { cell: 2 * self.cell + half, level: self.level + 1 }
    }
}

/// What is left of a light once blocks were halved: each leaf holds one point of each ray.
#[derive(Debug)]
pub(super) struct Leaves {
    /// The first half of a block takes its place, and the second one goes to the end.
    pub blocks: Vec<LeafBlock>,
    /// Their numbers, in the order of the light.
    pub order: Vec<u32>,
}

/// Blocks of leaves of one size that were halved.
#[derive(Debug)]
pub(super) struct Halved {
    /// That of the leaves before.
    pub level: u32,
    pub blocks: Vec<HalvedBlock>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct HalvedBlock {
    /// The number of its cell among all of its size.
    pub cell: u64,
    /// The numbers of its halves.
    pub halves: [u32; 2],
    /// Whether it was thought to be away from edges.
    pub is_away: bool,
}

impl Leaves {
    /// All cells of one size.
    pub fn of(level: u32) -> Leaves {
        let blocks = (0..1 << (level - WITHIN)).map(|cell| LeafBlock { cell, level });
        let blocks: Vec<_> = blocks.collect();
        Leaves { order: (0..blocks.len() as u32).collect(), blocks }
    }

    /// How many leaves there are.
    pub fn count(&self) -> usize {
        self.blocks.len() * LANES
    }

    /// Halves those blocks of which `is` says whether they are away from edges, by their number. Says which they were,
    /// by their size.
    pub fn halve(&mut self, is: impl Fn(usize, &LeafBlock) -> Option<bool>) -> Vec<Halved> {
        let mut halved = Vec::<Halved>::new();
        let mut order = Vec::with_capacity(self.order.len());
        for number in std::mem::take(&mut self.order) {
            order.push(number);
            let block = self.blocks[number as usize];
            let Some(is_away) = is(number as usize, &block) else { continue };
            let halves = [number, self.blocks.len() as u32];
            order.push(halves[1]);
            self.blocks[number as usize] = block.half(0);
            self.blocks.push(block.half(1));
            let one = HalvedBlock { cell: block.cell, halves, is_away };
            match halved.iter_mut().find(|halved| halved.level == block.level) {
                Some(halved) => halved.blocks.push(one),
                None => halved.push(Halved { level: block.level, blocks: vec![one] }),
            }
        }
        self.order = order;
        halved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_fill_the_light_in_order() {
        let mut leaves = Leaves::of(6);
        let halved = leaves.halve(|number, _| [0, 3].contains(&number).then_some(true));
        let numbers = |halved: &Halved| halved.blocks.iter().map(|block| block.halves).collect::<Vec<_>>();
        assert_eq!((halved[0].level, numbers(&halved[0])), (6, vec![[0, 4], [3, 5]]));
        assert_eq!(leaves.order, [0, 4, 1, 2, 3, 5]);
        let halved = leaves.halve(|number, _| [4, 1].contains(&number).then_some(false));
        let sizes: Vec<_> = halved.iter().map(|halved| (halved.level, numbers(halved))).collect();
        assert_eq!(sizes, [(7, vec![[4, 6]]), (6, vec![[1, 7]])]);
        let ordered = || leaves.order.iter().map(|number| leaves.blocks[*number as usize]);
        assert_eq!(ordered().map(|block| block.part()).sum::<f32>() * LANES as f32, 1.0);
        let first = ordered().map(|block| FineCell::first_of(block.cell, block.level - WITHIN));
        assert!(first.clone().zip(first.skip(1)).all(|(one, other)| one < other));
    }
}
