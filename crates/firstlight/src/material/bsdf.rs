//! A material in numbers.

use super::{Ambient, BlinnPhongLobe, Colors, GgxLobe, Highlight, Moments, PerMoment, PhongLobe};
use crate::color::Rgb;
use crate::math::Arc;

/// The shape of a highlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LobeKind {
    /// Around the mirror direction.
    Phong,
    /// Around the half vector.
    BlinnPhong,
    /// Of microfacets.
    Ggx,
}

/// How many numbers a lobe of any kind has.
pub(crate) const LOBE_NUMBERS: usize = 2;

impl LobeKind {
    /// How many moments a lobe of a kind, or none, has that are not always 0.
    #[inline(always)]
    pub(crate) fn moments(of: Option<LobeKind>) -> usize {
        match of {
            None => 1,
            Some(LobeKind::Phong | LobeKind::BlinnPhong) => 2,
            Some(LobeKind::Ggx) => 3,
        }
    }
}

/// A material in numbers, at one surface. Light arriving from `wi` leaves towards `wo` as
/// f, the sum of each moment times its colour, which is pi x BRDF x cosine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bsdf {
    /// What each moment of the light is worth: the diffuse part, the highlight.
    pub(crate) colors: Colors,
    /// The answer to a unit of ambient light: see [`Ambient::unit`].
    pub ambient: Rgb,
    /// The highlight.
    pub lobe: Lobe,
}

impl Bsdf {
    /// The same, of which only a part is seen: what leaves is so many times as much.
    #[inline(always)]
    pub(crate) fn weighted(self, weight: f32) -> Bsdf {
        Bsdf { colors: self.colors * weight, ambient: self.ambient * weight, ..self }
    }

    /// What leaves under such ambient light.
    #[inline(always)]
    pub(crate) fn base(&self, ambient: &Ambient) -> Rgb {
        ambient.unit() * self.ambient
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
    /// Of microfacets.
    Ggx(GgxLobe),
}

impl Lobe {
    /// The lobe of surfaces of which some have the one and some the other, or none; `None` if they have different ones.
    pub(crate) fn with(self, other: Lobe) -> Option<Lobe> {
        match (self, other) {
            (lobe, Lobe::None) | (Lobe::None, lobe) => Some(lobe),
            (one, other) => (one == other).then_some(one),
        }
    }

    /// The moments of light of unit weight, from the cosines n.wi > 0, n.wo >= 0 and wi.wo: the part of the base, then
    /// those of the highlight. Never negative, never NaN.
    #[inline(always)]
    pub(crate) fn eval(&self, cos_i: f32, cos_o: f32, cos_io: f32) -> Moments {
        PerMoment(match self {
            Lobe::None => [cos_i, 0.0, 0.0],
            Lobe::Phong(lobe) => [cos_i, lobe.eval(cos_i, cos_o, cos_io), 0.0],
            Lobe::BlinnPhong(lobe) => [cos_i, lobe.eval(cos_i, cos_o, cos_io), 0.0],
            Lobe::Ggx(lobe) => lobe.eval(cos_i, cos_o, cos_io),
        })
    }

    /// An upper bound of each part of the highlight, for unit light.
    pub(crate) fn most(&self) -> f32 {
        match self {
            Lobe::None | Lobe::Phong(_) | Lobe::BlinnPhong(_) => 1.0,
            Lobe::Ggx(lobe) => lobe.most(1.0),
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
            Lobe::Ggx(lobe) => lobe.sharpness(cos_o),
        }
    }

    /// The moments of light of such a weight.
    #[inline(always)]
    pub(crate) fn moments(&self, cos_i: f32, cos_o: f32, cos_io: f32, weight: f32) -> Moments {
        self.eval(cos_i, cos_o, cos_io) * weight
    }

    /// The same where it is known what the cosine makes of many lights together.
    #[inline(always)]
    pub(crate) fn moments_around(&self, cosine: f32, cos_i: f32, cos_o: f32, cos_io: f32, weight: f32) -> Moments {
        let mut moments = self.moments(cos_i, cos_o, cos_io, weight);
        moments.0[0] = match self {
            Lobe::Ggx(lobe) => cosine * lobe.transmitted(cos_io),
            _ => cosine,
        };
        moments
    }

    /// Its kind, if there is one.
    #[inline(always)]
    pub(crate) fn kind(&self) -> Option<LobeKind> {
        match self {
            Lobe::None => None,
            Lobe::Phong(_) => Some(LobeKind::Phong),
            Lobe::BlinnPhong(_) => Some(LobeKind::BlinnPhong),
            Lobe::Ggx(_) => Some(LobeKind::Ggx),
        }
    }

    /// Its numbers: an exponent, or alpha and what is transmitted less at grazing angles; 0 where there is none.
    #[inline(always)]
    pub(crate) fn numbers(&self) -> [f32; LOBE_NUMBERS] {
        match self {
            Lobe::None => [0.0, 0.0],
            Lobe::Phong(lobe) => [lobe.exponent(), 0.0],
            Lobe::BlinnPhong(lobe) => [lobe.exponent(), 0.0],
            Lobe::Ggx(lobe) => [lobe.alpha, lobe.grazing],
        }
    }

    /// What it is, at most, where the light is off the mirror's direction by these angles at least and at most, and
    /// off the viewer by `apart` at most.
    pub(crate) fn highlight(&self, [nearest, farthest]: [Arc; 2], apart: impl FnOnce() -> Arc) -> Highlight {
        match self {
            Lobe::None => Highlight::default(),
            Lobe::Ggx(lobe) => {
                let cos_h = (0.5 * (1.0 + nearest.cos)).max(0.0).sqrt();
                // Nothing bounds how fast it changes
                Highlight { most: lobe.most(cos_h), slope: f32::INFINITY, curve: f32::INFINITY }
            }
            Lobe::Phong(lobe) => {
                let at = |cos: f32| lobe.eval(0.0, 0.0, -cos.max(0.0));
                let sin = if farthest.cos > 0.0 { farthest.sin } else { 1.0 };
                Highlight::of_power(lobe.exponent(), at, nearest.cos, sin, [1.0, 1.0])
            }
            Lobe::BlinnPhong(lobe) => {
                // The half vector is off the normal by half of what the light is off the mirror's direction
                let half = |arc: Arc| (0.5 * (1.0 + arc.cos)).max(0.0).sqrt();
                let at = |cos: f32| {
                    let twice = 2.0 * cos.max(0.0) * cos.max(0.0) - 1.0;
                    lobe.eval(1.0 + twice, 0.0, twice)
                };
                let sin = (0.5 * (1.0 - farthest.cos)).max(0.0).sqrt();
                // 1 / |wi + wo|: how fast the half vector turns with the light
                let k = 1.0 / (2.0 * half(apart())).max(1e-3);
                Highlight::of_power(lobe.exponent(), at, half(nearest), sin, [k, 2.0 * k + 3.0 * k * k])
            }
        }
    }
}
