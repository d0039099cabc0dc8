//! Where a camera is, and which way it is turned.

use super::CameraDesc;
use crate::context::{CompileContext, show};
use crate::math::{DMat3, DVec3, Vec3};
use crate::transform::TransformDesc;

/// Where a camera is, and which way it is turned: three directions at right angles.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// The eye, or the middle of an orthographic film, in world space.
    pub position: DVec3,
    /// Unit: to the right in the picture.
    pub right: Vec3,
    /// Unit: up in the picture.
    pub up: Vec3,
    /// Unit: the line of sight.
    pub forward: Vec3,
    /// Where the coordinates of the scene count from.
    pub(crate) origin: DVec3,
    /// `position` in the scene's own coordinates.
    pub(crate) eye: Vec3,
    /// The line of sight, in f64.
    pub(crate) sight: DVec3,
    /// How far along it rays begin, in metres, and the place there, in the scene's own coordinates: 0 and `eye`, but
    /// where the scene is far away.
    pub(crate) near: f64,
    pub(crate) start: Vec3,
}

/// `up` nearer to the line of sight than this sine is parallel to it.
const MIN_SINE: f64 = 1e-6;
/// Eye and target nearer than this, in metres, are the same point.
const MIN_DISTANCE: f64 = 1e-9;

impl Frame {
    /// A direction of the scene by its parts along `right`, `up` and `forward`: exactly those that rays are made of,
    /// though in 32 bits the three are not quite at right angles.
    pub(super) fn parts(&self, d: DVec3) -> DVec3 {
        let [right, up, forward] = [self.right, self.up, self.forward].map(|axis| axis.as_dvec3());
        DMat3::from_cols(right, up, forward).inverse() * d
    }

    /// The same with rays that begin so far along the line of sight.
    pub(super) fn starting_at(self, near: f64) -> Self {
        Frame { near, start: (self.position - self.origin + self.sight * near).as_vec3(), ..self }
    }

    pub(super) fn compile(desc: &CameraDesc, cx: &mut CompileContext) -> Self {
        let (mut eye, mut target) = (DVec3::from(desc.position), DVec3::from(desc.look_at));
        let mut up = DVec3::from(desc.up);
        let before = cx.fault_count();
        cx.far_point("position", desc.position);
        cx.far_point("look_at", desc.look_at);
        cx.edge("up", desc.up);
        // Whatever a transform does to the three, the frame made of them has right angles
        if let Some(world_from_object) = TransformDesc::compile_field(desc.transform.as_deref(), cx) {
            eye = cx.moved_point(world_from_object, eye);
            target = cx.moved_point(world_from_object, target);
            up = world_from_object.transform_vector3(up);
        }
        let forward = (target - eye).normalize_or_zero();
        let right = forward.cross(up.normalize_or_zero());
        if cx.fault_count() == before {
            let (at, from) = (show(&target.to_array()), show(&eye.to_array()));
            if !((target - eye).length() >= MIN_DISTANCE) {
                let message = format!("{at} is the camera's position {from}: there is no direction to look in");
                cx.error("look_at", message, Some("move one of them"));
            } else if !(right.length() > MIN_SINE) {
                let message = format!(
                    "{} is parallel to the line of sight {}, from {from} to {at}",
                    show(&up.to_array()),
                    show(&(target - eye).to_array())
                );
                cx.error("up", message, Some("choose another up"));
            }
        }
        let right = right.normalize_or_zero();
        let up = right.cross(forward);
        Self {
            position: eye,
            right: right.as_vec3(),
            up: up.as_vec3(),
            forward: forward.as_vec3(),
            origin: cx.origin,
            eye: cx.local(eye).as_vec3(),
            sight: forward,
            near: 0.0,
            start: cx.local(eye).as_vec3(),
        }
    }
}
