//! Textures: colours and numbers that change over a surface.

mod checkerboard;
mod image;

pub use checkerboard::CheckerboardDesc;
pub use image::{Filter, ImageTextureDesc, TextureSpace, Wrap};

/// A texture as a scene may say it.
#[derive(Clone, Debug, PartialEq)]
pub enum TextureDesc {
    /// `[texture.checkerboard.NAME]`
    Checkerboard(CheckerboardDesc),
    /// `[texture.image.NAME]`
    Image(ImageTextureDesc),
}
