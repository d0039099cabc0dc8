//! How an occluder lies to a light: on which sides of a flat light's plane it is, and whether it intersects a sphere
//! light.

use super::ExactShape;
use crate::integrate::emitter::Emitter;
use crate::material::ShadingPoint;

/// The sides of a flat light's plane that an occluder reaches into by more than rounding, or on which points are, as
/// bits. What is in the plane, or behind it as seen from a point, hides nothing of the light from that point. For other
/// lights all bits are set.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightSides {
    front: u64,
    back: u64,
}

impl LightSides {
    const BOTH: LightSides = LightSides { front: u64::MAX, back: u64::MAX };

    /// The sides of an occluder.
    pub fn of(emitter: &Emitter, exact: &ExactShape) -> LightSides {
        let Emitter::Flat(light) = emitter else { return Self::BOTH };
        let n = light.normal();
        let sides = [n, -n].map(|n| {
            let reach = match exact {
                ExactShape::Sphere(sphere) => n.dot(sphere.c) + sphere.r,
                ExactShape::Flat { flat, .. } => flat.support(n),
                ExactShape::Solid(solid) => solid.reach(n),
            };
            if reach - n.dot(light.c) > light.rounding() { u64::MAX } else { 0 }
        });
        LightSides { front: sides[0], back: sides[1] }
    }

    /// The sides of sixteen points; both, where places within reach are on both.
    pub fn of_points(emitter: &Emitter, points: &[ShadingPoint]) -> LightSides {
        let Emitter::Flat(light) = emitter else { return Self::BOTH };
        let n = light.normal();
        let mut sides = LightSides { front: 0, back: 0 };
        for (k, point) in points.iter().enumerate() {
            let height = n.dot(point.p.as_dvec3() - light.c);
            let reach = f64::from(point.reach);
            sides.front |= u64::from(height >= -reach) << k;
            sides.back |= u64::from(height <= reach) << k;
        }
        sides
    }

    /// The points that are on a side of this occluder.
    pub fn of_these(self, points: LightSides) -> u64 {
        self.front & points.front | self.back & points.back
    }
}

/// How an occluder lies to a sphere light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LightContact {
    Disjoint,
    /// The surfaces may intersect: the part of the occluder behind the light's surface is not visible on the disk that
    /// replaces the light.
    Intersects,
    /// The light is inside of the occluder.
    Contains,
}

impl LightContact {
    pub fn of(emitter: &Emitter, exact: &ExactShape) -> LightContact {
        let Emitter::Ball { center, radius, .. } = emitter else { return LightContact::Disjoint };
        match exact {
            ExactShape::Sphere(sphere) => {
                let distance = (*center - sphere.c).length();
                if distance >= radius + sphere.r {
                    LightContact::Disjoint
                } else if distance + radius <= sphere.r * (1.0 - 1e-9) {
                    LightContact::Contains
                } else {
                    LightContact::Intersects
                }
            }
            ExactShape::Flat { flat, .. } if flat.distance(*center) < *radius => LightContact::Intersects,
            ExactShape::Solid(solid) if solid.may_contain_light => LightContact::Intersects,
            ExactShape::Flat { .. } | ExactShape::Solid(_) => LightContact::Disjoint,
        }
    }
}
