//! Texels as a level of a pyramid stores them: in tiles, in as few bits as the picture has.

use std::sync::LazyLock;

use super::TextureSpace;
use crate::color::Encoding;
use crate::parallel;

/// Texels on a side of a tile: 16 of 4 bytes are one line of a processor's cache.
const TILE: usize = 4;

/// Added to the alpha that weights a colour. Where all texels are transparent the colour is their plain mean, and
/// beside a texel of alpha 1/255 it moves by 6 % at most. A power of two: 0 and 1 come back exactly.
const LEAST_WEIGHT: f32 = 1.0 / 4096.0;

/// What stored numbers stand for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tables {
    /// Of a colour's channel of 8 bits.
    color8: &'static [f32; 256],
    /// Of 16 bits.
    color16: &'static [f32],
    /// Of alpha of 8 bits.
    unit8: &'static [f32; 256],
    encode8: &'static Encode8,
}

static RAW8: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| decode(TextureSpace::Raw, i, 255)));
static SRGB8: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| decode(TextureSpace::Srgb, i, 255)));
static RAW16: LazyLock<Vec<f32>> = LazyLock::new(|| (0..65536).map(|i| decode(TextureSpace::Raw, i, 65535)).collect());
static SRGB16: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..65536).map(|i| decode(TextureSpace::Srgb, i, 65535)).collect());
static ENCODE_RAW8: LazyLock<Encode8> = LazyLock::new(|| Encode8::new(&RAW8));
static ENCODE_SRGB8: LazyLock<Encode8> = LazyLock::new(|| Encode8::new(&SRGB8));

/// What step `i` of `most` stands for, linear.
fn decode(space: TextureSpace, i: usize, most: u32) -> f32 {
    let stored = i as f64 / f64::from(most);
    (match space {
        TextureSpace::Srgb => Encoding::Srgb.decode(stored),
        TextureSpace::Raw => stored,
    }) as f32
}

impl Tables {
    pub(super) fn new(space: TextureSpace) -> Self {
        let (color8, color16, encode8) = match space {
            TextureSpace::Srgb => (&SRGB8, &SRGB16, &ENCODE_SRGB8),
            TextureSpace::Raw => (&RAW8, &RAW16, &ENCODE_RAW8),
        };
        Tables { color8, color16, unit8: &RAW8, encode8 }
    }
}

/// From linear numbers to the nearest of the 256 that 8 bits stand for.
#[derive(Debug)]
struct Encode8 {
    /// The middle between step i and the next, linear.
    middles: [f32; 255],
    /// How many middles lie below i / 4096.
    below: Vec<u8>,
}

impl Encode8 {
    const STEPS: usize = 4096;

    fn new(decoded: &[f32; 256]) -> Self {
        let middles: [f32; 255] = std::array::from_fn(|i| 0.5 * (decoded[i] + decoded[i + 1]));
        let below = |i: usize| middles.partition_point(|middle| *middle < i as f32 / Self::STEPS as f32) as u8;
        Encode8 { middles, below: (0..Self::STEPS).map(below).collect() }
    }

    fn of(&self, linear: f32) -> u8 {
        let first = ((linear * Self::STEPS as f32) as usize).min(Self::STEPS - 1);
        let mut step = usize::from(self.below[first]);
        while step < 255 && self.middles[step] <= linear {
            step += 1;
        }
        step as u8
    }
}

/// The nearest entry of a table that ascends.
fn nearest(table: &[f32], linear: f32) -> u16 {
    let above = table.partition_point(|entry| *entry < linear).clamp(1, table.len() - 1);
    let below = above - 1;
    (if linear - table[below] < table[above] - linear { below } else { above }) as u16
}

/// A texel as it is stored. What is read are numbers that may be summed: red, green, blue and alpha, linear; of a
/// [`Covered`] one colours times a weight, and the weight.
pub(super) trait Texel: Copy + Default + Send + Sync {
    fn read(self, tables: &Tables) -> [f32; 4];

    /// The nearest to a mean of what was read.
    fn write(mean: [f32; 4], tables: &Tables) -> Self;
}

impl Texel for u8 {
    #[inline(always)]
    fn read(self, tables: &Tables) -> [f32; 4] {
        let v = tables.color8[usize::from(self)];
        [v, v, v, 1.0]
    }

    fn write([v, ..]: [f32; 4], tables: &Tables) -> Self {
        tables.encode8.of(v)
    }
}

impl Texel for u16 {
    #[inline(always)]
    fn read(self, tables: &Tables) -> [f32; 4] {
        let v = tables.color16[usize::from(self)];
        [v, v, v, 1.0]
    }

    fn write([v, ..]: [f32; 4], tables: &Tables) -> Self {
        nearest(tables.color16, v)
    }
}

impl Texel for [u8; 3] {
    #[inline(always)]
    fn read(self, tables: &Tables) -> [f32; 4] {
        let [r, g, b] = self.map(|v| tables.color8[usize::from(v)]);
        [r, g, b, 1.0]
    }

    fn write([r, g, b, _]: [f32; 4], tables: &Tables) -> Self {
        [r, g, b].map(|v| tables.encode8.of(v))
    }
}

impl Texel for [u16; 3] {
    #[inline(always)]
    fn read(self, tables: &Tables) -> [f32; 4] {
        let [r, g, b] = self.map(|v| tables.color16[usize::from(v)]);
        [r, g, b, 1.0]
    }

    fn write([r, g, b, _]: [f32; 4], tables: &Tables) -> Self {
        [r, g, b].map(|v| nearest(tables.color16, v))
    }
}

impl Texel for [u8; 4] {
    #[inline(always)]
    fn read(self, tables: &Tables) -> [f32; 4] {
        let [r, g, b, a] = self;
        let [r, g, b] = [r, g, b].map(|v| tables.color8[usize::from(v)]);
        [r, g, b, tables.unit8[usize::from(a)]]
    }

    fn write([r, g, b, a]: [f32; 4], tables: &Tables) -> Self {
        let [r, g, b] = [r, g, b].map(|v| tables.encode8.of(v));
        [r, g, b, ENCODE_RAW8.of(a)]
    }
}

impl Texel for [u16; 4] {
    #[inline(always)]
    fn read(self, tables: &Tables) -> [f32; 4] {
        let [r, g, b, a] = self;
        let [r, g, b] = [r, g, b].map(|v| tables.color16[usize::from(v)]);
        [r, g, b, f32::from(a) / 65535.0]
    }

    fn write([r, g, b, a]: [f32; 4], tables: &Tables) -> Self {
        let [r, g, b] = [r, g, b].map(|v| nearest(tables.color16, v));
        [r, g, b, nearest(&RAW16, a)]
    }
}

impl Texel for [f32; 4] {
    #[inline(always)]
    fn read(self, _: &Tables) -> [f32; 4] {
        self
    }

    fn write(mean: [f32; 4], _: &Tables) -> Self {
        mean
    }
}

/// A texel whose colour counts as much as its alpha says.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Covered<T>(pub T);

impl<T: Texel> Texel for Covered<T> {
    #[inline(always)]
    fn read(self, tables: &Tables) -> [f32; 4] {
        weighted(self.0.read(tables))
    }

    fn write(mean: [f32; 4], tables: &Tables) -> Self {
        Covered(T::write(unweighted(mean), tables))
    }
}

/// Colours times the weight of their alpha, and that weight.
#[inline(always)]
pub(super) fn weighted([r, g, b, a]: [f32; 4]) -> [f32; 4] {
    let weight = a + LEAST_WEIGHT;
    [r * weight, g * weight, b * weight, weight]
}

/// The colour and alpha of a mean of weighted ones.
#[inline(always)]
pub(super) fn unweighted([r, g, b, weight]: [f32; 4]) -> [f32; 4] {
    [r / weight, g / weight, b / weight, (weight - LEAST_WEIGHT).max(0.0)]
}

/// A normal of 8 bits as the picture has it: unit once it is read.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Normal8(pub [u8; 3]);

impl Texel for Normal8 {
    #[inline(always)]
    fn read(self, tables: &Tables) -> [f32; 4] {
        unit(self.0.map(|v| tables.unit8[usize::from(v)]))
    }

    fn write([x, y, z, _]: [f32; 4], _: &Tables) -> Self {
        Normal8([x, y, z].map(|v| ENCODE_RAW8.of(0.5 * v + 0.5)))
    }
}

/// Three numbers from 0 to 1 as a unit vector, which (0.5, 0.5, 0.5) is not: that is +z.
///
/// Source: glTF 2.0, "Material", `normalTexture`: 0 to 1 stand for -1 to 1.
#[inline(always)]
pub(super) fn unit(stored: [f32; 3]) -> [f32; 4] {
    let [x, y, z] = stored.map(|v| 2.0 * v - 1.0);
    let length = (x * x + y * y + z * z).sqrt();
    if length < 0.01 { [0.0, 0.0, 1.0, 0.0] } else { [x / length, y / length, z / length, 0.0] }
}

/// A mean of unit normals, its length kept.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Normal16([i16; 3]);

impl Texel for Normal16 {
    #[inline(always)]
    fn read(self, _: &Tables) -> [f32; 4] {
        let [x, y, z] = self.0.map(|v| f32::from(v) * (1.0 / 32767.0));
        [x, y, z, 0.0]
    }

    fn write([x, y, z, _]: [f32; 4], _: &Tables) -> Self {
        Normal16([x, y, z].map(|v| (v * 32767.0).round() as i16))
    }
}

/// The texels of a level, tile by tile, each row by row.
#[derive(Clone, Debug)]
pub(super) enum Stored {
    Gray8(Vec<u8>),
    Rgb8(Vec<[u8; 3]>),
    Rgba8(Vec<[u8; 4]>),
    Covered8(Vec<Covered<[u8; 4]>>),
    Gray16(Vec<u16>),
    Rgb16(Vec<[u16; 3]>),
    Rgba16(Vec<[u16; 4]>),
    Covered16(Vec<Covered<[u16; 4]>>),
    Float(Vec<[f32; 4]>),
    CoveredFloat(Vec<Covered<[f32; 4]>>),
    Normal8(Vec<Normal8>),
    Normal16(Vec<Normal16>),
}

/// Runs the same code for each kind of texel.
macro_rules! of_texels {
    ($stored:expr, $texels:ident => $code:expr) => {
        match $stored {
            $crate::texture::texels::Stored::Gray8($texels) => $code,
            $crate::texture::texels::Stored::Rgb8($texels) => $code,
            $crate::texture::texels::Stored::Rgba8($texels) => $code,
            $crate::texture::texels::Stored::Covered8($texels) => $code,
            $crate::texture::texels::Stored::Gray16($texels) => $code,
            $crate::texture::texels::Stored::Rgb16($texels) => $code,
            $crate::texture::texels::Stored::Rgba16($texels) => $code,
            $crate::texture::texels::Stored::Covered16($texels) => $code,
            $crate::texture::texels::Stored::Float($texels) => $code,
            $crate::texture::texels::Stored::CoveredFloat($texels) => $code,
            $crate::texture::texels::Stored::Normal8($texels) => $code,
            $crate::texture::texels::Stored::Normal16($texels) => $code,
        }
    };
}
pub(super) use of_texels;

/// One level of a pyramid.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) texels: Stored,
}

impl Level {
    /// A level with the texels that `at` gives for column and row.
    pub(super) fn new<T: Texel>(
        [width, height]: [usize; 2],
        store: impl FnOnce(Vec<T>) -> Stored,
        at: impl Fn(usize, usize) -> T + Sync,
    ) -> Self {
        let across = tiles(width);
        let mut texels = vec![T::default(); across * tiles(height) * TILE * TILE];
        parallel::for_each_chunk(&mut texels, across * TILE * TILE, |row, tiles| {
            for (i, tile) in tiles.chunks_mut(TILE * TILE).enumerate() {
                for (k, texel) in tile.iter_mut().enumerate() {
                    let (x, y) = (i * TILE + k % TILE, row * TILE + k / TILE);
                    // A tile may reach beyond the level
                    *texel = at(x.min(width - 1), y.min(height - 1));
                }
            }
        });
        Level { width, height, texels: store(texels) }
    }

    /// Where in the list the texel in column `i`, row `j` stands, is the sum of these two.
    #[inline(always)]
    pub(super) fn column(i: usize) -> usize {
        i / TILE * (TILE * TILE) + i % TILE
    }

    /// See [`Level::column`].
    #[inline(always)]
    pub(super) fn row(&self, j: usize) -> usize {
        j / TILE * (tiles(self.width) * TILE * TILE) + j % TILE * TILE
    }

    /// Bytes of its texels.
    pub(super) fn bytes(&self) -> u64 {
        of_texels!(&self.texels, texels => size_of_val(texels.as_slice()) as u64)
    }
}

/// Tiles along a side.
#[inline(always)]
fn tiles(size: usize) -> usize {
    size.div_ceil(TILE)
}

/// Texels of a level of that size with the padding of its tiles.
pub(super) fn padded(width: u64, height: u64) -> u64 {
    let tile = TILE as u64;
    width.div_ceil(tile) * height.div_ceil(tile) * tile * tile
}
