//! Spot lights.

use pxfm::f_sin;

use super::{Falloff, Light, LightKind, light_table, scaled};
use crate::context::{CompileContext, show};
use crate::math::{DVec3, Vec3};
use crate::transform::TransformDesc;

light_table! {
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
        /// In metres, world space.
        pub position: [f64; 3],
        /// The point at the middle of the cone; not `position` itself.
        pub look_at: [f64; 3] = [0.0, 0.0, 0.0],
        /// Where it is moved; it moves `position` and `look_at`. The cone stays as wide, whatever the scale.
        pub transform: Option<Box<TransformDesc>> = None,
        /// Where the light ends: the cone's full angle in degrees, in (0, 180].
        pub cone_deg: f64 = 60.0,
        /// Where the light begins to fade: a full angle in degrees, from 0 to `cone_deg`; without it, `cone_deg` itself
        /// and a hard rim.
        pub inner_cone_deg: Option<f64> = None,
    }
    /// Candela on the axis (physical), or a plain factor (constant); 0 to 1e15.
    strength
}

/// A spot light, compiled.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Where it is.
    pub position: Vec3,
    /// Unit, the middle of the cone, away from the light.
    pub axis: Vec3,
    /// 1 - cos of half the cone's full angle. Cosines near 1 have no digits left for a narrow cone, this has.
    pub outer: f32,
    /// 1 / (cos inner - cos outer); infinite for a hard rim.
    pub inverse_fade: f32,
    /// Whether light weakens with the square of the distance.
    pub physical: bool,
}

impl SpotDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Light {
        cx.point("position", self.position);
        cx.point("look_at", self.look_at);
        let (mut from, mut to) = (DVec3::from(self.position), DVec3::from(self.look_at));
        if let Some(world_from_object) = TransformDesc::compile_field(self.transform.as_deref(), cx) {
            (from, to) = (cx.moved_point(world_from_object, from), cx.moved_point(world_from_object, to));
        }
        let axis = to - from;
        if !(axis.length() >= 1e-9) {
            let (to, from) = (show(&to.to_array()), show(&from.to_array()));
            let message = format!("{to} is the light's position {from}: the cone has no axis");
            cx.error("look_at", message, Some("move one of them"));
        }
        let hint = "the cone is the full angle, not half";
        if !(self.cone_deg > 0.0 && self.cone_deg <= 180.0) {
            cx.error("cone_deg", format!("{} is outside (0, 180]", self.cone_deg), Some(hint));
        }
        let inner = self.inner_cone_deg.unwrap_or(self.cone_deg);
        if !(inner >= 0.0 && inner <= self.cone_deg) {
            let message = format!("{inner} is outside [0, {}], the cone itself", self.cone_deg);
            cx.error("inner_cone_deg", message, Some("full strength ends inside the cone; both are full angles"));
        }
        cx.advise_radians("cone_deg", self.cone_deg);
        cx.advise_radians("inner_cone_deg", if self.inner_cone_deg.is_some() { inner } else { 0.0 });
        // 1 - cos(a / 2) = 2 sin^2(a / 4)
        let one_minus_cos = |deg: f64| {
            let sin = f_sin(deg * 0.25 * std::f64::consts::PI / 180.0);
            2.0 * sin * sin
        };
        let (outer, inner) = (one_minus_cos(self.cone_deg), one_minus_cos(inner));
        let scale = scaled(cx, self.color, self.strength, self.falloff.factor());
        let kind = LightKind::Spot(Spot {
            position: cx.local(from).as_vec3(),
            axis: axis.normalize_or_zero().as_vec3(),
            outer: outer as f32,
            inverse_fade: (1.0 / (outer - inner)) as f32,
            physical: self.falloff == Falloff::Physical,
        });
        Light::new(kind, [scale; 2], self.shadows, false)
    }
}

impl Spot {
    /// The cone's fade, times 1 / d^2 where it is physical. `l` points to the light.
    #[inline(always)]
    pub(crate) fn weight(&self, l: Vec3, inverse_distance: f32) -> f32 {
        // cos t - cos outer, t being the angle from the axis: 1 - cos t is half the square of the way between two unit
        // vectors
        let between = self.axis + l * inverse_distance;
        let inside = self.outer - 0.5 * between.dot(between);
        // A hard rim has an infinite slope: the product is infinite inside and no number on the rim itself
        let fade = if inside > 0.0 { (inside * self.inverse_fade).min(1.0) } else { 0.0 };
        let cone = fade * fade;
        if self.physical { cone * (inverse_distance * inverse_distance) } else { cone }
    }

    /// [`Light::rim_turn`].
    pub(crate) fn rim_turn(&self, l: Vec3, reach: f32) -> f32 {
        let near = (l.length() - reach).max(0.0);
        let swing = 2.0 * reach / near.max(f32::MIN_POSITIVE);
        let cos = 1.0 - (-l).normalize_or_zero().dot(self.axis);
        if (cos - self.outer).abs() < 2.0 * swing {
            return f32::INFINITY;
        }
        swing * (2.0 * self.inverse_fade.min(1e6)).sqrt()
    }
}
