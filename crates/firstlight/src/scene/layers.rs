//! Layers: surfaces that are not opaque, on camera rays.
//!
//! They lie in trees of their own ([`Layers`](super::geometry::Layers)). A camera ray first finds the opaque thing that
//! it ends at, then all layers before it, front to back: each takes its alpha of what those before it leave.

use fearless_simd::{Level, Simd};

use super::Scene;
use super::geometry::{At, Geometry, Hit, PlacedSpot, PlacedTarget, UpperItem};
use super::occluders::Opacity;
use crate::accel::{TraceRay, dispatch_eight};
use crate::ids::{MaterialId, SurfaceId};
use crate::material::{Alpha, Material};
use crate::math::{DRay, DVec3, Ray};
use crate::shape::{Mesh, RayDifferential, SurfaceInteraction, TrianglePoint};

/// The most layers of a ray: the last one counts as opaque.
const MOST_LAYERS: usize = 64;
/// A layer that leaves less than this part of a ray counts as opaque: a quarter of a step of 1/255 of what is white.
const LEAST_LEFT: f32 = 1.0 / 1024.0;
/// Alpha from which on a layer is what a pixel shows: to ids, depth and normals.
const HALF: f32 = 0.5;
/// Weights of a corner up to which a ray meets the edge of a triangle, and its neighbour at the same place: far above
/// the rounding of single precision, and far below what is seen.
const ON_EDGE: f32 = 1e-6;
/// The relative difference of the distances at which a ray meets both.
const SAME_PLACE: f64 = 1e-5;

/// A layer on a camera ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layer {
    pub hit: Hit,
    pub surface: SurfaceInteraction,
    /// The part of the ray that ends there.
    pub weight: f32,
}

/// The layers of a camera ray, front to back. Keeps its memory.
#[derive(Debug, Default)]
pub(crate) struct LayerStack {
    found: Vec<LayerHit>,
    pub layers: Vec<Layer>,
    /// The part of the ray that goes past all of them.
    pub left: f32,
}

/// A place where a ray meets a layer.
#[derive(Clone, Copy, Debug)]
pub(super) struct LayerHit {
    pub hit: Hit,
    pub primitive: u32,
}

impl Scene {
    /// Whether anything is not opaque.
    #[inline(always)]
    pub(crate) fn has_layers(&self) -> bool {
        self.geometry.layers.is_some()
    }

    /// Whether anything stops a part of the light.
    pub(crate) fn has_blends(&self) -> bool {
        let is_blend = |material: &Material| material.common.alpha.is_some_and(|alpha| alpha.cutoff.is_none());
        self.has_layers() && self.materials.iter().any(is_blend)
    }

    /// Finds the layers of a camera ray before the opaque thing at its `end`.
    pub(crate) fn find_layers(
        &self,
        ray: &Ray,
        differential: &RayDifferential,
        end: Option<&Hit>,
        stack: &mut LayerStack,
    ) {
        stack.layers.clear();
        stack.left = 1.0;
        self.collect_layers(ray, end, &mut stack.found);
        for LayerHit { hit, .. } in &stack.found {
            let (surface, alpha) = self.layer_at(ray, hit, differential);
            if alpha <= 0.0 {
                continue;
            }
            let rest = stack.left * (1.0 - alpha);
            let is_last = rest < LEAST_LEFT || stack.layers.len() + 1 == MOST_LAYERS;
            let (weight, left) = if is_last { (stack.left, 0.0) } else { (stack.left * alpha, rest) };
            stack.layers.push(Layer { hit: *hit, surface, weight });
            stack.left = left;
            if is_last {
                break;
            }
        }
    }

    /// Where a camera ray meets a surface that is not opaque, whatever its alpha there.
    pub(crate) fn layers_of(&self, ray: &Ray, surface: SurfaceId) -> impl Iterator<Item = Hit> + use<> {
        let mut found = Vec::new();
        if self.has_layers() {
            self.collect_layers(ray, None, &mut found);
            found.retain(|one| one.hit.surface == surface);
        }
        found.into_iter().map(|one| one.hit)
    }

    /// What a camera ray shows: the first layer with an alpha of at least one half before the opaque thing at its
    /// `end`, else that.
    #[inline(always)]
    pub(crate) fn shown(&self, ray: &Ray, differential: &RayDifferential, end: Option<Hit>) -> Option<Hit> {
        if self.has_layers() { self.shown_past_layers(ray, differential, end) } else { end }
    }

    /// The same of a ray by itself, which stands for a point.
    pub(super) fn first_shown(&self, ray: &Ray) -> Option<Hit> {
        self.shown(ray, &RayDifferential::default(), self.intersect_local(ray))
    }

    #[inline(never)]
    fn shown_past_layers(&self, ray: &Ray, differential: &RayDifferential, end: Option<Hit>) -> Option<Hit> {
        let mut found = Vec::new();
        self.collect_layers(ray, end.as_ref(), &mut found);
        let is_shown = |one: &&LayerHit| self.layer_at(ray, &one.hit, differential).1 >= HALF;
        found.iter().find(is_shown).map(|one| one.hit).or(end)
    }

    /// The alpha of the first surface on a camera ray that has one above 0, or of the opaque thing at its `end`; 0 of
    /// nothing.
    pub(crate) fn first_opacity(&self, ray: &Ray, differential: &RayDifferential, end: Option<Hit>) -> f32 {
        let mut found = Vec::new();
        if self.has_layers() {
            self.collect_layers(ray, end.as_ref(), &mut found);
        }
        let mut alphas = found.iter().map(|one| self.layer_at(ray, &one.hit, differential).1);
        let of_end = if end.is_some() { 1.0 } else { 0.0 };
        alphas.find(|alpha| *alpha > 0.0).unwrap_or(of_end)
    }

    /// Calls `found` with the surfaces of all layers on a camera ray with an alpha of at least one half.
    pub(super) fn meet_all_layers(&self, ray: &Ray, mut found: impl FnMut(SurfaceId)) {
        if self.has_layers() {
            let mut all = Vec::new();
            self.collect_layers(ray, None, &mut all);
            let point = RayDifferential::default();
            let is_shown = |one: &&LayerHit| self.layer_at(ray, &one.hit, &point).1 >= HALF;
            all.iter().filter(is_shown).for_each(|one| found(one.hit.surface));
        }
    }

    /// The surface and the alpha of a layer where a camera ray meets it.
    fn layer_at(&self, ray: &Ray, hit: &Hit, differential: &RayDifferential) -> (SurfaceInteraction, f32) {
        let surface = self.local_surface(ray, hit, differential);
        let alpha = self.alpha_of(surface.material);
        let alpha = alpha.map_or(1.0, |alpha| alpha.at_surface(&surface, &self.textures));
        (surface, alpha)
    }

    /// The alpha of a material; `None` if it is opaque.
    pub(super) fn alpha_of(&self, material: MaterialId) -> Option<&Alpha> {
        self.materials[material.index()].common.alpha.as_ref()
    }

    /// Finds where a camera ray meets layers before its `end`: by distance, surface and primitive.
    fn collect_layers(&self, ray: &Ray, end: Option<&Hit>, found: &mut Vec<LayerHit>) {
        found.clear();
        let limit = end.map_or(f32::INFINITY, |end| (end.t as f32).next_up());
        self.geometry.meet_layers(self.level, ray, limit, &mut |hit| {
            if end.is_none_or(|end| hit.t < end.t || hit.t == end.t && hit.surface < end.surface) {
                let primitive = self.geometry.primitive(&hit).unwrap_or(0);
                found.push(LayerHit { hit, primitive });
            }
        });
        found.sort_by(|a, b| {
            let places = |one: &LayerHit| (one.hit.surface, one.primitive);
            a.hit.t.total_cmp(&b.hit.t).then_with(|| places(a).cmp(&places(b)))
        });
        self.geometry.drop_neighbours(found);
    }
}

/// Takes what a ray meets, one after the other.
pub(super) type LayerSink<'a> = &'a mut dyn FnMut(Hit);

impl Geometry {
    /// Calls `found` for each layer that a camera ray meets up to `limit`, in no order; each side of a shape is one.
    fn meet_layers(&self, level: Level, ray: &Ray, limit: f32, found: LayerSink) {
        dispatch_eight!(level, simd => self.meet_layers_with(simd, ray, limit, found));
    }

    #[inline(always)]
    fn meet_layers_with<S: Simd>(&self, simd: S, ray: &Ray, limit: f32, found: LayerSink) {
        let Some(layers) = &self.layers else { return };
        for thing in &layers.unbounded {
            self.meet_layer_placed(simd, *thing, ray, limit, found);
        }
        layers.upper.any(simd, &TraceRay::new(ray.o, ray.d), limit, |item| {
            match layers.items[item as usize] {
                UpperItem::Sphere(i) => {
                    let owned = &self.spheres[i as usize];
                    if self.surfaces[owned.surface.index()].visible {
                        let line = DRay { o: ray.o.as_dvec3(), d: ray.d.as_dvec3() };
                        let crossings = owned.shape.crossings(&line, [0.0, limit.into()], owned.shape.single_sided);
                        for t in crossings.into_iter().flatten() {
                            found(Hit { t, surface: owned.surface, at: At::Sphere(i) });
                        }
                    }
                }
                UpperItem::Parallelogram(i) => {
                    let owned = &self.parallelograms[i as usize];
                    if self.surfaces[owned.surface.index()].visible
                        && let Some(t) = owned.shape.intersect(ray)
                    {
                        found(Hit { t, surface: owned.surface, at: At::Parallelogram(i) });
                    }
                }
                UpperItem::Placed(i) => self.meet_layer_placed(simd, i, ray, limit, found),
            }
            false
        });
    }

    #[inline(never)]
    fn meet_layer_placed<S: Simd>(&self, simd: S, index: u32, ray: &Ray, limit: f32, found: LayerSink) {
        let thing = &self.placed[index as usize];
        if thing.camera == Opacity::Clear {
            return;
        }
        let single_sided = self.surfaces[thing.surface.index()].single_sided;
        let own = thing.placement.ray(ray);
        match thing.target {
            PlacedTarget::Mesh(mesh) => {
                let mesh = &self.meshes[mesh as usize];
                let (o, d) = (own.o.as_vec3(), own.d.as_vec3());
                simd.vectorize(
                    #[inline(always)]
                    || {
                        mesh.tree.each(simd, &TraceRay::new(o, d), limit, |hit| {
                            if thing.camera == Opacity::Opaque || self.seen(mesh, thing.surface.0, hit.triangle, d) {
                                let surface = SurfaceId(thing.surface.0 + mesh.part(hit.triangle).surface);
                                let point = TrianglePoint { triangle: hit.triangle, u: hit.u, v: hit.v };
                                let at = At::Placed(index, PlacedSpot::Triangle(point));
                                found(Hit { t: f64::from(hit.t), surface, at });
                            }
                            false
                        })
                    },
                );
            }
            PlacedTarget::Points(points) => {
                self.point_sets[points as usize].each(simd, &own, limit, single_sided, |t, point| {
                    let at = At::Placed(index, PlacedSpot::Point(point));
                    found(Hit { t, surface: thing.surface, at });
                    false
                });
            }
            PlacedTarget::Solid(solid) => {
                let mut after = 0.0;
                while let Some(hit) = self.solids[solid as usize].intersect(&own, after, f64::INFINITY, single_sided) {
                    let at = At::Placed(index, PlacedSpot::Part(hit.part));
                    found(Hit { t: hit.t, surface: thing.surface, at });
                    after = hit.t;
                }
            }
        }
    }

    /// Removes the second of two triangles that a ray meets on the edge that they share: a surface without a seam is
    /// met once. Hits come by distance.
    fn drop_neighbours(&self, found: &mut Vec<LayerHit>) {
        let mut k = 1;
        while k < found.len() {
            let is_same = |before: &LayerHit| self.are_neighbours(&before.hit, &found[k].hit);
            let is_near = |before: &&LayerHit| is_one_place(&before.hit, &found[k].hit);
            if found[..k].iter().rev().take_while(is_near).any(is_same) {
                found.remove(k);
            } else {
                k += 1;
            }
        }
    }

    /// Whether two hits of one ray are at one place on an edge, or at a corner, that two triangles of one surface
    /// share: both are on edges, the triangles have a corner in common, and the distances are the same but for
    /// rounding.
    pub(super) fn are_neighbours(&self, one: &Hit, other: &Hit) -> bool {
        let (At::Placed(index, PlacedSpot::Triangle(a)), At::Placed(same, PlacedSpot::Triangle(b))) =
            (one.at, other.at)
        else {
            return false;
        };
        let is_apart = index != same || one.surface != other.surface || !is_one_place(one, other);
        if is_apart || !is_on_edge(a) || !is_on_edge(b) {
            return false;
        }
        let PlacedTarget::Mesh(mesh) = self.placed[index as usize].target else { return false };
        share_corner(&self.meshes[mesh as usize], a.triangle, b.triangle)
    }
}

/// Whether two hits of one ray are equally far away, but for rounding.
fn is_one_place(one: &Hit, other: &Hit) -> bool {
    (other.t - one.t).abs() <= one.t.max(other.t) * SAME_PLACE
}

fn is_on_edge(point: TrianglePoint) -> bool {
    point.u.min(point.v).min(1.0 - point.u - point.v) <= ON_EDGE
}

fn share_corner(mesh: &Mesh, one: u32, other: u32) -> bool {
    let [one, other]: [[DVec3; 3]; 2] = [one, other].map(|triangle| mesh.corners(triangle));
    one.iter().any(|corner| other.contains(corner))
}
