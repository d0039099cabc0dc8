//! Light over squares of pixels that see one surface, interpolated between nodes at corners of pixels.
//!
//! A square is interpolated where neither silhouettes on the light nor the light on the lobe move far over it, and
//! where the nodes pass the test of [`SquareNodes`]. Lights are estimated for all squares of a size together.

use std::ops::ControlFlow;

use super::Counts;
use super::cell::CELL;
use super::direct::{DirectLighting, LightEstimate, LightQuery};
use super::interpolation::{SquareNodes, refine};
use super::square::Square;
use super::visible_shape::VisibleShape;
use crate::film::Heat;
use crate::integrate::TOLERANCE;
use crate::material::{Bsdf, Lobe, Moments, ShadingPoint};
use crate::visibility::Visibility;

/// Pixels across the smallest square that is interpolated.
const SMALLEST: u32 = 2;
/// Corners of pixels across a cell.
const CORNERS: usize = CELL as usize + 1;
const PIXELS: usize = (CELL * CELL) as usize;

/// A square of pixels that see one surface, as far as that has one lobe.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceBlock {
    pub square: Square,
    pub shape: VisibleShape,
    /// The brightest reflectances of its pixels, and the darkest ambient one.
    pub bsdf: Bsdf,
    /// Its number among the blocks of the square: one for each lobe.
    pub layer: usize,
    /// The number of the first of its means, one for each pixel of the square; `None` if `bsdf` is that of all pixels.
    pub means: Option<usize>,
}

/// No node.
const NONE: u32 = u32::MAX;

/// A corner of pixels on one surface.
struct GridNode {
    shape: VisibleShape,
    lobe: Lobe,
    /// The next node at the same corner.
    next: u32,
}

/// A square with a block and a light.
type Item = (Square, (u32, u32));

/// The light that arrives at the pixels of a cell.
pub(crate) struct LightingGrid {
    corner: [u32; 2],
    lights: usize,
    /// Layer by layer of the blocks, light by light, pixel by pixel.
    arriving: Vec<Moments>,
    /// The first node at each corner of pixels.
    first: Vec<u32>,
    nodes: Vec<GridNode>,
    points: Vec<ShadingPoint>,
    /// Node by node, light by light; `None` before the first query.
    moments: Vec<Option<Moments>>,
}

impl LightingGrid {
    pub fn new(lights: usize) -> Self {
        LightingGrid {
            corner: [0; 2],
            lights,
            arriving: Vec::new(),
            first: vec![NONE; CORNERS * CORNERS],
            nodes: Vec::new(),
            points: Vec::new(),
            moments: Vec::new(),
        }
    }

    /// Clears the grid for the cell at `corner`.
    pub fn begin(&mut self, corner: [u32; 2]) {
        self.corner = corner;
        self.arriving.clear();
        self.first.fill(NONE);
        self.nodes.clear();
        self.points.clear();
        self.moments.clear();
    }

    fn pixel(&self, [i, j]: [u32; 2]) -> usize {
        ((j - self.corner[1]) * CELL + i - self.corner[0]) as usize
    }

    /// The moments of a light at a pixel of a block, if they are interpolated.
    pub fn arriving(&self, block: &SurfaceBlock, light: usize, at: [u32; 2]) -> Option<Moments> {
        Some(self.row(block, light, at, 1)[0]).filter(Moments::is_known)
    }

    /// Whether all lights are interpolated at a pixel of a block.
    pub fn has_all(&self, block: &SurfaceBlock, at: [u32; 2]) -> bool {
        (0..self.lights).all(|light| self.arriving(block, light, at).is_some())
    }

    /// The moments of a light at the pixels of a row of a block from `at` on; not a number where they are not
    /// interpolated.
    pub fn row(&self, block: &SurfaceBlock, light: usize, at: [u32; 2], length: usize) -> &[Moments] {
        &self.arriving[(block.layer * self.lights + light) * PIXELS + self.pixel(at)..][..length]
    }

    /// The change of the moments from a pixel to its neighbours in a block, along both axes together; `None` unless all
    /// of these are interpolated.
    pub fn slope(&self, block: &SurfaceBlock, light: usize, at: [u32; 2]) -> Option<Moments> {
        let Square { x, y, side } = block.square;
        let here = self.arriving(block, light, at)?;
        let mut slope = Moments::ZERO;
        for (axis, from) in [x, y].into_iter().enumerate() {
            let mut most: Option<Moments> = None;
            for to in [at[axis].wrapping_sub(1), at[axis] + 1] {
                if to.wrapping_sub(from) < side {
                    let mut beside = at;
                    beside[axis] = to;
                    let change = self.arriving(block, light, beside)?.apart(here);
                    most = Some(most.unwrap_or_default().max(change));
                }
            }
            slope += most?;
        }
        Some(slope)
    }

    /// Interpolates all lights over all blocks where that is possible. The work is added to that of the pixels.
    pub fn light(
        &mut self,
        lights: &mut DirectLighting,
        blocks: &[SurfaceBlock],
        work: &mut [f32],
        counts: &mut Counts,
        go_on: &dyn Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let layers = blocks.iter().map(|block| block.layer + 1).max().unwrap_or(0);
        self.arriving.resize(layers * self.lights * PIXELS, Moments::UNKNOWN);
        let all = 0..self.lights as u32;
        let items = (0..).zip(blocks).flat_map(|(k, block)| all.clone().map(move |light| (block.square, (k, light))));
        let size = [lights.scene.width, lights.scene.height];
        refine(items.collect(), SMALLEST, size, |items| self.interpolate(lights, blocks, items, work, counts, go_on))
    }

    /// Interpolates squares of one size that pass the tests; returns the others.
    fn interpolate(
        &mut self,
        lights: &mut DirectLighting,
        blocks: &[SurfaceBlock],
        mut items: Vec<Item>,
        work: &mut [f32],
        counts: &mut Counts,
        go_on: &dyn Fn() -> ControlFlow<()>,
    ) -> ControlFlow<(), Vec<Item>> {
        let n = lights.scene.antialiasing;
        items.sort_by_key(|(square, (block, light))| (*block, square.y, square.x, *light));
        let (mut failed, mut open) = (Vec::new(), Vec::new());
        let (mut points, mut queries, mut estimates) = (Vec::new(), Vec::new(), Vec::new());
        // Estimate each light at the center of each square, with its variation over the square
        for group in items.chunk_by(|(one, (a, _)), (other, (b, _))| one == other && a == b) {
            let (square, (number, _)) = group[0];
            let block = &blocks[number as usize];
            let of = SquareNodes::at_corners(square, n);
            let nodes = of.positions().map(|at| self.node(lights, block, at));
            if nodes.contains(&NONE) {
                failed.extend(group);
                continue;
            }
            for (_, (_, light)) in group {
                let point = points.len() as u32;
                queries.push(LightQuery { point, light: *light, visibility: Visibility::Partial });
            }
            points.push(self.center(lights, block, &nodes));
            open.extend(group.iter().map(|item| (*item, of, nodes)));
        }
        lights.estimate(&points, &queries, &mut estimates, counts, go_on)?;
        // Estimate it at the other nodes where it may pass the test
        queries.clear();
        let (mut queried, mut tested) = (Vec::new(), Vec::new());
        for (((square, (number, light)), of, nodes), center) in open.into_iter().zip(&estimates) {
            let before = queries.len();
            if center.is_uniform && center.moments == Moments::ZERO {
                self.fill(&of, &blocks[number as usize], light, &[Moments::ZERO; 9]);
            } else if center.motion <= 1.0 && center.turn <= 1.0 {
                self.moments[nodes[4] as usize * self.lights + light as usize] = Some(center.moments);
                for point in nodes {
                    let at = point as usize * self.lights + light as usize;
                    if self.moments[at].is_none() {
                        self.moments[at] = Some(Moments::UNKNOWN);
                        queries.push(LightQuery { point, light, visibility: center.visibility });
                        queried.push(at);
                    }
                }
                tested.push(((square, (number, light)), of, nodes, *center));
            } else {
                failed.push((square, (number, light)));
            }
            let each = Heat::PLACE * (1 + queries.len() - before) as f32 / (square.side * square.side) as f32;
            square.pixels().for_each(|at| work[self.pixel(at)] += each);
        }
        lights.estimate(&self.points, &queries, &mut estimates, counts, go_on)?;
        for (at, estimate) in queried.into_iter().zip(&estimates) {
            self.moments[at] = Some(estimate.moments);
        }
        // Interpolate the squares that pass it
        for (item, of, nodes, center) in tested {
            let (_, (number, light)) = item;
            let at = |node: u32| self.moments[node as usize * self.lights + light as usize];
            let moments = nodes.map(|node| at(node).unwrap_or(Moments::UNKNOWN));
            let block = &blocks[number as usize];
            if self.is_linear(lights, block, item, &of, &moments, &center) {
                self.fill(&of, block, light, &moments);
            } else {
                failed.push(item);
            }
        }
        ControlFlow::Continue(failed)
    }

    /// The node of a block at a corner of pixels; [`NONE`] if the ray there misses the shape by a rounding.
    fn node(&mut self, lights: &DirectLighting, block: &SurfaceBlock, [x, y]: [u32; 2]) -> u32 {
        let corner = (y - self.corner[1]) as usize * CORNERS + (x - self.corner[0]) as usize;
        let mut node = self.first[corner];
        while node != NONE {
            let GridNode { shape, lobe, next } = self.nodes[node as usize];
            if (shape, lobe) == (block.shape, block.bsdf.lobe) {
                return node;
            }
            node = next;
        }
        let (ray, _) = lights.scene.camera.local_ray(x as f32, y as f32, 1.0);
        let Some(t) = block.shape.intersect(lights.scene, &ray) else { return NONE };
        self.points.push(block.shape.point(lights.scene, &ray, t, &block.bsdf));
        self.nodes.push(GridNode { shape: block.shape, lobe: block.bsdf.lobe, next: self.first[corner] });
        let node = self.nodes.len() as u32 - 1;
        self.first[corner] = node;
        self.moments.resize(self.nodes.len() * self.lights, None);
        node
    }

    /// The center of a square, with a footprint of all of it.
    fn center(&self, lights: &DirectLighting, block: &SurfaceBlock, nodes: &[u32; 9]) -> ShadingPoint {
        let point = |k: usize| &self.points[nodes[k] as usize];
        let center = point(4);
        let (mut reach, mut turn) = (0.0f32, 0.0f32);
        for k in [0, 2, 6, 8] {
            reach = reach.max((point(k).p - center.p).length());
            turn = turn.max((point(k).ns - center.ns).length());
        }
        // The arc, not the chord
        let (reach, turn) = (reach * 1.0625, turn * 1.0625);
        let (bsdf, base) = (block.bsdf, block.bsdf.base(&lights.scene.ambient));
        ShadingPoint { reach, turn, bsdf, base, most_motion: 1.0, ..*center }
    }

    /// Whether the nodes of a square are known and pass the bilinear test.
    fn is_linear(
        &self,
        lights: &DirectLighting,
        block: &SurfaceBlock,
        (square, (_, light)): Item,
        of: &SquareNodes,
        nodes: &[Moments; 9],
        center: &LightEstimate,
    ) -> bool {
        let colors = lights.scale(light as usize) * block.bsdf.colors;
        let base = block.bsdf.base(&lights.scene.ambient);
        let geometry = &lights.scene.geometry;
        let is_behind = (geometry.has_trees() || geometry.layers.is_some()) && center.visibility == Visibility::Partial;
        // Where silhouettes move far, the edge of a penumbra may run between the nodes
        let is_crossed = square.side > SMALLEST && center.motion > TOLERANCE.motion;
        let steps = |k: usize, error: &Moments| lights.steps(colors.onto(base, &nodes[k]), colors.of(error));
        nodes.iter().all(Moments::is_known) && of.pass_bilinear_test(nodes, self.lights, is_behind || is_crossed, steps)
    }

    /// Stores the light of the pixels of a block, interpolated over a square.
    fn fill(&mut self, of: &SquareNodes, block: &SurfaceBlock, light: u32, nodes: &[Moments; 9]) {
        let first = (block.layer * self.lights + light as usize) * PIXELS;
        of.interpolate(nodes, |at, moments| {
            let pixel = self.pixel(at);
            self.arriving[first + pixel] = moments.at_least_0();
        });
    }
}
