//! Scenes: described, read, compiled.

mod description;

pub use description::{DisplayEncoding, RenderDesc, SceneDesc};
