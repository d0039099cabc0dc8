//! The integral of a sphere that no flat light stands for, by cells: over rings of its area where light does not weaken on its way,
//! over directions where it does. A sphere that nearly touches a surface does all it does within next to nothing of its area.

use std::f64::consts::TAU;

use pxfm::{f_exp, f_log, f_sincos};

use super::Sums;
use super::cells::{self, Sent, Source};
use super::mask::Masked;
use crate::light::{AreaShape, Light, LightKind, Sphere, concentric};
use crate::math::{DVec3, LANES, Vec3};

impl Masked<'_> {
    /// What arrives from a sphere for which there is no [`View`](super::View).
    pub fn by_points(&self, light: &Light, enough: &dyn Fn(&Sums, &Sums) -> bool) -> Sums {
        let LightKind::Area(area) = &light.kind else { return Sums::default() };
        let floor = light.floor(self.si.lit_from, self.si.error, self.si.horizon);
        let spot = Spot { masked: self, floor };
        match &area.shape {
            AreaShape::Sphere(sphere) if area.physical => {
                let directions = Directions::new(spot, sphere, area.both_sides);
                directions.map_or(Sums::default(), |source| cells::integrate(&source, None, enough).0)
            }
            AreaShape::Sphere(sphere) => cells::integrate(&Rings::new(spot, sphere, area.both_sides), None, enough).0,
            // These have a view
            AreaShape::Rectangle(_) | AreaShape::Disk(_) => Sums::default(),
        }
    }
}

/// Where the light is asked for.
struct Spot<'a> {
    masked: &'a Masked<'a>,
    /// [`Light::floor`].
    floor: f32,
}

impl Spot<'_> {
    /// What `weight` makes of the light that comes this way, `inverse` being one over its length; `None` from below the horizon.
    #[inline(always)]
    fn sent(&self, way: Vec3, inverse: f32, weight: f32) -> Option<Sent> {
        let si = self.masked.si;
        let height = si.ns.dot(way);
        if !(si.horizon.dot(way) > self.floor && height > 0.0 && weight > 0.0 && inverse < f32::INFINITY) {
            return None;
        }
        let cos_i = height * inverse;
        let lobe = self.masked.lobe.eval(cos_i, si.ns.dot(si.wo), si.wo.dot(way) * inverse);
        Some(Sent { way, sums: [weight * cos_i, weight * lobe] })
    }
}

/// All of the sphere, in rings around the place that is nearest to the point: the closer together the nearer they are.
struct Rings<'a> {
    spot: Spot<'a>,
    radius: f64,
    both_sides: bool,
    /// From the point to the sphere's middle.
    to: DVec3,
    /// Around what the rings lie: unit vectors, the last is the axis.
    frame: [DVec3; 3],
    /// The width of the innermost ring, and the logarithm of how many times the outermost is as wide. Widths are those of the height of
    /// a cap, for which the sphere has the radius 1: equal widths are equal areas.
    width: f64,
    growth: f64,
}

impl<'a> Rings<'a> {
    fn new(spot: Spot<'a>, sphere: &Sphere, both_sides: bool) -> Self {
        let to = sphere.center - spot.masked.si.lit_from.as_dvec3();
        let (distance, radius) = (to.length(), sphere.radius);
        let axis = (to / -distance).try_normalize().unwrap_or(DVec3::Z);
        let across = axis.any_orthonormal_vector();
        // A ring as wide as the sphere is far away
        let near = (distance - radius) / radius;
        let width = (0.5 * near * near).clamp(1e-9, 4.0);
        let growth = f_log(1.0 + 2.0 / width);
        Rings { spot, radius, both_sides, to, frame: [across, axis.cross(across), axis], width, growth }
    }
}

impl Source for Rings<'_> {
    fn series(&self) -> u32 {
        self.spot.masked.series as u32
    }

    fn sent(&self, [x, y]: [f32; 2]) -> Option<Sent> {
        let grown = f_exp(self.growth * f64::from(x));
        let drop = (self.width * (grown - 1.0)).min(2.0);
        let (wide, (sin, cos)) = ((drop * (2.0 - drop)).sqrt(), f_sincos(TAU * f64::from(y)));
        let [u, v, axis] = self.frame;
        let n = u * (wide * cos) + v * (wide * sin) + axis * (1.0 - drop);
        let way = self.to + n * self.radius;
        if !self.both_sides && n.dot(way) >= 0.0 {
            return None;
        }
        let weight = 0.5 * self.width * self.growth * grown;
        self.spot.sent(way.as_vec3(), (1.0 / way.length()) as f32, weight as f32)
    }

    fn hidden(&self, places: &[[f32; 2]; LANES], ways: &[Vec3; LANES], active: u16) -> u16 {
        self.spot.masked.hidden(places, ways, active)
    }
}

/// Equal areas of the square are equal solid angles: of the cone around the sphere, first to the near side, then to the far
/// one where both emit; or, from within, of all that is above the surface.
struct Directions<'a> {
    spot: Spot<'a>,
    /// From the point to the sphere's middle, and the square of the way to where the cone touches; below 0 within.
    to: DVec3,
    touch2: f64,
    /// Around what the directions lie: unit vectors, the last is the axis.
    frame: [DVec3; 3],
    /// One less the cosine of half the cone's angle, in which the axis lies.
    opening: f64,
    /// How many times a direction meets a side that emits.
    times: f32,
}

impl<'a> Directions<'a> {
    /// `None` if nothing emits towards the point.
    fn new(spot: Spot<'a>, sphere: &Sphere, both_sides: bool) -> Option<Self> {
        let si = spot.masked.si;
        let to = sphere.center - si.lit_from.as_dvec3();
        let distance = to.length();
        let touch2 = (distance - sphere.radius) * (distance + sphere.radius);
        let is_outside = touch2 > 0.0;
        if !is_outside && !both_sides {
            return None;
        }
        let (axis, opening) = if is_outside {
            // 1 - sqrt(1 - s), without loss where the sphere is small
            let share = (sphere.radius / distance) * (sphere.radius / distance);
            (to / distance, share / (1.0 + (1.0 - share).max(0.0).sqrt()))
        } else {
            (si.ns.as_dvec3().normalize(), 1.0)
        };
        let across = axis.any_orthonormal_vector();
        let times = if is_outside && both_sides { 2.0 } else { 1.0 };
        Some(Directions { spot, to, touch2, frame: [across, axis.cross(across), axis], opening, times })
    }
}

impl Source for Directions<'_> {
    fn series(&self) -> u32 {
        self.spot.masked.series as u32
    }

    fn sent(&self, [x, y]: [f32; 2]) -> Option<Sent> {
        let across = x * self.times;
        let is_far = across >= 1.0 || self.touch2 <= 0.0;
        let [a, b] = concentric([2.0 * f64::from(across % 1.0) - 1.0, 2.0 * f64::from(y) - 1.0]);
        // Equal areas of a disk, equal solid angles of a cap. Source: Archimedes, "On the Sphere and Cylinder"
        let drop = (a * a + b * b) * self.opening;
        let wide = (self.opening * (2.0 - drop)).max(0.0).sqrt();
        let [u, v, axis] = self.frame;
        let direction = u * (a * wide) + v * (b * wide) + axis * (1.0 - drop);
        let middle = direction.dot(self.to);
        let half = (middle * middle - self.touch2).max(0.0).sqrt();
        let length = if is_far { middle + half } else { self.touch2 / (middle + half) };
        let (way, inverse) = ((direction * length).as_vec3(), (1.0 / length) as f32);
        self.spot.sent(way, inverse, (TAU * self.opening) as f32 * self.times)
    }

    fn hidden(&self, places: &[[f32; 2]; LANES], ways: &[Vec3; LANES], active: u16) -> u16 {
        self.spot.masked.hidden(places, ways, active)
    }
}
