//! A picture that is nearly black because its lights were left as weak as they come.

use firstlight::{Diagnostic, Display, Falloff, Film, LightDesc, Plane, PlaneNumbers, SceneDesc, Severity};

/// A picture whose brightest number is below this, of 255, is nearly black.
const DARK: f64 = 32.0;
/// What the brightest pixel would be with the strength that is proposed: linear, 1 is white.
const BRIGHT: f64 = 0.8;

/// What to say of a picture that is nearly black under lights of strength 1: that of the brightest pixel, what such a
/// strength means, what to try. `None` for all others.
pub(super) fn advice(name: &str, desc: &SceneDesc, film: &Film, display: &Display) -> Option<Diagnostic> {
    let Some(PlaneNumbers::Floats(color)) = film.numbers(Plane::Color) else { return None };
    let most = color.as_chunks::<4>().0.iter().flat_map(|[rgb @ .., _]| rgb).copied().fold(0.0, f32::max);
    let brightest = display.encode(most) * 255.0;
    // Black all over has another reason than the strength of lights
    if most == 0.0 || brightest >= DARK {
        return None;
    }
    let left: Vec<(String, &LightDesc)> = named(desc).filter(|(_, light)| is_left(light)).collect();
    let (path, light) = left.first()?;
    let others = match left.len() {
        1 => String::new(),
        2 => " (as one more is)".to_owned(),
        many => format!(" (as {} more are)", many - 1),
    };
    let meaning = match light {
        LightDesc::Point(_) | LightDesc::Spot(_) => {
            "one candela, of which a white surface shows 1 / (pi d^2) at a distance of d metres"
        }
        LightDesc::Directional(_) => "one lux, of which a white surface that faces it shows 1 / pi",
        LightDesc::Rectangle(_) | LightDesc::Disk(_) | LightDesc::Sphere(_) => {
            "a radiance of 1: the light itself looks white, and a surface gets less the smaller and the farther it is"
        }
    };
    let factor = two_digits(BRIGHT / (f64::from(most) * display.factor()));
    // In tenths of a stop
    let stops = (0..=640).map(|tenths| f64::from(tenths) / 10.0);
    let stops = stops.map(|stops| Display { exposure: stops, ..*display }).find(|more| more.factor() >= factor);
    let exposure = stops.map(|more| more.exposure + display.exposure).filter(|stops| *stops <= 64.0);
    let message = format!(
        "{name}: the picture is nearly black, its brightest pixel is {brightest:.0} of 255: {path} was left at \
         strength 1{others}, {meaning}"
    );
    let hint = match exposure {
        Some(stops) => format!("try strength = {factor}, or --exposure {stops:.1} for the same in this picture"),
        None => format!("try strength = {factor}"),
    };
    Some(Diagnostic { severity: Severity::Advice, place: None, path: String::new(), message, hint: Some(hint) })
}

/// The lights of a scene, each with its path, as `light.point[0]`.
fn named(desc: &SceneDesc) -> impl Iterator<Item = (String, &LightDesc)> {
    LightDesc::KINDS.iter().flat_map(|kind| {
        let of_kind = desc.lights.iter().filter(move |light| light.kind() == *kind);
        of_kind.enumerate().map(move |(number, light)| (format!("light.{kind}[{number}]"), light))
    })
}

/// Whether a light has the strength that it has where none is said, in a unit in which that is little.
fn is_left(light: &LightDesc) -> bool {
    light.strength() == (1.0, Falloff::Physical)
}

/// A number of 1 or more, to two digits.
fn two_digits(number: f64) -> f64 {
    if number < 9.95 {
        return (number * 10.0).round() / 10.0;
    }
    let mut unit = 1.0;
    while number / unit >= 99.5 {
        unit *= 10.0;
    }
    (number / unit).round() * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strengths_are_proposed_to_two_digits() {
        for (number, expected) in [(12.34, 12.0), (99.9, 100.0), (1234.0, 1200.0), (8.69, 8.7), (56789.0, 57000.0)] {
            assert_eq!(two_digits(number), expected, "{number}");
        }
    }
}
