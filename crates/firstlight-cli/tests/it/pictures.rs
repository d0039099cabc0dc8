//! What the options do to a picture, and what they must not do.

use crate::common::{COURSE, Folder, Picture, QUICK, SCENE, size_of};

#[test]
fn without_a_scene_it_renders_config11() {
    let folder = Folder::new();
    folder.run(&format!("render {}", QUICK.join(" "))).done().says(&["wrote config11.png"]);
    assert_eq!(folder.names(), ["config11.png"]);
    assert_eq!(size_of(&folder.path("config11.png")), (24, 24));
}

#[test]
fn the_picture_is_called_like_the_scene() {
    let folder = Folder::with_scene();
    std::fs::create_dir(folder.path("below")).unwrap();
    folder.put("below/a.room.toml", SCENE);
    folder.run("render scene.toml").done();
    folder.run("render below/a.room.toml").done();
    folder.run(&format!("render config23 {}", QUICK.join(" "))).done();
    assert_eq!(folder.names(), ["a.room.png", "below", "config23.png", "scene.png", "scene.toml"]);
}

#[test]
fn one_side_alone_keeps_the_aspect_ratio() {
    let folder = Folder::with_scene();
    let size = |options| Picture::decode(&folder.png(options)).size();
    assert_eq!(size(""), (36, 24));
    assert_eq!(size("--width 18"), (18, 12));
    assert_eq!(size("--height 12"), (18, 12));
    assert_eq!(size("--width 1"), (1, 1));
    assert_eq!(size("--width 5 --height 7"), (5, 7));
}

#[test]
fn quality_options_change_the_picture() {
    let folder = Folder::with_scene();
    let plain = folder.png("");
    for option in ["--aa 3", "--samples 3", "--exposure -1.5", "--exposure=2", "--camera side"] {
        assert!(folder.png(option) != plain, "{option} changes nothing");
    }
    for option in ["--aa 2", "--samples 16", "--exposure 0", "--camera front", "--strict", "--allow-dir ."] {
        assert!(folder.png(option) == plain, "{option} is what the scene says, and changes something");
    }
}

#[test]
fn how_the_work_is_done_changes_no_byte() {
    let folder = Folder::with_scene();
    let plain = folder.png("");
    let options = [
        "--threads 1",
        "--threads 2",
        "--threads 7",
        "--tile-size 8",
        "--tile-size 64",
        "--simd auto",
        "--simd fallback",
        "--visibility shafts --simd fallback",
        "--quiet",
        "--stats",
    ];
    for option in options {
        assert!(folder.png(option) == plain, "{option} changes the picture");
    }
    // Every camera ray and every sample, by three renderers
    let every = folder.png("--aa-mode full");
    for option in ["--visibility traced", "--reference", "--reference --threads 3 --tile-size 9"] {
        assert!(folder.png(option) == every, "{option} changes the picture");
    }
}

#[test]
fn lights_that_are_integrated_are_sampled_at_400_points_by_the_plain_renderer() {
    let folder = Folder::new();
    folder.put("scene.toml", SCENE.replace("samples = 16\n", ""));
    let exr = |options: &str| folder.run(&format!("render scene.toml {options} -o - --format exr")).done().stdout;
    let expected = exr("--samples 400 --aa-mode full");
    for options in ["--reference", "--visibility traced", "--samples 400 --reference", "--samples exact --reference"] {
        assert!(exr(options) == expected, "{options}");
    }
    assert!(exr("--samples 399 --reference") != expected);
}

#[test]
fn exposure_and_display_touch_8_and_16_bits_only() {
    let folder = Folder::with_scene();
    let bytes = |format: &str, options: &str| {
        let line = format!("render scene.toml --samples exact {options} -o - --format {format}");
        folder.run(&line).done().stdout
    };
    for format in ["exr", "hdr"] {
        let plain = bytes(format, "");
        assert!(!plain.windows(8).any(|part| part == b"exposure"), "{format}");
        for options in ["--exposure 6", "--exposure -6.5", "--display neutral", "--display gamma=1.5"] {
            assert!(bytes(format, options) == plain, "{format} {options}");
        }
    }
    for bits in ["--bits 8", "--bits 16"] {
        let said = |bytes: &[u8], words: &str| bytes.windows(words.len()).any(|part| part == words.as_bytes());
        let (plain, bright) = (bytes("png", bits), bytes("png", &format!("{bits} --exposure 2")));
        assert!(said(&plain, "srgb, exposure 0") && said(&bright, "srgb, exposure 2"), "{bits}");
        assert!(Picture::decode(&plain) != Picture::decode(&bright), "{bits}");
        let linear = bytes("png", &format!("{bits} --display linear --exposure 1"));
        assert!(said(&linear, "linear, exposure 1") && Picture::decode(&linear) != Picture::decode(&plain), "{bits}");
    }
    // The words are those of scenes
    folder.put("linear.toml", SCENE.replace("[render]", "[render]\ndisplay = \"linear\""));
    let own = folder.run("render linear.toml --samples 4 -o - --format png").done().stdout;
    let other = folder.run("render scene.toml --samples 4 --display linear -o - --format png").done().stdout;
    assert!(Picture::decode(&own) == Picture::decode(&other));
    folder.put("asked.png", &other);
    folder.run("verify asked.png --scene scene.toml").done();
    // The scene's own decides how exactly lights are integrated, and is asked for in the same way
    folder.put("bright.toml", SCENE.replace("[render]", "[render]\nexposure = 2"));
    let own = folder.run("render bright.toml --samples exact -o - --format png").done().stdout;
    let other = folder.run("render bright.toml --samples exact --exposure 0 -o - --format png").done().stdout;
    assert!(own != other);
}

#[test]
fn every_level_is_known_and_those_of_this_processor_give_the_same_bytes() {
    let folder = Folder::with_scene();
    let plain = folder.png("");
    for level in ["auto", "fallback", "sse2", "sse4.2", "avx2", "avx512", "neon"] {
        let ran = folder.run(&format!("render scene.toml --simd {level} -o level.png"));
        match ran.code {
            Some(0) => assert!(folder.get("level.png") == plain, "{level}"),
            _ => drop(ran.exits(2).says(&[level, "fallback"])),
        }
    }
}

#[test]
fn a_crop_is_a_part_of_the_whole() {
    let folder = Folder::with_scene();
    let whole = Picture::decode(&folder.png(""));
    for (x, y, width, height) in [(0, 0, 36, 24), (5, 3, 17, 9), (35, 23, 1, 1), (0, 10, 36, 1)] {
        let part = Picture::decode(&folder.png(&format!("--crop {x},{y},{width},{height}")));
        assert_eq!(part.size(), (width, height));
        assert!(part.data == whole.part(x, y, width, height), "{x},{y},{width},{height}");
    }
}

#[test]
fn png_has_8_bits_or_16() {
    let folder = Folder::with_scene();
    let bits = |options| Picture::decode(&folder.png(options)).bits;
    assert_eq!([bits(""), bits("--bits 8"), bits("--bits 16")], [8, 8, 16]);
}

#[test]
fn several_outputs_come_from_one_rendering() {
    let folder = Folder::with_scene();
    let ran = folder.run("render scene.toml -o a.png -o b.exr --output c.HDR -o - --format exr --bits 16").done();
    assert_eq!(folder.names(), ["a.png", "b.exr", "c.HDR", "scene.toml"]);
    assert_eq!(Picture::decode(&folder.get("a.png")).bits, 16);
    assert!(folder.get("b.exr").starts_with(&[0x76, 0x2f, 0x31, 0x01]));
    assert!(folder.get("c.HDR").starts_with(b"#?RADIANCE"));
    assert!(ran.stdout == folder.get("b.exr"), "the same film, the same bytes");
    ran.says(&["wrote a.png", "wrote b.exr", "wrote c.HDR"]);
}

#[test]
fn standard_output_takes_every_format() {
    let folder = Folder::with_scene();
    let stdout = |options: &str| folder.run(&format!("render scene.toml -o - {options}")).done().stdout;
    assert!(stdout("") == folder.png(""));
    assert!(stdout("--format png --bits 16") == folder.png("--bits 16"));
    assert!(stdout("--format exr").starts_with(&[0x76, 0x2f, 0x31, 0x01]));
    assert!(stdout("--format hdr").starts_with(b"#?RADIANCE"));
    assert_eq!(folder.names(), ["scene.toml"]);
}

#[test]
fn a_scene_comes_from_standard_input() {
    let folder = Folder::with_scene();
    folder.run_with_input("render -", SCENE.as_bytes()).done().says(&["wrote scene.png"]);
    assert!(folder.get("scene.png") == folder.png(""));
}

#[test]
fn a_course_file_names_its_output() {
    let folder = Folder::new();
    folder.put("config.txt", COURSE);
    folder.run("render config.txt").done().says(&["wrote course.png"]);
    assert_eq!(folder.names(), ["config.txt", "course.png"]);
    assert_eq!(size_of(&folder.path("course.png")), (30, 30));
    // -o and other options win over it
    folder.run("render config.txt -o other.png --width 15 --threads 1").done();
    assert_eq!(size_of(&folder.path("other.png")), (15, 15));
    assert_eq!(folder.names(), ["config.txt", "course.png", "other.png"]);
    // From standard input as well
    folder.run_with_input("render - --bits 16", COURSE.as_bytes()).done().says(&["wrote course.png"]);
    assert_eq!(Picture::decode(&folder.get("course.png")).bits, 16);
}

#[test]
fn a_course_file_without_output_is_called_like_itself() {
    let folder = Folder::new();
    folder.put("mine.txt", COURSE.replace("output_file course.png\n", ""));
    folder.run("render mine.txt").done();
    assert_eq!(folder.names(), ["mine.png", "mine.txt"]);
}

#[test]
fn the_border_of_light_and_dark_can_be_left_hard() {
    let folder = Folder::new();
    let stone = "[render]\nwidth = 24\nheight = 24\n[camera]\nposition = [0, 0, 4]\n\
        [[light.directional]]\ndirection = [-1, 0, 0]\n[[mesh]]\nsmooth_deg = 180\n\
        positions = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]\n\
        triangles = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]\n\
        transform = { rotate_deg = [0, 20, 0] }\n";
    folder.put("stone.toml", stone);
    let shot = |options: &str| {
        folder.run(&format!("render stone.toml -o out.png {options}")).done();
        Picture::decode(&folder.get("out.png")).data
    };
    let (default, hard) = (shot(""), shot("--shadow-terminator hard"));
    assert!(default == shot("--shadow-terminator smooth"));
    assert!(default != hard);
    folder.run("render stone.toml --shadow-terminator soft").exits(2);
}

#[test]
fn a_tolerance_is_that_of_the_command_line() {
    let folder = Folder::new();
    let scene = "[render]\nwidth = 24\nheight = 24\n[camera]\nposition = [0, 2, 6]\nlook_at = [0, 0.5, 0]\n\
        [[light.rectangle]]\ncenter = [1, 3, 1]\ne0 = [1, 0, 0]\ne1 = [0, 0, 1]\nstrength = 4\n\
        [[sphere]]\ncenter = [0, 0.5, 0]\nradius = 0.5\n[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\n";
    folder.put("s.toml", scene);
    folder.put("t.toml", scene.replace("[camera]", "tolerance = 16\n[camera]"));
    let shot = |options: &str| {
        folder.run(&format!("render {options} -o out.png")).done();
        Picture::decode(&folder.get("out.png")).data
    };
    let default = shot("s.toml");
    assert!(default == shot("s.toml --tolerance 1") && default == shot("t.toml --tolerance 1"));
    assert!(shot("t.toml") == shot("s.toml --tolerance 16"));
    assert!(default != shot("t.toml"));
    for bad in ["0", "0.2", "17", "much"] {
        folder.run(&format!("render s.toml --tolerance {bad}")).exits(2);
    }
    folder.put("bad.toml", scene.replace("[camera]", "tolerance = 0.1\n[camera]"));
    folder.run("render bad.toml").exits(1);
}
