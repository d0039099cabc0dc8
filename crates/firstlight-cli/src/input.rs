//! Where a scene comes from: a file, standard input, or the program itself.

use std::collections::HashMap;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use firstlight::{
    AssetError, Assets, CompileCache, CompileOptions, Compiled, Diagnostic, FolderAssets, Framing, MeshFormat,
    ModelPicture, ModelReport, NoAssets, Parsed, SceneDesc, Severity, Studio, StudioSettings, UpAxis, builtin_scenes,
    gltf_animations, is_gltf,
};

use crate::args::{Axis, LightSource, ModelArgs, ReadingArgs, StudioName, Switch};
use crate::output::Names;
use crate::progress::loading;
use crate::report::{Failure, say, shown};
use crate::scenes;

/// No scene text is longer, in bytes. Meshes and pictures are files of their own.
const TEXT_LIMIT: u64 = 64 << 20;
/// No model in a pipe is longer, in bytes: it is kept in memory as it comes.
const MODEL_LIMIT: u64 = 1 << 30;
/// Bytes that tell what a file is.
const HEAD: u64 = 1 << 16;

/// A scene that was read, and what is needed to compile it.
pub struct Input {
    /// What messages call it: the path as written, the built-in name, `<stdin>` or `<stdin>.json`.
    pub name: String,
    /// The description, and the faults of its text.
    pub parsed: Parsed,
    /// How it is shown, if it is a model by itself.
    pub studio: Option<StudioSettings>,
    /// The scene's or model's own file, as it was named; standard input may be one too.
    own: Option<PathBuf>,
    /// The folder that the names of its files start at; a built-in scene has none.
    pub folder: Option<PathBuf>,
    /// How a camera that is found for it frames what it sees.
    pub framing: Framing,
    assets: Remembered,
    strict: bool,
    texture_memory: Option<u32>,
    /// Bytes that it may take.
    pub memory: Option<u64>,
    /// What one compilation leaves to the next.
    cache: Option<CompileCache>,
}

/// The files of a scene, kept once they were read.
struct Remembered {
    /// None for a built-in scene, which reads no files.
    folder: Option<FolderAssets>,
    /// What the description calls a model, and its file's name, which need not be UTF-8.
    model: Option<(String, PathBuf)>,
    files: Mutex<HashMap<String, Result<Vec<u8>, AssetError>>>,
    /// Whether they will be asked for again.
    again: bool,
}

impl Remembered {
    fn new(folder: Option<FolderAssets>) -> Self {
        Self { folder, model: None, files: Mutex::default(), again: false }
    }

    fn read_anew(&self, path: &str, limit: u64) -> Result<Vec<u8>, AssetError> {
        match (&self.folder, &self.model) {
            (Some(folder), Some((called, file))) if called == path => folder.read_path(file, limit),
            (Some(folder), _) => folder.read(path, limit),
            (None, _) => NoAssets.read(path, limit),
        }
    }
}

impl Assets for Remembered {
    fn read(&self, path: &str, limit: u64) -> Result<Vec<u8>, AssetError> {
        let Some(mut files) = self.files.lock().ok().filter(|_| self.again) else {
            return self.read_anew(path, limit);
        };
        let read = files.entry(path.to_owned()).or_insert_with(|| self.read_anew(path, limit));
        match read {
            Ok(bytes) if bytes.len() as u64 > limit => Err(AssetError::TooLarge { size: bytes.len() as u64, limit }),
            read => read.clone(),
        }
    }
}

/// Reads the scene that `scene` names.
///
/// # Errors
/// Its text cannot be had. Faults inside the text are kept for [`Input::compile`].
pub fn read(scene: &Path, reading: &ReadingArgs) -> Result<Input, Failure> {
    let work = |why: String| Failure::Work(format!("{}: {why}", shown(scene)));
    if is_model(scene) {
        return refuse_no_lights(read_model(scene, reading)?, &reading.model);
    }
    // A file may be given as standard input
    let stdin = || cfg!(unix).then(|| PathBuf::from("/dev/stdin"));
    let input = if scene == "-" {
        let bytes = read_stream(io::stdin().lock()).map_err(|why| Failure::Work(format!("standard input: {why}")))?;
        if is_mesh(&bytes) {
            return refuse_no_lights(piped_model("<stdin>", stdin(), bytes, reading), &reading.model);
        }
        // A name tells JSON from TOML; no TOML begins with a brace. A byte order mark is no part of the text
        let marked = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
        let json = marked.trim_ascii_start().starts_with(b"{");
        let name = if json { "<stdin>.json" } else { "<stdin>" };
        read_text(name.to_owned(), &bytes, Some(Path::new("")), stdin(), reading)?
    } else if let Some(builtin) = builtin_scenes().iter().find(|builtin| scene == builtin.name) {
        read_text(builtin.name.to_owned(), builtin.text.as_bytes(), None, None, reading)?
    } else {
        let file = open(scene).map_err(work)?;
        let meta = file.metadata().map_err(|e| work(e.to_string()))?;
        let bytes = if meta.is_file() {
            let head = read_head(&file).map_err(work)?;
            // Whatever its name: a model is known by its content
            if is_mesh(&head) || is_binary_stl(&head, meta.len()) {
                return refuse_no_lights(read_model(scene, reading)?, &reading.model);
            }
            read_rest(head, file, TEXT_LIMIT)
        } else {
            read_stream(file)
        };
        let bytes = bytes.map_err(work)?;
        if is_mesh(&bytes) {
            let model = piped_model(&scene.display().to_string(), Some(scene.to_path_buf()), bytes, reading);
            return refuse_no_lights(model, &reading.model);
        }
        let folder = scene.parent().map(Path::to_path_buf).unwrap_or_default();
        read_text(scene.display().to_string(), &bytes, Some(&folder), Some(scene.to_path_buf()), reading)?
    };
    // What is no scene either is said better by its faults
    if input.parsed.faults().is_empty() {
        refuse_options_of_models(scene, reading)?;
    }
    Ok(input)
}

/// Sees that options for models are said of models only.
///
/// # Errors
/// `scene` is none.
fn refuse_options_of_models(scene: &Path, reading: &ReadingArgs) -> Result<(), Failure> {
    let model = &reading.model;
    let options = [
        ("--studio", model.studio.is_some()),
        ("--ground", model.ground.is_some()),
        ("--lights", model.lights.is_some()),
        ("--up", model.up.is_some()),
        ("--smooth", model.smooth.is_some()),
        ("--variant", model.variant.is_some()),
        ("--animation", model.animation.is_some()),
        ("--gltf-scene", model.gltf_scene.is_some()),
    ];
    for (option, said) in options {
        if said && !is_model(scene) {
            let (scene, endings) = (shown(scene), model_endings());
            return Err(Failure::Usage(format!("{option} is for models, and {scene} is none ({endings})")));
        }
    }
    Ok(())
}

/// A scene of text, with its files in `folder`; a built-in scene has none. `own` is the file of the text.
fn read_text(
    name: String,
    text: &[u8],
    folder: Option<&Path>,
    own: Option<PathBuf>,
    reading: &ReadingArgs,
) -> Result<Input, Failure> {
    // A scene reads its own folder
    let assets = Remembered::new(folder.map(|folder| folder_assets(folder, reading)).transpose()?);
    let parsed = SceneDesc::parse(&name, text, &assets);
    let (folder, framing) = (folder.map(Path::to_path_buf), Framing::default());
    Ok(Input {
        name,
        parsed,
        studio: None,
        own,
        folder,
        framing,
        assets,
        strict: reading.strict,
        texture_memory: reading.texture_memory,
        memory: None,
        cache: None,
    })
}

/// The files of a folder, and of those that are allowed besides.
fn folder_assets(folder: &Path, reading: &ReadingArgs) -> Result<FolderAssets, Failure> {
    FolderAssets::new(folder, &reading.allow_dir)
        .map_err(|(path, e)| Failure::Work(format!("--allow-dir: {}: {e}", shown(&path))))
}

/// The endings of models.
pub const MODEL_ENDINGS: [&str; 5] = ["glb", "gltf", "obj", "ply", "stl"];

/// `.glb, .gltf, .obj, .ply, .stl`
fn model_endings() -> String {
    MODEL_ENDINGS.map(|ending| format!(".{ending}")).join(", ")
}

/// Whether `scene` names a model, by its ending.
fn is_model(scene: &Path) -> bool {
    let ending = scene.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    ending.is_some_and(|ending| MODEL_ENDINGS.contains(&&*ending))
}

/// The scenes of the command line, with each folder replaced by the models in it and in the folders below it, sorted by
/// the bytes of their paths. Files and folders whose names begin with a dot are skipped, and links to folders are not
/// followed. A folder that holds no model, or that cannot be read, is kept in the list: rendering it reports the error.
/// With each what the placeholders in the names of its outputs stand for.
pub fn with_folders(scenes: &[PathBuf]) -> Vec<(PathBuf, Names)> {
    let is_folder = |given: &PathBuf| file_of(given).is_some_and(Path::is_dir);
    let below = |given: &PathBuf| {
        let found = if is_folder(given) { models_in(given) } else { vec![given.clone()] };
        let named = |scene: PathBuf| {
            let names = names_of(&scene, given);
            (scene, names)
        };
        found.into_iter().map(named).collect::<Vec<_>>()
    };
    scenes.iter().flat_map(below).collect()
}

fn models_in(folder: &Path) -> Vec<PathBuf> {
    let (mut found, mut folders) = (Vec::new(), vec![folder.to_path_buf()]);
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else {
            found.push(folder);
            continue;
        };
        for entry in entries.flatten().filter(|entry| !entry.file_name().as_encoded_bytes().starts_with(b".")) {
            let path = entry.path();
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                folders.push(path);
            } else if is_model(&path) && !path.is_dir() {
                found.push(path);
            }
        }
    }
    found.sort_by(|a, b| a.as_os_str().as_encoded_bytes().cmp(b.as_os_str().as_encoded_bytes()));
    if found.is_empty() { vec![folder.to_path_buf()] } else { found }
}

/// Why a folder is no scene: that it cannot be read, or that it has no models.
pub fn fault_of_folder(folder: &Path) -> Failure {
    let name = shown(folder);
    Failure::Work(match std::fs::read_dir(folder) {
        Err(e) => format!("{name}: {e}"),
        Ok(_) => format!(
            "{name}: no file in this folder or below ends in {}; hidden files and folders are left out, and links to \
             folders are not followed",
            model_endings()
        ),
    })
}

/// Whether these are the first bytes of a mesh file; of a binary STL file, all of its bytes.
fn is_mesh(bytes: &[u8]) -> bool {
    MeshFormat::detect("", bytes).is_some() || is_gltf(bytes)
}

/// The length of a binary STL file that begins so, by its count of facets.
fn binary_stl_length(head: &[u8]) -> Option<u64> {
    let count = head.get(80..84)?;
    let count = u32::from_le_bytes([count[0], count[1], count[2], count[3]]);
    (count > 0).then_some(84 + 50 * u64::from(count))
}

/// Whether a file of that length, which begins so, is a binary STL file.
fn is_binary_stl(head: &[u8], length: u64) -> bool {
    binary_stl_length(head) == Some(length)
}

/// Sees that a model that is to be shown by the lights of its file may have some.
///
/// # Errors
/// Files of its kind have none.
fn refuse_no_lights(input: Input, model: &ModelArgs) -> Result<Input, Failure> {
    if input.studio.as_ref().is_none_or(|studio| studio.studio != Studio::None) || input.is_gltf() {
        return Ok(input);
    }
    let option = if model.lights.is_some() { "--lights file" } else { "--studio none" };
    let name = &input.name;
    Err(Failure::Usage(format!(
        "{option} shows a model by the lights of its file, and {name} has none: only glTF files do; leave the option \
         out, or choose --studio soft, hard, flat or clay"
    )))
}

/// A scene around a model.
fn read_model(path: &Path, reading: &ReadingArgs) -> Result<Input, Failure> {
    let work = |why: String| Failure::Work(format!("{}: {why}", shown(path)));
    // Enough of it to tell points from faces
    let file = open(path).map_err(work)?;
    if !file.metadata().is_ok_and(|meta| meta.is_file()) {
        let bytes = read_stream(file).map_err(work)?;
        return Ok(piped_model(&path.display().to_string(), Some(path.to_path_buf()), bytes, reading));
    }
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    let file = PathBuf::from(path.file_name().unwrap_or_default());
    let (called, name) = (file.to_string_lossy().into_owned(), path.display().to_string());
    let assets = Remembered::new(Some(folder_assets(&folder, reading)?));
    Ok(Input {
        parsed: Parsed::of_model(&name, &called, &model_settings(&reading.model)),
        name,
        studio: Some(model_settings(&reading.model)),
        folder: Some(folder),
        framing: Framing::default(),
        own: Some(path.to_path_buf()),
        assets: Remembered { model: Some((called, file)), ..assets },
        strict: reading.strict,
        texture_memory: reading.texture_memory,
        memory: None,
        cache: None,
    })
}

/// A scene around a model that came through a pipe, with all its bytes; `own` is the pipe.
fn piped_model(name: &str, own: Option<PathBuf>, bytes: Vec<u8>, reading: &ReadingArgs) -> Input {
    let file = PathBuf::from(Path::new(name).file_name().unwrap_or_default());
    let called = file.to_string_lossy().into_owned();
    let parsed = Parsed::of_model(name, &called, &model_settings(&reading.model));
    // There is nothing to read it from again
    let files = Mutex::new([(called.clone(), Ok(bytes))].into());
    let assets = Remembered { model: Some((called, file)), files, again: true, ..Remembered::new(None) };
    Input {
        name: name.to_owned(),
        parsed,
        studio: Some(model_settings(&reading.model)),
        folder: None,
        framing: Framing::default(),
        own,
        assets,
        strict: reading.strict,
        texture_memory: reading.texture_memory,
        memory: None,
        cache: None,
    }
}

/// How a model is shown.
fn model_settings(model: &ModelArgs) -> StudioSettings {
    let studio = match (model.studio, model.lights) {
        (_, Some(LightSource::File)) | (Some(StudioName::None), _) => Studio::None,
        (None | Some(StudioName::Soft), _) => Studio::Soft,
        (Some(StudioName::Hard), _) => Studio::Hard,
        (Some(StudioName::Flat), _) => Studio::Flat,
        (Some(StudioName::Clay), _) => Studio::Clay,
    };
    StudioSettings {
        studio,
        ground: model.ground.map(|ground| ground == Switch::On),
        up: model.up.map(|up| if up == Axis::Z { UpAxis::Z } else { UpAxis::Y }),
        smooth_deg: model.smooth,
        variant: model.variant.clone(),
        scene: model.gltf_scene,
        animation: model.animation.clone(),
        ..StudioSettings::default()
    }
}

/// The file that `scene` names; none for standard input and built-in scenes.
pub fn file_of(scene: &Path) -> Option<&Path> {
    let is_file = scene != "-" && !builtin_scenes().iter().any(|builtin| scene == builtin.name);
    is_file.then_some(scene)
}

/// What the placeholders in the names of its outputs stand for; `given`: the scene itself, or the folder that was given
/// on the command line and holds it.
fn names_of(scene: &Path, given: &Path) -> Names {
    let builtin_or_stdin = file_of(scene).is_none();
    let whole = |part: Option<&OsStr>| part.map_or_else(|| OsString::from("scene"), OsStr::to_owned);
    if scene == "-" {
        return Names { stem: whole(None), name: whole(None), parent: whole(None), folder: ".".into() };
    }
    let name = whole(scene.file_name());
    if builtin_or_stdin {
        return Names { stem: name.clone(), name, parent: whole(None), folder: ".".into() };
    }
    // As it was written, and of the working folder what it is called
    let folder = scene.parent().unwrap_or(Path::new(""));
    let parent = folder.file_name().map(OsStr::to_owned).or_else(|| {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        folder.canonicalize().ok().and_then(|folder| folder.file_name().map(OsStr::to_owned))
    });
    // Of a scene that was given by itself the path as it was written: never out of the outputs' own folder
    let below = if scene == given { folder } else { folder.strip_prefix(given).unwrap_or(folder) };
    let below: PathBuf = below.components().filter(|part| matches!(part, std::path::Component::Normal(_))).collect();
    let below = if below.as_os_str().is_empty() { OsString::from(".") } else { below.into_os_string() };
    Names { stem: whole(scene.file_stem()), name, parent: whole(parent.as_deref()), folder: below }
}

/// No course file that anybody writes is longer, in bytes.
const COURSE_LIMIT: u64 = 1 << 16;

/// The `output_file` that a course file names; `None` for all other scenes, and for what cannot be read.
pub fn course_output(scene: &Path) -> Option<String> {
    let file = file_of(scene).filter(|file| !is_model(file))?;
    let is_short = file.metadata().is_ok_and(|meta| meta.is_file() && meta.len() <= COURSE_LIMIT);
    let text = if is_short { std::fs::read(file).ok()? } else { return None };
    SceneDesc::parse(&file.display().to_string(), &text, &NoAssets).output
}

impl Input {
    /// Says that a camera was found, where a scene's text has none; a model never has one.
    pub fn tell_added(&self, compiled: &Compiled) {
        if compiled.added.camera.is_some() && self.studio.is_none() {
            let name = &self.name;
            say(format_args!(
                "note: {name} has no camera; one was found that sees all of it (--view, --margin, --print-scene)"
            ));
        }
    }

    /// Has a glTF model by itself play its first animation, where none was named, and bring its cameras.
    pub fn show(&mut self, plays: bool, cameras: bool) {
        let Some(mut studio) = self.studio.clone().filter(|_| (plays || cameras) && self.is_gltf()) else { return };
        let is_animated = || self.model_bytes().is_ok_and(|bytes| !gltf_animations(&bytes).is_empty());
        if plays && studio.animation.is_none() && is_animated() {
            studio.animation = Some("0".to_owned());
        }
        studio.cameras |= cameras;
        self.stage(studio);
    }

    /// Shows a model by itself in another way.
    pub fn stage(&mut self, studio: StudioSettings) {
        if let Some((called, _)) = &self.assets.model {
            self.parsed = Parsed::of_model(&self.name, called, &studio);
            self.studio = Some(studio);
        }
    }

    /// Whether it is a glTF model by itself.
    pub fn is_gltf(&self) -> bool {
        let ending = |name: &str| name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
        let called = self.assets.model.as_ref().and_then(|(called, _)| ending(called));
        matches!(called.as_deref(), Some("glb" | "gltf")) || self.model_bytes().is_ok_and(|bytes| is_gltf(&bytes))
    }

    /// What a model by itself holds, at `time` in seconds.
    ///
    /// # Errors
    /// It cannot be shown, or is none.
    pub fn model_report(&self, time: f64) -> Result<ModelReport, Failure> {
        match self.parsed.model_report(&self.assets, time) {
            Some(report) => report.map_err(|e| Failure::Scene(e.faults)),
            None => Err(Failure::Work(format!("{}: is no model", self.name))),
        }
    }

    /// That pictures of a model are missing or damaged, a warning each.
    pub fn faults_of_pictures(&self, report: &ModelReport) -> Vec<Diagnostic> {
        let warning = |picture: &ModelPicture| Diagnostic {
            severity: Severity::Warning,
            place: None,
            path: String::new(),
            message: format!("{}: {:?}: {}", self.name, picture.file, picture.fault.as_deref().unwrap_or_default()),
            hint: Some("magenta and black squares stand in for it".into()),
        };
        report.faulty_pictures().map(warning).collect()
    }

    /// The bytes of the model's own file.
    ///
    /// # Errors
    /// It cannot be read any more.
    pub fn model_bytes(&self) -> Result<Vec<u8>, Failure> {
        let called = self.assets.model.as_ref().map_or("", |(called, _)| called);
        self.assets.read(called, u64::MAX).map_err(|why| Failure::Work(format!("{}: {why}", self.name)))
    }

    /// The files that the scene was made of so far: its own, and all that it read.
    pub fn files(&self) -> Vec<PathBuf> {
        let read = self.assets.folder.iter().flat_map(FolderAssets::files);
        self.own.iter().cloned().chain(read).collect()
    }

    /// Keeps the scene's files in memory, for it will be compiled more than once.
    pub fn remember_files(&mut self) {
        self.assets.again = true;
    }

    /// The description with the parts of its models in place of them, as they are at `time`.
    ///
    /// # Errors
    /// What is wrong with the models.
    pub fn without_models(&self, time: f64) -> Result<SceneDesc, Failure> {
        self.parsed.desc.without_models(&self.assets, time).map_err(|e| Failure::Scene(e.faults))
    }

    /// Keeps what is dear to make of them as well: for other cameras and sizes nothing of it is made again.
    pub fn remember_all(&mut self) {
        self.remember_files();
        self.cache = Some(CompileCache::default());
    }

    /// Compiles the description as it is now, at `time` in seconds. Files are read the first time only: a scene has the
    /// same textures in all its frames. What takes its time is told, unless `quiet`.
    ///
    /// # Errors
    /// Every fault of text and meaning.
    pub fn compile(&self, time: f64, quiet: bool) -> Result<Compiled, Failure> {
        let progress = (!quiet).then(loading);
        let options = CompileOptions {
            strict: self.strict,
            time,
            framing: self.framing,
            studio: self.studio.clone(),
            progress,
            cache: self.cache.clone(),
            memory: self.memory,
            texture_memory: self.texture_memory.map(|mib| u64::from(mib) << 20),
        };
        self.parsed.compile(&self.assets, &options).map_err(|e| Failure::Scene(e.faults))
    }
}

fn open(path: &Path) -> Result<File, String> {
    match File::open(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            let name = path.to_string_lossy();
            if cfg!(not(windows)) && name.contains('\\') {
                let parted = PathBuf::from(name.replace('\\', "/"));
                return Err(format!("no such file; `/` parts folders and files: {}", shown(&parted)));
            }
            // A name with an ending or a folder is a file's; any other may be a built-in scene's, mistyped
            if path.extension().is_some() || path.components().count() != 1 {
                return Err("no such file".into());
            }
            let (near, names) = scenes::near_and_all(&name);
            Err(format!("no such file, and no built-in scene; {near}built in are {names}"))
        }
        Err(e) => Err(e.to_string()),
        Ok(file) if file.metadata().is_ok_and(|meta| meta.is_dir()) => {
            Err("is a folder; name a scene file or a model".into())
        }
        Ok(file) => Ok(file),
    }
}

/// The first bytes of a file: enough to know what it is.
fn read_head(from: impl Read) -> Result<Vec<u8>, String> {
    let mut head = Vec::new();
    from.take(HEAD).read_to_end(&mut head).map_err(|e| e.to_string())?;
    Ok(head)
}

/// All bytes of a pipe: the text of a scene, or a model.
fn read_stream(mut from: impl Read) -> Result<Vec<u8>, String> {
    let head = read_head(&mut from)?;
    match binary_stl_length(&head) {
        _ if is_mesh(&head) => read_rest(head, from, MODEL_LIMIT),
        // With a byte more than it has by its own count, it is none
        Some(length) if head.contains(&0) && length <= MODEL_LIMIT => {
            let mut bytes = head;
            let rest = (length + 1).saturating_sub(bytes.len() as u64);
            from.take(rest).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
            Ok(bytes)
        }
        _ => read_rest(head, from, TEXT_LIMIT),
    }
}

/// All bytes of a file that begins with `head`, at most `limit` of them.
fn read_rest(head: Vec<u8>, from: impl Read, limit: u64) -> Result<Vec<u8>, String> {
    let mut bytes = head;
    // What is no text at all need not be read to its end: what it is, its beginning says
    if limit == TEXT_LIMIT && bytes.contains(&0) {
        return Ok(bytes);
    }
    let rest = (limit + 1).saturating_sub(bytes.len() as u64);
    from.take(rest).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    match bytes.len() as u64 {
        length if length <= limit => Ok(bytes),
        _ if limit == TEXT_LIMIT => Err(format!("is longer than {limit} bytes, the limit for scene text")),
        _ => Err(format!("is longer than {limit} bytes, the limit for a model in a pipe; save it as a file")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endless_text_is_refused() {
        assert!(read_stream(io::repeat(b' ')).is_err_and(|e| e.contains("67108864")));
        // What cannot be text is not read to its end
        assert!(read_stream(io::repeat(0)).is_ok_and(|bytes| bytes.len() as u64 == HEAD));
    }

    #[test]
    fn a_binary_stl_file_is_known_by_its_length() {
        let mut stl = vec![b'x'; 80];
        stl.extend(2000u32.to_le_bytes());
        stl.resize(84 + 50 * 2000, 0);
        let read = read_stream(stl.as_slice()).unwrap();
        assert!(is_mesh(&read) && read == stl);
        assert!(is_binary_stl(&stl[..HEAD as usize], stl.len() as u64));
        assert!(!is_binary_stl(&stl[..HEAD as usize], stl.len() as u64 + 1));
    }
}
