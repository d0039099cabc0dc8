//! Meshes as scenes take them: without the vertices that no triangle uses, and with normals as surfaces need them, of
//! length 1, one at each corner of a triangle that has any, and with colours and texture coordinates that are numbers.

use super::MeshData;
use crate::math::{DVec3, UNIT_ROUNDOFF};
use crate::parallel::{self, CHUNK};

/// How far the square of a length may be from 1 where three coordinates are rounded to f32: such a normal keeps its
/// bits.
const ROUNDED: f64 = 8.0 * UNIT_ROUNDOFF as f64;
/// The largest texture coordinate, and the largest channel of a colour: those of meshes in lists.
const MAX_UV: f32 = 1e30;
const MAX_COLOR: f32 = 1e6;

impl MeshData {
    /// Takes out the vertices of no triangle and makes normals unit. Nothing that can be seen is another place; once
    /// done, doing it again changes nothing.
    pub(crate) fn tidy(&mut self) {
        self.drop_unused_vertices();
        self.make_numbers_finite();
        self.make_normals_unit();
        self.make_tangents_unit();
    }

    /// Texture coordinates and colours that are no numbers are 0 and white; all are held to what lists may have.
    pub(crate) fn make_numbers_finite(&mut self) {
        let place = |x: f32| if x.is_nan() { 0.0 } else { x.clamp(-MAX_UV, MAX_UV) };
        for set in &mut self.uvs {
            parallel::for_each_mut(set, CHUNK, |_, uv| *uv = uv.map(place));
        }
        let color = |x: f32| if x.is_nan() { 1.0 } else { x.clamp(0.0, MAX_COLOR) };
        parallel::for_each_mut(&mut self.colors, CHUNK, |_, rgba| {
            *rgba = rgba.map(color);
            rgba[3] = rgba[3].min(1.0);
        });
    }

    /// Of each vertex, whether a triangle has it. Indices may be out of range.
    pub(crate) fn used_vertices(&self) -> Vec<bool> {
        used_vertices(self.positions.len(), &self.triangles)
    }

    /// Leaves out the vertices of no triangle; the others keep their order.
    fn drop_unused_vertices(&mut self) {
        let used = self.used_vertices();
        // A mesh without triangles is points
        if self.triangles.is_empty() || used.iter().all(|used| *used) {
            return;
        }
        let mut next = 0;
        let numbers: Vec<u32> = used.iter().map(|used| (next, next += u32::from(*used)).0).collect();
        parallel::for_each_mut(&mut self.triangles, CHUNK, |_, triangle| {
            *triangle = triangle.map(|v| numbers[v as usize])
        });
        keep(&mut self.positions, &used);
        keep(&mut self.normals, &used);
        keep(&mut self.tangents, &used);
        keep(&mut self.colors, &used);
        keep(&mut self.radii, &used);
        for set in &mut self.uvs {
            keep(set, &used);
        }
    }

    /// Gives all normals the length 1. What has no direction, being of length 0 or not finite, is `[0, 0, 0]`; in a
    /// triangle that has normals at other corners, such a corner gets the facet's, on the side that those are on, and
    /// where it was shared becomes a vertex of its own, after all others.
    ///
    /// Without this, lengths would be weights where normals are blended, until a transform makes them 1.
    fn make_normals_unit(&mut self) {
        parallel::for_each_mut(&mut self.normals, CHUNK, |_, normal| *normal = unit(*normal));
        let is_none = |normal: &[f32; 3]| *normal == [0.0; 3];
        if !self.normals.iter().any(is_none) {
            return;
        }
        let old = self.normals.len() as u32;
        let mut sources: Vec<u32> = Vec::new();
        for triangle in &mut self.triangles {
            let given = triangle.map(|v| self.normals[v as usize]);
            if !given.iter().any(is_none) || given.iter().all(is_none) {
                continue;
            }
            let [a, b, c] = triangle.map(|v| DVec3::from(self.positions[v as usize].map(f64::from)));
            let facet = (b - a).cross(c - a).normalize_or_zero();
            let side = given.iter().map(|n| DVec3::from(n.map(f64::from))).sum::<DVec3>().dot(facet);
            let facet = if side < 0.0 { -facet } else { facet };
            for (vertex, _) in triangle.iter_mut().zip(given).filter(|(_, normal)| is_none(normal)) {
                let new = old + sources.len() as u32;
                sources.push(std::mem::replace(vertex, new));
                self.normals.push(facet.as_vec3().to_array());
            }
        }
        self.copy_vertices(&sources);
    }

    /// Gives all tangents the length 1 and a sign; what has no direction is 0.
    fn make_tangents_unit(&mut self) {
        parallel::for_each_mut(&mut self.tangents, CHUNK, |_, tangent| {
            let [x, y, z] = unit([tangent[0], tangent[1], tangent[2]]);
            let sign = if [x, y, z] == [0.0; 3] { 0.0 } else { 1f32.copysign(tangent[3]) };
            *tangent = [x, y, z, sign];
        });
    }

    /// Adds copies of vertices after all others, in all lists but that of the normals.
    pub(super) fn copy_vertices(&mut self, sources: &[u32]) {
        copy(&mut self.positions, sources);
        copy(&mut self.tangents, sources);
        copy(&mut self.colors, sources);
        copy(&mut self.radii, sources);
        for set in &mut self.uvs {
            copy(set, sources);
        }
    }
}

/// Of each of so many vertices, whether a triangle has it. Indices may be out of range.
pub(crate) fn used_vertices(vertices: usize, triangles: &[[u32; 3]]) -> Vec<bool> {
    let mut used = vec![false; vertices];
    for vertex in triangles.as_flattened() {
        if let Some(used) = used.get_mut(*vertex as usize) {
            *used = true;
        }
    }
    used
}

/// Keeps the entries that are used of a list per vertex.
fn keep<T: Copy>(list: &mut Vec<T>, used: &[bool]) {
    let mut used = used.iter();
    list.retain(|_| used.next().is_some_and(|used| *used));
}

/// Of length 1, or 0 where there is no direction.
fn unit(normal: [f32; 3]) -> [f32; 3] {
    let n = DVec3::from(normal.map(f64::from));
    // Squares of f32 neither overflow nor vanish in f64
    let square = n.length_squared();
    if (square - 1.0).abs() <= ROUNDED {
        return normal;
    }
    if square > 0.0 && square.is_finite() { (n / square.sqrt()).as_vec3().to_array() } else { [0.0; 3] }
}

/// Adds copies of some entries to a list per vertex that is there.
fn copy<T: Copy>(list: &mut Vec<T>, sources: &[u32]) {
    if !list.is_empty() {
        list.reserve_exact(sources.len());
        for &vertex in sources {
            list.push(list[vertex as usize]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles that share an edge, one lying, one standing.
    fn step(normals: [[f32; 3]; 4]) -> MeshData {
        MeshData {
            positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]],
            normals: normals.to_vec(),
            colors: (0..4).map(|i| [i as f32, i as f32, i as f32, 1.0]).collect(),
            triangles: vec![[0, 1, 2], [1, 0, 3]],
            ..MeshData::default()
        }
    }

    #[test]
    fn lengths_become_one_and_rounded_ones_keep_their_bits() {
        let mut random = firstlight_testkit::Random::new(5);
        for _ in 0..10_000 {
            let direction = DVec3::from(random.direction());
            let rounded = direction.as_vec3().to_array();
            assert_eq!(unit(rounded), rounded);
            let n = unit((direction * random.scale(1e-30, 1e30)).as_vec3().to_array());
            assert!((DVec3::from(n.map(f64::from)) - direction).length() < 2e-7, "{n:?} {direction}");
        }
        assert_eq!(unit([3.0, 0.0, 4.0]), [0.6, 0.0, 0.8]);
        assert_eq!(unit([1e-45, 0.0, 0.0]), [1.0, 0.0, 0.0]);
        for none in [[0.0; 3], [-0.0, 0.0, 0.0], [f32::NAN, 0.0, 1.0], [0.0, f32::INFINITY, 0.0]] {
            assert_eq!(unit(none), [0.0; 3]);
        }
    }

    #[test]
    fn a_corner_without_a_normal_gets_that_of_its_facet() {
        let up = [0.0, 0.0, 1.0];
        // Shared by both facets, which have other normals
        let mut mesh = step([[0.0; 3], [0.0, 3.0, 4.0], up, [0.0, -2.0, 0.0]]);
        mesh.tidy();
        assert_eq!(mesh.triangles, [[4, 1, 2], [1, 5, 3]]);
        assert_eq!(mesh.normals[1..], [[0.0, 0.6, 0.8], up, [0.0, -1.0, 0.0], up, [0.0, -1.0, 0.0]]);
        assert_eq!((mesh.positions[4], mesh.positions[5]), ([0.0; 3], [0.0; 3]));
        assert_eq!((mesh.colors[4], mesh.colors.len()), ([0.0, 0.0, 0.0, 1.0], 6));
        assert!(mesh.fault().is_none());
        // On the side of the others, also where the corners run the other way around
        let mut mesh = step([[f32::NAN; 3], [0.0, 0.0, -7.0], [0.0, 0.0, -1.0], [0.0; 3]]);
        mesh.tidy();
        assert_eq!(mesh.normals[4], [0.0, 0.0, -1.0]);
    }

    #[test]
    fn vertices_of_no_triangle_are_left_out_whatever_they_hold() {
        let up = [0.0, 0.0, 1.0];
        let mut mesh = step([up; 4]);
        let tidy = mesh.clone();
        mesh.tidy();
        assert_eq!(mesh, tidy);
        // One before all others, and one after
        mesh.positions.insert(0, [f32::NAN, f32::INFINITY, 0.0]);
        mesh.positions.push([1e30; 3]);
        mesh.normals.insert(0, [0.0; 3]);
        mesh.normals.push([f32::NAN; 3]);
        mesh.colors.insert(0, [300.0; 4]);
        mesh.colors.push([f32::INFINITY; 4]);
        mesh.triangles.iter_mut().flatten().for_each(|vertex| *vertex += 1);
        assert_eq!(mesh.used_bounds(), tidy.used_bounds());
        mesh.tidy();
        assert_eq!(mesh, tidy);
        // Points are not vertices of nothing
        let mut points = MeshData { triangles: Vec::new(), ..step([up; 4]) };
        points.tidy();
        assert_eq!(points.positions.len(), 4);
    }

    #[test]
    fn facets_without_any_normal_stay_without() {
        let mut mesh = step([[0.0; 3], [f32::INFINITY; 3], [0.0, 0.0, 2.0], [0.0; 3]]);
        mesh.tidy();
        assert_eq!(mesh.triangles, [[4, 5, 2], [1, 0, 3]]);
        assert_eq!((mesh.normals[0], mesh.normals[1]), ([0.0; 3], [0.0; 3]));
    }

    #[test]
    fn what_is_no_number_is_one() {
        let mut mesh = MeshData {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            uvs: vec![vec![[f32::NAN, f32::NEG_INFINITY], [f32::MAX, 0.25], [-3.0, 1e9]]],
            colors: vec![[f32::NAN, 0.5, f32::INFINITY, 1.0], [-1.0, 2.0, 0.0, 2.0], [1.0; 4]],
            ..MeshData::default()
        };
        mesh.tidy();
        assert_eq!(mesh.uvs, [[[0.0, -1e30], [1e30, 0.25], [-3.0, 1e9]]]);
        assert_eq!(mesh.colors, [[1.0, 0.5, 1e6, 1.0], [0.0, 2.0, 0.0, 1.0], [1.0; 4]]);
    }
}
