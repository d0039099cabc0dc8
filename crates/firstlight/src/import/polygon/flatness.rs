//! Which corners of a polygon are in one line, as far as their coordinates can say it.

use super::{FlatPoint, area};

/// How far a corner may be off a straight edge that it is on, in parts of the largest coordinate: files have six digits
/// or more, and two ends are as far off as the corner between them.
const ROUNDING: f64 = 2e-6;
/// Triangles that are higher than this part of their longest side are not flat, however coarse coordinates are.
const HIGH: f64 = 1.0 / 1024.0;

/// How low a triangle has to be for its corners to be in one line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Flatness {
    /// A distance, in the polygon's plane.
    rounding: f64,
}

impl Flatness {
    /// Corners are in one line if they are so exactly.
    pub(super) const EXACT: Flatness = Flatness { rounding: 0.0 };

    /// For corners with these coordinates.
    pub(super) fn of_coordinates(coordinates: impl Iterator<Item = f64>) -> Self {
        Self { rounding: ROUNDING * coordinates.fold(0.0, |most: f64, x| most.max(x.abs())) }
    }

    /// Whether a triangle turns forwards and is not flat.
    pub(super) fn is_forward(self, [a, b, c]: [FlatPoint; 3]) -> bool {
        let (area, square) = (area(a, b, c), square(a, b).max(square(b, c)).max(square(c, a)));
        // Twice the area is the longest side times the height above it
        area > 0.0 && area >= (self.rounding * square.sqrt()).min(HIGH * square)
    }

    /// What may not be in or on a triangle that is an ear.
    pub(super) fn reach(self, triangle: [FlatPoint; 3]) -> Reach {
        let [a, b, c] = triangle;
        let sides = [square(a, b), square(b, c), square(c, a)].map(f64::sqrt);
        let margin = self.rounding.min(HIGH * sides[0].max(sides[1]).max(sides[2]));
        Reach { triangle, margin, margins: sides.map(|side| margin * side) }
    }
}

/// The square of the distance of two points.
fn square(p: FlatPoint, q: FlatPoint) -> f64 {
    (q[0] - p[0]) * (q[0] - p[0]) + (q[1] - p[1]) * (q[1] - p[1])
}

/// A triangle and what is on its edges.
pub(super) struct Reach {
    pub(super) triangle: [FlatPoint; 3],
    /// How far off an edge is still on it.
    pub(super) margin: f64,
    /// The same, as twice the areas of triangles over each side.
    margins: [f64; 3],
}

impl Reach {
    /// Whether a point is in it. Not one at the place of a corner: polygons with holes have such seams.
    pub(super) fn holds(&self, p: FlatPoint) -> bool {
        let [a, b, c] = self.triangle;
        let [ab, bc, ca] = self.margins;
        let within = area(a, b, p) >= -ab && area(b, c, p) >= -bc && area(c, a, p) >= -ca;
        within && p != a && p != b && p != c
    }
}
