//! What points of an area light say, from one place, cell by cell of the light.
//!
//! Each cell holds what the point in it says; where cells were halved without a new point in one of them, both halves
//! hold the same. So every cell counts alike, and it is enough to ask anew where the edge of a shadow is. What points
//! would send is tallied with and without what is hidden: where all that a light would send is known exactly, the
//! points only say which share of it arrives, a ratio estimate.
//!
//! Sources: of ratio estimates, Cochran, "Sampling Techniques", 1977, chapter 6; of the effective number of points,
//! Kish 1965.

use fearless_simd::{Level, dispatch, f32x16, mask32x16, prelude::*};

use super::ladder::{Asker, Rung};
use super::lanes::PointObstacles;
use crate::light::{Area, MIN_DISTANCE2, Points};
use crate::material::{Lobe, MOMENTS, Moments};
use crate::math::{LANES, Vec3x16};
use crate::shape::SurfaceInteraction;
use crate::visibility::ShadowView;

/// Cells whose sums are added up in single precision.
const RUN: usize = 1 << 12;

/// What points of a light say, from one place: by cell, and sums of what they would send, and of what of it arrives.
#[derive(Debug, Default)]
pub(super) struct Tally {
    sent: [Vec<f32>; MOMENTS],
    /// Sixteen by sixteen: a bit for each cell whose point would send anything, and for each of those that is hidden.
    pub sends: Vec<u16>,
    pub hides: Vec<u16>,
    pub all: [f64; MOMENTS],
    pub lit: [f64; MOMENTS],
    /// Of the squares of what they would send.
    squares: [f64; MOMENTS],
    /// How many cells would send anything, and how many of those are hidden.
    pub sending: usize,
    pub hidden: usize,
}

/// What sixteen points say.
#[derive(Clone, Copy)]
struct BlockAnswers {
    sent: [[f32; LANES]; MOMENTS],
    sends: u16,
    hides: u16,
}

impl Tally {
    /// The cells, each of which counts alike.
    pub fn cells(&self) -> usize {
        self.sent[0].len()
    }

    /// What arrives. `whole` is what would if nothing were in the way, if that is known; else points alone tell, each
    /// of which stands for `measure` over their number. `shares` are the parts of it that arrive where none sends
    /// anything.
    pub fn sums(&self, whole: Option<&Moments>, measure: f32, shares: &[f32; MOMENTS]) -> Moments {
        let Some(whole) = whole else {
            let one = f64::from(measure) / self.cells().max(1) as f64;
            return Moments(self.lit.map(|lit| (lit * one) as f32));
        };
        let share = |k: usize| if self.all[k] > 0.0 { (self.lit[k] / self.all[k]) as f32 } else { shares[k] };
        Moments(std::array::from_fn(|k| whole.0[k] * share(k)))
    }

    /// What would arrive if nothing were in the way, as far as points tell.
    pub fn whole(&self, measure: f32) -> Moments {
        let one = f64::from(measure) / self.cells().max(1) as f64;
        Moments(self.all.map(|all| (all * one) as f32))
    }

    /// The effective number of cells, of the diffuse part and of the highlight: as many that send alike would be as
    /// good.
    pub fn effective(&self) -> [f64; MOMENTS] {
        std::array::from_fn(|k| if self.squares[k] > 0.0 { self.all[k] * self.all[k] / self.squares[k] } else { 0.0 })
    }

    /// What sixteen cells send.
    pub fn sent(&self, block: usize) -> [&[f32; LANES]; MOMENTS] {
        let block = block * LANES;
        std::array::from_fn(|k| self.sent[k][block..block + LANES].try_into().expect("a block has as many"))
    }

    /// Asks for that many cells from now on: of none, or of as many halves. They hold what the larger ones did.
    pub fn part(&mut self, cells: usize) {
        for sent in &mut self.sent {
            let count = sent.len();
            sent.resize(cells, 0.0);
            for cell in (0..count).rev() {
                (sent[2 * cell], sent[2 * cell + 1]) = (sent[cell], sent[cell]);
            }
        }
        for bits in [&mut self.sends, &mut self.hides] {
            *bits = bits.iter().flat_map(|bits| [twice(*bits as u8), twice((*bits >> 8) as u8)]).collect();
            bits.resize(cells / LANES, 0);
        }
    }

    /// Adds what those points of a rung say that are `asked`, each in place of all that is held in its one of so many
    /// cells. `view` says what is hidden in trees, point by point.
    #[allow(clippy::too_many_arguments, reason = "points of a light, and a surface that it shines on")]
    pub fn ask(
        &mut self,
        asker: &Asker,
        rung: &Rung,
        cells: usize,
        asked: &[u16],
        view: &ShadowView,
        si: &SurfaceInteraction,
        lobe: &Lobe,
    ) {
        let obstacles = PointObstacles::of(view);
        dispatch!(asker.level, simd => self.add(simd, asker.area, rung, cells, asked, si, lobe, &obstacles));
    }

    /// Sums up what all cells hold.
    pub fn sum(&mut self, level: Level) {
        dispatch!(level, simd => self.sum_lanes(simd));
    }

    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "points of a light, and a surface that it shines on")]
    fn add<S: Simd>(
        &mut self,
        simd: S,
        area: &Area,
        rung: &Rung,
        cells: usize,
        asked: &[u16],
        si: &SurfaceInteraction,
        lobe: &Lobe,
        obstacles: &PointObstacles,
    ) {
        let (place, span) = (PlaceLanes::new(simd, area, si), self.cells() / cells);
        for (block, asked) in asked.iter().enumerate().filter(|(_, asked)| **asked != 0) {
            let answers = place.ask(simd, area, &rung.points, block, lobe, obstacles);
            let mut rest = *asked;
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize % LANES;
                rest &= rest - 1;
                let Some(cell) = rung.cells.get(block * LANES + lane).map(|cell| cell.part_of(cells)) else { break };
                for cell in cell * span..(cell + 1) * span {
                    for (sent, new) in self.sent.iter_mut().zip(&answers.sent) {
                        sent[cell] = new[lane];
                    }
                    let (block, bit) = (cell / LANES, 1 << (cell % LANES));
                    for (bits, new) in [(&mut self.sends, answers.sends), (&mut self.hides, answers.hides)] {
                        bits[block] = bits[block] & !bit | if new >> lane & 1 == 1 { bit } else { 0 };
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn sum_lanes<S: Simd>(&mut self, simd: S) {
        let zero = simd.splat_f32x16(0.0);
        let count = |bits: &[u16]| bits.iter().map(|bits| bits.count_ones() as usize).sum();
        (self.sending, self.hidden) = (count(&self.sends), count(&self.hides));
        for (k, sent) in self.sent.iter().enumerate() {
            let mut totals = [0.0; 3];
            for (sent, hides) in sent.chunks(RUN).zip(self.hides.chunks(RUN / LANES)) {
                let mut sums = [zero; 3];
                for (sent, hides) in sent.chunks_exact(LANES).zip(hides) {
                    let sent = f32x16::from_slice(simd, sent);
                    let is_hidden = mask32x16::from_bitmask(simd, u64::from(*hides));
                    sums[0] += sent;
                    sums[1] += is_hidden.select(zero, sent);
                    sums[2] += sent * sent;
                }
                for (total, sum) in totals.iter_mut().zip(sums) {
                    *total += sum.as_slice().iter().map(|v| f64::from(*v)).sum::<f64>();
                }
            }
            [self.all[k], self.lit[k], self.squares[k]] = totals;
        }
    }
}

/// Each of eight bits twice.
fn twice(bits: u8) -> u16 {
    let mut bits = u16::from(bits);
    bits = (bits | bits << 4) & 0x0f0f;
    bits = (bits | bits << 2) & 0x3333;
    bits = (bits | bits << 1) & 0x5555;
    bits | bits << 1
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
