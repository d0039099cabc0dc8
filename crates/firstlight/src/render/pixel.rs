//! One pixel: its camera rays, what they see, and how that becomes a colour.

use std::ops::ControlFlow;

use super::{Counts, QUESTION_EVERY};
use crate::film::hits::camera_ray;
use crate::film::resolve::{LightTerm, PixelTerms, ScaledTerm, TermSums};
use crate::ids::LightId;
use crate::material::{Bsdf, Lobe, MOMENTS, Moments};
use crate::math::{LaneSum, Ray};
use crate::scene::{Hit, Scene, TracedHit};
use crate::shape::SurfaceInteraction;

/// How the light of one source is summed at one surface: the only thing in which the renderers differ.
pub(crate) trait Lighting {
    /// Looks around from a surface, once for all lights.
    fn look_around(&mut self, scene: &Scene, si: &SurfaceInteraction);

    /// The sums over the points of light `index`, in the contract's order, of the weight times the cosine and of the
    /// weight times the highlight, hidden points being 0. `si` is the surface last looked around from.
    fn gather(
        &mut self,
        scene: &Scene,
        index: usize,
        si: &SurfaceInteraction,
        lobe: &Lobe,
        counts: &mut Counts,
    ) -> LobeSums;
}

/// What arrives from one light, before all colours.
pub(crate) struct LobeSums(pub [LaneSum; MOMENTS]);

impl LobeSums {
    pub fn total(&self) -> Moments {
        Moments(std::array::from_fn(|k| self.0[k].total()))
    }
}

/// What a pixel's camera rays add up to, term by term.
pub(crate) struct PixelSum {
    terms: PixelTerms,
    /// In scene order.
    lights: Vec<LightTerm>,
}

impl PixelSum {
    pub fn new(scene: &Scene) -> Self {
        PixelSum { terms: PixelTerms::default(), lights: vec![LightTerm::BLACK; scene.lights.len()] }
    }

    pub fn clear(&mut self) {
        self.terms = PixelTerms::default();
        self.lights.fill(LightTerm::BLACK);
    }

    /// Sends the n x n camera rays of pixel (`i`, `j`), row by row, and adds what they see. `hit` says what the ray of
    /// a column and a row ends at.
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
                let seen = scene.see(&ray, hit(column, row, &ray), &differential);
                if let Some((si, bsdf)) = self.see(scene, seen) {
                    self.add_lights(scene, &si, &bsdf, lighting, counts);
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Adds what a camera ray ends at, but for the light of lights: that of a surface is added by
    /// [`light`](Self::light).
    pub fn see(&mut self, scene: &Scene, seen: TracedHit) -> Option<(SurfaceInteraction, Bsdf)> {
        match seen {
            TracedHit::Background => self.terms.background += 1,
            TracedHit::Emission(radiance) => self.terms.emission.add(radiance, 1),
            TracedHit::Surface(si) => {
                // Look the material's textures up
                let bsdf = scene.materials[si.material.index()].bsdf(&si, &scene.textures);
                self.terms.ambient += scene.ambient * bsdf.ambient;
                return Some((si, bsdf));
            }
        }
        None
    }

    /// Adds what light `index` sends to a surface: the totals of [`LobeSums`].
    #[inline(always)]
    pub fn light(&mut self, index: usize, bsdf: &Bsdf, moments: &Moments) {
        self.lights[index] += bsdf.colors.each(moments);
    }

    /// Adds what each light sends.
    fn add_lights(
        &mut self,
        scene: &Scene,
        si: &SurfaceInteraction,
        bsdf: &Bsdf,
        lighting: &mut impl Lighting,
        counts: &mut Counts,
    ) {
        lighting.look_around(scene, si);
        let links = scene.geometry.lights_of(si.surface);
        for index in 0..scene.lights.len() {
            if !scene.geometry.links.contains(links, LightId(index as u32)) {
                continue;
            }
            let sums = lighting.gather(scene, index, si, &bsdf.lobe, counts);
            self.light(index, bsdf, &sums.total());
        }
    }

    /// Makes pixel `at` of `sums` the mean.
    pub fn resolve(&self, scene: &Scene, at: usize, sums: &mut TermSums) {
        let scales = scene.lights.iter().map(|light| light.scale);
        self.terms.resolve(scene, ScaledTerm::of_all(scales, &self.lights), at, sums);
    }
}
