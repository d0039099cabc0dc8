//! Where pixels are collected.

use super::heat::Heat;
use super::tile::Tile;
use crate::image::{Image, Window};

/// The film: linear Rec. 709, alpha premultiplied.
#[derive(Clone, Debug)]
pub struct Film {
    size: [u32; 2],
    window: Window,
    pixels: Vec<[f32; 4]>,
    /// What each pixel took; empty where nobody asked.
    work: Vec<f32>,
}

/// The pixels of one tile.
pub(crate) struct FilmTile {
    tile: Tile,
    pixels: Vec<[f32; 4]>,
    work: Vec<f32>,
}

impl Film {
    /// A film of `size` pixels, of which `window` is exposed. `heat`: whether what each pixel takes is kept.
    pub(crate) fn new(size: [u32; 2], window: Window, heat: bool) -> Self {
        let count = window.width as usize * window.height as usize;
        Film { size, window, pixels: vec![[0.0; 4]; count], work: vec![0.0; if heat { count } else { 0 }] }
    }

    /// Takes the pixels of a tile.
    pub(crate) fn merge(&mut self, from: &FilmTile) {
        let Tile { x, y, width, .. } = from.tile;
        for (row, pixels) in from.pixels.chunks_exact(width as usize).enumerate() {
            let start = (y as usize - self.window.y as usize + row) * self.window.width as usize
                + (x as usize - self.window.x as usize);
            self.pixels[start..start + pixels.len()].copy_from_slice(pixels);
            if !self.work.is_empty() {
                let work = &from.work[row * width as usize..][..pixels.len()];
                self.work[start..start + pixels.len()].copy_from_slice(work);
            }
        }
    }

    /// Where the work went; `None` if [`RenderSettings::heat`](super::RenderSettings::heat) did not ask for it.
    pub fn heat(&self) -> Option<Heat> {
        let Film { size: film, window, work, .. } = self;
        (!work.is_empty()).then(|| Heat { film: *film, window: *window, work: work.clone() })
    }

    /// The picture.
    pub fn develop(self) -> Image {
        Image { film: self.size, window: self.window, pixels: self.pixels }
    }
}

impl FilmTile {
    pub fn new(tile: &Tile) -> Self {
        let count = tile.width as usize * tile.height as usize;
        FilmTile { tile: *tile, pixels: vec![[0.0; 4]; count], work: vec![0.0; count] }
    }

    /// Notes what the pixel in column `x`, row `y` of the tile took.
    #[inline(always)]
    pub fn spend(&mut self, x: u32, y: u32, work: f32) {
        self.work[(y * self.tile.width + x) as usize] = work;
    }

    /// The pixel in column `x`, row `y` of the tile.
    #[inline(always)]
    pub fn set(&mut self, x: u32, y: u32, rgba: [f32; 4]) {
        self.pixels[(y * self.tile.width + x) as usize] = rgba;
    }
}
