//! The header of a PLY file.

use super::super::ImportFault;
use super::super::error::{WRITE_ANEW, shown};
use super::super::text::Cursor;

/// How the values after the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DataEncoding {
    Ascii,
    Little,
    Big,
}

/// The type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a binary value.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(super) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// One value, or a list of values after their number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PropertyKind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

#[derive(Clone, Debug)]
pub(super) struct Property<'a> {
    pub(super) name: &'a [u8],
    pub(super) kind: PropertyKind,
}

#[derive(Clone, Debug)]
pub(super) struct Element<'a> {
    pub(super) name: &'a [u8],
    pub(super) count: u64,
    pub(super) properties: Vec<Property<'a>>,
    /// Where the header names it.
    pub(super) at: usize,
}

impl Element<'_> {
    /// The fewest bytes that a row takes.
    pub(super) fn least_row(&self, encoding: DataEncoding) -> u64 {
        let size = |p: &Property| match (encoding, p.kind) {
            // A digit, and what parts it from the next
            (DataEncoding::Ascii, _) => 2,
            (_, PropertyKind::Scalar(scalar)) => scalar.size() as u64,
            (_, PropertyKind::List { count, .. }) => count.size() as u64,
        };
        self.properties.iter().map(size).sum()
    }
}

#[derive(Clone, Debug)]
pub(super) struct Header<'a> {
    pub(super) encoding: DataEncoding,
    pub(super) elements: Vec<Element<'a>>,
    /// Lines before the first element that begin with no word of the format: they are skipped.
    pub(super) stray: usize,
    /// The first byte after the header.
    pub(super) body: usize,
}

const SCALARS: &str = "types are char, uchar, short, ushort, int, uint, float, double, and int8 to float64";

impl<'a> Header<'a> {
    /// Reads up to and with `end_header` and its line end.
    pub(super) fn read(file: &'a [u8]) -> Result<Self, ImportFault> {
        let mut text = Cursor { bytes: file, at: 0 };
        let first = text.rest_of_line();
        if first.trim_ascii() != b"ply" {
            let message = format!("the first line is {}, not `ply`", shown(first));
            return Err(ImportFault::text(0, message, "give a PLY file"));
        }
        // What ends the first line ends the last: data that begins like a line end is no part of it
        let only_cr = text.peek() == Some(b'\r') && text.bytes.get(text.at + 1) != Some(&b'\n');
        text.pass_line_end();
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut stray = 0;
        loop {
            let line = text.at;
            if text.at_end() {
                return Err(ImportFault::text(line, "the header has no `end_header`", WRITE_ANEW));
            }
            text.skip_blanks();
            match text.word() {
                b"end_header" => {
                    text.rest_of_line();
                    if only_cr {
                        text.at = (text.at + 1).min(file.len())
                    } else {
                        text.pass_line_end()
                    }
                    break;
                }
                b"comment" | b"obj_info" | b"" => {}
                b"format" => encoding = Some(Self::format(&mut text, line)?),
                b"element" => {
                    let element = Self::element(&mut text, line)?;
                    if let Some(twice) = elements.iter().find(|e| e.name == element.name) {
                        let message = format!("a second element {}", shown(twice.name));
                        return Err(ImportFault::text(line, message, "each element stands once in a header"));
                    }
                    elements.push(element);
                    // Looking through all names for each new one must stay cheap
                    if elements.len() > 256 {
                        return Err(ImportFault::text(line, "more than 256 elements", "leave some out"));
                    }
                }
                b"property" => {
                    let property = Self::property(&mut text, line)?;
                    let Some(element) = elements.last_mut() else {
                        return Err(ImportFault::text(line, "a property before any element", WRITE_ANEW));
                    };
                    element.properties.push(property);
                    if element.properties.len() > 4096 {
                        return Err(ImportFault::text(
                            line,
                            "more than 4096 properties of one element",
                            "leave some out",
                        ));
                    }
                }
                // Blender 2.4 writes its name there, without the word `comment`
                _ if elements.is_empty() => stray += 1,
                other => {
                    let message = format!("{} in the header", shown(other));
                    let hint = "lines begin with format, comment, obj_info, element, property or end_header";
                    return Err(ImportFault::text(line, message, hint));
                }
            }
            text.rest_of_line();
            text.pass_line_end();
        }
        let Some(encoding) = encoding else {
            return Err(ImportFault::text(0, "the header has no `format`", WRITE_ANEW));
        };
        Ok(Self { encoding, elements, stray, body: text.at })
    }

    fn format(text: &mut Cursor, line: usize) -> Result<DataEncoding, ImportFault> {
        text.skip_blanks();
        match text.word() {
            b"ascii" => Ok(DataEncoding::Ascii),
            b"binary_little_endian" => Ok(DataEncoding::Little),
            b"binary_big_endian" => Ok(DataEncoding::Big),
            other => {
                let message = format!("format {}", shown(other));
                Err(ImportFault::text(line, message, "formats are ascii, binary_little_endian and binary_big_endian"))
            }
        }
    }

    fn element(text: &mut Cursor<'a>, line: usize) -> Result<Element<'a>, ImportFault> {
        text.skip_blanks();
        let name = text.word();
        text.skip_blanks();
        let number = text.word();
        match std::str::from_utf8(number).ok().and_then(|n| n.parse().ok()) {
            Some(count) => Ok(Element { name, count, properties: Vec::new(), at: line }),
            None => {
                let message = format!("element {} has the count {}", shown(name), shown(number));
                Err(ImportFault::text(line, message, "a count is a whole number from 0 to 2^64 - 1"))
            }
        }
    }

    fn property(text: &mut Cursor<'a>, line: usize) -> Result<Property<'a>, ImportFault> {
        let mut word = || {
            text.skip_blanks();
            text.word()
        };
        let scalar = |word: &[u8]| {
            Scalar::named(word).ok_or_else(|| ImportFault::text(line, format!("the type {}", shown(word)), SCALARS))
        };
        let kind = match word() {
            b"list" => {
                let count = scalar(word())?;
                if count.is_float() {
                    let hint = "a list is counted by char, uchar, short, ushort, int or uint";
                    return Err(ImportFault::text(line, "a list counted by fractions", hint));
                }
                PropertyKind::List { count, item: scalar(word())? }
            }
            other => PropertyKind::Scalar(scalar(other)?),
        };
        match word() {
            b"" => Err(ImportFault::text(line, "a property without a name", WRITE_ANEW)),
            name => Ok(Property { name, kind }),
        }
    }
}
