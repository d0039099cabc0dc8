//! Where pictures go: files, whole or absent, and standard output.

use std::fs;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use firstlight::{Format, ImageError, PendingFile, StagedFile, Written};

use crate::args::{Bits, NamedFormat};
use crate::report::{Failure, say, shown};

/// A place for bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
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

/// What a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// The scene.
    Scene,
    /// The work that each pixel took.
    Heat,
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

    /// What messages call it.
    fn name(&self) -> String {
        match self {
            Target::Stdout => "-".into(),
            Target::File(path) => shown(path),
        }
    }

    /// The same for every name of one file.
    fn real(&self) -> Self {
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
    /// Whether this is standard output, whose reader may be gone.
    pub fn is_stdout(&self) -> bool {
        matches!(self, Staged::Stdout(_))
    }

    /// Lets the bytes appear, and says so unless `quiet`.
    ///
    /// # Errors
    /// They did not get there as a whole; a file that was there before is there still.
    pub fn commit(self, quiet: bool) -> Result<(), Failure> {
        match self {
            Staged::Stdout(bytes) => {
                let mut out = io::stdout().lock();
                out.write_all(bytes).and_then(|()| out.flush()).map_err(|e| {
                    Failure::Work(match e.kind() {
                        io::ErrorKind::BrokenPipe => "standard output: closed before everything was written".into(),
                        _ => format!("standard output: {e}"),
                    })
                })
            }
            Staged::File(path, file) => {
                let written = file.commit().map_err(failed)?;
                if !quiet {
                    say(format_args!("wrote {}{}", shown(&path), aside(&path, written)));
                }
                Ok(())
            }
        }
    }
}

/// The library's words name the path, what is wrong and what to do.
fn failed(e: ImageError) -> Failure {
    Failure::Work(e.to_string())
}

impl Output {
    /// Where the frame of that number goes.
    pub fn of_frame(&self, frame: u32) -> Output {
        let target = match &self.target {
            Target::Stdout => Target::Stdout,
            Target::File(path) => Target::File(with_frame(path, frame)),
        };
        Output { target, ..self.clone() }
    }
}

/// The path with the number of a frame in its name: in place of the last row of `#`, with at least as many digits, else
/// before the ending with at least four.
fn with_frame(path: &Path, frame: u32) -> PathBuf {
    let name = path.file_name().unwrap_or_default();
    if let Some(name) = name.to_str()
        && let Some(end) = name.rfind('#').map(|last| last + 1)
    {
        let start = name[..end].trim_end_matches('#').len();
        return path.with_file_name(format!("{}{frame:0width$}{}", &name[..start], &name[end..], width = end - start));
    }
    let mut numbered = path.file_stem().unwrap_or_default().to_os_string();
    numbered.push(format!(".{frame:04}"));
    if let Some(ending) = path.extension() {
        numbered.push(".");
        numbered.push(ending);
    }
    path.with_file_name(numbered)
}

/// What else there is to say of a file that was written: nothing, for a plain file.
fn aside(path: &Path, written: Written) -> String {
    if written == Written::Direct {
        return " directly: a device or pipe is not replaced as a whole".into();
    }
    let is_link = fs::symlink_metadata(path).is_ok_and(|meta| meta.is_symlink());
    match path.canonicalize() {
        Ok(real) if is_link => format!(", a link: {} was replaced", shown(&real)),
        _ => String::new(),
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
        let target = Target::of(path);
        let kind = match (&target, format) {
            (Target::Stdout, format) => format.map_or(Format::Png8, format_of),
            (Target::File(path), Some(format)) if path.extension().is_none() => format_of(format),
            (Target::File(path), _) => match Format::from_path(path) {
                Ok(kind) => kind,
                Err(e) if path.extension().is_none() => {
                    return usage(format!("{e}, or say the format with --format png, exr or hdr"));
                }
                Err(e) => return usage(e.to_string()),
            },
        };
        outputs.push(Output { target, format: with_bits(kind, bits), content: Content::Scene });
    }

    let to_stdout = outputs.iter().any(|output| output.target == Target::Stdout);
    if to_stdout && io::stdout().is_terminal() {
        return usage("-o - would write a picture to the terminal; send standard output to a file or program".into());
    }
    let without_ending = paths.iter().any(|path| path.extension().is_none());
    if format.is_some() && !without_ending {
        return usage("--format is for -o - and names without an ending; the ending of a file says its format".into());
    }
    let png = |output: &Output| matches!(output.format, Format::Png8 | Format::Png16);
    if bits.is_some() && !outputs.is_empty() && !outputs.iter().any(png) {
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
pub fn refuse_clashes(scene: Option<&Path>, outputs: &[Output], stats: Option<&Target>) -> Result<(), Failure> {
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
    let Some(stats) = stats else { return Ok(()) };
    let (name, place) = (stats.name(), stats.real());
    if scene.is_some_and(|scene| place == Target::File(scene)) {
        return usage(format!("--stats={name} would replace the scene's own file; name another"));
    }
    if seen.contains(&place) {
        return usage(format!("--stats={name} and -o name the same output; give each its own"));
    }
    Ok(())
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
        NamedFormat::Hdr => Format::Hdr,
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
    fn a_frame_has_its_number_in_its_name() {
        for (path, frame, expected) in [
            ("a.png", 1, "a.0001.png"),
            ("b/a.tar.png", 12345, "b/a.tar.12345.png"),
            ("out", 7, "out.0007"),
            ("a_###.exr", 7, "a_007.exr"),
            ("a_#.exr", 123, "a_123.exr"),
            ("#a##b.png", 5, "#a05b.png"),
            ("x#/a.png", 0, "x#/a.0000.png"),
            ("a.##", 3, "a.03"),
        ] {
            assert_eq!(with_frame(Path::new(path), frame), Path::new(expected), "{path}");
        }
    }
}
