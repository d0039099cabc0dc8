//! Angles from 0 to pi, as their sine and cosine: sums and differences need no trigonometric function. Cones of
//! directions.

use super::Vec3;

/// An angle from 0 to pi.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arc {
    pub cos: f32,
    pub sin: f32,
}

impl Arc {
    pub const ZERO: Arc = Arc { cos: 1.0, sin: 0.0 };
    /// pi.
    pub const HALF_TURN: Arc = Arc { cos: -1.0, sin: 0.0 };

    /// Between two unit vectors.
    #[inline(always)]
    pub fn between(u: Vec3, v: Vec3) -> Arc {
        Arc { cos: u.dot(v).clamp(-1.0, 1.0), sin: u.cross(v).length().min(1.0) }
    }

    /// Between two unit vectors that are `chord` apart, 0 or more, or a little more.
    pub fn of_chord(chord: f32) -> Arc {
        if !(chord < 2.0) {
            return Arc::HALF_TURN;
        }
        // cos a = 1 - c^2 / 2, sin a = c sqrt(1 - c^2 / 4)
        let half = 0.5 * chord * chord;
        Arc { cos: 1.0 - half, sin: chord * (1.0 - 0.5 * half).max(0.0).sqrt() }
    }

    /// Of this sine, at most a right angle.
    #[inline(always)]
    pub fn of_sin(sin: f32) -> Arc {
        Arc { cos: (1.0 - sin * sin).max(0.0).sqrt(), sin }
    }

    /// The sum, or pi if it is more.
    #[inline(always)]
    pub fn plus(self, other: Arc) -> Arc {
        let sin = self.sin * other.cos + self.cos * other.sin;
        if sin < 0.0 || self.cos + other.cos < 0.0 && sin <= 0.0 {
            return Arc::HALF_TURN;
        }
        Arc { cos: self.cos * other.cos - self.sin * other.sin, sin }
    }

    /// The difference, or 0 if it is less.
    #[inline(always)]
    pub fn minus(self, other: Arc) -> Arc {
        if self.cos >= other.cos {
            return Arc::ZERO;
        }
        let sin = self.sin * other.cos - self.cos * other.sin;
        Arc { cos: self.cos * other.cos + self.sin * other.sin, sin: sin.max(0.0) }
    }
}

/// A set of directions: all within an angle of an axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DirectionCone {
    /// Unit.
    pub axis: Vec3,
    pub angle: Arc,
}

impl DirectionCone {
    /// All directions.
    pub const SPHERE: DirectionCone = DirectionCone { axis: Vec3::Y, angle: Arc::HALF_TURN };

    /// One direction, a unit vector.
    pub fn of(axis: Vec3) -> DirectionCone {
        DirectionCone { axis, angle: Arc::ZERO }
    }

    /// A cone that holds both.
    pub fn union(&self, other: &DirectionCone) -> DirectionCone {
        let axis = (self.axis + other.axis).normalize_or(self.axis);
        let [a, b] = [self, other].map(|cone| Arc::between(axis, cone.axis).plus(cone.angle));
        DirectionCone { axis, angle: if a.cos < b.cos { a } else { b } }
    }

    /// The smallest and the largest angle between a direction of the cone and one within `spread` of `d`, a unit
    /// vector.
    pub fn angles_to(&self, d: Vec3, spread: Arc) -> [Arc; 2] {
        let off = Arc::between(d, self.axis);
        [off.minus(spread).minus(self.angle), off.plus(spread).plus(self.angle)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(degrees: f64) -> Arc {
        let a = degrees.to_radians();
        Arc { cos: pxfm::f_cos(a) as f32, sin: pxfm::f_sin(a) as f32 }
    }

    #[test]
    fn sums_stop_at_the_ends() {
        let angles = [0.0, 1.0, 30.0, 89.0, 90.0, 120.0, 179.0, 180.0];
        for a in angles {
            for b in angles {
                let near = |x: Arc, degrees: f64| (x.cos - arc(degrees).cos).abs() < 1e-5;
                assert!(near(arc(a).plus(arc(b)), (a + b).min(180.0)), "{a} + {b}: {:?}", arc(a).plus(arc(b)));
                assert!(near(arc(a).minus(arc(b)), (a - b).max(0.0)), "{a} - {b}: {:?}", arc(a).minus(arc(b)));
            }
        }
        assert!((Arc::of_chord(2f32.sqrt()).cos).abs() < 1e-6 && Arc::of_chord(3.0) == Arc::HALF_TURN);
    }
}
