//! Tangents of meshes for normal maps: those that a file gives, and MikkTSpace where it gives none.
//!
//! MikkTSpace (Mikkelsen, "Simulation of wrinkled surfaces revisited", master's thesis, University of Copenhagen,
//! 2008), which tools that make normal maps count from, on triangles that share no vertices.

use std::iter;

use bevy_mikktspace::{Geometry, Ops, TangentSpace, generate_tangents};

use super::surface::{Mesh, TrianglePoint, blended};
use crate::math::{DVec3, Ray, Vec3};
use crate::shape::placement::Placement;
use crate::shape::surface::{NormalFrame, RayDifferential};

/// The tangent of each corner of a triangle: x, y, z, unit, and the sign of the direction of v, which is that times
/// normal x tangent.
pub(crate) type CornerTangents = [[f32; 4]; 3];

/// Triangles with texture coordinates, as MikkTSpace reads them.
struct Unwelded<'a> {
    positions: &'a [[f32; 3]],
    triangles: &'a [[u32; 3]],
    normals: &'a [[f32; 3]],
    uvs: &'a [[f32; 2]],
    tangents: Vec<CornerTangents>,
}

/// The functions that differ between systems: the project's own.
struct SameBits;

impl Ops for SameBits {
    fn sqrt(x: f32) -> f32 {
        x.sqrt()
    }

    fn acos(x: f32) -> f32 {
        pxfm::f_acos(f64::from(x)) as f32
    }
}

/// What is no number counts as 0: rays do not hit triangles that have it.
fn finite<const N: usize>(v: [f32; N]) -> [f32; N] {
    v.map(|c| if c.is_finite() { c } else { 0.0 })
}

impl Geometry<SameBits> for Unwelded<'_> {
    fn num_faces(&self) -> usize {
        self.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vert: usize) -> [f32; 3] {
        finite(self.positions[self.triangles[face][vert] as usize])
    }

    fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
        if !self.normals.is_empty() {
            return finite(self.normals[self.triangles[face][vert] as usize]);
        }
        let [a, b, c] = [0, 1, 2].map(|vert| Vec3::from(self.position(face, vert)).as_dvec3());
        (b - a).cross(c - a).normalize_or(DVec3::Y).as_vec3().into()
    }

    fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
        finite(self.uvs[self.triangles[face][vert] as usize])
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, vert: usize) {
        if let Some(space) = space {
            self.tangents[face][vert] = space.tangent_encoded();
        }
    }
}

/// The tangents of triangles with texture coordinates: those that the mesh gives for all three corners, else those of
/// MikkTSpace.
pub(super) fn of_corners(
    given: &[[f32; 4]],
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    normals: &[[f32; 3]],
    uvs: &[[f32; 2]],
) -> Vec<CornerTangents> {
    let given_of = |triangle: &[u32; 3]| {
        let of = triangle.map(|v| given.get(v as usize).copied().unwrap_or_default());
        of.iter().all(|tangent| tangent[3] != 0.0).then_some(of)
    };
    let given: Vec<Option<CornerTangents>> = triangles.iter().map(given_of).collect();
    if given.iter().all(Option::is_some) {
        return given.into_iter().flatten().collect();
    }
    let found = mikktspace(positions, triangles, normals, uvs);
    let found = found.into_iter().chain(iter::repeat(CornerTangents::default()));
    given.into_iter().zip(found).map(|(given, found)| given.unwrap_or(found)).collect()
}

/// The tangents of MikkTSpace; 0 where uv has no direction. Without normals each triangle has its own.
fn mikktspace(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    normals: &[[f32; 3]],
    uvs: &[[f32; 2]],
) -> Vec<CornerTangents> {
    let tangents = vec![CornerTangents::default(); triangles.len()];
    let mut unwelded = Unwelded { positions, triangles, normals, uvs, tangents };
    match generate_tangents::<_, SameBits>(&mut unwelded) {
        Ok(()) => unwelded.tangents,
        Err(_) => Vec::new(),
    }
}

impl Mesh {
    /// What a normal map that is laid by a set of texture coordinates counts from at a point: the tangents of the
    /// corners, blended, or how the point moves with u where there are none. `None` where u has no direction.
    pub fn normal_frame(
        &self,
        placement: Option<&Placement>,
        at: TrianglePoint,
        set: Option<u8>,
    ) -> Option<NormalFrame> {
        let (normal, of_corners) = self.normals(placement, at);
        let front = of_corners.unwrap_or(normal);
        let dp = self.tangents(placement, at.triangle, set);
        let part = self.part(at.triangle);
        let tangents = part.named_set(set).map_or(&part.tangents, |named| &named.tangents);
        let stored = tangents.get((at.triangle - part.first_triangle) as usize);
        self.stored_frame(placement, at, stored, front, dp).or_else(|| NormalFrame::new(front, dp))
    }

    /// How the unit normal changes from a point that `ray` met at `t` with each step: as it does within the triangle.
    pub fn normal_steps(
        &self,
        placement: Option<&Placement>,
        at: TrianglePoint,
        ray: &Ray,
        t: f64,
        differential: &RayDifferential,
    ) -> [Vec3; 2] {
        let (normal, of_corners) = self.normals(placement, at);
        let Some(shading) = of_corners else { return [Vec3::ZERO; 2] };
        let [a, b, c] = self.corners(at.triangle);
        let to_world = |e: DVec3| placement.map_or(e, |at| at.world_from_object.transform_vector3(e));
        let (w1, w2) = (to_world(b - a), to_world(c - a));
        // The dual basis of the edges: steps on the surface as steps of the weights
        let cross = w1.cross(w2);
        let area2 = cross.length_squared();
        let (u_axis, v_axis) = (w2.cross(cross) / area2, cross.cross(w1) / area2);
        let corners = self.triangles[at.triangle as usize].map(|i| {
            let n = Vec3::from(self.normals[i as usize]).as_dvec3();
            placement.map_or(n, |at| at.normal(n))
        });
        let blend = blended(corners, at);
        differential.on_plane(ray.d, t as f32, normal.as_vec3(), f32::MAX.sqrt() * 0.5).map(|dp| {
            let (du, dv) = (dp.as_dvec3().dot(u_axis), dp.as_dvec3().dot(v_axis));
            let moved = blend + (corners[1] - corners[0]) * du + (corners[2] - corners[0]) * dv;
            let moved = moved.normalize_or_zero();
            if moved.is_finite() && moved != DVec3::ZERO { (moved - shading).as_vec3() } else { Vec3::ZERO }
        })
    }

    fn stored_frame(
        &self,
        placement: Option<&Placement>,
        at: TrianglePoint,
        stored: Option<&CornerTangents>,
        front: DVec3,
        dp: [DVec3; 2],
    ) -> Option<NormalFrame> {
        let corners = stored?;
        let t = blended(corners.map(|[x, y, z, _]| Vec3::new(x, y, z).as_dvec3()), at);
        let n = if self.normals.is_empty() {
            let facet = self.face_normal(at.triangle).normalize_or_zero();
            if self.is_turned(at.triangle) { -facet } else { facet }
        } else {
            blended(self.triangles[at.triangle as usize].map(|i| Vec3::from(self.normals[i as usize]).as_dvec3()), at)
        };
        // Of a mirrored part all corners have one sign
        let b = n.cross(t) * f64::from(corners[0][3]);
        let to_world = |v: DVec3| placement.map_or(v, |at| at.normal(v));
        // Slopes count for a normal of length 1
        let scale = 1.0 / to_world(n).length();
        let [t, b, n] = [t, b, n].map(|v| to_world(v) * scale);
        let is_right = n.is_finite() && t.is_finite() && t != DVec3::ZERO && n.dot(front) > 0.0;
        is_right.then_some(NormalFrame { t, b, n, dp })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn given_tangents_replace_found_ones_where_all_corners_have_one() {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        let (triangles, normals) = ([[0, 1, 2], [2, 1, 3]], [[0.0, 0.0, 1.0]; 4]);
        let uvs = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let of = |given: &[[f32; 4]]| of_corners(given, &positions, &triangles, &normals, &uvs);
        let (found, other) = ([1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, -1.0]);
        assert_eq!(of(&[]), [[found; 3]; 2]);
        assert_eq!(of(&[other; 4]), [[other; 3]; 2]);
        assert_eq!(of(&[other, other, other, [0.0; 4]]), [[other; 3], [found; 3]]);
    }
}
