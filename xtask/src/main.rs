//! The project's own commands: `cargo xtask COMMAND`.

mod bench;
mod curves;
mod engine;
mod exact;
mod generate;
mod lights;
mod models;
mod peers;
mod pictures;
mod plot;
mod rays;
mod test;
mod verify;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use clap::{Parser, Subcommand};

/// The project's own commands.
#[derive(Parser)]
#[command(name = "cargo xtask")]
struct Args {
    #[command(subcommand)]
    command: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Runs every check and every test; needs Rust and nothing else.
    Test,
    /// Writes what is made from the code: the scene format reference and the JSON Schema.
    Generate {
        /// Changes nothing; fails if a file is not up to date.
        #[arg(long)]
        check: bool,
    },
    /// Renders the pictures of the book: the built-in scenes, the gallery, and what goes on inside (visibility, heat).
    Pictures {
        /// Only those whose name contains this.
        filter: Option<String>,
    },
    /// Measures config 11 and writes a page under docs/benchmarks.
    Bench(bench::Options),
    /// Measures what each part of the light engine gains, on config 11 and on a mesh, and writes a page under
    /// docs/benchmarks.
    Engine(engine::Options),
    /// Measures a hall full of small lights, or writes it as a scene.
    Lights(lights::Options),
    /// Measures rays through meshes, against Embree where it is installed, and writes a page under docs/benchmarks.
    Rays(rays::Options),
    /// Measures whole processes from a mesh file to a picture, against F3D and Mitsuba where a Python has them, and
    /// writes a page under docs/benchmarks.
    Models(models::Options),
    /// Measures config 11 against Mitsuba and POV-Ray, where they are named, and writes a page under docs/benchmarks.
    Peers(peers::Options),
    /// Runs the tests that take long: more scenes, more rays.
    #[command(args_conflicts_with_subcommands = true)]
    Verify {
        /// Random scenes for the comparison of the renderers.
        #[arg(long, default_value_t = 5000)]
        scenes: u32,
        #[command(subcommand)]
        what: Option<Verify>,
    },
}

#[derive(Subcommand)]
enum Verify {
    /// Compares integrated light with the converged picture, on random scenes.
    Exact(exact::Options),
}

/// What a command ends with: nothing, or what went wrong.
type Outcome = Result<(), String>;

impl Task {
    /// Whether it renders so much, or measures, that only a release build will do.
    fn wants_release(&self) -> bool {
        !matches!(self, Task::Test | Task::Generate { .. } | Task::Verify { what: None, .. })
    }
}

fn main() -> ExitCode {
    let task = Args::parse().command;
    if cfg!(debug_assertions) && task.wants_release() {
        return again_in_release();
    }
    let outcome = match task {
        Task::Test => test::run(),
        Task::Generate { check } => generate::run(check),
        Task::Pictures { filter } => pictures::run(filter.as_deref()),
        Task::Bench(options) => bench::run(&options),
        Task::Engine(options) => engine::run(&options),
        Task::Lights(options) => lights::run(&options),
        Task::Rays(options) => rays::run(&options),
        Task::Models(options) => models::run(&options),
        Task::Peers(options) => peers::run(&options),
        Task::Verify { what: Some(Verify::Exact(options)), .. } => exact::run(&options),
        Task::Verify { scenes, what: None } => verify::run(scenes),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("xtask: {fault}");
            ExitCode::FAILURE
        }
    }
}

/// Runs this command line again, built for release. What is quick shares the build of the tests.
fn again_in_release() -> ExitCode {
    let status = cargo()
        .args(["run", "--quiet", "--release", "--package", "xtask", "--"])
        .args(std::env::args_os().skip(1))
        .current_dir(".")
        .status();
    match status {
        Ok(status) if status.success() => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(fault) => {
            eprintln!("xtask: {fault}");
            ExitCode::FAILURE
        }
    }
}

/// The repository's root.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map(Path::to_path_buf).unwrap_or_default()
}

/// The cargo that runs us.
fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root());
    command
}

/// Runs a command to its end, its output shown.
fn run(command: &mut Command) -> Outcome {
    let words: Vec<_> = std::iter::once(command.get_program()).chain(command.get_args()).collect();
    let line = words.join(" ".as_ref()).to_string_lossy().into_owned();
    eprintln!("\n$ {line}");
    let status = command.status().map_err(|e| format!("{line}: {e}"))?;
    if status.success() { Ok(()) } else { Err(format!("{line}: {status}")) }
}

/// Writes a file and makes its folder.
fn write(path: &Path, bytes: &[u8]) -> Outcome {
    let fault = |e: std::io::Error| format!("{}: {e}", path.display());
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(fault)?;
    }
    std::fs::write(path, bytes).map_err(fault)
}
