//! The points of an area light, as lanes want them.

use fearless_simd::{f32x16, prelude::*};

use crate::math::{DVec3, LANES, Vec3, Vec3x16};

/// The sampled points of an area light in blocks of sixteen, coordinate by coordinate, as lanes want them.
#[derive(Clone, Debug)]
pub(crate) struct Points {
    pub blocks: Vec<PointBlock>,
    /// The unit normal at each point, where each has its own. They are kept, not found from the points: those are
    /// rounded, and of a small sphere far from the origin nothing would be left.
    pub(super) normals: Vec<PointBlock>,
}

/// Sixteen points, or normals, axis by axis. Where there is none, every coordinate is NaN: it is above no horizon and
/// sends no light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointBlock(pub [[f32; LANES]; 3]);

impl Points {
    /// How many there are.
    pub fn count(&self) -> usize {
        let last = self.blocks.last().map_or(0, |block| block.0[0].iter().filter(|x| !x.is_nan()).count());
        self.blocks.len().saturating_sub(1) * LANES + last
    }

    /// Point `k`, world space.
    pub fn get(&self, k: usize) -> Vec3 {
        self.blocks[k / LANES].get(k % LANES)
    }
}

impl PointBlock {
    #[inline(always)]
    pub(super) fn of(point: impl Fn(usize) -> DVec3) -> PointBlock {
        let mut block = PointBlock([[0.0; LANES]; 3]);
        for k in 0..LANES {
            let v = point(k).as_vec3();
            (block.0[0][k], block.0[1][k], block.0[2][k]) = (v.x, v.y, v.z);
        }
        block
    }

    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3 {
        let [x, y, z] = &self.0;
        Vec3::new(x[lane], y[lane], z[lane])
    }

    #[inline(always)]
    pub fn lanes<S: Simd>(&self, simd: S) -> Vec3x16<S> {
        let [x, y, z] = self.0.map(|axis| f32x16::simd_from(simd, axis));
        Vec3x16 { x, y, z }
    }
}
