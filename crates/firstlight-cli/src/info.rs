//! `firstlight info`: what a scene, a model or a picture holds.

mod model;
mod picture;

use std::fmt::Write;

use firstlight::{
    CameraDesc, Compiled, DVec3, DisplayEncoding, Frame, Projection, SamplesDesc, Scene, SceneDesc, printable,
};
use serde_json::{Map, Value, json};

use crate::args::{InfoArgs, ReadingArgs};
use crate::input;
use crate::report::{Failure, answer, show_diagnostics, shown};

/// Says what a scene, a model or a picture holds.
///
/// # Errors
/// It cannot be had, or has faults.
pub fn run(args: &InfoArgs) -> Result<(), Failure> {
    let file = &args.scene.scene;
    if picture::is_picture(file) {
        refuse_options_of_scenes(args)?;
        return picture::answer_picture(file, args.json);
    }
    let mut input = input::read(&args.scene.scene, &args.scene.reading)?;
    if input.studio.is_some() {
        return model::answer_model(&mut input, args);
    }
    let compiled = input.compile(args.time.unwrap_or(0.0), false)?;
    show_diagnostics(&compiled.warnings);
    show_diagnostics(&compiled.advice);
    input.tell_added(&compiled);
    let info = gather(&input.name, &input.parsed.desc, &compiled);
    answer(&if args.json { format!("{info:#}\n") } else { text(&info) })
}

/// Sees that options of scenes and models are not said of a picture.
///
/// # Errors
/// One is.
fn refuse_options_of_scenes(args: &InfoArgs) -> Result<(), Failure> {
    let ReadingArgs { strict, allow_dir, texture_memory, model } = &args.scene.reading;
    let said = [
        ("--strict", *strict),
        ("--allow-dir", !allow_dir.is_empty()),
        ("--texture-memory", texture_memory.is_some()),
        ("--smooth", model.smooth.is_some()),
        ("--up", model.up.is_some()),
        ("--time", args.time.is_some()),
    ];
    match said.into_iter().find(|(_, said)| *said) {
        Some((option, _)) => {
            let name = shown(&args.scene.scene);
            Err(Failure::Usage(format!("{option} has no meaning for a picture, and {name} is one")))
        }
        None => Ok(()),
    }
}

/// Everything there is to say, as JSON; the text is made from it.
fn gather(name: &str, desc: &SceneDesc, compiled: &Compiled) -> Value {
    let (scene, added) = (&compiled.scene, &compiled.added);
    let summary = scene.summary();
    let render = &desc.render;
    let display = match render.display {
        DisplayEncoding::Srgb => json!({ "encoding": "srgb", "exposure": render.exposure }),
        DisplayEncoding::Gamma => json!({ "encoding": "gamma", "gamma": render.gamma, "exposure": render.exposure }),
        DisplayEncoding::Linear => json!({ "encoding": "linear", "exposure": render.exposure }),
        DisplayEncoding::Neutral => json!({ "encoding": "neutral", "exposure": render.exposure }),
    };
    json!({
        "scene": name,
        "hash": scene.hash(),
        "picture": {
            "width": scene.width(),
            "height": scene.height(),
            "antialiasing": render.antialiasing,
            "tolerance": render.tolerance,
            "transparent": render.transparent,
            "display": display,
        },
        "time": scene.time(),
        "camera": match &added.camera {
            Some(found) => found_camera(found, scene),
            None => camera(desc, scene),
        },
        "cameras": desc.cameras.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        "shapes": summary.shapes.iter().map(|(kind, count)| ((*kind).to_owned(), json!(count))).collect::<Map<_, _>>(),
        "groups": list_of(&summary.groups, |(name, shapes)| json!({ "name": name, "shapes": shapes })),
        "surfaces": summary.surfaces,
        "placed": summary.placed,
        "triangles": summary.triangles,
        "points": summary.points,
        "geometry_bytes": summary.geometry_bytes[0],
        "tree_bytes": summary.geometry_bytes[1],
        "lights": list_of(&summary.lights, |(kind, name, samples)| {
            let samples = match samples {
                SamplesDesc::Exact => json!("exact"),
                SamplesDesc::Count(count) => json!(count),
            };
            json!({ "kind": kind, "name": name, "samples": samples })
        }),
        "materials": list_of(&summary.materials, |(name, kind)| json!({ "name": name, "kind": kind })),
        "textures": list_of(
            &summary.textures,
            |(name, kind, size)| json!({ "name": name, "kind": kind, "size": size }),
        ),
        "texture_bytes": summary.texture_bytes,
        "bounds": summary.bounds.map(bounds),
    })
}

fn list_of<T>(things: &[T], say: impl Fn(&T) -> Value) -> Value {
    things.iter().map(say).collect()
}

/// The number that the shortest decimal form of `n` means: 0.1, not 0.10000000149.
fn shortest(n: f32) -> f64 {
    n.to_string().parse().unwrap_or_else(|_| f64::from(n))
}

fn bounds([min, max]: [[f64; 3]; 2]) -> Value {
    let size = (0..3).map(|i| max[i] - min[i]).fold(0.0, f64::max);
    json!({ "min": min.map(|c| coordinate(c, size)), "max": max.map(|c| coordinate(c, size)) })
}

/// A coordinate, of which as much is known as 32 bits say of `size`.
fn coordinate(c: f64, size: f64) -> f64 {
    if c.abs() <= 64.0 * size {
        return shortest(c as f32);
    }
    // Far from 0: to the ten-millionth part of the size
    let decimals = (7.0 - size.max(1e-9).log10().ceil()).clamp(0.0, 15.0) as usize;
    format!("{c:.decimals$}").parse().unwrap_or(c)
}

/// The camera that renders, or null where there is none.
fn camera(desc: &SceneDesc, scene: &Scene) -> Value {
    let named = |name: &String| desc.cameras.iter().find(|(known, _)| known == name);
    let chosen = desc.render.camera.as_ref().map_or(desc.cameras.first(), named);
    chosen.map_or(Value::Null, |(name, camera)| of_camera(name, camera, scene))
}

/// The camera that was found for a scene without one.
fn found_camera(found: &CameraDesc, scene: &Scene) -> Value {
    let mut value = of_camera("", found, scene);
    value["found"] = json!(true);
    value
}

fn of_camera(name: &str, camera: &CameraDesc, scene: &Scene) -> Value {
    let mut value = json!({ "name": name, "position": camera.position, "look_at": camera.look_at, "up": camera.up });
    if camera.transform.is_some() {
        // Where that has brought it
        let Frame { position, forward, up, .. } = scene.camera().frame();
        let list = |v: &firstlight::Vec3| json!(v.to_array().map(shortest));
        let position = position.to_array().map(|c| if scene.origin() == DVec3::ZERO { shortest(c as f32) } else { c });
        value = json!({ "name": name, "position": position, "forward": list(forward), "up": list(up) });
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
    match pairs(&info["shapes"]) {
        shapes if shapes.is_empty() => line("shapes", "none".into()),
        shapes => line("shapes", shapes),
    }
    for group in info["groups"].as_array().into_iter().flatten() {
        line("group", pairs(group));
    }
    line("surfaces", format!("{} ids of shapes, {} things placed", info["surfaces"], info["placed"]));
    if info["triangles"] != 0 || info["points"] != 0 {
        line("geometry", format!("{} triangles, {} points", info["triangles"], info["points"]));
    }
    for group in ["lights", "materials", "textures"] {
        let things = info[group].as_array().map(Vec::as_slice).unwrap_or_default();
        line(group, things.len().to_string());
        for thing in things {
            line("", pairs(thing));
        }
    }
    let (textures, geometry, trees) = (&info["texture_bytes"], &info["geometry_bytes"], &info["tree_bytes"]);
    line("in memory", format!("{textures} bytes of textures, {geometry} of meshes and points, {trees} of trees"));
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

/// A string without its quotes (what could disturb a terminal is escaped), a list as `(1, 2, 3)`, an object as pairs.
fn word(value: &Value) -> String {
    match value {
        Value::String(text) => printable(text).into_owned(),
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
