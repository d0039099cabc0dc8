//! Triangle meshes, ready to be hit: what the tree of triangles does not need to know.

use glam::DVec2;

use super::tangents::CornerTangents;
use crate::color::Rgb;
use crate::ids::MaterialId;
use crate::math::{DVec3, ErrorBound, Ray, UNIT_ROUNDOFF, Vec2, Vec3};
use crate::shape::TriangleTree;
use crate::shape::placement::Placement;
use crate::shape::surface::{Footprint, RayDifferential, ShadowTerminator, ShapePoint, TexturePoint, UvEdge};
use crate::shape::triangles::{can_be_hit, is_in_plane};

/// The meshes of one space, the world or that of a group, joined: one tree for all their triangles.
pub(crate) struct Mesh {
    pub positions: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// Unit, one for each position; empty if no part has any. The normals of parts without are zero.
    pub normals: Vec<[f32; 3]>,
    /// One for each position; empty if no part has any.
    pub uvs: Vec<[f32; 2]>,
    /// Linear Rec. 709 and alpha, one for each position; empty if no part has any. Those of parts without are white and
    /// opaque.
    pub colors: Vec<[f32; 4]>,
    /// The meshes it was joined from, in scene order, by their first triangle.
    pub parts: Vec<JoinedPart>,
    pub tree: TriangleTree,
}

/// One mesh of several that were joined.
#[derive(Clone, Debug)]
pub(crate) struct JoinedPart {
    /// Its first triangle; it ends where the next begins.
    pub first_triangle: u32,
    /// Its first vertex.
    pub first_vertex: u32,
    /// Its surface, counted from that of the group it lies in.
    pub surface: u32,
    /// The material of each triangle, as an index of `materials`; empty where there is one for all.
    pub face_materials: Vec<u32>,
    /// What `face_materials` chooses from; the first is that of all where it is empty.
    pub materials: Vec<MaterialId>,
    /// The number of each triangle in its mesh, where that has others too; empty where it has them all.
    pub numbers: Vec<u32>,
    /// Whether it has texture coordinates of its own.
    pub has_uvs: bool,
    /// Of each triangle, where a normal map is on it; empty where none is.
    pub tangents: Vec<CornerTangents>,
    /// The sets of texture coordinates, other than the one that the mesh chooses, that textures on it name.
    pub uv_sets: Vec<NamedUvSet>,
}

/// A set of texture coordinates that textures of a mesh name.
#[derive(Clone, Debug)]
pub(crate) struct NamedUvSet {
    /// Its number in the mesh, counted from 0.
    pub number: u8,
    /// For each vertex of the part.
    pub uvs: Vec<[f32; 2]>,
    /// Of each triangle, where a normal map is laid by the set; empty where none is.
    pub tangents: Vec<CornerTangents>,
}

impl JoinedPart {
    /// The number of a triangle of the joined mesh in its own.
    pub fn number(&self, triangle: u32) -> u32 {
        let own = triangle - self.first_triangle;
        self.numbers.get(own as usize).copied().unwrap_or(own)
    }

    /// A set of texture coordinates, if it is not the one that the mesh chooses.
    #[inline(always)]
    pub fn named_set(&self, set: Option<u8>) -> Option<&NamedUvSet> {
        let number = set?;
        self.uv_sets.iter().find(|set| set.number == number)
    }

    /// The material of a triangle of the joined mesh.
    pub fn material(&self, triangle: u32) -> MaterialId {
        let index = self.face_materials.get((triangle - self.first_triangle) as usize).copied().unwrap_or(0);
        self.materials[index as usize]
    }
}

/// A point of a triangle: the weights of its second and third corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TrianglePoint {
    pub triangle: u32,
    pub u: f32,
    pub v: f32,
}

/// How much each corner of a triangle counts.
#[inline(always)]
fn weights(at: TrianglePoint) -> [f64; 3] {
    let (u, v) = (at.u as f64, at.v as f64);
    [1.0 - u - v, u, v]
}

/// What lies between what the corners have.
#[inline(always)]
pub(super) fn blended(corners: [DVec3; 3], at: TrianglePoint) -> DVec3 {
    let weights = weights(at);
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

/// Whether a list, if there is one, has the same for all corners of a triangle.
fn is_one<const N: usize>(list: &[[f32; N]], [a, b, c]: [usize; 3]) -> bool {
    list.is_empty() || list[a] == list[b] && list[b] == list[c]
}

impl Mesh {
    /// The alpha of the vertices at a point, 0 to 1; 1 where they have none.
    pub fn alpha(&self, at: TrianglePoint) -> f32 {
        if self.colors.is_empty() {
            return 1.0;
        }
        let [a, b, c] = self.triangles[at.triangle as usize].map(|i| f64::from(self.colors[i as usize][3]));
        let weights = weights(at);
        ((a * weights[0] + b * weights[1] + c * weights[2]) as f32).clamp(0.0, 1.0)
    }

    /// The texture coordinate of a set at a point; `None`: the set that the mesh chooses.
    pub fn uv(&self, at: TrianglePoint, set: Option<u8>) -> Vec2 {
        let corners = self.corner_uvs(at.triangle, set);
        let (f1, f2) = (corners[1] - corners[0], corners[2] - corners[0]);
        (corners[0] + f1 * f64::from(at.u) + f2 * f64::from(at.v)).as_vec2()
    }

    /// Bytes in memory, without the tree.
    pub fn bytes(&self) -> usize {
        let lists = size_of_val(self.positions.as_slice())
            + size_of_val(self.triangles.as_slice())
            + size_of_val(self.normals.as_slice())
            + size_of_val(self.uvs.as_slice())
            + size_of_val(self.colors.as_slice());
        let of_set = |set: &NamedUvSet| size_of_val(set.uvs.as_slice()) + size_of_val(set.tangents.as_slice());
        let of_part = |part: &JoinedPart| {
            let sets = part.uv_sets.iter().map(of_set).sum::<usize>();
            size_of_val(part.face_materials.as_slice()) + size_of_val(part.tangents.as_slice()) + sets
        };
        lists + self.parts.iter().map(of_part).sum::<usize>()
    }

    /// The box around all triangles that can be hit; `None` if there are none.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let bounds = self.tree.bounds();
        (self.tree.len() > 0).then(|| [bounds.min.as_dvec3(), bounds.max.as_dvec3()])
    }

    /// Whether a ray can hit a triangle: it has an area, and all of it is somewhere.
    pub fn is_hit(&self, triangle: &[u32; 3]) -> bool {
        can_be_hit(&self.positions, triangle)
    }

    /// Whether a ray of the mesh's space meets a triangle from behind.
    pub fn is_behind(&self, triangle: u32, d: Vec3) -> bool {
        (self.face_normal(triangle).dot(d.as_dvec3()) > 0.0) != self.is_turned(triangle)
    }

    /// Whether its normals say that the front of a triangle is the other side than the order of its corners says.
    pub fn is_turned(&self, triangle: u32) -> bool {
        let normals = self.triangles[triangle as usize].map(|i| self.normals.get(i as usize).copied());
        let own = normals.into_iter().flatten().map(|n| Vec3::from(n).as_dvec3()).sum::<DVec3>();
        own.dot(self.face_normal(triangle)) < 0.0
    }

    /// Whether all of a triangle has one normal, which is its own, and one colour.
    pub fn is_flat(&self, triangle: u32) -> bool {
        let [a, b, c] = self.triangles[triangle as usize].map(|i| i as usize);
        let is_own = || {
            let n = Vec3::from(self.normals[a]).as_dvec3().normalize_or_zero();
            let own = self.face_normal(triangle).normalize_or_zero();
            n == DVec3::ZERO || (n * n.dot(own).signum() - own).abs().max_element() <= SAME_NORMAL
        };
        is_one(&self.normals, [a, b, c]) && is_one(&self.colors, [a, b, c]) && (self.normals.is_empty() || is_own())
    }

    /// The part that a triangle belongs to.
    #[inline]
    pub fn part(&self, triangle: u32) -> &JoinedPart {
        &self.parts[self.part_index(triangle)]
    }

    /// The same, as an index of `parts`.
    #[inline]
    pub fn part_index(&self, triangle: u32) -> usize {
        self.parts.partition_point(|part| part.first_triangle <= triangle) - 1
    }

    #[inline(always)]
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|i| Vec3::from(self.positions[i as usize]).as_dvec3())
    }

    /// Whether a shadow ray that starts at `o` starts in the plane of a triangle; see [`is_in_plane`].
    pub fn is_in_plane(&self, triangle: u32, o: Vec3, error: DVec3) -> bool {
        is_in_plane(self.corners(triangle), o.as_dvec3(), error)
    }

    /// The normal of a triangle's front, by the order of its corners; of any length.
    #[inline(always)]
    pub fn face_normal(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }

    /// The unit normals of the front: of the facet, and the blended one of the corners, if there is one. Those of the
    /// corners decide which side is the front.
    #[inline(always)]
    pub fn normals(&self, placement: Option<&Placement>, at: TrianglePoint) -> (DVec3, Option<DVec3>) {
        let to_world = |n: DVec3| placement.map_or(n, |at| at.normal(n)).normalize_or_zero();
        let corners = self.corners(at.triangle);
        let normal = to_world((corners[1] - corners[0]).cross(corners[2] - corners[0]));
        if self.normals.is_empty() {
            return (normal, None);
        }
        let of_corner = |i: u32| Vec3::from(self.normals[i as usize]).as_dvec3();
        let shading = to_world(blended(self.triangles[at.triangle as usize].map(of_corner), at));
        if shading == DVec3::ZERO {
            return (normal, None);
        }
        (if shading.dot(normal) < 0.0 { -normal } else { normal }, Some(shading))
    }

    /// What `ray`, which met the mesh at `t`, sees there.
    ///
    /// The point is found from the weights of the corners, so that it lies on the triangle however far the ray came.
    pub fn point(
        &self,
        placement: Option<&Placement>,
        at: TrianglePoint,
        ray: &Ray,
        t: f64,
        differential: &RayDifferential,
        terminator: ShadowTerminator,
    ) -> ShapePoint {
        let corners = self.corners(at.triangle);
        let weights = weights(at);
        let own = blended(corners, at);
        let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
        // The tree's rays start and end in single precision, in the mesh's own space: a point there is wrong by this
        let largest = corners[0].abs().max(corners[1].abs()).max(corners[2].abs());
        // along any axis: what rounds along one moves the crossing along the ray, and so along the others. A floor at
        // height 0 is as wrong as it is wide
        let rounding = DVec3::splat((largest + e1.abs() + e2.abs()).max_element() * (4.0 * UNIT_ROUNDOFF as f64));
        // To the world
        let (p, terms, rounding, w1, w2) = match placement {
            None => (own, largest, rounding, e1, e2),
            Some(at) => {
                let m = &at.world_from_object;
                let (w1, w2) = (m.transform_vector3(e1), m.transform_vector3(e2));
                (m.transform_point3(own), at.terms(largest), at.reach(rounding), w1, w2)
            }
        };
        let (normal, of_corners) = self.normals(placement, at);
        let rounded = p.as_vec3();
        let ErrorBound(base) = ErrorBound::of_rounded(rounded, terms);
        let error = ErrorBound(base + rounding.as_vec3());
        let shading = of_corners.unwrap_or(normal);
        let mut lifted = None;
        if of_corners.is_some() && terminator == ShadowTerminator::Smooth {
            // From the viewer's side, which is decided as the viewer decides it
            let side = if normal.as_vec3().dot(-ray.d) < 0.0 { -1.0 } else { 1.0 };
            let round = RoundCorners {
                corners: corners.map(|q| placement.map_or(q, |at| at.world_from_object.transform_point3(q))),
                normals: self.triangles[at.triangle as usize].map(|i| {
                    let n = Vec3::from(self.normals[i as usize]).as_dvec3();
                    placement.map_or(n, |at| at.normal(n)).normalize_or_zero() * side
                }),
                weights,
            };
            lifted = round.lift(p, normal * side).map(|p| p.as_vec3());
        }
        let TexturePoint { uv, dx, dy } =
            place_on_texture(self.corner_uvs(at.triangle, None), at, [w1, w2], normal, ray, t, differential);
        let color = if self.colors.is_empty() {
            Rgb::WHITE
        } else {
            let of_corner = |i: u32| {
                let [r, g, b, _] = self.colors[i as usize];
                Vec3::new(r, g, b).as_dvec3()
            };
            let c = blended(self.triangles[at.triangle as usize].map(of_corner), at);
            Rgb::new(c.x as f32, c.y as f32, c.z as f32)
        };
        let alpha = self.alpha(at);
        ShapePoint {
            p: rounded,
            error,
            normal: normal.as_vec3(),
            shading: shading.as_vec3(),
            lifted,
            uv,
            footprint: Footprint { dx, dy, edges: [UvEdge::Unbounded; 2] },
            color,
            alpha,
        }
    }

    /// The place on textures that are laid by a set, of the point that `ray` met at `t`: as [`point`](Self::point) has
    /// it of the set that the mesh chooses.
    pub fn texture_point(
        &self,
        placement: Option<&Placement>,
        at: TrianglePoint,
        ray: &Ray,
        t: f64,
        differential: &RayDifferential,
        set: u8,
    ) -> TexturePoint {
        let edges = self.edges(placement, at.triangle);
        let (normal, _) = self.normals(placement, at);
        place_on_texture(self.corner_uvs(at.triangle, Some(set)), at, edges, normal, ray, t, differential)
    }

    /// The edges of a triangle from its first corner, in world space.
    fn edges(&self, placement: Option<&Placement>, triangle: u32) -> [DVec3; 2] {
        let [a, b, c] = self.corners(triangle);
        [b - a, c - a].map(|e| match placement {
            None => e,
            Some(at) => at.world_from_object.transform_vector3(e),
        })
    }

    /// How a point of a triangle moves with u and with v of a set; the edges where uv has no direction.
    pub fn tangents(&self, placement: Option<&Placement>, triangle: u32, set: Option<u8>) -> [DVec3; 2] {
        let [e1, e2] = self.edges(placement, triangle);
        let [a, b, c] = self.corner_uvs(triangle, set);
        let (f1, f2) = (b - a, c - a);
        let det = f1.perp_dot(f2);
        if det != 0.0 { [(e1 * f2.y - e2 * f1.y) / det, (e2 * f1.x - e1 * f2.x) / det] } else { [e1, e2] }
    }

    /// The texture coordinates of a set of a triangle's corners; `None`: of the set that the mesh chooses. The weights
    /// themselves where there are none.
    #[inline(always)]
    fn corner_uvs(&self, triangle: u32, set: Option<u8>) -> [DVec2; 3] {
        let part = self.part(triangle);
        if let Some(NamedUvSet { uvs, .. }) = part.named_set(set) {
            self.triangles[triangle as usize].map(|i| Vec2::from(uvs[(i - part.first_vertex) as usize]).as_dvec2())
        } else if part.has_uvs {
            self.triangles[triangle as usize].map(|i| Vec2::from(self.uvs[i as usize]).as_dvec2())
        } else {
            [DVec2::ZERO, DVec2::X, DVec2::Y]
        }
    }
}

/// The place on a texture of a point of a triangle, from the texture coordinates of its corners, its edges and its
/// normal in world space.
#[inline(always)]
fn place_on_texture(
    corner_uvs: [DVec2; 3],
    at: TrianglePoint,
    [w1, w2]: [DVec3; 2],
    normal: DVec3,
    ray: &Ray,
    t: f64,
    differential: &RayDifferential,
) -> TexturePoint {
    let (f1, f2) = (corner_uvs[1] - corner_uvs[0], corner_uvs[2] - corner_uvs[0]);
    let uv = corner_uvs[0] + f1 * f64::from(at.u) + f2 * f64::from(at.v);
    let [dx, dy] = match differential.is_zero() {
        true => [Vec2::ZERO; 2],
        false => {
            // The dual basis of the edges turns steps on the surface into steps of the weights, and those of uv
            let cross = w1.cross(w2);
            let area2 = cross.length_squared();
            let (u_axis, v_axis) = (w2.cross(cross) / area2, cross.cross(w1) / area2);
            let steps = differential.on_plane(ray.d, t as f32, normal.as_vec3(), f32::MAX.sqrt() * 0.5);
            steps.map(|dp| {
                let dp = dp.as_dvec3();
                let step = f1 * dp.dot(u_axis) + f2 * dp.dot(v_axis);
                if step.is_finite() { step.as_vec2() } else { Vec2::ZERO }
            })
        }
    };
    TexturePoint { uv: uv.as_vec2(), dx, dy }
}

/// A facet that stands for something round, in world space: its corners, the normals there on the viewer's side, and
/// the weights of a point.
struct RoundCorners {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
    weights: [f64; 3],
}

impl RoundCorners {
    /// The point `p` of the facet, lifted to a round surface through its corners: towards the planes through the
    /// corners, across their normals, as far as it lies below them, by the weights. `None` where it is not lifted: on
    /// flat facets, and on those with a normal that points below the facet, whose normal is `ng`; they have their own
    /// horizon.
    ///
    /// d_i = min(0, (p - v_i).n_i), p' = p - sum b_i d_i n_i.
    /// Source: Hanika, "Hacking the shadow terminator", Ray Tracing Gems II, chapter 4, 2021.
    fn lift(&self, p: DVec3, ng: DVec3) -> Option<DVec3> {
        let is_flat = self.normals.iter().all(|n| (*n - ng).abs().max_element() <= SAME_NORMAL);
        if is_flat || !self.normals.iter().all(|n| n.dot(ng) > 0.0) {
            return None;
        }
        let mut lifted = p;
        for ((v, n), weight) in self.corners.iter().zip(self.normals).zip(self.weights) {
            let below = (p - *v).dot(n).min(0.0);
            lifted -= n * (weight * below);
        }
        Some(lifted)
    }
}

/// Normals that differ by no more along each axis are the same but for their rounding to f32 and that of the corners.
const SAME_NORMAL: f64 = 1e-6;
