//! Places that ask for light together.

use crate::material::{Highlight, Lobe};
use crate::math::{Arc, Vec3};

/// A ball of places, with all that bounds what they make of light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Zone {
    /// In metres, world space.
    pub center: Vec3,
    /// All places are as near to `center`.
    pub reach: f32,
    /// Unit, in the middle of all their shading normals and horizons.
    pub n: Vec3,
    /// How far those are from `n`, at most.
    pub turn: Arc,
    /// Unit, the direction that the middle of a highlight comes from.
    pub mirror: Vec3,
    /// How far the directions of all highlights are from `mirror`, at most.
    pub blur: Arc,
    /// Unit, to the viewer; how far others are from it.
    pub wo: Vec3,
    pub wo_turn: Arc,
    /// The highlight all share.
    pub lobe: Lobe,
}

impl Zone {
    /// What highlights are for light from the directions that are within `spread` of `d` (unit).
    pub fn highlight(&self, d: Vec3, spread: Arc) -> Highlight {
        let off = Arc::between(d, self.mirror);
        let (nearest, farthest) = (off.minus(spread).minus(self.blur), off.plus(spread).plus(self.blur));
        let apart = || Arc::between(d, self.wo).plus(spread).plus(self.wo_turn);
        self.lobe.highlight([nearest, farthest], apart)
    }
}
