//! Cameras: from a place on the film to a ray.

mod pinhole;

pub use pinhole::{CameraDesc, Pinhole};

use crate::math::Ray;
use crate::shape::RayDifferential;

/// A camera, ready to look.
#[derive(Clone, Copy, Debug)]
pub enum Camera {
    /// `[camera]`
    Pinhole(Pinhole),
}

impl Camera {
    /// The ray through the film at `x`, `y` in pixels from its upper left corner, and how it changes over `step` pixels
    /// to the right and down.
    #[inline(always)]
    pub fn ray(&self, x: f32, y: f32, step: f32) -> (Ray, RayDifferential) {
        match self {
            Camera::Pinhole(pinhole) => pinhole.ray(x, y, step),
        }
    }
}
