//! The sphere lights that stand in the way of others, in a tree of boxes where they are many.

use std::sync::Arc;

use fearless_simd::Level;

use super::occluders::Listed;
use crate::accel::{Aabb, Bvh, TraceRay};
use crate::math::{DVec3, ShadowRay};
use crate::shape::Sphere;

/// A tree over spheres.
#[derive(Clone)]
pub(crate) struct LightSpheres {
    tree: Arc<Bvh>,
    /// Farther from the origin than this, in metres, rounding may leave the boxes.
    far: f32,
}

/// So many are asked one by one.
const LISTED: usize = 24;
/// Room in the boxes for the rounding of the spheres' own tests: as a part of the radius, and of the distance. Those
/// are below 2e-4 and below 1e-6.
const ROOM: [f64; 2] = [1e-3, 5e-6];
/// So many times as far as the spheres may what asks be.
const AROUND: f64 = 16.0;

impl std::fmt::Debug for LightSpheres {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "LightSpheres({})", self.far)
    }
}

impl LightSpheres {
    pub fn new(spheres: &[Listed<Sphere>]) -> Option<LightSpheres> {
        if spheres.len() <= LISTED {
            return None;
        }
        let far = spheres.iter().fold(0.0f64, |far, Listed { shape, .. }| far.max(shape.c.length() + shape.r)) * AROUND;
        let boxes: Vec<Aabb> = spheres
            .iter()
            .map(|Listed { shape, .. }| {
                let [low, high] = shape.bounds();
                let room = DVec3::splat(ROOM[0] * shape.r + ROOM[1] * far);
                Aabb { min: (low - room).as_vec3(), max: (high + room).as_vec3() }
            })
            .collect();
        boxes.iter().all(Aabb::is_sound).then(|| LightSpheres { tree: Arc::new(Bvh::build(&boxes)), far: far as f32 })
    }

    /// Whether any sphere that `blocks` says so of lies on the ray; `None` where the tree cannot tell.
    pub fn any(&self, level: Level, ray: &ShadowRay, blocks: impl Fn(u32) -> bool) -> Option<bool> {
        if ray.p.length() > self.far {
            return None;
        }
        Some(self.tree.any_at(level, &TraceRay::new(ray.p, ray.l), ray.t_max, blocks))
    }
}
