//! Relighting: a picture with other strengths and colours of its lights, from the buffers of a file, without a render.
//!
//! A pixel is the sum of its terms, and the terms of a light are its scale times what the file holds. So the sum is the
//! one that a render makes, in its order; where every light is sampled at every camera ray, with its bits.

use serde_json::{Value, json};

use crate::color::{Display, Rgb};
use crate::context::MAX_STRENGTH;
use crate::describe::{ColorDesc, SamplesDesc};
use crate::ids::{LightId, SurfaceId};
use crate::image::{Buffer, Image, LightPart, Plane, PlaneVec, Receipt, StoredPlanes};
use crate::light::{Light, LightScale, MAX_LIGHT};
use crate::scene::{MAX_ANTIALIASING, Scene};

use super::receipt::SHADOW_CATCHERS;
use super::resolve::Emission;
use super::settings::RenderSettings;

/// How a light is changed.
#[derive(Clone, Debug, PartialEq)]
pub enum LightChange {
    /// Its strength is multiplied by this.
    Times(f64),
    /// Its strength becomes this.
    Strength(f64),
    /// Its colour becomes this.
    Color(ColorDesc),
}

/// A picture that was lit again.
#[derive(Clone, Debug)]
pub struct Relit {
    /// The picture.
    pub image: Image,
    /// How the scene is displayed.
    pub display: Display,
    /// That of the file, with the changes.
    pub receipt: Receipt,
    /// Whether the scene has shadow catchers: their shadows are those of the lights as they were.
    pub keeps_shadows: bool,
}

/// Why a picture cannot be lit again, with what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RelightError(String);

/// The entry of a receipt with the lights.
const LIGHTS: &str = "lights";
/// The entry with the display of the scene.
const SCENE_DISPLAY: &str = "scene_display";
/// The entry with the changes of the lights: a picture that has it is of no scene.
pub(super) const RELIT: &str = "relit";

/// A light of a file.
struct FiledLight {
    name: Option<String>,
    scale: LightScale,
    /// The names of the buffers of its light, and of its coverage if it may be visible.
    sends: [String; 2],
    seen: Option<String>,
}

impl Scene {
    /// The entries of a receipt with the lights and the display.
    pub(super) fn light_entries(&self, settings: &RenderSettings) -> [(&'static str, String); 2] {
        let samples_all = settings.renderer().samples_all();
        let names = self.light_names();
        let entry = |(number, light): (u32, &Light)| {
            let is_whole = light.said_samples() == SamplesDesc::Exact && !samples_all;
            let LightScale { color, strength, factor } = light.said[usize::from(is_whole)];
            let part = |part| self.buffer_name(Buffer::Light(LightId(number), Some(part)));
            let sends = [LightPart::UnscaledDiffuse, LightPart::UnscaledSpecular].map(part);
            let surface = SurfaceId(self.geometry.surfaces.len() as u32 + number);
            let is_visible = light.area().is_some_and(|area| area.visible);
            let seen = is_visible.then(|| self.buffer_name(Buffer::Coverage(surface)));
            json!({
                "name": names[number as usize], "color": color, "strength": strength, "factor": factor,
                "sends": sends, "seen": seen,
            })
        };
        let all: Vec<Value> = (0..).zip(&self.lights).map(entry).collect();
        [(LIGHTS, Value::from(all).to_string()), (SCENE_DISPLAY, self.display.to_string())]
    }
}

impl FiledLight {
    fn read(value: &Value) -> Option<FiledLight> {
        let number = |key: &str| value.get(key)?.as_f64();
        let color: Vec<f64> = value.get("color")?.as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
        let scale =
            LightScale { color: color.try_into().ok()?, strength: number("strength")?, factor: number("factor")? };
        let text = |value: &Value| value.as_str().map(str::to_owned);
        let sends: Vec<String> = value.get("sends")?.as_array()?.iter().map(text).collect::<Option<_>>()?;
        let (name, seen) = (text(value.get("name")?), text(value.get("seen")?));
        Some(FiledLight { name, scale, sends: sends.try_into().ok()?, seen })
    }
}

/// What is wrong with a file of too little.
fn lacking(fault: String) -> RelightError {
    RelightError(format!("{fault}; render it with --buffers color,relight, to .exr or .npz"))
}

/// The floats of a buffer of a file.
fn floats<'a>(file: &'a StoredPlanes, name: &str, channels: usize) -> Result<&'a [f32], RelightError> {
    match file.plane(name).filter(|plane| plane.channels.len() == channels).map(|plane| &plane.numbers) {
        Some(PlaneVec::Floats(numbers)) => Ok(numbers),
        Some(PlaneVec::Wholes(_)) | None => Err(lacking(format!("it has no buffer {name}"))),
    }
}

/// Lights a picture again. `file` is one that was rendered with the buffers of
/// [`BufferDesc::Relight`](crate::BufferDesc::Relight); each change names a light, or `#3` for the third in scene
/// order.
///
/// The result is what a render of the changed scene gives: with its bits where all lights are sampled and each camera
/// ray is lit by itself, and within the tolerance otherwise. Shadows on shadow catchers stay what they were: how the
/// lights weigh there is in no buffer.
///
/// # Errors
/// The file lacks something; there is no such light; a strength or a colour that cannot be; a light that sent nothing
/// when the file was rendered.
pub fn relight(file: &StoredPlanes, changes: &[(String, LightChange)]) -> Result<Relit, RelightError> {
    let untold = |what: &str| lacking(format!("its receipt does not say {what}"));
    let said = file.receipt.get(LIGHTS).ok_or_else(|| untold("what its lights are"))?;
    let lights: Option<Vec<FiledLight>> =
        serde_json::from_str::<Vec<Value>>(said).ok().and_then(|all| all.iter().map(FiledLight::read).collect());
    let before = lights.ok_or_else(|| untold("what its lights are in words that are known"))?;
    let scales = changed(&before, changes)?;
    // Sum the terms in their order
    let [background, emission, ambient] = [Plane::Background, Plane::Emission, Plane::Ambient].map(Plane::name);
    let (background, ambient) = (floats(file, background, 3)?, floats(file, ambient, 3)?);
    let emission = emitted(file, &before, &scales, floats(file, emission, 3)?)?;
    let mut sums: Vec<f32> = background.iter().zip(&emission).zip(ambient).map(|((b, e), a)| b + e + a).collect();
    for (light, scale) in before.iter().zip(&scales) {
        let Rgb { r, g, b } = scale.rgb();
        for part in &light.sends {
            let values = floats(file, part, 3)?;
            for (sum, value) in sums.as_chunks_mut::<3>().0.iter_mut().zip(values.as_chunks::<3>().0) {
                *sum = [sum[0] + r * value[0], sum[1] + g * value[1], sum[2] + b * value[2]];
            }
        }
    }
    let alpha = floats(file, Plane::Alpha.name(), 1)?;
    let pixels = sums.as_chunks::<3>().0.iter().zip(alpha).map(|(&[r, g, b], a)| [r, g, b, *a]).collect();
    let display = file.receipt.get(SCENE_DISPLAY).and_then(|text| text.parse().ok()).unwrap_or_default();
    let own = |key: &str| !(key == LIGHTS || key == SCENE_DISPLAY || key == "buffers" || key.starts_with("buffer."));
    let mut receipt = Receipt { entries: file.receipt.entries.iter().filter(|(key, _)| own(key)).cloned().collect() };
    receipt.entries.push((RELIT.into(), words(changes)));
    let image = Image { film: file.film, window: file.window, pixels };
    let keeps_shadows = file.receipt.get(SHADOW_CATCHERS).is_some();
    Ok(Relit { image, display, receipt, keeps_shadows })
}

/// What was changed, as a JSON dictionary of lists.
fn words(changes: &[(String, LightChange)]) -> String {
    let word = |(name, change): &(String, LightChange)| match change {
        LightChange::Times(factor) => json!({ "light": name, "times": factor }),
        LightChange::Strength(strength) => json!({ "light": name, "strength": strength }),
        LightChange::Color(color) => json!({ "light": name, "color": color.linear }),
    };
    Value::from(changes.iter().map(word).collect::<Vec<_>>()).to_string()
}

/// The scales of the lights after the changes.
fn changed(lights: &[FiledLight], changes: &[(String, LightChange)]) -> Result<Vec<LightScale>, RelightError> {
    let mut scales: Vec<LightScale> = lights.iter().map(|light| light.scale).collect();
    for (name, change) in changes {
        let at = find(lights, name)?;
        let scale = &mut scales[at];
        match change {
            LightChange::Times(factor) => scale.strength *= factor,
            LightChange::Strength(strength) => scale.strength = *strength,
            LightChange::Color(color) => scale.color = color.linear,
        }
        let refused = |fault: String| Err(RelightError(format!("light {name}: its {fault}")));
        if !(0.0..=MAX_STRENGTH).contains(&scale.strength) {
            return refused(format!("strength would be {}, which is outside [0, 1e15]", scale.strength));
        }
        if let Some(channel) = scale.color.into_iter().find(|channel| !(0.0..).contains(channel)) {
            return refused(format!("colour would be {channel}, which is below 0 or none"));
        }
        if !scale.exact().iter().all(|c| *c <= MAX_LIGHT) {
            return refused("colour times its strength would pass 1e30".into());
        }
        let sent_nothing = |(before, after): (f64, f64)| before == 0.0 && after > 0.0;
        if lights[at].scale.exact().into_iter().zip(scale.exact()).any(sent_nothing) {
            let message = format!(
                "light {name} sent nothing, in one channel or in all, when the file was rendered; render it with a \
                 strength and a colour that are not 0"
            );
            return Err(RelightError(message));
        }
    }
    Ok(scales)
}

/// The light that is called so, or `#3` for the third.
fn find(lights: &[FiledLight], name: &str) -> Result<usize, RelightError> {
    let called: Vec<usize> = (0..lights.len()).filter(|k| lights[*k].name.as_deref() == Some(name)).collect();
    let number = name.strip_prefix('#').and_then(|number| number.parse::<usize>().ok());
    match (called.as_slice(), number) {
        ([at], _) => Ok(*at),
        ([], Some(number)) if (1..=lights.len()).contains(&number) => Ok(number - 1),
        ([], Some(_)) => Err(RelightError(format!("there is no light {name}: the file has {}", lights.len()))),
        ([], None) => {
            let known: Vec<&str> = lights.iter().filter_map(|light| light.name.as_deref()).collect();
            let hint = match crate::describe::nearest(name, &known) {
                Some(near) => format!("did you mean {near}?"),
                None if known.is_empty() => format!("none has a name; they are #1 to #{}", lights.len()),
                None => format!("the file has {}", known.join(", ")),
            };
            Err(RelightError(format!("no light is called {name}; {hint}")))
        }
        (several, _) => {
            let numbers: Vec<String> = several.iter().map(|at| format!("#{}", at + 1)).collect();
            Err(RelightError(format!("{} lights are called {name}; they are {}", several.len(), numbers.join(", "))))
        }
    }
}

/// How many rays end at a light, of their share in single precision: a whole number but behind layers.
fn whole_rays(rays: f64) -> f64 {
    let whole = rays.round();
    if (rays - whole).abs() <= 1e-6 * rays { whole } else { rays }
}

/// A part of a pixel's emission: what is left of it without that of lights is emitted by surfaces if it is more.
const EMISSION_ROUNDING: f32 = 1e-6;

/// The emission of visible lights and of surfaces: that of lights is recomputed if one that may be visible is changed.
/// Exact in pixels that see no surface that emits light; in others the sum is rounded once more.
fn emitted(
    file: &StoredPlanes,
    before: &[FiledLight],
    after: &[LightScale],
    emission: &[f32],
) -> Result<Vec<f32>, RelightError> {
    let is_changed = before.iter().zip(after).any(|(light, scale)| light.seen.is_some() && light.scale != *scale);
    if !is_changed || emission.iter().all(|value| *value == 0.0) {
        return Ok(emission.to_vec());
    }
    let said = file.receipt.get("antialiasing").and_then(|number| number.parse::<u32>().ok());
    let rays = said.filter(|n| (1..=MAX_ANTIALIASING).contains(n)).map(|n| n * n).ok_or_else(|| {
        RelightError(format!(
            "its receipt does not say how many camera rays it has: antialiasing, 1 to {MAX_ANTIALIASING}"
        ))
    })?;
    let of_lights = |scales: &mut dyn Iterator<Item = LightScale>| {
        let mut sums = vec![Emission::default(); emission.len() / 3];
        for (light, scale) in before.iter().zip(scales) {
            let Some(seen) = &light.seen else { continue };
            let shares = floats(file, seen, 1)?;
            if let Some(share) = shares.iter().find(|share| !(0.0..=1.0).contains(*share)) {
                return Err(RelightError(format!(
                    "a pixel of its buffer {seen} is {share}, which is no share: 0 to 1"
                )));
            }
            let radiance = scale.radiance();
            for (sum, share) in sums.iter_mut().zip(shares) {
                sum.add(radiance, whole_rays(f64::from(*share) * f64::from(rays)));
            }
        }
        Ok(sums.into_iter().flat_map(|sum| sum.mean(rays).to_array()).collect::<Vec<f32>>())
    };
    let was = of_lights(&mut before.iter().map(|light| light.scale))?;
    let becomes = of_lights(&mut after.iter().copied())?;
    let beside_surfaces = emission.iter().zip(was).zip(becomes).map(|((emission, was), becomes)| {
        let of_surfaces = emission - was;
        if of_surfaces.abs() <= EMISSION_ROUNDING * emission { becomes } else { becomes + of_surfaces }
    });
    Ok(beside_surfaces.collect())
}
