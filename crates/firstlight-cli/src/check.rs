//! `firstlight check`: whether a scene or a model can be rendered.

use std::path::Path;

use firstlight::{Diagnostic, Severity};
use serde_json::json;

use crate::args::CheckArgs;
use crate::report::{Failure, answer, show_diagnostics};
use crate::{input, output};

/// Reads and compiles, and says `ok` or every fault.
///
/// # Errors
/// The scene cannot be had, or has faults.
pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let looked = look(args);
    if args.json {
        let of = |list: &[Diagnostic]| list.iter().map(|diagnostic| diagnostic.to_string()).collect::<Vec<_>>();
        let said = match &looked {
            Ok([warnings, notes]) => json!({ "ok": true, "errors": [], "warnings": of(warnings), "notes": of(notes) }),
            Err(Failure::Usage(_)) => return looked.map(drop),
            Err(failure) => json!({ "ok": false, "errors": failure.text().lines().collect::<Vec<_>>() }),
        };
        answer(&format!("{said:#}\n"))?;
        return looked.map(drop);
    }
    looked?;
    answer("ok\n")
}

/// Compiles the scene and returns its warnings and its notes. Prints them to stderr, unless `--json` is set.
fn look(args: &CheckArgs) -> Result<[Vec<Diagnostic>; 2], Failure> {
    let input = input::read(&args.scene.scene, &args.scene.reading)?;
    let compiled = input.compile(0.0, args.json)?;
    let mut notes = Vec::new();
    if input.studio.is_some() {
        // What is repaired without a word where it is rendered
        let note = |message: String| Diagnostic {
            severity: Severity::Advice,
            place: None,
            path: String::new(),
            message: format!("{}: {message}", input.name),
            hint: None,
        };
        notes.extend(input.model_report(0.0)?.repairs().into_iter().map(note));
    }
    // As much of the output as the text alone says
    if let Some(path) = &input.parsed.output {
        output::format_of_course(&input.name, Path::new(path))?;
    }
    notes.splice(0..0, compiled.advice.iter().cloned());
    if !args.json {
        // All of them, a few at a time
        compiled.warnings.chunks(20).for_each(show_diagnostics);
        input.tell_added(&compiled);
        notes.chunks(20).for_each(show_diagnostics);
    }
    Ok([compiled.warnings, notes])
}
