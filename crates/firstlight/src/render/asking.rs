//! Rays that ask points of a light, each in the same leaves of it.

use super::Counts;
use super::beams::{self, RungRays};
use super::ladder::{AskedRung, Asker};
use super::leaves::{LeafBlock, Leaves};
use super::tally::{Tally, would_send};
use crate::color::Rgb;
use crate::film::resolve::LightTerm;
use crate::integrate::TOLERANCE;
use crate::light::FineCell;
use crate::material::{MOMENTS, Moments, ShadingPoint};
use crate::math::LANES;
use crate::visibility::{ShadowView, Viewpoint};

/// The points of all rays up to which all leaves are of one size.
pub(super) const EVENLY: usize = 1 << 12;
/// The points that a light is told by at most, of all rays of a pixel.
pub(super) const MOST: usize = 1 << 16;
/// The level of the smallest leaves.
const DEEPEST: u32 = 44;

/// A ray whose light is behind things.
pub(super) struct Asking {
    pub point: ShadingPoint,
    pub scale: Rgb,
    pub series: usize,
    pub view: ShadowView,
    /// What would arrive if nothing were in the way, if that was asked in closed form.
    pub whole: Option<Moments>,
    /// What arrives, if that was asked in closed form and there is one.
    pub known: Option<Moments>,
    pub tally: Tally,
}

impl Asking {
    pub fn place(&self, share: f32) -> ShadingPoint {
        ShadingPoint { share, ..self.point }
    }

    /// The diffuse part and the highlight, with their colours.
    pub fn each(&self, sums: &Moments) -> LightTerm {
        (self.scale * self.point.bsdf.colors).each(sums)
    }

    pub fn color(&self, sums: &Moments) -> Rgb {
        self.each(sums).sum()
    }

    /// Whether the surface reflects any light of a kind.
    pub fn reflects(&self, kind: usize) -> bool {
        self.each(&Moments([1.0; MOMENTS])).0[kind] != Rgb::BLACK
    }

    /// What would arrive if nothing were in the way: as is known, or as points of a light of such a measure say.
    pub fn sent(&self, measure: f32) -> Moments {
        self.whole.unwrap_or_else(|| Moments(self.tally.all.map(|all| all as f32 * measure)))
    }
}

/// The leaves of a light that rays ask points in.
pub(super) struct AskedLeaves<'a> {
    asker: Asker<'a>,
    pub leaves: Leaves,
    /// How often the light was halved to make all of them, at least.
    pub everywhere: u32,
    /// Which blocks were asked since they were last taken, by their numbers.
    is_new: Vec<bool>,
    /// Whether all were halved once, so that it is known what first points overlook.
    pub is_raised: bool,
}

impl<'a> AskedLeaves<'a> {
    /// Has all rays ask a point in each of so many.
    pub fn new(asker: Asker<'a>, count: usize, asking: &mut [Asking], counts: &mut Counts) -> Self {
        let level = count.ilog2();
        let leaves = Leaves::of(level);
        let is_new = vec![true; leaves.blocks.len()];
        let asked = AskedLeaves { asker, leaves, everywhere: level, is_new, is_raised: false };
        let first: Vec<AskedRung> = asking.iter().map(|one| asker.first(one.series, count)).collect();
        asked.look(&first, &vec![u16::MAX; count / LANES], asking, counts);
        for (one, rung) in asking.iter_mut().zip(&first) {
            one.tally.fill(&asker, rung, &one.view, &one.point);
        }
        asked
    }

    /// Which blocks were asked since this was last called, by their numbers.
    pub fn take_new(&mut self) -> Vec<bool> {
        std::mem::take(&mut self.is_new)
    }

    /// Halves blocks of leaves, and has all rays ask one more point in each leaf: in those that are near edges; or, to
    /// raise the number of all, in the largest, once there are many heavy ones first, or if it is not told which are
    /// heavy. Says whether any was halved.
    pub fn halve(
        &mut self,
        near: &[bool],
        is_raised: bool,
        is_told: bool,
        asking: &mut [Asking],
        counts: &mut Counts,
    ) -> bool {
        // What many points say is worth more than which of few say much, and in leaves of one size they cost little
        let is_even = self.is_even() && Asker::keeps(self.everywhere);
        let are_few = self.leaves.count() * asking.len() < EVENLY;
        if is_raised && !(is_even && are_few && is_told) && self.halve_heavy(asking, counts) {
            return true;
        }
        if is_raised {
            self.everywhere += 1;
            self.is_raised = true;
            asking.iter_mut().for_each(|one| one.tally.surprises = Default::default());
        }
        let everywhere = self.everywhere;
        let halves = self.halve_those(asking, counts, |number, block| {
            let is_wanted = near[number] && block.level < DEEPEST || block.level < everywhere;
            is_wanted.then_some(!near[number])
        });
        !halves.is_empty()
    }

    /// Whether all leaves are of one size.
    pub fn is_even(&self) -> bool {
        self.leaves.count() == 1 << self.everywhere
    }

    /// Halves blocks as [`Leaves::halve`] says, and has all rays ask one more point in each leaf; the numbers of the
    /// halves.
    fn halve_those(
        &mut self,
        asking: &mut [Asking],
        counts: &mut Counts,
        is: impl Fn(usize, &LeafBlock) -> Option<bool>,
    ) -> Vec<u32> {
        let halved = self.leaves.halve(is);
        for halved in &halved {
            let next =
                |one: &Asking| self.asker.next(one.series, halved, |number| &one.tally.block(number as usize).at);
            let next: Vec<AskedRung> = asking.iter().map(next).collect();
            self.look(&next, &next[0].asked(halved), asking, counts);
            for (one, rung) in asking.iter_mut().zip(&next) {
                one.tally.halve(&self.asker, (rung, halved), &one.view, &one.point);
            }
        }
        let halves: Vec<u32> = halved.iter().flat_map(|halved| &halved.blocks).flat_map(|block| block.halves).collect();
        self.is_new.resize(self.leaves.blocks.len(), false);
        halves.iter().for_each(|number| self.is_new[*number as usize] = true);
        halves
    }

    /// Halves those blocks, and their halves, in which leaves may send so much more to all rays together than others as
    /// `TOLERANCE.heavy` says; whether there were any. That is told not by the points that were asked in them, but by
    /// others: to look closer at what is found to send much makes what is found less, and nothing makes it more.
    fn halve_heavy(&mut self, asking: &mut [Asking], counts: &mut Counts) -> bool {
        let rays = asking.iter().enumerate();
        let peaks: Vec<Peak> = rays.map(|(ray, one)| Peak::of(ray, one, &self.asker)).collect();
        let all: f32 = peaks.iter().map(|peak| peak.sends).sum();
        let heavy = TOLERANCE.heavy * all / (1u32 << self.everywhere) as f32;
        let every: Vec<u32> = (0..self.leaves.blocks.len() as u32).collect();
        let mut worth = self.worth(&peaks, asking, &every);
        let mut is_any = false;
        while self.leaves.count() * asking.len() < MOST {
            let is_heavy =
                |number: usize, block: &LeafBlock| (worth[number] > heavy && block.level < DEEPEST).then_some(false);
            let halves = self.halve_those(asking, counts, is_heavy);
            if halves.is_empty() {
                break;
            }
            is_any = true;
            worth.resize(self.leaves.blocks.len(), 0.0);
            for (number, new) in halves.iter().zip(self.worth(&peaks, asking, &halves)) {
                worth[*number as usize] = new;
            }
        }
        is_any
    }

    /// What a leaf of each of some blocks sends to all rays, told by the place in the block that is nearest to where
    /// the most was found.
    fn worth(&self, peaks: &[Peak], asking: &[Asking], blocks: &[u32]) -> Vec<f32> {
        let mut worth = vec![0.0; blocks.len()];
        for peak in peaks {
            let one = &asking[peak.ray];
            let places = blocks.chunks(LANES).map(|blocks| {
                let [mut x, mut y] = [[f64::NAN; LANES]; 2];
                for (lane, number) in blocks.iter().enumerate() {
                    [x[lane], y[lane]] = self.leaves.blocks[*number as usize].nearest(peak.at);
                }
                [x, y]
            });
            let sent = would_send(&self.asker, places, &one.point);
            for ((worth, number), sent) in worth.iter_mut().zip(blocks).zip(&sent) {
                *worth += peak.weigh(sent) * self.leaves.blocks[*number as usize].part();
            }
        }
        worth
    }

    /// Finds what lies in trees and hides those of the points of each ray's rung that are `asked`.
    fn look(&self, rungs: &[AskedRung], asked: &[u16], asking: &mut [Asking], counts: &mut Counts) {
        let asker = &self.asker;
        let mut beams: Vec<RungRays> = Vec::new();
        for (one, rung) in asking.iter_mut().zip(rungs).filter(|(one, _)| one.view.trees) {
            beams.push(RungRays { point: Viewpoint::of(&one.point), rung, hidden: &mut one.view.hidden });
        }
        counts.visibility.traced += beams::trace(asker.scene, asker.target.end(), asked, &mut beams);
        for (one, rung) in asking.iter_mut().zip(rungs).filter(|(one, _)| !one.view.trees) {
            counts.visibility.traced += asker.mask(rung, asked, &mut one.view, &Viewpoint::of(&one.point));
        }
        let points = asked.iter().map(|bits| u64::from(bits.count_ones())).sum::<u64>() * asking.len() as u64;
        counts.shadow_rays += points;
        counts.shadow_rays_skipped += points;
    }
}

/// Where a ray finds the most.
struct Peak {
    ray: usize,
    at: FineCell,
    /// What each kind of light counts for.
    weights: [f32; MOMENTS],
    /// What the light sends to the ray.
    sends: f32,
}

impl Peak {
    fn of(ray: usize, one: &Asking, asker: &Asker) -> Peak {
        let weights = (one.scale * one.point.bsdf.colors).0.map(largest);
        let measure = asker.area.stands_for();
        let mut peak = Peak { ray, at: one.tally.most(asker.level, &weights), weights, sends: 0.0 };
        peak.sends = peak.weigh(&one.sent(measure)) / measure;
        if one.tally.sending == 0.0 && peak.sends > 0.0 {
            peak.look(one, asker);
        }
        peak
    }

    /// Looks for it where no point sends anything: beside the foot of the ray's place on a light that is near it, which
    /// may be below the horizon. So it is looked for nearest to places above, each a quarter as high as the one before.
    fn look(&mut self, one: &Asking, asker: &Asker) {
        let height = |k: usize| f64::from(asker.area.diagonal()) / (1u64 << (2 * k)) as f64;
        let above = |k: usize| one.point.p.as_dvec3() + one.point.horizon.as_dvec3() * height(k);
        let at: [FineCell; LANES] = std::array::from_fn(|k| FineCell::of(asker.area.nearest(above(k))));
        let sent = would_send(asker, std::iter::once(FineCell::middles(&at)), &one.point);
        let mut most = 0.0;
        for (at, sent) in at.into_iter().zip(&sent) {
            let sent = self.weigh(sent);
            if sent > most {
                (most, self.at) = (sent, at);
            }
        }
    }

    fn weigh(&self, sent: &Moments) -> f32 {
        sent.0.iter().zip(&self.weights).map(|(sent, weight)| sent * weight).sum()
    }
}

fn largest(color: Rgb) -> f32 {
    color.r.max(color.g).max(color.b)
}

/// What some of the points of all rays send, as parts of what all do.
pub(super) fn parts(asking: &[Asking], of: fn(&Tally) -> &[f64; MOMENTS]) -> [f32; MOMENTS] {
    std::array::from_fn(|k| {
        let sum = |of: fn(&Tally) -> &[f64; MOMENTS]| asking.iter().map(|one| of(&one.tally)[k]).sum::<f64>();
        let all = sum(|tally| &tally.all);
        if all > 0.0 { (sum(of) / all) as f32 } else { 0.0 }
    })
}
