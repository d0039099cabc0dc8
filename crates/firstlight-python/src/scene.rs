//! Scenes: a description that Python reads, builds and changes, compiled when something is asked of it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use firstlight::{
    AaMode, Buffer, Compiled, NoAssets, Parsed, RenderSettings, SceneDesc, SceneError as Faults, ShapeDesc, Window,
    builtin_scenes,
};
use numpy::PyArray1;
use pyo3::exceptions::{PyKeyError, PyMemoryError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use serde_json::Value as Json;

use crate::error::{SceneWarning, diagnostics, did_you_mean, fault, scene_error};
use crate::files::{IN_MEMORY, SceneFiles, Source};
use crate::item::{Item, get, item_table, names, without_places};
use crate::meshes::NewMesh;
use crate::numbers::FAMILIES;
use crate::render::{PyRender, run};
use crate::shown::{self, ModelFile, Shown};
use crate::state::{Refused, State, Wanted};
use crate::value::tree;
use crate::{arrays, asked, pool, wanted};

/// No scene text is longer, in bytes.
const TEXT_LIMIT: u64 = 64 << 20;

/// What makes another scene of the same: its text, files, meshes, and how it is shown.
type Stored<'py> = (String, Bound<'py, PyDict>, Bound<'py, PyDict>, shown::Pickled<'py>);

/// A scene as `firstlight.Scene` builds on it.
#[pyclass(subclass, frozen, module = "firstlight._firstlight", name = "SceneBase")]
pub struct PyScene {
    state: Mutex<State>,
}

impl PyScene {
    /// Runs `f` on the state. Python's other threads run meanwhile, also while this one waits for its turn.
    fn with<R: Send>(&self, py: Python<'_>, f: impl FnOnce(&mut State) -> R + Send) -> R {
        pool::at_work(py, || f(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner)))
    }

    /// The compiled scene; what was put up with becomes warnings of Python, of the `level`-th caller.
    fn compiled(&self, py: Python<'_>, wanted: &Wanted, level: i32) -> PyResult<(Arc<Compiled>, Arc<SceneFiles>)> {
        let made = self.with(py, |state| {
            let made = state.compile(wanted);
            made.map(|(compiled, is_new)| (compiled, is_new, state.files.clone()))
        });
        let (compiled, is_new, files) = made.map_err(|faults| scene_error(py, &faults))?;
        if is_new {
            compiled.warnings.iter().try_for_each(|warning| warn(py, &warning.to_string(), level))?;
        }
        Ok((compiled, files))
    }

    /// Gives the advice about a scene that is rendered as warnings of Python, each once; that about light only where
    /// some of the buffers take light.
    fn advise(&self, py: Python<'_>, compiled: &Compiled, buffers: &[Buffer]) -> PyResult<()> {
        let is_lit = buffers.iter().any(|buffer| buffer.plane().is_lit());
        let advice = compiled.advice.iter().filter(|advice| is_lit || !advice.path.starts_with("light"));
        let advice: Vec<String> = advice.map(ToString::to_string).collect();
        if advice.is_empty() {
            return Ok(());
        }
        let new = self.with(py, |state| {
            advice.into_iter().filter(|text| state.told.insert(text.clone())).collect::<Vec<String>>()
        });
        new.iter().try_for_each(|text| warn(py, text, 1))
    }

    /// Takes a new description over; what is wrong with it is told at once, unless it is not complete yet.
    fn take(&self, py: Python<'_>, mut state: State) -> PyResult<()> {
        let desc = &state.parsed.desc;
        let is_complete = !desc.cameras.is_empty() || !desc.shapes.is_empty();
        if is_complete || !state.parsed.faults().is_empty() {
            let made = pool::at_work(py, || {
                let made = state.compile(&Wanted::default()).map(drop);
                (state, made)
            });
            state = made.0;
            made.1.map_err(|faults| scene_error(py, &faults))?;
            // So that they become warnings of the first call that needs them
            state.forget();
        }
        self.with(py, |own| *own = state);
        Ok(())
    }

    fn item(&self, py: Python<'_>, family: &str, number: usize) -> PyResult<Item> {
        let item = self.with(py, |state| {
            let index = state.numbers.index(family, number)?;
            get(&state.parsed.desc, family, index)
        });
        item.ok_or_else(|| removed(family))
    }
}

/// A warning of the `level`-th caller: 1 is the code that calls a method of this module, 2 who calls that code.
fn warn(py: Python<'_>, text: &str, level: i32) -> PyResult<()> {
    let text = std::ffi::CString::new(text).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<SceneWarning>(), &text, level)
}

/// Sees that a view and a margin are said of scenes without a camera alone.
fn refuse_framing(has_camera: bool, view: bool, margin: bool) -> PyResult<()> {
    match [("view", view), ("margin", margin)].iter().find(|(_, said)| *said && has_camera) {
        Some((word, _)) => {
            let message = "is for the camera that is found where there is none, and there is one; leave it out";
            Err(PyValueError::new_err(format!("{word} {message}, or the camera")))
        }
        None => Ok(()),
    }
}

/// What is said of a thing that is no more.
fn removed(family: &str) -> PyErr {
    PyKeyError::new_err(format!("the {family} was removed from the scene"))
}

/// What is said of a name that another thing has.
fn taken(py: Python<'_>, path: &str, name: &str) -> PyErr {
    let hint = "scene[name] leads to what has it, and del scene[name] removes that; or choose another name";
    fault(py, path, format!("the name {name:?} is taken"), Some(hint))
}

#[pymethods]
impl PyScene {
    #[new]
    fn new() -> Self {
        let files = SceneFiles::new(Source::Nothing, None, BTreeMap::new());
        PyScene { state: Mutex::new(State::of(Parsed::from(SceneDesc::default()), files)) }
    }

    /// Takes the scene of a file over, with the files of its folder.
    fn _load_file(&self, py: Python<'_>, path: PathBuf, allow_dirs: Vec<PathBuf>) -> PyResult<()> {
        // The kind of the system's error decides which exception it is
        let refused = |error: std::io::Error| {
            PyErr::from(std::io::Error::new(error.kind(), format!("{}: {error}", path.display())))
        };
        let length = std::fs::metadata(&path).map_err(refused)?.len();
        if length > TEXT_LIMIT {
            let message = format!("{}: has {length} bytes, the limit is {TEXT_LIMIT}", path.display());
            return Err(PyValueError::new_err(message));
        }
        let text = std::fs::read(&path).map_err(refused)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let own = path.canonicalize().ok();
        let files = SceneFiles::new(Source::folder(folder, &allow_dirs)?, own, BTreeMap::new());
        let name = path.display().to_string();
        let parsed = pool::at_work(py, || SceneDesc::parse(&name, &text, &files));
        self.take(py, State::of(parsed, files))
    }

    /// Takes the scene of a text over. `folder` is where its files lie; `files` are names and bytes.
    #[pyo3(signature = (text, name, folder = None, files = None))]
    fn _load_text(
        &self,
        py: Python<'_>,
        text: &str,
        name: &str,
        folder: Option<PathBuf>,
        files: Option<BTreeMap<String, Vec<u8>>>,
    ) -> PyResult<()> {
        let files = SceneFiles::given(folder, files)?;
        let parsed = pool::at_work(py, || SceneDesc::parse(name, text.as_bytes(), &files));
        self.take(py, State::of(parsed, files))
    }

    /// Takes a scene over that is a tree of dicts and lists.
    #[pyo3(signature = (scene, folder = None, files = None))]
    fn _load_tree(
        &self,
        py: Python<'_>,
        scene: &Bound<'_, PyDict>,
        folder: Option<PathBuf>,
        files: Option<BTreeMap<String, Vec<u8>>>,
    ) -> PyResult<()> {
        let text = tree(scene, "")?.to_string();
        let files = SceneFiles::given(folder, files)?;
        let parsed = pool::at_work(py, || SceneDesc::parse("scene.json", text.as_bytes(), &files));
        if !parsed.faults().is_empty() {
            return Err(scene_error(py, &Faults { faults: without_places(parsed.faults(), "") }));
        }
        // Without the places of a text that nobody wrote
        self.take(py, State::of(Parsed::from(parsed.desc), files))
    }

    /// Takes a scene over that shows a model: the file at `path`, or that of `files` called `name`. `words` say how.
    #[pyo3(signature = (path, name, words, folder, files, allow_dirs, view, margin))]
    #[allow(clippy::too_many_arguments, reason = "they are the arguments of Python")]
    fn _load_model(
        &self,
        py: Python<'_>,
        path: Option<PathBuf>,
        name: &str,
        words: &Bound<'_, PyDict>,
        folder: Option<PathBuf>,
        files: Option<BTreeMap<String, Vec<u8>>>,
        allow_dirs: Vec<PathBuf>,
        view: Option<&Bound<'_, PyAny>>,
        margin: Option<f64>,
    ) -> PyResult<()> {
        let studio = shown::settings(words)?;
        let (name, file, files) = match &path {
            Some(path) => {
                let refused = |error: std::io::Error| {
                    PyErr::from(std::io::Error::new(error.kind(), format!("{}: {error}", path.display())))
                };
                let own = path.canonicalize().map_err(refused)?;
                if own.is_dir() {
                    return Err(refused(std::io::ErrorKind::IsADirectory.into()));
                }
                let file = path.file_name().unwrap_or_default();
                let mut known = BTreeMap::new();
                let called = file.to_string_lossy().into_owned();
                // No text can say a name that is not UTF-8
                if file.to_str().is_none() {
                    known.insert(called.clone(), std::fs::read(path).map_err(refused)?.into());
                }
                let folder = Source::folder(path.parent().unwrap_or(Path::new("")), &allow_dirs)?;
                (path.display().to_string(), called, SceneFiles::new(folder, Some(own), known))
            }
            None => (name.to_owned(), name.to_owned(), SceneFiles::given(folder, files)?),
        };
        let mut state = State::of(Parsed::of_model(&name, &file, &studio), files);
        state.shown = Shown { studio: Some(studio), model: Some(ModelFile { name, file }), ..Shown::default() };
        state.shown.frame(view, margin)?;
        self.take(py, state)
    }

    /// Shows the scene in a studio: its settings become those of the studio, and the materials that it needs are added.
    /// Answers with fields of the models in it.
    #[pyo3(signature = (words, view, margin))]
    fn _use_studio<'py>(
        &self,
        py: Python<'py>,
        words: &Bound<'py, PyDict>,
        view: Option<&Bound<'py, PyAny>>,
        margin: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let fields = self._fields_in(py, words)?;
        let studio = if words.is_empty() { None } else { Some(shown::settings(words)?) };
        let (mut framed, has_camera) =
            self.with(py, |state| (state.shown.clone(), !state.parsed.desc.cameras.is_empty()));
        refuse_framing(has_camera, view.is_some(), margin.is_some())?;
        framed.frame(view, margin)?;
        self.with(py, |state| {
            state.shown.framing = framed.framing;
            state.change();
            if let Some(studio) = studio {
                state.use_studio(studio);
            }
        });
        Ok(fields)
    }

    /// The fields of models in a studio, without one if `words` is empty.
    fn _fields_in<'py>(&self, py: Python<'py>, words: &Bound<'py, PyDict>) -> PyResult<Bound<'py, PyDict>> {
        let fields = PyDict::new(py);
        let studio = if words.is_empty() { None } else { Some(shown::settings(words)?) };
        let model = studio.and_then(|studio| SceneDesc::of_model("", &studio).shapes.pop());
        let (lights, unlit, material) = match model {
            Some(ShapeDesc::Model(model)) => (model.lights, model.unlit, model.material),
            _ => (false, false, None),
        };
        fields.set_item("lights", lights)?;
        fields.set_item("unlit", unlit)?;
        fields.set_item("material", material)?;
        Ok(fields)
    }

    /// What the scene calls the file of a model.
    fn _find_model(&self, py: Python<'_>, path: &str) -> PyResult<String> {
        let files = self.with(py, |state| state.files.clone());
        files.model(path)
    }

    /// Takes a built-in scene over.
    fn _load_builtin(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        let scenes = builtin_scenes();
        let Some(scene) = scenes.iter().find(|scene| scene.name == name) else {
            let names: Vec<&str> = scenes.iter().map(|scene| scene.name).collect();
            let (all, hint) = (names.join(", "), did_you_mean(name, &names));
            return Err(PyKeyError::new_err(format!("no scene {name:?} is built in; there are {all}{hint}")));
        };
        let parsed = SceneDesc::parse(&format!("{name}.toml"), scene.text.as_bytes(), &NoAssets);
        self.take(py, State::of(parsed, SceneFiles::new(Source::Nothing, None, BTreeMap::new())))
    }

    /// Adds a thing; answers with its family and its number there.
    fn _add(
        &self,
        py: Python<'_>,
        family: &str,
        kind: &str,
        name: &str,
        fields: &Bound<'_, PyDict>,
    ) -> PyResult<(String, usize)> {
        let item = Item::read(family, kind, name, item_table(fields, kind)?);
        let item = item.map_err(|faults| scene_error(py, &faults))?;
        let name = item.name().unwrap_or_default();
        let added = self.with(py, |state| state.add(item));
        added.map(|number| (family.to_owned(), number)).ok_or_else(|| taken(py, kind, &name))
    }

    /// Adds a mesh of arrays: in a group of its own with an instance, or joined with others.
    #[pyo3(signature = (vertices, faces, *, normals, uv, colors, own, fields, r#static))]
    #[allow(clippy::too_many_arguments, reason = "they are the arguments of Python")]
    fn _add_mesh(
        &self,
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        uv: Option<&Bound<'_, PyAny>>,
        colors: Option<&Bound<'_, PyAny>>,
        own: &Bound<'_, PyDict>,
        fields: &Bound<'_, PyDict>,
        r#static: bool,
    ) -> PyResult<(String, usize)> {
        let data = arrays::mesh(vertices, faces, normals, uv, colors)?;
        let mesh = NewMesh::read(py, data, own, fields, r#static)?;
        let added = self.with(py, |state| mesh.add(state));
        added.map(|number| ("shape".to_owned(), number)).map_err(|name| taken(py, "mesh", &name))
    }

    /// The first thing of that name, of one family or of all: its family and its number there.
    #[pyo3(signature = (name, family = None))]
    fn _find(&self, py: Python<'_>, name: &str, family: Option<&str>) -> PyResult<(String, usize)> {
        if let Some(family) = family.filter(|family| !FAMILIES.contains(family)) {
            let hint = did_you_mean(family, &FAMILIES);
            return Err(PyValueError::new_err(format!("family is {family:?}; it is {}{hint}", FAMILIES.join(", "))));
        }
        let families = || FAMILIES.into_iter().filter(|own| family.is_none_or(|family| family == *own));
        let found = self.with(py, |state| {
            let named = |family: &'static str| Some((family.to_owned(), state.numbers.named(family, name)?));
            families().find_map(named).ok_or_else(|| {
                let desc = &state.parsed.desc;
                let all: Vec<Cow<'_, str>> = families().flat_map(|family| names(desc, family)).map(|n| n.1).collect();
                did_you_mean(name, &all.iter().map(AsRef::as_ref).collect::<Vec<_>>())
            })
        });
        found.map_err(|hint| PyKeyError::new_err(format!("nothing in the scene is called {name:?}{hint}")))
    }

    /// Whether the thing of a number is there.
    fn _has(&self, py: Python<'_>, family: &str, number: usize) -> bool {
        self.with(py, |state| state.numbers.index(family, number).is_some())
    }

    /// The family, kind and name of the thing of a number, and its table as JSON.
    fn _item(&self, py: Python<'_>, family: &str, number: usize) -> PyResult<(String, String, Option<String>, String)> {
        let item = self.item(py, family, number)?;
        let (family, kind, _) = item.words();
        let name = item.name().filter(|name| !name.is_empty());
        Ok((family.to_owned(), kind.to_owned(), name, Json::Object(item.table()).to_string()))
    }

    /// Changes fields of the thing of a number; one that is None goes back to its default.
    fn _update(&self, py: Python<'_>, family: &str, number: usize, fields: &Bound<'_, PyDict>) -> PyResult<()> {
        let item = self.item(py, family, number)?;
        let kind = item.words().1;
        let mut table = item_table(fields, kind)?;
        for (key, value) in fields.iter().filter(|(_, value)| value.is_none()) {
            drop(value);
            table.insert(key.extract()?, Json::Null);
        }
        let item = item.updated(table).map_err(|faults| scene_error(py, &faults))?;
        let name = item.name().unwrap_or_default();
        self.with(py, |state| state.replace(number, item)).map_err(|refused| match refused {
            Refused::Taken => taken(py, kind, &name),
            Refused::Removed => removed(family),
        })
    }

    /// Whether a thing of a family has that name.
    fn _is_taken(&self, py: Python<'_>, family: &str, name: &str) -> bool {
        self.with(py, |state| state.numbers.named(family, name).is_some())
    }

    /// How many things each family has.
    fn _counts(&self, py: Python<'_>) -> Vec<(&'static str, usize)> {
        self.with(py, |state| FAMILIES.into_iter().map(|family| (family, state.numbers.count(family))).collect())
    }

    /// Removes the thing of a number.
    fn _remove(&self, py: Python<'_>, family: &str, number: usize) -> PyResult<()> {
        if self.with(py, |state| state.remove(family, number)) { Ok(()) } else { Err(removed(family)) }
    }

    /// Removes all shapes, lights, cameras, materials and textures; `settings` stay.
    fn clear(&self, py: Python<'_>) {
        self.with(py, State::clear);
    }

    /// Keeps the bytes of a file and answers with the name that stands for it: that of its content, and `name`, which
    /// begins with `.` or `/`.
    fn _give_file(&self, py: Python<'_>, bytes: Vec<u8>, digest: &str, name: &str) -> String {
        let name = format!("{IN_MEMORY}{digest}{name}");
        self.with(py, |state| state.files.give(name.clone(), bytes));
        name
    }

    /// The transform of the thing of a number: three rows of four numbers.
    fn _transform(&self, py: Python<'_>, family: &str, number: usize, time: f64) -> PyResult<Vec<f64>> {
        match self.item(py, family, number)?.transform() {
            Some(transform) => Ok(transform.rows(time).map_err(|faults| scene_error(py, &faults))?.to_vec()),
            None => Ok(vec![1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
        }
    }

    /// The names of all things that have one, by family.
    fn _names<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let names = self.with(py, |state| {
            let of = |family| names(&state.parsed.desc, family).map(|(_, name)| name.into_owned());
            FAMILIES.into_iter().flat_map(of).filter(|name| !name.is_empty()).collect::<Vec<String>>()
        });
        PyList::new(py, names)
    }

    /// Checks the scene: what may surprise is returned, errors are raised.
    ///
    /// Returns
    /// -------
    /// list of Diagnostic
    ///     Warnings and advice.
    #[pyo3(signature = (*, time = None))]
    fn check<'py>(&self, py: Python<'py>, time: Option<f64>) -> PyResult<Bound<'py, PyList>> {
        let made = self.with(py, |state| state.compile(&Wanted { time, ..Wanted::default() }));
        let (compiled, _) = made.map_err(|faults| scene_error(py, &faults))?;
        diagnostics(py, &[&compiled.warnings[..], &compiled.advice].concat())
    }

    /// 64 hexadecimal digits that change with whatever may change the picture.
    #[getter]
    fn hash(&self, py: Python<'_>) -> PyResult<String> {
        Ok(self.compiled(py, &Wanted::default(), 1)?.0.scene.hash().to_owned())
    }

    /// The least and the greatest corner of the box around all shapes, in metres, world space; None without shapes.
    #[getter]
    fn bounds(&self, py: Python<'_>) -> PyResult<Option<[[f64; 3]; 2]>> {
        Ok(self.compiled(py, &Wanted::default(), 1)?.0.scene.summary().bounds)
    }

    /// The columns and rows of its picture.
    #[getter]
    fn size(&self, py: Python<'_>) -> (u32, u32) {
        self.with(py, |state| (state.parsed.desc.render.width, state.parsed.desc.render.height))
    }

    /// The scene as text in TOML. Meshes of arrays stand in it by a name, `memory:` and a hash; lights, ground and
    /// camera of a studio are those that it has in place.
    fn to_toml(&self, py: Python<'_>) -> String {
        self.with(py, |state| state.whole().to_toml())
    }

    /// The scene as text in JSON.
    fn to_json(&self, py: Python<'_>) -> String {
        self.with(py, |state| state.whole().to_json())
    }

    /// Renders the scene.
    ///
    /// Parameters
    /// ----------
    /// camera : str or Camera or dict, optional
    ///     The name of one of the scene's cameras, or another one; without it, the scene's own.
    /// width, height : int, optional
    ///     Columns and rows; one alone keeps the aspect ratio.
    /// buffers : str or list of str, optional
    ///     What to render, of `firstlight.BUFFERS`; without it, what the scene says, which is `["color"]` unless said.
    /// aa : int, optional
    ///     n of the n x n camera rays in each pixel.
    /// samples : "exact" or int, optional
    ///     Area lights are integrated, or sampled at so many points.
    /// tolerance : float, optional
    ///     How far a pixel may be off the converged picture, in steps of an 8-bit picture.
    /// aa_mode : {"adaptive", "full", "multisample"}, optional
    ///     Whether each surface in a pixel is lit as often as it needs, each camera ray by itself, or each smooth part
    ///     of a surface once. Without it, "multisample" in a studio, and else "adaptive".
    /// crop : tuple of int, optional
    ///     x, y, width and height of the part to render, in pixels from the upper left corner.
    /// time : float, optional
    ///     The moment, in seconds, of a scene with keys; 0 unless said. A model by itself plays its first animation
    ///     where a time is given, and is at rest otherwise.
    /// view : str or (float, float), optional
    ///     Where the camera looks from that is found for a scene without one: "front", "back", "left", "right", "top",
    ///     "bottom", "iso" or "three-quarter", or azimuth and elevation in degrees.
    /// margin : float, optional
    ///     What such a camera leaves free on each side, as a part of the picture's shorter side, 0 to 0.45.
    /// motion_to : float or str or Camera or dict, optional
    ///     Whereto the buffers `motion` and `motion-backward` lead: another moment, in seconds; "next" or "previous",
    ///     the frame after or before this one; one of the scene's cameras, or another one.
    /// threads : int
    ///     Threads to render with; 0 is one for each processor. It changes no bit.
    /// progress : callable, optional
    ///     Called as `progress(done, all)`, in pixels, now and then from this thread; what it raises stops the render.
    ///
    /// Returns
    /// -------
    /// Render
    ///     A mapping from the names of the buffers to arrays, row 0 at the top.
    #[pyo3(signature = (
        *, camera = None, width = None, height = None, buffers = None, aa = None, samples = None, tolerance = None,
        aa_mode = None, crop = None, time = None, view = None, margin = None, motion_to = None, threads = 0,
        progress = None
    ))]
    #[allow(clippy::too_many_arguments, reason = "they are the keyword arguments of Python")]
    fn render(
        &self,
        py: Python<'_>,
        camera: Option<&Bound<'_, PyAny>>,
        width: Option<u32>,
        height: Option<u32>,
        buffers: Option<&Bound<'_, PyAny>>,
        aa: Option<u32>,
        samples: Option<&Bound<'_, PyAny>>,
        tolerance: Option<f64>,
        aa_mode: Option<&str>,
        crop: Option<(u32, u32, u32, u32)>,
        time: Option<f64>,
        view: Option<&Bound<'_, PyAny>>,
        margin: Option<f64>,
        motion_to: Option<&Bound<'_, PyAny>>,
        threads: usize,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyRender> {
        let (is_in_studio, has_camera) =
            self.with(py, |state| (state.shown.studio.is_some(), !state.parsed.desc.cameras.is_empty()));
        let aa_mode = match aa_mode {
            // Nothing is compared with the picture of a model by itself: it is to be there soon
            None if is_in_studio => AaMode::Multisample,
            None => AaMode::Adaptive,
            Some(word) => AaMode::from_name(word).ok_or_else(|| {
                PyValueError::new_err(format!("aa_mode is {word:?}; it is \"adaptive\", \"full\" or \"multisample\""))
            })?,
        };
        refuse_framing(has_camera || camera.is_some(), view.is_some(), margin.is_some())?;
        let crop = crop.map(|(x, y, width, height)| Window { x, y, width, height });
        let threads = NonZeroUsize::new(threads);
        let mut wanted = wanted::wanted(py, camera, [width, height], aa, samples, tolerance, time)?;
        wanted.buffers = buffers.map(wanted::buffers).transpose()?;
        (wanted.view, wanted.margin) = (view.map(shown::view).transpose()?, margin.map(shown::margin).transpose()?);
        let (choice, there) = match motion_to.map(|to| wanted::motion_choice(py, to, wanted.size)).transpose()? {
            Some((choice, size)) => (Some(choice), size),
            None => (None, [None; 2]),
        };
        wanted.motion_to = choice;
        let (compiled, files) = self.compiled(py, &wanted, 1)?;
        let scene = &compiled.scene;
        if let ([Some(width), Some(height)], [w, h]) = (there, [scene.width(), scene.height()])
            && [width, height] != [w, h]
        {
            return Err(PyValueError::new_err(format!(
                "motion_to is a camera of {width} x {height} pixels, and the render has {w} x {h}; motion is in pixels \
                 of one size"
            )));
        }
        let buffers = scene.buffers().to_vec();
        if motion_to.is_some() && !buffers.iter().any(|buffer| buffer.plane().is_of_motion()) {
            let message = "motion_to is for the buffers motion and motion-backward, and neither is asked for";
            return Err(PyValueError::new_err(message));
        }
        let settings = RenderSettings { threads, crop, aa_mode, buffers, ..RenderSettings::default() };
        settings.check(scene).map_err(PyValueError::new_err)?;
        settings.check_memory(scene).map_err(PyMemoryError::new_err)?;
        self.advise(py, &compiled, &settings.buffers)?;
        let film = run(py, &compiled, &settings, progress)?;
        PyRender::new(py, film, compiled, &settings, files)
    }

    /// What rays meet, as a dict of arrays; `firstlight.Scene.cast` makes `Hits` of it.
    fn _cast<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        time: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let rays = asked::rays(origins, directions)?;
        let (compiled, _) = self.compiled(py, &Wanted { time, ..Wanted::default() }, 2)?;
        asked::cast(py, &compiled.scene, &rays)
    }

    /// The share of a light that points see.
    fn _visible<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        light: &Bound<'py, PyAny>,
        normals: Option<&Bound<'py, PyAny>>,
        time: Option<f64>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let places = asked::places(points, normals)?;
        let (compiled, _) = self.compiled(py, &Wanted { time, ..Wanted::default() }, 2)?;
        asked::visible(py, &compiled.scene, &places, light)
    }

    /// All that makes another scene of the same: its text, its files, its meshes, and how it is shown.
    fn _state<'py>(&self, py: Python<'py>) -> PyResult<Stored<'py>> {
        let (text, files, meshes, shown) = self.with(py, |state| {
            use firstlight::Assets;
            state.tidy();
            let (mut meshes, mut desc) = (Vec::new(), state.parsed.desc.clone());
            for file in desc.files_mut() {
                match state.cache.given_mesh(&file.0) {
                    Some(mesh) => meshes.push((file.0.clone(), mesh)),
                    // What cannot be read is said by who needs it
                    None => drop(state.files.read(&file.0, u64::MAX)),
                }
            }
            // What models name themselves is read with their parts
            if let Ok(mut parts) = state.parsed.desc.without_models(&*state.files, 0.0) {
                let pictures = parts.files_mut().filter(|file| !file.0.contains('#'));
                pictures.for_each(|file| drop(state.files.read(&file.0, u64::MAX)));
            }
            (state.parsed.desc.to_json(), state.files.all(), meshes, state.shown.clone())
        });
        let (by_name, of_meshes) = (PyDict::new(py), PyDict::new(py));
        for (name, bytes) in files {
            by_name.set_item(name, PyBytes::new(py, &bytes))?;
        }
        for (name, mesh) in meshes {
            of_meshes.set_item(name, arrays::stored(py, &mesh)?)?;
        }
        Ok((text, by_name, of_meshes, shown.pickled(py)?))
    }

    /// Becomes the scene of such a state.
    fn _restore(
        &self,
        py: Python<'_>,
        text: &str,
        files: BTreeMap<String, Vec<u8>>,
        meshes: &Bound<'_, PyDict>,
        shown: shown::Pickled<'_>,
    ) -> PyResult<()> {
        let shown = Shown::restored(shown)?;
        let known = files.into_iter().map(|(name, bytes)| (name, bytes.into())).collect();
        let files = SceneFiles::new(Source::Nothing, None, known);
        let parsed = SceneDesc::parse("scene.json", text.as_bytes(), &files);
        if !parsed.faults().is_empty() {
            return Err(scene_error(py, &Faults { faults: parsed.faults().to_vec() }));
        }
        let of_model = shown.studio.as_ref().and_then(|studio| shown.with(&parsed.desc, studio));
        let mut state = State::of(of_model.unwrap_or_else(|| Parsed::from(parsed.desc)), files);
        state.shown = shown;
        for (_, mesh) in meshes.iter() {
            let mesh = arrays::restored(mesh.cast::<PyDict>()?)?;
            if !mesh.faults().is_empty() {
                return Err(scene_error(py, &Faults { faults: mesh.faults() }));
            }
            state.cache.give_mesh(mesh);
        }
        self.with(py, |own| *own = state);
        Ok(())
    }
}
