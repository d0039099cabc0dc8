//! Rays that come from far away: where they begin, so that 32 bits are enough.
//!
//! A direction in 32 bits is known to 6e-8 of a radian, and a place to as much of its coordinates. From a distance of
//! many times the size of what is there, that is more than a pixel of a narrow picture. Such a ray begins where the
//! scene does: the way up to there is computed in 64 bits.

use super::Scene;
use super::geometry::Geometry;
use crate::camera::Camera;
use crate::light::Light;
use crate::math::{DVec3, Ray, WorldRay};

/// A scene is far away if it begins more than this many of its radii away.
const FAR: f64 = 64.0;

/// A ball around all that rays can meet but for planes, in the scene's own coordinates: its middle and its radius.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SceneBall {
    middle: DVec3,
    radius: f64,
}

impl SceneBall {
    /// Around shapes and the lights that cameras see. `None` where nothing has an end.
    pub fn new(geometry: &Geometry, lights: &[Light]) -> Option<SceneBall> {
        let lights = lights.iter().filter_map(Light::area).filter(|area| area.visible).map(|area| area.shape.bounds());
        let [low, high] =
            geometry.bounds().into_iter().chain(lights).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])?;
        Some(SceneBall { middle: (low + high) * 0.5, radius: (high - low).length() * 0.5 })
    }

    /// How far along a line from `o`, in lengths of `d`, which is a unit vector as far as 32 bits tell, the plane is
    /// that is perpendicular to `d` and touches the near side of the ball; `None` unless that is far.
    fn begins(&self, o: DVec3, d: DVec3) -> Option<f64> {
        let ahead = (d.dot(self.middle - o) - self.radius * d.length()) / d.length_squared();
        (ahead > FAR * self.radius).then_some(ahead)
    }
}

impl Geometry {
    /// Whether no plane lies between some places: all are on the same side of each.
    fn is_open_between(&self, places: &[DVec3]) -> bool {
        self.unbounded.iter().all(|thing| {
            let (thing, plane) = self.plane(*thing);
            let (point, normal) = plane.place();
            let height = |q: &DVec3| normal.dot(thing.placement.object_from_world.transform_point3(*q) - point);
            places.iter().all(|q| height(q) > 0.0) || places.iter().all(|q| height(q) < 0.0)
        })
    }
}

/// The camera with rays that begin where the scene does, if that is far from it.
pub(super) fn approach(
    camera: Camera,
    [width, height]: [u32; 2],
    geometry: &Geometry,
    ball: Option<&SceneBall>,
) -> Camera {
    let frame = camera.frame();
    let Some((ball, near)) = ball.and_then(|ball| {
        let eye = frame.position - frame.origin;
        Some((ball, ball.begins(eye, frame.sight)?))
    }) else {
        return camera;
    };
    let corners = |camera: &Camera| {
        let (w, h) = (width as f32, height as f32);
        [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)].map(|(x, y)| camera.local_ray(x, y, 1.0).0.o.as_dvec3())
    };
    // A step back, until no infinite plane cuts the near film
    let nearer = [0.0, 4.0, 16.0, 64.0].map(|radii| camera.starting_at(near - radii * ball.radius));
    let is_open = |nearer: &Camera| geometry.is_open_between(&[corners(&camera), corners(nearer)].concat());
    nearer.into_iter().find(is_open).unwrap_or(camera)
}

impl Scene {
    /// A ray of the world in the scene's own coordinates, and how far along it that begins.
    #[inline]
    pub(crate) fn enter(&self, ray: &WorldRay) -> (Ray, f64) {
        let (o, d) = (ray.o - self.origin, ray.d.as_dvec3());
        let way = self.ball.as_ref().and_then(|ball| ball.begins(o, d));
        let way = way.filter(|way| self.geometry.is_open_between(&[o, o + d * *way])).unwrap_or(0.0);
        (Ray { o: (o + d * way).as_vec3(), d: ray.d }, way)
    }
}
