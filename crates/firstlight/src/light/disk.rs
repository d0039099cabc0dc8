//! Disk lights.

use super::Light;
use super::area::{AreaShape, are_round, area_table, front};
use crate::context::{CompileContext, show};
use crate::describe::SamplesDesc;
use crate::math::{Axes, DRay, DVec3, Ray, sin_cos_of_turns};
use crate::shape::Disk;
use crate::transform::TransformDesc;

area_table! {
    /// A round disk that shines: soft shadows.
    ///
    /// Physical: every point sends the radiance L = color x strength to its emitting side;
    /// E = integral of L cos cos' / d^2 dA, which is pi L R^2 / (R^2 + h^2) at the height h below its middle. Constant:
    /// the mean over the area of color x strength.
    ///
    /// ```toml
    /// [[light.disk]]
    /// center = [0, 3, 0]
    /// look_at = [0, 0, 0]
    /// radius = 0.5
    /// strength = 10
    /// ```
    pub struct DiskLightDesc {
        /// The middle, in metres, world space.
        pub center: [f64; 3],
        /// The direction that the front faces, of any length above 1e-9. With neither it nor `look_at` the front faces
        /// straight down, [0, -1, 0].
        pub normal: Option<[f64; 3]> = None,
        /// The point that the front faces, in metres, world space; instead of `normal`.
        pub look_at: Option<[f64; 3]> = None,
        /// Radius in metres, 1e-9 to 2.5e8; it or `size` is needed.
        pub radius: Option<f64> = None,
        /// Diameter in metres, 1e-9 to 2.5e8, instead of `radius`.
        pub size: Option<f64> = None,
        /// Where it is moved; it has to leave the disk round. Mirrored, it keeps its front.
        pub transform: Option<Box<TransformDesc>> = None,
    }
}

/// The shape of a disk light, in world space.
#[derive(Clone, Copy, Debug)]
pub struct DiskLight {
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
    pub(crate) shape: Disk,
    /// Whether camera rays pass through from behind.
    single_sided: bool,
}

impl DiskLightDesc {
    /// By its middle, the direction that its front faces, and its radius.
    pub fn with_normal(center: [f64; 3], normal: [f64; 3], radius: f64) -> Self {
        Self { normal: Some(normal), radius: Some(radius), ..Self::new(center) }
    }

    fn radius(&self, cx: &mut CompileContext) -> f64 {
        match (self.radius, self.size) {
            (Some(radius), None) => cx.positive("radius", radius, "the radius is in metres"),
            (None, Some(size)) => cx.positive("size", size, "the diameter is in metres") * 0.5,
            (None, None) => {
                cx.error("radius", "is missing, and so is size", Some("write radius = ..., in metres"));
                1.0
            }
            (Some(radius), Some(size)) => {
                let message = format!("{size} is given beside radius = {radius}");
                cx.error("size", message, Some("size is the diameter; keep one of them"));
                1.0
            }
        }
    }

    /// `samples` is the scene's default.
    pub(crate) fn compile(&self, cx: &mut CompileContext, samples: SamplesDesc) -> Light {
        cx.point("center", self.center);
        let mut frame =
            Axes::around(DVec3::from(front(cx, self.center, self.look_at, self.normal)).normalize_or(DVec3::Y));
        let mut radius = self.radius(cx);
        let mut center = DVec3::from(self.center);
        if let Some(world_from_object) = TransformDesc::compile_field(self.transform.as_deref(), cx) {
            center = cx.moved_point(world_from_object, center);
            let before = cx.fault_count();
            let x = cx.moved_edge(world_from_object, "the radius", frame.x * radius);
            let y = world_from_object.transform_vector3(frame.y * radius);
            if cx.fault_count() == before && !are_round(&[x, y]) {
                let (x, y) = (show(&x.to_array()), show(&y.to_array()));
                let message = format!("it makes an ellipse of the disk: {x} and {y} of two of its radii");
                cx.error("transform", message, Some("scale the disk alike along every direction in its plane"));
            }
            let n = x.cross(y).normalize_or(frame.z) * world_from_object.matrix3.determinant().signum();
            radius = x.length();
            let x = x.normalize_or(frame.x);
            frame = Axes { x, y: n.cross(x), z: n };
        }
        let (emitter, center) = (self.emitter(), cx.local(center));
        let disk = DiskLight {
            center,
            n: frame.z,
            a: frame.x * radius,
            b: frame.y * radius,
            radius,
            shape: Disk::new(center, frame, radius),
            single_sided: !emitter.both_sides(),
        };
        emitter.compile(cx, AreaShape::Disk(disk), samples)
    }
}

impl DiskLight {
    /// The point that stands for `uv` of the unit square: squares around its middle become circles.
    ///
    /// Source: Shirley, Chiu, "A low distortion map between disk and square", Journal of Graphics Tools 2(3), 1997.
    #[inline(always)]
    pub(super) fn point(&self, uv: [f64; 2]) -> DVec3 {
        let [x, y] = uv.map(|w| 2.0 * w - 1.0);
        let is_flat = x.abs() > y.abs();
        let (r, other) = if is_flat { (x, y) } else { (y, x) };
        let part = if r == 0.0 { 0.0 } else { other / r };
        let (sin, cos) = sin_cos_of_turns(0.125 * if is_flat { part } else { 2.0 - part });
        self.center + self.a * (r * cos) + self.b * (r * sin)
    }

    #[inline(always)]
    pub(super) fn intersect(&self, ray: &Ray) -> Option<f64> {
        let ray = DRay { o: ray.o.as_dvec3(), d: ray.d.as_dvec3() };
        self.shape.intersect(&ray, 0.0, f64::INFINITY, self.single_sided).map(|hit| hit.t)
    }
}
