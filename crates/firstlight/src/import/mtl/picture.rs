//! Statements of MTL that name a picture, such as `map_Kd -s 2 2 1 my wood.png`.
//!
//! The name stands behind the options and may hold blanks; some programs write options behind it. So the reader takes
//! options off the beginning of the line, then off its end, and what is left is the name.

use std::collections::HashMap;

use super::{MtlMap, MtlNotes, StatementReader};
use crate::describe::Channel;
use crate::import::error::shown;
use crate::import::text::{Cursor, is_blank};

/// A picture, and how it lies.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MtlPicture {
    pub line: u64,
    /// Relative to the MTL file, `/` between folders.
    pub file: String,
    pub scale: [f64; 2],
    pub offset: [f64; 2],
    /// `-mm`: added after `gain`.
    pub base: f64,
    pub gain: f64,
    pub clamp: bool,
    /// `-blendu` and `-blendv`: whether texels are blended.
    pub blend: [bool; 2],
    pub channel: Option<Channel>,
    /// `-bm`.
    pub bump: f64,
    /// `-colorspace`: whether its numbers are sRGB.
    pub srgb: Option<bool>,
}

impl MtlPicture {
    fn new(line: u64) -> MtlPicture {
        let (scale, offset) = ([1.0; 2], [0.0; 2]);
        let file = String::new();
        let (base, gain, bump) = (0.0, 1.0, 1.0);
        MtlPicture {
            line,
            file,
            scale,
            offset,
            base,
            gain,
            clamp: false,
            blend: [true; 2],
            channel: None,
            bump,
            srgb: None,
        }
    }
}

impl StatementReader<'_> {
    /// Reads the rest of a statement, a picture with its options, for one map of the material.
    pub(super) fn map(&mut self, mut text: Cursor, map: MtlMap, written: &[u8]) {
        let mut picture = MtlPicture::new(self.line);
        // What stands before the name
        let mut rest = loop {
            text.skip_blanks();
            let before = text.at;
            match self.option(&mut text, &mut picture, true) {
                true => continue,
                false => break text.bytes[before..].trim_ascii_end(),
            }
        };
        rest = without_comment(rest);
        // What stands behind it: each option that reaches to the end
        while let Some(start) = self.last_option(rest) {
            let mut tail = Cursor { bytes: rest, at: start };
            self.option(&mut tail, &mut picture, false);
            rest = rest[..start].trim_ascii_end();
        }
        let name = self.text(rest);
        let Some(file) = self.file(&name, written) else { return };
        picture.file = file;
        self.material().maps.insert(map, picture);
    }

    /// Where the last option begins that stands behind a name, and ends where the text does.
    fn last_option(&self, rest: &[u8]) -> Option<usize> {
        let starts = (1..rest.len()).rev().filter(|&at| rest[at] == b'-' && is_blank(rest[at - 1]));
        // Numbers may begin so as well, three of them
        for at in starts.take(4) {
            let mut tail = Cursor { bytes: rest, at };
            let (mut notes, mut picture) = (MtlNotes::default(), MtlPicture::new(1));
            let mut dry = StatementReader {
                notes: &mut notes,
                line: 1,
                materials: Vec::new(),
                names: HashMap::new(),
                state: self.state,
            };
            if dry.option(&mut tail, &mut picture, false) {
                tail.skip_blanks();
                if tail.at_end() {
                    return Some(at);
                }
            }
        }
        None
    }

    /// Takes an option of a picture; `false`, and no step forward, where none stands. `name_follows`: the last word is
    /// no value of an option, but the name.
    fn option(&mut self, text: &mut Cursor, picture: &mut MtlPicture, name_follows: bool) -> bool {
        let start = text.at;
        let option = text.word().to_ascii_lowercase();
        let value = |text: &mut Cursor| {
            text.skip_blanks();
            let mut next = text.clone();
            let word = next.word();
            next.skip_blanks();
            let is_name = word.is_empty() || (name_follows && next.at_end());
            (!is_name).then(|| word.to_ascii_lowercase())
        };
        // Up to three finite numbers; of an offset, say, fewer are allowed
        let numbers = |text: &mut Cursor, most: usize| {
            let mut found: Vec<f64> = Vec::new();
            while found.len() < most && value(text).is_some() {
                let before = text.at;
                match text.f64() {
                    Some(number) => found.push(if number.is_finite() { number.clamp(-1e6, 1e6) } else { 0.0 }),
                    None => {
                        text.at = before;
                        break;
                    }
                }
            }
            found
        };
        let switch = |text: &mut Cursor| {
            let word = value(text);
            let on = match word.as_deref() {
                Some(b"on") => true,
                Some(b"off") => false,
                _ => return None,
            };
            text.word();
            Some(on)
        };
        let known = match option.as_slice() {
            b"-s" | b"-o" | b"-t" => {
                let found = numbers(text, 3);
                if found.is_empty() {
                    false
                } else {
                    let rest = if option == b"-s" { 1.0 } else { 0.0 };
                    let pair = [found[0], found.get(1).copied().unwrap_or(rest)];
                    match option.as_slice() {
                        b"-s" => picture.scale = pair,
                        b"-o" => picture.offset = pair,
                        _ if found.iter().any(|number| *number != 0.0) => {
                            self.unused_option("-t", "pictures have no turbulence");
                        }
                        _ => {}
                    }
                    true
                }
            }
            b"-mm" => match numbers(text, 2)[..] {
                [base, gain] => {
                    (picture.base, picture.gain) = (base, gain);
                    true
                }
                _ => false,
            },
            b"-bm" => match numbers(text, 1)[..] {
                [bump] => {
                    picture.bump = bump;
                    true
                }
                _ => false,
            },
            b"-boost" | b"-texres" => match numbers(text, 1)[..] {
                [value] => {
                    if option == b"-boost" && value != 0.0 {
                        self.unused_option("-boost", "pictures are filtered over the footprint of a pixel");
                    }
                    true
                }
                _ => false,
            },
            b"-clamp" => switch(text).map(|on| picture.clamp = on).is_some(),
            b"-blendu" => switch(text).map(|on| picture.blend[0] = on).is_some(),
            b"-blendv" => switch(text).map(|on| picture.blend[1] = on).is_some(),
            b"-cc" => {
                switch(text).map(|on| on.then(|| self.unused_option("-cc", "colours are not corrected"))).is_some()
            }
            b"-imfchan" => {
                let channel = match value(text).as_deref() {
                    Some(b"r") => Some(Channel::R),
                    Some(b"g") => Some(Channel::G),
                    Some(b"b") => Some(Channel::B),
                    Some(b"m") => Some(Channel::A),
                    Some(b"l") => Some(Channel::Luminance),
                    Some(b"z") => {
                        self.unused_option("-imfchan z", "pictures hold no depth; the luminance is taken");
                        Some(Channel::Luminance)
                    }
                    _ => None,
                };
                picture.channel = channel.or(picture.channel);
                channel.is_some_and(|_| !text.word().is_empty())
            }
            b"-type" => match value(text) {
                Some(_) => {
                    let kind = String::from_utf8_lossy(text.word()).into_owned();
                    self.unused_option(&format!("-type {kind}"), "a picture lies where uv says");
                    true
                }
                None => false,
            },
            b"-colorspace" => {
                picture.srgb = match value(text).as_deref() {
                    Some(b"srgb") => Some(true),
                    Some(b"linear" | b"raw" | b"non-color") => Some(false),
                    Some(_) => {
                        self.unused_option("-colorspace", "it is sRGB or linear");
                        None
                    }
                    None => picture.srgb,
                };
                value(text).is_some_and(|_| !text.word().is_empty())
            }
            _ => false,
        };
        if !known {
            text.at = start;
        }
        known
    }

    fn unused_option(&mut self, option: &str, why: &str) {
        let message = format!("the option {} of a picture is not used", shown(option.as_bytes()));
        let kind = option.split(' ').next().unwrap_or_default();
        self.notes.add(&format!("option {kind}"), self.line, message, why);
    }

    /// The path of a picture as it is written: relative to the MTL file, with `/` between folders.
    fn file(&mut self, written: &str, statement: &[u8]) -> Option<String> {
        let unquoted = written.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(written).trim();
        let mut path = unquoted.replace('\\', "/");
        let has_drive =
            path.as_bytes().first_chunk().is_some_and(|[letter, colon]| letter.is_ascii_alphabetic() && *colon == b':');
        if path.starts_with('/') || has_drive || path.contains("://") {
            let name = path.rsplit(['/', ':']).next().unwrap_or_default().to_owned();
            let message = format!(
                "{}: {} is an absolute path; {} is looked for beside the model",
                shown(statement),
                shown(unquoted.as_bytes()),
                shown(name.as_bytes())
            );
            let hint = "put the picture beside the MTL file, and name it without a folder";
            self.notes.add(&format!("absolute {unquoted}"), self.line, message, hint);
            path = name;
        }
        while path.contains("//") {
            path = path.replace("//", "/");
        }
        if path.is_empty() || path.ends_with('/') {
            let message = format!("{} names no picture, and is left out", shown(statement));
            let hint = "options come before the name: map_Kd -s 2 2 1 wood.png";
            self.notes.add("no picture", self.line, message, hint);
            return None;
        }
        Some(path)
    }
}

/// Without a comment: `#` is a letter of names, but for a word of its own behind a name with an ending.
fn without_comment(rest: &[u8]) -> &[u8] {
    let ends_as_a_file = |name: &[u8]| {
        let end = &name[name.len().saturating_sub(5)..];
        let ending = end.iter().rposition(|&byte| byte == b'.').map(|dot| &end[dot + 1..]).unwrap_or_default();
        ending.len() >= 2 && ending.iter().all(u8::is_ascii_alphanumeric)
    };
    for at in (1..rest.len()).filter(|&at| rest[at] == b'#' && is_blank(rest[at - 1])) {
        let name = rest[..at].trim_ascii_end();
        if ends_as_a_file(name) {
            return name;
        }
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::super::MtlNote;
    use super::super::tests::{read_with_notes, words};
    use super::*;

    fn picture_of(statement: &str) -> (MtlPicture, Vec<MtlNote>) {
        let (mut materials, notes) = read_with_notes(format!("newmtl a\n{statement}\n").as_bytes());
        assert_eq!(materials[0].maps.len(), 1, "{statement} {notes:?}");
        (materials.remove(0).maps.into_values().next().unwrap(), notes)
    }

    fn file_of(statement: &str) -> String {
        picture_of(statement).0.file
    }

    #[test]
    fn options_come_before_the_name_and_behind_it() {
        let (picture, notes) = picture_of("map_Kd -s 2 3 1 -clamp on -o 0.25 -mm 0.1 0.8 my bricks.png");
        assert_eq!((picture.file.as_str(), picture.scale, picture.offset), ("my bricks.png", [2.0, 3.0], [0.25, 0.0]));
        assert_eq!((picture.base, picture.gain, picture.clamp, notes.len()), (0.1, 0.8, true, 0));
        let (picture, _) = picture_of("map_bump -imfchan r bumps 2.jpg -bm -1.5 -S 4 -o -1 -2 -3");
        assert_eq!((picture.file.as_str(), picture.bump, picture.scale), ("bumps 2.jpg", -1.5, [4.0, 1.0]));
        assert_eq!(picture.offset, [-1.0, -2.0]);
        assert_eq!(picture.channel, Some(Channel::R));
        let (picture, _) = picture_of("bump -blendu off -blendv off -texres 256 -cc off -colorspace linear a.png");
        assert_eq!((picture.blend, picture.srgb), ([false; 2], Some(false)));
        // What looks like an option and is a name, or a part of it
        for name in ["-s.png", "a -s b.png", "wood - dark.png", "a -clamp.png", "-s", "-bm", "a -s 2 b.png", "1.5"] {
            assert_eq!(file_of(&format!("map_Kd {name}")), name);
        }
        // A number that is the last word is the name
        assert_eq!(
            picture_of("map_Kd -s 2 3 4").0,
            MtlPicture { scale: [2.0, 3.0], file: "4".into(), ..MtlPicture::new(2) }
        );
        let (_, notes) = picture_of("map_Kd -t 0.1 -boost 2 -type sphere -cc on -imfchan z a.png");
        assert_eq!(notes.len(), 5);
        assert_eq!(notes[0].message, "the option `-t` of a picture is not used");
    }

    #[test]
    fn names_of_pictures() {
        for (written, file) in [
            ("a b.png \t", "a b.png"),
            ("\"my wood.png\"", "my wood.png"),
            ("-clamp on \"my wood.png\"", "my wood.png"),
            ("textures\\wood\\a.png", "textures/wood/a.png"),
            ("textures\\\\a.png", "textures/a.png"),
            ("../maps//a.png", "../maps/a.png"),
            ("C:\\Users\\me\\my wood.png", "my wood.png"),
            ("\\\\server\\share\\a.png", "a.png"),
            ("/home/me/a.png", "a.png"),
            ("file:///home/me/a.png", "a.png"),
            ("wood#1.png", "wood#1.png"),
            ("Material #25.png # old", "Material #25.png"),
            ("wood # 2.png", "wood # 2.png"),
        ] {
            let (picture, notes) = picture_of(&format!("map_Kd {written}"));
            assert_eq!(picture.file, file);
            let is_absolute = written.contains("me") || written.contains("server");
            assert_eq!(notes.len(), usize::from(is_absolute), "{written}: {notes:?}");
        }
        let (_, notes) = picture_of("map_Kd C:\\maps\\a.png");
        let message = "`map_Kd`: `C:\\\\maps\\\\a.png` is an absolute path; `a.png` is looked for beside the model";
        assert_eq!(words(&notes), [(2, message)]);
        // None at all
        for statement in ["map_Kd", "map_Kd -s 2 2 1 \"\"", "map_Kd C:\\", "map_Kd textures/"] {
            let (materials, notes) = read_with_notes(format!("newmtl a\n{statement}").as_bytes());
            assert!(materials[0].maps.is_empty(), "{statement}");
            assert_eq!(notes.last().unwrap().message, "`map_Kd` names no picture, and is left out");
        }
    }
}
