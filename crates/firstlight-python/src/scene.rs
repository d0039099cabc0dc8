//! Scenes: a description that Python reads, builds and changes, compiled when something is asked of it.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use firstlight::{
    AaMode, BufferDesc, Compiled, DVec3, Film, GroupDesc, InstanceDesc, MeshDesc, MotionTo, NoAssets, Parsed, Plane,
    RenderSettings, SamplesDesc, SceneDesc, SceneError as Faults, ShapeDesc, Vec3, Window, WorldRay, builtin_scenes,
};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::{PyKeyError, PyMemoryError, PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use serde_json::{Map, Value as Json};

use crate::arrays;
use crate::error::{SceneWarning, diagnostics, fault, scene_error};
use crate::files::{SceneFiles, Source};
use crate::item::{Item, find, get, item_table, push, set, without_places};
use crate::render::{PyRender, run};
use crate::state::{CameraChoice, MotionChoice, State, Wanted};
use crate::value::tree;

/// No scene text is longer, in bytes.
const TEXT_LIMIT: u64 = 64 << 20;

/// A scene as `firstlight.Scene` builds on it.
#[pyclass(subclass, frozen, module = "firstlight._firstlight", name = "SceneBase")]
pub struct PyScene {
    state: Mutex<State>,
}

impl PyScene {
    /// Runs `f` on the state. Python's other threads run meanwhile, also while this one waits for its turn.
    fn with<R: Send>(&self, py: Python<'_>, f: impl FnOnce(&mut State) -> R + Send) -> R {
        py.detach(|| f(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner)))
    }

    /// The compiled scene; what was put up with becomes warnings of Python.
    fn compiled(&self, py: Python<'_>, wanted: &Wanted) -> PyResult<(Arc<Compiled>, Arc<SceneFiles>)> {
        let made = self.with(py, |state| {
            let made = state.compile(wanted);
            made.map(|(compiled, is_new)| (compiled, is_new, state.files.clone()))
        });
        let (compiled, is_new, files) = made.map_err(|faults| scene_error(py, &faults))?;
        if is_new {
            for warning in &compiled.warnings {
                let text = std::ffi::CString::new(warning.to_string()).unwrap_or_default();
                PyErr::warn(py, &py.get_type::<SceneWarning>(), &text, 2)?;
            }
        }
        Ok((compiled, files))
    }

    /// Takes a new description over; what is wrong with it is told at once, unless it is not complete yet.
    fn take(&self, py: Python<'_>, mut state: State) -> PyResult<()> {
        let desc = &state.parsed.desc;
        let is_complete = !desc.cameras.is_empty() || !desc.shapes.is_empty();
        if is_complete || !state.parsed.faults().is_empty() {
            let made = py.detach(|| {
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

    /// What a call says of the camera and the picture.
    #[allow(clippy::too_many_arguments, reason = "they are the keyword arguments of Python")]
    fn wanted(
        py: Python<'_>,
        camera: Option<&Bound<'_, PyAny>>,
        mut size: [Option<u32>; 2],
        antialiasing: Option<u32>,
        samples: Option<&Bound<'_, PyAny>>,
        tolerance: Option<f64>,
        time: f64,
    ) -> PyResult<Wanted> {
        let camera = camera.map(|camera| camera_choice(py, "camera", camera, &mut size)).transpose()?;
        let samples = match samples {
            None => None,
            Some(word) if word.extract::<String>().is_ok_and(|word| word == "exact") => Some(SamplesDesc::Exact),
            Some(count) => Some(SamplesDesc::Count(count.extract::<u32>().map_err(|_| {
                PyValueError::new_err(format!("samples is {count}; \"exact\" or a whole number is wanted"))
            })?)),
        };
        Ok(Wanted { camera, size, antialiasing, samples, tolerance, time, ..Wanted::default() })
    }

    /// The scene as a camera sees it, and the objects that the middles of the pixels meet.
    pub fn film_of_objects(
        &self,
        py: Python<'_>,
        camera: Option<&Bound<'_, PyAny>>,
        size: [Option<u32>; 2],
        time: f64,
    ) -> PyResult<(Arc<Compiled>, Film)> {
        let mut wanted = Self::wanted(py, camera, size, None, None, None, time)?;
        let buffers = vec![Plane::ObjectId.into()];
        wanted.buffers = Some(vec![Plane::ObjectId.into()]);
        let (compiled, _) = self.compiled(py, &wanted)?;
        let settings = RenderSettings { buffers, ..RenderSettings::default() };
        settings.check_memory(&compiled.scene).map_err(PyMemoryError::new_err)?;
        let film = run(py, &compiled.scene, &settings, None)?;
        Ok((compiled, film))
    }

    fn item(&self, py: Python<'_>, family: &str, index: usize) -> PyResult<Item> {
        let item = self.with(py, |state| get(&state.parsed.desc, family, index));
        item.ok_or_else(|| PyKeyError::new_err(format!("the scene has no such {family} any more")))
    }
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
        let parsed = py.detach(|| SceneDesc::parse(&name, &text, &files));
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
        let parsed = py.detach(|| SceneDesc::parse(name, text.as_bytes(), &files));
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
        let parsed = py.detach(|| SceneDesc::parse("scene.json", text.as_bytes(), &files));
        if !parsed.faults().is_empty() {
            return Err(scene_error(py, &Faults { faults: without_places(parsed.faults(), "") }));
        }
        // Without the places of a text that nobody wrote
        self.take(py, State::of(Parsed::from(parsed.desc), files))
    }

    /// Takes a built-in scene over.
    fn _load_builtin(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        let scenes = builtin_scenes();
        let Some(scene) = scenes.iter().find(|scene| scene.name == name) else {
            let names: Vec<&str> = scenes.iter().map(|scene| scene.name).collect();
            return Err(PyKeyError::new_err(format!("no scene {name:?} is built in; there are {}", names.join(", "))));
        };
        let parsed = SceneDesc::parse(&format!("{name}.toml"), scene.text.as_bytes(), &NoAssets);
        self.take(py, State::of(parsed, SceneFiles::new(Source::Nothing, None, BTreeMap::new())))
    }

    /// Adds a thing; answers with its family and its index there.
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
        let added = self.with(py, |state| {
            let desc = &mut state.parsed.desc;
            let is_taken = match family {
                "camera" => desc.cameras.iter().any(|(own, _)| own == name),
                "material" => desc.materials.iter().any(|(own, _)| own == name),
                "texture" => desc.textures.iter().any(|(own, _)| own == name),
                _ => false,
            };
            if is_taken {
                return None;
            }
            let index = match family {
                "camera" => desc.cameras.len(),
                "material" => desc.materials.len(),
                "texture" => desc.textures.len(),
                "light" => desc.lights.len(),
                _ => desc.shapes.len(),
            };
            push(desc, item);
            state.change();
            Some(index)
        });
        let is_taken = || fault(py, family, format!("the name {name:?} is taken"), Some("scene[name] leads to it"));
        added.map(|index| (family.to_owned(), index)).ok_or_else(is_taken)
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
        let mesh = arrays::mesh(vertices, faces, normals, uv, colors)?;
        let faults = py.detach(|| mesh.faults());
        if !faults.is_empty() {
            // By the names that Python has for the lists
            let words = [("positions", "vertices"), ("triangles", "faces"), ("uvs", "uv")];
            let renamed = faults.into_iter().map(|mut fault| {
                for (from, to) in words {
                    if let Some(rest) = fault.path.strip_prefix(from) {
                        fault.path = format!("{to}{rest}");
                        break;
                    }
                }
                fault
            });
            return Err(scene_error(py, &Faults { faults: renamed.collect() }));
        }
        let read = |kind: &str, table: Map<String, Json>| match Item::read("shape", kind, "", table) {
            Ok(Item::Shape(shape)) => Ok(shape),
            Ok(_) => unreachable!("it was read as a shape"),
            Err(mut faults) => {
                for fault in &mut faults.faults {
                    if let Some(rest) = fault.path.strip_prefix(kind) {
                        fault.path = format!("mesh{rest}");
                    }
                }
                Err(scene_error(py, &faults))
            }
        };
        let (mut own, mut outer) = (item_table(own, "mesh")?, item_table(fields, "mesh")?);
        own.insert("file".into(), "memory:".into());
        if r#static {
            own.append(&mut outer);
        } else {
            outer.insert("of".into(), "".into());
        }
        let ShapeDesc::Mesh(own) = read("mesh", own)? else { unreachable!("it was read as a mesh") };
        let outer = if r#static { None } else { Some(read("instance", outer)?) };
        Ok(self.with(py, |state| {
            let file = Some(state.cache.give_mesh(mesh).into());
            let shape = ShapeDesc::Mesh(MeshDesc { file, ..own });
            let desc = &mut state.parsed.desc;
            let shape = match outer {
                Some(ShapeDesc::Instance(instance)) => {
                    // A group that nothing else is called like
                    let mut number = desc.groups.len();
                    let name = loop {
                        let name = format!("mesh-{number}");
                        if desc.groups.iter().all(|(other, _)| *other != name) {
                            break name;
                        }
                        number += 1;
                    };
                    desc.groups.push((name.clone(), GroupDesc { shapes: vec![shape] }));
                    ShapeDesc::Instance(InstanceDesc { of: name, ..instance })
                }
                _ => shape,
            };
            desc.shapes.push(shape);
            state.change();
            ("shape".to_owned(), state.parsed.desc.shapes.len() - 1)
        }))
    }

    /// The first thing of that name: its family and its index there.
    fn _find(&self, py: Python<'_>, name: &str) -> PyResult<(String, usize)> {
        let found = self.with(py, |state| find(&state.parsed.desc, name));
        found
            .map(|(family, index)| (family.to_owned(), index))
            .ok_or_else(|| PyKeyError::new_err(format!("nothing in the scene is called {name:?}")))
    }

    /// The family, kind and name of the thing at a place, and its table as JSON.
    fn _item(&self, py: Python<'_>, family: &str, index: usize) -> PyResult<(String, String, Option<String>, String)> {
        let item = self.item(py, family, index)?;
        let (family, kind, name) = item.words();
        let table = item.table();
        let own = table.get("name").and_then(Json::as_str).map(str::to_owned);
        let name = own.or_else(|| (!name.is_empty()).then(|| name.to_owned()));
        Ok((family.to_owned(), kind.to_owned(), name, Json::Object(table).to_string()))
    }

    /// Changes fields of the thing at a place; one that is None goes back to its default.
    fn _update(&self, py: Python<'_>, family: &str, index: usize, fields: &Bound<'_, PyDict>) -> PyResult<()> {
        let item = self.item(py, family, index)?;
        let mut table = item_table(fields, item.words().1)?;
        for (key, value) in fields.iter().filter(|(_, value)| value.is_none()) {
            drop(value);
            table.insert(key.extract()?, Json::Null);
        }
        let item = item.updated(table).map_err(|faults| scene_error(py, &faults))?;
        self.with(py, |state| {
            set(&mut state.parsed, index, item);
            state.change();
        });
        Ok(())
    }

    /// The transform of the thing at a place: three rows of four numbers.
    fn _transform(&self, py: Python<'_>, family: &str, index: usize, time: f64) -> PyResult<Vec<f64>> {
        match self.item(py, family, index)?.transform() {
            Some(transform) => Ok(transform.rows(time).map_err(|faults| scene_error(py, &faults))?.to_vec()),
            None => Ok(vec![1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
        }
    }

    /// The names of all things that have one, by family.
    fn _names<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let names = self.with(py, |state| {
            let desc = &state.parsed.desc;
            let shapes = desc.shapes.iter().filter_map(|shape| shape.name().map(str::to_owned));
            let lights = desc.lights.iter().filter_map(|light| light.name());
            let cameras = desc.cameras.iter().map(|(name, _)| name.clone()).filter(|name| !name.is_empty());
            let materials = desc.materials.iter().map(|(name, _)| name.clone());
            let textures = desc.textures.iter().map(|(name, _)| name.clone());
            shapes.chain(lights).chain(cameras).chain(materials).chain(textures).collect::<Vec<String>>()
        });
        PyList::new(py, names)
    }

    /// Checks the scene: what may surprise is returned, errors are raised.
    ///
    /// Returns
    /// -------
    /// list of Diagnostic
    ///     Warnings and advice.
    #[pyo3(signature = (*, time = 0.0))]
    fn check<'py>(&self, py: Python<'py>, time: f64) -> PyResult<Bound<'py, PyList>> {
        let made = self.with(py, |state| state.compile(&Wanted { time, ..Wanted::default() }));
        let (compiled, _) = made.map_err(|faults| scene_error(py, &faults))?;
        diagnostics(py, &[&compiled.warnings[..], &compiled.advice].concat())
    }

    /// 64 hexadecimal digits that change with whatever may change the picture.
    #[getter]
    fn hash(&self, py: Python<'_>) -> PyResult<String> {
        Ok(self.compiled(py, &Wanted::default())?.0.scene.hash().to_owned())
    }

    /// The least and the greatest corner of the box around all shapes, in metres, world space; None without shapes.
    #[getter]
    fn bounds(&self, py: Python<'_>) -> PyResult<Option<[[f64; 3]; 2]>> {
        Ok(self.compiled(py, &Wanted::default())?.0.scene.summary().bounds)
    }

    /// The columns and rows of its picture.
    #[getter]
    fn size(&self, py: Python<'_>) -> (u32, u32) {
        self.with(py, |state| (state.parsed.desc.render.width, state.parsed.desc.render.height))
    }

    /// The scene as text in TOML. Meshes of arrays stand in it by a name, `memory:` and a hash.
    fn to_toml(&self, py: Python<'_>) -> String {
        self.with(py, |state| state.parsed.desc.to_toml())
    }

    /// The scene as text in JSON.
    fn to_json(&self, py: Python<'_>) -> String {
        self.with(py, |state| state.parsed.desc.to_json())
    }

    /// Renders the scene.
    ///
    /// Parameters
    /// ----------
    /// camera : str or Camera or dict, optional
    ///     The name of one of the scene's cameras, or another one; without it, the scene's own.
    /// width, height : int, optional
    ///     Columns and rows; one alone keeps the aspect ratio.
    /// buffers : list of str, optional
    ///     What to render, of `firstlight.BUFFERS`; without it, what the scene says, which is `["color"]` unless said.
    /// aa : int, optional
    ///     n of the n x n camera rays in each pixel.
    /// samples : "exact" or int, optional
    ///     Area lights are integrated, or sampled at so many points.
    /// tolerance : float, optional
    ///     How far a pixel may be off the converged picture, in steps of an 8-bit picture.
    /// aa_mode : {"adaptive", "full"}
    ///     Whether each surface in a pixel is lit as often as it needs, or each camera ray by itself.
    /// crop : tuple of int, optional
    ///     x, y, width and height of the part to render, in pixels from the upper left corner.
    /// time : float
    ///     The moment, in seconds, of a scene with keys.
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
        aa_mode = "adaptive", crop = None, time = 0.0, motion_to = None, threads = 0, progress = None
    ))]
    #[allow(clippy::too_many_arguments, reason = "they are the keyword arguments of Python")]
    fn render(
        &self,
        py: Python<'_>,
        camera: Option<&Bound<'_, PyAny>>,
        width: Option<u32>,
        height: Option<u32>,
        buffers: Option<Vec<String>>,
        aa: Option<u32>,
        samples: Option<&Bound<'_, PyAny>>,
        tolerance: Option<f64>,
        aa_mode: &str,
        crop: Option<(u32, u32, u32, u32)>,
        time: f64,
        motion_to: Option<&Bound<'_, PyAny>>,
        threads: usize,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyRender> {
        let Some(aa_mode) = AaMode::from_name(aa_mode) else {
            return Err(PyValueError::new_err(format!("aa_mode is {aa_mode:?}; it is \"adaptive\" or \"full\"")));
        };
        let crop = crop.map(|(x, y, width, height)| Window { x, y, width, height });
        let threads = NonZeroUsize::new(threads);
        let mut wanted = Self::wanted(py, camera, [width, height], aa, samples, tolerance, time)?;
        let asked = buffers.map(|names| names.iter().map(|name| buffer(name)).collect::<PyResult<_>>());
        wanted.buffers = asked.transpose()?;
        let (choice, there) = match motion_to.map(|to| motion_choice(py, to, wanted.size)).transpose()? {
            Some((choice, size)) => (Some(choice), size),
            None => (None, [None; 2]),
        };
        wanted.motion_to = choice;
        let (compiled, files) = self.compiled(py, &wanted)?;
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
        let film = run(py, scene, &settings, progress)?;
        PyRender::new(py, film, scene, &settings, files)
    }

    /// What rays meet, as a dict of arrays; `firstlight.Scene.cast` makes `Hits` of it.
    fn _cast<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        time: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (origins, directions) = (arrays::points(origins, "origins")?, arrays::points(directions, "directions")?);
        let count = origins.len();
        if directions.len() != count {
            let message = format!("{count} origins and {} directions", directions.len());
            return Err(PyValueError::new_err(message));
        }
        let mut rays = Vec::with_capacity(count);
        for (i, (o, d)) in origins.iter().zip(&directions).enumerate() {
            let (o, unit) = (DVec3::from(*o), DVec3::from(*d).normalize_or_zero());
            if !o.is_finite() || unit == DVec3::ZERO {
                return Err(PyValueError::new_err(format!("ray {i} has no direction, or a number that is not finite")));
            }
            rays.push(WorldRay { o, d: unit.as_vec3() });
        }
        let (compiled, _) = self.compiled(py, &Wanted { time, ..Wanted::default() })?;
        let hits = py.detach(|| compiled.scene.cast(count, |i| rays[i]));
        let dict = PyDict::new(py);
        let numbers =
            |of: &dyn Fn(&firstlight::CastHit) -> u32| hits.iter().map(|h| h.as_ref().map_or(0, of)).collect();
        let vectors = |of: &dyn Fn(&firstlight::CastHit) -> [f32; 3]| -> PyResult<Bound<'py, PyAny>> {
            let list: Vec<[f32; 3]> = hits.iter().map(|hit| hit.as_ref().map_or([0.0; 3], of)).collect();
            Ok(PyArray1::from_vec(py, list.into_flattened()).reshape([count, 3])?.into_any())
        };
        let pairs = |of: &dyn Fn(&firstlight::CastHit) -> [f32; 2]| -> PyResult<Bound<'py, PyAny>> {
            let list: Vec<[f32; 2]> = hits.iter().map(|hit| hit.as_ref().map_or([0.0; 2], of)).collect();
            Ok(PyArray1::from_vec(py, list.into_flattened()).reshape([count, 2])?.into_any())
        };
        let distances: Vec<f64> = hits.iter().map(|hit| hit.as_ref().map_or(f64::INFINITY, |hit| hit.t)).collect();
        let places: Vec<[f64; 3]> = hits.iter().map(|hit| hit.as_ref().map_or([0.0; 3], |h| h.p.to_array())).collect();
        dict.set_item("hit", PyArray1::from_vec(py, hits.iter().map(Option::is_some).collect::<Vec<bool>>()))?;
        dict.set_item("distance", PyArray1::from_vec(py, distances))?;
        dict.set_item("position", PyArray1::from_vec(py, places.into_flattened()).reshape([count, 3])?)?;
        dict.set_item("normal", vectors(&|hit| hit.ns.to_array())?)?;
        dict.set_item("normal_geometric", vectors(&|hit| hit.ng.to_array())?)?;
        dict.set_item("uv", pairs(&|hit| hit.uv.to_array())?)?;
        dict.set_item("barycentric", pairs(&|hit| hit.barycentric.to_array())?)?;
        dict.set_item("object_id", PyArray1::<u32>::from_vec(py, numbers(&|hit| hit.surface.0 + 1)))?;
        let material = numbers(&|hit| hit.material.map_or(0, |material| material.0 + 1));
        dict.set_item("material_id", PyArray1::<u32>::from_vec(py, material))?;
        let primitive = numbers(&|hit| hit.primitive.map_or(0, |primitive| primitive + 1));
        dict.set_item("primitive_id", PyArray1::<u32>::from_vec(py, primitive))?;
        Ok(dict)
    }

    /// The share of a light that points see.
    fn _visible<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        light: &Bound<'py, PyAny>,
        normals: Option<&Bound<'py, PyAny>>,
        time: f64,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let points = arrays::points(points, "points")?;
        let normals = normals.map(|normals| arrays::points(normals, "normals")).transpose()?;
        if let Some(normals) = normals.as_ref().filter(|normals| normals.len() != points.len()) {
            return Err(PyValueError::new_err(format!("{} points and {} normals", points.len(), normals.len())));
        }
        if points.iter().flatten().chain(normals.iter().flatten().flatten()).any(|number| !number.is_finite()) {
            return Err(PyValueError::new_err("points, normals: there are numbers that are not finite"));
        }
        let (compiled, _) = self.compiled(py, &Wanted { time, ..Wanted::default() })?;
        let scene = &compiled.scene;
        let names: Vec<Option<&str>> = scene.summary().lights.iter().map(|(_, name, _)| name.as_deref()).collect();
        let index = match light.extract::<String>() {
            Ok(name) => names.iter().position(|own| *own == Some(&name)),
            Err(_) => Some(light.extract::<usize>()?).filter(|index| *index < names.len()),
        };
        let Some(id) = index.and_then(|index| scene.lights().nth(index)) else {
            let named: Vec<&str> = names.iter().copied().flatten().collect();
            let message = format!("no light {light}; the scene has {}, named {}", names.len(), named.join(", "));
            return Err(PyKeyError::new_err(message));
        };
        let normal = |i: usize| normals.as_ref().map(|list| DVec3::from(list[i]).normalize_or_zero().as_vec3());
        let seen = |i: usize| (DVec3::from(points[i]), normal(i).filter(|n: &Vec3| *n != Vec3::ZERO));
        Ok(PyArray1::from_vec(py, py.detach(|| scene.visible_fractions(id, points.len(), seen))))
    }

    /// All that makes another scene of the same: its text, its files, its meshes.
    fn _state<'py>(&self, py: Python<'py>) -> PyResult<(String, Bound<'py, PyDict>, Bound<'py, PyDict>)> {
        let (text, files, meshes) = self.with(py, |state| {
            use firstlight::Assets;
            let (mut meshes, mut desc) = (Vec::new(), state.parsed.desc.clone());
            for file in desc.files_mut() {
                match state.cache.given_mesh(&file.0) {
                    Some(mesh) => meshes.push((file.0.clone(), mesh)),
                    // What cannot be read is said by who needs it
                    None => drop(state.files.read(&file.0, u64::MAX)),
                }
            }
            (state.parsed.desc.to_json(), state.files.all(), meshes)
        });
        let (by_name, of_meshes) = (PyDict::new(py), PyDict::new(py));
        for (name, bytes) in files {
            by_name.set_item(name, PyBytes::new(py, &bytes))?;
        }
        for (name, mesh) in meshes {
            of_meshes.set_item(name, arrays::stored(py, &mesh)?)?;
        }
        Ok((text, by_name, of_meshes))
    }

    /// Becomes the scene of such a state.
    fn _restore(
        &self,
        py: Python<'_>,
        text: &str,
        files: BTreeMap<String, Vec<u8>>,
        meshes: &Bound<'_, PyDict>,
    ) -> PyResult<()> {
        let known = files.into_iter().map(|(name, bytes)| (name, bytes.into())).collect();
        let files = SceneFiles::new(Source::Nothing, None, known);
        let parsed = SceneDesc::parse("scene.json", text.as_bytes(), &files);
        if !parsed.faults().is_empty() {
            return Err(scene_error(py, &Faults { faults: parsed.faults().to_vec() }));
        }
        let state = State::of(Parsed::from(parsed.desc), files);
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

/// A camera of the scene, by its name, or another one; `size` is that of the picture, which it may say. `what` is the
/// argument's name.
fn camera_choice(
    py: Python<'_>,
    what: &str,
    camera: &Bound<'_, PyAny>,
    size: &mut [Option<u32>; 2],
) -> PyResult<CameraChoice> {
    if let Ok(name) = camera.extract::<String>() {
        return Ok(CameraChoice::Named(name));
    }
    let fields = if camera.hasattr(intern!(py, "_resolve"))? {
        let resolved = camera.call_method1(intern!(py, "_resolve"), (size[0], size[1]))?;
        let (fields, width, height): (Bound<'_, PyDict>, Option<u32>, Option<u32>) = resolved.extract()?;
        *size = [width, height];
        fields
    } else {
        let wanted = || PyTypeError::new_err(format!("{what}: a name, a Camera or a dict is wanted"));
        camera.cast::<PyDict>().map_err(|_| wanted())?.clone()
    };
    match Item::read("camera", "camera", "", item_table(&fields, "camera")?) {
        Ok(Item::Camera(_, camera)) => Ok(CameraChoice::Other(Box::new(camera))),
        Ok(_) => unreachable!("it was read as a camera"),
        Err(faults) => Err(scene_error(py, &faults)),
    }
}

/// Whereto motion leads, and the size of the picture there: that of a render of `size`, else what the camera says.
fn motion_choice(
    py: Python<'_>,
    to: &Bound<'_, PyAny>,
    size: [Option<u32>; 2],
) -> PyResult<(MotionChoice, [Option<u32>; 2])> {
    if let Ok(time) = to.extract::<f64>() {
        return Ok((MotionChoice::To(MotionTo::Time(time)), size));
    }
    let mut own = size;
    let choice = match camera_choice(py, "motion_to", to, &mut own)? {
        CameraChoice::Other(camera) => MotionChoice::Camera(camera),
        CameraChoice::Named(name) => match MotionTo::from_name(&name) {
            Some(to) => MotionChoice::To(to),
            None => {
                let message = "motion_to is empty; it is a time, \"next\", \"previous\" or a camera";
                return Err(PyValueError::new_err(message));
            }
        },
    };
    Ok((choice, own))
}

/// The buffer of that name.
fn buffer(name: &str) -> PyResult<BufferDesc> {
    BufferDesc::parse(name).map_err(|(fault, hint)| {
        let hint = hint.map(|hint| format!("; {hint}")).unwrap_or_default();
        PyValueError::new_err(format!("buffers: {fault}{hint}"))
    })
}
