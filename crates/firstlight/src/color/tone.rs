//! Tone mapping: how scene-linear light that has no upper bound becomes light that a display can show.

/// What is done to light between exposure and the display curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneMapping {
    /// Nothing: what is above 1 is cut off.
    #[default]
    None,
    /// The PBR Neutral tone mapper of Khronos: colours of surfaces stay as they are, highlights above 0.8 are
    /// compressed and turn white. It goes with the sRGB curve.
    Neutral,
}

/// The constants of PBR Neutral, linear light.
pub(super) mod neutral {
    /// The reflectance of a dielectric at normal incidence, which is subtracted: 0.04.
    pub const F0: f64 = 0.04;
    /// The smallest channel from which on all of it is subtracted; below, the toe is a parabola.
    pub const TOE: f64 = 2.0 * F0;
    /// The largest channel from which on light is compressed, after the subtraction.
    pub const START: f64 = 0.8 - F0;
    /// How fast compressed colours turn white.
    pub const DESATURATION: f64 = 0.15;
}

/// What PBR Neutral subtracts of every channel, by the smallest one: 0 to 0.04.
pub(super) fn neutral_offset(least: f64) -> f64 {
    use neutral::*;
    if least < TOE { least - least * least / (4.0 * F0) } else { F0 }
}

impl ToneMapping {
    /// Light as the display shows it, linear Rec. 709, 0 to 1 for [`Neutral`](Self::Neutral). What is below 0 and NaN
    /// count as 0, what is infinite as the largest number.
    ///
    /// Source: Khronos PBR Neutral Tone Mapper, specification of May 2024, `pbrNeutral.glsl`.
    pub fn apply(self, color: [f64; 3]) -> [f64; 3] {
        use neutral::*;
        if self == ToneMapping::None {
            return color;
        }
        // `max` takes 0 in place of NaN
        let color = color.map(|channel| channel.max(0.0).min(f64::from(f32::MAX)));
        let offset = neutral_offset(color[0].min(color[1]).min(color[2]));
        let color = color.map(|channel| channel - offset);
        let peak = color[0].max(color[1]).max(color[2]);
        if peak < START {
            return color;
        }
        // Compress the largest channel, keep the ratios, and mix with white
        let room = 1.0 - START;
        let compressed = 1.0 - room * room / (peak + room - START);
        let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
        color.map(|channel| {
            let kept = channel * (compressed / peak);
            kept * (1.0 - white) + compressed * white
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shader of the specification, line by line.
    fn shader(color: [f64; 3]) -> [f64; 3] {
        let start_compression = 0.8 - 0.04;
        let desaturation = 0.15;
        let [r, g, b] = color;
        let x = r.min(g.min(b));
        let offset = if x < 0.08 { x - 6.25 * x * x } else { 0.04 };
        let [r, g, b] = [r - offset, g - offset, b - offset];
        let peak = r.max(g.max(b));
        if peak < start_compression {
            return [r, g, b];
        }
        let d = 1.0 - start_compression;
        let new_peak = 1.0 - d * d / (peak + d - start_compression);
        let [r, g, b] = [r, g, b].map(|c| c * (new_peak / peak));
        let share = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0);
        [r, g, b].map(|c| c * (1.0 - share) + new_peak * share)
    }

    /// Colours of all brightnesses and saturations, without chance.
    fn colors() -> impl Iterator<Item = [f64; 3]> {
        let channel = |i: u32| f64::from(i * i * i) / 300.0;
        (0..15_u32.pow(3)).map(move |i| [i % 15, i / 15 % 15, i / 225].map(channel))
    }

    #[test]
    fn is_the_shader_of_the_specification() {
        for color in colors() {
            let (ours, theirs) = (ToneMapping::Neutral.apply(color), shader(color));
            for (a, b) in ours.into_iter().zip(theirs) {
                assert!((a - b).abs() < 1e-15 && (0.0..=1.0).contains(&a), "{color:?} {ours:?} {theirs:?}");
            }
            assert_eq!(ToneMapping::None.apply(color), color);
        }
        // By hand: the toe, the middle, the start of the compression, far beyond it
        let gray = |x: f64| ToneMapping::Neutral.apply([x; 3])[0];
        assert!((gray(0.04) - 0.01).abs() < 1e-15);
        assert!((gray(0.5) - 0.46).abs() < 1e-15);
        assert!((gray(0.8) - 0.76).abs() < 1e-12);
        assert!((gray(1.0) - (1.0 - 0.0576 / 0.44)).abs() < 1e-12);
        assert!(gray(1e6) > 0.999_999 && gray(1e6) < 1.0);
    }

    #[test]
    fn more_light_is_never_darker() {
        for color in colors() {
            let mut before = [0.0; 3];
            for step in 0..200 {
                let brighter = color.map(|channel| channel * (0.01 * f64::from(step * step)));
                let now = ToneMapping::Neutral.apply(brighter);
                assert!(now.iter().zip(before).all(|(now, before)| *now >= before - 1e-15), "{brighter:?}");
                before = now;
            }
        }
    }

    #[test]
    fn joins_without_a_step() {
        let apart = |a: f64, b: f64| (ToneMapping::Neutral.apply([a, 0.5 * a, b])[0], a, b);
        for (low, high) in [(0.8 - 1e-9, 0.8 + 1e-9), (0.08 - 1e-9, 0.08 + 1e-9)] {
            assert!((apart(low, low).0 - apart(high, high).0).abs() < 1e-8);
        }
    }

    #[test]
    fn odd_numbers_have_a_meaning() {
        let neutral = ToneMapping::Neutral;
        assert_eq!(neutral.apply([f64::NAN, -1.0, f64::NEG_INFINITY]), [0.0; 3]);
        for bright in [f64::INFINITY, 1e308] {
            let color = neutral.apply([bright, 0.0, bright]);
            assert!(color.iter().all(|channel| (0.999..=1.0).contains(channel)), "{color:?}");
        }
    }
}
