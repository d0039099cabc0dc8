//! How much of a light a sphere, a parallelogram or a disk hides from a point, proved from the light's hull: the ways
//! `l` + u `axes[0]` + v `axes[1]` + w `axes[2]`, each of u, v, w from -1 to 1. What is proved holds for the rounded
//! answers of `blocks` for each way of the hull.

use super::disk::{DiskBounds, DiskShadow};
use super::parallelogram::ParallelogramShadow;
use super::sphere::SphereShadow;
use crate::math::{UNIT_ROUNDOFF, Vec3};

/// A light relative to one point: the vectors `l` + u `axes[0]` + v `axes[1]` + w `axes[2]` from the point to its box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSeen {
    pub l: Vec3,
    pub axes: [Vec3; 3],
    /// An upper bound of the largest coordinate of any of the vectors.
    pub longest: f32,
    /// A lower bound of the largest coordinate of each of the vectors.
    pub shortest: f32,
    pub finite: bool,
    /// The unit normal of a flat light; 0 for all others.
    pub plane: Vec3,
    /// The axes along which projections of occluders are bounded; those of a sphere face the point.
    pub frame: [Vec3; 3],
    /// The distance of the center of a sphere, in radii.
    pub radii: Option<f32>,
}

/// How much of a light is hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cover {
    /// No way is blocked.
    Nothing,
    /// Every way is.
    All,
    /// Not known.
    Some,
}

/// Steps towards a plane between the light's ways and a sphere.
const STEPS: usize = 4;
/// How far, at most, the rounded answers for a sphere are from the true ones: in radii, and in distances.
const ROOM: [f32; 2] = [4e-4, 1e-5];

/// By how much a product of vectors is wrong, at most, in that of their lengths.
const DOT: f32 = 16.0 * UNIT_ROUNDOFF;

impl LightSeen {
    #[inline(always)]
    pub fn new(l: Vec3, axes: [Vec3; 3], finite: bool) -> Self {
        let reach = axes[0].abs() + axes[1].abs() + axes[2].abs();
        let longest = (l.abs() + reach).max_element() * (1.0 + 4.0 * f32::EPSILON);
        let shortest = ((l.abs() - reach).max_element() - longest * (4.0 * f32::EPSILON)).max(0.0);
        LightSeen { l, axes, longest, shortest, finite, plane: Vec3::ZERO, frame: axes, radii: None }
    }

    /// The range of f.w over the vectors w to the light, without rounding: its center and half its length.
    #[inline(always)]
    pub fn range(&self, f: Vec3) -> (f32, f32) {
        let [a, b, c] = self.axes;
        (f.dot(self.l), f.dot(a).abs() + f.dot(b).abs() + f.dot(c).abs())
    }
}

/// The least of m.w for the ways of the hull, and the way to it.
#[inline(always)]
fn lowest(m: Vec3, l: Vec3, axes: &[Vec3; 3]) -> (f32, Vec3) {
    let (mut least, mut way) = (m.dot(l), l);
    for axis in axes {
        let slope = m.dot(*axis);
        least -= slope.abs();
        way += if slope > 0.0 { -*axis } else { *axis };
    }
    (least, way)
}

/// The ways to the hull's corners.
#[inline(always)]
fn corners(l: Vec3, axes: &[Vec3; 3]) -> impl Iterator<Item = Vec3> {
    let sign = |i: usize, bit: usize| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
    (0..8).map(move |i| l + axes[0] * sign(i, 0) + axes[1] * sign(i, 1) + axes[2] * sign(i, 2))
}

impl SphereShadow {
    /// How much of a light it hides.
    pub fn covers(&self, light: &LightSeen) -> Cover {
        let LightSeen { l, ref axes, longest, finite, .. } = *light;
        let Some((f, r)) = self.outside() else { return Cover::Some };
        // No way is longer than the sum of its coordinates
        let (distance, reach) = (f.length(), longest * 3.0);
        let room = r * ROOM[0] + distance * ROOM[1];
        if !(distance + reach < 1e12 && r > 1e-12) {
            return Cover::Some;
        }
        // A plane between the sphere and all ways from the point: across the line from its centre to the nearest of a
        // hull that grows. Everything is counted from the centre
        let t = -f.dot(l) / l.length_squared();
        let first = f + l * if finite { t.clamp(0.0, 1.0) } else { t.max(0.0) };
        let mut near = first;
        for _ in 0..STEPS {
            let length = near.length();
            if !(length > r) {
                break;
            }
            let bound = (r + room) * length;
            let (least, way) = lowest(near, l, axes);
            let at_point = near.dot(f);
            let at_light = match finite {
                true => at_point + least - length * reach * DOT,
                // Of light without end the ways must not lead towards the sphere
                false if least >= 0.0 => at_point,
                false => f32::NEG_INFINITY,
            };
            if at_point.min(at_light) > bound {
                return Cover::Nothing;
            }
            if !finite {
                break;
            }
            let corner = if at_light < at_point { f + way } else { f };
            let side = corner - near;
            let t = -near.dot(side) / side.length_squared();
            if !(t > 0.0) {
                break;
            }
            near += side * t.min(1.0);
        }
        // All corners in the shadow of a smaller sphere, beyond its middle
        let small = r - room;
        let deep = small > 0.0 && first.length_squared() < small * small;
        if !deep || distance < r + 2.0 * room || !finite {
            return Cover::Some;
        }
        let (least, _) = lowest(-f, l, axes);
        if !(least > f.length_squared() + distance * room + reach * (reach + distance) * DOT) {
            return Cover::Some;
        }
        let all = corners(l, axes).all(|way| {
            let across = way.cross(f);
            across.length_squared() < way.length_squared() * (small * small) * 0.9999
        });
        if all { Cover::All } else { Cover::Some }
    }
}

impl ParallelogramShadow {
    /// How much of a light it hides.
    pub fn covers(&self, light: &LightSeen) -> Cover {
        let mut all = true;
        for (f, least, wrong) in self.bounds(light.longest, light.finite) {
            let (middle, reach) = light.range(f);
            let middle = middle - least;
            if middle + reach < -wrong {
                return Cover::Nothing;
            }
            all &= middle - reach > wrong;
        }
        if all { Cover::All } else { Cover::Some }
    }
}

impl DiskShadow {
    /// How much of a light it hides.
    pub fn covers(&self, light: &LightSeen) -> Cover {
        let LightSeen { l, ref axes, longest, finite, .. } = *light;
        let Some(DiskBounds { n, x, y, height, room, wrong }) = self.bounds(longest) else { return Cover::Nothing };
        // Beyond these its squares may leave the range of numbers
        if !(longest > 1e-9 && longest < 1e12 && wrong < 1e12) {
            return Cover::Some;
        }
        // Downwards -n.l has to come above the height, and where it does x^2 + y^2 below its square
        let range = |f: Vec3| {
            let (middle, reach) = light.range(f);
            (middle - reach, middle + reach)
        };
        let (least, most) = range(-n);
        let ahead = if finite { height } else { 0.0 };
        let outside = [x, -x, y, -y].into_iter().any(|f| range(f + n).0 > wrong);
        if most < ahead - wrong || outside {
            return Cover::Nothing;
        }
        // The ways that do are a cone: with its corners, all of the hull is in it
        let inside = |way: Vec3| {
            let (x, y) = (x.dot(way), y.dot(way));
            (x * x + y * y).sqrt() + wrong < -n.dot(way)
        };
        let beyond = if finite { height + room + wrong } else { wrong };
        if least > beyond && corners(l, axes).all(inside) { Cover::All } else { Cover::Some }
    }
}
