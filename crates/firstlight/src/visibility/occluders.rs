//! The occluders between some points and a light, gathered once for all of the points.

use fearless_simd::{Level, Simd};

use super::Viewpoint;
use super::shaft::{Horizon, Shaft};
use super::target::Target;
use crate::accel::dispatch_all;
use crate::ids::LightId;
use crate::scene::{Geometry, MeshNumber, PlacedTarget, Scene, ShadowMesh, UpperItem};
use crate::shape::{Mesh, Parallelogram, PlaneSide, Sphere};

/// A sphere or parallelogram, by its index in the list of occluders or in the upper tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ShapeRef {
    Listed(u32),
    InTree(u32),
}

/// A superset of what occludes one light from a group of points, rounding included. Keeps its memory.
#[derive(Debug, Default)]
pub(crate) struct OccluderList {
    pub spheres: Vec<ShapeRef>,
    pub flats: Vec<(ShapeRef, PlaneSide)>,
    /// Disk lights that block, by their index in the list of occluders.
    pub disks: Vec<u32>,
    /// Leaves of the trees of meshes.
    pub leaves: Vec<(MeshNumber, u32)>,
    /// Solids and point sets, by their index among placed things.
    pub others: Vec<u32>,
    /// Whether the trees held more than the cap: the lists from trees are incomplete then, and rays have to be traced.
    pub too_many: bool,
    /// Whether anything that is not opaque may dim some of the light: it is not among the lists.
    pub layers: bool,
    /// Placed meshes whose boxes intersect the shaft.
    meshes: Vec<MeshNumber>,
}

/// Relative errors of the test of a sphere: in its radius, and in the distance.
pub(crate) const SPHERE_ROOM: [f64; 2] = [4e-4, 1e-5];

impl Scene {
    pub(crate) fn sphere(&self, which: ShapeRef) -> &Sphere {
        match which {
            ShapeRef::Listed(i) => &self.occluders.spheres[i as usize].shape,
            ShapeRef::InTree(i) => &self.geometry.spheres[i as usize].shape,
        }
    }

    pub(crate) fn flat(&self, which: ShapeRef) -> &Parallelogram {
        match which {
            ShapeRef::Listed(i) => &self.occluders.flats[i as usize].shape,
            ShapeRef::InTree(i) => &self.geometry.parallelograms[i as usize].shape,
        }
    }
}

impl OccluderList {
    pub fn clear(&mut self) {
        self.spheres.clear();
        self.flats.clear();
        self.disks.clear();
        self.leaves.clear();
        self.others.clear();
        self.meshes.clear();
        self.too_many = false;
        self.layers = false;
    }

    /// Whether it holds anything from trees.
    pub fn has_trees(&self) -> bool {
        self.has_meshes() || !self.others.is_empty()
    }

    /// Whether it holds anything from trees that is neither a solid nor a point set.
    pub fn has_meshes(&self) -> bool {
        let is_in_tree = |which: &ShapeRef| matches!(which, ShapeRef::InTree(_));
        self.too_many
            || !self.leaves.is_empty()
            || self.spheres.iter().any(is_in_tree)
            || self.flats.iter().any(|(which, _)| is_in_tree(which))
    }

    /// The number of shapes and leaves.
    pub fn count(&self) -> usize {
        self.spheres.len() + self.flats.len() + self.disks.len() + self.leaves.len() + self.others.len()
    }

    /// Gathers the occluders between those of `points` in `indices` and a light: the listed shapes that cast shadows of
    /// it and may intersect the shaft, and at most `cap` leaves of triangles from the trees.
    pub fn gather(
        &mut self,
        level: Level,
        scene: &Scene,
        target: &Target,
        points: &[Viewpoint],
        indices: &[u32],
        cap: usize,
    ) {
        self.clear();
        let light = target.light;
        let shaft = Shaft::of(points, indices, &target.hull);
        let upright = Shaft { horizon: None, ..shaft };
        let meets = |sphere: &Sphere| {
            let [low, high] = sphere.bounds();
            let far = (low - shaft.points.min.as_dvec3()).abs().max((high - shaft.points.max.as_dvec3()).abs());
            let room = SPHERE_ROOM[0] * sphere.r + SPHERE_ROOM[1] * far.length();
            let below = |horizon: &Horizon| {
                let n = horizon.n.as_dvec3();
                n.dot(sphere.c) + n.length() * (sphere.r + room) < horizon.least
            };
            upright.meets(low, high, room) && !shaft.horizon.as_ref().is_some_and(below)
        };
        let listed = &scene.occluders;
        let spheres = scene.that_stop(&listed.spheres, light).filter(|(_, sphere)| meets(&sphere.shape));
        self.spheres.extend(spheres.map(|(i, _)| ShapeRef::Listed(i as u32)));
        self.disks.extend(scene.that_stop(&listed.disks, light).map(|(i, _)| i as u32));
        let sides = listed.sides(light);
        for (i, flat) in scene.that_stop(&listed.flats, light) {
            let side = sides.get(i).copied().unwrap_or(PlaneSide::Both);
            let one_sided = |k: &u32| {
                let point = &points[*k as usize];
                flat.shape.is_one_sided(point.p, point.error, side)
            };
            if !indices.iter().all(one_sided) {
                self.flats.push((ShapeRef::Listed(i as u32), side));
            }
        }
        self.layers = layers_within(level, scene, target, &shaft);
        if scene.geometry.has_trees() {
            self.too_many = !dispatch_all!(level, simd => self.gather_trees(simd, scene, target, &shaft, cap));
        }
    }

    /// Gathers from the trees. Returns whether that is all.
    #[inline(always)]
    fn gather_trees<S: Simd>(&mut self, simd: S, scene: &Scene, target: &Target, shaft: &Shaft, cap: usize) -> bool {
        let geometry = &*scene.geometry;
        if geometry.world.as_ref().is_some_and(|world| geometry.stops(world.shadow, target.light))
            && !self.gather_mesh(simd, geometry, 0, target.light, shaft, cap)
        {
            return false;
        }
        let casts = |surface| geometry.casts(surface, target.light);
        let stops = |thing: u32| geometry.stops(geometry.placed[thing as usize].shadow, target.light);
        for &thing in &geometry.unbounded {
            if stops(thing) {
                self.others.push(thing);
            }
        }
        if geometry.items.is_empty() {
            return true;
        }
        let upright = Shaft { horizon: None, ..*shaft };
        let mut found = 0;
        let all = geometry.upper.gather(
            simd,
            |center, half| upright.within(center, half).test(),
            #[inline(always)]
            |item| {
                found += 1;
                match geometry.items[item as usize] {
                    UpperItem::Sphere(i) if casts(geometry.spheres[i as usize].surface) => {
                        self.spheres.push(ShapeRef::InTree(i));
                    }
                    UpperItem::Parallelogram(i) if casts(geometry.parallelograms[i as usize].surface) => {
                        self.flats.push((ShapeRef::InTree(i), PlaneSide::Both));
                    }
                    UpperItem::Placed(i) if stops(i) => match geometry.placed[i as usize].target {
                        PlacedTarget::Mesh(_) => self.meshes.push(i + 1),
                        PlacedTarget::Points(_) | PlacedTarget::Solid(_) => self.others.push(i),
                    },
                    _ => {}
                }
                found <= cap
            },
        );
        if !all {
            return false;
        }
        for i in 0..self.meshes.len() {
            let source = self.meshes[i];
            let placement = &geometry.placed[source as usize - 1].placement;
            let own = shaft.in_object(placement, &target.hull);
            if !self.gather_mesh(simd, geometry, source, target.light, &own, cap) {
                return false;
            }
        }
        true
    }

    /// Gathers from the trees what intersects a shaft to a light: at most `cap` leaves. The same with every instruction
    /// set.
    #[inline(never)]
    pub fn gather_in(&mut self, level: Level, scene: &Scene, target: &Target, shaft: &Shaft, cap: usize) {
        self.clear();
        self.layers = layers_within(level, scene, target, shaft);
        self.too_many = !dispatch_all!(level, simd => self.gather_trees(simd, scene, target, shaft, cap));
    }

    /// Gathers the leaves of one mesh. Not inlined: one copy for each instruction set is enough.
    #[inline(never)]
    fn gather_mesh<S: Simd>(
        &mut self,
        simd: S,
        geometry: &Geometry,
        source: MeshNumber,
        light: LightId,
        shaft: &Shaft,
        cap: usize,
    ) -> bool {
        let Some(mesh) = ShadowMesh::of(geometry, source, light) else { return true };
        simd.vectorize(
            #[inline(always)]
            || {
                mesh.mesh.tree.gather(
                    simd,
                    |center, half| shaft.within(center, half).test(),
                    #[inline(always)]
                    |leaf| {
                        let room = self.leaves.len() < cap;
                        if room {
                            self.leaves.push((source, leaf));
                        }
                        room
                    },
                )
            },
        )
    }
}

/// Whether anything that is not opaque may lie in a shaft, and dim its light.
fn layers_within(level: Level, scene: &Scene, target: &Target, shaft: &Shaft) -> bool {
    let geometry = &*scene.geometry;
    let Some(layers) = &geometry.layers else { return false };
    let stops = |thing: u32| geometry.stops(geometry.placed[thing as usize].shadow, target.light);
    if layers.unbounded.iter().any(|thing| stops(*thing)) {
        return true;
    }
    let upright = Shaft { horizon: None, ..*shaft };
    // Whether all that is found is none
    let is_clear = dispatch_all!(level, simd => layers.upper.gather(
        simd,
        |center, half| upright.within(center, half).test(),
        #[inline(always)]
        |item| match layers.items[item as usize] {
            UpperItem::Sphere(i) => !geometry.casts(geometry.spheres[i as usize].surface, target.light),
            UpperItem::Parallelogram(i) => {
                !geometry.casts(geometry.parallelograms[i as usize].surface, target.light)
            }
            UpperItem::Placed(i) if !stops(i) => true,
            UpperItem::Placed(i) => match geometry.placed[i as usize].target {
                PlacedTarget::Mesh(mesh) => {
                    let own = shaft.in_object(&geometry.placed[i as usize].placement, &target.hull);
                    is_clear_of_mesh(simd, &geometry.meshes[mesh as usize], &own)
                }
                PlacedTarget::Points(_) | PlacedTarget::Solid(_) => false,
            },
        },
    ));
    !is_clear
}

/// Whether no leaf of a mesh may lie in a shaft of its space.
#[inline(never)]
fn is_clear_of_mesh<S: Simd>(simd: S, mesh: &Mesh, shaft: &Shaft) -> bool {
    simd.vectorize(
        #[inline(always)]
        || mesh.tree.gather(simd, |center, half| shaft.within(center, half).test(), |_| false),
    )
}
