//! The surfaces that the pixels of a cell see. Squares that provably see one surface are found without a ray for each
//! pixel; the rays of all other pixels are traced, those that may hit something in the trees in packets.

use super::{CELL, CellRenderer, Pixel, PixelState};
use crate::film::hits::camera_ray;
use crate::film::resolve::{LightTerm, PixelTerms};
use crate::material::{Lobe, ShadingPoint};
use crate::math::Ray;
use crate::render::fragment::{RayHit, RayPoint};
use crate::render::lighting_grid::SurfaceBlock;
use crate::render::square::Square;
use crate::render::tile_frustum::TileFrustum;
use crate::render::visible_shape::{MeanBsdf, VisibleShape};
use crate::render::{AaMode, Counts};
use crate::scene::{Hit, Scene};
use crate::shape::RayDifferential;

/// Pixels across the smallest squares that may provably see one surface.
const SMALLEST: u32 = 2;
/// Pixels across the largest square whose textured materials are looked up pixel by pixel.
const TEXTURED: u32 = 8;
/// The most lobes of such a square: each has nodes of its own.
const LOBES: usize = 4;

/// What a camera ray hits.
enum Seen {
    Background,
    Light(usize),
    Shape(VisibleShape, f64),
    InTrees(Hit),
}

impl CellRenderer<'_> {
    /// Finds the surfaces that the pixels of the cell see.
    pub(super) fn primary(&mut self, counts: &mut Counts) {
        let [x, y] = self.corner;
        let frustum = TileFrustum::new(self.scene, x as f32, y as f32, CELL as f32);
        let mut near = Vec::new();
        frustum.candidates(self.scene, &self.shapes, &mut near);
        self.split(Square { x, y, side: CELL }, &near, counts);
    }

    /// Finds the surfaces that the pixels of a square see. `candidates` are all shapes that a square around it may see.
    fn split(&mut self, square: Square, candidates: &[VisibleShape], counts: &mut Counts) {
        let scene = self.scene;
        let frustum = TileFrustum::new(scene, square.x as f32, square.y as f32, square.side as f32);
        let mut near = Vec::new();
        frustum.candidates(scene, candidates, &mut near);
        if near.is_empty() {
            let terms = PixelTerms { background: self.rays_per_pixel(), ..PixelTerms::default() };
            for at in self.on_film(square) {
                let index = self.index(at);
                terms.resolve(scene, std::iter::empty(), index, &mut self.sums);
            }
            return;
        }
        if self.mode == AaMode::Adaptive
            && let Some(only) = frustum.single_shape(scene, &near)
        {
            return if self.many.is_some() {
                self.mark(square, PixelState::Only(only))
            } else {
                self.add_blocks(square, only)
            };
        }
        let in_packets = near.contains(&VisibleShape::Trees);
        if square.side > if in_packets { SMALLEST.max(self.hits.side()) } else { SMALLEST } {
            for quarter in square.quarters_on([scene.width, scene.height]) {
                self.split(quarter, &near, counts);
            }
        } else if in_packets {
            self.trace_packets(square, counts);
        } else {
            for at in self.on_film(square) {
                self.trace(at, &near, counts);
            }
        }
    }

    /// Traces the rays of a square that may hit anything.
    fn trace_packets(&mut self, Square { x, y, side }: Square, counts: &mut Counts) {
        let scene = self.scene;
        let step = self.hits.side().min(side);
        let [right, bottom] = [(x + side).min(scene.width), (y + side).min(scene.height)];
        let starts = |from: u32, to: u32| (from..to).step_by(step as usize);
        for (top, left) in starts(y, bottom).flat_map(|top| starts(x, right).map(move |left| (top, left))) {
            let (w, h) = ((right - left).min(step), (bottom - top).min(step));
            self.hits.trace(scene, left, top, w, h);
            for (row, column) in (0..h).flat_map(|row| (0..w).map(move |column| (row, column))) {
                let seen = |cells: &Self, [x, y]: [u16; 2], _: &Ray| {
                    let Some(hit) = cells.hits.get(column, row, x.into(), y.into()) else { return Seen::Background };
                    match (
                        hit.surface.index().checked_sub(scene.geometry.surfaces.len()),
                        VisibleShape::of(scene, &hit),
                    ) {
                        (Some(light), _) => Seen::Light(light),
                        (None, Some(shape)) => Seen::Shape(shape, hit.t),
                        (None, None) => Seen::InTrees(hit),
                    }
                };
                self.add_pixel([left + column, top + row], seen, counts);
            }
        }
    }

    /// Traces the rays of a pixel that may hit `near` and nothing else.
    pub(super) fn trace(&mut self, at: [u32; 2], near: &[VisibleShape], counts: &mut Counts) {
        let scene = self.scene;
        let seen = |_: &Self, _: [u16; 2], ray: &Ray| {
            // Of several hits at one distance, the one on the surface with the lowest id
            let hits = near.iter().filter_map(|shape| Some((*shape, shape.intersect(scene, ray)?)));
            let nearer = |one: (VisibleShape, f64), other: (VisibleShape, f64)| {
                let is_nearer = other.1 < one.1 || other.1 == one.1 && other.0.surface(scene) < one.0.surface(scene);
                if is_nearer { other } else { one }
            };
            match hits.reduce(nearer) {
                None => Seen::Background,
                Some((VisibleShape::Light(light), _)) => Seen::Light(light as usize),
                Some((shape, t)) => Seen::Shape(shape, t),
            }
        };
        self.add_pixel(at, seen, counts);
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

    /// Adds a pixel whose rays hit what `seen` returns, with its fragments: one of each surface, in the order in which
    /// the rays hit them; without adaptive antialiasing one of each ray.
    fn add_pixel(&mut self, [i, j]: [u32; 2], seen: impl Fn(&Self, [u16; 2], &Ray) -> Seen, counts: &mut Counts) {
        let (scene, n) = (self.scene, self.scene.antialiasing);
        let mut pixel = self.pixel([i, j], n * n, counts);
        let rays = self.pixel_rays.of(scene, [i, j]).to_vec();
        let (mut on_shapes, mut in_trees) = (Vec::new(), Vec::new());
        for (k, ray) in (0..).zip(rays) {
            let at = [k % n, k / n].map(|at| at as u16);
            match seen(self, at, &ray) {
                Seen::Background => pixel.terms.background += 1,
                Seen::Light(light) => pixel.terms.emission.add(scene.lights[light].radiance, 1),
                Seen::Shape(shape, t) => on_shapes.push((shape, RayHit { ray, t, at })),
                Seen::InTrees(hit) => {
                    // Only textures need differentials
                    let differential = match scene.textures.is_empty() {
                        true => RayDifferential::default(),
                        false => camera_ray(scene, i * n + k % n, j * n + k / n).1,
                    };
                    let si = scene.local_surface(&ray, &hit, &differential);
                    let bsdf = scene.materials[si.material.index()].bsdf(&si, &scene.textures);
                    in_trees.push(RayPoint { point: ShadingPoint::of(&si, &bsdf, scene.ambient), at });
                }
            }
        }
        let number = self.pixels.len() as u32;
        self.pixels.push(pixel);
        let grouped = self.mode == AaMode::Adaptive;
        let share = |count: usize| if grouped { count as f32 / (n * n) as f32 } else { 1.0 };
        for (k, (shape, ray)) in on_shapes.iter().enumerate() {
            if !grouped {
                self.fragments.add(scene, number, [i, j], *shape, std::iter::once(*ray), 1.0);
            } else if on_shapes[..k].iter().all(|(before, _)| before != shape) {
                let same = on_shapes[k..].iter().filter(|(other, _)| other == shape).map(|(_, ray)| *ray);
                self.fragments.add(scene, number, [i, j], *shape, same.clone(), share(same.count()));
            }
        }
        self.fragments.add_from_trees(scene, number, [i, j], &mut in_trees, grouped, share);
    }

    /// Adds the blocks of a square that provably sees one shape: one of each lobe.
    fn add_blocks(&mut self, square: Square, shape: VisibleShape) {
        let scene = self.scene;
        if let Some(bsdf) = self.fragments.plain_bsdf(scene, shape).or_else(|| shape.constant_bsdf(scene, square)) {
            self.mark(square, PixelState::Block(self.blocks.len() as u32));
            self.blocks.push(SurfaceBlock { square, shape, bsdf, layer: 0, means: None });
            return;
        }
        if square.side > TEXTURED {
            for quarter in square.quarters_on([scene.width, scene.height]) {
                self.add_blocks(quarter, shape);
            }
            return;
        }
        self.mark(square, PixelState::Only(shape));
        let mut means = Vec::new();
        // The part of the square beyond the edges of the film included
        each_mean(scene, shape, square, &mut |at, mean| means.push((at, mean)));
        let start = self.blocks.len();
        for (at, mean) in means {
            let MeanBsdf { bsdf, .. } = mean;
            let is_alike = |block: &SurfaceBlock| {
                block.bsdf.lobe == bsdf.lobe || [block.bsdf.lobe, bsdf.lobe].contains(&Lobe::None)
            };
            let layer = self.blocks[start..].iter().position(is_alike).unwrap_or_else(|| {
                let first = self.means.len();
                self.means.resize(first + (square.side * square.side) as usize, None);
                self.blocks.push(SurfaceBlock {
                    square,
                    shape,
                    bsdf,
                    layer: self.blocks.len() - start,
                    means: Some(first),
                });
                self.blocks.len() - start - 1
            });
            if layer == LOBES {
                self.blocks.truncate(start);
                return self.mark(square, PixelState::Only(shape));
            }
            let SurfaceBlock { bsdf: all, means, .. } = &mut self.blocks[start + layer];
            all.lobe = if all.lobe == Lobe::None { bsdf.lobe } else { all.lobe };
            all.colors = all.colors.max(bsdf.colors);
            all.ambient = all.ambient.min(bsdf.ambient);
            let number = means.unwrap_or_default() + square.number(at);
            self.means[number] = Some(mean);
            let index = self.index(at);
            self.states[index] = PixelState::Block((start + layer) as u32);
        }
    }

    /// Sets the state of the pixels of a square.
    fn mark(&mut self, square: Square, state: PixelState) {
        for at in square.pixels() {
            let index = self.index(at);
            self.states[index] = state;
        }
    }
}

/// Calls `put` with the mean material of each pixel of a square that sees only one shape, except where lobes differ
/// within the pixel.
fn each_mean(scene: &Scene, shape: VisibleShape, square: Square, put: &mut impl FnMut([u32; 2], MeanBsdf)) {
    if square.side == 1 {
        let at = [square.x, square.y];
        shape.mean_bsdf(scene, at).into_iter().for_each(|mean| put(at, mean));
    } else if let Some(bsdf) = shape.constant_bsdf(scene, square) {
        square.pixels().for_each(|at| put(at, MeanBsdf::constant(bsdf)));
    } else {
        for quarter in square.quarters() {
            each_mean(scene, shape, quarter, put);
        }
    }
}
