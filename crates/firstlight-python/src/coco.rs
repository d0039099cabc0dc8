//! Data sets in COCO's format.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use firstlight::{Coco, write_whole};
use pyo3::prelude::*;

use crate::error::image_error;
use crate::scene::PyScene;

/// A data set in COCO's format, which grows picture by picture: boxes and masks of all objects that are seen.
///
/// Each annotation has the mask of what is seen of an object, as compressed run lengths, its box and its area, and the
/// same of the object alone, with nothing before it. Categories are the names of objects; two pictures of one scene
/// have the same.
#[pyclass(frozen, module = "firstlight", name = "Coco")]
#[derive(Default)]
pub struct PyCoco(Mutex<Coco>);

impl PyCoco {
    fn coco(&self) -> MutexGuard<'_, Coco> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl PyCoco {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Adds a picture of a scene: the objects that the middles of its pixels meet.
    ///
    /// Parameters
    /// ----------
    /// scene : Scene
    /// file_name : str
    ///     What the data set calls the picture's file.
    /// camera, width, height, time
    ///     As `Scene.render` takes them.
    #[pyo3(signature = (scene, file_name, *, camera = None, width = None, height = None, time = 0.0))]
    #[allow(clippy::too_many_arguments, reason = "they are the keyword arguments of Python")]
    fn add(
        &self,
        py: Python<'_>,
        scene: &PyScene,
        file_name: &str,
        camera: Option<&Bound<'_, PyAny>>,
        width: Option<u32>,
        height: Option<u32>,
        time: f64,
    ) -> PyResult<()> {
        let (compiled, film) = scene.film_of_objects(py, camera, [width, height], time)?;
        py.detach(|| self.coco().add(&compiled.scene, &film, file_name));
        Ok(())
    }

    /// The data set as JSON.
    fn to_json(&self) -> String {
        self.coco().to_json()
    }

    /// Writes the data set as a file of JSON, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| write_whole(&path, self.coco().to_json().as_bytes())).map(drop).map_err(|e| image_error(&e))
    }
}
