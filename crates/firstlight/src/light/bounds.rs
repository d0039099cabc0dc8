//! Bounds of the light that one light, or a cluster of lights, contributes to a set of receivers.
//!
//! Contributions are in the unit of integrated light: a factor of [`Light::intensity`](super::Light::intensity).

use super::{AreaShape, Light, LightKind};
use crate::material::{Highlight, Lobe};
use crate::math::{Arc, DVec3, DirectionCone, Vec3, square};

/// How the light of a source depends on direction and distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EmissionProfile {
    /// 1 / d^2, the same in all directions: points, and spheres from outside.
    Isotropic,
    /// 1 / d^2 within a cone: spots.
    Cone,
    /// cos' / d^2 on the front side, cos' being the cosine at the light.
    Cosine,
    /// The same at any distance and in all directions.
    Constant,
    /// Any other: only upper bounds are known.
    Other,
    /// From infinitely far away, in one direction.
    Directional,
}

/// Where a light, or a cluster of lights, is, and into which directions it emits.
///
/// Source: Conty Estevez, Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018, section 4.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBounds {
    pub profile: EmissionProfile,
    /// The least and the greatest corner of the box around the lights, in metres, world space; of a directional light,
    /// its direction twice.
    pub low: Vec3,
    pub high: Vec3,
    /// The normals of the lights, or the axes of their cones.
    pub axes: DirectionCone,
    /// Angles from the axis of a light: up to `inner` it emits at full strength, beyond `outer` nothing.
    pub inner: Arc,
    pub outer: Arc,
    /// Whether the light of any of them is the same at any distance.
    pub constant: bool,
}

/// A set of points to be lit: bounds of their positions, normals and highlights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReceiverBounds {
    /// The ball that holds them, in metres, world space.
    pub center: Vec3,
    pub radius: f32,
    /// Their shading normals and horizons.
    pub normals: DirectionCone,
    /// The directions to the viewer, mirrored at the normals.
    pub mirrors: DirectionCone,
    /// The directions to the viewer.
    pub wo: DirectionCone,
    /// The lobe that all of them have.
    pub lobe: Lobe,
    /// Whether bumps shadow any of them: nothing bounds how fast light falls there.
    pub is_bumpy: bool,
}

/// Bounds of what a light of strength 1 contributes to the receivers.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ContributionBounds {
    /// Upper bounds: before the cosine at the receiver, and with it.
    pub max_weight: f32,
    pub max_diffuse: f32,
    /// Upper bounds of the lobe and of its derivatives.
    pub highlight: Highlight,
    /// A lower bound with the cosine at the receiver, where `is_smooth`.
    pub min_diffuse: f32,
    /// A lower bound of the distance to the light, in metres.
    pub min_distance: f32,
    /// Whether every light is above the horizon of every receiver, and emits to it at full strength: the contribution
    /// has bounded derivatives then.
    pub is_smooth: bool,
    /// The sine of the half angle under which the lights are seen; 1 if a receiver may be among them.
    pub sin_half_angle: f32,
}

/// Factor that covers the rounding of bounds.
const ROOM: f32 = 1.0 + 1e-4;
/// The same for cosines, absolute.
const COS_ROOM: f32 = 1e-4;
/// The largest upper bound: products of a few of them stay finite.
pub(crate) const MAX_CONTRIBUTION: f32 = 1e30;

impl LightBounds {
    /// The bounds of one light, and its strength: the factor of its intensity at distance 1 along its normal.
    pub fn of(light: &Light) -> (LightBounds, f32) {
        let at = |profile: EmissionProfile, p: Vec3, constant: bool| LightBounds {
            profile,
            low: p,
            high: p,
            axes: DirectionCone::SPHERE,
            inner: Arc::HALF_TURN,
            outer: Arc::HALF_TURN,
            constant,
        };
        match &light.kind {
            LightKind::Point(point) => {
                let profile = if point.physical { EmissionProfile::Isotropic } else { EmissionProfile::Constant };
                (at(profile, point.position, !point.physical), 1.0)
            }
            LightKind::Directional(sun) => (at(EmissionProfile::Directional, sun.to_light, true), 1.0),
            LightKind::Spot(spot) => {
                let profile = if spot.physical { EmissionProfile::Cone } else { EmissionProfile::Other };
                let cone = |one_minus_cos: f32| {
                    let a = one_minus_cos.clamp(0.0, 1.0);
                    Arc { cos: 1.0 - a, sin: (a * (2.0 - a)).sqrt() }
                };
                // A falloff of width 0 has an infinite inverse
                let (inner, outer) = (cone(spot.outer - 1.0 / spot.inverse_fade), cone(spot.outer));
                let axes = DirectionCone::of(spot.axis);
                (LightBounds { axes, inner, outer, ..at(profile, spot.position, !spot.physical) }, 1.0)
            }
            LightKind::Area(area) => {
                let [low, high] = area.shape.bounds();
                let room = |v: DVec3| v.abs() * 1e-7;
                let (low, high) = ((low - room(low)).as_vec3(), (high + room(high)).as_vec3());
                let round = area.shape.is_ball();
                let strength = match (&area.shape, area.physical) {
                    (_, false) => 1.0,
                    // The area of its silhouette
                    (AreaShape::Sphere(sphere), true) if !area.both_sides && light.exact => {
                        std::f64::consts::PI * sphere.radius * sphere.radius
                    }
                    (shape, true) => shape.measure(),
                };
                let profile = match (area.physical, round, area.both_sides) {
                    _ if !light.exact => EmissionProfile::Other,
                    (true, true, false) => EmissionProfile::Isotropic,
                    (true, false, false) => EmissionProfile::Cosine,
                    (false, _, true) => EmissionProfile::Constant,
                    _ => EmissionProfile::Other,
                };
                let normal = area.n.filter(|_| !area.both_sides);
                let axes = normal.map_or(DirectionCone::SPHERE, DirectionCone::of);
                (LightBounds { low, high, axes, ..at(profile, low, !area.physical) }, strength as f32)
            }
        }
    }

    /// The bounds of both together.
    pub fn union(&self, other: &LightBounds) -> LightBounds {
        let least = |a: Arc, b: Arc| if a.cos > b.cos { a } else { b };
        let most = |a: Arc, b: Arc| if a.cos < b.cos { a } else { b };
        LightBounds {
            profile: if self.profile == other.profile { self.profile } else { EmissionProfile::Other },
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            axes: self.axes.union(&other.axes),
            inner: least(self.inner, other.inner),
            outer: most(self.outer, other.outer),
            constant: self.constant || other.constant,
        }
    }

    /// The ball around the box: its center and its radius.
    pub fn ball(&self) -> (Vec3, f32) {
        let half = (self.high - self.low) * 0.5;
        (self.low + half, half.length())
    }

    /// Bounds of what the lights contribute to the receivers, whatever occludes them.
    pub fn contribution(&self, receivers: &ReceiverBounds) -> ContributionBounds {
        let (center, radius) = self.ball();
        let normals = &receivers.normals;
        let is_directional = self.profile == EmissionProfile::Directional;
        // The directions from the receivers to the lights: within `spread` of `d`
        let to = center - receivers.center;
        let (distance, reach) = (to.length(), radius + receivers.radius);
        let inside = !(is_directional || reach < distance);
        let (d, sin_half_angle) = match (is_directional, inside) {
            (true, _) => (self.low, 0.0),
            (false, true) => (normals.axis, 1.0),
            (false, false) => (to / distance, (reach / distance * ROOM).min(1.0)),
        };
        let spread = if inside { Arc::HALF_TURN } else { Arc::of_sin(sin_half_angle) };
        // The cosine at the receivers
        let off = Arc::between(d, normals.axis);
        let shift = spread.plus(normals.angle);
        let (max_cos, min_cos) = (off.minus(shift).cos + COS_ROOM, off.plus(shift).cos - COS_ROOM);
        // Of a light that does not reach the receivers
        let nothing = ContributionBounds { is_smooth: true, ..ContributionBounds::default() };
        if max_cos <= 0.0 {
            return nothing;
        }
        // The emission towards the receivers, at full strength 1
        let [min_angle, max_angle] = self.axes.angles_to(-d, spread);
        let (mut max_emission, mut min_emission, mut is_smooth) = (1.0f32, 1.0f32, min_cos > 0.0 && !inside);
        match self.profile {
            EmissionProfile::Cosine => {
                max_emission = (min_angle.cos + COS_ROOM).clamp(0.0, 1.0);
                min_emission = (max_angle.cos - COS_ROOM).max(0.0);
                is_smooth &= min_emission > 0.0;
            }
            EmissionProfile::Cone => {
                max_emission = if min_angle.cos + COS_ROOM < self.outer.cos { 0.0 } else { 1.0 };
                min_emission = if max_angle.cos - COS_ROOM > self.inner.cos { 1.0 } else { 0.0 };
                is_smooth &= min_emission > 0.0;
            }
            EmissionProfile::Other => {
                // Nothing leaves a cone or a back side, unless the lights emit into all directions
                if min_angle.cos + COS_ROOM < self.outer.cos.max(0.0) && self.axes.angle != Arc::HALF_TURN {
                    max_emission = 0.0;
                }
                is_smooth = false;
            }
            EmissionProfile::Isotropic | EmissionProfile::Constant | EmissionProfile::Directional => {}
        }
        if max_emission == 0.0 {
            return nothing;
        }
        if receivers.is_bumpy {
            (min_emission, is_smooth) = (0.0, false);
        }
        let min_distance = if is_directional {
            f32::INFINITY
        } else {
            let gap = (to.abs() - (self.high - center)).max(Vec3::ZERO).length();
            ((gap - receivers.radius) / ROOM).max(0.0)
        };
        let (weight, min_weight) = if self.constant {
            (max_emission, min_emission)
        } else {
            let max_distance = (distance + reach) * ROOM;
            (max_emission / square(min_distance).max(f32::MIN_POSITIVE), min_emission / square(max_distance))
        };
        let max_weight = (weight * ROOM).min(MAX_CONTRIBUTION);
        let viewer_angle = || receivers.wo.angles_to(d, spread)[1];
        ContributionBounds {
            max_weight,
            max_diffuse: max_weight * max_cos.min(1.0),
            highlight: receivers.lobe.highlight(receivers.mirrors.angles_to(d, spread), viewer_angle),
            min_diffuse: min_weight * min_cos.max(0.0),
            min_distance,
            is_smooth,
            sin_half_angle,
        }
    }
}
