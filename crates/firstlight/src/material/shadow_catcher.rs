//! A surface that shows nothing but the shadows on it.

use super::{Bsdf, Colors, Lobe, Material, MaterialCommon, PerMoment, Reflection};
use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::table;

table! {
    /// Shadow catcher: nothing of the surface is seen but the shadows on it. It is black, with the alpha
    /// `alpha` x (1 - E / E0). E is the luminance of what arrives of all lights, weighed with the cosine at the surface
    /// as on white paper; E0 is what would arrive if nothing cast shadows. Ambient light counts in neither. What is
    /// behind it, other objects or the background, shows through by 1 - alpha. With `transparent`, the shadow is in the
    /// alpha of the picture: laid over a photograph, it darkens it.
    ///
    /// Of several catchers one behind the other the first one counts. Camera rays, ids, depths, normals, masks and
    /// framing pass it as if it was not there. It casts shadows like every surface, unless `casts_shadow` says no.
    ///
    /// ```toml
    /// [material.shadow-catcher.ground]
    ///
    /// [[plane]]
    /// point = [0, 0, 0]
    /// normal = [0, 1, 0]
    /// material = "ground"
    /// ```
    pub struct ShadowCatcherDesc {
        /// The alpha of the darkest shadow: 0 to 1. Less than 1 stands for light that comes from all around.
        pub alpha: f64 = 1.0,
        /// Whether camera rays pass through from behind, the side that normals point away from, and see no shadow
        /// there. Light is blocked from both sides all the same.
        pub single_sided: bool = false,
    }
}

impl ShadowCatcherDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Material {
        let alpha = cx.between("alpha", self.alpha, 0.0, 1.0, Some("1 lets a full shadow be black"));
        let common = MaterialCommon { single_sided: self.single_sided, ..MaterialCommon::none() };
        Material::new(Reflection::ShadowCatcher(ShadowCatcher { alpha: alpha as f32, is_lit: false }), common)
    }
}

/// A shadow catcher.
#[derive(Clone, Copy, Debug)]
pub struct ShadowCatcher {
    /// The alpha of the darkest shadow.
    pub alpha: f32,
    /// Whether it is rendered to find the light that arrives: white to lights, and of ambient light it reflects its
    /// alpha in red and 1 in green. Else it is black.
    pub(crate) is_lit: bool,
}

impl ShadowCatcher {
    /// What hides shadow catchers, and is none.
    const HOLDOUT: ShadowCatcher = ShadowCatcher { alpha: 0.0, is_lit: false };

    pub(super) fn bsdf(&self) -> Bsdf {
        if !self.is_lit {
            return super::unlit::UNLIT;
        }
        let colors = PerMoment([Rgb::WHITE, Rgb::BLACK, Rgb::BLACK]);
        Bsdf { colors, ambient: Rgb::new(self.alpha, 1.0, 0.0), lobe: Lobe::None }
    }
}

impl Material {
    /// Whether it shows nothing but shadows.
    pub(crate) fn is_shadow_catcher(&self) -> bool {
        matches!(self.reflection, Reflection::ShadowCatcher(_))
    }

    /// The same as what finds the light on shadow catchers: if it is none, it hides them as it hides all else, and is
    /// black.
    pub(crate) fn as_caught(&self) -> Material {
        let catcher = match &self.reflection {
            Reflection::ShadowCatcher(catcher) => ShadowCatcher { is_lit: true, ..*catcher },
            _ => ShadowCatcher::HOLDOUT,
        };
        let MaterialCommon { alpha, single_sided, .. } = self.common;
        let common = MaterialCommon { alpha, single_sided, ..MaterialCommon::none() };
        Material { reflection: Reflection::ShadowCatcher(catcher), common, uv_sets: self.uv_sets }
    }
}

impl Bsdf {
    /// Whether it reflects nothing.
    pub(crate) fn is_black(&self) -> bool {
        self.colors == Colors::BLACK && self.ambient.is_black()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_black_but_where_light_on_it_is_found() {
        let desc = ShadowCatcherDesc { alpha: 0.25, single_sided: true };
        let catcher = desc.compile(&mut CompileContext::default());
        let ambient = crate::material::Ambient::default();
        assert!(catcher.is_shadow_catcher() && catcher.plain_bsdf(&ambient).is_some_and(|bsdf| bsdf.is_black()));
        let caught = catcher.as_caught();
        let bsdf = caught.plain_bsdf(&ambient).expect("it has no textures");
        assert!(caught.common.single_sided && bsdf.ambient == Rgb::new(0.25, 1.0, 0.0));
        assert_eq!(bsdf.colors.0, [Rgb::WHITE, Rgb::BLACK, Rgb::BLACK]);
        // All else hides it
        assert!(Material::matte().as_caught().plain_bsdf(&ambient).is_some_and(|bsdf| bsdf.is_black()));
    }

    #[test]
    fn alpha_is_a_part() {
        let mut cx = CompileContext::default();
        ShadowCatcherDesc { alpha: 1.5, single_sided: false }.compile(&mut cx);
        assert!(cx.has_errors());
    }
}
