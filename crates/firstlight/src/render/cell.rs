//! The renderer that pictures are made with. A cell of 32 x 32 pixels passes through the stations together:
//!
//! ```text
//! primary        squares of pixels that provably see one surface; the camera rays of all others
//! lighting grid  light over such squares, interpolated between nodes: 16, 8, 4, 2 pixels across
//! mesh shadows   the visibility of lights behind trees; light over squares of pixels, interpolated behind them
//! shade          light at fragments: from one shading point, from one in each quadrant of the pixel, from all its
//!                camera rays; lights without a closed form are sampled at all rays together
//! resolve        the sum of each pixel
//! ```
//!
//! Each station has [`DirectLighting`] estimate all of its shading points in one call. Pixels whose error estimate is
//! too large go on to the next station.
//! Where lights are many, [`Many`] replaces all stations after the first. Cells lie on a grid of the film and are
//! always rendered whole, so no decision depends on tiles, crops or threads.

mod mesh_shadows;
mod penumbra_grid;
mod pixel_corners;
mod primary;

use std::iter;
use std::ops::ControlFlow;
use std::sync::Arc;

use super::Counts;
use super::direct::{DirectLighting, LightEstimate, LightQuery};
use super::fragment::{Fragment, Fragments, RayPoint, ShadingRate};
use super::lighting_grid::{LightingGrid, SurfaceBlock};
use super::many::Many;
use super::pooled::{PooledVisibility, salt};
use super::square::Square;
use super::visible_shape::{MeanBsdf, VisibleShape};
use crate::color::Rgb;
use crate::film::FilmTile;
use crate::film::catchers::ChosenPixels;
use crate::film::hits::{PixelHits, PixelRays};
use crate::film::resolve::{PixelTerms, ScaledTerm, Term, TermSums};
use crate::film::tile::Tile;
use crate::film::{AaMode, Heat};
use crate::image::Buffer;
use crate::integrate::TOLERANCE;
use crate::material::{Bsdf, Colors, LightTerm, Lobe, Moments, PARTS};
use crate::math::Ray;
use crate::scene::{LayerStack, Scene};
use crate::visibility::Visibility;
use mesh_shadows::MeshShadows;
use pixel_corners::PixelCorners;

/// Pixels across a cell.
pub(crate) const CELL: u32 = 32;
const PIXELS: usize = (CELL * CELL) as usize;
/// The most pairs of a fragment and a light whose camera rays are estimated in one call. It bounds the memory.
const AT_ONCE: usize = PIXELS;
/// Camera rays of a pixel that is lit at its quadrants alone.
const QUADRANTS: u32 = 4;

/// What is known of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PixelState {
    /// It is summed, or not on the film.
    Done,
    /// It is one of the pixels of this block.
    Block(u32),
    /// All of its rays see this shape.
    Only(VisibleShape),
    /// Its rays are traced.
    Traced,
}

/// A pixel with fragments, and the terms that do not come from lights.
#[derive(Clone, Copy, Debug, Default)]
struct Pixel {
    /// Its number in the cell.
    index: u32,
    terms: PixelTerms,
}

/// A light whose contribution to a fragment is not known yet.
#[derive(Clone, Copy, Debug)]
struct FragmentQuery {
    fragment: u32,
    light: u32,
    visibility: Visibility,
}

impl FragmentQuery {
    fn new(fragment: u32, light: u32) -> FragmentQuery {
        FragmentQuery { fragment, light, visibility: Visibility::Partial }
    }
}

/// Renders tiles, cell by cell, in one thread. Keeps its memory.
pub(crate) struct CellRenderer<'a> {
    scene: &'a Scene,
    mode: AaMode,
    lights: DirectLighting<'a>,
    corner: [u32; 2],
    /// The pixels that are asked for; `None`: all.
    chosen: Option<Arc<ChosenPixels>>,
    /// Pixel by pixel of the cell.
    states: Vec<PixelState>,
    sums: TermSums,
    blocks: Vec<SurfaceBlock>,
    /// The materials of the pixels of textured blocks.
    means: Vec<Option<MeanBsdf>>,
    corners: PixelCorners,
    /// The pixels with fragments, and their light, pixel by pixel, light by light, for a few lights; none for many.
    pixels: Vec<Pixel>,
    terms: Vec<LightTerm>,
    few: usize,
    grid: LightingGrid,
    fragments: Fragments,
    pixel_rays: PixelRays,
    /// Of one pixel: its camera rays, and their hits.
    rays: Vec<Ray>,
    ray_points: Vec<RayPoint>,
    /// The rays of a pixel of which one stands for others, under multisampling.
    samples: Vec<primary::CameraSample>,
    /// The layers of one ray.
    stack: LayerStack,
    hits: PixelHits,
    /// The lights to be estimated at each [`ShadingRate`].
    queues: [Vec<FragmentQuery>; 3],
    shadows: MeshShadows,
    many: Option<Many<'a>>,
}

impl<'a> CellRenderer<'a> {
    pub fn new(scene: &'a Scene, mode: AaMode, lights: DirectLighting<'a>, buffers: &[Buffer]) -> Self {
        let pixel_rays = PixelRays::new(lights.level(), scene.antialiasing);
        let hits = PixelHits::new(lights.level(), scene.antialiasing);
        let many = lights.tree().map(|tree| Many::new(scene, tree, buffers));
        let few = if many.is_some() { 0 } else { scene.lights.len() };
        // Many lights choose the points of a pixel themselves
        let mode = if many.is_some() && mode == AaMode::Multisample { AaMode::Adaptive } else { mode };
        CellRenderer {
            scene,
            mode,
            lights,
            corner: [0; 2],
            chosen: None,
            states: vec![PixelState::Done; PIXELS],
            sums: TermSums::new(scene, PIXELS, buffers),
            blocks: Vec::new(),
            means: Vec::new(),
            corners: PixelCorners::default(),
            pixels: Vec::new(),
            terms: Vec::new(),
            few,
            grid: LightingGrid::new(few),
            fragments: Fragments::new(scene, many.is_some()),
            pixel_rays,
            rays: Vec::new(),
            samples: Vec::new(),
            ray_points: Vec::new(),
            stack: LayerStack::default(),
            hits,
            queues: Default::default(),
            shadows: MeshShadows::new(scene, few),
            many,
        }
    }

    /// Renders one tile. It calls `go_on` between the stations of a cell, and stops where that breaks.
    pub fn render(&mut self, film: &mut FilmTile, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<(), Counts> {
        let mut counts = Counts::default();
        self.chosen = film.chosen.clone();
        for part in film.tile.parts(CELL, CELL) {
            go_on()?;
            self.cell([part.x, part.y].map(|at| at / CELL * CELL), &mut counts, go_on)?;
            self.deliver(part, film, &mut counts);
        }
        ControlFlow::Continue(counts)
    }

    /// Renders a cell.
    fn cell(&mut self, corner: [u32; 2], counts: &mut Counts, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        self.begin(corner);
        if let Some(stop) = self.chosen.as_ref().and_then(|chosen| chosen.stop(corner, CELL)) {
            self.lights.judge_at(stop);
        }
        self.primary(Square { x: corner[0], y: corner[1], side: CELL }, &VisibleShape::all(self.scene), counts);
        go_on()?;
        if let Some(mut many) = self.many.take() {
            let lit = self.many(&mut many, counts, go_on);
            self.many = Some(many);
            return lit;
        }
        self.grid.light(&mut self.lights, &self.blocks, &mut self.sums.work, counts, go_on)?;
        self.queue_lights(counts);
        self.mesh_shadows(counts, go_on)?;
        self.shade(ShadingRate::Fragment, counts, go_on)?;
        self.shade(ShadingRate::Quadrant, counts, go_on)?;
        self.shade_rays(counts, go_on)?;
        self.resolve();
        ControlFlow::Continue(())
    }

    fn begin(&mut self, corner: [u32; 2]) {
        self.corner = corner;
        self.states.fill(PixelState::Done);
        self.sums.work.fill(0.0);
        self.blocks.clear();
        self.means.clear();
        self.corners.begin();
        self.pixels.clear();
        self.terms.clear();
        self.grid.begin(corner);
        self.fragments.clear();
        self.queues.iter_mut().for_each(Vec::clear);
    }

    /// The number of a pixel of the film in the cell.
    fn index(&self, [i, j]: [u32; 2]) -> usize {
        ((j - self.corner[1]) * CELL + i - self.corner[0]) as usize
    }

    /// The pixel of the film with a number in the cell.
    fn at(&self, index: usize) -> [u32; 2] {
        [self.corner[0] + index as u32 % CELL, self.corner[1] + index as u32 / CELL]
    }

    /// The number of the pixel of a fragment in the cell.
    fn pixel_of(&self, fragment: usize) -> usize {
        self.pixels[self.fragments.all[fragment].pixel as usize].index as usize
    }

    /// The pixels of a square that are on the film.
    fn on_film(&self, square: Square) -> impl Iterator<Item = [u32; 2]> + use<> {
        let (width, height) = (self.scene.width, self.scene.height);
        square.pixels().filter(move |[i, j]| *i < width && *j < height)
    }

    /// The pixels of the cell that are on the film.
    fn cell_pixels(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let [x, y] = self.corner;
        self.on_film(Square { x, y, side: CELL })
    }

    fn rays_per_pixel(&self) -> u32 {
        self.scene.antialiasing * self.scene.antialiasing
    }

    /// The sum of a light over the rays of the pixel of a fragment.
    fn term(&mut self, fragment: u32, light: u32) -> &mut LightTerm {
        let pixel = self.fragments.all[fragment as usize].pixel as usize;
        &mut self.terms[pixel * self.few + light as usize]
    }

    /// Lights the fragments of a scene with many lights.
    fn many(
        &mut self,
        many: &mut Many<'a>,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let scene = self.scene;
        let [x, y] = self.corner;
        let size = [(scene.width - x).min(CELL), (scene.height - y).min(CELL)];
        for at in self.cell_pixels() {
            if let PixelState::Only(only) = self.states[self.index(at)] {
                self.trace(at, &[only], counts);
            }
        }
        self.add_ambient();
        let CellRenderer { fragments, pixels, sums, lights, .. } = self;
        for Pixel { index, terms } in pixels.iter() {
            terms.resolve(scene, iter::empty(), *index as usize, sums);
        }
        let pixel = |fragment: usize| &pixels[fragments.all[fragment].pixel as usize];
        many.begin(fragments, size, |fragment| pixel(fragment).index);
        many.light(fragments, lights, counts, go_on, |fragment, [sent, apart], took| {
            let Pixel { index, terms } = *pixel(fragment);
            terms.resolve(scene, sent.iter().copied(), index as usize, sums);
            PixelTerms::keep_apart(scene, apart, index as usize, sums);
            sums.work[index as usize] += took;
        })
    }

    /// Sums the pixels that the lighting grid has, adds fragments for the other pixels of its blocks, and queues the
    /// lights of all fragments that the grid does not have.
    fn queue_lights(&mut self, counts: &mut Counts) {
        let lights = self.scene.lights.len() as u32;
        for fragment in 0..self.fragments.all.len() as u32 {
            let queries = (0..lights).map(|light| FragmentQuery::new(fragment, light));
            self.queues[ShadingRate::Fragment as usize].extend(queries);
        }
        for block in 0..self.blocks.len() {
            let block = self.blocks[block];
            let Square { x, y, side } = block.square;
            let rows = if block.means.is_some() { y..y } else { y..(y + side).min(self.scene.height) };
            let columns = side.min(self.scene.width - x);
            for j in rows {
                self.sum_row(&block, [x, j], columns as usize, &block.bsdf);
                for at in (x..x + columns).map(|i| [i, j]).filter(|at| self.grid.has_all(&block, *at)) {
                    let index = self.index(at);
                    self.states[index] = PixelState::Done;
                }
            }
        }
        let is_adaptive = self.mode == AaMode::Adaptive;
        for at in self.cell_pixels() {
            let state = self.states[self.index(at)];
            let (shape, block) = match state {
                PixelState::Done | PixelState::Traced => continue,
                PixelState::Only(shape) if is_adaptive && self.add_varied(at, shape, counts) => continue,
                PixelState::Only(shape) => (shape, None),
                PixelState::Block(block) => {
                    let block = self.blocks[block as usize];
                    if self.sum_textured(at, &block) {
                        continue;
                    }
                    (block.shape, Some(block))
                }
            };
            let first = self.fragments.all.len();
            let number = self.pixels.len() as u32;
            match block {
                Some(SurfaceBlock { bsdf, means: None, .. })
                    if is_adaptive && self.fragments.add_whole(self.scene, number, at, shape, bsdf) =>
                {
                    let pixel = self.pixel(at, QUADRANTS, counts);
                    self.pixels.push(pixel);
                }
                _ => self.trace(at, &[shape], counts),
            }
            // A coat is a fragment of its own
            for fragment in first..self.fragments.all.len() {
                self.queue_quadrants(fragment, block, at);
            }
        }
    }

    /// Adds the lights that the lighting grid has of the block of a fragment in pixel `at`, and queues the others.
    fn queue_quadrants(&mut self, fragment: usize, block: Option<SurfaceBlock>, at: [u32; 2]) {
        let Fragment { mean, count, .. } = self.fragments.all[fragment];
        let block = block.filter(|_| mean.is_constant);
        for light in 0..self.scene.lights.len() as u32 {
            match block.and_then(|block| self.grid.arriving(&block, light as usize, at)) {
                Some(moments) => {
                    *self.term(fragment as u32, light) += mean.bsdf.colors.reflected(&(moments * count as f32))
                }
                None => self.queues[ShadingRate::Quadrant as usize].push(FragmentQuery::new(fragment as u32, light)),
            }
        }
    }

    /// Sums the pixels of a row of a block from `at` on, which are of one material, by the lighting grid; not a number
    /// where that lacks a light.
    fn sum_row(&mut self, block: &SurfaceBlock, at: [u32; 2], pixels: usize, bsdf: &Bsdf) {
        let first = self.index(at);
        self.sums.begin(first..first + pixels, Rgb::BLACK, 1.0);
        let ambient = iter::repeat_n(bsdf.base(&self.scene.ambient), pixels);
        self.sums.add(first, Term::Ambient, Rgb::WHITE, ambient);
        for light in 0..self.few {
            let scale = self.lights.scale(light);
            let row = self.grid.row(block, light, at, pixels);
            for part in 0..PARTS {
                let value = |arriving: &Moments| bsdf.colors.reflected(arriving).0[part];
                self.sums.add(first, Term::Light(Some(light as u32), part), scale, row.iter().map(value));
            }
        }
    }

    /// Sums a pixel of a textured block by the lighting grid; `false` if that lacks a light, or if colours and light
    /// vary together within the pixel.
    fn sum_textured(&mut self, at: [u32; 2], block: &SurfaceBlock) -> bool {
        let mean = block.means.and_then(|first| self.means[first + block.square.number(at)]);
        let Some(MeanBsdf { bsdf, contrast, .. }) = mean.filter(|_| self.grid.has_all(block, at)) else { return false };
        self.sum_row(block, at, 1, &bsdf);
        let index = self.index(at);
        if contrast != Colors::BLACK {
            let mut error = Rgb::BLACK;
            for light in 0..self.few {
                let Some(slope) = self.grid.slope(block, light, at) else { return false };
                error += self.lights.scale(light) * contrast.of(&slope) * 0.125;
            }
            if self.lights.steps(self.sums.color(index), error) > TOLERANCE.color_light_covariance {
                return false;
            }
        }
        self.states[index] = PixelState::Done;
        true
    }

    /// Estimates the queued lights at the shading points of a rate. Where these do not represent a fragment, the light
    /// is queued for a finer rate.
    fn shade(
        &mut self,
        rate: ShadingRate,
        counts: &mut Counts,
        go_on: &dyn Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let queue = std::mem::take(&mut self.queues[rate as usize]);
        if rate == ShadingRate::Quadrant {
            for FragmentQuery { fragment, .. } in &queue {
                let pixel = self.at(self.pixel_of(*fragment as usize));
                self.fragments.find_quadrants(self.scene, *fragment as usize, pixel);
            }
        }
        let estimates = self.estimate(rate, &queue, counts, go_on)?;
        let mut rest = &estimates[..];
        for mut query in queue {
            let FragmentQuery { fragment, light, .. } = query;
            let own = rest.split_off(..self.fragments.all[fragment as usize].range(rate).len()).unwrap_or_default();
            let pixel = self.pixel_of(fragment as usize);
            self.sums.work[pixel] += Heat::PLACE * own.len() as f32;
            if self.is_represented(rate, &query, own) {
                let of = &self.fragments.all[fragment as usize];
                let mut sum = LightTerm::BLACK;
                for (point, estimate) in of.range(rate).zip(own) {
                    let rays = self.fragments.part(rate, point).0 as f32;
                    let colors = self.fragments.points_of(rate)[point].bsdf.colors;
                    sum += colors.reflected(&(estimate.moments * rays));
                }
                *self.term(fragment, light) += sum;
                continue;
            }
            let mut finer = if rate == ShadingRate::Fragment { ShadingRate::Quadrant } else { ShadingRate::Ray };
            if let [one] = own {
                query.visibility = one.visibility;
                // A light that is sampled at fixed points, and varies too much
                if !one.moments.is_known() && !self.lights.is_integrated(light as usize) {
                    finer = ShadingRate::Ray;
                }
            }
            self.queues[finer as usize].push(query);
        }
        ControlFlow::Continue(())
    }

    /// Estimates lights at the shading points of fragments of a rate: fragment by fragment, point by point.
    fn estimate(
        &mut self,
        rate: ShadingRate,
        queue: &[FragmentQuery],
        counts: &mut Counts,
        go_on: &dyn Fn() -> ControlFlow<()>,
    ) -> ControlFlow<(), Vec<LightEstimate>> {
        let (mut queries, mut estimates) = (Vec::new(), Vec::new());
        for FragmentQuery { fragment, light, visibility } in queue {
            let points = self.fragments.all[*fragment as usize].range(rate);
            let query = |point| LightQuery { point: point as u32, light: *light, visibility: *visibility };
            queries.extend(points.map(query));
        }
        self.lights.estimate(self.fragments.points_of(rate), &queries, &mut estimates, counts, go_on)?;
        ControlFlow::Continue(estimates)
    }

    /// Whether the estimates of a light at the shading points of a rate represent a fragment.
    fn is_represented(&self, rate: ShadingRate, query: &FragmentQuery, estimates: &[LightEstimate]) -> bool {
        let fragment = &self.fragments.all[query.fragment as usize];
        let light = query.light;
        match (rate, estimates) {
            (_, []) => false,
            (ShadingRate::Fragment, [center]) => {
                // A light that is seen from all of the fragment varies with the direction to it
                let is_nearly_uniform = || {
                    let is_ggx = matches!(fragment.mean.bsdf.lobe, Lobe::Ggx(_));
                    center.turn <= if is_ggx { TOLERANCE.ggx_turn } else { TOLERANCE.middle_turn }
                        && self.bend(fragment, light, center, [center.turned(), 0.0]) <= TOLERANCE.middle_bend
                };
                let is_dark = center.moments == Moments::ZERO;
                center.moments.is_known()
                    && (fragment.rays.len() == 1 || center.is_uniform && (is_dark || is_nearly_uniform()))
            }
            _ => self.is_smooth_over_quadrants(fragment, light, estimates),
        }
    }

    /// The display steps that such parts of all that a light can send make at a shading point of a fragment: by its
    /// rotation, and by discontinuous derivatives.
    fn bend(&self, fragment: &Fragment, light: u32, estimate: &LightEstimate, [turned, kink]: [f32; 2]) -> f32 {
        let bend = (turned + kink) * estimate.most;
        let bsdf = &fragment.mean.bsdf;
        let highlight = match bsdf.lobe {
            // The second derivative of D is at most 4 D / alpha^2, so the farthest ray is off by a part `turned`; the
            // mean over a square is by a third of that, and a little more by masking
            Lobe::Ggx(_) if estimate.turn <= TOLERANCE.ggx_turn => {
                let here = estimate.moments.0[1].max(estimate.moments.0[2]);
                0.5 * turned * here + kink * estimate.most * bsdf.lobe.most()
            }
            _ => bend * bsdf.lobe.most(),
        };
        let colors = self.lights.scale(light as usize) * bsdf.colors;
        let value = colors.onto(bsdf.base(&self.scene.ambient), &estimate.moments);
        self.lights.steps(value, colors.of(&Moments::bounds(bend, highlight)))
    }

    /// Whether a light varies little enough over the quadrants of a fragment.
    fn is_smooth_over_quadrants(&self, fragment: &Fragment, light: u32, estimates: &[LightEstimate]) -> bool {
        if estimates.iter().any(|estimate| estimate.motion > TOLERANCE.motion || estimate.turn == f32::INFINITY) {
            return false;
        }
        let bends = |estimate: &LightEstimate| {
            let turned = if estimate.moments == Moments::ZERO { 0.0 } else { estimate.turned() };
            let parts = [turned, estimate.kink()];
            self.bend(fragment, light, estimate, parts) * fragment.share > TOLERANCE.quadrant_bend
        };
        if estimates.iter().any(bends) {
            return false;
        }
        let (mut least, mut most) = (estimates[0].moments, estimates[0].moments);
        for estimate in estimates {
            (least, most) = (least.min(estimate.moments), most.max(estimate.moments));
        }
        // Between shading points in shadow there may be light
        if most.cosine() == 0.0 && !estimates.iter().all(|estimate| estimate.is_uniform) {
            return false;
        }
        let range = most + least * -1.0;
        let bsdf = &fragment.mean.bsdf;
        let scale = self.lights.scale(light as usize);
        let colors = scale * bsdf.colors;
        let value = colors.onto(bsdf.base(&self.scene.ambient), &most);
        let sets_in = estimates.iter().any(|estimate| estimate.moments == Moments::ZERO);
        let allowed = if sets_in { TOLERANCE.spread * TOLERANCE.bends_at_once } else { TOLERANCE.spread };
        let weight = fragment.share * (self.few as f32).sqrt();
        if self.lights.steps(value, colors.of(&range)) * weight > allowed {
            return false;
        }
        // Fewer than four quadrants do not show how light varies along both axes
        fragment.range(ShadingRate::Quadrant).all(|point| {
            let (_, contrast) = self.fragments.part(ShadingRate::Quadrant, point);
            let error = scale * contrast.of(&range) * 0.125;
            contrast == Colors::BLACK
                || estimates.len() == 4 && self.lights.steps(value, error) * weight <= TOLERANCE.color_light_covariance
        })
    }

    /// Estimates the queued lights at each ray of the fragments.
    fn shade_rays(&mut self, counts: &mut Counts, go_on: &dyn Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        let queue = std::mem::take(&mut self.queues[ShadingRate::Ray as usize]);
        // The most lights that may be sampled for each fragment
        let mut sampled = vec![0; self.fragments.all.len()];
        for FragmentQuery { fragment, light, .. } in &queue {
            self.trace_rays(*fragment as usize, counts);
            sampled[*fragment as usize] += usize::from(self.lights.is_integrated(*light as usize));
        }
        if self.scene.geometry.is_sampled_past() {
            for (fragment, sampled) in sampled.iter_mut().enumerate() {
                *sampled += self.count_sampled(fragment);
            }
        }
        for some in queue.chunks(AT_ONCE) {
            let estimates = self.estimate(ShadingRate::Ray, some, counts, go_on)?;
            let mut rest = &estimates[..];
            for FragmentQuery { fragment, light, .. } in some {
                let Fragment { surface, share, rays, count, .. } = self.fragments.all[*fragment as usize].clone();
                let own = rest.split_off(..rays.len()).unwrap_or_default();
                let pixel = self.pixel_of(*fragment as usize);
                self.sums.work[pixel] += Heat::PLACE * rays.len() as f32;
                let mut sum = LightTerm::BLACK;
                // Rays at which the light has no closed form sample it together
                let mut pooled = None;
                for (point, estimate) in self.fragments.rays[rays.clone()].iter().zip(own) {
                    if estimate.moments.is_known() {
                        sum += point.bsdf.colors.reflected(&estimate.moments);
                        continue;
                    }
                    let (salt, light) = (salt(self.at(pixel), surface), *light as usize);
                    let (scale, sampled) = (self.lights.scale(light), sampled[*fragment as usize]);
                    let new = || PooledVisibility::new(light, scale, rays.len(), share, salt, Rgb::BLACK, sampled);
                    counts.visibility.classes[Visibility::Partial as usize] += 1;
                    pooled.get_or_insert_with(new).add_sampled(point, &mut self.lights, counts);
                }
                if let Some(pooled) = pooled {
                    go_on()?;
                    let before = counts.work();
                    sum += pooled.estimate(&mut self.lights, counts).terms;
                    self.sums.work[pixel] += counts.work() - before;
                }
                if count as usize != rays.len() {
                    sum = sum * (count as f32 / rays.len() as f32);
                }
                *self.term(*fragment, *light) += sum;
            }
        }
        ControlFlow::Continue(())
    }

    /// Makes sure that the rays of a fragment are traced.
    fn trace_rays(&mut self, fragment: usize, counts: &mut Counts) {
        if self.fragments.all[fragment].rays.is_empty() {
            let pixel = self.pixel_of(fragment);
            let at = self.at(pixel);
            let rays = self.pixel_rays.of(self.scene, at);
            // Shadows of lights that have an extent are wide: a pixel needs one point there as well
            let is_one = self.mode == AaMode::Multisample && self.lights.are_all_integrated();
            let most = if is_one { 1 } else { rays.len() };
            self.fragments.trace(self.scene, fragment, at, rays, most);
            let traced = self.fragments.all[fragment].rays.len();
            self.sums.work[pixel] += traced as f32;
            counts.looks += traced as u64;
        }
    }

    /// Adds ambient light to the sums of the pixels with fragments.
    fn add_ambient(&mut self) {
        for Fragment { pixel, mean, count, .. } in &self.fragments.all {
            let pixel = &mut self.pixels[*pixel as usize];
            pixel.terms.ambient += mean.bsdf.base(&self.scene.ambient) * *count as f32;
        }
    }

    /// Sums the pixels with fragments.
    fn resolve(&mut self) {
        self.add_ambient();
        for (number, Pixel { index, terms }) in self.pixels.iter().enumerate() {
            let scales = self.lights.scales().iter().copied();
            let lit = ScaledTerm::of_all(scales, &self.terms[number * self.few..][..self.few]);
            terms.resolve(self.scene, lit, *index as usize, &mut self.sums);
        }
    }

    /// Copies the part of the cell that is in the tile to the film.
    fn deliver(&mut self, part: Tile, film: &mut FilmTile, counts: &mut Counts) {
        let rays = u64::from(self.rays_per_pixel());
        for y in part.y..part.y + part.height {
            let first = self.index([part.x, y]);
            counts.camera_rays += rays * u64::from(part.width);
            film.set_row([part.x, y], &self.sums, first..first + part.width as usize);
        }
    }
}
