//! Reading back the pictures that firstlight writes, number by number, for comparing and checking them.

use std::io::Cursor;

use ::png;

use super::contain::contained;
use super::damage;
use super::plane::{BUFFER_KEY, is_half};
use super::read::{Limits, check_size};
use super::{Format, ImageError, PREFIX, Plane, PlaneNumbers, PlaneVec, Receipt, Window};

/// A picture file as it was stored: nothing decoded, nothing multiplied.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredImage {
    /// Which kind of file.
    pub format: Format,
    /// The width and height of the whole film. Only EXR knows it; the others say that of the picture.
    pub film: [u32; 2],
    /// The part of it that `pixels` holds. Only EXR knows where; the others begin at (0, 0).
    pub window: Window,
    /// Red, green, blue, alpha; rows from the top, each from the left. PNG and JPEG: display-encoded, straight alpha, 0
    /// to 1. EXR: linear, premultiplied. HDR: linear. Alpha is 1 in a file without it.
    pub pixels: Vec<[f32; 4]>,
    /// What firstlight wrote into the file; empty in a file of other programs.
    pub receipt: Receipt,
}

/// As large as a film can be.
pub(super) const LIMITS: Limits = Limits { side: 65536, texels: 1 << 27 };

/// All that a picture file holds, as it was stored: nothing decoded, nothing multiplied.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredPlanes {
    /// Which kind of file.
    pub format: Format,
    /// The width and height of the whole film. Only EXR knows it; the others say that of the picture.
    pub film: [u32; 2],
    /// The part of it that the planes hold. Only EXR knows where; the others begin at (0, 0).
    pub window: Window,
    /// The buffers, in the order of the file.
    pub planes: Vec<StoredPlane>,
    /// What firstlight wrote into the file; empty in a file of other programs.
    pub receipt: Receipt,
}

/// A buffer of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredPlane {
    /// What it is called: `color` is the picture.
    pub name: String,
    /// The names of its channels, as [`Plane::channels`](crate::Plane::channels) has them.
    pub channels: Vec<String>,
    /// Rows from the top, each from the left, the channels of a pixel side by side. The samples of PNG and JPEG files
    /// are whole numbers.
    pub numbers: PlaneVec,
    /// Of a picture of 8 or 16 bits, which is display-encoded, the largest number: 255 or 65535.
    pub steps: Option<u32>,
}

impl StoredPlanes {
    /// Reads a PNG, JPEG, EXR, NPZ, NPY or HDR file; which of them, its first bytes say. Made for the files that
    /// firstlight writes; those of other programs are read if they are of the same make: no tiles with levels, no
    /// compressed arrays.
    ///
    /// # Errors
    /// [`ImageError::UnknownKind`]; [`ImageError::TooLarge`] above 65536 a side or 2^27 in all, the largest film;
    /// [`ImageError::Damaged`]; [`ImageError::WithoutExr`].
    pub fn read(bytes: &[u8]) -> Result<StoredPlanes, ImageError> {
        if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
            contained("PNG", || read_png(bytes))
        } else if bytes.starts_with(&[0xff, 0xd8, 0xff]) {
            super::jpeg::read(bytes)
        } else if bytes.starts_with(b"#?RADIANCE\n") {
            contained("HDR", || read_hdr(bytes))
        } else if bytes.starts_with(b"\x93NUMPY") {
            contained("NPY", || super::npz_read::read_one(bytes))
        } else if bytes.starts_with(b"PK\x03\x04") {
            contained("NPZ", || super::npz_read::read(bytes))
        } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            #[cfg(feature = "exr")]
            return contained("EXR", || read_exr(bytes));
            #[cfg(not(feature = "exr"))]
            Err(ImageError::WithoutExr)
        } else {
            Err(ImageError::UnknownKind { expected: "PNG, JPEG, EXR, NPZ, NPY or HDR" })
        }
    }

    /// The buffer of that name.
    pub fn plane(&self, name: &str) -> Option<&StoredPlane> {
        self.planes.iter().find(|plane| plane.name == name)
    }

    /// Whether the numbers of a buffer are those that the receipt speaks of; `None` if it says nothing of them.
    pub fn is_as_written(&self, plane: &StoredPlane) -> Option<bool> {
        let said = self.receipt.get(&format!("{BUFFER_KEY}{}", plane.name))?;
        let (_, hash) = said.rsplit_once("blake3 ")?;
        let bytes = match (&plane.numbers, self.format) {
            (PlaneVec::Wholes(codes), Format::Png8) => codes.iter().map(|code| *code as u8).collect(),
            (PlaneVec::Wholes(codes), Format::Png16) => codes.iter().flat_map(|c| (*c as u16).to_be_bytes()).collect(),
            (PlaneVec::Floats(colors), Format::Hdr) => super::hdr::bytes(colors.as_chunks().0),
            (numbers, _) => numbers.numbers().stored_bytes(is_half(said)),
        };
        Some(blake3::hash(&bytes).to_hex().as_str() == hash)
    }

    /// The picture of a file that is its whole film.
    pub(super) fn picture(format: Format, [width, height]: [u32; 2], plane: StoredPlane, receipt: Receipt) -> Self {
        let window = Window { x: 0, y: 0, width, height };
        Self { format, film: [width, height], window, planes: vec![plane], receipt }
    }
}

impl StoredPlane {
    /// The picture, with the first so many of its channels.
    pub(super) fn color(numbers: PlaneVec, channels: usize, steps: Option<u32>) -> Self {
        let name = Plane::Color.name().to_owned();
        let channels = Plane::Color.channels()[..channels].iter().map(|name| (*name).to_owned()).collect();
        StoredPlane { name, channels, numbers, steps }
    }

    /// Red, green, blue and alpha of each pixel, 0 to 1 where that is a step of 8 or 16 bits; alpha is 1 where there is
    /// none. `None` if it has no such channels.
    pub fn rgba(&self) -> Option<Vec<[f32; 4]>> {
        let place = |name: &str| self.channels.iter().position(|channel| channel == name);
        let [r, g, b] = [place("R")?, place("G")?, place("B")?];
        let (a, all) = (place("A"), self.channels.len());
        fn pixels<T: Copy>(numbers: &[T], all: usize, pixel: impl Fn(&[T]) -> [f32; 4]) -> Vec<[f32; 4]> {
            numbers.chunks_exact(all).map(pixel).collect()
        }
        let steps = self.steps.unwrap_or(1) as f32;
        Some(match self.numbers.numbers() {
            PlaneNumbers::Floats(n) => pixels(n, all, |n| [n[r], n[g], n[b], a.map_or(1.0, |a| n[a])]),
            PlaneNumbers::Wholes(n) => {
                let part = |n: u32| n as f32 / steps;
                pixels(n, all, |n| [part(n[r]), part(n[g]), part(n[b]), a.map_or(1.0, |a| part(n[a]))])
            }
        })
    }
}

impl StoredImage {
    /// Reads the picture of a PNG, JPEG, EXR, NPZ, NPY or HDR file, as [`StoredPlanes::read`].
    ///
    /// # Errors
    /// Those of [`StoredPlanes::read`]; [`ImageError::Damaged`] for a file without a picture.
    pub fn read(bytes: &[u8]) -> Result<StoredImage, ImageError> {
        let StoredPlanes { format, film, window, planes, receipt } = StoredPlanes::read(bytes)?;
        let color = planes.iter().find(|plane| plane.name == Plane::Color.name());
        let pixels = color.and_then(StoredPlane::rgba).ok_or_else(|| {
            let names: Vec<&str> = planes.iter().map(|plane| plane.name.as_str()).collect();
            ImageError::Picture(format!("holds no picture: it has {}, and not color", names.join(", ")))
        })?;
        Ok(StoredImage { format, film, window, pixels, receipt })
    }
}

fn read_png(bytes: &[u8]) -> Result<StoredPlanes, ImageError> {
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
    let (format, steps, codes): (_, _, Vec<u32>) = match depth {
        png::BitDepth::Sixteen => {
            let code = |s: &[u8]| u32::from(u16::from_be_bytes([s[0], s[1]]));
            (Format::Png16, 65535, samples.chunks_exact(2).map(code).collect())
        }
        _ => (Format::Png8, 255, samples.iter().map(|&s| u32::from(s)).collect()),
    };
    let mut receipt = Receipt::default();
    for chunk in &reader.info().utf8_text {
        if let (Some(key), Ok(value)) = (chunk.keyword.strip_prefix(PREFIX), chunk.get_text()) {
            receipt.entries.push((key.into(), value));
        }
    }
    // The name of the buffer may have been too long for the key
    let asked = receipt.get("buffers").and_then(|said| serde_json::from_str::<Vec<String>>(said).ok());
    if let Some([name]) = asked.as_deref()
        && let Some((key, _)) = receipt.entries.iter_mut().find(|(key, _)| key == super::png::LONG_KEY)
    {
        *key = format!("{BUFFER_KEY}{name}");
    }
    if let Some((name, channels)) = one_buffer(&receipt, color.samples()) {
        let plane = StoredPlane { name, channels, numbers: PlaneVec::Wholes(codes), steps: Some(steps) };
        return Ok(StoredPlanes::picture(format, [width, height], plane, receipt));
    }
    let (codes, channels) = match color.samples() {
        1 => (codes.into_iter().flat_map(|v| [v; 3]).collect(), 3),
        2 => (codes.as_chunks().0.iter().flat_map(|&[v, a]| [v, v, v, a]).collect(), 4),
        channels => (codes, channels),
    };
    let plane = StoredPlane::color(PlaneVec::Wholes(codes), channels, Some(steps));
    Ok(StoredPlanes::picture(format, [width, height], plane, receipt))
}

/// The buffer that a receipt speaks of, if it is one, and the names of its channels, if they are so many.
pub(super) fn one_buffer(receipt: &Receipt, count: usize) -> Option<(String, Vec<String>)> {
    let mut said = receipt.entries.iter().filter_map(|(key, said)| Some((key.strip_prefix(BUFFER_KEY)?, said)));
    let (name, said) = said.next().filter(|_| said.next().is_none())?;
    let channels = said.strip_prefix("channels ")?.split(';').next()?;
    let channels: Vec<String> = channels.split(' ').map(str::to_owned).collect();
    (channels.len() == count).then(|| (name.to_owned(), channels))
}

fn read_hdr(bytes: &[u8]) -> Result<StoredPlanes, ImageError> {
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
            receipt.entries.push((super::hdr::unescape(key), super::hdr::unescape(value)));
        }
    }
    let colors = pixels.into_iter().flat_map(|[r, g, b, _]| [r, g, b]).collect();
    let mut plane = StoredPlane::color(PlaneVec::Floats(colors), 3, None);
    if let Some((name, _)) = one_buffer(&receipt, 3) {
        plane.name = name;
    }
    Ok(StoredPlanes::picture(Format::Hdr, [width, height], plane, receipt))
}

/// The most bytes that the channels of an EXR file may have whatever the file's length: those of the largest picture.
#[cfg(feature = "exr")]
const EXR_BYTES: u64 = 1 << 31;
/// Of larger ones, how many times the length of the file.
#[cfg(feature = "exr")]
const EXR_EXPANDS: u64 = 4096;

#[cfg(feature = "exr")]
fn read_exr(bytes: &[u8]) -> Result<StoredPlanes, ImageError> {
    use ::exr::prelude::*;
    let damaged = |reason: String| ImageError::Damaged { format: "EXR", reason };
    // Check the size
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| damaged(e.to_string()))?;
    let header = meta.headers.first().ok_or_else(|| damaged("it has no layer".into()))?;
    let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let (width, height) = (side(header.layer_size.x()), side(header.layer_size.y()));
    check_size(width, height, &LIMITS)?;
    let taken = |header: &::exr::meta::header::Header| {
        4 * header.channels.list.len() as u64 * header.layer_size.x() as u64 * header.layer_size.y() as u64
    };
    let taken = meta.headers.iter().map(taken).fold(0, u64::saturating_add);
    if taken > EXR_BYTES.max(EXR_EXPANDS * bytes.len() as u64) {
        return Err(damaged("it is too short for its size".into()));
    }
    let Vec2(x, y) = header.own_attributes.layer_position;
    let display = header.shared_attributes.display_window;
    // The windows in the film's own pixels
    let (left, top) = (i64::from(x) - i64::from(display.position.x()), i64::from(y) - i64::from(display.position.y()));
    let window = match (u32::try_from(left), u32::try_from(top)) {
        (Ok(x), Ok(y)) => Window { x, y, width, height },
        _ => return Err(damaged("its data window begins outside its display window".into())),
    };
    let film = [side(display.size.x()), side(display.size.y())];
    // Read the channels
    let reader = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let file = reader.from_buffered(Cursor::new(bytes)).map_err(|e| damaged(e.to_string()))?;
    let pixels = width as usize * height as usize;
    let mut channels = Vec::new();
    for channel in file.layer_data.channel_data.list {
        let name = channel.name.to_string();
        let numbers = match channel.sample_data {
            FlatSamples::F16(halves) => PlaneVec::Floats(halves.into_iter().map(f32::from).collect()),
            FlatSamples::F32(floats) => PlaneVec::Floats(floats),
            FlatSamples::U32(wholes) => PlaneVec::Wholes(wholes),
        };
        if numbers.numbers().count() != pixels {
            return Err(damaged(format!("its channel {name} has not a number for each pixel")));
        }
        channels.push((name, numbers));
    }
    let mut receipt = Receipt::default();
    for attribute in super::exr::attributes(bytes) {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        if let (Some(key), b"string") = (attribute.name.strip_prefix(PREFIX.as_bytes()), attribute.kind) {
            receipt.entries.push((text(key), text(&bytes[attribute.value])));
        }
    }
    Ok(StoredPlanes { format: Format::Exr, film, window, planes: planes_of(channels), receipt })
}

/// The channels of an EXR file as planes: `depth.Z` belongs to `depth`, R, G, B and A to the picture.
#[cfg(feature = "exr")]
fn planes_of(channels: Vec<(String, PlaneVec)>) -> Vec<StoredPlane> {
    let owner = |name: &str| {
        let mut owners = Plane::ALL.iter().filter(|plane| plane.names_channels());
        owners.find(|plane| plane.channels().contains(&name)).map(|plane| plane.name())
    };
    let mut layers: Vec<(String, Vec<(String, PlaneVec)>)> = Vec::new();
    for (name, numbers) in channels {
        let (layer, channel) = match (owner(&name), name.rsplit_once('.')) {
            (Some(owner), _) => (owner.to_owned(), name),
            (None, Some((layer, channel))) => (layer.to_owned(), channel.to_owned()),
            (None, None) => (name.clone(), name),
        };
        // What is whole and what is not cannot be one plane
        let is_whole = |numbers: &PlaneVec| matches!(numbers, PlaneVec::Wholes(_));
        let same = |(known, all): &&mut (String, Vec<(String, PlaneVec)>)| {
            *known == layer && is_whole(&all[0].1) == is_whole(&numbers)
        };
        match layers.iter_mut().find(same) {
            Some((_, all)) => all.push((channel, numbers)),
            None => layers.push((layer, vec![(channel, numbers)])),
        }
    }
    layers.into_iter().map(|(name, channels)| plane_of(name, channels)).collect()
}

/// One plane of channels that have as many numbers each, side by side in it: red, green, blue, alpha, x, y, z.
#[cfg(feature = "exr")]
fn plane_of(name: String, mut channels: Vec<(String, PlaneVec)>) -> StoredPlane {
    const ORDER: [&str; 9] = ["R", "G", "B", "A", "X", "Y", "Z", "U", "V"];
    // The picture leaves alpha out where it is 1 everywhere
    let names: Vec<&str> = channels.iter().map(|(name, _)| name.as_str()).collect();
    if name == Plane::Color.name() && names == ["B", "G", "R"] {
        let pixels = channels[0].1.numbers().count();
        channels.push(("A".into(), PlaneVec::Floats(vec![1.0; pixels])));
    }
    let order = Plane::from_name(&name).map_or(&ORDER[..], Plane::channels);
    channels.sort_by_key(|(name, _)| order.iter().position(|known| known == name).unwrap_or(order.len()));
    fn join<T: Copy>(all: &[&[T]]) -> Vec<T> {
        if let [one] = all {
            return one.to_vec();
        }
        (0..all[0].len()).flat_map(|i| all.iter().map(move |channel| channel[i])).collect()
    }
    let (mut floats, mut wholes) = (Vec::new(), Vec::new());
    for (_, numbers) in &channels {
        match numbers.numbers() {
            PlaneNumbers::Floats(numbers) => floats.push(numbers),
            PlaneNumbers::Wholes(numbers) => wholes.push(numbers),
        }
    }
    let numbers = if wholes.is_empty() { PlaneVec::Floats(join(&floats)) } else { PlaneVec::Wholes(join(&wholes)) };
    StoredPlane { name, channels: channels.into_iter().map(|(name, _)| name).collect(), numbers, steps: None }
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
        assert_eq!(words, "is not a PNG, JPEG, EXR, NPZ, NPY or HDR file; convert it to one");
    }

    #[test]
    fn sizes_are_checked_before_decoding() {
        let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 2000\n";
        assert!(matches!(StoredImage::read(hdr), Err(ImageError::Damaged { .. })));
        let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 65537 +X 1\n";
        assert!(matches!(StoredImage::read(hdr), Err(ImageError::TooLarge { .. })));
    }
}
