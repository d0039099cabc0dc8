//! What the neighbours of a pixel in its cell tell of what light does within it.

use super::patch::{Patch, Patches};
use crate::integrate::TOLERANCE;
use crate::material::Moments;
use crate::math::Vec3;
use crate::render::cell::CELL;

impl Patches {
    /// How far the mean of what light does over a patch that fills its pixel can be from what it does in the middle: by
    /// how far three pixels in a row are from a line, along each axis, as `arrived` says of their patches. `None` where
    /// they tell nothing. At an edge of the cell those next to it tell.
    pub(super) fn within(&self, patch: &Patch, arrived: impl Fn(usize) -> Option<Moments>) -> Option<Moments> {
        let mut bend = Moments::default();
        for axis in 0..2 {
            let mut rows = [Moments::default(); 3];
            let mut normals = [Vec3::ZERO; 3];
            for ((sums, normal), place) in rows.iter_mut().zip(&mut normals).zip(self.three(patch, axis)?) {
                let beside = self.whole[place as usize].filter(|beside| self.is_same(patch, *beside))?;
                (*sums, *normal) = (arrived(beside)?, self.all[beside].point.ns);
            }
            // Nor do they tell where an edge of the surface runs between
            let [before, here, after] = normals;
            if !((before + after - here * 2.0).length() <= TOLERANCE.even) {
                return None;
            }
            let [before, here, after] = rows;
            let difference = (before + after).zip(here, |sides, here| sides - 2.0 * here);
            bend += difference.map(|difference| difference.abs() * TOLERANCE.within);
        }
        Some(bend)
    }

    /// Three pixels of the cell in a row along an axis: a patch's own in their middle, or next to it.
    fn three(&self, patch: &Patch, axis: usize) -> Option<[u32; 3]> {
        let at = [patch.pixel % CELL, patch.pixel / CELL];
        let step = [1, CELL][axis];
        let last = self.size[axis].checked_sub(2).filter(|last| *last >= 1)?;
        let middle = patch.pixel - at[axis] * step + at[axis].clamp(1, last) * step;
        Some([middle - step, middle, middle + step])
    }

    /// Whether another patch is of the same surface, so that one tells something of the other.
    fn is_same(&self, patch: &Patch, beside: usize) -> bool {
        let beside = &self.all[beside];
        beside.point.bsdf.lobe == patch.point.bsdf.lobe && patch.holds(beside)
    }
}
