//! The renderer of scenes with many lights: each surface in a pixel of a cell is shaded once where that is shown to be
//! enough.
//!
//! Squares of pixels that hold one surface are proved without a ray for each ([`solo`](super::solo)), else all n x n
//! camera rays say it ([`patch`](super::patch)); what the lights do there, [`many`](super::many) says.
//!
//! Cells lie on a grid of the film, with a rim of one pixel around each, so that no decision depends on tiles or crops.

mod mean;

use std::ops::ControlFlow;

use super::arrival::Arrivals;
use super::cell::CELL;
use super::film::FilmTile;
use super::hits::PixelHits;
use super::many::Many;
use super::patch::{Patch, PixelPatches};
use super::resolve::{LightTerm, PixelTerms};
use super::solo::{self, Candidate, Pyramid};
use super::square::Square;
use super::tile::Tile;
use super::{AaMode, Counts};
use crate::color::Rgb;
use crate::scene::Scene;

pub(super) use mean::{BEND, second_difference, within};

/// With its rim.
pub(super) const ACROSS: usize = CELL as usize + 2;
/// Pixels across the smallest squares that are asked whether they hold one surface.
const SMALLEST: u32 = 2;
/// Lists of candidates: of the cell with its rim, and of squares of each size down to the smallest.
const DEPTHS: usize = (CELL / SMALLEST).ilog2() as usize + 2;

/// How much is known of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Known {
    /// Nothing yet.
    Nothing,
    /// All of its rays meet this shape.
    Only(Candidate),
    /// Its patches.
    Patches,
}

/// One thread's way from tiles to film.
pub(crate) struct Tiled<'a> {
    scene: &'a Scene,
    mode: AaMode,
    hits: PixelHits,
    /// All that can be seen, if it is in lists.
    listed: Option<Vec<Candidate>>,
    /// What the rays of the cell and its rim may meet of it; those of the cell, its quarters, their quarters.
    near: [Vec<Candidate>; DEPTHS],
    /// The upper left corner of the cell.
    corner: [u32; 2],
    arrivals: Arrivals<'a>,
    /// The cell and its rim, row by row.
    known: Vec<Known>,
    pixels: Vec<PixelPatches>,
    /// The colours that are known without looking at neighbours.
    colors: Vec<Option<[f32; 4]>>,
    /// What each pixel took; see [`Heat`](super::Heat).
    work: Vec<f32>,
    /// Where the light of each pixel's patches begins among all of the cell, once it is known.
    first: Vec<usize>,
    /// Diffuse and specular of each light at one pixel, with its scale.
    scaled_terms: Vec<(Rgb, LightTerm)>,
    many: Many<'a>,
}

impl<'a> Tiled<'a> {
    pub fn new(scene: &'a Scene, mode: AaMode, hits: PixelHits, arrivals: Arrivals<'a>) -> Self {
        let listed = scene.geometry.listed && !scene.geometry.has_trees();
        let many = Many::new(scene, arrivals.tree().expect("scenes with many lights have a tree"));
        Tiled {
            scene,
            mode,
            hits,
            listed: listed.then(|| solo::all(scene)),
            near: Default::default(),
            corner: [0; 2],
            arrivals,
            known: vec![Known::Nothing; ACROSS * ACROSS],
            colors: vec![None; ACROSS * ACROSS],
            work: vec![0.0; ACROSS * ACROSS],
            pixels: (0..ACROSS * ACROSS).map(|_| PixelPatches::default()).collect(),
            first: vec![0; ACROSS * ACROSS],
            scaled_terms: Vec::new(),
            many,
        }
    }

    /// Renders one tile. `go_on` is asked now and then.
    pub fn render(&mut self, film: &mut FilmTile, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<(), Counts> {
        let tile = &{ film.tile };
        let mut counts = Counts::default();
        for corner in tile.cells(CELL) {
            go_on()?;
            self.cell(tile, corner, film, &mut counts, go_on)?;
        }
        ControlFlow::Continue(counts)
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
        self.corner = corner;
        self.known.fill(Known::Nothing);
        self.colors.fill(None);
        self.work.fill(0.0);
        if let Some(listed) = &self.listed {
            let [x, y] = corner.map(|at| at as f32 - 1.0);
            Pyramid::new(scene, x, y, ACROSS as f32).candidates(scene, listed, &mut self.near[0]);
            // All of the cell, also where it is not in the tile: what is found must not depend on that
            self.split(Square { x: corner[0], y: corner[1], side: CELL }, 1, counts, go_on)?;
        } else {
            self.trace(counts, go_on)?;
        }
        self.look_at_all(counts, go_on)?;
        let rays = (scene.antialiasing * scene.antialiasing) as u64;
        for y in 0..CELL {
            for x in 0..CELL {
                let [i, j] = [corner[0] + x, corner[1] + y];
                if tile.contains([i, j]) {
                    counts.camera_rays += rays;
                    let index = (y as usize + 1) * ACROSS + x as usize + 1;
                    let before = counts.work();
                    let color = match self.colors[index] {
                        Some(color) => color,
                        None => self.finish([i, j], counts),
                    };
                    film.set(i - tile.x, j - tile.y, color, self.work[index] + counts.work() - before);
                }
            }
            go_on()?;
        }
        ControlFlow::Continue(())
    }

    /// Where a pixel of the cell or its rim is kept.
    fn index(&self, [i, j]: [u32; 2]) -> usize {
        (j + 1 - self.corner[1]) as usize * ACROSS + (i + 1 - self.corner[0]) as usize
    }

    /// Finds out what the pixels of a square hold, and lights what it can of them together. `depth` is that of the list
    /// for its candidates, those before it hold those of what it is a quarter of.
    fn split(
        &mut self,
        square: Square,
        depth: usize,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let scene = self.scene;
        let pyramid = Pyramid::new(scene, square.x as f32, square.y as f32, square.side as f32);
        let (outer, inner) = self.near.split_at_mut(depth);
        let near = &mut inner[0];
        pyramid.candidates(scene, &outer[depth - 1], near);
        let n = scene.antialiasing;
        if near.is_empty() {
            let color = PixelTerms { background: n * n, ..PixelTerms::default() }.resolve(scene, std::iter::empty());
            square.pixels().for_each(|at| self.learn(at, Known::Nothing, Some(color), 0.0));
            return ControlFlow::Continue(());
        }
        if self.mode == AaMode::Adaptive
            && let Some(only) = pyramid.only(scene, near)
        {
            square.pixels().for_each(|at| self.learn(at, Known::Only(only), None, 0.0));
            return ControlFlow::Continue(());
        }
        if square.side > SMALLEST {
            for quarter in square.quarters_on([scene.width, scene.height]) {
                self.split(quarter, depth + 1, counts, go_on)?;
            }
            return ControlFlow::Continue(());
        }
        go_on()?;
        for at in square.pixels().filter(|[i, j]| *i < scene.width && *j < scene.height) {
            let index = self.index(at);
            self.pixels[index].collect_listed(scene, at, self.mode == AaMode::Adaptive, &self.near[depth]);
            self.known[index] = Known::Patches;
            self.work[index] += (n * n) as f32;
            counts.looks += (n * n) as u64;
        }
        ControlFlow::Continue(())
    }

    /// Notes what is known of a pixel, if the film has it.
    fn learn(&mut self, [i, j]: [u32; 2], known: Known, color: Option<[f32; 4]>, work: f32) {
        if i < self.scene.width && j < self.scene.height {
            let index = self.index([i, j]);
            (self.known[index], self.colors[index], self.work[index]) = (known, color, work);
        }
    }

    /// Traces all rays of a cell and its rim.
    fn trace(&mut self, counts: &mut Counts, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        let scene = self.scene;
        let once = self.mode == AaMode::Adaptive;
        let rays = (scene.antialiasing * scene.antialiasing) as u64;
        let [left, top] = self.corner.map(|at| at.saturating_sub(1));
        let [right, bottom] = [0, 1].map(|axis| (self.corner[axis] + CELL + 1).min([scene.width, scene.height][axis]));
        let side = self.hits.side();
        for block_y in (top..bottom).step_by(side as usize) {
            for block_x in (left..right).step_by(side as usize) {
                let (w, h) = ((right - block_x).min(side), (bottom - block_y).min(side));
                self.hits.trace(scene, block_x, block_y, w, h);
                for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
                    let at = [block_x + x, block_y + y];
                    let index = self.index(at);
                    let hits = &self.hits;
                    self.pixels[index]
                        .collect(scene, at, once, |column, row| hits.get(scene.antialiasing, x, y, column, row));
                    self.known[index] = Known::Patches;
                    self.work[index] = rays as f32;
                    counts.looks += rays;
                }
            }
            go_on()?;
        }
        ControlFlow::Continue(())
    }

    /// Makes sure that the patches of a pixel of the cell or its rim are known; `false` if the film ends before it.
    fn hold(&mut self, [i, j]: [u32; 2], counts: &mut Counts) -> bool {
        let scene = self.scene;
        // Left of the first pixel the number wraps around
        if i >= scene.width || j >= scene.height {
            return false;
        }
        let index = self.index([i, j]);
        let pixel = &mut self.pixels[index];
        match self.known[index] {
            Known::Patches => {}
            Known::Only(only) if let Some(patch) = Patch::whole(scene, [i, j], only) => {
                pixel.clear();
                pixel.patches.push(patch);
            }
            _ => {
                pixel.collect_listed(scene, [i, j], self.mode == AaMode::Adaptive, &self.near[0]);
                counts.looks += (scene.antialiasing * scene.antialiasing) as u64;
            }
        }
        true
    }

    /// Finds out what many lights do at all patches of the cell and its rim.
    fn look_at_all(&mut self, counts: &mut Counts, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        let before = counts.work();
        for (y, x) in (0..ACROSS as u32).flat_map(|y| (0..ACROSS as u32).map(move |x| (y, x))) {
            // One less, for the rim
            let at = [self.corner[0].wrapping_add(x).wrapping_sub(1), self.corner[1].wrapping_add(y).wrapping_sub(1)];
            if !self.hold(at, counts) {
                self.pixels[y as usize * ACROSS + x as usize].clear();
            }
        }
        self.many.look(&self.pixels, &mut self.first, &mut self.arrivals, counts, go_on)?;
        let each = (counts.work() - before) / (CELL * CELL) as f32;
        self.work.iter_mut().for_each(|work| *work += each);
        ControlFlow::Continue(())
    }

    /// The colour of a pixel: red, green, blue premultiplied, alpha.
    fn finish(&mut self, at: [u32; 2], counts: &mut Counts) -> [f32; 4] {
        let scene = self.scene;
        let index = self.index(at);
        let mut terms = self.pixels[index].terms;
        for patch in &self.pixels[index].patches {
            terms.ambient += scene.ambient * patch.bsdf.ambient * patch.count(scene) as f32;
        }
        let scaled = &mut self.scaled_terms;
        scaled.clear();
        let arrivals = &mut self.arrivals;
        self.many.finish(&self.pixels, &self.first, index, at, arrivals, counts, |term| scaled.push(term));
        terms.resolve(scene, scaled.iter().copied())
    }
}
