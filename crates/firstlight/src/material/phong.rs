//! Phong's reflection model.

use fearless_simd::{f32x16, prelude::*};

use super::{Classic, LobeKind, Material, MaterialCommonDesc, Reflection};
use crate::context::CompileContext;
use crate::describe::{ColorParam, NumberParam, table};
use crate::math::{Exponent, ExponentLanes};
use crate::texture::Params;

table! {
    /// Phong: f = diffuse max(n.wi, 0) + specular max(r.wo, 0)^shininess, r = 2 (n.wi) n - wi; the specular term is 0
    /// where n.wi <= 0.
    ///
    /// Source: Phong, "Illumination for computer generated pictures", CACM 18(6), 1975.
    ///
    /// ```toml
    /// [material.phong.red]
    /// diffuse = [0.8, 0.1, 0.1]
    /// specular = 0.4
    /// shininess = 32
    /// ```
    pub struct PhongDesc {
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

impl PhongDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext, params: &mut impl Params) -> Material {
        let colors = [&self.diffuse, &self.specular];
        let classic = Classic::new(cx, params, colors, &self.ambient, &self.shininess, LobeKind::Phong);
        Material::new(Reflection::Classic(classic), self.common.compile(cx, params))
    }
}

/// max(r.wo, 0)^shininess with r = 2 (n.wi) n - wi, so that r.wo = 2 (n.wi) (n.wo) - wi.wo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhongLobe {
    exponent: Exponent,
}

impl PhongLobe {
    /// `shininess`: 0 or more.
    pub(crate) fn new(shininess: f32) -> Self {
        PhongLobe { exponent: Exponent::new(shininess) }
    }

    /// From the cosines n.wi > 0, n.wo and wi.wo. Never negative, never NaN.
    #[inline(always)]
    pub fn eval(&self, cos_i: f32, cos_o: f32, cos_io: f32) -> f32 {
        let base = (2.0 * cos_i) * cos_o - cos_io;
        // Rounding must not lift a highlight above its own maximum
        let base = if base < 1.0 { base } else { 1.0 };
        self.exponent.pow(if base > 0.0 { base } else { 0.0 })
    }

    /// The highlight's exponent.
    #[inline(always)]
    pub(crate) fn exponent(&self) -> f32 {
        self.exponent.value()
    }

    /// [`eval`](Self::eval) in so many times sixteen lanes, each with its exponent: the same bits.
    #[inline(always)]
    pub(crate) fn eval_lanes<S: Simd, const N: usize>(
        exponents: &ExponentLanes,
        mut cos_i: [f32x16<S>; N],
        cos_o: f32x16<S>,
        cos_io: [f32x16<S>; N],
    ) -> [f32x16<S>; N] {
        let (zero, one) = (cos_o.token().splat_f32x16(0.0), cos_o.token().splat_f32x16(1.0));
        for (base, cos_io) in cos_i.iter_mut().zip(cos_io) {
            *base = (*base * 2.0) * cos_o - cos_io;
            *base = base.simd_lt(one).select(*base, one);
            *base = base.simd_gt(zero).select(*base, zero);
        }
        exponents.pow_lanes(cos_i)
    }
}
