//! Many rays as one: between two lines in each of two planes.
//!
//! Of rays that share their largest axis z and its sign, each is x = a + b z. A line below all of them and a line above all
//! of them, in x z and in y z, bound them all; a box is met only if it reaches over the lower line and under the upper one
//! somewhere along its own stretch of z. That is four multiplications and additions for eight boxes, whatever the number
//! of rays, and exact for a pinhole's tile. The lines start where all rays start, or end where all end, whichever is
//! narrower: rays from one point, rays to one point, and parallel rays are all bounded tightly.

use fearless_simd::{f32x8, f32x16, mask32x16, prelude::*};

use super::node::Node;
use super::ray::{BEAM_PAD, Lanes, MAX_COORDINATE, MAX_DIRECTION, MIN_DIRECTION, OWN_PAD, Rays, SMALLEST};
use crate::math::Vec3;

/// A line that bounds rays on one side: x = a + b z.
#[derive(Clone, Copy, Debug)]
struct Line {
    a: f32,
    b: f32,
}

/// The hull of many rays.
#[derive(Clone, Debug)]
pub(crate) struct Beam {
    /// kx, ky, kz: the rays run along kz.
    pub axes: [usize; 3],
    /// The lines below and above, along kx and ky.
    lower: [Line; 2],
    upper: [Line; 2],
    /// Along the rays: z = sign * coordinate + start.
    sign: f32,
    start: f32,
    /// 1 if rays run towards smaller coordinates.
    side: usize,
    /// How far any ray reaches.
    pub z_max: f32,
    /// [`BEAM_PAD`], in units of length.
    pad: f32,
    /// The tree's centre along kz.
    center: f32,
}

/// The axes kx, ky, kz when kz is the largest.
#[inline(always)]
pub(crate) fn axes(kz: usize) -> [usize; 3] {
    [[1, 2, 0], [2, 0, 1], [0, 1, 2]][kz]
}

/// Calls `each` with those of the rays in `active` that share largest axis and sign, group by group. Rays that can meet
/// nothing are in none.
#[inline(always)]
pub(crate) fn groups<S: Simd, const N: usize>(simd: S, rays: &Rays<N>, active: u64) -> [u64; 6] {
    let mut groups = [0; 6];
    let splat = |v: f32| simd.splat_f32x16(v);
    for block in 0..N / 16 {
        let active = active >> (16 * block) & 0xffff;
        if active == 0 {
            continue;
        }
        let [ox, oy, oz] = rays.block(simd, &rays.o, block);
        let [dx, dy, dz] = rays.block(simd, &rays.d, block);
        let (ax, ay, az) = (dx.abs(), dy.abs(), dz.abs());
        // A NaN anywhere makes a comparison false
        let near = |o: f32x16<S>| o.abs().simd_le(splat(MAX_COORDINATE));
        let small = |d: f32x16<S>| d.simd_le(splat(MAX_DIRECTION));
        let large = |d: f32x16<S>| d.simd_ge(splat(MIN_DIRECTION));
        let valid = near(ox) & near(oy) & near(oz) & small(ax) & small(ay) & small(az);
        let valid = valid & (large(ax) | large(ay) | large(az));
        let valid = valid.to_bitmask() & active;
        let along_x = (ax.simd_ge(ay) & ax.simd_ge(az)).to_bitmask();
        let along_y = ay.simd_ge(az).to_bitmask() & !along_x;
        let along_z = !along_x & !along_y;
        for (axis, (along, d)) in [(along_x, dx), (along_y, dy), (along_z, dz)].into_iter().enumerate() {
            let negative = d.simd_lt(splat(0.0)).to_bitmask();
            groups[2 * axis] |= (valid & along & !negative) << (16 * block);
            groups[2 * axis + 1] |= (valid & along & negative) << (16 * block);
        }
    }
    groups
}

impl<const N: usize> Rays<N> {
    /// Sixteen of the rays' coordinates.
    #[inline(always)]
    fn block<S: Simd>(&self, simd: S, of: &[[f32; N]; 3], block: usize) -> [f32x16<S>; 3] {
        let load = |axis: usize| f32x16::from_slice(simd, &of[axis][16 * block..16 * block + 16]);
        [load(0), load(1), load(2)]
    }

    /// Sixteen of the rays, which share their largest axis, ready for triangles.
    #[inline(always)]
    pub fn lanes<S: Simd>(&self, simd: S, block: usize, [kx, ky, kz]: [usize; 3], center: Vec3, half: f32) -> Lanes<S> {
        let splat = |v: f32| simd.splat_f32x16(v);
        let o = self.block(simd, &self.o, block);
        let d = self.block(simd, &self.d, block);
        let least = d[kz].abs() * splat(SMALLEST);
        let reciprocal = |d: f32x16<S>| {
            let d = d.abs().simd_lt(least).select(least.copysign(d), d);
            splat(1.0) / d
        };
        let rd = [reciprocal(d[kx]), reciprocal(d[ky]), reciprocal(d[kz])];
        let away = |axis: usize| (o[axis] - splat(center[axis])).abs();
        let reach = away(0).max(away(1)).max(away(2)) + splat(half);
        let pad = reach * splat(OWN_PAD);
        Lanes {
            o: [o[kx], o[ky], o[kz]],
            shear: [d[kx] / d[kz], d[ky] / d[kz], splat(1.0) / d[kz]],
            rd,
            own: [rd[0].abs() * pad, rd[1].abs() * pad, rd[2].abs() * pad],
        }
    }
}

/// The least and the largest of those lanes that a mask names.
#[inline(always)]
fn range<S: Simd>(simd: S, (least, largest): &mut (f32, f32), mask: mask32x16<S>, v: f32x16<S>) {
    *least = least.min(mask.select(v, simd.splat_f32x16(f32::INFINITY)).reduce_min());
    *largest = largest.max(mask.select(v, simd.splat_f32x16(f32::NEG_INFINITY)).reduce_max());
}

impl Beam {
    /// The hull of the rays in `group`, one of [`groups`], as far as `t_max` of each, for a tree around `center` that
    /// reaches `half` from it.
    #[inline(always)]
    pub fn new<S: Simd, const N: usize>(
        simd: S,
        rays: &Rays<N>,
        t_max: &[f32; N],
        group: u64,
        which: usize,
        center: Vec3,
        half: f32,
    ) -> Beam {
        let kz = which / 2;
        let sign = if which % 2 == 0 { 1.0 } else { -1.0 };
        let [kx, ky, kz] = axes(kz);
        let splat = |v: f32| simd.splat_f32x16(v);
        const NONE: (f32, f32) = (f32::INFINITY, f32::NEG_INFINITY);
        // Where the rays start and end along z, and how far all that is from the centre
        let (mut starts, mut ends, mut reach) = (NONE, NONE, NONE);
        for block in 0..N / 16 {
            let mask = mask32x16::from_bitmask(simd, group >> (16 * block) & 0xffff);
            let o = rays.block(simd, &rays.o, block);
            let d = rays.block(simd, &rays.d, block);
            let away = |axis: usize| (o[axis] - splat(center[axis])).abs();
            range(simd, &mut reach, mask, away(0).max(away(1)).max(away(2)));
            let z = (o[kz] - splat(center[kz])) * splat(sign);
            range(simd, &mut starts, mask, z);
            let t = f32x16::from_slice(simd, &t_max[16 * block..16 * block + 16]);
            range(simd, &mut ends, mask, z + d[kz].abs() * t);
        }
        let (z_start, z_end) = (starts.0, ends.1);
        let reach = reach.1 + half;
        let z_length = z_end - z_start;
        // What lies behind the tree is of no interest, and would widen what rounding asks for
        let (mut first, mut last, mut slopes) = ([NONE; 2], [NONE; 2], [NONE; 2]);
        for block in 0..N / 16 {
            let mask = mask32x16::from_bitmask(simd, group >> (16 * block) & 0xffff);
            let o = rays.block(simd, &rays.o, block);
            let d = rays.block(simd, &rays.d, block);
            let z = (o[kz] - splat(center[kz])) * splat(sign);
            let r = splat(1.0) / d[kz].abs();
            for (i, k) in [kx, ky].into_iter().enumerate() {
                let x = o[k] - splat(center[k]);
                let slope = d[k] * r;
                range(simd, &mut slopes[i], mask, slope);
                range(simd, &mut first[i], mask, x + slope * (splat(z_start) - z));
                range(simd, &mut last[i], mask, x + slope * (splat(z_end) - z));
            }
        }
        let mut pad = reach * BEAM_PAD;
        let line = Line { a: 0.0, b: 0.0 };
        let (mut lower, mut upper) = ([line; 2], [line; 2]);
        for i in 0..2 {
            let (slope, first, last) = (slopes[i], first[i], last[i]);
            if z_length < MAX_COORDINATE && last.1 - last.0 < first.1 - first.0 {
                lower[i] = Line { a: last.0 - slope.1 * z_length, b: slope.1 };
                upper[i] = Line { a: last.1 - slope.0 * z_length, b: slope.0 };
                pad = pad.max((reach + z_length) * BEAM_PAD);
            } else {
                lower[i] = Line { a: first.0, b: slope.0 };
                upper[i] = Line { a: first.1, b: slope.1 };
            }
        }
        for i in 0..2 {
            lower[i].a -= pad;
            upper[i].a += pad;
        }
        Beam {
            axes: [kx, ky, kz],
            lower,
            upper,
            sign,
            start: -z_start,
            side: which % 2,
            z_max: z_length + pad,
            pad,
            center: center[kz],
        }
    }

    /// How far the rays in `group` reach now, at most.
    #[inline(always)]
    pub fn z_max<S: Simd, const N: usize>(&self, simd: S, rays: &Rays<N>, t_max: &[f32; N], group: u64) -> f32 {
        let splat = |v: f32| simd.splat_f32x16(v);
        let kz = self.axes[2];
        let mut ends = (f32::INFINITY, f32::NEG_INFINITY);
        for block in 0..N / 16 {
            let mask = mask32x16::from_bitmask(simd, group >> (16 * block) & 0xffff);
            let o = f32x16::from_slice(simd, &rays.o[kz][16 * block..16 * block + 16]);
            let d = f32x16::from_slice(simd, &rays.d[kz][16 * block..16 * block + 16]);
            let t = f32x16::from_slice(simd, &t_max[16 * block..16 * block + 16]);
            let z = (o - splat(self.center)) * splat(self.sign) + splat(self.start);
            range(simd, &mut ends, mask, z + d.abs() * t);
        }
        ends.1 + self.pad
    }

    /// The children of a node that the beam meets: a bit for each, and where along the beam they begin.
    #[inline(always)]
    pub fn meet<S: Simd>(&self, simd: S, node: &Node, z_max: f32) -> (u32, f32x8<S>) {
        let [kx, ky, kz] = self.axes;
        assert!(kx < 3 && ky < 3 && kz < 3, "axes are axes");
        let side = self.side & 1;
        let splat = |v: f32| simd.splat_f32x8(v);
        let plane = |axis: usize, side: usize| f32x8::load_array_ref(simd, &node.planes[axis][side]);
        let enter = plane(kz, side).mul_add(self.sign, self.start - self.pad).max(0.0);
        let leave = plane(kz, side ^ 1).mul_add(self.sign, self.start + self.pad).min(z_max);
        let mut met = enter.simd_le(leave);
        for (i, k) in [kx, ky].into_iter().enumerate() {
            let (lower, upper) = (self.lower[i], self.upper[i]);
            let z = if lower.b >= 0.0 { enter } else { leave };
            met &= z.mul_add(lower.b, splat(lower.a)).simd_le(plane(k, 1));
            let z = if upper.b >= 0.0 { leave } else { enter };
            met &= z.mul_add(upper.b, splat(upper.a)).simd_ge(plane(k, 0));
        }
        (met.to_bitmask() as u32, enter)
    }
}
