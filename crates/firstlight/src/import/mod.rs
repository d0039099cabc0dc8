//! Reading meshes of others: PLY, STL and OBJ, from bytes to a plain [`MeshData`].
//!
//! And files of materials, MTL: from bytes to statements, of which `material/mtl.rs` makes materials.
//!
//! The station before is whoever has the bytes (a scene's files come through [`Assets`](crate::Assets)); the station
//! after is whoever makes shapes of them. Nothing here opens a file, compiles or transforms. Axes, units and the
//! direction of v are left as the file has them, for the file does not say them.
//!
//! The readers are our own. `ply-rs-bw`, `stl_io` and `tobj` read value by value into maps, enums or growing lists on
//! one thread, believe the counts of a header, and do not say the line of a fault; a renderer that must open a hundred
//! megabytes in a second, from anybody, needs otherwise.
//!
//! - Memory follows the length of the file, never what its header claims.
//! - The result does not depend on the number of threads.
//! - Text is cut at line ends into pieces for all threads (`text.rs`); vertices are made one by their keys on all
//!   threads as well (`weld.rs`).

mod error;
mod foreign;
mod given;
mod gltf;
pub(crate) mod mtl;
mod obj;
mod ply;
mod polygon;
mod report;
mod smooth;
mod stl;
mod text;
mod tidy;
mod turned;
mod weld;

use std::ops::{ControlFlow, Range};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::color::Encoding;
use crate::math::{DVec3, origin_for};
use error::ImportFault;
pub(crate) use error::shown;
pub use error::{ImportError, MeshPlace};
pub use foreign::is_gltf;
pub(crate) use foreign::{WantedFile, foreign};
pub(crate) use given::from_own_origin;
pub use gltf::gltf_animations;
pub(crate) use gltf::{
    Contained, Gltf, GltfFault, GltfFiles, GltfNode, JsonPlace, MeshAddress, OpenFault, Pose, Uri, WithContained,
    called,
};
pub use mtl::MtlNote;
pub use report::MeshReport;
pub(crate) use tidy::used_vertices;

/// Vertices and triangles are counted in 32 bits, with one number to spare for "none".
const MAX_COUNT: u64 = (1 << 32) - 2;

/// A triangle mesh as a file holds it: nothing compiled, nothing transformed.
///
/// Every list "per vertex" has the length of `positions` or is empty; every list "per triangle" that of `triangles`, or
/// is empty. Indices are in range. Numbers may be anything a file can say, NaN and infinities too: whoever uses them
/// leaves out the triangles whose positions are not finite. Scenes also leave out the vertices of no triangle, whatever
/// their numbers, and make normals of length 1; where one has no direction they take that of the facet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Where the vertices are, in the file's units and axes, less `origin`.
    pub positions: Vec<[f32; 3]>,
    /// What was taken off every position, in f64: 0 but for meshes far from 0, of which 32 bits would lose what is
    /// small.
    pub origin: [f64; 3],
    /// Per vertex, as the file has them: not always of length 1; `[0, 0, 0]` where the file gives none.
    pub normals: Vec<[f32; 3]>,
    /// Per vertex: the direction in which u grows, from which normal maps count, and 1 or -1: that times normal x
    /// tangent is the direction in which v grows. `[0, 0, 0, 0]` where the file gives none. Read from glTF.
    pub tangents: Vec<[f32; 4]>,
    /// Sets of texture coordinates, each per vertex; no set if the file has none. v as the file has it.
    pub uvs: Vec<Vec<[f32; 2]>>,
    /// Per vertex: red, green, blue, **linear** Rec. 709, and alpha. Colours in files are taken as sRGB and decoded,
    /// whole numbers and fractions alike; fractions above 1 stay as they are. Without alpha in the file it is 1.
    pub colors: Vec<[f32; 4]>,
    /// Per vertex: the radius of a point of a PLY point set.
    pub radii: Vec<f32>,
    /// The three vertices of each triangle, in the file's order: counter-clockwise as seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Per triangle: an index into `materials`.
    pub face_materials: Vec<u32>,
    /// The names of materials, in the order of their first use; of glTF, one for each primitive. Empty text: faces
    /// before the first name.
    pub materials: Vec<String>,
    /// The names of material files (OBJ `mtllib`), as written. They are not opened.
    pub material_files: Vec<String>,
    /// Per triangle: the smoothing group (OBJ `s`), 0 for off; empty if the file has no such statement.
    pub smoothing: Vec<u32>,
    /// The named parts of the file, in order and without gaps; empty if it names none.
    pub parts: Vec<MeshPart>,
    /// What was left out or taken otherwise than written, in words for a user.
    pub notes: Vec<String>,
}

/// A named part of a mesh: an object or group of an OBJ file, a solid of an STL file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeshPart {
    /// The object (OBJ `o`, STL `solid`); may be empty.
    pub object: String,
    /// The group (OBJ `g`), or groups with a blank between; may be empty.
    pub group: String,
    /// Its triangles.
    pub triangles: Range<u32>,
}

/// The kinds of mesh files that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Polygon file format, ASCII and binary of both byte orders.
    Ply,
    /// Stereolithography, ASCII and binary.
    Stl,
    /// Wavefront OBJ: its polygons.
    Obj,
}

impl MeshFormat {
    /// The kind of a file: a PLY file by its first line, others by the ending of `name` (`.ply`, `.stl`, `.obj`, in any
    /// case), without such an ending by their content. `None` if nothing says so.
    pub fn detect(name: &str, bytes: &[u8]) -> Option<Self> {
        if ply::looks_like(bytes) {
            return Some(Self::Ply);
        }
        let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
        match ending.as_deref() {
            Some("ply") => Some(Self::Ply),
            Some("stl") => Some(Self::Stl),
            Some("obj") => Some(Self::Obj),
            _ if stl::looks_like(bytes) => Some(Self::Stl),
            _ if obj::looks_like(bytes) => Some(Self::Obj),
            _ => None,
        }
    }

    /// Reads a file of this kind; otherwise as [`read_mesh`].
    ///
    /// # Errors
    /// As [`read_mesh`].
    pub fn read(
        self,
        name: &str,
        bytes: &[u8],
        progress: &(dyn Fn(u64, u64) -> ControlFlow<()> + Sync),
    ) -> Result<MeshData, ImportError> {
        let progress = Progress { report: progress, done: AtomicU64::new(0), total: bytes.len() as u64 };
        let read = |origin: [f64; 3]| {
            let mesh = match self {
                Self::Ply => ply::read(bytes, origin, &progress),
                Self::Stl => stl::read(bytes, &progress),
                Self::Obj => obj::read(bytes, origin, &progress),
            };
            mesh.map_err(|fault| fault.into_error(name, bytes))
        };
        let mut mesh = read([0.0; 3])?;
        // What is far from 0 has lost its small digits: once more, without what all of it has in common. STL has no
        // more digits
        let origin = mesh.used_bounds().map_or(DVec3::ZERO, origin_for).to_array();
        if self != Self::Stl && origin != [0.0; 3] {
            mesh = read(origin)?;
            mesh.origin = origin;
        }
        debug_assert!(mesh.fault().is_none(), "{:?}", mesh.fault());
        Ok(mesh)
    }
}

/// Reads a mesh from the bytes of a file, on all threads.
///
/// `name` tells the kind by its ending ([`MeshFormat::detect`]) and stands in errors; no file is opened. `progress` is
/// told the bytes read and those there are, from any thread, and may stop the work. Polygons become triangles, concave
/// ones too: small ones that are fans from their first corner so, others by cutting ears. Of large ones that cross
/// themselves a note is made.
///
/// # Errors
/// [`ImportError`], with the place in the file.
pub fn read_mesh(
    name: &str,
    bytes: &[u8],
    progress: &(dyn Fn(u64, u64) -> ControlFlow<()> + Sync),
) -> Result<MeshData, ImportError> {
    if bytes.is_empty() {
        return Err(ImportError::Empty { file: name.to_owned() });
    }
    // Whatever its ending says
    if let Some(foreign) = foreign(bytes, WantedFile::Mesh) {
        let (message, hint) = (foreign.message(WantedFile::Mesh), foreign.hint(WantedFile::Mesh).to_owned());
        return Err(ImportError::Foreign { file: name.to_owned(), message, hint });
    }
    match MeshFormat::detect(name, bytes) {
        Some(format) => format.read(name, bytes, progress),
        None => Err(ImportError::UnknownKind { file: name.to_owned() }),
    }
}

/// Whether a file, of which `head` are the first bytes, is a PLY file that holds points and neither faces nor strips.
pub fn is_point_set(head: &[u8]) -> bool {
    if MeshFormat::detect("", head) != Some(MeshFormat::Ply) {
        return false;
    }
    let header = String::from_utf8_lossy(head);
    let header = header.split("end_header").next().unwrap_or_default();
    let elements = header.lines().filter_map(|line| {
        let mut words = line.split_whitespace();
        (words.next() == Some("element")).then(|| (words.next().unwrap_or_default(), words.next().unwrap_or_default()))
    });
    let elements: Vec<_> = elements.collect();
    let some = |name: &str| elements.iter().any(|(element, count)| *element == name && *count != "0");
    some("vertex") && !some("face") && !some("tristrips")
}

impl MeshData {
    /// What is wrong with the lengths of lists or an index, if anything is: the promise of the type.
    pub(crate) fn fault(&self) -> Option<String> {
        let (vertices, triangles) = (self.positions.len(), self.triangles.len());
        let per_vertex = [self.normals.len(), self.tangents.len(), self.colors.len(), self.radii.len()];
        if per_vertex.into_iter().any(|n| n != 0 && n != vertices) || self.uvs.iter().any(|set| set.len() != vertices) {
            return Some(format!("a list per vertex has not {vertices}"));
        }
        let per_triangle = [self.face_materials.len(), self.smoothing.len()];
        if per_triangle.into_iter().any(|n| n != 0 && n != triangles) {
            return Some(format!("a list per triangle has not {triangles}"));
        }
        if let Some(material) = self.face_materials.iter().find(|&&m| m as usize >= self.materials.len()) {
            return Some(format!("material {material} of {}", self.materials.len()));
        }
        let mut end = 0;
        for part in &self.parts {
            if part.triangles.start != end || part.triangles.end < end {
                return Some(format!("part {:?} begins at {} after {end}", part.object, part.triangles.start));
            }
            end = part.triangles.end;
        }
        if !self.parts.is_empty() && end as usize != triangles {
            return Some(format!("the parts have {end} triangles of {triangles}"));
        }
        let outside = self.triangles.iter().flatten().find(|&&v| v as usize >= vertices);
        outside.map(|vertex| format!("vertex {vertex} of {vertices}"))
    }
}

/// The linear value of a colour in fractions, which is sRGB as one in whole numbers is. What is not between 0 and 1
/// stays as it is.
fn linear_of_fraction(encoded: f32) -> f32 {
    let is_encoded = encoded > 0.0 && encoded < 1.0;
    if is_encoded { Encoding::Srgb.decode(f64::from(encoded)) as f32 } else { encoded }
}

/// How far reading is, and whether to go on.
pub(crate) struct Progress<'a> {
    report: &'a (dyn Fn(u64, u64) -> ControlFlow<()> + Sync),
    done: AtomicU64,
    total: u64,
}

impl Progress<'_> {
    /// So many bytes more are read.
    fn advance(&self, bytes: usize) -> Result<(), ImportFault> {
        let done = self.done.fetch_add(bytes as u64, Ordering::Relaxed) + bytes as u64;
        match (self.report)(done.min(self.total), self.total) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(ImportFault::Stopped),
        }
    }
}

/// The first fault in order, whichever thread was first to meet one.
fn all<T>(results: Vec<Result<T, ImportFault>>) -> Result<Vec<T>, ImportFault> {
    results.into_iter().collect()
}
