//! Pictures from outside: what a caller of the library can rely on.

use std::path::Path;
use std::process::{Command, Stdio};

use firstlight::{
    CompileOptions, Display, Encoding, Format, Image, NoAssets, Receipt, RenderSettings, SceneDesc, StoredImage,
    ToneMapping, Window, Written, render, write_whole,
};

fn picture(width: u32, height: u32) -> Image {
    let pixel = |i: u32| [(i % width) as f32 / width as f32, 0.5, (i / width) as f32 / height as f32, 1.0];
    Image {
        film: [width, height],
        window: Window { x: 0, y: 0, width, height },
        pixels: (0..width * height).map(pixel).collect(),
    }
}

#[test]
fn the_numbers_of_a_png_are_the_definition() {
    let picture = picture(67, 41);
    for encoding in [Encoding::Srgb, Encoding::Gamma(2.2), Encoding::Linear] {
        for exposure in [0.0, -1.5] {
            let display = Display { encoding, exposure, ..Display::default() };
            for (format, largest) in [(Format::Png8, 255.0), (Format::Png16, 65535.0)] {
                let bytes = picture.encode(format, &display, &Receipt::default()).unwrap();
                let stored = StoredImage::read(&bytes).unwrap();
                for (number, linear) in stored.pixels.iter().zip(&picture.pixels) {
                    for channel in 0..3 {
                        let expected = (display.encode(linear[channel]) * largest).round();
                        assert_eq!((f64::from(number[channel]) * largest).round(), expected);
                    }
                }
            }
        }
    }
}

/// The encoder computes in whole numbers: these bytes are those of every machine.
#[test]
fn the_bytes_of_a_jpeg_are_the_same_everywhere() {
    let bytes = picture(67, 41).encode(Format::Jpeg, &Display::default(), &Receipt::default()).unwrap();
    let sum = bytes.iter().fold(0u32, |sum, byte| sum.rotate_left(5).wrapping_add(u32::from(*byte)));
    assert_eq!((bytes.len(), sum), (1468, 1_630_383_204));
}

/// Under gray light from everywhere the neutral display shows rough dielectrics in their base colours, to what the book
/// says.
#[test]
fn neutral_shows_base_colors() {
    for base in [[0.7, 0.3, 0.2], [0.5, 0.5, 0.5], [0.16, 0.4, 0.78]] {
        let text = format!(
            "[render]\nwidth = 1\nheight = 1\nambient = 1\ndisplay = \"neutral\"\n[camera]\nposition = [0, 0, 3]\n\
             projection = \"orthographic\"\nheight = 1\n[material.metallic-roughness.m]\nbase_color = {base:?}\n\
             roughness = 1\n[[parallelogram]]\np = [-2, -2, 0]\ne0 = [4, 0, 0]\ne1 = [0, 4, 0]\nmaterial = \"m\"\n"
        );
        let parsed = SceneDesc::parse("scene.toml", text.as_bytes(), &NoAssets);
        let scene = parsed.compile(&NoAssets, &CompileOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
        let go_on = |_, _| std::ops::ControlFlow::Continue(());
        let std::ops::ControlFlow::Continue((film, _)) = render(&scene, &RenderSettings::default(), &go_on) else {
            unreachable!("nothing stops this render")
        };
        assert_eq!(scene.display().tone_mapping, ToneMapping::Neutral);
        let picture = film.develop();
        let bytes = picture.encode(Format::Png16, &scene.display(), &Receipt::default()).unwrap();
        let stored = StoredImage::read(&bytes).unwrap();
        for (channel, base) in base.into_iter().enumerate() {
            let shown = Encoding::Srgb.decode(f64::from(stored.pixels[0][channel]));
            assert!((shown - (0.96 * base - 0.028)).abs() < 0.003, "{base} is shown as {shown}");
        }
        // The receipt of the scene says how
        let receipt = scene.receipt(&RenderSettings::default());
        let bytes = picture.encode(Format::Png8, &scene.display(), &receipt).unwrap();
        assert_eq!(StoredImage::read(&bytes).unwrap().receipt.get("display"), Some("neutral, exposure 0"));
    }
}

#[test]
fn an_exr_holds_the_film_to_the_bit() {
    let mut picture = picture(23, 50);
    picture.film = [640, 480];
    (picture.window.x, picture.window.y) = (600, 430);
    let receipt = Receipt { entries: vec![("scene_hash".into(), "9f1c".into())] };
    let bytes = picture.encode(Format::Exr, &Display { exposure: 3.0, ..Display::default() }, &receipt).unwrap();
    let stored = StoredImage::read(&bytes).unwrap();
    assert_eq!((stored.film, stored.window), (picture.film, picture.window));
    // And says what it holds
    assert_eq!((stored.receipt.get("scene_hash"), stored.receipt.entries.len()), (Some("9f1c"), 2));
    assert!(stored.receipt.get("buffer.color").is_some_and(|said| said.starts_with("channels R G B A; float32")));
    assert!(stored.pixels == picture.pixels);
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let picture = picture(300, 200);
    let receipt = Receipt { entries: (0..9).map(|i| (format!("key{i}"), format!("{i}"))).collect() };
    let formats = [Format::Png8, Format::Png16, Format::Hdr].into_iter();
    for format in formats.chain([Format::Exr]) {
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| picture.encode(format, &Display::default(), &receipt).unwrap())
        };
        assert!(with(1) == with(7), "{format:?}");
    }
}

/// What the writer below writes in turn: two files of different lengths, each of one byte.
const SIZES: [(u8, usize); 2] = [(b'a', 3_000_000), (b'b', 2_000_000)];

fn is_whole(bytes: &[u8]) -> bool {
    SIZES.iter().any(|&(byte, size)| bytes.len() == size && bytes.iter().all(|&b| b == byte))
}

/// The process that is killed by the next test: writes until then.
#[test]
#[ignore = "started by another test"]
fn writer() {
    let Some(path) = std::env::var_os("FIRSTLIGHT_TEST_TARGET") else { return };
    for (byte, size) in SIZES.into_iter().cycle() {
        assert_eq!(write_whole(Path::new(&path), &vec![byte; size]).unwrap(), Written::Replaced);
    }
}

#[test]
fn a_writer_killed_at_any_time_leaves_a_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("picture.png");
    write_whole(&target, &vec![SIZES[0].0; SIZES[0].1]).unwrap();
    for round in 0..6 {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "images::writer", "--ignored"])
            .env("FIRSTLIGHT_TEST_TARGET", &target)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        // Whoever looks meanwhile sees whole files only
        for _ in 0..10 + 3 * round {
            assert!(is_whole(&std::fs::read(&target).unwrap()));
            std::thread::sleep(std::time::Duration::from_millis(3));
        }
        assert!(child.try_wait().unwrap().is_none(), "it writes until it is killed");
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(is_whole(&std::fs::read(&target).unwrap()));
    }
}
