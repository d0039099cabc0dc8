//! Rays through the trees of a scene: the mesh of the world, and all that is placed.

use arrayvec::ArrayVec;
use fearless_simd::{Level, prelude::*};

use super::geometry::{At, Geometry, Hit, Layers, Nearest, Placed, PlacedSpot, PlacedTarget, UpperItem};
use super::occluders::Opacity;
use crate::accel::{Aabb, Planes, RayTile, TraceRay, dispatch_eight};
use crate::ids::{MaterialId, SurfaceId};
use crate::math::{DVec3, Facet, Ray, Vec3};
use crate::shape::{
    JoinedPart, Mesh, Parallelogram, Placement, RayDifferential, ShadowTerminator, ShapePoint, SolidHit, TileHits,
    TrianglePoint, every,
};

/// So many meshes at the same place are asked for many rays at once, each for all of them.
const FEW_MESHES: usize = 4;

/// The most facets, and the most leaves of a mesh, that a square of pixels is asked for.
const FEW_FACETS: usize = 8;
const FEW_LEAVES: usize = 4;

/// Facets of meshes.
pub(crate) type FewFacets = ArrayVec<Facet, FEW_FACETS>;

/// Finds the facets of a mesh that lie within `planes`, which are of its space, if they are few and flat.
fn facets_within(level: Level, mesh: &Mesh, source: u32, planes: &Planes, found: &mut FewFacets) -> bool {
    let mut leaves = 0;
    let take = |leaf: u32| {
        leaves += 1;
        leaves <= FEW_LEAVES
            && mesh.tree.leaf(leaf).all(|(triangle, corners)| {
                planes.misses(&corners) || mesh.is_flat(triangle) && found.try_push(Facet { source, triangle }).is_ok()
            })
    };
    dispatch_eight!(level, simd => mesh.tree.gather(simd, |center, half| planes.within(center, half).test(), take))
}

impl Geometry {
    /// Whether there is anything beside the lists.
    #[inline(always)]
    pub fn has_trees(&self) -> bool {
        self.has_boxes() || !self.unbounded.is_empty()
    }

    /// The same, but for planes.
    #[inline(always)]
    pub fn has_boxes(&self) -> bool {
        self.world.is_some() || !self.items.is_empty()
    }

    /// Whether there are occluders that closed forms do not handle: those with [boxes](Self::has_boxes), and those that
    /// are not opaque.
    #[inline(always)]
    pub fn is_sampled_past(&self) -> bool {
        self.has_boxes() || self.layers.is_some()
    }

    /// Whether camera rays inside of `planes` may meet anything that is not opaque.
    pub fn may_meet_layers(&self, level: Level, planes: &Planes) -> bool {
        self.layers.as_ref().is_some_and(|layers| {
            let has_none = dispatch_eight!(level, simd => self.has_no_layer_within(simd, layers, planes));
            !layers.unbounded.is_empty() || !has_none
        })
    }

    /// Whether no box in the trees of layers is within `planes`.
    #[inline(always)]
    fn has_no_layer_within<S: Simd>(&self, simd: S, layers: &Layers, planes: &Planes) -> bool {
        let is_within = |center, half| planes.within(center, half).test();
        layers.upper.gather(simd, is_within, |item| {
            let UpperItem::Placed(index) = layers.items[item as usize] else { return false };
            let Placed { placement, target: PlacedTarget::Mesh(mesh), .. } = &self.placed[index as usize] else {
                return false;
            };
            let own = planes.placed(&placement.world_from_object, &placement.object_from_world);
            let tree = &self.meshes[*mesh as usize].tree;
            tree.gather(simd, |center, half| own.within(center, half).test(), |_| false)
        })
    }

    /// The boxes around all that lies in trees and has an end.
    pub fn tree_bounds(&self) -> impl Iterator<Item = Aabb> {
        let upper = (!self.items.is_empty()).then(|| self.upper.bounds());
        self.world.iter().map(|world| world.mesh.tree.bounds()).chain(upper)
    }

    /// Whether camera rays inside of `planes` may meet anything that lies in trees and has an end.
    pub fn may_meet(&self, level: Level, planes: &Planes) -> bool {
        self.tree_bounds().any(|bounds| planes.may_meet(bounds))
            && dispatch_eight!(level, simd => self.reaches(simd, planes))
    }

    #[inline(always)]
    fn reaches<S: Simd>(&self, simd: S, planes: &Planes) -> bool {
        let of_world = self.world.as_ref().filter(|world| world.camera != Opacity::Clear);
        of_world.is_some_and(|world| {
            !world.mesh.tree.gather(simd, |center, half| planes.within(center, half).test(), |_| false)
        }) || !self.upper.gather(simd, |center, half| planes.within(center, half).test(), |_| false)
    }

    /// Offers what a camera ray meets in the trees.
    #[inline(never)]
    pub fn meet_trees(&self, level: Level, ray: &Ray, nearest: &mut Nearest) {
        dispatch_eight!(level, simd => self.meet(simd, ray, nearest))
    }

    #[inline(always)]
    fn meet<S: Simd>(&self, simd: S, ray: &Ray, nearest: &mut Nearest) {
        if let Some(world) = &self.world
            && let Some((t, point)) =
                self.meet_mesh(simd, &world.mesh, SurfaceId(0), world.camera, ray.o, ray.d, nearest.limit())
        {
            let surface = SurfaceId(world.mesh.part(point.triangle).surface);
            nearest.offer(t as f64, surface, At::World(point));
        }
        self.meet_upper_with(simd, ray, nearest);
    }

    /// Offers what a camera ray meets of all that is not the mesh of the world.
    #[inline(always)]
    pub fn meet_upper(&self, level: Level, ray: &Ray, nearest: &mut Nearest) {
        if !self.items.is_empty() || !self.unbounded.is_empty() {
            self.meet_upper_now(level, ray, nearest);
        }
    }

    #[inline(never)]
    fn meet_upper_now(&self, level: Level, ray: &Ray, nearest: &mut Nearest) {
        dispatch_eight!(level, simd => self.meet_upper_with(simd, ray, nearest))
    }

    /// Finds the meshes that are placed where camera rays inside of `planes` may meet them, if all that is placed there
    /// is a few meshes: then each can be asked for many rays at once, see
    /// [`meet_placed_tile`](Self::meet_placed_tile). Planes are not among them. A tile finds the mesh of a hit by its
    /// surface: where two of the meshes have the same surface, the result is `false`.
    pub fn few_meshes(&self, level: Level, planes: &Planes, found: &mut Vec<u32>) -> bool {
        found.clear();
        if self.items.is_empty() {
            return true;
        }
        let take = |item: u32| {
            let UpperItem::Placed(index) = self.items[item as usize] else { return false };
            let thing = &self.placed[index as usize];
            if thing.camera == Opacity::Clear {
                return true;
            }
            let is_mesh = matches!(thing.target, PlacedTarget::Mesh(_));
            if is_mesh {
                found.push(index);
            }
            is_mesh && found.len() <= FEW_MESHES
        };
        let are_few = dispatch_eight!(level, simd => {
            self.upper.gather(simd, |center, half| planes.within(center, half).test(), take)
        });
        // The opaque mesh of a group and the other one, if an instance makes that opaque
        let surface = |index: u32| self.placed[index as usize].surface;
        let is_copy = |i: usize| found[..i].iter().any(|other| surface(*other) == surface(found[i]));
        are_few && !(1..found.len()).any(is_copy)
    }

    /// Finds the facets of meshes that camera rays inside of `planes` may meet, if they are few and flat, and all that
    /// is there in trees.
    pub fn few_facets(&self, level: Level, planes: &Planes, found: &mut FewFacets) -> bool {
        let mut placed = Vec::new();
        if !self.few_meshes(level, planes, &mut placed) {
            return false;
        }
        let world = self.world.iter().filter(|world| world.camera != Opacity::Clear);
        world
            .into_iter()
            .all(|world| world.camera == Opacity::Opaque && facets_within(level, &world.mesh, 0, planes, found))
            && placed.into_iter().all(|index| {
                let thing = &self.placed[index as usize];
                if thing.camera != Opacity::Opaque {
                    return false;
                }
                let PlacedTarget::Mesh(mesh) = thing.target else { unreachable!("only meshes are asked so") };
                let Placement { world_from_object, object_from_world } = &thing.placement;
                let planes = planes.placed(world_from_object, object_from_world);
                facets_within(level, &self.meshes[mesh as usize], index + 1, &planes, found)
            })
    }

    /// The mesh of a facet, where it is placed, and the first of its surfaces.
    fn mesh_of(&self, facet: Facet) -> (&Mesh, Option<&Placement>, SurfaceId) {
        match facet.source.checked_sub(1) {
            None => (&self.world.as_ref().expect("it has the facet").mesh, None, SurfaceId(0)),
            Some(index) => {
                let thing = &self.placed[index as usize];
                let PlacedTarget::Mesh(mesh) = thing.target else { unreachable!("only meshes have facets") };
                (&self.meshes[mesh as usize], Some(&thing.placement), thing.surface)
            }
        }
    }

    /// A facet as one half of a parallelogram: where u + v is at most 1.
    pub fn facet(&self, facet: Facet) -> Parallelogram {
        let (mesh, placement, _) = self.mesh_of(facet);
        let [a, b, c] = mesh
            .corners(facet.triangle)
            .map(|q| placement.map_or(q, |placement| placement.world_from_object.transform_point3(q)));
        Parallelogram::new(a, b - a, c - a, 1.0, false)
    }

    /// Where on a facet a point of it is.
    pub fn on_facet(&self, facet: Facet, q: DVec3) -> At {
        let Parallelogram { p, u_axis, v_axis, .. } = self.facet(facet);
        let [u, v] = [u_axis, v_axis].map(|axis| (q - p).dot(axis) as f32);
        let point = TrianglePoint { triangle: facet.triangle, u, v };
        match facet.source.checked_sub(1) {
            None => At::World(point),
            Some(index) => At::Placed(index, PlacedSpot::Triangle(point)),
        }
    }

    /// The surface of a facet.
    pub fn facet_surface(&self, facet: Facet) -> SurfaceId {
        let (mesh, _, first) = self.mesh_of(facet);
        SurfaceId(first.0 + mesh.part(facet.triangle).surface)
    }

    /// Whether the corners of a facet have colours of their own.
    pub fn has_colors(&self, facet: Facet) -> bool {
        !self.mesh_of(facet).0.colors.is_empty()
    }

    /// What rays meet of a mesh that is placed, at most as far as `hits` says: which rays meet something nearer.
    #[inline(never)]
    pub fn meet_placed_tile(&self, level: Level, index: u32, rays: &RayTile, active: u64, hits: &mut TileHits) -> u64 {
        let thing = &self.placed[index as usize];
        let PlacedTarget::Mesh(mesh) = thing.target else { unreachable!("only meshes are asked so") };
        let own = dispatch_eight!(level, simd => simd.vectorize(
            #[inline(always)]
            || rays.map(#[inline(always)] |o, d| {
                let own = thing.placement.line(o, d);
                [own.o.as_vec3(), own.d.as_vec3()]
            }),
        ));
        self.meshes[mesh as usize].tree.tile_at(level, &own, active, thing.surface.0, hits, &every)
    }

    /// Offers what [`meet_placed_tile`](Self::meet_placed_tile) found at `place` for a ray of one of those meshes.
    /// `false` if the ray passes through that triangle: then others behind it have to be asked.
    pub fn offer_placed(
        &self,
        meshes: &[u32],
        ray: &Ray,
        hits: &TileHits,
        place: usize,
        nearest: &mut Nearest,
    ) -> bool {
        let Some(hit) = hits.get(place) else { return true };
        for index in meshes {
            let thing = &self.placed[*index as usize];
            if let (PlacedTarget::Mesh(mesh), true) = (thing.target, thing.surface.0 == hits.surface[place]) {
                let mesh = &self.meshes[mesh as usize];
                let d = || thing.placement.ray(ray).d.as_vec3();
                if thing.camera != Opacity::Opaque && !self.seen(mesh, thing.surface.0, hit.triangle, d()) {
                    return false;
                }
                let part = mesh.part(hit.triangle).surface;
                let point = TrianglePoint { triangle: hit.triangle, u: hit.u, v: hit.v };
                let at = At::Placed(*index, PlacedSpot::Triangle(point));
                nearest.offer(hit.t as f64, SurfaceId(thing.surface.0 + part), at);
            }
        }
        true
    }

    /// Offers what a camera ray meets of what has no end.
    #[inline(always)]
    pub fn meet_unbounded(&self, level: Level, ray: &Ray, nearest: &mut Nearest) {
        for &thing in &self.unbounded {
            dispatch_eight!(level, simd => self.meet_placed(simd, thing, ray, nearest));
        }
    }

    /// Whether camera rays can meet the mesh of the world.
    pub fn is_world_seen(&self) -> bool {
        self.world.as_ref().is_some_and(|world| world.camera != Opacity::Clear)
    }

    /// What rays meet of the mesh of the world, at most as far as `hits` says: which rays meet something.
    #[inline(never)]
    pub fn meet_world(&self, level: Level, rays: &RayTile, active: u64, hits: &mut TileHits) -> u64 {
        let Some(world) = &self.world else { return 0 };
        world.mesh.tree.tile_at(level, rays, active, 0, hits, &every)
    }

    /// Offers what [`meet_world`](Self::meet_world) found at `place` for a ray. `false` if the ray passes through that
    /// triangle: then others behind it have to be asked.
    pub fn offer_world(&self, ray: &Ray, hits: &TileHits, place: usize, nearest: &mut Nearest) -> bool {
        if let (Some(world), Some(hit)) = (&self.world, hits.get(place)) {
            if world.camera != Opacity::Opaque && !self.seen(&world.mesh, 0, hit.triangle, ray.d) {
                return false;
            }
            let surface = SurfaceId(world.mesh.part(hit.triangle).surface);
            let point = TrianglePoint { triangle: hit.triangle, u: hit.u, v: hit.v };
            nearest.offer(hit.t as f64, surface, At::World(point));
        }
        true
    }

    #[inline(always)]
    fn meet_upper_with<S: Simd>(&self, simd: S, ray: &Ray, nearest: &mut Nearest) {
        for &thing in &self.unbounded {
            self.meet_placed(simd, thing, ray, nearest);
        }
        if self.items.is_empty() {
            return;
        }
        let mut limit = nearest.limit();
        self.upper.closest(simd, &TraceRay::new(ray.o, ray.d), &mut limit, |item, limit| {
            match self.items[item as usize] {
                UpperItem::Sphere(i) => {
                    let sphere = &self.spheres[i as usize];
                    if sphere.seen
                        && let Some(t) = sphere.shape.intersect(ray)
                    {
                        nearest.offer(t, sphere.surface, At::Sphere(i));
                    }
                }
                UpperItem::Parallelogram(i) => {
                    let flat = &self.parallelograms[i as usize];
                    if flat.seen
                        && let Some(t) = flat.shape.intersect(ray)
                    {
                        nearest.offer(t, flat.surface, At::Parallelogram(i));
                    }
                }
                UpperItem::Placed(i) => self.meet_placed(simd, i, ray, nearest),
            }
            *limit = nearest.limit();
        });
    }

    #[inline(always)]
    fn meet_placed<S: Simd>(&self, simd: S, index: u32, ray: &Ray, nearest: &mut Nearest) {
        let thing = &self.placed[index as usize];
        if thing.camera == Opacity::Clear {
            return;
        }
        let single_sided = || self.surfaces[thing.surface.index()].single_sided;
        let own = thing.placement.ray(ray);
        match thing.target {
            PlacedTarget::Mesh(mesh) => {
                let mesh = &self.meshes[mesh as usize];
                let (o, d) = (own.o.as_vec3(), own.d.as_vec3());
                let hit = self.meet_mesh(simd, mesh, thing.surface, thing.camera, o, d, nearest.limit());
                if let Some((t, point)) = hit {
                    let surface = SurfaceId(thing.surface.0 + mesh.part(point.triangle).surface);
                    nearest.offer(t as f64, surface, At::Placed(index, PlacedSpot::Triangle(point)));
                }
            }
            PlacedTarget::Points(points) => {
                let points = &self.point_sets[points as usize];
                if let Some((t, point)) = points.intersect(simd, &own, nearest.limit(), single_sided()) {
                    nearest.offer(t, thing.surface, At::Placed(index, PlacedSpot::Point(point)));
                }
            }
            PlacedTarget::Solid(solid) => {
                let solid = &self.solids[solid as usize];
                if let Some(hit) = solid.intersect(&own, 0.0, f64::INFINITY, single_sided()) {
                    nearest.offer(hit.t, thing.surface, At::Placed(index, PlacedSpot::Part(hit.part)));
                }
            }
        }
    }

    /// Whether a camera ray ends at a triangle, or passes through.
    pub(super) fn seen(&self, mesh: &Mesh, first: u32, triangle: u32, d: Vec3) -> bool {
        let part = mesh.part(triangle);
        let surface = &self.surfaces[(first + part.surface) as usize];
        let face = surface.material.is_none().then(|| part.material(triangle));
        let of_face = || face.is_some_and(|material| self.rules.is_single_sided(material));
        let is_visible = surface.visible && !face.is_some_and(|material| self.rules.is_unseen(material));
        is_visible && !((surface.single_sided || of_face()) && mesh.is_behind(triangle, d))
    }

    /// The first triangle on a ray, in the mesh's space. Not inlined: one copy for each instruction set is enough.
    #[inline(never)]
    #[allow(clippy::too_many_arguments, reason = "a mesh with its place, a ray with its reach")]
    fn meet_mesh<S: Simd>(
        &self,
        simd: S,
        mesh: &Mesh,
        first: SurfaceId,
        opacity: Opacity,
        o: Vec3,
        d: Vec3,
        limit: f32,
    ) -> Option<(f32, TrianglePoint)> {
        if opacity == Opacity::Clear {
            return None;
        }
        let asks = |triangle| opacity == Opacity::Opaque || self.seen(mesh, first.0, triangle, d);
        let hit = simd.vectorize(
            #[inline(always)]
            || mesh.tree.closest(simd, &TraceRay::new(o, d), limit, &asks),
        )?;
        Some((hit.t, TrianglePoint { triangle: hit.triangle, u: hit.u, v: hit.v }))
    }

    /// What a camera ray sees at a hit of a shape.
    #[inline(always)]
    pub fn point(
        &self,
        ray: &Ray,
        hit: &Hit,
        differential: &RayDifferential,
        terminator: ShadowTerminator,
    ) -> ShapePoint {
        match hit.at {
            At::Sphere(i) => self.spheres[i as usize].shape.point(ray, hit.t, differential),
            At::Parallelogram(i) => self.parallelograms[i as usize].shape.point(ray, hit.t, differential),
            _ => self.far_point(ray, hit, differential, terminator),
        }
    }

    /// The normals of [`point`](Self::point): the facet's and the shading one.
    #[inline(always)]
    pub fn normals(&self, ray: &Ray, hit: &Hit) -> [Vec3; 2] {
        let mesh = match hit.at {
            At::World(point) => self.world.as_ref().map(|world| (&world.mesh, None, point)),
            At::Placed(index, PlacedSpot::Triangle(point)) => {
                let thing = &self.placed[index as usize];
                match thing.target {
                    PlacedTarget::Mesh(mesh) => Some((&self.meshes[mesh as usize], Some(&thing.placement), point)),
                    PlacedTarget::Points(_) | PlacedTarget::Solid(_) => None,
                }
            }
            _ => None,
        };
        match mesh {
            Some((mesh, placement, point)) => {
                let (normal, blended) = mesh.normals(placement, point);
                [normal, blended.unwrap_or(normal)].map(DVec3::as_vec3)
            }
            None => {
                let ShapePoint { normal, shading, .. } =
                    self.point(ray, hit, &RayDifferential::default(), ShadowTerminator::Hard);
                [normal, shading]
            }
        }
    }

    /// [`point`](Self::point) for what is in the trees.
    #[inline(never)]
    fn far_point(
        &self,
        ray: &Ray,
        hit: &Hit,
        differential: &RayDifferential,
        terminator: ShadowTerminator,
    ) -> ShapePoint {
        match hit.at {
            At::World(point) => {
                let world = self.world.as_ref().expect("the hit is on it");
                world.mesh.point(None, point, ray, hit.t, differential, terminator)
            }
            At::Placed(index, spot) => {
                let thing = &self.placed[index as usize];
                match (thing.target, spot) {
                    (PlacedTarget::Mesh(mesh), PlacedSpot::Triangle(point)) => {
                        let mesh = &self.meshes[mesh as usize];
                        mesh.point(Some(&thing.placement), point, ray, hit.t, differential, terminator)
                    }
                    (PlacedTarget::Points(points), PlacedSpot::Point(point)) => {
                        self.point_sets[points as usize].point(&thing.placement, point, ray, hit.t, differential)
                    }
                    (PlacedTarget::Solid(solid), PlacedSpot::Part(part)) => {
                        let hit = SolidHit { t: hit.t, part };
                        thing.placement.solid_point(&self.solids[solid as usize], &hit, ray, differential)
                    }
                    _ => unreachable!("a spot is on the kind of thing that was hit"),
                }
            }
            At::Sphere(_) | At::Parallelogram(_) | At::Light => unreachable!("these are not in the trees"),
        }
    }

    /// How the point of a hit of a shape moves with u and with v.
    pub fn tangents(&self, ray: &Ray, hit: &Hit) -> [DVec3; 2] {
        match hit.at {
            At::Sphere(i) => self.spheres[i as usize].shape.tangents(ray, hit.t),
            At::Parallelogram(i) => self.parallelograms[i as usize].shape.tangents(),
            At::World(point) => {
                let world = self.world.as_ref().expect("the hit is on it");
                world.mesh.tangents(None, point.triangle, None)
            }
            At::Placed(index, spot) => {
                let Placed { placement, target, .. } = &self.placed[index as usize];
                match (*target, spot) {
                    (PlacedTarget::Mesh(mesh), PlacedSpot::Triangle(point)) => {
                        self.meshes[mesh as usize].tangents(Some(placement), point.triangle, None)
                    }
                    (PlacedTarget::Points(points), PlacedSpot::Point(point)) => {
                        self.point_sets[points as usize].tangents(placement, point, ray, hit.t)
                    }
                    (PlacedTarget::Solid(solid), PlacedSpot::Part(part)) => {
                        placement.solid_tangents(&self.solids[solid as usize], &SolidHit { t: hit.t, part }, ray)
                    }
                    _ => unreachable!("a spot is on the kind of thing that was hit"),
                }
            }
            At::Light => panic!("a light has no texture coordinates"),
        }
    }

    /// The triangle that was hit, of which of the meshes that were joined.
    fn triangle(&self, hit: &Hit) -> Option<(&JoinedPart, u32)> {
        let (mesh, triangle) = match hit.at {
            At::World(point) => (&self.world.as_ref().expect("the hit is on it").mesh, point.triangle),
            At::Placed(index, PlacedSpot::Triangle(point)) => {
                let PlacedTarget::Mesh(mesh) = self.placed[index as usize].target else {
                    unreachable!("only meshes have triangles")
                };
                (&self.meshes[mesh as usize], point.triangle)
            }
            _ => return None,
        };
        Some((mesh.part(triangle), triangle))
    }

    /// The material of the triangle that was hit, of a mesh that has several.
    pub fn face_material(&self, hit: &Hit) -> MaterialId {
        let (part, triangle) = self.triangle(hit).expect("only meshes have more than one material");
        part.material(triangle)
    }

    /// The triangle of a mesh or the point of a point set that was hit, in the order of its own.
    pub fn primitive(&self, hit: &Hit) -> Option<u32> {
        match hit.at {
            At::Placed(_, PlacedSpot::Point(point)) => Some(point),
            _ => self.triangle(hit).map(|(part, triangle)| part.number(triangle)),
        }
    }
}
