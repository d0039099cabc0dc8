//! Shadow rays against what lies in trees: one ray, and packets of sixteen.

use fearless_simd::{Level, f32x16, prelude::*};

use super::geometry::{Geometry, PlacedTarget, UpperItem};
use super::occluders::Opacity;
use crate::accel::{Aabb, RayPacket16, TraceRay, dispatch_all, dispatch_eight, dispatch_sixteen};
use crate::ids::{LightId, SurfaceId};
use crate::math::{ShadowRay, Vec3};
use crate::shape::{LineLanes, Mesh, Placement, bits};

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
    fn origin(&self, lane: usize) -> &ShadowRay {
        &self.from[lane.min(self.from.len() - 1)]
    }

    fn ray(&self, lane: usize) -> ShadowRay {
        ShadowRay { l: self.rays.d(lane), ..*self.origin(lane) }
    }

    /// The light they lead to.
    fn light(&self) -> LightId {
        self.from[0].to.light
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

/// Whether a ray starts on a triangle of a mesh, which does not block it then: on its own facet, or in the plane of
/// another, as far as rounding allows to tell. `o` is the start in the space of the mesh, whose place is number
/// `source`.
#[inline(never)]
fn starts_on(mesh: &Mesh, source: u32, placement: Option<&Placement>, ray: &ShadowRay, o: Vec3, triangle: u32) -> bool {
    let error = || placement.map_or(ray.error.0.as_dvec3(), |placement| placement.error_in_object(ray.error));
    ray.but.of(source) == triangle || mesh.is_in_plane(triangle, o, error())
}

/// The lanes that are set in `active`.
#[inline(always)]
fn lanes(active: u16) -> impl Iterator<Item = usize> {
    (0..16).filter(move |lane| active >> lane & 1 == 1)
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
        if let Some(world) = &self.world
            && self.blocked_by_mesh(simd, &world.mesh, SurfaceId(0), world.shadow, 0, None, ray, t_end)
        {
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
            PlacedTarget::Mesh(mesh) => {
                let (mesh, placement) = (&self.meshes[mesh as usize], Some(&thing.placement));
                self.blocked_by_mesh(simd, mesh, thing.surface, thing.shadow, index + 1, placement, ray, t_end)
            }
            PlacedTarget::Points(points) => self.point_sets[points as usize].blocks(simd, &own, t_end),
            PlacedTarget::Solid(solid) => self.solids[solid as usize].blocks(&own, 0.0, t_end as f64),
        }
    }

    /// Whether any triangle of a mesh, in its place, which is number `source`, blocks a ray.
    #[inline(never)]
    #[allow(clippy::too_many_arguments, reason = "a mesh with its place, a ray with its reach")]
    fn blocked_by_mesh<S: Simd>(
        &self,
        simd: S,
        mesh: &Mesh,
        first: SurfaceId,
        opacity: Opacity,
        source: u32,
        placement: Option<&Placement>,
        ray: &ShadowRay,
        t_end: f32,
    ) -> bool {
        if opacity == Opacity::Clear {
            return false;
        }
        let (o, l) = match placement {
            None => (ray.start, ray.l),
            Some(placement) => {
                let own = placement.line(ray.start, ray.l);
                (own.o.as_vec3(), own.d.as_vec3())
            }
        };
        let asks = |triangle| {
            self.triangle_casts(mesh, first, opacity, triangle, ray.to.light)
                && !starts_on(mesh, source, placement, ray, o, triangle)
        };
        simd.vectorize(
            #[inline(always)]
            || mesh.tree.any(simd, &TraceRay::new(o, l), t_end, &asks),
        )
    }

    /// Which of sixteen rays a mesh blocks. `rays` are those of `shadows` in the mesh's space; its place is number
    /// `source`.
    #[inline(never)]
    #[allow(clippy::too_many_arguments, reason = "a mesh with its place, rays with their reach")]
    fn lanes_blocked_by_mesh<S: Simd>(
        &self,
        simd: S,
        mesh: &Mesh,
        first: SurfaceId,
        opacity: Opacity,
        source: u32,
        placement: Option<&Placement>,
        shadows: &ShadowRays,
        rays: &RayPacket16,
        active: u16,
    ) -> u16 {
        if opacity == Opacity::Clear || active == 0 {
            return 0;
        }
        let light = shadows.light();
        let asks = |triangle, hit: u64| {
            if !self.triangle_casts(mesh, first, opacity, triangle, light) {
                return 0;
            }
            let starts_on = |lane| starts_on(mesh, source, placement, shadows.origin(lane), rays.o(lane), triangle);
            if shadows.from.len() == 1 {
                // All start at one point
                return if starts_on(hit.trailing_zeros() as usize) { 0 } else { hit };
            }
            bits(hit).filter(|lane| !starts_on(*lane)).fold(0, |hit, lane| hit | 1 << lane)
        };
        simd.vectorize(
            #[inline(always)]
            || mesh.tree.any16(simd, rays, &shadows.t_end, active, &asks),
        )
    }

    /// Which of the rays in `active` something in the trees stands in the way of: the same answers as
    /// [`is_blocked`](Self::is_blocked).
    #[inline(never)]
    pub fn are_blocked(&self, level: Level, shadows: &ShadowRays, active: u16) -> u16 {
        dispatch_sixteen!(level, simd => self.blocked_lanes(simd, shadows, active), else {
            let blocked = |lane: &usize| self.is_blocked(level, &shadows.ray(*lane));
            lanes(active).filter(blocked).fold(0, |mask, lane| mask | 1 << lane)
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
                let blocked = |lane: &usize| {
                    dispatch_eight!(level, simd => {
                        self.blocked_by_placed(simd, *thing, &shadows.ray(*lane), shadows.t_end[*lane])
                    })
                };
                lanes(asked).filter(blocked).fold(0, |mask, lane| mask | 1 << lane)
            });
        }
        done
    }

    #[inline(always)]
    fn blocked_lanes<S: Simd>(&self, simd: S, shadows: &ShadowRays, active: u16) -> u16 {
        let mut done = 0;
        if let Some(world) = &self.world {
            let (mesh, rays) = (&world.mesh, &shadows.rays);
            done |= self.lanes_blocked_by_mesh(simd, mesh, SurfaceId(0), world.shadow, 0, None, shadows, rays, active);
        }
        for &thing in &self.unbounded {
            done |= self.placed_blocks_lanes(simd, thing, shadows, active & !done);
        }
        if self.items.is_empty() || active & !done == 0 {
            return done;
        }
        let whole = [shadows.from[0].t_max; 16];
        done | self.upper.any16(simd, &shadows.rays, &whole, active & !done, |item, asking| {
            let one_by_one = |blocks: &dyn Fn(&ShadowRay) -> bool| {
                lanes(asking).filter(|lane| blocks(&shadows.ray(*lane))).fold(0, |mask, lane| mask | 1 << lane)
            };
            match self.items[item as usize] {
                UpperItem::Sphere(i) => {
                    let sphere = &self.spheres[i as usize];
                    if !self.casts(sphere.surface, shadows.light()) {
                        return 0;
                    }
                    if let [ShadowRay { p, error, .. }] = shadows.from {
                        let shadow = sphere.shape.shadow(*p, *error);
                        return one_by_one(&|ray| shadow.blocks(ray.l, ray.is_finite()));
                    }
                    one_by_one(&|ray| sphere.shape.shadow(ray.p, ray.error).blocks(ray.l, ray.is_finite()))
                }
                UpperItem::Parallelogram(i) => {
                    let flat = &self.parallelograms[i as usize];
                    if !self.casts(flat.surface, shadows.light()) {
                        return 0;
                    }
                    if let [ShadowRay { p, error, .. }] = shadows.from {
                        let shadow = flat.shape.shadow(*p, *error);
                        return one_by_one(&|ray| shadow.blocks(ray.l, ray.is_finite()));
                    }
                    one_by_one(&|ray| flat.shape.shadow(ray.p, ray.error).blocks(ray.l, ray.is_finite()))
                }
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
        let mesh = match thing.target {
            PlacedTarget::Mesh(mesh) => mesh,
            PlacedTarget::Solid(solid) => {
                let lines = LineLanes::new(&thing.placement, &shadows.rays, &shadows.t_end);
                return self.solids[solid as usize].blocks_lanes(&lines, active);
            }
            PlacedTarget::Points(points) => {
                let lines = LineLanes::new(&thing.placement, &shadows.rays, &shadows.t_end);
                return self.point_sets[points as usize].blocks_lanes(simd, &lines, &shadows.t_end, active);
            }
        };
        let mesh = &self.meshes[mesh as usize];
        let mut own = RayPacket16::ZERO;
        for lane in lanes(active) {
            let line = thing.placement.line(shadows.rays.o(lane), shadows.rays.d(lane));
            own.set(lane, line.o.as_vec3(), line.d.as_vec3());
        }
        let placement = Some(&thing.placement);
        self.lanes_blocked_by_mesh(simd, mesh, thing.surface, thing.shadow, index + 1, placement, shadows, &own, active)
    }
}
