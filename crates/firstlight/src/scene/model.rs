//! A scene around one model: a camera that sees all of it, and a light.

use super::SceneDesc;
use crate::camera::CameraDesc;
use crate::describe::{ColorDesc, FilePath};
use crate::light::{DirectionalDesc, LightDesc};
use crate::math::DVec3;
use crate::shape::{MeshDesc, PointSetDesc, ShapeDesc};
use crate::transform::TransformDesc;

/// The axis of a model that points upwards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// y, as everywhere in firstlight and in glTF.
    #[default]
    Y,
    /// z, as in most scans, CAD programs and Blender.
    Z,
}

/// How a model is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelSettings {
    /// Makes normals smooth where faces meet at less than this angle, in degrees, 0 to 180; see `MeshDesc::smooth_deg`.
    pub smooth_deg: Option<f64>,
    /// Which axis points upwards.
    pub up: UpAxis,
    /// Whether the file holds points without faces.
    pub points: bool,
}

/// The vertical field of view of the camera that is given to a scene without one.
const FOV_Y_DEG: f64 = 30.0;
/// What is left free around.
const MARGIN: f64 = 1.06;
/// From the middle of the scene to the camera: in front, a little to the right and from above.
const FROM: DVec3 = DVec3::new(0.45, 0.35, 1.0);
/// What the light is to the camera: to the left, up and back, in directions of the picture.
const LIGHT_FROM: DVec3 = DVec3::new(-0.5, 0.75, 0.8);

impl SceneDesc {
    /// A scene that shows a model: one shape, no camera and no light. Compile it with
    /// [`CompileOptions::complete`](crate::CompileOptions::complete), which adds both.
    pub fn of_model(file: &str, settings: &ModelSettings) -> Self {
        let transform = (settings.up == UpAxis::Z)
            .then(|| Box::new(TransformDesc { rotate_deg: [-90.0, 0.0, 0.0], ..TransformDesc::default() }));
        let file = Some(FilePath(file.to_owned()));
        let shape = if settings.points {
            ShapeDesc::PointSet(PointSetDesc { file, transform, ..PointSetDesc::default() })
        } else {
            ShapeDesc::Mesh(MeshDesc { file, transform, smooth_deg: settings.smooth_deg, ..MeshDesc::default() })
        };
        let mut desc = SceneDesc { shapes: vec![shape], ..SceneDesc::default() };
        desc.render.background = ColorDesc::linear(0.05, 0.055, 0.065);
        desc.render.ambient = ColorDesc::linear(0.16, 0.17, 0.19);
        desc
    }

    /// The description with a camera that sees all within `bounds`, and with a light, where it has none.
    pub(super) fn completed(&self, bounds: Option<[DVec3; 2]>) -> Self {
        let mut desc = SceneDesc { shapes: Vec::new(), groups: Vec::new(), ..self.clone() };
        let [low, high] = bounds.unwrap_or([DVec3::NEG_ONE, DVec3::ONE]);
        if desc.cameras.is_empty() {
            let aspect = self.render.width as f64 / self.render.height.max(1) as f64;
            desc.cameras.push((String::new(), framing(low, high, aspect)));
        }
        if desc.lights.is_empty() {
            // From the upper left of the first camera
            let camera = &desc.cameras[0].1;
            let back = (DVec3::from(camera.position) - DVec3::from(camera.look_at)).normalize_or(DVec3::Z);
            let right = DVec3::from(camera.up).cross(back).normalize_or(DVec3::X);
            let from = right * LIGHT_FROM.x + back.cross(right) * LIGHT_FROM.y + back * LIGHT_FROM.z;
            let mut light = DirectionalDesc::new((-from).to_array());
            light.strength = 2.6;
            desc.lights.push(LightDesc::Directional(light));
        }
        desc
    }
}

/// A camera that sees a whole box, and not much more.
fn framing(low: DVec3, high: DVec3, aspect: f64) -> CameraDesc {
    let center = (low + high) * 0.5;
    let half = ((high - low) * 0.5).max(DVec3::splat(1e-6 * (1.0 + center.abs().max_element())));
    let back = FROM.normalize();
    let right = DVec3::Y.cross(back).normalize();
    let up = back.cross(right);
    // The corner that is nearest to leaving the picture decides the distance
    let tan_y = pxfm::f_tan(FOV_Y_DEG.to_radians() * 0.5);
    let tan_x = tan_y * aspect;
    let mut distance: f64 = 0.0;
    for corner in 0..8 {
        let sign = |bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let q = half * DVec3::new(sign(0), sign(1), sign(2));
        let across = (q.dot(right).abs() / tan_x).max(q.dot(up).abs() / tan_y);
        distance = distance.max(q.dot(back) + across * MARGIN);
    }
    let mut camera = CameraDesc::new((center + back * distance).to_array());
    camera.look_at = center.to_array();
    camera.fov_y_deg = Some(FOV_Y_DEG);
    camera
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_of_a_box_is_in_the_picture_and_touches_its_margin() {
        for (low, high, aspect) in [
            (DVec3::NEG_ONE, DVec3::ONE, 1.0),
            (DVec3::new(5.0, 0.0, -3.0), DVec3::new(5.1, 40.0, -2.0), 2.0),
            (DVec3::ZERO, DVec3::new(1e-3, 1e-5, 1e-3), 0.5),
        ] {
            let camera = framing(low, high, aspect);
            let eye = DVec3::from(camera.position);
            let forward = (DVec3::from(camera.look_at) - eye).normalize();
            let right = forward.cross(DVec3::Y).normalize();
            let up = right.cross(forward);
            let tan = pxfm::f_tan(FOV_Y_DEG.to_radians() * 0.5);
            let mut most: f64 = 0.0;
            for corner in 0..8 {
                let pick = |bit: u32, a: f64, b: f64| if corner >> bit & 1 == 1 { b } else { a };
                let q = DVec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z)) - eye;
                let depth = q.dot(forward);
                let (x, y) = (q.dot(right) / depth / (tan * aspect), q.dot(up) / depth / tan);
                most = most.max(x.abs()).max(y.abs());
            }
            assert!(most < 1.0 && most > 0.85, "{most}");
        }
    }
}
