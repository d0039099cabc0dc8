//! A moment, and one frame after the other.

use std::process::Stdio;

use crate::common::{Folder, GLTF, Picture, SCENE, ran};

/// A small scene with a light that moves 1 m in a second.
fn moving() -> Folder {
    let folder = Folder::new();
    let keys = "transform = { keys = [{ time = 0, translate = [0, 0, 0] }, { time = 8, translate = [8, 0, 0] }] }";
    let scene = SCENE.replace("position = [4, 6, 4]", &format!("position = [4, 6, 4]\n{keys}"));
    folder.put("scene.toml", scene.replace("samples = 16", "samples = 16\nfps = 2"));
    folder
}

#[test]
fn every_frame_is_a_picture_of_its_moment() {
    let folder = moving();
    let run = folder.run("render scene.toml --frames 1..3 -o f.png -o g_##.exr").done();
    let wrote = ["wrote f.0001.png", "wrote f.0002.png", "wrote f.0003.png", "wrote g_03.exr"];
    run.says(&wrote);
    assert_eq!(
        folder.names(),
        ["f.0001.png", "f.0002.png", "f.0003.png", "g_01.exr", "g_02.exr", "g_03.exr", "scene.toml"]
    );
    // The same bytes as that moment alone, and each with its time
    for (frame, time) in [(1, "0.5"), (2, "1"), (3, "1.5")] {
        let png = folder.get(&format!("f.000{frame}.png"));
        assert_eq!(png, folder.png(&format!("--time {time}")), "{frame}");
        let said = format!("firstlight:time\0\0\0\0\0{time}");
        assert!(png.windows(said.len()).any(|w| w == said.as_bytes()), "{frame}");
    }
    assert_ne!(folder.get("f.0001.png"), folder.get("f.0002.png"));
    // Before the first key it is as at the first; without --time it is the moment 0
    assert_eq!(folder.png("--time 0"), folder.png(""));
    let without_time = |png: Vec<u8>| crate::common::Picture::decode(&png).data;
    assert_eq!(without_time(folder.png("--time -3")), without_time(folder.png("")));
}

#[test]
fn what_does_not_move_is_the_same_at_all_times() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml --width 24 --aa 1 --samples 4 --frames 0..1 -o f.png").done();
    assert_eq!(folder.get("f.0000.png"), folder.get("f.0001.png"));
    folder.put("a.txt", crate::common::COURSE);
    folder.run("render a.txt --time 3 -o course.png").done();
    folder.run("render a.txt --frames 5").done();
    assert_eq!(folder.get("course.png"), folder.get("course.0005.png"));
}

#[test]
fn frames_and_outputs_that_cannot_be_are_wrong_usage() {
    let folder = moving();
    for (options, words) in [
        ("--frames 0..1 -o -", "--frames writes a file for each frame, and -o - is not one"),
        #[cfg(unix)]
        ("--frames 0..1 -o /dev/null --format png", "and /dev/null is not one"),
        ("--frames 0..1 --time 1 -o a.png", "cannot be used with"),
        ("--frames 2..1 -o a.png", "the last frame, 1, comes before the first, 2"),
        ("--frames=-1..1 -o a.png", "two whole numbers A..B from 0 to 9999999 are needed"),
        ("--frames 0..12 -o a_#.png -o a_1#.png", "two frames would be a_1"),
        ("--time soon -o a.png", "a number of seconds from -1e9 to 1e9 is needed"),
    ] {
        let line = format!("render scene.toml {options}");
        let mut command = folder.command(line.split_whitespace());
        ran(command.stdout(Stdio::piped()).output().unwrap()).exits(2).says(&[words]);
    }
    assert_eq!(folder.names(), ["scene.toml"]);
}

#[test]
fn textures_are_read_once_for_all_frames() {
    let folder = moving();
    let textured = String::from_utf8(folder.get("scene.toml")).unwrap();
    let image = "[texture.image.tiles]\nfile = \"tiles.png\"";
    folder.put("scene.toml", textured.replace("[texture.checkerboard.tiles]\ncounts = [8, 8]", image));
    // The texture is missing: said once, not once for each frame
    let run = folder.run("render scene.toml --width 24 --aa 1 --samples 4 --frames 0..2 -o f.png").done();
    assert_eq!(run.stderr.matches("no such file").count(), 1, "{}", run.stderr);
}

#[test]
fn a_frame_that_cannot_be_leaves_those_before_it() {
    let folder = moving();
    let scene = String::from_utf8(folder.get("scene.toml")).unwrap();
    folder.put(
        "scene.toml",
        scene.replace("translate = [0, 0, 0]", "scale = 1").replace("translate = [8, 0, 0]", "scale = -1"),
    );
    let words = "light.point[0].transform.keys: at 4 s the scale is [0, 0, 0], which is flat";
    folder.run("render scene.toml --width 24 --aa 1 --samples 4 --frames 7..9 -o f.png").exits(1).says(&[words]);
    assert_eq!(folder.names(), ["f.0007.png", "scene.toml"]);
}

#[test]
fn info_says_where_things_are_at_a_moment() {
    let folder = moving();
    let run = folder.run("info scene.toml --time 2.5").done();
    assert!(run.text().contains("time       2.5 s"), "{}", run.text());
    let run = folder.run("info scene.toml --json").done();
    assert!(run.text().contains("\"time\": 0.0"), "{}", run.text());
    let hash = |text: String| text.lines().find(|line| line.starts_with("hash")).map(str::to_owned);
    assert_eq!(
        hash(folder.run("info scene.toml --time 1").text()),
        hash(folder.run("info scene.toml").text()),
        "the hash is that of the description"
    );
}

#[test]
fn models_play_what_they_have() {
    let folder = Folder::new();
    folder.put("chair.gltf", GLTF);
    folder.put("still.gltf", GLTF.replace("\"animations\"", "\"extras\""));
    folder.put("still.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let quick = "--size 24 --aa 1 --studio flat --view front";
    let render = |what: &str| {
        folder.run(&format!("render {what} {quick} -o a.png")).done().says(&["wrote a.png"]);
        Picture::decode(&folder.get("a.png"))
    };
    // Half of the way to the right at 1 s; the camera of one moment goes with it
    let rest = render("chair.gltf");
    assert!(rest == render("chair.gltf --time 0"));
    assert!(rest == render("chair.gltf --time 1"));
    let frame = |options: &str| {
        folder.run(&format!("render chair.gltf {quick} {options} -o a.png")).done();
        Picture::decode(&folder.get("a.0024.png"))
    };
    let moved = frame("--frames 24..24");
    assert!(moved != rest);
    assert!(moved == frame("--frames 24..24 --animation fold"));
    // From all sides of a turntable, and again by the receipt
    folder.run(&format!("render chair.gltf {quick} --turntable 2 -o t#.png")).done();
    folder.run(&format!("render chair.gltf {quick} --turntable 2 --time 1 -o m#.png")).done();
    for [still, moving] in [["t0.png", "m0.png"], ["t1.png", "m1.png"]] {
        assert!(Picture::decode(&folder.get(still)) == Picture::decode(&folder.get(moving)), "{moving}");
    }
    folder.run("verify m1.png --scene chair.gltf").done();
    for still in ["still.gltf", "still.obj"] {
        let rest = render(still);
        assert!(rest == render(&format!("{still} --time 1")), "{still}");
        let note = format!("note: {still}: the model has no animation: its picture is the same at any --time");
        folder.run(&format!("render {still} {quick} --time 1 -o a.png")).done().says(&[&note]);
    }
    // Cameras likewise
    folder.run("render chair.gltf --size 24 --aa 1 --camera entry -o a.png").done();
    let run = folder.run("render still.obj --size 24 --aa 1 --camera entry -o a.png").exits(2);
    run.says(&["error: --camera entry: the scene names no cameras"]);
}
