//! Many rays as one: between two lines in each of two planes.
//!
//! Of rays that share their largest axis z and its sign, each is x = a + b z. A line below all of them and a line above
//! all of them, in x z and in y z, bound them all; a box is met only if it reaches over the lower line and under the
//! upper one somewhere along its own stretch of z. That is four multiplications and additions for eight boxes, whatever
//! the number of rays, and exact for a pinhole's tile. The lines start where all rays start, or end where all end,
//! whichever is narrower: rays from one point, rays to one point, and parallel rays are all bounded tightly.

use fearless_simd::{f32x8, f32x16, mask32x16, prelude::*};

use super::node::{BoxNode, WIDTH};
use super::ray::{
    BEAM_PAD, LaneSlabs, MAX_COORDINATE, MAX_DIRECTION, MIN_DIRECTION, NODE_PAD, OWN_PAD, RayLanes, RayTile, Rays,
    SMALLEST,
};
use crate::math::Vec3;

/// A line that bounds rays on one side: x = a + b z.
#[derive(Clone, Copy, Debug)]
struct BeamEdge {
    a: f32,
    b: f32,
}

/// The hull of many rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beam {
    /// kx, ky, kz: the rays run along kz.
    pub axes: [usize; 3],
    /// The lines below and above, along kx and ky.
    lower: [BeamEdge; 2],
    upper: [BeamEdge; 2],
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
    for block in 0..N / 16 {
        let active = active >> (16 * block) & 0xffff;
        if active == 0 {
            continue;
        }
        let o = rays.block(simd, &rays.o, block);
        let [dx, dy, dz] = rays.block(simd, &rays.d, block);
        let (ax, ay, az) = (dx.abs(), dy.abs(), dz.abs());
        // A NaN anywhere makes a comparison false
        let valid = o[0].abs().simd_le(MAX_COORDINATE)
            & o[1].abs().simd_le(MAX_COORDINATE)
            & o[2].abs().simd_le(MAX_COORDINATE)
            & ax.simd_le(MAX_DIRECTION)
            & ay.simd_le(MAX_DIRECTION)
            & az.simd_le(MAX_DIRECTION)
            & (ax.simd_ge(MIN_DIRECTION) | ay.simd_ge(MIN_DIRECTION) | az.simd_ge(MIN_DIRECTION));
        let valid = valid.to_bitmask() & active;
        let along_x = (ax.simd_ge(ay) & ax.simd_ge(az)).to_bitmask();
        let along_y = ay.simd_ge(az).to_bitmask() & !along_x;
        let along_z = 0xffff & !along_x & !along_y;
        let negatives = [dx.simd_lt(0.0).to_bitmask(), dy.simd_lt(0.0).to_bitmask(), dz.simd_lt(0.0).to_bitmask()];
        for (axis, (along, negative)) in [along_x, along_y, along_z].into_iter().zip(negatives).enumerate() {
            groups[2 * axis] |= (valid & along & !negative) << (16 * block);
            groups[2 * axis + 1] |= (valid & along & negative) << (16 * block);
        }
    }
    groups
}

/// Sixteen of many numbers.
#[inline(always)]
fn sixteen<S: Simd, const N: usize>(simd: S, of: &[f32; N], block: usize) -> f32x16<S> {
    f32x16::from_slice(simd, &of[16 * block..16 * block + 16])
}

/// The largest distance from the centre along any axis.
#[inline(always)]
fn reach<S: Simd>(o: [f32x16<S>; 3], center: Vec3) -> f32x16<S> {
    (o[0] - center.x).abs().max((o[1] - center.y).abs()).max((o[2] - center.z).abs())
}

/// The reciprocal, as [`TraceRay`](super::TraceRay) has it.
#[inline(always)]
fn reciprocal<S: Simd>(simd: S, d: f32x16<S>, least: f32x16<S>) -> f32x16<S> {
    simd.splat_f32x16(1.0) / d.abs().simd_lt(least).select(least.copysign(d), d)
}

impl<const N: usize> Rays<N> {
    /// Sixteen of the rays' coordinates.
    #[inline(always)]
    fn block<S: Simd>(&self, simd: S, of: &[[f32; N]; 3], block: usize) -> [f32x16<S>; 3] {
        [sixteen(simd, &of[0], block), sixteen(simd, &of[1], block), sixteen(simd, &of[2], block)]
    }

    /// Sixteen of the rays, which share their largest axis, ready for triangles.
    #[inline(always)]
    pub fn lanes<S: Simd>(
        &self,
        simd: S,
        block: usize,
        [kx, ky, kz]: [usize; 3],
        center: Vec3,
        half: f32,
    ) -> RayLanes<S> {
        let o = self.block(simd, &self.o, block);
        let d = self.block(simd, &self.d, block);
        let least = d[kz].abs() * SMALLEST;
        let rd = [reciprocal(simd, d[kx], least), reciprocal(simd, d[ky], least), reciprocal(simd, d[kz], least)];
        let pad = (reach(o, center) + half) * OWN_PAD;
        RayLanes {
            o: [o[kx], o[ky], o[kz]],
            shear: [d[kx] / d[kz], d[ky] / d[kz], simd.splat_f32x16(1.0) / d[kz]],
            rd,
            own: [rd[0].abs() * pad, rd[1].abs() * pad, rd[2].abs() * pad],
        }
    }
}

impl<S: Simd> LaneSlabs<S> {
    /// Of rays as far as `t_max`.
    #[inline(always)]
    pub fn new(simd: S, lanes: &RayLanes<S>, [kx, ky, kz]: [usize; 3], center: Vec3, t_max: f32x16<S>) -> Self {
        let (x_lo, x_hi) = plus(simd, lanes.o[0] - center[kx], lanes.rd[0], lanes.own[0]);
        let (y_lo, y_hi) = plus(simd, lanes.o[1] - center[ky], lanes.rd[1], lanes.own[1]);
        let (z_lo, z_hi) = plus(simd, lanes.o[2] - center[kz], lanes.rd[2], lanes.own[2]);
        LaneSlabs { rd: lanes.rd, lo: [x_lo, y_lo, z_lo], hi: [x_hi, y_hi, z_hi], t_max }
    }

    /// Which rays meet a child of a node.
    #[inline(always)]
    pub fn meet(&self, simd: S, node: &BoxNode, place: usize, [kx, ky, kz]: [usize; 3]) -> u64 {
        assert!(kx < 3 && ky < 3 && kz < 3, "axes are axes");
        let (near_x, far_x) = self.between(simd, 0, &node.planes[kx], place);
        let (near_y, far_y) = self.between(simd, 1, &node.planes[ky], place);
        let (near_z, far_z) = self.between(simd, 2, &node.planes[kz], place);
        let enter = near_x.max(near_y).max(near_z.max(0.0));
        let leave = far_x.min(far_y).min(far_z.min(self.t_max));
        enter.simd_le(leave).to_bitmask()
    }

    /// When the rays are between two planes.
    #[inline(always)]
    fn between(&self, simd: S, axis: usize, planes: &[[f32; WIDTH]; 2], place: usize) -> (f32x16<S>, f32x16<S>) {
        let place = place % WIDTH;
        let lo = simd.splat_f32x16(planes[0][place]).mul_add(self.rd[axis], self.lo[axis]);
        let hi = simd.splat_f32x16(planes[1][place]).mul_add(self.rd[axis], self.hi[axis]);
        (lo.min(hi), lo.max(hi))
    }
}

/// What is added to low and high planes times `rd`, padded by twice the own pad.
#[inline(always)]
fn plus<S: Simd>(simd: S, o: f32x16<S>, rd: f32x16<S>, own: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
    let to = -o * rd;
    let pad = own * (NODE_PAD / OWN_PAD);
    let (less, more) = (to - pad, to + pad);
    let negative = rd.simd_lt(simd.splat_f32x16(0.0));
    (negative.select(more, less), negative.select(less, more))
}

/// The least and the largest of many numbers, lane by lane.
#[derive(Clone, Copy)]
struct Range<S: Simd> {
    least: f32x16<S>,
    largest: f32x16<S>,
}

impl<S: Simd> Range<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        Range { least: simd.splat_f32x16(f32::INFINITY), largest: simd.splat_f32x16(f32::NEG_INFINITY) }
    }

    /// Those lanes that the mask names.
    #[inline(always)]
    fn add(&mut self, mask: mask32x16<S>, v: f32x16<S>) {
        self.least = mask.select(v.min(self.least), self.least);
        self.largest = mask.select(v.max(self.largest), self.largest);
    }

    #[inline(always)]
    fn get(&self) -> (f32, f32) {
        (self.least.reduce_min(), self.largest.reduce_max())
    }
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
        Beam::starting(simd, rays, t_max, group, which, center, half, f32::INFINITY)
    }

    /// The hulls of those of the rays that are in each block of sixteen, with one measure of z.
    #[inline(always)]
    pub fn blocks<S: Simd>(
        &self,
        simd: S,
        rays: &RayTile,
        t_max: &[f32; 64],
        group: u64,
        center: Vec3,
        half: f32,
    ) -> [Beam; 4] {
        let mut beams = [*self; 4];
        let which = 2 * self.axes[2] + self.side;
        for (block, beam) in beams.iter_mut().enumerate() {
            let part = group & 0xffff << (16 * block);
            if part != 0 && part != group {
                *beam = Beam::starting(simd, rays, t_max, part, which, center, half, -self.start);
            }
        }
        beams
    }

    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "they are what `new` has, and one more")]
    fn starting<S: Simd, const N: usize>(
        simd: S,
        rays: &Rays<N>,
        t_max: &[f32; N],
        group: u64,
        which: usize,
        center: Vec3,
        half: f32,
        z_start: f32,
    ) -> Beam {
        let kz = which / 2;
        let sign = if which & 1 == 0 { 1.0 } else { -1.0 };
        let [kx, ky, kz] = axes(kz);
        // Where the rays start and end along z, and how far all that is from the centre
        let (mut starts, mut ends, mut far) = (Range::new(simd), Range::new(simd), Range::new(simd));
        for block in 0..N / 16 {
            let mask = group >> (16 * block) & 0xffff;
            if mask == 0 {
                continue;
            }
            let mask = mask32x16::from_bitmask(simd, mask);
            let o = rays.block(simd, &rays.o, block);
            far.add(mask, reach(o, center));
            let z = (o[kz] - center[kz]) * sign;
            starts.add(mask, z);
            ends.add(mask, z + sixteen(simd, &rays.d[kz], block).abs() * sixteen(simd, t_max, block));
        }
        let (z_start, z_end) = (starts.get().0.min(z_start), ends.get().1);
        let reach = far.get().1 + half;
        let z_length = z_end - z_start;
        // Where they are there, and their slopes
        let mut first = [Range::new(simd); 2];
        let mut last = [Range::new(simd); 2];
        let mut slopes = [Range::new(simd); 2];
        for block in 0..N / 16 {
            let mask = group >> (16 * block) & 0xffff;
            if mask == 0 {
                continue;
            }
            let mask = mask32x16::from_bitmask(simd, mask);
            let z = (sixteen(simd, &rays.o[kz], block) - center[kz]) * sign;
            let r = simd.splat_f32x16(1.0) / sixteen(simd, &rays.d[kz], block).abs();
            for (i, k) in [kx, ky].into_iter().enumerate() {
                let x = sixteen(simd, &rays.o[k], block) - center[k];
                let slope = sixteen(simd, &rays.d[k], block) * r;
                slopes[i].add(mask, slope);
                first[i].add(mask, x + slope * (-z + z_start));
                last[i].add(mask, x + slope * (-z + z_end));
            }
        }
        let mut pad = reach * BEAM_PAD;
        let line = BeamEdge { a: 0.0, b: 0.0 };
        let (mut lower, mut upper) = ([line; 2], [line; 2]);
        for i in 0..2 {
            let (slope, first, last) = (slopes[i].get(), first[i].get(), last[i].get());
            if z_length < MAX_COORDINATE && last.1 - last.0 < first.1 - first.0 {
                lower[i] = BeamEdge { a: last.0 - slope.1 * z_length, b: slope.1 };
                upper[i] = BeamEdge { a: last.1 - slope.0 * z_length, b: slope.0 };
                pad = pad.max((reach + z_length) * BEAM_PAD);
            } else {
                lower[i] = BeamEdge { a: first.0, b: slope.0 };
                upper[i] = BeamEdge { a: first.1, b: slope.1 };
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
        let kz = self.axes[2];
        let mut ends = Range::new(simd);
        for block in 0..N / 16 {
            let mask = group >> (16 * block) & 0xffff;
            if mask == 0 {
                continue;
            }
            let mask = mask32x16::from_bitmask(simd, mask);
            let z = (sixteen(simd, &rays.o[kz], block) - self.center) * self.sign + self.start;
            ends.add(mask, z + sixteen(simd, &rays.d[kz], block).abs() * sixteen(simd, t_max, block));
        }
        ends.get().1 + self.pad
    }

    /// The children of a node that the beam meets: a bit for each, and where along the beam they begin.
    #[inline(always)]
    pub fn meet<S: Simd>(&self, simd: S, node: &BoxNode, z_max: f32) -> (u32, f32x8<S>) {
        let [kx, ky, kz] = self.axes;
        assert!(kx < 3 && ky < 3 && kz < 3, "axes are axes");
        let side = self.side & 1;
        let planes = &node.planes;
        let near = f32x8::load_array_ref(simd, &planes[kz][side]);
        let far = f32x8::load_array_ref(simd, &planes[kz][side ^ 1]);
        let enter = near.mul_add(self.sign, self.start - self.pad).max(0.0);
        let leave = far.mul_add(self.sign, self.start + self.pad).min(z_max);
        let mut met = enter.simd_le(leave);
        for (i, k) in [kx, ky].into_iter().enumerate() {
            let (lower, upper) = (self.lower[i], self.upper[i]);
            let z = if lower.b >= 0.0 { enter } else { leave };
            met &= z.mul_add(lower.b, lower.a).simd_le(f32x8::load_array_ref(simd, &planes[k][1]));
            let z = if upper.b >= 0.0 { leave } else { enter };
            met &= z.mul_add(upper.b, upper.a).simd_ge(f32x8::load_array_ref(simd, &planes[k][0]));
        }
        (met.to_bitmask() as u32, enter)
    }
}
