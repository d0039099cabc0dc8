//! Three directions at right angles.

use super::DVec3;

/// Three unit vectors at right angles, x cross y = z. In f64, and exact where they are axes of the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axes {
    pub x: DVec3,
    pub y: DVec3,
    pub z: DVec3,
}

/// An axis this near to +x or -x cannot be told apart from it well enough to measure angles from there.
const NEAR_X: f64 = 0.9;

/// A direction whose sine with another is smaller than this is parallel to it.
const MIN_SINE: f64 = 1e-6;

impl Axes {
    /// For what is round about `axis` (unit): z is the axis, x is where angles are counted from: world +x, or world +y
    /// where the axis is within 26 degrees of +x or -x, made perpendicular to the axis.
    pub fn around(axis: DVec3) -> Self {
        let from = if axis.x.abs() > NEAR_X { DVec3::Y } else { DVec3::X };
        let x = (from - axis * axis.dot(from)).normalize_or(DVec3::X);
        Axes { x, y: axis.cross(x), z: axis }
    }

    /// For what is flat and faces `normal` (unit): z is the normal, y is `up` made perpendicular to it, x is to the
    /// right for those the normal points to. `None` if `up` is parallel to the normal.
    ///
    /// Without `up` that is +y; of what faces straight up it is -z, of what faces straight down +z, as if tipped over
    /// from facing +z.
    pub fn facing(normal: DVec3, up: Option<DVec3>) -> Option<Self> {
        let flat = |up: DVec3| {
            let x = up.cross(normal);
            (x.length() > MIN_SINE * up.length()).then(|| {
                let x = x.normalize();
                Axes { x, y: normal.cross(x), z: normal }
            })
        };
        match up {
            Some(up) => flat(up),
            None => flat(DVec3::Y).or_else(|| flat(if normal.y > 0.0 { DVec3::NEG_Z } else { DVec3::Z })),
        }
    }

    /// The coordinates of `v` in this frame.
    #[inline(always)]
    pub fn local(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// The vector of these coordinates.
    #[inline(always)]
    pub fn world(&self, v: DVec3) -> DVec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// How far a disk of radius 1 across z reaches along each axis of the world.
    pub fn disk_reach(&self) -> DVec3 {
        let squares = self.x * self.x + self.y * self.y;
        DVec3::new(squares.x.sqrt(), squares.y.sqrt(), squares.z.sqrt())
    }

    /// How far it reaches in a direction: the length of the part of `d` across z.
    pub fn across(&self, d: DVec3) -> f64 {
        let (x, y) = (self.x.dot(d), self.y.dot(d));
        (x * x + y * y).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_right_handed_and_exact_along_the_axes() {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::new(1.0, 2.0, -3.0).normalize()] {
            for frame in [Axes::around(axis), Axes::facing(axis, None).expect("there is always an up")] {
                assert_eq!(frame.z, axis);
                assert!((frame.x.cross(frame.y) - frame.z).length() < 1e-15);
                let v = DVec3::new(0.3, -4.0, 5.5);
                assert!((frame.world(frame.local(v)) - v).length() < 1e-14);
            }
        }
        let upright = Axes::around(DVec3::Y);
        assert_eq!((upright.x, upright.y), (DVec3::X, DVec3::NEG_Z));
    }

    #[test]
    fn flat_things_stand_upright() {
        let of = |n| Axes::facing(n, None).map(|f| (f.x, f.y)).expect("there is always an up");
        assert_eq!(of(DVec3::Z), (DVec3::X, DVec3::Y));
        assert_eq!(of(DVec3::X), (DVec3::NEG_Z, DVec3::Y));
        assert_eq!(of(DVec3::NEG_Z), (DVec3::NEG_X, DVec3::Y));
        assert_eq!(of(DVec3::Y), (DVec3::X, DVec3::NEG_Z));
        assert_eq!(of(DVec3::NEG_Y), (DVec3::X, DVec3::Z));
        assert!(Axes::facing(DVec3::Y, Some(DVec3::NEG_Y)).is_none());
    }
}
