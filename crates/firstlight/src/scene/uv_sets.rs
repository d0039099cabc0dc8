//! Texture coordinates of a hit in the sets that textures name.

use super::geometry::{At, Geometry, Hit, Placed, PlacedSpot, PlacedTarget};
use crate::math::Ray;
use crate::shape::{RayDifferential, SurfaceInteraction, TexturePoint};

impl Geometry {
    /// Finds the texture coordinates and footprints of a hit of the sets in `sets`, bits.
    #[inline(never)]
    pub fn find_texture_points(
        &self,
        si: &mut SurfaceInteraction,
        ray: &Ray,
        hit: &Hit,
        differential: &RayDifferential,
        sets: u8,
    ) {
        let (mesh, placement, point) = match hit.at {
            At::World(point) => (self.world.as_ref().map(|world| &*world.mesh), None, point),
            At::Placed(index, PlacedSpot::Triangle(point)) => {
                let Placed { placement, target, .. } = &self.placed[index as usize];
                let PlacedTarget::Mesh(mesh) = *target else { unreachable!("only meshes have triangles") };
                (Some(&*self.meshes[mesh as usize]), Some(placement), point)
            }
            _ => {
                // All else has set 0 alone
                si.uv_sets[0] = TexturePoint { uv: si.uv, dx: si.footprint.dx, dy: si.footprint.dy };
                return;
            }
        };
        let Some(mesh) = mesh else { return };
        for (set, at) in (0..).zip(&mut si.uv_sets).filter(|(set, _)| sets >> set & 1 == 1) {
            *at = mesh.texture_point(placement, point, ray, hit.t, differential, set);
        }
    }
}
