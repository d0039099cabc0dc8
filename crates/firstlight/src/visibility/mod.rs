//! Visibility of lights from points: full, none, or a mask of the light's samples.
//!
//! A [`Shaft`] is the convex hull of some points and a light. [`OccluderList::gather`] finds the occluders in it, once
//! for all the points; if there are none, the light is fully visible. [`ShadowView::classify`] tests the occluders of
//! one point against the whole light: the light is below the point's horizon, fully visible, hidden, or the point is in
//! the penumbra. In the penumbra [`ShadowView::mask`] computes which of the light's samples are hidden, a bit for each.
//!
//! All results are conservative: each is a proof that the shadow-ray tests of the plain renderer give the same,
//! rounding included. Where the margin is too small for a proof, that test itself decides. So pictures of sampled
//! lights have the same bits with and without this module; the default renderer also chooses by it how it samples.

mod cluster_visibility;
mod mask;
mod occluders;
mod resolver;
mod shaft;
mod target;
#[cfg(test)]
mod tests;
mod view;

pub(crate) use cluster_visibility::ClusterVisibility;
pub(crate) use occluders::OccluderList;
pub(crate) use resolver::{VisibilityResolver, VisibilityStats};
pub(crate) use shaft::Shaft;
pub(crate) use target::Target;
pub(crate) use view::{ShadowView, Visibility};

use crate::material::ShadingPoint;
use crate::math::{ErrorBound, Facet, LightEnd, ShadowRay, Vec3};

/// A point to be lit, as far as its visibility depends on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Viewpoint {
    pub p: Vec3,
    pub error: ErrorBound,
    /// The origin of shadow rays.
    pub start: Vec3,
    /// Light from `l` with horizon.l <= 0 or ns.l <= 0 does not reach the point.
    pub horizon: Vec3,
    pub ns: Vec3,
    /// The triangle that the point lies on, which does not occlude it.
    pub but: Facet,
}

impl Viewpoint {
    #[inline(always)]
    pub fn of(point: &ShadingPoint) -> Self {
        let ShadingPoint { p, error, horizon, ns, facet, .. } = *point;
        Viewpoint { p, error, start: point.shadow_start(), horizon, ns, but: facet }
    }

    /// The distance of `start` from `p` along each axis, rounded up.
    pub fn apart(&self) -> Vec3 {
        (self.start - self.p).abs() * 1.0001
    }

    /// A shadow ray along `l` to a light; `finite` if it ends there, at t = 1.
    #[inline(always)]
    pub fn ray(&self, to: LightEnd, l: Vec3, finite: bool) -> ShadowRay {
        let t_max = if finite { 1.0 } else { f32::INFINITY };
        ShadowRay { p: self.p, error: self.error, start: self.start, l, t_max, to, but: self.but }
    }
}
