//! What a camera shows where: closed forms of its projection.

use std::ops::ControlFlow;

use firstlight::*;

/// The film of a scene in TOML, each of its camera rays for itself: what is asked is where they lead.
fn film(text: &str, crop: Option<Window>) -> Image {
    let parsed = SceneDesc::parse("scene.toml", text.as_bytes(), &NoAssets);
    let scene = parsed.compile(&NoAssets, &CompileOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
    let settings = RenderSettings { crop, aa_mode: AaMode::Full, ..RenderSettings::default() };
    match render(&scene, &settings, &|_, _| ControlFlow::Continue(())) {
        ControlFlow::Continue((film, _)) => film.develop(),
        ControlFlow::Break(()) => unreachable!("nothing stops this render"),
    }
}

/// How many pixels are covered.
fn covered<'a>(pixels: impl IntoIterator<Item = &'a [f32; 4]>) -> f64 {
    pixels.into_iter().map(|p| f64::from(p[3])).sum()
}

const ORTHOGRAPHIC: &str = "[render]\nwidth = 240\nheight = 200\nantialiasing = 8\ntransparent = true\n\
                            [camera]\nposition = [0, 0, 10]\nprojection = \"orthographic\"\nheight = 4\n";

#[test]
fn a_sphere_is_a_disk_of_its_own_radius_at_any_distance() {
    // 4 m in 200 pixels: a radius of 1 m is 50 pixels
    let disk = |z: f64, x: f64| {
        let image = film(&format!("{ORTHOGRAPHIC}[[sphere]]\ncenter = [{x}, 0.3, {z}]\nradius = 1\n"), None);
        let rows: Vec<f64> = (0..200).map(|j| covered(&image.pixels[j * 240..(j + 1) * 240])).collect();
        let columns = (0..240).map(|i| covered((0..200).map(|j| &image.pixels[j * 240 + i])));
        let widest = rows.iter().copied().fold(0.0, f64::max);
        (covered(&image.pixels), widest, columns.fold(0.0, f64::max))
    };
    for (z, x) in [(8.5, 0.0), (0.0, 0.0), (-1000.0, 0.0), (0.0, 0.7)] {
        let (area, width, height) = disk(z, x);
        let exact = std::f64::consts::PI * 50.0 * 50.0;
        assert!((area / exact - 1.0).abs() < 3e-4, "{z} {x}: {area} {exact}");
        assert!((width - 100.0).abs() <= 0.25 && (height - 100.0).abs() <= 0.25, "{z} {x}: {width} {height}");
    }
    // Behind the film, and cut in half by it
    assert_eq!(disk(11.1, 0.0).0, 0.0);
    assert!((disk(10.0, 0.0).0 / (std::f64::consts::PI * 2500.0) - 1.0).abs() < 3e-4, "its inside is seen");
}

#[test]
fn parallel_lines_stay_parallel() {
    // A strip along the line of sight, seen from above: as wide in every row, near and far
    let text = ORTHOGRAPHIC.replace("position = [0, 0, 10]", "position = [0, 30, 30]")
        + "[[parallelogram]]\np = [-0.51, 0, 40]\ne0 = [1.02, 0, 0]\ne1 = [0, 0, -80]\n";
    let image = film(&text, None);
    for j in 0..200 {
        let width = covered(&image.pixels[j * 240..(j + 1) * 240]);
        // 50 pixels in a metre, and eight rays across a pixel
        assert!((width - 51.0).abs() <= 0.25, "row {j}: {width}");
    }
}

#[test]
fn a_shifted_film_is_a_part_of_a_larger_one_bit_for_bit() {
    let scene = "[[sphere]]\ncenter = [0.5, 0.4, 0]\nradius = 1\n[[sphere]]\ncenter = [-1, -1, -3]\nradius = 1.2\n\
                 [[light.directional]]\ndirection = [-1, -2, -3]\n";
    let text = |size: u32, camera: &str| {
        format!(
            "[render]\nwidth = {size}\nheight = {size}\nantialiasing = 2\n[camera]\nposition = [0, 0, 6]\n{camera}\n\
             {scene}"
        )
    };
    for (whole, part) in [
        ("focal_length_mm = 30\nsensor_height_mm = 24", "focal_length_mm = 30\nsensor_height_mm = 12"),
        ("projection = \"orthographic\"\nheight = 4", "projection = \"orthographic\"\nheight = 2"),
    ] {
        for (shift, x, y) in [("[0.5, 0.5]", 64, 0), ("[-0.5, 0.25]", 0, 16), ("[0, -0.5]", 32, 64)] {
            let window = Window { x, y, width: 64, height: 64 };
            let larger = film(&text(128, whole), Some(window));
            let shifted = film(&text(64, &format!("{part}\nshift = {shift}")), None);
            let bits = |image: &Image| image.pixels.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>();
            assert!(bits(&larger) == bits(&shifted), "{part} {shift}");
        }
    }
}

#[test]
fn a_moved_camera_sees_what_a_moved_scene_shows() {
    // The camera a quarter turn around the y axis, or the sphere as much the other way
    let scene = |transform: &str, center: &str| {
        format!(
            "[render]\nwidth = 60\nheight = 40\nantialiasing = 2\ntransparent = true\n[camera]\nposition = [0, 1, 8]\n\
             {transform}\n[[sphere]]\ncenter = {center}\nradius = 1\n"
        )
    };
    let turned = film(&scene("transform = { rotate_deg = [0, 90, 0] }", "[1, 0.5, -2]"), None);
    let plain = film(&scene("", "[2, 0.5, 1]"), None);
    assert!((covered(&turned.pixels) - covered(&plain.pixels)).abs() < 1.0);
    let differing = turned.pixels.iter().zip(&plain.pixels).filter(|(a, b)| a[3] != b[3]).count();
    assert!(differing <= 4, "{differing} pixels differ");
}
