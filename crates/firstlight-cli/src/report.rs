//! What the program says: messages and diagnostics on standard error, answers on standard output. Nothing here panics
//! when the other end is gone.

use std::borrow::Cow;
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;

use firstlight::{Diagnostic, Place, Severity, printable};
use miette::{
    GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteError, MietteSpanContents, SourceCode, SourceSpan,
    SpanContents,
};

/// Why a command did not do what it was asked. `main` says it, once.
#[derive(Debug)]
pub enum Failure {
    /// The command line asks for what cannot be: exit code 2.
    Usage(String),
    /// It could not be done: exit code 1.
    Work(String),
    /// The scene has faults: exit code 1.
    Scene(Vec<Diagnostic>),
    /// Stopped by Ctrl-C or by another program: exit code 130.
    Interrupted,
    /// The same, while a device or pipe of this name let wait: exit code 130.
    InterruptedWriting(String),
    /// The same, after some of the pictures of a scene: exit code 130.
    InterruptedAfter {
        /// Pictures whose files are there.
        done: usize,
        /// Pictures that were asked for.
        all: usize,
        /// `frames`, or what else they are.
        what: &'static str,
    },
    /// Some of several scenes could not be rendered, and what was wrong with each has been said: exit code 1.
    Several {
        /// The names of those that failed, without control characters.
        failed: Vec<String>,
        /// How many there are.
        all: usize,
    },
    /// `diff` and `verify` found a difference, and have said it: exit code 3.
    Differs,
    /// Stopped while one of several scenes was rendered: exit code 130.
    InterruptedIn {
        /// What it is called.
        scene: String,
        /// How many were rendered before it.
        done: usize,
        /// How many there are.
        all: usize,
    },
}

impl Failure {
    /// Warnings that `--strict` makes errors.
    pub fn strict(mut warnings: Vec<Diagnostic>) -> Failure {
        warnings.iter_mut().for_each(|warning| warning.severity = Severity::Error);
        Failure::Scene(warnings)
    }

    /// The program's exit code.
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Failure::Work(_) | Failure::Scene(_) | Failure::Several { .. } => 1,
            Failure::Usage(_) => 2,
            Failure::Differs => 3,
            Failure::Interrupted
            | Failure::InterruptedWriting(_)
            | Failure::InterruptedAfter { .. }
            | Failure::InterruptedIn { .. } => 130,
        })
    }

    /// What went wrong, as one text for another program: every fault on a line of its own.
    pub fn text(&self) -> String {
        match self {
            Failure::Usage(message) | Failure::Work(message) => message.clone(),
            Failure::Scene(faults) => faults.iter().map(Diagnostic::to_string).collect::<Vec<_>>().join("\n"),
            Failure::Differs => "differs".into(),
            Failure::Several { failed, .. } => failed.join("\n"),
            Failure::Interrupted
            | Failure::InterruptedWriting(_)
            | Failure::InterruptedAfter { .. }
            | Failure::InterruptedIn { .. } => "interrupted".into(),
        }
    }

    /// Whether somebody asked to stop.
    pub fn is_interruption(&self) -> bool {
        matches!(
            self,
            Failure::Interrupted
                | Failure::InterruptedWriting(_)
                | Failure::InterruptedAfter { .. }
                | Failure::InterruptedIn { .. }
        )
    }

    /// Says what went wrong.
    pub fn show(&self, command: &str) {
        match self {
            Failure::Usage(message) => {
                say(format_args!("error: {}", clean(message)));
                say(format_args!("\nFor more information, try 'firstlight {command} --help'."));
            }
            Failure::Work(message) => say(format_args!("error: {}", clean(message))),
            Failure::Scene(faults) => {
                show_diagnostics(faults);
                say(format_args!("{}", count(faults)));
            }
            Failure::Differs => {}
            Failure::Interrupted => say(format_args!("interrupted; nothing was written")),
            Failure::InterruptedWriting(to) => {
                say(format_args!("interrupted while {to} was written; it may have got a part"));
            }
            Failure::InterruptedAfter { done, all, what } => {
                say(format_args!("interrupted; {done} of {all} {what} were written, each of them whole"));
            }
            Failure::Several { failed, all } => {
                let count = failed.len();
                say(format_args!("{} of {all} scenes were rendered; {count} could not be:", all - count));
                // Each by its whole name, to be copied
                failed.iter().for_each(|name| say(format_args!("  {name}")));
            }
            Failure::InterruptedIn { scene, done, all } => {
                say(format_args!("interrupted in {}; {done} of {all} scenes were rendered before it", clean(scene)));
            }
        }
    }
}

/// Writes a line to standard error. Where nobody listens any more, nothing is left to say.
pub fn say(line: fmt::Arguments) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// Writes an answer to standard output. A reader that has seen enough (`| head`) is content: it is done then.
///
/// # Errors
/// Standard output cannot take it, for any other reason.
pub fn answer(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(Failure::Work(format!("standard output: {e}"))),
        _ => Ok(()),
    }
}

/// Diagnostics that are shown at a time; of more, the number.
const MAX_SHOWN: usize = 20;

/// Shows diagnostics: with a drawn excerpt on a terminal, and elsewhere as lines that stay the same.
pub fn show_diagnostics(diagnostics: &[Diagnostic]) {
    let style = Style::of_stderr();
    for diagnostic in diagnostics.iter().take(MAX_SHOWN) {
        say(format_args!("{}", style.render(diagnostic).trim_end_matches('\n')));
    }
    if diagnostics.len() > MAX_SHOWN {
        say(format_args!("and {} more", faults(diagnostics) - MAX_SHOWN as u64));
    }
}

/// How many faults there are, those included that the library has only counted.
fn faults(diagnostics: &[Diagnostic]) -> u64 {
    let counted = |d: &Diagnostic| d.message.strip_suffix(" more faults are not listed")?.parse::<u64>().ok();
    diagnostics.iter().map(|d| counted(d).unwrap_or(1)).sum()
}

/// `2 errors, 1 warning`
fn count(diagnostics: &[Diagnostic]) -> String {
    let of = |severity, word: &str| {
        let of_severity: Vec<Diagnostic> = diagnostics.iter().filter(|d| d.severity == severity).cloned().collect();
        let n = faults(&of_severity);
        (n > 0).then(|| format!("{n} {word}{}", if n == 1 { "" } else { "s" }))
    };
    let parts = [of(Severity::Error, "error"), of(Severity::Warning, "warning"), of(Severity::Advice, "note")];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// How diagnostics look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Style {
    /// One line, then the excerpt and a caret under the fault.
    Plain,
    /// Drawn, by `miette`.
    Drawn { color: bool },
}

impl Style {
    /// What suits standard error.
    fn of_stderr() -> Self {
        let said = |name| std::env::var_os(name).filter(|v| !v.is_empty());
        if !io::stderr().is_terminal() || said("TERM").is_some_and(|term| term == "dumb") {
            return Style::Plain;
        }
        Style::Drawn { color: said("NO_COLOR").is_none() }
    }

    fn render(self, diagnostic: &Diagnostic) -> String {
        let Style::Drawn { color } = self else { return plain(diagnostic) };
        let theme = if color { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
        let handler = GraphicalReportHandler::new_themed(theme).with_links(false).with_width(100);
        let mut text = String::new();
        match handler.render_report(&mut text, &Drawn::new(diagnostic)) {
            Ok(()) => text,
            // The drawing is a nicety; the fault must be said all the same
            Err(_) => plain(diagnostic),
        }
    }
}

/// `error: scene.toml:14:9: path: message; hint`, and the line of text with a caret under the fault.
fn plain(diagnostic: &Diagnostic) -> String {
    let mut text = format!("{}: {}", word(diagnostic.severity), clean(&diagnostic.to_string()));
    if let Some(place) = diagnostic.place.as_ref().filter(|place| !place.excerpt.is_empty()) {
        let number = place.line.to_string();
        let excerpt = clean_line(&place.excerpt);
        // Tabs stay tabs, so that the caret stands under its character whatever their width
        let before = excerpt.chars().take(place.offset as usize);
        let blank: String = before.map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
        let carets = "^".repeat(shown_width(place, &excerpt));
        text +=
            &format!("\n  {number} | {excerpt}\n  {:number_width$} | {blank}{carets}", "", number_width = number.len());
    }
    text
}

fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Advice => "note",
    }
}

/// How many characters of the excerpt to mark: those of the fault, as far as they are shown, and at least one.
fn shown_width(place: &Place, excerpt: &str) -> usize {
    let rest = excerpt.chars().count().saturating_sub(place.offset as usize);
    (place.width as usize).min(rest).max(1)
}

/// A line of text without control characters, one for one but for tabs, so that a caret below stands where it should.
fn clean_line(text: &str) -> String {
    let hidden = |c: char| c != '\t' && matches!(printable(c.encode_utf8(&mut [0; 4])), Cow::Owned(_));
    text.chars().map(|c| if hidden(c) { '\u{fffd}' } else { c }).collect()
}

/// A path as messages show it: on one line, without control characters, and not longer than a line or two.
pub fn shown(path: &Path) -> String {
    printable(&cut(&path.display().to_string(), MAX_NAME)).into_owned()
}

/// The whole of a path, on one line and without control characters.
pub fn whole(path: &Path) -> String {
    printable(&path.display().to_string()).into_owned()
}

/// Characters of a name, and of a message, that are shown; of more, the beginning and the end.
const MAX_NAME: usize = 160;
const MAX_MESSAGE: usize = 1000;

/// A message as it is shown: a scene cannot move the cursor of whoever reads its faults, nor fill the screen with one.
fn clean(text: &str) -> String {
    printable(&cut(text, MAX_MESSAGE)).into_owned()
}

/// The text, or its beginning and its end where it has more than `most` characters.
fn cut(text: &str, most: usize) -> Cow<'_, str> {
    let length = text.chars().count();
    if length <= most {
        return Cow::Borrowed(text);
    }
    let start: String = text.chars().take(most / 2).collect();
    let end: String = text.chars().skip(length - most / 2).collect();
    Cow::Owned(format!("{start} ... {end}"))
}

/// A diagnostic as `miette` wants it.
#[derive(Debug)]
struct Drawn {
    message: String,
    hint: Option<String>,
    severity: miette::Severity,
    excerpt: Option<Excerpt>,
}

/// The line at fault. Spans are bytes of it.
#[derive(Debug)]
struct Excerpt {
    file: String,
    line: usize,
    column: usize,
    text: String,
    mark: SourceSpan,
}

impl Drawn {
    fn new(diagnostic: &Diagnostic) -> Self {
        let message = match diagnostic.path.as_str() {
            "" => diagnostic.message.clone(),
            path => format!("{path}: {}", diagnostic.message),
        };
        Self {
            message: clean(&message),
            hint: diagnostic.hint.as_deref().map(clean),
            severity: match diagnostic.severity {
                Severity::Error => miette::Severity::Error,
                Severity::Warning => miette::Severity::Warning,
                Severity::Advice => miette::Severity::Advice,
            },
            excerpt: diagnostic.place.as_ref().map(Excerpt::new),
        }
    }
}

impl Excerpt {
    fn new(place: &Place) -> Self {
        let text = clean_line(&place.excerpt);
        let bytes = |chars: usize| text.chars().take(chars).map(char::len_utf8).sum::<usize>();
        let start = place.offset as usize;
        let (from, to) = (bytes(start), bytes(start + shown_width(place, &text)));
        Self {
            file: clean(&place.file),
            line: place.line as usize - 1,
            column: place.column as usize - 1,
            mark: (from, to - from).into(),
            text,
        }
    }
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        _span: &SourceSpan,
        lines_before: usize,
        _lines_after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        // Asked without context it is for the place in the headline, else for the lines to draw, which begin at column
        // 0
        let column = if lines_before == 0 { self.column } else { 0 };
        let (text, span) = (self.text.as_bytes(), (0, self.text.len()).into());
        Ok(Box::new(MietteSpanContents::new_named(self.file.clone(), text, span, self.line, column, 1)))
    }
}

impl fmt::Display for Drawn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Drawn {}

impl miette::Diagnostic for Drawn {
    fn severity(&self) -> Option<miette::Severity> {
        Some(self.severity)
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.hint.as_ref().map(|hint| Box::new(hint) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.excerpt.as_ref().map(|excerpt| excerpt as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let excerpt = self.excerpt.as_ref()?;
        Some(Box::new(std::iter::once(LabeledSpan::new_primary_with_span(None, excerpt.mark))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault() -> Diagnostic {
        Diagnostic {
            severity: Severity::Error,
            place: Some(Place {
                file: "scene.toml".into(),
                line: 14,
                column: 13,
                excerpt: "\tcone_deg = 190 # é".into(),
                offset: 12,
                width: 3,
            }),
            path: "light.spot[2].cone_deg".into(),
            message: "190 is outside (0, 180]".into(),
            hint: Some("the cone is the full angle, not half".into()),
        }
    }

    #[test]
    fn plain_is_one_line_and_a_caret() {
        let text = Style::Plain.render(&fault());
        let expected = "\
error: scene.toml:14:13: light.spot[2].cone_deg: 190 is outside (0, 180]; the cone is the full angle, not half
  14 | \tcone_deg = 190 # é
     | \t           ^^^";
        assert_eq!(text, expected);
    }

    #[test]
    fn drawn_holds_place_excerpt_and_hint() {
        let text = Style::Drawn { color: false }.render(&fault());
        for part in ["scene.toml:14:13", "cone_deg = 190", "190 is outside (0, 180]", "not half", "14 │", "───"]
        {
            assert!(text.contains(part), "{part:?} is not in\n{text}");
        }
        assert!(!text.contains('\u{1b}'), "{text:?}");
        assert!(Style::Drawn { color: true }.render(&fault()).contains('\u{1b}'));
    }

    #[test]
    fn marks_beyond_the_excerpt_are_held_to_it() {
        for (offset, width) in [(0, 1000), (1000, 1), (19, 5), (1000, 1000)] {
            let mut fault = fault();
            if let Some(place) = &mut fault.place {
                (place.offset, place.width) = (offset, width);
                place.column = 1;
            }
            for style in [Style::Plain, Style::Drawn { color: false }] {
                assert!(style.render(&fault).contains("190 is outside"));
            }
            // An empty line as well
            if let Some(place) = &mut fault.place {
                place.excerpt.clear();
            }
            for style in [Style::Plain, Style::Drawn { color: false }] {
                assert!(style.render(&fault).contains("190 is outside"));
            }
        }
    }

    #[test]
    fn a_scene_cannot_send_control_characters() {
        let mut fault = fault();
        fault.message = "\u{1b}[2J\u{7}".into();
        if let Some(place) = &mut fault.place {
            place.excerpt = "\u{1b}[31mred".into();
            place.file = "a\u{1b}b".into();
        }
        for style in [Style::Plain, Style::Drawn { color: false }] {
            assert!(!style.render(&fault).contains('\u{1b}'));
        }
    }

    #[test]
    fn faults_are_counted() {
        let warning = Diagnostic { severity: Severity::Warning, ..fault() };
        assert_eq!(count(&[fault(), fault(), warning.clone()]), "2 errors, 1 warning");
        assert_eq!(count(&[fault()]), "1 error");
        let more = Diagnostic { message: "199744 more faults are not listed".into(), ..fault() };
        assert_eq!(count(&[fault(), fault(), more]), "199746 errors");
    }
}
