//! One thing of a scene as a table: read from keyword arguments, written, replaced.

use std::borrow::Cow;

use firstlight::{
    CameraDesc, LightDesc, MaterialDesc, NoAssets, Parsed, RenderDesc, SceneDesc, SceneError, ShapeDesc, TextureDesc,
    TransformDesc,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Map, Value as Json, json};

use crate::error::fault;
use crate::value::table;

/// A thing of a scene.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "each is read once")]
pub enum Item {
    /// The picture.
    Render(RenderDesc),
    /// A camera and its name.
    Camera(String, CameraDesc),
    /// A texture and its name.
    Texture(String, TextureDesc),
    /// A material and its name.
    Material(String, MaterialDesc),
    /// A shape.
    Shape(ShapeDesc),
    /// A light.
    Light(LightDesc),
}

impl Item {
    /// From a table, as the text of a scene would have it. `family` and `kind` say what it is, `name` is that of things
    /// that are called by a key and not by a field.
    ///
    /// # Errors
    /// The faults of the table, without places; their paths begin with the kind.
    pub fn read(family: &str, kind: &str, name: &str, table: Map<String, Json>) -> Result<Item, SceneError> {
        let fields = Json::Object(table);
        let (path, tree) = match family {
            "render" => ("render".to_owned(), json!({ "render": fields })),
            "camera" if name.is_empty() => ("camera".to_owned(), json!({ "camera": fields })),
            "camera" => (format!("camera.{name}"), json!({ "camera": { name: fields } })),
            "light" => (format!("light.{kind}[0]"), json!({ "light": { kind: [fields] } })),
            "material" | "texture" => {
                (format!("{family}.{kind}.{name}"), json!({ family: { kind: { name: fields } } }))
            }
            _ => (format!("{kind}[0]"), json!({ kind: [fields] })),
        };
        let parsed = SceneDesc::parse("scene.json", tree.to_string().as_bytes(), &NoAssets);
        if !parsed.faults().is_empty() {
            return Err(SceneError { faults: without_places(parsed.faults(), &path) });
        }
        let mut desc = parsed.desc;
        let item = match family {
            "render" => Some(Item::Render(desc.render)),
            "camera" => desc.cameras.pop().map(|(name, camera)| Item::Camera(name, camera)),
            "light" => desc.lights.pop().map(Item::Light),
            "material" => desc.materials.pop().map(|(name, material)| Item::Material(name, material)),
            "texture" => desc.textures.pop().map(|(name, texture)| Item::Texture(name, texture)),
            _ => desc.shapes.pop().map(Item::Shape),
        };
        Ok(item.expect("a table without faults is a thing"))
    }

    /// The family, the kind, and the name of what is called by a key.
    pub fn words(&self) -> (&'static str, &'static str, &str) {
        match self {
            Item::Render(_) => ("render", "render", ""),
            Item::Camera(name, _) => ("camera", "camera", name),
            Item::Texture(name, texture) => ("texture", texture.kind(), name),
            Item::Material(name, material) => ("material", material.kind(), name),
            Item::Shape(shape) => ("shape", shape.kind(), ""),
            Item::Light(light) => ("light", light.kind(), ""),
        }
    }

    /// Its name, if it has one.
    pub fn name(&self) -> Option<String> {
        match self {
            Item::Render(_) => None,
            Item::Shape(shape) => shape.name().map(str::to_owned),
            Item::Light(light) => light.name(),
            Item::Camera(name, _) | Item::Texture(name, _) | Item::Material(name, _) => Some(name.clone()),
        }
    }

    /// Its table: the fields that differ from their defaults.
    pub fn table(&self) -> Map<String, Json> {
        let mut desc = SceneDesc::default();
        match self.clone() {
            Item::Render(render) => desc.render = render,
            Item::Camera(_, camera) => desc.cameras.push((String::new(), camera)),
            Item::Texture(name, texture) => desc.textures.push((name, texture)),
            Item::Material(name, material) => desc.materials.push((name, material)),
            Item::Shape(shape) => desc.shapes.push(shape),
            Item::Light(light) => desc.lights.push(light),
        }
        let tree: Json = serde_json::from_str(&desc.to_json()).expect("the library writes JSON");
        let (family, kind, name) = self.words();
        let fields = match family {
            "render" | "camera" => &tree[family],
            "light" => &tree[family][kind][0],
            "material" | "texture" => &tree[family][kind][name],
            _ => &tree[kind][0],
        };
        fields.as_object().cloned().unwrap_or_default()
    }

    /// The same with some fields replaced; one that is null goes back to its default.
    ///
    /// # Errors
    /// Those of [`read`](Self::read).
    pub fn updated(&self, fields: Map<String, Json>) -> Result<Item, SceneError> {
        let mut table = self.table();
        for (key, value) in fields {
            if value.is_null() {
                table.remove(&key);
            } else {
                table.insert(key, value);
            }
        }
        let (family, kind, name) = self.words();
        Item::read(family, kind, name, table)
    }

    /// Its transform, if it can have one and has.
    pub fn transform(&self) -> Option<TransformDesc> {
        match self {
            Item::Shape(shape) => shape.transform().cloned(),
            Item::Camera(_, camera) => camera.transform.as_deref().cloned(),
            Item::Light(light) => light.transform().cloned(),
            Item::Render(_) | Item::Texture(..) | Item::Material(..) => None,
        }
    }
}

/// The same faults of a text that nobody wrote: without places, and with the path of the one thing in it shortened.
pub fn without_places(faults: &[firstlight::Diagnostic], path: &str) -> Vec<firstlight::Diagnostic> {
    let short = path.trim_end_matches("[0]");
    let faults = faults.iter().map(|fault| {
        let own = fault.path.strip_prefix(path).map(|rest| format!("{short}{rest}"));
        firstlight::Diagnostic { place: None, path: own.unwrap_or_else(|| fault.path.clone()), ..fault.clone() }
    });
    faults.collect()
}

/// The names of those of a family that have one, and where they are in its list.
pub fn names<'d>(desc: &'d SceneDesc, family: &str) -> Box<dyn Iterator<Item = (usize, Cow<'d, str>)> + 'd> {
    fn keys<T>(list: &[(String, T)]) -> Box<dyn Iterator<Item = (usize, Cow<'_, str>)> + '_> {
        Box::new(list.iter().map(|(name, _)| Cow::from(name)).enumerate())
    }
    let named = |(i, name): (usize, Option<Cow<'d, str>>)| name.map(|name| (i, name));
    match family {
        "shape" => Box::new(desc.shapes.iter().map(|s| s.name().map(Cow::from)).enumerate().filter_map(named)),
        "light" => Box::new(desc.lights.iter().map(|l| l.name().map(Cow::from)).enumerate().filter_map(named)),
        "camera" => keys(&desc.cameras),
        "material" => keys(&desc.materials),
        _ => keys(&desc.textures),
    }
}

/// The thing at that place.
pub fn get(desc: &SceneDesc, family: &str, index: usize) -> Option<Item> {
    match family {
        "render" => Some(Item::Render(desc.render.clone())),
        "camera" => desc.cameras.get(index).map(|(name, camera)| Item::Camera(name.clone(), camera.clone())),
        "texture" => desc.textures.get(index).map(|(name, texture)| Item::Texture(name.clone(), texture.clone())),
        "material" => desc.materials.get(index).map(|(name, material)| Item::Material(name.clone(), material.clone())),
        "light" => desc.lights.get(index).map(|light| Item::Light(light.clone())),
        _ => desc.shapes.get(index).map(|shape| Item::Shape(shape.clone())),
    }
}

/// Puts a thing in the place of another.
pub fn set(parsed: &mut Parsed, index: usize, item: Item) {
    let desc = &mut parsed.desc;
    match item {
        Item::Render(render) => desc.render = render,
        Item::Camera(name, camera) => desc.cameras[index] = (name, camera),
        Item::Texture(name, texture) => desc.textures[index] = (name, texture),
        Item::Material(name, material) => desc.materials[index] = (name, material),
        Item::Shape(shape) => desc.shapes[index] = shape,
        Item::Light(light) => desc.lights[index] = light,
    }
}

/// Adds a thing.
pub fn push(desc: &mut SceneDesc, item: Item) {
    match item {
        Item::Render(render) => desc.render = render,
        Item::Camera(name, camera) => desc.cameras.push((name, camera)),
        Item::Texture(name, texture) => desc.textures.push((name, texture)),
        Item::Material(name, material) => desc.materials.push((name, material)),
        Item::Shape(shape) => desc.shapes.push(shape),
        Item::Light(light) => desc.lights.push(light),
    }
}

/// Removes the thing at that place.
pub fn remove(desc: &mut SceneDesc, family: &str, index: usize) {
    match family {
        "camera" => drop(desc.cameras.remove(index)),
        "texture" => drop(desc.textures.remove(index)),
        "material" => drop(desc.materials.remove(index)),
        "light" => drop(desc.lights.remove(index)),
        _ => drop(desc.shapes.remove(index)),
    }
}

/// The table of keyword arguments; a transform may be a matrix.
pub fn item_table(fields: &Bound<'_, PyDict>, path: &str) -> PyResult<Map<String, Json>> {
    let mut table = table(fields, path)?;
    if let Some(Json::Array(rows)) = table.get("transform") {
        let matrix = matrix_of(rows);
        let Some(matrix) = matrix else {
            let message = "is neither a table nor a matrix of 3 or 4 rows of 4 numbers, the fourth of them 0, 0, 0, 1";
            return Err(fault(fields.py(), &format!("{path}.transform"), message.into(), None));
        };
        table.insert("transform".into(), serde_json::json!({ "matrix": matrix }));
    }
    Ok(table)
}

/// The first three rows of a matrix of four, or of three.
fn matrix_of(rows: &[Json]) -> Option<Vec<Json>> {
    let rows: Option<Vec<&Vec<Json>>> = rows.iter().map(Json::as_array).collect();
    let rows = rows.filter(|rows| (3..=4).contains(&rows.len()) && rows.iter().all(|row| row.len() == 4))?;
    let is_last = |row: &Vec<Json>| row.iter().zip([0.0, 0.0, 0.0, 1.0]).all(|(n, one)| n.as_f64() == Some(one));
    if rows.get(3).is_some_and(|row| !is_last(row)) {
        return None;
    }
    Some(rows[..3].iter().flat_map(|row| row.iter().cloned()).collect())
}
