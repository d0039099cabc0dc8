//! One ray and one triangle, and the same in lanes.
//!
//! Woop, Benthin and Wald 2013, "Watertight ray/triangle intersection", JCGT 2 (1): the vertices are seen from the
//! ray's origin and sheared until the ray runs along z; then U, V and W are the signed areas between the ray and each
//! edge,
//!
//! ```text
//! U = Cx By - Cy Bx    V = Ax Cy - Ay Cx    W = Bx Ay - By Ax    det = U + V + W    t = (U Az + V Bz + W Cz) / det
//! ```
//!
//! Two triangles that share an edge compute the same number for it, with opposite signs if they wind alike, so no ray
//! passes between them; where a number is exactly 0 its sign is found in f64, in which the products are exact. Without
//! fused multiply-add, the same bits everywhere: one triangle or many, one ray or sixteen.
//!
//! t is a mean of the vertices' depths. On a triangle seen edge-on the weights are mostly rounding, and t may be
//! anywhere between these depths, and a little outside. So that no order of asking can change an answer, a hit's t is
//! never before the triangle's own box, and a ray that misses that box misses the triangle: see `OWN_PAD` in
//! `accel/ray.rs`.

use fearless_simd::{f32x16, mask32x16, prelude::*};

use crate::accel::{RayLanes, Slabs, TraceRay};
use crate::math::Vec3;

/// What the test of one ray and one triangle finds: u and v weigh the second and third vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    pub t: f32,
    pub u: f32,
    pub v: f32,
}

/// Where a ray meets a triangle, on either side of the origin. `None` if it misses, or lies in the triangle's plane.
#[inline(always)]
pub(crate) fn intersect(ray: &TraceRay, slabs: &Slabs, triangle: &[Vec3; 3]) -> Option<Crossing> {
    let [kx, ky, kz] = ray.axes;
    assert!(kx < 3 && ky < 3 && kz < 3, "axes are axes");
    let [sx, sy, sz] = ray.shear;
    let [(ax, ay, az), (bx, by, bz), (cx, cy, cz)] = triangle.map(|v| {
        let v = (v - ray.o).to_array();
        (v[kx] - sx * v[kz], v[ky] - sy * v[kz], sz * v[kz])
    });
    // The edges' areas, with exact signs
    let (mut u, mut v, mut w) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
    if u == 0.0 || v == 0.0 || w == 0.0 {
        let area = |px: f32, qy: f32, py: f32, qx: f32| f64::from(px) * f64::from(qy) - f64::from(py) * f64::from(qx);
        let [exact_u, exact_v, exact_w] = [area(cx, by, cy, bx), area(ax, cy, ay, cx), area(bx, ay, by, ax)];
        if exact_u.min(exact_v).min(exact_w) < 0.0 && exact_u.max(exact_v).max(exact_w) > 0.0 {
            return None;
        }
        (u, v, w) = (exact_u as f32, exact_v as f32, exact_w as f32);
    }
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    let det = (u + v) + w;
    if !inside || det == 0.0 {
        return None;
    }
    let t = ((u * az + v * bz) + w * cz) / det;
    // Not before the triangle's own box
    let [a, b, c] = triangle;
    let (lo, hi) = (a.min(*b).min(*c), a.max(*b).max(*c));
    let (mut enter, mut leave) = (f32::NEG_INFINITY, f32::INFINITY);
    for axis in 0..3 {
        let rd = slabs.rd[axis];
        let (near, far) = if rd < 0.0 { (hi[axis], lo[axis]) } else { (lo[axis], hi[axis]) };
        enter = enter.max((near - ray.o[axis]) * rd - slabs.own[axis]);
        leave = leave.min((far - ray.o[axis]) * rd + slabs.own[axis]);
    }
    if !(enter.max(0.0) <= leave) {
        return None;
    }
    let t = if t < enter { enter } else { t };
    Some(Crossing { t, u: v / det, v: w / det })
}

/// Where sixteen rays meet a triangle.
pub(super) struct Crossings<S: Simd> {
    /// Which do.
    pub mask: mask32x16<S>,
    /// Which of these must be asked one by one, as an edge's area is 0.
    pub unsure: u64,
    pub t: f32x16<S>,
    pub v: f32x16<S>,
    pub w: f32x16<S>,
    pub det: f32x16<S>,
}

/// A vertex as the rays see it; z is not yet divided by their length along it.
#[inline(always)]
fn shear<S: Simd>(simd: S, rays: &RayLanes<S>, v: [f32; 3]) -> (f32x16<S>, f32x16<S>, f32x16<S>) {
    let z = simd.splat_f32x16(v[2]) - rays.o[2];
    let x = (simd.splat_f32x16(v[0]) - rays.o[0]) - rays.shear[0] * z;
    let y = (simd.splat_f32x16(v[1]) - rays.o[1]) - rays.shear[1] * z;
    (x, y, z)
}

/// [`intersect`] for sixteen rays; the coordinates of the triangle are along kx, ky, kz.
#[inline(always)]
pub(super) fn intersect_lanes<S: Simd>(simd: S, rays: &RayLanes<S>, triangle: [[f32; 3]; 3]) -> Option<Crossings<S>> {
    let zero = simd.splat_f32x16(0.0);
    let sz = rays.shear[2];
    let (ax, ay, az) = shear(simd, rays, triangle[0]);
    let (bx, by, bz) = shear(simd, rays, triangle[1]);
    let (cx, cy, cz) = shear(simd, rays, triangle[2]);
    let (u, v, w) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
    let inside = u.min(v).min(w).simd_ge(zero) | u.max(v).max(w).simd_le(zero);
    if inside.all_false() {
        return None;
    }
    let unsure = inside & (u.simd_eq(zero) | v.simd_eq(zero) | w.simd_eq(zero));
    let det = (u + v) + w;
    let (az, bz, cz) = (sz * az, sz * bz, sz * cz);
    let t = ((u * az + v * bz) + w * cz) / det;
    // Not before the triangle's own box
    let (mut enter, mut leave) = (simd.splat_f32x16(f32::NEG_INFINITY), simd.splat_f32x16(f32::INFINITY));
    let [a, b, c] = triangle;
    for (axis, ((a, b), c)) in a.into_iter().zip(b).zip(c).enumerate() {
        let (lo, hi) = (simd.splat_f32x16(a.min(b).min(c)), simd.splat_f32x16(a.max(b).max(c)));
        let rd = rays.rd[axis];
        let negative = rd.simd_lt(zero);
        let (near, far) = (negative.select(hi, lo), negative.select(lo, hi));
        enter = enter.max((near - rays.o[axis]) * rd - rays.own[axis]);
        leave = leave.min((far - rays.o[axis]) * rd + rays.own[axis]);
    }
    let mask = inside & !det.simd_eq(zero) & enter.max(zero).simd_le(leave);
    let t = t.simd_lt(enter).select(enter, t);
    let unsure = unsure.to_bitmask();
    Some(Crossings { mask, unsure, t, v, w, det })
}
