//! Rectangle lights.

use super::Light;
use super::area::{AreaShape, area_table};
use crate::context::{CompileContext, show};
use crate::describe::SamplesDesc;
use crate::math::DVec3;
use crate::shape::Parallelogram;
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
    pub struct RectangleDesc {
        /// The middle, in metres, world space.
        pub center: [f64; 3],
        /// One side, full length, in metres.
        pub e0: [f64; 3],
        /// The other side, full length, in metres; perpendicular to `e0`. The front is where e0 x e1 points.
        pub e1: [f64; 3],
        /// Where it is moved; it moves `center` and both sides, which may make a parallelogram of it. Mirrored, it keeps its
        /// front.
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
    /// `samples` is the scene's default.
    pub(crate) fn compile(&self, cx: &mut CompileContext, samples: SamplesDesc) -> Light {
        cx.point("center", self.center);
        let mut center = DVec3::from(self.center);
        let (mut e0, mut e1) = (DVec3::from(self.e0), DVec3::from(self.e1));
        let edges_fine = cx.edge("e0", self.e0) & cx.edge("e1", self.e1);
        if edges_fine && !(e0.dot(e1).abs() <= MAX_SKEW * e0.length() * e1.length()) {
            let message = format!("{} is not perpendicular to e0 = {}", show(&self.e1), show(&self.e0));
            cx.error("e1", message, Some("the sides of a rectangle meet at right angles"));
        }
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
    pub(super) fn point(&self, [a, b]: [f64; 2]) -> DVec3 {
        self.shape.p + self.e0 * a + self.e1 * b
    }
}
