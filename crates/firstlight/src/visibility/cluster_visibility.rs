//! The visibility of a cluster of lights from a set of receivers, where it can be proved.
//!
//! Coarser than [`ShadowView`](super::ShadowView), for many receivers and many lights at once: it proves that no
//! occluder lies between, or that one convex occluder hides the whole cluster from all receivers.

use arrayvec::ArrayVec;
use fearless_simd::Level;

use super::occluders::OccluderList;
use super::shaft::{Horizon, Shaft};
use super::target::{LightHull, Target};
use super::{Viewpoint, Visibility};
use crate::accel::Aabb;
use crate::ids::LightId;
use crate::math::{DVec3, ErrorBound, Vec3};
use crate::scene::{Listed, Opacity, Placed, PlacedTarget, Scene, ShadowMesh};
use crate::shape::{Parallelogram, PlaneSide, Solid, Sphere};

/// A set of receivers, and the listed shapes that may occlude lights from them. Keeps its memory.
#[derive(Debug, Default)]
pub(crate) struct ClusterVisibility {
    /// The receivers and the origins of their shadow rays.
    bounds: Aabb,
    /// The largest distance of such an origin from its receiver, along each axis.
    apart: Vec3,
    /// The horizon of all receivers, if they have the same.
    horizon: Option<Horizon>,
    points: Vec<Viewpoint>,
    /// The rounding error of their positions, in metres.
    room: f32,
    /// Listed spheres that are not below all horizons.
    spheres: Vec<u32>,
    /// Listed parallelograms that do not hold all receivers, and on which side of each these lie.
    flats: Vec<(u32, PlaneSide)>,
    occluders: OccluderList,
}

/// Leaves of triangles, and other things in trees, that are tested one by one.
const MAX_LEAVES: usize = 4;
/// Spheres that are tested whether one of them hides the whole cluster.
const MAX_HIDING_SPHERES: usize = 4;
/// Relative rounding error of what is computed in f64 from numbers in f32.
const SLACK: f64 = 1e-6;

impl ClusterVisibility {
    /// Replaces the receivers. Each comes with the radius of the surface around it that it stands for, in metres, and
    /// whether that is curved.
    pub fn set_receivers(&mut self, scene: &Scene, receivers: impl Iterator<Item = (Viewpoint, f32, bool)>) {
        self.points.clear();
        (self.bounds, self.apart, self.room) = (Aabb::EMPTY, Vec3::ZERO, 0.0);
        let mut max_radius: f32 = 0.0;
        let mut is_flat = true;
        for (point, radius, curved) in receivers {
            for side in [-radius, radius] {
                self.bounds = self.bounds.with(point.p + side).with(point.start + side);
            }
            self.apart = self.apart.max(point.apart());
            self.room = self.room.max(point.error.0.length() * 4.0);
            max_radius = max_radius.max(radius);
            is_flat &= !curved;
            self.points.push(point);
        }
        self.horizon = Horizon::shared(self.points.iter()).filter(|_| is_flat);
        self.spheres.clear();
        let listed = (0..).zip(scene.occluders.surface_spheres());
        let points = &self.points;
        self.spheres.extend(listed.filter(|(_, sphere)| !is_below_horizons(points, &sphere.shape)).map(|(i, _)| i));
        self.flats.clear();
        for (i, flat) in scene.occluders.flats.iter().enumerate() {
            if let Some(side) = side_of(&flat.shape, &self.points, max_radius) {
                self.flats.push((i as u32, side));
            }
        }
    }

    /// The visibility of the box that holds the `lights` of a cluster, `light` being one of them: full or none where
    /// that is proved for all receivers and the whole box, `None` elsewhere.
    pub fn classify(&mut self, level: Level, scene: &Scene, lights: Aabb, light: LightId) -> Option<Visibility> {
        let Aabb { min: low, max: high } = lights;
        let middle = low + (high - low) * 0.5;
        let half = high - middle;
        let axes = [Vec3::new(half.x, 0.0, 0.0), Vec3::new(0.0, half.y, 0.0), Vec3::new(0.0, 0.0, half.z)];
        let hull = LightHull { axes, ..LightHull::at(middle, true) };
        let shaft = Shaft::between(self.bounds, &hull, self.apart);
        let size = self.bounds.min.abs().max(self.bounds.max.abs()).max(low.abs()).max(high.abs()).max_element();
        let room = f64::from(size) * SLACK;
        let listed = &scene.occluders;
        let stops = |opacity: Opacity| scene.geometry.stops(opacity, light);
        let capsule = Capsule::around(&self.bounds, middle, half);
        let mut clear = true;
        let mut hiding: ArrayVec<&Sphere, MAX_HIDING_SPHERES> = ArrayVec::new();
        for i in &self.spheres {
            let Listed { shape: sphere, opacity } = &listed.spheres[*i as usize];
            if capsule.misses(sphere) {
                continue;
            }
            let [a, b] = sphere.bounds();
            if stops(*opacity) && shaft.meets(a, b, room + sphere.r * 1e-4) {
                clear = false;
                let _ = hiding.try_push(sphere);
            }
        }
        for (i, side) in &self.flats {
            let Listed { shape: flat, opacity } = &listed.flats[*i as usize];
            if !stops(*opacity) || is_beside(flat, *side, middle, half, room) {
                continue;
            }
            let [a, b] = flat.bounds();
            if shaft.meets(a, b, room) {
                clear = false;
                if self.is_hidden_by_flat(flat, low, high) {
                    return Some(Visibility::None);
                }
            }
        }
        if hiding.iter().any(|sphere| self.is_hidden_by_sphere(sphere, low, high)) {
            return Some(Visibility::None);
        }
        clear &= !listed.disks.iter().any(|disk| stops(disk.opacity));
        for Listed { shape, opacity } in listed.light_spheres() {
            let [a, b] = shape.bounds();
            clear &= !stops(*opacity) || !shaft.meets(a, b, room + shape.r * 1e-4);
        }
        if !clear {
            return None;
        }
        if !scene.geometry.has_trees() && !scene.has_layers() {
            return Some(Visibility::Full);
        }
        let target = Target::without_samples(light, hull);
        let shaft = Shaft { horizon: self.horizon, ..shaft };
        self.occluders.gather_in(level, scene, &target, &shaft, MAX_LEAVES);
        self.classify_behind_trees(scene, &target, room)
    }

    /// The visibility past what was gathered of the trees.
    fn classify_behind_trees(&self, scene: &Scene, target: &Target, room: f64) -> Option<Visibility> {
        let found = &self.occluders;
        if found.too_many || found.layers {
            return None;
        }
        let Aabb { min, max } = target.hull.bounds();
        let (middle, half) = (min + (max - min) * 0.5, (max - min) * 0.5);
        let mut clear = true;
        for (which, _) in &found.flats {
            let flat = scene.flat(*which);
            if side_of(flat, &self.points, 0.0).is_none_or(|side| is_beside(flat, side, middle, half, room)) {
                continue;
            }
            if self.is_hidden_by_flat(flat, min, max) {
                return Some(Visibility::None);
            }
            clear = false;
        }
        for sphere in found.spheres.iter().map(|which| scene.sphere(*which)) {
            if is_below_horizons(&self.points, sphere) {
                continue;
            }
            if self.is_hidden_by_sphere(sphere, min, max) {
                return Some(Visibility::None);
            }
            clear = false;
        }
        let is_clear = clear
            && found.others.iter().all(|thing| {
                self.is_out_of_the_way(scene, &scene.geometry.placed[*thing as usize], middle, half, room)
            })
            && found.leaves.iter().all(|(source, leaf)| {
                let Some(mesh) = ShadowMesh::of(&scene.geometry, *source, target.light) else { return true };
                let mut triangles = mesh.mesh.tree.leaf(*leaf);
                triangles.all(|(triangle, corners)| {
                    let corners = corners.map(|q| mesh.in_world(q));
                    let edge = (corners[1] - corners[0]).length().max((corners[2] - corners[0]).length());
                    !mesh.casts(triangle) || corners.iter().all(|q| self.is_below(*q, room, edge * 1e-6))
                })
            });
        is_clear.then_some(Visibility::Full)
    }

    /// Whether a point is below the horizon that all receivers share.
    fn is_below(&self, q: DVec3, room: f64, more: f64) -> bool {
        self.horizon.is_some_and(|h| h.n.as_dvec3().dot(q) <= h.least + f64::from(self.room) + room + more)
    }

    /// Whether a solid is below all horizons, or a plane has all receivers and the box on one side.
    fn is_out_of_the_way(&self, scene: &Scene, placed: &Placed, middle: Vec3, half: Vec3, room: f64) -> bool {
        let PlacedTarget::Solid(solid) = placed.target else { return false };
        let solid = &scene.geometry.solids[solid as usize];
        let world = &placed.placement.world_from_object;
        if let Solid::Plane(plane) = solid {
            let (p, n) = plane.place();
            let p = world.transform_point3(p);
            let n = placed.placement.normal(n).normalize_or_zero();
            let height = |q: Vec3| n.dot(q.as_dvec3() - p);
            let margin = f64::from(self.room);
            let reach = n.abs().dot(half.as_dvec3()) + margin;
            let at = height(middle);
            let side =
                |sign: f64| self.points.iter().all(|point| sign * height(point.p) >= -margin) && sign * at >= reach;
            return side(1.0) || side(-1.0);
        }
        let Some([low, high]) = solid.bounds() else { return false };
        (0..8).all(|i| {
            self.is_below(world.transform_point3(corner(low.to_array(), high.to_array(), i).into()), room, 0.0)
        })
    }

    fn is_hidden_by_flat(&self, flat: &Parallelogram, low: Vec3, high: Vec3) -> bool {
        self.is_hidden_by(|p, l| flat.shadow(p, ErrorBound(Vec3::ZERO)).blocks(l, true), low, high)
    }

    fn is_hidden_by_sphere(&self, sphere: &Sphere, low: Vec3, high: Vec3) -> bool {
        self.is_hidden_by(|p, l| sphere.shadow(p, ErrorBound(Vec3::ZERO)).blocks(l, true), low, high)
    }

    /// Whether one convex occluder hides a whole box from all receivers: it does if it hides every corner of the box
    /// from every corner of theirs. The points that a convex occluder hides from one receiver are a convex set; and so
    /// are the receivers that it hides one point from.
    fn is_hidden_by(&self, blocks: impl Fn(Vec3, Vec3) -> bool, low: Vec3, high: Vec3) -> bool {
        let Aabb { min, max } = self.bounds;
        // A box without extent has one corner
        let corners = |min: Vec3, max: Vec3| if min == max { 1 } else { 8 };
        let at = |min: Vec3, max: Vec3, i: u32| Vec3::from(corner(min.to_array(), max.to_array(), i));
        let (places, ends) = (corners(min, max), corners(low, high));
        (0..ends).all(|j| {
            let q = at(low, high, j);
            (0..places).all(|i| {
                let p = at(min, max, i);
                blocks(p, q - p)
            })
        })
    }
}

/// Whether a sphere is below the horizon of every receiver.
fn is_below_horizons(points: &[Viewpoint], sphere: &Sphere) -> bool {
    points.iter().all(|point| sphere.shadow(point.p, point.error).is_below(point.horizon))
}

/// Corner `i` of a box.
fn corner<T: Copy>(low: [T; 3], high: [T; 3], i: u32) -> [T; 3] {
    std::array::from_fn(|axis| if i >> axis & 1 == 0 { low[axis] } else { high[axis] })
}

/// The points within a distance of a line segment: it holds the hull of the receivers and a box.
struct Capsule {
    from: Vec3,
    way: Vec3,
    inverse: f32,
    radius: f32,
}

impl Capsule {
    fn around(receivers: &Aabb, middle: Vec3, half: Vec3) -> Capsule {
        let around = (receivers.max - receivers.min) * 0.5;
        let from = receivers.min + around;
        let way = middle - from;
        let radius = around.length().max(half.length()) * 1.001;
        Capsule { from, way, inverse: 1.0 / way.length_squared().max(f32::MIN_POSITIVE), radius }
    }

    fn misses(&self, sphere: &Sphere) -> bool {
        let to = sphere.c.as_vec3() - self.from;
        let t = (to.dot(self.way) * self.inverse).clamp(0.0, 1.0);
        let aside = (to - self.way * t).length();
        aside > (sphere.r as f32 + self.radius) * 1.001 + to.length() * 1e-5
    }
}

/// On which side of a parallelogram's plane all points lie, each with what is within `radius` of it; `None` if all lie
/// in the plane.
fn side_of(flat: &Parallelogram, points: &[Viewpoint], radius: f32) -> Option<PlaneSide> {
    let (mut front, mut back, mut on) = (true, true, true);
    for point in points {
        let s = flat.n.dot(point.p.as_dvec3() - flat.p) as f32;
        let margin = flat.n.as_vec3().abs().dot(point.error.0);
        if s.abs() <= margin {
            continue;
        }
        on = false;
        front &= s > radius;
        back &= s < -radius;
    }
    match (on, front, back) {
        (true, ..) => None,
        (_, true, _) => Some(PlaneSide::Front),
        (.., true) => Some(PlaneSide::Back),
        _ => Some(PlaneSide::Both),
    }
}

/// Whether a box lies on the side of a parallelogram's plane where the receivers are.
fn is_beside(flat: &Parallelogram, side: PlaneSide, middle: Vec3, half: Vec3, room: f64) -> bool {
    let at = flat.n.dot(middle.as_dvec3() - flat.p);
    let reach = flat.n.abs().dot(half.as_dvec3()) - room;
    match side {
        PlaneSide::Front => at >= reach,
        PlaneSide::Back => at <= -reach,
        PlaneSide::Both => false,
    }
}
