//! Vertex normals from the faces around them, kept apart at creases.
//!
//! At each position the corners of all triangles are gathered. Two that share an edge there are on one side of no
//! crease if their triangles' normals differ by at most the angle and are of one smoothing group; corners that are
//! joined so, step by step, share a normal: the sum of their triangles' unit normals, weighted by the angle at the
//! corner, so that it does not matter how polygons were cut into triangles. Sums are of f64, in the order of the
//! triangles.
//!
//! Source: G. Thürmer, C. A. Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets".

use super::MeshData;
use super::weld::weld;
use crate::math::DVec3;
use crate::parallel;

/// Edges of more triangles than this at one position are creases: comparing each with each would take too long.
const MAX_AROUND_EDGE: usize = 8;
/// Triangles or positions that one thread works on at a time.
const BLOCK: usize = 1 << 12;

impl MeshData {
    /// Replaces the normals by smooth ones: those of the faces around each vertex, except across edges where faces meet
    /// at more than `crease_deg` degrees, or are of different smoothing groups (0: never smooth), if the file has them.
    ///
    /// Vertices at creases are split; those at the same position (to the bit, -0 as 0) are smoothed together, whatever
    /// their texture coordinates. 0 or less keeps every edge of faces that differ; 180 or more smooths over all. A
    /// vertex without a triangle that has an area gets the normal `[0, 0, 0]`, all others are of length 1. New vertices
    /// follow the old ones. The result does not depend on the number of threads.
    ///
    /// The mesh is left as it is, but without normals, if it would need more than 2^32 - 2 vertices.
    pub fn smooth(&mut self, crease_deg: f64) {
        self.normals = Vec::new();
        let corners = 3 * self.triangles.len();
        if corners as u64 > super::MAX_COUNT {
            return;
        }
        let least_cosine =
            if crease_deg >= 180.0 { f64::NEG_INFINITY } else { pxfm::f_cos(crease_deg.max(0.0).to_radians()) - 1e-12 };
        // Faces, places, and the corners at each place in the order of the triangles
        let (triangles, positions) = (&self.triangles, &self.positions);
        let faces: Vec<DVec3> = parallel::map(triangles.len(), BLOCK, |i| unit_normal(positions, &triangles[i]));
        let places = weld(positions.len(), |i| {
            let [x, y, z] = positions[i].map(|x| (x + 0.0).to_bits());
            [x, y, z, 0]
        });
        let around = Around { mesh: self, faces: &faces, place: &places.vertex, least_cosine };
        let (starts, at_place) = gather(triangles, &places.vertex, places.first.len());
        // The normals at each place, and the vertices that are needed for them
        let blocks: Vec<Normals> = parallel::collect(places.first.len().div_ceil(BLOCK), |block| {
            let mut room = Room::default();
            let mut normals = Normals::default();
            for place in block * BLOCK..((block + 1) * BLOCK).min(places.first.len()) {
                let corners = &at_place[starts[place] as usize..starts[place + 1] as usize];
                around.normals(corners, &mut room, &mut normals);
            }
            normals
        });
        let old = self.positions.len();
        let count = old + blocks.iter().map(|b| b.new.len()).sum::<usize>();
        if count as u64 > super::MAX_COUNT {
            return;
        }
        // Put the normals into their places, and new vertices after the old ones
        let mut normals = vec![[0.0; 3]; old];
        let mut sources: Vec<u32> = Vec::with_capacity(count - old);
        normals.reserve_exact(count - old);
        for block in blocks {
            let base = (old + sources.len()) as u32;
            for (vertex, normal) in block.kept {
                normals[vertex as usize] = normal;
            }
            for (corner, new) in block.moved {
                self.triangles[corner as usize / 3][corner as usize % 3] = base + new;
            }
            for (vertex, normal) in block.new {
                sources.push(vertex);
                normals.push(normal);
            }
        }
        copy(&mut self.positions, &sources);
        copy(&mut self.colors, &sources);
        copy(&mut self.radii, &sources);
        for set in &mut self.uvs {
            copy(set, &sources);
        }
        self.normals = normals;
    }
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

/// Of length 1, or 0 for a triangle without area or not finite.
fn unit_normal(positions: &[[f32; 3]], triangle: &[u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|v| DVec3::from(positions[v as usize].map(f64::from)));
    let normal = (b - a).cross(c - a);
    let length = normal.length();
    // Squares of f32 differences neither overflow nor vanish in f64
    if length > 0.0 && length.is_finite() { normal / length } else { DVec3::ZERO }
}

/// For each place, its corners in order: starts of the lists, and the lists one after another.
fn gather(triangles: &[[u32; 3]], place: &[u32], places: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0u32; places + 1];
    for &vertex in triangles.as_flattened() {
        starts[place[vertex as usize] as usize + 1] += 1;
    }
    for i in 0..places {
        starts[i + 1] += starts[i];
    }
    let mut next = starts.clone();
    let mut corners = vec![0u32; 3 * triangles.len()];
    for (corner, &vertex) in triangles.as_flattened().iter().enumerate() {
        let at = &mut next[place[vertex as usize] as usize];
        corners[*at as usize] = corner as u32;
        *at += 1;
    }
    (starts, corners)
}

/// The normals of some places.
#[derive(Default)]
struct Normals {
    /// Vertices, each with its normal.
    kept: Vec<(u32, [f32; 3])>,
    /// The vertices that new ones are copies of, each with the new one's normal.
    new: Vec<(u32, [f32; 3])>,
    /// Corners, each with the number of the new vertex that it gets.
    moved: Vec<(u32, u32)>,
}

/// Room for one place at a time.
#[derive(Default)]
struct Room {
    /// Ends of edges at the place, as places, with the corner they are of.
    edges: Vec<(u32, u32)>,
    leader: Vec<u32>,
    sums: Vec<DVec3>,
    /// Vertex, leader, corner.
    uses: Vec<(u32, u32, u32)>,
}

/// What is needed to look around a place.
struct Around<'a> {
    mesh: &'a MeshData,
    faces: &'a [DVec3],
    /// Of each vertex.
    place: &'a [u32],
    least_cosine: f64,
}

impl Around<'_> {
    fn vertex(&self, corner: u32) -> u32 {
        self.mesh.triangles.as_flattened()[corner as usize]
    }

    /// Adds the normals at a place, from its corners.
    fn normals(&self, corners: &[u32], room: &mut Room, normals: &mut Normals) {
        // The edges at this place, by their other ends
        room.edges.clear();
        for (i, &corner) in corners.iter().enumerate() {
            let first = corner / 3 * 3;
            for step in [1, 2] {
                let other = self.vertex(first + (corner - first + step) % 3);
                room.edges.push((self.place[other as usize], i as u32));
            }
        }
        room.edges.sort_unstable();
        // Join the corners on both sides of each edge that is no crease
        room.leader.clear();
        room.leader.extend(0..corners.len() as u32);
        for edge in room.edges.chunk_by(|a, b| a.0 == b.0).filter(|e| e.len() <= MAX_AROUND_EDGE) {
            for (n, &(_, i)) in edge.iter().enumerate() {
                for &(_, j) in &edge[n + 1..] {
                    if self.is_smooth(corners[i as usize] / 3, corners[j as usize] / 3) {
                        unite(&mut room.leader, i, j);
                    }
                }
            }
        }
        // Sum up the normals of each group
        room.sums.clear();
        room.sums.resize(corners.len(), DVec3::ZERO);
        for (i, &corner) in corners.iter().enumerate() {
            let leader = leader_of(&mut room.leader, i as u32);
            room.sums[leader as usize] += self.faces[corner as usize / 3] * self.angle(corner);
        }
        // Each vertex keeps the normal of its first group; corners of other groups get a new vertex
        room.uses.clear();
        for (i, &corner) in corners.iter().enumerate() {
            room.uses.push((self.vertex(corner), leader_of(&mut room.leader, i as u32), corner));
        }
        room.uses.sort_unstable();
        let mut last_vertex = None;
        for group in room.uses.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let (vertex, leader, _) = group[0];
            let sum = room.sums[leader as usize];
            let length = sum.length();
            // Faces that cancel out have the normal of the first
            let first = self.faces[corners[leader as usize] as usize / 3];
            let normal = if length > 1e-9 { sum / length } else { first };
            let normal = [normal.x as f32, normal.y as f32, normal.z as f32];
            if last_vertex.replace(vertex) != Some(vertex) {
                normals.kept.push((vertex, normal));
            } else {
                let new = normals.new.len() as u32;
                normals.new.push((vertex, normal));
                normals.moved.extend(group.iter().map(|&(_, _, corner)| (corner, new)));
            }
        }
    }

    /// Whether the edge between two triangles is no crease.
    fn is_smooth(&self, one: u32, other: u32) -> bool {
        let (one, other) = (one as usize, other as usize);
        if let (Some(&a), Some(&b)) = (self.mesh.smoothing.get(one), self.mesh.smoothing.get(other))
            && (a != b || a == 0)
        {
            return false;
        }
        let (a, b) = (self.faces[one], self.faces[other]);
        a != DVec3::ZERO && b != DVec3::ZERO && a.dot(b) >= self.least_cosine
    }

    /// The angle of a triangle at a corner, in radians.
    fn angle(&self, corner: u32) -> f64 {
        let triangle = self.mesh.triangles[corner as usize / 3];
        let at = |i: u32| DVec3::from(self.mesh.positions[triangle[i as usize % 3] as usize].map(f64::from));
        let i = corner % 3;
        let (e, f) = (at(i + 1) - at(i), at(i + 2) - at(i));
        let angle = pxfm::f_atan2(e.cross(f).length(), e.dot(f));
        if angle.is_finite() { angle } else { 0.0 }
    }
}

/// The least corner of a group.
fn leader_of(leader: &mut [u32], i: u32) -> u32 {
    let mut at = i;
    while leader[at as usize] != at {
        // Halve the way for the next who asks
        leader[at as usize] = leader[leader[at as usize] as usize];
        at = leader[at as usize];
    }
    at
}

fn unite(leader: &mut [u32], i: u32, j: u32) {
    let (a, b) = (leader_of(leader, i), leader_of(leader, j));
    leader[a.max(b) as usize] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of two triangles a side; its corners are shared.
    fn cube() -> MeshData {
        let positions = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|b| b as f32)).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        MeshData { positions, triangles, ..MeshData::default() }
    }

    #[test]
    fn a_cube_is_flat_below_and_round_above_90_degrees() {
        let mut flat = cube();
        flat.smooth(89.0);
        assert_eq!((flat.positions.len(), flat.normals.len()), (24, 24));
        for t in &flat.triangles {
            let normal = unit_normal(&flat.positions, t).as_vec3().to_array();
            assert!(t.iter().all(|&v| flat.normals[v as usize] == normal));
        }
        let mut round = cube();
        round.smooth(91.0);
        assert_eq!(round.positions.len(), 8);
        for (p, n) in round.positions.iter().zip(&round.normals) {
            // However the squares are cut, all three sides count the same
            let third = 1.0 / 3f32.sqrt();
            for axis in 0..3 {
                assert!((n[axis] - third * (2.0 * p[axis] - 1.0)).abs() < 1e-6, "{p:?} {n:?}");
            }
        }
        assert!(flat.fault().is_none() && round.fault().is_none());
    }

    #[test]
    fn smoothing_groups_are_honoured() {
        let mut mesh = cube();
        mesh.smoothing = (0..12).map(|t| t / 2).collect();
        mesh.smooth(180.0);
        // Group 0 is never smooth: its two triangles share nothing
        assert_eq!(mesh.positions.len(), 26);
        mesh = cube();
        mesh.smoothing = vec![7; 12];
        mesh.smooth(180.0);
        assert_eq!(mesh.positions.len(), 8);
    }

    #[test]
    fn seams_are_smoothed_over_and_attributes_copied() {
        // A roof of two quads that share positions but no vertices
        let positions = vec![
            [-1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 1.0, 1.0],
            [0.0, 1.0, -0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 1.0],
        ];
        let mut mesh = MeshData {
            positions,
            uvs: vec![(0..6).map(|i| [i as f32; 2]).collect()],
            triangles: vec![[0, 2, 1], [3, 5, 4]],
            ..MeshData::default()
        };
        mesh.smooth(100.0);
        assert_eq!(mesh.positions.len(), 6);
        assert_eq!(mesh.normals[1], mesh.normals[3]);
        assert_eq!(mesh.normals[2], mesh.normals[5]);
        assert!(mesh.normals[1][0].abs() < 1e-6 && mesh.normals[1][1] > 0.99, "{:?}", mesh.normals);
        assert!(mesh.normals[0] != mesh.normals[4]);
    }

    #[test]
    fn hubs_degenerate_and_infinite_triangles_take_no_time_and_do_no_harm() {
        let count = 200_000u32;
        let mut positions: Vec<[f32; 3]> = (0..count).map(|i| [i as f32, (i * 7 % 11) as f32, 1.0]).collect();
        positions.extend([[f32::NAN; 3], [f32::INFINITY; 3], [f32::MAX; 3], [f32::MIN_POSITIVE; 3]]);
        let mut triangles: Vec<[u32; 3]> = (1..count - 1).map(|i| [0, i, i + 1]).collect();
        triangles.extend((0..count).map(|i| [0, 1, i]));
        triangles.extend([[0, 0, 0], [count, 1, 2], [count + 1, count + 2, 3], [count + 3, 4, 5]]);
        let mut mesh = MeshData { positions, triangles, ..MeshData::default() };
        mesh.smooth(30.0);
        assert!(mesh.fault().is_none());
        for n in &mesh.normals {
            let length = n.iter().map(|x| x * x).sum::<f32>();
            assert!(length == 0.0 || (length - 1.0).abs() < 1e-5, "{n:?}");
        }
    }
}
