//! Pictures in memory and in files.

/// The part of a film that a picture shows, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// The first column.
    pub x: u32,
    /// The first row; row 0 is the top.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// A picture: linear Rec. 709, alpha premultiplied, 32-bit floats.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// The width and height of the whole film.
    pub film: [u32; 2],
    /// The part of it that `pixels` holds.
    pub window: Window,
    /// Red, green, blue, alpha; the window's rows from the top, each from the left.
    pub pixels: Vec<[f32; 4]>,
}

/// What a picture file says of itself: keys and values, in order. Only what decides pixels: no clock, host, thread
/// count or absolute path.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Receipt {
    /// Key and value, `("scene_hash", "9f1c...")`.
    pub entries: Vec<(String, String)>,
}

/// The texels of a picture as it is stored.
#[derive(Clone, Debug)]
pub(crate) struct Texels {
    pub width: u32,
    pub height: u32,
    pub data: TexelData,
}

/// Red, green, blue; row 0 on top.
#[derive(Clone, Debug)]
pub(crate) enum TexelData {
    Rgb8(Vec<[u8; 3]>),
    Rgb16(Vec<[u16; 3]>),
}

// STUB
#[derive(Default)]
pub(crate) struct TexelLimits;
pub(crate) fn decode(_: &[u8], _: &TexelLimits) -> Result<Texels, String> {
    Err("stub".into())
}
