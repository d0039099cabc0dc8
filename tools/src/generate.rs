//! `cargo xtask generate`: the files that are made from the code, and the page that shows stored runs.

use std::fmt::Write;

use crate::{Outcome, root, write};

/// The page of the book that shows stored runs.
const RUNS: &str = "docs/src/benchmarks.md";

pub fn run(check: bool) -> Outcome {
    let page = std::fs::read_to_string(root().join(RUNS)).map_err(|e| format!("{RUNS}: {e}"))?;
    let files = [
        ("docs/src/reference.md", firstlight::reference()),
        ("docs/scene.schema.json", firstlight::schema()),
        (RUNS, with_runs(&page, &stored)?),
    ];
    for (name, text) in files {
        let path = root().join(name);
        if std::fs::read_to_string(&path).is_ok_and(|there| there == text) {
            continue;
        }
        if check {
            return Err(format!("{name} is not what it is made from; run `cargo xtask generate`"));
        }
        write(&path, text.as_bytes())?;
        eprintln!("wrote {name}");
    }
    Ok(())
}

/// Around each run that a page shows: these lines, and within them the text of the run's own page. mdBook could include
/// it, but who reads the book on a code hosting site would see the directive.
const BEGIN: [&str; 2] = ["<!-- run ", " -->\n"];
const END: &str = "<!-- end of run -->";

/// A page with the runs that it shows as they are stored.
fn with_runs(page: &str, stored: &dyn Fn(&str) -> Result<String, String>) -> Result<String, String> {
    let mut parts = page.split(BEGIN[0]);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (name, rest) = part.split_once(BEGIN[1]).ok_or_else(|| format!("{RUNS}: a run without a name"))?;
        let (_, after) = rest.split_once(END).ok_or_else(|| format!("{RUNS}: {name} has no end"))?;
        let run = stored(name)?;
        // A String takes every write
        let _ = write!(text, "{}{name}{}\n{}\n\n{END}{after}", BEGIN[0], BEGIN[1], run.trim_matches('\n'));
    }
    Ok(text)
}

/// The page of a stored run.
fn stored(name: &str) -> Result<String, String> {
    let path = format!("docs/benchmarks/{name}/README.md");
    std::fs::read_to_string(root().join(&path)).map_err(|e| format!("{path}: {e}"))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_files_are_what_the_code_says() {
        assert_eq!(super::run(true), Ok(()));
    }

    #[test]
    fn a_page_shows_runs_as_they_are_stored() {
        let stored = |name: &str| if name == "a" { Ok("\n## New\n\n| 2 |\n".to_owned()) } else { Err(name.to_owned()) };
        let shown = "# Page\n\n<!-- run a -->\n\n## New\n\n| 2 |\n\n<!-- end of run -->\n\nMore.\n";
        for old in ["", "\n## Old\n\n"] {
            let page = format!("# Page\n\n<!-- run a -->\n{old}<!-- end of run -->\n\nMore.\n");
            assert_eq!(super::with_runs(&page, &stored), Ok(shown.to_owned()));
        }
        assert_eq!(super::with_runs(shown, &stored), Ok(shown.to_owned()));
        assert_eq!(super::with_runs("<!-- run b -->\n<!-- end of run -->", &stored), Err("b".to_owned()));
        assert!(super::with_runs("<!-- run a -->\n", &stored).is_err());
    }
}
