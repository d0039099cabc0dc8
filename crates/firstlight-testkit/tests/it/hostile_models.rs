//! Models that are damaged at random: glTF, GLB, OBJ with MTL, PLY and STL, with their buffers and pictures.
//!
//! The test damages 2,000 models, or ten times `FIRSTLIGHT_SCENES` if that is more. A failure prints the seed of the
//! model. `FIRSTLIGHT_SEED` sets the first seed, `FIRSTLIGHT_DAMAGED` the folder to which the test writes the files of
//! a model that failed, and `FIRSTLIGHT_MODELS` a folder of other models to damage.

use std::path::{Path, PathBuf};

use firstlight_testkit::damaged::{ModelFiles, models};
use firstlight_testkit::scenes::times;
use firstlight_testkit::{Random, hostile_model};

/// Says which model it was when a promise is broken.
struct Told<'a> {
    seed: u64,
    model: &'a ModelFiles,
}

impl Drop for Told<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("FIRSTLIGHT_SEED={}: {}", self.seed, self.model.model);
            // To look at
            if let Some(folder) = std::env::var_os("FIRSTLIGHT_DAMAGED") {
                put(self.model, Path::new(&folder));
            }
        }
    }
}

/// Writes the files of a model into a folder.
fn put(model: &ModelFiles, folder: &Path) {
    for (name, bytes) in &model.files {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().expect("is in the folder")).expect("can be made");
        std::fs::write(path, bytes).expect("can be written");
    }
}

/// The models of a folder and of those below it, each with all files beside it and below.
fn models_in(folder: &Path) -> Vec<ModelFiles> {
    let files_below = |folder: &Path| {
        let (mut files, mut folders): (Vec<PathBuf>, _) = (Vec::new(), vec![folder.to_path_buf()]);
        while let Some(folder) = folders.pop() {
            for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
                if path.is_dir() { folders.push(path) } else { files.push(path) }
            }
        }
        files.sort();
        files
    };
    let is_model = |path: &&PathBuf| {
        path.extension().is_some_and(|ending| ["gltf", "glb", "obj", "ply", "stl"].iter().any(|known| ending == *known))
    };
    let all = files_below(folder);
    let of = |path: &PathBuf| {
        let folder = path.parent().unwrap();
        let name = |path: &Path| path.strip_prefix(folder).unwrap().to_str().unwrap().to_owned();
        let is_other = |other: &PathBuf| is_model(&other) && other != path;
        let beside = files_below(folder).into_iter().filter(|other| !is_other(other));
        ModelFiles::new(&name(path), beside.map(|path| (name(&path), std::fs::read(&path).unwrap())))
    };
    all.iter().filter(is_model).map(of).collect()
}

/// The most memory that the process ever took, in bytes.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? << 10)
}

#[test]
fn models_without_damage_are_shown() {
    for model in models() {
        for seed in 0..10 {
            let settings = hostile_model::settings(&model, &mut Random::new(seed));
            hostile_model::check(&model, &settings).unwrap_or_else(|error| panic!("{settings:?}: {error}"));
        }
    }
}

#[test]
fn damaged_models_are_shown_or_refused_and_do_no_harm() {
    let mut models = models();
    if let Some(folder) = std::env::var_os("FIRSTLIGHT_MODELS") {
        models = models_in(Path::new(&folder));
    }
    let first: u64 = std::env::var("FIRSTLIGHT_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(0);
    let (mut shown, mut slowest, count) = (0, Default::default(), times(2_000));
    for seed in first..first + count {
        let mut random = Random::new(seed);
        let model = models[random.below(models.len() as u32) as usize].damaged(&mut random);
        let told = Told { seed, model: &model };
        let start = std::time::Instant::now();
        shown += u64::from(hostile_model::check(&model, &hostile_model::settings(&model, &mut random)).is_ok());
        slowest = std::cmp::max(slowest, (start.elapsed(), seed));
        if let Some(memory) = peak_memory() {
            assert!(memory < 2 << 30, "{} MiB of memory", memory >> 20);
        }
        drop(told);
    }
    println!("{shown} of {count} are shown; the slowest took {slowest:?} (time, seed)");
    // Of models that are all shown, or all refused, nothing is learnt
    assert!(shown * 20 > count && shown * 20 < 19 * count, "{shown} of {count} are shown");
}
