//! Parallelograms.

use crate::describe::table;

table! {
    /// A flat shape with a corner and two edges of any length and angle. The texture coordinate of
    /// `p + u e0 + v e1` is (u, v). The normal is e0 x e1.
    ///
    /// ```toml
    /// [[parallelogram]]
    /// p = [-1, 0, -1]
    /// e0 = [2, 0, 0]
    /// e1 = [0, 0, 2]
    /// flip = true
    /// material = "floor"
    /// ```
    pub struct ParallelogramDesc {
        /// What reports and id files call it.
        pub name: Option<String> = None,
        /// A corner, in metres, world space.
        pub p: [f64; 3],
        /// The first edge from the corner, in metres: the direction of u.
        pub e0: [f64; 3],
        /// The second edge from the corner, in metres: the direction of v. Not parallel to `e0`.
        pub e1: [f64; 3],
        /// Turns the normal around; the texture stays as it is.
        pub flip: bool = false,
        /// The name of a material; without it, matte gray 0.8.
        pub material: Option<String> = None,
        /// Whether camera rays pass through from behind, the side the normal points away from. Light is blocked
        /// from both sides all the same.
        pub single_sided: bool = false,
    }
}
