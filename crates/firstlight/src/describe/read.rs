//! From the tree to values: by hand, so that every fault of a text is found at once, each with its place.
//!
//! A value that could not be read is replaced by a stand-in and its path is *poisoned*: what compiling would say about
//! the stand-in is noise and is dropped.

use std::collections::BTreeSet;
use std::fmt::Write;

use serde_json::{Value as Json, json};

use super::TableInfo;
use super::info::{Choice, FieldInfo, inner_name};
use super::node::{Data, Entry, Node, Span, quoted, shortened};
use super::synonyms;
use super::write::{TextValue, key};

/// What a field of the scene text can be.
pub(crate) trait Value: Sized + PartialEq {
    /// One of them, in words: "a number".
    fn words() -> String;
    /// Many of them, in words: "numbers".
    fn plural() -> String;
    /// Its JSON Schema.
    fn schema() -> Json;
    /// The words it chooses from, if it is one of a closed set.
    fn choices() -> &'static [Choice] {
        &[]
    }
    /// The tables it holds, if it is a table or an array of them: itself and those within.
    fn tables() -> Vec<TableInfo> {
        Vec::new()
    }
    /// What stands for a required one that could not be read.
    fn placeholder() -> Self;
    /// Reads one; `None` when it is none, and then the fault is recorded.
    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self>;
    /// For the writer.
    fn write(&self) -> TextValue;
}

/// A table of the scene text; made by the `table!` macro.
pub(crate) trait Table: Sized {
    /// The name of its type.
    const NAME: &'static str;
    /// The lines of its doc comment.
    const DOC: &'static [&'static str];
    /// The names of its fields.
    fn fields() -> Vec<&'static str>;
    /// From the fields of the text.
    fn read(fields: &mut Fields<'_, '_, '_>) -> Self;
    /// The fields that differ from their defaults.
    fn write(&self) -> Vec<(&'static str, TextValue)>;
    /// What its fields are.
    fn info() -> Vec<FieldInfo>;
}

/// A closed set of words; made by the `words!` macro.
pub(crate) trait Words: Sized + Copy + PartialEq + 'static {
    /// The words and what they mean; the first stands for one that could not be read.
    const CHOICES: &'static [Choice];
    /// The one of that name.
    fn of_word(word: &str) -> Option<Self>;
    /// Its name.
    fn word(&self) -> &'static str;
}

/// A fault and where it stands, as bytes of a text.
#[derive(Debug)]
pub(crate) struct Fault {
    pub file: usize,
    pub span: Span,
    pub path: String,
    pub message: String,
    pub hint: Option<String>,
    /// A second place that belongs to it: file and range.
    pub other: Option<(usize, Span)>,
}

/// The faults of all texts of a scene.
#[derive(Debug, Default)]
pub(crate) struct Faults {
    pub list: Vec<Fault>,
    /// How many more there are.
    pub omitted: usize,
    /// The paths of stand-ins.
    pub poisoned: BTreeSet<String>,
}

/// Most faults that are told: a hostile text could have millions.
pub(crate) const MAX_FAULTS: usize = 256;

impl Faults {
    pub(crate) fn push(&mut self, fault: Fault) {
        if self.list.len() < MAX_FAULTS { self.list.push(fault) } else { self.omitted += 1 }
    }
}

/// Reads the values of one text, and knows the path of the one at hand.
pub(crate) struct Reader<'a> {
    file: usize,
    text: &'a str,
    /// The text's folder, relative to the scene's, without a slash at the end; empty for the scene's own.
    folder: &'a str,
    path: String,
    faults: &'a mut Faults,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(file: usize, text: &'a str, folder: &'a str, faults: &'a mut Faults) -> Self {
        Self { file, text, folder, path: String::new(), faults }
    }

    pub(crate) fn text(&self) -> &'a str {
        self.text
    }

    pub(crate) fn folder(&self) -> &'a str {
        self.folder
    }

    /// Runs `f` with the key `name` added to the path.
    pub(crate) fn within<R>(&mut self, name: &str, f: impl FnOnce(&mut Self) -> R) -> R {
        let part = key(name);
        let dot = if self.path.is_empty() { "" } else { "." };
        self.deeper(&format!("{dot}{part}"), f)
    }

    /// Runs `f` with `[index]` added to the path.
    pub(crate) fn at<R>(&mut self, index: usize, f: impl FnOnce(&mut Self) -> R) -> R {
        let length = self.path.len();
        // Without making a string: lists have millions
        _ = write!(self.path, "[{index}]");
        let result = f(self);
        self.path.truncate(length);
        result
    }

    fn deeper<R>(&mut self, part: &str, f: impl FnOnce(&mut Self) -> R) -> R {
        let length = self.path.len();
        self.path.push_str(part);
        let result = f(self);
        self.path.truncate(length);
        result
    }

    /// Records a fault at the current path.
    pub(crate) fn error(&mut self, span: Span, message: impl Into<String>, hint: Option<String>) {
        self.conflict(span, message, hint, None);
    }

    /// Records a fault at the current path that has to do with a second place.
    pub(crate) fn conflict(
        &mut self,
        span: Span,
        message: impl Into<String>,
        hint: Option<String>,
        other: Option<(usize, Span)>,
    ) {
        let (file, path) = (self.file, self.path.clone());
        self.faults.push(Fault { file, span, path, message: message.into(), hint, other });
    }

    /// Marks the value at the current path as a stand-in.
    pub(crate) fn poison(&mut self) {
        self.faults.poisoned.insert(self.path.clone());
    }

    /// The value as the text has it, on one line and not too long.
    pub(crate) fn show(&self, node: &Node) -> String {
        let text = self.text.get(node.span.start..node.span.end).unwrap_or_default();
        let one_line = text.split_whitespace().collect::<Vec<_>>().join(" ");
        shortened(&one_line).chars().filter(|c| !c.is_control()).collect()
    }

    /// Records that `node` is not what it should be.
    pub(crate) fn wrong_type(&mut self, node: &Node, expected: &str, hint: Option<String>) {
        let message = match node.data {
            Data::Other("null") => format!("null is not {expected}"),
            Data::Array(_) | Data::Numbers(_) | Data::Table(_) => format!("{} is not {expected}", node.kind()),
            _ => format!("{} is {}, not {expected}", self.show(node), node.kind()),
        };
        let hint = if matches!(node.data, Data::Other("null")) {
            Some("leave the key out for its default".into())
        } else {
            hint
        };
        self.error(node.span, message, hint);
    }

    /// Reads a table; a stand-in when `node` is none.
    pub(crate) fn table<T: Table>(&mut self, node: &Node, what: &str) -> T {
        let Some(entries) = node.entries() else {
            self.wrong_type(node, "a table", None);
            self.poison();
            return T::read(&mut Fields {
                entries: &[],
                span: node.span,
                silent: true,
                meant: Vec::new(),
                reader: self,
            });
        };
        let meant = self.unknown_keys(entries, &T::fields(), what);
        T::read(&mut Fields { entries, span: node.span, silent: false, meant, reader: self })
    }

    /// Reads a table that is the value of a field; `None` when `node` is none.
    pub(crate) fn inner_table<T: Table>(&mut self, node: &Node) -> Option<T> {
        if node.entries().is_none() {
            self.wrong_type(node, "a table", None);
            return None;
        }
        let name = inner_name::<T>().replace('_', " ");
        let article = if name.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
        Some(self.table(node, &format!("{article} {name}")))
    }

    /// Records every key that is not in `known`; answers with the known ones that were probably meant.
    pub(crate) fn unknown_keys(&mut self, entries: &[Entry], known: &[&'static str], what: &str) -> Vec<&'static str> {
        let mut meant = Vec::new();
        for entry in entries {
            if !known.contains(&&*entry.key) {
                let near = synonyms::meant(&entry.key, known);
                meant.extend(near.map(|near| near.word));
                let question = near.map(|near| near.question()).unwrap_or_default();
                let hint = format!("{question}{what} takes {}", known.join(", "));
                self.within(&shortened(&entry.key), |r| r.error(entry.key_span, "unknown key", Some(hint)));
            }
        }
        meant
    }
}

/// A table of which nothing could be read.
pub(crate) fn stand_in<T: Table>() -> T {
    let faults = &mut Faults::default();
    let reader = &mut Reader::new(0, "", "", faults);
    T::read(&mut Fields { entries: &[], span: Span::default(), silent: true, meant: Vec::new(), reader })
}

/// The fields of one table of the text.
pub(crate) struct Fields<'n, 'r, 'a> {
    entries: &'n [Entry],
    span: Span,
    /// Reads a stand-in: nothing is there, and nothing is missed.
    silent: bool,
    /// Known keys that unknown ones were probably meant to be: not missed a second time.
    meant: Vec<&'static str>,
    reader: &'r mut Reader<'a>,
}

impl Fields<'_, '_, '_> {
    /// The field `name`, which must be there.
    pub(crate) fn required<T: Value>(&mut self, name: &'static str) -> T {
        if let Some(value) = self.find(name) {
            return value;
        }
        if !self.silent && !self.entries.iter().any(|e| &*e.key == name) {
            if !self.meant.contains(&name) {
                let hint = format!("write `{name} = ...`, {}", T::words());
                self.reader.error(self.span, format!("\"{name}\" is missing"), Some(hint));
            }
            self.reader.within(name, |r| r.poison());
        }
        T::placeholder()
    }

    /// The field `name`, or its default.
    pub(crate) fn optional<T: Value>(&mut self, name: &'static str, default: impl FnOnce() -> T) -> T {
        self.find(name).unwrap_or_else(default)
    }

    fn find<T: Value>(&mut self, name: &'static str) -> Option<T> {
        let entry = self.entries.iter().find(|e| &*e.key == name)?;
        self.reader.within(name, |r| {
            let value = T::read(&entry.value, r);
            if value.is_none() {
                r.poison();
            }
            value
        })
    }
}

/// The known name nearest to `name`, if one is near enough to have been meant.
pub fn nearest_name<'k>(name: &str, known: &[&'k str]) -> Option<&'k str> {
    nearest(name, known)
}

/// The known word nearest to `word`, if one is near enough to have been meant.
pub(crate) fn nearest<'k>(word: &str, known: &[&'k str]) -> Option<&'k str> {
    // Nobody misspells so long a word, and the comparison takes time by the product of the lengths
    if word.len() > 64 {
        return None;
    }
    let lower = word.to_lowercase();
    let (distance, near) = known
        .iter()
        .map(|k| (strsim::damerau_levenshtein(&lower, &k.to_lowercase()), *k))
        .min_by_key(|(distance, _)| *distance)?;
    let allowed = near.len().max(word.len()) / 3;
    (distance <= allowed.max(1)).then_some(near)
}

impl Value for f64 {
    fn words() -> String {
        "a number".into()
    }

    fn plural() -> String {
        "numbers".into()
    }

    fn schema() -> Json {
        json!({ "type": "number" })
    }

    fn placeholder() -> Self {
        1.0
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        let Data::Number(value) = node.data else {
            reader.wrong_type(node, &Self::words(), None);
            return None;
        };
        // `inf` in the text is left to compiling, which refuses it with all that is not finite
        if value.is_infinite() && !reader.show(node).contains("inf") {
            let shown = reader.show(node);
            reader.error(
                node.span,
                format!("{shown} is too large for a number"),
                Some(format!("at most {:e}", f64::MAX)),
            );
            return None;
        }
        Some(value)
    }

    fn write(&self) -> TextValue {
        TextValue::Number(*self)
    }
}

impl Value for u32 {
    fn words() -> String {
        "a whole number".into()
    }

    fn plural() -> String {
        "whole numbers".into()
    }

    fn schema() -> Json {
        json!({ "type": "integer", "minimum": 0, "maximum": u32::MAX })
    }

    fn placeholder() -> Self {
        1
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        let Data::Number(value) = node.data else {
            reader.wrong_type(node, &Self::words(), None);
            return None;
        };
        let (fault, hint) = if value.is_nan() || value.is_finite() && value.fract() != 0.0 {
            ("is not a whole number", None)
        } else if value < 0.0 {
            ("is less than 0", None)
        } else if value > f64::from(u32::MAX) {
            ("is too large", Some(format!("at most {}", u32::MAX)))
        } else {
            return Some(value as u32);
        };
        reader.error(node.span, format!("{} {fault}", reader.show(node)), hint);
        None
    }

    fn write(&self) -> TextValue {
        TextValue::Number(f64::from(*self))
    }
}

impl Value for bool {
    fn words() -> String {
        "true or false".into()
    }

    fn plural() -> String {
        "truth values".into()
    }

    fn schema() -> Json {
        json!({ "type": "boolean" })
    }

    fn placeholder() -> Self {
        false
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        let Data::Bool(value) = node.data else {
            let hint = match &node.data {
                Data::String(s) if s == "true" || s == "false" => Some("leave the quotes out".into()),
                _ => None,
            };
            reader.wrong_type(node, &Self::words(), hint);
            return None;
        };
        Some(value)
    }

    fn write(&self) -> TextValue {
        TextValue::Bool(*self)
    }
}

impl Value for String {
    fn words() -> String {
        "a string".into()
    }

    fn plural() -> String {
        "strings".into()
    }

    fn schema() -> Json {
        json!({ "type": "string" })
    }

    fn placeholder() -> Self {
        String::new()
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        let Data::String(value) = &node.data else {
            reader.wrong_type(node, &Self::words(), None);
            return None;
        };
        Some(value.clone())
    }

    fn write(&self) -> TextValue {
        TextValue::Text(self.clone())
    }
}

impl<T: Value> Value for Option<T> {
    fn words() -> String {
        T::words()
    }

    fn plural() -> String {
        T::plural()
    }

    fn schema() -> Json {
        T::schema()
    }

    fn choices() -> &'static [Choice] {
        T::choices()
    }

    fn tables() -> Vec<TableInfo> {
        T::tables()
    }

    fn placeholder() -> Self {
        None
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        T::read(node, reader).map(Some)
    }

    fn write(&self) -> TextValue {
        self.as_ref().map_or(TextValue::Absent, T::write)
    }
}

impl<T: Value, const N: usize> Value for [T; N] {
    fn words() -> String {
        format!("an array of {N} {}", T::plural())
    }

    fn plural() -> String {
        format!("arrays of {N} {}", T::plural())
    }

    fn schema() -> Json {
        json!({ "type": "array", "items": T::schema(), "minItems": N, "maxItems": N })
    }

    fn choices() -> &'static [Choice] {
        T::choices()
    }

    fn tables() -> Vec<TableInfo> {
        T::tables()
    }

    fn placeholder() -> Self {
        std::array::from_fn(|_| T::placeholder())
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        if node.len() != Some(N) {
            reader.wrong_type(node, &Self::words(), None);
            return None;
        }
        let mut values = [const { None }; N];
        node.each(reader.text, |i, element| {
            if let Some(value) = values.get_mut(i) {
                *value = reader.at(i, |r| T::read(element, r));
            }
        });
        values.iter().all(Option::is_some).then(|| values.map(|value| value.unwrap_or_else(T::placeholder)))
    }

    fn write(&self) -> TextValue {
        TextValue::List(self.iter().map(T::write).collect())
    }
}

impl<T: Value> Value for Vec<T> {
    fn words() -> String {
        format!("an array of {}", T::plural())
    }

    fn plural() -> String {
        format!("arrays of {}", T::plural())
    }

    fn schema() -> Json {
        json!({ "type": "array", "items": T::schema() })
    }

    fn choices() -> &'static [Choice] {
        T::choices()
    }

    fn tables() -> Vec<TableInfo> {
        T::tables()
    }

    fn placeholder() -> Self {
        Vec::new()
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        let Some(length) = node.len() else {
            reader.wrong_type(node, &Self::words(), None);
            return None;
        };
        // Every element is read before giving up: every fault is told
        let mut values = Vec::with_capacity(length);
        node.each(reader.text, |i, element| values.extend(reader.at(i, |r| T::read(element, r))));
        (values.len() == length).then_some(values)
    }

    fn write(&self) -> TextValue {
        TextValue::list(self.iter().map(T::write))
    }
}

impl<T: Words> Value for T {
    fn words() -> String {
        let words: Vec<String> = T::CHOICES.iter().map(|c| format!("\"{}\"", c.word)).collect();
        match words.split_last() {
            Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
            _ => words.concat(),
        }
    }

    fn plural() -> String {
        format!("words ({})", Self::words())
    }

    fn schema() -> Json {
        json!({ "enum": T::CHOICES.iter().map(|c| c.word).collect::<Vec<_>>() })
    }

    fn choices() -> &'static [Choice] {
        T::CHOICES
    }

    fn placeholder() -> Self {
        T::of_word(T::CHOICES[0].word).expect("every choice has its word")
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        let Data::String(word) = &node.data else {
            reader.wrong_type(node, &Self::words(), None);
            return None;
        };
        let value = T::of_word(word);
        if value.is_none() {
            let known: Vec<&str> = T::CHOICES.iter().map(|c| c.word).collect();
            let hint = nearest(word, &known).map(|near| format!("did you mean \"{near}\"?"));
            reader.error(node.span, format!("{} is not {}", quoted(word), Self::words()), hint);
        }
        value
    }

    fn write(&self) -> TextValue {
        TextValue::Text(self.word().to_owned())
    }
}
