//! Writing files whole or not at all.
//!
//! A file is written under another name in the same folder, brought to the disk, and renamed over its target: whoever
//! opens the target, whenever, finds the old file or the new one. An error removes the other name again. Only a process
//! that is killed between can leave it behind, as `.firstlight-XXXXXX.tmp`.
//!
//! A file with several names (hard links) keeps its old contents under the others, as with every program that renames.

use std::fs::{self, File, Permissions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::{ImageError, patient};

/// How a file was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    /// Whole, by renaming, where there was no file.
    Whole,
    /// Whole, by renaming, in place of a file that was there.
    Replaced,
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
    /// As it was named.
    path: PathBuf,
    rest: Rest<'a>,
}

/// What is left to do.
#[derive(Debug)]
enum Rest<'a> {
    /// Rename it to this.
    Rename(NamedTempFile, PathBuf),
    /// Write these to this.
    Write(&'a [u8], PathBuf),
}

/// Where the bytes go in the end.
#[derive(Clone, Debug)]
enum Destination {
    /// A name that a file can be renamed to, no longer a link; the permissions of the file there.
    Name(PathBuf, Option<Permissions>),
    /// Something that can only be written to.
    Direct(PathBuf),
}

/// Writes a file, whole or not at all: a temporary file beside the target, then renamed.
///
/// A new file gets the permissions that every new file gets, a replaced one keeps its own. Of a link, what it points to
/// is replaced or made, and the link stays. A device, pipe, socket, or a process's open file (`/dev/stdout`) cannot be
/// replaced and is written to directly.
///
/// # Errors
/// [`ImageError::NoFolder`], [`ImageError::IsFolder`], [`ImageError::ReadOnly`] and [`ImageError::Write`], all with
/// `path`. A file that was there is then still there, unchanged.
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
        if let Destination::Name(name, _) = resolve(path, &pending.absolute)? {
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
        let rest = match resolve(&path, &absolute)? {
            Destination::Direct(to) => Rest::Write(bytes, to),
            Destination::Name(name, permissions) => {
                let fill = || {
                    let mut file = temporary(&name)?;
                    // By itself, for its errors name the file that is asked for, not this one
                    file.as_file_mut().write_all(bytes)?;
                    if let Some(permissions) = permissions {
                        file.as_file().set_permissions(permissions)?;
                    }
                    // Without this a crash of the machine may keep the new name and lose the contents
                    file.as_file().sync_data()?;
                    Ok(file)
                };
                Rest::Rename(fill().map_err(|e| refused(&path, e))?, name)
            }
        };
        Ok(StagedFile { path, rest })
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
        self.commit_unless(&|| false)
    }

    /// The same, unless `stop` says so while a device, pipe or socket lets wait. Such a one should come before the
    /// files that are staged with it, so that all of them or none appear.
    ///
    /// # Errors
    /// Those of [`write_whole`], and [`ImageError::Stopped`].
    pub fn commit_unless(self, stop: &dyn Fn() -> bool) -> Result<Written, ImageError> {
        let Self { path, rest } = self;
        match rest {
            Rest::Rename(file, name) => {
                let replaced = fs::symlink_metadata(&name).is_ok();
                // On failure the error holds the temporary file, and dropping it removes it
                file.persist(name).map_err(|e| refused(&path, e.error))?;
                Ok(if replaced { Written::Replaced } else { Written::Whole })
            }
            Rest::Write(bytes, to) => match patient::write_to(&to, bytes, stop) {
                Ok(()) => Ok(Written::Direct),
                Err(e) if e.kind() == io::ErrorKind::Interrupted => Err(ImageError::Stopped { path }),
                Err(e) => Err(refused(&path, e)),
            },
        }
    }

    /// Whether it is a device, pipe or socket, which is written to directly.
    pub fn is_direct(&self) -> bool {
        matches!(self.rest, Rest::Write(..))
    }
}

/// Finds where `absolute` leads, without changing anything.
fn resolve(path: &Path, absolute: &Path) -> Result<Destination, ImageError> {
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
        Some(meta) if !meta.is_file() => return Ok(Destination::Direct(absolute.to_path_buf())),
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
            return Ok(Destination::Direct(absolute.to_path_buf()));
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
        return Ok(Destination::Name(here, permissions));
    }
    Err(refused(path, io::Error::other("too many links")))
}

/// An empty file in the folder of `name`, removed when dropped, with the permissions that new files have.
fn temporary(name: &Path) -> io::Result<NamedTempFile> {
    let folder = name.parent().unwrap_or(Path::new("/"));
    tempfile::Builder::new().prefix(".firstlight-").suffix(".tmp").make_in(folder, |path| {
        let mut options = File::options();
        options.write(true).create_new(true);
        // The system takes away from these what its user wants taken away
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o666);
        options.open(path)
    })
}

fn refused(path: &Path, source: io::Error) -> ImageError {
    ImageError::Write { path: path.to_path_buf(), source }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names in a folder.
    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn words(path: &Path) -> String {
        let checked = PendingFile::new(path).unwrap_err().to_string();
        let written = write_whole(path, b"new").unwrap_err().to_string();
        assert_eq!(checked, written);
        written
    }

    #[test]
    fn makes_and_replaces() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        assert_eq!(write_whole(&path, b"one").unwrap(), Written::Whole);
        assert_eq!(fs::read(&path).unwrap(), b"one");
        assert_eq!(write_whole(&path, b"").unwrap(), Written::Replaced);
        assert_eq!(fs::read(&path).unwrap(), b"");
        assert_eq!(names(folder.path()), ["a.png"]);
    }

    #[test]
    fn checking_leaves_nothing_and_keeps_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        fs::write(&path, b"old").unwrap();
        let pending = PendingFile::new(&path).unwrap();
        let other = PendingFile::new(&folder.path().join("b.png")).unwrap();
        assert_eq!(names(folder.path()), ["a.png"]);
        // Staged files are there, but not under their names; dropped ones go
        let staged = pending.clone().stage(b"new").unwrap();
        assert_eq!(names(folder.path()).len(), 2);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        drop(staged);
        assert_eq!(names(folder.path()), ["a.png"]);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        let staged = [pending.stage(b"new").unwrap(), other.stage(b"b").unwrap()];
        for file in staged {
            file.commit().unwrap();
        }
        assert_eq!(names(folder.path()), ["a.png", "b.png"]);
        assert_eq!(fs::read(&path).unwrap(), b"new");
    }

    #[test]
    fn what_cannot_be_a_file_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let missing = at("none/a.png");
        assert_eq!(
            words(&missing),
            format!("{}: there is no folder {}; create it first", missing.display(), at("none").display())
        );
        for name in [folder.path().to_path_buf(), at("a.png/"), at(".."), PathBuf::new(), PathBuf::from("/")] {
            assert!(words(&name).ends_with(": is a folder, not a file; add a file's name"), "{name:?}");
        }
        fs::write(at("file"), b"old").unwrap();
        assert!(words(&at("file/a.png")).contains("cannot be written"));
        let long = words(&at(&"n".repeat(300)));
        assert!(long.contains("cannot be written") && long.ends_with("choose a shorter or simpler name"), "{long}");
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn a_folder_that_goes_away_is_an_error_with_the_path() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("inner");
        fs::create_dir(&inner).unwrap();
        let pending = PendingFile::new(&inner.join("a.png")).unwrap();
        fs::remove_dir(&inner).unwrap();
        assert!(matches!(pending.commit(b"new"), Err(ImageError::NoFolder { .. })));
        // A folder that has taken the name in the meantime stays
        let pending = PendingFile::new(&inner).unwrap();
        let staged = pending.stage(b"new").unwrap();
        fs::create_dir(&inner).unwrap();
        assert!(matches!(staged.commit(), Err(ImageError::Write { .. })));
        assert_eq!(names(folder.path()), ["inner"]);
    }

    #[cfg(unix)]
    mod unix {
        use super::*;
        use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

        fn mode(path: &Path) -> u32 {
            fs::metadata(path).unwrap().mode() & 0o7777
        }

        fn set_mode(path: &Path, mode: u32) {
            fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
        }

        #[test]
        fn permissions_are_those_of_a_new_file_or_of_the_old() {
            let folder = tempfile::tempdir().unwrap();
            let (path, plain) = (folder.path().join("a.png"), folder.path().join("plain"));
            fs::write(&plain, b"").unwrap();
            write_whole(&path, b"1").unwrap();
            assert_eq!(mode(&path), mode(&plain));
            set_mode(&path, 0o640);
            write_whole(&path, b"2").unwrap();
            assert_eq!(mode(&path), 0o640);
            // A protected file is left alone
            set_mode(&path, 0o444);
            assert!(words(&path).ends_with("is read-only; make it writable, or choose another name"));
            assert_eq!(fs::read(&path).unwrap(), b"2");
        }

        #[test]
        fn links_stay_and_what_they_point_to_is_replaced() {
            let folder = tempfile::tempdir().unwrap();
            let at = |name: &str| folder.path().join(name);
            fs::create_dir(at("real")).unwrap();
            fs::write(at("real/a.png"), b"old").unwrap();
            // A link to a link, both relative to their own folders
            symlink("../real/a.png", at("real/second")).unwrap();
            symlink("real/second", at("first")).unwrap();
            assert_eq!(write_whole(&at("first"), b"new").unwrap(), Written::Replaced);
            assert_eq!(fs::read(at("real/a.png")).unwrap(), b"new");
            assert!(fs::symlink_metadata(at("first")).unwrap().is_symlink());
            assert!(fs::symlink_metadata(at("real/second")).unwrap().is_symlink());
            // A link to nothing
            symlink("real/b.png", at("dangling")).unwrap();
            assert_eq!(write_whole(&at("dangling"), b"b").unwrap(), Written::Whole);
            assert_eq!(fs::read(at("real/b.png")).unwrap(), b"b");
            assert_eq!(names(&at("real")), ["a.png", "b.png", "second"]);
            // A link into nowhere, a link to a folder, and one that leads in a circle
            symlink("none/b.png", at("nowhere")).unwrap();
            assert!(words(&at("nowhere")).contains("there is no folder"));
            symlink("real", at("folder")).unwrap();
            assert!(words(&at("folder")).contains("is a folder"));
            symlink("circle", at("circle")).unwrap();
            assert!(words(&at("circle")).contains("cannot be written"));
        }

        #[test]
        fn a_folder_that_may_not_be_written_to() {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a.png");
            fs::write(&path, b"old").unwrap();
            set_mode(folder.path(), 0o555);
            // Nothing stops the system's administrator
            if fs::write(folder.path().join("probe"), b"").is_err() {
                assert!(words(&path).ends_with("choose a folder that you may write to, or change its permissions"));
                assert_eq!(fs::read(&path).unwrap(), b"old");
            }
            set_mode(folder.path(), 0o755);
        }

        #[test]
        fn a_device_is_written_to() {
            let path = Path::new("/dev/null");
            PendingFile::new(path).unwrap();
            assert_eq!(write_whole(path, b"bytes").unwrap(), Written::Direct);
            // Still a device
            assert!(!fs::metadata(path).unwrap().is_file());
        }

        #[cfg(target_os = "linux")]
        #[test]
        fn a_full_disk_is_said() {
            let path = Path::new("/dev/full");
            let pending = PendingFile::new(path).unwrap();
            let fault = pending.commit(b"bytes").unwrap_err().to_string();
            assert!(fault.starts_with("/dev/full: cannot be written: "), "{fault}");
            assert!(fault.ends_with("; free some space, or write elsewhere"), "{fault}");
        }

        #[cfg(target_os = "linux")]
        #[test]
        fn a_file_that_a_process_has_open_is_appended_to() {
            use std::os::fd::AsRawFd;
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("log");
            let mut open = fs::File::create(&path).unwrap();
            open.write_all(b"before ").unwrap();
            let standing_for_it = PathBuf::from(format!("/dev/fd/{}", open.as_raw_fd()));
            assert_eq!(write_whole(&standing_for_it, b"after").unwrap(), Written::Direct);
            assert_eq!(fs::read(&path).unwrap(), b"before after");
        }

        #[test]
        fn a_socket_gets_the_bytes() {
            use std::io::Read;
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("socket");
            let listener = std::os::unix::net::UnixListener::bind(&path).unwrap();
            let reader = std::thread::spawn(move || {
                let mut bytes = Vec::new();
                listener.accept().unwrap().0.read_to_end(&mut bytes).unwrap();
                bytes
            });
            assert_eq!(write_whole(&path, b"bytes").unwrap(), Written::Direct);
            assert_eq!(reader.join().unwrap(), b"bytes");
        }

        #[test]
        fn a_pipe_gets_the_bytes() {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("pipe");
            if !std::process::Command::new("mkfifo").arg(&path).status().is_ok_and(|s| s.success()) {
                return; // no such program here
            }
            // Checking it waits for nobody, and who waits for a reader can be stopped
            let pending = PendingFile::new(&path).unwrap();
            let asked = std::cell::Cell::new(0);
            let third = || asked.replace(asked.get() + 1) == 3;
            let staged = pending.clone().stage(b"bytes").unwrap();
            assert!(staged.is_direct());
            let words = staged.commit_unless(&third).unwrap_err().to_string();
            assert_eq!(words, format!("{}: was stopped while it was written", path.display()));
            let from = path.clone();
            let reader = std::thread::spawn(move || fs::read(from).unwrap());
            assert_eq!(pending.commit(b"bytes").unwrap(), Written::Direct);
            assert_eq!(reader.join().unwrap(), b"bytes");
            assert_eq!(names(folder.path()), ["pipe"]);
        }
    }
}
