//! Lights that are sampled at fixed points: their visibility by shafts, and the sums over their samples, which are
//! those of [`Lanes`](crate::render::lanes::Lanes), in the same order.

use fearless_simd::Level;

use super::{DirectLighting, Group, LightEstimate};
use crate::light::{Area, Light};
use crate::material::{Moments, ShadingPoint};
use crate::render::Counts;
use crate::render::lanes::{PointObstacles, sum_area};
use crate::render::pixel::Lighting;
use crate::render::plain::Plain;
use crate::scene::Scene;
use crate::visibility::{ShadowView, Target, Viewpoint, Visibility, VisibilityResolver};

/// A light of fewer samples casts discernible hard shadows: one a sample.
const FEW_SAMPLES: usize = 256;

/// A light that is sampled at fixed points.
pub(crate) struct Sampled<'a> {
    scene: &'a Scene,
    level: Level,
    index: usize,
    target: &'a Target,
}

impl<'a> Sampled<'a> {
    /// Light `index`; `targets` has one for each light.
    pub fn new(scene: &'a Scene, level: Level, index: usize, targets: &'a [Target]) -> Self {
        Sampled { scene, level, index, target: &targets[index] }
    }

    fn light(&self) -> &'a Light {
        &self.scene.lights[self.index]
    }

    /// The number of its samples.
    pub fn samples(&self) -> u64 {
        self.light().samples() as u64
    }

    /// Whether a surface may be in its shadow.
    pub fn is_shadowed(&self, point: &ShadingPoint) -> bool {
        self.light().shadows && point.receives_shadow
    }

    /// Its moments at a point that is in no shadow.
    pub fn unshadowed(&self, point: &ShadingPoint, counts: &mut Counts) -> Moments {
        counts.shadow_rays += self.samples();
        counts.shadow_rays_skipped += self.samples();
        self.lit(point)
    }

    /// Classifies the visibility of the light from those `points` whose indices are in `part`, and calls `each` with
    /// the index, the class and the view of each; see [`VisibilityResolver::resolve`].
    pub fn classify(
        &self,
        resolver: &mut VisibilityResolver,
        points: &[Viewpoint],
        part: &mut [u32],
        counts: &mut Counts,
        each: impl FnMut(usize, Visibility, &mut ShadowView),
    ) {
        let all = self.samples() * part.len() as u64;
        let stats = &mut counts.visibility;
        let before = *stats;
        resolver.resolve(self.level, self.scene, self.target, points, part, stats, each);
        // Shadow rays: one for each sample of a partly visible light past listed shapes, or those traced through trees
        let cut = stats.classes[Visibility::Partial as usize] - before.classes[Visibility::Partial as usize];
        let traced = stats.traced - before.traced;
        let tested = if self.scene.geometry.has_trees() { traced } else { self.samples() * cut };
        counts.shadow_rays += all;
        counts.shadow_rays_skipped += all - tested;
    }

    /// Its moments at a point from which it has such a visibility.
    #[inline(always)]
    pub fn sent(&self, point: &ShadingPoint, visibility: Visibility, view: &ShadowView) -> Moments {
        match visibility {
            Visibility::None | Visibility::BelowHorizon => Moments::ZERO,
            Visibility::Full => self.lit(point),
            Visibility::Partial | Visibility::Listed => {
                let layers = view.layers.then(|| (self.scene, self.target.end()));
                self.sum(point, &PointObstacles { layers, ..PointObstacles::of(view) })
            }
        }
    }

    /// The sum of its samples at a point that is in no shadow.
    #[inline(always)]
    fn lit(&self, point: &ShadingPoint) -> Moments {
        self.sum(&ShadingPoint { receives_shadow: false, ..*point }, &PointObstacles::default())
    }

    /// The sum of its samples at a point, past occluders.
    #[inline(always)]
    fn sum(&self, point: &ShadingPoint, occluders: &PointObstacles) -> Moments {
        let sums = match self.light().area() {
            Some(area) => sum_area(self.level, area, point, occluders),
            None => Plain.gather(self.scene, self.index, point, &mut Counts::default()),
        };
        sums.total()
    }
}

impl DirectLighting<'_> {
    /// Sums the samples of an area light at some points of a group whose estimates have the variation over the
    /// footprints; where that is unknown, only if the motion of silhouettes does not matter.
    pub(super) fn add_samples(
        &mut self,
        of: &Group,
        area: &Area,
        members: &[u32],
        estimates: &mut [LightEstimate],
        counts: &mut Counts,
    ) {
        let light = Sampled::new(self.scene, self.level, of.light, &self.lights.targets);
        let points: Vec<Viewpoint> = members.iter().map(|k| Viewpoint::of(of.point(*k))).collect();
        let mut order = Vec::with_capacity(members.len());
        for (number, k) in members.iter().enumerate() {
            let (point, estimate) = (of.point(*k), &mut estimates[*k as usize]);
            // Each of a fixed set of samples casts a hard shadow
            if area.samples() < FEW_SAMPLES && estimate.motion > 0.0 {
                *estimate = LightEstimate { visibility: estimate.visibility, ..LightEstimate::UNKNOWN };
            }
            estimate.most *= area.samples() as f32 / area.stands_for();
            if estimate.turn == f32::INFINITY && point.most_motion < f32::INFINITY {
                estimate.moments = Moments::UNKNOWN;
            } else if light.is_shadowed(point) {
                order.push(number as u32);
            } else {
                estimate.moments = light.unshadowed(point, counts);
            }
        }
        light.classify(&mut self.resolver, &points, &mut order, counts, |number, visibility, view| {
            let k = members[number];
            estimates[k as usize].moments = light.sent(of.point(k), visibility, view);
        });
    }
}
