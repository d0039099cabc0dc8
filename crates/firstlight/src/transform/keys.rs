//! Keys: what a transform is at certain times, and what it is between them.

use super::check_scale;
use super::rotation::{Rotation, Turn};
use crate::context::CompileContext;
use crate::describe::{ScaleDesc, table};
use crate::math::DVec3;

table! {
    /// One of the `keys` of a transform: what it is at a time.
    ///
    /// Translation, rotation and scale are three matters of their own: each goes from one key that says it to the next
    /// that does. Before its first key and after its last it stays as that key says. Between two keys with `rotate_deg`
    /// the three angles change at a constant rate, so that from 0 to 360 is a full turn; so does the angle between two
    /// keys of the same `rotate_axis`. Between quaternions, and between different axes, the rotation goes the shortest
    /// way.
    ///
    /// ```toml
    /// [camera]
    /// position = [0, 0, 10]
    ///
    /// [[light.point]]
    /// position = [4, 3, 0]
    ///
    /// [light.point.transform]
    /// keys = [
    ///   { time = 0, rotate_deg = [0, 0, 0] },
    ///   { time = 2, rotate_deg = [0, 360, 0] },
    /// ]
    /// ```
    pub struct TransformKeyDesc {
        /// When, in seconds, from -1e9 to 1e9; after the key before.
        pub time: f64,
        /// As `translate` of the transform.
        pub translate: Option<[f64; 3]> = None,
        /// As `rotate_deg` of the transform. If one key has it, no key says its rotation in another way.
        pub rotate_deg: Option<[f64; 3]> = None,
        /// As `rotate_axis` of the transform.
        pub rotate_axis: Option<[f64; 3]> = None,
        /// As `angle_deg` of the transform, with `rotate_axis` in the same key.
        pub angle_deg: Option<f64> = None,
        /// As `quaternion` of the transform.
        pub quaternion: Option<[f64; 4]> = None,
        /// As `scale` of the transform.
        pub scale: Option<ScaleDesc> = None,
    }
}

/// No time is farther from 0, in seconds.
pub(crate) const MAX_TIME: f64 = 1e9;

/// What one key says of one matter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Key<T> {
    /// Which of the keys it is.
    pub index: usize,
    pub time: f64,
    pub value: T,
}

/// What the keys say, matter by matter, in the order of time.
#[derive(Debug, Default)]
pub(super) struct Keyed {
    pub translate: Vec<Key<DVec3>>,
    pub rotation: Vec<Key<Rotation>>,
    pub scale: Vec<Key<DVec3>>,
}

impl Keyed {
    /// Checks all keys.
    pub(super) fn compile(cx: &mut CompileContext, keys: &[TransformKeyDesc]) -> Self {
        let mut keyed = Self::default();
        for (index, desc) in keys.iter().enumerate() {
            cx.within(&format!("keys[{index}]"), |cx| {
                let time = cx.between("time", desc.time, -MAX_TIME, MAX_TIME, Some("in seconds"));
                let before = index.checked_sub(1).map(|before| (before, keys[before].time));
                if let Some((before, earlier)) = before.filter(|(_, earlier)| time <= *earlier) {
                    let message = format!("{time} is not after {earlier}, the time of keys[{before}]");
                    cx.error("time", message, Some("write the keys in the order of their times, each once"));
                }
                desc.compile(cx, index, &mut keyed);
            });
        }
        keyed
    }

    /// The translation at `time`, if there are keys that say one.
    pub(super) fn translate_at(&self, time: f64, step: bool) -> Option<DVec3> {
        at(&self.translate, time, step, mix)
    }

    /// The rotation at `time`, if there are keys that say one.
    pub(super) fn rotation_at(&self, time: f64, step: bool) -> Option<Rotation> {
        at(&self.rotation, time, step, Rotation::mix)
    }

    /// The scale at `time`, if there are keys that say one.
    pub(super) fn scale_at(&self, time: f64, step: bool) -> Option<DVec3> {
        at(&self.scale, time, step, mix)
    }
}

impl TransformKeyDesc {
    /// Adds what this key says to `keyed`.
    fn compile(&self, cx: &mut CompileContext, index: usize, keyed: &mut Keyed) {
        let (time, fine) = (self.time, cx.fault_count());
        if let Some(translate) = self.translate {
            cx.point("translate", translate);
            keyed.translate.push(Key { index, time, value: translate.into() });
        }
        let turn =
            Turn { deg: self.rotate_deg, axis: self.rotate_axis, angle: self.angle_deg, quaternion: self.quaternion };
        if let Some(value) = turn.compile(cx) {
            let euler = |rotation: &Rotation| matches!(rotation, Rotation::Euler(_));
            if let Some(first) = keyed.rotation.first()
                && euler(&first.value) != euler(&value)
            {
                let other = match first.value {
                    Rotation::Euler(_) => "rotate_deg",
                    Rotation::Axis(..) => "rotate_axis",
                    Rotation::Quaternion(_) => "quaternion",
                };
                let hint = "write all keys of a transform with rotate_deg, or none";
                cx.error(turn.field(), format!("keys[{}] says {other}", first.index), Some(hint));
            }
            keyed.rotation.push(Key { index, time, value });
        }
        if let Some(scale) = self.scale {
            check_scale(cx, scale);
            keyed.scale.push(Key { index, time, value: scale.xyz.into() });
        }
        if cx.fault_count() == fine && *self == Self::new(time) {
            cx.error("", "it says nothing but its time", Some("give it translate, a rotation or scale"));
        }
    }
}

fn mix(a: DVec3, b: DVec3, f: f64) -> DVec3 {
    a + (b - a) * f
}

/// The value at `time`: at a key exactly its own, before the first and after the last key theirs.
fn at<T: Copy>(keys: &[Key<T>], time: f64, step: bool, mix: impl Fn(T, T, f64) -> T) -> Option<T> {
    let later = keys.partition_point(|key| key.time <= time);
    let Some(from) = later.checked_sub(1).map(|i| keys[i]) else {
        return keys.first().map(|first| first.value);
    };
    match keys.get(later) {
        Some(to) if !step && time > from.time => {
            Some(mix(from.value, to.value, (time - from.time) / (to.time - from.time)))
        }
        _ => Some(from.value),
    }
}
