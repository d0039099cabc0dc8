//! OpenEXR files: the film as it is, in 32-bit floats, and ids in 32-bit whole numbers; if asked for, colours and
//! shares in 16-bit floats.
//!
//! Of the picture channels R, G, B, and A unless every alpha is 1; premultiplied, as the format wants. Of another plane
//! one layer, `depth.Z`; Cryptomatte has channels of its own and texts `cryptomatte/KEY/...`. The data window is the
//! picture's window, the display window the whole film. Rec. 709 chromaticities. The receipt is in string attributes
//! `firstlight:KEY`, UTF-8, the program in `software`. Lossless ZIP in blocks of 16 rows.

use std::io::Cursor;
use std::ops::Range;

use ::exr as codec;
use codec::block::chunk::Chunk;
use codec::block::writer::ChunksWriter;
use codec::block::{UncompressedBlock, enumerate_ordered_header_block_indices};
use codec::error::Error;
use codec::math::Vec2;
use codec::meta::attribute::{
    AttributeValue, ChannelDescription, Chromaticities, IntegerBounds, LineOrder, SampleType, Text,
};
use codec::meta::header::Header;
use codec::meta::{BlockDescription, attribute::Text as Name};
use codec::prelude::{Compression, SmallVec, f16};

use super::{
    FileSettings, ImageError, NamedPlane, PREFIX, Plane, PlaneFile, PlaneNumbers, Receipt, SOFTWARE, cryptomatte,
};
use crate::parallel;

/// One channel of a file.
struct ExrChannel<'a> {
    name: String,
    numbers: PlaneNumbers<'a>,
    kind: SampleType,
    /// Which of so many numbers of a pixel it is.
    place: usize,
    of: usize,
}

/// The bytes of an EXR file. The planes and the receipt have been checked.
pub(super) fn encode(file: &PlaneFile, settings: &FileSettings, receipt: &Receipt) -> Result<Vec<u8>, ImageError> {
    let fault = |e: Error| ImageError::Encode { format: "EXR", reason: e.to_string() };
    let channels = channels(file, settings);
    let texts = texts(file, receipt);
    let header = header(file, &channels, &texts);
    let width = file.window.width as usize;
    // Compress all blocks of rows at once
    let headers: SmallVec<[Header; 3]> = SmallVec::from_elem(header, 1);
    let blocks: Vec<_> = enumerate_ordered_header_block_indices(&headers).collect();
    let chunks = parallel::collect(blocks.len(), |block| {
        let (i, index) = blocks[block];
        let rows = index.pixel_position.y()..index.pixel_position.y() + index.pixel_size.y();
        let data = rows_of(&channels, rows, width);
        Ok((i, UncompressedBlock { index, data }.compress_to_chunk(&headers)?))
    });
    let chunks: Vec<(usize, Chunk)> = chunks.into_iter().collect::<Result<_, Error>>().map_err(fault)?;
    let mut bytes = Cursor::new(Vec::new());
    codec::block::write(&mut bytes, headers, true, |_, writer| {
        chunks.into_iter().try_for_each(|(i, chunk)| writer.write_chunk(i, chunk))
    })
    .map_err(fault)?;
    let mut bytes = bytes.into_inner();
    order_attributes(&mut bytes, &texts);
    Ok(bytes)
}

/// The channels of all planes, by name, as the format wants them.
fn channels<'a>(file: &PlaneFile<'a>, settings: &FileSettings) -> Vec<ExrChannel<'a>> {
    let mut all = Vec::new();
    for NamedPlane { name: of, plane, numbers } in file.planes {
        let names = plane.channels();
        let kind = match numbers {
            PlaneNumbers::Floats(_) if settings.is_half(*plane) => SampleType::F16,
            PlaneNumbers::Floats(_) => SampleType::F32,
            PlaneNumbers::Wholes(_) => SampleType::U32,
        };
        for (place, name) in names.iter().enumerate() {
            if *plane == Plane::Color && *name == "A" && is_opaque(numbers) {
                continue;
            }
            // The picture's are those of the file itself, and Cryptomatte has its own, as readers expect it
            let name = if plane.names_channels() { (*name).to_owned() } else { format!("{of}.{name}") };
            all.push(ExrChannel { name, numbers: *numbers, kind, place, of: names.len() });
        }
    }
    all.sort_by(|a, b| a.name.cmp(&b.name));
    all
}

/// Whether every alpha of a picture is 1.
fn is_opaque(picture: &PlaneNumbers) -> bool {
    matches!(picture, PlaneNumbers::Floats(numbers) if numbers.iter().skip(3).step_by(4).all(|alpha| *alpha == 1.0))
}

/// What it says in texts, by their names: what layers of Cryptomatte are, and the receipt.
fn texts(file: &PlaneFile, receipt: &Receipt) -> Vec<(String, String)> {
    let mut texts = cryptomatte::metadata(file.planes, receipt);
    texts.extend(receipt.entries.iter().map(|(key, value)| (format!("{PREFIX}{key}"), value.clone())));
    texts
}

/// Everything that the file says before its pixels.
fn header(file: &PlaneFile, channels: &[ExrChannel], texts: &[(String, String)]) -> Header {
    let window = file.window;
    let size = Vec2(window.width as usize, window.height as usize);
    let channels = channels.iter().map(|c| ChannelDescription::named(c.name.as_str(), c.kind)).collect();
    let mut header = Header::new(Name::from(""), size, channels).with_encoding(
        Compression::ZIP16,
        BlockDescription::ScanLines,
        LineOrder::Increasing,
    );
    header.shared_attributes.display_window =
        IntegerBounds::from_dimensions(Vec2(file.film[0] as usize, file.film[1] as usize));
    header.shared_attributes.chromaticities = Some(Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.3, 0.6),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.329),
    });
    let own = &mut header.own_attributes;
    own.layer_name = None;
    own.layer_position = Vec2(window.x as i32, window.y as i32);
    own.software_name = Some(Text::from(SOFTWARE));
    for (name, value) in texts {
        let text = Text::from_bytes_unchecked(value.as_bytes().into());
        own.other.insert(Text::from(name.as_str()), AttributeValue::Text(text));
    }
    header
}

/// One row after another, and in each one channel after another.
fn rows_of(channels: &[ExrChannel], rows: Range<usize>, width: usize) -> Vec<u8> {
    let mut data = Vec::with_capacity(rows.len() * width * channels.len() * 4);
    for row in rows {
        for ExrChannel { numbers, kind, place, of, .. } in channels {
            let all = row * width * of..(row + 1) * width * of;
            match numbers {
                PlaneNumbers::Floats(numbers) if *kind == SampleType::F16 => {
                    let row = numbers[all].iter().skip(*place).step_by(*of);
                    data.extend(row.flat_map(|n| half(*n).to_ne_bytes()));
                }
                PlaneNumbers::Floats(numbers) => {
                    data.extend(numbers[all].iter().skip(*place).step_by(*of).flat_map(|n| n.to_ne_bytes()));
                }
                PlaneNumbers::Wholes(numbers) => {
                    data.extend(numbers[all].iter().skip(*place).step_by(*of).flat_map(|n| n.to_ne_bytes()));
                }
            }
        }
    }
    data
}

/// The nearest 16-bit float; the largest, 65504, of what is beyond it.
fn half(number: f32) -> f16 {
    let largest = f16::MAX.to_f32();
    f16::from_f32(number.clamp(-largest, largest))
}

/// The bytes of numbers as 16-bit floats, the lowest of each first.
pub(super) fn half_bytes(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| half(*number).to_le_bytes()).collect()
}

/// One attribute of a header: its name, its type, where its value stands, and where all of it stands.
pub(super) struct Attribute<'a> {
    pub(super) name: &'a [u8],
    pub(super) kind: &'a [u8],
    pub(super) value: Range<usize>,
    all: Range<usize>,
}

/// The attributes of the first header, in the order of the file; as many as are whole.
pub(super) fn attributes(bytes: &[u8]) -> Vec<Attribute<'_>> {
    let mut found = Vec::new();
    // After the magic number and the version
    let mut at = 8;
    // Each is a name and a type, both ended by 0, the length of the value, and the value; an empty name ends them
    let word = |at: usize| {
        let rest = bytes.get(at..)?;
        Some(&rest[..rest.iter().position(|&b| b == 0)?])
    };
    while let Some(name) = word(at).filter(|name| !name.is_empty()) {
        let Some(kind) = word(at + name.len() + 1) else { break };
        let start = at + name.len() + kind.len() + 2;
        let Some(length) = bytes.get(start..).and_then(|rest| rest.first_chunk::<4>()) else { break };
        let end = (start + 4).saturating_add(u32::from_le_bytes(*length) as usize);
        if end > bytes.len() {
            break;
        }
        found.push(Attribute { name, kind, value: start + 4..end, all: at..end });
        at = end;
    }
    found
}

/// Puts the texts behind all other attributes, in their own order. The library keeps them in a hash map, whose order is
/// another on every run. The header stays as long as it was.
fn order_attributes(bytes: &mut [u8], texts: &[(String, String)]) {
    let rank = |a: &Attribute| texts.iter().position(|(name, _)| name.as_bytes() == a.name);
    let mut list = attributes(bytes);
    let Some(all) = list.first().zip(list.last()).map(|(a, b)| a.all.start..b.all.end) else { return };
    // `None`, all others, comes first, and the sort is stable
    list.sort_by_cached_key(rank);
    let ordered: Vec<u8> = list.iter().flat_map(|a| &bytes[a.all.clone()]).copied().collect();
    bytes[all].copy_from_slice(&ordered);
}

#[cfg(test)]
mod tests {
    use super::super::Image;
    use super::super::tests::{receipt, whole};
    use super::super::{Format, StoredPlanes, Window};
    use super::*;
    use crate::color::Display;
    use codec::prelude::{FlatImage, FlatSamples, ReadChannels, ReadLayers, read};

    fn read_back(bytes: &[u8]) -> FlatImage {
        let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
        reader.from_buffered(Cursor::new(bytes)).unwrap()
    }

    fn encoded(picture: &Image, receipt: &Receipt) -> Vec<u8> {
        picture.encode(Format::Exr, &Display::default(), receipt).unwrap()
    }

    #[test]
    fn windows_channels_and_numbers() {
        let mut picture = whole(5, 37, |x, y| [x as f32, y as f32 * 1e-9, 1.0 / 3.0, 0.25]);
        picture.film = [100, 80];
        picture.window.x = 11;
        picture.window.y = 43;
        let file = read_back(&encoded(&picture, &Receipt::default()));
        assert_eq!(file.attributes.display_window, IntegerBounds::new((0, 0), (100, 80)));
        assert_eq!(file.attributes.chromaticities.unwrap().red, Vec2(0.64, 0.33));
        let layer = &file.layer_data[0];
        assert_eq!((layer.attributes.layer_position, layer.size), (Vec2(11, 43), Vec2(5, 37)));
        assert_eq!(layer.attributes.software_name.as_ref().unwrap().to_string(), SOFTWARE);
        assert_eq!(layer.attributes.capture_date, None);
        for (channel, (name, place)) in layer.channel_data.list.iter().zip([("A", 3), ("B", 2), ("G", 1), ("R", 0)]) {
            assert_eq!(channel.name.to_string(), name);
            let FlatSamples::F32(data) = &channel.sample_data else { panic!("not f32") };
            assert!(data.iter().zip(&picture.pixels).all(|(d, p)| d.to_bits() == p[place].to_bits()));
        }
    }

    #[test]
    fn opaque_pictures_have_no_alpha() {
        let file = read_back(&encoded(&whole(2, 2, |_, _| [2.0, 0.0, 0.0, 1.0]), &Receipt::default()));
        let names: Vec<_> = file.layer_data[0].channel_data.list.iter().map(|c| c.name.to_string()).collect();
        assert_eq!(names, ["B", "G", "R"]);
    }

    #[test]
    fn planes_are_layers_beside_the_picture() {
        let (color, depth, ids) = ([0.5f32, 1.0, 2.0, 1.0, 0.0, 0.0, 3.0, 1.0], [f32::INFINITY, 4.0], [1u32, u32::MAX]);
        let normal = [1.0f32, 2.0, 3.0, 4.0, 5.0, 6.0];
        let planes = [
            NamedPlane::new(Plane::Color, PlaneNumbers::Floats(&color)),
            NamedPlane::new(Plane::ObjectId, PlaneNumbers::Wholes(&ids)),
            NamedPlane::new(Plane::Depth, PlaneNumbers::Floats(&depth)),
            NamedPlane::new(Plane::Normal, PlaneNumbers::Floats(&normal)),
        ];
        let window = Window { x: 0, y: 0, width: 2, height: 1 };
        let file = PlaneFile { film: [2, 1], window, planes: &planes };
        let file = read_back(&file.encode(Format::Exr, &FileSettings::default(), &Receipt::default()).unwrap());
        let channels = &file.layer_data[0].channel_data.list;
        let names: Vec<_> = channels.iter().map(|c| c.name.to_string()).collect();
        assert_eq!(names, ["B", "G", "R", "depth.Z", "normal.X", "normal.Y", "normal.Z", "object-id.ID"]);
        let numbers: Vec<_> = channels.iter().map(|c| c.sample_data.clone()).collect();
        assert_eq!(numbers[2], FlatSamples::F32(vec![0.5, 0.0]));
        assert_eq!(numbers[3], FlatSamples::F32(depth.to_vec()));
        assert_eq!(numbers[5], FlatSamples::F32(vec![2.0, 5.0]));
        assert_eq!(numbers[7], FlatSamples::U32(ids.to_vec()));
    }

    #[test]
    fn colors_and_shares_can_have_16_bits() {
        let (color, depth) = ([0.1f32, -2.0, 1e6, 0.5, f32::NAN, 0.0, 65504.0, 1.0], [0.1f32, f32::INFINITY]);
        let planes = [
            NamedPlane::new(Plane::Color, PlaneNumbers::Floats(&color)),
            NamedPlane::new(Plane::Depth, PlaneNumbers::Floats(&depth)),
        ];
        let window = Window { x: 0, y: 0, width: 2, height: 1 };
        let settings = FileSettings { half: true, ..FileSettings::default() };
        let file = PlaneFile { film: [2, 1], window, planes: &planes };
        let bytes = file.encode(Format::Exr, &settings, &Receipt::default()).unwrap();
        let channels = read_back(&bytes).layer_data.remove(0).channel_data.list;
        let kinds: Vec<_> = channels.iter().map(|c| c.sample_data.clone()).collect();
        assert_eq!(kinds[0], FlatSamples::F16([0.5, 1.0].map(f16::from_f32).to_vec()));
        assert_eq!(kinds[1], FlatSamples::F16([65504.0; 2].map(f16::from_f32).to_vec()));
        assert_eq!(kinds[4], FlatSamples::F32(depth.to_vec()));
        let FlatSamples::F16(red) = &kinds[3] else { panic!("not f16") };
        // A half has 11 bits: 0.1 is 1638.4 / 2^14
        assert!(red[0].to_f32() == 1638.0 / 16384.0 && red[1].is_nan());
        let stored = StoredPlanes::read(&bytes).unwrap();
        assert!(stored.receipt.get("buffer.color").unwrap().starts_with("channels R G B A; float16; "));
        assert_eq!(FileSettings::of(&stored.receipt), settings);
        assert!(stored.planes.iter().all(|plane| stored.is_as_written(plane) == Some(true)));
    }

    #[test]
    fn the_receipt_is_in_attributes_in_its_order() {
        let bytes = encoded(&whole(2, 2, |_, _| [0.5; 4]), &receipt());
        let file = read_back(&bytes);
        for (key, value) in receipt().entries {
            let name = Text::from(format!("firstlight:{key}").as_str());
            let AttributeValue::Text(text) = &file.layer_data[0].attributes.other[&name] else { panic!("{key}") };
            assert_eq!(text.bytes(), value.as_bytes());
        }
        let names: Vec<_> = attributes(&bytes).iter().map(|a| String::from_utf8_lossy(a.name).into_owned()).collect();
        let keys = receipt().entries.into_iter().map(|(key, _)| key).chain(["buffer.color".into()]);
        let last: Vec<_> = keys.map(|key| format!("firstlight:{key}")).collect();
        assert_eq!(names[names.len() - last.len()..], last);
        // The walk ends where the header does
        assert_eq!(bytes[attributes(&bytes).last().unwrap().all.end], 0);
    }

    #[test]
    fn the_largest_window_position_is_held() {
        let picture = Image {
            film: [65536; 2],
            window: Window { x: 65535, y: 65535, width: 1, height: 1 },
            pixels: vec![[1.0; 4]],
        };
        let file = read_back(&encoded(&picture, &Receipt::default()));
        assert_eq!(file.layer_data[0].attributes.layer_position, Vec2(65535, 65535));
    }
}
