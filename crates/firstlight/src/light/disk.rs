//! Disk lights.

use std::f64::consts::FRAC_PI_4;

use pxfm::f_sincos;

use super::Light;
use super::area::{AreaShape, area_table};
use crate::context::{CompileContext, show};
use crate::describe::SamplesDesc;
use crate::math::{DRay, DVec3, Frame, Ray};
use crate::shape::Disk as DiskShape;
use crate::transform::TransformDesc;

area_table! {
    /// A round disk that shines: soft shadows.
    ///
    /// Physical: every point sends the radiance L = color x strength to its emitting side;
    /// E = integral of L cos cos' / d^2 dA, which is pi L R^2 / (R^2 + h^2) at the height h below its middle. Constant: the
    /// mean over the area of color x strength.
    ///
    /// ```toml
    /// [[light.disk]]
    /// center = [0, 3, 0]
    /// normal = [0, -1, 0]
    /// radius = 0.5
    /// strength = 10
    /// ```
    pub struct DiskLightDesc {
        /// The middle, in metres, world space.
        pub center: [f64; 3],
        /// The direction its front faces, of any length above 1e-9.
        pub normal: [f64; 3],
        /// Radius in metres, 1e-9 to 2.5e8.
        pub radius: f64,
        /// Where it is moved; it has to leave the disk round. Mirrored, it keeps its front.
        pub transform: Option<Box<TransformDesc>> = None,
    }
}

/// The shape of a disk light, in world space.
#[derive(Clone, Copy, Debug)]
pub struct Disk {
    /// The middle.
    pub center: DVec3,
    /// Unit normal of the front.
    pub n: DVec3,
    /// From the middle to the rim.
    pub a: DVec3,
    /// From the middle to the rim, perpendicular to `a`: a x b points along `n`.
    pub b: DVec3,
    /// The length of `a` and of `b`.
    pub radius: f64,
    /// What the camera sees, and what stands in the way of other lights if it blocks.
    pub(crate) shape: DiskShape,
    /// Whether camera rays pass through from behind.
    single_sided: bool,
}

/// A transform that leaves two perpendicular radii with a larger sine of their angle off the right one, or with lengths of
/// a larger relative difference, makes an ellipse.
const MAX_SKEW: f64 = 1e-6;

impl DiskLightDesc {
    /// `samples` is the scene's default.
    pub(crate) fn compile(&self, cx: &mut CompileContext, samples: SamplesDesc) -> Light {
        cx.point("center", self.center);
        cx.edge("normal", self.normal);
        let mut radius = cx.positive("radius", self.radius, "the radius is in metres");
        let mut center = DVec3::from(self.center);
        let mut frame = Frame::around(DVec3::from(self.normal).normalize_or(DVec3::Y));
        if let Some(world_from_object) = TransformDesc::compile_field(self.transform.as_deref(), cx) {
            center = cx.moved_point(world_from_object, center);
            let before = cx.fault_count();
            let x = cx.moved_edge(world_from_object, "the radius", frame.x * radius);
            let y = world_from_object.transform_vector3(frame.y * radius);
            let (long, wide) = (x.length(), y.length());
            let round = x.dot(y).abs() <= MAX_SKEW * long * wide && (long - wide).abs() <= MAX_SKEW * long;
            if cx.fault_count() == before && !round {
                let (x, y) = (show(&x.to_array()), show(&y.to_array()));
                let message = format!("it makes an ellipse of the disk: {x} and {y} of two of its radii");
                cx.error("transform", message, Some("scale the disk alike along every direction in its plane"));
            }
            let n = x.cross(y).normalize_or(frame.z) * world_from_object.matrix3.determinant().signum();
            let x = x.normalize_or(frame.x);
            (radius, frame) = (long, Frame { x, y: n.cross(x), z: n });
        }
        let (emitter, center) = (self.emitter(), cx.local(center));
        let disk = Disk {
            center,
            n: frame.z,
            a: frame.x * radius,
            b: frame.y * radius,
            radius,
            shape: DiskShape::new(center, frame, radius),
            single_sided: !emitter.both_sides(),
        };
        emitter.compile(cx, AreaShape::Disk(disk), samples)
    }
}

/// The point of the unit disk that stands for a point of the square [-1, 1]^2.
pub(crate) fn concentric([x, y]: [f64; 2]) -> [f64; 2] {
    if x == 0.0 && y == 0.0 {
        return [0.0; 2];
    }
    let (r, angle) = if x.abs() > y.abs() { (x, FRAC_PI_4 * (y / x)) } else { (y, FRAC_PI_4 * (2.0 - x / y)) };
    let (sin, cos) = f_sincos(angle);
    [r * cos, r * sin]
}

impl Disk {
    /// The point that stands for `uv` of the unit square: squares around its middle become circles.
    ///
    /// Source: Shirley, Chiu, "A low distortion map between disk and square", Journal of Graphics Tools 2(3), 1997.
    pub(super) fn point(&self, uv: [f64; 2]) -> DVec3 {
        let [x, y] = uv.map(|w| 2.0 * w - 1.0);
        let [x, y] = concentric([x, y]);
        self.center + self.a * x + self.b * y
    }

    #[inline(always)]
    pub(super) fn intersect(&self, ray: &Ray) -> Option<f64> {
        let ray = DRay { o: ray.o.as_dvec3(), d: ray.d.as_dvec3() };
        self.shape.intersect(&ray, 0.0, f64::INFINITY, self.single_sided).map(|hit| hit.t)
    }
}
