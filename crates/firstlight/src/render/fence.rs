//! What stands around one place, made ready for many rays to lights.

use crate::math::ShadowRay;
use crate::scene::Scene;
use crate::shape::{ParallelogramShadow, SphereShadow, SurfaceInteraction};

/// The listed things that may be in the way of light to a place. Keeps its memory.
#[derive(Default)]
pub(super) struct Fence {
    spheres: Vec<SphereShadow>,
    flats: Vec<ParallelogramShadow>,
}

impl Fence {
    /// Takes its stand at a place.
    pub fn stand(&mut self, scene: &Scene, si: &SurfaceInteraction) {
        let spheres = scene.obstacles.iter().map(|sphere| sphere.shadow(si.lit_from, si.error));
        self.spheres.clear();
        self.spheres.extend(spheres.filter(|sphere| !sphere.is_below(si.horizon)));
        self.flats.clear();
        self.flats.extend(scene.flat_obstacles.iter().map(|flat| flat.shadow(si.lit_from, si.error)));
    }

    /// Whether anything stands on a ray from there: what [`Scene::occluded`] says.
    #[inline]
    pub fn blocks(&self, scene: &Scene, ray: &ShadowRay) -> bool {
        if scene.obstacle_links.iter().any(|links| !links.is_empty()) {
            return scene.occluded(ray);
        }
        let finite = ray.is_finite();
        self.spheres.iter().any(|sphere| sphere.blocks(ray.l, finite))
            || self.flats.iter().any(|flat| flat.blocks(ray.l, finite))
            || scene.occluded_but_by_lists(ray)
    }
}
