//! The unit of work.

use crate::image::Window;

/// A rectangle of pixels, in coordinates of the film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tile {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

impl Tile {
    /// Tiles of at most `size` x `size` pixels that cover `window`, each pixel once.
    pub fn cover(window: Window, size: u32) -> Vec<Tile> {
        let mut tiles = Vec::new();
        for y in (0..window.height).step_by(size as usize) {
            for x in (0..window.width).step_by(size as usize) {
                let (width, height) = (size.min(window.width - x), size.min(window.height - y));
                tiles.push(Tile { x: window.x + x, y: window.y + y, width, height });
            }
        }
        tiles
    }

    /// The same in whole cells of a grid of the film: at the window's edges tiles are smaller, elsewhere as large as `size`,
    /// rounded up to cells.
    pub fn cover_cells(window: Window, size: u32, cell: u32) -> Vec<Tile> {
        let size = size.next_multiple_of(cell) as u64;
        let spans = |from: u32, length: u32| {
            let end = from as u64 + length as u64;
            let first = from as u64 / cell as u64 * cell as u64;
            (0..).map(move |k| first + k * size).take_while(move |start| *start < end).map(move |start| {
                let (a, b) = (start.max(from as u64), (start + size).min(end));
                (a as u32, (b - a) as u32)
            })
        };
        let mut tiles = Vec::new();
        for (y, height) in spans(window.y, window.height) {
            tiles.extend(spans(window.x, window.width).map(|(x, width)| Tile { x, y, width, height }));
        }
        tiles
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_in_one_tile() {
        let window = Window { x: 5, y: 3, width: 37, height: 20 };
        let mut seen = vec![0; 37 * 20];
        for t in Tile::cover(window, 8) {
            for y in t.y..t.y + t.height {
                for x in t.x..t.x + t.width {
                    seen[((y - 3) * 37 + (x - 5)) as usize] += 1;
                }
            }
        }
        assert!(seen.iter().all(|n| *n == 1));
    }
}
