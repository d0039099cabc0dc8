//! Where pictures go: files, whole or absent, and standard output. Never over a file that the scene was made of.

use std::fs::{self, File};
use std::io::{self, BufReader, IsTerminal};
use std::path::{Path, PathBuf};

use firstlight::{BufferDesc, Format, ImageError, PendingFile, Receipt, StagedFile, Written, write_open};

mod names;

use names::{FOLDER, NAME, PARENT, SIZE, VIEW, WORDS, filled, placeholder, with_part};
pub use names::{Names, Part, Several, ViewName, check_placeholders};

use crate::args::{Bits, NamedFormat};
use crate::report::{Failure, say, shown};

/// A place for bytes.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// Standard output.
    Stdout,
    /// A file, or a device.
    File(PathBuf),
}

/// A picture to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    /// Where to.
    pub target: Target,
    /// As what.
    pub format: Format,
    /// What it shows.
    pub content: Content,
}

/// A file of JSON beside the pictures: the numbers of `--stats`, the annotations of `--coco`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JsonFile {
    /// The option, as it stands before the file's name.
    option: &'static str,
    /// Where to.
    pub target: Target,
}

impl JsonFile {
    /// The file of an option, which is given as it stands before the name. It is a `.json`, so that no slip of the hand
    /// writes it over a scene or a picture.
    ///
    /// # Errors
    /// It is none.
    pub fn of(option: &'static str, path: &Path) -> Result<Self, Failure> {
        Self::ending_in("json", option, path)
    }

    /// The same of a file of lines of JSON, which is a `.jsonl`.
    ///
    /// # Errors
    /// It is none.
    pub fn of_lines(option: &'static str, path: &Path) -> Result<Self, Failure> {
        Self::ending_in("jsonl", option, path)
    }

    fn ending_in(ending: &str, option: &'static str, path: &Path) -> Result<Self, Failure> {
        let target = Target::of(path);
        let is_own = path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
        if target != Target::Stdout && !is_own {
            let name = shown(path);
            let message = format!("{option}{name}: the file's name must end in .{ending}; - is standard output");
            return Err(Failure::Usage(message));
        }
        Ok(JsonFile { option, target })
    }

    /// What messages call it: `--coco a.json`.
    pub fn name(&self) -> String {
        format!("{}{}", self.option, self.target.name())
    }

    /// The option alone.
    pub fn option(&self) -> &'static str {
        self.option.trim_end_matches([' ', '='])
    }

    /// Sees that it has no placeholders.
    ///
    /// # Errors
    /// It has one, and is one file of all scenes.
    pub fn refuse_placeholders(&self) -> Result<(), Failure> {
        let mut words = WORDS.iter().map(|(word, _)| *word).chain([VIEW, SIZE]);
        let Some(word) = words.find(|word| self.target.has(word)) else { return Ok(()) };
        let name = self.name();
        Err(Failure::Usage(format!("{name}: {word} stands for nothing: it is one file of all scenes")))
    }

    /// With the names of a scene in place of the placeholders.
    pub fn of_scene(&self, names: &Names) -> Self {
        JsonFile { target: self.target.of_scene(names), ..self.clone() }
    }
}

/// What a picture shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Content {
    /// The scene.
    Scene,
    /// One buffer by itself, in any format that can hold it.
    Buffer(BufferDesc),
    /// The work that each pixel took.
    Heat,
}

impl Content {
    /// The buffer that it is by itself.
    pub fn buffer(&self) -> Option<&BufferDesc> {
        match self {
            Content::Buffer(desc) => Some(desc),
            Content::Scene | Content::Heat => None,
        }
    }
}

impl Output {
    /// Whether it takes all buffers that are asked for, not the picture alone.
    pub fn takes_buffers(&self) -> bool {
        self.content == Content::Scene && matches!(self.format, Format::Exr | Format::Npz)
    }

    /// Whether it is a PNG file.
    pub fn is_png(&self) -> bool {
        matches!(self.format, Format::Png8 | Format::Png16)
    }
}

/// A place that can take bytes, as far as can be seen without giving it any.
pub enum Ready {
    Stdout,
    File(PendingFile),
}

/// Bytes that are ready to appear, all at once. Dropped, they never do.
pub enum Staged<'a> {
    Stdout(&'a [u8]),
    File(PathBuf, StagedFile<'a>),
}

impl Target {
    /// What `path` means: `-` is standard output.
    pub fn of(path: &Path) -> Self {
        if path == "-" { Target::Stdout } else { Target::File(path.to_path_buf()) }
    }

    /// With the names of a scene in place of the placeholders.
    pub fn of_scene(&self, names: &Names) -> Self {
        match self {
            Target::Stdout => Target::Stdout,
            Target::File(path) => Target::File(filled(path, names)),
        }
    }

    /// Whether it is another file for each scene.
    fn has_placeholder(&self) -> bool {
        matches!(self, Target::File(path) if path.to_str().is_some_and(|text| placeholder(text).is_some()))
    }

    /// Whether the whole name of the scene's file is in it.
    pub fn has_name(&self) -> bool {
        self.has(NAME)
    }

    /// Whether the name of the scene's folder is in it.
    pub fn has_parent(&self) -> bool {
        self.has(PARENT)
    }

    /// Whether the path of the scene's folder is in it.
    pub fn has_folder(&self) -> bool {
        self.has(FOLDER)
    }

    fn has(&self, word: &str) -> bool {
        matches!(self, Target::File(path) if path.to_str().is_some_and(|text| text.contains(word)))
    }

    /// The folder that is to be made for it, if this has placeholders in the names of folders, and `filled` is this
    /// with the names of a scene in place of them. What stands before the first of them has to be there.
    pub fn folder_to_make(&self, filled: &Target) -> Option<PathBuf> {
        let (Target::File(path), Target::File(filled)) = (self, filled) else { return None };
        let folder = path.parent()?;
        let is_named = |text: &str| placeholder(text).is_some() || [VIEW, SIZE].iter().any(|word| text.contains(word));
        let fixed: PathBuf =
            folder.components().take_while(|part| !part.as_os_str().to_str().is_some_and(is_named)).collect();
        let is_there = || if fixed.as_os_str().is_empty() { true } else { fixed.is_dir() };
        (fixed.components().count() < folder.components().count() && is_there())
            .then(|| filled.parent().map(Path::to_path_buf))
            .flatten()
    }

    /// What messages call it.
    pub fn name(&self) -> String {
        match self {
            Target::Stdout => "-".into(),
            Target::File(path) => shown(path),
        }
    }

    /// The whole path, as `--summary` writes it.
    pub fn whole(&self) -> String {
        match self {
            Target::Stdout => "-".into(),
            Target::File(path) => path.to_string_lossy().into_owned(),
        }
    }

    /// The same for every name of one file.
    pub fn real(&self) -> Self {
        match self {
            Target::Stdout => Target::Stdout,
            Target::File(path) => Target::File(real(path)),
        }
    }

    /// Sees, before any work is done, whether something can be written there.
    ///
    /// # Errors
    /// It cannot.
    pub fn ready(&self) -> Result<Ready, Failure> {
        match self {
            Target::Stdout => Ok(Ready::Stdout),
            Target::File(path) => PendingFile::new(path).map(Ready::File).map_err(failed),
        }
    }
}

impl Ready {
    /// Brings the bytes to the disk, but not yet to their name.
    ///
    /// # Errors
    /// They do not fit, for one.
    pub fn stage(self, bytes: &[u8]) -> Result<Staged<'_>, Failure> {
        match self {
            Ready::Stdout => Ok(Staged::Stdout(bytes)),
            Ready::File(file) => {
                let path = file.path().to_path_buf();
                Ok(Staged::File(path, file.stage(bytes).map_err(failed)?))
            }
        }
    }
}

impl Staged<'_> {
    /// Whether this is standard output, a device or a pipe: its reader may be gone, and nothing of it can be taken
    /// back.
    pub fn is_direct(&self) -> bool {
        match self {
            Staged::Stdout(_) => true,
            Staged::File(_, file) => file.is_direct(),
        }
    }

    /// Lets the bytes appear, and says so unless `quiet`. While a reader lets wait, `stop` is asked whether to go on.
    ///
    /// # Errors
    /// They did not get there as a whole; a file that was there before is there still.
    pub fn commit(self, quiet: bool, stop: &dyn Fn() -> bool) -> Result<(), Failure> {
        match self {
            Staged::Stdout(bytes) => stdout().and_then(|out| write_open(out, bytes, stop)).map_err(|e| {
                Failure::Work(match e.kind() {
                    io::ErrorKind::Interrupted => return Failure::InterruptedWriting("standard output".into()),
                    io::ErrorKind::BrokenPipe => "standard output: closed before everything was written".into(),
                    _ => format!("standard output: {e}"),
                })
            }),
            Staged::File(path, file) => {
                let written = file.commit_unless(stop).map_err(|e| match e {
                    ImageError::Stopped { .. } => Failure::InterruptedWriting(shown(&path)),
                    e => failed(e),
                })?;
                if !quiet {
                    say(format_args!("wrote {}{}", shown(&path), aside(&path, written)));
                }
                Ok(())
            }
        }
    }
}

/// Lets all of them appear, or none as far as that can be: first what is written to directly, for a device may be full
/// and the reader of a pipe gone, then the files, which are on the disk and only want their names.
///
/// # Errors
/// Those of [`Staged::commit`], of the first that fails.
pub fn commit(mut staged: Vec<Staged>, quiet: bool, stop: &dyn Fn() -> bool) -> Result<(), Failure> {
    staged.sort_by_key(|staged| !staged.is_direct());
    staged.into_iter().try_for_each(|staged| staged.commit(quiet, stop))
}

/// Standard output, without a buffer.
fn stdout() -> io::Result<File> {
    #[cfg(unix)]
    let handle = std::os::fd::AsFd::as_fd(&io::stdout()).try_clone_to_owned();
    #[cfg(windows)]
    let handle = std::os::windows::io::AsHandle::as_handle(&io::stdout()).try_clone_to_owned();
    handle.map(File::from)
}

/// The library's words name the path, what is wrong and what to do.
fn failed(e: ImageError) -> Failure {
    Failure::Work(e.to_string())
}

impl Output {
    /// With the names of a scene in place of the placeholders.
    pub fn of_scene(&self, names: &Names) -> Output {
        Output { target: self.target.of_scene(names), ..self.clone() }
    }

    /// Where one of the pictures of a scene goes.
    pub fn of_part(&self, part: &Part) -> Output {
        let target = match &self.target {
            Target::Stdout => Target::Stdout,
            Target::File(path) => Target::File(with_part(path, part)),
        };
        Output { target, ..self.clone() }
    }

    /// Whether the picture may go there though nobody named it: there is no file yet, or a picture of our own.
    pub fn is_free(&self) -> bool {
        let Target::File(path) = &self.target else { return true };
        match fs::metadata(path) {
            Ok(meta) if meta.is_file() => {
                File::open(path).is_ok_and(|file| Receipt::is_in_png(&mut BufReader::new(file)))
            }
            // A folder cannot be replaced; a device that a link leads to is meant
            Ok(meta) => !meta.is_dir(),
            Err(_) => true,
        }
    }
}

/// What else there is to say of a file that was written: nothing, for a plain file.
fn aside(path: &Path, written: Written) -> String {
    if written == Written::Direct {
        return " directly: a device or pipe is not replaced as a whole".into();
    }
    let replaced = written == Written::Replaced;
    let is_link = fs::symlink_metadata(path).is_ok_and(|meta| meta.is_symlink());
    match path.canonicalize() {
        Ok(real) if is_link && replaced => format!(", a link: {} was replaced", shown(&real)),
        Ok(real) if is_link => format!(", a link to {}", shown(&real)),
        _ if replaced => " (replaced)".into(),
        _ => String::new(),
    }
}

/// What `-o` asks for: a file, or a buffer and its file.
///
/// # Errors
/// What stands before the first `=` is no buffer's name. With a folder before it, all of it is a file's.
fn content_of(path: &Path) -> Result<(Content, PathBuf), Failure> {
    let Some((name, file)) = path.to_str().and_then(|text| text.split_once('=')) else {
        return Ok((Content::Scene, path.to_owned()));
    };
    match BufferDesc::parse(name) {
        Ok(_) if file.is_empty() => {
            Err(Failure::Usage(format!("-o {name}=: a file is needed after it, as {name}=a.png")))
        }
        Ok(buffer) => Ok((Content::Buffer(buffer), file.into())),
        Err(_) if name.contains(['/', std::path::MAIN_SEPARATOR]) => Ok((Content::Scene, path.to_owned())),
        Err((_, hint)) => {
            let hint = hint.map(|hint| format!("; {hint}")).unwrap_or_default();
            Err(Failure::Usage(format!(
                "-o {name}={file}: {name:?} is no buffer{hint}; `firstlight buffers` lists them all; a file of that \
                 name is ./{name}={file}"
            )))
        }
    }
}

/// What the options say of outputs.
///
/// # Errors
/// An ending that is no picture's, something named twice, an option that applies to nothing.
pub fn resolve(paths: &[PathBuf], bits: Option<Bits>, format: Option<NamedFormat>) -> Result<Vec<Output>, Failure> {
    let usage = |message: String| Err(Failure::Usage(message));
    let mut outputs: Vec<Output> = Vec::new();
    for path in paths {
        let (content, path) = content_of(path)?;
        let target = Target::of(&path);
        let kind = match (&target, format) {
            (Target::Stdout, format) => format.map_or(Format::Png8, format_of),
            (Target::File(path), Some(format)) if path.extension().is_none() => format_of(format),
            (Target::File(path), _) => match Format::from_path(path) {
                Ok(kind) => kind,
                Err(e) if path.extension().is_none() => {
                    return usage(format!("{e}, or say the format with --format png, jpeg, exr, npz, npy or hdr"));
                }
                Err(e) => return usage(e.to_string()),
            },
        };
        outputs.push(Output { target, format: with_bits(kind, bits), content });
    }

    let to_stdout = outputs.iter().any(|output| output.target == Target::Stdout);
    if to_stdout && io::stdout().is_terminal() {
        return usage("-o - would write a picture to the terminal; send standard output to a file or program".into());
    }
    let without_ending = outputs.iter().any(|output| match &output.target {
        Target::Stdout => true,
        Target::File(path) => path.extension().is_none(),
    });
    if format.is_some() && !without_ending {
        return usage("--format is for -o - and names without an ending; the ending of a file says its format".into());
    }
    if bits.is_some() && !outputs.is_empty() && !outputs.iter().any(Output::is_png) {
        return usage("--bits is for PNG only, and no output is one".into());
    }
    Ok(outputs)
}

/// The format of a course file's `output_file`.
///
/// # Errors
/// An ending that is no picture's.
pub fn format_of_course(course: &str, path: &Path) -> Result<Format, Failure> {
    Format::from_path(path).map_err(|e| {
        // The library's words begin with the path
        let (name, why) = (path.display().to_string(), e.to_string());
        let why = why.strip_prefix(&format!("{name}: ")).unwrap_or(&why);
        Failure::Work(format!("{course}: output_file {name}: {why}; or name another output with -o"))
    })
}

/// Sees that nothing would be written over something else of the same run: the scene's text, a picture, the numbers.
///
/// # Errors
/// Two of them are one file, under whatever names.
pub fn refuse_clashes(scene: Option<&Path>, outputs: &[Output], beside: &[JsonFile]) -> Result<(), Failure> {
    let usage = |message: String| Err(Failure::Usage(message));
    let scene = scene.map(real);
    let mut seen: Vec<Target> = Vec::new();
    for output in outputs {
        let (name, place) = (output.target.name(), output.target.real());
        if scene.as_ref().is_some_and(|scene| place == Target::File(scene.clone())) {
            return usage(format!("the picture {name} would replace the scene's own file; name another with -o"));
        }
        if seen.contains(&place) && output.content == Content::Heat {
            return usage(format!("--heat {name} and -o name the same output; give each its own"));
        }
        if seen.contains(&place) {
            return usage(format!("-o {name} is given twice, perhaps under two names for one file"));
        }
        seen.push(place);
    }
    for file in beside {
        let (name, place) = (file.name(), file.target.real());
        if scene.as_ref().is_some_and(|scene| place == Target::File(scene.clone())) {
            return usage(format!("{name} would replace the scene's own file; name another"));
        }
        if seen.contains(&place) {
            return usage(format!("{name} and another option, or -o, name the same output; give each its own"));
        }
        seen.push(place);
    }
    Ok(())
}

/// A file, the same under each of its names.
struct Identity {
    real: PathBuf,
    /// Device and number of the file, the same for all its hard links; where the system tells, and the file is there.
    inode: Option<(u64, u64)>,
}

impl Identity {
    /// `None` for what is no plain file: nothing of a device is lost.
    fn of(path: &Path) -> Option<Self> {
        let meta = fs::metadata(path).ok();
        if meta.as_ref().is_some_and(|meta| !meta.is_file()) {
            return None;
        }
        #[cfg(unix)]
        let inode = {
            use std::os::unix::fs::MetadataExt;
            meta.map(|meta| (meta.dev(), meta.ino()))
        };
        #[cfg(not(unix))]
        let inode = None;
        Some(Self { real: real(path), inode })
    }

    /// What is written to. Standard output may have been sent to a file.
    fn of_target(target: &Target) -> Option<Self> {
        match target {
            Target::Stdout if cfg!(unix) => Self::of(Path::new("/dev/stdout")),
            Target::Stdout => None,
            Target::File(path) => Self::of(path),
        }
    }

    fn is(&self, other: &Identity) -> bool {
        self.real == other.real || (self.inode.is_some() && self.inode == other.inode)
    }
}

/// Sees that nothing would be written over a file that the scene was made of, under whatever name.
///
/// # Errors
/// The first that would, with both names and what to do.
pub fn refuse_overwriting<'a>(
    read: &[PathBuf],
    outputs: impl IntoIterator<Item = &'a Output>,
    beside: &[JsonFile],
) -> Result<(), Failure> {
    let files: Vec<(Identity, &PathBuf)> = read.iter().filter_map(|name| Some((Identity::of(name)?, name))).collect();
    let overwritten = |target: &Target| {
        let place = Identity::of_target(target)?;
        files.iter().find(|(file, _)| file.is(&place)).map(|(_, name)| shown(relative(name)))
    };
    let usage = |what: String, file: String, advice: &str| {
        Err(Failure::Usage(format!("{what} would replace {file}, which the scene is made of; {advice}")))
    };
    for output in outputs {
        if let Some(file) = overwritten(&output.target) {
            let name = output.target.name();
            return match output.content {
                Content::Scene | Content::Buffer(_) => {
                    usage(format!("the picture {name}"), file, "name another file with -o")
                }
                Content::Heat => usage(format!("--heat {name}"), file, "name another file"),
            };
        }
    }
    match beside.iter().find_map(|beside| Some((beside.name(), overwritten(&beside.target)?))) {
        Some((name, file)) => usage(name, file, "name another file"),
        None => Ok(()),
    }
}

/// A path as seen from the working folder, if it lies in it.
fn relative(path: &Path) -> &Path {
    let folder = std::env::current_dir().and_then(|folder| folder.canonicalize());
    folder.ok().and_then(|folder| path.strip_prefix(folder).ok()).unwrap_or(path)
}

/// The file that a path means, whether there is one yet or not: links are followed, `.` and `..` resolved.
fn real(path: &Path) -> PathBuf {
    let mut path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    // A link may lead to a file that is yet to be made; as many links in a row as Linux follows
    for _ in 0..40 {
        if let Ok(real) = path.canonicalize() {
            return real;
        }
        let Ok(next) = fs::read_link(&path) else { break };
        path = path.parent().map(|folder| folder.join(&next)).unwrap_or(next);
    }
    match (path.parent().map(Path::canonicalize), path.file_name()) {
        (Some(Ok(folder)), Some(name)) => folder.join(name),
        _ => path,
    }
}

fn format_of(format: NamedFormat) -> Format {
    match format {
        NamedFormat::Png => Format::Png8,
        NamedFormat::Exr => Format::Exr,
        NamedFormat::Npz => Format::Npz,
        NamedFormat::Npy => Format::Npy,
        NamedFormat::Hdr => Format::Hdr,
        NamedFormat::Jpeg => Format::Jpeg,
    }
}

/// The format with the bits asked for; only PNG has a choice.
pub fn with_bits(format: Format, bits: Option<Bits>) -> Format {
    match (format, bits) {
        (Format::Png8, Some(Bits::Sixteen)) => Format::Png16,
        (Format::Png16, Some(Bits::Eight)) => Format::Png8,
        (format, _) => format,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_made_where_a_placeholder_names_it() {
        let root = tempfile::tempdir().unwrap();
        let target = |text: &str| Target::File(root.path().join(text));
        let made = |template: &str, filled: &str| target(template).folder_to_make(&target(filled));
        assert_eq!(made("{parent}/{stem}.png", "b/a.png"), Some(root.path().join("b")));
        assert_eq!(made("{view}/x/a.png", "front/x/a.png"), Some(root.path().join("front/x")));
        // What it would lie in is not there, or has no placeholder
        assert_eq!(made("out/{parent}/{stem}.png", "out/b/a.png"), None);
        assert_eq!(made("out/{stem}.png", "out/a.png"), None);
        assert_eq!(made("{stem}.png", "a.png"), None);
    }

    #[test]
    fn an_output_is_a_file_or_a_buffer_and_its_file() {
        let of = |text: &str| content_of(Path::new(text));
        let buffer = |text: &str| match of(text) {
            Ok((Content::Buffer(desc), file)) => (desc.name(), file.display().to_string()),
            other => panic!("{text}: {other:?}"),
        };
        assert_eq!(buffer("depth=a=b.png"), ("depth".into(), "a=b.png".into()));
        assert_eq!(buffer("light:a/b=-"), ("light:a/b".into(), "-".into()));
        for file in ["a.png", "./a=b.png", "depth/a=b.png", "./depth=d.png"] {
            assert_eq!(of(file).unwrap(), (Content::Scene, PathBuf::from(file)));
        }
        for (bad, said) in [
            ("dept=d.png", "did you mean \"depth\"?"),
            ("a=b.png", "./a=b.png"),
            ("=b.png", "./=b.png"),
            ("depth=", "a file is needed"),
            ("light:=d.png", "is no buffer"),
        ] {
            let Err(Failure::Usage(words)) = of(bad) else { panic!("{bad}") };
            assert!(words.contains(said), "{words}");
        }
    }
}
