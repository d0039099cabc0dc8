//! What the tests of whole scenes, fuzzing and `cargo xtask` share. Not published, and no part of the library: here a broken
//! promise is a panic.
//!
//! [`scenes`] builds scenes and looks at them; [`random`] and [`exact_scenes`] make them up; [`converged`] knows how they
//! look when nothing is left to chance, with [`graded`] points where a light is near and [`kept`] files where that took long;
//! [`hostile_text`], [`hostile_mesh`] and [`hostile_picture`] are what fuzzing holds the readers to.

#![allow(missing_docs, reason = "tests say what they build by its name")]

pub mod converged;
pub mod exact_scenes;
pub mod graded;
pub mod hostile_mesh;
pub mod hostile_picture;
pub mod hostile_text;
pub mod kept;
mod numbers;
pub mod random;
pub mod scenes;

pub use numbers::Random;
