//! Cylinders.

use super::common::shape_table;
use super::frustum::Frustum;
use super::solid::Solid;
use crate::context::CompileContext;

shape_table! {
    /// A round cylinder from one end of its axis to the other, closed by two caps, or open like a tube.
    ///
    /// On the mantle u runs around the axis, to the right as seen from outside with `p1` above, and v from 0 at `p0` to
    /// 1 at `p1`. u is 1/2 towards +x, or towards +y where the axis is within 26 degrees of the x axis. On the caps u
    /// is that of the mantle where they meet, and v runs from 0 at the rim to 1 at the centre.
    ///
    /// ```toml
    /// [[cylinder]]
    /// p0 = [0, 0, 0]
    /// p1 = [0, 2, 0]
    /// radius = 0.5
    /// material = "pillar"
    /// ```
    pub struct CylinderDesc {
        /// One end of the axis, in metres, world space.
        pub p0: [f64; 3],
        /// The other end of the axis; not `p0` itself.
        pub p1: [f64; 3],
        /// Radius in metres, 1e-9 to 2.5e8.
        pub radius: f64,
        /// Whether the two ends are closed.
        pub capped: bool = true,
    }
}

impl CylinderDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Solid {
        let radius = cx.positive("radius", self.radius, "the radius is in metres");
        Solid::Frustum(Frustum::compile(cx, self.p0, self.p1, [radius; 2], self.capped))
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::faults;
    use super::*;

    #[test]
    fn faults_are_told() {
        let here = CylinderDesc::new([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], 1.0);
        let found = faults(|cx| here.compile(cx));
        assert!(found[0].0 == "p1" && found[0].1.contains("[1, 2, 3] is p0"), "{found:?}");
        let thin = CylinderDesc::new([0.0; 3], [0.0, 1.0, 0.0], 0.0);
        assert_eq!(faults(|cx| thin.compile(cx))[0].0, "radius");
        let far = CylinderDesc::new([0.0; 3], [0.0, 1e30, 0.0], 1.0);
        assert_eq!(faults(|cx| far.compile(cx))[0].0, "p1");
    }
}
