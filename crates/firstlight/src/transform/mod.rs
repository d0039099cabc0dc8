//! Transforms: where a thing is, how it is turned and how large it is, at a moment.
//!
//! From `transform = { ... }` of the scene text to a [`DAffine3`] that takes the thing's own coordinates to those of
//! the world (`world_from_object`). What is made of it is left to those who have one: cameras, lights, shapes.
//!
//! - this file: the table, what may be said together, and the order scale, rotate, translate;
//! - [`keys`]: what changes with time;
//! - [`rotation`]: the three ways of saying a rotation, and the way from one to another.

mod keys;
mod rotation;

use crate::context::{CompileContext, show};
use crate::describe::{ScaleDesc, table, words};
use crate::error::SceneError;
use crate::math::{DAffine3, DMat3, DVec3};

use keys::Keyed;
use rotation::{Rotation, Turn};

pub(crate) use keys::MAX_TIME;
pub use keys::TransformKeyDesc;

words! {
    /// What happens between two keys.
    pub enum Interpolation {
        /// Positions, scales and angles change at a constant rate; between quaternions, and between different axes, the
        /// rotation goes the shortest way at a constant rate.
        Linear = "linear",
        /// Everything stays as the earlier key says, until the later key's own time.
        Step = "step",
    }
}

table! {
    /// Where a thing is, how it is turned, how large it is: `transform = { ... }` of what has one, or a table of its
    /// own below it, as `[camera.transform]` or `[light.point.transform]`.
    ///
    /// A point is scaled, then rotated, then translated. With `keys` the transform changes with time: a translation, a
    /// rotation or a scale is said either here, and then stays, or in keys. What no key says stays as it is here.
    ///
    /// A rotation is said in one of three ways: `rotate_deg`, `rotate_axis` with `angle_deg`, or `quaternion`. Positive
    /// angles turn counterclockwise, seen from the tip of the axis.
    ///
    /// ```toml
    /// [camera]
    /// position = [0, 0, 10]
    ///
    /// [[light.point]]
    /// position = [0, 3, 0]
    /// transform = { rotate_deg = [0, 0, -90], translate = [0, 1, 0] }
    /// ```
    pub struct TransformDesc {
        /// Where to, in metres.
        pub translate: [f64; 3] = [0.0, 0.0, 0.0],
        /// Degrees about the x axis, then about the y axis, then about the z axis; the axes stay where they are
        /// (Blender's "XYZ Euler"). Each from -1e9 to 1e9.
        pub rotate_deg: [f64; 3] = [0.0, 0.0, 0.0],
        /// Instead of `rotate_deg`: the axis to turn about, through the origin, of any length above 1e-9.
        pub rotate_axis: Option<[f64; 3]> = None,
        /// Degrees about `rotate_axis`, from -1e9 to 1e9.
        pub angle_deg: Option<f64> = None,
        /// Instead of `rotate_deg`: x, y, z, w, as glTF has it. Its length, above 1e-9, is of no account.
        pub quaternion: Option<[f64; 4]> = None,
        /// Along the axes, before anything is turned: not 0; below 0 it mirrors. One number scales all three.
        pub scale: ScaleDesc = ScaleDesc::ONE,
        /// Instead of everything else: three rows of four numbers; the fourth of each row translates. (glTF's own are
        /// columns, four of four.)
        pub matrix: Option<[f64; 12]> = None,
        /// What changes with time, each key later than the one before.
        pub keys: Vec<TransformKeyDesc> = Vec::new(),
        /// What happens between two keys.
        pub interpolation: Interpolation = Interpolation::Linear,
    }
}

/// Columns that span less than this part of what their lengths could are in one plane.
const MIN_VOLUME: f64 = 1e-9;
/// The least and the largest that a scale may be.
const SCALES: std::ops::RangeInclusive<f64> = 1e-9..=2.5e8;

impl TransformDesc {
    /// `world_from_object` at `time`, in seconds. Every key is checked, whatever the time. After a fault: something
    /// that can be computed with.
    pub(crate) fn compile(&self, cx: &mut CompileContext, time: f64) -> DAffine3 {
        let before = cx.fault_count();
        let affine = match &self.matrix {
            Some(matrix) => self.compile_matrix(cx, matrix),
            None => self.compile_parts(cx, time),
        };
        if cx.fault_count() == before { affine } else { DAffine3::IDENTITY }
    }

    /// What it does at `time`, in seconds: three rows of four numbers, `world_from_object`, as in `matrix`.
    ///
    /// # Errors
    /// What is wrong with it, with paths that begin with `transform`.
    pub fn rows(&self, time: f64) -> Result<[f64; 12], SceneError> {
        let cx = &mut CompileContext::at_time(time);
        let affine = cx.within("transform", |cx| self.compile(cx, time));
        let faults = cx.take_faults();
        if !faults.is_empty() {
            return Err(SceneError { faults });
        }
        let [x, y, z] = [0, 1, 2].map(|row| affine.matrix3.row(row));
        let t = affine.translation;
        Ok([x.x, x.y, x.z, t.x, y.x, y.y, y.z, t.y, z.x, z.y, z.z, t.z])
    }

    /// Of the field `transform` that a thing may have, at the context's time: `None` if it has none, or one that was
    /// refused.
    pub(crate) fn compile_field(transform: Option<&Self>, cx: &mut CompileContext) -> Option<DAffine3> {
        let transform = transform?;
        let (before, time) = (cx.fault_count(), cx.time);
        let affine = cx.within("transform", |cx| transform.compile(cx, time));
        (cx.fault_count() == before).then_some(affine)
    }

    fn compile_parts(&self, cx: &mut CompileContext, time: f64) -> DAffine3 {
        // What is said here
        cx.point("translate", self.translate);
        let euler = Some(self.rotate_deg).filter(|deg| *deg != [0.0; 3]);
        let turn = Turn { deg: euler, axis: self.rotate_axis, angle: self.angle_deg, quaternion: self.quaternion };
        let rotation = turn.compile(cx);
        check_scale(cx, self.scale);
        // What the keys say
        cx.keyed |= !self.keys.is_empty();
        let keyed = Keyed::compile(cx, &self.keys);
        let twice = [
            ("translate", self.translate != [0.0; 3], keyed.translate.first().map(|key| key.index)),
            (turn.field(), rotation.is_some(), keyed.rotation.first().map(|key| key.index)),
            ("scale", self.scale != ScaleDesc::ONE, keyed.scale.first().map(|key| key.index)),
        ];
        for (field, said, key) in twice {
            if let (true, Some(key)) = (said, key) {
                let message = format!("it is said here and by keys[{key}] as well");
                cx.error(field, message, Some("say it here, where it stays, or in keys"));
            }
        }
        if self.keys.is_empty() && self.interpolation != Interpolation::Linear {
            let message = format!("\"{}\" has no effect without keys", self.interpolation.name());
            cx.error("interpolation", message, Some("take it out, or give keys"));
        }
        // Both at the moment that is asked for
        let step = self.interpolation == Interpolation::Step;
        let translate = keyed.translate_at(time, step).unwrap_or(DVec3::from(self.translate));
        let rotation = keyed.rotation_at(time, step).or(rotation).unwrap_or(Rotation::NONE);
        let scale = match keyed.scale_at(time, step) {
            Some(scale) => {
                // Between two good scales of unlike signs there is one that flattens
                if !scale.to_array().iter().all(|s| SCALES.contains(&s.abs())) {
                    let message = format!("at {time} s the scale is {}, which is flat", show(&scale.to_array()));
                    let hint = "keep each scale on one side of 0, or write interpolation = \"step\"";
                    cx.error("keys", message, Some(hint));
                }
                scale
            }
            None => DVec3::from(self.scale.xyz),
        };
        DAffine3 { matrix3: rotation.matrix() * DMat3::from_diagonal(scale), translation: translate }
    }

    fn compile_matrix(&self, cx: &mut CompileContext, m: &[f64; 12]) -> DAffine3 {
        let others = Self { matrix: None, ..self.clone() };
        if others != Self::default() {
            let hint = "keep the matrix, or say its parts without it";
            cx.error("matrix", "it stands for the whole transform, and more is said beside it", Some(hint));
        }
        let column = |i: usize| [m[i], m[4 + i], m[8 + i]];
        let columns = [column(0), column(1), column(2)];
        let [x, y, z] = columns.map(DVec3::from);
        let translation = DVec3::from(column(3));
        // The same limits as for a scale and a translation said in words
        let sizes_fine = [x, y, z].iter().all(|c| SCALES.contains(&c.length()));
        let place_fine = translation.to_array().iter().all(|c| c.abs() <= *SCALES.end());
        let [a, b, c] = columns.map(|c| show(&c));
        if !place_fine {
            let message = format!("its fourth column {} is outside -2.5e8 to 2.5e8", show(&column(3)));
            cx.error("matrix", message, Some("the fourth of each row of four translates"));
        } else if !sizes_fine {
            let message = format!("of its columns {a}, {b} and {c} one has no length from 1e-9 to 2.5e8");
            cx.error("matrix", message, Some("three rows of four numbers, the fourth of each translates"));
        } else if !(x.cross(y).dot(z).abs() > MIN_VOLUME * x.length() * y.length() * z.length()) {
            let message = format!("its columns {a}, {b} and {c} lie in one plane: what it makes is flat");
            cx.error("matrix", message, Some("three rows of four numbers, the fourth of each translates"));
        }
        DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation }
    }
}

/// Whether a matrix of a transform may be this: nothing is flat, too large, or no number.
pub(crate) fn is_invertible(affine: &DAffine3) -> bool {
    let [x, y, z] = [affine.matrix3.x_axis, affine.matrix3.y_axis, affine.matrix3.z_axis];
    let sizes_fine = [x, y, z].iter().all(|c| SCALES.contains(&c.length()));
    let place_fine = affine.translation.to_array().iter().all(|c| c.abs() <= *SCALES.end());
    sizes_fine && place_fine && x.cross(y).dot(z).abs() > MIN_VOLUME * x.length() * y.length() * z.length()
}

/// Refuses a scale that flattens.
fn check_scale(cx: &mut CompileContext, scale: ScaleDesc) {
    if !scale.xyz.iter().all(|s| SCALES.contains(&s.abs())) {
        let [x, y, z] = scale.xyz;
        let shown = if x == y && y == z { show(&[x]) } else { show(&scale.xyz) };
        let message = format!("{shown} is outside [1e-9, 2.5e8], and below 0 outside [-2.5e8, -1e-9]");
        cx.error("scale", message, Some("1 leaves the size as it is; 0 would flatten"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compiled(transform: &TransformDesc, time: f64) -> DAffine3 {
        let cx = &mut CompileContext::default();
        let affine = transform.compile(cx, time);
        assert!(cx.take_faults().is_empty(), "{transform:?}");
        affine
    }

    fn faults(transform: &TransformDesc, time: f64) -> Vec<String> {
        let cx = &mut CompileContext::default();
        assert_eq!(transform.compile(cx, time), DAffine3::IDENTITY);
        cx.take_faults().iter().map(ToString::to_string).collect()
    }

    fn key(time: f64) -> TransformKeyDesc {
        TransformKeyDesc::new(time)
    }

    #[test]
    fn scale_comes_first_and_translation_last() {
        let transform = TransformDesc {
            translate: [10.0, 0.0, 0.0],
            rotate_deg: [0.0, 0.0, 90.0],
            scale: [2.0, 3.0, 4.0].into(),
            ..TransformDesc::default()
        };
        let p = compiled(&transform, 0.0).transform_point3(DVec3::new(1.0, 1.0, 1.0));
        // (1, 1, 1) -> (2, 3, 4) -> (-3, 2, 4) -> (7, 2, 4), and a right angle is exact
        assert_eq!(p, DVec3::new(7.0, 2.0, 4.0));
    }

    #[test]
    fn euler_angles_are_about_fixed_axes_x_first() {
        let turn = |rotate_deg| compiled(&TransformDesc { rotate_deg, ..TransformDesc::default() }, 0.0);
        // y to z about x, then z to x about y, then x to y about z
        assert_eq!(turn([90.0, 0.0, 0.0]).transform_vector3(DVec3::Y), DVec3::Z);
        assert_eq!(turn([90.0, 90.0, 0.0]).transform_vector3(DVec3::Y), DVec3::X);
        assert_eq!(turn([90.0, 90.0, 90.0]).transform_vector3(DVec3::Y), DVec3::Y);
        assert_eq!(turn([450.0, -270.0, 3690.0]).matrix3, turn([90.0, 90.0, 90.0]).matrix3);
    }

    #[test]
    fn a_matrix_is_three_rows() {
        let m = [0.0, -2.0, 0.0, 5.0, 2.0, 0.0, 0.0, 6.0, 0.0, 0.0, 2.0, 7.0];
        let matrix = compiled(&TransformDesc { matrix: Some(m), ..TransformDesc::default() }, 0.0);
        let parts = TransformDesc {
            translate: [5.0, 6.0, 7.0],
            rotate_deg: [0.0, 0.0, 90.0],
            scale: 2.0.into(),
            ..TransformDesc::default()
        };
        assert_eq!(matrix, compiled(&parts, 0.0));
    }

    #[test]
    fn what_is_keyed_moves_and_the_rest_stays() {
        let transform = TransformDesc {
            scale: 2.0.into(),
            keys: vec![
                TransformKeyDesc { translate: Some([0.1, 0.0, 0.0]), ..key(-1.0) },
                TransformKeyDesc { rotate_deg: Some([0.0, 0.0, 0.0]), ..key(0.0) },
                TransformKeyDesc { translate: Some([0.7, 0.0, 0.0]), ..key(1.0) },
                TransformKeyDesc { rotate_deg: Some([0.0, 360.0, 0.0]), ..key(4.0) },
            ],
            ..TransformDesc::default()
        };
        let at = |time| compiled(&transform, time);
        // Exact at keys, and held beyond the ends
        for (time, x) in [(-9.0, 0.1), (-1.0, 0.1), (0.0, 0.1 + (0.7 - 0.1) * 0.5), (1.0, 0.7), (9.0, 0.7)] {
            assert_eq!(at(time).translation.x, x, "{time}");
        }
        // A full turn, not none: a quarter after a quarter of the time
        assert_eq!(at(1.0).transform_vector3(DVec3::Z), DVec3::X * 2.0);
        assert_eq!(at(2.0).transform_vector3(DVec3::Z), -DVec3::Z * 2.0);
        assert_eq!(at(4.0).transform_vector3(DVec3::Z), DVec3::Z * 2.0);
        // Steps hold the earlier key until the later one's time
        let steps = TransformDesc { interpolation: Interpolation::Step, ..transform.clone() };
        for (time, x) in [(-2.0, 0.1), (0.999, 0.1), (1.0, 0.7)] {
            assert_eq!(compiled(&steps, time).translation.x, x, "{time}");
        }
    }

    #[test]
    fn scale_is_interpolated_and_refused_where_it_flattens() {
        let transform = TransformDesc {
            keys: vec![
                TransformKeyDesc { scale: Some(1.0.into()), ..key(0.0) },
                TransformKeyDesc { scale: Some([3.0, 1.0, -1.0].into()), ..key(2.0) },
            ],
            ..TransformDesc::default()
        };
        assert_eq!(compiled(&transform, 0.5).matrix3, DMat3::from_diagonal(DVec3::new(1.5, 1.0, 0.5)));
        assert_eq!(
            faults(&transform, 1.0),
            ["keys: at 1 s the scale is [2, 1, 0], which is flat; keep each scale on one side of 0, or write \
              interpolation = \"step\""]
        );
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let none = TransformDesc::default;
        let first = |transform: &TransformDesc| {
            let faults = faults(transform, 0.0);
            assert_eq!(faults.len(), 1, "{faults:?}");
            faults[0].split("; ").next().expect("has a beginning").to_owned()
        };
        let flat = [1.0, 2.0, 3.0, 0.0, 2.0, 4.0, 6.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        for (transform, words) in [
            (
                TransformDesc { scale: 0.0.into(), ..none() },
                "scale: 0 is outside [1e-9, 2.5e8], and below 0 outside [-2.5e8, -1e-9]",
            ),
            (
                TransformDesc { scale: [1.0, f64::NAN, 1.0].into(), ..none() },
                "scale: [1, NaN, 1] is outside [1e-9, 2.5e8], and below 0 outside [-2.5e8, -1e-9]",
            ),
            (
                TransformDesc { matrix: Some(flat), ..none() },
                "matrix: its columns [1, 2, 0], [2, 4, 0] and [3, 6, 1] lie in one plane: what it makes is flat",
            ),
            (
                TransformDesc { matrix: Some([0.0; 12]), ..none() },
                "matrix: of its columns [0, 0, 0], [0, 0, 0] and [0, 0, 0] one has no length from 1e-9 to 2.5e8",
            ),
            (
                TransformDesc { matrix: Some([f64::INFINITY; 12]), ..none() },
                "matrix: its fourth column [inf, inf, inf] is outside -2.5e8 to 2.5e8",
            ),
            (
                TransformDesc {
                    matrix: Some([1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
                    translate: [1.0, 0.0, 0.0],
                    ..none()
                },
                "matrix: it stands for the whole transform, and more is said beside it",
            ),
            (
                TransformDesc { translate: [f64::INFINITY, 0.0, 0.0], ..none() },
                "translate: [inf, 0, 0] is not finite in 32 bits",
            ),
            (
                TransformDesc { rotate_deg: [0.0, 1e10, 0.0], ..none() },
                "rotate_deg: [0, 10000000000, 0] is outside [-1e9, 1e9]",
            ),
            (
                TransformDesc { rotate_axis: Some([0.0; 3]), angle_deg: Some(1.0), ..none() },
                "rotate_axis: [0, 0, 0] has no length",
            ),
            (
                TransformDesc { rotate_axis: Some([1.0; 3]), ..none() },
                "rotate_axis: [1, 1, 1] has no effect without angle_deg",
            ),
            (TransformDesc { angle_deg: Some(3.0), ..none() }, "angle_deg: 3 has no effect without rotate_axis"),
            (TransformDesc { quaternion: Some([0.0; 4]), ..none() }, "quaternion: [0, 0, 0, 0] has no length"),
            (
                TransformDesc { quaternion: Some([0.0, 0.0, 0.0, 1.0]), rotate_deg: [1.0, 0.0, 0.0], ..none() },
                "quaternion: rotate_deg says a rotation already",
            ),
            (
                TransformDesc {
                    translate: [1.0, 0.0, 0.0],
                    keys: vec![key(0.0), TransformKeyDesc { translate: Some([0.0; 3]), ..key(1.0) }],
                    ..none()
                },
                "keys[0]: it says nothing but its time",
            ),
            (
                TransformDesc { interpolation: Interpolation::Step, ..none() },
                "interpolation: \"step\" has no effect without keys",
            ),
        ] {
            let faults = faults(&transform, 0.0);
            assert!(faults[0].starts_with(words), "{words}\n{faults:?}");
            if transform.keys.is_empty() {
                assert_eq!(first(&transform), words);
            } else {
                assert!(faults[1].starts_with("translate: it is said here and by keys[1] as well"), "{faults:?}");
            }
        }
    }

    #[test]
    fn keys_come_one_after_the_other_and_turn_in_one_way() {
        let euler = |time| TransformKeyDesc { rotate_deg: Some([0.0; 3]), ..key(time) };
        let quaternion = |time| TransformKeyDesc { quaternion: Some([0.0, 0.0, 0.0, 1.0]), ..key(time) };
        let of = |keys| faults(&TransformDesc { keys, ..TransformDesc::default() }, 0.0);
        assert_eq!(
            of(vec![euler(1.0), euler(1.0), euler(0.5)]),
            [
                "keys[1].time: 1 is not after 1, the time of keys[0]; write the keys in the order of their times, \
                 each once",
                "keys[2].time: 0.5 is not after 1, the time of keys[1]; write the keys in the order of their times, \
                 each once"
            ]
        );
        assert_eq!(
            of(vec![euler(0.0), quaternion(1.0)]),
            ["keys[1].quaternion: keys[0] says rotate_deg; write all keys of a transform with rotate_deg, or none"]
        );
        assert_eq!(of(vec![euler(f64::NAN)]), ["keys[0].time: NaN is outside [-1000000000, 1000000000]; in seconds"]);
    }
}
