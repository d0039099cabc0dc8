//! `cargo xtask test`: every check, then every test, so that the test runner has the last word. All other commands are
//! handed to `firstlight-tools`: they need the library, and cargo would build it for them in another way than for the
//! tests.

use std::ffi::OsString;
use std::process::ExitCode;

use xtask::{Outcome, cargo, root, run as run_to_end};

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

fn test() -> Outcome {
    run_command(&["fmt", "--all", "--check"])?;
    build_book()?;
    check_walks()?;
    run_command(&["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"])?;
    run_to_end(cargo().env("RUSTDOCFLAGS", "-D warnings").args(["doc", "--workspace", "--no-deps", "--quiet"]))?;
    // The library alone, without what can be left out
    run_command(&["check", "--package", "firstlight", "--no-default-features", "--quiet"])?;
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
    if args != ["test"] {
        return hand_on(&args);
    }
    match test() {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("xtask: {fault}");
            ExitCode::FAILURE
        }
    }
}
