//! TOML and JSON as one tree that knows where everything stands.
//!
//! Both parsers come from outside and were written for friendly input. Nesting and the number of tokens are therefore
//! counted by [`scan`] before either sees the text: their recursion, and the recursive drop of what they build, would
//! overflow the stack, and a token takes many times the memory of its letters.

use jsonc_parser::ast;
use toml::de::{DeTable, DeValue};

/// Largest nesting of arrays and tables.
pub(crate) const MAX_DEPTH: usize = 64;
/// Most words, numbers and punctuation marks in one text.
pub(crate) const MAX_TOKENS: usize = 1 << 24;

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
#[derive(Debug)]
pub(crate) struct Node {
    pub span: Span,
    pub data: Data,
}

/// What a value is.
#[derive(Debug)]
pub(crate) enum Data {
    String(String),
    /// Any number; infinite also where the text's digits exceed every finite number.
    Number(f64),
    Bool(bool),
    /// What scene text has no use for, in words: "a date", "null".
    Other(&'static str),
    Array(Vec<Node>),
    /// In the order of the text, without duplicate keys.
    Table(Vec<Entry>),
}

/// A key of a table, and its value.
#[derive(Debug)]
pub(crate) struct Entry {
    pub key: String,
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

    /// The elements, if this is an array.
    pub(crate) fn elements(&self) -> Option<&[Node]> {
        if let Data::Array(elements) = &self.data { Some(elements) } else { None }
    }

    /// The value at `key`, if this is a table and has it.
    pub(crate) fn get(&self, key: &str) -> Option<&Node> {
        self.entries()?.iter().find(|e| e.key == key).map(|e| &e.value)
    }

    /// What it is, in words.
    pub(crate) fn kind(&self) -> String {
        match &self.data {
            Data::String(_) => "a string".into(),
            Data::Number(_) => "a number".into(),
            Data::Bool(_) => "a truth value".into(),
            Data::Other(words) => (*words).into(),
            Data::Array(elements) if elements.len() == 1 => "an array of 1 value".into(),
            Data::Array(elements) => format!("an array of {} values", elements.len()),
            Data::Table(_) => "a table".into(),
        }
    }
}

/// A fault of the syntax: where, what, and what to do.
#[derive(Debug)]
pub(crate) struct SyntaxFault {
    pub span: Span,
    pub message: String,
    pub hint: Option<String>,
}

/// The two languages of scene text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Syntax {
    Toml,
    Json,
}

/// Reads a text into a tree.
///
/// # Errors
/// All faults of the syntax; for JSON the first.
pub(crate) fn parse(text: &str, syntax: Syntax) -> Result<Node, Vec<SyntaxFault>> {
    scan(text, syntax).map_err(|fault| vec![fault])?;
    match syntax {
        Syntax::Toml => parse_toml(text),
        Syntax::Json => parse_json(text).map_err(|fault| vec![fault]),
    }
}

/// Refuses text whose nesting or number of tokens would hurt the parsers.
fn scan(text: &str, syntax: Syntax) -> Result<(), SyntaxFault> {
    let bytes = text.as_bytes();
    let too_deep = |at: usize| SyntaxFault {
        span: Span { start: at, end: at + 1 },
        message: format!("more than {MAX_DEPTH} tables or arrays within each other"),
        hint: Some("a scene needs no more than 5".into()),
    };
    // Depth at each open bracket; a dotted key `a.b.c` nests like a table in a table in a table
    let mut open: Vec<usize> = Vec::new();
    let (mut depth, mut dots, mut key_dots) = (0, 0, 0);
    let (mut tokens, mut in_word) = (0usize, false);
    let mut i = 0;
    while i < bytes.len() {
        let at = i;
        let byte = bytes[i];
        i += 1;
        let is_word = byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-' | b'+') || byte >= 0x80;
        if !(is_word && in_word) {
            tokens += 1;
        }
        in_word = is_word;
        match byte {
            b'"' | b'\'' if byte == b'"' || syntax == Syntax::Toml => i = string_end(bytes, at, syntax),
            b'#' if syntax == Syntax::Toml => {
                while i < bytes.len() && bytes[i] != b'\n' {
                    i += 1;
                }
            }
            b'[' | b'{' => {
                open.push(depth);
                depth += 1 + key_dots;
                (dots, key_dots) = (0, 0);
                if depth > MAX_DEPTH {
                    return Err(too_deep(at));
                }
            }
            b']' | b'}' => {
                depth = open.pop().unwrap_or(0);
                (dots, key_dots) = (0, 0);
            }
            b'=' => (dots, key_dots) = (0, dots),
            b',' | b'\n' | b':' => (dots, key_dots) = (0, 0),
            b'.' => {
                dots += 1;
                if depth + dots > MAX_DEPTH {
                    return Err(too_deep(at));
                }
            }
            _ => {}
        }
        if tokens > MAX_TOKENS {
            return Err(SyntaxFault {
                span: Span { start: at, end: at + 1 },
                message: format!("more than {MAX_TOKENS} words, numbers and marks in one text"),
                hint: Some("spread the scene over several files with `include`".into()),
            });
        }
    }
    Ok(())
}

/// The byte after the string that starts at `start`; where it is never closed, the end of the line or of the text.
fn string_end(bytes: &[u8], start: usize, syntax: Syntax) -> usize {
    let quote = bytes[start];
    let long = syntax == Syntax::Toml && bytes[start..].starts_with(&[quote; 3]);
    let escapes = quote == b'"';
    let mut i = if long { start + 3 } else { start + 1 };
    while i < bytes.len() {
        match bytes[i] {
            b'\\' if escapes => i += 1,
            b'\n' if !long => return i,
            byte if byte == quote && !long => return i + 1,
            byte if byte == quote && bytes[i..].starts_with(&[quote; 3]) => {
                // Up to two quotes may stand before the three that close it
                while bytes.get(i) == Some(&quote) {
                    i += 1;
                }
                return i;
            }
            _ => {}
        }
        i += 1;
    }
    bytes.len()
}

fn parse_toml(text: &str) -> Result<Node, Vec<SyntaxFault>> {
    let (table, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        let mut faults: Vec<SyntaxFault> = errors
            .iter()
            .map(|e| {
                let span: Span = e.span().map(Span::from).unwrap_or_default();
                if e.message() == "duplicate key" {
                    let key = text.get(span.start..span.end).unwrap_or_default();
                    return twice(span, key.trim_matches(['"', '\'']));
                }
                SyntaxFault { span, message: format!("not TOML: {}", e.message()), hint: None }
            })
            .collect();
        // One slip makes the parser stumble over every word that follows it on the line: tell the first
        faults.sort_by_key(|f| f.span.start);
        let mut told = None;
        faults.retain(|f| {
            let start = f.span.start.min(text.len());
            let line = text.as_bytes()[..start].iter().rposition(|b| *b == b'\n');
            told.replace(line) != Some(line)
        });
        return Err(faults);
    }
    Ok(Node { span: Span::default(), data: toml_table(table.into_inner()) })
}

fn toml_table(table: DeTable<'_>) -> Data {
    let mut entries: Vec<Entry> = table
        .into_iter()
        .map(|(key, value)| Entry {
            key_span: key.span().into(),
            key: key.into_inner().into_owned(),
            value: toml_node(value),
        })
        .collect();
    // The parser sorts by name; the text's order is the scene's order
    entries.sort_by_key(|e| e.key_span.start);
    Data::Table(entries)
}

fn toml_node(value: toml::Spanned<DeValue<'_>>) -> Node {
    let span = value.span().into();
    let data = match value.into_inner() {
        DeValue::String(s) => Data::String(s.into_owned()),
        DeValue::Integer(i) => match i64::from_str_radix(i.as_str(), i.radix()) {
            Ok(whole) => Data::Number(whole as f64),
            // Digits beyond 64 bits: still a number in base 10
            Err(_) if i.radix() == 10 => Data::Number(i.as_str().parse().unwrap_or(f64::INFINITY)),
            Err(_) => Data::Number(f64::INFINITY),
        },
        DeValue::Float(f) => Data::Number(f.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(b) => Data::Bool(b),
        DeValue::Datetime(_) => Data::Other("a date or time"),
        DeValue::Array(elements) => Data::Array(elements.into_iter().map(toml_node).collect()),
        DeValue::Table(table) => toml_table(table),
    };
    Node { span, data }
}

fn parse_json(text: &str) -> Result<Node, SyntaxFault> {
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
    let parsed = jsonc_parser::parse_to_ast(text, &jsonc_parser::CollectOptions::default(), &strict);
    let value = parsed.map_err(|e| SyntaxFault {
        span: Span { start: e.range().start, end: e.range().end },
        message: format!("not JSON: {}", lower_first(&e.kind().to_string())),
        hint: None,
    })?;
    match value.value {
        Some(value) => json_node(value),
        None => Err(SyntaxFault {
            span: Span::default(),
            message: "not JSON: the text is empty".into(),
            hint: Some("an empty scene is `{}`".into()),
        }),
    }
}

fn json_node(value: ast::Value<'_>) -> Result<Node, SyntaxFault> {
    let range = ast_range(&value);
    let data = match value {
        ast::Value::StringLit(s) => Data::String(s.value.into_owned()),
        ast::Value::NumberLit(n) => Data::Number(n.value.parse().unwrap_or(f64::NAN)),
        ast::Value::BooleanLit(b) => Data::Bool(b.value),
        ast::Value::NullKeyword(_) => Data::Other("null"),
        ast::Value::Array(array) => {
            Data::Array(array.elements.into_iter().map(json_node).collect::<Result<Vec<_>, _>>()?)
        }
        ast::Value::Object(object) => {
            let mut entries = Vec::with_capacity(object.properties.len());
            let mut seen = std::collections::HashSet::new();
            for property in object.properties {
                let (key, key_range) = match property.name {
                    ast::ObjectPropName::String(s) => (s.value.into_owned(), s.range),
                    ast::ObjectPropName::Word(w) => (w.value.to_owned(), w.range),
                };
                let key_span = Span { start: key_range.start, end: key_range.end };
                if !seen.insert(key.clone()) {
                    return Err(twice(key_span, &key));
                }
                let mut value = json_node(property.value)?;
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

fn ast_range(value: &ast::Value<'_>) -> Span {
    let range = match value {
        ast::Value::StringLit(v) => v.range,
        ast::Value::NumberLit(v) => v.range,
        ast::Value::BooleanLit(v) => v.range,
        ast::Value::Object(v) => v.range,
        ast::Value::Array(v) => v.range,
        ast::Value::NullKeyword(v) => v.range,
    };
    Span { start: range.start, end: range.end }
}

fn twice(span: Span, key: &str) -> SyntaxFault {
    let message = format!("{} is said twice", quoted(key));
    SyntaxFault { span, message, hint: Some("keep one of them".into()) }
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
        let root = parse(text, Syntax::Toml).expect("is TOML");
        let at = |span: Span| &text[span.start..span.end];
        let spheres = root.get("sphere").and_then(Node::elements).expect("two spheres");
        assert_eq!(at(spheres[0].span), "[[sphere]]");
        assert!(spheres[1].span.start > spheres[0].span.start);
        assert_eq!(at(spheres[0].get("radius").expect("is there").span), "1");
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
            let faults = parse(&text, syntax).expect_err("is too deep");
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
            assert!(parse(&text, Syntax::Toml).is_ok(), "{text}");
        }
        assert!(parse(&format!("{{\"a\\\"{many}\": 1}}"), Syntax::Json).is_ok());
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
            assert!(parse(text, Syntax::Json).is_err(), "{text}");
        }
    }
}
