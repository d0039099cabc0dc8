//! `cargo xtask verify`: the tests that take long.

use crate::{Outcome, cargo, run as run_to_end};

/// The rays that each mesh is asked, by its tree and triangle by triangle.
const RAYS: &str = "1000000";

/// The tests that `cargo test` leaves out render until nothing changes any more; those that grow with
/// `FIRSTLIGHT_SCENES` compare the renderers on that many random scenes; those that grow with `FIRSTLIGHT_RAYS` compare
/// the trees of meshes with asking every triangle.
pub fn run(scenes: u32) -> Outcome {
    let mut command = cargo();
    command.env("FIRSTLIGHT_SCENES", scenes.to_string());
    let test = ["test", "--release", "--package", "firstlight-testkit", "--test", "truth"];
    run_to_end(command.args(test).args(["--", "--include-ignored"]))?;
    let mut command = cargo();
    command.env("FIRSTLIGHT_RAYS", RAYS);
    run_to_end(command.args(["test", "--release", "--package", "firstlight", "--lib", "shape::triangles"]))
}
