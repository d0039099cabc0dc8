//! The orthographic camera: parallel rays, so that what is farther away is as large, and parallel lines stay parallel.

use fearless_simd::{f32x16, prelude::*};

use super::{CameraDesc, FilmPlane, Frame};
use crate::context::{CompileContext, show};
use crate::math::{Ray, Vec3, Vec3x16};
use crate::shape::RayDifferential;

/// An orthographic camera, ready to look.
#[derive(Clone, Copy, Debug)]
pub struct Orthographic {
    /// The middle of the film, without a shift, and which way it looks.
    pub frame: Frame,
    /// The film, in metres. It stands in the scene: what is behind it is not seen.
    pub film: FilmPlane,
}

impl Orthographic {
    pub(super) fn compile(desc: &CameraDesc, cx: &mut CompileContext, width: u32, height: u32) -> Self {
        let frame = Frame::compile(desc, cx);
        let angles = [
            ("fov_y_deg", desc.fov_y_deg),
            ("focal_length_mm", desc.focal_length_mm),
            ("sensor_height_mm", desc.sensor_height_mm),
        ];
        let pixels = [("focal_length_px", desc.focal_length_px), ("principal_point_px", desc.principal_point_px)];
        for (field, value) in pixels {
            if let Some(value) = value {
                let message = format!("{} has no effect with projection = \"orthographic\"", show(&value));
                cx.error(field, message, Some("`height` says how much it sees; take this out"));
            }
        }
        for (field, value) in angles {
            if let Some(value) = value {
                let message = format!("{value} has no effect with projection = \"orthographic\"");
                cx.error(field, message, Some("`height` says how much it sees; take this out"));
            }
        }
        let hint = "metres from the lower edge of the picture to the upper";
        match desc.height {
            Some(metres) => drop(cx.positive("height", metres, hint)),
            None => cx.error("height", "an orthographic camera needs it", Some(&format!("write `height = 2`: {hint}"))),
        }
        let half_height = desc.height.unwrap_or(1.0) * 0.5;
        Self { frame, film: FilmPlane::compile(cx, desc.shift, half_height, width, height) }
    }

    /// The ray from the film at `x`, `y` in pixels from its upper left corner, and how it changes over `step` pixels to
    /// the right and down: it starts elsewhere, and its direction stays.
    #[inline(always)]
    pub(super) fn ray(&self, x: f32, y: f32, step: f32) -> (Ray, RayDifferential) {
        let Frame { start, right, up, forward, .. } = self.frame;
        let [film_x, film_y] = self.film.place(x, y);
        let [step_x, step_y] = self.film.steps(step);
        let (origin_dx, origin_dy) = (right * step_x, up * step_y);
        let steps_per_pixel = 1.0 / step;
        let differential = RayDifferential { dx: Vec3::ZERO, dy: Vec3::ZERO, origin_dx, origin_dy, steps_per_pixel };
        (Ray { o: start + right * film_x + up * film_y, d: forward }, differential)
    }

    /// The rays through sixteen places, from where and in which directions: the same bits.
    #[inline(always)]
    pub(super) fn ray_lanes<S: Simd>(&self, simd: S, x: f32x16<S>, y: f32x16<S>) -> [Vec3x16<S>; 2] {
        let [start, right, up, forward] =
            [self.frame.start, self.frame.right, self.frame.up, self.frame.forward].map(|v| Vec3x16::splat(simd, v));
        let [film_x, film_y] = self.film.place_lanes(x, y);
        [start + right * film_x + up * film_y, forward]
    }
}
