//! Numbers: vectors, rays, powers, and the contract's order of sums.
//!
//! Everything here gives the same bits on every machine: + - x / and square root only, or `pxfm`.

mod arc;
mod frame;
mod lanes;
mod origin;
mod pow;
mod ray;
mod roots;
mod sum;
mod trig;

pub(crate) use arc::{Arc, DirectionCone};
pub(crate) use frame::Axes;
pub(crate) use lanes::{Vec3x16, dispatch_wide, least_and_most, only, sum_of_runs, total};
pub(crate) use origin::{origin_for, origin_of_view};
pub(crate) use pow::{Exponent, ExponentLanes};
pub(crate) use ray::{DRay, ErrorBound, Facet, LightEnd, Ray};
pub use ray::{ShadowRay, WorldRay};
pub(crate) use roots::{bracketed, depressed_cubic};
pub(crate) use sum::{LANES, LaneSum};
pub(crate) use trig::{asin, sin_cos, sin_cos_of_turns};

pub use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, Mat3, Vec2, Vec3};

/// Half the distance between 1 and the next `f32`: the relative error of one rounded operation.
pub(crate) const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;

/// A description's numbers as they are computed with.
#[inline]
pub(crate) fn vec3(v: [f64; 3]) -> Vec3 {
    Vec3::new(v[0] as f32, v[1] as f32, v[2] as f32)
}

/// The largest whole number that is not above `x`: what `f64::floor` says, which is a call where the processor is not
/// known to have an instruction for it.
#[inline(always)]
pub(crate) fn floor(x: f64) -> f64 {
    // From here on all numbers are whole; also no number, and infinity
    if !(x.abs() < (1u64 << 52) as f64) {
        return x;
    }
    let whole = x as i64 as f64;
    if whole > x { whole - 1.0 } else { whole }
}

/// x^2.
#[inline(always)]
pub(crate) fn square(x: f32) -> f32 {
    x * x
}
