//! Blinn's variant of Phong's reflection model.

use fearless_simd::{f32x16, prelude::*};

use super::{Classic, LobeKind, Material, MaterialCommonDesc, Reflection};
use crate::context::CompileContext;
use crate::describe::{ColorParam, NumberParam, table};
use crate::math::{Exponent, ExponentLanes};
use crate::texture::Params;

table! {
    /// Blinn-Phong: f = diffuse max(n.wi, 0) + specular max(n.h, 0)^shininess, h = normalize(wi + wo); the specular
    /// term is 0 where n.wi <= 0.
    ///
    /// Source: Blinn, "Models of light reflection for computer synthesized pictures", SIGGRAPH 1977.
    ///
    /// ```toml
    /// [material.blinn-phong.red]
    /// diffuse = [0.8, 0.1, 0.1]
    /// specular = 0.4
    /// shininess = 32
    /// ```
    pub struct BlinnPhongDesc {
        /// The fraction of light reflected in all directions: 0 to 1 in each channel conserves energy, more is allowed.
        pub diffuse: ColorParam = ColorParam::gray(0.8),
        /// The strength of the highlight; 0 or more.
        pub specular: ColorParam = ColorParam::gray(0.0),
        /// Answers the scene's ambient light, once; without it, `diffuse`.
        pub ambient: Option<ColorParam> = None,
        /// The highlight's exponent, 0 to 1000000: the larger, the smaller the highlight.
        pub shininess: NumberParam = NumberParam::constant(16.0),
        ..common: MaterialCommonDesc,
    }
}

impl BlinnPhongDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext, params: &mut impl Params) -> Material {
        let colors = [&self.diffuse, &self.specular];
        let classic = Classic::new(cx, params, colors, &self.ambient, &self.shininess, LobeKind::BlinnPhong);
        Material::new(Reflection::Classic(classic), self.common.compile(cx, params))
    }
}

/// max(n.h, 0)^shininess with h = normalize(wi + wo).
///
/// |wi + wo|^2 = 2 + 2 wi.wo, so (n.h)^2 = (n.wi + n.wo)^2 / (2 + 2 wi.wo), and (n.h)^s is that to the power s / 2: no
/// square root, and for an even whole exponent no logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlinnPhongLobe {
    half_exponent: Exponent,
}

impl BlinnPhongLobe {
    /// `shininess`: 0 or more.
    pub(crate) fn new(shininess: f32) -> Self {
        BlinnPhongLobe { half_exponent: Exponent::new(shininess * 0.5) }
    }

    /// From the cosines n.wi > 0, n.wo >= 0 and wi.wo. Never negative, never NaN.
    #[inline(always)]
    pub fn eval(&self, cos_i: f32, cos_o: f32, cos_io: f32) -> f32 {
        let sum = cos_i + cos_o;
        let length2 = 2.0 + 2.0 * cos_io;
        // Opposite directions have no half vector
        if !(length2 > 0.0) {
            return 0.0;
        }
        let base = (sum * sum) / length2;
        self.half_exponent.pow(if base < 1.0 { base } else { 1.0 })
    }

    /// The highlight's exponent.
    #[inline(always)]
    pub(crate) fn exponent(&self) -> f32 {
        2.0 * self.half_exponent.value()
    }

    /// [`eval`](Self::eval) in so many times sixteen lanes, each with half its exponent: the same bits.
    #[inline(always)]
    pub(crate) fn eval_lanes<S: Simd, const N: usize>(
        half_exponents: &ExponentLanes,
        mut cos_i: [f32x16<S>; N],
        cos_o: f32x16<S>,
        cos_io: [f32x16<S>; N],
    ) -> [f32x16<S>; N] {
        let simd = cos_o.token();
        let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
        for (base, cos_io) in cos_i.iter_mut().zip(cos_io) {
            let (sum, length2) = (*base + cos_o, cos_io * 2.0 + 2.0);
            *base = (sum * sum) / length2;
            *base = base.simd_lt(one).select(*base, one);
        }
        let mut powers = half_exponents.pow_lanes(cos_i);
        for (power, cos_io) in powers.iter_mut().zip(cos_io) {
            *power = (cos_io * 2.0 + 2.0).simd_gt(zero).select(*power, zero);
        }
        powers
    }
}
