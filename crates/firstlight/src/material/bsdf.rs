//! A material in numbers.

use super::{BlinnPhongLobe, Colors, Highlight, Moments, PerMoment, PhongLobe};
use crate::color::Rgb;
use crate::math::Arc;

/// The shape of a highlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LobeKind {
    /// Around the mirror direction.
    Phong,
    /// Around the half vector.
    BlinnPhong,
}

/// A material in numbers, at one surface. Light arriving from `wi` leaves towards `wo` as
/// f, the sum of each moment times its colour, which is pi x BRDF x cosine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bsdf {
    /// What each moment of the light is worth: the diffuse part, the highlight.
    pub(crate) colors: Colors,
    /// Linear colour of the answer to ambient light.
    pub ambient: Rgb,
    /// The radiance that the surface emits.
    pub emission: Rgb,
    /// The highlight.
    pub lobe: Lobe,
}

impl Bsdf {
    /// The same, of which only a part is seen: what leaves is so many times as much.
    #[inline(always)]
    pub(crate) fn weighted(self, weight: f32) -> Bsdf {
        let Bsdf { colors, ambient, emission, lobe } = self;
        Bsdf { colors: colors * weight, ambient: ambient * weight, emission: emission * weight, lobe }
    }

    /// What leaves under such ambient light.
    #[inline(always)]
    pub(crate) fn ambient_light(&self, ambient: Rgb) -> Rgb {
        ambient * self.ambient
    }

    /// What leaves under such ambient light, beside the light of lights.
    #[inline(always)]
    pub(crate) fn base(&self, ambient: Rgb) -> Rgb {
        self.ambient_light(ambient) + self.emission
    }
}

/// A highlight in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe {
    /// No highlight.
    None,
    /// Around the mirror direction.
    Phong(PhongLobe),
    /// Around the half vector.
    BlinnPhong(BlinnPhongLobe),
}

impl Lobe {
    /// The lobe of surfaces of which some have the one and some the other, or none; `None` if they have different ones.
    pub(crate) fn with(self, other: Lobe) -> Option<Lobe> {
        match (self, other) {
            (lobe, Lobe::None) | (Lobe::None, lobe) => Some(lobe),
            (one, other) => (one == other).then_some(one),
        }
    }

    /// The highlight, before its colour, from the cosines n.wi > 0, n.wo >= 0 and wi.wo. Never negative, never NaN.
    #[inline(always)]
    pub fn eval(&self, cos_i: f32, cos_o: f32, cos_io: f32) -> f32 {
        match self {
            Lobe::None => 0.0,
            Lobe::Phong(lobe) => lobe.eval(cos_i, cos_o, cos_io),
            Lobe::BlinnPhong(lobe) => lobe.eval(cos_i, cos_o, cos_io),
        }
    }

    /// k, where the highlight falls as exp(-k a^2) with the angle a of the light's direction, or not as fast. `cos_o`
    /// is n.wo.
    pub(crate) fn sharpness(&self, cos_o: f32) -> f32 {
        match self {
            Lobe::None => 0.0,
            Lobe::Phong(lobe) => 0.5 * lobe.exponent(),
            // The half vector moves half as fast; at grazing angles it is quicker to turn sideways
            Lobe::BlinnPhong(lobe) => 0.125 * lobe.exponent() / (cos_o * cos_o).max(0.01),
        }
    }

    /// The moments of light of such a weight.
    #[inline(always)]
    pub(crate) fn moments(&self, cos_i: f32, cos_o: f32, cos_io: f32, weight: f32) -> Moments {
        PerMoment([cos_i * weight, self.eval(cos_i, cos_o, cos_io) * weight])
    }

    /// The same where it is known what the cosine makes of many lights together.
    #[inline(always)]
    pub(crate) fn moments_around(&self, cosine: f32, cos_i: f32, cos_o: f32, cos_io: f32, weight: f32) -> Moments {
        PerMoment([cosine, if matches!(self, Lobe::None) { 0.0 } else { weight * self.eval(cos_i, cos_o, cos_io) }])
    }

    /// Its kind, if there is one.
    #[inline(always)]
    pub(crate) fn kind(&self) -> Option<LobeKind> {
        match self {
            Lobe::None => None,
            Lobe::Phong(_) => Some(LobeKind::Phong),
            Lobe::BlinnPhong(_) => Some(LobeKind::BlinnPhong),
        }
    }

    /// Its exponent; 0 if there is none.
    #[inline(always)]
    pub(crate) fn shininess(&self) -> f32 {
        match self {
            Lobe::None => 0.0,
            Lobe::Phong(lobe) => lobe.exponent(),
            Lobe::BlinnPhong(lobe) => lobe.exponent(),
        }
    }

    /// What it is, at most, where the light is off the mirror's direction by these angles at least and at most, and
    /// off the viewer by `apart` at most.
    pub(crate) fn highlight(&self, [nearest, farthest]: [Arc; 2], apart: impl FnOnce() -> Arc) -> Highlight {
        match self {
            Lobe::None => Highlight::default(),
            Lobe::Phong(lobe) => {
                let at = |cos: f32| self.eval(0.0, 0.0, -cos.max(0.0));
                let sin = if farthest.cos > 0.0 { farthest.sin } else { 1.0 };
                Highlight::of_power(lobe.exponent(), at, nearest.cos, sin, [1.0, 1.0])
            }
            Lobe::BlinnPhong(lobe) => {
                // The half vector is off the normal by half of what the light is off the mirror's direction
                let half = |arc: Arc| (0.5 * (1.0 + arc.cos)).max(0.0).sqrt();
                let at = |cos: f32| {
                    let twice = 2.0 * cos.max(0.0) * cos.max(0.0) - 1.0;
                    self.eval(1.0 + twice, 0.0, twice)
                };
                let sin = (0.5 * (1.0 - farthest.cos)).max(0.0).sqrt();
                // 1 / |wi + wo|: how fast the half vector turns with the light
                let k = 1.0 / (2.0 * half(apart())).max(1e-3);
                Highlight::of_power(lobe.exponent(), at, half(nearest), sin, [k, 2.0 * k + 3.0 * k * k])
            }
        }
    }
}
