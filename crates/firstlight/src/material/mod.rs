//! Materials: how a surface turns the light that arrives into the light that leaves.

mod alpha;
mod ambient;
mod blinn_phong;
mod bsdf;
mod classic;
mod clearcoat;
mod common;
mod ggx;
mod highlight;
mod lobe_lanes;
mod metallic_roughness;
mod moments;
mod normal_mapping;
mod phong;
mod shading_point;
mod shadow_catcher;
mod unlit;
mod uv_sets;

pub use alpha::{Alpha, AlphaMode};
pub(crate) use ambient::ViewGeometry;
pub use ambient::{Ambient, AmbientDesc, AmbientGradientDesc};
pub use blinn_phong::{BlinnPhongDesc, BlinnPhongLobe};
pub use bsdf::{Bsdf, Lobe, LobeKind};
pub(crate) use bsdf::{LOBE_NUMBERS, MeanLobe};
pub use classic::Classic;
pub use clearcoat::Clearcoat;
pub use common::{MaterialCommon, MaterialCommonDesc};
pub use ggx::GgxLobe;
pub(crate) use highlight::Highlight;
pub(crate) use lobe_lanes::LobeLanes;
pub use metallic_roughness::{MetallicRoughness, MetallicRoughnessDesc};
pub(crate) use moments::{Colors, LightTerm, MOMENTS, Moments, PARTS, PerMoment};
pub use normal_mapping::{NormalFix, NormalMapping};
pub use phong::{PhongDesc, PhongLobe};
pub(crate) use shading_point::ShadingPoint;
pub use shadow_catcher::{ShadowCatcher, ShadowCatcherDesc};
pub use unlit::UnlitDesc;
pub(crate) use uv_sets::UvSetUse;

use arrayvec::ArrayVec;

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
        /// `[material.metallic-roughness.NAME]`
        MetallicRoughness(MetallicRoughnessDesc) = "metallic-roughness",
        /// `[material.unlit.NAME]`
        Unlit(UnlitDesc) = "unlit",
        /// `[material.shadow-catcher.NAME]`
        ShadowCatcher(ShadowCatcherDesc) = "shadow-catcher",
    }
}

impl MaterialDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext, params: &mut impl Params) -> Material {
        match self {
            MaterialDesc::Phong(desc) => desc.compile(cx, params),
            MaterialDesc::BlinnPhong(desc) => desc.compile(cx, params),
            MaterialDesc::MetallicRoughness(desc) => desc.compile(cx, params),
            MaterialDesc::Unlit(desc) => desc.compile(cx, params),
            MaterialDesc::ShadowCatcher(desc) => desc.compile(cx),
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
    /// The sets of texture coordinates that its textures name.
    pub(crate) uv_sets: UvSetUse,
}

/// How a material reflects light.
#[derive(Clone, Copy, Debug)]
pub enum Reflection {
    /// `phong` and `blinn-phong`.
    Classic(Classic),
    /// `metallic-roughness`.
    MetallicRoughness(MetallicRoughness),
    /// `unlit`: the radiance.
    Unlit(Param<Rgb>),
    /// `shadow-catcher`.
    ShadowCatcher(ShadowCatcher),
}

impl Material {
    /// One whose textures name no set of texture coordinates.
    pub(crate) fn new(reflection: Reflection, common: MaterialCommon) -> Material {
        Material { reflection, common, uv_sets: UvSetUse::default() }
    }

    /// That of shapes that name none.
    pub(crate) fn matte() -> Material {
        Material::new(Reflection::Classic(Classic::matte()), MaterialCommon::none())
    }

    /// The material in numbers at one surface, under such ambient light.
    #[inline(always)]
    pub fn bsdf(&self, si: &SurfaceInteraction, textures: &[Texture], ambient: &Ambient) -> Bsdf {
        let ambient = self.varies_with_view(ambient).then_some((ambient, ViewGeometry::of(si)));
        let color = |param: &Param<Rgb>| param.color(si, textures);
        // Data is filtered over the pixel's footprint, so that a lobe hardly varies within a pixel
        let number = |param: &Param<f32>| param.number(si, textures, si.footprints_per_pixel);
        let bsdf = self.evaluate(color, si.color, number, ambient, si.slope_variance);
        match self.coat_reflectance(si, textures) {
            None => bsdf,
            Some(reflected) => bsdf.weighted(1.0 - reflected),
        }
    }

    /// The clear coat at a surface, which is lit beside what is [below it](Self::bsdf).
    pub fn coat_bsdf(&self, si: &SurfaceInteraction, textures: &[Texture], ambient: &Ambient) -> Option<Bsdf> {
        let Reflection::MetallicRoughness(material) = &self.reflection else { return None };
        let number = |param: &Param<f32>| param.number(si, textures, si.footprints_per_pixel);
        let occlusion = number(&material.occlusion).clamp(0.0, 1.0);
        Some(material.coat?.evaluate(ambient, &ViewGeometry::of_coat(si), occlusion, si.coat_slope_variance, number))
    }

    /// The part of light that the clear coat reflects towards the viewer, and takes from what is below it.
    fn coat_reflectance(&self, si: &SurfaceInteraction, textures: &[Texture]) -> Option<f32> {
        let coat = self.coat()?;
        Some(coat.reflectance(&ViewGeometry::of_coat(si), |param| param.number(si, textures, si.footprints_per_pixel)))
    }

    /// Its clear coat.
    #[inline(always)]
    fn coat(&self) -> Option<&Clearcoat> {
        match &self.reflection {
            Reflection::MetallicRoughness(material) => material.coat.as_ref(),
            Reflection::Classic(_) | Reflection::Unlit(_) | Reflection::ShadowCatcher(_) => None,
        }
    }

    /// The same on any surface, if it is the same on all.
    pub(crate) fn plain_bsdf(&self, ambient: &Ambient) -> Option<Bsdf> {
        let is_plain = self.may_be_even(ambient) && self.textures().all(|texture| texture.is_none());
        is_plain.then(|| self.evaluate(|param| param.factor, Rgb::WHITE, |param| param.factor, None, 0.0))
    }

    /// The material in numbers, from the values of its parameters. `tint`: the colour of the surface itself, as of
    /// vertices, which the colour of the base is multiplied by. `ambient`: the light to which the answer varies with
    /// the directions at the surface, if it does. `slope_variance`: see [`SurfaceInteraction`].
    #[inline(always)]
    fn evaluate(
        &self,
        color: impl Fn(&Param<Rgb>) -> Rgb,
        tint: Rgb,
        number: impl Fn(&Param<f32>) -> f32,
        ambient: Option<(&Ambient, ViewGeometry)>,
        slope_variance: f32,
    ) -> Bsdf {
        match &self.reflection {
            Reflection::Classic(classic) => classic.evaluate(color, tint, number, ambient, slope_variance),
            Reflection::MetallicRoughness(material) => material.evaluate(color, tint, number, ambient, slope_variance),
            Reflection::Unlit(_) => unlit::UNLIT,
            Reflection::ShadowCatcher(catcher) => catcher.bsdf(),
        }
    }

    /// The radiance that it emits at a surface.
    #[inline]
    pub fn emission(&self, si: &SurfaceInteraction, textures: &[Texture]) -> Rgb {
        if !self.is_emissive() {
            return Rgb::BLACK;
        }
        let emissive = self.common.emissive.color(si, textures);
        match &self.reflection {
            Reflection::Unlit(radiance) => radiance.color(si, textures) * si.color + emissive,
            _ => emissive * (1.0 - self.coat_reflectance(si, textures).unwrap_or(0.0)),
        }
    }

    /// Whether shading normals are bent by its maps, raised, or filtered.
    pub(crate) fn refines_normals(&self) -> bool {
        let common = &self.common;
        let is_filtered = || common.specular_antialiasing || common.normal_fix == NormalFix::Raise;
        self.is_mapped() || matches!(self.reflection, Reflection::MetallicRoughness(_)) && is_filtered()
    }

    /// Whether maps bend its shading normals, or those of its coat.
    pub(crate) fn is_mapped(&self) -> bool {
        self.common.normals.is_some() || self.coat_normals().is_some()
    }

    /// What bends the shading normals of its coat.
    pub(crate) fn coat_normals(&self) -> Option<&NormalMapping> {
        self.coat()?.normals.as_ref()
    }

    /// Whether its highlight is the same where the slopes of normals vary by no more than this.
    pub(crate) fn ignores(&self, slope_variance: f32) -> bool {
        match &self.reflection {
            Reflection::MetallicRoughness(material) => material.ignores(slope_variance),
            // Filtered under maps only
            Reflection::Classic(_) | Reflection::Unlit(_) => self.common.normals.is_none(),
            Reflection::ShadowCatcher(_) => true,
        }
    }

    /// Whether the width of its highlight is that of a texture.
    pub(crate) fn has_lobe_texture(&self) -> bool {
        match &self.reflection {
            Reflection::Classic(classic) => classic.shininess.texture.is_some(),
            Reflection::MetallicRoughness(material) => material.roughness.texture.is_some(),
            Reflection::Unlit(_) | Reflection::ShadowCatcher(_) => false,
        }
    }

    /// Whether all that varies over a surface are numbers, and the width of its highlight may be one of them.
    pub(crate) fn varies_by_data(&self) -> bool {
        let has_colors = match &self.reflection {
            Reflection::Classic(classic) => classic.textures()[..3].iter().any(Option::is_some),
            Reflection::MetallicRoughness(material) => material.textures()[..2].iter().any(Option::is_some),
            Reflection::Unlit(_) => true,
            Reflection::ShadowCatcher(_) => false,
        };
        let is_lobe = self.has_lobe_texture() || self.refines_normals();
        is_lobe && !has_colors && self.is_one_bsdf() && !self.is_mapped()
    }

    /// Whether textures drive numbers of it.
    pub(crate) fn has_data(&self) -> bool {
        match &self.reflection {
            Reflection::Classic(classic) => classic.shininess.texture.is_some(),
            Reflection::MetallicRoughness(material) => material.textures()[2..].iter().any(Option::is_some),
            Reflection::Unlit(_) | Reflection::ShadowCatcher(_) => false,
        }
    }

    /// Whether it may have a highlight.
    pub(crate) fn has_lobe(&self) -> bool {
        match &self.reflection {
            Reflection::Classic(classic) => !classic.specular.factor.is_black(),
            Reflection::MetallicRoughness(_) => true,
            Reflection::Unlit(_) | Reflection::ShadowCatcher(_) => false,
        }
    }

    /// Whether it may emit light.
    pub(crate) fn is_emissive(&self) -> bool {
        matches!(self.reflection, Reflection::Unlit(_)) || !self.common.emissive.factor.is_black()
    }

    /// Whether its [`Bsdf`] is all of it: it emits no light, and has no coat.
    pub(crate) fn is_one_bsdf(&self) -> bool {
        !self.is_emissive() && self.coat().is_none()
    }

    /// Whether it may be the same all over a surface without textures.
    fn may_be_even(&self, ambient: &Ambient) -> bool {
        !self.varies_with_view(ambient) && self.is_one_bsdf()
    }

    /// Whether its answer to ambient light depends on the normal or on the viewer.
    fn varies_with_view(&self, ambient: &Ambient) -> bool {
        match &self.reflection {
            Reflection::Classic(_) => !ambient.is_uniform(),
            Reflection::MetallicRoughness(_) => !ambient.is_black(),
            Reflection::Unlit(_) | Reflection::ShadowCatcher(_) => false,
        }
    }

    /// The colour of the base: what a diffuse surface reflects, a metal's own colour, what an unlit surface shows.
    pub(crate) fn albedo(&self, si: &SurfaceInteraction, textures: &[Texture]) -> Rgb {
        let color = match &self.reflection {
            Reflection::Classic(classic) => &classic.diffuse,
            Reflection::MetallicRoughness(material) => &material.base_color,
            Reflection::Unlit(radiance) => radiance,
            Reflection::ShadowCatcher(_) => return Rgb::BLACK,
        };
        color.color(si, textures) * si.color
    }

    /// The roughness of its highlight, 0 to 1: that of GGX; of a power of a cosine the one of the same width. 1 without
    /// a highlight.
    pub(crate) fn roughness(&self, si: &SurfaceInteraction, textures: &[Texture]) -> f32 {
        match &self.reflection {
            Reflection::Classic(classic) => classic.roughness(si, textures),
            Reflection::MetallicRoughness(material) => {
                material.roughness.number(si, textures, si.footprints_per_pixel).clamp(0.0, 1.0)
            }
            Reflection::Unlit(_) | Reflection::ShadowCatcher(_) => 1.0,
        }
    }

    /// How much of a metal it is, 0 to 1.
    pub(crate) fn metallic(&self, si: &SurfaceInteraction, textures: &[Texture]) -> f32 {
        match &self.reflection {
            Reflection::MetallicRoughness(material) => {
                material.metallic.number(si, textures, si.footprints_per_pixel).clamp(0.0, 1.0)
            }
            Reflection::Classic(_) | Reflection::Unlit(_) | Reflection::ShadowCatcher(_) => 0.0,
        }
    }

    /// The textures of its parameters, those of its common ones first.
    fn textures(&self) -> impl Iterator<Item = Option<TextureId>> {
        let mut all = ArrayVec::<_, 12>::from_iter(self.common.textures());
        match &self.reflection {
            Reflection::Classic(classic) => all.extend(classic.textures()),
            Reflection::MetallicRoughness(material) => all.extend(material.textures()),
            Reflection::Unlit(radiance) => all.push(radiance.texture),
            Reflection::ShadowCatcher(_) => {}
        }
        all.extend(self.coat().into_iter().flat_map(Clearcoat::textures));
        all.into_iter()
    }

    /// How far its colours differ all over it, and that of its answer to ambient light, if they are the means over the
    /// footprint of a surface, whatever its size, and nothing else changes.
    pub(crate) fn contrast(&self, textures: &[Texture]) -> Option<(Colors, Rgb)> {
        let contrast = |param: &Param<Rgb>| match param.texture {
            None => Some(Rgb::BLACK),
            Some(id) => Some(textures[id.index()].contrast()? * param.factor),
        };
        if !self.is_one_bsdf() {
            return None;
        }
        match &self.reflection {
            Reflection::Classic(classic) => classic.contrast(contrast),
            Reflection::MetallicRoughness(material) => material.contrast(contrast),
            Reflection::Unlit(_) => None,
            Reflection::ShadowCatcher(_) => Some((Colors::BLACK, Rgb::BLACK)),
        }
    }

    /// Whether it is the same all within a step of the footprint of a surface.
    pub(crate) fn is_even(&self, si: &SurfaceInteraction, textures: &[Texture], ambient: &Ambient) -> bool {
        if !self.may_be_even(ambient) {
            return false;
        }
        let mut before = None;
        self.textures().flatten().all(|id| {
            // Textures of several parameters in a row are looked at once
            let is_known = before.replace(id) == Some(id);
            is_known || textures[id.index()].is_even(si)
        })
    }
}
