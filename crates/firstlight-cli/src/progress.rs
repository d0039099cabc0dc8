//! How far a render is: a bar on a terminal, a line now and then elsewhere.

use std::fmt;
use std::io::{self, IsTerminal};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use firstlight::{CompileStage, OnCompile};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use crate::report::say;

/// Tells standard error what is read and built, where that takes more than a moment.
pub fn loading() -> OnCompile {
    let next = Mutex::new(Instant::now() + WORTH_A_LINE);
    OnCompile(Arc::new(move |stage| {
        // Who finds it taken goes on working
        let Ok(mut next) = next.try_lock() else { return };
        match stage {
            CompileStage::Reading { file, done, total } if Instant::now() >= *next && done < total => {
                say(format_args!("reading {}: {} %", printable(file), done.saturating_mul(100) / total.max(1)));
            }
            CompileStage::Building { triangles } if triangles >= MANY_TRIANGLES => {
                say(format_args!("building the tree of {triangles} triangles"));
            }
            _ => return,
        }
        *next = Instant::now() + PAUSE;
    }))
}

/// So many triangles take a second.
const MANY_TRIANGLES: u64 = 4_000_000;

/// A name that cannot disturb a terminal.
fn printable(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

/// Between two lines.
const PAUSE: Duration = Duration::from_secs(15);
/// A render that takes less is not worth a line.
const WORTH_A_LINE: Duration = Duration::from_secs(1);
/// After so long it is known how long a render will take.
const WARM_UP: Duration = Duration::from_secs(2);
/// A render that takes longer is worth an advice.
const LONG: Duration = Duration::from_secs(60);

/// Tells standard error how far a render is.
pub struct Progress {
    started: Instant,
    /// Pixels of all pictures.
    all: u64,
    pictures: u64,
    /// Pixels of the pictures before this one.
    before: AtomicU64,
    /// Pixels; calls from several threads may come out of order, and a bar that goes back frightens.
    most: AtomicU64,
    /// What would make it faster, as long as that was not said.
    faster: Mutex<Option<String>>,
    left: Arc<Mutex<TimeLeft>>,
    kind: Kind,
}

enum Kind {
    Silent,
    Bar(ProgressBar),
    /// When the last line was said.
    Lines(Mutex<Instant>),
}

impl Progress {
    /// Begins now, for so many pictures of `all` pixels together. `faster` is what would make it faster; it is said
    /// once, if it takes long.
    pub fn begin(all: u64, pictures: u64, quiet: bool, faster: String) -> Self {
        let started = Instant::now();
        let left = Arc::new(Mutex::new(TimeLeft::default()));
        let kind = if quiet {
            Kind::Silent
        } else if io::stderr().is_terminal() {
            let bar = ProgressBar::with_draw_target(Some(all), ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("rendering {msg}{wide_bar} {percent:>3} %  {left}");
            let own = left.clone();
            let left = move |state: &ProgressState, text: &mut dyn fmt::Write| {
                let left = own
                    .lock()
                    .ok()
                    .and_then(|mut left| left.after(state.pos(), state.len().unwrap_or_default(), started.elapsed()));
                let _ = left.map_or(Ok(()), |left| write!(text, "{} left", words(left)));
            };
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).with_key("left", left));
            // The time left goes on while a slow tile is at work
            bar.enable_steady_tick(Duration::from_millis(250));
            Kind::Bar(bar)
        } else {
            Kind::Lines(Mutex::new(started))
        };
        let (before, most) = (AtomicU64::new(0), AtomicU64::new(0));
        Self { started, all, pictures, before, most, faster: Mutex::new(Some(faster)), left, kind }
    }

    /// Picture `index` of all, counted from 0, is next; those before it have so many pixels.
    pub fn picture(&self, index: u64, before: u64) {
        self.before.store(before, Ordering::Relaxed);
        if let (Kind::Bar(bar), 2..) = (&self.kind, self.pictures) {
            bar.set_message(format!("{} of {} ", index + 1, self.pictures));
        }
    }

    /// `done` pixels of this picture are there. For any thread, often.
    pub fn update(&self, done: u64) {
        let all = self.all;
        let done = self.before.load(Ordering::Relaxed) + done;
        let done = self.most.fetch_max(done, Ordering::Relaxed).max(done);
        match &self.kind {
            Kind::Silent => return,
            Kind::Bar(bar) => bar.set_position(done),
            Kind::Lines(last) => {
                // Who finds it taken goes on rendering
                let Ok(mut last) = last.try_lock() else { return };
                if last.elapsed() >= PAUSE && done < all {
                    *last = Instant::now();
                    say(format_args!("{}", line(done, all, self.left(done, all))));
                }
            }
        }
        self.advise(done, all);
    }

    /// Says once what would make a long render faster, as soon as it is known that it is long.
    fn advise(&self, done: u64, all: u64) {
        let took = self.started.elapsed();
        if took < WARM_UP || done >= all {
            return;
        }
        let Ok(mut faster) = self.faster.try_lock() else { return };
        if faster.is_none() {
            return;
        }
        let left = self.left(done, all);
        let Some(advice) = advice(took, left, faster.as_deref().unwrap_or_default()) else { return };
        *faster = None;
        self.aside(|| say(format_args!("{advice}")));
    }

    fn left(&self, done: u64, all: u64) -> Option<Duration> {
        self.left.lock().ok().and_then(|mut left| left.after(done, all, self.started.elapsed()))
    }

    /// Runs `f`, which may say something, without the bar in its way.
    pub fn aside<R>(&self, f: impl FnOnce() -> R) -> R {
        match &self.kind {
            Kind::Bar(bar) => bar.suspend(f),
            Kind::Silent | Kind::Lines(_) => f(),
        }
    }

    /// All pictures are there: `what`, as `3 frames of 8 x 6 pixels`.
    pub fn finish(&self, what: &str) {
        let took = self.started.elapsed();
        match &self.kind {
            Kind::Silent => {}
            Kind::Bar(bar) => bar.finish_and_clear(),
            Kind::Lines(_) if took < WORTH_A_LINE => {}
            Kind::Lines(_) => {
                say(format_args!("rendered {what} in {}", words(took)));
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

/// How long it will still take, as it was said last: what is said shrinks, and only grows where it was plainly wrong.
#[derive(Default)]
struct TimeLeft(Option<Duration>);

/// So many times what was said is not the unevenness of tiles any more.
const WRONG: f64 = 1.5;

impl TimeLeft {
    /// Where `done` of `all` took so long. `None` as long as that says nothing.
    fn after(&mut self, done: u64, all: u64, took: Duration) -> Option<Duration> {
        if done > 0 && took >= WORTH_A_LINE {
            let left = took.as_secs_f64() * all.saturating_sub(done) as f64 / done as f64;
            let left = Duration::try_from_secs_f64(left).unwrap_or(Duration::MAX);
            self.0 = match self.0 {
                Some(said) if left > said && left.as_secs_f64() <= said.as_secs_f64() * WRONG => Some(said),
                _ => Some(left),
            };
        }
        self.0
    }
}

/// `rendered 40 %, about 12 s left`
fn line(done: u64, all: u64, left: Option<Duration>) -> String {
    let left = left.map_or(String::new(), |left| format!(", about {} left", words(left)));
    format!("rendered {} %{left}", done.saturating_mul(100) / all.max(1))
}

/// What is said of a render that took so long already and has so long to go, if anything.
fn advice(took: Duration, left: Option<Duration>, faster: &str) -> Option<String> {
    let how_long = match left {
        Some(left) if took.saturating_add(left) > LONG => format!("about {} left", words(left)),
        None if took > LONG => format!("no part of it is done after {}", words(took)),
        _ => return None,
    };
    let faster = if faster.is_empty() { String::new() } else { format!("; faster: {faster}") };
    Some(format!("advice: {how_long}{faster}"))
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
        let line = |done, all, took| super::line(done, all, TimeLeft::default().after(done, all, took));
        assert_eq!(line(40, 100, Duration::from_secs(8)), "rendered 40 %, about 12 s left");
        // Nothing done yet, or more than there is: still a line
        assert_eq!(line(0, 100, Duration::from_secs(8)), "rendered 0 %");
        assert!(line(u64::MAX, 0, Duration::MAX).starts_with("rendered"));
    }

    #[test]
    fn the_time_left_shrinks() {
        let s = Duration::from_secs;
        // Tiles of uneven cost, and a tile that takes long: 3 s in which nothing is done
        let steps = [(2, 10), (4, 19), (6, 31), (8, 38), (11, 38), (12, 60), (14, 70), (19, 95), (20, 100)];
        let mut left = TimeLeft::default();
        let said: Vec<_> = steps.map(|(took, done)| left.after(done, 100, s(took)).unwrap()).into();
        assert!(said.is_sorted_by(|a, b| a >= b), "{said:?}");
        assert_eq!((said[0], said[8]), (s(18), s(0)));
        // What was plainly wrong is put right
        let mut left = TimeLeft::default();
        assert_eq!(left.after(50, 100, s(2)), Some(s(2)));
        assert_eq!(left.after(50, 100, s(3)), Some(s(3)).filter(|_| 3.0 > 2.0 * WRONG).or(Some(s(2))));
        assert_eq!(left.after(51, 100, s(102)), Some(s(98)));
    }

    #[test]
    fn a_long_render_is_worth_an_advice() {
        let s = Duration::from_secs;
        assert_eq!(advice(s(2), Some(s(57)), "--aa 2"), None);
        assert_eq!(advice(s(2), Some(s(59)), "--aa 2").unwrap(), "advice: about 59 s left; faster: --aa 2");
        assert_eq!(advice(s(2), Some(s(200)), "").unwrap(), "advice: about 3 min 20 s left");
        assert_eq!(advice(s(59), None, "--aa 2"), None);
        let nothing = advice(s(61), None, "--aa 2").unwrap();
        assert_eq!(nothing, "advice: no part of it is done after 1 min 1 s; faster: --aa 2");
    }
}
