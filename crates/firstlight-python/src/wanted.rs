//! What a call wants otherwise than the scene says, from the arguments of Python.

use firstlight::{BufferDesc, CameraDesc, MotionTo, SamplesDesc};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::error::scene_error;
use crate::item::{Item, item_table};
use crate::state::{CameraChoice, MotionChoice, Wanted};

/// What a call says of the camera and the picture.
#[allow(clippy::too_many_arguments, reason = "they are the keyword arguments of Python")]
pub fn wanted(
    py: Python<'_>,
    camera: Option<&Bound<'_, PyAny>>,
    mut size: [Option<u32>; 2],
    antialiasing: Option<u32>,
    samples: Option<&Bound<'_, PyAny>>,
    tolerance: Option<f64>,
    time: Option<f64>,
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
    Ok(CameraChoice::Other(Box::new(camera_desc(py, &fields)?)))
}

/// The camera of a table.
pub fn camera_desc(py: Python<'_>, fields: &Bound<'_, PyDict>) -> PyResult<CameraDesc> {
    match Item::read("camera", "camera", "", item_table(fields, "camera")?) {
        Ok(Item::Camera(_, camera)) => Ok(camera),
        Ok(_) => unreachable!("it was read as a camera"),
        Err(faults) => Err(scene_error(py, &faults)),
    }
}

/// Whereto motion leads, and the size of the picture there: that of a render of `size`, else what the camera says.
pub fn motion_choice(
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

/// The buffers of a list of names; one name is a list of one.
pub fn buffers(names: &Bound<'_, PyAny>) -> PyResult<Vec<BufferDesc>> {
    if let Ok(name) = names.cast::<PyString>() {
        return Ok(vec![buffer(name.to_str()?)?]);
    }
    let wanted = |kind: &Bound<'_, PyAny>| match kind.get_type().name() {
        Ok(kind) => PyTypeError::new_err(format!("buffers: a name or a list of names is wanted, not {kind}")),
        Err(error) => error,
    };
    let each = |name: PyResult<Bound<'_, PyAny>>| {
        let name = name?;
        buffer(name.cast::<PyString>().map_err(|_| wanted(&name))?.to_str()?)
    };
    names.try_iter().map_err(|_| wanted(names))?.map(each).collect()
}

/// The buffer of that name.
fn buffer(name: &str) -> PyResult<BufferDesc> {
    BufferDesc::parse(name).map_err(|(fault, hint)| {
        let hint = hint.map(|hint| format!("; {hint}")).unwrap_or_default();
        PyValueError::new_err(format!("buffers: {fault}{hint}"))
    })
}
