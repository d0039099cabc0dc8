//! How far an error of linear light shows.

use super::coupling::{CoupledSlopes, NeutralCoupling, neutral_curve};
use super::{Display, Encoding, Rgb, ToneMapping};

/// The part of a value that counts as a small error of it, for slopes.
const SMALL: f32 = 0.0625;
/// Entries for each doubling of the value.
const PER_OCTAVE: u32 = 8;
/// The table begins at 2^-40 and ends at 2^24.
const FIRST: i32 = -40;
const LAST: i32 = 24;
const ENTRIES: usize = ((LAST - FIRST) as u32 * PER_OCTAVE) as usize + 1;

/// The display encoding as a table, for judging errors: in display steps, which are those of an 8-bit picture times the
/// scene's tolerance. What is judged by it scales with the tolerance. Beyond white it goes on as steep as it is there,
/// over the value: what a picture cuts off may still be wanted in a file of floats.
///
/// With a tone mapping, which joins the channels, the table is a curve that is at least as steep as the displayed
/// channel over its own value whatever the other two are, and the effect of the others is added ([`NeutralCoupling`]).
#[derive(Clone, Debug)]
pub(crate) struct DisplaySteps {
    encoded: Vec<f32>,
    /// How channels affect each other, where there is a tone mapping.
    coupling: Option<NeutralCoupling>,
}

/// The slopes of a colour: the part of an allowed error that errors of linear light use up, for each unit of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorSlopes {
    /// Of the error of each channel.
    own: Rgb,
    coupling: Option<CoupledSlopes>,
}

impl ErrorSlopes {
    /// The most of any channel, for errors of a unit times `error`, 0 or more.
    #[inline(always)]
    pub fn of(&self, error: Rgb) -> f32 {
        let own = |error: Rgb| (error.r * self.own.r).max(error.g * self.own.g).max(error.b * self.own.b);
        match &self.coupling {
            None => own(error),
            Some(CoupledSlopes { channels, of_peak }) => {
                own(channels.with_least(error)) + of_peak * channels.peak_error(error)
            }
        }
    }
}

impl DisplaySteps {
    pub fn new(display: &Display, tolerance: f64) -> Self {
        let encoding = display.encoding;
        // Of the curve at white
        let slope = match encoding {
            Encoding::Srgb => 1.055 / 2.4,
            Encoding::Gamma(gamma) => 1.0 / gamma,
            Encoding::Linear => 1.0,
        };
        let factor = display.factor();
        let encode = |i: usize| {
            let (octave, part) = (i as i32 / PER_OCTAVE as i32 + FIRST, i as u32 % PER_OCTAVE);
            let value = pxfm::f_exp2(f64::from(octave)) * (1.0 + f64::from(part) / f64::from(PER_OCTAVE)) * factor;
            let value = match display.tone_mapping {
                ToneMapping::Neutral => neutral_curve(value),
                ToneMapping::None if value < 1.0 => encoding.encode(value),
                ToneMapping::None => 1.0 + slope * pxfm::f_log(value),
            };
            (255.0 / tolerance * value) as f32
        };
        let coupling = (display.tone_mapping == ToneMapping::Neutral).then(|| NeutralCoupling::new(factor as f32));
        DisplaySteps { encoded: (0..ENTRIES).map(encode).collect(), coupling }
    }

    /// The encoded value of a linear one, 0 or more, in steps.
    #[inline(always)]
    fn encode(&self, value: f32) -> f32 {
        const SHIFT: u32 = 23 - PER_OCTAVE.ilog2();
        const START: u32 = ((127 + FIRST) as u32) << 23;
        let bits = value.to_bits();
        if !(value >= f32::from_bits(START)) {
            return self.encoded[0] * (value.max(0.0) * f32::from_bits(((127 - FIRST) as u32) << 23));
        }
        let place = (((bits - START) >> SHIFT) as usize).min(ENTRIES - 2);
        let part = (bits & ((1 << SHIFT) - 1)) as f32 / (1u32 << SHIFT) as f32;
        self.encoded[place] + (self.encoded[place + 1] - self.encoded[place]) * part
    }

    /// How many steps a value of at least `value` can be off by an error of `error`, 0 or more.
    #[inline(always)]
    pub fn of_error(&self, value: f32, error: f32) -> f32 {
        if error == 0.0 {
            return 0.0;
        }
        let low = (value - error).max(0.0);
        self.encode(low + error) - self.encode(low)
    }

    /// The value that is so many steps above black.
    pub fn value_of(&self, steps: f32) -> f32 {
        let above = self.encoded.partition_point(|encoded| *encoded < steps);
        let octave = above as f64 / f64::from(PER_OCTAVE) + f64::from(FIRST);
        pxfm::f_exp2(octave) as f32
    }

    /// How many steps an error makes at a value for each unit of it.
    #[inline(always)]
    fn slope(&self, value: f32, least: f32) -> f32 {
        let value = value.max(least);
        let error = least.max(value * SMALL);
        self.of_error(value, error) / error
    }

    /// The slopes of a colour, over an allowed error in display steps. `least` is the least value that shows: errors as
    /// large are looked for at black, where the curve is steepest.
    #[inline(always)]
    pub fn slopes(&self, value: Rgb, least: f32, allowed: f32) -> ErrorSlopes {
        let own = if value.r == value.g && value.g == value.b {
            Rgb::gray(self.slope(value.r, least) / allowed)
        } else {
            value.map(|value| self.slope(value, least) / allowed)
        };
        let coupling = self.coupling.as_ref().map(|coupling| self.coupled_slopes(coupling, value, least, allowed));
        ErrorSlopes { own, coupling }
    }

    #[inline(never)]
    fn coupled_slopes(&self, coupling: &NeutralCoupling, value: Rgb, least: f32, allowed: f32) -> CoupledSlopes {
        let channels = coupling.within(value, value.map(|value| least.max(value * SMALL)));
        CoupledSlopes { channels, of_peak: channels.of_peak * self.slope(channels.peak, least) / allowed }
    }

    /// The most steps of any channel.
    #[inline(always)]
    pub fn of_color(&self, value: Rgb, error: Rgb) -> f32 {
        match &self.coupling {
            None => self.of_channels(value, error),
            Some(coupling) => self.of_coupled(coupling, value, error),
        }
    }

    #[inline(always)]
    fn of_channels(&self, value: Rgb, error: Rgb) -> f32 {
        self.of_error(value.r, error.r).max(self.of_error(value.g, error.g)).max(self.of_error(value.b, error.b))
    }

    #[inline(never)]
    fn of_coupled(&self, coupling: &NeutralCoupling, value: Rgb, error: Rgb) -> f32 {
        let channels = coupling.within(value, error);
        let of_peak = channels.peak_error(error);
        self.of_channels(value, channels.with_least(error))
            + channels.of_peak * self.of_error(channels.peak + of_peak, of_peak)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_those_of_the_encoding() {
        for encoding in [Encoding::Srgb, Encoding::Gamma(2.2), Encoding::Linear] {
            let display = Display { encoding, exposure: -1.0, ..Display::default() };
            let [steps, larger] = [1.0, 4.0].map(|tolerance| DisplaySteps::new(&display, tolerance));
            for i in 0..200 {
                let root = (i as f32 / 200.0) * (i as f32 / 200.0);
                let value = 1.9 * root * root;
                let truth = display.encode(value) * 255.0;
                assert!((f64::from(steps.encode(value)) - truth).abs() < 0.12, "{encoding:?} {value}");
                assert!((steps.encode(value) - 4.0 * larger.encode(value)).abs() < 1e-4, "{encoding:?} {value}");
            }
            assert_eq!(steps.of_error(0.3, 0.0), 0.0);
            // Where nothing is lit an error shows as much as it can
            assert!(steps.of_error(0.0, 1e-3) >= steps.of_error(0.5, 1e-3));
            assert!(steps.of_error(1e6, 1.0) > 0.0 && steps.of_error(1e30, 1e30).is_finite());
        }
    }
}
