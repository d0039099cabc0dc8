//! One light that is sampled, settled by shafts: how much of it points see, and what that sends to them.
//!
//! The sums over the samples are those of [`Lanes`](super::lanes::Lanes), in the same order.

use fearless_simd::Level;

use super::Counts;
use super::lanes::{PointObstacles, sum_area};
use super::pixel::{Lighting, LobeSums};
use super::plain::Plain;
use crate::light::{Extent, Light};
use crate::material::{Lobe, Moments};
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;
use crate::visibility::{Settler, ShadowView, Target, Viewpoint, Visibility};

/// A light, and how shafts lead to it.
pub(super) struct Sampled<'a> {
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

    /// How many points it has.
    pub fn samples(&self) -> u64 {
        self.light().samples() as u64
    }

    /// Whether something may shadow a surface from it.
    pub fn is_shadowed(&self, si: &SurfaceInteraction) -> bool {
        self.light().shadows && si.receives_shadow
    }

    /// What it sends to a point that nothing shadows.
    pub fn unshadowed(&self, si: &SurfaceInteraction, lobe: &Lobe, counts: &mut Counts) -> Moments {
        counts.shadow_rays += self.samples();
        counts.shadow_rays_skipped += self.samples();
        self.lit(si, lobe)
    }

    /// Hears what of it is seen from those `points` whose numbers are in `part`; see [`Settler::settle`].
    pub fn settle(
        &self,
        settler: &mut Settler,
        points: &[Viewpoint],
        part: &mut [u32],
        counts: &mut Counts,
        each: impl FnMut(usize, Visibility, &mut ShadowView),
    ) {
        let all = self.samples() * part.len() as u64;
        let settled = &mut counts.settled;
        let before = *settled;
        settler.settle(self.level, self.scene, self.target, points, part, settled, each);
        // Cut by shapes of the lists, which are asked for every sample, or by what is in the trees
        let cut = settled.visibility[Visibility::Mask as usize] - before.visibility[Visibility::Mask as usize];
        let traced = settled.traced - before.traced;
        let asked = if self.scene.geometry.has_trees() { traced } else { self.samples() * cut };
        counts.shadow_rays += all;
        counts.shadow_rays_skipped += all - asked;
    }

    /// What it sends to a point that sees so much of it.
    #[inline(always)]
    pub fn sent(&self, si: &SurfaceInteraction, lobe: &Lobe, visibility: Visibility, view: &ShadowView) -> Moments {
        match visibility {
            Visibility::Hidden | Visibility::BelowHorizon => Moments::ZERO,
            Visibility::Lit => self.lit(si, lobe),
            Visibility::Mask => self.masked(si, lobe, view),
        }
    }

    /// Where nothing hides any of it.
    #[inline(always)]
    fn lit(&self, si: &SurfaceInteraction, lobe: &Lobe) -> Moments {
        totals(match self.light().extent() {
            Extent::Area(area) => sum_area(self.level, area, si, lobe, &PointObstacles::default()),
            Extent::Point => {
                let unshadowed = SurfaceInteraction { receives_shadow: false, ..*si };
                Plain.gather(self.scene, self.index, &unshadowed, lobe, &mut Counts::default())
            }
        })
    }

    /// Past what is in `view`.
    #[inline(always)]
    fn masked(&self, si: &SurfaceInteraction, lobe: &Lobe, view: &ShadowView) -> Moments {
        totals(match self.light().extent() {
            Extent::Area(area) => sum_area(self.level, area, si, lobe, &PointObstacles::of(view)),
            Extent::Point => Plain.gather(self.scene, self.index, si, lobe, &mut Counts::default()),
        })
    }
}

fn totals(sums: LobeSums) -> Moments {
    sums.total()
}
