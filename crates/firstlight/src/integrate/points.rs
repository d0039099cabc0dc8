//! The integral of a sphere that no flat light stands for, by cells: over rings of its area where light does not weaken
//! on its way, over directions where it does. A sphere that nearly touches a surface does all it does within next to
//! nothing of its area.

use std::f64::consts::TAU;

use pxfm::{f_exp, f_log, f_sincos};

use super::cells::{self, MirrorSpot, PointSent, PointSource};
use super::mask::Masked;
use crate::light::{Area, AreaShape, Light, LightKind, SphereLight, concentric};
use crate::material::Moments;
use crate::math::{DVec3, LANES, Vec3};
use crate::shape::SurfaceInteraction;

impl Masked<'_> {
    /// What arrives from a sphere for which there is no [`FlatView`](super::FlatView).
    pub fn by_points(&self, light: &Light, enough: &dyn Fn(&Moments, &Moments) -> bool) -> Moments {
        let LightKind::Area(Area { shape: AreaShape::Sphere(sphere), physical, both_sides, .. }) = &light.kind else {
            unreachable!("what is flat has a view")
        };
        let floor = light.floor(self.si.lit_from, self.si.error, self.si.horizon);
        if *physical {
            let directions = Directions::new(self, sphere);
            cells::integrate(&Ways { masked: self, floor, ways: |at| Some(directions.way(at)) }, None, enough).0
        } else {
            let rings = Rings::new(self, sphere, *both_sides);
            cells::integrate(&Ways { masked: self, floor, ways: |at| rings.way(at) }, None, enough).0
        }
    }
}

/// Highlights wider than this, in radians, are found by any cells.
const WIDE: f32 = 0.3;

/// The way to a point of the light, and what its part of the light's measure sends this way.
struct Way {
    way: DVec3,
    weight: f64,
}

/// The ways to the points of a light; `None` to those that send nothing.
struct Ways<'a, F> {
    masked: &'a Masked<'a>,
    /// [`Light::floor`].
    floor: f32,
    ways: F,
}

impl<F: Fn([f32; 2]) -> Option<Way>> PointSource for Ways<'_, F> {
    fn sent(&self, at: [f32; 2]) -> Option<PointSent> {
        let Way { way, weight } = (self.ways)(at)?;
        let (inverse, way, weight) = ((1.0 / way.length()) as f32, way.as_vec3(), weight as f32);
        let si = self.masked.si;
        let height = si.ns.dot(way);
        if !(si.horizon.dot(way) > self.floor && height > 0.0 && inverse < f32::INFINITY) {
            return None;
        }
        let cos_i = height * inverse;
        let moments = self.masked.lobe.moments(cos_i, si.ns.dot(si.wo), si.wo.dot(way) * inverse, weight);
        Some(PointSent { way, sums: moments.0 })
    }

    fn highlight(&self) -> Option<MirrorSpot> {
        let SurfaceInteraction { ns, wo, .. } = *self.masked.si;
        let cos_o = ns.dot(wo);
        let sharpness = self.masked.lobe.sharpness(cos_o);
        let spread = 1.0 / (2.0 * sharpness).sqrt();
        (sharpness > 0.0 && spread < WIDE).then(|| MirrorSpot { way: ns * (2.0 * cos_o) - wo, spread })
    }

    fn hidden(&self, _: &[[f32; 2]; LANES], ways: &[Vec3; LANES], active: u16) -> u16 {
        self.masked.hidden(ways, active)
    }
}

/// All of the sphere, in rings around the place that is nearest to the point: the closer together the nearer they are.
struct Rings {
    radius: f64,
    both_sides: bool,
    /// From the point to the sphere's middle.
    to: DVec3,
    /// Around what the rings lie: unit vectors, the last is the axis.
    frame: [DVec3; 3],
    /// The width of the innermost ring, and the logarithm of how many times the outermost is as wide. Widths are those
    /// of the height of a cap, for which the sphere has the radius 1: equal widths are equal areas.
    width: f64,
    growth: f64,
}

impl Rings {
    fn new(masked: &Masked, sphere: &SphereLight, both_sides: bool) -> Self {
        let to = sphere.center - masked.si.lit_from.as_dvec3();
        let (distance, radius) = (to.length(), sphere.radius);
        let axis = (to / -distance).try_normalize().unwrap_or(DVec3::Z);
        let across = axis.any_orthonormal_vector();
        // A ring as wide as the sphere is far away
        let near = (distance - radius) / radius;
        let width = (0.5 * near * near).clamp(1e-9, 4.0);
        let growth = f_log(1.0 + 2.0 / width);
        Rings { radius, both_sides, to, frame: [across, axis.cross(across), axis], width, growth }
    }

    /// `None` to a side that does not emit.
    fn way(&self, [x, y]: [f32; 2]) -> Option<Way> {
        let grown = f_exp(self.growth * f64::from(x));
        let drop = (self.width * (grown - 1.0)).min(2.0);
        let (wide, (sin, cos)) = ((drop * (2.0 - drop)).sqrt(), f_sincos(TAU * f64::from(y)));
        let [u, v, axis] = self.frame;
        let n = u * (wide * cos) + v * (wide * sin) + axis * (1.0 - drop);
        let way = self.to + n * self.radius;
        let weight = 0.5 * self.width * self.growth * grown;
        (self.both_sides || n.dot(way) < 0.0).then_some(Way { way, weight })
    }
}

/// Equal areas of the square are equal solid angles, of a sphere both sides of which emit: of the cone around it, first
/// to its near side, then to the far one; or, from within, of all that is above the surface.
struct Directions {
    /// From the point to the sphere's middle, and the square of the way to where the cone touches; below 0 within.
    to: DVec3,
    touch2: f64,
    /// Around what the directions lie: unit vectors, the last is the axis.
    frame: [DVec3; 3],
    /// One less the cosine of half the cone's angle, in which the axis lies.
    opening: f64,
    /// How many times a direction meets the sphere.
    times: f32,
}

impl Directions {
    fn new(masked: &Masked, sphere: &SphereLight) -> Self {
        let si = masked.si;
        let to = sphere.center - si.lit_from.as_dvec3();
        let distance = to.length();
        let touch2 = (distance - sphere.radius) * (distance + sphere.radius);
        let (axis, opening, times) = if touch2 > 0.0 {
            // 1 - sqrt(1 - s), without loss where the sphere is small
            let share = (sphere.radius / distance) * (sphere.radius / distance);
            (to / distance, share / (1.0 + (1.0 - share).max(0.0).sqrt()), 2.0)
        } else {
            (si.ns.as_dvec3().normalize(), 1.0, 1.0)
        };
        let across = axis.any_orthonormal_vector();
        Directions { to, touch2, frame: [across, axis.cross(across), axis], opening, times }
    }

    fn way(&self, [x, y]: [f32; 2]) -> Way {
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
        Way { way: direction * length, weight: TAU * self.opening * f64::from(self.times) }
    }
}
