//! Output is whole or absent, whatever happens.

use std::fs;

use crate::common::{Folder, size_of};

#[test]
fn an_output_that_cannot_be_is_found_before_rendering() {
    let folder = Folder::with_scene();
    fs::create_dir(folder.path("folder.png")).unwrap();
    fs::create_dir(folder.path("folder.json")).unwrap();
    let long = "--width 4096 --aa 64"; // hours, if it began
    for (output, said) in
        [("nowhere/a.png", "there is no folder"), ("folder.png", "is a folder"), ("scene.toml/a.png", "scene.toml")]
    {
        folder.run(&format!("render scene.toml {long} -o good.png -o {output}")).exits(1).says(&[output, said]);
        let stats = output.replace(".png", ".json");
        folder.run(&format!("render scene.toml {long} --stats={stats}")).exits(1).says(&[&stats, said]);
    }
    #[cfg(target_os = "linux")]
    folder.run(&format!("render scene.toml {long} -o /sys/a.png")).exits(1).says(&["/sys/a.png"]);
    assert_eq!(folder.names(), ["folder.json", "folder.png", "scene.toml"]);
}

#[test]
fn nothing_is_written_over_something_else_of_the_same_run() {
    let folder = Folder::with_scene();
    fs::create_dir(folder.path("sub")).unwrap();
    folder.put("data.json", "{}");
    folder.put("text.png", crate::common::SCENE);
    for (line, said) in [
        ("scene.toml --stats=scene.toml", "must end in .json"),
        ("scene.toml --stats=scene.png", "must end in .json"),
        ("scene.toml --stats=numbers", "must end in .json"),
        ("scene.toml -o z.png --stats=./z.png", "must end in .json"),
        ("data.json --stats=data.json", "scene's own file"),
        ("data.json --stats=sub/../data.json", "scene's own file"),
        ("text.png -o text.png", "scene's own file"),
        ("text.png -o sub/../text.png", "scene's own file"),
        ("scene.toml -o z.png -o sub/../z.png", "twice"),
        ("scene.toml -o z.png -o sub/.././z.png", "twice"),
    ] {
        folder.run(&format!("render {line}")).exits(2).says(&[said]);
    }
    assert_eq!(folder.get("scene.toml"), crate::common::SCENE.as_bytes());
    assert_eq!(folder.get("data.json"), b"{}");
    assert_eq!(folder.get("text.png"), crate::common::SCENE.as_bytes());
    assert_eq!(folder.names(), ["data.json", "scene.toml", "sub", "text.png"]);
}

#[test]
#[cfg(unix)]
fn a_link_and_its_target_are_one_file() {
    use std::os::unix::fs::symlink;
    let folder = Folder::with_scene();
    symlink("scene.png", folder.path("numbers.json")).unwrap(); // the default output, which is not there yet
    symlink("scene.toml", folder.path("link.json")).unwrap();
    symlink("z.png", folder.path("link.png")).unwrap();
    folder.run("render scene.toml --stats=numbers.json").exits(2).says(&["same output"]);
    folder.run("render scene.toml --stats=link.json").exits(2).says(&["scene's own file"]);
    folder.run("render scene.toml -o z.png -o link.png").exits(2).says(&["twice"]);
    folder.put("z.png", "old");
    folder.run("render scene.toml -o z.png -o link.png").exits(2).says(&["twice"]);
    assert_eq!(folder.get("z.png"), b"old");
    assert_eq!(folder.get("scene.toml"), crate::common::SCENE.as_bytes());
}

#[test]
fn a_protected_file_is_found_before_rendering() {
    let folder = Folder::with_scene();
    folder.put("a.png", "old");
    let mut permissions = fs::metadata(folder.path("a.png")).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(folder.path("a.png"), permissions).unwrap();
    folder.run("render scene.toml --width 4096 --aa 64 -o a.png").exits(1).says(&["a.png", "read-only"]);
    assert_eq!(folder.get("a.png"), b"old");
}

#[test]
fn a_course_file_with_an_unknown_ending_says_which_are_known() {
    let folder = Folder::new();
    folder.put("course.txt", crate::common::COURSE.replace("course.png", "course.bmp"));
    for command in ["render", "check"] {
        let ran = folder.run(&format!("{command} course.txt")).exits(1).says(&["output_file", ".png", "-o"]);
        assert_eq!(ran.stderr.matches("course.bmp").count(), 1, "{}", ran.stderr);
        assert!(ran.stdout.is_empty());
    }
    folder.run("render course.txt -o a.png").done();
}

#[test]
#[cfg(unix)]
fn a_course_file_cannot_send_control_characters() {
    let folder = Folder::new();
    folder.put("course.txt", crate::common::COURSE.replace("course.png", "\u{1b}[31ma.png"));
    let ran = folder.run("render course.txt").done().says(&["wrote \\u{1b}[31ma.png"]);
    assert!(!ran.stderr.contains('\u{1b}'), "{:?}", ran.stderr);
    // A link's line names two paths
    fs::remove_file(folder.path("\u{1b}[31ma.png")).unwrap();
    folder.put("\u{1b}b.png", "");
    std::os::unix::fs::symlink("\u{1b}b.png", folder.path("\u{1b}[31ma.png")).unwrap();
    let ran = folder.run("render course.txt").done().says(&["a link", "b.png was replaced"]);
    assert!(!ran.stderr.contains('\u{1b}'), "{:?}", ran.stderr);
}

#[test]
fn an_old_file_is_replaced() {
    let folder = Folder::with_scene();
    folder.put("a.png", "old");
    folder.run("render scene.toml -o a.png").done();
    assert_eq!(size_of(&folder.path("a.png")), (36, 24));
    assert_eq!(folder.names(), ["a.png", "scene.toml"]);
}

#[test]
#[cfg(unix)]
fn a_new_file_is_as_readable_as_any() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::with_scene();
    folder.run("render scene.toml -o a.png --stats=a.json").done();
    let mode = |name| fs::metadata(folder.path(name)).unwrap().permissions().mode();
    assert_eq!(mode("a.png"), mode("scene.toml"), "{:o} {:o}", mode("a.png"), mode("scene.toml"));
    assert_eq!(mode("a.json"), mode("scene.toml"));
}

#[test]
#[cfg(unix)]
fn a_link_stays_a_link() {
    use std::os::unix::fs::symlink;
    let folder = Folder::with_scene();
    fs::create_dir(folder.path("real")).unwrap();
    folder.put("real/a.png", "old");
    symlink("real/a.png", folder.path("link.png")).unwrap();
    folder.run("render scene.toml -o link.png").done().says(&["wrote link.png", "real/a.png"]);
    assert!(fs::symlink_metadata(folder.path("link.png")).unwrap().is_symlink());
    assert_eq!(size_of(&folder.path("real/a.png")), (36, 24));
    // One that leads nowhere is found early
    symlink("nowhere/a.png", folder.path("lost.png")).unwrap();
    folder.run("render scene.toml -o lost.png").exits(1).says(&["lost.png", "nowhere"]);
}

#[test]
#[cfg(unix)]
fn a_device_is_written_to_directly_and_says_so() {
    let folder = Folder::with_scene();
    std::os::unix::fs::symlink("/dev/null", folder.path("null.png")).unwrap();
    folder.run("render scene.toml -o null.png").done().says(&["wrote null.png", "directly"]);
    assert_eq!(folder.names(), ["null.png", "scene.toml"]);
    assert!(fs::symlink_metadata(folder.path("null.png")).unwrap().is_symlink());
    // Without an ending the format must be said
    folder.run("render scene.toml -o /dev/null").exits(2).says(&["/dev/null", ".png", "--format png"]);
    folder.run("render scene.toml -o /dev/null --format exr").done().says(&["wrote /dev/null directly"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_an_error() {
    let folder = Folder::with_scene();
    std::os::unix::fs::symlink("/dev/full", folder.path("full.png")).unwrap();
    folder.run("render scene.toml -o full.png").exits(1).says(&["full.png"]);
    for line in ["render scene.toml -o -", "scenes", "schema", "man", "check scene.toml", "--help"] {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let output = folder.command(line.split(' ')).stdout(full).output().unwrap();
        crate::common::ran(output).exits(1);
    }
}

/// The disk ends in the middle of a file: an error like any other, whether the signal that goes with it is ignored from
/// outside or not.
#[test]
#[cfg(unix)]
fn no_room_for_the_file_leaves_the_old_one() {
    for before in ["trap '' XFSZ; ", ""] {
        let folder = Folder::with_scene();
        folder.put("a.exr", "old");
        let program = env!("CARGO_BIN_EXE_firstlight");
        let line = format!("{before}ulimit -f 1; exec '{program}' render scene.toml --width 128 -o a.exr -o b.exr");
        let output =
            std::process::Command::new("sh").args(["-c", &line]).current_dir(folder.path("")).output().unwrap();
        let ran = crate::common::ran(output).exits(1).says(&["a.exr: cannot be written", "ulimit -f"]);
        assert!(!ran.stderr.contains(".firstlight-"), "{}", ran.stderr);
        assert_eq!(folder.get("a.exr"), b"old");
        assert_eq!(folder.names(), ["a.exr", "scene.toml"]);
    }
}

/// What can only be written to directly comes first, for it cannot be tried before.
#[test]
#[cfg(target_os = "linux")]
fn where_a_device_is_full_no_file_appears() {
    let folder = Folder::with_scene();
    folder.put("b.png", "old");
    folder
        .run("render scene.toml -o a.png -o b.png -o /dev/full --format png")
        .exits(1)
        .says(&["/dev/full: cannot be written", "free some space"]);
    assert_eq!(folder.get("b.png"), b"old");
    assert_eq!(folder.names(), ["b.png", "scene.toml"]);
    let full = fs::File::options().write(true).open("/dev/full").unwrap();
    let output = folder.command(["render", "scene.toml", "-o", "a.png", "-o", "-"]).stdout(full).output().unwrap();
    crate::common::ran(output).exits(1).says(&["standard output"]);
    assert_eq!(folder.names(), ["b.png", "scene.toml"]);
}

/// A scene with a texture, an included text and a mesh, each named so that an output may be mistaken for it.
fn with_files() -> Folder {
    let folder = Folder::new();
    let scene = format!(
        "include = [\"lights.json\"]\n{}\n[texture.image.wall]\nfile = \"wall.png\"\n[material.phong.wall]\n\
         diffuse = {{ texture = \"wall\" }}\n[[mesh]]\nfile = \"mesh.exr\"\nmaterial = \"wall\"\n",
        crate::common::SCENE
    );
    folder.put("wall.toml", scene);
    folder.put("lights.json", r#"{ "light": { "point": [{ "position": [0, 9, 0], "strength": 1 }] } }"#);
    // What a file holds decides what it is
    folder.put(
        "mesh.exr",
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
        endloop\nendfacet\nendsolid a\n",
    );
    folder.put("wall.png", texture());
    folder
}

/// A picture that is not ours.
fn texture() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&[200; 12]).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn what_the_scene_read_is_not_written_over() {
    let folder = with_files();
    fs::create_dir(folder.path("sub")).unwrap();
    let all =
        |folder: &Folder| folder.names().into_iter().filter(|n| n != "sub").map(|n| (folder.get(&n), n)).collect();
    let before: Vec<(Vec<u8>, String)> = all(&folder);
    let hours = "--width 4096 --aa 64";
    for (outputs, said) in [
        ("-o wall.png", ["the picture wall.png would replace wall.png", "which the scene is made of; name another"]),
        ("-o sub/../wall.png", ["the picture sub/../wall.png would replace wall.png", "name another"]),
        ("-o a.png -o mesh.exr", ["the picture mesh.exr would replace mesh.exr", "with -o"]),
        ("-o a.png --heat wall.png", ["--heat wall.png would replace wall.png", "name another file"]),
        ("-o a.png --stats=lights.json", ["--stats=lights.json would replace lights.json", "name another file"]),
    ] {
        folder.run(&format!("render wall.toml {hours} {outputs}")).exits(2).says(&said);
        assert!(all(&folder) == before, "{outputs}: {:?}", folder.names());
    }
    // One of the frames to come
    folder.put("wall.0003.png", texture());
    let text = String::from_utf8(folder.get("wall.toml")).unwrap();
    folder.put("frames.toml", text.replace("wall.png", "wall.0003.png"));
    folder
        .run(&format!("render frames.toml {hours} --frames 0..5 -o wall.png"))
        .exits(2)
        .says(&["replace wall.0003.png"]);
    assert!(!folder.path("wall.0000.png").exists());
    // Elsewhere, all is well
    folder.run("render wall.toml -o sub/wall.png --stats=sub/lights.json --heat sub/heat.png").done();
}

#[test]
#[cfg(unix)]
fn what_the_scene_read_is_known_by_all_its_names() {
    let folder = with_files();
    std::os::unix::fs::symlink("wall.png", folder.path("link.png")).unwrap();
    fs::hard_link(folder.path("wall.png"), folder.path("hard.png")).unwrap();
    fs::hard_link(folder.path("wall.toml"), folder.path("scene.png")).unwrap();
    fs::hard_link(folder.path("lights.json"), folder.path("hard.json")).unwrap();
    for (outputs, file) in [
        ("-o link.png", "wall.png"),
        ("-o hard.png", "wall.png"),
        ("-o scene.png", "wall.toml"),
        ("--stats=hard.json", "lights.json"),
    ] {
        let said = format!("would replace {file}, which the scene is made of");
        folder.run(&format!("render wall.toml {outputs}")).exits(2).says(&[&said]);
    }
    assert_eq!(folder.get("hard.png"), texture());
    // Standard output sent to the end of it, and a scene from standard input
    let wall = fs::File::options().append(true).open(folder.path("wall.png")).unwrap();
    let output = folder.command(["render", "wall.toml", "-o", "-"]).stdout(wall).output().unwrap();
    crate::common::ran(output).exits(2).says(&["the picture - would replace wall.png"]);
    assert_eq!(folder.get("wall.png"), texture());
    #[cfg(target_os = "linux")]
    {
        let scene = fs::File::open(folder.path("wall.toml")).unwrap();
        let output = folder.command(["render", "-", "-o", "scene.png"]).stdin(scene).output().unwrap();
        crate::common::ran(output).exits(2).says(&["the picture scene.png would replace"]);
    }
}

#[test]
fn the_default_name_takes_no_place_but_that_of_our_own_pictures() {
    let folder = with_files();
    let quick = "--width 8 --aa 1 --samples 1";
    let said = "wall.png is there and is no picture of firstlight; writing wall.render.png\nwrote wall.render.png\n";
    let ran = folder.run(&format!("render wall.toml {quick}")).done();
    assert_eq!(ran.stderr, said);
    assert_eq!(folder.get("wall.png"), texture());
    // The second time it is there already, and ours
    let ran = folder.run(&format!("render wall.toml {quick}")).done();
    assert_eq!(ran.stderr, said.replace("wrote wall.render.png", "wrote wall.render.png (replaced)"));
    folder.put("wall.render.png", "notes");
    folder
        .run(&format!("render wall.toml {quick}"))
        .exits(1)
        .says(&["wall.png and wall.render.png would replace files that are no pictures of firstlight", "-o"]);
    // A model beside its texture, as models are shipped
    folder.put(
        "bunny.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n\
        3 0 1 2\n",
    );
    folder.put("bunny.png", texture());
    folder.run(&format!("render bunny.ply {quick}")).done().says(&["wrote bunny.render.png"]);
    assert_eq!(folder.get("bunny.png"), texture());
    // Frames, of which one is not ours
    folder.put("scene.toml", crate::common::SCENE);
    folder.put("scene.0002.png", texture());
    folder.run(&format!("render scene.toml {quick} --frames 1..2")).done().says(&["wrote scene.render.0002.png"]);
    assert!(!folder.path("scene.0001.png").exists());
    // Our own picture as a texture: it is read, so it stays
    let text = String::from_utf8(folder.get("wall.toml")).unwrap();
    folder.run("render scene.toml --width 8 -o ours.png").done();
    folder.put("ours.toml", text.replace("wall.png", "ours.png"));
    let ours = folder.get("ours.png");
    folder.run("render ours.toml").exits(2).says(&["the picture ours.png would replace ours.png"]);
    assert!(folder.get("ours.png") == ours);
}

#[test]
fn a_file_that_was_there_is_said_to_be_replaced() {
    let folder = Folder::with_scene();
    let say = |line: &str| folder.run(line).done().stderr;
    assert_eq!(say("render scene.toml --stats=n.json"), "wrote scene.png\nwrote n.json\n");
    assert_eq!(say("render scene.toml --stats=n.json"), "wrote scene.png (replaced)\nwrote n.json (replaced)\n");
}

/// Small files that decoders panic on: nothing is heard of that but a damaged picture, with its name.
#[test]
fn a_damaged_texture_is_told_by_its_name() {
    let corpus = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus/picture");
    for (file, why) in [
        ("palette-of-44-bytes.png", "PNG file: its palette has 44 bytes, not 3 for each"),
        ("two-components.jpg", "JPEG file: its frame has 2 components"),
        ("decoder-fails-upsampling.jpg", "JPEG file: its decoder failed on it; write or fetch it anew"),
    ] {
        let folder = with_files();
        fs::copy(corpus.join(file), folder.path("wall.png")).unwrap();
        let said = format!("\"wall.png\" cannot be read as a picture: is a damaged {why}");
        let ran = folder.run("render wall.toml -o a.png").done().says(&[&said, "magenta and black stand in for it"]);
        assert!(!ran.stderr.contains(".rs:"), "{}", ran.stderr);
        folder.run("render wall.toml -o b.png --strict").exits(1).says(&[&said]);
        assert!(!folder.path("b.png").exists());
    }
}

/// Names that are no UTF-8, of everything that can be named on the command line.
#[test]
#[cfg(target_os = "linux")]
fn file_names_need_not_be_utf8() {
    use std::ffi::{OsStr, OsString};
    use std::os::unix::ffi::OsStrExt;
    let folder = with_files();
    let name =
        |ending: &str| -> OsString { OsStr::from_bytes(&[b"caf\xe9".as_slice(), ending.as_bytes()].concat()).into() };
    let put = |ending: &str, bytes: &[u8]| fs::write(folder.path("").join(name(ending)), bytes).unwrap();
    let there = |ending: &str| folder.path("").join(name(ending)).is_file();
    let run = |command: &str, args: &[&OsStr]| {
        let args = std::iter::once(OsStr::new(command)).chain(args.iter().copied());
        crate::common::ran(folder.command(args).output().unwrap()).done()
    };
    put(".toml", &folder.get("wall.toml"));
    run("check", &[&name(".toml")]);
    run("info", &[&name(".toml")]);
    run("render", &[&name(".toml")]).says(&["wrote caf\u{fffd}.png"]);
    assert!(there(".png"));
    run("render", &[&name(".toml"), OsStr::new("-o"), &name("##.exr"), OsStr::new("--frames"), OsStr::new("3")]);
    assert!(there("03.exr"));
    let mut stats = OsString::from("--stats=");
    stats.push(name(".json"));
    run("render", &[&name(".toml"), &stats, OsStr::new("--heat"), &name(".heat.png")]);
    assert!(there(".json") && there(".heat.png"));
    // A folder of that name, with a scene that includes and reads what lies beside it
    let inner = folder.path("").join(name(""));
    fs::create_dir(&inner).unwrap();
    for file in ["wall.toml", "lights.json", "mesh.exr", "wall.png"] {
        fs::copy(folder.path(file), inner.join(file)).unwrap();
    }
    run("render", &[inner.join("wall.toml").as_os_str(), OsStr::new("-o"), inner.join("a.png").as_os_str()]);
    assert!(inner.join("a.png").is_file());
    // A model
    put(".stl", &folder.get("mesh.exr"));
    run("info", &[&name(".stl")]);
    run("check", &[&name(".stl")]);
    run("render", &[&name(".stl"), OsStr::new("--width"), OsStr::new("8")]).says(&["wrote caf\u{fffd}.png (replaced)"]);
}
