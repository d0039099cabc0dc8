//! What the project's own benchmark of rays asks of the library's insides. Not for others: it changes without notice.

use fearless_simd::{Level, Simd};

use crate::accel::{Aabb, Bvh, RayPacket16, RayTile, TraceRay, dispatch_eight};
use crate::math::Vec3;
use crate::shape::{TileHits, TriangleTree, every};

/// Origin and direction of a ray.
pub type RayBits = [f32; 6];

/// Where a ray ended: the distance, infinite if nowhere, and the triangle.
pub type HitBits = (f32, u32);

const MISS: HitBits = (f32::INFINITY, u32::MAX);

#[inline(always)]
fn parts(ray: &RayBits) -> (Vec3, Vec3) {
    (Vec3::new(ray[0], ray[1], ray[2]), Vec3::new(ray[3], ray[4], ray[5]))
}

/// A mesh with its tree.
pub struct Mesh(TriangleTree);

impl Mesh {
    /// Builds the tree.
    pub fn build(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
        Mesh(TriangleTree::build(positions, triangles))
    }

    /// Memory of the tree, in bytes.
    pub fn bytes(&self) -> usize {
        self.0.bytes()
    }

    /// The closest hits, ray by ray.
    pub fn closest(&self, rays: &[RayBits], hits: &mut [HitBits]) {
        dispatch_eight!(Level::new(), simd => self.closest_simd(simd, rays, hits));
    }

    #[inline(always)]
    fn closest_simd<S: Simd>(&self, simd: S, rays: &[RayBits], hits: &mut [HitBits]) {
        for (ray, hit) in rays.iter().zip(hits) {
            let (o, d) = parts(ray);
            let found = self.0.closest(simd, &TraceRay::new(o, d), f32::INFINITY, &|_| true);
            *hit = found.map_or(MISS, |found| (found.t, found.triangle));
        }
    }

    /// Whether anything is between the ends of the rays, ray by ray.
    pub fn any(&self, rays: &[RayBits], t_max: f32, hidden: &mut [bool]) {
        dispatch_eight!(Level::new(), simd => self.any_simd(simd, rays, t_max, hidden));
    }

    #[inline(always)]
    fn any_simd<S: Simd>(&self, simd: S, rays: &[RayBits], t_max: f32, hidden: &mut [bool]) {
        for (ray, hidden) in rays.iter().zip(hidden) {
            let (o, d) = parts(ray);
            *hidden = self.0.any(simd, &TraceRay::new(o, d), t_max, &|_| true);
        }
    }

    /// The closest hits, 64 rays at once.
    pub fn tiles(&self, rays: &[RayBits], hits: &mut [HitBits]) {
        for (rays, hits) in rays.chunks(64).zip(hits.chunks_mut(64)) {
            self.tile(rays, hits);
        }
    }

    fn tile(&self, rays: &[RayBits], hits: &mut [HitBits]) {
        let mut tile = RayTile::ZERO;
        for (place, ray) in rays.iter().enumerate() {
            let (o, d) = parts(ray);
            tile.set(place, o, d);
        }
        let mut found = TileHits::new(f32::INFINITY);
        self.0.tile_at(Level::new(), &tile, u64::MAX, 0, &mut found, &every);
        for (place, hit) in hits.iter_mut().enumerate() {
            *hit = found.get(place).map_or(MISS, |found| (found.t, found.triangle));
        }
    }

    /// Whether anything is between the ends of the rays, 16 rays at once.
    pub fn packets(&self, rays: &[RayBits], t_max: f32, hidden: &mut [bool]) {
        for (rays, hidden) in rays.chunks(16).zip(hidden.chunks_mut(16)) {
            self.packet(rays, t_max, hidden);
        }
    }

    fn packet(&self, rays: &[RayBits], t_max: f32, hidden: &mut [bool]) {
        let mut packet = RayPacket16::ZERO;
        for (place, ray) in rays.iter().enumerate() {
            let (o, d) = parts(ray);
            packet.set(place, o, d);
        }
        let mask = self.0.any16_at(Level::new(), &packet, &[t_max; 16], 0xffff, &every);
        for (place, hidden) in hidden.iter_mut().enumerate() {
            *hidden = mask >> place & 1 == 1;
        }
    }
}

/// Many copies of one mesh: moved, not turned.
pub struct Instances<'a> {
    mesh: &'a Mesh,
    offsets: &'a [[f32; 3]],
    bvh: Bvh,
}

impl<'a> Instances<'a> {
    /// Builds the tree over the copies.
    pub fn build(mesh: &'a Mesh, offsets: &'a [[f32; 3]]) -> Self {
        let Aabb { min, max } = mesh.0.bounds();
        let boxes: Vec<_> = offsets
            .iter()
            .map(|offset| {
                let offset = Vec3::from_array(*offset);
                Aabb { min: min + offset, max: max + offset }
            })
            .collect();
        Instances { mesh, offsets, bvh: Bvh::build(&boxes) }
    }

    /// The closest hits, ray by ray.
    pub fn closest(&self, rays: &[RayBits], hits: &mut [HitBits]) {
        dispatch_eight!(Level::new(), simd => self.closest_simd(simd, rays, hits));
    }

    #[inline(always)]
    fn closest_simd<S: Simd>(&self, simd: S, rays: &[RayBits], hits: &mut [HitBits]) {
        for (ray, hit) in rays.iter().zip(hits) {
            let (o, d) = parts(ray);
            let (mut t_max, mut best) = (f32::INFINITY, MISS);
            self.bvh.closest(simd, &TraceRay::new(o, d), &mut t_max, |instance, t_max| {
                let o = o - Vec3::from_array(self.offsets[instance as usize]);
                if let Some(found) = self.mesh.0.closest(simd, &TraceRay::new(o, d), *t_max, &|_| true) {
                    *t_max = found.t;
                    best = (found.t, found.triangle);
                }
            });
            *hit = best;
        }
    }

    /// Whether anything is between the ends of the rays, ray by ray.
    pub fn any(&self, rays: &[RayBits], t_max: f32, hidden: &mut [bool]) {
        dispatch_eight!(Level::new(), simd => self.any_simd(simd, rays, t_max, hidden));
    }

    #[inline(always)]
    fn any_simd<S: Simd>(&self, simd: S, rays: &[RayBits], t_max: f32, hidden: &mut [bool]) {
        for (ray, hidden) in rays.iter().zip(hidden) {
            let (o, d) = parts(ray);
            *hidden = self.bvh.any(simd, &TraceRay::new(o, d), t_max, |instance| {
                let o = o - Vec3::from_array(self.offsets[instance as usize]);
                self.mesh.0.any(simd, &TraceRay::new(o, d), t_max, &|_| true)
            });
        }
    }
}
