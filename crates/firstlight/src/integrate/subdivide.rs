//! The horizon test of a light from sixteen points, and the first subdivision of a light into cells: until none is
//! wide beside its distance or beside a highlight.

use std::f32::consts::FRAC_PI_2;

use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::batch::{
    FrameLanes, FrameNumber, LaneNumbers, LightFrame16, Linear16, Members, light_vectors, point_numbers,
};
use super::cell::{Cell, sides};
use super::light_frame::Outline;
use super::tolerance::TOLERANCE;
use crate::material::{LobeKind, ShadingPoint};
use crate::math::{Vec3x16, sin_cos};

/// The horizon test of sixteen points, without occluders, as bits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HorizonTest {
    /// A side that emits faces the point, and some of the light is above its horizons.
    pub arrives: u64,
    /// All of the light is above them.
    pub above: u64,
    /// For all places within the point's reach: no light arrives; all of the light is above the horizons; and the
    /// light's plane is not crossed.
    pub below_around: u64,
    pub above_around: u64,
    pub beside_around: u64,
    /// Lower bound of the distance to the light's square, and the distance to its plane, in metres.
    pub nearest: LaneNumbers,
    pub height: LaneNumbers,
}

/// Tests a light against the horizons of up to sixteen points. To be called within `vectorize`.
#[inline(always)]
pub(super) fn test_horizons<S: Simd>(
    simd: S,
    frames: &LightFrame16,
    is_physical: bool,
    points: &[ShadingPoint],
) -> HorizonTest {
    use FrameNumber::*;
    let zero = simd.splat_f32x16(0.0);
    let reach = point_numbers(simd, points, |point| point.reach);
    let turn = point_numbers(simd, points, |point| point.turn);
    let [x0, x1] = [frames.lanes(simd, X0), frames.lanes(simd, X1)];
    let [y0, y1] = [frames.lanes(simd, Y0), frames.lanes(simd, Y1)];
    let (height, facing) = (frames.lanes(simd, Height), frames.lanes(simd, Facing));
    let l = light_vectors(simd, frames);
    let mut far2 = zero;
    for [x, y] in [[x0, y0], [x1, y0], [x1, y1], [x0, y1]] {
        let corner = l[0] + (l[1] * x + l[2] * y);
        far2 = far2.max(corner.dot(corner));
    }
    let room = reach + turn * (far2.sqrt() + reach);
    let is_beside =
        if is_physical { height.simd_gt(reach) } else { height.simd_gt(reach) | facing.simd_eq(f32::INFINITY) };
    let mut arrives = facing.simd_gt(zero);
    if is_physical {
        arrives &= height.simd_gt(zero);
    }
    let mut above = arrives;
    let mut below_around = facing.simd_lt(-reach);
    let mut above_around = is_beside;
    for line in [frames.linear(simd, [CosC, CosX, CosY]), frames.linear(simd, [HorizonC, HorizonX, HorizonY])] {
        let most = line.c + (line.x * x0).max(line.x * x1) + (line.y * y0).max(line.y * y1);
        let least = line.c + (line.x * x0).min(line.x * x1) + (line.y * y0).min(line.y * y1);
        arrives &= most.simd_gt(zero);
        above &= least.simd_gt(zero);
        below_around |= most.simd_lt(-room);
        above_around &= least.simd_gt(room);
    }
    HorizonTest {
        arrives: arrives.to_bitmask(),
        above: (arrives & above).to_bitmask(),
        below_around: below_around.to_bitmask(),
        above_around: above_around.to_bitmask(),
        beside_around: is_beside.to_bitmask(),
        nearest: frames.nearest(simd).to_array(),
        height: height.to_array(),
    }
}

/// The light as one cell of `point`, in the coordinates in which it is subdivided.
pub(super) fn whole_light(outline: Outline, point: u32, [x, y]: [[f32; 2]; 2]) -> Cell {
    match outline {
        Outline::Parallelogram | Outline::Disk => Cell { point, x, y, depth: 0 },
        Outline::Sphere => {
            let all = [-FRAC_PI_2, FRAC_PI_2];
            Cell { point, x: all, y: all, depth: 0 }
        }
    }
}

/// Sizes and horizon tests of sixteen cells, as bits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CellMetrics {
    /// None of the cell is in the light's outline and above the horizons; all of it is.
    pub nothing: u64,
    pub all: u64,
    /// The cell is too wide, and longer along y than along x.
    pub wide: u64,
    pub along_y: u64,
}

/// Metrics of up to sixteen cells. To be called within `vectorize`.
#[inline(always)]
pub(super) fn cell_metrics<S: Simd>(
    simd: S,
    lobe: Option<LobeKind>,
    outline: Outline,
    members: &Members<LightFrame16>,
    cells: &[Cell],
) -> CellMetrics {
    use FrameNumber::*;
    let zero = simd.splat_f32x16(0.0);
    let [u0, u1, v0, v1] = sides(cells).map(|side| f32x16::simd_from(simd, side));
    let ([x0, x1], [y0, y1]) = match outline {
        Outline::Parallelogram | Outline::Disk => ([u0, u1], [v0, v1]),
        Outline::Sphere => around(simd, [u0, u1], [v0, v1]),
    };
    let (la, lb, skew) = (members.lanes(simd, La), members.lanes(simd, Lb), members.lanes(simd, Skew));
    let (half_x, half_y) = ((x1 - x0) * 0.5 * la, (y1 - y0) * 0.5 * lb);
    let lean = (y1 - y0) * 0.5 * skew.abs();
    let (x, y) = ((x0 + x1) * 0.5, (y0 + y1) * 0.5);
    let off_x = (members.lanes(simd, Fa) + x * la + y * skew).abs();
    let off_y = (members.lanes(simd, Fb) + y * lb).abs();
    let (gap_x, gap_y) = ((off_x - (half_x + lean)).max(zero), (off_y - half_y).max(zero));
    let height = members.lanes(simd, Height);
    let distance2 = gap_x * gap_x + gap_y * gap_y + height * height;
    let (half_x2, half_y2) = ((half_x + lean) * (half_x + lean), half_y * half_y);
    let size2 = half_x2 + half_y2;
    let mut wide = size2.simd_gt(distance2);
    let sharpness = members.lobes(simd, lobe).sharpness(members.lanes(simd, CosO));
    let is_sharp = (sharpness * size2).simd_gt(distance2);
    if is_sharp.any_true() {
        // How far off the highlight's middle the cell begins
        let mirror = members.vectors(simd, [MirrorX, MirrorY, MirrorZ]);
        let has_mirror = mirror.dot(mirror).simd_gt(zero);
        let [l0, a, b] = light_vectors(simd, members);
        let l: Vec3x16<S> = l0 + (a * x + b * y);
        let length2 = l.dot(l);
        let cos = (l.dot(mirror) / length2.sqrt()).max(simd.splat_f32x16(-1.0)).min(simd.splat_f32x16(1.0));
        let apart = (((1.0 - cos) * 2.0).sqrt() - (size2 / length2).sqrt()).max(zero);
        let is_far = has_mirror & (sharpness * apart * apart).simd_ge(TOLERANCE.highlight);
        let is_across = (sharpness * size2).simd_gt(distance2 * TOLERANCE.highlight);
        wide |= is_sharp & has_mirror & !is_far & is_across;
    }
    let [nothing, all] = seen(simd, outline, members, [x0, x1], [y0, y1]);
    let along_y = match outline {
        // The longer edge, in metres, or on the sphere
        Outline::Sphere => (v1 - v0).simd_gt(u1 - u0),
        Outline::Parallelogram | Outline::Disk => (half_y2 + lean * lean).simd_gt(half_x * half_x),
    };
    CellMetrics {
        nothing: nothing.to_bitmask(),
        all: all.to_bitmask(),
        wide: wide.to_bitmask(),
        along_y: along_y.to_bitmask(),
    }
}

/// Bounding rectangles, on the disk, of cells of a sphere in longitude and latitude.
#[inline(always)]
fn around<S: Simd>(simd: S, [u0, u1]: [f32x16<S>; 2], [v0, v1]: [f32x16<S>; 2]) -> ([f32x16<S>; 2], [f32x16<S>; 2]) {
    let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
    let ((west, _), (east, _)) = (sin_cos(u0), sin_cos(u1));
    let ((south, first), (north, last)) = (sin_cos(v0), sin_cos(v1));
    let least = first.min(last).max(zero);
    let most = (v0.simd_lt(zero) & v1.simd_gt(zero)).select(one, first.max(last));
    let from = west * west.simd_lt(zero).select(most, least);
    let to = east * east.simd_gt(zero).select(most, least);
    ([from, to], [south, north])
}

/// Rectangles of a light's square of which nothing, and of which all, is in the outline and above the horizons.
#[inline(always)]
fn seen<S: Simd>(
    simd: S,
    outline: Outline,
    members: &Members<LightFrame16>,
    [x0, x1]: [f32x16<S>; 2],
    [y0, y1]: [f32x16<S>; 2],
) -> [mask32x16<S>; 2] {
    use FrameNumber::*;
    let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
    let lines: [Linear16<S>; 2] =
        [members.linear(simd, [CosC, CosX, CosY]), members.linear(simd, [HorizonC, HorizonX, HorizonY])];
    let [mut nothing, mut all] = [one.simd_lt(zero), one.simd_gt(zero)];
    for line in &lines {
        let mut any = one.simd_lt(zero);
        for [x, y] in [[x0, y0], [x1, y0], [x1, y1], [x0, y1]] {
            let above = line.at(x, y).simd_gt(zero);
            (any, all) = (any | above, all & above);
        }
        nothing |= !any;
    }
    if outline == Outline::Disk {
        let [ox, oy] = [members.lanes(simd, OriginX), members.lanes(simd, OriginY)];
        let ([w, e], [s, n]) = ([x0 + ox, x1 + ox], [y0 + oy, y1 + oy]);
        let far2 = (w * w).max(e * e) + (s * s).max(n * n);
        let (gap_x, gap_y) = (w.max(-e).max(zero), s.max(-n).max(zero));
        nothing |= (gap_x * gap_x + gap_y * gap_y).simd_ge(one);
        all &= !far2.simd_gt(one);
    }
    [nothing, all]
}

/// The halves of a cell along x or along y: at 0, the origin of the coordinates, or in the middle. `None` where no
/// number is left between.
pub(super) fn halves(cell: &Cell, along_y: bool) -> Option<[Cell; 2]> {
    let [from, to] = if along_y { cell.y } else { cell.x };
    let middle = if from < 0.0 && to > 0.0 { 0.0 } else { 0.5 * (from + to) };
    let half = |range: [f32; 2]| {
        let depth = cell.depth + 1;
        if along_y { Cell { y: range, depth, ..*cell } } else { Cell { x: range, depth, ..*cell } }
    };
    (from < middle && middle < to).then(|| [half([from, middle]), half([middle, to])])
}
