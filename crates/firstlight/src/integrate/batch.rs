//! Batches of sixteen: how points, and what they see of a light, lie in lanes.
//!
//! Points are kept one after the other, what they see of a flat light in blocks of sixteen; a batch takes its lanes
//! from wherever its members lie. Lanes work element by element, so no number depends on who shares a batch.

use fearless_simd::{f32x16, prelude::*};

use super::view::View;
use crate::color::Rgb;
use crate::material::Colors;
use crate::math::{ErrorBound, Facet, LANES, Vec3, Vec3x16};

/// Sixteen numbers, one of each member of a batch.
pub(crate) type Block = [f32; LANES];

/// What lighting needs to know of a surface at one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadingPoint {
    /// World space, and how sure we are of it.
    pub p: Vec3,
    pub error: ErrorBound,
    /// Light from below the plane with this normal does not count.
    pub horizon: Vec3,
    /// Geometric normal, to the viewer's side, and the facet that the point was lifted off.
    pub ng: Vec3,
    pub facet: Facet,
    /// Shading normal.
    pub ns: Vec3,
    /// To the viewer.
    pub wo: Vec3,
    /// How far what it stands for reaches from it, in metres, and how far normals turn on the way, in radians; 0 for a
    /// point alone.
    pub reach: f32,
    pub turn: f32,
    /// What one unit of each moment is worth: linear colours, the light's scale included.
    pub worth: Colors,
    /// What is there beside this light, at least.
    pub base: Rgb,
    /// The share of a pixel that it stands for.
    pub share: f32,
}

impl ShadingPoint {
    /// A point by itself that stands for a pixel, of a surface with this unit normal on the viewer's side; colours are
    /// still to come.
    pub fn new(p: Vec3, error: ErrorBound, n: Vec3, wo: Vec3) -> ShadingPoint {
        ShadingPoint {
            p,
            error,
            horizon: n,
            ng: n,
            facet: Facet::NONE,
            ns: n,
            wo,
            reach: 0.0,
            turn: 0.0,
            worth: Colors::BLACK,
            base: Rgb::BLACK,
            share: 1.0,
        }
    }
}

/// One number of what a point sees of a flat light; see [`View`].
#[derive(Clone, Copy, Debug)]
pub(crate) enum ViewNumber {
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
    /// Heights over the surface's two horizons, and the cosine to the viewer, times |l|: linear over the light.
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
    /// The light's square.
    X0,
    X1,
    Y0,
    Y1,
    /// Where places are counted from, from the light's middle.
    OriginX,
    OriginY,
    Ratio,
    Behind2,
    Measure,
}

const NUMBERS: usize = ViewNumber::Measure as usize + 1;

/// What sixteen points see of a flat light.
#[derive(Clone, Debug)]
pub(crate) struct ViewBlock([Block; NUMBERS]);

impl Default for ViewBlock {
    fn default() -> Self {
        ViewBlock([[0.0; LANES]; NUMBERS])
    }
}

impl ViewBlock {
    /// Puts what one point sees into a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, p: Vec3, v: &View) {
        let (l0, a, b) = (v.l0, v.a, v.b);
        #[rustfmt::skip]
        let numbers: [f32; NUMBERS] = [
            p.x, p.y, p.z, l0.x, l0.y, l0.z, a.x, a.y, a.z, b.x, b.y, b.z,
            v.fa, v.la, v.skew, v.fb, v.lb, v.height,
            v.cos.c, v.cos.x, v.cos.y, v.horizon.c, v.horizon.x, v.horizon.y, v.out.c, v.out.x, v.out.y, v.cos_o,
            v.x[0], v.x[1], v.y[0], v.y[1], v.origin[0], v.origin[1],
            v.ratio, v.behind2, v.measure,
        ];
        for (block, number) in self.0.iter_mut().zip(numbers) {
            block[lane] = number;
        }
    }
}

/// Where the members of a batch lie: their blocks, and their lanes in them.
pub(crate) struct Members<'a> {
    blocks: [&'a ViewBlock; LANES],
    lanes: [usize; LANES],
}

impl<'a> Members<'a> {
    /// The points of these numbers, counted through all blocks.
    #[inline(always)]
    pub fn new(blocks: &'a [ViewBlock], numbers: impl Fn(usize) -> u32) -> Self {
        let numbers: [u32; LANES] = std::array::from_fn(numbers);
        Members { blocks: numbers.map(|n| &blocks[n as usize / LANES]), lanes: numbers.map(|n| n as usize % LANES) }
    }

    /// One number of each.
    #[inline(always)]
    pub fn lanes<S: Simd>(&self, simd: S, of: ViewNumber) -> f32x16<S> {
        let one = |k: usize| self.blocks[k].0[of as usize][self.lanes[k] % LANES];
        f32x16::simd_from(simd, std::array::from_fn(one))
    }

    /// Three numbers of each, as vectors.
    #[inline(always)]
    pub fn vectors<S: Simd>(&self, simd: S, [x, y, z]: [ViewNumber; 3]) -> Vec3x16<S> {
        Vec3x16 { x: self.lanes(simd, x), y: self.lanes(simd, y), z: self.lanes(simd, z) }
    }

    /// A quantity that changes linearly over the light, of each.
    #[inline(always)]
    pub fn linear<S: Simd>(&self, simd: S, [c, x, y]: [ViewNumber; 3]) -> Linear16<S> {
        Linear16 { c: self.lanes(simd, c), x: self.lanes(simd, x), y: self.lanes(simd, y) }
    }
}

/// c + x X + y Y in lanes: quantities that change linearly over a light.
#[derive(Clone, Copy)]
pub(crate) struct Linear16<S: Simd> {
    pub c: f32x16<S>,
    pub x: f32x16<S>,
    pub y: f32x16<S>,
}

impl<S: Simd> Linear16<S> {
    /// The product of the way to a place of the light with `v`.
    #[inline(always)]
    pub fn along(v: Vec3x16<S>, l: &[Vec3x16<S>; 3]) -> Self {
        Linear16 { c: v.dot(l[0]), x: v.dot(l[1]), y: v.dot(l[2]) }
    }

    /// `factor` times it, and `more`.
    #[inline(always)]
    pub fn times(&self, factor: f32, more: f32) -> Self {
        Linear16 { c: self.c * factor + more, x: self.x * factor, y: self.y * factor }
    }

    #[inline(always)]
    pub fn at(&self, x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
        self.c + x * self.x + y * self.y
    }
}
