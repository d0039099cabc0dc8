//! glTF files as descriptions: nodes with meshes become shapes, their materials, lights and cameras those of scenes.
//!
//! - this file: nodes, instances, lights, cameras;
//! - [`material`]: materials, textures, and the extensions that change them;
//! - [`extensions`]: what is read of all extensions, and what to do about the others;
//! - [`contents`]: what a file holds, for reports.

mod contents;
mod extensions;
mod material;
#[cfg(test)]
mod tests;

use std::collections::HashMap;

use super::{ModelParts, ModelShape, ModelWarning, UniqueNames};
use crate::camera::{CameraDesc, Projection};
use crate::context::Assets;
use crate::describe::{ColorDesc, FilePath};
use crate::import::{Gltf, GltfFault, GltfNode, JsonPlace, MeshAddress, Pose};
use crate::light::{DirectionalDesc, LightDesc, PointDesc, SpotDesc};
use crate::math::{DAffine3, DVec3};
use crate::shape::{GroupDesc, InstanceDesc, MeshDesc, ShapeDesc};
use crate::transform::is_invertible;
pub(crate) use contents::{gltf_contents, gltf_uv_sets};
use material::Materials;

/// What is shown of a file.
pub(crate) struct ShownModel<'a> {
    /// The file, as the scene names it.
    pub file: &'a str,
    pub variant: Option<&'a str>,
    pub scene: Option<usize>,
    /// The name or the number of an animation.
    pub animation: Option<&'a str>,
    /// The moment of the animation, in seconds; `None` for the model at rest.
    pub time: Option<f64>,
    /// The scene's own material for one of the file, by its name there.
    pub chosen: &'a dyn Fn(&str) -> Option<String>,
    /// Whether materials show their colours, whatever light there is.
    pub unlit: bool,
    /// Where pictures come from that lie beside the file.
    pub assets: &'a dyn Assets,
}

/// Most instances of all nodes together.
const MAX_INSTANCES: usize = 1 << 22;
/// Bytes that a place of a mesh counts for, and the name of each of its materials: less than a file may take for the 12
/// bytes of a place that is right.
const PLACE_BYTES: u64 = 256;
const MATERIAL_BYTES: u64 = 64;

/// What the file describes.
pub(crate) fn describe(gltf: &Gltf, shown: &ShownModel<'_>) -> Result<ModelParts, GltfFault> {
    let mut parts = ModelParts::default();
    extensions::check(&gltf.root(), &mut parts.warnings)?;
    let pose = pose(gltf, shown)?;
    let nodes = gltf.nodes(pose.as_ref())?;
    let order = gltf.scene_nodes(shown.scene)?;
    let mut importer = Importer {
        gltf,
        shown,
        materials: Materials::new(gltf, shown)?,
        shared: shared_meshes(gltf, &order)?,
        left_out: vec![false; gltf.root().count("meshes")],
        grouped: HashMap::new(),
        camera_names: UniqueNames::default(),
        parts,
        placed: 0,
    };
    for index in order {
        importer.node(&nodes[index], pose.as_ref())?;
    }
    let mut parts = importer.parts;
    importer.materials.finish(&mut parts);
    Ok(parts)
}

/// The moment of the animation that is shown.
fn pose(gltf: &Gltf, shown: &ShownModel<'_>) -> Result<Option<Pose>, GltfFault> {
    let root = gltf.root();
    let animations = root.list("animations")?;
    let wanted = match (shown.animation, shown.time) {
        (None, None) => return Ok(None),
        (None, Some(_)) if animations.is_empty() => return Ok(None),
        (None, Some(_)) => "0",
        (Some(name), _) => name,
    };
    let named = animations.iter().position(|animation| animation.text_of("name") == Some(wanted));
    let numbered = || wanted.parse::<usize>().ok().filter(|index| *index < animations.len());
    let Some(animation) = named.or_else(numbered) else {
        let names = animations.iter().map(|animation| animation.text_of("name").unwrap_or_default());
        return Err(no_such(&root, "animation", wanted, &names.collect::<Vec<_>>()));
    };
    Ok(Some(Pose { animation, time: shown.time.unwrap_or(0.0) }))
}

/// That nothing of a kind has a name, and which names there are.
fn no_such(at: &JsonPlace<'_>, kind: &str, name: &str, names: &[&str]) -> GltfFault {
    const SHOWN: usize = 12;
    let hint = match names.len() {
        0 => format!("the file has no {kind}"),
        count => {
            let first: Vec<String> = names.iter().take(SHOWN).map(|name| format!("{name:?}")).collect();
            let more = if count > SHOWN { format!(" and {} more", count - SHOWN) } else { String::new() };
            format!("the file has {}{more}", first.join(", "))
        }
    };
    GltfFault { hint, ..at.fault(format!("there is no {kind} {name:?}")) }
}

/// Which meshes are shown more than once as they are, and so become groups.
fn shared_meshes(gltf: &Gltf, order: &[usize]) -> Result<Vec<bool>, GltfFault> {
    let root = gltf.root();
    let mut uses = vec![0usize; root.count("meshes")];
    for index in order {
        let node = root.nth("nodes", *index)?;
        if let Some(mesh) = node.get("mesh") {
            let placed = if node.extension(INSTANCING).is_some() { 2 } else { 1 };
            root.of_index("meshes", &mesh)?;
            uses[mesh.index()?] += placed;
        }
    }
    Ok(uses.iter().map(|uses| *uses > 1).collect())
}

const INSTANCING: &str = "EXT_mesh_gpu_instancing";
const LIGHTS: &str = "KHR_lights_punctual";

/// Makes the parts of a model, node by node.
struct Importer<'a> {
    gltf: &'a Gltf,
    shown: &'a ShownModel<'a>,
    materials: Materials<'a>,
    shared: Vec<bool>,
    /// The meshes without triangles that were told of.
    left_out: Vec<bool>,
    /// The groups of shared meshes.
    grouped: HashMap<usize, String>,
    camera_names: UniqueNames,
    parts: ModelParts,
    placed: usize,
}

impl Importer<'_> {
    fn warn(&mut self, message: String, hint: &str) {
        self.parts.warnings.push(ModelWarning { message, hint: hint.to_owned() });
    }

    fn node(&mut self, node: &GltfNode, pose: Option<&Pose>) -> Result<(), GltfFault> {
        let root = self.gltf.root();
        let at = root.nth("nodes", node.index)?;
        let name = at.text_of("name").filter(|name| !name.is_empty());
        if let Some(mesh) = at.get("mesh") {
            let of_mesh = root.of_index("meshes", &mesh)?.text_of("name").filter(|name| !name.is_empty());
            let name = name.or(of_mesh).map_or_else(|| format!("node {}", node.index), str::to_owned);
            self.mesh(&at, node, (mesh.index()?, name), pose)?;
        }
        let named = || name.map_or_else(|| format!("node {}", node.index), str::to_owned);
        if let Some(light) = at.extension(LIGHTS).and_then(|light| light.get("light")) {
            self.light(&light, named(), node.world)?;
        }
        if let Some(camera) = at.get("camera") {
            let camera = root.of_index("cameras", &camera)?;
            let own = camera.text_of("name").filter(|own| !own.is_empty());
            let called = name.or(own).map_or_else(named, str::to_owned);
            self.camera(&camera, called, node.world)?;
        }
        Ok(())
    }

    fn mesh(
        &mut self,
        at: &JsonPlace<'_>,
        node: &GltfNode,
        (mesh, name): (usize, String),
        pose: Option<&Pose>,
    ) -> Result<(), GltfFault> {
        let shown = self.gltf.root().nth("meshes", mesh)?;
        let modes = shown.list("primitives")?.into_iter().map(|primitive| primitive.index_or("mode", 4));
        if modes.collect::<Result<Vec<_>, _>>()?.iter().all(|mode| *mode < 4) {
            if !std::mem::replace(&mut self.left_out[mesh], true) {
                let message = format!("{}: it holds no triangles, and is left out", shown.pointer());
                self.warn(message, "points and lines of glTF files are not shown");
            }
            return Ok(());
        }
        let is_skinned = at.get("skin").is_some();
        let is_posed = is_skinned || node.weights.is_some();
        let address = if is_posed { MeshAddress::Node(node.index, pose.copied()) } else { MeshAddress::Mesh(mesh) };
        // A skin places its mesh by its bones
        let world = if is_skinned { DAffine3::IDENTITY } else { node.world };
        let places = match at.extension(INSTANCING) {
            Some(instancing) => self.gltf.instances(&instancing)?.iter().map(|own| world * *own).collect(),
            None => vec![world],
        };
        self.placed += places.len();
        if self.placed > MAX_INSTANCES {
            return Err(at.fault(format!("the limit of {MAX_INSTANCES} meshes that nodes show is passed")));
        }
        // Each place becomes a shape of its own, with its materials unless it is an instance of a group
        let is_instance = !is_posed && self.shared[mesh];
        let primitives = if is_instance { 0 } else { shown.count("primitives") };
        let bytes = PLACE_BYTES.saturating_add(MATERIAL_BYTES.saturating_mul(primitives as u64));
        self.gltf.take(at, bytes.saturating_mul(places.len() as u64))?;
        let flat = places.iter().filter(|place| !is_invertible(place)).count();
        if flat > 0 {
            let message = format!("{flat} of {name:?} are left out: a scale of 0, or numbers that are none");
            self.warn(message, "nothing of them could be seen");
        }
        let shape = match (&address, self.shared[mesh]) {
            (MeshAddress::Mesh(_), true) => {
                let group = match self.grouped.get(&mesh) {
                    Some(group) => group.clone(),
                    None => {
                        let group = format!("{}#{address}", self.shown.file);
                        let shapes = vec![self.mesh_shape(mesh, &address, None)?];
                        self.parts.groups.push((group.clone(), GroupDesc { shapes }));
                        self.grouped.insert(mesh, group.clone());
                        group
                    }
                };
                ShapeDesc::Instance(InstanceDesc { name: Some(name), ..InstanceDesc::new(group) })
            }
            _ => self.mesh_shape(mesh, &address, Some(name))?,
        };
        for model_from_shape in places.into_iter().filter(is_invertible) {
            self.parts.shapes.push(ModelShape { shape: shape.clone(), model_from_shape });
        }
        Ok(())
    }

    /// A mesh, with a material for each of its primitives.
    fn mesh_shape(&mut self, mesh: usize, address: &MeshAddress, name: Option<String>) -> Result<ShapeDesc, GltfFault> {
        let mut materials = Vec::new();
        for primitive in self.gltf.root().nth("meshes", mesh)?.list("primitives")? {
            materials.push(self.materials.of_primitive(&primitive)?);
        }
        let file = Some(FilePath(format!("{}#{address}", self.shown.file)));
        Ok(ShapeDesc::Mesh(MeshDesc { file, materials, name, ..MeshDesc::default() }))
    }

    /// Source: KHR_lights_punctual.
    fn light(&mut self, number: &JsonPlace<'_>, name: String, world: DAffine3) -> Result<(), GltfFault> {
        let root = self.gltf.root();
        let Some(lights) = root.extension(LIGHTS) else {
            return Err(number.fault(format!("the file has no {LIGHTS}")));
        };
        let light = lights.of_index("lights", number)?;
        let color = light.numbers_or("color", [1.0; 3])?.map(|c| c.clamp(0.0, 1e6));
        let color = ColorDesc::from(color);
        let strength = light.number_or("intensity", 1.0)?.clamp(0.0, 1e15);
        let forwards = (world.matrix3 * DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
        let position = world.translation.to_array();
        let name = Some(name);
        self.parts.lights.push(match light.need("type")?.text()? {
            "directional" => LightDesc::Directional(DirectionalDesc {
                name,
                color,
                strength,
                ..DirectionalDesc::new(forwards.to_array())
            }),
            "point" => LightDesc::Point(PointDesc { name, color, strength, ..PointDesc::new(position) }),
            "spot" => {
                let spot = light.get("spot");
                let angle = |key: &str, default: f64| -> Result<f64, GltfFault> {
                    let half = spot.as_ref().map_or(Ok(default), |spot| spot.number_or(key, default))?;
                    Ok((2.0 * half.to_degrees()).clamp(0.0, 180.0))
                };
                let outer = angle("outerConeAngle", std::f64::consts::FRAC_PI_4)?.max(0.01);
                let inner = angle("innerConeAngle", 0.0)?.min(outer);
                // The cone is told by a point: as far away as the light is from 0
                let away = world.translation.length().max(1.0);
                LightDesc::Spot(SpotDesc {
                    name,
                    color,
                    strength,
                    look_at: (world.translation + forwards * away).to_array(),
                    cone_deg: outer,
                    inner_cone_deg: Some(inner),
                    ..SpotDesc::new(position)
                })
            }
            other => {
                let kind: String = other.chars().take(40).collect();
                self.warn(format!("a light of the kind {kind:?} is left out"), "point, spot and directional are read");
                return Ok(());
            }
        });
        Ok(())
    }

    fn camera(&mut self, camera: &JsonPlace<'_>, name: String, world: DAffine3) -> Result<(), GltfFault> {
        let [back, up] = [DVec3::Z, DVec3::Y].map(|axis| (world.matrix3 * axis).normalize_or(axis));
        let eye = world.translation;
        let mut desc = CameraDesc::new(eye.to_array());
        desc.look_at = (eye - back * eye.length().max(1.0)).to_array();
        desc.up = up.to_array();
        match camera.need("type")?.text()? {
            "orthographic" => {
                desc.projection = Projection::Orthographic;
                let height = 2.0 * camera.need("orthographic")?.need("ymag")?.number()?.abs();
                desc.height = Some(height.clamp(1e-9, 2.5e8));
            }
            _ => {
                let angle = camera.need("perspective")?.need("yfov")?.number()?.to_degrees();
                desc.fov_y_deg = Some(angle.clamp(0.001, 179.99));
            }
        }
        self.parts.cameras.push((self.camera_names.unique(name), desc));
        Ok(())
    }
}
