//! Colour: linear Rec. 709 everywhere inside; sRGB and gamma only at the edges.

mod coupling;
mod display;
mod names;
mod quantize;
mod ramp;
mod steps;
mod tone;

pub use display::{Display, Encoding};
pub(crate) use names::{CSS_COLORS, css_color};
pub(crate) use quantize::Quantizer;
pub(crate) use ramp::false_color;
pub(crate) use steps::DisplaySteps;
pub use tone::ToneMapping;

use std::ops::{Add, AddAssign, Mul};

/// Linear Rec. 709, scene-referred: no upper bound, not display-encoded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rgb {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
}

impl Rgb {
    /// No light.
    pub const BLACK: Rgb = Rgb::new(0.0, 0.0, 0.0);
    /// 1 in every channel.
    pub const WHITE: Rgb = Rgb::new(1.0, 1.0, 1.0);

    /// From the three channels.
    #[inline(always)]
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self { r, g, b }
    }

    /// Red, green and blue.
    #[inline(always)]
    pub(crate) fn from_array([r, g, b]: [f32; 3]) -> Self {
        Rgb { r, g, b }
    }

    /// Red, green and blue.
    #[inline(always)]
    pub(crate) fn to_array(self) -> [f32; 3] {
        [self.r, self.g, self.b]
    }

    /// The same value in all channels.
    #[inline(always)]
    pub const fn gray(v: f32) -> Self {
        Self::new(v, v, v)
    }

    /// How bright it is: Y of Rec. 709.
    pub(crate) fn luminance(self) -> f32 {
        0.2126 * self.r + 0.7152 * self.g + 0.0722 * self.b
    }

    /// The smaller of two, channel by channel.
    #[inline(always)]
    pub(crate) fn min(self, o: Rgb) -> Rgb {
        Rgb::new(self.r.min(o.r), self.g.min(o.g), self.b.min(o.b))
    }

    /// The larger of two, channel by channel.
    #[inline(always)]
    pub(crate) fn max(self, o: Rgb) -> Rgb {
        Rgb::new(self.r.max(o.r), self.g.max(o.g), self.b.max(o.b))
    }

    /// What a function makes of each channel.
    #[inline(always)]
    pub(crate) fn map(self, f: impl Fn(f32) -> f32) -> Rgb {
        Rgb::new(f(self.r), f(self.g), f(self.b))
    }

    /// Whether every channel is exactly 0.
    #[inline(always)]
    pub fn is_black(self) -> bool {
        self.r == 0.0 && self.g == 0.0 && self.b == 0.0
    }
}

impl Add for Rgb {
    type Output = Rgb;
    #[inline(always)]
    fn add(self, o: Rgb) -> Rgb {
        Rgb::new(self.r + o.r, self.g + o.g, self.b + o.b)
    }
}

impl AddAssign for Rgb {
    #[inline(always)]
    fn add_assign(&mut self, o: Rgb) {
        *self = *self + o;
    }
}

impl Mul for Rgb {
    type Output = Rgb;
    #[inline(always)]
    fn mul(self, o: Rgb) -> Rgb {
        Rgb::new(self.r * o.r, self.g * o.g, self.b * o.b)
    }
}

impl Mul<f32> for Rgb {
    type Output = Rgb;
    #[inline(always)]
    fn mul(self, s: f32) -> Rgb {
        Rgb::new(self.r * s, self.g * s, self.b * s)
    }
}
