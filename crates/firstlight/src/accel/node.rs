//! The tree as it lies in memory: nodes of eight boxes.

use super::Aabb;
use crate::math::Vec3;

/// Boxes in a node.
pub(crate) const WIDTH: usize = 8;

/// Set in a child that is a leaf; the other bits are its index.
pub(crate) const LEAF: u32 = 1 << 31;

/// Eight boxes, plane by plane, and what is inside each. Four cache lines.
///
/// Of a child that does not exist the low planes are at plus, the high planes at minus infinity: no ray meets it.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct BoxNode {
    /// By axis, then low or high side, then child; seen from the tree's centre.
    pub planes: [[[f32; WIDTH]; 2]; 3],
    /// A node, or with [`LEAF`] a leaf.
    pub children: [u32; WIDTH],
}

impl BoxNode {
    pub const EMPTY: BoxNode =
        BoxNode { planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3], children: [LEAF; WIDTH] };

    /// Puts a box into a place.
    pub fn set(&mut self, place: usize, lo: [f32; 3], hi: [f32; 3], child: u32) {
        for axis in 0..3 {
            self.planes[axis][0][place] = lo[axis];
            self.planes[axis][1][place] = hi[axis];
        }
        self.children[place] = child;
    }
}

/// A tree over boxes. Knows neither what is in the boxes nor what a leaf is.
pub(crate) struct Tree {
    /// Depth first, the root first. Empty if there is nothing in the tree.
    pub nodes: Vec<BoxNode>,
    /// What the planes of the nodes are measured from: the middle of all boxes.
    pub center: Vec3,
    /// The largest distance from the centre along any axis.
    pub half: f32,
    /// All boxes.
    pub bounds: Aabb,
    /// How many entries a stack needs, at most.
    pub stack: usize,
}

impl Tree {
    pub fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<BoxNode>()
    }
}
