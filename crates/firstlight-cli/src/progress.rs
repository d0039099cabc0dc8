//! How far a render is: a bar on a terminal, a line now and then elsewhere.

use std::io::{self, IsTerminal};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use firstlight::{CompileStage, OnCompile};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::report::say;

/// Tells standard error what is read and built, where that takes more than a moment.
pub fn loading() -> OnCompile {
    let last = Mutex::new(Instant::now());
    OnCompile(Arc::new(move |stage| {
        // Who finds it taken goes on working
        let Ok(mut last) = last.try_lock() else { return };
        match stage {
            CompileStage::Reading { file, done, total } if last.elapsed() >= WORTH_A_LINE && done < total => {
                say(format_args!("reading {}: {} %", printable(file), done.saturating_mul(100) / total.max(1)));
            }
            CompileStage::Building { triangles } if triangles >= MANY_TRIANGLES => {
                say(format_args!("building the tree of {triangles} triangles"));
            }
            _ => return,
        }
        *last = Instant::now();
    }))
}

/// So many triangles take a second.
const MANY_TRIANGLES: u64 = 4_000_000;

/// A name that cannot disturb a terminal.
fn printable(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

/// Between two lines.
const PAUSE: Duration = Duration::from_secs(2);
/// A render that takes less is not worth a line.
const WORTH_A_LINE: Duration = Duration::from_secs(1);

/// Tells standard error how far a render is.
pub struct Progress {
    started: Instant,
    /// Pixels of one frame.
    frame: u64,
    frames: u64,
    /// Pixels of the frames before this one.
    before: AtomicU64,
    /// Pixels; calls from several threads may come out of order, and a bar that goes back frightens.
    most: AtomicU64,
    kind: Kind,
}

enum Kind {
    Silent,
    Bar(ProgressBar),
    /// When the last line was said.
    Lines(Mutex<Instant>),
}

impl Progress {
    /// Begins now, for `frames` pictures of `frame` pixels each.
    pub fn begin(frame: u64, frames: u64, quiet: bool) -> Self {
        let started = Instant::now();
        let kind = if quiet {
            Kind::Silent
        } else if io::stderr().is_terminal() {
            let bar = ProgressBar::with_draw_target(Some(frame * frames), ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("rendering {msg}{wide_bar} {percent:>3} %  {eta} left");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            // The time left goes on while a slow tile is at work
            bar.enable_steady_tick(Duration::from_millis(250));
            Kind::Bar(bar)
        } else {
            Kind::Lines(Mutex::new(started))
        };
        Self { started, frame, frames, before: AtomicU64::new(0), most: AtomicU64::new(0), kind }
    }

    /// Frame `index` of all, counted from 0, is next.
    pub fn frame(&self, index: u64) {
        self.before.store(index * self.frame, Ordering::Relaxed);
        if let (Kind::Bar(bar), 2..) = (&self.kind, self.frames) {
            bar.set_message(format!("{} of {} ", index + 1, self.frames));
        }
    }

    /// `done` pixels of this frame are there. For any thread, often.
    pub fn update(&self, done: u64) {
        let all = self.frame * self.frames;
        let done = self.before.load(Ordering::Relaxed) + done;
        let done = self.most.fetch_max(done, Ordering::Relaxed).max(done);
        match &self.kind {
            Kind::Silent => {}
            Kind::Bar(bar) => bar.set_position(done),
            Kind::Lines(last) => {
                // Who finds it taken goes on rendering
                let Ok(mut last) = last.try_lock() else { return };
                if last.elapsed() >= PAUSE && done < all {
                    *last = Instant::now();
                    say(format_args!("{}", line(done, all, self.started.elapsed())));
                }
            }
        }
    }

    /// Runs `f`, which may say something, without the bar in its way.
    pub fn aside<R>(&self, f: impl FnOnce() -> R) -> R {
        match &self.kind {
            Kind::Bar(bar) => bar.suspend(f),
            Kind::Silent | Kind::Lines(_) => f(),
        }
    }

    /// All pictures of that many columns and rows are there.
    pub fn finish(&self, width: u32, height: u32) {
        let took = self.started.elapsed();
        match &self.kind {
            Kind::Silent => {}
            Kind::Bar(bar) => bar.finish_and_clear(),
            Kind::Lines(_) if took < WORTH_A_LINE => {}
            Kind::Lines(_) => {
                let frames = if self.frames > 1 { format!("{} frames of ", self.frames) } else { String::new() };
                say(format_args!("rendered {frames}{width} x {height} pixels in {}", words(took)));
            }
        }
    }
}

/// However it ends, no bar stays behind.
impl Drop for Progress {
    fn drop(&mut self) {
        if let Kind::Bar(bar) = &self.kind {
            bar.finish_and_clear();
        }
    }
}

/// `rendered 40 %, about 12 s left`
fn line(done: u64, all: u64, took: Duration) -> String {
    let left = took.as_secs_f64() * all.saturating_sub(done) as f64 / done.max(1) as f64;
    let left = Duration::try_from_secs_f64(left).unwrap_or(Duration::MAX);
    format!("rendered {} %, about {} left", done.saturating_mul(100) / all.max(1), words(left))
}

/// `0.4 s`, `12 s`, `3 min 20 s`, `2 h 5 min`
pub fn words(time: Duration) -> String {
    let seconds = time.as_secs();
    match seconds {
        0..10 => format!("{:.1} s", time.as_secs_f64()),
        10..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        _ => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_said_in_words() {
        let say = |ms| words(Duration::from_millis(ms));
        assert_eq!([say(420), say(12_900), say(200_000), say(7_500_000)], ["0.4 s", "12 s", "3 min 20 s", "2 h 5 min"]);
    }

    #[test]
    fn a_line_says_how_much_and_how_long() {
        assert_eq!(line(40, 100, Duration::from_secs(8)), "rendered 40 %, about 12 s left");
        // Nothing done yet, or more than there is: still a line
        assert!(line(0, 100, Duration::from_secs(8)).starts_with("rendered 0 %"));
        assert!(line(u64::MAX, 0, Duration::MAX).starts_with("rendered"));
    }
}
