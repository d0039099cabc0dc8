//! Cameras: from a place on the film to a ray.

mod film;
mod frame;
mod orthographic;
mod pinhole;

pub use film::FilmPlane;
pub use frame::Frame;
pub use orthographic::Orthographic;
pub use pinhole::Pinhole;

use fearless_simd::{f32x16, prelude::*};

use crate::context::CompileContext;
use crate::describe::{table, words};
use crate::math::{DVec3, Ray, Vec3, Vec3x16, WorldRay};
use crate::shape::RayDifferential;
use crate::transform::TransformDesc;

words! {
    /// How a camera sees.
    pub enum Projection {
        /// From one point, the eye: what is farther away is smaller.
        Perspective = "perspective",
        /// Along parallel rays, from the whole of a film: everything keeps its size. The film, `height` metres high,
        /// stands upright in the scene with its middle at `position`; what is behind it is not seen.
        Orthographic = "orthographic",
    }
}

table! {
    /// A camera: `[camera]`, or several as `[camera.NAME]`, of which `render.camera` or `--camera` names one. A scene
    /// without a camera is given one that sees all of its shapes.
    ///
    /// What a perspective camera sees is `fov_y_deg`, or `focal_length_mm` with `sensor_height_mm`, or
    /// `focal_length_px` with `principal_point_px`; with none of them it is 45 degrees. What an orthographic camera
    /// sees is `height` metres.
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
        /// How it sees.
        pub projection: Projection = Projection::Perspective,
        /// The vertical field of view: the full angle, in degrees, 0.001 to 179.99.
        pub fov_y_deg: Option<f64> = None,
        /// Focal length in millimetres, 0.01 to 1000000, instead of `fov_y_deg`: fov = 2 atan(sensor height / (2 focal
        /// length)).
        pub focal_length_mm: Option<f64> = None,
        /// The height of the sensor in millimetres, 0.01 to 10000, for `focal_length_mm`; 24 unless said.
        pub sensor_height_mm: Option<f64> = None,
        /// Instead of `fov_y_deg`: fx and fy of a camera matrix, the focal lengths in widths and in heights of a pixel,
        /// each 0.01 to 1e10.
        pub focal_length_px: Option<[f64; 2]> = None,
        /// With `focal_length_px`: cx and cy of a camera matrix, where the line of sight meets the picture, in pixels
        /// from its upper left corner, so that the middle of the first pixel is (0.5, 0.5); at most 100 pictures away.
        /// Without it, the middle of the picture.
        pub principal_point_px: Option<[f64; 2]> = None,
        /// From the lower edge of an orthographic picture to the upper, in metres, 1e-9 to 2.5e8. An orthographic
        /// camera needs it, and no other takes it.
        pub height: Option<f64> = None,
        /// Moves the film without turning the camera, in widths and heights of it, each from -100 to 100: with positive
        /// numbers the picture shows more of what is on the right, and above. Upright lines stay upright.
        pub shift: [f64; 2] = [0.0, 0.0],
        /// Where it is moved; it moves `position`, `look_at` and `up`. What it sees stays as large, whatever the scale,
        /// and is never mirrored.
        pub transform: Option<Box<TransformDesc>> = None,
    }
}

/// A camera, ready to look.
#[derive(Clone, Copy, Debug)]
pub enum Camera {
    /// `projection = "perspective"`
    Pinhole(Pinhole),
    /// `projection = "orthographic"`
    Orthographic(Orthographic),
}

impl CameraDesc {
    /// For a film of `width` x `height` pixels.
    pub(crate) fn compile(&self, cx: &mut CompileContext, width: u32, height: u32) -> Camera {
        match self.projection {
            Projection::Perspective => Camera::Pinhole(Pinhole::compile(self, cx, width, height)),
            Projection::Orthographic => Camera::Orthographic(Orthographic::compile(self, cx, width, height)),
        }
    }
}

impl Camera {
    /// The ray through the film at `x`, `y` in pixels from its upper left corner, and how it changes over `step` pixels
    /// to the right and down. It begins at the camera or, where the scene is far from there, on its way to it.
    pub fn ray(&self, x: f32, y: f32, step: f32) -> (WorldRay, RayDifferential) {
        let (ray, differential) = self.local_ray(x, y, step);
        (ray.in_world(self.frame().origin), differential)
    }

    /// The same in the scene's own coordinates.
    #[inline(always)]
    pub(crate) fn local_ray(&self, x: f32, y: f32, step: f32) -> (Ray, RayDifferential) {
        match self {
            Camera::Pinhole(pinhole) => pinhole.ray(x, y, step),
            Camera::Orthographic(orthographic) => orthographic.ray(x, y, step),
        }
    }

    /// The same with rays that begin so far along its line of sight, in metres.
    pub(crate) fn starting_at(self, near: f64) -> Self {
        match self {
            Camera::Pinhole(pinhole) => Camera::Pinhole(Pinhole { frame: pinhole.frame.starting_at(near), ..pinhole }),
            Camera::Orthographic(orthographic) => {
                let frame = orthographic.frame.starting_at(near);
                Camera::Orthographic(Orthographic { frame, ..orthographic })
            }
        }
    }

    /// Where a point of the world is in the picture: in pixels from its upper left corner, also outside of it. `None`
    /// for what is behind the camera. The way back from [`ray`](Self::ray).
    pub fn project(&self, point: DVec3) -> Option<[f64; 2]> {
        let (pixel, depth) = self.local_project(point - self.frame().origin)?;
        (depth > 0.0).then_some(pixel)
    }

    /// The same of a point in the scene's own coordinates, and how far it is along the line of sight: also of what is
    /// behind the film of an orthographic camera. `None` for what is behind an eye.
    pub(crate) fn local_project(&self, p: DVec3) -> Option<([f64; 2], f64)> {
        let Frame { near, start, .. } = self.frame();
        let parts = self.frame().parts(p - start.as_dvec3()) + DVec3::Z * *near;
        self.on_film(parts).map(|pixel| (pixel, parts.z))
    }

    /// Where the end of a ray, infinitely far away, is in the picture. `None` behind the camera, and for an
    /// orthographic one that looks along another way.
    pub(crate) fn local_project_end(&self, o: DVec3, d: DVec3) -> Option<[f64; 2]> {
        match self {
            Camera::Pinhole(pinhole) => self.on_film(pinhole.frame.parts(d)),
            Camera::Orthographic(orthographic) if d == orthographic.frame.forward.as_dvec3() => {
                self.local_project(o).map(|(pixel, _)| pixel)
            }
            Camera::Orthographic(_) => None,
        }
    }

    /// Where in the picture something is that has these parts along the axes of the camera.
    fn on_film(&self, DVec3 { x, y, z }: DVec3) -> Option<[f64; 2]> {
        match self {
            Camera::Pinhole(pinhole) => (z > 0.0).then(|| pinhole.film.pixel(x / z, y / z)),
            Camera::Orthographic(orthographic) => Some(orthographic.film.pixel(x, y)),
        }
    }

    /// The rays through sixteen places of the film, from where and in which directions: the bits of
    /// [`local_ray`](Self::local_ray). To be called within `vectorize`.
    #[inline(always)]
    pub(crate) fn ray_lanes<S: Simd>(&self, simd: S, x: f32x16<S>, y: f32x16<S>) -> [Vec3x16<S>; 2] {
        match self {
            Camera::Pinhole(pinhole) => pinhole.ray_lanes(simd, x, y),
            Camera::Orthographic(orthographic) => orthographic.ray_lanes(simd, x, y),
        }
    }

    /// How far the way to it turns, in radians, over a step of `reach` metres from a point.
    pub(crate) fn sway(&self, p: Vec3, reach: f32) -> f32 {
        match self {
            Camera::Pinhole(pinhole) => reach / (pinhole.frame.eye - p).length().max(f32::MIN_POSITIVE),
            Camera::Orthographic(_) => 0.0,
        }
    }

    /// How it sees.
    pub fn projection(&self) -> Projection {
        match self {
            Camera::Pinhole(_) => Projection::Perspective,
            Camera::Orthographic(_) => Projection::Orthographic,
        }
    }

    /// Where it is, and which way it is turned.
    pub fn frame(&self) -> &Frame {
        match self {
            Camera::Pinhole(pinhole) => &pinhole.frame,
            Camera::Orthographic(orthographic) => &orthographic.frame,
        }
    }

    fn film(&self) -> &FilmPlane {
        match self {
            Camera::Pinhole(pinhole) => &pinhole.film,
            Camera::Orthographic(orthographic) => &orthographic.film,
        }
    }

    /// The matrix from camera to world space, row by row: the camera looks along its -z, y is up in the picture.
    pub fn world_from_camera(&self) -> [f64; 16] {
        let Frame { right, up, forward, position: p, .. } = self.frame();
        let [r, u, f] = [right, up, forward].map(|v| v.as_dvec3());
        [r.x, u.x, -f.x, p.x, r.y, u.y, -f.y, p.y, r.z, u.z, -f.z, p.z, 0.0, 0.0, 0.0, 1.0]
    }

    /// Half the width and half the height of the film: at distance 1 from the eye (tangents of half the fields of
    /// view), or in metres where the camera is orthographic.
    pub fn film_half_size(&self) -> [f32; 2] {
        self.film().half.to_array()
    }

    /// fx, fy, cx and cy of the camera matrix K of a perspective camera, in pixels: with x to the right, y down and the
    /// middle of the first pixel at (0.5, 0.5). `None` for an orthographic camera, which has none.
    pub fn intrinsics(&self) -> Option<[f64; 4]> {
        match self {
            Camera::Pinhole(pinhole) => Some(pinhole.film.intrinsics()),
            Camera::Orthographic(_) => None,
        }
    }

    /// How far the film's middle is to the right of the line of sight and above it, in widths and heights of the film.
    pub fn film_shift(&self) -> [f32; 2] {
        self.film().shift.to_array()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::ScaleDesc;
    use crate::math::{DVec3, Vec3};

    fn compiled(desc: &CameraDesc, width: u32, height: u32) -> Camera {
        let cx = &mut CompileContext::default();
        let camera = desc.compile(cx, width, height);
        assert_eq!(cx.take_faults(), []);
        camera
    }

    fn orthographic(height: f64) -> CameraDesc {
        CameraDesc { projection: Projection::Orthographic, height: Some(height), ..CameraDesc::new([0.0, 0.0, 10.0]) }
    }

    #[test]
    fn orthographic_rays_are_parallel_and_start_on_the_film() {
        let camera = compiled(&orthographic(4.0), 200, 100);
        for (x, y, o) in
            [(100.0, 50.0, [0.0, 0.0, 10.0]), (0.0, 0.0, [-4.0, 2.0, 10.0]), (150.0, 75.0, [2.0, -1.0, 10.0])]
        {
            let (ray, differential) = camera.local_ray(x, y, 0.5);
            assert_eq!((ray.o, ray.d), (o.into(), Vec3::NEG_Z));
            assert_eq!((differential.dx, differential.dy), (Vec3::ZERO, Vec3::ZERO));
            // Half a pixel is 0.02 m
            assert_eq!(differential.origin_dx, Vec3::X * 0.02);
            assert_eq!(differential.origin_dy, Vec3::Y * -0.02);
        }
        assert_eq!(camera.film_half_size(), [4.0, 2.0]);
    }

    #[test]
    fn differentials_are_the_steps_between_neighbours_on_a_plane() {
        // A plane askew before each camera: where the ray and its neighbours meet it
        let n = DVec3::new(0.3, -0.5, 0.8).normalize();
        let meet = |camera: &Camera, x: f32, y: f32| {
            let (ray, _) = camera.local_ray(x, y, 1.0);
            let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
            let t = -n.dot(o) / n.dot(d);
            (o + d * t, t)
        };
        let shifted = CameraDesc { shift: [0.3, -0.2], ..orthographic(3.0) };
        let pinhole = CameraDesc { shift: [0.3, -0.2], ..CameraDesc::new([1.0, 2.0, 10.0]) };
        for desc in [orthographic(3.0), shifted, CameraDesc::new([1.0, 2.0, 10.0]), pinhole] {
            let camera = compiled(&desc, 640, 480);
            let (x, y) = (200.0, 100.0);
            let (p, t) = meet(&camera, x, y);
            let (ray, differential) = camera.local_ray(x, y, 1.0);
            let [dx, dy] = differential.on_plane(ray.d, t as f32, n.as_vec3(), 1e9);
            for (step, neighbour) in [(dx, meet(&camera, x + 1.0, y).0), (dy, meet(&camera, x, y + 1.0).0)] {
                let exact = neighbour - p;
                // The differential is the first order: a pixel's width off by about as little as a pixel is wide
                assert!((step.as_dvec3() - exact).length() < 3e-3 * exact.length(), "{desc:?}: {step} {exact}");
            }
        }
    }

    #[test]
    fn projecting_is_the_way_back_from_a_ray() {
        let turned = |desc: CameraDesc| CameraDesc { look_at: [0.5, -1.0, 0.2], up: [0.1, 1.0, 0.2], ..desc };
        let eye = CameraDesc::new([1.0, 2.0, 10.0]);
        let matrix = CameraDesc {
            focal_length_px: Some([525.25, 917.5]),
            principal_point_px: Some([-300.75, 251.125]),
            ..eye.clone()
        };
        for desc in [
            eye.clone(),
            turned(eye.clone()),
            turned(CameraDesc { fov_y_deg: Some(170.0), ..eye.clone() }),
            turned(CameraDesc { fov_y_deg: Some(0.5), shift: [3.0, -2.0], ..eye }),
            turned(matrix),
            orthographic(4.0),
            turned(CameraDesc { shift: [0.3, -7.0], ..orthographic(0.02) }),
        ] {
            let camera = compiled(&desc, 1920, 1080);
            // A ray has 32 bits: of its direction, or of where it begins, some 10 m from the origin
            let in_a_metre = 540.0 / f64::from(camera.film_half_size()[1]);
            let rounding = camera.intrinsics().map_or(in_a_metre * 1e-6, |[fx, ..]| fx * 1e-7);
            for (x, y) in [(0.0, 0.0), (960.0, 540.0), (0.5, 1079.5), (1313.25, 77.75), (-20.0, 1100.0)] {
                for distance in [0.01, 1.0, 12.5, 1e6] {
                    let (ray, _) = camera.ray(x, y, 1.0);
                    let ahead = camera.project(ray.o + ray.d.as_dvec3() * distance);
                    let [u, v] = ahead.unwrap_or_else(|| panic!("{desc:?} {x} {y}"));
                    let off = (u - f64::from(x)).abs().max((v - f64::from(y)).abs());
                    assert!(off < 1e-3 + rounding, "{desc:?}: {u} {v} is not {x} {y}");
                    assert_eq!(camera.project(ray.o - ray.d.as_dvec3() * distance), None);
                }
            }
        }
    }

    #[test]
    fn a_shift_is_a_part_of_a_larger_film() {
        // The right upper quarter of a film of twice the size, bit by bit; 12 mm and 24 mm high at the same focal
        // length
        let of = |sensor, shift| CameraDesc {
            focal_length_mm: Some(20.0),
            sensor_height_mm: Some(sensor),
            shift,
            ..CameraDesc::new([1.0, 2.0, 10.0])
        };
        let whole = compiled(&of(24.0, [0.0, 0.0]), 128, 96);
        let quarter = compiled(&of(12.0, [0.5, 0.5]), 64, 48);
        let (large, small) = (
            compiled(&orthographic(4.0), 128, 96),
            compiled(&CameraDesc { shift: [0.5, 0.5], ..orthographic(2.0) }, 64, 48),
        );
        for (whole, part) in [(whole, quarter), (large, small)] {
            for (x, y) in [(0.0, 0.0), (3.25, 40.5), (63.5, 47.5), (64.0, 48.0)] {
                let (a, b) = (whole.local_ray(x + 64.0, y, 0.25), part.local_ray(x, y, 0.25));
                assert_eq!((a.0.o, a.0.d), (b.0.o, b.0.d));
                assert_eq!((a.1.dx, a.1.dy, a.1.origin_dx), (b.1.dx, b.1.dy, b.1.origin_dx));
            }
        }
        // More of the right and of what is above
        assert!(quarter.local_ray(32.0, 24.0, 1.0).0.d.dot(whole.frame().right) > 0.0);
        assert!(quarter.local_ray(32.0, 24.0, 1.0).0.d.dot(whole.frame().up) > 0.0);
    }

    #[test]
    fn intrinsics_in_pixels_are_those_of_a_projection() {
        // An RGB-D camera turned and moved: points before it, where K finds them, and the ray through there
        let [fx, fy, cx, cy] = [525.25, 517.5, 300.75, 251.125];
        let desc = CameraDesc {
            look_at: [0.5, -1.0, 0.0],
            up: [0.1, 1.0, 0.2],
            focal_length_px: Some([fx, fy]),
            principal_point_px: Some([cx, cy]),
            ..CameraDesc::new([1.0, 2.0, 10.0])
        };
        let camera = compiled(&desc, 640, 480);
        assert_eq!(camera.intrinsics(), Some([fx, fy, cx, cy]));
        let Frame { position, right, up, forward, .. } = *camera.frame();
        for x in [-1.5, 0.0, 0.4, 2.0] {
            for (y, z) in [(-1.25, 3.0), (0.0, 5.0), (1.75, 9.0)] {
                let (u, v) = (fx * x / z + cx, fy * y / z + cy);
                let p = right.as_dvec3() * x - up.as_dvec3() * y + forward.as_dvec3() * z;
                let (ray, differential) = camera.ray(u as f32, v as f32, 1.0);
                assert!((ray.d.as_dvec3() - p.normalize()).length() < 2e-7, "{u} {v}");
                assert_eq!(ray.o, position);
                // A pixel to the right is 1 / fx at distance 1
                let step = differential.dx.length() as f64 * p.length() / z * fx;
                assert!((step - 1.0).abs() < 1e-6, "{step}");
            }
        }
        // Square pixels and the middle are a field of view
        let fov = 2.0 * pxfm::f_atan(240.0 / 600.0) * 180.0 / std::f64::consts::PI;
        let eye = [0.0, 0.0, 5.0];
        let square = compiled(&CameraDesc { focal_length_px: Some([600.0; 2]), ..CameraDesc::new(eye) }, 640, 480);
        let usual = compiled(&CameraDesc { fov_y_deg: Some(fov), ..CameraDesc::new(eye) }, 640, 480);
        assert_eq!((square.film_half_size(), square.film_shift()), (usual.film_half_size(), [0.0; 2]));
        let k = usual.intrinsics().unwrap_or_default();
        assert!((k[0] - 600.0).abs() < 1e-4 && (k[1] - 600.0).abs() < 1e-4 && k[2..] == [320.0, 240.0], "{k:?}");
    }

    #[test]
    fn a_transform_moves_the_camera_and_keeps_right_angles() {
        let moved = |scale: ScaleDesc| CameraDesc {
            transform: Some(Box::new(TransformDesc {
                rotate_deg: [0.0, 90.0, 0.0],
                translate: [0.0, 5.0, 0.0],
                scale,
                ..TransformDesc::default()
            })),
            ..CameraDesc::new([0.0, 0.0, 10.0])
        };
        let camera = compiled(&moved(1.0.into()), 100, 100);
        let Frame { position, right, up, forward, .. } = *camera.frame();
        assert_eq!((position, forward), (DVec3::new(10.0, 5.0, 0.0), Vec3::NEG_X));
        assert_eq!((right, up), (Vec3::NEG_Z, Vec3::Y));
        // Stretched and mirrored: the directions stay those of a frame
        let Frame { right, up, forward, .. } = *compiled(&moved([-1.0, 3.0, 2.0].into()), 100, 100).frame();
        assert_eq!(right.cross(up), -forward);
    }
}
