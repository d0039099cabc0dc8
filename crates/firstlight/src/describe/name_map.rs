//! Names for names: `{ "name there" = "name here" }`.

use serde_json::{Value as Json, json};

use super::node::Node;
use super::read::{Reader, Value};
use super::write::TextValue;

/// Names, each with the one that stands for it, in the order of the text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NameMap(pub Vec<(String, String)>);

impl NameMap {
    /// What stands for `name`, if anything does.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.0.iter().find(|(from, _)| from == name).map(|(_, to)| to.as_str())
    }
}

impl Value for NameMap {
    fn words() -> String {
        "{ \"NAME\" = \"NAME\", ... }".into()
    }

    fn plural() -> String {
        "tables of names".into()
    }

    fn schema() -> Json {
        json!({ "type": "object", "additionalProperties": { "type": "string" } })
    }

    fn placeholder() -> Self {
        Self::default()
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        let Some(entries) = node.entries() else {
            reader.wrong_type(node, &Self::words(), None);
            return None;
        };
        let pair = |entry: &super::node::Entry| {
            let name = reader.within(&entry.key, |r| String::read(&entry.value, r))?;
            Some((entry.key.to_string(), name))
        };
        entries.iter().map(pair).collect::<Vec<_>>().into_iter().collect::<Option<Vec<_>>>().map(Self)
    }

    fn write(&self) -> TextValue {
        TextValue::Names(self.0.clone())
    }
}
