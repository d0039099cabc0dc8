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

/// Sixteen points, or normals. Where there is none, every coordinate is NaN: it is above no horizon and sends no light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointBlock {
    x: [f32; LANES],
    y: [f32; LANES],
    z: [f32; LANES],
}

impl Points {
    /// How many there are.
    pub fn count(&self) -> usize {
        let last = self.blocks.last().map_or(0, |block| block.x.iter().filter(|x| !x.is_nan()).count());
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
        let mut block = PointBlock { x: [0.0; LANES], y: [0.0; LANES], z: [0.0; LANES] };
        for k in 0..LANES {
            let v = point(k).as_vec3();
            (block.x[k], block.y[k], block.z[k]) = (v.x, v.y, v.z);
        }
        block
    }

    /// The coordinates of all of them, axis by axis.
    #[inline(always)]
    pub fn coordinates(&self) -> [[f32; LANES]; 3] {
        [self.x, self.y, self.z]
    }

    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    #[inline(always)]
    pub fn lanes<S: Simd>(&self, simd: S) -> Vec3x16<S> {
        Vec3x16 {
            x: f32x16::simd_from(simd, self.x),
            y: f32x16::simd_from(simd, self.y),
            z: f32x16::simd_from(simd, self.z),
        }
    }
}
