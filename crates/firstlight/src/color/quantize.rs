//! Linear f32 to 8 or 16 bits, many at a time.
//!
//! The definition is [`definition`]: round to nearest of the largest code times [`Display::encode`]. It costs a power
//! for each number. Since it never falls as x grows, code k is the number of thresholds at or below x, where threshold
//! k is the smallest f32 whose code is k or more. So the thresholds are found once, from the definition itself, and a
//! number is then a table look-up by its leading bits, which say how many thresholds lie below its bucket, and a search
//! among the thresholds inside the bucket: none or one for 8 bits and usual curves, a few for 16.

use super::{Display, ToneMapping};
use crate::parallel;

/// The codes of one display and depth.
pub(crate) struct Quantizer {
    /// What is done to colours before the curve, if that is more than exposure.
    tone: Option<Display>,
    /// Without tone mapping: where there is one, the curve alone.
    display: Display,
    largest: u32,
    /// `thresholds[k - 1]`: the bits of the smallest positive f32 with code k or more; never falling. None of them if
    /// the definition itself is to be used.
    thresholds: Vec<u32>,
    /// From one below the first threshold to one beyond the last.
    buckets: Vec<Bucket>,
    /// The leading bits of the numbers in the first bucket.
    first: u32,
    /// The leading bits of a number are its bits without this many at the end.
    shift: u32,
}

/// The numbers that share their leading bits.
#[derive(Clone, Copy)]
struct Bucket {
    /// The first threshold inside; larger than any number's bits if there is none.
    threshold: u32,
    /// How many thresholds are below it.
    below: u16,
    /// How many thresholds are inside.
    inside: u16,
}

/// The bits of positive infinity: the last that a number can have here.
const INFINITE: u32 = f32::INFINITY.to_bits();

/// The code, 0 to `largest`, that a linear value has in a picture without tone mapping: what every faster way must
/// agree with. Halves are rounded up; NaN is 0.
pub(crate) fn definition(display: &Display, largest: u32, linear: f32) -> u16 {
    (display.encode(linear) * f64::from(largest)).round() as u16
}

impl Quantizer {
    /// For codes 0 to `largest`: 255 or 65535. `display` has no [`Display::fault`].
    pub(crate) fn new(display: &Display, largest: u32) -> Self {
        debug_assert!(display.fault().is_none() && (1..=65535).contains(&largest));
        let (tone, display) = Self::apart(display);
        // Find each threshold, starting where the inverse curve says that it is
        let thresholds = parallel::map(largest as usize, 64, |i| {
            let k = i as u32 + 1;
            let edge = display.encoding.decode((f64::from(k) - 0.5) / f64::from(largest)) / display.factor();
            smallest((edge as f32).to_bits(), |bits| {
                u32::from(definition(&display, largest, f32::from_bits(bits))) >= k
            })
        });
        debug_assert!(thresholds.is_sorted());
        // Count the thresholds in each bucket; 256 buckets an octave for 8 bits, 2048 for 16
        let shift = if largest <= 255 { 15 } else { 12 };
        let first = (thresholds[0] >> shift).saturating_sub(1);
        let last = thresholds[largest as usize - 1] >> shift;
        let mut below = 0;
        let mut buckets = Vec::with_capacity((last - first) as usize + 2);
        for leading in first..=last + 1 {
            let inside = thresholds[below..].partition_point(|&t| t >> shift == leading);
            buckets.push(Bucket {
                threshold: if inside > 0 { thresholds[below] } else { u32::MAX },
                below: below as u16,
                inside: inside as u16,
            });
            below += inside;
        }
        Self { tone, display, largest, thresholds, buckets, first, shift }
    }

    /// As [`Quantizer::new`], for about `count` values: without thresholds where finding them would take longer than it
    /// saves.
    pub(crate) fn for_count(display: &Display, largest: u32, count: usize) -> Self {
        if count as u64 > 4 * u64::from(largest) {
            return Self::new(display, largest);
        }
        let (tone, display) = Self::apart(display);
        Self { tone, display, largest, thresholds: Vec::new(), buckets: Vec::new(), first: 0, shift: 0 }
    }

    /// The tone mapping of a display, if it has one, and what is left to be done to each channel.
    fn apart(display: &Display) -> (Option<Display>, Display) {
        match display.tone_mapping {
            ToneMapping::None => (None, *display),
            ToneMapping::Neutral => (Some(*display), display.curve()),
        }
    }

    /// The codes of a colour: those of [`Display::encode_color`].
    #[inline]
    pub(crate) fn codes(&self, color: [f32; 3]) -> [u16; 3] {
        let shown = self.tone.as_ref().map_or(color, |display| display.shown(color));
        shown.map(|channel| self.code(channel))
    }

    /// The code, 0 to `largest`, of a number from 0 to 1 that is not encoded, such as alpha. NaN is 0.
    #[inline]
    pub(crate) fn linear(x: f32, largest: u32) -> u16 {
        (f64::from(x).clamp(0.0, 1.0) * f64::from(largest)).round() as u16
    }

    /// The code of a linear value that is not tone mapped any more: exactly [`definition`].
    #[inline]
    fn code(&self, linear: f32) -> u16 {
        // NaN is not above 0
        let bits = if linear > 0.0 { linear.to_bits() } else { 0 };
        // Numbers before the first bucket share its code, numbers beyond the last that of the last
        let i = (bits >> self.shift).saturating_sub(self.first) as usize;
        let Some(bucket) = self.buckets.get(i).or(self.buckets.last()) else {
            return definition(&self.display, self.largest, linear);
        };
        if bucket.inside > 1 {
            return self.among(bits, bucket);
        }
        bucket.below + u16::from(bits >= bucket.threshold)
    }

    /// The code of a number in a bucket of several thresholds.
    #[inline]
    fn among(&self, bits: u32, bucket: &Bucket) -> u16 {
        let inside = &self.thresholds[usize::from(bucket.below)..][..usize::from(bucket.inside)];
        if inside.len() > 64 {
            return bucket.below + inside.partition_point(|&t| t <= bits) as u16;
        }
        // They lie nearly evenly: begin where the number would be among even ones
        let trailing = bits & ((1 << self.shift) - 1);
        let mut k = (trailing as usize * inside.len()) >> self.shift;
        // The first of them lies anywhere in its step; mostly this settles it, without a jump to be guessed
        k += usize::from(inside[k] <= bits);
        while k < inside.len() && inside[k] <= bits {
            k += 1;
        }
        while k > 0 && inside[k - 1] > bits {
            k -= 1;
        }
        bucket.below + k as u16
    }
}

/// The smallest bits, from 0 to those of infinity, for which `reached` holds; once it holds it goes on holding, and it
/// holds for infinity. Few calls if `guess` is close.
fn smallest(guess: u32, reached: impl Fn(u32) -> bool) -> u32 {
    let guess = guess.min(INFINITE);
    // Bracket it: `low` is not reached (or is 0), `high` is
    let (mut low, mut high, mut step) = (guess, guess, 1);
    if reached(guess) {
        while low > 0 {
            high = low;
            low = low.saturating_sub(step);
            step *= 2;
            if !reached(low) {
                break;
            }
        }
        if low == 0 && reached(0) {
            return 0;
        }
    } else {
        loop {
            low = high;
            high = (high + step).min(INFINITE);
            step *= 2;
            if high == INFINITE || reached(high) {
                break;
            }
        }
    }
    // Halve the bracket
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if reached(middle) { high = middle } else { low = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::super::Encoding;
    use super::*;

    fn displays() -> Vec<Display> {
        let mut all = Vec::new();
        for encoding in [
            Encoding::Srgb,
            Encoding::Gamma(2.2),
            Encoding::Gamma(1.8),
            Encoding::Gamma(0.45),
            Encoding::Gamma(40.0),
            Encoding::Linear,
        ] {
            for exposure in [0.0, 1.0, -2.0, 0.37, -64.0, 64.0] {
                all.push(Display { encoding, exposure, ..Display::default() });
            }
        }
        all
    }

    fn agrees(quantizer: &Quantizer, display: &Display, largest: u32, x: f32) {
        assert_eq!(quantizer.code(x), definition(display, largest, x), "{display:?} {largest} {x:e}");
    }

    #[test]
    fn eight_bits_are_exact_at_every_threshold_and_its_neighbours() {
        for display in displays() {
            let quantizer = Quantizer::new(&display, 255);
            for &t in &quantizer.thresholds {
                for bits in t.saturating_sub(2)..=(t + 2).min(INFINITE) {
                    agrees(&quantizer, &display, 255, f32::from_bits(bits));
                }
            }
        }
    }

    #[test]
    fn sixteen_bits_are_exact_at_every_threshold_and_its_neighbours() {
        for display in [
            Display::default(),
            Display { encoding: Encoding::Gamma(2.2), exposure: 0.3, ..Display::default() },
            Display { encoding: Encoding::Linear, exposure: -5.0, ..Display::default() },
        ] {
            let quantizer = Quantizer::new(&display, 65535);
            for &t in &quantizer.thresholds {
                for bits in t - 1..=t + 1 {
                    agrees(&quantizer, &display, 65535, f32::from_bits(bits));
                }
            }
        }
    }

    #[test]
    fn both_depths_are_exact_over_all_floats() {
        for display in displays() {
            for largest in [255, 65535] {
                let quantizer = Quantizer::new(&display, largest);
                // A prime stride visits every exponent and many mantissas, negative numbers and NaN included
                for bits in (0..=u32::MAX).step_by(1_299_709) {
                    agrees(&quantizer, &display, largest, f32::from_bits(bits));
                }
                for i in 0..4000 {
                    agrees(&quantizer, &display, largest, i as f32 / 3333.0);
                }
            }
        }
    }

    #[test]
    fn odd_numbers() {
        for largest in [255, 65535] {
            let quantizer = Quantizer::new(&Display::default(), largest);
            for x in [f32::NAN, -f32::NAN, -1.0, f32::NEG_INFINITY, 0.0, -0.0, f32::MIN_POSITIVE, 1e-45] {
                assert_eq!(quantizer.code(x), 0);
            }
            for x in [1.0, 1.5, f32::MAX, f32::INFINITY] {
                assert_eq!(u32::from(quantizer.code(x)), largest);
            }
        }
    }

    #[test]
    fn extreme_gammas_do_no_harm() {
        for gamma in [1e-300, 1e-3, 1e3, 1e300] {
            let display = Display { encoding: Encoding::Gamma(gamma), exposure: 0.5, ..Display::default() };
            let quantizer = Quantizer::new(&display, 65535);
            for x in [0.0, 1e-40, 1e-3, 0.5, 0.706, 0.708, 0.999, 1.0, 2.0, f32::INFINITY] {
                agrees(&quantizer, &display, 65535, x);
            }
        }
    }

    #[test]
    fn codes_survive_decoding() {
        for encoding in [Encoding::Srgb, Encoding::Gamma(2.2), Encoding::Linear] {
            let quantizer = Quantizer::new(&Display { encoding, ..Display::default() }, 255);
            for (k, x) in (0..256).map(|k| encoding.decode(k as f64 / 255.0) as f32).enumerate() {
                assert_eq!(usize::from(quantizer.code(x)), k);
            }
        }
    }

    #[test]
    fn colors_are_mapped_before_the_curve() {
        let neutral = Display { exposure: -0.7, tone_mapping: ToneMapping::Neutral, ..Display::default() };
        for display in [neutral, Display { exposure: 0.37, ..Display::default() }] {
            for (largest, count) in [(255, usize::MAX), (65535, usize::MAX), (255, 1)] {
                let quantizer = Quantizer::for_count(&display, largest, count);
                for i in 0..2000_u16 {
                    let color = [i % 13, i % 31, i % 7].map(|part| f32::from(part * part) * 0.011);
                    let expected = display.encode_color(color).map(|c| (c * f64::from(largest)).round() as u16);
                    assert_eq!(quantizer.codes(color), expected, "{display} {largest} {color:?}");
                }
                assert_eq!(quantizer.codes([f32::NAN, -1.0, 0.0]), [0; 3]);
            }
        }
    }
}
