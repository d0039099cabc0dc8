//! The arguments, understood: first by themselves, then together with the scene.

use std::collections::{HashMap, HashSet};
use std::iter;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Duration;

use firstlight::{
    AaMode, BufferDesc, FileSettings, Format, Framing, Plane, RenderSettings, ShadowTerminator, SimdLevel, View, Window,
};

use super::moments::Moment;
use super::overrides::{Overrides, sized};
use super::pictures::{Pictures, Views};
use crate::args::{AntialiasingMode, Bits, DisplayArgs, NamedView, RenderArgs, Shard, Terminator};
use crate::input::{self, Input};
use crate::output::{self, Content, JsonFile, Names, Output, Target};
use crate::report::{Failure, say, shown};

/// No more pixels are rendered at once.
const PIXEL_LIMIT: u64 = 1 << 27;

/// The arguments, understood as far as they can be without the scene.
pub(super) struct Plan<'a> {
    pub jobs: Vec<Job>,
    /// Without the names of the scene in them. Empty: the one that the scene says.
    pub outputs: Vec<Output>,
    pub heat: Option<Output>,
    pub bits: Option<Bits>,
    pub stats: StatsPlan,
    /// Where annotations go.
    pub coco: Option<JsonFile>,
    /// Where the log of the run goes.
    pub summary: Option<JsonFile>,
    pub settings: RenderSettings,
    pub overrides: Overrides<'a>,
    /// Of 8- and 16-bit files, in place of the scene's.
    pub display: DisplayArgs,
    /// Units per metre in 16 bits.
    pub depth_scale: f64,
    /// Whether EXR files hold colours in 16-bit floats.
    pub half: bool,
    /// Of JPEG files.
    pub quality: u8,
    /// Warnings are errors.
    pub strict: bool,
    /// How a camera frames a scene that has none, as far as it was said.
    pub view: Option<View>,
    pub margin: Option<f64>,
    pub time: f64,
    /// Whether nothing was said of antialiasing and visibility.
    pub mode_is_open: bool,
    /// Whether a moment was said: models play their first animation then.
    pub plays: bool,
    /// Those of each scene.
    pub pictures: Pictures,
    pub shard: Option<Shard>,
    /// How long a picture may take.
    pub max_time: Option<Duration>,
    /// Bytes that a scene and its picture may take.
    pub max_memory: Option<u64>,
    pub quiet: bool,
}

/// One of the scenes to render.
pub(super) struct Job {
    pub scene: PathBuf,
    /// Which of the scenes that were given, from 0 on.
    pub index: usize,
    /// What the placeholders in the names of its outputs stand for.
    pub names: Names,
}

/// Where the numbers go.
pub(super) enum StatsPlan {
    Nowhere,
    Table,
    Json(JsonFile),
}

impl StatsPlan {
    /// Where JSON goes.
    pub fn file(&self) -> Option<&JsonFile> {
        match self {
            StatsPlan::Json(file) => Some(file),
            StatsPlan::Nowhere | StatsPlan::Table => None,
        }
    }
}

impl<'a> Plan<'a> {
    pub fn resolve(args: &'a RenderArgs) -> Result<Self, Failure> {
        let outputs = output::resolve(&args.output, args.bits, args.format)?;

        let stats = match &args.stats {
            None => StatsPlan::Nowhere,
            Some(None) => StatsPlan::Table,
            Some(Some(path)) => StatsPlan::Json(JsonFile::of("--stats=", path)?),
        };
        let coco = args.coco.as_deref().map(|path| JsonFile::of("--coco ", path)).transpose()?;
        let beside: Vec<&JsonFile> = stats.file().into_iter().chain(&coco).collect();
        let is_scaled = |output: &Output| match &output.content {
            Content::Buffer(BufferDesc::Plane(plane)) => plane.is_distance() && output.is_png(),
            _ => false,
        };
        if args.depth_scale.is_some() && !outputs.iter().any(is_scaled) {
            let message =
                "--depth-scale is for depth and distance in PNG files, as -o depth=d.png, and no output is one";
            return Err(Failure::Usage(message.into()));
        }
        if args.half && !outputs.iter().any(|output| output.format == Format::Exr) {
            return Err(Failure::Usage("--half is for EXR files, as -o a.exr, and no output is one".into()));
        }
        if args.quality.is_some() && !outputs.iter().any(|output| output.format == Format::Jpeg) {
            return Err(Failure::Usage("--quality is for JPEG files, as -o a.jpg, and no output is one".into()));
        }
        let heat = args.heat.as_deref().map(heat_output).transpose()?;
        let summary = args.summary.as_deref().map(|path| JsonFile::of_lines("--summary ", path)).transpose()?;
        let pictures = pictures_of(args)?;
        let jobs: Vec<Job> = input::with_folders(&args.scenes)
            .into_iter()
            .enumerate()
            .map(|(index, (scene, names))| Job { names, scene, index })
            .collect();
        let several = jobs.len() > 1;
        let parts = Some(pictures.several());
        let of_pictures = outputs.iter().map(|output| ("-o", &output.target));
        for (option, target) in of_pictures.chain(heat.iter().map(|heat| ("--heat", &heat.target))) {
            output::check_placeholders(option, target, several, parts)?;
        }
        for file in &beside {
            output::check_placeholders(file.option(), &file.target, several, None)?;
        }
        if let Some(file) = &summary {
            file.refuse_placeholders()?;
        }
        for job in &jobs {
            let first = pictures.iter().next().map(|picture| picture.part).unwrap_or_default();
            let of_job = |output: &Output| output.of_part(&first).of_scene(&job.names);
            let all: Vec<Output> = outputs.iter().chain(&heat).map(of_job).collect();
            let beside: Vec<JsonFile> =
                beside.iter().map(|file| file.of_scene(&job.names)).chain(summary.clone()).collect();
            output::refuse_clashes(input::file_of(&job.scene), &all, &beside)?;
        }

        let simd = args.simd.unwrap_or(SimdLevel::Auto);
        if !simd.is_available() {
            let names: Vec<&str> = SimdLevel::available().iter().map(|level| level.name()).collect();
            let (name, names) = (simd.name(), names.join(", "));
            return Err(Failure::Usage(format!("--simd {name} is not to be had on this processor; it has {names}")));
        }

        if let Some(option) = pictures.option()
            && outputs.iter().any(|output| output.target == Target::Stdout)
        {
            let (each, instead) = match option {
                "--frames" => ("frame", ", or give --time instead"),
                "--size" => ("size", ", or one size"),
                _ => ("view", ", or give --view instead"),
            };
            let message = format!("{option} writes a file for each {each}, and -o - is not one; name files{instead}");
            return Err(Failure::Usage(message));
        }

        // A file beside the pictures is one of all frames; several scenes have one each
        if let (Some(_), true, [file, ..]) = (args.shard, pictures.count() > 1, &beside[..]) {
            let what = pictures.word();
            let instead = match file.option() {
                "--stats" => "--stats alone is a table of each",
                _ => &format!("it takes all {what} in one run, without --shard"),
            };
            let message = format!("{}: every shard of the {what} would write this file; {instead}", file.name());
            return Err(Failure::Usage(message));
        }

        let mut settings = RenderSettings::default();
        settings.simd = simd;
        settings.threads = args.threads.and_then(|n| NonZeroUsize::new(n.into()));
        settings.tile_size = args.tile_size.unwrap_or(settings.tile_size);
        settings.crop = args.crop;
        settings.reference = args.reference;
        settings.visibility = args.visibility.unwrap_or(settings.visibility);
        if let Some(mode) = args.aa_mode {
            settings.aa_mode = match mode {
                AntialiasingMode::Adaptive => AaMode::Adaptive,
                AntialiasingMode::Full => AaMode::Full,
                AntialiasingMode::Multisample => AaMode::Multisample,
            };
        }

        let overrides = Overrides {
            width: args.width,
            height: args.height,
            size: args.size.first().copied(),
            transparent: args.transparent,
            background: args.background,
            antialiasing: args.aa,
            samples: args.samples,
            camera: args.camera.as_deref(),
            tolerance: args.tolerance,
            buffers: args.buffers.as_deref(),
            alone: outputs.iter().filter_map(|output| output.content.buffer().cloned()).collect(),
            motion_to: args.motion_to.as_ref(),
            terminator: args.shadow_terminator.map(|word| match word {
                Terminator::Smooth => ShadowTerminator::Smooth,
                Terminator::Hard => ShadowTerminator::Hard,
            }),
        };
        let (bits, quiet) = (args.bits, args.quiet);
        let plan = Self {
            jobs,
            outputs,
            heat,
            bits,
            stats,
            coco,
            summary,
            settings,
            overrides,
            display: args.display,
            depth_scale: args.depth_scale.unwrap_or(FileSettings::default().depth_scale),
            half: args.half,
            quality: args.quality.unwrap_or(FileSettings::default().jpeg_quality),
            strict: args.reading.strict,
            view: args.view,
            margin: args.margin,
            time: args.time.unwrap_or(0.0),
            mode_is_open: args.aa_mode.is_none() && args.visibility.is_none() && !args.reference,
            plays: args.time.is_some() || args.frames.is_some(),
            pictures,
            shard: args.shard,
            max_time: args.max_time.map(Duration::from_secs_f64),
            max_memory: args.max_memory.map(|mib| u64::from(mib) << 20),
            quiet,
        };
        if several {
            plan.refuse_shared()?;
        }
        Ok(plan)
    }

    /// Whether a picture is one to render. They are counted from 0, over all pictures of one scene after the other.
    fn takes(&self, scene: usize, picture: u64) -> bool {
        self.shard.is_none_or(|shard| shard.has(scene as u64 * self.pictures.count() + picture))
    }

    /// Leaves to the jobs those that have something to render.
    pub fn keep_shard(&mut self) {
        let mut jobs = std::mem::take(&mut self.jobs);
        jobs.retain(|job| (0..self.pictures.count()).any(|picture| self.takes(job.index, picture)));
        self.jobs = jobs;
    }

    /// Sees that no two of several scenes have an output in common, and that none is the file of another scene.
    fn refuse_shared(&self) -> Result<(), Failure> {
        let scenes: HashSet<Target> =
            self.jobs.iter().filter_map(|job| input::file_of(&job.scene)).map(|file| Target::of(file).real()).collect();
        let mut seen: HashMap<Target, usize> = HashMap::new();
        for (index, job) in self.jobs.iter().enumerate() {
            let own = if self.outputs.is_empty() {
                // What is wrong with it is said when it is its turn
                self.default_output(job, &shown(&job.scene), input::course_output(&job.scene).as_deref(), false)
                    .into_iter()
                    .collect()
            } else {
                self.outputs.clone()
            };
            let pictures = own
                .iter()
                .chain(&self.heat)
                .flat_map(|output| self.pictures.iter().map(move |picture| output.of_part(&picture.part).target));
            let beside = self.stats.file().into_iter().chain(&self.coco).map(|file| file.target.clone());
            for written in pictures.chain(beside) {
                let target = written.of_scene(&job.names);
                let (name, real) = (target.name(), target.real());
                if scenes.contains(&real) {
                    return Err(Failure::Usage(format!(
                        "{name} would replace the file of one of the scenes; name another output with -o"
                    )));
                }
                if let Some(before) = seen.insert(real, index)
                    && before != index
                {
                    let [one, other] = [&self.jobs[before], job].map(|job| job.scene.as_path());
                    let way = match (input::file_of(one), input::file_of(other)) {
                        _ if one == other => "name it once",
                        (Some(a), Some(b)) if Target::of(a).real() == Target::of(b).real() => {
                            "they are one file, name it once"
                        }
                        _ if self.jobs[before].names.name == job.names.name || written.has_name() => {
                            if self.jobs[before].names.parent != job.names.parent && !written.has_parent() {
                                "{parent} in the output's name keeps their folders apart"
                            } else if self.jobs[before].names.folder != job.names.folder && !written.has_folder() {
                                "{folder}, the path of a file's folder, in the output's name keeps them apart"
                            } else {
                                "render them in two calls, to folders of their own"
                            }
                        }
                        _ => "{name} in the output's name keeps their endings apart",
                    };
                    let (one, other) = (shown(one), shown(other));
                    return Err(Failure::Usage(format!("{one} and {other} would both be written to {name}; {way}")));
                }
            }
        }
        Ok(())
    }

    /// What messages call pictures: `3 frames of 8 x 6 pixels`.
    pub fn in_words(&self, moments: &[Moment]) -> String {
        let (word, count) = (self.pictures.word(), moments.len());
        match (count, self.size_of(moments)) {
            (1, Some([width, height])) => format!("{width} x {height} pixels"),
            (_, Some([width, height])) => format!("{count} {word} of {width} x {height} pixels"),
            (_, None) => format!("{count} {word}"),
        }
    }

    /// Columns and rows of pictures, if they have the same.
    pub fn size_of(&self, moments: &[Moment]) -> Option<[u32; 2]> {
        let mut sizes = moments.iter().map(|moment| moment.rendered(self.settings.crop));
        let first = sizes.next()?;
        sizes.all(|size| size == first).then_some(first)
    }

    /// The files beside the pictures of a scene.
    pub fn beside(&self, names: &Names) -> Vec<JsonFile> {
        let of_scene = self.stats.file().into_iter().chain(&self.coco).map(|file| file.of_scene(names));
        of_scene.chain(self.summary.clone()).collect()
    }

    /// The moments to render, each with its own files.
    pub fn moments(&self, job: &Job, input: &Input, joined: &Joined) -> Result<Vec<Moment>, Failure> {
        let beside = self.beside(&job.names);
        if let Some(option) = self.pictures.option() {
            let each = match option {
                "--frames" => "frame",
                "--size" => "size",
                _ => "view",
            };
            for output in &joined.outputs {
                if let Target::File(path) = &output.target
                    && path.metadata().is_ok_and(|meta| !meta.is_file() && !meta.is_dir())
                {
                    let path = shown(path);
                    return Err(Failure::Usage(format!(
                        "{option} writes a file for each {each}, and {path} is not one"
                    )));
                }
            }
        }
        // Compiling refuses a rate that is none
        let fps = Some(input.parsed.desc.render.fps).filter(|fps| *fps > 0.0).unwrap_or(1.0);
        let mut seen = HashSet::new();
        let mut moments = Vec::new();
        for picture in self.pictures.iter() {
            let of_part = joined.outputs.iter().map(|output| output.of_part(&picture.part));
            let outputs: Vec<Output> = of_part.map(|output| output.of_scene(&job.names)).collect();
            if self.pictures.option().is_some() {
                output::refuse_clashes(input::file_of(&job.scene), &outputs, &beside)?;
                for output in &outputs {
                    if let Target::File(path) = &output.target
                        && !seen.insert(path.clone())
                    {
                        let (what, path) = (self.pictures.word(), shown(path));
                        return Err(Failure::Usage(format!("two {what} would be {path}; give the files other names")));
                    }
                }
            }
            if self.takes(job.index, picture.index) {
                let to_make = joined.outputs.iter().zip(&outputs);
                let folders =
                    to_make.filter_map(|(template, output)| template.target.folder_to_make(&output.target)).collect();
                let view = match &self.pictures.views {
                    Views::One => None,
                    Views::Named(views) => Some(views[picture.view].view),
                    Views::Turntable(count) => Some(input.framing.view.turned(picture.view as u32, *count)),
                };
                moments.push(Moment {
                    time: picture.part.frame.map_or(self.time, |frame| f64::from(frame) / fps),
                    framing: view.map_or(input.framing, |view| Framing { view, ..input.framing }),
                    size: joined.sizes[picture.size],
                    outputs,
                    folders,
                });
            }
        }
        Ok(moments)
    }

    /// Brings the plan and the scene together: the description takes the overrides, and what the plan leaves open
    /// is decided.
    ///
    /// # Errors
    /// What the options ask for and the scene has not.
    pub fn join(&self, job: &Job, input: &mut Input) -> Result<Joined, Failure> {
        // A text with faults may lack what the options refer to: say the faults, not what follows from them
        if input.parsed.faults().iter().any(|fault| fault.severity == firstlight::Severity::Error) {
            input.compile(self.time, self.quiet)?;
        }
        input.show(self.plays, self.overrides.camera.is_some());
        let own = (input.parsed.desc.render.width, input.parsed.desc.render.height);
        self.overrides.apply(&mut input.parsed.desc)?;
        self.frame(input)?;

        let mut settings = self.settings.clone();
        // Nothing is compared with the picture of a model by itself: it is to be there soon
        if input.studio.is_some() && self.mode_is_open {
            settings.aa_mode = AaMode::Multisample;
        }
        if settings.threads.is_none() {
            // A course file's wish, held to what --threads allows
            let threads = input.parsed.threads.map(|n| n.min(1024) as usize);
            settings.threads = threads.and_then(NonZeroUsize::new);
        }
        let first = (input.parsed.desc.render.width, input.parsed.desc.render.height);
        let others = self.pictures.sizes.iter().skip(1).map(|size| sized(*size, own));
        let sizes: Vec<(u32, u32)> = iter::once(Ok(first)).chain(others).collect::<Result<_, _>>()?;
        for (width, height) in sizes.iter().copied() {
            check_size(settings.crop, width, height)?;
        }

        if !self.outputs.is_empty() {
            let outputs = self.outputs.iter().chain(&self.heat).cloned().collect();
            return Ok(Joined { outputs, settings, sizes });
        }
        let outputs: Vec<Output> =
            iter::once(self.default_output(job, &input.name, input.parsed.output.as_deref(), true)?)
                .chain(self.heat.clone())
                .collect();
        let own: Vec<Output> = outputs.iter().map(|output| output.of_scene(&job.names)).collect();
        output::refuse_clashes(input::file_of(&job.scene), &own, &self.beside(&job.names))?;
        Ok(Joined { outputs, settings, sizes })
    }

    /// Says what comes of buffers that the scene asks for, where no output takes them.
    pub fn check_buffers(&self, outputs: &[Output], asked: &[BufferDesc]) -> Result<(), Failure> {
        let takes = outputs.iter().any(Output::takes_buffers);
        if self.overrides.buffers.is_some() && !takes {
            let message = "--buffers is for .exr and .npz files, and no output is one; name one with -o";
            return Err(Failure::Usage(message.into()));
        }
        if !takes && asked != [Plane::Color.into()] && !self.quiet {
            say(format_args!("the scene asks for buffers, and no output takes them: .exr and .npz files do"));
        }
        Ok(())
    }

    /// Has a camera that is found for the scene frame it as asked.
    fn frame(&self, input: &mut Input) -> Result<(), Failure> {
        let (named, turned) = match self.pictures.views {
            Views::One => (false, false),
            Views::Named(_) => (true, false),
            Views::Turntable(_) => (false, true),
        };
        let options = [
            ("--view", self.view.is_some()),
            ("--views", named),
            ("--turntable", turned),
            ("--margin", self.margin.is_some()),
        ];
        for (option, said) in options {
            if said && !input.parsed.desc.cameras.is_empty() {
                let name = &input.name;
                return Err(Failure::Usage(format!(
                    "{option} is for models and for scenes without a camera, and {name} has one; take its [camera] \
                     out, or leave the option out"
                )));
            }
        }
        let found = input.framing;
        let (view, margin) = (self.view.unwrap_or(found.view), self.margin.unwrap_or(found.margin));
        // The camera stands still in all frames; of one moment there is a model by itself as it is then
        let is_single = input.studio.is_some() && self.pictures.frames.is_none();
        let time = if is_single { self.time } else { found.time };
        input.framing = Framing { view, margin, time, ..found };
        Ok(())
    }

    /// A course file's `output_file`, else the scene's name with `.png`, in the working folder. Of the files there it
    /// takes the place of none but our own pictures: `bunny.obj` may well have a texture `bunny.png` beside it. `tell`:
    /// says so.
    fn default_output(&self, job: &Job, scene: &str, course: Option<&str>, tell: bool) -> Result<Output, Failure> {
        if let Some(path) = course {
            let path = PathBuf::from(path);
            let format = output::with_bits(output::format_of_course(scene, &path)?, self.bits);
            return Ok(Output { target: Target::File(path), format, content: Content::Scene });
        }
        let format = output::with_bits(Format::Png8, self.bits);
        let choices = ["{stem}.png", "{stem}.render.png"].map(|name| Output {
            target: Target::File(PathBuf::from(name)),
            format,
            content: Content::Scene,
        });
        let is_free = |output: &Output| {
            self.pictures.iter().all(|picture| output.of_part(&picture.part).of_scene(&job.names).is_free())
        };
        let [name, other] = choices.each_ref().map(|output| output.of_scene(&job.names).target.name());
        let Some(free) = choices.iter().position(is_free) else {
            return Err(Failure::Work(format!(
                "{name} and {other} would replace files that are no pictures of firstlight; name another with -o"
            )));
        };
        if free > 0 && tell && !self.quiet {
            say(format_args!("{name} is there and is no picture of firstlight; writing {other}"));
        }
        Ok(choices[free].clone())
    }
}

/// A plan and a scene, brought together.
pub(super) struct Joined {
    /// The pictures, without what tells those of one scene apart, nor the names of the scene.
    pub outputs: Vec<Output>,
    pub settings: RenderSettings,
    /// Columns and rows, of each size.
    pub sizes: Vec<(u32, u32)>,
}

/// The frames, views and sizes in which each scene is rendered, from the options.
fn pictures_of(args: &RenderArgs) -> Result<Pictures, Failure> {
    let twice = |option: &str, what: String| {
        Failure::Usage(format!("{option} names {what} twice; each is a picture of its own, name it once"))
    };
    if let Some((_, size)) = args.size.iter().enumerate().find(|(i, size)| args.size[..*i].contains(size)) {
        return Err(twice("--size", size.to_string()));
    }
    let before = |i: usize, view: &NamedView| args.views[..i].iter().any(|other| other.name == view.name);
    if let Some((_, view)) = args.views.iter().enumerate().find(|(i, view)| before(*i, view)) {
        return Err(twice("--views", view.name.to_owned()));
    }
    let views = match args.turntable {
        Some(count) => Views::Turntable(count),
        None if args.views.is_empty() => Views::One,
        None => Views::Named(args.views.clone()),
    };
    Ok(Pictures { frames: args.frames, views, sizes: args.size.clone() })
}

/// Checks that the crop lies inside the picture, and that the picture has no more pixels than the limit.
///
/// # Errors
/// The option and the limit.
fn check_size(crop: Option<Window>, width: u32, height: u32) -> Result<(), Failure> {
    if let Some(crop) = crop
        && !inside(crop, width, height)
    {
        let Window { x, y, width: w, height: h } = crop;
        return Err(Failure::Usage(format!(
            "--crop {x},{y},{w},{h} is not inside the picture, which is {width} x {height} pixels"
        )));
    }
    let (width, height) = crop.map_or((width, height), |crop| (crop.width, crop.height));
    let pixels = u64::from(width) * u64::from(height);
    if pixels > PIXEL_LIMIT {
        return Err(Failure::Usage(format!(
            "{width} x {height} are {pixels} pixels, and at most {PIXEL_LIMIT} are rendered at once; render parts \
             of the picture, each with --crop X,Y,WIDTH,HEIGHT"
        )));
    }
    Ok(())
}

/// The picture of the work is a `.png`.
fn heat_output(path: &Path) -> Result<Output, Failure> {
    let target = Target::of(path);
    let is_png = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
    if target == Target::Stdout || !is_png {
        let name = shown(path);
        return Err(Failure::Usage(format!("--heat {name}: the file's name must end in .png")));
    }
    Ok(Output { target, format: Format::Png8, content: Content::Heat })
}

fn inside(crop: Window, width: u32, height: u32) -> bool {
    let end = |start: u32, length: u32| u64::from(start) + u64::from(length);
    end(crop.x, crop.width) <= u64::from(width) && end(crop.y, crop.height) <= u64::from(height)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crop_may_touch_the_edges() {
        let crop = |x, y, width, height| inside(Window { x, y, width, height }, 10, 20);
        assert!(crop(0, 0, 10, 20) && crop(9, 19, 1, 1));
        assert!(!crop(0, 0, 11, 1) && !crop(10, 0, 1, 1) && !crop(0, 20, 1, 1) && !crop(u32::MAX, 0, u32::MAX, 1));
    }
}
