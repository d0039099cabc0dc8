//! Wavefront MTL: what a file of materials says, statement by statement. What it means is in `model/mtl.rs`; statements
//! of textures are in `mtl/picture.rs`.
//!
//! Keywords are read in any case, with blanks or tabs between words; `#` begins a comment at the start of a line and
//! after numbers; `\` at the end of a line goes on with the next. What is no UTF-8 is read as Windows-1252. A statement
//! that cannot be used is left out with a note, and never makes the file an error: files of this kind are written by
//! many programs, and few of them follow the specification.
//!
//! Sources: Wavefront, "MTL material format", 1995 (in P. Bourke, "Object files"); the terms `Pr` to `norm`: Exocortex,
//! "Extending the Wavefront MTL format to support PBR", 2015.

mod picture;

use std::collections::HashMap;

use super::error::shown;
use super::text::{Cursor, decoded};
use super::{ImportError, MeshPlace};

pub(crate) use picture::MtlPicture;

/// The longest file, in bytes.
const MAX_FILE: u64 = 1 << 26;
/// The most materials.
const MAX_MATERIALS: u64 = 1 << 16;
/// Notes of different kinds; of the others their number is told.
const MAX_NOTES: usize = 100;

/// What a user may want to know of a file of materials, with the line that gave rise to it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MtlNote {
    /// 1-based; of several lines the first.
    pub line: u64,
    /// What was found, with its value, and what was made of it.
    pub message: String,
    /// What to do.
    pub hint: Option<String>,
}

/// Notes, one of each kind.
#[derive(Debug, Default)]
pub(crate) struct MtlNotes {
    /// Each with the number of lines that say the same.
    list: Vec<(MtlNote, u64)>,
    kinds: HashMap<String, usize>,
    /// Of kinds beyond the limit.
    more: u64,
}

impl MtlNotes {
    /// Of each `kind` the first is kept, the others are counted.
    pub fn add(&mut self, kind: &str, line: u64, message: impl Into<String>, hint: &str) {
        if let Some(&index) = self.kinds.get(kind) {
            self.list[index].1 += 1;
        } else if self.list.len() < MAX_NOTES {
            self.kinds.insert(kind.to_owned(), self.list.len());
            let hint = (!hint.is_empty()).then(|| hint.to_owned());
            self.list.push((MtlNote { line, message: message.into(), hint }, 1));
        } else {
            self.more += 1;
        }
    }

    /// In the order of lines.
    pub fn finish(self) -> Vec<MtlNote> {
        let several = |(mut note, count): (MtlNote, u64)| {
            match count {
                1 => {}
                2 => note.message.push_str(" (one more line is alike)"),
                _ => note.message.push_str(&format!(" ({} more lines are alike)", count - 1)),
            }
            note
        };
        let mut notes: Vec<MtlNote> = self.list.into_iter().map(several).collect();
        notes.sort_by_key(|note| note.line);
        if self.more > 0 {
            let line = notes.last().map_or(1, |note| note.line);
            notes.push(MtlNote { line, message: format!("{} more notes are left out", self.more), hint: None });
        }
        notes
    }
}

/// A colour that a material may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum MtlColor {
    Ka,
    Kd,
    Ks,
    Ke,
}

/// A number that a material may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum MtlNumber {
    Ns,
    D,
    Tr,
    Ni,
    Pr,
    Pm,
    Pc,
    Pcr,
}

/// What a picture is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum MtlMap {
    Ka,
    Kd,
    Ks,
    Ke,
    Ns,
    D,
    Pr,
    Pm,
    Bump,
    Normal,
}

/// A material as a file says it: numbers are finite and within their ranges; of statements that come twice the last.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct MtlMaterial {
    pub line: u64,
    pub name: String,
    /// 0 to 10.
    pub illum: Option<u32>,
    /// Whether it has a term of the metallic-roughness kind.
    pub is_metallic_roughness: bool,
    pub colors: HashMap<MtlColor, ([f64; 3], u64)>,
    pub numbers: HashMap<MtlNumber, (f64, u64)>,
    pub maps: HashMap<MtlMap, MtlPicture>,
}

/// Reads the statements of a file called `name`.
///
/// # Errors
/// For what is no text, too long, or has too many materials.
pub(crate) fn read(name: &str, bytes: &[u8], notes: &mut MtlNotes) -> Result<Vec<MtlMaterial>, ImportError> {
    let too_many = |what, count, limit| ImportError::TooMany { file: name.to_owned(), what, count, limit };
    if bytes.len() as u64 > MAX_FILE {
        return Err(too_many("bytes", bytes.len() as u64, MAX_FILE));
    }
    if let Some(at) = bytes.iter().position(|&byte| byte == 0) {
        let message = "holds a byte 0, which no text has".to_owned();
        let hint = "an MTL file is text with lines that begin with newmtl; save it as UTF-8".to_owned();
        let place = MeshPlace::Byte(at as u64);
        return Err(ImportError::Damaged { file: name.to_owned(), place, message, hint });
    }
    let mut file =
        StatementReader { notes, line: 0, materials: Vec::new(), names: HashMap::new(), state: State::Before };
    let start = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    let mut text = Cursor { bytes, at: start };
    let mut line = 1;
    while !text.at_end() {
        file.line = line;
        let (first, joined) = logical_line(&mut text, &mut line);
        file.statement(first, joined.as_deref().unwrap_or(first));
        if file.materials.len() as u64 > MAX_MATERIALS {
            return Err(too_many("materials", file.materials.len() as u64, MAX_MATERIALS));
        }
    }
    let StatementReader { materials, .. } = file;
    if materials.is_empty() {
        notes.add("empty", 1, "holds no material", "a material begins with the line `newmtl NAME`");
    }
    Ok(materials)
}

/// The line that begins here without `\` at its end, and, where it goes on, the whole with a blank at each joint.
/// `line` is counted up.
fn logical_line<'a>(text: &mut Cursor<'a>, line: &mut u64) -> (&'a [u8], Option<Vec<u8>>) {
    let mut next = || {
        let part = text.rest_of_line();
        text.pass_line_end();
        *line += 1;
        let goes_on = part.strip_suffix(b"\\").filter(|_| !text.at_end());
        (goes_on.unwrap_or(part), goes_on.is_some())
    };
    let (first, mut goes_on) = next();
    // A comment ends with its line, also where a Windows path is the last word of it
    if !goes_on || first.trim_ascii_start().starts_with(b"#") {
        return (first, None);
    }
    let mut joined = first.to_vec();
    while goes_on {
        let (part, more) = next();
        joined.push(b' ');
        joined.extend_from_slice(part);
        goes_on = more;
    }
    (first, Some(joined))
}

/// Where statements go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Before the first material.
    Before,
    /// To the last of the list.
    Material,
    /// To none: the material has no name, or its name is taken.
    LeftOut,
}

struct StatementReader<'n> {
    notes: &'n mut MtlNotes,
    line: u64,
    materials: Vec<MtlMaterial>,
    /// The line of each.
    names: HashMap<String, u64>,
    state: State,
}

/// Statements that are known, change nothing here, and are worth a note.
const UNUSED: &[&str] = &[
    "tf",
    "km",
    "kt",
    "sharpness",
    "refl",
    "map_refl",
    "disp",
    "map_disp",
    "decal",
    "map_ps",
    "map_rma",
    "map_orm",
    "map_tr",
    "map_tf",
];

impl StatementReader<'_> {
    /// `first`: the first of the lines that are `whole` together.
    fn statement(&mut self, first: &[u8], whole: &[u8]) {
        let mut text = Cursor { bytes: whole, at: 0 };
        text.skip_blanks();
        let written = text.word();
        if written.is_empty() || written.starts_with(b"#") {
            return;
        }
        // All keywords are short
        let keyword = String::from_utf8_lossy(&written[..written.len().min(32)]).to_ascii_lowercase();
        if keyword == "newmtl" {
            return self.begin(first.trim_ascii_start().get(written.len()..).unwrap_or_default());
        }
        match self.state {
            State::LeftOut => return,
            State::Before => {
                let message = format!("{} stands before the first material, and is left out", shown(written));
                return self.notes.add("before", self.line, message, "a material begins with the line `newmtl NAME`");
            }
            State::Material => {}
        }
        match keyword.as_str() {
            "ka" => self.color(&mut text, MtlColor::Ka, written),
            "kd" => self.color(&mut text, MtlColor::Kd, written),
            "ks" => self.color(&mut text, MtlColor::Ks, written),
            "ke" => self.color(&mut text, MtlColor::Ke, written),
            "ns" => self.number(&mut text, MtlNumber::Ns, written, 1e6),
            "d" => self.dissolve(&mut text, written),
            "tr" => self.number(&mut text, MtlNumber::Tr, written, 1.0),
            "ni" => self.number(&mut text, MtlNumber::Ni, written, 100.0),
            "pr" => self.number(&mut text, MtlNumber::Pr, written, 1.0),
            "pm" => self.number(&mut text, MtlNumber::Pm, written, 1.0),
            "pc" => self.number(&mut text, MtlNumber::Pc, written, 1.0),
            "pcr" => self.number(&mut text, MtlNumber::Pcr, written, 1.0),
            "illum" => self.illum(&mut text),
            "map_ka" => self.map(text, MtlMap::Ka, written),
            "map_kd" => self.map(text, MtlMap::Kd, written),
            "map_ks" => self.map(text, MtlMap::Ks, written),
            "map_ke" => self.map(text, MtlMap::Ke, written),
            "map_ns" => self.map(text, MtlMap::Ns, written),
            "map_d" => self.map(text, MtlMap::D, written),
            "map_pr" => self.map(text, MtlMap::Pr, written),
            "map_pm" => self.map(text, MtlMap::Pm, written),
            "bump" | "map_bump" => self.map(text, MtlMap::Bump, written),
            "norm" | "map_norm" => self.map(text, MtlMap::Normal, written),
            // Of a renderer's own antialiasing
            "map_aat" => {}
            "ps" | "aniso" | "anisor" => {
                self.material().is_metallic_roughness = true;
                self.unused(&mut text, written, Some(0.0));
            }
            "tf" => self.unused(&mut text, written, Some(1.0)),
            word if UNUSED.contains(&word) => {
                self.material().is_metallic_roughness |= matches!(word, "map_ps" | "map_rma" | "map_orm");
                self.unused(&mut text, written, None);
            }
            _ => {
                let message =
                    format!("{} is no statement of an MTL file that is known, and is left out", shown(written));
                self.notes.add(&keyword, self.line, message, "");
            }
        }
        if matches!(keyword.as_str(), "pr" | "pm" | "pc" | "pcr" | "map_pr" | "map_pm") {
            self.material().is_metallic_roughness = true;
        }
    }

    /// A note of what changes nothing, unless all its numbers are `neutral`.
    fn unused(&mut self, text: &mut Cursor, written: &[u8], neutral: Option<f64>) {
        text.skip_blanks();
        if let Some(neutral) = neutral
            && !text.at_end()
            && self.numbers(text).iter().all(|number| *number == neutral)
        {
            return;
        }
        let message = format!("{} is not used", shown(written));
        let hint = match written.to_ascii_lowercase().as_slice() {
            b"refl" | b"map_refl" => "surfaces mirror nothing",
            b"disp" | b"map_disp" | b"decal" => "textures move no surface; a bump map bends its normals",
            b"map_rma" | b"map_orm" => "programs disagree on what its channels are: write map_Pr and map_Pm",
            b"map_tr" => "write map_d",
            _ => "no material here has it",
        };
        self.notes.add(&format!("unused {}", String::from_utf8_lossy(written)), self.line, message, hint);
    }

    fn material(&mut self) -> &mut MtlMaterial {
        self.materials.last_mut().expect("a state of `Material` has one")
    }

    /// The name is all of the line, as OBJ has it after `usemtl`.
    fn begin(&mut self, rest: &[u8]) {
        self.state = State::LeftOut;
        let name = self.text(rest.trim_ascii());
        if name.is_empty() {
            let message = "a material without a name is left out";
            return self.notes.add("nameless", self.line, message, "write `newmtl NAME`");
        }
        if let Some(line) = self.names.get(&name) {
            let message =
                format!("the material {} is described a second time, after line {line}", shown(name.as_bytes()));
            return self.notes.add("twice", self.line, message, "the first is taken; give the other a name of its own");
        }
        self.names.insert(name.clone(), self.line);
        self.materials.push(MtlMaterial { line: self.line, name, ..MtlMaterial::default() });
        self.state = State::Material;
    }

    /// Text of any encoding.
    fn text(&mut self, bytes: &[u8]) -> String {
        let (text, is_foreign) = decoded(bytes);
        if is_foreign {
            let message = format!("{} is no UTF-8, and is read as Windows-1252", shown(text.as_bytes()));
            self.notes.add("encoding", self.line, message, "save the file as UTF-8 if names are wrong");
        }
        text
    }

    /// The finite numbers that follow, before a comment or another word.
    fn numbers(&mut self, text: &mut Cursor) -> Vec<f64> {
        let mut numbers = Vec::new();
        loop {
            text.skip_blanks();
            let before = text.at;
            match text.f64() {
                Some(number) if number.is_finite() && numbers.len() < 4 => numbers.push(number),
                _ => {
                    text.at = before;
                    return numbers;
                }
            }
        }
    }

    /// Says that a statement is left out for the word that comes next.
    fn no_number(&mut self, text: &Cursor, written: &[u8], allowed: &str) {
        let word = text.next_word();
        let kind = format!("number {}", String::from_utf8_lossy(written));
        let message = match word {
            b"" => format!("{} has no number, and is left out", shown(written)),
            _ => format!("{}: {} is no finite number, and the line is left out", shown(written), shown(word)),
        };
        let hint = if word.contains(&b',') { "write a point before the fraction, not a comma" } else { allowed };
        self.notes.add(&kind, self.line, message, hint);
    }

    /// Within 0 and `most`.
    fn clamped(&mut self, value: f64, most: f64, written: &[u8]) -> f64 {
        if (0.0..=most).contains(&value) {
            return value;
        }
        let nearest = value.clamp(0.0, most);
        let message = format!("{}: {value} is outside 0 to {most}, and is taken as {nearest}", shown(written));
        self.notes.add(&format!("range {}", String::from_utf8_lossy(written)), self.line, message, "");
        nearest
    }

    fn color(&mut self, text: &mut Cursor, color: MtlColor, written: &[u8]) {
        const ALLOWED: &str = "a colour is one number, or three: red, green and blue";
        text.skip_blanks();
        let word = text.next_word();
        if word.eq_ignore_ascii_case(b"spectral") || word.eq_ignore_ascii_case(b"xyz") {
            let message = format!("{} of the kind {} is left out", shown(written), shown(word));
            return self.notes.add("colour kind", self.line, message, "give red, green and blue");
        }
        let numbers = self.numbers(text);
        text.skip_blanks();
        let rgb = match numbers[..] {
            [] => return self.no_number(text, written, ALLOWED),
            [gray] => [gray; 3],
            [r, g, b] => [r, g, b],
            [r, g, ..] => {
                let message =
                    format!("{} has {} numbers", shown(written), if numbers.len() > 3 { "over 3" } else { "2" });
                self.notes.add(&format!("count {}", String::from_utf8_lossy(written)), self.line, message, ALLOWED);
                [r, g, numbers.get(2).copied().unwrap_or(g)]
            }
        };
        if !text.at_end() && text.peek() != Some(b'#') && numbers.len() < 3 {
            return self.no_number(text, written, ALLOWED);
        }
        let rgb = rgb.map(|value| self.clamped(value, 1e6, written));
        let line = self.line;
        self.material().colors.insert(color, (rgb, line));
    }

    fn number(&mut self, text: &mut Cursor, number: MtlNumber, written: &[u8], most: f64) {
        let Some(&value) = self.numbers(text).first() else {
            return self.no_number(text, written, "it has one number");
        };
        let value = self.clamped(value, most, written);
        let line = self.line;
        self.material().numbers.insert(number, (value, line));
    }

    fn dissolve(&mut self, text: &mut Cursor, written: &[u8]) {
        text.skip_blanks();
        if text.next_word().eq_ignore_ascii_case(b"-halo") {
            text.word();
            let message = "d -halo is taken without -halo: as dense at the rim as in the middle";
            self.notes.add("halo", self.line, message, "");
        }
        self.number(text, MtlNumber::D, written, 1.0);
    }

    fn illum(&mut self, text: &mut Cursor) {
        match self.numbers(text).first() {
            Some(&model) if (0.0..=10.0).contains(&model) && model.fract() == 0.0 => {
                self.material().illum = Some(model as u32);
            }
            Some(&model) => {
                let message = format!("illum {model} is left out");
                self.notes.add("illum", self.line, message, "it is a whole number from 0 to 10");
            }
            None => self.no_number(text, b"illum", "it is a whole number from 0 to 10"),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub fn read_with_notes(text: &[u8]) -> (Vec<MtlMaterial>, Vec<MtlNote>) {
        let mut notes = MtlNotes::default();
        let materials = read("a.mtl", text, &mut notes).unwrap();
        (materials, notes.finish())
    }

    pub fn words(notes: &[MtlNote]) -> Vec<(u64, &str)> {
        notes.iter().map(|note| (note.line, note.message.as_str())).collect()
    }

    #[test]
    fn keywords_blanks_and_line_ends_of_all_kinds() {
        let text = b"\xef\xbb\xbf# made by hand\r\n\r\n\tNEWMTL my \tgold #25 \r\n\tkd\t1 0.5\t.25 # red\r\
                     NS 10\nD 0.5#\n illum 2 \n\nKs 0.5\nKe 1 \\\n 2 \\\r\n 3\n# a path\\\nNi 1.5";
        let (materials, notes) = read_with_notes(text);
        let [material] = &materials[..] else { panic!() };
        assert_eq!((material.name.as_str(), material.line, material.illum), ("my \tgold #25", 3, Some(2)));
        let color = |color| material.colors[&color];
        assert_eq!(color(MtlColor::Kd), ([1.0, 0.5, 0.25], 4));
        assert_eq!(color(MtlColor::Ks), ([0.5; 3], 9));
        assert_eq!(color(MtlColor::Ke), ([1.0, 2.0, 3.0], 10));
        assert_eq!(material.numbers[&MtlNumber::Ns], (10.0, 5));
        assert_eq!(material.numbers[&MtlNumber::Ni], (1.5, 14));
        // `0.5#` is one word
        assert_eq!(words(&notes), [(6, "`D`: `0.5#` is no finite number, and the line is left out")]);
    }

    #[test]
    fn text_that_is_no_utf8_is_of_windows() {
        let (materials, notes) = read_with_notes(b"newmtl caf\xe9\nmap_Kd bo\xeete \x80.png\n");
        assert_eq!(
            (materials[0].name.as_str(), materials[0].maps[&MtlMap::Kd].file.as_str()),
            ("caf\u{e9}", "bo\u{ee}te \u{20ac}.png")
        );
        let message = "`caf\u{e9}` is no UTF-8, and is read as Windows-1252 (one more line is alike)";
        assert_eq!(words(&notes), [(1, message)]);
    }

    #[test]
    fn what_cannot_be_used_is_left_out_with_a_note() {
        let text = b"Kd 1 0 0\nnewmtl\nKd 1 1 1\nnewmtl a\nKd nan 0 0\nKd 1 x 0\nKs 0,5\nKs\nNs -3\nNs inf\nd 1.5\n\
                     Pr 1e30\nillum 11\nillum 2.5\nKe spectral a.rfl\nKe 1 2\nKt 1\nhello 1\nTf 1 1 1\nTf 0 1 0\n\
                     refl a.png\ndisp a.png\nPs 0\naniso 0.5\nmap_aat on\nnewmtl a\nKd 0 0 1\nhello\n";
        let (materials, notes) = read_with_notes(text);
        let [a] = &materials[..] else { panic!() };
        assert!(a.is_metallic_roughness && a.illum.is_none() && !a.colors.contains_key(&MtlColor::Kd));
        assert_eq!([MtlNumber::Ns, MtlNumber::D, MtlNumber::Pr].map(|number| a.numbers[&number].0), [0.0, 1.0, 1.0]);
        assert_eq!(a.colors[&MtlColor::Ke].0, [1.0, 2.0, 2.0]);
        assert_eq!(
            words(&notes),
            [
                (1, "`Kd` stands before the first material, and is left out"),
                (2, "a material without a name is left out"),
                (5, "`Kd`: `nan` is no finite number, and the line is left out (one more line is alike)"),
                (7, "`Ks`: `0,5` is no finite number, and the line is left out (one more line is alike)"),
                (9, "`Ns`: -3 is outside 0 to 1000000, and is taken as 0"),
                (10, "`Ns`: `inf` is no finite number, and the line is left out"),
                (11, "`d`: 1.5 is outside 0 to 1, and is taken as 1"),
                (12, "`Pr`: 1000000000000000000000000000000 is outside 0 to 1, and is taken as 1"),
                (13, "illum 11 is left out (one more line is alike)"),
                (15, "`Ke` of the kind `spectral` is left out"),
                (16, "`Ke` has 2 numbers"),
                (17, "`Kt` is not used"),
                (18, "`hello` is no statement of an MTL file that is known, and is left out"),
                (20, "`Tf` is not used"),
                (21, "`refl` is not used"),
                (22, "`disp` is not used"),
                (24, "`aniso` is not used"),
                (26, "the material `a` is described a second time, after line 4"),
            ]
        );
        assert_eq!(notes[3].hint.as_deref(), Some("write a point before the fraction, not a comma"));
    }

    #[test]
    fn hostile_files_are_errors_or_bounded() {
        let fault = |bytes: &[u8]| read("a.mtl", bytes, &mut MtlNotes::default()).unwrap_err().to_string();
        let words = "a.mtl, byte 9: holds a byte 0, which no text has; an MTL file is text with lines that begin with \
                     newmtl; save it as UTF-8";
        assert_eq!(fault(b"newmtl a\n\0"), words);
        let many: String = (0..65_537).map(|i| format!("newmtl {i}\n")).collect();
        assert_eq!(
            fault(many.as_bytes()),
            "a.mtl: has 65537 materials, the limit is 65536; split it into several files"
        );
        let long = vec![b' '; (1 << 26) + 1];
        assert_eq!(fault(&long), "a.mtl: has 67108865 bytes, the limit is 67108864; split it into several files");
        // Of many kinds of notes the first are kept
        let odd: String = (0..200).map(|i| format!("k{i}\n")).collect();
        let (_, notes) = read_with_notes(format!("newmtl a\n{odd}").as_bytes());
        assert_eq!((notes.len(), notes[100].message.as_str()), (101, "100 more notes are left out"));
        assert_eq!(read_with_notes(b"").1[0].message, "holds no material");
        // Whatever is done to a file
        let sound = b"newmtl a b\nKd 1 0.5 0\nmap_Kd -s 2 2 1 -clamp on a\\b c.png -bm 2 # red\nd -halo 0.5\\\nNs 4\n";
        let mut random = firstlight_testkit::Random::new(1);
        for _ in 0..20_000 {
            let mut damaged = sound.to_vec();
            for _ in 0..1 + random.below(4) {
                let (at, from) = (random.below(sound.len() as u32) as usize, random.below(sound.len() as u32) as usize);
                damaged[at] = if random.below(2) == 0 { sound[from] } else { 1 + random.below(255) as u8 };
            }
            damaged.truncate(1 + random.below(sound.len() as u32) as usize);
            read("a.mtl", &damaged, &mut MtlNotes::default()).unwrap();
        }
        // Of a line of options alone, and one of dashes, in time
        for word in ["-s 1 ", " -", "-clamp on ", "# "] {
            let line = format!("newmtl a\nmap_Kd {}", word.repeat(1 << 18));
            read("a.mtl", line.as_bytes(), &mut MtlNotes::default()).unwrap();
            let behind = format!("newmtl a\nmap_Kd a {}", word.repeat(1 << 18));
            read("a.mtl", behind.as_bytes(), &mut MtlNotes::default()).unwrap();
        }
    }
}
