//! Values of Python as the tree that scenes in JSON have.

use pyo3::exceptions::PyTypeError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use serde_json::{Map, Number, Value as Json};

use crate::error::fault;

/// Deeper trees are taken for ones that hold themselves.
const MAX_DEPTH: usize = 64;

/// The tree of a value: dicts, lists and tuples, texts, numbers, truth values, None, numpy's scalars and arrays, paths,
/// and what has a `to_dict`. `path` is what faults call it.
pub fn tree(value: &Bound<'_, PyAny>, path: &str) -> PyResult<Json> {
    of(value, path, 0)
}

/// The tree of keyword arguments; one that is None is left out.
pub fn table(fields: &Bound<'_, PyDict>, path: &str) -> PyResult<Map<String, Json>> {
    let mut table = Map::new();
    for (key, value) in fields.iter().filter(|(_, value)| !value.is_none()) {
        let key = key.extract::<String>()?;
        let tree = of(&value, &format!("{path}.{key}"), 1)?;
        table.insert(key, tree);
    }
    Ok(table)
}

fn of(value: &Bound<'_, PyAny>, path: &str, depth: usize) -> PyResult<Json> {
    let py = value.py();
    if depth > MAX_DEPTH {
        let hint = Some("does something in it hold itself?");
        return Err(fault(py, path, format!("values are nested more than {MAX_DEPTH} deep"), hint));
    }
    if value.is_none() {
        return Ok(Json::Null);
    }
    if let Ok(truth) = value.cast::<PyBool>() {
        return Ok(Json::Bool(truth.is_true()));
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Json::String(text.to_str()?.to_owned()));
    }
    if let Ok(dict) = value.cast::<PyDict>() {
        let mut table = Map::new();
        for (key, value) in dict.iter() {
            let Ok(key) = key.cast::<PyString>() else {
                let kind = key.get_type().name()?.to_string();
                return Err(fault(py, path, format!("a key is {kind}, not str"), None));
            };
            let key = key.to_str()?;
            let within = if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
            table.insert(key.to_owned(), of(&value, &within, depth + 1)?);
        }
        return Ok(Json::Object(table));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let mut list = Vec::with_capacity(value.len()?);
        for (i, element) in value.try_iter()?.enumerate() {
            list.push(of(&element?, &format!("{path}[{i}]"), depth + 1)?);
        }
        return Ok(Json::Array(list));
    }
    if value.is_instance_of::<PyInt>() {
        if let Ok(whole) = value.extract::<i64>() {
            return Ok(whole.into());
        }
        return number(py, value.extract::<f64>()?, path);
    }
    if value.is_instance_of::<PyFloat>() {
        return number(py, value.extract::<f64>()?, path);
    }
    // Scalars and arrays of numpy, and what behaves like them
    for method in [intern!(py, "tolist"), intern!(py, "to_dict"), intern!(py, "__fspath__")] {
        if value.hasattr(method)? {
            return of(&value.call_method0(method)?, path, depth + 1);
        }
    }
    let kind = value.get_type().name()?;
    Err(PyTypeError::new_err(format!("{path}: a scene has no word for {kind}")))
}

fn number(py: Python<'_>, value: f64, path: &str) -> PyResult<Json> {
    match Number::from_f64(value) {
        Some(number) => Ok(Json::Number(number)),
        None => Err(fault(py, path, format!("{value} is not a finite number"), None)),
    }
}
