//! Where everything of a description stands in its texts.
//!
//! Compiling knows a value by its path alone, `light.spot[2].cone_deg`. The trees of all texts are kept, and a path is
//! walked down only when there is a fault to place: a map of every path would be larger than the scene.

use std::borrow::Cow;
use std::collections::BTreeSet;

use crate::describe::node::{Node, Span};
use crate::describe::read::{Fault, MAX_FAULTS};
use crate::describe::write::key;
use crate::error::{Diagnostic, Place, Severity};

/// Characters of a line that are shown; longer lines are shortened around the fault.
const EXCERPT: usize = 160;

/// One text of a scene.
#[derive(Debug)]
pub(crate) struct SourceFile {
    /// As the user named it, or relative to the scene's folder.
    pub name: String,
    pub text: String,
    pub root: Node,
    /// Where each array of tables begins in the merged scene: `light.spot` and the number of spots in texts before.
    pub bases: Vec<(String, usize)>,
    /// Its position in the scene: included texts come before the text that includes them.
    pub rank: usize,
}

/// The texts of a scene, and which of their values are stand-ins.
#[derive(Debug, Default)]
pub(crate) struct Sources {
    /// The first is the scene's own text.
    pub files: Vec<SourceFile>,
    /// Paths of values that could not be read.
    pub poisoned: BTreeSet<String>,
}

/// The position of a fault in the order of the text: the rank of the file, and the byte.
pub(crate) type Position = (usize, usize);

/// Fields that are checked together: when one is a stand-in, what compiling says of the others is noise.
const RELATED: &[&[&str]] = &[
    &["position", "look_at", "up"],
    &["projection", "height", "fov_y_deg", "focal_length_mm", "sensor_height_mm"],
    &["width", "height"],
    &["display", "gamma"],
    &["e0", "e1", "size"],
    &["center", "look_at", "normal", "up"],
    &["radius", "size"],
    &["cone_deg", "inner_cone_deg"],
    &["samples", "set"],
    &["rotate_axis", "angle_deg"],
    &["keys", "interpolation"],
];

/// Fields of the elements of an array that are compared with each other.
const COMPARED: &[&str] = &["time"];

impl Sources {
    /// Gives the faults of compiling, which know only their paths, their places and the order of the text. Faults of
    /// stand-ins are left out: the fault that made the stand-in has been told.
    pub(crate) fn attach(&self, faults: Vec<Diagnostic>) -> Vec<Diagnostic> {
        let mut placed = self.locate(faults);
        placed.sort_by_key(|(position, _)| *position);
        placed.into_iter().map(|(_, fault)| fault).collect()
    }

    /// As `attach`, with positions and unsorted.
    pub(super) fn locate(&self, mut faults: Vec<Diagnostic>) -> Vec<(Position, Diagnostic)> {
        // Errors first, so that warnings never push one out
        faults.sort_by_key(|fault| fault.severity != Severity::Error);
        let mut placed = Vec::new();
        for mut fault in faults {
            if placed.len() == MAX_FAULTS {
                break;
            }
            let (path, file, span) = self.find(&fault.path);
            if self.is_noise(&path) {
                continue;
            }
            fault.path = path;
            if fault.place.is_none() {
                fault.place = self.place(file, span);
            }
            let rank = self.files.get(file).map_or(0, |f| f.rank);
            placed.push(((rank, span.start), fault));
        }
        placed
    }

    /// A fault of the text as a diagnostic.
    pub(super) fn diagnostic(&self, fault: Fault) -> (Position, Diagnostic) {
        let Fault { file, span, path, message, hint, other } = fault;
        let hint = match other.and_then(|(file, span)| self.place(file, span)) {
            Some(other) => {
                let other = format!("the other is at {}:{}:{}", other.file, other.line, other.column);
                Some(hint.map_or(other.clone(), |hint| format!("{hint}; {other}")))
            }
            None => hint,
        };
        let position = (self.files.get(file).map_or(0, |f| f.rank), span.start);
        (position, Diagnostic { severity: Severity::Error, place: self.place(file, span), path, message, hint })
    }

    /// Whether the value at `path` is, is part of, or is checked together with a stand-in.
    fn is_noise(&self, path: &str) -> bool {
        if self.poisoned.is_empty() {
            return false;
        }
        // The path itself and everything it is part of
        let ends = path.char_indices().filter(|(_, c)| matches!(c, '.' | '[')).map(|(i, _)| i);
        if ends.chain([path.len()]).any(|end| self.poisoned.contains(&path[..end])) {
            return true;
        }
        // A part of it is a stand-in: `sphere[0].center[1]` of `sphere[0].center`
        let part = |p: &String| p.starts_with(path) && p[path.len()..].starts_with(['[', '.']);
        if self.poisoned.range(path.to_owned()..).take_while(|p| p.starts_with(path)).any(part) {
            return true;
        }
        let (table, field) = path.rsplit_once('.').unwrap_or(("", path));
        if COMPARED.contains(&field)
            && let Some((array, _)) = table.rsplit_once('[')
        {
            // `keys[1].time`, when `keys[0].time` is a stand-in
            let first = format!("{array}[");
            let mut elements = self.poisoned.range(first.clone()..).take_while(|p| p.starts_with(&first));
            let of_element = |p: &String| p[first.len()..].split_once("].").is_some_and(|(_, rest)| rest == field);
            if elements.any(of_element) {
                return true;
            }
        }
        RELATED.iter().filter(|group| group.contains(&field)).any(|group| {
            group.iter().any(|sibling| {
                let sibling = format!("{table}.{sibling}");
                let mut below = self.poisoned.range(sibling.clone()..).take_while(|p| p.starts_with(&sibling));
                below.any(|p| p.len() == sibling.len() || p[sibling.len()..].starts_with('['))
            })
        })
    }

    /// The place of a path: the path with odd names in quotes, the file, and the range. A field that is not written
    /// stands at its table's header; what is not written at all, at the beginning of the scene's own text.
    fn find(&self, path: &str) -> (String, usize, Span) {
        let mut best = (0, path.to_owned(), 0, Span::default());
        let mut order: Vec<usize> = (0..self.files.len()).collect();
        order.sort_by_key(|i| self.files[*i].rank);
        for i in order {
            let (left, canonical, span) = walk(&self.files[i], path);
            let walked = path.len() - left.len();
            if walked > best.0 {
                best = (walked, canonical + left, i, span);
            }
        }
        (best.1, best.2, best.3)
    }

    /// Line, column and excerpt.
    pub(super) fn place(&self, file: usize, span: Span) -> Option<Place> {
        let source = self.files.get(file)?;
        let text = source.text.as_str();
        // The parsers count bytes; keep to whole characters whatever they say
        let floor = |mut i: usize| {
            i = i.min(text.len());
            while !text.is_char_boundary(i) {
                i -= 1;
            }
            i
        };
        let start = floor(span.start);
        let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |i| start + i);
        let whole = text[line_start..line_end].strip_suffix('\r').unwrap_or(&text[line_start..line_end]);
        let before = text[line_start..start].chars().count();
        let end = floor(span.end.max(start)).min(line_end);
        let (mut excerpt, mut offset) = (whole.to_owned(), before);
        if whole.chars().nth(EXCERPT).is_some() {
            let skipped = before.saturating_sub(EXCERPT / 3);
            excerpt = whole.chars().skip(skipped).take(EXCERPT).collect();
            offset = before - skipped;
        }
        // What is no text is not quoted
        if 2 * excerpt.chars().filter(|c| *c == char::REPLACEMENT_CHARACTER).count() > excerpt.chars().count() {
            (excerpt, offset) = (String::new(), 0);
        }
        let longest = excerpt.chars().count().saturating_sub(offset).max(1);
        let width = text[start..end].chars().take(longest).count().max(1);
        let number = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Some(Place {
            file: source.name.clone(),
            line: number(text.as_bytes()[..line_start].iter().filter(|b| **b == b'\n').count() + 1),
            column: number(before + 1),
            excerpt,
            offset: number(offset),
            width: number(width),
        })
    }
}

/// Follows `path` into a file's tree as far as it goes: what is left of the path, the path walked, and its place.
fn walk<'p>(file: &SourceFile, path: &'p str) -> (&'p str, String, Span) {
    let mut node = Cow::Borrowed(&file.root);
    let mut left = path;
    let mut walked = String::new();
    while !left.is_empty() {
        if let Some((index, rest)) = left.strip_prefix('[').and_then(|l| l.split_once(']')) {
            let base = file.bases.iter().find(|(array, _)| *array == walked).map_or(0, |(_, base)| *base);
            let element = index.parse::<usize>().ok().and_then(|i| i.checked_sub(base));
            let next = element.and_then(|i| match &node {
                Cow::Borrowed(node) => node.element(&file.text, i),
                Cow::Owned(node) => node.element(&file.text, i).map(|element| Cow::Owned(element.into_owned())),
            });
            let Some(next) = next else { break };
            walked.push_str(&format!("[{index}]"));
            (node, left) = (next, rest);
        } else {
            // Names may hold dots and brackets: the longest key that fits is the one
            let rest = left.strip_prefix('.').unwrap_or(left);
            let fits = |name: &str| {
                let after = rest.strip_prefix(name)?;
                (after.is_empty() || after.starts_with(['.', '['])).then_some(after)
            };
            // What is not in the tree itself is numbers
            let entries = if let Cow::Borrowed(node) = &node { node.entries().unwrap_or_default() } else { &[] };
            let found = entries.iter().filter_map(|e| Some((e, fits(&e.key).or_else(|| fits(&key(&e.key)))?)));
            let Some((entry, after)) = found.min_by_key(|(_, after)| after.len()) else { break };
            if !walked.is_empty() {
                walked.push('.');
            }
            walked.push_str(&key(&entry.key));
            (node, left) = (Cow::Borrowed(&entry.value), after);
        }
    }
    (left, walked, node.span)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::{MemoryAssets, NoAssets};
    use crate::scene::SceneDesc;

    fn compiled(path: &str) -> Diagnostic {
        let (message, path) = ("wrong".to_owned(), path.to_owned());
        Diagnostic { severity: Severity::Error, place: None, path, message, hint: None }
    }

    fn attached(name: &str, text: &str, assets: &MemoryAssets, paths: &[&str]) -> Vec<String> {
        let parsed = SceneDesc::parse(name, text.as_bytes(), assets);
        let faults = parsed.sources.attach(paths.iter().map(|path| compiled(path)).collect());
        faults.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn faults_of_compiling_find_their_places() {
        let text = "include = [\"a.json\"]\n[camera.side]\nposition = [0, 0, 1]\n[[sphere]]\ncenter = [0, 0, 0]\n\
            radius = 0\n\
                    [[light.spot]]\nposition = [0, 0, 0]\n[material.phong.\"a.b[0]\"]\ndiffuse = -1\n";
        let mut assets = MemoryAssets::default();
        let json = "{\n \"sphere\": [{ \"center\": [0, 0, 0],\n \"radius\": -1 }],\n \"material\": { \"phong\": { \
            \"a\": {} } } }";
        assets.files.insert("a.json".into(), json.into());
        let paths = [
            "sphere[1].radius",
            "sphere[1].uv",
            "sphere[0].center[2]",
            "sphere[0].radius",
            "light.spot[0].cone_deg",
            "camera.side.position",
            "render.width",
            "material.phong.a.b[0].diffuse",
            "material.phong.a.specular",
        ];
        assert_eq!(
            attached("s.toml", text, &assets, &paths),
            [
                "a.json:2:32: sphere[0].center[2]: wrong",
                "a.json:3:12: sphere[0].radius: wrong",
                "a.json:4:27: material.phong.a.specular: wrong",
                "s.toml:1:1: render.width: wrong",
                "s.toml:3:12: camera.side.position: wrong",
                "s.toml:4:1: sphere[1].uv: wrong",
                "s.toml:6:10: sphere[1].radius: wrong",
                "s.toml:7:1: light.spot[0].cone_deg: wrong",
                "s.toml:10:11: material.phong.\"a.b[0]\".diffuse: wrong",
            ]
        );
    }

    #[test]
    fn faults_of_stand_ins_are_not_told() {
        let text = "[camera]\nposition = 3\nfov_y_deg = 400\n[[sphere]]\ncenter = [0, \"1\", 2]\nradius = 0\n\
                    [[light.spot]]\ncone_deg = true\nstrength = -1\n";
        let paths = [
            "camera.position",
            "camera.look_at",
            "camera.fov_y_deg",
            "sphere[0].center",
            "sphere[0].center[1]",
            "sphere[0].radius",
            "light.spot[0].position",
            "light.spot[0].look_at",
            "light.spot[0].inner_cone_deg",
            "light.spot[0].strength",
        ];
        let told = attached("s.toml", text, &MemoryAssets::default(), &paths);
        assert_eq!(
            told,
            [
                "s.toml:3:13: camera.fov_y_deg: wrong",
                "s.toml:6:10: sphere[0].radius: wrong",
                "s.toml:9:12: light.spot[0].strength: wrong",
            ]
        );
    }

    #[test]
    fn a_course_file_has_places_too() {
        let text = "output_resolution 64\narea_light_resolution 3\n";
        let told = attached("c.txt", text, &MemoryAssets::default(), &["light.rectangle[0].samples", "render.height"]);
        assert_eq!(told, ["c.txt:1:19: render.height: wrong", "c.txt:2:23: light.rectangle[0].samples: wrong"]);
    }

    #[test]
    fn what_is_no_text_is_not_quoted() {
        for (text, excerpt) in [(&b"a = \"caf\xe9\""[..], "a = \"caf\u{fffd}\""), (b"\x80\x81\x82\x83= 1", "")] {
            let parsed = SceneDesc::parse("s.toml", text, &NoAssets);
            let [fault] = parsed.faults() else { panic!("{:?}", parsed.faults()) };
            assert!(fault.message.contains("is not UTF-8"), "{fault}");
            assert_eq!(fault.place.as_ref().map(|place| place.excerpt.as_str()), Some(excerpt));
        }
    }

    #[test]
    fn no_path_breaks_the_walk() {
        let parsed = SceneDesc::parse("s.toml", b"[[sphere]]\n\n[material.phong.\"\"]", &NoAssets);
        for path in [
            "",
            ".",
            "[",
            "]",
            "[0]",
            "sphere[",
            "sphere[99999999999999999999]",
            "sphere[-1]",
            "sphere[0]x",
            "material.phong.",
        ] {
            assert_eq!(parsed.sources.attach(vec![compiled(path)]).len(), 1, "{path}");
        }
    }
}
