//! From scene to film.
//!
//! Three renderers of the same bits over one scene, where every light is sampled at every camera ray:
//! [`plain`](plain/index.html) is the specification, one sample at a time; [`lanes`](lanes/index.html) tests sixteen
//! light samples at once, past the shapes that may occlude the light; [`shafts`](shafts/index.html) gathers occluders
//! for many points together. They differ in how one light is summed at one surface, the trait [`Lighting`].
//!
//! [`cell`](cell/index.html) integrates lights, and lights a surface once where an error estimate allows it.

mod cell;
#[cfg(feature = "bench")]
pub(crate) mod chosen_points;
mod counts;
mod cut;
mod direct;
mod fragment;
mod interpolation;
mod lanes;
mod lighting_grid;
mod lights;
mod listed_occluder_cache;
mod many;
pub(crate) mod pixel;
mod plain;
mod pooled;
mod shafts;
mod square;
mod tile_frustum;
mod visible_shape;

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

pub use counts::{LightCounts, RenderStats};

use crate::accel::SimdLevel;
use crate::film::catchers::{self, ChosenPixels, Shadows};
use crate::film::coverage::{Coverage, CoveragePlanes};
use crate::film::hits::PixelHits;
use crate::film::passes::Passes;
use crate::film::resolve::TermSums;
use crate::film::settings::Renderer;
use crate::film::tile::{self, Tile};
use crate::film::{AaMode, Film, FilmTile, RenderSettings, centers};
use crate::image::{Buffer, Image, Plane, Window};
use crate::math::Ray;
use crate::parallel;
use crate::scene::Scene;
use crate::visibility::Target;
use cell::{CELL, CellRenderer};
pub(crate) use counts::Counts;
use direct::DirectLighting;
use lanes::Lanes;
use lights::Lights;
use pixel::{Lighting, PixelSum};
use plain::Plain;
use shafts::Shafts;

/// Shadow rays between two calls of `go_on`: hundredths of a second with shafts, tenths of a second without.
const QUESTION_EVERY: u64 = 1 << 23;

/// Renders `scene`. `progress(done, all)`, in pixels, is called after each tile from the thread that rendered it, and
/// now and then within one that takes long; on `Break` the render stops, without a film.
///
/// # Panics
/// If the settings do not fit, see [`RenderSettings::check`].
pub fn render(
    scene: &Scene,
    settings: &RenderSettings,
    progress: &(dyn Fn(u64, u64) -> ControlFlow<()> + Sync),
) -> ControlFlow<(), (Film, RenderStats)> {
    if let Err(fault) = settings.check(scene) {
        panic!("{fault}");
    }
    let window = settings.window(scene);
    let passes = Passes::of(scene, &settings.buffers);
    let catchers = scene.catchers.as_ref().filter(|_| catchers::change_any(&passes.picture));
    if passes.unshadowed.is_empty() && passes.picture == settings.buffers && catchers.is_none() {
        return expose(scene, settings, (window, None), &settings.buffers, progress);
    }
    // A pixel is done when it is in every pass
    let of_catchers = if catchers.is_some() { catchers::PASSES } else { 0 };
    let count = u64::from(!passes.picture.is_empty()) + u64::from(!passes.unshadowed.is_empty()) + of_catchers;
    let pixels = u64::from(window.width) * u64::from(window.height);
    let (mut before, mut all_stats) = (0, None);
    let mut pass = |scene: &Scene, part: (Window, Option<ChosenPixels>), planes: &[Buffer]| {
        if planes.is_empty() {
            return ControlFlow::Continue(None);
        }
        let progress = |done, all| progress((before * pixels + done * pixels / all) / count, pixels);
        let (film, stats) = expose(scene, settings, part, planes, &progress)?;
        before += 1;
        all_stats = Some(all_stats.map_or(stats, |all: RenderStats| all.and(&stats)));
        ControlFlow::Continue(Some(film))
    };
    let picture = pass(scene, (window, None), &passes.picture)?;
    let picture = picture.unwrap_or_else(|| Film::new(scene, window, &[]));
    let mut shadows = None;
    if let Some(catchers) = catchers {
        let cells = catchers::whole_cells(scene, window, CELL);
        let is_integrated =
            !settings.renderer().samples_all() && scene.lights.iter().any(|light| light.is_integrated());
        let heat = passes.picture.contains(&Plane::Rays.into());
        let kinds = [is_integrated, heat];
        let found = Shadows::find(scene, catchers, (cells, CELL), kinds, |scene, planes, chosen| {
            let film = pass(scene, (cells, chosen), planes)?;
            ControlFlow::Continue(film.expect("it has planes"))
        })?;
        let mut changed = catchers::changed(&passes.picture);
        changed.extend(heat.then_some(Buffer::from(Plane::Rays)));
        let black = match found.mixed() {
            Some(mixed) => pass(&scene.with_black_catchers(catchers), (cells, Some(mixed)), &changed)?,
            None => None,
        };
        shadows = Some((found, black));
    }
    let unshadowed = pass(&scene.without_shadows(), (window, None), &passes.unshadowed)?;
    let stats = all_stats.expect("there is a pass for every buffer");
    let cover = |picture: &mut Film| {
        if let Some((shadows, black)) = shadows {
            shadows.cover(picture, black.as_ref());
        }
    };
    ControlFlow::Continue((Passes::develop(scene, &settings.buffers, picture, unshadowed.as_ref(), cover), stats))
}

/// Renders some planes of a window, or of some pixels of it, in one pass.
fn expose(
    scene: &Scene,
    settings: &RenderSettings,
    (window, chosen): (Window, Option<ChosenPixels>),
    planes: &[Buffer],
    progress: &(dyn Fn(u64, u64) -> ControlFlow<()> + Sync),
) -> ControlFlow<(), (Film, RenderStats)> {
    let chosen = chosen.map(Arc::new);
    let threads = settings.threads.map_or_else(available_threads, NonZeroUsize::get);
    let renderer = settings.renderer_of(scene);
    let level = settings.simd.resolve();
    let simd = if renderer == Renderer::Reference { SimdLevel::Fallback } else { level };
    let nothing = Counts::default().stats(simd, threads);
    let result = Mutex::new((Film::new(scene, window, planes), nothing));
    let of_centers = planes.iter().any(|buffer| buffer.plane().is_of_center());
    let of_all_rays = CoveragePlanes::new(scene, planes);
    let is_lit = planes.iter().any(|buffer| buffer.plane().is_lit());
    let lights = Lights::new(scene);
    // Where every light is sampled at every ray, the bits are those of the plain renderer
    let is_sampled = lights.integrated == 0;
    let every_ray = renderer.samples_all() || renderer == Renderer::Full && is_sampled;
    let tiles: Vec<Tile> = window.parts(settings.tile_size, if every_ray { 1 } else { CELL }).collect();
    let tiles = tile::spread(&tiles);
    let all = window.width as u64 * window.height as u64;
    let (done, stop) = (AtomicU64::new(0), AtomicBool::new(false));
    let by_shafts = every_ray && renderer == Renderer::Full;
    let targets = if by_shafts { Target::of_all(scene) } else { Vec::new() };
    let spare: Mutex<Vec<CellRenderer>> = Mutex::new(Vec::new());
    let render_one = |tile: &Tile| {
        if stop.load(Ordering::Relaxed) {
            return;
        }
        // A tile can take minutes, so a render can be stopped within one
        let go_on = || {
            if progress(done.load(Ordering::Relaxed), all).is_break() {
                stop.store(true, Ordering::Relaxed);
            }
            if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let mut film_tile = FilmTile::new(*tile, planes, chosen.clone());
        let film = &mut film_tile;
        let token = level.token();
        let center_rays = if of_centers { centers::fill(scene, token, film) } else { 0 };
        if let Some(asked) = &of_all_rays
            && Coverage::new(scene, asked, token).fill(film, &go_on).is_break()
        {
            return;
        }
        let rendered = match renderer {
            _ if !is_lit || !film.asks_any() => ControlFlow::Continue(Counts::default()),
            Renderer::Reference => render_tile(scene, film, &mut Plain, None, &go_on),
            Renderer::Traced => {
                let hits = scene.geometry.has_trees().then(|| PixelHits::new(token, scene.antialiasing));
                render_tile(scene, film, &mut Lanes::new(token), hits, &go_on)
            }
            Renderer::Full if is_sampled => Shafts::new(scene, &targets, token).render(film, &go_on),
            Renderer::Full | Renderer::Adaptive | Renderer::Multisample => {
                // Memory is reused from tile to tile
                let used = spare.lock().expect("no thread panics while it holds a renderer").pop();
                let mut cells = used.unwrap_or_else(|| {
                    let direct = DirectLighting::new(scene, &lights, token);
                    CellRenderer::new(scene, renderer.aa_mode(), direct, planes)
                });
                let rendered = cells.render(film, &go_on);
                spare.lock().expect("no thread panics while it holds a renderer").push(cells);
                rendered
            }
        };
        let ControlFlow::Continue(mut counts) = rendered else { return };
        counts.camera_rays += center_rays;
        let pixels = tile.width as u64 * tile.height as u64;
        if of_all_rays.is_some() {
            counts.camera_rays += pixels * u64::from(scene.antialiasing) * u64::from(scene.antialiasing);
        }
        {
            let (film, stats) = &mut *result.lock().expect("no thread panics while it holds the film");
            film.merge(&film_tile);
            *stats = stats.and(&counts.stats(simd, threads));
        }
        let now = done.fetch_add(pixels, Ordering::Relaxed) + pixels;
        if progress(now, all).is_break() {
            stop.store(true, Ordering::Relaxed);
        }
    };
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(|| parallel::for_each(tiles.len(), &|i| render_one(&tiles[i]))),
        // Without a pool the calling thread renders
        Err(_) => tiles.iter().for_each(render_one),
    }
    if stop.into_inner() {
        return ControlFlow::Break(());
    }
    ControlFlow::Continue(result.into_inner().expect("no thread panics while it holds the film"))
}

/// Renders `scene` with the default settings, on all processors.
///
/// [`render`] takes settings, reports progress, can be stopped, and counts its work.
pub fn render_image(scene: &Scene) -> Image {
    match render(scene, &RenderSettings::default(), &|_, _| ControlFlow::Continue(())) {
        ControlFlow::Continue((film, _)) => film.develop(),
        ControlFlow::Break(()) => unreachable!("only the progress function stops a render"),
    }
}

fn available_threads() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

/// Renders one tile: n x n camera rays a pixel, row by row, and at each surface all lights in scene order. With `hits`
/// the camera rays of neighbouring pixels are traced together. `go_on` is called between them.
fn render_tile(
    scene: &Scene,
    film: &mut FilmTile,
    lighting: &mut impl Lighting,
    mut hits: Option<PixelHits>,
    go_on: &impl Fn() -> ControlFlow<()>,
) -> ControlFlow<(), Counts> {
    let mut counts = Counts::default();
    let mut pixel = PixelSum::new(scene);
    let mut sums = TermSums::new(scene, 1, &film.planes());
    let rays = (scene.antialiasing * scene.antialiasing) as f32;
    let side = hits.as_ref().map_or(1, PixelHits::side);
    for block in film.tile.parts(side, 1) {
        if let Some(hits) = &mut hits {
            hits.trace(scene, block);
        }
        for at in block.pixels() {
            if !film.asks(at) {
                continue;
            }
            let hit = |column: u32, row: u32, ray: &Ray| match &hits {
                Some(hits) => hits.get(at, column, row),
                None => scene.intersect_local(ray),
            };
            pixel.clear();
            let before = counts.work();
            pixel.sample(scene, at, lighting, hit, &mut counts, go_on)?;
            pixel.resolve(scene, 0, &mut sums);
            sums.work[0] = rays + counts.work() - before;
            film.set_row(at, &sums, 0..1);
        }
    }
    ControlFlow::Continue(counts)
}
