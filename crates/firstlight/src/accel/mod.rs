//! The acceleration structure: what a ray can meet, among many things in boxes.
//!
//! It owns the tree and the ways through it, and knows boxes and closures, not triangles: what is in a leaf is the
//! business of who built the tree (`shape/triangles` for meshes, `scene` for instances and other shapes). Before it
//! stand shapes, which give boxes; after it, hits.

// The rest of the renderer comes to use it step by step.
#![allow(dead_code)]

mod beam;
mod build;
mod node;
mod ray;
mod traverse;

use fearless_simd::{Level, dispatch, prelude::*};

pub(crate) use beam::{Beam, groups};
pub(crate) use build::{Built, Leaf, build};
pub(crate) use node::{LEAF, Tree};
pub(crate) use ray::{LaneSlabs, Lanes, RayPacket16, RayTile, Slabs, TraceRay};

use node::WIDTH;

use crate::math::Vec3;

/// A box along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aabb {
    pub min: Vec3,
    pub max: Vec3,
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

    /// The smallest box around both.
    #[inline(always)]
    pub fn union(self, other: Aabb) -> Aabb {
        Aabb { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The smallest box around this and a point.
    #[inline(always)]
    pub fn with(self, p: Vec3) -> Aabb {
        Aabb { min: self.min.min(p), max: self.max.max(p) }
    }
}

/// A tree over boxes that each hold one thing: instances, spheres, whole meshes.
///
/// Boxes are asked as if they were a little larger (2^-19 of the distance between the ray's origin and the farthest part of
/// the tree). A leaf that answers with a `t` before its own box by more than that may be left out, or not.
pub(crate) struct Bvh {
    tree: Tree,
}

impl Bvh {
    /// Builds the tree. Boxes that are not sound are left out; the others keep their index as their id.
    pub fn build(boxes: &[Aabb]) -> Bvh {
        let Built { mut tree, order, leaves } = build(boxes.len(), |i| boxes[i], 0);
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

    /// Asks what lies on the ray, the nearest boxes first. `leaf` may make `t_max` smaller; boxes beyond it are not asked.
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

    /// Asks what lies on any of the rays in `active`, as far as `t_max` of each. `leaf` hears which rays are still asking and says which of
    /// them are done; the answer is all that are.
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
            self.tree.beam(simd, &beam, |id, z_max| {
                let now = leaf(id, asking) & asking;
                asking &= !now;
                done |= now;
                if asking == 0 {
                    *z_max = f32::NEG_INFINITY;
                }
            });
        }
        done
    }

    /// Asks what lies on any of the rays of a tile in `active`, the nearest boxes first. `t_max` is as far as each ray asks; `leaf` hears which
    /// rays ask and may make it smaller.
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
        dispatch!(level, simd => self.closest(simd, ray, t_max, leaf));
    }

    /// [`Bvh::any`] for who has no instruction set at hand.
    pub fn any_at(&self, level: Level, ray: &TraceRay, t_max: f32, leaf: impl FnMut(u32) -> bool) -> bool {
        dispatch!(level, simd => self.any(simd, ray, t_max, leaf))
    }
}
