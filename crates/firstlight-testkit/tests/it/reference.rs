//! The schema and the reference fit the texts there are.

use firstlight::{NoAssets, SceneDesc, builtin_scenes, reference, schema};
use serde_json::Value as Json;

/// The first way in which `value` does not conform: the keywords that the schema of scenes uses, and no others.
fn misfit(root: &Json, schema: &Json, value: &Json, path: &str) -> Option<String> {
    let number = |key: &str| schema.get(key).and_then(Json::as_f64);
    let at = |words: String| Some(format!("{path}: {words}"));
    for (key, rule) in schema.as_object().expect("a schema is an object") {
        let fault = match key.as_str() {
            "$ref" => {
                let name = rule.as_str().and_then(|r| r.strip_prefix("#/$defs/")).expect("points to a definition");
                misfit(root, root["$defs"].get(name).expect("is defined"), value, path)
            }
            "anyOf" => {
                let faults: Vec<String> =
                    rule.as_array().unwrap().iter().filter_map(|s| misfit(root, s, value, path)).collect();
                (faults.len() == rule.as_array().unwrap().len()).then(|| faults.join(" and "))
            }
            "enum" => (!rule.as_array().unwrap().contains(value)).then(|| format!("{path}: none of {rule}")),
            "type" => {
                let fits = match rule.as_str().unwrap() {
                    "object" => value.is_object(),
                    "array" => value.is_array(),
                    "string" => value.is_string(),
                    "number" => value.is_number(),
                    "integer" => value.as_f64().is_some_and(|v| v.fract() == 0.0),
                    "boolean" => value.is_boolean(),
                    other => panic!("type {other}"),
                };
                if fits { None } else { at(format!("{value} is not of type {rule}")) }
            }
            "minimum" if value.as_f64() < number(key) => at(format!("{value} is less than {rule}")),
            "exclusiveMinimum" if value.as_f64() <= number(key) => at(format!("{value} is not more than {rule}")),
            "maximum" if value.as_f64() > number(key) => at(format!("{value} is more than {rule}")),
            "exclusiveMaximum" if value.as_f64() >= number(key) => at(format!("{value} is not less than {rule}")),
            "minimum" | "exclusiveMinimum" | "maximum" | "exclusiveMaximum" => None,
            "minItems" | "maxItems" => {
                let fits = value.as_array().is_none_or(|a| a.len() as u64 == rule.as_u64().unwrap());
                if fits { None } else { at(format!("not {rule} items")) }
            }
            "items" => {
                let items = value.as_array().into_iter().flatten().enumerate();
                items.filter_map(|(i, item)| misfit(root, rule, item, &format!("{path}[{i}]"))).next()
            }
            "required" => {
                let mut keys = rule.as_array().unwrap().iter().map(|k| k.as_str().unwrap());
                keys.find(|k| value.get(k).is_none()).and_then(|k| at(format!("{k} is missing")))
            }
            "properties" => {
                let mut pairs = rule.as_object().unwrap().iter();
                pairs.find_map(|(k, s)| misfit(root, s, value.get(k)?, &format!("{path}.{k}")))
            }
            "additionalProperties" => {
                let known = schema.get("properties").and_then(Json::as_object);
                let mut pairs = value.as_object().into_iter().flatten();
                pairs.find_map(|(k, v)| match rule {
                    _ if known.is_some_and(|p| p.contains_key(k)) => None,
                    Json::Bool(false) => at(format!("{k} is not allowed")),
                    rule => misfit(root, rule, v, &format!("{path}.{k}")),
                })
            }
            "minProperties" => {
                let fits = value.as_object().is_none_or(|o| o.len() as u64 >= rule.as_u64().unwrap());
                if fits { None } else { at("too few properties".into()) }
            }
            "pattern" => {
                assert_eq!(rule, "^#([0-9a-fA-F]{3}|[0-9a-fA-F]{6})$");
                let fits = value.as_str().is_none_or(|s| matches!(s.len(), 4 | 7) && s.starts_with('#'));
                if fits { None } else { at(format!("{value} is not #rrggbb or #rgb")) }
            }
            "$schema" | "$defs" | "title" | "description" | "default" => None,
            other => panic!("the schema uses {other}"),
        };
        if fault.is_some() {
            return fault;
        }
    }
    None
}

fn check(text: &str) -> Option<String> {
    let schema: Json = serde_json::from_str(&schema()).unwrap();
    misfit(&schema, &schema, &serde_json::from_str(text).unwrap(), "scene")
}

#[test]
fn built_in_scenes_conform_to_the_schema() {
    for scene in builtin_scenes() {
        let parsed = SceneDesc::parse("scene.toml", scene.text.as_bytes(), &NoAssets);
        assert_eq!(parsed.faults(), []);
        assert_eq!(check(&parsed.desc.to_json()), None, "{}", scene.name);
    }
}

#[test]
fn the_schema_refuses_what_the_reader_refuses() {
    for text in [
        r#"{ "spheres": [] }"#,
        r#"{ "sphere": [{ "center": [0, 0, 0] }] }"#,
        r#"{ "sphere": [{ "center": [0, 0], "radius": 1 }] }"#,
        r#"{ "sphere": [{ "center": [0, 0, 0], "radius": 0 }] }"#,
        r#"{ "sphere": [{ "center": [0, 0, 0], "radius": 1, "uv": "angle" }] }"#,
        r#"{ "render": { "width": 65537 } }"#,
        r#"{ "render": { "width": 1.5 } }"#,
        r#"{ "light": { "spot": [{ "position": [0, 0, 0], "cone_deg": 190 }] } }"#,
        r#"{ "material": { "phong": { "red": { "diffuse": "reddish" } } } }"#,
        r#"{ "material": { "pong": {} } }"#,
        r#"{ "light": { "point": [{ "position": [0, 0, 0], "transform": [] }] } }"#,
        r#"{ "light": { "point": [{ "position": [0, 0, 0], "transform": { "turn": 1 } }] } }"#,
        r#"{ "light": { "point": [{ "position": [0, 0, 0], "transform": { "keys": [{ "scale": 1 }] } }] } }"#,
    ] {
        assert!(check(text).is_some(), "{text}");
    }
    for text in [
        r##"{ "light": { "point": [{ "position": [0, 0, 0], "transform": { "scale": 2,
            "keys": [{ "time": 1, "rotate_deg": [0, 1e9, 0] }] } }] } }"##,
        r##"{ "$schema": "x", "include": ["a.toml"], "camera": {
            "a": { "position": [0, 0, 1] }, "b": { "position": [0, 0, 1] } } }"##,
        r##"{ "material": { "phong": { "red": {
            "diffuse": { "texture": "t", "factor": "#ff0000" }, "shininess": 3 } } } }"##,
        r##"{ "material": { "phong": { "red": { "diffuse": "#f00", "specular": "darkred" } } } }"##,
    ] {
        assert_eq!(check(text), None, "{text}");
    }
}

#[test]
fn every_example_of_the_reference_is_read() {
    let page = reference();
    let mut examples = 0;
    for block in page.split("```toml\n").skip(1) {
        let text = block.split("```").next().unwrap();
        let parsed = SceneDesc::parse("example.toml", text.as_bytes(), &NoAssets);
        assert_eq!(parsed.faults(), [], "{text}");
        assert_eq!(check(&parsed.desc.to_json()), None, "{text}");
        examples += 1;
    }
    assert_eq!(examples, 32, "one for each table");
    let titles: Vec<&str> = page.lines().filter(|line| line.starts_with("## ")).collect();
    for (i, title) in titles.iter().enumerate() {
        assert!(!titles[..i].contains(title), "{title} is there twice");
    }
    for word in [
        "`cone_deg`",
        "`\"equirectangular\"`",
        "output_resolution",
        "## Light: `[[light.rectangle]]`",
        "## Light: `[[light.disk]]`",
        "## Light: `[[light.sphere]]`",
        "## Table: transform key",
        "| [a table](#table-transform) |",
    ] {
        assert!(page.contains(word), "{word}");
    }
}
