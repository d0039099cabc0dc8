//! A render: the library's work on threads of its own while Python waits, and what comes of it as arrays.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;

use firstlight::{
    Compiled, Display, Encoding, FileSettings, Film, Format, NamedPlane, Plane, PlaneNumbers, PlaneVec, Receipt,
    RenderSettings, ToneMapping, Window, display_bytes, encode_planes, render, write_whole,
};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyKeyError, PyRuntimeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::camera::CameraMatrices;
use crate::error::{did_you_mean, image_error};
use crate::files::{SceneFiles, Source};
use crate::pool;

/// How often Python is asked, while a render goes on, whether it is to go on.
const ASKED_EVERY: Duration = Duration::from_millis(50);

/// Renders on other threads. Python's other threads run meanwhile; this one looks now and then for signals, such as
/// that of Ctrl-C, and calls `progress(done, all)`. What either raises stops the render.
pub fn run(
    py: Python<'_>,
    compiled: &Arc<Compiled>,
    settings: &RenderSettings,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Film> {
    let scene = &compiled.scene;
    let Window { width, height, .. } =
        settings.crop.unwrap_or(Window { x: 0, y: 0, width: scene.width(), height: scene.height() });
    let all = u64::from(width) * u64::from(height);
    let process = std::process::id();
    let shared = Arc::new((AtomicU64::new(0), AtomicBool::new(false)));
    let (done, stop) = &*shared;
    let (send, receive) = mpsc::channel();
    let receive = Mutex::new(receive);
    // Not in a scope, which a child that is forked meanwhile could never leave
    let worker = std::thread::spawn({
        let (compiled, settings, shared) = (compiled.clone(), settings.clone(), shared.clone());
        move || {
            let (done, stop) = &*shared;
            let told = |so_far: u64, _| {
                done.fetch_max(so_far, Ordering::Relaxed);
                if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            // Nobody listens any more only when the render was stopped
            drop(send.send(render(&compiled.scene, &settings, &told)));
        }
    });
    let mut last = None;
    let mut tell = |now: u64| match progress {
        Some(progress) if last != Some(now) => {
            last = Some(now);
            progress.call1((now, all)).map(drop)
        }
        _ => Ok(()),
    };
    loop {
        let answer = py.detach(|| receive.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(ASKED_EVERY));
        match answer {
            Ok(ControlFlow::Continue((film, _))) => {
                tell(all)?;
                return Ok(film);
            }
            Ok(ControlFlow::Break(())) | Err(mpsc::RecvTimeoutError::Disconnected) => {
                // The words of a panic, if there was one
                let why = py.detach(|| worker.join()).err().and_then(|why| {
                    why.downcast_ref::<String>().cloned().or(why.downcast_ref::<&str>().map(|why| (*why).to_owned()))
                });
                let why = why.unwrap_or_else(|| "the render ended without a picture".into());
                return Err(PyRuntimeError::new_err(format!("firstlight failed: {why}")));
            }
            Err(mpsc::RecvTimeoutError::Timeout) if std::process::id() != process => {
                let message = "progress forked the process: the picture is rendered in the parent alone";
                return Err(PyRuntimeError::new_err(message));
            }
            Err(mpsc::RecvTimeoutError::Timeout) => {
                if let Err(error) = py.check_signals().and_then(|()| tell(done.load(Ordering::Relaxed))) {
                    stop.store(true, Ordering::Relaxed);
                    // It ends within some hundredths of a second; in a child that progress forked there is none
                    if std::process::id() == process {
                        drop(py.detach(|| worker.join()));
                    }
                    return Err(error);
                }
            }
        }
    }
}

/// What makes another render of the same: the arrays; the names of the planes and what they are; the size of the film
/// and the part that they hold; how it is shown; what files say of it; K and the pose of the camera.
type Pickled<'py> = (
    Bound<'py, PyDict>,
    Vec<(String, String)>,
    [u32; 2],
    [u32; 4],
    (String, f64, f64),
    [Vec<(String, String)>; 2],
    (Option<[f64; 4]>, [f64; 16]),
);

/// The render of such a state.
#[pyfunction(name = "_restored_render")]
pub fn restored(
    arrays: Bound<'_, PyDict>,
    names: Vec<(String, String)>,
    film: [u32; 2],
    window: [u32; 4],
    display: (String, f64, f64),
    says: [Vec<(String, String)>; 2],
    camera: (Option<[f64; 4]>, [f64; 16]),
) -> PyResult<PyRender> {
    let ([x, y, width, height], (encoding, gamma, exposure)) = (window, display);
    let plane = |(name, word): (String, String)| match Plane::from_name(&word) {
        Some(plane) => Ok((name, plane)),
        None => Err(PyValueError::new_err(format!("{name}: this version of firstlight has no plane {word}"))),
    };
    let tone_mapping = if encoding == "neutral" { ToneMapping::Neutral } else { ToneMapping::None };
    let encoding = match encoding.as_str() {
        "gamma" => Encoding::Gamma(gamma),
        "linear" => Encoding::Linear,
        _ => Encoding::Srgb,
    };
    Ok(PyRender {
        arrays: arrays.unbind(),
        planes: names.into_iter().map(plane).collect::<PyResult<_>>()?,
        film,
        window: Window { x, y, width, height },
        display: Display { encoding, exposure, tone_mapping },
        receipts: says.map(|entries| Receipt { entries }),
        camera: CameraMatrices { intrinsics: camera.0, world_from_camera: camera.1 },
        compiled: None,
        files: Arc::new(SceneFiles::new(Source::Nothing, None, BTreeMap::new())),
    })
}

/// What was rendered: a mapping from the names of buffers to numpy arrays, row 0 at the top.
///
/// Each array has the shape (height, width), or (height, width, channels) where a pixel has several numbers; float32,
/// or uint32 for ids. They are the memory that was rendered to, not copies of it.
#[pyclass(frozen, mapping, module = "firstlight", name = "Render")]
pub struct PyRender {
    arrays: Py<PyDict>,
    /// Their names, and what they are.
    planes: Vec<(String, Plane)>,
    film: [u32; 2],
    window: Window,
    display: Display,
    /// What a picture says of itself, and what a file of buffers does.
    receipts: [Receipt; 2],
    camera: CameraMatrices,
    /// The scene, where there are ids to be annotated.
    compiled: Option<Arc<Compiled>>,
    files: Arc<SceneFiles>,
}

impl PyRender {
    /// From a film, whose memory it takes over.
    pub fn new(
        py: Python<'_>,
        film: Film,
        compiled: Arc<Compiled>,
        settings: &RenderSettings,
        files: Arc<SceneFiles>,
    ) -> PyResult<Self> {
        let (scene, size, window) = (&compiled.scene, film.size(), film.window());
        let arrays = PyDict::new(py);
        let mut planes = Vec::new();
        for (name, buffer, numbers) in film.into_planes() {
            let plane = buffer.plane();
            let (h, w, channels) = (window.height as usize, window.width as usize, plane.channels().len());
            let shape = if channels == 1 { vec![h, w] } else { vec![h, w, channels] };
            let array = match numbers {
                PlaneVec::Floats(numbers) => PyArray1::from_vec(py, numbers).reshape(shape)?.into_any(),
                PlaneVec::Wholes(numbers) => PyArray1::from_vec(py, numbers).reshape(shape)?.into_any(),
            };
            arrays.set_item(&name, array)?;
            planes.push((name, plane));
        }
        let receipts = [scene.receipt(settings), scene.buffers_receipt(settings, &settings.buffers)];
        let (camera, display) = (CameraMatrices::of(scene.camera()), scene.display());
        let has_ids = planes.iter().any(|(_, plane)| *plane == Plane::ObjectId);
        let compiled = has_ids.then_some(compiled);
        Ok(PyRender { arrays: arrays.unbind(), planes, film: size, window, display, receipts, camera, compiled, files })
    }

    /// The scene, and the ids of the objects that the middles of the pixels meet, lent to `with` with the window.
    pub fn with_ids<R>(
        &self,
        py: Python<'_>,
        with: impl FnOnce(&Compiled, Window, &[u32]) -> PyResult<R>,
    ) -> PyResult<R> {
        let of = self.planes.iter().find(|(_, plane)| *plane == Plane::ObjectId);
        let Some(of) = of else {
            let message = format!("the render has {}, and not object-id, which annotations are made of", self.names());
            return Err(PyValueError::new_err(message));
        };
        let Some(compiled) = &self.compiled else {
            let message = "a render that was pickled has lost its scene; add(scene, ...) renders it again";
            return Err(PyValueError::new_err(message));
        };
        self.with_planes(py, std::slice::from_ref(of), |planes| match planes {
            [NamedPlane { numbers: PlaneNumbers::Wholes(ids), .. }] => with(compiled, self.window, ids),
            _ => unreachable!("ids are whole numbers"),
        })
    }

    /// The numbers of the planes as they are now, lent to `with`.
    fn with_planes<R>(
        &self,
        py: Python<'_>,
        of: &[(String, Plane)],
        with: impl FnOnce(&[NamedPlane<'_>]) -> PyResult<R>,
    ) -> PyResult<R> {
        let (mut floats, mut wholes) = (Vec::new(), Vec::new());
        for (name, plane) in of {
            let array = self.arrays.bind(py).get_item(name)?;
            let array = array.ok_or_else(|| PyKeyError::new_err(name.clone()))?;
            if plane.is_whole() {
                wholes.push(array.extract::<PyReadonlyArrayDyn<'_, u32>>()?);
            } else {
                floats.push(array.extract::<PyReadonlyArrayDyn<'_, f32>>()?);
            }
        }
        let (mut next_floats, mut next_wholes) = (floats.iter(), wholes.iter());
        let mut planes = Vec::new();
        for (name, plane) in of {
            let numbers = if plane.is_whole() {
                next_wholes.next().map(|array| array.as_slice().map(PlaneNumbers::Wholes))
            } else {
                next_floats.next().map(|array| array.as_slice().map(PlaneNumbers::Floats))
            };
            let numbers = numbers.expect("each plane has its array");
            let is_moved = |_| PyValueError::new_err(format!("the array {name} is no longer laid out by rows"));
            planes.push(NamedPlane { name, plane: *plane, numbers: numbers.map_err(is_moved)? });
        }
        with(&planes)
    }

    fn is_distance(&self, name: &str) -> bool {
        self.planes.iter().any(|(known, plane)| known == name && plane.is_distance())
    }

    fn names(&self) -> String {
        self.planes.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
    }

    /// What is said of a buffer that is not there.
    fn no_buffer(&self, name: &str) -> String {
        let names: Vec<&str> = self.planes.iter().map(|(name, _)| name.as_str()).collect();
        format!("{name}: the render has {}{}", names.join(", "), did_you_mean(name, &names))
    }

    /// The plane of the picture.
    fn picture(&self) -> PyResult<&(String, Plane)> {
        let missing = || format!("there is no picture: the render has {}, and not color", self.names());
        let picture = self.planes.iter().find(|(_, plane)| *plane == Plane::Color);
        picture.ok_or_else(|| PyValueError::new_err(missing()))
    }

    /// The bytes of a file: of the buffer of that name, else of all in a format that holds them, else of the picture.
    fn encode(
        &self,
        py: Python<'_>,
        format: Format,
        buffer: Option<&str>,
        settings: FileSettings,
    ) -> PyResult<Vec<u8>> {
        let of = match buffer {
            None if matches!(format, Format::Exr | Format::Npz) => &self.planes[..],
            named => {
                let plane = match named {
                    None => self.picture()?,
                    Some(name) => {
                        let known = self.planes.iter().find(|(known, _)| known == name);
                        known.ok_or_else(|| PyValueError::new_err(self.no_buffer(name)))?
                    }
                };
                std::slice::from_ref(plane)
            }
        };
        let is_picture = matches!(of, [(_, Plane::Color)]);
        let mut receipt = self.receipts[usize::from(!is_picture)].clone();
        if let (Some(name), Some((_, said))) = (buffer, receipt.entries.iter_mut().find(|(key, _)| key == "buffers")) {
            *said = format!("[{name:?}]");
        }
        let settings = FileSettings { display: self.display, ..settings };
        self.with_planes(py, of, |planes| {
            let encode = || encode_planes(self.film, self.window, planes, format, &settings, &receipt);
            pool::run(py, encode).map_err(|e| image_error(&e))
        })
    }
}

#[pymethods]
impl PyRender {
    /// The camera matrix [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] of the arrays, (3, 3), float64.
    ///
    /// In pixels, x to the right and y down, the middle of the first pixel of the arrays at (0.5, 0.5), also where they
    /// are a part of the film.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The camera is orthographic, and has none.
    #[getter(K)]
    fn intrinsics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.camera.k(py, [self.window.x, self.window.y])
    }

    /// The matrix from camera to world, (4, 4), float64, metres: what `Camera.from_pose` takes.
    ///
    /// Parameters
    /// ----------
    /// convention : {"opencv", "opengl"}
    ///     Whether the camera looks along z with y down, or along -z with y up.
    #[pyo3(signature = (convention = "opencv"))]
    fn pose<'py>(&self, py: Python<'py>, convention: &str) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.camera.pose(py, convention)
    }

    /// The names of the objects that ids count, that of id 1 first; None for what has none. Lights come last.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The render has no buffer that tells objects apart.
    #[getter]
    fn object_names(&self) -> PyResult<Vec<Option<String>>> {
        let said = self.receipts[1].entries.iter().find(|(key, _)| key == "object_names");
        let names = said.and_then(|(_, names)| serde_json::from_str(names).ok());
        names.ok_or_else(|| {
            let message =
                format!("the render has {}, and nothing that tells objects apart: object-id does", self.names());
            PyValueError::new_err(message)
        })
    }

    /// The picture in 8 bits, display-encoded as in a .png file: uint8, (height, width, 3) or (height, width, 4).
    ///
    /// Parameters
    /// ----------
    /// alpha : bool
    ///     Whether there is a fourth channel: alpha, with the colours not multiplied by it. Without it, what is
    ///     transparent lies on black.
    #[pyo3(signature = (*, alpha = false))]
    fn rgb8<'py>(&self, py: Python<'py>, alpha: bool) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let of = self.picture()?;
        let bytes = self.with_planes(py, std::slice::from_ref(of), |planes| {
            let PlaneNumbers::Floats(numbers) = planes[0].numbers else { unreachable!("colours are floats") };
            let encode = || display_bytes(numbers.as_chunks::<4>().0, &self.display, alpha);
            pool::run(py, encode).map_err(|e| image_error(&e))
        })?;
        let (h, w) = (self.window.height as usize, self.window.width as usize);
        PyArray1::from_vec(py, bytes).reshape([h, w, if alpha { 4 } else { 3 }])
    }

    /// What decided the pixels: a dict of texts. With more buffers than color it has the camera's matrices and the
    /// names behind ids.
    #[getter]
    fn receipt<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let receipt = PyDict::new(py);
        for (key, value) in &self.receipts[1].entries {
            receipt.set_item(key, value)?;
        }
        Ok(receipt)
    }

    /// The columns and rows of the whole film; the arrays are smaller if it was cropped.
    #[getter]
    fn film_size(&self) -> (u32, u32) {
        (self.film[0], self.film[1])
    }

    /// The part of the film that the arrays hold: x, y, width, height.
    #[getter]
    fn window(&self) -> (u32, u32, u32, u32) {
        let Window { x, y, width, height } = self.window;
        (x, y, width, height)
    }

    /// The bytes of a PNG file of the picture, display-encoded, with its receipt.
    ///
    /// Parameters
    /// ----------
    /// bits : int
    ///     8 or 16 for each channel.
    #[pyo3(signature = (*, bits = 8))]
    fn to_png<'py>(&self, py: Python<'py>, bits: u32) -> PyResult<Bound<'py, PyBytes>> {
        let format = match bits {
            8 => Format::Png8,
            16 => Format::Png16,
            _ => return Err(PyValueError::new_err(format!("bits is {bits}; a PNG has 8 or 16"))),
        };
        Ok(PyBytes::new(py, &self.encode(py, format, None, FileSettings::default())?))
    }

    /// Writes a file, whole or not at all: `.exr` and `.npz` hold all buffers, the others one.
    ///
    /// The arrays are written as they are now. A file that the scene was read from is never written over.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     The ending says the format: .png (8 bits), .jpg, .exr, .npz, .npy or .hdr.
    /// buffer : str, optional
    ///     The buffer to write by itself; else all that the format holds, or the picture. In a .png file depth,
    ///     distance and ids have 16 bits, and 0 where nothing is; colours are shown as the picture is; normals are
    ///     (x, y, z) / 2 + 1/2.
    /// depth_scale : float
    ///     Units per metre of depth and distance in a .png file: 1000, if not given, are millimetres. What is farther
    ///     than 65535 units is 0.
    /// half : bool
    ///     Whether an .exr file holds colours and shares of the pixel in 16-bit floats, which end at 65504. Depth,
    ///     positions, normals and all else keep their 32 bits.
    /// quality : int
    ///     Of a .jpg file, 1 to 100: 90, if not given. Such a file has no alpha: what lets light through lies on black.
    #[pyo3(signature = (path, *, buffer = None, depth_scale = None, half = false, quality = None))]
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        buffer: Option<&str>,
        depth_scale: Option<f64>,
        half: bool,
        quality: Option<u8>,
    ) -> PyResult<()> {
        let format = Format::from_path(&path).map_err(|e| image_error(&e))?;
        if half && format != Format::Exr {
            return Err(PyValueError::new_err(format!("half is for .exr files, and {} is none", path.display())));
        }
        if quality.is_some() && format != Format::Jpeg {
            return Err(PyValueError::new_err(format!("quality is for .jpg files, and {} is none", path.display())));
        }
        let is_scaled = format == Format::Png8 && buffer.is_some_and(|name| self.is_distance(name));
        if depth_scale.is_some() && !is_scaled {
            return Err(PyValueError::new_err("depth_scale is for depth and distance in a .png file"));
        }
        if pool::at_work(py, || self.files.holds(&path)) {
            let message = format!("{}: the scene was read from it; choose another name", path.display());
            return Err(PyValueError::new_err(message));
        }
        let default = FileSettings::default();
        let depth_scale = depth_scale.unwrap_or(default.depth_scale);
        let jpeg_quality = quality.unwrap_or(default.jpeg_quality);
        let settings = FileSettings { depth_scale, half, jpeg_quality, ..default };
        let bytes = self.encode(py, format, buffer, settings)?;
        // Not at work: it takes no locks, and may wait for a reader that is yet to be forked
        py.detach(|| write_whole(&path, &bytes)).map(drop).map_err(|e| image_error(&e))
    }

    /// For notebooks.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyBytes>>> {
        if self.planes.iter().any(|(_, plane)| *plane == Plane::Color) {
            self.to_png(py, 8).map(Some)
        } else {
            Ok(None)
        }
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        self.arrays.bind(py).as_any().get_item(name).map_err(|_| PyKeyError::new_err(self.no_buffer(&name.to_string())))
    }

    fn __len__(&self) -> usize {
        self.planes.len()
    }

    fn __contains__(&self, py: Python<'_>, name: &Bound<'_, PyAny>) -> PyResult<bool> {
        self.arrays.bind(py).contains(name)
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.arrays.bind(py).call_method0(intern!(py, "__iter__"))
    }

    /// The names of the buffers.
    fn keys<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.arrays.bind(py).call_method0(intern!(py, "keys"))
    }

    /// The arrays.
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.arrays.bind(py).call_method0(intern!(py, "values"))
    }

    /// Names and arrays.
    fn items<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.arrays.bind(py).call_method0(intern!(py, "items"))
    }

    /// The array of that name, or `default`.
    #[pyo3(signature = (name, default = None))]
    fn get<'py>(
        &self,
        py: Python<'py>,
        name: &Bound<'py, PyAny>,
        default: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(self.arrays.bind(py).as_any().get_item(name).ok().or(default))
    }

    /// For pickle: the arrays and all that files of them say, without the files of the scene.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Pickled<'py>)> {
        let names = self.planes.iter().map(|(name, plane)| (name.clone(), plane.name().to_owned())).collect();
        let (encoding, gamma) = match self.display.encoding {
            _ if self.display.tone_mapping == ToneMapping::Neutral => ("neutral", 0.0),
            Encoding::Srgb => ("srgb", 0.0),
            Encoding::Gamma(gamma) => ("gamma", gamma),
            Encoding::Linear => ("linear", 0.0),
        };
        let Window { x, y, width, height } = self.window;
        let says = [&self.receipts[0], &self.receipts[1]].map(|receipt| receipt.entries.clone());
        let display = (encoding.to_owned(), gamma, self.display.exposure);
        let camera = (self.camera.intrinsics, self.camera.world_from_camera);
        let state = (self.arrays.bind(py).clone(), names, self.film, [x, y, width, height], display, says, camera);
        Ok((py.import("firstlight._firstlight")?.getattr("_restored_render")?, state))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let mut words = Vec::new();
        for (name, array) in self.arrays.bind(py).iter() {
            let shape = array.cast::<numpy::PyUntypedArray>()?.shape().to_vec();
            words.push(format!("{name} {shape:?}"));
        }
        let Window { width, height, .. } = self.window;
        Ok(format!("<firstlight.Render {width} x {height}: {}>", words.join(", ")))
    }
}
