//! Point lights.

use super::{Falloff, Light, LightKind, light_table, scaled};
use crate::context::CompileContext;
use crate::math::{DVec3, Vec3};
use crate::transform::TransformDesc;

light_table! {
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
        /// In metres, world space.
        pub position: [f64; 3],
        /// Where it is moved; it moves `position`.
        pub transform: Option<Box<TransformDesc>> = None,
    }
    /// Candela (physical), or a plain factor (constant); 0 to 1e15.
    strength
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
        cx.point("position", self.position);
        let mut position = DVec3::from(self.position);
        if let Some(world_from_object) = TransformDesc::compile_field(self.transform.as_deref(), cx) {
            position = cx.moved_point(world_from_object, position);
        }
        let position = cx.local(position).as_vec3();
        let scale = scaled(cx, self.color, self.strength, self.falloff.factor());
        let kind = LightKind::Point(Point { position, physical: self.falloff == Falloff::Physical });
        Light::new(kind, [scale; 2], self.shadows, false)
    }
}

impl Point {
    /// 1 / d^2, or 1.
    #[inline(always)]
    pub(crate) fn weight(&self, inverse_distance: f32) -> f32 {
        if self.physical { inverse_distance * inverse_distance } else { 1.0 }
    }
}
