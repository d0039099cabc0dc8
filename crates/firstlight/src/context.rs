//! The one door to files, and what compiling a description carries along.

use std::collections::{BTreeSet, HashMap};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use crate::color::Rgb;
use crate::describe::ColorDesc;
use crate::describe::node::quoted;
use crate::error::{Diagnostic, Severity};
use crate::math::{DAffine3, DVec3, Vec3, vec3};

/// Where a scene's files come from: a folder, memory, a browser.
pub trait Assets: Sync {
    /// The bytes of `path` (with `/` between folders, relative to the scene's folder), at most `limit` of them.
    ///
    /// # Errors
    /// What went wrong and what to do, in words, without the path.
    fn read(&self, path: &str, limit: u64) -> Result<Vec<u8>, AssetError>;
}

/// Why a file could not be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AssetError {
    /// There is no such file.
    #[error("no such file")]
    NotFound,
    /// The file is not in the scene's folder.
    #[error("lies outside the scene's folder")]
    Outside,
    /// The file is too large.
    #[error("is {size} bytes, the limit is {limit}")]
    TooLarge {
        /// Its size in bytes.
        size: u64,
        /// The limit in bytes.
        limit: u64,
    },
    /// The system's own words.
    #[error("{0}")]
    Io(String),
}

impl AssetError {
    /// What to do where `path`, of which there is no such file, has folders as Windows writes them.
    pub(crate) fn slashes(&self, path: &str) -> Option<String> {
        (*self == AssetError::NotFound && path.contains('\\'))
            .then(|| format!("`/` parts folders and files: write \"{}\"", path.replace('\\', "/")))
    }
}

/// No files at all: for scenes that name none.
pub struct NoAssets;

impl Assets for NoAssets {
    fn read(&self, _path: &str, _limit: u64) -> Result<Vec<u8>, AssetError> {
        Err(AssetError::NotFound)
    }
}

/// Files in memory, by path.
#[derive(Default)]
pub struct MemoryAssets {
    /// Path and bytes.
    pub files: std::collections::BTreeMap<String, Vec<u8>>,
}

impl Assets for MemoryAssets {
    fn read(&self, path: &str, limit: u64) -> Result<Vec<u8>, AssetError> {
        let bytes = self.files.get(path).ok_or(AssetError::NotFound)?;
        let size = bytes.len() as u64;
        if size > limit { Err(AssetError::TooLarge { size, limit }) } else { Ok(bytes.clone()) }
    }
}

/// The files of one folder and those below it, and of further folders that were allowed. Links are followed; where they
/// lead must be inside as well.
///
/// It knows which files were asked for ([`FolderAssets::files`]), so that a program can see that it writes over none of
/// them.
pub struct FolderAssets {
    root: PathBuf,
    allowed: Vec<PathBuf>,
    files: Mutex<BTreeSet<PathBuf>>,
    /// The names in each folder that was searched, by their lower-case form.
    listed: Mutex<HashMap<PathBuf, HashMap<String, OsString>>>,
}

impl FolderAssets {
    /// The folder `root`, and every folder of `allow`.
    ///
    /// # Errors
    /// The system's error for a folder that cannot be resolved, with its path.
    pub fn new(root: &Path, allow: &[PathBuf]) -> Result<Self, (PathBuf, std::io::Error)> {
        let canonical = |p: &Path| {
            let p = if p.as_os_str().is_empty() { Path::new(".") } else { p };
            p.canonicalize().map_err(|e| (p.to_path_buf(), e))
        };
        let root = canonical(root)?;
        let mut allowed = vec![root.clone()];
        for dir in allow {
            allowed.push(canonical(dir)?);
        }
        Ok(Self { root, allowed, files: Mutex::default(), listed: Mutex::default() })
    }

    /// The files that were asked for and are there, by their names from the root of the system, links resolved; whether
    /// or not they could be read to their end.
    pub fn files(&self) -> Vec<PathBuf> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }

    /// The file whose path is this one but for upper and lower case, as systems without case would find it; of several
    /// the first by its bytes.
    fn but_for_case(&self, path: &Path) -> Option<PathBuf> {
        let mut listed = self.listed.lock().unwrap_or_else(PoisonError::into_inner);
        let mut found = self.root.clone();
        for part in path.components() {
            let exact = found.join(part);
            if exact.exists() {
                found = exact;
                continue;
            }
            let names = listed.entry(found.clone()).or_insert_with(|| names_in(&found));
            found.push(names.get(&part.as_os_str().to_str()?.to_lowercase())?);
        }
        Some(found)
    }

    /// As [`Assets::read`], for a name that no text can hold: one that is not UTF-8.
    ///
    /// # Errors
    /// Those of [`Assets::read`].
    pub fn read_path(&self, path: &Path, limit: u64) -> Result<Vec<u8>, AssetError> {
        use std::io::Read;
        let io = |e: std::io::Error| match e.kind() {
            std::io::ErrorKind::NotFound => AssetError::NotFound,
            _ => AssetError::Io(e.to_string()),
        };
        // An absolute `path` replaces the root in `join`; it is held to the same folders
        let found = match self.root.join(path).canonicalize() {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound && !leaves(path) => {
                self.but_for_case(path).map_or(Err(e), |path| path.canonicalize())
            }
            other => other,
        };
        let real = match found {
            Ok(real) => real,
            // Say nothing about files elsewhere, not even whether they exist
            Err(e) => {
                return Err(if leaves(path) { AssetError::Outside } else { io(e) });
            }
        };
        if !self.allowed.iter().any(|dir| real.starts_with(dir)) {
            return Err(AssetError::Outside);
        }
        let meta = std::fs::metadata(&real).map_err(io)?;
        if !meta.is_file() {
            return Err(AssetError::Io("is not a plain file".into()));
        }
        self.files.lock().unwrap_or_else(PoisonError::into_inner).insert(real.clone());
        if meta.len() > limit {
            return Err(AssetError::TooLarge { size: meta.len(), limit });
        }
        // The file may grow while it is read: the limit holds all the same
        let mut bytes = Vec::with_capacity(meta.len() as usize);
        std::fs::File::open(&real).map_err(io)?.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(io)?;
        let size = bytes.len() as u64;
        if size > limit { Err(AssetError::TooLarge { size, limit }) } else { Ok(bytes) }
    }
}

impl Assets for FolderAssets {
    fn read(&self, path: &str, limit: u64) -> Result<Vec<u8>, AssetError> {
        self.read_path(Path::new(path), limit)
    }
}

/// The names of the files and folders in a folder, by their lower-case form.
fn names_in(folder: &Path) -> HashMap<String, OsString> {
    let mut names: Vec<OsString> =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name()).collect();
    names.sort_by(|a, b| b.cmp(a));
    names.into_iter().filter_map(|name| Some((name.to_str()?.to_lowercase(), name))).collect()
}

/// Whether a path, by its words alone, leads out of the folder it starts in.
fn leaves(path: &Path) -> bool {
    let mut depth = 0i32;
    for part in path.components() {
        match part {
            std::path::Component::Normal(_) => depth += 1,
            std::path::Component::CurDir => {}
            std::path::Component::ParentDir => depth -= 1,
            _ => return true,
        }
        if depth < 0 {
            return true;
        }
    }
    false
}

/// What compiling is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompileStage<'a> {
    /// Reading a mesh or point set.
    Reading {
        /// The file, as the scene names it.
        file: &'a str,
        /// Bytes so far.
        done: u64,
        /// Bytes in all.
        total: u64,
    },
    /// Building the tree over the triangles of one space.
    Building {
        /// How many there are.
        triangles: u64,
    },
}

/// A function that is told what compiling is doing, from any thread.
#[derive(Clone)]
pub struct OnCompile(pub Arc<dyn Fn(CompileStage<'_>) + Send + Sync>);

impl std::fmt::Debug for OnCompile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("OnCompile")
    }
}

impl PartialEq for OnCompile {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// A part of a model, which no text has.
struct StandIn {
    /// Where it stands.
    path: String,
    /// Where the model is described.
    model: String,
    /// Whether its fields are those of the model; else all that is wrong with it is wrong with the model's file.
    has_fields: bool,
}

/// Collects the faults of a description while it is compiled. Every check answers with a usable value, so that one
/// fault does not hide the next.
#[derive(Default)]
pub(crate) struct CompileContext {
    /// The moment that is compiled, in seconds.
    pub(crate) time: f64,
    /// Who wants to know what is being done.
    pub(crate) progress: Option<OnCompile>,
    /// Where the coordinates of the scene count from, once that is known: what is compiled after it is kept less this.
    pub(crate) origin: DVec3,
    /// Whether anything has keys, so that the time decides the picture.
    pub(crate) keyed: bool,
    /// Bytes that the scene may take, if that is said.
    pub(crate) memory: Option<u64>,
    /// Bytes that it takes with all that was asked for so far.
    taken: u64,
    /// What stands in the description in place of models: faults of it are those of the models.
    stand_ins: Vec<StandIn>,
    path: String,
    faults: Vec<Diagnostic>,
    /// What is said of scenes without errors.
    advice: Vec<Diagnostic>,
    /// Errors, whether told or not.
    errors: usize,
    /// Faults that are not told.
    omitted: usize,
}

/// What to do about a scene that takes so many bytes and may not.
pub(crate) fn memory_hint(bytes: u64) -> String {
    format!("make it smaller, or allow more: --max-memory {}", bytes.div_ceil(1 << 20))
}

/// Faults that are told; of more, the number.
pub(crate) const MAX_FAULTS: usize = 256;

/// Names that are searched for the one that was meant.
const MAX_NAMES_COMPARED: usize = 1000;

impl CompileContext {
    /// Bytes that are left of those that the scene may take.
    pub fn memory_left(&self) -> u64 {
        self.memory.map_or(u64::MAX, |memory| memory.saturating_sub(self.taken))
    }

    /// Asks for so many bytes, before they are taken; `what` takes them. Where they are more than are left that is an
    /// error of `field`, and the answer is no.
    pub fn take(&mut self, field: &str, what: &str, bytes: u64) -> bool {
        let before = self.taken;
        self.taken = before.saturating_add(bytes);
        let Some(memory) = self.memory.filter(|memory| self.taken > *memory) else { return true };
        // Said once
        if before > memory {
            return false;
        }
        let mib = |bytes: u64| bytes.div_ceil(1 << 20);
        let (all, own) = (mib(self.taken), mib(bytes));
        let message = format!(
            "the scene takes about {all} MiB of memory, {own} of them for {what}, and may take {} MiB",
            memory >> 20
        );
        self.error(field, message, Some(&memory_hint(self.taken)));
        false
    }

    /// For the moment `time`, in seconds.
    pub(crate) fn at_time(time: f64) -> Self {
        Self { time, ..Self::default() }
    }

    /// Runs `f` with `part` added to the path of every fault: `light.spot[2]`.
    pub(crate) fn within<R>(&mut self, part: &str, f: impl FnOnce(&mut Self) -> R) -> R {
        let length = self.path.len();
        if !self.path.is_empty() {
            self.path.push('.');
        }
        self.path.push_str(part);
        let result = f(self);
        self.path.truncate(length);
        result
    }

    /// Records an error at `field` of the current path (empty: at the path itself).
    pub(crate) fn error(&mut self, field: &str, message: impl Into<String>, hint: Option<&str>) {
        self.push(Severity::Error, field, message.into(), hint);
    }

    /// Records a warning.
    pub(crate) fn warning(&mut self, field: &str, message: impl Into<String>, hint: Option<&str>) {
        self.push(Severity::Warning, field, message.into(), hint);
    }

    /// Records something that may surprise.
    pub(crate) fn advise(&mut self, field: &str, message: impl Into<String>, hint: Option<&str>) {
        if self.advice.len() < MAX_FAULTS {
            let advice = self.diagnostic(Severity::Advice, field, message.into(), hint);
            self.advice.push(advice);
        }
    }

    /// Advises if colours of vertices, which multiply reflectances, go beyond 1.
    pub(crate) fn advise_vertex_colors(&mut self, colors: &[[f32; 4]]) {
        let most = colors.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).fold(0.0, f32::max);
        if most > 1.0 {
            let message =
                format!("the colours of its vertices go up to {most}: that reflects more light than there is");
            let hint = match most {
                2.0..=255.0 => {
                    "are they 0 to 255? divide them by 255, or write whole numbers of one byte each (PLY `uchar`)"
                }
                _ => "they are fractions from 0 to 1, linear; a file may also have whole numbers of one byte each",
            };
            self.advise("", message, Some(hint));
        }
    }

    /// Advises if an angle in degrees looks like one in radians: a few, and no whole number of degrees.
    pub(crate) fn advise_radians(&mut self, field: &str, degrees: f64) {
        if degrees > 0.0 && degrees < 3.2 && degrees.fract() != 0.0 {
            let message =
                format!("{degrees} degrees are little: as radians they would be {:.2} degrees", degrees.to_degrees());
            self.advise(field, message, Some("angles are in degrees"));
        }
    }

    /// Advises if angles to turn by look like radians: all of them small multiples of pi / 12, and none a whole number.
    pub(crate) fn advise_radian_turns(&mut self, field: &str, degrees: &[f64]) {
        const STEP: f64 = std::f64::consts::PI / 12.0;
        let is_like = |angle: f64| {
            let steps = (angle / STEP).round();
            angle.abs() < 6.5 && steps != 0.0 && (angle - steps * STEP).abs() < 2e-3 && angle.fract() != 0.0
        };
        let turns = || degrees.iter().copied().filter(|angle| *angle != 0.0);
        if turns().next().is_some() && turns().all(is_like) {
            let meant: Vec<String> = degrees.iter().map(|angle| format!("{:.0}", angle.to_degrees())).collect();
            let meant = if let [one] = &meant[..] { one.clone() } else { format!("[{}]", meant.join(", ")) };
            let message = format!("{} looks like radians: in degrees it would be {meant}", show(degrees));
            self.advise(field, message, Some("angles are in degrees"));
        }
    }

    /// Records that nothing is called `wanted`: `no camera is called "tpo"; did you mean "top"?`
    pub(crate) fn unknown(&mut self, field: &str, what: &str, wanted: &str, names: &[&str]) {
        // Looking for the nearest of many names takes its time, and many faults of this kind come together
        let nearest = if names.len() <= MAX_NAMES_COMPARED && self.faults.len() < MAX_FAULTS {
            crate::describe::nearest(wanted, names)
        } else {
            None
        };
        let wanted = quoted(wanted);
        let message = match nearest {
            Some(name) => format!("no {what} is called {wanted}; did you mean {}?", quoted(name)),
            None if names.is_empty() => format!("no {what} is called {wanted}; the scene has none"),
            None => {
                let list: Vec<String> =
                    names.iter().filter(|name| !name.is_empty()).take(8).map(|name| quoted(name)).collect();
                let more = if names.len() > 8 { ", ..." } else { "" };
                format!("no {what} is called {wanted}; there are {}{more}", list.join(", "))
            }
        };
        self.error(field, message, None);
    }

    fn push(&mut self, severity: Severity, field: &str, message: String, hint: Option<&str>) {
        self.errors += usize::from(severity == Severity::Error);
        if self.faults.len() >= MAX_FAULTS {
            self.omitted += 1;
            return;
        }
        let fault = self.diagnostic(severity, field, message, hint);
        self.faults.push(fault);
    }

    fn diagnostic(&self, severity: Severity, field: &str, message: String, hint: Option<&str>) -> Diagnostic {
        let mut path = self.path.clone();
        if !path.is_empty() && !field.is_empty() {
            path.push('.');
        }
        path.push_str(field);
        let path = self.path_of_model(&path).unwrap_or(path);
        Diagnostic { severity, place: None, path, message, hint: hint.map(str::to_owned) }
    }

    /// Says that a part of the model at the current path stands at `path`.
    pub(crate) fn stands_in(&mut self, path: String, has_fields: bool) {
        self.stand_ins.push(StandIn { path, model: self.path.clone(), has_fields });
    }

    /// The path of the field of a model that a fault at `path` is about, if that is a part of one.
    fn path_of_model(&self, path: &str) -> Option<String> {
        self.stand_ins.iter().find_map(|part| {
            let field = path.strip_prefix(&part.path)?;
            let is_within = field.is_empty() || field.starts_with('.');
            is_within.then(|| part.model.clone() + if part.has_fields { field } else { ".file" })
        })
    }

    /// The whole path of `field`, for a fault that is found later.
    pub(crate) fn path_of(&self, field: &str) -> String {
        if self.path.is_empty() { field.to_owned() } else { format!("{}.{field}", self.path) }
    }

    /// What may surprise, in the order found.
    pub(crate) fn take_advice(&mut self) -> Vec<Diagnostic> {
        std::mem::take(&mut self.advice)
    }

    /// Runs `f`, which does once more what was done before, with little added: the memory is that of the second time,
    /// and what may surprise has been told.
    pub(crate) fn again<R>(&mut self, f: impl FnOnce(&mut Self) -> R) -> R {
        let (taken, told, advised) = (std::mem::take(&mut self.taken), self.faults.len(), self.advice.len());
        let result = f(self);
        self.taken = self.taken.max(taken);
        self.advice.truncate(advised);
        let errors = self.faults.split_off(told).into_iter().filter(|fault| fault.severity == Severity::Error);
        self.faults.extend(errors);
        result
    }

    /// Runs `f` with an empty path, for a fault that belongs elsewhere.
    pub(crate) fn outside<R>(&mut self, f: impl FnOnce(&mut Self) -> R) -> R {
        let path = std::mem::take(&mut self.path);
        let result = f(self);
        self.path = path;
        result
    }

    /// All faults so far, in the order found.
    pub(crate) fn take_faults(&mut self) -> Vec<Diagnostic> {
        if self.omitted > 0 {
            let severity = if self.has_errors() { Severity::Error } else { Severity::Warning };
            let message = format!("{} more faults are not listed", self.omitted);
            self.faults.push(Diagnostic { severity, place: None, path: String::new(), message, hint: None });
        }
        std::mem::take(&mut self.faults)
    }
}

/// The checks that descriptions share. Each answers with the number as it is computed with.
impl CompileContext {
    fn finite(&mut self, field: &str, v: &[f64]) -> bool {
        let fine = v.iter().all(|x| (*x as f32).is_finite());
        if !fine {
            let message = format!("{} is not finite in 32 bits", show(v));
            self.error(field, message, Some("give numbers between -3.4e38 and 3.4e38"));
        }
        fine
    }

    /// A point of the world: finite, and near enough for its square to be finite as well.
    pub(crate) fn point(&mut self, field: &str, v: [f64; 3]) -> Vec3 {
        if self.finite(field, &v) && v.iter().any(|x| x.abs() > MAX_COORDINATE) {
            let message = format!("{} is outside -2.5e8 to 2.5e8", show(&v));
            self.error(field, message, Some("use a larger unit of length"));
        }
        vec3(v)
    }

    /// Where a camera is, or where it looks: it may stand back from things that are as far out as things may be.
    pub(crate) fn far_point(&mut self, field: &str, v: [f64; 3]) {
        if self.finite(field, &v) && v.iter().any(|x| x.abs() > MAX_FAR_COORDINATE) {
            let message = format!("{} is outside -2.5e9 to 2.5e9", show(&v));
            self.error(field, message, Some("use a larger unit of length"));
        }
    }

    /// A point of the world as the scene keeps it: less the scene's origin.
    pub(crate) fn local(&self, p: DVec3) -> DVec3 {
        p - self.origin
    }

    /// A point that a transform moves, in world space; a fault where it is moved too far.
    pub(crate) fn moved_point(&mut self, world_from_object: DAffine3, p: DVec3) -> DVec3 {
        let moved = world_from_object.transform_point3(p);
        if !moved.to_array().iter().all(|x| x.abs() <= MAX_COORDINATE) {
            let (from, to) = (show(&p.to_array()), show(&moved.to_array()));
            let message = format!("it moves {from} to {to}, outside -2.5e8 to 2.5e8");
            self.error("transform", message, Some("use a larger unit of length"));
        }
        moved
    }

    /// A vector that a transform turns and scales, in world space; a fault where that leaves it no length, or too much.
    pub(crate) fn moved_edge(&mut self, world_from_object: DAffine3, field: &str, v: DVec3) -> DVec3 {
        let moved = world_from_object.transform_vector3(v);
        let too_far = moved.to_array().iter().any(|x| !(x.abs() <= MAX_COORDINATE));
        if too_far || !(moved.length() >= MIN_LENGTH) {
            let message = format!("it makes {} of {field}, of a length outside [1e-9, 2.5e8]", show(&moved.to_array()));
            self.error("transform", message, Some("choose another scale"));
        }
        moved
    }

    /// A vector that has a length.
    pub(crate) fn edge(&mut self, field: &str, v: [f64; 3]) -> bool {
        let before = self.fault_count();
        self.point(field, v);
        if self.fault_count() == before && !(DVec3::from(v).length() >= MIN_LENGTH) {
            self.error(field, format!("{} has no length", show(&v)), Some("give a vector longer than 1e-9"));
        }
        self.fault_count() == before
    }

    /// A length: from the shortest to the longest that can be computed with.
    pub(crate) fn positive(&mut self, field: &str, v: f64, hint: &str) -> f64 {
        if !(MIN_LENGTH..=MAX_COORDINATE).contains(&v) {
            self.error(field, format!("{v} is outside [1e-9, 2.5e8]"), Some(hint));
        }
        v
    }

    /// A number from `low` to `high`, both allowed.
    pub(crate) fn between(&mut self, field: &str, v: f64, low: f64, high: f64, hint: Option<&str>) -> f64 {
        if !(v >= low && v <= high) {
            self.error(field, format!("{v} is outside [{low}, {high}]"), hint);
        }
        v
    }

    /// A whole number from `low` to `high`, both allowed.
    pub(crate) fn count(&mut self, field: &str, v: u32, low: u32, high: u32, hint: Option<&str>) -> u32 {
        if v < low || v > high {
            self.error(field, format!("{v} is outside {low} to {high}"), hint);
        }
        v
    }

    /// A colour: finite, no channel below 0.
    pub(crate) fn color(&mut self, field: &str, c: ColorDesc) -> Rgb {
        if self.finite(field, &c.linear) {
            if c.linear.iter().any(|x| *x < 0.0) {
                let message = format!("{} has a channel below 0", show(&c.linear));
                self.error(field, message, Some("light and reflectance are 0 or more"));
            } else if c.linear.iter().any(|x| *x > MAX_COLOR) {
                let message = format!("{} has a channel above 1e6", show(&c.linear));
                self.error(field, message, Some("a light has its strength for what a colour cannot say"));
            }
        }
        c.into()
    }

    /// How strong a light is: 0 or more.
    pub(crate) fn strength(&mut self, v: f64) -> f64 {
        if !(0.0..=MAX_STRENGTH).contains(&v) {
            self.error("strength", format!("{v} is outside [0, 1e15]"), Some("a light cannot take light away"));
        }
        v
    }

    /// How many faults there are so far.
    pub(crate) fn fault_count(&self) -> usize {
        self.faults.len() + self.omitted
    }

    /// Says what is being done.
    pub(crate) fn tell(&self, stage: CompileStage<'_>) {
        if let Some(OnCompile(progress)) = &self.progress {
            progress(stage);
        }
    }

    /// How many errors there are so far.
    pub(crate) fn error_count(&self) -> usize {
        self.errors
    }

    /// Whether there are errors so far.
    pub(crate) fn has_errors(&self) -> bool {
        self.errors > 0
    }
}

/// Squares of products of two differences of world coordinates stay finite, also at the far ends of shapes.
const MAX_COORDINATE: f64 = 2.5e8;
/// That holds as well for products of a difference of such coordinates and one of those of a camera.
const MAX_FAR_COORDINATE: f64 = 2.5e9;
const MIN_LENGTH: f64 = 1e-9;
pub(crate) const MAX_STRENGTH: f64 = 1e15;
const MAX_COLOR: f64 = 1e6;

/// A value as the user would write it.
pub(crate) fn show(v: &[f64]) -> String {
    match v {
        [x] => x.to_string(),
        _ => format!("[{}]", v.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_whatever_their_case() {
        let root = tempfile::tempdir().unwrap();
        std::fs::create_dir(root.path().join("Maps")).unwrap();
        for name in ["Maps/Wood.PNG", "Maps/b.png", "Maps/B.png"] {
            std::fs::write(root.path().join(name), name).unwrap();
        }
        let assets = FolderAssets::new(root.path(), &[]).unwrap();
        let read = |path: &str| assets.read(path, 100).map(|bytes| String::from_utf8(bytes).unwrap());
        assert_eq!(read("maps/wood.png"), Ok("Maps/Wood.PNG".into()));
        assert_eq!(read("Maps/b.png"), Ok("Maps/b.png".into()));
        assert_eq!(read("maps/../MAPS/wood.png"), Ok("Maps/Wood.PNG".into()));
        assert_eq!(read("maps/woods.png"), Err(AssetError::NotFound));
        assert_eq!(read("../MAPS/wood.png"), Err(AssetError::Outside));
    }
}
