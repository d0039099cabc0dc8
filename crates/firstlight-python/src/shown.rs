//! How a scene is shown that lacks lights or a camera: the studio, and where a camera that is found looks from.

use firstlight::{
    Framing, Parsed, SceneDesc, ShapeDesc, Studio, StudioSettings, UpAxis, View, gltf_animations, is_gltf,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::did_you_mean;

/// What is found for a scene that lacks it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shown {
    /// The studio whose lights and ground the scene gets; `None`: those of the scene alone.
    pub studio: Option<StudioSettings>,
    pub framing: Framing,
    /// The file, where the scene is a model by itself.
    pub model: Option<ModelFile>,
}

/// The file of a model by itself.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelFile {
    /// What messages call it.
    pub name: String,
    /// What the description calls it.
    pub file: String,
}

/// What a pickled scene says of how it is shown: the words of [`settings`]; azimuth, elevation and margin; the model.
pub type Pickled<'py> = (Option<Bound<'py, PyDict>>, [f64; 3], Option<(String, String)>);

impl Shown {
    /// Has a camera that is found look from `view`, with `margin`, where they are given.
    pub fn frame(&mut self, from: Option<&Bound<'_, PyAny>>, around: Option<f64>) -> PyResult<()> {
        if let Some(from) = from {
            self.framing.view = view(from)?;
        }
        if let Some(around) = around {
            self.framing.margin = margin(around)?;
        }
        Ok(())
    }

    /// The settings of the model, where what a call says shows more of it than it does by itself: the time plays its
    /// first animation, and the name of a camera brings its cameras. `is_named`: a camera was named. `None` where it
    /// shows nothing else, `bytes` is what is in the file.
    pub fn played(
        &self,
        plays: bool,
        is_named: bool,
        bytes: impl FnOnce() -> Option<Vec<u8>>,
    ) -> Option<StudioSettings> {
        let mut studio = self.studio.clone().filter(|_| self.model.is_some() && (plays || is_named))?;
        let bytes = bytes().filter(|bytes| is_gltf(bytes) || bytes.trim_ascii_start().starts_with(b"{"))?;
        if plays && studio.animation.is_none() && !gltf_animations(&bytes).is_empty() {
            studio.animation = Some("0".to_owned());
        }
        studio.cameras |= is_named;
        (Some(&studio) != self.studio.as_ref()).then_some(studio)
    }

    /// The description of the model by itself, as it is now, with other settings.
    pub fn with(&self, desc: &SceneDesc, studio: &StudioSettings) -> Option<Parsed> {
        let ModelFile { name, file } = self.model.as_ref()?;
        let mut parsed = Parsed::of_model(name, file, studio);
        parsed.desc = desc.clone();
        for shape in &mut parsed.desc.shapes {
            if let ShapeDesc::Model(model) = shape
                && model.file.0 == *file
            {
                model.animation = model.animation.take().or_else(|| studio.animation.clone());
                model.cameras |= studio.cameras;
            }
        }
        Some(parsed)
    }

    /// As it is pickled.
    pub fn pickled<'py>(&self, py: Python<'py>) -> PyResult<Pickled<'py>> {
        let studio = self.studio.as_ref().map(|studio| words_of(py, studio)).transpose()?;
        let View { azimuth_deg, elevation_deg } = self.framing.view;
        let model = self.model.as_ref().map(|model| (model.name.clone(), model.file.clone()));
        Ok((studio, [azimuth_deg, elevation_deg, self.framing.margin], model))
    }

    /// From what was pickled.
    pub fn restored((studio, [azimuth, elevation, margin], model): Pickled<'_>) -> PyResult<Self> {
        Ok(Shown {
            studio: studio.map(|studio| settings(&studio)).transpose()?,
            framing: Framing { view: View::new(azimuth, elevation), margin, ..Framing::default() },
            model: model.map(|(name, file)| ModelFile { name, file }),
        })
    }
}

/// The settings of a studio as a dict, of which [`settings`] makes the same.
fn words_of<'py>(py: Python<'py>, studio: &StudioSettings) -> PyResult<Bound<'py, PyDict>> {
    let StudioSettings { studio, ground, up, smooth_deg, variant, scene, animation, cameras } = studio;
    let dict = PyDict::new(py);
    dict.set_item("studio", studio.name())?;
    dict.set_item("ground", ground)?;
    dict.set_item("up", up.map(UpAxis::name))?;
    dict.set_item("smooth_deg", smooth_deg)?;
    dict.set_item("variant", variant)?;
    dict.set_item("scene", scene)?;
    dict.set_item("animation", animation)?;
    dict.set_item("cameras", cameras)?;
    Ok(dict)
}

/// The settings of a studio, from keyword arguments; those that are not there or None are at their defaults.
pub fn settings(words: &Bound<'_, PyDict>) -> PyResult<StudioSettings> {
    let mut settings = StudioSettings::default();
    for (key, value) in words.iter().filter(|(_, value)| !value.is_none()) {
        let key = key.extract::<String>()?;
        let wrong = |wanted: &str| PyTypeError::new_err(format!("{key}: {wanted} is wanted, not {value}"));
        match &*key {
            "studio" => {
                let word = value.extract::<String>().map_err(|_| wrong("a word"))?;
                settings.studio = word_of(&key, &word, Studio::ALL, Studio::name)?;
            }
            "ground" => settings.ground = Some(value.extract().map_err(|_| wrong("True or False"))?),
            "up" => {
                let word = value.extract::<String>().map_err(|_| wrong("a word"))?;
                settings.up = Some(word_of(&key, &word, UpAxis::ALL, UpAxis::name)?);
            }
            "smooth_deg" => settings.smooth_deg = Some(value.extract().map_err(|_| wrong("a number of degrees"))?),
            "variant" => settings.variant = Some(value.extract().map_err(|_| wrong("a name"))?),
            "scene" => settings.scene = Some(value.extract().map_err(|_| wrong("a number from 0 on"))?),
            // By its name, or by its number
            "animation" => settings.animation = Some(value.str()?.to_string()),
            "cameras" => settings.cameras = value.extract().map_err(|_| wrong("True or False"))?,
            _ => return Err(PyTypeError::new_err(format!("a studio has no {key}"))),
        }
    }
    Ok(settings)
}

/// The one of some words.
fn word_of<T: Copy>(key: &str, word: &str, all: &[T], name: impl Fn(T) -> &'static str) -> PyResult<T> {
    all.iter().copied().find(|one| name(*one) == word).ok_or_else(|| {
        let names: Vec<&str> = all.iter().map(|one| name(*one)).collect();
        let (listed, hint) = (names.join(", "), did_you_mean(word, &names));
        PyValueError::new_err(format!("{key} is {word:?}; it is one of {listed}{hint}"))
    })
}

/// The view of that name, or of two angles.
pub fn view(value: &Bound<'_, PyAny>) -> PyResult<View> {
    if let Ok(name) = value.extract::<String>() {
        let names: Vec<&str> = View::NAMED.iter().map(|(name, _)| *name).collect();
        return View::from_name(&name).ok_or_else(|| {
            let (all, hint) = (names.join(", "), did_you_mean(&name, &names));
            PyValueError::new_err(format!("view is {name:?}; it is one of {all}, or azimuth and elevation{hint}"))
        });
    }
    let wanted = |_| PyTypeError::new_err(format!("view: a name, or azimuth and elevation are wanted, not {value}"));
    let [azimuth, elevation] = value.extract::<[f64; 2]>().map_err(wanted)?;
    // Also what is not a number is out of range
    if !(azimuth.abs() <= 360.0 && elevation.abs() <= 90.0) {
        let message = "the azimuth is from -360 to 360 degrees, and the elevation from -90 to 90";
        return Err(PyValueError::new_err(format!("view is [{azimuth}, {elevation}]; {message}")));
    }
    Ok(View::new(azimuth, elevation))
}

/// A margin, if it is one.
pub fn margin(margin: f64) -> PyResult<f64> {
    if (0.0..=Framing::MAX_MARGIN).contains(&margin) {
        return Ok(margin);
    }
    let most = Framing::MAX_MARGIN;
    Err(PyValueError::new_err(format!(
        "margin is {margin}; it is from 0 to {most}, a part of the picture's shorter side"
    )))
}
