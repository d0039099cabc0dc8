//! Batches of sixteen points: the layout of points and of a light's coordinates in SIMD lanes.
//!
//! Points are stored one after the other, their coordinates of a flat light in blocks of sixteen; a batch gathers
//! its lanes from any blocks. All operations are per lane, so no result depends on the other members of a batch.

use arrayvec::ArrayVec;
use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::light_frame::{FlatLight, LightFrame, NEAR};
use crate::material::{LobeKind, LobeLanes, ShadingPoint};
use crate::math::{DVec3, LANES, UNIT_ROUNDOFF, Vec3, Vec3x16};

/// One number of each of sixteen members.
pub(crate) type LaneNumbers = [f32; LANES];

/// A number of a flat light's coordinates; see [`LightFrame`].
#[derive(Clone, Copy, Debug)]
pub(crate) enum FrameNumber {
    /// The point.
    Px,
    Py,
    Pz,
    /// l = l0 + x a + y b.
    L0x,
    L0y,
    L0z,
    Ax,
    Ay,
    Az,
    Bx,
    By,
    Bz,
    Fa,
    La,
    Skew,
    Fb,
    Lb,
    Height,
    /// Distance of the point in front of an emitting side, in metres; infinite if both sides emit.
    Facing,
    /// The viewer's direction reflected at the shading normal, or 0.
    MirrorX,
    MirrorY,
    MirrorZ,
    /// Cosines to the shading normal, the horizon's normal and the viewer, times |l|: linear over the light.
    CosC,
    CosX,
    CosY,
    HorizonC,
    HorizonX,
    HorizonY,
    OutC,
    OutX,
    OutY,
    CosO,
    /// The exponent of the lobe.
    LobeNumber0,
    LobeNumber1,
    /// alpha of the shadowing by bumps.
    Bump,
    /// The first and last x and y of the light's square.
    X0,
    X1,
    Y0,
    Y1,
    /// The origin of x and y, from the light's middle.
    OriginX,
    OriginY,
    Ratio,
    Behind2,
    Measure,
}

const NUMBERS: usize = FrameNumber::Measure as usize + 1;

/// Coordinates of a flat light from sixteen points.
#[derive(Clone, Debug)]
pub(crate) struct LightFrame16([LaneNumbers; NUMBERS]);

impl Default for LightFrame16 {
    fn default() -> Self {
        LightFrame16([[0.0; LANES]; NUMBERS])
    }
}

impl LightFrame16 {
    /// Stores the coordinates from one point in a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, point: &ShadingPoint, v: &LightFrame) {
        let (p, l0, a, b) = (point.p, v.l0, v.a, v.b);
        let (mirror, lobe) = (v.mirror().unwrap_or_default(), point.bsdf.lobe.numbers());
        #[rustfmt::skip]
        let numbers: [f32; NUMBERS] = [
            p.x, p.y, p.z, l0.x, l0.y, l0.z, a.x, a.y, a.z, b.x, b.y, b.z,
            v.fa, v.la, v.skew, v.fb, v.lb, v.height, v.facing, mirror.x, mirror.y, mirror.z,
            v.cos.c, v.cos.x, v.cos.y, v.horizon.c, v.horizon.x, v.horizon.y, v.out.c, v.out.x, v.out.y, v.cos_o,
            lobe[0], lobe[1], point.bump_shadowing.alpha,
            v.x[0], v.x[1], v.y[0], v.y[1], v.origin[0], v.origin[1],
            v.ratio, v.behind2, v.measure,
        ];
        for (block, number) in self.0.iter_mut().zip(numbers) {
            block[lane] = number;
        }
    }
}

impl LightFrame16 {
    /// Computes the coordinates from up to sixteen points, as [`LightFrame::new`] does. Returns, as bits, the points
    /// that are so close that their origin must be the nearest place: those lanes are not valid. To be called within
    /// `vectorize`.
    #[inline(always)]
    pub fn project<S: Simd>(&mut self, simd: S, light: &FlatLight, points: &[ShadingPoint]) -> u64 {
        use FrameNumber::*;
        let splat = |v: f32| simd.splat_f32x16(v);
        let p = point_vectors(simd, points, |point| point.p);
        let error = point_vectors(simd, points, |point| point.error.0);
        let horizon = point_vectors(simd, points, |point| point.horizon);
        let ns = point_vectors(simd, points, |point| point.ns);
        let wo = point_vectors(simd, points, |point| point.wo);
        // Lanes without a point have the lobe of the last: of one exponent for all, powers are faster
        for lane in 0..LANES {
            let numbers = points[lane.min(points.len() - 1)].bsdf.lobe.numbers();
            [self.0[LobeNumber0 as usize][lane], self.0[LobeNumber1 as usize][lane]] = numbers;
        }
        self.0[Bump as usize] = point_numbers(simd, points, |point| point.bump_shadowing.alpha).to_array();
        let [a, b, n] = [light.a, light.b, light.n].map(|v| Vec3x16::splat(simd, v));
        let l0 = Exact::new(light.c).seen_from(simd, p);
        let side = -n.dot(l0);
        let (fa, fb) = (Vec3x16::splat(simd, light.ua).dot(l0), Vec3x16::splat(simd, light.ub).dot(l0));
        // As `way_error`
        let half = Vec3x16::splat(simd, light.a.abs() + light.b.abs());
        let middle = Vec3x16::splat(simd, light.c.as_vec3());
        let (far, way) = (middle.abs() + half, (middle - p).abs() + half);
        let slack = error + (far + way * splat(4.0)) * splat(UNIT_ROUNDOFF);
        let cos_o = ns.dot(wo);
        let mirror = ns * (cos_o * 2.0) - wo;
        let length = mirror.dot(mirror).sqrt();
        let is_long = length.simd_gt(0.5);
        let mirror = mirror * is_long.select(1.0 / length, splat(0.0));
        let facing = if light.both_sides { splat(f32::INFINITY) } else { side };
        let line = |v: Vec3x16<S>| [v.dot(l0), v.dot(a), v.dot(b)];
        let (cos, out) = (line(ns), line(wo));
        let mut above = line(horizon);
        above[0] -= horizon.abs().dot(slack);
        let [zero, one] = [splat(0.0), splat(1.0)];
        // One store for each: a list of them would be copied first
        macro_rules! put {
            ($($numbers:expr => $values:expr;)*) => {$(
                let (numbers, [x, y, z]) = ($numbers, $values);
                self.0[numbers[0] as usize] = x.to_array();
                self.0[numbers[1] as usize] = y.to_array();
                self.0[numbers[2] as usize] = z.to_array();
            )*};
        }
        put! {
            [Px, Py, Pz] => [p.x, p.y, p.z];
            [L0x, L0y, L0z] => [l0.x, l0.y, l0.z];
            [Ax, Ay, Az] => [a.x, a.y, a.z];
            [Bx, By, Bz] => [b.x, b.y, b.z];
            [Fa, Fb, Height] => [fa, fb, side.abs()];
            [La, Lb, Skew] => [splat(light.la), splat(light.lb), splat(light.skew)];
            [MirrorX, MirrorY, MirrorZ] => [mirror.x, mirror.y, mirror.z];
            [CosC, CosX, CosY] => cos;
            [HorizonC, HorizonX, HorizonY] => above;
            [OutC, OutX, OutY] => out;
            [X0, Y0, CosO] => [-one, -one, cos_o];
            [X1, Y1, Facing] => [one, one, facing];
            [OriginX, OriginY, Measure] => [zero, zero, splat(light.measure())];
            [Ratio, Behind2, Behind2] => [splat(light.ratio), splat(light.behind2), splat(light.behind2)];
        }
        self.nearest(simd).simd_lt(NEAR * light.la.max(light.lb)).to_bitmask()
    }

    /// Lower bound of the distance to the light's square, in metres.
    #[inline(always)]
    pub fn nearest<S: Simd>(&self, simd: S) -> f32x16<S> {
        use FrameNumber::*;
        let [x0, x1] = [self.lanes(simd, X0), self.lanes(simd, X1)];
        let [y0, y1] = [self.lanes(simd, Y0), self.lanes(simd, Y1)];
        let (fa, la, fb, lb) = (self.lanes(simd, Fa), self.lanes(simd, La), self.lanes(simd, Fb), self.lanes(simd, Lb));
        let (lean, height) = (self.lanes(simd, Skew).abs() * y1.max(-y0), self.lanes(simd, Height));
        let zero = simd.splat_f32x16(0.0);
        let gap_x = (fa - (lean - la * x0)).max(-fa - (la * x1 + lean)).max(zero);
        let gap_y = (fb + lb * y0).max(-fb - lb * y1).max(zero);
        (gap_x * gap_x + gap_y * gap_y + height * height).sqrt()
    }

    /// The first and last x and y of the square in one lane.
    pub fn square(&self, lane: usize) -> [[f32; 2]; 2] {
        use FrameNumber::*;
        [[X0, X1], [Y0, Y1]].map(|sides| sides.map(|of| self.0[of as usize][lane]))
    }
}

/// Numbers of sixteen members, each member in a lane.
pub(crate) trait LaneBlock {
    fn numbers(&self) -> &[LaneNumbers];
}

impl LaneBlock for LightFrame16 {
    #[inline(always)]
    fn numbers(&self) -> &[LaneNumbers] {
        &self.0
    }
}

/// Where the members of a batch are stored: their blocks, and their lanes in them.
pub(crate) struct Members<'a, B> {
    /// The blocks, each with the members whose lanes are in it as bits, in order.
    runs: ArrayVec<(&'a B, u64), LANES>,
    /// The byte indices of each member's number in its block.
    bytes: [u8; LANES * size_of::<f32>()],
    /// Whether the members are the first lanes of one block, so that nothing has to be gathered.
    in_line: bool,
}

impl<'a, B: LaneBlock> Members<'a, B> {
    /// `count` members with these indices, counted through all blocks; lanes beyond them repeat the last.
    #[inline(always)]
    pub fn new(blocks: &'a [B], count: usize, number: impl Fn(usize) -> u32) -> Self {
        let numbers: [usize; LANES] = std::array::from_fn(|k| number(k.min(count - 1)) as usize);
        let mut in_line = numbers[0].is_multiple_of(LANES);
        let (mut runs, mut last) = (ArrayVec::<(&B, u64), LANES>::new(), usize::MAX);
        let mut bytes = [[0; size_of::<f32>()]; LANES];
        for (k, n) in numbers.iter().enumerate() {
            in_line &= *n == numbers[0] + k || k >= count;
            bytes[k] = std::array::from_fn(|byte| (n % LANES * size_of::<f32>() + byte) as u8);
            if n / LANES != last {
                last = n / LANES;
                runs.push((&blocks[last], 0));
            }
            if let Some((_, bits)) = runs.last_mut() {
                *bits |= 1 << k;
            }
        }
        Members { runs, bytes: *bytes.as_flattened().as_array().expect("four bytes for each"), in_line }
    }

    /// One number of each member.
    #[inline(always)]
    pub fn number<S: Simd>(&self, simd: S, of: usize) -> f32x16<S> {
        let of_block = |block: &B| f32x16::simd_from(simd, block.numbers()[of]);
        let first = of_block(self.runs[0].0);
        if self.in_line {
            return first;
        }
        let mut numbers = first.swizzle_dyn(self.bytes);
        for (block, bits) in &self.runs[1..] {
            numbers = mask32x16::from_bitmask(simd, *bits).select(of_block(block).swizzle_dyn(self.bytes), numbers);
        }
        numbers
    }
}

/// Coordinates of a flat light from sixteen points, number by number: of one block, or gathered by a batch.
pub(crate) trait FrameLanes {
    /// One number of each point.
    fn lanes<S: Simd>(&self, simd: S, of: FrameNumber) -> f32x16<S>;

    /// Three numbers of each point, as vectors.
    #[inline(always)]
    fn vectors<S: Simd>(&self, simd: S, [x, y, z]: [FrameNumber; 3]) -> Vec3x16<S> {
        Vec3x16 { x: self.lanes(simd, x), y: self.lanes(simd, y), z: self.lanes(simd, z) }
    }

    /// A quantity that is linear over the light, of each point.
    #[inline(always)]
    fn linear<S: Simd>(&self, simd: S, [c, x, y]: [FrameNumber; 3]) -> Linear16<S> {
        Linear16 { c: self.lanes(simd, c), x: self.lanes(simd, x), y: self.lanes(simd, y) }
    }
}

impl Members<'_, LightFrame16> {
    /// The lobes of the members, which are of one kind.
    #[inline(always)]
    pub fn lobes<S: Simd>(&self, simd: S, kind: Option<LobeKind>) -> LobeLanes {
        use FrameNumber::*;
        LobeLanes::new(kind, [LobeNumber0, LobeNumber1].map(|number| self.lanes(simd, number).to_array()))
    }
}

impl FrameLanes for Members<'_, LightFrame16> {
    #[inline(always)]
    fn lanes<S: Simd>(&self, simd: S, of: FrameNumber) -> f32x16<S> {
        self.number(simd, of as usize)
    }
}

impl FrameLanes for LightFrame16 {
    #[inline(always)]
    fn lanes<S: Simd>(&self, simd: S, of: FrameNumber) -> f32x16<S> {
        f32x16::simd_from(simd, self.0[of as usize])
    }
}

/// c + x X + y Y in lanes: a quantity that is linear over a light.
#[derive(Clone, Copy)]
pub(crate) struct Linear16<S: Simd> {
    pub c: f32x16<S>,
    pub x: f32x16<S>,
    pub y: f32x16<S>,
}

impl<S: Simd> Linear16<S> {
    /// The dot product of `v` with the vector to a place of the light.
    #[inline(always)]
    pub fn along(v: Vec3x16<S>, l: &[Vec3x16<S>; 3]) -> Self {
        Linear16 { c: v.dot(l[0]), x: v.dot(l[1]), y: v.dot(l[2]) }
    }

    /// `factor` times the quantity, plus `more`.
    #[inline(always)]
    pub fn times(&self, factor: f32, more: f32) -> Self {
        Linear16 { c: self.c * factor + more, x: self.x * factor, y: self.y * factor }
    }

    #[inline(always)]
    pub fn at(&self, x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
        self.c + x * self.x + y * self.y
    }
}

/// A vector of doubles as the sum of two of floats, so that the difference to a close point has no cancellation error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Exact {
    high: Vec3,
    low: Vec3,
}

impl Exact {
    pub fn new(v: DVec3) -> Exact {
        let high = v.as_vec3();
        Exact { high, low: (v - high.as_dvec3()).as_vec3() }
    }

    /// The vectors from sixteen points to it.
    #[inline(always)]
    pub fn seen_from<S: Simd>(self, simd: S, p: Vec3x16<S>) -> Vec3x16<S> {
        let (h, l) = (Vec3x16::splat(simd, self.high), Vec3x16::splat(simd, self.low));
        Vec3x16 { x: (h.x - p.x) + l.x, y: (h.y - p.y) + l.y, z: (h.z - p.z) + l.z }
    }
}

/// The vectors l0, a, b of l = l0 + x a + y b.
#[inline(always)]
pub(crate) fn light_vectors<S: Simd>(simd: S, frames: &impl FrameLanes) -> [Vec3x16<S>; 3] {
    use FrameNumber::*;
    // Written out, here and below: a map of an array is not inlined, and each operation becomes a call
    [frames.vectors(simd, [L0x, L0y, L0z]), frames.vectors(simd, [Ax, Ay, Az]), frames.vectors(simd, [Bx, By, Bz])]
}

/// One number of each of up to sixteen points, in lanes; 0 in lanes without a point.
#[inline(always)]
pub(crate) fn point_numbers<S: Simd>(
    simd: S,
    points: &[ShadingPoint],
    number: impl Fn(&ShadingPoint) -> f32,
) -> f32x16<S> {
    let mut numbers = [0.0; LANES];
    for (lane, point) in numbers.iter_mut().zip(points) {
        *lane = number(point);
    }
    f32x16::simd_from(simd, numbers)
}

/// One vector of each of up to sixteen points, in lanes; 0 in lanes without a point.
#[inline(always)]
pub(crate) fn point_vectors<S: Simd>(
    simd: S,
    points: &[ShadingPoint],
    vector: impl Fn(&ShadingPoint) -> Vec3,
) -> Vec3x16<S> {
    Vec3x16 {
        x: point_numbers(simd, points, |point| vector(point).x),
        y: point_numbers(simd, points, |point| vector(point).y),
        z: point_numbers(simd, points, |point| vector(point).z),
    }
}
