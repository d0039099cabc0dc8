//! The test of parallelograms against a light, for sixteen points.

use fearless_simd::{f32x16, prelude::*};

use super::{LightPyramid16, OccluderTest, SLACK};
use crate::integrate::row::edges;
use crate::material::ShadingPoint;
use crate::math::{LANES, Vec3x16};
use crate::shape::{Parallelogram, PlaneSide};

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
