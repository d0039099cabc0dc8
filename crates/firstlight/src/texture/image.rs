//! Pictures as textures.

use crate::describe::{ColorDesc, FilePath, table, words};

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
        /// The picture's coordinate is uv x scale + offset.
        pub scale: [f64; 2] = [1.0, 1.0],
        /// See `scale`.
        pub offset: [f64; 2] = [0.0, 0.0],
    }
}
