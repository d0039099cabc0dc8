//! Squares of pixels that see one surface, proved without a ray for each pixel.
//!
//! The camera rays of a square lie in the frustum between the rays through its corners. Shapes outside of the frustum
//! are culled. If the rays through the corners all hit one convex shape, so do all rays between them; if that shape is
//! nearer in the frustum than any other can be, no ray sees another.

use super::square::Square;
use super::visible_shape::VisibleShape;
use crate::accel::{HalfSpace, Planes};
use crate::light::AreaShape;
use crate::math::{DVec3, Facet, Ray, Vec3};
use crate::scene::{FewFacets, Scene};
use crate::shape::{Parallelogram, Sphere};

/// The camera rays of a square of pixels.
pub(crate) struct TileFrustum {
    corners: [Ray; 4],
    /// Outward unit normals.
    sides: [DVec3; 4],
    forward: Vec3,
    /// The axis of the enclosing cone, the cone's radius at the origin of the axis, and the sine and cosine of half its
    /// angle.
    middle: Ray,
    width: f64,
    sin: f64,
    cos: f64,
}

/// The relative difference beyond which two depths, heights or distances count as different.
const SLACK: f64 = 1e-5;

impl TileFrustum {
    pub fn new(scene: &Scene, square: Square) -> Self {
        let [left, top, side] = [square.x, square.y, square.side].map(|pixels| pixels as f32);
        let (right, bottom) = (left + side, top + side);
        let at = |x: f32, y: f32| scene.camera.local_ray(x, y, 1.0).0;
        let corners = [at(left, top), at(right, top), at(right, bottom), at(left, bottom)];
        let middle = at(0.5 * (left + right), 0.5 * (top + bottom));
        let mut sides = [DVec3::ZERO; 4];
        for i in 0..4 {
            let (a, b) = (&corners[i], &corners[(i + 1) % 4]);
            // From the origin of `a`: rays of neighbours are nearly parallel, and the eye may be far away
            let to = |ray: &Ray| (ray.o.as_dvec3() - a.o.as_dvec3()) + ray.d.as_dvec3();
            let n = a.d.as_dvec3().cross(to(b)).normalize_or_zero();
            sides[i] = if n.dot(to(&middle)) > 0.0 { -n } else { n };
        }
        let frame = scene.camera.frame();
        let sin = corners.iter().fold(0.0f64, |sin, ray| sin.max(f64::from(middle.d.cross(ray.d).length())));
        let width = corners.iter().fold(0.0f64, |width, ray| width.max(f64::from((ray.o - middle.o).length())));
        let (sin, width) = (sin * (1.0 + SLACK) + SLACK * SLACK, width * (1.0 + SLACK));
        let cos = (1.0 - sin * sin).max(0.0).sqrt();
        TileFrustum { corners, sides, forward: frame.forward, middle, width, sin, cos }
    }

    /// Whether the enclosing cone misses a ball.
    fn cone_misses(&self, c: DVec3, r: f64) -> bool {
        let s = c - self.middle.o.as_dvec3();
        // Normalized in 64 bits: the 32 bits of the ray are not enough at large distances
        let along = s.dot(self.middle.d.as_dvec3().normalize());
        let aside = (s.length_squared() - along * along).max(0.0).sqrt();
        // Behind the apex the nearest point of the cone is the apex, and the true distance is larger than this one
        aside * self.cos - along * self.sin > r + self.width + (along.abs() + aside) * SLACK
    }

    /// The depth of a point: its distance in front of the camera along the viewing direction.
    fn depth(&self, q: DVec3) -> f64 {
        self.forward.as_dvec3().dot(q - self.middle.o.as_dvec3())
    }

    fn misses_sphere(&self, sphere: &Sphere) -> bool {
        if self.cone_misses(sphere.c, sphere.r) {
            return true;
        }
        // Directions of rays are rounded
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

    /// For the ray of each corner: the height of its origin over a plane, and the change of that per metre.
    fn heights(&self, scene: &Scene, plane: u32) -> [[f64; 2]; 4] {
        let (thing, plane) = scene.geometry.plane(plane);
        let (_, normal) = plane.place();
        let scale = 1.0 / thing.placement.normal(normal).length();
        self.corners.each_ref().map(|ray| plane.approach(&thing.placement.ray(ray)).map(|height| height * scale))
    }

    /// Whether all rays lead away from a plane on one side of it, or all originate in it.
    fn misses_plane(&self, scene: &Scene, plane: u32) -> bool {
        let heights = self.heights(scene, plane);
        let side = heights[0][0].signum();
        let leads_away = |(ray, [height, gain]): (&Ray, &[f64; 2])| {
            height * side > f64::from(ray.o.abs().max_element()) * SLACK && gain * side > SLACK
        };
        heights.iter().all(|[height, _]| *height == 0.0) || self.corners.iter().zip(&heights).all(leads_away)
    }

    /// Those of some shapes that the rays may hit.
    pub fn candidates(&self, scene: &Scene, shapes: &[VisibleShape]) -> Vec<VisibleShape> {
        let geometry = &scene.geometry;
        let may_be_hit = |shape: &VisibleShape| match shape {
            VisibleShape::Sphere(i) => !self.misses_sphere(&geometry.spheres[*i as usize].shape),
            VisibleShape::Parallelogram(i) => !self.misses_flat(&geometry.parallelograms[*i as usize].shape),
            VisibleShape::Plane(i) => !self.misses_plane(scene, *i),
            VisibleShape::Facet(_) => unreachable!("facets are no candidates of the whole film"),
            VisibleShape::Light(i) => scene.lights[*i as usize].area().is_some_and(|area| match &area.shape {
                AreaShape::Rectangle(rectangle) => !self.misses_flat(&rectangle.shape),
                AreaShape::Sphere(sphere) => !self.misses_sphere(&sphere.shape),
                _ => true,
            }),
            VisibleShape::Trees => geometry.may_meet(scene.level, &self.planes()),
            VisibleShape::Layers => geometry.may_meet_layers(scene.level, &self.planes()),
        };
        shapes.iter().copied().filter(may_be_hit).collect()
    }

    /// The half spaces that the frustum is the intersection of.
    fn planes(&self) -> Planes {
        let eye = HalfSpace { n: -self.forward.as_dvec3(), p: self.middle.o.as_dvec3() };
        let side = |i: usize| HalfSpace { n: self.sides[i], p: self.corners[i].o.as_dvec3() };
        Planes([side(0), side(1), side(2), side(3), eye])
    }

    /// The least and the greatest depth at which the rays hit a shape; `None` unless all rays provably hit it.
    fn cover(&self, scene: &Scene, shape: VisibleShape) -> Option<[f64; 2]> {
        let depths = |intersect: &dyn Fn(&Ray) -> Option<f64>| {
            let mut range = [f64::INFINITY, 0.0f64];
            for ray in &self.corners {
                let t = intersect(ray)?;
                let depth = self.depth(ray.o.as_dvec3() + ray.d.as_dvec3() * t);
                range = [range[0].min(depth), range[1].max(depth)];
            }
            Some(range)
        };
        match shape {
            VisibleShape::Parallelogram(i) => {
                let flat = &scene.geometry.parallelograms[i as usize].shape;
                depths(&|ray| flat.intersect(ray))
            }
            VisibleShape::Plane(_) => depths(&|ray| shape.intersect(scene, ray)),
            VisibleShape::Facet(facet) => {
                let flat = scene.geometry.facet(facet);
                self.barycentrics(&flat)?.as_flattened().iter().all(|inside| *inside > 0.0).then_some(())?;
                depths(&|ray| flat.intersect(ray))
            }
            VisibleShape::Sphere(i) => {
                let sphere = &scene.geometry.spheres[i as usize].shape;
                let inside = |ray: &Ray| (ray.o.as_dvec3() - sphere.c).length() <= sphere.r * (1.0 + SLACK);
                if self.corners.iter().any(inside) {
                    return None;
                }
                depths(&|ray| sphere.intersect(ray))?;
                Some([self.nearest(scene, shape), self.middle_depth(sphere.c)])
            }
            VisibleShape::Light(_) | VisibleShape::Trees | VisibleShape::Layers => None,
        }
    }

    /// The barycentric coordinates at which the rays through the corners hit the plane of a facet, each set to 0 where
    /// its sign is below the rounding of the rays. `None` unless all of them hit the plane.
    fn barycentrics(&self, flat: &Parallelogram) -> Option<[[f64; 3]; 4]> {
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

    /// Whether all rays pass a facet beyond one of its edges.
    fn misses_facet(&self, scene: &Scene, facet: Facet) -> bool {
        let insides = self.barycentrics(&scene.geometry.facet(facet));
        insides.is_some_and(|insides| (0..3).any(|side| insides.iter().all(|inside| inside[side] < 0.0)))
    }

    /// The greatest depth of the point of a ray that is nearest to `c`. Rays from outside hit a sphere around `c`
    /// before that point. Beside the axis of a wide view it may be deeper than `c` itself.
    fn middle_depth(&self, c: DVec3) -> f64 {
        // For directions of unit depth, both are linear over the film
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

    /// The least depth at which the rays can hit a shape.
    fn nearest(&self, scene: &Scene, shape: VisibleShape) -> f64 {
        match shape {
            VisibleShape::Sphere(i) => {
                let sphere = &scene.geometry.spheres[i as usize].shape;
                let nearest = self.depth(sphere.c) - sphere.r;
                // The sphere lies behind its tangent plane where the axis hits it
                let from = self.middle.o.as_dvec3() - sphere.c;
                match sphere.intersect(&self.middle) {
                    Some(t) if from.length() > sphere.r * (1.0 + SLACK) => {
                        let q = from + self.middle.d.as_dvec3() * t;
                        nearest.max(self.nearest_on_plane(q / q.length(), sphere.c + q).unwrap_or(nearest))
                    }
                    _ => nearest,
                }
            }
            VisibleShape::Parallelogram(i) => self.nearest_flat(&scene.geometry.parallelograms[i as usize].shape),
            VisibleShape::Plane(i) => self.nearest_plane(scene, i),
            VisibleShape::Facet(facet) => self.nearest_flat(&scene.geometry.facet(facet)),
            VisibleShape::Light(i) => match scene.lights[i as usize].area().map(|area| &area.shape) {
                Some(AreaShape::Rectangle(rectangle)) => self.nearest_flat(&rectangle.shape),
                Some(_) => f64::NEG_INFINITY,
                None => f64::INFINITY,
            },
            VisibleShape::Layers => f64::NEG_INFINITY,
            VisibleShape::Trees => {
                let (forward, planes) = (self.forward.as_dvec3(), self.planes());
                let boxes = scene.geometry.tree_bounds().filter(|bounds| planes.may_meet(*bounds));
                boxes.fold(f64::INFINITY, |nearest, bounds| {
                    let [min, max] = [bounds.min, bounds.max].map(|q| q.as_dvec3() - self.middle.o.as_dvec3());
                    nearest.min(forward.max(DVec3::ZERO).dot(min) + forward.min(DVec3::ZERO).dot(max))
                })
            }
        }
    }

    fn nearest_flat(&self, flat: &Parallelogram) -> f64 {
        let on_shape = flat.deep_corners().iter().fold(f64::INFINITY, |z, q| z.min(self.depth(*q)));
        self.nearest_on_plane(flat.n, flat.p).map_or(on_shape, |on_plane| on_plane.max(on_shape))
    }

    /// The least depth at which the rays hit the plane through `p` with normal `n`; `None` unless all of them hit it.
    /// The depth, or its inverse in a perspective view, is linear over the film, so a corner has the least.
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

    /// The same for a placed plane that only some of the rays may hit: rays that originate on one side of it and do not
    /// approach it count as if they hit it very far away.
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

    /// The shape that all rays provably see. `candidates` are all shapes that they may hit.
    pub fn single_shape(&self, scene: &Scene, candidates: &[VisibleShape]) -> Option<VisibleShape> {
        // A few facets of what the trees hold are candidates like other shapes
        let mut facets = FewFacets::new();
        let is_few = candidates.contains(&VisibleShape::Trees)
            && scene.geometry.few_facets(scene.level, &self.planes(), &mut facets);
        let others = candidates.iter().copied().filter(|other| !(is_few && *other == VisibleShape::Trees));
        facets.retain(|facet| is_few && !self.misses_facet(scene, *facet));
        let facets = facets.iter().map(|facet| VisibleShape::Facet(*facet));
        let all = others.chain(facets);
        let covers = all.clone().filter_map(|one| Some((one, self.cover(scene, one)?[1])));
        let (one, far) = covers.min_by(|(_, one), (_, other)| one.total_cmp(other))?;
        let mut behind = all.filter(|other| *other != one).map(|other| match self.cover(scene, other) {
            Some([near, _]) => near,
            None => self.nearest(scene, other),
        });
        let is_only = behind.all(|near| near > far + (far.abs() + near.abs()) * SLACK);
        // Normals that a map bends are those of no shape
        (is_only && !scene.geometry.may_be_mapped(one.surface(scene))).then_some(one)
    }
}
