//! What animations say of nodes at a moment.
//!
//! Source: "glTF 2.0 specification", section 3.11 and appendix C, "Animation Sampler Interpolation Modes".

use super::json::JsonPlace;
use super::nodes::Pose;
use super::{Gltf, GltfFault};
use crate::math::{DQuat, DVec3};

/// What an animation says of a node; `None` where it says nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct AnimatedNode {
    pub translation: Option<DVec3>,
    pub rotation: Option<DQuat>,
    pub scale: Option<DVec3>,
    pub weights: Option<Vec<f32>>,
}

impl AnimatedNode {
    /// Whether it says where the node is.
    pub fn moves(&self) -> bool {
        self.translation.is_some() || self.rotation.is_some() || self.scale.is_some()
    }
}

/// How values between two keys are made.
#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Step,
    Linear,
    CubicSpline,
}

/// The values of a channel around a moment.
struct SampledKeys<'a> {
    mode: Mode,
    values: &'a [f32],
    /// Numbers in a value.
    width: usize,
    /// The two keys, and how far the moment lies between them: 0 to 1.
    keys: [usize; 2],
    between: f64,
    /// Seconds between them.
    span: f64,
}

impl Gltf {
    /// The moment of the last key of an animation, in seconds; 0 without keys.
    pub(crate) fn duration(&self, animation: usize) -> Result<f64, GltfFault> {
        let mut last = 0.0f64;
        for sampler in self.root().nth("animations", animation)?.list("samplers")? {
            let input = sampler.need("input")?;
            // Files have to say it; of those that do not, the keys do
            let said = self.root().of_index("accessors", &input)?.get("max").and_then(|max| max.numbers().ok());
            let end = match said {
                Some([end]) => Some(end),
                None => self.numbers(&input)?.last().map(|end| f64::from(*end)),
            };
            last = last.max(end.unwrap_or(0.0));
        }
        Ok(last)
    }

    /// What the animation says at the moment, node by node.
    pub(super) fn animate(&self, pose: &Pose, nodes: &mut [AnimatedNode]) -> Result<(), GltfFault> {
        let animation = self.root().nth("animations", pose.animation)?;
        let samplers = animation.list("samplers")?;
        for channel in animation.list("channels")? {
            let target = channel.need("target")?;
            // A channel without a node is that of an extension
            let Some(node) = target.get("node") else { continue };
            let count = nodes.len();
            let Some(node) = nodes.get_mut(node.index()?) else {
                return Err(node.fault(format!("there is no such node; there are {count}")));
            };
            let wanted = channel.need("sampler")?;
            let Some(sampler) = samplers.get(wanted.index()?) else {
                return Err(wanted.fault(format!("there is no such sampler; there are {}", samplers.len())));
            };
            let sampled = |width: Option<usize>| self.sample(sampler, pose.time, width);
            match target.need("path")?.text()? {
                "translation" => node.translation = Some(vector(&sampled(Some(3))?)),
                "scale" => node.scale = Some(vector(&sampled(Some(3))?)),
                "rotation" => node.rotation = Some(self.turned(sampler, pose.time)?),
                "weights" => node.weights = Some(sampled(None)?.iter().map(|weight| *weight as f32).collect()),
                _ => {}
            }
        }
        Ok(())
    }

    /// The values of a sampler at `time`. Of `width` numbers, or as many as there are for each key.
    fn sample(&self, sampler: &JsonPlace<'_>, time: f64, width: Option<usize>) -> Result<Vec<f64>, GltfFault> {
        self.keys(sampler, time, width, |keys| keys.value())
    }

    /// The rotation of a sampler at `time`: linear ones go the shortest way around the sphere.
    fn turned(&self, sampler: &JsonPlace<'_>, time: f64) -> Result<DQuat, GltfFault> {
        self.keys(sampler, time, Some(4), |keys| {
            let quaternion = |values: &[f64]| DQuat::from_xyzw(values[0], values[1], values[2], values[3]);
            match keys.mode {
                Mode::Linear => {
                    let [a, b] = keys.keys.map(|key| quaternion(&keys.at(key, 0).collect::<Vec<_>>()));
                    slerp(a, b, keys.between)
                }
                Mode::Step | Mode::CubicSpline => quaternion(&keys.value()),
            }
        })
    }

    fn keys<R>(
        &self,
        sampler: &JsonPlace<'_>,
        time: f64,
        width: Option<usize>,
        read: impl FnOnce(&SampledKeys<'_>) -> R,
    ) -> Result<R, GltfFault> {
        let mode = match sampler.text_of("interpolation") {
            None | Some("LINEAR") => Mode::Linear,
            Some("STEP") => Mode::Step,
            Some("CUBICSPLINE") => Mode::CubicSpline,
            Some(other) => {
                let shown: String = other.chars().take(40).collect();
                return Err(sampler.fault(format!("{shown:?} is none of LINEAR, STEP and CUBICSPLINE")));
            }
        };
        let times = self.numbers(&sampler.need("input")?)?;
        let output = sampler.need("output")?;
        let values = self.numbers(&output)?;
        // A cubic key has three values: the tangent before it, the value, the tangent behind it
        let parts = if mode == Mode::CubicSpline { 3 } else { 1 };
        let width = width.unwrap_or(values.len() / (parts * times.len().max(1)));
        if times.is_empty() || values.len() < times.len().saturating_mul(parts * width) {
            let message = format!("{} numbers for {} keys with {width} each", values.len(), times.len());
            return Err(output.fault(message));
        }
        let after = times.partition_point(|key| f64::from(*key) <= time);
        let keys = [after.saturating_sub(1), after.min(times.len() - 1)];
        let [from, to] = keys.map(|key| f64::from(times[key]));
        let span = to - from;
        let between = if span > 0.0 { ((time - from) / span).clamp(0.0, 1.0) } else { 0.0 };
        Ok(read(&SampledKeys { mode, values: &values, width, keys, between, span }))
    }
}

impl SampledKeys<'_> {
    /// Part `part` of a key: of cubic ones the tangent before, the value, the tangent behind.
    fn at(&self, key: usize, part: usize) -> impl Iterator<Item = f64> {
        let parts = if self.mode == Mode::CubicSpline { 3 } else { 1 };
        let start = (key * parts + part) * self.width;
        self.values[start..start + self.width].iter().map(|value| f64::from(*value))
    }

    fn value(&self) -> Vec<f64> {
        let ([a, b], t) = (self.keys, self.between);
        match self.mode {
            Mode::Step => self.at(a, 0).collect(),
            Mode::Linear => self.at(a, 0).zip(self.at(b, 0)).map(|(a, b)| a + (b - a) * t).collect(),
            Mode::CubicSpline => {
                let [t2, t3] = [t * t, t * t * t];
                let weights = [
                    2.0 * t3 - 3.0 * t2 + 1.0,
                    (t3 - 2.0 * t2 + t) * self.span,
                    3.0 * t2 - 2.0 * t3,
                    (t3 - t2) * self.span,
                ];
                let [v0, behind] = [self.at(a, 1), self.at(a, 2)];
                let [v1, before] = [self.at(b, 1), self.at(b, 0)];
                let parts = v0.zip(behind).zip(v1.zip(before));
                parts
                    .map(|((v0, m0), (v1, m1))| v0 * weights[0] + m0 * weights[1] + v1 * weights[2] + m1 * weights[3])
                    .collect()
            }
        }
    }
}

fn vector(values: &[f64]) -> DVec3 {
    DVec3::new(values[0], values[1], values[2])
}

/// From `a` to `b` the shortest way, at a constant rate.
fn slerp(a: DQuat, b: DQuat, t: f64) -> DQuat {
    let unit = |q: DQuat| if q.length() > 0.0 && q.is_finite() { q / q.length() } else { DQuat::IDENTITY };
    let (a, b) = (unit(a), unit(b));
    let cos = a.dot(b);
    let (b, cos) = if cos < 0.0 { (-b, -cos) } else { (b, cos) };
    // Nearly the same: the chord is the arc
    if cos > 1.0 - 1e-9 {
        return a + (b - a) * t;
    }
    let angle = pxfm::f_acos(cos.min(1.0));
    (a * pxfm::f_sin((1.0 - t) * angle) + b * pxfm::f_sin(t * angle)) / pxfm::f_sin(angle)
}
