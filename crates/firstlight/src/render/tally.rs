//! What points of an area light say, from one place, leaf by leaf of the light.
//!
//! Each leaf holds what the point in it says. Where leaves are halved, one half keeps the point, and the other has a
//! new one. A leaf counts for the part of the light that it is, so it is enough to ask anew where the edge of a shadow
//! is. What points would send is tallied with and without what is hidden: all that a light would send is known exactly,
//! so the points only say which share of it arrives, a ratio estimate.
//!
//! Sources: of ratio estimates, Cochran, "Sampling Techniques", 1977, chapter 6; of the effective number of points,
//! Kish 1965.

use fearless_simd::{Level, f32x16, mask32x16, prelude::*};

use super::ladder::{AskedRung, Asker, Rung, to_halves};
use super::lanes::PointObstacles;
use super::leaves::{Halved, Leaves};
use crate::accel::dispatch_all;
use crate::light::{Area, FineCell, MIN_DISTANCE2, Points};
use crate::material::{LobeLanes, MOMENTS, Moments, ShadingPoint};
use crate::math::{LANES, Vec3x16, only, total};
use crate::visibility::ShadowView;

/// Blocks whose sums are added up in single precision.
const RUN: usize = 1 << 8;

/// What points of a light say, from one place: leaf by leaf, and sums of what they would send, and of what of it
/// arrives.
#[derive(Debug, Default)]
pub(super) struct Tally {
    /// By the number of the block.
    blocks: Vec<BlockAnswers>,
    /// What would be sent, and what of it arrives.
    pub all: [f64; MOMENTS],
    pub lit: [f64; MOMENTS],
    /// The sum of squares of what each leaf would send.
    squares: [f64; MOMENTS],
    /// Parts of the light: what would send anything, and what of it is hidden.
    pub sending: f64,
    pub hidden: f64,
    /// What points sent that were asked in leaves thought to be away from edges, and found the contrary of what those
    /// held; added up until somebody forgets it.
    pub surprises: [f64; MOMENTS],
}

/// What the points of sixteen leaves say.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockAnswers {
    /// Where they are.
    pub at: [FineCell; LANES],
    /// What each would send from all of the light.
    sent: [[f32; LANES]; MOMENTS],
    /// Which would send anything, and of which that is hidden, as bits.
    pub sends: u16,
    pub hides: u16,
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

    /// What the points in the leaves of a block say.
    pub fn block(&self, number: usize) -> &BlockAnswers {
        &self.blocks[number]
    }

    /// Where the point is that sends most, where each kind of light counts for so much.
    pub fn most(&self, level: Level, weights: &[f32; MOMENTS]) -> FineCell {
        let [mut most, mut of] = [[0.0f32; LANES], [0.0f32; LANES]];
        dispatch_all!(level, simd => {
            let [mut largest, mut number] = [simd.splat_f32x16(-1.0), simd.splat_f32x16(0.0)];
            for (k, block) in self.blocks.iter().enumerate() {
                let sent = block.lanes(simd).into_iter().zip(weights);
                let sent = sent.fold(simd.splat_f32x16(0.0), |sum, (sent, weight)| sum + sent * *weight);
                let is_more = sent.simd_gt(largest);
                largest = is_more.select(sent, largest);
                number = is_more.select(simd.splat_f32x16(k as f32), number);
            }
            largest.store_slice(&mut most);
            number.store_slice(&mut of);
        });
        let lane = (0..LANES).max_by(|one, other| most[*one].total_cmp(&most[*other])).unwrap_or_default();
        self.blocks.get(of[lane] as usize).map_or(FineCell::FIRST, |block| block.at[lane])
    }

    /// Hears what all points of a rung say, one in each of as many leaves, and forgets what was known. `view` says what
    /// is hidden in trees, point by point.
    pub fn fill(&mut self, asker: &Asker, rung: &Rung, view: &ShadowView, point: &ShadingPoint) {
        let obstacles = PointObstacles::of(view);
        self.blocks.clear();
        self.surprises = Default::default();
        dispatch_all!(asker.level, simd => {
            let place = PlaceLanes::new(simd, asker.area, point);
            for (block, at) in rung.cells.iter().enumerate() {
                let answers = place.ask(simd, asker.area, &rung.points, block, &obstacles);
                self.blocks.push(BlockAnswers { at: *at, ..answers });
            }
        });
    }

    /// Hears what one more point says in each leaf of those blocks that were halved, in place of what the half that it
    /// is in holds. `view` says what is hidden in trees, point by point.
    pub fn halve(
        &mut self,
        asker: &Asker,
        (rung, halved): (&AskedRung, &Halved),
        view: &ShadowView,
        point: &ShadingPoint,
    ) {
        let obstacles = PointObstacles::of(view);
        let most = halved.blocks.last().map_or(0, |block| block.halves[1] as usize + 1);
        self.blocks.resize(self.blocks.len().max(most), BlockAnswers::NONE);
        let part = 0.5 / (1u64 << halved.level) as f32;
        dispatch_all!(asker.level, simd => {
            let place = PlaceLanes::new(simd, asker.area, point);
            let mut surprises = [simd.splat_f32x16(0.0); MOMENTS];
            for (k, block) in halved.blocks.iter().enumerate() {
                let from = rung.block_of(k, block);
                let answers = place.ask(simd, asker.area, &rung.points, from, &obstacles);
                let new = BlockAnswers { at: rung.cells[from], ..answers };
                let old = self.blocks[block.halves[0] as usize];
                if block.is_away {
                    let is_surprise = !(new.sends ^ old.sends) & (new.hides ^ old.hides);
                    for (sum, sent) in surprises.iter_mut().zip(&new.sent) {
                        *sum += only(simd, is_surprise, f32x16::from_slice(simd, sent));
                    }
                }
                let halves = BlockAnswers::halves(simd, &old, &new, rung.halves[from]);
                for (number, half) in block.halves.iter().zip(halves) {
                    self.blocks[*number as usize] = half;
                }
            }
            for (sum, new) in self.surprises.iter_mut().zip(surprises) {
                *sum += f64::from(total(new) * part);
            }
        });
    }

    /// Sums up what all leaves hold.
    pub fn sum(&mut self, level: Level, leaves: &Leaves) {
        dispatch_all!(level, simd => self.sum_lanes(simd, leaves));
    }

    #[inline(always)]
    fn sum_lanes<S: Simd>(&mut self, simd: S, leaves: &Leaves) {
        let (mut parts, mut moments) = ([0.0; 2], [0.0; 3 * MOMENTS]);
        for (blocks, answers) in leaves.blocks.chunks(RUN).zip(self.blocks.chunks(RUN)) {
            let mut sums = [simd.splat_f32x16(0.0); 3 * MOMENTS];
            for (block, answers) in blocks.iter().zip(answers) {
                let part = block.part();
                let [sends, hides] = [answers.sends, answers.hides].map(|bits| f64::from(bits.count_ones()));
                parts[0] += sends * f64::from(part);
                parts[1] += hides * f64::from(part);
                for (sums, sent) in sums.chunks_exact_mut(3).zip(answers.lanes(simd)) {
                    let sent = sent * part;
                    sums[0] += sent;
                    sums[1] += only(simd, answers.lit(), sent);
                    sums[2] += sent * sent;
                }
            }
            for (total, sum) in moments.iter_mut().zip(&sums) {
                *total += sum.as_slice().iter().map(|v| f64::from(*v)).sum::<f64>();
            }
        }
        [self.sending, self.hidden] = parts;
        for (k, moment) in moments.chunks_exact(3).enumerate() {
            (self.all[k], self.lit[k], self.squares[k]) = (moment[0], moment[1], moment[2]);
        }
    }
}

impl BlockAnswers {
    const NONE: BlockAnswers =
        BlockAnswers { at: [FineCell::FIRST; LANES], sent: [[0.0; LANES]; MOMENTS], sends: 0, hides: 0 };

    /// Those that send, and are not hidden.
    pub fn lit(&self) -> u16 {
        self.sends & !self.hides
    }

    /// What each would send from all of the light.
    #[inline(always)]
    pub fn lanes<S: Simd>(&self, simd: S) -> [f32x16<S>; MOMENTS] {
        std::array::from_fn(|k| f32x16::from_slice(simd, &self.sent[k]))
    }

    fn moments(&self, lane: usize) -> Moments {
        Moments(std::array::from_fn(|k| self.sent[k][lane]))
    }

    /// What is held of both halves of each leaf: of one what a new point says, of the `second` where bits say so, and
    /// of the other what was known.
    #[inline(always)]
    fn halves<S: Simd>(simd: S, old: &BlockAnswers, new: &BlockAnswers, second: u16) -> [BlockAnswers; 2] {
        let mut halves = [BlockAnswers::NONE; 2];
        let is_second = mask32x16::from_bitmask(simd, second.into());
        for k in 0..MOMENTS {
            let [old, new] = [old, new].map(|one| f32x16::from_slice(simd, &one.sent[k]));
            let (low, high) = simd.interleave_f32x16(is_second.select(old, new), is_second.select(new, old));
            low.store_slice(&mut halves[0].sent[k]);
            high.store_slice(&mut halves[1].sent[k]);
        }
        for (leaf, (old, new)) in old.at.iter().zip(&new.at).enumerate() {
            let is_second = second >> leaf & 1 == 1;
            let pair = if is_second { [*old, *new] } else { [*new, *old] };
            halves[2 * leaf / LANES].at[2 * leaf % LANES..][..2].copy_from_slice(&pair);
        }
        let bits = |of: fn(&BlockAnswers) -> u16| {
            let [new, old] = [to_halves(of(new), second), to_halves(of(old), !second)];
            [new[0] | old[0], new[1] | old[1]]
        };
        let [sends, hides] = [bits(|one| one.sends), bits(|one| one.hides)];
        for (k, half) in halves.iter_mut().enumerate() {
            (half.sends, half.hides) = (sends[k], hides[k]);
        }
        halves
    }
}

/// What each of some points of a light would send to a place, from all of it.
pub(super) fn would_send(
    asker: &Asker,
    places: impl Iterator<Item = [[f64; LANES]; 2]>,
    point: &ShadingPoint,
) -> Vec<Moments> {
    let mut sent = Vec::new();
    dispatch_all!(asker.level, simd => {
        let place = PlaceLanes::new(simd, asker.area, point);
        let points = asker.area.points_at(places);
        for block in 0..points.blocks.len() {
            let answers = place.ask(simd, asker.area, &points, block, &PointObstacles::default());
            for lane in 0..LANES {
                sent.push(answers.moments(lane));
            }
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
    lobe: LobeLanes,
}

impl<S: Simd> PlaceLanes<S> {
    #[inline(always)]
    fn new(simd: S, area: &Area, point: &ShadingPoint) -> Self {
        PlaceLanes {
            p: Vec3x16::splat(simd, point.p),
            ns: Vec3x16::splat(simd, point.ns),
            wo: Vec3x16::splat(simd, point.wo),
            horizon: Vec3x16::splat(simd, point.horizon),
            floor: simd.splat_f32x16(area.floor(point.p, point.error, point.horizon)),
            cos_o: simd.splat_f32x16(point.ns.dot(point.wo)),
            lobe: LobeLanes::of(&point.bsdf.lobe),
        }
    }

    /// What sixteen points of an area light send, wherever they are.
    #[inline(always)]
    fn ask(&self, simd: S, area: &Area, points: &Points, block: usize, obstacles: &PointObstacles) -> BlockAnswers {
        let zero = simd.splat_f32x16(0.0);
        let q = points.blocks[block].lanes(simd);
        let Vec3x16 { x, y, z } = self.p;
        let l = Vec3x16 { x: q.x - x, y: q.y - y, z: q.z - z };
        let height = self.ns.dot(l);
        let distance2 = l.dot(l);
        let is_above = height.simd_gt(zero)
            & self.horizon.dot(l).simd_gt(self.floor)
            & distance2.simd_ge(simd.splat_f32x16(MIN_DISTANCE2));
        let mut answers = BlockAnswers::NONE;
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
        let moments = self.lobe.moments([cos_i], self.cos_o, [cos_io], [weight]);
        for (sent, [moment]) in answers.sent.iter_mut().zip(moments) {
            is_above.select(moment, zero).store_slice(sent);
        }
        answers
    }
}
