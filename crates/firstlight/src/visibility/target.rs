//! A light as the target of shadow rays: an oriented box around it, and its samples in blocks of neighbours.

use fearless_simd::{Level, f32x16, prelude::*};

use crate::accel::{Aabb, dispatch_all};
use crate::ids::LightId;
use crate::light::{Light, Points, Towards};
use crate::math::{Axes, DMat3, DVec3, LANES, LightEnd, Vec3, least_and_most};
use crate::scene::Scene;
use crate::shape::LightSeen;

/// An oriented box around a light: the points `center` + u `axes[0]` + v `axes[1]` + w `axes[2]`, each of u, v, w from
/// -1 to 1. For a light that is infinitely far away, its direction `center`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightHull {
    pub center: Vec3,
    pub axes: [Vec3; 3],
    /// Whether it has a position.
    pub finite: bool,
    /// Whether it is a sphere, whose radius is the length of each axis.
    pub is_ball: bool,
    /// The unit normal of a flat light; 0 for all others.
    pub plane: Vec3,
}

/// Sixteen samples of a light, by their coordinates along the axes of its box. Lanes without a sample repeat one.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct SampleBlock {
    pub at: [[f32; LANES]; 3],
    /// The same points in world space, in metres.
    pub point: [[f32; LANES]; 3],
    /// Their indices among the light's samples.
    pub sample: [u32; LANES],
    /// A mask of the lanes that hold a sample.
    pub present: u16,
}

/// The boxes of sixteen blocks: the center and half the size of each along the axes of the light's box.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct BlockBounds {
    pub middle: [[f32; LANES]; 3],
    pub half: [[f32; LANES]; 3],
}

/// A light as the target of shadow rays.
#[derive(Clone, Debug)]
pub(crate) struct Target {
    /// Which light.
    pub light: LightId,
    pub hull: LightHull,
    /// The samples, neighbours together; empty for a light that is integrated.
    pub blocks: Vec<SampleBlock>,
    /// The boxes of the blocks, sixteen at a time.
    pub cells: Vec<BlockBounds>,
    /// Whether the blocks have the order of the light's samples, and each is full.
    pub is_in_order: bool,
}

/// Relative enlargement of the axes, and their least length relative to the longest: more than the rounding to single
/// precision.
const ROOM: f64 = 1e-5;

impl LightHull {
    pub fn at(center: Vec3, finite: bool) -> Self {
        LightHull { center, axes: [Vec3::ZERO; 3], finite, is_ball: false, plane: Vec3::ZERO }
    }

    /// The smallest box around `points` with axes along `e0`, `e1` and their cross product.
    fn around(e0: DVec3, e1: DVec3, points: &[DVec3]) -> Self {
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = points.iter().fold(none, |(a, b), q| (a.min(*q), b.max(*q)));
        let center = (low + (high - low) * 0.5).as_vec3();
        let across = e0.cross(e1).normalize_or(DVec3::Y);
        let thin = across * (e0.length() + e1.length());
        let axes = [e0, e1, thin].map(|axis| axis.as_vec3());
        let mut hull = LightHull { center, axes, finite: true, is_ball: false, plane: Vec3::ZERO };
        // Fit the axes to the points, then enlarge the box while rounding leaves a point outside
        let needed = points.iter().fold(DVec3::ZERO, |needed, q| needed.max(hull.coordinates(*q).abs()));
        for (axis, needed) in hull.axes.iter_mut().zip(needed.to_array()) {
            *axis = (axis.as_dvec3() * (needed * (1.0 + ROOM)).max(ROOM)).as_vec3();
        }
        while !points.iter().all(|q| hull.coordinates(*q).abs().max_element() <= 1.0) {
            hull.axes = hull.axes.map(|a| a * 1.5);
        }
        hull
    }

    pub fn of(light: &Light) -> Self {
        let Some(area) = light.area() else {
            let Towards { l, finite } = light.towards(0, Vec3::ZERO);
            return Self::at(l, finite);
        };
        // The exact shape, and its samples as they are rounded
        let ([e0, e1], mut points) = area.shape.edges_and_corners();
        if !light.exact {
            points.extend((0..area.samples()).map(|k| area.point(k).as_dvec3()));
        }
        LightHull { is_ball: area.shape.is_ball(), plane: light.plane(), ..Self::around(e0, e1, &points) }
    }

    /// The coordinates of a point along the axes.
    fn coordinates(&self, q: DVec3) -> DVec3 {
        self.inverse() * (q - self.center.as_dvec3())
    }

    /// The matrix from vectors from the center to coordinates along the axes.
    fn inverse(&self) -> DMat3 {
        let [a, b, c] = self.axes.map(|v| v.as_dvec3());
        DMat3::from_cols(a, b, c).inverse()
    }

    /// Half the size of its bounding box along the axes of the world.
    pub fn reach(&self) -> Vec3 {
        let [a, b, c] = self.axes.map(|v| v.abs());
        a + b + c
    }

    /// The axis-aligned bounding box; of a light infinitely far away that of its direction.
    pub fn bounds(&self) -> Aabb {
        let reach = self.reach() * (1.0 + 4.0 * f32::EPSILON);
        let room = (self.center.abs() + reach) * f32::EPSILON;
        Aabb { min: self.center - reach - room, max: self.center + reach + room }
    }

    /// The light relative to `p`.
    #[inline(always)]
    pub fn from(&self, p: Vec3) -> LightSeen {
        let l = if self.finite { self.center - p } else { self.center };
        let seen = LightSeen { plane: self.plane, ..LightSeen::new(l, self.axes, self.finite) };
        if !self.is_ball {
            return seen;
        }
        let (distance, radius) = (l.length(), self.axes[0].length());
        let facing = Axes::around((l / distance).as_dvec3());
        let frame = [facing.x, facing.y, facing.z].map(|axis| axis.as_vec3() * radius);
        LightSeen { frame, radii: Some(distance / radius), ..seen }
    }
}

impl SampleBlock {
    /// The block of samples with these numbers and points. In lanes where it is called within `vectorize`.
    #[inline(always)]
    fn new(
        sample: [u32; LANES],
        point: [[f32; LANES]; 3],
        present: u16,
        inverse: &DMat3,
        center: DVec3,
    ) -> SampleBlock {
        let [x, y, z] = inverse.to_cols_array_2d();
        let mut at = [[0.0; LANES]; 3];
        for k in 0..LANES {
            let (dx, dy, dz) = (
                f64::from(point[0][k]) - center.x,
                f64::from(point[1][k]) - center.y,
                f64::from(point[2][k]) - center.z,
            );
            for axis in 0..3 {
                at[axis][k] = ((x[axis] * dx + y[axis] * dy) + z[axis] * dz) as f32;
            }
        }
        SampleBlock { at, point, sample, present }
    }
}

impl BlockBounds {
    /// Of at most sixteen blocks.
    #[inline(always)]
    fn of<S: Simd>(simd: S, blocks: &[SampleBlock]) -> BlockBounds {
        let mut bounds = BlockBounds { middle: [[0.0; LANES]; 3], half: [[0.0; LANES]; 3] };
        for (place, block) in blocks.iter().enumerate() {
            for axis in 0..3 {
                let [low, high] = least_and_most(f32x16::load_array_ref(simd, &block.at[axis]));
                bounds.middle[axis][place] = (low + high) * 0.5;
                bounds.half[axis][place] = (high - low) * 0.5 + 4.0 * f32::EPSILON;
            }
        }
        bounds
    }
}

impl Target {
    /// All lights of a scene, in its order.
    pub fn of_all(scene: &Scene) -> Vec<Self> {
        (0..scene.lights.len()).map(|index| Self::new(scene, LightId(index as u32))).collect()
    }

    pub fn new(scene: &Scene, id: LightId) -> Self {
        let light = &scene.lights[id.index()];
        let target = Target::without_samples(id, LightHull::of(light));
        match light.area() {
            Some(area) if !light.exact => target.with(scene.level, area.points()),
            _ => target,
        }
    }

    /// The end of shadow rays to it.
    pub fn end(&self) -> LightEnd {
        LightEnd { light: self.light, plane: self.hull.plane }
    }

    /// The same light with these samples.
    fn with(&self, level: Level, points: &Points) -> Self {
        let (inverse, center) = (self.hull.inverse(), self.hull.center.as_dvec3());
        let sample = |k: usize| (k as u32, points.get(k), inverse * (points.get(k).as_dvec3() - center));
        let mut samples: Vec<Sample> = (0..points.count()).map(sample).collect();
        gather_neighbours(&mut samples);
        let block = |samples: &[Sample]| {
            let lane = |k: usize| samples[k.min(samples.len() - 1)];
            let points = [0, 1, 2].map(|axis| std::array::from_fn(|k| lane(k).1[axis]));
            let present = ((1u32 << samples.len()) - 1) as u16;
            SampleBlock::new(std::array::from_fn(|k| lane(k).0), points, present, &inverse, center)
        };
        let blocks = samples.chunks(LANES).map(block).collect();
        Target { blocks, is_in_order: false, ..Target::without_samples(self.light, self.hull) }.bounded(level)
    }

    /// The same light with these samples, each sixteen of which are neighbours.
    pub fn with_neighbours(&self, level: Level, points: &Points) -> Self {
        let (inverse, center) = (self.hull.inverse(), self.hull.center.as_dvec3());
        let mut blocks = Vec::with_capacity(points.blocks.len());
        dispatch_all!(level, _simd => {
            for (number, block) in points.blocks.iter().enumerate() {
                let sample = std::array::from_fn(|k| (number * LANES + k) as u32);
                blocks.push(SampleBlock::new(sample, block.0, u16::MAX, &inverse, center));
            }
        });
        Target { blocks, ..Target::without_samples(self.light, self.hull) }.bounded(level)
    }

    /// The boxes of sixteen blocks, by their indices.
    pub fn bounds_of(&self, blocks: &[u32; LANES]) -> BlockBounds {
        let mut bounds = BlockBounds { middle: [[0.0; LANES]; 3], half: [[0.0; LANES]; 3] };
        for (lane, block) in blocks.iter().enumerate() {
            let (cells, place) = (&self.cells[*block as usize / LANES], *block as usize % LANES);
            for axis in 0..3 {
                bounds.middle[axis][lane] = cells.middle[axis][place];
                bounds.half[axis][lane] = cells.half[axis][place];
            }
        }
        bounds
    }

    /// A light, or a box around some of which `light` is one, without samples.
    pub fn without_samples(light: LightId, hull: LightHull) -> Self {
        Target { light, hull, blocks: Vec::new(), cells: Vec::new(), is_in_order: true }
    }

    /// Computes the boxes of its blocks.
    fn bounded(mut self, level: Level) -> Self {
        let Target { blocks, cells, .. } = &mut self;
        dispatch_all!(level, simd => {
            for blocks in blocks.chunks(LANES) {
                cells.push(BlockBounds::of(simd, blocks));
            }
        });
        self
    }
}

/// A sample: its index, its position, and its coordinates along the axes of the light's box.
type Sample = (u32, Vec3, DVec3);

/// Orders samples so that each sixteen are neighbours: recursive median splits along the longest axis.
fn gather_neighbours(samples: &mut [Sample]) {
    if samples.len() <= LANES {
        return;
    }
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = samples.iter().fold(none, |(a, b), (_, _, at)| (a.min(*at), b.max(*at)));
    let size = high - low;
    let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
    let half = samples.len().div_ceil(LANES) / 2 * LANES;
    samples.select_nth_unstable_by(half, |a, b| a.2[axis].total_cmp(&b.2[axis]).then(a.0.cmp(&b.0)));
    let (left, right) = samples.split_at_mut(half);
    gather_neighbours(left);
    gather_neighbours(right);
}
