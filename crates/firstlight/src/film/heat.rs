//! The work of a render, pixel by pixel.

use crate::color::{Rgb, false_color};
use crate::image::{Image, Window};

/// How much work each pixel of a render took.
///
/// The unit is one ray, from the camera or to a light. A point at which a light is integrated counts as
/// [`PLACE`](Self::PLACE); where many pixels share such points, each has its share. The same for every thread count,
/// tile size and machine: it is counted, not timed.
#[derive(Clone, Debug, PartialEq)]
pub struct Heat {
    /// The width and height of the whole film.
    pub film: [u32; 2],
    /// The part of it that `work` holds.
    pub window: Window,
    /// The window's rows from the top, each from the left; 0 or more.
    pub work: Vec<f32>,
}

impl Heat {
    /// The work of integrating a light at one point, in rays.
    pub const PLACE: f32 = 16.0;
    /// Where the ramp of colours begins and ends, as powers of two.
    pub const SCALE: [i32; 2] = [-2, 16];

    /// As a picture in false colours: black for 1/4 and less, then violet, red and orange, pale yellow for 65536 and
    /// more; each doubling is a step of the same length. Linear Rec. 709, for a display of sRGB.
    pub fn picture(&self) -> Image {
        let pixels = self.work.iter().map(|work| {
            let Rgb { r, g, b } = color(*work);
            [r, g, b, 1.0]
        });
        Image { film: self.film, window: self.window, pixels: pixels.collect() }
    }

    /// The mean over all pixels, and the most that one took.
    pub fn mean_and_most(&self) -> (f64, f32) {
        let sum: f64 = self.work.iter().copied().map(f64::from).sum();
        (sum / self.work.len().max(1) as f64, self.work.iter().copied().fold(0.0, f32::max))
    }
}

fn color(work: f32) -> Rgb {
    let [first, last] = Heat::SCALE.map(|power| power as f32);
    false_color(if work > 0.0 { (pxfm::f_log2f(work) - first) / (last - first) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_work_is_brighter() {
        let luminance = |work: f32| {
            let Rgb { r, g, b } = color(work);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let mut before = luminance(0.0);
        assert!(before < 0.01);
        let mut work = 0.5;
        while work <= 65536.0 {
            let now = luminance(work);
            assert!(now > before, "{work}: {now} after {before}");
            (before, work) = (now, 2.0 * work);
        }
        assert_eq!(luminance(1e9), luminance(65536.0));
        assert!(luminance(1e9) > 0.9);
    }
}
