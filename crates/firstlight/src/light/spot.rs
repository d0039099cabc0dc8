//! Spot lights.

use super::Falloff;
use crate::describe::{ColorDesc, table};

table! {
    /// Light from one point into a cone, with a soft rim between two angles.
    ///
    /// At the angle t from the axis: clamp((cos t - cos outer) / (cos inner - cos outer), 0, 1)^2, where `outer` and
    /// `inner` are half the full angles written here. On the axis it is a point light of the same strength.
    ///
    /// ```toml
    /// [[light.spot]]
    /// position = [0, 3, 0]
    /// look_at = [0, 0, 0]
    /// cone_deg = 40
    /// inner_cone_deg = 30
    /// strength = 20
    /// ```
    pub struct SpotDesc {
        /// What reports call it.
        pub name: Option<String> = None,
        /// In metres, world space.
        pub position: [f64; 3],
        /// The point at the middle of the cone; not `position` itself.
        pub look_at: [f64; 3] = [0.0, 0.0, 0.0],
        /// Where the light ends: the cone's full angle in degrees, in (0, 180].
        pub cone_deg: f64 = 60.0,
        /// Where the light begins to fade: a full angle in degrees, from 0 to `cone_deg`; without it, `cone_deg` itself
        /// and a hard rim.
        pub inner_cone_deg: Option<f64> = None,
        /// Linear colour; channels of 0 or more.
        pub color: ColorDesc = ColorDesc::WHITE,
        /// Candela on the axis (physical), or a plain factor (constant); 0 or more.
        pub strength: f64 = 1.0,
        /// How light weakens on its way.
        pub falloff: Falloff = Falloff::Physical,
        /// Whether its light can be blocked.
        pub shadows: bool = true,
    }
}
