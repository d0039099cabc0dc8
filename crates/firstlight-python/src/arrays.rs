//! Arrays of numpy as lists of the library, with one copy at most: that which the library keeps.

use firstlight::{Encoding, MeshData};
use numpy::ndarray::ArrayView2;
use numpy::{
    Element, PyArray2, PyArrayDescrMethods, PyArrayMethods, PyReadonlyArray2, PyUntypedArray, PyUntypedArrayMethods,
    dtype,
};
use pyo3::exceptions::PyValueError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// `numpy.asarray`.
fn as_array<'py>(value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    value.py().import("numpy")?.call_method1(intern!(value.py(), "asarray"), (value,))
}

/// The kind of an array's numbers: `f`, `i`, `u`, or what is no number.
fn kind_of(array: &Bound<'_, PyAny>) -> PyResult<String> {
    array.getattr("dtype")?.getattr("kind")?.extract()
}

/// What is wrong with an array, with its shape and type.
fn refused(array: &Bound<'_, PyAny>, name: &str, wanted: &str) -> PyErr {
    let word = |key: &str| array.getattr(key).map(|v| v.to_string()).unwrap_or_default();
    PyValueError::new_err(format!("{name}: an array of shape {} and {}; {wanted}", word("shape"), word("dtype")))
}

/// Rows and columns of an array.
fn shape(array: &Bound<'_, PyAny>) -> PyResult<Option<[usize; 2]>> {
    Ok(array.getattr("shape")?.extract::<[usize; 2]>().ok())
}

/// The array as one of `T`s, if it is one; in whatever order it lies.
fn of_type<'py, T: Element>(array: &Bound<'py, PyAny>) -> Option<PyReadonlyArray2<'py, T>> {
    array.cast::<PyArray2<T>>().ok().and_then(|array| array.try_readonly().ok())
}

/// Shows rows of `columns` numbers to `with`, as a function from row and column to the number, in 64 bits.
fn with_floats<R>(
    value: &Bound<'_, PyAny>,
    name: &str,
    columns: &[usize],
    with: impl FnOnce([usize; 2], &dyn Fn(usize, usize) -> f64) -> R,
) -> PyResult<R> {
    let array = as_array(value)?;
    let wanted = || {
        let columns: Vec<String> = columns.iter().map(usize::to_string).collect();
        format!("numbers of shape (n, {}) are wanted", columns.join(" or "))
    };
    let fits = |shape: &[usize; 2]| columns.contains(&shape[1]);
    let Some(shape) = shape(&array)?.filter(fits).filter(|_| matches!(kind_of(&array).as_deref(), Ok("f" | "i" | "u")))
    else {
        return Err(refused(&array, name, &wanted()));
    };
    if let Some(array) = of_type::<f64>(&array) {
        let view: ArrayView2<'_, f64> = array.as_array();
        return Ok(with(shape, &|row, column| view[[row, column]]));
    }
    if let Some(array) = of_type::<f32>(&array) {
        let view: ArrayView2<'_, f32> = array.as_array();
        return Ok(with(shape, &|row, column| f64::from(view[[row, column]])));
    }
    // Other types go through one that holds them
    let array = array.call_method1(intern!(array.py(), "astype"), ("float64",))?;
    let Some(array) = of_type::<f64>(&array) else { return Err(refused(&array, name, &wanted())) };
    let view = array.as_array();
    Ok(with(shape, &|row, column| view[[row, column]]))
}

/// Rows of three numbers in 64 bits.
pub fn points(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<[f64; 3]>> {
    with_floats(value, name, &[3], |[rows, _], at| (0..rows).map(|i| [at(i, 0), at(i, 1), at(i, 2)]).collect())
}

/// The triangles of an array of whole numbers of any type.
fn triangles(value: &Bound<'_, PyAny>) -> PyResult<Vec<[u32; 3]>> {
    let array = as_array(value)?;
    let wanted = "whole numbers of shape (n, 3) are wanted, three vertices for each triangle";
    let is_whole = matches!(kind_of(&array).as_deref(), Ok("i" | "u"));
    if shape(&array)?.is_none_or(|[_, columns]| columns != 3) || !is_whole {
        return Err(refused(&array, "faces", wanted));
    }
    macro_rules! of_types {
        ($($kind:ty),*) => {
            $(if let Some(array) = of_type::<$kind>(&array) {
                let row = |row: numpy::ndarray::ArrayView1<'_, $kind>| [row[0], row[1], row[2]];
                let rows = array.as_array();
                return rows.rows().into_iter().enumerate().map(|(i, face)| triangle(i, row(face))).collect();
            })*
        };
    }
    of_types!(i64, i32, u32, u64, i16, u16, i8, u8);
    // In the other byte order
    triangles(&array.call_method1(intern!(array.py(), "astype"), ("int64",))?)
}

fn triangle<T: TryInto<u32> + Copy + std::fmt::Display>(i: usize, corners: [T; 3]) -> PyResult<[u32; 3]> {
    let mut triangle = [0; 3];
    for (to, from) in triangle.iter_mut().zip(corners) {
        let fault = |_| PyValueError::new_err(format!("faces[{i}]: there is no vertex {from}"));
        *to = from.try_into().map_err(fault)?;
    }
    Ok(triangle)
}

/// A mesh from the arrays that `add_mesh` is given.
pub fn mesh(
    vertices: &Bound<'_, PyAny>,
    faces: &Bound<'_, PyAny>,
    normals: Option<&Bound<'_, PyAny>>,
    uv: Option<&Bound<'_, PyAny>>,
    colors: Option<&Bound<'_, PyAny>>,
) -> PyResult<MeshData> {
    // What no face has does not decide where the vertices count from
    let mut mesh = MeshData { triangles: triangles(faces)?, ..MeshData::default() };
    with_floats(vertices, "vertices", &[3], |[rows, _], at| {
        mesh.set_positions(rows, |i| [at(i, 0), at(i, 1), at(i, 2)]);
    })?;
    if let Some(normals) = normals {
        mesh.normals = with_floats(normals, "normals", &[3], |[rows, _], at| {
            (0..rows).map(|i| [at(i, 0) as f32, at(i, 1) as f32, at(i, 2) as f32]).collect()
        })?;
    }
    if let Some(uv) = uv {
        mesh.uvs = uv_sets(uv)?;
    }
    if let Some(colors) = colors {
        let colors = &as_array(colors)?;
        let py = colors.py();
        // Bytes are sRGB, as in files; what other whole numbers stand for cannot be known
        let is_bytes = colors.cast::<PyUntypedArray>().is_ok_and(|array| array.dtype().is_equiv_to(&dtype::<u8>(py)));
        if !is_bytes && kind_of(colors)? != "f" {
            let wanted = "colours are uint8, 0 to 255 in sRGB, or floats, linear: for 0 to 255 write \
                          colors.astype(numpy.uint8), for 0 to 1 colors.astype(float)";
            return Err(refused(colors, "colors", wanted));
        }
        let linear = |c: f64| if is_bytes { Encoding::Srgb.decode(c / 255.0) as f32 } else { c as f32 };
        mesh.colors = with_floats(colors, "colors", &[3, 4], |[rows, _], at| {
            (0..rows).map(|i| [linear(at(i, 0)), linear(at(i, 1)), linear(at(i, 2)), 1.0]).collect()
        })?;
    }
    Ok(mesh)
}

/// Sets of texture coordinates: an array of shape (n, 2), or of shape (sets, n, 2).
fn uv_sets(uv: &Bound<'_, PyAny>) -> PyResult<Vec<Vec<[f32; 2]>>> {
    let set = |uv: &Bound<'_, PyAny>, name: &str| {
        with_floats(uv, name, &[2], |[rows, _], at| (0..rows).map(|i| [at(i, 0) as f32, at(i, 1) as f32]).collect())
    };
    let uv = &as_array(uv)?;
    if uv.getattr("ndim")?.extract::<usize>()? != 3 {
        return Ok(vec![set(uv, "uv")?]);
    }
    uv.try_iter()?.enumerate().map(|(i, one)| set(&one?, &format!("uv[{i}]"))).collect()
}

/// The lists of a mesh as a dict of bytes, for pickling.
pub fn stored<'py>(py: Python<'py>, mesh: &MeshData) -> PyResult<Bound<'py, PyDict>> {
    use pyo3::types::PyBytes;
    let floats = |numbers: &mut dyn Iterator<Item = f32>| numbers.flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
    let dict = PyDict::new(py);
    let set = |key: &str, bytes: Vec<u8>| dict.set_item(key, PyBytes::new(py, &bytes));
    set("positions", floats(&mut mesh.positions.iter().flatten().copied()))?;
    set("normals", floats(&mut mesh.normals.iter().flatten().copied()))?;
    set("uvs", floats(&mut mesh.uvs.iter().flatten().flatten().copied()))?;
    set("colors", floats(&mut mesh.colors.iter().flatten().copied()))?;
    set("triangles", mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()).collect())?;
    set("origin", mesh.origin.iter().flat_map(|c| c.to_le_bytes()).collect())?;
    Ok(dict)
}

/// The mesh of such a dict.
pub fn restored(dict: &Bound<'_, PyDict>) -> PyResult<MeshData> {
    let bytes = |key: &str| -> PyResult<Vec<u8>> {
        let value = dict.get_item(key)?.ok_or_else(|| PyValueError::new_err(format!("a stored mesh has no {key}")))?;
        value.extract()
    };
    let floats = |key: &str| -> PyResult<Vec<f32>> {
        Ok(bytes(key)?.as_chunks::<4>().0.iter().map(|number| f32::from_le_bytes(*number)).collect())
    };
    let positions: Vec<[f32; 3]> = floats("positions")?.as_chunks::<3>().0.to_vec();
    // One set after the other
    let uvs: Vec<[f32; 2]> = floats("uvs")?.as_chunks::<2>().0.to_vec();
    let whole: Vec<u32> = bytes("triangles")?.as_chunks::<4>().0.iter().map(|n| u32::from_le_bytes(*n)).collect();
    let origin: Vec<f64> = bytes("origin")?.as_chunks::<8>().0.iter().map(|n| f64::from_le_bytes(*n)).collect();
    Ok(MeshData {
        normals: floats("normals")?.as_chunks::<3>().0.to_vec(),
        uvs: uvs.chunks(positions.len().max(1)).map(<[_]>::to_vec).collect(),
        positions,
        colors: floats("colors")?.as_chunks::<4>().0.to_vec(),
        triangles: whole.as_chunks::<3>().0.to_vec(),
        origin: origin.try_into().map_err(|_| PyValueError::new_err("a stored mesh has no origin"))?,
        ..MeshData::default()
    })
}
