//! Data sets in COCO's format.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use firstlight::{Coco, write_whole};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::error::{did_you_mean, image_error};
use crate::pool;
use crate::render::PyRender;

/// A data set as `firstlight.Coco` builds on it.
#[pyclass(subclass, frozen, module = "firstlight._firstlight", name = "CocoBase")]
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

    /// Adds a picture that was rendered, with the objects of `only`, or with all but the lights.
    fn _add(&self, py: Python<'_>, frame: &PyRender, file_name: &str, only: Option<Vec<String>>) -> PyResult<()> {
        frame.with_ids(py, |compiled, window, ids| {
            let scene = &compiled.scene;
            let names = scene.object_names();
            if let Some(id) = ids.iter().find(|id| **id as usize > names.len()) {
                let message = format!("object-id: there is no object {id}: the scene has {}", names.len());
                return Err(PyValueError::new_err(message));
            }
            // Each object by its whole name, or by that of its category
            let words =
                |name: &Option<&str>| [name.unwrap_or_default().to_owned(), Coco::category_of(*name).to_owned()];
            let words: Vec<[String; 2]> = names.iter().map(words).collect();
            for name in only.iter().flatten() {
                let known = || words.iter().flatten().map(String::as_str).filter(|word| !word.is_empty());
                if !known().any(|word| word == name) {
                    let hint = did_you_mean(name, &known().collect::<Vec<_>>());
                    return Err(PyValueError::new_err(format!("only: no object is called {name:?}{hint}")));
                }
            }
            let shapes = names.len() - scene.summary().lights.len();
            let wanted = |object: usize| match &only {
                Some(only) => words[object].iter().any(|word| only.contains(word)),
                None => object < shapes,
            };
            pool::at_work(py, || {
                let coco = &mut *self.coco();
                pool::in_pool(|| coco.add_some(scene, window, ids, &wanted, file_name));
            });
            Ok(())
        })
    }

    /// The data set as JSON.
    fn to_json(&self, py: Python<'_>) -> String {
        pool::at_work(py, || self.coco().to_json())
    }

    /// Writes the data set as a file of JSON, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let text = self.to_json(py);
        py.detach(|| write_whole(&path, text.as_bytes())).map(drop).map_err(|e| image_error(&e))
    }

    /// How many pictures, annotations and categories it has.
    fn _counts(&self, py: Python<'_>) -> [usize; 3] {
        pool::at_work(py, || self.coco().counts())
    }
}
