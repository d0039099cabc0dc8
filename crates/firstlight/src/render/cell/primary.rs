//! The surfaces that the pixels of a cell see. Squares that provably see one surface are found without a ray for each
//! pixel; the rays of all other pixels are traced, those that may hit something in the trees in packets.

use std::iter;

use arrayvec::ArrayVec;

use super::{CellRenderer, Pixel, PixelState};
use crate::film::hits::camera_ray;
use crate::film::resolve::PixelTerms;
use crate::film::tile::Tile;
use crate::integrate::TOLERANCE;
use crate::material::{LightTerm, ShadingPoint};
use crate::math::Ray;
use crate::render::fragment::RayPoint;
use crate::render::lighting_grid::SurfaceBlock;
use crate::render::square::Square;
use crate::render::tile_frustum::TileFrustum;
use crate::render::visible_shape::{MeanBsdf, VisibleShape};
use crate::render::{AaMode, Counts};
use crate::scene::{Hit, Layer, Scene};
use crate::shape::RayDifferential;

/// Pixels across the smallest squares that may provably see one surface.
const SMALLEST: u32 = 2;
/// Pixels across the largest square whose textured materials are looked up pixel by pixel.
const TEXTURED: u32 = 8;
/// The most lobes of such a square: each has nodes of its own.
const LOBES: usize = 4;

/// What a camera ray hits, and the shape if that is one by itself.
type Seen = Option<(Option<VisibleShape>, Hit)>;

impl CellRenderer<'_> {
    /// Finds the surfaces that the pixels of a square see. `candidates` are all shapes that a square around it may see.
    pub(super) fn primary(&mut self, square: Square, candidates: &[VisibleShape], counts: &mut Counts) {
        if self.chosen.as_ref().is_some_and(|chosen| !chosen.has_any(square.pixels())) {
            return;
        }
        let scene = self.scene;
        let frustum = TileFrustum::new(scene, square);
        let near = frustum.candidates(scene, candidates);
        if near.is_empty() {
            let terms = PixelTerms { background: self.rays_per_pixel().into(), ..PixelTerms::default() };
            for at in self.on_film(square) {
                let index = self.index(at);
                terms.resolve(scene, iter::empty(), index, &mut self.sums);
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
        let with_layers = near.contains(&VisibleShape::Layers);
        let in_packets = with_layers || near.contains(&VisibleShape::Trees);
        if square.side > if in_packets { SMALLEST.max(self.hits.side()) } else { SMALLEST } {
            for quarter in square.quarters_on([scene.width, scene.height]) {
                self.primary(quarter, &near, counts);
            }
        } else if in_packets {
            self.trace_packets(square, with_layers, counts);
        } else {
            for at in self.on_film(square) {
                self.trace(at, &near, counts);
            }
        }
    }

    /// Traces the rays of a square that may hit anything, or anything but layers.
    fn trace_packets(&mut self, Square { x, y, side }: Square, with_layers: bool, counts: &mut Counts) {
        let scene = self.scene;
        let step = self.hits.side().min(side);
        let (width, height) = (side.min(scene.width - x), side.min(scene.height - y));
        for block in (Tile { x, y, width, height }).parts(step, 1) {
            self.hits.trace(scene, block);
            for at in block.pixels() {
                if self.chosen.as_ref().is_some_and(|chosen| !chosen.has(at)) {
                    continue;
                }
                let seen = |cells: &Self, [x, y]: [u16; 2], _: &Ray| {
                    let hit = cells.hits.get(at, x.into(), y.into())?;
                    Some((VisibleShape::of(scene, &hit), hit))
                };
                self.add_pixel(at, seen, with_layers, counts);
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
            hits.reduce(nearer).map(|(shape, t)| (Some(shape), shape.hit_at(scene, ray, t)))
        };
        self.add_pixel(at, seen, false, counts);
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
    /// the rays hit them; without adaptive antialiasing one of each ray. Layers come before what is seen past them.
    fn add_pixel(
        &mut self,
        [i, j]: [u32; 2],
        seen: impl Fn(&Self, [u16; 2], &Ray) -> Seen,
        with_layers: bool,
        counts: &mut Counts,
    ) {
        let (scene, n) = (self.scene, self.scene.antialiasing);
        let mut pixel = self.pixel([i, j], n * n, counts);
        let (mut rays, mut points) = (std::mem::take(&mut self.rays), std::mem::take(&mut self.ray_points));
        rays.clear();
        rays.extend_from_slice(self.pixel_rays.of(scene, [i, j]));
        for (k, ray) in (0..).zip(&rays) {
            let at = [k % n, k / n].map(|at| at as u16);
            let differential = || match scene.needs_differentials() {
                false => RayDifferential::default(),
                true => camera_ray(scene, i * n + k % n, j * n + k / n).1,
            };
            let end = seen(self, at, ray);
            let mut left = 1.0;
            if with_layers {
                let stack = &mut self.stack;
                scene.find_layers(ray, &differential(), end.as_ref().map(|(_, hit)| hit), stack);
                left = stack.left;
                for Layer { surface, weight, .. } in &stack.layers {
                    pixel.terms.emission.add(scene.emission(surface), f64::from(*weight));
                    let point = ShadingPoint::of(surface, &scene.bsdf(surface).weighted(*weight), &scene.ambient);
                    let all = iter::once(point).chain(scene.further_points(surface, *weight));
                    points.extend(all.map(|point| RayPoint { shape: None, point, at, is_layered: true }));
                }
                if left == 0.0 {
                    continue;
                }
            }
            let Some((shape, hit)) = end else {
                pixel.terms.background += f64::from(left);
                continue;
            };
            if let Some(light) = hit.surface.index().checked_sub(scene.geometry.surfaces.len()) {
                pixel.terms.emission.add(scene.lights[light].radiance, left.into());
                continue;
            }
            let mut further = ArrayVec::new();
            // A shape has one normal at each point, without maps
            let shape = shape.filter(|_| !scene.geometry.is_mapped(&hit));
            let point = match shape {
                Some(shape) => {
                    let bsdf = self.fragments.plain_bsdf(scene, shape).unwrap_or_else(|| {
                        let si = shape.interaction(scene, ray, hit.t, &differential());
                        pixel.terms.emission.add(scene.emission(&si), left.into());
                        further = scene.further_points(&si, left);
                        scene.bsdf(&si)
                    });
                    let bsdf = bsdf.weighted(left);
                    shape.point(scene, ray, hit.t, &bsdf)
                }
                None => {
                    let si = scene.local_surface(ray, &hit, &differential());
                    pixel.terms.emission.add(scene.emission(&si), left.into());
                    further = scene.further_points(&si, left);
                    ShadingPoint::of(&si, &scene.bsdf(&si).weighted(left), &scene.ambient)
                }
            };
            let is_layered = left != 1.0 || !further.is_empty();
            points.push(RayPoint { shape, point, at, is_layered });
            points.extend(further.into_iter().map(|point| RayPoint { shape, point, at, is_layered }));
        }
        if scene.leaves_out_black {
            points.retain(|ray| !ray.point.bsdf.is_black());
        }
        let number = self.pixels.len() as u32;
        self.pixels.push(pixel);
        self.fragments.add(scene, number, [i, j], &mut points, self.mode == AaMode::Adaptive);
        (self.rays, self.ray_points) = (rays, points);
    }

    /// Adds the blocks of a square that provably sees one shape: one of each lobe.
    fn add_blocks(&mut self, square: Square, shape: VisibleShape) {
        let scene = self.scene;
        if let Some(bsdf) = self.fragments.plain_bsdf(scene, shape).or_else(|| shape.constant_bsdf(scene, square)) {
            if scene.leaves_out_black && bsdf.is_black() {
                for at in self.on_film(square) {
                    let index = self.index(at);
                    PixelTerms::default().resolve(scene, iter::empty(), index, &mut self.sums);
                }
                return;
            }
            self.mark(square, PixelState::Block(self.blocks.len() as u32));
            self.blocks.push(SurfaceBlock { square, shape, bsdf, layer: 0, means: None });
            return;
        }
        let material = scene.geometry.surfaces[shape.surface(scene).index()].material;
        if material.is_some_and(|material| scene.materials[material.index()].has_lobe_texture()) {
            // Each pixel has a lobe of its own
            return self.mark(square, PixelState::Only(shape));
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
            // A peak falls as the square of its width
            let is_alike = |block: &SurfaceBlock| block.bsdf.lobe.is_near(bsdf.lobe, 0.5 * TOLERANCE.same_mean);
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
            all.lobe = all.lobe.with(bsdf.lobe).unwrap_or(all.lobe);
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
