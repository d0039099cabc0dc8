//! Finds the commit that the program is built from, for `firstlight --version`. Without git, or outside of a clone,
//! there is none, and the version stands alone.

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let commit = commit().map(|commit| format!(" ({commit})")).unwrap_or_default();
    println!("cargo::rustc-env=FIRSTLIGHT_COMMIT={commit}");
}

/// The first ten digits of the commit, if these files are those of a clone.
fn commit() -> Option<String> {
    // A copy without its history may lie in the clone of something else: that one does not know this file
    git(&["ls-files", "--error-unmatch", "build.rs"])?;
    // Asked again when another commit is checked out or made. A file that is not there would have this run every time
    let head = git(&["symbolic-ref", "--quiet", "HEAD"]);
    for name in ["HEAD", "logs/HEAD", "packed-refs"].into_iter().chain(head.as_deref()) {
        if let Some(path) = git(&["rev-parse", "--git-path", name])
            && Path::new(&path).is_file()
        {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    git(&["rev-parse", "--short=10", "HEAD"])
}

/// What git answers, on one line; nothing where there is no git, or it is not content.
fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok().filter(|output| output.status.success())?;
    String::from_utf8(output.stdout).ok().map(|answer| answer.trim_end().to_owned()).filter(|answer| !answer.is_empty())
}
