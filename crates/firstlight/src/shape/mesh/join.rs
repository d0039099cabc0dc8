//! Meshes of one space, joined in one.

use std::sync::Arc;

use glam::DAffine3;

use super::surface::{JoinedPart, Mesh, NamedUvSet};
use super::{MAX_COORDINATE, MeshSource, NamedSets, tangents};
use crate::context::{CompileContext, CompileStage, show};
use crate::ids::MaterialId;
use crate::import::MeshData;
use crate::math::{DVec3, Vec3};
use crate::shape::cache::{CompileCache, ContentKey, key_of};
use crate::shape::placement::Placement;
use crate::shape::surface::UV_SETS;
use crate::shape::triangles::{TriangleTree, can_be_hit};

/// What a mesh takes while its tree is built: a position, a normal and texture coordinates; three indices, the tree,
/// and what building it needs. Measured on a surface of 500,000 triangles, whose peak this meets within a tenth.
const VERTEX_BYTES: u64 = 32;
const TRIANGLE_BYTES: u64 = 120;

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
    named: NamedSets,
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
        let MeshSource { data, uv_set, content, numbers, named } = source;
        let counts = [self.counts[0] + data.positions.len(), self.counts[1] + data.triangles.len()];
        if counts.iter().any(|count| *count > u32::MAX as usize) {
            let message = "the meshes of one group have more than 4294967295 vertices or triangles together";
            cx.error("file", message, Some("put some of them in a group of their own"));
            return;
        }
        let bytes = VERTEX_BYTES * data.positions.len() as u64 + TRIANGLE_BYTES * data.triangles.len() as u64;
        if !cx.take("file", "this mesh and its tree", bytes) {
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
        let source = JoinedSource { data, uv_set, named, content, transform, surface, class, materials, numbers };
        self.sources.push(source);
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
            let NamedSets { all, maps, .. } = source.named;
            let whole = [source.uv_set as u32, source.surface, source.class, all.into(), maps.into()].into_iter();
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
        let JoinedSource { data, uv_set, named, transform, surface, class, materials, numbers, .. } = source;
        let mut data = Arc::unwrap_or_clone(data);
        move_mesh(&mut data, transform, origin);
        let (vertices, first) = (self.positions.len(), self.triangles.len());
        let MeshData { positions, mut triangles, normals, tangents: given, mut uvs, colors, face_materials, .. } = data;
        let added = positions.len();
        let mut take = |set: usize| uvs.get_mut(set).map_or(Vec::new(), std::mem::take);
        let own_uvs = take(uv_set);
        self.classes.push(class);
        let tangents_by = |uvs: &[[f32; 2]], are_needed: bool| match are_needed && !uvs.is_empty() {
            true => tangents::of_corners(&given, &positions, &triangles, &normals, uvs),
            false => Vec::new(),
        };
        let tangents = tangents_by(&own_uvs, has_tangents);
        let numbers_of_sets = (0..UV_SETS as u8).filter(|set| named.all >> set & 1 == 1);
        let uv_sets = numbers_of_sets.map(|number| {
            let uvs = take(number.into());
            NamedUvSet { number, tangents: tangents_by(&uvs, named.maps >> number & 1 == 1), uvs }
        });
        let uv_sets = uv_sets.collect();
        self.parts.push(JoinedPart {
            tangents,
            uv_sets,
            first_triangle: first as u32,
            first_vertex: vertices as u32,
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

/// Moves positions, normals and tangents, in f64; positions then count from `origin`.
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
    let is_mirror = transform.matrix3.determinant() < 0.0;
    for [x, y, z, sign] in &mut data.tangents {
        let moved = transform.transform_vector3(Vec3::new(*x, *y, *z).as_dvec3()).normalize_or_zero();
        [*x, *y, *z] = moved.as_vec3().into();
        // Normal x tangent does not follow a mirror
        *sign = if is_mirror { -*sign } else { *sign };
    }
    // A mirror turns the corners of every face around
    if is_mirror {
        data.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}
