//! How two pictures differ, said for people and for programs: of `diff` and of `verify`.

use std::fs;
use std::path::Path;

use firstlight::{DifferingSample, Flip, PlaneDifference, StoredPlanes};
use serde_json::{Value, json};

use crate::report::{Failure, shown};

/// What was found of one buffer.
pub struct Found {
    pub difference: PlaneDifference,
    /// Of colours, what somebody sees who flips between the two.
    pub flip: Option<Flip>,
}

/// Reads a picture file with all its buffers.
///
/// # Errors
/// It cannot be read, or is no picture.
pub fn read(path: &Path) -> Result<StoredPlanes, Failure> {
    let work = |why: String| Failure::Work(format!("{}: {why}", shown(path)));
    if path.is_dir() {
        return Err(work("is a folder, not a picture file".into()));
    }
    let bytes = fs::read(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => work("no such file".into()),
        _ => work(e.to_string()),
    })?;
    StoredPlanes::read(&bytes).map_err(|e| work(e.to_string()))
}

impl Found {
    /// Whether all bits are the same.
    pub fn is_same(&self) -> bool {
        self.difference.differing == 0
    }

    /// A value as it is stored: of floats the shortest that means it.
    fn text(&self, value: f64) -> String {
        let PlaneDifference { distance, steps, .. } = &self.difference;
        let is_whole = distance.is_none() || steps.is_some();
        if is_whole { value.to_string() } else { (value as f32).to_string() }
    }

    /// `at (3, 4) G: 7, 8`
    fn place(&self, sample: &DifferingSample) -> String {
        let ([x, y], [a, b]) = (sample.pixel, sample.values.map(|value| self.text(value)));
        let channels = &self.difference.channels;
        let channel = if channels.len() > 1 { format!(" {}", channels[sample.channel]) } else { String::new() };
        format!("at ({x}, {y}){channel}: {a}, {b}")
    }

    /// A line for people.
    pub fn line(&self) -> String {
        let PlaneDifference { name, samples, differing, pixels, steps, distance, first, .. } = &self.difference;
        if self.is_same() {
            return format!("{name}: the same bits");
        }
        let mut line = format!("{name}: {differing} of {samples} samples differ, in {pixels} pixels");
        if let Some(distance) = distance {
            let of = steps.map(|steps| format!(" of {steps}")).unwrap_or_default();
            let at = distance.most.map(|most| format!(" {}", self.place(&most))).unwrap_or_default();
            line += &format!("; largest difference {}{of}{at}; rms {}", short(distance.max), short(distance.rms));
            if distance.unmatched > 0 {
                line += &format!("; {} finite in one file only or of other signs", distance.unmatched);
            }
        }
        if let Some(first) = first {
            line += &format!("; first {}", self.place(first));
        }
        if let Some(flip) = &self.flip {
            line += &format!("; FLIP mean {}, largest {}", short(flip.mean()), short(flip.max().into()));
        }
        line
    }

    /// The same for programs. JSON has no infinite numbers: they are `null`.
    pub fn json(&self) -> Value {
        let PlaneDifference { name, channels, samples, differing, pixels, steps, distance, first } = &self.difference;
        let number = |value: f64| self.text(value).parse::<f64>().ok().filter(|number| number.is_finite());
        let sample = |sample: &DifferingSample| {
            let values = sample.values.map(number);
            json!({ "pixel": sample.pixel, "channel": channels[sample.channel], "values": values })
        };
        let mut value = json!({
            "name": name,
            "samples": samples,
            "differing": differing,
            "pixels": pixels,
            "first": first.as_ref().map(sample),
        });
        if let Some(distance) = distance {
            value["max"] = json!(distance.max);
            value["steps"] = json!(steps);
            value["rms"] = json!(distance.rms);
            value["unmatched"] = json!(distance.unmatched);
            value["most"] = json!(distance.most.as_ref().map(sample));
        }
        if let Some(flip) = &self.flip {
            value["flip"] = json!({ "mean": flip.mean(), "max": flip.max() });
        }
        value
    }
}

/// A number with four digits that count.
fn short(number: f64) -> String {
    if !number.is_finite() {
        return "infinite".into();
    }
    let digits = format!("{number:.3e}");
    digits.parse::<f64>().unwrap_or(number).to_string()
}
