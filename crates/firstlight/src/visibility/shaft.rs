//! The convex hull of some points and a light, and which boxes intersect it.
//!
//! The hull of the box of the points and that of the light is the union, over s from 0 to 1, of the boxes between the
//! two: their low side along an axis is low + s (low of the light - low), and so is their high side. Whether a box
//! intersects one of them is a system of six linear inequalities in s, so a slab test, at the cost of that of one ray.
//! For light from infinitely far away the ends are directions, and s is unbounded.
//!
//! A shaft holds every box that a ray within it can intersect: boxes are padded by [`BEAM_PAD`] of the distance between
//! the points and the farthest part of the tree, twice the padding for single rays, which in turn is twice what the
//! triangle test needs (`accel/ray.rs`). The roundings of the six bounds and of the sides are below a tenth of it.
//!
//! Source: Haines, Wallace, "Shaft Culling for Efficient Ray-Cast Radiosity", 1991.

use fearless_simd::{f32x8, prelude::*};

use super::Viewpoint;
use super::target::LightHull;
use crate::accel::{Aabb, BEAM_PAD, BoxNode};
use crate::math::{DVec3, ErrorBound, Vec3};
use crate::shape::Placement;

/// The half-space n.x >= `least`, which holds all rays that carry light to the points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Horizon {
    /// The horizon that all points share, of length about 1.
    pub n: Vec3,
    /// The least n.x of the points.
    pub least: f64,
}

impl Horizon {
    /// That of some points, if all have the same.
    pub fn shared<'a>(mut points: impl Iterator<Item = &'a Viewpoint>) -> Option<Horizon> {
        let least = |point: &Viewpoint| {
            let n = point.horizon.as_dvec3();
            n.dot(point.p.as_dvec3()).min(n.dot(point.start.as_dvec3()))
        };
        let first = points.next()?;
        points.try_fold(Horizon { n: first.horizon, least: least(first) }, |Horizon { n, least: before }, point| {
            (point.horizon == n).then(|| Horizon { n, least: before.min(least(point)) })
        })
    }
}

/// The hull of a box of points and a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shaft {
    /// Where rays start.
    pub points: Aabb,
    /// The largest distance of a ray's origin from its point, along each axis.
    pub apart: Vec3,
    /// The differences of the low and of the high sides between the light and the points, rounded outwards.
    pub low: Vec3,
    pub high: Vec3,
    /// The largest s: 1, or infinite.
    pub s_max: f32,
    pub horizon: Option<Horizon>,
}

/// A shaft in the coordinates of one tree, with the padding for it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TreeShaft {
    /// For each axis, the bounds on s from the low side against a box's high plane, and from the high side against its
    /// low plane.
    lines: [[Line; 2]; 3],
    s_max: f32,
    /// The normal of the horizon that all points share, and the least height over it.
    horizon: Option<(Vec3, f32)>,
}

/// A linear bound on s: plane x `r` + `c`.
#[derive(Clone, Copy, Debug)]
struct Line {
    r: f32,
    c: f32,
    /// Whether it is a lower bound.
    enters: bool,
}

/// The smallest difference along an axis, relative to the largest and absolute; smaller ones are rounded outwards to
/// it.
const SMALLEST: f32 = 1.0 / (1u64 << 32) as f32;
const TINY: f32 = 1.0 / (1u128 << 72) as f32;

impl Shaft {
    /// The shaft of rays from origins in `points` towards `light`. `apart` is the largest distance, along each axis, of
    /// such an origin from the point that the ray's direction is computed from.
    pub fn between(points: Aabb, light: &LightHull, apart: Vec3) -> Self {
        if !light.finite {
            let d = light.center;
            return Shaft { points, low: d, high: d, s_max: f32::INFINITY, apart, horizon: None };
        }
        let ends = light.bounds();
        let size = (ends.max - points.min).abs().max((points.max - ends.min).abs());
        // A ray ends at its origin plus the rounded difference of light and point
        let room = apart + size * (4.0 * f32::EPSILON);
        let (low, high) = (ends.min - points.min - room, ends.max - points.max + room);
        Shaft { points, apart, low, high, s_max: 1.0, horizon: None }
    }

    /// The shaft from some of the points to a light.
    pub fn of(points: &[Viewpoint], indices: &[u32], hull: &LightHull) -> Shaft {
        let (mut starts, mut apart) = (Aabb::EMPTY, Vec3::ZERO);
        let points = || indices.iter().map(|i| &points[*i as usize]);
        for point in points() {
            // The tests of some shapes start at the point itself
            starts = starts.with(point.start).with(point.p);
            apart = apart.max(point.apart());
        }
        Shaft { horizon: Horizon::shared(points()), ..Shaft::between(starts, hull, apart) }
    }

    /// The shaft from a patch of surface, `curved` or flat, of radius `reach` around `point`, to a light.
    pub fn around(point: &Viewpoint, reach: f32, curved: bool, hull: &LightHull) -> Shaft {
        let mut points = [*point; 2];
        for (point, side) in points.iter_mut().zip([-1.0, 1.0]) {
            point.p += Vec3::splat(reach * side);
            point.start += Vec3::splat(reach * side);
        }
        let shaft = Shaft::of(&points, &[0, 1], hull);
        // The horizon differs over a curved patch: the shaft has none
        if curved && reach > 0.0 { Shaft { horizon: None, ..shaft } } else { shaft }
    }

    /// The same shaft in the object space of `placement`.
    pub fn in_object(&self, placement: &Placement, hull: &LightHull) -> Shaft {
        let m = &placement.object_from_world;
        let size = |v: Vec3| placement.error_in_object(ErrorBound(v));
        let Aabb { min, max } = self.points;
        let middle = (min.as_dvec3() + max.as_dvec3()) * 0.5;
        let (center, half) = (m.transform_point3(middle), size((max - min) * 0.5) * (1.0 + 1e-6));
        // Origins of rays are rounded to single precision
        let room = (center.abs() + half) * f64::from(f32::EPSILON);
        let points = Aabb { min: (center - half - room).as_vec3(), max: (center + half + room).as_vec3() };
        let vector = |v: Vec3| m.transform_vector3(v.as_dvec3()).as_vec3();
        let at = if hull.finite { m.transform_point3(hull.center.as_dvec3()).as_vec3() } else { vector(hull.center) };
        let hull = LightHull { axes: hull.axes.map(vector), ..LightHull::at(at, hull.finite) };
        let apart = size(self.apart).as_vec3() + room.as_vec3() * 2.0;
        let mut shaft = Shaft::between(points, &hull, apart);
        if !hull.finite {
            // The rounding of the direction
            let room = shaft.low.abs() * f32::EPSILON;
            (shaft.low, shaft.high) = (shaft.low - room, shaft.high + room);
        }
        shaft.horizon = self.horizon.map(|horizon| {
            let n = (placement.world_from_object.matrix3.transpose() * horizon.n.as_dvec3()).as_vec3();
            let above = horizon.least - horizon.n.as_dvec3().dot(middle);
            Horizon { n, least: n.as_dvec3().dot(center) + above }
        });
        shaft
    }

    /// The shaft in a tree that reaches `half` from `center`.
    #[inline(always)]
    pub fn within(&self, center: Vec3, half: f32) -> TreeShaft {
        let (min, max) = (self.points.min - center, self.points.max - center);
        let reach = min.abs().max(max.abs()).max_element() + half;
        let pad = reach * BEAM_PAD;
        let largest = self.low.abs().max(self.high.abs()).max_element();
        let least = (largest * SMALLEST).max(TINY);
        // Of the low side, -1: from + s d <= high plane + pad; of the high side, 1: from + s d >= low plane - pad
        let line = |d: f32, from: f32, side: f32| {
            let d = if d.abs() < least { side * least } else { d };
            let r = 1.0 / d;
            Line { r, c: (-side * pad - from) * r, enters: d * side > 0.0 }
        };
        let lines =
            [0, 1, 2].map(|axis| [line(self.low[axis], min[axis], -1.0), line(self.high[axis], max[axis], 1.0)]);
        let horizon = self.horizon.map(|Horizon { n, least }| {
            let below = least - n.as_dvec3().dot(center.as_dvec3());
            (n, below as f32 - (n.x.abs() + n.y.abs() + n.z.abs()) * (2.0 * pad))
        });
        TreeShaft { lines, s_max: self.s_max, horizon }
    }

    /// Whether a box intersects the shaft, in f64 and with `room` as the only padding.
    pub fn meets(&self, low: DVec3, high: DVec3, room: f64) -> bool {
        let (mut enter, mut leave) = (0.0f64, f64::from(self.s_max));
        let mut bound = |r: f64, value: f64, at_most: bool| {
            // s r <= value, or >=
            if r == 0.0 {
                if if at_most { value < 0.0 } else { value > 0.0 } {
                    leave = -1.0;
                }
            } else if at_most == (r > 0.0) {
                leave = leave.min(value / r);
            } else {
                enter = enter.max(value / r);
            }
        };
        for axis in 0..3 {
            let (min, max) = (f64::from(self.points.min[axis]), f64::from(self.points.max[axis]));
            bound(f64::from(self.low[axis]), high[axis] + room - min, true);
            bound(f64::from(self.high[axis]), low[axis] - room - max, false);
        }
        if !(enter <= leave * (1.0 + 1e-12) + 1e-300) {
            return false;
        }
        self.horizon.is_none_or(|horizon| {
            let n = horizon.n.as_dvec3();
            let top = n.max(DVec3::ZERO).dot(high + room) + n.min(DVec3::ZERO).dot(low - room);
            top + n.abs().dot(low.abs().max(high.abs())) * 1e-15 >= horizon.least
        })
    }
}

impl TreeShaft {
    /// [`meet`](Self::meet), to visit a tree with.
    #[inline(always)]
    pub fn test<S: Simd>(self) -> impl Fn(S, &BoxNode) -> (u32, f32x8<S>) {
        #[inline(always)]
        move |simd, node| self.meet(simd, node)
    }

    /// The children of a node that the shaft intersects, a bit for each, and the least s of each. The padding covers
    /// the rounding; no instruction set fuses multiplication and addition, so all compute the same.
    #[inline(always)]
    pub fn meet<S: Simd>(&self, simd: S, node: &BoxNode) -> (u32, f32x8<S>) {
        let planes = &node.planes;
        let line = |planes: &[f32; 8], r: f32, c: f32x8<S>| {
            let planes = f32x8::load_array_ref(simd, planes);
            planes * r + c
        };
        let mut enter = simd.splat_f32x8(0.0);
        let mut leave = simd.splat_f32x8(self.s_max);
        for ([low, high], [low_planes, high_planes]) in self.lines.iter().zip(planes) {
            let a = line(high_planes, low.r, simd.splat_f32x8(low.c));
            let b = line(low_planes, high.r, simd.splat_f32x8(high.c));
            // The same branch for all nodes of a tree
            match (low.enters, high.enters) {
                (false, true) => (enter, leave) = (enter.max(b), leave.min(a)),
                (true, false) => (enter, leave) = (enter.max(a), leave.min(b)),
                (true, true) => enter = enter.max(a.max(b)),
                (false, false) => leave = leave.min(a.min(b)),
            }
        }
        let mut met = enter.simd_le(leave);
        if let Some((n, least)) = self.horizon {
            let top = |axis: usize| &planes[axis][usize::from(n[axis] >= 0.0)];
            let height = f32x8::load_array_ref(simd, top(0)) * n.x;
            let height = line(top(2), n.z, line(top(1), n.y, height));
            met &= height.simd_ge(least);
        }
        (met.to_bitmask() as u32, enter)
    }
}
