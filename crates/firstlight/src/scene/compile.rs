//! From description to scene: names become ids, units become those of computing, and every fault is found.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use fearless_simd::Level;

use super::advice::advise;
use super::far::{SceneBall, approach};
use super::geometry::Geometry;
use super::model::{Added, Framing};
use super::occluders::ListedOccluders;
use super::outline::ShapeOutline;
use super::place::compile_shapes;
use super::seen_lights::SeenLights;
use super::studio::StudioSettings;
use super::textures::{TEXTURE_MEMORY, TextureRequests, Textures};
use super::{Choices, DisplayEncoding, RenderDesc, Scene, SceneDesc, SceneSummary};
use crate::camera::{Camera, CameraDesc};
use crate::color::{Display, Encoding, Rgb, ToneMapping};
use crate::context::{Assets, CompileContext, OnCompile};
use crate::describe::{Family, SamplesDesc};
use crate::error::{Diagnostic, SceneError, Severity};
use crate::import::WithContained;
use crate::light::{Light, LightDesc, check_samples};
use crate::material::{Ambient, Material, MaterialDesc};
use crate::math::DVec3;
use crate::shape::{CompileCache, MeshFiles, ShapeDesc};
use crate::transform::MAX_TIME;

/// How strict compiling is, and which moment is compiled.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CompileOptions {
    /// Warnings are errors.
    pub strict: bool,
    /// How the camera frames the scene that a scene without one is given.
    pub framing: Framing,
    /// The studio that the scene is given: its lights and its ground.
    pub studio: Option<StudioSettings>,
    /// Told what is being done, for scenes that take their time.
    pub progress: Option<OnCompile>,
    /// What is kept from one compilation to the next, for a description that is compiled again and again.
    pub cache: Option<CompileCache>,
    /// Bytes that pictures may take as textures, with their smaller copies; [`TEXTURE_MEMORY`](crate::TEXTURE_MEMORY)
    /// where it is `None`.
    pub texture_memory: Option<u64>,
    /// Bytes that files, meshes, point sets and textures may take together, as far as that is known before they are
    /// made; any number of bytes where it is `None`.
    pub memory: Option<u64>,
    /// In seconds, from -1e9 to 1e9: where the scene has keys, it is compiled as it is at this time.
    pub time: f64,
}

/// A scene, and what is odd about it.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// Ready to be rendered.
    pub scene: Scene,
    /// What was put up with: missing and damaged textures.
    pub warnings: Vec<Diagnostic>,
    /// What it was given because the description lacks it.
    pub added: Added,
    /// What may surprise whoever looks at the picture, though nothing is wrong for certain: a scene without light,
    /// angles that look like radians. Never an error, also not under `strict`.
    pub advice: Vec<Diagnostic>,
}

/// The largest side of a picture, in pixels.
pub(crate) const MAX_SIDE: u32 = 65536;
pub(crate) const MAX_ANTIALIASING: u32 = 64;
/// Of the tolerance: below it the converged pictures that it was tested with are not good enough themselves.
const MIN_TOLERANCE: f64 = 0.25;
const MAX_TOLERANCE: f64 = 16.0;
const MIN_FPS: f64 = 0.001;
const MAX_FPS: f64 = 1e6;

impl SceneDesc {
    /// Checks everything and makes the scene.
    ///
    /// # Errors
    /// Every fault at once, each with the path of its value.
    pub fn compile(&self, assets: &dyn Assets, options: &CompileOptions) -> Result<Compiled, SceneError> {
        let mut cx = CompileContext::at_time(options.time);
        let made = self.compile_or_faults(&mut cx, assets, options);
        let mut faults = cx.take_faults();
        if options.strict {
            faults.iter_mut().for_each(|fault| fault.severity = Severity::Error);
        }
        match made {
            Some((scene, added)) if faults.iter().all(|f| f.severity == Severity::Warning) => {
                Ok(Compiled { scene, warnings: faults, added, advice: cx.take_advice() })
            }
            _ => Err(SceneError { faults }),
        }
    }

    /// The scene, if there are no errors, with what was added to it; all there is to say is in `cx`.
    fn compile_or_faults(
        &self,
        cx: &mut CompileContext,
        assets: &dyn Assets,
        options: &CompileOptions,
    ) -> Option<(Scene, Added)> {
        let time = options.time;
        // What is compiled for two moments, or for two kinds of camera rays, shares what is the same
        let has_catchers =
            self.materials.iter().any(|(_, material)| matches!(material, MaterialDesc::ShadowCatcher(_)));
        let is_twice = self.render.motion_to.is_some() || options.studio.is_some() || has_catchers;
        let shared = is_twice.then(CompileCache::default);
        let cache = options.cache.as_ref().or(shared.as_ref());
        if let Some(cache) = cache {
            cache.begin();
        }
        cx.progress = options.progress.clone();
        cx.memory = options.memory;
        cx.between("time", time, -MAX_TIME, MAX_TIME, Some("the moment to compile, in seconds"));
        // Put the parts of models in place of them; what lies within their files is a file from here on
        let files = MeshFiles { cache, ..MeshFiles::default() };
        // Which files decide the picture is told by its parts
        let said = self.with_models(cx, assets, &mut files.again());
        let open = files.open.clone();
        let assets = &WithContained { assets, files: &open.gltf };
        said.compile_said(cx, assets, options, files, self)
    }

    /// The same of a description without models; `source` is the one it was made of.
    fn compile_said(
        &self,
        cx: &mut CompileContext,
        assets: &dyn Assets,
        options: &CompileOptions,
        mut files: MeshFiles<'_>,
        source: &SceneDesc,
    ) -> Option<(Scene, Added)> {
        let (time, cache) = (options.time, files.cache);
        let picture = self.compile_render(cx);
        let most = options.texture_memory.unwrap_or(TEXTURE_MEMORY).min(options.memory.unwrap_or(u64::MAX));
        let mut textures = TextureRequests::new(self, assets, cache, Some(most));
        textures.check(cx);
        let materials = self.compile_materials(cx, &mut textures);
        let textures = textures.finish(cx);
        cx.take("texture", "textures", textures.bytes);
        let geometry = compile_shapes(self, &materials, false, cx, assets, &mut files);
        let origin = cx.origin;
        let bounds = geometry.as_ref().and_then(Geometry::bounds).map(|bounds| bounds.map(|corner| corner + origin));
        let added = self.complete(cx, assets, options, &materials, geometry.as_ref(), (source, &files));
        // A ground changes what rays meet; all else is kept from before
        let mut shapes = Cow::Borrowed(self);
        let geometry = match &added.ground {
            Some(ground) => {
                shapes.to_mut().shapes.push(ground.clone());
                files.read.clear();
                cx.again(|cx| compile_shapes(&shapes, &materials, false, cx, assets, &mut files))
            }
            None => geometry,
        };
        let desc = &*self.with(&added);
        let camera = desc.compile_camera(cx, picture.width, picture.height, geometry.is_some());
        let lights = desc.compile_lights(cx);
        let light_groups = desc.light_groups();
        let buffers = desc.compile_buffers(cx, &light_groups, geometry.as_ref(), &lights);
        let (Some(geometry), false) = (geometry, cx.has_errors()) else {
            return None;
        };
        let occluders = ListedOccluders::new(&geometry, &lights);
        let ball = SceneBall::new(&geometry, &lights);
        let camera = approach(camera, [picture.width, picture.height], &geometry, ball.as_ref());
        let summary = SceneSummary {
            bounds: bounds.map(|bounds| bounds.map(|corner| corner.to_array())),
            ..self.summary(desc, &geometry, &lights, &textures)
        };
        let mut scene = Scene {
            width: picture.width,
            height: picture.height,
            antialiasing: picture.antialiasing,
            tolerance: picture.tolerance,
            camera,
            origin,
            background: picture.background,
            transparent: self.render.transparent,
            ambient: picture.ambient,
            display: picture.display,
            geometry: Arc::new(geometry),
            seen_lights: Arc::new(SeenLights::new(&lights)),
            lights,
            light_groups,
            light_spaces: desc.light_spaces(time, origin),
            materials,
            occluders,
            ball,
            level: Level::new(),
            buffers,
            choices: Choices {
                background: self.render.background,
                shadow_terminator: self.render.shadow_terminator,
                framing: added.camera.is_some().then_some(options.framing),
                model: None,
            },
            hash: self.hash(&textures, &files.read, &added),
            moment: time,
            time: cx.keyed.then_some(time),
            motion: None,
            catchers: None,
            leaves_out_black: false,
            placeholders: textures.placeholders,
            textures: textures.compiled,
            summary,
        };
        scene.catchers = shapes.compile_catchers(cx, assets, &files, &scene);
        scene.motion = self.compile_motion(cx, assets, (source, &files), (desc, added.ground.as_ref()), &scene);
        advise(cx, &scene, desc, !added.lights.is_empty());
        Some((scene, added))
    }

    /// Finds what the scene lacks: a camera, and a light where one is asked for.
    fn complete(
        &self,
        cx: &mut CompileContext,
        assets: &dyn Assets,
        options: &CompileOptions,
        materials: &[Material],
        geometry: Option<&Geometry>,
        (source, files): (&SceneDesc, &MeshFiles<'_>),
    ) -> Added {
        let Framing { view, margin, distance, time } = options.framing;
        cx.between("view.azimuth_deg", view.azimuth_deg, -360.0, 360.0, Some("in degrees; 0 is in front"));
        cx.between("view.elevation_deg", view.elevation_deg, -90.0, 90.0, Some("in degrees; 90 is straight above"));
        cx.between("margin", margin, 0.0, Framing::MAX_MARGIN, Some("a part of the picture's shorter side"));
        if let Some(distance) = distance {
            let [least, most] = Framing::DISTANCES;
            cx.between("distance", distance, least, most, Some("from the middle of what is seen, in metres"));
        }
        cx.between("framing.time", time, -MAX_TIME, MAX_TIME, Some("the moment that is framed, in seconds"));
        if cx.has_errors() {
            return Added::default();
        }
        // What moves is framed as it is at one moment, so that a camera that was found stands still in all frames
        let still = if self.cameras.is_empty() && cx.keyed && options.time != time {
            let mut there = CompileContext::at_time(time);
            let files = &mut files.again();
            let said = source.with_models(&mut there, assets, files);
            compile_shapes(&said, materials, false, &mut there, assets, files).map(|still| (still, there.origin))
        } else {
            None
        };
        let origin = still.as_ref().map_or(cx.origin, |(_, origin)| *origin);
        let outline = still.as_ref().map(|(still, _)| still).or(geometry).map(|seen| ShapeOutline::new(seen, origin));
        self.lacks(outline.as_ref(), &options.framing, options.studio.as_ref())
    }

    /// The description with what was added; without its shapes, if anything was.
    fn with(&self, added: &Added) -> Cow<'_, SceneDesc> {
        if *added == Added::default() {
            return Cow::Borrowed(self);
        }
        let mut desc = SceneDesc {
            render: self.render.clone(),
            cameras: self.cameras.clone(),
            lights: self.lights.clone(),
            ..SceneDesc::default()
        };
        added.add_to(&mut desc);
        Cow::Owned(desc)
    }

    fn compile_render(&self, cx: &mut CompileContext) -> Picture {
        cx.within("render", |cx| {
            let render = &self.render;
            let width = cx.count("width", render.width, 1, MAX_SIDE, Some("pixels across"));
            let height = cx.count("height", render.height, 1, MAX_SIDE, Some("pixels down"));
            let hint = "n of the n x n camera rays in each pixel";
            let antialiasing = cx.count("antialiasing", render.antialiasing, 1, MAX_ANTIALIASING, Some(hint));
            check_samples(cx, render.samples, "points on each area light");
            let hint = "in display steps; 1 is usual, 4 is a preview";
            let tolerance = cx.between("tolerance", render.tolerance, MIN_TOLERANCE, MAX_TOLERANCE, Some(hint));
            let gamma = cx.between("gamma", render.gamma, 0.1, 10.0, Some("2.2 is usual"));
            let exposure = cx.between("exposure", render.exposure, -64.0, 64.0, Some("in stops: each doubles"));
            cx.between("fps", render.fps, MIN_FPS, MAX_FPS, Some("frames in a second"));
            let (encoding, tone_mapping) = match render.display {
                DisplayEncoding::Srgb => (Encoding::Srgb, ToneMapping::None),
                DisplayEncoding::Gamma => (Encoding::Gamma(gamma), ToneMapping::None),
                DisplayEncoding::Linear => (Encoding::Linear, ToneMapping::None),
                DisplayEncoding::Neutral => (Encoding::Srgb, ToneMapping::Neutral),
            };
            Picture {
                width,
                height,
                antialiasing,
                tolerance,
                background: cx.color("background", render.background),
                ambient: render.ambient.compile(cx),
                display: Display { encoding, exposure, tone_mapping },
            }
        })
    }

    /// Checks every camera and answers with the chosen one.
    ///
    /// `known`: whether the shapes compiled, so that a camera would have been found if there is anything to see.
    pub(super) fn compile_camera(&self, cx: &mut CompileContext, width: u32, height: u32, known: bool) -> Camera {
        let (mut chosen, wanted) = (None, self.chosen_camera());
        for (i, (name, camera)) in self.cameras.iter().enumerate() {
            let path = if name.is_empty() { "camera".to_owned() } else { format!("camera.{name}") };
            let compiled = cx.within(&path, |cx| camera.compile(cx, width.max(1), height.max(1)));
            if wanted == Some(i) {
                chosen = Some(compiled);
            }
        }
        if self.cameras.is_empty() {
            // Faults of the shapes are told by themselves
            if known && !cx.has_errors() {
                let message = "there is none, and no shape with an end to find one for";
                cx.error("camera", message, Some("add [camera] with position and look_at"));
            }
        } else if chosen.is_none() {
            let wanted = self.render.camera.as_deref().unwrap_or_default();
            let names: Vec<&str> = self.cameras.iter().map(|(name, _)| name.as_str()).collect();
            cx.unknown("render.camera", "camera", wanted, &names);
        }
        // Never used when there was a fault
        let placeholder = || CameraDesc::new([0.0, 0.0, 1.0]).compile(&mut CompileContext::default(), 1, 1);
        chosen.unwrap_or_else(placeholder)
    }

    fn chosen_camera(&self) -> Option<usize> {
        match &self.render.camera {
            Some(wanted) => self.cameras.iter().position(|(name, _)| name == wanted),
            None => (!self.cameras.is_empty()).then_some(0),
        }
    }

    fn compile_materials(&self, cx: &mut CompileContext, textures: &mut TextureRequests) -> Vec<Material> {
        check_unique(cx, "material", self.materials.iter().map(|(name, m)| (m.kind(), name.as_str())));
        let mut materials = Vec::with_capacity(self.materials.len() + 1);
        for (name, desc) in &self.materials {
            let path = format!("material.{}.{name}", desc.kind());
            let material = cx.within(&path, |cx| desc.compile(cx, textures));
            materials.push(Material { uv_sets: textures.uv_sets(&material), ..material });
        }
        // The last one is for shapes that name none
        materials.push(Material::matte());
        materials
    }

    pub(super) fn compile_lights(&self, cx: &mut CompileContext) -> Vec<Light> {
        let samples = self.render.samples;
        let points = self.lights.iter().filter_map(LightDesc::samples).map(|(own, _)| match own.unwrap_or(samples) {
            SamplesDesc::Exact => 0,
            SamplesDesc::Count(count) => count as u64,
        });
        let points: u64 = points.sum();
        if points > MAX_LIGHT_POINTS {
            let message = format!("the area lights have {points} points together, the limit is {MAX_LIGHT_POINTS}");
            cx.error("light", message, Some("give them fewer samples"));
        }
        let mut lights = Vec::with_capacity(self.lights.len());
        // Scene order: kind by kind, in each the order of the text
        for kind in LightDesc::KINDS {
            for (i, desc) in self.lights.iter().filter(|light| light.kind() == *kind).enumerate() {
                lights.push(cx.within(&format!("light.{kind}[{i}]"), |cx| desc.compile(cx, samples)));
            }
        }
        lights
    }

    /// Where the chosen camera is and what it looks at, as it is at 0 s: so all frames count from one origin.
    pub(super) fn line_of_sight(&self) -> Option<[DVec3; 2]> {
        let (_, camera) = &self.cameras[self.chosen_camera()?];
        let ends = [camera.position, camera.look_at].map(DVec3::from);
        let Some(transform) = &camera.transform else { return Some(ends) };
        // Its faults are told where the camera is compiled
        let [x, y, z] = *transform.rows(0.0).ok()?.as_chunks::<4>().0 else { return None };
        Some(ends.map(|q| DVec3::from([x, y, z].map(|[a, b, c, d]| DVec3::new(a, b, c).dot(q) + d))))
    }

    fn summary(
        &self,
        completed: &SceneDesc,
        geometry: &Geometry,
        lights: &[Light],
        textures: &Textures,
    ) -> SceneSummary {
        let kinds = ShapeDesc::KINDS.iter().enumerate();
        let count = |kind: usize| self.shapes.iter().filter(|shape| shape.kind_index() == kind).count();
        SceneSummary {
            shapes: kinds.map(|(kind, word)| (*word, count(kind))).filter(|(_, count)| *count > 0).collect(),
            groups: self.groups.iter().map(|(name, group)| (name.clone(), group.shapes.len())).collect(),
            surfaces: geometry.surfaces.len(),
            placed: geometry.placed.len(),
            triangles: geometry.all_meshes().map(|mesh| mesh.triangles.len() as u64).sum(),
            points: geometry.point_sets.iter().map(|points| points.len() as u64).sum(),
            geometry_bytes: geometry.bytes(),
            lights: LightDesc::in_scene_order(&completed.lights)
                .zip(lights)
                .map(|(d, l)| (d.kind(), d.name(), l.said_samples()))
                .collect(),
            materials: self.materials.iter().map(|(name, m)| (name.clone(), m.kind())).collect(),
            textures: textures.sizes.clone(),
            texture_bytes: textures.bytes,
            bounds: None,
            camera: completed.chosen_camera().map(|i| completed.cameras[i].0.clone()).unwrap_or_default(),
        }
    }

    /// BLAKE3 of all that decides the picture, but for the samples of lights and the tolerance. What follows from a
    /// default is hashed as if it were said.
    fn hash(&self, textures: &Textures, meshes: &[(String, [u8; 32])], added: &Added) -> String {
        let mut said = self.clone();
        added.add_to(&mut said);
        said.render.camera = said.chosen_camera().map(|i| said.cameras[i].0.clone());
        // How lights are sampled and judged is a choice of who renders: receipts say what is in effect
        let default = RenderDesc::default().samples;
        said.lights.iter_mut().for_each(|light| light.set_samples(default));
        said.render.samples = default;
        said.render.fps = RenderDesc::default().fps;
        said.render.tolerance = RenderDesc::default().tolerance;
        // What else is written of the film changes nothing of it
        (said.render.buffers, said.render.motion_to) = (RenderDesc::default().buffers, None);
        let mut hasher = blake3::Hasher::new();
        hasher.update(said.to_json().as_bytes());
        for (file, hash) in &textures.file_hashes {
            hasher.update(file.as_bytes()).update(&[0]).update(hash);
        }
        for (file, hash) in meshes {
            hasher.update(file.as_bytes()).update(&[0]).update(hash);
        }
        hasher.finalize().to_hex().to_string()
    }
}

impl Scene {
    /// The same scene seen by another camera, at the same moment and in the same size. What was compiled is shared and
    /// not made anew, so this takes no time: it is how a turntable is made. [`hash`](Self::hash) is another one, and
    /// the summary calls the camera nothing.
    ///
    /// # Errors
    /// What is wrong with the camera, with paths that begin with `camera`.
    pub fn with_camera(&self, camera: &CameraDesc) -> Result<Scene, SceneError> {
        let mut cx = CompileContext::at_time(self.moment);
        cx.origin = self.origin;
        let compiled = cx.within("camera", |cx| camera.compile(cx, self.width, self.height));
        if cx.has_errors() {
            return Err(SceneError { faults: cx.take_faults() });
        }
        let mut scene = self.clone();
        scene.camera = approach(compiled, [self.width, self.height], &self.geometry, self.ball.as_ref());
        scene.time = self.time.or(cx.keyed.then_some(self.moment));
        scene.summary.camera = String::new();
        scene.motion = self.motion.as_ref().map(|motion| motion.with_camera(camera)).transpose()?;
        scene.choices.framing = None;
        let said = SceneDesc { cameras: vec![(String::new(), camera.clone())], ..SceneDesc::default() };
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.hash.as_bytes()).update(b"camera").update(said.to_json().as_bytes());
        scene.hash = hasher.finalize().to_hex().to_string();
        Ok(scene)
    }
}

/// `[render]`, checked.
struct Picture {
    width: u32,
    height: u32,
    antialiasing: u32,
    tolerance: f64,
    background: Rgb,
    ambient: Ambient,
    display: Display,
}

/// The most points of all sampled area lights together: 12 bytes each, on spheres 24.
const MAX_LIGHT_POINTS: u64 = 1 << 24;

/// Names belong to one thing each, whatever its kind.
pub(super) fn check_unique<'a>(
    cx: &mut CompileContext,
    family: &str,
    names: impl Iterator<Item = (&'static str, &'a str)>,
) {
    let mut seen = HashMap::new();
    for (kind, name) in names {
        if let Some(first) = seen.insert(name, kind) {
            let message = format!("{name:?} is the name of another {family} already, {family}.{first}.{name}");
            cx.error(&format!("{family}.{kind}.{name}"), message, Some("rename one of them"));
        }
    }
}
