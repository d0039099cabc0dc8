//! Parallelograms.

use fearless_simd::{f32x16, mask32x16, prelude::*};
use glam::{DAffine3, DVec2};

use super::common::shape_table;
use super::surface::{Footprint, RayDifferential, ShapePoint, UvEdge};
use crate::color::Rgb;
use crate::context::{CompileContext, show};
use crate::math::{DVec3, ErrorBound, Ray, UNIT_ROUNDOFF, Vec2, Vec3, Vec3x16};

shape_table! {
    /// A flat shape with a corner and two edges of any length and angle. The texture coordinate of
    /// `p + u e0 + v e1` is (u, v). The normal is e0 x e1.
    ///
    /// ```toml
    /// [[parallelogram]]
    /// p = [-1, 0, -1]
    /// e0 = [2, 0, 0]
    /// e1 = [0, 0, 2]
    /// flip = true
    /// material = "floor"
    /// ```
    pub struct ParallelogramDesc {
        /// A corner, in metres, world space.
        pub p: [f64; 3],
        /// The first edge from the corner, in metres: the direction of u.
        pub e0: [f64; 3],
        /// The second edge from the corner, in metres: the direction of v. Not parallel to `e0`.
        pub e1: [f64; 3],
        /// Turns the normal around; the texture stays as it is.
        pub flip: bool = false,
    }
}

/// A parallelogram, ready to be hit. In f64, as it was described: shapes that share an edge or a plane still do.
#[derive(Clone, Copy, Debug)]
pub struct Parallelogram {
    /// The corner of u = v = 0.
    pub p: DVec3,
    /// Unit normal of the front.
    pub n: DVec3,
    /// u of a point x of the plane is (x - p) . u_axis.
    pub u_axis: DVec3,
    /// v of a point x of the plane is (x - p) . v_axis.
    pub v_axis: DVec3,
    /// e0 and e1.
    edges: [DVec3; 2],
    /// |e0| + |e1|, along each axis.
    reach: DVec3,
    /// The four corners, around.
    pub corners: [Vec3; 4],
    /// Whether camera rays pass through from behind.
    pub single_sided: bool,
}

/// Edges whose angle has a smaller sine than this have no area.
const MIN_SINE: f64 = 1e-6;

impl ParallelogramDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Parallelogram {
        cx.point("p", self.p);
        let edges_fine = cx.edge("e0", self.e0) & cx.edge("e1", self.e1);
        let (e0, e1) = (DVec3::from(self.e0), DVec3::from(self.e1));
        if edges_fine && !(e0.cross(e1).length() > MIN_SINE * e0.length() * e1.length()) {
            let message =
                format!("{} is parallel to e0 = {}: there is no area between them", show(&self.e1), show(&self.e0));
            cx.error("e1", message, Some("give edges that point in different directions"));
        }
        let sign = if self.flip { -1.0 } else { 1.0 };
        Parallelogram::new(self.p.into(), e0, e1, sign, self.single_sided)
    }
}

impl Parallelogram {
    /// From a corner and two edges; the normal is `sign` e0 x e1.
    pub(crate) fn new(p: DVec3, e0: DVec3, e1: DVec3, sign: f64, single_sided: bool) -> Self {
        // The dual basis: u_axis . e0 = 1, u_axis . e1 = 0, and the other way round
        let cross = e0.cross(e1);
        let area2 = cross.length_squared();
        let corners = [p, p + e0, p + e0 + e1, p + e1].map(|q| q.as_vec3());
        Parallelogram {
            p,
            n: cross.normalize_or_zero() * sign,
            u_axis: e1.cross(cross) / area2,
            v_axis: cross.cross(e0) / area2,
            edges: [e0, e1],
            reach: e0.abs() + e1.abs(),
            corners,
            single_sided,
        }
    }

    /// The most that `d` . x is over it, to within rounding.
    pub(crate) fn support(&self, d: DVec3) -> f64 {
        self.p.dot(d) + self.edges.iter().map(|edge| edge.dot(d).max(0.0)).sum::<f64>()
    }

    /// Where it is and which side is its front, as numbers that are the same for the same place only.
    pub(crate) fn place_bits(&self) -> [[u64; 3]; 4] {
        [self.p, self.n, self.edges[0], self.edges[1]].map(|v| v.to_array().map(f64::to_bits))
    }

    /// How far u or v can be wrong for a ray that starts `from` away from the corner, computed with `roundoff`. Two
    /// shapes that share an edge overlap by this much, so that no ray slips between them.
    #[inline(always)]
    fn slack(&self, from: DVec3, axis: DVec3, roundoff: f64) -> f64 {
        (from.abs() + self.reach).dot(axis.abs()) * (8.0 * roundoff)
    }

    /// The t > 0 at which the ray meets the parallelogram, if it does. In f64: what is first on a ray is not left to
    /// rounding where walls meet.
    #[inline(always)]
    pub(crate) fn intersect(&self, ray: &Ray) -> Option<f64> {
        let (from, d) = (ray.o.as_dvec3() - self.p, ray.d.as_dvec3());
        let cos = self.n.dot(d);
        if self.single_sided && cos >= 0.0 {
            return None;
        }
        let t = -self.n.dot(from) / cos;
        if !(t > 0.0 && t < f64::INFINITY) {
            return None;
        }
        let hit = from + d * t;
        let inside = |axis: DVec3| {
            let (w, slack) = (hit.dot(axis), self.slack(from, axis, f64::EPSILON));
            w >= -slack && w <= 1.0 + slack
        };
        (inside(self.u_axis) && inside(self.v_axis)).then_some(t)
    }

    /// The t at which the line from `o` along `d` meets its plane.
    pub(crate) fn crossing(&self, o: DVec3, d: DVec3) -> f64 {
        -self.n.dot(o - self.p) / self.n.dot(d)
    }

    /// Where `ray` meets it at `t`, how sure that is, and the normal there.
    #[inline(always)]
    pub(crate) fn place(&self, ray: &Ray, t: f64) -> (Vec3, ErrorBound, Vec3) {
        let (o, way) = (ray.o.as_dvec3(), ray.d.as_dvec3() * t);
        let p = (o + way).as_vec3();
        (p, ErrorBound::of_rounded(p, o.abs() + way.abs() + self.p.abs()), self.n.as_vec3())
    }

    /// The same of the point of its plane that is nearest to `q`.
    pub(crate) fn nearest_place(&self, q: DVec3) -> (Vec3, ErrorBound, Vec3) {
        let p = (q - self.n * self.n.dot(q - self.p)).as_vec3();
        (p, ErrorBound::of_rounded(p, q.abs() + self.p.abs()), self.n.as_vec3())
    }

    /// The point that `ray` meets at `t`, with its texture coordinate and the footprint of the ray.
    #[inline(always)]
    pub(crate) fn point(&self, ray: &Ray, t: f64, differential: &RayDifferential) -> ShapePoint {
        let (p, error, n) = self.place(ray, t);
        let hit = ray.o.as_dvec3() - self.p + ray.d.as_dvec3() * t;
        let uv = DVec2::new(hit.dot(self.u_axis), hit.dot(self.v_axis)).clamp(DVec2::ZERO, DVec2::ONE);
        let (u_axis, v_axis) = (self.u_axis.as_vec3(), self.v_axis.as_vec3());
        let steps = differential.on_plane(ray.d, t as f32, n, f32::MAX.sqrt() * 0.5);
        let [dx, dy] = steps.map(|dp| Vec2::new(dp.dot(u_axis), dp.dot(v_axis)));
        ShapePoint {
            p,
            error,
            normal: n,
            shading: n,
            lifted: None,
            uv: uv.as_vec2(),
            footprint: Footprint { dx, dy, edges: [UvEdge::Bounded; 2] },
            color: Rgb::WHITE,
            alpha: 1.0,
        }
    }

    /// How a point moves with u and with v: the edges.
    pub(crate) fn tangents(&self) -> [DVec3; 2] {
        self.edges
    }

    /// The four corners, around, in f64.
    #[inline(always)]
    pub(crate) fn deep_corners(&self) -> [DVec3; 4] {
        let [e0, e1] = self.edges;
        [self.p, self.p + e0, self.p + e0 + e1, self.p + e1]
    }

    /// How far outside of the edges a point of the plane is, in metres, or less; below 0 inside.
    pub(crate) fn outside(&self, q: DVec3) -> f64 {
        let from = q - self.p;
        let outside = |axis: DVec3| {
            let w = from.dot(axis);
            (-w).max(w - 1.0) / axis.length()
        };
        outside(self.u_axis).max(outside(self.v_axis))
    }

    /// At most how near it is to a point: exactly, where its edges are perpendicular.
    pub(crate) fn distance(&self, q: DVec3) -> f64 {
        let from = q - self.p;
        let height = self.n.dot(from).abs();
        let aside = self.outside(q).max(0.0);
        (height * height + aside * aside).sqrt()
    }

    /// The smallest box around it.
    pub(crate) fn bounds(&self) -> [DVec3; 2] {
        let [e0, e1] = self.edges;
        let low = e0.min(DVec3::ZERO) + e1.min(DVec3::ZERO);
        let high = e0.max(DVec3::ZERO) + e1.max(DVec3::ZERO);
        [self.p + low, self.p + high]
    }

    /// Moved. The front stays the front, mirrored or not.
    pub(crate) fn moved(&self, world: &DAffine3) -> Self {
        if *world == DAffine3::IDENTITY {
            return *self;
        }
        let [e0, e1] = self.edges;
        let sign = (self.n.dot(e0.cross(e1)) * world.matrix3.determinant()).signum();
        let p = world.transform_point3(self.p);
        Self::new(p, world.matrix3 * e0, world.matrix3 * e1, sign, self.single_sided)
    }

    /// Where the hull of `points` lies. In f64, where the rounding is far below what [`ParallelogramShadow::blocks`]
    /// allows itself, so that the answer is a proof for every point of the hull.
    pub(crate) fn side_of(&self, points: &[Vec3]) -> PlaneSide {
        let heights = points.iter().map(|q| self.n.dot(q.as_dvec3() - self.p));
        if heights.clone().all(|s| s >= 0.0) {
            PlaneSide::Front
        } else if heights.clone().all(|s| s <= 0.0) {
            PlaneSide::Back
        } else {
            PlaneSide::Both
        }
    }

    /// Where a ball lies, or what reaches as far as one along the normal.
    pub(crate) fn side_of_ball(&self, center: DVec3, radius: f64) -> PlaneSide {
        let height = self.n.dot(center - self.p);
        if height >= radius {
            PlaneSide::Front
        } else if height <= -radius {
            PlaneSide::Back
        } else {
            PlaneSide::Both
        }
    }

    /// [`ParallelogramShadow::is_one_sided`] for a point, at a smaller price.
    #[inline(always)]
    pub(crate) fn is_one_sided(&self, p: Vec3, error: ErrorBound, light: PlaneSide) -> bool {
        let s = self.n.dot(p.as_dvec3() - self.p);
        let margin = self.n.as_vec3().abs().dot(error.0);
        s.abs() as f32 <= margin
            || match light {
                PlaneSide::Front => s >= 0.0,
                PlaneSide::Back => s < 0.0,
                PlaneSide::Both => false,
            }
    }

    /// Whether its plane may cut the patch that reaches `reach` around a point, which is not on it.
    #[inline(always)]
    pub(crate) fn plane_cuts(&self, p: Vec3, error: ErrorBound, reach: f32) -> bool {
        let height = self.n.dot(p.as_dvec3() - self.p).abs() as f32;
        height <= reach && height > self.n.as_vec3().abs().dot(error.0)
    }

    /// Whether a viewer in the direction `wo` of a point that lies before it, nearly on its plane, sees nothing behind
    /// it within `reach` of the point.
    pub(crate) fn screens(&self, p: Vec3, wo: Vec3, reach: f32, light: PlaneSide) -> bool {
        let cos = match light {
            PlaneSide::Front => self.n.as_vec3().dot(wo),
            PlaneSide::Back => -self.n.as_vec3().dot(wo),
            PlaneSide::Both => return false,
        };
        // What is within reach behind it is seen through it no farther off than that
        let room = 2.0 * reach * (1.0 + 1.0 / cos);
        cos > 0.0 && !self.single_sided && self.outside(p.as_dvec3()) < -f64::from(room)
    }

    /// What this parallelogram needs to know of a point that asks for light.
    #[inline(always)]
    pub(crate) fn shadow(&self, p: Vec3, error: ErrorBound) -> ParallelogramShadow {
        // In f64, so that the side the point is on is wrong by the point's own rounding only
        let from = p.as_dvec3() - self.p;
        let s = self.n.dot(from);
        let n = if s < 0.0 { -self.n } else { self.n }.as_vec3();
        let axis = |axis: DVec3| Axis::new(from, axis, self.slack(from, axis, UNIT_ROUNDOFF as f64));
        ParallelogramShadow {
            n,
            front: s >= 0.0,
            height: s.abs() as f32,
            margin: n.abs().dot(error.0),
            abs_n: n.abs() * (10.0 * UNIT_ROUNDOFF),
            u: axis(self.u_axis),
            v: axis(self.v_axis),
        }
    }
}

/// Where a light lies, seen from the plane of a parallelogram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PlaneSide {
    /// All of it in front, or in the plane.
    Front,
    /// All of it behind, or in the plane.
    Back,
    /// On both sides, or not known.
    Both,
}

/// A parallelogram as an obstacle to light, seen from one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ParallelogramShadow {
    /// The normal on the point's side.
    n: Vec3,
    /// Whether the point is in front.
    front: bool,
    /// How far the point is from the plane, 0 or more.
    height: f32,
    /// How far `height` can be wrong.
    margin: f32,
    /// How far n.l can be wrong, for each length along an axis: the rounding of n, of l, of the end of l, of the
    /// products and of their sum.
    abs_n: Vec3,
    u: Axis,
    v: Axis,
}

/// One texture coordinate, as the sides of the parallelogram need it.
#[derive(Clone, Copy, Debug)]
struct Axis {
    axis: Vec3,
    /// The coordinate of the point below.
    origin: f32,
    /// From where to where a hit counts.
    low: f32,
    high: f32,
}

impl Axis {
    #[inline(always)]
    fn new(from: DVec3, axis: DVec3, slack: f64) -> Self {
        Axis { axis: axis.as_vec3(), origin: from.dot(axis) as f32, low: -slack as f32, high: (1.0 + slack) as f32 }
    }

    /// Whether the coordinate where the plane is crossed lies on the shape. It is origin + (l.axis) height / descent:
    /// everything times `descent`, there is no division.
    #[inline(always)]
    fn contains(&self, l: Vec3, height: f32, descent: f32) -> bool {
        let w = self.origin * descent + l.dot(self.axis) * height;
        w >= self.low * descent && w <= self.high * descent
    }

    #[inline(always)]
    fn contains_lanes<S: Simd>(&self, l: Vec3x16<S>, height: f32, descent: f32x16<S>) -> mask32x16<S> {
        let axis = Vec3x16::splat(descent.token(), self.axis);
        let w = descent * self.origin + l.dot(axis) * height;
        w.simd_ge(descent * self.low) & w.simd_le(descent * self.high)
    }
}

impl ParallelogramShadow {
    /// Whether nothing can be blocked: the point lies on the plane, or point and light are on one side of it.
    #[inline(always)]
    pub fn is_one_sided(&self, light: PlaneSide) -> bool {
        self.height <= self.margin
            || match light {
                PlaneSide::Front => self.front,
                PlaneSide::Back => !self.front,
                PlaneSide::Both => false,
            }
    }

    /// What has to be above 0 for a way l to be blocked, each as f.l - c, and how far that can be wrong for ways with
    /// coordinates up to `longest`: the way crosses the plane, and does it between the four sides. What makes
    /// [`blocks`](Self::blocks) ask for more counts as wrong.
    pub(super) fn bounds(&self, longest: f32, finite: bool) -> [(Vec3, f32, f32); 5] {
        const DOT: f32 = 32.0 * UNIT_ROUNDOFF;
        let one = |v: Vec3| v.abs().element_sum();
        let n = one(self.n);
        let crosses = if finite {
            let room = one(self.abs_n) * longest + self.margin + (n * longest + self.height) * DOT;
            (-self.n, self.height, room)
        } else {
            (-self.n, 0.0, n * longest * DOT)
        };
        // A point on the plane is blocked from nothing
        let crosses = if self.height > self.margin { crosses } else { (Vec3::ZERO, f32::INFINITY, 0.0) };
        let side = |axis: &Axis, end: f32, sign: f32| {
            let f = (axis.axis * self.height - self.n * (axis.origin - end)) * sign;
            let size = n * (axis.origin.abs() + end.abs()) + one(axis.axis) * self.height;
            (f, 0.0, size * longest * DOT)
        };
        let (u, v) = (&self.u, &self.v);
        [crosses, side(u, u.low, 1.0), side(u, u.high, -1.0), side(v, v.low, 1.0), side(v, v.high, -1.0)]
    }

    /// Whether the parallelogram stands between the point and the end of `l` (finite), or anywhere along it (not
    /// finite). Point and end have to be on different sides of the plane, by more than their errors.
    #[inline(always)]
    pub fn blocks(&self, l: Vec3, finite: bool) -> bool {
        let descent = -self.n.dot(l);
        let beyond = descent - self.height;
        let crosses = if finite { beyond > self.margin + self.abs_n.dot(l.abs()) } else { descent > 0.0 };
        self.height > self.margin
            && crosses
            && self.u.contains(l, self.height, descent)
            && self.v.contains(l, self.height, descent)
    }

    /// [`blocks`](Self::blocks) for sixteen finite `l`: the same answers.
    #[inline(always)]
    pub fn blocks_lanes<S: Simd>(&self, l: Vec3x16<S>) -> mask32x16<S> {
        let simd = l.x.token();
        if !(self.height > self.margin) {
            return simd.splat_mask32x16(false);
        }
        let descent = -Vec3x16::splat(simd, self.n).dot(l);
        let beyond = descent - self.height;
        let wrong = l.abs().dot(Vec3x16::splat(simd, self.abs_n));
        let crosses = beyond.simd_gt(simd.splat_f32x16(self.margin) + wrong);
        crosses & self.u.contains_lanes(l, self.height, descent) & self.v.contains_lanes(l, self.height, descent)
    }
}
