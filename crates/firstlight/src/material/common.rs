//! What materials of all kinds have.

use super::{Alpha, AlphaMode};
use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::{ColorParam, NumberParam, table};
use crate::ids::TextureId;
use crate::texture::{Param, Params};

/// The largest factor of `emissive`.
const MAX_EMISSION: f64 = 1e6;

table! {
    /// The fields that materials of all kinds have.
    pub struct MaterialCommonDesc {
        /// The radiance that the surface emits, before `emissive_strength`: 0 or more. It is seen, and lights nothing.
        pub emissive: ColorParam = ColorParam::gray(0.0),
        /// Multiplies `emissive`: 0 to 1e6.
        pub emissive_strength: f64 = 1.0,
        /// How much of the light behind the surface it stops: 0 to 1. The alpha of the vertices of a mesh multiplies
        /// it.
        pub alpha: NumberParam = NumberParam::constant(1.0),
        /// What is made of `alpha`.
        pub alpha_mode: AlphaMode = AlphaMode::Opaque,
        /// Of a mask: the least alpha at which the surface is there, 0 to 1.
        pub cutoff: f64 = 0.5,
        /// Whether camera rays pass through from behind, the side that normals point away from. Light is blocked from
        /// both sides all the same.
        pub single_sided: bool = false,
    }
}

/// What materials of all kinds have, their parameters still to be looked up.
#[derive(Clone, Copy, Debug)]
pub struct MaterialCommon {
    /// The radiance that the surface emits.
    pub emissive: Param<Rgb>,
    /// Its alpha; `None` if it is opaque.
    pub alpha: Option<Alpha>,
    /// Whether camera rays pass through from behind.
    pub single_sided: bool,
}

impl MaterialCommonDesc {
    pub(super) fn compile(&self, cx: &mut CompileContext, params: &mut impl Params) -> MaterialCommon {
        let mut emissive = params.radiance(cx, "emissive", &self.emissive);
        cx.between("emissive_strength", self.emissive_strength, 0.0, MAX_EMISSION, None);
        emissive.factor = emissive.factor * self.emissive_strength as f32;
        let alpha = self.compile_alpha(cx, params);
        MaterialCommon { emissive, alpha, single_sided: self.single_sided }
    }

    fn compile_alpha(&self, cx: &mut CompileContext, params: &mut impl Params) -> Option<Alpha> {
        let hint = "a mask is there where its alpha is this or more";
        let cutoff = cx.between("cutoff", self.cutoff, 0.0, 1.0, Some(hint));
        match self.alpha_mode {
            AlphaMode::Opaque => {
                if self.alpha != NumberParam::constant(1.0) {
                    let hint = "alpha_mode = \"mask\" makes holes of it, \"blend\" a veil";
                    cx.advise("alpha", "nothing is made of it: the material is opaque".to_owned(), Some(hint));
                }
                None
            }
            AlphaMode::Mask => {
                let share = params.mask(cx, "alpha", &self.alpha, cutoff);
                Some(Alpha { value: share, cutoff: Some(cutoff as f32), unmasked: params.unmasked(&self.alpha) })
            }
            AlphaMode::Blend => {
                let value = params.number(cx, "alpha", &self.alpha, [0.0, 1.0]);
                Some(Alpha { value, cutoff: None, unmasked: None })
            }
        }
    }
}

impl MaterialCommon {
    /// That of materials that say nothing of it.
    pub(super) fn none() -> MaterialCommon {
        MaterialCommon { emissive: Param::constant(Rgb::BLACK), alpha: None, single_sided: false }
    }

    /// The textures of its parameters.
    pub(super) fn textures(&self) -> [Option<TextureId>; 1] {
        [self.emissive.texture]
    }
}
