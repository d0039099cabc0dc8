//! What stands around one place, made ready for many rays to lights.

use crate::ids::LightId;
use crate::math::Vec3;
use crate::scene::Scene;
use crate::shape::{ParallelogramShadow, SphereShadow, SurfaceInteraction};
use crate::visibility::Viewpoint;

/// The listed things that may be in the way of light to a place. Keeps its memory.
#[derive(Default)]
pub(super) struct Fence {
    spheres: Vec<SphereShadow>,
    flats: Vec<ParallelogramShadow>,
    from: Option<Viewpoint>,
}

impl Fence {
    /// Takes its stand at a place.
    pub fn stand(&mut self, scene: &Scene, si: &SurfaceInteraction) {
        let spheres = scene.obstacles.iter().map(|sphere| sphere.shadow(si.lit_from, si.error));
        self.spheres.clear();
        self.spheres.extend(spheres.filter(|sphere| !sphere.is_below(si.horizon)));
        self.from = Some(Viewpoint::of(si));
        self.flats.clear();
        self.flats.extend(scene.flat_obstacles.iter().map(|flat| flat.shadow(si.lit_from, si.error)));
    }

    /// Whether anything stands on a ray along `l` from there to a light: what [`Scene::occluded`] says.
    #[inline]
    pub fn blocks(&self, scene: &Scene, light: LightId, l: Vec3, finite: bool) -> bool {
        let Some(from) = &self.from else { return false };
        if scene.obstacle_links.iter().any(|links| !links.is_empty()) {
            return scene.occluded(&from.ray(light, l, finite));
        }
        self.spheres.iter().any(|sphere| sphere.blocks(l, finite))
            || self.flats.iter().any(|flat| flat.blocks(l, finite))
            || scene.occluded_but_by_lists(&from.ray(light, l, finite))
    }
}
