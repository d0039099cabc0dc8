//! Pictures for textures in the formats that the `image` crate reads, and in HDR and EXR.
//!
//! TexelSamples stay as they are stored: no profile, no gamma, no orientation is applied. Of an animation the first
//! picture is taken. HDR and EXR are linear; what is negative or no number is 0.

use std::io::Cursor;

use ::image as codec;
use codec::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::ImageError;
use super::contain::contained;
use super::read::{Limits, PictureHeader, SHORT, TexelSamples, Texels, check_size};
use super::stored::StoredImage;

/// The kinds of files that are read as textures, in the words of errors.
pub(super) const KINDS: &str = "PNG, JPEG, WebP, TGA, BMP, GIF, TIFF, QOI, PNM, HDR or EXR";

/// A format, by the first bytes of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ForeignPicture {
    Coded(ImageFormat, &'static str),
    Hdr,
    Exr,
}

impl ForeignPicture {
    /// `None` for files of no known kind.
    pub(super) fn of(bytes: &[u8]) -> Option<Self> {
        let starts = |magic: &[u8]| bytes.starts_with(magic);
        Some(match bytes {
            _ if starts(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") => {
                ForeignPicture::Coded(ImageFormat::WebP, "WebP")
            }
            _ if starts(b"GIF87a") || starts(b"GIF89a") => ForeignPicture::Coded(ImageFormat::Gif, "GIF"),
            _ if starts(b"II*\0") || starts(b"MM\0*") => ForeignPicture::Coded(ImageFormat::Tiff, "TIFF"),
            _ if starts(b"BM") => ForeignPicture::Coded(ImageFormat::Bmp, "BMP"),
            _ if starts(b"qoif") => ForeignPicture::Coded(ImageFormat::Qoi, "QOI"),
            &[b'P', b'1'..=b'7', blank, ..] if blank.is_ascii_whitespace() || blank == b'#' => {
                ForeignPicture::Coded(ImageFormat::Pnm, "PNM")
            }
            _ if starts(b"#?RADIANCE\n") || starts(b"#?RGBE\n") => ForeignPicture::Hdr,
            _ if starts(&[0x76, 0x2f, 0x31, 0x01]) => ForeignPicture::Exr,
            _ if is_tga(bytes) => ForeignPicture::Coded(ImageFormat::Tga, "TGA"),
            _ => return None,
        })
    }

    /// Size and channels, before anything is decoded.
    pub(super) fn header(self, bytes: &[u8], limits: &Limits) -> Result<PictureHeader, ImageError> {
        match self {
            ForeignPicture::Coded(format, name) => contained(name, || {
                let decoder = decoder(bytes, format, name)?;
                let (width, height) = decoder.dimensions();
                check_size(width, height, limits)?;
                check_length(format, name, u64::from(width) * u64::from(height), bytes.len())?;
                let (channels, sample) = kind(decoder.color_type());
                Ok(PictureHeader { width, height, channels, sample })
            }),
            ForeignPicture::Hdr => contained("HDR", || {
                let (width, height, _) = super::hdr::header(&radiance(bytes)).ok_or_else(|| no_header("HDR"))?;
                check_size(width, height, limits)?;
                Ok(PictureHeader { width, height, channels: 3, sample: 4 })
            }),
            ForeignPicture::Exr => exr_header(bytes, limits),
        }
    }

    /// The picture.
    pub(super) fn decode(self, bytes: &[u8], limits: &Limits) -> Result<Texels, ImageError> {
        let PictureHeader { width, height, channels, .. } = self.header(bytes, limits)?;
        let data = match self {
            ForeignPicture::Coded(format, name) => contained(name, || {
                let decoded = DynamicImage::from_decoder(decoder(bytes, format, name)?);
                decoded.map(samples).map_err(|error| damaged(name, &error))
            })?,
            ForeignPicture::Hdr | ForeignPicture::Exr => {
                let pixels = if self == ForeignPicture::Hdr {
                    StoredImage::read(&radiance(bytes))?.pixels
                } else {
                    StoredImage::read(bytes)?.pixels
                };
                // Light is not negative
                let number = |v: f32| if v > 0.0 { v.min(MAX_FLOAT) } else { 0.0 };
                TexelSamples::F32(
                    pixels.iter().flat_map(|pixel| pixel[..channels].iter().copied().map(number)).collect(),
                )
            }
        };
        data.fill(width, height, channels)
            .ok_or_else(|| ImageError::Damaged { format: self.name(), reason: "rows are missing".into() })
    }

    fn name(self) -> &'static str {
        match self {
            ForeignPicture::Coded(_, name) => name,
            ForeignPicture::Hdr => "HDR",
            ForeignPicture::Exr => "EXR",
        }
    }
}

/// Refuses what is too short for its size, so that memory is not taken for what is not there: a byte of a QOI file is
/// at most a run of 62 texels, one of a PNM file at most 8 texels of one bit.
fn check_length(format: ImageFormat, name: &'static str, texels: u64, bytes: usize) -> Result<(), ImageError> {
    let each = match format {
        ImageFormat::Qoi => 62,
        ImageFormat::Pnm => 8,
        _ => return Ok(()),
    };
    if texels > each * bytes as u64 {
        return Err(ImageError::Damaged { format: name, reason: SHORT.into() });
    }
    Ok(())
}

/// The largest number of a texel: that of a half float, so that sums of texels are finite.
const MAX_FLOAT: f32 = 65504.0;

/// A Radiance file with the first line that ours have.
fn radiance(bytes: &[u8]) -> std::borrow::Cow<'_, [u8]> {
    match bytes.strip_prefix(b"#?RGBE\n") {
        Some(rest) => [b"#?RADIANCE\n", rest].concat().into(),
        None => bytes.into(),
    }
}

#[cfg(feature = "exr")]
fn exr_header(bytes: &[u8], limits: &Limits) -> Result<PictureHeader, ImageError> {
    contained("EXR", || {
        let meta = ::exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false);
        let meta = meta.map_err(|e| ImageError::Damaged { format: "EXR", reason: e.to_string() })?;
        let header = meta.headers.first().ok_or_else(|| no_header("EXR"))?;
        let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let (width, height) = (side(header.layer_size.x()), side(header.layer_size.y()));
        check_size(width, height, limits)?;
        let has_alpha = header.channels.list.iter().any(|channel| channel.name.eq("A"));
        Ok(PictureHeader { width, height, channels: if has_alpha { 4 } else { 3 }, sample: 4 })
    })
}

#[cfg(not(feature = "exr"))]
fn exr_header(_: &[u8], _: &Limits) -> Result<PictureHeader, ImageError> {
    Err(ImageError::WithoutExr)
}

fn no_header(format: &'static str) -> ImageError {
    ImageError::Damaged { format, reason: "its header is of no known make".into() }
}

fn damaged(format: &'static str, error: &codec::ImageError) -> ImageError {
    ImageError::Damaged { format, reason: error.to_string() }
}

fn decoder<'b>(bytes: &'b [u8], format: ImageFormat, name: &'static str) -> Result<impl ImageDecoder + 'b, ImageError> {
    let reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.into_decoder().map_err(|error| damaged(name, &error))
}

/// Channels, and bytes of a sample.
fn kind(color: ColorType) -> (usize, usize) {
    let channels = usize::from(color.channel_count());
    (channels, usize::from(color.bytes_per_pixel()) / channels.max(1))
}

fn samples(image: DynamicImage) -> TexelSamples {
    match image {
        DynamicImage::ImageLuma8(image) => TexelSamples::U8(image.into_raw()),
        DynamicImage::ImageLumaA8(image) => TexelSamples::U8(image.into_raw()),
        DynamicImage::ImageRgb8(image) => TexelSamples::U8(image.into_raw()),
        DynamicImage::ImageRgba8(image) => TexelSamples::U8(image.into_raw()),
        DynamicImage::ImageLuma16(image) => TexelSamples::U16(image.into_raw()),
        DynamicImage::ImageLumaA16(image) => TexelSamples::U16(image.into_raw()),
        DynamicImage::ImageRgb16(image) => TexelSamples::U16(image.into_raw()),
        DynamicImage::ImageRgba16(image) => TexelSamples::U16(image.into_raw()),
        other => {
            let number = |v: &f32| if *v > 0.0 { v.min(MAX_FLOAT) } else { 0.0 };
            if other.color().has_alpha() {
                TexelSamples::F32(other.into_rgba32f().as_raw().iter().map(number).collect())
            } else {
                TexelSamples::F32(other.into_rgb32f().as_raw().iter().map(number).collect())
            }
        }
    }
}

/// TGA files have no magic number at their beginning: the header has to make sense.
///
/// Source: Truevision, "TGA file format specification", version 2.0, 1991, fields 2, 3, 5.3 to 5.6.
fn is_tga(bytes: &[u8]) -> bool {
    let Some(&[_, map, kind, .., w0, w1, h0, h1, depth, _]) = bytes.first_chunk::<18>() else { return false };
    let has_size = [w0, w1] != [0, 0] && [h0, h1] != [0, 0];
    map <= 1 && matches!(kind, 1 | 2 | 3 | 9 | 10 | 11) && matches!(depth, 8 | 15 | 16 | 24 | 32) && has_size
}

#[cfg(test)]
mod tests {
    use super::super::read::{decode, read_header};
    use super::*;

    fn picture(color: ColorType) -> DynamicImage {
        let byte = |x: u32, y: u32, k: u32| (x * 37 + y * 91 + k * 50) as u8;
        match color {
            ColorType::L8 => codec::GrayImage::from_fn(7, 5, |x, y| codec::Luma([byte(x, y, 0)])).into(),
            ColorType::Rgb8 => {
                codec::RgbImage::from_fn(7, 5, |x, y| codec::Rgb([0, 1, 2].map(|k| byte(x, y, k)))).into()
            }
            _ => codec::RgbaImage::from_fn(7, 5, |x, y| codec::Rgba([0, 1, 2, 3].map(|k| byte(x, y, k)))).into(),
        }
    }

    fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    const FORMATS: [ImageFormat; 7] = [
        ImageFormat::WebP,
        ImageFormat::Tga,
        ImageFormat::Bmp,
        ImageFormat::Tiff,
        ImageFormat::Gif,
        ImageFormat::Qoi,
        ImageFormat::Pnm,
    ];

    #[test]
    fn every_format_gives_its_samples() {
        for format in FORMATS {
            for color in [ColorType::L8, ColorType::Rgb8, ColorType::Rgba8] {
                if matches!((format, color), (ImageFormat::Gif | ImageFormat::WebP | ImageFormat::Qoi, ColorType::L8)) {
                    continue;
                }
                let mut image = picture(color);
                if format == ImageFormat::Gif {
                    // Of 256 colours, and opaque
                    image = DynamicImage::ImageLuma8(image.into_luma8()).into_rgba8().into();
                }
                let bytes = encoded(&image, format);
                let texels = decode(&bytes, &Limits::default()).unwrap();
                let expected = codec::load_from_memory_with_format(&bytes, format).unwrap();
                let header = read_header(&bytes, &Limits::default()).unwrap();
                assert_eq!((header.width, header.height, header.channels), (7, 5, texels.channels));
                assert_eq!(texels.channels, usize::from(expected.color().channel_count()), "{format:?}");
                assert_eq!(texels.data, TexelSamples::U8(expected.into_bytes()), "{format:?} {color:?}");
            }
        }
    }

    #[test]
    fn pictures_of_light_are_linear() {
        let light = codec::Rgb32FImage::from_fn(3, 2, |x, y| codec::Rgb([x as f32, y as f32 * 4.0, 0.5]));
        let bytes = encoded(&light.clone().into(), ImageFormat::Hdr);
        for bytes in [bytes.clone(), [b"#?RGBE\n", &bytes[11..]].concat()] {
            let texels = decode(&bytes, &Limits::default()).unwrap();
            let TexelSamples::F32(samples) = &texels.data else { panic!() };
            assert_eq!((texels.width, texels.height, texels.channels), (3, 2, 3));
            let off = samples.iter().zip(light.as_raw()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(off < 0.02, "{off}");
        }
    }

    #[test]
    fn sizes_are_checked_first_and_damage_does_no_harm() {
        let small = Limits { side: 4, texels: 1 << 20 };
        let mut numbers = firstlight_testkit::Random::new(1);
        for format in FORMATS {
            let bytes = encoded(&picture(ColorType::Rgba8).into_rgba8().into(), format);
            assert!(matches!(decode(&bytes, &small), Err(ImageError::TooLarge { .. })), "{format:?}");
            for _ in 0..300 {
                let mut damaged = bytes.clone();
                let at = numbers.below(damaged.len() as u32) as usize;
                damaged[at] ^= 1 << numbers.below(8);
                damaged.truncate(numbers.below(2 * damaged.len() as u32).max(1) as usize);
                let _ = decode(&damaged, &Limits { side: 1000, texels: 1 << 20 });
            }
        }
    }

    fn file(name: &str) -> Texels {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/images");
        decode(&std::fs::read(folder.join(name)).unwrap(), &Limits::default()).unwrap()
    }

    #[test]
    fn files_of_others_hold_the_same_picture() {
        let png = file("bricks-color.png");
        assert_eq!((png.width, png.height, png.channels), (160, 120, 3));
        assert_eq!(file("bricks-color.bmp"), png);
        assert_eq!(file("bricks-color.tga"), png);
        let gray = file("bricks-gray.tga");
        assert_eq!((gray.width, gray.height, gray.channels), (160, 120, 1));
        // Lossy colours with an alpha
        let (png, webp) = (file("python.png"), file("python.webp"));
        assert_eq!((png.width, png.channels), (16, 4));
        assert_eq!((webp.width, webp.height, webp.channels), (16, 16, 4));
        let (TexelSamples::U8(png), TexelSamples::U8(webp)) = (png.data, webp.data) else { panic!() };
        let pairs = png.as_chunks::<4>().0.iter().zip(webp.as_chunks::<4>().0);
        let solid: Vec<_> = pairs.filter(|(png, _)| png[3] == 255).collect();
        let off = |(png, webp): &(&[u8; 4], &[u8; 4])| (0..4).map(|i| u32::from(png[i].abs_diff(webp[i]))).sum::<u32>();
        let mean = solid.iter().map(off).sum::<u32>() as f64 / (4 * solid.len()) as f64;
        assert!(solid.len() > 50 && mean < 12.0, "{} {mean}", solid.len());
    }

    #[test]
    fn plain_and_packed_maps_of_pixels() {
        let of = |bytes: &[u8]| decode(bytes, &Limits::default()).unwrap();
        let gray = |data: &[u8]| (1, TexelSamples::U8(data.to_vec()));
        let got = |texels: Texels| {
            assert_eq!((texels.width, texels.height), (3, 2));
            (texels.channels, texels.data)
        };
        // In a bitmap 1 is black
        assert_eq!(got(of(b"P1\n# made by hand\n3 2\n1 0 1\n0 0 1\n")), gray(&[0, 255, 0, 255, 255, 0]));
        assert_eq!(got(of(b"P4 3 2\n\xa0\x20")), gray(&[0, 255, 0, 255, 255, 0]));
        assert_eq!(got(of(b"P5\n3 2\n255\nabcdef")), gray(b"abcdef"));
        // Of other numbers of steps
        assert_eq!(got(of(b"P2 3 2 15\n0 5 10\n15 1 2\n")), gray(&[0, 85, 170, 255, 17, 34]));
        let deep = TexelSamples::U16(vec![0x0102, 0x0304, 0x0506, 0x0708, 0x090a, 0xffff]);
        let bytes = b"P5 3 2 65535\n\x01\x02\x03\x04\x05\x06\x07\x08\x09\x0a\xff\xff";
        assert_eq!(got(of(bytes)), (1, deep));
        // What claims more than it has takes no memory
        for bytes in [&b"P6 30000 8000 255\nabc"[..], b"P1 30000 8000\n1 1", b"qoif\0\0\x70\0\0\0\x20\0\x04\0\0\0"] {
            let fault = read_header(bytes, &Limits::default()).unwrap_err().to_string();
            assert!(fault.contains("too short for its size"), "{fault}");
        }
        assert!(matches!(decode(b"Pz 3 2", &Limits::default()), Err(ImageError::UnknownKind { .. })));
    }
}
