//! Point lights.

use super::Falloff;
use crate::describe::{ColorDesc, table};

table! {
    /// Light from one point, the same in every direction.
    ///
    /// Physical: E = I cos / d^2, I = color x strength in candela. Constant: color x strength at any distance.
    ///
    /// ```toml
    /// [[light.point]]
    /// position = [0, 3, 0]
    /// strength = 10
    /// ```
    pub struct PointDesc {
        /// What reports call it.
        pub name: Option<String> = None,
        /// In metres, world space.
        pub position: [f64; 3],
        /// Linear colour; channels of 0 or more.
        pub color: ColorDesc = ColorDesc::WHITE,
        /// Candela (physical), or a plain factor (constant); 0 or more.
        pub strength: f64 = 1.0,
        /// How light weakens on its way.
        pub falloff: Falloff = Falloff::Physical,
        /// Whether its light can be blocked.
        pub shadows: bool = true,
    }
}
