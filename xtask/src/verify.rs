//! `cargo xtask verify`: the tests that take long.

use crate::{Outcome, cargo, run as run_to_end};

/// The tests that grow with `FIRSTLIGHT_SCENES` compare the renderers on that many random scenes.
pub fn run(scenes: u32) -> Outcome {
    let mut command = cargo();
    command.env("FIRSTLIGHT_SCENES", scenes.to_string());
    run_to_end(command.args(["test", "--release", "--package", "firstlight", "--test", "truth"]))
}
