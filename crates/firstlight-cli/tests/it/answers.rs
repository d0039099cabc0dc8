//! Commands that answer: check, info, scenes, schema, completions, man, help.

use crate::common::{COURSE, Folder};

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
