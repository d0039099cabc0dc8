//! Textures: colours and numbers that change over a surface.

mod checkerboard;
mod image;

pub use checkerboard::{Checkerboard, CheckerboardDesc};
pub use image::{Filter, ImageTexture, ImageTextureDesc, TextureSpace, Wrap};

use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::{ColorParam, NumberParam, family};
use crate::ids::TextureId;
use crate::shape::SurfaceInteraction;

family! {
    /// A texture as a scene may say it.
    pub enum TextureDesc: "texture" {
        /// `[texture.checkerboard.NAME]`
        Checkerboard(CheckerboardDesc) = "checkerboard",
        /// `[texture.image.NAME]`
        Image(ImageTextureDesc) = "image",
    }
}

/// A texture, ready to be looked up.
#[derive(Clone, Debug)]
pub enum Texture {
    /// `[texture.checkerboard.NAME]`
    Checkerboard(Checkerboard),
    /// `[texture.image.NAME]`
    Image(ImageTexture),
}

impl Texture {
    /// The colour at a surface, linear Rec. 709.
    #[inline]
    pub fn color(&self, si: &SurfaceInteraction) -> Rgb {
        match self {
            Texture::Checkerboard(board) => board.color(si.uv, &si.footprint),
            Texture::Image(image) => image.color(si.uv),
        }
    }

    /// How far its colours differ, if its value is the area mean over the footprint, whatever its size.
    pub(crate) fn contrast(&self) -> Option<Rgb> {
        match self {
            Texture::Checkerboard(board) => Some(board.contrast()),
            Texture::Image(_) => None,
        }
    }

    /// Whether it is proved to be the same all within a step of the footprint.
    pub(crate) fn is_even(&self, si: &SurfaceInteraction) -> bool {
        match self {
            Texture::Checkerboard(board) => board.is_even(si.uv, &si.footprint),
            Texture::Image(_) => false,
        }
    }
}

/// Where the parameters of materials come from: numbers, and textures by name.
pub(crate) trait Params {
    /// A radiance: 0 or more in each channel.
    fn radiance(&mut self, cx: &mut CompileContext, field: &str, param: &ColorParam) -> Param<Rgb>;
    /// A reflectance: the same, and advice where it is more than 1.
    fn color(&mut self, cx: &mut CompileContext, field: &str, param: &ColorParam) -> Param<Rgb>;
    fn number(&mut self, cx: &mut CompileContext, field: &str, param: &NumberParam, range: [f64; 2]) -> Param<f32>;
}

/// A parameter of a material: the same everywhere, or a texture times a factor. `Param<Rgb>` is colour, `Param<f32>`
/// data.
#[derive(Clone, Copy, Debug)]
pub struct Param<T> {
    /// The texture, if one drives it.
    pub texture: Option<TextureId>,
    /// The constant, or the texture's factor.
    pub factor: T,
}

impl<T> Param<T> {
    /// The same everywhere.
    pub(crate) fn constant(factor: T) -> Self {
        Param { texture: None, factor }
    }
}

impl Param<Rgb> {
    /// The colour at a surface.
    #[inline]
    pub fn color(&self, si: &SurfaceInteraction, textures: &[Texture]) -> Rgb {
        match self.texture {
            None => self.factor,
            Some(id) => textures[id.index()].color(si) * self.factor,
        }
    }
}

impl Param<f32> {
    /// The number at a surface: the texture's red channel times the factor.
    #[inline]
    pub fn number(&self, si: &SurfaceInteraction, textures: &[Texture]) -> f32 {
        match self.texture {
            None => self.factor,
            Some(id) => textures[id.index()].color(si).r * self.factor,
        }
    }
}
