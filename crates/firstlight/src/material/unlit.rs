//! A surface that shows its colour, whatever the light.

use super::{Bsdf, Colors, Lobe, Material, MaterialCommonDesc, Reflection};
use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::{ColorParam, table};
use crate::texture::Params;

table! {
    /// Unlit: the surface is seen in its colour, whatever light there is. It reflects nothing, and blocks light as all
    /// do.
    ///
    /// Source: the extension KHR_materials_unlit of glTF 2.0.
    ///
    /// ```toml
    /// [material.unlit.sign]
    /// color = [1, 0.8, 0]
    /// ```
    pub struct UnlitDesc {
        /// The radiance towards every viewer: 0 or more in each channel. `emissive` is added.
        pub color: ColorParam = ColorParam::gray(0.8),
        ..common: MaterialCommonDesc,
    }
}

impl UnlitDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext, params: &mut impl Params) -> Material {
        let color = params.radiance(cx, "color", &self.color);
        let mut common = self.common.compile(cx, params);
        if common.normals.take().is_some() {
            let message = "a normal map or bump map changes nothing of what is unlit";
            cx.advise("", message, Some("take it out, or use a material that light falls on"));
        }
        Material::new(Reflection::Unlit(color), common)
    }
}

/// What a surface that reflects nothing is.
pub(super) const UNLIT: Bsdf = Bsdf { colors: Colors::BLACK, ambient: Rgb::BLACK, lobe: Lobe::None };
