//! NPZ files: an archive of arrays as numpy reads them, `numpy.load("a.npz")["depth"]`. NPY files: one of them.
//!
//! One array for each plane, of shape (rows, columns) or (rows, columns, channels), little-endian, and `receipt`, the
//! receipt as JSON text. Not compressed, as `numpy.savez` leaves them: they are read as fast as the disk is.
//!
//! Source: numpy, "NEP 1: a simple file format for numpy arrays", version 1.0.

use std::io::Write;

use rawzip::path::EntryPath;
use rawzip::{CompressionMethod, ZipArchiveWriter};

use super::{ImageError, NamedPlane, PlaneFile, PlaneNumbers, Receipt, Window};

/// The bytes of an NPY file: one plane, and behind it the receipt, a second array. `numpy.load` of the file's name
/// reads the first; of the open file, one after the other.
pub(super) fn encode_one(window: Window, plane: &NamedPlane, receipt: &Receipt) -> Vec<u8> {
    [plane_array(window, plane), receipt_array(receipt)].concat()
}

fn plane_array(window: Window, plane: &NamedPlane) -> Vec<u8> {
    let kind = match plane.numbers {
        PlaneNumbers::Floats(_) => "<f4",
        PlaneNumbers::Wholes(_) => "<u4",
    };
    let Window { width, height, .. } = window;
    let shape = match plane.plane.channels().len() {
        1 => format!("({height}, {width})"),
        channels => format!("({height}, {width}, {channels})"),
    };
    array(kind, &shape, &plane.numbers.to_le_bytes())
}

/// The bytes of an NPZ file. The planes and the receipt have been checked.
pub(super) fn encode(file: &PlaneFile, receipt: &Receipt) -> Result<Vec<u8>, ImageError> {
    archive(file, receipt).map_err(|e| ImageError::Encode { format: "NPZ", reason: e.to_string() })
}

/// An archive of files `NAME.npy`, with names as they are: `light:` is no drive. Without a clock: the same arrays give
/// the same bytes.
fn archive(file: &PlaneFile, receipt: &Receipt) -> Result<Vec<u8>, rawzip::Error> {
    let Window { width, height, .. } = file.window;
    let room: usize = file.planes.iter().map(|named| named.plane.bytes()).sum();
    let mut bytes = Vec::with_capacity(room * width as usize * height as usize);
    let mut archive = ZipArchiveWriter::new(&mut bytes);
    let mut add = |name: &str, array: Vec<u8>| -> Result<(), rawzip::Error> {
        let name = format!("{name}.npy");
        let (mut entry, config) = archive
            .new_file(EntryPath::verbatim(name.as_bytes()))
            .compression_method(CompressionMethod::STORE)
            .start()?;
        let mut writer = config.wrap(&mut entry);
        writer.write_all(&array)?;
        let (_, descriptor) = writer.finish()?;
        entry.finish(descriptor)?;
        Ok(())
    };
    // One after the other: beside the archive there is a copy of one plane at a time
    for plane in file.planes {
        add(plane.name, plane_array(file.window, plane))?;
    }
    add("receipt", receipt_array(receipt))?;
    archive.finish()?;
    Ok(bytes)
}

/// A receipt as JSON text.
fn receipt_array(receipt: &Receipt) -> Vec<u8> {
    let said: serde_json::Map<_, _> =
        receipt.entries.iter().map(|(key, value)| (key.clone(), value.clone().into())).collect();
    let text = serde_json::Value::Object(said).to_string();
    // numpy's text is UTF-32
    let characters: Vec<u8> = text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
    array(&format!("<U{}", characters.len() / 4), "()", &characters)
}

/// An array with its header: where the numbers begin is a multiple of 64.
fn array(kind: &str, shape: &str, numbers: &[u8]) -> Vec<u8> {
    let mut said = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let before = b"\x93NUMPY\x01\x00".len() + 2;
    let all = (before + said.len() + 1).next_multiple_of(64);
    said.extend(std::iter::repeat_n(' ', all - before - said.len() - 1));
    said.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((said.len() as u16).to_le_bytes());
    bytes.extend(said.into_bytes());
    bytes.extend(numbers);
    bytes
}

#[cfg(test)]
mod tests {
    use super::super::{FileSettings, Format, Plane};
    use super::*;

    /// The kind, shape and numbers of an array.
    fn read(bytes: &[u8]) -> (String, Vec<u8>) {
        assert!(bytes.starts_with(b"\x93NUMPY\x01\x00"));
        let numbers = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert_eq!(numbers % 64, 0);
        let header = String::from_utf8(bytes[10..numbers].to_vec()).unwrap();
        assert!(header.ends_with('\n'));
        (header.trim_end().to_owned(), bytes[numbers..].to_vec())
    }

    /// The files of an archive, whose sums are checked.
    fn files(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
        let archive = rawzip::ZipArchive::from_slice(bytes).unwrap();
        let (mut entries, mut files) = (archive.entries(), Vec::new());
        while let Some(entry) = entries.next_entry().unwrap() {
            let name = String::from_utf8(entry.file_path().as_bytes().to_vec()).unwrap();
            let entry = archive.get_entry(entry.wayfinder()).unwrap();
            let mut data = Vec::new();
            std::io::copy(&mut entry.verifying_reader(entry.data()), &mut data).unwrap();
            files.push((name, data));
        }
        files
    }

    #[test]
    fn arrays_have_their_kinds_and_shapes() {
        let window = Window { x: 1, y: 2, width: 3, height: 2 };
        let (depth, uv, ids) =
            ([1.5f32, f32::INFINITY, 0.0, -1.0, 2.0, 3.0], [0.25f32; 12], [7u32, 0, 1, 2, 3, u32::MAX]);
        let planes = [
            NamedPlane::new(Plane::Depth, PlaneNumbers::Floats(&depth)),
            NamedPlane::new(Plane::Uv, PlaneNumbers::Floats(&uv)),
            NamedPlane::new(Plane::ObjectId, PlaneNumbers::Wholes(&ids)),
        ];
        let file = PlaneFile { film: [9, 9], window, planes: &planes };
        let receipt = Receipt { entries: vec![("name".into(), "Würfel \"1\"".into())] };
        let bytes = file.encode(Format::Npz, &FileSettings::default(), &receipt).unwrap();
        assert_eq!(bytes, file.encode(Format::Npz, &FileSettings::default(), &receipt).unwrap());
        let files = files(&bytes);
        let names: Vec<_> = files.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["depth.npy", "uv.npy", "object-id.npy", "receipt.npy"]);
        let said =
            |kind: &str, shape: &str| format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
        let kinds = [("<f4", "(2, 3)"), ("<f4", "(2, 3, 2)"), ("<u4", "(2, 3)")];
        for ((NamedPlane { numbers, .. }, (_, file)), (kind, shape)) in planes.into_iter().zip(&files).zip(kinds) {
            assert_eq!(read(file), (said(kind, shape), numbers.to_le_bytes()));
        }
        let (header, text) = read(&files[3].1);
        let text: String =
            text.chunks(4).map(|c| char::from_u32(u32::from_le_bytes(c.try_into().unwrap())).unwrap()).collect();
        assert_eq!(header, said(&format!("<U{}", text.chars().count()), "()"));
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["name"], "Würfel \"1\"");
        let hash = blake3::hash(&PlaneNumbers::Floats(&depth).to_le_bytes()).to_hex();
        assert_eq!(
            json["buffer.depth"],
            format!(
                "channels Z; float32; unit m; space camera; along the line of sight, infinite for nothing; center; \
                 blake3 {hash}"
            )
            .as_str()
        );
    }
}
