//! STL: triangles and nothing else, in binary data or text.
//!
//! Corners at the same position (to the bit, -0 as 0) become one vertex, numbered in the order of the file: normals can
//! then be smoothed over edges. The normals of facets are not read: the order of the corners says the same
//! (counter-clockwise from outside), and more reliably. Neither are the two bytes after each binary facet, which some
//! programs use for colours.
//!
//! **Which of the two kinds a file is**, its first word does not tell: many binary files begin with `solid`. In this
//! order:
//!
//! 1. 84 bytes and 50 for each facet counted at byte 80: binary.
//! 2. It begins with `solid` in any case, after blanks or none, no byte of its first 1024 is zero, and `facet` or
//!    `endsolid` is among the 1024 bytes after that line, or nothing follows: text.
//! 3. At least 84 bytes: binary, and its count is wrong. More bytes than counted: the rest is ignored, with a note. A
//!    count of 0 or 2^32 - 1, and whole facets: it was not known when the header was written, and the length decides,
//!    with a note. Fewer bytes than counted: an error.
//!
//! Source: 3D Systems 1988, "StereoLithography Interface Specification".

use super::error::{WRITE_ANEW, shown};
use super::text::{Cursor, is_blank, is_line_end, pieces};
use super::weld::{Welded, weld};
use super::{ImportFault, MAX_COUNT, MeshData, MeshPart, Progress, all};
use crate::parallel::{self, CHUNK};

/// Bytes before the first facet.
const HEADER: usize = 84;
/// Bytes of a facet: normal, three corners, two bytes more.
const FACET: usize = 50;
/// Bytes of text that one thread reads at a time.
const PIECE: usize = 1 << 20;
/// Corners are counted in 32 bits while they become vertices.
const MAX_FACETS: u64 = MAX_COUNT / 3;

/// Reads an STL file of either kind.
pub(super) fn read(file: &[u8], progress: &Progress) -> Result<MeshData, ImportFault> {
    let counted = counted(file);
    if counted.is_some_and(|count| HEADER as u64 + count * FACET as u64 == file.len() as u64) {
        return read_binary(file, counted.unwrap_or_default(), None, progress);
    }
    if is_text(file) {
        return read_text(file, progress);
    }
    let Some(count) = counted else {
        let message = format!("begins with {}, and has {} bytes", shown(&file[..file.len().min(8)]), file.len());
        let hint = "an STL file begins with `solid`, or has a header of 84 bytes";
        return Err(ImportFault::binary(0, message, hint));
    };
    let bytes = (file.len() - HEADER) as u64;
    let held = bytes / FACET as u64;
    let unknown = (count == 0 && held > 0) || count == u64::from(u32::MAX);
    if unknown && bytes.is_multiple_of(FACET as u64) {
        let note = format!("the header counts {count} facets, the file has {held}: all are read");
        return read_binary(file, held, Some(note), progress);
    }
    if count > held {
        let message = format!("the header counts {count} facets, but the file has room for {held}");
        return Err(ImportFault::binary(80, message, WRITE_ANEW));
    }
    let note = format!("{} bytes after the last of {count} facets are ignored", bytes - count * FACET as u64);
    read_binary(file, count, Some(note), progress)
}

/// Whether a file of unknown name is STL.
pub(super) fn looks_like(file: &[u8]) -> bool {
    counted(file).is_some_and(|count| HEADER as u64 + count * FACET as u64 == file.len() as u64) || is_text(file)
}

/// The number of facets that a binary header counts.
fn counted(file: &[u8]) -> Option<u64> {
    let bytes = file.get(HEADER - 4..HEADER)?;
    Some(u64::from(u32::from_le_bytes(bytes.try_into().expect("four bytes"))))
}

fn is_text(file: &[u8]) -> bool {
    let mut text = start(file);
    // Text has no zero bytes; the header of a binary file nearly always has
    if !text.word().eq_ignore_ascii_case(b"solid") || file[..file.len().min(1024)].contains(&0) {
        return false;
    }
    text.rest_of_line();
    text.skip_space();
    if text.at_end() {
        return true;
    }
    let near = &file[text.at..file.len().min(text.at + 1024)];
    let has = |word: &[u8]| near.windows(word.len()).any(|w| w.eq_ignore_ascii_case(word));
    // A name and all facets on one line, too
    has(b"facet") || has(b"endsolid") || has(b"end solid")
}

/// The first word of a text, after a mark of byte order.
fn start(file: &[u8]) -> Cursor<'_> {
    let mut text = Cursor { bytes: file, at: if file.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 } };
    text.skip_space();
    text
}

fn read_binary(file: &[u8], count: u64, note: Option<String>, progress: &Progress) -> Result<MeshData, ImportFault> {
    check_count(count)?;
    let position = |corner: usize| {
        let at = HEADER + corner / 3 * FACET + 12 + corner % 3 * 12;
        let bytes = &file[at..at + 12];
        [0, 4, 8].map(|i| f32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]))
    };
    let mut mesh = join(3 * count as usize, position);
    mesh.notes.extend(note);
    progress.advance(file.len())?;
    Ok(mesh)
}

fn check_count(count: u64) -> Result<(), ImportFault> {
    if count > MAX_FACETS {
        return Err(ImportFault::TooMany { what: "triangles", count, limit: MAX_FACETS });
    }
    Ok(())
}

/// Makes one vertex of all corners at a position.
fn join(corners: usize, position: impl Fn(usize) -> [f32; 3] + Sync) -> MeshData {
    // Adding 0 makes 0 of -0
    let Welded { vertex, first } = weld(corners, |i| {
        let [x, y, z] = position(i).map(|x| (x + 0.0).to_bits());
        [x, y, z, 0]
    });
    MeshData {
        positions: parallel::map(first.len(), CHUNK, |i| position(first[i] as usize).map(|x| x + 0.0)),
        triangles: vertex.as_chunks().0.to_vec(),
        ..MeshData::default()
    }
}

/// What one thread has read.
#[derive(Default)]
struct StlPiece<'a> {
    corners: Vec<[f32; 3]>,
    /// The names of solids, and how many facets of the piece stand before each.
    solids: Vec<(usize, &'a [u8])>,
    /// Whether the last solid has ended.
    ended: bool,
}

fn read_text(file: &[u8], progress: &Progress) -> Result<MeshData, ImportFault> {
    // A piece begins with a facet, so that it can be read by itself
    let begins = |at: usize| {
        let mut text = Cursor { bytes: file, at };
        text.skip_blanks();
        let facet = text.word().eq_ignore_ascii_case(b"facet");
        text.skip_blanks();
        facet && text.word().eq_ignore_ascii_case(b"normal")
    };
    let pieces = pieces(file, start(file).at, PIECE, begins);
    let read = |i: usize| {
        let piece = &pieces[i];
        let found = read_piece(&file[..piece.end], piece.start)?;
        progress.advance(piece.len())?;
        Ok(found)
    };
    let parts = all(parallel::collect(pieces.len(), read))?;
    // Join the pieces and their solids
    let mut corners: Vec<[f32; 3]> = Vec::with_capacity(parts.iter().map(|p| p.corners.len()).sum());
    let mut solids: Vec<(usize, &[u8])> = Vec::new();
    let mut ended = true;
    for part in parts {
        let before = corners.len() / 3;
        solids.extend(part.solids.iter().map(|&(facet, name)| (before + facet, name)));
        corners.extend_from_slice(&part.corners);
        ended = part.ended;
    }
    let facets = corners.len() / 3;
    check_count(facets as u64)?;
    let mut mesh = join(corners.len(), |i| corners[i]);
    if !ended {
        mesh.notes.push("the text ends without `endsolid`".into());
    }
    let ends = solids.iter().skip(1).map(|&(facet, _)| facet).chain([facets]);
    let named = solids.iter().any(|(_, name)| !name.is_empty()) || solids.len() > 1;
    for (&(facet, name), end) in solids.iter().zip(ends).filter(|_| named) {
        let object = String::from_utf8_lossy(name).into_owned();
        mesh.parts.push(MeshPart { object, group: String::new(), triangles: facet as u32..end as u32 });
    }
    Ok(mesh)
}

/// Reads solids and facets, from a word to the end.
fn read_piece(bytes: &[u8], start: usize) -> Result<StlPiece<'_>, ImportFault> {
    let mut text = Cursor { bytes, at: start };
    let mut piece = StlPiece::default();
    loop {
        text.skip_space();
        let at = text.at;
        let word = text.word();
        if word.eq_ignore_ascii_case(b"facet") {
            facet(&mut text, &mut piece.corners)?;
        } else if word.eq_ignore_ascii_case(b"endsolid") || is_parted(&mut text, word, b"endsolid") {
            text.rest_of_line();
            piece.ended = true;
        } else if word.eq_ignore_ascii_case(b"solid") {
            piece.solids.push((piece.corners.len() / 3, name(&mut text)));
            piece.ended = false;
        } else if word.is_empty() {
            return Ok(piece);
        } else {
            let message = format!("{} where `facet`, `solid` or `endsolid` is needed", shown(word));
            return Err(ImportFault::text(at, message, WRITE_ANEW));
        }
    }
}

/// The name after `solid`: the rest of the line, unless a facet begins on it.
fn name<'a>(text: &mut Cursor<'a>) -> &'a [u8] {
    let start = text.at;
    let line = text.rest_of_line();
    let begins = |at: usize| {
        let apart = |i: usize| line.get(i).is_none_or(|&b| is_blank(b) || is_line_end(b));
        apart(at) && line[at + 1..].len() >= 12 && line[at + 1..at + 13].eq_ignore_ascii_case(b"facet normal")
    };
    match (0..line.len()).find(|&at| begins(at)) {
        Some(at) => {
            text.at = start + at;
            line[..at].trim_ascii()
        }
        None => line.trim_ascii(),
    }
}

/// Reads a facet after its first word.
#[inline(always)]
fn facet(text: &mut Cursor, corners: &mut Vec<[f32; 3]>) -> Result<(), ImportFault> {
    expect(text, b"normal")?;
    for _ in 0..3 {
        number(text)?;
    }
    expect(text, b"outer")?;
    expect(text, b"loop")?;
    for _ in 0..3 {
        expect(text, b"vertex")?;
        corners.push([number(text)?, number(text)?, number(text)?]);
    }
    expect(text, b"endloop")?;
    expect(text, b"endfacet")
}

#[inline(always)]
fn expect(text: &mut Cursor, needed: &'static [u8]) -> Result<(), ImportFault> {
    text.skip_space();
    let at = text.at;
    let word = text.word();
    if word == needed || word.eq_ignore_ascii_case(needed) || is_parted(text, word, needed) {
        return Ok(());
    }
    Err(missing(text, at, &format!("`{}`", String::from_utf8_lossy(needed))))
}

/// Whether `word`, which was read last, is the first half of `needed` in two words, as `end solid`; reads the second.
#[cold]
fn is_parted(text: &mut Cursor, word: &[u8], needed: &[u8]) -> bool {
    let mut after = text.clone();
    after.skip_blanks();
    let second = after.word();
    let parted = needed.len() > 3 && word.eq_ignore_ascii_case(b"end") && needed[..3] == *b"end";
    let is_needed = parted && second.eq_ignore_ascii_case(&needed[3..]);
    if is_needed {
        *text = after;
    }
    is_needed
}

#[inline(always)]
fn number(text: &mut Cursor) -> Result<f32, ImportFault> {
    text.skip_space();
    match text.f32() {
        Some(number) => Ok(number),
        None => Err(missing(text, text.at, "a number")),
    }
}

#[cold]
fn missing(text: &Cursor, at: usize, needed: &str) -> ImportFault {
    let word = Cursor { bytes: text.bytes, at }.word();
    if word.is_empty() {
        return ImportFault::text(at, format!("the file ends where {needed} is needed"), WRITE_ANEW);
    }
    let hint = "a facet is `facet normal x y z outer loop`, three times `vertex x y z`, `endloop endfacet`";
    ImportFault::text(at, format!("{} where {needed} is needed", shown(word)), hint)
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::super::{ImportError, MeshFormat};
    use super::*;

    fn read(bytes: &[u8]) -> Result<MeshData, ImportError> {
        MeshFormat::Stl.read("a.stl", bytes, &|_, _| ControlFlow::Continue(()))
    }

    /// `held` facets, of which the header counts `counted`, and bytes after them.
    fn binary(start: &[u8], counted: u32, held: u32, after: usize) -> Vec<u8> {
        let mut bytes = start.to_vec();
        bytes.resize(80, b' ');
        bytes.extend(counted.to_le_bytes());
        for i in 0..held {
            let corners = [[0.0, 0.0, i as f32], [1.0, 0.0, 0.0], [-0.0, 1.0, 0.0]];
            bytes.extend([0; 12]);
            bytes.extend(corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([7, 7]);
        }
        bytes.resize(bytes.len() + after, 0);
        bytes
    }

    #[test]
    fn a_binary_file_may_begin_with_solid() {
        for start in ["solid facet normal", "SOLID", "", "\nsolid"] {
            let mesh = read(&binary(start.as_bytes(), 2, 2, 0)).unwrap();
            assert_eq!(mesh.triangles, [[0, 1, 2], [3, 1, 2]], "{start}");
            assert_eq!(mesh.positions[2], [0.0, 1.0, 0.0]);
            assert!(mesh.positions[2][0].is_sign_positive() && mesh.notes.is_empty());
        }
    }

    #[test]
    fn counts_that_differ_from_the_length() {
        let facets =
            |counted, held, after| read(&binary(b"solid", counted, held, after)).map(|m| (m.triangles.len(), m.notes));
        assert_eq!(facets(1, 2, 0).unwrap(), (1, vec!["50 bytes after the last of 1 facets are ignored".into()]));
        assert_eq!(facets(2, 2, 3).unwrap(), (2, vec!["3 bytes after the last of 2 facets are ignored".into()]));
        for unknown in [0, u32::MAX] {
            let note = format!("the header counts {unknown} facets, the file has 2: all are read");
            assert_eq!(facets(unknown, 2, 0).unwrap(), (2, vec![note]));
        }
        assert_eq!(facets(0, 0, 0).unwrap(), (0, vec![]));
        assert!(facets(3, 2, 0).is_err() && facets(u32::MAX, 2, 1).is_err());
    }

    const FACET_TEXT: &str = "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet ";

    #[test]
    fn text_of_any_case_on_any_lines() {
        for text in [
            format!("solid {FACET_TEXT}endsolid"),
            format!("SOLID\r{}\rENDSOLID", FACET_TEXT.to_uppercase().replace(' ', "\r\r")),
            format!("\u{feff} \tSolid\n{}\nendsolid name of it", FACET_TEXT.replace(' ', " \t\r\n ")),
            format!("solid\n{}\nEnd  Solid name of it\n", FACET_TEXT.replace("end", "end ")),
        ] {
            let mesh = read(text.as_bytes()).unwrap();
            assert_eq!((mesh.triangles.as_slice(), mesh.parts.len()), (&[[0, 1, 2]][..], 0), "{text}");
            assert!(mesh.notes.is_empty());
        }
        for text in ["solid nothing\nendsolid nothing\n", "solid nothing\nend solid\n"] {
            assert_eq!(read(text.as_bytes()).unwrap().triangles.len(), 0);
        }
        assert!(read(format!("solid\n{FACET_TEXT}end facet").as_bytes()).is_err());
    }

    #[test]
    fn several_solids_are_parts() {
        let text = format!("solid a b\n{FACET_TEXT}\n{FACET_TEXT}\nendsolid a b\nsolid facet\n{FACET_TEXT}\n");
        let mesh = read(text.as_bytes()).unwrap();
        let parts: Vec<_> = mesh.parts.iter().map(|p| (p.object.as_str(), p.triangles.clone())).collect();
        assert_eq!(parts, [("a b", 0..2), ("facet", 2..3)]);
        assert_eq!(mesh.notes, ["the text ends without `endsolid`"]);
        assert_eq!(mesh.positions.len(), 3);
    }
}
