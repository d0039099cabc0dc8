//! A place in the JSON of a file: what is there, and the JSON pointer that messages call it by.

use serde_json::Value;

use super::GltfFault;

/// `base color` of `baseColor`.
fn words(key: &str) -> String {
    let mut words = String::with_capacity(key.len() + 2);
    for c in key.chars() {
        if c.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
    }
    words
}

/// A value of the JSON and where it stands.
#[derive(Clone, Debug)]
pub(crate) struct JsonPlace<'a> {
    value: &'a Value,
    /// RFC 6901: `/accessors/3/count`; empty for the whole.
    pointer: String,
}

/// What to do about a file that says what cannot be.
pub(super) const EXPORT_ANEW: &str = "the file is damaged or written wrongly: export it anew";

impl<'a> JsonPlace<'a> {
    /// The whole.
    pub fn root(value: &'a Value) -> Self {
        JsonPlace { value, pointer: String::new() }
    }

    /// Where it stands.
    pub fn pointer(&self) -> &str {
        &self.pointer
    }

    /// A fault here.
    pub fn fault(&self, message: impl Into<String>) -> GltfFault {
        GltfFault { pointer: self.pointer.clone(), message: message.into(), hint: EXPORT_ANEW.into() }
    }

    /// What is wrong with a value of another type than `wanted`.
    fn wrong_type(&self, wanted: &str) -> GltfFault {
        let kind = match self.value {
            Value::Null => "null".to_owned(),
            Value::Bool(value) => value.to_string(),
            Value::Number(number) => number.to_string(),
            Value::String(text) => format!("{:?}", text.chars().take(40).collect::<String>()),
            Value::Array(_) => "an array".to_owned(),
            Value::Object(_) => "an object".to_owned(),
        };
        self.fault(format!("{kind} is not {wanted}"))
    }

    /// The value of `key`; `None` where there is none, or null.
    pub fn get(&self, key: &str) -> Option<JsonPlace<'a>> {
        let value = self.value.as_object()?.get(key).filter(|value| !value.is_null())?;
        let escaped = key.replace('~', "~0").replace('/', "~1");
        Some(JsonPlace { value, pointer: format!("{}/{escaped}", self.pointer) })
    }

    /// The value of `key`, which has to be there.
    pub fn need(&self, key: &str) -> Result<JsonPlace<'a>, GltfFault> {
        self.get(key).ok_or_else(|| self.fault(format!("has no \"{key}\"")))
    }

    /// An extension of this object, with this name.
    pub fn extension(&self, name: &str) -> Option<JsonPlace<'a>> {
        self.get("extensions")?.get(name)
    }

    /// The references of a material to textures, at any depth, by their keys: `baseColorTexture`.
    fn texture_references(&self) -> Vec<(&'a str, &'a Value)> {
        let (mut found, mut open) = (Vec::new(), vec![self.value]);
        while let Some(value) = open.pop() {
            for (key, value) in value.as_object().into_iter().flatten() {
                match key.ends_with("Texture") && value.get("index").is_some() {
                    true => found.push((key.as_str(), value)),
                    false => open.push(value),
                }
            }
        }
        found
    }

    /// The textures that a material names, with what for: `base color` of `baseColorTexture`.
    pub fn textures(&self) -> Vec<(String, usize)> {
        let named = |(key, reference): (&str, &Value)| {
            let index = reference.get("index")?.as_u64().and_then(|index| usize::try_from(index).ok())?;
            Some((words(key.strip_suffix("Texture")?), index))
        };
        let mut found: Vec<(String, usize)> = self.texture_references().into_iter().filter_map(named).collect();
        found.sort();
        found.dedup();
        found
    }

    /// The sets of texture coordinates that the textures of a material name.
    pub fn uv_sets(&self) -> Vec<usize> {
        let set_of = |(_, reference): (&str, &'a Value)| {
            let moved = reference.get("extensions").and_then(|all| all.get("KHR_texture_transform"));
            let set = moved.and_then(|moved| moved.get("texCoord")).or(reference.get("texCoord"));
            set.and_then(Value::as_u64).map_or(0, |set| usize::try_from(set).unwrap_or(usize::MAX))
        };
        self.texture_references().into_iter().map(set_of).collect()
    }

    /// The images that a texture names, in extensions too.
    pub fn sources(&self) -> Vec<usize> {
        let extensions = self.get("extensions").and_then(|at| at.value.as_object());
        let others = extensions.into_iter().flatten().map(|(_, extension)| extension);
        let all = std::iter::once(self.value).chain(others).filter_map(|value| value.get("source")?.as_u64());
        all.filter_map(|index| usize::try_from(index).ok()).collect()
    }

    /// How many elements the array at `key` has; without one, 0.
    pub fn count(&self, key: &str) -> usize {
        self.get(key).and_then(|at| at.value.as_array().map(Vec::len)).unwrap_or(0)
    }

    /// The elements of an array.
    pub fn items(&self) -> Result<impl Iterator<Item = JsonPlace<'a>> + use<'a>, GltfFault> {
        let items = self.value.as_array().ok_or_else(|| self.wrong_type("an array"))?;
        let pointer = self.pointer.clone();
        Ok(items.iter().enumerate().map(move |(i, value)| JsonPlace { value, pointer: format!("{pointer}/{i}") }))
    }

    /// The elements of the array at `key`; none where there is no such array.
    pub fn list(&self, key: &str) -> Result<Vec<JsonPlace<'a>>, GltfFault> {
        self.get(key).map_or(Ok(Vec::new()), |at| Ok(at.items()?.collect()))
    }

    /// One of the things of the whole file: `root.of_index("meshes", at)`, where `at` holds its number.
    pub fn of_index(&self, kind: &str, at: &JsonPlace<'_>) -> Result<JsonPlace<'a>, GltfFault> {
        self.nth(kind, at.index()?).map_err(|fault| GltfFault { pointer: at.pointer.clone(), ..fault })
    }

    /// Number `index` of the array at `kind`.
    pub fn nth(&self, kind: &str, index: usize) -> Result<JsonPlace<'a>, GltfFault> {
        let value = self.value.get(kind).and_then(|list| list.get(index));
        match value {
            Some(value) => Ok(JsonPlace { value, pointer: format!("{}/{kind}/{index}", self.pointer) }),
            None => {
                let count = self.count(kind);
                Err(self.fault(format!("there is no number {index} in \"{kind}\", which has {count}")))
            }
        }
    }

    /// A whole number from 0 on.
    pub fn index(&self) -> Result<usize, GltfFault> {
        // Exporters of scripting languages write 3.0
        let whole = self.value.as_u64().or_else(|| {
            let number = self.value.as_f64()?;
            ((0.0..=9e15).contains(&number) && number.fract() == 0.0).then_some(number as u64)
        });
        let whole = whole.and_then(|number| usize::try_from(number).ok());
        whole.ok_or_else(|| self.wrong_type("a whole number from 0 on"))
    }

    /// The whole number at `key`, or `default`.
    pub fn index_or(&self, key: &str, default: usize) -> Result<usize, GltfFault> {
        self.get(key).map_or(Ok(default), |at| at.index())
    }

    /// A number.
    pub fn number(&self) -> Result<f64, GltfFault> {
        self.value.as_f64().ok_or_else(|| self.wrong_type("a number"))
    }

    /// The number at `key`, or `default`.
    pub fn number_or(&self, key: &str, default: f64) -> Result<f64, GltfFault> {
        self.get(key).map_or(Ok(default), |at| at.number())
    }

    /// So many numbers.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N], GltfFault> {
        let items = self.value.as_array().filter(|items| items.len() == N);
        let items = items.ok_or_else(|| self.wrong_type(&format!("an array of {N} numbers")))?;
        let mut numbers = [0.0; N];
        for (number, item) in numbers.iter_mut().zip(items) {
            *number = item.as_f64().ok_or_else(|| self.wrong_type(&format!("an array of {N} numbers")))?;
        }
        Ok(numbers)
    }

    /// The numbers at `key`, or `default`.
    pub fn numbers_or<const N: usize>(&self, key: &str, default: [f64; N]) -> Result<[f64; N], GltfFault> {
        self.get(key).map_or(Ok(default), |at| at.numbers())
    }

    /// A text.
    pub fn text(&self) -> Result<&'a str, GltfFault> {
        self.value.as_str().ok_or_else(|| self.wrong_type("a text"))
    }

    /// The text at `key`, if there is one.
    pub fn text_of(&self, key: &str) -> Option<&'a str> {
        self.value.get(key).and_then(Value::as_str)
    }

    /// Whether `key` is true.
    pub fn flag(&self, key: &str) -> bool {
        self.value.get(key).and_then(Value::as_bool).unwrap_or(false)
    }
}
