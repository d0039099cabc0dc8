//! What goes to standard output and what to standard error, and what happens when nobody reads them.

use std::io::pipe;

use crate::common::{Folder, QUICK, ran};

#[test]
fn quiet_is_silent() {
    let folder = Folder::with_scene();
    for option in ["--quiet", "-q"] {
        let ran = folder.run(&format!("render scene.toml -o a.png {option}")).done();
        assert!(ran.stdout.is_empty() && ran.stderr.is_empty(), "{}", ran.stderr);
    }
    // Errors are said all the same
    folder.run("render scene.toml -o nowhere/a.png --quiet").exits(1).says(&["nowhere"]);
}

#[test]
fn a_quick_render_says_one_line_on_standard_error() {
    let folder = Folder::new();
    let ran = folder.run(&format!("render {}", QUICK.join(" "))).done();
    assert!(ran.stdout.is_empty());
    assert_eq!(ran.stderr, "wrote config11.png\n");
}

#[test]
fn a_long_render_says_what_would_make_it_faster() {
    use std::io::{BufRead, BufReader};
    use std::process::Stdio;
    use std::time::{Duration, Instant};
    let folder = Folder::new();
    let line = "render config11 --width 700 --reference --threads 1 --tile-size 8";
    let mut child = folder.command(line.split_whitespace()).stderr(Stdio::piped()).spawn().unwrap();
    let (started, mut said) = (Instant::now(), String::new());
    let read = BufReader::new(child.stderr.take().unwrap()).read_line(&mut said);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(read.unwrap() > 0 && said.starts_with("advice: about ") && said.contains(" left; faster: "), "{said}");
    for way in ["--reference", "--samples 64", "--aa 2", "--width 350"] {
        assert!(said.contains(way), "{way}: {said}");
    }
    // Early enough to be of use, wherever the tests run
    assert!(started.elapsed() < Duration::from_secs(60), "{:?}", started.elapsed());
}

#[test]
fn the_picture_is_alone_on_standard_output() {
    let folder = Folder::with_scene();
    let loud = folder.run("render scene.toml -o - --stats").done();
    let still = folder.run("render scene.toml -o - --quiet").done();
    assert!(loud.stdout == still.stdout);
    assert!(still.stderr.is_empty());
    loud.says(&["camera rays"]);
}

#[test]
fn stats_are_a_table_on_standard_error() {
    let folder = Folder::with_scene();
    let parts =
        ["parse", "compile", "render", "write", "36 x 24 pixels", "2 threads", "camera rays", "shadow rays", "million"];
    for quiet in ["", "--quiet"] {
        let ran = folder.run(&format!("render scene.toml --threads 2 --stats {quiet}")).done().says(&parts);
        assert!(ran.stdout.is_empty());
    }
}

#[test]
fn stats_are_json_in_a_file_or_on_standard_output() {
    let folder = Folder::with_scene();
    let ran = folder.run("render scene.toml --stats=stats.json --threads 2 --crop 1,1,10,8").done();
    assert!(ran.stdout.is_empty());
    let stats: serde_json::Value = serde_json::from_slice(&folder.get("stats.json")).unwrap();
    for key in ["parse_s", "compile_s", "render_s", "write_s", "mrays_per_s"] {
        assert!(stats[key].as_f64().is_some_and(|n| n >= 0.0), "{key} in {stats}");
    }
    for key in ["camera_rays", "shadow_rays", "shadow_rays_skipped"] {
        assert!(stats[key].is_u64(), "{key} in {stats}");
    }
    assert!(stats["camera_rays"].as_u64() >= Some(80), "{stats}");
    assert_eq!(stats["peak_memory_bytes"].is_u64(), cfg!(target_os = "linux"));
    assert_eq!(stats["threads"], 2);
    assert_eq!([&stats["width"], &stats["height"]], [10, 8]);
    assert_eq!(stats["scene"], "scene.toml");
    assert_eq!(stats["version"], env!("CARGO_PKG_VERSION"));
    assert!(stats["simd"].as_str().is_some_and(|name| name != "auto"), "what auto meant here: {stats}");

    let ran = folder.run("render scene.toml --stats=- --quiet").done();
    let stats: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
    assert_eq!(stats["width"], 36);
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let folder = Folder::with_scene();
    for line in [
        "schema",
        "man",
        "scenes",
        "scenes config11",
        "completions zsh",
        "check scene.toml",
        "info scene.toml",
        "--help",
    ] {
        let (reader, writer) = pipe().unwrap();
        drop(reader);
        ran(folder.command(line.split(' ')).stdout(writer).output().unwrap()).done();
    }
}

#[test]
fn a_picture_that_nobody_takes_is_an_error() {
    let folder = Folder::with_scene();
    let (reader, writer) = pipe().unwrap();
    drop(reader);
    let output = folder.command(["render", "scene.toml", "-o", "-", "-o", "a.png"]).stdout(writer).output().unwrap();
    ran(output).exits(1).says(&["standard output", "closed"]);
    // All of them or none
    assert_eq!(folder.names(), ["scene.toml"]);
}

#[test]
fn with_standard_error_closed_it_works_all_the_same() {
    let folder = Folder::with_scene();
    for (line, code) in
        [("render scene.toml --stats", 0), ("render scene.toml --width 0", 2), ("render nothing.toml", 1)]
    {
        let (reader, writer) = pipe().unwrap();
        drop(reader);
        ran(folder.command(line.split(' ')).stderr(writer).output().unwrap()).exits(code);
    }
    assert_eq!(folder.names(), ["scene.png", "scene.toml"]);
}

/// Nothing that is no part of the picture may reach a file: two runs are the same bytes.
#[test]
fn two_runs_write_the_same_bytes() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml -o a.png -o a.exr -o a.hdr --threads 1").done();
    folder.run("render ./scene.toml -o b.png -o b.exr -o b.hdr --threads 4 --tile-size 32").done();
    for ending in ["png", "exr", "hdr"] {
        assert!(folder.get(&format!("a.{ending}")) == folder.get(&format!("b.{ending}")), "{ending}");
    }
}
