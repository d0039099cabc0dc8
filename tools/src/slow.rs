//! `cargo xtask verify exact --slow`: how long integrated light takes beside what it replaces, 1,024 points on every
//! light at every camera ray. With one thread; nothing else may run.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use firstlight::{AaMode, Image, RenderSettings, SampleSet, SamplesDesc, Scene, SceneDesc};
use firstlight_testkit::converged::{Deviation, integrated, with_samples};
use firstlight_testkit::scenes::{compile, picture};

use crate::Outcome;
use crate::bench::median;

/// Points on each light.
const POINTS: u32 = 1024;
/// What any scene may take, in seconds; and how many times as long as its samples, or as that.
const ALWAYS: f64 = 0.03;
const TIMES: f64 = 1.3;
/// In display steps: where the samples are this far off, they are no measure.
const OFF: f64 = 2.0;
/// Scenes that are printed.
const PRINTED: usize = 40;

/// What one scene takes, in seconds.
struct Times {
    seed: u64,
    integrated: f64,
    /// Of the samples, where the other is more than is always allowed; and how far they are from what is integrated, in
    /// display steps.
    sampled: Option<(f64, f64)>,
}

impl Times {
    fn ratio(&self) -> f64 {
        self.integrated / self.sampled.map_or(ALWAYS, |(seconds, _)| seconds.max(ALWAYS))
    }

    fn is_slow(&self) -> bool {
        self.ratio() > TIMES && self.sampled.is_some_and(|(_, off)| off <= OFF)
    }
}

/// The median of three runs, and the picture.
fn timed(scene: &Scene, settings: &RenderSettings) -> (f64, Image) {
    let mut seconds = [0.0; 3];
    let mut image = None;
    for seconds in &mut seconds {
        let start = Instant::now();
        image = Some(picture(scene, settings));
        *seconds = start.elapsed().as_secs_f64();
    }
    (median(&seconds), image.expect("there were three"))
}

fn times(seed: u64, desc: &SceneDesc) -> Times {
    let scene = compile(&with_samples(desc, SamplesDesc::Exact, SampleSet::Sobol, 0));
    let (seconds, image) = timed(&scene, &integrated());
    let mut times = Times { seed, integrated: seconds, sampled: None };
    if times.ratio() > TIMES {
        let scene = compile(&with_samples(desc, POINTS, SampleSet::Sobol, 1));
        let (sampled, other) = timed(&scene, &RenderSettings { aa_mode: AaMode::Full, ..integrated() });
        times.sampled = Some((sampled, Deviation::between(&scene, OFF, &other, &image).worst));
    }
    times
}

/// Prints the scenes that take the longest.
pub fn run(scenes: impl Iterator<Item = (u64, SceneDesc)>) -> Outcome {
    let mut all = Vec::new();
    for (seed, desc) in scenes {
        let times =
            catch_unwind(AssertUnwindSafe(|| times(seed, &desc))).map_err(|_| format!("scene {seed} panics"))?;
        if times.is_slow() {
            eprintln!("scene {seed}: {:.1} times", times.ratio());
        }
        all.push(times);
    }
    all.sort_by(|a, b| b.ratio().total_cmp(&a.ratio()));
    println!("| seed | integrated, ms | {POINTS} points, ms | times | points off |\n|---|---|---|---|---|");
    for times in all.iter().take(PRINTED) {
        let [sampled, off] = match times.sampled {
            Some((seconds, off)) => [format!("{:.0}", 1e3 * seconds), format!("{off:.1}")],
            None => ["", ""].map(String::from),
        };
        let (integrated, ratio) = (1e3 * times.integrated, times.ratio());
        println!("| {} | {integrated:.0} | {sampled} | {ratio:.2} | {off} |", times.seed);
    }
    let (slow, ms) = (all.iter().filter(|times| times.is_slow()).count(), 1e3 * ALWAYS);
    println!(
        "\n{slow} of {} scenes take more than {TIMES} times as long as {ms} ms and as their points, where those are \
         within {OFF} steps.",
        all.len()
    );
    if slow > 0 { Err(format!("{slow} scenes are slower than {POINTS} points")) } else { Ok(()) }
}
