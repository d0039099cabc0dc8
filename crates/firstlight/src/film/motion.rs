//! Optical flow: where the point that a pixel shows lies in another picture of the scene, at another time or from
//! another camera.

use fearless_simd::Level;

use super::centers::Center;
use crate::camera::Camera;
use crate::math::{DVec3, Ray, UNIT_ROUNDOFF};
use crate::scene::{Hit, Scene};
use crate::shape::RayDifferential;

/// Pixels to the right and down, and the visibility there: 1 visible, 0 occluded, -1 outside of what the camera images.
pub(super) type Flow = [f32; 3];

/// Error bound of the position of a point that is computed in one scene and found again in another, in units of the
/// last place of 32 bits: the rounding of the point, of the ray to it, and of the surface there.
const ROUNDINGS: u32 = 32;

/// The flow of the hit of a centre ray.
pub(super) fn of_thing(center: &Center, there: &Scene, level: Level) -> Flow {
    let (here, p, front) = (center.scene, center.p(), center.front().as_dvec3());
    let surface = center.hit.surface;
    let [from, to] = [here, there].map(|scene| scene.space_of(surface));
    // What does not move stays, to the bit
    let (moved, turned) = if from == to {
        (p, front)
    } else {
        let there_from_here = to * from.inverse();
        (there_from_here.transform_point3(p), there_from_here.matrix3.inverse().transpose() * front)
    };
    let (Some((before, _)), Some((after, depth))) = (here.camera.local_project(p), there.camera.local_project(moved))
    else {
        return nowhere();
    };
    flow(before, after, || {
        depth > 0.0 && is_inside(there, after) && is_seen(center, there, level, moved, turned, after)
    })
}

/// The flow of a centre ray without a hit: of its end, infinitely far away.
pub(super) fn of_nothing(here: &Scene, there: &Scene, ray: &Ray, level: Level) -> Flow {
    let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
    let from_there = o + (here.origin - there.origin);
    let ends = (here.camera.local_project_end(o, d), there.camera.local_project_end(from_there, d));
    let (Some(before), Some(after)) = ends else { return nowhere() };
    flow(before, after, || is_inside(there, after) && first_at(there, level, &ray_at(&there.camera, after)).is_none())
}

fn flow(before: [f64; 2], after: [f64; 2], is_seen: impl FnOnce() -> bool) -> Flow {
    let [x, y] = [0, 1].map(|axis| (after[axis] - before[axis]) as f32);
    if !(x.is_finite() && y.is_finite()) {
        return nowhere();
    }
    [x, y, f32::from(u8::from(is_seen()))]
}

/// The flow of a point that has no image in the other picture.
fn nowhere() -> Flow {
    [0.0, 0.0, -1.0]
}

fn is_inside(scene: &Scene, [x, y]: [f64; 2]) -> bool {
    (0.0..f64::from(scene.width)).contains(&x) && (0.0..f64::from(scene.height)).contains(&y)
}

fn ray_at(camera: &Camera, [x, y]: [f64; 2]) -> Ray {
    camera.local_ray(x as f32, y as f32, 1.0).0
}

/// What a ray through a point shows.
fn first_at(scene: &Scene, level: Level, ray: &Ray) -> Option<Hit> {
    scene.shown(ray, &RayDifferential::default(), scene.intersect_at(level, ray))
}

/// The error bound of a coordinate of that size.
fn roundings(size: f64) -> f64 {
    size * f64::from(UNIT_ROUNDOFF) * f64::from(ROUNDINGS)
}

/// Whether a camera ray through `pixel` in another scene ends at the point of `center`, which is at `p` there. `front`
/// is the normal of its front there, of any length.
fn is_seen(center: &Center, there: &Scene, level: Level, p: DVec3, front: DVec3, pixel: [f64; 2]) -> bool {
    let ray = ray_at(&there.camera, pixel);
    let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
    let t = (p - o).dot(d) / d.length_squared();
    let error = center.error() + roundings(center.p().abs().max(p.abs()).max_element()) + roundings(t.abs());
    let is_front = front.dot(d) < 0.0;
    let faces = is_front == center.is_front();
    let Some(hit) = first_at(there, level, &ray) else {
        // At an edge that the ray just misses; or it is the side that rays pass through
        return faces;
    };
    let gap = t - hit.t;
    if hit.surface == center.hit.surface {
        let met = Center::new(there, ray, Default::default(), hit);
        // Along a slanting ray a little beside the point is far along the ray: what counts is how far the point is off
        // the plane that was met. The far side of something round is met from the other side
        let height = gap * met.normals()[0].as_dvec3().dot(d);
        if height.abs() <= error + met.error() && met.is_front() == is_front {
            return true;
        }
    }
    gap <= error && faces
}
