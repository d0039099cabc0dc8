//! Tiles: the windows of the film that threads take turns at, and the parts of tiles.

pub(crate) use crate::image::Window as Tile;

impl Tile {
    /// Tiles of whole cells of a grid of the film that cover this one, row by row: at its edges they are smaller,
    /// elsewhere as large as `size`, rounded up to cells.
    pub fn parts(self, size: u32, cell: u32) -> impl Iterator<Item = Tile> {
        let size = u64::from(size.next_multiple_of(cell));
        let spans = move |from: u32, length: u32| {
            let (first, end) = (u64::from(from / cell * cell), u64::from(from) + u64::from(length));
            (first..end).step_by(size as usize).map(move |start| {
                let (a, b) = (start.max(u64::from(from)), (start + size).min(end));
                (a as u32, (b - a) as u32)
            })
        };
        let rows = spans(self.y, self.height);
        rows.flat_map(move |(y, height)| spans(self.x, self.width).map(move |(x, width)| Tile { x, y, width, height }))
    }

    /// Its pixels, row by row.
    pub fn pixels(self) -> impl Iterator<Item = [u32; 2]> {
        let columns = self.x..self.x + self.width;
        (self.y..self.y + self.height).flat_map(move |y| columns.clone().map(move |x| [x, y]))
    }

    /// Whether it has this pixel.
    pub fn contains(&self, [i, j]: [u32; 2]) -> bool {
        (self.x..self.x + self.width).contains(&i) && (self.y..self.y + self.height).contains(&j)
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
            let tiles: Vec<Tile> = Tile { x: 3, y: 2, width, height }.parts(8, 1).collect();
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
        let window = Tile { x: 5, y: 3, width: 37, height: 20 };
        for cell in [1, 32] {
            let mut pixels: Vec<[u32; 2]> = window.parts(8, cell).flat_map(Tile::pixels).collect();
            pixels.sort_by_key(|[x, y]| [*y, *x]);
            assert!(pixels.into_iter().eq(window.pixels()));
        }
    }
}
