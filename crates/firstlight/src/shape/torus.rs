//! Tori.

use std::f64::consts::PI;

use glam::DVec2;

use super::solid::{Solid, SolidHit, SolidPoint, turn};
use super::surface::UvEdge;
use crate::context::CompileContext;
use crate::describe::table;
use crate::math::{DRay, DVec3, Frame, bracketed, depressed_cubic};

table! {
    /// A ring: a tube bent round into a circle. Where the tube is thicker than the circle the ring has no hole, and only
    /// its outside counts.
    ///
    /// u runs around the axis, to the right as seen from outside with the axis upwards; it is 1/2 towards +x, or towards
    /// +y where the axis is within 26 degrees of the x axis. v runs around the tube, upwards as seen from outside: 1/2
    /// farthest from the axis, 3/4 at the top, 0 and 1 where the tube is nearest to the axis.
    ///
    /// ```toml
    /// [[torus]]
    /// center = [0, 0.25, 0]
    /// major_radius = 1
    /// minor_radius = 0.25
    /// material = "rubber"
    /// ```
    pub struct TorusDesc {
        /// Centre, in metres, world space.
        pub center: [f64; 3],
        /// The direction the ring is round about, of any length above 1e-9.
        pub axis: [f64; 3] = [0.0, 1.0, 0.0],
        /// From the centre to the middle of the tube, in metres, 1e-9 to 2.5e8.
        pub major_radius: f64,
        /// The radius of the tube, in metres, 1e-9 to 2.5e8.
        pub minor_radius: f64,
        /// What reports and id files call it.
        pub name: Option<String> = None,
        /// The name of a material; without it, matte gray 0.8.
        pub material: Option<String> = None,
        /// Whether camera rays pass through its inside. Light is blocked from both sides all the same.
        pub single_sided: bool = false,
    }
}

/// A torus, ready to be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Torus {
    center: DVec3,
    /// z is the axis, angles are counted from x.
    frame: Frame,
    major: f64,
    minor: f64,
}

impl TorusDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Solid {
        cx.point("center", self.center);
        cx.edge("axis", self.axis);
        let major =
            cx.positive("major_radius", self.major_radius, "from the centre to the middle of the tube, in metres");
        let minor = cx.positive("minor_radius", self.minor_radius, "the radius of the tube, in metres");
        let frame = Frame::around(DVec3::from(self.axis).normalize_or(DVec3::Y));
        Solid::Torus(Torus { center: self.center.into(), frame, major, minor })
    }
}

impl Torus {
    /// How far a point is from the surface, negative inside the tube, and how that changes along `d`.
    #[inline(always)]
    fn distance(&self, p: DVec3, d: DVec3) -> (f64, f64) {
        let from_axis = p.truncate().length();
        let from_circle = DVec2::new(from_axis - self.major, p.z);
        let distance = from_circle.length();
        let slope = from_circle.dot(DVec2::new(p.truncate().dot(d.truncate()) / from_axis, d.z)) / distance;
        (distance - self.minor, slope)
    }

    /// The line meets the torus where a polynomial of degree four is 0. Its coefficients know the roots badly where two are
    /// close, so they are asked only where the line turns around in it: the three roots of its derivative, which as a
    /// cubic in the distance from the point nearest to the centre has no square. Between those the torus is entered or
    /// left at most once, and the signs of the distance to the torus, which loses nothing, say whether; the place is found
    /// by Newton's method on the distance, held between the two.
    #[inline]
    pub fn intersect(&self, ray: &DRay, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        let (near, shift) = ray.nearest_to(self.center);
        // The line's way through the ball around the torus, in metres
        let outer = (self.major + self.minor) * (1.0 + 1e-9);
        let half2 = outer * outer - near.o.length_squared();
        if !(half2 >= 0.0) {
            return None;
        }
        let speed = near.d.length();
        let (o, d) = (self.frame.local(near.o), self.frame.local(near.d) / speed);
        let (mut low, mut high) = (-half2.sqrt(), half2.sqrt());
        // And through the slab that it fills
        let thick = self.minor * (1.0 + 1e-9);
        if d.z == 0.0 {
            if o.z.abs() > thick {
                return None;
            }
        } else {
            let (a, b) = ((-thick - o.z) / d.z, (thick - o.z) / d.z);
            low = low.max(a.min(b));
            high = high.min(a.max(b));
        }
        if !(low < high) {
            return None;
        }
        // With s the way from the nearest point: F = (s^2 + k)^2 - 4 R^2 |(o + s d) across the axis|^2, a quarter of whose
        // derivative is s^3 + (k - 2 R^2 d.d) s - 2 R^2 o.d
        let (across, major2) = (d.truncate(), self.major * self.major);
        let k = o.length_squared() + (self.major - self.minor) * (self.major + self.minor);
        let p = k - 2.0 * major2 * across.length_squared();
        let q = -2.0 * major2 * o.truncate().dot(across);
        let (count, turns) = depressed_cubic(p, q, low, high);
        // From piece to piece, as long as they lie before t_max
        let at = |s: f64| self.distance(o + d * s, d);
        let mut start = low;
        let mut inside = false;
        for i in 0..=count {
            let end = if i < count { turns[i] } else { high };
            let ends_inside = i < count && at(end).0 < 0.0;
            if ends_inside != inside {
                let t = bracketed(start, end, inside, at) / speed + shift;
                // Leaving it is to see it from behind
                if t > t_min && (ends_inside || !single_sided) {
                    return (t < t_max).then_some(SolidHit { t, part: 0 });
                }
            }
            (start, inside) = (end, ends_inside);
        }
        None
    }

    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        let at = self.frame.local(ray.o - self.center + ray.d * hit.t);
        // The direction to the point of the circle, then that to the surface of the tube
        let outwards = at.truncate().normalize_or(DVec2::X);
        let tube = DVec2::new(at.truncate().length() - self.major, at.z).normalize_or(DVec2::X);
        let from_axis = self.major + self.minor * tube.x;
        let world = |along: f64, z: f64| self.frame.world((outwards * along).extend(z));
        SolidPoint {
            p: self.center + world(from_axis, self.minor * tube.y),
            normal: world(tube.x, tube.y),
            uv: DVec2::new(turn(outwards.x, outwards.y), turn(tube.x, tube.y)),
            dpdu: self.frame.world(outwards.perp().extend(0.0)) * (2.0 * PI * from_axis),
            dpdv: world(-tube.y, tube.x) * (2.0 * PI * self.minor),
            edges: [UvEdge::Periodic; 2],
            terms: self.center.abs() + DVec3::splat(self.major + self.minor),
        }
    }

    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let reach = self.frame.disk_reach() * self.major + DVec3::splat(self.minor);
        Some([self.center - reach, self.center + reach])
    }
}
