//! How far off pooled samples may be, and where on the light more of them would help.
//!
//! Samples are judged by groups of neighbours on the light: those of all receivers in one stratum, or in as many strata
//! as make sixteen. A silhouette runs through a group if some of its samples are hidden and some are lit; then the
//! group is off by chance, each by itself. Where there is no silhouette, what samples send may still vary within their
//! strata, next to a light or in a highlight.

use std::ops::AddAssign;

use fearless_simd::{Level, prelude::*};

use super::light_sampler::SampledReceiver;
use super::strata::{BlockSamples, Strata, StratumSums};
use crate::accel::dispatch_all;
use crate::integrate::TOLERANCE;
use crate::material::MOMENTS;
use crate::math::{LANES, only, sum_of_runs, total};

/// A block is near a silhouette if one runs through so many groups around it.
const AROUND: usize = 4;
/// A root of the least number in single precision.
const LEAST: f64 = 1e-19;

/// A number for each moment.
type OfMoments = [f32; MOMENTS];

/// What the samples of all receivers are off by.
#[derive(Clone, Debug, Default)]
pub(super) struct VarianceEstimate {
    /// Which blocks of strata are near silhouettes, by their numbers.
    pub near: Vec<bool>,
    /// Standard deviations of what arrives, as parts of the unoccluded integral: by silhouettes, which smaller strata
    /// near them lessen, and by what varies everywhere.
    pub edges: OfMoments,
    pub smooth: OfMoments,
}

/// Squares of what groups of samples send, in a block or more.
#[derive(Clone, Copy, Debug, Default)]
struct GroupSums {
    /// The strata in which any receiver has a sample that is lit, and one that is hidden, as bits.
    seen: [u16; 2],
    /// Over groups with a silhouette, of all receivers and of one each: sums of squares, and of squares of these.
    together: [OfMoments; 2],
    alone: [OfMoments; 2],
    /// What varies in groups that are hidden, lit, and neither.
    smooth: [OfMoments; 3],
}

impl VarianceEstimate {
    /// `sent` is about the unoccluded integral over all receivers, the unit of the sums, so that their squares do not
    /// underflow. `found` is the part of the unoccluded integral that samples find, if that has a closed form.
    pub fn new(
        level: Level,
        strata: &Strata,
        receivers: &[SampledReceiver],
        sent: OfMoments,
        found: Option<OfMoments>,
    ) -> Self {
        let unit = sent.map(|sent| if sent > 0.0 { 1.0 / sent } else { 0.0 });
        let width = (LANES / receivers.len().clamp(1, LANES)).next_power_of_two();
        let mut sums = GroupSums::default();
        let mut seen = Vec::with_capacity(strata.order.len());
        dispatch_all!(level, simd => {
            for number in &strata.order {
                let part = strata.blocks[*number as usize].part();
                let block = GroupSums::of(simd, strata.samples(*number as usize), unit.map(|unit| unit * part), width);
                sums += &block;
                seen.push(block.seen);
            }
        });
        let [sent, lit] = StratumSums::pooled(receivers);
        let per_group =
            squared(TOLERANCE.silhouette_groups * of_edge((width * receivers.len()) as f64) / of_edge(LANES as f64));
        let (mut edges, mut smooth) = (OfMoments::default(), OfMoments::default());
        for k in (0..MOMENTS).filter(|k| sent[*k] > LEAST && unit[*k] > 0.0) {
            let per_sent = 1.0 / (sent[k] as f32 * unit[k]);
            let visible = (lit[k] / sent[k]) as f32;
            // Receivers with other silhouettes are off by chance, each by itself; those with the same are off together
            let alone = squared(TOLERANCE.silhouette_groups) * variance(sums.alone, k);
            let together = per_group * variance(sums.together, k);
            edges[k] = if receivers.len() == 1 { alone } else { alone.min(together) }.sqrt() * per_sent;
            let [hidden, lit, mixed] = [0, 1, 2].map(|which: usize| sums.smooth[which][k]);
            let varies = |hidden: f32, lit: f32| TOLERANCE.smooth_groups * (hidden + lit).sqrt() * per_sent;
            smooth[k] = match found {
                None => varies(mixed, lit),
                // Where the unoccluded integral is known, only its visible fraction can be wrong. Samples that do not
                // find what is sent do not find which part of it arrives
                Some(found) => varies(hidden * squared(visible), lit * squared(1.0 - visible))
                    .max(2.0 * visible * (1.0 - visible) * (found[k] - 1.0).abs()),
            };
        }
        let mut near = vec![false; strata.order.len()];
        for (number, is_near) in strata.order.iter().zip(around(&seen, width * AROUND)) {
            near[*number as usize] = is_near;
        }
        VarianceEstimate { near, edges, smooth }
    }
}

impl GroupSums {
    /// Of all receivers' samples in a block, groups of which are so many strata wide.
    #[inline(always)]
    fn of<S: Simd>(simd: S, samples: &[BlockSamples], unit: OfMoments, width: usize) -> GroupSums {
        let zero = simd.splat_f32x16(0.0);
        let mut sums = GroupSums::default();
        let (mut lit, mut hidden) = (0u16, 0u16);
        let mut moments = [[zero; 2]; MOMENTS];
        let kinds = || (0..MOMENTS).filter(|k| unit[*k] > 0.0);
        for one in samples {
            (lit, hidden) = (lit | one.lit(), hidden | one.hidden);
            let is_mixed = one.hidden != 0 && one.hidden != one.sends;
            let sent = one.lanes(simd);
            for k in kinds() {
                let sent = sent[k] * unit[k];
                moments[k][0] += sent;
                moments[k][1] += sent * sent;
                if is_mixed {
                    let square = squared(total(sent));
                    sums.alone[0][k] += square;
                    sums.alone[1][k] += squared(square);
                }
            }
        }
        sums.seen = [lit, hidden];
        if lit | hidden == 0 {
            return sums;
        }
        let [lit, hidden] = [spread(lit, width), spread(hidden, width)];
        let (per_group, count) = (1.0 / width as f32, 1.0 / (width * samples.len()) as f32);
        for k in kinds() {
            let [sum, square] = moments[k].map(|moment| sum_of_runs(simd, moment, width));
            // One receiver has groups of its own
            if lit & hidden != 0 && samples.len() > 1 {
                let square = only(simd, lit & hidden, sum * sum);
                sums.together[0][k] = total(square) * per_group;
                sums.together[1][k] = total(square * square) * per_group;
            }
            // n samples of what is smooth stand for parts that are narrower by a root of n, so that their sum is off by
            // as much as one of them is off their mean
            let varies = ((square - sum * sum * count) * count).max(zero);
            for (which, groups) in [hidden & !lit, lit & !hidden, lit & hidden].into_iter().enumerate() {
                if groups != 0 {
                    sums.smooth[which][k] = total(only(simd, groups, varies)) * per_group;
                }
            }
        }
        sums
    }
}

impl AddAssign<&GroupSums> for GroupSums {
    fn add_assign(&mut self, other: &GroupSums) {
        let add = |sums: &mut [OfMoments], other: &[OfMoments]| {
            sums.as_flattened_mut().iter_mut().zip(other.as_flattened()).for_each(|(sum, other)| *sum += other);
        };
        add(&mut self.together, &other.together);
        add(&mut self.alone, &other.alone);
        add(&mut self.smooth, &other.smooth);
    }
}

/// A sum of squares, and what it may be off by: `TOLERANCE.few_groups` over a root of the effective number of them.
fn variance([squares, of_squares]: [OfMoments; 2], moment: usize) -> f32 {
    squares[moment] + TOLERANCE.few_groups * of_squares[moment].sqrt()
}

fn squared(v: f32) -> f32 {
    v * v
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

/// Which blocks have strata in runs in which something is hidden, and something is lit.
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

/// How the error of n stratified points at an edge falls with their number: the edge runs through a root of as many
/// strata.
fn of_edge(points: f64) -> f32 {
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
