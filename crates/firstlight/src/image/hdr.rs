//! Radiance HDR files: linear colour with 8-bit mantissas and one exponent a pixel.
//!
//! Not by the `image` crate, whose exponents come from the system's logarithm, wrap around for
//! numbers below 2^-128, and whose files of exactly 32768 columns cannot be read. Colour is rounded to nearest, which
//! suits the readers that take a mantissa as it is (all but Radiance's own tools, which add a half).
//!
//! Source: G. Ward, "Real Pixels", Graphics Gems II, 1991; the Radiance file formats manual, "picture files".

use super::plane::BUFFER_KEY;
use super::{NamedPlane, PREFIX, Receipt, SOFTWARE, Window};

/// The bytes of a Radiance file of a colour. The pixels, which are those of `of`, and the receipt have been checked.
pub(super) fn encode(window: Window, of: &NamedPlane, pixels: &[[f32; 4]], receipt: &Receipt) -> Vec<u8> {
    let Window { width, height, .. } = window;
    let colors: Vec<[f32; 3]> = pixels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
    let pixels = bytes(&colors);
    let hash = blake3::hash(&pixels).to_hex();
    let (unit, sampling) = (of.plane.unit(), of.plane.sampling().name());
    let said = format!("channels R G B; rgbe; unit {unit}; space -; alpha left out; {sampling}; blake3 {hash}");
    let receipt = receipt.with(&format!("{BUFFER_KEY}{}", of.name), said);
    // The header: variables, comments, an empty line, the size
    let mut file = format!("#?RADIANCE\nSOFTWARE={SOFTWARE}\n").into_bytes();
    for (key, value) in &receipt.entries {
        file.extend(format!("# {PREFIX}{} {}\n", escape(key).replace(' ', "\\u{20}"), escape(value)).into_bytes());
    }
    file.extend(b"PRIMARIES=0.640 0.330 0.300 0.600 0.150 0.060 0.3127 0.3290\n");
    file.extend(format!("FORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes());
    // Rows: runs of each channel where the format can count them, otherwise plain
    for pixels in pixels.as_chunks::<4>().0.chunks_exact(width as usize) {
        if (8..=32767).contains(&width) {
            file.extend([2, 2, (width >> 8) as u8, width as u8]);
            for channel in 0..4 {
                let values: Vec<u8> = pixels.iter().map(|p| p[channel]).collect();
                run_lengths(&values, &mut file);
            }
        } else {
            file.extend(pixels.as_flattened());
        }
    }
    file
}

/// What a file stores of colours, runs aside: three mantissas and an exponent of each.
pub(super) fn bytes(colors: &[[f32; 3]]) -> Vec<u8> {
    colors.iter().map(|color| shared_exponent(*color)).collect::<Vec<_>>().into_flattened()
}

/// Three mantissas and the exponent: channel = mantissa / 256 x 2^(exponent - 128), to the nearest.
///
/// What is below 0 and NaN become 0; what is above 255/256 x 2^127 becomes that.
fn shared_exponent(color: [f32; 3]) -> [u8; 4] {
    const LARGEST: f64 = 255.0 / 256.0 * (1u128 << 127) as f64;
    // NaN is not above 0
    let color = color.map(|c| if c > 0.0 { f64::from(c).min(LARGEST) } else { 0.0 });
    let most = color[0].max(color[1]).max(color[2]);
    // Below what exponent 1 can hold, which is 2^-128
    if most < 1e-38 {
        return [0; 4];
    }
    // most = f x 2^e with f in [1/2, 1): every f32 is a normal f64
    let mut e = ((most.to_bits() >> 52) as i32) - 1022;
    let scale = |e: i32| f64::from_bits(((1023 + 8 - e) as u64) << 52);
    // Rounding may reach 256, which the next exponent holds as 128
    if (most * scale(e)).round() > 255.0 {
        e += 1;
    }
    let [r, g, b] = color.map(|c| (c * scale(e)).round() as u8);
    [r, g, b, (e + 128) as u8]
}

/// Runs of 3 to 127 equal bytes as 128 + length and the byte; up to 128 others as their length and themselves.
fn run_lengths(values: &[u8], bytes: &mut Vec<u8>) {
    let run_at = |i: usize| values[i..].iter().take(127).take_while(|&&v| v == values[i]).count();
    let mut i = 0;
    while i < values.len() {
        let run = run_at(i);
        if run >= 3 {
            bytes.extend([128 + run as u8, values[i]]);
            i += run;
        } else {
            let start = i;
            while i < values.len() && i - start < 128 && run_at(i) < 3 {
                i += 1;
            }
            bytes.push((i - start) as u8);
            bytes.extend(&values[start..i]);
        }
    }
}

/// Width, height, and what follows the header. `None` if it is none, or the rows do not go from the top left.
pub(super) fn header(bytes: &[u8]) -> Option<(u32, u32, &[u8])> {
    let end = bytes.windows(2).position(|w| w == b"\n\n")?;
    let is_rgbe = |line: &[u8]| line == b"FORMAT=32-bit_rle_rgbe";
    if !bytes[..end].split(|&b| b == b'\n').any(is_rgbe) {
        return None;
    }
    let rest = &bytes[end + 2..];
    let line = rest.iter().position(|&b| b == b'\n')?;
    let words = std::str::from_utf8(&rest[..line]).ok()?;
    let (height, width) = words.strip_prefix("-Y ")?.split_once(" +X ")?;
    let [width, height] = [width, height].map(|side| side.parse().ok().filter(|side| *side > 0));
    Some((width?, height?, &rest[line + 1..]))
}

/// The pixels, alpha 1, of rows with the runs that [`encode`] writes or without any. `None` if they are damaged.
pub(super) fn decode(mut bytes: &[u8], width: u32, height: u32) -> Option<Vec<[f32; 4]>> {
    let columns = width as usize;
    let mut pixels = Vec::new();
    let mut row = vec![[0; 4]; columns];
    for _ in 0..height {
        if (8..=32767).contains(&width) && bytes.starts_with(&[2, 2, (width >> 8) as u8, width as u8]) {
            bytes = &bytes[4..];
            for channel in 0..4 {
                let mut x = 0;
                while x < columns {
                    let (&count, rest) = bytes.split_first()?;
                    let (length, same) = if count > 128 { (count - 128, true) } else { (count, false) };
                    let length = usize::from(length);
                    let (values, rest) = rest.split_at_checked(if same { 1 } else { length })?;
                    let to = row.get_mut(x..x + length).filter(|to| !to.is_empty())?;
                    for (i, pixel) in to.iter_mut().enumerate() {
                        pixel[channel] = values[if same { 0 } else { i }];
                    }
                    (x, bytes) = (x + length, rest);
                }
            }
        } else {
            let (values, rest) = bytes.split_at_checked(4 * columns)?;
            row.as_flattened_mut().copy_from_slice(values);
            bytes = rest;
        }
        pixels.extend(row.iter().map(color));
    }
    Some(pixels)
}

/// The colour of three mantissas and an exponent; exact.
fn color(&[r, g, b, e]: &[u8; 4]) -> [f32; 4] {
    let unit = f64::from_bits((1023 - 128 - 8 + u64::from(e)) << 52);
    let value = |mantissa: u8| if e == 0 { 0.0 } else { (f64::from(mantissa) * unit) as f32 };
    [value(r), value(g), value(b), 1.0]
}

/// A text as one line: a backslash becomes two, a line's end `\n`, another control character `\u{...}`.
fn escape(text: &str) -> String {
    let mut line = String::new();
    for c in text.chars() {
        match c {
            '\\' => line.push_str("\\\\"),
            '\n' => line.push_str("\\n"),
            c if c.is_control() => line.extend(c.escape_unicode()),
            c => line.push(c),
        }
    }
    line
}

/// The text that [`escape`] made a line of. What it cannot have made stays as it is.
pub(super) fn unescape(line: &str) -> String {
    let mut text = String::new();
    let mut rest = line;
    while let Some((before, after)) = rest.split_once('\\') {
        text.push_str(before);
        let unicode = || {
            let (digits, after) = after.strip_prefix("u{")?.split_once('}')?;
            Some((char::from_u32(u32::from_str_radix(digits, 16).ok()?)?, after))
        };
        let plain = || match after.as_bytes().first()? {
            b'\\' => Some(('\\', &after[1..])),
            b'n' => Some(('\n', &after[1..])),
            _ => None,
        };
        let (c, after) = plain().or_else(unicode).unwrap_or(('\\', after));
        text.push(c);
        rest = after;
    }
    text + rest
}

#[cfg(test)]
mod tests {
    use super::super::tests::{receipt, whole};
    use super::super::{Format, Image};
    use super::*;
    use crate::color::Display;

    fn encode(picture: &Image, receipt: &Receipt) -> Vec<u8> {
        picture.encode(Format::Hdr, &Display::default(), receipt).unwrap()
    }
    use image::ImageDecoder;

    fn decoded(bytes: &[u8]) -> (u32, u32, Vec<f32>) {
        let decoder = image::codecs::hdr::HdrDecoder::new(std::io::Cursor::new(bytes)).unwrap();
        let (width, height) = decoder.dimensions();
        let mut raw = vec![0; decoder.total_bytes() as usize];
        decoder.read_image(&mut raw).unwrap();
        (width, height, raw.chunks(4).map(|c| f32::from_ne_bytes(c.try_into().unwrap())).collect())
    }

    #[test]
    fn the_image_crate_reads_every_width() {
        // Below, within and beyond the widths that have runs; long runs, short ones and none
        for width in [1, 7, 8, 9, 127, 128, 129, 255, 256, 1000, 32767, 32768, 32769] {
            let value = |x: u32| [(x % 7) as f32 / 8.0, if x % 300 < 200 { 0.5 } else { (x % 5) as f32 }, 1.0, 0.5];
            let picture = whole(width, 3, |x, y| value(x + y));
            let (w, h, data) = decoded(&encode(&picture, &receipt()));
            assert_eq!((w, h), (width, 3));
            let expected: Vec<f32> = picture.pixels.iter().flat_map(|p| p[..3].to_vec()).collect();
            assert!(data == expected, "{width}");
            // And so do we
            let bytes = encode(&picture, &receipt());
            let (w, h, rows) = header(&bytes).unwrap();
            assert_eq!((w, h), (width, 3));
            let ours = decode(rows, w, h).unwrap();
            assert!(ours.iter().flat_map(|p| &p[..3]).eq(&expected), "{width}");
        }
    }

    #[test]
    fn the_error_is_half_a_step_of_the_largest_channel() {
        let colors =
            [[1.0, 0.001, 0.3], [0.997, 0.5, 0.2], [1e-5, 2e-7, 3e-6], [12345.6, 0.1, 99.0], [1e30, 1e29, 0.0]];
        for color in colors {
            let picture = whole(1, 1, |_, _| [color[0], color[1], color[2], 1.0]);
            let (_, _, data) = decoded(&encode(&picture, &Receipt::default()));
            for (got, wanted) in data.iter().zip(color) {
                assert!((got - wanted).abs() <= color[0] / 256.0, "{got} {wanted}");
            }
        }
    }

    #[test]
    fn the_ends_of_the_range() {
        assert_eq!(shared_exponent([0.0, -1.0, f32::NAN]), [0; 4]);
        assert_eq!(shared_exponent([1.0, 0.5, 0.0]), [128, 64, 0, 129]);
        // Rounded up to the next exponent
        assert_eq!(shared_exponent([0.999_999, 0.0, 0.0]), [128, 0, 0, 129]);
        assert_eq!(shared_exponent([f32::INFINITY, f32::MAX, 1.0]), [255, 255, 0, 255]);
        assert_eq!(shared_exponent([1e-45, 0.0, 0.0]), [0; 4]);
        assert_eq!(shared_exponent([f32::MIN_POSITIVE, 0.0, 0.0]), [128, 0, 0, 3]);
    }

    #[test]
    fn any_text_is_one_line_and_comes_back() {
        for text in ["", "plain", "a\nb\r\n\\n", "\\u{41}", "\u{7f}\u{1}\t", "end\\", "日本"] {
            assert!(!escape(text).contains(char::is_control));
            assert_eq!(unescape(&escape(text)), text);
        }
        assert_eq!(unescape("\\x \\u{zz} \\"), "\\x \\u{zz} \\");
    }

    #[test]
    fn the_receipt_is_in_comments() {
        let bytes = encode(&whole(1, 1, |_, _| [0.0; 4]), &receipt());
        let text = String::from_utf8_lossy(&bytes);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "#?RADIANCE");
        assert_eq!(lines[1], format!("SOFTWARE={SOFTWARE}"));
        assert_eq!(lines[2], "# firstlight:scene_hash 9f1c");
        assert_eq!(lines[3], "# firstlight:names Würfel, \"Kugel\"\\nback\\\\slash = 1");
    }
}
