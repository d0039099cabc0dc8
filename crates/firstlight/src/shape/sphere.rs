//! Spheres.

use crate::describe::{table, words};

words! {
    /// How a point of a sphere becomes a texture coordinate. `n` is the outward unit normal at the point.
    pub enum SphereUv {
        /// u = 1/2 + atan2(-n.z, n.x) / 2 pi, v = 1/2 + asin(n.y) / pi: a world map, not mirrored seen from outside.
        Equirectangular = "equirectangular",
        /// u = angle(n, +x) / pi, v = angle(n, +y) / pi: v runs downwards, front and back mirror each other.
        Angles = "angles",
    }
}

table! {
    /// A sphere, seen from outside and from inside.
    ///
    /// ```toml
    /// [[sphere]]
    /// center = [0, 1, 0]
    /// radius = 1
    /// material = "red"
    /// ```
    pub struct SphereDesc {
        /// What reports and id files call it.
        pub name: Option<String> = None,
        /// Centre, in metres, world space.
        pub center: [f64; 3],
        /// Radius in metres, greater than 0.
        pub radius: f64,
        /// How a point becomes a texture coordinate.
        pub uv: SphereUv = SphereUv::Equirectangular,
        /// The name of a material; without it, matte gray 0.8.
        pub material: Option<String> = None,
        /// Whether camera rays pass through its inside. Light is blocked from both sides all the same.
        pub single_sided: bool = false,
    }
}
