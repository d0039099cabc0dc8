//! What may stand between some points and a light, gathered once for all of them.

use fearless_simd::{Level, Simd};

use super::Viewpoint;
use super::shaft::{Horizon, Shaft};
use super::target::{LightHull, Target};
use crate::accel::{Aabb, dispatch_all};
use crate::ids::{LightId, SurfaceId};
use crate::math::Vec3;
use crate::scene::{Geometry, Opacity, PlacedTarget, Scene, UpperItem};
use crate::shape::{Mesh, Parallelogram, Placement, PlaneSide, Sphere};

/// A sphere or parallelogram: of the lists of occluders, or of the upper tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Which {
    Listed(u32),
    InTree(u32),
}

/// A mesh in its place: 0 is that of the world, others are what is placed, counted from 1.
pub(crate) type MeshNumber = u32;

/// All that may stand between the points of a group and one light. What is not here does not, whatever rounding says.
#[derive(Debug, Default)]
pub(crate) struct OccluderList {
    pub spheres: Vec<Which>,
    pub flats: Vec<(Which, PlaneSide)>,
    /// Disk lights, as the scene lists them.
    pub disks: Vec<u32>,
    /// Leaves of the trees of meshes.
    pub leaves: Vec<(MeshNumber, u32)>,
    /// Solids and point sets, as they are placed.
    pub others: Vec<u32>,
    /// Whether the trees held more than was asked for: then they have to be asked ray by ray.
    pub too_many: bool,
    /// Meshes that the shaft leads through.
    meshes: Vec<MeshNumber>,
}

/// A mesh that casts shadows, in its place.
pub(crate) struct ShadowMesh<'a> {
    pub mesh: &'a Mesh,
    pub placement: Option<&'a Placement>,
    first: SurfaceId,
    opacity: Opacity,
    geometry: &'a Geometry,
    light: LightId,
}

impl<'a> ShadowMesh<'a> {
    /// With what of it stands in the way of a light.
    pub fn of(geometry: &'a Geometry, source: MeshNumber, light: LightId) -> Option<Self> {
        if source == 0 {
            let world = geometry.world.as_ref()?;
            let mesh = &world.mesh;
            return Some(ShadowMesh {
                mesh,
                placement: None,
                first: SurfaceId(0),
                opacity: world.shadow,
                geometry,
                light,
            });
        }
        let thing = &geometry.placed[source as usize - 1];
        let PlacedTarget::Mesh(mesh) = thing.target else { return None };
        let mesh = &geometry.meshes[mesh as usize];
        let (placement, first) = (Some(&thing.placement), thing.surface);
        Some(ShadowMesh { mesh, placement, first, opacity: thing.shadow, geometry, light })
    }

    /// Whether a triangle stands in the way of the light.
    #[inline(always)]
    pub fn casts(&self, triangle: u32) -> bool {
        self.geometry.triangle_casts(self.mesh, self.first, self.opacity, triangle, self.light)
    }
}

/// The sphere's own test is wrong by less than this part of the radius, and of the distance.
pub(crate) const SPHERE_ROOM: [f64; 2] = [4e-4, 1e-5];

impl Scene {
    pub(crate) fn sphere(&self, which: Which) -> &Sphere {
        match which {
            Which::Listed(i) => &self.occluders.spheres[i as usize].shape,
            Which::InTree(i) => &self.geometry.spheres[i as usize].shape,
        }
    }

    pub(crate) fn flat(&self, which: Which) -> &Parallelogram {
        match which {
            Which::Listed(i) => &self.occluders.flats[i as usize].shape,
            Which::InTree(i) => &self.geometry.parallelograms[i as usize].shape,
        }
    }
}

impl Shaft {
    /// From points to a light.
    pub fn of(points: &[Viewpoint], indices: &[u32], hull: &LightHull) -> Shaft {
        let mut starts = Aabb::EMPTY;
        let mut apart = Vec3::ZERO;
        let first = &points[indices[0] as usize];
        let mut horizon = Some(Horizon { n: first.horizon, least: f64::INFINITY });
        for point in indices.iter().map(|i| &points[*i as usize]) {
            // Some shapes are asked from the point itself
            starts = starts.with(point.start).with(point.p);
            apart = apart.max((point.start - point.p).abs() * 1.0001);
            match &mut horizon {
                Some(horizon) if horizon.n == point.horizon => {
                    let height = |v: Vec3| point.horizon.as_dvec3().dot(v.as_dvec3());
                    horizon.least = horizon.least.min(height(point.p)).min(height(point.start));
                }
                _ => horizon = None,
            }
        }
        let mut shaft = Shaft::between(starts, hull, apart);
        shaft.horizon = horizon;
        shaft
    }

    /// The same in the space of something placed.
    fn placed(&self, placement: &Placement, hull: &LightHull, apart: Vec3) -> Shaft {
        let m = &placement.object_from_world;
        let size = |v: Vec3| {
            let (a, v) = (&m.matrix3, v.as_dvec3());
            a.x_axis.abs() * v.x + a.y_axis.abs() * v.y + a.z_axis.abs() * v.z
        };
        let Aabb { min, max } = self.points;
        let middle = (min.as_dvec3() + max.as_dvec3()) * 0.5;
        let (center, half) = (m.transform_point3(middle), size((max - min) * 0.5) * (1.0 + 1e-6));
        // Rays start where single precision puts them
        let room = (center.abs() + half) * f64::from(f32::EPSILON);
        let points = Aabb { min: (center - half - room).as_vec3(), max: (center + half + room).as_vec3() };
        let hull = if hull.finite {
            LightHull {
                center: m.transform_point3(hull.center.as_dvec3()).as_vec3(),
                axes: hull.axes.map(|a| m.transform_vector3(a.as_dvec3()).as_vec3()),
                finite: true,
                is_ball: false,
                plane: Vec3::ZERO,
            }
        } else {
            LightHull { center: m.transform_vector3(hull.center.as_dvec3()).as_vec3(), ..*hull }
        };
        let apart = size(apart).as_vec3() + room.as_vec3() * 2.0;
        let mut shaft = Shaft::between(points, &hull, apart);
        if !hull.finite {
            // The rounding of the direction
            let room = shaft.low.abs() * f32::EPSILON;
            (shaft.low, shaft.high) = (shaft.low - room, shaft.high + room);
        }
        shaft.horizon = self.horizon.map(|horizon| {
            let n = (placement.world_from_object.matrix3.transpose() * horizon.n.as_dvec3()).as_vec3();
            let above = horizon.least - horizon.n.as_dvec3().dot(middle);
            Horizon { n, least: n.as_dvec3().dot(center) + above }
        });
        shaft
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
    }

    /// Whether something in trees may be in the way.
    pub fn has_trees(&self) -> bool {
        self.has_meshes() || !self.others.is_empty()
    }

    /// Whether something in trees may be that is neither a solid nor a point set.
    pub fn has_meshes(&self) -> bool {
        let is_in_tree = |which: &Which| matches!(which, Which::InTree(_));
        self.too_many
            || !self.leaves.is_empty()
            || self.spheres.iter().any(is_in_tree)
            || self.flats.iter().any(|(which, _)| is_in_tree(which))
    }

    /// How many things it holds: shapes and leaves.
    pub fn count(&self) -> usize {
        self.spheres.len() + self.flats.len() + self.disks.len() + self.leaves.len() + self.others.len()
    }

    /// Gathers what may stand between those of `points` in `indices` and a light: all listed shapes that cast shadows
    /// for it and are not proved to be out of the way, and of the trees at most `cap` leaves of triangles.
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
        self.spheres.extend(spheres.map(|(i, _)| Which::Listed(i as u32)));
        self.disks.extend(scene.that_stop(&listed.disks, light).map(|(i, _)| i as u32));
        let sides = listed.sides(light);
        for (i, flat) in scene.that_stop(&listed.flats, light) {
            let side = sides.get(i).copied().unwrap_or(PlaneSide::Both);
            let one_sided = |k: &u32| {
                let point = &points[*k as usize];
                flat.shape.is_one_sided(point.p, point.error, side)
            };
            if !indices.iter().all(one_sided) {
                self.flats.push((Which::Listed(i as u32), side));
            }
        }
        if scene.geometry.has_trees() {
            let gathered =
                dispatch_all!(level, simd => self.gather_trees(simd, scene, target, &shaft, points, indices, cap));
            self.too_many = !gathered;
        }
    }

    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the rest of `gather`")]
    fn gather_trees<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene,
        target: &Target,
        shaft: &Shaft,
        points: &[Viewpoint],
        indices: &[u32],
        cap: usize,
    ) -> bool {
        let geometry = &*scene.geometry;
        if geometry.world.as_ref().is_some_and(|world| geometry.stops(world.shadow, target.light))
            && !self.gather_mesh(simd, geometry, 0, target.light, shaft, cap)
        {
            return false;
        }
        let casts = |surface| geometry.casts(surface, target.light);
        let stands = |thing: u32| geometry.stops(geometry.placed[thing as usize].shadow, target.light);
        for &thing in &geometry.unbounded {
            if stands(thing) {
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
            #[inline(always)]
            |center, half| {
                let shaft = upright.within(center, half);
                #[inline(always)]
                move |simd, node: &_| shaft.meet(simd, node)
            },
            |item| {
                found += 1;
                match geometry.items[item as usize] {
                    UpperItem::Sphere(i) if casts(geometry.spheres[i as usize].surface) => {
                        self.spheres.push(Which::InTree(i));
                    }
                    UpperItem::Parallelogram(i) if casts(geometry.parallelograms[i as usize].surface) => {
                        self.flats.push((Which::InTree(i), PlaneSide::Both));
                    }
                    UpperItem::Placed(i) if stands(i) => match geometry.placed[i as usize].target {
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
        let apart = indices
            .iter()
            .map(|i| &points[*i as usize])
            .fold(Vec3::ZERO, |apart, point| apart.max((point.start - point.p).abs() * 1.0001));
        for i in 0..self.meshes.len() {
            let source = self.meshes[i];
            let placement = &geometry.placed[source as usize - 1].placement;
            let own = shaft.placed(placement, &target.hull, apart);
            if !self.gather_mesh(simd, geometry, source, target.light, &own, cap) {
                return false;
            }
        }
        true
    }

    /// Gathers what of the trees may stand between a light and the patch, `curved` or flat, that reaches `reach` around
    /// `point`: at most `cap` leaves.
    #[allow(clippy::too_many_arguments, reason = "a light of a scene, and a patch")]
    pub fn gather_around(
        &mut self,
        level: Level,
        scene: &Scene,
        target: &Target,
        point: &Viewpoint,
        reach: f32,
        curved: bool,
        cap: usize,
    ) {
        self.clear();
        let mut points = [*point; 2];
        if reach > 0.0 {
            for (point, side) in points.iter_mut().zip([-1.0, 1.0]) {
                point.p += Vec3::splat(reach * side);
                point.start += Vec3::splat(reach * side);
            }
            if curved {
                // It sees over what its middle does not
                points[1].horizon = -point.horizon;
            }
        }
        let indices = &[0, 1][..if reach > 0.0 { 2 } else { 1 }];
        let shaft = Shaft::of(&points, indices, &target.hull);
        self.gather_in(level, scene, target, &shaft, &points, indices, cap);
    }

    /// Gathers what of the trees lies in a shaft from those of `points` in `indices`: at most `cap` leaves. The same
    /// with every instruction set.
    #[inline(never)]
    #[allow(clippy::too_many_arguments, reason = "a light of a scene, and points")]
    pub fn gather_in(
        &mut self,
        level: Level,
        scene: &Scene,
        target: &Target,
        shaft: &Shaft,
        points: &[Viewpoint],
        indices: &[u32],
        cap: usize,
    ) {
        self.clear();
        let gathered =
            dispatch_all!(level, simd => self.gather_trees(simd, scene, target, shaft, points, indices, cap));
        self.too_many = !gathered;
    }

    /// The leaves of one mesh. Not inlined: one copy for each instruction set is enough.
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
                    #[inline(always)]
                    |center, half| {
                        let shaft = shaft.within(center, half);
                        #[inline(always)]
                        move |simd, node: &_| shaft.meet(simd, node)
                    },
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
