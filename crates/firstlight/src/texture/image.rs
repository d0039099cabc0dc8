//! Pictures as textures.

use std::sync::Arc;

use glam::DVec2;

use crate::color::{Encoding, Rgb};
use crate::context::CompileContext;
use crate::describe::{ColorDesc, FilePath, table, words};
use crate::image::read::{TexelData, Texels};
use crate::math::Vec2;

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
    /// A picture, PNG or JPEG. Row 0 of the picture is v = 1; texel centres are at (i + 1/2) / width.
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
        pub filter: Filter = Filter::Bilinear,
        /// What the picture's numbers mean; without it, `srgb` where it colours and `raw` where it is a number.
        pub space: Option<TextureSpace> = None,
        /// The colour beyond the edges under `border`.
        pub border: ColorDesc = ColorDesc::BLACK,
        /// The picture's coordinate is uv x scale + offset; each number from -1e6 to 1e6.
        pub scale: [f64; 2] = [1.0, 1.0],
        /// See `scale`.
        pub offset: [f64; 2] = [0.0, 0.0],
    }
}

/// A picture, ready to be looked up.
#[derive(Clone, Debug)]
pub struct ImageTexture {
    texels: Arc<Texels>,
    decode: Arc<[f32]>,
    wrap: [Wrap; 2],
    filter: Filter,
    border: Rgb,
    scale: DVec2,
    offset: DVec2,
}

impl ImageTextureDesc {
    /// `space`: what the numbers mean where the description does not say.
    pub(crate) fn compile(&self, cx: &mut CompileContext, texels: Arc<Texels>, space: TextureSpace) -> ImageTexture {
        for i in 0..2 {
            let hint = Some("the picture's coordinate is uv x scale + offset");
            cx.between(&format!("scale[{i}]"), self.scale[i], -MAX_SCALE, MAX_SCALE, hint);
            cx.between(&format!("offset[{i}]"), self.offset[i], -MAX_SCALE, MAX_SCALE, hint);
        }
        let space = self.space.unwrap_or(space);
        let steps = match texels.data {
            TexelData::Rgb8(_) => 256,
            TexelData::Rgb16(_) => 65536,
        };
        let decode = (0..steps).map(|i| {
            let stored = i as f64 / (steps - 1) as f64;
            (match space {
                TextureSpace::Srgb => Encoding::Srgb.decode(stored),
                TextureSpace::Raw => stored,
            }) as f32
        });
        ImageTexture {
            decode: decode.collect(),
            texels,
            wrap: self.wrap,
            filter: self.filter,
            border: cx.color("border", self.border),
            scale: DVec2::from(self.scale),
            offset: DVec2::from(self.offset),
        }
    }
}

const MAX_SCALE: f64 = 1e6;

impl ImageTexture {
    /// The picture at `uv`, linear.
    pub fn color(&self, uv: Vec2) -> Rgb {
        // In texels; row 0 of the picture is v = 1. In f64: a repeated picture has coordinates far from 0
        let at = uv.as_dvec2() * self.scale + self.offset;
        let (x, y) = (at.x * self.texels.width as f64, (1.0 - at.y) * self.texels.height as f64);
        match self.filter {
            Filter::Nearest => self.texel(x.floor() as i64, y.floor() as i64),
            Filter::Bilinear => {
                let (x, y) = (x - 0.5, y - 0.5);
                let (i, j) = (x.floor(), y.floor());
                let (s, t) = ((x - i) as f32, (y - j) as f32);
                let (i, j) = (i as i64, j as i64);
                let row = |j: i64| self.texel(i, j) * (1.0 - s) + self.texel(i + 1, j) * s;
                row(j) * (1.0 - t) + row(j + 1) * t
            }
        }
    }

    /// The texel in column `i`, row `j`, which may lie beyond the picture.
    fn texel(&self, i: i64, j: i64) -> Rgb {
        let (Some(i), Some(j)) = (self.wrap[0].index(i, self.texels.width), self.wrap[1].index(j, self.texels.height))
        else {
            return self.border;
        };
        let at = j * self.texels.width as usize + i;
        let d = |v: usize| self.decode[v];
        match &self.texels.data {
            TexelData::Rgb8(data) => {
                let [r, g, b] = data[at];
                Rgb::new(d(r.into()), d(g.into()), d(b.into()))
            }
            TexelData::Rgb16(data) => {
                let [r, g, b] = data[at];
                Rgb::new(d(r.into()), d(g.into()), d(b.into()))
            }
        }
    }
}

impl Wrap {
    /// The texel of `size` that stands at `i`; `None` on the border.
    fn index(self, i: i64, size: u32) -> Option<usize> {
        let size = size as i64;
        let wrapped = match self {
            Wrap::Repeat => i.rem_euclid(size),
            Wrap::Mirror => {
                let k = i.rem_euclid(2 * size);
                k.min(2 * size - 1 - k)
            }
            Wrap::Clamp => i.clamp(0, size - 1),
            Wrap::Border => i,
        };
        (0..size).contains(&wrapped).then_some(wrapped as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2 x 2: red, green over blue, white.
    fn four(filter: Filter, wrap: Wrap) -> ImageTexture {
        let data = vec![[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];
        let texels = Texels { width: 2, height: 2, data: TexelData::Rgb8(data) };
        let desc = ImageTextureDesc {
            filter,
            wrap: [wrap; 2],
            border: ColorDesc::gray(0.5),
            space: None,
            file: FilePath("four.png".into()),
            scale: [1.0, 1.0],
            offset: [0.0, 0.0],
        };
        desc.compile(&mut CompileContext::default(), Arc::new(texels), TextureSpace::Raw)
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
