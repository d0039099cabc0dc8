//! Interpolation of light over squares of pixels from nine nodes: the corners of a square, the midpoints of its sides,
//! and its center.
//!
//! Where bilinear interpolation of the corners reproduces the light at the other five nodes, the pixels take the
//! biquadratic polynomial through all nine, which has a smaller error still. Elsewhere the square is quartered. There
//! are two sources of nodes: [`LightingGrid`](super::lighting_grid::LightingGrid) evaluates closed forms at the corners
//! of pixels; behind meshes, [`CellRenderer`](super::cell::CellRenderer) samples the light at all rays of pixels.
//!
//! Source: Ward, Heckbert, "Irradiance gradients", 1992, for the interpolation of irradiance between few points; the
//! nine nodes and their test are ours.

use std::array;
use std::ops::{Add, ControlFlow, Mul};

use arrayvec::ArrayVec;

use super::cell::CELL;
use super::square::Square;
use crate::integrate::TOLERANCE;
use crate::material::Moments;

/// Pixels across the largest square with nodes.
const LARGEST: u32 = 16;

/// The nodes of a square along one axis.
#[derive(Clone, Copy)]
struct NodeAxis {
    /// Their positions in pixels, from the start of the square.
    nodes: [u32; 3],
    /// The same position of the center of the first pixel.
    center: f32,
    /// The variance of the positions that the value of a pixel is the mean over, beside that of a node.
    variance: f32,
}

impl NodeAxis {
    /// The weights of the nodes in the mean over pixel `i` of the parabola through them.
    fn parabola(&self, i: u32) -> [f32; 3] {
        let ([a, b, c], t) = (self.nodes.map(|node| node as f32), i as f32 + self.center);
        let basis = |node: f32, p: f32, q: f32| ((t - p) * (t - q) + self.variance) / ((node - p) * (node - q));
        [basis(a, b, c), basis(b, a, c), basis(c, a, b)]
    }

    /// The weights of the first and the last node in the linear interpolation at each node.
    fn line(&self) -> [[f32; 2]; 3] {
        let t = self.nodes[1] as f32 / self.nodes[2] as f32;
        [[1.0, 0.0], [1.0 - t, t], [0.0, 1.0]]
    }
}

/// The nine nodes of a square. Arrays of their values go row by row.
#[derive(Clone, Copy)]
pub(super) struct SquareNodes {
    square: Square,
    columns: NodeAxis,
    rows: NodeAxis,
}

impl SquareNodes {
    /// Nodes at corners of pixels, of whose `n` x `n` camera rays the means are wanted.
    pub fn at_corners(square: Square, n: u32) -> SquareNodes {
        let n = n as f32;
        // That of a regular grid
        let variance = (1.0 - 1.0 / (n * n)) / 12.0;
        let axis = NodeAxis { nodes: [0, square.side / 2, square.side], center: 0.5, variance };
        SquareNodes { square, columns: axis, rows: axis }
    }

    /// Nodes that are means over pixels: the last node of a row or a column is the first of the next square, but for
    /// squares at the `end` of the columns and rows that may be used.
    pub fn in_pixels(square: Square, end: [u32; 2]) -> SquareNodes {
        let side = square.side;
        let axis = |from: u32, end: u32| {
            let last = if from + side < end { side } else { side - 1 };
            NodeAxis { nodes: [0, side / 2, last], center: 0.0, variance: 0.0 }
        };
        SquareNodes { square, columns: axis(square.x, end[0]), rows: axis(square.y, end[1]) }
    }

    /// Their positions on the film: corners of pixels, or pixels.
    pub fn positions(&self) -> [[u32; 2]; 9] {
        array::from_fn(|k| [self.square.x + self.columns.nodes[k % 3], self.square.y + self.rows.nodes[k / 3]])
    }

    /// The value of each pixel, row by row, on the biquadratic polynomial through the nodes.
    pub fn interpolate<T>(&self, nodes: &[T; 9], mut put: impl FnMut([u32; 2], T))
    where
        T: Copy + Add<Output = T> + Mul<f32, Output = T>,
    {
        let Square { x, y, side } = self.square;
        let across: ArrayVec<[f32; 3], { LARGEST as usize }> = (0..side).map(|i| self.columns.parabola(i)).collect();
        let sum = |values: [T; 3], [a, b, c]: [f32; 3]| values[0] * a + values[1] * b + values[2] * c;
        for j in 0..side {
            let down = self.rows.parabola(j);
            let columns = array::from_fn(|k| sum([nodes[k], nodes[3 + k], nodes[6 + k]], down));
            for (i, weights) in (0..).zip(&across) {
                put([x + i, y + j], sum(columns, *weights));
            }
        }
    }

    /// Whether bilinear interpolation of the corners reproduces the other nodes of one of so many lights, within the
    /// tolerance; a stricter one if the light `may_bend` within the square at once. `steps` returns the display steps
    /// of an error at the node of a number.
    pub fn pass_bilinear_test(
        &self,
        nodes: &[Moments; 9],
        lights: usize,
        may_bend: bool,
        mut steps: impl FnMut(usize, &Moments) -> f32,
    ) -> bool {
        // Where the light sets in its derivative is not continuous
        let bends = may_bend || nodes.contains(&Moments::ZERO);
        let allowed =
            TOLERANCE.bilinear_error * if bends { TOLERANCE.bends_at_once } else { 1.0 } / (lights as f32).sqrt();
        [1, 3, 4, 5, 7].into_iter().all(|k| {
            let ([left, right], [up, down]) = (self.columns.line()[k % 3], self.rows.line()[k / 3]);
            let row = |k: usize| nodes[k] * left + nodes[k + 2] * right;
            let error = (row(0) * up + row(6) * down).apart(nodes[k]);
            steps(k, &error) <= allowed
        })
    }
}

/// Interpolates squares from the largest size with nodes down to `smallest`. `interpolate` takes all squares of a size
/// together, each with a key, and returns those that fail its test; their quarters on a film of `size` pixels follow.
pub(super) fn refine<K: Copy>(
    mut squares: Vec<(Square, K)>,
    smallest: u32,
    size: [u32; 2],
    mut interpolate: impl FnMut(Vec<(Square, K)>) -> ControlFlow<(), Vec<(Square, K)>>,
) -> ControlFlow<()> {
    let mut side = CELL;
    while side >= smallest {
        let of_size = squares.extract_if(.., |(square, _)| square.side == side).collect();
        let failed = if side > LARGEST { of_size } else { interpolate(of_size)? };
        let quarters = |(square, key): (Square, K)| square.quarters_on(size).map(move |quarter| (quarter, key));
        squares.extend(failed.into_iter().flat_map(quarters));
        side /= 2;
    }
    ControlFlow::Continue(())
}
