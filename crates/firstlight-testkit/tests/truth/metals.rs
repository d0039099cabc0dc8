//! Random scenes of metals and dielectrics, with pictures, normal maps, masks, veils and clear coats, beside converged
//! pictures.

use crate::exact::hold;

/// Those of even numbers that are furthest off within the bounds.
const SCENES: [u64; 8] = [2012, 2026, 2040, 2068, 2102, 2136, 2138, 2162];

#[test]
fn scenes_of_metals_and_dielectrics_are_within_the_bounds() {
    hold(SCENES.into_iter(), 16);
}
