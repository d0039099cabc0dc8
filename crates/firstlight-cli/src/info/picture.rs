//! `firstlight info PICTURE`: the receipt of a picture, and what its file holds.

use std::fmt::Write;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use firstlight::{Format, StoredPlanes, printable};
use serde_json::{Map, Value, json};

use crate::report::{Failure, answer, shown};

/// First bytes of picture files that may have a receipt, NPZ files apart, which are zip archives.
const MAGIC: [&[u8]; 5] = [b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"\x76\x2f\x31\x01", b"#?RADIANCE\n", b"\x93NUMPY"];

/// Whether `path` is a file of a picture, by its content; an archive, by its name too.
pub(super) fn is_picture(path: &Path) -> bool {
    let mut head = Vec::new();
    let is_read = path.is_file() && File::open(path).is_ok_and(|file| file.take(16).read_to_end(&mut head).is_ok());
    let is_npz = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("npz"));
    is_read && (MAGIC.iter().any(|magic| head.starts_with(magic)) || is_npz && head.starts_with(b"PK\x03\x04"))
}

/// Says what the file of a picture holds.
///
/// # Errors
/// It cannot be read.
pub(super) fn answer_picture(path: &Path, as_json: bool) -> Result<(), Failure> {
    let work = |why: String| Failure::Work(format!("{}: {why}", shown(path)));
    let bytes = std::fs::read(path).map_err(|e| work(e.to_string()))?;
    let stored = StoredPlanes::read(&bytes).map_err(|e| work(e.to_string()))?;
    let info = gather(&path.display().to_string(), bytes.len(), &stored);
    answer(&if as_json { format!("{info:#}\n") } else { text(&info) })
}

/// Everything there is to say, as JSON; the text is made from it.
fn gather(name: &str, bytes: usize, stored: &StoredPlanes) -> Value {
    let StoredPlanes { format, film, window, planes, receipt } = stored;
    let format = match format {
        Format::Png8 => "PNG, 8 bits",
        Format::Png16 => "PNG, 16 bits",
        Format::Exr => "OpenEXR",
        Format::Npz => "NPZ",
        Format::Npy => "NPY",
        Format::Hdr => "Radiance HDR",
        Format::Jpeg => "JPEG",
    };
    let plane = |plane: &firstlight::StoredPlane| {
        let as_written = stored.is_as_written(plane);
        json!({ "name": plane.name, "channels": plane.channels, "as_written": as_written })
    };
    json!({
        "picture": name,
        "file_bytes": bytes,
        "format": format,
        "width": window.width,
        "height": window.height,
        "at": [window.x, window.y],
        "film": film,
        "buffers": planes.iter().map(plane).collect::<Vec<_>>(),
        "receipt": receipt.entries.iter().map(|(key, value)| (key.clone(), json!(value))).collect::<Map<_, _>>(),
    })
}

/// The same for people.
fn text(info: &Value) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // A String takes every write
        let _ = writeln!(text, "{name:<10} {value}");
    };
    let word = |value: &Value| value.as_str().map_or_else(|| value.to_string(), |text| printable(text).into_owned());
    line("picture", word(&info["picture"]));
    line("file", format!("{} bytes, {}", info["file_bytes"], word(&info["format"])));
    let ([width, height], film) = ([&info["width"], &info["height"]], &info["film"]);
    let part = match [width, height] == [&film[0], &film[1]] {
        true => String::new(),
        false => format!(", at ({}, {}) of {} x {}", info["at"][0], info["at"][1], film[0], film[1]),
    };
    line("size", format!("{width} x {height} pixels{part}"));
    for (i, plane) in info["buffers"].as_array().into_iter().flatten().enumerate() {
        let channels: Vec<String> = plane["channels"].as_array().into_iter().flatten().map(word).collect();
        let state = match plane["as_written"].as_bool() {
            Some(true) => ", as it was written",
            Some(false) => ", changed since it was written",
            None => "",
        };
        line(if i == 0 { "buffers" } else { "" }, format!("{}: {}{state}", word(&plane["name"]), channels.join(" ")));
    }
    let receipt = info["receipt"].as_object().filter(|receipt| !receipt.is_empty());
    let Some(receipt) = receipt else {
        line("receipt", "none: firstlight did not write it, or another program has written it since".into());
        return text;
    };
    let longest = receipt.keys().map(String::len).max().unwrap_or_default();
    for (i, (key, value)) in receipt.iter().enumerate() {
        line(if i == 0 { "receipt" } else { "" }, format!("{key:<longest$}  {}", word(value)));
    }
    text
}
