//! The microfacet highlight of metallic-roughness.

use fearless_simd::{f32x16, prelude::*};

/// The parts of a surface of microfacets whose normals are distributed as Trowbridge and Reitz (GGX) have it: a
/// transmitted cosine, and a specular part that Schlick's Fresnel factor takes from f0 to f90.
///
/// With the half vector h, w = (1 - wo.h)^5, alpha the width of the distribution D, and V Smith's height-correlated
/// masking of both directions over 4 (n.wi) (n.wo):
/// - transmitted: (n.wi) (1 - `grazing` w), for the base below;
/// - f0: pi D V (n.wi) (1 - w);
/// - f90: pi D V (n.wi) w.
///
/// Sources: Walter, Marschner, Li, Torrance, "Microfacet models for refraction through rough surfaces", EGSR 2007;
/// Heitz, "Understanding the masking-shadowing function in microfacet-based BRDFs", JCGT 3(2), 2014, eq. 99; Schlick,
/// "An inexpensive BRDF model for physically-based rendering", Eurographics 1994; "glTF 2.0 specification", appendix B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GgxLobe {
    /// 0.003 to 1.
    pub(super) alpha: f32,
    /// What w takes from the light for the base, 0 to 1.
    pub(super) grazing: f32,
}

/// The least alpha. A narrower highlight is a mirror image.
const MIN_ALPHA: f32 = 0.003;
/// A part of alpha^2: what other normals in a pixel may add to it without effect, so that the highlight is one all over
/// a surface that is large in the picture. A peak is at most as much too bright: a display step of the brightest.
const UNSEEN: f32 = 0.01;
/// The least cosine to the viewer: smooth normals of facets may be turned away.
const MIN_COS: f32 = 1e-4;
/// The least square of the length of wi + wo: opposite directions have no half vector.
const MIN_LENGTH2: f32 = 1e-12;

/// w, from the square of the length of wi + wo.
#[inline(always)]
fn schlick(length2: f32) -> f32 {
    let off = (1.0 - (length2 * 0.25).sqrt()).max(0.0);
    let off2 = off * off;
    off2 * off2 * off
}

impl GgxLobe {
    /// `roughness` and `grazing` from 0 to 1.
    pub(super) fn new(roughness: f32, grazing: f32) -> Self {
        GgxLobe { alpha: (roughness * roughness).max(MIN_ALPHA), grazing }
    }

    /// Whether such a variance of the slopes of normals leaves it as it is.
    pub(super) fn ignores(&self, slope_variance: f32) -> bool {
        2.0 * slope_variance <= self.alpha * self.alpha * UNSEEN
    }

    /// The same where the slopes of normals vary as much within a pixel: alpha^2 is twice the variance of slopes.
    #[inline(always)]
    pub(super) fn widened(self, slope_variance: f32) -> Self {
        if self.ignores(slope_variance) {
            return self;
        }
        // Less what is ignored: it begins without a step
        let alpha2 = self.alpha * self.alpha;
        GgxLobe { alpha: (alpha2 + (2.0 * slope_variance - alpha2 * UNSEEN)).min(1.0).sqrt(), ..self }
    }

    /// The transmitted cosine, the f0 part and the f90 part, from the cosines n.wi > 0, n.wo and wi.wo. Never negative,
    /// never NaN.
    #[inline(always)]
    pub(super) fn eval(&self, cos_i: f32, cos_o: f32, cos_io: f32) -> [f32; 3] {
        let (alpha2, cos_o) = (self.alpha * self.alpha, cos_o.max(MIN_COS));
        let (sum, length2) = (cos_i + cos_o, (2.0 + 2.0 * cos_io).max(MIN_LENGTH2));
        let cos_h2 = ((sum * sum) / length2).min(1.0);
        // 1 / (pi D) times alpha^2, its root
        let t = (1.0 - cos_h2) + cos_h2 * alpha2;
        let rest = 1.0 - alpha2;
        let masked = cos_i * (cos_o * cos_o * rest + alpha2).sqrt() + cos_o * (cos_i * cos_i * rest + alpha2).sqrt();
        let all = (alpha2 / (t * t)) * (0.5 * cos_i / masked);
        let w = schlick(length2);
        [cos_i * (1.0 - w * self.grazing), all * (1.0 - w), all * w]
    }

    /// What the base receives of light from a direction with this cosine wi.wo.
    #[inline(always)]
    pub(super) fn transmitted(&self, cos_io: f32) -> f32 {
        1.0 - schlick((2.0 + 2.0 * cos_io).max(MIN_LENGTH2)) * self.grazing
    }

    /// [`eval`](Self::eval) in so many times sixteen lanes, each with its own parameters: the same bits.
    #[inline(always)]
    pub(super) fn eval_lanes<S: Simd, const N: usize>(
        [alpha, grazing]: [f32x16<S>; 2],
        cos_i: [f32x16<S>; N],
        cos_o: f32x16<S>,
        cos_io: [f32x16<S>; N],
    ) -> [[f32x16<S>; N]; 3] {
        let simd = cos_o.token();
        let splat = |v: f32| simd.splat_f32x16(v);
        let (alpha2, cos_o) = (alpha * alpha, cos_o.max(splat(MIN_COS)));
        let rest = 1.0 - alpha2;
        let root_o = (cos_o * cos_o * rest + alpha2).sqrt();
        let mut parts = [[splat(0.0); N]; 3];
        for i in 0..N {
            let cos_i = cos_i[i];
            let (sum, length2) = (cos_i + cos_o, (cos_io[i] * 2.0 + 2.0).max(splat(MIN_LENGTH2)));
            let cos_h2 = ((sum * sum) / length2).min(splat(1.0));
            let t = (1.0 - cos_h2) + cos_h2 * alpha2;
            // Cells of a light may reach below the horizon: the parts go on smoothly there
            let masked = cos_i.abs() * root_o + cos_o * (cos_i * cos_i * rest + alpha2).sqrt();
            let all = (alpha2 / (t * t)) * (cos_i * 0.5 / masked);
            let off = (1.0 - (length2 * 0.25).sqrt()).max(splat(0.0));
            let off2 = off * off;
            let w = off2 * off2 * off;
            parts[0][i] = cos_i * (1.0 - w * grazing);
            parts[1][i] = all * (1.0 - w);
            parts[2][i] = all * w;
        }
        parts
    }

    /// [`Lobe::sharpness`](super::Lobe::sharpness): that of the distribution near its middle. Farther off it falls as a
    /// power, more slowly.
    #[inline(always)]
    pub(super) fn sharpness(&self, cos_o: f32) -> f32 {
        // The half vector moves half as fast as the light; at grazing angles it is quicker to turn sideways
        0.5 / (self.alpha * self.alpha) / (cos_o * cos_o).max(0.01)
    }

    /// An upper bound of its parts where the half vector is off the normal by an angle with this cosine, or more.
    pub(super) fn most(&self, cos_h: f32) -> f32 {
        let alpha2 = self.alpha * self.alpha;
        let t = (1.0 - cos_h * cos_h) + cos_h * cos_h * alpha2;
        // n.wi over the masked sum is at most 1 / alpha
        ((alpha2 / (t * t)) * (0.5 / self.alpha)).max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_within_a_pixel_widen_the_highlight() {
        let lobe = GgxLobe::new(0.3, 0.5);
        assert_eq!(lobe.widened(0.0), lobe);
        // What is small is ignored, and there is no step beyond
        let alpha2 = 0.3f32 * 0.3 * 0.3 * 0.3;
        let least = 0.5 * alpha2 * UNSEEN;
        assert_eq!(lobe.widened(least * 0.999), lobe);
        assert!((lobe.widened(least * 1.001).alpha - lobe.alpha).abs() < 1e-5);
        // alpha^2 + 2 s^2
        let wide = lobe.widened(0.02);
        assert!((wide.alpha * wide.alpha - (alpha2 + 0.04)).abs() < alpha2 * 0.02, "{}", wide.alpha);
        assert_eq!(wide.grazing, lobe.grazing);
        // Toksvig's limit: normals that cancel each other leave a rough surface
        for variance in [0.5, 1e3, 1e30, f32::INFINITY] {
            assert_eq!(lobe.widened(variance).alpha, 1.0);
        }
    }
}
