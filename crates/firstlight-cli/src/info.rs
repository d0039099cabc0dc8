//! `firstlight info`: what a scene holds.

use std::fmt::Write;

use firstlight::{DisplayEncoding, Frame, Projection, Scene, SceneDesc};
use serde_json::{Value, json};

use crate::args::InfoArgs;
use crate::input;
use crate::report::{Failure, answer, show_diagnostics};

/// Says what a scene holds.
///
/// # Errors
/// The scene cannot be had, or has faults.
pub fn run(args: &InfoArgs) -> Result<(), Failure> {
    let input = input::read(&args.scene.scene, &args.scene.reading)?;
    let compiled = input.compile(args.time.unwrap_or(0.0))?;
    show_diagnostics(&compiled.warnings);
    let info = gather(&input.name, &input.parsed.desc, &compiled.scene);
    answer(&if args.json { format!("{info:#}\n") } else { text(&info) })
}

/// Everything there is to say, as JSON; the text is made from it.
fn gather(name: &str, desc: &SceneDesc, scene: &Scene) -> Value {
    let summary = scene.summary();
    let render = &desc.render;
    let display = match render.display {
        DisplayEncoding::Srgb => json!({ "encoding": "srgb", "exposure": render.exposure }),
        DisplayEncoding::Gamma => json!({ "encoding": "gamma", "gamma": render.gamma, "exposure": render.exposure }),
        DisplayEncoding::Linear => json!({ "encoding": "linear", "exposure": render.exposure }),
    };
    json!({
        "scene": name,
        "hash": scene.hash(),
        "picture": {
            "width": scene.width(),
            "height": scene.height(),
            "antialiasing": render.antialiasing,
            "transparent": render.transparent,
            "display": display,
        },
        "time": scene.time(),
        "camera": camera(desc, scene),
        "cameras": desc.cameras.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        "shapes": { "sphere": summary.spheres, "parallelogram": summary.parallelograms },
        "lights": list_of(&summary.lights, |(kind, name, samples)| {
            json!({ "kind": kind, "name": name, "samples": samples })
        }),
        "materials": list_of(&summary.materials, |(name, kind)| json!({ "name": name, "kind": kind })),
        "textures": list_of(&summary.textures, |(name, kind, size)| json!({ "name": name, "kind": kind, "size": size })),
        "texture_bytes": summary.texture_bytes,
        "bounds": summary.bounds.map(|[min, max]| json!({ "min": min.map(shortest), "max": max.map(shortest) })),
    })
}

fn list_of<T>(things: &[T], say: impl Fn(&T) -> Value) -> Value {
    things.iter().map(say).collect()
}

/// The number that the shortest decimal form of `n` means: 0.1, not 0.10000000149.
fn shortest(n: f32) -> f64 {
    n.to_string().parse().unwrap_or_else(|_| f64::from(n))
}

/// The camera that renders, or null where there is none.
fn camera(desc: &SceneDesc, scene: &Scene) -> Value {
    let named = |name: &String| desc.cameras.iter().find(|(known, _)| known == name);
    let chosen = desc.render.camera.as_ref().map_or(desc.cameras.first(), named);
    chosen.map_or(Value::Null, |(name, camera)| {
        let mut value =
            json!({ "name": name, "position": camera.position, "look_at": camera.look_at, "up": camera.up });
        if camera.transform.is_some() {
            // Where that has brought it
            let Frame { position, forward, up, .. } = scene.camera().frame();
            let list = |v: &firstlight::Vec3| json!(v.to_array().map(shortest));
            value = json!({ "name": name, "position": list(position), "forward": list(forward), "up": list(up) });
        }
        match (camera.projection, camera.focal_length_mm) {
            (Projection::Orthographic, _) => {
                value["projection"] = json!(camera.projection.name());
                value["height"] = json!(camera.height);
            }
            (Projection::Perspective, Some(length)) => {
                value["focal_length_mm"] = json!(length);
                value["sensor_height_mm"] = json!(camera.sensor_height_mm.unwrap_or(24.0));
            }
            (Projection::Perspective, None) => value["fov_y_deg"] = json!(camera.fov_y_deg.unwrap_or(45.0)),
        }
        if camera.shift != [0.0; 2] {
            value["shift"] = json!(camera.shift);
        }
        value
    })
}

/// The same for people: a line for each thing.
fn text(info: &Value) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // A String takes every write
        let _ = writeln!(text, "{name:<10} {value}");
    };
    let picture = &info["picture"];
    let n = &picture["antialiasing"];
    line("scene", word(&info["scene"]));
    line("hash", word(&info["hash"]));
    line("picture", format!("{} x {} pixels, {n} x {n} camera rays in each", picture["width"], picture["height"]));
    line("display", pairs(&picture["display"]));
    if let Some(time) = info["time"].as_f64() {
        line("time", format!("{time} s; the scene changes with time"));
    }
    match &info["camera"] {
        Value::Null => line("camera", "none".into()),
        camera => line("camera", pairs(camera)),
    }
    let others = info["cameras"].as_array().map_or(0, Vec::len).saturating_sub(1);
    if others > 0 {
        line("", format!("and {others} more: --camera chooses from {}", list(&info["cameras"])));
    }
    line("shapes", pairs(&info["shapes"]));
    for group in ["lights", "materials", "textures"] {
        let things = info[group].as_array().map(Vec::as_slice).unwrap_or_default();
        line(group, things.len().to_string());
        for thing in things {
            line("", pairs(thing));
        }
    }
    line("in memory", format!("{} bytes of textures", info["texture_bytes"]));
    match &info["bounds"] {
        Value::Null => line("bounds", "none: there are no shapes".into()),
        bounds => line("bounds", pairs(bounds)),
    }
    text
}

/// `kind rectangle, samples 400`: what is not null or empty.
fn pairs(object: &Value) -> String {
    let said = |value: &Value| !value.is_null() && value.as_str() != Some("");
    let pairs = object.as_object().into_iter().flatten().filter(|(_, value)| said(value));
    pairs.map(|(key, value)| format!("{key} {}", word(value))).collect::<Vec<_>>().join(", ")
}

/// A string without its quotes (and without line ends or escapes of its own), a list as `(1, 2, 3)`, an object as pairs.
fn word(value: &Value) -> String {
    match value {
        Value::String(text) => text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect(),
        Value::Array(_) => format!("({})", list(value)),
        // 10, not 10.0
        Value::Number(number) => number.as_f64().map_or_else(|| number.to_string(), |n| n.to_string()),
        Value::Object(_) => pairs(value),
        Value::Null | Value::Bool(_) => value.to_string(),
    }
}

fn list(value: &Value) -> String {
    value.as_array().into_iter().flatten().map(word).collect::<Vec<_>>().join(", ")
}
