//! Random scenes of metals and dielectrics, with pictures, normal maps, masks, veils and clear coats, beside converged
//! pictures.

use crate::exact::hold;

/// Those of even numbers that are furthest off within the bounds, and one where a cylinder cuts a light, its axis along
/// the rows.
const SCENES: [u64; 8] = [2012, 2020, 2026, 2040, 2062, 2102, 2136, 2138];

#[test]
fn scenes_of_metals_and_dielectrics_are_within_the_bounds() {
    hold(SCENES.into_iter(), 16);
}
