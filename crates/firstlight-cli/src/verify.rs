//! `firstlight verify`: whether a picture has the bits that its receipt leads to.

use std::ffi::OsStr;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use firstlight::{
    Compiled, FileSettings, Film, Format, ImageError, Plane, PlaneDifference, ReceiptFault, ReceiptSettings,
    RenderSettings, Scene, StoredPlane, StoredPlanes, builtin_scenes, display_steps,
};
use serde_json::{Value, json};

use crate::args::{ModelArgs, ReadingArgs, VerifyArgs};
use crate::difference::{self, Found};
use crate::input::{self, Input, MODEL_ENDINGS};
use crate::interrupt::Watch;
use crate::progress::Progress;
use crate::report::{Failure, answer, show_diagnostics, shown};

/// Renders again what a picture's receipt speaks of, and compares.
///
/// # Errors
/// The bits are others, or, of another version, farther apart than the tolerance; there is no receipt, or no scene that
/// it speaks of.
pub fn run(args: &VerifyArgs) -> Result<(), Failure> {
    let name = shown(&args.file);
    let work = |why: String| Failure::Work(format!("{name}: {why}"));
    let stored = difference::read(&args.file)?;
    let said = ReceiptSettings::read(&stored.receipt).map_err(|fault| {
        let version = stored.receipt.get("version").filter(|_| matches!(fault, ReceiptFault::Lacks(_)));
        let of = version.map(|version| format!("; the picture was made by version {version}")).unwrap_or_default();
        work(format!("{fault}{of}"))
    })?;
    let (input, compiled) = find_scene(&name, &said, args)?;
    if !args.quiet {
        show_diagnostics(&compiled.warnings);
    }
    let again = render_again(&compiled.scene, &said, &stored, args.quiet)?;
    let size = |file: &StoredPlanes| [file.window.width, file.window.height];
    if size(&stored) != size(&again) {
        let ([w, h], [v, g]) = (size(&stored), size(&again));
        return Err(work(format!(
            "is {w} x {h} pixels, and its receipt speaks of {v} x {g}: another program changed it"
        )));
    }
    let report = Report::new(&name, &input.name, &said, &stored, &again, &compiled.scene)?;
    if args.json {
        answer(&format!("{:#}\n", report.json()))?;
    } else if !args.quiet {
        answer(&report.text())?;
    }
    if report.verdict.is_good() { Ok(()) } else { Err(Failure::Differs) }
}

/// The scene that a receipt speaks of, with what it says in the place of it, compiled.
fn find_scene(name: &str, said: &ReceiptSettings, args: &VerifyArgs) -> Result<(Input, Compiled), Failure> {
    let version = if said.is_of_this_version() { String::new() } else { format!(", by version {}", said.version) };
    if let Some(path) = args.scene.as_deref().filter(|path| !path.is_dir()) {
        let (input, compiled) = open(path, said, args)?;
        let (hash, wanted) = (compiled.scene.hash(), &said.scene_hash);
        if hash != wanted {
            let scene = &input.name;
            return Err(Failure::Work(format!(
                "{name} was not made of {scene} as it is now: with the settings of the receipt its hash is {hash}, and \
                 the picture was made of a scene of the hash {wanted}{version}; the scene, one of its files or its \
                 camera has changed, or it is another"
            )));
        }
        return Ok((input, compiled));
    }
    let (candidates, place) = match &args.scene {
        Some(folder) => (scenes_in(folder)?, format!("no scene in {}", shown(folder))),
        None => {
            let builtin = builtin_scenes().iter().map(|scene| PathBuf::from(scene.name)).collect();
            (builtin, "no built-in scene".into())
        }
    };
    let is_meant = |(_, compiled): &(Input, Compiled)| *compiled.scene.hash() == said.scene_hash;
    let found = candidates.iter().filter_map(|path| open(path, said, args).ok()).find(is_meant);
    found.ok_or_else(|| {
        let hint = if args.scene.is_none() { "; name its scene with --scene FILE" } else { "" };
        let wanted = &said.scene_hash;
        let message = format!("{name} was made of a scene of the hash {wanted}{version}, and {place} has it{hint}");
        Failure::Work(message)
    })
}

/// The files of a folder that may be scenes or models, by their names.
fn scenes_in(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let read = || -> std::io::Result<Vec<PathBuf>> { fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect() };
    let mut files = read().map_err(|e| Failure::Work(format!("--scene {}: {e}", shown(folder))))?;
    let is_scene = |path: &PathBuf| {
        let ending = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
        let is_one = |ending: &str| ["toml", "json", "txt"].contains(&ending) || MODEL_ENDINGS.contains(&ending);
        ending.as_deref().is_some_and(is_one) && path.is_file()
    };
    files.retain(is_scene);
    files.sort();
    Ok(files)
}

/// Reads and compiles a scene, with what the receipt says in the place of it.
fn open(path: &Path, said: &ReceiptSettings, args: &VerifyArgs) -> Result<(Input, Compiled), Failure> {
    let allow_dir = args.allow_dir.clone();
    let reading = ReadingArgs { strict: false, allow_dir, texture_memory: None, model: ModelArgs::default() };
    let mut input = input::read(path, &reading)?;
    match (&said.model, &input.studio) {
        (Some(_), None) => {
            let name = shown(path);
            return Err(Failure::Work(format!("{name}: is a scene, and the picture was made of a model")));
        }
        (Some(studio), Some(_)) => input.stage(studio.clone()),
        (None, _) => {}
    }
    said.apply(&mut input.parsed.desc);
    input.framing = said.framing.unwrap_or(input.framing);
    if input.parsed.desc.render.motion_to.is_some() {
        input.remember_files();
    }
    let compiled = input.compile(said.time, true)?;
    Ok((input, compiled))
}

/// The same file, rendered by this version.
fn render_again(
    scene: &Scene,
    said: &ReceiptSettings,
    file: &StoredPlanes,
    quiet: bool,
) -> Result<StoredPlanes, Failure> {
    let settings = said.settings(scene);
    settings.check(scene).map_err(Failure::Work)?;
    settings.check_memory(scene).map_err(Failure::Work)?;
    let watch = Watch::begin();
    let (width, height) = settings.crop.map_or((scene.width(), scene.height()), |crop| (crop.width, crop.height));
    let progress = Progress::begin(u64::from(width) * u64::from(height), 1, quiet, String::new());
    let rendered = firstlight::render(scene, &settings, &|done, _| {
        progress.update(done);
        watch.flow()
    });
    let ControlFlow::Continue((film, _)) = rendered else { return Err(Failure::Interrupted) };
    progress.finish(&format!("{width} x {height} pixels"));
    let files = FileSettings { display: said.display.unwrap_or_default(), ..FileSettings::of(&file.receipt) };
    let encoded = encode(&film, scene, &settings, file.format, &files);
    let again = encoded.and_then(|bytes| StoredPlanes::read(&bytes));
    again.map_err(|e| Failure::Work(e.to_string()))
}

/// The bytes of such a file.
fn encode(
    film: &Film,
    scene: &Scene,
    settings: &RenderSettings,
    format: Format,
    files: &FileSettings,
) -> Result<Vec<u8>, ImageError> {
    let receipt = scene.buffers_receipt(settings, scene.buffers());
    match film.heat().filter(|_| !matches!(format, Format::Exr | Format::Npz)) {
        Some(heat) => heat.picture().encode(format, &files.display, &receipt),
        None => film.encode(scene.buffers(), format, files, &receipt),
    }
}

/// What was found.
struct Report<'a> {
    file: &'a str,
    scene: &'a str,
    said: &'a ReceiptSettings,
    verdict: Verdict,
    buffers: Vec<Found>,
    /// Of colours of another version, how far they are apart.
    steps: Vec<Steps>,
    /// Buffers that one of the two files lacks, and entries of the receipt that differ.
    remarks: Vec<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Same,
    Differs,
    /// Of another version.
    WithinTolerance,
    BeyondTolerance,
}

/// How far a colour is from that of another version.
struct Steps {
    name: String,
    pixels: u64,
    /// Pixels that are farther apart than the tolerance.
    beyond: u64,
    /// In display steps.
    worst: f32,
    tolerance: f32,
}

impl Verdict {
    fn is_good(self) -> bool {
        matches!(self, Verdict::Same | Verdict::WithinTolerance)
    }

    fn name(self) -> &'static str {
        match self {
            Verdict::Same => "same",
            Verdict::Differs => "differs",
            Verdict::WithinTolerance => "within-tolerance",
            Verdict::BeyondTolerance => "beyond-tolerance",
        }
    }
}

impl Steps {
    /// As much as is promised: 99.9 % of pixels within the tolerance, all within twice as much.
    fn is_within(&self) -> bool {
        self.beyond * 1000 <= self.pixels && self.worst <= 2.0 * self.tolerance
    }
}

impl<'a> Report<'a> {
    fn new(
        file: &'a str,
        scene: &'a str,
        said: &'a ReceiptSettings,
        stored: &StoredPlanes,
        again: &StoredPlanes,
        compiled: &Scene,
    ) -> Result<Self, Failure> {
        let (mut buffers, mut steps, mut remarks) = (Vec::new(), Vec::new(), Vec::new());
        let mut is_bad = false;
        for new in &again.planes {
            let Some(old) = stored.plane(&new.name) else {
                remarks.push(format!("the buffer {} is missing from the file", new.name));
                is_bad = true;
                continue;
            };
            let difference = PlaneDifference::compare(old, new, again.window.width)
                .map_err(|why| Failure::Work(format!("{file}: {why}")))?;
            if stored.is_as_written(old) == Some(false) {
                remarks.push(format!("{}: the file does not hold the bits that its receipt speaks of", new.name));
                is_bad = true;
            }
            let found = Found { difference, flip: None };
            if !found.is_same() {
                match Steps::new(old, new, said, compiled) {
                    Some(apart) => steps.push(apart),
                    // Another version may take other ways
                    None => is_bad |= new.name != Plane::Rays.name(),
                }
            }
            buffers.push(found);
        }
        for old in stored.planes.iter().filter(|old| again.plane(&old.name).is_none()) {
            remarks.push(format!("the receipt says nothing of the buffer {}", old.name));
            is_bad = true;
        }
        let is_same = buffers.iter().all(Found::is_same) && !is_bad;
        let verdict = if said.is_of_this_version() {
            // Receipts differ in the hashes of what differs
            let remarks_of_receipt = compare_receipts(stored, again, is_same);
            let is_same = is_same && remarks_of_receipt.is_empty();
            remarks.extend(remarks_of_receipt);
            if is_same { Verdict::Same } else { Verdict::Differs }
        } else if !is_bad && steps.iter().all(Steps::is_within) {
            Verdict::WithinTolerance
        } else {
            Verdict::BeyondTolerance
        };
        Ok(Report { file, scene, said, verdict, buffers, steps, remarks })
    }

    fn text(&self) -> String {
        let Report { file, scene, said, .. } = self;
        let this = ReceiptSettings::this_version();
        let tolerance = said.tolerance.unwrap_or(1.0);
        let mut text = match self.verdict {
            Verdict::Same => format!("{file}: the same bits as {scene} gives, version {this}\n"),
            Verdict::Differs => format!("{file}: other bits than {scene} gives with the same version, {this}\n"),
            verdict => {
                let verdict = if verdict.is_good() { "within" } else { "beyond" };
                format!(
                    "{file}: written by version {}, and this is {this}; {verdict} the tolerance of {tolerance} display \
                     steps of what {scene} gives\n",
                    said.version
                )
            }
        };
        if self.verdict != Verdict::Same {
            text.extend(self.buffers.iter().map(|found| found.line() + "\n"));
        }
        if !said.is_of_this_version() {
            for Steps { name, pixels, beyond, worst, tolerance } in &self.steps {
                text += &format!(
                    "{name}: {beyond} of {pixels} pixels are farther apart than {tolerance} display steps; the \
                     farthest {worst:.3}\n"
                );
            }
        }
        text.extend(self.remarks.iter().map(|remark| format!("{remark}\n")));
        text
    }

    fn json(&self) -> Value {
        let steps = |steps: &Steps| {
            let Steps { name, pixels, beyond, worst, tolerance } = steps;
            json!({ "name": name, "pixels": pixels, "beyond": beyond, "worst": worst, "tolerance": tolerance })
        };
        json!({
            "file": self.file,
            "scene": self.scene,
            "scene_hash": self.said.scene_hash,
            "version": self.said.version,
            "this_version": ReceiptSettings::this_version(),
            "verdict": self.verdict.name(),
            "buffers": self.buffers.iter().map(Found::json).collect::<Vec<_>>(),
            "display_steps": self.steps.iter().map(steps).collect::<Vec<_>>(),
            "remarks": self.remarks,
        })
    }
}

/// The entries that differ; without those of the bits of buffers where it is known that these differ.
fn compare_receipts(stored: &StoredPlanes, again: &StoredPlanes, same_bits: bool) -> Vec<String> {
    let counts = |key: &str| same_bits || !key.starts_with("buffer.");
    let differs = |key: &str| stored.receipt.get(key) != again.receipt.get(key);
    let keys = again.receipt.entries.iter().map(|(key, _)| key);
    let more = stored.receipt.entries.iter().map(|(key, _)| key).filter(|key| again.receipt.get(key).is_none());
    let keys = keys.chain(more).filter(|key| counts(key) && differs(key));
    let value = |file: &StoredPlanes, key: &str| match file.receipt.get(key) {
        Some(value) => format!("{value:?}"),
        None => "nothing".into(),
    };
    keys.map(|key| format!("receipt {key}: says {}, and it is {}", value(stored, key), value(again, key))).collect()
}

impl Steps {
    /// Of colours of the film; `None` for all else, which has no tolerance.
    fn new(old: &StoredPlane, new: &StoredPlane, said: &ReceiptSettings, scene: &Scene) -> Option<Self> {
        if !old.is_color() || old.name == Plane::Albedo.name() {
            return None;
        }
        let display = if old.steps.is_some() { said.display.unwrap_or_default() } else { scene.display() };
        let apart = display_steps(&old.displayed(&display)?, &new.displayed(&display)?, display.encoding);
        let tolerance = said.tolerance.unwrap_or(1.0) as f32;
        // What is rounded to whole steps may be one apart where it is less; what comes of decoding is not counted
        let rounded = if old.steps == Some(255) { tolerance.ceil() } else { tolerance };
        let beyond = apart.iter().filter(|steps| **steps > rounded * 1.001).count() as u64;
        let worst = apart.iter().copied().fold(0.0, f32::max);
        Some(Steps { name: new.name.clone(), pixels: apart.len() as u64, beyond, worst, tolerance })
    }
}
