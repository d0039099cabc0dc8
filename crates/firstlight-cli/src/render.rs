//! `firstlight render`: from a scene to picture files.

mod contents;
mod dark;
mod empty;
mod moments;
mod overrides;
mod pictures;
mod plan;
mod print;
mod summary;

use std::time::{Duration, Instant};

use firstlight::{Coco, Framing};

use crate::args::{ReadingArgs, RenderArgs, Shard};
use crate::input::{self, Input};
use crate::interrupt::Watch;
use crate::output::{Ready, Target};
use crate::report::{Failure, say, shown, whole};
use crate::stats::Stats;
use moments::{Moment, Run, Took};
use pictures::Views;
use plan::{Job, Plan, StatsPlan};
use summary::Summary;

/// Renders.
///
/// # Errors
/// Wrong usage; a scene that cannot be had or has faults; an output that cannot be written; an interruption.
pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    let mut plan = Plan::resolve(args)?;
    if let Some(target) = &args.print_scene {
        return print::run(&plan, target.as_deref(), &args.reading);
    }
    plan.keep_shard();
    let mut summary = Summary::begin(plan.summary.as_ref())?;
    match &plan.jobs[..] {
        [] => {
            if let (Some(Shard { index, count }), false) = (plan.shard, plan.quiet) {
                say(format_args!("shard {index} of {count} has nothing to do: there are fewer pictures"));
            }
            Ok(())
        }
        [job] => render(&plan, job, &args.reading, &mut summary),
        jobs => render_all(&plan, jobs, &args.reading, &mut summary),
    }?;
    summary.finish()
}

/// Renders one scene after the other, also after one that failed.
fn render_all(plan: &Plan, jobs: &[Job], reading: &ReadingArgs, summary: &mut Summary) -> Result<(), Failure> {
    let (all, mut failed) = (jobs.len(), Vec::new());
    for (index, job) in jobs.iter().enumerate() {
        let scene = shown(&job.scene);
        if !plan.quiet {
            say(format_args!("[{} of {all}] {scene}", index + 1));
        }
        match render(plan, job, reading, summary) {
            Ok(()) => {}
            Err(failure) if failure.is_interruption() => {
                if !matches!(failure, Failure::Interrupted) {
                    failure.show("render");
                }
                return Err(Failure::InterruptedIn { scene, done: index - failed.len(), all });
            }
            Err(failure) => {
                failure.show("render");
                failed.push(whole(&job.scene));
            }
        }
    }
    if !failed.is_empty() {
        return Err(Failure::Several { failed, all });
    }
    if !plan.quiet {
        say(format_args!("{all} scenes were rendered"));
    }
    Ok(())
}

/// Renders one scene, and keeps in the summary how its last picture ended if it failed.
fn render(plan: &Plan, job: &Job, reading: &ReadingArgs, summary: &mut Summary) -> Result<(), Failure> {
    summary.scene(job.scene.to_string_lossy().into_owned());
    let done = render_pictures(plan, job, reading, summary);
    match &done {
        Err(failure) if !failure.is_interruption() => summary.end(Some(failure)),
        _ => {}
    }
    done
}

/// Renders the pictures of one scene.
fn render_pictures(plan: &Plan, job: &Job, reading: &ReadingArgs, summary: &mut Summary) -> Result<(), Failure> {
    if input::file_of(&job.scene).is_some_and(|scene| scene.is_dir()) {
        return Err(input::fault_of_folder(&job.scene));
    }
    let began = Instant::now();
    // Read the scene, and bring it together with the arguments
    let (input, parse) = timed(|| input::read(&job.scene, reading));
    let mut input = input?;
    input.memory = plan.max_memory;
    let joined = plan.join(job, &mut input)?;
    plan.check_buffers(&joined.outputs, &input.parsed.desc.render.buffers)?;
    let mut moments = plan.moments(job, &input, &joined)?;
    let settings = joined.settings;
    let several = plan.pictures.several();
    if several.views || several.sizes {
        input.remember_all();
    } else if moments.len() > 1 || input.parsed.desc.render.motion_to.is_some() {
        input.remember_files();
    }

    // See whether the numbers can be written, and the picture or the first of them, before any work is done for them;
    // this may make a file for a moment
    let watch = Watch::begin();
    let mut ready = Some(moments[0].ready()?);
    let beside = plan.beside(&job.names);
    let stats_file = plan.stats.file().map(|file| file.of_scene(&job.names).target.ready()).transpose()?;
    let coco = plan.coco.as_ref().map(|file| file.of_scene(&job.names).target);
    let coco_file = coco.as_ref().map(Target::ready).transpose()?;
    watch.check()?;
    drop(watch);
    if let Views::Turntable(count) = plan.pictures.views {
        keep_distance(&mut input, &mut moments, count)?;
    }

    // One moment after the other
    let name = input.name.clone();
    let mut run = Run {
        plan,
        input: &mut input,
        summary,
        settings: &settings,
        beside: &beside,
        coco: coco.map(|target| (Coco::new(), target)),
        progress: None,
        deadline: None,
        warned: Vec::new(),
    };
    let mut took: Option<Took> = None;
    for (index, moment) in moments.iter().enumerate() {
        run.summary.picture(&name, &moment.outputs);
        let begins = if index == 0 { began } else { Instant::now() };
        run.deadline = plan.max_time.and_then(|time| begins.checked_add(time));
        let done = match ready.take() {
            Some(ready) => run.render(index, &moments, ready),
            None => moment.ready().and_then(|ready| run.render(index, &moments, ready)),
        };
        let done = done.map_err(|failure| match failure {
            Failure::Interrupted if index > 0 => {
                Failure::InterruptedAfter { done: index, all: moments.len(), what: plan.pictures.word() }
            }
            failure => failure,
        })?;
        took = Some(match took {
            Some(before) => before.and(done),
            None => done,
        });
    }

    if let (Some(ready), Some((coco, _))) = (coco_file, &run.coco) {
        write_json(plan, ready, &coco.to_json())?;
    }

    // Say what it took
    let Some(Took { compile, render, write, rays }) = took else { return Ok(()) };
    let (size, pictures, what) = (plan.size_of(&moments), moments.len(), plan.in_words(&moments));
    let stats = Stats { scene: name, size, pictures, what, parse, compile, render, write, rays };
    if let StatsPlan::Table = plan.stats {
        say(format_args!("{}", stats.to_table()));
    }
    if let Some(ready) = stats_file {
        write_json(plan, ready, &stats.to_json())?;
    }
    Ok(())
}

/// Has all views of a turntable look from one distance, the least at which each of them holds what is seen: as it is at
/// the moment for which a camera is found.
///
/// # Errors
/// Those of compiling.
fn keep_distance(input: &mut Input, moments: &mut [Moment], count: u32) -> Result<(), Failure> {
    let mut known: Vec<((u32, u32), Option<f64>)> = Vec::new();
    for moment in moments {
        let found = known.iter().find(|(size, _)| *size == moment.size).map(|(_, distance)| *distance);
        let distance = match found {
            Some(distance) => distance,
            None => {
                let render = &mut input.parsed.desc.render;
                (render.width, render.height) = moment.size;
                let first = input.framing;
                let distance = input.compile(first.time, true)?.scene.turntable_distance(&first, count);
                known.push((moment.size, distance));
                distance
            }
        };
        moment.framing = Framing { distance, ..moment.framing };
    }
    Ok(())
}

fn write_json(plan: &Plan, ready: Ready, json: &str) -> Result<(), Failure> {
    let watch = Watch::begin();
    ready.stage(json.as_bytes())?.commit(plan.quiet, &|| watch.check().is_err())
}

fn timed<T>(f: impl FnOnce() -> T) -> (T, Duration) {
    let started = Instant::now();
    let result = f();
    (result, started.elapsed())
}
