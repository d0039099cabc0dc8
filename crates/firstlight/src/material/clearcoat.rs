//! A clear coat over another material.

use super::{Ambient, Bsdf, GgxLobe, Lobe, NormalMapping, PerMoment, ViewGeometry};
use crate::color::Rgb;
use crate::ids::TextureId;
use crate::texture::Param;

/// A layer of lacquer: an interface of index 1.5 above the material. It reflects F = strength (0.04 + 0.96 (1 -
/// n.wo)^5) times its highlight of microfacets, and what is below it is seen through the rest, 1 - F.
///
/// Source: the extension KHR_materials_clearcoat of glTF 2.0.
#[derive(Clone, Copy, Debug)]
pub struct Clearcoat {
    pub(super) strength: Param<f32>,
    pub(super) roughness: Param<f32>,
    /// What bends its shading normal: the maps of the material do not.
    pub(super) normals: Option<NormalMapping>,
}

/// The reflectance of an interface of index 1.5 seen from the front.
const F0: f32 = 0.04;

impl Clearcoat {
    /// The part of the light of all directions that it reflects towards the viewer, 0 to 1.
    pub(super) fn reflectance(&self, view: &ViewGeometry, number: impl Fn(&Param<f32>) -> f32) -> f32 {
        let off = 1.0 - view.cos_o().min(1.0);
        let off2 = off * off;
        number(&self.strength).clamp(0.0, 1.0) * (F0 + (1.0 - F0) * (off2 * off2 * off))
    }

    /// The coat in numbers, as a surface by itself; `occlusion` is the part of ambient light that arrives, and
    /// `slope_variance` that of the normals of the coat within the pixel.
    pub(super) fn evaluate(
        &self,
        ambient: &Ambient,
        view: &ViewGeometry,
        occlusion: f32,
        slope_variance: f32,
        number: impl Fn(&Param<f32>) -> f32,
    ) -> Bsdf {
        let reflectance = Rgb::gray(self.reflectance(view, &number));
        let lobe = GgxLobe::new(number(&self.roughness).clamp(0.0, 1.0), 0.0).widened(slope_variance);
        let [near, grazing] = lobe.white_albedo(view.cos_o());
        let ambient = ambient.answer(view, Rgb::BLACK, reflectance * (near + grazing)) * occlusion;
        Bsdf { colors: PerMoment([Rgb::BLACK, reflectance, reflectance]), ambient, lobe: Lobe::Ggx(lobe) }
    }

    /// The textures of its parameters.
    pub(super) fn textures(&self) -> [Option<TextureId>; 3] {
        let map = self.normals.and_then(|normals| normals.map);
        [self.strength.texture, self.roughness.texture, map.map(|(texture, _)| texture)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    #[test]
    fn a_coat_reflects_what_the_extension_says() {
        let (strength, roughness) = (0.7, 0.4);
        let coat =
            Clearcoat { strength: Param::constant(strength), roughness: Param::constant(roughness), normals: None };
        let (ns, wo, wi) = (Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.48, 0.64, 0.6));
        let view = ViewGeometry::new(ns, wo);
        let bsdf = coat.evaluate(&Ambient::default(), &view, 1.0, 0.0, |param| param.factor);
        let moments = bsdf.lobe.eval(wi.z, wo.z, wi.dot(wo));
        let found = f64::from(bsdf.colors.of(&moments).r);
        // F(n.wo) D V (n.wi) pi, in another form
        let half = (wi + wo).normalize();
        let a2 = f64::from(roughness * roughness * roughness * roughness);
        let (i, o, h) = (f64::from(wi.z), f64::from(wo.z), f64::from(half.z));
        let d = a2 / (std::f64::consts::PI * (h * h * (a2 - 1.0) + 1.0) * (h * h * (a2 - 1.0) + 1.0));
        let v = 0.5 / (i * (o * o * (1.0 - a2) + a2).sqrt() + o * (i * i * (1.0 - a2) + a2).sqrt());
        let f = f64::from(strength) * (0.04 + 0.96 * 0.00032);
        let expected = f * d * v * i * std::f64::consts::PI;
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
        assert!((f64::from(coat.reflectance(&view, |param| param.factor)) - f).abs() < 1e-7);
    }

    #[test]
    fn a_coat_at_a_grazing_angle_reflects_all_light() {
        let coat = Clearcoat { strength: Param::constant(1.0), roughness: Param::constant(0.0), normals: None };
        let view = ViewGeometry::new(Vec3::Z, Vec3::X);
        assert_eq!(coat.reflectance(&view, |param| param.factor), 1.0);
        let behind = ViewGeometry::new(Vec3::Z, -Vec3::Z);
        assert_eq!(coat.reflectance(&behind, |param| param.factor), 1.0);
    }
}
