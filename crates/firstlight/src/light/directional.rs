//! Directional lights.

use super::{Falloff, Light, LightKind, scaled};
use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::{ColorDesc, table};
use crate::math::{DVec3, Vec3};
use crate::transform::TransformDesc;

table! {
    /// Light from infinitely far away, all of it in one direction: the sun on a clear day.
    ///
    /// Physical: E = color x strength x cos, strength in lux on a surface facing the light. Constant: color x strength.
    ///
    /// ```toml
    /// [[light.directional]]
    /// direction = [-1, -2, -1]
    /// strength = 3
    /// ```
    pub struct DirectionalDesc {
        /// What reports call it.
        pub name: Option<String> = None,
        /// The group of lights that it belongs to, for buffers: `group:NAME`.
        pub group: Option<String> = None,
        /// The way the light travels, of any length above 1e-9.
        pub direction: [f64; 3],
        /// Where it is moved; it turns `direction`.
        pub transform: Option<Box<TransformDesc>> = None,
        /// Linear colour; channels of 0 or more.
        pub color: ColorDesc = ColorDesc::WHITE,
        /// Lux (physical), or a plain factor (constant); 0 to 1e15.
        pub strength: f64 = 1.0,
        /// How light weakens on its way.
        pub falloff: Falloff = Falloff::Physical,
        /// Whether its light can be blocked.
        pub shadows: bool = true,
    }
}

/// A directional light, compiled.
#[derive(Clone, Copy, Debug)]
pub struct Directional {
    /// Unit, from any surface to the light.
    pub to_light: Vec3,
}

impl DirectionalDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Light {
        cx.edge("direction", self.direction);
        let mut direction = DVec3::from(self.direction);
        if let Some(world_from_object) = TransformDesc::compile_field(self.transform.as_deref(), cx) {
            direction = cx.moved_edge(world_from_object, "direction", direction);
        }
        let to_light = -direction.normalize_or_zero();
        let scale = scaled(cx, self.color, self.strength, self.falloff.factor());
        Light {
            kind: LightKind::Directional(Directional { to_light: to_light.as_vec3() }),
            scale: scale.rgb(),
            intensity: scale.rgb(),
            said: [scale; 2],
            radiance: Rgb::BLACK,
            shadows: self.shadows,
            exact: false,
        }
    }
}
