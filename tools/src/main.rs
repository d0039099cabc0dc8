//! The project's own commands but for its tests: `cargo xtask COMMAND`.

mod bench;
mod curves;
mod engine;
mod exact;
mod generate;
mod lights;
mod meshes;
mod models;
mod peers;
mod pictures;
mod plot;
mod rays;
mod shading_rate;
mod slow;
mod verify;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use xtask::{Outcome, cargo, root, run};

/// The project's own commands.
#[derive(Parser)]
#[command(
    name = "cargo xtask",
    after_help = "Without the library:\n  test   runs every check and every test; needs Rust and nothing else\n  \
                  dist   builds the program as it is handed out, in target/dist\n  \
                  wheel  builds the Python package, as a wheel and as sources, in target/wheels"
)]
struct Args {
    #[command(subcommand)]
    command: Task,
}

#[derive(Subcommand)]
enum Task {
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
    /// Measures integrated light behind meshes, against 256 points traced and 1,024 by shafts.
    Meshes(meshes::Options),
    /// Measures a hall full of small lights, or writes it as a scene.
    Lights(lights::Options),
    /// Measures rays through meshes, against Embree where it is installed, and writes a page under docs/benchmarks.
    Rays(rays::Options),
    /// Measures whole processes from a mesh file to a picture, against F3D and Mitsuba where a Python has them, and
    /// writes a page under docs/benchmarks.
    Models(models::Options),
    /// Measures config 11, or the curve of soft shadows on meshes, against Mitsuba and POV-Ray, where they are named,
    /// and writes a page under docs/benchmarks.
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
    /// Compares pictures whose camera rays share their light, as by default, with every ray lit by itself, at real
    /// size.
    ShadingRate(shading_rate::Options),
    /// Tests the Python package beside packages that are too large for every day: Ray, trimesh, OpenImageIO, OpenCV,
    /// Open3D, pycocotools, mypy; and times it beside Open3D and pyrender.
    Python {
        /// A folder with models, which are compared with the ray caster of trimesh.
        #[arg(long)]
        models: Option<PathBuf>,
        /// Writes what it found to `docs/benchmarks/NAME-python/`.
        #[arg(long, value_name = "DATE-MACHINE")]
        name: Option<String>,
    },
}

fn main() -> ExitCode {
    let outcome = match Args::parse().command {
        Task::Generate { check } => generate::run(check),
        Task::Pictures { filter } => pictures::run(filter.as_deref()),
        Task::Bench(options) => bench::run(&options),
        Task::Engine(options) => engine::run(&options),
        Task::Meshes(options) => meshes::run(&options),
        Task::Lights(options) => lights::run(&options),
        Task::Rays(options) => rays::run(&options),
        Task::Models(options) => models::run(&options),
        Task::Peers(options) => peers::run(&options),
        Task::Verify { what: Some(Verify::Exact(options)), .. } => exact::run(&options),
        Task::Verify { what: Some(Verify::ShadingRate(options)), .. } => shading_rate::run(&options),
        Task::Verify { what: Some(Verify::Python { models, name }), .. } => {
            verify::python(models.as_deref(), name.as_deref())
        }
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

/// Writes a file and makes its folder.
fn write(path: &Path, bytes: &[u8]) -> Outcome {
    let fault = |e: std::io::Error| format!("{}: {e}", path.display());
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(fault)?;
    }
    std::fs::write(path, bytes).map_err(fault)
}
