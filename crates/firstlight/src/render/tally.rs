//! What points of an area light say, from one place, leaf by leaf of the light.
//!
//! Each leaf holds what the point in it says; where one was halved without a new point in one of the halves, both hold
//! the same. A leaf counts for the part of the light that it is, so it is enough to ask anew where the edge of a shadow
//! is. What points would send is tallied with and without what is hidden: all that a light would send is known exactly,
//! so the points only say which share of it arrives, a ratio estimate.
//!
//! Sources: of ratio estimates, Cochran, "Sampling Techniques", 1977, chapter 6; of the effective number of points,
//! Kish 1965.

use fearless_simd::{Level, f32x16, mask32x16, prelude::*};

use super::ladder::{Asker, CellBits, Rung, cells_in, to_halves};
use super::lanes::PointObstacles;
use super::leaves::{Halved, Leaves, follow};
use crate::accel::dispatch_all;
use crate::light::{Area, FineCell, MIN_DISTANCE2, Points};
use crate::material::{Lobe, MOMENTS, Moments};
use crate::math::{LANES, Vec3x16};
use crate::shape::SurfaceInteraction;
use crate::visibility::ShadowView;

/// Leaves whose sums are added up in single precision.
const RUN: usize = 1 << 12;

/// Light is peaked where so many times more points send anything than there are effective ones, if that is more than
/// this part of all.
const PEAKED: f64 = 4.0;
const PART: f64 = 1.0 / 16.0;

/// What points of a light say, from one place: by leaf, and sums of what they would send, and of what of it arrives.
#[derive(Debug, Default)]
pub(super) struct Tally {
    /// Leaf by leaf, and 0 up to a multiple of sixteen: what its point would send from all of the light.
    sent: [Vec<f32>; MOMENTS],
    /// 1 where it would send anything, and where that is hidden; else 0.
    sends: Vec<f32>,
    hides: Vec<f32>,
    /// Where the point is.
    pub at: Vec<FineCell>,
    /// What would be sent, and what of it arrives.
    pub all: [f64; MOMENTS],
    pub lit: [f64; MOMENTS],
    /// The sum of squares of what each leaf would send.
    squares: [f64; MOMENTS],
    /// Parts of the light: what would send anything, and what of it is hidden. With the sum of the squares of the parts
    /// that leaves are of the former.
    pub sending: f64,
    pub hidden: f64,
    squared_parts: f64,
    /// What points sent that were asked in leaves thought to be away from edges, and found the contrary of what those
    /// held; added up until somebody forgets it.
    pub surprises: [f64; MOMENTS],
}

/// What sixteen points say.
#[derive(Clone, Copy)]
struct BlockAnswers {
    sent: [[f32; LANES]; MOMENTS],
    sends: u16,
    hides: u16,
}

/// What sixteen leaves hold.
pub(super) struct LeafLanes<S: Simd> {
    pub sent: [f32x16<S>; MOMENTS],
    pub sends: f32x16<S>,
    pub hides: f32x16<S>,
}

impl Tally {
    /// What arrives, where `whole` would if nothing were in the way. `shares` are the parts of it that do where no
    /// point sends anything.
    pub fn arrives(&self, whole: &Moments, shares: &[f32; MOMENTS]) -> Moments {
        let share = |k: usize| if self.all[k] > 0.0 { (self.lit[k] / self.all[k]) as f32 } else { shares[k] };
        Moments(std::array::from_fn(|k| whole.0[k] * share(k)))
    }

    /// The effective number of points, of the diffuse part and of the highlight: as many that send alike would be as
    /// good.
    pub fn effective(&self) -> [f64; MOMENTS] {
        std::array::from_fn(|k| if self.squares[k] > 0.0 { self.all[k] * self.all[k] / self.squares[k] } else { 0.0 })
    }

    /// The same of those that send anything, if all sent alike.
    pub fn effective_sending(&self) -> f64 {
        if self.squared_parts > 0.0 { self.sending * self.sending / self.squared_parts } else { 0.0 }
    }

    /// Whether few points send much of it, where each kind of light counts for so much.
    pub fn is_peaked(&self, weights: &[f32; MOMENTS]) -> bool {
        let (effective, sending) = (self.effective(), self.effective_sending());
        let sent: [f64; MOMENTS] = std::array::from_fn(|k| self.all[k] * f64::from(weights[k]));
        let much = PART * sent.iter().sum::<f64>();
        (0..MOMENTS).any(|k| sent[k] > much && effective[k] * PEAKED < sending)
    }

    /// What the point in a leaf would send from all of the light.
    pub fn sent(&self, leaf: usize) -> Moments {
        Moments(std::array::from_fn(|k| self.sent[k][leaf]))
    }

    /// What sixteen leaves hold.
    #[inline(always)]
    pub fn lanes<S: Simd>(&self, simd: S, block: usize) -> LeafLanes<S> {
        let lanes = |of: &[f32]| f32x16::from_slice(simd, &of[block * LANES..][..LANES]);
        LeafLanes {
            sent: std::array::from_fn(|k| lanes(&self.sent[k])),
            sends: lanes(&self.sends),
            hides: lanes(&self.hides),
        }
    }

    /// Hears what all points of a rung say, one in each of as many leaves, and forgets what was known. `view` says what
    /// is hidden in trees, point by point.
    pub fn fill(&mut self, asker: &Asker, rung: &Rung, view: &ShadowView, si: &SurfaceInteraction, lobe: &Lobe) {
        let count = rung.cells.len();
        self.at.clear();
        self.at.extend_from_slice(&rung.cells);
        self.numbers().for_each(|numbers| numbers.resize(count, 0.0));
        self.surprises = Default::default();
        let obstacles = PointObstacles::of(view);
        dispatch_all!(asker.level, simd => self.fill_lanes(simd, asker.area, &rung.points, si, lobe, &obstacles));
    }

    #[inline(always)]
    fn fill_lanes<S: Simd>(
        &mut self,
        simd: S,
        area: &Area,
        points: &Points,
        si: &SurfaceInteraction,
        lobe: &Lobe,
        obstacles: &PointObstacles,
    ) {
        let place = PlaceLanes::new(simd, area, si);
        for block in 0..points.blocks.len() {
            let BlockAnswers { sent, sends, hides } = place.ask(simd, area, points, block, lobe, obstacles);
            let lanes = block * LANES..(block + 1) * LANES;
            for (all, sent) in self.sent.iter_mut().zip(&sent) {
                all[lanes.clone()].copy_from_slice(sent);
            }
            let one_where = |bits: u16| {
                let is = mask32x16::from_bitmask(simd, bits.into());
                is.select(simd.splat_f32x16(1.0), simd.splat_f32x16(0.0))
            };
            one_where(sends).store_slice(&mut self.sends[lanes.clone()]);
            one_where(hides).store_slice(&mut self.hides[lanes]);
        }
    }

    /// Which leaves send, and which are hidden.
    fn bits(&self) -> [CellBits; 2] {
        [&self.sends, &self.hides].map(|numbers| {
            let bit = |(lane, v): (usize, &f32)| u16::from(*v > 0.0) << lane;
            let block = |block: &[f32]| block.iter().enumerate().map(bit).fold(0, |all, bit| all | bit);
            numbers.chunks_exact(LANES).map(block).collect()
        })
    }

    /// Hears one more point in each leaf, where all are cells of one size: `second`, of which `view` says what is
    /// hidden in trees. `both` are those and the ones that are known, in half as large cells. `near` are leaves near
    /// edges.
    #[allow(clippy::too_many_arguments, reason = "points of a light, and a surface that it shines on")]
    pub fn double(
        &mut self,
        asker: &Asker,
        second: &Rung,
        both: &Rung,
        near: &[u16],
        view: &mut ShadowView,
        si: &SurfaceInteraction,
        lobe: &Lobe,
    ) {
        let [sends, hides] = self.bits();
        if !view.hidden.is_empty() {
            let new = view.hidden.iter().zip(&second.halves).map(|(hidden, halves)| to_halves(*hidden, *halves));
            let old = hides.iter().zip(&second.halves).map(|(hidden, halves)| to_halves(*hidden, !halves));
            view.hidden = new.zip(old).flat_map(|(new, old)| [new[0] | old[0], new[1] | old[1]]).collect();
        }
        self.fill(asker, both, view, si, lobe);
        // What contradicts what leaves held that were thought to be away from edges
        let [new_sends, new_hides] = self.bits();
        let whole = |bits: u16| {
            let [first, second] = [0, u16::MAX].map(|second| to_halves(bits, second));
            [first[0] | second[0], first[1] | second[1]]
        };
        let part = 1.0 / self.at.len() as f64;
        for (block, near) in near.iter().enumerate() {
            let [sends, hides, near] = [sends[block], hides[block], *near].map(whole);
            for half in 0..2 {
                let leaves = 2 * block + half;
                let is_other = !(sends[half] ^ new_sends[leaves]) & (hides[half] ^ new_hides[leaves]) & !near[half];
                for leaf in cells_in(&[is_other]) {
                    let sent = self.sent(leaves * LANES + leaf);
                    self.surprises.iter_mut().zip(sent.0).for_each(|(sum, sent)| *sum += f64::from(sent) * part);
                }
            }
        }
    }

    /// Follows leaves that were halved.
    pub fn halve(&mut self, parted: &[u32]) {
        let before = self.at.len();
        let count = before + parted.len();
        self.at.resize(count, FineCell::default());
        follow(&mut self.at, before, parted);
        for numbers in self.numbers() {
            numbers.resize(count.next_multiple_of(LANES), 0.0);
            follow(numbers, before, parted);
        }
    }

    fn numbers(&mut self) -> impl Iterator<Item = &mut Vec<f32>> {
        self.sent.iter_mut().chain([&mut self.sends, &mut self.hides])
    }

    /// Hears what those points of a rung say that are `asked`, one for each of the leaves that were halved, in place of
    /// what the half that it is in holds. `view` says what is hidden in trees, point by point.
    #[allow(clippy::too_many_arguments, reason = "points of a light, and a surface that it shines on")]
    pub fn ask(
        &mut self,
        asker: &Asker,
        rung: &Rung,
        halved: &Halved,
        asked: &[u16],
        view: &ShadowView,
        si: &SurfaceInteraction,
        lobe: &Lobe,
    ) {
        let obstacles = PointObstacles::of(view);
        dispatch_all!(asker.level, simd => self.add(simd, asker.area, rung, halved, asked, si, lobe, &obstacles));
    }

    /// Sums up what all leaves hold.
    pub fn sum(&mut self, level: Level, leaves: &Leaves) {
        dispatch_all!(level, simd => self.sum_lanes(simd, &leaves.parts));
    }

    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "points of a light, and a surface that it shines on")]
    fn add<S: Simd>(
        &mut self,
        simd: S,
        area: &Area,
        rung: &Rung,
        halved: &Halved,
        asked: &[u16],
        si: &SurfaceInteraction,
        lobe: &Lobe,
        obstacles: &PointObstacles,
    ) {
        let (place, mut next) = (PlaceLanes::new(simd, area, si), 0);
        for (block, asked) in asked.iter().enumerate().filter(|(_, asked)| **asked != 0) {
            let answers = place.ask(simd, area, &rung.points, block, lobe, obstacles);
            let mut rest = *asked;
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize % LANES;
                rest &= rest - 1;
                let at = rung.cells[block * LANES + lane];
                let leaf = halved.first[next] as usize + at.half(halved.level);
                next += 1;
                self.at[leaf] = at;
                let [sends, hides] = [answers.sends, answers.hides].map(|bits| f32::from(bits >> lane & 1));
                let is_surprise = sends == self.sends[leaf] && hides != self.hides[leaf];
                if is_surprise && halved.away[next - 1] {
                    let part = 0.5 / (1u64 << halved.level) as f64;
                    self.surprises
                        .iter_mut()
                        .zip(&answers.sent)
                        .for_each(|(sum, sent)| *sum += f64::from(sent[lane]) * part);
                }
                for (sent, new) in self.sent.iter_mut().zip(&answers.sent) {
                    sent[leaf] = new[lane];
                }
                (self.sends[leaf], self.hides[leaf]) = (sends, hides);
            }
        }
    }

    #[inline(always)]
    fn sum_lanes<S: Simd>(&mut self, simd: S, parts: &[f32]) {
        let zero = simd.splat_f32x16(0.0);
        let mut totals = [0.0; 3 + 3 * MOMENTS];
        for (run, parts) in parts.chunks(RUN).enumerate() {
            let mut sums = [zero; 3 + 3 * MOMENTS];
            for (block, part) in parts.chunks_exact(LANES).enumerate() {
                let part = f32x16::from_slice(simd, part);
                let LeafLanes { sent, sends, hides } = self.lanes(simd, run * (RUN / LANES) + block);
                sums[0] += sends * part;
                sums[1] += hides * part;
                sums[2] += sends * part * part;
                for (sums, sent) in sums[3..].chunks_exact_mut(3).zip(sent) {
                    let sent = sent * part;
                    sums[0] += sent;
                    sums[1] += sent * (sends - hides);
                    sums[2] += sent * sent;
                }
            }
            for (total, sum) in totals.iter_mut().zip(&sums) {
                *total += sum.as_slice().iter().map(|v| f64::from(*v)).sum::<f64>();
            }
        }
        let [sending, hidden, squared_parts, moments @ ..] = totals;
        (self.sending, self.hidden, self.squared_parts) = (sending, hidden, squared_parts);
        for (k, moment) in moments.chunks_exact(3).enumerate() {
            (self.all[k], self.lit[k], self.squares[k]) = (moment[0], moment[1], moment[2]);
        }
    }
}

/// What each of some points of a light would send to a place, from all of it.
pub(super) fn would_send(asker: &Asker, points: &Points, si: &SurfaceInteraction, lobe: &Lobe) -> Vec<Moments> {
    let mut sent = Vec::with_capacity(points.blocks.len() * LANES);
    dispatch_all!(asker.level, simd => {
        let place = PlaceLanes::new(simd, asker.area, si);
        for block in 0..points.blocks.len() {
            let answers = place.ask(simd, asker.area, points, block, lobe, &PointObstacles::default());
            sent.extend((0..LANES).map(|lane| Moments(answers.sent.map(|sent| sent[lane]))));
        }
    });
    sent
}

/// A place, in all lanes.
struct PlaceLanes<S: Simd> {
    p: Vec3x16<S>,
    ns: Vec3x16<S>,
    wo: Vec3x16<S>,
    horizon: Vec3x16<S>,
    floor: f32x16<S>,
    cos_o: f32x16<S>,
}

impl<S: Simd> PlaceLanes<S> {
    #[inline(always)]
    fn new(simd: S, area: &Area, si: &SurfaceInteraction) -> Self {
        PlaceLanes {
            p: Vec3x16::splat(simd, si.lit_from),
            ns: Vec3x16::splat(simd, si.ns),
            wo: Vec3x16::splat(simd, si.wo),
            horizon: Vec3x16::splat(simd, si.horizon),
            floor: simd.splat_f32x16(area.floor(si.lit_from, si.error, si.horizon)),
            cos_o: simd.splat_f32x16(si.ns.dot(si.wo)),
        }
    }

    /// What sixteen points of an area light send.
    #[inline(always)]
    fn ask(
        &self,
        simd: S,
        area: &Area,
        points: &Points,
        block: usize,
        lobe: &Lobe,
        obstacles: &PointObstacles,
    ) -> BlockAnswers {
        let zero = simd.splat_f32x16(0.0);
        let q = points.blocks[block].lanes(simd);
        let Vec3x16 { x, y, z } = self.p;
        let l = Vec3x16 { x: q.x - x, y: q.y - y, z: q.z - z };
        let height = self.ns.dot(l);
        let distance2 = l.dot(l);
        let is_above = height.simd_gt(zero)
            & self.horizon.dot(l).simd_gt(self.floor)
            & distance2.simd_ge(simd.splat_f32x16(MIN_DISTANCE2));
        let mut answers = BlockAnswers { sent: [[0.0; LANES]; MOMENTS], sends: 0, hides: 0 };
        if is_above.all_false() {
            return answers;
        }
        let inverse_distance = simd.splat_f32x16(1.0) / distance2.sqrt();
        let weight = is_above.select(area.weight_lanes(points, block, l, inverse_distance), zero);
        let mut lit = weight.simd_gt(zero);
        answers.sends = lit.to_bitmask() as u16;
        if let Some(hidden) = obstacles.hidden.get(block) {
            lit &= !mask32x16::from_bitmask(simd, u64::from(*hidden));
        }
        for sphere in obstacles.spheres {
            lit &= !sphere.blocks_lanes(l, distance2);
        }
        for flat in obstacles.flats {
            lit &= !flat.blocks_lanes(l);
        }
        for disk in obstacles.disks {
            lit &= !disk.blocks_lanes(l);
        }
        answers.hides = answers.sends & !(lit.to_bitmask() as u16);
        let (cos_i, cos_io) = (height * inverse_distance, self.wo.dot(l) * inverse_distance);
        let moments = lobe.moments_lanes([cos_i], self.cos_o, [cos_io], [weight]);
        for (sent, [moment]) in answers.sent.iter_mut().zip(moments) {
            is_above.select(moment, zero).store_slice(sent);
        }
        answers
    }
}
