//! From the texels of a pyramid to a value: the filters.
//!
//! `anisotropic` is the elliptical weighted average (Heckbert, "Fundamentals of texture mapping and image warping",
//! 1989): the footprint's two steps are the columns of a matrix, whose singular values and left singular vectors are
//! the radii and axes of an ellipse of texels; each counts exp(-2 r^2) - exp(-2), r = 1 on the ellipse. The level is
//! the one on which the smaller radius is from 1.125 to 2.25 texels, blended with the next. A stripe as wide as the
//! steps of the footprint leaves at most 2 % of its contrast.

use glam::{DMat2, DVec2};

use super::pyramid::Pyramid;
use super::texels::{Level, Tables, Texel, of_texels, unweighted, weighted};
use super::{Filter, Wrap};
use crate::math::floor;

/// The largest ratio of the axes of an ellipse; the smaller is lengthened. The usual limit of graphics hardware, beyond
/// which a lookup costs more than it shows.
const MAX_RATIO: f64 = 16.0;

/// Footprints with a radius below this, in texels, are magnified.
const MAGNIFIED: f64 = 0.5;

/// From level 1 on the smaller radius of an ellipse, in texels of its level, is at least this. The boxes of the level
/// blur as well: with 1 the value is 1.4 display steps rms from the same kernel over the picture itself on a
/// photograph, with 1.25 0.8 steps, for 1.6 times the texels.
const SMALLEST_RADIUS: f64 = 1.125;

/// Entries of the table of weights, by the square of the radius.
const WEIGHTS: usize = 128;

/// exp(-2 r^2) - exp(-2) at the middles of 128 equal steps of r^2 from 0 to 1: 0 at the rim, so that no texel comes or
/// goes with a jump.
static KERNEL: std::sync::LazyLock<[f32; WEIGHTS]> = std::sync::LazyLock::new(|| {
    std::array::from_fn(|i| {
        let r2 = (i as f64 + 0.5) / WEIGHTS as f64;
        (pxfm::f_exp(-2.0 * r2) - pxfm::f_exp(-2.0)) as f32
    })
});

/// The most texels that half an ellipse reaches along an axis. On the level that the smaller radius chooses the larger
/// one is below 2.25 x 16 = 36.
/// More is met only where one side of a picture is one texel and the other many.
const MAX_REACH: f64 = 64.0;

/// A place of a picture to look up.
#[derive(Clone, Copy, Debug)]
pub(super) struct TexturePlace {
    /// In texels of the picture, from its upper left corner.
    pub at: DVec2,
    /// The steps of the footprint, in texels.
    pub steps: [DVec2; 2],
    /// What of each axis is on the surface, in texels, where that ends.
    pub within: [Option<[f64; 2]>; 2],
}

/// What lies beyond the edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beyond {
    pub wrap: [Wrap; 2],
    /// Red, green, blue and alpha, linear.
    pub border: [f32; 4],
}

impl Pyramid {
    /// Red, green, blue and alpha, or what else its texels stand for.
    pub(super) fn value(&self, filter: Filter, place: &TexturePlace, beyond: &Beyond) -> [f32; 4] {
        let beyond = Beyond { border: if self.covered { weighted(beyond.border) } else { beyond.border }, ..*beyond };
        let value = match filter {
            Filter::Nearest => self.levels[0].nearest(place.at, &beyond, &self.tables),
            Filter::Bilinear => self.bilinear(0, place.at, &beyond),
            Filter::Trilinear => self.trilinear(place, &beyond),
            Filter::Anisotropic => self.anisotropic(place, &beyond),
        };
        if self.covered { unweighted(value) } else { value }
    }

    /// The share of a mask that is solid over a footprint; where it is magnified, 0 or 1.
    pub(super) fn share(&self, filter: Filter, place: &TexturePlace, beyond: &Beyond) -> f32 {
        let Some((_, cutoff)) = &self.mask else { return self.value(filter, place, beyond)[0] };
        let finest = || if self.is_solid(filter, place.at, beyond) { 1.0 } else { 0.0 };
        let radius = EllipseAxes::of(&place.steps).map_or(f64::INFINITY, |axes| axes.major.length());
        if radius <= MAGNIFIED || matches!(filter, Filter::Nearest | Filter::Bilinear) {
            return finest();
        }
        let solid = if beyond.border[0] >= *cutoff { 1.0 } else { 0.0 };
        let share = self.value(filter, place, &Beyond { border: [solid; 4], ..*beyond })[0];
        let part = (2.0 * radius - 1.0).min(1.0) as f32;
        if part < 1.0 { finest() * (1.0 - part) + share * part } else { share }
    }

    /// Whether a mask is solid at a place, in texels, of the finest level.
    #[inline]
    pub(super) fn is_solid(&self, filter: Filter, at: DVec2, beyond: &Beyond) -> bool {
        self.mask.as_ref().is_some_and(|(numbers, cutoff)| {
            let number = match filter {
                Filter::Nearest => numbers.nearest(at, beyond, &self.tables)[0],
                _ => numbers.bilinear_number(at, beyond, &self.tables),
            };
            number >= *cutoff
        })
    }

    fn bilinear(&self, level: usize, at: DVec2, beyond: &Beyond) -> [f32; 4] {
        let of = &self.levels[level];
        of.bilinear(at * of.scale(&self.levels[0]), beyond, &self.tables)
    }

    /// Two levels, each bilinear, by the larger radius of the footprint.
    fn trilinear(&self, place: &TexturePlace, beyond: &Beyond) -> [f32; 4] {
        let radius = EllipseAxes::of(&place.steps).map_or(f64::INFINITY, |axes| axes.major.length());
        let (level, part) = self.level(radius);
        let fine = self.bilinear(level, place.at, beyond);
        if part == 0.0 { fine } else { mix(fine, self.bilinear(level + 1, place.at, beyond), part) }
    }

    /// The level floor(log2(`radius`)), or the last, and the weight of the next, linear in the radius, which is in
    /// texels of the picture.
    fn level(&self, radius: f64) -> (usize, f32) {
        let last = self.levels.len() - 1;
        let (mut level, mut size) = (0, 1.0);
        while level < last && radius >= 2.0 * size {
            (level, size) = (level + 1, 2.0 * size);
        }
        if level == last { (last, 0.0) } else { (level, (radius / size - 1.0).max(0.0) as f32) }
    }

    fn anisotropic(&self, place: &TexturePlace, beyond: &Beyond) -> [f32; 4] {
        let Some(axes) = EllipseAxes::of(&place.steps) else {
            return self.bilinear(self.levels.len() - 1, place.at, beyond);
        };
        let radius = axes.major.length();
        if radius <= MAGNIFIED {
            return self.bilinear(0, place.at, beyond);
        }
        let axes = axes.limited();
        let (level, part) = self.level(axes.minor.length() / SMALLEST_RADIUS);
        let fine = self.ellipse(level, place, &axes, beyond);
        if part > 0.0 {
            return mix(fine, self.ellipse(level + 1, place, &axes, beyond), part);
        }
        let part = (2.0 * radius - 1.0) as f32;
        if part < 1.0 { mix(self.bilinear(0, place.at, beyond), fine, part) } else { fine }
    }

    /// The weighted mean over an ellipse of a level.
    fn ellipse(&self, level: usize, place: &TexturePlace, axes: &EllipseAxes, beyond: &Beyond) -> [f32; 4] {
        let of = &self.levels[level];
        // One texel stands for all there is
        if of.width == 1 && of.height == 1 {
            return of.bilinear(DVec2::splat(0.5), beyond, &self.tables);
        }
        let scale = of.scale(&self.levels[0]);
        let (mut major, mut minor) = (axes.major * scale, axes.minor * scale);
        for axis in 0..2 {
            let reach = (major[axis] * major[axis] + minor[axis] * minor[axis]).sqrt();
            if reach > MAX_REACH {
                major[axis] *= MAX_REACH / reach;
                minor[axis] *= MAX_REACH / reach;
            }
        }
        let within = [0, 1].map(|axis| place.within[axis].map(|ends| ends.map(|end| end * scale[axis])));
        let ellipse = Ellipse { at: place.at * scale, major, minor, within };
        let sum = if ellipse.reach(1) <= ellipse.reach(0) {
            of_texels!(&of.texels, texels => of.sum::<_, false>(texels, &ellipse, beyond, &self.tables))
        } else {
            of_texels!(&of.texels, texels => of.sum::<_, true>(texels, &ellipse, beyond, &self.tables))
        };
        sum.unwrap_or_else(|| of.bilinear(ellipse.at, beyond, &self.tables))
    }
}

fn mix(a: [f32; 4], b: [f32; 4], part: f32) -> [f32; 4] {
    std::array::from_fn(|k| a[k] * (1.0 - part) + b[k] * part)
}

/// The axes of the ellipse that a footprint is, in texels of the picture.
struct EllipseAxes {
    major: DVec2,
    minor: DVec2,
}

impl EllipseAxes {
    /// The singular value decomposition of the matrix whose columns are the steps; `None` where it is not finite.
    #[inline(always)]
    fn of(steps: &[DVec2; 2]) -> Option<EllipseAxes> {
        let [a, b] = *steps;
        // Of the matrix times its transpose: its eigenvalues are the squares of the singular values
        let (xx, xy, yy) = (a.x * a.x + b.x * b.x, a.x * a.y + b.x * b.y, a.y * a.y + b.y * b.y);
        let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let root = (half * half + xy * xy).sqrt();
        let largest = mean + root;
        if !(largest < f64::MAX) {
            return None;
        }
        // Its vector, by the row that does not cancel
        let along = if half >= 0.0 { DVec2::new(half + root, xy) } else { DVec2::new(xy, root - half) };
        let length = along.length();
        let along = if length > 0.0 { along / length } else { DVec2::X };
        let major = largest.sqrt();
        let minor = if major > 0.0 { DMat2::from_cols(a, b).determinant().abs() / major } else { 0.0 };
        Some(EllipseAxes { major: along * major, minor: along.perp() * minor.min(major) })
    }

    /// With no more than the largest ratio, and no radius below a texel.
    #[inline(always)]
    fn limited(&self) -> EllipseAxes {
        let length = self.major.length();
        let along = self.major / length;
        let minor = self.minor.length().max(length / MAX_RATIO).max(1.0);
        EllipseAxes { major: along * length.max(1.0), minor: along.perp() * minor }
    }
}

/// The largest whole number not above `x`.
#[inline(always)]
fn floor_of(x: f32) -> i64 {
    floor(f64::from(x)) as i64
}

/// The least whole number not below `x`.
#[inline(always)]
fn ceil_of(x: f32) -> i64 {
    -floor_of(-x)
}

/// An ellipse in texels of a level.
struct Ellipse {
    at: DVec2,
    major: DVec2,
    minor: DVec2,
    /// What of each axis is on the surface.
    within: [Option<[f64; 2]>; 2],
}

impl Ellipse {
    /// How far it reaches along an axis.
    #[inline(always)]
    fn reach(&self, axis: usize) -> f64 {
        (self.major[axis] * self.major[axis] + self.minor[axis] * self.minor[axis]).sqrt()
    }
}

impl Wrap {
    /// The texel of `size` that stands at `i`; `None` on the border.
    #[inline(always)]
    pub(super) fn index(self, i: i64, size: usize) -> Option<usize> {
        let size = size as i64;
        if (0..size).contains(&i) {
            return Some(i as usize);
        }
        let wrapped = match self {
            Wrap::Repeat => i.rem_euclid(size),
            Wrap::Mirror => {
                let k = i.rem_euclid(2 * size);
                k.min(2 * size - 1 - k)
            }
            Wrap::Clamp => i.clamp(0, size - 1),
            Wrap::Border => return None,
        };
        Some(wrapped as usize)
    }
}

impl Level {
    /// How many of its texels one of the picture's is, along each axis.
    #[inline(always)]
    fn scale(&self, first: &Level) -> DVec2 {
        DVec2::new(self.width as f64 / first.width as f64, self.height as f64 / first.height as f64)
    }

    #[inline(always)]
    fn at<T: Texel>(&self, texels: &[T], i: i64, j: i64, beyond: &Beyond, tables: &Tables) -> [f32; 4] {
        match (beyond.wrap[0].index(i, self.width), beyond.wrap[1].index(j, self.height)) {
            (Some(i), Some(j)) => texels[self.row(j) + Level::column(i)].read(tables),
            _ => beyond.border,
        }
    }

    fn nearest(&self, at: DVec2, beyond: &Beyond, tables: &Tables) -> [f32; 4] {
        let (i, j) = (floor(at.x) as i64, floor(at.y) as i64);
        of_texels!(&self.texels, texels => self.at(texels, i, j, beyond, tables))
    }

    /// The four nearest texel centres, weighted by distance.
    fn bilinear(&self, at: DVec2, beyond: &Beyond, tables: &Tables) -> [f32; 4] {
        let (x, y) = (at.x - 0.5, at.y - 0.5);
        let (i, j) = (floor(x), floor(y));
        let (s, t) = ((x - i) as f32, (y - j) as f32);
        let (i, j) = (i as i64, j as i64);
        of_texels!(&self.texels, texels => {
            let texel = |i, j| self.at(texels, i, j, beyond, tables);
            let row = |j: i64| mix(texel(i, j), texel(i.saturating_add(1), j), s);
            mix(row(j), row(j.saturating_add(1)), t)
        })
    }

    /// The first number of [`bilinear`](Self::bilinear).
    #[inline]
    fn bilinear_number(&self, at: DVec2, beyond: &Beyond, tables: &Tables) -> f32 {
        let (x, y) = (at.x - 0.5, at.y - 0.5);
        let (i, j) = (floor(x), floor(y));
        let (s, t) = ((x - i) as f32, (y - j) as f32);
        let (i, j) = (i as i64, j as i64);
        let mix = |a: f32, b: f32, part: f32| a * (1.0 - part) + b * part;
        of_texels!(&self.texels, texels => {
            // Away from the edges no texel is wrapped
            if (0..self.width as i64 - 1).contains(&i) && (0..self.height as i64 - 1).contains(&j) {
                let columns = [Level::column(i as usize), Level::column(i as usize + 1)];
                let row = |j: usize| {
                    let [a, b] = columns.map(|column| texels[self.row(j) + column].read(tables)[0]);
                    mix(a, b, s)
                };
                return mix(row(j as usize), row(j as usize + 1), t);
            }
            let texel = |i, j| self.at(texels, i, j, beyond, tables)[0];
            let row = |j: i64| mix(texel(i, j), texel(i.saturating_add(1), j), s);
            mix(row(j), row(j.saturating_add(1)), t)
        })
    }

    /// The weighted mean over an ellipse; `None` if no texel lies in it. Texels are summed in lines, in the order of
    /// their places: rows, or columns where the ellipse is longer than wide (`SWAP`).
    ///
    /// r^2 = A e^2 + B e d + C d^2, with e along the line and d across: of the point p = M q, |q| is its radius, where
    /// the columns of M are the axes.
    fn sum<T: Texel, const SWAP: bool>(
        &self,
        texels: &[T],
        ellipse: &Ellipse,
        beyond: &Beyond,
        tables: &Tables,
    ) -> Option<[f32; 4]> {
        let kernel: &[f32; WEIGHTS] = &KERNEL;
        let (along, across) = if SWAP { (1, 0) } else { (0, 1) };
        let size = if SWAP { [self.height, self.width] } else { [self.width, self.height] };
        let wrap = [beyond.wrap[along], beyond.wrap[across]];
        let (major, minor) = (ellipse.major, ellipse.minor);
        let det = major.x * minor.y - major.y * minor.x;
        let inverse = 1.0 / (det * det);
        let a = ((major[across] * major[across] + minor[across] * minor[across]) * inverse) as f32;
        let b = (-2.0 * (major.x * major.y + minor.x * minor.y) * inverse) as f32;
        let c = ((major[along] * major[along] + minor[along] * minor[along]) * inverse) as f32;
        if !(a > 0.0 && a.is_finite() && b.is_finite() && c.is_finite()) {
            return None;
        }
        // Count from the texel that holds the middle, whose coordinate may be far from 0
        let middle = [ellipse.at[along] - 0.5, ellipse.at[across] - 0.5];
        let base = middle.map(floor);
        let offset = [(middle[0] - base[0]) as f32, (middle[1] - base[1]) as f32];
        let base = base.map(|v| v as i64);
        // The texels whose centres are on the surface
        let on_surface = [along, across].map(|axis| ellipse.within[axis]);
        let allowed = [0, 1].map(|k| match on_surface[k] {
            Some([low, high]) => [(low - 0.5).ceil() - base[k] as f64, (high - 0.5).floor() - base[k] as f64]
                .map(|end| end.clamp(-1e6, 1e6) as i64),
            None => [-1_000_000, 1_000_000],
        });
        let reach = ellipse.reach(across) as f32;
        let lines = [ceil_of(offset[1] - reach), floor_of(offset[1] + reach)];
        let (mut sum, mut weights) = ([0.0f32; 4], 0.0f32);
        let half = 0.5 / a;
        for line in lines[0].max(allowed[1][0])..=lines[1].min(allowed[1][1]) {
            let d = line as f32 - offset[1];
            let bd = b * d;
            let cd = c * d * d;
            let root = (bd * bd - 4.0 * a * (cd - 1.0)).max(0.0).sqrt();
            let from = ceil_of(offset[0] + (-bd - root) * half).max(allowed[0][0]);
            let to = floor_of(offset[0] + (root - bd) * half).min(allowed[0][1]);
            if from > to {
                continue;
            }
            let mut add = |k: i64, texel: [f32; 4]| {
                let e = k as f32 - offset[0];
                let r2 = (a * e + bd) * e + cd;
                let weight = kernel[((r2 * WEIGHTS as f32) as usize).min(WEIGHTS - 1)];
                for (sum, v) in sum.iter_mut().zip(texel) {
                    *sum += v * weight;
                }
                weights += weight;
            };
            let Some(line) = wrap[1].index(base[1].saturating_add(line), size[1]) else {
                (from..=to).for_each(|k| add(k, beyond.border));
                continue;
            };
            let start = if SWAP { Level::column(line) } else { self.row(line) };
            let place = |i: usize| start + if SWAP { self.row(i) } else { Level::column(i) };
            if base[0].saturating_add(from) >= 0 && base[0].saturating_add(to) < size[0] as i64 {
                for k in from..=to {
                    add(k, texels[place((base[0] + k) as usize)].read(tables));
                }
            } else {
                for k in from..=to {
                    match wrap[0].index(base[0].saturating_add(k), size[0]) {
                        Some(i) => add(k, texels[place(i)].read(tables)),
                        None => add(k, beyond.border),
                    }
                }
            }
        }
        (weights > 0.0).then(|| sum.map(|v| v / weights))
    }
}
