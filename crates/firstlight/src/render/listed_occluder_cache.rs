//! The listed occluders as one receiver sees them, for shadow rays to many lights.

use crate::ids::LightId;
use crate::material::ShadingPoint;
use crate::math::Vec3;
use crate::scene::{Listed, Opacity, Scene};
use crate::shape::{ParallelogramShadow, SphereShadow};
use crate::visibility::Viewpoint;

/// The listed shapes that may occlude lights from one receiver. Keeps its memory.
#[derive(Default)]
pub(super) struct ListedOccluderCache {
    spheres: Vec<Listed<SphereShadow>>,
    flats: Vec<Listed<ParallelogramShadow>>,
    from: Option<Viewpoint>,
}

impl ListedOccluderCache {
    /// Replaces the receiver.
    pub fn set_receiver(&mut self, scene: &Scene, point: &ShadingPoint) {
        self.spheres.clear();
        let spheres = scene.occluders.surface_spheres().iter();
        let spheres = spheres.map(|sphere| sphere.map(|shape| shape.shadow(point.p, point.error)));
        self.spheres.extend(spheres.filter(|sphere| !sphere.shape.is_below(point.horizon)));
        self.from = Some(Viewpoint::of(point));
        let flats = scene.occluders.flats.iter();
        self.flats.clear();
        self.flats.extend(flats.map(|flat| flat.map(|shape| shape.shadow(point.p, point.error))));
    }

    /// Whether a shadow ray from the receiver along `l` to a light is blocked: the result of [`Scene::occluded`].
    #[inline]
    pub fn blocks(&self, scene: &Scene, light: LightId, l: Vec3, finite: bool) -> bool {
        let Some(from) = &self.from else { return false };
        let stops = |opacity: Opacity| scene.geometry.stops(opacity, light);
        self.spheres.iter().any(|sphere| sphere.shape.blocks(l, finite) && stops(sphere.opacity))
            || self.flats.iter().any(|flat| flat.shape.blocks(l, finite) && stops(flat.opacity))
            || {
                let ray = from.ray(scene.light_end(light), l, finite);
                scene.occluded_but_by_lists(&ray) || scene.left_by_layers(&ray) == 0.0
            }
    }
}
