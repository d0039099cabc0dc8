//! The strata of a light, and the samples that receivers have in them.
//!
//! A stratum is a cell of the light's parameter square; each receiver has one sample in it. Strata are halved near
//! silhouettes and where the light sends most: one half keeps the sample, and the other takes a new one. A stratum
//! weighs as much as the part of the light that it is. Sixteen strata that are neighbours, a larger cell of their own,
//! are a block, which is halved as a whole, so that its samples lie in lanes.
//!
//! Sums are made of what samples would send, and of what of it arrives: the unoccluded integral is known apart, so that
//! samples estimate the visible fraction only.
//!
//! Sources: of ratio estimates, Cochran, "Sampling Techniques", 1977, chapter 6; Heitz, Hill, McGuire, "Combining
//! analytic direct illumination and stochastic shadows", 2018; of the effective sample size, Kish 1965.

use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::light_sampler::{LightSampler, ReceiverLanes, SampledReceiver};
use crate::accel::dispatch_all;
use crate::color::Rgb;
use crate::integrate::TOLERANCE;
use crate::light::{FineCell, with_gaps};
use crate::material::{MOMENTS, Moments, PerMoment};
use crate::math::{LANES, only, total};
use crate::render::Counts;

/// The samples of all receivers up to which all strata are of one size.
pub(super) const MOST_UNIFORM: usize = 1 << 12;
/// The most samples of all receivers of a pixel.
pub(super) const MOST: usize = 1 << 16;
/// How often the light is halved to make its smallest strata.
const DEEPEST: u32 = 44;
/// How often a block is halved to make its strata.
const WITHIN: u32 = LANES.ilog2();
/// Blocks whose sums are added up in single precision.
const RUN: usize = 1 << 8;

/// Sixteen strata.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct StratumBlock {
    /// The number of the cell that they fill among all of its size.
    cell: u64,
    /// How often the light was halved to make the strata.
    level: u32,
}

impl StratumBlock {
    /// The part of the light that each stratum is.
    pub fn part(&self) -> f32 {
        1.0 / (1u64 << self.level) as f32
    }

    /// The place in it that is nearest to another.
    fn nearest(&self, to: FineCell) -> [f64; 2] {
        let level = self.level - WITHIN;
        to.nearest_in(FineCell::first_of(self.cell, level), level).middle()
    }
}

/// A block that was halved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct SplitBlock {
    before: StratumBlock,
    /// The numbers of its halves.
    halves: [u32; 2],
    /// Whether no silhouette was found near it.
    is_away: bool,
}

/// The samples of one receiver in the strata of a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockSamples {
    /// Where they are.
    pub at: [FineCell; LANES],
    /// What each would send for all of the light.
    pub sent: [[f32; LANES]; MOMENTS],
    /// Which would send anything, and which of these are hidden, as bits.
    pub sends: u16,
    pub hidden: u16,
}

/// Sums over the samples of one receiver, each weighed with the part of the light that its stratum is.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StratumSums {
    /// Sums over the samples, moment by moment: of the unoccluded contributions, of the visible ones, and of the
    /// squares of the unoccluded ones.
    pub sent: [f64; MOMENTS],
    lit: [f64; MOMENTS],
    squares: [f64; MOMENTS],
    /// Parts of the light: what would send anything, and what of it is hidden.
    pub sending: f64,
    pub hidden: f64,
}

impl StratumSums {
    /// What arrives of the unoccluded integral; `fractions` are visible where no sample sends anything.
    pub fn arriving(&self, unoccluded: &Moments, fractions: &[f32; MOMENTS]) -> Moments {
        let visible = |k: usize| if self.sent[k] > 0.0 { (self.lit[k] / self.sent[k]) as f32 } else { fractions[k] };
        PerMoment(std::array::from_fn(|k| unoccluded.0[k] * visible(k)))
    }

    /// The effective sample size, moment by moment.
    pub fn effective(&self) -> [f64; MOMENTS] {
        std::array::from_fn(|k| if self.squares[k] > 0.0 { self.sent[k] * self.sent[k] / self.squares[k] } else { 0.0 })
    }

    /// Of all receivers: what would be sent, and what of it arrives.
    pub fn pooled(receivers: &[SampledReceiver]) -> [[f64; MOMENTS]; 2] {
        receivers.iter().fold([[0.0; MOMENTS]; 2], |[sent, lit], SampledReceiver { sums, .. }| {
            [std::array::from_fn(|k| sent[k] + sums.sent[k]), std::array::from_fn(|k| lit[k] + sums.lit[k])]
        })
    }
}

/// The strata of a light, and the samples of some receivers.
pub(super) struct Strata<'a> {
    pub sampler: LightSampler<'a>,
    receivers: usize,
    /// The first half of a block takes its place, and the second one goes to the end.
    pub blocks: Vec<StratumBlock>,
    /// Their numbers, in the order of the light.
    pub order: Vec<u32>,
    /// Block by block, receiver by receiver.
    samples: Vec<BlockSamples>,
    /// In the same order, the part of each sample that arrives; empty where no layer dims any.
    left: Vec<[f32; LANES]>,
    /// How often the light was halved to make each stratum, at least.
    level: u32,
    /// Whether all strata were halved once, so that it is known what the first samples overlooked.
    pub is_halved: bool,
    /// What new samples in blocks away from silhouettes would send that contradict those that the blocks held.
    pub surprises: [f64; MOMENTS],
}

impl<'a> Strata<'a> {
    /// So many of one size, each with a sample of each receiver.
    pub fn new(
        sampler: LightSampler<'a>,
        count: usize,
        receivers: &mut [SampledReceiver],
        counts: &mut Counts,
    ) -> Self {
        let level = count.ilog2();
        let blocks: Vec<_> = (0..(count / LANES) as u64).map(|cell| StratumBlock { cell, level }).collect();
        let order = (0..blocks.len() as u32).collect();
        let sets: Vec<_> = receivers.iter().map(|receiver| sampler.first(receiver.series, count)).collect();
        sampler.occlude(&sets, &vec![u16::MAX; blocks.len()], receivers, counts);
        let mut samples = vec![BlockSamples::NONE; blocks.len() * receivers.len()];
        let is_dimmed = receivers.iter().any(|receiver| receiver.view.layers);
        let mut left = vec![[0.0; LANES]; if is_dimmed { samples.len() } else { 0 }];
        dispatch_all!(sampler.level, simd => {
            for (k, (receiver, set)) in receivers.iter().zip(&sets).enumerate() {
                let lanes = ReceiverLanes::new(simd, &sampler, receiver);
                for block in 0..blocks.len() {
                    let number = block * receivers.len() + k;
                    samples[number] = lanes.sample(simd, set, block);
                    if is_dimmed {
                        left[number] = lanes.dim(&mut samples[number], block, &receiver.view.left);
                    }
                }
            }
        });
        let (receivers, surprises) = (receivers.len(), [0.0; MOMENTS]);
        Strata { sampler, receivers, blocks, order, samples, left, level, is_halved: false, surprises }
    }

    /// The samples of all receivers together.
    pub fn count(&self) -> usize {
        self.blocks.len() * LANES * self.receivers
    }

    /// Whether all strata are of one size.
    pub fn is_uniform(&self) -> bool {
        self.blocks.len() * LANES == 1 << self.level
    }

    /// The samples of all receivers in a block.
    pub fn samples(&self, block: usize) -> &[BlockSamples] {
        &self.samples[block * self.receivers..][..self.receivers]
    }

    /// The samples of one receiver, block by block.
    fn of_receiver(&self, receiver: usize) -> impl Iterator<Item = &BlockSamples> {
        self.samples[receiver..].iter().step_by(self.receivers)
    }

    /// Sums up the samples of a receiver.
    pub fn sums(&self, receiver: usize) -> StratumSums {
        let mut sums = StratumSums::default();
        dispatch_all!(self.sampler.level, simd => {
            let mut samples = self.of_receiver(receiver);
            let mut left = self.left.get(receiver..).unwrap_or_default().iter().step_by(self.receivers);
            for blocks in self.blocks.chunks(RUN) {
                let mut lanes = [[simd.splat_f32x16(0.0); 3]; MOMENTS];
                for (block, samples) in blocks.iter().zip(&mut samples) {
                    let part = block.part();
                    sums.sending += f64::from(samples.sends.count_ones()) * f64::from(part);
                    let left = left.next();
                    let hidden = match left {
                        None => f64::from(samples.hidden.count_ones()),
                        Some(left) => samples.dimmed(left),
                    };
                    sums.hidden += hidden * f64::from(part);
                    for (lanes, sent) in lanes.iter_mut().zip(samples.lanes(simd)) {
                        let sent = sent * part;
                        lanes[0] += sent;
                        lanes[1] += match left {
                            None => only(simd, samples.lit(), sent),
                            Some(left) => sent * f32x16::load_array_ref(simd, left),
                        };
                        lanes[2] += sent * sent;
                    }
                }
                for (k, lanes) in lanes.iter().enumerate() {
                    let add_up = |sum: f32x16<_>| sum.as_slice().iter().map(|v| f64::from(*v)).sum::<f64>();
                    let [sent, lit, squares] = lanes.map(add_up);
                    sums.sent[k] += sent;
                    sums.lit[k] += lit;
                    sums.squares[k] += squares;
                }
            }
        });
        sums
    }

    /// Halves the strata of some blocks: those `near` silhouettes and, where `is_raised`, the largest, before which
    /// come those that send most, once there are many or `is_sure` is not met. Returns whether any were halved.
    pub fn refine(
        &mut self,
        near: &[bool],
        is_raised: bool,
        is_sure: bool,
        receivers: &mut [SampledReceiver],
        counts: &mut Counts,
    ) -> bool {
        // Many samples gain more than well placed ones as long as their sets are kept
        let is_cheap = self.is_uniform() && LightSampler::keeps(self.level) && self.count() < MOST_UNIFORM;
        if is_raised && !(is_cheap && is_sure) && self.split_heavy(receivers, counts) {
            return true;
        }
        if is_raised {
            // Where what is sent most has made all strata smaller than that, the largest there are
            let largest = self.blocks.iter().map(|block| block.level).min().unwrap_or(0);
            self.level = self.level.max(largest) + 1;
            self.is_halved = true;
            self.surprises = Default::default();
        }
        let level = self.level;
        let halves = self.split(receivers, counts, |number, block| {
            let is_wanted = near[number] && block.level < DEEPEST || block.level < level;
            is_wanted.then_some(!near[number])
        });
        !halves.is_empty()
    }

    /// Halves blocks, and their halves, while a stratum may send `TOLERANCE.heavy` times the mean of equal ones to all
    /// receivers. That is not judged by the samples in it: to sample more where samples found much, and not where they
    /// found little, makes the mean too low. Returns whether any were halved.
    fn split_heavy(&mut self, receivers: &mut [SampledReceiver], counts: &mut Counts) -> bool {
        let peaks: Vec<Peak> = receivers.iter().enumerate().map(|(k, receiver)| self.peak(k, receiver)).collect();
        let all: f32 = peaks.iter().map(|peak| peak.all).sum();
        let heavy = TOLERANCE.heavy * all / (1u32 << self.level) as f32;
        let every: Vec<u32> = (0..self.blocks.len() as u32).collect();
        let mut sent = self.sent_at_most(&peaks, receivers, &every);
        let mut is_any = false;
        while self.count() < MOST {
            let halves = self.split(receivers, counts, |number, block| {
                (sent[number] > heavy && block.level < DEEPEST).then_some(false)
            });
            if halves.is_empty() {
                break;
            }
            is_any = true;
            sent.resize(self.blocks.len(), 0.0);
            for (number, new) in halves.iter().zip(self.sent_at_most(&peaks, receivers, &halves)) {
                sent[*number as usize] = new;
            }
        }
        is_any
    }

    /// What a stratum of each of some blocks sends to all receivers, at the places nearest to their peaks.
    fn sent_at_most(&self, peaks: &[Peak], receivers: &[SampledReceiver], blocks: &[u32]) -> Vec<f32> {
        let mut most = vec![0.0; blocks.len()];
        for (peak, receiver) in peaks.iter().zip(receivers) {
            let places = blocks.chunks(LANES).map(|blocks| {
                let [mut x, mut y] = [[f64::NAN; LANES]; 2];
                for (lane, number) in blocks.iter().enumerate() {
                    [x[lane], y[lane]] = self.blocks[*number as usize].nearest(peak.at);
                }
                [x, y]
            });
            let sent = self.sampler.unoccluded_at(receiver, places);
            for ((most, number), sent) in most.iter_mut().zip(blocks).zip(&sent) {
                *most += peak.weigh(sent) * self.blocks[*number as usize].part();
            }
        }
        most
    }

    /// The place from which a receiver is sent most.
    fn peak(&self, number: usize, receiver: &SampledReceiver) -> Peak {
        let weights = receiver.colors().0.map(|Rgb { r, g, b }| r.max(g).max(b));
        let measure = self.sampler.measure();
        let mut peak = Peak { at: self.most_sent(number, &weights), weights, all: 0.0 };
        peak.all = peak.weigh(&receiver.unoccluded(measure)) / measure;
        if receiver.sums.sending == 0.0 && peak.all > 0.0 {
            // No sample is above the horizon of a receiver that is close to the light
            let near = self.sampler.near(receiver);
            let sent = self.sampler.unoccluded_at(receiver, std::iter::once(FineCell::middles(&near)));
            let mut most = 0.0;
            for (at, sent) in near.into_iter().zip(&sent) {
                let sent = peak.weigh(sent);
                if sent > most {
                    (most, peak.at) = (sent, at);
                }
            }
        }
        peak
    }

    /// The place of the sample that sends most to a receiver.
    fn most_sent(&self, receiver: usize, weights: &[f32; MOMENTS]) -> FineCell {
        let [mut most, mut of] = [[0.0f32; LANES], [0.0f32; LANES]];
        dispatch_all!(self.sampler.level, simd => {
            let [mut largest, mut number] = [simd.splat_f32x16(-1.0), simd.splat_f32x16(0.0)];
            for (k, samples) in self.of_receiver(receiver).enumerate() {
                let sent = samples.lanes(simd).into_iter().zip(weights);
                let sent = sent.fold(simd.splat_f32x16(0.0), |sum, (sent, weight)| sum + sent * *weight);
                let is_more = sent.simd_gt(largest);
                largest = is_more.select(sent, largest);
                number = is_more.select(simd.splat_f32x16(k as f32), number);
            }
            largest.store_slice(&mut most);
            number.store_slice(&mut of);
        });
        let lane = (0..LANES).max_by(|one, other| most[*one].total_cmp(&most[*other])).unwrap_or_default();
        self.samples(of[lane] as usize)[receiver].at[lane]
    }

    /// Halves those blocks for which `choose` says whether they are away from silhouettes, and takes a new sample of
    /// each receiver in each stratum. Returns the numbers of the halves.
    fn split(
        &mut self,
        receivers: &mut [SampledReceiver],
        counts: &mut Counts,
        choose: impl Fn(usize, &StratumBlock) -> Option<bool>,
    ) -> Vec<u32> {
        let mut splits = split_blocks(&mut self.blocks, &mut self.order, choose);
        let halves = splits.iter().flat_map(|split| split.halves).collect();
        self.samples.resize(self.blocks.len() * self.receivers, BlockSamples::NONE);
        let is_dimmed = !self.left.is_empty();
        if is_dimmed {
            self.left.resize(self.samples.len(), [0.0; LANES]);
        }
        splits.sort_by_key(|split| split.before.level);
        for splits in splits.chunk_by(|one, other| one.before.level == other.before.level) {
            let level = splits[0].before.level;
            let second = |(receiver, one): (usize, &SampledReceiver)| {
                let at = splits.iter().map(|split| &self.samples(split.halves[0] as usize)[receiver].at);
                self.sampler.second(one.series, level, at)
            };
            let sets: Vec<_> = receivers.iter().enumerate().map(second).collect();
            // A set holds these blocks only, or all of their size
            let count = sets[0].cells.len();
            let in_set = |k: usize| if count == splits.len() { k } else { splits[k].before.cell as usize };
            let mut wanted = vec![0; count];
            (0..splits.len()).for_each(|k| wanted[in_set(k)] = u16::MAX);
            self.sampler.occlude(&sets, &wanted, receivers, counts);
            dispatch_all!(self.sampler.level, simd => {
                for (receiver, set) in sets.iter().enumerate() {
                    let lanes = ReceiverLanes::new(simd, &self.sampler, &receivers[receiver]);
                    let mut surprises = [simd.splat_f32x16(0.0); MOMENTS];
                    for (k, split) in splits.iter().enumerate() {
                        let mut new = lanes.sample(simd, set, in_set(k));
                        let numbers = split.halves.map(|half| half as usize * self.receivers + receiver);
                        if is_dimmed {
                            let left = lanes.dim(&mut new, in_set(k), &receivers[receiver].view.left);
                            let halves = BlockSamples::halves_of_left(&new, &self.left[numbers[0]], &left, level);
                            [self.left[numbers[0]], self.left[numbers[1]]] = halves;
                        }
                        let old = self.samples[numbers[0]];
                        if split.is_away {
                            let is_surprise = !(new.sends ^ old.sends) & (new.hidden ^ old.hidden);
                            for (sum, sent) in surprises.iter_mut().zip(new.lanes(simd)) {
                                *sum += only(simd, is_surprise, sent);
                            }
                        }
                        let halves = BlockSamples::halves(simd, &old, &new, level);
                        [self.samples[numbers[0]], self.samples[numbers[1]]] = halves;
                    }
                    for (sum, new) in self.surprises.iter_mut().zip(surprises) {
                        *sum += f64::from(total(new) * (splits[0].before.part() * 0.5));
                    }
                }
            });
        }
        halves
    }
}

/// Halves those blocks for which `choose` says whether they are away from silhouettes.
fn split_blocks(
    blocks: &mut Vec<StratumBlock>,
    order: &mut Vec<u32>,
    choose: impl Fn(usize, &StratumBlock) -> Option<bool>,
) -> Vec<SplitBlock> {
    let mut splits = Vec::new();
    for number in std::mem::take(order) {
        order.push(number);
        let before = blocks[number as usize];
        if let Some(is_away) = choose(number as usize, &before) {
            let halves = [number, blocks.len() as u32];
            order.push(halves[1]);
            let half = |half: u64| StratumBlock { cell: 2 * before.cell + half, level: before.level + 1 };
            blocks[number as usize] = half(0);
            blocks.push(half(1));
            splits.push(SplitBlock { before, halves, is_away });
        }
    }
    splits
}

/// Where a light sends most to a receiver.
struct Peak {
    at: FineCell,
    /// What a unit of each moment adds to the brightest channel.
    weights: [f32; MOMENTS],
    /// What the light sends to the receiver.
    all: f32,
}

impl Peak {
    fn weigh(&self, sent: &Moments) -> f32 {
        sent.0.iter().zip(&self.weights).map(|(sent, weight)| sent * weight).sum()
    }
}

impl BlockSamples {
    pub const NONE: BlockSamples =
        BlockSamples { at: [FineCell::FIRST; LANES], sent: [[0.0; LANES]; MOMENTS], sends: 0, hidden: 0 };

    /// Those that send, and are not hidden.
    pub fn lit(&self) -> u16 {
        self.sends & !self.hidden
    }

    /// How many that send are hidden, those that layers dim in part.
    fn dimmed(&self, left: &[f32; LANES]) -> f64 {
        let sending = (0..LANES).filter(|lane| self.sends >> lane & 1 == 1);
        sending.map(|lane| 1.0 - f64::from(left[lane])).sum()
    }

    /// The parts that arrive of the samples in both halves of each stratum; see [`halves`](Self::halves).
    fn halves_of_left(new: &BlockSamples, old: &[f32; LANES], left: &[f32; LANES], level: u32) -> [[f32; LANES]; 2] {
        let mut halves = [[0.0; LANES]; 2];
        for (stratum, (old, left)) in old.iter().zip(left).enumerate() {
            let pair = if new.at[stratum].half(level) == 1 { [*old, *left] } else { [*left, *old] };
            halves[2 * stratum / LANES][2 * stratum % LANES..][..2].copy_from_slice(&pair);
        }
        halves
    }

    /// What each would send for all of the light.
    #[inline(always)]
    pub fn lanes<S: Simd>(&self, simd: S) -> [f32x16<S>; MOMENTS] {
        std::array::from_fn(|k| f32x16::from_slice(simd, &self.sent[k]))
    }

    /// The same of one of them.
    pub fn moments(&self, lane: usize) -> Moments {
        PerMoment(std::array::from_fn(|k| self.sent[k][lane]))
    }

    /// The samples in both halves of each stratum, one old and one new, of strata of such a level.
    #[inline(always)]
    fn halves<S: Simd>(simd: S, old: &BlockSamples, new: &BlockSamples, level: u32) -> [BlockSamples; 2] {
        let mut halves = [BlockSamples::NONE; 2];
        // The strata in whose second half the new sample is
        let mut second = 0u16;
        for (stratum, (old, new)) in old.at.iter().zip(&new.at).enumerate() {
            let is_second = new.half(level) == 1;
            second |= u16::from(is_second) << stratum;
            let pair = if is_second { [*old, *new] } else { [*new, *old] };
            halves[2 * stratum / LANES].at[2 * stratum % LANES..][..2].copy_from_slice(&pair);
        }
        let is_second = mask32x16::from_bitmask(simd, second.into());
        for (k, (old, new)) in old.lanes(simd).into_iter().zip(new.lanes(simd)).enumerate() {
            let (low, high) = simd.interleave_f32x16(is_second.select(old, new), is_second.select(new, old));
            low.store_slice(&mut halves[0].sent[k]);
            high.store_slice(&mut halves[1].sent[k]);
        }
        let sends = [to_halves(new.sends, second), to_halves(old.sends, !second)];
        let hidden = [to_halves(new.hidden, second), to_halves(old.hidden, !second)];
        for (k, half) in halves.iter_mut().enumerate() {
            (half.sends, half.hidden) = (sends[0][k] | sends[1][k], hidden[0][k] | hidden[1][k]);
        }
        halves
    }
}

/// Bits of the strata of a block as those of their halves, two blocks: of each stratum the first or, where `second`
/// says so, the second.
fn to_halves(bits: u16, second: u16) -> [u16; 2] {
    let halves = with_gaps((bits & !second).into()) | with_gaps((bits & second).into()) << 1;
    [halves as u16, (halves >> LANES) as u16]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strata_fill_the_light_in_order() {
        let mut blocks: Vec<_> = (0..4).map(|cell| StratumBlock { cell, level: 6 }).collect();
        let mut order = vec![0, 1, 2, 3];
        let splits = split_blocks(&mut blocks, &mut order, |number, _| [0, 3].contains(&number).then_some(true));
        let halves = |splits: &[SplitBlock]| splits.iter().map(|split| split.halves).collect::<Vec<_>>();
        assert_eq!(halves(&splits), [[0, 4], [3, 5]]);
        assert_eq!(order, [0, 4, 1, 2, 3, 5]);
        let splits = split_blocks(&mut blocks, &mut order, |number, _| [4, 1].contains(&number).then_some(false));
        assert_eq!(halves(&splits), [[4, 6], [1, 7]]);
        let ordered = || order.iter().map(|number| blocks[*number as usize]);
        assert_eq!(ordered().map(|block| block.part()).sum::<f32>() * LANES as f32, 1.0);
        let first: Vec<_> = ordered().map(|block| FineCell::first_of(block.cell, block.level - WITHIN)).collect();
        assert!(first.is_sorted());
    }

    #[test]
    fn bits_of_strata_become_those_of_halves() {
        assert_eq!(to_halves(0b1011, 0b0010), [0b0100_1001, 0]);
        assert_eq!(to_halves(0x8001, 0x8000), [1, 0x8000]);
        let [first, second] = [0, u16::MAX].map(|second| to_halves(u16::MAX, second));
        assert_eq!((first, second), ([0x5555; 2], [0xaaaa; 2]));
    }
}
