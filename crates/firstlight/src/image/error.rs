//! Why a picture could not be written or read.

use std::io;
use std::path::PathBuf;

use super::Format;

/// Why a picture could not be written or read, with what is allowed and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The ending of a file's name is not that of a picture.
    #[error("{}: {}; use .png, .jpg, .exr, .npz, .npy or .hdr", path.display(), ending(path))]
    UnknownEnding {
        /// The file's name.
        path: PathBuf,
    },
    /// The program was built without EXR.
    #[error(
        "this build of firstlight has no EXR; use .png, .jpg, .npz, .npy or .hdr, or build it with the feature `exr`"
    )]
    WithoutExr,
    /// An [`Image`](super::Image) whose pixels do not fill its window, or whose window is not in its film.
    #[error("{0}")]
    Picture(String),
    /// A format that holds one buffer, where several are to go.
    #[error("{} file holds one buffer; several go to .exr and .npz files", a(*format))]
    OneBuffer {
        /// PNG, JPEG, HDR or NPY.
        format: Format,
    },
    /// A buffer whose numbers a format cannot hold.
    #[error("{} file cannot hold {buffer}: {reason}; .exr, .npz and .npy files can", a(*format))]
    NotHeld {
        /// PNG, JPEG or HDR.
        format: Format,
        /// The buffer's name.
        buffer: String,
        /// What of it does not fit.
        reason: String,
    },
    /// A buffer whose name a format cannot hold.
    #[error("{} file cannot hold it: {reason}", a(*format))]
    Name {
        /// EXR or NPZ.
        format: Format,
        /// Which, and what to do.
        reason: String,
    },
    /// A [`FileSettings::depth_scale`](super::FileSettings::depth_scale) outside what it may be.
    #[error("the depth scale is {0}; units per metre are needed, from 0.001 to 1000000")]
    DepthScale(f64),
    /// A [`FileSettings::jpeg_quality`](super::FileSettings::jpeg_quality) outside what it may be.
    #[error("the quality is {0}; that of a JPEG file is 1 to 100")]
    JpegQuality(u8),
    /// A [`Display`](crate::Display) outside what it may be.
    #[error("{0}")]
    Display(String),
    /// A [`Receipt`](super::Receipt) that a file cannot hold.
    #[error("receipt key {key:?} {fault}")]
    Receipt {
        /// The entry's key.
        key: String,
        /// What is wrong, and what is allowed.
        fault: &'static str,
    },
    /// A library failed to encode the picture.
    #[error("cannot be encoded as {format}: {reason}")]
    Encode {
        /// `PNG`, `JPEG`, `EXR` or `HDR`.
        format: &'static str,
        /// The library's words.
        reason: String,
    },

    /// The folder that is to hold a file does not exist.
    #[error("{}: there is no folder {}; create it first", path.display(), folder.display())]
    NoFolder {
        /// The file, as it was named.
        path: PathBuf,
        /// What is missing.
        folder: PathBuf,
    },
    /// A folder stands where a file is to be written, or the path names no file.
    #[error("{}: is a folder, not a file; add a file's name", path.display())]
    IsFolder {
        /// The file, as it was named.
        path: PathBuf,
    },
    /// There is a file of that name already which must not be changed.
    #[error("{}: is read-only; make it writable, or choose another name", path.display())]
    ReadOnly {
        /// The file, as it was named.
        path: PathBuf,
    },
    /// The system refused.
    #[error("{}: cannot be written: {source}{}", path.display(), advice(source))]
    Write {
        /// The file, as it was named.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },

    /// Stopped while a device, pipe or socket let wait; it may have got a part.
    #[error("{}: was stopped while it was written", path.display())]
    Stopped {
        /// The file, as it was named.
        path: PathBuf,
    },

    /// Bytes that are no picture of a known kind.
    #[error("is not a {expected} file; convert it to one")]
    UnknownKind {
        /// The kinds that are read.
        expected: &'static str,
    },
    /// A picture larger than may be read.
    #[error("is {width} x {height}, the limits are {side} a side and {texels} in all; make it smaller")]
    TooLarge {
        /// Its width, as its header says.
        width: u32,
        /// Its height, as its header says.
        height: u32,
        /// The limit of each side.
        side: u32,
        /// The limit of all its pixels together.
        texels: u64,
    },
    /// A picture that is broken or cut off.
    #[error("is a damaged {format} file: {reason}; write or fetch it anew")]
    Damaged {
        /// `PNG`, `JPEG`, `EXR` or `HDR`.
        format: &'static str,
        /// What is wrong with it.
        reason: String,
    },
}

/// The format with its article.
fn a(format: Format) -> &'static str {
    match format {
        Format::Png8 | Format::Png16 => "a PNG",
        Format::Exr => "an EXR",
        Format::Npz => "an NPZ",
        Format::Npy => "an NPY",
        Format::Hdr => "an HDR",
        Format::Jpeg => "a JPEG",
    }
}

/// The fault of a file's ending, with its value.
fn ending(path: &std::path::Path) -> String {
    match path.extension() {
        Some(ending) => format!("\".{}\" is not the ending of a picture", ending.display()),
        None => "has no ending that says which kind of picture to write".into(),
    }
}

/// What to do about an error of the system, if that can be said.
fn advice(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "; free some space, or write elsewhere",
        io::ErrorKind::FileTooLarge => "; raise the limit on the size of files (ulimit -f), or write a smaller picture",
        io::ErrorKind::PermissionDenied => "; choose a folder that you may write to, or change its permissions",
        io::ErrorKind::ReadOnlyFilesystem => "; choose a folder that can be written to",
        io::ErrorKind::InvalidFilename => "; choose a shorter or simpler name",
        io::ErrorKind::BrokenPipe => "; what was to read it has ended",
        io::ErrorKind::NotADirectory => "; a part of the path is a file, not a folder",
        _ => "",
    }
}
