//! Sphere lights.

use super::Light;
use super::area::{AreaShape, are_round, area_table};
use crate::context::{CompileContext, show};
use crate::describe::SamplesDesc;
use crate::math::{DVec3, sin_cos_of_turns};
use crate::shape::{Sphere, SphereUv};
use crate::transform::TransformDesc;

area_table! {
    /// A sphere that shines: soft shadows. Its front is the outside.
    ///
    /// Physical: every point sends the radiance L = color x strength to its emitting side;
    /// E = pi L (R / d)^2 cos where all of it is above the horizon, d being the distance of its centre. Constant: the
    /// mean over its whole area of color x strength; what it sends from its far side goes through it.
    ///
    /// ```toml
    /// [[light.sphere]]
    /// center = [0, 3, 0]
    /// radius = 0.25
    /// strength = 10
    /// ```
    pub struct SphereLightDesc {
        /// The centre, in metres, world space.
        pub center: [f64; 3],
        /// Radius in metres, 1e-9 to 2.5e8.
        pub radius: f64,
        /// Where it is moved; it has to leave the sphere round.
        pub transform: Option<Box<TransformDesc>> = None,
    }
}

/// The shape of a sphere light, in world space.
#[derive(Clone, Copy, Debug)]
pub struct SphereLight {
    /// The centre.
    pub center: DVec3,
    /// The radius.
    pub radius: f64,
    /// What the camera sees, and what stands in the way of other lights if it blocks.
    pub(crate) shape: Sphere,
}

impl SphereLightDesc {
    /// `samples` is the scene's default.
    pub(crate) fn compile(&self, cx: &mut CompileContext, samples: SamplesDesc) -> Light {
        cx.point("center", self.center);
        let mut radius = cx.positive("radius", self.radius, "the radius is in metres");
        let mut center = DVec3::from(self.center);
        if let Some(world_from_object) = TransformDesc::compile_field(self.transform.as_deref(), cx) {
            center = cx.moved_point(world_from_object, center);
            let before = cx.fault_count();
            let x = cx.moved_edge(world_from_object, "the radius", DVec3::X * radius);
            let [y, z] = [DVec3::Y, DVec3::Z].map(|axis| world_from_object.transform_vector3(axis * radius));
            if cx.fault_count() == before && !are_round(&[x, y, z]) {
                let [x, y, z] = [x, y, z].map(|v| show(&v.to_array()));
                let message = format!("it makes an ellipsoid of the sphere: {x}, {y} and {z} of three of its radii");
                cx.error("transform", message, Some("scale the sphere alike along x, y and z"));
            }
            radius = x.length();
        }
        let (emitter, center) = (self.emitter(), cx.local(center));
        let single_sided = !emitter.both_sides();
        let shape = Sphere { c: center, r: radius, uv: SphereUv::Equirectangular, single_sided };
        emitter.compile(cx, AreaShape::Sphere(SphereLight { center, radius, shape }), samples)
    }
}

impl SphereLight {
    /// The outward unit normal of the point that stands for `uv` of the unit square: rings of equal height have equal
    /// areas, as Archimedes found.
    #[inline(always)]
    pub(super) fn normal([a, b]: [f64; 2]) -> DVec3 {
        let z = 1.0 - 2.0 * a;
        let ring = (4.0 * a * (1.0 - a)).sqrt();
        let (sin, cos) = sin_cos_of_turns(b);
        DVec3::new(ring * cos, ring * sin, z)
    }
}
