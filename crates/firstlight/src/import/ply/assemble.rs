//! From faces as they stand in a PLY file to the triangles of a mesh.

use super::super::polygon::{self, PolygonCounts};
use super::super::weld::weld;
use super::super::{ImportFault, MAX_COUNT, MeshData};
use super::body::Faces;
use super::header::Scalar;
use super::plan::{ColorScale, Plan};

/// Makes triangles of the faces, and parts vertices where faces have texture coordinates or colours of their own.
pub(super) fn assemble(mut parts: Vec<Faces>, plan: &Plan, mesh: &mut MeshData) -> Result<(), ImportFault> {
    let parted = plan.wedges || plan.face_colors;
    let mut counts = PolygonCounts::default();
    let positions = std::mem::take(&mut mesh.positions);
    // Triangles of a part, as numbers of its corners where it is not triangles already
    let mut split = |part: &Faces| {
        let (triangles, part_counts) = polygon::triangulate(&part.sizes, |i| positions[part.corners[i] as usize]);
        counts.add(part_counts);
        triangles
    };
    if !parted {
        if parts.len() == 1 && parts[0].sizes.is_empty() {
            mesh.triangles = std::mem::take(&mut parts[0].triangles);
        } else {
            let size = |p: &Faces| {
                if p.sizes.is_empty() {
                    p.triangles.len()
                } else {
                    p.corners.len() - 2 * p.sizes.len().min(p.corners.len() / 2)
                }
            };
            mesh.triangles.reserve_exact(parts.iter().map(size).sum());
            for part in parts {
                if part.sizes.is_empty() {
                    mesh.triangles.extend_from_slice(&part.triangles);
                } else {
                    let of = |t: [u32; 3]| t.map(|i| part.corners[i as usize]);
                    mesh.triangles.extend(split(&part).into_iter().map(of));
                }
            }
        }
        counts.notes(&mut mesh.notes);
        mesh.positions = positions;
        return check_count(mesh.triangles.len());
    }
    // All corners in one row, with what makes them different
    let mut corners: Vec<u32> = Vec::new();
    let mut wedges: Vec<[f32; 2]> = Vec::new();
    let mut colors: Vec<u32> = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for mut part in parts {
        let base = corners.len() as u32;
        let from_base = |t: [u32; 3]| t.map(|i| base + i);
        if part.sizes.is_empty() {
            triangles.extend((0..part.triangles.len() as u32).map(|i| from_base([3 * i, 3 * i + 1, 3 * i + 2])));
            if plan.face_colors {
                colors.extend(part.colors.iter().flat_map(|&color| [color; 3]));
            }
            corners.extend(part.triangles.into_flattened());
        } else {
            triangles.extend(split(&part).into_iter().map(from_base));
            if plan.face_colors {
                let each = part.colors.iter().zip(&part.sizes);
                colors.extend(each.flat_map(|(&color, &size)| std::iter::repeat_n(color, size as usize)));
            }
            corners.append(&mut part.corners);
        }
        wedges.append(&mut part.wedges);
        check_count(corners.len())?;
    }
    counts.notes(&mut mesh.notes);
    let bits = |x: f32| (x + 0.0).to_bits();
    let welded = weld(corners.len(), |i| {
        let uv = wedges.get(i).map_or([0; 2], |uv| uv.map(bits));
        [corners[i], uv[0], uv[1], colors.get(i).copied().unwrap_or(0)]
    });
    // Vertices of the file, in the order of the faces
    mesh.positions = positions;
    let vertex = |i: &u32| corners[*i as usize] as usize;
    pick(&mut mesh.positions, &welded.first, vertex);
    pick(&mut mesh.normals, &welded.first, vertex);
    pick(&mut mesh.radii, &welded.first, vertex);
    pick(&mut mesh.colors, &welded.first, vertex);
    for set in &mut mesh.uvs {
        pick(set, &welded.first, vertex);
    }
    if plan.wedges {
        mesh.uvs.insert(0, welded.first.iter().map(|&i| wedges[i as usize]).collect());
    }
    if plan.face_colors {
        let table = ColorScale::new(Scalar::U8);
        let linear = |&i: &u32| table.linear(colors[i as usize].to_le_bytes().map(f32::from));
        mesh.colors = welded.first.iter().map(linear).collect();
    }
    mesh.triangles = triangles;
    welded.renumber(&mut mesh.triangles);
    Ok(())
}

/// What is left of a list per vertex, for vertices made of corners.
fn pick<T: Copy>(list: &mut Vec<T>, first: &[u32], vertex: impl Fn(&u32) -> usize) {
    if !list.is_empty() {
        *list = first.iter().map(|i| list[vertex(i)]).collect();
    }
}

fn check_count(triangles: usize) -> Result<(), ImportFault> {
    match triangles as u64 {
        count if count > MAX_COUNT => Err(ImportFault::TooMany { what: "triangles", count, limit: MAX_COUNT }),
        _ => Ok(()),
    }
}
