//! The configuration files of the rendering course: lines of `key value` that mean one of the nine built-in scenes,
//! changed by what they say.
//!
//! ```text
//! output_resolution 1024
//! output_file out.png
//! camera_id 1
//! light_id 1
//! num_samples 4
//! area_light_resolution 20
//! num_threads 8
//! ```
//!
//! `num_samples` is n of the n x n camera rays in each pixel, `area_light_resolution` m of the m x m points of the
//! light, laid out as a grid. The picture is square. What is left out is as in the built-in scene of camera 1 and light
//! 1; without `output_file` and `num_threads` the program chooses.

use std::ops::RangeInclusive;

use super::MAX_SIDE;
use super::builtin::builtin_scenes;
use super::description::SceneDesc;
use super::text::sources::{SourceFile, Sources};
use super::text::{Parsed, decode, too_long};
use crate::context::NoAssets;
use crate::describe::node::{Data, Entry, Node, Span, quoted, shortened};
use crate::describe::read::{Fault, Faults};
use crate::describe::synonyms::did_you_mean;
use crate::light::{LightDesc, SampleSet};

const KEYS: &[&str] = &[
    "output_resolution",
    "output_file",
    "camera_id",
    "light_id",
    "num_samples",
    "area_light_resolution",
    "num_threads",
];

/// Whether the text called `name` is a course's file: by its name, or else by its first line that is not blank.
pub(super) fn is_course(name: &str, text: &[u8]) -> bool {
    let name = name.to_lowercase();
    if name.ends_with(".txt") || name.ends_with(".toml") || name.ends_with(".json") {
        return name.ends_with(".txt");
    }
    let Some(line) = text.split(|b| *b == b'\n').find(|line| !line.trim_ascii().is_empty()) else { return false };
    let line = String::from_utf8_lossy(&line[..line.len().min(256)]);
    let mut words = line.split_whitespace();
    words.next().is_some_and(|key| KEYS.contains(&key)) && words.next().is_none_or(|value| !value.starts_with('='))
}

/// A value of the file and where it stands.
struct Said<'t> {
    key: &'static str,
    value: &'t str,
    span: Span,
}

/// Reads a course's file. Faults are kept inside, as for other texts.
pub(super) fn parse(name: &str, bytes: &[u8]) -> Parsed {
    let (text, not_utf8) = decode(bytes);
    let mut faults = Faults::default();
    let mut fault = |span, path: &str, message: String, hint: Option<String>, other| {
        faults.push(Fault { file: 0, span, path: path.to_owned(), message, hint, other });
    };
    let mut said: Vec<Said<'_>> = Vec::new();
    if let Some(message) = too_long(bytes) {
        fault(Span::default(), "", message, None, None);
    } else if let Some((span, message)) = not_utf8 {
        fault(span, "", message, Some("save the text as UTF-8".into()), None);
    } else {
        // Split the lines into keys and values
        for line in text.split_inclusive('\n') {
            let words: Vec<(&str, Span)> = words(&text, line).take(3).collect();
            let Some(&(word, span)) = words.first() else { continue };
            let Some(key) = KEYS.iter().find(|k| **k == word) else {
                let near = did_you_mean(word, KEYS);
                let hint = format!("{near}a course file takes {}", KEYS.join(", "));
                fault(span, &shortened(word), "unknown key".into(), Some(hint), None);
                continue;
            };
            if let Some(first) = said.iter().find(|s| s.key == *key) {
                let other = Some((0, first.span));
                fault(span, key, "the key is there twice".into(), Some("keep one of them".into()), other);
                continue;
            }
            let Some(&(value, value_span)) = words.get(1) else {
                fault(span, key, "the value is missing".into(), Some(format!("write `{key} VALUE`")), None);
                // Said all the same, so that a second one is noticed
                said.push(Said { key, value: "", span });
                continue;
            };
            said.push(Said { key, value, span: value_span });
            if let Some(&(second, second_span)) = words.get(2) {
                let message = format!("{} is a second value", quoted(second));
                fault(second_span, key, message, Some("a line is one key and one value".into()), None);
            }
        }
    }
    let find = |key: &str| said.iter().find(|s| s.key == key && !s.value.is_empty());
    let mut number = |key: &'static str, range: RangeInclusive<u32>| -> Option<u32> {
        let said = find(key)?;
        let value = said.value.parse::<u32>().ok().filter(|v| range.contains(v));
        if value.is_none() {
            let digits = said.value.strip_prefix('-').unwrap_or(said.value).bytes().all(|b| b.is_ascii_digit());
            let fault_is = if digits { "outside" } else { "not a whole number from" };
            let message = format!("{} is {fault_is} {} to {}", shortened(said.value), range.start(), range.end());
            let hint = (key == "output_resolution").then(|| "one number: the picture is square".to_owned());
            fault(said.span, key, message, hint, None);
        }
        value
    };
    // Take the built-in scene and change what is said
    let resolution = number("output_resolution", 1..=MAX_SIDE);
    let camera = number("camera_id", 1..=3).unwrap_or(1);
    let light = number("light_id", 1..=3).unwrap_or(1);
    let antialiasing = number("num_samples", 1..=64);
    let light_resolution = number("area_light_resolution", 1..=1024);
    let threads = number("num_threads", 1..=u32::MAX);
    let mut desc = builtin(&format!("config{camera}{light}"));
    if let Some(resolution) = resolution {
        (desc.render.width, desc.render.height) = (resolution, resolution);
    }
    if let Some(antialiasing) = antialiasing {
        desc.render.antialiasing = antialiasing;
    }
    if let Some(m) = light_resolution {
        for light in &mut desc.lights {
            if let LightDesc::Rectangle(light) = light {
                (light.samples, light.set) = (Some((m * m).into()), SampleSet::Grid);
            }
        }
    }
    let output = find("output_file").map(|said| said.value.to_owned());
    let root = tree(&said);
    let bases = Vec::new();
    let sources =
        Sources { files: vec![SourceFile { name: name.to_owned(), text, root, bases, rank: 0 }], ..Sources::default() };
    let mut parsed = Parsed::new(desc, sources, faults, false);
    (parsed.output, parsed.threads) = (output, threads);
    parsed
}

/// The words of a line and where they stand in the text.
fn words<'t>(text: &'t str, line: &'t str) -> impl Iterator<Item = (&'t str, Span)> {
    line.split_whitespace().map(|word| {
        let start = word.as_ptr() as usize - text.as_ptr() as usize;
        (word, Span { start, end: start + word.len() })
    })
}

fn builtin(name: &str) -> SceneDesc {
    let builtin = builtin_scenes().iter().find(|b| b.name == name).expect("there is one for each camera and light");
    SceneDesc::parse(&format!("{name}.toml"), builtin.text.as_bytes(), &NoAssets).desc
}

/// Where the values stand that the file decides, as the tree of a scene that says them.
fn tree(said: &[Said<'_>]) -> Node {
    let leaf = |field: &str, key: &str| {
        let said = said.iter().find(|s| s.key == key)?;
        let value = Node { span: said.span, data: Data::String(said.value.to_owned()) };
        Some(Entry { key: field.into(), key_span: said.span, value })
    };
    let node = |entries: Vec<Entry>| {
        let span = entries.first().map_or(Span::default(), |e| e.key_span);
        Node { span, data: Data::Table(entries) }
    };
    let table = |key: &str, value: Node| Entry { key: key.into(), key_span: value.span, value };
    let render = node(
        [("width", "output_resolution"), ("height", "output_resolution"), ("antialiasing", "num_samples")]
            .iter()
            .filter_map(|(field, key)| leaf(field, key))
            .collect(),
    );
    let area = "area_light_resolution";
    let light = node(["samples", "set"].iter().filter_map(|field| leaf(field, area)).collect());
    let rectangle = Node { span: light.span, data: Data::Array(vec![light]) };
    let light = node(vec![table("rectangle", rectangle)]);
    node(vec![table("render", render), table("light", light)])
}
