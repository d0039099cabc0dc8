//! Blinn's variant of Phong's reflection model.

use crate::describe::{ColorParam, NumberParam, table};

table! {
    /// Blinn-Phong: f = diffuse max(n.wi, 0) + specular max(n.h, 0)^shininess, h = normalize(wi + wo); the specular term is 0
    /// where n.wi <= 0.
    ///
    /// Source: Blinn, "Models of light reflection for computer synthesized pictures", SIGGRAPH 1977.
    ///
    /// ```toml
    /// [material.blinn-phong.red]
    /// diffuse = [0.8, 0.1, 0.1]
    /// specular = 0.4
    /// shininess = 32
    /// ```
    pub struct BlinnPhongDesc {
        /// The fraction of light reflected in all directions: 0 to 1 in each channel conserves energy, more is allowed.
        pub diffuse: ColorParam = ColorParam::gray(0.8),
        /// The strength of the highlight; 0 or more.
        pub specular: ColorParam = ColorParam::gray(0.0),
        /// Answers the scene's ambient light, once; without it, `diffuse`.
        pub ambient: Option<ColorParam> = None,
        /// The highlight's exponent, 0 to 1000000: the larger, the smaller the highlight.
        pub shininess: NumberParam = NumberParam::constant(16.0),
    }
}
