//! The tests of parallelograms, and of triangles of meshes, against a light, for sixteen points.

use fearless_simd::{f32x16, prelude::*};

use super::{LightPyramid16, OccluderTest, SLACK, way};
use crate::integrate::batch::{Exact, point_vectors};
use crate::integrate::row::edges;
use crate::material::ShadingPoint;
use crate::math::{DVec3, Facet, LANES, Vec3, Vec3x16};
use crate::shape::{Parallelogram, PlaneSide, is_in_plane};

#[inline(always)]
pub(super) fn test_parallelogram<S: Simd>(
    simd: S,
    pyramid: &LightPyramid16<S>,
    q: [Vec3x16<S>; 4],
    (flat, side, seen_side): (&Parallelogram, PlaneSide, PlaneSide),
    points: &[ShadingPoint],
    lanes: u64,
) -> OccluderTest<S> {
    let zero = simd.splat_f32x16(0.0);
    let mut test = OccluderTest::nothing(zero);
    let mut size2 = zero;
    let mut rises = simd.splat_f32x16(f32::NEG_INFINITY);
    for q in &q {
        size2 = size2.max(q.dot(*q));
        rises = rises.max(pyramid.horizon.dot(*q));
    }
    let rounding = size2.sqrt() * SLACK;
    // Above whose horizon it rises
    let around = pyramid.reach + pyramid.turn * (size2.sqrt() + pyramid.reach);
    let mut near = lanes & rises.simd_ge(-rounding - around).to_bitmask();
    if near == 0 {
        return test;
    }
    let gap = pyramid.gap(&q);
    near &= gap.simd_le(rounding + pyramid.reach).to_bitmask();
    // On which side of it the points are, to the last bit; and a part of what is around them may be on the other side
    let (mut left, mut through, mut beside) = (near, 0u64, 0u64);
    while left != 0 {
        let k = left.trailing_zeros() as usize;
        left &= left - 1;
        let ShadingPoint { p, error, reach, .. } = points[k];
        if !flat.is_one_sided(p, error, side) {
            through |= 1 << k;
        } else if reach > 0.0 && flat.plane_cuts(p, error, reach) {
            beside |= 1 << k;
        }
    }
    near = through | beside;
    if near == 0 {
        return test;
    }
    let lines = edges(q, &pyramid.light_vectors);
    let n = (q[1] - q[0]).cross(q[3] - q[0]);
    let length = n.dot(n).sqrt();
    // How far away it is decides how far its shadow moves
    let mut motion = [0.0f32; LANES];
    let mut left = near & pyramid.reach.simd_gt(zero).to_bitmask();
    while left != 0 {
        let k = left.trailing_zeros() as usize;
        left &= left - 1;
        let point = &points[k];
        let distance = flat.distance(point.p.as_dvec3()) as f32;
        let is_screen =
            beside >> k & 1 == 1 && distance <= point.reach && flat.screens(point.p, point.wo, point.reach, seen_side);
        if !is_screen {
            motion[k] = (distance - point.reach).max(0.0);
            test.moving |= 1 << k;
        }
    }
    test.motion = pyramid.motion(f32x16::simd_from(simd, motion));
    near &= through & gap.simd_le(rounding).to_bitmask() & rises.simd_ge(-rounding).to_bitmask();
    if near == 0 {
        return test;
    }
    let [near, hidden] = pyramid.covered(&lines, near);
    test.hidden = hidden;
    test.outside = near & !hidden;
    // From everywhere around: all ways to the corners pass far inside of the edges
    let mut patches = hidden;
    while patches != 0 {
        let k = patches.trailing_zeros() as usize;
        patches &= patches - 1;
        let point = &points[k];
        if point.reach == 0.0 {
            test.firm |= 1 << k;
            continue;
        }
        let share = (motion[k] + point.reach) / pyramid.far.to_array()[k];
        let corners = flat.deep_corners().map(|q| (q - point.p.as_dvec3()).as_vec3());
        let edge = |i: usize| corners[i].cross(corners[(i + 1) % 4]).length();
        let lengths = [length.to_array()[k], edge(0), edge(1), edge(2), edge(3)];
        let mut depth = f32::INFINITY;
        for (line, length) in lines.iter().zip(lengths) {
            for [x, y] in pyramid.square() {
                depth = depth.min(line.at(x, y).to_array()[k] / length);
            }
        }
        if depth * share.min(1.0) > point.reach {
            test.firm |= 1 << k;
        }
    }
    test
}

/// A triangle of a mesh, in world space.
pub(super) struct FacetShape {
    pub facet: Facet,
    corners: [DVec3; 3],
    /// The longer of the edges from the first corner.
    edge: f32,
}

/// As a part of the longer edge: points no farther off a triangle's plane are in it.
const IN_PLANE: f32 = 1e-5;
/// As a part of the longer edge: triangles that rise no higher above a horizon are below it.
const LEVEL: f32 = 1e-4;

impl FacetShape {
    pub fn new(facet: Facet, corners: [DVec3; 3]) -> FacetShape {
        let [a, b, c] = corners;
        FacetShape { facet, corners, edge: (b - a).length().max((c - a).length()) as f32 }
    }

    /// The corners as those of a parallelogram whose last two are equal.
    pub fn corners(&self) -> [Exact; 4] {
        let [a, b, c] = self.corners.map(Exact::new);
        [a, b, c, c]
    }

    /// The support function: the largest n.q of its points q.
    pub fn reach(&self, n: DVec3) -> f64 {
        self.corners.iter().map(|q| n.dot(*q)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Whether a point is in its plane within rounding.
    fn is_under(&self, point: &ShadingPoint) -> bool {
        is_in_plane(self.corners, point.p.as_dvec3(), point.error.0.as_dvec3())
    }

    /// The distance to a point, in metres.
    pub fn distance(&self, p: DVec3) -> f32 {
        triangle_distance(&self.corners.map(|q| (q - p).as_vec3()))
    }
}

/// The facets of the points themselves.
pub(super) struct Own<S: Simd> {
    /// Geometric normals, unit, on the viewer's side.
    ng: Vec3x16<S>,
    /// Points that are lifted off facets of smooth surfaces, and those of them from which some of the light is below
    /// the facet.
    lifted: u64,
    sees_below: u64,
}

impl<S: Simd> Own<S> {
    #[inline(always)]
    pub fn new(simd: S, pyramid: &LightPyramid16<S>, points: &[ShadingPoint]) -> Own<S> {
        let mut lifted = 0;
        for (k, point) in points.iter().enumerate() {
            lifted |= u64::from(point.facet != Facet::NONE) << k;
        }
        let ng = point_vectors(simd, points, |point| point.ng);
        let mut least = simd.splat_f32x16(f32::INFINITY);
        for [x, y] in pyramid.square() {
            least = least.min(ng.dot(way(&pyramid.light_vectors, x, y)));
        }
        Own { ng, lifted, sees_below: lifted & !least.simd_gt(simd.splat_f32x16(0.0)).to_bitmask() }
    }
}

#[allow(clippy::too_many_arguments, reason = "a triangle, sixteen points and what they are on")]
#[inline(always)]
pub(super) fn test_triangle<S: Simd>(
    simd: S,
    pyramid: &LightPyramid16<S>,
    q: [Vec3x16<S>; 4],
    shape: &FacetShape,
    own: &Own<S>,
    points: &[ShadingPoint],
    lanes: u64,
) -> OccluderTest<S> {
    let zero = simd.splat_f32x16(0.0);
    let mut test = OccluderTest::nothing(zero);
    let mut size2 = zero;
    let mut rises = simd.splat_f32x16(f32::NEG_INFINITY);
    let mut over_own = rises;
    for q in &q[..3] {
        size2 = size2.max(q.dot(*q));
        rises = rises.max(pyramid.horizon.dot(*q));
        over_own = over_own.max(own.ng.dot(*q));
    }
    let rounding = size2.sqrt() * SLACK;
    let room = pyramid.error.dot(pyramid.error).sqrt() * 4.0 + shape.edge * LEVEL;
    let mut near = lanes & rises.simd_gt(room).to_bitmask();
    // One that goes on as a lifted point's own facet does, or falls off from it, hides nothing that is above that; and
    // one in the same plane nothing at all: what comes from below has passed that plane before it gets there
    let level = near & own.lifted & over_own.simd_le(room).to_bitmask();
    if level != 0 {
        let n = (q[1] - q[0]).cross(q[2] - q[0]);
        let in_plane = n.dot(q[0]).abs().simd_le(n.dot(n).sqrt() * (shape.edge * IN_PLANE)).to_bitmask();
        near &= !level | own.sees_below & !in_plane;
    }
    let gap = pyramid.gap(&q[..3]);
    near &= gap.simd_le(rounding + pyramid.reach).to_bitmask();
    if near == 0 {
        return test;
    }
    let mut distances = [0.0f32; LANES];
    for (k, point) in points.iter().enumerate() {
        let bit = 1 << k;
        if near & bit == 0 {
            continue;
        }
        if point.facet == shape.facet || shape.is_under(point) {
            near &= !bit;
        } else if point.reach > 0.0 {
            distances[k] = (shape.distance(point.p.as_dvec3()) - point.reach).max(0.0);
            test.moving |= bit;
        }
    }
    test.motion = pyramid.motion(f32x16::simd_from(simd, distances));
    near &= gap.simd_le(rounding).to_bitmask();
    if near == 0 {
        return test;
    }
    let [near, hidden] = pyramid.covered(&edges(q, &pyramid.light_vectors), near);
    test.hidden = hidden;
    test.firm = hidden & !test.moving;
    test.outside = near & !hidden;
    test
}

/// The distance of a triangle from the origin, in its unit.
///
/// Source: Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.
fn triangle_distance([a, b, c]: &[Vec3; 3]) -> f32 {
    let (ab, ac) = (*b - *a, *c - *a);
    let (d1, d2) = (-ab.dot(*a), -ac.dot(*a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a.length();
    }
    let (d3, d4) = (-ab.dot(*b), -ac.dot(*b));
    if d3 >= 0.0 && d4 <= d3 {
        return b.length();
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (*a + ab * (d1 / (d1 - d3))).length();
    }
    let (d5, d6) = (-ab.dot(*c), -ac.dot(*c));
    if d6 >= 0.0 && d5 <= d6 {
        return c.length();
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (*a + ac * (d2 / (d2 - d6))).length();
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (*b + (*c - *b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))).length();
    }
    let n = ab.cross(ac);
    (n.dot(*a) / n.length()).abs()
}
