//! The curvature of irradiance across a pixel, from differences between neighbouring pixels of its cell.

use super::patch::{Patch, Patches};
use crate::integrate::TOLERANCE;
use crate::material::Moments;
use crate::math::Vec3;
use crate::render::cell::CELL;

impl Patches {
    /// An estimate of the difference between the mean over a patch that fills its pixel and the value at its middle,
    /// from the second differences of three pixels along each axis. `arrived` returns the values of patches. `None`
    /// where neighbours cannot be compared. At an edge of the cell the second difference next to it is taken.
    pub(super) fn within(&self, patch: &Patch, arrived: impl Fn(usize) -> Option<Moments>) -> Option<Moments> {
        let mut bend = Moments::default();
        for axis in 0..2 {
            let mut rows = [Moments::default(); 3];
            let mut normals = [Vec3::ZERO; 3];
            for ((sums, normal), place) in rows.iter_mut().zip(&mut normals).zip(self.three(patch, axis)?) {
                let beside = self.whole[place as usize].filter(|beside| self.is_same(patch, *beside))?;
                (*sums, *normal) = (arrived(beside)?, self.all[beside].point.ns);
            }
            // Pixels on both sides of an edge of the surface cannot be compared
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

    /// Whether another patch is of the same surface and lobe, so that both can be compared.
    fn is_same(&self, patch: &Patch, beside: usize) -> bool {
        let beside = &self.all[beside];
        beside.point.bsdf.lobe == patch.point.bsdf.lobe && patch.holds(beside)
    }
}
