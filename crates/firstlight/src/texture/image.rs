//! Pictures as textures.

use std::sync::Arc;

use glam::{DMat2, DVec2};

use super::check_uv_set;
use super::filter::{Beyond, TexturePlace};
use super::pyramid::Pyramid;
use crate::context::CompileContext;
use crate::describe::{ColorDesc, FilePath, table, words};
use crate::math::{Vec2, sin_cos_of_turns};
use crate::shape::{Footprint, UvEdge};

words! {
    /// What a picture shows beyond its edges.
    pub enum Wrap {
        /// The picture again.
        Repeat = "repeat",
        /// The picture mirrored, then again.
        Mirror = "mirror",
        /// Its outermost texels.
        Clamp = "clamp",
        /// The `border` colour.
        Border = "border",
    }
}

words! {
    /// How a value is made from texels.
    pub enum Filter {
        /// The texel that holds the point.
        Nearest = "nearest",
        /// The four nearest texel centres, weighted by distance.
        Bilinear = "bilinear",
        /// Bilinear on the two smaller pictures whose texels are nearest to the footprint's longer axis in size.
        Trilinear = "trilinear",
        /// The texels in the ellipse that the footprint is, of ratios up to 16, weighted by their distance; bilinear
        /// where a texel is larger than the footprint.
        Anisotropic = "anisotropic",
    }
}

words! {
    /// What the picture's numbers mean.
    pub enum TextureSpace {
        /// Display-encoded colour, decoded to linear before filtering.
        Srgb = "srgb",
        /// Data, taken as it is: 0 to 1.
        Raw = "raw",
    }
}

table! {
    /// A picture: PNG, JPEG, WebP, TGA, BMP, GIF, TIFF, QOI, PNM, Radiance HDR or OpenEXR. Row 0 of the picture is
    /// v = 1; texel centres are at (i + 1/2) / width. Its coordinate is uv x scale, turned by `rotate_deg`, + offset.
    ///
    /// ```toml
    /// [texture.image.bricks]
    /// file = "bricks.png"
    /// wrap = ["repeat", "clamp"]
    /// scale = [4, 4]
    /// ```
    pub struct ImageTextureDesc {
        /// The file, relative to the text that names it.
        pub file: FilePath,
        /// Beyond the edges, along u and v.
        pub wrap: [Wrap; 2] = [Wrap::Repeat, Wrap::Repeat],
        /// How a value is made from texels.
        pub filter: Filter = Filter::Anisotropic,
        /// What the picture's numbers mean; without it, `srgb` where it colours and `raw` where it is a number.
        pub color_space: Option<TextureSpace> = None,
        /// The colour beyond the edges under `border`.
        pub border: ColorDesc = ColorDesc::BLACK,
        /// Multiplies u and v, before all else; each number from -1e6 to 1e6.
        pub scale: [f64; 2] = [1.0, 1.0],
        /// Turns the scaled coordinate around (0, 0), from u towards v, in degrees; from -36000 to 36000.
        pub rotate_deg: f64 = 0.0,
        /// Added to the coordinate, after all else; each number from -1e6 to 1e6.
        pub offset: [f64; 2] = [0.0, 0.0],
        /// Which set of a mesh's texture coordinates the texture is laid by, 0 to 3; without it the mesh's own
        /// `uv_set`. Shapes of other kinds have set 0 alone.
        pub uv_set: Option<u32> = None,
    }
}

/// A picture, ready to be looked up.
#[derive(Clone, Debug)]
pub struct ImageTexture {
    pub(super) pyramid: Arc<Pyramid>,
    filter: Filter,
    beyond: Beyond,
    /// The picture's coordinate is this times uv, + offset.
    turn: DMat2,
    offset: DVec2,
    /// Whether the coordinate turns u into v.
    is_turned: bool,
}

impl ImageTextureDesc {
    /// Finds its faults, but for those of its file.
    pub(crate) fn check(&self, cx: &mut CompileContext) {
        for i in 0..2 {
            let hint = Some("the picture's coordinate is uv x scale, turned, + offset");
            cx.between(&format!("scale[{i}]"), self.scale[i], -MAX_SCALE, MAX_SCALE, hint);
            cx.between(&format!("offset[{i}]"), self.offset[i], -MAX_SCALE, MAX_SCALE, hint);
        }
        cx.between("rotate_deg", self.rotate_deg, -MAX_TURN, MAX_TURN, Some("in degrees"));
        cx.color("border", self.border);
        check_uv_set(cx, self.uv_set);
    }

    /// The texture, of texels that were made for one use.
    pub(crate) fn texture(&self, pyramid: Arc<Pyramid>) -> ImageTexture {
        let (sin, cos) = sin_cos_of_turns(self.rotate_deg / 360.0);
        let [u, v] = self.scale;
        let [r, g, b] = self.border.linear.map(|c| c as f32);
        ImageTexture {
            pyramid,
            filter: self.filter,
            beyond: Beyond { wrap: self.wrap, border: [r, g, b, 1.0] },
            turn: DMat2::from_cols(DVec2::new(cos, sin) * u, DVec2::new(-sin, cos) * v),
            offset: DVec2::from(self.offset),
            is_turned: sin != 0.0,
        }
    }
}

const MAX_SCALE: f64 = 1e6;
/// Degrees; a hundred times around.
const MAX_TURN: f64 = 36000.0;

impl ImageTexture {
    /// Its texels.
    #[cfg(test)]
    pub(crate) fn pyramid(&self) -> &Arc<Pyramid> {
        &self.pyramid
    }

    /// Red, green, blue and alpha at `uv`, over a footprint that is `scale` times as large.
    pub fn value(&self, uv: Vec2, footprint: &Footprint, scale: f32) -> [f32; 4] {
        let place = self.place(uv, footprint, scale);
        if self.pyramid.mask.is_some() {
            return [self.pyramid.share(self.filter, &place, &self.beyond); 4];
        }
        self.pyramid.value(self.filter, &place, &self.beyond)
    }

    /// How many texels the longer side of a footprint is that is `scale` times as large.
    pub(super) fn texels_across(&self, uv: Vec2, footprint: &Footprint, scale: f32) -> f32 {
        let [across, down] = self.place(uv, footprint, scale).steps;
        across.length_squared().max(down.length_squared()).sqrt() as f32
    }

    /// The sides of a texel in u and in v.
    pub(super) fn texel(&self) -> Vec2 {
        let size = DVec2::from(self.pyramid.size().map(f64::from));
        let texels = |way: DVec2| (way * size).length().max(f64::MIN_POSITIVE);
        DVec2::new(1.0 / texels(self.turn.x_axis), 1.0 / texels(self.turn.y_axis)).as_vec2()
    }

    /// Of a picture for a mask: whether it is solid at a point.
    pub(crate) fn is_solid(&self, uv: Vec2) -> bool {
        self.pyramid.is_solid(self.filter, self.texels_at(uv), &self.beyond)
    }

    /// A texture coordinate in texels of the picture, whose row 0 is v = 1. In f64: a repeated picture has coordinates
    /// far from 0.
    #[inline(always)]
    fn texels_at(&self, uv: Vec2) -> DVec2 {
        let [width, height] = self.pyramid.size().map(f64::from);
        let at = self.turn * uv.as_dvec2() + self.offset;
        DVec2::new(at.x * width, (1.0 - at.y) * height)
    }

    fn place(&self, uv: Vec2, footprint: &Footprint, scale: f32) -> TexturePlace {
        let size = self.pyramid.size().map(f64::from);
        let step = |step: Vec2| self.turn * (step.as_dvec2() * f64::from(scale)) * DVec2::new(size[0], -size[1]);
        // Where the surface ends, nothing beyond counts
        let within = [0, 1].map(|axis| {
            if footprint.edges[axis] != UvEdge::Bounded || self.is_turned {
                return None;
            }
            let ends = [0.0, 1.0].map(|end| {
                let end = end * self.turn.col(axis)[axis] + self.offset[axis];
                if axis == 0 { end * size[0] } else { (1.0 - end) * size[1] }
            });
            Some([ends[0].min(ends[1]), ends[0].max(ends[1])])
        });
        TexturePlace { at: self.texels_at(uv), steps: [step(footprint.dx), step(footprint.dy)], within }
    }
}

#[cfg(test)]
mod tests {
    use super::super::pyramid::TextureUse;
    use super::*;
    use crate::color::Rgb;
    use crate::image::read::{TexelSamples, Texels};

    /// 2 x 2: red, green over blue, white.
    fn four(filter: Filter, wrap: Wrap) -> ImageTexture {
        let data = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];
        let data = TexelSamples::U8(data.as_flattened().to_vec());
        let texels = Texels { width: 2, height: 2, channels: 3, data };
        let desc = ImageTextureDesc {
            filter,
            wrap: [wrap; 2],
            border: ColorDesc::gray(0.5),
            ..ImageTextureDesc::new(FilePath("four.png".into()))
        };
        desc.texture(Arc::new(Pyramid::new(&texels, TextureUse::Color(TextureSpace::Raw))))
    }

    impl ImageTexture {
        fn color(&self, uv: Vec2) -> Rgb {
            let none = Footprint { dx: Vec2::ZERO, dy: Vec2::ZERO, edges: [UvEdge::Unbounded; 2] };
            let [r, g, b, a] = self.value(uv, &none, 1.0);
            assert_eq!(a, 1.0);
            Rgb::new(r, g, b)
        }
    }

    #[test]
    fn row_0_is_the_top() {
        let t = four(Filter::Nearest, Wrap::Clamp);
        assert_eq!(t.color(Vec2::new(0.1, 0.9)), Rgb::new(1.0, 0.0, 0.0));
        assert_eq!(t.color(Vec2::new(0.9, 0.9)), Rgb::new(0.0, 1.0, 0.0));
        assert_eq!(t.color(Vec2::new(0.1, 0.1)), Rgb::new(0.0, 0.0, 1.0));
        assert_eq!(t.color(Vec2::new(0.9, 0.1)), Rgb::WHITE);
    }

    #[test]
    fn texel_centres_are_exact_and_the_middle_is_the_mean() {
        let t = four(Filter::Bilinear, Wrap::Clamp);
        assert_eq!(t.color(Vec2::new(0.25, 0.75)), Rgb::new(1.0, 0.0, 0.0));
        assert_eq!(t.color(Vec2::new(0.5, 0.5)), Rgb::gray(0.5));
    }

    #[test]
    fn beyond_the_edges() {
        let left = |wrap| four(Filter::Nearest, wrap).color(Vec2::new(-0.1, 0.9));
        assert_eq!(left(Wrap::Repeat), Rgb::new(0.0, 1.0, 0.0));
        assert_eq!(left(Wrap::Mirror), Rgb::new(1.0, 0.0, 0.0));
        assert_eq!(left(Wrap::Clamp), Rgb::new(1.0, 0.0, 0.0));
        assert_eq!(left(Wrap::Border), Rgb::gray(0.5));
        // The picture, its mirror image, the picture
        let indices: Vec<_> = (-3..6).map(|i| Wrap::Mirror.index(i, 3)).collect();
        assert_eq!(indices, [2, 1, 0, 0, 1, 2, 2, 1, 0].map(Some));
    }
}
