//! The studio of models by themselves: how bright it shows what is known.

use firstlight::{
    AaMode, CompileOptions, MemoryAssets, RenderSettings, SceneDesc, Studio, StudioSettings, display_bytes,
};
use firstlight_testkit::Random;

use crate::scenes::*;

/// The text of an OBJ file of a ball with normals, and of the gray material it has.
fn gray_ball() -> MemoryAssets {
    let ball = ball_mesh(1.0, 40, 0.0, true, &mut Random::new(1));
    let mut obj = String::from("mtllib ball.mtl\nusemtl gray\n");
    for [x, y, z] in &ball.positions {
        obj.push_str(&format!("v {x} {y} {z}\nvn {x} {y} {z}\n"));
    }
    for triangle in &ball.triangles {
        let [a, b, c] = triangle.map(|vertex| vertex + 1);
        obj.push_str(&format!("f {a}//{a} {b}//{b} {c}//{c}\n"));
    }
    let mtl = "newmtl gray\nKd 0.5 0.5 0.5\nPr 0.5\nPm 0\n";
    let mut assets = MemoryAssets::default();
    assets.files.insert("ball.obj".to_owned(), obj.into_bytes());
    assets.files.insert("ball.mtl".to_owned(), mtl.as_bytes().to_vec());
    assets
}

/// What a picture of the gray ball shows where the ball is all that a pixel sees: 0 to 1, red.
fn shown(studio: Studio) -> Vec<f64> {
    let settings = StudioSettings { studio, ground: Some(false), ..StudioSettings::default() };
    let mut desc = SceneDesc::of_model("ball.obj", &settings);
    (desc.render.width, desc.render.height, desc.render.transparent) = (64, 64, true);
    let options = CompileOptions { studio: Some(settings), ..CompileOptions::default() };
    let compiled = desc.compile(&gray_ball(), &options).unwrap_or_else(|error| panic!("{error}"));
    assert!(compiled.warnings.is_empty(), "{:?}", compiled.warnings);
    let settings = RenderSettings { aa_mode: AaMode::Multisample, ..one_thread() };
    let image = picture(&compiled.scene, &settings);
    let display = compiled.scene.display();
    let bytes = display_bytes(&image.pixels, &display, true).unwrap_or_else(|fault| panic!("{fault}"));
    let whole = bytes.chunks_exact(4).filter(|pixel| pixel[3] == 255);
    whole.map(|pixel| f64::from(pixel[0]) / 255.0).collect()
}

#[test]
fn a_gray_ball_is_as_bright_as_in_a_photograph() {
    for studio in [Studio::Soft, Studio::Hard] {
        let shown = shown(studio);
        let mean = shown.iter().sum::<f64>() / shown.len() as f64;
        assert!((0.55..=0.70).contains(&mean), "{studio:?}: {mean}");
        // No side is black, and the highlight is not burnt out
        let least = shown.iter().copied().fold(1.0, f64::min);
        let white = shown.iter().filter(|shown| **shown > 0.99).count();
        assert!(least > 0.25 && white * 50 < shown.len(), "{studio:?}: {least} {white} of {}", shown.len());
    }
}

#[test]
fn unlit_colours_are_those_of_the_file() {
    // sRGB of 0.5
    for shown in shown(Studio::Flat) {
        assert!((shown - 188.0 / 255.0).abs() < 1.5 / 255.0, "{shown}");
    }
}
