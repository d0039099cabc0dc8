//! What a ray sees, in world space: the questions that are asked from outside.
//!
//! Inside, a scene counts its coordinates from an origin of its own, in 32 bits ([`Scene::origin`]); here they are
//! those of the world, in 64.

use super::Scene;
use super::geometry::Hit;
use super::trace::TracedHit;
use crate::color::Rgb;
use crate::ids::{LightId, MaterialId, SurfaceId};
use crate::math::{DVec3, ShadowRay, Vec2, Vec3, WorldRay};
use crate::shape::{Footprint, RayDifferential, SurfaceInteraction};

/// What a camera ray ends at.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is one of it at a time")]
pub enum CameraHit {
    /// A surface to be lit.
    Surface(SurfacePoint),
    /// A light, seen as its colour.
    Emission(Rgb),
    /// Nothing.
    Background,
}

/// A surface seen from one side.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// The point, world space.
    pub p: DVec3,
    /// Geometric normal: unit, on the viewer's side.
    pub ng: Vec3,
    /// Shading normal: unit, turned together with `ng`.
    pub ns: Vec3,
    /// Where light is gathered: `p`, or where it is lifted to from a facet that stands for something round; see
    /// [`ShadowTerminator`](crate::ShadowTerminator).
    pub lit_from: DVec3,
    /// The normal of the horizon that light comes from above of: `ng`, or `ns` where the point is lifted.
    pub horizon: Vec3,
    /// To the viewer, unit.
    pub wo: Vec3,
    /// Texture coordinate, 0 to 1 on the shape.
    pub uv: Vec2,
    /// The patch of texture that the camera ray stands for.
    pub footprint: Footprint,
    /// Multiplies the colours of the material: linear Rec. 709.
    pub color: Rgb,
    /// What was hit.
    pub surface: SurfaceId,
    /// Its material.
    pub material: MaterialId,
    /// Whether other things, and itself, can take its light away.
    pub receives_shadow: bool,
    /// The same in the scene's own coordinates.
    pub(crate) local: SurfaceInteraction,
}

impl Scene {
    /// Where the scene's own coordinates, which are of 32 bits, count from, in world space: 0, but where all of the
    /// scene is far from there. What is asked and answered is in world space all the same.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The first surface on a ray that a camera can see; of several at the same distance, the one with the lowest id.
    /// Surfaces with an alpha of less than one half, and holes of masks, are passed.
    pub fn intersect(&self, ray: &WorldRay) -> Option<Hit> {
        let (local, way) = self.enter(ray);
        self.first_shown(&local).map(|hit| Hit { t: hit.t + way, ..hit })
    }

    /// The surface at a hit, turned to the viewer. `differential` is that of the camera ray.
    ///
    /// # Panics
    /// If the hit is a light's: a light has no material.
    pub fn surface(&self, ray: &WorldRay, hit: &Hit, differential: &RayDifferential) -> SurfacePoint {
        let (ray, way) = self.enter(ray);
        self.in_world(self.local_surface(&ray, &Hit { t: hit.t - way, ..*hit }, differential))
    }

    /// The triangle of a mesh or the point of a point set that was hit, in the order of its file; `None` on all else.
    pub fn primitive(&self, hit: &Hit) -> Option<u32> {
        self.geometry.primitive(hit)
    }

    /// How the point of a hit moves with u, and with v: metres for 1. Not orthogonal, and no length where uv has no
    /// direction. Asked for apart from [`surface`](Self::surface), because few need it.
    ///
    /// # Panics
    /// If the hit is a light's.
    pub fn tangents(&self, ray: &WorldRay, hit: &Hit) -> [Vec3; 2] {
        let (ray, way) = self.enter(ray);
        self.geometry.tangents(&ray, &Hit { t: hit.t - way, ..*hit }).map(|d| d.as_vec3())
    }

    /// What a camera ray ends at.
    pub fn look(&self, ray: &WorldRay, differential: &RayDifferential) -> CameraHit {
        let (ray, _) = self.enter(ray);
        let hit = self.shown(&ray, differential, self.intersect_local(&ray));
        match self.see(&ray, hit, differential) {
            TracedHit::Surface(si) => CameraHit::Surface(self.in_world(si)),
            TracedHit::Emission(color) => CameraHit::Emission(color),
            TracedHit::Background => CameraHit::Background,
        }
    }

    /// A ray from `surface` to each of the [points](Self::light_points) of a light that are above the surface's
    /// horizon, for [`occluded`](Self::occluded). Those below it send nothing, so the share of the points whose rays
    /// are not occluded is the visible fraction of the light.
    ///
    /// # Panics
    /// If the scene has no such light.
    pub fn shadow_rays(&self, surface: &SurfacePoint, light: LightId) -> impl Iterator<Item = ShadowRay> + use<'_> {
        let si = surface.local;
        let from = &self.lights[light.index()];
        let (end, floor) = (self.light_end(light), from.floor(si.lit_from, si.error, si.horizon));
        (0..from.samples()).filter_map(move |k| {
            let to = from.towards(k, si.lit_from);
            let is_above = si.horizon.dot(to.l) > floor && si.ns.dot(to.l) > 0.0;
            is_above.then(|| si.shadow_ray(end, to.l, if to.finite { 1.0 } else { f32::INFINITY }))
        })
    }

    /// A ray from `surface` to a point, world space, for [`occluded`](Self::occluded): whether the two see each other,
    /// as far as the shadows of `light` go. Whether the point is above the horizon is not looked at.
    pub fn shadow_ray_to(&self, surface: &SurfacePoint, light: LightId, point: DVec3) -> ShadowRay {
        surface.local.shadow_ray(self.light_end(light), (point - surface.lit_from).as_vec3(), 1.0)
    }

    fn in_world(&self, local: SurfaceInteraction) -> SurfacePoint {
        let world = |p: Vec3| self.origin + p.as_dvec3();
        let SurfaceInteraction { ng, ns, horizon, wo, uv, footprint, color, surface, material, .. } = local;
        let (p, lit_from, receives_shadow) = (world(local.p), world(local.lit_from), local.receives_shadow);
        SurfacePoint {
            p,
            ng,
            ns,
            lit_from,
            horizon,
            wo,
            uv,
            footprint,
            color,
            surface,
            material,
            receives_shadow,
            local,
        }
    }
}
