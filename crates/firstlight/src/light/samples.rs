//! The points of an area light.

use crate::describe::words;

words! {
    /// How the sampled points of an area light are laid out. The set is fixed: the same for every shading point.
    pub enum SampleSet {
        /// The first N points of the Sobol' (0, 2)-sequence under a fixed Owen scramble.
        Sobol = "sobol",
        /// The middles of m x m equal cells; N = m x m.
        Grid = "grid",
        /// One seeded random point in each of m x m equal cells; N = m x m.
        Stratified = "stratified",
        /// N seeded random points.
        Uniform = "uniform",
    }
}
