//! Every case of `scenes/golden/FAMILY/CASE`: the same bits as when it was last looked at. And the gallery: every scene
//! of it renders, and both renderers agree.
//!
//! A case is a folder with `scene.toml` and `expected.exr`. In the family `config` the scene is the built-in one of the
//! folder's name. `FIRSTLIGHT_BLESS=1` writes the expectations, and the run still fails; what differs is left beside
//! the test program as `actual.exr` and `difference.exr`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use firstlight::{
    AaMode, Assets, CompileOptions, FolderAssets, Format, Image, NoAssets, RenderSettings, SamplesDesc, Scene,
    SceneDesc, StoredImage, VisibilityMode, builtin_scenes, render,
};

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes")
}

/// What replaces a scene's own.
#[derive(Clone, Copy, Default)]
struct Instead {
    size: Option<[u32; 2]>,
    aa: Option<u32>,
    samples: Option<SamplesDesc>,
}

impl Instead {
    /// Small and sampled.
    fn sampled(size: [u32; 2]) -> Instead {
        Instead { size: Some(size), aa: Some(2), samples: Some(SamplesDesc::Count(64)) }
    }
}

/// The scene of a text.
fn compiled(text: &[u8], assets: &dyn Assets, instead: Instead) -> Scene {
    let mut parsed = SceneDesc::parse("scene.toml", text, assets);
    let frame = &mut parsed.desc.render;
    if let Some([width, height]) = instead.size {
        (frame.width, frame.height) = (width, height);
    }
    frame.antialiasing = instead.aa.unwrap_or(frame.antialiasing);
    if let Some(samples) = instead.samples {
        frame.samples = samples;
        parsed.desc.lights.iter_mut().for_each(|light| light.set_samples(samples));
    }
    parsed
        .compile(assets, &CompileOptions { strict: true, ..CompileOptions::default() })
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

/// The picture of a scene.
fn picture(text: &[u8], assets: &dyn Assets, instead: Instead, settings: &RenderSettings) -> Image {
    shown(&compiled(text, assets, instead), settings)
}

fn shown(scene: &Scene, settings: &RenderSettings) -> Image {
    match render(scene, settings, &|_, _| ControlFlow::Continue(())) {
        ControlFlow::Continue((film, _)) => film.develop(),
        ControlFlow::Break(()) => unreachable!("nothing stops this render"),
    }
}

/// All three renderers of the same bits; the plain one last.
fn renderers() -> [RenderSettings; 3] {
    [
        RenderSettings { aa_mode: AaMode::Full, ..RenderSettings::default() },
        RenderSettings { visibility: VisibilityMode::Traced, ..RenderSettings::default() },
        RenderSettings { reference: true, ..RenderSettings::default() },
    ]
}

/// The pixels that differ in a bit.
fn differences(a: &[[f32; 4]], b: &[[f32; 4]]) -> usize {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| a.map(f32::to_bits) != b.map(f32::to_bits)).count()
}

fn exr(image: &Image) -> Vec<u8> {
    image.encode(Format::Exr, &Default::default(), &Default::default()).unwrap()
}

/// Leaves the three pictures where they can be looked at.
fn leave(case: &str, expected: &[[f32; 4]], actual: &Image) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("golden").join(case);
    std::fs::create_dir_all(&folder).unwrap();
    let with = |pixels: Vec<[f32; 4]>| Image { pixels, ..actual.clone() };
    let difference = expected.iter().zip(&actual.pixels).map(|(e, a)| {
        let d = |i: usize| (a[i] - e[i]).abs();
        [d(0), d(1), d(2), 1.0]
    });
    std::fs::write(folder.join("expected.exr"), exr(&with(expected.to_vec()))).unwrap();
    std::fs::write(folder.join("difference.exr"), exr(&with(difference.collect()))).unwrap();
    std::fs::write(folder.join("actual.exr"), exr(actual)).unwrap();
    folder
}

// A test for every folder of `scenes/golden`, and for every scene of the gallery
include!(concat!(env!("OUT_DIR"), "/golden.rs"));

/// Holds a case, `FAMILY/CASE`: its bits, and that what is lit once is as if each ray was.
fn hold(title: &str) {
    let case = scenes().join("golden").join(title);
    let (image, scene) = match title.strip_prefix("config/") {
        Some(config) => {
            let builtin = builtin_scenes().iter().find(|b| b.name == config).expect("a built-in scene");
            let instead = Instead { size: Some([96, 96]), ..Instead::default() };
            (picture(builtin.text.as_bytes(), &NoAssets, instead, &RenderSettings::default()), None)
        }
        None => {
            let text = std::fs::read(case.join("scene.toml")).unwrap();
            let assets = FolderAssets::new(&case, &[]).unwrap();
            let integrated = Instead { samples: Some(SamplesDesc::Exact), ..Instead::default() };
            let image = picture(&text, &assets, Instead::default(), &RenderSettings::default());
            (image, Some(compiled(&text, &assets, integrated)))
        }
    };
    hold_bits(title, &case.join("expected.exr"), &image);
    if let Some(scene) = scene {
        hold_lit_once(&scene);
    }
}

/// The same bits as when the picture was last looked at.
fn hold_bits(title: &str, path: &Path, actual: &Image) {
    let expected = std::fs::read(path).ok().map(|bytes| StoredImage::read(&bytes).unwrap().pixels);
    let wrong_pixels = match &expected {
        Some(pixels) if pixels.len() == actual.pixels.len() => differences(pixels, &actual.pixels),
        _ => actual.pixels.len(),
    };
    if wrong_pixels == 0 {
        return;
    }
    let left = expected.filter(|e| e.len() == actual.pixels.len()).map(|e| leave(title, &e, actual));
    if std::env::var_os("FIRSTLIGHT_BLESS").is_some() {
        std::fs::write(path, exr(actual)).unwrap();
    }
    let difference = match left {
        Some(folder) => format!("; see {}", folder.display()),
        None => " from none of that size".to_owned(),
    };
    panic!("{title}: {wrong_pixels} pixels differ{difference}\nFIRSTLIGHT_BLESS=1 takes the new picture");
}

/// The steps of an 8-bit picture by which a pixel that is lit once may be off the mean of its rays, each lit by itself.
/// Behind what is in trees both are estimates.
const ONCE: f64 = 1.5;

/// What is lit once is as if each ray was.
fn hold_lit_once(scene: &Scene) {
    let [once, each] = [AaMode::Adaptive, AaMode::Full]
        .map(|aa_mode| shown(scene, &RenderSettings { aa_mode, ..RenderSettings::default() }));
    let steps = |x: f32| 255.0 * scene.display().encode(x);
    let off = |(a, b): (&[f32; 4], &[f32; 4])| (0..3).map(|k| (steps(a[k]) - steps(b[k])).abs()).fold(0.0, f64::max);
    let all: Vec<f64> = once.pixels.iter().zip(&each.pixels).map(off).collect();
    let worst = (0..all.len()).max_by(|a, b| all[*a].total_cmp(&all[*b])).expect("a picture has pixels");
    let [x, y] = [worst as u32 % scene.width(), worst as u32 / scene.width()];
    assert!(all[worst] <= ONCE, "pixel {x}, {y} is {:.2} steps off", all[worst]);
}

/// Every renderer has the same picture of a scene of the gallery, and by default it is near that.
fn hold_gallery(file: &str) {
    let folder = scenes().join("gallery");
    let assets = FolderAssets::new(&folder, &[]).unwrap();
    let text = std::fs::read(folder.join(file)).unwrap();
    assert!(text.starts_with(b"#:schema "), "an editor finds no schema");
    let [fast, traced, plain] =
        renderers().map(|settings| picture(&text, &assets, Instead::sampled([48, 36]), &settings));
    assert_eq!(differences(&fast.pixels, &plain.pixels), 0);
    assert_eq!(differences(&traced.pixels, &plain.pixels), 0);
    // As the scene says, and by default: integrated light is near the sampled
    let instead = Instead { samples: None, ..Instead::sampled([48, 36]) };
    let default = picture(&text, &assets, instead, &RenderSettings::default());
    for image in [&fast, &default] {
        assert!(image.pixels.iter().flatten().all(|c| c.is_finite() && *c >= 0.0));
        assert!(image.pixels.iter().any(|p| p[0] > 0.05), "all dark");
    }
    let off = fast.pixels.iter().zip(&default.pixels).map(|(a, b)| (a[1] - b[1]).abs()).sum::<f32>();
    assert!(off / (fast.pixels.len() as f32) < 0.02, "off by {off}");
}

#[test]
fn the_built_in_scenes_are_the_same_in_all_renderers() {
    for builtin in builtin_scenes() {
        let text = builtin.text.as_bytes();
        let [fast, traced, plain] =
            renderers().map(|settings| picture(text, &NoAssets, Instead::sampled([40, 40]), &settings));
        assert_eq!(differences(&fast.pixels, &plain.pixels), 0, "{}", builtin.name);
        assert_eq!(differences(&traced.pixels, &plain.pixels), 0, "{}", builtin.name);
    }
}
