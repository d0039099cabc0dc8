//! Why a mesh could not be read.

use std::fmt;

/// Where in a mesh file something stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MeshPlace {
    /// A line of text, 1-based.
    Line(u64),
    /// A byte of binary data, counted from 0 at the start of the file.
    Byte(u64),
    /// A JSON pointer; empty for the file as a whole.
    Json(String),
}

/// `:12` after a file's name, or `, byte 480`, or `, /meshes/0`.
impl fmt::Display for MeshPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MeshPlace::Line(line) => write!(f, ":{line}"),
            MeshPlace::Byte(byte) => write!(f, ", byte {byte}"),
            MeshPlace::Json(pointer) if pointer.is_empty() => Ok(()),
            MeshPlace::Json(pointer) => write!(f, ", {pointer}"),
        }
    }
}

/// Why a mesh could not be read, with what is allowed and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ImportError {
    /// A file without a byte.
    #[error("{file}: is empty; give a PLY, STL or OBJ file")]
    Empty {
        /// The file, as it was named.
        file: String,
    },
    /// Bytes that are no mesh of a known kind.
    #[error("{file}: is not a mesh of a known kind; give a PLY, STL or OBJ file")]
    UnknownKind {
        /// The file, as it was named.
        file: String,
    },
    /// A file of another kind, known by its content.
    #[error("{file}: {message}; {hint}")]
    Foreign {
        /// The file, as it was named.
        file: String,
        /// What it looks like.
        message: String,
        /// What to do.
        hint: String,
    },
    /// A file that is broken, cut off, or says what cannot be.
    #[error("{file}{place}: {message}; {hint}")]
    Damaged {
        /// The file, as it was named.
        file: String,
        /// Where.
        place: MeshPlace,
        /// What was found, with its value, and what is allowed.
        message: String,
        /// What to do.
        hint: String,
    },
    /// More than can be counted.
    #[error("{file}: has {count} {what}, the limit is {limit}; split it into several files")]
    TooMany {
        /// The file, as it was named.
        file: String,
        /// What there are too many of: `vertices`, `triangles`.
        what: &'static str,
        /// How many the file has, or says it has.
        count: u64,
        /// How many are allowed.
        limit: u64,
    },
    /// The progress function asked to stop.
    #[error("{file}: reading was stopped")]
    Stopped {
        /// The file, as it was named.
        file: String,
    },
}

/// What to do about a file that lies or ends early.
pub(super) const WRITE_ANEW: &str = "the file is damaged or cut off: write or fetch it anew";

/// An [`ImportError`] before the file's name and the line are known.
#[derive(Clone, Debug)]
pub(super) enum ImportFault {
    /// At a byte, in text or not.
    At {
        offset: usize,
        text: bool,
        message: String,
        hint: &'static str,
    },
    TooMany {
        what: &'static str,
        count: u64,
        limit: u64,
    },
    Stopped,
}

impl ImportFault {
    /// A fault of text, whose place is a line.
    pub(super) fn text(offset: usize, message: impl Into<String>, hint: &'static str) -> Self {
        Self::At { offset, text: true, message: message.into(), hint }
    }

    /// A fault of binary data, whose place is a byte.
    pub(super) fn binary(offset: usize, message: impl Into<String>, hint: &'static str) -> Self {
        Self::At { offset, text: false, message: message.into(), hint }
    }

    /// The byte it stands at, for those that have one.
    pub(super) fn offset(&self) -> Option<usize> {
        match self {
            ImportFault::At { offset, .. } => Some(*offset),
            _ => None,
        }
    }

    pub(super) fn into_error(self, file: &str, bytes: &[u8]) -> ImportError {
        let file = file.to_owned();
        match self {
            ImportFault::At { offset, text, message, hint } => {
                let place = if text { MeshPlace::Line(line_of(bytes, offset)) } else { MeshPlace::Byte(offset as u64) };
                ImportError::Damaged { file, place, message, hint: hint.into() }
            }
            ImportFault::TooMany { what, count, limit } => ImportError::TooMany { file, what, count, limit },
            ImportFault::Stopped => ImportError::Stopped { file },
        }
    }
}

/// The line a byte is on, 1-based. A line ends with LF, CR LF or CR.
fn line_of(bytes: &[u8], offset: usize) -> u64 {
    let before = &bytes[..offset.min(bytes.len())];
    let mut line = 1;
    for (i, &byte) in before.iter().enumerate() {
        line += u64::from(byte == b'\n' || (byte == b'\r' && bytes.get(i + 1) != Some(&b'\n')));
    }
    line
}

/// A piece of a file as it can be shown in a message: at most 40 characters. What is no text is not shown.
pub(crate) fn shown(word: &[u8]) -> String {
    let start = match std::str::from_utf8(&word[..word.len().min(160)]) {
        Ok(start) => start,
        // Cut within a character
        Err(error) if word.len() > 160 && error.error_len().is_none() => {
            std::str::from_utf8(&word[..error.valid_up_to()]).unwrap_or_default()
        }
        Err(_) => return NO_TEXT.into(),
    };
    if start.chars().any(|c| c.is_control() && !c.is_whitespace()) {
        return NO_TEXT.into();
    }
    let mut text: String = start.chars().take(40).flat_map(char::escape_debug).collect();
    if start.chars().count() > 40 || word.len() > 160 {
        text.push_str("...");
    }
    format!("`{text}`")
}

/// In place of what cannot be shown.
const NO_TEXT: &str = "a word that is no text";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_quoted_and_bytes_are_not() {
        assert_eq!(shown(b"facet"), "`facet`");
        assert_eq!(shown("d\u{e9}j\u{e0}\tvu".as_bytes()), "`d\u{e9}j\u{e0}\\tvu`");
        assert_eq!(shown(b""), "``");
        assert_eq!(shown("\u{20ac}".repeat(100).as_bytes()), format!("`{}...`", "\u{20ac}".repeat(40)));
        for bytes in [&b"\xff\xfe1"[..], b"a\x01b", b"\0", "a\u{7f}".as_bytes(), b"caf\xe9"] {
            assert_eq!(shown(bytes), "a word that is no text", "{bytes:?}");
        }
    }
}
