//! Models of one mesh or of points: PLY, STL and OBJ.

use super::{ModelParts, ModelShape, clay, material_name, shown};
use crate::describe::FilePath;
use crate::import::MeshData;
use crate::math::DAffine3;
use crate::shape::{MeshDesc, PointSetDesc, ShapeDesc};

/// Faces of files without normals that meet at up to this angle, in degrees, are parts of something round.
const SMOOTH_DEG: f64 = 30.0;

/// What a file of one mesh describes; `chosen` is the scene's own material for one of the file, by its name there.
pub(crate) fn describe_mesh(
    file: &str,
    data: &MeshData,
    (smooth_deg, is_unlit): (Option<f64>, bool),
    chosen: &dyn Fn(&str) -> Option<String>,
) -> ModelParts {
    let mut parts = ModelParts::default();
    let default = material_name(file, "default", is_unlit);
    let smooth_deg = smooth_deg.or(data.normals.is_empty().then_some(SMOOTH_DEG));
    let mut mesh = MeshDesc { file: Some(FilePath(file.to_owned())), smooth_deg, ..MeshDesc::default() };
    mesh.materials = data.materials.iter().map(|name| chosen(name).unwrap_or_else(|| default.clone())).collect();
    mesh.material = Some(default.clone());
    parts.materials.push((default, shown(clay(!data.colors.is_empty()), is_unlit)));
    parts.shapes.push(ModelShape { shape: ShapeDesc::Mesh(mesh), model_from_shape: DAffine3::IDENTITY });
    parts
}

/// What a file of points describes.
pub(crate) fn describe_points(file: &str, is_unlit: bool) -> ModelParts {
    let mut parts = ModelParts::default();
    let default = material_name(file, "default", is_unlit);
    let points = PointSetDesc {
        file: Some(FilePath(file.to_owned())),
        material: Some(default.clone()),
        ..PointSetDesc::default()
    };
    parts.materials.push((default, shown(clay(true), is_unlit)));
    parts.shapes.push(ModelShape { shape: ShapeDesc::PointSet(points), model_from_shape: DAffine3::IDENTITY });
    parts
}
