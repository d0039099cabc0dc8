//! Where pixels are collected: planes of one size, each of one thing, those that were asked for.

use super::heat::Heat;
use super::tile::Tile;
use crate::image::{Image, Window};

/// What a plane of the film says of each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// The picture, and how much of it is covered.
    Color,
    /// What the pixel took: see [`Heat`].
    Rays,
}

impl Plane {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Plane::Color => "color",
            Plane::Rays => "rays",
        }
    }

    /// The names of its channels, 32-bit floats.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Plane::Color => &["R", "G", "B", "A"],
            Plane::Rays => &["rays"],
        }
    }

    /// What its numbers are.
    pub fn unit(self) -> &'static str {
        match self {
            Plane::Color => "linear Rec. 709, premultiplied with alpha, which is a share of the pixel",
            Plane::Rays => "rays that were asked",
        }
    }

    /// What a pixel of it takes.
    pub(super) fn bytes(self) -> usize {
        self.channels().len() * size_of::<f32>()
    }
}

/// The numbers of a plane, pixel by pixel.
#[derive(Clone, Debug)]
enum Values {
    One(Vec<f32>),
    Four(Vec<[f32; 4]>),
}

impl Values {
    fn new(plane: Plane, pixels: usize) -> Values {
        match plane {
            Plane::Color => Values::Four(vec![[0.0; 4]; pixels]),
            Plane::Rays => Values::One(vec![0.0; pixels]),
        }
    }

    /// Takes a row of `from`, from its number `first` on, and puts it at number `at`.
    fn take(&mut self, at: usize, from: &Values, first: usize, length: usize) {
        match (self, from) {
            (Values::One(to), Values::One(from)) => to[at..at + length].copy_from_slice(&from[first..first + length]),
            (Values::Four(to), Values::Four(from)) => to[at..at + length].copy_from_slice(&from[first..first + length]),
            _ => unreachable!("a tile has the planes of its film"),
        }
    }
}

/// The film.
#[derive(Clone, Debug)]
pub struct Film {
    size: [u32; 2],
    window: Window,
    planes: Vec<(Plane, Values)>,
}

/// The pixels of one tile.
pub(crate) struct FilmTile {
    pub tile: Tile,
    planes: Vec<(Plane, Values)>,
}

fn empty(planes: impl IntoIterator<Item = Plane>, pixels: usize) -> Vec<(Plane, Values)> {
    planes.into_iter().map(|plane| (plane, Values::new(plane, pixels))).collect()
}

impl Film {
    /// A film of `size` pixels, of which `window` is exposed.
    pub(crate) fn new(size: [u32; 2], window: Window, planes: &[Plane]) -> Self {
        let pixels = window.width as usize * window.height as usize;
        Film { size, window, planes: empty(planes.iter().copied(), pixels) }
    }

    /// Takes the pixels of a tile.
    pub(crate) fn merge(&mut self, from: &FilmTile) {
        let Tile { x, y, width, height } = from.tile;
        let (left, top) = ((x - self.window.x) as usize, (y - self.window.y) as usize);
        for ((_, to), (_, from)) in self.planes.iter_mut().zip(&from.planes) {
            for row in 0..height as usize {
                let at = (top + row) * self.window.width as usize + left;
                to.take(at, from, row * width as usize, width as usize);
            }
        }
    }

    /// What it holds.
    pub fn planes(&self) -> impl Iterator<Item = Plane> {
        self.planes.iter().map(|(plane, _)| *plane)
    }

    /// Where the work went; `None` if [`RenderSettings::heat`](super::RenderSettings::heat) did not ask for it.
    pub fn heat(&self) -> Option<Heat> {
        let work = self.planes.iter().find_map(|(plane, values)| match (plane, values) {
            (Plane::Rays, Values::One(work)) => Some(work.clone()),
            _ => None,
        })?;
        Some(Heat { film: self.size, window: self.window, work })
    }

    /// The picture.
    pub fn develop(self) -> Image {
        let pixels = self.planes.into_iter().find_map(|(plane, values)| match (plane, values) {
            (Plane::Color, Values::Four(pixels)) => Some(pixels),
            _ => None,
        });
        Image { film: self.size, window: self.window, pixels: pixels.expect("every film has the picture") }
    }
}

impl FilmTile {
    /// One with the same planes.
    pub fn new(tile: &Tile, planes: &[Plane]) -> Self {
        let pixels = tile.width as usize * tile.height as usize;
        FilmTile { tile: *tile, planes: empty(planes.iter().copied(), pixels) }
    }

    /// Notes what the pixel in column `x`, row `y` of the tile shows, red, green, blue premultiplied, alpha; and what
    /// it took.
    #[inline(always)]
    pub fn set(&mut self, x: u32, y: u32, rgba: [f32; 4], work: f32) {
        self.set_row(x, y, &[rgba], &[work]);
    }

    /// The same of pixels side by side.
    #[inline(always)]
    pub fn set_row(&mut self, x: u32, y: u32, rgba: &[[f32; 4]], work: &[f32]) {
        let index = (y * self.tile.width + x) as usize;
        for (plane, values) in &mut self.planes {
            match (plane, values) {
                (Plane::Color, Values::Four(pixels)) => pixels[index..index + rgba.len()].copy_from_slice(rgba),
                (Plane::Rays, Values::One(pixels)) => pixels[index..index + work.len()].copy_from_slice(work),
                _ => unreachable!("each plane has its numbers"),
            }
        }
    }
}
