//! Where light is asked for.

use crate::color::Rgb;
use crate::integrate::ShadingPoint;
use crate::material::{Colors, Lobe, Moments};
use crate::shape::SurfaceInteraction;

/// A place of a surface that asks for one light, by itself.
#[derive(Clone, Copy)]
pub(crate) struct ArrivalPlace<'a> {
    pub si: &'a SurfaceInteraction,
    pub lobe: &'a Lobe,
    /// How far the patch reaches from its middle, in metres; 0 for a point.
    pub reach: f32,
    /// How far the normal turns on the way, in radians.
    pub turn: f32,
    /// The share of the pixel that it stands for: errors of its parts are as good as independent.
    pub share: f32,
    /// Whether it is known that nothing is in the way of the light, or nothing in trees.
    pub lit: bool,
    pub clear: bool,
    /// See [`ShadingPoint::part_of_points`].
    pub part_of_points: f32,
    /// What is there beside this light, at least.
    pub base: Rgb,
    /// What the two sums are multiplied with: the light's scale, and the surface's colours.
    pub scale: Rgb,
    pub reflected: Colors,
}

impl<'a> ArrivalPlace<'a> {
    /// One point, by itself; `base` and what follows as in the struct.
    pub fn point(si: &'a SurfaceInteraction, lobe: &'a Lobe, base: Rgb, scale: Rgb, reflected: Colors) -> Self {
        let (share, part_of_points) = (1.0, f32::INFINITY);
        let [lit, clear] = [false; 2];
        ArrivalPlace { si, lobe, reach: 0.0, turn: 0.0, share, lit, clear, part_of_points, base, scale, reflected }
    }

    /// What sums of the light send.
    pub fn color(&self, sums: &Moments) -> Rgb {
        self.colors().of(sums)
    }

    /// What the two sums are multiplied with, all in all.
    pub fn colors(&self) -> Colors {
        self.scale * self.reflected
    }

    pub(in crate::render) fn point_of_surface(&self) -> ShadingPoint {
        ShadingPoint {
            reach: self.reach,
            turn: self.turn,
            worth: self.colors(),
            base: self.base,
            share: self.share,
            part_of_points: self.part_of_points,
            ..ShadingPoint::of(self.si)
        }
    }
}
