//! Model files that are damaged at random: as files are that come from strangers, from broken exporters, and from those
//! who mean harm.
//!
//! A mutation knows the structure of what it damages three times of four: values of JSON, accessors, chunks of GLB,
//! statements of MTL, numbers of buffers. The fourth time it is blind: bytes are changed, cut off and repeated. Nothing
//! here needs the library, so that tests of the program can damage files too.
//!
//! - `models`: whole models, of all formats, made here;
//! - `json`: values of glTF;
//! - `text`: lines and words of OBJ, MTL and of texts in general;
//! - `bytes`: buffers, chunks, and whatever is no text.

mod bytes;
mod json;
mod models;
mod text;

use std::collections::BTreeMap;

pub use models::models;

use crate::Random;

/// A model, and the files that it is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelFiles {
    /// The name of the file that is shown.
    pub model: String,
    /// All files by their names, that one included.
    pub files: BTreeMap<String, Vec<u8>>,
}

/// Names of files that a model has no business with, or that are none.
const REFERENCES: &[&str] = &[
    "",
    ".",
    "..",
    "/",
    "missing.bin",
    "../missing.bin",
    "../../../../../../etc/passwd",
    "/etc/passwd",
    "/dev/zero",
    "/proc/self/mem",
    "folder",
    "folder/",
    "./folder/../folder",
    "C:\\Windows\\win.ini",
    "\\\\host\\share\\a.bin",
    "file:///etc/passwd",
    "https://example.com/a.bin",
    "data:",
    "data:;base64,",
    "data:application/octet-stream;base64,@@@@",
    "data:application/octet-stream;base64,AAAAAAAAgD8AAIA/AACAf///f38AAMB/",
    "data:image/png;base64,iVBORw0KGgo=",
    "%00",
    "%2e%2e%2f%2e%2e%2fa.bin",
    "a\u{0}b",
    "a.gltf#image/0",
    "rich.gltf#mesh/0",
    "\u{1b}[31m.bin",
    "\u{202e}nib.a",
];

impl ModelFiles {
    pub fn new(model: &str, files: impl IntoIterator<Item = (String, Vec<u8>)>) -> Self {
        ModelFiles { model: model.to_owned(), files: files.into_iter().collect() }
    }

    /// The same with a damage or a few.
    #[must_use]
    pub fn damaged(&self, random: &mut Random) -> Self {
        let mut files = self.clone();
        loop {
            files.damage(random);
            if random.chance(0.6) {
                return files;
            }
        }
    }

    fn damage(&mut self, random: &mut Random) {
        let names: Vec<String> = self.files.keys().cloned().collect();
        let other = &names[random.below(names.len() as u32) as usize];
        // Whole files: gone, empty, or in place of another
        if random.chance(0.05) {
            match random.below(3) {
                0 if *other != self.model => drop(self.files.remove(other)),
                1 => drop(self.files.insert(other.clone(), Vec::new())),
                _ => {
                    let instead = self.files[&names[random.below(names.len() as u32) as usize]].clone();
                    self.files.insert(other.clone(), instead);
                }
            }
            return;
        }
        let name = if random.chance(0.6) && self.files.contains_key(&self.model) { &self.model } else { other };
        let Some(content) = self.files.get_mut(name) else { return };
        let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
        match ending {
            _ if random.chance(0.25) => bytes::damage(content, random),
            "gltf" => json::damage_text(content, random, &names),
            "glb" => json::damage_container(content, random, &names),
            "bin" => bytes::damage_numbers(content, random),
            "obj" | "mtl" => text::damage(content, random, &names),
            // Their first lines are text
            "ply" | "stl" if random.chance(0.5) => text::damage(content, random, &names),
            "ply" | "stl" => bytes::damage_numbers(content, random),
            _ => bytes::damage(content, random),
        }
    }
}

/// A name of a file: one of the model's own, or one that should not be there.
fn reference(random: &mut Random, own: &[String]) -> String {
    if random.chance(0.3) && !own.is_empty() {
        own[random.below(own.len() as u32) as usize].clone()
    } else {
        random.pick(REFERENCES).to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_does_the_same_damage_and_another_one_another() {
        for model in models() {
            let damaged = |seed| model.damaged(&mut Random::new(seed));
            assert_eq!(damaged(1), damaged(1), "{}", model.model);
            let different = (0..20).filter(|seed| damaged(*seed) != model).count();
            assert!(different >= 15, "{}: {different} of 20", model.model);
        }
    }
}
