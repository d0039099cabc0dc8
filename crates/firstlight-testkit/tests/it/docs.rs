//! The book and the other pages: every link and picture leads somewhere, every page is in the summary, and no page
//! needs mdBook to be read.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// The pages of the repository, without stored runs.
fn pages() -> Vec<PathBuf> {
    let root = root();
    let mut pages: Vec<_> =
        ["README.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "CHANGELOG.md"].map(|name| root.join(name)).into();
    pages.extend(std::fs::read_dir(root.join("docs/src")).unwrap().map(|entry| entry.unwrap().path()));
    pages.retain(|path| path.extension().is_some_and(|e| e == "md"));
    pages.sort();
    pages
}

/// A page's text.
fn read(page: &Path) -> String {
    std::fs::read_to_string(page).unwrap_or_else(|e| panic!("{}: {e}", page.display()))
}

/// The lines of a page that are not code, `code spans` taken out.
fn prose(text: &str) -> impl Iterator<Item = String> {
    let mut fence = false;
    text.lines().filter_map(move |line| {
        if line.trim_start().starts_with("```") {
            fence = !fence;
            return None;
        }
        let spans = line.split('`').enumerate();
        (!fence).then(|| spans.filter(|(i, _)| i % 2 == 0).map(|(_, part)| part).collect::<Vec<_>>().join(" "))
    })
}

/// Where the links and pictures of a page lead.
fn targets(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for line in prose(text) {
        for (start, end) in [("](", ')'), ("src=\"", '"'), ("href=\"", '"')] {
            found.extend(line.split(start).skip(1).filter_map(|rest| Some(rest.split_once(end)?.0.to_owned())));
        }
        // [name]: target
        let named = line.strip_prefix('[').and_then(|rest| rest.split_once("]: "));
        found.extend(named.map(|(_, target)| target.split(' ').next().unwrap_or_default().to_owned()));
    }
    found
}

/// What a heading is called in a link to it.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut fence = false;
    let mut seen: HashMap<String, u32> = HashMap::new();
    let mut anchors = BTreeSet::new();
    for line in text.lines() {
        fence ^= line.trim_start().starts_with("```");
        let Some(title) = line.strip_prefix('#').filter(|_| !fence) else { continue };
        let title = title.trim_start_matches('#').trim().to_lowercase();
        let kept = title.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        let anchor: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect();
        let count = seen.entry(anchor.clone()).or_default();
        anchors.insert(if *count == 0 { anchor } else { format!("{anchor}-{count}") });
        *count += 1;
    }
    anchors
}

#[test]
fn every_link_leads_somewhere() {
    let (mut wrong, mut count) = (Vec::new(), 0);
    for page in pages() {
        let text = read(&page);
        for target in targets(&text) {
            if ["http://", "https://", "mailto:"].iter().any(|scheme| target.starts_with(scheme)) {
                continue;
            }
            count += 1;
            let (path, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let to = if path.is_empty() { page.clone() } else { page.with_file_name(path) };
            if !to.exists() {
                wrong.push(format!("{}: no {target}", page.display()));
            } else if !anchor.is_empty() && !anchors(&read(&to)).contains(anchor) {
                wrong.push(format!("{}: no such heading, {target}", page.display()));
            }
        }
    }
    assert!(count >= 100, "only {count} links");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn no_page_has_a_directive_that_mdbook_alone_knows() {
    for page in pages() {
        let text = read(&page);
        let directive = prose(&text).find(|line| line.contains("{{#"));
        assert_eq!(
            directive,
            None,
            "{}: write the text itself, as `cargo xtask generate` does of runs",
            page.display()
        );
    }
}

#[test]
fn the_summary_lists_every_page_once() {
    let folder = root().join("docs/src");
    let mut listed = targets(&std::fs::read_to_string(folder.join("SUMMARY.md")).unwrap());
    listed.sort();
    let there: Vec<String> = pages()
        .iter()
        .filter(|page| page.parent() == Some(&folder))
        .map(|page| page.file_name().unwrap().to_string_lossy().into_owned())
        .filter(|name| name != "SUMMARY.md")
        .collect();
    assert_eq!(listed, there);
}

#[test]
fn links_and_headings_are_found() {
    let text = "# Two words\n## A `b`, c!\n```\n# code [x](no.md)\n```\nsee [a](b.md#c) and `[d](e)`, ![f](g.png)\n\
        # Two words\n";
    assert_eq!(targets(text), ["b.md#c", "g.png"]);
    assert_eq!(anchors(text), ["a-b-c", "two-words", "two-words-1"].map(String::from).into());
}
