//! Receipts: the settings and inputs that decide the pixels of a file, kept in the file.

use super::settings::{RenderSettings, Renderer};
use crate::camera::{Camera, Frame, Projection};
use crate::describe::SamplesDesc;
use crate::image::cryptomatte::{self, Named};
use crate::image::{Buffer, LightPart, Plane, Receipt};
use crate::light::Light;
use crate::math::Vec3;
use crate::scene::{Choices, Framing, Scene};

/// Samples of so many lights are listed one by one.
const MOST_LISTED: usize = 1000;

/// How many entries **Pixels** has in the changelog, over all versions. It is part of the version in a receipt, so that
/// two builds whose pictures differ never have the same version. The test below compares it with the changelog.
const PIXELS_ENTRIES: u32 = 116;

/// The version in receipts.
pub(super) fn version() -> String {
    format!("{}+pixels.{PIXELS_ENTRIES}", env!("CARGO_PKG_VERSION"))
}

/// The background entry of a transparent background.
pub(super) const TRANSPARENT: &str = "transparent";
/// The entry of a scene with shadow catchers.
pub(super) const SHADOW_CATCHERS: &str = "shadow_catchers";
/// The visibility entry of the plain renderer.
pub(super) const REFERENCE: &str = "reference";

impl Scene {
    /// The receipt of a picture of this scene: all that decides the film, by the rules that are in effect, so that
    /// settings that give the same film have the same receipt. The display of 8- and 16-bit files is added where they
    /// are [encoded](crate::Image::encode).
    pub fn receipt(&self, settings: &RenderSettings) -> Receipt {
        let mut entries = vec![
            ("version", version()),
            ("scene_hash", self.hash.clone()),
            ("width", self.width.to_string()),
            ("height", self.height.to_string()),
            ("antialiasing", self.antialiasing.to_string()),
            ("aa_mode", settings.renderer_of(self).aa_mode().name().to_owned()),
            ("camera", self.summary.camera.clone()),
            ("world_from_camera", matrix(self.camera.world_from_camera())),
            ("film_half_size", numbers(self.camera.film_half_size())),
            ("light_samples", light_samples(&self.lights, settings)),
            ("color_space", "linear Rec. 709, alpha premultiplied, before display encoding".to_owned()),
        ];
        let Choices { background, shadow_terminator, framing, model } = &self.choices;
        let background = if self.transparent { TRANSPARENT.to_owned() } else { numbers(background.linear) };
        entries.push(("background", background));
        entries.push(("shadow_terminator", shadow_terminator.name().to_owned()));
        if let Some(Framing { view, margin, distance, time }) = framing {
            entries.push(("view", numbers([view.azimuth_deg, view.elevation_deg])));
            entries.push(("margin", margin.to_string()));
            entries.extend(distance.map(|distance| ("view_distance", distance.to_string())));
            // Nothing that stands still has a moment
            if self.time.is_some() && *time != 0.0 {
                entries.push(("view_time", time.to_string()));
            }
        }
        entries.extend(model.iter().map(|model| ("model", model.to_json())));
        entries.extend(Self::matrices(&self.camera));
        // Only integration, and light shared by several rays, depend on the tolerance
        let is_integrated =
            |light: &Light| light.said_samples() == SamplesDesc::Exact && !settings.renderer().samples_all();
        if matches!(settings.renderer_of(self), Renderer::Adaptive | Renderer::Multisample)
            || self.lights.iter().any(is_integrated)
        {
            entries.push(("tolerance", self.tolerance.to_string()));
        }
        if let Some(time) = self.time {
            entries.push(("time", time.to_string()));
        }
        if self.camera.projection() != Projection::Perspective {
            entries.push(("projection", self.camera.projection().name().to_owned()));
        }
        if self.camera.film_shift() != [0.0; 2] {
            entries.push(("film_shift", numbers(self.camera.film_shift())));
        }
        if self.catchers.is_some() {
            entries.push((SHADOW_CATCHERS, "shown".to_owned()));
        }
        if !self.placeholders.is_empty() {
            entries.push(("placeholders", self.placeholders.join(" ")));
        }
        let w = settings.window(self);
        if [w.width, w.height] != [self.width, self.height] {
            entries.push(("crop", format!("{},{},{},{}", w.x, w.y, w.width, w.height)));
        }
        Receipt { entries: entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect() }
    }

    /// The matrices from the world to the pixels of a camera:
    ///
    /// - `intrinsics`: K of a pinhole camera, row by row, in pixels, the middle of the first pixel at (0.5, 0.5), with
    ///   x to the right and y down as OpenCV has them;
    /// - `opencv_camera_from_world` and `opengl_camera_from_world`: 4 x 4, row by row; OpenCV's camera looks along z
    ///   with y down, OpenGL's along -z with y up.
    fn matrices(camera: &Camera) -> Vec<(&'static str, String)> {
        let intrinsics = camera
            .intrinsics()
            .map(|[fx, fy, cx, cy]| ("intrinsics", numbers([fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0])));
        let Frame { position, right, up, forward, .. } = *camera.frame();
        let extrinsics =
            [("opencv_camera_from_world", [right, -up, forward]), ("opengl_camera_from_world", [right, up, -forward])];
        let rows = |(key, axes): (&'static str, [Vec3; 3])| {
            let row = |axis: Vec3| {
                let axis = axis.as_dvec3();
                // Never -0
                numbers([axis.x, axis.y, axis.z, -axis.dot(position)].map(|v| v + 0.0))
            };
            (key, format!("{} 0 0 0 1", axes.map(row).join(" ")))
        };
        intrinsics.into_iter().chain(extrinsics.map(rows)).collect()
    }

    /// The receipt of a file of buffers: the [receipt](Self::receipt) of the picture, and more where there is more than
    /// the picture.
    ///
    /// - `lights` and `scene_display`, with buffers of light without its scale: the lights, and the display of the
    ///   scene, for [`relight`](crate::relight);
    /// - `light_groups`: a JSON list of their names and of the numbers of their lights, from 1;
    /// - `motion_to`, with buffers of motion: its other end, a number of seconds, or the name of a camera in quotes;
    ///   and the three matrices of the camera there, with `motion_` before them;
    /// - `object_names`, `instance_names`, `material_names`: JSON lists, the name of id 1 first, `null` for what has
    ///   none;
    /// - `object_manifest`, `instance_manifest`, `material_manifest`: JSON dictionaries of the same names, `#3` for
    ///   that of id 3 if it has none, to the ids that Cryptomatte has for them, 8 hexadecimal digits.
    pub fn buffers_receipt(&self, settings: &RenderSettings, buffers: &[Buffer]) -> Receipt {
        let mut receipt = self.receipt(settings);
        if matches!(buffers, [Buffer::Plane(Plane::Color)]) {
            return receipt;
        }
        let mut add = |key: &str, value: String| receipt.entries.push((key.to_owned(), value));
        let list = |names: &[Option<&str>]| serde_json::json!(names).to_string();
        let asked: Vec<String> = buffers.iter().map(|buffer| self.buffer_name(*buffer)).collect();
        add("buffers", serde_json::json!(asked).to_string());
        if buffers.contains(&Plane::Rays.into()) {
            // How much work it is, the way decides
            let way = if settings.reference { REFERENCE } else { settings.visibility.name() };
            add("visibility", way.to_owned());
        }
        let of_motion = buffers.iter().any(|buffer| buffer.plane().is_of_motion());
        if let Some(motion) = self.motion.as_deref().filter(|_| of_motion) {
            add("motion_to", motion.to.to_string());
            for (key, numbers) in Self::matrices(&motion.there.camera) {
                add(&format!("motion_{key}"), numbers);
            }
        }
        for named in Named::ALL {
            if buffers.iter().any(|buffer| Named::of(buffer.plane()) == Some(named)) {
                let names = self.names_of(named);
                add(&format!("{}_names", named.word()), list(&names));
                add(&named.manifest_key(), cryptomatte::manifest(names.into_iter()));
            }
        }
        if buffers.iter().any(|buffer| matches!(buffer, Buffer::Light(..) | Buffer::Group(..))) {
            add("light_names", list(&self.light_names()));
        }
        if buffers.iter().any(|buffer| buffer.part().is_some_and(LightPart::is_unscaled)) {
            self.light_entries(settings).into_iter().for_each(|(key, value)| add(key, value));
        }
        if buffers.iter().any(|buffer| matches!(buffer, Buffer::Group(..))) {
            let group = |(name, lights): &(String, Vec<u32>)| {
                let numbers: Vec<u32> = lights.iter().map(|light| light + 1).collect();
                serde_json::json!({ "name": name, "lights": numbers })
            };
            let groups: Vec<_> = self.light_groups.iter().map(group).collect();
            add("light_groups", serde_json::Value::from(groups).to_string());
        }
        receipt
    }
}

/// The number of samples of each light in effect, or that it is integrated.
fn light_samples(lights: &[Light], settings: &RenderSettings) -> String {
    // Where every sample is traced, every light is sampled
    let said = |light: &Light| match light.said_samples() {
        SamplesDesc::Exact if settings.renderer().samples_all() => light.samples().to_string(),
        said => said.to_string(),
    };
    let counts: Vec<String> = lights.iter().map(said).collect();
    // Many lights are listed as runs of equal counts
    let run = |same: &[String]| format!("{} x {}", same.len(), same[0]);
    if counts.len() > MOST_LISTED {
        counts.chunk_by(|a, b| a == b).map(run).collect::<Vec<_>>().join(", ")
    } else {
        counts.join(" ")
    }
}

/// A matrix of a camera, row by row: directions are of 32 bits, the place of 64.
fn matrix(rows: [f64; 16]) -> String {
    let text = |(i, v): (usize, f64)| if i % 4 == 3 { v.to_string() } else { (v as f32).to_string() };
    rows.into_iter().enumerate().map(text).collect::<Vec<_>>().join(" ")
}

/// Numbers as text that reads back to the same bits.
fn numbers(values: impl IntoIterator<Item = impl ToString>) -> String {
    values.into_iter().map(|v| v.to_string()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::PIXELS_ENTRIES;

    #[test]
    fn the_version_in_receipts_is_raised_with_every_change_of_pixels() {
        let changelog = concat!(env!("CARGO_MANIFEST_DIR"), "/../../CHANGELOG.md");
        let changelog = std::fs::read_to_string(changelog).expect("the changelog is there");
        let (mut heading, mut entries) = ("", 0);
        for line in changelog.lines() {
            if line.starts_with('#') {
                heading = line;
            }
            entries += u32::from(heading == "### Pixels" && line.starts_with("- "));
        }
        assert!(entries > 0, "the changelog has no entry under Pixels");
        assert_eq!(
            PIXELS_ENTRIES,
            entries,
            "the changelog has {entries} entries under Pixels: set PIXELS_ENTRIES in {} to {entries}",
            file!()
        );
    }
}
