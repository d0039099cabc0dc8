//! Every scene text that the book and the README show is one: no unknown key, no value out of its kind.

use std::fs;
use std::path::{Path, PathBuf};

use firstlight::{NoAssets, SceneDesc, Severity};

#[test]
fn every_scene_text_of_the_book_is_read_without_a_fault() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut files: Vec<PathBuf> = fs::read_dir(root.join("docs/src")).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "md"));
    files.push(root.join("README.md"));
    let (mut read, mut wrong) = (0, Vec::new());
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        let mut lines = text.lines().enumerate();
        while let Some((number, line)) = lines.next() {
            let Some(language @ ("toml" | "json")) = line.strip_prefix("```") else { continue };
            let code: Vec<&str> =
                lines.by_ref().map(|(_, line)| line).take_while(|line| !line.starts_with("```")).collect();
            let code = code.join("\n");
            // Not that of Cargo; a field alone is no scene; and what is not beside the page cannot be included
            let is_scene = language == "json" || code.lines().any(|line| line.starts_with('['));
            if !is_scene || code.starts_with("[dependencies]") || code.contains("include = [") {
                continue;
            }
            read += 1;
            let name = format!("{}:{}.{language}", file.file_name().unwrap().to_string_lossy(), number + 1);
            let parsed = SceneDesc::parse(&name, code.as_bytes(), &NoAssets);
            let faults = parsed.faults().iter().filter(|fault| fault.severity == Severity::Error);
            wrong.extend(faults.map(|fault| fault.to_string()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(read > 40, "only {read} were found");
}
