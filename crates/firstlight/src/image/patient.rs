//! Writing to what can make its writer wait: pipes whose reader is late, terminals, sockets.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

/// How long to wait before `stop` is asked again.
const PAUSE: Duration = Duration::from_millis(20);

/// What a pipe with any room at all takes without making its writer wait, in bytes (POSIX promises 512, Linux 4096).
const PIECE: usize = if cfg!(target_os = "linux") { 4096 } else { 512 };

/// Writes to a file, pipe or terminal that is open, all of `bytes`, unless `stop` says so while its reader lets wait.
///
/// Where the system cannot tell whether a write would wait, as on Windows, `stop` is asked between pieces only.
///
/// # Errors
/// The system's; [`io::ErrorKind::Interrupted`] if it was stopped. A part of the bytes may have been written.
pub fn write_open(to: File, bytes: &[u8], stop: &dyn Fn() -> bool) -> io::Result<()> {
    let is_file = to.metadata().is_ok_and(|meta| meta.is_file());
    write_pieces(to, bytes, if is_file { 1 << 20 } else { PIECE }, stop)
}

/// The error of a writing that was stopped.
fn stopped() -> io::Error {
    io::Error::new(io::ErrorKind::Interrupted, "it was stopped")
}

#[cfg(unix)]
fn write_pieces(
    mut to: impl Write + std::os::fd::AsFd,
    mut bytes: &[u8],
    piece: usize,
    stop: &dyn Fn() -> bool,
) -> io::Result<()> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let pause = Timespec { tv_sec: 0, tv_nsec: PAUSE.subsec_nanos().into() };
    while !bytes.is_empty() {
        if stop() {
            return Err(stopped());
        }
        // A reader that is gone counts as ready: writing tells
        match poll(&mut [PollFd::new(&to, PollFlags::OUT)], Some(&pause)) {
            Ok(0) | Err(rustix::io::Errno::INTR) => continue,
            Ok(_) => {}
            Err(e) => return Err(e.into()),
        }
        match to.write(&bytes[..bytes.len().min(piece)]) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(written) => bytes = &bytes[written..],
            Err(e) if matches!(e.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => {}
            Err(e) => return Err(e),
        }
    }
    to.flush()
}

#[cfg(not(unix))]
fn write_pieces(mut to: impl Write, bytes: &[u8], piece: usize, stop: &dyn Fn() -> bool) -> io::Result<()> {
    for piece in bytes.chunks(piece) {
        if stop() {
            return Err(stopped());
        }
        to.write_all(piece)?;
    }
    to.flush()
}

/// Writes to a device, pipe or socket by its name. Appends, so that a program's output redirected to a file is not cut.
///
/// # Errors
/// Those of [`write_open`]; a pipe that nobody reads is waited for until `stop`.
#[cfg(unix)]
pub(super) fn write_to(to: &Path, bytes: &[u8], stop: &dyn Fn() -> bool) -> io::Result<()> {
    use rustix::fs::OFlags;
    use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
    let kind = std::fs::metadata(to)?.file_type();
    if kind.is_socket() {
        return write_pieces(std::os::unix::net::UnixStream::connect(to)?, bytes, PIECE, stop);
    }
    let mut options = File::options();
    options.append(true);
    if !kind.is_fifo() {
        return write_open(options.open(to)?, bytes, stop);
    }
    // Opened in the usual way, a pipe makes its writer wait for a reader, and nothing could stop that
    options.custom_flags(OFlags::NONBLOCK.bits() as i32);
    loop {
        match options.open(to) {
            Err(e) if e.raw_os_error() == Some(rustix::io::Errno::NXIO.raw_os_error()) => {
                if stop() {
                    return Err(stopped());
                }
                std::thread::sleep(PAUSE);
            }
            // What it can take at once is taken at once
            Ok(pipe) => return write_pieces(pipe, bytes, 1 << 20, stop),
            Err(e) => return Err(e),
        }
    }
}

#[cfg(not(unix))]
pub(super) fn write_to(to: &Path, bytes: &[u8], stop: &dyn Fn() -> bool) -> io::Result<()> {
    write_open(File::options().append(true).open(to)?, bytes, stop)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// Says stop when it is asked for the `n`th time.
    fn after(n: u32) -> impl Fn() -> bool {
        let asked = Cell::new(0);
        move || {
            asked.set(asked.get() + 1);
            asked.get() >= n
        }
    }

    #[test]
    fn a_pipe_that_nobody_empties_can_be_stopped() {
        let (reader, writer) = io::pipe().unwrap();
        let to = File::from(std::os::fd::OwnedFd::from(writer));
        let bytes = vec![7; 1 << 24];
        let error = write_open(to, &bytes, &after(30)).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::Interrupted);
        drop(reader);
    }

    #[test]
    fn a_slow_reader_gets_everything() {
        let (mut reader, writer) = io::pipe().unwrap();
        let to = File::from(std::os::fd::OwnedFd::from(writer));
        let bytes: Vec<u8> = (0..1_000_003_u32).map(|i| (i % 251) as u8).collect();
        let sent = bytes.clone();
        let writer = std::thread::spawn(move || write_open(to, &sent, &|| false));
        std::thread::sleep(Duration::from_millis(50));
        let mut got = Vec::new();
        io::Read::read_to_end(&mut reader, &mut got).unwrap();
        writer.join().unwrap().unwrap();
        assert!(got == bytes);
    }

    #[test]
    fn a_reader_that_is_gone_is_an_error() {
        let (reader, writer) = io::pipe().unwrap();
        drop(reader);
        let error = write_open(File::from(std::os::fd::OwnedFd::from(writer)), b"bytes", &|| false).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::BrokenPipe);
    }
}
