//! Boxes.

use glam::DVec2;

use super::solid::{Chord, Solid, SolidHit, SolidPoint};
use super::surface::UvEdge;
use crate::context::CompileContext;
use crate::describe::table;
use crate::math::{DRay, DVec3, Frame};

table! {
    /// A box along the axes of the world, with an outside and an inside. Each of its six faces carries the whole texture,
    /// from 0 to 1 to the right and up as seen from outside: up is +y on the four walls, -z on the top and +z on the
    /// bottom, as on a `[[rectangle]]` that faces the same way.
    ///
    /// ```toml
    /// [[box]]
    /// center = [0, 0.5, 0]
    /// size = [1, 1, 1]
    /// material = "wood"
    /// ```
    pub struct BoxDesc {
        /// Centre, in metres, world space.
        pub center: [f64; 3],
        /// Lengths along x, y and z in metres, 1e-9 to 2.5e8 each.
        pub size: [f64; 3] = [1.0, 1.0, 1.0],
        /// What reports and id files call it.
        pub name: Option<String> = None,
        /// The name of a material; without it, matte gray 0.8.
        pub material: Option<String> = None,
        /// Whether camera rays pass through its inside. Light is blocked from both sides all the same.
        pub single_sided: bool = false,
    }
}

/// A box, ready to be hit. Its parts are its faces: those of -x, +x, -y, +y, -z, +z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cuboid {
    low: DVec3,
    high: DVec3,
}

impl BoxDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Solid {
        cx.point("center", self.center);
        for (i, size) in self.size.iter().enumerate() {
            cx.positive(&format!("size[{i}]"), *size, "the lengths along x, y and z are in metres");
        }
        let (center, half) = (DVec3::from(self.center), DVec3::from(self.size) * 0.5);
        Solid::Cuboid(Cuboid { low: center - half, high: center + half })
    }
}

impl Cuboid {
    #[inline(always)]
    pub fn intersect(&self, ray: &DRay, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        let mut chord = Chord::LINE;
        for axis in 0..3 {
            let part = 2 * axis as u8;
            chord.cut_slab(ray.o[axis], ray.d[axis], self.low[axis], self.high[axis], part, part + 1);
        }
        chord.first(0.0, t_min, t_max, single_sided)
    }

    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        let (axis, positive) = (hit.part as usize / 2, hit.part % 2 == 1);
        let mut p = ray.at(hit.t).max(self.low).min(self.high);
        p[axis] = if positive { self.high[axis] } else { self.low[axis] };
        let mut normal = DVec3::ZERO;
        normal[axis] = if positive { 1.0 } else { -1.0 };
        // As on a rectangle that faces the same way
        let face = Frame::facing(normal, None).unwrap_or(Frame::around(normal));
        let size = self.high - self.low;
        let along = |way: DVec3| {
            let from = if way.element_sum() > 0.0 { p - self.low } else { p - self.high };
            from.dot(way) / size.dot(way.abs())
        };
        SolidPoint {
            p,
            normal,
            uv: DVec2::new(along(face.x), along(face.y)),
            dpdu: face.x * size,
            dpdv: face.y * size,
            edges: [UvEdge::Bounded; 2],
            terms: self.low.abs().max(self.high.abs()),
        }
    }

    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        Some([self.low, self.high])
    }
}
