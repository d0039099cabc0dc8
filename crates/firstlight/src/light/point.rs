//! Point lights.

use super::{Falloff, Light, LightKind, moved_point, scaled};
use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::{ColorDesc, table};
use crate::math::Vec3;
use crate::transform::TransformDesc;

table! {
    /// Light from one point, the same in every direction.
    ///
    /// Physical: E = I cos / d^2, I = color x strength in candela. Constant: color x strength at any distance.
    ///
    /// ```toml
    /// [[light.point]]
    /// position = [0, 3, 0]
    /// strength = 10
    /// ```
    pub struct PointDesc {
        /// What reports call it.
        pub name: Option<String> = None,
        /// The group of lights that it belongs to, for buffers: `group:NAME`.
        pub group: Option<String> = None,
        /// In metres, world space.
        pub position: [f64; 3],
        /// Where it is moved; it moves `position`.
        pub transform: Option<Box<TransformDesc>> = None,
        /// Linear colour; channels of 0 or more.
        pub color: ColorDesc = ColorDesc::WHITE,
        /// Candela (physical), or a plain factor (constant); 0 to 1e15.
        pub strength: f64 = 1.0,
        /// How light weakens on its way.
        pub falloff: Falloff = Falloff::Physical,
        /// Whether its light can be blocked.
        pub shadows: bool = true,
    }
}

/// A point light, compiled.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Where it is.
    pub position: Vec3,
    /// Whether light weakens with the square of the distance.
    pub physical: bool,
}

impl PointDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Light {
        let position = moved_point(cx, "position", self.position, self.transform.as_deref());
        let scale = scaled(cx, self.color, self.strength, self.falloff.factor());
        Light {
            kind: LightKind::Point(Point { position, physical: self.falloff == Falloff::Physical }),
            scale: scale.rgb(),
            intensity: scale.rgb(),
            said: [scale; 2],
            radiance: Rgb::BLACK,
            shadows: self.shadows,
            exact: false,
        }
    }
}

impl Point {
    /// 1 / d^2, or 1.
    #[inline(always)]
    pub(crate) fn weight(&self, inverse_distance: f32) -> f32 {
        if self.physical { inverse_distance * inverse_distance } else { 1.0 }
    }
}
