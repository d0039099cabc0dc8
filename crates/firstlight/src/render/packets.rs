//! How far off what points of a light say may be, and where on the light more of them would help.
//!
//! Points are judged by packets of them that are neighbours on the light: those of all rays in one of its leaves, or in
//! as many as make sixteen. An edge of a shadow runs through a packet if some of its points are hidden and some are
//! not; then what it sends is wrong by chance, each packet by itself. Where no edge is, what its points send may still
//! vary more than they tell, next to a light or in a highlight.

use fearless_simd::{Level, mask32x16, prelude::*};

use super::leaves::Leaves;
use super::tally::Tally;
use crate::accel::dispatch_all;
use crate::material::{MOMENTS, Moments};
use crate::math::{LANES, only, sum_of_runs, total};

/// The deviation of the share that a packet of sixteen sees which some edge runs through: of sixteen points in as many
/// parts of a cell of the light the edge cuts about four, each of which it parts anywhere.
const MIXED: f32 = 0.07;
/// The same where there is one ray only, whose points lie in parts of their own.
const ALONE: f32 = 0.05;
/// The deviation of the share that n stratified points find behind an edge, times n^3/4.
const EDGE: f32 = 0.46;
/// How many times that of a packet is where its points do not lie in different parts of a cell; and what is counted of
/// it for few rays, the errors of which are made good by few others.
const APART: f32 = 3.5;
/// How many times what varies smoothly counts: points of neighbours are wrong alike.
const ALIKE: f32 = 2.0;
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

impl PacketErrors {
    /// Of rays that asked points in the same leaves of a light of such a `measure`. `sent` is what would arrive if
    /// nothing were in the way.
    pub fn of(level: Level, tallies: &[&Tally], leaves: &Leaves, measure: f32, sent: &Moments) -> PacketErrors {
        dispatch_all!(level, simd => PacketErrors::of_lanes(simd, tallies, leaves, measure, sent))
    }

    #[inline(always)]
    fn of_lanes<S: Simd>(simd: S, tallies: &[&Tally], leaves: &Leaves, measure: f32, sent: &Moments) -> PacketErrors {
        let rays = tallies.len();
        let per_packet = (LANES / rays.clamp(1, LANES)).next_power_of_two();
        let all = sum_of(tallies, |tally| tally.all);
        let lit = sum_of(tallies, |tally| tally.lit);
        // As parts of all that is sent; of what is as good as nothing, squares are nothing
        let one: OfKind = all.map(|all| if all > LEAST { (1.0 / all) as f32 } else { 0.0 });
        let share: OfKind = std::array::from_fn(|k| lit[k] as f32 * one[k]);
        // What is sent is parted wrong only, that which is lit and that which is hidden
        let weighs = [share.map(|share| 1.0 - share), share];
        let count = (per_packet * rays) as f32;
        let zero = simd.splat_f32x16(0.0);
        let mut seen = Vec::with_capacity(leaves.order.len());
        // Squares of what is sent: by mixed packets of all rays, and of one ray each; and of what varies in the others
        let (mut together, mut alone, mut smooth) = (OfKind::default(), OfKind::default(), OfKind::default());
        for number in &leaves.order {
            let part = leaves.blocks[*number as usize].part();
            let (mut lit, mut hidden) = (0u16, 0u16);
            let mut moments = [[zero; 2]; MOMENTS];
            for tally in tallies {
                let block = tally.block(*number as usize);
                (lit, hidden) = (lit | block.lit(), hidden | block.hides);
                let is_mixed = block.hides != 0 && block.hides != block.sends;
                for (k, sent) in block.lanes(simd).into_iter().enumerate() {
                    let sent = sent * (part * one[k]);
                    moments[k][0] += sent;
                    moments[k][1] += sent * sent;
                    if is_mixed {
                        alone[k] += squared(total(sent));
                    }
                }
            }
            seen.push([lit, hidden]);
            if lit | hidden == 0 {
                continue;
            }
            let is_mixed = spread(lit, per_packet) & spread(hidden, per_packet);
            let is_lit = mask32x16::from_bitmask(simd, spread(lit, per_packet).into());
            for k in 0..MOMENTS {
                let [sum, square] = moments[k].map(|moment| sum_of_runs(simd, moment, per_packet));
                together[k] += total(only(simd, is_mixed, sum * sum)) / per_packet as f32;
                // Points vary smoothly: n of them stand for parts that are narrower by a root of n, so that their sum
                // is wrong by as much as one of them is off their mean
                let square = (square - sum * sum * (1.0 / count)) * (1.0 / count);
                let [lit, hidden] = [0, 1].map(|which: usize| simd.splat_f32x16(squared(weighs[which][k])));
                let weight = is_lit.select(lit, hidden);
                smooth[k] += total(only(simd, !is_mixed, square.max(zero) * weight)) / per_packet as f32;
            }
        }
        let apart = squared(apart(tallies) * of_edge(count.into()) / of_edge(LANES as f64));
        // Rays that see other things are wrong by chance, each by itself; those that see the same, together
        let edges = std::array::from_fn(|k| {
            let alone = squared(ALONE) * alone[k];
            if rays == 1 { alone } else { alone.min(squared(MIXED) * apart * together[k]) }.sqrt()
        });
        let mut smooth = smooth.map(|smooth| ALIKE * smooth.sqrt());
        // Points that do not find what is sent do not find which part of it arrives
        for k in (0..MOMENTS).filter(|k| sent.0[*k] > 0.0) {
            let found = all[k] as f32 * measure / sent.0[k];
            smooth[k] = smooth[k].max(2.0 * share[k] * (1.0 - share[k]) * (found - 1.0).abs());
        }
        let mut near = vec![false; leaves.order.len()];
        let around = around(&seen, per_packet * AROUND);
        leaves.order.iter().zip(around).for_each(|(number, is_near)| near[*number as usize] = is_near);
        PacketErrors { near, edges, smooth }
    }
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

/// How much farther off the sum of all rays may be than if all saw the same: rays that see different shares of the
/// light are not stratified together.
fn apart(tallies: &[&Tally]) -> f32 {
    let (mut count, mut sum, mut squares, mut points) = (0.0f32, 0.0, 0.0, 0.0);
    for tally in tallies.iter().filter(|tally| tally.sending > 0.0) {
        let share = (tally.hidden / tally.sending) as f32;
        (count, sum, squares) = (count + 1.0, sum + share, squares + share * share);
        points += tally.effective_sending();
    }
    if count < 2.0 {
        return 1.0;
    }
    let deviation = ((squares - sum * sum / count) / count).max(0.0).sqrt();
    let by_chance = by_chance(points / f64::from(count));
    1.0 + (APART - 1.0) * (0.5 * (deviation / by_chance - 1.0)).clamp(0.0, 1.0)
}

/// The deviation of what so many stratified points say of an edge that runs anywhere.
fn by_chance(points: f64) -> f32 {
    EDGE * of_edge(points)
}

/// How that falls with their number: the edge runs through a root of as many squares.
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
