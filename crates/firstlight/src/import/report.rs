//! Facts about a mesh, for whoever wants to know whether it is sound.

use rayon::prelude::*;

use super::MeshData;
use super::weld::weld;
use crate::math::DVec3;
use crate::parallel::{self, CHUNK};

/// What [`MeshData::report`] finds.
///
/// Edges and faces are compared by the positions of their ends, to the bit (-0 as 0): vertices that were split for
/// normals or texture coordinates are one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshReport {
    /// How many vertices there are.
    pub vertices: u64,
    /// How many different positions they have.
    pub positions: u64,
    /// How many triangles there are.
    pub triangles: u64,
    /// The lowest and highest coordinates of all finite vertices that triangles have, or of all where there are no
    /// triangles; `None` if there are none.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Vertices with a coordinate that is NaN or infinite.
    pub non_finite_vertices: u64,
    /// Vertices of no triangle.
    pub unused_vertices: u64,
    /// Triangles with a vertex that is not finite.
    pub non_finite_triangles: u64,
    /// Triangles without an area: two corners at one position, or three in a line. Not those that are not finite.
    pub degenerate_triangles: u64,
    /// Triangles with the same three positions as an earlier one, whichever way they turn. Not those without an area.
    pub duplicate_triangles: u64,
    /// Edges of one triangle only: 0 for a closed surface. Degenerate triangles have none.
    pub boundary_edges: u64,
    /// Edges of more than two triangles.
    pub non_manifold_edges: u64,
    /// Edges of two triangles that turn opposite ways: one of them is inside out.
    pub turned_edges: u64,
    /// Whether it has normals.
    pub has_normals: bool,
    /// Vertices whose normal is zero or not finite.
    pub bad_normals: u64,
    /// Vertices whose normal has a direction and a length that is not 1, by more than a thousandth.
    pub non_unit_normals: u64,
    /// How many sets of texture coordinates there are.
    pub uv_sets: u64,
    /// Whether it has colours.
    pub has_colors: bool,
    /// Bytes of all its lists.
    pub bytes: u64,
}

impl MeshReport {
    /// Whether the surface is closed and all its edges have two triangles that turn the same way.
    pub fn is_closed(&self) -> bool {
        self.triangles > 0 && self.boundary_edges + self.non_manifold_edges + self.turned_edges == 0
    }
}

/// What one triangle is.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
enum TriangleFate {
    #[default]
    Fine,
    Degenerate,
    NonFinite,
}

impl MeshData {
    /// Facts about the mesh. Takes some seconds for tens of millions of triangles.
    pub fn report(&self) -> MeshReport {
        let finite = |p: &[f32; 3]| p.iter().all(|x| x.is_finite());
        let count = |n: usize| n as u64;
        let used = self.used_vertices();
        let bad = |n: &[f32; 3]| !finite(n) || n.iter().all(|&x| x == 0.0);
        let is_off = |n: &[f32; 3]| !bad(n) && (DVec3::from(n.map(f64::from)).length() - 1.0).abs() > 1e-3;
        let mut report = MeshReport {
            vertices: count(self.positions.len()),
            triangles: count(self.triangles.len()),
            bounds: self.used_bounds().map(|corners| corners.map(|corner| corner.to_array())),
            non_finite_vertices: count(parallel::count(self.positions.len(), CHUNK, |i| !finite(&self.positions[i]))),
            unused_vertices: count(used.iter().filter(|used| !**used).count()),
            has_normals: !self.normals.is_empty(),
            bad_normals: count(parallel::count(self.normals.len(), CHUNK, |i| bad(&self.normals[i]))),
            non_unit_normals: count(parallel::count(self.normals.len(), CHUNK, |i| is_off(&self.normals[i]))),
            uv_sets: count(self.uvs.len()),
            has_colors: !self.colors.is_empty(),
            bytes: self.bytes(),
            ..MeshReport::default()
        };
        self.look_at_faces(&mut report);
        report
    }

    /// The lowest and highest coordinates of finite vertices, as the file has them: of those that triangles have, where
    /// there are triangles.
    pub(crate) fn used_bounds(&self) -> Option<[DVec3; 2]> {
        let join = |a: [[f32; 3]; 2], b: [[f32; 3]; 2]| {
            [[0, 1, 2].map(|i| a[0][i].min(b[0][i])), [0, 1, 2].map(|i| a[1][i].max(b[1][i]))]
        };
        let corners = self.triangles.as_flattened();
        let count = if corners.is_empty() { self.positions.len() } else { corners.len() };
        let of_chunk = |chunk: usize| {
            let each =
                (chunk * CHUNK..((chunk + 1) * CHUNK).min(count)).map(|i| corners.get(i).map_or(i, |v| *v as usize));
            let finite = each.map(|i| self.positions[i]).filter(|p| p.iter().all(|x| x.is_finite()));
            // Adding 0 makes 0 of -0, of which the least would not be the same every time
            finite.map(|p| [p.map(|x| x + 0.0); 2]).reduce(join)
        };
        let corners = parallel::collect(count.div_ceil(CHUNK), of_chunk).into_iter().flatten().reduce(join)?;
        Some(corners.map(|corner| DVec3::from(corner.map(f64::from)) + DVec3::from(self.origin)))
    }

    /// Bytes of all lists.
    fn bytes(&self) -> u64 {
        fn of<T>(list: &[T]) -> u64 {
            std::mem::size_of_val(list) as u64
        }
        of(&self.positions)
            + of(&self.normals)
            + of(&self.tangents)
            + self.uvs.iter().map(|set| of(set)).sum::<u64>()
            + of(&self.colors)
            + of(&self.radii)
            + of(&self.triangles)
            + of(&self.face_materials)
            + of(&self.smoothing)
    }

    fn look_at_faces(&self, report: &mut MeshReport) {
        // Vertices by position
        let bits = |p: [f32; 3]| p.map(|x| (x + 0.0).to_bits());
        if self.positions.len() as u64 > super::MAX_COUNT {
            return;
        }
        let places = weld(self.positions.len(), |i| {
            let [x, y, z] = bits(self.positions[i]);
            [x, y, z, 0]
        });
        report.positions = places.first.len() as u64;
        let at = |t: &[u32; 3]| t.map(|v| places.vertex[v as usize]);
        let kind = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| self.positions[v as usize]);
            if ![a, b, c].iter().flatten().all(|x| x.is_finite()) {
                return TriangleFate::NonFinite;
            }
            let [a, b, c] = [a, b, c].map(|p| DVec3::from(p.map(f64::from)));
            let area = (b - a).cross(c - a).length();
            if area > 0.0 { TriangleFate::Fine } else { TriangleFate::Degenerate }
        };
        let kinds = parallel::map(self.triangles.len(), CHUNK, |i| kind(&self.triangles[i]));
        let of_kind = |kind: TriangleFate| kinds.iter().filter(|k| **k == kind).count() as u64;
        report.non_finite_triangles = of_kind(TriangleFate::NonFinite);
        report.degenerate_triangles = of_kind(TriangleFate::Degenerate);
        // The faces that have an area
        let faces = self.triangles.iter().zip(&kinds).filter(|(_, kind)| **kind == TriangleFate::Fine);
        let mut fine: Vec<[u32; 3]> = faces.map(|(t, _)| at(t)).collect();
        // Edges with their lower end first, and whether that turns them round
        let edge = |i: usize| {
            let (p, q) = (fine[i / 3][i % 3], fine[i / 3][(i + 1) % 3]);
            [p.min(q), p.max(q), u32::from(p > q)]
        };
        let mut edges = parallel::map(3 * fine.len(), CHUNK, edge);
        edges.par_sort_unstable();
        for edge in edges.chunk_by(|a, b| a[..2] == b[..2]) {
            match edge {
                [_] => report.boundary_edges += 1,
                [one, other] => report.turned_edges += u64::from(one[2] == other[2]),
                _ => report.non_manifold_edges += 1,
            }
        }
        drop(edges);
        parallel::for_each_mut(&mut fine, CHUNK, |_, t| t.sort_unstable());
        fine.par_sort_unstable();
        report.duplicate_triangles = fine.windows(2).filter(|pair| pair[0] == pair[1]).count() as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_is_closed_until_a_face_is_taken_turned_or_doubled() {
        let whole = MeshData {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..MeshData::default()
        };
        let report = whole.report();
        assert!(report.is_closed());
        assert_eq!((report.bounds, report.bytes), (Some([[0.0; 3], [1.0; 3]]), 96));
        let mut mesh = whole.clone();
        mesh.triangles.pop();
        assert_eq!(mesh.report().boundary_edges, 3);
        let mut mesh = whole.clone();
        mesh.triangles[3] = [1, 3, 2];
        assert_eq!(mesh.report().turned_edges, 3);
        let mut mesh = whole.clone();
        mesh.triangles.push([3, 2, 1]);
        let report = mesh.report();
        assert_eq!((report.non_manifold_edges, report.duplicate_triangles), (3, 1));
    }

    #[test]
    fn what_is_wrong_is_counted() {
        let mesh = MeshData {
            positions: vec![
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [2.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [-0.0, 0.0, 0.0],
                [f32::NAN, 0.0, 0.0],
                [9.0; 3],
            ],
            normals: vec![[0.0; 3]; 7],
            triangles: vec![[0, 1, 2], [0, 0, 3], [0, 4, 3], [0, 1, 5], [0, 1, 3]],
            ..MeshData::default()
        };
        let report = mesh.report();
        assert_eq!((report.vertices, report.positions, report.triangles), (7, 6, 5));
        assert_eq!((report.degenerate_triangles, report.non_finite_triangles, report.duplicate_triangles), (3, 1, 0));
        assert_eq!((report.non_finite_vertices, report.unused_vertices, report.bad_normals), (1, 1, 7));
        assert_eq!((report.boundary_edges, report.non_manifold_edges), (3, 0));
        assert_eq!(report.bounds, Some([[0.0; 3], [2.0, 1.0, 0.0]]));
        assert_eq!(report.non_unit_normals, 0);
        let long = MeshData { normals: vec![[0.0, 0.6, 0.8], [0.0, 0.0, 1.0005], [0.0, 2.0, 0.0]], ..mesh.clone() };
        assert_eq!(long.report().non_unit_normals, 1);
        let points = MeshData { triangles: Vec::new(), ..mesh };
        assert_eq!(points.report().bounds, Some([[0.0; 3], [9.0, 9.0, 9.0]]));
        assert_eq!(MeshData::default().report(), MeshReport::default());
    }
}
