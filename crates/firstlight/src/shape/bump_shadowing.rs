//! Shadows of the bumps that a map stands for: without them light ends hard where the surface itself turns away from
//! it, while the bent normal still faces it.

use fearless_simd::{f32x16, prelude::*};

use crate::math::Vec3;

/// How much of the light on a surface its bumps let through.
///
/// G(wi) = 2 / (1 + sqrt(1 + alpha^2 tan^2 a)) is Smith's masking G1 of GGX. a is the angle between wi and the normal
/// of the horizon: the smooth normal on lifted points, else the geometric one. alpha^2 = tan^2 d / 8, at most 1, with d
/// the angle between the smooth normal and the bent one.
/// Source: Conty Estevez, Lecocq, Stein, "A microfacet-based shadowing function to solve the bump terminator problem",
/// Ray Tracing Gems, chapter 12, 2019.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BumpShadowing {
    /// alpha; 0 where nothing is shadowed.
    pub alpha: f32,
}

/// alpha^2 over tan^2 d.
const ALPHA2: f32 = 0.125;
/// The least alpha: normals that are bent less, by 0.16 degrees, shadow nothing.
const LEAST_ALPHA: f32 = 1e-3;

impl BumpShadowing {
    /// Of a normal `bent` off the normal `smooth`, both unit.
    pub fn new(smooth: Vec3, bent: Vec3) -> BumpShadowing {
        let cos = smooth.dot(bent).max(0.0);
        let tan2 = (1.0 - cos * cos) / (cos * cos);
        // Also where the tangent is infinite
        let alpha = (ALPHA2 * tan2).clamp(0.0, 1.0).sqrt();
        BumpShadowing { alpha: if alpha < LEAST_ALPHA { 0.0 } else { alpha } }
    }

    /// G of a direction whose cosine to the normal of the horizon is `cos`; 1 where nothing is shadowed.
    #[inline(always)]
    pub fn factor(self, cos: f32) -> f32 {
        if self.alpha == 0.0 {
            return 1.0;
        }
        let cos = cos.max(LOWEST * self.alpha);
        let sin2 = 1.0 - cos * cos;
        2.0 * cos / (cos + (cos * cos + self.alpha * self.alpha * sin2).sqrt())
    }

    /// `weight` times the factor for each cosine, with the same bits.
    #[inline(always)]
    pub fn shadowed<S: Simd>(self, weight: f32x16<S>, cos: f32x16<S>) -> f32x16<S> {
        match self.alpha {
            0.0 => weight,
            alpha => weight * BumpShadowing::factor_lanes(weight.token().splat_f32x16(alpha), cos),
        }
    }

    /// [`factor`](Self::factor) in lanes, each with its own alpha, with the same bits.
    #[inline(always)]
    pub fn factor_lanes<S: Simd>(alpha: f32x16<S>, cos: f32x16<S>) -> f32x16<S> {
        let simd = alpha.token();
        let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
        let cos = cos.max(alpha * LOWEST);
        let sin2 = one - cos * cos;
        let factor = cos * 2.0 / (cos + (cos * cos + alpha * alpha * sin2).sqrt());
        alpha.simd_gt(zero).select(factor, one)
    }
}

/// The least cosine over alpha for which the factor is computed; at 0 it is 0, and negative below. No light comes from
/// there, but the polynomials that are fitted across the horizon need a smooth continuation.
const LOWEST: f32 = -0.5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::dispatch_all;
    use crate::math::LANES;

    #[test]
    fn the_factor_is_that_of_the_paper() {
        for lean in [0.05f64, 0.3, 0.8, 1.2, 1.4] {
            let (sin, cos) = (pxfm::f_sin(lean), pxfm::f_cos(lean));
            let bent = Vec3::new(sin as f32, 0.0, cos as f32);
            let shadowing = BumpShadowing::new(Vec3::Z, bent);
            let alpha2 = (0.125 * (sin / cos) * (sin / cos)).min(1.0);
            for cos_i in [1.0f64, 0.9, 0.5, 0.1, 0.01, 1e-4] {
                let tan2 = (1.0 - cos_i * cos_i) / (cos_i * cos_i);
                let expected = 2.0 / (1.0 + (1.0 + alpha2 * tan2).sqrt());
                let found = f64::from(shadowing.factor(cos_i as f32));
                assert!((found - expected).abs() < 1e-5, "{lean} {cos_i}: {found} {expected}");
            }
            assert_eq!(shadowing.factor(0.0), 0.0);
        }
        assert_eq!(BumpShadowing::new(Vec3::Z, Vec3::X).alpha, 1.0);
        assert_eq!(BumpShadowing::new(Vec3::Z, -Vec3::Z).alpha, 1.0);
        assert_eq!(BumpShadowing::new(Vec3::Z, Vec3::Z).factor(0.0), 1.0);
    }

    #[test]
    fn lanes_have_the_same_bits() {
        let alphas: [f32; LANES] = std::array::from_fn(|lane| if lane % 5 == 0 { 0.0 } else { lane as f32 / 16.0 });
        for k in 0..50 {
            let cosines: [f32; LANES] = std::array::from_fn(|lane| (k as f32 * 0.7 + lane as f32) / 50.0 - 0.05);
            let factors: [f32; LANES] = dispatch_all!(fearless_simd::Level::new(), simd => {
                let [alpha, cos] = [alphas, cosines].map(|numbers| f32x16::simd_from(simd, numbers));
                BumpShadowing::factor_lanes(alpha, cos).to_array()
            });
            for lane in 0..LANES {
                let alone = BumpShadowing { alpha: alphas[lane] }.factor(cosines[lane]);
                assert_eq!(alone.to_bits(), factors[lane].to_bits(), "{} {}", alphas[lane], cosines[lane]);
            }
        }
    }
}
