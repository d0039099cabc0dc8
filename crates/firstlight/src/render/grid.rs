//! Light over squares of pixels that see one surface, from few places.
//!
//! Where nothing that a light does is narrow beside the square, nine places tell it all: the corners, the middles of
//! the sides and the middle. The corners alone foretell what the other five hold, as if light changed evenly. Where
//! that shows no error, the quadratic through all nine is nearer still, and every pixel takes its light from it.
//! Elsewhere the square is quartered, down to two pixels. Squares of one size are asked together.
//!
//! Source: Ward, Heckbert, "Irradiance gradients", 1992, for taking light between few places; the nine places and what
//! they foretell are ours.

use std::ops::ControlFlow;

use super::Counts;
use super::cell::CELL;
use super::direct::{DirectLighting, LightEstimate, LightQuery};
use super::solo::Candidate;
use super::square::Square;
use crate::film::Heat;
use crate::integrate::TOLERANCE;
use crate::material::{Bsdf, Lobe, Moments, ShadingPoint};
use crate::scene::Scene;
use crate::visibility::Visibility;

/// Pixels across the largest and the smallest square that is lit from nine places.
const LARGEST: u32 = 16;
const SMALLEST: u32 = 2;
/// Places across a cell: at the corners of pixels.
const ACROSS: usize = CELL as usize + 1;
const PIXELS: usize = (CELL * CELL) as usize;

/// A square of pixels that see one surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    pub square: Square,
    pub of: Candidate,
    /// One for all its pixels: the brightest colours, the darkest ambient one.
    pub bsdf: Bsdf,
    /// Where the materials of its pixels begin, if they differ.
    pub first: Option<usize>,
}

impl Block {
    /// Of pixels that all have the same material.
    pub fn even(square: Square, of: Candidate, bsdf: Bsdf) -> Block {
        Block { square, of, bsdf, first: None }
    }

    /// Of pixels with these materials, the first of which has that number; `None` if one is not known, or if their
    /// highlights differ in more than colour.
    pub fn new(
        square: Square,
        of: Candidate,
        first: usize,
        mut bsdfs: impl Iterator<Item = Option<Bsdf>>,
    ) -> Option<Block> {
        let mut all = bsdfs.next()??;
        for bsdf in bsdfs {
            let bsdf = bsdf?;
            all.lobe = all.lobe.with(bsdf.lobe)?;
            all.colors = all.colors.max(bsdf.colors);
            all.ambient = all.ambient.min(bsdf.ambient);
        }
        Some(Block { square, of, bsdf: all, first: Some(first) })
    }
}

/// What is not known.
const UNKNOWN: Moments = Moments::UNKNOWN;
/// No node.
const NONE: u32 = u32::MAX;

/// A corner of pixels, where a ray meets a shape.
struct GridNode {
    of: Candidate,
    lobe: Lobe,
    /// The next at the same corner.
    next: u32,
    /// Its place, without reach; [`NONE`] where the ray misses the shape.
    place: u32,
}

/// One light over one square.
#[derive(Clone, Copy)]
struct GridItem {
    square: Square,
    block: u32,
    light: u32,
    /// The nodes, row by row.
    nodes: [u32; 9],
    center: u32,
}

/// Light over the squares of a cell.
pub(crate) struct Grid {
    corner: [u32; 2],
    lights: usize,
    /// Light by light, pixel by pixel: what arrives, no number where that is not known.
    arrived: Vec<Moments>,
    /// The first node at each corner of pixels.
    first: Vec<u32>,
    nodes: Vec<GridNode>,
    /// Node by node, light by light: what arrives.
    sums: Vec<Moments>,
    wanted: Vec<bool>,
    /// Which of them the requests are for.
    asked_of: Vec<usize>,
    places: Vec<ShadingPoint>,
    /// Pixel by pixel: see [`Heat`].
    work: Vec<f32>,
    asked: Vec<ShadingPoint>,
    requests: Vec<LightQuery>,
    answers: Vec<LightEstimate>,
}

impl Grid {
    pub fn new(lights: usize) -> Self {
        Grid {
            corner: [0; 2],
            lights,
            arrived: vec![UNKNOWN; lights * PIXELS],
            first: vec![NONE; ACROSS * ACROSS],
            nodes: Vec::new(),
            sums: Vec::new(),
            wanted: Vec::new(),
            asked_of: Vec::new(),
            places: Vec::new(),
            work: vec![0.0; PIXELS],
            asked: Vec::new(),
            requests: Vec::new(),
            answers: Vec::new(),
        }
    }

    /// Forgets all, for the cell at `corner`.
    pub fn begin(&mut self, corner: [u32; 2]) {
        self.corner = corner;
        self.arrived.fill(UNKNOWN);
        self.first.fill(NONE);
        self.nodes.clear();
        self.sums.clear();
        self.wanted.clear();
        self.places.clear();
        self.work.fill(0.0);
    }

    /// What each pixel of the cell took; see [`Heat`].
    pub fn work(&self) -> &[f32] {
        &self.work
    }

    /// Shares the work of so many places among the pixels of a square.
    fn spend(&mut self, square: Square, places: usize) {
        let each = Heat::PLACE * places as f32 / (square.side * square.side) as f32;
        for [i, j] in square.pixels() {
            self.work[((j - self.corner[1]) * CELL + i - self.corner[0]) as usize] += each;
        }
    }

    fn pixel(&self, light: usize, [i, j]: [u32; 2]) -> usize {
        light * PIXELS + ((j - self.corner[1]) * CELL + i - self.corner[0]) as usize
    }

    /// What arrives of a light at a pixel of the cell, if that is known.
    pub fn arrived(&self, light: usize, at: [u32; 2]) -> Option<Moments> {
        let sums = self.arrived[self.pixel(light, at)];
        sums.is_known().then_some(sums)
    }

    /// The same of pixels side by side, from `at` on.
    pub fn row(&self, light: usize, at: [u32; 2], length: usize) -> &[Moments] {
        let first = self.pixel(light, at);
        &self.arrived[first..first + length]
    }

    /// How far it changes from a pixel to its neighbours in a square, along both axes together; `None` where they do
    /// not know.
    pub fn slope(&self, light: usize, at: [u32; 2], square: Square) -> Option<Moments> {
        let here = self.arrived(light, at)?;
        let mut slope = Moments::default();
        for (axis, from) in [square.x, square.y].into_iter().enumerate() {
            let mut most: Option<Moments> = None;
            for to in [at[axis].wrapping_sub(1), at[axis] + 1] {
                if to.wrapping_sub(from) < square.side {
                    let mut beside = at;
                    beside[axis] = to;
                    let there = self.arrived(light, beside)?;
                    let before = most.unwrap_or_default();
                    most = Some(before.max(there.apart(here)));
                }
            }
            slope += most?;
        }
        Some(slope)
    }

    /// Finds the light over all blocks.
    pub fn light(
        &mut self,
        scene: &Scene,
        lights: &mut DirectLighting,
        blocks: &[Block],
        counts: &mut Counts,
        go_on: &dyn Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut items: Vec<GridItem> = Vec::new();
        let mut waiting: Vec<GridItem> = Vec::new();
        for (k, block) in blocks.iter().enumerate() {
            let mut squares = vec![block.square];
            while let Some(square) = squares.pop() {
                if square.side > LARGEST {
                    // The first of them is taken next
                    squares.extend(square.quarters_on([scene.width, scene.height]).rev());
                } else if square.side >= SMALLEST {
                    for light in 0..self.lights as u32 {
                        waiting.push(GridItem { square, block: k as u32, light, nodes: [NONE; 9], center: NONE });
                    }
                }
            }
        }
        let mut side = LARGEST;
        while side >= SMALLEST {
            items.extend(waiting.extract_if(.., |item| item.square.side == side));
            self.round(scene, lights, blocks, &mut items, counts, go_on)?;
            let refused = std::mem::take(&mut items);
            if side > SMALLEST {
                for item in refused {
                    for square in item.square.quarters_on([scene.width, scene.height]) {
                        items.push(GridItem { square, ..item });
                    }
                }
            }
            side /= 2;
        }
        ControlFlow::Continue(())
    }

    /// Lights squares of one size from nine places each, where those tell all; leaves the others in `items`.
    fn round(
        &mut self,
        scene: &Scene,
        lights: &mut DirectLighting,
        blocks: &[Block],
        items: &mut Vec<GridItem>,
        counts: &mut Counts,
        go_on: &dyn Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        // How each square sees its light from its middle
        self.asked.clear();
        self.requests.clear();
        let mut last: Option<(Square, u32, [u32; 9], Option<ShadingPoint>)> = None;
        let mut kept: Vec<GridItem> = Vec::new();
        let mut failed: Vec<GridItem> = Vec::new();
        for mut item in items.drain(..) {
            let block = &blocks[item.block as usize];
            if last.as_ref().is_none_or(|(square, of, ..)| (*square, *of) != (item.square, item.block)) {
                let nodes = self.nine(scene, block, item.square);
                let place = self.middle(scene, block, &nodes);
                last = Some((item.square, item.block, nodes, place));
            }
            let Some((_, _, nodes, Some(place))) = last else {
                failed.push(item);
                continue;
            };
            (item.nodes, item.center) = (nodes, self.requests.len() as u32);
            self.requests.push(LightQuery {
                point: self.asked.len() as u32,
                light: item.light,
                visibility: Visibility::Partial,
            });
            self.asked.push(place);
            self.spend(item.square, 1);
            kept.push(item);
        }
        lights.estimate(&self.asked, &self.requests, &mut self.answers, counts, go_on)?;
        let centers = std::mem::take(&mut self.answers);
        // Those that do not fail at once ask their nodes
        self.requests.clear();
        let mut open: Vec<GridItem> = Vec::new();
        for item in kept {
            let answer = &centers[item.center as usize];
            if answer.is_uniform && answer.moments == Moments::default() {
                self.fill(scene, &item, &[Moments::default(); 9]);
                continue;
            }
            // Outlines may move over all of the light, and a highlight by its width
            if !(answer.motion <= 1.0 && answer.turn <= 1.0) {
                failed.push(item);
                continue;
            }
            self.sums[item.nodes[4] as usize * self.lights + item.light as usize] = answer.moments;
            open.push(item);
        }
        for item in &open {
            let (before, visibility) = (self.requests.len(), centers[item.center as usize].visibility);
            for node in item.nodes {
                let known = node as usize * self.lights + item.light as usize;
                if !self.sums[known].is_known() && !self.wanted[known] {
                    self.wanted[known] = true;
                    let (point, light) = (self.nodes[node as usize].place, item.light);
                    self.requests.push(LightQuery { point, light, visibility });
                    self.asked_of.push(known);
                }
            }
            self.spend(item.square, self.requests.len() - before);
        }
        lights.estimate(&self.places, &self.requests, &mut self.answers, counts, go_on)?;
        for (known, answer) in self.asked_of.drain(..).zip(&self.answers) {
            self.sums[known] = answer.moments;
        }
        for item in open {
            let nodes = item.nodes.map(|node| self.sums[node as usize * self.lights + item.light as usize]);
            let block = &blocks[item.block as usize];
            let is_known = nodes.iter().all(Moments::is_known);
            if is_known && self.is_foretold(scene, lights, block, &item, &nodes, &centers[item.center as usize]) {
                self.fill(scene, &item, &nodes);
            } else {
                failed.push(item);
            }
        }
        self.answers = centers;
        failed.sort_by_key(|item| (item.block, item.square.y, item.square.x, item.light));
        *items = failed;
        ControlFlow::Continue(())
    }

    /// The nodes of a square; [`NONE`] where the ray misses the shape.
    fn nine(&mut self, scene: &Scene, block: &Block, Square { x, y, side }: Square) -> [u32; 9] {
        let half = side / 2;
        std::array::from_fn(|k| {
            let at = [x + k as u32 % 3 * half, y + k as u32 / 3 * half];
            self.node(scene, block, at)
        })
    }

    fn node(&mut self, scene: &Scene, block: &Block, at: [u32; 2]) -> u32 {
        let corner = (at[1] - self.corner[1]) as usize * ACROSS + (at[0] - self.corner[0]) as usize;
        let mut node = self.first[corner];
        while node != NONE {
            let known = &self.nodes[node as usize];
            if known.of == block.of && known.lobe == block.bsdf.lobe {
                return if known.place == NONE { NONE } else { node };
            }
            node = known.next;
        }
        let (ray, _) = scene.camera.local_ray(at[0] as f32, at[1] as f32, 1.0);
        let node = self.nodes.len() as u32;
        let place = match block.of.hit(scene, &ray) {
            Some(hit) => {
                self.places.push(block.of.point(scene, &ray, hit.t, &block.bsdf));
                self.places.len() as u32 - 1
            }
            None => NONE,
        };
        self.nodes.push(GridNode { of: block.of, lobe: block.bsdf.lobe, next: self.first[corner], place });
        self.first[corner] = node;
        self.sums.resize(self.nodes.len() * self.lights, UNKNOWN);
        self.wanted.resize(self.nodes.len() * self.lights, false);
        if place == NONE { NONE } else { node }
    }

    /// The middle of a square, which stands for all of it.
    fn middle(&self, scene: &Scene, block: &Block, nodes: &[u32; 9]) -> Option<ShadingPoint> {
        if nodes.contains(&NONE) {
            return None;
        }
        let point = |k: usize| &self.places[self.nodes[nodes[k] as usize].place as usize];
        let middle = point(4);
        let (mut reach, mut turn) = (0.0f32, 0.0f32);
        for k in [0, 2, 6, 8] {
            reach = reach.max((point(k).p - middle.p).length());
            turn = turn.max((point(k).ns - middle.ns).length());
        }
        // The arc, not the chord
        let (reach, turn) = (reach * 1.0625, turn * 1.0625);
        let (bsdf, base) = (block.bsdf, block.bsdf.base(scene.ambient));
        Some(ShadingPoint { reach, turn, bsdf, base, most_motion: 1.0, ..*middle })
    }

    /// Whether the corners foretell the other five.
    fn is_foretold(
        &self,
        scene: &Scene,
        lights: &DirectLighting,
        block: &Block,
        item: &GridItem,
        nodes: &[Moments; 9],
        center: &LightEstimate,
    ) -> bool {
        let scale = lights.scale(item.light as usize);
        let colors = scale * block.bsdf.colors;
        let base = block.bsdf.base(scene.ambient);
        let sets_in = nodes.iter().any(|node| *node == Moments::default());
        let is_behind = scene.geometry.has_trees() && center.visibility == Visibility::Partial;
        // Over a square that outlines move far over, the edge of a penumbra may run between the nine
        let is_crossed = item.square.side > SMALLEST && center.motion > TOLERANCE.motion;
        let bends = if sets_in || is_behind || is_crossed { TOLERANCE.bends_at_once } else { 1.0 };
        let allowed = TOLERANCE.foretold * bends / (self.lights as f32).sqrt();
        let mean = |a: Moments, b: Moments| (a + b) * 0.5;
        let [nw, n, ne, w, m, e, sw, s, se] = *nodes;
        let middle = mean(mean(nw, ne), mean(sw, se));
        let foretold = [(n, mean(nw, ne)), (w, mean(nw, sw)), (m, middle), (e, mean(ne, se)), (s, mean(sw, se))];
        foretold.iter().all(|(is, said)| {
            let value = colors.onto(base, is);
            let error = colors.of(&is.apart(*said));
            lights.steps(value, error) <= allowed
        })
    }

    /// Lays the quadratic through nine sums over the pixels of a square: its mean over their rays.
    fn fill(&mut self, scene: &Scene, item: &GridItem, nodes: &[Moments; 9]) {
        let Square { x, y, side } = item.square;
        let n = scene.antialiasing as f32;
        // A regular grid of n x n in a pixel of width h: x^2 is (1 - 1/n^2) h^2 / 12 more than in its middle
        let h = 1.0 / side as f32;
        let more = (1.0 - 1.0 / (n * n)) * h * h / 12.0;
        let mut weights = [[0.0f32; 3]; LARGEST as usize];
        for (i, weights) in weights.iter_mut().enumerate().take(side as usize) {
            let t = (i as f32 + 0.5) * h;
            *weights = [
                (2.0 * t - 1.0) * (t - 1.0) + 2.0 * more,
                4.0 * t * (1.0 - t) - 4.0 * more,
                t * (2.0 * t - 1.0) + 2.0 * more,
            ];
        }
        let start = self.pixel(item.light as usize, [x, y]);
        for (row, [a, b, c]) in weights[..side as usize].iter().enumerate() {
            let column = |k: usize| {
                let [n, m, s] = [nodes[k], nodes[3 + k], nodes[6 + k]];
                n * *a + m * *b + s * *c
            };
            let [w, m, e] = [column(0), column(1), column(2)];
            let line = &mut self.arrived[start + row * CELL as usize..][..side as usize];
            for (sums, [a, b, c]) in line.iter_mut().zip(&weights) {
                *sums = (w * *a + m * *b + e * *c).at_least_0();
            }
        }
    }
}
