//! Sixteen vectors at a time.

use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::{LANES, Vec3};

/// Runs code for sixteen numbers at a time with the instruction set that suits it: AVX-512, AVX2, NEON, or what every
/// processor has. Three copies, not five: the code below takes the compiler seconds; and of plain numbers, sixteen to a
/// step, minutes.
macro_rules! dispatch_wide {
    ($level:expr, $simd:ident => $op:expr) => {{
        let level: fearless_simd::Level = $level;
        #[cfg(target_arch = "x86_64")]
        if let Some($simd) = level.as_avx512() {
            $op
        } else if let Some($simd) = level.as_avx2() {
            $op
        } else if let Some($simd) = fearless_simd::Level::baseline().as_sse2() {
            $op
        } else {
            unreachable!("every processor of this kind has SSE2")
        }
        #[cfg(not(target_arch = "x86_64"))]
        fearless_simd::dispatch!(level, $simd => $op)
    }};
}

pub(crate) use dispatch_wide;

/// Sixteen vectors, coordinate by coordinate.
#[derive(Clone, Copy)]
pub struct Vec3x16<S: Simd> {
    pub x: f32x16<S>,
    pub y: f32x16<S>,
    pub z: f32x16<S>,
}

impl<S: Simd> Vec3x16<S> {
    /// `v` in every lane.
    #[inline(always)]
    pub fn splat(simd: S, v: Vec3) -> Self {
        Self { x: simd.splat_f32x16(v.x), y: simd.splat_f32x16(v.y), z: simd.splat_f32x16(v.z) }
    }

    /// The scalar product, summed in the order of `Vec3::dot`.
    #[inline(always)]
    pub fn dot(self, o: Self) -> f32x16<S> {
        (self.x * o.x) + (self.y * o.y) + (self.z * o.z)
    }

    /// The vector product, computed in the order of `Vec3::cross`.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Self { x: self.y * o.z - o.y * self.z, y: self.z * o.x - o.z * self.x, z: self.x * o.y - o.x * self.y }
    }

    /// Each coordinate without its sign.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self { x: self.x.abs(), y: self.y.abs(), z: self.z.abs() }
    }
}

impl<S: Simd> std::ops::Add for Vec3x16<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl<S: Simd> std::ops::Sub for Vec3x16<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

impl<S: Simd> std::ops::Mul<f32x16<S>> for Vec3x16<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, by: f32x16<S>) -> Self {
        Self { x: self.x * by, y: self.y * by, z: self.z * by }
    }
}

/// Numbers where bits are set, and else 0.
#[inline(always)]
pub(crate) fn only<S: Simd>(simd: S, bits: u16, of: f32x16<S>) -> f32x16<S> {
    mask32x16::from_bitmask(simd, bits.into()).select(of, simd.splat_f32x16(0.0))
}

/// The least and the most of sixteen numbers.
#[inline(always)]
pub(crate) fn least_and_most<S: Simd>(of: f32x16<S>) -> [f32; 2] {
    let simd = of.token();
    let (left, right) = simd.split_f32x16(of);
    let (least, most) = (simd.split_f32x8(left.min(right)), simd.split_f32x8(left.max(right)));
    let ([a, b, c, d], [e, f, g, h]) = (least.0.min(least.1).to_array(), most.0.max(most.1).to_array());
    [a.min(b).min(c.min(d)), e.max(f).max(g.max(h))]
}

/// The sum of sixteen numbers, in the same order with every instruction set.
#[inline(always)]
pub(crate) fn total<S: Simd>(of: f32x16<S>) -> f32 {
    sum_of_runs(of.token(), of, LANES).as_slice()[0]
}

/// For each aligned run of so many numbers, a power of two, their sum in all of them.
#[inline(always)]
pub(crate) fn sum_of_runs<S: Simd>(simd: S, of: f32x16<S>, run: usize) -> f32x16<S> {
    let mut sums = of.to_array();
    add_halves::<1>(&mut sums, run);
    add_halves::<2>(&mut sums, run);
    add_halves::<4>(&mut sums, run);
    add_halves::<8>(&mut sums, run);
    f32x16::simd_from(simd, sums)
}

/// Where runs are longer than `HALF`, adds what is in the other half of each run that is twice as long as that.
#[inline(always)]
fn add_halves<const HALF: usize>(sums: &mut [f32; LANES], run: usize) {
    if run > HALF {
        let half = *sums;
        *sums = std::array::from_fn(|lane| half[lane] + half[lane ^ HALF]);
    }
}
