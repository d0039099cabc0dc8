//! The JSON Schema of scenes, for completion and checks in editors.

use serde_json::{Map, Value as Json, json};

use crate::camera::CameraDesc;
use crate::describe::value::color_schema;
use crate::describe::{Family, TableInfo};
use crate::light::LightDesc;
use crate::material::MaterialDesc;
use crate::scene::description::RenderDesc;
use crate::shape::ShapeDesc;
use crate::texture::TextureDesc;

/// The JSON Schema (draft 2020-12) of a scene in JSON or TOML, pretty printed.
pub fn schema() -> String {
    let mut defs = Map::from_iter([("color".to_owned(), color_schema())]);
    let mut reference = |prefix: &str, table: TableInfo| -> (String, Json) {
        let name = if prefix.is_empty() { table.kind.clone() } else { format!("{prefix}.{}", table.kind) };
        let to = json!({ "$ref": format!("#/$defs/{name}") });
        for inner in table.fields.into_iter().flat_map(|field| field.tables) {
            defs.insert(inner.kind, inner.schema);
        }
        defs.insert(name, table.schema);
        (table.kind, to)
    };

    let mut properties = Map::new();
    properties.insert("$schema".into(), json!({ "type": "string", "description": "The schema; not read." }));
    properties.insert(
        "include".into(),
        json!({
            "type": "array",
            "items": { "type": "string" },
            "description": "Other texts that are part of the scene, relative to this one; they come first.",
        }),
    );
    let (_, render) = reference("", TableInfo::of::<RenderDesc>("render"));
    properties.insert("render".into(), render);
    let (_, camera) = reference("", TableInfo::of::<CameraDesc>("camera"));
    // One camera has values, several are tables within a table
    let several = json!({
        "type": "object", "description": "Several cameras, by name.",
        "minProperties": 1, "additionalProperties": camera,
    });
    properties.insert("camera".into(), json!({ "anyOf": [camera, several] }));
    properties.insert("texture".into(), kinds_by_name::<TextureDesc>(&mut reference));
    properties.insert("material".into(), kinds_by_name::<MaterialDesc>(&mut reference));
    let mut shapes = Map::new();
    for table in ShapeDesc::tables() {
        let (kind, table) = reference("", table);
        shapes.insert(kind, json!({ "type": "array", "items": table }));
    }
    properties.extend(shapes.clone());
    let group = json!({ "type": "object", "properties": shapes, "additionalProperties": false });
    properties.insert(
        "group".into(),
        json!({
            "type": "object", "description": "Shapes to be placed by instances, by name.",
            "additionalProperties": group,
        }),
    );
    let mut lights = Map::new();
    for table in LightDesc::tables() {
        let (kind, table) = reference("light", table);
        lights.insert(kind, json!({ "type": "array", "items": table }));
    }
    properties.insert("light".into(), json!({ "type": "object", "properties": lights, "additionalProperties": false }));

    let schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A firstlight scene",
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
        "$defs": defs,
    });
    format!("{schema:#}\n")
}

/// `material.KIND.NAME` and `texture.KIND.NAME`.
fn kinds_by_name<F: Family>(reference: &mut impl FnMut(&str, TableInfo) -> (String, Json)) -> Json {
    let mut kinds = Map::new();
    for table in F::tables() {
        let (kind, table) = reference(F::WORD, table);
        kinds.insert(kind, json!({ "type": "object", "additionalProperties": table }));
    }
    json!({ "type": "object", "properties": kinds, "additionalProperties": false })
}
