//! Motion from one picture to another: whereto it leads, and what cannot be.

use crate::common::{Folder, SCENE};

/// The scene with a ball that moves 1 m in a second, at two frames a second.
fn moving() -> Folder {
    let folder = Folder::new();
    let keys = "transform = { keys = [{ time = 0, translate = [0, 0, 0] }, { time = 8, translate = [8, 0, 0] }] }\n";
    let scene = SCENE.replace("radius = 1\n", &format!("radius = 1\n{keys}"));
    folder.put("scene.toml", scene.replace("samples = 16", "samples = 16\nfps = 2"));
    folder
}

/// An entry of the receipt in an EXR file: a text after its name, its type and its length.
fn entry(exr: &[u8], key: &str) -> Option<String> {
    let head = format!("firstlight:{key}\0string\0");
    let start = exr.windows(head.len()).position(|part| part == head.as_bytes())? + head.len();
    let length = u32::from_le_bytes(exr[start..start + 4].try_into().unwrap()) as usize;
    Some(String::from_utf8(exr[start + 4..][..length].to_vec()).unwrap())
}

#[test]
fn it_leads_to_a_time_a_frame_or_a_camera() {
    let folder = moving();
    let of = |options: &str| folder.run(&format!("render scene.toml {options} -o - --format exr")).done().stdout;
    let at_half = of("--buffers motion --motion-to 0.5");
    assert_eq!(entry(&at_half, "motion_to").as_deref(), Some("0.5"));
    // The next frame is half a second later
    assert!(of("--buffers motion --motion-to next") == at_half);
    let back = of("--buffers motion --motion-to previous --time 0.5");
    assert_eq!(entry(&back, "motion_to").as_deref(), Some("0"));
    assert!(of("--buffers motion --motion-to 0 --time 0.5") == back && back != at_half);
    let camera = of("--buffers motion --motion-to side");
    assert_eq!(entry(&camera, "motion_to").as_deref(), Some("\"side\""));
    // Without a word on the command line the scene's own
    let text = String::from_utf8(folder.get("scene.toml")).unwrap();
    let own = text.replace("[render]\n", "[render]\nbuffers = [\"motion\"]\nmotion_to = \"next\"\n");
    folder.put("scene.toml", &own);
    assert!(of("") == at_half && of("--motion-to side") == camera);
    let printed = folder.run("render scene.toml --print-scene --motion-to -1.5").done().stdout;
    assert!(String::from_utf8(printed).unwrap().contains("motion_to = -1.5"));
    // A scene that says it may be asked for something else
    folder.run("render scene.toml --buffers depth -o a.exr").done();
}

#[test]
fn each_frame_leads_to_the_next() {
    let folder = moving();
    folder.run("render scene.toml --frames 1..2 --buffers motion --motion-to next -o f_#.exr").done();
    for (frame, to) in [(1, "1"), (2, "1.5")] {
        let file = folder.get(&format!("f_{frame}.exr"));
        assert_eq!(entry(&file, "motion_to").as_deref(), Some(to));
        let alone = folder.run(&format!(
            "render scene.toml --time {} --buffers motion --motion-to {to} -o - --format exr",
            f64::from(frame) / 2.0
        ));
        assert!(alone.done().stdout == file);
    }
}

#[test]
fn motion_changes_no_pixel_of_the_picture() {
    let folder = moving();
    let plain = folder.png("");
    folder.run("render scene.toml --buffers color,motion,motion-backward --motion-to 2 -o a.exr -o a.png").done();
    assert!(folder.get("a.png") == plain);
    let exr = folder.get("a.exr");
    for channel in ["motion.X", "motion.Y", "motion.visible", "motion-backward.X", "firstlight:motion_to"] {
        assert!(exr.windows(channel.len()).any(|part| part == channel.as_bytes()), "{channel}");
    }
}

#[test]
fn what_leads_nowhere_is_said() {
    let folder = moving();
    folder
        .run("render scene.toml --buffers motion -o a.npz")
        .exits(2)
        .says(&["the buffer motion leads nowhere", "--motion-to"]);
    folder.run("render scene.toml --motion-to 1 -o a.npz").exits(2).says(&["--motion-to", "name one with --buffers"]);
    folder.run("render scene.toml --buffers motion --motion-to 2e9 -o a.npz").exits(2).says(&["-1e9 to 1e9"]);
    folder.run("render scene.toml --buffers motion --motion-to sid -o a.npz").exits(2).says(&["sid", "front, side"]);
    folder.run("render scene.toml --buffers motion --motion-to 1 -o a.png").exits(2).says(&[".exr and .npz"]);
    let text = String::from_utf8(folder.get("scene.toml")).unwrap();
    folder.put("own.toml", text.replace("[render]\n", "[render]\nbuffers = [\"motion\"]\n"));
    folder.run("render own.toml -o a.npz").exits(1).says(&["render.buffers[0]", "motion_to"]);
    assert_eq!(folder.names(), ["own.toml", "scene.toml"]);
}
