//! How the source is kept: in which order its modules stand, what its types are called, and how long its lines are.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// The Rust files in a folder and its folders, each with its text.
fn sources(folder: &Path, found: &mut Vec<(PathBuf, String)>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            found.push((path, text));
        }
    }
}

/// The modules of the library, in the order that ARCHITECTURE.md gives them.
fn order() -> Vec<String> {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let line = text.lines().find(|line| line.starts_with("`error, ")).expect("ARCHITECTURE.md has the list");
    let words = line.split(|c: char| !c.is_ascii_lowercase()).filter(|word| !word.is_empty());
    words.map(str::to_owned).collect()
}

/// The names that follow `crate::` in a text, one by one or in braces.
fn names(text: &str) -> Vec<&str> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut found = Vec::new();
    for (at, prefix) in text.match_indices("crate::") {
        if text[..at].ends_with(|c: char| is_word(c) || c == '$') {
            continue;
        }
        let rest = &text[at + prefix.len()..];
        let Some(list) = rest.strip_prefix('{') else {
            found.extend(rest.split(|c: char| !is_word(c)).next());
            continue;
        };
        // The first word of each part, whatever stands in braces within it
        let mut depth = 0;
        let mut part = 0;
        for (i, c) in list.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth > 0 => depth -= 1,
                ',' | '}' if depth == 0 => {
                    found.extend(list[part..i].trim().split(|c: char| !is_word(c)).next().filter(|w| !w.is_empty()));
                    part = i + 1;
                    if c == '}' {
                        break;
                    }
                }
                _ => {}
            }
        }
    }
    found
}

#[test]
fn names_after_the_crate_are_found() {
    let text = "use crate::a::B; use crate::{c::{D, E}, F}; $crate::g; my_crate::h";
    assert_eq!(names(text), ["a", "c", "F"]);
}

#[test]
fn modules_use_those_before_them_only() {
    let (order, folder) = (order(), root().join("crates/firstlight/src"));
    let rank = |module: &str| order.iter().position(|m| m == module);
    // What stands at the root of the crate is of the module that lib.rs takes it from
    let lib = std::fs::read_to_string(folder.join("lib.rs")).unwrap();
    let mut home = HashMap::new();
    for statement in lib.split("pub use ").skip(1).filter_map(|rest| rest.split_once(';')) {
        let (module, list) = statement.0.split_once("::").expect("lib.rs takes names from modules");
        let words = list.split(|c: char| !(c.is_alphanumeric() || c == '_')).filter(|word| !word.is_empty());
        home.extend(words.map(|word| (word.to_owned(), module.to_owned())));
    }
    let mut all = Vec::new();
    sources(&folder, &mut all);
    let (mut wrong, mut count) = (Vec::new(), 0);
    for (path, text) in &all {
        let inside = path.strip_prefix(&folder).unwrap();
        let top = inside.iter().next().unwrap().to_string_lossy().trim_end_matches(".rs").to_owned();
        // The root, and what looks into everything for the project itself
        if ["lib", "bench"].contains(&top.as_str()) {
            continue;
        }
        let Some(own) = rank(&top) else { panic!("{}: ARCHITECTURE.md does not list `{top}`", inside.display()) };
        let code: String =
            text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
        for name in names(&code) {
            let module = home.get(name).map_or(name, String::as_str);
            count += 1;
            if rank(module).is_some_and(|used| used > own) {
                wrong.push(format!("{}: `{top}` uses `{module}`, which stands after it", inside.display()));
            }
        }
    }
    assert!(count >= 500, "only {count} uses");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// Columns that a line may have.
const COLUMNS: usize = 120;

/// A line of a comment: what stands before its words, how far these are indented, and they.
fn comment(line: &str) -> Option<(&str, usize, &str)> {
    let code = line.trim_start();
    let mark = ["///", "//!", "//"].into_iter().find(|mark| code.starts_with(mark))?;
    let (before, words) = line.split_at(line.len() - code.len() + mark.len());
    let words = words.strip_prefix(' ').unwrap_or(words);
    Some((before, words.len() - words.trim_start().len(), words.trim_start()))
}

/// Whether words are a row of a table, which ends as it begins.
fn is_row(words: &str) -> bool {
    words.starts_with('|') && words.ends_with('|')
}

/// Whether words begin something of their own: an item of a list, a heading, a row of a table, a block of code.
fn begins(words: &str) -> bool {
    let number = words.trim_start_matches(|c: char| c.is_ascii_digit());
    ["- ", "* ", "#", "```"].iter().any(|mark| words.starts_with(mark))
        || is_row(words)
        || (number.len() < words.len() && number.starts_with(". "))
}

/// The text with the words of comments that do not fit moved to the next line of their paragraph.
fn wrapped(text: &str) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let (mut fence, mut i) = (false, 0);
    while i < lines.len() {
        let line = lines[i].clone();
        if let Some((before, indent, words)) = comment(&line) {
            fence ^= words.starts_with("```");
            let fits = line.chars().count() <= COLUMNS || fence || is_row(words);
            let end = line.char_indices().nth(COLUMNS).map_or(line.len(), |(at, _)| at + 1);
            let first = before.len() + 1 + indent;
            let cut = line[..end.min(line.len())].rfind(' ').filter(|cut| *cut > first + 2 && !fits);
            if let Some(cut) = cut {
                let hang = indent + if words.starts_with("- ") || words.starts_with("* ") { 2 } else { 0 };
                let start = format!("{before} {}{}", " ".repeat(hang), line[cut..].trim_start());
                let next = lines.get(i + 1).and_then(|next| comment(next));
                let same =
                    next.filter(|next| next.0 == before && next.1 == hang && !next.2.is_empty() && !begins(next.2));
                match same.map(|next| format!("{start} {}", next.2)) {
                    Some(joined) => lines[i + 1] = joined,
                    None => lines.insert(i + 1, start),
                }
                lines[i].truncate(cut);
            }
        }
        i += 1;
    }
    lines.join("\n") + "\n"
}

#[test]
fn words_go_to_the_next_line_of_their_paragraph() {
    let long = "word ".repeat(23);
    let text = format!("    /// {long}one two\n    /// three\n    /// - {long}four\n    fn f() {{}}\n");
    let fits = "word ".repeat(22);
    let fits = fits.trim_end();
    let right =
        format!("    /// {fits}\n    /// word one two three\n    /// - {fits}\n    ///   word four\n    fn f() {{}}\n");
    assert_eq!(wrapped(&text), right);
    assert_eq!(wrapped(&right), right);
}

#[test]
fn lines_have_up_to_120_columns() {
    let mut all = Vec::new();
    for folder in ["crates", "tools", "xtask", "fuzz"] {
        sources(&root().join(folder), &mut all);
    }
    assert!(all.len() > 200, "only {} files", all.len());
    let mut wrong = Vec::new();
    for (path, text) in &all {
        let before = wrong.len();
        let wide = text.lines().zip(1..).filter(|(line, _)| line.chars().count() > COLUMNS);
        wrong.extend(wide.map(|(_, number)| format!("{}:{number}", path.display())));
        if wrong.len() > before && std::env::var_os("FIRSTLIGHT_BLESS").is_some() {
            std::fs::write(path, wrapped(text)).unwrap();
        }
    }
    assert!(
        wrong.is_empty(),
        "\n{}\nFIRSTLIGHT_BLESS=1 wraps comments, rustfmt code; strings go on after a `\\`",
        wrong.join("\n")
    );
}

/// The types that a file defines, but for those of its tests and those that traits have.
fn types(text: &str) -> impl Iterator<Item = &str> {
    let tests = text.find("\n#[cfg(test)]\nmod ").unwrap_or(text.len());
    text[..tests].lines().filter_map(|line| {
        let words = line.trim_start();
        let words = match words.strip_prefix("pub") {
            Some(rest) if rest.starts_with('(') => rest.split_once(')')?.1,
            Some(rest) => rest,
            None => words,
        };
        let (kind, rest) = words.trim_start().split_once(' ')?;
        let defines = match kind {
            "struct" | "enum" | "trait" | "union" => true,
            "type" => !line.starts_with(' '),
            _ => false,
        };
        let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next()?;
        (defines && name.starts_with(|c: char| c.is_ascii_uppercase())).then_some(name)
    })
}

#[test]
fn types_are_found() {
    let text = "struct A(u8);\n    pub(in crate::x) enum B<T> {\n    type Output = A;\npub type C = A;\n\
                pub struct Dd {\npub struct $name {\n// struct E is not\n#[cfg(test)]\nmod tests {\n    struct F;\n";
    assert_eq!(types(text).collect::<Vec<_>>(), ["A", "B", "C", "Dd"]);
}

/// A reader who has met a type by its name need not ask which of that name is meant.
#[test]
fn a_type_name_has_one_meaning() {
    let mut all = Vec::new();
    sources(&root().join("crates/firstlight/src"), &mut all);
    let mut found: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for (path, text) in all.iter().filter(|(path, _)| !path.ends_with("tests.rs")) {
        for name in types(text) {
            found.entry(name).or_default().push(path.display().to_string());
        }
    }
    assert!(found.len() > 500, "only {} types", found.len());
    found.retain(|_, paths| paths.len() > 1);
    let wrong: Vec<String> = found.iter().map(|(name, paths)| format!("{name}: {}", paths.join(", "))).collect();
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// The code of a file without its tests, line by line, comments left out.
fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let tests = text.find("\n#[cfg(test)]\nmod ").unwrap_or(text.len());
    let lines = text[..tests].lines().enumerate().map(|(number, line)| (number + 1, line));
    lines.map(|(number, line)| (number, line.split("//").next().unwrap_or(line)))
}

/// The numbers with a point or an exponent in a line of code, but for those with more digits than anybody chooses.
fn floats(line: &str) -> impl Iterator<Item = f64> {
    let words = line.split(|c: char| !(c.is_alphanumeric() || "._-".contains(c)));
    let words = words.map(|word| word.trim_start_matches('-').replace('_', "").replace("f32", "").replace("f64", ""));
    let words = words.filter(|word| word.starts_with(|c: char| c.is_ascii_digit()));
    words
        .filter(|word| word.len() < 12 && (word.contains('.') || word.contains('e')))
        .filter_map(|word| word.parse().ok())
}

/// Whether a number is so small or large that it only guards against rounding.
fn is_guard(number: f64) -> bool {
    number <= 1e-3 || number >= 1e3
}

/// Whether a number may be part of a formula.
fn is_plain(number: f64) -> bool {
    number <= 16.0 && (number * 16.0).fract() == 0.0 || is_guard(number)
}

#[test]
fn floats_are_found() {
    let found = floats("if a.0 < 0.35 * x.sqrt() - 1e-3 && b[7] > -1.5_f32 || 0x1e > 3 { 1_000.25f32 }");
    assert_eq!(found.collect::<Vec<_>>(), [0.35, 1e-3, 1.5, 1000.25]);
    assert_eq!(floats("0.478_628_670_499_366_47").count(), 0);
    assert!([0.0, 0.5, 0.0625, 12.0, 1e-6, 1e30].into_iter().all(is_plain));
    assert!([0.35, 0.1, 0.003, 17.0, 255.0].into_iter().all(|number| !is_plain(number)));
}

/// What decides an error stands in one place, and there are few such numbers.
#[test]
fn the_tolerance_holds_all_numbers_that_decide_an_error() {
    let folder = root().join("crates/firstlight/src");
    let tolerance = std::fs::read_to_string(folder.join("integrate/tolerance.rs")).unwrap();
    let fields = tolerance.split("pub(crate) struct Tolerance {").nth(1).unwrap().split("\n}").next().unwrap();
    let fields: Vec<&str> = fields.lines().filter_map(|line| line.trim().strip_prefix("pub ")).collect();
    assert!((20..=35).contains(&fields.len()), "{} numbers decide errors", fields.len());
    assert!(fields.iter().all(|field| field.ends_with(": f32,")), "{fields:?}");
    let mut all = Vec::new();
    sources(&folder.join("render"), &mut all);
    for file in ["integrator", "subdivide", "cell"] {
        let path = folder.join("integrate").join(file).with_extension("rs");
        let text = std::fs::read_to_string(&path).unwrap();
        all.push((path, text));
    }
    let (mut wrong, mut count) = (Vec::new(), 0);
    // What is told of colours of pictures, not of errors
    for (path, text) in all.iter().filter(|(path, _)| !path.ends_with("heat.rs")) {
        for (number, line) in code(text) {
            let mut floats = floats(line).peekable();
            count += usize::from(floats.peek().is_some());
            let is_named = line.trim_start().trim_start_matches("pub(super) ").starts_with("const ");
            if floats.any(|float| !is_plain(float) || is_named && !is_guard(float)) {
                wrong.push(format!("{}:{number}: {line}", path.display()));
            }
        }
    }
    assert!(count >= 200, "only {count} lines with numbers");
    assert!(wrong.is_empty(), "to be told by `Tolerance` or `Costs`:\n{}", wrong.join("\n"));
}
