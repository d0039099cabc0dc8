//! Tiles: the unit of work of a thread.

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

    /// The same in whole cells of a grid of the film: at the window's edges tiles are smaller, elsewhere as large as
    /// `size`, rounded up to cells.
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

    /// Whether it has this pixel.
    pub fn contains(&self, [i, j]: [u32; 2]) -> bool {
        (self.x..self.x + self.width).contains(&i) && (self.y..self.y + self.height).contains(&j)
    }

    /// The upper left corners of the cells of a grid of the film that the tile has a part of, row by row.
    pub fn cells(self, side: u32) -> impl Iterator<Item = [u32; 2]> {
        let starts =
            move |from: u32, length: u32| (from / side..(from + length).div_ceil(side)).map(move |cell| cell * side);
        let columns = starts(self.x, self.width);
        starts(self.y, self.height).flat_map(move |y| columns.clone().map(move |x| [x, y]))
    }
}

/// Runs of neighbouring tiles stay together; of a large picture there are about so many runs.
const RUNS: usize = 256;

/// The same tiles in an order in which any stretch of them is spread over the whole picture, so that the time of the
/// first ones predicts that of all. Neighbours still follow each other in runs: their rays meet the same surfaces.
pub(crate) fn spread(tiles: &[Tile]) -> Vec<Tile> {
    let runs: Vec<&[Tile]> = tiles.chunks((tiles.len() / RUNS).max(1)).collect();
    let count = runs.len();
    // Steps of the golden section of all, or the next number that comes by every run
    let is_whole =
        |step: &usize| (1..=*step).rev().find(|d| step.is_multiple_of(*d) && count.is_multiple_of(*d)) == Some(1);
    let step = (count * 618 / 1000..count).find(is_whole).unwrap_or(1);
    (0..count).flat_map(|k| runs[k * step % count]).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_spread_and_none_is_lost() {
        for (width, height) in [(1, 1), (8, 8), (16, 8), (24, 8), (40, 24), (100, 77), (1024, 768), (1000, 1000)] {
            let tiles = Tile::cover(Window { x: 3, y: 2, width, height }, 8);
            let spread = spread(&tiles);
            let sorted = |mut tiles: Vec<Tile>| {
                tiles.sort_by_key(|t| (t.y, t.x));
                tiles
            };
            assert_eq!(sorted(spread.clone()), sorted(tiles.clone()), "{width} x {height}");
            // Of each tenth of them about as much lies in the upper half of the picture as in the lower
            if tiles.len() > 1000 {
                for part in spread.chunks_exact(tiles.len() / 10) {
                    let upper = part.iter().filter(|t| t.y < height / 2).count();
                    assert!((0.4..0.6).contains(&(upper as f64 / part.len() as f64)), "{width} x {height}: {upper}");
                }
            }
        }
    }

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
