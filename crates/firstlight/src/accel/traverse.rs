//! The ways through the tree.

use fearless_simd::{f32x8, prelude::*};

use super::beam::Beam;
use super::node::{BoxNode, LEAF, Tree};
use super::ray::{LaneSlabs, Slabs};

/// Entries of the stack that lives in the frame; deeper trees, which nothing but malice makes, take one from the heap.
const STACK: usize = 96;
/// Rays of a packet that are quicker one by one.
const FEW: u32 = 2;
/// Leaves after which a tile is looked at in blocks: it is worth it where triangles are small.
const MANY_LEAVES: u32 = 8;

/// Where a ray crosses planes. Closures would do, were they always inlined: out of line they lose the instruction set.
#[inline(always)]
fn cross<S: Simd>(simd: S, planes: &[f32; 8], rd: f32, plus: f32) -> f32x8<S> {
    f32x8::load_array_ref(simd, planes).mul_add(rd, plus)
}

/// The children of a node that a ray meets: a bit for each, and where it enters them.
#[inline(always)]
fn meet<S: Simd>(simd: S, node: &BoxNode, slabs: &Slabs, t_max: f32) -> (u32, f32x8<S>) {
    let [x, y, z] = slabs.side.map(|side| side & 1);
    let planes = &node.planes;
    let enter = cross(simd, &planes[0][x], slabs.rd[0], slabs.near[0])
        .max(cross(simd, &planes[1][y], slabs.rd[1], slabs.near[1]))
        .max(cross(simd, &planes[2][z], slabs.rd[2], slabs.near[2]).max(0.0));
    let leave = cross(simd, &planes[0][x ^ 1], slabs.rd[0], slabs.far[0])
        .min(cross(simd, &planes[1][y ^ 1], slabs.rd[1], slabs.far[1]))
        .min(cross(simd, &planes[2][z ^ 1], slabs.rd[2], slabs.far[2]).min(t_max));
    (enter.simd_le(leave).to_bitmask() as u32, enter)
}

/// An entry of the stack: the nearer, the smaller.
#[inline(always)]
fn entry(t: f32, child: u32) -> u64 {
    u64::from(t.to_bits()) << 32 | u64::from(child)
}

impl Tree {
    /// Asks the leaves on a ray, the nearest first; `leaf` may make `t_max` smaller.
    #[inline(always)]
    pub fn closest<S: Simd>(&self, simd: S, slabs: &Slabs, t_max: &mut f32, mut leaf: impl FnMut(u32, &mut f32)) {
        if self.nodes.is_empty() || !(*t_max >= 0.0) {
            return;
        }
        let mut frame = [0; STACK];
        let mut heap = Vec::new();
        let stack = if self.stack <= STACK {
            &mut frame[..]
        } else {
            heap.resize(self.stack, 0);
            &mut heap[..]
        };
        let mut len = 0;
        let mut child = 0;
        loop {
            // Down to a leaf, nearest child first
            'down: while child & LEAF == 0 {
                let node = &self.nodes[child as usize];
                let (mut mask, enter) = meet(simd, node, slabs, *t_max);
                if mask == 0 {
                    // Up, past what has become too far
                    while len > 0 {
                        len -= 1;
                        let top = stack[len];
                        if f32::from_bits((top >> 32) as u32) <= *t_max {
                            child = top as u32;
                            continue 'down;
                        }
                    }
                    return;
                }
                let place = mask.trailing_zeros() as usize & 7;
                mask &= mask - 1;
                if mask == 0 {
                    child = node.children[place];
                    continue;
                }
                // Sort those met onto the stack, the nearest on top, and take it
                let enter = enter.to_array();
                let base = len;
                stack[len] = entry(enter[place], node.children[place]);
                len += 1;
                while mask != 0 {
                    let place = mask.trailing_zeros() as usize & 7;
                    mask &= mask - 1;
                    let new = entry(enter[place], node.children[place]);
                    let mut at = len;
                    while at > base && stack[at - 1] < new {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                    stack[at] = new;
                    len += 1;
                }
                len -= 1;
                child = stack[len] as u32;
            }
            leaf(child & !LEAF, t_max);
            loop {
                if len == 0 {
                    return;
                }
                len -= 1;
                let top = stack[len];
                if f32::from_bits((top >> 32) as u32) <= *t_max {
                    child = top as u32;
                    break;
                }
            }
        }
    }

    /// Asks the leaves on a ray until one says yes.
    #[inline(always)]
    pub fn any<S: Simd>(&self, simd: S, slabs: &Slabs, t_max: f32, leaf: impl FnMut(u32) -> bool) -> bool {
        self.any_below(simd, 0, slabs, t_max, leaf)
    }

    /// Asks the leaves on a ray at or below a child of a node until one says yes.
    #[inline(always)]
    pub fn any_below<S: Simd>(
        &self,
        simd: S,
        child: u32,
        slabs: &Slabs,
        t_max: f32,
        mut leaf: impl FnMut(u32) -> bool,
    ) -> bool {
        if self.nodes.is_empty() || !(t_max >= 0.0) {
            return false;
        }
        let mut frame = [0u32; STACK];
        let mut heap = Vec::new();
        let stack = if self.stack <= STACK {
            &mut frame[..]
        } else {
            heap.resize(self.stack, 0);
            &mut heap[..]
        };
        let mut child = child;
        let mut len = 0;
        loop {
            if child & LEAF != 0 {
                if leaf(child & !LEAF) {
                    return true;
                }
            } else {
                let node = &self.nodes[child as usize];
                let (mut mask, enter) = meet(simd, node, slabs, t_max);
                if mask != 0 {
                    // On with the nearest, the others in any order
                    let mut place = mask.trailing_zeros() as usize & 7;
                    mask &= mask - 1;
                    if mask != 0 {
                        let enter = enter.to_array();
                        while mask != 0 {
                            let other = mask.trailing_zeros() as usize & 7;
                            mask &= mask - 1;
                            let nearer = enter[other] < enter[place];
                            stack[len] = node.children[if nearer { place } else { other }];
                            place = if nearer { other } else { place };
                            len += 1;
                        }
                    }
                    child = node.children[place];
                    continue;
                }
            }
            if len == 0 {
                return false;
            }
            len -= 1;
            child = stack[len];
        }
    }

    /// Asks the leaves that a beam of rays may meet, the nearest first. `leaf` may lessen how far along the beam is of
    /// interest; at minus infinity it ends.
    #[inline(always)]
    pub fn beam<S: Simd>(&self, simd: S, beam: &Beam, mut leaf: impl FnMut(u32, &mut f32)) {
        let mut z_max = beam.z_max;
        if self.nodes.is_empty() || !(z_max >= 0.0) {
            return;
        }
        let mut frame = [0; STACK];
        let mut heap = Vec::new();
        let stack = if self.stack <= STACK {
            &mut frame[..]
        } else {
            heap.resize(self.stack, 0);
            &mut heap[..]
        };
        // The root, at 0
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let top = stack[len];
            if f32::from_bits((top >> 32) as u32) > z_max {
                continue;
            }
            let child = top as u32;
            if child & LEAF != 0 {
                leaf(child & !LEAF, &mut z_max);
                continue;
            }
            let node = &self.nodes[child as usize];
            let (mut mask, enter) = beam.meet(simd, node, z_max);
            let enter = enter.to_array();
            let base = len;
            while mask != 0 {
                let place = mask.trailing_zeros() as usize & 7;
                mask &= mask - 1;
                let new = entry(enter[place], node.children[place]);
                let mut at = len;
                while at > base && stack[at - 1] < new {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = new;
                len += 1;
            }
        }
    }

    /// Asks the leaves that any of sixteen rays meet, until all of `asking` are done. `leaf` hears which rays ask a
    /// leaf, `few` which few rays, one by one, a child of a node and all below it; both say which are done. Returns all
    /// that are.
    #[inline(always)]
    pub fn packet<S: Simd>(
        &self,
        simd: S,
        beam: &Beam,
        slabs: &LaneSlabs<S>,
        mut asking: u64,
        mut leaf: impl FnMut(u32, u64) -> u64,
        mut few: impl FnMut(u32, u64) -> u64,
    ) -> u64 {
        let all = asking;
        if self.nodes.is_empty() {
            return 0;
        }
        let mut frame = [0; STACK];
        let mut heap = Vec::new();
        let stack = if self.stack <= STACK {
            &mut frame[..]
        } else {
            heap.resize(self.stack, 0);
            &mut heap[..]
        };
        stack[0] = asking << 32;
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let child = stack[len] as u32;
            let active = stack[len] >> 32 & asking;
            if active == 0 {
                continue;
            }
            if active.count_ones() <= FEW {
                asking &= !few(child, active);
                continue;
            }
            if child & LEAF != 0 {
                asking &= !leaf(child & !LEAF, active);
                continue;
            }
            let node = &self.nodes[child as usize];
            let (mut mask, _) = beam.meet(simd, node, beam.z_max);
            while mask != 0 {
                let place = mask.trailing_zeros() as usize & 7;
                mask &= mask - 1;
                let active = slabs.meet(simd, node, place, beam.axes) & active;
                if active != 0 {
                    stack[len] = active << 32 | u64::from(node.children[place]);
                    len += 1;
                }
            }
        }
        all & !asking
    }

    /// Asks the leaves that four blocks of rays may meet, the nearest first. `leaf` hears which blocks ask, and may
    /// lessen how far along the beams is of interest to each. The beam around all does at first; where there are many
    /// leaves, `split` gives one for each block. `touch` hears of leaves that will be asked later.
    #[inline(always)]
    pub fn blocks<S: Simd>(
        &self,
        simd: S,
        beam: &Beam,
        active: u64,
        split: impl Fn() -> [Beam; 4],
        mut leaf: impl FnMut(u32, u64, &mut [f32; 4]),
        touch: impl Fn(u32),
    ) {
        let mut z_max = [beam.z_max; 4];
        let mut beams = [*beam; 4];
        let mut leaves = 0;
        if self.nodes.is_empty() {
            return;
        }
        let mut frame = [0; STACK];
        let mut heap = Vec::new();
        let stack = if self.stack <= STACK {
            &mut frame[..]
        } else {
            heap.resize(self.stack, 0);
            &mut heap[..]
        };
        // The root, at 0. Blocks are in the lowest bits of z
        stack[0] = (active & 15) << 32;
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let top = stack[len];
            let child = top as u32;
            let z = f32::from_bits((top >> 32) as u32 & !15);
            // Blocks that have found something nearer ask no more
            let mut active = 0;
            for (block, z_max) in z_max.iter().enumerate() {
                active |= u64::from(z <= *z_max) << block;
            }
            active &= top >> 32 & 15;
            if active == 0 {
                continue;
            }
            if child & LEAF != 0 {
                leaf(child & !LEAF, active, &mut z_max);
                leaves += 1;
                if leaves == MANY_LEAVES {
                    beams = split();
                }
                continue;
            }
            let node = &self.nodes[child as usize];
            let mut masks = [0; 4];
            let mut enter = simd.splat_f32x8(f32::INFINITY);
            if leaves < MANY_LEAVES {
                let (mask, z) = beam.meet(simd, node, z_max[0].max(z_max[1]).max(z_max[2].max(z_max[3])));
                (masks, enter) = ([mask; 4], z);
            }
            for block in 0..4 {
                if leaves >= MANY_LEAVES && active >> block & 1 == 1 {
                    let (mask, z) = beams[block].meet(simd, node, z_max[block]);
                    masks[block] = mask;
                    enter = enter.min(z);
                }
            }
            let mut mask = masks[0] | masks[1] | masks[2] | masks[3];
            let enter = enter.to_array();
            let base = len;
            while mask != 0 {
                let place = mask.trailing_zeros() as usize & 7;
                mask &= mask - 1;
                let blocks = (masks[0] >> place & 1)
                    | (masks[1] >> place & 1) << 1
                    | (masks[2] >> place & 1) << 2
                    | (masks[3] >> place & 1) << 3;
                let blocks = blocks & active as u32;
                touch(node.children[place]);
                let new = u64::from(enter[place].to_bits() & !15 | blocks) << 32 | u64::from(node.children[place]);
                let mut at = len;
                while at > base && stack[at - 1] < new {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = new;
                len += 1;
            }
        }
    }
}
