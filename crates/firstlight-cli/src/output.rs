//! Where pictures go: files, whole or absent, and standard output.

use std::fs;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use firstlight::{Format, ImageError, PendingFile, StagedFile, Written};

use crate::args::{Bits, NamedFormat};
use crate::report::{Failure, say};

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
                    say(format_args!("wrote {}{}", path.display(), aside(&path, written)));
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

/// What else there is to say of a file that was written: nothing, for a plain file.
fn aside(path: &Path, written: Written) -> String {
    if written == Written::Direct {
        return " directly: a device or pipe is not replaced as a whole".into();
    }
    let is_link = fs::symlink_metadata(path).is_ok_and(|meta| meta.is_symlink());
    match path.canonicalize() {
        Ok(real) if is_link => format!(", a link: {} was replaced", real.display()),
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
    let mut seen: Vec<PathBuf> = Vec::new();
    for path in paths {
        let target = Target::of(path);
        let full = std::path::absolute(path).unwrap_or_else(|_| path.clone());
        if seen.contains(&full) {
            return usage(format!("-o {} is given twice", path.display()));
        }
        seen.push(full);
        let kind = match (&target, format) {
            (Target::Stdout, format) => format.map_or(Format::Png8, format_of),
            (Target::File(path), Some(format)) if path.extension().is_none() => format_of(format),
            (Target::File(path), _) => match Format::from_path(path) {
                Ok(kind) => kind,
                Err(e) => return usage(e.to_string()),
            },
        };
        outputs.push(Output { target, format: with_bits(kind, bits) });
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
