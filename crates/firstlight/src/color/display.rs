//! Display encodings: how linear light becomes the numbers of an 8- or 16-bit picture, and back.
//!
//! The functions here are the definition, in f64; [`super::Quantizer`] does the same for many pixels at once.

use super::ToneMapping;

/// The curve from light that a display shows to the numbers of an 8- or 16-bit picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    /// The sRGB curve.
    Srgb,
    /// The power 1 / gamma; the gamma is finite and greater than 0.
    Gamma(f64),
    /// As it is.
    Linear,
}

impl Encoding {
    /// The encoded value, 0 to 1, of a linear one. What is below 0 and NaN become 0, what is above 1 becomes 1.
    ///
    /// Source: IEC 61966-2-1:1999, section 5.2 (sRGB).
    pub fn encode(self, linear: f64) -> f64 {
        if linear.is_nan() || linear <= 0.0 {
            return 0.0;
        }
        if linear >= 1.0 {
            return 1.0;
        }
        match self {
            Encoding::Srgb if linear <= 0.0031308 => 12.92 * linear,
            Encoding::Srgb => 1.055 * pxfm::f_pow(linear, 1.0 / 2.4) - 0.055,
            Encoding::Gamma(gamma) => pxfm::f_pow(linear, 1.0 / gamma),
            Encoding::Linear => linear,
        }
    }

    /// The linear value, 0 to 1, of an encoded one. What is below 0 and NaN become 0, what is above 1 becomes 1.
    ///
    /// Source: IEC 61966-2-1:1999, section 5.2 (sRGB).
    pub fn decode(self, encoded: f64) -> f64 {
        if encoded.is_nan() || encoded <= 0.0 {
            return 0.0;
        }
        if encoded >= 1.0 {
            return 1.0;
        }
        match self {
            Encoding::Srgb if encoded <= 0.04045 => encoded / 12.92,
            Encoding::Srgb => pxfm::f_pow((encoded + 0.055) / 1.055, 2.4),
            Encoding::Gamma(gamma) => pxfm::f_pow(encoded, gamma),
            Encoding::Linear => encoded,
        }
    }
}

/// What is done to linear light before it is stored in an 8- or 16-bit picture. Other files hold the film as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// The curve.
    pub encoding: Encoding,
    /// In stops, -64 to 64: light is multiplied by 2^exposure first.
    pub exposure: f64,
    /// What is done between exposure and curve; anything but none goes with the sRGB curve only.
    pub tone_mapping: ToneMapping,
}

impl Default for Display {
    /// sRGB, exposure 0, no tone mapping.
    fn default() -> Self {
        Self { encoding: Encoding::Srgb, exposure: 0.0, tone_mapping: ToneMapping::None }
    }
}

impl Display {
    /// The encoded value, 0 to 1, of a linear one; of gray light where a tone mapping joins the channels.
    pub fn encode(&self, linear: f32) -> f64 {
        match self.tone_mapping {
            ToneMapping::None => self.encoding.encode(f64::from(linear) * self.factor()),
            ToneMapping::Neutral => self.encode_color([linear; 3])[0],
        }
    }

    /// The encoded values, 0 to 1, of a linear colour.
    pub fn encode_color(&self, linear: [f32; 3]) -> [f64; 3] {
        match self.tone_mapping {
            ToneMapping::None => linear.map(|channel| self.encode(channel)),
            ToneMapping::Neutral => self.shown(linear).map(|channel| self.encoding.encode(channel.into())),
        }
    }

    /// The light that is shown of a colour: after exposure and tone mapping, before the curve; linear Rec. 709.
    pub fn shown(&self, linear: [f32; 3]) -> [f32; 3] {
        let factor = self.factor();
        self.tone_mapping.apply(linear.map(|channel| f64::from(channel) * factor)).map(|channel| channel as f32)
    }

    /// What [`shown`](Self::shown) leaves to be done: the curve alone.
    pub(super) fn curve(&self) -> Display {
        Display { encoding: self.encoding, ..Display::default() }
    }

    /// 2^exposure; exact for whole stops.
    pub fn factor(&self) -> f64 {
        let stops = self.exposure;
        if stops == stops.trunc() && stops.abs() <= 1000.0 {
            f64::from_bits(((1023 + stops as i64) as u64) << 52)
        } else {
            pxfm::f_exp2(stops)
        }
    }

    /// What is wrong with the numbers, with what is allowed; None if nothing is.
    pub(crate) fn fault(&self) -> Option<String> {
        match self.encoding {
            Encoding::Gamma(gamma) if !(gamma > 0.0 && gamma.is_finite()) => {
                return Some(format!("gamma {gamma} is not a finite number greater than 0"));
            }
            Encoding::Gamma(_) | Encoding::Linear if self.tone_mapping == ToneMapping::Neutral => {
                return Some("the tone mapping neutral goes with the sRGB curve only".into());
            }
            _ => {}
        }
        // `contains` is false for NaN
        let allowed = (-64.0..=64.0).contains(&self.exposure);
        (!allowed).then(|| format!("exposure {} is outside [-64, 64] stops", self.exposure))
    }
}

/// `srgb, exposure 0`, `gamma 2.2, exposure -1`, `neutral, exposure 0`
impl std::fmt::Display for Display {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.encoding {
            _ if self.tone_mapping == ToneMapping::Neutral => f.write_str("neutral")?,
            Encoding::Srgb => f.write_str("srgb")?,
            Encoding::Gamma(gamma) => write!(f, "gamma {gamma}")?,
            Encoding::Linear => f.write_str("linear")?,
        }
        write!(f, ", exposure {}", self.exposure)
    }
}

impl std::str::FromStr for Display {
    type Err = String;

    /// As it is written; the error says what is.
    fn from_str(text: &str) -> Result<Self, String> {
        let read = || {
            let (encoding, exposure) = text.split_once(", exposure ")?;
            let tone_mapping = if encoding == "neutral" { ToneMapping::Neutral } else { ToneMapping::None };
            let encoding = match (encoding, encoding.strip_prefix("gamma ")) {
                ("srgb" | "neutral", _) => Encoding::Srgb,
                ("linear", _) => Encoding::Linear,
                (_, Some(gamma)) => Encoding::Gamma(gamma.parse().ok()?),
                _ => return None,
            };
            let display = Display { encoding, exposure: exposure.parse().ok()?, tone_mapping };
            display.fault().is_none().then_some(display)
        };
        read().ok_or_else(|| format!("{text:?} is no display encoding; one is \"srgb, exposure 0\""))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        for encoding in [Encoding::Srgb, Encoding::Linear, Encoding::Gamma(2.2)] {
            for exposure in [0.0, -1.5, 0.1] {
                let display = Display { encoding, exposure, ..Display::default() };
                assert_eq!(display.to_string().parse(), Ok(display));
            }
        }
        let display = Display { exposure: 0.5, tone_mapping: ToneMapping::Neutral, ..Display::default() };
        assert_eq!(display.to_string(), "neutral, exposure 0.5");
        assert_eq!(display.to_string().parse(), Ok(display));
        for bad in ["", "srgb", "srgb, exposure x", "gamma 0, exposure 0", "rec2020, exposure 0", "srgb, exposure 65"] {
            assert!(bad.parse::<Display>().is_err(), "{bad}");
        }
    }

    #[test]
    fn srgb_known_values() {
        // IEC 61966-2-1: middle values known from its tables and from the ends of its two pieces
        let srgb = Encoding::Srgb;
        assert_eq!(srgb.encode(0.0), 0.0);
        assert_eq!(srgb.encode(1.0), 1.0);
        assert_eq!((srgb.encode(0.5) * 255.0).round(), 188.0);
        assert_eq!((srgb.encode(0.18) * 255.0).round(), 118.0);
        assert!((srgb.decode(0.5) - 0.214_041_14).abs() < 1e-8);
        assert!((srgb.encode(0.0031308) - 0.04045).abs() < 1e-7);
    }

    #[test]
    fn decode_undoes_encode() {
        for encoding in [Encoding::Srgb, Encoding::Gamma(2.2), Encoding::Gamma(0.7), Encoding::Linear] {
            for i in 0..=1000 {
                let x = f64::from(i) / 1000.0;
                // At its join the sRGB curve is off by 3e-8
                assert!((encoding.decode(encoding.encode(x)) - x).abs() < 1e-8, "{encoding:?} {x}");
            }
        }
    }

    #[test]
    fn odd_numbers_have_a_meaning() {
        for encoding in [Encoding::Srgb, Encoding::Gamma(2.2), Encoding::Linear] {
            for (x, y) in [(f64::NAN, 0.0), (-1.0, 0.0), (f64::NEG_INFINITY, 0.0), (f64::INFINITY, 1.0), (7.0, 1.0)] {
                assert_eq!(encoding.encode(x), y);
                assert_eq!(encoding.decode(x), y);
            }
        }
    }

    #[test]
    fn whole_stops_are_exact() {
        let at = |exposure| Display { encoding: Encoding::Linear, exposure, ..Display::default() };
        assert_eq!(at(0.0).factor(), 1.0);
        assert_eq!(at(-3.0).factor(), 0.125);
        assert_eq!(at(64.0).factor(), 18_446_744_073_709_551_616.0);
        assert!((at(0.5).factor() - std::f64::consts::SQRT_2).abs() < 1e-15);
        assert_eq!(at(-1.0).encode(0.5), 0.25);
    }

    #[test]
    fn faults_name_the_value() {
        let fault = |encoding, exposure| Display { encoding, exposure, ..Display::default() }.fault();
        assert_eq!(fault(Encoding::Srgb, 64.0), None);
        assert_eq!(fault(Encoding::Srgb, f64::NAN).unwrap(), "exposure NaN is outside [-64, 64] stops");
        assert_eq!(fault(Encoding::Srgb, -65.0).unwrap(), "exposure -65 is outside [-64, 64] stops");
        assert_eq!(fault(Encoding::Gamma(0.0), 0.0).unwrap(), "gamma 0 is not a finite number greater than 0");
        assert!(fault(Encoding::Gamma(f64::INFINITY), 0.0).is_some());
        let neutral = |encoding| Display { encoding, tone_mapping: ToneMapping::Neutral, ..Display::default() };
        assert_eq!(neutral(Encoding::Srgb).fault(), None);
        assert!(neutral(Encoding::Gamma(2.2)).fault().unwrap().contains("sRGB curve only"));
    }

    #[test]
    fn neutral_is_mapped_then_encoded() {
        let display = Display { exposure: 1.0, tone_mapping: ToneMapping::Neutral, ..Display::default() };
        for color in [[0.3, 0.2, 0.1_f32], [0.02, 0.01, 0.0], [4.0, 0.3, 0.2], [0.7, 0.7, 0.7]] {
            let shown = ToneMapping::Neutral.apply(color.map(|c| 2.0 * f64::from(c)));
            for (a, b) in display.encode_color(color).into_iter().zip(shown) {
                assert!((a - Encoding::Srgb.encode(b)).abs() < 1e-6, "{color:?}");
            }
        }
        assert_eq!(display.encode(0.3), display.encode_color([0.3; 3])[1]);
        let plain = Display { exposure: 1.0, ..Display::default() };
        assert_eq!(plain.encode_color([0.1, 0.2, 0.3]), [0.1, 0.2, 0.3].map(|c| plain.encode(c)));
        assert_eq!(plain.shown([0.1, 0.2, 3.0]), [0.2, 0.4, 6.0]);
    }
}
