//! `cargo xtask pictures`: the pictures of the book. Its plots come from `cargo xtask engine --curves`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use firstlight::bench::{ShareSeen, sights};
use firstlight::{
    Assets, BufferDesc, BufferView, CompileOptions, Display, Encoding, Film, FolderAssets, Format, Image, LightChoice,
    NoAssets, Parsed, Plane, PlaneNumbers, RenderSettings, SamplesDesc, Scene, SceneDesc, Window, builtin_scenes,
    render,
};

use crate::bench::config11;
use crate::{Outcome, root, write};

pub fn run(filter: Option<&str>) -> Outcome {
    let wanted = |name: &str| filter.is_none_or(|part| name.contains(part));
    for builtin in builtin_scenes().iter().filter(|b| wanted(b.name)) {
        // Wide enough to look at, small enough for a repository; config 11 is the one that people look into
        let size = if builtin.name == "config11" { 1024 } else { 256 };
        picture(builtin.name, builtin.text.as_bytes(), &NoAssets, Some(size))?;
    }
    let gallery = root().join("scenes/gallery");
    let assets = FolderAssets::new(&gallery, &[]).map_err(|(path, e)| format!("{}: {e}", path.display()))?;
    for file in scene_files(&gallery)? {
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if wanted(&name) {
            let text = std::fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))?;
            picture(&name, &text, &assets, None)?;
        }
    }
    // The scenes that pages speak of; of several cameras each
    let scenes = root().join("docs/scenes");
    for file in scene_files(&scenes)? {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let text = std::fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        let mut parsed = SceneDesc::parse(&format!("{stem}.toml"), &text, &NoAssets);
        let cameras: Vec<String> = parsed.desc.cameras.iter().map(|(name, _)| name.clone()).collect();
        for camera in cameras {
            let name = if camera.is_empty() { stem.clone() } else { format!("{stem}-{camera}") };
            if wanted(&name) {
                parsed.desc.render.camera = Some(camera);
                compile_and_save(&name, &parsed, &NoAssets)?;
            }
        }
    }
    if wanted("visibility") {
        visibility()?;
    }
    if wanted("heat") {
        heat()?;
    }
    if wanted("buffers") {
        buffers()?;
    }
    if wanted("view-depth") {
        view_depth()?;
    }
    if wanted("terms") {
        terms()?;
    }
    Ok(())
}

/// The scenes of a folder, in order.
fn scene_files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut files: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "toml"));
    files.sort();
    Ok(files)
}

/// Pixels across and down of the pictures of what goes on inside.
const INSIDE: u32 = 512;
/// Pixels across and down that have a shaft together.
const BLOCK: u32 = 4;

/// How much of the light is seen at the middle of each pixel of config 11, and how that was found out:
/// `visibility.png`.
fn visibility() -> Outcome {
    let scene = config11(INSIDE, 1, 400.into())?;
    let kinds = [
        (ShareSeen::Empty, [0.99, 0.86, 0.42]),
        (ShareSeen::Lit, [0.93, 0.55, 0.14]),
        (ShareSeen::Hidden, [0.16, 0.22, 0.42]),
        (ShareSeen::BelowHorizon, [0.45, 0.45, 0.45]),
        (ShareSeen::Cut, [0.78, 0.16, 0.28]),
    ];
    let sights = sights(&scene, 0, BLOCK);
    for (kind, _) in kinds {
        let count = sights.iter().filter(|sight| **sight == Some(kind)).count();
        eprintln!("{kind:?}: {:.1} %", 100.0 * count as f64 / sights.len() as f64);
    }
    let color = |sight: &Option<ShareSeen>| {
        let found = kinds.iter().find(|(kind, _)| Some(*kind) == *sight);
        let [r, g, b] = found.map_or([0.0; 3], |(_, color)| color.map(|c| Encoding::Srgb.decode(c) as f32));
        [r, g, b, 1.0]
    };
    let window = Window { x: 0, y: 0, width: INSIDE, height: INSIDE };
    let image = Image { film: [INSIDE; 2], window, pixels: sights.iter().map(color).collect() };
    save("visibility", &image, &Display::default(), &scene, &RenderSettings::default())
}

/// Where the work of config 11 went: `heat.png`.
fn heat() -> Outcome {
    let scene = config11(INSIDE, 4, SamplesDesc::Exact)?;
    let settings = RenderSettings { buffers: vec![Plane::Rays.into()], ..RenderSettings::default() };
    let heat = rendered(&scene, &settings)?.heat().ok_or("no heat was kept")?;
    let (mean, most) = heat.mean_and_most();
    eprintln!("work: {mean:.1} in the mean, {most:.0} at most");
    save("heat", &heat.picture(), &Display::default(), &scene, &settings)
}

/// Pixels across and down of each of the four.
const BUFFER: u32 = 256;

/// A scene of the gallery, so large, and its film with some buffers.
fn film_of(name: &str, asked: &[BufferDesc]) -> Result<(Scene, RenderSettings, Film), String> {
    let folder = root().join("scenes/gallery");
    let text = std::fs::read(folder.join(name)).map_err(|e| e.to_string())?;
    let assets = FolderAssets::new(&folder, &[]).map_err(|(path, e)| format!("{}: {e}", path.display()))?;
    let mut parsed = SceneDesc::parse(name, &text, &assets);
    (parsed.desc.render.width, parsed.desc.render.height) = (BUFFER, BUFFER);
    parsed.desc.render.buffers = asked.to_vec();
    let scene = parsed.compile(&assets, &CompileOptions::default()).map_err(|e| e.to_string())?.scene;
    let settings = RenderSettings { buffers: scene.buffers().to_vec(), ..RenderSettings::default() };
    let film = rendered(&scene, &settings)?;
    Ok((scene, settings, film))
}

/// Pictures of `BUFFER` x `BUFFER` pixels beside each other.
fn beside(pictures: &[Vec<[f32; 4]>]) -> Image {
    let side = BUFFER as usize;
    let pixels = (0..side).flat_map(|row| pictures.iter().flat_map(move |p| p[row * side..(row + 1) * side].iter()));
    let film = [pictures.len() as u32 * BUFFER, BUFFER];
    let window = Window { x: 0, y: 0, width: film[0], height: film[1] };
    Image { film, window, pixels: pixels.copied().collect() }
}

/// A picture, and what each of its three lights sends: `terms.png`.
fn terms() -> Outcome {
    let lights = BufferDesc::Light { light: LightChoice::All, part: None };
    let (scene, settings, film) = film_of("softboxes.toml", &[Plane::Color.into(), lights])?;
    let mut pictures = Vec::new();
    for buffer in scene.buffers() {
        let Some(PlaneNumbers::Floats(numbers)) = film.numbers(*buffer) else { unreachable!("it was asked for") };
        let channels = buffer.plane().channels().len();
        pictures.push(numbers.chunks(channels).map(|pixel| [pixel[0], pixel[1], pixel[2], 1.0]).collect());
    }
    save("terms", &beside(&pictures), &scene.display(), &scene, &settings)
}

/// What is seen of the clockwork, how far away it is, its normals from the camera, and its objects: `buffers.png`.
fn buffers() -> Outcome {
    let planes = [Plane::Color, Plane::Depth, Plane::NormalCamera, Plane::ObjectId];
    let (scene, settings, film) = film_of("clockwork.toml", &planes.map(Into::into))?;
    let floats = |plane| match film.numbers(plane) {
        Some(PlaneNumbers::Floats(numbers)) => numbers.to_vec(),
        _ => unreachable!("it was asked for, in floats"),
    };
    let Some(PlaneNumbers::Wholes(ids)) = film.numbers(Plane::ObjectId) else { unreachable!("ids are whole") };
    let (depth, normals) = (floats(Plane::Depth), floats(Plane::NormalCamera));
    let finite = || depth.iter().copied().filter(|depth| depth.is_finite());
    let (near, far) = (finite().fold(f32::INFINITY, f32::min), finite().fold(0.0, f32::max));
    let decoded = |color: [f32; 3]| {
        let [r, g, b] = color.map(|c| Encoding::Srgb.decode(f64::from(c)) as f32);
        [r, g, b, 1.0]
    };
    let shown = |pixel: usize| {
        if !depth[pixel].is_finite() {
            return [[0.0, 0.0, 0.0, 1.0]; 3];
        }
        let nearness = 1.0 - 0.9 * (depth[pixel] - near) / (far - near);
        let normal: [f32; 3] = std::array::from_fn(|axis| normals[3 * pixel + axis] * 0.5 + 0.5);
        // Colours that follow each other are far apart
        let mixed = ids[pixel].wrapping_mul(2_654_435_769).to_le_bytes();
        let object = std::array::from_fn(|channel| 0.2 + 0.8 * f32::from(mixed[channel + 1]) / 255.0);
        [decoded([nearness; 3]), decoded(normal), decoded(object)]
    };
    let others: Vec<[[f32; 4]; 3]> = (0..ids.len()).map(shown).collect();
    let mut pictures = vec![film.develop().pixels];
    pictures.extend((0..3).map(|which| others.iter().map(|views| views[which]).collect()));
    save("buffers", &beside(&pictures), &scene.display(), &scene, &settings)
}

/// What `firstlight view-buffer` makes of a depth: `view-depth.png`.
fn view_depth() -> Outcome {
    let (scene, settings, film) = film_of("clockwork.toml", &[Plane::Depth.into()])?;
    let Some(numbers) = film.numbers(Plane::Depth) else { unreachable!("it was asked for") };
    let channels = ["Z".to_owned()];
    let size = [BUFFER; 2];
    let view =
        BufferView { name: "depth", channels: &channels, numbers, size, range: None, display: Display::default() };
    let bytes = view.encode(&scene.receipt(&settings)).map_err(|e| e.to_string())?;
    let path = Path::new("docs/src/pictures/view-depth.png");
    write(&root().join(path), &bytes)?;
    eprintln!("wrote {}", path.display());
    Ok(())
}

/// Renders one scene into `docs/src/pictures/NAME.png`.
fn picture(name: &str, text: &[u8], assets: &dyn Assets, size: Option<u32>) -> Outcome {
    let mut parsed = SceneDesc::parse(&format!("{name}.toml"), text, assets);
    if let Some(size) = size {
        (parsed.desc.render.width, parsed.desc.render.height) = (size, size);
    }
    compile_and_save(name, &parsed, assets)
}

fn compile_and_save(name: &str, parsed: &Parsed, assets: &dyn Assets) -> Outcome {
    let compiled = parsed
        .compile(assets, &CompileOptions { strict: true, ..CompileOptions::default() })
        .map_err(|e| e.to_string())?;
    let (scene, settings) = (&compiled.scene, RenderSettings::default());
    save(name, &rendered(scene, &settings)?.develop(), &scene.display(), scene, &settings)
}

fn rendered(scene: &Scene, settings: &RenderSettings) -> Result<Film, String> {
    let ControlFlow::Continue((film, _)) = render(scene, settings, &|_, _| ControlFlow::Continue(())) else {
        return Err("stopped".into());
    };
    Ok(film)
}

/// Writes `docs/src/pictures/NAME.png`.
fn save(name: &str, image: &Image, display: &Display, scene: &Scene, settings: &RenderSettings) -> Outcome {
    let bytes = image.encode(Format::Png8, display, &scene.receipt(settings)).map_err(|e| format!("{name}: {e}"))?;
    let path = Path::new("docs/src/pictures").join(format!("{name}.png"));
    write(&root().join(&path), &bytes)?;
    eprintln!("wrote {}", path.display());
    Ok(())
}
