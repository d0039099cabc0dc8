//! PLY: the polygon file format, in ASCII and in binary data of both byte orders.
//!
//! What is read, by name, in any order and of any type:
//!
//! - `vertex`: `x y z`; `nx ny nz`; texture coordinates `u v`, `s t`, `texture_u texture_v`, `u1 v1` or `texture_s
//!   texture_t`; colours `red green blue alpha`, `diffuse_red ...` or `r g b a`, sRGB; `radius`;
//! - `face`: the list `vertex_indices` or `vertex_index`; the list `texcoord` (two numbers for each corner, as MeshLab
//!   writes); `red green blue alpha` in bytes, where vertices have no colours. The last two part vertices;
//! - `tristrips`: the list `vertex_indices`, with -1 between strips.
//!
//! All else is skipped, with a note also header lines of an unknown kind before the first element. Lines end with LF,
//! CR LF or CR; what stands after the last element is ignored with a note. Rows of text stand on lines of their own;
//! where they do not, the numbers are read wherever lines end, as many programs do.
//!
//! Text is read on all threads, a piece of lines each. Binary rows of one length, which vertices nearly always and
//! faces often are, are converted in place on all threads; others one after another.
//!
//! Source: G. Turk 1994, "The PLY Polygon File Format".

mod assemble;
mod binary;
mod body;
mod header;
mod plan;
mod source;

use super::{ImportFault, MeshData, Progress};
use header::{DataEncoding, Header};
use plan::{Plan, X};

/// Whether a file of any name is PLY: its first line.
pub(super) fn looks_like(file: &[u8]) -> bool {
    file.starts_with(b"ply") && file.get(3).is_some_and(|b| b.is_ascii_whitespace())
}

/// Reads a PLY file; positions less `origin`.
pub(super) fn read(file: &[u8], origin: [f64; 3], progress: &Progress) -> Result<MeshData, ImportFault> {
    let header = Header::read(file)?;
    let mut plan = Plan::new(&header, file.len())?;
    plan.offsets[X..X + 3].copy_from_slice(&origin);
    let mut body = match header.encoding {
        DataEncoding::Ascii => body::read_text(file, &header, &plan, progress)?,
        encoding => binary::read_binary(file, &header, &plan, encoding, progress)?,
    };
    let mut mesh = MeshData::default();
    if header.stray > 0 {
        mesh.notes
            .push(format!("{} lines of the header begin with no word of the format and are ignored", header.stray));
    }
    let rest = &file[body.end..];
    if !rest.trim_ascii().is_empty() {
        mesh.notes.push(format!("{} bytes after the last element are ignored", rest.len()));
    }
    body.vertices.into_mesh(&plan, &mut mesh);
    body.faces.retain(|part| part.count() > 0);
    assemble::assemble(body.faces, &plan, &mut mesh)?;
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::super::{ImportError, MeshData, MeshFormat};

    fn read(text: &[u8]) -> Result<MeshData, ImportError> {
        MeshFormat::Ply.read("a.ply", text, &|_, _| ControlFlow::Continue(()))
    }

    const SQUARE: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    const CORNERS: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

    fn square(more: &str, rows: &str) -> MeshData {
        read(format!("ply\nformat ascii 1.0\n{SQUARE}{more}end_header\n{CORNERS}{rows}").as_bytes()).unwrap()
    }

    #[test]
    fn texture_coordinates_of_corners_part_vertices() {
        let mesh = square(
            "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n",
            "3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 .5 .5 1 1 0 1\n",
        );
        assert_eq!(mesh.triangles, [[0, 1, 2], [3, 2, 4]]);
        assert_eq!(mesh.uvs, [vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, 0.5], [0.0, 1.0]]]);
        assert_eq!(mesh.positions[0], mesh.positions[3]);
    }

    #[test]
    fn colors_of_faces_part_vertices_and_are_decoded() {
        let mesh = square(
            "element face 2\nproperty list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\n\
             property uchar blue\n",
            "3 0 1 2 255 0 0\n3 0 2 3 0 0 188\n",
        );
        assert_eq!(mesh.positions.len(), 6);
        assert_eq!(mesh.colors[mesh.triangles[0][0] as usize], [1.0, 0.0, 0.0, 1.0]);
        let blue = mesh.colors[mesh.triangles[1][0] as usize];
        assert!((blue[2] - 0.5028865).abs() < 1e-6 && blue[3] == 1.0, "{blue:?}");
    }

    #[test]
    fn colors_in_fractions_are_srgb() {
        let mut text = "ply\nformat ascii 1.0\nelement vertex 1\n".to_string();
        for name in ["x", "y", "z", "red", "green", "blue", "alpha"] {
            text += &format!("property float {name}\n");
        }
        let mesh = read((text + "end_header\n1 2 3 0.5 2 0 0.25").as_bytes()).unwrap();
        // As in bytes: 0.5 is 0.214 of the light. What is above 1 stays, and so does alpha
        assert_eq!(mesh.colors, [[0.214_041_14, 2.0, 0.0, 0.25]]);
        assert_eq!(mesh.positions, [[1.0, 2.0, 3.0]]);
        assert!(mesh.triangles.is_empty());
    }

    #[test]
    fn strips_turn_every_second_triangle() {
        let mesh = square("element tristrips 1\nproperty list int int vertex_indices\n", "8 0 1 3 2 -1 0 1 2\n");
        assert_eq!(mesh.triangles, [[0, 1, 3], [3, 1, 2], [0, 1, 2]]);
    }

    #[test]
    fn large_polygons_of_one_size_and_small_faces() {
        let faces = "element face 3\nproperty list uchar int vertex_indices\n";
        let mesh = square(faces, "4 0 1 2 3\n2 0 1\n4 3 2 1 0\n");
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [3, 2, 1], [3, 1, 0]]);
        assert_eq!(mesh.notes, ["1 faces of less than 3 corners are left out"]);
    }

    #[test]
    fn a_header_may_have_a_comment_without_the_word() {
        let odd = format!("ply\nformat ascii 1.0\nCreated by a program\n{SQUARE}end_header\n{CORNERS}");
        let mesh = read(odd.as_bytes()).unwrap();
        assert_eq!(mesh.positions.len(), 4);
        assert_eq!(mesh.notes, ["1 lines of the header begin with no word of the format and are ignored"]);
        // Later it may be a property with a fault in its name
        let late = format!("ply\nformat ascii 1.0\n{SQUARE}Created by a program\nend_header\n{CORNERS}");
        assert!(read(late.as_bytes()).unwrap_err().to_string().contains("`Created` in the header"));
    }

    #[test]
    fn what_follows_is_ignored_with_a_note_and_numbers_may_be_infinite() {
        let mesh = square("", "and more\n");
        assert_eq!(mesh.notes, ["9 bytes after the last element are ignored"]);
        let text = format!("ply\nformat ascii 1.0\n{SQUARE}end_header\n{}", CORNERS.replace("1 1 0", "nan -inf 1e99"));
        let p = read(text.as_bytes()).unwrap().positions[2];
        assert!(p[0].is_nan() && p[1] == f32::NEG_INFINITY && p[2] == f32::INFINITY);
    }

    #[test]
    fn a_binary_body_may_begin_like_a_line_end() {
        for end in ["\n", "\r\n", "\r"] {
            let header = format!("ply\nformat binary_little_endian 1.0\n{}end_header\n", SQUARE.replace('4', "1"));
            let mut bytes = header.replace('\n', end).into_bytes();
            let x = f32::from_le_bytes(*b"\n\r\n?");
            bytes.extend([x, 0.0, 0.0].iter().flat_map(|x| x.to_le_bytes()));
            assert_eq!(read(&bytes).unwrap().positions, [[x, 0.0, 0.0]], "{end:?}");
        }
    }
}
