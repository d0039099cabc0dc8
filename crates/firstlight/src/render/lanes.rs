//! Sampled light in lanes: sixteen light samples at once, past the shapes that may occlude the light.
//!
//! The same numbers as [`Plain`](super::plain::Plain), operation by operation. A shape is left out where it is proved
//! to occlude nothing: a flat one that has the point and all of the light on one side of its plane, the sphere whose
//! outside the point lies on, a sphere that is wholly below the point's horizon.

use fearless_simd::{Level, f32x16, mask32x16, prelude::*};

use super::Counts;
use super::pixel::{Lighting, LobeSums};
use super::plain::Plain;
use crate::accel::RayPacket16;
use crate::accel::dispatch_all;
use crate::ids::LightId;
use crate::light::{Area, MIN_DISTANCE2, Points};
use crate::material::{LobeLanes, MOMENTS, ShadingPoint};
use crate::math::{LANES, LaneSum, LightEnd, ShadowRay, Vec3, Vec3x16};
use crate::scene::{Geometry, Listed, Scene, ShadowRays};
use crate::shape::{DiskShadow, ParallelogramShadow, PlaneSide, SphereShadow};
use crate::visibility::{ShadowView, Viewpoint};

/// Light, sixteen samples at a time.
pub(crate) struct Lanes {
    level: Level,
    /// The listed shapes that may occlude any light, seen from the shading point. Flat ones are not culled: they keep
    /// the index by which the side of each light is known.
    spheres: Vec<Listed<SphereShadow>>,
    flats: Vec<Listed<ParallelogramShadow>>,
    disks: Vec<Listed<DiskShadow>>,
    /// Those of them that may occlude the light that is summed.
    between: BetweenShapes,
}

/// The listed shapes that may occlude one light. Keeps its memory.
#[derive(Default)]
struct BetweenShapes {
    spheres: Vec<SphereShadow>,
    flats: Vec<ParallelogramShadow>,
    disks: Vec<DiskShadow>,
}

impl Lanes {
    pub fn new(level: Level) -> Self {
        Lanes { level, spheres: Vec::new(), flats: Vec::new(), disks: Vec::new(), between: BetweenShapes::default() }
    }
}

/// The shapes that may occlude one light, seen from one point.
#[derive(Clone, Copy, Default)]
pub(super) struct PointObstacles<'a> {
    pub spheres: &'a [SphereShadow],
    pub flats: &'a [ParallelogramShadow],
    pub disks: &'a [DiskShadow],
    /// All that lies in trees, and the light that it may occlude.
    pub trees: Option<(&'a Geometry, LightEnd)>,
    /// All that is not opaque, in a scene, and the light that it may dim.
    pub layers: Option<(&'a Scene, LightEnd)>,
    /// For each block of samples, those that are known to be hidden; empty if none are.
    pub hidden: &'a [u16],
}

impl<'a> PointObstacles<'a> {
    /// What is in a view whose samples are masked.
    pub fn of(view: &'a ShadowView) -> Self {
        let ShadowView { spheres, flats, disks, hidden, .. } = view;
        PointObstacles { spheres, flats, disks, hidden, ..PointObstacles::default() }
    }

    fn are_none(&self) -> bool {
        self.spheres.is_empty()
            && self.flats.is_empty()
            && self.disks.is_empty()
            && self.trees.is_none()
            && self.layers.is_none()
    }
}

/// The sums over the samples of an area light that no obstacle hides. One dispatch for all samples of a light: the
/// functions below are compiled for each instruction set, the rest once.
#[inline(never)]
pub(super) fn sum_area(level: Level, area: &Area, point: &ShadingPoint, obstacles: &PointObstacles) -> LobeSums {
    dispatch_all!(level, simd => gather_area(simd, area, area.points(), point, obstacles))
}

/// The sums over the `points` of an area light.
#[inline(always)]
fn gather_area<S: Simd>(
    simd: S,
    area: &Area,
    points: &Points,
    point: &ShadingPoint,
    obstacles: &PointObstacles,
) -> LobeSums {
    let splat = |v: f32| simd.splat_f32x16(v);
    let zero = splat(0.0);
    let p = Vec3x16::splat(simd, point.p);
    let (ns, wo) = (Vec3x16::splat(simd, point.ns), Vec3x16::splat(simd, point.wo));
    let horizon = Vec3x16::splat(simd, point.horizon);
    let one_horizon = point.horizon == point.ns;
    let floor = area.floor(point.p, point.error, point.horizon);
    let least = if one_horizon { floor } else { 0.0 };
    let cos_o = point.ns.dot(point.wo);
    let lobe = LobeLanes::of(&point.bsdf.lobe);
    let mut sums = [zero; MOMENTS];
    for (index, block) in points.blocks.iter().enumerate() {
        let q = block.lanes(simd);
        let l = Vec3x16 { x: q.x - p.x, y: q.y - p.y, z: q.z - p.z };
        // Above the horizon, and not the surface's own point
        let height = ns.dot(l);
        let distance2 = l.dot(l);
        let mut lit = height.simd_gt(least) & distance2.simd_ge(splat(MIN_DISTANCE2));
        if !one_horizon {
            lit &= horizon.dot(l).simd_gt(floor);
        }
        // Not hidden
        if let Some(hidden) = obstacles.hidden.get(index) {
            lit &= !mask32x16::from_bitmask(simd, u64::from(*hidden));
            if lit.all_false() {
                continue;
            }
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
        if lit.all_false() {
            continue;
        }
        if let Some((geometry, to)) = obstacles.trees {
            let mut ways = [[0.0; LANES]; 3];
            for (way, l) in ways.iter_mut().zip([l.x, l.y, l.z]) {
                l.store_slice(way);
            }
            let hidden = hidden_by_trees(simd.level(), geometry, point, to, ways, lit.to_bitmask() as u16);
            lit &= !mask32x16::from_bitmask(simd, hidden as u64);
            if lit.all_false() {
                continue;
            }
        }
        let left = match obstacles.layers {
            None => None,
            Some((scene, to)) => {
                let mut ways = [[0.0; LANES]; 3];
                for (way, l) in ways.iter_mut().zip([l.x, l.y, l.z]) {
                    l.store_slice(way);
                }
                let left = left_by_layers(scene, point, to, &ways, lit.to_bitmask() as u16);
                let left = f32x16::simd_from(simd, left);
                lit &= left.simd_gt(zero);
                if lit.all_false() {
                    continue;
                }
                Some(left)
            }
        };
        // The emission in this direction, times the lobe
        let inverse_distance = splat(1.0) / distance2.sqrt();
        let mut weight = area.weight_lanes(points, index, l, inverse_distance);
        if let Some(left) = left {
            weight *= left;
        }
        weight = point.bump_shadowing.shadowed(weight, horizon.dot(l) * inverse_distance);
        let cos_i = height * inverse_distance;
        let cos_io = wo.dot(l) * inverse_distance;
        lobe.for_each_moment(
            [cos_i],
            splat(cos_o),
            [cos_io],
            [weight],
            #[inline(always)]
            |moment, [value]| {
                sums[moment] += lit.select(value, zero);
            },
        );
    }
    LobeSums(sums.map(partials))
}

/// Which of the shadow rays `l` from a point, of the lanes in `active`, meet an occluder in the trees. Not inlined:
/// scenes without trees keep their loop small.
#[inline(never)]
fn hidden_by_trees(
    level: Level,
    geometry: &Geometry,
    point: &ShadingPoint,
    to: LightEnd,
    l: [[f32; LANES]; 3],
    active: u16,
) -> u16 {
    let from = Viewpoint::of(point).ray(to, Vec3::ZERO, true);
    geometry.are_blocked(level, &shadows_from(&from, l), active)
}

/// The parts of the light along the shadow rays `l` from a point, of the lanes in `active`, that layers let through.
#[inline(never)]
fn left_by_layers(
    scene: &Scene,
    point: &ShadingPoint,
    to: LightEnd,
    l: &[[f32; LANES]; 3],
    active: u16,
) -> [f32; LANES] {
    let from = Viewpoint::of(point).ray(to, Vec3::ZERO, true);
    scene.left_by_layers16(&shadows_from(&from, *l), active)
}

/// Shadow rays `l` from one point.
fn shadows_from(from: &ShadowRay, l: [[f32; LANES]; 3]) -> ShadowRays<'_> {
    let o = from.start.to_array().map(|o| [o; LANES]);
    let mut shadows =
        ShadowRays { from: std::slice::from_ref(from), rays: RayPacket16 { o, d: l }, t_end: [0.0; LANES] };
    for (lane, end) in shadows.t_end.iter_mut().enumerate() {
        *end = ShadowRay { l: shadows.rays.d(lane), ..*from }.end();
    }
    shadows
}

#[inline(always)]
fn partials<S: Simd>(v: f32x16<S>) -> LaneSum {
    let mut partials = [0.0; LANES];
    v.store_slice(&mut partials);
    LaneSum::from_partials(partials)
}

impl Lighting for Lanes {
    fn set_receiver(&mut self, scene: &Scene, point: &ShadingPoint) {
        let listed = &scene.occluders;
        let spheres = listed.spheres.iter().map(|sphere| sphere.map(|shape| shape.shadow(point.p, point.error)));
        self.spheres.clear();
        self.spheres.extend(spheres.filter(|sphere| !sphere.shape.is_below(point.horizon)));
        let flats = listed.flats.iter();
        self.flats.clear();
        self.flats.extend(flats.map(|flat| flat.map(|shape| shape.shadow(point.p, point.error))));
        let disks = listed.disks.iter();
        self.disks.clear();
        self.disks.extend(disks.map(|disk| disk.map(|shape| shape.shadow(point.p, point.error))));
    }

    fn gather(&mut self, scene: &Scene, index: usize, point: &ShadingPoint, counts: &mut Counts) -> LobeSums {
        let light = &scene.lights[index];
        // A single sample fills no lanes
        let Some(area) = light.area() else { return Plain.gather(scene, index, point, counts) };
        let id = LightId(index as u32);
        let BetweenShapes { spheres, flats, disks } = &mut self.between;
        spheres.clear();
        spheres.extend(scene.that_stop(&self.spheres, id).map(|(_, sphere)| sphere.shape));
        let sides = scene.occluders.sides(id);
        let is_between = |(i, flat): &(usize, &Listed<ParallelogramShadow>)| {
            !flat.shape.is_one_sided(sides.get(*i).copied().unwrap_or(PlaneSide::Both))
        };
        flats.clear();
        flats.extend(scene.that_stop(&self.flats, id).filter(is_between).map(|(_, flat)| flat.shape));
        disks.clear();
        disks.extend(scene.that_stop(&self.disks, id).map(|(_, disk)| disk.shape));
        let trees = scene.geometry.has_trees().then(|| (&*scene.geometry, scene.light_end(id)));
        let obstacles = if light.shadows && point.receives_shadow {
            let layers = scene.has_layers().then(|| (scene, scene.light_end(id)));
            PointObstacles { spheres, flats, disks, trees, layers, hidden: &[] }
        } else {
            PointObstacles::default()
        };
        let samples = area.samples() as u64;
        counts.shadow_rays += samples;
        if obstacles.are_none() {
            counts.shadow_rays_skipped += samples;
        }
        sum_area(self.level, area, point, &obstacles)
    }
}
