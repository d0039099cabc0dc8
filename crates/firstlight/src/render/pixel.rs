//! One pixel of the renderers that sample every light at every camera ray: its rays, their hits, and the sum of the
//! light there.

use std::iter;
use std::ops::ControlFlow;

use super::{Counts, QUESTION_EVERY};
use crate::film::hits::camera_ray;
use crate::film::resolve::{PixelTerms, ScaledTerm, TermSums};
use crate::ids::LightId;
use crate::material::{Bsdf, LightTerm, MOMENTS, Moments, PerMoment, ShadingPoint};
use crate::math::{LaneSum, Ray};
use crate::scene::{Hit, LayerStack, Scene, TracedHit};
use crate::shape::{RayDifferential, SurfaceInteraction};

/// How the light of one source is summed at one surface: the only difference between those renderers.
pub(crate) trait Lighting {
    /// Sets the receiver for calls of [`gather`](Self::gather).
    fn set_receiver(&mut self, _scene: &Scene, _point: &ShadingPoint) {}

    /// The sums over the samples of light `index` at the receiver `point`, in the fixed order of
    /// [`LaneSum`](crate::math::LaneSum), of the weight times the cosine and of the weight times the highlight;
    /// occluded samples add 0.
    fn gather(&mut self, scene: &Scene, index: usize, point: &ShadingPoint, counts: &mut Counts) -> LobeSums;
}

/// The moments of one light, as sums in the order of lanes.
pub(crate) struct LobeSums(pub [LaneSum; MOMENTS]);

impl LobeSums {
    pub fn total(&self) -> Moments {
        PerMoment(std::array::from_fn(|k| self.0[k].total()))
    }
}

/// The sum over the camera rays of a pixel, term by term.
pub(crate) struct PixelSum {
    terms: PixelTerms,
    /// In scene order.
    lights: Vec<LightTerm>,
    /// The layers of one ray.
    stack: LayerStack,
}

impl PixelSum {
    pub fn new(scene: &Scene) -> Self {
        PixelSum {
            terms: PixelTerms::default(),
            lights: vec![LightTerm::BLACK; scene.lights.len()],
            stack: LayerStack::default(),
        }
    }

    pub fn clear(&mut self) {
        self.terms = PixelTerms::default();
        self.lights.fill(LightTerm::BLACK);
    }

    /// Adds the light of the n x n camera rays of pixel (`i`, `j`), row by row. `hit` returns the hit of the ray of a
    /// column and a row.
    pub fn sample(
        &mut self,
        scene: &Scene,
        [i, j]: [u32; 2],
        lighting: &mut impl Lighting,
        hit: impl Fn(u32, u32, &Ray) -> Option<Hit>,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let n = scene.antialiasing;
        for row in 0..n {
            for column in 0..n {
                let (ray, differential) = camera_ray(scene, i * n + column, j * n + row);
                counts.camera_rays += 1;
                if counts.shadow_rays >= counts.next_question {
                    counts.next_question = counts.shadow_rays + QUESTION_EVERY;
                    go_on()?;
                }
                let end = hit(column, row, &ray);
                self.see_ray(scene, &ray, &differential, end, |pixel, point| {
                    pixel.add_lights(scene, &point, lighting, counts);
                });
            }
        }
        ControlFlow::Continue(())
    }

    /// Adds what a camera ray that ends at the opaque thing `end` sees, front to back: the background, emission, or
    /// ambient light. Calls `lit` with the shading point of each surface, whose other light is added by
    /// [`light`](Self::light); its reflectances are those of the part of the ray that ends there.
    #[inline(always)]
    pub fn see_ray(
        &mut self,
        scene: &Scene,
        ray: &Ray,
        differential: &RayDifferential,
        end: Option<Hit>,
        mut lit: impl FnMut(&mut Self, ShadingPoint),
    ) {
        let mut left = 1.0;
        if scene.has_layers() {
            let mut stack = std::mem::take(&mut self.stack);
            scene.find_layers(ray, differential, end.as_ref(), &mut stack);
            for layer in &stack.layers {
                self.see_surface(scene, &layer.surface, layer.weight, &mut lit);
            }
            left = stack.left;
            self.stack = stack;
            if left == 0.0 {
                return;
            }
        }
        match scene.see(ray, end, differential) {
            TracedHit::Background => self.terms.background += f64::from(left),
            TracedHit::Emission(radiance) => self.terms.emission.add(radiance, left.into()),
            TracedHit::Surface(si) => {
                self.see_surface(scene, &si, left, &mut lit);
            }
        }
    }

    /// Adds what a surface emits, and its ambient light, times `weight`. Calls `lit` with its shading points.
    #[inline(always)]
    fn see_surface(
        &mut self,
        scene: &Scene,
        si: &SurfaceInteraction,
        weight: f32,
        lit: &mut impl FnMut(&mut Self, ShadingPoint),
    ) {
        self.terms.emission.add(scene.emission(si), weight.into());
        // Evaluate the textures of the material
        let point = ShadingPoint::of(si, &scene.bsdf(si).weighted(weight), &scene.ambient);
        for point in iter::once(point).chain(scene.further_points(si, weight)) {
            self.terms.ambient += point.base;
            lit(self, point);
        }
    }

    /// Adds the moments of light `index` at a surface: the totals of [`LobeSums`].
    #[inline(always)]
    pub fn light(&mut self, index: usize, bsdf: &Bsdf, moments: &Moments) {
        self.lights[index] += bsdf.colors.reflected(moments);
    }

    /// Adds all lights at a shading point.
    fn add_lights(&mut self, scene: &Scene, point: &ShadingPoint, lighting: &mut impl Lighting, counts: &mut Counts) {
        lighting.set_receiver(scene, point);
        let links = scene.geometry.lights_of(point.surface);
        for index in 0..scene.lights.len() {
            if !scene.geometry.links.contains(links, LightId(index as u32)) {
                continue;
            }
            let sums = lighting.gather(scene, index, point, counts);
            self.light(index, &point.bsdf, &sums.total());
        }
    }

    /// Stores the mean over the rays in pixel `at` of `sums`.
    pub fn resolve(&self, scene: &Scene, at: usize, sums: &mut TermSums) {
        let scales = scene.lights.iter().map(|light| light.scale);
        self.terms.resolve(scene, ScaledTerm::of_all(scales, &self.lights), at, sums);
    }
}
