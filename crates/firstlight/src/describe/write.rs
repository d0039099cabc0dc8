//! From values to text: what a table writes, as TOML and as JSON.

/// A value on its way to text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum TextValue {
    /// Nothing: the key is left out.
    Absent,
    Number(f64),
    Bool(bool),
    Text(String),
    List(Vec<TextValue>),
    /// A list of lists of as many numbers each, one after another: there may be millions.
    Rows {
        width: usize,
        numbers: Vec<f64>,
    },
    /// An inline table of texts.
    Names(Vec<(String, String)>),
    /// An inline table.
    Table(Vec<(&'static str, TextValue)>),
}

/// The shortest decimal that reads back to the same bits; whole numbers without a point.
fn number(v: f64) -> String {
    let whole = v.fract() == 0.0 && v.abs() < 1e15 && !(v == 0.0 && v.is_sign_negative());
    if whole { format!("{v:.0}") } else { format!("{v:?}") }
}

/// A key as TOML writes it: bare where that is possible, else in quotes.
pub(crate) fn key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(bare) { name.to_owned() } else { toml_string(name) }
}

fn toml_string(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            c if c.is_control() => out.push_str(&format!("\\u{:04X}", u32::from(c))),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// A string as JSON writes it.
pub(crate) fn json_string(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// Pairs in braces, on one line.
fn in_braces(pairs: impl Iterator<Item = String>) -> String {
    let pairs: Vec<String> = pairs.collect();
    if pairs.is_empty() { "{}".into() } else { format!("{{ {} }}", pairs.join(", ")) }
}

/// Numbers in brackets.
fn row(numbers: &[f64], out: &mut String, write: impl Fn(f64) -> String) {
    out.push('[');
    for (i, v) in numbers.iter().enumerate() {
        out.push_str(if i > 0 { ", " } else { "" });
        out.push_str(&write(*v));
    }
    out.push(']');
}

/// Rows in brackets.
fn rows(width: usize, numbers: &[f64], write: impl Fn(f64) -> String) -> String {
    let mut out = String::from("[");
    for (i, numbers) in numbers.chunks(width).enumerate() {
        out.push_str(if i > 0 { ", " } else { "" });
        row(numbers, &mut out, &write);
    }
    out + "]"
}

impl TextValue {
    /// A list of any length.
    pub(crate) fn list(elements: impl Iterator<Item = TextValue>) -> Self {
        let mut elements = elements.peekable();
        let numbers_of = |element: &TextValue| -> Option<Vec<f64>> {
            let TextValue::List(row) = element else { return None };
            row.iter().map(|v| if let TextValue::Number(v) = v { Some(*v) } else { None }).collect()
        };
        let Some(width) = elements.peek().and_then(numbers_of).map(|row| row.len()).filter(|width| *width > 0) else {
            return TextValue::List(elements.collect());
        };
        let mut numbers = Vec::new();
        while let Some(row) = elements.peek().and_then(numbers_of).filter(|row| row.len() == width) {
            numbers.extend(row);
            elements.next();
        }
        if elements.peek().is_none() {
            return TextValue::Rows { width, numbers };
        }
        let row = |row: &[f64]| TextValue::List(row.iter().map(|v| TextValue::Number(*v)).collect());
        TextValue::List(numbers.chunks(width).map(row).chain(elements).collect())
    }

    /// On one line, as TOML.
    pub(crate) fn to_toml(&self) -> String {
        match self {
            TextValue::Absent => String::new(),
            TextValue::Number(v) if v.is_nan() => "nan".into(),
            TextValue::Number(v) => number(*v),
            TextValue::Bool(v) => v.to_string(),
            TextValue::Text(v) => toml_string(v),
            TextValue::List(v) => format!("[{}]", v.iter().map(Self::to_toml).collect::<Vec<_>>().join(", ")),
            TextValue::Rows { width, numbers } => rows(*width, numbers, |v| TextValue::Number(v).to_toml()),
            TextValue::Names(v) => in_braces(v.iter().map(|(k, v)| format!("{} = {}", key(k), toml_string(v)))),
            TextValue::Table(v) => in_braces(v.iter().map(|(k, v)| format!("{} = {}", key(k), v.to_toml()))),
        }
    }

    /// On one line, as JSON, which has no words for numbers that are not finite: they become `null`.
    pub(crate) fn to_json(&self) -> String {
        match self {
            TextValue::Absent => "null".into(),
            TextValue::Number(v) if !v.is_finite() => "null".into(),
            TextValue::Number(v) => number(*v),
            TextValue::Bool(v) => v.to_string(),
            TextValue::Text(v) => json_string(v),
            TextValue::List(v) => format!("[{}]", v.iter().map(Self::to_json).collect::<Vec<_>>().join(", ")),
            TextValue::Rows { width, numbers } => rows(*width, numbers, |v| TextValue::Number(v).to_json()),
            TextValue::Names(v) => in_braces(v.iter().map(|(k, v)| format!("{}: {}", json_string(k), json_string(v)))),
            TextValue::Table(v) => in_braces(v.iter().map(|(k, v)| format!("{}: {}", json_string(k), v.to_json()))),
        }
    }

    /// As a tree, for the defaults of the JSON Schema.
    pub(crate) fn to_json_value(&self) -> serde_json::Value {
        serde_json::from_str(&self.to_json()).expect("what to_json writes is JSON")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_to_the_same_bits() {
        for v in [0.0, -0.0, 1.0, -6.0, 5.9, 1e15, 1e16, 1e300, f64::MAX, f64::MIN_POSITIVE, 5e-324, 0.1 + 0.2] {
            let text = number(v);
            assert_eq!(text.parse::<f64>().map(f64::to_bits), Ok(v.to_bits()), "{text}");
            let root = toml::de::DeValue::parse(&text).expect("is TOML");
            assert!(root.get_ref().is_float() || root.get_ref().is_integer(), "{text}");
        }
        assert_eq!(number(-6.0), "-6");
    }

    #[test]
    fn rows_are_written_as_the_lists_they_are() {
        let list = |numbers: &[f64]| TextValue::List(numbers.iter().map(|v| TextValue::Number(*v)).collect());
        let even = [list(&[1.0, f64::NAN]), list(&[-0.0, 2.5])];
        let rows = TextValue::list(even.iter().cloned());
        assert!(matches!(&rows, TextValue::Rows { width: 2, numbers } if numbers.len() == 4));
        assert_eq!(
            (rows.to_toml(), rows.to_json()),
            ("[[1, nan], [-0.0, 2.5]]".into(), "[[1, null], [-0.0, 2.5]]".into())
        );
        assert_eq!(rows.to_toml(), TextValue::List(even.to_vec()).to_toml());
        for odd in [list(&[]), list(&[1.0]), TextValue::Number(1.0), TextValue::List(vec![TextValue::Bool(true); 2])] {
            let all = [even[0].clone(), even[0].clone(), odd];
            assert_eq!(TextValue::list(all.iter().cloned()).to_toml(), TextValue::List(all.to_vec()).to_toml());
        }
        assert_eq!(TextValue::list(std::iter::empty()), TextValue::List(Vec::new()));
    }

    #[test]
    fn keys_are_bare_where_they_can_be() {
        assert_eq!(key("blinn-phong_2"), "blinn-phong_2");
        assert_eq!(key(""), "\"\"");
        assert_eq!(key("a.b"), "\"a.b\"");
        assert_eq!(key("a\u{7f}\"\n"), "\"a\\u007F\\\"\\n\"");
    }
}
