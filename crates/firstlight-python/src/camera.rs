//! The camera of a render, and one that is asked without a render.

use firstlight::{Camera, CameraDesc, CompileOptions, DVec3, NoAssets, Parsed, SceneDesc};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::error::{did_you_mean, scene_error};
use crate::pool;
use crate::wanted::camera_desc;

/// The ways of OpenCV and of OpenGL to lay the axes of a camera.
const CONVENTIONS: [&str; 2] = ["opencv", "opengl"];

/// What leads from the world to pixels.
pub struct CameraMatrices {
    /// fx, fy, cx and cy in pixels of the film; `None` of an orthographic camera.
    pub intrinsics: Option<[f64; 4]>,
    /// 4 x 4 by rows, with OpenGL's axes.
    pub world_from_camera: [f64; 16],
}

impl CameraMatrices {
    pub fn of(camera: &Camera) -> Self {
        Self { intrinsics: camera.intrinsics(), world_from_camera: camera.world_from_camera() }
    }

    /// K of a picture that begins at a pixel of the film.
    pub fn k<'py>(&self, py: Python<'py>, first: [u32; 2]) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let Some([fx, fy, cx, cy]) = self.intrinsics else {
            let message = "an orthographic camera has no K; camera.project says where points are in its picture";
            return Err(PyValueError::new_err(message));
        };
        let [x, y] = first.map(f64::from);
        PyArray1::from_vec(py, vec![fx, 0.0, cx - x, 0.0, fy, cy - y, 0.0, 0.0, 1.0]).reshape([3, 3])
    }

    /// Camera to world.
    pub fn pose<'py>(&self, py: Python<'py>, convention: &str) -> PyResult<Bound<'py, PyArray2<f64>>> {
        if !CONVENTIONS.contains(&convention) {
            let hint = did_you_mean(convention, &CONVENTIONS);
            let message = format!(
                "convention is {convention:?}; it is \"opencv\" (y down, z forward) or \"opengl\" (y up, z back){hint}"
            );
            return Err(PyValueError::new_err(message));
        }
        let mut matrix = self.world_from_camera.to_vec();
        if convention == "opencv" {
            // Never -0
            matrix[..12].chunks_mut(4).for_each(|row| row[1..3].iter_mut().for_each(|axis| *axis = 0.0 - *axis));
        }
        PyArray1::from_vec(py, matrix).reshape([4, 4])
    }
}

/// The camera of a table, ready for pictures of a size.
fn compiled(py: Python<'_>, fields: &Bound<'_, PyDict>, width: u32, height: u32) -> PyResult<Camera> {
    let camera: CameraDesc = camera_desc(py, fields)?;
    let mut desc = SceneDesc::default();
    [desc.render.width, desc.render.height] = [width, height];
    desc.cameras.push((String::new(), camera));
    let made = pool::run(py, || Parsed::from(desc).compile(&NoAssets, &CompileOptions::default()));
    made.map(|compiled| *compiled.scene.camera()).map_err(|faults| scene_error(py, &faults))
}

/// K of a camera.
#[pyfunction(name = "_camera_k")]
pub fn camera_k<'py>(
    py: Python<'py>,
    fields: &Bound<'_, PyDict>,
    width: u32,
    height: u32,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    CameraMatrices::of(&compiled(py, fields, width, height)?).k(py, [0, 0])
}

/// The pose of a camera.
#[pyfunction(name = "_camera_pose")]
pub fn camera_pose<'py>(
    py: Python<'py>,
    fields: &Bound<'_, PyDict>,
    width: u32,
    height: u32,
    convention: &str,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    CameraMatrices::of(&compiled(py, fields, width, height)?).pose(py, convention)
}

/// Where points are in the picture of a camera, in pixels; what is behind it is nowhere.
#[pyfunction(name = "_camera_project")]
pub fn camera_project<'py>(
    py: Python<'py>,
    fields: &Bound<'_, PyDict>,
    width: u32,
    height: u32,
    points: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let points = arrays::points(points, "points")?;
    let camera = compiled(py, fields, width, height)?;
    let pixel = |point: &[f64; 3]| camera.project(DVec3::from(*point)).unwrap_or([f64::NAN; 2]);
    let pixels: Vec<[f64; 2]> = py.detach(|| points.iter().map(pixel).collect());
    PyArray1::from_vec(py, pixels.into_flattened()).reshape([points.len(), 2])
}
