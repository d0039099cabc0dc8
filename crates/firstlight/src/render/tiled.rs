//! The renderer that pictures are made with: a cell of pixels goes through the same stations together, and each surface in a
//! pixel is shaded once where that is shown to be enough.
//!
//! - Which surfaces a pixel holds: blocks that hold one are proved without a ray for each ([`solo`](super::solo)), else all
//!   n x n camera rays say it ([`patch`](super::patch)).
//! - What arrives of each light at the middle of each patch, with a bound of how much it bends over it
//!   ([`arrival`](super::arrival)).
//! - Where the bound would show, the neighbours are asked: where shadows and highlights are wider than a pixel, what light
//!   does over a pixel shows in the second difference of three. Where that would show as well, or tells nothing, the light
//!   is asked for at every ray.
//!
//! Cells lie on a grid of the film, with a rim of one pixel around each, so that no decision depends on tiles or crops.

use std::ops::ControlFlow;

use super::arrival::{Arrival, Arrivals, Place};
use super::film::FilmTile;
use super::hits::PixelHits;
use super::many::Many;
use super::patch::{Patch, PixelPatches};
use super::solo::{self, Candidate, Pyramid};
use super::tile::Tile;
use super::{AaMode, Counts};
use crate::color::Rgb;
use crate::integrate::Sums;
use crate::material::Bsdf;
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;

/// In display steps: how much may bend over a patch that is shaded once.
pub(super) const BEND: f32 = 0.4;
/// Pixels across a cell.
pub(crate) const CELL: u32 = 32;
/// With its rim.
pub(super) const ACROSS: usize = CELL as usize + 2;
/// Pixels across the blocks that may hold one surface only.
const BLOCK: i64 = 8;
/// What light does within a pixel, at most, as a part of its second difference over three: a corner in the middle of
/// the pixel makes an eighth, the onset of a root nearly a fourth.
const WITHIN: f32 = 0.2;

/// One thread's way from tiles to film.
pub(crate) struct Tiled<'a> {
    scene: &'a Scene,
    mode: AaMode,
    hits: PixelHits,
    /// All that can be seen, if it is in lists.
    listed: Option<Vec<Candidate>>,
    /// What the cell's rays may meet of it, and the block's.
    near: [Vec<Candidate>; 2],
    arrivals: Arrivals<'a>,
    /// The cell and its rim, row by row.
    pixels: Vec<PixelPatches>,
    /// Where each pixel's patches begin among all of the cell.
    first: Vec<usize>,
    /// What arrived at each patch, light by light, and what that makes.
    arrived: Vec<Arrival>,
    values: Vec<Rgb>,
    /// Diffuse and specular of each light at one pixel, in scene order.
    terms: Vec<[Rgb; 2]>,
    /// In place of the three where lights are many.
    many: Option<Many<'a>>,
}

impl<'a> Tiled<'a> {
    pub fn new(scene: &'a Scene, mode: AaMode, hits: PixelHits, arrivals: Arrivals<'a>) -> Self {
        let listed = scene.geometry.listed && !scene.geometry.has_trees();
        let many = arrivals.tree().map(|tree| Many::new(scene, tree));
        Tiled {
            scene,
            mode,
            hits,
            listed: listed.then(|| solo::all(scene)),
            near: Default::default(),
            arrivals,
            pixels: (0..ACROSS * ACROSS).map(|_| PixelPatches::default()).collect(),
            first: vec![0; ACROSS * ACROSS],
            arrived: Vec::new(),
            values: Vec::new(),
            terms: Vec::new(),
            many,
        }
    }

    /// Renders one tile. `go_on` is asked now and then.
    pub fn render(&mut self, tile: &Tile, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<(), (FilmTile, Counts)> {
        let mut film = FilmTile::new(tile);
        let mut counts = Counts::default();
        let cells = |from: u32, length: u32| (from / CELL..(from + length).div_ceil(CELL)).map(|cell| cell * CELL);
        for y in cells(tile.y, tile.height) {
            for x in cells(tile.x, tile.width) {
                go_on()?;
                self.cell(tile, [x, y], &mut film, &mut counts, go_on)?;
            }
        }
        ControlFlow::Continue((film, counts))
    }

    /// Renders the part of a cell that is in the tile.
    fn cell(
        &mut self,
        tile: &Tile,
        corner: [u32; 2],
        film: &mut FilmTile,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let scene = self.scene;
        self.look(corner);
        let mut pixels = std::mem::take(&mut self.pixels);
        // What arrives at the middle of each patch
        let lights = scene.lights.len();
        self.arrived.clear();
        self.values.clear();
        if let Some(many) = &mut self.many {
            many.look(&pixels, &mut self.first, &mut self.arrivals, counts, go_on)?;
        } else {
            for (index, pixel) in pixels.iter().enumerate() {
                if index % ACROSS == 0 {
                    go_on()?;
                }
                self.first[index] = self.values.len();
                for patch in &pixel.patches {
                    self.once(patch, counts);
                }
            }
            debug_assert_eq!(self.arrived.len(), self.values.len() * lights);
        }
        for y in 0..CELL {
            for x in 0..CELL {
                let [i, j] = [corner[0] + x, corner[1] + y];
                let inside = |at: u32, from: u32, length: u32| at >= from && at < from + length;
                if inside(i, tile.x, tile.width) && inside(j, tile.y, tile.height) {
                    let index = (y as usize + 1) * ACROSS + x as usize + 1;
                    let color = self.finish(&pixels, index, [i, j], counts);
                    film.set(i - tile.x, j - tile.y, color);
                }
            }
            go_on()?;
        }
        std::mem::swap(&mut self.pixels, &mut pixels);
        ControlFlow::Continue(())
    }

    /// Finds out what each pixel of a cell and its rim holds.
    fn look(&mut self, corner: [u32; 2]) {
        let scene = self.scene;
        let once = self.mode == AaMode::Adaptive;
        let (left, top) = (corner[0] as i64 - 1, corner[1] as i64 - 1);
        let place = |i: i64, j: i64| (j - top) as usize * ACROSS + (i - left) as usize;
        // The part of the film that the cell and its rim cover
        let end = |from: i64, all: u32| (from + ACROSS as i64).min(all as i64);
        let (x0, y0) = (left.max(0), top.max(0));
        let (x1, y1) = (end(left, scene.width), end(top, scene.height));
        self.pixels.resize_with(ACROSS * ACROSS, PixelPatches::default);
        self.pixels.iter_mut().for_each(PixelPatches::clear);
        if let Some(listed) = &self.listed {
            let [near, nearer] = &mut self.near;
            let all = Pyramid::new(scene, left as f32, top as f32, ACROSS as f32);
            all.candidates(scene, listed, near);
            let blocks = |from: i64, to: i64| (from.div_euclid(BLOCK)..=(to - 1).div_euclid(BLOCK)).map(|b| b * BLOCK);
            for block_y in blocks(y0, y1) {
                for block_x in blocks(x0, x1) {
                    let block = Pyramid::new(scene, block_x as f32, block_y as f32, BLOCK as f32);
                    block.candidates(scene, near, nearer);
                    let only = if once { block.only(scene, nearer) } else { None };
                    for j in block_y.max(y0)..(block_y + BLOCK).min(y1) {
                        for i in block_x.max(x0)..(block_x + BLOCK).min(x1) {
                            let pixel = &mut self.pixels[place(i, j)];
                            let at = [i as u32, j as u32];
                            if nearer.is_empty() {
                                pixel.background = scene.antialiasing * scene.antialiasing;
                            } else if let Some(patch) = only.and_then(|only| Patch::whole(scene, at, only)) {
                                pixel.patches.push(patch);
                            } else {
                                let n = scene.antialiasing;
                                pixel.collect(scene, at, once, |column, row| {
                                    let (ray, _) = super::hits::camera_ray(scene, at[0] * n + column, at[1] * n + row);
                                    solo::first(scene, nearer, &ray)
                                });
                            }
                        }
                    }
                }
            }
            return;
        }
        let side = self.hits.side() as i64;
        for block_y in (y0..y1).step_by(side as usize) {
            for block_x in (x0..x1).step_by(side as usize) {
                let (w, h) = ((x1 - block_x).min(side), (y1 - block_y).min(side));
                self.hits.trace(scene, block_x as u32, block_y as u32, w as u32, h as u32);
                for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
                    let at = [(block_x + x) as u32, (block_y + y) as u32];
                    let hits = &self.hits;
                    let pixel = &mut self.pixels[place(block_x + x, block_y + y)];
                    pixel.collect(scene, at, once, |column, row| {
                        hits.get(scene.antialiasing, x as u32, y as u32, column, row)
                    });
                }
            }
        }
    }

    /// What arrives at the middle of a patch.
    fn once(&mut self, patch: &Patch, counts: &mut Counts) {
        let scene = self.scene;
        self.arrivals.look_around(&patch.si);
        let base = scene.ambient * patch.bsdf.ambient;
        let mut value = base;
        for index in 0..scene.lights.len() {
            let scale = self.arrivals.scale(index);
            let colors = [scale * patch.bsdf.diffuse, scale * patch.bsdf.specular];
            let (si, lobe) = (&patch.si, &patch.bsdf.lobe);
            let (reach, turn, off) = (patch.reach, patch.turn, patch.off);
            let place = Place { si, lobe, reach, turn, off, base, colors };
            let arrival = self.arrivals.arrival(index, &place, counts);
            value += colors[0] * arrival.sums.diffuse + colors[1] * arrival.sums.specular;
            self.arrived.push(arrival);
        }
        self.values.push(value);
    }

    /// The colour of a pixel: red, green, blue premultiplied, alpha.
    fn finish(&mut self, pixels: &[PixelPatches], index: usize, at: [u32; 2], counts: &mut Counts) -> [f32; 4] {
        let scene = self.scene;
        let rays = scene.antialiasing * scene.antialiasing;
        counts.camera_rays += rays as u64;
        let pixel = &pixels[index];
        self.terms.clear();
        let mut ambient = Rgb::BLACK;
        for patch in &pixel.patches {
            ambient += scene.ambient * patch.bsdf.ambient * patch.count(scene) as f32;
        }
        if let Some(many) = &mut self.many {
            let terms = &mut self.terms;
            many.finish(pixels, &self.first, index, at, &mut self.arrivals, counts, |term| terms.push(term));
        } else {
            self.terms.resize(scene.lights.len(), [Rgb::BLACK; 2]);
            self.light_by_light(pixels, index, at, counts);
        }
        // The sum in its one order
        let mean = |sum: Rgb| Rgb::new(sum.r / rays as f32, sum.g / rays as f32, sum.b / rays as f32);
        let uncovered = pixel.background as f32 / rays as f32;
        let mut color = if scene.transparent { Rgb::BLACK } else { scene.background * uncovered };
        color += mean(pixel.emission);
        color += mean(ambient);
        for [diffuse, specular] in &self.terms {
            color += mean(*diffuse);
            color += mean(*specular);
        }
        let alpha = if scene.transparent { 1.0 - uncovered } else { 1.0 };
        [color.r, color.g, color.b, alpha]
    }

    /// Adds what all lights send to a pixel, each for itself.
    fn light_by_light(&mut self, pixels: &[PixelPatches], index: usize, at: [u32; 2], counts: &mut Counts) {
        let scene = self.scene;
        for (k, patch) in pixels[index].patches.iter().enumerate() {
            let count = patch.count(scene);
            for light in 0..scene.lights.len() {
                if self.is_enough(pixels, index, k, light) {
                    let arrived = self.arrived[(self.first[index] + k) * scene.lights.len() + light];
                    let (scale, sums) = (self.arrivals.scale(light) * count as f32, arrived.sums);
                    self.terms[light][0] += scale * patch.bsdf.diffuse * sums.diffuse;
                    self.terms[light][1] += scale * patch.bsdf.specular * sums.specular;
                } else {
                    patch.for_each(scene, at, |si, bsdf| self.at_ray(light, si, bsdf, counts));
                }
            }
        }
    }

    /// Whether what arrives of a light at the middle of a patch will do for all of it.
    fn is_enough(&self, pixels: &[PixelPatches], index: usize, k: usize, light: usize) -> bool {
        let scene = self.scene;
        let patch = &pixels[index].patches[k];
        if patch.uneven {
            return false;
        }
        let lights = scene.lights.len();
        let arrived = |index: usize| &self.arrived[(self.first[index] + k) * lights + light];
        let (here, value) = (arrived(index), self.values[self.first[index] + k]);
        let scale = self.arrivals.scale(light);
        let allowed = BEND / (lights as f32).sqrt();
        let shows = |bend: &Sums| {
            let error = scale * patch.bsdf.diffuse * bend.diffuse + scale * patch.bsdf.specular * bend.specular;
            self.arrivals.steps(value, error) > allowed
        };
        if !shows(&here.bend) {
            return true;
        }
        if !here.resolved || !patch.is_whole(scene) {
            return false;
        }
        let arrived = |index: usize| Some(arrived(index).sums);
        second_difference(scene, pixels, index, patch, &here.sums, arrived).is_some_and(|bend| !shows(&bend))
    }

    /// Adds what one light sends to where one camera ray ends.
    fn at_ray(&mut self, index: usize, si: &SurfaceInteraction, bsdf: &Bsdf, counts: &mut Counts) {
        self.arrivals.look_around(si);
        let scale = self.arrivals.scale(index);
        let colors = [scale * bsdf.diffuse, scale * bsdf.specular];
        let base = self.scene.ambient * bsdf.ambient;
        let place = Place { si, lobe: &bsdf.lobe, reach: 0.0, turn: 0.0, off: 0.0, base, colors };
        let sums = self.arrivals.arrival(index, &place, counts).sums;
        self.terms[index][0] += colors[0] * sums.diffuse;
        self.terms[index][1] += colors[1] * sums.specular;
    }
}

/// How far what light does within a pixel can make its mean another, by what arrives `here` and at the neighbours, as `arrived` says;
/// `None` where those tell nothing.
pub(super) fn second_difference(
    scene: &Scene,
    pixels: &[PixelPatches],
    index: usize,
    patch: &Patch,
    here: &Sums,
    arrived: impl Fn(usize) -> Option<Sums>,
) -> Option<Sums> {
    let mut bend = Sums::default();
    for step in [1, ACROSS] {
        let neighbours = [index - step, index + step];
        let same = |i: &usize| {
            let patches = &pixels[*i].patches;
            patches.len() == 1
                && patches[0].is_whole(scene)
                && patches[0].si.surface == patch.si.surface
                && patches[0].bsdf.lobe == patch.bsdf.lobe
        };
        if !neighbours.iter().all(same) {
            return None;
        }
        let (before, after) = (arrived(neighbours[0])?, arrived(neighbours[1])?);
        let second = |a: f32, b: f32, c: f32| (a - b + (c - b)).abs() * WITHIN;
        bend.diffuse += second(before.diffuse, here.diffuse, after.diffuse);
        bend.specular += second(before.specular, here.specular, after.specular);
    }
    Some(bend)
}
