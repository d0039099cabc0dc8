//! What the fields of a table are: for the JSON Schema and for the reference.

use serde_json::{Map, Value as Json, json};

use super::TableInfo;
use super::read::{Table, Value};
use super::write::TextValue;

/// One word of a closed set, and what it means.
#[derive(Debug)]
pub(crate) struct Choice {
    pub word: &'static str,
    /// The lines of its doc comment.
    pub doc: &'static [&'static str],
}

/// One field of a table.
#[derive(Clone, Debug)]
pub(crate) struct FieldInfo {
    pub name: &'static str,
    /// The lines of its doc comment.
    pub doc: &'static [&'static str],
    /// What it takes, in words.
    pub words: String,
    /// `None`: it is required.
    pub default: Option<TextValue>,
    pub schema: Json,
    pub choices: &'static [Choice],
    /// The tables it holds, and those within them.
    pub tables: Vec<TableInfo>,
}

impl FieldInfo {
    pub(crate) fn of<T: Value>(name: &'static str, doc: &'static [&'static str], default: Option<TextValue>) -> Self {
        let mut schema = T::schema();
        if let Some(range) = range(&sentence(doc)) {
            // Ranges are of plain numbers; those of an array hold for each element
            let numbers = if schema["type"] == "array" {
                &mut schema["items"]
            } else if schema["anyOf"][0]["type"] == "integer" {
                // A whole number or a word
                &mut schema["anyOf"][0]
            } else {
                &mut schema
            };
            if numbers["type"] == "number" || numbers["type"] == "integer" {
                for (key, value) in range {
                    numbers[key] = value;
                }
            }
        }
        Self { name, doc, words: T::words(), default, schema, choices: T::choices(), tables: T::tables() }
    }
}

/// What the table that a field holds is called: `transform` for a `TransformDesc`, `transform_key` for a
/// `TransformKeyDesc`.
pub(crate) fn inner_name<T: Table>() -> String {
    let mut name = String::new();
    for (i, c) in T::NAME.strip_suffix("Desc").unwrap_or(T::NAME).chars().enumerate() {
        if c.is_ascii_uppercase() && i > 0 {
            name.push('_');
        }
        name.push(c.to_ascii_lowercase());
    }
    name
}

/// The schema of a table that a field holds: it is defined once, for all fields.
pub(crate) fn link_to<T: Table>() -> Json {
    json!({ "$ref": format!("#/$defs/{}", inner_name::<T>()) })
}

/// A table that a field holds, and those within it.
pub(crate) fn tables_of<T: Table>() -> Vec<TableInfo> {
    let own = TableInfo::of::<T>(inner_name::<T>());
    let inner: Vec<TableInfo> = own.fields.iter().flat_map(|field| field.tables.clone()).collect();
    std::iter::once(own).chain(inner).collect()
}

/// The lines of a doc comment as one paragraph.
pub(crate) fn sentence(doc: &[&str]) -> String {
    doc.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" ")
}

/// The first paragraph of a doc comment.
pub(crate) fn summary(doc: &[&str]) -> String {
    let end = doc.iter().position(|line| line.trim().is_empty()).unwrap_or(doc.len());
    sentence(&doc[..end])
}

/// The schema of a whole table.
pub(crate) fn table_schema<T: Table>() -> Json {
    let mut properties = Map::new();
    let mut required = Vec::new();
    for field in T::info() {
        let mut schema = field.schema;
        schema["description"] = sentence(field.doc).into();
        match &field.default {
            None => required.push(field.name),
            Some(TextValue::Absent) => {}
            Some(default) => schema["default"] = default.to_json_value(),
        }
        properties.insert(field.name.to_owned(), schema);
    }
    let mut schema = json!({
        "type": "object",
        "description": summary(T::DOC),
        "properties": properties,
        "additionalProperties": false,
    });
    if !required.is_empty() {
        schema["required"] = required.into();
    }
    schema
}

/// The range a doc comment states, as keywords of JSON Schema. The comment is what people read, so it is what the
/// schema is made from; these are the ways it may say it: "greater than 0", "0 or more", "1 to 64", "in (0, 180]".
fn range(doc: &str) -> Option<Map<String, Json>> {
    let mut range = Map::new();
    let words: Vec<&str> = doc.split_whitespace().collect();
    let bare = |word: &str| -> Option<Json> {
        let word = word.trim_end_matches([',', ';', ':', '.']);
        // Whole numbers stay whole in the schema
        word.parse::<i64>().map(Json::from).ok().or_else(|| word.parse::<f64>().map(Json::from).ok())
    };
    for (i, word) in words.iter().enumerate() {
        match (*word, words.get(i + 1), words.get(i + 2)) {
            ("than", Some(low), _) if i > 0 && words[i - 1] == "greater" => {
                range.insert("exclusiveMinimum".into(), bare(low)?);
            }
            ("or", Some(more), _) if i > 0 && more.starts_with("more") => {
                range.insert("minimum".into(), bare(words[i - 1])?);
            }
            ("to", Some(high), _) if i > 0 => {
                if let (Some(low), Some(high)) = (bare(words[i - 1]), bare(high)) {
                    range.insert("minimum".into(), low);
                    range.insert("maximum".into(), high);
                }
            }
            ("in", Some(low), Some(high)) if low.starts_with('(') && low.ends_with(',') => {
                let low = bare(low.trim_start_matches('('))?;
                let high = high.trim_end_matches(['.', ';', ',', ':']);
                let keyword = if high.ends_with(']') { "maximum" } else { "exclusiveMaximum" };
                let high = bare(high.trim_end_matches([']', ')']))?;
                range.insert("exclusiveMinimum".into(), low);
                range.insert(keyword.into(), high);
            }
            _ => continue,
        }
        // The first statement is the field's; what follows explains
        if !range.is_empty() {
            return Some(range);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_from_the_comments() {
        let of = |doc: &str| Json::from(range(doc).unwrap_or_default());
        assert_eq!(of("Radius in metres, greater than 0."), json!({ "exclusiveMinimum": 0 }));
        assert_eq!(of("Candela, or a factor; 0 or more."), json!({ "minimum": 0 }));
        assert_eq!(of("Pixels down, 1 to 65536; at most 9 in all."), json!({ "minimum": 1, "maximum": 65536 }));
        assert_eq!(of("In stops, from -64 to 64."), json!({ "minimum": -64, "maximum": 64 }));
        assert_eq!(of("degrees, in (0, 180]."), json!({ "exclusiveMinimum": 0, "maximum": 180 }));
        assert_eq!(of("degrees, in (0, 180)."), json!({ "exclusiveMinimum": 0, "exclusiveMaximum": 180 }));
        assert_eq!(of("from 0 to `cone_deg`; without it, none"), json!({}));
        assert_eq!(of("Normal up to the edge."), json!({}));
    }
}
