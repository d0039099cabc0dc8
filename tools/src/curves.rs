//! How the time of a picture grows with triangles and with light samples: measured, and drawn for the book.

use std::fmt::Write as _;

use firstlight::{AaMode, RenderSettings, SamplesDesc, Scene, VisibilityMode};
use serde_json::json;

use crate::bench::{config11, median, picture};
use crate::engine::{AA, LIGHTS, settings, terrain};
use crate::plot::{Line, Plot};
use crate::{root, write};

/// Each point is the median of so many pictures, or one picture that took longer than so many seconds.
const RUNS: usize = 3;
const LONG: f64 = 5.0;
/// Squares along each side of the terrain: 1 thousand to 1 million triangles.
const ACROSS: [u32; 6] = [23, 45, 90, 180, 358, 707];
/// Points on the light.
const SAMPLES: [u32; 5] = [16, 64, 256, 1024, 4096];
/// The terrain whose samples grow: 65 thousand triangles.
const SOME: u32 = 180;

/// What was measured.
pub(crate) struct Curves {
    /// Width and height of the pictures.
    size: u32,
    triangles: Vec<Line>,
    samples: Vec<Line>,
}

/// Measures both curves on pictures of `size` x `size` pixels, and draws them.
pub(crate) fn measure(size: u32) -> Result<Curves, String> {
    let adaptive = settings(VisibilityMode::Shafts, AaMode::Adaptive);
    let full = settings(VisibilityMode::Shafts, AaMode::Full);
    let mut triangles = [line("integrated"), line("64 points, once a pixel"), line("64 points, every ray")];
    for n in ACROSS {
        let count = f64::from(2 * n * n);
        for (line, (samples, settings)) in
            triangles.iter_mut().zip([(SamplesDesc::Exact, &adaptive), (64.into(), &adaptive), (64.into(), &full)])
        {
            let seconds = time(&terrain(n, size, &LIGHTS[..1], samples)?, settings)?;
            eprintln!("{count} triangles, {}: {seconds:.3} s", line.name);
            line.points.push([count, seconds]);
        }
    }
    let mesh = |samples| terrain(SOME, size, &LIGHTS[..1], samples);
    let config11 = |samples| config11(size, AA, samples);
    let mut samples = Vec::new();
    for (sampled, integrated, scene) in [
        ("config 11", "config 11, integrated", &config11 as &dyn Fn(SamplesDesc) -> Result<Scene, String>),
        ("terrain", "terrain, integrated", &mesh),
    ] {
        let mut points = line(sampled);
        for count in SAMPLES {
            let seconds = time(&scene(count.into())?, &full)?;
            eprintln!("{count} samples, {sampled}: {seconds:.3} s");
            points.points.push([f64::from(count), seconds]);
        }
        samples.push(points);
        // As high everywhere: it has no samples
        let seconds = time(&scene(SamplesDesc::Exact)?, &adaptive)?;
        let ends = [SAMPLES[0], SAMPLES[SAMPLES.len() - 1]].map(|count| [f64::from(count), seconds]);
        samples.push(Line { dashed: true, points: ends.to_vec(), ..line(integrated) });
    }
    let curves = Curves { size, triangles: triangles.into(), samples };
    draw("curve-triangles.svg", &format!("triangles ({size} x {size} pixels)"), &curves.triangles)?;
    draw("curve-samples.svg", &format!("points on the light ({size} x {size} pixels)"), &curves.samples)?;
    Ok(curves)
}

fn line(name: &'static str) -> Line {
    Line { name, dashed: false, points: Vec::new() }
}

fn time(scene: &Scene, settings: &RenderSettings) -> Result<f64, String> {
    let mut runs = vec![picture(scene, settings)?.2];
    while runs.len() < RUNS && runs[0] <= LONG {
        runs.push(picture(scene, settings)?.2);
    }
    Ok(median(&runs))
}

fn draw(file: &str, across: &str, lines: &[Line]) -> crate::Outcome {
    let plot = Plot { across, up: "seconds", lines };
    write(&root().join("docs/src/pictures").join(file), plot.svg().as_bytes())
}

impl Curves {
    pub fn json(&self) -> serde_json::Value {
        let lines = |lines: &[Line]| -> Vec<_> {
            lines.iter().map(|line| json!({ "line": line.name, "points": line.points })).collect()
        };
        json!({ "size": self.size, "triangles": lines(&self.triangles), "samples": lines(&self.samples) })
    }

    /// Both curves as a part of a page.
    pub fn table(&self) -> String {
        let mut page = format!(
            "\n### How time grows\n\n{size} x {size} pixels; each number is the median of {RUNS} pictures, in \
             seconds, or one picture where that took more than {LONG:.0}. The terrain under \
             one rectangle light, and for the samples the terrain of {} triangles, and config 11; sampled with shafts; \
             what is integrated, or says so, is lit once a pixel where that is enough, all else at every camera ray.\n",
            2 * SOME * SOME,
            size = self.size,
        );
        for (first, lines) in [("triangles", &self.triangles), ("points on the light", &self.samples)] {
            let names: Vec<_> = lines.iter().map(|line| line.name).collect();
            let _ = writeln!(page, "\n| {first} | {} |\n|---{}|", names.join(" | "), "|---".repeat(lines.len()));
            for (k, [x, _]) in lines[0].points.iter().enumerate() {
                let cells = lines.iter().map(|line| line.points[k.min(line.points.len() - 1)][1]);
                let cells: Vec<_> = cells.map(|seconds| format!("{seconds:.3}")).collect();
                let _ = writeln!(page, "| {x} | {} |", cells.join(" | "));
            }
        }
        page
    }
}
