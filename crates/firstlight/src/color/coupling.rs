//! How far an error of linear light shows behind the tone mapping [`Neutral`](super::ToneMapping::Neutral), which joins
//! the channels: what is subtracted of all depends on the smallest one, and the compression on the largest.
//!
//! Let c be the light after exposure, m its smallest channel, p its largest one less the offset o(m), f(c) the mapped
//! colour and S the sRGB curve. An error e of c changes channel i of the picture by S'(f_i) sum_j |df_i / dc_j| e_j, to
//! first order. This is bounded by three terms.
//!
//! - Its own error: |df_i / dc_i| S'(f_i) is at most T'(c_i), the slope of [`neutral_curve`], whatever the other
//!   channels are. At the toe f_i is at least 6.25 c_i^2, in the middle c_i - 0.04. Where light is compressed by a
//!   factor k, the slope is k S'(k c), which is at most S'(c), since x S'(x) never falls.
//! - The smallest channel: the offset changes by at most t = max(0, 1 - 12.5 m) times the error of m. Channel i has
//!   that error beside its own.
//! - The largest channel: where p is above 0.76, the compression changes by the error of p. The effect on the others is
//!   at most [`OF_PEAK`] times that error on T; in dark channels of saturated colours, where the curve is steeper,
//!   [`OF_SATURATED_PEAK`] times.
//!
//! All factors are taken at the end of the interval c - e to c + e where they are largest, and the channels that may be
//! the smallest or largest within it count with the largest of their errors. The signs of errors are not known, so the
//! bound counts them all as adding up: for gray light it is up to 2 times the true slope at the toe, 1 in the middle.

use super::tone::{neutral, neutral_offset};
use super::{Encoding, Rgb};

/// The most that the error of the largest channel shows in another one, as a part of what it shows on the curve: 0.706
/// by 400,000 random colours whose smallest channel is at least [`SATURATED`] of the largest.
const OF_PEAK: f32 = 0.75;
/// The same of all other colours: 1.515.
const OF_SATURATED_PEAK: f32 = 1.6;
/// The smallest channel as a part of the largest, below which a colour counts as saturated.
const SATURATED: f32 = 0.1;

/// The slope of the toe's parabola falls by this for each unit of light: 1 / (2 x 0.04).
const TOE_BEND: f32 = 12.5;

/// A curve that is nowhere flatter than a channel of the picture is over its own light; both after exposure.
pub(super) fn neutral_curve(value: f64) -> f64 {
    use neutral::*;
    // The power part of the sRGB curve: its slope is SLOPE x^(-7/12)
    const SLOPE: f64 = 1.055 / 2.4;
    let power = |x: f64| pxfm::f_pow(x, -7.0 / 12.0);
    let bend = 1.0 / (4.0 * F0);
    // On the toe, where a channel is shown as at least bend x^2: the integral of S'(bend x^2)
    let knee = (0.0031308 / bend).sqrt();
    if value <= knee {
        return 12.92 * value;
    }
    let root = |x: f64| pxfm::f_pow(x, -1.0 / 6.0);
    let toe = |x: f64| 12.92 * knee + SLOPE * power(bend) * 6.0 * (root(knee) - root(x));
    if value <= TOE {
        return toe(value);
    }
    // Then as the encoding less the offset, and straight on from the start of the compression to white
    let middle = |x: f64| toe(TOE) + Encoding::Srgb.encode(x - F0) - Encoding::Srgb.encode(TOE - F0);
    let end = START + F0;
    if value <= end {
        return middle(value);
    }
    let steepness = SLOPE * power(START);
    let straight = |x: f64| middle(end) + steepness * (x - end);
    if value <= 1.0 { straight(value) } else { straight(1.0) + steepness * pxfm::f_log(value) }
}

/// The effect of channels on each other.
#[derive(Clone, Debug)]
pub(super) struct NeutralCoupling {
    /// Of the exposure.
    factor: f32,
}

/// The effect of channels on each other, for colours within an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoupledChannels {
    /// How much of an error of the smallest channel all others have.
    toe: f32,
    /// Which channels may be the smallest one, and which the largest.
    is_least: [bool; 3],
    is_peak: [bool; 3],
    /// The part of the steps of the largest channel that others show.
    pub of_peak: f32,
    /// The least value of the largest channel, before exposure.
    pub peak: f32,
}

/// The same with the slope of the curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoupledSlopes {
    pub channels: CoupledChannels,
    /// Steps of all channels for each unit of error of the largest one.
    pub of_peak: f32,
}

impl NeutralCoupling {
    pub fn new(factor: f32) -> Self {
        NeutralCoupling { factor }
    }

    /// For colours that are off from `value` by at most `error`.
    pub fn within(&self, value: Rgb, error: Rgb) -> CoupledChannels {
        let (value, error) = (value.to_array(), error.to_array());
        let low: [f32; 3] = std::array::from_fn(|k| (value[k] - error[k]).max(0.0) * self.factor);
        let high: [f32; 3] = std::array::from_fn(|k| (value[k] + error[k]).max(0.0) * self.factor);
        let least = |of: [f32; 3]| of[0].min(of[1]).min(of[2]);
        let most = |of: [f32; 3]| of[0].max(of[1]).max(of[2]);
        let (least_low, least_high, peak_low, peak_high) = (least(low), least(high), most(low), most(high));
        let is_compressed = f64::from(peak_high) - neutral_offset(f64::from(least_low)) > neutral::START;
        let of_peak = match is_compressed {
            false => 0.0,
            true if least_low >= SATURATED * peak_high => OF_PEAK,
            true => OF_SATURATED_PEAK,
        };
        CoupledChannels {
            toe: (1.0 - TOE_BEND * least_low).max(0.0),
            is_least: low.map(|low| low <= least_high),
            is_peak: high.map(|high| high >= peak_low),
            of_peak,
            peak: peak_low / self.factor,
        }
    }
}

impl CoupledChannels {
    /// The errors of all channels with what they have of that of the smallest one.
    pub fn with_least(&self, error: Rgb) -> Rgb {
        error + Rgb::gray(self.toe * most_of(error, self.is_least))
    }

    /// The error of the largest channel.
    pub fn peak_error(&self, error: Rgb) -> f32 {
        most_of(error, self.is_peak)
    }
}

/// The largest of some channels; 0 of none.
fn most_of(error: Rgb, of: [bool; 3]) -> f32 {
    let error = error.to_array();
    (0..3).fold(0.0, |most: f32, k| if of[k] { most.max(error[k]) } else { most })
}

#[cfg(test)]
mod tests {
    use super::super::{Display, DisplaySteps, ToneMapping};
    use super::*;

    /// Pseudo-random numbers, 0 to 1.
    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 / (1u32 << 24) as f32
        }
    }

    fn power(x: f32, exponent: u32) -> f32 {
        (0..exponent).fold(1.0, |product, _| product * x)
    }

    /// A colour of any brightness from 0.003 to 16: gray, nearly gray, or saturated.
    fn color(random: &mut Random) -> Rgb {
        let brightness = 0.003 * 5000.0 * power(random.next(), 4) + 0.003;
        let exponent = 1 + (random.next() * 5.0) as u32;
        let kind = random.next();
        let mut channel = || match kind {
            kind if kind < 0.15 => 1.0,
            kind if kind < 0.4 => 1.0 + 0.1 * (random.next() - 0.5),
            _ => power(random.next(), exponent),
        };
        Rgb::new(channel(), channel(), channel()) * brightness
    }

    fn neutral(exposure: f64) -> Display {
        Display { exposure, tone_mapping: ToneMapping::Neutral, ..Display::default() }
    }

    /// Steps between two colours.
    fn apart(display: &Display, a: [f32; 3], b: [f32; 3]) -> f32 {
        let (a, b) = (display.encode_color(a), display.encode_color(b));
        (0..3).map(|k| 255.0 * (a[k] - b[k]).abs()).fold(0.0, f64::max) as f32
    }

    #[test]
    fn the_curve_is_at_least_as_steep_as_gray_and_concave() {
        let slope = |f: &dyn Fn(f64) -> f64, x: f64| (f(x * 1.0001) - f(x)) / (x * 0.0001);
        let gray = |x: f64| Encoding::Srgb.encode(ToneMapping::Neutral.apply([x; 3])[0]);
        let mut before = f64::INFINITY;
        for i in 1..4000 {
            let i = f64::from(i);
            let x = 1e-4 * i + 1e-9 * (i * i * i);
            let of_curve = slope(&neutral_curve, x);
            assert!(of_curve >= slope(&gray, x) - 1e-6 && of_curve <= before * (1.0 + 1e-6), "{x}");
            before = of_curve;
        }
        // From 0.08 to 0.8 it is the encoding of what is shown
        assert!((neutral_curve(0.7) - neutral_curve(0.3) - gray(0.7) + gray(0.3)).abs() < 1e-12);
    }

    #[test]
    fn no_error_shows_more_than_the_bound() {
        let mut random = Random(7);
        let mut used = [0.0; 2];
        for exposure in [0.0, -1.5] {
            let display = neutral(exposure);
            let steps = DisplaySteps::new(&display, 1.0);
            for _ in 0..60_000 {
                let value = color(&mut random);
                let size = value.r.max(value.g).max(value.b) * 0.2 * power(random.next(), 4);
                let single = (random.next() * 6.0) as usize;
                let error: [f32; 3] =
                    std::array::from_fn(|k| if single < 3 && single != k { 0.0 } else { size * random.next() });
                let bound = steps.of_color(value, Rgb::from_array(error));
                let truth = value.to_array();
                // The corners of the interval, as errors of 0 or more below the value are what is judged
                for signs in 0..8 {
                    let other: [f32; 3] = std::array::from_fn(|k| {
                        let sign = if signs >> k & 1 == 1 { -1.0 } else { 1.0 };
                        (truth[k] + sign * error[k]).max(0.0)
                    });
                    let shown = apart(&display, truth, other);
                    // The table has 8 chords in each doubling, whose slopes are up to 5 % off
                    assert!(shown <= bound * 1.06 + 2e-4, "{value:?} {error:?} {signs}: {shown} of {bound}");
                    used[usize::from(single >= 3)] = f32::max(used[usize::from(single >= 3)], shown / bound);
                }
            }
        }
        // And it is used up somewhere
        assert!(used.iter().all(|used| *used > 0.9), "{used:?}");
    }

    #[test]
    fn slopes_bound_small_errors() {
        let mut random = Random(11);
        let display = neutral(0.0);
        let steps = DisplaySteps::new(&display, 1.0);
        for _ in 0..60_000 {
            let value = color(&mut random);
            let slopes = steps.slopes(value, 1e-4, 1.0);
            let size = 0.003 * value.r.max(value.g).max(value.b);
            let direction = Rgb::new(random.next(), random.next(), random.next()) * (1.0 / 3.0);
            let truth = value.to_array();
            for signs in 0..8 {
                let other: [f32; 3] = std::array::from_fn(|k| {
                    let sign = if signs >> k & 1 == 1 { -1.0 } else { 1.0 };
                    (truth[k] + sign * size * direction.to_array()[k]).max(0.0)
                });
                let shown = apart(&display, truth, other);
                let bound = slopes.of(direction) * size;
                assert!(shown <= bound * 1.06 + 3e-4, "{value:?} {direction:?} {signs}: {shown} of {bound}");
            }
        }
    }

    #[test]
    fn in_the_middle_channels_are_apart() {
        let steps = DisplaySteps::new(&neutral(0.0), 1.0);
        let plain = DisplaySteps::new(&Display::default(), 1.0);
        let (value, error) = (Rgb::new(0.5, 0.3, 0.2), Rgb::new(0.004, 0.004, 0.004));
        let less = Rgb::new(0.46, 0.26, 0.16);
        let (of_neutral, of_less) = (steps.of_color(value, error), plain.of_color(less, error));
        assert!((of_neutral / of_less - 1.0).abs() < 0.04, "{of_neutral} {of_less}");
    }
}
