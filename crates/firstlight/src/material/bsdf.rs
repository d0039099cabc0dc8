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

    /// Its diffuse part alone, with the answer to ambient light.
    pub(crate) fn diffuse_part(self) -> Bsdf {
        Bsdf { colors: PerMoment([self.colors.0[0], Rgb::BLACK, Rgb::BLACK]), ..self }
    }

    /// Its highlight alone, without the answer to ambient light.
    pub(crate) fn highlight_part(self) -> Bsdf {
        let [_, one, two] = self.colors.0;
        Bsdf { colors: PerMoment([Rgb::BLACK, one, two]), ambient: Rgb::BLACK, ..self }
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

/// The mean of the lobes of several surfaces, of which some may have none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeanLobe {
    /// One of them, if any has one.
    one: Lobe,
    /// Whether all that there are, are that one.
    is_same: bool,
    /// Whether all are of its kind.
    is_one_kind: bool,
    count: f32,
    /// Of the numbers of all; while they are the same, of one.
    sum: [f32; LOBE_NUMBERS],
    least: [f32; LOBE_NUMBERS],
    most: [f32; LOBE_NUMBERS],
}

impl MeanLobe {
    /// Of one surface.
    pub fn new(lobe: Lobe) -> MeanLobe {
        let numbers = lobe.numbers();
        let count = if lobe == Lobe::None { 0.0 } else { 1.0 };
        MeanLobe { one: lobe, is_same: true, is_one_kind: true, count, sum: numbers, least: numbers, most: numbers }
    }

    /// Adds that of another one.
    pub fn add(&mut self, lobe: Lobe) {
        if lobe == Lobe::None {
            return;
        }
        if self.one == Lobe::None {
            *self = MeanLobe::new(lobe);
            return;
        }
        if self.is_same {
            if lobe == self.one {
                self.count += 1.0;
                return;
            }
            self.sum = self.sum.map(|number| number * self.count);
            self.is_same = false;
        }
        self.count += 1.0;
        self.is_one_kind &= lobe.kind() == self.one.kind();
        for (k, number) in lobe.numbers().into_iter().enumerate() {
            self.sum[k] += number;
            (self.least[k], self.most[k]) = (self.least[k].min(number), self.most[k].max(number));
        }
    }

    /// The lobe that stands for all; `None` where their widths are off their mean by more than such a part of it.
    pub fn mean(&self, allowed: f32) -> Option<Lobe> {
        if self.is_same {
            return Some(self.one);
        }
        let half: [f32; LOBE_NUMBERS] = std::array::from_fn(|k| 0.5 * (self.most[k] - self.least[k]));
        let off = half[0] / (0.5 * (self.most[0] + self.least[0]));
        let mean = self.sum.map(|sum| sum / self.count);
        let (off, lobe) = match self.one {
            Lobe::None => return Some(Lobe::None),
            Lobe::Ggx(_) => (off.max(half[1]), Lobe::Ggx(GgxLobe { alpha: mean[0], grazing: mean[1] })),
            // The square of the width is the inverse of the exponent
            Lobe::Phong(_) => (0.5 * off, Lobe::Phong(PhongLobe::new(mean[0]))),
            Lobe::BlinnPhong(_) => (0.5 * off, Lobe::BlinnPhong(BlinnPhongLobe::new(mean[0]))),
        };
        (self.is_one_kind && off <= allowed).then_some(lobe)
    }
}

impl Lobe {
    /// The lobe of surfaces of which some have the one and some the other, or none; `None` if they have different ones.
    pub(crate) fn with(self, other: Lobe) -> Option<Lobe> {
        match (self, other) {
            (lobe, Lobe::None) | (Lobe::None, lobe) => Some(lobe),
            (one, other) => (one == other).then_some(one),
        }
    }

    /// Whether its width is that of another of its kind, but for such a part.
    pub(crate) fn is_near(self, other: Lobe, part: f32) -> bool {
        let mut mean = MeanLobe::new(self);
        mean.add(other);
        mean.mean(0.5 * part).is_some()
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

    /// The same where it is known what the cosine makes of many lights together.
    #[inline(always)]
    pub(crate) fn moments_around(&self, cosine: f32, cos_i: f32, cos_o: f32, cos_io: f32, weight: f32) -> Moments {
        let mut moments = self.eval(cos_i, cos_o, cos_io) * weight;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lobes_that_differ_little_have_a_mean() {
        let mean = |lobes: &[Lobe]| {
            let mut mean = MeanLobe::new(lobes[0]);
            lobes[1..].iter().for_each(|lobe| mean.add(*lobe));
            mean.mean(0.05)
        };
        let ggx = |alpha: f32| Lobe::Ggx(GgxLobe { alpha, grazing: 0.5 });
        let phong = |exponent: f32| Lobe::Phong(PhongLobe::new(exponent));
        assert_eq!(mean(&[ggx(0.2), Lobe::None, ggx(0.2)]), Some(ggx(0.2)));
        assert_eq!(mean(&[Lobe::None, ggx(0.2)]), Some(ggx(0.2)));
        assert_eq!(mean(&[Lobe::None, Lobe::None]), Some(Lobe::None));
        let Some(Lobe::Ggx(two)) = mean(&[ggx(0.2), ggx(0.21)]) else { panic!("they are near") };
        assert!((two.alpha - 0.205).abs() < 1e-6 && two.grazing == 0.5);
        assert_eq!(mean(&[ggx(0.2), ggx(0.23)]), None);
        assert_eq!(mean(&[ggx(0.2), Lobe::Ggx(GgxLobe { alpha: 0.2, grazing: 0.7 })]), None);
        // An exponent may differ twice as much
        assert!(mean(&[phong(20.0), phong(23.0)]).is_some_and(|lobe| lobe.numbers()[0] == 21.5));
        assert_eq!(mean(&[phong(20.0), phong(26.0)]), None);
        assert_eq!(mean(&[phong(20.0), Lobe::BlinnPhong(BlinnPhongLobe::new(20.0))]), None);
        assert!(ggx(0.2).is_near(ggx(0.2003), 0.002) && !ggx(0.2).is_near(ggx(0.201), 0.002));
    }
}
