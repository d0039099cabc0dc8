//! The ball of radius 1 around the origin: what a transformed sphere is in its own space.

use std::f64::consts::PI;

use glam::DVec2;
use pxfm::f_atan2;

use super::solid::{Chord, SolidHit, SolidPoint};
use super::sphere::SphereUv;
use super::surface::UvEdge;
use crate::math::{DRay, DVec3};

/// The unit sphere, ready to be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ball {
    /// How a point becomes a texture coordinate.
    pub uv: SphereUv,
}

/// How a point of the unit sphere, whose normal is `n`, moves with u and with v.
pub(crate) fn ball_tangents(uv: SphereUv, n: DVec3) -> [DVec3; 2] {
    let (from_x, from_y) = ((n.y * n.y + n.z * n.z).sqrt(), (n.x * n.x + n.z * n.z).sqrt());
    match uv {
        SphereUv::Equirectangular => {
            // East, and north
            let out = DVec2::new(n.x, n.z).normalize_or(DVec2::X);
            let north = DVec3::new(-n.y * out.x, from_y, -n.y * out.y);
            [DVec3::new(n.z, 0.0, -n.x) * (2.0 * PI), north * PI]
        }
        SphereUv::Angles => {
            // With n.x = cos(pi u) and n.y = cos(pi v), n.z is what is left: v stays while n.x and n.z change
            let over_z = |w: f64| if n.z == 0.0 { 0.0 } else { w / n.z };
            [DVec3::new(-1.0, 0.0, over_z(n.x)) * (from_x * PI), DVec3::new(0.0, -1.0, over_z(n.y)) * (from_y * PI)]
        }
    }
}

impl Ball {
    /// Both roots around the point of the ray that is nearest to the centre, where nothing cancels.
    #[inline(always)]
    pub fn intersect(&self, ray: &DRay, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        let ([enter, leave], shift) = Ball::ends(ray);
        let at = |t| SolidHit { t, part: 0 };
        Chord { enter: at(enter), leave: at(leave) }.first(shift, t_min, t_max, single_sided)
    }

    /// Whether [`intersect`](Self::intersect) finds anything, from either side. Without branches.
    #[inline(always)]
    pub fn blocks(&self, ray: &DRay, t_min: f64, t_max: f64) -> bool {
        let (ends, shift) = Ball::ends(ray);
        Chord::has_end(ends, shift, t_min, t_max)
    }

    /// The ends of the part of a ray in the ball, and what is added to them for its t.
    #[inline(always)]
    fn ends(ray: &DRay) -> ([f64; 2], f64) {
        let (near, shift) = ray.nearest_to(DVec3::ZERO);
        let distance = near.o.length();
        let half2 = (1.0 - distance) * (1.0 + distance) / near.d.length_squared();
        let half = half2.max(0.0).sqrt();
        (if half2 >= 0.0 { [-half, half] } else { Chord::NO_ENDS }, shift)
    }

    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        let n = ray.at(hit.t).normalize_or(DVec3::Y);
        let (from_x, from_y) = ((n.y * n.y + n.z * n.z).sqrt(), (n.x * n.x + n.z * n.z).sqrt());
        let (uv, edges) = match self.uv {
            SphereUv::Equirectangular => {
                let (around, up) = (f_atan2(-n.z, n.x), f_atan2(n.y, from_y));
                (DVec2::new(0.5 + around / (2.0 * PI), 0.5 + up / PI), [UvEdge::Periodic, UvEdge::Folded])
            }
            SphereUv::Angles => (DVec2::new(f_atan2(from_x, n.x), f_atan2(from_y, n.y)) / PI, [UvEdge::Folded; 2]),
        };
        let [dpdu, dpdv] = ball_tangents(self.uv, n);
        SolidPoint { p: n, normal: n, uv, dpdu, dpdv, edges, terms: DVec3::ONE }
    }

    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        Some([DVec3::NEG_ONE, DVec3::ONE])
    }

    /// The most that `d` . x is over it, to within rounding.
    pub fn support(&self, d: DVec3) -> f64 {
        d.length()
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::{KnownSolid, never};
    use super::super::solid::Solid;
    use super::*;

    #[test]
    fn it_keeps_what_solids_promise() {
        for uv in [SphereUv::Equirectangular, SphereUv::Angles] {
            let distance = |p: DVec3| p.length() - 1.0;
            let known =
                KnownSolid { solid: Solid::Ball(Ball { uv }), distance: &distance, center: DVec3::ZERO, size: 1.0 };
            known.meets_rays(10_000);
            known.is_left_by_rays(10_000, &never);
            if uv == SphereUv::Equirectangular {
                known.derivatives_hold(4000);
            }
            let rims = |x: f64| DVec3::new(2.0 * x - 1.0, (1.0 - (2.0 * x - 1.0) * (2.0 * x - 1.0)).sqrt(), 0.0);
            known.is_closed(10_000, &rims, &|x| DVec3::splat(0.5 - x));
            let ends = |x: f64| [DVec3::X, DVec3::Y, DVec3::Z][(x * 3.0) as usize] * (x * 30.0 % 2.0 - 1.0).signum();
            known.bounds_are_tight(4000, &ends);
        }
    }

    #[test]
    fn texture_coordinates_are_those_of_a_sphere() {
        use super::super::sphere::Sphere;
        use crate::math::{Ray, Vec3};
        use crate::shape::RayDifferential;
        for uv in [SphereUv::Equirectangular, SphereUv::Angles] {
            let (sphere, ball) = (Sphere { c: DVec3::ZERO, r: 1.0, uv, single_sided: false }, Ball { uv });
            for i in 0..1000 {
                let k = i as f32;
                let o = Vec3::new(3.0 - 0.006 * k, 2.5 - 0.005 * k, 4.0);
                let d = (Vec3::new(0.3 - 0.0006 * k, 0.2, 0.0) - o).normalize();
                let (ray, deep) = (Ray { o, d }, DRay { o: o.as_dvec3(), d: d.as_dvec3() });
                let hit = ball.intersect(&deep, 0.0, f64::INFINITY, false).expect("it is ahead");
                let t = sphere.intersect(&ray).expect("it is ahead");
                assert!((t - hit.t).abs() < 1e-6);
                let still = RayDifferential::default();
                let (a, b) = (sphere.point(&ray, t, &still), ball.point(&deep, &hit));
                assert!((a.uv.as_dvec2() - b.uv).length() < 1e-5, "{:?} {:?}", a.uv, b.uv);
                assert!((a.p.as_dvec3() - b.p).length() < 1e-6);
            }
        }
    }
}
