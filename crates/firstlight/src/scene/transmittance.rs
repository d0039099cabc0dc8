//! How much light layers let through to a surface: the product over all of them of 1 - alpha. Factors are sorted by
//! surface, primitive and distance: in another order a product rounds differently, and the order of a traversal would
//! decide its bits. Textures are read at their finest level, where a mask is 0 or 1.

use std::cell::RefCell;

use fearless_simd::{Level, Simd};

use super::Scene;
use super::geometry::{At, Geometry, Hit, PlacedSpot, PlacedTarget, UpperItem};
use super::shadow_rays::{ShadowMesh, ShadowRays};
use crate::accel::{TraceRay, dispatch_eight, dispatch_sixteen};
use crate::ids::SurfaceId;
use crate::math::{DRay, LANES, Ray, ShadowRay};
use crate::shape::{PacketHits, RayDifferential, ShadowTerminator, TrianglePoint, bits};

/// The factors of the layers on up to sixteen rays.
struct LayerFactors<'a> {
    scene: &'a Scene,
    /// The factors that are neither 0 nor 1.
    factors: Vec<LayerFactor>,
}

/// What one layer leaves of the light along one ray.
struct LayerFactor {
    lane: usize,
    hit: Hit,
    primitive: u32,
    left: f32,
}

impl Scene {
    /// The part of the light along a shadow ray that arrives, 0 to 1: 0 where anything opaque stands in the way, else
    /// the product of 1 - alpha over the surfaces in between that are not opaque.
    pub fn transmittance(&self, ray: &ShadowRay) -> f32 {
        if self.occluded_by_opaque(ray) { 0.0 } else { self.left_by_layers(ray) }
    }

    /// The part that layers let through.
    #[inline(always)]
    pub(crate) fn left_by_layers(&self, ray: &ShadowRay) -> f32 {
        if self.has_layers() { self.product_of_layers(ray) } else { 1.0 }
    }

    #[inline(never)]
    fn product_of_layers(&self, ray: &ShadowRay) -> f32 {
        let mut factors = LayerFactors { scene: self, factors: Vec::new() };
        if self.geometry.stopped_by_layers(self.level, &LaneRay { ray, lane: 0 }, &mut factors) {
            0.0
        } else {
            factors.product(0)
        }
    }
}

impl Scene {
    /// The parts of the light along the shadow rays in `active` that layers let through: the same as those of single
    /// rays.
    #[inline(never)]
    pub(crate) fn left_by_layers16(&self, shadows: &ShadowRays, active: u16) -> [f32; LANES] {
        let geometry = &*self.geometry;
        let mut factors = LayerFactors { scene: self, factors: Vec::new() };
        let stopped = dispatch_sixteen!(
            self.level,
            simd => geometry.stopped_by_layers16(simd, shadows, active, &RefCell::new(&mut factors)),
            else {
                one_by_one(active, |lane| {
                    geometry.stopped_by_layers(self.level, &LaneRay { ray: &shadows.ray(lane), lane }, &mut factors)
                })
            }
        );
        let mut left = [0.0; LANES];
        for lane in bits(u64::from(active & !stopped)) {
            left[lane] = factors.product(lane);
        }
        left
    }
}

/// A ray, and its lane.
struct LaneRay<'a> {
    ray: &'a ShadowRay,
    lane: usize,
}

/// The factors, shared by the callbacks of traversals, which are `Fn`.
type SharedFactors<'a, 'b> = RefCell<&'a mut LayerFactors<'b>>;

impl LayerFactors<'_> {
    /// Adds the hit of a layer, unless the ray starts on it. Returns whether it stops all light. Hits with alpha 0,
    /// most of those of masks, skip `is_start`.
    #[inline]
    fn add(&mut self, lane: usize, hit: Hit, line: impl Fn() -> Ray, is_start: impl FnOnce() -> bool) -> bool {
        let scene = self.scene;
        let geometry = &*scene.geometry;
        let surface = &geometry.surfaces[hit.surface.index()];
        let material = surface.material.unwrap_or_else(|| geometry.face_material(&hit));
        let Some(alpha) = scene.alpha_of(material) else { return !is_start() };
        let alpha = match hit.at {
            At::Placed(index, PlacedSpot::Triangle(point)) => {
                let PlacedTarget::Mesh(mesh) = geometry.placed[index as usize].target else { return false };
                let mesh = &geometry.meshes[mesh as usize];
                alpha.at_point(|set| mesh.uv(point, set), mesh.alpha(point), &scene.textures)
            }
            _ => {
                let point = geometry.point(&line(), &hit, &RayDifferential::default(), ShadowTerminator::Hard);
                alpha.at_point(|_| point.uv, point.alpha, &scene.textures)
            }
        };
        if alpha <= 0.0 || is_start() {
            return false;
        }
        if alpha < 1.0 {
            let primitive = geometry.primitive(&hit).unwrap_or(0);
            self.factors.push(LayerFactor { lane, hit, primitive, left: 1.0 - alpha });
        }
        alpha >= 1.0
    }

    /// The product of all factors of a ray.
    #[inline]
    fn product(&self, lane: usize) -> f32 {
        if self.factors.is_empty() { 1.0 } else { self.ordered_product(lane) }
    }

    fn ordered_product(&self, lane: usize) -> f32 {
        let geometry = &*self.scene.geometry;
        let mut factors: Vec<&LayerFactor> = self.factors.iter().filter(|factor| factor.lane == lane).collect();
        let place = |one: &&LayerFactor| (one.hit.surface, one.primitive);
        factors.sort_by(|a, b| place(a).cmp(&place(b)).then_with(|| a.hit.t.total_cmp(&b.hit.t)));
        let mut product = 1.0;
        for (k, factor) in factors.iter().enumerate() {
            // A surface without a seam is met once on the edges of its triangles
            let mut before = factors[..k].iter().rev().take_while(|one| one.hit.surface == factor.hit.surface);
            if !before.any(|one| geometry.are_neighbours(&one.hit, &factor.hit)) {
                product *= factor.left;
            }
        }
        product
    }
}

impl Geometry {
    /// Adds the layers on a shadow ray until one stops all light. Returns whether one does.
    fn stopped_by_layers(&self, level: Level, ray: &LaneRay, factors: &mut LayerFactors) -> bool {
        dispatch_eight!(level, simd => self.stopped_by_layers_with(simd, ray, factors))
    }

    #[inline(always)]
    fn stopped_by_layers_with<S: Simd>(&self, simd: S, of: &LaneRay, factors: &mut LayerFactors) -> bool {
        let Some(layers) = &self.layers else { return false };
        let ray = of.ray;
        if layers.unbounded.iter().any(|thing| self.stopped_by_placed(simd, *thing, of, factors)) {
            return true;
        }
        layers.upper.any(simd, &TraceRay::new(ray.start, ray.l), ray.t_max, |item| match layers.items[item as usize] {
            item @ (UpperItem::Sphere(_) | UpperItem::Parallelogram(_)) => self.stopped_by_listed(item, of, factors),
            UpperItem::Placed(i) => self.stopped_by_placed(simd, i, of, factors),
        })
    }

    /// The same for the rays in `active`. Returns those that a layer stops.
    #[inline(always)]
    fn stopped_by_layers16<S: Simd>(&self, simd: S, shadows: &ShadowRays, active: u16, factors: &SharedFactors) -> u16 {
        let Some(layers) = &self.layers else { return 0 };
        let mut done = 0;
        for thing in &layers.unbounded {
            done |= self.stopped_by_placed16(simd, *thing, shadows, active & !done, factors);
        }
        let whole = [shadows.from[0].t_max; LANES];
        done | layers.upper.any16(simd, &shadows.rays, &whole, active & !done, |item, asking| {
            match layers.items[item as usize] {
                UpperItem::Placed(i) => self.stopped_by_placed16(simd, i, shadows, asking, factors),
                item => one_by_one(asking, |lane| {
                    self.stopped_by_listed(item, &LaneRay { ray: &shadows.ray(lane), lane }, &mut factors.borrow_mut())
                }),
            }
        })
    }

    #[inline(never)]
    fn stopped_by_placed16<S: Simd>(
        &self,
        simd: S,
        index: u32,
        shadows: &ShadowRays,
        active: u16,
        factors: &SharedFactors,
    ) -> u16 {
        let thing = &self.placed[index as usize];
        let PlacedTarget::Mesh(_) = thing.target else {
            return one_by_one(active, |lane| {
                self.stopped_by_placed(
                    simd,
                    index,
                    &LaneRay { ray: &shadows.ray(lane), lane },
                    &mut factors.borrow_mut(),
                )
            });
        };
        let light = shadows.from[0].to.light;
        let Some(mesh) = ShadowMesh::of(self, index + 1, light).filter(|_| self.stops(thing.shadow, light)) else {
            return 0;
        };
        let own = mesh.own_rays(&shadows.rays, active);
        let rays = own.as_ref().unwrap_or(&shadows.rays);
        let stops = |hits: &PacketHits| {
            let triangle = hits.triangle;
            if !mesh.casts(triangle) {
                return 0;
            }
            let factors = &mut **factors.borrow_mut();
            let surface = SurfaceId(thing.surface.0 + mesh.mesh.part(triangle).surface);
            let is_stopped = |lane: &usize| {
                let point = TrianglePoint { triangle, u: hits.u[*lane], v: hits.v[*lane] };
                let at = At::Placed(index, PlacedSpot::Triangle(point));
                let line = || shadows.ray(*lane).line();
                let is_start = || mesh.is_start(shadows.origin(*lane), rays.o(*lane), triangle);
                factors.add(*lane, Hit { t: f64::from(hits.t[*lane]), surface, at }, line, is_start)
            };
            bits(hits.lanes).filter(is_stopped).fold(0, |stopped, lane| stopped | 1 << lane)
        };
        simd.vectorize(
            #[inline(always)]
            || mesh.mesh.tree.any16(simd, rays, &shadows.t_end, active, &stops),
        )
    }

    /// A sphere or a parallelogram of [`stopped_by_layers`](Self::stopped_by_layers).
    #[inline(never)]
    fn stopped_by_listed(&self, item: UpperItem, &LaneRay { ray, lane }: &LaneRay, factors: &mut LayerFactors) -> bool {
        let line = || ray.line();
        match item {
            UpperItem::Sphere(i) => {
                let owned = &self.spheres[i as usize];
                let exact = DRay { o: ray.start.as_dvec3(), d: ray.l.as_dvec3() };
                let within = [0.0, f64::from(ray.end())];
                self.casts(owned.surface, ray.to.light)
                    && owned.shape.crossings(&exact, within, false).into_iter().flatten().any(|t| {
                        factors.add(lane, Hit { t, surface: owned.surface, at: At::Sphere(i) }, line, || false)
                    })
            }
            UpperItem::Parallelogram(i) => {
                let owned = &self.parallelograms[i as usize];
                let hit = || {
                    let t = owned.shape.crossing(ray.start.as_dvec3(), ray.l.as_dvec3());
                    Hit { t, surface: owned.surface, at: At::Parallelogram(i) }
                };
                self.casts(owned.surface, ray.to.light)
                    // As with opaque parallelograms, a coplanar one does not block the ray
                    && owned.shape.shadow(ray.p, ray.error).blocks(ray.l, ray.is_finite())
                    && factors.add(lane, hit(), line, || false)
            }
            UpperItem::Placed(_) => false,
        }
    }

    #[inline(never)]
    fn stopped_by_placed<S: Simd>(&self, simd: S, index: u32, of: &LaneRay, factors: &mut LayerFactors) -> bool {
        let (thing, &LaneRay { ray, lane }) = (&self.placed[index as usize], of);
        let line = || ray.line();
        if !self.stops(thing.shadow, ray.to.light) {
            return false;
        }
        let own = thing.placement.line(ray.start, ray.l);
        let end = ray.end();
        match thing.target {
            PlacedTarget::Mesh(_) => {
                let Some(mesh) = ShadowMesh::of(self, index + 1, ray.to.light) else { return false };
                let (o, d) = (own.o.as_vec3(), own.d.as_vec3());
                simd.vectorize(
                    #[inline(always)]
                    || {
                        mesh.mesh.tree.each(simd, &TraceRay::new(o, d), end, |hit| {
                            if !mesh.casts(hit.triangle) {
                                return false;
                            }
                            let surface = SurfaceId(thing.surface.0 + mesh.mesh.part(hit.triangle).surface);
                            let point = TrianglePoint { triangle: hit.triangle, u: hit.u, v: hit.v };
                            let at = At::Placed(index, PlacedSpot::Triangle(point));
                            let is_start = || mesh.is_start(ray, o, hit.triangle);
                            factors.add(lane, Hit { t: f64::from(hit.t), surface, at }, line, is_start)
                        })
                    },
                )
            }
            PlacedTarget::Points(points) => {
                self.point_sets[points as usize].each(simd, &own, end, false, |t, point| {
                    let at = At::Placed(index, PlacedSpot::Point(point));
                    factors.add(lane, Hit { t, surface: thing.surface, at }, line, || false)
                })
            }
            PlacedTarget::Solid(solid) => {
                let mut after = 0.0;
                while let Some(hit) = self.solids[solid as usize].intersect(&own, after, end.into(), false) {
                    let at = At::Placed(index, PlacedSpot::Part(hit.part));
                    if factors.add(lane, Hit { t: hit.t, surface: thing.surface, at }, line, || false) {
                        return true;
                    }
                    after = hit.t;
                }
                false
            }
        }
    }
}

/// Those of the lanes in `active` that are `stopped`.
#[inline(always)]
fn one_by_one(active: u16, mut stopped: impl FnMut(usize) -> bool) -> u16 {
    bits(active.into()).filter(|lane| stopped(*lane)).fold(0, |mask, lane| mask | 1 << lane)
}
