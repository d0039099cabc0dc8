//! Stand-ins for the parts of the library that are written elsewhere: enough to build and try the program.
#![allow(missing_docs)]

use std::io::Write;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::*;

pub struct Parsed {
    pub desc: SceneDesc,
    pub output: Option<String>,
    pub threads: Option<u32>,
    faults: Vec<Diagnostic>,
}

impl SceneDesc {
    pub fn parse(name: &str, text: &[u8], _assets: &dyn Assets) -> Parsed {
        let text = String::from_utf8_lossy(text);
        let mut parsed = Parsed { desc: stub_desc(), output: None, threads: None, faults: vec![] };
        for (i, line) in text.lines().enumerate() {
            let (key, value) = line.split_once([' ', '=']).unwrap_or((line, ""));
            if let Some(name) = line.strip_prefix("[camera.").and_then(|l| l.strip_suffix(']')) {
                parsed.desc.cameras.retain(|(n, _)| !n.is_empty());
                let camera = stub_desc().cameras.remove(0).1;
                parsed.desc.cameras.push((name.to_owned(), camera));
            }
            if line == "set = \"grid\""
                && let LightDesc::Rectangle(l) = &mut parsed.desc.lights[0]
            {
                l.set = SampleSet::Grid;
            }
            let value = value.trim_start_matches([' ', '=']).trim();
            let number = value.parse::<u32>();
            match (key, number) {
                ("width", Ok(n)) => parsed.desc.render.width = n,
                ("height", Ok(n)) => parsed.desc.render.height = n,
                ("antialiasing" | "num_samples", Ok(n)) => parsed.desc.render.antialiasing = n,
                ("samples", Ok(n)) => parsed.desc.render.samples = n,
                ("output_file", _) => parsed.output = Some(value.to_owned()),
                ("num_threads", Ok(n)) => parsed.threads = Some(n),
                ("output_resolution", _) => {
                    if let Some((w, h)) = value.split_once(' ') {
                        parsed.desc.render.width = w.parse().unwrap_or(1);
                        parsed.desc.render.height = h.parse().unwrap_or(1);
                    }
                }
                ("radius", Err(_)) | ("height" | "width" | "fault" | "colour", _) => parsed.faults.push(Diagnostic {
                    severity: Severity::Error,
                    place: Some(Place {
                        file: name.to_owned(),
                        line: i as u32 + 1,
                        column: (line.len() - value.len()) as u32 + 1,
                        excerpt: line.to_owned(),
                        offset: (line.len() - value.len()) as u32,
                        width: value.len().max(1) as u32,
                    }),
                    path: key.to_owned(),
                    message: format!("{value} is not it"),
                    hint: Some("try another".into()),
                }),
                _ => {}
            }
        }
        parsed
    }
    pub fn to_toml(&self) -> String {
        String::new()
    }
    pub fn to_json(&self) -> String {
        String::new()
    }
    pub fn compile(&self, assets: &dyn Assets, options: &CompileOptions) -> Result<Compiled, SceneError> {
        Parsed { desc: self.clone(), output: None, threads: None, faults: vec![] }.compile(assets, options)
    }
}

fn stub_desc() -> SceneDesc {
    SceneDesc {
        render: RenderDesc {
            width: 1024,
            height: 1024,
            antialiasing: 4,
            samples: 400,
            camera: None,
            background: ColorDesc::BLACK,
            transparent: false,
            ambient: ColorDesc::BLACK,
            display: DisplayEncoding::Srgb,
            gamma: 2.2,
            exposure: 0.0,
        },
        cameras: vec![(
            String::new(),
            CameraDesc {
                position: [0.0, 0.0, 10.0],
                look_at: [0.0; 3],
                up: [0.0, 1.0, 0.0],
                fov_y_deg: Some(45.0),
                focal_length_mm: None,
                sensor_height_mm: None,
            },
        )],
        textures: vec![],
        materials: vec![],
        shapes: vec![],
        lights: vec![LightDesc::Rectangle(RectangleDesc {
            name: None,
            center: [0.0; 3],
            e0: [2.0, 0.0, 0.0],
            e1: [0.0, 0.0, 2.0],
            color: ColorDesc::WHITE,
            strength: 1.0,
            falloff: Falloff::Constant,
            sides: None,
            visible: true,
            blocks: false,
            shadows: true,
            samples: None,
            set: SampleSet::Sobol,
            seed: 0,
        })],
    }
}

impl Parsed {
    pub fn faults(&self) -> &[Diagnostic] {
        &self.faults
    }
    pub fn compile(&self, _assets: &dyn Assets, _options: &CompileOptions) -> Result<Compiled, SceneError> {
        if !self.faults.is_empty() {
            return Err(SceneError { faults: self.faults.clone() });
        }
        Ok(Compiled { scene: Scene { desc: self.desc.clone() }, warnings: vec![] })
    }
}

pub fn schema() -> String {
    "{\n  \"$schema\": \"https://json-schema.org/draft/2020-12/schema\"\n}\n".into()
}
pub struct Builtin {
    pub name: &'static str,
    pub title: &'static str,
    pub text: &'static str,
}
pub fn builtin_scenes() -> &'static [Builtin] {
    &[
        Builtin { name: "config11", title: "camera 1, light 1", text: "[render]\nwidth = 1024\n" },
        Builtin { name: "config23", title: "camera 2, light 3", text: "[render]\nwidth = 1024\n" },
    ]
}

#[derive(Clone, Debug, Default)]
pub struct CompileOptions {
    pub strict: bool,
}
pub struct Compiled {
    pub scene: Scene,
    pub warnings: Vec<Diagnostic>,
}
pub struct Scene {
    desc: SceneDesc,
}
pub struct SceneSummary {
    pub spheres: usize,
    pub parallelograms: usize,
    pub lights: Vec<(&'static str, Option<String>, usize)>,
    pub materials: Vec<(String, &'static str)>,
    pub textures: Vec<(String, &'static str, Option<[u32; 2]>)>,
    pub texture_bytes: u64,
    pub bounds: Option<[[f32; 3]; 2]>,
    pub camera: String,
}
impl Scene {
    pub fn hash(&self) -> &str {
        "0000000000000000000000000000000000000000000000000000000000000000"
    }
    pub fn width(&self) -> u32 {
        self.desc.render.width
    }
    pub fn height(&self) -> u32 {
        self.desc.render.height
    }
    pub fn display(&self) -> Display {
        Display { encoding: Encoding::Srgb, exposure: self.desc.render.exposure }
    }
    pub fn summary(&self) -> &SceneSummary {
        Box::leak(Box::new(SceneSummary {
            spheres: 0,
            parallelograms: 0,
            lights: vec![("rectangle", None, 400)],
            materials: vec![("ball".into(), "phong")],
            textures: vec![("tiles".into(), "checkerboard", Some([8, 8]))],
            texture_bytes: 0,
            bounds: Some([[-0.1; 3], [0.1; 3]]),
            camera: String::new(),
        }))
    }
    pub fn receipt(&self, _settings: &RenderSettings) -> Receipt {
        Receipt { entries: vec![] }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    Srgb,
    Gamma(f64),
    Linear,
}
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    pub encoding: Encoding,
    pub exposure: f64,
}

#[derive(Clone, Debug)]
pub struct RenderSettings {
    pub threads: Option<NonZeroUsize>,
    pub tile_size: u32,
    pub simd: SimdLevel,
    pub crop: Option<Window>,
    pub reference: bool,
}
impl Default for RenderSettings {
    fn default() -> Self {
        Self { threads: None, tile_size: 16, simd: SimdLevel::Auto, crop: None, reference: false }
    }
}
impl RenderSettings {
    pub fn check(&self, _scene: &Scene) -> Result<(), String> {
        Ok(())
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SimdLevel {
    Auto,
    Fallback,
    Sse2,
    Sse42,
    Avx2,
    Avx512,
    Neon,
}
impl SimdLevel {
    pub const ALL: &[SimdLevel] =
        &[Self::Auto, Self::Fallback, Self::Sse2, Self::Sse42, Self::Avx2, Self::Avx512, Self::Neon];
    pub fn name(self) -> &'static str {
        ["auto", "fallback", "sse2", "sse4.2", "avx2", "avx512", "neon"][self as usize]
    }
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|l| l.name() == name)
    }
    pub fn is_available(self) -> bool {
        matches!(self, Self::Auto | Self::Fallback)
    }
    pub fn available() -> Vec<SimdLevel> {
        vec![Self::Auto, Self::Fallback]
    }
    pub fn resolve(self) -> SimdLevel {
        Self::Fallback
    }
}

pub struct Film(Image);
impl Film {
    pub fn develop(self) -> Image {
        self.0
    }
}
pub struct RenderStats {
    pub camera_rays: u64,
    pub shadow_rays: u64,
    pub shadow_rays_skipped: u64,
    pub simd: SimdLevel,
    pub threads: usize,
}

pub fn render(
    scene: &Scene,
    settings: &RenderSettings,
    progress: &(dyn Fn(u64, u64) -> ControlFlow<()> + Sync),
) -> ControlFlow<(), (Film, RenderStats)> {
    let film = [scene.width(), scene.height()];
    let w = settings.crop.unwrap_or(Window { x: 0, y: 0, width: film[0], height: film[1] });
    let r = &scene.desc.render;
    let work = AtomicU64::new(0);
    let mut pixels = vec![];
    for y in w.y..w.y + w.height {
        for x in w.x..w.x + w.width {
            pixels.push([x as f32 / film[0] as f32, y as f32 / film[1] as f32, 0.5, 1.0]);
        }
        let ns = u64::from(w.width) * u64::from(r.antialiasing).pow(2) * u64::from(r.samples);
        std::thread::sleep(std::time::Duration::from_nanos(ns));
        work.fetch_add(ns, Ordering::Relaxed);
        progress(pixels.len() as u64, u64::from(w.width) * u64::from(w.height))?;
    }
    let stats = RenderStats {
        camera_rays: pixels.len() as u64,
        shadow_rays: work.into_inner(),
        shadow_rays_skipped: 0,
        simd: settings.simd.resolve(),
        threads: settings.threads.map_or(1, NonZeroUsize::get),
    };
    ControlFlow::Continue((Film(Image { film, window: w, pixels }), stats))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    Png8,
    Png16,
    Exr,
    Hdr,
}
impl Format {
    pub fn from_path(path: &Path) -> Result<Format, ImageError> {
        match path.extension().map(|e| e.to_ascii_lowercase()).as_ref().and_then(|e| e.to_str()) {
            Some("png") => Ok(Self::Png8),
            Some("exr") => Ok(Self::Exr),
            Some("hdr") => Ok(Self::Hdr),
            _ => Err(ImageError(format!("{}: unknown ending; use .png, .exr or .hdr", path.display()))),
        }
    }
}
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ImageError(String);

impl Image {
    pub fn encode(&self, format: Format, _display: &Display, _receipt: &Receipt) -> Result<Vec<u8>, ImageError> {
        let mut bytes = vec![];
        if !matches!(format, Format::Png8 | Format::Png16) {
            for p in &self.pixels {
                bytes.extend(p.iter().flat_map(|v| v.to_le_bytes()));
            }
            return Ok(bytes);
        }
        let mut encoder = png::Encoder::new(&mut bytes, self.window.width, self.window.height);
        encoder.set_color(png::ColorType::Rgb);
        let deep = format == Format::Png16;
        encoder.set_depth(if deep { png::BitDepth::Sixteen } else { png::BitDepth::Eight });
        let data: Vec<u8> = self
            .pixels
            .iter()
            .flat_map(|p| p[..3].iter())
            .flat_map(|v| if deep { ((v * 65535.0) as u16).to_be_bytes().to_vec() } else { vec![(v * 255.0) as u8] })
            .collect();
        let e = |e: png::EncodingError| ImageError(e.to_string());
        encoder.write_header().map_err(e)?.write_image_data(&data).map_err(e)?;
        Ok(bytes)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    Whole,
    Direct,
}
#[derive(Debug)]
pub struct PendingFile(std::path::PathBuf);
#[derive(Debug)]
pub struct StagedFile<'a>(std::path::PathBuf, Option<tempfile::NamedTempFile>, &'a [u8]);
fn failed(path: &Path, e: std::io::Error) -> ImageError {
    ImageError(format!("{}: cannot be written: {e}", path.display()))
}
fn stub_dir(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
impl PendingFile {
    pub fn path(&self) -> &Path {
        &self.0
    }
    pub fn new(path: &Path) -> Result<Self, ImageError> {
        if path.is_dir() {
            return Err(ImageError(format!("{}: is a folder, not a file", path.display())));
        }
        if std::fs::metadata(path).is_ok_and(|m| m.permissions().readonly()) {
            return Err(ImageError(format!("{}: is read-only; make it writable", path.display())));
        }
        let real = std::fs::read_link(path).unwrap_or(path.to_owned());
        if stub_dir(&real).metadata().is_err_and(|e| e.kind() == std::io::ErrorKind::NotFound) {
            return Err(ImageError(format!(
                "{}: there is no folder {}; create it first",
                path.display(),
                stub_dir(&real).display()
            )));
        }
        tempfile::tempfile_in(stub_dir(&real)).map_err(|e| failed(path, e))?;
        Ok(Self(path.to_owned()))
    }
    pub fn stage(self, bytes: &[u8]) -> Result<StagedFile<'_>, ImageError> {
        if std::fs::metadata(&self.0).is_ok_and(|m| !m.is_file()) {
            return Ok(StagedFile(self.0, None, bytes));
        }
        let real = self.0.canonicalize().unwrap_or(self.0.clone());
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut file = builder.prefix(".firstlight-").tempfile_in(stub_dir(&real)).map_err(|e| failed(&self.0, e))?;
        file.write_all(bytes).map_err(|e| failed(&self.0, e))?;
        Ok(StagedFile(self.0, Some(file), bytes))
    }
}
impl StagedFile<'_> {
    pub fn commit(self) -> Result<Written, ImageError> {
        let Some(file) = self.1 else {
            return std::fs::OpenOptions::new()
                .write(true)
                .open(&self.0)
                .and_then(|mut f| f.write_all(self.2))
                .map(|()| Written::Direct)
                .map_err(|e| failed(&self.0, e));
        };
        let real = self.0.canonicalize().unwrap_or(self.0.clone());
        file.persist(real).map_err(|e| failed(&self.0, e.error))?;
        Ok(Written::Whole)
    }
}
