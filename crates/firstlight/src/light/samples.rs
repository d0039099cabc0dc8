//! Sample points of area lights: the sets that a scene may choose, and the low-discrepancy series of the sampled
//! renderers.

use crate::describe::words;
use crate::math::LANES;

words! {
    /// How the sampled points of an area light are laid out. The set is fixed: the same for every shading point.
    pub enum SampleSet {
        /// The first N points of the Sobol' (0, 2)-sequence under a fixed Owen scramble.
        Sobol = "sobol",
        /// The middles of m x m equal cells; N = m x m.
        Grid = "grid",
        /// One seeded random point in each of m x m equal cells; N = m x m.
        Stratified = "stratified",
        /// N seeded random points.
        Uniform = "uniform",
    }
}

impl SampleSet {
    /// Whether the set exists for `count` points; if not, the error says for which counts it does.
    pub(crate) fn allows(self, count: u32) -> Result<(), String> {
        let side = count.isqrt();
        match self {
            SampleSet::Grid | SampleSet::Stratified if side * side != count => {
                Err(format!("give a square number, such as {} or {}", side * side, (side + 1) * (side + 1)))
            }
            _ => Ok(()),
        }
    }

    /// Point `k` of a set of `count` points of the unit square.
    pub(crate) fn point(self, k: u32, count: u32, seed: u32) -> [f64; 2] {
        let side = count.isqrt().max(1);
        let in_cell = |[x, y]: [f64; 2]| [((k % side) as f64 + x) / side as f64, ((k / side) as f64 + y) / side as f64];
        match self {
            SampleSet::Sobol => point_of_series(k, 0),
            SampleSet::Grid => in_cell([0.5, 0.5]),
            SampleSet::Stratified => in_cell(random(k, seed)),
            SampleSet::Uniform => random(k, seed),
        }
    }
}

/// The number of series of points that are stratified together.
pub(crate) const SERIES: usize = 16;

/// Point `k` of one of the [`SERIES`] of a Sobol' (0, 2)-sequence, both coordinates scrambled in Owen's way under fixed
/// seeds: the first 2^m points of each are stratified in every way that the square can be cut into 2^m equal boxes of
/// binary sides.
///
/// Series 0 is the sequence itself. In each of the others some binary digits of all points are inverted, so that the
/// first 2^m points of all series together are stratified nearly as well: for m from 3 to 10 they are a
/// (t, m + 4, 2)-net in base 2 with t at most 2.
///
/// Sources: Burley, "Practical hash-based Owen scrambling", JCGT 9(4), 2020, section 3; of nets: Niederreiter, "Random
/// Number Generation and Quasi-Monte Carlo Methods", 1992, section 4.1.
pub(crate) fn point_of_series(k: u32, series: usize) -> [f64; 2] {
    let inverted = |digits: [u32; 4]| {
        let chosen = (0..4).filter(|bit| series >> bit & 1 == 1);
        chosen.fold(0, |inverted, bit| inverted ^ digits[bit] << 16)
    };
    // The radical inverse is the first dimension; Sobol's second direction numbers make the other
    let (x, y) = (k.reverse_bits() ^ inverted(INVERTED[0]), sobol_second(k) ^ inverted(INVERTED[1]));
    [unit(owen(x, SCRAMBLE[0])), unit(owen(y, SCRAMBLE[1]))]
}

/// A cell of the unit square, as a Morton code: the square is halved along x and y in turn, and each binary digit
/// chooses a half. Cells of successive codes are near each other, and the leading digits of a code are a larger cell
/// that holds the cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct FineCell(u64);

impl FineCell {
    /// Binary digits of a code.
    pub const DIGITS: u32 = 48;
    pub const FIRST: FineCell = FineCell(0);
    /// The length of its sides.
    pub const SIDE: f64 = 1.0 / (1u64 << (Self::DIGITS / 2)) as f64;

    /// The cell that a point lies in.
    pub fn of(point: [f64; 2]) -> FineCell {
        let [x, y] = point.map(|v| with_gaps((v * (1u64 << (Self::DIGITS / 2)) as f64) as u64));
        FineCell(x << 1 | y)
    }

    /// The index of the larger cell that holds it, of `count`, a power of two.
    pub fn part_of(self, count: usize) -> usize {
        (self.0 >> (Self::DIGITS - count.ilog2())) as usize
    }

    /// Its center.
    #[inline(always)]
    pub fn middle(self) -> [f64; 2] {
        [self.0 >> 1, self.0].map(|of| (every_second(of) as f64 + 0.5) / (1u64 << (Self::DIGITS / 2)) as f64)
    }

    /// The cell nearest to this one among those of a larger cell, one of 2^`level`, whose first cell is `first`.
    pub fn nearest_in(self, first: FineCell, level: u32) -> FineCell {
        let axis = |axis: u32, halvings: u32| {
            let [to, least] = [self.0 >> axis, first.0 >> axis].map(every_second);
            to.clamp(least, least + (1 << (Self::DIGITS / 2 - halvings)) - 1)
        };
        FineCell(with_gaps(axis(1, level.div_ceil(2))) << 1 | with_gaps(axis(0, level / 2)))
    }

    /// The first cell of a larger one, one of 2^`level`.
    pub fn first_of(cell: u64, level: u32) -> FineCell {
        FineCell(cell << (Self::DIGITS - level))
    }

    /// A second sample in the larger cell, one of 2^`level`, that holds this one: a random cell of the other half.
    #[inline(always)]
    pub fn second(self, series: usize, level: u32) -> FineCell {
        let rest = Self::DIGITS - level - 1;
        let other = self.0 >> rest ^ 1;
        let any = mix(u64::from(level) << 56 | (series as u64) << 48 | other);
        FineCell(other << rest | any & ((1 << rest) - 1))
    }

    /// The centers of sixteen cells, along x and along y. In lanes where it is called within `vectorize`.
    #[inline(always)]
    pub fn middles(cells: &[FineCell; LANES]) -> [[f64; LANES]; 2] {
        let [mut x, mut y] = [[0.0; LANES]; 2];
        for k in 0..LANES {
            [x[k], y[k]] = cells[k].middle();
        }
        [x, y]
    }

    /// [`second`](Self::second) of sixteen cells, in the same way.
    #[inline(always)]
    pub fn seconds(cells: &[FineCell; LANES], series: usize, level: u32) -> [FineCell; LANES] {
        let mut seconds = [FineCell::FIRST; LANES];
        for k in 0..LANES {
            seconds[k] = cells[k].second(series, level);
        }
        seconds
    }

    /// Which half of the larger cell, one of 2^`level`, holds it.
    pub fn half(self, level: u32) -> usize {
        (self.0 >> (Self::DIGITS - level - 1)) as usize & 1
    }
}

/// The binary digits of a number, each preceded by a 0.
pub(crate) fn with_gaps(digits: u64) -> u64 {
    let mut digits = (digits | digits << 16) & 0x0000_ffff_0000_ffff;
    digits = (digits | digits << 8) & 0x00ff_00ff_00ff_00ff;
    digits = (digits | digits << 4) & 0x0f0f_0f0f_0f0f_0f0f;
    digits = (digits | digits << 2) & 0x3333_3333_3333_3333;
    (digits | digits << 1) & 0x5555_5555_5555_5555
}

/// Every second binary digit of a number, from the last on: the inverse.
#[inline(always)]
fn every_second(digits: u64) -> u64 {
    let mut digits = digits & 0x5555_5555_5555_5555;
    digits = (digits | digits >> 1) & 0x3333_3333_3333_3333;
    digits = (digits | digits >> 2) & 0x0f0f_0f0f_0f0f_0f0f;
    digits = (digits | digits >> 4) & 0x00ff_00ff_00ff_00ff;
    digits = (digits | digits >> 8) & 0x0000_ffff_0000_ffff;
    (digits | digits >> 16) & 0xffff_ffff
}

/// 2^m points of a series, one in each of 2^m cells of the square, in the order of the cells, in blocks of sixteen.
pub(crate) struct SeriesPart {
    /// x and y of the points.
    pub places: Vec<[[f64; LANES]; 2]>,
    pub cells: Vec<[FineCell; LANES]>,
}

impl SeriesPart {
    /// The `count` points from number `first` on, which is a multiple of `count`.
    pub fn new(series: usize, first: u32, count: u32) -> SeriesPart {
        let points = series_by_cell(series, first, count);
        let (blocks, _) = points.as_chunks::<LANES>();
        SeriesPart {
            places: blocks.iter().map(|block| [0, 1].map(|axis| block.map(|at| at[axis]))).collect(),
            cells: blocks.iter().map(|block| block.map(FineCell::of)).collect(),
        }
    }
}

/// The 2^m points of a series from number `first` on, a multiple of 2^m, in the order of the 2^m cells of the square,
/// each of which holds one.
fn series_by_cell(series: usize, first: u32, count: u32) -> Vec<[f64; 2]> {
    let mut points = vec![[f64::NAN; 2]; count as usize];
    for point in (first..first + count).map(|k| point_of_series(k, series)) {
        points[FineCell::of(point).part_of(count as usize)] = point;
    }
    points
}

/// The digits that each bit of a series' number inverts, of the first 16 of each coordinate. Found by a search for the
/// least sum of t squared over all numbers of points and 2, 4, 8 and 16 series.
const INVERTED: [[u32; 4]; 2] = [[0x7a7f, 0x7f4b, 0x9526, 0x8cf9], [0xdfca, 0x22a7, 0x1251, 0x29d3]];

/// The scramble of the sequence: part of the definition of every picture with an area light.
const SCRAMBLE: [u32; 2] = [0x5be0_cd19, 0x1f83_d9ab];

/// The second dimension of Sobol's sequence, as a binary fraction.
fn sobol_second(index: u32) -> u32 {
    let (mut result, mut direction, mut rest) = (0, 1u32 << 31, index);
    while rest > 0 {
        if rest & 1 == 1 {
            result ^= direction;
        }
        direction ^= direction >> 1;
        rest >>= 1;
    }
    result
}

/// Owen's scramble of a binary fraction: each bit is inverted, or not, by a hash of the bits above it.
fn owen(fraction: u32, seed: u32) -> u32 {
    // The hash of Laine and Karras carries from low bits to high ones, so it runs on the mirrored number
    let mut v = fraction.reverse_bits();
    v ^= v.wrapping_mul(0x3d20_adea);
    v = v.wrapping_add(seed);
    v = v.wrapping_mul((seed >> 16) | 1);
    v ^= v.wrapping_mul(0x0552_6c56);
    v ^= v.wrapping_mul(0x53a2_2864);
    v.reverse_bits()
}

/// Point `k` of a seeded random set.
fn random(k: u32, seed: u32) -> [f64; 2] {
    let h = mix(((seed as u64) << 32) | k as u64);
    [unit(h as u32), unit((h >> 32) as u32)]
}

/// A bijection of 64-bit numbers without visible pattern: the finalizer of SplitMix64 (Steele, Lea, Flood, "Fast
/// splittable pseudorandom number generators", OOPSLA 2014).
#[inline(always)]
pub(crate) fn mix(k: u64) -> u64 {
    let mut z = k.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A binary fraction as a number in (0, 1): the middle of the interval its bits stand for.
fn unit(fraction: u32) -> f64 {
    (fraction as f64 + 0.5) / 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;

    impl SampleSet {
        fn points(self, count: u32, seed: u32) -> Vec<[f64; 2]> {
            (0..count).map(|k| self.point(k, count, seed)).collect()
        }
    }

    /// Whether all boxes of binary sides that the square can be cut into 2^m of have as many of the points.
    fn are_stratified(points: &[[f64; 2]], m: u32) -> bool {
        (0..=m).all(|shape| {
            let (columns, rows) = (1usize << shape, 1usize << (m - shape));
            let mut counts = vec![0; columns * rows];
            for [x, y] in points {
                counts[(x * columns as f64) as usize * rows + (y * rows as f64) as usize] += 1;
            }
            counts.iter().all(|count| *count == points.len() >> m)
        })
    }

    #[test]
    fn sobol_is_stratified_in_every_way() {
        for m in [4u32, 6, 10] {
            assert!(are_stratified(&SampleSet::Sobol.points(1 << m, 0), m), "{}", 1 << m);
        }
    }

    #[test]
    fn series_are_stratified_together() {
        for m in 3..=10u32 {
            let points = (0..SERIES).flat_map(|series| (0..1 << m).map(move |k| point_of_series(k, series)));
            let (points, all) = (points.collect::<Vec<_>>(), m + SERIES.ilog2());
            let least = (0..=all).find(|t| are_stratified(&points, all - t));
            assert!(least <= Some(2), "{least:?} with {} points each", 1 << m);
        }
    }

    #[test]
    fn each_cell_has_one_point_of_a_series() {
        for (series, count) in (0..SERIES).flat_map(|series| (4..13).map(move |m| (series, 1 << m))) {
            for first in [0, count] {
                let points = series_by_cell(series, first, count);
                assert!(points.iter().all(|point| !point[0].is_nan()), "{count} points of series {series}");
            }
        }
    }

    #[test]
    fn one_more_point_lies_in_the_other_half() {
        for level in 4..FineCell::DIGITS {
            for cell in series_by_cell(3, 0, 64).into_iter().map(FineCell::of) {
                let second = cell.second(3, level);
                assert_eq!(second.part_of(1 << level), cell.part_of(1 << level));
                assert_eq!(second.half(level) + cell.half(level), 1);
                assert_eq!(FineCell::of(second.middle()), second);
                assert!(FineCell::first_of(cell.part_of(1 << level) as u64, level) <= cell);
            }
        }
    }

    #[test]
    fn the_first_points_do_not_depend_on_how_many_follow() {
        assert_eq!(SampleSet::Sobol.points(1000, 0)[..400], SampleSet::Sobol.points(400, 9)[..]);
    }

    #[test]
    fn every_set_fills_the_square() {
        for set in [SampleSet::Sobol, SampleSet::Grid, SampleSet::Stratified, SampleSet::Uniform] {
            let points = set.points(400, 7);
            assert_eq!(points.len(), 400);
            assert!(points.iter().flatten().all(|x| *x > 0.0 && *x < 1.0));
            let mean = points.iter().map(|p| p[0] + p[1]).sum::<f64>() / 800.0;
            assert!((mean - 0.5).abs() < 0.03, "{set:?}: {mean}");
        }
    }

    #[test]
    fn grids_need_square_numbers() {
        assert!(SampleSet::Grid.allows(400).is_ok() && SampleSet::Sobol.allows(401).is_ok());
        assert_eq!(SampleSet::Grid.allows(401), Err("give a square number, such as 400 or 441".into()));
    }
}
