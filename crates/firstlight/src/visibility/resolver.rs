//! From many points and a light to what is seen from each.

use fearless_simd::Level;

use super::Viewpoint;
use super::occluders::OccluderList;
use super::target::Target;
use super::view::{ShadowView, Visibility};
use crate::accel::Aabb;
use crate::scene::Scene;

/// Leaves of triangles gathered for many points; more, and the points are parted. With twice as many a ball of 7
/// thousand triangles took a third longer, as did a terrain of a million.
const MANY: usize = 8;
/// Points that are taken one by one if they are not settled together.
const FEW: usize = 16;
/// Leaves looked at from one point, the nearest first, and how many more for each block of samples. What is hidden by
/// none of them is traced. Ten times as many leave half as much to trace, and take twice the time on triangles of a
/// pixel's size.
const ONE: usize = 16;
const ONE_MORE: usize = 1;
/// Blocks of samples of a light that is integrated, for that.
const UNKNOWN: usize = 64;
/// Leaves in the way of a light that is integrated, of few points together: where there are more, rays are traced.
const TRACED: usize = 32;

/// Settles what is seen of lights, points together as long as little stands in the way. Keeps its memory.
#[derive(Debug, Default)]
pub(crate) struct VisibilityResolver {
    pub occluders: OccluderList,
    pub view: ShadowView,
    alone: OccluderList,
    parts: Vec<(usize, usize)>,
}

/// What was done, for statistics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct VisibilityStats {
    /// By [`Visibility`].
    pub classes: [u64; 4],
    /// Shafts that something was gathered in.
    pub shafts: u64,
    /// What they held.
    pub occluders: u64,
    /// Samples whose rays the trees were asked for.
    pub traced: u64,
}

impl VisibilityResolver {
    /// Hears what of a light is seen from each of the `points` whose numbers are in `order`, in any order: `each` is
    /// told which point, how much is seen, and by which view, which it may keep. The order of `order` is lost.
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
            let blocks = if target.blocks.is_empty() { UNKNOWN } else { target.blocks.len() };
            let cap = if part.len() > 1 { MANY } else { ONE + ONE_MORE * blocks };
            self.occluders.gather(level, scene, target, points, part, cap);
            counts.shafts += 1;
            // What too much is in the way of is left to whoever traces rays, past what is in lists
            let mut is_traced = false;
            if self.occluders.too_many && part.len() <= FEW && target.blocks.is_empty() {
                if part.len() > 1 {
                    self.occluders.gather(level, scene, target, points, part, TRACED);
                    counts.shafts += 1;
                }
                is_traced = self.occluders.too_many;
                // It may be in the ways of all together that so much is, not in those of each
                if is_traced && part.len() > 1 {
                    let cap = ONE + ONE_MORE * UNKNOWN;
                    self.alone.gather(level, scene, target, points, &part[part.len() / 2..][..1], cap);
                    counts.shafts += 1;
                    is_traced = self.alone.too_many;
                }
            }
            if is_traced {
                self.occluders.leaves.clear();
            } else if self.occluders.too_many && part.len() > 1 {
                if part.len() <= FEW {
                    parts.extend((start..end).map(|i| (i, i + 1)));
                    continue;
                }
                // In four
                let middle = halve(points, part);
                let (left, right) = part.split_at_mut(middle);
                let quarters = [halve(points, left), middle, middle + halve(points, right), end - start];
                let mut first = 0;
                for last in quarters {
                    if last > first {
                        parts.push((start + first, start + last));
                    }
                    first = last;
                }
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

/// Parts points where their box is longest, and says how many are in the first part: at least one in each.
fn halve(points: &[Viewpoint], part: &mut [u32]) -> usize {
    let bounds = part.iter().fold(Aabb::EMPTY, |bounds, k| bounds.with(points[*k as usize].start));
    let size = bounds.max - bounds.min;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
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
