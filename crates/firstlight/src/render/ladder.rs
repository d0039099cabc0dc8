//! The points of area lights that are integrated behind things: for each light sixteen series of them, which are
//! stratified together, in rungs that each quadruple their number, up to [`LAST`]. To mask many points takes little
//! longer than to mask few: most of it goes by the number of occluders.
//!
//! Each rung holds all its points, ready for shafts and masks, so that any may be the next: how much of them is hidden
//! is found as for lights that are sampled ([`ShadowView::mask`]). What they send is tallied with and without what is
//! hidden, so that where all that a light would send is known exactly, the points only say which share of it arrives: a
//! ratio estimate.
//!
//! Sources: of the masks, Haines and Wallace 1991 (shaft culling); of ratio estimates, Cochran, "Sampling Techniques",
//! 1977, chapter 6; of the effective number of points, Kish 1965.

use std::ops::Range;
use std::sync::OnceLock;

use fearless_simd::{Level, dispatch, f32x16, mask32x16, prelude::*};

use super::lanes::PointObstacles;
use crate::light::{Area, MIN_DISTANCE2, Points, SERIES, series_by_cell};
use crate::material::{Lobe, MOMENTS, Moments};
use crate::math::{LANES, Vec3, Vec3x16};
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;
use crate::visibility::{ShadowView, Target, Viewpoint};

/// The points of the first rung, and of the last: all of a series.
pub(super) const FIRST: usize = 16;
pub(super) const LAST: usize = 1 << 12;
/// The ends that a rung can have.
const ENDS: usize = (LAST / FIRST).ilog2() as usize + 1;

/// The points of one light, series by series, each rung made when it is first asked for: by where it ends, and whether
/// it begins at the start of the series, at half of its end or at a quarter.
#[derive(Default)]
pub(super) struct Ladder {
    series: [[[OnceLock<Box<Rung>>; 3]; ENDS]; SERIES],
}

/// Some points of one light, in the order of its cells, each of which holds one: see [`series_by_cell`]. Of three
/// quarters of a series, the second of four comes first, then the half after it.
pub(super) struct Rung {
    pub points: Points,
    target: OnceLock<Target>,
}

impl Ladder {
    /// Some points of a series: up to [`FIRST`], or two, four, eight times as many, and so on up to [`LAST`].
    fn rung(&self, area: &Area, series: usize, range: Range<usize>) -> &Rung {
        let Range { start, end } = range;
        let begin = end.checked_div(start).map_or(0, |times| times.ilog2() as usize);
        self.series[series][(end / FIRST).ilog2() as usize][begin].get_or_init(|| {
            let (mut first, mut places) = (start, Vec::with_capacity(end - start));
            while first < end {
                let next = if first == 0 { end } else { 2 * first };
                places.extend(series_by_cell(series, first as u32, (next - first) as u32));
                first = next;
            }
            Box::new(Rung { points: area.points_at(&places), target: OnceLock::new() })
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

impl<'a> Asker<'a> {
    /// What is asked next of a series where `count` points are asked already and `to` are wanted: all of them at first,
    /// then up to `growth` times, two or four, what came before, or, beyond [`LAST`], the whole of another series,
    /// every `stride`-th.
    pub fn rung(&self, series: usize, stride: usize, count: usize, to: usize, growth: usize) -> &'a Rung {
        let series = series ^ ((count / LAST * stride) % SERIES);
        let range = match count {
            0 => 0..to.min(LAST),
            count if count < LAST => count..to.min(count * growth),
            _ => 0..LAST,
        };
        self.ladder.rung(self.area, series, range)
    }

    /// The point of a series of `count` that lies in one of its cells.
    pub fn point(&self, series: usize, count: usize, cell: usize) -> Vec3 {
        let rung = self.ladder.rung(self.area, series, 0..count);
        rung.points.get(cell)
    }

    /// Which points of a rung are hidden from a point, by what is in its view; says how many rays were traced.
    pub fn mask(&self, rung: &Rung, view: &mut ShadowView, point: &Viewpoint) -> u64 {
        let target = rung.target.get_or_init(|| self.target.with(&rung.points));
        view.mask(self.level, self.scene, target, point)
    }
}

/// What the points of one rung said, sixteen by sixteen: a bit for each that would send anything, and for each of those
/// that is hidden.
pub(super) type PointAnswers = Vec<[u16; 2]>;

/// What points of a light say, from one place: sums of what they would send, and of what of it arrives.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    all: [f64; MOMENTS],
    lit: [f64; MOMENTS],
    /// Of the squares of what they would send.
    squares: [f64; MOMENTS],
    /// How many points were asked, how many of them would send anything, and how many of those are hidden.
    pub count: usize,
    pub sending: usize,
    pub hidden: usize,
}

impl Tally {
    /// What arrives. `whole` is what would if nothing were in the way, if that is known; else points alone tell, each
    /// of which stands for `measure` over their number.
    pub fn sums(&self, whole: Option<&Moments>, measure: f32) -> Moments {
        let Some(whole) = whole else {
            let one = f64::from(measure) / self.count.max(1) as f64;
            return Moments(self.lit.map(|lit| (lit * one) as f32));
        };
        let share =
            |i: usize, whole: f32| if self.all[i] > 0.0 { whole * (self.lit[i] / self.all[i]) as f32 } else { 0.0 };
        Moments(std::array::from_fn(|k| share(k, whole.0[k])))
    }

    /// What would arrive if nothing were in the way, as far as points tell.
    pub fn whole(&self, measure: f32) -> Moments {
        let one = f64::from(measure) / self.count.max(1) as f64;
        Moments(self.all.map(|all| (all * one) as f32))
    }

    /// The effective number of points, of the diffuse part and of the highlight: as many that send alike would be as
    /// good.
    pub fn effective(&self) -> [f64; MOMENTS] {
        std::array::from_fn(|k| if self.squares[k] > 0.0 { self.all[k] * self.all[k] / self.squares[k] } else { 0.0 })
    }

    /// Adds the points of a rung, of which `view` says what is hidden in trees. `said` says it of all that hides then.
    pub fn ask(
        &mut self,
        asker: &Asker,
        rung: &Rung,
        view: &ShadowView,
        si: &SurfaceInteraction,
        lobe: &Lobe,
        said: &mut PointAnswers,
    ) {
        let obstacles = PointObstacles::of(view);
        said.clear();
        said.resize(rung.points.blocks.len(), [0; 2]);
        self.count += rung.points.blocks.len() * LANES;
        dispatch!(asker.level, simd => self.add(simd, asker.area, &rung.points, si, lobe, &obstacles, said));
    }

    /// Adds what some points of an area light send.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "a light, and a surface that it shines on")]
    fn add<S: Simd>(
        &mut self,
        simd: S,
        area: &Area,
        points: &Points,
        si: &SurfaceInteraction,
        lobe: &Lobe,
        obstacles: &PointObstacles,
        said: &mut [[u16; 2]],
    ) {
        let splat = |v: f32| simd.splat_f32x16(v);
        let zero = splat(0.0);
        let p = Vec3x16::splat(simd, si.lit_from);
        let (ns, wo) = (Vec3x16::splat(simd, si.ns), Vec3x16::splat(simd, si.wo));
        let horizon = Vec3x16::splat(simd, si.horizon);
        let floor = area.floor(si.lit_from, si.error, si.horizon);
        let cos_o = splat(si.ns.dot(si.wo));
        let mut sums = [[zero; 3]; MOMENTS];
        for (index, block) in points.blocks.iter().enumerate() {
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
            let hidden = sends & !lit.to_bitmask();
            self.sending += sends.count_ones() as usize;
            self.hidden += hidden.count_ones() as usize;
            said[index] = [sends as u16, hidden as u16];
            let add = |sent: f32x16<S>, [all, arrives, squares]: &mut [f32x16<S>; 3]| {
                *all += sent;
                *arrives += lit.select(sent, zero);
                *squares += sent * sent;
            };
            let cos_io = wo.dot(l) * inverse_distance;
            for (sum, [moment]) in sums.iter_mut().zip(lobe.moments_lanes([cos_i], cos_o, [cos_io], [weight])) {
                add(above.select(moment, zero), sum);
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
