//! Whereto `motion` leads: the scene at another moment, or seen by another camera.
//!
//! What moves is moved by transforms alone, and surfaces are numbered alike at all times. So the scene is compiled once
//! more, as it is there, and a point leads from one to the other through the space that its shape was described in.

use std::sync::Arc;

use serde_json::{Value as Json, json};

use super::place::compile_shapes;
use super::seen_lights::SeenLights;
use super::{Scene, SceneDesc};
use crate::camera::CameraDesc;
use crate::context::{Assets, CompileContext};
use crate::describe::node::{Data, Node, quoted};
use crate::describe::read::Reader;
use crate::describe::{TextValue, Value};
use crate::error::{SceneError, Severity};
use crate::ids::SurfaceId;
use crate::light::LightDesc;
use crate::math::{DAffine3, DVec3};
use crate::shape::{MeshFiles, ShapeDesc};
use crate::transform::{MAX_TIME, TransformDesc};

/// Whereto `motion` leads from the picture: to another moment of the same camera, or to another camera at the same
/// moment. In text a number of seconds, `"next"`, `"previous"`, or the name of a camera.
#[derive(Clone, Debug, PartialEq)]
pub enum MotionTo {
    /// To the moment so many seconds after 0.
    Time(f64),
    /// To the frame after this one: 1 / `fps` seconds later.
    Next,
    /// To the frame before this one.
    Previous,
    /// To the camera of that name.
    Camera(String),
}

/// The words for the frames around.
const NEXT: &str = "next";
const PREVIOUS: &str = "previous";

impl MotionTo {
    /// What a text says that is no number; `None` for nothing at all.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "" => None,
            NEXT => Some(MotionTo::Next),
            PREVIOUS => Some(MotionTo::Previous),
            name => Some(MotionTo::Camera(name.to_owned())),
        }
    }

    /// The moment it leads to from `moment`, in seconds.
    fn time(&self, moment: f64, fps: f64) -> f64 {
        let neighbour = |step: f64| {
            // A moment that is a frame's has neighbours that are frames, to the bit
            let (frame, nearest) = (moment * fps, (moment * fps).round());
            (if (frame - nearest).abs() < 1e-6 { nearest } else { frame } + step) / fps
        };
        match self {
            MotionTo::Time(time) => *time,
            MotionTo::Next => neighbour(1.0),
            MotionTo::Previous => neighbour(-1.0),
            MotionTo::Camera(_) => moment,
        }
    }
}

impl Value for MotionTo {
    fn words() -> String {
        format!("a time in seconds, \"{NEXT}\", \"{PREVIOUS}\" or the name of a camera")
    }

    fn plural() -> String {
        format!("times in seconds, \"{NEXT}\", \"{PREVIOUS}\" or names of cameras")
    }

    fn schema() -> Json {
        json!({ "anyOf": [f64::schema(), { "type": "string", "minLength": 1 }] })
    }

    fn placeholder() -> Self {
        MotionTo::Next
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        match &node.data {
            Data::Number(_) => f64::read(node, reader).map(MotionTo::Time),
            Data::String(name) => {
                let read = Self::from_name(name);
                if read.is_none() {
                    reader.error(node.span, format!("{} is not {}", quoted(name), Self::words()), None);
                }
                read
            }
            _ => {
                reader.wrong_type(node, &Self::words(), None);
                None
            }
        }
    }

    fn write(&self) -> TextValue {
        match self {
            MotionTo::Time(time) => time.write(),
            MotionTo::Next => TextValue::Text(NEXT.into()),
            MotionTo::Previous => TextValue::Text(PREVIOUS.into()),
            MotionTo::Camera(name) => TextValue::Text(name.clone()),
        }
    }
}

impl std::fmt::Display for MotionTo {
    /// As scene text says it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            MotionTo::Time(time) => time.fmt(f),
            MotionTo::Next => quoted(NEXT).fmt(f),
            MotionTo::Previous => quoted(PREVIOUS).fmt(f),
            MotionTo::Camera(name) => Json::from(name.as_str()).fmt(f),
        }
    }
}

/// The other end of a motion.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    /// Whereto it leads: a moment or a camera.
    pub to: MotionTo,
    /// The same scene there, with the same surfaces in the same order.
    pub there: Scene,
}

impl SceneDesc {
    /// The scene where `[render] motion_to` says. `completed` is the description with the camera and the lights that
    /// were found for it, `source` the one with its models.
    pub(super) fn compile_motion(
        &self,
        cx: &mut CompileContext,
        assets: &dyn Assets,
        (source, files): (&SceneDesc, &MeshFiles<'_>),
        (completed, ground): (&SceneDesc, Option<&ShapeDesc>),
        here: &Scene,
    ) -> Option<Arc<Motion>> {
        let (to, path) = (self.render.motion_to.clone()?, "render.motion_to");
        let time = cx.between(path, to.time(here.moment, self.render.fps), -MAX_TIME, MAX_TIME, Some("in seconds"));
        if let MotionTo::Camera(name) = &to {
            let camera = self.cameras.iter().find(|(own, _)| own == name).map(|(_, camera)| camera);
            let Some(camera) = camera else {
                let names: Vec<&str> = self.cameras.iter().map(|(name, _)| name.as_str()).collect();
                cx.unknown(path, "camera", name, &names);
                return None;
            };
            // Its faults were found with those of all cameras
            let silent = &mut CompileContext::at_time(time);
            silent.origin = here.origin;
            let camera = camera.compile(silent, here.width, here.height);
            return Some(Arc::new(Motion { to, there: Scene { camera, ..here.clone() } }));
        }
        let word = to.write();
        if self.cameras.iter().any(|(name, _)| word == TextValue::Text(name.clone())) {
            let message = format!("{to} is the frame, and a camera of that name is there as well");
            cx.error(path, message, Some("give the camera another name"));
        }
        if cx.has_errors() {
            return None;
        }
        let mut there = Scene { moment: time, ..here.clone() };
        if cx.keyed && time != here.moment {
            let at = &mut CompileContext::at_time(time);
            at.progress = cx.progress.clone();
            let files = &mut files.again();
            let mut said = source.with_models(at, assets, files);
            if let Some(ground) = ground {
                said.to_mut().shapes.push(ground.clone());
            }
            let geometry = compile_shapes(&said, &here.materials, false, at, assets, files);
            there.origin = at.origin;
            there.camera = completed.compile_camera(at, here.width, here.height, geometry.is_some());
            there.lights = completed.compile_lights(at);
            there.light_spaces = completed.light_spaces(time, at.origin);
            there.seen_lights = Arc::new(SeenLights::new(&there.lights));
            // All else was said of the scene here
            for fault in at.take_faults().into_iter().filter(|fault| fault.severity == Severity::Error) {
                cx.error(&fault.path, fault.message, fault.hint.as_deref());
            }
            there.geometry = Arc::new(geometry?);
        }
        Some(Arc::new(Motion { to: MotionTo::Time(time), there }))
    }

    /// The spaces that the lights were described in, in scene order, from the scene's own coordinates.
    pub(super) fn light_spaces(&self, time: f64, origin: DVec3) -> Vec<DAffine3> {
        // Their faults were found with those of the lights
        let silent = &mut CompileContext::at_time(time);
        let space = |light: &LightDesc| {
            let world = TransformDesc::compile_field(light.transform(), silent).unwrap_or(DAffine3::IDENTITY);
            DAffine3 { translation: world.translation - origin, ..world }
        };
        LightDesc::in_scene_order(&self.lights).map(space).collect()
    }
}

impl Motion {
    /// The same, of the scene seen by another camera.
    ///
    /// # Errors
    /// What is wrong with the camera there.
    pub fn with_camera(self: &Arc<Self>, camera: &CameraDesc) -> Result<Arc<Self>, SceneError> {
        if let MotionTo::Camera(_) = self.to {
            return Ok(self.clone());
        }
        Ok(Arc::new(Motion { to: self.to.clone(), there: self.there.with_camera(camera)? }))
    }
}

impl Scene {
    /// Whereto `motion` leads, a moment or a camera, if it leads anywhere.
    pub fn motion_to(&self) -> Option<&MotionTo> {
        self.motion.as_deref().map(|motion| &motion.to)
    }

    /// The space that what was hit was described in, a shape or a light, from the scene's own coordinates.
    pub(crate) fn space_of(&self, surface: SurfaceId) -> DAffine3 {
        let geometry = &self.geometry;
        match geometry.surfaces.get(surface.index()) {
            Some(surface) => geometry.spaces[surface.space as usize].scene_from_object,
            None => self.light_spaces[surface.index() - geometry.surfaces.len()],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_after_a_frame_is_one_to_the_bit() {
        for fps in [24.0, 30.0, 29.97, 23.976, 0.1] {
            for frame in 0..500 {
                let moment = f64::from(frame) / fps;
                assert_eq!(MotionTo::Next.time(moment, fps), f64::from(frame + 1) / fps);
                assert_eq!(MotionTo::Previous.time(moment, fps), f64::from(frame - 1) / fps);
            }
        }
        assert_eq!(MotionTo::Next.time(0.3, 2.0), 0.8);
        assert_eq!(MotionTo::Camera("a".into()).time(0.3, 2.0), 0.3);
    }
}
