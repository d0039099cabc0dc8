//! `cargo xtask verify exact`: integrated light against the converged picture, on random scenes.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use firstlight::{SceneDesc, TextureDesc};
use firstlight_testkit::converged::{Bounds, Converged, Deviation, PROMISED, Report, SceneError};
use firstlight_testkit::pictures::FormulaPictures;
use firstlight_testkit::{exact_scenes, kept};

use crate::{Outcome, root, slow, write};

/// The share of pixels that may stay open where sets have up to 2^20 points.
const OPEN: f64 = 1e-3;
/// The same where the tolerance is below 1: they have to agree so much better.
const OPEN_FINER: f64 = 0.02;

/// Which scenes, and how far to go.
#[derive(clap::Args)]
pub struct Options {
    /// Random scenes A to B, B left out; or some, single numbers as well: 0..40,372,779.
    #[arg(long, value_name = "A..B", value_parser = seeds, value_delimiter = ',', default_value = "0..100")]
    seeds: Vec<Range<u64>>,
    /// Width and height of the pictures.
    #[arg(long, default_value_t = 48)]
    size: u32,
    /// The converged picture takes up to 2^CAP points on each light, in each of four sets.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(8..=20))]
    cap: u32,
    /// The scenes' tolerance, in display steps: the bounds scale with it, and below 1 so does how far converged
    /// pictures have converged.
    #[arg(long, default_value_t = 1.0, conflicts_with = "write")]
    tolerance: f64,
    /// Where converged pictures are kept, and taken from while the scene is the same and they had as many points. They
    /// depend on nothing that integrates; after a change of what sampled light looks like, empty it.
    #[arg(long, value_name = "DIR", default_value = "crates/firstlight-testkit/tests/truth/converged")]
    kept: PathBuf,
    /// Takes converged pictures as they are kept, without a second look at what is off: seconds in place of minutes, to
    /// compare two versions of the engine.
    #[arg(long, conflicts_with = "converge")]
    as_kept: bool,
    /// Only makes the converged pictures that are not kept yet.
    #[arg(long)]
    converge: bool,
    /// Writes docs/verification/exact.csv, one row a scene, and the tables of the book's page. Rows of other scenes
    /// stay.
    #[arg(long)]
    write: bool,
    /// Only writes the scenes, as text, into this folder.
    #[arg(long, value_name = "DIR")]
    dump: Option<PathBuf>,
    /// Prints every scene, not only those out of bounds or near them.
    #[arg(long)]
    all: bool,
    /// Compares times in place of pictures: with those of 1,024 points on every light at every camera ray. Prints the
    /// scenes that take the longest.
    #[arg(long, conflicts_with_all = ["write", "converge", "dump", "cap", "kept", "all"])]
    slow: bool,
}

/// A..B, or a number.
pub fn seeds(text: &str) -> Result<Range<u64>, String> {
    let parsed = match text.split_once("..") {
        Some((a, b)) => a.parse().ok().zip(b.parse().ok()).map(|(a, b)| a..b),
        None => text.parse().ok().and_then(|a: u64| Some(a..a.checked_add(1)?)),
    };
    parsed.filter(|seeds| !seeds.is_empty()).ok_or_else(|| "give a range such as 0..100, or a number".into())
}

/// What is kept of one scene.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    seed: u64,
    size: u32,
    cap: u32,
    pixels: u64,
    open: u64,
    over: u64,
    worst: f64,
    rms: f64,
    doubt: f64,
    sobol_rms: f64,
    uniform_rms: f64,
    sobol_worst: f64,
    seconds: f64,
    commit: String,
    /// What is beyond the bounds of most scenes.
    outside: String,
}

const HEADER: &str = "seed,size,cap,pixels,open,over_1,worst,rms,doubt,rms_sobol_400,rms_uniform_400,worst_sobol_400,\
                      seconds,commit,outside";

impl Row {
    fn csv(&self) -> String {
        let Row { seed, size, cap, pixels, open, over, worst, rms, doubt, .. } = self;
        format!(
            "{seed},{size},{cap},{pixels},{open},{over},{worst:.3},{rms:.4},{doubt:.4},{:.4},{:.4},{:.3},{:.1},{},{}",
            self.sobol_rms,
            self.uniform_rms,
            self.sobol_worst,
            self.seconds,
            self.commit,
            self.outside.replace(',', ";")
        )
    }

    fn read(line: &str) -> Option<Row> {
        let words: Vec<&str> = line.splitn(15, ',').collect();
        let number = |i: usize| words.get(i)?.parse::<f64>().ok();
        let whole = |i: usize| words.get(i)?.parse::<u64>().ok();
        Some(Row {
            seed: whole(0)?,
            size: whole(1)? as u32,
            cap: whole(2)? as u32,
            pixels: whole(3)?,
            open: whole(4)?,
            over: whole(5)?,
            worst: number(6)?,
            rms: number(7)?,
            doubt: number(8)?,
            sobol_rms: number(9)?,
            uniform_rms: number(10)?,
            sobol_worst: number(11)?,
            seconds: number(12)?,
            commit: (*words.get(13)?).to_owned(),
            outside: words.get(14)?.replace(';', ","),
        })
    }

    /// As a row of a table.
    fn markdown(&self) -> String {
        let Row { seed, open, over, worst, rms, doubt, sobol_rms, uniform_rms, sobol_worst, seconds, .. } = self;
        format!(
            "| {seed} | {worst:.2} | {over} | {rms:.3} | {sobol_rms:.3} | {uniform_rms:.3} | {sobol_worst:.1} | \
             {doubt:.3} | {open} | {seconds:.0} | {} |",
            self.outside
        )
    }

    /// Worth a look: beyond the bounds of most scenes, or not settled.
    fn is_notable(&self) -> bool {
        !self.outside.is_empty() || 200 * self.open > self.pixels
    }

    fn error(&self) -> SceneError {
        let Row { pixels, worst, over, rms, .. } = *self;
        SceneError { seed: self.seed, deviation: Deviation { pixels, worst, over, rms, at: [0; 2] }, doubt: self.doubt }
    }
}

const TABLE: &str = "| seed | worst | over 1 | rms | rms, 400 `sobol` | rms, 400 `uniform` | worst, 400 `sobol` | \
    doubt | open | s | beyond |\n\
                     |---|---|---|---|---|---|---|---|---|---|---|";

impl Options {
    fn kept(&self, seed: u64) -> PathBuf {
        // A smaller tolerance wants another converged picture
        let finer = if self.tolerance < 1.0 { format!("-{}", self.tolerance) } else { String::new() };
        root().join(&self.kept).join(format!("{seed:04}-{}{finer}.png", self.size))
    }

    fn scene(&self, seed: u64) -> SceneDesc {
        let mut desc = exact_scenes::scene(seed, self.size);
        desc.render.tolerance = self.tolerance;
        desc
    }

    fn bounds(&self) -> Bounds {
        PROMISED.times(self.tolerance)
    }
}

/// The one that is kept, or one with more points where that had too few, or a new one; and then that is kept.
fn converged(seed: u64, desc: &SceneDesc, options: &Options) -> Converged {
    let path = options.kept(seed);
    let Some((mut truth, cap)) = kept::read(&path, desc) else {
        let truth = Converged::new(desc, options.cap);
        kept::write(&path, desc, options.cap, &truth);
        return truth;
    };
    if truth.open() > 0 && cap < options.cap {
        truth.settle(cap + 1, options.cap);
        kept::write(&path, desc, options.cap, &truth);
    }
    truth
}

fn row(seed: u64, options: &Options, commit: &str) -> Row {
    let start = Instant::now();
    let report = catch_unwind(AssertUnwindSafe(|| {
        let desc = options.scene(seed);
        let mut truth = converged(seed, &desc, options);
        if options.as_kept {
            return Report::as_kept(&truth, &desc);
        }
        let levels = truth.levels.clone();
        let report = Report::beside(&mut truth, &desc);
        if truth.levels != levels {
            kept::write(&options.kept(seed), &desc, options.cap, &truth);
        }
        report
    }));
    let mut row = Row {
        seed,
        size: options.size,
        cap: options.cap,
        pixels: 0,
        open: 0,
        over: 0,
        worst: f64::NAN,
        rms: f64::NAN,
        doubt: f64::NAN,
        sobol_rms: f64::NAN,
        uniform_rms: f64::NAN,
        sobol_worst: f64::NAN,
        seconds: 0.0,
        commit: commit.to_owned(),
        outside: "panic".to_owned(),
    };
    if let Ok(report) = report {
        let Report { exact, sobol, uniform, open, doubt } = report;
        let error = SceneError { seed, deviation: exact, doubt };
        row.outside = error.outside(&options.bounds()).unwrap_or_default();
        (row.pixels, row.open, row.over) = (exact.pixels, open as u64, exact.over);
        (row.worst, row.rms, row.doubt) = (exact.worst, exact.rms, doubt);
        (row.sobol_rms, row.uniform_rms, row.sobol_worst) = (sobol.rms, uniform.rms, sobol.worst);
    }
    row.seconds = start.elapsed().as_secs_f64();
    row
}

/// The rows by what the scenes were for, as far as there are any: those without metals and dielectrics; of the others
/// those that the engine was tuned with, and those that it was not.
fn groups(rows: &BTreeMap<u64, Row>) -> Vec<(&'static str, Vec<&Row>)> {
    let of = |wanted: fn(u64) -> bool| rows.values().filter(|row| wanted(row.seed)).collect::<Vec<_>>();
    let groups = [
        ("Phong and Blinn-Phong", of(|seed| seed < exact_scenes::SURFACES)),
        ("Metals and dielectrics, even numbers", of(|seed| seed >= exact_scenes::SURFACES && seed % 2 == 0)),
        ("Metals and dielectrics, odd numbers", of(|seed| seed >= exact_scenes::SURFACES && seed % 2 == 1)),
    ];
    groups.into_iter().filter(|(_, rows)| !rows.is_empty()).collect()
}

/// What many scenes say together.
struct Summary {
    lines: String,
    faults: Vec<String>,
}

fn summary<'a>(rows: impl Iterator<Item = &'a Row> + Clone, tolerance: f64) -> Summary {
    let bounds = PROMISED.times(tolerance);
    let most_open = if tolerance < 1.0 { OPEN_FINER } else { OPEN };
    let sum = |of: fn(&Row) -> f64| rows.clone().map(of).filter(|x| x.is_finite()).sum::<f64>();
    let greatest = |of: fn(&Row) -> f64| rows.clone().map(of).fold(0.0, f64::max);
    let scenes = rows.clone().count();
    let (pixels, open, over) = (sum(|r| r.pixels as f64), sum(|r| r.open as f64), sum(|r| r.over as f64));
    // Root mean squares over all scenes together
    let together = |of: fn(&Row) -> f64| {
        let squares: f64 =
            rows.clone().map(|r| r.pixels as f64 * of(r) * of(r)).filter(|squares| squares.is_finite()).sum();
        (squares / pixels.max(1.0)).sqrt()
    };
    let errors: Vec<SceneError> = rows.clone().map(Row::error).collect();
    let (over_share, open_share) = (over / pixels.max(1.0), open / (pixels + open).max(1.0));
    // What so large a part of the scenes is within
    let within = |share: f64, of: fn(&Row) -> f64| {
        let mut all: Vec<f64> = rows.clone().map(of).collect();
        all.sort_by(f64::total_cmp);
        all.get((share * all.len() as f64) as usize).or(all.last()).copied().unwrap_or(0.0)
    };
    let mut commits: Vec<&str> = rows.clone().map(|r| r.commit.as_str()).collect();
    commits.sort_unstable();
    commits.dedup();
    let mut lines = String::new();
    let _ = writeln!(lines, "| {scenes} scenes, {pixels} pixels | measured | allowed |\n|---|---|---|");
    let [many, nearly_all] = bounds.rms;
    let _ = writeln!(lines, "| root mean square over all | {:.4} | |", together(|r| r.rms));
    let _ = writeln!(lines, "| of a scene: 95 % are within | {:.3} | {many} |", within(0.95, |r| r.rms));
    let _ = writeln!(lines, "| 99 % are within | {:.3} | {nearly_all} |", within(0.99, |r| r.rms));
    let _ = writeln!(
        lines,
        "| worst pixel of a scene: 99 % are within | {:.2} | {} |",
        within(0.99, |r| r.worst),
        bounds.worst
    );
    let _ = writeln!(lines, "| worst pixel of all | {:.2} | |", greatest(|r| r.worst));
    let _ = writeln!(
        lines,
        "| pixels off by more than {tolerance} | {over} ({:.4} %) | {} % |",
        100.0 * over_share,
        100.0 * bounds.over
    );
    let _ = writeln!(lines, "| pixels left open | {open} ({:.4} %) | {} % |", 100.0 * open_share, 100.0 * most_open);
    let _ = writeln!(lines, "| root mean square over all, 400 `sobol` points | {:.4} | |", together(|r| r.sobol_rms));
    let _ = writeln!(lines, "| the same, 400 `uniform` points | {:.4} | |", together(|r| r.uniform_rms));
    let _ = writeln!(lines, "| doubt of the converged pictures | {:.4} | |", together(|r| r.doubt));
    let _ = writeln!(lines, "\nCommit {}; {:.0} s of one core.", commits.join(", "), sum(|r| r.seconds));
    let mut faults = bounds.faults(&errors);
    if open_share > most_open {
        faults.push(format!("{open} of {} pixels are open", pixels + open));
    }
    Summary { lines, faults }
}

fn commit() -> String {
    let ask = |args: &[&str]| {
        let output = std::process::Command::new("git").current_dir(root()).args(args).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let name = ask(&["rev-parse", "--short=8", "HEAD"]).unwrap_or_else(|| "unknown".into());
    // What is not committed yet belongs to no commit
    let clean =
        ask(&["status", "--porcelain", "--", "crates", "tools", "xtask", "Cargo.lock"]).is_some_and(|s| s.is_empty());
    if clean { name } else { format!("{name}+") }
}

fn csv_path() -> PathBuf {
    root().join("docs/verification/exact.csv")
}

fn stored() -> BTreeMap<u64, Row> {
    let text = std::fs::read_to_string(csv_path()).unwrap_or_default();
    text.lines().filter_map(Row::read).map(|row| (row.seed, row)).collect()
}

/// Writes the rows, and the page's part between its two marks.
fn store(rows: &BTreeMap<u64, Row>) -> Outcome {
    let mut csv = format!("{HEADER}\n");
    for row in rows.values() {
        let _ = writeln!(csv, "{}", row.csv());
    }
    write(&csv_path(), csv.as_bytes())?;
    let path = root().join("docs/src/exact-verification.md");
    let page = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let (start, end) = ("<!-- measured -->\n", "<!-- end of what is measured -->");
    let (Some(from), Some(to)) = (page.find(start), page.find(end)) else {
        return Err(format!("{}: the marks {start:?} and {end:?} are not there", path.display()));
    };
    let (head, tail) = (&page[..from + start.len()], &page[to..]);
    let mut notable: Vec<&Row> = rows.values().filter(|row| row.is_notable()).collect();
    notable.sort_by(|a, b| b.worst.total_cmp(&a.worst));
    let mut measured = String::from("\n");
    for (name, rows) in groups(rows) {
        let _ = writeln!(measured, "{name}:\n\n{}", summary(rows.into_iter(), 1.0).lines);
    }
    if !notable.is_empty() {
        let _ = writeln!(
            measured,
            "The scenes beyond the bounds of most, or with open pixels, the furthest first:\n\n{TABLE}"
        );
        for row in notable.iter().take(40) {
            let _ = writeln!(measured, "{}", row.markdown());
        }
        measured.push('\n');
    }
    write(&path, format!("{head}{measured}{tail}").as_bytes())
}

pub fn run(options: &Options) -> Outcome {
    if let Some(folder) = &options.dump {
        std::fs::create_dir_all(folder).map_err(|fault| format!("{}: {fault}", folder.display()))?;
        for seed in options.seeds.iter().cloned().flatten() {
            let desc = options.scene(seed);
            let pictures = desc.textures.iter().filter_map(|(_, texture)| match texture {
                TextureDesc::Image(image) => Some((image.file.0.clone(), FormulaPictures::file(&image.file.0)?)),
                _ => None,
            });
            for (name, bytes) in pictures.chain([(format!("{seed}.toml"), desc.to_toml().into_bytes())]) {
                let file = folder.join(name);
                std::fs::write(&file, bytes).map_err(|fault| format!("{}: {fault}", file.display()))?;
            }
        }
        return Ok(());
    }
    if options.slow {
        return slow::run(options.seeds.iter().cloned().flatten().map(|seed| (seed, options.scene(seed))));
    }
    let folder = root().join(&options.kept);
    std::fs::create_dir_all(&folder).map_err(|fault| format!("{}: {fault}", folder.display()))?;
    let commit = commit();
    let rows = Mutex::new(BTreeMap::new());
    if !options.converge {
        println!("{TABLE}");
    }
    let start = Instant::now();
    // In parts, so that what is done is stored even if the rest is not waited for
    let seeds: Vec<u64> = options.seeds.iter().cloned().flatten().collect();
    for part in seeds.chunks(50) {
        // Threads of our own: one of rayon's that waits for a render would begin another scene
        let next = AtomicUsize::new(0);
        let work = || {
            while let Some(seed) = part.get(next.fetch_add(1, Ordering::Relaxed)) {
                if options.converge {
                    let desc = options.scene(*seed);
                    let start = Instant::now();
                    let truth = converged(*seed, &desc, options);
                    let seconds = start.elapsed().as_secs_f64();
                    println!("scene {seed}: {} of {} pixels open, {seconds:.1} s", truth.open(), truth.pixels.len());
                    continue;
                }
                let row = row(*seed, options, &commit);
                if options.all || row.is_notable() {
                    println!("{}", row.markdown());
                }
                rows.lock().expect("no thread panics while it holds the rows").insert(*seed, row);
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
                scope.spawn(work);
            }
        });
        if options.converge {
            continue;
        }
        let rows = rows.lock().expect("no thread panics while it holds the rows");
        eprintln!("{} of {} scenes, {:.0} s", rows.len(), seeds.len(), start.elapsed().as_secs_f64());
        if options.write {
            let mut all = stored();
            all.extend(rows.iter().map(|(seed, row)| (*seed, row.clone())));
            store(&all)?;
        }
    }
    if options.converge {
        return Ok(());
    }
    let rows = rows.into_inner().expect("no thread panics while it holds the rows");
    let mut faults = Vec::new();
    for (name, rows) in groups(&rows) {
        let summary = summary(rows.into_iter(), options.tolerance);
        println!("\n{name}:\n\n{}", summary.lines);
        faults.extend(summary.faults);
    }
    if faults.is_empty() {
        return Ok(());
    }
    Err(format!("integrated light is out of its bounds:\n{}", faults.join("\n")))
}
