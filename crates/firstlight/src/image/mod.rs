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
