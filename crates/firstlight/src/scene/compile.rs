//! Stands in for the real compile until the parts are joined; not to be merged.

use crate::context::Assets;
use crate::error::{Diagnostic, SceneError};
use crate::scene::SceneDesc;

/// Wishes for compiling.
#[derive(Clone, Debug, Default)]
pub struct CompileOptions {
    /// Whether warnings are errors.
    pub strict: bool,
}

/// A compiled scene and what was noticed.
#[derive(Debug)]
pub struct Compiled {
    /// The scene.
    pub scene: Scene,
    /// What was noticed.
    pub warnings: Vec<Diagnostic>,
}

/// A compiled scene.
#[derive(Debug)]
pub struct Scene;

impl SceneDesc {
    /// Compiles.
    ///
    /// # Errors
    /// All faults.
    pub fn compile(&self, _assets: &dyn Assets, _options: &CompileOptions) -> Result<Compiled, SceneError> {
        Ok(Compiled { scene: Scene, warnings: Vec::new() })
    }
}
