//! Scenes: described, read, compiled.

mod builtin;
mod compile;
mod course;
mod description;
mod text;
mod trace;

pub use builtin::{Builtin, builtin_scenes};
pub use compile::{CompileOptions, Compiled};
pub use description::{DisplayEncoding, RenderDesc, SceneDesc};
pub use text::{Parsed, reference, schema};
pub use trace::{CameraHit, Hit};

use crate::camera::Camera;
use crate::color::{Display, Rgb};
use crate::ids::MaterialId;
use crate::light::Light;
use crate::material::Material;
use crate::shape::{Parallelogram, PlaneSide, Sphere};
use crate::texture::Texture;

/// A scene, ready to be rendered: flat lists and ids. Between here and the image nothing can fail.
///
/// Surfaces are numbered in scene order: spheres, parallelograms, then all lights.
#[derive(Clone, Debug)]
pub struct Scene {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// n of the n x n camera rays in a pixel.
    pub(crate) antialiasing: u32,
    pub(crate) camera: Camera,
    pub(crate) background: Rgb,
    pub(crate) transparent: bool,
    pub(crate) ambient: Rgb,
    pub(crate) display: Display,
    pub(crate) spheres: Vec<Sphere>,
    pub(crate) parallelograms: Vec<Parallelogram>,
    pub(crate) lights: Vec<Light>,
    pub(crate) materials: Vec<Material>,
    pub(crate) textures: Vec<Texture>,
    /// The material of each shape, by surface id.
    pub(crate) shape_materials: Vec<MaterialId>,
    /// All that is flat and stands in the way of light: the parallelograms, then the rectangle lights that block.
    pub(crate) flat_occluders: Vec<Parallelogram>,
    /// For each rectangle light, on which side of each flat occluder it lies; where nothing is known, both.
    pub(crate) light_sides: Vec<Vec<PlaneSide>>,
    pub(crate) hash: String,
    /// The moment, in seconds, if anything of the scene changes with time.
    pub(crate) time: Option<f64>,
    /// The texture files that something stands in for.
    pub(crate) placeholders: Vec<String>,
    pub(crate) summary: SceneSummary,
}

/// What a scene holds, for people.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSummary {
    /// Spheres.
    pub spheres: usize,
    /// Parallelograms.
    pub parallelograms: usize,
    /// Kind, name if it has one, and number of sampled points of each light, in scene order.
    pub lights: Vec<(&'static str, Option<String>, usize)>,
    /// Name and kind of each material, in the order of the text.
    pub materials: Vec<(String, &'static str)>,
    /// Name, kind and size in pixels (images) or squares (checkerboards) of each texture, in the order of the text. An
    /// image that no material uses is not read and has no size.
    pub textures: Vec<(String, &'static str, Option<[u32; 2]>)>,
    /// Bytes of all texels in memory.
    pub texture_bytes: u64,
    /// The smallest box, along the axes, around all shapes: its least and its greatest corner. `None` without shapes.
    pub bounds: Option<[[f32; 3]; 2]>,
    /// The camera's name; empty for the one without.
    pub camera: String,
}

impl Scene {
    /// Pixels across.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Pixels down.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// n of the n x n camera rays in each pixel.
    pub fn antialiasing(&self) -> u32 {
        self.antialiasing
    }

    /// How 8- and 16-bit files show it.
    pub fn display(&self) -> Display {
        self.display
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The moment that was compiled, in seconds; `None` if nothing in the scene changes with time.
    pub fn time(&self) -> Option<f64> {
        self.time
    }

    /// 64 hexadecimal digits: BLAKE3 of the description, its settings and the files it names. The same at all times: what
    /// moves is told apart by [`time`](Self::time).
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// What it holds.
    pub fn summary(&self) -> &SceneSummary {
        &self.summary
    }
}
