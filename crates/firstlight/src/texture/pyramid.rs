//! Mip pyramids: a picture, and smaller ones made of it, each half as large as the one before.
//!
//! Every level is made from the numbers of the one below before those are rounded to what is stored: linear, with a box
//! filter. Sides that are odd take three texels for one, each as far as it lies within (the polyphase box of Guthe and
//! Heckbert, "Non-power-of-two mipmap creation", NVIDIA 2005), so that no level is shifted against another.

use super::TextureSpace;
use super::texels::{Covered, Level, Normal8, Normal16, Stored, Tables, Texel, of_texels, padded, unit};
use crate::describe::Channel;
use crate::image::read::{TexelSamples, Texels};
use crate::parallel;

/// What a picture is read for: the same file may be several.
#[allow(dead_code, reason = "materials with masks come next")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TextureUse {
    /// Colour; alpha is a channel of its own and hides nothing.
    Color(TextureSpace),
    /// Colour that counts as much as its alpha says: of what is transparent nothing shows.
    CoveredColor(TextureSpace),
    /// Directions: red, green and blue from 0 to 1 are x, y and z from -1 to 1.
    Normal,
    /// The share of texels at or above a cutoff.
    Mask(MaskRule),
}

/// Which texels a mask lets stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MaskRule {
    /// The number that decides.
    pub channel: Channel,
    /// What the numbers of the picture mean.
    pub space: TextureSpace,
    /// A texel whose number is at least this is solid.
    pub cutoff: f32,
}

impl MaskRule {
    /// Whether the numbers that decide are those of a picture of 8 bits as they are.
    fn keeps_bytes(&self) -> bool {
        self.channel != Channel::Luminance && self.space == TextureSpace::Raw
    }

    /// The number that decides, of red, green, blue and alpha.
    pub(crate) fn number(&self, value: [f32; 4]) -> f32 {
        number(value, self.channel)
    }
}

impl TextureUse {
    /// The bytes that tell one use from another.
    pub(crate) fn key(&self) -> [u8; 7] {
        let key = |kind: u8, space: TextureSpace, channel: u8, cutoff: f32| {
            let [a, b, c, d] = cutoff.to_bits().to_le_bytes();
            [kind, space as u8, channel, a, b, c, d]
        };
        match self {
            TextureUse::Color(space) => key(0, *space, 0, 0.0),
            TextureUse::CoveredColor(space) => key(1, *space, 0, 0.0),
            TextureUse::Normal => key(2, TextureSpace::Raw, 0, 0.0),
            TextureUse::Mask(rule) => key(3, rule.space, rule.channel as u8, rule.cutoff),
        }
    }
}

/// The levels of a picture.
#[derive(Clone, Debug)]
pub(crate) struct Pyramid {
    /// From the picture down to one texel.
    pub(super) levels: Vec<Level>,
    pub(super) tables: Tables,
    /// Whether its sums are those of weighted colours.
    pub(super) covered: bool,
    /// Of a mask: the numbers that are compared with the cutoff, and the cutoff. Its levels are shares.
    pub(super) mask: Option<(Level, f32)>,
}

impl Pyramid {
    /// The pyramid of a picture for a use. Neither side of the picture is 0.
    pub(crate) fn new(texels: &Texels, of: TextureUse) -> Self {
        let (space, covered) = match of {
            TextureUse::Color(space) => (space, false),
            TextureUse::CoveredColor(space) => (space, texels.has_alpha()),
            TextureUse::Normal => (TextureSpace::Raw, false),
            TextureUse::Mask(rule) => return Self::of_mask(texels, rule),
        };
        let tables = Tables::new(space);
        let first = if of == TextureUse::Normal { normals(texels, &tables) } else { colors(texels, covered) };
        Pyramid { levels: with_smaller(first, &tables), tables, covered, mask: None }
    }

    fn of_mask(texels: &Texels, rule: MaskRule) -> Self {
        let read = Tables::new(rule.space);
        let of_colors = colors(texels, false);
        let size = [of_colors.width, of_colors.height];
        let number = |i: usize, j: usize| number(of_colors.texel(i, j, &read), rule.channel);
        let tables = Tables::new(TextureSpace::Raw);
        let numbers = match texels.data {
            // As exact as it is stored
            TexelSamples::U8(_) if rule.keeps_bytes() => {
                Level::new(size, Stored::Gray8, |i, j| u8::write([number(i, j); 4], &tables))
            }
            _ => Level::new(size, Stored::Gray16, |i, j| u16::write([number(i, j).clamp(0.0, 1.0); 4], &tables)),
        };
        let share = |i: usize, j: usize| if number(i, j) >= rule.cutoff { 255 } else { 0 };
        let levels = with_smaller(Level::new(size, Stored::Gray8, share), &tables);
        Pyramid { levels, tables, covered: false, mask: Some((numbers, rule.cutoff)) }
    }

    /// Width and height of the picture.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.levels[0].width as u32, self.levels[0].height as u32]
    }

    /// Bytes of all levels.
    pub(crate) fn bytes(&self) -> u64 {
        let numbers = self.mask.as_ref().map(|(numbers, _)| numbers);
        self.levels.iter().chain(numbers).map(Level::bytes).sum()
    }

    /// Bytes that the pyramid of a picture of that size takes, before the picture is decoded.
    pub(crate) fn bytes_of(size: [u32; 2], channels: usize, sample_bytes: usize, of: TextureUse) -> u64 {
        let stored = if channels == 2 { 4 } else { channels };
        let (first, smaller) = match of {
            TextureUse::Color(_) | TextureUse::CoveredColor(_) if sample_bytes == 4 => (16, 16),
            TextureUse::Color(_) | TextureUse::CoveredColor(_) => (stored * sample_bytes, stored * sample_bytes),
            TextureUse::Normal => (if sample_bytes == 1 && channels > 1 { 3 } else { 6 }, 6),
            // The shares, and on the first level the numbers as well
            TextureUse::Mask(rule) => (if sample_bytes == 1 && rule.keeps_bytes() { 2 } else { 3 }, 1),
        };
        let mut bytes = 0;
        let [mut width, mut height] = size.map(|side| u64::from(side.max(1)));
        let mut texel = first;
        loop {
            bytes += padded(width, height) * texel as u64;
            if width == 1 && height == 1 {
                return bytes;
            }
            (width, height, texel) = ((width / 2).max(1), (height / 2).max(1), smaller);
        }
    }
}

/// The number that a channel takes from linear red, green, blue and alpha.
#[inline(always)]
pub(super) fn number([r, g, b, a]: [f32; 4], channel: Channel) -> f32 {
    match channel {
        Channel::R => r,
        Channel::G => g,
        Channel::B => b,
        Channel::A => a,
        Channel::Luminance => 0.2126 * r + 0.7152 * g + 0.0722 * b,
    }
}

impl Level {
    /// What is read of one texel.
    pub(super) fn texel(&self, i: usize, j: usize, tables: &Tables) -> [f32; 4] {
        of_texels!(&self.texels, texels => texels[self.row(j) + Level::column(i)].read(tables))
    }
}

/// A picture with the channels it has, as it is stored.
fn colors(texels: &Texels, covered: bool) -> Level {
    let (width, channels) = (texels.width as usize, texels.channels);
    let size = [width, texels.height as usize];
    let start = |i: usize, j: usize| (j * width + i) * channels;
    macro_rules! of_samples {
        ($s:ident, $gray:path, $rgb:path, $rgba:path, $covered:path) => {{
            let gray_alpha = |i: usize, j: usize| [0, 0, 0, 1].map(|k| $s[start(i, j) + k]);
            let rgba = |i: usize, j: usize| [0, 1, 2, 3].map(|k| $s[start(i, j) + k]);
            match (channels, covered) {
                (1, _) => Level::new(size, $gray, |i, j| $s[start(i, j)]),
                (2, false) => Level::new(size, $rgba, gray_alpha),
                (2, true) => Level::new(size, $covered, |i, j| Covered(gray_alpha(i, j))),
                (3, _) => Level::new(size, $rgb, |i, j| [0, 1, 2].map(|k| $s[start(i, j) + k])),
                (_, false) => Level::new(size, $rgba, rgba),
                (_, true) => Level::new(size, $covered, |i, j| Covered(rgba(i, j))),
            }
        }};
    }
    match &texels.data {
        TexelSamples::U8(s) => of_samples!(s, Stored::Gray8, Stored::Rgb8, Stored::Rgba8, Stored::Covered8),
        TexelSamples::U16(s) => of_samples!(s, Stored::Gray16, Stored::Rgb16, Stored::Rgba16, Stored::Covered16),
        TexelSamples::F32(s) => {
            let at = |i: usize, j: usize| {
                let texel = &s[start(i, j)..][..channels];
                match *texel {
                    [v] => [v, v, v, 1.0],
                    [v, a] => [v, v, v, a],
                    [r, g, b] => [r, g, b, 1.0],
                    _ => [texel[0], texel[1], texel[2], texel[3]],
                }
            };
            if covered {
                Level::new(size, Stored::CoveredFloat, |i, j| Covered(at(i, j)))
            } else {
                Level::new(size, Stored::Float, at)
            }
        }
    }
}

/// The first level of a normal map.
fn normals(texels: &Texels, tables: &Tables) -> Level {
    match colors(texels, false) {
        Level { width, height, texels: Stored::Rgb8(texels) } => {
            // The same bytes, read differently
            Level { width, height, texels: Stored::Normal8(texels.into_iter().map(Normal8).collect()) }
        }
        level @ Level { texels: Stored::Rgba8(_), .. } => {
            Level::new([level.width, level.height], Stored::Normal8, |i, j| {
                let [r, g, b, _] = level.texel(i, j, tables);
                Normal8(<[u8; 3]>::write([r, g, b, 1.0], tables))
            })
        }
        level => Level::new([level.width, level.height], Stored::Normal16, |i, j| {
            let [r, g, b, _] = level.texel(i, j, tables);
            Normal16::write(unit([r, g, b]), tables)
        }),
    }
}

/// A level and all smaller ones.
fn with_smaller(first: Level, tables: &Tables) -> Vec<Level> {
    let size = [first.width, first.height];
    let mut levels = vec![first];
    let mut image: Option<LevelImage> = None;
    let mut size = size;
    while size != [1, 1] {
        let next = match &image {
            Some(image) => halve(size, |i, j| image[j * size[0] + i]),
            None => {
                let level = &levels[0];
                of_texels!(&level.texels, texels => {
                    halve(size, |i, j| texels[level.row(j) + Level::column(i)].read(tables))
                })
            }
        };
        size = size.map(|side| (side / 2).max(1));
        levels.push(rounded(&levels[0].texels, size, &next, tables));
        image = Some(next);
    }
    levels
}

/// A level in numbers that are not rounded, row by row.
type LevelImage = Vec<[f32; 4]>;

/// The level, of the same kind of texel as the first, that comes nearest to an image.
fn rounded(first: &Stored, size: [usize; 2], image: &LevelImage, tables: &Tables) -> Level {
    fn of<T: Texel>(size: [usize; 2], store: fn(Vec<T>) -> Stored, image: &LevelImage, tables: &Tables) -> Level {
        Level::new(size, store, |i, j| T::write(image[j * size[0] + i], tables))
    }
    match first {
        Stored::Gray8(_) => of(size, Stored::Gray8, image, tables),
        Stored::Rgb8(_) => of(size, Stored::Rgb8, image, tables),
        Stored::Rgba8(_) => of(size, Stored::Rgba8, image, tables),
        Stored::Covered8(_) => of(size, Stored::Covered8, image, tables),
        Stored::Gray16(_) => of(size, Stored::Gray16, image, tables),
        Stored::Rgb16(_) => of(size, Stored::Rgb16, image, tables),
        Stored::Rgba16(_) => of(size, Stored::Rgba16, image, tables),
        Stored::Covered16(_) => of(size, Stored::Covered16, image, tables),
        Stored::Float(_) => of(size, Stored::Float, image, tables),
        Stored::CoveredFloat(_) => of(size, Stored::CoveredFloat, image, tables),
        Stored::Normal8(_) | Stored::Normal16(_) => of(size, Stored::Normal16, image, tables),
    }
}

/// The image of half the size: means of boxes.
fn halve([width, height]: [usize; 2], at: impl Fn(usize, usize) -> [f32; 4] + Sync) -> LevelImage {
    let half = [width, height].map(|side| (side / 2).max(1));
    let mut image = vec![[0.0; 4]; half[0] * half[1]];
    let even = width.is_multiple_of(2) && height.is_multiple_of(2);
    parallel::for_each_chunk(&mut image, half[0], |j, row| {
        if even {
            for (i, mean) in row.iter_mut().enumerate() {
                let [a, b] = [0, 1].map(|k| at(2 * i + k, 2 * j));
                let [c, d] = [0, 1].map(|k| at(2 * i + k, 2 * j + 1));
                *mean = std::array::from_fn(|k| ((a[k] + b[k]) + (c[k] + d[k])) * 0.25);
            }
            return;
        }
        let rows = taps(j, height);
        for (i, mean) in row.iter_mut().enumerate() {
            let columns = taps(i, width);
            for (y, of_row) in rows.iter().filter(|tap| tap.1 > 0.0) {
                for (x, of_column) in columns.iter().filter(|tap| tap.1 > 0.0) {
                    let texel = at(*x, *y);
                    for (sum, v) in mean.iter_mut().zip(texel) {
                        *sum += v * (of_row * of_column);
                    }
                }
            }
        }
    });
    image
}

/// The texels of a side of `size` that texel `i` of the half side is the mean of, and the part of each.
fn taps(i: usize, size: usize) -> [(usize, f32); 3] {
    let (half, n) = (size / 2, size as f32);
    if size == 1 {
        [(0, 1.0), (0, 0.0), (0, 0.0)]
    } else if size.is_multiple_of(2) {
        [(2 * i, 0.5), (2 * i + 1, 0.5), (2 * i, 0.0)]
    } else {
        [(2 * i, (half - i) as f32 / n), (2 * i + 1, half as f32 / n), (2 * i + 2, (i + 1) as f32 / n)]
    }
}
