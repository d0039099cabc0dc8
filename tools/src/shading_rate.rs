//! `cargo xtask verify shading-rate`: a picture whose camera rays share their light, as by default, beside the same
//! with the light of each camera ray integrated by itself. At the size of pictures that people render: squares of many
//! pixels hardly occur in the small ones of `cargo xtask verify exact`.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use firstlight::{
    AaMode, Assets, CompileOptions, FolderAssets, Image, NoAssets, RenderSettings, SampleSet, SamplesDesc, Scene,
    SceneDesc, builtin_scenes,
};
use firstlight_testkit::converged::{Deviation, PROMISED, with_samples};
use firstlight_testkit::exact_scenes;
use firstlight_testkit::scenes::picture;

use crate::Outcome;
use crate::exact::seeds;

/// Which scenes, and how large.
#[derive(clap::Args)]
pub struct Options {
    /// Scene files, their area lights integrated whatever samples they ask for. The built-in scenes, if neither files
    /// nor seeds are given.
    files: Vec<PathBuf>,
    /// Random scenes A to B, B left out; or some, single numbers as well: 0..40,372,779.
    #[arg(long, value_name = "A..B", value_parser = seeds, value_delimiter = ',')]
    seeds: Vec<Range<u64>>,
    /// The longer side of the pictures, in pixels.
    #[arg(long, default_value_t = 640, value_parser = clap::value_parser!(u32).range(16..=4096))]
    size: u32,
    /// Prints every scene, not only those with a pixel off by more than the tolerance.
    #[arg(long)]
    all: bool,
}

/// The picture and how long it took, in seconds.
fn timed(scene: &Scene, aa_mode: AaMode) -> (Image, f64) {
    let start = Instant::now();
    let image = picture(scene, &RenderSettings { aa_mode, ..RenderSettings::default() });
    (image, start.elapsed().as_secs_f64())
}

/// As it is compared: its longer side of `size` pixels, every area light integrated.
fn prepared(mut desc: SceneDesc, size: u32) -> SceneDesc {
    let [width, height] = [desc.render.width, desc.render.height];
    let scaled = |side: u32| (f64::from(side) * f64::from(size) / f64::from(width.max(height))).round().max(1.0) as u32;
    (desc.render.width, desc.render.height) = (scaled(width), scaled(height));
    with_samples(&desc, SamplesDesc::Exact, SampleSet::Sobol, 0)
}

fn compare(name: &str, desc: SceneDesc, assets: &dyn Assets, options: &Options) -> Result<Deviation, String> {
    let desc = prepared(desc, options.size);
    let compiled = desc.compile(assets, &CompileOptions::default());
    let scene = compiled.map_err(|faults| format!("{name}: {faults}"))?.scene;
    let (image, seconds) = timed(&scene, AaMode::Adaptive);
    let (truth, every_ray) = timed(&scene, AaMode::Full);
    let tolerance = desc.render.tolerance;
    let deviation = Deviation::between(&scene, tolerance, &truth, &image);
    if options.all || deviation.over > 0 {
        let Deviation { pixels, worst, at: [x, y], over, rms } = deviation;
        println!("| {name} | {pixels} | {over} | {worst:.2} | {x}, {y} | {rms:.3} | {seconds:.2} | {every_ray:.2} |");
    }
    // As a part of what the scene allows
    Ok(Deviation { worst: deviation.worst / tolerance, ..deviation })
}

/// Compares, prints what is off, and fails where bounds are broken.
pub fn run(options: &Options) -> Outcome {
    println!("| scene | pixels | over | worst | at | rms | s | every ray, s |\n|---|---|---|---|---|---|---|---|");
    let mut all = Vec::new();
    for seed in options.seeds.iter().cloned().flatten() {
        all.push(compare(&seed.to_string(), exact_scenes::scene(seed, options.size), &NoAssets, options)?);
    }
    for file in &options.files {
        let folder = file.parent().unwrap_or(Path::new("."));
        let assets = FolderAssets::new(folder, &[]).map_err(|(path, e)| format!("{}: {e}", path.display()))?;
        let text = std::fs::read(file).map_err(|e| format!("{}: {e}", file.display()))?;
        let parsed = SceneDesc::parse(&file.to_string_lossy(), &text, &assets);
        if let Some(fault) = parsed.faults().first() {
            return Err(format!("{}: {}: {}", file.display(), fault.path, fault.message));
        }
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        all.push(compare(&name, parsed.desc, &assets, options)?);
    }
    if all.is_empty() {
        for builtin in builtin_scenes() {
            let desc = SceneDesc::parse(builtin.name, builtin.text.as_bytes(), &NoAssets).desc;
            all.push(compare(builtin.name, desc, &NoAssets, options)?);
        }
    }
    let [pixels, over] = [|d: &Deviation| d.pixels, |d: &Deviation| d.over].map(|of| all.iter().map(of).sum::<u64>());
    let worst = all.iter().map(|deviation| deviation.worst).fold(0.0, f64::max);
    println!("\n{} pictures, {over} of {pixels} pixels over the tolerance, worst {worst:.2} of it.", all.len());
    let broken = worst > PROMISED.worst || over as f64 > PROMISED.over * pixels as f64;
    if broken { Err("shared light is further off than promised".into()) } else { Ok(()) }
}
