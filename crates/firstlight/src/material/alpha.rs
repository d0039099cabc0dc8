//! Alpha: how much of the light behind a surface it stops.
//!
//! Light goes straight through the rest. A *mask* is a surface with holes: each texel is there or not. A *blend* is a
//! veil. Surfaces that are not opaque are met by rays only: see `scene/layers.rs`.

use crate::describe::words;
use crate::ids::TextureId;
use crate::math::Vec2;
use crate::shape::SurfaceInteraction;
use crate::texture::{Param, Texture};

words! {
    /// What is made of the alpha of a material.
    pub enum AlphaMode {
        /// Nothing: the surface stops all light.
        Opaque = "opaque",
        /// The surface is there where its alpha is `cutoff` or more, and has a hole where it is less.
        Mask = "mask",
        /// The surface stops as much of the light behind it as its alpha says.
        Blend = "blend",
    }
}

/// The alpha of a material that is not opaque.
#[derive(Clone, Copy, Debug)]
pub struct Alpha {
    /// 0 lets all light through, 1 none; of a mask the share that is there.
    pub value: Param<f32>,
    /// Of a mask: the least alpha at which the surface is there.
    pub cutoff: Option<f32>,
    /// Of a mask: the alpha before the cutoff, where vertices may have an alpha that multiplies it.
    pub unmasked: Option<Param<f32>>,
}

impl Alpha {
    /// The textures of its numbers.
    pub(super) fn textures(&self) -> [Option<TextureId>; 2] {
        [self.value.texture, self.unmasked.and_then(|alpha| alpha.texture)]
    }

    /// The part of a camera ray that the surface stops, 0 to 1: of a mask the share of the footprint that is there,
    /// where vertices have an alpha of their own 0 or 1.
    pub(crate) fn at_surface(&self, si: &SurfaceInteraction, textures: &[Texture]) -> f32 {
        if let Some(product) = self.product(|set| si.texture_point(set).0, si.alpha, textures) {
            return product;
        }
        let value = self.value.number(si, textures, 1.0);
        bounded(value * self.of_vertex(si.alpha))
    }

    /// The part of a shadow ray that the surface stops where it has such texture coordinates and vertex alpha: 0 or 1
    /// of a mask. `uv`: the coordinate of a set that a texture names, or of the one that the mesh chooses. Textures are
    /// read at their finest level.
    pub(crate) fn at_point(&self, uv: impl Fn(Option<u8>) -> Vec2, vertex: f32, textures: &[Texture]) -> f32 {
        if let Some(product) = self.product(&uv, vertex, textures) {
            return product;
        }
        let texture = self.value.texture.map(|id| &textures[id.index()]);
        let value = match (texture, self.cutoff) {
            (None, _) => self.value.factor,
            (Some(texture), None) => self.value.of(texture.at(uv(texture.uv_set))),
            (Some(texture), Some(_)) => f32::from(texture.is_solid(uv(texture.uv_set))),
        };
        bounded(value * self.of_vertex(vertex))
    }

    /// Of a mask with an alpha at the vertices: whether the product of both is there, as a number. Textures are read at
    /// their finest level.
    fn product(&self, uv: impl Fn(Option<u8>) -> Vec2, vertex: f32, textures: &[Texture]) -> Option<f32> {
        let (cutoff, alpha) = (self.cutoff?, self.unmasked.as_ref().filter(|_| vertex != 1.0)?);
        let of_texture = |texture: &Texture| alpha.of(texture.at(uv(texture.uv_set)));
        let alpha = alpha.texture.map_or(alpha.factor, |id| of_texture(&textures[id.index()]));
        Some(is_there(alpha * vertex, cutoff))
    }

    /// What the alpha of vertices multiplies.
    fn of_vertex(&self, alpha: f32) -> f32 {
        self.cutoff.map_or(alpha, |cutoff| is_there(alpha, cutoff))
    }
}

/// Whether a mask is there, as a number.
fn is_there(alpha: f32, cutoff: f32) -> f32 {
    if alpha >= cutoff { 1.0 } else { 0.0 }
}

/// From 0 to 1, also what is no number.
fn bounded(alpha: f32) -> f32 {
    if alpha > 0.0 { alpha.min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_are_there_or_not_and_blends_are_bounded() {
        let blend = Alpha { value: Param::constant(0.5), cutoff: None, unmasked: None };
        assert_eq!([0.0, 0.5, 1.0].map(|vertex| blend.at_point(|_| Vec2::ZERO, vertex, &[])), [0.0, 0.25, 0.5]);
        let bright = Alpha { value: Param::constant(3.0), ..blend };
        assert_eq!(bright.at_point(|_| Vec2::ZERO, 1.0, &[]), 1.0);
        assert_eq!(Alpha { value: Param::constant(f32::NAN), ..blend }.at_point(|_| Vec2::ZERO, 1.0, &[]), 0.0);
        // Of a mask the value is 0 or 1 already
        let mask = Alpha { value: Param::constant(1.0), cutoff: Some(0.3), unmasked: None };
        assert_eq!([0.29, 0.3, 1.0].map(|vertex| mask.at_point(|_| Vec2::ZERO, vertex, &[])), [0.0, 1.0, 1.0]);
        // With an alpha of vertices the product counts
        let thin = Alpha { unmasked: Some(Param::constant(0.5)), ..mask };
        assert_eq!([0.59, 0.61, 1.0].map(|vertex| thin.at_point(|_| Vec2::ZERO, vertex, &[])), [0.0, 1.0, 1.0]);
    }
}
