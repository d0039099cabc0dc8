//! The checkerboard, exact over the footprint.

use crate::describe::{ColorDesc, table};

table! {
    /// Squares of two colours, `counts[0]` across u in 0..1 and `counts[1]` across v in 0..1: the first colour where
    /// floor(u n) + floor(v m) is even. A function, not an image: its value is the area mean over the pixel's
    /// footprint, so its edges are sharp from near and gray from far, for every count.
    ///
    /// ```toml
    /// [texture.checkerboard.tiles]
    /// counts = [8, 8]
    /// colors = ["#ffffff", "#202020"]
    /// ```
    pub struct CheckerboardDesc {
        /// Squares along u and along v, 1 to 65536 each.
        pub counts: [u32; 2] = [8, 8],
        /// The first colour, that of the square at (0, 0), and the second.
        pub colors: [ColorDesc; 2] = [ColorDesc::WHITE, ColorDesc::BLACK],
    }
}
