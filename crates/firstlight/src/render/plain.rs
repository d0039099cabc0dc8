//! The plain renderer: one light sample at a time, every shape asked. It is the specification; `--reference` runs it.

use super::Counts;
use super::pixel::{Lighting, LobeSums};
use crate::ids::LightId;
use crate::light::{Light, LightSample, Towards};
use crate::material::{Lobe, MOMENTS, Moments};
use crate::math::{LaneSum, LightEnd};
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;

/// Light, sample by sample.
pub(crate) struct Plain;

impl Lighting for Plain {
    fn look_around(&mut self, _: &Scene, _: &SurfaceInteraction) {}

    fn gather(
        &mut self,
        scene: &Scene,
        index: usize,
        si: &SurfaceInteraction,
        lobe: &Lobe,
        counts: &mut Counts,
    ) -> LobeSums {
        let facing = Facing::new(scene, index, si, lobe);
        let mut sums = [const { LaneSum::new() }; MOMENTS];
        for k in 0..facing.light.samples() {
            let to = facing.light.towards(k, si.lit_from);
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
    si: &'a SurfaceInteraction,
    lobe: &'a Lobe,
    cos_o: f32,
    floor: f32,
}

impl<'a> Facing<'a> {
    pub fn new(scene: &'a Scene, index: usize, si: &'a SurfaceInteraction, lobe: &'a Lobe) -> Self {
        let light = &scene.lights[index];
        let cos_o = si.ns.dot(si.wo);
        let floor = light.floor(si.lit_from, si.error, si.horizon);
        let end = scene.light_end(LightId(index as u32));
        Facing { scene, light, end, si, lobe, cos_o, floor }
    }

    /// What one point of the light, to which `to` leads, adds to the diffuse sum and to that of the highlight. `sample`
    /// says how much the light sends this way; `None` where nothing arrives.
    #[inline(always)]
    pub fn arriving(
        &self,
        to: Towards,
        sample: impl FnOnce() -> Option<LightSample>,
        counts: &mut Counts,
    ) -> Option<Moments> {
        let si = self.si;
        counts.shadow_rays += 1;
        // Light from below the surface does not count, nor what rounding alone may have lifted above it
        let height = si.ns.dot(to.l);
        if !(si.horizon.dot(to.l) > self.floor && height > 0.0) {
            return None;
        }
        // How much is sent this way
        let sample = sample()?;
        // Nor does what something else hides
        if self.light.shadows && si.receives_shadow {
            let t_max = if to.finite { 1.0 } else { f32::INFINITY };
            if self.scene.occluded(&si.shadow_ray(self.end, to.l, t_max)) {
                return None;
            }
        } else {
            counts.shadow_rays_skipped += 1;
        }
        // What the surface makes of it
        let cos_i = height * sample.inverse_distance;
        let cos_io = si.wo.dot(to.l) * sample.inverse_distance;
        Some(self.lobe.moments(cos_i, self.cos_o, cos_io, sample.weight))
    }
}
