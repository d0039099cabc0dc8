//! What a render did, in numbers.

use super::SimdLevel;
use crate::film::Heat;
use crate::visibility::{Visibility, VisibilityStats};

/// What a render did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RenderStats {
    /// Rays from the camera.
    pub camera_rays: u64,
    /// Pairs of a lit point and a point of a light that were decided.
    pub shadow_rays: u64,
    /// Those of them that took no ray: nothing could stand between, or the light casts no shadows.
    pub shadow_rays_skipped: u64,
    /// Pairs of a lit point and a light: all of it arrives, one thing hides it, it is below the horizon, each sample
    /// has an answer of its own. Counted where shafts are used, as the next three are.
    pub visibility: [u64; 4],
    /// Pairs of a lit point and a light that is integrated, of which some is hidden by things so few that what is left
    /// is known in closed form. Not among those of `visibility`.
    pub closed_form: u64,
    /// Batches of sixteen lanes in which area lights were evaluated.
    pub batches: u64,
    /// The points in them.
    pub batched_points: u64,
    /// Shafts from points to lights.
    pub shafts: u64,
    /// What they held that could stand in the way, all together.
    pub occluders: u64,
    /// Shadow rays for which trees were asked all the same.
    pub traced: u64,
    /// What was done with lights, where they are many and integrated.
    pub lights: LightCounts,
    /// The instruction set; `Fallback` for the plain renderer.
    pub simd: SimdLevel,
    /// Threads.
    pub threads: usize,
}

impl RenderStats {
    /// Of two renders together, as the later one was made.
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

/// Where lights are many: what was done with them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightCounts {
    /// Pairs of a lit place and a light.
    pub pairs: u64,
    /// Those of them where the light was asked for by itself.
    pub singly: u64,
    /// Those where it is proved to be seen whole, and was taken for a point, by itself or together with others.
    pub together: u64,
    /// How many such points were taken; all other lights were left out, within the stated bound.
    pub nodes: u64,
}

/// Counts of one tile.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counts {
    pub camera_rays: u64,
    pub shadow_rays: u64,
    pub shadow_rays_skipped: u64,
    pub visibility: VisibilityStats,
    pub closed_form: u64,
    pub batches: u64,
    pub batched_points: u64,
    /// Camera rays that were asked: not those of places where it is proved what they would meet.
    pub looks: u64,
    /// Points of lights that were asked one by one, of lights that are integrated.
    pub points: u64,
    pub lights: LightCounts,
    /// Shadow rays after which the caller is asked whether to go on.
    pub next_question: u64,
}

impl Counts {
    /// What is told of it.
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

    /// Counts a point whose visibility a batch classified.
    pub fn note(&mut self, visibility: Visibility) {
        match visibility {
            Visibility::Partial => {}
            Visibility::Listed => self.closed_form += 1,
            known => self.visibility.classes[known as usize] += 1,
        }
    }

    /// In the unit of [`Heat`].
    pub fn work(&self) -> f32 {
        let rays = self.looks + (self.shadow_rays - self.shadow_rays_skipped) + self.visibility.traced + self.points;
        let places = self.visibility.classes.iter().sum::<u64>() + self.closed_form;
        rays as f32 + Heat::PLACE * places as f32 + self.lights.nodes as f32
    }
}
