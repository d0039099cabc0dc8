//! Blocks of pixels that hold one surface, proved without a ray for each.
//!
//! A block's rays lie in the pyramid between the rays through its corners. Shapes outside of it are out; if the rays
//! through the corners all meet one convex shape, so do all between them; and if it is nearer there than anything else
//! can be, it is all that is seen.

use std::f32::consts::PI;

use super::square::Square;
use crate::accel::{HalfSpace, Planes};
use crate::ids::SurfaceId;
use crate::light::AreaShape;
use crate::material::Bsdf;
use crate::math::{DVec3, Facet, Ray, Vec3};
use crate::scene::{At, FewFacets, Hit, Opacity, PlacedSpot, Scene};
use crate::shape::{Footprint, Parallelogram, RayDifferential, Sphere, SurfaceInteraction};

/// Something that a block's rays may meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Candidate {
    Sphere(u32),
    Parallelogram(u32),
    /// A plane, as it is placed.
    Plane(u32),
    /// A flat facet of a mesh that all rays of a square are proved to see.
    Facet(Facet),
    /// A light's shape.
    Light(u32),
    /// All that lies in trees, which has an end.
    Trees,
}

/// The rays of a rectangle of the film.
pub(crate) struct Pyramid {
    corners: [Ray; 4],
    /// Outward unit normals.
    sides: [DVec3; 4],
    forward: Vec3,
    /// Where its middle begins.
    start: Vec3,
    /// The cone around it: where it begins and how wide it is there, which way it leads, and the sine and cosine of
    /// half its angle.
    middle: Ray,
    width: f64,
    sin: f64,
    cos: f64,
}

/// Depths and heights are told apart beyond this share of them.
const SLACK: f64 = 1e-5;

impl Pyramid {
    /// Of the pixels from (`left`, `top`), `side` across and down.
    pub fn new(scene: &Scene, left: f32, top: f32, side: f32) -> Self {
        let (right, bottom) = (left + side, top + side);
        let at = |x: f32, y: f32| scene.camera.local_ray(x, y, 1.0).0;
        let corners = [at(left, top), at(right, top), at(right, bottom), at(left, bottom)];
        let middle = at(0.5 * (left + right), 0.5 * (top + bottom));
        let mut sides = [DVec3::ZERO; 4];
        for i in 0..4 {
            let (a, b) = (&corners[i], &corners[(i + 1) % 4]);
            // Rays of neighbours are nearly parallel, and far eyes see far
            let to = |ray: &Ray| (ray.o.as_dvec3() - a.o.as_dvec3()) + ray.d.as_dvec3();
            let n = a.d.as_dvec3().cross(to(b)).normalize_or_zero();
            sides[i] = if n.dot(to(&middle)) > 0.0 { -n } else { n };
        }
        let frame = scene.camera.frame();
        let sin = corners.iter().fold(0.0f64, |sin, ray| sin.max(f64::from(middle.d.cross(ray.d).length())));
        let width = corners.iter().fold(0.0f64, |width, ray| width.max(f64::from((ray.o - middle.o).length())));
        let (sin, width) = (sin * (1.0 + SLACK) + SLACK * SLACK, width * (1.0 + SLACK));
        let cos = (1.0 - sin * sin).max(0.0).sqrt();
        Pyramid { corners, sides, forward: frame.forward, start: middle.o, middle, width, sin, cos }
    }

    /// Whether the cone around it misses a ball.
    fn cone_misses(&self, c: DVec3, r: f64) -> bool {
        let s = c - self.middle.o.as_dvec3();
        // Unit to more digits than the ray's, which would not do from far off
        let along = s.dot(self.middle.d.as_dvec3().normalize());
        let aside = (s.length_squared() - along * along).max(0.0).sqrt();
        // Behind the apex the cone's nearest point is the apex, and this is farther off than said
        aside * self.cos - along * self.sin > r + self.width + (along.abs() + aside) * SLACK
    }

    /// How far in front of the camera, along its line of sight.
    fn depth(&self, q: DVec3) -> f64 {
        self.forward.as_dvec3().dot(q - self.start.as_dvec3())
    }

    fn misses_sphere(&self, sphere: &Sphere) -> bool {
        if self.cone_misses(sphere.c, sphere.r) {
            return true;
        }
        // Rays are known to the rounding of their directions
        let off = (sphere.c - self.middle.o.as_dvec3()).length();
        let slack = sphere.c.abs().max_element().max(sphere.r).max(off) * SLACK;
        let outside = |(n, ray): (&DVec3, &Ray)| n.dot(sphere.c - ray.o.as_dvec3()) > sphere.r + slack;
        self.sides.iter().zip(&self.corners).any(outside) || self.depth(sphere.c) + sphere.r < -slack
    }

    fn misses_flat(&self, flat: &Parallelogram) -> bool {
        let corners = flat.deep_corners();
        let from = self.middle.o.as_dvec3();
        let size = corners.iter().fold(0.0f64, |size, q| size.max(q.abs().max_element()).max((*q - from).length()));
        let slack = size * SLACK;
        let outside = |(n, ray): (&DVec3, &Ray)| corners.iter().all(|q| n.dot(*q - ray.o.as_dvec3()) > slack);
        self.sides.iter().zip(&self.corners).any(outside) || corners.iter().all(|q| self.depth(*q) < -slack)
    }

    /// At each corner: how high over a plane the ray begins, and how much higher it is a metre on.
    fn heights(&self, scene: &Scene, plane: u32) -> [[f64; 2]; 4] {
        let (thing, plane) = scene.geometry.plane(plane);
        let (_, normal) = plane.place();
        let scale = 1.0 / thing.placement.normal(normal).length();
        self.corners.each_ref().map(|ray| plane.approach(&thing.placement.ray(ray)).map(|height| height * scale))
    }

    /// Whether all rays lead away from a plane, from one side of it, or all begin in it.
    fn misses_plane(&self, scene: &Scene, plane: u32) -> bool {
        let heights = self.heights(scene, plane);
        let side = heights[0][0].signum();
        let leads_away = |(ray, [height, gain]): (&Ray, &[f64; 2])| {
            height * side > f64::from(ray.o.abs().max_element()) * SLACK && gain * side > SLACK
        };
        heights.iter().all(|[height, _]| *height == 0.0) || self.corners.iter().zip(&heights).all(leads_away)
    }

    /// Those of the listed shapes and lights that the rays may meet.
    pub fn candidates(&self, scene: &Scene, from: &[Candidate], into: &mut Vec<Candidate>) {
        into.clear();
        let geometry = &scene.geometry;
        into.extend(from.iter().filter(|candidate| match candidate {
            Candidate::Sphere(i) => !self.misses_sphere(&geometry.spheres[*i as usize].shape),
            Candidate::Parallelogram(i) => !self.misses_flat(&geometry.parallelograms[*i as usize].shape),
            Candidate::Plane(i) => !self.misses_plane(scene, *i),
            Candidate::Facet(_) => unreachable!("facets are found where they are"),
            Candidate::Light(i) => scene.lights[*i as usize].area().is_some_and(|area| match &area.shape {
                AreaShape::Rectangle(rectangle) => !self.misses_flat(&rectangle.shape),
                AreaShape::Sphere(sphere) => !self.misses_sphere(&sphere.shape),
                _ => true,
            }),
            Candidate::Trees => geometry.may_meet(scene.level, &self.planes()),
        }));
    }

    /// What it lies between.
    fn planes(&self) -> Planes {
        let eye = HalfSpace { n: -self.forward.as_dvec3(), p: self.start.as_dvec3() };
        let side = |i: usize| HalfSpace { n: self.sides[i], p: self.corners[i].o.as_dvec3() };
        Planes([side(0), side(1), side(2), side(3), eye])
    }

    /// The depths, at most and at least, at which all the rays meet a shape; `None` if not all are proved to.
    fn cover(&self, scene: &Scene, candidate: Candidate) -> Option<[f64; 2]> {
        let depths = |intersect: &dyn Fn(&Ray) -> Option<f64>| {
            let mut range = [f64::INFINITY, 0.0f64];
            for ray in &self.corners {
                let t = intersect(ray)?;
                let depth = self.depth(ray.o.as_dvec3() + ray.d.as_dvec3() * t);
                range = [range[0].min(depth), range[1].max(depth)];
            }
            Some(range)
        };
        match candidate {
            Candidate::Parallelogram(i) => {
                let flat = &scene.geometry.parallelograms[i as usize].shape;
                depths(&|ray| flat.intersect(ray))
            }
            Candidate::Plane(_) => depths(&|ray| candidate.intersect(scene, ray)),
            Candidate::Facet(facet) => {
                let flat = scene.geometry.facet(facet);
                self.insides(&flat)?.as_flattened().iter().all(|inside| *inside > 0.0).then_some(())?;
                depths(&|ray| flat.intersect(ray))
            }
            Candidate::Sphere(i) => {
                let sphere = &scene.geometry.spheres[i as usize].shape;
                let inside = |ray: &Ray| (ray.o.as_dvec3() - sphere.c).length() <= sphere.r * (1.0 + SLACK);
                if self.corners.iter().any(inside) {
                    return None;
                }
                depths(&|ray| sphere.intersect(ray))?;
                Some([self.nearest(scene, candidate), self.middle_depth(sphere.c)])
            }
            Candidate::Light(_) | Candidate::Trees => None,
        }
    }

    /// How far inside of each of its three sides the rays through the corners meet a facet's plane, in sizes of the
    /// facet: below 0 if outside, and 0 where single precision leaves it open. `None` if not all meet the plane.
    fn insides(&self, flat: &Parallelogram) -> Option<[[f64; 3]; 4]> {
        let mut insides = [[0.0; 3]; 4];
        for (inside, ray) in insides.iter_mut().zip(&self.corners) {
            let (from, d) = (ray.o.as_dvec3() - flat.p, ray.d.as_dvec3());
            let t = -flat.n.dot(from) / flat.n.dot(d);
            if !(t > 0.0 && t < f64::INFINITY) {
                return None;
            }
            let [u, v] = [flat.u_axis, flat.v_axis].map(|axis| (from + d * t).dot(axis));
            let slack = (flat.u_axis.length() + flat.v_axis.length()) * t * SLACK;
            *inside = [u, v, 1.0 - u - v].map(|w| if w.abs() > slack { w } else { 0.0 });
        }
        Some(insides)
    }

    /// Whether all rays pass a facet on one side of it.
    fn misses_facet(&self, scene: &Scene, facet: Facet) -> bool {
        let insides = self.insides(&scene.geometry.facet(facet));
        insides.is_some_and(|insides| (0..3).any(|side| insides.iter().all(|inside| inside[side] < 0.0)))
    }

    /// The greatest depth at which a ray comes nearest to a point: where it meets a sphere around that from outside, it
    /// is not as deep. That may be deeper than the point itself, beside the axis of a wide view.
    fn middle_depth(&self, c: DVec3) -> f64 {
        // Of rays as long as they are deep, both are linear over the film
        let forward = self.forward.as_dvec3();
        let along = |ray: &Ray| ray.d.as_dvec3() / forward.dot(ray.d.as_dvec3());
        let middle = along(&self.middle).normalize();
        let (mut most, mut least) = (f64::NEG_INFINITY, f64::INFINITY);
        for ray in &self.corners {
            let (o, d) = (ray.o.as_dvec3(), along(ray));
            most = most.max(d.dot(c - o));
            least = least.min(d.dot(middle));
        }
        let origin = self.corners.iter().fold(f64::NEG_INFINITY, |z, ray| z.max(self.depth(ray.o.as_dvec3())));
        origin + most / (least * least)
    }

    /// The least depth at which the rays can meet a shape.
    fn nearest(&self, scene: &Scene, candidate: Candidate) -> f64 {
        match candidate {
            Candidate::Sphere(i) => {
                let sphere = &scene.geometry.spheres[i as usize].shape;
                let nearest = self.depth(sphere.c) - sphere.r;
                // All of it is behind the plane that touches it where the middle ray meets it
                let from = self.middle.o.as_dvec3() - sphere.c;
                match sphere.intersect(&self.middle) {
                    Some(t) if from.length() > sphere.r * (1.0 + SLACK) => {
                        let q = from + self.middle.d.as_dvec3() * t;
                        nearest.max(self.nearest_on_plane(q / q.length(), sphere.c + q).unwrap_or(nearest))
                    }
                    _ => nearest,
                }
            }
            Candidate::Parallelogram(i) => self.nearest_flat(&scene.geometry.parallelograms[i as usize].shape),
            Candidate::Plane(i) => self.nearest_plane(scene, i),
            Candidate::Facet(facet) => self.nearest_flat(&scene.geometry.facet(facet)),
            Candidate::Light(i) => match scene.lights[i as usize].area().map(|area| &area.shape) {
                Some(AreaShape::Rectangle(rectangle)) => self.nearest_flat(&rectangle.shape),
                Some(_) => f64::NEG_INFINITY,
                None => f64::INFINITY,
            },
            Candidate::Trees => {
                let (forward, planes) = (self.forward.as_dvec3(), self.planes());
                let boxes = scene.geometry.tree_bounds().filter(|bounds| planes.may_meet(*bounds));
                boxes.fold(f64::INFINITY, |nearest, bounds| {
                    let [min, max] = [bounds.min, bounds.max].map(|q| q.as_dvec3() - self.start.as_dvec3());
                    nearest.min(forward.max(DVec3::ZERO).dot(min) + forward.min(DVec3::ZERO).dot(max))
                })
            }
        }
    }

    fn nearest_flat(&self, flat: &Parallelogram) -> f64 {
        let on_shape = flat.deep_corners().iter().fold(f64::INFINITY, |z, q| z.min(self.depth(*q)));
        self.nearest_on_plane(flat.n, flat.p).map_or(on_shape, |on_plane| on_plane.max(on_shape))
    }

    /// The least depth at which the rays meet the plane through `p` with normal `n`, if all of them do. That depth, or
    /// its inverse where they come from one eye, is linear over the film: the corners' rays have the least.
    fn nearest_on_plane(&self, n: DVec3, p: DVec3) -> Option<f64> {
        let mut nearest = f64::INFINITY;
        for ray in &self.corners {
            let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
            let t = n.dot(p - o) / n.dot(d);
            if !(t > 0.0 && t.is_finite()) {
                return None;
            }
            nearest = nearest.min(self.depth(o + d * t));
        }
        Some(nearest - nearest.abs() * SLACK)
    }

    /// The same of a placed plane, also if only some of the rays meet it: those that begin on one side of it and do not
    /// come nearer are as if they met it very far off.
    fn nearest_plane(&self, scene: &Scene, plane: u32) -> f64 {
        let heights = self.heights(scene, plane);
        let side = heights[0][0].signum();
        if !heights.iter().all(|[height, _]| height * side > 0.0) {
            return f64::NEG_INFINITY;
        }
        let depths = self.corners.iter().zip(heights).map(|(ray, [height, gain])| {
            let t = height * side / (-gain * side).max(SLACK * SLACK);
            self.depth(ray.o.as_dvec3() + ray.d.as_dvec3() * t)
        });
        let nearest = depths.fold(f64::INFINITY, f64::min);
        nearest - nearest.abs() * SLACK
    }

    /// The one shape that all the rays see, if that is proved. `candidates` is all that they may meet.
    pub fn only(&self, scene: &Scene, candidates: &[Candidate]) -> Option<Candidate> {
        // Of what lies in trees few facets are candidates as others are
        let mut facets = FewFacets::new();
        let is_few = candidates.contains(&Candidate::Trees)
            && scene.geometry.few_facets(scene.level, &self.planes(), &mut facets);
        let others = candidates.iter().copied().filter(|other| !(is_few && *other == Candidate::Trees));
        facets.retain(|facet| is_few && !self.misses_facet(scene, *facet));
        let facets = facets.iter().map(|facet| Candidate::Facet(*facet));
        let all = others.chain(facets);
        let covers = all.clone().filter_map(|one| Some((one, self.cover(scene, one)?[1])));
        let (one, far) = covers.min_by(|(_, one), (_, other)| one.total_cmp(other))?;
        let mut behind = all.filter(|other| *other != one).map(|other| match self.cover(scene, other) {
            Some([near, _]) => near,
            None => self.nearest(scene, other),
        });
        behind.all(|near| near > far + (far.abs() + near.abs()) * SLACK).then_some(one)
    }
}

/// All that can be seen.
pub(crate) fn all(scene: &Scene) -> Vec<Candidate> {
    let geometry = &scene.geometry;
    let mut all = Vec::new();
    if geometry.listed {
        let spheres = 0..geometry.spheres.len();
        all.extend(spheres.filter(|i| geometry.spheres[*i].seen).map(|i| Candidate::Sphere(i as u32)));
        let flats = &geometry.parallelograms;
        all.extend((0..flats.len()).filter(|i| flats[*i].seen).map(|i| Candidate::Parallelogram(i as u32)));
    }
    let is_seen = |thing: &u32| geometry.placed[*thing as usize].camera != Opacity::Clear;
    all.extend(geometry.unbounded.iter().copied().filter(is_seen).map(Candidate::Plane));
    all.extend(geometry.has_boxes().then_some(Candidate::Trees));
    let visible = |i: &usize| scene.lights[*i].area().is_some_and(|area| area.visible);
    all.extend((0..scene.lights.len()).filter(visible).map(|i| Candidate::Light(i as u32)));
    all
}

/// The material of a square of pixels.
pub(crate) struct SquareBsdf {
    /// In its middle, over all of it.
    pub bsdf: Bsdf,
    pub is_even: bool,
    /// By which part of itself what a pixel sees of the surface grows over the square.
    pub growth: f32,
}

impl Candidate {
    /// How far along a ray that meets only this it ends.
    #[inline(always)]
    pub fn intersect(self, scene: &Scene, ray: &Ray) -> Option<f64> {
        match self {
            Candidate::Sphere(i) => scene.geometry.spheres[i as usize].shape.intersect(ray),
            Candidate::Parallelogram(i) => scene.geometry.parallelograms[i as usize].shape.intersect(ray),
            Candidate::Plane(i) => scene.geometry.meet_plane(i, ray),
            Candidate::Facet(facet) => scene.geometry.facet(facet).intersect(ray),
            Candidate::Light(i) => scene.lights[i as usize].area()?.shape.intersect(ray),
            Candidate::Trees => unreachable!("what lies in trees is not one shape"),
        }
    }

    /// The shape that a ray ends at, if it is one by itself.
    #[inline(always)]
    pub fn of(scene: &Scene, hit: &Hit) -> Option<Candidate> {
        match hit.at {
            At::Sphere(i) => Some(Candidate::Sphere(i)),
            At::Parallelogram(i) => Some(Candidate::Parallelogram(i)),
            At::Placed(i, PlacedSpot::Part(_)) if scene.geometry.is_plane(i) => Some(Candidate::Plane(i)),
            _ => None,
        }
    }

    /// Its surface.
    #[inline(always)]
    pub fn surface(self, scene: &Scene) -> SurfaceId {
        match self {
            Candidate::Sphere(i) => scene.geometry.spheres[i as usize].surface,
            Candidate::Parallelogram(i) => scene.geometry.parallelograms[i as usize].surface,
            Candidate::Plane(i) => scene.geometry.placed[i as usize].surface,
            Candidate::Facet(facet) => scene.geometry.facet_surface(facet),
            Candidate::Light(i) => SurfaceId(scene.geometry.surfaces.len() as u32 + i),
            Candidate::Trees => unreachable!("what lies in trees is not one shape"),
        }
    }

    /// What `ray` ends at, which meets it at `t`.
    #[inline(always)]
    pub fn hit_at(self, scene: &Scene, ray: &Ray, t: f64) -> Hit {
        let at = match self {
            Candidate::Sphere(i) => At::Sphere(i),
            Candidate::Parallelogram(i) => At::Parallelogram(i),
            Candidate::Plane(i) => At::Placed(i, PlacedSpot::Part(0)),
            Candidate::Facet(facet) => scene.geometry.on_facet(facet, ray.o.as_dvec3() + ray.d.as_dvec3() * t),
            Candidate::Light(_) => At::Light,
            Candidate::Trees => unreachable!("what lies in trees is not one shape"),
        };
        Hit { t, surface: self.surface(scene), at }
    }

    /// What a ray that meets only this ends at.
    pub fn hit(self, scene: &Scene, ray: &Ray) -> Option<Hit> {
        self.intersect(scene, ray).map(|t| self.hit_at(scene, ray, t))
    }

    /// The material of a square of pixels that see only this, in its middle.
    pub fn of_square(self, scene: &Scene, square: Square) -> Option<SquareBsdf> {
        let middle = |from: u32| from as f32 + 0.5 * square.side as f32;
        let (ray, differential) = scene.camera.local_ray(middle(square.x), middle(square.y), square.side as f32);
        let hit = self.hit(scene, &ray)?;
        let si = scene.local_surface(&ray, &hit, &differential);
        let material = &scene.materials[si.material.index()];
        let growth = self.growth(scene, &si, &ray, hit.t, &differential);
        let is_even = self.is_even_within(scene, &si, growth);
        Some(SquareBsdf { bsdf: material.bsdf(&si, &scene.textures), is_even, growth })
    }

    /// The same, if it is the same all over it.
    pub fn even(self, scene: &Scene, square: Square) -> Option<Bsdf> {
        self.of_square(scene, square).and_then(|of| of.is_even.then_some(of.bsdf))
    }

    /// Whether the material is the same all over what a ray stands for, by its steps to its neighbours, and at the ends
    /// of others within that: on what is round they may see its other side.
    pub fn is_even_over(
        self,
        scene: &Scene,
        si: &SurfaceInteraction,
        ray: &Ray,
        t: f64,
        step: &RayDifferential,
        mut others: impl Iterator<Item = Vec3>,
    ) -> bool {
        let within = Self::length(si, ray, t, step);
        self.is_even_within(scene, si, self.growth(scene, si, ray, t, step))
            && (self.curvature(scene) == 0.0 || others.all(|end| (end - si.p).length() <= within))
    }

    /// How long the steps of a ray to its neighbours are on a surface, both together.
    fn length(si: &SurfaceInteraction, ray: &Ray, t: f64, step: &RayDifferential) -> f32 {
        let [across, down] = step.on_plane(ray.d, t as f32, si.ng, f32::MAX.sqrt() * 0.25);
        across.length() + down.length()
    }

    /// By which part of themselves the steps of a ray to its neighbours grow on the way: with the distance, and on what
    /// is round, where it turns away, and around the poles of its uv. Infinite at its rim, where nothing is as wide as
    /// it seems.
    fn growth(self, scene: &Scene, si: &SurfaceInteraction, ray: &Ray, t: f64, step: &RayDifferential) -> f32 {
        let length = Self::length(si, ray, t, step);
        let (curvature, away) = (self.curvature(scene), length / t as f32);
        if curvature == 0.0 {
            return away;
        }
        let (turn, cos) = (0.5 * curvature * length, si.ng.dot(si.wo));
        let Footprint { dx, dy, .. } = si.footprint;
        if turn < 0.25 * cos { turn / cos + away + PI * (dx.abs() + dy.abs()).max_element() } else { f32::INFINITY }
    }

    fn is_even_within(self, scene: &Scene, si: &SurfaceInteraction, growth: f32) -> bool {
        if growth == f32::INFINITY {
            return false;
        }
        let Footprint { dx, dy, edges } = si.footprint;
        // Of the steps: a half leads to the border
        let part = (0.5 + 2.0 * growth).min(1.0);
        let si = SurfaceInteraction { footprint: Footprint { dx: dx * part, dy: dy * part, edges }, ..*si };
        scene.materials[si.material.index()].is_even(&si, &scene.textures)
    }

    /// How much its normal turns over a metre, in radians.
    pub fn curvature(self, scene: &Scene) -> f32 {
        match self {
            Candidate::Sphere(i) => (1.0 / scene.geometry.spheres[i as usize].shape.r) as f32,
            _ => 0.0,
        }
    }
}
