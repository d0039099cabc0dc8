//! Scenes with faults, and scenes that cannot be had.

use crate::common::{Folder, SCENE};

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
    // Whether nothing is a scene is the library's to say; the program ends well either way
    let ran = folder.run("check empty.toml");
    assert!(matches!(ran.code, Some(0 | 1)), "{}", ran.stderr);
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
        Folder::new().run("check /dev/zero").exits(1).says(&["/dev/zero", "67108864"]);
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
