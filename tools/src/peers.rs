//! `cargo xtask peers`: config 11 as whole processes, ours and those of Mitsuba and POV-Ray in turns, each with its
//! error.
//!
//! The scene of the others lies in `tools/peers/config11*`. They shade otherwise, so each picture is held against a
//! converged one of the same program.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
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
    /// Rounds: each runs every program once, one after the other.
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    /// Width and height of the picture.
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
    seconds: Vec<f64>,
    /// In steps of an 8-bit picture: root mean square in smooth parts, and the worst there.
    error: Option<[f64; 2]>,
}

pub fn run(options: &Options) -> Outcome {
    let folder = std::env::temp_dir().join(format!("firstlight-peers-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    let mut ways = ways(options, &folder)?;
    for round in 0..=options.rounds {
        // The converged pictures first; they also leave Mitsuba's kernel compiled
        for way in ways.iter_mut().filter(|way| way.converged == (round == 0)) {
            let start = Instant::now();
            process(&way.command)?;
            let seconds = start.elapsed().as_secs_f64();
            eprintln!("round {round}: {:10} {:45} {seconds:8.3} s", way.program, way.name);
            way.seconds.push(seconds);
        }
    }
    for k in 0..ways.len() {
        let Some(own) = ways.iter().find(|way| way.converged && way.program == ways[k].program) else { continue };
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
            "size": options.size, "rows": rows, "versions": versions, "commit": commit(), "processor": processor(),
        });
        let text = serde_json::to_string_pretty(&data).map_err(|e| e.to_string())?;
        write(&folder.join("peers.json"), format!("{text}\n").as_bytes())?;
    }
    Ok(())
}

/// All programs that are there, two threads each.
fn ways(options: &Options, folder: &Path) -> Result<Vec<Way>, String> {
    let mut ways = Vec::new();
    let size = options.size.to_string();
    let mut add = |program, name, converged, command: &dyn Fn(&str) -> Vec<String>| {
        let picture = folder.join(format!("{}.png", ways.len()));
        let command = command(&picture.display().to_string());
        ways.push(Way { program, name, command, picture, converged, seconds: Vec::new(), error: None });
    };
    let words = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
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
    if let Some(python) = &options.python {
        let python = python.display().to_string();
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

/// Runs a program to its end.
fn process(command: &[String]) -> Outcome {
    let output = Command::new(&command[0]).args(&command[1..]).stdout(Stdio::null()).output();
    let output = output.map_err(|e| format!("{}: {e}", command[0]))?;
    let said = String::from_utf8_lossy(&output.stderr);
    if output.status.success() { Ok(()) } else { Err(format!("{}: {}\n{said}", command.join(" "), output.status)) }
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
    let mut page = String::from("## Config 11 in other programs\n\n");
    let _ = writeln!(
        page,
        "Whole processes, from start to a PNG file of {size} x {size} pixels, 2 threads, 16 camera rays in each pixel \
         where nothing else is said (POV-Ray: 17); medians of {rounds} rounds, the programs in turns. Place, size and \
         shape of all things are the same; shading is not: Mitsuba's materials and lamp are physical, POV-Ray takes \
         its lamp's places for shadows alone. So the error is that against a converged picture of the same program, \
         which was made once, in steps of an 8-bit picture as it is displayed, where that picture is smooth: where 3 \
         x 3 pixels span less than 6 steps. Samples of Mitsuba are camera rays x samples of the lamp for each; its \
         kernel was compiled before.\n"
    );
    let _ = writeln!(page, "- processor: {}\n- commit: {}", processor(), commit());
    for version in versions(options) {
        let _ = writeln!(page, "- {version}");
    }
    let peers = [("PYTHON", &options.python), ("POVRAY", &options.povray)];
    let peers = peers.iter().filter(|(_, path)| path.is_some());
    let peers: String = peers.map(|(name, _)| format!("--{} {name} ", name.to_lowercase())).collect();
    let name = options.name.as_ref().map(|name| format!(" --name {name}")).unwrap_or_default();
    let _ = writeln!(page, "- command: `cargo xtask peers {peers}--rounds {rounds} --size {size}{name}`\n");
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
