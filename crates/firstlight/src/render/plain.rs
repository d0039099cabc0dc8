//! The plain renderer: one light sample at a time, every shape asked. It is the specification; `--reference` runs it.

use super::Counts;
use super::pixel::{Lighting, LobeSums};
use crate::ids::LightId;
use crate::material::Lobe;
use crate::math::LaneSum;
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
        let light = &scene.lights[index];
        let (mut diffuse, mut specular) = (LaneSum::new(), LaneSum::new());
        let cos_o = si.ns.dot(si.wo);
        let floor = light.floor(si.lit_from, si.error, si.horizon);
        for k in 0..light.samples() {
            counts.shadow_rays += 1;
            let to = light.towards(k, si.lit_from);
            // Light from below the surface does not count, nor what rounding alone may have lifted above it
            let height = si.ns.dot(to.l);
            if !(si.horizon.dot(to.l) > floor && height > 0.0) {
                continue;
            }
            // How much is sent this way
            let Some(sample) = light.sample(k, to.l) else { continue };
            // Nor does what something else hides
            if light.shadows && si.receives_shadow {
                let t_max = if to.finite { 1.0 } else { f32::INFINITY };
                if scene.occluded(&si.shadow_ray(LightId(index as u32), to.l, t_max)) {
                    continue;
                }
            } else {
                counts.shadow_rays_skipped += 1;
            }
            // What the surface makes of it
            let cos_i = height * sample.inverse_distance;
            let cos_io = si.wo.dot(to.l) * sample.inverse_distance;
            diffuse.add(k, cos_i * sample.weight);
            specular.add(k, lobe.eval(cos_i, cos_o, cos_io) * sample.weight);
        }
        LobeSums { diffuse, specular }
    }
}
