//! The lights that a camera can see: in a list while they are few, in a tree of boxes where they are many.

use fearless_simd::Level;

use crate::accel::{Aabb, Bvh, TraceRay};
use crate::light::Light;
use crate::math::Ray;

/// Which lights a camera can see.
pub(crate) struct SeenLights {
    /// By their index.
    pub all: Vec<u32>,
    /// Over those, where they are many.
    tree: Option<Bvh>,
}

/// So many are asked one by one.
const LISTED: usize = 48;

impl std::fmt::Debug for SeenLights {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SeenLights({})", self.all.len())
    }
}

impl SeenLights {
    pub fn new(lights: &[Light]) -> Self {
        let (mut all, mut boxes) = (Vec::new(), Vec::new());
        for (index, light) in lights.iter().enumerate() {
            if let Some(area) = light.area()
                && area.visible
            {
                let [low, high] = area.shape.bounds();
                // Larger than any rounding, of the box or of the test of a shape
                let room = (high - low) * 1e-6 + low.abs().max(high.abs()) * 1e-6;
                all.push(index as u32);
                boxes.push(Aabb { min: (low - room).as_vec3(), max: (high + room).as_vec3() });
            }
        }
        let tree = (all.len() > LISTED && boxes.iter().all(Aabb::is_sound)).then(|| Bvh::build(&boxes));
        SeenLights { all, tree }
    }

    /// Calls `each` with every light that a ray may meet before `limit`, which `each` may make smaller.
    #[inline(always)]
    pub fn meet(&self, level: Level, ray: &Ray, limit: f32, mut each: impl FnMut(u32, &mut f32)) {
        let mut limit = limit;
        match &self.tree {
            None => self.all.iter().for_each(|light| each(*light, &mut limit)),
            Some(tree) => {
                let ray = TraceRay::new(ray.o, ray.d);
                tree.closest_at(level, &ray, &mut limit, |place, limit| each(self.all[place as usize], limit));
            }
        }
    }
}
