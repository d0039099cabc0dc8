//! What a model file holds, and what is odd about it: for whoever wants to know before anything is rendered.
//!
//! The station before are the readers of files, which fill in what only they know; `scene/model_report.rs` brings it
//! together. Nothing here reads a file.

use crate::error::Diagnostic;
use crate::image::read::{Limits, read_header};
use crate::import::{MeshPart, MeshReport};

/// What a model file holds, and what is odd about it; see
/// [`SceneDesc::model_report`](crate::SceneDesc::model_report).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelReport {
    /// `glTF`, `GLB`, `OBJ`, `PLY` or `STL`.
    pub format: &'static str,
    /// The version of glTF.
    pub version: Option<String>,
    /// The program that wrote a glTF file.
    pub generator: Option<String>,
    /// Whose work a glTF file is.
    pub copyright: Option<String>,
    /// The files that it is made of, its own first; pictures are told by themselves.
    pub files: Vec<ModelFile>,
    /// How many things it holds.
    pub counts: ModelCounts,
    /// The extensions of glTF that it uses.
    pub extensions: Vec<ModelExtension>,
    /// Its animations, in the order of the file.
    pub animations: Vec<ModelAnimation>,
    /// The names of its variants.
    pub variants: Vec<String>,
    /// What the cameras of the scene that is shown are called.
    pub cameras: Vec<String>,
    /// Kind and name of the lights of the scene that is shown.
    pub lights: Vec<(&'static str, Option<String>)>,
    /// All its materials, those that nothing has too.
    pub materials: Vec<ModelMaterial>,
    /// The pictures within it and those that it names, each once.
    pub pictures: Vec<ModelPicture>,
    /// The meshes that are shown, each once, posed as it is shown.
    pub meshes: Vec<ModelMesh>,
    /// The box around all that is shown, as it is posed and placed, y upwards; `None` where nothing is.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Warnings: what was left out or taken otherwise than written.
    pub warnings: Vec<Diagnostic>,
    /// What is told, though nothing is wrong for certain.
    pub notes: Vec<Diagnostic>,
}

/// A file that a model is made of.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ModelFile {
    /// Its path, as scenes name files.
    pub file: String,
    /// Its length; `None` if it could not be read.
    pub bytes: Option<u64>,
}

/// How many things a model file holds, shown or not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ModelCounts {
    /// Scenes of a glTF file.
    pub scenes: u64,
    /// Nodes of a glTF file.
    pub nodes: u64,
    /// Nodes whose scale is negative along an axis.
    pub negative_scales: u64,
    /// Meshes.
    pub meshes: u64,
    /// Primitives of all meshes.
    pub primitives: u64,
    /// Materials.
    pub materials: u64,
    /// Skins.
    pub skins: u64,
    /// Joints of all skins.
    pub joints: u64,
    /// Morph targets: of each mesh as many as its primitives have.
    pub morph_targets: u64,
    /// Cameras, in all scenes.
    pub cameras: u64,
    /// Lights, in all scenes.
    pub lights: u64,
}

/// An extension of glTF that a file uses.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ModelExtension {
    /// Its name.
    pub name: String,
    /// Whether the file says that it cannot be shown without.
    pub required: bool,
    /// Whether it is read; one that is not is ignored.
    pub read: bool,
}

/// An animation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelAnimation {
    /// Its name; it may be empty.
    pub name: String,
    /// The moment of its last key, in seconds.
    pub seconds: f64,
}

/// A material.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ModelMaterial {
    /// Its name in the file; without one `material 3`, by its number.
    pub name: String,
    /// Whether the file gives it a name.
    pub named: bool,
    /// Whether anything in the file has it, in any variant.
    pub used: bool,
}

/// A picture.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ModelPicture {
    /// Its path, as scenes name files; of one within the file its address, `chair.glb#image/2`.
    pub file: String,
    /// Columns and rows; `None` if it could not be read.
    pub size: Option<[u32; 2]>,
    /// Its length in bytes; `None` if it is missing.
    pub bytes: Option<u64>,
    /// What materials use it for: `base color`, `normal`; empty if none does.
    pub uses: Vec<String>,
    /// Why it could not be read: it is missing or damaged.
    pub fault: Option<String>,
}

/// A mesh that is shown.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelMesh {
    /// Its name, or that of the node that shows it; may be empty.
    pub name: String,
    /// Its file, as a `[[mesh]]` of a scene names it: `chair.glb#mesh/0`.
    pub file: String,
    /// How often it is shown.
    pub placed: u64,
    /// How often of these it is mirrored.
    pub mirrored: u64,
    /// What is known of its vertices and triangles.
    pub report: MeshReport,
    /// The names of its materials in the file; of glTF files one for each primitive, empty where that has none.
    pub materials: Vec<String>,
    /// The files of materials that an OBJ file names, as it writes them.
    pub material_files: Vec<String>,
    /// Objects and groups of an OBJ file, solids of an STL file.
    pub parts: Vec<MeshPart>,
    /// Whether one of its materials is seen from the front alone.
    pub single_sided: bool,
    /// The materials of its faces whose textures ask for texture coordinates that those faces do not have, by their
    /// names in a scene.
    pub lacks_uv: Vec<String>,
    /// Whether its points have radii.
    pub has_radii: bool,
    /// What its reader left out or took otherwise than written.
    pub notes: Vec<String>,
}

impl ModelPicture {
    /// A picture of these bytes, or why there are none.
    pub(crate) fn new(file: String, bytes: Result<Vec<u8>, String>, uses: Vec<String>) -> Self {
        let length = bytes.as_ref().ok().map(|bytes| bytes.len() as u64);
        let header = bytes.and_then(|bytes| read_header(&bytes, &Limits::default()).map_err(|e| e.to_string()));
        let (size, fault) = match header {
            Ok(header) => (Some([header.width, header.height]), None),
            Err(fault) => (None, Some(fault)),
        };
        ModelPicture { file, size, bytes: length, uses, fault }
    }
}

/// How many of something a mesh has.
type CountOf = fn(&MeshReport) -> u64;

/// A largest side of a model beyond these, in metres, is likely to be of another unit.
const USUAL_SIZES: [f64; 2] = [1e-3, 100.0];

impl ModelReport {
    /// Triangles of all that is shown, as often as it is.
    pub fn shown_triangles(&self) -> u64 {
        self.meshes.iter().fold(0, |sum, mesh| sum.saturating_add(mesh.placed.saturating_mul(mesh.report.triangles)))
    }

    /// What is known of all meshes together, each counted once: normals and colours are there if all meshes have them,
    /// the sets of texture coordinates are the most of any, `bounds` those of the model.
    pub fn total(&self) -> MeshReport {
        let mut total = MeshReport { bounds: self.bounds, ..MeshReport::default() };
        let sum = |of: CountOf| self.meshes.iter().fold(0u64, |sum, mesh| sum + of(&mesh.report));
        let all = |of: fn(&MeshReport) -> bool| !self.meshes.is_empty() && self.meshes.iter().all(|m| of(&m.report));
        total.vertices = sum(|mesh| mesh.vertices);
        total.positions = sum(|mesh| mesh.positions);
        total.triangles = sum(|mesh| mesh.triangles);
        total.non_finite_vertices = sum(|mesh| mesh.non_finite_vertices);
        total.unused_vertices = sum(|mesh| mesh.unused_vertices);
        total.non_finite_triangles = sum(|mesh| mesh.non_finite_triangles);
        total.degenerate_triangles = sum(|mesh| mesh.degenerate_triangles);
        total.duplicate_triangles = sum(|mesh| mesh.duplicate_triangles);
        total.boundary_edges = sum(|mesh| mesh.boundary_edges);
        total.non_manifold_edges = sum(|mesh| mesh.non_manifold_edges);
        total.turned_edges = sum(|mesh| mesh.turned_edges);
        total.has_normals = all(|mesh| mesh.has_normals);
        total.bad_normals = sum(|mesh| mesh.bad_normals);
        total.non_unit_normals = sum(|mesh| mesh.non_unit_normals);
        total.uv_sets = self.meshes.iter().map(|mesh| mesh.report.uv_sets).max().unwrap_or(0);
        total.has_colors = all(|mesh| mesh.has_colors);
        total.bytes = sum(|mesh| mesh.bytes);
        total
    }

    /// Pictures that a material uses and that are missing or damaged: squares stand in for them.
    pub fn faulty_pictures(&self) -> impl Iterator<Item = &ModelPicture> {
        self.pictures.iter().filter(|picture| picture.fault.is_some() && !picture.uses.is_empty())
    }

    /// What is odd about the model, each in one sentence for a user. None of it keeps it from being shown.
    pub fn oddities(&self) -> Vec<String> {
        let mut odd = self.odd_surfaces();
        odd.extend(self.repairs());
        odd.extend(self.odd_vertices());
        odd.extend(self.odd_places());
        odd.extend(self.odd_materials());
        odd
    }

    /// The meshes that have any of a thing, such as `2 of 3 meshes ("leg" and others)`, and their number of it; `None`
    /// if no mesh has any.
    fn which(&self, count: impl Fn(&ModelMesh) -> u64) -> Option<(String, u64)> {
        let found: Vec<(&ModelMesh, u64)> =
            self.meshes.iter().map(|mesh| (mesh, count(mesh))).filter(|(_, count)| *count > 0).collect();
        let all = found.iter().fold(0u64, |sum, (_, count)| sum + count);
        match (&found[..], self.meshes.len()) {
            ([], _) => None,
            (_, 1) => Some(("the mesh".to_owned(), all)),
            ([(mesh, _)], of) => Some((format!("1 of {of} meshes ({:?})", mesh.name), all)),
            ([(mesh, _), ..], of) => {
                Some((format!("{} of {of} meshes ({:?} and others)", found.len(), mesh.name), all))
            }
        }
    }

    fn odd_surfaces(&self) -> Vec<String> {
        let mut odd = Vec::new();
        if self.meshes.iter().all(|mesh| mesh.report.triangles == 0) {
            let points = self.meshes.iter().any(|mesh| mesh.report.vertices > 0);
            odd.push(
                if points { "points, and no triangles" } else { "nothing is shown: there are no triangles" }.into(),
            );
        }
        let open = |mesh: &ModelMesh| u64::from(mesh.single_sided && mesh.report.boundary_edges > 0);
        if let Some((meshes, _)) = self.which(open) {
            odd.push(format!("open single-sided surface: in {meshes}; camera rays pass through its back"));
        }
        let defects = self.counted(&[
            (|mesh| mesh.boundary_edges, "boundary edges", "; the surface is not closed"),
            (|mesh| mesh.non_manifold_edges, "non-manifold edges", "; more than two triangles share each"),
            (|mesh| mesh.turned_edges, "edges between triangles of opposite winding", ""),
            (|mesh| mesh.duplicate_triangles, "duplicate triangles", ""),
            (|mesh| mesh.non_finite_vertices, "vertices that are not finite", ""),
        ]);
        odd.splice(..0, defects);
        odd
    }

    /// The numbers of the file that the reader removes or replaces before it is rendered: a line for each kind.
    /// [`oddities`](Self::oddities) has them too.
    pub fn repairs(&self) -> Vec<String> {
        self.counted(&[
            (|mesh| mesh.degenerate_triangles, "triangles without area", "; removed"),
            (|mesh| mesh.non_finite_triangles, "triangles that are not finite", "; removed"),
            (|mesh| mesh.bad_normals, "normals without direction", "; replaced by those of the facets"),
            (|mesh| mesh.non_unit_normals, "normals whose length is not 1", "; normalized"),
        ])
    }

    /// A line for each kind of thing that any mesh has: its name, its number, the meshes, and what follows from it.
    fn counted(&self, things: &[(CountOf, &str, &str)]) -> Vec<String> {
        let said = |(count, what, consequence): &(CountOf, &str, &str)| {
            let (meshes, count) = self.which(|mesh| count(&mesh.report))?;
            Some(format!("{what}: {count} in {meshes}{consequence}"))
        };
        things.iter().filter_map(said).collect()
    }

    fn odd_vertices(&self) -> Vec<String> {
        let mut odd = Vec::new();
        let is_flat = |mesh: &ModelMesh| u64::from(mesh.report.triangles > 0 && !mesh.report.has_normals);
        if let Some((meshes, _)) = self.which(is_flat) {
            let gltf = matches!(self.format, "glTF" | "GLB");
            let shown = if gltf { "shaded flat" } else { "computed from the faces" };
            odd.push(format!("no normals: in {meshes}; {shown}"));
        }
        if let Some((meshes, _)) = self.which(|mesh| mesh.lacks_uv.len() as u64) {
            let first = self.meshes.iter().find_map(|mesh| mesh.lacks_uv.first());
            let material = first.map_or("", String::as_str);
            odd.push(format!("no texture coordinates: in {meshes}; the textures of {material:?} need them"));
        }
        odd
    }

    fn odd_places(&self) -> Vec<String> {
        let mut odd = Vec::new();
        if let Some((meshes, count)) = self.which(|mesh| mesh.mirrored) {
            odd.push(format!("mirrored placements: {count}, of {meshes}; front faces stay outside"));
        }
        if self.counts.negative_scales > 0 {
            odd.push(format!("nodes with a negative scale: {}", self.counts.negative_scales));
        }
        let size = self.bounds.map_or(0.0, |[low, high]| (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max));
        let [least, most] = USUAL_SIZES;
        if size > most {
            let size = size.round();
            odd.push(format!("the longest side is {size} m; the unit of the file may be millimetres or centimetres"));
        } else if size > 0.0 && size < least {
            odd.push(format!("the longest side is {size:.2e} m; the unit of the file may be larger than metres"));
        }
        odd
    }

    fn odd_materials(&self) -> Vec<String> {
        let mut odd = Vec::new();
        let names = |names: Vec<&str>| {
            const SHOWN: usize = 6;
            let first: Vec<String> = names.iter().take(SHOWN).map(|name| format!("{name:?}")).collect();
            let more = names.len().saturating_sub(SHOWN);
            first.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
        };
        let lists: [(&str, Vec<&str>); 5] = [
            (
                "materials without a name",
                self.materials.iter().filter(|material| !material.named).map(|m| &*m.name).collect(),
            ),
            ("unused materials", self.materials.iter().filter(|material| !material.used).map(|m| &*m.name).collect()),
            ("missing or damaged textures", self.faulty_pictures().map(|picture| &*picture.file).collect()),
            (
                "unused pictures",
                self.pictures.iter().filter(|picture| picture.uses.is_empty()).map(|p| &*p.file).collect(),
            ),
            (
                "ignored extensions",
                self.extensions.iter().filter(|extension| !extension.read).map(|e| &*e.name).collect(),
            ),
        ];
        for (what, list) in lists {
            if !list.is_empty() {
                odd.push(format!("{what}: {}", names(list)));
            }
        }
        odd
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(name: &str, report: MeshReport) -> ModelMesh {
        ModelMesh { name: name.to_owned(), placed: 2, report, ..ModelMesh::default() }
    }

    #[test]
    fn what_is_odd_is_said_with_numbers_and_names() {
        let sound = MeshReport { triangles: 4, vertices: 4, has_normals: true, ..MeshReport::default() };
        let mut report =
            ModelReport { meshes: vec![mesh("a", sound.clone()), mesh("b", sound.clone())], ..ModelReport::default() };
        report.bounds = Some([[0.0; 3], [1.0, 2.0, 3.0]]);
        assert_eq!(report.oddities(), [""; 0]);
        assert_eq!((report.shown_triangles(), report.total().triangles, report.total().has_normals), (16, 8, true));
        report.meshes[1].report =
            MeshReport { boundary_edges: 3, degenerate_triangles: 2, has_normals: false, ..sound };
        report.meshes[1].single_sided = true;
        report.meshes[1].mirrored = 1;
        report.bounds = Some([[0.0; 3], [1.0, 2000.0, 3.0]]);
        report.materials.push(ModelMaterial { name: "material 0".into(), named: false, used: false });
        report.pictures.push(ModelPicture::new("a.png".into(), Err("no such file".into()), vec!["normal".into()]));
        report.pictures.push(ModelPicture::new("b.png".into(), Ok(vec![1, 2, 3]), Vec::new()));
        report.extensions.push(ModelExtension { name: "X_y".into(), required: false, read: false });
        assert_eq!(
            report.oddities(),
            [
                "boundary edges: 3 in 1 of 2 meshes (\"b\"); the surface is not closed",
                "open single-sided surface: in 1 of 2 meshes (\"b\"); camera rays pass through its back",
                "triangles without area: 2 in 1 of 2 meshes (\"b\"); removed",
                "no normals: in 1 of 2 meshes (\"b\"); computed from the faces",
                "mirrored placements: 1, of 1 of 2 meshes (\"b\"); front faces stay outside",
                "the longest side is 2000 m; the unit of the file may be millimetres or centimetres",
                "materials without a name: \"material 0\"",
                "unused materials: \"material 0\"",
                "missing or damaged textures: \"a.png\"",
                "unused pictures: \"b.png\"",
                "ignored extensions: \"X_y\"",
            ]
        );
        assert_eq!(ModelReport::default().oddities(), ["nothing is shown: there are no triangles"]);
    }
}
