//! `firstlight check`: whether a scene can be rendered.

use std::path::Path;

use crate::args::CheckArgs;
use crate::report::{Failure, answer, show_diagnostics};
use crate::{input, output};

/// Reads and compiles, and says `ok` or every fault.
///
/// # Errors
/// The scene cannot be had, or has faults.
pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let input = input::read(&args.scene.scene, &args.scene.reading)?;
    let compiled = input.compile(0.0, false)?;
    show_diagnostics(&compiled.warnings);
    input.tell_added(&compiled);
    show_diagnostics(&compiled.advice);
    // As much of the output as the text alone says
    if let Some(path) = &input.parsed.output {
        output::format_of_course(&input.name, Path::new(path))?;
    }
    answer("ok\n")
}
