//! What the command line says in place of the scene.

use firstlight::{
    BufferDesc, ColorDesc, LightDesc, MotionTo, RenderDesc, SampleSet, SamplesDesc, SceneDesc, ShadowTerminator,
    ShapeDesc,
};

use crate::args::Size;
use crate::report::Failure;

/// No film has more pixels on one side.
const SIDE_LIMIT: u64 = 1 << 16;

/// What the command line says in place of the scene.
pub(super) struct Overrides<'a> {
    pub width: Option<u32>,
    pub height: Option<u32>,
    /// Of the first of several sizes.
    pub size: Option<Size>,
    pub transparent: bool,
    pub background: Option<ColorDesc>,
    pub antialiasing: Option<u32>,
    pub samples: Option<SamplesDesc>,
    pub camera: Option<&'a str>,
    pub tolerance: Option<f64>,
    pub buffers: Option<&'a [BufferDesc]>,
    /// Buffers that have outputs of their own.
    pub alone: Vec<BufferDesc>,
    pub motion_to: Option<&'a MotionTo>,
    pub terminator: Option<ShadowTerminator>,
}

impl Overrides<'_> {
    pub fn apply(&self, desc: &mut SceneDesc) -> Result<(), Failure> {
        let render = &mut desc.render;
        let scene = (render.width, render.height);
        (render.width, render.height) = match self.size {
            Some(size) => sized(size, scene)?,
            None => film_size((self.width, self.height), scene)?,
        };
        if let Some(background) = self.background {
            (render.background, render.transparent) = (background, false);
        }
        render.transparent |= self.transparent;
        render.antialiasing = self.antialiasing.unwrap_or(render.antialiasing);
        render.tolerance = self.tolerance.unwrap_or(render.tolerance);
        if let Some(buffers) = self.buffers {
            render.buffers = buffers.to_vec();
        }
        if let Some(to) = self.motion_to {
            render.motion_to = Some(to.clone());
        }
        self.check_motion(render)?;
        render.shadow_terminator = self.terminator.unwrap_or(render.shadow_terminator);
        if let Some(name) = self.camera {
            render.camera = Some(name.to_owned());
        }
        let there = self.motion_to.and_then(|to| if let MotionTo::Camera(name) = to { Some(&**name) } else { None });
        // Those of models are known once their files are read
        let brings_cameras = |shape: &ShapeDesc| matches!(shape, ShapeDesc::Model(model) if model.cameras);
        let is_known = desc.shapes.iter().all(|shape| !brings_cameras(shape));
        for (option, name) in [("--camera", self.camera), ("--motion-to", there)].into_iter().filter(|_| is_known) {
            if let Some(name) = name.filter(|name| !desc.cameras.iter().any(|(known, _)| known == name)) {
                return Err(Failure::Usage(no_such_camera(option, name, desc)));
            }
        }
        if let Some(samples) = self.samples {
            render.samples = samples;
            for light in &mut desc.lights {
                set_samples(light, samples)?;
            }
        }
        Ok(())
    }

    /// Sees that motion is asked for together with where it leads.
    fn check_motion(&self, render: &RenderDesc) -> Result<(), Failure> {
        let of_motion = |buffer: &&BufferDesc| matches!(buffer, BufferDesc::Plane(plane) if plane.is_of_motion());
        let own = self.alone.iter().find(of_motion);
        match own.or(render.buffers.iter().find(of_motion)) {
            None if self.motion_to.is_some() => {
                let message = "--motion-to is for the buffers motion and motion-backward, and neither is asked for; \
                               name one with --buffers, or as -o motion=FILE";
                Err(Failure::Usage(message.into()))
            }
            Some(buffer) if (own.is_some() || self.buffers.is_some()) && render.motion_to.is_none() => {
                let name = buffer.name();
                let message = format!(
                    "the buffer {name} leads nowhere; say whereto with --motion-to: a time in seconds, next, previous, \
                     or the name of a camera"
                );
                Err(Failure::Usage(message))
            }
            _ => Ok(()),
        }
    }
}

/// Has the light sampled so, if it has an area.
fn set_samples(light: &mut LightDesc, samples: SamplesDesc) -> Result<(), Failure> {
    if let (SamplesDesc::Count(samples), Some((_, SampleSet::Grid | SampleSet::Stratified))) =
        (samples, light.samples())
        && samples.isqrt() * samples.isqrt() != samples
    {
        let side = samples.isqrt();
        let (below, above) = (side * side, (side + 1) * (side + 1));
        return Err(Failure::Usage(format!(
            "--samples {samples}: a light of this scene samples m x m cells; the nearest such numbers are {below} and \
             {above}"
        )));
    }
    light.set_samples(samples);
    Ok(())
}

fn no_such_camera(option: &str, name: &str, desc: &SceneDesc) -> String {
    let names: Vec<&str> = desc.cameras.iter().map(|(name, _)| name.as_str()).filter(|name| !name.is_empty()).collect();
    match names[..] {
        [] => format!("{option} {name}: the scene names no cameras; leave the option out"),
        _ => format!("{option} {name}: the scene has no such camera; it has {}", names.join(", ")),
    }
}

/// Columns and rows of a size, of a scene of so many columns and rows.
pub(super) fn sized(size: Size, scene: (u32, u32)) -> Result<(u32, u32), Failure> {
    let asked = match size {
        Size::Both(width, height) => (Some(width), Some(height)),
        Size::Longer(side) if scene.0 >= scene.1 => (Some(side), None),
        Size::Longer(side) => (None, Some(side)),
    };
    film_size(asked, scene)
}

/// Columns and rows: as asked, and one alone keeps the scene's aspect ratio, to the nearest pixel.
fn film_size(asked: (Option<u32>, Option<u32>), scene: (u32, u32)) -> Result<(u32, u32), Failure> {
    let (scene_width, scene_height) = (u64::from(scene.0), u64::from(scene.1));
    // The scene's own numbers are judged with the scene, a size of 0 among them
    if asked == (None, None) || scene_width == 0 || scene_height == 0 {
        return Ok(scene);
    }
    let scaled = |n: u64, times: u64, over: u64| ((2 * n * times + over) / (2 * over)).max(1);
    let (width, height) = match (asked.0.map(u64::from), asked.1.map(u64::from)) {
        (Some(width), Some(height)) => (width, height),
        (Some(width), None) => (width, scaled(width, scene_height, scene_width)),
        (None, Some(height)) => (scaled(height, scene_width, scene_height), height),
        (None, None) => (scene_width, scene_height),
    };
    if width > SIDE_LIMIT || height > SIDE_LIMIT {
        return Err(Failure::Usage(format!(
            "the picture would have {width} x {height} pixels; at most {SIDE_LIMIT} on a side are possible"
        )));
    }
    Ok((width as u32, height as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_side_alone_keeps_the_aspect_ratio() {
        let size = |width, height| film_size((width, height), (300, 200)).ok();
        assert_eq!(size(None, None), Some((300, 200)));
        assert_eq!(size(Some(30), None), Some((30, 20)));
        assert_eq!(size(None, Some(21)), Some((32, 21))); // 31.5
        assert_eq!(size(Some(1), None), Some((1, 1))); // 0.67
        assert_eq!(size(Some(7), Some(9)), Some((7, 9)));
        assert_eq!(film_size((None, Some(1)), (1, 65536)).ok(), Some((1, 1)));
    }

    #[test]
    fn a_film_has_its_limits() {
        assert_eq!(film_size((Some(1), None), (1, 65536)).ok(), Some((1, 65536)));
        assert!(film_size((Some(2), None), (1, 65536)).is_err());
        assert!(film_size((Some(65536), Some(65536)), (1, 1)).is_ok());
        // Nothing asked: the scene's own sizes are not judged here
        assert_eq!(film_size((None, None), (0, 7)).ok(), Some((0, 7)));
    }
}
