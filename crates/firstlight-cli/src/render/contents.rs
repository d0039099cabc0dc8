//! What each output holds: the buffers of a scene, and their bytes.

use firstlight::{Buffer, Display, FileSettings, Film, Format, Plane, PlaneNumbers, RenderSettings, Scene};

use super::plan::Plan;
use super::summary::Summary;
use crate::output::{Content, Output};
use crate::report::{Failure, say};

/// The outputs of one moment, each with what it holds.
pub(super) struct Contents<'a>(Vec<(&'a Output, Vec<Buffer>)>);

impl<'a> Contents<'a> {
    /// Finds out what outputs hold of a scene.
    ///
    /// # Errors
    /// A buffer that the scene has not; several in a file that holds one.
    pub fn of(outputs: &'a [Output], scene: &Scene) -> Result<Self, Failure> {
        let of = |output: &'a Output| {
            let buffers = match &output.content {
                Content::Scene if output.takes_buffers() => scene.buffers().to_vec(),
                Content::Scene => vec![Plane::Color.into()],
                Content::Heat => vec![Plane::Rays.into()],
                Content::Buffer(desc) => {
                    let (name, file) = (desc.name(), output.target.name());
                    let fault = |why: String| Failure::Usage(format!("-o {name}={file}: {why}"));
                    let found = scene.buffers_of(desc).map_err(fault)?;
                    if found.is_empty() {
                        return Err(fault("the scene has none".into()));
                    }
                    if found.len() != 1 && !matches!(output.format, Format::Exr | Format::Npz) {
                        let count = found.len();
                        return Err(fault(format!(
                            "the scene has {count} of them, and such a file holds one; .exr and .npz hold any number"
                        )));
                    }
                    if let Some(why) = found.iter().find_map(|buffer| output.format.refuses(buffer.plane())) {
                        return Err(fault(format!("{why}; .exr, .npz and .npy files can hold it")));
                    }
                    found
                }
            };
            if let Some(why) = buffers.iter().find_map(|buffer| output.format.refuses_name(&scene.buffer_name(*buffer)))
            {
                return Err(Failure::Work(format!("{}: {why}", output.target.name())));
            }
            Ok((output, buffers))
        };
        outputs.iter().map(of).collect::<Result<_, _>>().map(Contents)
    }

    /// All that is to be rendered for them, each once.
    pub fn buffers(&self) -> Vec<Buffer> {
        let mut all = Vec::new();
        for buffer in self.0.iter().flat_map(|(_, buffers)| buffers) {
            if !all.contains(buffer) {
                all.push(*buffer);
            }
        }
        all
    }

    /// The bytes of each output.
    ///
    /// # Errors
    /// Numbers that a format cannot hold.
    pub fn encode(
        &self,
        plan: &Plan,
        settings: &RenderSettings,
        film: &Film,
        scene: &Scene,
        summary: &mut Summary,
    ) -> Result<Vec<Vec<u8>>, Failure> {
        let display = plan.display.of(&scene.display());
        let files =
            FileSettings { display, depth_scale: plan.depth_scale, half: plan.half, jpeg_quality: plan.quality };
        let mut bytes = |(output, buffers): &(&Output, Vec<Buffer>)| {
            let heat = (output.content == Content::Heat).then(|| film.heat()).flatten();
            let encoded = match heat {
                Some(heat) => {
                    heat.picture().encode(output.format, &Display::default(), &scene.buffers_receipt(settings, buffers))
                }
                None => {
                    if let Some(warning) = warning_of_far(output, buffers, film, &files) {
                        if plan.strict {
                            return Err(Failure::Work(warning));
                        }
                        say(format_args!("warning: {warning}"));
                        summary.warn(warning);
                    }
                    film.encode(buffers, output.format, &files, &scene.buffers_receipt(settings, buffers))
                }
            };
            encoded.map_err(|e| Failure::Work(format!("{}: {e}", output.target.name())))
        };
        self.0.iter().map(&mut bytes).collect()
    }
}

/// How many pixels are farther away than a file can tell, if there are any.
fn warning_of_far(output: &Output, buffers: &[Buffer], film: &Film, files: &FileSettings) -> Option<String> {
    let [buffer] = buffers else { return None };
    if !output.is_png() || !buffer.plane().is_distance() {
        return None;
    }
    let Some(PlaneNumbers::Floats(distances)) = film.numbers(*buffer) else { return None };
    let far = files.beyond(distances);
    (far > 0).then(|| {
        format!(
            "{}: {far} of {} pixels are farther than {} m, the most at {} units per metre, and are 0; a smaller \
         --depth-scale reaches farther, .exr, .npz and .npy files hold any distance",
            output.target.name(),
            distances.len(),
            files.farthest(),
            files.depth_scale
        )
    })
}
