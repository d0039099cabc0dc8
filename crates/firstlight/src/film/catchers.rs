//! The shadows on shadow catchers, from the light that arrives there with and without shadows.
//!
//! ```text
//! unshadowed   catchers white, all else black, nothing casts shadows: E0, and the share of each pixel that they cover
//! shadowed     the same with shadows, where catchers are seen: E                   alpha = 1 - E / E0
//! black        catchers black, all else as it is, where a catcher in shadow covers a part of the pixel
//! picture      the scene without its catchers                                      picture + alpha (black - picture)
//! ```
//!
//! E and E0 are means over the part of a pixel that catchers cover, so alpha is one number for each pixel. Where it is
//! 0, the picture is what it is without catchers, to the bit.

use std::ops::ControlFlow;

use super::Film;
use super::tile::Tile;
use crate::image::{Buffer, Plane, PlaneVec, Window};
use crate::scene::{Catchers, Scene};

/// Pixels of a window of the film.
#[derive(Debug)]
pub(crate) struct ChosenPixels {
    window: Window,
    chosen: Vec<bool>,
    /// Cell by cell of the window: the stops by which light is raised where it is judged.
    stops: Vec<i32>,
}

/// What shadow catchers do to a picture.
pub(crate) struct Shadows {
    window: Window,
    /// Pixel by pixel: the part that catchers cover, and their mean alpha there.
    shares: Vec<f32>,
    alphas: Vec<f32>,
    /// What it took to find them; nothing if that is not asked for.
    work: Vec<f32>,
}

/// What arrives of all lights, of which catchers reflect all; and their alpha and the part of a pixel that they cover.
const LIGHT: Buffer = Buffer::Plane(Plane::Diffuse);
const COVER: Buffer = Buffer::Plane(Plane::Ambient);
const WORK: Buffer = Buffer::Plane(Plane::Rays);
/// The most passes that they take beside that of the picture.
pub(crate) const PASSES: u64 = 3;
/// In display steps for a tolerance of 1: alphas up to this are within the errors of integrated light, and count as
/// none; up to twice as much they are taken down, so that nothing jumps.
const UNSURE: f32 = 0.5;

/// Whether catchers change a buffer: it is the colour, or a part of it.
fn is_changed(buffer: Buffer) -> bool {
    buffer.is_of_terms() || matches!(buffer.plane(), Plane::Color | Plane::Alpha) && buffer == buffer.plane().into()
}

/// Whether catchers change any buffer.
pub(crate) fn change_any(buffers: &[Buffer]) -> bool {
    buffers.iter().any(|buffer| is_changed(*buffer))
}

/// Those buffers that catchers change.
pub(crate) fn changed(buffers: &[Buffer]) -> Vec<Buffer> {
    buffers.iter().copied().filter(|buffer| is_changed(*buffer)).collect()
}

/// A window of whole cells of `side` pixels around another one, as far as the film has them: so what is found in a cell
/// does not depend on the window.
pub(crate) fn whole_cells(scene: &Scene, Window { x, y, width, height }: Window, side: u32) -> Window {
    let span = |from: u32, length: u32, all: u32| {
        let first = from / side * side;
        [first, (from + length).next_multiple_of(side).min(all) - first]
    };
    let ([x, width], [y, height]) = (span(x, width, scene.width), span(y, height, scene.height));
    Window { x, y, width, height }
}

/// The number of a pixel of the film in a window.
fn index(window: Window, [i, j]: [u32; 2]) -> usize {
    (j - window.y) as usize * window.width as usize + (i - window.x) as usize
}

/// The values of a plane, which the pass filled.
fn floats(film: &Film, of: Buffer) -> &[f32] {
    film.floats(of).expect("the pass has it")
}

impl ChosenPixels {
    /// Whether a pixel of the film is among them.
    pub fn has(&self, at: [u32; 2]) -> bool {
        self.window.contains(at) && self.chosen[index(self.window, at)]
    }

    /// Whether any of some pixels is.
    pub fn has_any(&self, mut of: impl Iterator<Item = [u32; 2]>) -> bool {
        of.any(|at| self.has(at))
    }

    /// The stops by which light is raised in the cell of `side` pixels with such a first pixel, if it is.
    pub fn stop(&self, [x, y]: [u32; 2], side: u32) -> Option<i32> {
        let across = self.window.width.div_ceil(side);
        let cell = (y - self.window.y) / side * across + (x - self.window.x) / side;
        self.stops.get(cell as usize).copied()
    }
}

impl Shadows {
    /// Finds them for a window of whole cells of `side` pixels. `pass` renders buffers of a scene there, all of it or
    /// some pixels. `is_integrated`: whether light is, and alphas within its errors count as none. `heat`: whether the
    /// work is asked for.
    pub fn find(
        scene: &Scene,
        catchers: &Catchers,
        (window, side): (Window, u32),
        [is_integrated, heat]: [bool; 2],
        mut pass: impl FnMut(&Scene, &[Buffer], Option<ChosenPixels>) -> ControlFlow<(), Film>,
    ) -> ControlFlow<(), Shadows> {
        // What would arrive, and what of each pixel catchers cover
        let planes = |mut planes: Vec<Buffer>| {
            planes.extend(heat.then_some(WORK));
            planes
        };
        let unshadowed = pass(&scene.with_unshadowed_catchers(catchers), &planes(vec![LIGHT, COVER]), None)?;
        let of = |plane: &[f32], channel: usize| plane.iter().skip(channel).step_by(3).copied().collect::<Vec<f32>>();
        let cover = floats(&unshadowed, COVER);
        let (most, shares) = (of(cover, 0), of(cover, 1));
        let all = of(floats(&unshadowed, LIGHT), 0);
        // What arrives, where it is not all the same
        let chosen: Vec<bool> = shares.iter().zip(&all).map(|(share, all)| *share > 0.0 && *all > 0.0).collect();
        let stops = stops(window, side, &all, &shares).map(|stop| stop + scene.stops_behind_catchers()).collect();
        let shadowed = ChosenPixels { window, chosen: chosen.clone(), stops };
        let shadowed = pass(&scene.with_lit_catchers(catchers), &planes(vec![LIGHT]), Some(shadowed))?;
        let arrives = of(floats(&shadowed, LIGHT), 0);
        let unsure = UNSURE * scene.tolerance as f32 / (255.0 * scene.slope_behind_catchers());
        let unsure = if is_integrated { unsure } else { 0.0 };
        let alpha = |pixel: usize| {
            if !chosen[pixel] {
                return 0.0;
            }
            let hidden = (1.0 - arrives[pixel] / all[pixel]).clamp(0.0, 1.0);
            let hidden = if hidden < 2.0 * unsure { (2.0 * (hidden - unsure)).max(0.0) } else { hidden };
            hidden * (most[pixel] / shares[pixel])
        };
        let alphas = (0..chosen.len()).map(alpha).collect();
        let mut work = unshadowed.floats(WORK).map(<[f32]>::to_vec).unwrap_or_default();
        add_work(&mut work, &shadowed, &chosen);
        ControlFlow::Continue(Shadows { window, shares, alphas, work })
    }

    fn is_mixed(&self, pixel: usize) -> bool {
        self.alphas[pixel] > 0.0 && self.shares[pixel] < 1.0
    }

    /// The pixels that catchers in shadow cover in part; `None` if there are none.
    pub fn mixed(&self) -> Option<ChosenPixels> {
        let chosen: Vec<bool> = (0..self.alphas.len()).map(|k| self.is_mixed(k)).collect();
        chosen.contains(&true).then(|| ChosenPixels { window: self.window, chosen, stops: Vec::new() })
    }

    /// Lays them over a picture. `black` is the picture with black catchers in the [mixed](Self::mixed) pixels.
    pub fn cover(mut self, picture: &mut Film, black: Option<&Film>) {
        if let Some(black) = black {
            let chosen: Vec<bool> = (0..self.alphas.len()).map(|k| self.is_mixed(k)).collect();
            add_work(&mut self.work, black, &chosen);
        }
        let Window { width, .. } = picture.window;
        let pixels: Vec<([u32; 2], usize)> = picture
            .window
            .pixels()
            .map(|at| (at, index(self.window, at)))
            .filter(|(_, k)| self.alphas[*k] > 0.0)
            .collect();
        let [x, y] = [picture.window.x, picture.window.y];
        for (_, buffer, numbers) in &mut picture.planes {
            let PlaneVec::Floats(numbers) = numbers else { continue };
            if *buffer == WORK {
                let all = picture.window.pixels().map(|at| index(self.window, at));
                numbers.iter_mut().zip(all).for_each(|(sum, k)| *sum += self.work[k]);
            }
            if !is_changed(*buffer) {
                continue;
            }
            let channels = buffer.plane().channels().len();
            // A black surface that fills a pixel has its alpha, and no light
            let alpha_at = match buffer.plane() {
                Plane::Color => 3,
                Plane::Alpha => 0,
                _ => usize::MAX,
            };
            let black = black.map(|black| floats(black, *buffer));
            for ([i, j], k) in &pixels {
                let at = ((j - y) * width + i - x) as usize * channels;
                for (channel, number) in numbers[at..][..channels].iter_mut().enumerate() {
                    let black = match black {
                        Some(black) if self.is_mixed(*k) => black[k * channels + channel],
                        _ if channel == alpha_at => 1.0,
                        _ => 0.0,
                    };
                    *number = (*number + self.alphas[*k] * (black - *number)).max(0.0);
                }
            }
        }
    }
}

/// Adds the work of a pass to that of all, in the pixels that it had.
fn add_work(all: &mut [f32], of: &Film, chosen: &[bool]) {
    let work = of.floats(WORK).unwrap_or_default();
    all.iter_mut().zip(work).zip(chosen).filter(|(_, is)| **is).for_each(|((sum, work), _)| *sum += work);
}

/// Cell by cell: the stops that raise the light on catchers to between 1/2 and 1, the median of the cell.
fn stops(window: Window, side: u32, all: &[f32], shares: &[f32]) -> impl Iterator<Item = i32> {
    let of_cell = move |cell: Tile| {
        let pixels = cell.pixels().map(|at| index(window, at)).filter(|k| shares[*k] > 0.0 && all[*k] > 0.0);
        let mut lights: Vec<f32> = pixels.map(|k| all[k] / shares[k]).collect();
        if lights.is_empty() {
            return 0;
        }
        let middle = lights.len() / 2;
        let (_, light, _) = lights.select_nth_unstable_by(middle, f32::total_cmp);
        // One less than the exponent, turned round
        126 - (light.to_bits() >> 23) as i32
    };
    window.parts(side, side).map(of_cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_raised_to_between_a_half_and_one() {
        let window = Window { x: 8, y: 0, width: 12, height: 8 };
        let light = |k: usize| if k % 12 < 8 { 0.011 } else { 900.0 };
        // Half covered pixels have half of the light; one is not covered
        let share = |k: usize| if k == 0 { 0.0 } else { 0.5 };
        let shares: Vec<f32> = (0..96).map(share).collect();
        let all: Vec<f32> = (0..96).map(|k| light(k) * share(k)).collect();
        let stops: Vec<i32> = stops(window, 8, &all, &shares).collect();
        assert_eq!(stops, [6, -10]);
        let chosen = ChosenPixels { window, chosen: vec![true; 96], stops };
        assert_eq!([[8, 0], [16, 0], [24, 0]].map(|at| chosen.stop(at, 8)), [Some(6), Some(-10), None]);
        assert!(chosen.has([19, 7]) && !chosen.has([20, 7]) && !chosen.has([7, 0]));
    }

    #[test]
    fn what_is_laid_over_takes_its_alpha() {
        let window = Window { x: 0, y: 0, width: 3, height: 1 };
        let color = Buffer::from(Plane::Color);
        let film = |pixels: [[f32; 4]; 3]| Film {
            size: [3, 1],
            window,
            planes: vec![("color".into(), color, PlaneVec::Floats(pixels.concat()))],
        };
        let pixel = [0.5, 0.25, 1.0, 0.5];
        let mut picture = film([pixel; 3]);
        let black = film([[9.0; 4], [9.0; 4], [0.25, 0.0, 0.5, 1.0]]);
        // In light; in full; in part
        let shadows = Shadows { window, shares: vec![1.0, 1.0, 0.5], alphas: vec![0.0, 0.5, 0.5], work: Vec::new() };
        assert!(shadows.mixed().is_some_and(|mixed| mixed.chosen == [false, false, true]));
        shadows.cover(&mut picture, Some(&black));
        let expected = [pixel, [0.25, 0.125, 0.5, 0.75], [0.375, 0.125, 0.75, 0.75]];
        assert_eq!(picture.floats(color), Some(&expected.concat()[..]));
    }
}
