//! JPEG files: 8 bits a channel, baseline, colours as fine as brightness (4:4:4).
//!
//! JPEG has no alpha: the picture lies on black, as the film holds it. The encoder is that of the `image` crate, which
//! computes in whole numbers but for a division that IEEE 754 rounds: the same bytes on every machine. The receipt is
//! in comments (COM), one for each entry, `firstlight:KEY VALUE`, before the tables; one that is too long for a comment
//! goes on in the next with the same key.
//!
//! Source: ITU-T T.81, section B.2.4.5 (comments); T.871 (JFIF).

use ::image as codec;
use codec::ExtendedColorType;
use codec::codecs::jpeg::JpegEncoder;

use super::plane::BUFFER_KEY;
use super::png::display_samples;
use super::read::{TexelSamples, Texels, decode};
use super::stored::{LIMITS, one_buffer};
use super::{
    FileSettings, Format, ImageError, NamedPlane, PREFIX, PlaneVec, Receipt, SOFTWARE, StoredPlane, StoredPlanes,
    Window,
};

/// The key of the quality.
pub(super) const QUALITY_KEY: &str = "jpeg_quality";

/// The most bytes of a comment: its length is of 16 bits and counts itself.
const MAX_COMMENT: usize = 65533;

/// The bytes of a JPEG file of a colour. The pixels, which are those of `of`, the settings and the receipt have been
/// checked.
pub(super) fn encode(
    window: Window,
    of: &NamedPlane,
    pixels: &[[f32; 4]],
    settings: &FileSettings,
    receipt: &Receipt,
) -> Result<Vec<u8>, ImageError> {
    let display = &settings.display;
    if let Some(fault) = display.fault() {
        return Err(ImageError::Display(fault));
    }
    let Window { width, height, .. } = window;
    let fault = |reason: String| ImageError::Encode { format: "JPEG", reason };
    if width.max(height) > u32::from(u16::MAX) {
        return Err(fault(format!("it is {width} x {height}, and a JPEG has at most 65535 a side")));
    }
    let samples = display_samples(window, pixels, display);
    let mut picture = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut picture, settings.jpeg_quality);
    encoder.encode(&samples, width, height, ExtendedColorType::Rgb8).map_err(|e| fault(e.to_string()))?;
    // The comments go behind the first segment, which is to be that of JFIF
    let length = match picture.first_chunk() {
        Some([0xff, 0xd8, 0xff, 0xe0, high, low]) => u16::from_be_bytes([*high, *low]),
        _ => return Err(fault("its encoder wrote no JFIF".into())),
    };
    let (head, rest) = picture
        .split_at_checked(4 + usize::from(length))
        .ok_or_else(|| fault("its encoder wrote no picture".into()))?;
    let said = format!(
        "channels R G B; uint8; unit display-encoded; space -; on black, before losses; {}",
        of.plane.sampling().name()
    );
    let receipt = receipt.shown_by(Some(display)).with(QUALITY_KEY, settings.jpeg_quality.to_string());
    let receipt = receipt.with(&format!("{BUFFER_KEY}{}", of.name), said);
    let mut bytes = head.to_vec();
    comment(&mut bytes, SOFTWARE);
    for (key, value) in &receipt.entries {
        let before = format!("{PREFIX}{key} ");
        for part in parts(value, MAX_COMMENT.saturating_sub(before.len())) {
            comment(&mut bytes, &format!("{before}{part}"));
        }
    }
    bytes.extend_from_slice(rest);
    Ok(bytes)
}

/// Adds a comment that is no longer than one may be.
fn comment(bytes: &mut Vec<u8>, text: &str) {
    let length = u16::try_from(text.len() + 2).expect("the text of a comment has been cut");
    bytes.extend([0xff, 0xfe]);
    bytes.extend(length.to_be_bytes());
    bytes.extend(text.as_bytes());
}

/// A text in pieces of at most so many bytes, 4 or more; of an empty text one.
fn parts(mut text: &str, most: usize) -> Vec<&str> {
    let mut parts = Vec::new();
    loop {
        let (part, rest) = text.split_at(text.floor_char_boundary(most.max(4)));
        parts.push(part);
        if rest.is_empty() {
            return parts;
        }
        text = rest;
    }
}

/// Reads a JPEG file of any program.
pub(super) fn read(bytes: &[u8]) -> Result<StoredPlanes, ImageError> {
    let damaged = |reason: &str| ImageError::Damaged { format: "JPEG", reason: reason.into() };
    let Texels { width, height, channels, data } = decode(bytes, &LIMITS)?;
    let TexelSamples::U8(samples) = data else { return Err(damaged("it has not 8 bits")) };
    let codes = samples.into_iter().map(u32::from);
    let codes: Vec<u32> = match channels {
        1 => codes.flat_map(|gray| [gray; 3]).collect(),
        3 => codes.collect(),
        _ => return Err(damaged("it has an alpha, which no JPEG has")),
    };
    let receipt = receipt_of(bytes);
    let mut plane = StoredPlane::color(PlaneVec::Wholes(codes), 3, Some(255));
    if let Some((name, _)) = one_buffer(&receipt, 3) {
        plane.name = name;
    }
    Ok(StoredPlanes::picture(Format::Jpeg, [width, height], plane, receipt))
}

/// What the comments before the pixels say.
fn receipt_of(bytes: &[u8]) -> Receipt {
    let mut receipt = Receipt::default();
    let mut rest = bytes.get(2..).unwrap_or_default();
    while let Some(&[0xff, marker, high, low]) = rest.first_chunk() {
        let length = usize::from(u16::from_be_bytes([high, low]));
        let Some((segment, behind)) = rest[2..].split_at_checked(length).filter(|_| length >= 2 && marker != 0xda)
        else {
            break;
        };
        rest = behind;
        let text = std::str::from_utf8(&segment[2..]).ok().filter(|_| marker == 0xfe);
        let Some((key, value)) = text.and_then(|text| text.strip_prefix(PREFIX)?.split_once(' ')) else { continue };
        match receipt.entries.last_mut() {
            Some((last, begun)) if last == key => begun.push_str(value),
            _ => receipt.entries.push((key.to_owned(), value.to_owned())),
        }
    }
    receipt
}

#[cfg(test)]
mod tests {
    use super::super::tests::{receipt, whole};
    use super::super::{Image, Plane, encode_planes};
    use super::*;
    use crate::color::{Display, Encoding};
    use crate::image::PlaneNumbers;

    fn encoded(picture: &Image, quality: u8) -> Result<Vec<u8>, ImageError> {
        let planes = [NamedPlane::new(Plane::Color, PlaneNumbers::Floats(picture.pixels.as_flattened()))];
        let settings = FileSettings { jpeg_quality: quality, ..FileSettings::default() };
        encode_planes(picture.film, picture.window, &planes, Format::Jpeg, &settings, &receipt())
    }

    fn codes(bytes: &[u8]) -> Vec<u32> {
        match StoredPlanes::read(bytes).unwrap().planes.remove(0).numbers {
            PlaneVec::Wholes(codes) => codes,
            PlaneVec::Floats(_) => panic!("8 bits are whole"),
        }
    }

    /// Soft, as pictures are.
    fn ramp(width: u32, height: u32) -> Image {
        whole(width, height, |x, y| [x as f32 / width as f32, y as f32 / height as f32, 0.25, 1.0])
    }

    #[test]
    fn a_picture_comes_back_but_for_its_losses() {
        let picture = ramp(83, 61);
        let expected: Vec<u8> = display_samples(picture.window, &picture.pixels, &Display::default());
        let mut lengths = Vec::new();
        for (quality, most) in [(30, 8.0), (90, 1.5), (100, 0.75)] {
            let bytes = encoded(&picture, quality).unwrap();
            assert!(encoded(&picture, quality).unwrap() == bytes);
            lengths.push(bytes.len());
            let off =
                codes(&bytes).into_iter().zip(&expected).map(|(got, sent)| f64::from(got.abs_diff((*sent).into())));
            let mean = off.sum::<f64>() / expected.len() as f64;
            assert!(mean < most, "{quality}: {mean}");
        }
        assert!(lengths.is_sorted_by(|a, b| a < b), "{lengths:?}");
        for bad in [0, 101] {
            let fault = encoded(&picture, bad).unwrap_err().to_string();
            assert_eq!(fault, format!("the quality is {bad}; that of a JPEG file is 1 to 100"));
        }
    }

    #[test]
    fn the_receipt_is_in_comments() {
        let bytes = encoded(&ramp(9, 9), 75).unwrap();
        assert_eq!(bytes[..4], [0xff, 0xd8, 0xff, 0xe0]);
        let stored = StoredPlanes::read(&bytes).unwrap();
        let mut shown = receipt().shown_by(Some(&Display::default()));
        let said = "channels R G B; uint8; unit display-encoded; space -; on black, before losses; filtered";
        shown.entries.push((QUALITY_KEY.into(), "75".into()));
        shown.entries.push(("buffer.color".into(), said.into()));
        assert_eq!(stored.receipt, shown);
        assert_eq!(FileSettings::of(&stored.receipt).jpeg_quality, 75);
        assert_eq!(stored.is_as_written(&stored.planes[0]), None);
        // Of any length
        let long = "\u{e9}".repeat(100_000);
        let entries = vec![("names".to_owned(), long), ("last".to_owned(), String::new())];
        let bytes =
            ramp(9, 9).encode(Format::Jpeg, &Display::default(), &Receipt { entries: entries.clone() }).unwrap();
        let read = StoredPlanes::read(&bytes).unwrap().receipt;
        assert!(read.entries[..2] == entries[..]);
        // Whatever is cut off
        for length in 0..bytes.len().min(3000) {
            receipt_of(&bytes[..length]);
        }
    }

    #[test]
    fn what_lets_light_through_lies_on_black() {
        let flat = |pixel| codes(&encoded(&whole(16, 16, |_, _| pixel), 100).unwrap());
        assert_eq!(flat([0.25, 0.25, 0.25, 0.5]), flat([0.25, 0.25, 0.25, 1.0]));
        assert_eq!(flat([0.25, 0.25, 0.25, 0.5])[0], 137);
    }

    #[test]
    fn what_is_no_colour_or_too_wide_is_refused() {
        let planes = [NamedPlane::new(Plane::Depth, PlaneNumbers::Floats(&[1.0]))];
        let window = Window { x: 0, y: 0, width: 1, height: 1 };
        let result = encode_planes([1, 1], window, &planes, Format::Jpeg, &FileSettings::default(), &receipt());
        let words = "a JPEG file cannot hold depth: it is no colour; .exr, .npz and .npy files can";
        assert_eq!(result.unwrap_err().to_string(), words);
        let wide = whole(65536, 1, |_, _| [0.5; 4]).encode(Format::Jpeg, &Display::default(), &Receipt::default());
        let words = "cannot be encoded as JPEG: it is 65536 x 1, and a JPEG has at most 65535 a side";
        assert_eq!(wide.unwrap_err().to_string(), words);
        let display = Display { encoding: Encoding::Gamma(-1.0), ..Display::default() };
        let fault = ramp(8, 8).encode(Format::Jpeg, &display, &Receipt::default()).unwrap_err().to_string();
        assert_eq!(fault, "gamma -1 is not a finite number greater than 0");
    }
}
