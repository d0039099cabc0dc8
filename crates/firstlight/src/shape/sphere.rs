//! Spheres.

use std::f32::consts::FRAC_1_PI;

use fearless_simd::{f32x16, mask32x16, prelude::*};
use glam::{DAffine3, DMat3};
use pxfm::f_atan2f;

use super::ball::{Ball, ball_tangents};
use super::common::shape_table;
use super::surface::{Footprint, RayDifferential, ShapePoint, UvEdge};
use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::words;
use crate::math::{DRay, DVec3, ErrorBound, Ray, UNIT_ROUNDOFF, Vec2, Vec3, Vec3x16};

words! {
    /// How a point of a sphere becomes a texture coordinate. `n` is the outward unit normal at the point.
    pub enum SphereUv {
        /// u = 1/2 + atan2(-n.z, n.x) / 2 pi, v = 1/2 + asin(n.y) / pi: a world map, not mirrored seen from outside.
        Equirectangular = "equirectangular",
        /// u = angle(n, +x) / pi, v = angle(n, +y) / pi: v runs downwards, front and back mirror each other.
        Angles = "angles",
    }
}

shape_table! {
    /// A sphere, seen from outside and from inside.
    ///
    /// ```toml
    /// [[sphere]]
    /// center = [0, 1, 0]
    /// radius = 1
    /// material = "red"
    /// ```
    pub struct SphereDesc {
        /// Centre, in metres, world space; coordinates from -2.5e8 to 2.5e8, as everywhere.
        pub center: [f64; 3],
        /// Radius in metres, 1e-9 to 2.5e8.
        pub radius: f64,
        /// How a point becomes a texture coordinate.
        pub uv: SphereUv = SphereUv::Equirectangular,
    }
}

/// A sphere, ready to be hit.
#[derive(Clone, Copy, Debug)]
pub struct Sphere {
    /// Centre.
    pub c: DVec3,
    /// Radius, greater than 0.
    pub r: f64,
    /// How a point becomes a texture coordinate.
    pub uv: SphereUv,
    /// Whether camera rays pass through its inside.
    pub single_sided: bool,
}

impl SphereDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Sphere {
        cx.point("center", self.center);
        let r = cx.positive("radius", self.radius, "the radius is in metres");
        Sphere { c: self.center.into(), r, uv: self.uv, single_sided: self.single_sided }
    }
}

impl Sphere {
    /// The smallest t > 0 at which the ray meets the sphere, if it does.
    ///
    /// Nearest root of |o + t d - c|^2 = r^2 without cancellation: the distance from the centre to the ray is compared
    /// with r, and the smaller root comes from the product of both. In f64: what is first on a ray is not left to
    /// rounding, and the eye may be a metre above a planet.
    /// Source: Haines, Gunther, Akenine-Moller, "Precision improvements for ray/sphere intersection", Ray Tracing Gems,
    /// chapter 7, 2019.
    #[inline(always)]
    pub(crate) fn intersect(&self, ray: &Ray) -> Option<f64> {
        let (f, d) = (ray.o.as_dvec3() - self.c, ray.d.as_dvec3());
        let b = -f.dot(d);
        let nearest = f + d * b;
        let discriminant = self.r * self.r - nearest.dot(nearest);
        if !(discriminant >= 0.0) {
            return None;
        }
        let root = discriminant.sqrt();
        let product = f.dot(f) - self.r * self.r;
        let q = if b > 0.0 { b + root } else { b - root };
        let (enter, leave) = if b > 0.0 { (product / q, q) } else { (q, product / q) };
        if enter > 0.0 {
            Some(enter)
        } else if leave > 0.0 && !self.single_sided {
            Some(leave)
        } else {
            None
        }
    }

    /// Both places at which a ray meets the sphere, `t_min` < t < `t_max`, the nearer one first; only where it enters,
    /// if that is all that the camera sees.
    pub(crate) fn crossings(&self, ray: &DRay, [t_min, t_max]: [f64; 2], single_sided: bool) -> [Option<f64>; 2] {
        let (f, d) = (ray.o - self.c, ray.d);
        let dd = d.length_squared();
        let b = -f.dot(d);
        let nearest = f + d * (b / dd);
        let discriminant = self.r * self.r - nearest.dot(nearest);
        if !(discriminant >= 0.0) {
            return [None; 2];
        }
        let root = (discriminant * dd).sqrt();
        let product = f.dot(f) - self.r * self.r;
        let q = if b > 0.0 { b + root } else { b - root };
        let (one, other) = (product / q, q / dd);
        let (enter, leave) = if b > 0.0 { (one, other) } else { (other, one) };
        let within = |t: f64| (t > t_min && t < t_max).then_some(t);
        [within(enter), if single_sided { None } else { within(leave) }]
    }

    /// Where `ray` meets the sphere at `t`, how sure that is, and the normal there.
    #[inline(always)]
    pub(crate) fn place(&self, ray: &Ray, t: f64) -> (Vec3, ErrorBound, Vec3) {
        // From the centre outwards: the point lies on the sphere however far away the camera is
        let outwards = (ray.o.as_dvec3() - self.c + ray.d.as_dvec3() * t).normalize_or(DVec3::Y);
        let p = (self.c + outwards * self.r).as_vec3();
        (p, ErrorBound::of_rounded(p, self.c.abs() + DVec3::splat(self.r)), outwards.as_vec3())
    }

    /// The same of the point of the sphere that is nearest to `q`.
    pub(crate) fn nearest_place(&self, q: DVec3) -> (Vec3, ErrorBound, Vec3) {
        let outwards = (q - self.c).normalize_or(DVec3::Y);
        let p = (self.c + outwards * self.r).as_vec3();
        (p, ErrorBound::of_rounded(p, self.c.abs() + DVec3::splat(self.r)), outwards.as_vec3())
    }

    /// The point of the sphere that `ray` meets at `t`, with its texture coordinate and the footprint of the ray.
    #[inline(always)]
    pub(crate) fn point(&self, ray: &Ray, t: f64, differential: &RayDifferential) -> ShapePoint {
        let (p, error, n) = self.place(ray, t);
        let r = self.r as f32;
        let [dpx, dpy] = differential.on_plane(ray.d, t as f32, n, r);
        let (uv, dx, dy) = match self.uv {
            SphereUv::Equirectangular => equirectangular(n, dpx / r, dpy / r),
            SphereUv::Angles => angles(n, dpx / r, dpy / r),
        };
        let edges = match self.uv {
            SphereUv::Equirectangular => [UvEdge::Periodic, UvEdge::Folded],
            SphereUv::Angles => [UvEdge::Folded, UvEdge::Folded],
        };
        let footprint = Footprint { dx, dy, edges };
        ShapePoint { p, error, normal: n, shading: n, lifted: None, uv, footprint, color: Rgb::WHITE, alpha: 1.0 }
    }

    /// How the point that `ray` meets at `t` moves with u and with v.
    pub(crate) fn tangents(&self, ray: &Ray, t: f64) -> [DVec3; 2] {
        let outwards = (ray.o.as_dvec3() - self.c + ray.d.as_dvec3() * t).normalize_or(DVec3::Y);
        ball_tangents(self.uv, outwards).map(|d| d * self.r)
    }

    /// How the unit normal changes from the point that `ray` meets at `t` with each step.
    pub(crate) fn normal_steps(&self, ray: &Ray, t: f64, differential: &RayDifferential) -> [Vec3; 2] {
        let (_, _, n) = self.place(ray, t);
        let r = self.r as f32;
        differential.on_plane(ray.d, t as f32, n, r).map(|dp| dp / r)
    }

    /// Where it is, as numbers that are the same for the same place only.
    pub(crate) fn place_bits(&self) -> [u64; 4] {
        let [x, y, z] = self.c.to_array();
        [x, y, z, self.r].map(f64::to_bits)
    }

    /// The smallest box around it.
    pub(crate) fn bounds(&self) -> [DVec3; 2] {
        [self.c - self.r, self.c + self.r]
    }

    /// Moved and scaled; `None` where it is turned, which turns its texture, or is no sphere any more.
    pub(crate) fn moved(&self, world: &DAffine3) -> Option<Self> {
        let m = &world.matrix3;
        let scale = m.x_axis.x;
        let same = scale > 0.0 && *m == DMat3::from_diagonal(DVec3::splat(scale));
        same.then(|| Sphere { c: world.transform_point3(self.c), r: self.r * scale, ..*self })
    }

    /// The ball of radius 1 that [`world_from_ball`](Self::world_from_ball) makes this sphere of.
    pub(crate) fn ball(&self) -> Ball {
        Ball { uv: self.uv }
    }

    /// From the space of [`ball`](Self::ball).
    pub(crate) fn world_from_ball(&self) -> DAffine3 {
        DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(self.r)), translation: self.c }
    }

    /// What this sphere needs to know of a point that asks for light.
    #[inline(always)]
    pub(crate) fn shadow(&self, p: Vec3, error: ErrorBound) -> SphereShadow {
        // In f64, so that the side the point is on is wrong by the point's own rounding only
        let f = p.as_dvec3() - self.c;
        let (ff, r2) = (f.dot(f), self.r * self.r);
        let cc = ff - r2;
        let margin = 2.0 * f.abs().dot(error.0.as_dvec3());
        let side = if cc > margin {
            if ff > FAR * r2 { Side::Far } else { Side::Outside }
        } else if cc < -margin {
            Side::Inside
        } else {
            Side::On
        };
        let cc = if side == Side::Far { r2 - f64::from(FAR_END_SLACK) * self.r * ff.sqrt() } else { cc };
        let f = f.as_vec3();
        let df = error.0 + f.abs() * (16.0 * UNIT_ROUNDOFF);
        SphereShadow { f, cc: cc as f32, r2: r2 as f32, ff: ff as f32, df, side }
    }
}

/// Beyond this many squared radii, b^2 - a (|f|^2 - r^2) has lost too many digits.
const FAR: f64 = 256.0;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    /// The point is inside: what ends outside is blocked.
    Inside,
    /// The point is on the sphere: only the far side can block.
    On,
    /// The point is outside.
    Outside,
    /// The point is outside, and many radii away.
    Far,
}

/// A sphere as an obstacle to light, seen from one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphereShadow {
    /// From the centre to the point.
    f: Vec3,
    /// |f|^2 - r^2. From far away: what |q - c|^2 is below where the end q of a shadow ray is inside for sure, a little
    /// less than r^2.
    cc: f32,
    r2: f32,
    ff: f32,
    /// How far `f` can be wrong: the rounding of the point and its own, and that of its product with `l`.
    df: Vec3,
    side: Side,
}

impl SphereShadow {
    /// Whether the point lies on the sphere.
    #[inline(always)]
    pub fn is_on(&self) -> bool {
        self.side == Side::On
    }

    /// Whether the sphere cannot hide any light that arrives on the side `n` (unit) of the point: because the point
    /// lies on its outside, and it is convex; or because all of it is below the point's horizon, by more than the
    /// rounding of [`blocks`](Self::blocks), which is below 2e-4 r near the sphere and below 1e-6 |f| far from it.
    #[inline(always)]
    pub fn is_below(&self, n: Vec3) -> bool {
        if self.side == Side::On {
            // `n` is the outward normal, to within what `blocks` allows `f` to be wrong
            return (self.f - n * self.ff.sqrt()).abs().cmple(self.df * 0.25).all();
        }
        let height = self.f.dot(n);
        let r = self.r2.sqrt();
        height > r + (r * 4e-4 + self.ff.sqrt() * 1e-5)
    }

    /// From the centre to the point, and the radius, if the point is outside.
    pub(super) fn outside(&self) -> Option<(Vec3, f32)> {
        matches!(self.side, Side::Outside | Side::Far).then(|| (self.f, self.r2.sqrt()))
    }

    /// Whether the sphere stands between the point and the end of `l` (finite), or anywhere along it (not finite).
    ///
    /// With a = l.l and b = -f.l, the line comes nearest to the centre at t = b/a and meets the sphere where
    /// a t^2 - 2 b t + cc = 0. From outside, the nearer root is below 1 if the end is inside, or if 0 < b < a.
    ///
    /// From many radii away nothing is left of that: there the end is l + f, axis by axis, which is wrong by the
    /// rounding of the two alone.
    #[inline(always)]
    pub fn blocks(&self, l: Vec3, finite: bool) -> bool {
        let a = l.dot(l);
        let b = -self.f.dot(l);
        if self.side == Side::Far {
            // a r^2 - |l x f|^2 does not cancel
            let (cross, end) = (l.cross(self.f), l + self.f);
            let discriminant = a * self.r2 - cross.dot(cross);
            return (discriminant >= 0.0 && b > 0.0 && (!finite || b < a)) || (finite && end.dot(end) < self.cc);
        }
        // |q - c|^2 - r^2 at the end q of l, and how far it can be wrong
        let end = (a - (b + b)) + self.cc;
        let slack = (a + self.ff) * END_SLACK;
        match self.side {
            Side::Inside => !finite || end > slack,
            Side::On => b > l.abs().dot(self.df) && (!finite || end > slack),
            Side::Outside | Side::Far => {
                let discriminant = b * b - a * self.cc;
                (discriminant >= 0.0 && b > 0.0 && (!finite || b < a)) || (finite && end < -slack)
            }
        }
    }

    /// [`blocks`](Self::blocks) for sixteen finite `l`, whose squared lengths are `a`: the same answers.
    #[inline(always)]
    pub fn blocks_lanes<S: Simd>(&self, l: Vec3x16<S>, a: f32x16<S>) -> mask32x16<S> {
        let simd = a.token();
        let zero = simd.splat_f32x16(0.0);
        let f = Vec3x16::splat(simd, self.f);
        let b = -f.dot(l);
        if self.side == Side::Far {
            let (cross, end) = (l.cross(f), Vec3x16 { x: l.x + f.x, y: l.y + f.y, z: l.z + f.z });
            let discriminant = a * self.r2 - cross.dot(cross);
            return (discriminant.simd_ge(zero) & b.simd_gt(zero) & b.simd_lt(a)) | end.dot(end).simd_lt(self.cc);
        }
        let end = (a - (b + b)) + self.cc;
        let slack = (a + self.ff) * END_SLACK;
        match self.side {
            Side::Inside => end.simd_gt(slack),
            Side::On => {
                let wrong = l.abs().dot(Vec3x16::splat(simd, self.df));
                b.simd_gt(wrong) & end.simd_gt(slack)
            }
            Side::Outside | Side::Far => {
                let discriminant = b * b - a * self.cc;
                (discriminant.simd_ge(zero) & b.simd_gt(zero) & b.simd_lt(a)) | end.simd_lt(-slack)
            }
        }
    }
}

/// The relative error allowed to |q - c|^2 - r^2 at the end of a shadow ray.
const END_SLACK: f32 = 16.0 * UNIT_ROUNDOFF;

/// The same for |l + f|^2 near r^2, in r |f|: l and f are each wrong by their rounding, and neither is much longer than
/// the other where their sum is short. That is 4 r |f| roundings, and what the squares add is less.
const FAR_END_SLACK: f32 = 16.0 * UNIT_ROUNDOFF;

/// Steps in uv are no longer than this: once around.
const MAX_STEP: f32 = 1.0;

fn bounded(step: Vec2) -> Vec2 {
    step.clamp(Vec2::splat(-MAX_STEP), Vec2::splat(MAX_STEP))
}

/// u = 1/2 + atan2(-n.z, n.x) / 2 pi, v = 1/2 + asin(n.y) / pi, and the steps that `dnx`, `dny` make in them.
pub(super) fn equirectangular(n: Vec3, dnx: Vec3, dny: Vec3) -> (Vec2, Vec2, Vec2) {
    let ring2 = (n.x * n.x + n.z * n.z).max(POLE);
    let ring = ring2.sqrt();
    // The arc sine loses its digits near 1, this does not
    let uv = Vec2::new(0.5 + f_atan2f(-n.z, n.x) * (0.5 * FRAC_1_PI), 0.5 + f_atan2f(n.y, ring) * FRAC_1_PI);
    let step =
        |dn: Vec3| bounded(Vec2::new((n.z * dn.x - n.x * dn.z) / ring2 * (0.5 * FRAC_1_PI), dn.y / ring * FRAC_1_PI));
    (uv, step(dnx), step(dny))
}

/// u = angle(n, +x) / pi, v = angle(n, +y) / pi, and the steps that `dnx`, `dny` make in them.
fn angles(n: Vec3, dnx: Vec3, dny: Vec3) -> (Vec2, Vec2, Vec2) {
    let from_x = (n.y * n.y + n.z * n.z).max(POLE).sqrt();
    let from_y = (n.x * n.x + n.z * n.z).max(POLE).sqrt();
    // The arc cosine loses its digits near 1, this does not
    let uv = Vec2::new(f_atan2f(from_x, n.x), f_atan2f(from_y, n.y)) * FRAC_1_PI;
    let step = |dn: Vec3| bounded(Vec2::new(-dn.x / from_x, -dn.y / from_y) * FRAC_1_PI);
    (uv, step(dnx), step(dny))
}

/// Keeps the squared distance from a pole above 0.
const POLE: f32 = 1e-24;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_far_away_a_sphere_still_hides_what_is_inside_of_it() {
        let (c, r) = (DVec3::new(0.113_931_331, 0.120_853_05, -0.037_770_651), 2.5e-4);
        let sphere = Sphere { c, r, uv: SphereUv::Angles, single_sided: false };
        for far in [5.0, 40.0, 400.0, 2000.0] {
            let p = (c + DVec3::new(0.6, -0.48, 0.64) * (far * r)).as_vec3();
            let shadow = sphere.shadow(p, ErrorBound::of_rounded(p, DVec3::ZERO));
            let mut told = [0; 2];
            for (x, y) in (-12..=12).flat_map(|x| (-12..=12).map(move |y| (f64::from(x), f64::from(y)))) {
                // Points of a plane through the sphere, across and behind it, nearer to the eye than its middle
                let q = (c + DVec3::new(0.11 * x + 0.24, 0.08 * y - 0.19, 0.07 * (y - x) + 0.25) * r).as_vec3();
                let off = (q.as_dvec3() - c).length() / r - 1.0;
                let blocks = shadow.blocks(q - p, true);
                // Nearer to the surface than rounding
                let close = far * 4e-7 + 1e-5;
                if off < -close {
                    assert!(blocks, "{off} radii from the surface, {far} radii away");
                    told[0] += 1;
                } else if off > close && (q.as_dvec3() - c).dot(p.as_dvec3() - c) > 0.0 {
                    assert!(!blocks, "{off} radii from the surface, {far} radii away");
                    told[1] += 1;
                }
            }
            assert!(told.iter().all(|count| *count > 50), "{told:?}");
        }
    }
}
