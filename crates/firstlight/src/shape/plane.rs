//! Infinite planes.

use super::rectangle::facing;
use super::solid::{Solid, SolidHit, SolidPoint};
use super::surface::UvEdge;
use crate::context::CompileContext;
use crate::describe::table;
use crate::math::{DRay, DVec3, Frame};

table! {
    /// A plane without end (it is let go 1e9 m from `point`). The texture coordinate is the distance from `point` in metres, to the right and up as seen
    /// from the side the normal points to; it goes on for ever, and so does a checkerboard.
    ///
    /// ```toml
    /// [[plane]]
    /// point = [0, 0, 0]
    /// normal = [0, 1, 0]
    /// material = "floor"
    /// ```
    pub struct PlaneDesc {
        /// A point of it, in metres, world space, where u = v = 0.
        pub point: [f64; 3] = [0.0, 0.0, 0.0],
        /// The direction its front faces, of any length above 1e-9.
        pub normal: [f64; 3] = [0.0, 1.0, 0.0],
        /// The direction of v, made perpendicular to `normal`; not parallel to it. Without it +y; of a plane that faces
        /// straight up -z, straight down +z.
        pub up: Option<[f64; 3]> = None,
        /// What reports and id files call it.
        pub name: Option<String> = None,
        /// The name of a material; without it, matte gray 0.8.
        pub material: Option<String> = None,
        /// Whether camera rays pass through from behind, the side the normal points away from. Light is blocked
        /// from both sides all the same.
        pub single_sided: bool = false,
    }
}

/// A plane, ready to be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    /// Where u = v = 0.
    point: DVec3,
    /// u, v and the normal.
    frame: Frame,
}

impl PlaneDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Solid {
        cx.point("point", self.point);
        Solid::Plane(Plane { point: self.point.into(), frame: facing(cx, self.normal, self.up) })
    }
}

/// What is farther from `point` than this is not computed with, in metres: squares of squares of coordinates stay finite in
/// f32. Far beyond where any pixel could tell.
const REACH: f64 = 1e9;

impl Plane {
    #[inline(always)]
    pub fn intersect(&self, ray: &DRay, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        let cos = self.frame.z.dot(ray.d);
        if single_sided && cos >= 0.0 {
            return None;
        }
        let from = ray.o - self.point;
        let t = -self.frame.z.dot(from) / cos;
        if !(t > t_min && t < t_max) {
            return None;
        }
        let near = (from + ray.d * t).length_squared() <= REACH * REACH;
        near.then_some(SolidHit { t, part: 0 })
    }

    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        // In the frame the point is on the plane, however far the ray has come
        let hit = self.frame.local(ray.o - self.point + ray.d * hit.t).truncate();
        let offset = self.frame.x * hit.x + self.frame.y * hit.y;
        SolidPoint {
            p: self.point + offset,
            normal: self.frame.z,
            uv: hit,
            dpdu: self.frame.x,
            dpdv: self.frame.y,
            edges: [UvEdge::Unbounded; 2],
            terms: self.point.abs() + self.frame.x.abs() * hit.x.abs() + self.frame.y.abs() * hit.y.abs(),
        }
    }

    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        None
    }
}
