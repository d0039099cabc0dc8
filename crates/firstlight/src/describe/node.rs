//! TOML and JSON as one tree that knows where everything stands.
//!
//! [`scan`](super::scan) goes before the parsers, which were written for friendly input.

use std::borrow::Cow;
use std::sync::Arc;

use jsonc_parser::ast;

use super::scan::{Numbers, Scan, TextPiece};

/// A range of bytes of a text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Span {
    pub start: usize,
    pub end: usize,
}

impl From<std::ops::Range<usize>> for Span {
    fn from(range: std::ops::Range<usize>) -> Self {
        Span { start: range.start, end: range.end }
    }
}

/// A value and where it stands; a table stands where its header or key is.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub span: Span,
    pub data: Data,
}

/// What a value is.
#[derive(Clone, Debug)]
pub(crate) enum Data {
    String(String),
    /// Any number; infinite also where the text's digits exceed every finite number.
    Number(f64),
    Bool(bool),
    /// What scene text has no use for, in words: "a date", "null".
    Other(&'static str),
    Array(Vec<Node>),
    /// A long list of numbers, or of lists of numbers, that stays in the text.
    Numbers(Numbers),
    /// In the order of the text, without duplicate keys.
    Table(Vec<Entry>),
}

/// A key of a table, and its value.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub key: Arc<str>,
    pub key_span: Span,
    pub value: Node,
}

impl Node {
    /// An empty table at the beginning of a text.
    pub(crate) fn empty() -> Self {
        Node { span: Span::default(), data: Data::Table(Vec::new()) }
    }

    /// The entries, if this is a table.
    pub(crate) fn entries(&self) -> Option<&[Entry]> {
        if let Data::Table(entries) = &self.data { Some(entries) } else { None }
    }

    /// How many elements it has, if this is an array.
    pub(crate) fn len(&self) -> Option<usize> {
        match &self.data {
            Data::Array(elements) => Some(elements.len()),
            Data::Numbers(numbers) => Some(numbers.count as usize),
            _ => None,
        }
    }

    /// Shows each element of an array of `text` to `f`.
    pub(crate) fn each(&self, text: &str, mut f: impl FnMut(usize, &Node)) {
        match &self.data {
            Data::Array(elements) => elements.iter().enumerate().for_each(|(i, element)| f(i, element)),
            Data::Numbers(numbers) => {
                for (i, (span, number)) in numbers.elements(text, self.span).enumerate() {
                    f(i, &Node { span, data: numbers.data(number) });
                }
            }
            _ => {}
        }
    }

    /// An element of an array of `text`.
    pub(crate) fn element(&self, text: &str, index: usize) -> Option<Cow<'_, Node>> {
        match &self.data {
            Data::Array(elements) => elements.get(index).map(Cow::Borrowed),
            Data::Numbers(numbers) => {
                let (span, number) = numbers.elements(text, self.span).nth(index)?;
                Some(Cow::Owned(Node { span, data: numbers.data(number) }))
            }
            _ => None,
        }
    }

    /// The value at `key`, if this is a table and has it.
    pub(crate) fn get(&self, key: &str) -> Option<&Node> {
        self.entries()?.iter().find(|e| &*e.key == key).map(|e| &e.value)
    }

    /// What it is, in words.
    pub(crate) fn kind(&self) -> String {
        match &self.data {
            Data::String(_) => "a string".into(),
            Data::Number(_) => "a number".into(),
            Data::Bool(_) => "a truth value".into(),
            Data::Other(words) => (*words).into(),
            Data::Array(_) | Data::Numbers(_) => match self.len().unwrap_or_default() {
                1 => "an array of 1 value".into(),
                many => format!("an array of {many} values"),
            },
            Data::Table(_) => "a table".into(),
        }
    }
}

/// A fault of the syntax: where, what, and what to do.
#[derive(Debug)]
pub(crate) struct SyntaxFault {
    pub span: Span,
    /// Of what, where that is known.
    pub path: String,
    pub message: String,
    pub hint: Option<String>,
}

impl SyntaxFault {
    pub(super) fn new(span: Span, message: String, hint: Option<&str>) -> Self {
        Self { span, path: String::new(), message, hint: hint.map(str::to_owned) }
    }
}

/// A text that was read.
#[derive(Debug)]
pub(crate) struct ReadText {
    /// `None` where the syntax does not allow one.
    pub root: Option<Node>,
    /// All faults of the syntax; for JSON the first.
    pub faults: Vec<SyntaxFault>,
}

/// Whether the tables of that path are an array of tables, by their names from the outermost on.
pub(crate) type IsArray<'a> = &'a dyn Fn(&[Arc<str>]) -> bool;

/// The two languages of scene text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Syntax {
    Toml,
    Json,
}

/// Reads a text into a tree. In TOML a table of `is_array` that is written with single brackets is a fault, and read
/// as one more of them.
pub(crate) fn parse(text: &str, syntax: Syntax, is_array: IsArray<'_>) -> ReadText {
    match syntax {
        Syntax::Toml => super::toml::parse(text, is_array),
        Syntax::Json => match parse_json(text) {
            Ok(root) => ReadText { root: Some(root), faults: Vec::new() },
            Err(fault) => ReadText { root: None, faults: vec![fault] },
        },
    }
}

impl Numbers {
    /// What an element is: a number, or a list of them.
    fn data(self, number: Option<f64>) -> Data {
        let row = Numbers { count: self.width.unwrap_or_default(), width: None };
        number.map_or(Data::Numbers(row), Data::Number)
    }
}

fn parse_json(text: &str) -> Result<Node, SyntaxFault> {
    let whole = Scan::new(text, Syntax::Json).next()?.unwrap_or_default();
    let piece = TextPiece::new(text, &whole);
    let strict = jsonc_parser::ParseOptions {
        allow_comments: false,
        allow_loose_object_property_names: false,
        allow_trailing_commas: false,
        allow_missing_commas: false,
        allow_single_quoted_strings: false,
        allow_hexadecimal_numbers: false,
        allow_unary_plus_numbers: false,
        allow_bare_decimal_point_numbers: false,
        allow_non_finite_numbers: false,
        allow_extended_string_escapes: false,
    };
    let parsed = jsonc_parser::parse_to_ast(&piece.text, &jsonc_parser::CollectOptions::default(), &strict);
    let value = parsed.map_err(|e| {
        let span = piece.span(e.range().start..e.range().end);
        SyntaxFault::new(span, format!("not JSON: {}", lower_first(&e.kind().to_string())), None)
    })?;
    let empty =
        || SyntaxFault::new(Span::default(), "not JSON: the text is empty".into(), Some("an empty scene is `{}`"));
    json_node(value.value.ok_or_else(empty)?, &piece)
}

fn json_node(value: ast::Value<'_>, piece: &TextPiece<'_>) -> Result<Node, SyntaxFault> {
    let range = piece.span(ast_range(&value));
    let data = match value {
        ast::Value::StringLit(s) => Data::String(s.value.into_owned()),
        ast::Value::NumberLit(n) => Data::Number(n.value.parse().unwrap_or(f64::NAN)),
        ast::Value::BooleanLit(b) => Data::Bool(b.value),
        ast::Value::NullKeyword(_) => Data::Other("null"),
        ast::Value::Array(array) => match piece.list_at(range) {
            Some(numbers) => Data::Numbers(numbers),
            None => {
                let elements = array.elements.into_iter().map(|element| json_node(element, piece));
                Data::Array(elements.collect::<Result<Vec<_>, _>>()?)
            }
        },
        ast::Value::Object(object) => {
            let mut entries = Vec::with_capacity(object.properties.len());
            let mut seen = std::collections::HashSet::new();
            for property in object.properties {
                let (key, key_range) = match property.name {
                    ast::ObjectPropName::String(s) => (Arc::from(&*s.value), s.range),
                    ast::ObjectPropName::Word(w) => (Arc::from(w.value), w.range),
                };
                let key: Arc<str> = key;
                let key_span = piece.span(key_range.start..key_range.end);
                if !seen.insert(key.clone()) {
                    return Err(twice(key_span, &key));
                }
                let mut value = json_node(property.value, piece)?;
                // A table stands where its key is: its braces may be pages apart
                if matches!(value.data, Data::Table(_)) {
                    value.span = key_span;
                }
                entries.push(Entry { key, key_span, value });
            }
            Data::Table(entries)
        }
    };
    let span = match data {
        Data::Table(_) => Span { start: range.start, end: range.start + 1 },
        _ => range,
    };
    Ok(Node { span, data })
}

fn ast_range(value: &ast::Value<'_>) -> std::ops::Range<usize> {
    let range = match value {
        ast::Value::StringLit(v) => v.range,
        ast::Value::NumberLit(v) => v.range,
        ast::Value::BooleanLit(v) => v.range,
        ast::Value::Object(v) => v.range,
        ast::Value::Array(v) => v.range,
        ast::Value::NullKeyword(v) => v.range,
    };
    range.start..range.end
}

pub(super) fn twice(span: Span, key: &str) -> SyntaxFault {
    SyntaxFault::new(span, format!("{} is said twice", quoted(key)), Some("keep one of them"))
}

fn lower_first(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map(|c| c.to_lowercase().chain(chars).collect()).unwrap_or_default()
}

/// A string in double quotes as a message shows it: one line, at most 40 characters.
pub(crate) fn quoted(text: &str) -> String {
    format!("\"{}\"", shortened(text).escape_debug().to_string().replace("\\'", "'"))
}

/// The first 40 characters, with dots where more were left off.
pub(crate) fn shortened(text: &str) -> String {
    const LONGEST: usize = 40;
    if text.chars().nth(LONGEST).is_none() {
        return text.to_owned();
    }
    text.chars().take(LONGEST - 3).chain("...".chars()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_stand_at_their_headers() {
        let text = "# first\n[[sphere]]\nradius = 1\n[material.phong.\"a b\"]\n[[sphere]]\n";
        let root = parse(text, Syntax::Toml, &|_| false).root.expect("is TOML");
        let at = |span: Span| &text[span.start..span.end];
        let spheres = root.get("sphere").expect("is there");
        let sphere = |i: usize| spheres.element(text, i).expect("two spheres");
        assert_eq!(at(sphere(0).span), "[[sphere]]");
        assert!(sphere(1).span.start > sphere(0).span.start);
        assert_eq!(at(sphere(0).get("radius").expect("is there").span), "1");
        let phong = root.get("material").and_then(|m| m.get("phong")).expect("is there");
        assert_eq!(at(phong.get("a b").expect("is there").span), "[material.phong.\"a b\"]");
    }

    #[test]
    fn deep_nesting_is_an_error() {
        for (text, syntax) in [
            ("[".repeat(5_000_000), Syntax::Json),
            ("[".repeat(5_000_000), Syntax::Toml),
            (format!("a = {}", "[".repeat(5_000_000)), Syntax::Toml),
            (format!("[a{}]", ".a".repeat(1_000_000)), Syntax::Toml),
            (format!("{}x = 1", "a . ".repeat(1_000_000)), Syntax::Toml),
            (format!("a = {}1", "{ a.b.c = ".repeat(1_000_000)), Syntax::Toml),
            ("{\"a\":".repeat(1_000_000), Syntax::Json),
        ] {
            let ReadText { root, faults } = parse(&text, syntax, &|_| false);
            assert!(root.is_none());
            assert!(faults[0].message.contains("64"), "{}", faults[0].message);
        }
    }

    #[test]
    fn brackets_in_strings_and_comments_do_not_nest() {
        let many = "[".repeat(100);
        for text in [
            format!("a = \"{many}\""),
            format!("a = '{many}'"),
            format!("a = \"\"\"{many}\n\\\"\"\"\" # {many}"),
            format!("a = '''{many}\n''''' # {many}"),
            format!("# {many}\na = [1.5, 2.5, 3.5]"),
        ] {
            assert!(parse(&text, Syntax::Toml, &|_| false).root.is_some(), "{text}");
        }
        assert!(parse(&format!("{{\"a\\\"{many}\": 1}}"), Syntax::Json, &|_| false).root.is_some());
    }

    #[test]
    fn json_is_strict() {
        for text in [
            "",
            "{,}",
            "[1,]",
            "{\"a\":1,}",
            "{a:1}",
            "{'a':1}",
            "[1 2]",
            "[01]",
            "[.5]",
            "[5.]",
            "[+1]",
            "[0x1]",
            "[NaN]",
            "[Infinity]",
            "[1] 2",
            "// c\n1",
            "{\"a\":1 \"b\":2}",
            "{\"a\":1,\"a\":2}",
            "{\"a\"}",
            "[tru]",
        ] {
            assert!(parse(text, Syntax::Json, &|_| false).root.is_none(), "{text}");
        }
    }
}
