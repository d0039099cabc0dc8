//! Threads of the package's own, for every parallel call but renders, which begin threads for themselves; and what
//! keeps a process whole that is made by `os.fork`.
//!
//! The library's loops run in the pool of rayon that calls them. A child made by fork has a copy of the memory of its
//! parent, but none of its threads but one: whoever there waits for rayon's own pool, which is one for the process and
//! cannot be made anew, waits for ever. So all calls go through [`in_pool`], which makes a pool where the process is
//! another one. A lock that another thread held while the process was forked stays locked in the child, too: so what
//! takes locks does so [`at_work`], and Python, which calls [`before_fork`], waits until nobody is at work. Nothing at
//! work calls Python, so that wait ends; renders are not at work, as they hold no locks that outlive them.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// The pool, and the number of the process that it was made in.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// How many calls are at work, and from this bit on how many threads are about to fork. No lock, since that could be
/// held by a thread that a child does not have.
static STATE: AtomicU64 = AtomicU64::new(0);
const ONE_FORK: u64 = 1 << 32;
/// How long those wait who may not go on yet, before they look again.
const PAUSE: Duration = Duration::from_micros(100);

/// One call at work.
struct Work;

impl Work {
    /// Begins as soon as nobody is about to fork.
    fn begin() -> Self {
        loop {
            let now = STATE.load(Ordering::Acquire);
            let is_free = now < ONE_FORK;
            if is_free && STATE.compare_exchange_weak(now, now + 1, Ordering::AcqRel, Ordering::Relaxed).is_ok() {
                return Work;
            }
            if !is_free {
                std::thread::sleep(PAUSE);
            }
        }
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        STATE.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Runs `f`, which may take locks and does not call Python. Python's other threads run meanwhile, and no process is
/// forked. Not to be called within itself.
pub fn at_work<R: Send>(py: Python<'_>, f: impl FnOnce() -> R + Send) -> R {
    py.detach(|| {
        let _work = Work::begin();
        f()
    })
}

/// Runs `f` in the pool of this process, where the library's loops are shared by its threads. Locks that `f` shares
/// with other calls are to be taken before: a thread of the pool that waits within a loop may begin another call.
pub fn in_pool<R: Send>(f: impl FnOnce() -> R + Send) -> R {
    match own_pool() {
        Some(pool) => pool.install(f),
        // A system that gives no threads
        None => f(),
    }
}

/// Both of them.
pub fn run<R: Send>(py: Python<'_>, f: impl FnOnce() -> R + Send) -> R {
    at_work(py, || in_pool(f))
}

fn own_pool() -> Option<Arc<ThreadPool>> {
    let process = std::process::id();
    let kept = &mut *POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, pool)) = kept.as_ref().filter(|(own, _)| *own == process) {
        return Some(pool.clone());
    }
    let pool = Arc::new(ThreadPoolBuilder::new().thread_name(|i| format!("firstlight-{i}")).build().ok()?);
    // That of a parent is left as it is: to end it would be to wait for its threads, which are not here
    std::mem::forget(kept.replace((process, pool.clone())));
    Some(pool)
}

/// Waits until nobody is at work, and lets nobody begin.
#[pyfunction(name = "_before_fork")]
pub fn before_fork(py: Python<'_>) {
    STATE.fetch_add(ONE_FORK, Ordering::AcqRel);
    py.detach(|| {
        while STATE.load(Ordering::Acquire) & (ONE_FORK - 1) != 0 {
            std::thread::sleep(PAUSE);
        }
    });
}

/// Lets the parent go on.
#[pyfunction(name = "_after_fork_in_parent")]
pub fn after_fork_in_parent() {
    STATE.fetch_sub(ONE_FORK, Ordering::AcqRel);
}

/// Lets the child begin: nobody else is there.
#[pyfunction(name = "_after_fork_in_child")]
pub fn after_fork_in_child() {
    STATE.store(0, Ordering::Release);
}
