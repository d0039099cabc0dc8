//! What changes of a scene: its description, compiled again only where a call wants it otherwise than the last.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

use firstlight::{
    Assets, BufferDesc, CameraDesc, CompileCache, CompileOptions, Compiled, GroupDesc, MotionTo, Parsed, RenderDesc,
    SamplesDesc, SceneDesc, SceneError as Faults, ShapeDesc, StudioSettings, View,
};

use crate::files::{IN_MEMORY, SceneFiles};
use crate::item::{Item, get, push, remove, set};
use crate::numbers::Numbers;
use crate::pool::in_pool;
use crate::shown::Shown;

/// What changes of a scene.
pub struct State {
    pub parsed: Parsed,
    pub shown: Shown,
    pub files: Arc<SceneFiles>,
    pub cache: CompileCache,
    pub numbers: Numbers,
    /// The advice that renders have given already.
    pub told: BTreeSet<String>,
    /// Whether something was removed since [`tidy`](Self::tidy).
    is_untidy: bool,
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
    /// The time in seconds. `Some` plays the first animation of a glTF file that [`Shown`] has; `None` leaves it at
    /// rest.
    pub time: Option<f64>,
    /// Where a camera that is found looks from, and its margin.
    pub view: Option<View>,
    pub margin: Option<f64>,
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
        let (files, cache, numbers) = (Arc::new(files), CompileCache::default(), Numbers::of(&parsed.desc));
        let (shown, told) = (Shown::default(), BTreeSet::new());
        State { parsed, shown, files, cache, numbers, told, is_untidy: false, changes: 0, compiled: None }
    }

    /// The scene as it is wanted.
    pub fn compile(&mut self, wanted: &Wanted) -> Result<(Arc<Compiled>, bool), Faults> {
        if let Some((changes, how, compiled)) = &self.compiled
            && *changes == self.changes
            && how == wanted
        {
            return Ok((compiled.clone(), false));
        }
        self.tidy();
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
        let mut framing = self.shown.framing;
        framing.view = wanted.view.unwrap_or(framing.view);
        framing.margin = wanted.margin.unwrap_or(framing.margin);
        // A model by itself is framed as it is then
        if self.shown.studio.is_some() {
            framing.time = wanted.time.unwrap_or(0.0);
        }
        let played = self.played(wanted);
        let other = played.as_ref().and_then(|studio| self.shown.with(&self.parsed.desc, studio));
        let options = CompileOptions {
            time: wanted.time.unwrap_or(0.0),
            framing,
            studio: played.or_else(|| self.shown.studio.clone()),
            cache: Some(self.cache.clone()),
            ..CompileOptions::default()
        };
        let compiled = in_pool(|| other.as_ref().unwrap_or(&self.parsed).compile(&*self.files, &options));
        let desc = &mut self.parsed.desc;
        (desc.render, desc.cameras, desc.lights) = before;
        let compiled = Arc::new(compiled?);
        self.compiled = Some((self.changes, wanted.clone(), compiled.clone()));
        Ok((compiled, true))
    }

    /// Shows the scene in a studio: the settings of its picture become those of the studio, and the materials that the
    /// studio needs are added.
    pub fn use_studio(&mut self, studio: StudioSettings) {
        let made = SceneDesc::of_model("", &studio);
        let render = &mut self.parsed.desc.render;
        (render.background, render.tolerance) = (made.render.background, made.render.tolerance);
        (render.ambient, render.display) = (made.render.ambient, made.render.display);
        for (name, material) in made.materials {
            if self.numbers.named("material", &name).is_none() {
                self.add(Item::Material(name, material));
            }
        }
        // Of a model by itself it is another way to show it
        self.parsed = Parsed::from(std::mem::take(&mut self.parsed.desc));
        (self.shown.studio, self.shown.model) = (Some(studio), None);
        self.change();
    }

    /// The settings of a model by itself of which a call shows more than it does otherwise.
    fn played(&self, wanted: &Wanted) -> Option<StudioSettings> {
        let is_named = matches!(wanted.camera, Some(CameraChoice::Named(_)));
        let read = || self.files.read(&self.shown.model.as_ref()?.file, u64::MAX).ok();
        self.shown.played(wanted.time.is_some(), is_named, read)
    }

    /// The description as text is to have it: with the lights, the ground and the camera of a scene that is shown in
    /// some way that a text cannot say.
    pub fn whole(&mut self) -> Cow<'_, SceneDesc> {
        self.tidy();
        let is_plain = self.shown == Shown::default();
        match if is_plain { None } else { self.compile(&Wanted::default()).ok() } {
            Some((compiled, _)) => {
                let mut desc = self.parsed.desc.clone();
                compiled.added.add_to(&mut desc);
                Cow::Owned(desc)
            }
            None => Cow::Borrowed(&self.parsed.desc),
        }
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

    /// Adds a thing, and answers with its number; `None` where its name is taken.
    pub fn add(&mut self, item: Item) -> Option<usize> {
        let (family, name) = (item.words().0, item.name());
        if name.as_ref().is_some_and(|name| self.numbers.named(family, name).is_some()) {
            return None;
        }
        push(&mut self.parsed.desc, item);
        self.change();
        Some(self.numbers.push(family, name))
    }

    /// Puts a thing in the place of another; says whether that is there, and the name not taken.
    pub fn replace(&mut self, number: usize, item: Item) -> Result<(), Refused> {
        let (family, name) = (item.words().0, item.name());
        let index = self.numbers.index(family, number).ok_or(Refused::Removed)?;
        let before = get(&self.parsed.desc, family, index).and_then(|item| item.name());
        if name == before {
            set(&mut self.parsed, index, item);
        } else {
            if name.as_ref().is_some_and(|name| self.numbers.named(family, name).is_some()) {
                return Err(Refused::Taken);
            }
            set(&mut self.parsed, index, item);
            self.numbers.rename(family, number, before.as_deref(), name, &self.parsed.desc);
        }
        self.change();
        Ok(())
    }

    /// Removes a thing, with the mesh that it alone showed; says whether it was there.
    pub fn remove(&mut self, family: &str, number: usize) -> bool {
        let Some(index) = self.numbers.index(family, number) else { return false };
        let name = get(&self.parsed.desc, family, index).and_then(|item| item.name());
        remove(&mut self.parsed.desc, family, index);
        self.numbers.remove(family, index, name.as_deref(), &self.parsed.desc);
        self.removed();
        true
    }

    /// Removes all but the picture's settings, in which no camera is named any more.
    pub fn clear(&mut self) {
        let named = |to: &MotionTo| !matches!(to, MotionTo::Camera(_));
        let render = self.parsed.desc.render.clone();
        let render = RenderDesc { camera: None, motion_to: render.motion_to.clone().filter(named), ..render };
        self.parsed.desc = SceneDesc { render, ..SceneDesc::default() };
        // A studio is made of lights and materials
        self.shown = Shown { framing: self.shown.framing, ..Shown::default() };
        self.numbers.clear();
        self.removed();
    }

    /// Notes that something was removed: what stands behind it is no longer where the text had it.
    fn removed(&mut self) {
        self.parsed = Parsed::from(std::mem::take(&mut self.parsed.desc));
        self.is_untidy = true;
        self.change();
    }

    /// After something was removed, drops the groups of meshes of arrays that no instance shows, and what is in memory
    /// for nothing.
    pub fn tidy(&mut self) {
        if !std::mem::take(&mut self.is_untidy) {
            return;
        }
        let desc = &mut self.parsed.desc;
        let shapes = || desc.shapes.iter().chain(desc.groups.iter().flat_map(|(_, group)| &group.shapes));
        let of = |shape: &ShapeDesc| match shape {
            ShapeDesc::Instance(instance) => Some(instance.of.clone()),
            _ => None,
        };
        let shown: BTreeSet<String> = shapes().filter_map(of).collect();
        let in_memory = |shape: &ShapeDesc| match shape {
            ShapeDesc::Mesh(mesh) => mesh.file.as_ref().is_some_and(|file| file.0.starts_with(IN_MEMORY)),
            _ => false,
        };
        let is_of_arrays = |group: &GroupDesc| !group.shapes.is_empty() && group.shapes.iter().all(in_memory);
        desc.groups.retain(|(name, group)| shown.contains(name) || !is_of_arrays(group));
        let used: BTreeSet<String> = desc.files_mut().map(|file| file.0.clone()).collect();
        self.cache.retain_given(&|name| used.contains(name));
        self.files.retain_in_memory(&|name| used.contains(name));
    }
}

/// Why a thing was not put in the place of another.
pub enum Refused {
    Removed,
    Taken,
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
