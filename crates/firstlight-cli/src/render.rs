//! `firstlight render`: from a scene to picture files.

mod contents;
mod dark;
mod moments;
mod overrides;
mod plan;
mod print;

use std::time::{Duration, Instant};

use firstlight::{Coco, Window};

use crate::args::{ReadingArgs, RenderArgs, Shard};
use crate::input;
use crate::interrupt::Watch;
use crate::output::{Ready, Target};
use crate::report::{Failure, say, shown, whole};
use crate::stats::Stats;
use moments::{Run, Took};
use plan::{Job, Plan, StatsPlan};

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
    match &plan.jobs[..] {
        [] => {
            if let (Some(Shard { index, count }), false) = (plan.shard, plan.quiet) {
                say(format_args!("shard {index} of {count} has nothing to do: there are fewer pictures"));
            }
            Ok(())
        }
        [job] => render(&plan, job, &args.reading),
        jobs => render_all(&plan, jobs, &args.reading),
    }
}

/// Renders one scene after the other, also after one that failed.
fn render_all(plan: &Plan, jobs: &[Job], reading: &ReadingArgs) -> Result<(), Failure> {
    let (all, mut failed) = (jobs.len(), Vec::new());
    for (index, job) in jobs.iter().enumerate() {
        let scene = shown(job.scene);
        if !plan.quiet {
            say(format_args!("[{} of {all}] {scene}", index + 1));
        }
        match render(plan, job, reading) {
            Ok(()) => {}
            Err(
                failure @ (Failure::Interrupted | Failure::InterruptedWriting(_) | Failure::InterruptedAfter { .. }),
            ) => {
                if !matches!(failure, Failure::Interrupted) {
                    failure.show("render");
                }
                return Err(Failure::InterruptedIn { scene, done: index - failed.len(), all });
            }
            Err(failure) => {
                failure.show("render");
                failed.push(whole(job.scene));
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

/// Renders one scene.
fn render(plan: &Plan, job: &Job, reading: &ReadingArgs) -> Result<(), Failure> {
    // Read the scene, and bring it together with the arguments
    let (input, parse) = timed(|| input::read(job.scene, reading));
    let mut input = input?;
    let (outputs, settings) = plan.join(job, &mut input)?;
    plan.check_buffers(&outputs, &input.parsed.desc.render.buffers)?;
    let moments = plan.moments(job, &input, &outputs)?;
    if moments.len() > 1 || input.parsed.desc.render.motion_to.is_some() {
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

    // One moment after the other
    let render = &input.parsed.desc.render;
    let (x, y, width, height) = (0, 0, render.width, render.height);
    let window = settings.crop.unwrap_or(Window { x, y, width, height });
    let mut run = Run {
        plan,
        input: &input,
        settings: &settings,
        beside: &beside,
        coco: coco.map(|target| (Coco::new(), target)),
        progress: None,
        warned: Vec::new(),
    };
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

    if let (Some(ready), Some((coco, _))) = (coco_file, &run.coco) {
        write_json(plan, ready, &coco.to_json())?;
    }

    // Say what it took
    let Some(Took { compile, render, write, rays }) = took else { return Ok(()) };
    let (width, height, frames) = (window.width, window.height, moments.len());
    let stats = Stats { scene: input.name, width, height, frames, parse, compile, render, write, rays };
    if let StatsPlan::Table = plan.stats {
        say(format_args!("{}", stats.to_table()));
    }
    if let Some(ready) = stats_file {
        write_json(plan, ready, &stats.to_json())?;
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
