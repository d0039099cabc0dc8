//! Area lights: what all of them say beside their shape, and what runs.

use std::f64::consts::PI;
use std::sync::{Arc, OnceLock};

use fearless_simd::{f32x16, prelude::*};

use super::{
    DiskLight, EmitSides, Falloff, FineCell, Light, LightKind, LightScale, PointBlock, Points, Rectangle, SampleSet,
    SphereLight, scaled, way_error,
};
use crate::context::{CompileContext, show};
use crate::describe::{ColorDesc, SamplesDesc};
use crate::math::{DMat3, DVec3, ErrorBound, LANES, Ray, Vec3, Vec3x16};
use crate::parallel;
use crate::shape::{Parallelogram, PlaneSide};

/// The largest number of points on one light.
pub(crate) const MAX_SAMPLES: u32 = 1 << 20;

/// How many points stand for a light that is `exact`, where it has to be sampled all the same.
pub(crate) const REFERENCE_SAMPLES: u32 = 400;

/// Declares the table of an area light: its own fields, and those that all area lights have.
macro_rules! area_table {
    (
        $(#[doc = $doc:literal])*
        pub struct $name:ident { $($own:tt)* }
    ) => {
        $crate::light::light_table! {
            $(#[doc = $doc])*
            pub struct $name { $($own)* }
            /// Radiance (physical), or a plain factor (constant); 0 to 1e15.
            strength {
                /// The sides that emit; without it, `front` under `physical` and `both` under `constant`.
                pub sides: Option<$crate::light::EmitSides> = None,
                /// Whether the camera sees it, as its colour.
                pub visible: bool = true,
                /// Whether it stops the light of others.
                pub blocks: bool = false,
            } {
                /// How many points of it are sampled, 1 to 1048576, or `"exact"`: it is integrated, not sampled.
                /// Without it, `render.samples`.
                pub samples: Option<$crate::describe::SamplesDesc> = None,
                /// How those points are laid out.
                pub set: $crate::light::SampleSet = $crate::light::SampleSet::Sobol,
                /// The seed of the sets `uniform` and `stratified`.
                pub seed: u32 = 0,
            }
        }

        impl $name {
            /// What it says that every area light can say.
            pub(super) fn emitter(&self) -> $crate::light::area::AreaCommon {
                let Self { color, strength, falloff, sides, visible, blocks, shadows, samples, set, seed, .. } = *self;
                $crate::light::area::AreaCommon {
                    color, strength, falloff, sides, visible, blocks, shadows, samples, set, seed,
                }
            }
        }
    };
}

pub(super) use area_table;

/// The direction that the front of a flat light faces.
pub(super) fn front(
    cx: &mut CompileContext,
    center: [f64; 3],
    look_at: Option<[f64; 3]>,
    normal: Option<[f64; 3]>,
) -> [f64; 3] {
    const DOWN: [f64; 3] = [0.0, -1.0, 0.0];
    if let (Some(target), Some(normal)) = (look_at, normal) {
        let message = format!("{} is given beside normal = {}", show(&target), show(&normal));
        cx.error("look_at", message, Some("one of them says where the light faces; leave out the other"));
        return DOWN;
    }
    let Some(target) = look_at else {
        let normal = normal.unwrap_or(DOWN);
        return if cx.edge("normal", normal) { normal } else { DOWN };
    };
    cx.point("look_at", target);
    let towards = DVec3::from(target) - DVec3::from(center);
    if towards.length() < MIN_DISTANCE {
        let message = format!("{} is the light's center: there is no direction to face", show(&target));
        cx.error("look_at", message, Some("move one of them, or say normal instead"));
        return DOWN;
    }
    towards.normalize().to_array()
}

/// A light and what it faces nearer than this, in metres, are the same point.
const MIN_DISTANCE: f64 = 1e-9;

/// The largest sine of the angle that radii which a transform moved may be off a right one, and the largest relative
/// difference of their lengths: others are those of an ellipse or an ellipsoid.
const MAX_SKEW: f64 = 1e-6;

/// Whether these are radii of something round, each at right angles to all others.
pub(super) fn are_round(radii: &[DVec3]) -> bool {
    let is_right = |a: &DVec3, b: &DVec3| a.dot(*b).abs() <= MAX_SKEW * a.length() * b.length();
    let is_same = |a: &DVec3| (a.length() - radii[0].length()).abs() <= MAX_SKEW * radii[0].length();
    radii.iter().enumerate().all(|(i, a)| is_same(a) && radii[..i].iter().all(|b| is_right(a, b)))
}

/// What every area light says beside its name and its shape.
#[derive(Clone, Copy, Debug)]
pub(super) struct AreaCommon {
    pub color: ColorDesc,
    pub strength: f64,
    pub falloff: Falloff,
    pub sides: Option<EmitSides>,
    pub visible: bool,
    pub blocks: bool,
    pub shadows: bool,
    pub samples: Option<SamplesDesc>,
    pub set: SampleSet,
    pub seed: u32,
}

/// The products of the coordinates of a vector.
pub(super) fn products(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

/// Checks the number of samples.
pub(crate) fn check_samples(cx: &mut CompileContext, samples: SamplesDesc, hint: &str) -> SamplesDesc {
    if let SamplesDesc::Count(count) = samples {
        cx.count("samples", count, 1, MAX_SAMPLES, Some(hint));
    }
    samples
}

impl AreaCommon {
    /// Whether both sides emit.
    pub fn both_sides(&self) -> bool {
        match self.sides {
            Some(sides) => sides == EmitSides::Both,
            None => self.falloff == Falloff::Constant,
        }
    }

    /// The light of that shape. `samples` is the scene's default.
    pub fn compile(&self, cx: &mut CompileContext, shape: AreaShape, samples: SamplesDesc) -> Light {
        let samples = match self.samples {
            Some(own) => check_samples(cx, own, "points on this light"),
            None => samples,
        };
        let (exact, count) = match samples {
            SamplesDesc::Exact => (true, REFERENCE_SAMPLES),
            SamplesDesc::Count(count) => (false, count),
        };
        if let Err(hint) = self.set.allows(count) {
            let field = if self.samples.is_some() { "samples" } else { "set" };
            let message = format!("{count} points cannot be laid out as \"{}\"", self.set.name());
            cx.error(field, message, Some(&hint));
        }
        // Physical: each point stands for its share of the area
        let area = match self.falloff {
            Falloff::Physical => shape.measure(),
            Falloff::Constant => 1.0,
        };
        let scale = scaled(cx, self.color, self.strength, self.falloff.factor() * area / count.max(1) as f64);
        let whole = LightScale { factor: self.falloff.factor(), ..scale };
        let [low, high] = shape.bounds();
        let area = Area {
            middle: ((low + high) * 0.5).as_vec3(),
            half: ((high - low) * 0.5).as_vec3(),
            n: shape.flat_normal(),
            shape,
            set: self.set,
            count,
            seed: self.seed,
            points: Arc::default(),
            both_sides: self.both_sides(),
            physical: self.falloff == Falloff::Physical,
            visible: self.visible,
            blocks: self.blocks,
        };
        // A light that is integrated may never need its samples; a description with faults makes no scene
        if !exact && !cx.has_errors() {
            area.points();
        }
        Light::new(LightKind::Area(area), [scale, whole], self.shadows, exact)
    }
}

/// A compiled area light.
#[derive(Clone, Debug)]
pub struct Area {
    /// Its shape, in world space.
    pub shape: AreaShape,
    /// Whether the side behind, or inside, emits as well.
    pub both_sides: bool,
    /// Whether light weakens with the square of the distance and the cosine at the light.
    pub physical: bool,
    /// Whether the camera sees it.
    pub visible: bool,
    /// Whether it stops the light of others.
    pub blocks: bool,
    /// The middle of the box around it, and half of that box.
    middle: Vec3,
    half: Vec3,
    /// Unit normal of the front, where all of it faces one way.
    pub(super) n: Option<Vec3>,
    set: SampleSet,
    count: u32,
    seed: u32,
    /// The samples, computed at their first use.
    points: Arc<OnceLock<Points>>,
}

/// The shape of an area light. In f64, as it was described.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant, reason = "lights are few, and asked for often")]
pub enum AreaShape {
    /// `[[light.rectangle]]`; a transform can make a parallelogram of it.
    Rectangle(Rectangle),
    /// `[[light.disk]]`
    Disk(DiskLight),
    /// `[[light.sphere]]`
    Sphere(SphereLight),
}

impl AreaShape {
    /// The point that stands for `uv` of the unit square, and, where each point has a normal of its own, the unit
    /// normal there. Equal areas of the square become equal areas of the shape.
    fn point(&self, uv: [f64; 2]) -> (DVec3, Option<DVec3>) {
        match self {
            AreaShape::Rectangle(rectangle) => (rectangle.point(uv), None),
            AreaShape::Disk(disk) => (disk.point(uv), None),
            AreaShape::Sphere(sphere) => {
                let n = SphereLight::normal(uv);
                (sphere.center + n * sphere.radius, Some(n))
            }
        }
    }

    /// Its middle and the unit normal of the front, where all of it faces one way.
    fn front(&self) -> Option<(DVec3, DVec3)> {
        match self {
            AreaShape::Rectangle(rectangle) => Some((rectangle.center, rectangle.n)),
            AreaShape::Disk(disk) => Some((disk.center, disk.n)),
            AreaShape::Sphere(_) => None,
        }
    }

    /// Unit normal of the front, where all of it faces one way.
    pub(crate) fn flat_normal(&self) -> Option<Vec3> {
        self.front().map(|(_, n)| n.as_vec3())
    }

    /// Unit normal of the front at a point of it.
    pub(crate) fn normal_at(&self, p: DVec3) -> Vec3 {
        match self {
            AreaShape::Sphere(sphere) => (p - sphere.center).normalize_or_zero().as_vec3(),
            AreaShape::Rectangle(Rectangle { n, .. }) | AreaShape::Disk(DiskLight { n, .. }) => n.as_vec3(),
        }
    }

    /// Its area, in square metres; of a flat shape, that of one side.
    pub fn measure(&self) -> f64 {
        match self {
            AreaShape::Rectangle(rectangle) => rectangle.e0.cross(rectangle.e1).length(),
            AreaShape::Disk(disk) => PI * disk.radius * disk.radius,
            AreaShape::Sphere(sphere) => 4.0 * PI * sphere.radius * sphere.radius,
        }
    }

    /// The smallest box around it: its least and its greatest corner.
    pub fn bounds(&self) -> [DVec3; 2] {
        match self {
            AreaShape::Rectangle(rectangle) => rectangle.shape.bounds(),
            AreaShape::Disk(disk) => {
                let reach = (disk.a * disk.a + disk.b * disk.b).map(f64::sqrt);
                [disk.center - reach, disk.center + reach]
            }
            AreaShape::Sphere(sphere) => sphere.shape.bounds(),
        }
    }

    /// Two edges of a box around it, and points: the smallest box along the edges that holds the points holds it.
    pub(crate) fn edges_and_corners(&self) -> ([DVec3; 2], Vec<DVec3>) {
        match self {
            AreaShape::Rectangle(rectangle) => {
                let corners = rectangle.shape.corners.map(|corner| corner.as_dvec3());
                let deep = rectangle.shape.deep_corners();
                ([rectangle.e0, rectangle.e1], corners.into_iter().chain(deep).collect())
            }
            AreaShape::Disk(disk) => {
                let (a, b) = (disk.a, disk.b);
                ([a, b], [a + b, a - b, b - a, -a - b].map(|v| disk.center + v).into())
            }
            AreaShape::Sphere(sphere) => {
                let r = DVec3::splat(sphere.radius);
                ([DVec3::X, DVec3::Y].map(|axis| axis * sphere.radius), vec![sphere.center - r, sphere.center + r])
            }
        }
    }

    /// Whether it is a ball.
    pub(crate) fn is_ball(&self) -> bool {
        matches!(self, AreaShape::Sphere(_))
    }

    /// The smallest t > 0 at which a camera ray meets a side that emits.
    #[inline(always)]
    pub(crate) fn intersect(&self, ray: &Ray) -> Option<f64> {
        match self {
            AreaShape::Rectangle(rectangle) => rectangle.shape.intersect(ray),
            AreaShape::Disk(disk) => disk.intersect(ray),
            AreaShape::Sphere(sphere) => sphere.shape.intersect(ray),
        }
    }

    /// On which side of a flat shape all of it lies.
    pub(crate) fn side_of(&self, flat: &Parallelogram) -> PlaneSide {
        match self {
            AreaShape::Rectangle(rectangle) => flat.side_of(&rectangle.shape.corners),
            AreaShape::Disk(disk) => {
                let (a, b) = (flat.n.dot(disk.a), flat.n.dot(disk.b));
                flat.side_of_ball(disk.center, (a * a + b * b).sqrt())
            }
            AreaShape::Sphere(sphere) => flat.side_of_ball(sphere.center, sphere.radius),
        }
    }
}

impl Area {
    /// How many points are sampled, where it is sampled.
    #[inline(always)]
    pub fn samples(&self) -> usize {
        self.count as usize
    }

    /// A point of it and the unit normal of its front, if it is flat and emits to that side alone.
    pub(crate) fn front(&self) -> Option<(DVec3, DVec3)> {
        self.shape.front().filter(|_| !self.both_sides)
    }

    /// The diagonal of the box around it.
    pub(crate) fn diagonal(&self) -> f32 {
        2.0 * self.half.length()
    }

    /// What all of its points together stand for.
    pub(crate) fn stands_for(&self) -> f32 {
        if self.physical { self.shape.measure() as f32 } else { 1.0 }
    }

    /// The mean of the products of coordinates of its points about its center, as its light shows them, in square
    /// metres; and the largest distance of its points from its center, in metres.
    pub(super) fn spread(&self) -> (DMat3, f64) {
        match &self.shape {
            AreaShape::Rectangle(r) => {
                ((products(r.e0) + products(r.e1)) * (1.0 / 12.0), 0.5 * (r.e0.length() + r.e1.length()))
            }
            AreaShape::Disk(disk) => ((products(disk.a) + products(disk.b)) * 0.25, disk.radius),
            // From outside its light is that of a point
            AreaShape::Sphere(sphere) if self.physical => (DMat3::ZERO, sphere.radius),
            AreaShape::Sphere(sphere) => {
                (DMat3::from_diagonal(DVec3::splat(sphere.radius * sphere.radius / 3.0)), sphere.radius)
            }
        }
    }

    /// About the largest weight of all of it from such a distance.
    pub(crate) fn most(&self, distance: f32) -> f32 {
        if self.physical { self.stands_for() / (distance * distance) } else { 1.0 }
    }

    /// The sampled points.
    #[inline(always)]
    pub(crate) fn points(&self) -> &Points {
        let make = || Points::new(&self.shape, (0..self.count).map(|k| self.set.point(k, self.count, self.seed)));
        parallel::kept(&self.points, make)
    }

    /// The points that stand for some places of the unit square, sixteen by sixteen. In lanes where it is called within
    /// `vectorize`.
    #[inline(always)]
    pub(crate) fn points_at(&self, places: impl Iterator<Item = [[f64; LANES]; 2]>) -> Points {
        let mut points = Points { blocks: Vec::with_capacity(places.size_hint().0), normals: Vec::new() };
        for [x, y] in places {
            points.push(&self.shape, &x, &y);
        }
        points
    }

    /// The place of the unit square whose point is nearest to `q`, or thereabouts: where no step leads nearer, from the
    /// nearest of some places all over it. Of a few, as what is round meets itself at borders of the square.
    pub(crate) fn nearest(&self, q: DVec3) -> [f64; 2] {
        const ACROSS: u32 = 8;
        const FIRST: usize = 4;
        let off = |at: [f64; 2]| (self.shape.point(at).0 - q).length_squared();
        let nearer = |(one, _): &(f64, [f64; 2]), (other, _): &(f64, [f64; 2])| one.total_cmp(other);
        let middle = |k: u32| (f64::from(k) + 0.5) / f64::from(ACROSS);
        let places = (0..ACROSS * ACROSS).map(|k| [middle(k % ACROSS), middle(k / ACROSS)]);
        let mut places: Vec<_> = places.map(|at| (off(at), at)).collect();
        places.sort_by(nearer);
        let found = places.into_iter().take(FIRST).map(|(mut least, mut at)| {
            let mut step = 1.0 / f64::from(ACROSS);
            while step > FineCell::SIDE {
                let steps = (0..9).map(|k| [k % 3, k / 3].map(|way| f64::from(way - 1) * step));
                let next = steps.map(|[x, y]| [at[0] + x, at[1] + y].map(|v| v.clamp(0.0, 1.0 - FineCell::SIDE)));
                match next.map(|next| (off(next), next)).min_by(nearer) {
                    Some((off, next)) if off < least => (least, at) = (off, next),
                    _ => step *= 0.5,
                }
            }
            (least, at)
        });
        found.min_by(nearer).map_or([0.5; 2], |(_, at)| at)
    }

    /// Sampled point `k`, world space.
    #[inline(always)]
    pub fn point(&self, k: usize) -> Vec3 {
        self.points().blocks[k / LANES].get(k % LANES)
    }

    /// [`Light::floor`].
    #[inline(always)]
    pub(crate) fn floor(&self, p: Vec3, error: ErrorBound, n: Vec3) -> f32 {
        n.abs().dot(way_error(self.middle, self.half, p, error))
    }

    /// The point that stands for `uv` of the unit square, world space.
    #[cfg(feature = "bench")]
    pub(crate) fn position(&self, uv: [f64; 2]) -> [f64; 3] {
        self.shape.point(uv).0.to_array()
    }

    /// The way from `p` to the point that stands for `uv` of the unit square, one over its length, and
    /// [`weight`](Self::weight) there. Equal areas of the square are equal areas of the light.
    #[cfg(any(test, feature = "bench"))]
    pub(crate) fn at(&self, uv: [f64; 2], p: Vec3) -> (Vec3, f32, f32) {
        let (q, n) = self.shape.point(uv);
        let l = q.as_vec3() - p;
        let inverse_distance = 1.0 / l.length();
        let weight = match self.n.or(n.map(|n| n.as_vec3())) {
            Some(n) if self.physical || !self.both_sides => self.weight_with(n, l, inverse_distance),
            _ => 1.0,
        };
        (l, inverse_distance, weight)
    }

    /// 1 where the light emits towards the surface under `constant`; the cosine at the light over d^2 under `physical`.
    /// `l` points to point `k` of the light.
    #[inline(always)]
    pub(crate) fn weight(&self, k: usize, l: Vec3, inverse_distance: f32) -> f32 {
        if !self.physical && self.both_sides {
            return 1.0;
        }
        self.weight_with(self.n.unwrap_or_else(|| self.points().normals[k / LANES].get(k % LANES)), l, inverse_distance)
    }

    /// The same from a point of normal `n`.
    #[inline(always)]
    fn weight_with(&self, n: Vec3, l: Vec3, inverse_distance: f32) -> f32 {
        let side = -n.dot(l);
        let side = if self.both_sides { side.abs() } else { side };
        if !self.physical {
            return if side > 0.0 { 1.0 } else { 0.0 };
        }
        let cos = side * inverse_distance;
        if cos > 0.0 { cos * (inverse_distance * inverse_distance) } else { 0.0 }
    }

    /// [`weight`](Self::weight) of the sixteen points of a block of `points`: the same bits.
    #[inline(always)]
    pub(crate) fn weight_lanes<S: Simd>(
        &self,
        points: &Points,
        block: usize,
        l: Vec3x16<S>,
        inverse_distance: f32x16<S>,
    ) -> f32x16<S> {
        let simd = inverse_distance.token();
        let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
        if !self.physical && self.both_sides {
            return one;
        }
        let n = match self.n {
            Some(n) => Vec3x16::splat(simd, n),
            None => points.normals[block].lanes(simd),
        };
        let side = -n.dot(l);
        let side = if self.both_sides { side.abs() } else { side };
        if !self.physical {
            return side.simd_gt(zero).select(one, zero);
        }
        let cos = side * inverse_distance;
        cos.simd_gt(zero).select(cos * (inverse_distance * inverse_distance), zero)
    }
}

impl Points {
    /// The points that stand for some of the unit square.
    fn new(shape: &AreaShape, mut places: impl ExactSizeIterator<Item = [f64; 2]>) -> Self {
        let mut points = Points { blocks: Vec::with_capacity(places.len().div_ceil(LANES)), normals: Vec::new() };
        while places.len() > 0 {
            let [mut x, mut y] = [[f64::NAN; LANES]; 2];
            for (lane, place) in places.by_ref().take(LANES).enumerate() {
                [x[lane], y[lane]] = place;
            }
            points.push(shape, &x, &y);
        }
        points
    }

    /// Adds the points that stand for sixteen places of the unit square; none for those that are NaN.
    #[inline(always)]
    fn push(&mut self, shape: &AreaShape, x: &[f64; LANES], y: &[f64; LANES]) {
        match shape {
            AreaShape::Rectangle(rectangle) => self.blocks.push(PointBlock::of(
                #[inline(always)]
                |k| rectangle.point([x[k], y[k]]),
            )),
            AreaShape::Disk(disk) => self.blocks.push(PointBlock::of(
                #[inline(always)]
                |k| disk.point([x[k], y[k]]),
            )),
            AreaShape::Sphere(sphere) => {
                let mut normals = [DVec3::ZERO; LANES];
                for k in 0..LANES {
                    normals[k] = SphereLight::normal([x[k], y[k]]);
                }
                self.normals.push(PointBlock::of(
                    #[inline(always)]
                    |k| normals[k],
                ));
                self.blocks.push(PointBlock::of(
                    #[inline(always)]
                    |k| sphere.center + normals[k] * sphere.radius,
                ));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{DiskLightDesc, RectangleDesc, SphereLightDesc};
    use super::*;

    #[test]
    fn nothing_is_nearer_than_the_nearest_place() {
        let cx = &mut CompileContext::default();
        let lights = [
            RectangleDesc::with_edges([0.3, 1.0, -0.2], [2.0, 0.5, 0.0], [0.0, 0.0, 1.0])
                .compile(cx, SamplesDesc::Exact),
            DiskLightDesc { normal: Some([0.2, -1.0, 0.4]), radius: Some(1.5), ..DiskLightDesc::new([0.3, 1.0, -0.2]) }
                .compile(cx, SamplesDesc::Exact),
            SphereLightDesc::new([0.3, 1.0, -0.2], 1.5).compile(cx, SamplesDesc::Exact),
        ];
        assert_eq!(cx.take_faults(), []);
        let grid = |k: u32| (f64::from(k) + 0.5) / 128.0;
        for (light, seed) in lights.iter().flat_map(|light| (0..200u32).map(move |seed| (light, seed))) {
            let area = light.area().expect("they have one");
            let coordinate =
                |axis: u32| f64::from((3 * seed + axis).wrapping_mul(0x9e37_79b9) >> 8) / f64::from(1 << 22);
            let q = DVec3::from([0, 1, 2].map(coordinate)) - DVec3::splat(2.0);
            let off = |at: [f64; 2]| (area.shape.point(at).0 - q).length();
            let found = off(area.nearest(q));
            let best = (0..128 * 128).map(|k| off([grid(k % 128), grid(k / 128)])).fold(f64::INFINITY, f64::min);
            assert!(found <= best + 1e-6, "{q} of {:?}: {found}, {best}", area.shape);
        }
    }
}
