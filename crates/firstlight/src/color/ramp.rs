//! False colours: from nothing to much.

use super::{Encoding, Rgb};

/// From nothing to much, as sRGB-encoded red, green, blue.
const RAMP: [[f32; 3]; 6] =
    [[0.0, 0.0, 0.02], [0.16, 0.1, 0.4], [0.5, 0.12, 0.5], [0.85, 0.25, 0.3], [0.99, 0.62, 0.15], [1.0, 1.0, 0.8]];

/// The colour of 0 (nothing, black) to 1 (much, pale yellow), linear Rec. 709; what is outside is held to that.
pub(crate) fn false_color(part: f32) -> Rgb {
    let at = part.clamp(0.0, 1.0) * (RAMP.len() - 1) as f32;
    let place = (at as usize).min(RAMP.len() - 2);
    let part = at - place as f32;
    let channel = |k: usize| {
        let encoded = RAMP[place][k] * (1.0 - part) + RAMP[place + 1][k] * part;
        Encoding::Srgb.decode(f64::from(encoded)) as f32
    };
    Rgb::new(channel(0), channel(1), channel(2))
}
