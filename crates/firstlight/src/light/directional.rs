//! Directional lights.

use super::{Light, LightKind, light_table, scaled};
use crate::context::CompileContext;
use crate::math::{DVec3, Vec3};
use crate::transform::TransformDesc;

light_table! {
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
        /// The way the light travels, of any length above 1e-9.
        pub direction: [f64; 3],
        /// Where it is moved; it turns `direction`.
        pub transform: Option<Box<TransformDesc>> = None,
    }
    /// Lux (physical), or a plain factor (constant); 0 to 1e15.
    strength
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
        let kind = LightKind::Directional(Directional { to_light: to_light.as_vec3() });
        Light::new(kind, [scale; 2], self.shadows, false)
    }
}
