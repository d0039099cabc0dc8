//! From numbers to places in a colour map, and the numbers that a legend has.

use super::Rgb8;
use super::colors::map;

/// What lies between the lowest and the highest number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    low: f64,
    high: f64,
    is_logarithmic: bool,
    /// Whether low numbers are bright: what is near is in front.
    is_distance: bool,
}

/// From this ratio on, distances are on a logarithmic scale.
const WIDE: f64 = 30.0;

impl Scale {
    /// That of a range, or of the finite numbers.
    pub fn linear(range: Option<[f64; 2]>, numbers: impl Iterator<Item = f64>) -> Scale {
        let [low, high] = range.unwrap_or_else(|| {
            let ends = numbers
                .filter(|number| number.is_finite())
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], number| [low.min(number), high.max(number)]);
            if ends[0] <= ends[1] { ends } else { [0.0, 1.0] }
        });
        // What is the same everywhere has a range around it
        let room = if high > low { 0.0 } else { (low.abs() * 0.5).max(0.5) };
        Scale { low: low - room, high: high + room, is_logarithmic: false, is_distance: false }
    }

    /// The same of distances, logarithmic where that shows more.
    pub fn of(range: Option<[f64; 2]>, numbers: impl Iterator<Item = f64>) -> Scale {
        let scale = Scale::linear(range, numbers);
        Scale { is_logarithmic: scale.low > 0.0 && scale.high / scale.low > WIDE, is_distance: true, ..scale }
    }

    /// The place of a number from 0 to 1; `None` of one that is not finite.
    pub fn place(&self, number: f64) -> Option<f64> {
        let Scale { low, high, is_logarithmic, .. } = *self;
        let place = if is_logarithmic {
            pxfm::f_log2(number.max(low) / low) / pxfm::f_log2(high / low)
        } else {
            (number - low) / (high - low)
        };
        number.is_finite().then_some(place.clamp(0.0, 1.0))
    }

    /// The colour of a place.
    pub fn color(&self, place: f64) -> Rgb8 {
        map(if self.is_distance { 1.0 - place } else { place })
    }

    /// Numbers for a legend, about `count` of them, round, and written so.
    pub fn ticks(&self, count: usize) -> Vec<(f64, String)> {
        let ticks = if self.is_logarithmic { self.logarithmic_ticks(count) } else { self.linear_ticks(count) };
        let written = ticks.into_iter().map(|tick| (tick, written(tick, self.step(count))));
        written.filter(|(_, text)| text.len() <= 9).collect()
    }

    /// 1, 2 or 5 times a power of ten.
    fn step(&self, count: usize) -> f64 {
        let wanted = (self.high - self.low) / count.max(1) as f64;
        let decade = power_of_ten(pxfm::f_log10(wanted).floor() as i32);
        [1.0, 2.0, 5.0, 10.0].map(|n| n * decade).into_iter().find(|step| *step >= wanted * 0.999).unwrap_or(wanted)
    }

    fn linear_ticks(&self, count: usize) -> Vec<f64> {
        let step = self.step(count);
        let first = (self.low / step).ceil();
        (0..=4 * count).map(|k| (first + k as f64) * step).take_while(|tick| *tick <= self.high).collect()
    }

    fn logarithmic_ticks(&self, count: usize) -> Vec<f64> {
        let decades = pxfm::f_log10(self.low).floor() as i32..=pxfm::f_log10(self.high).ceil() as i32;
        let all = |of: &[f64]| -> Vec<f64> {
            let ticks = decades.clone().flat_map(|decade| of.iter().map(move |n| n * power_of_ten(decade)));
            ticks.filter(|tick| (self.low..=self.high).contains(tick)).collect()
        };
        let some = [&[1.0, 2.0, 5.0][..], &[1.0, 3.0], &[1.0]].map(all);
        some.iter().find(|ticks| ticks.len() <= count).unwrap_or(&some[2]).iter().copied().take(count).collect()
    }
}

fn power_of_ten(exponent: i32) -> f64 {
    pxfm::f_exp10(f64::from(exponent))
}

/// A number with as many decimals as steps of that size need; of very large and small ones with an exponent.
fn written(number: f64, step: f64) -> String {
    let size = number.abs().max(step);
    if !(1e-4..1e8).contains(&size) {
        // As many digits as tell one step from the next, and as fit
        let digits = pxfm::f_log10(size / step).floor().clamp(1.0, 4.0) as usize;
        return format!("{number:.digits$e}");
    }
    if number.abs() >= 1.0 && number == number.round() {
        return format!("{number}");
    }
    let least = if number == 0.0 { step } else { step.min(number.abs()) };
    let decimals = (-pxfm::f_log10(least * 1.001).floor()).clamp(0.0, 6.0) as usize;
    format!("{number:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(scale: Scale, count: usize) -> Vec<String> {
        scale.ticks(count).into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn ticks_are_round() {
        let linear = |low, high| Scale::linear(Some([low, high]), [].into_iter());
        assert_eq!(texts(linear(3.1, 11.9), 5), ["4", "6", "8", "10"]);
        assert_eq!(texts(linear(0.0, 1.0), 5), ["0.0", "0.2", "0.4", "0.6", "0.8", "1"]);
        assert_eq!(texts(linear(2e6, 2e6 + 4.0), 4), ["2000000", "2000001", "2000002", "2000003", "2000004"]);
        assert_eq!(texts(linear(3e9, 3.4e9), 2), ["3.0e9", "3.2e9", "3.4e9"]);
        assert_eq!(texts(linear(-0.03, 0.02), 5), ["-0.03", "-0.02", "-0.01", "0.00", "0.01", "0.02"]);
        let wide = Scale::of(Some([0.5, 2000.0]), [].into_iter());
        assert_eq!(texts(wide, 6), ["1", "10", "100", "1000"]);
        assert_eq!(texts(Scale::of(Some([0.5, 20.0]), [].into_iter()), 6), ["0.5", "1", "2", "5", "10", "20"]);
    }

    #[test]
    fn places_go_from_0_to_1() {
        let scale = Scale::of(None, [1.0, f64::INFINITY, f64::NAN, 100.0].into_iter());
        assert_eq!([scale.place(1.0), scale.place(100.0), scale.place(f64::NAN)], [Some(0.0), Some(1.0), None]);
        assert!((scale.place(10.0).unwrap() - 0.5).abs() < 1e-12);
        let same = Scale::linear(None, [4.0, 4.0].into_iter());
        assert_eq!(same.place(4.0), Some(0.5));
        assert_eq!(Scale::linear(None, [f64::NAN].into_iter()).place(0.5), Some(0.5));
    }
}
