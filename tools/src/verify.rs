//! `cargo xtask verify`: the tests that take long.

use std::path::Path;
use std::process::Command;

use crate::{Outcome, cargo, root, run as run_to_end};

/// What the tests of `tests/large` take beside what the package itself does. OpenCV 5 reads no EXR files.
const LARGE: &[&str] = &[
    "pytest",
    "OpenEXR",
    "ray",
    "trimesh",
    "embreex",
    "pillow",
    "OpenImageIO",
    "opencv-python-headless<5",
    "cryptomatte-api",
];

/// The rays that each mesh is asked, by its tree and triangle by triangle.
const RAYS: &str = "1000000";

/// The tests that `cargo test` leaves out render until nothing changes any more; those that grow with
/// `FIRSTLIGHT_SCENES` compare the renderers on that many random scenes; those that grow with `FIRSTLIGHT_RAYS` compare
/// the trees of meshes with asking every triangle.
pub fn run(scenes: u32) -> Outcome {
    let mut command = cargo();
    command.env("FIRSTLIGHT_SCENES", scenes.to_string());
    let test = ["test", "--release", "--package", "firstlight-testkit", "--test", "truth"];
    run_to_end(command.args(test).args(["--", "--include-ignored"]))?;
    let mut command = cargo();
    command.env("FIRSTLIGHT_RAYS", RAYS);
    run_to_end(command.args(["test", "--release", "--package", "firstlight", "--lib", "shape::triangles"]))
}

/// All tests of the Python package, as it is installed, in an environment of their own.
pub fn python(models: Option<&Path>) -> Outcome {
    let (venv, package) = (root().join("target/python/large"), root().join("crates/firstlight-python"));
    let python = venv.join("bin/python");
    if !python.exists() {
        run_to_end(Command::new("python3").args(["-m", "venv"]).arg(&venv))?;
    }
    let pip = |what: &[&std::ffi::OsStr]| {
        run_to_end(Command::new(&python).args(["-m", "pip", "install", "--quiet"]).args(what))
    };
    pip(&LARGE.iter().map(std::ffi::OsStr::new).collect::<Vec<_>>())?;
    pip(&["--force-reinstall".as_ref(), "--no-deps".as_ref(), package.as_os_str()])?;
    let mut pytest = Command::new(&python);
    pytest.current_dir(&package).args(["-m", "pytest", "-q", "-p", "no:cacheprovider"]);
    if let Some(models) = models {
        let models = models.canonicalize().map_err(|fault| format!("{}: {fault}", models.display()))?;
        pytest.env("FIRSTLIGHT_MODELS", models);
    }
    run_to_end(&mut pytest)
}
