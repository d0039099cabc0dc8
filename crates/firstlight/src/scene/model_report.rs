//! What a model file holds, from its readers and from what it describes.
//!
//! The file is read as for a picture, but for what scenes repair: the facts about its meshes are those of the file.

use std::collections::HashMap;

use super::models::ModelKind;
use super::studio::StudioSettings;
use super::{Parsed, SceneDesc};
use crate::context::{Assets, CompileContext};
use crate::describe::{Family, TextValue};
use crate::error::{SceneError, Severity};
use crate::import::{Contained, Gltf, GltfFault, MeshData, MeshFormat};
use crate::material::MaterialDesc;
use crate::math::{DAffine3, DVec3};
use crate::model::{
    ModelFile, ModelMaterial, ModelMesh, ModelParts, ModelPicture, ModelReport, ShownMesh, describe_mesh,
    describe_points, gltf_contents, gltf_uv_sets,
};
use crate::shape::{GroupDesc, MeshDesc, MeshFiles, ModelDesc, ShapeDesc, parse_mesh_file, read_mesh_bytes};
use crate::texture::{ImageTextureDesc, TextureDesc};

/// The largest picture that is looked at, in bytes.
const MAX_PICTURE: u64 = 1 << 30;
/// Of all meshes together, as often as they are shown, the place of so many vertices is found; beyond that the box
/// around a mesh stands for it.
const MAX_PLACED_VERTICES: u64 = 1 << 27;

impl SceneDesc {
    /// What a model file holds and what is odd about it, shown by itself as `settings` say, at `time` in seconds.
    ///
    /// # Errors
    /// The file cannot be shown.
    pub fn model_report(
        file: &str,
        settings: &StudioSettings,
        assets: &dyn Assets,
        time: f64,
    ) -> Result<ModelReport, SceneError> {
        let cx = &mut CompileContext::at_time(time);
        let is_model = |shape| if let ShapeDesc::Model(model) = shape { Some(model) } else { None };
        let model = SceneDesc::of_model(file, settings).shapes.into_iter().find_map(is_model);
        let report = model.and_then(|model| cx.within("model[0]", |cx| model.report(cx, assets)));
        let faults = cx.take_faults();
        match report {
            Some(report) if faults.iter().all(|fault| fault.severity == Severity::Warning) => {
                Ok(ModelReport { warnings: faults, notes: cx.take_advice(), ..report })
            }
            _ => Err(SceneError { faults }),
        }
    }
}

impl Parsed {
    /// As [`SceneDesc::model_report`], of the model that it shows; what is wrong with it is said of its file. `None` of
    /// what is no model by itself.
    pub fn model_report(&self, assets: &dyn Assets, time: f64) -> Option<Result<ModelReport, SceneError>> {
        let (file, settings) = self.model_file()?;
        let report = SceneDesc::model_report(file, settings, assets, time);
        Some(match report {
            Ok(report) => {
                Ok(ModelReport { warnings: self.of_file(report.warnings), notes: self.of_file(report.notes), ..report })
            }
            Err(error) => Err(SceneError { faults: self.of_file(error.faults) }),
        })
    }
}

/// The meshes that are shown, and the box around them.
#[derive(Default)]
struct ShownMeshes {
    meshes: Vec<ModelMesh>,
    /// Those that are there, by their files.
    known: HashMap<String, usize>,
    bounds: Option<[DVec3; 2]>,
    /// Vertices whose place was found.
    placed: u64,
}

impl ModelDesc {
    /// `None` after an error.
    fn report(&self, cx: &mut CompileContext, assets: &dyn Assets) -> Option<ModelReport> {
        let mut files = MeshFiles::default();
        let mut report = ModelReport::default();
        let file = self.file.0.as_str();
        let kind = self.kind(cx, assets, &mut files)?;
        let mut shown = ShownMeshes::default();
        let parts = match kind {
            ModelKind::Gltf => {
                let (parts, up) = self.parts(cx, assets, &mut files)?;
                let gltf = files.open.gltf.open(file, assets).ok()?;
                let filled = gltf_contents(&gltf, file, assets, &mut report);
                if let Err(fault) = filled.and_then(|()| shown.add_all(&parts, &gltf, up)) {
                    cx.error("file", fault.into_error(file).to_string(), None);
                    return None;
                }
                parts
            }
            ModelKind::Mesh(_) | ModelKind::Points => {
                self.refuse_fields(cx, false);
                let (bytes, _) = read_mesh_bytes(cx, assets, &self.file, &mut files)?;
                let data = parse_mesh_file(cx, &self.file, &bytes)?;
                let parts = if let ModelKind::Points = kind {
                    describe_points(file, self.unlit)
                } else {
                    let shown =
                        ShownMesh { file, smooth_deg: self.smooth_deg, unlit: self.unlit, chosen: &|_| None, assets };
                    describe_mesh(&data, &shown)
                };
                self.tell(cx, &parts);
                report.format = match &kind {
                    ModelKind::Mesh(MeshFormat::Obj) => "OBJ",
                    ModelKind::Mesh(MeshFormat::Stl) => "STL",
                    _ => "PLY",
                };
                report.files.push(ModelFile { file: file.to_owned(), bytes: Some(bytes.len() as u64) });
                report.of_mesh(&data, &parts, assets);
                shown.add_alone(file, &data, &parts, self.upright(kind.up()));
                parts
            }
        };
        report.cameras = parts.cameras.iter().map(|(name, _)| name.clone()).collect();
        report.lights = parts.lights.iter().map(|light| (light.kind(), light.name())).collect();
        report.bounds = shown.bounds.map(|bounds| bounds.map(|corner| corner.to_array()));
        report.meshes = shown.meshes;
        Some(report)
    }
}

impl ModelReport {
    /// What there is to say of a file of one mesh, and of the files of its materials.
    fn of_mesh(&mut self, data: &MeshData, parts: &ModelParts, assets: &dyn Assets) {
        (self.counts.meshes, self.counts.primitives) = (1, 1);
        let spare = &parts.spare;
        for (file, bytes) in &spare.files {
            self.files.push(ModelFile { file: file.clone(), bytes: *bytes });
        }
        let of = |name: &String, used| ModelMaterial { name: name.clone(), named: true, used };
        let named = data.materials.iter().filter(|name| !name.is_empty());
        self.materials = named.map(|name| of(name, true)).collect();
        self.materials.extend(spare.materials.iter().map(|name| of(name, false)));
        self.counts.materials = self.materials.len() as u64;
        // Each picture once, with all that it is used for
        let described = Described::new(parts);
        let mut uses: Vec<(String, Vec<String>)> = Vec::new();
        let mut known: HashMap<&str, usize> = HashMap::new();
        for (_, material) in &parts.materials {
            for (of, texture) in textures_of(material) {
                let Some(image) = described.textures.get(texture.as_str()) else { continue };
                let index = *known.entry(&image.file.0).or_insert_with(|| {
                    uses.push((image.file.0.clone(), Vec::new()));
                    uses.len() - 1
                });
                if !uses[index].1.contains(&of) {
                    uses[index].1.push(of);
                }
            }
        }
        let unused = spare.pictures.iter().filter(|file| !known.contains_key(file.as_str()));
        uses.extend(unused.map(|file| (file.clone(), Vec::new())));
        let read = |(file, uses): (String, Vec<String>)| {
            let bytes = assets.read(&file, MAX_PICTURE).map_err(|error| error.to_string());
            ModelPicture::new(file, bytes, uses)
        };
        self.pictures = uses.into_iter().map(read).collect();
    }
}

impl ShownMeshes {
    /// The shapes of a glTF file; `up` makes them upright.
    fn add_all(&mut self, parts: &ModelParts, gltf: &Gltf, up: DAffine3) -> Result<(), GltfFault> {
        let described = Described::new(parts);
        let groups: HashMap<&str, &GroupDesc> = parts.groups.iter().map(|(name, group)| (&**name, group)).collect();
        let mut points: HashMap<usize, Vec<DVec3>> = HashMap::new();
        for shape in &parts.shapes {
            let (shown, name) = match &shape.shape {
                ShapeDesc::Instance(instance) => {
                    let group = groups.get(instance.of.as_str());
                    (group.and_then(|group| group.shapes.first()), instance.name.as_deref())
                }
                shown => (Some(shown), None),
            };
            let Some(ShapeDesc::Mesh(mesh)) = shown else { continue };
            let Some(file) = mesh.file.as_ref().map(|file| file.0.as_str()) else { continue };
            let index = match self.known.get(file) {
                Some(index) => *index,
                None => {
                    let Some((_, Contained::Mesh(address))) = Contained::split(file) else { continue };
                    let data = gltf.mesh(&address)?;
                    let sets = gltf_uv_sets(gltf, &address)?;
                    let lacks = described.lacking(mesh, |primitive| sets.get(primitive).copied().unwrap_or(0));
                    let index = self.add(file, name.or(mesh.name.as_deref()), &data, described.is_single_sided(mesh));
                    self.meshes[index].lacks_uv = lacks;
                    points.insert(index, points_of(&data));
                    index
                }
            };
            self.place(index, points.get(&index).map_or(&[], Vec::as_slice), up * shape.model_from_shape);
        }
        Ok(())
    }

    /// The one mesh, or the points, of a file of another kind.
    fn add_alone(&mut self, file: &str, data: &MeshData, parts: &ModelParts, up: DAffine3) {
        let described = Described::new(parts);
        let none = MeshDesc::default();
        let mesh = match parts.shapes.first().map(|part| &part.shape) {
            Some(ShapeDesc::Mesh(mesh)) => mesh,
            _ => &none,
        };
        let index = self.add(file, None, data, described.is_single_sided(mesh));
        self.meshes[index].lacks_uv = described.lacking(mesh, |_| data.uvs.len());
        self.place(index, &points_of(data), up);
    }

    fn add(&mut self, file: &str, name: Option<&str>, data: &MeshData, single_sided: bool) -> usize {
        self.known.insert(file.to_owned(), self.meshes.len());
        self.meshes.push(ModelMesh {
            name: name.unwrap_or_default().to_owned(),
            file: file.to_owned(),
            report: data.report(),
            materials: data.materials.clone(),
            material_files: data.material_files.clone(),
            parts: data.parts.clone(),
            single_sided,
            has_radii: !data.radii.is_empty(),
            notes: data.notes.clone(),
            ..ModelMesh::default()
        });
        self.meshes.len() - 1
    }

    /// Counts a place of a mesh, and makes room for it in the box.
    fn place(&mut self, index: usize, points: &[DVec3], world_from_mesh: DAffine3) {
        let mesh = &mut self.meshes[index];
        mesh.placed += 1;
        mesh.mirrored += u64::from(world_from_mesh.matrix3.determinant() < 0.0);
        let Some([low, high]) = mesh.report.bounds.map(|bounds| bounds.map(DVec3::from)) else { return };
        self.placed = self.placed.saturating_add(points.len() as u64);
        let mut take = |point: DVec3| {
            let there = world_from_mesh.transform_point3(point);
            let [least, most] = self.bounds.unwrap_or([there; 2]);
            self.bounds = Some([least.min(there), most.max(there)]);
        };
        if self.placed > MAX_PLACED_VERTICES {
            for corner in 0..8u8 {
                let of = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
                take(DVec3::new(of(0), of(1), of(2)));
            }
        } else {
            points.iter().for_each(|point| take(*point));
        }
    }
}

/// The places of the vertices that are shown, as the file has them.
fn points_of(data: &MeshData) -> Vec<DVec3> {
    let (used, origin) = (data.used_vertices(), DVec3::from(data.origin));
    let shown = data.positions.iter().zip(used).filter(|(position, used)| {
        (*used || data.triangles.is_empty()) && position.iter().all(|coordinate| coordinate.is_finite())
    });
    shown.map(|(position, _)| DVec3::from(position.map(f64::from)) + origin).collect()
}

/// What a model describes, by its names.
struct Described<'a> {
    materials: HashMap<&'a str, &'a MaterialDesc>,
    textures: HashMap<&'a str, &'a ImageTextureDesc>,
}

impl<'a> Described<'a> {
    fn new(parts: &'a ModelParts) -> Self {
        let image = |(name, desc): &'a (String, TextureDesc)| match desc {
            TextureDesc::Image(image) => Some((name.as_str(), image)),
            _ => None,
        };
        Described {
            materials: parts.materials.iter().map(|(name, material)| (name.as_str(), material)).collect(),
            textures: parts.textures.iter().filter_map(image).collect(),
        }
    }

    /// Whether one of the materials of a mesh is seen from the front alone.
    fn is_single_sided(&self, mesh: &MeshDesc) -> bool {
        let is = |name: &String| {
            let material = self.materials.get(name.as_str());
            material.is_some_and(|material| material.write().contains(&("single_sided", TextValue::Bool(true))))
        };
        mesh.materials.iter().any(is)
    }

    /// The materials of a mesh whose textures are laid by sets that its faces do not have; `sets` is how many those of
    /// the material of that number have.
    fn lacking(&self, mesh: &MeshDesc, sets: impl Fn(usize) -> usize) -> Vec<String> {
        let lacks = |(i, name): &(usize, &String)| {
            let textures = self.materials.get(name.as_str()).map_or_else(Vec::new, |material| textures_of(material));
            textures.iter().any(|(_, texture)| {
                let image = self.textures.get(texture.as_str());
                image.is_some_and(|image| image.uv_set.unwrap_or(0) as usize >= sets(*i))
            })
        };
        let found = mesh.materials.iter().enumerate().filter(lacks).map(|(_, name)| name.clone());
        let mut found: Vec<String> = found.collect();
        found.sort();
        found.dedup();
        found
    }
}

/// The textures of a material, with what for: `base color`, `normal map`.
fn textures_of(material: &MaterialDesc) -> Vec<(String, String)> {
    let texture = |(key, value): (&'static str, TextValue)| {
        let name = match value {
            TextValue::Text(name) if key.ends_with("_map") => name,
            TextValue::Table(fields) => match fields.into_iter().find(|(key, _)| *key == "texture")?.1 {
                TextValue::Text(name) => name,
                _ => return None,
            },
            _ => return None,
        };
        Some((key.replace('_', " "), name))
    };
    material.write().into_iter().filter_map(texture).collect()
}
