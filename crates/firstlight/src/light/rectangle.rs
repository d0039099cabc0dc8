//! Rectangle lights.

use super::Light;
use super::area::{AreaShape, area_table, front};
use crate::context::{CompileContext, show};
use crate::describe::SamplesDesc;
use crate::math::DVec3;
use crate::shape::{Parallelogram, facing};
use crate::transform::TransformDesc;

area_table! {
    /// A rectangle that shines: soft shadows.
    ///
    /// Physical: every point sends the radiance L = color x strength to its emitting side;
    /// E = integral of L cos cos' / d^2 dA. Constant: the mean over the area of color x strength.
    ///
    /// ```toml
    /// [[light.rectangle]]
    /// center = [0, 5.9, -6]
    /// e0 = [2, 0, 0]
    /// e1 = [0, 0, 2]
    /// falloff = "constant"
    /// ```
    ///
    /// The sides are said by `e0` and `e1`, or by `size` with `look_at` or `normal`:
    ///
    /// ```toml
    /// [[light.rectangle]]
    /// center = [3, 4, 2]
    /// size = [2, 1]
    /// look_at = [0, 1, 0]
    /// strength = 20
    /// ```
    pub struct RectangleDesc {
        /// The middle, in metres, world space.
        pub center: [f64; 3],
        /// One side, full length, in metres; with `e1`, instead of `size`.
        pub e0: Option<[f64; 3]> = None,
        /// The other side, full length, in metres; perpendicular to `e0`. The front is where e0 x e1 points.
        pub e1: Option<[f64; 3]> = None,
        /// Width and height in metres, 1e-9 to 2.5e8 each, instead of `e0` and `e1`. The height lies along `up`.
        pub size: Option<[f64; 2]> = None,
        /// The point that the front faces, in metres, world space; with `size`.
        pub look_at: Option<[f64; 3]> = None,
        /// The direction that the front faces, of any length above 1e-9; with `size`, instead of `look_at`. With
        /// neither of them the front faces straight down, [0, -1, 0].
        pub normal: Option<[f64; 3]> = None,
        /// The direction of the height, made perpendicular to where the front faces; not parallel to it. Without it +y;
        /// of a light that faces straight up -z, straight down +z.
        pub up: Option<[f64; 3]> = None,
        /// Where it is moved; it moves `center` and both sides, which may make a parallelogram of it. Mirrored, it
        /// keeps its front.
        pub transform: Option<Box<TransformDesc>> = None,
    }
}

/// The shape of a rectangle light, in world space.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    /// The middle.
    pub center: DVec3,
    /// One side, full length.
    pub e0: DVec3,
    /// The other side, full length.
    pub e1: DVec3,
    /// Unit normal of the front.
    pub n: DVec3,
    /// What the camera sees, and what stands in the way of other lights if it blocks.
    pub shape: Parallelogram,
}

/// Sides that are farther from a right angle than this sine are not those of a rectangle.
const MAX_SKEW: f64 = 1e-5;

/// Sides that a transform leaves at an angle of a smaller sine than this have no area.
const MIN_SINE: f64 = 1e-6;

impl RectangleDesc {
    /// By its middle and its sides, which are perpendicular to each other.
    pub fn with_edges(center: [f64; 3], e0: [f64; 3], e1: [f64; 3]) -> Self {
        Self { e0: Some(e0), e1: Some(e1), ..Self::new(center) }
    }

    /// Both sides, and whether they are fine.
    fn edges(&self, cx: &mut CompileContext) -> (DVec3, DVec3, bool) {
        let before = cx.fault_count();
        if self.e0.is_none() && self.e1.is_none() {
            let Some(size) = self.size else {
                let message = "is missing, and so are e0 and e1: the light has no size";
                cx.error("size", message, Some("write size = [width, height], with look_at or normal"));
                return (DVec3::X, DVec3::Z, false);
            };
            for (i, size) in size.iter().enumerate() {
                cx.positive(&format!("size[{i}]"), *size, "width and height are in metres");
            }
            let front = front(cx, self.center, self.look_at, self.normal);
            // Where the light faces nowhere, nothing is parallel to that
            let up = if cx.fault_count() == before { self.up } else { None };
            let frame = facing(cx, front, up);
            return (frame.x * size[0], frame.y * size[1], cx.fault_count() == before);
        }
        // By its sides, and by nothing else
        let (e0, e1) = (self.e0.unwrap_or([1.0, 0.0, 0.0]), self.e1.unwrap_or([0.0, 0.0, 1.0]));
        for (field, other, said) in [("e0", "e1", self.e0), ("e1", "e0", self.e1)] {
            match said {
                Some(edge) => drop(cx.edge(field, edge)),
                None => cx.error(field, format!("is missing beside {other}"), Some("a rectangle has two sides")),
            }
        }
        if self.size.is_some() {
            let hint = "keep e0 and e1, or size with look_at or normal";
            cx.error("size", "the sides are said twice, by e0 and e1 and by size", Some(hint));
        }
        for (field, said) in [("look_at", self.look_at), ("normal", self.normal), ("up", self.up)] {
            if said.is_some() {
                let hint = "leave it out, or say the sides by size instead";
                cx.error(field, "e0 and e1 say already where the light faces", Some(hint));
            }
        }
        let (fine, a, b) = (cx.fault_count() == before, DVec3::from(e0), DVec3::from(e1));
        if fine && !(a.dot(b).abs() <= MAX_SKEW * a.length() * b.length()) {
            let message = format!("{} is not perpendicular to e0 = {}", show(&e1), show(&e0));
            cx.error("e1", message, Some("the sides of a rectangle meet at right angles"));
        }
        (a, b, fine)
    }

    /// `samples` is the scene's default.
    pub(crate) fn compile(&self, cx: &mut CompileContext, samples: SamplesDesc) -> Light {
        cx.point("center", self.center);
        let mut center = DVec3::from(self.center);
        let (mut e0, mut e1, edges_fine) = self.edges(cx);
        let mut front = 1.0;
        if let Some(world_from_object) = TransformDesc::compile_field(self.transform.as_deref(), cx) {
            center = cx.moved_point(world_from_object, center);
            e0 = cx.moved_edge(world_from_object, "e0", e0);
            e1 = cx.moved_edge(world_from_object, "e1", e1);
            front = world_from_object.matrix3.determinant().signum();
            if edges_fine && !(e0.cross(e1).length() > MIN_SINE * e0.length() * e1.length()) {
                let (e0, e1) = (show(&e0.to_array()), show(&e1.to_array()));
                let message = format!("it makes {e0} of e0 and {e1} of e1: there is no area between them");
                cx.error("transform", message, Some("choose another transform"));
            }
        }
        let (emitter, center) = (self.emitter(), cx.local(center));
        let shape = Parallelogram::new(center - (e0 + e1) * 0.5, e0, e1, front, !emitter.both_sides());
        let rectangle = Rectangle { center, e0, e1, n: shape.n, shape };
        emitter.compile(cx, AreaShape::Rectangle(rectangle), samples)
    }
}

impl Rectangle {
    /// The point of the coordinates `a` along `e0` and `b` along `e1`.
    #[inline(always)]
    pub(super) fn point(&self, [a, b]: [f64; 2]) -> DVec3 {
        self.shape.p + self.e0 * a + self.e1 * b
    }
}

#[cfg(test)]
mod tests {
    use super::super::LightKind;
    use super::*;

    /// The rectangle of a description without faults.
    fn rectangle(desc: &RectangleDesc) -> Rectangle {
        let cx = &mut CompileContext::default();
        let light = desc.compile(cx, SamplesDesc::Exact);
        assert_eq!(cx.take_faults(), []);
        match light.kind {
            LightKind::Area(area) => match area.shape {
                AreaShape::Rectangle(rectangle) => rectangle,
                other => panic!("{other:?}"),
            },
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_size_is_the_same_as_two_sides() {
        let sized = RectangleDesc { size: Some([4.0, 2.0]), ..RectangleDesc::new([1.0, 5.0, 3.0]) };
        // Straight down unless said: up in the picture of who looks up from below is +z
        let down = rectangle(&sized);
        assert_eq!((down.n, down.e1), (DVec3::NEG_Y, DVec3::Z * 2.0));
        let edges = rectangle(&RectangleDesc::with_edges([1.0, 5.0, 3.0], down.e0.into(), down.e1.into()));
        assert_eq!((edges.e0, edges.e1, edges.n, edges.shape.p), (down.e0, down.e1, down.n, down.shape.p));
        // The front faces what it looks at
        let looks = rectangle(&RectangleDesc { look_at: Some([1.0, 5.0, -7.0]), ..sized.clone() });
        let faces = rectangle(&RectangleDesc { normal: Some([0.0, 0.0, -3.0]), ..sized.clone() });
        for light in [looks, faces] {
            assert_eq!((light.n, light.e0, light.e1), (DVec3::NEG_Z, DVec3::X * -4.0, DVec3::Y * 2.0));
        }
        let askew = rectangle(&RectangleDesc { look_at: Some([0.0, 1.0, 0.0]), ..sized.clone() });
        assert!(askew.n.dot(DVec3::new(-1.0, -4.0, -3.0).normalize()) > 1.0 - 1e-15);
        assert!(askew.e0.y.abs() < 1e-15 && askew.e1.y > 0.0, "level, its height upwards");
        let turned = rectangle(&RectangleDesc { normal: Some([0.0, 0.0, 1.0]), up: Some([1.0, 0.0, 9.0]), ..sized });
        assert_eq!((turned.e0, turned.e1), (DVec3::Y * -4.0, DVec3::X * 2.0));
    }
}
