//! `cargo xtask dist` and `cargo xtask wheel`: what is handed to people who do not build it.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{Outcome, cargo, root, run};

/// The program may not be larger.
const MOST_BYTES: u64 = 25 << 20;
/// What goes beside the program.
const DOCUMENTS: [&str; 4] = ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT"];
const SHELLS: [(&str, &str); 4] = [
    ("bash", "firstlight.bash"),
    ("zsh", "_firstlight"),
    ("fish", "firstlight.fish"),
    ("powershell", "firstlight.ps1"),
];

/// The folder of cargo's builds.
pub fn target_folder() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), |folder| root().join(folder))
}

/// The kind of machine that we build for, as the compiler calls it.
fn host() -> Result<String, String> {
    let output = Command::new("rustc").arg("-vV").output().map_err(|e| format!("rustc -vV: {e}"))?;
    let said = String::from_utf8_lossy(&output.stdout);
    let host = said.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_owned).ok_or_else(|| "rustc -vV does not say its host".into())
}

/// What a command prints.
fn output_of(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|e| format!("{command:?}: {e}"))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(format!("{command:?}: {}\n{}", output.status, String::from_utf8_lossy(&output.stderr)))
    }
}

fn at(path: &Path) -> impl FnOnce(std::io::Error) -> String {
    move |fault| format!("{}: {fault}", path.display())
}

fn write(path: &Path, text: &str) -> Outcome {
    std::fs::write(path, text).map_err(at(path))
}

fn copy(from: &Path, to: &Path) -> Outcome {
    std::fs::copy(from, to).map(drop).map_err(at(from))
}

fn make_folder(path: &Path) -> Outcome {
    std::fs::create_dir_all(path).map_err(at(path))
}

/// Builds the program as it is handed out, with its manual and completions, as
/// `target/dist/firstlight-VERSION-MACHINE.tar.gz`. On Linux the C library is in it, so it runs on every one.
///
/// # Errors
/// It cannot be built, is too large, or does not run.
pub fn dist() -> Outcome {
    let host = host()?;
    let program = if host.contains("windows") { "firstlight.exe" } else { "firstlight" };
    let mut build = cargo();
    if host.contains("linux-gnu") {
        let flags = format!("CARGO_TARGET_{}_RUSTFLAGS", host.to_uppercase().replace('-', "_"));
        build.env(flags, "-C target-feature=+crt-static");
    }
    run(build.args(["build", "--profile", "dist", "--bin", "firstlight", "--target", &host]))?;
    let built = target_folder().join(&host).join("dist").join(program);
    let bytes = std::fs::metadata(&built).map_err(at(&built))?.len();
    if bytes > MOST_BYTES {
        return Err(format!("{}: {bytes} bytes, {MOST_BYTES} are allowed", built.display()));
    }
    let version = output_of(Command::new(&built).arg("--version"))?;
    let version = version.split_whitespace().nth(1).ok_or("firstlight --version says none")?;
    let name = format!("firstlight-{version}-{host}");
    let dist = target_folder().join("dist");
    let folder = dist.join(&name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).map_err(at(&folder))?;
    }
    make_folder(&folder.join("completions"))?;
    copy(&built, &folder.join(program))?;
    for document in DOCUMENTS {
        copy(&root().join(document), &folder.join(document))?;
    }
    write(&folder.join("firstlight.1"), &output_of(Command::new(&built).arg("man"))?)?;
    for (shell, file) in SHELLS {
        let script = output_of(Command::new(&built).args(["completions", shell]))?;
        write(&folder.join("completions").join(file), &script)?;
    }
    // The program as it is packed, at its first picture
    let picture = dist.join("config11.png");
    run(Command::new(folder.join(program)).args(["render", "--size", "64", "-q", "-o"]).arg(&picture))?;
    std::fs::remove_file(&picture).map_err(at(&picture))?;
    let archive = format!("{name}.tar.gz");
    run(Command::new("tar").current_dir(&dist).args(["-czf", &archive, &name]))?;
    eprintln!("\n{}: the program has {:.1} MiB", dist.join(archive).display(), bytes as f64 / 1_048_576.0);
    Ok(())
}

/// Builds the Python package, as a wheel for every Python from 3.10 on and as sources, in `target/wheels/`.
///
/// # Errors
/// There is no Python, its packages cannot be had, or it cannot be built.
pub fn wheel() -> Outcome {
    let home = target_folder().join("python");
    let (venv, wheels) = (home.join("maturin"), target_folder().join("wheels"));
    make_folder(&home)?;
    let bin = venv.join(if cfg!(windows) { "Scripts" } else { "bin" });
    let maturin = bin.join("maturin");
    if !Command::new(&maturin).arg("--version").output().is_ok_and(|output| output.status.success()) {
        run(Command::new("python3").args(["-m", "venv"]).arg(&venv))?;
        run(Command::new(bin.join("python")).args(["-m", "pip", "install", "--quiet", "maturin>=1.16,<2"]))?;
    }
    let mut build = Command::new(maturin);
    build.current_dir(root().join("crates/firstlight-python"));
    run(build.args(["build", "--release", "--sdist", "--out"]).arg(&wheels))
}
