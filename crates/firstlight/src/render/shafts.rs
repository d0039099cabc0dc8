//! Sampled light by shafts: the occluders of a light are gathered once for neighbouring points.
//!
//! The camera rays of a block of pixels are traced first. Then, light by light, a [`VisibilityResolver`] classifies the
//! visibility of the light from all points of the block together ([`Sampled`]).

use std::ops::ControlFlow;

use fearless_simd::Level;

use super::direct::Sampled;
use super::pixel::PixelSum;
use super::{Counts, QUESTION_EVERY};
use crate::film::FilmTile;
use crate::film::hits::{PixelHits, camera_ray};
use crate::film::resolve::TermSums;
use crate::film::tile::Tile;
use crate::ids::LightId;
use crate::material::{Moments, ShadingPoint};
use crate::scene::Scene;
use crate::visibility::{Target, Viewpoint, VisibilityResolver};

/// The points of a block of pixels, and what is needed to light them.
pub(crate) struct Shafts<'a> {
    scene: &'a Scene,
    targets: &'a [Target],
    level: Level,
    hits: PixelHits,
    points: Vec<Viewpoint>,
    surfaces: Vec<ShadingPoint>,
    /// What one light sends to each point.
    sums: Vec<Moments>,
    /// The points that are being lit, part by part.
    order: Vec<u32>,
    resolver: VisibilityResolver,
}

impl<'a> Shafts<'a> {
    pub fn new(scene: &'a Scene, targets: &'a [Target], level: Level) -> Self {
        Shafts {
            scene,
            targets,
            level,
            hits: PixelHits::new(level, scene.antialiasing),
            points: Vec::new(),
            surfaces: Vec::new(),
            sums: Vec::new(),
            order: Vec::new(),
            resolver: VisibilityResolver::default(),
        }
    }

    /// Renders one tile.
    pub fn render(&mut self, film: &mut FilmTile, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<(), Counts> {
        let mut counts = Counts::default();
        let side = self.hits.side();
        let rays = (self.scene.antialiasing * self.scene.antialiasing) as f32;
        let mut pixels: Vec<(PixelSum, usize)> = (0..side * side).map(|_| (PixelSum::new(self.scene), 0)).collect();
        let mut sums = TermSums::new(self.scene, 1, &film.planes());
        for block in film.tile.parts(side, 1) {
            if !block.pixels().any(|at| film.asks(at)) {
                continue;
            }
            let pixels = &mut pixels[..(block.width * block.height) as usize];
            let before = counts.work();
            self.block(block, pixels, &mut counts, go_on)?;
            // The work for all points of the block together is divided among its pixels
            let work = rays + (counts.work() - before) / pixels.len() as f32;
            for (at, (pixel, _)) in block.pixels().zip(pixels) {
                pixel.resolve(self.scene, 0, &mut sums);
                sums.work[0] = work;
                film.set_row(at, &sums, 0..1);
            }
        }
        ControlFlow::Continue(counts)
    }

    /// Renders the pixels of a block, row by row. Each goes with the number of points of those up to it.
    fn block(
        &mut self,
        block: Tile,
        pixels: &mut [(PixelSum, usize)],
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let scene = self.scene;
        let n = scene.antialiasing;
        self.hits.trace(scene, block);
        self.points.clear();
        self.surfaces.clear();
        for ([i, j], (pixel, end)) in block.pixels().zip(&mut *pixels) {
            pixel.clear();
            for row in 0..n {
                for column in 0..n {
                    counts.camera_rays += 1;
                    // Computed again: storing a ray takes longer
                    let (ray, differential) = camera_ray(scene, i * n + column, j * n + row);
                    let hit = self.hits.get([i, j], column, row);
                    pixel.see_ray(scene, &ray, &differential, hit, |_, point| {
                        self.points.push(Viewpoint::of(&point));
                        self.surfaces.push(point);
                    });
                }
            }
            *end = self.surfaces.len();
        }
        for index in 0..scene.lights.len() {
            self.light(index, counts, go_on)?;
            let mut start = 0;
            for (pixel, end) in pixels.iter_mut() {
                for k in start..*end {
                    let point = &self.surfaces[k];
                    if shines_on(scene, index, point) {
                        pixel.light(index, &point.bsdf, &self.sums[k]);
                    }
                }
                start = *end;
            }
        }
        ControlFlow::Continue(())
    }

    /// Finds what one light sends to each point that it shines on.
    fn light(&mut self, index: usize, counts: &mut Counts, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        let scene = self.scene;
        let light = Sampled::new(scene, self.level, index, self.targets);
        let (surfaces, sums) = (&self.surfaces, &mut self.sums);
        sums.clear();
        sums.resize(surfaces.len(), Moments::ZERO);
        // Points that nothing can shadow
        self.order.clear();
        for (k, point) in surfaces.iter().enumerate() {
            if !shines_on(scene, index, point) {
                continue;
            }
            if light.is_shadowed(point) {
                self.order.push(k as u32);
            } else {
                sums[k] = light.unshadowed(point, counts);
            }
        }
        // The others in parts, between which a render can be stopped
        let at_once = (QUESTION_EVERY / light.samples()).clamp(1, 1 << 20) as usize;
        for part in self.order.chunks_mut(at_once) {
            if counts.shadow_rays >= counts.next_question {
                counts.next_question = counts.shadow_rays + QUESTION_EVERY;
                go_on()?;
            }
            light.classify(&mut self.resolver, &self.points, part, counts, |k, visibility, view| {
                sums[k] = light.sent(&surfaces[k], visibility, view);
            });
        }
        ControlFlow::Continue(())
    }
}

/// Whether a surface lets light `index` shine on it.
#[inline(always)]
fn shines_on(scene: &Scene, index: usize, point: &ShadingPoint) -> bool {
    let links = scene.geometry.lights_of(point.surface);
    scene.geometry.links.contains(links, LightId(index as u32))
}
