//! `cargo xtask engine`: what each part of the light engine gains, on config 11 and on a mesh of a million triangles,
//! in turns.

use std::fmt::Write as _;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use firstlight::{
    AaMode, BlinnPhongDesc, CameraDesc, ColorDesc, ColorParam, CompileOptions, EmitSides, Image, LightDesc,
    MaterialDesc, MeshDesc, NoAssets, NumberParam, RectangleDesc, RenderDesc, RenderSettings, SamplesDesc, Scene,
    SceneDesc, ShapeDesc, VisibilityMode, Window,
};
use serde_json::json;

use crate::bench::{Difference, built, commit, config11, median, picture, processes, processor};
use crate::curves;
use crate::rays::terrain_mesh;
use crate::{Outcome, root, write};

/// What to measure, and where to write it.
#[derive(clap::Args)]
pub struct Options {
    /// Rounds on config 11: each runs every way once, one after the other; 0 leaves it out.
    #[arg(long, default_value_t = 5)]
    rounds: usize,
    /// Rounds on the mesh; 0 leaves it out.
    #[arg(long, default_value_t = 3)]
    mesh_rounds: usize,
    /// Width and height of the pictures.
    #[arg(long, default_value_t = 1024)]
    size: u32,
    /// On the mesh, the ways are compared in a square of so many pixels in the middle; 0: in the whole picture.
    #[arg(long, default_value_t = 128)]
    mesh_part: u32,
    /// Also renders the whole picture of the mesh, once.
    #[arg(long)]
    mesh_whole: bool,
    /// The program to time from process start to file, if it is built already.
    #[arg(long)]
    program: Option<PathBuf>,
    /// Also measures how time grows with triangles and with samples, and draws that for the book.
    #[arg(long)]
    curves: bool,
    /// Width and height of the pictures for that.
    #[arg(long, default_value_t = 256)]
    curve_size: u32,
    /// The folder under docs/benchmarks, usually the date and the machine.
    #[arg(long)]
    name: Option<String>,
}

/// All that is timed here has so many threads.
pub(crate) const THREADS: usize = 2;
/// Camera rays across a pixel.
pub(crate) const AA: u32 = 4;
/// Points on each light of the picture that errors are measured against: on config 11, and on the mesh.
pub(crate) const CONVERGED: [u32; 2] = [4096, 1024];
/// Runs of the whole program.
const PROCESSES: usize = 11;

/// One way of rendering a picture.
pub(crate) struct Way {
    name: &'static str,
    samples: SamplesDesc,
    pub settings: RenderSettings,
    seconds: Vec<f64>,
    error: Option<Difference>,
}

/// Settings that differ in what is compared here.
pub(crate) fn settings(visibility: VisibilityMode, aa_mode: AaMode) -> RenderSettings {
    RenderSettings { threads: NonZeroUsize::new(THREADS), visibility, aa_mode, ..RenderSettings::default() }
}

pub(crate) fn way(name: &'static str, samples: SamplesDesc, visibility: VisibilityMode, aa_mode: AaMode) -> Way {
    Way { name, samples, settings: settings(visibility, aa_mode), seconds: Vec::new(), error: None }
}

pub fn run(options: &Options) -> Outcome {
    use {AaMode::*, VisibilityMode::*};
    let mut config = Vec::new();
    let (mut same_bits, mut process) = (false, Vec::new());
    if options.rounds > 0 {
        config.push(way("a: every sample traced, every camera ray", 400.into(), Traced, Full));
        config.push(way("b: shafts, every camera ray", 400.into(), Shafts, Full));
        config.push(way("c: shafts, once a pixel where that is enough", 400.into(), Shafts, Adaptive));
        config.push(way("d: integrated, every camera ray", SamplesDesc::Exact, Shafts, Full));
        config.push(way(
            "e: integrated, once a pixel where that is enough: the default",
            SamplesDesc::Exact,
            Shafts,
            Adaptive,
        ));
        let config11 = |samples| config11(options.size, AA, samples);
        same_bits = measure(&mut config, options.rounds, CONVERGED[0], &config11)?;
        // From process start to file
        let program = options.program.clone().map_or_else(built, Ok)?;
        let (size, threads) = (options.size.to_string(), THREADS.to_string());
        process = processes(&program, &["--width", &size, "--height", &size, "--threads", &threads], PROCESSES)?;
    }
    // The mesh: a square in the middle in turns, the whole picture by the default alone
    let mut mesh = Vec::new();
    let mut whole = Vec::new();
    if options.mesh_rounds > 0 {
        mesh.push(way("256 points traced, every camera ray", 256.into(), Traced, Full));
        mesh.push(way("256 points, shafts, every camera ray", 256.into(), Shafts, Full));
        mesh.push(way("256 points, shafts, once a pixel where that is enough", 256.into(), Shafts, Adaptive));
        mesh.push(way(
            "integrated, once a pixel where that is enough: the default",
            SamplesDesc::Exact,
            Shafts,
            Adaptive,
        ));
        let part = if options.mesh_part == 0 { options.size } else { options.mesh_part.min(options.size) };
        let from = (options.size - part) / 2;
        let crop = Window { x: from, y: from, width: part, height: part };
        mesh.iter_mut().for_each(|way| way.settings.crop = Some(crop));
        let terrain = |samples| terrain(ACROSS, options.size, &LIGHTS, samples);
        measure(&mut mesh, options.mesh_rounds, CONVERGED[1], &terrain)?;
        if options.mesh_whole {
            whole.push(picture(&terrain(SamplesDesc::Exact)?, &settings(Shafts, Adaptive))?.2);
        }
    }
    let curves = if options.curves { Some(curves::measure(options.curve_size)?) } else { None };

    let page = page(options, &config, same_bits, &process, &mesh, &whole, curves.as_ref());
    println!("{page}");
    if let Some(name) = &options.name {
        let folder = root().join("docs/benchmarks").join(name);
        write(&folder.join("README.md"), page.as_bytes())?;
        let rows = |ways: &[Way]| ways.iter().map(Way::json).collect::<Vec<_>>();
        let data = json!({
            "size": options.size, "antialiasing": AA, "threads": THREADS, "config11": rows(&config),
            "process_s": process, "mesh_part": options.mesh_part, "mesh": rows(&mesh), "mesh_whole_s": whole,
            "curves": curves.as_ref().map(curves::Curves::json), "commit": commit(), "processor": processor(),
        });
        let text = serde_json::to_string_pretty(&data).map_err(|e| e.to_string())?;
        write(&folder.join("engine.json"), format!("{text}\n").as_bytes())?;
    }
    Ok(())
}

/// Runs all ways in turns, then compares their pictures with one of many samples. Says whether the first two, which
/// have the same samples, made the same bits.
pub(crate) fn measure(
    ways: &mut [Way],
    rounds: usize,
    converged: u32,
    scene: &dyn Fn(SamplesDesc) -> Result<Scene, String>,
) -> Result<bool, String> {
    let mut scenes: Vec<(SamplesDesc, Scene)> = Vec::new();
    for way in ways.iter() {
        if scenes.iter().all(|(samples, _)| *samples != way.samples) {
            scenes.push((way.samples, scene(way.samples)?));
        }
    }
    let mut images: Vec<Option<Image>> = vec![None; ways.len()];
    for round in 1..=rounds {
        for (way, last) in ways.iter_mut().zip(&mut images) {
            let Some((_, scene)) = scenes.iter().find(|(samples, _)| *samples == way.samples) else { continue };
            let (image, _, seconds) = picture(scene, &way.settings)?;
            eprintln!("round {round}: {:62} {seconds:8.3} s", way.name);
            way.seconds.push(seconds);
            *last = Some(image);
        }
    }
    drop(scenes);
    let scene = scene(converged.into())?;
    let mut full = settings(VisibilityMode::Shafts, AaMode::Full);
    full.crop = ways.first().and_then(|way| way.settings.crop);
    let (truth, ..) = picture(&scene, &full)?;
    for (way, image) in ways.iter_mut().zip(&images) {
        way.error = image.as_ref().map(|image| Difference::between(image, &truth, &scene.display()));
    }
    Ok(matches!(&images[..], [Some(a), Some(b), ..] if a == b))
}

impl Way {
    /// The median, over the rounds, of how many times faster it was than `base` in the same round.
    fn ratio(&self, base: &Way) -> f64 {
        let ratios: Vec<f64> = base.seconds.iter().zip(&self.seconds).map(|(base, own)| base / own).collect();
        median(&ratios)
    }

    fn json(&self) -> serde_json::Value {
        let error = self.error.map(|e| json!({ "worst": e.worst, "rms": e.rms, "pixels_over_1": e.over }));
        json!({ "way": self.name, "seconds": self.seconds, "error": error })
    }
}

// The mesh

/// The terrain of 1 million triangles has so many squares along each side.
const ACROSS: u32 = 707;

/// A rectangle light: its middle, two edges, its colour and strength.
pub(crate) type Lamp = ([f64; 3], [[f64; 3]; 2], [f64; 3], f64);

/// A lamp above, one beside, and a low one behind.
pub(crate) const LIGHTS: [Lamp; 3] = [
    ([0.3, 1.6, -0.2], [[0.6, 0.0, 0.0], [0.0, 0.0, 0.6]], [1.0, 0.95, 0.85], 4.0),
    ([1.6, 0.7, 0.5], [[0.0, 0.6, 0.0], [0.0, 0.0, 0.6]], [1.0, 0.6, 0.3], 4.0),
    ([-0.6, 0.6, -1.7], [[0.8, 0.0, 0.0], [0.0, 0.4, 0.0]], [0.4, 0.6, 1.0], 5.0),
];

/// A terrain of 2 n n triangles under rectangle lights.
pub(crate) fn terrain(n: u32, size: u32, lamps: &[Lamp], samples: SamplesDesc) -> Result<Scene, String> {
    let (positions, triangles) = terrain_mesh(n);
    let earth = MaterialDesc::BlinnPhong(BlinnPhongDesc {
        diffuse: ColorParam::gray(0.6),
        specular: ColorParam::gray(0.1),
        shininess: NumberParam::constant(20.0),
        ..BlinnPhongDesc::default()
    });
    let mesh = MeshDesc {
        positions: positions.iter().map(|p| p.map(f64::from)).collect(),
        triangles,
        material: Some("earth".into()),
        ..MeshDesc::default()
    };
    let lights = lamps.iter().map(|(center, [e0, e1], color, strength)| {
        LightDesc::Rectangle(RectangleDesc {
            color: ColorDesc::linear(color[0], color[1], color[2]),
            strength: *strength,
            sides: Some(EmitSides::Both),
            visible: false,
            ..RectangleDesc::with_edges(*center, *e0, *e1)
        })
    });
    let camera = CameraDesc { look_at: [0.0, 0.0, 0.0], fov_y_deg: Some(45.0), ..CameraDesc::new([0.5, 1.6, 2.0]) };
    let desc = SceneDesc {
        render: RenderDesc { width: size, height: size, antialiasing: AA, samples, ..RenderDesc::default() },
        materials: vec![("earth".into(), earth)],
        shapes: vec![ShapeDesc::Mesh(mesh)],
        lights: lights.collect(),
        cameras: vec![(String::new(), camera)],
        ..SceneDesc::default()
    };
    Ok(desc.compile(&NoAssets, &CompileOptions::default()).map_err(|e| e.to_string())?.scene)
}

// The page

fn page(
    options: &Options,
    config: &[Way],
    same_bits: bool,
    process: &[f64],
    mesh: &[Way],
    whole: &[f64],
    curves: Option<&curves::Curves>,
) -> String {
    let mut page = String::new();
    let Options { rounds, mesh_rounds, size, mesh_part, .. } = options;
    let _ = writeln!(page, "## What each part of the light engine gains\n");
    let _ = writeln!(
        page,
        "{size} x {size} pixels, {AA} x {AA} camera rays in each, {THREADS} threads. In each round every way ran \
         once, one after the other, in one process; times are of the render stage, medians over the rounds. A ratio \
         is the median of the ratios within each round. An error is in steps of an 8-bit picture as it is displayed, \
         against a picture with shafts at every camera ray and {} points on the light of config 11, {} on each light \
         of the mesh: these have an error of their own.\n",
        CONVERGED[0], CONVERGED[1],
    );
    let _ = writeln!(page, "- processor: {}", processor());
    let _ = writeln!(page, "- commit: {}", commit());
    let mut command = format!(
        "cargo xtask engine --rounds {rounds} --mesh-rounds {mesh_rounds} --size {size} --mesh-part {mesh_part}"
    );
    if options.mesh_whole {
        command.push_str(" --mesh-whole");
    }
    if options.curves {
        let _ = write!(command, " --curves --curve-size {}", options.curve_size);
    }
    if let Some(name) = &options.name {
        let _ = write!(command, " --name {name}");
    }
    let _ = writeln!(page, "- command: `{command}`\n");
    if !config.is_empty() {
        let _ = writeln!(page, "### Config 11\n");
        let _ = writeln!(page, "400 points on the light, or the integral; {rounds} rounds.\n");
        table(&mut page, config);
        let words = if same_bits { "the same bits" } else { "NOT the same bits" };
        let _ = writeln!(
            page,
            "\na and b made {words}. `firstlight render config11` with {size} x {size} pixels and {THREADS} threads, \
             process start to file: {:.0} ms (median of {}).",
            median(process) * 1e3,
            process.len()
        );
    }
    if !mesh.is_empty() {
        let part = mesh[0].settings.crop.map_or(*size, |crop| crop.width);
        let _ = writeln!(page, "\n### A terrain of a million triangles under three rectangle lights\n");
        let _ = writeln!(
            page,
            "All ways rendered the same {part} x {part} pixels in the middle of {size} x {size}; {mesh_rounds} \
             rounds.\n"
        );
        table(&mut page, mesh);
        for seconds in whole {
            let _ = writeln!(page, "\nThe whole picture by the default, once: {seconds:.2} s.");
        }
    }
    if let Some(curves) = curves {
        page.push_str(&curves.table());
    }
    page
}

pub(crate) fn table(page: &mut String, ways: &[Way]) {
    let head =
        "| way | seconds | least to most | times the first | worst error | rms error | pixels off by more than 1 |";
    let _ = writeln!(page, "{head}");
    let _ = writeln!(page, "|---|---|---|---|---|---|---|");
    for way in ways {
        let (least, most) = way.seconds.iter().fold((f64::MAX, 0.0f64), |(a, b), s| (a.min(*s), b.max(*s)));
        let error = way.error.map_or("| | ".into(), |e| format!("{:.2} | {:.3} | {}", e.worst, e.rms, e.over));
        let _ = writeln!(
            page,
            "| {} | {:.3} | {least:.3} to {most:.3} | {:.1} | {error} |",
            way.name,
            median(&way.seconds),
            way.ratio(&ways[0]),
        );
    }
}
