//! From what the camera rays of a pixel see to its colour: a picture is the sum of these terms in one fixed order.

use crate::color::Rgb;
use crate::material::Colors;
use crate::scene::Scene;

/// What the rays of a pixel see beside the light of lights, added up.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PixelTerms {
    /// How many of them meet nothing.
    pub background: u32,
    /// Of lights that are seen.
    pub emission: Rgb,
    pub ambient: Rgb,
}

/// What one light sends to the surfaces that they see, added up, with the surfaces' colours and without the light's
/// scale: diffuse and specular.
pub(crate) type LightTerm = Colors;

impl PixelTerms {
    /// The mean over the rays, as film: red, green, blue premultiplied, alpha. `lights` come in scene order, each with
    /// its scale, which is applied to its means.
    pub fn resolve(&self, scene: &Scene, lights: impl Iterator<Item = (Rgb, LightTerm)>) -> [f32; 4] {
        let rays = (scene.antialiasing * scene.antialiasing) as f32;
        let uncovered = self.background as f32 / rays;
        let mean = |sum: Rgb| Rgb::new(sum.r / rays, sum.g / rays, sum.b / rays);
        let mut color = if scene.transparent { Rgb::BLACK } else { scene.background * uncovered };
        color += mean(self.emission);
        color += mean(self.ambient);
        for (scale, term) in lights {
            for part in term.0 {
                color += scale * mean(part);
            }
        }
        let alpha = if scene.transparent { 1.0 - uncovered } else { 1.0 };
        [color.r, color.g, color.b, alpha]
    }
}
