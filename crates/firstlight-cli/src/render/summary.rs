//! `--summary`: the log of a run, a line of JSON for each picture.
//!
//! Unlike pictures it is not whole or absent: it is there from the beginning, and each line is written as a whole when
//! its picture is done or has failed. So it can be read while the run goes on, and a run that was interrupted leaves
//! what it had got to.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::time::Instant;

use firstlight::PendingFile;
use serde_json::json;

use crate::output::{JsonFile, Output, Target};
use crate::report::{Failure, say, shown};

/// The log of a run.
pub(super) struct Summary {
    to: Option<Box<dyn Write>>,
    name: String,
    /// The first line that could not be written, and why.
    fault: Option<String>,
    /// The picture that is being made.
    now: Option<Entry>,
}

/// Sees that a link leads to no file of another kind, which would be replaced: a picture that a scene reads, for one.
fn refuse_link(path: &Path) -> Result<(), Failure> {
    let Ok(real) = path.canonicalize() else { return Ok(()) };
    let is_own = real.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("jsonl"));
    if is_own || !real.is_file() {
        return Ok(());
    }
    let (name, real) = (shown(path), shown(&real));
    Err(Failure::Usage(format!("--summary {name} leads to {real}, which is no .jsonl file; name another")))
}

struct Entry {
    input: String,
    output: Vec<String>,
    started: Instant,
    warnings: Vec<String>,
}

impl Summary {
    /// Makes the file, empty, in the place of one of that name.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn begin(file: Option<&JsonFile>) -> Result<Self, Failure> {
        let to: Option<Box<dyn Write>> = match file.map(|file| &file.target) {
            None => None,
            Some(Target::Stdout) => Some(Box::new(io::stdout())),
            Some(Target::File(path)) => {
                let fault = |why: String| Failure::Work(format!("--summary: {why}"));
                refuse_link(path)?;
                // What else has the old one, under another name, keeps it
                PendingFile::new(path).and_then(|pending| pending.commit(b"")).map_err(|e| fault(e.to_string()))?;
                let opened = File::options().append(true).open(path);
                Some(Box::new(opened.map_err(|e| fault(format!("{}: {e}", path.display())))?))
            }
        };
        let name = file.map(JsonFile::name).unwrap_or_default();
        Ok(Summary { to, name, fault: None, now: None })
    }

    /// A scene is next, of which no picture is begun.
    pub fn scene(&mut self, input: String) {
        self.now = Some(Entry { input, output: Vec::new(), started: Instant::now(), warnings: Vec::new() });
    }

    /// A picture of a scene is next. Time counts from the end of the one before, and for the first from the scene's own
    /// beginning.
    pub fn picture(&mut self, input: &str, outputs: &[Output]) {
        let started = self.now.take().map_or_else(Instant::now, |entry| entry.started);
        let output = outputs.iter().map(|output| output.target.whole()).collect();
        self.now = Some(Entry { input: input.to_owned(), output, started, warnings: Vec::new() });
    }

    /// Keeps a warning of the picture.
    pub fn warn(&mut self, text: String) {
        if let Some(now) = &mut self.now {
            now.warnings.push(text);
        }
    }

    /// The picture is done, or it failed.
    pub fn end(&mut self, failure: Option<&Failure>) {
        let Some(Entry { input, output, started, warnings }) = self.now.take() else { return };
        let Some(to) = self.to.as_mut().filter(|_| self.fault.is_none()) else { return };
        let line = json!({
            "input": input,
            "output": output,
            "seconds": (started.elapsed().as_secs_f64() * 1e6).round() / 1e6,
            "warnings": warnings,
            "error": failure.map(Failure::text),
        });
        // In one piece, so that no line is in parts
        if let Err(e) = to.write_all(format!("{line}\n").as_bytes()).and_then(|()| to.flush()) {
            let fault = format!("{}: {e}", self.name);
            say(format_args!("error: {fault}; the rest of the run goes on without it"));
            self.fault = Some(fault);
        }
    }

    /// # Errors
    /// Not all lines could be written.
    pub fn finish(self) -> Result<(), Failure> {
        self.fault.map_or(Ok(()), |fault| Err(Failure::Work(fault)))
    }
}
