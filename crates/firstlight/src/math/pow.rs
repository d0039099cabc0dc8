//! x to the power of y for highlights, in plain numbers and in lanes, with the same bits in both.
//!
//! A whole exponent is a chain of multiplications. Any other is 2^(y log2 x) by two short polynomials: only + - x / and
//! moves of bits, so that every processor agrees. `pxfm` is as exact, but scalar: 11 ns a sample is too slow here.

use arrayvec::ArrayVec;
use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::LANES;

/// Whole exponents up to here are chains of multiplications.
const MAX_CHAIN: f32 = 65536.0;

/// An exponent, made ready once per surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exponent {
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// x^n by repeated squaring.
    Whole(u32),
    /// x^(n + 1/2): the same, times the root.
    Half(u32),
    /// Through logarithm and exponential.
    Real(f32),
}

impl Exponent {
    /// `y`: finite, 0 or more.
    #[inline]
    pub fn new(y: f32) -> Self {
        debug_assert!(y.is_finite() && y >= 0.0);
        let kind = match y as u32 {
            whole if y > MAX_CHAIN || y - whole as f32 != 0.0 && y - whole as f32 != 0.5 => Kind::Real(y),
            whole if y == whole as f32 => Kind::Whole(whole),
            whole => Kind::Half(whole),
        };
        Exponent { kind }
    }

    /// y.
    #[inline]
    pub fn value(self) -> f32 {
        match self.kind {
            Kind::Whole(n) => n as f32,
            Kind::Half(n) => n as f32 + 0.5,
            Kind::Real(y) => y,
        }
    }

    /// `x`^y for x from 0 to 1 (a little above 1 by rounding does no harm). 0^0 is 1.
    ///
    /// Relative error: below y x 2^-23 + 2^-21 for y that are multiples of 1/2, 3e-6 + |y log2 x| x 2^-22 otherwise.
    #[inline(always)]
    pub fn pow(self, x: f32) -> f32 {
        match self.kind {
            Kind::Whole(n) => chain(x, n),
            Kind::Half(n) => chain(x, n) * x.sqrt(),
            Kind::Real(y) => exp2(y * log2(x)),
        }
    }

    /// [`pow`](Self::pow) in so many times sixteen lanes: the same bits in each. Several at once hide how long each
    /// multiplication waits for the one before.
    #[inline(always)]
    pub fn pow_lanes<S: Simd, const N: usize>(self, mut x: [f32x16<S>; N]) -> [f32x16<S>; N] {
        match self.kind {
            Kind::Whole(n) => chain_lanes(x, n),
            Kind::Half(n) => {
                let mut powers = chain_lanes(x, n);
                for (power, x) in powers.iter_mut().zip(x) {
                    *power *= x.sqrt();
                }
                powers
            }
            Kind::Real(y) => {
                // A plain loop, which the compiler turns into lanes. Written with the lanes' own bit casts, this took
                // six times as long to compile as all the rest of the library, and ran no faster.
                for x in &mut x {
                    let mut lanes = [0.0; LANES];
                    x.store_slice(&mut lanes);
                    for lane in &mut lanes {
                        *lane = exp2(y * log2(*lane));
                    }
                    *x = f32x16::simd_from(x.token(), lanes);
                }
                x
            }
        }
    }
}

/// An exponent for each of sixteen lanes, made ready once for a batch.
#[derive(Clone, Debug)]
pub struct ExponentLanes {
    values: [f32; LANES],
    /// The exponent of all lanes, if they have the same.
    same: Option<Exponent>,
    /// Of whole exponents, and of those that are a half more: which lanes have each bit, from the lowest up.
    bits: ArrayVec<u16, 17>,
    /// Which lanes have an exponent that is a half more than a whole one, and which any other.
    halves: u16,
    reals: u16,
}

impl ExponentLanes {
    /// `values`: finite, 0 or more.
    #[inline]
    pub fn new(values: [f32; LANES]) -> Self {
        let mut lanes = ExponentLanes { values, same: None, bits: ArrayVec::new(), halves: 0, reals: 0 };
        if values == [values[0]; LANES] {
            lanes.same = Some(Exponent::new(values[0]));
            return lanes;
        }
        let mut wholes = [0; LANES];
        for (lane, (whole, y)) in wholes.iter_mut().zip(values).enumerate() {
            match Exponent::new(y).kind {
                Kind::Whole(n) => *whole = n,
                Kind::Half(n) => (*whole, lanes.halves) = (n, lanes.halves | 1 << lane),
                Kind::Real(_) => lanes.reals |= 1 << lane,
            }
        }
        while wholes != [0; LANES] {
            let mut bits = 0;
            for (lane, whole) in wholes.iter_mut().enumerate() {
                bits |= ((*whole & 1) as u16) << lane;
                *whole >>= 1;
            }
            lanes.bits.push(bits);
        }
        lanes
    }

    /// y, lane by lane.
    #[inline(always)]
    pub fn values(&self) -> &[f32; LANES] {
        &self.values
    }

    /// [`Exponent::pow`] in so many times sixteen lanes, each lane with its exponent: the same bits.
    #[inline(always)]
    pub fn pow_lanes<S: Simd, const N: usize>(&self, x: [f32x16<S>; N]) -> [f32x16<S>; N] {
        if let Some(same) = self.same {
            return same.pow_lanes(x);
        }
        let simd = x[0].token();
        let mask = |bits: u16| mask32x16::from_bitmask(simd, bits.into());
        let (mut results, mut squares) = ([simd.splat_f32x16(1.0); N], x);
        for bits in &self.bits {
            for (result, square) in results.iter_mut().zip(&mut squares) {
                *result = mask(*bits).select(*result * *square, *result);
                *square *= *square;
            }
        }
        for (result, x) in results.iter_mut().zip(x) {
            *result = mask(self.halves).select(*result * x.sqrt(), *result);
            if self.reals != 0 {
                let (mut lanes, mut bases) = (self.values, [0.0; LANES]);
                x.store_slice(&mut bases);
                for (lane, base) in lanes.iter_mut().zip(bases) {
                    *lane = exp2(*lane * log2(base));
                }
                *result = mask(self.reals).select(f32x16::simd_from(simd, lanes), *result);
            }
        }
        results
    }
}

/// x^n by repeated squaring.
#[inline(always)]
fn chain(x: f32, n: u32) -> f32 {
    let (mut result, mut square, mut rest) = (1.0f32, x, n);
    while rest > 0 {
        if rest & 1 == 1 {
            result *= square;
        }
        square *= square;
        rest >>= 1;
    }
    result
}

/// [`chain`] in lanes.
#[inline(always)]
fn chain_lanes<S: Simd, const N: usize>(x: [f32x16<S>; N], n: u32) -> [f32x16<S>; N] {
    let (mut results, mut squares, mut rest) = ([x[0].token().splat_f32x16(1.0); N], x, n);
    while rest > 0 {
        if rest & 1 == 1 {
            for (result, square) in results.iter_mut().zip(&squares) {
                *result *= *square;
            }
        }
        for square in &mut squares {
            *square *= *square;
        }
        rest >>= 1;
    }
    results
}

/// The bits of sqrt(1/2): mantissas are taken from sqrt(1/2) to sqrt(2), so that x near 1 loses nothing.
const SQRT_HALF_BITS: u32 = 0x3f3504f3;
/// What log2 answers for 0 and for subnormals, low enough for every power of it to be 0 that would be.
const LOG2_OF_ZERO: f32 = -1000.0;
/// 1.5 x 2^23: added and taken away again, it rounds to the nearest whole number.
const ROUND: f32 = 12582912.0;
/// 2^x is 0 below this.
const EXP2_MIN: f32 = -126.0;

// log2 m = 2/ln 2 (s + s^3/3 + s^5/5 + ...), s = (m - 1)/(m + 1), |s| < 0.172: five terms leave 2e-9.
const L1: f32 = 2.0 * std::f32::consts::LOG2_E;
const L3: f32 = 0.961_796_7;
const L5: f32 = 0.577_078;
const L7: f32 = 0.412_198_58;
const L9: f32 = 0.320_598_9;

// 2^f = sum (f ln 2)^k / k!, |f| <= 1/2: seven terms leave 2e-8.
const E1: f32 = std::f32::consts::LN_2;
const E2: f32 = 0.240_226_5;
const E3: f32 = 0.055_504_11;
const E4: f32 = 0.009_618_129;
const E5: f32 = 0.001_333_355_8;
const E6: f32 = 0.000_154_035_3;

/// The logarithm to base 2 of `x` >= 0; [`LOG2_OF_ZERO`] below the smallest normal number.
#[inline(always)]
fn log2(x: f32) -> f32 {
    let offset = x.to_bits().wrapping_sub(SQRT_HALF_BITS);
    let exponent = ((offset as i32) >> 23) as f32;
    let m = f32::from_bits((offset & 0x007f_ffff).wrapping_add(SQRT_HALF_BITS));
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let log_m = s * (L1 + z * (L3 + z * (L5 + z * (L7 + z * L9))));
    if x >= f32::MIN_POSITIVE { exponent + log_m } else { LOG2_OF_ZERO }
}

/// 2^x for x <= 128; 0 below -126.
#[inline(always)]
fn exp2(x: f32) -> f32 {
    let clamped = if x > EXP2_MIN { x } else { EXP2_MIN };
    // The low bits of the rounded sum are the whole number
    let rounded = clamped + ROUND;
    let f = clamped - (rounded - ROUND);
    let whole = rounded.to_bits().wrapping_sub(ROUND.to_bits());
    let p = 1.0 + f * (E1 + f * (E2 + f * (E3 + f * (E4 + f * (E5 + f * E6)))));
    let scale = f32::from_bits(whole.wrapping_add(127) << 23);
    if x > EXP2_MIN { p * scale } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    fn bases() -> Vec<f32> {
        let mut xs = vec![0.0, 1e-45, 1e-38, f32::MIN_POSITIVE, 1.0, 1.0 - f32::EPSILON / 2.0, 1.0 + f32::EPSILON, 0.5];
        xs.extend((0..20_000).map(|i| i as f32 / 20_000.0));
        xs.extend((0..2_000).map(|i| 1.0 - (i as f32) * 1e-7));
        xs.resize(xs.len().next_multiple_of(16), 0.25);
        xs
    }

    #[test]
    fn lanes_with_exponents_of_their_own_have_the_bits_of_one() {
        let mixed = [0.0, 0.5, 1.0, 1.5, 2.0, 8.0, 11.0, 22.5, 100.25, 2000.0, 2000.5, 65536.0, 1e6, 3.0, 7.75, 64.0];
        for values in [mixed, [3.0; LANES], std::array::from_fn(|lane| lane as f32)] {
            let exponents = ExponentLanes::new(values);
            for bases in bases().chunks_exact(LANES) {
                let of_lanes: [f32; LANES] = dispatch!(Level::new(), simd => {
                    let [power] = exponents.pow_lanes([f32x16::from_slice(simd, bases)]);
                    power.to_array()
                });
                for ((x, y), power) in bases.iter().zip(values).zip(of_lanes) {
                    assert_eq!(power.to_bits(), Exponent::new(y).pow(*x).to_bits(), "{x}^{y}");
                }
            }
        }
    }

    #[test]
    fn powers_are_accurate() {
        for y in [0.0, 0.5, 1.0, 1.5, 2.0, 8.0, 11.0, 22.5, 100.25, 2000.0, 2000.5, 65536.0, 1e6] {
            let e = Exponent::new(y);
            for x in bases() {
                let truth = pxfm::f_pow(x as f64, y as f64);
                let error = (e.pow(x) as f64 - truth).abs();
                let slope = if x > 0.0 { (y as f64) * pxfm::f_log2(x as f64).abs() } else { 0.0 };
                let chain = if (2.0 * y).fract() == 0.0 && y <= MAX_CHAIN { y as f64 } else { 0.0 };
                let allowed = truth * (3e-6 + (slope + chain) * 2.4e-7) + 1e-37;
                assert!(error <= allowed, "{x}^{y}: {} is not {truth}", e.pow(x));
            }
        }
    }

    #[test]
    fn lanes_give_the_bits_of_plain_numbers() {
        for level in [Level::new(), Level::fallback()] {
            for y in [0.0, 0.3, 1.0, 8.0, 11.0, 60.0, 17.25, 1e5 + 0.5] {
                let e = Exponent::new(y);
                for chunk in bases().chunks_exact(16) {
                    let lanes: [f32; 16] = dispatch!(level, simd => {
                        let v = f32x16::from_slice(simd, chunk);
                        let mut out = [0.0; 16];
                        let [_, power] = e.pow_lanes([v * 0.5, v]);
                        power.store_slice(&mut out);
                        out
                    });
                    for (x, lane) in chunk.iter().zip(lanes) {
                        assert_eq!(e.pow(*x).to_bits(), lane.to_bits(), "{x}^{y}");
                    }
                }
            }
        }
    }
}
