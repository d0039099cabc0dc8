//! Triangle meshes: the tree over the triangles of one mesh, and the ways to ask it.
//!
//! A hit is defined by the kernel alone ([`kernel::intersect`]): 0 < t <= t_max, both sides, and of several at the same
//! t the triangle with the lowest number. The tree only leaves out what cannot be a hit, so it answers as if every
//! triangle had been asked, bit for bit (`TriangleTree::brute_force`), by single ray, packet or tile, on every
//! processor.

mod hits;
mod kernel;
mod seen;
#[cfg(test)]
mod tests;

use fearless_simd::{Level, f32x4, f32x8, f32x16, prelude::*};

use crate::accel::{
    Aabb, Beam, Built, LEAF, LaneSlabs, RayPacket16, RayTile, Slabs, TraceRay, Tree, build, dispatch_eight,
    dispatch_sixteen, groups,
};
use crate::math::{DVec3, UNIT_ROUNDOFF, Vec3};
pub(crate) use hits::{PacketHits, TileHits, TriangleHit};
use kernel::{Crossing, Crossings, intersect, intersect_lanes};
pub(crate) use seen::{Eye, SeenParts, SeenTriangle, TOGETHER};

/// Triangles in a leaf.
const PACK: usize = 4;
/// A triangle's number where there is none: all its coordinates are NaN.
const NONE: u32 = u32::MAX;
/// Fewer rays than this go one by one.
const FEW: u32 = 4;
/// Processors with fewer lanes than this take packets and tiles ray by ray. The same answers, and half the code to
/// compile.
const WIDE: usize = 8;

/// The triangles of a leaf, coordinate by coordinate.
#[derive(Clone)]
#[repr(C, align(32))]
struct Pack {
    /// By vertex, then axis, then triangle.
    vertices: [[[f32; PACK]; 3]; 3],
    ids: [u32; PACK],
}

impl Pack {
    /// Vertices of a triangle.
    #[inline(always)]
    fn triangle(&self, place: usize) -> [Vec3; 3] {
        self.vertices.map(|v| Vec3::new(v[0][place], v[1][place], v[2][place]))
    }
}

/// The triangles of a mesh, ready to be hit.
pub(crate) struct TriangleTree {
    tree: Tree,
    packs: Vec<Pack>,
    len: usize,
}

/// A triangle's vertices, if it has an area and all of it is somewhere.
#[inline(always)]
fn corners(positions: &[[f32; 3]], triangle: &[u32; 3]) -> Option<[Vec3; 3]> {
    let mut corners = [Vec3::ZERO; 3];
    for (corner, index) in corners.iter_mut().zip(triangle) {
        *corner = Vec3::from_array(*positions.get(*index as usize)?);
    }
    let [a, b, c] = corners;
    let (ab, ac) = (b - a, c - a);
    // Nearly always the first, cheap, product says enough
    if ab.cross(ac).abs().max_element() > 1e-6 * ab.abs().max_element() * ac.abs().max_element() {
        return Some(corners);
    }
    let [a, b, c] = corners.map(|v| v.as_dvec3());
    ((b - a).cross(c - a) != DVec3::ZERO).then_some(corners)
}

/// Whether a triangle is in a tree over its mesh.
pub(crate) fn can_be_hit(positions: &[[f32; 3]], triangle: &[u32; 3]) -> bool {
    corners(positions, triangle).is_some_and(|corners| corners.iter().all(|corner| corner.is_finite()))
}

/// Whether a shadow ray that starts at `o`, lifted off a surface point that may be wrong by `error`, starts in the
/// plane of a triangle, as far as rounding allows to tell. All in the space of the mesh.
///
/// Seen from o, the corners a, b, c span a volume V = n.a, n = (b - a) x (c - a), that is 0 in the plane. A corner that
/// moves by r changes it by no more than r times the area that the other two span with o, and o by |n| r. So the
/// tolerance grows as triangles get smaller or farther away: their corners hardly decide their plane.
pub(crate) fn is_in_plane(corners: [DVec3; 3], o: DVec3, error: DVec3) -> bool {
    let largest = corners.iter().fold(DVec3::ZERO, |largest, q| largest.max(q.abs())).max_element();
    let [a, b, c] = corners.map(|q| q - o);
    let n = (b - a).cross(c - a);
    let (volume, of_error) = (n.dot(a).abs(), 2.0 * n.abs().dot(error));
    // Bounds of these areas, without roots: nearly always they say enough
    let squares = a.length_squared() + b.length_squared() + c.length_squared();
    let o = o.abs().max_element();
    if volume > (squares * largest + n.abs().element_sum() * o) * CORNER_ROUNDING + of_error {
        return false;
    }
    let areas = b.cross(c).length() + c.cross(a).length() + a.cross(b).length();
    let rounding = (areas * largest + n.length() * o) * CORNER_ROUNDING;
    // The start is off the point by the lift, and the point off the surface by its error
    volume <= rounding + of_error
}

/// How far a corner may be off where it was meant to be, in its largest coordinate: two ulps in f32.
const CORNER_ROUNDING: f64 = 4.0 * UNIT_ROUNDOFF as f64;

impl TriangleTree {
    /// Builds the tree over a mesh. A triangle without area, or with a vertex that is not finite or not there, is left
    /// out.
    pub fn build(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> TriangleTree {
        Self::build_distinct(positions, triangles, |_| ())
    }

    /// The same. Of triangles with the same corners in the same order and the same `class` the first stands for all:
    /// the filters of whoever asks treat a class alike, and of hits at the same t the lowest number wins. Numbers stay
    /// as they are.
    pub fn build_distinct<C: Ord>(
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        class: impl Fn(u32) -> C + Sync,
    ) -> TriangleTree {
        let key = |id: u32| {
            // Adding 0 makes 0 of -0
            let corners = triangles[id as usize].map(|i| positions[i as usize].map(|x| (x + 0.0).to_bits()));
            (corners, class(id))
        };
        let bounds = |i: usize| match corners(positions, &triangles[i]) {
            Some([a, b, c]) => {
                let sum = a + b + c;
                // The minimum of a number and NaN is the number
                if sum.is_nan() { Aabb::EMPTY } else { Aabb { min: a.min(b).min(c), max: a.max(b).max(c) } }
            }
            None => Aabb::EMPTY,
        };
        let Built { tree, order, leaves } = build(triangles.len(), bounds, PACK.ilog2(), key);
        let pack = |leaf: &crate::accel::LeafRange| {
            let mut pack = Pack { vertices: [[[f32::NAN; PACK]; 3]; 3], ids: [NONE; PACK] };
            let run = &order[leaf.first as usize..(leaf.first + leaf.count) as usize];
            for (place, &id) in run.iter().enumerate() {
                pack.ids[place] = id;
                for (corner, &index) in triangles[id as usize].iter().enumerate() {
                    let [x, y, z] = positions[index as usize];
                    let [xs, ys, zs] = &mut pack.vertices[corner];
                    (xs[place], ys[place], zs[place]) = (x, y, z);
                }
            }
            pack
        };
        use rayon::prelude::*;
        let packs = leaves.par_iter().with_min_len(1 << 12).map(pack).collect();
        let len = leaves.iter().map(|leaf| leaf.count as usize).sum();
        TriangleTree { tree, packs, len }
    }

    /// Visits the leaves whose boxes `meet` says yes to, until `leaf` says no; see [`Tree::gather`].
    #[inline(always)]
    pub fn gather<S: Simd, M: Fn(S, &crate::accel::BoxNode) -> (u32, f32x8<S>)>(
        &self,
        simd: S,
        meet: impl FnOnce(Vec3, f32) -> M,
        leaf: impl FnMut(u32) -> bool,
    ) -> bool {
        self.tree.gather(simd, meet(self.tree.center, self.tree.half), leaf)
    }

    /// The triangles of a leaf: their numbers and corners.
    pub fn leaf(&self, leaf: u32) -> impl Iterator<Item = (u32, [Vec3; 3])> + '_ {
        let pack = &self.packs[leaf as usize];
        (0..PACK).filter(|place| pack.ids[*place] != NONE).map(|place| (pack.ids[place], pack.triangle(place)))
    }

    /// Triangles in the tree: those with an area, and of copies not all.
    pub fn len(&self) -> usize {
        self.len
    }

    /// The box around all of them.
    pub fn bounds(&self) -> Aabb {
        self.tree.bounds
    }

    /// Memory, in bytes.
    pub fn bytes(&self) -> usize {
        self.tree.bytes() + self.packs.capacity() * size_of::<Pack>()
    }

    #[inline(always)]
    fn slabs(&self, ray: &TraceRay) -> Slabs {
        Slabs::new(ray, self.tree.center, self.tree.half)
    }

    /// Asks the memory for a node or leaf that will be looked at soon. All that safe code can do is to load a word of
    /// it.
    #[inline(always)]
    fn touch(&self, child: u32) {
        if let Some(pack) = self.packs.get((child ^ LEAF) as usize) {
            std::hint::black_box((pack.vertices[0][0][0], pack.vertices[2][0][0]));
        } else if let Some(node) = self.tree.nodes.get(child as usize) {
            std::hint::black_box((node.planes[0][1][0], node.planes[2][1][0]));
        }
    }

    /// The triangles of a leaf that a ray may meet: a bit for each. The last word has [`intersect`].
    #[inline(always)]
    fn candidates<S: Simd>(&self, simd: S, ray: &TraceRay, pack: &Pack) -> u32 {
        let [kx, ky, kz] = ray.axes;
        assert!(kx < 3 && ky < 3 && kz < 3, "axes are axes");
        let o = ray.o.to_array();
        let (o, s) = ([o[kx], o[ky], o[kz]], [ray.shear[0], ray.shear[1]]);
        let [a, b, c] = &pack.vertices;
        let (ax, ay) = shear(simd, &a[kx], &a[ky], &a[kz], o, s);
        let (bx, by) = shear(simd, &b[kx], &b[ky], &b[kz], o, s);
        let (cx, cy) = shear(simd, &c[kx], &c[ky], &c[kz], o, s);
        let (u, v, w) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
        (u.min(v).min(w).simd_ge(0.0) | u.max(v).max(w).simd_le(0.0)).to_bitmask() as u32
    }

    /// The first triangle on a ray, 0 < t <= `t_max`, among those that `filter` lets count.
    #[inline(always)]
    pub fn closest<S: Simd>(
        &self,
        simd: S,
        ray: &TraceRay,
        t_max: f32,
        filter: &impl Fn(u32) -> bool,
    ) -> Option<TriangleHit> {
        if !ray.is_valid {
            return None;
        }
        let slabs = self.slabs(ray);
        let mut best = TriangleHit { t: t_max, u: 0.0, v: 0.0, triangle: NONE };
        let mut t_max = t_max;
        self.tree.closest(
            simd,
            &slabs,
            &mut t_max,
            #[inline(always)]
            |leaf, t_max| {
                let pack = &self.packs[leaf as usize];
                let mut mask = self.candidates(simd, ray, pack);
                while mask != 0 {
                    let place = mask.trailing_zeros() as usize % PACK;
                    mask &= mask - 1;
                    let triangle = pack.ids[place];
                    if let Some(hit) = intersect(ray, &slabs, &pack.triangle(place)) {
                        let better = hit.t < best.t || hit.t == best.t && triangle < best.triangle;
                        if better && hit.t > 0.0 && filter(triangle) {
                            best = TriangleHit { t: hit.t, u: hit.u, v: hit.v, triangle };
                            *t_max = hit.t;
                        }
                    }
                }
            },
        );
        (best.triangle != NONE).then_some(best)
    }

    /// Whether any triangle that `filter` lets count is on a ray, 0 < t <= `t_max`.
    #[inline(always)]
    pub fn any<S: Simd>(&self, simd: S, ray: &TraceRay, t_max: f32, filter: &impl Fn(u32) -> bool) -> bool {
        if !ray.is_valid {
            return false;
        }
        self.any_below(simd, 0, ray, &self.slabs(ray), t_max, &mut |hit| filter(hit.triangle))
    }

    /// Visits every triangle on a ray, 0 < t <= `t_max`, in no order, until `hit` says so: whether it did.
    #[inline(always)]
    pub fn each<S: Simd>(&self, simd: S, ray: &TraceRay, t_max: f32, mut hit: impl FnMut(TriangleHit) -> bool) -> bool {
        if !ray.is_valid {
            return false;
        }
        self.any_below(simd, 0, ray, &self.slabs(ray), t_max, &mut hit)
    }

    /// Visits the triangles below a child of a node on a ray, 0 < t <= `t_max`, until `hit` returns `true`. Returns
    /// whether it did.
    #[inline(always)]
    fn any_below<S: Simd>(
        &self,
        simd: S,
        child: u32,
        ray: &TraceRay,
        slabs: &Slabs,
        t_max: f32,
        hit: &mut impl FnMut(TriangleHit) -> bool,
    ) -> bool {
        self.tree.any_below(
            simd,
            child,
            slabs,
            t_max,
            #[inline(always)]
            |leaf| {
                let pack = &self.packs[leaf as usize];
                let mut mask = self.candidates(simd, ray, pack);
                while mask != 0 {
                    let place = mask.trailing_zeros() as usize % PACK;
                    mask &= mask - 1;
                    if let Some(Crossing { t, u, v }) = intersect(ray, slabs, &pack.triangle(place))
                        && t > 0.0
                        && t <= t_max
                        && hit(TriangleHit { t, u, v, triangle: pack.ids[place] })
                    {
                        return true;
                    }
                }
                false
            },
        )
    }

    /// Which of the rays in `active` meet any triangle, 0 < t <= `t_max` of each. `filter` takes where rays meet a
    /// triangle, and returns those of them for which that counts.
    #[inline(always)]
    pub fn any16<S: Simd>(
        &self,
        simd: S,
        rays: &RayPacket16,
        t_max: &[f32; 16],
        active: u16,
        filter: &impl Fn(&PacketHits) -> u64,
    ) -> u16 {
        let mut done = 0;
        let one = |hit: TriangleHit, lane: usize| filter(&PacketHits::one(hit, lane)) != 0;
        if S::f32s::LEN < WIDE {
            for place in bits(u64::from(active)) {
                done |= u16::from(self.each(simd, &rays.ray(place), t_max[place], |hit| one(hit, place))) << place;
            }
            return done;
        }
        for (which, group) in groups(simd, rays, u64::from(active)).into_iter().enumerate() {
            if group == 0 {
                continue;
            }
            if group.count_ones() < FEW {
                for place in bits(group) {
                    done |= u16::from(self.each(simd, &rays.ray(place), t_max[place], |hit| one(hit, place))) << place;
                }
                continue;
            }
            let beam = Beam::new(simd, rays, t_max, group, which, self.tree.center, self.tree.half);
            let lanes = rays.lanes(simd, 0, beam.axes, self.tree.center, self.tree.half);
            let reach = f32x16::load_array_ref(simd, t_max);
            let slabs = LaneSlabs::new(simd, &lanes, beam.axes, self.tree.center, reach);
            let zero = simd.splat_f32x16(0.0);
            done |= self.tree.packet(
                simd,
                &beam,
                &slabs,
                group,
                #[inline(always)]
                |leaf: u32, asking: u64| {
                    let pack = &self.packs[leaf as usize];
                    let mut done = 0;
                    for place in 0..PACK {
                        let id = pack.ids[place];
                        if id == NONE {
                            break;
                        }
                        let Some(met) = intersect_lanes(simd, &lanes, along(pack, place, beam.axes)) else { continue };
                        let mut hit = (met.mask & met.t.simd_gt(zero) & met.t.simd_le(reach)).to_bitmask();
                        let exact = |lane: usize| {
                            let ray = rays.ray(lane);
                            let met = intersect(&ray, &self.slabs(&ray), &pack.triangle(place))?;
                            (met.t > 0.0 && met.t <= t_max[lane]).then_some(met)
                        };
                        for lane in bits(met.unsure & asking) {
                            hit = hit & !(1 << lane) | u64::from(exact(lane).is_some()) << lane;
                        }
                        hit &= asking & !done;
                        if hit != 0 {
                            let [t, u, v] = [met.t, met.v / met.det, met.w / met.det].map(|n| n.to_array());
                            let mut hits = PacketHits { triangle: id, lanes: hit, t, u, v };
                            for lane in bits(met.unsure & hit) {
                                if let Some(met) = exact(lane) {
                                    (hits.t[lane], hits.u[lane], hits.v[lane]) = (met.t, met.u, met.v);
                                }
                            }
                            done |= filter(&hits);
                            if asking == done {
                                break;
                            }
                        }
                    }
                    done
                },
                #[inline(always)]
                |child: u32, asking: u64| {
                    let mut done = 0;
                    for lane in bits(asking) {
                        let ray = rays.ray(lane);
                        let counts = &mut |hit| one(hit, lane);
                        let is_hit = self.any_below(simd, child, &ray, &self.slabs(&ray), t_max[lane], counts);
                        done |= u64::from(is_hit) << lane;
                    }
                    done
                },
            ) as u16;
        }
        done
    }

    /// The first triangle on each ray of a tile in `active`, among those that `filter` lets count, if it is better than
    /// what `hits` holds already. Says which rays found one. `surface` is kept with the hits, and decides between hits
    /// at the same t.
    #[inline(always)]
    pub fn tile<S: Simd>(
        &self,
        simd: S,
        rays: &RayTile,
        active: u64,
        surface: u32,
        hits: &mut TileHits,
        filter: &impl Fn(u32) -> bool,
    ) -> u64 {
        let mut found = 0;
        if S::f32s::LEN < WIDE {
            for place in bits(active) {
                if let Some(hit) = self.closest(simd, &rays.ray(place), hits.t[place], filter) {
                    found |= u64::from(hits.offer(place, &hit, surface)) << place;
                }
            }
            return found;
        }
        for (which, group) in groups(simd, rays, active).into_iter().enumerate() {
            if group == 0 {
                continue;
            }
            if group.count_ones() < FEW {
                for place in bits(group) {
                    if let Some(hit) = self.closest(simd, &rays.ray(place), hits.t[place], filter) {
                        found |= u64::from(hits.offer(place, &hit, surface)) << place;
                    }
                }
                continue;
            }
            found |= self.tile_group(simd, rays, group, which, surface, hits, filter);
        }
        found
    }

    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the rest of `tile`")]
    fn tile_group<S: Simd>(
        &self,
        simd: S,
        rays: &RayTile,
        group: u64,
        which: usize,
        surface: u32,
        hits: &mut TileHits,
        filter: &impl Fn(u32) -> bool,
    ) -> u64 {
        let (center, half) = (self.tree.center, self.tree.half);
        let beam = Beam::new(simd, rays, &hits.t, group, which, center, half);
        let t_max = hits.t;
        let active = u64::from(group & 0xffff != 0)
            | u64::from(group >> 16 & 0xffff != 0) << 1
            | u64::from(group >> 32 & 0xffff != 0) << 2
            | u64::from(group >> 48 != 0) << 3;
        let lanes = [
            rays.lanes(simd, 0, beam.axes, center, half),
            rays.lanes(simd, 1, beam.axes, center, half),
            rays.lanes(simd, 2, beam.axes, center, half),
            rays.lanes(simd, 3, beam.axes, center, half),
        ];
        let zero = simd.splat_f32x16(0.0);
        let mut found = 0;
        self.tree.blocks(
            simd,
            &beam,
            active,
            #[inline(always)]
            || beam.blocks(simd, rays, &t_max, group, center, half),
            #[inline(always)]
            |leaf, blocks, z_max| {
                let pack = &self.packs[leaf as usize];
                let mut changed = 0;
                for place in 0..PACK {
                    let id = pack.ids[place];
                    if id == NONE {
                        break;
                    }
                    let triangle = along(pack, place, beam.axes);
                    let mut rest = blocks;
                    while rest != 0 {
                        let block = rest.trailing_zeros() as usize & 3;
                        rest &= rest - 1;
                        let Some(met) = intersect_lanes(simd, &lanes[block], triangle) else { continue };
                        let Crossings { mask, unsure, t, v, w, det } = met;
                        let active = group >> (16 * block) & 0xffff;
                        let best = f32x16::from_slice(simd, &hits.t[16 * block..16 * block + 16]);
                        let mut near = (mask & t.simd_gt(zero) & t.simd_le(best)).to_bitmask() & active & !unsure;
                        if near | (unsure & active) == 0 || !filter(id) {
                            continue;
                        }
                        let (t, v, w, det) = (t.to_array(), v.to_array(), w.to_array(), det.to_array());
                        let mut better = 0;
                        while near != 0 {
                            let lane = near.trailing_zeros() as usize & 15;
                            near &= near - 1;
                            let (u, v) = (v[lane] / det[lane], w[lane] / det[lane]);
                            let hit = TriangleHit { t: t[lane], u, v, triangle: id };
                            better |= u64::from(hits.offer(16 * block + lane, &hit, surface)) << lane;
                        }
                        for lane in bits(unsure & active) {
                            let ray = rays.ray(16 * block + lane);
                            if let Some(met) = intersect(&ray, &self.slabs(&ray), &pack.triangle(place))
                                && met.t > 0.0
                            {
                                let hit = TriangleHit { t: met.t, u: met.u, v: met.v, triangle: id };
                                better |= u64::from(hits.offer(16 * block + lane, &hit, surface)) << lane;
                            }
                        }
                        found |= better << (16 * block);
                        changed |= u64::from(better != 0) << block;
                    }
                }
                for block in bits(changed) {
                    z_max[block & 3] = beam.z_max(simd, rays, &hits.t, group & 0xffff << (16 * block));
                }
            },
            #[inline(always)]
            |child| self.touch(child),
        );
        found
    }

    /// What [`TriangleTree::closest`] must answer: every triangle asked, in turn.
    #[cfg(test)]
    pub fn brute_force(&self, ray: &TraceRay, t_max: f32, filter: &impl Fn(u32) -> bool) -> Option<TriangleHit> {
        if !ray.is_valid {
            return None;
        }
        let slabs = self.slabs(ray);
        let mut best: Option<TriangleHit> = None;
        for pack in &self.packs {
            for place in (0..PACK).filter(|place| pack.ids[*place] != NONE) {
                let triangle = pack.ids[place];
                let Some(hit) = intersect(ray, &slabs, &pack.triangle(place)) else { continue };
                let better = best.is_none_or(|best| (hit.t, triangle) < (best.t, best.triangle));
                if better && hit.t > 0.0 && hit.t <= t_max && filter(triangle) {
                    best = Some(TriangleHit { t: hit.t, u: hit.u, v: hit.v, triangle });
                }
            }
        }
        best
    }

    /// [`TriangleTree::closest`] for who has no instruction set at hand.
    pub fn closest_at(
        &self,
        level: Level,
        ray: &TraceRay,
        t_max: f32,
        filter: &impl Fn(u32) -> bool,
    ) -> Option<TriangleHit> {
        dispatch_eight!(level, simd => self.closest(simd, ray, t_max, filter))
    }

    /// [`TriangleTree::any`] for who has no instruction set at hand.
    #[cfg(any(test, feature = "bench"))]
    pub fn any_at(&self, level: Level, ray: &TraceRay, t_max: f32, filter: &impl Fn(u32) -> bool) -> bool {
        dispatch_eight!(level, simd => self.any(simd, ray, t_max, filter))
    }

    /// [`TriangleTree::any16`] for who has no instruction set at hand.
    #[cfg(any(test, feature = "bench"))]
    pub fn any16_at(
        &self,
        level: Level,
        rays: &RayPacket16,
        t_max: &[f32; 16],
        active: u16,
        filter: &impl Fn(u32) -> bool,
    ) -> u16 {
        let lanes = |hits: &PacketHits| if filter(hits.triangle) { hits.lanes } else { 0 };
        dispatch_sixteen!(level, simd => self.any16(simd, rays, t_max, active, &lanes), else {
            let hit = |place: &usize| self.any_at(level, &rays.ray(*place), t_max[*place], filter);
            bits(u64::from(active)).filter(hit).fold(0, |hits, place| hits | 1 << place)
        })
    }

    /// [`TriangleTree::tile`] for who has no instruction set at hand.
    pub fn tile_at(
        &self,
        level: Level,
        rays: &RayTile,
        active: u64,
        surface: u32,
        hits: &mut TileHits,
        filter: &impl Fn(u32) -> bool,
    ) -> u64 {
        dispatch_sixteen!(level, simd => self.tile(simd, rays, active, surface, hits, filter), else {
            let mut found = 0;
            for place in bits(active) {
                if let Some(hit) = self.closest_at(level, &rays.ray(place), hits.t[place], filter) {
                    found |= u64::from(hits.offer(place, &hit, surface)) << place;
                }
            }
            found
        })
    }
}

/// One vertex of all triangles of a leaf, as the triangle test of a ray from `o` sees it.
#[inline(always)]
fn shear<S: Simd>(
    simd: S,
    x: &[f32; PACK],
    y: &[f32; PACK],
    z: &[f32; PACK],
    o: [f32; 3],
    s: [f32; 2],
) -> (f32x4<S>, f32x4<S>) {
    let z = f32x4::load_array_ref(simd, z) - o[2];
    ((f32x4::load_array_ref(simd, x) - o[0]) - z * s[0], (f32x4::load_array_ref(simd, y) - o[1]) - z * s[1])
}

/// A triangle's coordinates along kx, ky, kz.
#[inline(always)]
fn along(pack: &Pack, place: usize, [kx, ky, kz]: [usize; 3]) -> [[f32; 3]; 3] {
    assert!(kx < 3 && ky < 3 && kz < 3, "axes are axes");
    [0, 1, 2].map(|vertex| {
        let vertex = &pack.vertices[vertex];
        [vertex[kx][place], vertex[ky][place], vertex[kz][place]]
    })
}

/// The places of the bits that are set.
#[inline(always)]
pub(crate) fn bits(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = mask.trailing_zeros() as usize;
        (mask != 0).then(|| {
            mask &= mask - 1;
            place
        })
    })
}

/// The filter that lets every triangle count.
pub(crate) fn every(_: u32) -> bool {
    true
}
