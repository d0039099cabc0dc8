//! `cargo xtask models`: from a PLY file to a PNG file as whole processes, ours and those of others in turns.
//!
//! F3D and Mitsuba are asked through `tools/peers/*.py`, if the Python that is named has them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use serde_json::json;

use crate::bench::{built, commit, median, processor};
use crate::rays::terrain_mesh;
use crate::{Outcome, root, write};

/// What to measure, and where to write it.
#[derive(clap::Args)]
pub struct Options {
    /// A Python that has f3d and mitsuba (`pip install f3d mitsuba`; F3D also wants libEGL); without one only
    /// firstlight is timed.
    #[arg(long)]
    python: Option<PathBuf>,
    /// Rounds: each runs every program once, one after the other.
    #[arg(long, default_value_t = 5)]
    rounds: usize,
    /// Leaves out the mesh of 10 million triangles.
    #[arg(long)]
    quick: bool,
    /// The folder under docs/benchmarks, usually the date and the machine.
    #[arg(long)]
    name: Option<String>,
}

/// Pixels across and down.
const SIZE: &str = "1024";

/// A program and its mesh.
struct Way {
    name: &'static str,
    mesh: &'static str,
    command: Vec<String>,
    seconds: Vec<f64>,
    /// Largest resident memory, in kilobytes; 0 where the system does not say.
    kilobytes: u64,
}

pub fn run(options: &Options) -> Outcome {
    let folder = std::env::temp_dir().join(format!("firstlight-models-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    let mut ways = Vec::new();
    let ours = built()?.display().to_string();
    for (mesh, n) in [("terrain, 1 M", 707), ("terrain, 10 M", 2236)] {
        if options.quick && n > 1000 {
            continue;
        }
        let ply = folder.join(format!("{n}.ply"));
        write(&ply, &ply_bytes(n))?;
        let (ply, png) = (ply.display().to_string(), folder.join("out.png").display().to_string());
        let words = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
        let mut add = |name, command| ways.push(Way { name, mesh, command, seconds: Vec::new(), kilobytes: 0 });
        for (name, aa) in [("firstlight", "1"), ("firstlight, 4 x 4 rays a pixel", "4")] {
            let size = ["--width", SIZE, "--height", SIZE, "--quiet"];
            add(name, words(&[&[&ours, "render", &ply, "--aa", aa, "-o", &png], &size[..]].concat()));
        }
        if let Some(python) = &options.python {
            let python = python.display().to_string();
            for (name, script) in [("F3D", "mesh_f3d.py"), ("Mitsuba, scalar", "mesh_mitsuba.py")] {
                let script = root().join("tools/peers").join(script).display().to_string();
                add(name, words(&[&python, &script, &ply, &png, SIZE]));
            }
        }
    }
    for round in 1..=options.rounds {
        for way in &mut ways {
            let start = Instant::now();
            let kilobytes = process(&way.command)?;
            let seconds = start.elapsed().as_secs_f64();
            eprintln!("round {round}: {:15} {:32} {seconds:7.3} s {:7} MB", way.mesh, way.name, kilobytes / 1000);
            way.seconds.push(seconds);
            way.kilobytes = way.kilobytes.max(kilobytes);
        }
    }
    std::fs::remove_dir_all(&folder).map_err(|e| e.to_string())?;
    let page = page(options, &ways);
    println!("{page}");
    if let Some(name) = &options.name {
        let folder = root().join("docs/benchmarks").join(name);
        write(&folder.join("README.md"), page.as_bytes())?;
        let rows: Vec<_> = ways
            .iter()
            .map(|way| {
                let (mesh, program) = (&way.mesh, &way.name);
                json!({ "mesh": mesh, "program": program, "seconds": way.seconds, "kilobytes": way.kilobytes })
            })
            .collect();
        let data = json!({ "rows": rows, "commit": commit(), "processor": processor() });
        let text = serde_json::to_string_pretty(&data).map_err(|e| e.to_string())?;
        write(&folder.join("models.json"), format!("{text}\n").as_bytes())?;
    }
    Ok(())
}

/// Runs a program to its end: its largest resident memory, where GNU time is there to say it.
fn process(command: &[String]) -> Result<u64, String> {
    let time = Path::new("/usr/bin/time");
    let mut run = if time.exists() {
        let mut run = Command::new(time);
        run.args(["-f", "peak %M"]).args(command);
        run
    } else {
        let mut run = Command::new(&command[0]);
        run.args(&command[1..]);
        run
    };
    let output = run.stdout(Stdio::null()).output().map_err(|e| format!("{}: {e}", command[0]))?;
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(format!("{}: {}\n{said}", command.join(" "), output.status));
    }
    Ok(said.lines().filter_map(|line| line.strip_prefix("peak ")?.parse().ok()).next_back().unwrap_or(0))
}

/// The terrain of `n` x `n` squares as binary PLY.
fn ply_bytes(n: u32) -> Vec<u8> {
    let (positions, triangles) = terrain_mesh(n);
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        positions.len(),
        triangles.len()
    )
    .into_bytes();
    bytes.extend(positions.iter().flatten().flat_map(|c| c.to_le_bytes()));
    for triangle in &triangles {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes
}

fn page(options: &Options, ways: &[Way]) -> String {
    let mut page = String::from("# From a mesh file to a picture\n\n");
    let _ = writeln!(
        page,
        "Whole processes, from a binary PLY file to a PNG file of {SIZE} x {SIZE} pixels with one light that casts \
         shadows; medians of {} rounds, the programs in turns. Processor: {}. Commit {}.\n\n\
         `cargo xtask models --python PYTHON --rounds {}`\n",
        options.rounds,
        processor(),
        commit(),
        options.rounds,
    );
    page.push_str("| mesh | program | seconds | of firstlight's | peak memory |\n|---|---|---|---|---|\n");
    for way in ways {
        let own = ways.iter().find(|other| other.mesh == way.mesh).map_or(1.0, |own| median(&own.seconds));
        let seconds = median(&way.seconds);
        let memory = if way.kilobytes > 0 { format!("{} MB", way.kilobytes / 1000) } else { "not known".into() };
        let _ = writeln!(page, "| {} | {} | {seconds:.2} | {:.2} | {memory} |", way.mesh, way.name, seconds / own);
    }
    page
}
