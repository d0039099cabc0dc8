//! From the space of a thing to the world, and back.

use glam::{DAffine3, DMat3};

use super::solid::{Solid, SolidHit, SolidPoint};
use super::surface::{Footprint, RayDifferential, ShapePoint};
use crate::color::Rgb;
use crate::math::{DRay, DVec3, ErrorBound, Ray, UNIT_ROUNDOFF, Vec2, Vec3};

/// From a thing's own space to the world, and back. In f64: what is far from the origin keeps its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub world_from_object: DAffine3,
    pub object_from_world: DAffine3,
}

/// The matrix of the sizes of the terms of a product.
fn abs(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}

impl Placement {
    /// `world_from_object` is not singular.
    pub fn new(world_from_object: DAffine3) -> Self {
        Placement { world_from_object, object_from_world: world_from_object.inverse() }
    }

    /// A ray of the world as one of the object: the same `t` means the same point.
    #[inline(always)]
    pub fn ray(&self, ray: &Ray) -> DRay {
        self.line(ray.o, ray.d)
    }

    /// The line from `o` along `d`, of any length, in the object's space.
    #[inline(always)]
    pub fn line(&self, o: Vec3, d: Vec3) -> DRay {
        let m = &self.object_from_world;
        DRay { o: m.transform_point3(o.as_dvec3()), d: m.transform_vector3(d.as_dvec3()) }
    }

    /// A normal of the object as one of the world, not of unit length. Outward stays outward, mirrored or not.
    #[inline(always)]
    pub fn normal(&self, n: DVec3) -> DVec3 {
        self.object_from_world.matrix3.transpose() * n
    }

    /// The sizes of the terms of `world_from_object` times a point with coordinates up to `p`, along each axis.
    #[inline(always)]
    pub fn terms(&self, p: DVec3) -> DVec3 {
        self.reach(p) + self.world_from_object.translation.abs()
    }

    /// A bound on the error of a point of the world, along each axis of the object.
    #[inline(always)]
    pub fn error_in_object(&self, error: ErrorBound) -> DVec3 {
        abs(self.object_from_world.matrix3) * error.0.as_dvec3()
    }

    /// How far a displacement of at most `p` along each axis of the object can lead in the world.
    #[inline(always)]
    pub fn reach(&self, p: DVec3) -> DVec3 {
        abs(self.world_from_object.matrix3) * p
    }

    /// The box of the world around a box of the object, with room for the rounding of rays that are taken to the
    /// object's space and to f32 there.
    pub fn bounds(&self, [low, high]: [DVec3; 2]) -> [DVec3; 2] {
        let center = self.world_from_object.transform_point3((low + high) * 0.5);
        let half = self.reach((high - low) * 0.5);
        let largest = center.abs() + half * 2.0;
        let there = abs(self.object_from_world.matrix3) * largest + self.object_from_world.translation.abs();
        let room = self.reach(there) * (4.0 * UNIT_ROUNDOFF as f64);
        [center - half - room, center + half + room]
    }

    /// What `ray`, which met `solid` there, sees.
    pub fn solid_point(&self, solid: &Solid, hit: &SolidHit, ray: &Ray, differential: &RayDifferential) -> ShapePoint {
        let at = solid.point(&self.ray(ray), hit);
        let SolidPoint { p: own, normal, uv, edges, terms, .. } = at;
        let p = self.world_from_object.transform_point3(own).as_vec3();
        let error = ErrorBound::of_rounded(p, self.terms(terms));
        let normal = self.normal(normal).normalize_or(DVec3::Y).as_vec3();
        // Steps on the surface as steps of uv
        let [dx, dy] = match differential.is_zero() {
            true => [Vec2::ZERO; 2],
            false => {
                let steps = differential.on_plane(ray.d, hit.t as f32, normal, f32::MAX.sqrt() * 0.5);
                steps.map(|dp| at.uv_step(self.object_from_world.transform_vector3(dp.as_dvec3())).as_vec2())
            }
        };
        ShapePoint {
            p,
            error,
            normal,
            shading: normal,
            lifted: None,
            uv: uv.as_vec2(),
            footprint: Footprint { dx, dy, edges },
            color: Rgb::WHITE,
            alpha: 1.0,
        }
    }

    /// How the unit normal changes from the point of `solid` that `ray` met there with each step.
    pub fn solid_normal_steps(
        &self,
        solid: &Solid,
        hit: &SolidHit,
        ray: &Ray,
        differential: &RayDifferential,
    ) -> [Vec3; 2] {
        let unit = |n: DVec3| self.normal(n).normalize_or(DVec3::Y);
        let at = solid.point(&self.ray(ray), hit);
        let normal = unit(at.normal);
        let steps = differential.on_plane(ray.d, hit.t as f32, normal.as_vec3(), f32::MAX.sqrt() * 0.5);
        steps.map(|dp| {
            // A point beside the surface has the normal of the one below it
            let o = at.p + self.object_from_world.transform_vector3(dp.as_dvec3());
            let moved = solid.point(&DRay { o, d: DVec3::ZERO }, &SolidHit { t: 0.0, ..*hit });
            (unit(moved.normal) - normal).as_vec3()
        })
    }

    /// How the point of `solid` that `ray` met there moves with u and with v.
    pub fn solid_tangents(&self, solid: &Solid, hit: &SolidHit, ray: &Ray) -> [DVec3; 2] {
        let SolidPoint { dpdu, dpdv, .. } = solid.point(&self.ray(ray), hit);
        [dpdu, dpdv].map(|d| self.world_from_object.transform_vector3(d))
    }
}
