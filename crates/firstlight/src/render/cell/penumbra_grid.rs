//! Interpolation of light behind trees over squares of pixels, where penumbrae are wider than pixels.
//!
//! A square of pixels that one smooth surface fills is lit in nine pixels, the nodes of [`SquareNodes`], at all camera
//! rays of each. The other pixels are interpolated if the nodes pass the bilinear test, and if the visible fractions by
//! pilot rays from every pixel agree with the nodes.

use std::ops::ControlFlow;

use arrayvec::ArrayVec;

use super::mesh_shadows::{FragmentLight, NONE};
use super::{CELL, CellRenderer};
use crate::color::Rgb;
use crate::film::tile::Tile;
use crate::ids::LightId;
use crate::integrate::{Emitter, TOLERANCE};
use crate::material::{Colors, Moments, ShadingPoint};
use crate::math::{LANES, Vec3};
use crate::render::Counts;
use crate::render::fragment::Fragment;
use crate::render::interpolation::{SquareNodes, refine};
use crate::render::pooled::Packet;
use crate::render::square::Square;
use crate::visibility::{Viewpoint, Visibility};

/// Pixels across the smallest square that is interpolated.
const SMALLEST: u32 = 4;
/// Cells of the light that pilot rays of a pixel are aimed at, one at each, for a tolerance of 1 and less; for larger
/// ones fewer of them, down to the fewest. They detect shadows between the nodes.
const PILOT_CELLS: usize = 16;
const FEWEST_PILOT_RAYS: usize = 4;
/// Pixels across a block whose pilot rays are traced together.
const BLOCK: u32 = 4;

/// The sums of the differences between pilot rays and interpolated visible fractions, and of their variances: of each
/// row, of each column, and of all of a square.
struct PilotTest {
    square: Square,
    /// Pilot rays of a pixel.
    rays: usize,
    sums: Vec<[f32; 2]>,
    is_passed: bool,
}

impl PilotTest {
    fn new(square: Square, rays: usize) -> PilotTest {
        PilotTest { square, rays, sums: vec![[0.0; 2]; 2 * square.side as usize + 1], is_passed: true }
    }

    /// Adds a pixel, with its visible fractions by interpolation and by its pilot rays, not a number without those.
    fn add(&mut self, [i, j]: [u32; 2], interpolated: f32, pilot: f32) {
        if pilot.is_nan() {
            return;
        }
        // Of independent rays; so few do not prove a fraction of 0 or 1
        let part = 1.0 / self.rays as f32;
        let fraction = interpolated.clamp(part, 1.0 - part);
        let (off, variance) = (pilot - interpolated, fraction * (1.0 - fraction) * part);
        self.is_passed &= Self::is_by_chance([off, variance]);
        let side = self.square.side;
        for sum in [i - self.square.x, side + j - self.square.y, 2 * side] {
            let [sum_off, sum_variance] = &mut self.sums[sum as usize];
            (*sum_off, *sum_variance) = (*sum_off + off, *sum_variance + variance);
        }
    }

    /// Whether chance explains a difference: larger ones occur once in a thousand times.
    fn is_by_chance([off, variance]: [f32; 2]) -> bool {
        off * off <= 10.0 * variance
    }

    fn passes(&self) -> bool {
        self.is_passed && self.sums.iter().copied().all(Self::is_by_chance)
    }
}

impl CellRenderer<'_> {
    /// Interpolates lights behind trees over the squares of the cell.
    pub(super) fn penumbra_grid(
        &mut self,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let scene = self.scene;
        let [x, y] = self.corner;
        let lights = (0..scene.lights.len()).filter(|light| self.lights.is_sampled_past_trees(*light));
        let squares = lights.map(|light| (Square { x, y, side: CELL }, light)).collect();
        refine(squares, SMALLEST, [scene.width, scene.height], |mut squares: Vec<(Square, usize)>| {
            squares.sort_by_key(|(square, light)| (square.y, square.x, *light));
            let mut failed = Vec::new();
            for group in squares.chunk_by(|(one, _), (other, _)| one == other) {
                self.interpolate_square(group, &mut failed, counts);
                go_on()?;
            }
            ControlFlow::Continue(failed)
        })
    }

    /// Interpolates lights over a square. Those that fail a test are added to `failed`.
    fn interpolate_square(
        &mut self,
        square_lights: &[(Square, usize)],
        failed: &mut Vec<(Square, usize)>,
        counts: &mut Counts,
    ) {
        let square = square_lights[0].0;
        let is_open = |(_, light): &&(Square, usize)| square.pixels().any(|at| self.is_unknown(at, *light));
        let mut open: Vec<(Square, usize)> = square_lights.iter().filter(is_open).copied().collect();
        if !open.is_empty() && self.is_smooth(square) {
            open.retain(|(_, light)| !self.is_clear(square, *light, counts));
            open.iter().for_each(|(_, light)| self.trace_pilot_rays(square, *light, counts));
            open.retain(|(_, light)| {
                self.is_cut_by_light(square, *light)
                    || self.is_on_border(square, *light)
                    || !self.interpolate_light(square, *light, counts)
            });
        }
        failed.extend(open);
    }

    /// The fragment that fills a pixel of the cell and has all of its rays.
    fn whole(&self, at: [u32; 2]) -> Option<(usize, &Fragment)> {
        let [x, y] = self.corner;
        if !(Tile { x, y, width: CELL, height: CELL }).contains(at) {
            return None;
        }
        match self.shadows.only[self.index(at)] {
            NONE => None,
            number => Some((number as usize, &self.fragments.all[number as usize])),
        }
    }

    /// Whether nothing is known of a light at the fragment that fills a pixel.
    fn is_unknown(&self, at: [u32; 2], light: usize) -> bool {
        self.whole(at).is_some_and(|(number, _)| {
            matches!(self.fragment_light(number, light), FragmentLight::Seen(Visibility::Partial))
        })
    }

    /// The shading points of the camera rays of a pixel that one fragment fills; none of other pixels.
    fn rays_of(&self, at: [u32; 2]) -> &[ShadingPoint] {
        self.whole(at).map_or(&[], |(_, fragment)| &self.fragments.rays[fragment.rays.clone()])
    }

    /// Whether one smooth surface fills all pixels of a square and its nodes beside it: whether normals are
    /// biquadratic.
    fn is_smooth(&self, square: Square) -> bool {
        let [right, bottom] = [square.x + square.side, square.y + square.side];
        if right > self.scene.width || bottom > self.scene.height {
            return false;
        }
        let of = self.nodes_of(square);
        let positions = of.positions();
        let [center, ..] = self.rays_of(positions[4]) else { return false };
        // The normal in the middle between two opposite rays
        let normal = |at: [u32; 2]| match (self.rays_of(at).first(), self.rays_of(at).last()) {
            (Some(one), Some(other)) if one.surface == center.surface && one.bsdf.lobe == center.bsdf.lobe => {
                ((one.ns + other.ns) * 0.5).normalize_or_zero()
            }
            _ => Vec3::NAN,
        };
        let nodes = positions.map(normal);
        let mut is_smooth = !nodes.iter().any(|normal| normal.is_nan());
        of.interpolate(&nodes, |at, interpolated| {
            is_smooth = is_smooth && (interpolated - normal(at)).length() <= TOLERANCE.even;
        });
        is_smooth
    }

    fn nodes_of(&self, square: Square) -> SquareNodes {
        let size = [self.scene.width, self.scene.height];
        SquareNodes::in_pixels(square, std::array::from_fn(|axis| (self.corner[axis] + CELL).min(size[axis])))
    }

    /// Whether nothing in the trees may occlude a light for a square, or no light can arrive; the former is stored for
    /// all fragments of the square.
    fn is_clear(&mut self, square: Square, light: usize, counts: &mut Counts) -> bool {
        let scene = self.scene;
        let Some((_, fragment)) = self.whole([square.x, square.y]) else { return true };
        let lights = scene.geometry.lights_of(fragment.surface);
        let receives_shadow = scene.geometry.surfaces[fragment.surface.index()].receives_shadow;
        if !scene.geometry.links.contains(lights, LightId(light as u32)) || !receives_shadow {
            return true;
        }
        let points: Vec<Viewpoint> = square.pixels().flat_map(|at| self.rays_of(at)).map(Viewpoint::of).collect();
        let visibility = self.lights.gather_for(light, &points, counts);
        if visibility == Visibility::Partial {
            return false;
        }
        self.note_all(square, light, visibility);
        true
    }

    /// Whether the plane or the surface of a light passes through a square and its nodes: they could pass the bilinear
    /// test by chance.
    fn is_cut_by_light(&self, square: Square, light: usize) -> bool {
        let pixels = self.nodes_of(square).positions().into_iter().chain(square.pixels());
        let points = pixels.flat_map(|at| self.rays_of(at)).map(|point| point.p);
        self.lights.lights.emitters[light].is_some_and(|emitter| emitter.parts(points))
    }

    /// Stores the visibility of a light from the pixels of a square.
    fn note_all(&mut self, square: Square, light: usize, visibility: Visibility) {
        for at in square.pixels() {
            if let Some((number, _)) = self.whole(at) {
                self.note(number, light, FragmentLight::Seen(visibility));
            }
        }
    }

    /// Finds the visible fraction of a light for each pixel of a square, and for those around it in the cell.
    fn trace_pilot_rays(&mut self, square: Square, light: usize, counts: &mut Counts) {
        let blocks = |axis: usize| {
            let (from, start) = ([square.x, square.y][axis], self.corner[axis]);
            let first = from.saturating_sub(1).max(start) / BLOCK;
            first..((from + square.side).min(start + CELL - 1) / BLOCK + 1)
        };
        for (j, i) in blocks(1).flat_map(|j| blocks(0).map(move |i| (j, i))).collect::<ArrayVec<_, 64>>() {
            let at = [i * BLOCK, j * BLOCK];
            if self.shadows.pilot[self.index(at) * self.scene.lights.len() + light].is_none() {
                self.trace_pilot_block(at, light, counts);
            }
        }
    }

    /// Pilot rays of a pixel: the larger the tolerance, the fewer.
    fn pilot_rays(&self) -> usize {
        let of_tolerance = PILOT_CELLS as f64 / self.scene.tolerance().max(1.0);
        (of_tolerance as usize).next_power_of_two().clamp(FEWEST_PILOT_RAYS, PILOT_CELLS)
    }

    /// Traces the pilot rays of a block of pixels: one ray of every pixel to its point of a cell of the light after the
    /// other.
    fn trace_pilot_block(&mut self, [x, y]: [u32; 2], light: usize, counts: &mut Counts) {
        let scene = self.scene;
        let sampler = self.lights.sampler(light);
        let at = |inner: usize| [x + inner as u32 % BLOCK, y + inner as u32 / BLOCK];
        let mut packet: Option<Packet> = None;
        let (mut all, mut hidden) = ([0u32; LANES], [0.0f32; LANES]);
        // Of the rays of a packet, by pixel: what layers stop of the light
        let mut dimmed = [0.0f32; LANES];
        let rays_of_pixel = self.pilot_rays();
        let step = PILOT_CELLS / rays_of_pixel;
        // Blocks beside each other look at other cells
        let first = (x / BLOCK + 2 * (y / BLOCK)) as usize % step;
        for cell in (0..rays_of_pixel).map(|ray| first + ray * step) {
            for inner in 0..LANES {
                let rays = self.rays_of(at(inner));
                if rays.is_empty() {
                    continue;
                }
                // Each camera ray once, if there are as many
                let turn = (at(inner)[0] * 7 + at(inner)[1] * 3) as usize % PILOT_CELLS;
                let point = Viewpoint::of(&rays[(cell ^ turn) % rays.len()]);
                let l = sampler.point(inner, PILOT_CELLS, cell) - point.p;
                if point.horizon.dot(l) > 0.0 && point.ns.dot(l) > 0.0 {
                    all[inner] += 1;
                    if scene.occluded_by_lists(&point.ray(sampler.end(), l, true)) {
                        hidden[inner] += 1.0;
                    } else {
                        let packet = packet.get_or_insert_with(|| Packet::new(sampler.end(), &point));
                        packet.add((inner * PILOT_CELLS + cell) as u32, &point, l, inner as u32);
                    }
                }
            }
            if let Some(packet) = &mut packet {
                if scene.has_layers() {
                    dimmed.fill(0.0);
                    packet.dim(scene, |_, inner, left| dimmed[inner as usize] = 1.0 - left);
                }
                // One of each pixel
                let traced = packet.trace(scene, |_, inner| dimmed[inner as usize] = 1.0);
                hidden.iter_mut().zip(&mut dimmed).for_each(|(sum, dimmed)| *sum += std::mem::take(dimmed));
                counts.visibility.traced += traced;
                counts.shadow_rays += traced;
            }
        }
        for inner in 0..LANES {
            let pixel = self.index(at(inner)) * scene.lights.len() + light;
            self.shadows.pilot[pixel] = Some((all[inner] as f32 - hidden[inner]) / all[inner] as f32);
        }
    }

    /// The visible fraction of a light by the pilot rays of a pixel; not a number without those.
    pub(super) fn pilot(&self, pixel: usize, light: usize) -> f32 {
        self.shadows.pilot[pixel * self.scene.lights.len() + light].unwrap_or(f32::NAN)
    }

    /// Whether the border of a penumbra runs through a square: whether some of its pixels, each with those around it,
    /// are fully lit, fully in shadow or in the penumbra, and others not.
    fn is_on_border(&self, square: Square, light: usize) -> bool {
        let mut kinds = [false; 3];
        for [i, j] in square.pixels() {
            let around = (0..9).map(|k| [(i + k % 3).wrapping_sub(1), (j + k / 3).wrapping_sub(1)]);
            let fractions = around.filter(|at| self.whole(*at).is_some()).map(|at| self.pilot(self.index(at), light));
            let (mut lit, mut dark) = (true, true);
            for fraction in fractions.filter(|fraction| !fraction.is_nan()) {
                (lit, dark) = (lit && fraction == 1.0, dark && fraction == 0.0);
            }
            kinds[if lit { 0 } else { 1 + usize::from(dark) }] = true;
        }
        kinds.into_iter().filter(|kind| *kind).count() > 1
    }

    /// Interpolates a light over a square if its nodes pass the tests; `false` if they do not.
    fn interpolate_light(&mut self, square: Square, light: usize, counts: &mut Counts) -> bool {
        let Square { x, y, side } = square;
        let of = self.nodes_of(square);
        let positions = of.positions();
        let nodes = positions.map(|at| self.pixel_node(at, light, counts));
        let (moments, fractions) = (nodes.map(|node| node.0), nodes.map(|node| node.1));
        // Where nothing occludes the light, each pixel has its closed form
        if fractions == [1.0; 9] && square.pixels().all(|at| self.pilot(self.index(at), light) == 1.0) {
            self.note_all(square, light, Visibility::Listed);
            return true;
        }
        // Sampled nodes have errors of their own: a half of the tolerance is left for those of the interpolation
        let (lights, wide) = (self.scene.lights.len(), (2 * side / SMALLEST) as f32);
        let steps = |k: usize, error: &Moments| self.steps_of(positions[k], light, &moments[k], error, counts) * wide;
        if fractions.iter().any(|fraction| fraction.is_nan()) || !of.pass_bilinear_test(&moments, lights, false, steps)
        {
            return false;
        }
        // Rays to a one-sided ball also see points that emit nothing towards them
        let emitter = &self.lights.lights.emitters[light];
        if !matches!(emitter, Some(Emitter::Ball { both_sides: false, .. })) {
            let mut test = PilotTest::new(square, self.pilot_rays());
            of.interpolate(&fractions, |at, fraction| test.add(at, fraction, self.pilot(self.index(at), light)));
            if !test.passes() {
                return false;
            }
        }
        let mut pixels = Vec::with_capacity((side * side) as usize);
        of.interpolate(&moments, |_, moments| pixels.push(moments.at_least_0()));
        for (number, [i, j]) in square.pixels().enumerate() {
            let Some((fragment, Fragment { mean, count, .. })) = self.whole([i, j]) else { continue };
            if matches!(self.fragment_light(fragment, light), FragmentLight::Summed(_) | FragmentLight::Done) {
                continue;
            }
            let moments = pixels[number];
            // The mean of a product is not the product of means where colours and light vary together
            if mean.contrast != Colors::BLACK {
                let beside = |step: usize, at: u32| pixels[if at + 1 < side { number + step } else { number - step }];
                let slope = beside(1, i - x).apart(moments) + beside(side as usize, j - y).apart(moments);
                let scale = self.lights.scale(light);
                let value = scale * mean.bsdf.colors.of(&moments);
                if self.lights.steps(value, scale * (mean.contrast.of(&slope) * 0.125))
                    > TOLERANCE.color_light_covariance
                {
                    continue;
                }
            }
            let terms = mean.bsdf.colors.reflected(&(moments * *count as f32));
            self.note(fragment, light, FragmentLight::Summed(terms));
        }
        true
    }

    /// The value of a node: the mean of a light over the camera rays of its pixel, and its visible fraction.
    fn pixel_node(&mut self, at: [u32; 2], light: usize, counts: &mut Counts) -> (Moments, f32) {
        let index = self.index(at);
        if let Some((.., node)) = self.shadows.nodes.iter().find(|(of, by, _)| (*of, *by) == (index, light)) {
            return *node;
        }
        let Some((fragment, Fragment { count, .. })) = self.whole(at) else {
            unreachable!("smooth squares are filled")
        };
        let part = 1.0 / *count as f32;
        let pooled = self.pool_alone(fragment, light, counts);
        self.note(fragment, light, FragmentLight::Summed(pooled.terms));
        let node = (pooled.moments * part, pooled.visible_fraction);
        self.shadows.nodes.push((index, light, node));
        node
    }

    /// The display steps that an error of a light makes at a pixel that receives `moments` of it.
    fn steps_of(&mut self, at: [u32; 2], light: usize, moments: &Moments, error: &Moments, counts: &mut Counts) -> f32 {
        let Some((fragment, bsdf)) = self.whole(at).map(|(number, of)| (number, of.mean.bsdf)) else {
            return f32::INFINITY;
        };
        let scale = self.lights.scale(light);
        let others = self.others(fragment, light, counts);
        let value: Rgb = bsdf.base(&self.scene.ambient) + others + scale * bsdf.colors.of(moments);
        self.lights.steps(value, scale * bsdf.colors.of(error))
    }
}
