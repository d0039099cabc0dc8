//! Scenes: described, read, compiled.

mod advice;
mod buffers;
mod builtin;
mod cast;
mod catchers;
mod compile;
mod course;
mod description;
mod far;
mod geometry;
mod layers;
mod light_spheres;
mod links;
mod model;
mod model_report;
mod models;
mod motion;
mod normals;
mod occluders;
mod outline;
mod place;
mod seen_lights;
mod shadow_rays;
mod studio;
#[cfg(test)]
mod tests;
mod text;
#[cfg(test)]
mod texture_tests;
mod textures;
mod through;
mod trace;
mod transmittance;
mod trees;
mod uv_sets;
mod world;

pub use builtin::{Builtin, builtin_scenes};
pub use cast::CastHit;
pub(crate) use catchers::Catchers;
pub use compile::{CompileOptions, Compiled};
pub(crate) use compile::{MAX_ANTIALIASING, MAX_SIDE};
pub use description::{DisplayEncoding, RenderDesc, SceneDesc};
pub use model::{Added, Framing, View};
pub use motion::MotionTo;
pub use studio::{Studio, StudioSettings};
pub use text::{Parsed, reference, schema};
pub use textures::TEXTURE_MEMORY;
pub use trace::Hit;
pub(crate) use trace::TracedHit;
pub use world::{CameraHit, SurfacePoint};

use std::sync::Arc;

use arrayvec::ArrayVec;
use fearless_simd::Level;

use crate::camera::Camera;
use crate::color::{Display, Rgb};
use crate::describe::{ColorDesc, SamplesDesc};
use crate::ids::SurfaceId;
use crate::image::Buffer;
use crate::light::Light;
use crate::material::{Ambient, Bsdf, Material, ShadingPoint};
use crate::math::{DAffine3, DVec3};
use crate::shape::ShadowTerminator;
use crate::shape::SurfaceInteraction;
use crate::texture::Texture;
use far::SceneBall;
pub(crate) use geometry::{At, Geometry, Nearest, ObjectSpace, Placed, PlacedSpot, PlacedTarget, UpperItem};
pub(crate) use layers::{Layer, LayerStack};
pub(crate) use links::LinkId;
use motion::Motion;
pub(crate) use occluders::{Listed, ListedOccluders, Opacity};
use seen_lights::SeenLights;
pub(crate) use shadow_rays::{MeshNumber, ShadowMesh, ShadowRays};
pub(crate) use trees::FewFacets;

/// A scene, ready to be rendered: flat lists and ids. Between here and the image nothing can fail.
///
/// Surfaces are numbered in scene order: shapes kind by kind, what instances place after them, then all lights.
#[derive(Clone, Debug)]
pub struct Scene {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// n of the n x n camera rays in a pixel.
    pub(crate) antialiasing: u32,
    /// In steps of an 8-bit picture.
    pub(crate) tolerance: f64,
    pub(crate) camera: Camera,
    /// Where all coordinates count from, in world space: that of the middle of what is far from 0, so that 32 bits are
    /// enough.
    pub(crate) origin: DVec3,
    pub(crate) background: Rgb,
    pub(crate) transparent: bool,
    pub(crate) ambient: Ambient,
    pub(crate) display: Display,
    pub(crate) geometry: Arc<Geometry>,
    pub(crate) lights: Vec<Light>,
    /// Their groups, by name, in the order of their first lights.
    pub(crate) light_groups: Vec<(String, Vec<u32>)>,
    /// The spaces that they were described in: from there to the scene's own coordinates.
    pub(crate) light_spaces: Vec<DAffine3>,
    /// Those of them that a camera can see.
    pub(crate) seen_lights: Arc<SeenLights>,
    pub(crate) materials: Vec<Material>,
    pub(crate) textures: Vec<Texture>,
    /// What is listed and stands in the way of light.
    pub(crate) occluders: ListedOccluders,
    /// Around all that rays can meet but for planes.
    pub(crate) ball: Option<SceneBall>,
    /// The best instruction set of this processor: for rays that are asked for one at a time.
    pub(crate) level: Level,
    pub(crate) hash: String,
    /// What it asks for of each pixel.
    pub(crate) buffers: Vec<Buffer>,
    pub(crate) choices: Choices,
    /// The moment that was compiled, in seconds.
    pub(crate) moment: f64,
    /// The moment, in seconds, if anything of the scene changes with time.
    pub(crate) time: Option<f64>,
    /// Whereto `motion` leads.
    pub(crate) motion: Option<Arc<Motion>>,
    /// What rays can meet where camera rays end at shadow catchers; `None` without any.
    pub(crate) catchers: Option<Arc<Catchers>>,
    /// Whether surfaces that reflect nothing are left out of all decisions on how light is found.
    pub(crate) leaves_out_black: bool,
    /// The texture files that something stands in for.
    pub(crate) placeholders: Vec<String>,
    pub(crate) summary: SceneSummary,
}

/// What whoever renders may say in place of the scene, as it was said; receipts keep it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Choices {
    pub background: ColorDesc,
    pub shadow_terminator: ShadowTerminator,
    /// Of a camera that was found.
    pub framing: Option<Framing>,
    /// Of a model by itself.
    pub model: Option<StudioSettings>,
}

/// What a scene holds, for people.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSummary {
    /// How many of each kind of shape are described, outside of groups; only kinds that there are.
    pub shapes: Vec<(&'static str, usize)>,
    /// The names of the groups, and how many shapes each describes.
    pub groups: Vec<(String, usize)>,
    /// What can be hit: the ids of shapes, instances counted by what they hold.
    pub surfaces: usize,
    /// Things that have a place of their own in the upper tree.
    pub placed: usize,
    /// Triangles of all meshes, each counted once however often it is placed.
    pub triangles: u64,
    /// Spheres of all point sets.
    pub points: u64,
    /// Bytes of meshes and point sets without their trees, and of all trees.
    pub geometry_bytes: [u64; 2],
    /// Kind, name if it has one, and samples of each light, in scene order; a light without an area has one.
    pub lights: Vec<(&'static str, Option<String>, SamplesDesc)>,
    /// Name and kind of each material, in the order of the text.
    pub materials: Vec<(String, &'static str)>,
    /// Name, kind and size in pixels (images) or squares (checkerboards) of each texture, in the order of the text. An
    /// image that no material uses is not read and has no size.
    pub textures: Vec<(String, &'static str, Option<[u32; 2]>)>,
    /// Bytes of all texels in memory.
    pub texture_bytes: u64,
    /// The smallest box, along the axes, around all shapes, in world space: its least and its greatest corner. `None`
    /// without shapes.
    pub bounds: Option<[[f64; 3]; 2]>,
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

    /// How far a pixel may be off the converged picture, in steps of an 8-bit picture.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// How 8- and 16-bit files show it.
    pub fn display(&self) -> Display {
        self.display
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// How many things can be hit: shapes, those that instances place, and lights. Ids count from 0.
    pub fn surfaces(&self) -> usize {
        self.geometry.surfaces.len() + self.lights.len()
    }

    /// What the scene calls a shape: the names of the instances around it and its own, with `/` between. `None` without
    /// any, and for lights.
    pub fn surface_name(&self, id: SurfaceId) -> Option<&str> {
        self.geometry.surfaces.get(id.index())?.name.as_deref()
    }

    /// The same, in which nothing casts shadows, at a quarter of the tolerance: light without shadows takes little
    /// time, and what is divided by it is to be as exact as the picture is.
    pub(crate) fn without_shadows(&self) -> Scene {
        let mut scene = self.clone();
        scene.lights.iter_mut().for_each(|light| light.shadows = false);
        scene.tolerance *= 0.25;
        scene
    }

    /// The moment that was compiled, in seconds; `None` if nothing in the scene changes with time.
    pub fn time(&self) -> Option<f64> {
        self.time
    }

    /// The material at a surface, in numbers, but for what has [points of its own](Self::further_points).
    #[inline(always)]
    pub(crate) fn bsdf(&self, si: &SurfaceInteraction) -> Bsdf {
        let bsdf = self.materials[si.material.index()].bsdf(si, &self.textures, &self.ambient);
        if si.lobe_ns == si.ns { bsdf } else { bsdf.diffuse_part() }
    }

    /// The shading points of the highlight of a surface, where its normal is another one, and of the clear coat; of
    /// which such a part of a ray is seen. They are lit beside the [material](Self::bsdf).
    #[inline(always)]
    pub(crate) fn further_points(&self, si: &SurfaceInteraction, weight: f32) -> ArrayVec<ShadingPoint, 2> {
        let material = &self.materials[si.material.index()];
        let mut points = ArrayVec::new();
        if si.lobe_ns != si.ns {
            let bsdf = material.bsdf(si, &self.textures, &self.ambient).highlight_part();
            points.push(ShadingPoint::of_highlight(si, &bsdf.weighted(weight), &self.ambient));
        }
        if let Some(bsdf) = material.coat_bsdf(si, &self.textures, &self.ambient) {
            points.push(ShadingPoint::of_coat(si, &bsdf.weighted(weight), &self.ambient));
        }
        points
    }

    /// The radiance that the material at a surface emits.
    #[inline]
    pub(crate) fn emission(&self, si: &SurfaceInteraction) -> Rgb {
        self.materials[si.material.index()].emission(si, &self.textures)
    }

    /// 64 hexadecimal digits: BLAKE3 of the description, its settings and the files it names. The same at all times:
    /// what moves is told apart by [`time`](Self::time). The same for all samples of lights, which are told apart by
    /// [`receipt`](Self::receipt).
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// What it holds.
    pub fn summary(&self) -> &SceneSummary {
        &self.summary
    }
}
