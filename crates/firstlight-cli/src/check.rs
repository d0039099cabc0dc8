//! `firstlight check`: whether a scene can be rendered.

use crate::args::CheckArgs;
use crate::input;
use crate::report::{Failure, answer, show_diagnostics};

/// Reads and compiles, and says `ok` or every fault.
///
/// # Errors
/// The scene cannot be had, or has faults.
pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let input = input::read(&args.scene.scene, &args.scene.reading)?;
    let compiled = input.compile()?;
    show_diagnostics(&compiled.warnings);
    answer("ok\n")
}
