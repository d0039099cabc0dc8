//! What the tests of whole scenes, fuzzing and `cargo xtask` share. Not published, and no part of the library: here a
//! broken promise is a panic.
//!
//! [`scenes`] builds scenes and looks at them; [`random`] and [`exact_scenes`] make them up, with [`pictures`] by
//! formula; [`converged`] knows how they look when nothing is left to chance, with [`graded`] points where a light is
//! near and [`kept`] files where that took long; [`hostile_text`], [`hostile_mesh`], [`hostile_model`] and
//! [`hostile_picture`] are what fuzzing holds the readers to, and [`damaged`] makes files for them.

#![allow(missing_docs, reason = "tests say what they build by its name")]

#[cfg(feature = "scenes")]
pub mod converged;
pub mod damaged;
#[cfg(feature = "scenes")]
pub mod exact_scenes;
#[cfg(feature = "scenes")]
pub mod graded;
#[cfg(feature = "scenes")]
pub mod hostile_mesh;
#[cfg(feature = "scenes")]
pub mod hostile_model;
#[cfg(feature = "scenes")]
pub mod hostile_picture;
#[cfg(feature = "scenes")]
pub mod hostile_text;
#[cfg(feature = "scenes")]
pub mod kept;
mod numbers;
#[cfg(feature = "scenes")]
pub mod pictures;
#[cfg(feature = "scenes")]
pub mod random;
#[cfg(feature = "scenes")]
pub mod scenes;

pub use numbers::Random;
