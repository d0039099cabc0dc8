//! Faces of a mesh that are turned against their neighbours, found so that normals can be summed up over all of them.
//!
//! Two triangles that share an edge run along it in opposite ways, unless one of them is turned: what
//! [`MeshReport::turned_edges`](super::MeshReport::turned_edges) counts. Triangles that are joined by edges of exactly
//! two are a patch; within a patch the side of one triangle decides that of all. Copies of a triangle are no neighbours
//! of it.

use rayon::prelude::*;

use crate::parallel::{self, CHUNK};

/// For each triangle, whether its patch has most triangles turned the other way, or as many, its first among them.
/// `None` where no triangle is turned. `places` are the positions of its corners, by number; triangles that are not
/// `fine` have no edges. Where a patch has no two sides, as a Moebius strip, some edges stay turned.
pub(super) fn turned(
    triangles: usize,
    places: impl Fn(usize) -> [u32; 3] + Sync,
    fine: impl Fn(usize) -> bool + Sync,
) -> Option<Vec<bool>> {
    // Edges with their lower end first, and whether that turns them round
    let edge = |corner: usize| {
        let (triangle, corners) = (corner / 3, places(corner / 3));
        let (p, q) = (corners[corner % 3], corners[(corner + 1) % 3]);
        (p.min(q), p.max(q), triangle as u32, p > q)
    };
    let mut edges = parallel::map(3 * triangles, CHUNK, edge);
    edges.retain(|edge| fine(edge.2 as usize));
    edges.par_sort_unstable();
    // Join the triangles at each edge
    let mut patches = FacePatches::new(triangles);
    let mut any = false;
    for edge in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let &[(.., one, way), (.., other, other_way)] = edge else { continue };
        let is_copy = || places(one as usize).iter().all(|place| places(other as usize).contains(place));
        if !is_copy() {
            any |= way == other_way;
            patches.join(one, other, way == other_way);
        }
    }
    drop(edges);
    any.then(|| patches.minority())
}

/// Triangles that are joined, each with the side it is on.
struct FacePatches {
    /// A triangle of the same patch with a lower number; the first one's is its own.
    leader: Vec<u32>,
    /// Whether it is turned against that one.
    against: Vec<bool>,
}

impl FacePatches {
    fn new(triangles: usize) -> Self {
        Self { leader: (0..triangles as u32).collect(), against: vec![false; triangles] }
    }

    /// The first triangle of a patch, and whether this one is turned against it.
    fn find(&mut self, triangle: u32) -> (u32, bool) {
        let (mut at, mut against) = (triangle as usize, false);
        while self.leader[at] != at as u32 {
            // Halve the way for the next who asks
            let next = self.leader[at] as usize;
            self.against[at] ^= self.against[next];
            self.leader[at] = self.leader[next];
            against ^= self.against[at];
            at = self.leader[at] as usize;
        }
        (at as u32, against)
    }

    /// Makes one patch of those of two triangles, which are turned against each other or not. Nothing where they are
    /// in one already.
    fn join(&mut self, one: u32, other: u32, against: bool) {
        let ((first, a), (second, b)) = (self.find(one), self.find(other));
        let (low, high) = (first.min(second), first.max(second));
        if low != high {
            self.leader[high as usize] = low;
            self.against[high as usize] = a ^ b ^ against;
        }
    }

    /// For each triangle, whether it is turned against most of its patch.
    fn minority(mut self) -> Vec<bool> {
        let sides: Vec<(u32, bool)> = (0..self.leader.len() as u32).map(|triangle| self.find(triangle)).collect();
        // How many more are with the first than against it
        let mut more = vec![0i64; sides.len()];
        for &(first, against) in &sides {
            more[first as usize] += if against { -1 } else { 1 };
        }
        sides.into_iter().map(|(first, against)| against != (more[first as usize] < 0)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(triangles: &[[u32; 3]]) -> Option<Vec<bool>> {
        turned(triangles.len(), |i| triangles[i], |_| true)
    }

    /// A strip of so many triangles, all turned alike, and the corner after the last.
    fn strip(count: u32) -> Vec<[u32; 3]> {
        (0..count).map(|i| if i % 2 == 0 { [i, i + 1, i + 2] } else { [i + 1, i, i + 2] }).collect()
    }

    #[test]
    fn the_minority_of_each_patch_is_turned() {
        assert_eq!(of(&strip(50)), None);
        let mut random = firstlight_testkit::Random::new(3);
        for _ in 0..100 {
            let mut triangles = strip(101);
            let wanted: Vec<bool> = triangles.iter().map(|_| random.chance(0.4)).collect();
            let most = wanted.iter().filter(|turned| **turned).count() > 50;
            for (triangle, _) in triangles.iter_mut().zip(&wanted).filter(|(_, turned)| **turned) {
                triangle.swap(1, 2);
            }
            let found = of(&triangles).unwrap();
            assert!(found.iter().zip(&wanted).all(|(found, wanted)| *found == (*wanted != most)));
        }
        // As many on both sides: the first decides
        assert_eq!(of(&[[2, 1, 0], [1, 2, 3]]), None);
        assert_eq!(of(&[[0, 1, 2], [1, 2, 3]]), Some(vec![false, true]));
        // Two patches, each with its own side
        assert!(!of(&[[0, 1, 2], [1, 2, 3], [2, 3, 4], [9, 8, 7]]).unwrap()[3]);
    }

    #[test]
    fn copies_and_edges_of_three_join_nothing() {
        assert_eq!(of(&[[0, 1, 2], [1, 2, 0], [2, 1, 0]]), None);
        assert_eq!(of(&[[0, 1, 2], [0, 1, 2]]), None);
        assert_eq!(of(&[[0, 1, 2], [0, 1, 3], [0, 1, 4]]), None);
        // But one that is not fine has no edges
        let triangles = [[0, 1, 2], [0, 1, 3], [0, 1, 1]];
        assert_eq!(turned(3, |i| triangles[i], |i| i < 2), Some(vec![false, true, false]));
    }

    #[test]
    fn a_strip_with_one_side_ends() {
        // Five triangles in a ring, the last one joined to the first
        let ring: Vec<[u32; 3]> = (0..5).map(|i| [i, (i + 1) % 5, (i + 2) % 5]).collect();
        assert_eq!(of(&ring).unwrap().len(), 5);
    }
}
