//! Rectangle lights.

use super::{EmitSides, Falloff, SampleSet};
use crate::describe::{ColorDesc, table};

table! {
    /// A rectangle that shines: soft shadows.
    ///
    /// Physical: every point sends the radiance L = color x strength to its emitting side;
    /// E = integral of L cos cos' / d^2 dA. Constant: the mean over the area of color x strength.
    ///
    /// ```toml
    /// [[light.rectangle]]
    /// center = [0, 5.9, -6]
    /// e0 = [2, 0, 0]
    /// e1 = [0, 0, 2]
    /// falloff = "constant"
    /// ```
    pub struct RectangleDesc {
        /// What reports and id files call it.
        pub name: Option<String> = None,
        /// The middle, in metres, world space.
        pub center: [f64; 3],
        /// One side, full length, in metres.
        pub e0: [f64; 3],
        /// The other side, full length, in metres; perpendicular to `e0`. The front is where e0 x e1 points.
        pub e1: [f64; 3],
        /// Linear colour; channels of 0 or more.
        pub color: ColorDesc = ColorDesc::WHITE,
        /// Radiance (physical), or a plain factor (constant); 0 or more.
        pub strength: f64 = 1.0,
        /// How light weakens on its way.
        pub falloff: Falloff = Falloff::Physical,
        /// The sides that emit; without it, `front` under `physical` and `both` under `constant`.
        pub sides: Option<EmitSides> = None,
        /// Whether the camera sees it, as its colour.
        pub visible: bool = true,
        /// Whether it stops the light of others.
        pub blocks: bool = false,
        /// Whether its light can be blocked.
        pub shadows: bool = true,
        /// How many points of it are sampled, 1 to 1048576; without it, `render.samples`.
        pub samples: Option<u32> = None,
        /// How those points are laid out.
        pub set: SampleSet = SampleSet::Sobol,
        /// The seed of the sets `uniform` and `stratified`.
        pub seed: u32 = 0,
    }
}
