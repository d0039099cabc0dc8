//! Model files from anywhere: what showing them promises.

use std::time::{Duration, Instant};

use firstlight::{CompileOptions, MemoryAssets, Parsed, SceneError, Studio, StudioSettings};

use crate::Random;
use crate::damaged::ModelFiles;
use crate::scenes::{one_thread, picture};

/// Longest time that a model may take: seconds are for machines that do other things besides.
const LONGEST: Duration = Duration::from_secs(20);
/// The folder that messages say the file is in.
const FOLDER: &str = "of a stranger/";
/// A side of the picture, in pixels.
const SIDE: u32 = 8;

/// Random studio settings for a model: in four of five cases the studio `hard`, which renders fastest. Cameras,
/// variants and animations are set for glTF files only.
pub fn settings(model: &ModelFiles, random: &mut Random) -> StudioSettings {
    let is_gltf = model.model.ends_with(".gltf") || model.model.ends_with(".glb");
    let says = |word: &str| {
        let bytes = model.files.get(&model.model);
        bytes.is_some_and(|bytes| bytes.windows(word.len()).any(|part| part == word.as_bytes()))
    };
    let mut settings = StudioSettings { studio: Studio::Hard, ..StudioSettings::default() };
    if random.chance(0.2) {
        settings.studio = random.pick(&[Studio::Soft, Studio::Flat, Studio::Clay, Studio::None]);
    }
    if !is_gltf {
        settings.smooth_deg = random.chance(0.2).then(|| random.between(0.0, 180.0));
        return settings;
    }
    settings.cameras = random.chance(0.1);
    if random.chance(0.3) && says("animations") {
        settings.animation = Some("0".to_owned());
    }
    if random.chance(0.1) && says("\"dark\"") {
        settings.variant = Some("dark".to_owned());
    }
    settings
}

/// Compiles a model by itself as the program does, and renders a tiny picture of it. An error says why there is
/// none. Panics where a promise is broken.
pub fn check(model: &ModelFiles, settings: &StudioSettings) -> Result<(), SceneError> {
    let start = Instant::now();
    let assets = MemoryAssets { files: model.files.clone() };
    let name = format!("{FOLDER}{}", model.model);
    let mut parsed = Parsed::of_model(&name, &model.model, settings);
    (parsed.desc.render.width, parsed.desc.render.height) = (SIDE, SIDE);
    (parsed.desc.render.antialiasing, parsed.desc.render.samples) = (1, 1.into());
    let options = CompileOptions { studio: Some(settings.clone()), time: 0.25, ..CompileOptions::default() };
    let shown = match parsed.compile(&assets, &options) {
        Err(error) => {
            assert!(!error.faults.is_empty());
            for fault in &error.faults {
                assert!(fault.message.contains(&name), "{fault} does not say which file it is of");
            }
            Err(error)
        }
        Ok(compiled) => {
            for warning in compiled.warnings.iter().chain(&compiled.advice) {
                assert!(!warning.message.is_empty());
            }
            let image = picture(&compiled.scene, &one_thread());
            for pixel in &image.pixels {
                assert!(pixel.iter().all(|c| c.is_finite() && *c >= 0.0), "{pixel:?}");
            }
            Ok(())
        }
    };
    assert!(start.elapsed() < LONGEST, "it took {:?}", start.elapsed());
    shown
}

/// A glTF or GLB file by itself, or one of materials beside a model that has them. Panics where a promise is broken.
pub fn check_bytes(kind: &str, bytes: &[u8]) {
    let model = match kind {
        "mtl" => {
            let mut model = crate::damaged::models().into_iter().find(|model| model.model == "box.obj");
            let model = model.as_mut().expect("there is a box");
            // A face of each of its first materials
            let names = String::from_utf8_lossy(bytes);
            let names = names.lines().filter_map(|line| line.trim_start().strip_prefix("newmtl")).take(8);
            let faces: String = names.map(|name| format!("usemtl{name}\nf 1 2 3\n")).collect();
            model.files.get_mut("box.obj").expect("is its own").extend(faces.into_bytes());
            model.files.insert("box.mtl".to_owned(), bytes.to_vec());
            model.clone()
        }
        _ => {
            let name = format!("a.{kind}");
            ModelFiles::new(&name, [(name.clone(), bytes.to_vec())])
        }
    };
    let _ = check(&model, &StudioSettings { studio: Studio::Hard, ..StudioSettings::default() });
}
