//! What a zone of places sees of a box: all of it, nothing, or what is not known.
//!
//! Coarser than [`ShadowView`](super::ShadowView), and for places and lights by the hundred: it proves that nothing
//! stands between, or that one convex thing stands before it all, and leaves everything else to who looks from nearer.

use arrayvec::ArrayVec;
use fearless_simd::Level;

use super::Viewpoint;
use super::occluders::{OccluderList, ShadowMesh, Which};
use super::shaft::{Horizon, Shaft};
use super::target::{LightHull, Target};
use crate::accel::Aabb;
use crate::ids::LightId;
use crate::math::{DVec3, ErrorBound, Vec3};
use crate::scene::{Listed, Opacity, Placed, PlacedTarget, Scene};
use crate::shape::{Parallelogram, Solid, Sphere};

/// What is seen of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Seen {
    /// Nothing stands between any of the places and any of the box.
    Whole,
    /// One thing stands between all of the places and all of the box.
    Nothing,
    /// Neither is proved.
    Unknown,
}

/// On which side of a flat shape all places lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stand {
    Front,
    Back,
    Across,
}

/// Places, and what of the lists can be in their way. Keeps its memory.
#[derive(Debug)]
pub(crate) struct Outlook {
    /// The places and where their rays start.
    places: Aabb,
    apart: Vec3,
    /// Where all places share it.
    horizon: Option<Horizon>,
    points: Vec<Viewpoint>,
    /// Room for the rounding of the places.
    room: f32,
    spheres: Vec<u32>,
    flats: Vec<(u32, Stand)>,
    occluders: OccluderList,
    indices: Vec<u32>,
}

impl Default for Outlook {
    fn default() -> Self {
        Outlook {
            places: Aabb::EMPTY,
            apart: Vec3::ZERO,
            horizon: None,
            points: Vec::new(),
            room: 0.0,
            spheres: Vec::new(),
            flats: Vec::new(),
            occluders: OccluderList::default(),
            indices: Vec::new(),
        }
    }
}

/// Leaves of triangles, and things in trees, that are looked at one by one.
const LEAVES: usize = 4;
/// The most things that are tried whether they hide all.
const HIDERS: usize = 4;
/// Relative, for what was computed in f64 from numbers in f32.
const SLACK: f64 = 1e-6;

impl Outlook {
    /// Takes its stand at some places, each with how far it reaches around and whether it is curved.
    pub fn stand(&mut self, scene: &Scene, places: impl Iterator<Item = (Viewpoint, f32, bool)>) {
        self.points.clear();
        self.indices.clear();
        (self.places, self.apart, self.room) = (Aabb::EMPTY, Vec3::ZERO, 0.0);
        let mut reaches: f32 = 0.0;
        let mut horizon: Option<Horizon> = None;
        let mut shared = true;
        for (point, reach, curved) in places {
            for side in [-reach, reach] {
                self.places = self.places.with(point.p + side).with(point.start + side);
            }
            self.apart = self.apart.max((point.start - point.p).abs() * 1.0001);
            self.room = self.room.max(point.error.0.length() * 4.0);
            reaches = reaches.max(reach);
            let n = point.horizon;
            let least = n.as_dvec3().dot(point.p.as_dvec3()).min(n.as_dvec3().dot(point.start.as_dvec3()));
            match &mut horizon {
                None => horizon = Some(Horizon { n, least }),
                Some(horizon) if horizon.n == n => horizon.least = horizon.least.min(least),
                Some(_) => shared = false,
            }
            shared &= !curved;
            self.indices.push(self.points.len() as u32);
            self.points.push(point);
        }
        self.horizon = horizon.filter(|_| shared);
        let points = &self.points;
        self.spheres.clear();
        let in_the_way =
            |sphere: &Sphere| !points.iter().all(|point| sphere.shadow(point.p, point.error).is_below(point.horizon));
        let spheres = scene.occluders.surface_spheres().iter().enumerate();
        self.spheres.extend(spheres.filter(|(_, sphere)| in_the_way(&sphere.shape)).map(|(i, _)| i as u32));
        self.flats.clear();
        for (i, flat) in scene.occluders.flats.iter().enumerate() {
            if let Some(stand) = stand(&flat.shape, points, reaches) {
                self.flats.push((i as u32, stand));
            }
        }
    }

    /// What is seen of the box from `low` to `high`, in which the lights are of which `light` is one.
    pub fn look(&mut self, level: Level, scene: &Scene, low: Vec3, high: Vec3, light: LightId) -> Seen {
        let middle = low + (high - low) * 0.5;
        let half = high - middle;
        let hull = LightHull {
            center: middle,
            axes: [Vec3::new(half.x, 0.0, 0.0), Vec3::new(0.0, half.y, 0.0), Vec3::new(0.0, 0.0, half.z)],
            finite: true,
            is_ball: false,
            plane: Vec3::ZERO,
        };
        let shaft = Shaft::between(self.places, &hull, self.apart);
        let size = self.places.min.abs().max(self.places.max.abs()).max(low.abs()).max(high.abs()).max_element();
        let room = f64::from(size) * SLACK;
        let listed = &scene.occluders;
        let stops = |opacity: Opacity| scene.geometry.stops(opacity, light);
        let hull_of = Capsule::around(&self.places, middle, half);
        let mut clear = true;
        let mut hiders: ArrayVec<Which, HIDERS> = ArrayVec::new();
        for i in &self.spheres {
            let Listed { shape: sphere, opacity } = &listed.spheres[*i as usize];
            if hull_of.misses(sphere) {
                continue;
            }
            let [a, b] = sphere.bounds();
            if stops(*opacity) && shaft.meets(a, b, room + sphere.r * 1e-4) {
                clear = false;
                let _ = hiders.try_push(Which::Listed(*i));
            }
        }
        for (i, stand) in &self.flats {
            let Listed { shape: flat, opacity } = &listed.flats[*i as usize];
            if !stops(*opacity) || is_beside(flat, *stand, middle, half, room) {
                continue;
            }
            let [a, b] = flat.bounds();
            if shaft.meets(a, b, room) {
                clear = false;
                if self.hides(flat_blocks(flat), low, high) {
                    return Seen::Nothing;
                }
            }
        }
        for which in &hiders {
            let sphere = scene.sphere(*which);
            if self.hides(|p, l| sphere.shadow(p, ErrorBound(Vec3::ZERO)).blocks(l, true), low, high) {
                return Seen::Nothing;
            }
        }
        clear &= !listed.disks.iter().any(|disk| stops(disk.opacity));
        for Listed { shape, opacity } in listed.light_spheres() {
            let [a, b] = shape.bounds();
            clear &= !stops(*opacity) || !shaft.meets(a, b, room + shape.r * 1e-4);
        }
        if !clear {
            return Seen::Unknown;
        }
        if !scene.geometry.has_trees() {
            return Seen::Whole;
        }
        self.look_through_trees(level, scene, &Shaft { horizon: self.horizon, ..shaft }, hull, light, room)
    }

    fn look_through_trees(
        &mut self,
        level: Level,
        scene: &Scene,
        shaft: &Shaft,
        hull: LightHull,
        light: LightId,
        room: f64,
    ) -> Seen {
        let target = Target { light, hull, blocks: Vec::new(), cells: Vec::new(), is_in_order: true };
        let mut found = std::mem::take(&mut self.occluders);
        found.gather_in(level, scene, &target, shaft, &self.points, &self.indices, LEAVES);
        let seen = self.judge(scene, &found, &target, shaft, room);
        self.occluders = found;
        seen
    }

    /// What is left of what was found in trees.
    fn judge(&self, scene: &Scene, found: &OccluderList, target: &Target, shaft: &Shaft, room: f64) -> Seen {
        if found.too_many {
            return Seen::Unknown;
        }
        let bounds = target.hull.bounds();
        let (middle, half) = (bounds.min + (bounds.max - bounds.min) * 0.5, (bounds.max - bounds.min) * 0.5);
        let mut seen = Seen::Whole;
        for which in &found.flats {
            let flat = scene.flat(which.0);
            let beside = match stand(flat, &self.points, 0.0) {
                None => true,
                Some(stand) => is_beside(flat, stand, middle, half, room),
            };
            if beside {
                continue;
            }
            if self.hides(flat_blocks(flat), bounds.min, bounds.max) {
                return Seen::Nothing;
            }
            seen = Seen::Unknown;
        }
        let below = |sphere: &Sphere| {
            self.points.iter().all(|point| sphere.shadow(point.p, point.error).is_below(point.horizon))
        };
        for which in &found.spheres {
            let sphere = scene.sphere(*which);
            if below(sphere) {
                continue;
            }
            if self.hides(|p, l| sphere.shadow(p, ErrorBound(Vec3::ZERO)).blocks(l, true), bounds.min, bounds.max) {
                return Seen::Nothing;
            }
            seen = Seen::Unknown;
        }
        if seen != Seen::Whole {
            return seen;
        }
        let is_below = |q: DVec3, more: f64| {
            shaft.horizon.is_some_and(|h| h.n.as_dvec3().dot(q) <= h.least + f64::from(self.room) + room + more)
        };
        for thing in &found.others {
            let placed = &scene.geometry.placed[*thing as usize];
            if !self.is_out_of_the_way(scene, placed, middle, half, &is_below) {
                return Seen::Unknown;
            }
        }
        for (source, leaf) in &found.leaves {
            let Some(mesh) = ShadowMesh::of(&scene.geometry, *source, target.light) else { continue };
            for (triangle, corners) in mesh.mesh.tree.leaf(*leaf) {
                if !mesh.casts(triangle) {
                    continue;
                }
                let corners = corners.map(|q| match mesh.placement {
                    Some(placement) => placement.world_from_object.transform_point3(q.as_dvec3()),
                    None => q.as_dvec3(),
                });
                let edge = (corners[1] - corners[0]).length().max((corners[2] - corners[0]).length());
                if !corners.iter().all(|q| is_below(*q, edge * 1e-6)) {
                    return Seen::Unknown;
                }
            }
        }
        Seen::Whole
    }

    /// Whether a solid is below all horizons, or a plane has all places and the box on one side.
    fn is_out_of_the_way(
        &self,
        scene: &Scene,
        placed: &Placed,
        middle: Vec3,
        half: Vec3,
        is_below: &impl Fn(DVec3, f64) -> bool,
    ) -> bool {
        let PlacedTarget::Solid(solid) = placed.target else { return false };
        let solid = &scene.geometry.solids[solid as usize];
        let world = &placed.placement.world_from_object;
        if let Solid::Plane(plane) = solid {
            let (p, n) = plane.place();
            let p = world.transform_point3(p);
            let n = (placed.placement.object_from_world.matrix3.transpose() * n).normalize_or_zero();
            let height = |q: Vec3| n.dot(q.as_dvec3() - p);
            let reach = n.abs().dot(half.as_dvec3()) + f64::from(self.room);
            let at = height(middle);
            let margin = f64::from(self.room);
            let side =
                |sign: f64| self.points.iter().all(|point| sign * height(point.p) >= -margin) && sign * at >= reach;
            return side(1.0) || side(-1.0);
        }
        let Some([low, high]) = solid.bounds() else { return false };
        (0..8).all(|i| {
            let pick = |bit: u32, a: f64, b: f64| if i >> bit & 1 == 0 { a } else { b };
            let q = DVec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z));
            is_below(world.transform_point3(q), 0.0)
        })
    }

    /// Whether one convex thing stands between all of the places and all of a box: then it stands between all their
    /// corners. From one place, what is behind a convex thing is convex; and so is, for one point of the box, the set
    /// of places it hides it from.
    fn hides(&self, blocks: impl Fn(Vec3, Vec3) -> bool, low: Vec3, high: Vec3) -> bool {
        let corner = |min: Vec3, max: Vec3, i: u32| {
            let pick = |bit: u32, a: f32, b: f32| if i >> bit & 1 == 0 { a } else { b };
            Vec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z))
        };
        let Aabb { min, max } = self.places;
        // A box without extent has one corner
        let corners = |min: Vec3, max: Vec3| if min == max { 1 } else { 8 };
        let (places, ends) = (corners(min, max), corners(low, high));
        (0..ends).all(|j| {
            let q = corner(low, high, j);
            (0..places).all(|i| {
                let p = corner(min, max, i);
                blocks(p, q - p)
            })
        })
    }
}

/// All points as near to a line as the hull of places and a box can be.
struct Capsule {
    from: Vec3,
    way: Vec3,
    inverse: f32,
    radius: f32,
}

impl Capsule {
    fn around(places: &Aabb, middle: Vec3, half: Vec3) -> Capsule {
        let around = (places.max - places.min) * 0.5;
        let from = places.min + around;
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

fn flat_blocks(flat: &Parallelogram) -> impl Fn(Vec3, Vec3) -> bool + '_ {
    |p, l| flat.shadow(p, ErrorBound(Vec3::ZERO)).blocks(l, true)
}

/// Where places stand to a flat shape; `None` if all lie on it.
fn stand(flat: &Parallelogram, points: &[Viewpoint], reach: f32) -> Option<Stand> {
    let (mut front, mut back, mut on) = (true, true, true);
    for point in points {
        let s = flat.n.dot(point.p.as_dvec3() - flat.p) as f32;
        let margin = flat.n.as_vec3().abs().dot(point.error.0);
        if s.abs() <= margin {
            continue;
        }
        on = false;
        front &= s > reach;
        back &= s < -reach;
    }
    match (on, front, back) {
        (true, ..) => None,
        (_, true, _) => Some(Stand::Front),
        (.., true) => Some(Stand::Back),
        _ => Some(Stand::Across),
    }
}

/// Whether a flat shape has the box on the side of the places.
fn is_beside(flat: &Parallelogram, stand: Stand, middle: Vec3, half: Vec3, room: f64) -> bool {
    let at = flat.n.dot(middle.as_dvec3() - flat.p);
    let reach = flat.n.abs().dot(half.as_dvec3()) - room;
    match stand {
        Stand::Front => at >= reach,
        Stand::Back => at <= -reach,
        Stand::Across => false,
    }
}
