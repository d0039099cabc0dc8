//! Making one vertex of all corners with the same key, on all threads, always with the same result.
//!
//! A single hash table over all corners misses the cache at every look. Here corners are first dealt into buckets by
//! their hash, so that each bucket's table stays in the cache and buckets are worked on in parallel. Every corner
//! learns the *first* corner with its key; that, and not the order of any table, numbers the vertices. So the hash may
//! be seeded anew in each process, which keeps files that were made to collide from being slow.

use std::hash::{BuildHasher, RandomState};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::parallel::{self, CHUNK};

/// What is the same in corners that become one vertex.
pub(super) type CornerKey = [u32; 4];

/// Corners made to vertices.
pub(super) struct Welded {
    /// For each corner, its vertex.
    pub(super) vertex: Vec<u32>,
    /// For each vertex, its first corner; in rising order.
    pub(super) first: Vec<u32>,
}

/// Corners in one block of the first pass.
const BLOCK: usize = 1 << 16;
/// Corners that a bucket has on average, at most.
const BUCKET: usize = 1 << 14;
const EMPTY: u32 = u32::MAX;

/// Numbers the different keys of corners `0..count` in the order of their first appearance.
///
/// `count` below 2^32 - 1.
pub(super) fn weld(count: usize, key: impl Fn(usize) -> CornerKey + Sync) -> Welded {
    debug_assert!(count < EMPTY as usize);
    let hash = Hash::new();
    let buckets = (count / BUCKET).next_power_of_two().clamp(1, 1 << 14);
    let shift = 64 - buckets.trailing_zeros();
    let bucket_of = |hash: u64| if shift == 64 { 0 } else { (hash >> shift) as usize };
    // Deal the corners of each block into buckets, in order
    let corners = |block: usize| block * BLOCK..((block + 1) * BLOCK).min(count);
    let blocks: Vec<(Vec<u32>, Vec<u32>)> = parallel::collect(count.div_ceil(BLOCK), |block| {
        let chosen: Vec<u16> = corners(block).map(|i| bucket_of(hash.of(key(i))) as u16).collect();
        let mut starts = vec![0u32; buckets + 1];
        for &bucket in &chosen {
            starts[bucket as usize + 1] += 1;
        }
        for i in 0..buckets {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut dealt = vec![0u32; chosen.len()];
        for (i, &bucket) in corners(block).zip(&chosen) {
            let place = &mut next[bucket as usize];
            dealt[*place as usize] = i as u32;
            *place += 1;
        }
        (dealt, starts)
    });
    // Find the first corner of each key, bucket by bucket
    let zeros = |block: usize| corners(block).map(|_| AtomicU32::new(0)).collect::<Vec<_>>();
    let first_of = parallel::collect(count.div_ceil(BLOCK), zeros);
    parallel::for_each(buckets, &|bucket| {
        let of_block = |(_, starts): &'_ (Vec<u32>, Vec<u32>)| starts[bucket] as usize..starts[bucket + 1] as usize;
        let size: usize = blocks.iter().map(|b| of_block(b).len()).sum();
        // Tag from the hash beside the corner, so that most keys are looked at only when they are equal
        let mask = (2 * size).next_power_of_two() - 1;
        let mut table = vec![(0u32, EMPTY); mask + 1];
        for block in &blocks {
            for &corner in &block.0[of_block(block)] {
                let own = key(corner as usize);
                let hashed = hash.of(own);
                let tag = (hashed >> 8) as u32;
                let mut at = hashed as usize & mask;
                let first = loop {
                    let (found_tag, found) = table[at];
                    if found == EMPTY {
                        table[at] = (tag, corner);
                        break corner;
                    }
                    if found_tag == tag && key(found as usize) == own {
                        break found;
                    }
                    at = (at + 1) & mask;
                };
                in_blocks(&first_of, corner).store(first, Ordering::Relaxed);
            }
        }
    });
    drop(blocks);
    // Number the first corners in order
    let is_first = |i: &u32| in_blocks(&first_of, *i).load(Ordering::Relaxed) == *i;
    let lists: Vec<Vec<u32>> =
        parallel::collect(count.div_ceil(BLOCK), |block| corners(block).map(|i| i as u32).filter(is_first).collect());
    let mut first = Vec::with_capacity(lists.iter().map(Vec::len).sum());
    let mut starts = Vec::with_capacity(lists.len());
    for list in &lists {
        starts.push(first.len() as u32);
        first.extend_from_slice(list);
    }
    // A corner's vertex: its rank among the first corners
    let mut rank = vec![0u32; count];
    parallel::for_each_chunk(&mut rank, BLOCK, |block, rank| {
        for (number, &corner) in (starts[block]..).zip(&lists[block]) {
            rank[corner as usize - block * BLOCK] = number;
        }
    });
    let vertex = parallel::map(count, BLOCK, |i| {
        let first = in_blocks(&first_of, i as u32).load(Ordering::Relaxed);
        rank[first as usize]
    });
    Welded { vertex, first }
}

impl Welded {
    /// Puts vertices in place of corners.
    pub fn renumber(&self, triangles: &mut [[u32; 3]]) {
        let vertex = |corner: u32| self.vertex[corner as usize];
        parallel::for_each_mut(triangles, CHUNK, |_, triangle| *triangle = triangle.map(vertex));
    }
}

/// The number of a corner in a list that is cut into blocks.
fn in_blocks(list: &[Vec<AtomicU32>], corner: u32) -> &AtomicU32 {
    &list[corner as usize / BLOCK][corner as usize % BLOCK]
}

/// Multiplies and folds, with secret numbers of this process.
struct Hash {
    seeds: [u64; 4],
}

impl Hash {
    fn new() -> Self {
        let state = RandomState::new();
        Self { seeds: [0u64, 1, 2, 3].map(|i| state.hash_one(i) | 1) }
    }

    #[inline(always)]
    fn of(&self, key: CornerKey) -> u64 {
        let fold = |a: u64, b: u64| {
            let product = u128::from(a) * u128::from(b);
            product as u64 ^ (product >> 64) as u64
        };
        let low = u64::from(key[0]) | u64::from(key[1]) << 32;
        let high = u64::from(key[2]) | u64::from(key[3]) << 32;
        let mixed = fold(low ^ self.seeds[0], high ^ self.seeds[1]);
        fold(mixed ^ self.seeds[2], self.seeds[3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_are_numbered_by_first_appearance() {
        for (count, different) in [(0, 1), (1, 1), (1000, 10), (300_000, 90_000), (200_000, 1)] {
            let key = |i: usize| {
                let k = (i.wrapping_mul(2654435761) >> 7) % different;
                [k as u32, (k / 3) as u32, 7, 0]
            };
            let welded = weld(count, key);
            let mut seen = std::collections::HashMap::new();
            let mut first = Vec::new();
            for i in 0..count {
                let vertex = *seen.entry(key(i)).or_insert_with(|| {
                    first.push(i as u32);
                    first.len() as u32 - 1
                });
                assert_eq!(welded.vertex[i], vertex);
            }
            assert_eq!(welded.first, first);
        }
    }
}
