//! Reading NPZ files back: arrays that are not compressed, as [`npz`](super::npz) and `numpy.savez` write them.
//!
//! Source: numpy, "NEP 1: a simple file format for numpy arrays", versions 1.0 to 3.0.

use std::io::Read;

use rawzip::{CompressionMethod, ZipArchive};

use super::read::check_size;
use super::stored::{LIMITS, StoredPlane, StoredPlanes, one_buffer};
use super::{Format, ImageError, Plane, PlaneVec, Receipt, Window};

/// The planes of an archive: all its arrays of rows and columns.
pub(super) fn read(bytes: &[u8]) -> Result<StoredPlanes, ImageError> {
    let fault = |e: rawzip::Error| damaged(e.to_string());
    let archive = ZipArchive::from_slice(bytes).map_err(fault)?;
    let (mut entries, mut arrays, mut receipt) = (archive.entries(), Vec::new(), Receipt::default());
    while let Some(entry) = entries.next_entry().map_err(fault)? {
        let path = String::from_utf8_lossy(entry.file_path().as_bytes()).into_owned();
        let Some(name) = path.strip_suffix(".npy") else { continue };
        if entry.compression_method() != CompressionMethod::STORE {
            return Err(unread(name, "is compressed; numpy.savez writes it as it is read here"));
        }
        let entry = archive.get_entry(entry.wayfinder()).map_err(fault)?;
        let mut data = Vec::with_capacity(entry.data().len());
        entry.verifying_reader(entry.data()).read_to_end(&mut data).map_err(|e| damaged(format!("{name}: {e}")))?;
        let (header, numbers) = parted(&data).ok_or_else(|| damaged(format!("its array {name} has no header")))?;
        if name == "receipt" {
            receipt = receipt_of(header, numbers).unwrap_or_default();
        } else if let Some(shape) = shape(header)
            && let [rows, columns, ref channels @ ..] = shape[..]
            && channels.len() <= 1
        {
            let channels = channels.first().copied().unwrap_or(1);
            let numbers = numbers_of(name, header, numbers, [rows, columns, channels])?;
            arrays.push((name.to_owned(), [rows, columns], channels, numbers));
        }
    }
    let Some((first, size @ [rows, columns], ..)) = arrays.first().cloned() else {
        return Err(damaged("it holds no array of rows and columns".into()));
    };
    if let Some((other, [r, c], ..)) = arrays.iter().find(|(_, other, ..)| *other != size) {
        return Err(damaged(format!("its array {first} has {rows} x {columns} pixels, and {other} has {r} x {c}")));
    }
    let [width, height] = size_of([columns, rows])?;
    let plane = |(name, _, channels, numbers): (String, [u64; 2], u64, PlaneVec)| StoredPlane {
        channels: channel_names(&name, channels as usize, &receipt),
        name,
        numbers,
        steps: None,
    };
    let planes = arrays.into_iter().map(plane).collect();
    let window = Window { x: 0, y: 0, width, height };
    Ok(StoredPlanes { format: Format::Npz, film: [width, height], window, planes, receipt })
}

/// The array of an NPY file, which does not say what it is called unless a receipt stands behind it.
pub(super) fn read_one(bytes: &[u8]) -> Result<StoredPlanes, ImageError> {
    read_array(bytes).map_err(|fault| match fault {
        ImageError::Damaged { reason, .. } => ImageError::Damaged { format: "NPY", reason },
        fault => fault,
    })
}

fn read_array(bytes: &[u8]) -> Result<StoredPlanes, ImageError> {
    let (header, rest) = parted(bytes).ok_or_else(|| damaged("it has no header".into()))?;
    let shape = shape(header).unwrap_or_default();
    let [rows, columns, ref channels @ ..] = shape[..] else {
        return Err(damaged(format!("its shape is {shape:?}; rows and columns are needed")));
    };
    if channels.len() > 1 {
        return Err(damaged(format!("its shape is {shape:?}; rows, columns and channels are read")));
    }
    let count = channels.first().copied().unwrap_or(1);
    let end = size_of_numbers(header, [rows, columns, count]).map_or(rest.len(), |size| rest.len().min(size));
    let (numbers, behind) = rest.split_at(end);
    let receipt = parted(behind).and_then(|(header, text)| receipt_of(header, text)).unwrap_or_default();
    let known = one_buffer(&receipt, count as usize);
    let (name, channels) =
        known.unwrap_or_else(|| ("array".into(), channel_names("array", count as usize, &Receipt::default())));
    // Other arrays behind it are somebody else's
    let numbers = if receipt.entries.is_empty() { rest } else { numbers };
    let numbers = numbers_of(&name, header, numbers, [rows, columns, count])?;
    let [width, height] = size_of([columns, rows])?;
    let plane = StoredPlane { name, channels, numbers, steps: None };
    Ok(StoredPlanes::picture(Format::Npy, [width, height], plane, receipt))
}

/// The width and height of a picture.
fn size_of(sides: [u64; 2]) -> Result<[u32; 2], ImageError> {
    let [width, height] = sides.map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    if width == 0 || height == 0 {
        return Err(ImageError::Picture(format!("its arrays are of {width} x {height} pixels, which is no picture")));
    }
    check_size(width, height, &LIMITS)?;
    Ok([width, height])
}

fn damaged(reason: String) -> ImageError {
    ImageError::Damaged { format: "NPZ", reason }
}

/// What is well made, and is not read here.
fn unread(name: &str, why: &str) -> ImageError {
    ImageError::Picture(format!("its array {name} {why}"))
}

/// The header of an array, a literal of Python, and its numbers.
fn parted(array: &[u8]) -> Option<(&str, &[u8])> {
    let rest = array.strip_prefix(b"\x93NUMPY")?;
    let (version, rest) = rest.split_first_chunk::<2>()?;
    let (length, rest) = match version[0] {
        1 => rest.split_first_chunk::<2>().map(|(length, rest)| (u32::from(u16::from_le_bytes(*length)), rest))?,
        _ => rest.split_first_chunk::<4>().map(|(length, rest)| (u32::from_le_bytes(*length), rest))?,
    };
    let (header, numbers) = rest.split_at_checked(length as usize)?;
    Some((std::str::from_utf8(header).ok()?, numbers))
}

/// What stands behind a key of the header.
fn after<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = header.split_once(&format!("'{key}'"))?;
    Some(rest.trim_start().strip_prefix(':')?.trim_start())
}

/// The type of its numbers: `<f4`.
fn kind(header: &str) -> Option<&str> {
    after(header, "descr")?.strip_prefix('\'')?.split_once('\'').map(|(kind, _)| kind)
}

fn shape(header: &str) -> Option<Vec<u64>> {
    let (sides, _) = after(header, "shape")?.strip_prefix('(')?.split_once(')')?;
    let sides = sides.split(',').map(str::trim).filter(|side| !side.is_empty());
    sides.map(|side| side.parse().ok()).collect()
}

/// Bytes of a number of such a type, if it is read.
fn width_of(kind: &str) -> Option<u64> {
    match kind {
        "<f4" | "<u4" => Some(4),
        "<u2" => Some(2),
        "|u1" => Some(1),
        _ => None,
    }
}

/// Bytes of an array of that shape.
fn size_of_numbers(header: &str, shape: [u64; 3]) -> Option<usize> {
    let count = shape.iter().try_fold(1, |product: u64, side| product.checked_mul(*side))?;
    usize::try_from(count.checked_mul(width_of(kind(header)?)?)?).ok()
}

fn numbers_of(name: &str, header: &str, bytes: &[u8], shape: [u64; 3]) -> Result<PlaneVec, ImageError> {
    let kind = kind(header).unwrap_or_default();
    if width_of(kind).is_none() {
        let allowed = "float32, uint32, uint16 and uint8 are read, the lowest byte first";
        return Err(unread(name, &format!("has numbers of the type {kind:?}; {allowed}")));
    }
    if !after(header, "fortran_order").is_some_and(|rest| rest.starts_with("False")) {
        return Err(unread(name, "goes column by column; rows are read"));
    }
    if size_of_numbers(header, shape) != Some(bytes.len()) {
        return Err(damaged(format!("its array {name} has not as many numbers as it says")));
    }
    Ok(match kind {
        "<f4" => PlaneVec::Floats(bytes.as_chunks().0.iter().map(|n| f32::from_le_bytes(*n)).collect()),
        "<u4" => PlaneVec::Wholes(bytes.as_chunks().0.iter().map(|n| u32::from_le_bytes(*n)).collect()),
        "<u2" => PlaneVec::Wholes(bytes.as_chunks().0.iter().map(|n| u16::from_le_bytes(*n).into()).collect()),
        _ => PlaneVec::Wholes(bytes.iter().map(|n| u32::from(*n)).collect()),
    })
}

/// The receipt, a JSON text in UTF-32. `None` for an array of that name that is something else.
fn receipt_of(header: &str, text: &[u8]) -> Option<Receipt> {
    kind(header).filter(|kind| kind.starts_with("<U"))?;
    let text: String =
        text.as_chunks().0.iter().map(|c| char::from_u32(u32::from_le_bytes(*c))).collect::<Option<_>>()?;
    let said: serde_json::Map<String, serde_json::Value> = serde_json::from_str(&text).ok()?;
    let entry = |(key, value): (String, serde_json::Value)| Some((key, value.as_str()?.to_owned()));
    Some(Receipt { entries: said.into_iter().map(entry).collect::<Option<_>>()? })
}

/// As the receipt says, or as those of the plane of that name are called, or by number.
fn channel_names(name: &str, count: usize, receipt: &Receipt) -> Vec<String> {
    let said = receipt.get(&format!("{}{name}", super::plane::BUFFER_KEY));
    let said = said.and_then(|said| said.strip_prefix("channels ")?.split_once(';')).map(|(names, _)| names);
    let said = said.map(|names| names.split(' ').map(str::to_owned).collect());
    // A picture may have no alpha
    let known = || {
        let channels = Plane::from_name(name)?.channels();
        let channels = if name == Plane::Color.name() { &channels[..count.clamp(3, 4)] } else { channels };
        Some(channels.iter().map(|name| (*name).to_owned()).collect())
    };
    let fits = |names: &Vec<String>| names.len() == count;
    said.filter(fits).or_else(|| known().filter(fits)).unwrap_or_else(|| (1..=count).map(|k| k.to_string()).collect())
}

#[cfg(test)]
mod tests {
    use super::super::{FileSettings, NamedPlane, PlaneFile, PlaneNumbers};
    use super::*;

    fn archive() -> Vec<u8> {
        let window = Window { x: 0, y: 0, width: 3, height: 2 };
        let (uv, ids) = ([0.25f32, f32::NAN, 0.5, f32::INFINITY].repeat(3), [7u32, 0, 1, 2, 3, u32::MAX]);
        let planes = [
            NamedPlane { name: "light:#1 é", plane: Plane::Uv, numbers: PlaneNumbers::Floats(&uv) },
            NamedPlane::new(Plane::ObjectId, PlaneNumbers::Wholes(&ids)),
        ];
        let receipt = Receipt { entries: vec![("name".into(), "Würfel \"1\"".into())] };
        PlaneFile { film: [3, 2], window, planes: &planes }
            .encode(Format::Npz, &FileSettings::default(), &receipt)
            .unwrap()
    }

    #[test]
    fn what_is_written_is_read() {
        let file = StoredPlanes::read(&archive()).unwrap();
        assert_eq!((file.format, file.film), (Format::Npz, [3, 2]));
        assert_eq!(file.receipt.get("name"), Some("Würfel \"1\""));
        let [uv, ids] = &file.planes[..] else { panic!("two planes") };
        assert_eq!((uv.name.as_str(), &uv.channels[..]), ("light:#1 é", &["U".to_owned(), "V".to_owned()][..]));
        assert_eq!(ids.numbers, PlaneVec::Wholes(vec![7, 0, 1, 2, 3, u32::MAX]));
        let bits = |numbers: &PlaneVec| numbers.numbers().to_le_bytes();
        let expected = PlaneVec::Floats([0.25f32, f32::NAN, 0.5, f32::INFINITY].repeat(3));
        assert_eq!(bits(&uv.numbers), bits(&expected));
        assert!(file.planes.iter().all(|plane| file.is_as_written(plane) == Some(true)));
    }

    #[test]
    fn damaged_archives_do_no_harm() {
        let whole = archive();
        for length in 0..whole.len() {
            assert!(StoredPlanes::read(&whole[..length]).is_err(), "{length}");
        }
        let mut numbers = firstlight_testkit::Random::new(1);
        for _ in 0..2000 {
            let mut bytes = whole.clone();
            bytes[numbers.below(whole.len() as u32) as usize] ^= 1 << numbers.below(8);
            let _ = StoredPlanes::read(&bytes);
        }
    }

    #[test]
    fn headers_of_numpy_are_understood() {
        let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }";
        assert_eq!((kind(header), shape(header)), (Some("<f4"), Some(vec![2, 3])));
        assert_eq!(shape("{'shape': (), }"), Some(vec![]));
        assert_eq!(shape("{'shape': (5,), }"), Some(vec![5]));
        let words = |header: &str, shape| numbers_of("a", header, &[0; 24], shape).unwrap_err().to_string();
        assert!(words("{'descr': '<f8', 'fortran_order': False}", [1, 3, 1]).contains("the type \"<f8\""));
        assert!(words("{'descr': '<f4', 'fortran_order': True}", [2, 3, 1]).contains("column by column"));
        assert!(words("{'descr': '<f4', 'fortran_order': False}", [2, 2, 1]).contains("not as many numbers"));
        assert!(words("{'descr': '<f4', 'fortran_order': False}", [u64::MAX, 2, 1]).contains("not as many numbers"));
    }
}
