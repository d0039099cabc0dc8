//! Where pixels are collected.

use super::tile::Tile;
use crate::image::{Image, Window};

/// The film: linear Rec. 709, alpha premultiplied.
#[derive(Clone, Debug)]
pub struct Film {
    size: [u32; 2],
    window: Window,
    pixels: Vec<[f32; 4]>,
}

/// The pixels of one tile.
pub(crate) struct FilmTile {
    tile: Tile,
    pixels: Vec<[f32; 4]>,
}

impl Film {
    /// A film of `size` pixels, of which `window` is exposed.
    pub(crate) fn new(size: [u32; 2], window: Window) -> Self {
        Film { size, window, pixels: vec![[0.0; 4]; window.width as usize * window.height as usize] }
    }

    /// Takes the pixels of a tile.
    pub(crate) fn merge(&mut self, from: &FilmTile) {
        let Tile { x, y, width, .. } = from.tile;
        for (row, pixels) in from.pixels.chunks_exact(width as usize).enumerate() {
            let start = (y as usize - self.window.y as usize + row) * self.window.width as usize
                + (x as usize - self.window.x as usize);
            self.pixels[start..start + pixels.len()].copy_from_slice(pixels);
        }
    }

    /// The picture.
    pub fn develop(self) -> Image {
        Image { film: self.size, window: self.window, pixels: self.pixels }
    }
}

impl FilmTile {
    pub fn new(tile: &Tile) -> Self {
        FilmTile { tile: *tile, pixels: vec![[0.0; 4]; tile.width as usize * tile.height as usize] }
    }

    /// The pixel in column `x`, row `y` of the tile.
    #[inline(always)]
    pub fn set(&mut self, x: u32, y: u32, rgba: [f32; 4]) {
        self.pixels[(y * self.tile.width + x) as usize] = rgba;
    }
}
