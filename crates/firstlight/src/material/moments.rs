//! The moments of a light at a shading point: the integrals of the cosine and of the lobe over the visible part of the
//! light, without reflectances; and the reflectances of a material, one colour for each moment.

use std::ops::{Add, AddAssign, Mul};

use crate::color::Rgb;

/// How many there are, at most: the cosine, or what of it is transmitted, and the parts of the highlight.
pub(crate) const MOMENTS: usize = 3;

/// Something of each moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PerMoment<T>(pub [T; MOMENTS]);

/// What arrives, before all colours: the weight times the cosine, and the weight times the highlight.
pub(crate) type Moments = PerMoment<f32>;

/// What each moment is worth.
pub(crate) type Colors = PerMoment<Rgb>;

/// How many parts the light that a surface reflects has: diffuse and specular.
pub(crate) const PARTS: usize = 2;

/// The light that a surface reflects: diffuse and specular.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LightTerm(pub [Rgb; PARTS]);

impl LightTerm {
    pub const BLACK: LightTerm = LightTerm([Rgb::BLACK; PARTS]);

    #[inline(always)]
    pub fn sum(self) -> Rgb {
        let [diffuse, specular] = self.0;
        diffuse + specular
    }
}

impl AddAssign for LightTerm {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        for (sum, other) in self.0.iter_mut().zip(other.0) {
            *sum += other;
        }
    }
}

impl Mul<f32> for LightTerm {
    type Output = Self;

    #[inline(always)]
    fn mul(self, times: f32) -> Self {
        LightTerm(self.0.map(|part| part * times))
    }
}

impl<T: Copy> PerMoment<T> {
    /// Bounds: of what is as wide as the cosine, and of highlights.
    #[inline(always)]
    pub fn bounds(wide: T, narrow: T) -> Self {
        PerMoment([wide, narrow, narrow])
    }

    /// The cosine's.
    #[inline(always)]
    pub fn cosine(&self) -> T {
        self.0[0]
    }

    #[inline(always)]
    pub fn map<U>(self, f: impl Fn(T) -> U) -> PerMoment<U> {
        PerMoment(self.0.map(f))
    }

    #[inline(always)]
    pub fn zip<U: Copy, V>(self, other: PerMoment<U>, f: impl Fn(T, U) -> V) -> PerMoment<V> {
        PerMoment(std::array::from_fn(|k| f(self.0[k], other.0[k])))
    }
}

impl Moments {
    pub const ZERO: Moments = PerMoment([0.0; MOMENTS]);
    pub const UNKNOWN: Moments = PerMoment([f32::NAN; MOMENTS]);

    #[inline(always)]
    pub fn is_known(&self) -> bool {
        !self.0[0].is_nan()
    }

    #[inline(always)]
    pub fn max(self, other: Moments) -> Moments {
        self.zip(other, f32::max)
    }

    #[inline(always)]
    pub fn min(self, other: Moments) -> Moments {
        self.zip(other, f32::min)
    }

    #[inline(always)]
    pub fn apart(self, other: Moments) -> Moments {
        self.zip(other, |a, b| (a - b).abs())
    }

    #[inline(always)]
    pub fn at_least_0(self) -> Moments {
        self.map(|v| v.max(0.0))
    }
}

impl Colors {
    pub const BLACK: Colors = PerMoment([Rgb::BLACK; MOMENTS]);

    /// Each moment with its colour.
    #[inline(always)]
    pub fn each(self, moments: &Moments) -> Colors {
        self.zip(*moments, |color, moment| color * moment)
    }

    /// The light that is reflected of so much of each moment: the diffuse part is that of the first.
    #[inline(always)]
    pub fn reflected(self, moments: &Moments) -> LightTerm {
        self.each(moments).term()
    }

    /// The parts of light of which each moment is so much.
    #[inline(always)]
    pub fn term(self) -> LightTerm {
        let [diffuse, highlight, rest @ ..] = self.0;
        LightTerm([diffuse, rest.into_iter().fold(highlight, |sum, part| sum + part)])
    }

    /// Adds what moments make.
    #[inline(always)]
    pub fn onto(self, base: Rgb, moments: &Moments) -> Rgb {
        self.each(moments).0.into_iter().fold(base, |sum, part| sum + part)
    }

    /// What moments make.
    #[inline(always)]
    pub fn of(self, moments: &Moments) -> Rgb {
        self.each(moments).sum()
    }

    #[inline(always)]
    pub fn sum(self) -> Rgb {
        let [first, rest @ ..] = self.0;
        rest.into_iter().fold(first, |sum, part| sum + part)
    }

    #[inline(always)]
    pub fn max(self, other: Colors) -> Colors {
        self.zip(other, Rgb::max)
    }

    #[inline(always)]
    pub fn min(self, other: Colors) -> Colors {
        self.zip(other, Rgb::min)
    }
}

impl<T: Copy + Add<Output = T>> Add for PerMoment<T> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<T: Copy + Add<Output = T>> AddAssign for PerMoment<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Copy + Mul<f32, Output = T>> Mul<f32> for PerMoment<T> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, times: f32) -> Self {
        self.map(|of| of * times)
    }
}

impl Mul for Colors {
    type Output = Colors;

    #[inline(always)]
    fn mul(self, other: Colors) -> Colors {
        self.zip(other, |a, b| a * b)
    }
}

impl Mul<Colors> for Rgb {
    type Output = Colors;

    #[inline(always)]
    fn mul(self, colors: Colors) -> Colors {
        colors.map(|color| self * color)
    }
}
