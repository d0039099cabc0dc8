//! Scenes with faults, and scenes that cannot be had.

use crate::common::{Folder, Picture, SCENE};

#[test]
fn all_faults_come_at_once_with_place_excerpt_and_count() {
    let folder = Folder::new();
    folder.put("bad.toml", SCENE.replace("radius = 1", "radius = -1").replace("fov_y_deg = 35", "colour = 35"));
    for command in ["check", "render", "info"] {
        let ran = folder.run(&format!("{command} bad.toml")).exits(1);
        assert!(ran.stdout.is_empty());
        let ran =
            ran.says(&["bad.toml:15:", "colour", "  15 | colour = 35\n", "bad.toml:35:", "radius", "-1", "2 errors\n"]);
        let carets = ran.stderr.lines().filter(|line| line.trim_start_matches([' ', '|']).starts_with('^')).count();
        assert_eq!(carets, 2, "{}", ran.stderr);
        assert!(ran.stderr.starts_with("error: bad.toml:15:"), "{}", ran.stderr);
        assert!(!ran.stderr.contains('\u{1b}'), "no colours where there is no terminal");
    }
    assert_eq!(folder.names(), ["bad.toml"]);
}

#[test]
fn faults_of_standard_input_have_a_place_too() {
    let folder = Folder::new();
    folder.run_with_input("check -", b"[camera]\nposition = [0, 0, 9]\n[render]\ncolour = 3\n").exits(1).says(&[
        "<stdin>:4:",
        "colour",
        "1 error\n",
    ]);
    let json = b"\n{\"camera\": {\"position\": [0, 0, 9]}, \"render\": {\n\"colour\": 3}}\n";
    folder.run_with_input("check -", json).exits(1).says(&["<stdin>.json:3:", "colour", "1 error\n"]);
    let marked = [b"\xef\xbb\xbf", json.as_slice()].concat();
    folder.run_with_input("check -", &marked).exits(1).says(&["<stdin>.json:3:", "colour", "1 error\n"]);
}

#[test]
fn what_is_no_scene_is_a_fault_and_no_panic() {
    let folder = Folder::new();
    folder.put("empty.toml", "");
    folder.put("bytes.toml", (0..=255).collect::<Vec<u8>>());
    folder.put("text.json", "{\"render\": ");
    folder.put("course.txt", "camera_id 1 2\nlight 3\n");
    for name in ["bytes.toml", "text.json", "course.txt"] {
        for command in ["check", "render", "info"] {
            folder.run(&format!("{command} {name}")).exits(1).says(&[name]);
        }
    }
    let said = "empty.toml is empty; a scene is TOML or JSON text; an empty one is `{}`";
    folder.run("check empty.toml").exits(1).says(&[said]);
    folder.run_with_input("check -", b" \n").exits(1).says(&["<stdin> is empty"]);
}

#[test]
fn a_scene_that_is_not_there_says_what_is() {
    let folder = Folder::new();
    for command in ["render", "check", "info"] {
        folder.run(&format!("{command} config99")).exits(1).says(&["config99", "no such file", "config11"]);
        folder.run(&format!("{command} .")).exits(1).says(&["folder"]);
    }
    for command in ["render", "check", "info"] {
        let meant = ["no such file", "did you mean \"config11\"?", "config33"];
        folder.run(&format!("{command} conifg11")).exits(1).says(&meant);
        // What is a file's name for certain is no mistyped scene
        for name in ["./config11", "nofile.toml", "folder/conifg11", "/config11"] {
            let ran = folder.run(&format!("{command} {name}")).exits(1).says(&[name, "no such file"]);
            assert!(!ran.stderr.contains("built"), "{}", ran.stderr);
        }
    }
    folder.run("scenes conifg22").exits(2).says(&["did you mean \"config22\"?"]);
    assert!(folder.names().is_empty());
}

#[test]
fn an_endless_scene_is_refused() {
    let zero = std::path::Path::new("/dev/zero");
    if zero.exists() {
        Folder::new().run("check /dev/zero").exits(1).says(&["/dev/zero looks like binary data of an unknown kind"]);
    }
}

#[test]
fn a_missing_texture_warns_and_is_an_error_under_strict() {
    let folder = Folder::new();
    let scene = SCENE.replace("checkerboard.tiles]\ncounts = [8, 8]", "image.tiles]\nfile = \"tiles.png\"");
    folder.put("scene.toml", scene);
    folder.run("check scene.toml").done().says(&["warning: scene.toml:", "tiles.png"]);
    folder.run("check scene.toml --strict").exits(1).says(&["error: scene.toml:", "tiles.png", "1 error\n"]);
    folder.run("render scene.toml --strict").exits(1);
    assert_eq!(folder.names(), ["scene.toml"]);
    // A warning is said even when little is
    folder.run("render scene.toml --quiet").done().says(&["warning: scene.toml:", "tiles.png"]);
    assert_eq!(folder.names(), ["scene.png", "scene.toml"]);
    // What stands in for it has edges as sharp as those of a checkerboard
    folder.put("crisp.toml", SCENE.replace("[8, 8]", "[8, 8]\ncolors = [\"magenta\", \"black\"]"));
    folder.run("render crisp.toml").done();
    let [placeholder, crisp] = ["scene.png", "crisp.png"].map(|name| Picture::decode(&folder.get(name)).data);
    assert!(placeholder == crisp);
}

#[test]
fn a_scene_reads_its_own_folder_and_those_allowed() {
    let folder = Folder::with_scene();
    std::fs::create_dir(folder.path("scenes")).unwrap();
    std::fs::create_dir(folder.path("pictures")).unwrap();
    folder.run("render scene.toml -o pictures/tiles.png").done();
    let scene = SCENE.replace("checkerboard.tiles]\ncounts = [8, 8]", "image.tiles]\nfile = \"../pictures/tiles.png\"");
    folder.put("scenes/scene.toml", scene);
    folder.run("check scenes/scene.toml --strict").exits(1).says(&["outside"]);
    folder.run("check scenes/scene.toml --strict --allow-dir pictures").done();
    folder.run("check scenes/scene.toml --strict --allow-dir scenes --allow-dir pictures").done();
    folder.run("check scenes/scene.toml --allow-dir nowhere").exits(1).says(&["--allow-dir", "nowhere"]);
}

/// Two triangles.
const MODEL: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

#[test]
fn a_file_of_another_kind_is_one_line_that_says_what_it_is() {
    let folder = Folder::new();
    let files: &[(&str, &[u8], &str)] = &[
        ("a.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "looks like a PNG picture"),
        ("a", b"\xff\xd8\xff\xe0", "looks like a JPEG picture"),
        ("a.zip", b"PK\x03\x04\x0a\0", "looks like a zip archive, not like a firstlight scene; unpack it first"),
        ("a.toml", b"%PDF-1.7\n", "looks like a PDF document"),
        ("a.json", b"<!DOCTYPE html>\n<html>", "looks like a web page (HTML)"),
        ("a.txt", b"\x1f\x8b\x08", "looks like gzip-compressed data"),
        ("a.blend", b"BLENDER-v300", "looks like a Blender file"),
    ];
    for (name, bytes, said) in files {
        folder.put(name, bytes);
        for command in ["check", "render", "info"] {
            // Of a picture its receipt is looked for
            let pictures =
                [("a.png", "error: a.png: is a damaged PNG file: "), ("a", "error: a: is a damaged JPEG file: ")];
            if let ("info", Some((_, said))) = (command, pictures.iter().find(|(picture, _)| picture == name)) {
                folder.run(&format!("info {name}")).exits(1).says(&[said]);
                continue;
            }
            let ran = folder.run(&format!("{command} {name}")).exits(1).says(&[&format!("error: {name} "), said]);
            assert_eq!(ran.stderr.lines().count(), 2, "{}", ran.stderr);
        }
        let ran = folder.run_with_input("check -", bytes).exits(1).says(&["error: <stdin>", said]);
        assert_eq!(ran.stderr.lines().count(), 2, "{}", ran.stderr);
        // The same under a model's name, and as the file of a mesh in a scene
        let what = said.split(", ").next().unwrap();
        folder.put("a.ply", bytes);
        let ran = folder.run("render a.ply -o out.png").exits(1).says(&["error: a.ply: ", what, "not like a model"]);
        assert_eq!(ran.stderr.lines().count(), 2, "{}", ran.stderr);
        assert!(!ran.stderr.contains("mesh[0]"), "{}", ran.stderr);
        folder.put("scene.toml", format!("{SCENE}[[mesh]]\nfile = \"a.ply\"\n"));
        folder.run("check scene.toml").exits(1).says(&["scene.toml:", "mesh[0].file: a.ply: ", what, "1 error\n"]);
        std::fs::remove_file(folder.path(name)).unwrap();
    }
}

/// A triangle, as glTF.
const GLTF: &str = r#"{
  "asset": { "version": "2.0" },
  "buffers": [{ "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA", "byteLength": 36 }],
  "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
  "accessors": [{ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 }],
  "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
  "nodes": [{ "mesh": 0 }],
  "scenes": [{ "nodes": [0] }]
}"#;

#[test]
fn a_gltf_model_is_one_by_its_name_or_its_content() {
    let folder = Folder::new();
    for name in ["a.gltf", "a", "a.ply", "a.toml"] {
        folder.put(name, GLTF);
        for command in ["check", "info", "render -o a.png --size 8"] {
            folder.run(&format!("{command} {name} --strict")).done();
        }
        folder.run(&format!("check {name} --variant red")).exits(1).says(&["there is no variant \"red\""]);
        folder
            .run(&format!("check {name} --gltf-scene 1"))
            .exits(1)
            .says(&["there is no scene 1; the file has 1, counted from 0"]);
    }
    folder.run_with_input("check - --strict", GLTF.as_bytes()).done();
    // Damaged, or nothing
    folder.put("a.glb", b"glTF\x02\0\0\0\x0c\0\0\0");
    for command in ["check a.glb", "info a.glb", "render a.glb"] {
        folder.run(command).exits(1).says(&["error: a.glb: has no JSON chunk; the file is damaged"]);
    }
    folder.put("a.gltf", "{ \"asset\": { \"version\": \"2.0\" }, \"meshes\": [] }\n");
    folder.run("check a.gltf").done().says(&["note: a.gltf: the scene has no shapes"]);
    folder.run("render a.gltf --size 8 -o b.png").exits(1).says(&["no picture was written"]);
    // As a mesh of a scene it is told what to do
    folder.put("scene.toml", format!("{SCENE}[[mesh]]\nfile = \"a.glb\"\n"));
    folder.run("check scene.toml").exits(1).says(&[
        "mesh[0].file: a.glb: looks like a binary glTF model (GLB), not like a mesh; give it as a model (.glb, .gltf), \
         or name it as the file of a [[model]]",
    ]);
    folder.put("scene.toml", format!("{SCENE}[[model]]\nfile = \"a.ply\"\n"));
    folder.run("check scene.toml --strict").done();
}

#[test]
fn a_model_is_known_by_its_content() {
    let folder = Folder::new();
    folder.put("named.obj", MODEL);
    folder.put("model", MODEL);
    folder.put("model.xyz", MODEL);
    let quick = "--width 20 --height 20 --aa 1 -q";
    folder.run(&format!("render named.obj -o a.png {quick}")).done();
    for name in ["model", "model.xyz"] {
        folder.run(&format!("render {name} -o b.png {quick}")).done();
        assert!(Picture::decode(&folder.get("a.png")) == Picture::decode(&folder.get("b.png")), "{name}");
    }
    // Through a pipe
    folder.run_with_input(&format!("render - -o b.png {quick}"), MODEL.as_bytes()).done();
    assert!(Picture::decode(&folder.get("a.png")) == Picture::decode(&folder.get("b.png")));
    folder.run_with_input("render - --width 20 --aa 1 --smooth 30", MODEL.as_bytes()).done().says(&["wrote "]);
    assert!(folder.run_with_input("info -", MODEL.as_bytes()).done().text().contains("triangles  2\n"));
    folder.run_with_input("check -", b"v 0 0 0\nv 1 0 x\nf 1 1 1\n").exits(1).says(&["error: <stdin>:2: v: `x`"]);
}

#[test]
fn a_model_is_spoken_of_by_its_name() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("models")).unwrap();
    folder.put("models/a.obj", MODEL.replace("f 1", "usemtl clay\nf 1"));
    // A name of a material is no fault of the model, where it names no file of materials either
    assert_eq!(folder.run("check models/a.obj --strict").done().stderr, "");
    folder.put("models/a.obj", format!("mtllib a.mtl\n{}", MODEL.replace("f 1", "usemtl clay\nf 1")));
    let missing = "models/a.obj: \"a.mtl\": there is no such file of materials; its faces are of a light gray; an OBJ \
                   file needs its MTL files beside it\n";
    folder.run("check models/a.obj").done().says(&[&format!("warning: {missing}")]);
    folder.run("check models/a.obj --strict").exits(1).says(&[&format!("error: {missing}")]);
    folder.put("models/a.mtl", "newmtl clay\nKd 1 0 0\n");
    assert_eq!(folder.run("check models/a.obj --strict").done().stderr, "");
    // And it is red
    folder.run("render models/a.obj --studio flat --view front --size 8 --aa 1 -o red.png").done();
    assert_eq!(Picture::decode(&folder.get("red.png")).part(4, 4, 1, 1), [255, 0, 0]);
    folder.put("models/a.obj", "v 0 0 0\nv 1 1 1\nv 2 2 z\n");
    folder.run("check models/a.obj").exits(1).says(&["error: models/a.obj:3: v: `z`"]);
    folder.put("models/a.obj", "v 0 0 0\n".repeat(3) + "f 1 2 3\n");
    folder.run("check models/a.obj").done().says(&["note: models/a.obj: it has no size"]);
    folder.run("check models/b.obj").exits(1).says(&["error: models/b.obj: no such file\n"]);
    folder.run("check models\\a.obj").exits(1).says(&["`/` parts folders and files: models/a.obj\n"]);
    folder.run("check models\\a.toml").exits(1).says(&["`/` parts folders and files: models/a.toml\n"]);
    // Colours that look like bytes
    folder.put("models/a.obj", "v 0 0 0 255 0 0\nv 1 0 0 0 128 0\nv 0 1 0 0 0 64\nf 1 2 3\n");
    let ran = folder.run("check models/a.obj --strict").done();
    let note = "note: models/a.obj: the colours of its vertices go up to 255: that reflects more light than there is; \
                are they 0 to 255? divide them by 255, or write whole numbers of one byte each (PLY `uchar`)\n";
    assert_eq!(ran.stderr, note);
    // Those of what no face has are none
    folder.put("models/a.obj", "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\nv nan 0 0 255 0 0\n");
    assert_eq!(folder.run("check models/a.obj --strict").done().stderr, "");
}

#[test]
fn lights_of_a_file_that_can_have_none_are_no_option() {
    let folder = Folder::new();
    folder.put("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for option in ["--studio none", "--lights file"] {
        for command in ["check", "info", "render"] {
            let words = "shows a model by the lights of its file, and a.obj has none: only glTF files do; leave";
            folder.run(&format!("{command} a.obj {option}")).exits(2).says(&[&format!("error: {option} {words}")]);
        }
    }
    folder.put("a.gltf", GLTF);
    folder.run("check a.gltf --studio none").done();
}

#[test]
fn an_empty_file_is_said_to_be_empty() {
    let folder = Folder::new();
    for name in ["a.obj", "a.ply", "a.stl"] {
        folder.put(name, "");
        for command in ["check", "info", "render"] {
            let words = format!("error: {name}: is empty; give a PLY, STL or OBJ file\n");
            folder.run(&format!("{command} {name}")).exits(1).says(&[&words]);
        }
    }
    for name in ["a", "a.toml", "a.json", "-"] {
        let words = "is empty; a scene is TOML or JSON text; an empty one is `{}`\n";
        for text in ["", " \n\n"] {
            let ran = match name {
                "-" => folder.run_with_input("check -", text.as_bytes()),
                name => {
                    folder.put(name, text);
                    folder.run(&format!("check {name}"))
                }
            };
            let ran = ran.exits(1).says(&[words]);
            assert_eq!(ran.stderr.matches("is empty").count(), 1, "{}", ran.stderr);
        }
    }
}

#[test]
fn of_many_faults_the_first_are_listed() {
    let folder = Folder::new();
    folder.put(
        "many.toml",
        "[camera]\nposition = [0, 0, 5]\n[render]\n".to_owned()
            + &(0..250).map(|i| format!("k{i} = 1\n")).collect::<String>(),
    );
    let ran = folder.run("check many.toml").exits(1).says(&["\nand 230 more\n250 errors\n"]);
    assert_eq!(ran.stderr.matches("error: many.toml:").count(), 20, "{}", ran.stderr);
    folder.put(
        "more.toml",
        "[camera]\nposition = [0, 0, 5]\n[render]\n".to_owned()
            + &(0..2500).map(|i| format!("k{i} = 1\n")).collect::<String>(),
    );
    folder.run("check more.toml").exits(1).says(&["\nand 2480 more\n2500 errors\n"]);
    // Another language is not listed word by word
    folder.put("prose", "It was a dark night.\n".repeat(100));
    let ran = folder.run("check prose").exits(1).says(&["prose:1:", "not TOML: 100 lines are not understood"]);
    assert_eq!(ran.stderr.lines().count(), 4, "{}", ran.stderr);
}

#[test]
fn control_characters_and_long_names_of_a_scene_are_not_shown_as_they_are() {
    let folder = Folder::new();
    let odd = "\\u001b[2J\\u202e";
    let long = "x".repeat(5000);
    let scene = SCENE.replace("material = \"ball\"", &format!("material = \"{odd}{long}\"\nname = \"{odd}\""));
    folder.put(
        "scene.toml",
        format!("{scene}[[mesh]]\nfile = \"{odd}{long}.ply\"\n[camera.\"{odd}{long}\"]\nfov_y_deg = 400\n"),
    );
    let ran = folder.run("check scene.toml").exits(1).says(&["\\u{1b}", "fov_y_deg"]);
    assert!(!ran.stderr.chars().any(|c| c.is_control() && c != '\n' || c == '\u{202e}'), "{}", ran.stderr);
    assert!(ran.stderr.lines().all(|line| line.chars().count() < 1200), "{}", ran.stderr);
}

#[test]
fn a_picture_that_is_nearly_black_says_what_strength_means() {
    let folder = Folder::new();
    let lit = |light: &str| {
        let scene = SCENE.split("[[light.point]]").next().unwrap().replace("ambient = 0.05\n", "");
        folder.put("dark.toml", format!("{scene}{light}"));
    };
    let point = "[[light.point]]\nposition = [4, 6, 4]\n";
    lit(point);
    let ran = folder.run("render dark.toml -o a.png").done();
    let [start, meaning] = [
        "note: dark.toml: the picture is nearly black, its brightest pixel is ",
        " of 255: light.point[0] was left at strength 1, one candela, of which a white surface shows 1 / (pi d^2)",
    ];
    let ran = ran.says(&[start, meaning, "; try strength = "]);
    // What is proposed makes its brightest pixel bright: 0.8 of white is 231 of 255
    let proposed = |text: &str, after: &str| -> f64 {
        let number = text.split(after).nth(1).unwrap().trim_start_matches(['=', ' ']);
        number.split([',', ' ', ';', '\n']).next().unwrap().parse().unwrap()
    };
    let brightest = |line: &str| {
        folder.run(&format!("render dark.toml -q -o b.png {line}")).done();
        Picture::decode(&folder.get("b.png")).data.into_iter().max().unwrap()
    };
    let stops = proposed(&ran.stderr, "--exposure ");
    assert!((225..=237).contains(&brightest(&format!("--exposure {stops}"))));
    lit(&format!("{point}strength = {}\n", proposed(&ran.stderr, "try strength")));
    assert!((225..=237).contains(&brightest("")));
    // Which is not said again, nor of a part of it, nor where little is to be said
    for line in ["", "-q"] {
        assert!(!folder.run(&format!("render dark.toml {line} -o a.png")).done().stderr.contains("note"));
    }
    lit(point);
    for line in ["-q", "--crop 0,0,4,4", "--exposure 9", "--buffers depth -o a.npz"] {
        let ran = folder.run(&format!("render dark.toml {line}")).done();
        assert!(!ran.stderr.contains("nearly black"), "{line}: {}", ran.stderr);
    }
    for (light, meaning) in [
        ("[[light.rectangle]]\ncenter = [0, 60, 0]\nsize = [1, 1]\nlook_at = [0, 0, 0]\n", "a radiance of 1"),
        ("[[light.directional]]\ndirection = [-1, -0.02, 0]\ncolor = 0.01\n", "one lux, of which a white surface"),
        (
            &format!("{point}{point}").replace("6, 4", "16, 4"),
            "light.point[0] was left at strength 1 (as one more is), one candela",
        ),
    ] {
        lit(light);
        folder.run("render dark.toml -o a.png").done().says(&["nearly black", meaning]);
    }
    // Neither without light at all, nor in a model where units are the user's
    for light in [&format!("{point}strength = 0.9\n"), &format!("{point}falloff = \"constant\"\ncolor = 0.001\n")] {
        lit(light);
        assert!(!folder.run("render dark.toml -o a.png").done().stderr.contains("nearly black"), "{light}");
    }
}

#[test]
fn a_tolerance_of_sampled_lights_is_a_note() {
    let folder = Folder::with_scene();
    let note = "note: scene.toml: --tolerance 4 changes next to nothing: the scene says (samples) at how many points \
                each light is sampled, and the tolerance is for lights that are integrated; --samples exact integrates \
                them";
    let run = |line: &str| folder.run(&format!("render scene.toml --tolerance 4 --size 12 {line}")).done();
    run("").says(&[note]);
    run("--aa-mode full").says(&["--tolerance 4 changes nothing: the scene says (samples)"]);
    run("--samples 9").says(&["changes next to nothing: --samples says at how many"]);
    for line in ["--samples exact", "-q"] {
        assert!(!run(line).stderr.contains("--tolerance"), "{line}");
    }
    assert!(!folder.run("render scene.toml --size 12").done().stderr.contains("--tolerance"));
    // And it is so: sampled lights under full antialiasing know no tolerance
    let bytes = |tolerance: &str| {
        folder.run(&format!("render scene.toml --aa-mode full --tolerance {tolerance} -o a.png --bits 16 -q")).done();
        Picture::decode(&folder.get("a.png"))
    };
    assert!(bytes("0.25") == bytes("16"));
    folder.put("scene.toml", SCENE.replace("samples = 16\n", ""));
    assert!(!run("").stderr.contains("note"));
}

#[test]
fn advice_is_a_note_and_no_error() {
    let folder = Folder::new();
    let dark = SCENE.split("[[light.point]]").next().unwrap().replace("ambient = 0.05\n", "");
    folder.put("dark.toml", &dark);
    let note = "note: dark.toml:1:1: light: there is no light, and no ambient light: every surface is black";
    for command in ["check", "info", "render"] {
        folder.run(&format!("{command} dark.toml --strict")).done().says(&[note]);
    }
    let ran = folder.run("render dark.toml --quiet").done();
    assert_eq!(ran.stderr, "");
    // Frames and moments of what does not move
    let folder = Folder::with_scene();
    let ran = folder.run("render scene.toml --frames 0..2 --width 8 --aa 1").done();
    let note = "note: scene.toml: the scene has no keys: the pictures of all 3 frames are the same";
    assert_eq!(ran.stderr.matches(note).count(), 1, "{}", ran.stderr);
    folder.run("render scene.toml --time 2 --width 8 --aa 1").done().says(&["its picture is the same at any --time"]);
    let keys = SCENE.replace(
        "radius = 1\n",
        "radius = 1\ntransform = { keys = [{ time = 0, translate = [0, 0, 0] }, \
        { time = 1, translate = [1, 0, 0] }] }\n",
    );
    folder.put("scene.toml", keys);
    let ran = folder.run("render scene.toml --frames 0..2 --width 8 --aa 1").done();
    assert!(!ran.stderr.contains("note"), "{}", ran.stderr);
}
