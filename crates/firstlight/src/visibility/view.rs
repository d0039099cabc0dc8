//! The occluders of a light as one point sees them, and the class of its visibility.

use fearless_simd::{Level, Simd};

use super::Viewpoint;
use super::occluders::OccluderList;
use super::shaft::Shaft;
use super::target::Target;
use crate::accel::{Aabb, dispatch_all};
use crate::math::{DVec3, ErrorBound, LANES, UNIT_ROUNDOFF, Vec3};
use crate::scene::{PlacedTarget, Scene, ShadowMesh};
use crate::shape::{
    Cover, DiskShadow, Eye, LightSeen, ParallelogramShadow, Placement, SeenTriangle, SphereShadow, TOGETHER,
};

/// How much of a light is visible from a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Visibility {
    /// All that is above the horizon.
    Full,
    /// Nothing: one occluder hides all of it.
    None,
    /// Nothing: it is below the horizon of the surface.
    BelowHorizon,
    /// It may be hidden in part, by occluders without a closed form, or nothing is known: each sample is tested.
    Partial,
    /// Only listed shapes may hide it: the part that they leave visible has a closed form.
    Listed,
}

/// The occluders that may hide a part of a light from one point. Keeps its memory.
#[derive(Debug, Default)]
pub(crate) struct ShadowView {
    pub spheres: Vec<SphereShadow>,
    pub flats: Vec<ParallelogramShadow>,
    pub disks: Vec<DiskShadow>,
    pub triangles: Vec<SeenTriangle>,
    /// Solids and point sets, by their index among placed things, each with its box in world space.
    pub others: Vec<(u32, Aabb)>,
    /// Whether rays have to be traced through all trees.
    pub trees: bool,
    /// Whether anything that is not opaque may dim some of the light.
    pub layers: bool,
    /// For each block of sixteen samples, a mask of the hidden ones, in the light's order.
    pub hidden: Vec<u16>,
    /// For each block of sixteen samples, the part of each that layers let through; empty without layers.
    pub left: Vec<[f32; LANES]>,
    leaves: Vec<u32>,
    /// The same in the order of the blocks of the target, while it is computed.
    pub(super) in_space: Vec<u16>,
}

/// Error bound of a dot product, relative to the sum of the sizes of its terms.
const DOT: f32 = 16.0 * UNIT_ROUNDOFF;

impl ShadowView {
    /// Removes all occluders.
    pub fn clear(&mut self) {
        self.spheres.clear();
        self.flats.clear();
        self.disks.clear();
        self.triangles.clear();
        self.others.clear();
        self.hidden.clear();
        self.left.clear();
        self.trees = false;
        self.layers = false;
    }

    /// Whether any occluder is tested sample by sample: triangles, and what is in trees.
    pub fn needs_mask(&self) -> bool {
        self.trees || !self.triangles.is_empty() || !self.others.is_empty()
    }

    /// The visibility of a light from `point`, past `occluders`, which were gathered for it and maybe other points. The
    /// occluders that hide some of the light, or may, are in this view afterwards.
    pub fn classify(
        &mut self,
        level: Level,
        scene: &Scene,
        target: &Target,
        occluders: &OccluderList,
        point: &Viewpoint,
    ) -> Visibility {
        self.clear();
        let light = target.hull.from(point.p);
        if is_below(&light, point.horizon) || point.ns != point.horizon && is_below(&light, point.ns) {
            return Visibility::BelowHorizon;
        }
        for which in &occluders.spheres {
            let shadow = scene.sphere(*which).shadow(point.p, point.error);
            if shadow.is_below(point.horizon) {
                continue;
            }
            match shadow.covers(&light) {
                Cover::Nothing => {}
                Cover::All => return Visibility::None,
                Cover::Some => self.spheres.push(shadow),
            }
        }
        for (which, side) in &occluders.flats {
            let shadow = scene.flat(*which).shadow(point.p, point.error);
            if shadow.is_one_sided(*side) {
                continue;
            }
            match shadow.covers(&light) {
                Cover::Nothing => {}
                Cover::All => return Visibility::None,
                Cover::Some => self.flats.push(shadow),
            }
        }
        for disk in &occluders.disks {
            let shadow = scene.occluders.disks[*disk as usize].shape.shadow(point.p, point.error);
            match shadow.covers(&light) {
                Cover::Nothing => {}
                Cover::All => return Visibility::None,
                Cover::Some => self.disks.push(shadow),
            }
        }
        self.trees = occluders.too_many;
        self.layers = occluders.layers;
        if !occluders.leaves.is_empty() {
            let hidden = dispatch_all!(
                level,
                simd => self.classify_triangles(simd, scene, target, &light, occluders, point)
            );
            if hidden {
                return Visibility::None;
            }
        }
        if self.trees {
            return Visibility::Partial;
        }
        self.gather_others(scene, target, &light, occluders, point);
        let is_clear = self.spheres.is_empty() && self.flats.is_empty() && self.disks.is_empty() && !self.needs_mask();
        let is_clear = is_clear && !self.layers;
        if is_clear { Visibility::Full } else { Visibility::Partial }
    }

    /// Adds the solids and point sets whose boxes intersect the shaft of this point.
    fn gather_others(
        &mut self,
        scene: &Scene,
        target: &Target,
        light: &LightSeen,
        occluders: &OccluderList,
        point: &Viewpoint,
    ) {
        if occluders.others.is_empty() {
            return;
        }
        let shaft = Shaft::of(std::slice::from_ref(point), &[0], &target.hull);
        for &index in &occluders.others {
            let thing = &scene.geometry.placed[index as usize];
            if let PlacedTarget::Solid(solid) = thing.target
                && let Some((on, n)) = scene.geometry.solids[solid as usize].plane()
                && stays_before(&thing.placement, on, n, light, point)
            {
                continue;
            }
            let mut around = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
            if let Some(bounds) = scene.geometry.bounds_of(thing.target) {
                let start = point.start.as_dvec3();
                let [low, high] = thing.placement.bounds(bounds);
                let far = (high - start).abs().max((low - start).abs()).max_element();
                if !shaft.meets(low, high, far * 1e-5) {
                    continue;
                }
                // Covers the rounding of rays in single precision
                let room = (far + start.abs().max_element()) * 1e-5;
                around = Aabb { min: (low - room).as_vec3(), max: (high + room).as_vec3() };
            }
            self.others.push((index, around));
        }
    }

    /// Adds the triangles that may hide some of the light. Returns whether one hides all of it.
    #[inline(always)]
    fn classify_triangles<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene,
        target: &Target,
        light: &LightSeen,
        occluders: &OccluderList,
        point: &Viewpoint,
    ) -> bool {
        let mut leaves = std::mem::take(&mut self.leaves);
        let is_hidden = occluders.leaves.chunk_by(|a, b| a.0 == b.0).any(|of_mesh| {
            leaves.clear();
            leaves.extend(of_mesh.iter().map(|leaf| leaf.1));
            ShadowMesh::of(&scene.geometry, of_mesh[0].0, target.light).is_some_and(|mesh| {
                let eye = eye(&mesh, light, point);
                classify_leaves(simd, &mesh, &eye, &leaves, point.but.of(mesh.source), &mut self.triangles)
            })
        });
        self.leaves = leaves;
        is_hidden
    }
}

/// The same for leaves of one mesh, without its triangle `but`. Not inlined: one copy for each instruction set is
/// enough.
#[inline(never)]
fn classify_leaves<S: Simd>(
    simd: S,
    mesh: &ShadowMesh,
    eye: &Eye,
    leaves: &[u32],
    but: u32,
    seen: &mut Vec<SeenTriangle>,
) -> bool {
    simd.vectorize(
        #[inline(always)]
        || {
            for four in leaves.chunks(TOGETHER) {
                let casts = |triangle| triangle != but && mesh.casts(triangle);
                if mesh.mesh.tree.look(simd, eye, four, mesh.source, &casts, seen) {
                    return true;
                }
            }
            false
        },
    )
}

/// The point and the light in the object space of a mesh.
fn eye(mesh: &ShadowMesh, light: &LightSeen, point: &Viewpoint) -> Eye {
    // Rays end short of the light by the rounding of both ends: `ShadowRay::end`
    let o = point.start.abs().element_sum();
    let part = if light.plane == Vec3::ZERO {
        1.0 + o / light.shortest
    } else {
        // The distance to the plane of the light is the same along all rays, but for rounding
        let (length, (middle, reach)) = (3.0 * light.longest, light.range(light.plane));
        (length + o) / (middle.abs() - reach - length * (8.0 * UNIT_ROUNDOFF)).max(0.0)
    };
    let short = 32.0 * UNIT_ROUNDOFF * 1.01 * part + 8.0 * UNIT_ROUNDOFF;
    let short = if short < 0.5 { 1.0 / (1.0 - short) * (1.0 + 8.0 * UNIT_ROUNDOFF) } else { f32::INFINITY };
    let (error, horizons) = (point.error.0.as_dvec3(), [point.horizon, point.ns]);
    let own = Eye { o: point.start, error, light: *light, short, horizons };
    let Some(placement) = mesh.placement else { return own };
    let m = &placement.object_from_world.matrix3;
    let way = |v: Vec3| (*m * v.as_dvec3()).as_vec3();
    let size = |v: Vec3| placement.error_in_object(ErrorBound(v.abs()));
    let sizes: DVec3 = size(light.l) + size(light.axes[0]) + size(light.axes[1]) + size(light.axes[2]);
    let seen = LightSeen::new(way(light.l), light.axes.map(way), light.finite);
    let upright = placement.world_from_object.matrix3.transpose();
    Eye {
        o: placement.line(point.start, light.l).o.as_vec3(),
        error: placement.error_in_object(point.error),
        light: LightSeen {
            frame: light.frame.map(way),
            radii: light.radii,
            longest: (sizes.max_element() * 1.0001) as f32,
            shortest: seen.shortest * 0.9999,
            ..seen
        },
        horizons: own.horizons.map(|n| (upright * n.as_dvec3()).as_vec3()),
        ..own
    }
}

/// Whether point and light are on one side of a plane through `on` with normal `n` in the object space of `placement`,
/// computed from the numbers that the intersection with the plane uses.
fn stays_before(placement: &Placement, on: DVec3, n: DVec3, light: &LightSeen, point: &Viewpoint) -> bool {
    let height = n.dot(placement.line(point.start, light.l).o - on);
    let across = placement.normal(n);
    let reach: f64 = light.axes.iter().map(|a| across.dot(a.as_dvec3()).abs()).sum();
    let room = across.abs().element_sum() * f64::from(light.longest) * 1e-6;
    let middle = across.dot(light.l.as_dvec3()) * height.signum();
    // The least height of the light over the plane, positive on the point's side
    let least = middle - reach - room;
    height == 0.0 || if light.finite { height.abs() * (1.0 - 1e-9) + least > 0.0 } else { least > 0.0 }
}

/// Whether all of a light is below the plane with normal `n`.
#[inline(always)]
fn is_below(light: &LightSeen, n: Vec3) -> bool {
    let (middle, reach) = light.range(n);
    middle + reach < -n.abs().element_sum() * light.longest * DOT
}
