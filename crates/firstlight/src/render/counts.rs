//! The statistics of a render.

use super::SimdLevel;
use crate::film::Heat;
use crate::visibility::{Visibility, VisibilityStats};

/// The statistics of a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RenderStats {
    /// Camera rays.
    pub camera_rays: u64,
    /// Pairs of a shading point and a point of a light whose visibility was found.
    pub shadow_rays: u64,
    /// Those of them without a ray: nothing can occlude the light, or it casts no shadows.
    pub shadow_rays_skipped: u64,
    /// Pairs of a shading point and a light, by visibility: fully visible, hidden by one occluder, below the horizon,
    /// partially visible. Counted where shafts are used, as the next three are.
    pub visibility: [u64; 4],
    /// Pairs of a shading point and an integrated light that is partially visible past occluders with a closed form.
    /// Not among those of `visibility`.
    pub closed_form: u64,
    /// Batches of sixteen lanes in which area lights were evaluated.
    pub batches: u64,
    /// The shading points in these batches.
    pub batched_points: u64,
    /// Shafts from shading points to lights.
    pub shafts: u64,
    /// The occluders in these shafts, all together.
    pub occluders: u64,
    /// Shadow rays that were traced through the trees.
    pub traced: u64,
    /// The statistics of many integrated lights.
    pub lights: LightCounts,
    /// The instruction set; `Fallback` for the plain renderer.
    pub simd: SimdLevel,
    /// Threads.
    pub threads: usize,
}

impl RenderStats {
    /// The sums of two renders, with the instruction set and the threads of the later one.
    pub fn and(&self, later: &RenderStats) -> RenderStats {
        let mut sum = *later;
        sum.camera_rays += self.camera_rays;
        sum.shadow_rays += self.shadow_rays;
        sum.shadow_rays_skipped += self.shadow_rays_skipped;
        for (sum, count) in sum.visibility.iter_mut().zip(self.visibility) {
            *sum += count;
        }
        sum.closed_form += self.closed_form;
        sum.batches += self.batches;
        sum.batched_points += self.batched_points;
        sum.shafts += self.shafts;
        sum.occluders += self.occluders;
        sum.traced += self.traced;
        sum.lights.pairs += self.lights.pairs;
        sum.lights.singly += self.lights.singly;
        sum.lights.together += self.lights.together;
        sum.lights.nodes += self.lights.nodes;
        sum
    }
}

/// The statistics of many integrated lights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightCounts {
    /// Pairs of a shading point and a light.
    pub pairs: u64,
    /// Those of them for which the light was integrated.
    pub singly: u64,
    /// Those for which the light is provably visible as a whole and was replaced by a point, alone or in a cluster.
    pub together: u64,
    /// The number of these points. All other lights were left out, within the stated bound.
    pub nodes: u64,
}

/// The statistics of one tile.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counts {
    pub camera_rays: u64,
    pub shadow_rays: u64,
    pub shadow_rays_skipped: u64,
    pub visibility: VisibilityStats,
    pub closed_form: u64,
    pub batches: u64,
    pub batched_points: u64,
    /// Camera rays that were traced: not those of pixels that provably see one surface.
    pub looks: u64,
    /// Points of integrated lights that were sampled.
    pub points: u64,
    pub lights: LightCounts,
    /// The number of shadow rays at which `go_on` is called again.
    pub next_question: u64,
}

impl Counts {
    /// The part of them that callers get.
    pub fn stats(&self, simd: SimdLevel, threads: usize) -> RenderStats {
        let Counts { camera_rays, shadow_rays, shadow_rays_skipped, visibility, closed_form, lights, .. } = *self;
        let Counts { batches, batched_points, .. } = *self;
        let VisibilityStats { classes, shafts, occluders, traced } = visibility;
        RenderStats {
            camera_rays,
            shadow_rays,
            shadow_rays_skipped,
            visibility: classes,
            closed_form,
            batches,
            batched_points,
            shafts,
            occluders,
            traced,
            lights,
            simd,
            threads,
        }
    }

    /// Counts a shading point of a batch.
    pub fn note(&mut self, visibility: Visibility) {
        match visibility {
            Visibility::Partial => {}
            Visibility::Listed => self.closed_form += 1,
            known => self.visibility.classes[known as usize] += 1,
        }
    }

    /// The work so far, in the unit of [`Heat`].
    pub fn work(&self) -> f32 {
        let rays = self.looks + (self.shadow_rays - self.shadow_rays_skipped) + self.points;
        let places = self.visibility.classes.iter().sum::<u64>() + self.closed_form;
        rays as f32 + Heat::PLACE * places as f32 + self.lights.nodes as f32
    }
}
