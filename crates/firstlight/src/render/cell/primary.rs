//! The surfaces that the pixels of a cell see. Squares that provably see one surface are found without a ray for each
//! pixel; the rays of all other pixels are traced, those that may hit something in the trees in packets.

use std::iter;

use arrayvec::ArrayVec;

use super::{CellRenderer, Pixel, PixelState};
use crate::film::hits::camera_ray;
use crate::film::resolve::PixelTerms;
use crate::film::tile::Tile;
use crate::ids::MaterialId;
use crate::integrate::TOLERANCE;
use crate::material::{LightTerm, ShadingPoint};
use crate::math::{Ray, Vec2, Vec3};
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

/// The hit of a camera ray, before anything is looked up there.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraSample {
    /// The number of the ray in its pixel.
    k: u32,
    seen: (Option<VisibleShape>, Hit),
    material: Option<MaterialId>,
    p: Vec3,
    /// The facet's normal and the shading normal.
    normals: [Vec3; 2],
}

impl CameraSample {
    fn new(scene: &Scene, k: u32, ray: &Ray, seen: (Option<VisibleShape>, Hit)) -> Self {
        let (geometry, hit) = (&scene.geometry, &seen.1);
        let material = geometry.surfaces[hit.surface.index()].material;
        let material = material.is_none().then(|| geometry.face_material(hit));
        // Shapes that are no meshes are one part each
        let normals = if seen.0.is_some() { [Vec3::ZERO; 2] } else { geometry.normals(ray, hit) };
        CameraSample { k, seen, material, p: ray.o + ray.d * hit.t as f32, normals }
    }

    /// Whether one point may stand for both: they are on one surface of one material, without a crease or a gap.
    fn is_near(&self, other: &CameraSample) -> bool {
        let ((shape, hit), (other_shape, other_hit)) = (&self.seen, &other.seen);
        if hit.surface != other_hit.surface || shape != other_shape || self.material != other.material {
            return false;
        }
        let apart = other.p - self.p;
        let off = apart.dot(self.normals[0]).abs().max(apart.dot(other.normals[0]).abs());
        // Shading normals within 14 degrees
        let turn = self.normals[1] - other.normals[1];
        shape.is_some() || turn.length_squared() < 0.0625 && off <= 0.5 * apart.length()
    }

    /// Takes a part of a surface out of the samples of a pixel of `n` x `n` rays: the sample nearest to the middle of
    /// the part, and the number of all that it stands for. `None` if none are left.
    fn take_part(samples: &mut Vec<CameraSample>, n: u32) -> Option<(CameraSample, u32)> {
        let first = *samples.first()?;
        let place = |sample: &CameraSample| Vec2::new((sample.k % n) as f32, (sample.k / n) as f32);
        let (mut part, mut sum) = (ArrayVec::<CameraSample, MOST_SAMPLES>::new(), Vec2::ZERO);
        samples.retain(|sample| {
            let is_near = !part.is_full() && first.is_near(sample);
            if is_near {
                part.push(*sample);
                sum += place(sample);
            }
            !is_near
        });
        let middle = sum / part.len() as f32;
        let off = |sample: &CameraSample| (place(sample) - middle).length_squared();
        let nearest = part.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
        Some((*nearest, part.len() as u32))
    }
}

/// The most rays that one stands for.
const MOST_SAMPLES: usize = 64;

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
        if self.mode != AaMode::Full
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
        let mut samples = std::mem::take(&mut self.samples);
        samples.clear();
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
            let mut is_past_layers = false;
            if with_layers {
                let stack = &mut self.stack;
                scene.find_layers(ray, &differential(), end.as_ref().map(|(_, hit)| hit), stack);
                left = stack.left;
                is_past_layers = !stack.layers.is_empty();
                for Layer { surface, weight, .. } in &stack.layers {
                    pixel.terms.emission.add(scene.emission(surface), f64::from(*weight));
                    let point = ShadingPoint::of(surface, &scene.bsdf(surface).weighted(*weight), &scene.ambient);
                    let all = iter::once(point).chain(scene.further_points(surface, *weight));
                    points.extend(all.map(|point| RayPoint { shape: None, point, at, count: 1, is_layered: true }));
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
            if self.mode == AaMode::Multisample && !is_past_layers {
                samples.push(CameraSample::new(scene, k, ray, (shape, hit)));
                continue;
            }
            let of = (ray, differential(), at, 1, left);
            self.add_point(&mut pixel, (shape, hit), of, &mut points);
        }
        // One of each smooth part of a surface is looked up, over the footprint of the pixel
        while let Some((chosen, count)) = CameraSample::take_part(&mut samples, n) {
            let CameraSample { k, seen, .. } = chosen;
            let [x, y] = [k % n, k / n];
            let place = |corner: u32, at: u32| corner as f32 + (at as f32 + 0.5) / n as f32;
            let differential = match scene.needs_differentials() {
                false => RayDifferential::default(),
                true => scene.camera.local_ray(place(i, x), place(j, y), 1.0).1,
            };
            let of = (&rays[k as usize], differential, [x, y].map(|at| at as u16), count, 1.0);
            self.add_point(&mut pixel, seen, of, &mut points);
        }
        self.samples = samples;
        if scene.leaves_out_black {
            points.retain(|ray| !ray.point.bsdf.is_black());
        }
        let number = self.pixels.len() as u32;
        self.pixels.push(pixel);
        self.fragments.add(scene, number, [i, j], &mut points, self.mode);
        (self.rays, self.ray_points) = (rays, points);
    }

    /// Adds the shading points of a hit: of a ray, its differential, its place in the pixel, the rays that it stands
    /// for, and the part of each that is left.
    #[allow(clippy::type_complexity, reason = "a ray and what is known of it")]
    fn add_point(
        &self,
        pixel: &mut Pixel,
        (shape, hit): (Option<VisibleShape>, Hit),
        (ray, differential, at, count, left): (&Ray, RayDifferential, [u16; 2], u32, f32),
        points: &mut Vec<RayPoint>,
    ) {
        let scene = self.scene;
        let seen = f64::from(left) * f64::from(count);
        let mut further = ArrayVec::new();
        // A shape has one normal at each point, without maps
        let shape = shape.filter(|_| !scene.geometry.is_mapped(&hit));
        let point = match shape {
            Some(shape) => {
                let bsdf = self.fragments.plain_bsdf(scene, shape).unwrap_or_else(|| {
                    let si = shape.interaction(scene, ray, hit.t, &differential);
                    pixel.terms.emission.add(scene.emission(&si), seen);
                    further = scene.further_points(&si, left);
                    scene.bsdf(&si)
                });
                let bsdf = bsdf.weighted(left);
                shape.point(scene, ray, hit.t, &bsdf)
            }
            None => {
                let si = scene.local_surface(ray, &hit, &differential);
                pixel.terms.emission.add(scene.emission(&si), seen);
                further = scene.further_points(&si, left);
                ShadingPoint::of(&si, &scene.bsdf(&si).weighted(left), &scene.ambient)
            }
        };
        let is_layered = left != 1.0 || !further.is_empty();
        points.push(RayPoint { shape, point, at, count, is_layered });
        points.extend(further.into_iter().map(|point| RayPoint { shape, point, at, count, is_layered }));
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
