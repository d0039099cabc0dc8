//! Several scenes in one call.

use crate::common::{COURSE, Folder, Picture, QUICK, SCENE};

/// A small scene as three files, of which the second has a fault.
fn three() -> Folder {
    let folder = Folder::new();
    for name in ["a", "c"] {
        folder.put(&format!("{name}.toml"), SCENE);
    }
    folder.put("b.toml", SCENE.replace("radius = 1", "radius = 0"));
    std::fs::create_dir(folder.path("out")).unwrap();
    folder
}

fn files(folder: &Folder, within: &str) -> Vec<String> {
    let entries = std::fs::read_dir(folder.path(within)).unwrap();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn one_that_fails_does_not_keep_the_others_from_being_rendered() {
    let folder = three();
    let quick = QUICK.join(" ");
    folder
        .run(&format!("render a.toml b.toml c.toml none.toml -o out/{{stem}}.png {quick}"))
        .exits(1)
        .says(&["[2 of 4] b.toml", "radius: 0 is outside", "none.toml: no such file"])
        .says(&[
            "wrote out/a.png",
            "wrote out/c.png",
            "2 of 4 scenes were rendered; 2 could not be:\n  b.toml\n  none.toml\n",
        ]);
    assert_eq!(files(&folder, "out"), ["a.png", "c.png"]);
    // The bytes of a call for itself
    folder.run(&format!("render a.toml -o out/{{stem}}_alone.png {quick}")).done();
    assert_eq!(folder.get("out/a_alone.png"), folder.get("out/a.png"));
    // Without -o each has its own name; quiet says what is wrong, and the summary of it
    let run = folder.run(&format!("render c.toml a.toml config11 --quiet {quick}")).done();
    assert_eq!(run.stderr, "");
    assert_eq!(folder.names(), ["a.png", "a.toml", "b.toml", "c.png", "c.toml", "config11.png", "out"]);
    let run = folder.run(&format!("render b.toml a.toml --quiet {quick}")).exits(1);
    assert!(run.stderr.ends_with("1 of 2 scenes were rendered; 1 could not be:\n  b.toml\n"), "{}", run.stderr);
}

#[test]
fn names_of_those_that_failed_are_whole() {
    let folder = three();
    let long = format!("{}.toml", "x".repeat(200));
    let run = folder.run(&format!("render {long} a.toml none.toml --quiet {}", QUICK.join(" "))).exits(1);
    let list = format!("1 of 3 scenes were rendered; 2 could not be:\n  {long}\n  none.toml\n");
    assert!(run.stderr.ends_with(&list), "{}", run.stderr);
}

#[test]
fn what_would_be_one_file_is_refused_before_anything_is_rendered() {
    let folder = three();
    folder.put("a.json", "{}");
    folder.put("a.toml.json", "{}");
    std::fs::create_dir(folder.path("sub")).unwrap();
    folder.put("sub/a.toml", SCENE);
    folder.put("one.txt", COURSE);
    folder.put("two.txt", COURSE);
    let before = folder.names();
    for (options, words) in [
        (
            "a.toml a.json -o out/{stem}.png",
            "a.toml and a.json would both be written to out/a.png; {name} in the output's name keeps their endings \
             apart",
        ),
        (
            "c.toml a.toml ./a.toml -o out/{name}.png",
            "would both be written to out/a.toml.png; they are one file, name it once",
        ),
        ("a.toml a.toml -o out/{stem}.png", "would both be written to out/a.png; name it once"),
        // The hint proposes no placeholder that the name has already, nor one that would not help
        ("a.toml sub/a.toml -o out/{name}.png", "to out/a.toml.png; {parent} in the output's name keeps their folders"),
        (
            "a.toml sub/a.toml -o out/{stem}.png",
            "to out/a.png; {parent} in the output's name keeps their folders apart",
        ),
        (
            "one/a.toml two/one/a.toml -o out/{parent}-{stem}.png",
            "to out/one-a.png; {folder}, the path of a file's folder, in the output's name keeps them apart",
        ),
        // A course file says its own output
        ("one.txt two.txt", "one.txt and two.txt would both be written to course.png"),
        ("a.toml a.json --frames 0..1 -o out/{stem}_##.png", "out/a_00.png"),
        ("a.toml c.toml -o {stem}.png --heat ./{stem}.png", "./a.png"),
        // Nor may the numbers of one be written over the text of another
        (
            "a.toml a.toml.json -o out/{name}.png --stats={name}.json",
            "a.toml.json would replace the file of one of the scenes",
        ),
        ("c.toml a.json -o out/{stem}.png --stats={stem}.json", "--stats=a.json would replace the scene's own file"),
    ] {
        folder.run(&format!("render {options}")).exits(2).says(&[words]);
        assert_eq!((folder.names(), files(&folder, "out")), (before.clone(), Vec::new()), "{options}");
    }
    // Their endings tell them apart
    folder.put("a.json", r#"{ "camera": { "position": [0, 0, 5] } }"#);
    folder.run("render a.toml a.json -o out/{name}.png --size 4 --aa 1").done();
    assert_eq!(files(&folder, "out"), ["a.json.png", "a.toml.png"]);
}

#[test]
fn frames_heat_and_numbers_are_files_of_each() {
    let folder = three();
    let quick = QUICK.join(" ");
    let line = "render a.toml c.toml -o out/{stem}_#.png --heat out/{stem}.heat.png --stats=out/{name}.json".to_owned();
    folder.run(&format!("{line} --frames 3..4 {quick}")).done();
    assert_eq!(
        files(&folder, "out"),
        [
            "a.heat.0003.png",
            "a.heat.0004.png",
            "a.toml.json",
            "a_3.png",
            "a_4.png",
            "c.heat.0003.png",
            "c.heat.0004.png",
            "c.toml.json",
            "c_3.png",
            "c_4.png"
        ]
    );
    let stats = String::from_utf8(folder.get("out/c.toml.json")).unwrap();
    assert!(stats.contains("\"scene\": \"c.toml\"") && stats.contains("\"frames\": 2"), "{stats}");
    // A table after each
    let run = folder.run(&format!("render a.toml c.toml --quiet --stats {quick}")).done();
    assert_eq!(run.stderr.matches("camera rays").count(), 2, "{}", run.stderr);
    // The number of a frame goes into the name that was written, and not into that of the scene
    folder.put("d#1.toml", SCENE);
    folder.run(&format!("render d#1.toml --frames 2 -o out/{{stem}}.png {quick}")).done();
    assert_eq!(Picture::decode(&folder.get("out/d#1.0002.png")).size(), (24, 16));
}

#[test]
fn one_of_several_is_standard_input() {
    let folder = three();
    let line = format!("render - a.toml -o out/{{stem}}.png {}", QUICK.join(" "));
    folder.run_with_input(&line, SCENE.as_bytes()).done();
    assert_eq!(files(&folder, "out"), ["a.png", "scene.png"]);
    assert_eq!(folder.get("out/a.png"), folder.get("out/scene.png"));
}
