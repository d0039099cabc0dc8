//! What stands between a point, with the patch of surface around it, and a flat light.

use std::cell::OnceCell;

use arrayvec::ArrayVec;

use super::emitter::Emitter;
use super::hider::Hider;
use super::rows::MAX_HIDERS;
use super::view::View;
use crate::ids::LightId;
use crate::math::{DVec3, Facet, Vec3};
use crate::scene::Scene;
use crate::shape::{Disk, Parallelogram, PlaneSide, Sphere, SurfaceInteraction};
use crate::visibility::{Occluders, ShadowMesh};

/// Who asks, and for how much of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asker<'a> {
    pub si: &'a SurfaceInteraction,
    /// How far the patch of surface reaches from the point, in metres; 0 for the point alone.
    pub reach: f32,
}

/// What may hide a light.
#[derive(Clone, Debug, Default)]
pub(crate) struct Between {
    /// Convex things that hide a part of it.
    pub hiders: ArrayVec<Hider, MAX_HIDERS>,
    /// Whether all of it is hidden from the point.
    pub hidden: bool,
    /// Whether more is in the way than can be told row by row: each way has to be asked.
    pub ask: bool,
    /// Whether the trees have to be asked as well, way by way.
    pub ask_trees: bool,
    /// Over how much of the light's size the outline of a shadow moves on it where the point moves across the patch; 0
    /// where the patch is proved to be lit, or hidden, as one.
    pub drift: f32,
}

/// The cone around a light: what is outside of it needs no closer look.
struct LightCone {
    /// Unit, to the light's middle, and how far that is.
    axis: Vec3,
    sin: f32,
    cos: f32,
    reach: f32,
}

impl LightCone {
    fn new(view: &View, reach: f32) -> LightCone {
        let middle = view.middle();
        let far = middle.length();
        // A circle around the light's square
        let [_, right, corner, _] = view.corners();
        let radius = corner.distance(middle).max(right.distance(middle));
        let sin = (radius / far).min(1.0);
        LightCone { axis: middle / far, sin, cos: (1.0 - sin * sin).sqrt(), reach }
    }

    /// Whether the ball around `s` is outside, seen from anywhere on the patch.
    #[inline(always)]
    fn misses(&self, s: Vec3, r: f32) -> bool {
        // A light that the point is in the middle of is on all sides of it
        if self.sin >= 1.0 {
            return false;
        }
        let along = s.dot(self.axis);
        let aside = (s.length_squared() - along * along).max(0.0).sqrt();
        aside * self.cos - along * self.sin > (r + self.reach) * 1.001 + (along.abs() + aside) * SLACK
    }
}

/// Side planes of the pyramid over a light, and how the patch sees it.
pub(super) struct Pyramid {
    /// Unit normals, outwards.
    sides: [Vec3; 4],
    corners: [Vec3; 4],
    /// The farthest of the light.
    far: f32,
    /// The size of the light across the line of sight, at least.
    size: f32,
    reach: f32,
}

impl Pyramid {
    fn new(view: &View, reach: f32) -> Pyramid {
        let corners = view.corners();
        let turn = corners[0].cross(corners[1]).dot(corners[2]);
        let mut sides = [Vec3::ZERO; 4];
        for i in 0..4 {
            let n = corners[i].cross(corners[(i + 1) % 4]);
            let n = if turn > 0.0 { -n } else { n };
            sides[i] = n.normalize_or_zero();
        }
        let far = corners.iter().fold(0.0f32, |far, corner| far.max(corner.length()));
        // Foreshortened
        let slant = view.height / view.middle().length().max(f32::MIN_POSITIVE);
        let size = 2.0 * view.la.min(view.lb) * slant.max(0.02);
        Pyramid { sides, corners, far, size, reach }
    }

    /// How far outside of one side a ball around `s` of radius `r` lies, at most.
    fn gap(&self, s: Vec3, r: f32) -> f32 {
        self.sides.iter().fold(f32::NEG_INFINITY, |gap, n| gap.max(n.dot(s))) - r
    }

    /// The same of the hull of some points.
    fn gap_of(&self, points: &[Vec3]) -> f32 {
        let least = |n: &Vec3| points.iter().fold(f32::INFINITY, |least, q| least.min(n.dot(*q)));
        self.sides.iter().fold(f32::NEG_INFINITY, |gap, n| gap.max(least(n)))
    }

    /// Whether the hull of some points may be in the way from the middle of the patch; `None` if it is not in the way
    /// from any of it.
    fn meets(&self, points: &[Vec3]) -> Option<bool> {
        let room = points.iter().fold(0.0f32, |size, q| size.max(q.length())) * SLACK;
        let gap = self.gap_of(points);
        (gap <= room + self.reach).then_some(gap <= room)
    }

    /// The same of a parallelogram, in the way from above the horizon; with its corners from the middle.
    fn meets_flat(&self, flat: &Parallelogram, si: &SurfaceInteraction) -> Option<([Vec3; 4], bool)> {
        let from = si.lit_from.as_dvec3();
        let corners = flat.deep_corners().map(|q| (q - from).as_vec3());
        let above = corners.iter().fold(f32::NEG_INFINITY, |above, q| above.max(si.horizon.dot(*q)));
        let size = corners.iter().fold(0.0f32, |size, q| size.max(q.length()));
        if above < -SLACK * size - self.reach {
            return None;
        }
        self.meets(&corners).map(|is_met| (corners, is_met))
    }

    /// See [`Between::drift`]: of a shadow that something casts which is `near` to the point.
    fn drift(&self, near: f32) -> f32 {
        let t = (near / self.far).clamp(1e-6, 1.0);
        2.0 * self.reach * (1.0 - t) / (t * self.size)
    }
}

/// Room for the rounding of a distance.
pub(super) const SLACK: f32 = 1e-5;
/// Points no farther off the plane of a facet than this part of its edges are in it.
const FLAT: f32 = 1e-5;

impl Between {
    /// Looks at all that is in lists, and at what was gathered in trees.
    pub fn look(
        scene: &Scene,
        light: usize,
        emitter: &Emitter,
        view: &View,
        asker: &Asker,
        trees: Option<&Occluders>,
    ) -> Between {
        let mut between = Between::default();
        let cone = LightCone::new(view, asker.reach);
        let pyramid = OnceCell::new();
        let pyramid = || pyramid.get_or_init(|| Pyramid::new(view, asker.reach));
        let (p, horizon) = (asker.si.lit_from, asker.si.horizon);
        let id = LightId(light as u32);
        let [sphere_links, flat_links] = &scene.obstacle_links;
        for (i, sphere) in scene.obstacles.iter().enumerate() {
            if !scene.casts(sphere_links, i, id) {
                continue;
            }
            let s = (sphere.c - p.as_dvec3()).as_vec3();
            if cone.misses(s, sphere.r as f32) {
                continue;
            }
            between.sphere(view, emitter, pyramid(), sphere, asker, horizon);
            if between.hidden {
                return between;
            }
        }
        for (index, sphere) in &scene.light_obstacles.spheres {
            let s = (sphere.c - p.as_dvec3()).as_vec3();
            if *index != light && !cone.misses(s, sphere.r as f32) {
                between.sphere(view, emitter, pyramid(), sphere, asker, horizon);
            }
        }
        let sides = &scene.light_sides[light];
        for (i, flat) in scene.flat_obstacles.iter().enumerate() {
            if !scene.casts(flat_links, i, id) {
                continue;
            }
            let side = sides.get(i).copied().unwrap_or(PlaneSide::Both);
            if !flat.is_one_sided(p, asker.si.error, side) {
                between.flat(view, emitter, pyramid(), flat, asker);
            } else if flat.plane_cuts(p, asker.si.error, asker.reach) {
                let is_seen = scene.flats_seen.get(i) == Some(&true);
                between.beside(pyramid(), flat, asker, if is_seen { side } else { PlaneSide::Both });
            }
            if between.hidden {
                return between;
            }
        }
        for (index, disk) in &scene.light_obstacles.disks {
            if *index != light {
                between.disk(view, emitter, pyramid(), disk, asker);
            }
            if between.hidden {
                return between;
            }
        }
        if let Some(trees) = trees {
            for which in &trees.spheres {
                between.sphere(view, emitter, pyramid(), scene.sphere(*which), asker, horizon);
            }
            for (which, _) in &trees.flats {
                let flat = scene.flat(*which);
                if !flat.is_one_sided(p, asker.si.error, PlaneSide::Both) {
                    between.flat(view, emitter, pyramid(), flat, asker);
                } else if flat.plane_cuts(p, asker.si.error, asker.reach) {
                    between.beside(pyramid(), flat, asker, PlaneSide::Both);
                }
            }
            if !between.hidden {
                between.meshes(scene, id, view, pyramid(), asker, emitter, trees);
            }
            // What is told row by row is not asked for then, and lists do not know what is in trees
            between.ask_trees |= between.ask;
        }
        between
    }

    /// Adds triangles, if they are few.
    #[allow(clippy::too_many_arguments, reason = "a light of a scene, a point, and what is between")]
    fn meshes(
        &mut self,
        scene: &Scene,
        light: LightId,
        view: &View,
        pyramid: &Pyramid,
        asker: &Asker,
        emitter: &Emitter,
        trees: &Occluders,
    ) {
        if trees.too_many || !trees.others.iter().all(|other| self.solid(scene, *other, view, pyramid, emitter, asker))
        {
            // Anywhere, as far as is known
            (self.ask_trees, self.drift) = (true, f32::INFINITY);
            return;
        }
        if self.hidden {
            return;
        }
        let from = asker.si.lit_from.as_dvec3();
        let SurfaceInteraction { horizon, ng, facet, .. } = *asker.si;
        // A lifted point sees over its own facet, and light may come along it from below
        let is_lifted = facet != Facet::NONE;
        let sees_below = is_lifted && !view.corners().iter().all(|l| ng.dot(*l) > 0.0);
        for (source, leaf) in &trees.leaves {
            let Some(mesh) = ShadowMesh::of(&scene.geometry, *source, light) else { continue };
            for (triangle, corners) in mesh.mesh.tree.leaf(*leaf) {
                if triangle == facet.of(*source) || !mesh.casts(triangle) {
                    continue;
                }
                let place = |q: Vec3| match mesh.placement {
                    Some(placement) => placement.world_from_object.transform_point3(q.as_dvec3()),
                    None => q.as_dvec3(),
                };
                let corners = corners.map(|q| (place(q) - from).as_vec3());
                let rises = |n: Vec3| corners.iter().fold(f32::NEG_INFINITY, |above, q| above.max(n.dot(*q)));
                let edge = (corners[1] - corners[0]).length().max((corners[2] - corners[0]).length());
                // The surface's own triangle, and what is below it
                let room = edge * 1e-4 + asker.si.error.0.length() * 4.0;
                if rises(horizon) <= room {
                    continue;
                }
                // One that goes on as its own facet does, or falls off from it, hides nothing that is above that; and
                // one in the same plane nothing at all: what comes from below has passed that plane before it gets
                // there
                if is_lifted && rises(ng) <= room && (!sees_below || is_in_plane(&corners, edge * FLAT)) {
                    continue;
                }
                if !self.polygon(view, pyramid, emitter, asker, &corners) {
                    self.ask_trees = true;
                    return;
                }
            }
        }
    }

    /// Adds a flat thing with these corners, around, from the point; `false` if the trees have to be asked.
    pub(super) fn polygon(
        &mut self,
        view: &View,
        pyramid: &Pyramid,
        emitter: &Emitter,
        asker: &Asker,
        corners: &[Vec3],
    ) -> bool {
        let Some(is_met) = pyramid.meets(corners) else { return true };
        let near = distance(corners, Vec3::ZERO);
        self.drift = self.drift.max(pyramid.drift((near - asker.reach).max(0.0)));
        if !is_met {
            return true;
        }
        let ball = match emitter {
            Emitter::Ball { center, radius, .. } => {
                distance(corners, (*center - asker.si.lit_from.as_dvec3()).as_vec3()) < *radius as f32
            }
            _ => false,
        };
        let hider = Hider::polygon(view, corners);
        if ball || hider.is_none() || self.hiders.is_full() {
            return false;
        }
        self.add(hider);
        true
    }

    pub(super) fn add(&mut self, hider: Option<Hider>) {
        if let Some(hider) = hider
            && self.hiders.try_push(hider).is_err()
        {
            self.ask = true;
        }
    }

    fn sphere(
        &mut self,
        view: &View,
        emitter: &Emitter,
        pyramid: &Pyramid,
        sphere: &Sphere,
        asker: &Asker,
        horizon: Vec3,
    ) {
        let si = asker.si;
        let shadow = sphere.shadow(si.lit_from, si.error);
        if shadow.is_below(horizon) {
            // The whole patch, if the sphere is the surface's own, or deep enough
            let s = (sphere.c - si.lit_from.as_dvec3()).as_vec3();
            let (r, distance) = (sphere.r as f32, s.length());
            let own = (distance - r).abs() <= r * 1e-3;
            if !own && -horizon.dot(s) - r < asker.reach * (1.0 + distance) {
                self.drift = self.drift.max(pyramid.drift((distance - r).max(0.0)));
            }
            return;
        }
        let to = sphere.c - si.lit_from.as_dvec3();
        let (distance, r) = (to.length(), sphere.r);
        // From inside, or from its inner side: light from outside is hidden, light from inside is not
        let is_on = shadow.is_on();
        if is_on && horizon.as_dvec3().dot(to) < 0.0 {
            // Its outside: nothing of it is above the horizon but by rounding
            return;
        }
        if distance <= r || is_on {
            // What is hidden is the same from everywhere inside
            let inside = is_on || r - distance > 2.0 * f64::from(asker.reach);
            if !inside {
                self.drift = self.drift.max(pyramid.drift(0.0));
            }
            let l = pyramid.corners;
            let outside = |l: &Vec3| (l.as_dvec3() - to).length() > r * (1.0 + 1e-6);
            let within = |l: &Vec3| (l.as_dvec3() - to).length() < r * (1.0 - 1e-6);
            if l.iter().all(within) {
                return;
            }
            // All of the light is outside only if the sphere does not reach through it
            let apart = self.is_apart(view, to, r);
            if l.iter().all(outside) && apart {
                self.hidden = true;
                return;
            }
            if touches(emitter, to, r, si.lit_from) {
                self.ask = true;
            } else {
                Hider::shells(view, to, r).into_iter().for_each(|shell| self.add(Some(shell)));
            }
            if self.ask {
                self.drift = self.drift.max(pyramid.drift(0.0));
            }
            return;
        }
        let s = to.as_vec3();
        let gap = pyramid.gap(s, r as f32);
        if gap > SLACK * distance as f32 + asker.reach {
            return;
        }
        self.drift = self.drift.max(pyramid.drift(tangent(distance, r, asker.reach)));
        if gap > SLACK * distance as f32 {
            return;
        }
        if touches(emitter, to, r, si.lit_from) {
            self.ask = true;
            return;
        }
        let Some(hider) = Hider::sphere(view, to, r) else { return };
        self.settle(pyramid, hider, view, asker, to, r);
        if !self.hidden {
            self.add(Some(hider));
        }
    }

    /// Whether the light's plane stays clear of the sphere.
    fn is_apart(&self, view: &View, to: DVec3, r: f64) -> bool {
        let n = view.a.cross(view.b).normalize().as_dvec3();
        n.dot(view.l0.as_dvec3() - to).abs() > r
    }

    /// One convex thing hides all of the light if it hides its corners.
    fn settle(&mut self, pyramid: &Pyramid, hider: Hider, view: &View, asker: &Asker, to: DVec3, r: f64) {
        let corners = view.square();
        if !corners.iter().all(|[x, y]| hider.hides(*x, *y)) {
            return;
        }
        self.hidden = true;
        // The whole patch: the ways to the corners pass the sphere's middle nearly as closely from all of it
        let smaller = r - f64::from(asker.reach);
        let firm = smaller > 0.0
            && asker.reach > 0.0
            && Hider::sphere(view, to, smaller)
                .is_some_and(|smaller| corners.iter().all(|[x, y]| smaller.hides(*x, *y)));
        self.drift = if firm || asker.reach == 0.0 {
            0.0
        } else {
            self.drift.max(pyramid.drift(tangent(to.length(), r, asker.reach)))
        };
    }

    pub(super) fn disk(&mut self, view: &View, emitter: &Emitter, pyramid: &Pyramid, disk: &Disk, asker: &Asker) {
        let (center, r) = disk.ball();
        let to = center - asker.si.lit_from.as_dvec3();
        let (s, distance) = (to.as_vec3(), to.length() as f32);
        let gap = pyramid.gap(s, r as f32);
        let below = asker.si.horizon.dot(s) + (r as f32) < -(SLACK * distance + asker.reach * (1.0 + distance));
        if below || gap > SLACK * distance + asker.reach {
            return;
        }
        let shadow = disk.shadow(asker.si.lit_from, asker.si.error);
        let longest = pyramid.corners.iter().fold(0.0f32, |longest, l| longest.max(l.abs().max_element()));
        let bounds = shadow.bounds(longest);
        let height = bounds.as_ref().map_or(0.0, |bounds| bounds.height);
        let near = height.max(distance - r as f32);
        self.drift = self.drift.max(pyramid.drift((near - asker.reach).max(0.0)));
        let Some(bounds) = bounds else { return };
        if gap > SLACK * distance {
            return;
        }
        if touches(emitter, to, r, asker.si.lit_from) {
            self.ask = true;
            return;
        }
        let hider = Hider::disk(view, &bounds);
        // Convex, as all that hides
        self.hidden = view.square().iter().all(|[x, y]| hider.hides(*x, *y));
        self.add(Some(hider));
    }

    /// A parallelogram that hides nothing from the point, but that a part of the patch is on the other side of its
    /// plane. `side` is that of the light, if the parallelogram is one that is seen.
    fn beside(&mut self, pyramid: &Pyramid, flat: &Parallelogram, asker: &Asker, side: PlaneSide) {
        let si = asker.si;
        if pyramid.meets_flat(flat, si).is_none() {
            return;
        }
        let near = flat.distance(si.lit_from.as_dvec3()) as f32;
        // Where light is gathered from the surface itself, that part may be what nobody sees
        let is_lifted = si.lit_from != si.p;
        if is_lifted || near > asker.reach || !flat.screens(si.lit_from, si.wo, asker.reach, side) {
            self.drift = self.drift.max(pyramid.drift((near - asker.reach).max(0.0)));
        }
    }

    fn flat(&mut self, view: &View, emitter: &Emitter, pyramid: &Pyramid, flat: &Parallelogram, asker: &Asker) {
        let Some((corners, is_met)) = pyramid.meets_flat(flat, asker.si) else { return };
        let near = flat.distance(asker.si.lit_from.as_dvec3()) as f32;
        let drift = self.drift.max(pyramid.drift((near - asker.reach).max(0.0)));
        self.drift = drift;
        if !is_met {
            return;
        }
        if let Emitter::Ball { center, radius, .. } = emitter
            && flat.distance(*center) < *radius
        {
            self.ask = true;
            return;
        }
        // In the light's own plane nothing is before it: a light that blocks, for one
        let n = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalize_or_zero();
        if pyramid.corners.iter().all(|l| n.dot(*l - corners[0]).abs() <= SLACK * pyramid.far) {
            return;
        }
        let Some(hider) = Hider::polygon(view, &corners) else { return };
        let ends = view.square();
        if ends.iter().all(|[x, y]| hider.hides(*x, *y)) {
            self.hidden = true;
            let Hider::Edges(edges) = &hider else { return };
            let share = (near / pyramid.far).min(1.0);
            let firm = ends.iter().all(|[x, y]| edges.depth(*x, *y) * share > asker.reach);
            self.drift = if firm || asker.reach == 0.0 { 0.0 } else { drift };
            return;
        }
        self.add(Some(hider));
    }
}

/// How far off the outline of a sphere of radius `r` is seen, at least, from within `reach` of a point at `distance`
/// from its middle. A step of d turns the way to the outline by at most d over that: across the line of sight by d over
/// the distance, along it by that times r over the tangent, and the squares add up.
fn tangent(distance: f64, r: f64, reach: f32) -> f32 {
    let near = (distance - f64::from(reach)).max(r);
    (near * near - r * r).sqrt() as f32
}

/// Whether the origin is in the plane of a triangle, or no farther off than that.
fn is_in_plane([a, b, c]: &[Vec3; 3], room: f32) -> bool {
    let n = (*b - *a).cross(*c - *a);
    n.dot(*a).abs() <= room * n.length()
}

/// How far a convex polygon is from a point.
fn distance(corners: &[Vec3], p: Vec3) -> f32 {
    let apex = corners[0] - p;
    let triangles = corners[1..].windows(2).map(|side| triangle_distance(&[apex, side[0] - p, side[1] - p]));
    triangles.fold(f32::INFINITY, f32::min)
}

/// How far a triangle is from the origin.
///
/// Source: Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.
fn triangle_distance([a, b, c]: &[Vec3; 3]) -> f32 {
    let (ab, ac) = (*b - *a, *c - *a);
    let (d1, d2) = (-ab.dot(*a), -ac.dot(*a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a.length();
    }
    let (d3, d4) = (-ab.dot(*b), -ac.dot(*b));
    if d3 >= 0.0 && d4 <= d3 {
        return b.length();
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (*a + ab * (d1 / (d1 - d3))).length();
    }
    let (d5, d6) = (-ab.dot(*c), -ac.dot(*c));
    if d6 >= 0.0 && d5 <= d6 {
        return c.length();
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (*a + ac * (d2 / (d2 - d6))).length();
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (*b + (*c - *b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))).length();
    }
    let n = ab.cross(ac);
    (n.dot(*a) / n.length()).abs()
}

/// Whether a sphere, or a disk in one, reaches into a light that is a ball: what of it is behind the light's surface
/// does not show on the disk that stands for the light.
fn touches(emitter: &Emitter, to: DVec3, r: f64, p: Vec3) -> bool {
    match emitter {
        Emitter::Ball { center, radius, .. } => (*center - p.as_dvec3() - to).length() < radius + r,
        _ => false,
    }
}
