//! What is found for models and for scenes without a camera, and how it is written down.

use crate::common::{Folder, Picture, SCENE};

/// A tetrahedron, far from the origin and not in the middle of anything.
const MODEL: &str = "\
ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
10 5 3
13 5 3
10 9 3.5
10.5 5.5 4
3 0 2 1
3 0 1 3
3 1 2 3
3 2 0 3
";

fn with_model() -> Folder {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("models")).unwrap();
    folder.put("models/tetra.ply", MODEL);
    folder
}

/// The columns and rows of a transparent picture that hold something: the first and the last of each.
fn covered(picture: &Picture) -> [[usize; 2]; 2] {
    assert_eq!(picture.bytes, 4, "it has no alpha");
    let alpha = |x: usize, y: usize| picture.data[(y * picture.width + x) * 4 + 3];
    let column = |x: &usize| (0..picture.height).any(|y| alpha(*x, y) > 0);
    let row = |y: &usize| (0..picture.width).any(|x| alpha(x, *y) > 0);
    let ends = |found: Vec<usize>| [found[0], found[found.len() - 1]];
    [ends((0..picture.width).filter(column).collect()), ends((0..picture.height).filter(row).collect())]
}

#[test]
fn a_model_is_in_the_middle_from_every_side() {
    let folder = with_model();
    let mut seen = Vec::new();
    for view in ["front", "back", "left", "right", "top", "bottom", "iso", "-30,15"] {
        folder
            .run(&format!(
                "render models/tetra.ply --size 100x60 --aa 1 --transparent --ground off --margin 0.1 --view {view} \
                 -o a.png"
            ))
            .done();
        let picture = Picture::decode(&folder.get("a.png"));
        let [[left, right], [top, bottom]] = covered(&picture);
        // Margins in pixels, 6 where the model is as large as it can be; up to 2 pixels of a tip lie between the rays
        let (left, right, top, bottom) = (left as i32, 99 - right as i32, top as i32, 59 - bottom as i32);
        assert!((left - right).abs() <= 3 && (top - bottom).abs() <= 3, "{view}: {left} {right} {top} {bottom}");
        let least = left.min(right).min(top).min(bottom);
        assert!((5..=8).contains(&least), "{view}: {left} {top}");
        seen.push(picture.data);
    }
    seen.sort();
    seen.dedup();
    assert_eq!(seen.len(), 8, "two views are the same");
}

#[test]
fn a_size_is_that_of_the_longer_side() {
    let folder = with_model();
    folder.put("scene.toml", SCENE);
    folder.put("tall.toml", SCENE.replace("width = 36\nheight = 24", "width = 24\nheight = 36"));
    for (options, size) in [
        ("scene.toml --size 12", (12, 8)),
        ("tall.toml --size 12", (8, 12)),
        ("scene.toml --size 7x9", (7, 9)),
        ("models/tetra.ply --size 11", (11, 11)),
    ] {
        folder.run(&format!("render {options} --aa 1 --samples 1 -o a.png")).done();
        assert_eq!(Picture::decode(&folder.get("a.png")).size(), size, "{options}");
    }
}

#[test]
fn what_nothing_covers_is_as_asked() {
    let folder = with_model();
    let corner = |options: &str| {
        folder.run(&format!("render models/tetra.ply --size 8 --aa 1 -o a.png {options}")).done();
        let picture = Picture::decode(&folder.get("a.png"));
        picture.part(0, 0, 1, 1)
    };
    assert_eq!(corner("--studio flat --background #204060"), [0x20, 0x40, 0x60]);
    assert_eq!(corner("--studio flat --background 1,0,0.5"), [255, 0, 188]);
    assert_eq!(corner("--studio flat --transparent"), [0, 0, 0, 0]);
    // The studio's own, and others, as its display shows them
    let neutral = firstlight::Display { tone_mapping: firstlight::ToneMapping::Neutral, ..Default::default() };
    let shown = |color: [f64; 3]| neutral.encode_color(color.map(|c| c as f32)).map(|c| (255.0 * c).round() as u8);
    assert_eq!(corner("--ground off"), shown([0.78; 3]));
    assert_eq!(corner("--ground off --background 1,0,0.5"), shown([1.0, 0.0, 0.5]));
    assert_eq!(corner("--ground off --transparent"), [0, 0, 0, 0]);
    // In place of what the scene says
    folder.put(
        "scene.toml",
        "[render]\ntransparent = true\nwidth = 8\nheight = 8\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n",
    );
    folder.run("render scene.toml --aa 1 --background #204060 -o a.png").done();
    assert_eq!(Picture::decode(&folder.get("a.png")).part(0, 0, 1, 1), [0x20, 0x40, 0x60]);
}

#[test]
fn a_scene_without_a_camera_is_given_one_and_no_light() {
    let folder = Folder::new();
    let text = "[render]\nwidth = 60\nheight = 40\nambient = 0.5\ntransparent = true\n\
                [[sphere]]\ncenter = [3, 4, 5]\nradius = 2\n[[plane]]\nvisible = false\n";
    folder.put("scene.toml", text);
    let note = "note: scene.toml has no camera; one was found";
    folder.run("render scene.toml --aa 1 -o a.png").done().says(&[note]);
    // As large as the margin lets it be: 0.04 of 40 pixels
    let [[left, right], [top, bottom]] = covered(&Picture::decode(&folder.get("a.png")));
    assert!(left.abs_diff(59 - right) <= 1 && top.abs_diff(39 - bottom) <= 1 && (1..=2).contains(&top), "{left} {top}");
    folder.run("check scene.toml").done().says(&[note]);
    let info = folder.run("info scene.toml --json").done().says(&[note]).text();
    assert!(info.contains("\"found\": true") && info.contains("\"fov_y_deg\": 30.0"), "{info}");
    assert!(info.contains("\"lights\": []"), "a scene keeps no light where it has none: {info}");
    assert!(folder.run("info scene.toml").done().text().contains("found true"));
    let run = folder.run("render scene.toml --aa 1 --quiet --view top -o a.png").done();
    assert_eq!(run.stderr, "");
    // Nothing to look at
    folder.put("none.toml", "[[plane]]\n");
    for command in ["check", "render", "info"] {
        folder.run(&format!("{command} none.toml")).exits(1).says(&["camera: there is none, and no shape with an end"]);
    }
}

#[test]
fn a_camera_that_is_found_stands_still_while_the_scene_moves() {
    let folder = Folder::new();
    let keys = "transform = { keys = [{ time = 0, translate = [0, 0, 0] }, { time = 1, translate = [0.5, 0, 0] }] }";
    let ball = |rest: &str| format!("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n{rest}\n");
    folder.put(
        "scene.toml",
        format!("[render]\nwidth = 40\nheight = 40\nambient = 1\ntransparent = true\nfps = 1\n{}", ball(keys)),
    );
    folder.run("render scene.toml --aa 1 --view front --frames 0..1 -o f_#.png").done();
    let at = |name: &str| covered(&Picture::decode(&folder.get(name)))[0][0];
    assert!(at("f_1.png") >= at("f_0.png") + 6, "{} {}", at("f_0.png"), at("f_1.png"));
    // And each frame is what it is by itself
    folder.run("render scene.toml --aa 1 --view front --time 1 -o one.png").done();
    assert_eq!(folder.get("one.png"), folder.get("f_1.png"));
}

#[test]
fn the_text_of_a_completed_scene_means_the_same_bits() {
    let folder = with_model();
    let options = "--size 20x14 --aa 2 --view -40,25 --margin 0.1 --background 0.1,0.2,0.3 --smooth 30";
    // How a picture is antialiased is no matter of the scene
    folder.run(&format!("render models/tetra.ply {options} --aa-mode adaptive -o a.exr")).done();
    let model = folder.get("a.exr");
    // To standard output: its files are seen from the working folder
    let text = folder.run(&format!("render models/tetra.ply {options} --print-scene")).done().text();
    assert!(text.contains("file = \"models/tetra.ply\"") && text.contains("[camera]"), "{text}");
    assert_eq!(text.matches("[[light.rectangle]]").count(), 3, "{text}");
    for part in ["[[mesh]]", "name = \"ground\"", "display = \"neutral\"", "background = [0.1, 0.2, 0.3]"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    folder.put("all.toml", &text);
    let run = folder.run("render all.toml -o b.exr").done();
    assert!(!run.stderr.contains("note:"), "{}", run.stderr);
    let pixels = |exr: &[u8]| firstlight::StoredImage::read(exr).unwrap().pixels;
    assert_eq!(pixels(&folder.get("b.exr")), pixels(&model));
    folder.run_with_input("render - -o c.exr", text.as_bytes()).done();
    assert_eq!(pixels(&folder.get("c.exr")), pixels(&model));
    // And it is its own text
    let again = folder.run("render all.toml --print-scene").done().text();
    assert_eq!(again.split_once('\n').unwrap().1, text.split_once('\n').unwrap().1);
    // To a file: seen from there, and nothing is written over
    folder
        .run(&format!("render models/tetra.ply {options} --print-scene=models/of.toml"))
        .done()
        .says(&["wrote models/of.toml"]);
    assert!(String::from_utf8(folder.get("models/of.toml")).unwrap().contains("file = \"tetra.ply\""));
    folder.run("render models/of.toml -o d.exr").done();
    // The same names of files: the same file, but for how the camera was found and the model read
    let all = |exr: &[u8]| {
        let mut file = firstlight::StoredPlanes::read(exr).unwrap();
        file.receipt.entries.retain(|(key, _)| !["view", "margin", "model"].contains(&key.as_str()));
        file
    };
    assert_eq!(all(&folder.get("d.exr")), all(&model));
    folder
        .run("render models/tetra.ply --print-scene=models/of.toml")
        .exits(1)
        .says(&["models/of.toml", "is there already"]);
    std::fs::create_dir(folder.path("other")).unwrap();
    folder.run("render models/tetra.ply --print-scene=other/of.toml").done().says(&["--allow-dir models"]);
    folder.run("render other/of.toml --allow-dir models --size 4 --aa 1 -o e.png").done();
    // Built-in scenes and course files are scenes as well
    folder.put("course.txt", crate::common::COURSE);
    for (scene, options) in [("config23", "--size 9 --aa 1 --samples 4"), ("course.txt", "")] {
        let text = folder.run(&format!("render {scene} {options} --print-scene")).done().text();
        folder.put("said.toml", text);
        folder.run(&format!("render {scene} {options} -o a.png")).done();
        folder.run("render said.toml -o b.png").done();
        assert_eq!(Picture::decode(&folder.get("a.png")).data, Picture::decode(&folder.get("b.png")).data, "{scene}");
    }
}

#[test]
fn a_picture_beyond_the_limit_is_made_in_parts() {
    let folder = Folder::new();
    folder.put("scene.toml", SCENE.replace("width = 36\nheight = 24", "width = 65536\nheight = 65536"));
    folder.run("check scene.toml").done();
    folder
        .run("render scene.toml -o a.png")
        .exits(2)
        .says(&["65536 x 65536 are 4294967296 pixels", "--crop X,Y,WIDTH,HEIGHT"]);
    let part = |crop: &str| {
        folder.run(&format!("render scene.toml --aa 1 --samples 4 --crop {crop} -o a.png")).done();
        Picture::decode(&folder.get("a.png"))
    };
    // Parts agree where they overlap, at the far corner and across the ball's edge
    for [x, y] in [[65528, 65530], [28000, 33000]] {
        let whole = part(&format!("{x},{y},8,6"));
        let right = part(&format!("{},{},4,3", x + 4, y + 3));
        assert_eq!(whole.part(4, 3, 4, 3), right.part(0, 0, 4, 3), "{x} {y}");
    }
    folder.run("render scene.toml --crop 0,0,65536,2049 -o b.png").exits(2).says(&["134217728"]);
    assert!(!folder.names().contains(&"b.png".to_owned()));
}
