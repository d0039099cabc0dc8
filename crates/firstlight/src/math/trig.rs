//! Sine, cosine and arc sine, in lanes and not: only + - x / and square root, so that every processor agrees.

use std::f32::consts::FRAC_PI_2;
use std::f64::consts::TAU;

use fearless_simd::{f32x16, prelude::*};

/// Sine and cosine of angles from -pi/2 to pi/2, to within 2e-7, by their Taylor series.
#[inline(always)]
pub(crate) fn sin_cos<S: Simd>(a: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
    const SIN: [f32; 5] = [-1.0 / 39_916_800.0, 1.0 / 362_880.0, -1.0 / 5_040.0, 1.0 / 120.0, -1.0 / 6.0];
    const COS: [f32; 6] =
        [1.0 / 479_001_600.0, -1.0 / 3_628_800.0, 1.0 / 40_320.0, -1.0 / 720.0, 1.0 / 24.0, -1.0 / 2.0];
    let (simd, aa) = (a.token(), a * a);
    let (mut sin, mut cos) = (simd.splat_f32x16(SIN[0]), simd.splat_f32x16(COS[0]));
    for factor in &SIN[1..] {
        sin = sin * aa + *factor;
    }
    for factor in &COS[1..] {
        cos = cos * aa + *factor;
    }
    (a + a * (aa * sin), cos * aa + 1.0)
}

/// Sine and cosine of so many full turns, from -1 to 1, to within 4e-16, by their Taylor series.
#[inline(always)]
pub(crate) fn sin_cos_of_turns(turns: f64) -> (f64, f64) {
    // Factors of the squares of angles up to an eighth of a turn, from the last
    const SIN: [f64; 7] = [
        1.0 / 1_307_674_368_000.0,
        -1.0 / 6_227_020_800.0,
        1.0 / 39_916_800.0,
        -1.0 / 362_880.0,
        1.0 / 5_040.0,
        -1.0 / 120.0,
        1.0 / 6.0,
    ];
    const COS: [f64; 8] = [
        1.0 / 20_922_789_888_000.0,
        -1.0 / 87_178_291_200.0,
        1.0 / 479_001_600.0,
        -1.0 / 3_628_800.0,
        1.0 / 40_320.0,
        -1.0 / 720.0,
        1.0 / 24.0,
        -1.0 / 2.0,
    ];
    let quarters = (4.0 * turns).round();
    let a = (turns - 0.25 * quarters) * TAU;
    let aa = a * a;
    let series = |factors: &[f64]| factors.iter().fold(0.0, |sum, factor| sum * aa + factor);
    let (sin, cos) = (a - a * (aa * series(&SIN)), series(&COS) * aa + 1.0);
    // Without branches, so that loops become lanes
    let quarter = quarters as i32;
    let (sin, cos) = if quarter & 1 == 0 { (sin, cos) } else { (cos, sin) };
    (if quarter & 2 == 0 { sin } else { -sin }, if (quarter + 1) & 2 == 0 { cos } else { -cos })
}

/// The angle from -pi/2 to pi/2 whose sine is `v`, from -1 to 1; beyond, that of the nearer end.
///
/// Source: of the polynomial, Moshier, "Cephes", 1992, `asinf`; of the half angle, Abramowitz, Stegun, "Handbook of
/// Mathematical Functions", 1964, 4.3.20.
#[inline(always)]
pub(crate) fn asin<S: Simd>(v: f32x16<S>) -> f32x16<S> {
    const ARC: [f32; 5] = [4.216_32e-2, 2.418_131e-2, 4.547_002_6e-2, 7.495_300_3e-2, 1.666_675_2e-1];
    let simd = v.token();
    let size = v.abs().min(simd.splat_f32x16(1.0));
    let is_large = size.simd_gt(0.5);
    let half = (1.0 - size) * 0.5;
    let zz = is_large.select(half, size * size);
    let z = is_large.select(half.sqrt(), size);
    let mut arc = simd.splat_f32x16(ARC[0]);
    for factor in &ARC[1..] {
        arc = arc * zz + *factor;
    }
    let arc = z + z * (zz * arc);
    is_large.select(FRAC_PI_2 - (arc + arc), arc).copysign(v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::dispatch_wide;

    #[test]
    fn they_are_those_of_the_turns() {
        for i in -4000..=4000 {
            let turns = f64::from(i) / 4000.0;
            let (sin, cos) = pxfm::f_sincos(TAU * turns);
            let (one, other) = sin_cos_of_turns(turns);
            // The angle itself is rounded
            assert!((one - sin).abs() < 2e-15 && (other - cos).abs() < 2e-15, "{turns}: {one} {other}");
        }
        assert_eq!([0.0, 0.25, 0.5, 0.75].map(sin_cos_of_turns), [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)]);
    }

    #[test]
    fn they_are_those_of_the_angle() {
        for i in 0..=1000 {
            let angle = f64::from(i - 500) * (std::f64::consts::FRAC_PI_2 / 500.0);
            let (sin, cos) = pxfm::f_sincos(f64::from(angle as f32));
            let [one, other, arc] = dispatch_wide!(fearless_simd::Level::new(), simd => {
                let (one, other) = sin_cos(simd.splat_f32x16(angle as f32));
                [one, other, asin(simd.splat_f32x16(sin as f32))].map(|v| f64::from(v.to_array()[0]))
            });
            assert!((one - sin).abs() < 2e-7 && (other - cos).abs() < 2e-7, "{angle}: {one} {other}");
            // Where the sine hardly grows, its rounding makes more of the angle
            let room = 3e-7 + 1e-7 / (cos + 3e-4);
            assert!((arc - angle).abs() < room, "{angle}: {arc}");
        }
    }
}
