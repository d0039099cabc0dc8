//! Area lights in the form in which they are integrated.

use std::f64::consts::PI;

use arrayvec::ArrayVec;

use super::batch::Exact;
use super::cell::AreaWeight;
use super::light_frame::{FlatLight, LightFrame, Outline};
use crate::light::{AreaShape, Light};
use crate::material::ShadingPoint;
use crate::math::{DVec3, Vec3};

/// Faces of a cube.
const FACES: usize = 6;

/// An area light.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Emitter {
    /// A rectangle or a disk.
    Flat(FlatLight),
    /// A sphere. From a point outside it is replaced by the disk bounded by the circle in which its tangent cone
    /// touches it: the same directions and, if the light is physical, the same radiance in each.
    Ball { center: DVec3, radius: f64, physical: bool, both_sides: bool },
    /// The part of a sphere that a point inside sees through one face of a cube around the point, which is outside of
    /// the sphere: the same directions and radiance.
    Face { center: DVec3, radius: f64, physical: bool, face: usize },
}

impl Emitter {
    /// `None` of a light without an area.
    pub fn of(light: &Light) -> Option<Emitter> {
        let area = light.area()?;
        let flat =
            |c, a, b, n, outline| Emitter::Flat(FlatLight::new(c, a, b, n, outline, area.physical, area.both_sides));
        Some(match &area.shape {
            AreaShape::Rectangle(r) => flat(r.center, r.e0 * 0.5, r.e1 * 0.5, r.n, Outline::Parallelogram),
            AreaShape::Disk(disk) => flat(disk.center, disk.a, disk.b, disk.n, Outline::Disk),
            AreaShape::Sphere(sphere) => Emitter::Ball {
                center: sphere.center,
                radius: sphere.radius,
                physical: area.physical,
                both_sides: area.both_sides,
            },
        })
    }

    /// Whether irradiance falls with the square of the distance and the cosine at the light.
    pub fn is_physical(&self) -> bool {
        match self {
            Emitter::Flat(flat) => flat.physical,
            Emitter::Ball { physical, .. } | Emitter::Face { physical, .. } => *physical,
        }
    }

    /// The weight of its places in the integral.
    pub fn falloff(&self) -> AreaWeight {
        match (self.outline(), self.is_physical()) {
            (Outline::Sphere, _) => AreaWeight::Sphere,
            (_, true) => AreaWeight::Physical,
            (_, false) => match self {
                Emitter::Face { center, radius, .. } => {
                    AreaWeight::Around { center: Exact::new(*center), radius: *radius as f32 }
                }
                Emitter::Flat(_) | Emitter::Ball { .. } => AreaWeight::Constant,
            },
        }
    }

    /// Corners of its parallelogram, or of a bounding box.
    pub fn corners(&self) -> ArrayVec<DVec3, 8> {
        match self {
            Emitter::Flat(flat) => {
                let (a, b) = (flat.a.as_dvec3(), flat.b.as_dvec3());
                [flat.c - a - b, flat.c + a - b, flat.c + a + b, flat.c - a + b].into_iter().collect()
            }
            Emitter::Ball { center, radius, .. } | Emitter::Face { center, radius, .. } => (0..8)
                .map(|k| {
                    *center + DVec3::from([0, 1, 2].map(|axis| if k >> axis & 1 == 0 { -radius } else { *radius }))
                })
                .collect(),
        }
    }

    /// Whether `p` is inside of a sphere that emits inwards: no flat light replaces it there.
    pub fn surrounds(&self, p: Vec3) -> bool {
        self.depth(p).is_some()
    }

    /// The distance of `p` to the surface of a sphere that emits inwards, if `p` is inside.
    pub fn depth(&self, p: Vec3) -> Option<f32> {
        match self {
            Emitter::Flat(_) | Emitter::Face { .. } => None,
            Emitter::Ball { center, radius, both_sides, .. } => {
                let depth = radius - (*center - p.as_dvec3()).length();
                (*both_sides && !(depth < 0.0)).then_some(depth as f32)
            }
        }
    }

    /// Lower bound of the distance to a point, in metres; 0 where nothing emits towards the point.
    pub fn nearest(&self, point: &ShadingPoint) -> f32 {
        let flat = || self.flat(point.p).map(|flat| LightFrame::new(&flat, point).nearest());
        self.depth(point.p).or_else(flat).unwrap_or(0.0)
    }

    /// The six parts of a sphere that emits inwards, by the faces of a cube.
    pub fn faces(&self) -> Option<[Emitter; FACES]> {
        match *self {
            Emitter::Ball { center, radius, physical, both_sides: true } => {
                Some(std::array::from_fn(|face| Emitter::Face { center, radius, physical, face }))
            }
            Emitter::Flat(_) | Emitter::Ball { .. } | Emitter::Face { .. } => None,
        }
    }

    /// Whether its light is discontinuous across its plane.
    pub fn is_one_sided(&self) -> bool {
        match self {
            Emitter::Flat(flat) => flat.physical || !flat.both_sides,
            Emitter::Ball { .. } | Emitter::Face { .. } => false,
        }
    }

    /// Whether its light is discontinuous between some of these places: they lie on both sides of it.
    pub fn parts(&self, mut places: impl Iterator<Item = Vec3>) -> bool {
        let is_within = |p: Vec3| match self {
            Emitter::Flat(flat) => (p.as_dvec3() - flat.c).dot(flat.n.as_dvec3()) > 0.0,
            Emitter::Ball { center, radius, .. } | Emitter::Face { center, radius, .. } => {
                (p.as_dvec3() - *center).length_squared() < radius * radius
            }
        };
        let is_even = matches!(self, Emitter::Flat(_)) && !self.is_one_sided();
        let first = places.next().map(is_within);
        !is_even && places.any(|p| Some(is_within(p)) != first)
    }

    /// Its outline in its square.
    pub fn outline(&self) -> Outline {
        match self {
            Emitter::Flat(flat) => flat.outline,
            Emitter::Face { .. } => Outline::Parallelogram,
            Emitter::Ball { physical: true, .. } => Outline::Disk,
            Emitter::Ball { physical: false, .. } => Outline::Sphere,
        }
    }

    /// The flat light that replaces it for `p`; `None` if nothing emits towards `p`.
    pub fn flat(&self, p: Vec3) -> Option<FlatLight> {
        match self {
            Emitter::Flat(flat) => Some(*flat),
            Emitter::Face { center, radius, physical, face } => {
                let p = p.as_dvec3();
                if (*center - p).length_squared() > radius * radius {
                    return None;
                }
                let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * (2.0 * radius));
                let side = if face % 2 == 0 { 1.0 } else { -1.0 };
                let [to, a, b] = [0, 1, 2].map(|k| axes[(face / 2 + k) % 3]);
                let n = to * (-side / (2.0 * radius));
                let square = FlatLight::new(p + to * side, a, b, n, Outline::Parallelogram, *physical, false);
                // Of the sphere's area, 4 pi r^2, in place of the square's
                Some(if *physical { square } else { FlatLight { times: (4.0 / PI) as f32, ..square } })
            }
            Emitter::Ball { center, radius, physical, both_sides } => {
                let to = *center - p.as_dvec3();
                let distance2 = to.length_squared();
                let share = radius * radius / distance2;
                if !(share < 1.0) {
                    return None;
                }
                let n = to / distance2.sqrt();
                let a = n.any_orthonormal_vector();
                let r = radius * (1.0 - share).sqrt();
                let c = p.as_dvec3() + to * (1.0 - share);
                let disk = FlatLight::new(c, a * r, a.cross(n) * r, -n, self.outline(), *physical, false);
                Some(match (physical, both_sides) {
                    // Both where a ray enters the ball and where it leaves it
                    (true, true) => FlatLight { times: 2.0, ..disk },
                    (true, false) => disk,
                    (false, _) => FlatLight {
                        times: (1.0 - share) as f32,
                        ratio: share.sqrt() as f32,
                        behind2: if *both_sides { (distance2 - radius * radius) as f32 } else { 0.0 },
                        ..disk
                    },
                })
            }
        }
    }
}
