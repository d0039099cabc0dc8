//! The plain renderer: one light sample at a time, every shape tested. It is the specification; `--reference` runs it.

use super::Counts;
use super::pixel::{Lighting, LobeSums};
use crate::ids::LightId;
use crate::light::{Light, LightSample, Towards};
use crate::material::{MOMENTS, Moments, ShadingPoint};
use crate::math::{LaneSum, LightEnd};
use crate::scene::Scene;
use crate::visibility::Viewpoint;

/// Light, sample by sample.
pub(crate) struct Plain;

impl Lighting for Plain {
    fn gather(&mut self, scene: &Scene, index: usize, point: &ShadingPoint, counts: &mut Counts) -> LobeSums {
        let facing = Facing::new(scene, index, point);
        let mut sums = [const { LaneSum::new() }; MOMENTS];
        for k in 0..facing.light.samples() {
            let to = facing.light.towards(k, point.p);
            if let Some(arriving) = facing.arriving(to, || facing.light.sample(k, to.l), counts) {
                sums.iter_mut().zip(arriving.0).for_each(|(sum, term)| sum.add(k, term));
            }
        }
        LobeSums(sums)
    }
}

/// A light and a surface that face each other.
pub(super) struct Facing<'a> {
    scene: &'a Scene,
    pub light: &'a Light,
    end: LightEnd,
    point: &'a ShadingPoint,
    from: Viewpoint,
    floor: f32,
}

impl<'a> Facing<'a> {
    pub fn new(scene: &'a Scene, index: usize, point: &'a ShadingPoint) -> Self {
        let light = &scene.lights[index];
        let floor = light.floor(point.p, point.error, point.horizon);
        let end = scene.light_end(LightId(index as u32));
        Facing { scene, light, end, point, from: Viewpoint::of(point), floor }
    }

    /// The moments of one point of the light, in the direction `to`; `None` where nothing arrives. `sample` computes
    /// its emission towards the surface.
    #[inline(always)]
    pub fn arriving(
        &self,
        to: Towards,
        sample: impl FnOnce() -> Option<LightSample>,
        counts: &mut Counts,
    ) -> Option<Moments> {
        let point = self.point;
        counts.shadow_rays += 1;
        // Light from below the surface does not count, nor what rounding alone may have lifted above it
        if !(point.horizon.dot(to.l) > self.floor && point.ns.dot(to.l) > 0.0) {
            return None;
        }
        // The emission in this direction
        let sample = sample()?;
        // Nor does light that an occluder hides
        let mut left = 1.0;
        if self.light.shadows && point.receives_shadow {
            let ray = self.from.ray(self.end, to.l, to.finite);
            if self.scene.occluded_by_opaque(&ray) {
                return None;
            }
            // What surfaces that are not opaque let through
            left = self.scene.left_by_layers(&ray);
            if left == 0.0 {
                return None;
            }
        } else {
            counts.shadow_rays_skipped += 1;
        }
        // Its lobe
        Some(point.moments(to.l, sample.inverse_distance, sample.weight * left))
    }
}
