//! The pinhole camera.

use fearless_simd::{f32x16, prelude::*};
use pxfm::{f_atan, f_tan};

use super::{CameraDesc, FilmPlane, Frame};
use crate::context::{CompileContext, show};
use crate::math::{Ray, Vec3x16};
use crate::shape::RayDifferential;

/// A pinhole camera in front of a film, ready to look.
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    /// The eye, and which way it looks.
    pub frame: Frame,
    /// The film, at distance 1. Half its height is tan(fov / 2).
    pub film: FilmPlane,
}

const DEFAULT_FOV_Y_DEG: f64 = 45.0;
const DEFAULT_SENSOR_HEIGHT_MM: f64 = 24.0;

impl Pinhole {
    pub(super) fn compile(desc: &CameraDesc, cx: &mut CompileContext, width: u32, height: u32) -> Self {
        let frame = Frame::compile(desc, cx);
        if let Some(metres) = desc.height {
            let message = format!("{metres} has no effect without projection = \"orthographic\"");
            cx.error("height", message, Some("fov_y_deg says how much a perspective camera sees"));
        }
        let film = match desc.focal_length_px {
            Some(focal) => {
                refuse_beside_pixels(desc, cx);
                FilmPlane::from_pixels(cx, focal, desc.principal_point_px, width, height)
            }
            None => {
                if let Some(point) = desc.principal_point_px {
                    let message = format!("{} has no effect without focal_length_px", show(&point));
                    cx.error("principal_point_px", message, Some("give focal_length_px as well, or write a shift"));
                }
                let half_height = f_tan(fov_y(desc, cx) * 0.5);
                FilmPlane::compile(cx, desc.shift, half_height, width, height)
            }
        };
        Self { frame, film }
    }

    /// The ray through the film at `x`, `y` in pixels from its upper left corner, and how it changes over `step` pixels
    /// to the right and down.
    #[inline(always)]
    pub(super) fn ray(&self, x: f32, y: f32, step: f32) -> (Ray, RayDifferential) {
        let Frame { start, right, up, forward, .. } = self.frame;
        let near = self.frame.near as f32;
        let [film_x, film_y] = self.film.place(x, y);
        let towards = right * film_x + up * film_y + forward;
        let length = towards.length();
        let [step_x, step_y] = self.film.steps(step);
        let differential = RayDifferential {
            dx: right * (step_x / length),
            dy: up * (step_y / length),
            origin_dx: right * (step_x * near),
            origin_dy: up * (step_y * near),
            steps_per_pixel: 1.0 / step,
        };
        let o = start + (right * (film_x * near) + up * (film_y * near));
        (Ray { o, d: towards / length }, differential)
    }

    /// The rays through sixteen places, from where and in which directions: the same bits.
    #[inline(always)]
    pub(super) fn ray_lanes<S: Simd>(&self, simd: S, x: f32x16<S>, y: f32x16<S>) -> [Vec3x16<S>; 2] {
        let near = self.frame.near as f32;
        let [start, right, up, forward] =
            [self.frame.start, self.frame.right, self.frame.up, self.frame.forward].map(|v| Vec3x16::splat(simd, v));
        let [film_x, film_y] = self.film.place_lanes(x, y);
        let towards = right * film_x + up * film_y + forward;
        let length = towards.dot(towards).sqrt();
        let o = start + (right * (film_x * near) + up * (film_y * near));
        [o, Vec3x16 { x: towards.x / length, y: towards.y / length, z: towards.z / length }]
    }
}

/// Refuses what says again what a camera matrix says.
fn refuse_beside_pixels(desc: &CameraDesc, cx: &mut CompileContext) {
    let others = [
        ("fov_y_deg", desc.fov_y_deg),
        ("focal_length_mm", desc.focal_length_mm),
        ("sensor_height_mm", desc.sensor_height_mm),
    ];
    for (field, value) in others {
        if let Some(value) = value {
            cx.error(field, format!("{value} and focal_length_px say the same twice"), Some("keep one of them"));
        }
    }
    if desc.shift != [0.0; 2] {
        let message = format!("{} has no effect with focal_length_px", show(&desc.shift));
        cx.error("shift", message, Some("principal_point_px says where the line of sight meets the picture"));
    }
}

/// The vertical field of view in radians.
fn fov_y(desc: &CameraDesc, cx: &mut CompileContext) -> f64 {
    let radians = std::f64::consts::PI / 180.0;
    match (desc.fov_y_deg, desc.focal_length_mm) {
        (Some(_), Some(focal)) => {
            cx.error("focal_length_mm", format!("{focal} and fov_y_deg say the same twice"), Some("keep one of them"));
        }
        (Some(fov), None) => {
            if !(0.001..=179.99).contains(&fov) {
                let hint = "the full vertical angle, in degrees";
                cx.error("fov_y_deg", format!("{fov} is outside [0.001, 179.99]"), Some(hint));
            }
            cx.advise_radians("fov_y_deg", fov);
        }
        (None, Some(focal)) => {
            cx.between("focal_length_mm", focal, 0.01, 1e6, Some("in millimetres"));
        }
        (None, None) => {}
    }
    if let Some(sensor) = desc.sensor_height_mm {
        cx.between("sensor_height_mm", sensor, 0.01, 1e4, Some("in millimetres; a full-frame sensor is 24 high"));
        if desc.focal_length_mm.is_none() {
            let message = format!("{sensor} has no effect without focal_length_mm");
            cx.error("sensor_height_mm", message, Some("give focal_length_mm as well, or take it out"));
        }
    }
    match desc.focal_length_mm {
        Some(focal) => 2.0 * f_atan(desc.sensor_height_mm.unwrap_or(DEFAULT_SENSOR_HEIGHT_MM) / (2.0 * focal)),
        None => desc.fov_y_deg.unwrap_or(DEFAULT_FOV_Y_DEG) * radians,
    }
}
