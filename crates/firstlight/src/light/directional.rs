//! Directional lights.

use super::Falloff;
use crate::describe::{ColorDesc, table};

table! {
    /// Light from infinitely far away, all of it in one direction: the sun on a clear day.
    ///
    /// Physical: E = color x strength x cos, strength in lux on a surface facing the light. Constant: color x strength.
    ///
    /// ```toml
    /// [[light.directional]]
    /// direction = [-1, -2, -1]
    /// strength = 3
    /// ```
    pub struct DirectionalDesc {
        /// What reports call it.
        pub name: Option<String> = None,
        /// The way the light travels, of any length but 0.
        pub direction: [f64; 3],
        /// Linear colour; channels of 0 or more.
        pub color: ColorDesc = ColorDesc::WHITE,
        /// Lux (physical), or a plain factor (constant); 0 or more.
        pub strength: f64 = 1.0,
        /// How light weakens on its way.
        pub falloff: Falloff = Falloff::Physical,
        /// Whether its light can be blocked.
        pub shadows: bool = true,
    }
}
