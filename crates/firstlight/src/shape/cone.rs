//! Cones and cut-off cones.

use super::common::shape_table;
use super::frustum::Frustum;
use super::solid::Solid;
use crate::context::CompileContext;

shape_table! {
    /// A round cone, or a part of one between two radii, closed by caps or open.
    ///
    /// On the mantle u runs around the axis, to the right as seen from outside with `p1` above, and v from 0 at `p0` to
    /// 1 at `p1`. u is 1/2 towards +x, or towards +y where the axis is within 26 degrees of the x axis. On the caps u
    /// is that of the mantle where they meet, and v runs from 0 at the rim to 1 at the centre.
    ///
    /// ```toml
    /// [[cone]]
    /// p0 = [0, 0, 0]
    /// p1 = [0, 2, 0]
    /// radius0 = 1
    /// material = "spire"
    /// ```
    pub struct ConeDesc {
        /// One end of the axis, in metres, world space: the middle of the base.
        pub p0: [f64; 3],
        /// The other end of the axis: the tip, where `radius1` is 0; not `p0` itself.
        pub p1: [f64; 3],
        /// The radius at `p0` in metres, 0 to 2.5e8.
        pub radius0: f64,
        /// The radius at `p1` in metres, 0 to 2.5e8; not 0 where `radius0` is.
        pub radius1: f64 = 0.0,
        /// Whether the ends are closed.
        pub capped: bool = true,
    }
}

/// The radius of the wider end, in metres, is from here
const MIN_RADIUS: f64 = 1e-9;
/// to here.
const MAX_RADIUS: f64 = 2.5e8;

impl ConeDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Solid {
        let hint = Some("the radii are in metres; at the tip of a cone it is 0");
        let radii = [("radius0", self.radius0), ("radius1", self.radius1)];
        let radii = radii.map(|(field, radius)| cx.between(field, radius, 0.0, MAX_RADIUS, hint));
        if radii.iter().all(|radius| (0.0..MIN_RADIUS).contains(radius)) {
            let message = format!("{}, and radius0 is {}: there is nothing around the axis", radii[1], radii[0]);
            cx.error("radius1", message, Some("give one end a radius of 1e-9 or more"));
        }
        Solid::Frustum(Frustum::compile(cx, self.p0, self.p1, radii, self.capped))
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::faults;
    use super::*;

    #[test]
    fn faults_are_told() {
        let nothing = ConeDesc::new([0.0; 3], [0.0, 1.0, 0.0], 0.0);
        assert_eq!(faults(|cx| nothing.compile(cx))[0].0, "radius1");
        let negative = ConeDesc { radius1: -0.5, ..ConeDesc::new([0.0; 3], [0.0, 1.0, 0.0], 1.0) };
        let found = faults(|cx| negative.compile(cx));
        assert!(found[0].0 == "radius1" && found[0].1.contains("-0.5"), "{found:?}");
        let flat = ConeDesc::new([0.0; 3], [0.0; 3], 1.0);
        assert_eq!(faults(|cx| flat.compile(cx))[0].0, "p1");
    }
}
