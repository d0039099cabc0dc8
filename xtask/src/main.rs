//! `cargo xtask test`: every check, then every test, so that the test runner has the last word; `cargo xtask dist` and
//! `cargo xtask wheel`: what is handed out. All other commands are handed to `firstlight-tools`: they need the library,
//! and cargo would build it for them in another way than for the tests.

use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use xtask::{Outcome, cargo, dist, root, run as run_to_end, target_folder, wheel};

/// Builds the book, where mdBook is installed; its links are among the tests.
fn build_book() -> Outcome {
    let mut command = std::process::Command::new("mdbook");
    let Ok(output) = command.arg("build").arg(root().join("docs")).output() else {
        eprintln!("\nno mdbook: the book is not built, only its links are tested");
        return Ok(());
    };
    let said = String::from_utf8_lossy(&output.stderr);
    eprintln!("\n$ mdbook build docs\n{said}");
    // A warning of the book's builder is a broken page
    if output.status.success() && !said.contains("WARN") && !said.contains("ERROR") {
        Ok(())
    } else {
        Err("mdbook build docs: not without warnings".into())
    }
}

/// The numbers of the pages that walk through config 11, from scripts that share no code with the renderer.
fn check_walks() -> Outcome {
    let mut python = std::process::Command::new("python3");
    if python.arg("--version").output().is_err() {
        eprintln!("\nno python3: the numbers of docs/walk.py and docs/default_pixel.py are not checked");
        return Ok(());
    }
    for script in ["docs/walk.py", "docs/default_pixel.py"] {
        run_to_end(std::process::Command::new("python3").current_dir(root()).args([script, "--check"]))?;
    }
    Ok(())
}

/// Tests the Python package: the extension of the build that the other tests use, in a folder under `target` with the
/// package's own Python, and pytest in an environment there.
fn test_python() -> Outcome {
    let mut python = std::process::Command::new("python3");
    if python.arg("--version").output().is_err() {
        eprintln!("\nno python3: the Python package is not tested");
        return Ok(());
    }
    let library = if cfg!(target_os = "macos") { "lib_firstlight.dylib" } else { "lib_firstlight.so" };
    // With the tests beside it, so that nothing is compiled twice
    run_command(&["build", "--workspace", "--lib", "--bins", "--tests", "--examples", "--quiet"])?;
    let target = target_folder();
    let (home, crates) = (target.join("python"), root().join("crates/firstlight-python"));
    let site = home.join("site/firstlight");
    let copy = |from: &Path, to: &Path| {
        std::fs::copy(from, to).map(drop).map_err(|fault| format!("{}: {fault}", from.display()))
    };
    std::fs::create_dir_all(&site).map_err(|fault| format!("{}: {fault}", site.display()))?;
    let sources = crates.join("python/firstlight");
    for entry in std::fs::read_dir(&sources).map_err(|fault| format!("{}: {fault}", sources.display()))?.flatten() {
        if entry.path().is_file() {
            copy(&entry.path(), &site.join(entry.file_name()))?;
        }
    }
    copy(&target.join("debug").join(library), &site.join("_firstlight.abi3.so"))?;
    let (venv, python) = (home.join("venv"), home.join("venv/bin/python"));
    let packages = ["numpy", "pytest", "pytest-xdist", "OpenEXR"];
    let has_all = std::process::Command::new(&python).args(["-c", "import numpy, pytest, xdist, OpenEXR"]).output();
    if !has_all.is_ok_and(|output| output.status.success()) {
        run_to_end(std::process::Command::new("python3").args(["-m", "venv"]).arg(&venv))?;
        run_to_end(std::process::Command::new(&python).args(["-m", "pip", "install", "--quiet"]).args(packages))?;
    }
    let mut pytest = std::process::Command::new(&python);
    let pytest = pytest.current_dir(&crates).env("PYTHONPATH", home.join("site"));
    run_to_end(pytest.args(["-m", "pytest", "-q", "-n", "auto", "-p", "no:cacheprovider"]))
}

fn test() -> Outcome {
    run_command(&["fmt", "--all", "--check"])?;
    build_book()?;
    check_walks()?;
    run_command(&["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"])?;
    run_to_end(cargo().env("RUSTDOCFLAGS", "-D warnings").args(["doc", "--workspace", "--no-deps", "--quiet"]))?;
    // The library alone, without what can be left out
    run_command(&["check", "--package", "firstlight", "--no-default-features", "--quiet"])?;
    test_python()?;
    run_command(&["test", "--workspace", "--no-fail-fast"])
}

fn run_command(args: &[&str]) -> Outcome {
    run_to_end(cargo().args(args))
}

/// Runs another command, from where we are.
fn hand_on(args: &[OsString]) -> ExitCode {
    let mut command = cargo();
    command.args(["run", "--quiet", "--release", "--package", "firstlight-tools", "--"]).args(args).current_dir(".");
    match command.status() {
        Ok(status) if status.success() => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(fault) => {
            eprintln!("xtask: {fault}");
            ExitCode::FAILURE
        }
    }
}

fn main() -> ExitCode {
    let args: Vec<OsString> = std::env::args_os().skip(1).collect();
    let outcome = match args.as_slice() {
        [command] if command == "test" => test(),
        [command] if command == "dist" => dist(),
        [command] if command == "wheel" => wheel(),
        _ => return hand_on(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("xtask: {fault}");
            ExitCode::FAILURE
        }
    }
}
