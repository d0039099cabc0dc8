//! Models within a scene: each `[[model]]` is replaced by what its file describes, at a moment.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::HashMap;
use std::ops::Range;

use super::SceneDesc;
use crate::context::{Assets, CompileContext};
use crate::describe::Family;
use crate::describe::node::quoted;
use crate::error::{SceneError, Severity};
use crate::import::{MeshFormat, OpenFault, WantedFile, foreign, is_gltf, is_point_set};
use crate::material::MaterialDesc;
use crate::math::{DAffine3, DMat3, DVec3};
use crate::model::{ModelParts, ShownMesh, ShownModel, describe_gltf, describe_mesh, describe_points};
use crate::shape::{MeshFiles, ModelDesc, ShapeDesc, UpAxis, load_mesh_file, read_mesh_bytes, unreadable};
use crate::transform::TransformDesc;

/// What kind of model a file is.
pub(super) enum ModelKind {
    Gltf,
    Mesh(MeshFormat),
    Points,
}

impl ModelKind {
    /// The axis that points upwards, unless it is said.
    pub(super) fn up(&self) -> UpAxis {
        match self {
            ModelKind::Mesh(MeshFormat::Stl) => UpAxis::Z,
            _ => UpAxis::Y,
        }
    }
}

impl SceneDesc {
    /// The description with the parts of its models in place of them, as they are at `time`, in seconds. What lies
    /// within their files is named by its address, as `chair.glb#mesh/0`, so that it means the same picture.
    ///
    /// # Errors
    /// What is wrong with the models and their files.
    pub fn without_models(&self, assets: &dyn Assets, time: f64) -> Result<SceneDesc, SceneError> {
        let cx = &mut CompileContext::at_time(time);
        let mut desc = self.with_models(cx, assets, &mut MeshFiles::default()).into_owned();
        let mut faults = cx.take_faults();
        faults.retain(|fault| fault.severity == Severity::Error);
        desc.sort();
        if faults.is_empty() { Ok(desc) } else { Err(SceneError { faults }) }
    }

    /// The description with the parts of its models in place of them, at the moment of `cx`; as it is without models.
    /// What is wrong with their files is said at `model[i]`.
    pub(super) fn with_models(
        &self,
        cx: &mut CompileContext,
        assets: &dyn Assets,
        files: &mut MeshFiles<'_>,
    ) -> Cow<'_, SceneDesc> {
        let grouped = self.groups.iter().flat_map(|(_, group)| &group.shapes);
        if !self.shapes.iter().chain(grouped).any(|shape| matches!(shape, ShapeDesc::Model(_))) {
            return Cow::Borrowed(self);
        }
        let mut desc = self.clone();
        let shapes = std::mem::take(&mut desc.shapes);
        desc.shapes = desc.replace_models(cx, assets, files, "", shapes);
        for i in 0..desc.groups.len() {
            let shapes = std::mem::take(&mut desc.groups[i].1.shapes);
            let prefix = format!("group.{}.", desc.groups[i].0);
            desc.groups[i].1.shapes = desc.replace_models(cx, assets, files, &prefix, shapes);
        }
        Cow::Owned(desc)
    }

    /// The shapes of the scene, or of a group, with the parts of models in place of them. All else that models bring
    /// is added to the description.
    fn replace_models(
        &mut self,
        cx: &mut CompileContext,
        assets: &dyn Assets,
        files: &mut MeshFiles<'_>,
        prefix: &str,
        shapes: Vec<ShapeDesc>,
    ) -> Vec<ShapeDesc> {
        let mut all = Vec::with_capacity(shapes.len());
        let mut ranges = Vec::new();
        for shape in shapes {
            let ShapeDesc::Model(mut model) = shape else {
                all.push(shape);
                continue;
            };
            let first = all.len();
            cx.within(&format!("{prefix}model[{}]", ranges.len()), |cx| {
                model.keep_known_materials(cx, &self.materials);
                let parts = model.parts(cx, assets, files);
                let placed = TransformDesc::compile_field(model.transform.as_deref(), cx);
                if let Some((parts, up)) = parts {
                    let world_from_model = placed.unwrap_or(DAffine3::IDENTITY) * up;
                    self.add_parts(cx, &model, parts, world_from_model, &mut all, prefix.is_empty());
                }
            });
            ranges.push(first..all.len());
        }
        // Number the parts as they are compiled
        let mut counts: HashMap<usize, usize> = HashMap::new();
        for (i, shape) in all.iter().enumerate() {
            let count = counts.entry(shape.kind_index()).or_default();
            if let Ok(model) = ranges.binary_search_by(|range| order(range, i)) {
                let part = format!("{prefix}{}[{count}]", shape.kind());
                cx.within(&format!("{prefix}model[{model}]"), |cx| cx.stands_in(part, true));
            }
            *count += 1;
        }
        all
    }

    fn add_parts(
        &mut self,
        cx: &mut CompileContext,
        model: &ModelDesc,
        mut parts: ModelParts,
        world_from_model: DAffine3,
        shapes: &mut Vec<ShapeDesc>,
        is_scene: bool,
    ) {
        for (name, texture) in &parts.textures {
            cx.stands_in(format!("texture.{}.{name}", texture.kind()), false);
        }
        for (name, material) in &parts.materials {
            cx.stands_in(format!("material.{}.{name}", material.kind()), false);
        }
        // A file that several models show brings the same names again
        add_new(&mut self.textures, parts.textures);
        add_new(&mut self.materials, parts.materials);
        // Those of another variant hold other materials
        let mut renamed: HashMap<String, String> = HashMap::new();
        let mut known: HashMap<String, usize> =
            self.groups.iter().enumerate().map(|(i, (name, _))| (name.clone(), i)).collect();
        for (name, group) in parts.groups {
            let numbered = |number: u64| if number == 1 { name.clone() } else { format!("{name} {number}") };
            let mut number = 1;
            let of = loop {
                let of = numbered(number);
                match known.get(&of) {
                    Some(&index) if self.groups[index].1 == group => break of,
                    Some(_) => number += 1,
                    None => {
                        cx.stands_in(format!("group.{of}.mesh[0]"), false);
                        known.insert(of.clone(), self.groups.len());
                        self.groups.push((of.clone(), group));
                        break of;
                    }
                }
            };
            renamed.insert(name, of);
        }
        for part in parts.shapes {
            let mut shape = part.shape;
            if let ShapeDesc::Instance(instance) = &mut shape
                && let Some(of) = renamed.get(&instance.of)
            {
                instance.of.clone_from(of);
            }
            model.overlay(&mut shape, world_from_model * part.model_from_shape);
            shapes.push(shape);
        }
        if model.lights && is_scene {
            for mut light in parts.lights {
                let transform = transform_of(&world_from_model);
                light.set_transform(transform);
                light.set_name(model.named(light.name().as_deref()));
                self.lights.push(light);
            }
            self.lights.sort_by_key(Family::kind_index);
        }
        if model.cameras && is_scene {
            for (_, camera) in &mut parts.cameras {
                camera.transform = transform_of(&world_from_model);
            }
            add_new(&mut self.cameras, parts.cameras);
        }
    }
}

/// Where a range of numbers lies: before `i`, around it, or after it.
fn order(range: &Range<usize>, i: usize) -> Ordering {
    match () {
        () if range.end <= i => Ordering::Less,
        () if range.start > i => Ordering::Greater,
        () => Ordering::Equal,
    }
}

/// Adds what has a name that is not there yet.
fn add_new<T>(list: &mut Vec<(String, T)>, more: Vec<(String, T)>) {
    let known: std::collections::HashSet<String> = list.iter().map(|(name, _)| name.clone()).collect();
    list.extend(more.into_iter().filter(|(name, _)| !known.contains(name)));
}

/// The transform, as a description says it.
fn transform_of(affine: &DAffine3) -> Option<Box<TransformDesc>> {
    if *affine == DAffine3::IDENTITY {
        return None;
    }
    let [x, y, z] = [0, 1, 2].map(|row| affine.matrix3.row(row));
    let t = affine.translation;
    let matrix = Some([x.x, x.y, x.z, t.x, y.x, y.y, y.z, t.y, z.x, z.y, z.z, t.z]);
    Some(Box::new(TransformDesc { matrix, ..TransformDesc::default() }))
}

impl ModelDesc {
    /// What the file describes, and the way from its axes to those of scenes. `None` after an error.
    pub(super) fn parts(
        &self,
        cx: &mut CompileContext,
        assets: &dyn Assets,
        files: &mut MeshFiles<'_>,
    ) -> Option<(ModelParts, DAffine3)> {
        let (kind, file) = (self.kind(cx, assets, files)?, self.file.0.as_str());
        self.refuse_fields(cx, matches!(kind, ModelKind::Gltf));
        let chosen = |name: &str| self.materials.get(name).map(str::to_owned);
        let up = kind.up();
        let (parts, names) = match kind {
            ModelKind::Points => (describe_points(file, self.unlit), Vec::new()),
            ModelKind::Mesh(_) => {
                let (data, _) = load_mesh_file(cx, assets, &self.file, files)?;
                let names = data.materials.clone();
                {
                    let shown =
                        ShownMesh { file, smooth_deg: self.smooth_deg, unlit: self.unlit, chosen: &chosen, assets };
                    (describe_mesh(&data, &shown), names)
                }
            }
            ModelKind::Gltf => {
                let gltf = match files.open.gltf.open(file, assets) {
                    Ok(gltf) => gltf,
                    Err(OpenFault::Read(error)) => {
                        unreadable(cx, &self.file, &error);
                        return None;
                    }
                    Err(OpenFault::Damaged(error)) => {
                        cx.error("file", error.to_string(), None);
                        return None;
                    }
                };
                // An animation without a moment of its own plays with the scene
                let plays = self.animation.is_some() && self.time.is_none();
                cx.keyed |= plays;
                let shown = ShownModel {
                    file,
                    variant: self.variant.as_deref(),
                    scene: self.scene.map(|scene| scene as usize),
                    animation: self.animation.as_deref(),
                    time: if plays { Some(cx.time) } else { self.time },
                    chosen: &chosen,
                    unlit: self.unlit,
                    assets,
                };
                match describe_gltf(&gltf, &shown) {
                    Ok(parts) => (parts, gltf.material_names()),
                    Err(fault) => {
                        cx.error("file", fault.into_error(file).to_string(), None);
                        return None;
                    }
                }
            }
        };
        for (name, _) in &self.materials.0 {
            if !names.contains(name) {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                cx.unknown("materials", "material of the file", name, &names);
            }
        }
        self.tell(cx, &parts);
        Some((parts, self.upright(up)))
    }

    /// Says what the reader had to say.
    pub(super) fn tell(&self, cx: &mut CompileContext, parts: &ModelParts) {
        let file = quoted(&self.file.0);
        for warning in &parts.warnings {
            cx.warning("file", format!("{file}: {}", warning.message), Some(&warning.hint));
        }
        for note in &parts.notes {
            cx.advise("file", format!("{file}: {}", note.message), Some(&note.hint));
        }
    }

    /// The way from the axes of the file, of which `up` is upwards unless it is said, to those of scenes.
    pub(super) fn upright(&self, up: UpAxis) -> DAffine3 {
        let turned = DAffine3 { matrix3: DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y), translation: DVec3::ZERO };
        if self.up.unwrap_or(up) == UpAxis::Z { turned } else { DAffine3::IDENTITY }
    }

    /// Refuses materials that the scene does not describe, and goes on without them.
    fn keep_known_materials(&mut self, cx: &mut CompileContext, materials: &[(String, MaterialDesc)]) {
        if self.material.is_none() && self.materials.0.is_empty() {
            return;
        }
        let names: Vec<&str> = materials.iter().map(|(name, _)| name.as_str()).collect();
        let mut is_known = |field: &str, name: &String| {
            let is_known = names.contains(&name.as_str());
            if !is_known {
                cx.unknown(field, "material", name, &names);
            }
            is_known
        };
        self.material = self.material.take().filter(|name| is_known("material", name));
        self.materials.0.retain(|(_, name)| is_known("materials", name));
    }

    /// What kind of file it is: by its ending, else by its content. `None` after an error.
    pub(super) fn kind(
        &self,
        cx: &mut CompileContext,
        assets: &dyn Assets,
        files: &mut MeshFiles<'_>,
    ) -> Option<ModelKind> {
        let file = &self.file.0;
        let ending = file.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
        match ending.as_deref() {
            Some("gltf" | "glb") => return Some(ModelKind::Gltf),
            Some("obj") => return Some(ModelKind::Mesh(MeshFormat::Obj)),
            Some("stl") => return Some(ModelKind::Mesh(MeshFormat::Stl)),
            _ => {}
        }
        let (bytes, _) = read_mesh_bytes(cx, assets, &self.file, files)?;
        if is_gltf(&bytes) {
            Some(ModelKind::Gltf)
        } else if is_point_set(&bytes[..bytes.len().min(HEAD)]) {
            Some(ModelKind::Points)
        } else if let Some(foreign) = foreign(&bytes, WantedFile::Model) {
            let message = format!("{}: {}", quoted(file), foreign.message(WantedFile::Model));
            cx.error("file", message, Some(foreign.hint(WantedFile::Model)));
            None
        } else if let Some(format) = MeshFormat::detect(file, &bytes) {
            Some(ModelKind::Mesh(format))
        } else {
            let message = format!("{}: is not a model of a known kind", quoted(file));
            cx.error("file", message, Some("give a glTF, GLB, OBJ, PLY or STL file"));
            None
        }
    }

    /// Refuses fields that files of the other kinds have no use for.
    pub(super) fn refuse_fields(&self, cx: &mut CompileContext, is_gltf: bool) {
        if let Some(time) = self.time {
            cx.between("time", time, -1e9, 1e9, Some("in seconds"));
        }
        let of_gltf = [
            ("variant", self.variant.is_some()),
            ("scene", self.scene.is_some()),
            ("animation", self.animation.is_some()),
            ("time", self.time.is_some()),
            ("lights", self.lights),
            ("cameras", self.cameras),
        ];
        let others = [("smooth_deg", self.smooth_deg.is_some())];
        let wrong = if is_gltf { &others[..] } else { &of_gltf[..] };
        for (field, _) in wrong.iter().filter(|(_, said)| *said) {
            let message = if is_gltf { "it is for files that are no glTF" } else { "it is for glTF files" };
            cx.error(field, message, Some("leave it out"));
        }
    }

    /// The name of a part.
    fn named(&self, part: Option<&str>) -> Option<String> {
        match (self.name.as_deref(), part) {
            (Some(model), Some(part)) => Some(format!("{model}/{part}")),
            (model, part) => model.or(part).map(str::to_owned),
        }
    }

    /// Says of a part what the model says of all of them.
    fn overlay(&self, part: &mut ShapeDesc, world_from_shape: DAffine3) {
        macro_rules! overlay {
            ($desc:expr) => {{
                $desc.name = self.named($desc.name.as_deref());
                $desc.transform = transform_of(&world_from_shape);
                $desc.visible &= self.visible;
                $desc.casts_shadow &= self.casts_shadow;
                $desc.receives_shadow &= self.receives_shadow;
                $desc.single_sided |= self.single_sided;
                $desc.lights_include.clone_from(&self.lights_include);
                $desc.lights_exclude.clone_from(&self.lights_exclude);
                $desc.shadow_include.clone_from(&self.shadow_include);
                $desc.shadow_exclude.clone_from(&self.shadow_exclude);
                if self.material.is_some() {
                    $desc.material.clone_from(&self.material);
                }
            }};
        }
        match part {
            ShapeDesc::Mesh(mesh) => {
                overlay!(mesh);
                if let Some(material) = &self.material {
                    mesh.materials.iter_mut().for_each(|own| own.clone_from(material));
                }
            }
            ShapeDesc::PointSet(points) => overlay!(points),
            ShapeDesc::Instance(instance) => overlay!(instance),
            _ => {}
        }
    }
}

/// Bytes that tell what a file is.
const HEAD: usize = 1 << 16;
