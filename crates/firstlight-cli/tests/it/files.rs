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
        ("text.png", "scene's own file"),
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
    let ran = folder.run("render course.txt").done().says(&["wrote \u{fffd}[31ma.png"]);
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

/// The disk ends in the middle of a file: with the signal that goes with it ignored it is an error like any other, and
/// without it is the end of the program. No half file either way.
#[test]
#[cfg(unix)]
fn no_room_for_the_file_leaves_the_old_one() {
    for (before, code) in [("trap '' XFSZ; ", Some(1)), ("", None)] {
        let folder = Folder::with_scene();
        folder.put("a.exr", "old");
        let program = env!("CARGO_BIN_EXE_firstlight");
        let line = format!("{before}ulimit -f 1; exec '{program}' render scene.toml --width 128 -o a.exr -o b.exr");
        let output =
            std::process::Command::new("sh").args(["-c", &line]).current_dir(folder.path("")).output().unwrap();
        let ran = crate::common::ran(output);
        assert!(ran.code != Some(0) && !ran.stderr.contains("panicked"), "{}", ran.stderr);
        assert_eq!(folder.get("a.exr"), b"old");
        assert!(!folder.path("b.exr").exists());
        if code.is_some() {
            ran.exits(1).says(&["a.exr"]);
            assert_eq!(folder.names(), ["a.exr", "scene.toml"]);
        }
    }
}
