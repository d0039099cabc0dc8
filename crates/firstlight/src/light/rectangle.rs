//! Rectangle lights.

use fearless_simd::{f32x16, prelude::*};

use super::{EmitSides, Falloff, Light, LightKind, SampleSet, scaled};
use crate::color::Rgb;
use crate::context::{CompileContext, show};
use crate::describe::{ColorDesc, table};
use crate::math::{DVec3, LANES, Vec3, Vec3x16};
use crate::shape::Parallelogram;
use crate::transform::TransformDesc;

table! {
    /// A rectangle that shines: soft shadows.
    ///
    /// Physical: every point sends the radiance L = color x strength to its emitting side;
    /// E = integral of L cos cos' / d^2 dA. Constant: the mean over the area of color x strength.
    ///
    /// ```toml
    /// [[light.rectangle]]
    /// center = [0, 5.9, -6]
    /// e0 = [2, 0, 0]
    /// e1 = [0, 0, 2]
    /// falloff = "constant"
    /// ```
    pub struct RectangleDesc {
        /// What reports and id files call it.
        pub name: Option<String> = None,
        /// The middle, in metres, world space.
        pub center: [f64; 3],
        /// One side, full length, in metres.
        pub e0: [f64; 3],
        /// The other side, full length, in metres; perpendicular to `e0`. The front is where e0 x e1 points.
        pub e1: [f64; 3],
        /// Where it is moved; it moves `center` and both sides, which may make a parallelogram of it. Mirrored, it keeps its
        /// front.
        pub transform: Option<Box<TransformDesc>> = None,
        /// Linear colour; channels of 0 or more.
        pub color: ColorDesc = ColorDesc::WHITE,
        /// Radiance (physical), or a plain factor (constant); 0 to 1e15.
        pub strength: f64 = 1.0,
        /// How light weakens on its way.
        pub falloff: Falloff = Falloff::Physical,
        /// The sides that emit; without it, `front` under `physical` and `both` under `constant`.
        pub sides: Option<EmitSides> = None,
        /// Whether the camera sees it, as its colour.
        pub visible: bool = true,
        /// Whether it stops the light of others.
        pub blocks: bool = false,
        /// Whether its light can be blocked.
        pub shadows: bool = true,
        /// How many points of it are sampled, 1 to 1048576; without it, `render.samples`.
        pub samples: Option<u32> = None,
        /// How those points are laid out.
        pub set: SampleSet = SampleSet::Sobol,
        /// The seed of the sets `uniform` and `stratified`.
        pub seed: u32 = 0,
    }
}

/// A rectangle light, ready to shine.
#[derive(Clone, Debug)]
pub struct Rectangle {
    /// What the camera sees, and what stands in the way of other lights if it blocks.
    pub shape: Parallelogram,
    /// Unit normal of the front.
    pub n: Vec3,
    /// The sampled points.
    points: PointBlocks,
    /// Whether the side behind emits as well.
    pub both_sides: bool,
    /// Whether light weakens with the square of the distance and the cosine at the light.
    pub physical: bool,
    /// Whether the camera sees it.
    pub visible: bool,
    /// Whether it stops the light of others.
    pub blocks: bool,
}

/// Sides that are farther from a right angle than this sine are not those of a rectangle.
const MAX_SKEW: f64 = 1e-5;

/// Sides that a transform leaves at an angle of a smaller sine than this have no area.
const MIN_SINE: f64 = 1e-6;

/// The largest number of points on one light.
pub(crate) const MAX_SAMPLES: u32 = 1 << 20;

impl RectangleDesc {
    /// `samples` is the scene's default number of points.
    pub(crate) fn compile(&self, cx: &mut CompileContext, samples: u32) -> Light {
        cx.point("center", self.center);
        let mut center = DVec3::from(self.center);
        let (mut e0, mut e1) = (DVec3::from(self.e0), DVec3::from(self.e1));
        let edges_fine = cx.edge("e0", self.e0) & cx.edge("e1", self.e1);
        if edges_fine && !(e0.dot(e1).abs() <= MAX_SKEW * e0.length() * e1.length()) {
            let message = format!("{} is not perpendicular to e0 = {}", show(&self.e1), show(&self.e0));
            cx.error("e1", message, Some("the sides of a rectangle meet at right angles"));
        }
        let mut front = 1.0;
        if let Some(world_from_object) = TransformDesc::compile_field(self.transform.as_deref(), cx) {
            center = cx.moved_point(world_from_object, center);
            e0 = cx.moved_edge(world_from_object, "e0", e0);
            e1 = cx.moved_edge(world_from_object, "e1", e1);
            front = world_from_object.matrix3.determinant().signum();
            if edges_fine && !(e0.cross(e1).length() > MIN_SINE * e0.length() * e1.length()) {
                let (e0, e1) = (show(&e0.to_array()), show(&e1.to_array()));
                let message = format!("it makes {e0} of e0 and {e1} of e1: there is no area between them");
                cx.error("transform", message, Some("choose another transform"));
            }
        }
        let count = match self.samples {
            Some(own) => cx.count("samples", own, 1, MAX_SAMPLES, Some("points on this light")),
            None => samples,
        };
        if let Err(hint) = self.set.allows(count) {
            let field = if self.samples.is_some() { "samples" } else { "set" };
            let message = format!("{count} points cannot be laid out as \"{}\"", self.set.name());
            cx.error(field, message, Some(&hint));
        }
        let both_sides = match (self.sides, self.falloff) {
            (Some(sides), _) => sides == EmitSides::Both,
            (None, falloff) => falloff == Falloff::Constant,
        };
        let corner = center - (e0 + e1) * 0.5;
        let shape = Parallelogram::new(corner, e0, e1, front, !both_sides);
        // A description with faults makes no scene: spare the work
        let made = if cx.has_errors() { 0 } else { count };
        let points = (0..made).map(|k| {
            let [a, b] = self.set.point(k, count, self.seed);
            (corner + e0 * a + e1 * b).as_vec3()
        });
        // Physical: each point stands for its share of the area
        let area = match self.falloff {
            Falloff::Physical => e0.cross(e1).length(),
            Falloff::Constant => 1.0,
        };
        Light {
            kind: LightKind::Rectangle(Rectangle {
                points: PointBlocks::new(points),
                n: shape.n.as_vec3(),
                shape,
                both_sides,
                physical: self.falloff == Falloff::Physical,
                visible: self.visible,
                blocks: self.blocks,
            }),
            scale: scaled(cx, self.color, self.strength, self.falloff.factor() * area / count.max(1) as f64),
            radiance: Rgb::from(self.color) * self.strength as f32,
            shadows: self.shadows,
        }
    }
}

impl Rectangle {
    /// How many points are sampled.
    #[inline(always)]
    pub fn samples(&self) -> usize {
        self.points.len
    }

    /// Sampled point `k`, world space.
    #[inline(always)]
    pub fn point(&self, k: usize) -> Vec3 {
        let block = &self.points.blocks[k / LANES];
        let lane = k % LANES;
        Vec3::new(block.x[lane], block.y[lane], block.z[lane])
    }

    /// The sampled points, sixteen at a time.
    #[inline(always)]
    pub(crate) fn blocks(&self) -> &[PointBlock] {
        &self.points.blocks
    }

    /// 1 where the light emits towards the surface under `constant`; the cosine at the light over d^2 under `physical`.
    /// `l` points to the light.
    #[inline(always)]
    pub(crate) fn weight(&self, l: Vec3, inverse_distance: f32) -> f32 {
        let side = -self.n.dot(l);
        let side = if self.both_sides { side.abs() } else { side };
        if !self.physical {
            return if self.both_sides || side > 0.0 { 1.0 } else { 0.0 };
        }
        let cos = side * inverse_distance;
        if cos > 0.0 { cos * (inverse_distance * inverse_distance) } else { 0.0 }
    }

    /// [`weight`](Self::weight) in sixteen lanes: the same bits.
    #[inline(always)]
    pub(crate) fn weight_lanes<S: Simd>(&self, l: Vec3x16<S>, inverse_distance: f32x16<S>) -> f32x16<S> {
        let simd = inverse_distance.token();
        let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
        if !self.physical && self.both_sides {
            return one;
        }
        let side = -Vec3x16::splat(simd, self.n).dot(l);
        let side = if self.both_sides { side.abs() } else { side };
        if !self.physical {
            return side.simd_gt(zero).select(one, zero);
        }
        let cos = side * inverse_distance;
        cos.simd_gt(zero).select(cos * (inverse_distance * inverse_distance), zero)
    }
}

/// Points in blocks of sixteen, coordinate by coordinate, as lanes want them.
#[derive(Clone, Debug)]
pub(crate) struct PointBlocks {
    len: usize,
    blocks: Vec<PointBlock>,
}

/// Sixteen points. Where there is none, every coordinate is NaN: it is above no horizon and sends no light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointBlock {
    pub x: [f32; LANES],
    pub y: [f32; LANES],
    pub z: [f32; LANES],
}

impl PointBlocks {
    fn new(points: impl ExactSizeIterator<Item = Vec3>) -> Self {
        let len = points.len();
        let empty = PointBlock { x: [f32::NAN; LANES], y: [f32::NAN; LANES], z: [f32::NAN; LANES] };
        let mut blocks = vec![empty; len.div_ceil(LANES)];
        for (k, q) in points.enumerate() {
            let (block, lane) = (&mut blocks[k / LANES], k % LANES);
            (block.x[lane], block.y[lane], block.z[lane]) = (q.x, q.y, q.z);
        }
        PointBlocks { len, blocks }
    }
}
