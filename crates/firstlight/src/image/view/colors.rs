//! False colours.

use super::{Rgb8, unit_code};

/// Viridis at eighths, sRGB: as bright as the number is large, to every kind of eye.
///
/// Source: S. van der Walt, N. Smith, "A better default colormap for Matplotlib", 2015.
const VIRIDIS: [Rgb8; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2d, 0x7b],
    [0x3b, 0x52, 0x8b],
    [0x2c, 0x72, 0x8e],
    [0x21, 0x91, 0x8c],
    [0x28, 0xae, 0x80],
    [0x5e, 0xc9, 0x62],
    [0xad, 0xdc, 0x30],
    [0xfd, 0xe7, 0x25],
];

/// The colour of a place in a colour map, from 0, dark, to 1, bright.
pub(super) fn map(place: f64) -> Rgb8 {
    let at = place.clamp(0.0, 1.0) * 8.0;
    let below = (at as usize).min(7);
    let part = at - below as f64;
    let mix = |c: usize| f64::from(VIRIDIS[below][c]) * (1.0 - part) + f64::from(VIRIDIS[below + 1][c]) * part;
    [0, 1, 2].map(|c| mix(c).round() as u8)
}

/// The colour of an id: nothing is black. Hues that follow each other are the golden ratio of the circle apart, which
/// leaves no two of few alike; brightness and saturation take turns.
pub(super) fn of_id(id: u32) -> Rgb8 {
    if id == 0 {
        return [0; 3];
    }
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let hue = (f64::from(id) * GOLDEN).fract() * 6.0;
    let (saturation, value) = [(0.62, 0.98), (0.85, 0.78), (0.42, 0.90)][id as usize % 3];
    // Red, green and blue are highest a third of the circle from each other
    let channel = |shift: f64| {
        let k = (hue + shift) % 6.0;
        value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0)
    };
    [5.0, 3.0, 1.0].map(|shift| unit_code(channel(shift)))
}

/// How many colours there are from red to yellow to green to cyan to blue to magenta to red.
const ARCS: [usize; 6] = [15, 6, 4, 11, 13, 6];
const WHEEL: usize = 55;

/// A colour of the wheel.
fn wheel(mut k: usize) -> [f64; 3] {
    for (arc, length) in ARCS.into_iter().enumerate() {
        if k >= length {
            k -= length;
            continue;
        }
        let part = (255.0 * k as f64 / length as f64).floor() / 255.0;
        return match arc {
            0 => [1.0, part, 0.0],
            1 => [1.0 - part, 1.0, 0.0],
            2 => [0.0, 1.0, part],
            3 => [0.0, 1.0 - part, 1.0],
            4 => [part, 0.0, 1.0],
            _ => [1.0, 0.0, 1.0 - part],
        };
    }
    [1.0, 0.0, 0.0]
}

/// The colour of a way in a picture, x to the right and y down, in lengths of the wheel's radius: white is no way, the
/// hue is its direction, and what is longer than the radius is darker.
///
/// Source: S. Baker et al., "A database and evaluation methodology for optical flow", IJCV 2011; `colorcode.cpp` there.
pub(super) fn flow(x: f64, y: f64) -> Rgb8 {
    let radius = (x * x + y * y).sqrt();
    let angle = pxfm::f_atan2(-y, -x) / std::f64::consts::PI;
    let at = (angle + 1.0) / 2.0 * (WHEEL - 1) as f64;
    let below = at as usize % WHEEL;
    let part = at - at.floor();
    let (a, b) = (wheel(below), wheel((below + 1) % WHEEL));
    [0, 1, 2].map(|c| {
        let hue = (1.0 - part) * a[c] + part * b[c];
        let color = if radius <= 1.0 { 1.0 - radius * (1.0 - hue) } else { hue * 0.75 };
        (255.0 * color) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_goes_from_end_to_end() {
        assert_eq!([map(0.0), map(1.0), map(0.5)], [VIRIDIS[0], VIRIDIS[8], VIRIDIS[4]]);
        assert_eq!([map(-1.0), map(2.0)], [map(0.0), map(1.0)]);
    }

    #[test]
    fn ids_are_told_apart() {
        let colors: Vec<Rgb8> = (0..64).map(of_id).collect();
        for (i, a) in colors.iter().enumerate() {
            for b in &colors[..i] {
                let off: u32 = a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
                assert!(off >= 12, "{a:?} {b:?}");
            }
        }
        of_id(u32::MAX);
    }

    /// As `colorcode.cpp` makes them.
    #[test]
    fn ways_are_on_the_wheel() {
        assert_eq!(flow(0.0, 0.0), [255; 3]);
        // To the right red, down yellow, to the left cyan to blue, up violet
        assert_eq!(flow(1.0, 0.0), [255, 0, 0]);
        let [r, g, b] = flow(0.0, 1.0);
        assert!(r > 200 && g > 200 && b < 10, "{r} {g} {b}");
        let [r, g, b] = flow(-1.0, 0.0);
        assert!(r < 10 && g > 100 && b > 200, "{r} {g} {b}");
        let [r, g, b] = flow(0.0, -1.0);
        assert!(r > 60 && g < 10 && b > 200, "{r} {g} {b}");
        assert_eq!(flow(2.0, 0.0), [191, 0, 0]);
    }
}
