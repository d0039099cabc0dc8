//! From a receipt back to the settings that rendered the picture, and the values that replaced those of the scene.

use std::str::FromStr;

use super::receipt::{REFERENCE, TRANSPARENT, version};
use super::relight::RELIT;
use super::settings::{AaMode, RenderSettings, VisibilityMode};
use crate::color::Display;
use crate::describe::{ColorDesc, SamplesDesc};
use crate::image::{BufferDesc, Plane, Receipt, Window};
use crate::light::LightDesc;
use crate::scene::{Framing, MotionTo, Scene, SceneDesc, StudioSettings, View};
use crate::shape::ShadowTerminator;

/// The settings in a [`Receipt`], by which its picture can be rendered again: [`apply`](Self::apply) to
/// the description of its scene, compile at [`time`](Self::time), see that the hash is
/// [`scene_hash`](Self::scene_hash), and render with [`settings`](Self::settings).
#[derive(Clone, Debug, PartialEq)]
pub struct ReceiptSettings {
    /// Of firstlight, with the number of its changes of pixels.
    pub version: String,
    /// That of the compiled scene, [`Scene::hash`].
    pub scene_hash: String,
    /// In seconds; 0 where nothing changes with time.
    pub time: f64,
    /// How the camera was found, if it was.
    pub framing: Option<Framing>,
    /// How the model was shown, if the scene is one by itself.
    pub model: Option<StudioSettings>,
    /// In steps of an 8-bit picture, where anything was judged by it.
    pub tolerance: Option<f64>,
    /// How 8- and 16-bit files show the film.
    pub display: Option<Display>,
    /// What the file holds of each pixel.
    pub buffers: Vec<BufferDesc>,
    /// Whereto the motion leads that the file holds.
    motion_to: Option<MotionTo>,
    size: [u32; 2],
    antialiasing: u32,
    camera: String,
    /// `None` for transparent.
    background: Option<ColorDesc>,
    shadow_terminator: ShadowTerminator,
    /// Runs of lights in scene order with the same number of samples.
    light_samples: Vec<(usize, SamplesDesc)>,
    /// But for the buffers.
    settings: RenderSettings,
}

/// What is wrong with a receipt.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReceiptFault {
    /// There is none: another program wrote the file, or took it out.
    #[error("holds no receipt: firstlight did not write it, or another program took the receipt out")]
    Missing,
    /// No scene has the lights of the picture.
    #[error("was lit again after it was rendered: verify the file that it was made of")]
    Relit,
    /// It lacks an entry.
    #[error("its receipt does not say {0}, as those of this version do")]
    Lacks(&'static str),
    /// An entry that no receipt has.
    #[error("its receipt says {key} {value:?}, which no receipt of this version does")]
    Unknown {
        /// The key of the entry.
        key: &'static str,
        /// Its value.
        value: String,
    },
}

/// The entries of a receipt.
struct Entries<'a>(&'a Receipt);

impl Entries<'_> {
    /// What `read` makes of an entry.
    fn optional<T>(&self, key: &'static str, read: impl Fn(&str) -> Option<T>) -> Result<Option<T>, ReceiptFault> {
        let Some(value) = self.0.get(key) else { return Ok(None) };
        read(value).map(Some).ok_or_else(|| ReceiptFault::Unknown { key, value: value.to_owned() })
    }

    fn required<T>(&self, key: &'static str, read: impl Fn(&str) -> Option<T>) -> Result<T, ReceiptFault> {
        self.optional(key, read)?.ok_or(ReceiptFault::Lacks(key))
    }
}

fn number<T: FromStr>(text: &str) -> Option<T> {
    text.parse().ok()
}

/// So many numbers, with `between` between them.
fn numbers<T: FromStr, const N: usize>(text: &str, between: char) -> Option<[T; N]> {
    let numbers: Vec<T> = text.split(between).map(|n| n.parse().ok()).collect::<Option<_>>()?;
    numbers.try_into().ok()
}

fn text(text: &str) -> Option<String> {
    Some(text.to_owned())
}

/// One word for each light, or `3 x exact, 2 x 16`.
fn light_samples(text: &str) -> Option<Vec<(usize, SamplesDesc)>> {
    let samples = |word: &str| match word {
        "exact" => Some(SamplesDesc::Exact),
        word => word.parse().ok().map(SamplesDesc::Count),
    };
    if text.contains(" x ") {
        let run = |run: &str| {
            let (count, word) = run.split_once(" x ")?;
            Some((count.parse().ok()?, samples(word)?))
        };
        return text.split(", ").map(run).collect();
    }
    text.split_whitespace().map(|word| Some((1, samples(word)?))).collect()
}

/// A JSON list of the names of buffers.
fn buffers(text: &str) -> Option<Vec<BufferDesc>> {
    let names: Vec<String> = serde_json::from_str(text).ok()?;
    names.iter().map(|name| BufferDesc::parse(name).ok()).collect()
}

/// A number of seconds, or the name of a camera in quotes.
fn motion_to(text: &str) -> Option<MotionTo> {
    match serde_json::from_str(text).ok()? {
        serde_json::Value::Number(time) => time.as_f64().map(MotionTo::Time),
        serde_json::Value::String(name) => Some(MotionTo::Camera(name)),
        _ => None,
    }
}

impl ReceiptSettings {
    /// Reads a receipt.
    ///
    /// # Errors
    /// It is empty, lacks an entry, or has one that cannot be.
    pub fn read(receipt: &Receipt) -> Result<Self, ReceiptFault> {
        if receipt.entries.is_empty() {
            return Err(ReceiptFault::Missing);
        }
        if receipt.get(RELIT).is_some() {
            return Err(ReceiptFault::Relit);
        }
        let from = Entries(receipt);
        let color = |text: &str| numbers(text, ' ').map(|linear: [f64; 3]| ColorDesc::from(linear));
        let background = |text: &str| if text == TRANSPARENT { Some(None) } else { color(text).map(Some) };
        let view = from.optional("view", |text| numbers(text, ' ').map(|[around, above]| View::new(around, above)))?;
        let framing = |view| {
            let distance = from.optional("view_distance", number)?;
            let time = from.optional("view_time", number)?.unwrap_or(0.0);
            Ok(Framing { view, margin: from.required("margin", number)?, distance, time })
        };
        let crop =
            |text: &str| numbers(text, ',').map(|[x, y, width, height]: [u32; 4]| Window { x, y, width, height });
        let visibility = |text: &str| match text {
            REFERENCE => Some((true, VisibilityMode::Shafts)),
            name => VisibilityMode::from_name(name).map(|mode| (false, mode)),
        };
        let (reference, visibility) =
            from.optional("visibility", visibility)?.unwrap_or((false, VisibilityMode::Shafts));
        Ok(ReceiptSettings {
            version: from.required("version", text)?,
            scene_hash: from.required("scene_hash", text)?,
            time: from.optional("time", number)?.unwrap_or(0.0),
            framing: view.map(framing).transpose()?,
            model: from.optional("model", StudioSettings::from_json)?,
            tolerance: from.optional("tolerance", number)?,
            display: from.optional("display", number)?,
            buffers: from.optional("buffers", buffers)?.unwrap_or_else(|| vec![Plane::Color.into()]),
            motion_to: from.optional("motion_to", motion_to)?,
            size: [from.required("width", number)?, from.required("height", number)?],
            antialiasing: from.required("antialiasing", number)?,
            camera: from.required("camera", text)?,
            background: from.required("background", background)?,
            shadow_terminator: from.required("shadow_terminator", ShadowTerminator::from_name)?,
            light_samples: from.required("light_samples", light_samples)?,
            settings: RenderSettings {
                aa_mode: from.required("aa_mode", AaMode::from_name)?,
                crop: from.optional("crop", crop)?,
                reference,
                visibility,
                ..RenderSettings::default()
            },
        })
    }

    /// What this version calls itself in receipts.
    pub fn this_version() -> String {
        version()
    }

    /// Whether this version wrote the receipt, so that the bits have to be the same.
    pub fn is_of_this_version(&self) -> bool {
        self.version == version()
    }

    /// Sets the values of a description to those that the picture was rendered with.
    pub fn apply(&self, desc: &mut SceneDesc) {
        let render = &mut desc.render;
        [render.width, render.height] = self.size;
        render.antialiasing = self.antialiasing;
        render.tolerance = self.tolerance.unwrap_or(render.tolerance);
        render.camera = Some(self.camera.clone()).filter(|name| !name.is_empty());
        // A transparent one keeps the colour that it does not show
        render.transparent = self.background.is_none();
        render.background = self.background.unwrap_or(render.background);
        render.shadow_terminator = self.shadow_terminator;
        render.buffers = self.buffers.clone();
        render.motion_to = self.motion_to.clone();
        let said = self.light_samples.iter();
        let mut said = said.flat_map(|(count, samples)| std::iter::repeat_n(*samples, *count));
        for light in LightDesc::in_scene_order(&mut desc.lights) {
            if let Some(samples) = said.next() {
                light.set_samples(samples);
            }
        }
    }

    /// The settings that give the same film of the compiled scene.
    pub fn settings(&self, scene: &Scene) -> RenderSettings {
        RenderSettings { buffers: scene.buffers().to_vec(), ..self.settings.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn receipt(entries: &[(&str, &str)]) -> Receipt {
        Receipt { entries: entries.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect() }
    }

    const LEAST: [(&str, &str); 10] = [
        ("version", "0.1.0+pixels.7"),
        ("scene_hash", "9f1c"),
        ("width", "40"),
        ("height", "30"),
        ("antialiasing", "2"),
        ("aa_mode", "full"),
        ("camera", ""),
        ("light_samples", "exact 16 1"),
        ("background", "0 0.25 1"),
        ("shadow_terminator", "hard"),
    ];

    #[test]
    fn every_entry_is_read_or_named() {
        let read = ReceiptSettings::read(&receipt(&LEAST)).unwrap();
        assert_eq!((read.size, read.antialiasing, read.settings.aa_mode), ([40, 30], 2, AaMode::Full));
        assert_eq!(
            (read.background, read.settings.crop, read.tolerance),
            (Some(ColorDesc::linear(0.0, 0.25, 1.0)), None, None)
        );
        let samples = [SamplesDesc::Exact, SamplesDesc::Count(16), SamplesDesc::Count(1)];
        assert_eq!(read.light_samples, samples.map(|samples| (1, samples)));
        assert_eq!(read.buffers, [Plane::Color.into()]);
        assert_eq!(ReceiptSettings::read(&receipt(&[])), Err(ReceiptFault::Missing));
        for (i, (key, _)) in LEAST.into_iter().enumerate() {
            let without = [&LEAST[..i], &LEAST[i + 1..]].concat();
            assert_eq!(ReceiptSettings::read(&receipt(&without)), Err(ReceiptFault::Lacks(key)));
        }
        for (key, value) in [
            ("crop", "1,2,3"),
            ("display", "srgb"),
            ("buffers", "[\"dept\"]"),
            ("view", "1"),
            ("visibility", "x"),
            ("tolerance", "one"),
            ("model", "x"),
            ("motion_to", "north"),
        ] {
            let with = [&LEAST[..], &[(key, value)]].concat();
            let fault = ReceiptFault::Unknown { key, value: value.into() };
            assert_eq!(ReceiptSettings::read(&receipt(&with)), Err(fault));
        }
        assert_eq!(
            ReceiptSettings::read(&receipt(&[&LEAST[..], &[("view", "25 18")]].concat())),
            Err(ReceiptFault::Lacks("margin"))
        );
    }

    #[test]
    fn the_samples_of_many_lights_are_runs() {
        let runs = vec![(17, SamplesDesc::Exact), (3, SamplesDesc::Count(16))];
        assert_eq!(light_samples("17 x exact, 3 x 16"), Some(runs));
        assert_eq!(light_samples(""), Some(Vec::new()));
        assert_eq!(light_samples("17 x"), None);
    }
}
