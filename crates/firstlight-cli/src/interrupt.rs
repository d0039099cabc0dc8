//! Ctrl-C, and other programs that ask this one to stop.
//!
//! A render is stopped between tiles. Where there is nothing to tidy up, as while a scene is read, the program ends at
//! once, as it does on the second request. Before the first file appears under its name a request still stops all of
//! them; after that it comes too late, and the program ends as if there had been none. Devices and pipes come before
//! files, and a request ends the wait for their readers.

use std::ops::ControlFlow;
#[cfg(unix)]
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::report::Failure;

/// Whether somebody looks at `REQUESTED` from time to time.
static WATCHED: AtomicBool = AtomicBool::new(false);
static REQUESTED: AtomicBool = AtomicBool::new(false);

/// From now until the value is dropped, the first request to stop is kept for [`requested`].
pub struct Watch(());

impl Watch {
    /// Begins to watch.
    pub fn begin() -> Self {
        WATCHED.store(true, Ordering::SeqCst);
        Watch(())
    }

    /// # Errors
    /// `Interrupted` once a request has come.
    pub fn check(&self) -> Result<(), Failure> {
        if REQUESTED.load(Ordering::SeqCst) { Err(Failure::Interrupted) } else { Ok(()) }
    }

    /// The same, for the renderer.
    pub fn flow(&self) -> ControlFlow<()> {
        if REQUESTED.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        WATCHED.store(false, Ordering::SeqCst);
    }
}

/// Takes SIGINT, SIGTERM and SIGHUP (Ctrl-C and closing on Windows), and lets a limit on the size of files be an error
/// of writing like any other. What is ignored from outside, as `nohup` and background jobs have it, stays ignored.
pub fn install() {
    // Refuses where one of the three is ignored, or taken already
    if ctrlc::try_set_handler(on_request).is_err() {
        take_those_not_ignored();
    }
    // Taken, it does not end the program, and the write fails; nobody asks whether it came
    #[cfg(unix)]
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// What a request does, on a thread of its own.
fn on_request() {
    // In this order: who begins to watch after nobody did finds the request before there is anything to tidy up
    let again = REQUESTED.swap(true, Ordering::SeqCst);
    if again || !WATCHED.load(Ordering::SeqCst) {
        std::process::exit(130);
    }
}

#[cfg(not(unix))]
fn take_those_not_ignored() {}

#[cfg(unix)]
fn take_those_not_ignored() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let ignored = ignored_signals();
    let others = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| !ignored.contains(signal));
    let Ok(mut signals) = signal_hook::iterator::Signals::new(others) else { return };
    let _ = std::thread::Builder::new().name("signals".into()).spawn(move || {
        for _ in signals.forever() {
            on_request();
        }
    });
}

/// The signals that are ignored from outside. Where the system does not tell, those that shells ignore for their
/// background jobs and `nohup`.
#[cfg(unix)]
fn ignored_signals() -> Vec<i32> {
    let told = || {
        let status = std::fs::read_to_string("/proc/self/status").ok()?;
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
        let mask = u64::from_str_radix(mask.trim(), 16).ok()?;
        Some((1..=64).filter(|signal| mask >> (signal - 1) & 1 == 1).collect())
    };
    told().unwrap_or_else(|| vec![signal_hook::consts::SIGINT, signal_hook::consts::SIGHUP])
}
