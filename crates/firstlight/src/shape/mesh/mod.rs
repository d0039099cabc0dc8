//! Triangle meshes: described, read, joined.
//!
//! What a ray finds on one is in [`surface`]; the tree of its triangles is in [`super::triangles`].

mod surface;
mod tangents;

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DAffine3;

pub(crate) use surface::{JoinedPart, Mesh, TrianglePoint};

use super::cache::{CompileCache, ContentKey, MeshFiles, key_of};
use super::common::shape_table;
use super::placement::Placement;
use super::triangles::{TriangleTree, can_be_hit};
use crate::context::{AssetError, Assets, CompileContext, CompileStage, show};
use crate::describe::FilePath;
use crate::ids::MaterialId;
use crate::import::{MeshData, from_own_origin, read_mesh, used_vertices};
use crate::math::{DVec3, Vec3};

shape_table! {
    /// Triangles: from a PLY, STL or OBJ file, or written out.
    ///
    /// Corners run counterclockwise around the front; where the mesh has normals, those decide which side is the front.
    /// Triangles without area, and those with a coordinate that is no number, are left out. Colours of the vertices
    /// multiply the material's diffuse, specular and ambient colours. Where a file names materials (OBJ `usemtl`), each
    /// face has the scene's material of that name, if there is one, otherwise the mesh's own.
    ///
    /// ```toml
    /// [[mesh]]
    /// file = "bunny.ply"
    /// smooth_deg = 40
    /// material = "clay"
    /// ```
    pub struct MeshDesc {
        /// The file, relative to the text that names it. Instead of all lists.
        pub file: Option<FilePath> = None,
        /// Where the vertices are, in metres.
        pub positions: Vec<[f64; 3]> = Vec::new(),
        /// The three vertices of each triangle, counted from 0.
        pub triangles: Vec<[u32; 3]> = Vec::new(),
        /// A normal for each vertex, of any length; none for flat triangles.
        pub normals: Vec<[f64; 3]> = Vec::new(),
        /// A texture coordinate for each vertex; without, (0, 0), (1, 0), (0, 1) at the corners of each triangle.
        pub uvs: Vec<[f64; 2]> = Vec::new(),
        /// Which set of a file's texture coordinates is used, counted from 0.
        pub uv_set: u32 = 0,
        /// A colour for each vertex, linear Rec. 709.
        pub colors: Vec<[f64; 3]> = Vec::new(),
        /// An alpha for each vertex, 0 to 1; without, 1.
        pub alphas: Vec<f64> = Vec::new(),
        /// The names of materials that `face_materials` chooses from.
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

/// The bytes of the file of a mesh or point set, and their hash. `None` after an error.
pub(crate) fn read_mesh_bytes(
    cx: &mut CompileContext,
    assets: &dyn Assets,
    file: &FilePath,
    files: &mut MeshFiles<'_>,
) -> Option<(Vec<u8>, ContentKey)> {
    let bytes = match assets.read(&file.0, MAX_MESH_FILE) {
        Ok(bytes) => bytes,
        Err(error) => {
            let colon = if matches!(error, AssetError::NotFound | AssetError::Io(_)) { ":" } else { "" };
            let hint = match error {
                AssetError::NotFound => "file names are relative to the text that names them",
                AssetError::Outside => "copy it into the folder of the scene, or allow its folder with --allow-dir",
                AssetError::TooLarge { .. } => "split it",
                AssetError::Io(_) => "a mesh is a plain file that can be read",
            };
            let slashes = error.slashes(&file.0);
            cx.error("file", format!("{:?}{colon} {error}", file.0), Some(slashes.as_deref().unwrap_or(hint)));
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

/// A mesh in its own space, checked.
pub(crate) struct MeshSource {
    pub data: Arc<MeshData>,
    pub uv_set: usize,
    /// The key of `data`, where it may be of use.
    content: Option<ContentKey>,
    /// The numbers of its triangles in the mesh that it is a part of; empty if it is all of it.
    numbers: Vec<u32>,
}

impl MeshSource {
    /// The triangles whose materials are `wanted`, as a source of their own; each keeps its number.
    pub fn part(&self, wanted: impl Fn(u32) -> bool) -> MeshSource {
        let mut data = (*self.data).clone();
        let faces = &self.data.face_materials;
        let numbers: Vec<u32> = (0..data.triangles.len() as u32).filter(|i| wanted(faces[*i as usize])).collect();
        data.triangles = numbers.iter().map(|i| self.data.triangles[*i as usize]).collect();
        data.face_materials = numbers.iter().map(|i| faces[*i as usize]).collect();
        MeshSource { data: Arc::new(data), uv_set: self.uv_set, content: None, numbers }
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
        Some(MeshSource { data, uv_set, content, numbers: Vec::new() })
    }

    /// The mesh as it is said, and its key where something is kept. `None` after an error.
    fn load(
        &self,
        cx: &mut CompileContext,
        assets: &dyn Assets,
        files: &mut MeshFiles<'_>,
    ) -> Option<(Arc<MeshData>, Option<ContentKey>)> {
        let Some(file) = &self.file else {
            let mut data = self.written(cx)?;
            data.tidy();
            let content = files.cache.map(|_| data.content());
            return Some((Arc::new(data), content));
        };
        for (field, said) in self.lists() {
            if said {
                cx.error(field, "it is said beside a file", Some("give the file, or the lists"));
            }
        }
        // One that is in no file
        if let Some((data, content)) = files.cache.and_then(|cache| cache.given(&file.0)) {
            files.read.push((file.0.clone(), content));
            return Some((data, Some(content)));
        }
        let (bytes, hash) = read_mesh_bytes(cx, assets, file, files)?;
        let parse = |cx: &mut CompileContext| {
            let mut data = parse_mesh_file(cx, file, &bytes)?;
            data.tidy();
            Some(Arc::new(data))
        };
        let Some(cache) = files.cache else { return Some((parse(cx)?, None)) };
        // The name may say how the bytes are to be read
        let key = key_of("mesh file", [file.0.as_bytes(), &hash]);
        if let Some(data) = cache.find(&key) {
            return Some((data, Some(key)));
        }
        let data = parse(cx)?;
        cache.keep(key, &data);
        Some((data, Some(key)))
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

    fn lists(&self) -> [(&'static str, bool); 8] {
        [
            ("positions", !self.positions.is_empty()),
            ("triangles", !self.triangles.is_empty()),
            ("normals", !self.normals.is_empty()),
            ("uvs", !self.uvs.is_empty()),
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
        let normals = self.normals.iter().enumerate().map(|(i, normal)| ("normals", i, &normal[..]));
        let uvs = self.uvs.iter().enumerate().map(|(i, uv)| ("uvs", i, &uv[..]));
        for (field, i, numbers) in normals.chain(uvs).filter(|(_, i, _)| is_used(*i)) {
            for number in numbers.iter().filter(|number| !(number.abs() <= 1e30)) {
                cx.error(&format!("{field}[{i}]"), format!("{number} is outside [-1e30, 1e30]"), None);
            }
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
        let (positions, origin) = from_own_origin(vertices, is_used, |i| self.positions[i]);
        Some(MeshData {
            positions,
            origin,
            normals: self.normals.iter().map(single3).collect(),
            uvs: if self.uvs.is_empty() {
                Vec::new()
            } else {
                vec![self.uvs.iter().map(|uv| uv.map(|c| c as f32)).collect()]
            },
            colors: self.vertex_colors(),
            triangles: self.triangles.clone(),
            face_materials: self.face_materials.clone(),
            materials: self.materials.clone(),
            ..MeshData::default()
        })
    }
}

/// Joins the meshes of one space.
#[derive(Default)]
pub(crate) struct MeshBuilder {
    /// As they came.
    sources: Vec<JoinedSource>,
    /// Vertices and triangles of all of them.
    counts: [usize; 2],
    bounds: Option<[DVec3; 2]>,
    joined: Lists,
    /// Whether a triangle that is there twice is met twice.
    pub keeps_copies: bool,
    /// Whether normal maps may be on it.
    pub has_tangents: bool,
}

/// A mesh that is to be joined with others, and its part of them.
struct JoinedSource {
    data: Arc<MeshData>,
    uv_set: usize,
    content: Option<ContentKey>,
    transform: Option<DAffine3>,
    surface: u32,
    class: u32,
    materials: Vec<MaterialId>,
    numbers: Vec<u32>,
}

/// What is joined of all meshes.
#[derive(Default)]
struct Lists {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    colors: Vec<[f32; 4]>,
    parts: Vec<JoinedPart>,
    /// Of each part: rays treat parts of one class alike.
    classes: Vec<u32>,
}

/// Makes `list` as long as `length` and adds `more`, if either has anything.
fn join<T: Clone>(list: &mut Vec<T>, length: usize, more: Vec<T>, added: usize, filler: T) {
    if list.is_empty() && more.is_empty() {
        return;
    }
    list.resize(length, filler.clone());
    if list.is_empty() {
        *list = more;
    } else {
        list.extend(more);
    }
    list.resize(length + added, filler);
}

impl MeshBuilder {
    /// Of a mesh in which a triangle that is there twice is met twice.
    pub fn with_copies() -> MeshBuilder {
        MeshBuilder { keeps_copies: true, ..MeshBuilder::default() }
    }

    /// Adds a mesh, moved by `transform`; `surface` is its number in the group, `materials` what its faces choose from.
    /// Rays are let through, and light is stopped, by all meshes of a `class` alike.
    pub fn add(
        &mut self,
        cx: &mut CompileContext,
        source: MeshSource,
        transform: Option<DAffine3>,
        surface: u32,
        class: u32,
        materials: Vec<MaterialId>,
    ) {
        let MeshSource { data, uv_set, content, numbers } = source;
        let counts = [self.counts[0] + data.positions.len(), self.counts[1] + data.triangles.len()];
        if counts.iter().any(|count| *count > u32::MAX as usize) {
            let message = "the meshes of one group have more than 4294967295 vertices or triangles together";
            cx.error("file", message, Some("put some of them in a group of their own"));
            return;
        }
        let bounds = bounds(&data, transform);
        let largest = bounds.iter().flatten().fold(0.0f64, |most, corner| most.max(corner.abs().max_element()));
        if largest > MAX_COORDINATE {
            let message = format!("a vertex has the coordinate {}, outside [-2.5e8, 2.5e8]", largest as f32);
            cx.error("file", message, Some("coordinates are in metres: scale the mesh"));
            return;
        }
        if !data.triangles.iter().any(|triangle| can_be_hit(&data.positions, triangle)) {
            advise_nothing(cx, &data);
        }
        cx.advise_vertex_colors(&data.colors);
        self.counts = counts;
        self.bounds = match (self.bounds, bounds) {
            (Some([low, high]), Some([a, b])) => Some([low.min(a), high.max(b)]),
            (all, own) => all.or(own),
        };
        self.sources.push(JoinedSource { data, uv_set, content, transform, surface, class, materials, numbers });
    }

    /// The box around all meshes so far, in the space that they are joined in.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        self.bounds
    }

    /// What the joined mesh follows from; `None` where that is not known.
    fn key(&self, origin: DVec3) -> Option<ContentKey> {
        let mut parts =
            vec![numbers(&origin.to_array()), vec![u8::from(self.keeps_copies), u8::from(self.has_tangents)]];
        for source in &self.sources {
            parts.push(source.content?.to_vec());
            parts.push(source.transform.map_or(Vec::new(), |transform| numbers(&transform.to_cols_array())));
            let whole = [source.uv_set as u32, source.surface, source.class].into_iter();
            let whole = whole.chain(source.materials.iter().map(|material| material.0));
            parts.push(whole.flat_map(u32::to_le_bytes).collect());
        }
        Some(key_of("joined mesh", parts.iter().map(Vec::as_slice)))
    }

    /// Joins all meshes, less `origin`, and builds the tree. `None` if there is nothing to be hit.
    pub fn build(self, cx: &CompileContext, cache: Option<&CompileCache>, origin: DVec3) -> Option<Arc<Mesh>> {
        let place = cache.zip(self.key(origin)).filter(|_| !self.sources.is_empty());
        if let Some(mesh) = place.and_then(|(cache, key)| cache.find(&key)) {
            return Some(mesh);
        }
        let mesh = Arc::new(self.build_anew(cx, origin)?);
        if let Some((cache, key)) = place {
            cache.keep(key, &mesh);
        }
        Some(mesh)
    }

    fn build_anew(mut self, cx: &CompileContext, origin: DVec3) -> Option<Mesh> {
        for source in std::mem::take(&mut self.sources) {
            self.joined.add(source, origin, self.has_tangents);
        }
        let Lists { positions, triangles, normals, uvs, colors, parts, classes } = self.joined;
        if triangles.is_empty() {
            return None;
        }
        cx.tell(CompileStage::Building { triangles: triangles.len() as u64 });
        let tree = TriangleTree::build(&[], &[]);
        let mut mesh = Mesh { positions, triangles, normals, uvs, colors, parts, tree };
        // Copies of a triangle are one, but where rays may treat them differently: by their surface, or by the side
        // that their normals say is the front
        let own = |triangle| if self.keeps_copies { triangle } else { 0 };
        let class = |triangle| (classes[mesh.part_index(triangle)], mesh.is_turned(triangle), own(triangle));
        mesh.tree = TriangleTree::build_distinct(&mesh.positions, &mesh.triangles, class);
        Some(mesh)
    }
}

impl Lists {
    fn add(&mut self, source: JoinedSource, origin: DVec3, has_tangents: bool) {
        let JoinedSource { data, uv_set, transform, surface, class, materials, numbers, .. } = source;
        let mut data = Arc::unwrap_or_clone(data);
        move_mesh(&mut data, transform, origin);
        let (vertices, first) = (self.positions.len(), self.triangles.len());
        let MeshData { positions, mut triangles, normals, mut uvs, colors, face_materials, .. } = data;
        let added = positions.len();
        let own_uvs = if uv_set < uvs.len() { uvs.swap_remove(uv_set) } else { Vec::new() };
        self.classes.push(class);
        let tangents = match has_tangents && !own_uvs.is_empty() {
            true => tangents::tangents(&positions, &triangles, &normals, &own_uvs),
            false => Vec::new(),
        };
        self.parts.push(JoinedPart {
            tangents,
            first_triangle: first as u32,
            surface,
            face_materials,
            materials,
            numbers,
            has_uvs: !own_uvs.is_empty(),
        });
        let colors = colors.into_iter().map(|[r, g, b, a]| {
            let [r, g, b] = [r, g, b].map(|c| if c >= 0.0 { c.min(1e6) } else { 0.0 });
            [r, g, b, if a >= 0.0 { a.min(1.0) } else { 0.0 }]
        });
        join(&mut self.normals, vertices, normals, added, [0.0; 3]);
        join(&mut self.uvs, vertices, own_uvs, added, [0.0; 2]);
        join(&mut self.colors, vertices, colors.collect(), added, [1.0; 4]);
        if vertices > 0 {
            triangles.iter_mut().flatten().for_each(|v| *v += vertices as u32);
            self.triangles.extend(triangles);
            self.positions.extend(positions);
        } else {
            (self.positions, self.triangles) = (positions, triangles);
        }
    }
}

/// The bytes of numbers, for a key.
fn numbers(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_bits().to_le_bytes()).collect()
}

/// Says why nothing of a mesh can be hit.
fn advise_nothing(cx: &mut CompileContext, data: &MeshData) {
    let (triangles, corners) = (data.triangles.len(), data.triangles.iter().flatten());
    let finite = corners.map(|v| Vec3::from(data.positions[*v as usize])).filter(|p| p.is_finite());
    let bounds = finite.map(|p| (p, p)).reduce(|(low, high), (p, _)| (low.min(p), high.max(p)));
    let message = match bounds {
        None => format!("none of its {triangles} triangles has a corner that is finite: nothing of it can be seen"),
        Some((low, high)) if low == high => {
            let place = show(&(low.as_dvec3() + DVec3::from(data.origin)).to_array());
            format!("it has no size, all of its {triangles} triangles are at {place}: nothing of it can be seen")
        }
        Some(_) => format!("none of its {triangles} triangles has an area: nothing of it can be seen"),
    };
    cx.advise("", message, Some("look at it in the program that wrote it"));
}

/// The box around all positions that are numbers, moved by `transform`.
fn bounds(data: &MeshData, transform: Option<DAffine3>) -> Option<[DVec3; 2]> {
    let (origin, world_from_mesh) = (DVec3::from(data.origin), transform.unwrap_or(DAffine3::IDENTITY));
    let mut bounds: Option<[DVec3; 2]> = None;
    for p in &data.positions {
        let p = Vec3::from(*p).as_dvec3();
        if p.is_finite() {
            let p = world_from_mesh.transform_point3(p + origin);
            bounds = Some(bounds.map_or([p; 2], |[low, high]| [low.min(p), high.max(p)]));
        }
    }
    bounds
}

/// Moves positions and normals, in f64; positions then count from `origin`.
fn move_mesh(data: &mut MeshData, transform: Option<DAffine3>, origin: DVec3) {
    let own = DVec3::from(data.origin);
    let is_shifted = own != DVec3::ZERO || origin != DVec3::ZERO;
    if transform.is_none() && !is_shifted {
        return;
    }
    let mut transform = transform.unwrap_or(DAffine3::IDENTITY);
    if is_shifted {
        transform.translation = transform.transform_point3(own) - origin;
    }
    let placement = Placement::new(transform);
    for p in &mut data.positions {
        *p = transform.transform_point3(Vec3::from(*p).as_dvec3()).as_vec3().into();
    }
    for n in &mut data.normals {
        let moved = placement.normal(Vec3::from(*n).as_dvec3()).normalize_or_zero();
        *n = moved.as_vec3().into();
    }
    // A mirror turns the corners of every face around
    if transform.matrix3.determinant() < 0.0 {
        data.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}
