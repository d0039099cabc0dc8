//! Shapes: what a ray can hit.
//!
//! Each shape is a room: what a scene may say of it, how a ray meets it, its texture coordinates, and how it stands in
//! the way of light.

#[cfg_attr(not(test), allow(dead_code))]
mod ball;
#[cfg(test)]
mod check;
#[cfg_attr(not(test), allow(dead_code))]
mod cone;
#[cfg_attr(not(test), allow(dead_code))]
mod cuboid;
#[cfg_attr(not(test), allow(dead_code))]
mod cylinder;
#[cfg_attr(not(test), allow(dead_code))]
mod disk;
#[cfg_attr(not(test), allow(dead_code))]
mod frustum;
mod parallelogram;
#[cfg_attr(not(test), allow(dead_code))]
mod plane;
#[cfg_attr(not(test), allow(dead_code))]
mod rectangle;
#[cfg_attr(not(test), allow(dead_code))]
mod solid;
mod sphere;
mod surface;
#[cfg_attr(not(test), allow(dead_code))]
mod torus;

#[allow(unused_imports)]
pub use cone::ConeDesc;
#[allow(unused_imports)]
pub use cuboid::BoxDesc;
#[allow(unused_imports)]
pub use cylinder::CylinderDesc;
#[allow(unused_imports)]
pub use disk::DiskDesc;
pub use parallelogram::{Parallelogram, ParallelogramDesc};
#[allow(unused_imports)]
pub use plane::PlaneDesc;
#[allow(unused_imports)]
pub use rectangle::RectangleDesc;
pub use sphere::{Sphere, SphereDesc, SphereUv};
pub use surface::{Footprint, RayDifferential, SurfaceInteraction, UvEdge};
#[allow(unused_imports)]
pub use torus::TorusDesc;

#[allow(unused_imports)]
pub(crate) use ball::Ball;
pub(crate) use parallelogram::{ParallelogramShadow, PlaneSide};
#[allow(unused_imports)]
pub(crate) use solid::{Solid, SolidHit, SolidPoint};
pub(crate) use sphere::SphereShadow;
pub(crate) use surface::ShapePoint;

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
