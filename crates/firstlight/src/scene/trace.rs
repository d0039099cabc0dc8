//! What a ray sees, and whether light gets through.

use super::Scene;
use crate::color::Rgb;
use crate::ids::SurfaceId;
use crate::light::LightKind;
use crate::math::{Ray, ShadowRay};
use crate::shape::{RayDifferential, ShapePoint, SurfaceInteraction};

/// The first surface on a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Where: the ray's `o + t d`, t > 0. In f64: what is first on a ray is not left to rounding.
    pub t: f64,
    /// What.
    pub surface: SurfaceId,
}

/// What a camera ray ends at.
#[derive(Clone, Copy, Debug)]
pub enum CameraHit {
    /// A surface to be lit.
    Surface(SurfaceInteraction),
    /// A light, seen as its colour.
    Emission(Rgb),
    /// Nothing.
    Background,
}

impl Scene {
    /// The first surface on a ray; of several at the same distance, the one with the lowest id.
    #[inline(always)]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        let mut meet = |t: Option<f64>, id: usize| {
            if let Some(t) = t
                && nearest.is_none_or(|hit| t < hit.t)
            {
                nearest = Some(Hit { t, surface: SurfaceId(id as u32) });
            }
        };
        let mut id = 0;
        for sphere in &self.spheres {
            meet(sphere.intersect(ray), id);
            id += 1;
        }
        for parallelogram in &self.parallelograms {
            meet(parallelogram.intersect(ray), id);
            id += 1;
        }
        for light in &self.lights {
            if let LightKind::Rectangle(rectangle) = &light.kind
                && rectangle.visible
            {
                meet(rectangle.shape.intersect(ray), id);
            }
            id += 1;
        }
        nearest
    }

    /// Whether anything stands between a surface and a light. Any hit will do, so the order is of no account.
    #[inline]
    pub fn occluded(&self, ray: &ShadowRay) -> bool {
        let finite = ray.t_max == 1.0;
        self.spheres.iter().any(|sphere| sphere.shadow(ray.p, ray.error).blocks(ray.l, finite))
            || self.flat_occluders.iter().any(|flat| flat.shadow(ray.p, ray.error).blocks(ray.l, finite))
    }

    /// The surface at a hit, turned to the viewer. `differential` is that of the camera ray.
    ///
    /// # Panics
    /// If the hit is a light's: a light has no material.
    #[inline(always)]
    pub fn surface(&self, ray: &Ray, hit: &Hit, differential: &RayDifferential) -> SurfaceInteraction {
        let id = hit.surface.index();
        let ShapePoint { p, error, normal, uv, footprint } = match id.checked_sub(self.spheres.len()) {
            None => self.spheres[id].point(ray, hit.t, differential),
            Some(i) => self.parallelograms[i].point(ray, hit.t, differential),
        };
        let wo = -ray.d;
        let ng = if normal.dot(wo) < 0.0 { -normal } else { normal };
        let material = self.shape_materials[id];
        SurfaceInteraction { p, error, ng, ns: ng, wo, uv, footprint, surface: hit.surface, material }
    }

    /// What a camera ray ends at.
    #[inline(always)]
    pub fn look(&self, ray: &Ray, differential: &RayDifferential) -> CameraHit {
        match self.intersect(ray) {
            None => CameraHit::Background,
            Some(hit) => match hit.surface.index().checked_sub(self.shape_materials.len()) {
                Some(light) => CameraHit::Emission(self.lights[light].radiance),
                None => CameraHit::Surface(self.surface(ray, &hit, differential)),
            },
        }
    }
}
