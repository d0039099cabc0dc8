//! One moment after the other: compiled, rendered, written.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use firstlight::{
    AaMode, Coco, Diagnostic, Framing, Plane, RenderSettings, RenderStats, SamplesDesc, Scene, Severity, Window,
};

use super::contents::Contents;
use super::plan::Plan;
use super::summary::Summary;
use super::{dark, empty, timed};
use crate::args::Frames;
use crate::faster::faster;
use crate::input::Input;
use crate::interrupt::Watch;
use crate::output::{self, Content, JsonFile, Output, Ready, Staged, Target};
use crate::progress::Progress;
use crate::report::{Failure, show_diagnostics, shown};

/// A moment to render, from where and how large, and where its pictures go.
pub(super) struct Moment {
    /// In seconds.
    pub time: f64,
    pub framing: Framing,
    /// Columns and rows.
    pub size: (u32, u32),
    pub outputs: Vec<Output>,
    /// Folders that placeholders name, and that need not be there.
    pub folders: Vec<PathBuf>,
}

impl Moment {
    pub fn ready(&self) -> Result<Vec<Ready>, Failure> {
        for folder in &self.folders {
            std::fs::create_dir_all(folder)
                .map_err(|e| Failure::Work(format!("the folder {} cannot be made: {e}", shown(folder))))?;
        }
        self.outputs.iter().map(|output| output.target.ready()).collect()
    }
}

impl Moment {
    /// Columns and rows of what is rendered.
    pub fn rendered(&self, crop: Option<Window>) -> [u32; 2] {
        crop.map_or([self.size.0, self.size.1], |crop| [crop.width, crop.height])
    }

    fn pixels(&self, crop: Option<Window>) -> u64 {
        self.rendered(crop).map(u64::from).iter().product()
    }
}

/// What one moment took, or several.
pub(super) struct Took {
    pub compile: Duration,
    pub render: Duration,
    pub write: Duration,
    pub rays: RenderStats,
}

impl Took {
    pub fn and(self, other: Took) -> Took {
        let rays = self.rays.and(&other.rays);
        Took {
            compile: self.compile + other.compile,
            render: self.render + other.render,
            write: self.write + other.write,
            rays,
        }
    }
}

/// What annotations call the picture that they are of: the first of the outputs that shows the scene, else the first,
/// as seen from their own file.
fn picture_name(outputs: &[Output], json: &Target) -> String {
    let file = |output: &Output| match &output.target {
        Target::File(path) => Some(path.clone()),
        Target::Stdout => None,
    };
    let of_scene = outputs.iter().filter(|output| output.content == Content::Scene).find_map(file);
    let Some(picture) = of_scene.or_else(|| outputs.iter().find_map(file)) else { return String::new() };
    let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let folder = match json {
        Target::File(json) => json.parent().unwrap_or(Path::new("")),
        Target::Stdout => Path::new(""),
    };
    let (picture, folder) = (whole(&picture), whole(&folder.join(".")));
    let common = picture.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(common).map(|_| "..".into());
    let down = picture.components().skip(common).map(|part| part.as_os_str().to_string_lossy().into_owned());
    // With `/` between folders on every system
    up.chain(down).collect::<Vec<String>>().join("/")
}

fn is_past(deadline: Option<Instant>) -> bool {
    deadline.is_some_and(|deadline| Instant::now() >= deadline)
}

/// The rendering of one moment after the other.
pub(super) struct Run<'a> {
    pub plan: &'a Plan<'a>,
    pub input: &'a mut Input,
    pub summary: &'a mut Summary,
    pub settings: &'a RenderSettings,
    /// The files beside the pictures.
    pub beside: &'a [JsonFile],
    /// The annotations so far, if they are asked for, and where they go.
    pub coco: Option<(Coco, Target)>,
    /// When the picture has to be there.
    pub deadline: Option<Instant>,
    /// Once there is something to render.
    pub progress: Option<Progress>,
    /// What has been said already.
    pub warned: Vec<Diagnostic>,
}

impl Run<'_> {
    /// Compiles, renders and writes one of the moments.
    pub fn render(&mut self, index: usize, moments: &[Moment], ready: Vec<Ready>) -> Result<Took, Failure> {
        let (plan, settings, moment) = (self.plan, self.settings, &moments[index]);

        // Compile
        let render = &mut self.input.parsed.desc.render;
        (render.width, render.height) = moment.size;
        self.input.framing = moment.framing;
        let (compiled, compile) = timed(|| self.input.compile(moment.time, plan.quiet));
        let mut compiled = compiled?;
        // Now it is known which files the scene is made of: none of them may be lost, by none of the frames to come
        let ahead = if index == 0 { moments } else { &moments[index..=index] };
        let outputs = ahead.iter().flat_map(|moment| &moment.outputs);
        output::refuse_overwriting(&self.input.files(), outputs, self.beside)?;
        if !plan.quiet {
            compiled.advice.extend(self.advice_on_time(&compiled.scene));
            compiled.advice.extend(self.advice_on_tolerance());
            compiled.warnings.append(&mut compiled.advice);
        }
        let is_warning = |diagnostic: &&Diagnostic| diagnostic.severity == Severity::Warning;
        compiled.warnings.iter().filter(is_warning).for_each(|warning| self.summary.warn(warning.to_string()));
        compiled.warnings.retain(|warning| !self.warned.contains(warning));
        if !compiled.warnings.is_empty() {
            let show = || show_diagnostics(&compiled.warnings);
            self.progress.as_ref().map_or_else(show, |progress| progress.aside(show));
            self.warned.append(&mut compiled.warnings);
        }
        if index == 0 && !plan.quiet {
            self.input.tell_added(&compiled);
        }
        let scene = &compiled.scene;
        let contents = Contents::of(&moment.outputs, scene)?;
        let mut buffers = contents.buffers();
        let ids = Plane::ObjectId.into();
        if self.coco.is_some() && !buffers.contains(&ids) {
            buffers.push(ids);
        }
        let settings = &RenderSettings { buffers, ..settings.clone() };
        settings.check(scene).map_err(Failure::Usage)?;
        self.check_memory(scene, settings)?;
        settings.check_memory(scene).map_err(Failure::Work)?;
        self.check_time()?;

        // Render, until somebody asks to stop
        let watch = Watch::begin();
        let pixels = |moments: &[Moment]| moments.iter().map(|moment| moment.pixels(settings.crop)).sum();
        let begin = || {
            let faster = faster(scene, settings, &self.input.parsed.desc.render);
            Progress::begin(pixels(moments), moments.len() as u64, plan.quiet, faster)
        };
        let progress = &*self.progress.get_or_insert_with(begin);
        progress.picture(index as u64, pixels(&moments[..index]));
        let deadline = self.deadline;
        let (rendered, render) = timed(|| {
            firstlight::render(scene, settings, &|done, _| {
                progress.update(done);
                if is_past(deadline) { ControlFlow::Break(()) } else { watch.flow() }
            })
        });
        let ControlFlow::Continue((film, rays)) = rendered else {
            watch.check()?;
            self.check_time()?;
            return Err(Failure::Interrupted);
        };
        if index + 1 == moments.len() {
            progress.finish(&plan.in_words(moments));
        }
        if self.input.studio.is_some() && settings.crop.is_none() && empty::is_empty(scene, &film) {
            return Err(empty::failure(&self.input.name, scene));
        }

        // Encode all pictures and bring them to the disk, then let them appear
        let (written, write) = timed(|| {
            let bytes = progress.aside(|| contents.encode(plan, settings, &film, scene, self.summary))?;
            watch.check()?;
            let stage = ready.into_iter().zip(&bytes).map(|(ready, bytes)| ready.stage(bytes));
            let staged: Vec<Staged> = stage.collect::<Result<_, _>>()?;
            watch.check()?;
            progress.aside(|| output::commit(staged, plan.quiet, &|| watch.check().is_err()))?;
            if let Some((coco, json)) = &mut self.coco {
                let is_added = coco.add(scene, &film, &picture_name(&moment.outputs, json));
                debug_assert!(is_added, "ids were asked for");
            }
            Ok(())
        });
        written?;
        // Last, where it is seen: what there is to say of the picture itself
        if index == 0 && !plan.quiet && settings.crop.is_none() {
            let display = plan.display.of(&scene.display());
            let advice = dark::advice(&self.input.name, &self.input.parsed.desc, &film, &display);
            progress.aside(|| show_diagnostics(advice.as_slice()));
        }
        self.summary.end(None);
        Ok(Took { compile, render, write, rays })
    }
}

impl Run<'_> {
    /// Sees that there is time left.
    fn check_time(&self) -> Result<(), Failure> {
        let Some(time) = self.plan.max_time.filter(|_| is_past(self.deadline)) else { return Ok(()) };
        let (name, seconds) = (&self.input.name, time.as_secs_f64());
        Err(Failure::Work(format!(
            "{name}: --max-time {seconds}: the picture was not done after {seconds} s, and none was written; allow \
             more, or render faster: fewer pixels (--size), fewer camera rays (--aa), a larger --tolerance"
        )))
    }

    /// Sees that there is memory for the picture beside the scene.
    fn check_memory(&self, scene: &Scene, settings: &RenderSettings) -> Result<(), Failure> {
        let Some(most) = self.plan.max_memory else { return Ok(()) };
        let summary = scene.summary();
        let own = summary.geometry_bytes.iter().sum::<u64>() + summary.texture_bytes;
        let film = settings.film_bytes(scene);
        if own + film <= most {
            return Ok(());
        }
        let mib = |bytes: u64| bytes.div_ceil(1 << 20);
        let (name, most, own, film, all) = (&self.input.name, most >> 20, mib(own), mib(film), mib(own + film));
        Err(Failure::Work(format!(
            "{name}: --max-memory {most}: the scene takes {own} MiB and the picture with its buffers {film} MiB; allow \
             --max-memory {all}, or render fewer pixels (--size) or a part of them (--crop)"
        )))
    }

    /// What there is to say where a moment was asked for and nothing changes with time.
    fn advice_on_time(&self, scene: &Scene) -> Option<Diagnostic> {
        let (lacks, hint) = match self.input.studio {
            Some(_) => ("the model has no animation", "of models, glTF files can have some"),
            None => (
                "the scene has no keys",
                "keys = [{ time = 0, ... }, ...] in a transform move a shape, a light or the camera",
            ),
        };
        let message = match (self.plan.pictures.frames, scene.time()) {
            (Some(Frames { first, last }), None) => {
                let frames = last - first + 1;
                format!("{lacks}: the pictures of all {frames} frames are the same")
            }
            (None, None) if self.plan.time != 0.0 => format!("{lacks}: its picture is the same at any --time"),
            _ => return None,
        };
        Some(self.note(&message, hint))
    }

    /// What there is to say where `--tolerance` was given and no light is integrated to it.
    fn advice_on_tolerance(&self) -> Option<Diagnostic> {
        let tolerance = self.plan.overrides.tolerance?;
        let desc = &self.input.parsed.desc;
        // Those of each light, or of the scene
        let samples = desc.lights.iter().filter_map(|light| light.samples());
        let samples: Vec<_> = samples.map(|(own, _)| own.unwrap_or(desc.render.samples)).collect();
        if samples.is_empty() || samples.contains(&SamplesDesc::Exact) {
            return None;
        }
        // Edges alone are judged by it
        let little = if self.settings.aa_mode == AaMode::Adaptive { "next to nothing" } else { "nothing" };
        let said_by = if self.plan.overrides.samples.is_some() { "--samples says" } else { "the scene says (samples)" };
        let message = format!(
            "--tolerance {tolerance} changes {little}: {said_by} at how many points each light is sampled, and the \
             tolerance is for lights that are integrated"
        );
        Some(self.note(&message, "--samples exact integrates them"))
    }

    /// A note about the scene.
    fn note(&self, message: &str, hint: &str) -> Diagnostic {
        Diagnostic {
            severity: Severity::Advice,
            place: None,
            path: String::new(),
            message: format!("{}: {message}", self.input.name),
            hint: Some(hint.to_owned()),
        }
    }
}
