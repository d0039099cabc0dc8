//! The statements of a piece of an OBJ file, as one thread reads them.

use std::collections::BTreeMap;

use crate::import::ImportFault;
use crate::import::error::shown;
use crate::import::text::{Cursor, is_blank, is_line_end};

/// Indices are kept in 31 bits, and relative ones around this.
pub(super) const RELATIVE: i64 = -(1 << 30);
pub(super) const MAX_INDEX: i64 = (1 << 31) - 1;
/// No index of this kind.
pub(super) const NONE: i32 = 0;
/// Different unknown statements that are told by name.
const MAX_UNKNOWN: usize = 8;

/// What changes for the faces that follow.
#[derive(Clone, Copy, Debug)]
pub(super) enum Event<'a> {
    Material(&'a [u8]),
    Object(&'a [u8]),
    Group(&'a [u8]),
    Smoothing(u32),
}

/// What one thread has read.
#[derive(Default)]
pub(super) struct Piece<'a> {
    /// What is taken off every position.
    pub origin: [f64; 3],
    pub positions: Vec<[f32; 3]>,
    /// Empty, or one per position.
    pub colors: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    pub normals: Vec<[f32; 3]>,
    /// Position, texture coordinates, normal of each corner: from 1, [`NONE`], or relative to the piece.
    pub corners: Vec<[i32; 3]>,
    /// Corners of each face; empty while all are triangles.
    pub sizes: Vec<u32>,
    pub faces: usize,
    pub events: Vec<(usize, Event<'a>)>,
    pub material_files: Vec<&'a [u8]>,
    pub lines_and_points: u64,
    pub unknown: BTreeMap<&'a [u8], u64>,
    pub more_unknown: u64,
}

/// Whether the line, or the file, ends after this byte.
#[inline(always)]
fn is_last_of_line(text: &Cursor, at: usize) -> bool {
    text.bytes.get(at + 1).is_none_or(|b| is_line_end(*b))
}

/// Passes blanks, and the ends of lines that go on; the last line of a file has nothing to go on with.
#[inline(always)]
pub(super) fn skip_blanks(text: &mut Cursor) {
    loop {
        text.skip_blanks();
        if text.peek() != Some(b'\\') || !is_last_of_line(text, text.at) {
            return;
        }
        text.at += 1;
        text.pass_line_end();
    }
}

/// The word that begins here, without the `\` that joins its line with the next.
#[inline(always)]
pub(super) fn word<'a>(text: &mut Cursor<'a>) -> &'a [u8] {
    let word = text.word();
    match word {
        [word @ .., b'\\'] if text.at_line_end() => {
            text.at -= 1;
            word
        }
        word => word,
    }
}

/// Passes a line, and those it goes on with.
pub(super) fn skip_line(text: &mut Cursor) {
    loop {
        let goes_on = text.rest_of_line().last() == Some(&b'\\');
        text.pass_line_end();
        if !goes_on || text.at_end() {
            return;
        }
    }
}

impl<'a> Piece<'a> {
    /// Reads statements from a line's start to the end.
    pub fn read(&mut self, bytes: &'a [u8], start: usize) -> Result<(), ImportFault> {
        let mut text = Cursor { bytes, at: start };
        while !text.at_end() {
            skip_blanks(&mut text);
            let at = text.at;
            match word(&mut text) {
                b"v" => self.position(&mut text)?,
                b"vt" => {
                    let u = number(&mut text, at, "vt", 1)?;
                    skip_blanks(&mut text);
                    self.uvs.push([u, read(&mut text, Cursor::f32).unwrap_or(0.0)]);
                }
                b"vn" => {
                    let mut of = |n| number(&mut text, at, "vn", n);
                    self.normals.push([of(1)?, of(2)?, of(3)?]);
                }
                b"f" | b"fo" => self.face(&mut text)?,
                b"" => {}
                // A comment ends with its line, also where a Windows path is the last word of it
                [b'#', ..] => {
                    text.rest_of_line();
                    text.pass_line_end();
                    continue;
                }
                b"usemtl" => self.events.push((self.faces, Event::Material(rest(&mut text)))),
                b"o" => self.events.push((self.faces, Event::Object(rest(&mut text)))),
                b"g" => self.events.push((self.faces, Event::Group(rest(&mut text)))),
                b"s" => self.smoothing(&mut text)?,
                b"mtllib" => self.material_files.push(rest(&mut text)),
                b"l" | b"p" => self.lines_and_points += 1,
                word => self.count_unknown(&word[..word.len().min(32)], 1),
            }
            skip_line(&mut text);
        }
        Ok(())
    }

    pub fn count_unknown(&mut self, word: &'a [u8], times: u64) {
        if let Some(count) = self.unknown.get_mut(word) {
            *count += times;
        } else if self.unknown.len() < MAX_UNKNOWN {
            self.unknown.insert(word, times);
        } else {
            self.more_unknown += times;
        }
    }

    #[inline(always)]
    pub fn position(&mut self, text: &mut Cursor) -> Result<(), ImportFault> {
        let at = text.at;
        if self.origin == [0.0; 3] {
            let mut of = |n| number(text, at, "v", n);
            self.positions.push([of(1)?, of(2)?, of(3)?]);
        } else {
            let mut position = [0.0; 3];
            for (i, value) in position.iter_mut().enumerate() {
                skip_blanks(text);
                let Some(number) = read(text, Cursor::f64) else { return Err(no_number(text, at, "v", i + 1)) };
                *value = (number - self.origin[i]) as f32;
            }
            self.positions.push(position);
        }
        skip_blanks(text);
        // Three numbers more are a colour; one is a weight
        if !text.at_line_end() {
            let mut more = [0.0; 3];
            for value in &mut more {
                skip_blanks(text);
                match read(text, Cursor::f32) {
                    Some(number) => *value = number,
                    None => return Ok(()),
                }
            }
            self.colors.resize(self.positions.len() - 1, [1.0; 3]);
            self.colors.push(more);
        }
        Ok(())
    }

    #[inline(always)]
    pub fn face(&mut self, text: &mut Cursor) -> Result<(), ImportFault> {
        let start = self.corners.len();
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        loop {
            skip_blanks(text);
            if text.at_line_end() || text.peek() == Some(b'#') {
                break;
            }
            self.corners.push(corner(text, counts)?);
        }
        let size = self.corners.len() - start;
        if size != 3 && self.sizes.is_empty() {
            self.sizes = vec![3; self.faces];
            // An empty list means triangles only: a first face of another size is put in at once
        }
        if size != 3 || !self.sizes.is_empty() {
            self.sizes.push(size as u32);
        }
        self.faces += 1;
        Ok(())
    }

    pub fn smoothing(&mut self, text: &mut Cursor) -> Result<(), ImportFault> {
        skip_blanks(text);
        let at = text.at;
        let group = match word(text) {
            b"off" | b"" | b"null" => 0,
            b"on" => 1,
            word => match std::str::from_utf8(word).ok().and_then(|w| w.parse::<i64>().ok()) {
                Some(group) if group <= i64::from(u32::MAX) => group.max(0) as u32,
                _ => {
                    let message = format!("smoothing group {}", shown(word));
                    return Err(ImportFault::text(at, message, "give a whole number from 0 to 4294967295, or `off`"));
                }
            },
        };
        self.events.push((self.faces, Event::Smoothing(group)));
        Ok(())
    }

    /// Corners of a face.
    pub fn size(&self, face: usize) -> u32 {
        self.sizes.get(face).copied().unwrap_or(3)
    }
}

/// The rest of a line as a name; what follows on a line that is joined with it is left out.
fn rest<'a>(text: &mut Cursor<'a>) -> &'a [u8] {
    skip_blanks(text);
    let line = text.clone().rest_of_line();
    let line = line.strip_suffix(b"\\").unwrap_or(line);
    text.at += line.len();
    line.trim_ascii()
}

/// The next number of a statement; `n`: which, for messages.
#[inline(always)]
fn number(text: &mut Cursor, at: usize, statement: &str, n: usize) -> Result<f32, ImportFault> {
    skip_blanks(text);
    match read(text, Cursor::f32) {
        Some(number) => Ok(number),
        None => Err(no_number(text, at, statement, n)),
    }
}

/// The number that begins here, also directly before the `\` that joins its line with the next.
#[inline(always)]
fn read<'a, T>(text: &mut Cursor<'a>, number: impl Fn(&mut Cursor<'a>) -> Option<T>) -> Option<T> {
    number(text).or_else(|| {
        let length = word(&mut text.clone()).len();
        let mut alone = Cursor { bytes: &text.bytes[..text.at + length], at: text.at };
        let value = number(&mut alone)?;
        text.at = alone.at;
        Some(value)
    })
}

#[cold]
fn no_number(text: &Cursor, at: usize, statement: &str, n: usize) -> ImportFault {
    let word = word(&mut text.clone());
    let hint = "a position has 3 numbers, texture coordinates have 1 to 3, a normal has 3";
    let message = if word.is_empty() {
        format!("{statement} has {} numbers", n - 1)
    } else {
        format!("{statement}: {} where number {n} is needed", shown(word))
    };
    ImportFault::text(at, message, hint)
}

/// One corner: `1`, `1/2`, `1//3` or `1/2/3`.
#[inline(always)]
pub(super) fn corner(text: &mut Cursor, counts: [usize; 3]) -> Result<[i32; 3], ImportFault> {
    let at = text.at;
    let mut corner = [NONE; 3];
    for (i, place) in corner.iter_mut().enumerate() {
        if i > 0 {
            if text.peek() != Some(b'/') {
                break;
            }
            text.at += 1;
            // Nothing between two slashes, or after the last
            if text.peek().is_none_or(|b| !b.is_ascii_digit() && b != b'-' && b != b'+') {
                continue;
            }
        }
        let negative = text.peek() == Some(b'-');
        text.at += usize::from(negative || text.peek() == Some(b'+'));
        let first = text.at;
        let mut index = 0i64;
        while let Some(digit) = text.peek().map(|b| b.wrapping_sub(b'0')).filter(|&d| d < 10) {
            index = index.saturating_mul(10).saturating_add(i64::from(digit));
            text.at += 1;
        }
        if text.at == first {
            return Err(bad_corner(text, at));
        }
        *place = match (negative, index) {
            // Some programs write 0 for texture coordinates and normals that are not there
            (_, 0) if i > 0 => NONE,
            (_, 0) => return Err(zero(text, at)),
            (false, 1..=MAX_INDEX) => index as i32,
            (true, 1..=0x1fff_ffff) => (RELATIVE + counts[i] as i64 - index) as i32,
            _ => return Err(far(text, at, if negative { -index } else { index })),
        };
    }
    if text.peek().is_some_and(|b| !is_blank(b) && !matches!(b, b'\n' | b'\r' | b'\\' | b'#')) {
        return Err(bad_corner(text, at));
    }
    Ok(corner)
}

#[cold]
fn bad_corner(text: &Cursor, at: usize) -> ImportFault {
    let word = Cursor { bytes: text.bytes, at }.word();
    let hint = "a corner is `position`, `position/uv`, `position//normal` or `position/uv/normal`";
    ImportFault::text(at, format!("{} is not a corner of a face", shown(word)), hint)
}

#[cold]
fn zero(text: &Cursor, at: usize) -> ImportFault {
    let word = Cursor { bytes: text.bytes, at }.word();
    ImportFault::text(at, format!("index 0 in {}", shown(word)), "indices begin at 1, or at -1 from the last")
}

#[cold]
fn far(text: &Cursor, at: usize, index: i64) -> ImportFault {
    let word = Cursor { bytes: text.bytes, at }.word();
    let hint = "indices are from -536870911 to 2147483647";
    ImportFault::text(at, format!("index {index} in {}", shown(word)), hint)
}
