//! Rectangles by their middle.

use super::common::shape_table;
use super::parallelogram::Parallelogram;
use crate::context::{CompileContext, show};
use crate::math::{Axes, DVec3};

shape_table! {
    /// A flat rectangle around a centre. The texture coordinate runs from 0 to 1 to the right and up, as seen from the
    /// side the normal points to.
    ///
    /// ```toml
    /// [[rectangle]]
    /// center = [0, 1, -2]
    /// size = [4, 2]
    /// normal = [0, 0, 1]
    /// material = "poster"
    /// ```
    pub struct RectangleShapeDesc {
        /// Centre, in metres, world space.
        pub center: [f64; 3],
        /// Width and height in metres, along u and v, 1e-9 to 2.5e8 each.
        pub size: [f64; 2],
        /// The direction its front faces, of any length above 1e-9.
        pub normal: [f64; 3] = [0.0, 1.0, 0.0],
        /// The direction of v, made perpendicular to `normal`; not parallel to it. Without it +y; of a rectangle that
        /// faces straight up -z, straight down +z.
        pub up: Option<[f64; 3]> = None,
    }
}

impl RectangleShapeDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Parallelogram {
        cx.point("center", self.center);
        for (i, size) in self.size.iter().enumerate() {
            cx.positive(&format!("size[{i}]"), *size, "width and height are in metres");
        }
        let frame = facing(cx, self.normal, self.up);
        let (e0, e1) = (frame.x * self.size[0], frame.y * self.size[1]);
        Parallelogram::new(DVec3::from(self.center) - (e0 + e1) * 0.5, e0, e1, 1.0, self.single_sided)
    }
}

/// The frame of what is flat, from its `normal` and `up`.
pub(crate) fn facing(cx: &mut CompileContext, normal: [f64; 3], up: Option<[f64; 3]>) -> Axes {
    let mut fine = cx.edge("normal", normal);
    if let Some(up) = up {
        fine &= cx.edge("up", up);
    }
    let unit = DVec3::from(normal).normalize_or(DVec3::Y);
    let frame = Axes::facing(unit, up.map(DVec3::from));
    if let (true, None, Some(up)) = (fine, frame, up) {
        let message = format!("{} is parallel to the normal {}", show(&up), show(&normal));
        cx.error("up", message, Some("give a direction that lies in the surface, or leave it out"));
    }
    frame.unwrap_or(Axes::around(unit))
}

#[cfg(test)]
mod tests {
    use super::super::check::{faults, made};
    use super::*;
    use crate::math::Vec3;

    #[test]
    fn it_is_the_parallelogram_around_the_centre() {
        let of = |normal| {
            let desc = RectangleShapeDesc { normal, ..RectangleShapeDesc::new([1.0, 2.0, 3.0], [4.0, 2.0]) };
            made(|cx| desc.compile(cx))
        };
        // Facing the viewer: u to the right, v up
        let wall = of([0.0, 0.0, 5.0]);
        assert_eq!((wall.n, wall.p), (DVec3::Z, DVec3::new(-1.0, 1.0, 3.0)));
        assert_eq!((wall.u_axis, wall.v_axis), (DVec3::X * 0.25, DVec3::Y * 0.5));
        assert_eq!(wall.corners[2], Vec3::new(3.0, 3.0, 3.0));
        let floor = of([0.0, 1.0, 0.0]);
        assert_eq!((floor.n, floor.u_axis, floor.v_axis), (DVec3::Y, DVec3::X * 0.25, DVec3::NEG_Z * 0.5));
        assert_eq!(floor.p, DVec3::new(-1.0, 2.0, 4.0));
    }

    #[test]
    fn up_is_made_perpendicular() {
        let desc = RectangleShapeDesc {
            normal: [0.0, 0.0, 1.0],
            up: Some([3.0, 0.0, 7.0]),
            ..RectangleShapeDesc::new([0.0; 3], [1.0, 1.0])
        };
        let turned = made(|cx| desc.compile(cx));
        assert_eq!((turned.v_axis, turned.u_axis, turned.n), (DVec3::X, DVec3::NEG_Y, DVec3::Z));
    }

    #[test]
    fn faults_are_told() {
        let flat = RectangleShapeDesc::new([0.0; 3], [1.0, 0.0]);
        assert_eq!(faults(|cx| flat.compile(cx))[0].0, "size[1]");
        let parallel =
            RectangleShapeDesc { up: Some([0.0, 1.0, 0.0]), ..RectangleShapeDesc::new([0.0; 3], [1.0, 1.0]) };
        let found = faults(|cx| parallel.compile(cx));
        assert!(found.len() == 1 && found[0].0 == "up", "{found:?}");
        let no_up = RectangleShapeDesc { up: Some([0.0; 3]), ..parallel };
        assert!(faults(|cx| no_up.compile(cx))[0].1.contains("has no length"));
    }
}
