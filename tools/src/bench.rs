//! `cargo xtask bench`: config 11, each way against the plain renderer, in turns.

use std::fmt::Write as _;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use firstlight::{
    AaMode, CompileOptions, Display, Image, NoAssets, RenderSettings, RenderStats, SamplesDesc, Scene, SceneDesc,
    SimdLevel, builtin_scenes, render,
};
use serde_json::json;

use crate::{Outcome, cargo, root, run as run_to_end, write};

/// What to measure, and where to write it.
#[derive(clap::Args)]
pub struct Options {
    /// Rounds: each runs every way once, one after the other.
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    /// Width and height of the picture.
    #[arg(long, default_value_t = 1024)]
    size: u32,
    /// Antialiasing.
    #[arg(long, default_value_t = 4)]
    aa: u32,
    /// Points on the light.
    #[arg(long, default_value_t = 400)]
    samples: u32,
    /// The folder under docs/benchmarks, usually the date and the machine.
    #[arg(long)]
    name: Option<String>,
}

/// One way of rendering the picture.
struct Way {
    name: String,
    settings: RenderSettings,
    seconds: Vec<f64>,
}

pub fn run(options: &Options) -> Outcome {
    let scene = config11(options.size, options.aa, options.samples.into())?;
    let mut ways = ways();
    let mut samples = 0;
    for round in 1..=options.rounds {
        for way in &mut ways {
            let (_, stats, seconds) = picture(&scene, &way.settings)?;
            samples = samples.max(stats.shadow_rays);
            eprintln!("round {round}: {:30} {seconds:8.3} s", way.name);
            way.seconds.push(seconds);
        }
    }
    let program = program(options)?;
    let page = page(options, &ways, samples, &program);
    println!("{page}");
    if let Some(name) = &options.name {
        let folder = root().join("docs/benchmarks").join(name);
        write(&folder.join("README.md"), page.as_bytes())?;
        let runs: Vec<_> = ways.iter().map(|w| json!({ "way": w.name, "seconds": w.seconds })).collect();
        let data = json!({
            "width": options.size, "height": options.size, "antialiasing": options.aa, "samples": options.samples,
            "decided_samples": samples, "runs": runs,
            "small_picture_s": program.small, "peak_memory_bytes": program.memory,
            "commit": commit(), "processor": processor(),
        });
        let text = serde_json::to_string_pretty(&data).map_err(|e| e.to_string())?;
        write(&folder.join("config11.json"), format!("{text}\n").as_bytes())?;
    }
    Ok(())
}

/// Config 11 with `size` x `size` pixels, `aa` x `aa` camera rays in each, and so many points on the light.
pub(crate) fn config11(size: u32, aa: u32, samples: SamplesDesc) -> Result<Scene, String> {
    let builtin = builtin_scenes().iter().find(|b| b.name == "config11").ok_or("there is no config11")?;
    let mut parsed = SceneDesc::parse("config11.toml", builtin.text.as_bytes(), &NoAssets);
    let render = &mut parsed.desc.render;
    (render.width, render.height, render.antialiasing, render.samples) = (size, size, aa, samples);
    Ok(parsed.compile(&NoAssets, &CompileOptions::default()).map_err(|e| e.to_string())?.scene)
}

/// Renders a picture, and says in how many seconds.
pub(crate) fn picture(scene: &Scene, settings: &RenderSettings) -> Result<(Image, RenderStats, f64), String> {
    let start = Instant::now();
    let ControlFlow::Continue((film, stats)) = render(scene, settings, &|_, _| ControlFlow::Continue(())) else {
        return Err("stopped".into());
    };
    let seconds = start.elapsed().as_secs_f64();
    Ok((film.develop(), stats, seconds))
}

/// How far two pictures are apart, in steps of an 8-bit picture as it is displayed.
#[derive(Clone, Copy)]
pub(crate) struct Difference {
    pub worst: f64,
    /// Root mean square of the worst channel of each pixel.
    pub rms: f64,
    /// Pixels that are off by more than one step.
    pub over: usize,
}

impl Difference {
    pub fn between(a: &Image, b: &Image, display: &Display) -> Difference {
        let shown = |[r, g, b, _]: [f32; 4]| display.encode_color([r, g, b]);
        let (mut worst, mut over, mut sum) = (0.0f64, 0, 0.0);
        for (a, b) in a.pixels.iter().zip(&b.pixels) {
            let (a, b) = (shown(*a), shown(*b));
            let step = (0..3).map(|i| 255.0 * (a[i] - b[i]).abs()).fold(0.0, f64::max);
            worst = worst.max(step);
            over += usize::from(step > 1.0);
            sum += step * step;
        }
        Difference { worst, rms: (sum / a.pixels.len() as f64).sqrt(), over }
    }
}

/// The plain renderer, every instruction set on one thread, and the best on two and on all.
fn ways() -> Vec<Way> {
    let way = |name: String, simd: SimdLevel, threads: usize, reference: bool| Way {
        name,
        settings: RenderSettings {
            threads: NonZeroUsize::new(threads),
            simd,
            reference,
            aa_mode: AaMode::Full,
            ..Default::default()
        },
        seconds: Vec::new(),
    };
    let mut ways = vec![way("plain, 1 thread".into(), SimdLevel::Auto, 1, true)];
    for level in SimdLevel::available() {
        ways.push(way(format!("{}, 1 thread", level.name()), level, 1, false));
    }
    let best = SimdLevel::Auto.resolve();
    ways.push(way(format!("{}, 2 threads", best.name()), best, 2, false));
    ways
}

/// What the whole program takes.
struct Program {
    /// Process start to file, 64 x 64 pixels, in seconds: one for each run.
    small: Vec<f64>,
    /// Of the whole picture, in bytes.
    memory: u64,
}

fn program(options: &Options) -> Result<Program, String> {
    let program = built()?;
    let small = processes(&program, &["--width", "64", "--height", "64"], 21)?;
    let stats = std::env::temp_dir().join(format!("firstlight-bench-{}.json", std::process::id()));
    // Memory does not depend on the number of samples
    let (size, file) = (options.size.to_string(), format!("--stats={}", stats.display()));
    processes(&program, &["--width", &size, "--height", &size, "--samples", "1", &file], 1)?;
    let text = std::fs::read_to_string(&stats).map_err(|e| e.to_string())?;
    std::fs::remove_file(&stats).map_err(|e| e.to_string())?;
    let stats: serde_json::Value = serde_json::from_str(&text).map_err(|e| e.to_string())?;
    Ok(Program { small, memory: stats["peak_memory_bytes"].as_u64().unwrap_or(0) })
}

/// Builds the program: where it is.
pub(crate) fn built() -> Result<PathBuf, String> {
    run_to_end(cargo().args(["build", "--release", "--quiet", "--bin", "firstlight"]))?;
    let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    Ok(root().join(target).join("release/firstlight"))
}

/// Runs `firstlight render config11` so many times: the seconds from process start to file, one for each run.
pub(crate) fn processes(program: &Path, more: &[&str], runs: usize) -> Result<Vec<f64>, String> {
    let file = std::env::temp_dir().join(format!("firstlight-bench-{}.png", std::process::id()));
    let mut seconds = Vec::new();
    for _ in 0..runs {
        let mut command = Command::new(program);
        command.args(["render", "config11", "--quiet", "-o"]).arg(&file).args(more);
        let start = Instant::now();
        let status = command.status().map_err(|e| e.to_string())?;
        seconds.push(start.elapsed().as_secs_f64());
        if !status.success() {
            return Err(format!("{}: {status}", program.display()));
        }
    }
    std::fs::remove_file(&file).map_err(|e| e.to_string())?;
    Ok(seconds)
}

fn page(options: &Options, ways: &[Way], samples: u64, program: &Program) -> String {
    let mut page = String::new();
    let Options { rounds, size, aa, samples: n, .. } = options;
    let plain = median(&ways[0].seconds);
    let _ = writeln!(page, "## Config 11, every shadow ray decided\n");
    let _ = writeln!(
        page,
        "{size} x {size} pixels, {aa} x {aa} camera rays in each, {n} points on the light: {:.3} thousand million \
         light samples. Medians of {rounds} rounds; in each round every way ran once, one after the other, in one \
         process. Times are of the render stage.\n",
        samples as f64 / 1e9
    );
    let _ = writeln!(page, "- processor: {}", processor());
    let _ = writeln!(page, "- commit: {}", commit());
    let mut command = format!("cargo xtask bench --rounds {rounds} --size {size} --aa {aa} --samples {n}");
    if let Some(name) = &options.name {
        let _ = write!(command, " --name {name}");
    }
    let _ = writeln!(page, "- command: `{command}`\n");
    let _ = writeln!(page, "| way | seconds | least to most | million samples a second | times the plain renderer |");
    let _ = writeln!(page, "|---|---|---|---|---|");
    for way in ways {
        let seconds = median(&way.seconds);
        let (least, most) = way.seconds.iter().fold((f64::MAX, 0.0f64), |(a, b), s| (a.min(*s), b.max(*s)));
        let rate = samples as f64 / seconds / 1e6;
        let ratio = plain / seconds;
        let _ = writeln!(page, "| {} | {seconds:.2} | {least:.2} to {most:.2} | {rate:.0} | {ratio:.1} |", way.name);
    }
    if let [.., one, two] = ways {
        let _ = writeln!(page, "\nTwo threads: {:.2} times one.", median(&one.seconds) / median(&two.seconds));
    }
    let _ = writeln!(
        page,
        "\n`firstlight render config11 --width 64 --height 64`, process start to file: {:.1} ms (median of {}).\n\
         Peak memory of the whole picture: {:.1} MB.",
        median(&program.small) * 1e3,
        program.small.len(),
        program.memory as f64 / 1e6
    );
    page
}

pub(crate) fn median(seconds: &[f64]) -> f64 {
    let mut sorted = seconds.to_vec();
    sorted.sort_by(f64::total_cmp);
    let half = sorted.len() / 2;
    if sorted.len() % 2 == 1 { sorted[half] } else { (sorted[half - 1] + sorted[half]) * 0.5 }
}

pub(crate) fn processor() -> String {
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':').map(|(_, m)| m.trim()));
    let best = SimdLevel::Auto.resolve().name();
    format!("{}, {cores} cores, {best}", model.unwrap_or(std::env::consts::ARCH))
}

pub(crate) fn commit() -> String {
    let output = Command::new("git").args(["describe", "--always", "--dirty"]).current_dir(root()).output();
    output.map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned()).unwrap_or_default()
}
