//! Cameras: from a place on the film to a ray.

mod pinhole;

pub use pinhole::CameraDesc;
