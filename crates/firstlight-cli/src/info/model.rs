//! What a model by itself holds, and what is odd about it.

use std::fmt::Write;

use firstlight::{MeshReport, ModelMesh, ModelReport, printable};
use serde_json::{Value, json};

use super::{bounds, list_of, pairs, word};
use crate::args::InfoArgs;
use crate::input::Input;
use crate::report::{Failure, answer, show_diagnostics};

/// Parts of an OBJ file, meshes, pictures and so on are listed up to this number in text; JSON has all of them.
const MOST_LISTED: usize = 50;

/// Says what a model holds.
///
/// # Errors
/// It cannot be shown; under `--strict` also what is a warning.
pub(super) fn answer_model(input: &mut Input, args: &InfoArgs) -> Result<(), Failure> {
    if args.time.is_some() && !input.is_gltf() {
        return Err(Failure::Usage(format!("--time has no meaning for a model, and {} is one", input.name)));
    }
    input.show(args.time.is_some(), false);
    let report = input.model_report(args.time.unwrap_or(0.0))?;
    let mut said = report.warnings.clone();
    said.extend(input.faults_of_pictures(&report));
    if args.scene.reading.strict && !said.is_empty() {
        return Err(Failure::strict(said));
    }
    show_diagnostics(&said);
    show_diagnostics(&report.notes);
    let info = gather(&input.name, args.time, &report);
    answer(&if args.json { format!("{info:#}\n") } else { text(&info) })
}

/// Everything there is to say, as JSON; the text is made from it.
fn gather(name: &str, time: Option<f64>, report: &ModelReport) -> Value {
    let (total, counts) = (report.total(), &report.counts);
    let bytes = |bytes: Option<u64>| json!(bytes);
    let all: u64 = report.files.iter().filter_map(|file| file.bytes).sum();
    let pictures: u64 = report.pictures.iter().filter_map(|picture| picture.bytes).sum();
    let mut info = json!({
        "model": name,
        "format": report.format,
        "version": report.version,
        "generator": report.generator,
        "copyright": report.copyright,
        "file_bytes": bytes(report.files.first().and_then(|file| file.bytes)),
        "all_file_bytes": all,
        "picture_bytes": pictures,
        "time": time,
        "bounds": report.bounds.map(bounds),
        "shown_triangles": report.shown_triangles(),
        "closed": !report.meshes.is_empty() && report.meshes.iter().all(|mesh| mesh.report.is_closed()),
        "radii": report.meshes.iter().any(|mesh| mesh.has_radii),
        "variants": report.variants,
        "cameras": report.cameras,
        "odd": report.oddities(),
    });
    info["counts"] = json!({
        "scenes": counts.scenes,
        "nodes": counts.nodes,
        "meshes": counts.meshes,
        "primitives": counts.primitives,
        "materials": counts.materials,
        "pictures": report.pictures.len(),
        "animations": report.animations.len(),
        "variants": report.variants.len(),
        "skins": counts.skins,
        "joints": counts.joints,
        "morph_targets": counts.morph_targets,
        "cameras": counts.cameras,
        "lights": counts.lights,
    });
    info["files"] = list_of(&report.files, |file| json!({ "file": file.file, "bytes": bytes(file.bytes) }));
    info["extensions"] = list_of(
        &report.extensions,
        |extension| json!({ "name": extension.name, "required": extension.required, "read": extension.read }),
    );
    info["animations"] = list_of(
        &report.animations,
        |animation| json!({ "name": animation.name, "seconds": shortest(animation.seconds) }),
    );
    info["lights"] = list_of(&report.lights, |(kind, name)| json!({ "kind": kind, "name": name }));
    info["materials"] = list_of(&report.materials, |material| json!({ "name": material.name, "used": material.used }));
    info["pictures"] = list_of(&report.pictures, |picture| {
        json!({
            "file": picture.file,
            "size": picture.size,
            "bytes": bytes(picture.bytes),
            "uses": picture.uses,
            "fault": picture.fault,
        })
    });
    info["meshes"] = list_of(&report.meshes, of_mesh);
    facts(&mut info, &total);
    info
}

/// Adds the numbers of a [`MeshReport`], of one mesh or the sum of all, to the JSON object `info`.
fn facts(info: &mut Value, report: &MeshReport) {
    for (key, value) in [
        ("vertices", json!(report.vertices)),
        ("positions", json!(report.positions)),
        ("triangles", json!(report.triangles)),
        ("boundary_edges", json!(report.boundary_edges)),
        ("non_manifold_edges", json!(report.non_manifold_edges)),
        ("turned_edges", json!(report.turned_edges)),
        ("degenerate_triangles", json!(report.degenerate_triangles)),
        ("duplicate_triangles", json!(report.duplicate_triangles)),
        ("non_finite_triangles", json!(report.non_finite_triangles)),
        ("non_finite_vertices", json!(report.non_finite_vertices)),
        ("unused_vertices", json!(report.unused_vertices)),
        ("normals", json!(report.has_normals)),
        ("bad_normals", json!(report.bad_normals)),
        ("non_unit_normals", json!(report.non_unit_normals)),
        ("uv_sets", json!(report.uv_sets)),
        ("colors", json!(report.has_colors)),
        ("memory_bytes", json!(report.bytes)),
    ] {
        info[key] = value;
    }
}

fn of_mesh(mesh: &ModelMesh) -> Value {
    let parts = list_of(
        &mesh.parts,
        |part| json!({ "object": part.object, "group": part.group, "triangles": part.triangles.len() }),
    );
    let mut info = json!({
        "name": mesh.name,
        "file": mesh.file,
        "placed": mesh.placed,
        "mirrored": mesh.mirrored,
        "bounds": mesh.report.bounds.map(bounds),
        "closed": mesh.report.is_closed(),
        "single_sided": mesh.single_sided,
        "lacks_uv": mesh.lacks_uv,
        "radii": mesh.has_radii,
        "materials": mesh.materials,
        "material_files": mesh.material_files,
        "parts": parts,
        "notes": mesh.notes,
    });
    facts(&mut info, &mesh.report);
    info
}

/// Seconds that were kept in 32 bits, as they were written.
fn shortest(seconds: f64) -> f64 {
    if f64::from(seconds as f32) == seconds { super::shortest(seconds as f32) } else { seconds }
}

/// The same for people: a line for each thing.
fn text(info: &Value) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // A String takes every write
        let _ = writeln!(text, "{name:<10} {value}");
    };
    let yes = |value: &Value, yes: &str, no: &str| (if *value == true { yes } else { no }).to_owned();
    let said =
        |key: &str, before: &str| info[key].as_str().map_or(String::new(), |_| format!("{before}{}", word(&info[key])));
    line("model", word(&info["model"]));
    line(
        "format",
        word(&info["format"]) + &said("version", " ") + &said("generator", ", by ") + &said("copyright", ", "),
    );
    let files = info["files"].as_array().map_or(&[][..], Vec::as_slice);
    line("file", format!("{} bytes", info["file_bytes"]));
    for file in files.iter().skip(1) {
        let bytes = file["bytes"].as_u64().map_or("missing".to_owned(), |bytes| format!("{bytes} bytes"));
        line("", format!("{}, {bytes}", word(&file["file"])));
    }
    line("holds", held(&info["counts"]));
    line("vertices", format!("{}, at {} positions", info["vertices"], info["positions"]));
    line("triangles", info["triangles"].to_string());
    if info["shown_triangles"] != info["triangles"] {
        line("", format!("{} as often as meshes are placed", info["shown_triangles"]));
    }
    if !info["time"].is_null() {
        line("time", format!("{} s", word(&info["time"])));
    }
    match &info["bounds"] {
        Value::Null => line("bounds", "none: there are no finite vertices".into()),
        bounds => line("bounds", pairs(bounds)),
    }
    let open = ["boundary_edges", "non_manifold_edges", "turned_edges"].map(|key| info[key].to_string());
    let edges = format!("{} on a boundary, {} of more than two faces, {} turned", open[0], open[1], open[2]);
    line("surface", yes(&info["closed"], "closed", "not closed"));
    line("edges", edges);
    let faces =
        ["degenerate_triangles", "duplicate_triangles", "non_finite_triangles"].map(|key| info[key].to_string());
    line("faces", format!("{} without area, {} twice, {} not finite", faces[0], faces[1], faces[2]));
    line("", format!("{} vertices not finite, {} unused", info["non_finite_vertices"], info["unused_vertices"]));
    let some = |key: &str, what: &str| match info[key].as_u64() {
        None | Some(0) => String::new(),
        Some(count) => format!(", {count} {what}"),
    };
    let off = some("bad_normals", "of no direction") + &some("non_unit_normals", "not of length 1");
    line("normals", yes(&info["normals"], "given", "none") + &off);
    line("uv", format!("{} sets", info["uv_sets"]));
    line("colors", yes(&info["colors"], "given", "none"));
    lists(info, &mut line);
    line("in memory", format!("{} bytes, without the tree", info["memory_bytes"]));
    match info["odd"].as_array().map_or(&[][..], Vec::as_slice) {
        [] => line("odd", "nothing".into()),
        odd => odd.iter().for_each(|odd| line("odd", word(odd))),
    }
    text
}

/// What is listed thing by thing.
fn lists(info: &Value, line: &mut impl FnMut(&str, String)) {
    let listed = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let mut list = |name: &str, things: Vec<String>| {
        let more = things.len().saturating_sub(MOST_LISTED);
        things.into_iter().take(MOST_LISTED).for_each(|thing| line(name, thing));
        if more > 0 {
            line(name, format!("and {more} more: --json has all"));
        }
    };
    let meshes = listed(&info["meshes"]);
    if info["format"] == "glTF" || info["format"] == "GLB" {
        let mesh = |mesh: &Value| {
            let closed = if mesh["closed"] == true { "closed" } else { "not closed" };
            let (name, file) = (word(&mesh["name"]), word(&mesh["file"]));
            let address = file.rsplit('#').next().unwrap_or_default();
            let placed = match mesh["placed"].as_u64() {
                Some(1) | None => String::new(),
                Some(times) => format!(", {times} times"),
            };
            format!("{name}, {address}{placed}, {} triangles, {closed}", mesh["triangles"])
        };
        list("mesh", meshes.iter().map(mesh).collect());
    }
    let material = |material: &Value| {
        let unused = if material["used"] == true { "" } else { ", not used" };
        word(&material["name"]) + unused
    };
    list("material", listed(&info["materials"]).iter().map(material).collect());
    let picture = |picture: &Value| {
        let uses = listed(&picture["uses"]).iter().map(word).collect::<Vec<_>>().join(", ");
        let uses = if uses.is_empty() { "not used".to_owned() } else { format!("for {uses}") };
        let what = match (&picture["fault"], picture["size"].as_array().map(Vec::as_slice)) {
            (Value::String(fault), _) => printable(fault).into_owned(),
            (_, Some([width, height])) => format!("{width} x {height}"),
            _ => String::new(),
        };
        format!("{}, {what}, {uses}", word(&picture["file"]))
    };
    list("picture", listed(&info["pictures"]).iter().map(picture).collect());
    let extension = |extension: &Value| {
        let required = if extension["required"] == true { ", required" } else { "" };
        let read = if extension["read"] == true { "read" } else { "ignored" };
        format!("{}, {read}{required}", word(&extension["name"]))
    };
    list("extension", listed(&info["extensions"]).iter().map(extension).collect());
    let animations = listed(&info["animations"]);
    let animation = |(i, animation): (usize, &Value)| {
        let name = Some(word(&animation["name"])).filter(|name| !name.is_empty()).unwrap_or_else(|| i.to_string());
        format!("{name}, {} s", word(&animation["seconds"]))
    };
    list("animation", animations.iter().enumerate().map(animation).collect());
    for (name, key) in [("variant", "variants"), ("camera", "cameras"), ("light", "lights")] {
        list(name, listed(&info[key]).iter().map(word).collect());
    }
    for key in ["parts", "material_files", "notes"] {
        list(key, meshes.iter().flat_map(|mesh| listed(&mesh[key])).map(|thing| word(&thing)).collect());
    }
}

/// `3 nodes, 1 mesh`: what there is.
fn held(counts: &Value) -> String {
    let words = [
        ("scenes", "scene"),
        ("nodes", "node"),
        ("meshes", "mesh"),
        ("primitives", "primitive"),
        ("materials", "material"),
        ("pictures", "picture"),
        ("animations", "animation"),
        ("variants", "variant"),
        ("skins", "skin"),
        ("joints", "joint"),
        ("morph_targets", "morph target"),
        ("cameras", "camera"),
        ("lights", "light"),
    ];
    let held = words.iter().filter_map(|(many, one)| match counts[many].as_u64()? {
        0 => None,
        1 => Some(format!("1 {one}")),
        count => Some(format!("{count} {}", many.replace('_', " "))),
    });
    held.collect::<Vec<_>>().join(", ")
}
