//! `firstlight render`: from a scene to picture files.

use std::collections::HashSet;
use std::iter;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use firstlight::{
    AaMode, Diagnostic, Display, Format, LightDesc, RenderSettings, RenderStats, SampleSet, SamplesDesc, SceneDesc,
    ShadowTerminator, SimdLevel, Window,
};

use crate::args::{AntialiasingMode, Bits, Frames, RenderArgs, Terminator};
use crate::faster::faster;
use crate::input::{self, Input};
use crate::interrupt::Watch;
use crate::output::{self, Content, Output, Ready, Staged, Target};
use crate::progress::Progress;
use crate::report::{Failure, say, show_diagnostics, shown};
use crate::stats::Stats;

/// No film has more pixels.
const PIXEL_LIMIT: u64 = 1 << 27;
/// Nor more on one side.
const SIDE_LIMIT: u64 = 1 << 16;

/// The arguments, understood as far as they can be without the scene.
struct Plan<'a> {
    scene: &'a Path,
    /// Empty: the one that the scene says.
    outputs: Vec<Output>,
    heat: Option<Output>,
    bits: Option<Bits>,
    stats: StatsPlan,
    settings: RenderSettings,
    overrides: Overrides<'a>,
    /// Of 8- and 16-bit files, in place of the scene's.
    exposure: Option<f64>,
    time: f64,
    frames: Option<Frames>,
    quiet: bool,
}

/// Where the numbers go.
enum StatsPlan {
    Nowhere,
    Table,
    Json(Target),
}

impl StatsPlan {
    /// Where JSON goes.
    fn target(&self) -> Option<&Target> {
        match self {
            StatsPlan::Json(target) => Some(target),
            StatsPlan::Nowhere | StatsPlan::Table => None,
        }
    }
}

/// What the command line says in place of the scene.
struct Overrides<'a> {
    width: Option<u32>,
    height: Option<u32>,
    antialiasing: Option<u32>,
    samples: Option<SamplesDesc>,
    camera: Option<&'a str>,
    terminator: Option<ShadowTerminator>,
}

/// Renders.
///
/// # Errors
/// Wrong usage; a scene that cannot be had or has faults; an output that cannot be written; an interruption.
pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    // Understand the arguments, read the scene, bring both together
    let plan = Plan::resolve(args)?;
    let (input, parse) = timed(|| input::read(plan.scene, &args.reading));
    let mut input = input?;
    let (outputs, settings) = plan.join(&mut input)?;
    let moments = plan.moments(&input, &outputs)?;
    if moments.len() > 1 {
        input.remember_files();
    }

    // See whether the numbers can be written, and the picture or the first of them, before any work is done for them; this
    // may make a file for a moment
    let watch = Watch::begin();
    let mut ready = Some(moments[0].ready()?);
    let stats_file = plan.stats.target().map(Target::ready).transpose()?;
    watch.check()?;
    drop(watch);

    // One moment after the other
    let render = &input.parsed.desc.render;
    let (x, y, width, height) = (0, 0, render.width, render.height);
    let window = settings.crop.unwrap_or(Window { x, y, width, height });
    let mut run = Run { plan: &plan, input: &input, settings: &settings, progress: None, warned: Vec::new() };
    let mut took: Option<Took> = None;
    for (index, moment) in moments.iter().enumerate() {
        let done = match ready.take() {
            Some(ready) => run.render(index, &moments, window, ready),
            None => moment.ready().and_then(|ready| run.render(index, &moments, window, ready)),
        };
        let done = done.map_err(|failure| match failure {
            Failure::Interrupted if index > 0 => Failure::InterruptedAfter { done: index, all: moments.len() },
            failure => failure,
        })?;
        took = Some(match took {
            Some(before) => before.and(done),
            None => done,
        });
    }

    // Say what it took
    let Some(Took { compile, render, write, rays }) = took else { return Ok(()) };
    let (width, height, frames) = (window.width, window.height, moments.len());
    let stats = Stats { scene: input.name, width, height, frames, parse, compile, render, write, rays };
    if let StatsPlan::Table = plan.stats {
        say(format_args!("{}", stats.to_table()));
    }
    if let Some(ready) = stats_file {
        let watch = Watch::begin();
        let json = stats.to_json();
        ready.stage(json.as_bytes())?.commit(plan.quiet, &|| watch.check().is_err())?;
    }
    Ok(())
}

/// A moment to render, and where its pictures go.
struct Moment {
    /// In seconds.
    time: f64,
    outputs: Vec<Output>,
}

impl Moment {
    fn ready(&self) -> Result<Vec<Ready>, Failure> {
        self.outputs.iter().map(|output| output.target.ready()).collect()
    }
}

/// What one moment took, or several.
struct Took {
    compile: Duration,
    render: Duration,
    write: Duration,
    rays: RenderStats,
}

impl Took {
    fn and(self, other: Took) -> Took {
        let rays = self.rays.and(&other.rays);
        Took {
            compile: self.compile + other.compile,
            render: self.render + other.render,
            write: self.write + other.write,
            rays,
        }
    }
}

/// The rendering of one moment after the other.
struct Run<'a> {
    plan: &'a Plan<'a>,
    input: &'a Input,
    settings: &'a RenderSettings,
    /// Once there is something to render.
    progress: Option<Progress>,
    /// What has been said already.
    warned: Vec<Diagnostic>,
}

impl Run<'_> {
    /// Compiles, renders and writes one of the moments.
    fn render(&mut self, index: usize, moments: &[Moment], window: Window, ready: Vec<Ready>) -> Result<Took, Failure> {
        let (plan, settings, moment) = (self.plan, self.settings, &moments[index]);

        // Compile
        let (compiled, compile) = timed(|| self.input.compile(moment.time, plan.quiet));
        let mut compiled = compiled?;
        // Now it is known which files the scene is made of: none of them may be lost, by none of the frames to come
        let ahead = if index == 0 { moments } else { &moments[index..=index] };
        let outputs = ahead.iter().flat_map(|moment| &moment.outputs);
        output::refuse_overwriting(&self.input.files(), outputs, plan.stats.target())?;
        compiled.warnings.retain(|warning| !self.warned.contains(warning));
        if !compiled.warnings.is_empty() {
            let show = || show_diagnostics(&compiled.warnings);
            self.progress.as_ref().map_or_else(show, |progress| progress.aside(show));
            self.warned.append(&mut compiled.warnings);
        }
        let scene = &compiled.scene;
        settings.check(scene).map_err(Failure::Usage)?;
        settings.check_memory(scene).map_err(Failure::Work)?;

        // Render, until somebody asks to stop
        let watch = Watch::begin();
        let pixels = u64::from(window.width) * u64::from(window.height);
        let begin = || {
            let faster = faster(scene, settings, &self.input.parsed.desc.render);
            Progress::begin(pixels, moments.len() as u64, plan.quiet, faster)
        };
        let progress = &*self.progress.get_or_insert_with(begin);
        progress.frame(index as u64);
        let (rendered, render) = timed(|| {
            firstlight::render(scene, settings, &|done, _| {
                progress.update(done);
                watch.flow()
            })
        });
        let ControlFlow::Continue((film, rays)) = rendered else { return Err(Failure::Interrupted) };
        if index + 1 == moments.len() {
            progress.finish(window.width, window.height);
        }

        // Encode all pictures and bring them to the disk, then let them appear
        let (written, write) = timed(|| {
            let heat = film.heat().map(|heat| heat.picture());
            let (image, receipt) = (film.develop(), scene.receipt(settings));
            let own = scene.display();
            let display = Display { exposure: plan.exposure.unwrap_or(own.exposure), ..own };
            let encode = |output: &Output| match (output.content, &heat) {
                (Content::Heat, Some(heat)) => heat.encode(output.format, &Display::default(), &receipt),
                _ => image.encode(output.format, &display, &receipt),
            };
            let bytes: Vec<Vec<u8>> = moment
                .outputs
                .iter()
                .map(encode)
                .collect::<Result<_, _>>()
                .map_err(|e| Failure::Work(e.to_string()))?;
            watch.check()?;
            let stage = ready.into_iter().zip(&bytes).map(|(ready, bytes)| ready.stage(bytes));
            let staged: Vec<Staged> = stage.collect::<Result<_, _>>()?;
            watch.check()?;
            progress.aside(|| output::commit(staged, plan.quiet, &|| watch.check().is_err()))
        });
        written?;
        Ok(Took { compile, render, write, rays })
    }
}

fn timed<T>(f: impl FnOnce() -> T) -> (T, Duration) {
    let started = Instant::now();
    let result = f();
    (result, started.elapsed())
}

impl<'a> Plan<'a> {
    fn resolve(args: &'a RenderArgs) -> Result<Self, Failure> {
        let outputs = output::resolve(&args.output, args.bits, args.format)?;

        let stats = match &args.stats {
            None => StatsPlan::Nowhere,
            Some(None) => StatsPlan::Table,
            Some(Some(path)) => StatsPlan::Json(stats_target(path)?),
        };
        let heat = args.heat.as_deref().map(heat_output).transpose()?;
        let all: Vec<Output> = outputs.iter().chain(&heat).cloned().collect();
        output::refuse_clashes(input::file_of(&args.scene), &all, stats.target())?;

        let simd = args.simd.unwrap_or(SimdLevel::Auto);
        if !simd.is_available() {
            let names: Vec<&str> = SimdLevel::available().iter().map(|level| level.name()).collect();
            let (name, names) = (simd.name(), names.join(", "));
            return Err(Failure::Usage(format!("--simd {name} is not to be had on this processor; it has {names}")));
        }

        if args.frames.is_some() && outputs.iter().any(|output| output.target == Target::Stdout) {
            let message =
                "--frames writes a file for each frame, and -o - is not one; name files, or give --time instead";
            return Err(Failure::Usage(message.into()));
        }

        let mut settings = RenderSettings::default();
        settings.simd = simd;
        settings.threads = args.threads.and_then(|n| NonZeroUsize::new(n.into()));
        settings.tile_size = args.tile_size.unwrap_or(settings.tile_size);
        settings.crop = args.crop;
        settings.reference = args.reference;
        settings.heat = heat.is_some();
        settings.visibility = args.visibility.unwrap_or(settings.visibility);
        if let Some(mode) = args.aa_mode {
            settings.aa_mode = match mode {
                AntialiasingMode::Adaptive => AaMode::Adaptive,
                AntialiasingMode::Full => AaMode::Full,
            };
        }

        let overrides = Overrides {
            width: args.width,
            height: args.height,
            antialiasing: args.aa,
            samples: args.samples,
            camera: args.camera.as_deref(),
            terminator: args.shadow_terminator.map(|word| match word {
                Terminator::Smooth => ShadowTerminator::Smooth,
                Terminator::Hard => ShadowTerminator::Hard,
            }),
        };
        let (scene, bits, frames, quiet) = (args.scene.as_path(), args.bits, args.frames, args.quiet);
        Ok(Self {
            scene,
            outputs,
            heat,
            bits,
            stats,
            settings,
            overrides,
            exposure: args.exposure,
            time: args.time.unwrap_or(0.0),
            frames,
            quiet,
        })
    }

    /// The moments to render, each with its own files.
    fn moments(&self, input: &Input, outputs: &[Output]) -> Result<Vec<Moment>, Failure> {
        let Some(Frames { first, last }) = self.frames else {
            return Ok(vec![Moment { time: self.time, outputs: outputs.to_vec() }]);
        };
        for output in outputs {
            if let Target::File(path) = &output.target
                && path.metadata().is_ok_and(|meta| !meta.is_file() && !meta.is_dir())
            {
                let path = shown(path);
                return Err(Failure::Usage(format!("--frames writes a file for each frame, and {path} is not one")));
            }
        }
        // Compiling refuses a rate that is none
        let fps = Some(input.parsed.desc.render.fps).filter(|fps| *fps > 0.0).unwrap_or(1.0);
        let mut seen = HashSet::new();
        let mut moments = Vec::new();
        for frame in first..=last {
            let outputs: Vec<Output> = outputs.iter().map(|output| output.of_frame(frame)).collect();
            output::refuse_clashes(input::file_of(self.scene), &outputs, self.stats.target())?;
            for output in &outputs {
                if let Target::File(path) = &output.target
                    && !seen.insert(path.clone())
                {
                    let path = shown(path);
                    return Err(Failure::Usage(format!("two frames would be {path}; give the files other names")));
                }
            }
            moments.push(Moment { time: f64::from(frame) / fps, outputs });
        }
        Ok(moments)
    }

    /// Brings the plan and the scene together: the description takes the overrides, and what the plan leaves open
    /// is decided.
    fn join(&self, input: &mut Input) -> Result<(Vec<Output>, RenderSettings), Failure> {
        // A text with faults may lack what the options refer to: say the faults, not what follows from them
        if input.parsed.faults().iter().any(|fault| fault.severity == firstlight::Severity::Error) {
            input.compile(self.time, self.quiet)?;
        }
        self.overrides.apply(&mut input.parsed.desc)?;

        let mut settings = self.settings.clone();
        if settings.threads.is_none() {
            // A course file's wish, held to what --threads allows
            let threads = input.parsed.threads.map(|n| n.min(1024) as usize);
            settings.threads = threads.and_then(NonZeroUsize::new);
        }
        let (width, height) = (input.parsed.desc.render.width, input.parsed.desc.render.height);
        if let Some(crop) = settings.crop
            && !inside(crop, width, height)
        {
            let Window { x, y, width: w, height: h } = crop;
            return Err(Failure::Usage(format!(
                "--crop {x},{y},{w},{h} is not inside the picture, which is {width} x {height} pixels"
            )));
        }

        if !self.outputs.is_empty() {
            return Ok((self.outputs.iter().chain(&self.heat).cloned().collect(), settings));
        }
        let outputs = iter::once(self.default_output(input)?).chain(self.heat.clone()).collect::<Vec<_>>();
        output::refuse_clashes(input::file_of(self.scene), &outputs, self.stats.target())?;
        Ok((outputs, settings))
    }

    /// A course file's `output_file`, else the scene's name with `.png`, in the working folder. Of the files there it takes the
    /// place of none but our own pictures: `bunny.obj` may well have a texture `bunny.png` beside it.
    fn default_output(&self, input: &Input) -> Result<Output, Failure> {
        let (path, format) = match &input.parsed.output {
            Some(path) => {
                let path = PathBuf::from(path);
                let format = output::format_of_course(&input.name, &path)?;
                (path, format)
            }
            None => {
                let named = |ending: &str| {
                    let mut name = input.stem.clone().into_os_string();
                    name.push(ending);
                    Output { target: Target::File(name.into()), format: Format::Png8, content: Content::Scene }
                };
                let is_free = |output: &Output| match self.frames {
                    Some(Frames { first, last }) => (first..=last).all(|frame| output.of_frame(frame).is_free()),
                    None => output.is_free(),
                };
                let choices = [".png", ".render.png"].map(named);
                let [name, other] = choices.each_ref().map(|output| output.target.name());
                let Some(free) = choices.iter().position(is_free) else {
                    return Err(Failure::Work(format!(
                        "{name} and {other} would replace files that are no pictures of firstlight; name another with -o"
                    )));
                };
                if free > 0 && !self.quiet {
                    say(format_args!("{name} is there and is no picture of firstlight; writing {other}"));
                }
                return Ok(Output { format: output::with_bits(Format::Png8, self.bits), ..choices[free].clone() });
            }
        };
        Ok(Output { target: Target::File(path), format: output::with_bits(format, self.bits), content: Content::Scene })
    }
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

/// A file for the numbers is a `.json`, so that no slip of the hand writes them over a scene or a picture.
fn stats_target(path: &Path) -> Result<Target, Failure> {
    let target = Target::of(path);
    let is_json = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
    if target != Target::Stdout && !is_json {
        let name = shown(path);
        return Err(Failure::Usage(format!("--stats={name}: the file's name must end in .json; - is standard output")));
    }
    Ok(target)
}

fn inside(crop: Window, width: u32, height: u32) -> bool {
    let end = |start: u32, length: u32| u64::from(start) + u64::from(length);
    end(crop.x, crop.width) <= u64::from(width) && end(crop.y, crop.height) <= u64::from(height)
}

impl Overrides<'_> {
    fn apply(&self, desc: &mut SceneDesc) -> Result<(), Failure> {
        let render = &mut desc.render;
        let (width, height) = film_size((self.width, self.height), (render.width, render.height))?;
        (render.width, render.height) = (width, height);
        render.antialiasing = self.antialiasing.unwrap_or(render.antialiasing);
        render.shadow_terminator = self.terminator.unwrap_or(render.shadow_terminator);
        if let Some(name) = self.camera {
            if !desc.cameras.iter().any(|(known, _)| known == name) {
                return Err(Failure::Usage(no_such_camera(name, desc)));
            }
            render.camera = Some(name.to_owned());
        }
        if let Some(samples) = self.samples {
            render.samples = samples;
            for light in &mut desc.lights {
                set_samples(light, samples)?;
            }
        }
        Ok(())
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
            "--samples {samples}: a light of this scene samples m x m cells; the nearest such numbers are {below} and {above}"
        )));
    }
    light.set_samples(samples);
    Ok(())
}

fn no_such_camera(name: &str, desc: &SceneDesc) -> String {
    let names: Vec<&str> = desc.cameras.iter().map(|(name, _)| name.as_str()).filter(|name| !name.is_empty()).collect();
    match names[..] {
        [] => format!("--camera {name}: the scene names no cameras; leave the option out"),
        _ => format!("--camera {name}: the scene has no such camera; it has {}", names.join(", ")),
    }
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
    if width > SIDE_LIMIT || height > SIDE_LIMIT || width * height > PIXEL_LIMIT {
        return Err(Failure::Usage(format!(
            "--width and --height make a picture of {width} x {height} pixels; at most {SIDE_LIMIT} on a side and \
             {PIXEL_LIMIT} in all are possible"
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
        assert!(film_size((Some(65536), Some(2048)), (1, 1)).is_ok());
        assert!(film_size((Some(65536), Some(2049)), (1, 1)).is_err());
        // Nothing asked: the scene's own sizes are not judged here
        assert_eq!(film_size((None, None), (0, 7)).ok(), Some((0, 7)));
    }

    #[test]
    fn a_crop_may_touch_the_edges() {
        let crop = |x, y, width, height| inside(Window { x, y, width, height }, 10, 20);
        assert!(crop(0, 0, 10, 20) && crop(9, 19, 1, 1));
        assert!(!crop(0, 0, 11, 1) && !crop(10, 0, 1, 1) && !crop(0, 20, 1, 1) && !crop(u32::MAX, 0, u32::MAX, 1));
    }
}
