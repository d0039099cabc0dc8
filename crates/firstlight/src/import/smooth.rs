//! Vertex normals from the faces around them, kept apart at creases.
//!
//! At each position the corners of all triangles are gathered. Two that share an edge there are on one side of no
//! crease if their triangles' normals differ by at most the angle and are of one smoothing group; corners that are
//! joined so, step by step, share a normal: the sum of their triangles' unit normals, weighted by the angle at the
//! corner, so that it does not matter how polygons were cut into triangles. Sums are of f64, in the order of the
//! triangles.
//!
//! Triangles that are turned against their neighbours count with the side that most of their patch has ([`turned`]):
//! two halves of a smooth surface would be a crease otherwise, or cancel out. Few meshes have such triangles, and only
//! the places can tell; so all is done as if there were none, and once more where a place has met one.
//!
//! Source: G. Thürmer, C. A. Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets".

use super::MeshData;
use super::turned::turned;
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
    /// Triangles that are turned against their neighbours get normals on the side of most of those that they are joined
    /// with, by edges of two; the order of their corners stays.
    ///
    /// The mesh is left as it is, but without normals, if it would need more than 2^32 - 2 vertices.
    pub fn smooth(&mut self, crease_deg: f64) {
        self.normals = Vec::new();
        // They belong to the normals that are replaced
        self.tangents = Vec::new();
        let corners = 3 * self.triangles.len();
        if corners as u64 > super::MAX_COUNT {
            return;
        }
        let least_cosine =
            if crease_deg >= 180.0 { f64::NEG_INFINITY } else { pxfm::f_cos(crease_deg.max(0.0).to_radians()) - 1e-12 };
        // Faces, places, and the corners at each place in the order of the triangles
        let (triangles, positions) = (&self.triangles, &self.positions);
        let mut faces: Vec<DVec3> = parallel::map(triangles.len(), BLOCK, |i| unit_normal(positions, &triangles[i]));
        let places = weld(positions.len(), |i| {
            let [x, y, z] = positions[i].map(|x| (x + 0.0).to_bits());
            [x, y, z, 0]
        });
        let (starts, at_place) = gather(triangles, &places.vertex, places.first.len());
        // The normals at each place, and the vertices that are needed for them
        let look = |faces: &[DVec3]| {
            let around = Around { mesh: self, faces, place: &places.vertex, least_cosine };
            parallel::collect(places.first.len().div_ceil(BLOCK), |block| {
                let mut room = Room::default();
                let mut normals = Normals::default();
                for place in block * BLOCK..((block + 1) * BLOCK).min(places.first.len()) {
                    let corners = &at_place[starts[place] as usize..starts[place + 1] as usize];
                    around.normals(corners, &mut room, &mut normals);
                }
                normals
            })
        };
        let mut blocks: Vec<Normals> = look(&faces);
        // Once more, with neighbours turned alike
        if blocks.iter().any(|block| block.turned) {
            let corners = |i: usize| triangles[i].map(|v| places.vertex[v as usize]);
            let turned = turned(triangles.len(), corners, |i| faces[i] != DVec3::ZERO);
            if let Some(turned) = turned {
                parallel::for_each_mut(&mut faces, BLOCK, |i, face| *face = if turned[i] { -*face } else { *face });
                blocks = look(&faces);
            }
        }
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
        self.copy_vertices(&sources);
        self.normals = normals;
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
    /// Whether there are triangles at an edge that run along it the same way.
    turned: bool,
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
                for &(end, j) in &edge[n + 1..] {
                    normals.turned |= self.leaves(corners[i as usize], end) == self.leaves(corners[j as usize], end);
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

    /// Whether a triangle runs from its corner to the place `end`, not from there.
    fn leaves(&self, corner: u32, end: u32) -> bool {
        let next = if corner % 3 == 2 { corner - 2 } else { corner + 1 };
        self.place[self.vertex(next) as usize] == end
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
    fn triangles_turned_at_random_have_the_normals_of_those_that_are_not() {
        // A ball of squares, cut from a cube's surface
        let side = |axis: usize, sign: f32, i: usize, j: usize, n: usize| {
            let mut p = [0.0; 3];
            let at = |k: usize| (k as f32 / n as f32 - 0.5) * 2.0;
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (sign, at(i) * sign, at(j));
            p
        };
        let mut ball = MeshData::default();
        for (axis, sign) in (0..6).map(|k| (k / 2, if k % 2 == 0 { 1.0 } else { -1.0 })) {
            for (i, j) in (0..64).map(|k| (k / 8, k % 8)) {
                let first = ball.positions.len() as u32;
                ball.positions.extend([[0, 0], [1, 0], [1, 1], [0, 1]].map(|[a, b]| side(axis, sign, i + a, j + b, 8)));
                ball.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|v| first + v)));
            }
        }
        for p in &mut ball.positions {
            let length = p.iter().map(|x| x * x).sum::<f32>().sqrt();
            *p = p.map(|x| x / length);
        }
        assert_eq!((ball.report().turned_edges, ball.report().boundary_edges), (0, 0));
        let mut random = firstlight_testkit::Random::new(9);
        for share in [0.01, 0.3, 0.45] {
            let mut turned = ball.clone();
            turned.triangles.iter_mut().filter(|_| random.chance(share)).for_each(|t| t.swap(1, 2));
            assert!(turned.report().turned_edges > 0);
            let mut right = ball.clone();
            for mesh in [&mut turned, &mut right] {
                mesh.smooth(60.0);
            }
            // In another order of sums
            for (t, r) in turned.triangles.iter().zip(&right.triangles) {
                for vertex in t {
                    let normal = DVec3::from(turned.normals[*vertex as usize].map(f64::from));
                    let same = r.iter().find(|v| right.positions[**v as usize] == turned.positions[*vertex as usize]);
                    let wanted = DVec3::from(right.normals[*same.unwrap() as usize].map(f64::from));
                    assert!((normal - wanted).length() < 1e-6, "{share}: {normal} {wanted}");
                }
            }
        }
    }

    #[test]
    fn two_sheets_at_one_place_keep_their_sides() {
        // Each triangle twice, once from each side, or twice from one
        let mut mesh = MeshData { positions: cube().positions, triangles: cube().triangles, ..MeshData::default() };
        let (once, mut twice) = (mesh.triangles.clone(), mesh.clone());
        mesh.triangles.extend(once.iter().map(|[a, b, c]| [*a, *c, *b]));
        twice.triangles.extend(&once);
        let mut alone = MeshData { triangles: once, ..cube() };
        for mesh in [&mut mesh, &mut twice, &mut alone] {
            mesh.smooth(10.0);
        }
        for (i, triangle) in alone.triangles.iter().enumerate() {
            let normal = alone.normals[triangle[0] as usize];
            let of = |mesh: &MeshData, i: usize| mesh.normals[mesh.triangles[i][0] as usize];
            assert_eq!((of(&twice, i), of(&twice, i + 12)), (normal, normal));
            assert_eq!((of(&mesh, i), of(&mesh, i + 12)), (normal, normal.map(|x| 0.0 - x)));
        }
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
