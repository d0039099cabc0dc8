//! Metals and dielectrics of some roughness: the material of glTF.

use super::{
    Ambient, Bsdf, Clearcoat, Colors, GgxLobe, Lobe, Material, MaterialCommonDesc, NormalMapping, PerMoment,
    Reflection, ViewGeometry,
};
use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::{ColorParam, NumberParam, table};
use crate::ids::TextureId;
use crate::texture::{Param, Params};

table! {
    /// Metallic-roughness: a dielectric of `base_color` under a clear interface, or a metal of `base_color`, or a mix,
    /// with a highlight of microfacets.
    ///
    /// f = pi x (n.wi) x mix(dielectric, metal, `metallic`); with h = normalize(wi + wo) and w = (1 - wo.h)^5,
    /// dielectric = base_color / pi (1 - max F) + V D F, F = f0 + (f90 - f0) w, f0 = min(((ior - 1) / (ior + 1))^2
    /// specular_color, 1) specular, f90 = specular; metal = V D (base_color + (1 - base_color) w). D is the
    /// distribution of Trowbridge and Reitz (GGX) with alpha = roughness^2, at least 0.003, and V Smith's
    /// height-correlated masking.
    ///
    /// A clear coat above reflects F = clearcoat (0.04 + 0.96 (1 - n.wo)^5) times pi x (n.wi) x V D of its own
    /// roughness, and all else is seen through the rest, 1 - F.
    ///
    /// Sources: "glTF 2.0 specification", appendix B; its extensions KHR_materials_ior, KHR_materials_specular and
    /// KHR_materials_clearcoat. As there, rough dielectrics may reflect more light than arrives, at grazing angles.
    ///
    /// ```toml
    /// [material.metallic-roughness.gold]
    /// base_color = [1.0, 0.77, 0.34]
    /// metallic = 1
    /// roughness = 0.3
    /// ```
    pub struct MetallicRoughnessDesc {
        /// The colour of the base or of the metal: 0 to 1 in each channel.
        pub base_color: ColorParam = ColorParam::gray(0.8),
        /// 1 for metals, 0 for dielectrics.
        pub metallic: NumberParam = NumberParam::constant(0.0),
        /// 0 to 1: the root of alpha.
        pub roughness: NumberParam = NumberParam::constant(0.5),
        /// The index of refraction of dielectrics, 1 or more; 0 reflects all light.
        pub ior: f64 = 1.5,
        /// The strength of the highlight of dielectrics, 0 to 1.
        pub specular: NumberParam = NumberParam::constant(1.0),
        /// The colour of the highlight of dielectrics seen from the front: 0 or more in each channel.
        pub specular_color: ColorParam = ColorParam::gray(1.0),
        /// The part of ambient light that arrives, 0 to 1.
        pub occlusion: NumberParam = NumberParam::constant(1.0),
        /// The strength of a clear coat, 0 to 1.
        pub clearcoat: NumberParam = NumberParam::constant(0.0),
        /// The roughness of the clear coat, 0 to 1.
        pub clearcoat_roughness: NumberParam = NumberParam::constant(0.0),
        /// The name of a normal map of the clear coat. `normal_map` and `bump_map` do not bend its normals.
        pub clearcoat_normal_map: Option<String> = None,
        /// Multiplies x and y of the normal map of the clear coat: -10000 to 10000.
        pub clearcoat_normal_scale: f64 = 1.0,
        ..common: MaterialCommonDesc,
    }
}

/// Metals and dielectrics, their parameters still to be looked up.
#[derive(Clone, Copy, Debug)]
pub struct MetallicRoughness {
    pub(super) base_color: Param<Rgb>,
    pub(super) metallic: Param<f32>,
    pub(super) roughness: Param<f32>,
    /// The reflectance of dielectrics seen from the front, before `specular_color`.
    f0: f32,
    specular: Param<f32>,
    specular_color: Param<Rgb>,
    pub(super) occlusion: Param<f32>,
    pub(super) coat: Option<Clearcoat>,
}

impl MetallicRoughnessDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext, params: &mut impl Params) -> Material {
        let hint = "1.5 is glass or plastic, 1.33 water";
        if self.ior != 0.0 {
            cx.between("ior", self.ior, 1.0, MAX_IOR, Some(hint));
        }
        let f0 = ((self.ior - 1.0) / (self.ior + 1.0)) as f32;
        let mut unit =
            |cx: &mut CompileContext, field: &str, of: &NumberParam| params.number(cx, field, of, [0.0, 1.0]);
        let [metallic, roughness] =
            [("metallic", &self.metallic), ("roughness", &self.roughness)].map(|(field, of)| unit(cx, field, of));
        let [specular, occlusion] =
            [("specular", &self.specular), ("occlusion", &self.occlusion)].map(|(field, of)| unit(cx, field, of));
        let [strength, roughness_of_coat] =
            [("clearcoat", &self.clearcoat), ("clearcoat_roughness", &self.clearcoat_roughness)]
                .map(|(field, of)| unit(cx, field, of));
        let has_coat = self.clearcoat != NumberParam::constant(0.0);
        let map = ("clearcoat_normal_map", self.clearcoat_normal_map.as_deref());
        let normals = NormalMapping::of_map(cx, params, map, ("clearcoat_normal_scale", self.clearcoat_normal_scale));
        let coat = has_coat.then_some(Clearcoat { strength, roughness: roughness_of_coat, normals });
        let base_color = params.color(cx, "base_color", &self.base_color);
        // A factor of a reflectance, which may be more than 1: the product is held to it
        let specular_color = params.radiance(cx, "specular_color", &self.specular_color);
        let f0 = f0 * f0;
        let reflection =
            MetallicRoughness { base_color, metallic, roughness, f0, specular, specular_color, occlusion, coat };
        Material::new(Reflection::MetallicRoughness(reflection), self.common.compile(cx, params))
    }
}

/// The largest index of refraction.
const MAX_IOR: f64 = 100.0;

impl MetallicRoughness {
    /// In numbers. Without `ambient` there is no ambient light.
    #[inline(always)]
    pub(super) fn evaluate(
        &self,
        color: impl Fn(&Param<Rgb>) -> Rgb,
        tint: Rgb,
        number: impl Fn(&Param<f32>) -> f32,
        ambient: Option<(&Ambient, ViewGeometry)>,
        slope_variance: f32,
    ) -> Bsdf {
        let unit = |param: &Param<f32>| number(param).clamp(0.0, 1.0);
        let (base_color, metallic, specular) =
            (color(&self.base_color) * tint, unit(&self.metallic), unit(&self.specular));
        let dielectric = (color(&self.specular_color) * self.f0).map(|f0| f0.min(1.0)) * specular;
        let strongest = dielectric.r.max(dielectric.g).max(dielectric.b);
        let colors = self.colors(base_color, metallic, specular, dielectric);
        // The base receives 1 - max F = (1 - max f0) (1 - grazing w)
        let grazing = if strongest < 1.0 { (specular - strongest) / (1.0 - strongest) } else { 0.0 };
        let lobe = GgxLobe::new(unit(&self.roughness), grazing.clamp(0.0, 1.0)).widened(slope_variance);
        let ambient = ambient.map_or(Rgb::BLACK, |(ambient, view)| {
            let [diffuse, f0, f90] = colors.0;
            let [near, grazing] = lobe.white_albedo(view.cos_o());
            ambient.answer(&view, diffuse, f0 * near + f90 * grazing) * unit(&self.occlusion)
        });
        Bsdf { colors, ambient, lobe: Lobe::Ggx(lobe) }
    }

    /// Whether its highlight is the same where the slopes of normals vary by no more than this.
    pub(super) fn ignores(&self, slope_variance: f32) -> bool {
        self.roughness.texture.is_none() && GgxLobe::new(self.roughness.factor, 0.0).ignores(slope_variance)
    }

    /// What the base, f0 and f90 are worth.
    #[inline(always)]
    fn colors(&self, base_color: Rgb, metallic: f32, specular: f32, dielectric: Rgb) -> Colors {
        let rest = 1.0 - metallic;
        let strongest = dielectric.r.max(dielectric.g).max(dielectric.b);
        let diffuse = base_color * (rest * (1.0 - strongest));
        PerMoment([diffuse, dielectric * rest + base_color * metallic, Rgb::gray(specular * rest + metallic)])
    }

    /// The textures of its parameters but those of the coat, those of colours first.
    pub(super) fn textures(&self) -> [Option<TextureId>; 6] {
        let numbers = [self.metallic, self.roughness, self.specular, self.occlusion].map(|number| number.texture);
        let [metallic, roughness, specular, occlusion] = numbers;
        [self.base_color.texture, self.specular_color.texture, metallic, roughness, specular, occlusion]
    }

    /// How far the colours of the moments differ all over it, and the answer to ambient light, where `contrast` knows
    /// that of the base colour's texture; `None` where more than the base colour varies.
    pub(super) fn contrast(&self, contrast: impl Fn(&Param<Rgb>) -> Option<Rgb>) -> Option<(Colors, Rgb)> {
        if self.textures()[1..].iter().any(|texture| texture.is_some()) {
            return None;
        }
        let color = contrast(&self.base_color)?;
        let metallic = self.metallic.factor;
        let parts = [color * (1.0 - metallic), color * metallic, Rgb::BLACK];
        Some((PerMoment(parts), parts[0] + parts[1]))
    }
}
