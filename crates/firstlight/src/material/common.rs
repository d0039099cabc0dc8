//! What materials of all kinds have.

use super::{Alpha, AlphaMode, NormalFix, NormalMapping};
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
        /// The name of a normal map: a texture of the kind `image` whose red, green and blue from 0 to 1 are x, y and z
        /// of unit normals from -1 to 1. x runs with u, y with v, which is up in the picture, as in glTF.
        pub normal_map: Option<String> = None,
        /// Multiplies x and y of the normal map: -10000 to 10000.
        pub normal_scale: f64 = 1.0,
        /// The height of a bump map above the surface, in units of `bump_scale`: `{ texture = "NAME" }`.
        pub bump_map: NumberParam = NumberParam::constant(0.0),
        /// Multiplies `bump_map`: metres for 1 of the texture's value, -10000 to 10000.
        pub bump_scale: f64 = 1.0,
        /// What is made of mapped normals that face away from the viewer, or mirror the viewer below the surface.
        pub normal_fix: NormalFix = NormalFix::Raise,
        /// Whether highlights are widened by as much as normals vary within a pixel: those of a normal map, and of what
        /// curves under metallic-roughness. Without it small highlights flicker from frame to frame.
        pub specular_antialiasing: bool = true,
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
    /// What bends the shading normal.
    pub normals: Option<NormalMapping>,
    /// What is made of bent normals that face away.
    pub normal_fix: NormalFix,
    /// Whether highlights are widened by as much as normals vary within a pixel.
    pub specular_antialiasing: bool,
}

impl MaterialCommonDesc {
    pub(super) fn compile(&self, cx: &mut CompileContext, params: &mut impl Params) -> MaterialCommon {
        let mut emissive = params.radiance(cx, "emissive", &self.emissive);
        cx.between("emissive_strength", self.emissive_strength, 0.0, MAX_EMISSION, None);
        emissive.factor = emissive.factor * self.emissive_strength as f32;
        let alpha = self.compile_alpha(cx, params);
        let map = (self.normal_map.as_deref(), self.normal_scale);
        let normals = NormalMapping::compile(cx, params, map, (&self.bump_map, self.bump_scale));
        let MaterialCommonDesc { single_sided, normal_fix, specular_antialiasing, .. } = *self;
        MaterialCommon { emissive, alpha, single_sided, normals, normal_fix, specular_antialiasing }
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
        MaterialCommon {
            emissive: Param::constant(Rgb::BLACK),
            alpha: None,
            single_sided: false,
            normals: None,
            normal_fix: NormalFix::Raise,
            specular_antialiasing: true,
        }
    }

    /// The textures of its parameters.
    pub(super) fn textures(&self) -> [Option<TextureId>; 3] {
        let [map, bump] = self.normals.map_or([None; 2], |normals| normals.textures());
        [self.emissive.texture, map, bump]
    }
}
