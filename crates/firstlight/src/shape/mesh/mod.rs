//! Triangle meshes: described, read, joined.
//!
//! What a ray finds on one is in [`surface`]; the tree of its triangles is in [`super::triangles`].

mod join;
mod surface;
mod tangents;

use std::ops::ControlFlow;
use std::sync::Arc;

pub(crate) use join::MeshBuilder;
pub(crate) use surface::{JoinedPart, Mesh, TrianglePoint};

use super::cache::{CompileCache, ContentKey, LoadedMesh, MeshFiles, key_of};
use super::common::shape_table;
use crate::context::{AssetError, Assets, CompileContext, CompileStage, show};
use crate::describe::FilePath;
use crate::describe::node::quoted;
use crate::import::{
    Contained, GltfFault, MeshAddress, MeshData, OpenFault, from_own_origin, read_mesh, used_vertices,
};

shape_table! {
    /// Triangles: from a PLY, STL or OBJ file, or written out.
    ///
    /// Corners run counterclockwise around the front; where the mesh has normals, those decide which side is the front.
    /// Triangles without area, and those with a coordinate that is no number, are left out. Colours of the vertices
    /// multiply the material's diffuse, ambient and base colours. Where a file names materials (OBJ `usemtl`), each
    /// face has the scene's material of that name, if there is one, otherwise the mesh's own.
    ///
    /// ```toml
    /// [[mesh]]
    /// file = "bunny.ply"
    /// smooth_deg = 40
    /// material = "clay"
    /// ```
    pub struct MeshDesc {
        /// The file, relative to the text that names it. Instead of all lists. A mesh within a glTF file has the name
        /// of the file and its address: `chair.glb#mesh/0`, or `chair.glb#node/4` as a node poses it.
        pub file: Option<FilePath> = None,
        /// Where the vertices are, in metres.
        pub positions: Vec<[f64; 3]> = Vec::new(),
        /// The three vertices of each triangle, counted from 0.
        pub triangles: Vec<[u32; 3]> = Vec::new(),
        /// A normal for each vertex, of any length; none for flat triangles.
        pub normals: Vec<[f64; 3]> = Vec::new(),
        /// A texture coordinate for each vertex; without, (0, 0), (1, 0), (0, 1) at the corners of each triangle.
        pub uvs: Vec<[f64; 2]> = Vec::new(),
        /// Further sets of texture coordinates after `uvs`, which is set 0: of each a texture coordinate for each
        /// vertex.
        pub more_uvs: Vec<Vec<[f64; 2]>> = Vec::new(),
        /// Which set of texture coordinates is used, counted from 0, by all textures that name no set of their own.
        pub uv_set: u32 = 0,
        /// A colour for each vertex, linear Rec. 709.
        pub colors: Vec<[f64; 3]> = Vec::new(),
        /// An alpha for each vertex, 0 to 1; without, 1.
        pub alphas: Vec<f64> = Vec::new(),
        /// The names of materials that `face_materials` chooses from. Beside a file whose faces have materials: the
        /// names in the scene of each of them, in the order of the file.
        pub materials: Vec<String> = Vec::new(),
        /// The material of each triangle, as a position in `materials`, counted from 0.
        pub face_materials: Vec<u32> = Vec::new(),
        /// Normals are made smooth across edges where faces meet at up to this angle in degrees, 0 to 180; the normals
        /// of a file are replaced. Without it they are used as they are, and a mesh without normals is flat.
        pub smooth_deg: Option<f64> = None,
    }
}

/// The largest mesh file, in bytes.
pub(crate) const MAX_MESH_FILE: u64 = 1 << 36;
/// Coordinates beyond this, in metres, are refused, as everywhere in a scene.
const MAX_COORDINATE: f64 = 2.5e8;

/// Says that a mesh file cannot be had.
pub(crate) fn unreadable(cx: &mut CompileContext, file: &FilePath, error: &AssetError) {
    let colon = if matches!(error, AssetError::NotFound | AssetError::Io(_)) { ":" } else { "" };
    let hint = match error {
        AssetError::NotFound => "file names are relative to the text that names them",
        AssetError::Outside => "copy it into the folder of the scene, or allow its folder with --allow-dir",
        AssetError::TooLarge { .. } => "split it",
        AssetError::Io(_) => "a mesh is a plain file that can be read",
    };
    let slashes = error.slashes(&file.0);
    cx.error("file", format!("{:?}{colon} {error}", file.0), Some(slashes.as_deref().unwrap_or(hint)));
}

/// The bytes of the file of a mesh or point set, and their hash. `None` after an error.
pub(crate) fn read_mesh_bytes(
    cx: &mut CompileContext,
    assets: &dyn Assets,
    file: &FilePath,
    files: &mut MeshFiles<'_>,
) -> Option<(Vec<u8>, ContentKey)> {
    let left = cx.memory_left();
    let bytes = match assets.read(&file.0, MAX_MESH_FILE.min(left)) {
        Ok(bytes) => bytes,
        Err(error) => {
            match error {
                AssetError::TooLarge { size, .. } if left < MAX_MESH_FILE => {
                    cx.take("file", &format!("the file {:?}", file.0), size);
                }
                _ => unreadable(cx, file, &error),
            }
            return None;
        }
    };
    let hash = *blake3::hash(&bytes).as_bytes();
    files.read.push((file.0.clone(), hash));
    Some((bytes, hash))
}

/// The mesh or point set of the bytes of a file. `None` after an error.
pub(crate) fn parse_mesh_file(cx: &mut CompileContext, file: &FilePath, bytes: &[u8]) -> Option<MeshData> {
    let progress = |done, total| {
        cx.tell(CompileStage::Reading { file: &file.0, done, total });
        ControlFlow::Continue(())
    };
    match read_mesh(&file.0, bytes, &progress) {
        Ok(data) => Some(data),
        Err(error) => {
            cx.error("file", error.to_string(), None);
            None
        }
    }
}

/// The mesh of a file, without vertices of no triangle and with normals of length 1. `None` after an error.
pub(crate) fn load_mesh_file(
    cx: &mut CompileContext,
    assets: &dyn Assets,
    file: &FilePath,
    files: &mut MeshFiles<'_>,
) -> Option<LoadedMesh> {
    // One that is in no file
    if let Some((data, content)) = files.cache.and_then(|cache| cache.given(&file.0)) {
        files.read.push((file.0.clone(), content));
        return Some((data, Some(content)));
    }
    if let Some((container, Contained::Mesh(address))) = Contained::split(&file.0) {
        return load_contained(cx, assets, file, (container, &address), files);
    }
    if let Some((loaded, hash)) = files.open.mesh(&file.0) {
        files.read.push((file.0.clone(), hash));
        return Some(loaded);
    }
    let (bytes, hash) = read_mesh_bytes(cx, assets, file, files)?;
    // The name may say how the bytes are to be read
    let key = files.cache.map(|_| key_of("mesh file", [file.0.as_bytes(), &hash]));
    let data = kept(files.cache, key, || {
        let mut data = parse_mesh_file(cx, file, &bytes)?;
        data.tidy();
        Some(data)
    })?;
    let loaded = (data, key);
    files.open.keep(&file.0, &loaded, hash);
    Some(loaded)
}

/// What is kept at a key, or else is made.
fn kept(
    cache: Option<&CompileCache>,
    key: Option<ContentKey>,
    make: impl FnOnce() -> Option<MeshData>,
) -> Option<Arc<MeshData>> {
    let place = cache.zip(key);
    if let Some(data) = place.and_then(|(cache, key)| cache.find(&key)) {
        return Some(data);
    }
    let data = Arc::new(make()?);
    if let Some((cache, key)) = place {
        cache.keep(key, &data);
    }
    Some(data)
}

/// A mesh within a glTF file. `None` after an error.
fn load_contained(
    cx: &mut CompileContext,
    assets: &dyn Assets,
    file: &FilePath,
    (container, address): (&str, &MeshAddress),
    files: &mut MeshFiles<'_>,
) -> Option<LoadedMesh> {
    let open = files.open.clone();
    let gltf = match open.gltf.open(container, assets) {
        Ok(gltf) => gltf,
        Err(OpenFault::Read(error)) => {
            unreadable(cx, &container.into(), &error);
            return None;
        }
        Err(OpenFault::Damaged(error)) => {
            cx.error("file", error.to_string(), None);
            return None;
        }
    };
    files.read.push((file.0.clone(), gltf.hash));
    let key = files.cache.map(|_| key_of("mesh file", [file.0.as_bytes(), &gltf.hash]));
    let fault = |cx: &mut CompileContext, fault: GltfFault| {
        cx.error("file", fault.into_error(container).to_string(), None);
    };
    let data = kept(files.cache, key, || {
        let mut data = gltf.mesh(address).map_err(|wrong| fault(cx, wrong)).ok()?;
        data.tidy();
        Some(data)
    })?;
    for note in &data.notes {
        cx.warning("file", format!("{}, {note}", quoted(container)), None);
    }
    Some((data, key))
}

/// A mesh in its own space, checked.
pub(crate) struct MeshSource {
    pub data: Arc<MeshData>,
    pub uv_set: usize,
    /// The key of `data`, where it may be of use.
    content: Option<ContentKey>,
    /// The numbers of its triangles in the mesh that it is a part of; empty if it is all of it.
    numbers: Vec<u32>,
    /// What textures on it name.
    pub named: NamedSets,
}

/// The sets of texture coordinates that textures on a mesh name and that it has, as bits.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NamedSets {
    /// All but the one that the mesh chooses.
    pub all: u8,
    /// Those of normal maps and bump maps.
    pub maps: u8,
    /// Whether a normal map or a bump map is laid by the one that the mesh chooses.
    pub own_maps: bool,
}

impl MeshSource {
    /// The triangles whose materials are `wanted`, as a source of their own; each keeps its number.
    pub fn part(&self, wanted: impl Fn(u32) -> bool) -> MeshSource {
        let mut data = (*self.data).clone();
        let faces = &self.data.face_materials;
        let numbers: Vec<u32> = (0..data.triangles.len() as u32).filter(|i| wanted(faces[*i as usize])).collect();
        data.triangles = numbers.iter().map(|i| self.data.triangles[*i as usize]).collect();
        data.face_materials = numbers.iter().map(|i| faces[*i as usize]).collect();
        MeshSource { data: Arc::new(data), content: None, numbers, ..*self }
    }
}

impl MeshDesc {
    /// Reads or checks the mesh. `None` after an error.
    pub(crate) fn compile(
        &self,
        cx: &mut CompileContext,
        assets: &dyn Assets,
        files: &mut MeshFiles<'_>,
    ) -> Option<MeshSource> {
        let before = cx.error_count();
        let (data, content) = self.load(cx, assets, files)?;
        // One of many meshes of a file may be empty
        let contained = self.file.as_ref().filter(|file| Contained::split(&file.0).is_some());
        if let (true, Some(file)) = (data.triangles.is_empty(), contained) {
            cx.warning("file", format!("{} holds no triangles", quoted(&file.0)), Some("nothing of it can be seen"));
            return None;
        }
        if data.triangles.is_empty() {
            let message = format!("holds {} points and no faces", data.positions.len());
            cx.error("file", message, Some("points are shown by [[point_set]], as spheres; PLY files can hold them"));
        }
        if let Some(angle) = self.smooth_deg {
            let angle = cx.between(
                "smooth_deg",
                angle,
                0.0,
                180.0,
                Some("edges where faces meet at up to this angle are smooth; 0 is flat"),
            );
            cx.advise_radians("smooth_deg", angle);
        }
        let uv_set = self.uv_set as usize;
        if self.uv_set > 0 && uv_set >= data.uvs.len() {
            let sets = match data.uvs.len() {
                0 => "no texture coordinates".to_owned(),
                1 => "one set of texture coordinates".to_owned(),
                sets => format!("{sets} sets of texture coordinates"),
            };
            let message = format!("there is no set {}: the mesh has {sets}", self.uv_set);
            cx.error("uv_set", message, Some("sets are counted from 0"));
        }
        if cx.error_count() > before {
            return None;
        }
        let (data, content) = self.smoothed(data, content, files.cache);
        Some(MeshSource { data, uv_set, content, numbers: Vec::new(), named: NamedSets::default() })
    }

    /// The mesh as it is said, and its key where something is kept. `None` after an error.
    fn load(&self, cx: &mut CompileContext, assets: &dyn Assets, files: &mut MeshFiles<'_>) -> Option<LoadedMesh> {
        let Some(file) = &self.file else {
            let mut data = self.written(cx)?;
            data.tidy();
            let content = files.cache.map(|_| data.content());
            return Some((Arc::new(data), content));
        };
        for (field, said) in self.lists() {
            if said && field != "materials" {
                cx.error(field, "it is said beside a file", Some("give the file, or the lists"));
            }
        }
        let (data, content) = load_mesh_file(cx, assets, file, files)?;
        if self.materials.is_empty() {
            return Some((data, content));
        }
        // The scene's own names for the materials of the file
        if self.materials.len() != data.materials.len() {
            let message = format!("{} of them; the file has {}", self.materials.len(), data.materials.len());
            cx.error("materials", message, Some("with a file: a name for each of its materials, in the file's order"));
        }
        let mut data = Arc::unwrap_or_clone(data);
        data.materials.clone_from(&self.materials);
        let keyed = |content: &ContentKey| {
            let names = self.materials.iter().map(|name| name.as_bytes());
            key_of("mesh with materials", [&content[..]].into_iter().chain(names))
        };
        let content = content.as_ref().map(keyed);
        Some((Arc::new(data), content))
    }

    /// The mesh with the normals that `smooth_deg` asks for.
    fn smoothed(
        &self,
        data: Arc<MeshData>,
        content: Option<ContentKey>,
        cache: Option<&CompileCache>,
    ) -> (Arc<MeshData>, Option<ContentKey>) {
        let Some(angle) = self.smooth_deg else { return (data, content) };
        let key = content.map(|content| key_of("smooth mesh", [&content[..], &angle.to_bits().to_le_bytes()]));
        if let Some(smooth) = cache.zip(key).and_then(|(cache, key)| cache.find(&key)) {
            return (smooth, key);
        }
        let mut smooth = Arc::unwrap_or_clone(data);
        smooth.smooth(angle);
        let smooth = Arc::new(smooth);
        if let Some((cache, key)) = cache.zip(key) {
            cache.keep(key, &smooth);
        }
        (smooth, key)
    }

    /// The colour and the alpha of each vertex; none if neither is said.
    fn vertex_colors(&self) -> Vec<[f32; 4]> {
        let said = if self.alphas.is_empty() { self.colors.len() } else { self.positions.len() };
        let of_vertex = |i: usize| {
            let [r, g, b] = self.colors.get(i).copied().unwrap_or([1.0; 3]);
            [r, g, b, self.alphas.get(i).copied().unwrap_or(1.0)].map(|c| c as f32)
        };
        (0..said).map(of_vertex).collect()
    }

    fn lists(&self) -> [(&'static str, bool); 9] {
        [
            ("positions", !self.positions.is_empty()),
            ("triangles", !self.triangles.is_empty()),
            ("normals", !self.normals.is_empty()),
            ("uvs", !self.uvs.is_empty()),
            ("more_uvs", !self.more_uvs.is_empty()),
            ("colors", !self.colors.is_empty()),
            ("alphas", !self.alphas.is_empty()),
            ("materials", !self.materials.is_empty()),
            ("face_materials", !self.face_materials.is_empty()),
        ]
    }

    /// The mesh of the lists.
    fn written(&self, cx: &mut CompileContext) -> Option<MeshData> {
        let before = cx.error_count();
        if self.positions.is_empty() || self.triangles.is_empty() {
            let hint = "write `file = \"NAME.ply\"`, or positions and triangles";
            let field = if self.positions.is_empty() { "file" } else { "triangles" };
            cx.error(field, "there is neither a file nor both positions and triangles", Some(hint));
        }
        let vertices = self.positions.len();
        let of_vertices = [
            ("normals", self.normals.len()),
            ("uvs", self.uvs.len()),
            ("colors", self.colors.len()),
            ("alphas", self.alphas.len()),
        ];
        for (field, length) in of_vertices {
            if length != 0 && length != vertices {
                let message = format!("{length} of them for {vertices} positions");
                cx.error(field, message, Some("give one for each vertex, or none"));
            }
        }
        if self.uvs.is_empty() && !self.more_uvs.is_empty() {
            cx.error("more_uvs", "there are no `uvs`, which are set 0", Some("give the first set as `uvs`"));
        }
        for (set, uvs) in self.more_uvs.iter().enumerate().filter(|(_, uvs)| uvs.len() != vertices) {
            let message = format!("{} of them for {vertices} positions", uvs.len());
            cx.error(&format!("more_uvs[{set}]"), message, Some("give one for each vertex"));
        }
        // What no triangle has may hold anything
        let used = used_vertices(vertices, &self.triangles);
        let is_used = |i: usize| used.get(i).is_none_or(|used| *used);
        for (i, position) in self.positions.iter().enumerate().filter(|(i, _)| is_used(*i)) {
            if !position.iter().all(|c| c.abs() <= MAX_COORDINATE) {
                let message = format!("{} is outside [-2.5e8, 2.5e8]", show(position));
                cx.error(&format!("positions[{i}]"), message, Some("coordinates are in metres"));
            }
        }
        for (i, triangle) in self.triangles.iter().enumerate() {
            if let Some(wrong) = triangle.iter().find(|v| **v as usize >= vertices) {
                let message = format!("there is no vertex {wrong}: there are {vertices}, counted from 0");
                cx.error(&format!("triangles[{i}]"), message, None);
            }
        }
        for (i, color) in self.colors.iter().enumerate().filter(|(i, _)| is_used(*i)) {
            if !color.iter().all(|c| (0.0..=1e6).contains(c)) {
                let message = format!("{} is outside [0, 1e6]", show(color));
                cx.error(&format!("colors[{i}]"), message, Some("a colour is linear red, green, blue"));
            }
        }
        for (i, alpha) in self.alphas.iter().enumerate().filter(|(i, _)| is_used(*i)) {
            cx.between(&format!("alphas[{i}]"), *alpha, 0.0, 1.0, Some("0 lets all light through, 1 none"));
        }
        let mut check_sizes = |field: &str, i: usize, numbers: &[f64]| {
            for number in numbers.iter().filter(|number| is_used(i) && !(number.abs() <= 1e30)) {
                cx.error(&format!("{field}[{i}]"), format!("{number} is outside [-1e30, 1e30]"), None);
            }
        };
        self.normals.iter().enumerate().for_each(|(i, normal)| check_sizes("normals", i, normal));
        self.uvs.iter().enumerate().for_each(|(i, uv)| check_sizes("uvs", i, uv));
        for (set, uvs) in self.more_uvs.iter().enumerate() {
            let field = format!("more_uvs[{set}]");
            uvs.iter().enumerate().for_each(|(i, uv)| check_sizes(&field, i, uv));
        }
        let faces = self.face_materials.len();
        if faces != 0 && faces != self.triangles.len() {
            let message = format!("{faces} of them for {} triangles", self.triangles.len());
            cx.error("face_materials", message, Some("give one for each triangle, or none"));
        }
        for (i, face) in self.face_materials.iter().enumerate() {
            if *face as usize >= self.materials.len() {
                let message = format!("there is no material {face}: `materials` has {}", self.materials.len());
                cx.error(&format!("face_materials[{i}]"), message, Some("they are counted from 0"));
            }
        }
        if cx.error_count() > before {
            return None;
        }
        let single3 = |v: &[f64; 3]| v.map(|c| c as f32);
        let single2 = |uvs: &Vec<[f64; 2]>| uvs.iter().map(|uv| uv.map(|c| c as f32)).collect();
        let (positions, origin) = from_own_origin(vertices, is_used, |i| self.positions[i]);
        Some(MeshData {
            positions,
            origin,
            normals: self.normals.iter().map(single3).collect(),
            uvs: [&self.uvs].into_iter().chain(&self.more_uvs).filter(|uvs| !uvs.is_empty()).map(single2).collect(),
            colors: self.vertex_colors(),
            triangles: self.triangles.clone(),
            face_materials: self.face_materials.clone(),
            materials: self.materials.clone(),
            ..MeshData::default()
        })
    }
}
