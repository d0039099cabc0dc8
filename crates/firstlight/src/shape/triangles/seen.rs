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
//! coordinates from -1 to 1, so each is a number and three slopes: its values over the whole light, or over a cell of
//! it, lie between middle and slopes added up, and for a sample it is three multiplications and additions. Turned so
//! that T > 0, a triangle stands in the way where U, V and W are above 0 and T is below det.
//!
//! The answers have to be those of the kernel ([`intersect`]), which rounds, so each bound has a margin, and what lies
//! within is left to the kernel. With D the largest coordinate of A, B, C; s that of the edges; L that of all ways; |n|
//! = |nx| + |ny| + |nz|; and half an ulp h = 2^-24:
//!
//! - The kernel's sheared vertices are off by at most e = 6 h D along each axis, and its signs of U, V, W are exact for
//!   these. So what it calls inside lies within sqrt 2 e of the triangle, and what lies inside by more than that it
//!   calls inside; an edge is no longer than 2 sqrt 2 s there. In units of U that is 24 h D s L. What is computed here
//!   is off by less than 100 h D s L more: edges, products, the light's own frame. [`EDGE`].
//! - If it calls the ray inside, then the line comes within e of a point X of the triangle at a depth z with
//!   |T - z det| <= |n| e, and its t is the depth of another point Y of the triangle, wrong by 8 h D / |lz|, with
//!   |T - t det| <= |n| (e + 8 h D + 96 h s^3 / |det|): the areas are wrong by 4 h s^2 each where the ray is inside,
//!   which moves Y by 12 h (2 s)^3 / det. Edge-on Y is anywhere on the triangle, 3 s from the ray at most. Where t is
//!   before the triangle's box, it is moved to where the box begins, which is not behind X.
//! - So with T > |n| (3 s + 16 h D) no ray is stopped whose det is below T by as much (`far`), nor any that is outside
//!   of one edge. With T smaller than that, one outside of one edge and inside of another is not stopped either way
//!   round; and one outside of an edge is not if it is not edge-on (|det| > |n| L / 64) and T > 16 h D |n| + 64 x 96 h
//!   s^3.
//! - What the kernel calls inside lies within sqrt 2 e of the triangle, so also between the planes through o, along one
//!   of the light's axes, that hold the triangle. With X a vertex, (X x a1).l = 0 is such a plane, and it meets the
//!   light at u = -(X.(a1 x l0) + w X.(a1 x a2)) / X.(a1 x a0). Each of these products may be wrong by as much as U, in
//!   D L times the size of the axis, if all vertices are on the light's side of o. So nothing is hidden beside that.
//!   Ways to a ball, of any length, are told by where they meet the plane through its middle that faces o, w = 0.
//! - Ways that count lie above the horizon, h.l > 0, but for 8 h |h| L by which that is wrong. So where its ray meets X
//!   it is no farther below o than that times t, and t is no more than 1 if the ray has an end, nor than D over the
//!   least of the ways: a triangle whose vertices are below by that, and by 16 h |h| D, is not met. [`BELOW`].
//! - A ray is stopped if it is inside of all edges, not edge-on, and det is above T by what t can be wrong, and by what
//!   the ray stops short of the light.
//!
//! Sizes beyond which any of these products could leave the range of numbers are left to the kernel. Numbers by cell
//! and sample are fused where a processor can: what is decided by them is right either way, and what is not is left to
//! the kernel.

use fearless_simd::{f32x4, f32x8, f32x16, mask32x16, prelude::*};

use super::kernel::{intersect, intersect_lanes};
use super::{CORNER_ROUNDING, NONE, PACK, Pack, TriangleTree, along, bits, is_in_plane};
use crate::accel::{RayPacket16, Slabs, groups};
use crate::math::{DVec3, UNIT_ROUNDOFF as H, Vec3};
use crate::shape::cover::LightSeen;

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

/// By how much a ray that counts can lead below a horizon, in |h| D + |h| t L.
const BELOW: f32 = 32.0 * H;

/// In radii: balls no farther away than this bound nothing.
const APART: f32 = 1.01;
/// Triangles in a rectangle smaller than so many cells are small beside them: then edges are not looked at. With none a
/// mesh of small triangles takes a quarter longer.
const SMALL: f32 = 2.0;

/// Packs that are looked at together.
pub(crate) const TOGETHER: usize = 4;

/// Where rays start, and the light, in the space of a mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eye {
    /// The origin of the rays.
    pub o: Vec3,
    /// How far the point that they leave may be wrong.
    pub error: DVec3,
    /// The light; in another space than the world's, its `longest` is also at least the sum of the sizes of what it was
    /// computed from.
    pub light: LightSeen,
    /// How much shorter than 1 the rays are, at most; without bound where nothing is known. 1 or more: they may be of
    /// any length.
    pub short: f32,
    /// Ways that are not above both do not count.
    pub horizons: [Vec3; 2],
}

/// What sixteen triangles may hide of a light: from where to where along two axes across.
struct ShadowBounds<S: Simd> {
    low: [f32x16<S>; 2],
    high: [f32x16<S>; 2],
}

impl<S: Simd> ShadowBounds<S> {
    /// Of triangles with these vertices from o, the farthest coordinates of those, and whether products of them are
    /// `sound`.
    #[inline(always)]
    fn new(simd: S, eye: &Eye, vertices: [V<S>; 3], far_off: f32x16<S>, sound: mask32x16<S>) -> Self {
        let [a, b, c] = eye.light.frame;
        let normal = b.cross(a);
        let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
        let infinite = simd.splat_f32x16(f32::INFINITY);
        // Whether all of the light is on one side of o, and on which
        let (ahead, depth) = (normal.dot(eye.light.l), normal.dot(c).abs());
        let size = a.abs().max(b.abs()).max_element() * eye.light.longest;
        let is_apart =
            ahead.abs() - depth > EDGE * size * eye.light.longest && eye.light.radii.is_none_or(|radii| radii > APART);
        let side = if ahead < 0.0 { -1.0 } else { 1.0 };
        let wrong = far_off * (2.0 * EDGE * size);
        let mut is_ahead = sound & mask32x16::splat(simd, is_apart);
        let mut bounds = ShadowBounds { low: [infinite; 2], high: [-infinite; 2] };
        for x in vertices {
            let across = dot(x, normal) * side;
            is_ahead &= across.simd_gt(wrong);
            let inverse = one / is_ahead.select(across, one);
            for (axis, (along, turned)) in [(b, -side), (a, side)].into_iter().enumerate() {
                let middle = dot(x, along.cross(eye.light.l)) * inverse * turned;
                let reach = if eye.light.radii.is_some() { zero } else { (dot(x, along.cross(c)) * inverse).abs() };
                let room = reach + wrong * inverse * (middle.abs() + reach + 2.0);
                bounds.low[axis] = bounds.low[axis].min(middle - room);
                bounds.high[axis] = bounds.high[axis].max(middle + room);
            }
        }
        for axis in 0..2 {
            bounds.low[axis] = is_ahead.select(bounds.low[axis], -infinite);
            bounds.high[axis] = is_ahead.select(bounds.high[axis], infinite);
        }
        bounds
    }

    /// Those that are beside the light.
    #[inline(always)]
    fn beside(&self, eye: &Eye) -> mask32x16<S> {
        let ([u, v], [to_u, to_v]) = (self.low, self.high);
        // Where the cone that holds a ball meets that plane
        let rim = eye.light.radii.map_or(1.0, |radii| radii / (radii * radii - 1.0).max(0.0).sqrt() * (1.0 + 1e-3));
        u.max(v).simd_gt(rim) | to_u.min(to_v).simd_lt(-rim)
    }
}

/// Sixteen parts of a light as they are seen: from where to where along the axes that triangles are bounded along.
pub(crate) struct SeenParts {
    pub low: [[f32; 16]; 2],
    pub high: [[f32; 16]; 2],
}

impl SeenParts {
    /// None yet, and beside all.
    pub const NONE: SeenParts = SeenParts { low: [[f32::INFINITY; 16]; 2], high: [[f32::NEG_INFINITY; 16]; 2] };

    /// The first `count` of those of a flat light, with these middles and half sizes along its axes.
    #[inline(always)]
    pub fn flat<S: Simd>(simd: S, middle: &[[f32; 16]; 3], half: &[[f32; 16]; 3], count: usize) -> SeenParts {
        let mut parts = SeenParts::NONE;
        let (middle, half) = (load(simd, middle), load(simd, half));
        for axis in 0..2 {
            (middle[axis] - half[axis]).store_slice(&mut parts.low[axis]);
            (middle[axis] + half[axis]).store_slice(&mut parts.high[axis]);
            for lane in count..16 {
                (parts.low[axis][lane], parts.high[axis][lane]) = (f32::INFINITY, f32::NEG_INFINITY);
            }
        }
        parts
    }

    /// How large the first is.
    #[inline(always)]
    fn area(&self) -> f32 {
        (self.high[0][0] - self.low[0][0]) * (self.high[1][0] - self.low[1][0])
    }
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
    /// From where to where along the axes of the eye's frame it hides anything, at most.
    low: [f32; 2],
    high: [f32; 2],
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

// What follows is written without closures and `map`: out of line they lose the instruction set.

/// Four numbers of each of four leaves.
#[inline(always)]
fn sixteen<S: Simd>(simd: S, packs: [&Pack; TOGETHER], vertex: usize, axis: usize) -> f32x16<S> {
    let [a, b, c, d] = packs;
    let left: f32x8<S> = simd.combine_f32x4(
        f32x4::load_array_ref(simd, &a.vertices[vertex][axis]),
        f32x4::load_array_ref(simd, &b.vertices[vertex][axis]),
    );
    let right: f32x8<S> = simd.combine_f32x4(
        f32x4::load_array_ref(simd, &c.vertices[vertex][axis]),
        f32x4::load_array_ref(simd, &d.vertices[vertex][axis]),
    );
    simd.combine_f32x8(left, right)
}

type V<S> = [f32x16<S>; 3];

/// One vertex of all triangles of four leaves, from `o`.
#[inline(always)]
fn vertex<S: Simd>(simd: S, packs: [&Pack; TOGETHER], i: usize, o: Vec3) -> V<S> {
    [sixteen(simd, packs, i, 0) - o.x, sixteen(simd, packs, i, 1) - o.y, sixteen(simd, packs, i, 2) - o.z]
}

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
    a[2] * b.z + (a[1] * b.y + a[0] * b.x)
}

#[inline(always)]
fn largest<S: Simd>(a: V<S>) -> f32x16<S> {
    a[0].abs().max(a[1].abs()).max(a[2].abs())
}

/// A number that is linear in the way, of sixteen triangles: towards the light's middle, its slopes, and how far it
/// goes.
#[derive(Clone, Copy)]
struct LinearWay<S: Simd> {
    middle: f32x16<S>,
    slopes: V<S>,
    reach: f32x16<S>,
}

impl<S: Simd> LinearWay<S> {
    /// f.l, with the other sign for those in `behind`.
    #[inline(always)]
    fn new(f: V<S>, eye: &Eye, behind: mask32x16<S>) -> Self {
        let (m, a, b, c) =
            (dot(f, eye.light.l), dot(f, eye.light.axes[0]), dot(f, eye.light.axes[1]), dot(f, eye.light.axes[2]));
        LinearWay { middle: behind.select(-m, m), slopes: [a, b, c], reach: a.abs() + b.abs() + c.abs() }
    }

    #[inline(always)]
    fn least(&self) -> f32x16<S> {
        self.middle - self.reach
    }

    #[inline(always)]
    fn most(&self) -> f32x16<S> {
        self.middle + self.reach
    }

    #[inline(always)]
    fn store(&self, behind: mask32x16<S>, to: &mut [[f32; 16]; 4]) {
        let [a, b, c] = self.slopes;
        self.middle.store_slice(&mut to[0]);
        behind.select(-a, a).store_slice(&mut to[1]);
        behind.select(-b, b).store_slice(&mut to[2]);
        behind.select(-c, c).store_slice(&mut to[3]);
    }
}

impl TriangleTree {
    /// Looks at the triangles of up to four leaves from `eye`: those that may hide some samples of the light go to
    /// `seen`. Says whether one of those that `filter` lets count hides all of it.
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
        let packs: [&Pack; TOGETHER] = [
            &self.packs[leaves[0] as usize],
            &self.packs[leaves[last.min(1)] as usize],
            &self.packs[leaves[last.min(2)] as usize],
            &self.packs[leaves[last.min(3)] as usize],
        ];
        let (a, b, c) = (vertex(simd, packs, 0, eye.o), vertex(simd, packs, 1, eye.o), vertex(simd, packs, 2, eye.o));
        let (ab, bc, ca) = (minus(a, b), minus(b, c), minus(c, a));
        let n = cross(ca, minus(b, a));
        let far_off = largest(a).max(largest(b)).max(largest(c));
        let side = largest(ab).max(largest(bc)).max(largest(ca));
        let area = n[0].abs() + n[1].abs() + n[2].abs();
        let height = n[2] * a[2] + (n[1] * a[1] + n[0] * a[0]);
        // Turned so that the plane is ahead of those with det > 0
        let zero = simd.splat_f32x16(0.0);
        let behind = height.simd_lt(zero);
        let height = height.abs();
        let u = LinearWay::new(cross(c, bc), eye, behind);
        let v = LinearWay::new(cross(a, ca), eye, behind);
        let w = LinearWay::new(cross(b, ab), eye, behind);
        let d = LinearWay::new(n, eye, behind);
        // How far each can be wrong
        let (side2, side3) = (side * side, side * side * side);
        let longest = simd.splat_f32x16(eye.light.longest);
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
        let outside = u.most().min(v.most()).min(w.most()).simd_lt(-edge);
        let (inside_u, inside_v, inside_w) = (u.least(), v.least(), w.least());
        let inside_one = inside_u.max(inside_v).max(inside_w).simd_gt(edge);
        let (least, most) = (d.least(), d.most());
        let large = height.simd_gt(area * (side * 3.0) + wrong);
        let ahead = least.simd_gt(det_wrong);
        let away = most.simd_lt(zero) & ((height - wrong) * -most).simd_gt(area * longest * sliver);
        let mut nothing = (outside & (inside_one | large | ahead)) | away;
        if eye.light.finite {
            let ratio = eye.light.longest / eye.light.shortest * GRAZE_ALL;
            let room = area * (far_off * ratio) + sliver * (1.0 / GRAZE_ALL) + wrong + det_wrong;
            nothing |= (most + room).simd_lt(height) & height.simd_gt(room);
        }
        let bounds = ShadowBounds::new(simd, eye, [a, b, c], far_off, sound);
        nothing |= bounds.beside(eye);
        let keep = (!(nothing & sound)) & area.simd_gt(zero);
        let mut keep = keep.to_bitmask() as u32;
        if leaves.len() < TOGETHER {
            keep &= (1 << (PACK * leaves.len())) - 1;
        }
        if keep == 0 {
            return false;
        }
        // How far a ray leads, up to where a triangle is
        let led = far_off * (eye.light.longest / eye.light.shortest);
        let led = if eye.light.finite { led.min(eye.light.longest) } else { led };
        for horizon in eye.horizons {
            let highest = dot(a, horizon).max(dot(b, horizon)).max(dot(c, horizon));
            let room = (far_off + led) * (BELOW * horizon.abs().element_sum());
            keep &= !(((highest + room).simd_lt(zero) & sound).to_bitmask() as u32);
        }
        if keep == 0 {
            return false;
        }
        // Nor do those that the rays start in the plane of: an upper bound on the tolerance of that test leaves few to
        // ask. Each area is at most 3 far_off side, |n| 6 far_off side
        let largest = far_off + 1.6 * eye.o.abs().max_element();
        let allowed = largest * far_off * side * (10.0 * CORNER_ROUNDING as f32)
            + area * (2.1 * eye.error.max_element() as f32)
            + wrong;
        let mut level = height.simd_le(allowed).to_bitmask() as u32 & keep;
        while level != 0 {
            let lane = level.trailing_zeros() as usize & 15;
            level &= level - 1;
            let corners = packs[lane / PACK].triangle(lane % PACK).map(|q| q.as_dvec3());
            keep &= !(u32::from(is_in_plane(corners, eye.o.as_dvec3(), eye.error)) << lane);
        }
        // Those that hide something: for sure where det is above `near`, for sure not where it is below `far`
        let middling = height.simd_gt(wrong + sliver * (1.0 / GRAZE)) & sound;
        let before = if eye.light.finite { (height + wrong + sliver * (1.0 / GRAZE)) * eye.short } else { zero };
        let infinite = simd.splat_f32x16(f32::INFINITY);
        let near = middling.select(before.max(graze) + det_wrong, infinite);
        let far = if eye.light.finite { height - area * (side * 3.0) - wrong - det_wrong } else { -infinite };
        let far = (large & sound).select(far, -infinite);
        let graze = large.select(-infinite, middling.select(graze + det_wrong, infinite));
        let graze = sound.select(graze, infinite);
        let edge = sound.select(edge, infinite);
        let inside_all = inside_u.min(inside_v).min(inside_w).simd_gt(edge);
        let whole = inside_all & least.simd_gt(near) & sound;
        let mut whole = whole.to_bitmask() as u32 & keep;
        while whole != 0 {
            let lane = whole.trailing_zeros() as usize & 15;
            whole &= whole - 1;
            let id = packs[lane / PACK].ids[lane % PACK];
            if id != NONE && filter(id) {
                return true;
            }
        }
        let mut forms = [[[0.0; 16]; 4]; 4];
        u.store(behind, &mut forms[0]);
        v.store(behind, &mut forms[1]);
        w.store(behind, &mut forms[2]);
        d.store(behind, &mut forms[3]);
        let (edge, graze, near, far) = (edge.to_array(), graze.to_array(), near.to_array(), far.to_array());
        let low = [bounds.low[0].to_array(), bounds.low[1].to_array()];
        let high = [bounds.high[0].to_array(), bounds.high[1].to_array()];
        while keep != 0 {
            let lane = keep.trailing_zeros() as usize & 15;
            keep &= keep - 1;
            let id = packs[lane / PACK].ids[lane % PACK];
            if id == NONE || !filter(id) {
                continue;
            }
            let mut triangle = SeenTriangle {
                middle: [0.0; 4],
                slopes: [[0.0; 3]; 4],
                edge: edge[lane],
                graze: graze[lane],
                near: near[lane],
                far: far[lane],
                low: [low[0][lane], low[1][lane]],
                high: [high[0][lane], high[1][lane]],
                leaf: leaves[lane / PACK],
                place: (lane % PACK) as u32,
                source,
            };
            for (i, [middle, slopes @ ..]) in forms.iter().enumerate() {
                triangle.middle[i] = middle[lane];
                for (axis, slope) in slopes.iter().enumerate() {
                    triangle.slopes[i][axis] = slope[lane];
                }
            }
            seen.push(triangle);
        }
        false
    }

    /// Whether the kernel says that a ray is on a triangle.
    #[inline(always)]
    fn meets_one(&self, rays: &RayPacket16, t_max: &[f32; 16], pack: &Pack, place: usize, lane: usize) -> bool {
        let ray = rays.ray(lane);
        let slabs = Slabs::new(&ray, self.tree.center, self.tree.half);
        let hit = if ray.is_valid { intersect(&ray, &slabs, &pack.triangle(place)) } else { None };
        hit.is_some_and(|hit| hit.t > 0.0 && hit.t <= t_max[lane])
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
        if active.count_ones() <= 2 {
            for lane in bits(u64::from(active)) {
                met |= u16::from(self.meets_one(rays, t_max, pack, place, lane)) << lane;
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
                met |= u16::from(self.meets_one(rays, t_max, pack, place, lane)) << lane;
            }
        }
        met
    }
}

/// Three vectors of sixteen.
#[inline(always)]
fn load<S: Simd>(simd: S, v: &[[f32; 16]; 3]) -> V<S> {
    [f32x16::load_array_ref(simd, &v[0]), f32x16::load_array_ref(simd, &v[1]), f32x16::load_array_ref(simd, &v[2])]
}

impl SeenTriangle {
    /// One of U, V, W, det for sixteen ways.
    #[inline(always)]
    fn value<S: Simd>(&self, i: usize, at: V<S>) -> f32x16<S> {
        let ([a, b, c], simd) = (self.slopes[i], at[0].simd);
        let middle = simd.splat_f32x16(self.middle[i]);
        let [a, b, c] = [simd.splat_f32x16(a), simd.splat_f32x16(b), simd.splat_f32x16(c)];
        at[2].mul_add(c, at[1].mul_add(b, at[0].mul_add(a, middle)))
    }

    /// How far it goes within cells of half these sizes.
    #[inline(always)]
    fn reach<S: Simd>(&self, i: usize, half: V<S>) -> f32x16<S> {
        let ([a, b, c], simd) = (self.slopes[i], half[0].simd);
        let [b, c] = [simd.splat_f32x16(b.abs()), simd.splat_f32x16(c.abs())];
        half[2].mul_add(c, half[1].mul_add(b, half[0] * a.abs()))
    }

    /// Whether it is known from where to where it hides anything.
    #[inline(always)]
    pub fn is_bounded(&self) -> bool {
        self.low[0] > f32::NEG_INFINITY
    }

    /// What it hides of sixteen cells: middles and half sizes along the light's axes, and what they are seen as.
    /// `unsure` are those it may hide some of.
    #[inline(always)]
    pub fn cells<S: Simd>(
        &self,
        simd: S,
        middle: &[[f32; 16]; 3],
        half: &[[f32; 16]; 3],
        parts: &SeenParts,
    ) -> Verdict {
        let mut beside = mask32x16::splat(simd, false);
        for axis in 0..2 {
            beside |= f32x16::load_array_ref(simd, &parts.low[axis]).simd_gt(self.high[axis])
                | f32x16::load_array_ref(simd, &parts.high[axis]).simd_lt(self.low[axis]);
        }
        let beside = beside.to_bitmask() as u16;
        // A small one hides no cell, and its edges part few from it
        let area = (self.high[0] - self.low[0]) * (self.high[1] - self.low[1]);
        if beside == u16::MAX || area < SMALL * parts.area() {
            return Verdict { hidden: 0, unsure: !beside };
        }
        let (middle, half) = (load(simd, middle), load(simd, half));
        let (u, v, w, d) = (self.value(0, middle), self.value(1, middle), self.value(2, middle), self.value(3, middle));
        let (ur, vr, wr, dr) = (self.reach(0, half), self.reach(1, half), self.reach(2, half), self.reach(3, half));
        let (lu, lv, lw, ld) = (u - ur, v - vr, w - wr, d - dr);
        let (hu, hv, hw, hd) = (u + ur, v + vr, w + wr, d + dr);
        let outside = hu.min(hv).min(hw).simd_lt(-self.edge);
        let other = lu.max(lv).max(lw).simd_gt(self.edge);
        let outside = outside & (other | ld.simd_gt(self.graze) | hd.simd_lt(-self.graze));
        let nothing = outside | hd.simd_lt(self.far);
        let all = lu.min(lv).min(lw).simd_gt(self.edge) & ld.simd_gt(self.near);
        let hidden = all.to_bitmask() as u16;
        Verdict { hidden, unsure: !(nothing.to_bitmask() as u16 | hidden | beside) }
    }

    /// What it hides of sixteen samples. `unsure` are those the kernel has to decide.
    #[inline(always)]
    pub fn samples<S: Simd>(&self, simd: S, at: &[[f32; 16]; 3]) -> Verdict {
        let at = load(simd, at);
        let (u, v, w, d) = (self.value(0, at), self.value(1, at), self.value(2, at), self.value(3, at));
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        let outside = least.simd_lt(-self.edge);
        let other: mask32x16<S> = most.simd_gt(self.edge) | d.abs().simd_gt(self.graze);
        let nothing = (outside & other) | d.simd_lt(self.far);
        let hidden = least.simd_gt(self.edge) & d.simd_gt(self.near);
        let hidden = hidden.to_bitmask() as u16;
        Verdict { hidden, unsure: !(nothing.to_bitmask() as u16 | hidden) }
    }
}
