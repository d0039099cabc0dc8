//! The pinhole camera.

use crate::describe::table;

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
        /// The direction that is up in the picture, of any length; not parallel to the line of sight.
        pub up: [f64; 3] = [0.0, 1.0, 0.0],
        /// The vertical field of view: the full angle, in degrees, in (0, 180).
        pub fov_y_deg: Option<f64> = None,
        /// Focal length in millimetres, instead of `fov_y_deg`: fov = 2 atan(sensor height / (2 focal length)).
        pub focal_length_mm: Option<f64> = None,
        /// The height of the sensor in millimetres, for `focal_length_mm`.
        pub sensor_height_mm: Option<f64> = None,
    }
}
