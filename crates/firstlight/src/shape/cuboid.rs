//! Boxes.

use glam::DVec2;

use super::common::shape_table;
use super::solid::{Chord, Solid, SolidHit, SolidPoint};
use super::surface::UvEdge;
use crate::context::CompileContext;
use crate::math::{Axes, DRay, DVec3};

shape_table! {
    /// A box along the axes of the world, with an outside and an inside. Each of its six faces carries the whole
    /// texture, from 0 to 1 to the right and up as seen from outside: up is +y on the four walls, -z on the top and +z
    /// on the bottom, as on a `[[rectangle]]` that faces the same way.
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
    }
}

/// A box, ready to be hit. Its parts are its faces: those of -x, +x, -y, +y, -z, +z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cuboid {
    low: DVec3,
    high: DVec3,
    /// What lies between; far from the origin the difference of the two may round to 0.
    size: DVec3,
}

impl BoxDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Solid {
        cx.point("center", self.center);
        for (i, size) in self.size.iter().enumerate() {
            cx.positive(&format!("size[{i}]"), *size, "the lengths along x, y and z are in metres");
        }
        let (center, size) = (DVec3::from(self.center), DVec3::from(self.size));
        Solid::Cuboid(Cuboid { low: center - size * 0.5, high: center + size * 0.5, size })
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

    /// Whether [`intersect`](Self::intersect) finds anything, from either side. Without branches.
    #[inline(always)]
    pub fn blocks(&self, ray: &DRay, t_min: f64, t_max: f64) -> bool {
        let mut way = [f64::NEG_INFINITY, f64::INFINITY];
        for axis in 0..3 {
            let slab = Chord::slab(ray.o[axis], ray.d[axis], self.low[axis], self.high[axis]);
            way = Chord::cut_ends(way, slab);
        }
        Chord::has_end(way, 0.0, t_min, t_max)
    }

    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        let (axis, positive) = (hit.part as usize / 2, hit.part % 2 == 1);
        let mut p = ray.at(hit.t).max(self.low).min(self.high);
        p[axis] = if positive { self.high[axis] } else { self.low[axis] };
        let mut normal = DVec3::ZERO;
        normal[axis] = if positive { 1.0 } else { -1.0 };
        // As on a rectangle that faces the same way
        let face = Axes::facing(normal, None).unwrap_or(Axes::around(normal));
        let along = |way: DVec3| {
            let from = if way.element_sum() > 0.0 { p - self.low } else { p - self.high };
            from.dot(way) / self.size.dot(way.abs())
        };
        SolidPoint {
            p,
            normal,
            uv: DVec2::new(along(face.x), along(face.y)).clamp(DVec2::ZERO, DVec2::ONE),
            dpdu: face.x * self.size,
            dpdv: face.y * self.size,
            edges: [UvEdge::Bounded; 2],
            terms: self.low.abs().max(self.high.abs()),
        }
    }

    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        Some([self.low, self.high])
    }

    /// From the middle to the corner of all largest coordinates.
    pub fn half(&self) -> DVec3 {
        self.size * 0.5
    }

    pub fn middle(&self) -> DVec3 {
        (self.low + self.high) * 0.5
    }

    /// The most that `d` . x is over it, to within rounding.
    pub fn support(&self, d: DVec3) -> f64 {
        (self.low * d).max(self.high * d).element_sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::{KnownSolid, Random, faults, made, never};
    use super::*;

    fn cuboid(center: DVec3, size: DVec3) -> Solid {
        made(|cx| BoxDesc { size: size.into(), ..BoxDesc::new(center.into()) }.compile(cx))
    }

    /// The distance to a box is that to its nearest side, edge or corner.
    fn distance(p: DVec3, center: DVec3, size: DVec3) -> f64 {
        let q = (p - center).abs() - size * 0.5;
        q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
    }

    #[test]
    fn it_keeps_what_solids_promise() {
        let mut random = Random::new(1);
        for center in [DVec3::ZERO, DVec3::new(148376.0, 1234.0, -223423.0)] {
            for scale in [1e-3, 1.0, 1e6] {
                let size = (DVec3::ONE + random.in_ball() * 0.7) * scale;
                let reach = 0.5 * size.length();
                let distance = |p| distance(p, center, size);
                let known = KnownSolid { solid: cuboid(center, size), distance: &distance, center, size: reach };
                let corner = |x: f64, i: u32| if (x * 8.0) as u32 >> i & 1 == 1 { 0.5 } else { -0.5 };
                let rims = |x: f64| {
                    // A place on one of the edges
                    let mut edge = DVec3::new(corner(x, 0), corner(x, 1), corner(x, 2));
                    edge[(x * 1000.0) as usize % 3] = (x * 8.0).fract() - 0.5;
                    center + size * edge
                };
                let inside = |x: f64| center + size * (0.45 - 0.9 * x);
                known.is_closed(20_000, &rims, &inside);
                known.bounds_are_tight(4000, &rims);
                if center.length() < 1e4 * scale {
                    known.meets_rays(10_000);
                    known.derivatives_hold(4000);
                }
            }
        }
    }

    #[test]
    fn rays_leave_it() {
        let mut random = Random::new(2);
        for _ in 0..500 {
            let scale = random.magnitude(1e-6, 1e6);
            let center = random.in_ball() * random.magnitude(1e-8, 1e8);
            let size = (DVec3::ONE + random.in_ball() * 0.9) * scale;
            let known = KnownSolid { solid: cuboid(center, size), distance: &|_| 0.0, center, size: size.length() };
            known.is_left_by_rays(50, &never);
        }
    }

    #[test]
    fn each_face_is_upright() {
        let solid = cuboid(DVec3::ZERO, DVec3::splat(2.0));
        let looks = [
            // From where, to the right and up of the middle as seen from there
            (DVec3::Z, DVec3::X, DVec3::Y),
            (DVec3::NEG_Z, DVec3::NEG_X, DVec3::Y),
            (DVec3::X, DVec3::NEG_Z, DVec3::Y),
            (DVec3::NEG_X, DVec3::Z, DVec3::Y),
            (DVec3::Y, DVec3::X, DVec3::NEG_Z),
            (DVec3::NEG_Y, DVec3::X, DVec3::Z),
        ];
        for (from, right, up) in looks {
            let ray = DRay { o: from * 5.0 + right * 0.5 - up * 0.75, d: -from };
            let hit = solid.intersect(&ray, 0.0, 10.0, true).expect("it is ahead");
            let point = solid.point(&ray, &hit);
            assert_eq!(hit.t, 4.0);
            assert_eq!((point.normal, point.uv), (from, DVec2::new(0.75, 0.125)));
            assert_eq!((point.dpdu, point.dpdv), (right * 2.0, up * 2.0));
        }
    }

    #[test]
    fn boxes_side_by_side_have_no_gap() {
        let mut random = Random::new(3);
        for place in [0.1, 148376.3] {
            let (a, b) = (cuboid(DVec3::splat(place), DVec3::ONE), cuboid(DVec3::splat(place) + DVec3::X, DVec3::ONE));
            let edge = DVec3::splat(place) + DVec3::new(0.5, 0.0, 0.0);
            for _ in 0..50_000 {
                let o =
                    edge + DVec3::new(random.between(-3.0, 3.0), random.between(2.0, 3.0), random.between(-0.2, 0.2));
                let ray = DRay { o, d: edge + DVec3::Z * random.between(-0.4, 0.4) - o };
                assert!(a.blocks(&ray, 0.0, 2.0) || b.blocks(&ray, 0.0, 2.0), "{ray:?}");
            }
        }
    }

    #[test]
    fn a_side_without_length_is_a_fault() {
        let desc = BoxDesc { size: [1.0, 0.0, f64::NAN], ..BoxDesc::new([0.0; 3]) };
        let found = faults(|cx| desc.compile(cx));
        assert_eq!(found.iter().map(|f| f.0.as_str()).collect::<Vec<_>>(), ["size[1]", "size[2]"]);
    }
}
