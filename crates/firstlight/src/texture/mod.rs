//! Textures: colours and numbers that change over a surface.

mod checkerboard;
mod filter;
#[cfg(test)]
mod filter_tests;
mod image;
mod pyramid;
mod texels;
mod uv_grid;

pub use checkerboard::{Checkerboard, CheckerboardDesc};
pub use image::{Filter, ImageTexture, ImageTextureDesc, TextureSpace, Wrap};
pub use uv_grid::UvGridDesc;

pub(crate) use pyramid::{MaskRule, Pyramid, TextureUse};

use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::{Channel, ColorParam, NumberParam, family};
use crate::ids::TextureId;
use crate::math::Vec2;
use crate::shape::{Footprint, SurfaceInteraction, UV_SETS, UvEdge};

family! {
    /// A texture as a scene may say it.
    pub enum TextureDesc: "texture" {
        /// `[texture.checkerboard.NAME]`
        Checkerboard(CheckerboardDesc) = "checkerboard",
        /// `[texture.image.NAME]`
        Image(ImageTextureDesc) = "image",
        /// `[texture.uv-grid.NAME]`
        UvGrid(UvGridDesc) = "uv-grid",
    }
}

impl TextureDesc {
    /// Which set of a mesh's texture coordinates it is laid by; `None`: the one that the mesh chooses.
    pub(crate) fn uv_set(&self) -> Option<u32> {
        match self {
            TextureDesc::Checkerboard(board) => board.uv_set,
            TextureDesc::Image(image) => image.uv_set,
            TextureDesc::UvGrid(grid) => grid.uv_set,
        }
    }
}

/// Finds the fault of a texture's set of texture coordinates.
pub(crate) fn check_uv_set(cx: &mut CompileContext, uv_set: Option<u32>) {
    if let Some(set) = uv_set {
        let hint = "sets are counted from 0; without it the mesh chooses";
        cx.count("uv_set", set, 0, UV_SETS as u32 - 1, Some(hint));
    }
}

/// A texture, ready to be looked up.
#[derive(Clone, Debug)]
pub struct Texture {
    /// What it shows.
    pub pattern: TexturePattern,
    /// The set of texture coordinates that it is laid by, 0 to 3; `None`: the one that the mesh chooses.
    pub uv_set: Option<u8>,
}

/// What a texture shows.
#[derive(Clone, Debug)]
pub enum TexturePattern {
    /// `[texture.checkerboard.NAME]`
    Checkerboard(Checkerboard),
    /// `[texture.image.NAME]`, and the picture of a `[texture.uv-grid.NAME]`
    Image(ImageTexture),
}

impl Texture {
    /// Red, green, blue, linear Rec. 709 of colours, and alpha at a surface, filtered over its footprint made `scale`
    /// times as large: 1 for colours, and for data as many as bring a camera ray's footprint to that of its pixel.
    ///
    /// Of a normal map x, y and z, the mean of unit vectors: the shorter, the more they differ. Of a mask the share
    /// that is solid, in all four.
    #[inline]
    pub fn value(&self, si: &SurfaceInteraction, scale: f32) -> [f32; 4] {
        let (uv, footprint) = si.texture_point(self.uv_set);
        self.around(uv, &footprint, scale)
    }

    /// The same at another texture coordinate.
    #[inline]
    fn around(&self, uv: Vec2, footprint: &Footprint, scale: f32) -> [f32; 4] {
        match &self.pattern {
            TexturePattern::Checkerboard(board) => {
                let Footprint { dx, dy, edges } = *footprint;
                let Rgb { r, g, b } = board.color(uv, &Footprint { dx: dx * scale, dy: dy * scale, edges });
                [r, g, b, 1.0]
            }
            TexturePattern::Image(image) => image.value(uv, footprint, scale),
        }
    }

    /// How many texels the longer side of such a footprint is; 1 on what has none.
    pub(crate) fn texels_across(&self, si: &SurfaceInteraction, scale: f32) -> f32 {
        match &self.pattern {
            TexturePattern::Checkerboard(_) => 1.0,
            TexturePattern::Image(image) => {
                let (uv, footprint) = si.texture_point(self.uv_set);
                image.texels_across(uv, &footprint, scale)
            }
        }
    }

    /// The sides of a texel in u and in v; 0 on what has none.
    fn texel(&self) -> Vec2 {
        match &self.pattern {
            TexturePattern::Checkerboard(_) => Vec2::ZERO,
            TexturePattern::Image(image) => image.texel(),
        }
    }

    /// Whether a mask is solid at a point of a surface, on its finest level: what light meets.
    #[inline]
    pub(crate) fn is_solid(&self, uv: Vec2) -> bool {
        match &self.pattern {
            TexturePattern::Checkerboard(board) => {
                let point = Footprint { dx: Vec2::ZERO, dy: Vec2::ZERO, edges: [UvEdge::Unbounded; 2] };
                board.color(uv, &point).r >= 0.5
            }
            TexturePattern::Image(image) => image.is_solid(uv),
        }
    }

    /// Its value at a texture coordinate, on its finest level: what light meets.
    #[inline]
    pub(crate) fn at(&self, uv: Vec2) -> [f32; 4] {
        let point = Footprint { dx: Vec2::ZERO, dy: Vec2::ZERO, edges: [UvEdge::Unbounded; 2] };
        match &self.pattern {
            TexturePattern::Checkerboard(board) => {
                let Rgb { r, g, b } = board.color(uv, &point);
                [r, g, b, 1.0]
            }
            TexturePattern::Image(image) => image.value(uv, &point, 1.0),
        }
    }

    /// How far its colours differ, if its value is the area mean over the footprint, whatever its size.
    pub(crate) fn contrast(&self) -> Option<Rgb> {
        match &self.pattern {
            TexturePattern::Checkerboard(board) => Some(board.contrast()),
            TexturePattern::Image(_) => None,
        }
    }

    /// Whether it is proved to be the same all within a step of the footprint.
    pub(crate) fn is_even(&self, si: &SurfaceInteraction) -> bool {
        match &self.pattern {
            TexturePattern::Checkerboard(board) => {
                let (uv, footprint) = si.texture_point(self.uv_set);
                board.is_even(uv, &footprint)
            }
            TexturePattern::Image(_) => false,
        }
    }
}

/// Where the parameters of materials come from: numbers, and textures by name.
pub(crate) trait Params {
    /// A radiance: 0 or more in each channel. What alpha its texture has does not matter to it.
    fn radiance(&mut self, cx: &mut CompileContext, field: &str, param: &ColorParam) -> Param<Rgb>;

    /// A reflectance: the same, and advice where it is more than 1.
    fn color(&mut self, cx: &mut CompileContext, field: &str, param: &ColorParam) -> Param<Rgb>;

    /// A colour whose texture's alpha says where there is anything: smaller pictures are weighted by it. The alpha of
    /// [`Texture::value`] goes with it.
    #[allow(dead_code, reason = "no material hides what is transparent in its colour yet")]
    fn covered_color(&mut self, cx: &mut CompileContext, field: &str, param: &ColorParam) -> Param<Rgb>;

    /// A number in a range.
    fn number(&mut self, cx: &mut CompileContext, field: &str, param: &NumberParam, range: [f64; 2]) -> Param<f32>;

    /// The share of a texture on which a number is at or above a cutoff. Of a constant 0 or 1.
    fn mask(&mut self, cx: &mut CompileContext, field: &str, param: &NumberParam, cutoff: f64) -> Param<f32>;

    /// The number that a mask is made of, where a mesh may have an alpha at its vertices that multiplies it. Its faults
    /// are those of the mask.
    fn unmasked(&mut self, param: &NumberParam) -> Option<Param<f32>>;

    /// The normal map called `texture`.
    fn normals(&mut self, cx: &mut CompileContext, field: &str, texture: &str) -> Option<TextureId>;
}

/// The least way, in u or v, over which a slope is measured: 100 times the rounding of a coordinate.
const LEAST_REACH: f32 = 1e-5;

/// A parameter of a material: the same everywhere, or a texture times a factor. `Param<Rgb>` is colour, `Param<f32>`
/// data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Param<T> {
    /// The texture, if one drives it.
    pub texture: Option<TextureId>,
    /// The constant, or the texture's factor.
    pub factor: T,
    /// Which number of the texture a number is.
    pub channel: Channel,
    /// Added to a number after the factor.
    pub bias: f32,
}

impl<T> Param<T> {
    /// The same everywhere.
    pub(crate) fn constant(factor: T) -> Self {
        Param { texture: None, factor, channel: Channel::R, bias: 0.0 }
    }
}

impl Param<Rgb> {
    /// The colour at a surface.
    #[inline]
    pub fn color(&self, si: &SurfaceInteraction, textures: &[Texture]) -> Rgb {
        self.color_and_alpha(si, textures).0
    }

    /// The colour at a surface, and the alpha of its texture; 1 without one.
    #[inline]
    pub fn color_and_alpha(&self, si: &SurfaceInteraction, textures: &[Texture]) -> (Rgb, f32) {
        match self.texture {
            None => (self.factor, 1.0),
            Some(id) => {
                let [r, g, b, a] = textures[id.index()].value(si, 1.0);
                (Rgb::new(r, g, b) * self.factor, a)
            }
        }
    }
}

impl Param<f32> {
    /// The number at a surface: the texture's channel times the factor, and the bias.
    ///
    /// `scale`: see [`Texture::value`].
    #[inline]
    pub fn number(&self, si: &SurfaceInteraction, textures: &[Texture], scale: f32) -> f32 {
        match self.texture {
            None => self.factor,
            Some(id) => self.of(textures[id.index()].value(si, scale)),
        }
    }

    /// How it changes with u and with v at a surface: half a pixel's footprint, or half a texel if that is longer, to
    /// each side, and no farther than the surface goes.
    pub(crate) fn slopes(&self, si: &SurfaceInteraction, textures: &[Texture]) -> [f32; 2] {
        let Some(texture) = self.texture.map(|id| &textures[id.index()]) else { return [0.0; 2] };
        let (uv, footprint) = si.texture_point(texture.uv_set);
        let Footprint { dx, dy, edges } = footprint;
        let scale = si.footprints_per_pixel;
        let reach = ((dx.abs() + dy.abs()) * scale).max(texture.texel()).max(Vec2::splat(LEAST_REACH)) * 0.5;
        let number = |uv: Vec2| self.of(texture.around(uv, &footprint, scale));
        let slope = |axis: usize| {
            let (mut low, mut high) = (uv, uv);
            (low[axis], high[axis]) = (low[axis] - reach[axis], high[axis] + reach[axis]);
            if edges[axis] == UvEdge::Bounded {
                (low[axis], high[axis]) = (low[axis].max(0.0), high[axis].min(1.0));
            }
            let way = high[axis] - low[axis];
            if way > 0.0 { (number(high) - number(low)) / way } else { 0.0 }
        };
        [slope(0), slope(1)]
    }

    /// The number that it takes from the value of its texture.
    #[inline]
    pub fn of(&self, value: [f32; 4]) -> f32 {
        pyramid::number(value, self.channel) * self.factor + self.bias
    }
}
