//! Ctrl-C, and other programs that ask this one to stop.
//!
//! A render is stopped between tiles. Where there is nothing to tidy up, as while a scene is read, the program ends at
//! once, as it does on the second request. Before the first file appears under its name a request still stops all of
//! them; after that it comes too late, and the program ends as if there had been none.

use std::ops::ControlFlow;
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

/// Takes SIGINT, SIGTERM and SIGHUP (Ctrl-C and closing on Windows). Where one of them is ignored from outside, as
/// `nohup` and background jobs have it, all stay as they are: the system's own way leaves no half file either.
pub fn install() {
    let _ = ctrlc::try_set_handler(|| {
        let watched = WATCHED.load(Ordering::SeqCst);
        if REQUESTED.swap(true, Ordering::SeqCst) || !watched {
            std::process::exit(130);
        }
    });
}
