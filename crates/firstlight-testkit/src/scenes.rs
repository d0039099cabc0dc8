//! How these tests build scenes and look at them: the only file that knows how descriptions are made.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;

use firstlight::{
    AaMode, BlinnPhongDesc, CameraDesc, CheckerboardDesc, ColorDesc, ColorParam, CompileOptions, DirectionalDesc,
    DisplayEncoding, Image, InstanceDesc, LightDesc, MaterialCommonDesc, MaterialDesc, MeshDesc, NoAssets, NumberParam,
    ParallelogramDesc, PhongDesc, PointDesc, RectangleDesc, RenderDesc, RenderSettings, SampleSet, Scene, SceneDesc,
    ShapeDesc, SphereDesc, SpotDesc, TextureDesc, TransformDesc, builtin_scenes,
};

pub use crate::Random;
use crate::pictures::FormulaPictures;

/// A point or a direction, as descriptions have them.
pub type V = [f64; 3];

pub fn add(a: V, b: V) -> V {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub fn sub(a: V, b: V) -> V {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub fn mul(a: V, s: f64) -> V {
    a.map(|x| x * s)
}

pub fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn length(a: V) -> f64 {
    dot(a, a).sqrt()
}

pub fn unit(a: V) -> V {
    mul(a, 1.0 / length(a))
}

/// Two unit vectors at right angles to `n` and to each other.
pub fn across(n: V) -> [V; 2] {
    let helper = if n[0].abs() < 0.6 * length(n) { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let a = unit(cross(n, helper));
    [a, unit(cross(n, a))]
}

/// `deg` in radians.
pub fn radians(deg: f64) -> f64 {
    deg * std::f64::consts::PI / 180.0
}

/// How often a test repeats what it does `usually` times, when `FIRSTLIGHT_SCENES` asks for more than its usual 200.
pub fn times(usually: u64) -> u64 {
    let wanted = std::env::var("FIRSTLIGHT_SCENES").ok().and_then(|n| n.parse().ok()).unwrap_or(200);
    usually * wanted.max(200) / 200
}

/// No shapes, no lights, no camera yet.
pub fn empty(width: u32, height: u32, antialiasing: u32) -> SceneDesc {
    SceneDesc {
        render: RenderDesc {
            width,
            height,
            antialiasing,
            samples: 64.into(),
            display: DisplayEncoding::Linear,
            ..RenderDesc::default()
        },
        cameras: Vec::new(),
        textures: Vec::new(),
        materials: Vec::new(),
        shapes: Vec::new(),
        groups: Vec::new(),
        lights: Vec::new(),
    }
}

/// A camera whose `up` is any direction that will do.
pub fn camera(position: V, look_at: V, fov_y_deg: f64) -> CameraDesc {
    camera_up(position, look_at, across(sub(look_at, position))[1], fov_y_deg)
}

pub fn camera_up(position: V, look_at: V, up: V, fov_y_deg: f64) -> CameraDesc {
    CameraDesc { look_at, up, fov_y_deg: Some(fov_y_deg), ..CameraDesc::new(position) }
}

pub fn sphere(center: V, radius: f64) -> SphereDesc {
    SphereDesc::new(center, radius)
}

pub fn parallelogram(p: V, e0: V, e1: V) -> ParallelogramDesc {
    ParallelogramDesc::new(p, e0, e1)
}

/// A square with sides of length 2 `half` around `center`.
pub fn square(center: V, normal: V, half: f64) -> ParallelogramDesc {
    let [a, b] = across(normal);
    let p = sub(center, mul(add(a, b), half));
    parallelogram(p, mul(a, 2.0 * half), mul(b, 2.0 * half))
}

pub fn point(position: V, strength: f64) -> PointDesc {
    PointDesc { strength, ..PointDesc::new(position) }
}

pub fn directional(direction: V, strength: f64) -> DirectionalDesc {
    DirectionalDesc { strength, ..DirectionalDesc::new(direction) }
}

pub fn spot(position: V, look_at: V, cone_deg: f64, inner_cone_deg: Option<f64>, strength: f64) -> SpotDesc {
    SpotDesc { look_at, cone_deg, inner_cone_deg, strength, ..SpotDesc::new(position) }
}

/// Physical, strength 1, invisible, with `samples` points of `set`.
pub fn rectangle(center: V, e0: V, e1: V, set: SampleSet, samples: u32) -> RectangleDesc {
    RectangleDesc { visible: false, samples: Some(samples.into()), set, ..RectangleDesc::with_edges(center, e0, e1) }
}

pub fn matte(diffuse: f64) -> MaterialDesc {
    phong(ColorParam::gray(diffuse), ColorParam::gray(0.0), 16.0)
}

pub fn phong(diffuse: ColorParam, specular: ColorParam, shininess: f64) -> MaterialDesc {
    let shininess = NumberParam::constant(shininess);
    MaterialDesc::Phong(PhongDesc { diffuse, specular, shininess, ..PhongDesc::default() })
}

pub fn blinn_phong(diffuse: ColorParam, specular: ColorParam, shininess: f64) -> MaterialDesc {
    let shininess = NumberParam::constant(shininess);
    MaterialDesc::BlinnPhong(BlinnPhongDesc { diffuse, specular, shininess, ..BlinnPhongDesc::default() })
}

pub fn checkerboard(counts: [u32; 2], colors: [V; 2]) -> TextureDesc {
    let colors = colors.map(|[r, g, b]| ColorDesc::linear(r, g, b));
    TextureDesc::Checkerboard(CheckerboardDesc { counts, colors, uv_set: None })
}

/// The built-in config 11, a room with four spheres under a square light, at another size.
pub fn config11(size: u32, antialiasing: u32, samples: u32) -> SceneDesc {
    let Some(builtin) = builtin_scenes().iter().find(|builtin| builtin.name == "config11") else {
        panic!("config11 comes with the library");
    };
    let parsed = SceneDesc::parse("config11.toml", builtin.text.as_bytes(), &NoAssets);
    assert!(parsed.faults().is_empty());
    let mut scene = parsed.desc;
    scene.render = RenderDesc { width: size, height: size, antialiasing, samples: samples.into(), ..scene.render };
    scene
}

/// What every shape can say, whatever its kind.
pub struct Common<'a> {
    pub material: &'a mut Option<String>,
    pub transform: &'a mut Option<Box<TransformDesc>>,
    pub visible: &'a mut bool,
    pub casts_shadow: &'a mut bool,
    pub receives_shadow: &'a mut bool,
    pub single_sided: &'a mut bool,
    /// `lights_include`, `lights_exclude`, `shadow_include`, `shadow_exclude`.
    pub links: [&'a mut Option<Vec<String>>; 4],
}

/// What a shape says that every shape can say.
pub fn common(shape: &mut ShapeDesc) -> Common<'_> {
    macro_rules! of {
        ($($kind:ident)*) => {
            match shape {
                $(ShapeDesc::$kind(desc) => Common {
                    material: &mut desc.material,
                    transform: &mut desc.transform,
                    visible: &mut desc.visible,
                    casts_shadow: &mut desc.casts_shadow,
                    receives_shadow: &mut desc.receives_shadow,
                    single_sided: &mut desc.single_sided,
                    links: [
                        &mut desc.lights_include,
                        &mut desc.lights_exclude,
                        &mut desc.shadow_include,
                        &mut desc.shadow_exclude,
                    ],
                },)*
            }
        };
    }
    of!(Sphere Parallelogram Plane Disk Rectangle Box Cylinder Cone Torus Mesh PointSet Instance Model)
}

/// What materials of all kinds can say, but for those that are unlit and shadow catchers.
pub fn common_of(material: &mut MaterialDesc) -> Option<&mut MaterialCommonDesc> {
    match material {
        MaterialDesc::Phong(desc) => Some(&mut desc.common),
        MaterialDesc::BlinnPhong(desc) => Some(&mut desc.common),
        MaterialDesc::MetallicRoughness(desc) => Some(&mut desc.common),
        MaterialDesc::Unlit(_) | MaterialDesc::ShadowCatcher(_) => None,
    }
}

/// The shape, scaled, turned and moved.
pub fn moved(mut shape: ShapeDesc, translate: V, rotate_deg: V, scale: V) -> ShapeDesc {
    let transform = TransformDesc { translate, rotate_deg, scale: scale.into(), ..TransformDesc::default() };
    *common(&mut shape).transform = Some(Box::new(transform));
    shape
}

pub fn instance(of: &str) -> ShapeDesc {
    ShapeDesc::Instance(InstanceDesc::new(of.to_owned()))
}

pub fn mesh(positions: Vec<V>, triangles: Vec<[u32; 3]>) -> MeshDesc {
    MeshDesc { positions, triangles, ..MeshDesc::default() }
}

/// A box, as triangles.
pub fn box_mesh(center: V, size: V) -> MeshDesc {
    let corner = |i: u32| {
        let side = |k: usize| center[k] + size[k] * ((i >> k & 1) as f64 - 0.5);
        [side(0), side(1), side(2)]
    };
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    mesh((0..8).map(corner).collect(), triangles)
}

/// A closed ball of `n` rings of `n` vertices, the front outside, in and out by up to `bumps` of its radius, with or
/// without normals.
pub fn ball_mesh(radius: f64, n: u32, bumps: f64, normals: bool, random: &mut Random) -> MeshDesc {
    let mut directions = vec![[0.0, 1.0, 0.0]];
    for ring in 1..n {
        let theta = std::f64::consts::PI * ring as f64 / n as f64;
        for i in 0..n {
            let phi = std::f64::consts::TAU * i as f64 / n as f64;
            let sin = pxfm::f_sin(theta);
            directions.push([sin * pxfm::f_cos(phi), pxfm::f_cos(theta), sin * pxfm::f_sin(phi)]);
        }
    }
    directions.push([0.0, -1.0, 0.0]);
    let last = directions.len() as u32 - 1;
    let at = |ring: u32, i: u32| match ring {
        0 => 0,
        ring if ring == n => last,
        ring => 1 + (ring - 1) * n + i % n,
    };
    let mut triangles = Vec::new();
    for ring in 0..n {
        for i in 0..n {
            let (a, b, c, d) = (at(ring, i), at(ring, i + 1), at(ring + 1, i), at(ring + 1, i + 1));
            triangles.extend([[a, b, c], [b, d, c]].iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[0] != t[2]));
        }
    }
    let positions = directions.iter().map(|d| mul(*d, radius * (1.0 + random.between(-bumps, bumps)))).collect();
    MeshDesc { normals: if normals { directions } else { Vec::new() }, ..mesh(positions, triangles) }
}

/// Adds to a scene, in the order of the text.
pub trait Build: Sized {
    fn with_camera(self, camera: CameraDesc) -> Self;
    fn with_material(self, name: &str, material: MaterialDesc) -> Self;
    fn with_texture(self, name: &str, texture: TextureDesc) -> Self;
    fn with_sphere(self, sphere: SphereDesc) -> Self;
    fn with_parallelogram(self, parallelogram: ParallelogramDesc) -> Self;
    fn with_shape(self, shape: ShapeDesc) -> Self;
    fn with_group(self, name: &str, shapes: Vec<ShapeDesc>) -> Self;
    fn with_light(self, light: LightDesc) -> Self;
    /// The same scene under other lights.
    fn lit_by(self, lights: &[LightDesc]) -> Self;
    /// The same scene, every light shining through everything.
    fn without_shadows(self) -> Self;
}

impl Build for SceneDesc {
    fn with_camera(mut self, camera: CameraDesc) -> Self {
        self.cameras = vec![(String::new(), camera)];
        self
    }

    fn with_material(mut self, name: &str, material: MaterialDesc) -> Self {
        self.materials.push((name.to_owned(), material));
        self
    }

    fn with_texture(mut self, name: &str, texture: TextureDesc) -> Self {
        self.textures.push((name.to_owned(), texture));
        self
    }

    fn with_sphere(mut self, sphere: SphereDesc) -> Self {
        self.shapes.push(ShapeDesc::Sphere(sphere));
        self
    }

    fn with_parallelogram(mut self, parallelogram: ParallelogramDesc) -> Self {
        self.shapes.push(ShapeDesc::Parallelogram(parallelogram));
        self
    }

    fn with_shape(mut self, shape: ShapeDesc) -> Self {
        self.shapes.push(shape);
        self
    }

    fn with_group(mut self, name: &str, shapes: Vec<ShapeDesc>) -> Self {
        self.groups.push((name.to_owned(), firstlight::GroupDesc { shapes }));
        self
    }

    fn with_light(mut self, light: LightDesc) -> Self {
        self.lights.push(light);
        self
    }

    fn lit_by(mut self, lights: &[LightDesc]) -> Self {
        self.lights = lights.to_vec();
        self
    }

    fn without_shadows(mut self) -> Self {
        for light in &mut self.lights {
            match light {
                LightDesc::Point(light) => light.shadows = false,
                LightDesc::Directional(light) => light.shadows = false,
                LightDesc::Spot(light) => light.shadows = false,
                LightDesc::Rectangle(light) => light.shadows = false,
                LightDesc::Disk(light) => light.shadows = false,
                LightDesc::Sphere(light) => light.shadows = false,
            }
        }
        self
    }
}

/// Ready to be rendered; its pictures are those of [`FormulaPictures`].
#[track_caller]
pub fn compile(desc: &SceneDesc) -> Scene {
    match desc.compile(&FormulaPictures, &CompileOptions::default()) {
        Ok(compiled) => compiled.scene,
        Err(error) => panic!("{error}\nin {desc:#?}"),
    }
}

/// One thread, the fast renderer.
pub fn one_thread() -> RenderSettings {
    RenderSettings { threads: NonZeroUsize::new(1), ..RenderSettings::default() }
}

/// The same, every camera ray lit by itself: where no light is integrated, the bits of the plain renderer.
pub fn every_ray() -> RenderSettings {
    RenderSettings { aa_mode: AaMode::Full, ..one_thread() }
}

/// The picture under the settings.
pub fn picture(scene: &Scene, settings: &RenderSettings) -> Image {
    match render_all(scene, settings) {
        ControlFlow::Continue(image) => image,
        ControlFlow::Break(()) => unreachable!("nobody stops it"),
    }
}

fn render_all(scene: &Scene, settings: &RenderSettings) -> ControlFlow<(), Image> {
    let (film, _) = firstlight::render(scene, settings, &|_, _| ControlFlow::Continue(()))?;
    ControlFlow::Continue(film.develop())
}

/// The picture of a description, one thread.
#[track_caller]
pub fn shoot(desc: &SceneDesc) -> Image {
    picture(&compile(desc), &one_thread())
}

/// The same, every camera ray lit by itself: what is true of every digit.
#[track_caller]
pub fn shoot_every_ray(desc: &SceneDesc) -> Image {
    picture(&compile(desc), &every_ray())
}

/// Red, green and blue of what `desc` shows at `p`, seen from `from`: one camera ray, aimed.
#[track_caller]
pub fn probe(desc: &SceneDesc, from: V, p: V) -> [f32; 3] {
    let mut desc = desc.clone().with_camera(camera(from, p, 0.01));
    (desc.render.width, desc.render.height, desc.render.antialiasing) = (1, 1, 1);
    let [r, g, b, _] = shoot_every_ray(&desc).pixels[0];
    [r, g, b]
}

/// The bits of a picture.
pub fn bits(image: &Image) -> Vec<[u32; 4]> {
    image.pixels.iter().map(|p| p.map(f32::to_bits)).collect()
}
