//! Quadrature of one cell of a light, for sixteen cells at once: 5 x 5 Gauss-Legendre nodes give the integral of
//! each moment, an error estimate and, on partially visible cells, the antiderivative along rows as a polynomial.
//!
//! The error estimate comes from the last two coefficients of the Legendre series along each axis: for functions
//! that are analytic beyond the cell, coefficients fall geometrically.
//!
//! Source: Trefethen, "Approximation Theory and Approximation Practice", 2013, chapters 8 and 19.

use fearless_simd::{f32x16, prelude::*};

use super::batch::{
    Exact, FrameLanes, FrameNumber, LaneBlock, LaneNumbers, LightFrame16, Linear16, Members, light_vectors,
};
use super::tolerance::TOLERANCE;
use crate::material::LobeKind;
use crate::math::{LANES, sin_cos};
use crate::shape::BumpShadowing;

/// Moments of a light: of the cosine, and of the lobe.
pub(crate) use crate::material::MOMENTS;
/// Nodes along an axis.
const NODES: usize = 5;

/// The Gauss-Legendre rule of five nodes on [-1, 1].
const GAUSS: [f64; NODES] =
    [-0.906_179_845_938_664, -0.538_469_310_105_683_1, 0.0, 0.538_469_310_105_683_1, 0.906_179_845_938_664];
const WEIGHTS: [f64; NODES] = [
    0.236_926_885_056_189_08,
    0.478_628_670_499_366_47,
    0.568_888_888_888_888_9,
    0.478_628_670_499_366_47,
    0.236_926_885_056_189_08,
];

/// The rule in f32, with the factors of each node in the coefficients of the Legendre polynomials of degree 3 and 4.
struct Rule {
    nodes: [f32; NODES],
    weights: [f32; NODES],
    tails: [[f32; NODES]; 2],
}

const RULE: Rule = {
    let mut rule = Rule { nodes: [0.0; NODES], weights: [0.0; NODES], tails: [[0.0; NODES]; 2] };
    let mut i = 0;
    while i < NODES {
        let x = GAUSS[i];
        // Bonnet's recursion
        let (mut before, mut p, mut k) = (1.0, x, 1);
        while k + 1 < NODES {
            (before, p) = (p, ((2 * k + 1) as f64 * x * p - k as f64 * before) / (k + 1) as f64);
            k += 1;
        }
        rule.nodes[i] = x as f32;
        rule.weights[i] = WEIGHTS[i] as f32;
        rule.tails[0][i] = ((k as f64 - 0.5) * WEIGHTS[i] * before) as f32;
        rule.tails[1][i] = ((k as f64 + 0.5) * WEIGHTS[i] * p) as f32;
        i += 1;
    }
    rule
};

/// Coefficients of x^0 to x^4 of the Lagrange polynomials of the nodes.
const LAGRANGE: [[f64; NODES]; NODES] = {
    let mut all = [[0.0; NODES]; NODES];
    let mut i = 0;
    while i < NODES {
        let mut p = [0.0; NODES];
        p[0] = 1.0;
        let mut j = 0;
        let mut degree = 0;
        while j < NODES {
            if j != i {
                // times (x - x_j) / (x_i - x_j)
                let scale = 1.0 / (GAUSS[i] - GAUSS[j]);
                let mut k = degree + 1;
                while k > 0 {
                    p[k] = (p[k - 1] - GAUSS[j] * p[k]) * scale;
                    k -= 1;
                }
                p[0] *= -GAUSS[j] * scale;
                degree += 1;
            }
            j += 1;
        }
        all[i] = p;
        i += 1;
    }
    all
};

/// Factors of each node in the coefficients of x^0 to x^4 of the interpolating polynomial, or of x^1 to x^5 of its
/// antiderivative.
const fn matrix(antiderivative: bool) -> [[f32; NODES]; NODES] {
    let mut matrix = [[0.0; NODES]; NODES];
    let mut i = 0;
    while i < NODES {
        let mut k = 0;
        while k < NODES {
            let by = if antiderivative { (k + 1) as f64 } else { 1.0 };
            matrix[k][i] = (LAGRANGE[i][k] / by) as f32;
            k += 1;
        }
        i += 1;
    }
    matrix
}
const ANTIDERIVATIVE: [[f32; NODES]; NODES] = matrix(true);
const MONOMIALS: [[f32; NODES]; NODES] = matrix(false);

/// The weight of a place of a light in the integral, beside the cosine at the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum AreaWeight {
    /// The same everywhere.
    Constant,
    /// The cosine at the light over the square of the distance.
    Physical,
    /// The same everywhere on a sphere: [`Outline::Sphere`](super::light_frame::Outline::Sphere).
    Sphere,
    /// The same on a sphere around the points, seen through the faces of a cube.
    Around { center: Exact, radius: f32 },
}

/// A rectangle of a light's square, for one point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cell {
    /// The point it is seen from.
    pub point: u32,
    /// First and last x and y, in the light's coordinates; longitude and latitude of a sphere.
    pub x: [f32; 2],
    pub y: [f32; 2],
    /// The number of halvings.
    pub depth: u32,
}

/// Integrals over sixteen cells, and their error estimates along x and along y; of each moment.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CellQuadrature {
    pub sums: [LaneNumbers; MOMENTS],
    pub errors: [[LaneNumbers; MOMENTS]; 2],
}

/// Coefficients of a polynomial of degree 4 along both axes.
const POWERS: usize = NODES * NODES;

/// Sixteen partially visible cells: the antiderivatives along x of each moment, and the sides of the cells.
#[derive(Clone, Debug)]
pub(crate) struct PartialCells([LaneNumbers; MOMENTS * POWERS + 4]);

impl PartialCells {
    /// The index of the coefficient of x^(`x` + 1) y^`y`.
    pub const fn power(moment: usize, x: usize, y: usize) -> usize {
        moment * POWERS + x * NODES + y
    }

    /// The indices of the first x, the last x, the first y and the last y.
    pub const SIDES: [usize; 4] = [MOMENTS * POWERS, MOMENTS * POWERS + 1, MOMENTS * POWERS + 2, MOMENTS * POWERS + 3];
}

impl LaneBlock for PartialCells {
    #[inline(always)]
    fn numbers(&self) -> &[LaneNumbers] {
        &self.0
    }
}

/// The sides of up to sixteen cells: first x, last x, first y, last y.
#[inline(always)]
pub(super) fn sides(cells: &[Cell]) -> [LaneNumbers; 4] {
    let mut sides = [[0.0; LANES]; 4];
    for k in 0..LANES {
        let Cell { x, y, .. } = &cells[k.min(cells.len() - 1)];
        [sides[0][k], sides[1][k], sides[2][k], sides[3][k]] = [x[0], x[1], y[0], y[1]];
    }
    sides
}

/// Values at the nodes: [moment][row][column]. Those of moments that a lobe does not have are left as they are.
pub(crate) type NodeValues = [[[LaneNumbers; NODES]; NODES]; MOMENTS];

/// Writes the moments' integrands at the nodes of up to sixteen cells. Returns the factor of the quadrature sums: a
/// quarter of each cell's dx dy, times the light's measure. To be called within `vectorize`.
#[inline(always)]
fn evaluate_nodes<S: Simd>(
    simd: S,
    lobe: Option<LobeKind>,
    falloff: AreaWeight,
    members: &Members<LightFrame16>,
    cells: &[Cell],
    values: &mut NodeValues,
) -> f32x16<S> {
    use FrameNumber::*;
    let splat = |v: f32| simd.splat_f32x16(v);
    let [x0, x1, y0, y1] = sides(cells).map(|side| f32x16::simd_from(simd, side));
    let (xm, xh, ym, yh) = ((x0 + x1) * 0.5, (x1 - x0) * 0.5, (y0 + y1) * 0.5, (y1 - y0) * 0.5);
    let (fa, la, skew, fb, lb) = (
        members.lanes(simd, Fa),
        members.lanes(simd, La),
        members.lanes(simd, Skew),
        members.lanes(simd, Fb),
        members.lanes(simd, Lb),
    );
    let (height, cos_o) = (members.lanes(simd, Height), members.lanes(simd, CosO));
    let cos = members.linear(simd, [CosC, CosX, CosY]);
    let out = members.linear(simd, [OutC, OutX, OutY]);
    let zero = splat(0.0);
    let height2 = height * height;
    let lobes = members.lobes(simd, lobe);
    let bump = members.lanes(simd, Bump);
    let is_bumpy = bump.simd_gt(zero).any_true();
    let horizon = members.linear(simd, [HorizonC, HorizonX, HorizonY]);
    let is_sphere = falloff == AreaWeight::Sphere;
    let (ratio, behind2) = (members.lanes(simd, Ratio), members.lanes(simd, Behind2));
    // Distance along the way to the middle of a sphere, and the power of the point with respect to it
    let around = match falloff {
        AreaWeight::Around { center, radius } => {
            let to = center.seen_from(simd, members.vectors(simd, [Px, Py, Pz]));
            let distance = to.dot(to).sqrt();
            let touch2 = ((distance - radius) * (distance + radius)).min(zero);
            (Linear16::along(to, &light_vectors(simd, members)), touch2, height * radius)
        }
        _ => (Linear16 { c: zero, x: zero, y: zero }, zero, zero),
    };
    let (mut places, mut deep) = ([zero; NODES], [splat(1.0); NODES]);
    for (i, node) in RULE.nodes.iter().enumerate() {
        places[i] = xh * *node + xm;
        if is_sphere {
            (places[i], deep[i]) = sin_cos(places[i]);
        }
    }
    let (mut cos_i, mut cos_io, mut weights) = ([zero; NODES], [zero; NODES], [splat(1.0); NODES]);
    for (j, node) in RULE.nodes.iter().enumerate() {
        let (mut y, mut wide) = (yh * *node + ym, splat(1.0));
        if is_sphere {
            (y, wide) = sin_cos(y);
        }
        let along_row = y * skew + fa;
        let across = y * lb + fb;
        let rest = across * across + height2;
        let (cos_row, out_row) = (y * cos.y + cos.c, y * out.y + out.c);
        for i in 0..NODES {
            let x = if is_sphere { places[i] * wide } else { places[i] };
            let along = x * la + along_row;
            let inverse = 1.0 / (along * along + rest).sqrt();
            match falloff {
                AreaWeight::Constant => weights[i] = splat(1.0),
                AreaWeight::Physical => weights[i] = inverse * inverse * (inverse * height),
                AreaWeight::Around { .. } => {
                    // The square of the way to the sphere, over its cosine there: t^2 |l|^2 and root / (|l| radius)
                    let (to, touch2, size) = around;
                    let (length2, to) = (along * along + rest, to.at(x, y));
                    let root = (to * to - length2 * touch2).sqrt().max(splat(f32::MIN_POSITIVE));
                    // Nothing cancels
                    let t = to.simd_lt(zero).select(-touch2 / (root - to), (to + root) / length2);
                    weights[i] = t * t * size / root;
                }
                AreaWeight::Sphere => {
                    // With q = sqrt(1 - x^2 - y^2), the areas of the sphere before and behind a place of the disk are
                    // as 1 / (1 + ratio q)^2 and 1 / (1 - ratio q)^2, over q; and 1 - (ratio q)^2 is |l|^2 over the
                    // square of the way to where the sphere is touched
                    let near = deep[i] * wide * ratio + 1.0;
                    let far = near * (behind2 * inverse * inverse);
                    weights[i] = wide * (1.0 / (near * near) + far * far);
                }
            }
            cos_i[i] = (x * cos.x + cos_row) * inverse;
            cos_io[i] = (x * out.x + out_row) * inverse;
            if is_bumpy {
                weights[i] *= BumpShadowing::factor_lanes(bump, horizon.at(x, y) * inverse);
            }
        }
        lobes.for_each_moment(
            cos_i,
            cos_o,
            cos_io,
            weights,
            #[inline(always)]
            |moment, numbers| {
                for (value, number) in values[moment][j].iter_mut().zip(numbers) {
                    number.store_slice(value);
                }
            },
        );
    }
    xh * yh * members.lanes(simd, Measure)
}

/// The integral of a moment over a cell, and the absolute last two Legendre coefficients along x and along y, times
/// their number of terms.
#[inline(always)]
fn sum<S: Simd>(simd: S, values: &[[LaneNumbers; NODES]; NODES]) -> (f32x16<S>, [[f32x16<S>; 2]; 2]) {
    let zero = simd.splat_f32x16(0.0);
    let (mut sum, mut tails) = (zero, [[zero; 2]; 2]);
    for (j, row) in values.iter().enumerate() {
        let (mut total, mut c, mut d) = (zero, [zero; 2], [zero; 2]);
        for (i, value) in row.iter().enumerate() {
            let [in_row, in_column] = [value, &values[i][j]].map(|value| f32x16::simd_from(simd, *value));
            total += in_row * RULE.weights[i];
            for k in 0..2 {
                c[k] += in_row * RULE.tails[k][i];
                d[k] += in_column * RULE.tails[k][i];
            }
        }
        sum += total * RULE.weights[j];
        for k in 0..2 {
            tails[0][k] += c[k].abs() * (2.0 * RULE.weights[j]);
            tails[1][k] += d[k].abs() * (2.0 * RULE.weights[j]);
        }
    }
    (sum, tails)
}

/// Integrates up to sixteen cells. On fully visible cells the error estimate is the tail of the series times its ratio
/// to the integral, since errors cancel at Gauss nodes; on partially visible cells they do not. With `kept`, cells are
/// partially visible, and their antiderivatives are appended to it. `values` is overwritten. To be called within
/// `vectorize`.
#[inline(always)]
pub(crate) fn integrate<S: Simd>(
    simd: S,
    lobe: Option<LobeKind>,
    falloff: AreaWeight,
    members: &Members<LightFrame16>,
    cells: &[Cell],
    values: &mut NodeValues,
    kept: Option<&mut Vec<PartialCells>>,
) -> CellQuadrature {
    let area = evaluate_nodes(simd, lobe, falloff, members, cells, values);
    let (zero, one, least) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0), simd.splat_f32x16(f32::MIN_POSITIVE));
    let mut whole_sums = CellQuadrature::default();
    let moments = LobeKind::moments(lobe);
    for (moment, values) in values.iter().enumerate().take(moments) {
        let (sum, tails) = sum(simd, values);
        whole_sums.sums[moment] = (sum * area).to_array();
        for (axis, [before, last]) in tails.into_iter().enumerate() {
            let tail = last + before * 0.25;
            let part = (tail / sum.abs().max(least)).min(one);
            let part = if kept.is_some() { simd.splat_f32x16(TOLERANCE.fit_cut) } else { part };
            whole_sums.errors[axis][moment] = (tail * part * area).to_array();
        }
    }
    let Some(kept) = kept else { return whole_sums };
    let mut block = PartialCells([[0.0; LANES]; _]);
    for (number, side) in PartialCells::SIDES.into_iter().zip(sides(cells)) {
        block.0[number] = side;
    }
    for moment in 0..moments {
        // Along rows: [row][power of x]
        let mut rows = [[zero; NODES]; NODES];
        for (row, values) in rows.iter_mut().zip(&values[moment]) {
            for (power, matrix) in row.iter_mut().zip(&ANTIDERIVATIVE) {
                for (value, factor) in values.iter().zip(matrix) {
                    *power += f32x16::simd_from(simd, *value) * *factor;
                }
            }
        }
        // Across them
        for k in 0..NODES {
            for (m, matrix) in MONOMIALS.iter().enumerate() {
                let mut sum = zero;
                for (row, factor) in rows.iter().zip(matrix) {
                    sum += row[k] * *factor;
                }
                block.0[PartialCells::power(moment, k, m)] = (sum * area).to_array();
            }
        }
    }
    kept.push(block);
    whole_sums
}
