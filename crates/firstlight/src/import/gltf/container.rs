//! The file as a whole: JSON, alone or in a binary container (GLB), and the addresses of what lies beside it.
//!
//! Source: "glTF 2.0 specification", section 4, "GLB File Format Specification".

use serde_json::Value;

use super::GltfFault;
use super::json::EXPORT_ANEW;
use crate::describe::value::{join_path, normalized};

/// The chunks of a GLB file.
const JSON_CHUNK: u32 = 0x4e4f_534a;
const BINARY_CHUNK: u32 = 0x004e_4942;
/// What a GLB file begins with.
const MAGIC: &[u8] = b"glTF";
/// Bytes of the header of a GLB file, and of a chunk.
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

/// The JSON of a file, and where its binary chunk lies.
pub(super) struct Container {
    pub json: Value,
    pub binary: Option<std::ops::Range<usize>>,
}

fn damaged(message: String) -> GltfFault {
    GltfFault { pointer: String::new(), message, hint: EXPORT_ANEW.into() }
}

impl Container {
    pub fn open(bytes: &[u8]) -> Result<Container, GltfFault> {
        let (text, binary) = if bytes.starts_with(MAGIC) { chunks(bytes)? } else { (0..bytes.len(), None) };
        let text = &bytes[text];
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        // Chunks are filled up with blanks; some writers take 0
        let end = text.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
        // Names of old exporters may be in another encoding
        let json: Value = serde_json::from_str(&String::from_utf8_lossy(&text[..end]))
            .map_err(|error| damaged(format!("its JSON cannot be read: {error}")))?;
        if !json.is_object() {
            return Err(damaged("its JSON is not an object".into()));
        }
        Ok(Container { json, binary })
    }
}

/// Where the JSON and the binary chunk of a GLB file lie. Lengths are held to those of the file.
fn chunks(bytes: &[u8]) -> Result<(std::ops::Range<usize>, Option<std::ops::Range<usize>>), GltfFault> {
    let word = |at: usize| -> Option<u32> {
        let bytes = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    };
    let version = word(4).ok_or_else(|| damaged("is cut off within its header".into()))?;
    if version != 2 {
        let hint = "convert it to glTF 2.0".to_owned();
        let message = format!("is a GLB container of version {version}; version 2 is read");
        return Err(GltfFault { pointer: String::new(), message, hint });
    }
    // What the header says of the length is not believed: many tools append, and some write 0
    let (mut at, mut json, mut binary) = (HEADER, None, None);
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let start = at + CHUNK_HEADER;
        let end = start.checked_add(length as usize).filter(|end| *end <= bytes.len());
        let Some(end) = end else {
            // Behind the chunks of glTF, whatever was appended to them
            if json.is_some() && (binary.is_some() || word(8).is_some_and(|length| length > 0 && at >= length as usize))
            {
                break;
            }
            let there = bytes.len() - start;
            return Err(damaged(format!("is cut off: a chunk has {length} bytes, {there} are there")));
        };
        match kind {
            JSON_CHUNK if json.is_none() => json = Some(start..end),
            BINARY_CHUNK if binary.is_none() => binary = Some(start..end),
            _ => {}
        }
        // Some writers leave out what fills a chunk up
        let is_chunk = |at: usize| matches!(word(at + 4), Some(JSON_CHUNK | BINARY_CHUNK));
        at = if is_chunk(end) { end } else { end.next_multiple_of(4) };
    }
    let json = json.ok_or_else(|| damaged("has no JSON chunk".into()))?;
    Ok((json, binary))
}

/// What a URI of a file says.
#[derive(Debug, PartialEq)]
pub(crate) enum Uri<'a> {
    /// `data:`, with the base64 digits or the text.
    Data(&'a str),
    /// A file, relative to the scene's folder.
    File(String),
    /// `http:` and all other schemes: nothing is fetched.
    Scheme(&'a str),
}

impl<'a> Uri<'a> {
    /// The URI of a file that lies in `folder`. Percent signs are decoded once.
    pub fn of(uri: &'a str, folder: &str) -> Uri<'a> {
        if uri.len() >= 5 && uri.as_bytes()[..5].eq_ignore_ascii_case(b"data:") {
            return Uri::Data(&uri[5..]);
        }
        // One letter is a drive of Windows, which is a path
        let scheme = uri.split_once(':').map(|(scheme, _)| scheme).filter(|scheme| {
            scheme.len() > 1
                && scheme.starts_with(|c: char| c.is_ascii_alphabetic())
                && scheme.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.'))
        });
        match scheme {
            Some(scheme) => Uri::Scheme(scheme),
            None => Uri::File(normalized(&join_path(folder, &percent_decoded(uri).replace('\\', "/")))),
        }
    }
}

/// The text with `%20` as a blank; what is no UTF-8 then stays as it is.
fn percent_decoded(text: &str) -> String {
    String::from_utf8(percent_decoded_bytes(text)).unwrap_or_else(|_| text.to_owned())
}

fn percent_decoded_bytes(text: &str) -> Vec<u8> {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let digit = |i: usize| bytes.get(i).and_then(|byte| char::from(*byte).to_digit(16));
        match (bytes[at], digit(at + 1), digit(at + 2)) {
            (b'%', Some(high), Some(low)) => {
                out.push((16 * high + low) as u8);
                at += 3;
            }
            (byte, ..) => {
                out.push(byte);
                at += 1;
            }
        }
    }
    out
}

/// The bytes of what stands behind `data:`; `None` if it is no base64.
pub(super) fn data_bytes(data: &str) -> Option<Vec<u8>> {
    let (kind, digits) = data.split_once(',')?;
    let decoded = percent_decoded_bytes(digits);
    if !kind.to_ascii_lowercase().ends_with("base64") {
        return Some(decoded);
    }
    let mut out = Vec::with_capacity(digits.len() / 4 * 3);
    let (mut bits, mut count) = (0u32, 0);
    for byte in decoded {
        let digit = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' | b' ' | b'\t' | b'\r' | b'\n' => continue,
            _ => return None,
        };
        (bits, count) = (bits << 6 | u32::from(digit), count + 6);
        if count >= 8 {
            count -= 8;
            out.push((bits >> count) as u8);
            bits &= (1 << count) - 1;
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris() {
        let file = |path: &str| Uri::File(path.into());
        assert_eq!(Uri::of("Box%20With%20Spaces.bin", ""), file("Box With Spaces.bin"));
        assert_eq!(Uri::of("a%2520b.png", "m"), file("m/a%20b.png"));
        assert_eq!(Uri::of("maps\\wood.png", "m"), file("m/maps/wood.png"));
        assert_eq!(Uri::of("../wood.png", "m"), file("wood.png"));
        assert_eq!(Uri::of("100%.png", ""), file("100%.png"));
        assert_eq!(Uri::of("%ff.png", ""), file("%ff.png"));
        assert_eq!(Uri::of("https://host/a.png", ""), Uri::Scheme("https"));
        assert_eq!(Uri::of("DATA:,a", ""), Uri::Data(",a"));
    }

    #[test]
    fn base64() {
        let of = |data: &str| data_bytes(data).map(|bytes| String::from_utf8(bytes).unwrap());
        assert_eq!(of(";base64,"), Some(String::new()));
        assert_eq!(of("application/octet-stream;base64,TWFu"), Some("Man".into()));
        assert_eq!(of(";base64,TWE="), Some("Ma".into()));
        assert_eq!(of(";base64,TQ"), Some("M".into()));
        assert_eq!(of("text/plain,a%20b"), Some("a b".into()));
        assert_eq!(of(";base64,TWE%3D"), Some("Ma".into()));
        assert_eq!(data_bytes(",%00%ff"), Some(vec![0, 255]));
        assert_eq!(of(";base64,T*"), None);
        assert_eq!(of("none"), None);
    }

    #[test]
    fn a_container_is_held_to_its_length() {
        let mut glb = b"glTF\x02\0\0\0\0\0\0\0\x04\0\0\0JSON{ } \x04\0\0\0BIN\0abcd".to_vec();
        let open = |bytes: &[u8]| Container::open(bytes).map(|c| c.binary).map_err(|fault| fault.message);
        assert_eq!(open(&glb), Ok(Some(32..36)));
        // What was appended, and what a writer did not fill up
        assert_eq!(open(&[&glb[..], &[b'x'; 16]].concat()), Ok(Some(32..36)));
        let whole = b"glTF\x02\0\0\0\x18\0\0\0\x04\0\0\0JSON{ } appended by somebody".to_vec();
        assert_eq!(open(&whole), Ok(None));
        let bare = b"glTF\x02\0\0\0\0\0\0\0\x03\0\0\0JSON{ }\x04\0\0\0BIN\0abcd".to_vec();
        assert_eq!(open(&bare), Ok(Some(31..35)));
        // Names in another encoding
        assert_eq!(open(b"{ \"asset\": { \"generator\": \"caf\xe9\" } }"), Ok(None));
        glb.pop();
        assert_eq!(open(&glb), Err("is cut off: a chunk has 4 bytes, 3 are there".into()));
        assert_eq!(open(&glb[..20]), Err("is cut off: a chunk has 4 bytes, 0 are there".into()));
        assert_eq!(open(&glb[..15]), Err("has no JSON chunk".into()));
        assert_eq!(open(b"glTF\x01\0\0\0").unwrap_err(), "is a GLB container of version 1; version 2 is read");
        assert!(open(b"{ \"a\": ").unwrap_err().starts_with("its JSON cannot be read"));
        assert!(open(&b"[".repeat(100_000)).is_err());
        assert_eq!(open(b"3"), Err("its JSON is not an object".into()));
    }
}
