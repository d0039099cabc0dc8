//! Scene text: from TOML, JSON or a course's own file to a [`SceneDesc`], and back.
//!
//! A text is read in three steps: the parser's tree with the place of every value ([`crate::describe::node`]), included
//! texts, then every table by hand, so that all faults come at once. What compiling finds later is placed by
//! [`sources`]. Limits for hostile texts are the constants here and in [`crate::describe::node`].

mod load;
mod reference;
mod schema;
pub(super) mod sources;
mod tables;
mod write;

pub use self::reference::reference;
pub use self::schema::schema;
use self::sources::{Position, Sources};
use super::course;
use super::description::SceneDesc;
use crate::context::Assets;
use crate::describe::Family;
use crate::describe::node::Span;
use crate::describe::read::Faults;
use crate::error::{Diagnostic, SceneError, Severity};
use crate::import::{WantedFile, foreign};
use crate::scene::compile::{CompileOptions, Compiled};
use crate::scene::studio::StudioSettings;

/// Most bytes of all texts of a scene together: 64 MiB.
const MAX_BYTES: u64 = 64 << 20;

/// What some editors begin a text with; it is no part of it.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

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
    model: Option<BareModel>,
}

/// The model that a scene is about.
#[derive(Clone, Debug)]
struct BareModel {
    /// What messages call it.
    name: String,
    /// What the description calls it.
    file: String,
    settings: StudioSettings,
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
            Ok(mut compiled) if self.faults.is_empty() => {
                compiled.scene.choices.model = self.model.as_ref().map(|model| model.settings.clone());
                Ok(Compiled {
                    warnings: self.of_file(self.sources.attach(compiled.warnings)),
                    advice: self.of_file(self.sources.attach(compiled.advice)),
                    ..compiled
                })
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
                Err(SceneError { faults: self.of_file(all.into_iter().map(|(_, fault)| fault).collect()) })
            }
        }
    }

    /// A scene that shows a model, as [`SceneDesc::of_model`] makes it; what is wrong with it is said of the file,
    /// which is called `name`, and not of a description that nobody wrote.
    pub fn of_model(name: &str, file: &str, settings: &StudioSettings) -> Self {
        let model = Some(BareModel { name: name.to_owned(), file: file.to_owned(), settings: settings.clone() });
        Self { model, ..SceneDesc::of_model(file, settings).into() }
    }

    /// What the description calls the file of a model by itself, and how that is shown.
    pub(super) fn model_file(&self) -> Option<(&str, &StudioSettings)> {
        self.model.as_ref().map(|BareModel { file, settings, .. }| (file.as_str(), settings))
    }

    /// The same diagnostics; of a model by itself, about its file.
    pub(super) fn of_file(&self, mut list: Vec<Diagnostic>) -> Vec<Diagnostic> {
        let Some(BareModel { name, file, .. }) = &self.model else { return list };
        for diagnostic in &mut list {
            let path = std::mem::take(&mut diagnostic.path);
            let field =
                path.strip_prefix("model[0]").or(path.strip_prefix("mesh[0]")).or(path.strip_prefix("point_set[0]"));
            let field = field.map_or(path.as_str(), |field| field.trim_start_matches('.'));
            let message = &diagnostic.message;
            // The words of the readers begin with the file
            let rest = message.strip_prefix(file.as_str()).or(message.strip_prefix(&format!("{file:?}")));
            diagnostic.message = match (rest, field) {
                (Some(rest), _) => format!("{name}{rest}"),
                (None, "" | "file") => format!("{name}: {message}"),
                (None, field) => format!("{name}: {field}: {message}"),
            };
        }
        list
    }
}

impl SceneDesc {
    /// Reads TOML (`.toml`, or anything else), JSON (`name` ends in `.json`), or the course's key-value text (`.txt`,
    /// or text whose first line that is not blank is `key value` of a known course key). Never fails: faults are kept
    /// inside.
    ///
    /// `name` is what faults call the text; the files it includes are read from `assets`, relative to the text that
    /// includes them. The lists of the description come in scene order: kinds in the order of their enums, then the
    /// order of the text, included files first.
    pub fn parse(name: &str, text: &[u8], assets: &dyn Assets) -> Parsed {
        if let Some(foreign) = foreign(text, WantedFile::Scene) {
            return Parsed::no_scene(name, &foreign.message(WantedFile::Scene), foreign.hint(WantedFile::Scene));
        }
        if course::is_course(name, text) {
            return course::parse(name, text);
        }
        if text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text).trim_ascii().is_empty() {
            return Parsed::no_scene(name, "is empty", "a scene is TOML or JSON text; an empty one is `{}`");
        }
        load::load(name, text, assets)
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
    /// Of a file that is no text of a scene: one fault, and no place in it.
    fn no_scene(name: &str, message: &str, hint: &str) -> Self {
        let fault = Diagnostic {
            severity: Severity::Error,
            place: None,
            path: String::new(),
            message: format!("{name} {message}"),
            hint: Some(hint.to_owned()),
        };
        let nothing = Self::from(SceneDesc::default());
        Self { faults: vec![fault], positions: vec![(0, 0)], incomplete: true, ..nothing }
    }

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
        Self { desc, output: None, threads: None, faults, positions, sources, incomplete, model: None }
    }
}

/// What to say of a text beyond the limit.
pub(super) fn too_long(bytes: &[u8]) -> Option<String> {
    let length = bytes.len() as u64;
    (length > MAX_BYTES).then(|| format!("the text has {length} bytes, the limit is {MAX_BYTES}"))
}

/// The text of UTF-8 bytes; of others as much as can be shown, and what is wrong.
pub(super) fn decode(bytes: &[u8]) -> (String, Option<(Span, String)>) {
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
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
    use crate::camera::CameraDesc;
    use crate::context::{MemoryAssets, NoAssets};
    use crate::describe::Table;
    use crate::describe::synonyms::{SYNONYMS, did_you_mean};
    use crate::light::LightDesc;
    use crate::material::MaterialDesc;
    use crate::scene::RenderDesc;
    use crate::shape::ShapeDesc;
    use crate::texture::TextureDesc;
    use crate::transform::TransformDesc;

    fn faultless(name: &str, text: &str, assets: &MemoryAssets) -> SceneDesc {
        let parsed = SceneDesc::parse(name, text.as_bytes(), assets);
        assert_eq!(parsed.faults(), []);
        parsed.desc
    }

    #[test]
    fn what_is_no_scene_is_one_fault() {
        let gltf = b"{ \"asset\": { \"version\": \"2.0\" }, \"meshes\": [] }";
        for (name, text, said) in [
            (
                "a.gltf",
                &gltf[..],
                "looks like a glTF model, not like a firstlight scene; give it as a model (.glb, .gltf), or name it \
                 as the file of a [[model]]",
            ),
            (
                "a.toml",
                b"\x89PNG\r\n\x1a\n",
                "looks like a PNG picture, not like a firstlight scene; a scene is TOML or JSON text; it names \
                 pictures in [texture.image.NAME]",
            ),
            (
                "a.txt",
                b"ply\nformat ascii 1.0\n",
                "looks like a PLY model, not like a firstlight scene; give it as a model, or name it as the file of a \
                 [[mesh]] or [[point_set]]",
            ),
        ] {
            let error = SceneDesc::parse(name, text, &NoAssets).compile(&NoAssets, &CompileOptions::default());
            assert_eq!(error.err().map(|e| e.to_string()), Some(format!("{name} {said}")));
        }
        for builtin in crate::scene::builtin_scenes() {
            assert_eq!(foreign(builtin.text.as_bytes(), WantedFile::Scene), None, "{}", builtin.name);
        }
    }

    #[test]
    fn prose_is_one_fault() {
        let prose = "It was a dark night. The rain fell in torrents\n".repeat(250);
        let parsed = SceneDesc::parse("story", prose.as_bytes(), &NoAssets);
        let [fault] = parsed.faults() else { panic!("{:?}", parsed.faults().len()) };
        assert_eq!(
            fault.to_string(),
            "story:1:4: not TOML: 250 lines are not understood, this is the first; a scene is TOML or JSON text"
        );
        let json = SceneDesc::parse("scene", b" { \"camera\": { \"position\": [0, 0, 5] } }", &NoAssets);
        assert_eq!(json.faults(), []);
    }

    #[test]
    fn synonyms_stand_for_words_that_exist() {
        let tables = [ShapeDesc::tables(), LightDesc::tables(), MaterialDesc::tables(), TextureDesc::tables()].concat();
        let mut known = vec!["render", "material", "light"];
        known.extend([ShapeDesc::KINDS, LightDesc::KINDS, MaterialDesc::KINDS, TextureDesc::KINDS].concat());
        known.extend([CameraDesc::fields(), RenderDesc::fields(), TransformDesc::fields()].concat());
        known.extend(tables.iter().flat_map(|table| table.fields.iter().map(|field| field.name)));
        for (words, target, _) in SYNONYMS {
            assert!(known.contains(target), "{target} is no word of scene text");
            for word in *words {
                let question = did_you_mean(word, &[target]);
                assert!(question.starts_with(&format!("did you mean \"{target}\"? ")), "{word}: {question}");
            }
        }
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

    /// A mesh of so many positions, in TOML and in JSON, `odd` being the hundredth.
    fn long_lists(odd: &str) -> [(&'static str, String); 2] {
        let row = |i: usize| if i == 99 { odd.to_owned() } else { format!("[{i}, {}.5, -1e-3]", i % 7) };
        let rows: Vec<String> = (0..10_000).map(row).collect();
        let toml = format!(
            "[[mesh]]\ntriangles = [[0, 1, 99]]\npositions = [ # many\n{},\n]\nname = \"m\"\n",
            rows.join(",\n")
        );
        let json = format!(
            "{{ \"mesh\": [{{\"triangles\": [[0, 1, 99]],\n\"positions\": [{}],\n\"name\": \"m\" }}] }}",
            rows.join(",\n")
        );
        [("s.toml", toml), ("s.json", json)]
    }

    #[test]
    fn long_lists_of_numbers_are_read_where_they_stand() {
        for (name, text) in long_lists("[99, 1.5, -1e-3]") {
            let desc = faultless(name, &text, &MemoryAssets::default());
            let [ShapeDesc::Mesh(mesh)] = &desc.shapes[..] else { panic!("{:?}", desc.shapes.len()) };
            let expected: Vec<[f64; 3]> = (0..10_000).map(|i| [f64::from(i), f64::from(i % 7) + 0.5, -1e-3]).collect();
            assert_eq!((&mesh.positions, mesh.name.as_deref()), (&expected, Some("m")));
        }
    }

    #[test]
    fn faults_of_long_lists_have_places() {
        // What the reader finds, what compiling finds, and what is no list of numbers any more
        for (odd, words) in [
            (
                "[99, 1e999, 0]",
                "mesh[0].positions[99][1]: 1e999 is too large for a number; at most 1.7976931348623157e308",
            ),
            (
                "[99, 0, -3e8]",
                "mesh[0].positions[99]: [99, 0, -300000000] is outside [-2.5e8, 2.5e8]; coordinates are in metres",
            ),
            ("[99, 0]", "mesh[0].positions[99]: an array of 2 values is not an array of 3 numbers"),
            ("[99, 0, \"1\"]", "mesh[0].positions[99][2]: \"1\" is a string, not a number"),
        ] {
            for (name, text) in long_lists(odd) {
                let parsed = SceneDesc::parse(name, text.as_bytes(), &NoAssets);
                let error = parsed.compile(&NoAssets, &CompileOptions::default()).expect_err("is wrong");
                let fault = error.faults.iter().find(|fault| fault.path.contains("positions")).expect("is told");
                let place = fault.place.as_ref().expect("has one");
                let line = text.lines().position(|line| line.contains(odd)).expect("is there") as u32 + 1;
                assert_eq!((place.line, place.excerpt.contains(odd)), (line, true), "{fault}");
                assert!(fault.to_string().ends_with(words), "{fault}");
            }
        }
    }

    #[test]
    fn tables_are_said_once() {
        let told = |text: &str| -> Vec<String> {
            SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets).faults().iter().map(ToString::to_string).collect()
        };
        let twice = |place: &str, key: &str| vec![format!("s.toml:{place}: \"{key}\" is said twice; keep one of them")];
        assert_eq!(told("[render]\nwidth = 1\n[camera]\nposition = [0, 0, 1]\n[render]\n"), twice("5:2", "render"));
        assert_eq!(told("[render]\nwidth = 1\nheight = 2\nwidth = 3\n"), twice("4:1", "width"));
        assert_eq!(told("render.width = 1\nrender.width = 2\n"), twice("2:8", "width"));
        assert_eq!(told("render.width = 1\n[render]\nheight = 1\n"), twice("2:2", "render"));
        assert_eq!(told("[material.phong.a]\n[material]\nphong.b = {}\n"), Vec::<String>::new());
        assert_eq!(told("[material.phong]\n[material]\nphong.b = {}\n"), twice("3:1", "phong"));
        assert_eq!(told("sphere = []\n[[sphere]]\n"), twice("2:3", "sphere"));
        // One more of an array of tables, with single brackets, does not hide what else there is
        let sphere = "center = [0, 0, 0]\nradius = 1\n";
        let single = |line: u32| {
            format!("s.toml:{line}:1: sphere: a table is not an array of tables; write [[sphere]] for each sphere")
        };
        assert_eq!(told(&format!("[[sphere]]\n{sphere}[sphere]\n{sphere}")), [single(4)]);
        let more = format!("[sphere]\n{sphere}[sphere]\n{sphere}[[sphere]]\n{sphere}colour = 1\n");
        let all = told(&more);
        assert_eq!(all[..2], [single(1), single(4)]);
        assert!(all.len() == 3 && all[2].starts_with("s.toml:10:1: sphere[2].colour: unknown key; "), "{all:?}");
        // Many keys are found by another way than few
        let many: String = (0..40).map(|i| format!("a{i} = 1\n")).collect();
        assert_eq!(told(&format!("{many}a3 = 2\n")), twice("41:1", "a3"));
        let kinds =
            [("1", "a number"), ("[1]", "an array of 1 value"), ("{ c = 1 }", "a table"), ("\"x\"", "a string")];
        for (value, kind) in kinds {
            let words = format!("s.toml:2:2: not TOML: \"a\" is {kind} already, and takes no keys here");
            assert_eq!(told(&format!("a = {value}\n[a.b]\n")), [words]);
            let [words] = &told(&format!("a = {value}\na.b = 1\n"))[..] else { panic!("{value}") };
            assert!(words.starts_with("s.toml:2:1: "), "{words}");
        }
        // Tables within the last of an array of tables, and one that is said after what it holds
        let text = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n[sphere.transform]\nscale = 2\n[[sphere]]\nradius = 2\n\
                    center = [1, 0, 0]\n[camera.a.transform]\nscale = 2\n[camera.a]\nposition = [0, 0, 1]\n";
        let desc = faultless("s.toml", text, &MemoryAssets::default());
        let scaled: Vec<bool> = desc.shapes.iter().map(|shape| shape.common().transform.is_some()).collect();
        assert_eq!((scaled, desc.cameras.len()), (vec![true, false], 1));
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
