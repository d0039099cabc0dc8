//! Model files as descriptions: the shapes, materials, textures, lights and cameras that a scene could have said
//! itself.
//!
//! The station before is `import`, which reads bytes; the station after is the description of a scene, in which a
//! `[[model]]` is replaced by what is here. Nothing here is compiled: what comes of a file can be written as text and
//! read again.

mod gltf;
mod mesh;
mod mtl;
mod report;

pub(crate) use gltf::{ShownModel, describe as describe_gltf, gltf_contents, gltf_uv_sets};
pub(crate) use mesh::{ShownMesh, describe_mesh, describe_points};
pub use mtl::{MtlMaterials, MtlSettings, read_mtl};
pub use report::{
    ModelAnimation, ModelCounts, ModelExtension, ModelFile, ModelMaterial, ModelMesh, ModelPicture, ModelReport,
};

use std::collections::{HashMap, HashSet};

use crate::camera::CameraDesc;
use crate::context::{AssetError, Assets};
use crate::describe::value::join_path;
use crate::describe::{ColorParam, NumberParam};
use crate::light::LightDesc;
use crate::material::{MaterialCommonDesc, MaterialDesc, MetallicRoughnessDesc, UnlitDesc};
use crate::math::DAffine3;
use crate::shape::{GroupDesc, ShapeDesc};
use crate::texture::TextureDesc;

/// What a model file describes. Materials, textures and groups have names that begin with that of the file.
#[derive(Debug, Default)]
pub(crate) struct ModelParts {
    pub textures: Vec<(String, TextureDesc)>,
    pub materials: Vec<(String, MaterialDesc)>,
    /// Meshes that several nodes show.
    pub groups: Vec<(String, GroupDesc)>,
    pub shapes: Vec<ModelShape>,
    pub lights: Vec<LightDesc>,
    pub cameras: Vec<(String, CameraDesc)>,
    /// What was put up with.
    pub warnings: Vec<ModelWarning>,
    /// What is told, though nothing is wrong for certain.
    pub notes: Vec<ModelWarning>,
    /// What files of materials hold that is of no use here.
    pub spare: SpareMaterials,
}

/// What the files of materials of an OBJ file hold besides the materials of its faces.
#[derive(Debug, Default)]
pub(crate) struct SpareMaterials {
    /// The files, each with its length; `None` where it could not be read.
    pub files: Vec<(String, Option<u64>)>,
    /// Materials of no face.
    pub materials: Vec<String>,
    /// Pictures of no material of a face, by their paths in the scene.
    pub pictures: Vec<String>,
}

/// A shape of a model and where it stands in the space of the file.
#[derive(Debug)]
pub(crate) struct ModelShape {
    pub shape: ShapeDesc,
    pub model_from_shape: DAffine3,
}

/// Something that is odd about a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ModelWarning {
    pub message: String,
    pub hint: String,
}

/// Finds the picture files of a model. The answer for a path is kept.
pub(crate) struct PictureFinder<'a> {
    assets: &'a dyn Assets,
    /// By path and folder.
    found: HashMap<(String, String), String>,
    /// Warnings about pictures that may not be read.
    pub warnings: Vec<ModelWarning>,
}

impl<'a> PictureFinder<'a> {
    pub fn new(assets: &'a dyn Assets) -> Self {
        PictureFinder { assets, found: HashMap::new(), warnings: Vec::new() }
    }

    /// The path of a picture that a file in `folder` names: `path` if there is such a file; if not, the same file name
    /// in `folder` if there is one, else `path`. If `path` may not be read, the file name in `folder`, unchecked, with
    /// a warning. Paths are relative to the scene.
    pub fn find(&mut self, path: String, folder: &str) -> String {
        let key = (path, folder.to_owned());
        if let Some(found) = self.found.get(&key) {
            return found.clone();
        }
        let path = &key.0;
        // A limit of 0 asks whether it is there
        let ask = |path: &str| self.assets.read(path, 0).err();
        let beside = join_path(folder, path.rsplit('/').next().unwrap_or_default());
        let found = match ask(path) {
            Some(AssetError::NotFound) => match ask(&beside) {
                Some(AssetError::NotFound | AssetError::Outside) => path.clone(),
                _ => beside,
            },
            Some(error @ AssetError::Outside) if beside != *path => {
                let hint = format!(
                    "{beside:?} is looked for instead; --allow-dir with the folder of {path:?} allows to read it"
                );
                self.warnings.push(ModelWarning { message: format!("{path:?}: {error}"), hint });
                beside
            }
            _ => path.clone(),
        };
        self.found.insert(key, found.clone());
        found
    }
}

/// Names of which each is given once. A file may give the same one to all its materials: what is taken is not searched.
#[derive(Debug, Default)]
pub(crate) struct UniqueNames {
    taken: HashSet<String>,
    /// The last number behind a name that was given.
    numbers: HashMap<String, u64>,
}

impl UniqueNames {
    /// `name`, or with the least number behind it that is not taken.
    pub fn unique(&mut self, name: String) -> String {
        if self.taken.insert(name.clone()) {
            return name;
        }
        let number = self.numbers.entry(name.clone()).or_insert(1);
        loop {
            *number += 1;
            let numbered = format!("{name} {number}");
            if self.taken.insert(numbered.clone()) {
                return numbered;
            }
        }
    }
}

impl FromIterator<String> for UniqueNames {
    fn from_iter<T: IntoIterator<Item = String>>(names: T) -> Self {
        UniqueNames { taken: names.into_iter().collect(), numbers: HashMap::new() }
    }
}

/// The material that shows the colour of another one, whatever light there is.
fn unlit(material: MaterialDesc) -> MaterialDesc {
    let (color, common) = match material {
        MaterialDesc::MetallicRoughness(desc) => (desc.base_color, desc.common),
        MaterialDesc::Phong(desc) => (desc.diffuse, desc.common),
        MaterialDesc::BlinnPhong(desc) => (desc.diffuse, desc.common),
        other => return other,
    };
    let common = MaterialCommonDesc { normal_map: None, bump_map: NumberParam::constant(0.0), ..common };
    MaterialDesc::Unlit(UnlitDesc { color, common })
}

/// The material, or its colour alone.
fn shown(material: MaterialDesc, is_unlit: bool) -> MaterialDesc {
    if is_unlit { unlit(material) } else { material }
}

/// What the scene calls a material of a file.
fn material_name(file: &str, own: &str, is_unlit: bool) -> String {
    format!("{file}/{own}{}", if is_unlit { " unlit" } else { "" })
}

/// The gray of models that say no material: that of clay.
const CLAY: [f64; 3] = [0.66, 0.64, 0.61];

/// The material of models that say none: matte, of a warm light gray; white where vertices have colours.
pub(crate) fn clay(has_colors: bool) -> MaterialDesc {
    let base_color = if has_colors { ColorParam::gray(1.0) } else { CLAY.into() };
    MaterialDesc::MetallicRoughness(MetallicRoughnessDesc { base_color, ..MetallicRoughnessDesc::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_given_once_with_the_least_number() {
        let mut names: UniqueNames = ["b".to_owned(), "a 3".to_owned()].into_iter().collect();
        let given = ["a", "a", "a", "b", "a 2", "a", "b 2"].map(|name| names.unique(name.to_owned()));
        assert_eq!(given, ["a", "a 2", "a 4", "b 2", "a 2 2", "a 5", "b 2 2"]);
    }
}
