//! What materials of all kinds have.

use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::{ColorParam, table};
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
    }
}

/// What materials of all kinds have, their parameters still to be looked up.
#[derive(Clone, Copy, Debug)]
pub struct MaterialCommon {
    /// The radiance that the surface emits.
    pub emissive: Param<Rgb>,
}

impl MaterialCommonDesc {
    pub(super) fn compile(&self, cx: &mut CompileContext, params: &mut impl Params) -> MaterialCommon {
        let mut emissive = params.radiance(cx, "emissive", &self.emissive);
        cx.between("emissive_strength", self.emissive_strength, 0.0, MAX_EMISSION, None);
        emissive.factor = emissive.factor * self.emissive_strength as f32;
        MaterialCommon { emissive }
    }
}

impl MaterialCommon {
    /// That of materials that say nothing of it.
    pub(super) fn none() -> MaterialCommon {
        MaterialCommon { emissive: Param::constant(Rgb::BLACK) }
    }

    /// The textures of its parameters.
    pub(super) fn textures(&self) -> [Option<TextureId>; 1] {
        [self.emissive.texture]
    }
}
