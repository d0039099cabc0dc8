//! `relight`: pictures with other lights from what a file keeps.

use crate::common::{Folder, SCENE};

const FULL: &str = "--width 24 --samples 4 --aa-mode full";

#[test]
fn a_file_is_lit_again() {
    let folder = Folder::with_scene();
    folder.put("stronger.toml", SCENE.replace("strength = 30", "strength = 45"));
    folder
        .run(&format!("render scene.toml {FULL} --buffers color,relight -o kept.exr -o kept.npz -o before.png"))
        .done();
    folder.run(&format!("render stronger.toml {FULL} -o after.png -o after.exr")).done();
    for kept in ["kept.exr", "kept.npz"] {
        folder.run(&format!("relight {kept} --light #1=x1.5 -o relit.png -o relit.exr")).done();
        folder.run("diff relit.png after.png").done();
        folder.run("diff relit.exr after.exr --buffers color").done();
    }
    folder.run("relight kept.npz --light #1=30 --light #2=#ffffff -o same.png").done();
    folder.run("diff same.png before.png").done();
    // A picture of no scene
    let said = folder.run("verify relit.png --scene scene.toml");
    assert_eq!(said.code, Some(1));
    assert!(said.stderr.contains("was lit again"), "{}", said.stderr);
}

#[test]
fn what_cannot_be_lit_again_is_an_error() {
    let folder = Folder::with_scene();
    folder
        .run("render scene.toml --width 8 --aa 1 --samples 1 --buffers color,relight -o kept.npz -o plain.png")
        .done();
    for (line, code, words) in [
        ("relight kept.npz --light key=x2 -o a.png", 1, "no light is called key; none has a name; they are #1 to #2"),
        ("relight plain.png --light #1=x2 -o a.png", 1, "render it with --buffers color,relight"),
        ("relight none.exr --light #1=x2 -o a.png", 1, "none.exr: no such file"),
        ("relight kept.npz --light #1 -o a.png", 2, "sets its colour"),
        ("relight kept.npz -o a.png", 2, "--light"),
        ("relight kept.npz --light #1=x2", 2, "--output"),
        ("relight kept.npz --light #1=x2 -o kept.npz", 2, "would replace the file that is lit again"),
        ("relight kept.npz --light #1=x2 -o a.gif", 2, ".gif"),
        ("relight kept.npz --light #1=x2 -o none/a.png", 1, "none"),
    ] {
        let said = folder.run(line);
        assert_eq!(said.code, Some(code), "{line}: {}", said.stderr);
        assert!(said.stderr.contains(words), "{line}: {}", said.stderr);
    }
    assert_eq!(folder.names(), ["kept.npz", "plain.png", "scene.toml"]);
}
