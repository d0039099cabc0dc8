//! FLIP: how much somebody who flips between two pictures sees of their difference, 0 to 1 in each pixel.
//!
//! Colours are blurred as the eye blurs them at a distance, in an opponent space, and compared in one in which equal
//! distances look alike; where one picture has an edge or a point that the other has not, the difference counts more.
//!
//! Source: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator for
//! Alternating Images", Proceedings of the ACM in Computer Graphics and Interactive Techniques 3(2), 2020, whose
//! letters and constants are kept. The filters are applied row by row, then column by column, which is the same: each
//! is a sum of products of a function of x and one of y.

use crate::parallel;

/// An error map of FLIP.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// 0, nothing is seen, to 1; rows from the top, each from the left.
    pub errors: Vec<f32>,
}

impl Flip {
    /// Pixels in a degree of what an observer sees: those of a screen 3840 pixels and 0.7 m wide at a distance of
    /// 0.7 m, as in the paper.
    pub const PIXELS_PER_DEGREE: f64 = 3840.0 * std::f64::consts::PI / 180.0;

    /// Compares two pictures of so many columns, in linear Rec. 709 as they are displayed: what is below 0 or above 1
    /// is held to that, NaN is 0. `pixels_per_degree` is above 0, see [`PIXELS_PER_DEGREE`](Self::PIXELS_PER_DEGREE).
    ///
    /// # Panics
    /// If the pictures do not have the same number of pixels, or no whole rows.
    pub fn compare(reference: &[[f32; 3]], test: &[[f32; 3]], columns: usize, pixels_per_degree: f64) -> Flip {
        assert!(reference.len() == test.len() && reference.len().is_multiple_of(columns), "pictures of one size");
        let filters = Filters::new(pixels_per_degree);
        let scale = ErrorScale::new();
        let rows = reference.len() / columns;
        let mut errors = vec![0.0; reference.len()];
        parallel::for_each_chunk(&mut errors, columns * BAND, |band, errors| {
            let of = |picture| Filtered::new(picture, columns, rows, band * BAND, errors.len() / columns, &filters);
            let (reference, test) = (of(reference), of(test));
            for (i, error) in errors.iter_mut().enumerate() {
                let color = scale.color_error(reference.lab[i], test.lab[i]);
                let feature = feature_error(reference.features[i], test.features[i]);
                // Eq. 17: a feature raises the difference of colours
                *error = pxfm::f_pow(color, 1.0 - feature) as f32;
            }
        });
        Flip { errors }
    }

    /// The mean over all pixels.
    pub fn mean(&self) -> f64 {
        self.errors.iter().copied().map(f64::from).sum::<f64>() / self.errors.len().max(1) as f64
    }

    /// The largest.
    pub fn max(&self) -> f32 {
        self.errors.iter().copied().fold(0.0, f32::max)
    }
}

/// Rows that are filtered together.
const BAND: usize = 64;

/// Contrast sensitivity as Gaussians, of Y, Cx and Cz: a and b of a sqrt(pi / b) exp(-pi^2 d^2 / b), with d in degrees
/// (table 1).
const CSF: [&[[f64; 2]]; 3] = [&[[1.0, 0.0047]], &[[1.0, 0.0053]], &[[34.1, 0.04], [13.5, 0.025]]];
/// The exponent of differences of colours.
const Q_C: f64 = 0.7;
/// Differences of up to this part of the largest one become errors of up to [`P_T`].
const P_C: f64 = 0.4;
const P_T: f64 = 0.95;
/// The width of an edge that is seen, in degrees.
const W: f64 = 0.082;
/// The exponent of differences of features.
const Q_F: f64 = 0.5;

type Color = [f64; 3];

/// A kernel in one dimension, with its middle in the middle.
type Kernel = Vec<f64>;

/// The kernels for one distance.
struct Filters {
    /// Of each opponent channel, one or two, each with its share.
    csf: [Vec<(f64, Kernel)>; 3],
    /// A Gaussian, its first derivative and its second, whose positive weights sum to 1 and negative ones to -1.
    smooth: Kernel,
    edge: Kernel,
    point: Kernel,
}

impl Filters {
    fn new(pixels_per_degree: f64) -> Self {
        const PI2: f64 = std::f64::consts::PI * std::f64::consts::PI;
        // As far as three standard deviations of the widest
        let widest = CSF.iter().flat_map(|sum| sum.iter()).map(|[_, b]| *b).fold(0.0, f64::max);
        let radius = (3.0 * (widest / (2.0 * PI2)).sqrt() * pixels_per_degree).ceil();
        let csf = CSF.map(|sum| {
            let of = |[a, b]: &[f64; 2]| {
                let kernel =
                    kernel(radius, |x| pxfm::f_exp(-PI2 * (x / pixels_per_degree) * (x / pixels_per_degree) / b));
                let total: f64 = kernel.iter().sum();
                (a * (std::f64::consts::PI / b).sqrt() * total * total, normalized(kernel))
            };
            let mut all: Vec<(f64, Kernel)> = sum.iter().map(of).collect();
            let total: f64 = all.iter().map(|(share, _)| share).sum();
            all.iter_mut().for_each(|(share, _)| *share /= total);
            all
        });
        let s = 0.5 * W * pixels_per_degree;
        let radius = (3.0 * s).ceil();
        let gauss = |x: f64| pxfm::f_exp(-x * x / (2.0 * s * s));
        Filters {
            csf,
            smooth: normalized(kernel(radius, gauss)),
            edge: normalized(kernel(radius, |x| -x * gauss(x))),
            point: normalized(kernel(radius, |x| (x * x / (s * s) - 1.0) * gauss(x))),
        }
    }

    /// How many rows above and below one belong to it.
    fn radius(&self) -> usize {
        (self.csf[0][0].1.len() / 2).max(self.smooth.len() / 2)
    }
}

fn kernel(radius: f64, weight: impl Fn(f64) -> f64) -> Kernel {
    let radius = radius as i32;
    (-radius..=radius).map(|x| weight(f64::from(x))).collect()
}

/// Positive weights sum to 1 and negative ones to -1.
fn normalized(mut kernel: Kernel) -> Kernel {
    let sum = |sign: f64| kernel.iter().map(|w| (w * sign).max(0.0)).sum::<f64>();
    let (positive, negative) = (sum(1.0), sum(-1.0));
    kernel.iter_mut().for_each(|w| *w /= if *w > 0.0 { positive } else { negative.max(f64::MIN_POSITIVE) });
    kernel
}

/// What the eye makes of a band of rows.
struct Filtered {
    /// The blurred colour in L*a*b*, with the Hunt effect.
    lab: Vec<Color>,
    /// How strong edges and points are.
    features: Vec<[f64; 2]>,
}

impl Filtered {
    /// Of `count` rows from `first` on. Beyond its borders a picture is as at them.
    fn new(picture: &[[f32; 3]], columns: usize, rows: usize, first: usize, count: usize, filters: &Filters) -> Self {
        let radius = filters.radius();
        // The rows of the band and those around it, in the opponent space
        let opponent: Vec<Vec<Color>> = (0..count + 2 * radius)
            .map(|row| {
                let y = (first + row).saturating_sub(radius).min(rows - 1);
                picture[y * columns..(y + 1) * columns].iter().map(|rgb| to_opponent(*rgb)).collect()
            })
            .collect();
        let band = Band { opponent, columns, radius, count };
        let gray = |[y, ..]: Color| (y + 16.0) / 116.0;
        let blurred: [Vec<f64>; 3] = std::array::from_fn(|channel| {
            let mut sum = vec![0.0; columns * count];
            for (share, kernel) in &filters.csf[channel] {
                let one = band.filtered(|color| color[channel], kernel, kernel);
                sum.iter_mut().zip(one).for_each(|(sum, one)| *sum += share * one);
            }
            sum
        });
        let strength = |kernel: &Kernel| -> Vec<f64> {
            let across = band.filtered(gray, kernel, &filters.smooth);
            let down = band.filtered(gray, &filters.smooth, kernel);
            across.iter().zip(down).map(|(x, y)| (x * x + y * y).sqrt()).collect()
        };
        let (edges, points) = (strength(&filters.edge), strength(&filters.point));
        Filtered {
            lab: (0..columns * count).map(|i| hunt(to_lab(blurred.each_ref().map(|channel| channel[i])))).collect(),
            features: edges.into_iter().zip(points).map(|(edge, point)| [edge, point]).collect(),
        }
    }
}

/// Rows of a picture, `radius` more above and below than the `count` that are wanted.
struct Band {
    opponent: Vec<Vec<Color>>,
    columns: usize,
    radius: usize,
    count: usize,
}

impl Band {
    /// One number of each pixel, filtered along rows by `across` and along columns by `down`.
    fn filtered(&self, number: impl Fn(Color) -> f64, across: &Kernel, down: &Kernel) -> Vec<f64> {
        let (half, columns) = (across.len() / 2, self.columns);
        let rows: Vec<Vec<f64>> = self
            .opponent
            .iter()
            .map(|row| {
                // With what lies beyond its ends
                let at = |x: usize| number(row[x.saturating_sub(half).min(columns - 1)]);
                let wide: Vec<f64> = (0..columns + 2 * half).map(at).collect();
                wide.windows(across.len()).map(|part| dot(part, across)).collect()
            })
            .collect();
        let top = self.radius - down.len() / 2;
        let mut filtered = vec![0.0; columns * self.count];
        for (y, out) in filtered.chunks_exact_mut(columns).enumerate() {
            for (row, weight) in rows[top + y..].iter().zip(down) {
                out.iter_mut().zip(row).for_each(|(out, value)| *out += weight * value);
            }
        }
        filtered
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// From linear Rec. 709 to X, Y, Z under D65.
const XYZ: [Color; 3] = [
    [10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0],
    [2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0],
    [1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0],
];
/// Back.
const RGB: [Color; 3] = [
    [3.241003275, -1.537398934, -0.498615861],
    [-0.969224334, 1.875930071, 0.041554224],
    [0.055639423, -0.204011202, 1.057148933],
];
/// X, Y, Z of white.
const WHITE: Color = [0.950428545, 1.0, 1.088900371];

fn times(matrix: &[Color; 3], v: Color) -> Color {
    matrix.map(|row| dot(&row, &v))
}

/// X, Y, Z as parts of white.
fn to_relative_xyz(rgb: Color) -> Color {
    let xyz = times(&XYZ, rgb);
    std::array::from_fn(|k| xyz[k] / WHITE[k])
}

/// Y, Cx, Cz: L*a*b* without its cube roots.
fn to_opponent(rgb: [f32; 3]) -> Color {
    // NaN is not above 0
    let [x, y, z] = to_relative_xyz(rgb.map(|c| if c > 0.0 { f64::from(c).min(1.0) } else { 0.0 }));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// From Y, Cx, Cz, by way of colours that can be displayed.
fn to_lab([luma, cx, cz]: Color) -> Color {
    let y = (luma + 16.0) / 116.0;
    let relative = [y + cx / 500.0, y, y - cz / 200.0];
    let rgb = times(&RGB, std::array::from_fn(|k| relative[k] * WHITE[k]));
    lab_of(rgb.map(|c| c.clamp(0.0, 1.0)))
}

/// L*a*b* of linear Rec. 709.
fn lab_of(rgb: Color) -> Color {
    const DELTA: f64 = 6.0 / 29.0;
    let root =
        |t: f64| if t > DELTA * DELTA * DELTA { pxfm::f_cbrt(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let [x, y, z] = to_relative_xyz(rgb).map(root);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The Hunt effect: what is brighter looks more colourful.
fn hunt([l, a, b]: Color) -> Color {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// The distance of two colours that suits large ones.
fn hyab(a: Color, b: Color) -> f64 {
    let [l, x, y]: Color = std::array::from_fn(|k| a[k] - b[k]);
    l.abs() + (x * x + y * y).sqrt()
}

/// The largest difference of colours, which is that of green and blue.
struct ErrorScale {
    most: f64,
}

impl ErrorScale {
    fn new() -> Self {
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|rgb| hunt(lab_of(rgb)));
        ErrorScale { most: pxfm::f_pow(hyab(green, blue), Q_C) }
    }

    /// 0 to 1; large differences share the last twentieth.
    fn color_error(&self, a: Color, b: Color) -> f64 {
        let difference = pxfm::f_pow(hyab(a, b), Q_C);
        let bend = P_C * self.most;
        if difference < bend {
            P_T / bend * difference
        } else {
            P_T + (difference - bend) / (self.most - bend) * (1.0 - P_T)
        }
    }
}

/// 0 to 1, of the strengths of edges and points.
fn feature_error(a: [f64; 2], b: [f64; 2]) -> f64 {
    let most = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    pxfm::f_pow(std::f64::consts::FRAC_1_SQRT_2 * most, Q_F)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Encoding;

    const SIZE: [usize; 2] = [40, 30];

    /// Ramps, a square and dots; another `k` moves and colours them.
    fn picture(k: usize) -> Vec<[f32; 3]> {
        let pixel = |x: usize, y: usize| {
            let square = (10 + k..22 + k).contains(&x) && (8..20).contains(&y);
            let bytes = match (x == 30 && y % 7 == 3 * k, square) {
                (true, _) => [255; 3],
                (_, true) => [230, 40 + 20 * k, 60],
                _ => std::array::from_fn(|c| (x * 5 * (c + 1) + y * 3 * (3 - c) + k * 4 * c) % 256),
            };
            bytes.map(|byte| Encoding::Srgb.decode(byte as f64 / 255.0) as f32)
        };
        (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect()
    }

    /// The numbers are those of the authors' program, `flip-evaluator` 1.7.
    #[test]
    fn it_agrees_with_the_program_of_its_authors() {
        let places = [(0, 0), (10, 8), (30, 3), (39, 29), (20, 25)];
        for (pixels_per_degree, mean, at, max) in [
            (
                Flip::PIXELS_PER_DEGREE,
                0.214_997_84,
                [0.083_750_196, 0.441_267_04, 0.518_943_67, 0.166_720_48, 0.133_235_11],
                0.734_667_1,
            ),
            (20.0, 0.231_584_55, [0.060_772_248, 0.888_291_36, 0.986_750_07, 0.125_148_36, 0.131_998_15], 0.989_120_9),
            (
                120.0,
                0.182_407_98,
                [0.115_794_316, 0.318_266_28, 0.195_756_15, 0.150_825_65, 0.117_041_744],
                0.492_389_1,
            ),
        ] {
            let flip = Flip::compare(&picture(0), &picture(1), SIZE[0], pixels_per_degree);
            let near = |a: f64, b: f64| assert!((a - b).abs() < 2e-5, "{a} is not {b} at {pixels_per_degree}");
            near(flip.mean(), mean);
            near(f64::from(flip.max()), max);
            for ((x, y), error) in places.into_iter().zip(at) {
                near(f64::from(flip.errors[y * SIZE[0] + x]), error);
            }
        }
    }

    #[test]
    fn one_colour_against_another() {
        let mean = |a: [f64; 3], b: [f64; 3]| {
            let [a, b] = [a, b].map(|rgb| vec![rgb.map(|c| Encoding::Srgb.decode(c) as f32); 64]);
            Flip::compare(&a, &b, 8, Flip::PIXELS_PER_DEGREE).mean()
        };
        // Green and blue are the farthest apart, by definition; the others as the authors' program has them, whose 32
        // bits find a trace of features in pictures without any
        assert!((mean([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]) - 1.0).abs() < 1e-6);
        assert!((mean([0.0; 3], [1.0; 3]) - 0.967_388_21).abs() < 1e-5);
        assert!((mean([0.5; 3], [0.6, 0.5, 0.5]) - 0.249_647_08).abs() < 2e-4);
        assert_eq!(mean([0.3, 0.6, 0.1], [0.3, 0.6, 0.1]), 0.0);
    }

    #[test]
    fn bands_do_not_show_and_odd_numbers_have_a_meaning() {
        // Rows that are all the same, more than a band: errors are the same in all
        let rows = 2 * BAND + 3;
        let of = |a: f32| -> Vec<[f32; 3]> { (0..rows * 5).map(|i| [a, (i % 5) as f32 / 4.0, 0.5]).collect() };
        let flip = Flip::compare(&of(0.2), &of(0.3), 5, 10.0);
        assert!(flip.errors.chunks(5).all(|row| row == &flip.errors[..5]) && flip.errors[0] > 0.0);
        let odd = vec![[f32::NAN, -1.0, f32::INFINITY]; 9];
        assert_eq!(Flip::compare(&odd, &[[0.0, 0.0, 1.0]; 9], 3, 1.0).errors, [0.0; 9]);
    }
}
