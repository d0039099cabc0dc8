//! What the project's own benchmarks, pictures and verifications ask of the library's insides. Not for others: it
//! changes without notice.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd};

use crate::accel::{Aabb, Bvh, RayPacket16, RayTile, TraceRay, dispatch_eight};
use crate::film::resolve::TermSums;
use crate::ids::LightId;
use crate::material::ShadingPoint;
use crate::math::{LANES, Ray, Vec3};
use crate::render::Counts;
use crate::render::chosen_points::ChosenPoints;
pub use crate::render::chosen_points::{ChoosePoints, LightPoint};
use crate::render::pixel::PixelSum;
use crate::scene::{CompileOptions, Scene, SceneDesc, ShadowRays, TracedHit};
use crate::shape::{RayDifferential, SurfaceInteraction, TileHits, TriangleTree, every};
use crate::visibility::{OccluderList, ShadowView, Target, Viewpoint, Visibility, VisibilityResolver, VisibilityStats};

/// Origin and direction of a ray.
pub type RayBits = [f32; 6];

/// Where a ray ended: the distance, infinite if nowhere, and the triangle.
pub type HitBits = (f32, u32);

const MISS: HitBits = (f32::INFINITY, u32::MAX);

#[inline(always)]
fn parts(ray: &RayBits) -> (Vec3, Vec3) {
    (Vec3::new(ray[0], ray[1], ray[2]), Vec3::new(ray[3], ray[4], ray[5]))
}

/// A mesh with its tree.
pub struct MeshTree(TriangleTree);

impl MeshTree {
    /// Builds the tree.
    pub fn build(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> MeshTree {
        MeshTree(TriangleTree::build(positions, triangles))
    }

    /// Memory of the tree, in bytes.
    pub fn bytes(&self) -> usize {
        self.0.bytes()
    }

    /// The closest hits, ray by ray.
    pub fn closest(&self, rays: &[RayBits], hits: &mut [HitBits]) {
        dispatch_eight!(Level::new(), simd => self.closest_simd(simd, rays, hits));
    }

    #[inline(always)]
    fn closest_simd<S: Simd>(&self, simd: S, rays: &[RayBits], hits: &mut [HitBits]) {
        for (ray, hit) in rays.iter().zip(hits) {
            let (o, d) = parts(ray);
            let found = self.0.closest(simd, &TraceRay::new(o, d), f32::INFINITY, &|_| true);
            *hit = found.map_or(MISS, |found| (found.t, found.triangle));
        }
    }

    /// Whether anything is between the ends of the rays, ray by ray.
    pub fn any(&self, rays: &[RayBits], t_max: f32, hidden: &mut [bool]) {
        dispatch_eight!(Level::new(), simd => self.any_simd(simd, rays, t_max, hidden));
    }

    #[inline(always)]
    fn any_simd<S: Simd>(&self, simd: S, rays: &[RayBits], t_max: f32, hidden: &mut [bool]) {
        for (ray, hidden) in rays.iter().zip(hidden) {
            let (o, d) = parts(ray);
            *hidden = self.0.any(simd, &TraceRay::new(o, d), t_max, &|_| true);
        }
    }

    /// The closest hits, 64 rays at once.
    pub fn tiles(&self, rays: &[RayBits], hits: &mut [HitBits]) {
        for (rays, hits) in rays.chunks(64).zip(hits.chunks_mut(64)) {
            self.tile(rays, hits);
        }
    }

    fn tile(&self, rays: &[RayBits], hits: &mut [HitBits]) {
        let mut tile = RayTile::ZERO;
        for (place, ray) in rays.iter().enumerate() {
            let (o, d) = parts(ray);
            tile.set(place, o, d);
        }
        let mut found = TileHits::new(f32::INFINITY);
        self.0.tile_at(Level::new(), &tile, u64::MAX, 0, &mut found, &every);
        for (place, hit) in hits.iter_mut().enumerate() {
            *hit = found.get(place).map_or(MISS, |found| (found.t, found.triangle));
        }
    }

    /// Whether anything is between the ends of the rays, 16 rays at once.
    pub fn packets(&self, rays: &[RayBits], t_max: f32, hidden: &mut [bool]) {
        for (rays, hidden) in rays.chunks(16).zip(hidden.chunks_mut(16)) {
            self.packet(rays, t_max, hidden);
        }
    }

    fn packet(&self, rays: &[RayBits], t_max: f32, hidden: &mut [bool]) {
        let mut packet = RayPacket16::ZERO;
        for (place, ray) in rays.iter().enumerate() {
            let (o, d) = parts(ray);
            packet.set(place, o, d);
        }
        let mask = self.0.any16_at(Level::new(), &packet, &[t_max; 16], 0xffff, &every);
        for (place, hidden) in hidden.iter_mut().enumerate() {
            *hidden = mask >> place & 1 == 1;
        }
    }
}

/// Many copies of one mesh: moved, not turned.
pub struct Instances<'a> {
    mesh: &'a MeshTree,
    offsets: &'a [[f32; 3]],
    bvh: Bvh,
}

impl<'a> Instances<'a> {
    /// Builds the tree over the copies.
    pub fn build(mesh: &'a MeshTree, offsets: &'a [[f32; 3]]) -> Self {
        let Aabb { min, max } = mesh.0.bounds();
        let boxes: Vec<_> = offsets
            .iter()
            .map(|offset| {
                let offset = Vec3::from_array(*offset);
                Aabb { min: min + offset, max: max + offset }
            })
            .collect();
        Instances { mesh, offsets, bvh: Bvh::build(&boxes) }
    }

    /// The closest hits, ray by ray.
    pub fn closest(&self, rays: &[RayBits], hits: &mut [HitBits]) {
        dispatch_eight!(Level::new(), simd => self.closest_simd(simd, rays, hits));
    }

    #[inline(always)]
    fn closest_simd<S: Simd>(&self, simd: S, rays: &[RayBits], hits: &mut [HitBits]) {
        for (ray, hit) in rays.iter().zip(hits) {
            let (o, d) = parts(ray);
            let (mut t_max, mut best) = (f32::INFINITY, MISS);
            self.bvh.closest(simd, &TraceRay::new(o, d), &mut t_max, |instance, t_max| {
                let o = o - Vec3::from_array(self.offsets[instance as usize]);
                if let Some(found) = self.mesh.0.closest(simd, &TraceRay::new(o, d), *t_max, &|_| true) {
                    *t_max = found.t;
                    best = (found.t, found.triangle);
                }
            });
            *hit = best;
        }
    }

    /// Whether anything is between the ends of the rays, ray by ray.
    pub fn any(&self, rays: &[RayBits], t_max: f32, hidden: &mut [bool]) {
        dispatch_eight!(Level::new(), simd => self.any_simd(simd, rays, t_max, hidden));
    }

    #[inline(always)]
    fn any_simd<S: Simd>(&self, simd: S, rays: &[RayBits], t_max: f32, hidden: &mut [bool]) {
        for (ray, hidden) in rays.iter().zip(hidden) {
            let (o, d) = parts(ray);
            *hidden = self.bvh.any(simd, &TraceRay::new(o, d), t_max, |instance| {
                let o = o - Vec3::from_array(self.offsets[instance as usize]);
                self.mesh.0.any(simd, &TraceRay::new(o, d), t_max, &|_| true)
            });
        }
    }
}

/// A mesh under a rectangle light, and the points of it that a camera sees and some of the light is above the horizon
/// of.
pub struct Soft {
    scene: Scene,
    target: Target,
    resolver: VisibilityResolver,
    points: Vec<Viewpoint>,
    /// The points of each tile of pixels.
    tiles: Vec<std::ops::Range<u32>>,
    settled: VisibilityStats,
}

impl Soft {
    /// `light` is the middle of a level square and half its side; `camera` are rays, of which each 64 are a tile.
    pub fn new(
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        light: ([f32; 3], f32),
        samples: u32,
        camera: &[RayBits],
    ) -> Option<Soft> {
        let mut mesh = crate::MeshDesc { triangles: triangles.to_vec(), ..crate::MeshDesc::default() };
        mesh.positions = positions.iter().map(|p| p.map(f64::from)).collect();
        let side = f64::from(light.1) * 2.0;
        let mut lamp = crate::RectangleDesc::with_edges(light.0.map(f64::from), [side, 0.0, 0.0], [0.0, 0.0, side]);
        lamp.samples = Some(samples.into());
        lamp.sides = Some(crate::EmitSides::Both);
        lamp.visible = false;
        let desc = SceneDesc {
            shapes: vec![crate::ShapeDesc::Mesh(mesh)],
            lights: vec![crate::LightDesc::Rectangle(lamp)],
            cameras: vec![(String::new(), crate::CameraDesc::new([0.0, 0.0, 9.0]))],
            ..SceneDesc::default()
        };
        let scene = desc.compile(&crate::NoAssets, &CompileOptions::default()).ok()?.scene;
        let light = LightId(0);
        let target = Target::new(&scene, light);
        let (mut points, mut tiles) = (Vec::new(), Vec::new());
        let still = Vec3::ZERO;
        let differential =
            RayDifferential { dx: still, dy: still, origin_dx: still, origin_dy: still, steps_per_pixel: 1.0 };
        for tile in camera.chunks(64) {
            let first = points.len() as u32;
            for ray in tile {
                let (o, d) = parts(ray);
                let ray = Ray { o, d };
                let Some(hit) = scene.intersect_local(&ray) else { continue };
                let si = scene.local_surface(&ray, &hit, &differential);
                let counts = |k: usize| si.horizon.dot(scene.lights[0].towards(k, si.lit_from).l) > 0.0;
                if (0..scene.lights[0].samples()).any(counts) {
                    points.push(viewpoint(&scene, &si));
                }
            }
            if points.len() as u32 > first {
                tiles.push(first..points.len() as u32);
            }
        }
        Some(Soft {
            scene,
            target,
            resolver: VisibilityResolver::default(),
            points,
            tiles,
            settled: VisibilityStats::default(),
        })
    }

    /// For each point: where its rays start, the point, its normal.
    pub fn points(&self) -> Vec<[f32; 9]> {
        let row = |v: &Viewpoint| {
            let (s, p, n) = (v.start, v.p, v.horizon);
            [s.x, s.y, s.z, p.x, p.y, p.z, n.x, n.y, n.z]
        };
        self.points.iter().map(row).collect()
    }

    /// The light's samples, neighbours together, in blocks of sixteen; those that are missing in the last stand for
    /// another.
    pub fn samples(&self) -> Vec<[f32; 3]> {
        let all = self.target.blocks.iter().flat_map(|b| (0..LANES).map(|i| [0, 1, 2].map(|axis| b.point[axis][i])));
        all.collect()
    }

    /// How many samples of a light there are.
    pub fn count(&self) -> usize {
        self.scene.lights[0].samples()
    }

    /// For each point and block of samples, in the light's order, which are hidden; those below the horizon in any way.
    pub fn shafts(&mut self, hidden: &mut Vec<u16>) {
        let blocks = self.target.blocks.len();
        hidden.clear();
        hidden.resize(self.points.len() * blocks, 0);
        let mut order = Vec::new();
        self.settled = VisibilityStats::default();
        for tile in &self.tiles {
            order.clear();
            order.extend(tile.clone());
            let (scene, settled) = (&self.scene, &mut self.settled);
            let each = |k: usize, visibility, view: &mut crate::visibility::ShadowView| {
                let hidden = &mut hidden[k * blocks..(k + 1) * blocks];
                match visibility {
                    Visibility::Full => {}
                    Visibility::None | Visibility::BelowHorizon => hidden.fill(0xffff),
                    _ => hidden.copy_from_slice(&view.hidden),
                }
            };
            self.resolver.resolve(Level::new(), scene, &self.target, &self.points, &mut order, settled, each);
        }
    }

    /// The same, every sample traced, sixteen at a time in the light's order.
    pub fn traced(&self, hidden: &mut Vec<u16>) {
        let light = &self.scene.lights[0];
        hidden.clear();
        for point in &self.points {
            for first in (0..self.count()).step_by(LANES) {
                let from = [point.ray(self.target.end(), Vec3::ZERO, true)];
                let mut shadows = ShadowRays { from: &from, rays: RayPacket16::ZERO, t_end: [0.0; LANES] };
                let mut active = 0;
                for k in first..(first + LANES).min(self.count()) {
                    let l = light.towards(k, point.p).l;
                    shadows.rays.set(k - first, point.start, l);
                    shadows.t_end[k - first] = point.ray(self.target.end(), l, true).end();
                    active |= u16::from(point.horizon.dot(l) > 0.0) << (k - first);
                }
                hidden.push(self.scene.geometry.are_blocked(Level::new(), &shadows, active));
            }
        }
    }

    /// Which samples do not count, as they are below the horizon.
    pub fn below(&self) -> Vec<u16> {
        let light = &self.scene.lights[0];
        let mut below = Vec::new();
        for point in &self.points {
            for first in (0..self.count()).step_by(LANES) {
                let lane = |k: usize| k < self.count() && point.horizon.dot(light.towards(k, point.p).l) > 0.0;
                below.push(!(0..LANES).fold(0, |mask, i| mask | u16::from(lane(first + i)) << i));
            }
        }
        below
    }

    /// Bits of blocks of neighbouring samples, as [`samples`](Self::samples) has them, in the light's order.
    pub fn in_order(&self, hidden: &[u16]) -> Vec<u16> {
        let blocks = &self.target.blocks;
        let mut ordered = vec![0; hidden.len()];
        for (ordered, hidden) in ordered.chunks_mut(blocks.len()).zip(hidden.chunks(blocks.len())) {
            for (block, hidden) in blocks.iter().zip(hidden) {
                for lane in (0..LANES).filter(|lane| hidden & block.present & 1 << lane != 0) {
                    let k = block.sample[lane] as usize;
                    ordered[k / LANES] |= 1 << (k % LANES);
                }
            }
        }
        ordered
    }

    /// How many points are lit, hidden, below the horizon, cut; shafts; what they held; samples traced.
    pub fn settled(&self) -> [u64; 7] {
        let VisibilityStats { classes: [lit, hidden, below, mask], shafts, occluders, traced } = self.settled;
        [lit, hidden, below, mask, shafts, occluders, traced]
    }
}

/// How much of a light is seen, and how that was found out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShareSeen {
    /// Nothing lies between the points of a block and the light: all of it, for all of them.
    Empty,
    /// Something lies there, but not before this point: all of it.
    Lit,
    /// One thing hides all of it.
    Hidden,
    /// It is behind the surface.
    BelowHorizon,
    /// Some of it.
    Cut,
}

/// What is seen of a light, which is sampled, from where the ray through the middle of each pixel ends, row by row;
/// `None` where that is nowhere, or at a light. Each `block` x `block` pixels have a shaft together.
pub fn sights(scene: &Scene, light: u32, block: u32) -> Vec<Option<ShareSeen>> {
    let (level, target) = (Level::new(), Target::new(scene, LightId(light)));
    let (mut occluders, mut view) = (OccluderList::default(), ShadowView::default());
    let mut sights = vec![None; (scene.width * scene.height) as usize];
    let (mut points, mut pixels, mut order) = (Vec::new(), Vec::new(), Vec::new());
    for top in (0..scene.height).step_by(block as usize) {
        for left in (0..scene.width).step_by(block as usize) {
            // The block's points
            points.clear();
            pixels.clear();
            for y in top..(top + block).min(scene.height) {
                for x in left..(left + block).min(scene.width) {
                    let (ray, differential) = scene.camera.local_ray(x as f32 + 0.5, y as f32 + 0.5, 1.0);
                    if let TracedHit::Surface(si) = scene.see(&ray, scene.intersect_local(&ray), &differential) {
                        points.push(viewpoint(scene, &si));
                        pixels.push((y * scene.width + x) as usize);
                    }
                }
            }
            if points.is_empty() {
                continue;
            }
            // What may stand between them and the light, then each for itself
            order.clear();
            order.extend(0..points.len() as u32);
            occluders.gather(level, scene, &target, &points, &order, usize::MAX);
            for (point, pixel) in points.iter().zip(&pixels) {
                sights[*pixel] = Some(match view.classify(level, scene, &target, &occluders, point) {
                    Visibility::Full if occluders.count() == 0 => ShareSeen::Empty,
                    Visibility::Full => ShareSeen::Lit,
                    Visibility::None => ShareSeen::Hidden,
                    Visibility::BelowHorizon => ShareSeen::BelowHorizon,
                    _ => ShareSeen::Cut,
                });
            }
        }
    }
    sights
}

/// A pixel of the film, all its n x n camera rays lit by the plain renderer with the points that are chosen on area
/// lights: red, green, blue premultiplied, alpha.
pub fn pixel(scene: &Scene, at: [u32; 2], choose: &mut ChoosePoints) -> [f32; 4] {
    let mut sum = PixelSum::new(scene);
    let hit = |_, _, ray: &Ray| scene.intersect_local(ray);
    let go_on = || ControlFlow::Continue(());
    let _ = sum.sample(scene, at, &mut ChosenPoints::new(choose), hit, &mut Counts::default(), &go_on);
    let mut sums = TermSums::new(scene, 1, &[]);
    sum.resolve(scene, 0, &mut sums);
    sums.colors[0]
}

/// Where light is gathered on a surface.
fn viewpoint(scene: &Scene, si: &SurfaceInteraction) -> Viewpoint {
    let bsdf = scene.bsdf(si);
    Viewpoint::of(&ShadingPoint::of(si, &bsdf, &scene.ambient))
}
