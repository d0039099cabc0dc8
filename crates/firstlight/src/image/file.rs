//! Writing files whole or not at all.
//!
//! A file is written under another name in the same folder, brought to the disk, and renamed over its target: whoever
//! opens the target, whenever, finds the old file or the new one. An error removes the other name again. Only a process
//! that is killed between can leave it behind, as `.firstlight-XXXXXX.tmp`.
//!
//! A file with several names (hard links) keeps its old contents under the others, as with every program that renames.

use std::fs::{self, Permissions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::ImageError;

/// How a file was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    /// Whole, by renaming.
    Whole,
    /// Into a device, pipe, socket or open file of a process, which cannot be replaced.
    Direct,
}

/// A file that is to be written, once it is known that it can be: for programs that work long and write at the end.
#[derive(Clone, Debug)]
pub struct PendingFile {
    /// As it was named.
    path: PathBuf,
    /// The same from the root, whatever the working folder will be.
    absolute: PathBuf,
}

/// A file whose bytes are on the disk, but not yet under its name. Dropping it leaves things as they were.
#[derive(Debug)]
pub struct StagedFile<'a> {
    path: PathBuf,
    target: Target,
    contents: Contents<'a>,
}

#[derive(Debug)]
enum Contents<'a> {
    Temporary(NamedTempFile),
    Bytes(&'a [u8]),
}

/// Where the bytes go in the end.
#[derive(Clone, Debug)]
enum Target {
    /// A name that a file can be renamed to, no longer a link; the permissions of the file there.
    Name(PathBuf, Option<Permissions>),
    /// Something that can only be written to.
    Direct(PathBuf),
}

/// Writes a file, whole or not at all: a temporary file beside the target, then renamed.
///
/// A new file gets the permissions that every new file gets, a replaced one keeps its own. Of a link, what it points to is
/// replaced or made, and the link stays. A device, pipe, socket, or a process's open file (`/dev/stdout`) cannot be
/// replaced and is written to directly.
///
/// # Errors
/// [`ImageError::NoFolder`], [`ImageError::IsFolder`], [`ImageError::ReadOnly`] and [`ImageError::Write`], all with `path`.
/// A file that was there is then still there, unchanged.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<Written, ImageError> {
    PendingFile::unchecked(path)?.stage(bytes)?.commit()
}

impl PendingFile {
    /// Checks that a file can be written: its folder is there and takes new files, and nothing else has its name.
    /// Nothing is left in the folder. A device or pipe is not opened, since that can block.
    ///
    /// # Errors
    /// Those of [`write_whole`].
    pub fn new(path: &Path) -> Result<Self, ImageError> {
        let pending = Self::unchecked(path)?;
        if let Target::Name(name, _) = resolve(path, &pending.absolute)? {
            temporary(&name).map_err(|e| refused(path, e))?;
        }
        Ok(pending)
    }

    fn unchecked(path: &Path) -> Result<Self, ImageError> {
        if path.as_os_str().is_empty() {
            return Err(ImageError::IsFolder { path: path.to_path_buf() });
        }
        let absolute = std::path::absolute(path).map_err(|e| refused(path, e))?;
        Ok(Self { path: path.to_path_buf(), absolute })
    }

    /// The file, as it was named.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes `bytes` beside the target; all that is left to do is to rename it. So several files can be brought to the
    /// disk before the first of them appears. What can only be written to directly waits for [`StagedFile::commit`].
    ///
    /// # Errors
    /// Those of [`write_whole`].
    pub fn stage(self, bytes: &[u8]) -> Result<StagedFile<'_>, ImageError> {
        let Self { path, absolute } = self;
        let target = resolve(&path, &absolute)?;
        let contents = match &target {
            Target::Direct(_) => Contents::Bytes(bytes),
            Target::Name(name, permissions) => {
                let fill = || {
                    let mut file = temporary(name)?;
                    file.write_all(bytes)?;
                    if let Some(permissions) = permissions {
                        file.as_file().set_permissions(permissions.clone())?;
                    }
                    // Without this a crash of the machine may keep the new name and lose the contents
                    file.as_file().sync_data()?;
                    Ok(file)
                };
                Contents::Temporary(fill().map_err(|e| refused(&path, e))?)
            }
        };
        Ok(StagedFile { path, target, contents })
    }

    /// Writes the file, as [`write_whole`] does.
    ///
    /// # Errors
    /// Those of [`write_whole`].
    pub fn commit(self, bytes: &[u8]) -> Result<Written, ImageError> {
        self.stage(bytes)?.commit()
    }
}

impl StagedFile<'_> {
    /// Gives the file its name.
    ///
    /// # Errors
    /// Those of [`write_whole`].
    pub fn commit(self) -> Result<Written, ImageError> {
        let Self { path, target, contents } = self;
        match (target, contents) {
            (Target::Name(name, _), Contents::Temporary(file)) => {
                // On failure the error holds the temporary file, and dropping it removes it
                file.persist(name).map_err(|e| refused(&path, e.error))?;
                Ok(Written::Whole)
            }
            (Target::Name(to, _) | Target::Direct(to), Contents::Bytes(bytes)) => {
                write_direct(&to, bytes).map_err(|e| refused(&path, e))?;
                Ok(Written::Direct)
            }
            (Target::Direct(_), Contents::Temporary(_)) => unreachable!("`stage` makes no temporary file for it"),
        }
    }
}

/// Finds where `absolute` leads, without changing anything.
fn resolve(path: &Path, absolute: &Path) -> Result<Target, ImageError> {
    let folder = || ImageError::IsFolder { path: path.to_path_buf() };
    // "out/" and "out/.." name no file, whether or not they exist
    let ends_in_separator =
        path.as_os_str().as_encoded_bytes().last().is_some_and(|&b| std::path::is_separator(b.into()));
    if ends_in_separator || absolute.file_name().is_none() {
        return Err(folder());
    }
    // See what is there, through all links
    let there = match fs::metadata(absolute) {
        Ok(meta) => Some(meta),
        Err(e) if e.kind() == io::ErrorKind::NotFound => None,
        Err(e) => return Err(refused(path, e)),
    };
    match &there {
        Some(meta) if meta.is_dir() => return Err(folder()),
        Some(meta) if !meta.is_file() => return Ok(Target::Direct(absolute.to_path_buf())),
        _ => {}
    }
    // Follow links one by one, since the last may point to nothing yet
    let mut at = absolute.to_path_buf();
    for _ in 0..40 {
        let parent = at.parent().unwrap_or(Path::new("/"));
        let real = match parent.canonicalize() {
            Ok(real) => real,
            Err(e) if e.kind() == io::ErrorKind::NotFound => {
                return Err(ImageError::NoFolder { path: path.to_path_buf(), folder: parent.to_path_buf() });
            }
            Err(e) => return Err(refused(path, e)),
        };
        // What stands for an open file of a process is not a name that can be replaced
        if cfg!(target_os = "linux") && real.starts_with("/proc") {
            return Ok(Target::Direct(absolute.to_path_buf()));
        }
        let Some(name) = at.file_name() else { return Err(folder()) };
        let here = real.join(name);
        if fs::symlink_metadata(&here).is_ok_and(|m| m.is_symlink()) {
            at = real.join(fs::read_link(&here).map_err(|e| refused(path, e))?);
            continue;
        }
        let permissions = there.map(|meta| meta.permissions());
        // Renaming would not ask; whoever protected the file meant it
        if permissions.as_ref().is_some_and(Permissions::readonly) {
            return Err(ImageError::ReadOnly { path: path.to_path_buf() });
        }
        return Ok(Target::Name(here, permissions));
    }
    Err(refused(path, io::Error::other("too many links")))
}

/// An empty file in the folder of `name`, removed when dropped, with the permissions that new files have.
fn temporary(name: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".firstlight-").suffix(".tmp");
    // The system takes away from these what its user wants taken away
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(name.parent().unwrap_or(Path::new("/")));
    // Its name is of no interest in an error
    file.map_err(|e| e.raw_os_error().map(io::Error::from_raw_os_error).unwrap_or(e))
}

/// Writes to what cannot be replaced. Appends, so that a program's output redirected to a file is not cut.
fn write_direct(to: &Path, bytes: &[u8]) -> io::Result<()> {
    #[cfg(unix)]
    if std::os::unix::fs::FileTypeExt::is_socket(&fs::metadata(to)?.file_type()) {
        let mut socket = std::os::unix::net::UnixStream::connect(to)?;
        socket.write_all(bytes)?;
        return socket.flush();
    }
    let mut file = fs::OpenOptions::new().append(true).open(to)?;
    file.write_all(bytes)?;
    file.flush()
}

fn refused(path: &Path, source: io::Error) -> ImageError {
    ImageError::Write { path: path.to_path_buf(), source }
}
