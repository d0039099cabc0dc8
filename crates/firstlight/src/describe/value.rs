//! The values a field of the scene text can have.

/// A colour: linear Rec. 709. In text `[r, g, b]` is linear, `"#rrggbb"` sRGB, and a number is that much gray (linear).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorDesc {
    /// Red, green, blue; linear, 0 or more.
    pub linear: [f64; 3],
}

impl ColorDesc {
    /// No light.
    pub const BLACK: ColorDesc = ColorDesc::gray(0.0);
    /// 1 in every channel.
    pub const WHITE: ColorDesc = ColorDesc::gray(1.0);

    /// From linear channels.
    pub const fn linear(r: f64, g: f64, b: f64) -> Self {
        Self { linear: [r, g, b] }
    }

    /// The same linear value in all channels.
    pub const fn gray(v: f64) -> Self {
        Self::linear(v, v, v)
    }
}

/// A parameter that a texture can drive: a constant, or `{ texture = "NAME", factor = ... }`, the texture times a factor.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamDesc<T> {
    /// The texture's name, if a texture drives it.
    pub texture: Option<String>,
    /// The constant, or the factor of the texture (1 unless said).
    pub factor: T,
}

/// A colour that a texture can drive.
pub type ColorParam = ParamDesc<ColorDesc>;
/// A number that a texture can drive.
pub type NumberParam = ParamDesc<f64>;

impl<T> ParamDesc<T> {
    /// The same everywhere.
    pub const fn constant(value: T) -> Self {
        Self { texture: None, factor: value }
    }
}

impl ColorParam {
    /// The same linear gray everywhere.
    pub const fn gray(v: f64) -> Self {
        Self::constant(ColorDesc::gray(v))
    }

    /// The texture `name`, as it is.
    pub fn texture(name: impl Into<String>) -> Self {
        Self { texture: Some(name.into()), factor: ColorDesc::WHITE }
    }
}

impl NumberParam {
    /// The texture `name`, as it is.
    pub fn texture(name: impl Into<String>) -> Self {
        Self { texture: Some(name.into()), factor: 1.0 }
    }
}

/// A file a scene names: with `/` between folders, relative to the scene's folder. In an included text it is written
/// relative to that text's own folder.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct FilePath(pub String);
