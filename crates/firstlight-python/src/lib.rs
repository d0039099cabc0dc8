//! The compiled part of the Python package `firstlight`: translation between numpy and the library, no logic of its
//! own.
//!
//! `python/firstlight` beside it is the package that imports this module: its helpers, its stubs, its words.

mod arrays;
mod coco;
mod error;
mod files;
mod item;
mod render;
mod scene;
mod state;
mod value;

use firstlight::{LightDesc, MaterialDesc, Plane, ShapeDesc, TextureDesc, builtin_scenes};
use pyo3::prelude::*;

use crate::coco::PyCoco;
use crate::error::{SceneError, SceneWarning};
use crate::render::PyRender;
use crate::scene::PyScene;

/// The compiled part of the package firstlight.
#[pymodule]
fn _firstlight(py: Python<'_>, module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyScene>()?;
    module.add_class::<PyRender>()?;
    module.add_class::<PyCoco>()?;
    module.add_function(wrap_pyfunction!(render::restored, module)?)?;
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
