//! The pinhole camera.

use pxfm::{f_atan, f_tan};

use crate::context::{CompileContext, show};
use crate::describe::table;
use crate::math::{DVec3, Ray, Vec2, Vec3};
use crate::shape::RayDifferential;

table! {
    /// A pinhole camera: `[camera]`, or several as `[camera.NAME]`, of which `render.camera` or `--camera` names one.
    ///
    /// The field of view is `fov_y_deg`, or `focal_length_mm` with `sensor_height_mm`; with neither it is 45 degrees.
    ///
    /// ```toml
    /// [camera]
    /// position = [0, 0, 10]
    /// look_at = [0, 0, 0]
    /// fov_y_deg = 45
    /// ```
    pub struct CameraDesc {
        /// The eye, in metres, world space.
        pub position: [f64; 3],
        /// The point seen at the middle of the picture; not `position` itself.
        pub look_at: [f64; 3] = [0.0, 0.0, 0.0],
        /// The direction that is up in the picture, of any length above 1e-9; not parallel to the line of sight.
        pub up: [f64; 3] = [0.0, 1.0, 0.0],
        /// The vertical field of view: the full angle, in degrees, 0.001 to 179.99.
        pub fov_y_deg: Option<f64> = None,
        /// Focal length in millimetres, 0.01 to 1000000, instead of `fov_y_deg`: fov = 2 atan(sensor height / (2 focal length)).
        pub focal_length_mm: Option<f64> = None,
        /// The height of the sensor in millimetres, 0.01 to 10000, for `focal_length_mm`; 24 unless said.
        pub sensor_height_mm: Option<f64> = None,
    }
}

/// A pinhole camera in front of a film, ready to look.
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    /// The eye.
    pub position: Vec3,
    /// Unit: to the right in the picture.
    pub right: Vec3,
    /// Unit: up in the picture.
    pub up: Vec3,
    /// Unit: the line of sight.
    pub forward: Vec3,
    /// tan(fov / 2): half the height of the film at distance 1.
    pub half_height: f32,
    /// Half the width of the film at distance 1.
    pub half_width: f32,
    size: Vec2,
}

const DEFAULT_FOV_Y_DEG: f64 = 45.0;
const DEFAULT_SENSOR_HEIGHT_MM: f64 = 24.0;

/// `up` nearer to the line of sight than this sine is parallel to it.
const MIN_SINE: f64 = 1e-6;

impl CameraDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext, width: u32, height: u32) -> Pinhole {
        let (eye, target, up) = (DVec3::from(self.position), DVec3::from(self.look_at), DVec3::from(self.up));
        let before = cx.fault_count();
        let position = cx.point("position", self.position);
        cx.point("look_at", self.look_at);
        cx.edge("up", self.up);
        let forward = (target - eye).normalize_or_zero();
        let right = forward.cross(up.normalize_or_zero());
        if cx.fault_count() == before {
            let (at, from) = (show(&self.look_at), show(&self.position));
            if !((target - eye).length() >= MIN_DISTANCE) {
                let message = format!("{at} is the camera's position {from}: there is no direction to look in");
                cx.error("look_at", message, Some("move one of them"));
            } else if !(right.length() > MIN_SINE) {
                let message = format!(
                    "{} is parallel to the line of sight {}, from {from} to {at}",
                    show(&self.up),
                    show(&(target - eye).to_array())
                );
                cx.error("up", message, Some("choose another up"));
            }
        }
        let half_height = f_tan(self.fov_y(cx) * 0.5);
        let right = right.normalize_or_zero();
        Pinhole {
            position,
            right: right.as_vec3(),
            up: right.cross(forward).as_vec3(),
            forward: forward.as_vec3(),
            half_height: half_height as f32,
            half_width: (half_height * width as f64 / height as f64) as f32,
            size: Vec2::new(width as f32, height as f32),
        }
    }

    /// The vertical field of view in radians.
    fn fov_y(&self, cx: &mut CompileContext) -> f64 {
        let radians = std::f64::consts::PI / 180.0;
        match (self.fov_y_deg, self.focal_length_mm) {
            (Some(_), Some(focal)) => {
                cx.error(
                    "focal_length_mm",
                    format!("{focal} and fov_y_deg say the same twice"),
                    Some("keep one of them"),
                );
            }
            (Some(fov), None) => {
                if !(0.001..=179.99).contains(&fov) {
                    let hint = "the full vertical angle, in degrees";
                    cx.error("fov_y_deg", format!("{fov} is outside [0.001, 179.99]"), Some(hint));
                }
            }
            (None, Some(focal)) => {
                cx.between("focal_length_mm", focal, 0.01, 1e6, Some("in millimetres"));
            }
            (None, None) => {}
        }
        if let Some(sensor) = self.sensor_height_mm {
            cx.between("sensor_height_mm", sensor, 0.01, 1e4, Some("in millimetres; a full-frame sensor is 24 high"));
            if self.focal_length_mm.is_none() {
                let message = format!("{sensor} has no effect without focal_length_mm");
                cx.error("sensor_height_mm", message, Some("give focal_length_mm as well, or take it out"));
            }
        }
        match self.focal_length_mm {
            Some(focal) => 2.0 * f_atan(self.sensor_height_mm.unwrap_or(DEFAULT_SENSOR_HEIGHT_MM) / (2.0 * focal)),
            None => self.fov_y_deg.unwrap_or(DEFAULT_FOV_Y_DEG) * radians,
        }
    }
}

/// Eye and target nearer than this, in metres, are the same point.
const MIN_DISTANCE: f64 = 1e-9;

impl Pinhole {
    /// The ray through the film at `x`, `y` in pixels from its upper left corner, and how it changes over `step` pixels
    /// to the right and down.
    #[inline(always)]
    pub fn ray(&self, x: f32, y: f32, step: f32) -> (Ray, RayDifferential) {
        // 2 x / W - 1 and 1 - 2 y / H, with one rounding each: places that mirror each other on the film have rays that do
        let film_x = (2.0 * x - self.size.x) / self.size.x * self.half_width;
        let film_y = (self.size.y - 2.0 * y) / self.size.y * self.half_height;
        let towards = self.right * film_x + self.up * film_y + self.forward;
        let length = towards.length();
        let differential = RayDifferential {
            dx: self.right * (2.0 * step / self.size.x * self.half_width / length),
            dy: self.up * (-2.0 * step / self.size.y * self.half_height / length),
        };
        (Ray { o: self.position, d: towards / length }, differential)
    }
}
