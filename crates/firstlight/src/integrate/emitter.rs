//! Area lights as they are integrated.

use super::view::{FlatLight, Outline};
use crate::light::{Area, AreaShape};
use crate::math::{DVec3, Vec3};

/// An area light, ready to be integrated.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Emitter {
    /// A rectangle or a disk.
    Flat(FlatLight),
    /// A sphere whose outside emits as light does. From any point outside it looks like the disk in which the cone
    /// around it touches it: the same directions, and the same radiance in each.
    Ball { center: DVec3, radius: f64 },
    /// Any other sphere: [`points`](super::points).
    Points,
}

impl Emitter {
    pub fn new(area: &Area) -> Emitter {
        let flat =
            |c, a, b, n, outline| Emitter::Flat(FlatLight::new(c, a, b, n, outline, area.physical, area.both_sides));
        match &area.shape {
            AreaShape::Rectangle(r) => flat(r.center, r.e0 * 0.5, r.e1 * 0.5, r.n, Outline::Parallelogram),
            AreaShape::Disk(disk) => flat(disk.center, disk.a, disk.b, disk.n, Outline::Disk),
            AreaShape::Sphere(sphere) if area.physical && !area.both_sides => {
                Emitter::Ball { center: sphere.center, radius: sphere.radius }
            }
            AreaShape::Sphere(_) => Emitter::Points,
        }
    }

    /// Whether light weakens with the square of the distance and the cosine at the light.
    pub fn is_physical(&self) -> bool {
        match self {
            Emitter::Flat(flat) => flat.physical,
            Emitter::Ball { .. } | Emitter::Points => true,
        }
    }

    /// Whether a flat light stands for it everywhere.
    pub fn is_closed(&self) -> bool {
        !matches!(self, Emitter::Points)
    }

    /// Whether what it sends changes at once where a point passes its plane.
    pub fn is_one_sided(&self) -> bool {
        match self {
            Emitter::Flat(flat) => flat.physical || !flat.both_sides,
            Emitter::Ball { .. } | Emitter::Points => false,
        }
    }

    /// What it fills of its square.
    pub fn outline(&self) -> Outline {
        match self {
            Emitter::Flat(flat) => flat.outline,
            Emitter::Ball { .. } | Emitter::Points => Outline::Disk,
        }
    }

    /// The flat light that stands for it, seen from `p`; `None` if nothing emits towards `p`.
    pub fn flat(&self, p: Vec3) -> Option<FlatLight> {
        match self {
            Emitter::Flat(flat) => Some(*flat),
            Emitter::Ball { center, radius } => {
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
                Some(FlatLight::new(c, a * r, a.cross(n) * r, -n, Outline::Disk, true, false))
            }
            Emitter::Points => None,
        }
    }
}
