//! Triangles between a point and a light: which of them hide none of it, which all of it, and which some samples.
//!
//! Seen from the start o of the rays, with A, B, C counted from o, the triangle test's areas are linear in the way l,
//!
//! ```text
//! fu = C x (B - C)    fv = A x (C - A)    fw = B x (A - B)    n = (C - A) x (B - A) = fu + fv + fw
//! U = fu.l    V = fv.l    W = fw.l    det = n.l    T = n.A    t = T / det
//! ```
//!
//! up to the factor of the shear along the ray's largest axis. Ways to a light are l = l0 + u a0 + v a1 + w a2 with
//! coordinates from -1 to 1, so each is a number and three slopes: its values over the whole light, or over a cell of it, lie
//! between middle and slopes added up, and for a sample it is three multiplications and additions. Turned so that T > 0, a
//! triangle stands in the way where U, V and W are above 0 and T is below det.
//!
//! The answers have to be those of the kernel ([`intersect`]), which rounds, so each bound has a margin, and what lies within
//! is left to the kernel. With D the largest coordinate of A, B, C; s that of the edges; L that of all ways; |n| = |nx| + |ny|
//! + |nz|; and half an ulp h = 2^-24:
//!
//! - The kernel's sheared vertices are off by at most e = 6 h D along each axis, and its signs of U, V, W are exact for these.
//!   So what it calls inside lies within sqrt 2 e of the triangle, and what lies inside by more than that it calls inside; an
//!   edge is no longer than 2 sqrt 2 s there. In units of U that is 24 h D s L. What is computed here is off by less than
//!   100 h D s L more: edges, products, the light's own frame. [`EDGE`].
//! - If it calls the ray inside, then the line comes within e of a point X of the triangle at a depth z with
//!   |T - z det| <= |n| e, and its t is the depth of another point Y of the triangle, wrong by 8 h D / |lz|, with
//!   |T - t det| <= |n| (e + 8 h D + 96 h s^3 / |det|): the areas are wrong by 4 h s^2 each where the ray is inside, which moves Y
//!   by 12 h (2 s)^3 / det. Edge-on Y is anywhere on the triangle, 3 s from the ray at most. Where t is before the
//!   triangle's box, it is moved to where the box begins, which is not behind X.
//! - So with T > |n| (3 s + 16 h D) no ray is stopped whose det is below T by as much (`far`), nor any that is outside of one
//!   edge. With T smaller than that, one outside of one edge and inside of another is not stopped either way round;
//!   and one outside of an edge is not if it is not edge-on (|det| > |n| L / 64) and T > 16 h D |n| + 64 x 96 h s^3.
//! - A ray is stopped if it is inside of all edges, not edge-on, and det is above T by what t can be wrong, and by what the
//!   ray stops short of the light.
//!
//! Sizes beyond which any of these products could leave the range of numbers are left to the kernel.

use fearless_simd::{f32x4, f32x8, f32x16, mask32x16, prelude::*};

use super::kernel::{intersect, intersect_lanes};
use super::{NONE, PACK, Pack, TriangleTree, along, bits};
use crate::accel::{RayPacket16, Slabs, groups};
use crate::math::{UNIT_ROUNDOFF as H, Vec3};

/// By how much U, V and W can be wrong, in D s L.
const EDGE: f32 = 192.0 * H;
/// By how much T can be wrong by its own computation, in D s^2.
const HEIGHT: f32 = 64.0 * H;
/// By how much det can be wrong, in s^2 L.
const TURN: f32 = 96.0 * H;
/// By how much t det can be wrong: in |n| D, and in s^3 |n| L / |det|.
const DEPTH: f32 = 16.0 * H;
const SLIVER: f32 = 96.0 * H;
/// Rays whose det is below this, in |n| L, are edge-on.
const GRAZE: f32 = 1.0 / 64.0;
/// The same, where a triangle must not be met at all.
const GRAZE_ALL: f32 = 1.0 / 512.0;

/// Packs that are looked at together.
pub(crate) const TOGETHER: usize = 4;

/// Where rays start, and the light, in the space of a mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eye {
    /// The origin of the rays.
    pub o: Vec3,
    /// To the light's middle.
    pub l: Vec3,
    /// Half the light, along its axes.
    pub axes: [Vec3; 3],
    /// The largest coordinate of any way, at least; in another space also the sum of the sizes of what it was computed from.
    pub longest: f32,
    /// The largest coordinate of every way, at most.
    pub shortest: f32,
    /// How much shorter than 1 the rays are, at most; without bound where nothing is known. 1 or more: they may be of any length.
    pub short: f32,
    /// Whether the rays have an end.
    pub finite: bool,
}

/// A triangle that may hide some of a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeenTriangle {
    /// U, V, W, det towards the light's middle.
    middle: [f32; 4],
    /// How they change along the light's axes.
    slopes: [[f32; 3]; 4],
    /// How far U, V, W are on one side of 0 if they are, for sure.
    edge: f32,
    /// What |det| is above where the ray is not edge-on.
    graze: f32,
    /// det above this: the triangle is before the light.
    near: f32,
    /// det below this: it is not.
    far: f32,
    /// Which it is: the leaf, the place in it, and what the caller says.
    pub leaf: u32,
    pub place: u32,
    pub source: u32,
}

/// What hides what, of some part of a light: bits of cells or samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Verdict {
    /// For sure.
    pub hidden: u16,
    /// Perhaps.
    pub unsure: u16,
}

/// Four numbers of each of four leaves.
#[inline(always)]
fn sixteen<S: Simd>(simd: S, packs: &[&Pack; TOGETHER], vertex: usize, axis: usize) -> f32x16<S> {
    let [a, b, c, d] = packs.map(|pack| f32x4::load_array_ref(simd, &pack.vertices[vertex][axis]));
    let left: f32x8<S> = simd.combine_f32x4(a, b);
    simd.combine_f32x8(left, simd.combine_f32x4(c, d))
}

type V<S> = [f32x16<S>; 3];

#[inline(always)]
fn minus<S: Simd>(a: V<S>, b: V<S>) -> V<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn cross<S: Simd>(a: V<S>, b: V<S>) -> V<S> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn dot<S: Simd>(a: V<S>, b: Vec3) -> f32x16<S> {
    a[2].mul_add(b.z, a[1].mul_add(b.y, a[0] * b.x))
}

#[inline(always)]
fn largest<S: Simd>(a: V<S>) -> f32x16<S> {
    a[0].abs().max(a[1].abs()).max(a[2].abs())
}

impl TriangleTree {
    /// Looks at the triangles of up to four leaves from `eye`: those that may hide some samples of the light go to `seen`. Says
    /// whether one of those that `filter` lets count hides all of it.
    #[inline(always)]
    pub fn look<S: Simd>(
        &self,
        simd: S,
        eye: &Eye,
        leaves: &[u32],
        source: u32,
        filter: &impl Fn(u32) -> bool,
        seen: &mut Vec<SeenTriangle>,
    ) -> bool {
        let last = leaves.len() - 1;
        let packs: [&Pack; TOGETHER] = std::array::from_fn(|i| &self.packs[leaves[i.min(last)] as usize]);
        let o = [eye.o.x, eye.o.y, eye.o.z].map(|x| simd.splat_f32x16(x));
        let vertex = |i: usize| minus([0, 1, 2].map(|axis| sixteen(simd, &packs, i, axis)), o);
        let (a, b, c) = (vertex(0), vertex(1), vertex(2));
        let (ab, bc, ca) = (minus(a, b), minus(b, c), minus(c, a));
        let n = cross(ca, minus(b, a));
        let (fu, fv, fw) = (cross(c, bc), cross(a, ca), cross(b, ab));
        let far_off = largest(a).max(largest(b)).max(largest(c));
        let side = largest(ab).max(largest(bc)).max(largest(ca));
        let area = n[0].abs() + n[1].abs() + n[2].abs();
        let height = n[2].mul_add(a[2], n[1].mul_add(a[1], n[0] * a[0]));
        // Turned so that the plane is ahead of those with det > 0
        let zero = simd.splat_f32x16(0.0);
        let behind = height.simd_lt(zero);
        let turn = |x: f32x16<S>| behind.select(-x, x);
        let height = height.abs();
        let [l, [a0, a1, a2]] = [[eye.l; 3], eye.axes];
        let form = |f: V<S>| {
            let (m, s0, s1, s2) = (turn(dot(f, l[0])), turn(dot(f, a0)), turn(dot(f, a1)), turn(dot(f, a2)));
            ([m, s0, s1, s2], s0.abs() + s1.abs() + s2.abs())
        };
        let ((u, ur), (v, vr), (w, wr), (d, dr)) = (form(fu), form(fv), form(fw), form(n));
        // How far each can be wrong
        let (side2, side3) = (side * side, side * side * side);
        let longest = simd.splat_f32x16(eye.longest);
        let edge = far_off * side * longest * EDGE;
        let det_wrong = side2 * longest * TURN;
        let wrong = area * far_off * DEPTH + far_off * side2 * HEIGHT;
        let sliver = side3 * SLIVER;
        let graze = area * longest * GRAZE;
        let sound = side.simd_gt(1e-9)
            & (far_off * longest * side2).simd_gt(1e-30)
            & (far_off * longest).simd_lt(1e15)
            & side.simd_lt(1e9)
            & area.simd_gt(0.0);
        // Those that hide nothing
        let above = |m: f32x16<S>, r: f32x16<S>| (m - r).simd_gt(edge);
        let below = |m: f32x16<S>, r: f32x16<S>| (m + r).simd_lt(-edge);
        let outside = below(u[0], ur) | below(v[0], vr) | below(w[0], wr);
        let (inside_u, inside_v, inside_w) = (above(u[0], ur), above(v[0], vr), above(w[0], wr));
        let (least, most) = (d[0] - dr, d[0] + dr);
        let large = height.simd_gt(area * (side * 3.0) + wrong);
        let ahead = least.simd_gt(det_wrong);
        let away = most.simd_lt(zero) & ((height - wrong) * -most).simd_gt(area * longest * sliver);
        let mut nothing = (outside & (inside_u | inside_v | inside_w | large | ahead)) | away;
        if eye.finite {
            let ratio = eye.longest / eye.shortest * GRAZE_ALL;
            let room = area * (far_off * ratio) + sliver * (1.0 / GRAZE_ALL) + wrong + det_wrong;
            nothing |= (most + room).simd_lt(height) & height.simd_gt(room);
        }
        let keep = (!(nothing & sound)) & area.simd_gt(zero);
        let mut keep = keep.to_bitmask() as u32;
        if leaves.len() < TOGETHER {
            keep &= (1 << (PACK * leaves.len())) - 1;
        }
        if keep == 0 {
            return false;
        }
        // Those that hide something: for sure where det is above `near`, for sure not where it is below `far`
        let middling = height.simd_gt(wrong + sliver * (1.0 / GRAZE)) & sound;
        let before = if eye.finite { (height + wrong + sliver * (1.0 / GRAZE)) * eye.short } else { zero };
        let infinite = simd.splat_f32x16(f32::INFINITY);
        let near = middling.select(before.max(graze) + det_wrong, infinite);
        let far = if eye.finite { height - area * (side * 3.0) - wrong - det_wrong } else { -infinite };
        let far = (large & sound).select(far, -infinite);
        let graze = large.select(-infinite, middling.select(graze + det_wrong, infinite));
        let graze = sound.select(graze, infinite);
        let edge = sound.select(edge, infinite);
        let whole = inside_u & inside_v & inside_w & least.simd_gt(near) & sound;
        let mut whole = whole.to_bitmask() as u32 & keep;
        while whole != 0 {
            let lane = whole.trailing_zeros() as usize & 15;
            whole &= whole - 1;
            let id = packs[lane / PACK].ids[lane % PACK];
            if id != NONE && filter(id) {
                return true;
            }
        }
        let forms = [u, v, w, d].map(|form| form.map(|x| x.to_array()));
        let [edge, graze, near, far] = [edge, graze, near, far].map(|x| x.to_array());
        while keep != 0 {
            let lane = keep.trailing_zeros() as usize & 15;
            keep &= keep - 1;
            let id = packs[lane / PACK].ids[lane % PACK];
            if id == NONE || !filter(id) {
                continue;
            }
            seen.push(SeenTriangle {
                middle: [0, 1, 2, 3].map(|i| forms[i][0][lane]),
                slopes: [0, 1, 2, 3].map(|i| [forms[i][1][lane], forms[i][2][lane], forms[i][3][lane]]),
                edge: edge[lane],
                graze: graze[lane],
                near: near[lane],
                far: far[lane],
                leaf: leaves[lane / PACK],
                place: (lane % PACK) as u32,
                source,
            });
        }
        false
    }

    /// Which of the rays in `active` the kernel says a triangle is on, 0 < t <= `t_max` of each.
    #[inline(always)]
    pub fn meets<S: Simd>(
        &self,
        simd: S,
        rays: &RayPacket16,
        t_max: &[f32; 16],
        triangle: &SeenTriangle,
        active: u16,
    ) -> u16 {
        let (pack, place) = (&self.packs[triangle.leaf as usize], triangle.place as usize % PACK);
        let mut met = 0;
        let one = |lane: usize| {
            let ray = rays.ray(lane);
            let slabs = Slabs::new(&ray, self.tree.center, self.tree.half);
            let hit = if ray.is_valid { intersect(&ray, &slabs, &pack.triangle(place)) } else { None };
            u16::from(hit.is_some_and(|hit| hit.t > 0.0 && hit.t <= t_max[lane])) << lane
        };
        if active.count_ones() <= 2 {
            for lane in bits(u64::from(active)) {
                met |= one(lane);
            }
            return met;
        }
        for (which, group) in groups(simd, rays, u64::from(active)).into_iter().enumerate() {
            if group == 0 {
                continue;
            }
            let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][which / 2];
            let lanes = rays.lanes(simd, 0, axes, self.tree.center, self.tree.half);
            let Some(crossings) = intersect_lanes(simd, &lanes, along(pack, place, axes)) else { continue };
            let reach = f32x16::load_array_ref(simd, t_max);
            let hit = crossings.mask & crossings.t.simd_gt(simd.splat_f32x16(0.0)) & crossings.t.simd_le(reach);
            met |= hit.to_bitmask() as u16 & group as u16 & !(crossings.unsure as u16);
            for lane in bits(crossings.unsure & group) {
                met |= one(lane);
            }
        }
        met
    }
}

impl SeenTriangle {
    /// What it hides of sixteen cells: middles and half sizes along the light's axes. `unsure` are those it may hide some of.
    #[inline(always)]
    pub fn cells<S: Simd>(&self, simd: S, middle: &[[f32; 16]; 3], half: &[[f32; 16]; 3]) -> Verdict {
        let [m0, m1, m2] = [0, 1, 2].map(|axis| f32x16::load_array_ref(simd, &middle[axis]));
        let [h0, h1, h2] = [0, 1, 2].map(|axis| f32x16::load_array_ref(simd, &half[axis]));
        let range = |i: usize| {
            let [a, b, c] = self.slopes[i];
            let m = m2.mul_add(c, m1.mul_add(b, m0.mul_add(a, self.middle[i])));
            (m, h2.mul_add(c.abs(), h1.mul_add(b.abs(), h0 * a.abs())))
        };
        let ((u, ur), (v, vr), (w, wr), (d, dr)) = (range(0), range(1), range(2), range(3));
        let (lu, lv, lw, ld) = (u - ur, v - vr, w - wr, d - dr);
        let (hu, hv, hw, hd) = (u + ur, v + vr, w + wr, d + dr);
        let outside = hu.min(hv).min(hw).simd_lt(-self.edge);
        let other = lu.max(lv).max(lw).simd_gt(self.edge);
        let nothing = (outside & (other | ld.simd_gt(self.graze) | hd.simd_lt(-self.graze))) | hd.simd_lt(self.far);
        let all = lu.min(lv).min(lw).simd_gt(self.edge) & ld.simd_gt(self.near);
        let hidden = all.to_bitmask() as u16;
        Verdict { hidden, unsure: !(nothing.to_bitmask() as u16 | hidden) }
    }

    /// What it hides of sixteen samples. `unsure` are those the kernel has to decide.
    #[inline(always)]
    pub fn samples<S: Simd>(&self, simd: S, at: &[[f32; 16]; 3]) -> Verdict {
        let [x, y, z] = [0, 1, 2].map(|axis| f32x16::load_array_ref(simd, &at[axis]));
        let value = |i: usize| {
            let [a, b, c] = self.slopes[i];
            z.mul_add(c, y.mul_add(b, x.mul_add(a, self.middle[i])))
        };
        let (u, v, w, d) = (value(0), value(1), value(2), value(3));
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        let outside = least.simd_lt(-self.edge);
        let other: mask32x16<S> = most.simd_gt(self.edge) | d.abs().simd_gt(self.graze);
        let nothing = (outside & other) | d.simd_lt(self.far);
        let hidden = least.simd_gt(self.edge) & d.simd_gt(self.near);
        let hidden = hidden.to_bitmask() as u16;
        Verdict { hidden, unsure: !(nothing.to_bitmask() as u16 | hidden) }
    }
}
