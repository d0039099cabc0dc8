//! How much of a light reaches a point, settled from proof to work.
//!
//! A [`Shaft`] is the space between some points and a light. [`OccluderList::gather`] finds what lies in it, once for
//! all the points: mostly nothing, and then all of the light arrives. What is left is looked at from each point by
//! [`ShadowView::classify`]: below the horizon, lit by all of the light, hidden from all of it, or cut by some edge. In
//! the last case [`ShadowView::mask`] says which of the light's sampled points are hidden, a bit for each.
//!
//! Every answer is a proof that the plain renderer's own tests would all have answered the same, rounding included;
//! where a proof fails by a hair's breadth, that test itself is asked. So pictures have the same bits with and without.
//!
//! Before it stand the scene and its shapes; after it, the renderer.

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
pub(crate) use occluders::{OccluderList, ShadowMesh};
pub(crate) use resolver::{VisibilityResolver, VisibilityStats};
pub(crate) use shaft::Shaft;
pub(crate) use target::Target;
pub(crate) use view::{ShadowView, Visibility};

use crate::math::{ErrorBound, Facet, LightEnd, ShadowRay, Vec3};
use crate::shape::SurfaceInteraction;

/// A point that light is gathered from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Viewpoint {
    pub p: Vec3,
    pub error: ErrorBound,
    /// Where rays start.
    pub start: Vec3,
    /// Light with horizon.l <= 0 or ns.l <= 0 does not count.
    pub horizon: Vec3,
    pub ns: Vec3,
    /// What does not stand in the way.
    pub but: Facet,
}

impl Viewpoint {
    #[inline(always)]
    pub fn of(si: &SurfaceInteraction) -> Self {
        let start = si.shadow_start();
        Viewpoint { p: si.lit_from, error: si.error, start, horizon: si.horizon, ns: si.ns, but: si.facet }
    }

    /// The distance of `start` from `p` along each axis, rounded up.
    pub fn apart(&self) -> Vec3 {
        (self.start - self.p).abs() * 1.0001
    }

    /// A ray along `l` towards a light.
    #[inline(always)]
    pub fn ray(&self, to: LightEnd, l: Vec3, finite: bool) -> ShadowRay {
        let t_max = if finite { 1.0 } else { f32::INFINITY };
        ShadowRay { p: self.p, error: self.error, start: self.start, l, t_max, to, but: self.but }
    }
}
