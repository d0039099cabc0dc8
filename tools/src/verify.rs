//! `cargo xtask verify`: the tests that take long.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::bench::commit;
use crate::{Outcome, cargo, root, run as run_to_end, write};

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
    "pycocotools",
    "open3d-cpu",
    "mypy",
];

/// What pyrender takes, in an environment of its own: the OpenGL that it names is older than what renders off screen.
const PYRENDER: [&[&str]; 2] = [&["pyrender"], &["--no-deps", "PyOpenGL>=3.1.7"]];

/// The rays that each mesh is asked, by its tree and triangle by triangle.
const RAYS: &str = "1000000";

/// The `FIRSTLIGHT_SCENES` with which 20,000 models are damaged.
const DAMAGED: u32 = 2000;

/// The tests that `cargo test` leaves out render until nothing changes any more; those that grow with
/// `FIRSTLIGHT_SCENES` compare the renderers on that many random scenes; those that grow with `FIRSTLIGHT_RAYS` compare
/// the trees of meshes with asking every triangle. Of models that are damaged at random there are 20,000.
pub fn run(scenes: u32) -> Outcome {
    let mut command = cargo();
    command.env("FIRSTLIGHT_SCENES", scenes.to_string());
    let test = ["test", "--release", "--package", "firstlight-testkit", "--test", "truth"];
    run_to_end(command.args(test).args(["--", "--include-ignored"]))?;
    let mut command = cargo();
    command.env("FIRSTLIGHT_SCENES", DAMAGED.to_string());
    let test = ["test", "--release", "--package", "firstlight-testkit", "--test", "it", "damaged_models"];
    run_to_end(command.args(test).args(["--", "--nocapture"]))?;
    let mut command = cargo();
    command.env("FIRSTLIGHT_RAYS", RAYS);
    run_to_end(command.args(["test", "--release", "--package", "firstlight", "--lib", "shape::triangles"]))
}

/// All tests of the Python package, as it is installed, in an environment of their own; then its times beside those of
/// other programs. With a name, what was found is kept.
pub fn python(models: Option<&Path>, name: Option<&str>) -> Outcome {
    let (home, package) = (root().join("target/python"), root().join("crates/firstlight-python"));
    let python = environment(&home.join("large"), &[LARGE])?;
    let package_path = [package.as_os_str()];
    run_to_end(
        Command::new(&python)
            .args(["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps"])
            .args(package_path),
    )?;
    let mut pytest = Command::new(&python);
    pytest.current_dir(&package).args(["-m", "pytest", "-q", "-p", "no:cacheprovider"]).stderr(Stdio::inherit());
    if let Some(models) = models {
        let models = models.canonicalize().map_err(|fault| format!("{}: {fault}", models.display()))?;
        pytest.env("FIRSTLIGHT_MODELS", models);
    }
    let tested = pytest.output().map_err(|fault| format!("{}: {fault}", python.display()))?;
    let said = String::from_utf8_lossy(&tested.stdout);
    eprintln!("{said}");
    if !tested.status.success() {
        return Err("tests of the Python package fail".into());
    }
    let pyrender = environment(&home.join("pyrender"), &PYRENDER)?;
    let times = home.join("times.md");
    let mut speed = Command::new(&python);
    speed.arg(package.join("tests/large/speed.py")).arg("--memory").arg("--pyrender").arg(pyrender);
    run_to_end(speed.arg("--out").arg(&times))?;
    let Some(name) = name else { return Ok(()) };
    let times = std::fs::read_to_string(&times).map_err(|fault| format!("{}: {fault}", times.display()))?;
    let (commit, summary) = (commit(), said.lines().last().unwrap_or_default());
    let page = format!(
        "# The Python package\n\n`cargo xtask verify python --models FOLDER --name {name}`, at commit {commit}: \
         {summary}.\n\n{times}"
    );
    write(&root().join("docs/benchmarks").join(format!("{name}-python")).join("README.md"), page.as_bytes())
}

/// The interpreter of an environment that has some packages, which `pip` is given in their order.
fn environment(venv: &Path, packages: &[&[&str]]) -> Result<PathBuf, String> {
    let python = venv.join("bin/python");
    if !python.exists() {
        run_to_end(Command::new("python3").args(["-m", "venv"]).arg(venv))?;
    }
    for packages in packages {
        run_to_end(Command::new(&python).args(["-m", "pip", "install", "--quiet"]).args(*packages))?;
    }
    Ok(python)
}
