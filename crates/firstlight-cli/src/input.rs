//! Where a scene comes from: a file, standard input, or the program itself.

use std::collections::HashMap;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use firstlight::{
    AssetError, Assets, CompileOptions, Compiled, FolderAssets, Framing, ModelSettings, NoAssets, Parsed, SceneDesc,
    UpAxis, builtin_scenes, is_point_set,
};

use crate::args::{Axis, ReadingArgs};
use crate::output::Names;
use crate::progress::loading;
use crate::report::{Failure, say, shown};
use crate::scenes;

/// No scene text is longer, in bytes. Meshes and pictures are files of their own.
const TEXT_LIMIT: u64 = 64 << 20;

/// A scene that was read, and what is needed to compile it.
pub struct Input {
    /// What messages call it: the path as written, the built-in name, `<stdin>` or `<stdin>.json`.
    pub name: String,
    /// The description, and the faults of its text.
    pub parsed: Parsed,
    /// Whether it is a model by itself, for which a camera and a light are found.
    pub is_model: bool,
    /// The scene's or model's own file, as it was named; standard input may be one too.
    own: Option<PathBuf>,
    /// The folder that the names of its files start at; a built-in scene has none.
    pub folder: Option<PathBuf>,
    /// How a camera that is found for it frames what it sees.
    pub framing: Framing,
    assets: Remembered,
    strict: bool,
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
    if is_model(scene) {
        return read_model(scene, reading);
    }
    refuse_options_of_models(scene, reading)?;
    let (name, text, folder) = if scene == "-" {
        let text = read_limited(io::stdin().lock()).map_err(|why| Failure::Work(format!("standard input: {why}")))?;
        // A name tells JSON from TOML; no TOML begins with a brace. A byte order mark is no part of the text
        let marked = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text);
        let json = marked.trim_ascii_start().starts_with(b"{");
        let name = if json { "<stdin>.json" } else { "<stdin>" };
        (name.to_owned(), text, Some(PathBuf::new()))
    } else if let Some(builtin) = builtin_scenes().iter().find(|builtin| scene == builtin.name) {
        (builtin.name.to_owned(), builtin.text.as_bytes().to_vec(), None)
    } else {
        let name = scene.display().to_string();
        let text = read_file(scene).map_err(|why| Failure::Work(format!("{}: {why}", shown(scene))))?;
        (name, text, Some(scene.parent().map(Path::to_path_buf).unwrap_or_default()))
    };

    // A scene reads its own folder; a built-in scene has none
    let allowed = |folder: &Path| {
        FolderAssets::new(folder, &reading.allow_dir)
            .map_err(|(path, e)| Failure::Work(format!("--allow-dir: {}: {e}", shown(&path))))
    };
    let assets = Remembered::new(folder.as_deref().map(allowed).transpose()?);
    let parsed = SceneDesc::parse(&name, &text, &assets);
    let stdin = || cfg!(unix).then(|| PathBuf::from("/dev/stdin"));
    let own = if scene == "-" { stdin() } else { file_of(scene).map(Path::to_path_buf) };
    let framing = Framing::default();
    Ok(Input { name, parsed, is_model: false, own, folder, framing, assets, strict: reading.strict })
}

/// Sees that options for models are said of models only.
///
/// # Errors
/// `scene` is none.
pub fn refuse_options_of_models(scene: &Path, reading: &ReadingArgs) -> Result<(), Failure> {
    for (option, said) in [("--smooth", reading.smooth.is_some()), ("--up", reading.up.is_some())] {
        if said && !is_model(scene) {
            let scene = shown(scene);
            return Err(Failure::Usage(format!("{option} is for models, and {scene} is none (.ply, .stl, .obj)")));
        }
    }
    Ok(())
}

/// Whether `scene` names a model, by its ending.
fn is_model(scene: &Path) -> bool {
    let ending = scene.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    matches!(ending.as_deref(), Some("ply" | "stl" | "obj"))
}

/// A scene around a model.
fn read_model(path: &Path, reading: &ReadingArgs) -> Result<Input, Failure> {
    let work = |why: String| Failure::Work(format!("{}: {why}", shown(path)));
    // Enough of it to tell points from faces
    let mut head = Vec::new();
    match File::open(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Err(work("no such file".into())),
        Err(e) => return Err(work(e.to_string())),
        Ok(file) if file.metadata().is_ok_and(|meta| meta.is_dir()) => return Err(work("is a folder".into())),
        Ok(file) => file.take(1 << 16).read_to_end(&mut head).map_err(|e| work(e.to_string()))?,
    };
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    let assets = FolderAssets::new(&folder, &reading.allow_dir)
        .map_err(|(path, e)| Failure::Work(format!("--allow-dir: {}: {e}", shown(&path))))?;
    let settings = ModelSettings {
        smooth_deg: reading.smooth,
        up: if reading.up == Some(Axis::Z) { UpAxis::Z } else { UpAxis::Y },
        points: is_point_set(&head),
    };
    let file = PathBuf::from(path.file_name().unwrap_or_default());
    let called = file.to_string_lossy().into_owned();
    Ok(Input {
        name: path.display().to_string(),
        parsed: SceneDesc::of_model(&called, &settings).into(),
        is_model: true,
        folder: Some(folder),
        framing: Framing::default(),
        own: Some(path.to_path_buf()),
        assets: Remembered { model: Some((called, file)), ..Remembered::new(Some(assets)) },
        strict: reading.strict,
    })
}

/// The file that `scene` names; none for standard input and built-in scenes.
pub fn file_of(scene: &Path) -> Option<&Path> {
    let is_file = scene != "-" && !builtin_scenes().iter().any(|builtin| scene == builtin.name);
    is_file.then_some(scene)
}

/// What the placeholders in the names of its outputs stand for.
pub fn names_of(scene: &Path) -> Names {
    let builtin_or_stdin = file_of(scene).is_none();
    let whole = |part: Option<&OsStr>| part.map_or_else(|| OsString::from("scene"), OsStr::to_owned);
    if scene == "-" {
        return Names { stem: whole(None), name: whole(None) };
    }
    let name = whole(scene.file_name());
    Names { stem: if builtin_or_stdin { name.clone() } else { whole(scene.file_stem()) }, name }
}

/// No course file that anybody writes is longer, in bytes.
const COURSE_LIMIT: u64 = 1 << 16;

/// The `output_file` that a course file names; `None` for all other scenes, and for what cannot be read.
pub fn course_output(scene: &Path) -> Option<String> {
    let file = file_of(scene).filter(|file| !is_model(file))?;
    let is_short = file.metadata().is_ok_and(|meta| meta.is_file() && meta.len() <= COURSE_LIMIT);
    let text = if is_short { read_file(file).ok()? } else { return None };
    SceneDesc::parse(&file.display().to_string(), &text, &NoAssets).output
}

impl Input {
    /// Says that a camera was found, where a scene's text has none; a model never has one.
    pub fn tell_added(&self, compiled: &Compiled) {
        if compiled.added.camera.is_some() && !self.is_model {
            let name = &self.name;
            say(format_args!(
                "note: {name} has no camera; one was found that sees all of it (--view, --margin, --print-scene)"
            ));
        }
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

    /// Compiles the description as it is now, at `time` in seconds. Files are read the first time only: a scene has the same
    /// textures in all its frames. What takes its time is told, unless `quiet`.
    ///
    /// # Errors
    /// Every fault of text and meaning.
    pub fn compile(&self, time: f64, quiet: bool) -> Result<Compiled, Failure> {
        let progress = (!quiet).then(loading);
        let options =
            CompileOptions { strict: self.strict, time, framing: self.framing, light: self.is_model, progress };
        self.parsed.compile(&self.assets, &options).map_err(|e| Failure::Scene(e.faults))
    }
}

fn read_file(path: &Path) -> Result<Vec<u8>, String> {
    match File::open(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            // A name with an ending or a folder is a file's; any other may be a built-in scene's, mistyped
            if path.extension().is_some() || path.components().count() != 1 {
                return Err("no such file".into());
            }
            let (near, names) = scenes::near_and_all(&path.to_string_lossy());
            Err(format!("no such file, and no built-in scene; {near}built in are {names}"))
        }
        Err(e) => Err(e.to_string()),
        Ok(file) if file.metadata().is_ok_and(|meta| meta.is_dir()) => Err("is a folder; name a scene file".into()),
        Ok(file) => read_limited(file),
    }
}

fn read_limited(from: impl Read) -> Result<Vec<u8>, String> {
    let mut text = Vec::new();
    from.take(TEXT_LIMIT + 1).read_to_end(&mut text).map_err(|e| e.to_string())?;
    if text.len() as u64 > TEXT_LIMIT {
        return Err(format!("is longer than {TEXT_LIMIT} bytes, the limit for scene text"));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endless_text_is_refused() {
        assert!(read_limited(io::repeat(b' ')).is_err_and(|e| e.contains("67108864")));
    }
}
