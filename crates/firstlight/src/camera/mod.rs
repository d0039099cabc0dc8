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

    /// The matrix from camera to world space, row by row: the camera looks along its -z, y is up in the picture.
    pub fn world_from_camera(&self) -> [f32; 16] {
        let Camera::Pinhole(Pinhole { right: r, up: u, forward: f, position: p, .. }) = self;
        [r.x, u.x, -f.x, p.x, r.y, u.y, -f.y, p.y, r.z, u.z, -f.z, p.z, 0.0, 0.0, 0.0, 1.0]
    }

    /// Half the width and half the height of the film at distance 1 from the eye: tangents of half the fields of view.
    pub fn film_half_size(&self) -> [f32; 2] {
        let Camera::Pinhole(pinhole) = self;
        [pinhole.half_width, pinhole.half_height]
    }
}
