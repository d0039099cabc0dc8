//! What the pixels of a cell see: squares that are proved to see one surface are found without a ray for each; the rays
//! of all others are traced, those that may meet something in trees as bundles.

use super::{CELL, Cells, Pixel, PixelState};
use crate::film::hits::camera_ray;
use crate::film::resolve::{LightTerm, PixelTerms};
use crate::film::tile::Tile;
use crate::material::{Bsdf, ShadingPoint};
use crate::render::fragment::{Contrast, Member, RayHit};
use crate::render::grid::Block;
use crate::render::solo::{Candidate, Pyramid};
use crate::render::square::Square;
use crate::render::{AaMode, Counts};
use crate::scene::Scene;
use crate::shape::RayDifferential;

/// Pixels across the smallest squares that are asked whether they hold one surface.
const SMALLEST: u32 = 2;
/// Pixels across the largest square whose colours are looked up one by one.
const PATCHWORK: u32 = 8;

impl Cells<'_> {
    /// Finds out what the pixels of the cell see.
    pub(super) fn primary(&mut self, counts: &mut Counts) {
        let [x, y] = self.corner;
        let square = Square { x, y, side: CELL };
        let pyramid = Pyramid::new(self.scene, x as f32, y as f32, CELL as f32);
        let mut near = std::mem::take(&mut self.near[0]);
        pyramid.candidates(self.scene, &self.listed, &mut near);
        self.near[0] = near;
        self.split(square, 1, counts);
    }

    /// Finds out what the pixels of a square see. `depth` is that of the list for its candidates, those before it hold
    /// those of what it is a quarter of.
    fn split(&mut self, square: Square, depth: usize, counts: &mut Counts) {
        let scene = self.scene;
        let pyramid = Pyramid::new(scene, square.x as f32, square.y as f32, square.side as f32);
        let (outer, inner) = self.near.split_at_mut(depth);
        let near = &mut inner[0];
        pyramid.candidates(scene, &outer[depth - 1], near);
        let n = scene.antialiasing;
        if near.is_empty() {
            let terms = PixelTerms { background: n * n, ..PixelTerms::default() };
            for at in square.pixels().filter(|[i, j]| *i < scene.width && *j < scene.height) {
                let index = self.index(at);
                terms.resolve(scene, std::iter::empty(), index, &mut self.sums);
            }
            return;
        }
        if self.mode == AaMode::Adaptive
            && let Some(only) = pyramid.only(scene, near)
        {
            return if self.many.is_some() {
                self.mark(square, PixelState::Only(only))
            } else {
                self.block(square, only)
            };
        }
        let by_bundles = near.contains(&Candidate::Trees);
        if square.side > if by_bundles { SMALLEST.max(self.hits.side()) } else { SMALLEST } {
            for quarter in square.quarters_on([scene.width, scene.height]) {
                self.split(quarter, depth + 1, counts);
            }
            return;
        }
        if by_bundles {
            return self.trace_bundles(square, counts);
        }
        let near = std::mem::take(&mut self.near[depth]);
        for at in square.pixels().filter(|[i, j]| *i < scene.width && *j < scene.height) {
            self.trace(at, &near, counts);
        }
        self.near[depth] = near;
    }

    /// Finds out what the rays of a square see that may meet anything.
    fn trace_bundles(&mut self, Square { x, y, side }: Square, counts: &mut Counts) {
        let scene = self.scene;
        let step = self.hits.side().min(side);
        let (width, height) = (side.min(scene.width - x), side.min(scene.height - y));
        for block in (Tile { x, y, width, height }).parts(step, 1) {
            self.hits.trace(scene, block);
            for at in block.pixels() {
                self.sort_hits(at, counts);
            }
        }
    }

    /// Sorts what the rays of a pixel meet, which was found together with its neighbours.
    fn sort_hits(&mut self, [i, j]: [u32; 2], counts: &mut Counts) {
        let scene = self.scene;
        let n = scene.antialiasing;
        let mut pixel = self.pixel([i, j], n * n, counts);
        let number = self.pixels.len() as u32;
        self.rays.clear();
        self.seen.clear();
        let mut shapes = std::mem::take(&mut self.shapes);
        shapes.clear();
        for at in (0..n).flat_map(|y| (0..n).map(move |x| [x, y])) {
            let Some(hit) = self.hits.get([i, j], at[0], at[1]) else {
                pixel.terms.background += 1;
                continue;
            };
            if let Some(light) = hit.surface.index().checked_sub(scene.geometry.surfaces.len()) {
                pixel.terms.emission.add(scene.lights[light].radiance, 1);
                continue;
            }
            let (ray, differential) = camera_ray(scene, i * n + at[0], j * n + at[1]);
            // Footprints are for textures
            let differential = if scene.textures.is_empty() { RayDifferential::default() } else { differential };
            let at = at.map(|at| at as u16);
            match Candidate::of(scene, &hit) {
                Some(shape) => {
                    let place = shapes.iter().position(|other| *other == shape).unwrap_or_else(|| {
                        shapes.push(shape);
                        shapes.len() - 1
                    });
                    self.rays.push((place as u32, RayHit { ray, t: hit.t, at }));
                }
                None => {
                    let si = scene.local_surface(&ray, &hit, &differential);
                    let bsdf = scene.materials[si.material.index()].bsdf(&si, &scene.textures);
                    self.seen.push(Member::new(ShadingPoint::of(&si, &bsdf, scene.ambient), at));
                }
            }
        }
        self.pixels.push(pixel);
        self.group(number, [i, j], &shapes);
        self.shapes = shapes;
        let (mode, once) = (self.mode, self.mode == AaMode::Adaptive);
        self.fragments.add_seen(scene, number, [i, j], &mut self.seen, once, |count| share(scene, mode, count));
    }

    /// A pixel whose terms are to be summed, from so many rays.
    pub(super) fn pixel(&mut self, at: [u32; 2], rays: u32, counts: &mut Counts) -> Pixel {
        let index = self.index(at);
        self.sums.work[index] += rays as f32;
        counts.looks += u64::from(rays);
        self.states[index] = PixelState::Traced;
        self.terms.resize(self.terms.len() + self.few, LightTerm::BLACK);
        Pixel { index: index as u32, ..Pixel::default() }
    }

    /// Finds out what the rays of a pixel see that meet nothing but these.
    pub(super) fn trace(&mut self, [i, j]: [u32; 2], near: &[Candidate], counts: &mut Counts) {
        let scene = self.scene;
        let n = scene.antialiasing;
        let mut pixel = self.pixel([i, j], n * n, counts);
        let number = self.pixels.len() as u32;
        // Which of them each ray meets first: of several at the same distance, the one with the lowest id
        self.rays.clear();
        for (k, ray) in self.pixel_rays.of(scene, [i, j]).iter().enumerate() {
            let (ray, at) = (*ray, [k as u32 % n, k as u32 / n].map(|at| at as u16));
            let mut first: Option<(usize, f64)> = None;
            for (place, of) in near.iter().enumerate() {
                if let Some(t) = of.intersect(scene, &ray)
                    && first.is_none_or(|(before, nearest)| {
                        t < nearest || t == nearest && of.surface(scene) < near[before].surface(scene)
                    })
                {
                    first = Some((place, t));
                }
            }
            match first {
                None => pixel.terms.background += 1,
                Some((place, t)) => match near[place] {
                    Candidate::Light(light) => pixel.terms.emission.add(scene.lights[light as usize].radiance, 1),
                    _ => self.rays.push((place as u32, RayHit { ray, t, at })),
                },
            }
        }
        self.pixels.push(pixel);
        self.group(number, [i, j], near);
    }

    /// Makes fragments of the rays of a pixel that meet these shapes: one of each, in the order in which they are met;
    /// without adaptive antialiasing one of each ray.
    fn group(&mut self, number: u32, at: [u32; 2], shapes: &[Candidate]) {
        let (scene, mode) = (self.scene, self.mode);
        let share = |count: usize| share(scene, mode, count);
        for k in 0..self.rays.len() {
            let (place, ray) = self.rays[k];
            let shape = shapes[place as usize];
            if mode == AaMode::Full {
                self.fragments.add(scene, number, at, shape, std::iter::once(ray), share);
            } else if self.rays[..k].iter().all(|(before, _)| *before != place) {
                let same = self.rays[k..].iter().filter(|(of, _)| *of == place).map(|(_, ray)| *ray);
                self.fragments.add(scene, number, at, shape, same, share);
            }
        }
    }

    /// Notes a square that is proved to see one shape.
    fn block(&mut self, square: Square, only: Candidate) {
        let scene = self.scene;
        let even = self.fragments.plain.get(scene, only).or_else(|| only.even(scene, square));
        if even.is_none() && square.side > PATCHWORK {
            for quarter in square.quarters_on([scene.width, scene.height]) {
                self.block(quarter, only);
            }
            return;
        }
        let first = self.patchwork.len();
        if even.is_none() {
            self.patchwork.resize(first + (square.side * square.side) as usize, (None, Contrast::default()));
            let patchwork = &mut self.patchwork[first..];
            // Beyond the film's edge as well: it is a part of the square
            each_mean(scene, only, square, &mut |[i, j], bsdf, contrast| {
                patchwork[((j - square.y) * square.side + i - square.x) as usize] = (Some(bsdf), contrast);
            });
        }
        let block = match even {
            Some(bsdf) => Some(Block::even(square, only, bsdf)),
            None => Block::new(square, only, first, self.patchwork[first..].iter().map(|(bsdf, _)| *bsdf)),
        };
        let state = match block {
            Some(block) => {
                self.blocks.push(block);
                PixelState::Block(self.blocks.len() as u32 - 1)
            }
            None => PixelState::Only(only),
        };
        self.mark(square, state);
    }

    /// Notes what is known of the pixels of a square.
    fn mark(&mut self, square: Square, state: PixelState) {
        for at in square.pixels() {
            let index = self.index(at);
            self.states[index] = state;
        }
    }
}

/// The share of a pixel that so many of its rays have, where each surface is lit once.
fn share(scene: &Scene, mode: AaMode, rays: usize) -> f32 {
    match mode {
        AaMode::Adaptive => rays as f32 / (scene.antialiasing * scene.antialiasing) as f32,
        AaMode::Full => 1.0,
    }
}

/// Tells the material at each pixel of a square that sees only this, the mean over its rays; nothing for pixels over
/// which more than colours change.
fn each_mean(scene: &Scene, only: Candidate, square: Square, tell: &mut impl FnMut([u32; 2], Bsdf, Contrast)) {
    if square.side == 1 {
        let at = [square.x, square.y];
        if let Some((bsdf, contrast)) = only.mean(scene, at) {
            tell(at, bsdf, contrast);
        }
    } else if let Some(bsdf) = only.even(scene, square) {
        square.pixels().for_each(|at| tell(at, bsdf, Contrast::default()));
    } else {
        for quarter in square.quarters() {
            each_mean(scene, only, quarter, tell);
        }
    }
}
