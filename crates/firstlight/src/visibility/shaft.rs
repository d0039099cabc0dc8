//! The space that a light's ways to some points can cross, and which boxes lie in it.
//!
//! The hull of a box of points and a box of ends is the union, over s from 0 to 1, of the boxes between the two: their
//! low side along an axis is low + s (end's low - low), their high side likewise. Whether a box meets one of them is
//! six linear inequalities in s: each says from where or up to where, so a slab test, at the price of a ray's. Light
//! from infinitely far away is the same with directions for ends, and s without end.
//!
//! A shaft never leaves out what a ray within it could be told to meet: boxes are padded by [`BEAM_PAD`] of the
//! distance between the points and the farthest part of the tree, twice what single rays pad them with, which in turn
//! is twice what the test of a triangle needs (`accel/ray.rs`). The roundings of the six bounds and of the sides are
//! below a tenth of it.

use fearless_simd::{f32x8, prelude::*};

use super::target::LightHull;
use crate::accel::{Aabb, BEAM_PAD, BoxNode};
use crate::math::{DVec3, Vec3};

/// What lies below is not lit from above: no way to a light that counts leads through n.x < `least`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Horizon {
    /// A normal of the surface that all points share, of length about 1.
    pub n: Vec3,
    /// The least n.x of the points.
    pub least: f64,
}

/// The hull of a box of points and a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shaft {
    /// Where rays start.
    pub points: Aabb,
    /// How the low and the high sides change from the points to the light, rounded outwards.
    pub low: Vec3,
    pub high: Vec3,
    /// How far they change: 1, or without end.
    pub s_max: f32,
    pub horizon: Option<Horizon>,
}

/// A shaft as one tree sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TreeShaft {
    /// By axis: what the low line and what the high line says of a box's high and low plane.
    lines: [[Line; 2]; 3],
    s_max: f32,
    n: Vec3,
    least: f32,
    has_horizon: bool,
}

/// A bound on s: plane x `r` + `c`.
#[derive(Clone, Copy, Debug)]
struct Line {
    r: f32,
    c: f32,
    /// Whether s is at least that; at most, if not.
    enters: bool,
}

/// Changes along an axis smaller than this, against the largest, are taken to be this, outwards.
const SMALLEST: f32 = 1.0 / (1u64 << 32) as f32;
const TINY: f32 = 1.0 / (1u128 << 72) as f32;

impl Shaft {
    /// From rays that start in `points` towards `light`. `apart` is how far, along each axis, a ray's start can be from
    /// the point its direction is measured from.
    pub fn between(points: Aabb, light: &LightHull, apart: Vec3) -> Self {
        if !light.finite {
            let d = light.center;
            return Shaft { points, low: d, high: d, s_max: f32::INFINITY, horizon: None };
        }
        let ends = light.bounds();
        let size = (ends.max - points.min).abs().max((points.max - ends.min).abs());
        // The end of a ray is its start and the rounded difference of light and point
        let room = apart + size * (4.0 * f32::EPSILON);
        let (low, high) = (ends.min - points.min - room, ends.max - points.max + room);
        Shaft { points, low, high, s_max: 1.0, horizon: None }
    }

    /// Through a tree around `center` that reaches `half` from it.
    #[inline(always)]
    pub fn within(&self, center: Vec3, half: f32) -> TreeShaft {
        let (min, max) = (self.points.min - center, self.points.max - center);
        let reach = min.abs().max(max.abs()).max_element() + half;
        let pad = reach * BEAM_PAD;
        let largest = self.low.abs().max(self.high.abs()).max_element();
        let least = (largest * SMALLEST).max(TINY);
        let line = |axis: usize| {
            let (d, from) = (self.low[axis], min[axis]);
            let d = if d.abs() < least { -least } else { d };
            let r = 1.0 / d;
            // from + s d <= high plane + pad
            let low = Line { r, c: (pad - from) * r, enters: d < 0.0 };
            let (d, from) = (self.high[axis], max[axis]);
            let d = if d.abs() < least { least } else { d };
            let r = 1.0 / d;
            // from + s d >= low plane - pad
            let high = Line { r, c: -(from + pad) * r, enters: d > 0.0 };
            [low, high]
        };
        let (n, mut lowest) = (self.horizon.map_or(Vec3::ZERO, |h| h.n), f32::NEG_INFINITY);
        if let Some(horizon) = &self.horizon {
            let below = horizon.least - horizon.n.as_dvec3().dot(center.as_dvec3());
            let n = n.abs();
            lowest = below as f32 - (n.x + n.y + n.z) * (2.0 * pad);
        }
        TreeShaft {
            lines: [line(0), line(1), line(2)],
            s_max: self.s_max,
            n,
            least: lowest,
            has_horizon: self.horizon.is_some(),
        }
    }

    /// Whether a box meets the shaft, in f64 and without any padding but `room`.
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
    /// The children of a node that the shaft meets: a bit for each, and where they begin. Padding makes up for every
    /// rounding; no instruction set multiplies and adds at once, so that all find the same.
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
            // A pattern that seldom changes from node to node
            match (low.enters, high.enters) {
                (false, true) => (enter, leave) = (enter.max(b), leave.min(a)),
                (true, false) => (enter, leave) = (enter.max(a), leave.min(b)),
                (true, true) => enter = enter.max(a.max(b)),
                (false, false) => leave = leave.min(a.min(b)),
            }
        }
        let mut met = enter.simd_le(leave);
        if self.has_horizon {
            let top = |axis: usize| &planes[axis][usize::from(self.n[axis] >= 0.0)];
            let height = f32x8::load_array_ref(simd, top(0)) * self.n.x;
            let height = line(top(2), self.n.z, line(top(1), self.n.y, height));
            met &= height.simd_ge(self.least);
        }
        (met.to_bitmask() as u32, enter)
    }
}
