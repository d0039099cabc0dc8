//! Scene text: from TOML, JSON or a course's own file to a [`SceneDesc`], and back.
//!
//! A text is read in three steps: the parser's tree with the place of every value ([`crate::describe::node`]), included
//! texts, then every table by hand, so that all faults come at once. What compiling finds later is placed by
//! [`sources`]. Limits for hostile texts are the constants here and in [`crate::describe::node`].

mod reference;
mod schema;
pub(super) mod sources;
mod write;

use std::collections::HashMap;

pub use self::reference::reference;
pub use self::schema::schema;
use self::sources::{Position, SourceFile, Sources};
use super::course;
use super::description::{RenderDesc, SceneDesc};
use crate::camera::CameraDesc;
use crate::context::{AssetError, Assets};
use crate::describe::node::{self, Data, Node, Span, Syntax, quoted};
use crate::describe::read::{Fault, Faults, Reader, nearest};
use crate::describe::value::{join_path, normalized};
use crate::describe::write::key;
use crate::describe::{Family, Table};
use crate::error::{Diagnostic, SceneError, Severity};
use crate::light::LightDesc;
use crate::material::MaterialDesc;
use crate::scene::compile::{CompileOptions, Compiled};
use crate::shape::{GroupDesc, ShapeDesc};
use crate::texture::TextureDesc;

/// Most bytes of all texts of a scene together: 64 MiB.
const MAX_BYTES: u64 = 64 << 20;
/// Deepest chain of includes.
const MAX_INCLUDE_DEPTH: usize = 32;
/// Most texts of a scene.
const MAX_FILES: usize = 1024;

/// The keys of a scene's top level.
const BEFORE_SHAPES: &[&str] = &["include", "render", "camera", "texture", "material"];
const AFTER_SHAPES: &[&str] = &["group", "light"];

fn top() -> Vec<&'static str> {
    [BEFORE_SHAPES, ShapeDesc::KINDS, AFTER_SHAPES].concat()
}

/// A description as it was read, with the faults of its text and the places of its values.
#[derive(Debug)]
pub struct Parsed {
    /// What could be read; stand-ins where something could not.
    pub desc: SceneDesc,
    /// The `output_file` of a course's file, relative to the working folder.
    pub output: Option<String>,
    /// The `num_threads` of a course's file.
    pub threads: Option<u32>,
    faults: Vec<Diagnostic>,
    positions: Vec<Position>,
    sources: Sources,
    /// A whole text or a group of named things is missing, so that compiling would complain without reason.
    incomplete: bool,
}

impl From<SceneDesc> for Parsed {
    /// A description that was made in code: its faults have no places.
    fn from(desc: SceneDesc) -> Self {
        Self::new(desc, Sources::default(), Faults::default(), false)
    }
}

impl Parsed {
    /// The faults of the text alone, in the order of the text: included files first, then line and column.
    pub fn faults(&self) -> &[Diagnostic] {
        &self.faults
    }

    /// Compiles; every fault of text and meaning at once, with places, in the order of the text.
    ///
    /// When a whole file could not be read for its syntax, only the faults of the text are told.
    ///
    /// # Errors
    /// All errors, if there is one.
    pub fn compile(&self, assets: &dyn Assets, options: &CompileOptions) -> Result<Compiled, SceneError> {
        if self.incomplete {
            return Err(SceneError { faults: self.faults.clone() });
        }
        match self.desc.compile(assets, options) {
            Ok(compiled) if self.faults.is_empty() => {
                Ok(Compiled { warnings: self.sources.attach(compiled.warnings), ..compiled })
            }
            Ok(_) => Err(SceneError { faults: self.faults.clone() }),
            Err(error) => {
                let text = self.positions.iter().copied().zip(self.faults.iter().cloned());
                let mut all: Vec<(Position, Diagnostic)> = text.chain(self.sources.locate(error.faults)).collect();
                // Warnings are for scenes that render
                if all.iter().any(|(_, fault)| fault.severity == Severity::Error) {
                    all.retain(|(_, fault)| fault.severity == Severity::Error);
                }
                all.sort_by_key(|(position, _)| *position);
                Err(SceneError { faults: all.into_iter().map(|(_, fault)| fault).collect() })
            }
        }
    }
}

impl SceneDesc {
    /// Reads TOML (`.toml`, or anything else), JSON (`name` ends in `.json`), or the course's key-value text (`.txt`, or
    /// text whose first line that is not blank is `key value` of a known course key). Never fails: faults are kept
    /// inside.
    ///
    /// `name` is what faults call the text; the files it includes are read from `assets`, relative to the text that
    /// includes them. The lists of the description come in scene order: kinds in the order of their enums, then the
    /// order of the text, included files first.
    pub fn parse(name: &str, text: &[u8], assets: &dyn Assets) -> Parsed {
        if course::is_course(name, text) {
            return course::parse(name, text);
        }
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

    /// Puts the lists in scene order: kinds in the order of their enums, each in the order it had. This is the order
    /// in which a scene's text lists them, and ids are given.
    pub fn sort(&mut self) {
        self.textures.sort_by_key(|(_, texture)| texture.kind_index());
        self.materials.sort_by_key(|(_, material)| material.kind_index());
        self.shapes.sort_by_key(Family::kind_index);
        for (_, group) in &mut self.groups {
            group.shapes.sort_by_key(Family::kind_index);
        }
        self.lights.sort_by_key(Family::kind_index);
    }
}

impl Parsed {
    pub(super) fn new(desc: SceneDesc, mut sources: Sources, faults: Faults, incomplete: bool) -> Self {
        sources.poisoned = faults.poisoned;
        let mut placed: Vec<(Position, Diagnostic)> =
            faults.list.into_iter().map(|fault| sources.diagnostic(fault)).collect();
        placed.sort_by_key(|(position, _)| *position);
        if faults.omitted > 0 {
            let more = Diagnostic {
                severity: Severity::Error,
                place: None,
                path: String::new(),
                message: format!("{} more faults are not listed", faults.omitted),
                hint: None,
            };
            placed.push(((usize::MAX, 0), more));
        }
        let (positions, faults) = placed.into_iter().unzip();
        Self { desc, output: None, threads: None, faults, positions, sources, incomplete }
    }
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
        let syntax = if name.to_lowercase().ends_with(".json") { Syntax::Json } else { Syntax::Toml };
        // Turn the text into a tree; without one, its faults are all there is to say
        let root = if let Some(message) = too_long(bytes) {
            self.file_fault(file, Span::default(), message, None);
            None
        } else if let Some((span, message)) = not_utf8 {
            self.file_fault(file, span, message, Some("save the text as UTF-8".into()));
            None
        } else {
            match node::parse(&text, syntax) {
                Ok(root) => Some(root),
                Err(faults) => {
                    for fault in faults {
                        self.file_fault(file, fault.span, fault.message, fault.hint);
                    }
                    None
                }
            }
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
        let Some(elements) = include.elements() else {
            let mut reader = Reader::new(file, text, folder, &mut self.faults);
            reader.within("include", |r| r.wrong_type(include, "an array of file names", None));
            self.incomplete = true;
            return;
        };
        for (i, element) in elements.iter().enumerate() {
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
                    fault(format!("{shown}{colon} {error}"), Some(hint), None);
                    continue;
                }
            };
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
            let (key, span) = (entry.key.as_str(), entry.key_span);
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
                        let near =
                            nearest(key, &top).map(|near| format!("did you mean \"{near}\"? ")).unwrap_or_default();
                        format!("{near}a scene takes {}", top.join(", "))
                    };
                    reader.within(&node::shortened(key), |r| r.error(span, "unknown key", Some(hint)));
                }
            }
        }
        self.sources.files[file].bases = arrays.bases;
    }
}

/// The arrays of tables of one text, whose elements count on from those of the texts before.
struct Arrays<'a> {
    /// How many there are of each so far.
    counts: &'a mut HashMap<String, usize>,
    /// With how many each began in this text.
    bases: Vec<(String, usize)>,
    syntax: Syntax,
}

impl Arrays<'_> {
    /// Reads the array `key` at `path`, each element by `read`.
    fn read(
        &mut self,
        reader: &mut Reader<'_>,
        path: &str,
        key: &str,
        node: &Node,
        mut read: impl FnMut(&mut Reader<'_>, &Node),
    ) {
        let count = self.counts.entry(path.to_owned()).or_insert(0);
        self.bases.push((path.to_owned(), *count));
        let Some(elements) = node.elements() else {
            let hint = match self.syntax {
                Syntax::Toml => format!("write [[{path}]] for each {key}"),
                Syntax::Json => format!("write \"{key}\": [{{ ... }}], one object for each"),
            };
            reader.wrong_type(node, "an array of tables", Some(hint));
            reader.poison();
            return;
        };
        for element in elements {
            reader.at(*count, |r| read(r, element));
            *count += 1;
        }
    }
}

/// Reads `[group.NAME]`: tables of arrays of shapes.
fn read_groups(
    reader: &mut Reader<'_>,
    file: usize,
    node: &Node,
    arrays: &mut Arrays<'_>,
    names: &mut HashMap<(&'static str, String), (usize, Span)>,
    groups: &mut Vec<(String, GroupDesc)>,
    incomplete: &mut bool,
) {
    let Some(entries) = node.entries() else {
        let hint = "write [[group.NAME.KIND]] for each shape of a group";
        reader.wrong_type(node, "a table of groups by name", Some(hint.into()));
        reader.poison();
        *incomplete = true;
        return;
    };
    for entry in entries {
        let name = &entry.key;
        reader.within(name, |r| {
            let span = entry.value.span;
            if let Some(other) = names.get(&("group", name.clone())) {
                let message = format!("the name {} is taken", quoted(name));
                r.conflict(span, message, Some("each group is described in one place".into()), Some(*other));
                return;
            }
            names.insert(("group", name.clone()), (file, span));
            let mut group = GroupDesc::default();
            match entry.value.entries() {
                None => {
                    let hint = format!("write [[group.{}.KIND]] for each shape of the group", key(name));
                    r.wrong_type(&entry.value, "a table of shapes by kind", Some(hint));
                    r.poison();
                }
                Some(kinds) => {
                    for of_kind in kinds {
                        let kind = ShapeDesc::KINDS.iter().position(|k| *k == of_kind.key);
                        r.within(&of_kind.key, |r| match kind {
                            Some(kind) => {
                                let path = format!("group.{}.{}", key(name), of_kind.key);
                                arrays.read(r, &path, &of_kind.key, &of_kind.value, |r, node| {
                                    group.shapes.push(ShapeDesc::read(kind, node, r));
                                });
                            }
                            None => {
                                let near = nearest(&of_kind.key, ShapeDesc::KINDS)
                                    .map(|near| format!("did you mean \"{near}\"? "))
                                    .unwrap_or_default();
                                let hint = format!("{near}a group takes {}", ShapeDesc::KINDS.join(", "));
                                r.error(of_kind.key_span, "unknown key", Some(hint));
                            }
                        });
                    }
                }
            }
            groups.push((name.clone(), group));
        });
    }
}

/// The kinds in `[light]`, `[material]` or `[texture]`; `None` for one that is unknown, of named things only.
fn kinds<'n, F: Family>(
    reader: &mut Reader<'_>,
    node: &'n Node,
    incomplete: &mut bool,
) -> Vec<(Option<usize>, &'n str, &'n Node)> {
    let Some(entries) = node.entries() else {
        reader.wrong_type(node, &format!("a table of the kinds of {}", F::WORD), None);
        reader.poison();
        *incomplete = true;
        return Vec::new();
    };
    let mut kinds = Vec::new();
    for entry in entries {
        let kind = F::KINDS.iter().position(|k| *k == entry.key);
        if kind.is_none() {
            let near =
                nearest(&entry.key, F::KINDS).map(|near| format!("did you mean \"{near}\"? ")).unwrap_or_default();
            let hint = format!("{near}kinds of {} are {}", F::WORD, F::KINDS.join(", "));
            let message = format!("unknown kind of {}", F::WORD);
            reader.within(&node::shortened(&entry.key), |r| r.error(entry.key_span, message, Some(hint)));
        }
        if kind.is_some() || F::WORD != LightDesc::WORD {
            kinds.push((kind, entry.key.as_str(), &entry.value));
        }
    }
    kinds
}

/// Reads `[material.KIND.NAME]` or `[texture.KIND.NAME]`.
fn named<F: Family>(
    reader: &mut Reader<'_>,
    file: usize,
    node: &Node,
    names: &mut HashMap<(&'static str, String), (usize, Span)>,
    list: &mut Vec<(String, F)>,
    incomplete: &mut bool,
) {
    for (kind, kind_name, node) in kinds::<F>(reader, node, incomplete) {
        reader.within(kind_name, |r| {
            let Some(entries) = node.entries() else {
                let hint = format!("write [{}.{kind_name}.NAME]", F::WORD);
                // Of an unknown kind enough has been said
                if kind.is_some() {
                    r.wrong_type(node, &format!("a table of names, each with its {}", F::WORD), Some(hint));
                }
                r.poison();
                *incomplete = true;
                return;
            };
            for entry in entries {
                r.within(&entry.key, |r| {
                    let span = entry.value.span;
                    if let Some(other) = names.get(&(F::WORD, entry.key.clone())) {
                        let message = format!("the name {} is taken", quoted(&entry.key));
                        let hint = format!("names are unique among all kinds of {}", F::WORD);
                        r.conflict(span, message, Some(hint), Some(*other));
                        return;
                    }
                    names.insert((F::WORD, entry.key.clone()), (file, span));
                    match kind {
                        Some(kind) => {
                            // `diffuse = 1` directly in [material.phong]: a name was forgotten
                            if entry.value.entries().is_none() {
                                let hint = format!("write [{}.{kind_name}.NAME] with a name", F::WORD);
                                r.wrong_type(&entry.value, "a table", Some(hint));
                                r.poison();
                                return;
                            }
                            list.push((entry.key.clone(), F::read(kind, &entry.value, r)));
                        }
                        // Those who use the name shall find something
                        None => {
                            r.poison();
                            list.push((entry.key.clone(), F::read(0, &Node::empty(), r)));
                        }
                    }
                });
            }
        });
    }
}

/// Reads `[camera]`, or `[camera.NAME]`: a table with nothing but tables in it.
fn cameras(
    reader: &mut Reader<'_>,
    file: usize,
    node: &mut Node,
    names: &mut HashMap<(&'static str, String), (usize, Span)>,
    list: &mut Vec<(String, CameraDesc)>,
) {
    let is_table = |node: &Node| matches!(node.data, Data::Table(_));
    let mut add = |r: &mut Reader<'_>, name: &str, node: &Node| {
        if let Some(other) = names.get(&("camera", name.to_owned())) {
            let message = match name {
                "" => "there is a camera without a name already".to_owned(),
                name => format!("the name {} is taken", quoted(name)),
            };
            r.conflict(node.span, message, Some("give each camera its own name".into()), Some(*other));
            return;
        }
        names.insert(("camera", name.to_owned()), (file, node.span));
        list.push((name.to_owned(), r.table::<CameraDesc>(node, "a camera")));
    };
    let several = node.entries().is_some_and(|e| !e.is_empty() && e.iter().all(|e| is_table(&e.value)));
    if several {
        for entry in node.entries().unwrap_or_default() {
            reader.within(&entry.key, |r| add(r, &entry.key, &entry.value));
        }
        return;
    }
    // Tables among values: two ways of saying cameras in one, but for those that a camera has of its own
    if let Data::Table(entries) = &mut node.data {
        let own = |entry: &node::Entry| {
            CameraDesc::info().iter().any(|field| field.name == entry.key && !field.tables.is_empty())
        };
        entries.retain(|entry| {
            if is_table(&entry.value) && own(entry) {
                return true;
            }
            if is_table(&entry.value) {
                let hint = "give the camera without a name one, as [camera.NAME]";
                reader.within(&entry.key, |r| {
                    r.error(entry.value.span, "a camera with a name beside one without", Some(hint.into()));
                    r.poison();
                });
            }
            !is_table(&entry.value)
        });
    }
    add(reader, "", node);
}

/// What to say of a text beyond the limit.
pub(super) fn too_long(bytes: &[u8]) -> Option<String> {
    let length = bytes.len() as u64;
    (length > MAX_BYTES).then(|| format!("the text has {length} bytes, the limit is {MAX_BYTES}"))
}

/// The text of UTF-8 bytes; of others as much as can be shown, and what is wrong.
pub(super) fn decode(bytes: &[u8]) -> (String, Option<(Span, String)>) {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    // Too long is said without looking further
    if bytes.len() as u64 > MAX_BYTES {
        return (String::new(), None);
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => (text.to_owned(), None),
        Err(error) => {
            let at = error.valid_up_to();
            let message = format!("byte {at} (0x{:02x}) is not UTF-8", bytes[at]);
            let text = String::from_utf8_lossy(bytes).into_owned();
            (text, Some((Span { start: at, end: at + 1 }, message)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::{MemoryAssets, NoAssets};

    fn faultless(name: &str, text: &str, assets: &MemoryAssets) -> SceneDesc {
        let parsed = SceneDesc::parse(name, text.as_bytes(), assets);
        assert_eq!(parsed.faults(), []);
        parsed.desc
    }

    #[test]
    fn every_form_of_a_number_is_read() {
        let numbers = [
            ("1", 1.0),
            ("-1_000", -1000.0),
            ("+0.5", 0.5),
            ("1_0.2_5e-1", 1.025),
            ("0xff", 255.0),
            ("0o17", 15.0),
            ("0b11", 3.0),
            ("1e308", 1e308),
            ("123456789012345678901234567890", 1.2345678901234568e29),
            ("inf", f64::INFINITY),
            ("-inf", f64::NEG_INFINITY),
        ];
        for (text, value) in numbers {
            let desc = faultless("s.toml", &format!("[render]\nexposure = {text}\n"), &MemoryAssets::default());
            assert_eq!(desc.render.exposure, value, "{text}");
        }
        let desc =
            faultless("s.json", "{ \"render\": { \"width\": 64.0, \"exposure\": -1.5e1 } }", &MemoryAssets::default());
        assert_eq!((desc.render.width, desc.render.exposure), (64, -15.0));
    }

    #[test]
    fn included_texts_come_first_and_files_start_at_the_scene() {
        let mut assets = MemoryAssets::default();
        let mut add = |path: &str, text: &str| assets.files.insert(path.into(), text.into());
        add("parts/a.toml", "include = [\"deep/b.json\"]\n[[sphere]]\ncenter = [2, 0, 0]\nradius = 1\n");
        add(
            "parts/deep/b.json",
            "{ \"sphere\": [{ \"center\": [1, 0, 0], \"radius\": 1 }],\n\
             \"texture\": { \"image\": { \"b\": { \"file\": \"../b.png\" } } } }",
        );
        let text = "include = [\"parts/a.toml\"]\n[[parallelogram]]\np = [0, 0, 0]\ne0 = [1, 0, 0]\ne1 = [0, 1, 0]\n\
                    [[sphere]]\ncenter = [3, 0, 0]\nradius = 1\n[texture.image.own]\nfile = \"../own.png\"\n";
        let desc = faultless("folder/scene.toml", text, &assets);
        let centers: Vec<f64> = desc
            .shapes
            .iter()
            .filter_map(|s| if let ShapeDesc::Sphere(s) = s { Some(s.center[0]) } else { None })
            .collect();
        assert_eq!(centers, [1.0, 2.0, 3.0]);
        assert!(matches!(desc.shapes.last(), Some(ShapeDesc::Parallelogram(_))));
        let files: Vec<(&str, &str)> = desc
            .textures
            .iter()
            .filter_map(
                |(n, t)| if let TextureDesc::Image(t) = t { Some((n.as_str(), t.file.0.as_str())) } else { None },
            )
            .collect();
        assert_eq!(files, [("b", "parts/b.png"), ("own", "../own.png")]);
    }

    #[test]
    fn cameras_keep_the_order_of_the_text() {
        let text = "[camera.z]\nposition = [0, 0, 1]\n[camera.a]\nposition = [0, 0, 2]\n";
        let names = |desc: SceneDesc| desc.cameras.into_iter().map(|(name, _)| name).collect::<Vec<_>>();
        assert_eq!(names(faultless("s.toml", text, &MemoryAssets::default())), ["z", "a"]);
        let one = "camera = { position = [0, 0, 1] }";
        assert_eq!(names(faultless("s.toml", one, &MemoryAssets::default())), [""]);
    }

    #[test]
    fn faults_of_text_and_meaning_keep_the_description_usable() {
        let text = b"[[sphere]]\nradius = 1\n[[sphere]]\ncenter = [1, 0, 0]\nradius = 2\n";
        let parsed = SceneDesc::parse("s.toml", text, &NoAssets);
        assert_eq!((parsed.faults().len(), parsed.desc.shapes.len()), (1, 2));
        assert!(parsed.compile(&NoAssets, &CompileOptions::default()).is_err());
    }
}
