//! PNG files, 8 and 16 bits a channel.
//!
//! Straight alpha, as the format wants: colour is divided by alpha while it is still linear, then encoded. RGB if every
//! alpha is 1, otherwise RGBA. The encoding is said with an sRGB chunk, or with gAMA and cHRM; the receipt is in iTXt
//! chunks `firstlight:KEY`, the program in a tEXt chunk `Software`.

use ::png as codec;
pub(super) use codec::ColorType;
use codec::text_metadata::{ITXtChunk, TEXtChunk};

use super::plane::BUFFER_KEY;
use super::{ImageError, NamedPlane, PREFIX, Receipt, SOFTWARE, Window};
use crate::color::{Display, Encoding, Quantizer};
use crate::parallel::{self, CHUNK};

/// Bits a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Depth {
    Eight,
    Sixteen,
}

/// What a PNG file holds.
pub(super) struct PngSamples {
    pub window: Window,
    pub depth: Depth,
    pub color: ColorType,
    /// How colours are encoded; `None` for numbers that are no colours.
    pub encoding: Option<Encoding>,
    /// Rows from the top, 16 bits with the high byte first.
    pub bytes: Vec<u8>,
}

impl Depth {
    /// The code of 1.
    pub fn largest(self) -> u32 {
        match self {
            Depth::Eight => 255,
            Depth::Sixteen => 65535,
        }
    }

    /// Bits a sample.
    pub fn bits(self) -> u32 {
        match self {
            Depth::Eight => 8,
            Depth::Sixteen => 16,
        }
    }

    /// The type of a sample, as numpy names it.
    fn number_type(self) -> &'static str {
        match self {
            Depth::Eight => "uint8",
            Depth::Sixteen => "uint16",
        }
    }
}

/// The bytes of a PNG file of a colour. The pixels, which are those of `of`, and the receipt have been checked.
pub(super) fn encode(
    window: Window,
    of: &NamedPlane,
    pixels: &[[f32; 4]],
    depth: Depth,
    display: &Display,
    receipt: &Receipt,
) -> Result<Vec<u8>, ImageError> {
    if let Some(fault) = display.fault() {
        return Err(ImageError::Display(fault));
    }
    // No alpha where every pixel has 1
    let alpha = pixels.iter().any(|pixel| pixel[3] != 1.0);
    let color = if alpha { ColorType::Rgba } else { ColorType::Rgb };
    let bytes = quantize(window, pixels, depth, display, alpha);
    let samples = PngSamples { window, depth, color, encoding: Some(display.encoding), bytes };
    let channels = if alpha { "R G B A" } else { "R G B" };
    let meaning = "unit display-encoded; space -; straight alpha, never encoded";
    samples.encode(&samples.described(of, channels, meaning, &receipt.shown_by(Some(display))))
}

/// The samples of an 8-bit PNG file of a picture, by rows as `pixels` are: display-encoded red, green and blue; with
/// `alpha` of the straight colour, and alpha after it; without, of the colour as it is, which lies on black.
///
/// # Errors
/// A display outside what it may be.
pub fn display_bytes(pixels: &[[f32; 4]], display: &Display, alpha: bool) -> Result<Vec<u8>, ImageError> {
    if let Some(fault) = display.fault() {
        return Err(ImageError::Display(fault));
    }
    let row = u32::try_from(pixels.len().clamp(1, CHUNK)).expect("a chunk is small");
    let rows = Window { x: 0, y: 0, width: row, height: 1 };
    Ok(quantize(rows, pixels, Depth::Eight, display, alpha))
}

/// The red, green and blue of a picture on black, 8 bits each. The display has been checked.
pub(super) fn display_samples(window: Window, pixels: &[[f32; 4]], display: &Display) -> Vec<u8> {
    quantize(window, pixels, Depth::Eight, display, false)
}

/// The samples of a picture.
fn quantize(window: Window, pixels: &[[f32; 4]], depth: Depth, display: &Display, alpha: bool) -> Vec<u8> {
    let largest = depth.largest();
    let color = Quantizer::for_count(display, largest, pixels.len().saturating_mul(3));
    let rgb = |[r, g, b, _]: [f32; 4]| color.codes([r, g, b]);
    let rgba = |pixel| {
        let [r, g, b, a] = straight(pixel);
        let [r, g, b] = color.codes([r, g, b]);
        [r, g, b, Quantizer::linear(a, largest)]
    };
    match (depth, alpha) {
        (Depth::Eight, false) => each(window, pixels, |p| rgb(p).map(|code| code as u8)),
        (Depth::Eight, true) => each(window, pixels, |p| rgba(p).map(|code| code as u8)),
        (Depth::Sixteen, false) => each(window, pixels, |p| rgb(p).map(u16::to_be_bytes)).into_flattened(),
        (Depth::Sixteen, true) => each(window, pixels, |p| rgba(p).map(u16::to_be_bytes)).into_flattened(),
    }
}

/// What `samples` makes of each pixel, one after another; rows in parallel.
fn each<T: Copy + Default + Send, const N: usize>(
    window: Window,
    pixels: &[[f32; 4]],
    samples: impl Fn([f32; 4]) -> [T; N] + Sync,
) -> Vec<T> {
    let width = window.width as usize;
    let mut all = vec![[T::default(); N]; pixels.len()];
    parallel::for_each_chunk(&mut all, width, |y, row| {
        for (out, pixel) in row.iter_mut().zip(&pixels[y * width..]) {
            *out = samples(*pixel);
        }
    });
    all.into_flattened()
}

/// Divides the colour by alpha. What covers nothing is black; an alpha above 1 counts as 1.
fn straight([r, g, b, a]: [f32; 4]) -> [f32; 4] {
    if a > 0.0 && a < 1.0 {
        [r / a, g / a, b / a, a]
    } else if a >= 1.0 {
        [r, g, b, 1.0]
    } else {
        [0.0; 4]
    }
}

impl PngSamples {
    /// A receipt that says of a plane what its samples are, and their hash.
    pub fn described(&self, of: &NamedPlane, channels: &str, meaning: &str, receipt: &Receipt) -> Receipt {
        let (kind, sampling) = (self.depth.number_type(), of.plane.sampling().name());
        let hash = blake3::hash(&self.bytes).to_hex();
        let said = format!("channels {channels}; {kind}; {meaning}; {sampling}; blake3 {hash}");
        receipt.with(&format!("{BUFFER_KEY}{}", of.name), said)
    }

    /// The bytes of a file.
    pub fn encode(&self, receipt: &Receipt) -> Result<Vec<u8>, ImageError> {
        self.write(receipt).map_err(|e| ImageError::Encode { format: "PNG", reason: e.to_string() })
    }

    fn write(&self, receipt: &Receipt) -> Result<Vec<u8>, codec::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = codec::Encoder::new(&mut bytes, self.window.width, self.window.height);
        encoder.set_color(self.color);
        encoder.set_depth(match self.depth {
            Depth::Eight => codec::BitDepth::Eight,
            Depth::Sixteen => codec::BitDepth::Sixteen,
        });
        // Thirteen times as fast as the default
        encoder.set_compression(codec::Compression::Fast);
        // Say what the numbers mean
        match self.encoding {
            None => {}
            Some(Encoding::Srgb) => encoder.set_source_srgb(codec::SrgbRenderingIntent::RelativeColorimetric),
            Some(Encoding::Gamma(gamma)) => set_gamma(&mut encoder, gamma),
            Some(Encoding::Linear) => set_gamma(&mut encoder, 1.0),
        }
        let mut writer = encoder.write_header()?;
        writer.write_text_chunk(&TEXtChunk::new("Software", SOFTWARE))?;
        for (key, value) in &receipt.entries {
            let mut keyword = format!("{PREFIX}{key}");
            // Only the key of the one buffer grows, with the name of a light, which stands in `buffers` too
            if keyword.len() > MAX_KEYWORD {
                keyword = format!("{PREFIX}{LONG_KEY}");
            }
            writer.write_text_chunk(&ITXtChunk::new(keyword, value.as_str()))?;
        }
        writer.write_image_data(&self.bytes)?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// In place of the key of a buffer whose name is too long for a keyword.
pub(super) const LONG_KEY: &str = "buffer";

/// No keyword of a text chunk is longer.
const MAX_KEYWORD: usize = 79;

/// Whether a chunk of a receipt comes before the pixels of a PNG file.
///
/// # Errors
/// The file ends before that is known, or cannot be read.
pub(super) fn has_receipt(mut file: &mut dyn std::io::Read) -> std::io::Result<bool> {
    let mut signature = [0; 8];
    file.read_exact(&mut signature)?;
    if signature != *b"\x89PNG\r\n\x1a\n" {
        return Ok(false);
    }
    loop {
        let mut head = [0; 8];
        file.read_exact(&mut head)?;
        let [a, b, c, d, kind @ ..] = head;
        let mut rest = u64::from(u32::from_be_bytes([a, b, c, d])) + 4;
        match &kind {
            b"IDAT" | b"IEND" => return Ok(false),
            b"iTXt" if rest > PREFIX.len() as u64 => {
                let mut begin = [0; PREFIX.len()];
                file.read_exact(&mut begin)?;
                if begin == PREFIX.as_bytes() {
                    return Ok(true);
                }
                rest -= PREFIX.len() as u64;
            }
            _ => {}
        }
        let skipped = std::io::copy(&mut std::io::Read::take(&mut file, rest), &mut std::io::sink())?;
        if skipped < rest {
            return Err(std::io::ErrorKind::UnexpectedEof.into());
        }
    }
}

/// The gAMA chunk holds 100000 / gamma and cHRM the primaries of Rec. 709. A gamma that gAMA cannot hold goes unsaid.
fn set_gamma(encoder: &mut codec::Encoder<'_, &mut Vec<u8>>, gamma: f64) {
    let scaled = (100_000.0 / gamma).round();
    if (1.0..=2_147_483_647.0).contains(&scaled) {
        encoder.set_source_gamma(codec::ScaledFloat::from_scaled(scaled as u32));
        let at = |x, y| (codec::ScaledFloat::from_scaled(x), codec::ScaledFloat::from_scaled(y));
        encoder.set_source_chromaticities(codec::SourceChromaticities {
            white: at(31270, 32900),
            red: at(64000, 33000),
            green: at(30000, 60000),
            blue: at(15000, 6000),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{receipt, whole};
    use super::super::{Format, Image, Window};
    use super::*;

    fn decode(bytes: &[u8]) -> (codec::Info<'static>, Vec<u8>) {
        let mut reader = codec::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut samples = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut samples).unwrap();
        reader.finish().unwrap();
        (reader.info().clone(), samples)
    }

    fn encoded(picture: &Image, format: Format, encoding: Encoding, exposure: f64) -> (codec::Info<'static>, Vec<u8>) {
        decode(
            &picture
                .encode(format, &Display { encoding, exposure, ..Display::default() }, &Receipt::default())
                .unwrap(),
        )
    }

    #[test]
    fn opaque_pictures_are_rgb() {
        let picture = whole(2, 1, |x, _| if x == 0 { [0.0, 0.5, 1.0, 1.0] } else { [f32::NAN, 0.18, 9.0, 1.0] });
        let (info, samples) = encoded(&picture, Format::Png8, Encoding::Srgb, 0.0);
        assert_eq!((info.width, info.height), (2, 1));
        assert_eq!((info.color_type, info.bit_depth), (codec::ColorType::Rgb, codec::BitDepth::Eight));
        assert_eq!(samples, [0, 188, 255, 0, 118, 255]);
        assert!(info.srgb.is_some() && info.gama_chunk.is_none());
        // One stop darker, linear, 16 bits: 65535 / 4 = 16383.75
        let (info, samples) = encoded(&picture, Format::Png16, Encoding::Linear, -1.0);
        assert_eq!((info.color_type, info.bit_depth), (codec::ColorType::Rgb, codec::BitDepth::Sixteen));
        assert_eq!(samples[..6], [0, 0, 0x40, 0x00, 0x80, 0x00]);
        assert_eq!(info.gama_chunk.unwrap().into_scaled(), 100_000);
        assert!(info.srgb.is_none() && info.chrm_chunk.is_some());
    }

    #[test]
    fn alpha_is_straight() {
        // Colour 0.5 under alpha 0.5, an opaque pixel, one that covers nothing, and one that glows without covering
        let pixels = [[0.25, 0.25, 0.0, 0.5], [0.5, 0.5, 0.5, 1.0], [0.0; 4], [1.0, 1.0, 1.0, 0.0]];
        let picture = whole(4, 1, |x, _| pixels[x as usize]);
        let (info, samples) = encoded(&picture, Format::Png8, Encoding::Srgb, 0.0);
        assert_eq!(info.color_type, codec::ColorType::Rgba);
        let display = Display::default();
        assert_eq!(display_bytes(&pixels, &display, true).unwrap(), samples);
        // On black, 0.25 is 137, whatever covers it
        let on_black = display_bytes(&pixels, &display, false).unwrap();
        assert_eq!(on_black, [137, 137, 0, 188, 188, 188, 0, 0, 0, 255, 255, 255]);
        // Alpha is never encoded: 255 / 2 = 127.5, rounded up
        assert_eq!(samples, [188, 188, 0, 128, 188, 188, 188, 255, 0, 0, 0, 0, 0, 0, 0, 0]);
        let (_, samples) = encoded(&picture, Format::Png16, Encoding::Linear, 0.0);
        assert_eq!(samples[..8], [0x80, 0, 0x80, 0, 0, 0, 0x80, 0]);
    }

    #[test]
    fn gamma_is_said() {
        let picture = whole(1, 1, |_, _| [0.5, 0.5, 0.5, 1.0]);
        let (info, samples) = encoded(&picture, Format::Png8, Encoding::Gamma(2.2), 0.0);
        assert_eq!(samples, [186; 3]);
        assert_eq!(info.gama_chunk.unwrap().into_scaled(), 45455);
        // What gAMA cannot hold
        for gamma in [1e-300, 1e300] {
            let (info, _) = encoded(&picture, Format::Png8, Encoding::Gamma(gamma), 0.0);
            assert!(info.gama_chunk.is_none() && info.srgb.is_none());
        }
    }

    #[test]
    fn text_chunks_are_there() {
        let picture = whole(1, 1, |_, _| [0.5; 4]);
        let (info, _) = decode(&picture.encode(Format::Png8, &Display::default(), &receipt()).unwrap());
        let software = &info.uncompressed_latin1_text[0];
        assert_eq!((software.keyword.as_str(), software.text.as_str()), ("Software", SOFTWARE));
        let found: Vec<_> = info.utf8_text.iter().map(|t| (t.keyword.clone(), t.get_text().unwrap())).collect();
        let mut shown = receipt().shown_by(Some(&Display::default()));
        // Of the samples of the one pixel, (0.5, 0.5, 0.5) over alpha 0.5
        let hash = blake3::hash(&[255, 255, 255, 128]).to_hex();
        let said = "channels R G B A; uint8; unit display-encoded; space -; straight alpha, never encoded; filtered";
        shown.entries.push(("buffer.color".into(), format!("{said}; blake3 {hash}")));
        let expected: Vec<_> = shown.entries.into_iter().map(|(k, v)| (format!("firstlight:{k}"), v)).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn a_window_is_the_picture() {
        let mut picture = whole(3, 2, |_, _| [0.0; 4]);
        picture.film = [100, 50];
        picture.window = Window { x: 97, y: 48, width: 3, height: 2 };
        let (info, _) = encoded(&picture, Format::Png8, Encoding::Srgb, 0.0);
        assert_eq!((info.width, info.height), (3, 2));
    }

    #[test]
    fn small_and_large_pictures_agree() {
        // 16 bits go by the formula in a small picture, by a table in a large one
        let small = whole(64, 1, |x, _| [x as f32 / 63.0, 0.3, 0.7, 1.0]);
        let large = whole(64, 1024, |x, _| [x as f32 / 63.0, 0.3, 0.7, 1.0]);
        let (_, a) = encoded(&small, Format::Png16, Encoding::Srgb, 0.0);
        let (_, b) = encoded(&large, Format::Png16, Encoding::Srgb, 0.0);
        assert!(b.chunks(a.len()).all(|row| row == a));
    }

    #[test]
    fn a_broken_display_is_an_error() {
        let picture = whole(1, 1, |_, _| [0.5; 4]);
        let display = Display { encoding: Encoding::Gamma(-1.0), ..Display::default() };
        let fault = picture.encode(Format::Png8, &display, &Receipt::default()).unwrap_err().to_string();
        assert_eq!(fault, "gamma -1 is not a finite number greater than 0");
    }
}
