//! Rotations: three ways of saying them, and the way from one to another.

use pxfm::{f_atan2, f_cos, f_sin};

use crate::context::{CompileContext, show};
use crate::math::{DMat3, DQuat, DVec3};

/// A rotation as a text may say it.
pub(super) struct Turn {
    pub deg: Option<[f64; 3]>,
    pub axis: Option<[f64; 3]>,
    pub angle: Option<f64>,
    pub quaternion: Option<[f64; 4]>,
}

/// A rotation, as it was said: the way from one to another depends on that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rotation {
    /// Degrees about the fixed axes x, then y, then z.
    Euler(DVec3),
    /// A unit axis, and degrees.
    Axis(DVec3, f64),
    /// Unit.
    Quaternion(DQuat),
}

/// No angle is larger, in degrees.
const MAX_ANGLE: f64 = 1e9;
/// A quaternion shorter than this says nothing.
const MIN_LENGTH: f64 = 1e-9;

impl Turn {
    /// The field that says it; `rotate_deg` where nothing does.
    pub(super) fn field(&self) -> &'static str {
        match (self.deg, self.axis, self.quaternion) {
            (None, Some(_), _) => "rotate_axis",
            (None, None, Some(_)) => "quaternion",
            _ => "rotate_deg",
        }
    }

    /// The rotation, if one is said.
    pub(super) fn compile(&self, cx: &mut CompileContext) -> Option<Rotation> {
        let mut said: Option<(&str, Rotation)> = None;
        let mut say = |cx: &mut CompileContext, field: &'static str, rotation: Rotation| match said {
            Some((other, _)) => {
                cx.error(field, format!("{other} says a rotation already"), Some("keep one of them"));
            }
            None => said = Some((field, rotation)),
        };
        if let Some(deg) = self.deg {
            if !deg.iter().all(|d| d.abs() <= MAX_ANGLE) {
                cx.error("rotate_deg", format!("{} is outside [-1e9, 1e9]", show(&deg)), Some("in degrees"));
            }
            cx.advise_radian_turns("rotate_deg", &deg);
            say(cx, "rotate_deg", Rotation::Euler(deg.into()));
        }
        match (self.axis, self.angle) {
            (Some(axis), Some(angle)) => {
                cx.edge("rotate_axis", axis);
                cx.between("angle_deg", angle, -MAX_ANGLE, MAX_ANGLE, Some("in degrees"));
                cx.advise_radian_turns("angle_deg", &[angle]);
                say(cx, "rotate_axis", Rotation::Axis(DVec3::from(axis).normalize_or_zero(), angle));
            }
            (Some(axis), None) => {
                let message = format!("{} has no effect without angle_deg", show(&axis));
                cx.error("rotate_axis", message, Some("say how far to turn, as `angle_deg = 90`"));
            }
            (None, Some(angle)) => {
                let message = format!("{angle} has no effect without rotate_axis");
                cx.error("angle_deg", message, Some("say what to turn about, as `rotate_axis = [0, 1, 0]`"));
            }
            (None, None) => {}
        }
        if let Some(q) = self.quaternion {
            let length = DQuat::from_array(q).length();
            if !length.is_finite() {
                cx.error("quaternion", format!("{} is not finite", show(&q)), Some("x, y, z, w"));
            } else if length < MIN_LENGTH {
                let hint = "x, y, z, w; no rotation is [0, 0, 0, 1]";
                cx.error("quaternion", format!("{} has no length", show(&q)), Some(hint));
            }
            say(cx, "quaternion", Rotation::Quaternion(DQuat::from_array(q) / length));
        }
        said.map(|(_, rotation)| rotation)
    }
}

impl Rotation {
    pub(super) const NONE: Rotation = Rotation::Euler(DVec3::ZERO);

    pub(super) fn matrix(self) -> DMat3 {
        match self {
            Rotation::Euler(DVec3 { x, y, z }) => {
                about(DVec3::Z, sin_cos_deg(z)) * about(DVec3::Y, sin_cos_deg(y)) * about(DVec3::X, sin_cos_deg(x))
            }
            Rotation::Axis(axis, angle) => about(axis, sin_cos_deg(angle)),
            Rotation::Quaternion(q) => DMat3::from_quat(q),
        }
    }

    fn quaternion(self) -> DQuat {
        match self {
            Rotation::Quaternion(q) => q,
            Rotation::Axis(axis, angle) => {
                let (sin, cos) = sin_cos_deg(angle * 0.5);
                DQuat::from_vec4((axis * sin).extend(cos))
            }
            Rotation::Euler(DVec3 { x, y, z }) => {
                let of = |axis, angle| Rotation::Axis(axis, angle).quaternion();
                of(DVec3::Z, z) * of(DVec3::Y, y) * of(DVec3::X, x)
            }
        }
    }

    /// The part `f` of the way from here to `to`. Angles, and turns about one axis, go the way they are written, as
    /// many times around as that takes; everything else the shortest way.
    pub(super) fn mix(self, to: Rotation, f: f64) -> Rotation {
        match (self, to) {
            (Rotation::Euler(a), Rotation::Euler(b)) => Rotation::Euler(a + (b - a) * f),
            (Rotation::Axis(axis, a), Rotation::Axis(same, b)) if axis == same => Rotation::Axis(axis, a + (b - a) * f),
            (a, b) => Rotation::Quaternion(slerp(a.quaternion(), b.quaternion(), f)),
        }
    }
}

/// Sine and cosine of an angle in degrees; exact at right angles.
fn sin_cos_deg(deg: f64) -> (f64, f64) {
    // The remainder of a division is exact, and so is what is left to the nearest right angle
    let turn = deg % 360.0;
    let quarters = (turn / 90.0).round();
    let radians = (turn - quarters * 90.0) * (std::f64::consts::PI / 180.0);
    let (sin, cos) = (f_sin(radians), f_cos(radians));
    match (quarters as i32).rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// The rotation about a unit axis: cos I + sin [a]x + (1 - cos) a a^T.
///
/// Source: Rodrigues 1840; <https://en.wikipedia.org/wiki/Rodrigues%27_rotation_formula>, in matrix form.
fn about(a: DVec3, (sin, cos): (f64, f64)) -> DMat3 {
    let column = |e: DVec3| e * cos + a.cross(e) * sin + a * (a.dot(e) * (1.0 - cos));
    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
}

/// The unit quaternion that lies the part `f` of the way from `a` to `b`, at a constant rate, the shorter way around.
/// At exactly half a turn both ways are as long: the one that the signs as written are nearer to.
///
/// Source: Shoemake, "Animating rotation with quaternion curves", SIGGRAPH 1985, section 3.3.
fn slerp(a: DQuat, b: DQuat, f: f64) -> DQuat {
    // A quaternion and its negative are one rotation
    let b = if a.dot(b) < 0.0 { -b } else { b };
    // Twice the arc tangent is exact to the last digits at every angle, where an arc cosine is not
    let angle = 2.0 * f_atan2((a - b).length(), (a + b).length());
    let sin = f_sin(angle);
    let mixed = if sin > 1e-9 {
        a * (f_sin((1.0 - f) * angle) / sin) + b * (f_sin(f * angle) / sin)
    } else {
        a * (1.0 - f) + b * f
    };
    mixed / mixed.length()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance(a: DMat3, b: DMat3) -> f64 {
        (a - b).to_cols_array().iter().fold(0.0, |most: f64, x| most.max(x.abs()))
    }

    #[test]
    fn right_angles_are_exact_and_others_near() {
        for (deg, sin_cos) in [
            (0.0, (0.0, 1.0)),
            (90.0, (1.0, 0.0)),
            (180.0, (0.0, -1.0)),
            (270.0, (-1.0, 0.0)),
            (-90.0, (-1.0, 0.0)),
            (360e6, (0.0, 1.0)),
            (450.0, (1.0, 0.0)),
        ] {
            assert_eq!(sin_cos_deg(deg), sin_cos, "{deg}");
        }
        for (deg, sin) in [(30.0, 0.5), (45.0, 0.5f64.sqrt()), (-150.0, -0.5), (750.0, 0.5)] {
            assert!((sin_cos_deg(deg).0 - sin).abs() < 1e-15, "{deg}");
        }
    }

    #[test]
    fn all_ways_of_saying_a_rotation_agree() {
        let half = 0.5f64.sqrt();
        let ways = [
            Rotation::Euler(DVec3::new(0.0, 90.0, 0.0)),
            Rotation::Axis(DVec3::Y, 90.0),
            Rotation::Quaternion(DQuat::from_xyzw(0.0, half, 0.0, half)),
        ];
        for way in ways {
            assert!(distance(way.matrix(), ways[0].matrix()) < 1e-15, "{way:?}");
            assert!(distance(DMat3::from_quat(way.quaternion()), way.matrix()) < 1e-15, "{way:?}");
        }
        let euler = Rotation::Euler(DVec3::new(20.0, -50.0, 110.0));
        assert!(distance(DMat3::from_quat(euler.quaternion()), euler.matrix()) < 1e-15);
        let turned = euler.matrix() * euler.matrix().transpose();
        assert!(distance(turned, DMat3::IDENTITY) < 1e-15 && euler.matrix().determinant() > 0.0);
    }

    #[test]
    fn slerp_turns_at_a_constant_rate_the_shortest_way() {
        let axis = DVec3::new(1.0, 2.0, 2.0) / 3.0;
        let at = |deg: f64| Rotation::Axis(axis, deg).quaternion();
        for (from, to, through) in [(0.0, 90.0, 90.0), (10.0, 350.0, -20.0), (-170.0, 175.0, -15.0), (5.0, 5.0, 0.0)] {
            for k in 0..=8 {
                let f = f64::from(k) / 8.0;
                let mixed = DMat3::from_quat(slerp(at(from), at(to), f));
                let expected = about(axis, sin_cos_deg(from + through * f));
                assert!(distance(mixed, expected) < 1e-14, "{from} {to} {f}");
            }
        }
        // Nearly the same, and exactly opposite
        for (from, to) in [(0.0, 1e-7), (0.0, 180.0)] {
            let middle = DMat3::from_quat(slerp(at(from), at(to), 0.5));
            assert!(distance(middle, about(axis, sin_cos_deg((from + to) * 0.5))) < 1e-14, "{from} {to}");
        }
    }

    #[test]
    fn one_axis_keeps_its_turns_and_two_take_the_shortest_way() {
        let (a, b) = (Rotation::Axis(DVec3::Y, 0.0), Rotation::Axis(DVec3::Y, 720.0));
        assert_eq!(a.mix(b, 0.125), Rotation::Axis(DVec3::Y, 90.0));
        let (a, b) = (Rotation::Axis(DVec3::Y, 0.0), Rotation::Axis(DVec3::X, 270.0));
        assert!(distance(a.mix(b, 0.5).matrix(), about(DVec3::X, sin_cos_deg(-45.0))) < 1e-15);
    }
}
