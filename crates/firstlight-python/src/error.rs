//! Faults of the library as exceptions of Python.

use firstlight::{Diagnostic, ImageError, SceneError as Faults, Severity, nearest_name};
use pyo3::exceptions::{PyOSError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyList, PyType};
use pyo3::{create_exception, intern};

create_exception!(
    firstlight,
    SceneError,
    PyValueError,
    "A scene cannot be rendered. `diagnostics` is the list of all its faults; `str()` says the same, a line each."
);
create_exception!(
    firstlight,
    SceneWarning,
    PyUserWarning,
    "Something of a scene was put up with, as a texture that is missing, or may surprise, as a light that faces away."
);

/// The Python class of one fault.
fn class<'py>(py: Python<'py>, name: &'static str) -> PyResult<&'py Bound<'py, PyType>> {
    static DIAGNOSTIC: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    static PLACE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    let cell = if name == "Place" { &PLACE } else { &DIAGNOSTIC };
    cell.import(py, "firstlight._diagnostics", name)
}

/// One fault, as an object of Python.
pub fn diagnostic<'py>(py: Python<'py>, fault: &Diagnostic) -> PyResult<Bound<'py, PyAny>> {
    let severity = match fault.severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Advice => "advice",
    };
    let place = match &fault.place {
        Some(place) => Some(class(py, "Place")?.call1((&place.file, place.line, place.column, &place.excerpt))?),
        None => None,
    };
    let fields = (severity, place, &fault.path, &fault.message, fault.hint.as_deref(), fault.to_string());
    class(py, "Diagnostic")?.call1(fields)
}

/// Several of them.
pub fn diagnostics<'py>(py: Python<'py>, faults: &[Diagnostic]) -> PyResult<Bound<'py, PyList>> {
    PyList::new(py, faults.iter().map(|fault| diagnostic(py, fault)).collect::<PyResult<Vec<_>>>()?)
}

/// The exception of a scene that cannot be rendered.
pub fn scene_error(py: Python<'_>, faults: &Faults) -> PyErr {
    let list = match diagnostics(py, &faults.faults) {
        Ok(list) => list,
        Err(error) => return error,
    };
    let error = SceneError::new_err(faults.to_string());
    match error.value(py).setattr(intern!(py, "diagnostics"), list) {
        Ok(()) => error,
        Err(error) => error,
    }
}

/// The exception of a fault that has a path and no place.
pub fn fault(py: Python<'_>, path: &str, message: String, hint: Option<&str>) -> PyErr {
    let hint = hint.map(str::to_owned);
    let fault = Diagnostic { severity: Severity::Error, place: None, path: path.to_owned(), message, hint };
    scene_error(py, &Faults { faults: vec![fault] })
}

/// The exception of a picture that cannot be written: what the system refuses is an `OSError`.
pub fn image_error(error: &ImageError) -> PyErr {
    match error {
        ImageError::NoFolder { .. }
        | ImageError::IsFolder { .. }
        | ImageError::ReadOnly { .. }
        | ImageError::Write { .. }
        | ImageError::Stopped { .. } => PyOSError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// The end of a message about a name that is none of those that are known: the nearest of them, if one is near.
pub fn did_you_mean(name: &str, known: &[&str]) -> String {
    nearest_name(name, known).map(|near| format!("; did you mean {near:?}?")).unwrap_or_default()
}
