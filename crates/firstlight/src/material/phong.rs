//! Phong's reflection model.

use crate::describe::{ColorParam, NumberParam, table};

table! {
    /// Phong: f = diffuse max(n.wi, 0) + specular max(r.wo, 0)^shininess, r = 2 (n.wi) n - wi; the specular term is 0
    /// where n.wi <= 0.
    ///
    /// Source: Phong, "Illumination for computer generated pictures", CACM 18(6), 1975.
    ///
    /// ```toml
    /// [material.phong.red]
    /// diffuse = [0.8, 0.1, 0.1]
    /// specular = 0.4
    /// shininess = 32
    /// ```
    pub struct PhongDesc {
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
