//! Scenes: described, read, compiled.

mod builtin;
mod compile;
mod course;
mod description;
mod text;

pub use builtin::{Builtin, builtin_scenes};
pub use compile::{CompileOptions, Compiled, Scene};
pub use description::{DisplayEncoding, RenderDesc, SceneDesc};
pub use text::{Parsed, reference, schema};
