//! From scene to film.
//!
//! Three renderers of the same bits over one scene, where every light is sampled at every camera ray:
//! [`plain`](plain/index.html) is the specification, one sample at a time; [`lanes`](lanes/index.html) decides sixteen
//! light samples at once and asks only the shapes that can stand in the way; [`shafts`](shafts/index.html) finds what
//! can for many points together. They share the way from pixel to surface and from light to film; what differs is how
//! the light of one source is summed at one surface, the trait [`Lighting`].
//!
//! [`cell`](cell/index.html) integrates lights and lights a surface once where that is enough; all else is as above.

mod arrival;
mod cell;
mod centers;
mod change;
mod coco;
mod counts;
mod coverage;
mod cut;
mod fence;
mod film;
mod fragment;
#[cfg(feature = "bench")]
pub(crate) mod given;
mod grid;
mod heat;
mod hits;
mod lanes;
mod light_queue;
mod lights;
mod many;
mod masks;
mod motion;
mod passes;
pub(crate) mod pixel;
mod plain;
mod pooled;
mod receipt;
mod receipt_settings;
mod relight;
pub(crate) mod resolve;
mod sampled;
mod shafts;
mod single;
mod solo;
mod square;
mod tile;

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

pub use coco::Coco;
pub use counts::{LightCounts, RenderStats};
pub use film::Film;
pub use heat::Heat;
pub use masks::{Mask, ObjectMasks};
pub use receipt_settings::{ReceiptFault, ReceiptSettings};
pub use relight::{LightChange, RelightError, Relit, relight};

use crate::accel::SimdLevel;
use crate::describe::words;
use crate::image::{Buffer, Image, Plane, Window};
use crate::light::Light;
use crate::math::Ray;
use crate::parallel;
use crate::scene::Scene;
use crate::visibility::Target;
use arrival::Arrivals;
use cell::{CELL, Cells};
pub(crate) use counts::Counts;
use coverage::{Coverage, CoveragePlanes};
use film::FilmTile;
use hits::PixelHits;
use lanes::Lanes;
use light_queue::LightQueue;
use lights::Lights;
use passes::Passes;
use pixel::{Lighting, PixelSum};
use plain::Plain;
use resolve::TermSums;
use shafts::Shafts;
use tile::Tile;

words! {
    /// How the edges of what a pixel holds are smoothed.
    pub enum AaMode {
        /// All n x n camera rays say what is seen; light is taken once for each surface in a pixel where it is shown to
        /// bend little over it. Where all area lights are sampled, and there are meshes, point sets or instances, that
        /// takes longer than [`Full`](Self::Full), whose picture it is then.
        Adaptive = "adaptive",
        /// Each of the n x n camera rays is lit by itself.
        Full = "full",
    }
}

words! {
    /// How it is found out how much of a light reaches a point.
    pub enum VisibilityMode {
        /// What may stand before a light is gathered once for many points; where nothing does, nothing is traced.
        Shafts = "shafts",
        /// Every sample of every light for itself, at every camera ray: the bits of the plain renderer. Lights that are
        /// integrated are sampled, and [`AaMode`] is of no account.
        Traced = "traced",
    }
}

/// A caller's wishes. None of them changes a bit of the picture, but `crop`, which chooses its part, and those that say
/// by which rules it is made: `aa_mode`, `visibility`, `reference`.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Threads to render with; all processors if `None`.
    pub threads: Option<NonZeroUsize>,
    /// Side of the square tiles that threads take turns at, in pixels, [`MIN_TILE`](Self::MIN_TILE) to
    /// [`MAX_TILE`](Self::MAX_TILE).
    pub tile_size: u32,
    /// The instruction set.
    pub simd: SimdLevel,
    /// The part of the film to render; all of it if `None`.
    pub crop: Option<Window>,
    /// How edges are smoothed, where lights are not traced sample by sample.
    pub aa_mode: AaMode,
    /// Renders with the plain code that is the specification: all lights are sampled, and each camera ray is lit by
    /// itself.
    pub reference: bool,
    /// How shadows are found.
    pub visibility: VisibilityMode,
    /// The planes of the film: [`Plane::Color`] alone unless said. What the scene's text asks for is
    /// [`Scene::buffers`], and is rendered where it is given here: `buffers: scene.buffers().to_vec()`. Without planes
    /// that are lit, no light is asked.
    pub buffers: Vec<Buffer>,
}

impl RenderSettings {
    /// The smallest tile.
    pub const MIN_TILE: u32 = 8;
    /// The largest tile.
    pub const MAX_TILE: u32 = 64;

    /// Whether these settings fit the scene and the machine.
    ///
    /// # Errors
    /// What does not fit, with the value and what is allowed.
    pub fn check(&self, scene: &Scene) -> Result<(), String> {
        let (min, max) = (Self::MIN_TILE, Self::MAX_TILE);
        if !(min..=max).contains(&self.tile_size) {
            return Err(format!("tile size {} is outside {min} to {max}", self.tile_size));
        }
        if let Some(fault) = scene.fault_of(&self.buffers) {
            return Err(format!("buffers: {fault}"));
        }
        if !self.simd.is_available() {
            let names: Vec<_> = SimdLevel::available().iter().map(|level| level.name()).collect();
            return Err(format!("this processor has no {}; it has {}", self.simd.name(), names.join(", ")));
        }
        if let Some(w) = self.crop {
            let fits = |start: u32, length: u32, all: u32| length > 0 && start as u64 + length as u64 <= all as u64;
            if !(fits(w.x, w.width, scene.width) && fits(w.y, w.height, scene.height)) {
                return Err(format!(
                    "the part {},{},{},{} (x, y, width, height) does not lie inside the picture of {} x {} pixels",
                    w.x, w.y, w.width, w.height, scene.width, scene.height
                ));
            }
        }
        let Window { width, height, .. } = self.window(scene);
        let pixels = width as u64 * height as u64;
        if pixels > MAX_PIXELS {
            return Err(format!(
                "{width} x {height} are {pixels} pixels, and at most {MAX_PIXELS} are rendered at once; render parts \
                 of the picture, each with --crop X,Y,WIDTH,HEIGHT"
            ));
        }
        Ok(())
    }

    /// Whether there is memory for the film, and for the largest file that can be made of it, an archive of arrays. For
    /// settings that [`check`](Self::check) has passed.
    ///
    /// # Errors
    /// How much it takes, and what to do.
    pub fn check_memory(&self, scene: &Scene) -> Result<(), String> {
        if self.renderer().samples_all() {
            let points = |light: &Light| if light.exact { light.samples() as u64 } else { 0 };
            let points: u64 = scene.lights.iter().map(points).sum();
            if points > MAX_POINTS {
                return Err(format!(
                    "sampled, the lights that are integrated have {points} points together, the limit is {MAX_POINTS}; \
                     give them fewer with --samples"
                ));
            }
        }
        let window = self.window(scene);
        let bytes = |buffers: &[Buffer]| buffers.iter().map(|buffer| buffer.plane().bytes()).sum::<usize>();
        let Passes { picture, unshadowed } = Passes::of(scene, &self.buffers);
        // What is rendered is there when what is made of it is
        let pixel = bytes(&self.buffers).max((bytes(&picture) + bytes(&unshadowed) + bytes(&self.buffers)).div_ceil(2));
        let both = 2 * window.width as usize * window.height as usize * pixel;
        Vec::<u8>::new().try_reserve_exact(both).map_err(|_| {
            let Window { width, height, .. } = window;
            format!("{width} x {height} pixels take {both} bytes, more than there is; render parts with a crop")
        })
    }

    /// What renders a scene by these settings.
    fn renderer_of(&self, scene: &Scene) -> Renderer {
        let areas = || scene.lights.iter().filter(|light| light.area().is_some());
        match self.renderer() {
            // With BVHs in the scene, testing whether rays may share sampled light takes longer than shading each ray
            Renderer::Adaptive
                if scene.geometry.has_trees() && areas().next().is_some() && areas().all(|light| !light.exact) =>
            {
                Renderer::Full
            }
            renderer => renderer,
        }
    }

    /// What renders by these settings, whatever the scene.
    fn renderer(&self) -> Renderer {
        match (self.reference, self.visibility, self.aa_mode) {
            (true, ..) => Renderer::Reference,
            (false, VisibilityMode::Traced, _) => Renderer::Traced,
            (false, VisibilityMode::Shafts, AaMode::Full) => Renderer::Full,
            (false, VisibilityMode::Shafts, AaMode::Adaptive) => Renderer::Adaptive,
        }
    }

    /// The part of the film to render.
    fn window(&self, scene: &Scene) -> Window {
        self.crop.unwrap_or(Window { x: 0, y: 0, width: scene.width, height: scene.height })
    }
}

/// The rules by which a picture is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Renderer {
    /// The plain code, which is the specification.
    Reference,
    /// Sixteen samples at once, all of them traced: its bits.
    Traced,
    /// Each camera ray is lit by itself. Its bits where lights are sampled; others are integrated.
    Full,
    /// Each surface is lit as often as it needs.
    Adaptive,
}

impl Renderer {
    /// Whether all lights are sampled, and that at every camera ray, whatever they say.
    fn samples_all(self) -> bool {
        matches!(self, Renderer::Reference | Renderer::Traced)
    }

    /// How edges are smoothed.
    fn aa_mode(self) -> AaMode {
        if self == Renderer::Adaptive { AaMode::Adaptive } else { AaMode::Full }
    }
}

impl Default for RenderSettings {
    fn default() -> Self {
        RenderSettings {
            threads: None,
            tile_size: 16,
            simd: SimdLevel::Auto,
            crop: None,
            aa_mode: AaMode::Adaptive,
            visibility: VisibilityMode::Shafts,
            reference: false,
            buffers: vec![Plane::Color.into()],
        }
    }
}

/// The most pixels that are rendered at once; the whole picture may have more.
const MAX_PIXELS: u64 = 1 << 27;

/// The most points of all lights that are integrated, where they are sampled all the same: 12 bytes each, on spheres
/// 24, and as much for shafts.
const MAX_POINTS: u64 = 1 << 26;

/// Shadow rays between two questions: some hundredths of a second of the fast renderer, some tenths of the plain one.
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
    let passes = Passes::of(scene, &settings.buffers);
    if passes.unshadowed.is_empty() && passes.picture == settings.buffers {
        return expose(scene, settings, &settings.buffers, progress);
    }
    // A pixel is done when it is in every pass
    let count = u64::from(!passes.picture.is_empty()) + u64::from(!passes.unshadowed.is_empty());
    let mut before = 0;
    let mut pass = |scene: &Scene, planes: &[Buffer]| {
        if planes.is_empty() {
            return ControlFlow::Continue(None);
        }
        let progress = |done, all| progress((before * all + done) / count, all);
        let exposed = expose(scene, settings, planes, &progress)?;
        before += 1;
        ControlFlow::Continue(Some(exposed))
    };
    let (picture, unshadowed) = (pass(scene, &passes.picture)?, pass(&scene.without_shadows(), &passes.unshadowed)?);
    let stats = [&picture, &unshadowed].into_iter().flatten().map(|(_, stats)| *stats);
    let stats = stats.reduce(|all, stats| all.and(&stats)).expect("there is a pass for every buffer");
    let film = picture.map_or_else(|| Film::new(scene, settings.window(scene), &[]), |(film, _)| film);
    let unshadowed = unshadowed.as_ref().map(|(film, _)| film);
    ControlFlow::Continue((Passes::develop(scene, &settings.buffers, film, unshadowed), stats))
}

/// Renders some planes in one pass.
fn expose(
    scene: &Scene,
    settings: &RenderSettings,
    planes: &[Buffer],
    progress: &(dyn Fn(u64, u64) -> ControlFlow<()> + Sync),
) -> ControlFlow<(), (Film, RenderStats)> {
    let window = settings.window(scene);
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
    let is_sampled = lights.emitters.iter().all(Option::is_none);
    let every_ray = renderer.samples_all() || renderer == Renderer::Full && is_sampled;
    let tiles = if every_ray {
        Tile::cover(window, settings.tile_size)
    } else {
        Tile::cover_cells(window, settings.tile_size, CELL)
    };
    let tiles = tile::spread(&tiles);
    let all = window.width as u64 * window.height as u64;
    let (done, stop) = (AtomicU64::new(0), AtomicBool::new(false));
    let by_shafts = every_ray && renderer == Renderer::Full;
    let targets = if by_shafts { Target::of_all(scene) } else { Vec::new() };
    let spare: Mutex<Vec<Cells>> = Mutex::new(Vec::new());
    let render_one = |tile: &Tile| {
        if stop.load(Ordering::Relaxed) {
            return;
        }
        // A tile can take minutes: ask in between as well
        let go_on = || {
            if progress(done.load(Ordering::Relaxed), all).is_break() {
                stop.store(true, Ordering::Relaxed);
            }
            if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let mut film_tile = FilmTile::new(tile, planes);
        let film = &mut film_tile;
        let token = level.token();
        let center_rays = if of_centers { centers::fill(scene, token, film) } else { 0 };
        if let Some(asked) = &of_all_rays
            && Coverage::new(scene, asked, token).fill(film, &go_on).is_break()
        {
            return;
        }
        let rendered = match renderer {
            _ if !is_lit => ControlFlow::Continue(Counts::default()),
            Renderer::Reference => render_tile(scene, film, &mut Plain, None, &go_on),
            Renderer::Traced => {
                let hits = scene.geometry.has_trees().then(|| PixelHits::new(token, scene.antialiasing));
                render_tile(scene, film, &mut Lanes::new(token), hits, &go_on)
            }
            Renderer::Full if is_sampled => Shafts::new(scene, &targets, token).render(film, &go_on),
            Renderer::Full | Renderer::Adaptive => {
                // Their memory goes from tile to tile
                let used = spare.lock().expect("no thread panics while it holds a renderer").pop();
                let mut cells = used.unwrap_or_else(|| {
                    let queue = LightQueue::new(scene, Arrivals::new(scene, &lights, token));
                    Cells::new(scene, renderer.aa_mode(), queue, planes)
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
        // A system that gives no threads still has this one
        Err(_) => tiles.iter().for_each(render_one),
    }
    if stop.into_inner() {
        return ControlFlow::Break(());
    }
    ControlFlow::Continue(result.into_inner().expect("no thread panics while it holds the film"))
}

/// Renders `scene` with the default settings, on all processors.
///
/// [`render`] takes settings, tells how far it is, can be stopped, and counts what it does.
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
/// the camera rays of neighbouring pixels are traced together. `go_on` is asked now and then.
fn render_tile(
    scene: &Scene,
    film: &mut FilmTile,
    lighting: &mut impl Lighting,
    mut hits: Option<PixelHits>,
    go_on: &impl Fn() -> ControlFlow<()>,
) -> ControlFlow<(), Counts> {
    let tile = film.tile;
    let mut counts = Counts::default();
    let mut pixel = PixelSum::new(scene);
    let mut sums = TermSums::new(scene, 1, &film.planes());
    let rays = (scene.antialiasing * scene.antialiasing) as f32;
    let side = hits.as_ref().map_or(1, PixelHits::side);
    for top in (0..tile.height).step_by(side as usize) {
        for left in (0..tile.width).step_by(side as usize) {
            let (w, h) = ((tile.width - left).min(side), (tile.height - top).min(side));
            if let Some(hits) = &mut hits {
                hits.trace(scene, tile.x + left, tile.y + top, w, h);
            }
            for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
                let hit = |column: u32, row: u32, ray: &Ray| match &hits {
                    Some(hits) => hits.get(x, y, column, row),
                    None => scene.intersect_local(ray),
                };
                pixel.clear();
                let at = [tile.x + left + x, tile.y + top + y];
                let before = counts.work();
                pixel.sample(scene, at, lighting, hit, &mut counts, go_on)?;
                pixel.resolve(scene, 0, &mut sums);
                sums.work[0] = rays + counts.work() - before;
                film.set_row(left + x, top + y, &sums, 0..1);
            }
        }
    }
    ControlFlow::Continue(counts)
}
