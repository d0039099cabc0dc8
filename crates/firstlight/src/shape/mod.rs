//! Shapes: what a ray can hit.
//!
//! Each shape is a room: what a scene may say of it, how a ray meets it, its texture coordinates, and how it stands in
//! the way of light.

mod parallelogram;
mod sphere;
mod surface;
mod triangles;

pub use parallelogram::{Parallelogram, ParallelogramDesc};
pub use sphere::{Sphere, SphereDesc, SphereUv};
pub use surface::{Footprint, RayDifferential, SurfaceInteraction, UvEdge};

pub(crate) use parallelogram::{ParallelogramShadow, PlaneSide};
pub(crate) use sphere::SphereShadow;
pub(crate) use surface::ShapePoint;
pub(crate) use triangles::{TileHits, TriangleTree};

use crate::describe::family;

family! {
    /// A shape as a scene may say it.
    pub enum ShapeDesc: "shape" {
        /// `[[sphere]]`
        Sphere(SphereDesc) = "sphere",
        /// `[[parallelogram]]`
        Parallelogram(ParallelogramDesc) = "parallelogram",
    }
}
