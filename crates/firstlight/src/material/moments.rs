//! What light makes of a material, before colours: the moments of its directions, and the colours they are worth.

use std::ops::{Add, AddAssign, Mul};

use crate::color::Rgb;

/// How many there are: the cosine, and the highlight.
pub(crate) const MOMENTS: usize = 2;

/// What arrives, before all colours: the weight times the cosine, and the weight times the highlight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moments(pub [f32; MOMENTS]);

/// What each moment is worth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Colors(pub [Rgb; MOMENTS]);

impl Moments {
    pub const ZERO: Moments = Moments([0.0; MOMENTS]);
    pub const UNKNOWN: Moments = Moments([f32::NAN; MOMENTS]);

    /// Bounds: of what is as wide as the cosine, and of highlights.
    #[inline(always)]
    pub fn bounds(wide: f32, narrow: f32) -> Moments {
        Moments([wide, narrow])
    }

    /// What each makes.
    #[inline(always)]
    pub fn colors(self, f: impl Fn(f32) -> Rgb) -> Colors {
        Colors(self.0.map(f))
    }

    /// The cosine's.
    #[inline(always)]
    pub fn cosine(&self) -> f32 {
        self.0[0]
    }

    #[inline(always)]
    pub fn is_known(&self) -> bool {
        !self.0[0].is_nan()
    }

    #[inline(always)]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Moments {
        Moments(self.0.map(f))
    }

    #[inline(always)]
    pub fn zip(self, other: Moments, f: impl Fn(f32, f32) -> f32) -> Moments {
        Moments(std::array::from_fn(|k| f(self.0[k], other.0[k])))
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

impl Add for Moments {
    type Output = Moments;

    #[inline(always)]
    fn add(self, other: Moments) -> Moments {
        self.zip(other, |a, b| a + b)
    }
}

impl AddAssign for Moments {
    #[inline(always)]
    fn add_assign(&mut self, other: Moments) {
        *self = *self + other;
    }
}

impl Mul<f32> for Moments {
    type Output = Moments;

    #[inline(always)]
    fn mul(self, times: f32) -> Moments {
        self.map(|v| v * times)
    }
}

impl Colors {
    /// As [`Moments::bounds`].
    #[inline(always)]
    pub fn bounds(wide: Rgb, narrow: Rgb) -> Colors {
        Colors([wide, narrow])
    }

    /// That of the cosine.
    #[inline(always)]
    pub fn cosine(&self) -> Rgb {
        self.0[0]
    }

    pub const BLACK: Colors = Colors([Rgb::BLACK; MOMENTS]);

    #[inline(always)]
    pub fn map(self, f: impl Fn(Rgb) -> Rgb) -> Colors {
        Colors(self.0.map(f))
    }

    #[inline(always)]
    pub fn zip(self, other: Colors, f: impl Fn(Rgb, Rgb) -> Rgb) -> Colors {
        Colors(std::array::from_fn(|k| f(self.0[k], other.0[k])))
    }

    /// Each moment with its colour.
    #[inline(always)]
    pub fn each(self, moments: &Moments) -> Colors {
        Colors(std::array::from_fn(|k| self.0[k] * moments.0[k]))
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

impl AddAssign for Colors {
    #[inline(always)]
    fn add_assign(&mut self, other: Colors) {
        *self = self.zip(other, |a, b| a + b);
    }
}

impl Add for Colors {
    type Output = Colors;

    #[inline(always)]
    fn add(self, other: Colors) -> Colors {
        self.zip(other, |a, b| a + b)
    }
}

impl Mul<f32> for Colors {
    type Output = Colors;

    #[inline(always)]
    fn mul(self, times: f32) -> Colors {
        self.map(|color| color * times)
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
