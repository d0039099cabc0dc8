//! The names of output files: placeholders for the scene, the view and the size, and the numbers of frames.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use super::Target;
use crate::report::{Failure, shown};

/// What the placeholders in the names of outputs stand for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Names {
    /// The scene's file name without its ending: `{stem}`.
    pub stem: OsString,
    /// The whole of it: `{name}`.
    pub name: OsString,
    /// The name of the folder that holds it: `{parent}`.
    pub parent: OsString,
    /// The path of that folder, from the folder that was given on: `{folder}`.
    pub folder: OsString,
}

impl Names {
    /// What a placeholder stands for.
    fn of(&self, word: Word) -> &OsStr {
        match word {
            Word::Stem => &self.stem,
            Word::Name => &self.name,
            Word::Parent => &self.parent,
            Word::Folder => &self.folder,
        }
    }
}

/// A placeholder of the scene's names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Word {
    Stem,
    Name,
    Parent,
    Folder,
}

/// One of the pictures of a scene: what tells its files from those of the others.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Part {
    /// The number of the frame.
    pub frame: Option<u32>,
    /// From where it is seen: `{view}`.
    pub view: Option<ViewName>,
    /// How large it is: `{size}`.
    pub size: Option<String>,
}

/// What a view is called in the names of files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ViewName {
    /// By its word.
    Word(String),
    /// By its number on a turntable.
    Turn(u32),
}

/// The first placeholder of a text that the scene's names fill: where it stands, and which it is.
pub(super) fn placeholder(text: &str) -> Option<(std::ops::Range<usize>, Word)> {
    let found = |(word, which): &(&str, Word)| text.find(word).map(|at| (at..at + word.len(), *which));
    WORDS.iter().filter_map(found).min_by_key(|(range, _)| range.start)
}

const STEM: &str = "{stem}";
pub(super) const NAME: &str = "{name}";
pub(super) const PARENT: &str = "{parent}";
pub(super) const FOLDER: &str = "{folder}";
pub(super) const WORDS: [(&str, Word); 4] =
    [(STEM, Word::Stem), (NAME, Word::Name), (PARENT, Word::Parent), (FOLDER, Word::Folder)];
pub(super) const VIEW: &str = "{view}";
pub(super) const SIZE: &str = "{size}";

/// The path with the names of a scene in place of the placeholders. A path that is no text has none.
pub(super) fn filled(path: &Path, names: &Names) -> PathBuf {
    let Some(mut rest) = path.to_str() else { return path.to_path_buf() };
    let mut filled = OsString::new();
    while let Some((range, word)) = placeholder(rest) {
        filled.push(&rest[..range.start]);
        filled.push(names.of(word));
        rest = &rest[range.end..];
    }
    filled.push(rest);
    filled.into()
}

/// Whether a scene is rendered from several views and in several sizes: then the name of each output has to say which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Several {
    /// `--views` or `--turntable`.
    pub views: bool,
    /// `--size` with several.
    pub sizes: bool,
}

/// Sees that words in braces are placeholders, and that each of several scenes has its own output. `parts`: the
/// pictures of a scene, each with a file of its own; `None` for what is one file of them all.
///
/// # Errors
/// What to write instead.
pub fn check_placeholders(option: &str, target: &Target, several: bool, parts: Option<Several>) -> Result<(), Failure> {
    let name = target.name();
    let words = name.split('{').skip(1).filter_map(|part| part.split_once('}')).map(|(word, _)| word);
    let is_word = |word: &&str| !word.is_empty() && word.bytes().all(|b| b.is_ascii_lowercase());
    for word in words.filter(is_word) {
        let message = match (word, parts) {
            ("stem" | "name" | "parent" | "folder", _) => continue,
            ("view", Some(Several { views: true, .. })) | ("size", Some(Several { sizes: true, .. })) => continue,
            ("view", Some(_)) => {
                format!("{option} {name}: {VIEW} is one of --views or of --turntable, and neither is given")
            }
            ("size", Some(_)) => format!("{option} {name}: {SIZE} is one of several sizes, as --size 128,512"),
            ("view" | "size", None) => {
                format!("{option} {name}: {{{word}}} is for pictures; this is one file of them all")
            }
            _ => format!(
                "{option} {name}: {{{word}}} stands for nothing; {STEM} and {NAME} are those of the scene's file, \
                 {PARENT} that of its folder, {FOLDER} the path of it"
            ),
        };
        return Err(Failure::Usage(message));
    }
    if several && *target == Target::Stdout {
        return Err(Failure::Usage(format!(
            "{option} - takes one scene, and several are given; name files, as '{STEM}.png'"
        )));
    }
    if several && !target.has_placeholder() {
        let own = Path::new(&name);
        let ending = own.extension().map(|ending| format!(".{}", ending.to_string_lossy())).unwrap_or_default();
        let own = shown(&own.with_file_name(format!("{STEM}{ending}")));
        let message = format!(
            "{option} {name} would be one file for several scenes; write '{own}', where {STEM} is the name of each \
             scene without its ending ({NAME}: with it; {PARENT}: that of its folder; {FOLDER}: its path)"
        );
        return Err(Failure::Usage(message));
    }
    Ok(())
}

/// The path with what tells a picture of a scene from the others: in place of the placeholders, else before the ending,
/// numbers last.
pub(super) fn with_part(path: &Path, part: &Part) -> PathBuf {
    let mut path = path.to_path_buf();
    match &part.view {
        Some(ViewName::Word(word)) => path = with_word(&path, VIEW, word),
        Some(ViewName::Turn(number)) => {
            path = in_place(&path, VIEW, &format!("{number:04}")).unwrap_or_else(|| with_number(&path, *number));
        }
        None => {}
    }
    if let Some(size) = &part.size {
        path = with_word(&path, SIZE, size);
    }
    part.frame.map_or_else(|| path.clone(), |frame| with_number(&path, frame))
}

/// The path with `word` in place of a placeholder, else before its ending.
fn with_word(path: &Path, placeholder: &str, word: &str) -> PathBuf {
    in_place(path, placeholder, word).unwrap_or_else(|| before_ending(path, word))
}

/// The path with `word` in place of a placeholder, if it has it.
fn in_place(path: &Path, placeholder: &str, word: &str) -> Option<PathBuf> {
    let text = path.to_str().filter(|text| text.contains(placeholder))?;
    Some(text.replace(placeholder, word).into())
}

/// `a.word.png` of `a.png`.
fn before_ending(path: &Path, word: &str) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(format!(".{word}"));
    if let Some(ending) = path.extension() {
        name.push(".");
        name.push(ending);
    }
    path.with_file_name(name)
}

/// The path with the number of a frame or of a view in its name: in place of the last row of `#`, with at least as many
/// digits, else before the ending with at least four.
fn with_number(path: &Path, number: u32) -> PathBuf {
    let name = path.file_name().unwrap_or_default();
    let Some((before, marks, after)) = around_marks(name) else { return before_ending(path, &format!("{number:04}")) };
    let mut numbered = before;
    numbered.push(format!("{number:0marks$}"));
    numbered.push(after);
    path.with_file_name(numbered)
}

/// What stands before the last row of `#` in a name, how many they are, and what stands after them.
pub(super) fn around_marks(name: &OsStr) -> Option<(OsString, usize, OsString)> {
    let bytes = name.as_encoded_bytes();
    let end = bytes.iter().rposition(|b| *b == b'#')? + 1;
    let start = bytes[..end].iter().rposition(|b| *b != b'#').map_or(0, |last| last + 1);
    // A name need not be UTF-8
    #[cfg(unix)]
    let part = |bytes: &[u8]| Some(<OsStr as std::os::unix::ffi::OsStrExt>::from_bytes(bytes).to_owned());
    #[cfg(not(unix))]
    let part = |bytes: &[u8]| std::str::from_utf8(bytes).ok().map(OsString::from);
    Some((part(&bytes[..start])?, end - start, part(&bytes[end..])?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placeholders_are_the_names_of_the_scene() {
        let (stem, name) = ("a{name}".into(), "a.ply".into());
        let names = Names { stem, name, parent: "b{stem}".into(), folder: "c/b{stem}".into() };
        for (path, expected) in [
            ("{stem}.png", "a{name}.png"),
            ("{parent}-{name}.png", "b{stem}-a.ply.png"),
            ("{name}/{stem}{stem}.png", "a.ply/a{name}a{name}.png"),
            ("out/{folder}/{name}.png", "out/c/b{stem}/a.ply.png"),
            ("{}{Stem}{stem.png", "{}{Stem}{stem.png"),
        ] {
            assert_eq!(filled(Path::new(path), &names), Path::new(expected), "{path}");
        }
        let some = Several { views: true, sizes: false };
        let check =
            |path: &str, several, parts| check_placeholders("-o", &Target::of(Path::new(path)), several, parts).is_ok();
        for (path, several) in
            [("{stem}.png", true), ("a/{name}/x.png", true), ("{parent}.png", true), ("{A}{}.png", false)]
        {
            assert!(check(path, several, None) && check(path, several, Some(some)), "{path}");
        }
        for (path, several) in [("a.png", true), ("-", true), ("{frame}.png", false), ("{stem}_{x}.png", true)] {
            assert!(!check(path, several, None), "{path}");
        }
        assert!(check("{view}.png", false, Some(some)) && !check("{view}.png", false, None));
        assert!(!check("{size}.png", false, Some(some)) && !check("{view}.png", true, Some(some)));
    }

    #[test]
    fn a_frame_has_its_number_in_its_name() {
        for (path, frame, expected) in [
            ("a.png", 1, "a.0001.png"),
            ("b/a.tar.png", 12345, "b/a.tar.12345.png"),
            ("out", 7, "out.0007"),
            ("a_###.exr", 7, "a_007.exr"),
            ("a_#.exr", 123, "a_123.exr"),
            ("#a##b.png", 5, "#a05b.png"),
            ("x#/a.png", 0, "x#/a.0000.png"),
            ("a.##", 3, "a.03"),
        ] {
            assert_eq!(with_number(Path::new(path), frame), Path::new(expected), "{path}");
        }
    }

    #[test]
    fn views_and_sizes_are_in_the_names_of_files() {
        let word = |word: &str| Some(ViewName::Word(word.into()));
        let size = |size: &str| Some(size.to_owned());
        for (path, part, expected) in [
            ("a.png", Part { view: word("top"), ..Part::default() }, "a.top.png"),
            ("{view}/a.png", Part { view: word("top"), ..Part::default() }, "top/a.png"),
            ("a.png", Part { view: Some(ViewName::Turn(3)), ..Part::default() }, "a.0003.png"),
            ("a_##.png", Part { view: Some(ViewName::Turn(3)), ..Part::default() }, "a_03.png"),
            ("a{view}_#.png", Part { view: Some(ViewName::Turn(3)), ..Part::default() }, "a0003_#.png"),
            ("a.png", Part { frame: Some(7), view: word("top"), size: size("64") }, "a.top.64.0007.png"),
            ("{size}-{view}-#.png", Part { frame: Some(7), view: word("top"), size: size("8x9") }, "8x9-top-7.png"),
            ("a.png", Part::default(), "a.png"),
        ] {
            assert_eq!(with_part(Path::new(path), &part), Path::new(expected), "{path} {part:?}");
        }
    }

    #[test]
    #[cfg(unix)]
    fn a_name_need_not_be_utf8() {
        use std::os::unix::ffi::OsStrExt;
        let path = |bytes: &'static [u8]| Path::new(OsStr::from_bytes(bytes));
        assert_eq!(with_number(path(b"\xff_##\xfe.png"), 7), path(b"\xff_07\xfe.png"));
        assert_eq!(with_number(path(b"\xff.png"), 7), path(b"\xff.0007.png"));
    }
}
