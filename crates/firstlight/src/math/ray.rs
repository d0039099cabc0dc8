//! Rays, and how sure we are of where they start.

use super::{UNIT_ROUNDOFF, Vec3};

/// A camera ray: the points `o + t d`, 0 < t.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Origin, world space.
    pub o: Vec3,
    /// Direction, unit.
    pub d: Vec3,
}

/// A bound on how far a computed point can be from the surface it stands for, along each axis, in metres.
///
/// A surface nearer to a point than this cannot be told from the one the point lies on, so it cannot shadow the point.
/// That is what keeps a ray from hitting its own starting point, at every scale, without a constant of the scene.
#[derive(Clone, Copy, Debug)]
pub struct ErrorBound(pub Vec3);

impl ErrorBound {
    /// Of a point found as `o + t d`, and then moved onto the plane through a corner that is `from_corner` away: the
    /// rounding of the sums and of the products, and that of the plane's normal, which moves the plane the more the
    /// farther the corner is; with room to spare. Standard model of floating-point error: Higham, "Accuracy and Stability
    /// of Numerical Algorithms", section 3.1.
    #[inline(always)]
    pub fn along(ray: &Ray, t: f32, from_corner: Vec3) -> Self {
        ErrorBound((ray.o.abs() + (ray.d * t).abs() + from_corner.abs()) * (8.0 * UNIT_ROUNDOFF))
    }

    /// Of a point found as `c + r n`, n unit.
    #[inline(always)]
    pub fn around(c: Vec3, r: f32) -> Self {
        ErrorBound((c.abs() + Vec3::splat(r)) * (8.0 * UNIT_ROUNDOFF))
    }

    /// The bound along a direction of any length, given as absolute values.
    #[inline(always)]
    pub fn along_axis(self, abs_axis: Vec3) -> f32 {
        abs_axis.dot(self.0)
    }
}

/// A ray from a surface towards a light: the points `p + t l`, 0 < t < t_max.
#[derive(Clone, Copy, Debug)]
pub struct ShadowRay {
    /// Where it starts, on a surface.
    pub p: Vec3,
    /// How sure we are of `p`.
    pub error: ErrorBound,
    /// Towards the light, of any length.
    pub l: Vec3,
    /// 1 where `l` reaches the light, infinite where the light is infinitely far away.
    pub t_max: f32,
}
