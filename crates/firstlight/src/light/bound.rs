//! What a light, or many together, can send at most to a zone of places, and what it sends at least.
//!
//! Everything here is in the unit of integrated light: what is multiplied with
//! [`Light::intensity`](super::Light::intensity).

use super::zone::Zone;
use super::{AreaShape, Light, LightKind};
use crate::material::Highlight;
use crate::math::{Arc, DVec3, Vec3, square};

/// How light leaves a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sends {
    /// Alike in all directions, weaker with the square of the distance: points, and spheres from outside.
    Round,
    /// The same into a cone: a spot.
    Cone,
    /// With the cosine at the light as well, to the front alone.
    Flat,
    /// The same with distance, to all sides.
    Even,
    /// Anything else: only its most is known.
    Other,
    /// From infinitely far away, in one direction.
    Parallel,
}

/// Where lights are and how they shine, as far as bounds need it: of one light, or of many together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shine {
    pub sends: Sends,
    /// The least and the greatest corner of a box around all that shines; of a parallel light, its direction twice.
    pub low: Vec3,
    pub high: Vec3,
    /// Unit: normals, or axes of cones, are within `fan` of it.
    pub axis: Vec3,
    pub fan: Arc,
    /// From the axis: beyond `outer` nothing is sent, up to `inner` all of it.
    pub inner: Arc,
    pub outer: Arc,
    /// Whether nothing weakens with distance.
    pub constant: bool,
}

/// How a zone sees what shines.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ZoneSight {
    /// What a light of strength 1 sends, at most: before the cosine at the surface, and with it, and with the
    /// highlight.
    pub weight: f32,
    pub diffuse: f32,
    pub highlight: Highlight,
    /// With the cosine, at least, where `whole`.
    pub least: f32,
    /// The distance to the nearest that shines, at least.
    pub near: f32,
    /// Whether all of it is above every horizon, and every place in its full light: so it is smooth.
    pub whole: bool,
    /// How wide it is, seen from the zone: the sine, 1 if the zone is inside.
    pub width: f32,
}

impl ZoneSight {
    /// Of what sends nothing.
    const NOTHING: ZoneSight = ZoneSight {
        weight: 0.0,
        diffuse: 0.0,
        highlight: Highlight { most: 0.0, slope: 0.0, curve: 0.0 },
        least: 0.0,
        near: 0.0,
        whole: true,
        width: 0.0,
    };
}

/// Room for rounding, as a factor.
const ROOM: f32 = 1.0 + 1e-4;
/// The same for cosines.
const COS_ROOM: f32 = 1e-4;

impl Shine {
    /// Of one light, and its strength: what its intensity is multiplied with, at the distance of 1 and straight on.
    pub fn of(light: &Light) -> (Shine, f32) {
        let at = |sends: Sends, p: Vec3, constant: bool| Shine {
            sends,
            low: p,
            high: p,
            axis: Vec3::Y,
            fan: Arc::HALF_TURN,
            inner: Arc::HALF_TURN,
            outer: Arc::HALF_TURN,
            constant,
        };
        match &light.kind {
            LightKind::Point(point) => {
                let sends = if point.physical { Sends::Round } else { Sends::Even };
                (at(sends, point.position, !point.physical), 1.0)
            }
            LightKind::Directional(sun) => (at(Sends::Parallel, sun.to_light, true), 1.0),
            LightKind::Spot(spot) => {
                let sends = if spot.physical { Sends::Cone } else { Sends::Other };
                // A fade of no length has a rim that is hard
                let inner = spot.outer - 1.0 / spot.inverse_fade;
                let cone = |one_minus_cos: f32| {
                    let a = one_minus_cos.clamp(0.0, 1.0);
                    Arc { cos: 1.0 - a, sin: (a * (2.0 - a)).sqrt() }
                };
                let (inner, outer) = (cone(inner), cone(spot.outer));
                (
                    Shine { axis: spot.axis, fan: Arc::ZERO, inner, outer, ..at(sends, spot.position, !spot.physical) },
                    1.0,
                )
            }
            LightKind::Area(area) => {
                let [low, high] = area.shape.bounds();
                let room = |v: DVec3| v.abs() * 1e-7;
                let (low, high) = ((low - room(low)).as_vec3(), (high + room(high)).as_vec3());
                let round = matches!(area.shape, AreaShape::Sphere(_));
                let strength = match (&area.shape, area.physical) {
                    (_, false) => 1.0,
                    // What one direction sees of it
                    (AreaShape::Sphere(sphere), true) if !area.both_sides && light.exact => {
                        std::f64::consts::PI * sphere.radius * sphere.radius
                    }
                    (shape, true) => shape.measure(),
                };
                let sends = match (area.physical, round, area.both_sides) {
                    _ if !light.exact => Sends::Other,
                    (true, true, false) => Sends::Round,
                    (true, false, false) => Sends::Flat,
                    (false, _, true) => Sends::Even,
                    _ => Sends::Other,
                };
                let mut shine = Shine { low, high, ..at(sends, low, !area.physical) };
                if !area.both_sides
                    && let Some(n) = area.normal()
                {
                    (shine.axis, shine.fan) = (n, Arc::ZERO);
                }
                (shine, strength as f32)
            }
        }
    }

    /// Both together.
    pub fn union(&self, other: &Shine) -> Shine {
        let axis = (self.axis + other.axis).normalize_or(self.axis);
        let wide = |shine: &Shine| Arc::between(axis, shine.axis).plus(shine.fan);
        let (a, b) = (wide(self), wide(other));
        let least = |a: Arc, b: Arc| if a.cos > b.cos { a } else { b };
        let most = |a: Arc, b: Arc| if a.cos < b.cos { a } else { b };
        Shine {
            sends: if self.sends == other.sends { self.sends } else { Sends::Other },
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            axis,
            fan: most(a, b),
            inner: least(self.inner, other.inner),
            outer: most(self.outer, other.outer),
            constant: self.constant || other.constant,
        }
    }

    /// The middle of the box, and how far it reaches from there.
    pub fn ball(&self) -> (Vec3, f32) {
        let half = (self.high - self.low) * 0.5;
        (self.low + half, half.length())
    }

    /// How a zone sees it.
    pub fn sight(&self, zone: &Zone) -> ZoneSight {
        if self.sends == Sends::Parallel {
            return self.parallel(zone);
        }
        let (middle, radius) = self.ball();
        let to = middle - zone.center;
        let distance = to.length();
        let reach = radius + zone.reach;
        let gap = (to.abs() - (self.high - middle)).max(Vec3::ZERO).length();
        let near = ((gap - zone.reach) / ROOM).max(0.0);
        let inside = !(distance * ROOM > reach && reach < distance);
        let (d, width) = if inside { (zone.n, 1.0) } else { (to / distance, (reach / distance * ROOM).min(1.0)) };
        let spread = if inside { Arc::HALF_TURN } else { Arc::of_sin(width) };
        // At the surface
        let off = Arc::between(d, zone.n);
        let shift = spread.plus(zone.turn);
        let (steepest, flattest) = (off.minus(shift).cos + COS_ROOM, off.plus(shift).cos - COS_ROOM);
        if steepest <= 0.0 {
            return ZoneSight::NOTHING;
        }
        // At the light
        let away = Arc::between(-d, self.axis);
        let (least_away, most_away) = (away.minus(spread).minus(self.fan), away.plus(spread).plus(self.fan));
        let (mut emits, mut emits_least, mut whole) = (1.0f32, 1.0f32, flattest > 0.0 && !inside);
        match self.sends {
            Sends::Flat => {
                emits = (least_away.cos + COS_ROOM).clamp(0.0, 1.0);
                emits_least = (most_away.cos - COS_ROOM).max(0.0);
                whole &= emits_least > 0.0;
            }
            Sends::Cone => {
                if least_away.cos + COS_ROOM < self.outer.cos {
                    emits = 0.0;
                }
                emits_least = if most_away.cos - COS_ROOM > self.inner.cos { 1.0 } else { 0.0 };
                whole &= emits_least > 0.0;
            }
            Sends::Other => {
                // A cone that does not weaken, a front that does not, or both sides
                if least_away.cos + COS_ROOM < self.outer.cos.max(0.0) {
                    emits = if self.fan == Arc::HALF_TURN { 1.0 } else { 0.0 };
                }
                whole = false;
            }
            Sends::Round | Sends::Even => {}
            Sends::Parallel => unreachable!("seen to before"),
        }
        if emits == 0.0 {
            return ZoneSight::NOTHING;
        }
        let far = (distance + reach) * ROOM;
        let (weight, least) = if self.constant {
            (emits, emits_least)
        } else {
            (emits / square(near).max(f32::MIN_POSITIVE), emits_least / square(far))
        };
        let weight = (weight * ROOM).min(MOST);
        let diffuse = weight * steepest.min(1.0);
        let highlight = zone.highlight(d, spread);
        ZoneSight { weight, diffuse, highlight, least: least * flattest.max(0.0), near, whole, width }
    }

    fn parallel(&self, zone: &Zone) -> ZoneSight {
        let d = self.low;
        let off = Arc::between(d, zone.n);
        let (steepest, flattest) = (off.minus(zone.turn).cos + COS_ROOM, off.plus(zone.turn).cos - COS_ROOM);
        if steepest <= 0.0 {
            return ZoneSight::NOTHING;
        }
        ZoneSight {
            weight: ROOM,
            diffuse: steepest.min(1.0) * ROOM,
            highlight: zone.highlight(d, Arc::ZERO),
            least: flattest.max(0.0),
            near: f32::INFINITY,
            whole: flattest > 0.0,
            width: 0.0,
        }
    }
}

/// The most that is said of any light.
pub(crate) const MOST: f32 = 1e30;
