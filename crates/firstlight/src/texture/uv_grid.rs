//! A grid with numbers, to look at uv coordinates with.

use super::check_uv_set;
use crate::context::CompileContext;
use crate::describe::table;
use crate::image::read::{TexelSamples, Texels};

table! {
    /// A grid that shows how a surface is unwrapped: `counts[0]` cells across u in 0..1 and `counts[1]` across v, each
    /// with its column and row, counted from (0, 0). Red grows with u and green with v; numbers that are mirrored or
    /// upside down are so on the surface. Repeated beyond 0..1.
    ///
    /// ```toml
    /// [texture.uv-grid.test]
    /// counts = [8, 8]
    /// ```
    pub struct UvGridDesc {
        /// Cells along u and along v, 1 to 32 each.
        pub counts: [u32; 2] = [8, 8],
        /// Which set of a mesh's texture coordinates the texture is laid by, 0 to 3; without it the mesh's own
        /// `uv_set`. Shapes of other kinds have set 0 alone.
        pub uv_set: Option<u32> = None,
    }
}

/// The most cells along an axis: of more the numbers would have three digits.
const MAX_COUNT: u32 = 32;
/// Texels along a side of a cell.
const CELL: u32 = 64;
/// Texels of a line, half of it in each of two cells.
const LINE: u32 = 2;
/// Texels along a side of a dot that digits are made of.
const DOT: u32 = 4;
/// The dots of the digits 0 to 9: five rows of three, from the upper left, the first in the highest bit.
const DIGITS: [u16; 10] = [
    0b111_101_101_101_111,
    0b010_110_010_010_111,
    0b111_001_111_100_111,
    0b111_001_111_001_111,
    0b101_101_111_001_001,
    0b111_100_111_001_111,
    0b111_100_111_101_111,
    0b111_001_010_010_010,
    0b111_101_111_101_111,
    0b111_101_111_001_111,
];

impl UvGridDesc {
    pub(crate) fn check(&self, cx: &mut CompileContext) {
        for (i, count) in self.counts.iter().enumerate() {
            cx.count(&format!("counts[{i}]"), *count, 1, MAX_COUNT, Some("cells along that axis"));
        }
        check_uv_set(cx, self.uv_set);
    }

    /// The grid as a picture, sRGB.
    pub(crate) fn picture(&self) -> Texels {
        let [across, down] = self.counts.map(|count| count.clamp(1, MAX_COUNT));
        let (width, height) = (across * CELL, down * CELL);
        let mut samples = Vec::with_capacity(3 * (width * height) as usize);
        for y in 0..height {
            for x in 0..width {
                // Row 0 of the picture is v = 1
                let (column, row) = (x / CELL, down - 1 - y / CELL);
                samples.extend(color([column, row], [x % CELL, y % CELL], [across, down]));
            }
        }
        Texels { width, height, channels: 3, data: TexelSamples::U8(samples) }
    }
}

/// The colour of a texel of a cell, counted from the cell's upper left corner.
fn color([column, row]: [u32; 2], [x, y]: [u32; 2], counts: [u32; 2]) -> [u8; 3] {
    if x.min(y) < LINE / 2 || x.max(y) >= CELL - LINE / 2 {
        return [255; 3];
    }
    let ramp = |cell: u32, count: u32| 60 + (150 * cell / count.max(2).saturating_sub(1)).min(150) as u8;
    let dark = if (column + row) % 2 == 0 { 0 } else { 25 };
    let paper = [ramp(column, counts[0]) - dark, ramp(row, counts[1]) - dark, 110 - dark];
    // Two numbers of up to two digits, the row under the column
    let (left, top) = (CELL / 2 - 3 * DOT - DOT / 2, CELL / 2 - 6 * DOT);
    let line = |number: u32, top: u32| {
        let y = y.checked_sub(top).filter(|y| *y < 5 * DOT)?;
        let x = x.checked_sub(left).filter(|x| *x < 7 * DOT)?;
        let (place, dot) = (x / (4 * DOT), x % (4 * DOT) / DOT);
        let digit = if place == 0 { number / 10 } else { number % 10 };
        // Between two digits there is a column of paper
        let from_left = 15 - y / DOT * 3 - dot;
        (dot < 3 && DIGITS[digit as usize] << 1 >> from_left & 1 == 1).then_some([255; 3])
    };
    line(column, top).or_else(|| line(row, top + 7 * DOT)).unwrap_or(paper)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn red_grows_with_u_and_green_with_v() {
        let picture = UvGridDesc { counts: [4, 2], ..UvGridDesc::default() }.picture();
        assert_eq!((picture.width, picture.height), (256, 128));
        let TexelSamples::U8(samples) = &picture.data else { panic!() };
        // Beside the lines at the lower left corner of each cell, u and v from 0
        let at = |column: usize, row: usize| {
            let (x, y) = (column * 64 + 2, (1 - row) * 64 + 61);
            &samples[3 * (y * 256 + x)..][..3]
        };
        assert!(at(3, 0)[0] > at(0, 0)[0] + 100 && at(0, 1)[1] > at(0, 0)[1] + 100);
        assert_eq!(&samples[..3], [255; 3]);
    }

    #[test]
    fn every_size_has_its_texels() {
        for counts in [[1, 1], [32, 1], [1, 32], [7, 5]] {
            let picture = UvGridDesc { counts, ..UvGridDesc::default() }.picture();
            let TexelSamples::U8(samples) = &picture.data else { panic!() };
            assert_eq!(samples.len() as u32, 3 * picture.width * picture.height);
        }
    }
}
