//! Rays as the tree and the triangles want them, one at a time and many.

use fearless_simd::{Simd, f32x16};

use super::beam::axes;
use crate::math::Vec3;

/// A ray of any length of direction, with all that does not depend on what it meets.
///
/// A ray that is not valid meets nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TraceRay {
    /// Origin. `t` counts in lengths of the direction, which may be of any.
    pub o: Vec3,
    #[cfg(test)]
    pub d: Vec3,
    /// The reciprocal of the direction for slabs: components that are nothing beside the largest are made larger.
    pub rd: Vec3,
    /// The axes kx, ky, kz of the triangle test: kz is the one along which the direction is largest.
    pub axes: [usize; 3],
    /// Sx, Sy, Sz of the triangle test.
    pub shear: [f32; 3],
    /// Whether it can meet anything: neither NaN nor out of all proportion, and the direction is not zero.
    pub is_valid: bool,
}

/// A component of the direction smaller than this, against the largest, does not leave a padded slab before the ray has
/// left everything else; its reciprocal is taken as if it were this, which keeps all numbers finite.
pub(super) const SMALLEST: f32 = 1.0 / (1u64 << 32) as f32;

/// Origins farther out than this, about 10^15, and directions whose largest component is not between these, about
/// 10^-12 and 10^18, meet nothing: beyond, products could overflow.
pub(super) const MAX_COORDINATE: f32 = (1u64 << 50) as f32;
pub(super) const MIN_DIRECTION: f32 = 1.0 / (1u64 << 40) as f32;
pub(super) const MAX_DIRECTION: f32 = (1u64 << 60) as f32;

impl TraceRay {
    #[inline(always)]
    pub fn new(o: Vec3, d: Vec3) -> Self {
        let size = d.abs();
        let kz = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let [kx, ky, _] = axes(kz);
        let d3 = d.to_array();
        let largest = size.max_element();
        let least = largest * SMALLEST;
        let reciprocal = |d: f32| 1.0 / if d.abs() < least { least.copysign(d) } else { d };
        let rd = Vec3::new(reciprocal(d.x), reciprocal(d.y), reciprocal(d.z));
        let is_valid = o.abs().cmple(Vec3::splat(MAX_COORDINATE)).all() && size.cmple(Vec3::splat(MAX_DIRECTION)).all();
        TraceRay {
            o,
            #[cfg(test)]
            d,
            rd,
            axes: [kx, ky, kz],
            shear: [d3[kx] / d3[kz], d3[ky] / d3[kz], 1.0 / d3[kz]],
            is_valid: is_valid && largest >= MIN_DIRECTION,
        }
    }
}

/// By how much boxes are padded, as parts of the largest distance between the ray's origin and anything in the tree.
///
/// A hit is one only if the ray meets the triangle's own box, padded by `OWN_PAD`, and is not nearer than that box. A
/// node is left out only if the ray misses its box, padded by `NODE_PAD`, or the best hit is nearer. Both use the same
/// reciprocal direction, so the two tests differ by rounding alone: six roundings of at most 2^-24 each on either side,
/// of numbers no larger than twice that distance (Ize 2013, "Robust BVH ray traversal"). The pads differ by 2^-20 of
/// it, which is more: **the tree can never change an answer**. `OWN_PAD` in its turn is larger than what the triangle
/// test's own rounding can let in beside the triangle: half a dozen roundings of 2^-24.
pub(crate) const OWN_PAD: f32 = 1.0 / (1 << 20) as f32;
pub(crate) const NODE_PAD: f32 = 2.0 * OWN_PAD;
/// Of the hull of many rays, which has roundings of its own: slopes, and the places where the rays enter.
pub(crate) const BEAM_PAD: f32 = 4.0 * OWN_PAD;

/// A ray as one tree sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slabs {
    /// The reciprocal direction.
    pub rd: [f32; 3],
    /// Added to a near plane times `rd`.
    pub near: [f32; 3],
    /// Added to a far plane times `rd`.
    pub far: [f32; 3],
    /// Which planes are near: the low ones, 0, or the high ones, 1.
    pub side: [usize; 3],
    /// [`OWN_PAD`], by axis, in units of t.
    pub own: [f32; 3],
}

impl Slabs {
    /// Of a tree around `center` that reaches `half` from it.
    #[inline(always)]
    pub fn new(ray: &TraceRay, center: Vec3, half: f32) -> Self {
        let o = ray.o - center;
        let reach = o.abs().max_element() + half;
        let rd = ray.rd;
        let pad = rd.abs() * (reach * NODE_PAD);
        let to = -o * rd;
        Slabs {
            rd: rd.to_array(),
            near: (to - pad).to_array(),
            far: (to + pad).to_array(),
            side: [usize::from(rd.x < 0.0), usize::from(rd.y < 0.0), usize::from(rd.z < 0.0)],
            own: (rd.abs() * (reach * OWN_PAD)).to_array(),
        }
    }
}

/// `N` rays, coordinate by coordinate, with directions of any length.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct Rays<const N: usize> {
    /// Origins.
    pub o: [[f32; N]; 3],
    /// Directions.
    pub d: [[f32; N]; 3],
}

/// Sixteen rays, for shadows: from one point, or towards one.
pub(crate) type RayPacket16 = Rays<16>;

/// The rays of a tile of up to 8 x 8 pixels. Best in blocks of 4 x 4, each of sixteen rays after each other.
pub(crate) type RayTile = Rays<64>;

impl<const N: usize> Rays<N> {
    pub const ZERO: Self = Rays { o: [[0.0; N]; 3], d: [[0.0; N]; 3] };

    /// The rays that `change` makes of these.
    #[inline(always)]
    pub fn map(&self, change: impl Fn(Vec3, Vec3) -> [Vec3; 2]) -> Self {
        let mut all = Self::ZERO;
        for place in 0..N {
            let [o, d] = change(self.o(place), self.d(place));
            all.set(place, o, d);
        }
        all
    }

    /// Puts a ray into a place.
    #[inline(always)]
    pub fn set(&mut self, place: usize, o: Vec3, d: Vec3) {
        for axis in 0..3 {
            self.o[axis][place] = o[axis];
            self.d[axis][place] = d[axis];
        }
    }

    #[inline(always)]
    pub fn o(&self, place: usize) -> Vec3 {
        Vec3::new(self.o[0][place], self.o[1][place], self.o[2][place])
    }

    #[inline(always)]
    pub fn d(&self, place: usize) -> Vec3 {
        Vec3::new(self.d[0][place], self.d[1][place], self.d[2][place])
    }

    #[inline(always)]
    pub fn ray(&self, place: usize) -> TraceRay {
        TraceRay::new(self.o(place), self.d(place))
    }
}

/// Sixteen rays with one largest axis, ready for triangles: what [`TraceRay`] and [`Slabs`] hold, operation by
/// operation.
#[derive(Clone, Copy)]
pub(crate) struct RayLanes<S: Simd> {
    /// Origins along kx, ky, kz.
    pub o: [f32x16<S>; 3],
    /// Sx, Sy, Sz.
    pub shear: [f32x16<S>; 3],
    /// The reciprocal direction along kx, ky, kz.
    pub rd: [f32x16<S>; 3],
    /// [`OWN_PAD`] along kx, ky, kz, in units of t.
    pub own: [f32x16<S>; 3],
}

/// Sixteen rays with one largest axis, ready for boxes: what [`Slabs`] holds, but the planes are low and high ones.
#[derive(Clone, Copy)]
pub(crate) struct LaneSlabs<S: Simd> {
    /// The reciprocal direction along kx, ky, kz.
    pub rd: [f32x16<S>; 3],
    /// Added to a low plane times `rd`.
    pub lo: [f32x16<S>; 3],
    /// Added to a high plane times `rd`.
    pub hi: [f32x16<S>; 3],
    /// As far as each ray asks.
    pub t_max: f32x16<S>,
}
