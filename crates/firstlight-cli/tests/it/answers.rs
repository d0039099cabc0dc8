//! Commands that answer: check, info, scenes, schema, completions, man, help.

use crate::common::{COURSE, Folder, GLTF};

#[test]
fn check_says_ok() {
    let folder = Folder::with_scene();
    folder.put("course.txt", COURSE);
    for scene in ["scene.toml", "course.txt", "config11", "config33"] {
        let ran = folder.run(&format!("check {scene}")).done();
        assert_eq!(ran.text(), "ok\n");
        assert!(ran.stderr.is_empty(), "{}", ran.stderr);
    }
    assert_eq!(folder.names(), ["course.txt", "scene.toml"]);
    let said: serde_json::Value = serde_json::from_str(&folder.run("check scene.toml --json").done().text()).unwrap();
    assert_eq!(said, serde_json::json!({ "ok": true, "errors": [], "warnings": [], "notes": [] }));
    folder.put("scene.toml", "[camera]\npositoin = [0, 0, 1]\n");
    let said: serde_json::Value = serde_json::from_str(&folder.run("check scene.toml --json").exits(1).text()).unwrap();
    assert_eq!(said["ok"], false);
    assert!(said["errors"][0].as_str().is_some_and(|said| said.contains("positoin")), "{said}");
}

#[test]
fn info_says_what_a_scene_holds() {
    let folder = Folder::with_scene();
    let text = folder.run("info scene.toml").done().text();
    for part in [
        "36 x 24",
        "2 x 2",
        "sphere 1",
        "parallelogram 1",
        "kind point",
        "kind rectangle, samples 16",
        "name ball, kind blinn-phong",
        "name tiles, kind checkerboard, size (8, 8)",
        "name front, position (0, 1, 8)",
        "front, side",
        "encoding srgb",
        "hash",
        "bounds",
    ] {
        assert!(text.contains(part), "{part:?} is not in\n{text}");
    }
}

#[test]
fn info_is_json_for_programs() {
    let folder = Folder::with_scene();
    let text = folder.run("info scene.toml --json").done().text();
    let info: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!([&info["picture"]["width"], &info["picture"]["height"]], [36, 24]);
    assert_eq!(info["hash"].as_str().map(str::len), Some(64));
    assert_eq!(info["shapes"], serde_json::json!({ "sphere": 1, "parallelogram": 1 }));
    assert_eq!(info["lights"].as_array().map(Vec::len), Some(2));
    assert_eq!(info["lights"][1]["samples"], 16);
    assert_eq!(info["lights"][0]["samples"], 1);
    assert_eq!(info["camera"]["name"], "front");
    assert_eq!(info["cameras"], serde_json::json!(["front", "side"]));
    assert!(info["bounds"]["min"][0].as_f64() <= Some(-5.0), "{text}");
}

#[test]
fn info_says_what_a_model_holds() {
    let folder = Folder::new();
    folder.put("chair.gltf", GLTF);
    let text = folder.run("info chair.gltf").done().text();
    let length = GLTF.len();
    for part in [
        "format     glTF 2.0\n",
        &format!("file       {length} bytes\n"),
        "holds      3 nodes, 1 mesh, 1 primitive, 2 materials, 1 animation, 2 variants, 1 camera, 1 light\n",
        "vertices   3, at 3 positions\n",
        "triangles  1\n",
        "bounds     min (0, 0, 0), max (1, 1, 0)\n",
        "surface    not closed\n",
        "edges      3 on a boundary, 0 of more than two faces, 0 turned\n",
        "mesh       seat, mesh/0, 1 triangles, not closed\n",
        "material   oak\nmaterial   walnut\n",
        "animation  fold, 2 s\n",
        "variant    light\nvariant    dark\n",
        "camera     entry\n",
        "light      kind point, name lamp\n",
        "odd        boundary edges: 3 in the mesh; the surface is not closed\n",
        "odd        no normals: in the mesh; shaded flat\n",
    ] {
        assert!(text.contains(part), "{part:?} is not in\n{text}");
    }
    assert!(!text.contains("not used"), "{text}");
    // Where it is at a moment
    let text = folder.run("info chair.gltf --time 2 --json").done().text();
    let info: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(info["bounds"], serde_json::json!({ "min": [1.0, 0.0, 0.0], "max": [2.0, 1.0, 0.0] }));
    assert_eq!((&info["meshes"][0]["triangles"], &info["animations"][0]["seconds"]), (&1.into(), &2.0.into()));
    folder.put("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.run("info a.obj --time 1").exits(2).says(&["--time has no meaning for a model, and a.obj is one"]);
}

#[test]
fn what_is_odd_about_a_gltf_file_is_told() {
    let folder = Folder::new();
    let mut file: serde_json::Value = serde_json::from_str(GLTF).unwrap();
    file["asset"]["generator"] = "a test".into();
    file["images"] = serde_json::json!([{ "uri": "gone.png" }, { "uri": "spare.png" }]);
    file["textures"] = serde_json::json!([{ "source": 0 }]);
    file["materials"][0]["pbrMetallicRoughness"] = serde_json::json!({ "baseColorTexture": { "index": 0 } });
    file["materials"][0]["doubleSided"] = false.into();
    file["materials"].as_array_mut().unwrap().extend([serde_json::json!({ "name": "elm" }), serde_json::json!({})]);
    file["nodes"][0]["scale"] = serde_json::json!([-200, 200, 200]);
    file["extensionsUsed"] = serde_json::json!(["KHR_lights_punctual", "KHR_materials_sheen"]);
    folder.put("chair.gltf", file.to_string());
    let run = folder.run("info chair.gltf").done().says(&["chair.gltf: \"gone.png\": no such file"]);
    let text = run.text();
    for part in [
        "format     glTF 2.0, by a test\n",
        "material   elm, not used\nmaterial   material 3, not used\n",
        "picture    gone.png, no such file, for base color\n",
        "picture    spare.png, no such file, not used\n",
        "extension  KHR_lights_punctual, read\nextension  KHR_materials_sheen, ignored\n",
        "odd        open single-sided surface: in the mesh; camera rays pass through its back\n",
        "odd        no texture coordinates: in the mesh; the textures of \"chair.gltf/oak\" need them\n",
        "odd        mirrored placements: 1, of the mesh; front faces stay outside\n",
        "odd        nodes with a negative scale: 1\n",
        "odd        the longest side is 200 m; the unit of the file may be millimetres or centimetres\n",
        "odd        materials without a name: \"material 3\"\n",
        "odd        unused materials: \"elm\", \"material 3\"\n",
        "odd        missing or damaged textures: \"gone.png\"\n",
        "odd        unused pictures: \"spare.png\"\n",
        "odd        ignored extensions: \"KHR_materials_sheen\"\n",
    ] {
        assert!(text.contains(part), "{part:?} is not in\n{text}");
    }
    let told = ["gone.png", "uses the extension KHR_materials_sheen, which is not read"];
    assert_eq!(folder.run("check chair.gltf").done().says(&told).text(), "ok\n");
    for command in ["check", "info"] {
        folder.run(&format!("{command} chair.gltf --strict")).exits(1).says(&told);
    }
    let answer = |options: &str, code| -> serde_json::Value {
        serde_json::from_str(&folder.run(&format!("check chair.gltf --json{options}")).exits(code).text()).unwrap()
    };
    let said = answer("", 0);
    assert_eq!((&said["ok"], said["warnings"].as_array().unwrap().len()), (&true.into(), 3), "{said}");
    let said = answer(" --strict", 1);
    assert_eq!((&said["ok"], said["errors"].as_array().unwrap().len()), (&false.into(), 3), "{said}");
}

#[test]
fn what_is_odd_about_other_models_is_told() {
    let folder = Folder::new();
    let mesh =
        "mtllib a.mtl gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 2\nusemtl oak\nf 1//1 2//1 3//1\nf 1//1 1//1 2//1\n";
    folder.put("a.obj", mesh);
    folder.put("a.mtl", "newmtl oak\nKd 1 1 1\nmap_Kd oak.png\nnewmtl elm\nmap_Kd elm.png\n");
    let text = folder.run("info a.obj").done().text();
    for part in [
        "format     OBJ\n",
        "           a.mtl, 61 bytes\n           gone.mtl, missing\n",
        "normals    given, 3 not of length 1\n",
        "material   oak\nmaterial   elm, not used\n",
        "picture    oak.png, no such file, for diffuse\npicture    elm.png, no such file, not used\n",
        "odd        triangles without area: 1 in the mesh; removed\n",
        "odd        no texture coordinates: in the mesh; the textures of \"a.obj/oak\" need them\n",
        "odd        unused pictures: \"elm.png\"\n",
    ] {
        assert!(text.contains(part), "{part:?} is not in\n{text}");
    }
    // What is made right where it is rendered is a note
    let note = "note: a.obj: normals whose length is not 1: ";
    folder.run("check a.obj").done().says(&[note, "triangles without area: 1 in the mesh; removed\n"]);
    // A sound one
    let sound = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    folder.put("sound.obj", sound);
    let text = folder.run("info sound.obj").done().text();
    assert!(text.contains("surface    closed\n") && text.contains("odd        no normals: in the mesh"), "{text}");
    assert_eq!(text.matches("\nodd ").count(), 1, "{text}");
}

#[test]
fn all_nine_configs_are_built_in_and_their_text_is_a_scene() {
    let folder = Folder::new();
    let list = folder.run("scenes").done().text();
    for camera in 1..=3 {
        for light in 1..=3 {
            let name = format!("config{camera}{light}");
            assert!(list.lines().any(|line| line.starts_with(&name)), "{name} is not in\n{list}");
            let text = folder.run(&format!("scenes {name}")).done().stdout;
            assert_eq!(folder.run_with_input("check -", &text).done().text(), "ok\n");
        }
    }
}

#[test]
fn schema_is_json() {
    let schema: serde_json::Value = serde_json::from_slice(&Folder::new().run("schema").done().stdout).unwrap();
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
}

#[test]
fn every_shell_completes() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = folder.run(&format!("completions {shell}")).done().text();
        assert!(script.contains("firstlight") && script.contains("tile-size"), "{shell}");
    }
}

#[test]
fn the_manual_has_a_page_for_each_command() {
    let manual = Folder::new().run("man").done().text();
    for page in ["", "-render", "-check", "-info", "-scenes", "-schema", "-completions", "-man"] {
        assert!(manual.contains(&format!(".TH firstlight{page} 1 ")), "{page}");
    }
    assert!(manual.contains("tile\\-size") && manual.contains("130"));
}

#[test]
fn help_and_version_are_answers() {
    let folder = Folder::new();
    // With the commit in a clone, without it elsewhere
    let version = folder.run("--version").done().text();
    let number = format!("firstlight {}", env!("CARGO_PKG_VERSION"));
    let commit =
        version.strip_prefix(&number).and_then(|rest| rest.strip_suffix('\n')).unwrap_or_else(|| panic!("{version}"));
    let digits = commit.strip_prefix(" (").and_then(|rest| rest.strip_suffix(')'));
    assert!(
        commit.is_empty() || digits.is_some_and(|d| d.len() >= 10 && d.chars().all(|c| c.is_ascii_hexdigit())),
        "{version}"
    );
    for line in ["--help", "-h", "render --help", "render -h", "check --help", "info --help", "scenes --help"] {
        let ran = folder.run(line).done();
        assert!(ran.text().contains("Usage: firstlight") && ran.stderr.is_empty(), "{line}");
    }
}

#[test]
fn help_of_a_command_is_that_of_its_option() {
    let folder = Folder::new();
    assert_eq!(folder.run("help").done().text(), folder.run("--help").done().text());
    for command in ["render", "check", "info", "relight", "view-buffer", "man"] {
        let [asked, option] = [format!("help {command}"), format!("{command} --help")].map(|line| folder.run(&line));
        assert_eq!(asked.done().text(), option.done().text(), "{command}");
    }
}

#[test]
fn the_page_of_the_program_names_every_command_and_option() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/program.md");
    let page = std::fs::read_to_string(page).unwrap();
    let folder = Folder::new();
    let help = folder.run("--help").done().text();
    let commands = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names = commands.lines().filter_map(|line| line.strip_prefix("  ").filter(|line| !line.starts_with(' ')));
    let names = names.filter_map(|line| line.split_whitespace().next());
    let names: Vec<&str> = names.filter(|name| *name != "help").collect();
    assert!(names.len() >= 12 && names.contains(&"relight"), "{names:?}");
    for name in names {
        assert!(page.contains(&format!("firstlight {name} ")), "{name}");
        // What it makes of buffers has its own page
        if name == "view-buffer" {
            continue;
        }
        let help = folder.run(&format!("{name} --help")).done().text();
        let lines = help.lines().filter(|line| line.starts_with("  ") && line.trim_start().starts_with('-'));
        for option in lines.flat_map(|line| line.split([' ', ',', '<', '[', '='])).filter(|word| word.starts_with("--"))
        {
            assert!(option == "--help" || page.contains(option), "{name} {option}");
        }
    }
}

#[test]
fn info_of_a_picture_is_its_receipt() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml -o a.png -o a.exr -o a.npz -o a.hdr -o depth=a.npy --buffers color,depth -q").done();
    let hash = folder.run("info scene.toml --json").done().text();
    let hash = serde_json::from_str::<serde_json::Value>(&hash).unwrap()["hash"].as_str().unwrap().to_owned();
    for (name, format, buffers) in [
        ("a.png", "PNG, 8 bits", "buffers    color: R G B, as it was written\n"),
        ("a.exr", "OpenEXR", "buffers    color: R G B A, as it was written\n           depth: Z, as it was written\n"),
        ("a.npz", "NPZ", "buffers    color: R G B A, as it was written\n           depth: Z, as it was written\n"),
        ("a.npy", "NPY", "buffers    depth: Z, as it was written\n"),
        ("a.hdr", "Radiance HDR", "buffers    color: R G B, as it was written\n"),
    ] {
        let text = folder.run(&format!("info {name}")).done().text();
        for part in [&*format!(" bytes, {format}\n"), "size       36 x 24 pixels\n", buffers, &hash, " tolerance "] {
            assert!(text.contains(part), "{name}: {part:?} is not in\n{text}");
        }
        let json: serde_json::Value =
            serde_json::from_slice(&folder.run(&format!("info {name} --json")).done().stdout).unwrap();
        assert_eq!(json["receipt"]["scene_hash"], hash.as_str(), "{name}");
        assert_eq!((&json["format"], &json["width"]), (&format.into(), &36.into()));
    }
    // A part says of what
    folder.run("render scene.toml --crop 4,3,20,10 -o part.exr -q").done();
    assert!(folder.run("info part.exr").done().text().contains("size       20 x 10 pixels, at (4, 3) of 36 x 24\n"));
    // A picture of another program, a damaged one, and options that are for scenes only
    let bytes = folder.get("a.png");
    folder.put("cut.png", &bytes[..bytes.len() / 2]);
    folder.run("info cut.png").exits(1).says(&["cut.png: is a damaged PNG file"]);
    folder.run("info a.png --time 1").exits(2).says(&["--time has no meaning for a picture, and a.png is one"]);
    let mut other = Vec::new();
    let mut encoder = png::Encoder::new(&mut other, 3, 2);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&[7; 6]).unwrap();
    folder.put("other.png", other);
    assert!(folder.run("info other.png").done().text().contains("receipt    none: "));
}

/// What the completions know, help says: with its default, and at the end by examples.
#[test]
fn help_says_every_option_and_its_default() {
    let folder = Folder::new();
    let script = folder.run("completions fish").done().text();
    let mut options = 0;
    for command in ["render", "check", "info", "scenes", "schema", "completions", "man"] {
        let help = folder.run(&format!("{command} --help")).done().text();
        for line in script.lines().filter(|line| line.contains(&format!("subcommand {command}\""))) {
            let Some((_, rest)) = line.split_once(" -l ") else { continue };
            let name = rest.split_whitespace().next().unwrap();
            assert!(help.contains(&format!("--{name}")), "{command} --{name}");
            options += 1;
        }
    }
    assert!(options > 20, "{options} options: has the script changed its form?");

    let help = folder.run("render --help").done().text();
    for block in help.split("\n\n").filter(|block| block.trim_start().starts_with('-') && block.contains(" <")) {
        assert!(block.contains("[default:"), "no default:\n{block}");
    }
    let examples = help.split("Examples:\n").nth(1).unwrap();
    assert!(examples.contains("firstlight render room.toml"));
}
