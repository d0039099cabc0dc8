//! The visibility of one light from many points: the points are split until few occluders are in each shaft.

use fearless_simd::Level;

use super::Viewpoint;
use super::occluders::OccluderList;
use super::target::Target;
use super::view::{ShadowView, Visibility};
use crate::accel::Aabb;
use crate::scene::Scene;

/// The most leaves of triangles in the shaft of several points; with more the points are split. With twice as many a
/// ball of 7 thousand triangles took a third longer, as did a terrain of a million.
const MAX_LEAVES: usize = 8;
/// Up to so many points are not split into quarters but into single points.
const FEW_POINTS: usize = 16;
/// The most leaves in the shaft of one point, nearest first, and one more for each block of samples. Samples that none
/// of them hides are traced. Ten times as many leave half as many samples to trace, and take twice the time on
/// triangles of a pixel's size.
const MAX_LEAVES_OF_POINT: usize = 16;
/// The number of blocks to assume for that where the light has no samples, since it is integrated.
const BLOCKS_OF_INTEGRATED: usize = 64;
/// The most leaves in the shaft of few points to a light that is integrated; with more, rays are traced.
const MAX_LEAVES_OF_FEW: usize = 32;

/// Computes the visibility of lights from points. Keeps its memory.
#[derive(Debug, Default)]
pub(crate) struct VisibilityResolver {
    pub occluders: OccluderList,
    pub view: ShadowView,
    occluders_of_one: OccluderList,
    parts: Vec<(usize, usize)>,
}

/// Counts of the work, for statistics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct VisibilityStats {
    /// Pairs of a point and a light, by [`Visibility`].
    pub classes: [u64; 4],
    /// Shafts that occluders were gathered in.
    pub shafts: u64,
    /// Occluders that they held, all together.
    pub occluders: u64,
    /// Samples whose rays were traced through the trees.
    pub traced: u64,
}

impl VisibilityResolver {
    /// Computes the visibility of a light from those `points` whose indices are in `order`, which is permuted. Calls
    /// `each`, in any order of the points, with the index, the visibility, and the occluders as that point sees them,
    /// which it may take.
    #[allow(clippy::too_many_arguments, reason = "a light of a scene and points, as lists")]
    pub fn resolve(
        &mut self,
        level: Level,
        scene: &Scene,
        target: &Target,
        points: &[Viewpoint],
        order: &mut [u32],
        counts: &mut VisibilityStats,
        mut each: impl FnMut(usize, Visibility, &mut ShadowView),
    ) {
        let mut parts = std::mem::take(&mut self.parts);
        parts.clear();
        if !order.is_empty() {
            parts.push((0, order.len()));
        }
        while let Some((start, end)) = parts.pop() {
            let part = &mut order[start..end];
            let blocks = if target.blocks.is_empty() { BLOCKS_OF_INTEGRATED } else { target.blocks.len() };
            let cap_of_point = MAX_LEAVES_OF_POINT + blocks;
            let cap = if part.len() > 1 { MAX_LEAVES } else { cap_of_point };
            self.occluders.gather(level, scene, target, points, part, cap);
            counts.shafts += 1;
            // With too many leaves in the shaft of few points the caller traces rays through the trees
            let mut is_traced = false;
            if self.occluders.too_many && part.len() <= FEW_POINTS && target.blocks.is_empty() {
                if part.len() > 1 {
                    self.occluders.gather(level, scene, target, points, part, MAX_LEAVES_OF_FEW);
                    counts.shafts += 1;
                }
                is_traced = self.occluders.too_many;
                // The shaft of all may hold so many leaves where those of single points hold few
                if is_traced && part.len() > 1 {
                    let one = &part[part.len() / 2..][..1];
                    self.occluders_of_one.gather(level, scene, target, points, one, cap_of_point);
                    counts.shafts += 1;
                    is_traced = self.occluders_of_one.too_many;
                }
            }
            if is_traced {
                self.occluders.leaves.clear();
            } else if self.occluders.too_many && part.len() > 1 {
                if part.len() <= FEW_POINTS {
                    parts.extend((start..end).map(|i| (i, i + 1)));
                    continue;
                }
                // Split into quarters
                let middle = split(points, part);
                let (left, right) = part.split_at_mut(middle);
                let ends = [0, split(points, left), middle, middle + split(points, right), end - start];
                let quarters = ends.windows(2).filter(|ends| ends[0] < ends[1]);
                parts.extend(quarters.map(|ends| (start + ends[0], start + ends[1])));
                continue;
            }
            counts.occluders += self.occluders.count() as u64;
            for k in part.iter().map(|k| *k as usize) {
                let visibility = self.view.classify(level, scene, target, &self.occluders, &points[k]);
                counts.classes[visibility as usize] += 1;
                if visibility == Visibility::Partial && !target.blocks.is_empty() {
                    counts.traced += self.view.mask(level, scene, target, None, &points[k]);
                }
                each(k, visibility, &mut self.view);
            }
        }
        self.parts = parts;
    }
}

/// Splits points at the middle of their box along its longest axis, and returns the number of points in the first part:
/// neither part is empty.
fn split(points: &[Viewpoint], part: &mut [u32]) -> usize {
    let bounds = part.iter().fold(Aabb::EMPTY, |bounds, k| bounds.with(points[*k as usize].start));
    let size = bounds.max - bounds.min;
    let axis = size.max_position();
    let middle = bounds.min[axis] + size[axis] * 0.5;
    let mut left = 0;
    for i in 0..part.len() {
        if points[part[i] as usize].start[axis] < middle {
            part.swap(i, left);
            left += 1;
        }
    }
    if left == 0 || left == part.len() { part.len() / 2 } else { left }
}
