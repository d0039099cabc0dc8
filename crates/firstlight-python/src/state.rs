//! What changes of a scene: its description, compiled again only where a call wants it otherwise than the last.

use std::sync::Arc;

use firstlight::{
    BufferDesc, CameraDesc, CompileCache, CompileOptions, Compiled, MotionTo, Parsed, SamplesDesc, SceneError as Faults,
};

use crate::files::SceneFiles;

/// What changes of a scene.
pub struct State {
    pub parsed: Parsed,
    pub files: Arc<SceneFiles>,
    pub cache: CompileCache,
    /// Counts changes.
    changes: u64,
    /// What was compiled last, when and how.
    compiled: Option<(u64, Wanted, Arc<Compiled>)>,
}

/// What a call wants otherwise than the description says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wanted {
    pub camera: Option<CameraChoice>,
    pub size: [Option<u32>; 2],
    pub antialiasing: Option<u32>,
    pub samples: Option<SamplesDesc>,
    pub tolerance: Option<f64>,
    pub buffers: Option<Vec<BufferDesc>>,
    pub motion_to: Option<MotionChoice>,
    pub time: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub enum CameraChoice {
    Named(String),
    Other(Box<CameraDesc>),
}

#[derive(Clone, Debug, PartialEq)]
pub enum MotionChoice {
    To(MotionTo),
    Camera(Box<CameraDesc>),
}

impl State {
    /// Of a description, and its files.
    pub fn of(parsed: Parsed, files: SceneFiles) -> Self {
        let (files, cache) = (Arc::new(files), CompileCache::default());
        State { parsed, files, cache, changes: 0, compiled: None }
    }

    /// The scene as it is wanted.
    pub fn compile(&mut self, wanted: &Wanted) -> Result<(Arc<Compiled>, bool), Faults> {
        if let Some((changes, how, compiled)) = &self.compiled
            && *changes == self.changes
            && how == wanted
        {
            return Ok((compiled.clone(), false));
        }
        // Change the description as wanted, for a while
        let desc = &mut self.parsed.desc;
        let before = (desc.render.clone(), desc.cameras.clone(), desc.lights.clone());
        let render = &mut desc.render;
        [render.width, render.height] = film_size(wanted.size, [render.width, render.height]);
        render.antialiasing = wanted.antialiasing.unwrap_or(render.antialiasing);
        render.tolerance = wanted.tolerance.unwrap_or(render.tolerance);
        // Also where the call's camera takes the place of the scene's
        let own = || before.0.motion_to.clone().map(MotionChoice::To);
        let there = wanted.motion_to.clone().or_else(own).map(|to| to.named(&before.1));
        match &wanted.camera {
            Some(CameraChoice::Named(name)) => render.camera = Some(name.clone()),
            Some(CameraChoice::Other(camera)) => {
                render.camera = None;
                desc.cameras = vec![(String::new(), (**camera).clone())];
            }
            None => {}
        }
        if let Some(buffers) = &wanted.buffers {
            desc.render.buffers.clone_from(buffers);
        }
        if let Some((to, camera)) = there {
            let camera = camera.filter(|(name, _)| desc.cameras.iter().all(|(other, _)| other != name));
            desc.cameras.extend(camera);
            desc.render.motion_to = Some(to);
        }
        if let Some(samples) = wanted.samples {
            desc.render.samples = samples;
            desc.lights.iter_mut().for_each(|light| light.set_samples(samples));
        }
        let options =
            CompileOptions { time: wanted.time, cache: Some(self.cache.clone()), ..CompileOptions::default() };
        let compiled = self.parsed.compile(&*self.files, &options);
        let desc = &mut self.parsed.desc;
        (desc.render, desc.cameras, desc.lights) = before;
        let compiled = Arc::new(compiled?);
        self.compiled = Some((self.changes, wanted.clone(), compiled.clone()));
        Ok((compiled, true))
    }

    /// Forgets what was compiled, so that the next call is told its warnings.
    pub fn forget(&mut self) {
        self.compiled = None;
    }

    /// Notes that the description is another.
    pub fn change(&mut self) {
        self.changes += 1;
        self.compiled = None;
    }
}

impl MotionChoice {
    /// As a scene says it, and the camera it leads to, of `cameras` or another one.
    fn named(&self, cameras: &[(String, CameraDesc)]) -> (MotionTo, Option<(String, CameraDesc)>) {
        match self {
            MotionChoice::To(to) => {
                let camera = cameras.iter().find(|(name, _)| matches!(to, MotionTo::Camera(own) if own == name));
                (to.clone(), camera.cloned())
            }
            MotionChoice::Camera(camera) => {
                let taken = |name: &String| cameras.iter().any(|(other, _)| other == name);
                let mut names = std::iter::once("there".to_owned()).chain((2u32..).map(|n| format!("there-{n}")));
                let name = names.find(|name| !taken(name)).expect("the cameras are not endless");
                (MotionTo::Camera(name.clone()), Some((name, (**camera).clone())))
            }
        }
    }
}

/// Columns and rows: as asked, and one alone keeps the scene's aspect ratio, to the nearest pixel.
fn film_size(asked: [Option<u32>; 2], own: [u32; 2]) -> [u32; 2] {
    let scaled = |n: u32, times: u32, over: u32| {
        let (n, times, over) = (u64::from(n), u64::from(times), u64::from(over.max(1)));
        u32::try_from(((2 * n * times + over) / (2 * over)).max(1)).unwrap_or(u32::MAX)
    };
    match asked {
        [None, None] => own,
        [Some(width), Some(height)] => [width, height],
        [Some(width), None] => [width, scaled(width, own[1], own[0])],
        [None, Some(height)] => [scaled(height, own[0], own[1]), height],
    }
}
