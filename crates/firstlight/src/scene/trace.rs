//! What a ray sees, and whether light gets through.

use fearless_simd::Level;

use super::Scene;
use super::geometry::{At, Nearest};
use super::occluders::{Listed, ListedOccluders};
use crate::color::Rgb;
use crate::ids::{LightId, SurfaceId};
use crate::math::{LightEnd, Ray, ShadowRay};
use crate::shape::{
    BumpShadowing, RayDifferential, ShadowTerminator, ShapePoint, Sphere, SurfaceInteraction, TexturePoint, UV_SETS,
};

pub use super::geometry::Hit;

/// What a camera ray ends at, in the scene's own coordinates.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is one of it at a time, for each ray")]
pub(crate) enum TracedHit {
    /// A surface to be lit.
    Surface(SurfaceInteraction),
    /// A light, seen as its colour.
    Emission(Rgb),
    /// Nothing.
    Background,
}

impl Scene {
    /// [`intersect`](Self::intersect) in the scene's own coordinates.
    #[inline(always)]
    pub(crate) fn intersect_local(&self, ray: &Ray) -> Option<Hit> {
        self.intersect_at(self.level, ray)
    }

    /// [`intersect_local`](Self::intersect_local) with an instruction set: the same answer.
    #[inline(always)]
    pub(crate) fn intersect_at(&self, level: Level, ray: &Ray) -> Option<Hit> {
        let listed = self.meet_listed(ray);
        if !self.geometry.has_trees() {
            return listed.0;
        }
        let mut nearest = listed;
        self.geometry.meet_trees(level, ray, &mut nearest);
        nearest.0
    }

    /// What the ray meets first of the shapes that lie in lists, and of the lights. Returned, not written to a place of
    /// the caller's: so it stays in registers.
    #[inline(always)]
    pub(crate) fn meet_listed(&self, ray: &Ray) -> Nearest {
        let mut nearest = Nearest::default();
        if self.geometry.listed {
            for (i, sphere) in self.geometry.spheres.iter().enumerate() {
                if sphere.seen
                    && let Some(t) = sphere.shape.intersect(ray)
                {
                    nearest.offer(t, sphere.surface, At::Sphere(i as u32));
                }
            }
            for (i, flat) in self.geometry.parallelograms.iter().enumerate() {
                if flat.seen
                    && let Some(t) = flat.shape.intersect(ray)
                {
                    nearest.offer(t, flat.surface, At::Parallelogram(i as u32));
                }
            }
        }
        let first_light = self.geometry.surfaces.len();
        if !self.seen_lights.all.is_empty() {
            self.meet_lights(ray, first_light as u32, &mut nearest);
        }
        nearest
    }

    /// What the ray meets first of the lights.
    #[inline(never)]
    fn meet_lights(&self, ray: &Ray, first: u32, nearest: &mut Nearest) {
        self.seen_lights.meet(self.level, ray, nearest.limit(), |light, limit| {
            if let Some(area) = self.lights[light as usize].area()
                && let Some(t) = area.shape.intersect(ray)
            {
                nearest.offer(t, SurfaceId(first + light), At::Light);
            }
            *limit = nearest.limit();
        });
    }

    /// The lights, in scene order.
    pub fn lights(&self) -> impl ExactSizeIterator<Item = LightId> + use<> {
        (0..self.lights.len() as u32).map(LightId)
    }

    /// The end of shadow rays to a light.
    #[inline(always)]
    pub(crate) fn light_end(&self, light: LightId) -> LightEnd {
        LightEnd { light, plane: self.lights[light.index()].plane() }
    }

    /// How many points of a light are sampled; 1 for one without an area. For a light that is integrated, as many as
    /// [`RenderSettings::reference`](crate::RenderSettings::reference) would sample it at.
    ///
    /// # Panics
    /// If the scene has no such light.
    pub fn light_points(&self, light: LightId) -> usize {
        self.lights[light.index()].samples()
    }

    /// Whether all of the light along a ray is stopped between a surface and the ray's light: nothing is left of it by
    /// what casts shadows for that light. See [`transmittance`](Self::transmittance).
    #[inline]
    pub fn occluded(&self, ray: &ShadowRay) -> bool {
        self.occluded_by_opaque(ray) || self.left_by_layers(ray) == 0.0
    }

    /// Whether an opaque surface blocks the shadow ray. Any hit decides, so occluders are tested in any order.
    #[inline]
    pub(crate) fn occluded_by_opaque(&self, ray: &ShadowRay) -> bool {
        self.occluded_by_lists(ray) || self.geometry.has_trees() && self.geometry.is_blocked(self.level, ray)
    }

    /// The part of [`occluded`](Self::occluded) that does not lie in trees.
    #[inline]
    pub(crate) fn occluded_by_lists(&self, ray: &ShadowRay) -> bool {
        let finite = ray.is_finite();
        let ListedOccluders { flats, .. } = &self.occluders;
        let mut spheres = self.that_stop(self.occluders.surface_spheres(), ray.to.light);
        spheres.any(|(_, sphere)| sphere.shape.shadow(ray.p, ray.error).blocks(ray.l, finite))
            || self
                .that_stop(flats, ray.to.light)
                .any(|(_, flat)| flat.shape.shadow(ray.p, ray.error).blocks(ray.l, finite))
            || self.occluded_by_lights(ray)
    }

    /// The part of it that does not lie in lists of things: lights, and trees.
    #[inline]
    pub(crate) fn occluded_but_by_lists(&self, ray: &ShadowRay) -> bool {
        self.occluded_by_lights(ray) || self.geometry.has_trees() && self.geometry.is_blocked(self.level, ray)
    }

    /// Whether the shape of another light stands on the ray.
    #[inline]
    fn occluded_by_lights(&self, ray: &ShadowRay) -> bool {
        let finite = ray.is_finite();
        let (spheres, disks) = (self.occluders.light_spheres(), &self.occluders.disks);
        let by_sphere = |sphere: &Listed<Sphere>| {
            self.geometry.stops(sphere.opacity, ray.to.light)
                && sphere.shape.shadow(ray.p, ray.error).blocks(ray.l, finite)
        };
        let tree = self.occluders.light_tree();
        tree.and_then(|tree| tree.any(self.level, ray, |i| by_sphere(&spheres[i as usize])))
            .unwrap_or_else(|| spheres.iter().any(by_sphere))
            || self
                .that_stop(disks, ray.to.light)
                .any(|(_, disk)| disk.shape.shadow(ray.p, ray.error).blocks(ray.l, finite))
    }

    /// The surface at a hit, turned to the viewer. `differential` is that of the camera ray.
    ///
    /// # Panics
    /// If the hit is a light's: a light has no material.
    #[inline(always)]
    pub(crate) fn local_surface(&self, ray: &Ray, hit: &Hit, differential: &RayDifferential) -> SurfaceInteraction {
        self.surface_with(ray, hit, differential, self.geometry.terminator)
    }

    /// The same with another border of light and dark than the scene's.
    #[inline(always)]
    pub(crate) fn surface_with(
        &self,
        ray: &Ray,
        hit: &Hit,
        differential: &RayDifferential,
        terminator: ShadowTerminator,
    ) -> SurfaceInteraction {
        let surface = &self.geometry.surfaces[hit.surface.index()];
        let point = self.geometry.point(ray, hit, differential, terminator);
        let ShapePoint { p, error, normal, shading, lifted, uv, footprint, color, alpha } = point;
        let error = error.widened(self.geometry.rounding);
        let wo = -ray.d;
        let (ng, ns) = if normal.dot(wo) < 0.0 { (-normal, -shading) } else { (normal, shading) };
        let (lit_from, horizon) = match lifted {
            Some(lifted) => (lifted, ns),
            None => (p, ng),
        };
        let facet = hit.facet();
        let material = surface.material.unwrap_or_else(|| self.geometry.face_material(hit));
        let receives_shadow = surface.receives_shadow;
        let surface = hit.surface;
        let mut si = SurfaceInteraction {
            p,
            error,
            ng,
            ns,
            lobe_ns: ns,
            bump_shadowing: BumpShadowing::default(),
            lit_from,
            horizon,
            facet,
            wo,
            uv,
            footprint,
            uv_sets: [TexturePoint::default(); UV_SETS],
            footprints_per_pixel: differential.steps_per_pixel,
            slope_variance: 0.0,
            coat_ns: ns,
            coat_slope_variance: 0.0,
            coat_bump_shadowing: BumpShadowing::default(),
            color,
            alpha,
            surface,
            material,
            receives_shadow,
        };
        let sets = self.geometry.rules.named_uv_sets(material);
        if sets != 0 {
            self.geometry.find_texture_points(&mut si, ray, hit, differential, sets);
        }
        if self.geometry.rules.refines(material) {
            self.refine_normal(&mut si, ray, hit, shading, differential);
        }
        si
    }

    /// What the camera sees of a hit.
    #[inline(always)]
    pub(crate) fn see(&self, ray: &Ray, hit: Option<Hit>, differential: &RayDifferential) -> TracedHit {
        match hit {
            None => TracedHit::Background,
            Some(hit) => match hit.surface.index().checked_sub(self.geometry.surfaces.len()) {
                Some(light) => TracedHit::Emission(self.lights[light].radiance),
                None => TracedHit::Surface(self.local_surface(ray, &hit, differential)),
            },
        }
    }
}
