//! The fast renderer: sixteen light samples at once, and only the shapes that can stand in the way.
//!
//! The same numbers as [`Plain`](super::plain::Plain), operation by operation. A shape is left out where it is proved
//! that it could not have answered "blocked": a flat one that has the point and all of the light on one side of its
//! plane, the sphere the point itself lies on the outside of, a sphere that is wholly below the point's horizon.

use fearless_simd::{Level, dispatch, f32x16, mask32x16, prelude::*};

use super::Counts;
use super::pixel::{Lighting, LobeSums};
use super::plain::Plain;
use crate::accel::RayPacket16;
use crate::light::{LightKind, MIN_DISTANCE2, Rectangle};
use crate::material::Lobe;
use crate::math::{LANES, LaneSum, ShadowRay, Vec3, Vec3x16};
use crate::scene::{Geometry, Scene, ShadowRays};
use crate::shape::{ParallelogramShadow, PlaneSide, SphereShadow, SurfaceInteraction};

/// Light, sixteen samples at a time.
pub(crate) struct Lanes {
    level: Level,
    /// Spheres that can stand between the surface looked around from and any light.
    spheres: Vec<SphereShadow>,
    /// All that is flat, as seen from that surface, by the index that tells on which side of it each light lies.
    flats: Vec<ParallelogramShadow>,
    /// Those of `flats` that can stand in the way of the light at hand.
    between: Vec<ParallelogramShadow>,
}

impl Lanes {
    pub fn new(level: Level) -> Self {
        Lanes { level, spheres: Vec::new(), flats: Vec::new(), between: Vec::new() }
    }
}

/// What can stand in the way of one light, seen from one surface.
#[derive(Clone, Copy, Default)]
pub(super) struct Obstacles<'a> {
    pub spheres: &'a [SphereShadow],
    pub flats: &'a [ParallelogramShadow],
    /// All that lies in trees.
    pub trees: Option<&'a Geometry>,
    /// For each block of samples, those that are known to be hidden; empty if none are.
    pub hidden: &'a [u16],
}

/// The sums over the points of a rectangle light that none of the `obstacles` hides. One dispatch for all samples of a light: what
/// is below is compiled for each instruction set, the rest once.
#[inline(never)]
pub(super) fn sum_rectangle(
    level: Level,
    rectangle: &Rectangle,
    si: &SurfaceInteraction,
    lobe: &Lobe,
    obstacles: &Obstacles,
) -> LobeSums {
    dispatch!(level, simd => gather_rectangle(simd, rectangle, si, lobe, obstacles))
}

/// The sums over the points of a rectangle light that none of the `obstacles` hides.
#[inline(always)]
fn gather_rectangle<S: Simd>(
    simd: S,
    rectangle: &Rectangle,
    si: &SurfaceInteraction,
    lobe: &Lobe,
    obstacles: &Obstacles,
) -> LobeSums {
    let splat = |v: f32| simd.splat_f32x16(v);
    let zero = splat(0.0);
    let p = Vec3x16::splat(simd, si.p);
    let (ng, ns, wo) = (Vec3x16::splat(simd, si.ng), Vec3x16::splat(simd, si.ns), Vec3x16::splat(simd, si.wo));
    let is_flat = si.ng == si.ns;
    let cos_o = si.ns.dot(si.wo);
    let shadow = si.shadow_ray(Vec3::ZERO, 1.0);
    let (mut diffuse, mut specular) = (zero, zero);
    for (i, block) in rectangle.blocks().iter().enumerate() {
        let l = Vec3x16 {
            x: f32x16::simd_from(simd, block.x) - p.x,
            y: f32x16::simd_from(simd, block.y) - p.y,
            z: f32x16::simd_from(simd, block.z) - p.z,
        };
        // Above the horizon, and not the surface's own point
        let height = ns.dot(l);
        let distance2 = l.dot(l);
        let mut lit = height.simd_gt(zero) & distance2.simd_ge(splat(MIN_DISTANCE2));
        if !is_flat {
            lit &= ng.dot(l).simd_gt(zero);
        }
        // Not hidden
        if let Some(hidden) = obstacles.hidden.get(i) {
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
        if lit.all_false() {
            continue;
        }
        if let Some(geometry) = obstacles.trees {
            lit &= !hidden_by_trees(simd, geometry, &shadow, l, lit.to_bitmask() as u16);
            if lit.all_false() {
                continue;
            }
        }
        // How much is sent this way, and what the surface makes of it
        let inverse_distance = splat(1.0) / distance2.sqrt();
        let weight = rectangle.weight_lanes(l, inverse_distance);
        let cos_i = height * inverse_distance;
        let cos_io = wo.dot(l) * inverse_distance;
        diffuse += lit.select(cos_i * weight, zero);
        if !matches!(lobe, Lobe::None) {
            specular += lit.select(lobe.eval_lanes(cos_i, cos_o, cos_io) * weight, zero);
        }
    }
    LobeSums { diffuse: partials(diffuse), specular: partials(specular) }
}

/// Which of the lanes in `active` something in the trees hides: `ray` says where they start, `l` where they lead.
#[inline(always)]
fn hidden_by_trees<S: Simd>(simd: S, geometry: &Geometry, ray: &ShadowRay, l: Vec3x16<S>, active: u16) -> mask32x16<S> {
    let mut shadows = ShadowRays { from: *ray, rays: RayPacket16::ZERO, t_end: [0.0; LANES] };
    for (axis, l) in [l.x, l.y, l.z].into_iter().enumerate() {
        shadows.rays.o[axis] = [ray.start[axis]; LANES];
        l.store_slice(&mut shadows.rays.d[axis]);
    }
    for (lane, end) in shadows.t_end.iter_mut().enumerate() {
        *end = ShadowRay { l: shadows.rays.d(lane), ..*ray }.end();
    }
    mask32x16::from_bitmask(simd, geometry.are_blocked(simd.level(), &shadows, active) as u64)
}

#[inline(always)]
fn partials<S: Simd>(v: f32x16<S>) -> LaneSum {
    let mut partials = [0.0; LANES];
    v.store_slice(&mut partials);
    LaneSum::from_partials(partials)
}

impl Lighting for Lanes {
    fn look_around(&mut self, scene: &Scene, si: &SurfaceInteraction) {
        self.spheres.clear();
        for sphere in &scene.obstacles {
            let shadow = sphere.shadow(si.p, si.error);
            if !shadow.is_below(si.ng) {
                self.spheres.push(shadow);
            }
        }
        self.flats.clear();
        self.flats.extend(scene.flat_obstacles.iter().map(|flat| flat.shadow(si.p, si.error)));
    }

    fn gather(
        &mut self,
        scene: &Scene,
        index: usize,
        si: &SurfaceInteraction,
        lobe: &Lobe,
        counts: &mut Counts,
    ) -> LobeSums {
        let light = &scene.lights[index];
        // A single sample fills no lanes
        let LightKind::Rectangle(rectangle) = &light.kind else {
            return Plain.gather(scene, index, si, lobe, counts);
        };
        self.between.clear();
        let sides = &scene.light_sides[index];
        for (i, flat) in self.flats.iter().enumerate() {
            if !flat.is_one_sided(sides.get(i).copied().unwrap_or(PlaneSide::Both)) {
                self.between.push(*flat);
            }
        }
        let trees = scene.geometry.has_trees().then_some(&*scene.geometry);
        let obstacles = if light.shadows && si.receives_shadow {
            Obstacles { spheres: &self.spheres, flats: &self.between, trees, hidden: &[] }
        } else {
            Obstacles::default()
        };
        let samples = rectangle.samples() as u64;
        counts.shadow_rays += samples;
        if obstacles.spheres.is_empty() && obstacles.flats.is_empty() && obstacles.trees.is_none() {
            counts.shadow_rays_skipped += samples;
        }
        sum_rectangle(self.level, rectangle, si, lobe, &obstacles)
    }
}
