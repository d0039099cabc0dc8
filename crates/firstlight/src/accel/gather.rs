//! All that lies in some part of space.

use fearless_simd::prelude::*;

use super::node::{LEAF, Node, Tree};

/// Entries of the stack that lives in the frame.
const STACK: usize = 96;

impl Tree {
    /// Visits the leaves below nodes whose boxes `meet` says yes to, a bit for each of eight, in any order, until `leaf` says
    /// no. Says whether all were visited.
    #[inline(always)]
    pub fn gather<S: Simd>(&self, simd: S, meet: impl Fn(S, &Node) -> u32, mut leaf: impl FnMut(u32) -> bool) -> bool {
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
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let node = &self.nodes[stack[len] as usize];
            let mut mask = meet(simd, node);
            while mask != 0 {
                let child = node.children[mask.trailing_zeros() as usize & 7];
                mask &= mask - 1;
                if child & LEAF == 0 {
                    stack[len] = child;
                    len += 1;
                } else if !leaf(child & !LEAF) {
                    return false;
                }
            }
        }
        true
    }
}
