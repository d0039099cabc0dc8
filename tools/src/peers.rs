//! `cargo xtask peers`: config 11 as whole processes, ours and those of Mitsuba and POV-Ray in turns, each with its
//! error. With `--curve`, the error of soft shadows on meshes against processor time, ours and Mitsuba's.
//!
//! The scenes lie in `tools/peers/`. The others shade config 11 otherwise, so each picture is held against a converged
//! one of the same program.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use firstlight::StoredImage;
use serde_json::json;

use crate::bench::{built, commit, median, processor};
use crate::{Outcome, root, write};

/// What to measure, and where to write it.
#[derive(clap::Args)]
pub struct Options {
    /// A Python that has mitsuba and numpy; `DRJIT_LIBLLVM_PATH` tells Mitsuba its LLVM. Without one it is left out.
    #[arg(long)]
    python: Option<PathBuf>,
    /// POV-Ray 3.7; without it, it is left out.
    #[arg(long)]
    povray: Option<PathBuf>,
    /// Two smooth meshes under two area lights instead of config 11, at several tolerances and numbers of samples.
    #[arg(long, conflicts_with = "povray")]
    curve: bool,
    /// With `--curve`: one model of rough metal, the other and the floor with textures.
    #[arg(long, requires = "curve")]
    textured: bool,
    /// Rounds: each runs every program once, one after the other.
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    /// Width of the picture; its height is the same, with `--curve` 9/16 of it.
    #[arg(long, default_value_t = 512)]
    size: u32,
    /// The firstlight to time, if it is built already.
    #[arg(long)]
    program: Option<PathBuf>,
    /// The folder under docs/benchmarks, usually the date and the machine.
    #[arg(long)]
    name: Option<String>,
}

/// One program with its settings.
struct Way {
    program: &'static str,
    name: &'static str,
    command: Vec<String>,
    picture: PathBuf,
    /// Its picture is what others of the same program are held against; it runs once.
    converged: bool,
    /// Of the whole process by the clock; for the curve, of the processor.
    seconds: Vec<f64>,
    /// In steps of an 8-bit picture: root mean square in smooth parts, and the worst there.
    error: Option<[f64; 2]>,
}

pub fn run(options: &Options) -> Outcome {
    let folder = std::env::temp_dir().join(format!("firstlight-peers-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    let mut ways = if options.curve { curve(options, &folder) } else { config11(options, &folder) }?;
    for round in 0..=options.rounds {
        // The converged pictures first; they also leave Mitsuba's kernel compiled
        for way in ways.iter_mut().filter(|way| way.converged == (round == 0)) {
            let seconds = seconds(&way.command, options.curve)?;
            eprintln!("round {round}: {:10} {:45} {seconds:8.3} s", way.program, way.name);
            way.seconds.push(seconds);
        }
    }
    for k in 0..ways.len() {
        // The converged pictures of the curve are of one scene, and held against the first
        let is_judge =
            |way: &&Way| way.converged && (way.program == ways[k].program || options.curve && ways[k].converged);
        let Some(own) = ways.iter().find(is_judge) else { continue };
        let [picture, truth] = [&ways[k].picture, &own.picture].map(|path| read(path));
        ways[k].error = Some(error(&picture?, &truth?));
    }
    std::fs::remove_dir_all(&folder).map_err(|e| e.to_string())?;
    let page = page(options, &ways);
    println!("{page}");
    if let Some(name) = &options.name {
        let folder = root().join("docs/benchmarks").join(name);
        write(&folder.join("README.md"), page.as_bytes())?;
        let row = |way: &Way| {
            json!({
                "program": way.program, "settings": way.name, "converged": way.converged, "seconds": way.seconds,
                "error": way.error,
            })
        };
        let rows: Vec<_> = ways.iter().map(row).collect();
        let versions = versions(options);
        let data = json!({
            "scene": match (options.curve, options.textured) {
                (true, true) => "textured meshes",
                (true, false) => "soft meshes",
                _ => "config11",
            },
            "size": options.size, "rows": rows, "versions": versions, "commit": commit(), "processor": processor(),
        });
        let text = serde_json::to_string_pretty(&data).map_err(|e| e.to_string())?;
        write(&folder.join("peers.json"), format!("{text}\n").as_bytes())?;
    }
    Ok(())
}

/// Config 11 in all programs that are there, two threads each.
fn config11(options: &Options, folder: &Path) -> Result<Vec<Way>, String> {
    let mut ways = Vec::new();
    let size = options.size.to_string();
    let mut add = |program, name, converged, command: &dyn Fn(&str) -> Vec<String>| {
        let picture = folder.join(format!("{}.png", ways.len()));
        ways.push(Way::new(program, name, converged, picture, command));
    };
    let ours = options.program.clone().map_or_else(built, Ok)?.display().to_string();
    let own = [&ours, "render", "config11", "--quiet", "--threads", "2", "--bits", "16"];
    let own =
        |more: &[&str], out: &str| words(&[&own[..], &["--width", &size, "--height", &size, "-o", out], more].concat());
    add("firstlight", "4096 points, every camera ray", true, &|out| {
        own(&["--samples", "4096", "--aa-mode", "full"], out)
    });
    add("firstlight", "integrated: the default", false, &|out| own(&[], out));
    add("firstlight", "400 points, every camera ray", false, &|out| {
        own(&["--samples", "400", "--aa-mode", "full"], out)
    });
    if let Some(python) = options.mitsuba() {
        let script = root().join("tools/peers/config11_mitsuba.py").display().to_string();
        let mitsuba = |rays: &str, samples: &str, out: &str| words(&[&python, &script, &size, rays, samples, out]);
        // Always 25 samples of the light: its loop over them is unrolled, and 400 take half a minute to compile
        add("Mitsuba", "direct, 2048 x 25 samples", true, &|out| mitsuba("2048", "25", out));
        add("Mitsuba", "direct, 16 x 25 samples", false, &|out| mitsuba("16", "25", out));
        add("Mitsuba", "direct, 256 x 25 samples", false, &|out| mitsuba("256", "25", out));
    }
    if let Some(povray) = &options.povray {
        let povray = povray.display().to_string();
        let scene = format!("+I{}", root().join("tools/peers/config11.pov").display());
        let (w, h) = (format!("+W{size}"), format!("+H{size}"));
        let fixed =
            [&povray, &scene, "+FN16", &w, &h, "+A0.0", "+R4", "+AM1", "-J", "+WT2", "-D", "-V", "File_Gamma=2.2"];
        let povray = |grid: &str, adapt: &str, out: &str| {
            let (grid, adapt) = (format!("Declare=LRES={grid}"), format!("Declare=ADAPT={adapt}"));
            words(&[&fixed[..], &[&format!("+O{out}"), &grid, &adapt, "Declare=ILLUM=0"]].concat())
        };
        add("POV-Ray", "65 x 65 places, adaptive 4, for shadows alone", true, &|out| povray("65", "4", out));
        add("POV-Ray", "20 x 20 places, adaptive 1, for shadows alone", false, &|out| povray("20", "1", out));
    }
    Ok(ways)
}

/// Two smooth meshes under two area lights in firstlight and, if it is there, Mitsuba, two threads each.
fn curve(options: &Options, folder: &Path) -> Result<Vec<Way>, String> {
    let mut ways = Vec::new();
    let mut add = |program, name, converged, command: &[&str]| {
        let picture = folder.join(format!("{}.png", ways.len()));
        let command = |out: &str| words(&[command, &[out]].concat());
        ways.push(Way::new(program, name, converged, picture, &command));
    };
    let (width, height) = (options.size.to_string(), (options.size * 9 / 16).to_string());
    let ours = options.program.clone().map_or_else(built, Ok)?.display().to_string();
    let scene = if options.textured { "tools/peers/textured_meshes.toml" } else { "tools/peers/soft_meshes.toml" };
    let scene = root().join(scene).display().to_string();
    let models = root().display().to_string();
    let own = [
        &ours,
        "render",
        &scene,
        "--allow-dir",
        &models,
        "--quiet",
        "--threads",
        "2",
        "--bits",
        "16",
        "--width",
        &width,
    ];
    let own = [&own[..], &["--height", &height]].concat();
    for (name, aa, tolerance) in [
        ("tolerance 0.25", "4", "0.25"),
        ("tolerance 1: the default", "4", "1"),
        ("tolerance 4", "4", "4"),
        ("tolerance 16", "4", "16"),
        ("tolerance 4, 2 x 2 camera rays", "2", "4"),
        ("tolerance 16, 2 x 2 camera rays", "2", "16"),
        ("tolerance 16, one camera ray", "1", "16"),
    ] {
        let command = [&own[..], &["--aa", aa, "--tolerance", tolerance, "-o"]].concat();
        add("firstlight", name, tolerance == "0.25", &command);
    }
    if let Some(python) = options.mitsuba() {
        let script = root().join("tools/peers/soft_meshes_mitsuba.py").display().to_string();
        for (name, samples, passes) in [
            ("direct, 20 x 1024 samples", "1024", "20"),
            ("direct, 16 samples", "16", "1"),
            ("direct, 64 samples", "64", "1"),
            ("direct, 256 samples", "256", "1"),
            ("direct, 1024 samples", "1024", "1"),
        ] {
            let mut command = vec![&python[..], &script, &width, samples, passes];
            command.extend(options.textured.then_some("textured"));
            add("Mitsuba", name, passes == "20", &command);
        }
    }
    Ok(ways)
}

impl Options {
    /// The Python that has Mitsuba.
    fn mitsuba(&self) -> Option<String> {
        let python = self.python.as_ref()?.display().to_string();
        let test = Command::new(&python).args(["-c", "import mitsuba"]).output();
        test.is_ok_and(|test| test.status.success()).then_some(python)
    }
}

impl Way {
    fn new(
        program: &'static str,
        name: &'static str,
        converged: bool,
        picture: PathBuf,
        command: &dyn Fn(&str) -> Vec<String>,
    ) -> Way {
        let command = command(&picture.display().to_string());
        Way { program, name, command, picture, converged, seconds: Vec::new(), error: None }
    }
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| (*word).to_owned()).collect()
}

/// Runs a program to its end: how long it took by the clock, or how much of the processor, user and system. A number
/// that the program prints is the processor time of its render alone, and counts instead.
fn seconds(command: &[String], of_processor: bool) -> Result<f64, String> {
    let (before, start) = (children_seconds(), Instant::now());
    let output = Command::new(&command[0]).args(&command[1..]).output();
    let (clock, after) = (start.elapsed().as_secs_f64(), children_seconds());
    let output = output.map_err(|e| format!("{}: {e}", command[0]))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(format!("{}: {}\n{said}", command.join(" "), output.status));
    }
    if !of_processor {
        return Ok(clock);
    }
    let printed = String::from_utf8_lossy(&output.stdout).trim().parse().ok();
    let processor = || Some(after? - before?);
    printed.or_else(processor).ok_or_else(|| "processor time is read from /proc, which only Linux has".into())
}

/// User and system time of all processes that this one waited for.
fn children_seconds() -> Option<f64> {
    seconds_in_stat(&std::fs::read_to_string("/proc/self/stat").ok()?)
}

/// `cutime` and `cstime` of `/proc/PID/stat`, fields 16 and 17 (proc(5)), in Linux's ticks of 10 ms. The second field,
/// the name in parentheses, may contain spaces.
fn seconds_in_stat(stat: &str) -> Option<f64> {
    let after_name = stat.rsplit_once(')')?.1;
    let ticks: Vec<f64> = after_name.split_whitespace().skip(13).take(2).filter_map(|word| word.parse().ok()).collect();
    (ticks.len() == 2).then(|| ticks.iter().sum::<f64>() / 100.0)
}

fn read(path: &Path) -> Result<StoredImage, String> {
    let fault = |e: String| format!("{}: {e}", path.display());
    let bytes = std::fs::read(path).map_err(|e| fault(e.to_string()))?;
    StoredImage::read(&bytes).map_err(|e| fault(e.to_string()))
}

/// A pixel is in a smooth part if it and those around it span less than so many steps.
const SMOOTH: f32 = 6.0 / 255.0;

/// How far two pictures are apart in the smooth parts of the second: root mean square of all channels, and the worst.
fn error(picture: &StoredImage, truth: &StoredImage) -> [f64; 2] {
    let [width, height] = truth.film.map(|side| side as usize);
    let (mut sum, mut count, mut worst) = (0.0, 0, 0.0f64);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let around = || (0..9).map(|k| &truth.pixels[(y + k / 3 - 1) * width + x + k % 3 - 1]);
            let span = |channel: usize| {
                let (low, high) =
                    around().fold((1.0f32, 0.0f32), |(low, high), p| (low.min(p[channel]), high.max(p[channel])));
                high - low
            };
            if (0..3).all(|channel| span(channel) < SMOOTH) {
                let at = y * width + x;
                for (a, b) in picture.pixels[at].iter().zip(&truth.pixels[at]).take(3) {
                    let step = 255.0 * f64::from((a - b).abs());
                    (sum, count, worst) = (sum + step * step, count + 1, worst.max(step));
                }
            }
        }
    }
    [(sum / f64::from(count.max(1))).sqrt(), worst]
}

/// What the others say of themselves.
fn versions(options: &Options) -> Vec<String> {
    let first_line = |command: &mut Command| {
        let output = command.output().ok()?;
        let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
        said.lines().find(|line| line.starts_with("POV-Ray") || line.starts_with("Mitsuba")).map(str::to_owned)
    };
    let mut versions = Vec::new();
    if let Some(python) = &options.python {
        let said =
            first_line(Command::new(python).args(["-c", "import mitsuba; print('Mitsuba', mitsuba.__version__)"]));
        let llvm = std::env::var("DRJIT_LIBLLVM_PATH").unwrap_or_default();
        let llvm = Path::new(&llvm).file_name().map(|name| name.to_string_lossy().into_owned());
        let llvm = llvm.unwrap_or_else(|| "an LLVM it found".into());
        versions.extend(said.map(|said| format!("{said}, llvm_ad_rgb with {llvm}")));
    }
    if let Some(povray) = &options.povray {
        versions.extend(first_line(Command::new(povray).arg("--version")));
    }
    versions
}

fn page(options: &Options, ways: &[Way]) -> String {
    let Options { size, rounds, .. } = options;
    let mut page = String::new();
    let text = if options.curve { about_curve(options, ways) } else { about_config11(options) };
    let _ = writeln!(page, "{text}\n\n- processor: {}\n- commit: {}", processor(), commit());
    for version in versions(options) {
        let _ = writeln!(page, "- {version}");
    }
    if options.mitsuba().is_none() {
        page.push_str("- Mitsuba: not measured, as `--python` names no Python that has it\n");
    }
    let peers = [("PYTHON", &options.python), ("POVRAY", &options.povray)];
    let peers = peers.iter().filter(|(_, path)| path.is_some());
    let peers: String = peers.map(|(name, _)| format!("--{} {name} ", name.to_lowercase())).collect();
    let name = options.name.as_ref().map(|name| format!(" --name {name}")).unwrap_or_default();
    let curve = match (options.curve, options.textured) {
        (true, true) => "--curve --textured ",
        (true, false) => "--curve ",
        _ => "",
    };
    let _ = writeln!(page, "- command: `cargo xtask peers {curve}{peers}--rounds {rounds} --size {size}{name}`\n");
    let _ = writeln!(page, "| program | settings | seconds | rms error | worst error |\n|---|---|---|---|---|");
    for way in ways {
        let seconds = median(&way.seconds);
        let error = match way.error {
            _ if way.converged => "the measure | ".into(),
            Some([rms, worst]) => format!("{rms:.3} | {worst:.2}"),
            None => " | ".into(),
        };
        let _ = writeln!(page, "| {} | {} | {seconds:.2} | {error} |", way.program, way.name);
    }
    page
}

fn about_config11(Options { size, rounds, .. }: &Options) -> String {
    format!(
        "## Config 11 in other programs\n\n\
         Whole processes, from start to a PNG file of {size} x {size} pixels, 2 threads, 16 camera rays in each pixel \
         where nothing else is said (POV-Ray: 17); medians of {rounds} rounds, the programs in turns. Place, size and \
         shape of all things are the same; shading is not: Mitsuba's materials and lamp are physical, POV-Ray takes \
         its lamp's places for shadows alone. So the error is that against a converged picture of the same program, \
         which was made once, in steps of an 8-bit picture as it is displayed, where that picture is smooth: where 3 \
         x 3 pixels span less than 6 steps. Samples of Mitsuba are camera rays x samples of the lamp for each; its \
         kernel was compiled before."
    )
}

fn about_curve(Options { size, rounds, textured, .. }: &Options, ways: &[Way]) -> String {
    let height = size * 9 / 16;
    let (title, what) = match textured {
        true => (
            "Textures and metal: error against time",
            "Two smooth models of 5,856 triangles, one of rough metal, the other and the floor with a picture of \
             cobbles, under two area lights",
        ),
        false => (
            "Soft shadows on meshes: error against time",
            "Two smooth models of 5,856 triangles on a floor under two area lights",
        ),
    };
    let more = if *textured { ", and one direction of the lobe" } else { "" };
    let mut text = format!(
        "## {title}\n\n{what}, {size} x {height} pixels, 2 threads; 4 x 4 camera rays in each pixel of firstlight \
         where nothing else is said, in Mitsuba as many as samples, with one point of one light for each{more}. \
         Seconds are of the processor, both threads together, medians of {rounds} rounds, the programs in turns: the \
         whole process of firstlight, the render alone of Mitsuba, without its start and compilation. Ratios count \
         more than seconds, as the machine may do other work. The error is that against a converged picture of the \
         same program, which was made once, in steps of an 8-bit picture as it is \
         displayed, where that picture is smooth: where 3 x 3 pixels span less than 6 steps."
    );
    if let Some([rms, _]) = ways.iter().find(|way| way.converged && way.program == "Mitsuba").and_then(|way| way.error)
    {
        let _ = write!(text, " The converged pictures of the two are {rms:.3} steps apart, root mean square.");
    }
    text
}

#[cfg(test)]
mod tests {
    use firstlight::{Format, Receipt, Window};

    use super::*;

    #[test]
    fn processor_time_of_children_is_read_behind_any_name() {
        let stat = "7 (a) b (c) S 1 7 7 0 -1 4194560 9 8 0 0 1 2 340 21 20 0 1 0 99";
        assert_eq!(seconds_in_stat(stat), Some(3.61));
        assert_eq!(seconds_in_stat("7 (a) S 1 7"), None);
    }

    #[test]
    fn an_error_is_that_of_smooth_parts() {
        let picture = |values: [f32; 25]| StoredImage {
            format: Format::Png16,
            film: [5, 5],
            window: Window { x: 0, y: 0, width: 5, height: 5 },
            pixels: values.map(|v| [v, v, v, 1.0]).to_vec(),
            receipt: Receipt::default(),
        };
        let flat = picture([0.5; 25]);
        let mut values = [0.5; 25];
        values[12] += 2.0 / 255.0;
        let [rms, worst] = error(&picture(values), &flat);
        assert!((worst - 2.0).abs() < 1e-4 && (rms - 2.0 / 3.0).abs() < 1e-4, "{rms} {worst}");
        // All of the inner pixels see the edge
        values[12] = 1.0;
        assert_eq!(error(&flat, &picture(values)), [0.0, 0.0]);
    }

    #[test]
    fn the_curve_without_mitsuba_measures_firstlight_alone() {
        let options = Options {
            python: Some("no-such-python".into()),
            povray: None,
            curve: true,
            textured: false,
            rounds: 1,
            size: 64,
            program: Some("firstlight".into()),
            name: None,
        };
        let mut ways = curve(&options, Path::new("folder")).unwrap();
        ways.iter_mut().for_each(|way| way.seconds.push(1.0));
        assert!(ways.iter().all(|way| way.program == "firstlight"));
        assert_eq!(ways.iter().filter(|way| way.converged).count(), 1);
        assert!(page(&options, &ways).contains("Mitsuba: not measured"));
    }
}
