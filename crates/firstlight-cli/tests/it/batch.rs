//! Many models in one call: folders, views, sizes, and the log of a run.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{Folder, Picture, SCENE, size_of};

/// A tetrahedron as a binary STL file, so many times as large.
fn stl(scale: f32) -> Vec<u8> {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0f32]];
    let mut bytes = vec![b'x'; 80];
    bytes.extend(4u32.to_le_bytes());
    for triangle in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
        bytes.extend([0; 12]);
        let numbers = triangle.into_iter().flat_map(|i: usize| corners[i].map(|c| c * scale));
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

/// A folder `set/` that holds models in subfolders, a text file, and models in hidden files and folders.
fn with_set() -> Folder {
    let folder = Folder::new();
    for name in ["set/chairs", "set/tables/old", "set/.cache", "empty/deep", "out"] {
        fs::create_dir_all(folder.path(name)).unwrap();
    }
    for name in ["set/chairs/a.stl", "set/chairs/b.STL", "set/tables/a.stl", "set/tables/old/c.stl"] {
        folder.put(name, stl(1.0));
    }
    for name in ["set/.cache/hidden.stl", "set/.hidden.stl"] {
        folder.put(name, stl(1.0));
    }
    folder.put("set/readme.txt", "no model");
    folder.put("set/scene.toml", SCENE);
    folder
}

/// The files below a folder, sorted, with `/` between.
fn below(folder: &Folder, within: &str) -> Vec<String> {
    let (mut found, mut folders) = (Vec::new(), vec![folder.path(within)]);
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { folders.push(path) } else { found.push(path) }
        }
    }
    let own = folder.path(within);
    let name = |path: &Path| path.strip_prefix(&own).unwrap().to_string_lossy().replace('\\', "/");
    let mut names: Vec<String> = found.iter().map(|path| name(path)).collect();
    names.sort();
    names
}

/// The lines of a summary.
fn lines(text: &[u8]) -> Vec<Value> {
    let text = std::str::from_utf8(text).unwrap();
    assert!(text.is_empty() || text.ends_with('\n'), "{text}");
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

const TINY: &str = "--size 8 --aa 1";

#[test]
fn a_folder_stands_for_the_models_in_it() {
    let folder = with_set();
    let run = folder.run(&format!("render set -o out/{{parent}}-{{stem}}.png {TINY}")).done();
    let order = ["[1 of 4] set/chairs/a.stl", "[2 of 4] set/chairs/b.STL", "[3 of 4] set/tables/a.stl", "old/c.stl"];
    run.says(&order);
    assert_eq!(below(&folder, "out"), ["chairs-a.png", "chairs-b.png", "old-c.png", "tables-a.png"]);
    // Beside files, from within, and with a slash at its end
    let inside = folder.command(["render", ".", "../old/c.stl", "-o", "../../out/{parent}_{name}.exr", "--size", "8"]);
    let mut inside = inside;
    assert!(inside.current_dir(folder.path("set/chairs")).output().unwrap().status.code() == Some(1));
    folder.run(&format!("render set/chairs/ set/tables/old/c.stl -o out/{{stem}}.hdr {TINY}")).done();
    let names = below(&folder, "out");
    assert!(names.contains(&"chairs_a.stl.exr".into()) && names.contains(&"chairs_b.STL.exr".into()), "{names:?}");
    assert!(names.contains(&"c.hdr".into()), "{names:?}");
}

#[test]
fn the_folders_of_a_set_are_made_anew() {
    let folder = with_set();
    folder.run(&format!("render set set/tables/a.stl -o out/{{folder}}/{{stem}}.png {TINY}")).done();
    let set = ["chairs/a.png", "chairs/b.png", "set/tables/a.png", "tables/a.png", "tables/old/c.png"];
    assert_eq!(below(&folder, "out"), set);
    // Above the folder of the outputs nothing is written
    fs::create_dir(folder.path("two")).unwrap();
    let up = format!("render ./set/tables/ set/../set/chairs/a.stl -o two/{{folder}}/{{name}}.png {TINY}");
    folder.run(&up).done();
    assert_eq!(below(&folder, "two"), ["a.stl.png", "old/c.stl.png", "set/set/chairs/a.stl.png"]);
}

#[test]
fn a_folder_without_models_is_said_and_the_others_are_rendered() {
    let folder = with_set();
    let words = "empty: no file in this folder or below ends in .glb, .gltf, .obj, .ply, .stl";
    folder.run("render empty -o out/a.png").exits(1).says(&[words]);
    let run = folder.run(&format!("render empty set/chairs -o out/{{stem}}.png {TINY}")).exits(1);
    run.says(&[words, "2 of 3 scenes were rendered; 1 could not be:\n  empty\n"]);
    assert_eq!(below(&folder, "out"), ["a.png", "b.png"]);
    // Other commands take no folders
    folder.run("check set").exits(1).says(&["set: is a folder; name a scene file or a model"]);
}

#[test]
#[cfg(unix)]
fn links_to_folders_are_not_followed() {
    let folder = with_set();
    std::os::unix::fs::symlink("..", folder.path("set/tables/up")).unwrap();
    std::os::unix::fs::symlink("a.stl", folder.path("set/tables/link.stl")).unwrap();
    let run = folder.run(&format!("render set/tables -o out/{{stem}}.png {TINY}")).done();
    run.says(&["3 scenes were rendered"]);
    assert_eq!(below(&folder, "out"), ["a.png", "c.png", "link.png"]);
}

#[test]
fn outputs_of_a_folder_are_told_apart_before_anything_is_rendered() {
    let folder = with_set();
    folder
        .run(&format!("render set -o out/{{stem}}.png {TINY}"))
        .exits(2)
        .says(&["set/chairs/a.stl and set/tables/a.stl would both be written to out/a.png"]);
    folder.run(&format!("render set -o out/{{name}}.png {TINY}")).exits(2).says(&["{parent} in the output's name"]);
    assert!(below(&folder, "out").is_empty());
    // Folders that a placeholder names are made, others are not
    folder.run(&format!("render set -o out/{{parent}}/x/{{name}}.png {TINY}")).done();
    assert_eq!(
        below(&folder, "out"),
        ["chairs/x/a.stl.png", "chairs/x/b.STL.png", "old/x/c.stl.png", "tables/x/a.stl.png"]
    );
    folder
        .run(&format!("render set -o nowhere/{{parent}}/{{name}}.png {TINY}"))
        .exits(1)
        .says(&["there is no folder", "nowhere"]);
    assert!(!folder.names().contains(&"nowhere".into()));
}

#[test]
fn a_summary_has_a_line_for_each_picture() {
    let folder = with_set();
    folder.put("set/chairs/broken.stl", "solid x\nfacet\n");
    let missing =
        SCENE.replace("[texture.checkerboard.tiles]\ncounts = [8, 8]", "[texture.image.tiles]\nfile = \"no.png\"");
    folder.put("textured.toml", missing);
    folder
        .run(&format!(
            "render set/chairs textured.toml empty -o out/{{stem}}.png -o out/{{stem}}.exr \
             --summary out/log.jsonl {TINY}"
        ))
        .exits(1);
    let log = lines(&folder.get("out/log.jsonl"));
    let text = |i: usize, key: &str| log[i][key].as_str().unwrap_or_default().to_owned();
    assert_eq!(log.len(), 5);
    assert_eq!(log.iter().map(|line| line["error"].is_null()).collect::<Vec<_>>(), [true, true, false, true, false]);
    assert_eq!(text(0, "input"), "set/chairs/a.stl");
    assert_eq!(log[0]["output"], serde_json::json!(["out/a.png", "out/a.exr"]));
    assert!(log[0]["seconds"].as_f64().unwrap() > 0.0 && log[0]["warnings"].as_array().unwrap().is_empty());
    assert_eq!(text(2, "input"), "set/chairs/broken.stl");
    assert!(text(2, "error").contains("broken.stl"), "{log:?}");
    assert!(log[3]["warnings"][0].as_str().unwrap().contains("no such file"), "{log:?}");
    assert!(text(4, "error").contains("no file in this folder"), "{log:?}");
    // Another run begins anew; every picture of a scene has its line, and standard output takes them too
    let run = folder.run(&format!("render set/chairs/a.stl --views front,top -o out/a.png --summary - --quiet {TINY}"));
    let log = lines(&run.done().stdout);
    let outputs: Vec<_> = log.iter().map(|line| line["output"][0].as_str().unwrap().to_owned()).collect();
    assert_eq!(outputs, ["out/a.front.png", "out/a.top.png"]);
    folder.run(&format!("render set/chairs/a.stl -o out/a.png --summary out/log.jsonl {TINY}")).done();
    assert_eq!(lines(&folder.get("out/log.jsonl")).len(), 1);
}

#[test]
fn a_summary_is_refused_where_it_would_replace_something() {
    let folder = with_set();
    for (options, words) in [
        ("--summary log.json", "must end in .jsonl"),
        ("--summary {stem}.jsonl", "{stem} stands for nothing: it is one file of all scenes"),
        ("--summary out/a.jsonl --stats=out/a.jsonl", "must end in .json"),
        ("--print-scene --summary a.jsonl", "cannot be used with"),
    ] {
        folder.run(&format!("render set/chairs/a.stl {TINY} {options}")).exits(2).says(&[words]);
    }
    folder.run(&format!("render set/chairs/a.stl {TINY} --summary nowhere/a.jsonl")).exits(1).says(&["no folder"]);
}

#[test]
#[cfg(unix)]
fn what_the_old_summary_shares_with_another_name_is_kept() {
    let folder = with_set();
    folder.put("out/kept.txt", "kept");
    fs::hard_link(folder.path("out/kept.txt"), folder.path("out/log.jsonl")).unwrap();
    folder.run(&format!("render set/chairs/a.stl -o out/a.png --summary out/log.jsonl {TINY}")).done();
    assert_eq!(folder.get("out/kept.txt"), b"kept");
    // Nor is anything replaced that a link of such a name leads to
    std::os::unix::fs::symlink("kept.txt", folder.path("out/link.jsonl")).unwrap();
    let run = folder.run(&format!("render set/chairs/a.stl -o out/a.png --summary out/link.jsonl {TINY}")).exits(2);
    run.says(&["out/link.jsonl leads to", "which is no .jsonl file"]);
    assert_eq!(folder.get("out/kept.txt"), b"kept");
    // A disk that is full ends no run, and is no success
    let run = folder.run(&format!("render set/chairs -o out/{{stem}}.png --summary /dev/full {TINY}"));
    run.exits(2).says(&["must end in .jsonl"]);
    std::os::unix::fs::symlink("/dev/full", folder.path("out/full.jsonl")).unwrap();
    let run = folder.run(&format!("render set/chairs -o out/{{name}}.exr --summary out/full.jsonl {TINY}")).exits(1);
    assert_eq!(run.stderr.matches("the rest of the run goes on without it").count(), 1, "{}", run.stderr);
    assert!(below(&folder, "out").contains(&"b.STL.exr".into()));
}

#[test]
fn each_of_several_views_is_the_picture_of_that_view() {
    let folder = with_set();
    let quick = "--size 20x14 --aa 2";
    folder.run(&format!("render set/chairs/a.stl --views front,side,top,iso -o out/a.png {quick}")).done();
    assert_eq!(below(&folder, "out"), ["a.front.png", "a.iso.png", "a.side.png", "a.top.png"]);
    for (name, view) in [("front", "front"), ("side", "right"), ("top", "top"), ("iso", "iso")] {
        folder.run(&format!("render set/chairs/a.stl --view {view} -o out/one.png {quick}")).done();
        assert_eq!(folder.get("out/one.png"), folder.get(&format!("out/a.{name}.png")), "{name}");
    }
    // In a place of their own in the name, of several models
    folder.run(&format!("render set/chairs --views top,three-quarter -o out/{{view}}_{{stem}}.exr {quick}")).done();
    let names = below(&folder, "out");
    for name in ["top_a.exr", "top_b.exr", "three-quarter_a.exr", "three-quarter_b.exr"] {
        assert!(names.contains(&name.into()), "{names:?}");
    }
    folder.run(&format!("render set/chairs/a.stl -o out/one.exr {quick}")).done();
    assert_eq!(folder.get("out/one.exr"), folder.get("out/three-quarter_a.exr"));
    folder.run("verify out/top_a.exr --scene set/chairs/a.stl").done();
}

#[test]
fn views_that_cannot_be_are_wrong_usage() {
    let folder = with_set();
    folder.put("scene.toml", SCENE);
    for (options, words) in [
        ("set/chairs/a.stl --views front,above", "names are needed"),
        ("set/chairs/a.stl --views front,front", "--views names front twice"),
        ("set/chairs/a.stl --views front,top -o -", "--views writes a file for each view"),
        ("set/chairs/a.stl --turntable 3 -o -", "--turntable writes a file for each view"),
        ("set/chairs/a.stl --views front --view top", "cannot be used with"),
        ("set/chairs/a.stl --views front --turntable 3", "cannot be used with"),
        ("set/chairs/a.stl --turntable 0", "a whole number from 1 to 10000"),
        ("set/chairs/a.stl --turntable 3 --frames 0..1", "cannot be used with"),
        ("set/chairs/a.stl -o out/{view}.png", "{view} is one of --views or of --turntable, and neither is given"),
        ("set/chairs/a.stl -o out/{size}.png --size 8", "{size} is one of several sizes"),
        ("set/chairs/a.stl --size 8,9,8", "--size names 8 twice"),
        ("set/chairs/a.stl --size 8,9 --print-scene", "--size names several"),
        ("set/chairs/a.stl --size 8,9 -o -", "--size writes a file for each size"),
        ("set/chairs/a.stl --views top,front --stats={view}.json", "one file of them all"),
        ("set/chairs/a.stl --size 8,8x8 -o {size}-{view}.png", "{view} is one of"),
        ("scene.toml --views front,top", "--views is for models and for scenes without a camera"),
        ("scene.toml --turntable 4", "--turntable is for models and for scenes without a camera"),
    ] {
        let line = format!("render {options}");
        let output = folder.command(line.split_whitespace()).output().unwrap();
        crate::common::ran(output).exits(2).says(&[words]);
    }
    assert!(below(&folder, "out").is_empty());
}

/// Columns and rows that are covered, the first and the last of each.
fn covered(picture: &Picture) -> [usize; 4] {
    let is_covered = |x: usize, y: usize| picture.data[(y * picture.width + x) * picture.bytes + picture.bytes - 1] > 0;
    let columns: Vec<usize> = (0..picture.width).filter(|x| (0..picture.height).any(|y| is_covered(*x, y))).collect();
    let rows: Vec<usize> = (0..picture.height).filter(|y| (0..picture.width).any(|x| is_covered(x, *y))).collect();
    [columns[0], columns[columns.len() - 1], rows[0], rows[rows.len() - 1]]
}

#[test]
fn a_turntable_keeps_its_distance() {
    let folder = Folder::new();
    // A long thing, which is narrow from two sides
    let box_of = |text: &str| format!("{text}[[box]]\ncenter = [1, 2, 3]\nsize = [4, 1, 0.5]\n");
    folder.put("long.toml", box_of("[render]\nwidth = 60\nheight = 60\ntransparent = true\nambient = 1\n"));
    let options = "--view 0,0 --turntable 8 --aa 1 --margin 0.1";
    folder.run(&format!("render long.toml {options} -o t_#.png")).done();
    let found: Vec<[usize; 4]> =
        (0..8).map(|i| covered(&Picture::decode(&folder.get(&format!("t_{i}.png"))))).collect();
    // From the front as large as the margin lets it be somewhere, in the middle everywhere
    let widths: Vec<usize> = found.iter().map(|[left, right, ..]| right - left + 1).collect();
    assert!(
        found.iter().all(|[left, right, top, bottom]| *left >= 5 && *right <= 54 && top + bottom == 59),
        "{found:?}"
    );
    assert!(*widths.iter().max().unwrap() >= 45, "{widths:?}");
    assert!(widths[2] < 12 && widths[6] < 12 && widths[0] == widths[4], "{widths:?}");
    // By itself each would be as large as it can be
    folder.run("render long.toml --view 90,0 --aa 1 --margin 0.1 -o side.png").done();
    let [left, right, ..] = covered(&Picture::decode(&folder.get("side.png")));
    assert!(right - left > widths[2], "{left} {right}");
    // Each is what its receipt says
    folder.run("verify t_3.png --scene long.toml").done();
    // With {view} the number is there; a part of them in a job array has the same bytes
    folder.run(&format!("render long.toml {options} -o part-{{view}}.png --shard 2/4")).done();
    assert_eq!(folder.get("part-0001.png"), folder.get("t_1.png"));
    assert_eq!(folder.get("part-0005.png"), folder.get("t_5.png"));
    assert!(!folder.names().contains(&"part-0002.png".into()));
}

#[test]
fn several_sizes_are_pictures_of_their_own() {
    let folder = with_set();
    folder.run("render set/chairs/a.stl --size 16,12x8 --aa 1 -o out/a.png --stats=out/s.json").done();
    assert_eq!(below(&folder, "out"), ["a.12x8.png", "a.16.png", "s.json"]);
    assert_eq!(size_of(&folder.path("out/a.16.png")), (16, 16));
    assert_eq!(size_of(&folder.path("out/a.12x8.png")), (12, 8));
    let stats: Value = serde_json::from_slice(&folder.get("out/s.json")).unwrap();
    assert!(stats["width"].is_null() && stats["frames"] == 2, "{stats}");
    for size in ["16", "12x8"] {
        folder.run(&format!("render set/chairs/a.stl --size {size} --aa 1 -o out/one.png")).done();
        assert_eq!(folder.get("out/one.png"), folder.get(&format!("out/a.{size}.png")), "{size}");
    }
    // A scene's own aspect ratio, and views in each
    folder.put("scene.toml", SCENE);
    folder.run("render scene.toml --size 12,6 --aa 1 --samples 4 -o out/{size}.png").done();
    assert_eq!((size_of(&folder.path("out/12.png")), size_of(&folder.path("out/6.png"))), ((12, 8), (6, 4)));
    folder.run("render set/chairs/a.stl --size 8,4 --views front,top --aa 1 -o out/{view}-{size}.exr").done();
    let names = below(&folder, "out");
    assert!(
        ["front-4.exr", "front-8.exr", "top-4.exr", "top-8.exr"].iter().all(|name| names.contains(&(*name).into()))
    );
    folder.run("render set/chairs/a.stl --size 8,4 --crop 0,0,5,5 -o out/no.png").exits(2).says(&["is not inside"]);
}

#[test]
fn a_model_of_which_nothing_is_seen_is_no_picture() {
    let folder = Folder::new();
    let ply = |rows: &str, faces: usize| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             element face {faces}\nproperty list uchar int vertex_indices\nend_header\n{rows}"
        )
    };
    // A face without an area, and one that no camera ray of so few meets
    folder.put("flat.ply", ply("0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n", 1));
    folder.put("thin.ply", ply("0 0 0\n1 0.37 0\n1.0001 0.37 0\n3 0 1 2\n", 1));
    folder.put("good.ply", ply("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", 1));
    for name in ["flat", "thin"] {
        let run = folder.run(&format!("render {name}.ply --view front --size 8 --aa 1 -o a.png")).exits(1);
        run.says(&[&format!("{name}.ply"), "no camera ray meets the model, and no picture was written"]);
    }
    // The others are rendered; what shows something is one
    let run = folder.run("render flat.ply good.ply -o {stem}.png --size 8 --aa 1 --summary log.jsonl").exits(1);
    run.says(&["1 of 2 scenes were rendered"]);
    assert_eq!(folder.names(), ["flat.ply", "good.ply", "good.png", "log.jsonl", "thin.ply"]);
    let log = lines(&folder.get("log.jsonl"));
    assert!(log[0]["error"].as_str().unwrap().contains("no camera ray meets the model"), "{log:?}");
    // Part of a picture may be empty, and a scene says what it wants
    folder.run("render good.ply --size 8 --aa 1 --crop 0,0,1,1 -o part.png").done();
    folder.put("scene.toml", "[[mesh]]\nfile = \"thin.ply\"\n");
    folder.run("render scene.toml --view front --size 8 --aa 1 -o scene.png").done();
}

#[test]
#[cfg(target_os = "linux")]
fn memory_does_not_grow_with_the_number_of_files() {
    let folder = Folder::new();
    for name in ["few", "many", "out"] {
        fs::create_dir(folder.path(name)).unwrap();
    }
    for i in 0..900 {
        let bytes = stl(1.0 + (i % 7) as f32);
        if i < 100 {
            folder.put(&format!("few/{i:04}.stl"), &bytes);
        }
        folder.put(&format!("many/{i:04}.stl"), &bytes);
    }
    // The numbers of the last one say the most that the program held over all of them
    let peak = |name: &str, last: usize| {
        folder
            .run(&format!(
                "render {name} -o out/{{stem}}.png --stats=out/{{stem}}.json --size 8 --aa 1 --studio hard \
                 --threads 2 --quiet --summary out/{name}.jsonl"
            ))
            .done();
        assert_eq!(lines(&folder.get(&format!("out/{name}.jsonl"))).len(), last + 1);
        let stats: Value = serde_json::from_slice(&folder.get(&format!("out/{last:04}.json"))).unwrap();
        stats["peak_memory_bytes"].as_u64().unwrap()
    };
    let (few, many) = (peak("few", 99), peak("many", 899));
    // Names of files are kept: half a kilobyte for each. Nothing of their content is
    assert!(many < few + (2 << 20) && many < 64 << 20, "{few} {many}");
}

#[test]
fn a_picture_that_takes_too_long_is_none_and_the_others_go_on() {
    let folder = with_set();
    folder.put("scene.toml", SCENE);
    let slow = "--width 2000 --aa 8 --samples 100000 --visibility traced";
    let run = folder.run(&format!("render scene.toml {slow} -o out/slow.png --max-time 0.2")).exits(1);
    run.says(&["scene.toml: --max-time 0.2: the picture was not done after 0.2 s, and none was written"]);
    assert!(below(&folder, "out").is_empty());
    // A limit of each picture, not of the run, and what is done in time is the same as without
    let line = "render scene.toml set/chairs --size 60 --aa 2 -o out/{name}.png";
    folder.run(&format!("{line} --max-time 1e6")).done();
    let without = folder.get("out/a.stl.png");
    folder.run(line).done();
    assert_eq!(folder.get("out/a.stl.png"), without);
    for bad in ["0", "-1", "inf", "soon"] {
        let output = folder.command(["render", "scene.toml", &format!("--max-time={bad}")]).output().unwrap();
        crate::common::ran(output).exits(2).says(&["a number of seconds from 0.001 to 1e9 is needed"]);
    }
}

#[test]
fn what_takes_too_much_memory_is_refused_before_it_is_taken() {
    let folder = with_set();
    // The picture
    let line = "render set/chairs/a.stl -o out/a.png --aa 1 --max-memory 2";
    folder.run(&format!("{line} --size 400")).exits(1).says(&["set/chairs/a.stl: --max-memory 2: the scene takes"]);
    assert!(below(&folder, "out").is_empty());
    folder.run(&format!("{line} --size 40")).done();
    // Triangles: 20,000 of them are more than 2 MiB with their tree
    let mut many = stl(1.0);
    let one = many[84..].to_vec();
    for i in 0..5000u32 {
        let mut moved = one.clone();
        for facet in moved.chunks_exact_mut(50) {
            facet[12..16].copy_from_slice(&((i % 100) as f32).to_le_bytes());
        }
        many.extend(moved);
    }
    many[80..84].copy_from_slice(&20_004u32.to_le_bytes());
    folder.put("many.stl", &many);
    let words = ["many.stl", "MiB of memory", "this mesh and its tree", "may take 2 MiB", "allow more: --max-memory 5"];
    let render = "render many.stl -o out/m.png --size 40 --aa 4";
    folder.run(&format!("{render} --max-memory 2")).exits(1).says(&words);
    // The ground compiles all of it again, and takes nothing more
    folder.run(&format!("{render} --max-memory 6")).done();
    // The file itself
    folder.put("text.obj", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n{}", "# nothing\n".repeat(120_000)));
    folder.run("render text.obj -o out/t.png --size 40 --aa 1 --max-memory 1").exits(1).says(&[
        "text.obj",
        "the file",
        "allow more: --max-memory 2",
    ]);
    // One of several goes on
    let run = folder.run("render many.stl set/chairs/b.STL -o out/{stem}.png --size 40 --aa 1 --max-memory 2").exits(1);
    run.says(&["1 of 2 scenes were rendered"]);
    assert!(below(&folder, "out").contains(&"b.png".into()));
    folder.run("render many.stl --max-memory 0").exits(2).says(&["a whole number from 1 to 16777216 is needed"]);
}
