//! The points of a light that receivers sample: where they are, what each would send, and which are occluded.
//!
//! [`LightSampler`] is all that the estimator knows of a light: a light of another kind is another sampler. Of an area
//! light there are sixteen series of points, stratified each by itself and together. A [`LightPoints`] holds one point
//! of a series in each of as many strata of the light's parameter square as it has points, or one more in each. Sets of
//! up to [`MOST_KEPT`] points are those of a sequence, and kept; of larger ones only the blocks that are needed are
//! made.
//!
//! Source of packets of shadow rays: Wald, Benthin, Slusallek, Wagner, "Interactive rendering with coherent ray
//! tracing", 2001.

use std::borrow::Cow;
use std::sync::OnceLock;

use fearless_simd::{Level, f32x16, mask32x16, prelude::*};

use super::strata::{BlockSamples, StratumSums};
use crate::accel::{RayPacket16, dispatch_all};
use crate::color::Rgb;
use crate::integrate::{Emitter, TOLERANCE};
use crate::light::{Area, FineCell, MIN_DISTANCE2, Points, SERIES, SeriesPart};
use crate::material::{Colors, LobeLanes, Moments, PerMoment, ShadingPoint};
use crate::math::{DVec3, LANES, LightEnd, ShadowRay, Vec3, Vec3x16};
use crate::render::Counts;
use crate::render::lanes::PointObstacles;
use crate::scene::{Scene, ShadowRays};
use crate::shape::BumpShadowing;
use crate::visibility::{ShadowView, Target, Viewpoint};

/// Points of the smallest set, and of the largest that is kept.
pub(super) const FEWEST: usize = 16;
pub(super) const MOST_KEPT: usize = 1 << 11;
const SIZES: usize = (MOST_KEPT / FEWEST).ilog2() as usize + 1;

/// The sets of points of one light that are kept, each made when it is first needed: by series and by size, those that
/// begin a series, and those that add a second point to each stratum.
#[derive(Default)]
pub(crate) struct LightPointSets([[[OnceLock<Box<LightPoints>>; 2]; SIZES]; SERIES]);

/// Points of one light, each in its stratum, in the order of the strata.
#[derive(Clone)]
pub(crate) struct LightPoints {
    points: Points,
    /// Where they are in the light's parameter square, sixteen by sixteen.
    pub cells: Vec<[FineCell; LANES]>,
    /// The same points for masks.
    target: OnceLock<Target>,
}

/// A point of a surface for which points of a light are sampled.
pub(crate) struct SampledReceiver {
    pub point: ShadingPoint,
    /// What the moments of the light are multiplied with, before the colours of the surface.
    scale: Rgb,
    /// The series of points that it samples.
    pub series: usize,
    /// What may occlude the light.
    pub view: ShadowView,
    /// The unoccluded integral, where it is known in closed form.
    pub unoccluded: Option<Moments>,
    /// Of its samples.
    pub sums: StratumSums,
}

impl SampledReceiver {
    pub fn new(point: &ShadingPoint, scale: Rgb, series: usize, view: ShadowView) -> Self {
        let point = ShadingPoint { closed_form_budget: f32::INFINITY, ..*point };
        SampledReceiver { point, scale, series, view, unoccluded: None, sums: StratumSums::default() }
    }

    /// The receiver as a part of a pixel.
    pub fn place(&self, share: f32) -> ShadingPoint {
        ShadingPoint { share, ..self.point }
    }

    /// The light that each moment adds to the pixel.
    pub fn each(&self, moments: &Moments) -> Colors {
        self.colors().each(moments)
    }

    /// What one unit of each moment adds to the pixel.
    pub fn colors(&self) -> Colors {
        self.scale * self.point.bsdf.colors
    }

    /// Whether the surface reflects light of a moment.
    pub fn reflects(&self, moment: usize) -> bool {
        self.colors().0[moment] != Rgb::BLACK
    }

    /// The unoccluded integral: in closed form, or as points of a light of such a measure estimate it.
    pub fn unoccluded(&self, measure: f32) -> Moments {
        self.unoccluded.unwrap_or_else(|| PerMoment(self.sums.sent.map(|sent| sent as f32 * measure)))
    }
}

/// One light, as it is sampled.
#[derive(Clone, Copy)]
pub(crate) struct LightSampler<'a> {
    pub scene: &'a Scene,
    pub level: Level,
    pub area: &'a Area,
    /// Its closed form, if it has one.
    pub emitter: Option<&'a Emitter>,
    pub target: &'a Target,
    pub sets: &'a LightPointSets,
}

impl<'a> LightSampler<'a> {
    /// What all points of the light together stand for: moments are means over its points times that.
    pub fn measure(&self) -> f32 {
        self.area.stands_for()
    }

    /// How far so many points of the light are apart.
    pub fn spacing(&self, points: f32) -> f32 {
        self.area.diagonal() / points.sqrt()
    }

    /// Whether what the light sends to a point varies over no less than `apart` metres, on the light.
    pub fn varies_over(&self, point: &ShadingPoint, apart: f32) -> bool {
        self.emitter.is_some_and(|emitter| emitter.nearest(point) >= apart)
    }

    /// Where shadow rays to the light end.
    pub fn end(&self) -> LightEnd {
        self.target.end()
    }

    /// Whether the set that adds a point to each of 2^`level` strata is kept.
    pub fn keeps(level: u32) -> bool {
        2 << level <= MOST_KEPT
    }

    /// The first points of a series, one in each of so many strata.
    pub fn first(&self, series: usize, strata: usize) -> Cow<'a, LightPoints> {
        self.kept(series, 0, strata)
    }

    /// One more point of a series in each of 2^`level` strata or, where that set is not kept, in each of those strata
    /// whose first points are `at`.
    pub fn second<'t>(
        &self,
        series: usize,
        level: u32,
        at: impl Iterator<Item = &'t [FineCell; LANES]>,
    ) -> Cow<'a, LightPoints> {
        if Self::keeps(level) {
            return self.kept(series, 1 << level, 1 << level);
        }
        let mut cells = Vec::new();
        let points = dispatch_all!(self.level, _simd => {
            for at in at {
                cells.push(FineCell::seconds(at, series, level));
            }
            self.area.points_at(cells.iter().map(FineCell::middles))
        });
        Cow::Owned(LightPoints { points, cells, target: OnceLock::new() })
    }

    /// Point `k` of the first of a series in so many strata.
    pub fn point(&self, series: usize, strata: usize, k: usize) -> Vec3 {
        self.first(series, strata).points.get(k)
    }

    /// The points of a series from number `first` on, one in each of so many strata.
    fn kept(&self, series: usize, first: usize, strata: usize) -> Cow<'a, LightPoints> {
        let kept = &self.sets.0[series][(strata / FEWEST).ilog2() as usize][usize::from(first > 0)];
        Cow::Borrowed(kept.get_or_init(|| {
            let SeriesPart { places, cells } = SeriesPart::new(series, first as u32, strata as u32);
            Box::new(LightPoints { points: self.area.points_at(places.into_iter()), cells, target: OnceLock::new() })
        }))
    }

    /// Finds which points of its set things in trees hide from each receiver, of those whose bits are set in `wanted`.
    pub fn occlude(
        &self,
        sets: &[Cow<LightPoints>],
        wanted: &[u16],
        receivers: &mut [SampledReceiver],
        counts: &mut Counts,
    ) {
        let points = wanted.iter().map(|bits| u64::from(bits.count_ones())).sum::<u64>() * receivers.len() as u64;
        let traced_before = counts.visibility.traced;
        let mut traced = Vec::new();
        for (number, (receiver, set)) in receivers.iter_mut().zip(sets).enumerate() {
            let (view, point) = (&mut receiver.view, Viewpoint::of(&receiver.point));
            view.hidden.clear();
            if view.trees {
                view.hidden.resize(wanted.len(), 0);
                traced.push((number as u32, point));
            } else if view.needs_mask() {
                let target = set.target.get_or_init(|| self.target.with_neighbours(self.level, &set.points));
                counts.visibility.traced += view.mask(self.level, self.scene, target, Some(wanted), &point);
            }
        }
        if let Some((_, any)) = traced.first() {
            let mut packet = Packet::new(self.end(), any);
            let mut hide = |receiver: u32, k: u32| {
                receivers[receiver as usize].view.hidden[k as usize / LANES] |= 1 << (k as usize % LANES);
            };
            // The rays to one stratum are nearly parallel
            let is_wanted = |k: &usize| wanted[k / LANES] >> (k % LANES) & 1 == 1;
            for k in (0..wanted.len() * LANES).filter(is_wanted) {
                for (number, point) in &traced {
                    let l = sets[*number as usize].points.get(k) - point.p;
                    if point.horizon.dot(l) > 0.0 && packet.add(*number, point, l, k as u32) {
                        counts.visibility.traced += packet.trace(self.scene, &mut hide);
                    }
                }
            }
            counts.visibility.traced += packet.trace(self.scene, hide);
        }
        self.dim(sets, wanted, receivers, counts);
        counts.shadow_rays += points;
        counts.shadow_rays_skipped += points - (counts.visibility.traced - traced_before);
    }

    /// Finds what layers let through to each receiver of the wanted points of its set.
    fn dim(&self, sets: &[Cow<LightPoints>], wanted: &[u16], receivers: &mut [SampledReceiver], counts: &mut Counts) {
        let mut dimmed = Vec::new();
        for (number, receiver) in receivers.iter_mut().enumerate() {
            receiver.view.left.clear();
            if receiver.view.layers {
                receiver.view.left.resize(wanted.len(), [1.0; LANES]);
                dimmed.push((number as u32, Viewpoint::of(&receiver.point)));
            }
        }
        let Some((_, any)) = dimmed.first() else { return };
        let mut packet = Packet::new(self.end(), any);
        // The rays to one stratum are nearly parallel
        let is_wanted = |k: &usize| wanted[k / LANES] >> (k % LANES) & 1 == 1;
        for k in (0..wanted.len() * LANES).filter(is_wanted) {
            for (number, point) in &dimmed {
                let hidden = receivers[*number as usize].view.hidden.get(k / LANES).copied().unwrap_or(0);
                let l = sets[*number as usize].points.get(k) - point.p;
                if hidden >> (k % LANES) & 1 == 0
                    && point.horizon.dot(l) > 0.0
                    && packet.add(*number, point, l, k as u32)
                {
                    counts.shadow_rays += packet.dim_all(self.scene, receivers);
                }
            }
        }
        counts.shadow_rays += packet.dim_all(self.scene, receivers);
    }

    /// What points at some places of the parameter square would send to a receiver, each for all of the light.
    pub fn unoccluded_at(
        &self,
        receiver: &SampledReceiver,
        places: impl Iterator<Item = [[f64; LANES]; 2]>,
    ) -> Vec<Moments> {
        let mut sent = Vec::new();
        dispatch_all!(self.level, simd => {
            let lanes = ReceiverLanes::new(simd, self, receiver);
            let points = self.area.points_at(places);
            for block in 0..points.blocks.len() {
                let samples = lanes.sample_points(simd, &points, block);
                sent.extend((0..LANES).map(|lane| samples.moments(lane)));
            }
        });
        sent
    }

    /// The places of points of the light that are near a receiver, where those right beside it are below its horizon:
    /// each is nearest to a point that is a quarter as high over the surface as the one before.
    pub fn near(&self, receiver: &SampledReceiver) -> [FineCell; LANES] {
        let height = |k: usize| f64::from(self.area.diagonal()) / (1u64 << (2 * k)) as f64;
        let above = |k: usize| -> DVec3 { receiver.point.p.as_dvec3() + receiver.point.horizon.as_dvec3() * height(k) };
        std::array::from_fn(|k| FineCell::of(self.area.nearest(above(k))))
    }
}

/// A receiver in all lanes, and the light that it samples.
pub(super) struct ReceiverLanes<'a, S: Simd> {
    area: &'a Area,
    bump_shadowing: BumpShadowing,
    lobe: LobeLanes,
    occluders: PointObstacles<'a>,
    p: Vec3x16<S>,
    ns: Vec3x16<S>,
    wo: Vec3x16<S>,
    horizon: Vec3x16<S>,
    floor: f32x16<S>,
    cos_o: f32x16<S>,
}

impl<'a, S: Simd> ReceiverLanes<'a, S> {
    #[inline(always)]
    pub fn new(simd: S, sampler: &LightSampler<'a>, receiver: &'a SampledReceiver) -> Self {
        let point = &receiver.point;
        ReceiverLanes {
            area: sampler.area,
            bump_shadowing: point.bump_shadowing,
            lobe: LobeLanes::of(&point.bsdf.lobe),
            occluders: PointObstacles::of(&receiver.view),
            p: Vec3x16::splat(simd, point.p),
            ns: Vec3x16::splat(simd, point.ns),
            wo: Vec3x16::splat(simd, point.wo),
            horizon: Vec3x16::splat(simd, point.horizon),
            floor: simd.splat_f32x16(sampler.area.floor(point.p, point.error, point.horizon)),
            cos_o: simd.splat_f32x16(point.ns.dot(point.wo)),
        }
    }

    /// The samples of a block of a set, past what occludes them.
    #[inline(always)]
    pub fn sample(&self, simd: S, set: &LightPoints, block: usize) -> BlockSamples {
        let mut samples = self.sample_points(simd, &set.points, block);
        samples.at = set.cells[block];
        if samples.sends == 0 {
            return samples;
        }
        let l = self.ways(simd, &set.points, block);
        let distance2 = l.dot(l);
        let mut lit = mask32x16::from_bitmask(simd, u64::from(samples.sends));
        if let Some(hidden) = self.occluders.hidden.get(block) {
            lit &= !mask32x16::from_bitmask(simd, u64::from(*hidden));
        }
        for sphere in self.occluders.spheres {
            lit &= !sphere.blocks_lanes(l, distance2);
        }
        for flat in self.occluders.flats {
            lit &= !flat.blocks_lanes(l);
        }
        for disk in self.occluders.disks {
            lit &= !disk.blocks_lanes(l);
        }
        samples.hidden = samples.sends & !(lit.to_bitmask() as u16);
        samples
    }

    /// The part of each sample of a block that arrives, where layers dim any: 0 of those that are hidden. Samples that
    /// are dimmed count as hidden thereby where silhouettes are looked for; where layers dim neighbours differently,
    /// those that are dimmed more.
    pub fn dim(&self, samples: &mut BlockSamples, block: usize, left: &[[f32; LANES]]) -> [f32; LANES] {
        let is_lit = |lane: usize| samples.lit() >> lane & 1 == 1;
        let of_layers = left.get(block);
        let left: [f32; LANES] =
            std::array::from_fn(|lane| if is_lit(lane) { of_layers.map_or(1.0, |left| left[lane]) } else { 0.0 });
        let sending = (0..LANES).filter(|lane| samples.sends >> lane & 1 == 1);
        let (least, most) = sending.fold((1.0f32, 0.0f32), |(a, b), lane| (a.min(left[lane]), b.max(left[lane])));
        // What layers leave of a group differs by less than the error of a silhouette: none crosses it
        let border = if most - least > TOLERANCE.silhouette_groups { 0.5 * (least + most) } else { 1.0 };
        let dimmed = (0..LANES).filter(|lane| left[*lane] < border).fold(0, |bits, lane| bits | 1 << lane);
        samples.hidden = samples.sends & dimmed;
        left
    }

    /// The ways to the points of a block.
    #[inline(always)]
    fn ways(&self, simd: S, points: &Points, block: usize) -> Vec3x16<S> {
        let q = points.blocks[block].lanes(simd);
        let Vec3x16 { x, y, z } = self.p;
        Vec3x16 { x: q.x - x, y: q.y - y, z: q.z - z }
    }

    /// What the points of a block would send if nothing occluded them.
    #[inline(always)]
    fn sample_points(&self, simd: S, points: &Points, block: usize) -> BlockSamples {
        let zero = simd.splat_f32x16(0.0);
        let l = self.ways(simd, points, block);
        let height = self.ns.dot(l);
        let distance2 = l.dot(l);
        let is_above = height.simd_gt(zero)
            & self.horizon.dot(l).simd_gt(self.floor)
            & distance2.simd_ge(simd.splat_f32x16(MIN_DISTANCE2));
        let mut samples = BlockSamples::NONE;
        if is_above.all_false() {
            return samples;
        }
        let inverse_distance = simd.splat_f32x16(1.0) / distance2.sqrt();
        let weight = is_above.select(self.area.weight_lanes(points, block, l, inverse_distance), zero);
        samples.sends = weight.simd_gt(zero).to_bitmask() as u16;
        let weight = self.bump_shadowing.shadowed(weight, self.horizon.dot(l) * inverse_distance);
        let (cos_i, cos_io) = (height * inverse_distance, self.wo.dot(l) * inverse_distance);
        self.lobe.for_each_moment(
            [cos_i],
            self.cos_o,
            [cos_io],
            [weight],
            #[inline(always)]
            |moment, [value]| {
                is_above.select(value, zero).store_slice(&mut samples.sent[moment]);
            },
        );
        samples
    }
}

/// Up to sixteen shadow rays of any receivers towards one light.
pub(crate) struct Packet {
    to: LightEnd,
    from: [ShadowRay; LANES],
    /// The receivers that `from` holds: those of one packet are often those of the next.
    receivers: [u32; LANES],
    rays: RayPacket16,
    points: [u32; LANES],
    count: usize,
}

impl Packet {
    /// An empty one; `point` is any receiver.
    pub fn new(to: LightEnd, point: &Viewpoint) -> Packet {
        let from = [point.ray(to, Vec3::ZERO, true); LANES];
        let (receivers, points) = ([u32::MAX; LANES], [0; LANES]);
        Packet { to, from, receivers, rays: RayPacket16::ZERO, points, count: 0 }
    }

    /// Adds the ray along `l` from a receiver to a point of the light, both by their numbers; whether the packet is
    /// full.
    #[inline(always)]
    pub fn add(&mut self, receiver: u32, from: &Viewpoint, l: Vec3, point: u32) -> bool {
        let lane = self.count % LANES;
        if self.receivers[lane] != receiver {
            self.receivers[lane] = receiver;
            self.from[lane] = from.ray(self.to, l, true);
            for axis in 0..3 {
                self.rays.o[axis][lane] = from.start[axis];
            }
        }
        for axis in 0..3 {
            self.rays.d[axis][lane] = l[axis];
        }
        self.points[lane] = point;
        self.count += 1;
        self.count == LANES
    }

    /// Calls `dim` with receiver and point of each ray, and what layers let through, where that is not all: those that
    /// [`trace`](Self::trace) finds blocked included.
    pub fn dim(&self, scene: &Scene, mut dim: impl FnMut(u32, u32, f32)) {
        if self.count == 0 {
            return;
        }
        let (shadows, all) = self.shadows();
        let left = scene.left_by_layers16(&shadows, all);
        for lane in (0..self.count).filter(|lane| left[*lane] < 1.0) {
            dim(self.receivers[lane], self.points[lane], left[lane]);
        }
    }

    /// Stores what layers leave of each ray in the views of its receiver, and empties the packet. Returns the number of
    /// rays.
    fn dim_all(&mut self, scene: &Scene, receivers: &mut [SampledReceiver]) -> u64 {
        self.dim(scene, |receiver, point, left| {
            let lanes = &mut receivers[receiver as usize].view.left[point as usize / LANES];
            lanes[point as usize % LANES] = left;
        });
        std::mem::take(&mut self.count) as u64
    }

    /// Its rays, and which lanes have one.
    fn shadows(&self) -> (ShadowRays<'_>, u16) {
        let mut t_end = [0.0; LANES];
        for (lane, t_end) in t_end.iter_mut().enumerate().take(self.count) {
            *t_end = ShadowRay { l: self.rays.d(lane), ..self.from[lane] }.end();
        }
        let all = ((1u32 << self.count) - 1) as u16;
        (ShadowRays { from: &self.from, rays: self.rays.clone(), t_end }, all)
    }

    /// Traces the rays through the trees and empties the packet. `hide` takes receiver and point of each ray that is
    /// blocked. Returns the number of rays.
    pub fn trace(&mut self, scene: &Scene, mut hide: impl FnMut(u32, u32)) -> u64 {
        let count = self.count;
        if count == 0 {
            return 0;
        }
        let (shadows, all) = self.shadows();
        let mut hidden = scene.geometry.are_blocked(scene.level, &shadows, all);
        while hidden != 0 {
            let lane = hidden.trailing_zeros() as usize % LANES;
            hidden &= hidden - 1;
            hide(self.receivers[lane], self.points[lane]);
        }
        self.count = 0;
        count as u64
    }
}
