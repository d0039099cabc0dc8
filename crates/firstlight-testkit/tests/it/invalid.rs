//! Every case of `scenes/invalid`: the exact words of its diagnostics, one to a line.
//!
//! A case is a text (`.toml`, `.json`, `.txt`), or a folder (`.dir`) whose text is called `scene`, with `.expected`
//! beside it. All are compiled strictly. `FIRSTLIGHT_BLESS=1` writes the expectations, and the run still fails.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use firstlight::{CompileOptions, FolderAssets, NoAssets, SceneDesc};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/invalid")
}

/// The text of a case: itself, or the `scene` in a folder.
fn text_of(case: &Path) -> PathBuf {
    if !case.is_dir() {
        return case.to_path_buf();
    }
    let mut names = ["scene.toml", "scene.json", "scene"].iter().map(|name| case.join(name));
    names.find(|path| path.is_file()).unwrap_or_else(|| panic!("{} has no scene", case.display()))
}

/// What is said of a scene's file, strictly.
fn diagnostics(path: &Path) -> String {
    let assets = FolderAssets::new(path.parent().unwrap(), &[]).unwrap();
    let name = path.file_name().unwrap().to_str().unwrap();
    let parsed = SceneDesc::parse(name, &std::fs::read(path).unwrap(), &assets);
    match parsed.compile(&assets, &CompileOptions { strict: true, ..CompileOptions::default() }) {
        Ok(_) => String::new(),
        Err(error) => format!("{error}\n"),
    }
}

#[test]
fn every_invalid_scene_is_refused_in_these_words() {
    let mut cases: Vec<PathBuf> = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path()).collect();
    cases.retain(|path| path.extension().is_some_and(|e| e == "toml" || e == "json" || e == "txt" || e == "dir"));
    cases.sort();
    assert!(cases.len() >= 45, "{} cases", cases.len());
    let mut wrong = String::new();
    for case in cases {
        let expectation = case.with_extension("expected");
        let actual = diagnostics(&text_of(&case));
        let expected = std::fs::read_to_string(&expectation).unwrap_or_default();
        if actual.is_empty() || actual != expected {
            let name = case.file_name().unwrap().to_string_lossy();
            writeln!(wrong, "== {name}\n-- expected\n{expected}-- actual\n{actual}").unwrap();
            if std::env::var_os("FIRSTLIGHT_BLESS").is_some() && !actual.is_empty() {
                std::fs::write(&expectation, &actual).unwrap();
            }
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}FIRSTLIGHT_BLESS=1 writes what is said now");
}

/// The words for a text that is too hostile to be kept as a file, and that they come soon.
fn soon(name: &str, text: &[u8]) -> String {
    let start = Instant::now();
    let parsed = SceneDesc::parse(name, text, &NoAssets);
    let Err(error) = parsed.compile(&NoAssets, &CompileOptions::default()) else { panic!("{name} is refused") };
    // Tenths of a second, where nothing else runs
    assert!(start.elapsed() < Duration::from_secs(60), "{name} took {:?}", start.elapsed());
    error.to_string()
}

#[test]
fn a_hundred_megabytes_of_brackets_are_refused_at_once() {
    let text = vec![b'['; 100_000_000];
    for name in ["scene.toml", "scene.json", "scene.txt"] {
        let words = soon(name, &text);
        assert_eq!(words, format!("{name}:1:1: the text has 100000000 bytes, the limit is 67108864"));
    }
}

#[test]
fn brackets_within_the_size_limit_are_refused_at_once() {
    let text = vec![b'['; 60_000_000];
    for name in ["scene.toml", "scene.json"] {
        let words = soon(name, &text);
        assert!(words.starts_with(&format!("{name}:1:65: more than 64 tables or arrays within each other")), "{words}");
    }
}

#[test]
fn floods_are_refused_soon() {
    let millions = |part: &str| part.repeat(60_000_000 / part.len()).into_bytes();
    for (name, text) in [
        ("scene.toml", millions("a\n")),
        ("scene.toml", [b"a = [".to_vec(), millions("'',"), b"]".to_vec()].concat()),
        ("scene.toml", millions("a b ")),
        ("scene.toml", millions("\"a\"")),
        ("scene.json", [b"[".to_vec(), millions("\"\","), b"0]".to_vec()].concat()),
    ] {
        let words = soon(name, &text);
        let is_told = words.contains("more than 16777216 words, numbers and marks in one text");
        assert!(is_told || words.contains("lines are not understood"), "{words}");
    }
    // Long, but few tokens: as many faults as are told, their number, and that there is no camera
    let text: String = (0..200_000).map(|i| format!("key_{i} = 1\n")).collect();
    let words = soon("scene.toml", text.as_bytes());
    assert_eq!(words.lines().count(), 258);
    assert!(words.ends_with("199744 more faults are not listed"), "{words}");
}

#[test]
fn tables_by_the_million_are_refused_soon() {
    // A table takes many times the memory of its letters, and a parser's more than that
    let dotted = |lines: usize| -> String { (0..lines).map(|i| format!("a{i}{}.b = 1\n", ".a".repeat(59))).collect() };
    for (name, text, expected) in [
        ("scene.toml", dotted(60_000), "more than 2097152 tables in one text"),
        ("scene.toml", "[[sphere]]\n".repeat(3_000_000), "more than 2097152 tables in one text"),
        ("scene.toml", format!("a = [{}]", "{},".repeat(400_000)), "more than 262144 tables in one value"),
        ("scene.json", format!("[{}1]", "{},".repeat(3_000_000)), "more than 2097152 tables in one text"),
    ] {
        let words = soon(name, text.as_bytes());
        assert!(words.contains(expected), "{words}");
        assert_eq!(words.lines().count(), 1);
    }
    // Below the limit each is read, and one line said of each
    let words = soon("scene.toml", dotted(1000).as_bytes());
    assert!(words.ends_with("744 more faults are not listed"), "{words}");
}

#[test]
fn one_slip_by_the_million_takes_no_longer_than_once() {
    // Without newlines all of it is one line
    let words = soon("scene.toml", format!("a = 1\r{}", "x = 1\r".repeat(3_000_000)).as_bytes());
    let expected = "scene.toml:1:6: not TOML: a carriage return without a newline; save the text with lines that end \
                    in a newline (LF, or CR LF)";
    assert_eq!(words, expected);
    for slip in ["= ", "] ", "x ", "1.", "''"] {
        let words = soon("scene.toml", format!("a = 1 {}", slip.repeat(2_000_000)).as_bytes());
        assert!(words.starts_with("scene.toml:1:"), "{words}");
        assert_eq!(words.lines().count(), 1);
    }
    let words = soon("scene.toml", "x ==\n".repeat(2_000_000).as_bytes());
    assert!(words.contains("lines are not understood"), "{words}");
    // The Windows way, and inside of JSON, a carriage return is nothing special
    assert!(soon("scene.toml", b"a = 1\r\nb = [1,\r\n2]\r\n").contains("scene.toml:1:1: a: unknown key"));
    assert!(soon("scene.json", b"{\r\"a\": 1\r}").contains("scene.json:1:3: a: unknown key"));
}

#[test]
fn one_very_long_line_is_shown_in_part() {
    let text = format!("a = {}\nb = \"{}\"\n", "0".repeat(1_000_000), "x".repeat(30_000_000));
    let parsed = SceneDesc::parse("scene.toml", text.as_bytes(), &NoAssets);
    for fault in parsed.faults() {
        let place = fault.place.as_ref().unwrap();
        assert!(place.excerpt.chars().count() <= 160 && place.offset + place.width <= 160, "{place:?}");
    }
    assert!(!parsed.faults().is_empty());
}

#[test]
fn places_hold_line_column_and_excerpt() {
    let text = "[camera]\nposition = [0, 0, 10]\n[[sphere]]\nname = \"\u{e4}\u{f6}\"\nradius = \"\u{fc}\" # \u{e4}\n";
    let parsed = SceneDesc::parse("scene.toml", text.as_bytes(), &NoAssets);
    let [center, radius] = parsed.faults() else { panic!("{:?}", parsed.faults()) };
    let place = center.place.as_ref().unwrap();
    assert_eq!((place.line, place.column, place.offset, place.width), (3, 1, 0, 10));
    assert_eq!(place.excerpt, "[[sphere]]");
    let place = radius.place.as_ref().unwrap();
    assert_eq!((place.line, place.column, place.offset, place.width), (5, 10, 9, 3));
    assert_eq!(place.excerpt, "radius = \"\u{fc}\" # \u{e4}");
    // A mark of byte order and line ends of Windows change no column
    let windows = format!("\u{feff}{}", text.replace('\n', "\r\n"));
    let again = SceneDesc::parse("scene.toml", windows.as_bytes(), &NoAssets);
    assert_eq!(parsed.faults(), again.faults());
}

#[test]
fn a_hundred_thousand_groups_within_each_other_are_refused_soon() {
    let mut text = "[camera]\nposition = [0, 0, 5]\n".to_owned();
    for i in 0..100_000 {
        writeln!(text, "[[group.g{i}.instance]]\nof = \"g{}\"", i + 1).unwrap();
    }
    text.push_str("[[group.g100000.sphere]]\ncenter = [0, 0, 0]\nradius = 1\n");
    let words = soon("scene.toml", text.as_bytes());
    assert!(words.ends_with("groups are more than 32 deep; place some of them directly"), "{words}");
    assert_eq!(words.lines().count(), 1, "{words}");
}
