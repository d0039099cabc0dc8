//! Where rays meet triangles: one ray, a packet of sixteen, a tile of sixty-four.

use super::NONE;
use crate::math::LANES;

/// Where a ray meets a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TriangleHit {
    /// In lengths of the ray's direction.
    pub t: f32,
    /// The weight of the triangle's second vertex.
    pub u: f32,
    /// The weight of the triangle's third vertex.
    pub v: f32,
    /// The triangle's number in the mesh.
    pub triangle: u32,
}

/// Where rays of a packet meet a triangle.
pub(crate) struct PacketHits {
    /// The triangle's number in the mesh.
    pub triangle: u32,
    /// The rays that do, as bits.
    pub lanes: u64,
    /// As in [`TriangleHit`], of those rays.
    pub t: [f32; LANES],
    pub u: [f32; LANES],
    pub v: [f32; LANES],
}

impl PacketHits {
    /// Of one ray alone.
    #[inline(always)]
    pub(super) fn one(hit: TriangleHit, lane: usize) -> PacketHits {
        let TriangleHit { t, u, v, triangle } = hit;
        PacketHits { triangle, lanes: 1 << lane, t: [t; LANES], u: [u; LANES], v: [v; LANES] }
    }
}

/// Where the rays of a tile meet anything, as far as is known.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct TileHits {
    /// As far as each ray asks: the nearest hit so far.
    pub t: [f32; 64],
    pub u: [f32; 64],
    pub v: [f32; 64],
    /// What the caller said when the mesh was asked. Of hits at the same t the lowest surface wins, then the lowest
    /// triangle.
    pub surface: [u32; 64],
    pub triangle: [u32; 64],
}

impl TileHits {
    /// Nothing hit yet, and hits up to and including `t_max` count.
    pub fn new(t_max: f32) -> Self {
        TileHits { t: [t_max; 64], u: [0.0; 64], v: [0.0; 64], surface: [u32::MAX; 64], triangle: [NONE; 64] }
    }

    /// What a ray hit, if anything.
    pub fn get(&self, place: usize) -> Option<TriangleHit> {
        let triangle = self.triangle[place];
        let hit = TriangleHit { t: self.t[place], u: self.u[place], v: self.v[place], triangle };
        (triangle != NONE).then_some(hit)
    }

    /// Takes a hit if it is better than what there is.
    #[inline(always)]
    pub(super) fn offer(&mut self, place: usize, hit: &TriangleHit, surface: u32) -> bool {
        let old = (self.surface[place], self.triangle[place]);
        let better = hit.t < self.t[place] || hit.t == self.t[place] && (surface, hit.triangle) < old;
        if better {
            (self.t[place], self.u[place], self.v[place]) = (hit.t, hit.u, hit.v);
            (self.surface[place], self.triangle[place]) = (surface, hit.triangle);
        }
        better
    }
}
