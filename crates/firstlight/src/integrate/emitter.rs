//! Area lights as they are integrated.

use arrayvec::ArrayVec;

use super::fit::Falloff;
use super::view::{FlatLight, Outline};
use crate::light::{Area, AreaShape};
use crate::math::{DVec3, Vec3};

/// An area light, ready to be integrated.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Emitter {
    /// A rectangle or a disk.
    Flat(FlatLight),
    /// A sphere. From any point outside it looks like the disk in which the cone around it touches it: the same
    /// directions, and, where light weakens on its way, the same radiance in each.
    Ball { center: DVec3, radius: f64, physical: bool, sides: BallSides },
}

/// Which sides of a ball shine: from outside, its near half shows the outer one, its far half the inner one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BallSides {
    Outer,
    Inner,
    Both,
}

impl Emitter {
    pub fn new(area: &Area) -> Emitter {
        let flat =
            |c, a, b, n, outline| Emitter::Flat(FlatLight::new(c, a, b, n, outline, area.physical, area.both_sides));
        match &area.shape {
            AreaShape::Rectangle(r) => flat(r.center, r.e0 * 0.5, r.e1 * 0.5, r.n, Outline::Parallelogram),
            AreaShape::Disk(disk) => flat(disk.center, disk.a, disk.b, disk.n, Outline::Disk),
            AreaShape::Sphere(sphere) => Emitter::Ball {
                center: sphere.center,
                radius: sphere.radius,
                physical: area.physical,
                sides: if area.both_sides { BallSides::Both } else { BallSides::Outer },
            },
        }
    }

    /// Whether light weakens with the square of the distance and the cosine at the light.
    pub fn is_physical(&self) -> bool {
        match self {
            Emitter::Flat(flat) => flat.physical,
            Emitter::Ball { physical, .. } => *physical,
        }
    }

    /// What its places count for.
    pub fn falloff(&self) -> Falloff {
        match (self.outline(), self.is_physical()) {
            (Outline::Sphere, _) if self.shows_far_half() => Falloff::SphereInside,
            (Outline::Sphere, _) => Falloff::Sphere,
            (_, true) => Falloff::Physical,
            (_, false) => Falloff::Constant,
        }
    }

    /// Corners of a box or a parallelogram around it.
    pub fn corners(&self) -> ArrayVec<DVec3, 8> {
        match self {
            Emitter::Flat(flat) => {
                let (a, b) = (flat.a.as_dvec3(), flat.b.as_dvec3());
                [flat.c - a - b, flat.c + a - b, flat.c + a + b, flat.c - a + b].into_iter().collect()
            }
            Emitter::Ball { center, radius, .. } => (0..8)
                .map(|k| {
                    *center + DVec3::from([0, 1, 2].map(|axis| if k >> axis & 1 == 0 { -radius } else { *radius }))
                })
                .collect(),
        }
    }

    /// Whether `p` is inside of a ball that shines inwards: no flat light stands for it there.
    pub fn surrounds(&self, p: Vec3) -> bool {
        match self {
            Emitter::Flat(_) => false,
            Emitter::Ball { center, radius, sides, .. } => {
                *sides != BallSides::Outer && !((*center - p.as_dvec3()).length_squared() > radius * radius)
            }
        }
    }

    /// Whether all that shines, seen from outside, is the far half of a ball.
    pub fn shows_far_half(&self) -> bool {
        matches!(self, Emitter::Ball { sides: BallSides::Inner, .. })
    }

    /// Both sides of a ball that shines on both.
    pub fn halves(&self) -> Option<[Emitter; 2]> {
        match *self {
            Emitter::Ball { center, radius, physical, sides: BallSides::Both } => {
                Some([BallSides::Outer, BallSides::Inner].map(|sides| Emitter::Ball {
                    center,
                    radius,
                    physical,
                    sides,
                }))
            }
            Emitter::Flat(_) | Emitter::Ball { .. } => None,
        }
    }

    /// Whether what it sends changes at once where a point passes its plane.
    pub fn is_one_sided(&self) -> bool {
        match self {
            Emitter::Flat(flat) => flat.physical || !flat.both_sides,
            Emitter::Ball { .. } => false,
        }
    }

    /// What it fills of its square.
    pub fn outline(&self) -> Outline {
        match self {
            Emitter::Flat(flat) => flat.outline,
            Emitter::Ball { physical: true, .. } => Outline::Disk,
            Emitter::Ball { physical: false, .. } => Outline::Sphere,
        }
    }

    /// The flat light that stands for it, seen from `p`; `None` if nothing emits towards `p`.
    pub fn flat(&self, p: Vec3) -> Option<FlatLight> {
        match self {
            Emitter::Flat(flat) => Some(*flat),
            Emitter::Ball { center, radius, physical, sides } => {
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
                Some(match (physical, sides) {
                    // Both where a ray enters the ball and where it leaves it
                    (true, BallSides::Both) => FlatLight { times: 2.0, ..disk },
                    (true, BallSides::Outer | BallSides::Inner) => disk,
                    (false, _) => FlatLight {
                        times: (1.0 - share) as f32,
                        ratio: share.sqrt() as f32,
                        behind2: if *sides == BallSides::Outer { 0.0 } else { (distance2 - radius * radius) as f32 },
                        ..disk
                    },
                })
            }
        }
    }
}
