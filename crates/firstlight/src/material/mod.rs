//! Materials: how a surface turns the light that arrives into the light that leaves.

mod blinn_phong;
mod highlight;
mod lobe_lanes;
mod moments;
mod phong;
mod shading_point;

pub use blinn_phong::{BlinnPhongDesc, BlinnPhongLobe};
pub(crate) use highlight::Highlight;
pub(crate) use lobe_lanes::LobeLanes;
pub(crate) use moments::{Colors, MOMENTS, Moments, PerMoment};
pub use phong::{PhongDesc, PhongLobe};
pub(crate) use shading_point::ShadingPoint;

use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::{ColorParam, NumberParam, family};
use crate::ids::TextureId;
use crate::math::Arc;
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

/// The shape of a highlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
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
    /// A diffuse part and a highlight of some shape.
    fn classic(
        cx: &mut CompileContext,
        params: &mut impl Params,
        [diffuse, specular]: [&ColorParam; 2],
        ambient: &Option<ColorParam>,
        shininess: &NumberParam,
        lobe: LobeKind,
    ) -> Material {
        Material {
            diffuse: params.color(cx, "diffuse", diffuse),
            specular: params.color(cx, "specular", specular),
            ambient: ambient.as_ref().map(|a| params.color(cx, "ambient", a)),
            shininess: params.number(cx, "shininess", shininess, [0.0, MAX_SHININESS as f64]),
            lobe,
        }
    }

    /// That of shapes that name none.
    pub(crate) fn matte() -> Material {
        Material {
            diffuse: Param::constant(Rgb::gray(0.8)),
            specular: Param::constant(Rgb::BLACK),
            ambient: None,
            shininess: Param::constant(1.0),
            lobe: LobeKind::Phong,
        }
    }

    /// The material in numbers at one surface.
    #[inline]
    pub fn bsdf(&self, si: &SurfaceInteraction, textures: &[Texture]) -> Bsdf {
        self.evaluate(|param| param.color(si, textures) * si.color, |param| param.number(si, textures, 1.0))
    }

    /// The same on any surface, if it has no texture.
    pub(crate) fn plain_bsdf(&self) -> Option<Bsdf> {
        self.is_plain().then(|| self.evaluate(|param| param.factor, |param| param.factor))
    }

    #[inline(always)]
    fn evaluate(&self, color: impl Fn(&Param<Rgb>) -> Rgb, number: impl Fn(&Param<f32>) -> f32) -> Bsdf {
        let diffuse = color(&self.diffuse);
        // The same texture in both is looked up once: config 11 has it so everywhere
        let specular = match (self.specular.texture, self.diffuse.texture) {
            (Some(s), Some(d)) if s == d && self.specular.factor == self.diffuse.factor => diffuse,
            _ => color(&self.specular),
        };
        let lobe = if specular.is_black() {
            Lobe::None
        } else {
            let shininess = number(&self.shininess).clamp(0.0, MAX_SHININESS);
            match self.lobe {
                LobeKind::Phong => Lobe::Phong(PhongLobe::new(shininess)),
                LobeKind::BlinnPhong => Lobe::BlinnPhong(BlinnPhongLobe::new(shininess)),
            }
        };
        let ambient = self.ambient.as_ref().map_or(diffuse, color);
        Bsdf { colors: PerMoment([diffuse, specular]), ambient, lobe }
    }
}

impl Material {
    /// Whether it has no texture.
    fn is_plain(&self) -> bool {
        let ambient = self.ambient.and_then(|ambient| ambient.texture);
        [self.diffuse.texture, self.specular.texture, self.shininess.texture, ambient] == [None; 4]
    }

    /// How far its colours differ all over it, and that of its answer to ambient light, if they are the means over the
    /// footprint of a surface, whatever its size, and nothing else changes.
    pub(crate) fn contrast(&self, textures: &[Texture]) -> Option<(Colors, Rgb)> {
        let contrast = |param: &Param<Rgb>| match param.texture {
            None => Some(Rgb::BLACK),
            Some(id) => Some(textures[id.index()].contrast()? * param.factor),
        };
        let [diffuse, specular] = [contrast(&self.diffuse)?, contrast(&self.specular)?];
        let ambient = self.ambient.as_ref().map_or(Some(diffuse), contrast)?;
        self.shininess.texture.is_none().then_some((PerMoment([diffuse, specular]), ambient))
    }

    /// Whether it is the same all within a step of the footprint of a surface.
    pub(crate) fn is_even(&self, si: &SurfaceInteraction, textures: &[Texture]) -> bool {
        let even = |texture: Option<TextureId>| texture.is_none_or(|id| textures[id.index()].is_even(si));
        even(self.diffuse.texture)
            && (self.specular.texture == self.diffuse.texture || even(self.specular.texture))
            && self.ambient.is_none_or(|ambient| even(ambient.texture))
            && even(self.shininess.texture)
    }
}

/// A material in numbers, at one surface. Light arriving from `wi` leaves towards `wo` as
/// f, the sum of each moment times its colour, which is pi x BRDF x cosine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bsdf {
    /// What each moment of the light is worth: the diffuse part, the highlight.
    pub(crate) colors: Colors,
    /// Linear colour of the answer to ambient light.
    pub ambient: Rgb,
    /// The highlight.
    pub lobe: Lobe,
}

impl Bsdf {
    /// What leaves under such ambient light, beside the light of lights.
    #[inline(always)]
    pub(crate) fn base(&self, ambient: Rgb) -> Rgb {
        ambient * self.ambient
    }
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
    /// The lobe of surfaces of which some have the one and some the other, or none; `None` if they have different ones.
    pub(crate) fn with(self, other: Lobe) -> Option<Lobe> {
        match (self, other) {
            (lobe, Lobe::None) | (Lobe::None, lobe) => Some(lobe),
            (one, other) => (one == other).then_some(one),
        }
    }

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

    /// The moments of light of such a weight.
    #[inline(always)]
    pub(crate) fn moments(&self, cos_i: f32, cos_o: f32, cos_io: f32, weight: f32) -> Moments {
        PerMoment([cos_i * weight, self.eval(cos_i, cos_o, cos_io) * weight])
    }

    /// The same where it is known what the cosine makes of many lights together.
    #[inline(always)]
    pub(crate) fn moments_around(&self, cosine: f32, cos_i: f32, cos_o: f32, cos_io: f32, weight: f32) -> Moments {
        PerMoment([cosine, if matches!(self, Lobe::None) { 0.0 } else { weight * self.eval(cos_i, cos_o, cos_io) }])
    }

    /// Its kind, if there is one.
    #[inline(always)]
    pub(crate) fn kind(&self) -> Option<LobeKind> {
        match self {
            Lobe::None => None,
            Lobe::Phong(_) => Some(LobeKind::Phong),
            Lobe::BlinnPhong(_) => Some(LobeKind::BlinnPhong),
        }
    }

    /// Its exponent; 0 if there is none.
    #[inline(always)]
    pub(crate) fn shininess(&self) -> f32 {
        match self {
            Lobe::None => 0.0,
            Lobe::Phong(lobe) => lobe.exponent(),
            Lobe::BlinnPhong(lobe) => lobe.exponent(),
        }
    }

    /// What it is, at most, where the light is off the mirror's direction by these angles at least and at most, and
    /// off the viewer by `apart` at most.
    pub(crate) fn highlight(&self, [nearest, farthest]: [Arc; 2], apart: impl FnOnce() -> Arc) -> Highlight {
        match self {
            Lobe::None => Highlight::default(),
            Lobe::Phong(lobe) => {
                let at = |cos: f32| self.eval(0.0, 0.0, -cos.max(0.0));
                let sin = if farthest.cos > 0.0 { farthest.sin } else { 1.0 };
                Highlight::of_power(lobe.exponent(), at, nearest.cos, sin, [1.0, 1.0])
            }
            Lobe::BlinnPhong(lobe) => {
                // The half vector is off the normal by half of what the light is off the mirror's direction
                let half = |arc: Arc| (0.5 * (1.0 + arc.cos)).max(0.0).sqrt();
                let at = |cos: f32| {
                    let twice = 2.0 * cos.max(0.0) * cos.max(0.0) - 1.0;
                    self.eval(1.0 + twice, 0.0, twice)
                };
                let sin = (0.5 * (1.0 - farthest.cos)).max(0.0).sqrt();
                // 1 / |wi + wo|: how fast the half vector turns with the light
                let k = 1.0 / (2.0 * half(apart())).max(1e-3);
                Highlight::of_power(lobe.exponent(), at, half(nearest), sin, [k, 2.0 * k + 3.0 * k * k])
            }
        }
    }
}
