//! Reading back the pictures that firstlight writes, number by number, for comparing and checking them.

use std::io::Cursor;

use ::png;

use super::contain::contained;
use super::damage;
use super::read::{Limits, check_size};
use super::{Format, ImageError, PREFIX, Receipt, Window};

/// A picture file as it was stored: nothing decoded, nothing multiplied.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredImage {
    /// Which kind of file.
    pub format: Format,
    /// The width and height of the whole film. Only EXR knows it; the others say that of the picture.
    pub film: [u32; 2],
    /// The part of it that `pixels` holds. Only EXR knows where; the others begin at (0, 0).
    pub window: Window,
    /// Red, green, blue, alpha; rows from the top, each from the left. PNG: display-encoded, straight alpha, 0 to 1.
    /// EXR: linear, premultiplied. HDR: linear. Alpha is 1 in a file without it.
    pub pixels: Vec<[f32; 4]>,
    /// What firstlight wrote into the file; empty in a file of other programs.
    pub receipt: Receipt,
}

/// As large as a film can be.
const LIMITS: Limits = Limits { side: 65536, texels: 1 << 27 };

impl StoredImage {
    /// Reads a PNG, EXR or HDR file; which of them, its first bytes say. Made for the files that firstlight writes;
    /// those of other programs are read if they are of the same make (no palettes, no tiles with levels, no other
    /// channels alone).
    ///
    /// # Errors
    /// [`ImageError::UnknownKind`]; [`ImageError::TooLarge`] above 65536 a side or 2^27 in all, the largest film;
    /// [`ImageError::Damaged`]; [`ImageError::WithoutExr`].
    pub fn read(bytes: &[u8]) -> Result<StoredImage, ImageError> {
        if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
            contained("PNG", || read_png(bytes))
        } else if bytes.starts_with(b"#?RADIANCE\n") {
            contained("HDR", || read_hdr(bytes))
        } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            #[cfg(feature = "exr")]
            return contained("EXR", || read_exr(bytes));
            #[cfg(not(feature = "exr"))]
            Err(ImageError::WithoutExr)
        } else {
            Err(ImageError::UnknownKind { expected: "PNG, EXR or HDR" })
        }
    }

    /// A picture that is its whole film.
    fn whole(format: Format, width: u32, height: u32, pixels: Vec<[f32; 4]>, receipt: Receipt) -> Self {
        Self { format, film: [width, height], window: Window { x: 0, y: 0, width, height }, pixels, receipt }
    }
}

fn read_png(bytes: &[u8]) -> Result<StoredImage, ImageError> {
    let damaged = |reason: String| ImageError::Damaged { format: "PNG", reason };
    let fault = |e: png::DecodingError| damaged(e.to_string());
    damage::in_png(bytes).map_err(damaged)?;
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    let info = decoder.read_header_info().map_err(fault)?;
    let (width, height) = (info.width, info.height);
    check_size(width, height, &LIMITS)?;
    // Deflate cannot expand more than this
    if info.raw_bytes() as u64 > 1032 * bytes.len() as u64 {
        return Err(damaged("it is too short for its size".into()));
    }
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(fault)?;
    let mut samples = vec![0; reader.output_buffer_size().ok_or_else(|| damaged("it is too large".into()))?];
    reader.next_frame(&mut samples).map_err(fault)?;
    let (color, depth) = reader.output_color_type();
    let (format, values): (_, Vec<f32>) = match depth {
        png::BitDepth::Sixteen => {
            let value = |s: &[u8]| f32::from(u16::from_be_bytes([s[0], s[1]])) / 65535.0;
            (Format::Png16, samples.chunks_exact(2).map(value).collect())
        }
        _ => (Format::Png8, samples.iter().map(|&s| f32::from(s) / 255.0).collect()),
    };
    let pixels = values.chunks_exact(color.samples()).map(|s| match *s {
        [v] => [v, v, v, 1.0],
        [v, a] => [v, v, v, a],
        [r, g, b] => [r, g, b, 1.0],
        [r, g, b, a] => [r, g, b, a],
        _ => [0.0; 4],
    });
    let mut receipt = Receipt::default();
    for chunk in &reader.info().utf8_text {
        if let (Some(key), Ok(value)) = (chunk.keyword.strip_prefix(PREFIX), chunk.get_text()) {
            receipt.entries.push((key.into(), value));
        }
    }
    Ok(StoredImage::whole(format, width, height, pixels.collect(), receipt))
}

fn read_hdr(bytes: &[u8]) -> Result<StoredImage, ImageError> {
    let damaged = |reason: String| ImageError::Damaged { format: "HDR", reason };
    let (width, height, rows) =
        super::hdr::header(bytes).ok_or_else(|| damaged("its header is of no known make".into()))?;
    check_size(width, height, &LIMITS)?;
    // A run of 127 takes two bytes, in each of four channels
    if u64::from(width) * u64::from(height) > 16 * bytes.len() as u64 {
        return Err(damaged("it is too short for its size".into()));
    }
    let pixels =
        super::hdr::decode(rows, width, height).ok_or_else(|| damaged("a row is damaged or missing".into()))?;
    // The receipt stands in comments, before the empty line that ends the header
    let mut receipt = Receipt::default();
    for line in bytes.split(|&b| b == b'\n').take_while(|line| !line.is_empty()) {
        let entry =
            std::str::from_utf8(line).ok().and_then(|l| l.strip_prefix("# ")?.strip_prefix(PREFIX)?.split_once(' '));
        if let Some((key, value)) = entry {
            receipt.entries.push((key.into(), super::hdr::unescape(value)));
        }
    }
    Ok(StoredImage::whole(Format::Hdr, width, height, pixels, receipt))
}

#[cfg(feature = "exr")]
fn read_exr(bytes: &[u8]) -> Result<StoredImage, ImageError> {
    use ::exr::prelude::*;
    let damaged = |reason: String| ImageError::Damaged { format: "EXR", reason };
    // Check the size
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| damaged(e.to_string()))?;
    let header = meta.headers.first().ok_or_else(|| damaged("it has no layer".into()))?;
    let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let (width, height) = (side(header.layer_size.x()), side(header.layer_size.y()));
    check_size(width, height, &LIMITS)?;
    let Vec2(x, y) = header.own_attributes.layer_position;
    let display = header.shared_attributes.display_window;
    // The windows in the film's own pixels
    let (left, top) = (i64::from(x) - i64::from(display.position.x()), i64::from(y) - i64::from(display.position.y()));
    let window = match (u32::try_from(left), u32::try_from(top)) {
        (Ok(x), Ok(y)) => Window { x, y, width, height },
        _ => return Err(damaged("its data window begins outside its display window".into())),
    };
    let film = [side(display.size.x()), side(display.size.y())];
    // Read the pixels
    let columns = width as usize;
    let reader = read().no_deep_data().largest_resolution_level().rgba_channels(
        move |size: Vec2<usize>, _: &RgbaChannels| vec![[0.0_f32; 4]; size.area()],
        move |pixels: &mut Vec<[f32; 4]>, at: Vec2<usize>, (r, g, b, a): (f32, f32, f32, f32)| {
            pixels[at.y() * columns + at.x()] = [r, g, b, a];
        },
    );
    let file = reader.first_valid_layer().all_attributes().from_buffered(Cursor::new(bytes));
    let file = file.map_err(|e| damaged(e.to_string()))?;
    let pixels = file.layer_data.channel_data.pixels;
    if pixels.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(damaged("its first layer has no colours".into()));
    }
    let mut receipt = Receipt::default();
    for attribute in super::exr::attributes(bytes) {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        if let (Some(key), b"string") = (attribute.name.strip_prefix(PREFIX.as_bytes()), attribute.kind) {
            receipt.entries.push((text(key), text(&bytes[attribute.value])));
        }
    }
    Ok(StoredImage { format: Format::Exr, film, window, pixels, receipt })
}

#[cfg(test)]
mod tests {
    use super::super::tests::whole;
    use super::*;
    use crate::color::Display;

    fn files() -> Vec<Vec<u8>> {
        let picture = whole(19, 20, |x, y| [x as f32 / 10.0, y as f32 / 19.0, 0.5, 0.5]);
        let mut formats = vec![Format::Png8, Format::Png16, Format::Hdr];
        if cfg!(feature = "exr") {
            formats.push(Format::Exr);
        }
        let receipt = super::super::tests::receipt();
        formats.into_iter().map(|f| picture.encode(f, &Display::default(), &receipt).unwrap()).collect()
    }

    #[test]
    fn files_cut_short_do_no_harm() {
        for bytes in files() {
            for length in 0..bytes.len() {
                let result = StoredImage::read(&bytes[..length]);
                assert!(result.is_err() || bytes.len() - length < 24, "{length} of {}", bytes.len());
            }
        }
    }

    #[test]
    fn damaged_files_do_no_harm() {
        let mut numbers = firstlight_testkit::Random::new(1);
        let mut random = |below: usize| numbers.below(below as u32) as usize;
        for bytes in files() {
            for _ in 0..2000 {
                let mut damaged = bytes.clone();
                let at = random(damaged.len());
                damaged[at] ^= 1 << random(8);
                let _ = StoredImage::read(&damaged);
            }
        }
    }

    #[test]
    fn other_files_are_named_as_such() {
        let words = StoredImage::read(b"BM").unwrap_err().to_string();
        assert_eq!(words, "is not a PNG, EXR or HDR file; convert it to one");
    }

    #[test]
    fn sizes_are_checked_before_decoding() {
        let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 2000\n";
        assert!(matches!(StoredImage::read(hdr), Err(ImageError::Damaged { .. })));
        let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 65537 +X 1\n";
        assert!(matches!(StoredImage::read(hdr), Err(ImageError::TooLarge { .. })));
    }
}
