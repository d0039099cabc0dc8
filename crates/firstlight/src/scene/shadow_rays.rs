//! Shadow rays against what lies in trees: one ray, and packets of sixteen.

use fearless_simd::{Level, f32x16, prelude::*};

use super::geometry::{Geometry, PlacedTarget, UpperItem};
use super::occluders::Opacity;
use crate::accel::{Aabb, RayPacket16, TraceRay, dispatch_all, dispatch_eight, dispatch_sixteen};
use crate::ids::{LightId, SurfaceId};
use crate::math::{DVec3, ShadowRay, Vec3};
use crate::shape::{LineLanes, Mesh, PacketHits, Placement, bits};

/// Sixteen rays from one surface, or from sixteen places, towards a light, each ending at a point of it.
pub(crate) struct ShadowRays<'a> {
    /// The surface they leave, one for all of them or one for each; `l` is ignored.
    pub from: &'a [ShadowRay],
    /// Origins and ways, as the trees want them.
    pub rays: RayPacket16,
    /// [`ShadowRay::end`] of each.
    pub t_end: [f32; 16],
}

impl ShadowRays<'_> {
    /// The surface that a ray leaves.
    pub fn origin(&self, lane: usize) -> &ShadowRay {
        &self.from[lane.min(self.from.len() - 1)]
    }

    pub fn ray(&self, lane: usize) -> ShadowRay {
        ShadowRay { l: self.rays.d(lane), ..*self.origin(lane) }
    }

    /// The light they lead to.
    fn light(&self) -> LightId {
        self.from[0].to.light
    }

    /// Which of the rays in `asking` a shape blocks, by its `shadow` from where they start.
    #[inline(always)]
    fn blocked_by<T>(
        &self,
        asking: u16,
        shadow: impl Fn(&ShadowRay) -> T,
        blocks: impl Fn(&T, &ShadowRay) -> bool,
    ) -> u16 {
        if let [from] = self.from {
            let shadow = shadow(from);
            return blocked_lanes(asking, |lane| blocks(&shadow, &self.ray(lane)));
        }
        blocked_lanes(asking, |lane| blocks(&shadow(&self.ray(lane)), &self.ray(lane)))
    }

    /// Those that pass through a box, but for rounding.
    #[inline(always)]
    fn reaching<S: Simd>(&self, simd: S, bounds: &Aabb) -> u16 {
        let (mut near, mut far) = (simd.splat_f32x16(0.0), f32x16::load_array_ref(simd, &self.t_end));
        for axis in 0..3 {
            let o = f32x16::load_array_ref(simd, &self.rays.o[axis]);
            let inverse = simd.splat_f32x16(1.0) / f32x16::load_array_ref(simd, &self.rays.d[axis]);
            let (low, high) = ((bounds.min[axis] - o) * inverse, (bounds.max[axis] - o) * inverse);
            (near, far) = (near.max(low.min(high)), far.min(low.max(high)));
        }
        !(near.simd_gt(far).to_bitmask() as u16)
    }
}

/// The place of a mesh: 0 is the mesh in world coordinates, n the placed thing of index n - 1.
pub(crate) type MeshNumber = u32;

/// A mesh in its place, and which of its triangles occlude a light.
pub(crate) struct ShadowMesh<'a> {
    pub mesh: &'a Mesh,
    pub placement: Option<&'a Placement>,
    pub source: MeshNumber,
    first: SurfaceId,
    opacity: Opacity,
    geometry: &'a Geometry,
    light: LightId,
}

impl<'a> ShadowMesh<'a> {
    /// The mesh at place `source`, as an occluder of `light`; `None` if there is no mesh.
    pub fn of(geometry: &'a Geometry, source: MeshNumber, light: LightId) -> Option<Self> {
        let (mesh, placement, first, opacity) = if source == 0 {
            let world = geometry.world.as_ref()?;
            (&world.mesh, None, SurfaceId(0), world.shadow)
        } else {
            let thing = &geometry.placed[source as usize - 1];
            let PlacedTarget::Mesh(mesh) = thing.target else { return None };
            (&geometry.meshes[mesh as usize], Some(&thing.placement), thing.surface, thing.shadow)
        };
        Some(ShadowMesh { mesh, placement, source, first, opacity, geometry, light })
    }

    /// Whether a triangle casts shadows of the light.
    #[inline(always)]
    pub fn casts(&self, triangle: u32) -> bool {
        let surface = || SurfaceId(self.first.0 + self.mesh.part(triangle).surface);
        self.opacity == Opacity::Opaque || self.geometry.casts(surface(), self.light)
    }

    /// A point of it in world space.
    pub fn in_world(&self, q: Vec3) -> DVec3 {
        self.placement.map_or(q.as_dvec3(), |at| at.world_from_object.transform_point3(q.as_dvec3()))
    }

    /// The rays in `active` in its own space; `None` if that is the world's.
    #[inline(always)]
    pub fn own_rays(&self, rays: &RayPacket16, active: u16) -> Option<RayPacket16> {
        let placement = self.placement?;
        let mut own = RayPacket16::ZERO;
        for lane in lanes(active) {
            let line = placement.line(rays.o(lane), rays.d(lane));
            own.set(lane, line.o.as_vec3(), line.d.as_vec3());
        }
        Some(own)
    }

    /// Whether a ray starts on a triangle, which does not block it then: on its own facet, or in the plane of another,
    /// as far as rounding allows to tell. `o` is the start in the space of the mesh.
    #[inline(never)]
    pub(super) fn is_start(&self, ray: &ShadowRay, o: Vec3, triangle: u32) -> bool {
        let error = || self.placement.map_or(ray.error.0.as_dvec3(), |placement| placement.error_in_object(ray.error));
        ray.but.of(self.source) == triangle || self.mesh.is_in_plane(triangle, o, error())
    }

    /// Whether any triangle blocks a ray before `t_end`.
    #[inline(never)]
    fn blocks<S: Simd>(&self, simd: S, ray: &ShadowRay, t_end: f32) -> bool {
        if self.opacity == Opacity::Clear {
            return false;
        }
        let (o, l) = match self.placement {
            None => (ray.start, ray.l),
            Some(placement) => {
                let own = placement.line(ray.start, ray.l);
                (own.o.as_vec3(), own.d.as_vec3())
            }
        };
        let may_block = |triangle| self.casts(triangle) && !self.is_start(ray, o, triangle);
        simd.vectorize(
            #[inline(always)]
            || self.mesh.tree.any(simd, &TraceRay::new(o, l), t_end, &may_block),
        )
    }

    /// Which of the rays in `active` any triangle blocks.
    #[inline(never)]
    fn blocks_lanes<S: Simd>(&self, simd: S, shadows: &ShadowRays, active: u16) -> u16 {
        if self.opacity == Opacity::Clear || active == 0 {
            return 0;
        }
        let own = self.own_rays(&shadows.rays, active);
        let rays = own.as_ref().unwrap_or(&shadows.rays);
        let may_block = |hits: &PacketHits| {
            let (triangle, hit) = (hits.triangle, hits.lanes);
            if !self.casts(triangle) {
                return 0;
            }
            let is_start = |lane| self.is_start(shadows.origin(lane), rays.o(lane), triangle);
            if shadows.from.len() == 1 {
                // All start at one point
                return if is_start(hit.trailing_zeros() as usize) { 0 } else { hit };
            }
            bits(hit).filter(|lane| !is_start(*lane)).fold(0, |hit, lane| hit | 1 << lane)
        };
        simd.vectorize(
            #[inline(always)]
            || self.mesh.tree.any16(simd, rays, &shadows.t_end, active, &may_block),
        )
    }
}

/// The lanes that are set in `active`.
#[inline(always)]
fn lanes(active: u16) -> impl Iterator<Item = usize> {
    (0..16).filter(move |lane| active >> lane & 1 == 1)
}

/// Those of the lanes in `active` that are blocked.
#[inline(always)]
fn blocked_lanes(active: u16, is_blocked: impl Fn(usize) -> bool) -> u16 {
    lanes(active).filter(|lane| is_blocked(*lane)).fold(0, |mask, lane| mask | 1 << lane)
}

impl Geometry {
    /// Whether anything in the trees stands between a surface and a light.
    #[inline(never)]
    pub fn is_blocked(&self, level: Level, ray: &ShadowRay) -> bool {
        dispatch_eight!(level, simd => self.blocked(simd, ray))
    }

    #[inline(always)]
    fn blocked<S: Simd>(&self, simd: S, ray: &ShadowRay) -> bool {
        let (o, t_end) = (ray.start, ray.end());
        if ShadowMesh::of(self, 0, ray.to.light).is_some_and(|world| world.blocks(simd, ray, t_end)) {
            return true;
        }
        if self.unbounded.iter().any(|thing| self.blocked_by_placed(simd, *thing, ray, t_end)) {
            return true;
        }
        if self.items.is_empty() {
            return false;
        }
        // Spheres and parallelograms have margins of their own at the light: only what is in placed things ends before
        self.upper.any(simd, &TraceRay::new(o, ray.l), ray.t_max, |item| match self.items[item as usize] {
            UpperItem::Sphere(i) => {
                let sphere = &self.spheres[i as usize];
                self.casts(sphere.surface, ray.to.light)
                    && sphere.shape.shadow(ray.p, ray.error).blocks(ray.l, ray.is_finite())
            }
            UpperItem::Parallelogram(i) => {
                let flat = &self.parallelograms[i as usize];
                self.casts(flat.surface, ray.to.light)
                    && flat.shape.shadow(ray.p, ray.error).blocks(ray.l, ray.is_finite())
            }
            UpperItem::Placed(i) => self.blocked_by_placed(simd, i, ray, t_end),
        })
    }

    #[inline(always)]
    fn blocked_by_placed<S: Simd>(&self, simd: S, index: u32, ray: &ShadowRay, t_end: f32) -> bool {
        let thing = &self.placed[index as usize];
        if !self.stops(thing.shadow, ray.to.light) {
            return false;
        }
        let own = thing.placement.line(ray.start, ray.l);
        match thing.target {
            PlacedTarget::Mesh(_) => {
                ShadowMesh::of(self, index + 1, ray.to.light).is_some_and(|mesh| mesh.blocks(simd, ray, t_end))
            }
            PlacedTarget::Points(points) => self.point_sets[points as usize].blocks(simd, &own, t_end),
            PlacedTarget::Solid(solid) => self.solids[solid as usize].blocks(&own, 0.0, t_end as f64),
        }
    }

    /// Which of the rays in `active` something in the trees stands in the way of: the same answers as
    /// [`is_blocked`](Self::is_blocked).
    #[inline(never)]
    pub fn are_blocked(&self, level: Level, shadows: &ShadowRays, active: u16) -> u16 {
        dispatch_sixteen!(level, simd => self.blocked_lanes(simd, shadows, active), else {
            blocked_lanes(active, |lane| self.is_blocked(level, &shadows.ray(lane)))
        })
    }

    /// [`are_blocked`](Self::are_blocked) by some of what is placed, each with a box around it.
    pub fn are_blocked_by(&self, level: Level, things: &[(u32, Aabb)], shadows: &ShadowRays, active: u16) -> u16 {
        let mut done = 0;
        for (thing, bounds) in things {
            let asked = active & !done;
            let asked = asked & dispatch_all!(level, simd => shadows.reaching(simd, bounds));
            if asked == 0 {
                continue;
            }
            done |= dispatch_sixteen!(level, simd => self.placed_blocks_lanes(simd, *thing, shadows, asked), else {
                blocked_lanes(asked, |lane| {
                    dispatch_eight!(level, simd => {
                        self.blocked_by_placed(simd, *thing, &shadows.ray(lane), shadows.t_end[lane])
                    })
                })
            });
        }
        done
    }

    #[inline(always)]
    fn blocked_lanes<S: Simd>(&self, simd: S, shadows: &ShadowRays, active: u16) -> u16 {
        let mut done = 0;
        if let Some(world) = ShadowMesh::of(self, 0, shadows.light()) {
            done |= world.blocks_lanes(simd, shadows, active);
        }
        for &thing in &self.unbounded {
            done |= self.placed_blocks_lanes(simd, thing, shadows, active & !done);
        }
        if self.items.is_empty() || active & !done == 0 {
            return done;
        }
        let whole = [shadows.from[0].t_max; 16];
        let casts = |surface| self.casts(surface, shadows.light());
        done | self.upper.any16(simd, &shadows.rays, &whole, active & !done, |item, asking| {
            match self.items[item as usize] {
                UpperItem::Sphere(i) if casts(self.spheres[i as usize].surface) => {
                    let shape = &self.spheres[i as usize].shape;
                    let shadow = |ray: &ShadowRay| shape.shadow(ray.p, ray.error);
                    shadows.blocked_by(asking, shadow, |shadow, ray| shadow.blocks(ray.l, ray.is_finite()))
                }
                UpperItem::Parallelogram(i) if casts(self.parallelograms[i as usize].surface) => {
                    let shape = &self.parallelograms[i as usize].shape;
                    let shadow = |ray: &ShadowRay| shape.shadow(ray.p, ray.error);
                    shadows.blocked_by(asking, shadow, |shadow, ray| shadow.blocks(ray.l, ray.is_finite()))
                }
                UpperItem::Sphere(_) | UpperItem::Parallelogram(_) => 0,
                UpperItem::Placed(i) => self.placed_blocks_lanes(simd, i, shadows, asking),
            }
        })
    }

    #[inline(always)]
    fn placed_blocks_lanes<S: Simd>(&self, simd: S, index: u32, shadows: &ShadowRays, active: u16) -> u16 {
        let thing = &self.placed[index as usize];
        if active == 0 || !self.stops(thing.shadow, shadows.light()) {
            return 0;
        }
        let lines = || LineLanes::new(&thing.placement, &shadows.rays, &shadows.t_end);
        match thing.target {
            PlacedTarget::Mesh(_) => ShadowMesh::of(self, index + 1, shadows.light())
                .map_or(0, |mesh| mesh.blocks_lanes(simd, shadows, active)),
            PlacedTarget::Solid(solid) => self.solids[solid as usize].blocks_lanes(&lines(), active),
            PlacedTarget::Points(points) => {
                self.point_sets[points as usize].blocks_lanes(simd, &lines(), &shadows.t_end, active)
            }
        }
    }
}
