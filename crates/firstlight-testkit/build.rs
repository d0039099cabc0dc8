//! Makes a test of every folder under `scenes/golden` and of every scene of the gallery, so that each has a line of its
//! own in what the runner says and can be run by itself.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

fn main() {
    let scenes = Path::new(&std::env::var("CARGO_MANIFEST_DIR").expect("cargo says it")).join("../../scenes");
    println!("cargo::rerun-if-changed=build.rs");
    let mut text = String::new();
    for family in inside(&scenes.join("golden")) {
        let _ = writeln!(text, "mod {} {{", word(&family));
        for case in inside(&family) {
            let title = format!("{}/{}", name(&family), name(&case));
            let _ = writeln!(text, "    #[test]\n    fn {}() {{\n        super::hold({title:?});\n    }}", word(&case));
        }
        text += "}\n";
    }
    text += "mod gallery {\n";
    let gallery = inside(&scenes.join("gallery"));
    for scene in gallery.iter().filter(|path| path.extension().is_some_and(|e| e == "toml")) {
        let _ = writeln!(
            text,
            "    #[test]\n    fn {}() {{\n        super::hold_gallery({:?});\n    }}",
            word(&scene.with_extension("")),
            name(scene)
        );
    }
    text += "}\n";
    let out = std::env::var("OUT_DIR").expect("cargo says it");
    std::fs::write(Path::new(&out).join("golden.rs"), text).expect("cargo made the folder");
}

/// What is in a folder, by name; a change in it makes the tests anew.
fn inside(folder: &Path) -> Vec<PathBuf> {
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut found: Vec<_> = std::fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .map(|entry| entry.expect("the folder can be read").path())
        .collect();
    found.sort();
    found
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The name of a file as that of a function.
fn word(path: &Path) -> String {
    let word = name(path).replace(|c: char| !c.is_ascii_alphanumeric(), "_");
    if word == "box" { "r#box".into() } else { word }
}
