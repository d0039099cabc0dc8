//! Many rays at once, and what points see of a light: the questions of those who make no picture.

use super::{At, Scene};
use crate::ids::{LightId, MaterialId, SurfaceId};
use crate::math::{DVec3, ErrorBound, Facet, ShadowRay, Vec2, Vec3, WorldRay};
use crate::parallel;
use crate::shape::RayDifferential;

/// What a ray meets, with all that can be said of it.
#[derive(Clone, Copy, Debug)]
pub struct CastHit {
    /// How far along the ray, in lengths of its direction.
    pub t: f64,
    /// The point, world space.
    pub p: DVec3,
    /// Geometric normal: unit, on the side that is met.
    pub ng: Vec3,
    /// Shading normal: unit, turned together with `ng`.
    pub ns: Vec3,
    /// Texture coordinate; 0 on lights.
    pub uv: Vec2,
    /// How much the second and the third corner of a triangle count; 0 for all else.
    pub barycentric: Vec2,
    /// What was met.
    pub surface: SurfaceId,
    /// Its material; `None` on lights.
    pub material: Option<MaterialId>,
    /// The triangle of a mesh or the point of a point set, in the order of its file; `None` on all else.
    pub primitive: Option<u32>,
}

/// Rays, or points, that a thread takes at once.
const TOGETHER: usize = 256;

impl Scene {
    /// What each of `count` rays meets first of what a camera can see, on all threads: the answers of
    /// [`intersect`](Self::intersect), and the surfaces there.
    pub fn cast(&self, count: usize, ray: impl Fn(usize) -> WorldRay + Sync) -> Vec<Option<CastHit>> {
        parallel::map(count, TOGETHER, |i| self.cast_one(&ray(i)))
    }

    fn cast_one(&self, ray: &WorldRay) -> Option<CastHit> {
        let (local, way) = self.enter(ray);
        let hit = self.first_shown(&local)?;
        let (t, surface, barycentric) = (hit.t + way, hit.surface, hit.barycentric());
        if let At::Light = hit.at {
            let there = local.o.as_dvec3() + local.d.as_dvec3() * hit.t;
            let area = self.lights[surface.index() - self.geometry.surfaces.len()].area();
            let front = area.map_or(Vec3::ZERO, |area| area.shape.normal_at(there));
            let ng = if front.dot(local.d) > 0.0 { -front } else { front };
            let (p, uv) = (self.origin + there, Vec2::ZERO);
            return Some(CastHit { t, p, ng, ns: ng, uv, barycentric, surface, material: None, primitive: None });
        }
        let si = self.local_surface(&local, &hit, &RayDifferential::default());
        let (p, primitive) = (self.origin + si.p.as_dvec3(), self.geometry.primitive(&hit));
        let material = Some(si.material);
        Some(CastHit { t, p, ng: si.ng, ns: si.ns, uv: si.uv, barycentric, surface, material, primitive })
    }

    /// The share of a light that each of `count` points sees, 0 to 1, on all threads: the share of its
    /// [points](Self::light_points) to which nothing stands in the way; one behind
    /// something that is not opaque counts in part.
    ///
    /// `point(i)` is a place in world space and, if it lies on a surface, the unit normal there: what is below its
    /// horizon is not seen, and the surface itself is not in the way.
    ///
    /// # Panics
    /// If the scene has no such light.
    pub fn visible_fractions(
        &self,
        light: LightId,
        count: usize,
        point: impl Fn(usize) -> (DVec3, Option<Vec3>) + Sync,
    ) -> Vec<f32> {
        let (from, end) = (&self.lights[light.index()], self.light_end(light));
        parallel::map(count, TOGETHER, |i| {
            let (place, normal) = point(i);
            let place = place - self.origin;
            let p = place.as_vec3();
            let error = ErrorBound::of_rounded(p, place.abs()).widened(self.geometry.rounding);
            let floor = normal.map_or(f32::NEG_INFINITY, |n| from.floor(p, error, n));
            let sees = |k: usize| {
                let to = from.towards(k, p);
                if normal.is_some_and(|n| !(n.dot(to.l) > floor)) {
                    return 0.0;
                }
                // Of a place without a normal, what it may lie on is left in the direction of the light
                let away = normal.unwrap_or_else(|| to.l.normalize_or_zero());
                let start = error.offset(p, away).as_vec3();
                let t_max = if to.finite { 1.0 } else { f32::INFINITY };
                self.transmittance(&ShadowRay { p, error, start, l: to.l, t_max, to: end, but: Facet::NONE })
            };
            let all = from.samples();
            (0..all).map(|k| f64::from(sees(k))).sum::<f64>() as f32 / all as f32
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::NoAssets;
    use crate::scene::{CompileOptions, SceneDesc};

    const SCENE: &str = "[camera]\nposition = [0, 0, 9]\n[[light.point]]\nposition = [0, 10, 0]\n\
        [[light.rectangle]]\ncenter = [0, 8, 0]\ne0 = [2, 0, 0]\ne1 = [0, 0, 2]\nvisible = true\nsamples = 16\n\
        [[sphere]]\ncenter = [0, 2, 0]\nradius = 1\n\
        [[mesh]]\npositions = [[-9, 0, 9], [9, 0, 9], [0, 0, -9]]\ntriangles = [[0, 1, 2]]\n";

    fn scene() -> Scene {
        let parsed = SceneDesc::parse("s.toml", SCENE.as_bytes(), &NoAssets);
        parsed.compile(&NoAssets, &CompileOptions::default()).expect("is a scene").scene
    }

    #[test]
    fn rays_meet_what_intersect_says() {
        let scene = scene();
        let down = |x: f64, y: f64| WorldRay { o: DVec3::new(x, y, 0.0), d: Vec3::NEG_Y };
        let up = WorldRay { o: DVec3::new(0.0, 4.0, 0.0), d: Vec3::Y };
        let rays = [down(0.0, 5.0), down(2.0, 5.0), down(50.0, 5.0), up];
        let hits = scene.cast(rays.len(), |i| rays[i]);
        for (ray, hit) in rays.iter().zip(&hits) {
            assert_eq!(hit.map(|hit| (hit.t, hit.surface)), scene.intersect(ray).map(|hit| (hit.t, hit.surface)));
        }
        let hit = |i: usize| hits[i].expect("meets something");
        assert_eq!((hit(0).t, hit(0).p, hit(0).ns), (2.0, DVec3::new(0.0, 3.0, 0.0), Vec3::Y));
        assert_eq!((hit(1).primitive, hit(1).ng), (Some(0), Vec3::Y));
        assert!(hits[2].is_none());
        assert_eq!((hit(3).material, hit(3).ng, hit(3).t), (None, Vec3::NEG_Y, 4.0));
    }

    #[test]
    fn points_see_what_is_not_behind_something() {
        let scene = scene();
        let places = [DVec3::ZERO, DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 3.0, 0.0), DVec3::new(0.0, 1.0, 0.0)];
        let (point, area) = (LightId(0), LightId(1));
        // Under the sphere, beside it, on its top, on its bottom
        assert_eq!(scene.visible_fractions(point, 4, |i| (places[i], None)), [0.0, 1.0, 1.0, 0.0]);
        let normals = [Vec3::Y, Vec3::Y, Vec3::Y, Vec3::NEG_Y];
        assert_eq!(scene.visible_fractions(point, 4, |i| (places[i], Some(normals[i]))), [0.0, 1.0, 1.0, 0.0]);
        let half = scene.visible_fractions(area, 1, |_| (DVec3::new(1.3, 0.0, 0.0), Some(Vec3::Y)))[0];
        assert!(half > 0.0 && half < 1.0, "{half}");
        // From below the plate nothing is seen
        assert_eq!(scene.visible_fractions(area, 1, |_| (DVec3::new(0.0, -1.0, 0.0), None)), [0.0]);
    }
}
