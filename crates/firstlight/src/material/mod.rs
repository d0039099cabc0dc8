//! Materials: how a surface turns the light that arrives into the light that leaves.

mod blinn_phong;
mod bsdf;
mod classic;
mod common;
mod highlight;
mod lobe_lanes;
mod moments;
mod phong;
mod shading_point;

pub use blinn_phong::{BlinnPhongDesc, BlinnPhongLobe};
pub use bsdf::{Bsdf, Lobe, LobeKind};
pub use classic::Classic;
pub use common::{MaterialCommon, MaterialCommonDesc};
pub(crate) use highlight::Highlight;
pub(crate) use lobe_lanes::LobeLanes;
pub(crate) use moments::{Colors, LightTerm, MOMENTS, Moments, PARTS, PerMoment};
pub use phong::{PhongDesc, PhongLobe};
pub(crate) use shading_point::ShadingPoint;

use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::family;
use crate::ids::TextureId;
use crate::shape::SurfaceInteraction;
use crate::texture::{Param, Params, Texture};

family! {
    /// A material as a scene may say it.
    pub enum MaterialDesc: "material" {
        /// `[material.phong.NAME]`
        Phong(PhongDesc) = "phong",
        /// `[material.blinn-phong.NAME]`
        BlinnPhong(BlinnPhongDesc) = "blinn-phong",
    }
}

impl MaterialDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext, params: &mut impl Params) -> Material {
        match self {
            MaterialDesc::Phong(desc) => desc.compile(cx, params),
            MaterialDesc::BlinnPhong(desc) => desc.compile(cx, params),
        }
    }
}

/// A material, its parameters still to be looked up.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// How it reflects light.
    pub reflection: Reflection,
    /// What materials of all kinds have.
    pub common: MaterialCommon,
}

/// How a material reflects light.
#[derive(Clone, Copy, Debug)]
pub enum Reflection {
    /// `phong` and `blinn-phong`.
    Classic(Classic),
}

impl Material {
    /// That of shapes that name none.
    pub(crate) fn matte() -> Material {
        Material { reflection: Reflection::Classic(Classic::matte()), common: MaterialCommon::NONE }
    }

    /// The material in numbers at one surface.
    #[inline]
    pub fn bsdf(&self, si: &SurfaceInteraction, textures: &[Texture]) -> Bsdf {
        let mut bsdf = self.evaluate(|param| param.color(si, textures) * si.color, |param| param.number(si, textures));
        bsdf.emission = self.common.emission(si, textures);
        bsdf
    }

    /// The same on any surface, if it has no texture.
    pub(crate) fn plain_bsdf(&self) -> Option<Bsdf> {
        let is_plain = self.textures().all(|texture| texture.is_none());
        is_plain.then(|| {
            let bsdf = self.evaluate(|param| param.factor, |param| param.factor);
            Bsdf { emission: self.common.emissive.factor, ..bsdf }
        })
    }

    /// All but the emission, from the values of its parameters.
    #[inline(always)]
    fn evaluate(&self, color: impl Fn(&Param<Rgb>) -> Rgb, number: impl Fn(&Param<f32>) -> f32) -> Bsdf {
        let (colors, ambient, lobe) = match &self.reflection {
            Reflection::Classic(classic) => classic.evaluate(color, number),
        };
        Bsdf { colors, ambient, emission: Rgb::BLACK, lobe }
    }

    /// The textures of its parameters, those of its common ones first.
    fn textures(&self) -> impl Iterator<Item = Option<TextureId>> {
        let reflection = match &self.reflection {
            Reflection::Classic(classic) => classic.textures(),
        };
        self.common.textures().into_iter().chain(reflection)
    }

    /// How far its colours differ all over it, and that of its answer to ambient light, if they are the means over the
    /// footprint of a surface, whatever its size, and nothing else changes.
    pub(crate) fn contrast(&self, textures: &[Texture]) -> Option<(Colors, Rgb)> {
        let contrast = |param: &Param<Rgb>| match param.texture {
            None => Some(Rgb::BLACK),
            Some(id) => Some(textures[id.index()].contrast()? * param.factor),
        };
        if self.common.textures().into_iter().any(|texture| texture.is_some()) {
            return None;
        }
        match &self.reflection {
            Reflection::Classic(classic) => classic.contrast(contrast),
        }
    }

    /// Whether it is the same all within a step of the footprint of a surface.
    pub(crate) fn is_even(&self, si: &SurfaceInteraction, textures: &[Texture]) -> bool {
        let mut before = None;
        self.textures().flatten().all(|id| {
            // Textures of several parameters in a row are looked at once
            let is_known = before.replace(id) == Some(id);
            is_known || textures[id.index()].is_even(si)
        })
    }
}
