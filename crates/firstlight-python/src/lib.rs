//! The compiled part of the Python package `firstlight`: translation between numpy and the library, no logic of its
//! own.
//!
//! `python/firstlight` beside it is the package that imports this module: its helpers, its stubs, its words.

mod arrays;
mod asked;
mod camera;
mod coco;
mod error;
mod files;
mod item;
mod meshes;
mod numbers;
mod pool;
mod render;
mod scene;
mod shown;
mod state;
mod value;
mod wanted;

use firstlight::{LightDesc, MaterialDesc, Plane, ShapeDesc, TextureDesc, builtin_scenes, nearest_name, schema};
use pyo3::prelude::*;

use crate::coco::PyCoco;
use crate::error::{SceneError, SceneWarning};
use crate::render::PyRender;
use crate::scene::PyScene;

/// The known name nearest to another, if one is near enough to have been meant.
#[pyfunction(name = "_nearest")]
fn nearest(name: &str, known: Vec<String>) -> Option<String> {
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    nearest_name(name, &known).map(str::to_owned)
}

/// The JSON Schema of scenes.
#[pyfunction(name = "_schema")]
fn scene_schema() -> String {
    schema()
}

/// The compiled part of the package firstlight.
#[pymodule]
fn _firstlight(py: Python<'_>, module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyScene>()?;
    module.add_class::<PyRender>()?;
    module.add_class::<PyCoco>()?;
    module.add_function(wrap_pyfunction!(render::restored, module)?)?;
    module.add_function(wrap_pyfunction!(camera::camera_k, module)?)?;
    module.add_function(wrap_pyfunction!(camera::camera_pose, module)?)?;
    module.add_function(wrap_pyfunction!(camera::camera_project, module)?)?;
    module.add_function(wrap_pyfunction!(pool::before_fork, module)?)?;
    module.add_function(wrap_pyfunction!(pool::after_fork_in_parent, module)?)?;
    module.add_function(wrap_pyfunction!(pool::after_fork_in_child, module)?)?;
    module.add_function(wrap_pyfunction!(nearest, module)?)?;
    module.add_function(wrap_pyfunction!(scene_schema, module)?)?;
    module.add("SceneError", py.get_type::<SceneError>())?;
    module.add("SceneWarning", py.get_type::<SceneWarning>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("SHAPES", ShapeDesc::KINDS)?;
    module.add("LIGHTS", LightDesc::KINDS)?;
    module.add("MATERIALS", MaterialDesc::KINDS)?;
    module.add("TEXTURES", TextureDesc::KINDS)?;
    module.add("BUILTIN", builtin_scenes().iter().map(|scene| scene.name).collect::<Vec<_>>())?;
    module.add("BUFFERS", Plane::ALL.iter().map(|plane| plane.name()).collect::<Vec<_>>())?;
    Ok(())
}
