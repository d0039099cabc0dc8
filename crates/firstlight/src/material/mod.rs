//! Materials: how a surface turns the light that arrives into the light that leaves.

mod blinn_phong;
mod phong;

use fearless_simd::{f32x16, prelude::*};

pub use blinn_phong::{BlinnPhongDesc, BlinnPhongLobe};
pub use phong::{PhongDesc, PhongLobe};

use crate::color::Rgb;
use crate::describe::family;
use crate::ids::TextureId;
use crate::shape::SurfaceInteraction;
use crate::texture::{Param, Texture};

family! {
    /// A material as a scene may say it.
    pub enum MaterialDesc: "material" {
        /// `[material.phong.NAME]`
        Phong(PhongDesc) = "phong",
        /// `[material.blinn-phong.NAME]`
        BlinnPhong(BlinnPhongDesc) = "blinn-phong",
    }
}

/// The shape of a highlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LobeKind {
    /// Around the mirror direction.
    Phong,
    /// Around the half vector.
    BlinnPhong,
}

/// A material, its parameters still to be looked up.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// Reflected in all directions.
    pub diffuse: Param<Rgb>,
    /// The strength of the highlight.
    pub specular: Param<Rgb>,
    /// The answer to the scene's ambient light; the diffuse colour where it is `None`.
    pub ambient: Option<Param<Rgb>>,
    /// The highlight's exponent.
    pub shininess: Param<f32>,
    /// The highlight's shape.
    pub lobe: LobeKind,
}

/// The largest exponent of a highlight.
pub(crate) const MAX_SHININESS: f32 = 1e6;

impl Material {
    /// The material in numbers at one surface.
    #[inline]
    pub fn bsdf(&self, si: &SurfaceInteraction, textures: &[Texture]) -> Bsdf {
        let diffuse = self.diffuse.color(si, textures) * si.color;
        // The same texture in both is looked up once: config 11 has it so everywhere
        let specular = match (self.specular.texture, self.diffuse.texture) {
            (Some(s), Some(d)) if s == d && self.specular.factor == self.diffuse.factor => diffuse,
            _ => self.specular.color(si, textures) * si.color,
        };
        let lobe = if specular.is_black() {
            Lobe::None
        } else {
            let shininess = self.shininess.number(si, textures).clamp(0.0, MAX_SHININESS);
            match self.lobe {
                LobeKind::Phong => Lobe::Phong(PhongLobe::new(shininess)),
                LobeKind::BlinnPhong => Lobe::BlinnPhong(BlinnPhongLobe::new(shininess)),
            }
        };
        let ambient = self.ambient.map_or(diffuse, |a| a.color(si, textures) * si.color);
        Bsdf { diffuse, specular, ambient, lobe }
    }
}

impl Material {
    /// Whether it has no texture.
    pub(crate) fn is_plain(&self) -> bool {
        let ambient = self.ambient.and_then(|ambient| ambient.texture);
        [self.diffuse.texture, self.specular.texture, self.shininess.texture, ambient] == [None; 4]
    }

    /// Whether it is the same all over the footprint of a surface, and a little beyond.
    pub(crate) fn is_even(&self, si: &SurfaceInteraction, textures: &[Texture]) -> bool {
        let even = |texture: Option<TextureId>| texture.is_none_or(|id| textures[id.index()].is_even(si));
        even(self.diffuse.texture)
            && (self.specular.texture == self.diffuse.texture || even(self.specular.texture))
            && self.ambient.is_none_or(|ambient| even(ambient.texture))
            && even(self.shininess.texture)
    }
}

/// A material in numbers, at one surface. Light arriving from `wi` leaves towards `wo` as
/// f = diffuse x `Lobes::diffuse` + specular x `Lobes::specular`, which is pi x BRDF x cosine.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    /// Linear colour of the diffuse part.
    pub diffuse: Rgb,
    /// Linear colour of the highlight.
    pub specular: Rgb,
    /// Linear colour of the answer to ambient light.
    pub ambient: Rgb,
    /// The highlight.
    pub lobe: Lobe,
}

/// A highlight in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe {
    /// No highlight.
    None,
    /// Around the mirror direction.
    Phong(PhongLobe),
    /// Around the half vector.
    BlinnPhong(BlinnPhongLobe),
}

impl Lobe {
    /// The highlight, before its colour, from the cosines n.wi > 0, n.wo >= 0 and wi.wo. Never negative, never NaN.
    #[inline(always)]
    pub fn eval(&self, cos_i: f32, cos_o: f32, cos_io: f32) -> f32 {
        match self {
            Lobe::None => 0.0,
            Lobe::Phong(lobe) => lobe.eval(cos_i, cos_o, cos_io),
            Lobe::BlinnPhong(lobe) => lobe.eval(cos_i, cos_o, cos_io),
        }
    }

    /// k, where the highlight falls as exp(-k a^2) with the angle a of the light's direction, or not as fast. `cos_o`
    /// is n.wo.
    pub(crate) fn sharpness(&self, cos_o: f32) -> f32 {
        match self {
            Lobe::None => 0.0,
            Lobe::Phong(lobe) => 0.5 * lobe.exponent(),
            // The half vector moves half as fast; at grazing angles it is quicker to turn sideways
            Lobe::BlinnPhong(lobe) => 0.125 * lobe.exponent() / (cos_o * cos_o).max(0.01),
        }
    }

    /// [`eval`](Self::eval) in so many times sixteen lanes: the same bits.
    #[inline(always)]
    pub(crate) fn eval_lanes<S: Simd, const N: usize>(
        &self,
        cos_i: [f32x16<S>; N],
        cos_o: f32x16<S>,
        cos_io: [f32x16<S>; N],
    ) -> [f32x16<S>; N] {
        match self {
            Lobe::None => [cos_o.token().splat_f32x16(0.0); N],
            Lobe::Phong(lobe) => lobe.eval_lanes(cos_i, cos_o, cos_io),
            Lobe::BlinnPhong(lobe) => lobe.eval_lanes(cos_i, cos_o, cos_io),
        }
    }
}
