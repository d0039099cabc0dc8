//! All that lies on a camera ray, whatever stands in front: what each thing would cover if it were alone.

use std::cell::RefCell;

use fearless_simd::{Level, Simd};

use super::Scene;
use super::geometry::{Geometry, PlacedTarget, UpperItem};
use super::occluders::Opacity;
use crate::accel::{TraceRay, dispatch_eight};
use crate::ids::SurfaceId;
use crate::math::{Ray, Vec3};
use crate::shape::Mesh;

impl Scene {
    /// Calls `found` with every surface, and every light, that the camera ray would end at if nothing else were there;
    /// with some of them more than once. Of several at exactly one place that no ray can tell apart, with the lowest.
    pub(crate) fn meet_all(&self, ray: &Ray, mut found: impl FnMut(SurfaceId)) {
        let geometry = &self.geometry;
        if geometry.listed {
            let spheres = geometry.spheres.iter().filter(|sphere| sphere.seen);
            spheres.filter(|sphere| sphere.shape.intersect(ray).is_some()).for_each(|sphere| found(sphere.surface));
            let flats = geometry.parallelograms.iter().filter(|flat| flat.seen);
            flats.filter(|flat| flat.shape.intersect(ray).is_some()).for_each(|flat| found(flat.surface));
        }
        let first_light = geometry.surfaces.len() as u32;
        self.seen_lights.meet(self.level, ray, f32::INFINITY, |light, _| {
            let area = self.lights[light as usize].area();
            if area.is_some_and(|area| area.shape.intersect(ray).is_some()) {
                found(SurfaceId(first_light + light));
            }
        });
        self.meet_all_layers(ray, &mut found);
        if geometry.has_trees() {
            geometry.meet_all(self.level, ray, &RefCell::new(&mut found));
        }
    }
}

/// Who hears of surfaces. The filters of trees, which are asked about each triangle that a ray meets, cannot change
/// what they hold.
type Found<'a> = RefCell<&'a mut dyn FnMut(SurfaceId)>;

impl Geometry {
    fn meet_all(&self, level: Level, ray: &Ray, found: &Found) {
        dispatch_eight!(level, simd => self.meet_all_with(simd, ray, found));
    }

    #[inline(always)]
    fn meet_all_with<S: Simd>(&self, simd: S, ray: &Ray, found: &Found) {
        if let Some(world) = &self.world {
            self.meet_all_of_mesh(simd, &world.mesh, SurfaceId(0), world.camera, ray.o, ray.d, found);
        }
        self.unbounded.iter().for_each(|thing| self.meet_all_of_placed(simd, *thing, ray, found));
        if self.items.is_empty() {
            return;
        }
        self.upper.any(simd, &TraceRay::new(ray.o, ray.d), f32::INFINITY, |item| {
            match self.items[item as usize] {
                UpperItem::Sphere(i) => {
                    let sphere = &self.spheres[i as usize];
                    if sphere.seen && sphere.shape.intersect(ray).is_some() {
                        (found.borrow_mut())(sphere.surface);
                    }
                }
                UpperItem::Parallelogram(i) => {
                    let flat = &self.parallelograms[i as usize];
                    if flat.seen && flat.shape.intersect(ray).is_some() {
                        (found.borrow_mut())(flat.surface);
                    }
                }
                UpperItem::Placed(i) => self.meet_all_of_placed(simd, i, ray, found),
            }
            false
        });
    }

    #[inline(always)]
    fn meet_all_of_placed<S: Simd>(&self, simd: S, index: u32, ray: &Ray, found: &Found) {
        let thing = &self.placed[index as usize];
        if thing.camera == Opacity::Clear {
            return;
        }
        let single_sided = self.surfaces[thing.surface.index()].single_sided;
        let own = thing.placement.ray(ray);
        let is_met = match thing.target {
            PlacedTarget::Mesh(mesh) => {
                let (mesh, o, d) = (&self.meshes[mesh as usize], own.o.as_vec3(), own.d.as_vec3());
                return self.meet_all_of_mesh(simd, mesh, thing.surface, thing.camera, o, d, found);
            }
            PlacedTarget::Points(points) => {
                self.point_sets[points as usize].intersect(simd, &own, f32::INFINITY, single_sided).is_some()
            }
            PlacedTarget::Solid(solid) => {
                self.solids[solid as usize].intersect(&own, 0.0, f64::INFINITY, single_sided).is_some()
            }
        };
        if is_met {
            (found.borrow_mut())(thing.surface);
        }
    }

    #[inline(never)]
    #[allow(clippy::too_many_arguments, reason = "a mesh with its place, a ray, and who hears of it")]
    fn meet_all_of_mesh<S: Simd>(
        &self,
        simd: S,
        mesh: &Mesh,
        first: SurfaceId,
        opacity: Opacity,
        o: Vec3,
        d: Vec3,
        found: &Found,
    ) {
        if opacity == Opacity::Clear {
            return;
        }
        // No triangle is enough, so that all on the ray are asked
        let asks = |triangle| {
            if opacity == Opacity::Opaque || self.seen(mesh, first.0, triangle, d) {
                (found.borrow_mut())(SurfaceId(first.0 + mesh.part(triangle).surface));
            }
            false
        };
        simd.vectorize(
            #[inline(always)]
            || mesh.tree.any(simd, &TraceRay::new(o, d), f32::INFINITY, &asks),
        );
    }
}
