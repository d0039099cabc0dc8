//! The acceleration structure: what a ray can meet, among many things in boxes.
//!
//! It owns the tree and the ways through it, and knows boxes and closures, not triangles: what is in a leaf is the
//! business of who built the tree (`shape/triangles` for meshes, `scene` for instances and other shapes). Before it
//! stand shapes, which give boxes; after it, hits.

/// Runs code for eight boxes or triangles at a time with the instruction set that suits it: AVX2 where it is there
/// (AVX-512 has nothing to add to eight), NEON, or none. Two copies, not five: a traversal takes the compiler seconds.
macro_rules! dispatch_eight {
    ($level:expr, $simd:ident => $op:expr) => {{
        let level: fearless_simd::Level = $level;
        #[cfg(target_arch = "x86_64")]
        match level.as_avx2() {
            Some($simd) => fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $op,
            ),
            None => {
                let $simd = fearless_simd::Fallback::new();
                $op
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        fearless_simd::dispatch!(level, $simd => $op)
    }};
}

/// Runs code for sixteen rays at a time where the instruction set has room for it, and otherwise what takes them one by
/// one.
macro_rules! dispatch_sixteen {
    ($level:expr, $simd:ident => $op:expr, else $one_by_one:expr) => {{
        let level: fearless_simd::Level = $level;
        #[cfg(target_arch = "x86_64")]
        if let Some($simd) = level.as_avx512() {
            fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $op,
            )
        } else if let Some($simd) = level.as_avx2() {
            fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $op,
            )
        } else {
            $one_by_one
        }
        #[cfg(not(target_arch = "x86_64"))]
        if matches!(level, fearless_simd::Level::Fallback(_)) {
            $one_by_one
        } else {
            fearless_simd::dispatch!(level, $simd => $op)
        }
    }};
}

pub(crate) use dispatch_eight;
pub(crate) use dispatch_sixteen;

/// The instruction set that every processor has.
#[cfg(target_arch = "x86_64")]
pub(crate) fn baseline() -> fearless_simd::Sse2 {
    fearless_simd::Level::baseline().as_sse2().expect("every processor of this kind has it")
}

/// The instruction set that every processor has.
#[cfg(not(target_arch = "x86_64"))]
pub(crate) fn baseline() -> fearless_simd::Fallback {
    fearless_simd::Fallback::new()
}

/// Runs code for sixteen numbers at a time with every instruction set: what it finds decides how a place is lit.
macro_rules! dispatch_all {
    ($level:expr, $simd:ident => $op:expr) => {
        $crate::accel::dispatch_sixteen!($level, $simd => $op, else {
            let $simd = $crate::accel::baseline();
            fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $op,
            )
        })
    };
}

pub(crate) use dispatch_all;

mod beam;
mod build;
mod gather;
mod level;
mod node;
mod planes;
mod ray;
mod traverse;

use fearless_simd::{Level, f32x8, prelude::*};

pub(crate) use beam::{Beam, groups};
pub(crate) use build::{Built, LeafRange, build};
pub use level::SimdLevel;
pub(crate) use node::{BoxNode, LEAF, Tree};
pub(crate) use planes::{HalfSpace, Planes};
pub(crate) use ray::{BEAM_PAD, LaneSlabs, RayLanes, RayPacket16, RayTile, Slabs, TraceRay};

use node::WIDTH;

use crate::math::Vec3;

/// A box along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aabb {
    pub min: Vec3,
    pub max: Vec3,
}

impl Default for Aabb {
    fn default() -> Aabb {
        Aabb::EMPTY
    }
}

impl Aabb {
    /// Contains nothing.
    pub const EMPTY: Aabb = Aabb { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Whether it is neither NaN nor absurdly far out (10^15) nor inside out.
    #[inline(always)]
    pub fn is_sound(&self) -> bool {
        let far = Vec3::splat(ray::MAX_COORDINATE);
        self.min.cmpge(-far).all() && self.max.cmple(far).all() && self.min.cmple(self.max).all()
    }

    /// The smallest box around this and a point.
    #[inline(always)]
    pub fn with(self, p: Vec3) -> Aabb {
        Aabb { min: self.min.min(p), max: self.max.max(p) }
    }
}

/// A tree over boxes that each hold one thing: instances, spheres, whole meshes.
///
/// Boxes are asked as if they were a little larger (2^-19 of the distance between the ray's origin and the farthest
/// part of the tree). A leaf that answers with a `t` before its own box by more than that may be left out, or not.
pub(crate) struct Bvh {
    tree: Tree,
}

impl Bvh {
    /// Builds the tree. Boxes that are not sound are left out; the others keep their index as their id.
    pub fn build(boxes: &[Aabb]) -> Bvh {
        Self::build_distinct(boxes, |id| id)
    }

    /// The same; of things with the same key, which are the same to every ray, only the first need be found.
    pub fn build_distinct<K: Ord>(boxes: &[Aabb], key: impl Fn(u32) -> K + Sync) -> Bvh {
        let Built { mut tree, order, leaves } = build(boxes.len(), |i| boxes[i], 0, key);
        // Let leaves say the id at once
        for node in &mut tree.nodes {
            for place in 0..WIDTH {
                let child = &mut node.children[place];
                if node.planes[0][0][place] <= node.planes[0][1][place] && *child & LEAF != 0 {
                    *child = LEAF | order[leaves[(*child & !LEAF) as usize].first as usize];
                }
            }
        }
        Bvh { tree }
    }

    /// Asks what lies on the ray, the nearest boxes first. `leaf` may make `t_max` smaller; boxes beyond it are not
    /// asked.
    #[inline(always)]
    pub fn closest<S: Simd>(&self, simd: S, ray: &TraceRay, t_max: &mut f32, leaf: impl FnMut(u32, &mut f32)) {
        if ray.is_valid {
            self.tree.closest(simd, &Slabs::new(ray, self.tree.center, self.tree.half), t_max, leaf);
        }
    }

    /// Asks what lies on the ray until `leaf` says yes, and says whether it did.
    #[inline(always)]
    pub fn any<S: Simd>(&self, simd: S, ray: &TraceRay, t_max: f32, leaf: impl FnMut(u32) -> bool) -> bool {
        ray.is_valid && self.tree.any(simd, &Slabs::new(ray, self.tree.center, self.tree.half), t_max, leaf)
    }

    /// Asks what lies on any of the rays in `active`, as far as `t_max` of each. `leaf` hears which rays are still
    /// asking and says which of them are done; the answer is all that are.
    #[inline(always)]
    pub fn any16<S: Simd>(
        &self,
        simd: S,
        rays: &RayPacket16,
        t_max: &[f32; 16],
        active: u16,
        mut leaf: impl FnMut(u32, u16) -> u16,
    ) -> u16 {
        let mut done = 0;
        for (which, group) in beam::groups(simd, rays, u64::from(active)).into_iter().enumerate() {
            if group == 0 {
                continue;
            }
            let beam = Beam::new(simd, rays, t_max, group, which, self.tree.center, self.tree.half);
            let mut asking = group as u16;
            self.tree.beam(
                simd,
                &beam,
                #[inline(always)]
                |id, z_max| {
                    let now = leaf(id, asking) & asking;
                    asking &= !now;
                    done |= now;
                    if asking == 0 {
                        *z_max = f32::NEG_INFINITY;
                    }
                },
            );
        }
        done
    }

    /// Asks what lies on any of the rays of a tile in `active`, the nearest boxes first. `t_max` is as far as each ray
    /// asks; `leaf` hears which rays ask and may make it smaller.
    #[cfg(test)]
    #[inline(always)]
    pub fn tile<S: Simd>(
        &self,
        simd: S,
        rays: &RayTile,
        t_max: &mut [f32; 64],
        active: u64,
        mut leaf: impl FnMut(u32, u64, &mut [f32; 64]),
    ) {
        for (which, group) in beam::groups(simd, rays, active).into_iter().enumerate() {
            if group == 0 {
                continue;
            }
            let beam = Beam::new(simd, rays, t_max, group, which, self.tree.center, self.tree.half);
            self.tree.beam(simd, &beam, |id, z_max| {
                leaf(id, group, t_max);
                *z_max = beam.z_max(simd, rays, t_max, group);
            });
        }
    }

    /// Visits what lies in boxes that `meet` says yes to, until `leaf` says no. `meet` is made from the tree's centre
    /// and how far it reaches. Says whether all was visited.
    #[inline(always)]
    pub fn gather<S: Simd, M: Fn(S, &BoxNode) -> (u32, f32x8<S>)>(
        &self,
        simd: S,
        meet: impl FnOnce(Vec3, f32) -> M,
        leaf: impl FnMut(u32) -> bool,
    ) -> bool {
        self.tree.gather(simd, meet(self.tree.center, self.tree.half), leaf)
    }

    /// How many things are in it.
    #[cfg(test)]
    pub fn len(&self) -> usize {
        let is_leaf = |node: &BoxNode, place: usize| {
            node.planes[0][0][place] <= node.planes[0][1][place] && node.children[place] & LEAF != 0
        };
        self.tree.nodes.iter().map(|node| (0..WIDTH).filter(|place| is_leaf(node, *place)).count()).sum()
    }

    /// The box around all boxes.
    pub fn bounds(&self) -> Aabb {
        self.tree.bounds
    }

    /// Memory, in bytes.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
    }

    /// [`Bvh::closest`] for who has no instruction set at hand.
    pub fn closest_at(&self, level: Level, ray: &TraceRay, t_max: &mut f32, leaf: impl FnMut(u32, &mut f32)) {
        dispatch_eight!(level, simd => self.closest(simd, ray, t_max, leaf));
    }

    /// [`Bvh::any`] for who has no instruction set at hand.
    pub fn any_at(&self, level: Level, ray: &TraceRay, t_max: f32, leaf: impl FnMut(u32) -> bool) -> bool {
        dispatch_eight!(level, simd => self.any(simd, ray, t_max, leaf))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether a ray meets a box, exactly enough.
    fn meets(bounds: &Aabb, ray: &TraceRay, t_max: f32) -> bool {
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        let (a, b) = ((bounds.min.as_dvec3() - o) / d, (bounds.max.as_dvec3() - o) / d);
        a.min(b).max_element().max(0.0) <= a.max(b).min_element().min(f64::from(t_max))
    }

    #[test]
    fn every_box_on_a_ray_is_asked() {
        let mut numbers = firstlight_testkit::Random::new(1);
        let mut random = || numbers.between(-1.0, 1.0) as f32;
        let mut boxes: Vec<_> = (0..1000)
            .map(|_| {
                let min = Vec3::new(random(), random(), random());
                Aabb { min, max: min + Vec3::new(random(), random(), random()).abs() * 0.1 }
            })
            .collect();
        boxes[7] = Aabb::EMPTY;
        boxes[8].max.x = f32::NAN;
        let bvh = Bvh::build(&boxes);
        for kind in 0..40 {
            let from = Vec3::new(random(), random(), random()) * 3.0;
            let t_max = [f32::INFINITY, 0.9][kind % 2];
            let mut tile = RayTile::ZERO;
            let mut packet = RayPacket16::ZERO;
            for i in 0..64 {
                let to = Vec3::new(random(), random(), random()) * [0.05, 1.0][kind / 2 % 2];
                tile.set(i, from, to - from);
                packet.set(i % 16, from, to - from);
            }
            let ray = tile.ray(0);
            for level in SimdLevel::available() {
                let level = level.token();
                let (mut one, mut any) = (vec![0; 1000], vec![0; 1000]);
                bvh.closest_at(level, &ray, &mut t_max.clone(), |id, _| one[id as usize] += 1);
                assert!(!bvh.any_at(level, &ray, t_max, |id| {
                    any[id as usize] += 1;
                    false
                }));
                for (id, bounds) in boxes.iter().enumerate() {
                    let least = i32::from(bounds.is_sound() && meets(bounds, &ray, t_max));
                    let most = i32::from(bounds.is_sound());
                    assert!((least..=most).contains(&one[id]) && (least..=most).contains(&any[id]));
                }
            }
            let (mut many, mut sixteen) = (vec![false; 1000], vec![false; 1000]);
            dispatch_sixteen!(Level::new(), simd => {
                bvh.tile(simd, &tile, &mut [t_max; 64], u64::MAX, |id, _, _| many[id as usize] = true);
                bvh.any16(simd, &packet, &[t_max; 16], 0xffff, |id, _| {
                    sixteen[id as usize] = true;
                    0
                });
            }, else {
                return
            });
            for (id, bounds) in boxes.iter().enumerate().filter(|(_, bounds)| bounds.is_sound()) {
                assert!(many[id] || !(0..64).any(|i| meets(bounds, &tile.ray(i), t_max)));
                assert!(sixteen[id] || !(0..16).any(|i| meets(bounds, &packet.ray(i), t_max)));
            }
        }
    }

    #[test]
    fn the_nearest_box_is_asked_first_and_far_ones_not_at_all() {
        let boxes: Vec<_> = (0..100)
            .map(|i| Aabb { min: Vec3::new(i as f32, -1.0, -1.0), max: Vec3::new(i as f32 + 0.5, 1.0, 1.0) })
            .collect();
        let bvh = Bvh::build(&boxes);
        let mut asked = Vec::new();
        let ray = TraceRay::new(Vec3::new(-1.0, 0.1, 0.2), Vec3::X);
        bvh.closest_at(Level::new(), &ray, &mut f32::INFINITY.clone(), |id, t_max| {
            asked.push(id);
            *t_max = t_max.min(3.75);
        });
        assert_eq!(asked, [0, 1, 2]);
        assert_eq!(bvh.bounds(), Aabb { min: Vec3::new(0.0, -1.0, -1.0), max: Vec3::new(99.5, 1.0, 1.0) });
        assert!(bvh.bytes() > 0);
    }

    #[test]
    fn of_copies_the_first_is_asked() {
        let mut boxes = vec![Aabb { min: Vec3::ZERO, max: Vec3::ONE }; 10_000];
        boxes.push(Aabb { min: Vec3::splat(-1.0), max: Vec3::splat(2.0) });
        let asked = |bvh: &Bvh| {
            let mut asked = Vec::new();
            let ray = TraceRay::new(Vec3::new(-3.0, 0.1, 0.2), Vec3::X);
            bvh.closest_at(Level::new(), &ray, &mut f32::INFINITY.clone(), |id, _| asked.push(id));
            asked.sort_unstable();
            asked
        };
        assert_eq!(asked(&Bvh::build_distinct(&boxes, |id| id / 5000)), [0, 5000, 10_000]);
        assert_eq!(asked(&Bvh::build(&boxes)).len(), 10_001);
    }
}
