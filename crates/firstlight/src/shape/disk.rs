//! Disks and rings.

use std::f64::consts::PI;

use glam::DVec2;

use super::solid::{Solid, SolidHit, SolidPoint, turn};
use super::surface::UvEdge;
use crate::context::CompileContext;
use crate::describe::table;
use crate::math::{DRay, DVec3, Frame};

table! {
    /// A flat disk, or a ring. u runs around it counterclockwise as seen from the front, v from 0 at the rim to 1 at the
    /// centre, or at the inner edge of a ring. u is 1/2 towards +x, or towards +y where the normal is within 26 degrees of
    /// the x axis.
    ///
    /// ```toml
    /// [[disk]]
    /// center = [0, 0, 0]
    /// normal = [0, 1, 0]
    /// radius = 2
    /// inner_radius = 0.5
    /// ```
    pub struct DiskDesc {
        /// Centre, in metres, world space.
        pub center: [f64; 3],
        /// The direction its front faces, of any length above 1e-9.
        pub normal: [f64; 3] = [0.0, 1.0, 0.0],
        /// Radius in metres, 1e-9 to 2.5e8.
        pub radius: f64,
        /// The radius of the hole in the middle, in metres; 0 or more, and smaller than `radius`.
        pub inner_radius: f64 = 0.0,
        /// What reports and id files call it.
        pub name: Option<String> = None,
        /// The name of a material; without it, matte gray 0.8.
        pub material: Option<String> = None,
        /// Whether camera rays pass through from behind, the side the normal points away from. Light is blocked
        /// from both sides all the same.
        pub single_sided: bool = false,
    }
}

/// A disk, ready to be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Disk {
    center: DVec3,
    /// z is the normal, angles are counted from x.
    frame: Frame,
    radius: f64,
    inner: f64,
}

impl DiskDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Solid {
        cx.point("center", self.center);
        cx.edge("normal", self.normal);
        let radius = cx.positive("radius", self.radius, "the radius is in metres");
        let inner = self.inner_radius;
        if !(inner >= 0.0 && inner < radius) {
            let message = format!("{inner} is outside [0, {radius})");
            cx.error("inner_radius", message, Some("the hole is smaller than the disk; 0 is no hole"));
        }
        let frame = Frame::around(DVec3::from(self.normal).normalize_or(DVec3::Y));
        Solid::Disk(Disk { center: self.center.into(), frame, radius, inner })
    }
}

impl Disk {
    #[inline(always)]
    pub fn intersect(&self, ray: &DRay, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        let cos = self.frame.z.dot(ray.d);
        if single_sided && cos >= 0.0 {
            return None;
        }
        let from = ray.o - self.center;
        let t = -self.frame.z.dot(from) / cos;
        if !(t > t_min && t < t_max) {
            return None;
        }
        let distance2 = (from + ray.d * t).length_squared();
        let inside = distance2 <= self.radius * self.radius && distance2 >= self.inner * self.inner;
        inside.then_some(SolidHit { t, part: 0 })
    }

    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        let hit = self.frame.local(ray.o - self.center + ray.d * hit.t).truncate();
        let on = ring_point(hit, self.radius, self.inner);
        let world = |v: DVec2| self.frame.x * v.x + self.frame.y * v.y;
        SolidPoint {
            p: self.center + world(on.p),
            normal: self.frame.z,
            uv: on.uv,
            dpdu: world(on.dpdu),
            dpdv: world(on.dpdv),
            edges: [UvEdge::Periodic, UvEdge::Bounded],
            terms: self.center.abs() + self.frame.disk_reach() * self.radius,
        }
    }

    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let reach = self.frame.disk_reach() * self.radius;
        Some([self.center - reach, self.center + reach])
    }
}

/// A point of a ring around the origin, with its texture coordinate.
pub(super) struct RingPoint {
    pub p: DVec2,
    pub uv: DVec2,
    pub dpdu: DVec2,
    pub dpdv: DVec2,
}

/// u around, v from 0 at `radius` to 1 at `inner`, where `p` is moved to if rounding has put it outside.
pub(super) fn ring_point(p: DVec2, radius: f64, inner: f64) -> RingPoint {
    let outwards = p.normalize_or(DVec2::X);
    let distance = p.length().clamp(inner, radius);
    RingPoint {
        p: outwards * distance,
        uv: DVec2::new(turn(outwards.x, outwards.y), (radius - distance) / (radius - inner)),
        dpdu: outwards.perp() * (2.0 * PI * distance),
        dpdv: outwards * (inner - radius),
    }
}
