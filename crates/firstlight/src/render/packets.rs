//! How far off what points of a light say may be, and where on the light more of them would help.
//!
//! Points are judged by packets of them that are neighbours on the light: those of all rays in one of its leaves, or in
//! as many as make sixteen. An edge of a shadow runs through a packet if some of its points are hidden and some are
//! not; then what it sends is wrong by chance, each packet by itself. Where no edge is, what its points send may still
//! vary more than they tell, next to a light or in a highlight.

use std::ops::AddAssign;

use fearless_simd::{Level, prelude::*};

use super::leaves::Leaves;
use super::tally::Tally;
use crate::accel::dispatch_all;
use crate::integrate::TOLERANCE;
use crate::material::MOMENTS;
use crate::math::{LANES, only, sum_of_runs, total};

/// An edge is looked for in so many packets around one that it runs through.
const AROUND: usize = 4;

/// A root of the least number in single precision.
const LEAST: f64 = 1e-19;

/// What the packets of all rays say.
#[derive(Clone, Debug, Default)]
pub(super) struct PacketErrors {
    /// Which blocks of leaves are near edges, by their numbers.
    pub near: Vec<bool>,
    /// The deviations of what arrives, as parts of what would if nothing were in the way: by edges, which more points
    /// in those leaves make less, and by what varies everywhere.
    pub edges: OfKind,
    pub smooth: OfKind,
}

/// Of each kind of light.
type OfKind = [f32; MOMENTS];

/// The packets of rays that ask points in the same leaves of a light, block by block.
#[derive(Debug)]
pub(super) struct Packets {
    /// One over what all rays are sent, thereabouts: of what is as good as nothing, squares are nothing.
    unit: OfKind,
    /// By the number of the block.
    blocks: Vec<BlockSums>,
}

/// What packets of a block make of it: squares of what is sent, in that unit.
#[derive(Clone, Copy, Debug, Default)]
struct BlockSums {
    /// In which leaves any ray finds anything lit, and anything hidden, as bits.
    seen: [u16; 2],
    /// By mixed packets of all rays, and of one ray each; and of what varies in those that are hidden, lit, and mixed.
    together: OfKind,
    alone: OfKind,
    /// The sums of squares of the squares in these.
    together_squared: OfKind,
    alone_squared: OfKind,
    smooth: [OfKind; 3],
}

impl Packets {
    /// Of rays which are sent so much, thereabouts, as points add it up.
    pub fn new(sent: OfKind) -> Packets {
        Packets { unit: sent.map(|sent| if sent > 0.0 { 1.0 / sent } else { 0.0 }), blocks: Vec::new() }
    }

    /// How many neighbouring leaves hold a packet.
    fn width(rays: usize) -> usize {
        (LANES / rays.clamp(1, LANES)).next_power_of_two()
    }

    /// Hears of those blocks that were asked anew, as `is_new` says by their numbers.
    pub fn hear(&mut self, level: Level, tallies: &[&Tally], leaves: &Leaves, is_new: &[bool]) {
        self.blocks.resize(leaves.blocks.len(), BlockSums::default());
        let width = Packets::width(tallies.len());
        dispatch_all!(level, simd => {
            for number in (0..is_new.len()).filter(|number| is_new[*number]) {
                let part = leaves.blocks[number].part();
                self.blocks[number] = BlockSums::of(simd, tallies, number, self.unit.map(|unit| unit * part), width);
            }
        });
    }

    /// What they say by now. `found` is the part of what would arrive that points find, if that is known.
    pub fn errors(&self, tallies: &[&Tally], leaves: &Leaves, found: Option<OfKind>) -> PacketErrors {
        let rays = tallies.len();
        let mut sums = BlockSums::default();
        let mut seen = Vec::with_capacity(leaves.order.len());
        for number in &leaves.order {
            let block = &self.blocks[*number as usize];
            sums += block;
            seen.push(block.seen);
        }
        let [all, lit] = [sum_of(tallies, |tally| tally.all), sum_of(tallies, |tally| tally.lit)];
        let width = Packets::width(rays);
        let per_packet = squared(TOLERANCE.mixed * of_edge((width * rays) as f64) / of_edge(LANES as f64));
        let (mut edges, mut smooth) = (OfKind::default(), OfKind::default());
        for k in (0..MOMENTS).filter(|k| all[*k] > LEAST && self.unit[*k] > 0.0) {
            let per_all = 1.0 / (all[k] as f32 * self.unit[k]);
            // The part of what is sent that arrives
            let share = (lit[k] / all[k]) as f32;
            // Rays that see other things are wrong by chance, each by itself; those that see the same, together
            let alone = squared(TOLERANCE.mixed) * variance(sums.alone[k], sums.alone_squared[k]);
            let together = per_packet * variance(sums.together[k], sums.together_squared[k]);
            edges[k] = if rays == 1 { alone } else { alone.min(together) }.sqrt() * per_all;
            // Where it is known what is sent, that is parted wrong only, what is lit and what is hidden
            let [hidden, lit, mixed] = [0, 1, 2].map(|which: usize| sums.smooth[which][k]);
            let varies = |hidden: f32, lit: f32| TOLERANCE.alike * (hidden + lit).sqrt() * per_all;
            smooth[k] = match found {
                None => varies(mixed, lit),
                // Points that do not find what is sent do not find which part of it arrives
                Some(found) => varies(hidden * squared(share), lit * squared(1.0 - share))
                    .max(2.0 * share * (1.0 - share) * (found[k] - 1.0).abs()),
            };
        }
        let mut near = vec![false; leaves.order.len()];
        for (number, is_near) in leaves.order.iter().zip(around(&seen, width * AROUND)) {
            near[*number as usize] = is_near;
        }
        PacketErrors { near, edges, smooth }
    }
}

impl BlockSums {
    /// Of a block whose leaves are parts of the light that count for so much, with so many in a packet.
    #[inline(always)]
    fn of<S: Simd>(simd: S, tallies: &[&Tally], number: usize, unit: OfKind, width: usize) -> BlockSums {
        let zero = simd.splat_f32x16(0.0);
        let mut sums = BlockSums::default();
        let (mut lit, mut hidden) = (0u16, 0u16);
        let mut moments = [[zero; 2]; MOMENTS];
        let kinds = || (0..MOMENTS).filter(|k| unit[*k] > 0.0);
        for tally in tallies {
            let block = tally.block(number);
            (lit, hidden) = (lit | block.lit(), hidden | block.hides);
            let is_mixed = block.hides != 0 && block.hides != block.sends;
            let sent = block.lanes(simd);
            for k in kinds() {
                let sent = sent[k] * unit[k];
                moments[k][0] += sent;
                moments[k][1] += sent * sent;
                if is_mixed {
                    let square = squared(total(sent));
                    sums.alone[k] += square;
                    sums.alone_squared[k] += squared(square);
                }
            }
        }
        sums.seen = [lit, hidden];
        if lit | hidden == 0 {
            return sums;
        }
        let [lit, hidden] = [spread(lit, width), spread(hidden, width)];
        let (per_packet, count) = (1.0 / width as f32, 1.0 / (width * tallies.len()) as f32);
        for k in kinds() {
            let [sum, square] = moments[k].map(|moment| sum_of_runs(simd, moment, width));
            // One ray has packets of its own
            if lit & hidden != 0 && tallies.len() > 1 {
                let square = only(simd, lit & hidden, sum * sum);
                sums.together[k] = total(square) * per_packet;
                sums.together_squared[k] = total(square * square) * per_packet;
            }
            // Points vary smoothly: n of them stand for parts that are narrower by a root of n, so that their sum is
            // wrong by as much as one of them is off their mean
            let varies = ((square - sum * sum * count) * count).max(zero);
            for (which, packets) in [hidden & !lit, lit & !hidden, lit & hidden].into_iter().enumerate() {
                if packets != 0 {
                    sums.smooth[which][k] = total(only(simd, packets, varies)) * per_packet;
                }
            }
        }
        sums
    }
}

impl AddAssign<&BlockSums> for BlockSums {
    fn add_assign(&mut self, other: &BlockSums) {
        for k in 0..MOMENTS {
            self.together[k] += other.together[k];
            self.alone[k] += other.alone[k];
            self.together_squared[k] += other.together_squared[k];
            self.alone_squared[k] += other.alone_squared[k];
            (0..3).for_each(|which| self.smooth[which][k] += other.smooth[which][k]);
        }
    }
}

/// A sum of squares, and what it may be off by: `TOLERANCE.few_packets` over a root of the effective number of them.
fn variance(squares: f32, of_squares: f32) -> f32 {
    squares + TOLERANCE.few_packets * of_squares.sqrt()
}

fn squared(v: f32) -> f32 {
    v * v
}

fn sum_of(tallies: &[&Tally], of: impl Fn(&Tally) -> [f64; MOMENTS]) -> [f64; MOMENTS] {
    tallies.iter().fold([0.0; MOMENTS], |sum, tally| {
        let of = of(tally);
        std::array::from_fn(|k| sum[k] + of[k])
    })
}

/// For each aligned run of so many bits, a power of two, whether any of them is set: in all of them.
fn spread(bits: u16, run: usize) -> u16 {
    let (mut bits, mut wide) = (bits, 1);
    while wide < run {
        // Each half of a run that is twice as wide has what either has
        let low = u16::MAX / ((1 << wide) + 1);
        bits |= (bits & low) << wide | bits >> wide & low;
        wide *= 2;
    }
    bits
}

/// Which blocks of leaves are near runs in which something is hidden, and something is not.
fn around(seen: &[[u16; 2]], run: usize) -> Vec<bool> {
    let mut near = Vec::with_capacity(seen.len());
    for blocks in seen.chunks(run.div_ceil(LANES)) {
        let is_mixed = match *blocks {
            [[lit, hidden]] => spread(lit, run.min(LANES)) & spread(hidden, run.min(LANES)) != 0,
            _ => {
                let (lit, hidden) = blocks.iter().fold((0, 0), |(a, b), [lit, hidden]| (a | lit, b | hidden));
                lit != 0 && hidden != 0
            }
        };
        near.resize(near.len() + blocks.len(), is_mixed);
    }
    near
}

/// How what n stratified points say of an edge is off falls with their number: it runs through a root of as many
/// squares.
pub(super) fn of_edge(points: f64) -> f32 {
    let root = points.max(1e-9).sqrt();
    (1.0 / (root * root.sqrt())) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_spread_over_their_runs() {
        assert_eq!([1, 2, 4, 8, 16].map(|run| spread(0x0410, run)), [0x0410, 0x0c30, 0x0ff0, 0xffff, 0xffff]);
        assert_eq!(spread(0, 16), 0);
        assert_eq!(around(&[[1, 2], [0x10, 0x20], [1, 0x10], [0, 0]], 4), [true, true, false, false]);
        assert_eq!(around(&[[1, 0], [0, 1], [1, 0], [1, 0]], 32), [true, true, false, false]);
    }
}
