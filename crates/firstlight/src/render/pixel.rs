//! One pixel: its camera rays, what they see, and how that becomes a colour.

use std::ops::ControlFlow;

use super::{Counts, QUESTION_EVERY};
use crate::film::hits::camera_ray;
use crate::film::resolve::{LightTerm, PixelTerms, ScaledTerm, TermSums};
use crate::ids::LightId;
use crate::material::{Bsdf, MOMENTS, Moments, PerMoment, ShadingPoint};
use crate::math::{LaneSum, Ray};
use crate::scene::{Hit, Scene, TracedHit};

/// How the light of one source is summed at one surface: the only thing in which the renderers differ.
pub(crate) trait Lighting {
    /// Looks around from a surface, once for all lights.
    fn look_around(&mut self, scene: &Scene, point: &ShadingPoint);

    /// The sums over the points of light `index`, in the contract's order, of the weight times the cosine and of the
    /// weight times the highlight, hidden points being 0. `point` is the one last looked around from.
    fn gather(&mut self, scene: &Scene, index: usize, point: &ShadingPoint, counts: &mut Counts) -> LobeSums;
}

/// What arrives from one light, before all colours.
pub(crate) struct LobeSums(pub [LaneSum; MOMENTS]);

impl LobeSums {
    pub fn total(&self) -> Moments {
        PerMoment(std::array::from_fn(|k| self.0[k].total()))
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
                if let Some(point) = self.see(scene, seen) {
                    self.add_lights(scene, &point, lighting, counts);
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Adds what a camera ray ends at, but for the light of lights: that of a surface is added by
    /// [`light`](Self::light).
    pub fn see(&mut self, scene: &Scene, seen: TracedHit) -> Option<ShadingPoint> {
        match seen {
            TracedHit::Background => self.terms.background += 1,
            TracedHit::Emission(radiance) => self.terms.emission.add(radiance, 1),
            TracedHit::Surface(si) => {
                // Look the material's textures up
                let bsdf = scene.materials[si.material.index()].bsdf(&si, &scene.textures);
                let point = ShadingPoint::of(&si, &bsdf, scene.ambient);
                self.terms.ambient += point.base;
                return Some(point);
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
    fn add_lights(&mut self, scene: &Scene, point: &ShadingPoint, lighting: &mut impl Lighting, counts: &mut Counts) {
        lighting.look_around(scene, point);
        let links = scene.geometry.lights_of(point.surface);
        for index in 0..scene.lights.len() {
            if !scene.geometry.links.contains(links, LightId(index as u32)) {
                continue;
            }
            let sums = lighting.gather(scene, index, point, counts);
            self.light(index, &point.bsdf, &sums.total());
        }
    }

    /// Makes pixel `at` of `sums` the mean.
    pub fn resolve(&self, scene: &Scene, at: usize, sums: &mut TermSums) {
        let scales = scene.lights.iter().map(|light| light.scale);
        self.terms.resolve(scene, ScaledTerm::of_all(scales, &self.lights), at, sums);
    }
}
