//! From a text and those it includes to one description.

use std::collections::HashMap;
use std::sync::Arc;

use super::sources::{SourceFile, Sources};
use super::tables::{Arrays, cameras, kinds, named, read_groups};
use super::{MAX_BYTES, Parsed, decode, too_long};
use crate::context::{AssetError, Assets};
use crate::describe::Family;
use crate::describe::node::{self, Data, Node, ReadText, Span, Syntax, SyntaxFault, quoted};
use crate::describe::read::{Fault, Faults, Reader};
use crate::describe::synonyms::did_you_mean;
use crate::describe::value::{join_path, normalized};
use crate::import::{WantedFile, foreign};
use crate::light::LightDesc;
use crate::material::MaterialDesc;
use crate::scene::description::{RenderDesc, SceneDesc};
use crate::shape::ShapeDesc;
use crate::texture::TextureDesc;

/// Deepest chain of includes.
const MAX_INCLUDE_DEPTH: usize = 32;
/// Most texts of a scene.
const MAX_FILES: usize = 1024;

/// Lines with faults of the syntax, the first line among them, from which on a text is taken for another language.
const MAX_SYNTAX_FAULTS: usize = 20;

/// Whether nothing but blanks and comments stands on the lines above.
fn is_first_line(text: &str, span: Span) -> bool {
    let above = text.get(..span.start).and_then(|before| before.rsplit_once('\n')).map_or("", |(above, _)| above);
    above.lines().all(|line| line.trim().is_empty() || line.trim_start().starts_with('#'))
}

/// The keys of a scene's top level.
const BEFORE_SHAPES: &[&str] = &["include", "render", "camera", "texture", "material"];
const AFTER_SHAPES: &[&str] = &["group", "light"];

/// Whether the scene format has an array of tables at `path`.
fn is_array(path: &[Arc<str>]) -> bool {
    match path {
        [shape] => ShapeDesc::KINDS.contains(&&**shape),
        [light, kind] => &**light == LightDesc::WORD && LightDesc::KINDS.contains(&&**kind),
        [group, _, shape] => &**group == "group" && ShapeDesc::KINDS.contains(&&**shape),
        _ => false,
    }
}

fn top() -> Vec<&'static str> {
    [BEFORE_SHAPES, ShapeDesc::KINDS, AFTER_SHAPES].concat()
}

/// Reads a scene's own text, which faults call `name`, and all that it includes.
pub(super) fn load(name: &str, text: &[u8], assets: &dyn Assets) -> Parsed {
    let mut loader = Loader {
        assets,
        sources: Sources::default(),
        faults: Faults::default(),
        desc: SceneDesc::default(),
        render: None,
        names: HashMap::new(),
        counts: HashMap::new(),
        chain: Vec::new(),
        included: HashMap::new(),
        bytes: 0,
        finished: 0,
        incomplete: false,
    };
    // The scene's own text is called by its path relative to its folder when others include it
    let own = name.rsplit(['/', '\\']).next().unwrap_or(name).to_owned();
    loader.load(name, own, text);
    loader.desc.sort();
    Parsed::new(loader.desc, loader.sources, loader.faults, loader.incomplete)
}

/// Reads a text and those it includes into one description.
struct Loader<'a> {
    assets: &'a dyn Assets,
    sources: Sources,
    faults: Faults,
    desc: SceneDesc,
    /// Where `[render]` stands.
    render: Option<(usize, Span)>,
    /// Where names stand, by what they name.
    names: HashMap<(&'static str, String), (usize, Span)>,
    /// How many there are of each array of tables so far.
    counts: HashMap<String, usize>,
    /// The texts being read, from the scene's own to the one at hand.
    chain: Vec<String>,
    /// Where each text is included.
    included: HashMap<String, (usize, Span)>,
    bytes: u64,
    /// How many texts have been read to their end.
    finished: usize,
    incomplete: bool,
}

impl Loader<'_> {
    /// Reads the text that faults call `name`, at `path` relative to the scene's folder.
    fn load(&mut self, name: &str, path: String, bytes: &[u8]) {
        let file = self.sources.files.len();
        let (text, not_utf8) = decode(bytes);
        self.sources.files.push(SourceFile {
            name: name.to_owned(),
            text: String::new(),
            root: Node::empty(),
            bases: Vec::new(),
            rank: 0,
        });
        self.chain.push(path.clone());
        self.bytes += bytes.len() as u64;
        let folder = path.rsplit_once('/').map_or("", |(folder, _)| folder);
        // No TOML begins with a brace
        let is_json = name.to_lowercase().ends_with(".json") || text.trim_start().starts_with('{');
        let syntax = if is_json { Syntax::Json } else { Syntax::Toml };
        // Turn the text into a tree; without one, its faults are all there is to say
        let root = if let Some(message) = too_long(bytes) {
            self.file_fault(file, Span::default(), message, None);
            None
        } else if let Some((span, message)) = not_utf8 {
            self.file_fault(file, span, message, Some("save the text as UTF-8".into()));
            None
        } else {
            let ReadText { root, faults } = node::parse(&text, syntax, &is_array);
            self.incomplete |= root.is_none();
            // Another language, most likely
            if root.is_none() && faults.len() > MAX_SYNTAX_FAULTS && is_first_line(&text, faults[0].span) {
                let lines = faults.len();
                let message = format!("not TOML: {lines} lines are not understood, this is the first");
                self.file_fault(file, faults[0].span, message, Some("a scene is TOML or JSON text".into()));
            } else {
                for SyntaxFault { span, path, message, hint } in faults {
                    self.faults.push(Fault { file, span, path, message, hint, other: None });
                }
            }
            root
        };
        if let Some(mut root) = root {
            if let Some(include) = root.get("include") {
                self.include(file, &text, folder, include);
            }
            self.content(file, &text, folder, syntax, &mut root);
            self.sources.files[file].root = root;
        }
        self.sources.files[file].text = text;
        self.sources.files[file].rank = self.finished;
        self.finished += 1;
        self.chain.pop();
    }

    /// Records that a whole text cannot be read.
    fn file_fault(&mut self, file: usize, span: Span, message: String, hint: Option<String>) {
        self.incomplete = true;
        self.faults.push(Fault { file, span, path: String::new(), message, hint, other: None });
    }

    /// Reads the included texts.
    fn include(&mut self, file: usize, text: &str, folder: &str, include: &Node) {
        let Some(length) = include.len() else {
            let mut reader = Reader::new(file, text, folder, &mut self.faults);
            reader.within("include", |r| r.wrong_type(include, "an array of file names", None));
            self.incomplete = true;
            return;
        };
        for (i, element) in (0..length).filter_map(|i| Some((i, include.element(text, i)?))) {
            let mut fault = |message: String, hint: Option<String>, other| {
                let mut reader = Reader::new(file, text, folder, &mut self.faults);
                reader.within("include", |r| r.at(i, |r| r.conflict(element.span, message, hint, other)));
                self.incomplete = true;
            };
            let Data::String(written) = &element.data else {
                fault(format!("{} is not a file name", element.kind()), None, None);
                continue;
            };
            let path = normalized(&join_path(folder, written));
            let shown = quoted(written);
            // Refuse what would never end
            if let Some(start) = self.chain.iter().position(|p| *p == path) {
                let chain: Vec<&str> = self.chain[start..].iter().map(String::as_str).chain([path.as_str()]).collect();
                let message = format!("{shown} includes itself: {}", chain.join(" -> "));
                fault(message, Some("take one of these includes out".into()), None);
                continue;
            }
            if let Some(other) = self.included.get(&path) {
                let hint = "a scene includes each file once; take this one out";
                fault(format!("{shown} is included already"), Some(hint.into()), Some(*other));
                continue;
            }
            if self.chain.len() > MAX_INCLUDE_DEPTH {
                fault(format!("{shown} is more than {MAX_INCLUDE_DEPTH} includes deep"), None, None);
                continue;
            }
            if self.sources.files.len() >= MAX_FILES {
                fault(format!("{shown} is one more than the {MAX_FILES} files a scene can have"), None, None);
                continue;
            }
            let bytes = match self.assets.read(&path, MAX_BYTES.saturating_sub(self.bytes)) {
                Ok(bytes) => bytes,
                Err(error) => {
                    let hint = match error {
                        AssetError::NotFound => "file names are relative to the text that includes them".to_owned(),
                        AssetError::Outside => "move it into the folder of the scene, or allow its folder".to_owned(),
                        AssetError::TooLarge { .. } => {
                            format!("all texts of a scene together have at most {MAX_BYTES} bytes")
                        }
                        AssetError::Io(_) => "a scene includes plain files that can be read".to_owned(),
                    };
                    let colon = if matches!(error, AssetError::NotFound | AssetError::Io(_)) { ":" } else { "" };
                    let hint = error.slashes(&path).unwrap_or(hint);
                    fault(format!("{shown}{colon} {error}"), Some(hint), None);
                    continue;
                }
            };
            if let Some(foreign) = foreign(&bytes, WantedFile::Scene) {
                let message = format!("{shown} {}", foreign.message(WantedFile::Scene));
                fault(message, Some(foreign.hint(WantedFile::Scene).to_owned()), None);
                continue;
            }
            self.included.insert(path.clone(), (file, element.span));
            self.load(&path.clone(), path, &bytes);
        }
    }

    /// Reads the tables of one text.
    fn content(&mut self, file: usize, text: &str, folder: &str, syntax: Syntax, root: &mut Node) {
        let mut reader = Reader::new(file, text, folder, &mut self.faults);
        let mut arrays = Arrays { counts: &mut self.counts, bases: Vec::new(), syntax };
        let Data::Table(entries) = &mut root.data else {
            reader.wrong_type(root, "a scene: an object with render, camera, sphere and so on", None);
            self.incomplete = true;
            return;
        };
        for entry in entries {
            let (key, span) = (&*entry.key, entry.key_span);
            let node = &mut entry.value;
            if let Some(kind) = ShapeDesc::KINDS.iter().position(|k| *k == key) {
                let shapes = &mut self.desc.shapes;
                reader.within(key, |r| {
                    arrays.read(r, key, key, node, |r, node| shapes.push(ShapeDesc::read(kind, node, r)));
                });
                continue;
            }
            match key {
                "include" => {}
                "$schema" if syntax == Syntax::Json => {}
                "render" => reader.within("render", |r| match self.render {
                    Some(other) => {
                        let hint = "one text of a scene says it, for all of them";
                        r.conflict(node.span, "[render] is said twice", Some(hint.into()), Some(other));
                    }
                    None => {
                        self.render = Some((file, node.span));
                        self.desc.render = r.table::<RenderDesc>(node, "[render]");
                    }
                }),
                "camera" => {
                    reader.within("camera", |r| cameras(r, file, node, &mut self.names, &mut self.desc.cameras))
                }
                "group" => reader.within("group", |r| {
                    let (names, groups) = (&mut self.names, &mut self.desc.groups);
                    read_groups(r, file, node, &mut arrays, names, groups, &mut self.incomplete);
                }),
                "light" => reader.within("light", |r| {
                    for (kind, name, node) in kinds::<LightDesc>(r, node, &mut self.incomplete) {
                        let lights = &mut self.desc.lights;
                        let mut read = |r: &mut Reader<'_>, node: &Node| {
                            lights.push(LightDesc::read(kind.unwrap_or(0), node, r));
                        };
                        r.within(name, |r| arrays.read(r, &format!("light.{name}"), name, node, &mut read));
                    }
                }),
                "material" => reader.within("material", |r| {
                    named::<MaterialDesc>(
                        r,
                        file,
                        node,
                        &mut self.names,
                        &mut self.desc.materials,
                        &mut self.incomplete,
                    );
                }),
                "texture" => reader.within("texture", |r| {
                    named::<TextureDesc>(r, file, node, &mut self.names, &mut self.desc.textures, &mut self.incomplete);
                }),
                _ => {
                    // What it would have named may be missed elsewhere
                    self.incomplete |= matches!(node.data, Data::Table(_));
                    let hint = if LightDesc::KINDS.contains(&key) {
                        format!("lights are written [[light.{key}]]")
                    } else if MaterialDesc::KINDS.contains(&key) {
                        format!("materials are written [material.{key}.NAME]")
                    } else if TextureDesc::KINDS.contains(&key) {
                        format!("textures are written [texture.{key}.NAME]")
                    } else {
                        let top = top();
                        let near = did_you_mean(key, &top);
                        format!("{near}a scene takes {}", top.join(", "))
                    };
                    reader.within(&node::shortened(key), |r| r.error(span, "unknown key", Some(hint)));
                }
            }
        }
        self.sources.files[file].bases = arrays.bases;
    }
}
