//! Squares of pixels, the nodes of a quadtree over the film.

/// A square of pixels, in coordinates of the film; it may reach beyond the film's edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Square {
    pub x: u32,
    pub y: u32,
    pub side: u32,
}

impl Square {
    /// Its four quarters.
    pub fn quarters(self) -> [Square; 4] {
        let side = self.side / 2;
        [[0, 0], [side, 0], [0, side], [side, side]].map(|[x, y]| Square { x: self.x + x, y: self.y + y, side })
    }

    /// The quarters that overlap a film of `size` pixels.
    pub fn quarters_on(self, size: [u32; 2]) -> impl DoubleEndedIterator<Item = Square> {
        self.quarters().into_iter().filter(move |quarter| quarter.x < size[0] && quarter.y < size[1])
    }

    /// Its pixels, row by row.
    pub fn pixels(self) -> impl Iterator<Item = [u32; 2]> {
        let across = self.x..self.x + self.side;
        (self.y..self.y + self.side).flat_map(move |y| across.clone().map(move |x| [x, y]))
    }

    /// The number of one of its pixels, row by row.
    pub fn number(self, [i, j]: [u32; 2]) -> usize {
        ((j - self.y) * self.side + i - self.x) as usize
    }
}
