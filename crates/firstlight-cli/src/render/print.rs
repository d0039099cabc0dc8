//! `--print-scene`: the scene as it would be rendered, as text.

use std::path::{Component, Path, PathBuf};

use super::plan::Plan;
use crate::args::ReadingArgs;
use crate::input;
use crate::interrupt::Watch;
use crate::output::Target;
use crate::report::{Failure, answer, say, show_diagnostics, shown};

/// Writes the scene with all that was said in place of it and found for it.
///
/// # Errors
/// The scene cannot be had or has faults; the text cannot be written.
pub(super) fn run(plan: &Plan, file: Option<&Path>, reading: &ReadingArgs) -> Result<(), Failure> {
    let [job] = &plan.jobs[..] else {
        return Err(Failure::Usage("--print-scene writes one scene, and several are given; name one".into()));
    };
    if plan.pictures.sizes.len() > 1 {
        return Err(Failure::Usage(
            "--print-scene writes a scene of one size, and --size names several; name one".into(),
        ));
    }
    let target = file.map_or(Target::Stdout, Target::of);
    if let Target::File(path) = &target {
        let name = shown(path);
        if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
            return Err(Failure::Usage(format!("--print-scene={name}: the file's name must end in .toml")));
        }
        // It may be a scene that somebody wrote
        if path.symlink_metadata().is_ok_and(|meta| !meta.is_dir()) {
            return Err(Failure::Work(format!(
                "--print-scene={name}: the file is there already; name another, or remove it"
            )));
        }
    }
    let mut input = input::read(&job.scene, reading)?;
    plan.join(job, &mut input)?;
    let compiled = input.compile(plan.time, plan.quiet)?;
    show_diagnostics(&compiled.warnings);
    let mut desc = input.without_models(plan.time)?;
    compiled.added.add_to(&mut desc);

    // Files are named as they are seen from the text
    if let Some(folder) = &input.folder {
        let from = match &target {
            Target::File(path) => path.parent().unwrap_or(Path::new("")),
            Target::Stdout => Path::new(""),
        };
        let way = way_to(from, folder).map_err(|why| Failure::Work(format!("--print-scene: {why}")))?;
        let mut files = 0;
        for file in desc.files_mut().filter(|file| Path::new(&file.0).is_relative()) {
            let path = way.join(&file.0);
            // With `/` between folders on every system
            let parts: Vec<_> = path.components().map(|part| part.as_os_str().to_string_lossy()).collect();
            file.0 = parts.join("/");
            files += 1;
        }
        if files > 0 && way.starts_with(Component::ParentDir) && !plan.quiet {
            let folder = shown(folder);
            say(format_args!(
                "note: the text names files outside of its own folder; render it with --allow-dir {folder}"
            ));
        }
    }
    let name: String = input.name.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    let text = format!("# {name}, written down by firstlight render --print-scene\n\n{}", desc.to_toml());
    match target {
        Target::Stdout => answer(&text),
        target => {
            let watch = Watch::begin();
            target.ready()?.stage(text.as_bytes())?.commit(plan.quiet, &|| watch.check().is_err())
        }
    }
}

/// The way from one folder to another, without a beginning; empty for the same.
fn way_to(from: &Path, to: &Path) -> Result<PathBuf, String> {
    let real = |folder: &Path| {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        folder.canonicalize().map_err(|e| format!("{}: {e}", shown(folder)))
    };
    let (from, to) = (real(from)?, real(to)?);
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    Ok(up.chain(to.components().skip(shared)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_leads_from_one_folder_to_the_other() {
        let root = tempfile::tempdir().unwrap();
        let root = root.path();
        for folder in ["a/b", "a/c"] {
            std::fs::create_dir_all(root.join(folder)).unwrap();
        }
        let way = |from: &str, to: &str| way_to(&root.join(from), &root.join(to)).unwrap();
        assert_eq!(way("a", "a"), Path::new(""));
        assert_eq!(way("a", "a/b"), Path::new("b"));
        assert_eq!(way("a/b", "a"), Path::new(".."));
        assert_eq!(way("a/b/../b", "a/c"), Path::new("../c"));
        assert!(way_to(root, &root.join("none")).is_err());
    }
}
