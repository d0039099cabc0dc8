//! The points of area lights that are integrated behind things: for each light sixteen series of them, which are
//! stratified together, in rungs that each quadruple their number, up to [`LAST`]. To mask many points takes little
//! longer than to mask few: most of it goes by the number of occluders.
//!
//! Each rung holds all its points, ready for shafts and masks, so that any may be the next: how much of them is hidden
//! is found as for lights that are sampled ([`View::mask`]). What they send is tallied with and without what is hidden,
//! so that where all that a light would send is known exactly, the points only say which share of it arrives: a ratio
//! estimate.
//!
//! Sources: of the masks, Haines and Wallace 1991 (shaft culling); of ratio estimates, Cochran, "Sampling Techniques",
//! 1977, chapter 6; of the effective number of points, Kish 1965.

use std::ops::Range;
use std::sync::OnceLock;

use fearless_simd::{Level, dispatch, f32x16, mask32x16, prelude::*};

use super::lanes::Obstacles;
use crate::integrate::Sums;
use crate::light::{Area, MIN_DISTANCE2, Points, SERIES};
use crate::material::Lobe;
use crate::math::{LANES, Vec3x16};
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;
use crate::visibility::{Target, View, Viewpoint};

/// The points of the first rung, and of the last: all of a series.
pub(super) const FIRST: usize = 64;
pub(super) const LAST: usize = FIRST * GROWTH.pow(RUNGS as u32 - 1);
/// How many times as many there are with each rung.
pub(super) const GROWTH: usize = 4;
const RUNGS: usize = 4;

/// The points of one light, series by series, each rung made when it is first asked for.
#[derive(Default)]
pub(super) struct Ladder {
    series: [[OnceLock<Rung>; RUNGS]; SERIES],
}

/// Some points of one light.
struct Rung {
    points: Points,
    target: Target,
}

impl Ladder {
    /// The first so many points of a series, [`FIRST`] or [`GROWTH`] times as many once and again, up to [`LAST`].
    fn rung(&self, area: &Area, target: &Target, series: usize, count: usize) -> &Rung {
        self.series[series][(count / FIRST).ilog(GROWTH) as usize].get_or_init(|| {
            let points = area.points_of_series(series, count as u32);
            Rung { target: target.with(&points), points }
        })
    }
}

/// One light, as points ask for it.
#[derive(Clone, Copy)]
pub(super) struct Asker<'a> {
    pub scene: &'a Scene,
    pub level: Level,
    pub area: &'a Area,
    pub target: &'a Target,
    pub ladder: &'a Ladder,
}

/// What points of a light say, from one place: sums of what they would send, and of what of it arrives.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    all: [f64; 2],
    lit: [f64; 2],
    /// Of the squares of what they would send.
    squares: [f64; 2],
    /// How many points were asked, how many of them would send anything, and how many of those are hidden.
    pub count: usize,
    pub sending: usize,
    pub hidden: usize,
}

impl Tally {
    /// What arrives. `whole` is what would if nothing were in the way, if that is known; else points alone tell, each
    /// of which stands for `measure` over their number.
    pub fn sums(&self, whole: Option<&Sums>, measure: f32) -> Sums {
        let Some(whole) = whole else {
            let one = f64::from(measure) / self.count.max(1) as f64;
            return Sums { diffuse: (self.lit[0] * one) as f32, specular: (self.lit[1] * one) as f32 };
        };
        let share =
            |i: usize, whole: f32| if self.all[i] > 0.0 { whole * (self.lit[i] / self.all[i]) as f32 } else { 0.0 };
        Sums { diffuse: share(0, whole.diffuse), specular: share(1, whole.specular) }
    }

    /// What would arrive if nothing were in the way, as far as points tell.
    pub fn whole(&self, measure: f32) -> Sums {
        let one = f64::from(measure) / self.count.max(1) as f64;
        Sums { diffuse: (self.all[0] * one) as f32, specular: (self.all[1] * one) as f32 }
    }

    /// The effective number of points, of the diffuse part and of the highlight: as many that send alike would be as
    /// good.
    pub fn effective(&self) -> [f64; 2] {
        [0, 1].map(|k| if self.squares[k] > 0.0 { self.all[k] * self.all[k] / self.squares[k] } else { 0.0 })
    }

    /// Asks the first so many points of a series, a rung of it. Beyond [`LAST`] it goes on with other series, every
    /// `stride`-th, as a whole. Answers with what half as many said, and the number of points that rays were traced to.
    pub fn ask(
        &mut self,
        asker: &Asker,
        view: &mut View,
        si: &SurfaceInteraction,
        lobe: &Lobe,
        (series, stride): (usize, usize),
        to: usize,
    ) -> (Tally, u64) {
        if to <= LAST {
            *self = Tally::default();
        }
        let point = Viewpoint::of(si);
        let (mut half, mut traced) = (*self, 0);
        while self.count < to {
            let series = series ^ ((self.count / LAST * stride) % SERIES);
            let rung = asker.ladder.rung(asker.area, asker.target, series, to.min(LAST));
            traced += view.mask(asker.level, asker.scene, &rung.target, &point);
            let obstacles = Obstacles::of(view);
            let middle = (to / 2).saturating_sub(self.count) / LANES;
            let middle = middle.min(rung.points.blocks.len());
            for blocks in [0..middle, middle..rung.points.blocks.len()] {
                if self.count == to / 2 {
                    half = *self;
                }
                self.count += blocks.len() * LANES;
                dispatch!(asker.level, simd => self.add(simd, asker.area, &rung.points, blocks, si, lobe, &obstacles));
            }
        }
        (half, traced)
    }

    /// Adds what some blocks of the points of an area light send.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "a light, and a surface that it shines on")]
    fn add<S: Simd>(
        &mut self,
        simd: S,
        area: &Area,
        points: &Points,
        blocks: Range<usize>,
        si: &SurfaceInteraction,
        lobe: &Lobe,
        obstacles: &Obstacles,
    ) {
        let splat = |v: f32| simd.splat_f32x16(v);
        let zero = splat(0.0);
        let p = Vec3x16::splat(simd, si.lit_from);
        let (ns, wo) = (Vec3x16::splat(simd, si.ns), Vec3x16::splat(simd, si.wo));
        let horizon = Vec3x16::splat(simd, si.horizon);
        let floor = area.floor(si.lit_from, si.error, si.horizon);
        let cos_o = splat(si.ns.dot(si.wo));
        let mut sums = [[zero; 3]; 2];
        for index in blocks {
            let block = &points.blocks[index];
            let q = block.lanes(simd);
            let l = Vec3x16 { x: q.x - p.x, y: q.y - p.y, z: q.z - p.z };
            let height = ns.dot(l);
            let distance2 = l.dot(l);
            let above = height.simd_gt(zero) & horizon.dot(l).simd_gt(floor) & distance2.simd_ge(splat(MIN_DISTANCE2));
            if above.all_false() {
                continue;
            }
            let inverse_distance = splat(1.0) / distance2.sqrt();
            let weight = above.select(area.weight_lanes(points, index, l, inverse_distance), zero);
            let cos_i = height * inverse_distance;
            let mut lit = weight.simd_gt(zero);
            let sends = lit.to_bitmask();
            if let Some(hidden) = obstacles.hidden.get(index) {
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
            self.sending += sends.count_ones() as usize;
            self.hidden += (sends & !lit.to_bitmask()).count_ones() as usize;
            let add = |sent: f32x16<S>, [all, arrives, squares]: &mut [f32x16<S>; 3]| {
                *all += sent;
                *arrives += lit.select(sent, zero);
                *squares += sent * sent;
            };
            let [diffuse, specular] = &mut sums;
            add(above.select(cos_i * weight, zero), diffuse);
            if !matches!(lobe, Lobe::None) {
                let cos_io = wo.dot(l) * inverse_distance;
                let [lobe] = lobe.eval_lanes([cos_i], cos_o, [cos_io]);
                add(above.select(lobe * weight, zero), specular);
            }
        }
        for (k, [all, arrives, squares]) in sums.iter().enumerate() {
            let total = |v: &f32x16<S>| v.as_slice().iter().map(|v| f64::from(*v)).sum::<f64>();
            self.all[k] += total(all);
            self.lit[k] += total(arrives);
            self.squares[k] += total(squares);
        }
    }
}

/// How far points of which `effective` send alike may be wrong about the share of a light on one side of an edge: three
/// standard deviations of as many points in as many squares, since the edge runs through a root of them.
pub(super) fn of_edge(effective: f64) -> f32 {
    let root = effective.max(1e-9).sqrt();
    (1.0 / (root * root.sqrt())) as f32
}
