//! All that lies in some part of space.

use fearless_simd::{f32x8, prelude::*};

use super::node::{BoxNode, LEAF, Tree};

/// Entries of the stack that lives in the frame.
const STACK: usize = 96;

impl Tree {
    /// Visits the leaves below nodes whose boxes `meet` says yes to, a bit for each of eight and where they begin, near
    /// ones before far ones, more or less, until `leaf` says no. Says whether all were visited.
    #[inline(always)]
    pub fn gather<S: Simd>(
        &self,
        simd: S,
        meet: impl Fn(S, &BoxNode) -> (u32, f32x8<S>),
        mut leaf: impl FnMut(u32) -> bool,
    ) -> bool {
        if self.nodes.is_empty() {
            return true;
        }
        let mut frame = [0u32; STACK];
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
            if child & LEAF != 0 {
                if !leaf(child & !LEAF) {
                    return false;
                }
            } else {
                let node = &self.nodes[child as usize];
                let (mut mask, enter) = meet(simd, node);
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
                return true;
            }
            len -= 1;
            child = stack[len];
        }
    }
}
