//! Wrong usage: exit code 2, what is allowed, and no file.

use crate::common::{Folder, SCENE, ran};

/// The words after `firstlight`, and what must be said.
#[rustfmt::skip]
const BAD: &[(&str, &[&str])] = &[
    ("", &["Usage: firstlight"]),
    ("rendr scene.toml", &["rendr", "render"]),
    ("--loud", &["--loud"]),
    ("render scene.toml other.toml -o a.png", &["-o a.png", "several scenes", "'{stem}.png'"]),
    ("render scene.toml other.toml -o -", &["-o -", "takes one scene"]),
    ("render scene.toml other.toml -o {stem}.png --heat h/heat.png", &["--heat", "'h/{stem}.png'"]),
    ("render scene.toml other.toml -o {stem}.png --stats=s.json", &["--stats", "'{stem}.json'"]),
    ("render scene.toml sub/scene.toml", &["scene.toml and sub/scene.toml", "scene.png", "{parent} in the output"]),
    ("help rendr", &["rendr"]),
    ("render scene.toml scene.toml -o {name}.png", &["scene.toml.png"]),
    ("render scene.toml -o {frame}.png", &["{frame}", "{stem} and {name}"]),
    ("render scene.toml --size 0", &["--size", "256x512", "1 to 65536"]),
    ("render scene.toml --size 10x", &["--size", "10x"]),
    ("render scene.toml --size 10 --width 5", &["--size", "--width", "cannot be used with"]),
    ("render scene.toml --size 10 --height 5", &["--size", "--height", "cannot be used with"]),
    ("render scene.toml --background redd", &["redd", "did you mean red?", "#336699", "R,G,B"]),
    ("render scene.toml --background #ffff", &["#ffff", "#369", "hexadecimal digits"]),
    ("render scene.toml --background transparent", &["transparent", "a name of CSS"]),
    ("render scene.toml --background 0,0,0 --transparent", &["--background", "--transparent", "cannot be used with"]),
    ("render scene.toml --view front", &["--view", "scene.toml has one", "without a camera"]),
    ("render scene.toml --margin 0.1", &["--margin", "scene.toml has one"]),
    ("render scene.toml --view above", &["above", "right, side, top, bottom, iso", "AZIMUTH,ELEVATION"]),
    ("render scene.toml --margin 0.6", &["--margin", "0 to 0.45"]),
    ("render scene.toml --print-scene -o a.png", &["--print-scene", "cannot be used with"]),
    ("render scene.toml --print-scene --threads 2", &["--print-scene", "cannot be used with"]),
    ("render scene.toml --print-scene=a.png", &["--print-scene=a.png", ".toml"]),
    ("render scene.toml other.toml --print-scene", &["--print-scene writes one scene"]),
    ("render scene.toml --size 60000x60000", &["3600000000 pixels", "134217728", "--crop X,Y,WIDTH,HEIGHT"]),
    ("render scene.toml --widht 3", &["--widht", "--width"]),
    ("render scene.toml --width", &["--width"]),
    ("render scene.toml --width 0", &["--width", "0", "1 to 65536"]),
    ("render scene.toml --width 65537", &["--width", "65537", "1 to 65536"]),
    ("render scene.toml --width 1.5", &["--width", "1.5", "1 to 65536"]),
    ("render scene.toml --height 0", &["--height", "1 to 65536"]),
    ("render scene.toml --height -3", &["-3"]),
    ("render scene.toml --width 65536", &["65536 x 43691", "134217728"]),
    ("render scene.toml --width 65536 --height 65536", &["134217728"]),
    ("render scene.toml --aa 0", &["--aa", "1 to 64"]),
    ("render scene.toml --aa 65", &["--aa", "1 to 64"]),
    ("render scene.toml --samples 0", &["--samples", "1 to 1048576"]),
    ("render scene.toml --samples 1048577", &["--samples", "1 to 1048576"]),
    ("render scene.toml --samples many", &["--samples", "many", "1 to 1048576"]),
    ("render scene.toml --samples exacty", &["--samples", "1 to 1048576", "the word exact"]),
    ("render scene.toml --samples 99999999999", &["1 to 1048576"]),
    ("render scene.toml --aa 4X", &["--aa", "4X", "1 to 64"]),
    ("render scene.toml --height tall", &["--height", "1 to 65536"]),
    ("render scene.toml --threads all", &["--threads", "1 to 1024"]),
    ("render scene.toml --tile-size 8x8", &["--tile-size", "8 to 64"]),
    ("render scene.toml --camera=", &["--camera", "name of a camera"]),
    ("render scene.toml --threads 0", &["--threads", "1 to 1024"]),
    ("render scene.toml --threads 1025", &["--threads", "1 to 1024"]),
    ("render scene.toml --tile-size 7", &["--tile-size", "8 to 64"]),
    ("render scene.toml --tile-size 65", &["--tile-size", "8 to 64"]),
    ("render scene.toml --display filmic", &["--display", "srgb, neutral, linear or gamma=G"]),
    ("render scene.toml --exposure 65", &["--exposure", "-64 to 64"]),
    ("render scene.toml --exposure nan", &["--exposure", "-64 to 64"]),
    ("render scene.toml --crop 1,2,3", &["--crop", "X,Y,WIDTH,HEIGHT"]),
    ("render scene.toml --crop 0,0,0,5", &["--crop", "at least 1"]),
    ("render scene.toml --crop -1,0,5,5", &["-1,0,5,5"]),
    ("render scene.toml --crop 30,0,7,5", &["--crop 30,0,7,5", "36 x 24"]),
    ("render scene.toml --crop 4294967295,0,4294967295,1", &["--crop", "36 x 24"]),
    ("render scene.toml --crop 30,0,6,5 --width 18", &["--crop", "18 x 12"]),
    ("render scene.toml --camera back", &["back", "front, side"]),
    ("render config11 --camera back", &["back", "no cameras"]),
    ("render scene.toml --visibility guessed", &["guessed", "shafts", "traced"]),
    ("render scene.toml --simd mmx", &["mmx", "auto", "fallback", "avx2"]),
    ("render scene.toml --bits 12", &["12", "8", "16"]),
    ("render scene.toml --bits 16 -o a.exr", &["--bits", "PNG"]),
    ("render scene.toml --format gif -o -", &["gif", "png", "exr", "hdr"]),
    ("render scene.toml --quality high", &["--quality", "1 to 100", "--aa-mode full"]),
    ("render scene.toml --quality 0 -o a.jpg", &["--quality", "1 to 100"]),
    ("render scene.toml --quality 101 -o a.jpg", &["--quality", "1 to 100"]),
    ("render scene.toml --quality 50 -o a.png", &["--quality", "JPEG"]),
    ("render scene.toml --format exr", &["--format", "-o -"]),
    ("render scene.toml --format exr -o a.exr", &["--format", "-o -"]),
    ("render scene.toml -o a.gif", &["a.gif", ".png", ".exr", ".hdr"]),
    ("render scene.toml -o a", &["a", ".png", ".exr", ".hdr", "--format"]),
    ("render scene.toml -o .png", &[".png"]),
    ("render scene.toml -o", &["--output"]),
    ("render scene.toml -o a.png -o a.png", &["a.png", "twice"]),
    ("render scene.toml -o a.png -o ./a.png", &["a.png", "twice"]),
    ("render scene.toml -o - -o -", &["twice"]),
    ("render scene.toml -o - --stats=-", &["--stats", "-o"]),
    ("render scene.toml --quiet --quiet", &["--quiet"]),
    ("render scene.toml --allow-dir", &["--allow-dir"]),
    ("check", &["SCENE"]),
    ("check scene.toml --time 1", &["--time"]),
    ("info", &["SCENE"]),
    ("scenes config99", &["config99", "config11"]),
    ("completions tcsh", &["tcsh", "bash", "zsh", "fish", "elvish", "powershell"]),
    ("completions", &["SHELL"]),
    ("schema scene.toml", &["scene.toml"]),
];

#[test]
fn wrong_usage_is_exit_code_2_and_says_what_is_allowed() {
    let folder = Folder::with_scene();
    for (line, parts) in BAD {
        println!("firstlight {line}");
        let ran = folder.run(line).exits(2).says(parts);
        assert!(ran.stdout.is_empty(), "{line} answers");
        assert_eq!(folder.names(), ["scene.toml"], "{line} leaves a file");
    }
}

/// What is written with another program in mind, and what is there instead.
#[rustfmt::skip]
const MEANT: &[(&str, &str)] = &[
    ("scene.toml", "to render it: firstlight render scene.toml"),
    ("nowhere.ply", "to render it: firstlight render nowhere.ply"),
    ("config23", "to render it: firstlight render config23"),
    ("version", "firstlight --version"),
    ("show scene.toml", "nothing opens a window"),
    ("validate scene.toml", "firstlight check SCENE"),
    ("render scene.toml --spp 16", "points on each area light are --samples N, camera rays in each pixel --aa N"),
    ("render scene.toml --spp=16", "--samples N"),
    ("render scene.toml -j 4", "threads are --threads N"),
    ("render scene.toml -j4", "threads are --threads N"),
    ("render scene.toml --preset high", "--aa-mode full"),
    ("render scene.toml --resolution 320x240", "--width and --height"),
    ("render scene.toml --output-file a.png", "-o FILE"),
    ("render scene.toml --fps 30", "fps in [render]"),
    ("render scene.toml -f 1", "--frames A..B"),
    ("render scene.toml --max-bounces 4", "one bounce"),
    ("render scene.toml --denoise", "no noise"),
    ("check scene.toml --verbose", "--stats"),
];

#[test]
fn words_of_other_programs_lead_to_what_exists() {
    let folder = Folder::with_scene();
    for (line, part) in MEANT {
        println!("firstlight {line}");
        let ran = folder.run(line).exits(2).says(&["tip: ", part]);
        assert_eq!(ran.stderr.matches("tip: ").count(), 1, "{}", ran.stderr);
        assert_eq!(folder.names(), ["scene.toml"], "{line} leaves a file");
    }
}

#[test]
fn what_is_written_cannot_disturb_a_terminal() {
    let folder = Folder::with_scene();
    let odd = "a\u{1b}[2J\u{202e}b\n";
    let lines: &[&[&str]] = &[
        &[odd],
        &["render", odd],
        &["render", "scene.toml", odd],
        &["render", "scene.toml", &format!("--{odd}")],
        &["render", "scene.toml", "--width", odd],
        &["render", "scene.toml", "--camera", odd],
        &["render", "scene.toml", "-o", odd],
        &["render", "scene.toml", "--allow-dir", odd],
        &["render", "scene.toml", "--visibility", odd],
        &["scenes", odd],
        &["check", &format!("{odd}.ply")],
    ];
    for line in lines {
        let ran = ran(folder.command(*line).output().unwrap());
        assert!(matches!(ran.code, Some(1 | 2)), "{line:?}: {}", ran.stderr);
        assert!(
            !ran.stderr.chars().any(|c| c.is_control() && c != '\n' || c == '\u{202e}'),
            "{line:?}: {:?}",
            ran.stderr
        );
        assert!(ran.stderr.contains("a\\u{1b}[2J\\u{202e}b\\n"), "{line:?}: {:?}", ran.stderr);
    }
}

#[test]
fn a_long_name_is_cut() {
    let folder = Folder::new();
    for name in ["x".repeat(3000), format!("{}.ply", "x".repeat(3000)), format!("{}.toml", "x/".repeat(1000))] {
        let ran = folder.run(&format!("check {name}")).exits(1).says(&[" ... "]);
        assert!(ran.stderr.len() < 1300, "{}", ran.stderr);
    }
}

#[test]
fn a_grid_of_samples_is_square() {
    let folder = Folder::new();
    folder.put("scene.toml", format!("{SCENE}set = \"grid\"\n"));
    folder.run("render scene.toml --samples 12 -o a.png").exits(2).says(&["--samples 12", "9 and 16"]);
    folder.run("render scene.toml --samples 9 -o a.png").done();
    folder.run("render scene.toml --samples exact --width 4 --aa 1 -o a.png").done();
}

#[test]
fn faults_of_the_scene_come_before_what_follows_from_them() {
    let folder = Folder::new();
    folder.put("scene.toml", "[camera.front]\ncolour = 3\n");
    folder.run("render scene.toml --camera back").exits(1).says(&["scene.toml:2:", "colour"]);
}
