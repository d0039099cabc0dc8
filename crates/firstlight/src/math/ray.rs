//! Rays, and how sure we are of where they start.

use super::{DVec3, UNIT_ROUNDOFF, Vec3};

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
    /// Of a point that was found in f64 from terms of these absolute values, and then rounded to `p`. Nearly always the last
    /// rounding alone: it grows neither with the distance of the camera nor with the size of the shape.
    #[inline(always)]
    pub fn of_rounded(p: Vec3, terms: DVec3) -> Self {
        ErrorBound(p.abs() * (4.0 * UNIT_ROUNDOFF) + (terms * (8.0 * f64::EPSILON)).as_vec3())
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
