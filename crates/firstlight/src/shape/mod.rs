//! Shapes: what a ray can hit.

mod parallelogram;
mod sphere;

pub use parallelogram::ParallelogramDesc;
pub use sphere::{SphereDesc, SphereUv};

/// A shape as a scene may say it.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeDesc {
    /// `[[sphere]]`
    Sphere(SphereDesc),
    /// `[[parallelogram]]`
    Parallelogram(ParallelogramDesc),
}
