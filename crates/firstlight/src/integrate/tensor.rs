//! The integral of a light that is seen whole: one Gauss rule along its rows and across them.
//!
//! The order is chosen beforehand: how far the point is, measured in the light's half size, bounds how fast the rule
//! converges for what distance does; how far the light reaches across a highlight, for that.

use fearless_simd::{f32x16, prelude::*};

use super::rows::Region;
use super::rules::{MAX_ORDER, gauss};
use super::view::{Outline, View};
use super::{Sums, Wanted};
use crate::material::Lobe;
use crate::math::LANES;

/// Vectors of the largest rule.
const BLOCKS: usize = (MAX_ORDER * MAX_ORDER).div_ceil(LANES);

/// The nodes of a rule on a square, sixteen at a time; what is over counts nothing.
#[derive(Clone, Copy)]
struct Tensor {
    blocks: usize,
    x: [[f32; LANES]; BLOCKS],
    y: [[f32; LANES]; BLOCKS],
    weight: [[f32; LANES]; BLOCKS],
}

const fn tensor(n: usize) -> Tensor {
    let mut tensor = Tensor {
        blocks: (n * n).div_ceil(LANES),
        x: [[0.0; LANES]; BLOCKS],
        y: [[0.0; LANES]; BLOCKS],
        weight: [[0.0; LANES]; BLOCKS],
    };
    let rule = gauss(n);
    let mut k = 0;
    while k < n * n {
        let (block, lane) = (k / LANES, k % LANES);
        tensor.x[block][lane] = rule.nodes[k % n];
        tensor.y[block][lane] = rule.nodes[k / n];
        tensor.weight[block][lane] = rule.weights[k % n] * rule.weights[k / n];
        k += 1;
    }
    tensor
}

static TENSORS: [Tensor; MAX_ORDER] = {
    let mut tensors = [tensor(1); MAX_ORDER];
    let mut n = 2;
    while n <= MAX_ORDER {
        tensors[n - 1] = tensor(n);
        n += 1;
    }
    tensors
};

/// The least order that is good enough for a region of a light that is seen whole; `None` if none is.
pub(crate) fn order(view: &View, region: &Region) -> Option<usize> {
    let ([x0, x1], [y0, y1]) = (region.x, region.y);
    // The distance from the point to the region, and the region's half sizes
    let gap = |from: f32, to: f32, foot: f32| (from - foot).max(foot - to).max(0.0);
    let (half_x, half_y) = (0.5 * (x1 - x0) * view.la, 0.5 * (y1 - y0) * view.lb);
    let lean = view.skew.abs() * y0.abs().max(y1.abs());
    let gap_x = gap(x0 * view.la - lean, x1 * view.la + lean, -view.fa);
    let gap_y = gap(y0 * view.lb, y1 * view.lb, -view.fb);
    let distance2 = gap_x * gap_x + gap_y * gap_y + view.height * view.height;
    let size = half_x.max(half_y) + 0.5 * (y1 - y0) * view.skew.abs();
    let far = if distance2 > 0.0 { distance2.sqrt() / size } else { 0.0 };
    let table = match view.outline {
        Outline::Parallelogram => &FAR_ENOUGH,
        Outline::Disk | Outline::Sphere => &FAR_ENOUGH_DISK,
    };
    let by_distance = table.iter().position(|least| far >= *least)?;
    let sharp = sharpness(view) * (size * size) / distance2;
    let by_lobe = SHARP_ENOUGH.iter().position(|most| sharp <= *most)?;
    Some(FIRST + by_distance.max(by_lobe))
}

/// The order that the tables begin with.
const FIRST: usize = 3;
/// In half sizes of the light, how far a point has to be for each order.
const FAR_ENOUGH: [f32; 8] = [5.0, 3.2, 2.2, 1.7, 1.35, 1.1, 0.95, 0.85];
/// The same for a disk, whose rows are not all as long: that alone takes five.
const FAR_ENOUGH_DISK: [f32; 8] = [f32::INFINITY, f32::INFINITY, 8.0, 4.2, 2.6, 1.9, 1.5, 1.3];
/// How far a light may reach across a highlight, in the exponent of the highlight's fall, for each order.
const SHARP_ENOUGH: [f32; 8] = [0.2, 0.6, 1.1, 1.8, 2.6, 3.4, 4.4, 5.4];

/// [`Lobe::sharpness`] as the point sees it.
pub(crate) fn sharpness(view: &View) -> f32 {
    view.lobe.sharpness(view.cos_o)
}

/// The integral over a region of a light that is above the horizon, by the rule of `n` x `n` nodes.
/// Not inlined: one copy for each instruction set is enough.
#[inline(never)]
pub(crate) fn integrate<S: Simd>(simd: S, view: &View, region: &Region, wanted: Wanted, n: usize) -> Sums {
    simd.vectorize(
        #[inline(always)]
        || integrate_now(simd, view, region, wanted, n),
    )
}

#[inline(always)]
fn integrate_now<S: Simd>(simd: S, view: &View, region: &Region, wanted: Wanted, n: usize) -> Sums {
    let splat = |v: f32| simd.splat_f32x16(v);
    let tensor = &TENSORS[n - 1];
    let ([x0, x1], [y0, y1]) = (region.x, region.y);
    let (x_middle, x_half) = (0.5 * (x0 + x1), 0.5 * (x1 - x0));
    let (y_middle, y_half) = (0.5 * (y0 + y1), 0.5 * (y1 - y0));
    let (mut diffuse, mut specular) = (splat(0.0), splat(0.0));
    for block in 0..tensor.blocks {
        let (x, y) = (f32x16::simd_from(simd, tensor.x[block]), f32x16::simd_from(simd, tensor.y[block]));
        let mut share = f32x16::simd_from(simd, tensor.weight[block]) * (x_half * y_half);
        let (x, y) = match view.outline {
            Outline::Parallelogram => (x * x_half + x_middle, y * y_half + y_middle),
            // Rows of the whole disk
            Outline::Disk | Outline::Sphere => {
                let yy = y * y;
                let inside = 1.0 - yy;
                let reach = inside * (4.0 - yy).sqrt() * 0.5;
                share *= reach * (inside * 1.5);
                (x * reach, y * (3.0 - yy) * 0.5)
            }
        };
        let (along, across) = (x * view.la + (y * view.skew + view.fa), y * view.lb + view.fb);
        let distance2 = along * along + across * across + view.height * view.height;
        let inverse = 1.0 / distance2.sqrt();
        if view.physical {
            share *= inverse * inverse * (inverse * view.height);
        }
        let cos_i = (x * view.cos.x + y * view.cos.y + view.cos.c) * inverse;
        if wanted.diffuse {
            diffuse += cos_i * share;
        }
        if wanted.specular && !matches!(view.lobe, Lobe::None) {
            let cos_io = (x * view.out.x + y * view.out.y + view.out.c) * inverse;
            let [lobe] = view.lobe.eval_lanes([cos_i], splat(view.cos_o), [cos_io]);
            specular += lobe * share;
        }
    }
    let total = |v: f32x16<S>| crate::math::LaneSum::from_partials(v.to_array()).total() * view.measure;
    Sums { diffuse: total(diffuse), specular: if wanted.specular { total(specular) } else { 0.0 } }
}
