//! What every solid promises, as checks that the tests of each shape call with the shape's own distance function.

use glam::DVec2;

use super::solid::{LineLanes, Solid, SolidHit};
use super::surface::UvEdge;
use crate::context::CompileContext;
use crate::math::{DRay, DVec3, ErrorBound, LANES};

/// Numbers that are the same on every run.
pub(crate) struct Random(firstlight_testkit::Random);

impl Random {
    pub fn new(seed: u64) -> Self {
        Random(firstlight_testkit::Random::new(seed))
    }

    /// From 0 to 1.
    pub fn unit(&mut self) -> f64 {
        self.0.unit()
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Every magnitude from `low` to `high` alike.
    pub fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        let (low, high) = (pxfm::f_log2(low), pxfm::f_log2(high));
        pxfm::f_exp2(self.between(low, high))
    }

    /// In the ball of radius 1.
    pub fn in_ball(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            if v.length_squared() <= 1.0 && v.length_squared() > 1e-6 {
                return v;
            }
        }
    }

    pub fn direction(&mut self) -> DVec3 {
        // Often along an axis, or nearly: that is where formulas divide by nothing
        let pick = self.unit();
        let v = self.in_ball().normalize();
        let axis = [DVec3::X, DVec3::Y, DVec3::Z][(self.unit() * 3.0) as usize];
        if pick < 0.05 {
            axis
        } else if pick < 0.1 {
            -axis
        } else if pick < 0.15 {
            (axis + v * 1e-9).normalize()
        } else {
            v
        }
    }
}

/// Compiles without a fault.
pub(super) fn made<T>(compile: impl FnOnce(&mut CompileContext) -> T) -> T {
    let mut cx = CompileContext::default();
    let made = compile(&mut cx);
    assert!(!cx.has_errors(), "{:?}", cx.take_faults());
    made
}

/// The paths and messages of the faults of a description.
pub(super) fn faults<T>(compile: impl FnOnce(&mut CompileContext) -> T) -> Vec<(String, String)> {
    let mut cx = CompileContext::default();
    compile(&mut cx);
    cx.take_faults().into_iter().map(|fault| (fault.path, fault.message)).collect()
}

/// A solid with what is known of it otherwise.
pub(super) struct KnownSolid<'a> {
    pub solid: Solid,
    /// A function of points that is negative inside, no greater than the distance to the surface, and near it that
    /// distance.
    pub distance: &'a dyn Fn(DVec3) -> f64,
    pub center: DVec3,
    /// How far it reaches from there.
    pub size: f64,
}

impl KnownSolid<'_> {
    /// How far a point of the surface can be off by rounding alone.
    fn rounding(&self, ray: &DRay) -> f64 {
        1e-14 * (self.size + self.center.length() + (ray.o - self.center).length())
    }

    /// Rays from near, far and inside, most of them towards the shape.
    fn ray(&self, random: &mut Random) -> DRay {
        let away = match random.unit() {
            x if x < 0.4 => random.between(0.0, 1.2),
            x if x < 0.8 => random.between(1.0, 5.0),
            _ => random.magnitude(5.0, 1e4),
        };
        let o = self.center + random.direction() * (away * self.size);
        let target = self.center + random.in_ball() * (1.1 * self.size);
        let d = if random.unit() < 0.2 { random.direction() } else { (target - o).normalize_or(DVec3::X) };
        DRay { o, d: d * random.magnitude(1e-3, 1e3) }
    }

    /// The first crossing of the surface, by steps that cannot pass it unless it is touched less deep than 1e-12 of the
    /// size.
    fn march(&self, ray: &DRay) -> Option<f64> {
        let speed = ray.d.length();
        let least = 1e-6 * self.size;
        let at = |t: f64| (self.distance)(ray.at(t));
        let starts_inside = at(0.0) < 0.0;
        let end = ((ray.o - self.center).length() + 2.0 * self.size) / speed;
        let mut t = 0.0;
        while t < end {
            let next = t + at(t).abs().max(least) / speed;
            if (at(next) < 0.0) != starts_inside {
                let (mut low, mut high) = (t, next);
                for _ in 0..100 {
                    let middle = 0.5 * (low + high);
                    *(if (at(middle) < 0.0) == starts_inside { &mut low } else { &mut high }) = middle;
                }
                return Some(high);
            }
            t = next;
        }
        None
    }

    /// Sixteen rays like one get the answers that each gets by itself, whichever of them are asked.
    fn lanes_agree(&self, ray: &DRay, random: &mut Random) {
        let mut lines = [*ray; LANES];
        for line in &mut lines[1..] {
            // Along an axis of the shape now and then
            let d = ray.d + random.in_ball() * ray.d.length();
            let d = if random.unit() < 0.2 {
                [DVec3::X, DVec3::Y, DVec3::Z][(3.0 * random.unit()) as usize % 3]
            } else {
                d
            };
            *line = DRay { o: ray.o + random.in_ball() * (0.1 * self.size), d };
        }
        let (end, asked) = (random.magnitude(0.1, 10.0) * self.size / ray.d.length(), (65536.0 * random.unit()) as u16);
        let answers = self.solid.blocks_lanes(&LineLanes::of(&lines, end), asked);
        for (k, line) in lines.iter().enumerate() {
            let is_met = asked >> k & 1 == 1 && self.solid.intersect(line, 0.0, end, false).is_some();
            assert_eq!(answers >> k & 1 == 1, is_met, "{line:?} {:?}", self.solid);
        }
    }

    /// Hits are where the distance function changes its sign for the first time; normals are its gradient.
    pub fn meets_rays(&self, rays: usize) {
        let mut random = Random::new(7);
        let mut hits = 0;
        for _ in 0..rays {
            let ray = self.ray(&mut random);
            let rounding = self.rounding(&ray);
            // Where the side of the start is a matter of rounding, so is the answer
            if (self.distance)(ray.o).abs() < rounding * 10.0 {
                continue;
            }
            let truth = self.march(&ray);
            let hit = self.solid.intersect(&ray, 0.0, f64::INFINITY, false);
            assert_eq!(hit.is_some(), self.solid.blocks(&ray, 0.0, f64::INFINITY));
            self.lanes_agree(&ray, &mut random);
            if let Some(truth) = truth {
                let deep = (self.distance)(ray.at(truth + 1e-7 * self.size / ray.d.length())).abs();
                let Some(hit) = hit else {
                    assert!(deep < rounding, "{:?} misses a hit at {truth} of {ray:?}", self.solid);
                    continue;
                };
                let late = (hit.t - truth) * ray.d.length();
                assert!(late < 1e-6 * self.size + rounding, "{hit:?} is behind {truth} of {ray:?} {:?}", self.solid);
            }
            let Some(hit) = hit else { continue };
            hits += 1;
            let off = (self.distance)(ray.at(hit.t)).abs();
            assert!(off <= rounding, "{hit:?} of {ray:?} is {off} from the surface of {:?}", self.solid);
            self.point_is_right(&ray, &hit);
            // From behind it is not there, if it is to be seen from one side only
            let cos = self.solid.point(&ray, &hit).normal.dot(ray.d) / ray.d.length();
            let single_sided = self.solid.intersect(&ray, 0.0, f64::INFINITY, true);
            if cos < -1e-3 {
                assert_eq!(single_sided, Some(hit));
            } else if cos > 1e-3 {
                assert!(single_sided.is_none_or(|next| next.t > hit.t));
            }
            // The same with the ends of the interval around it, and without
            let around = |low: f64, high: f64| self.solid.intersect(&ray, low, high, false);
            assert_eq!(around(0.0, hit.t), None);
            assert_eq!(around(0.0, hit.t * (1.0 + 1e-15)), Some(hit));
            assert!(around(hit.t, f64::INFINITY).is_none_or(|next| next.t > hit.t));
        }
        assert!(hits > rays / 100, "only {hits} of {rays} rays hit anything");
    }

    fn point_is_right(&self, ray: &DRay, hit: &SolidHit) {
        let point = self.solid.point(ray, hit);
        let rounding = self.rounding(ray);
        assert!(((self.distance)(point.p)).abs() <= 1e-14 * (self.size + self.center.length()) * 2.0, "{point:?}");
        assert!((point.normal.length() - 1.0).abs() < 1e-12);
        assert!(
            point.uv.cmpge(DVec2::splat(-1e-9)).all() && point.uv.cmple(DVec2::splat(1.0 + 1e-9)).all(),
            "{point:?}"
        );
        let h = 1e-5 * self.size;
        if rounding > 1e-4 * h {
            return;
        }
        let slope =
            |axis: DVec3| ((self.distance)(point.p + axis * h) - (self.distance)(point.p - axis * h)) / (2.0 * h);
        let gradient = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
        // Where sides meet there is no gradient
        if (gradient.length() - 1.0).abs() < 1e-4 {
            let cos = gradient.normalize().dot(point.normal);
            assert!(cos > 1.0 - 1e-3, "{point:?}: {gradient}");
        }
    }

    /// Neighbouring rays meet points whose difference is what the derivatives say.
    pub fn derivatives_hold(&self, rays: usize) {
        let mut random = Random::new(11);
        let mut compared = 0;
        for _ in 0..rays {
            let ray = self.ray(&mut random);
            if (ray.o - self.center).length() > 10.0 * self.size {
                continue;
            }
            let Some(hit) = self.solid.intersect(&ray, 0.0, f64::INFINITY, false) else { continue };
            let aside = DRay { d: ray.d + random.in_ball() * (1e-6 * ray.d.length()), ..ray };
            let Some(next) = self.solid.intersect(&aside, 0.0, f64::INFINITY, false) else { continue };
            let (a, b) = (self.solid.point(&ray, &hit), self.solid.point(&aside, &next));
            let step = b.p - a.p;
            // Grazing, across an edge, or next to a point where u means nothing
            if hit.part != next.part || step.length() > 1e-4 * self.size || a.dpdu.length() < 0.1 * self.size {
                continue;
            }
            let mut uv = b.uv - a.uv;
            for axis in 0..2 {
                if a.edges[axis] == UvEdge::Periodic {
                    uv[axis] -= uv[axis].round();
                }
            }
            let wrong = (a.dpdu * uv.x + a.dpdv * uv.y - step).length();
            assert!(wrong < 1e-2 * step.length() + 1e-9 * self.size, "{a:?} {b:?}: {wrong} of {}", step.length());
            let counted = a.uv_step(step);
            let wrong = ((counted - uv) * DVec2::new(a.dpdu.length(), a.dpdv.length())).length();
            assert!(wrong < 5e-2 * step.length() + 1e-9 * self.size, "{a:?}: {counted} is not {uv}");
            compared += 1;
        }
        assert!(compared > rays / 500, "only {compared} of {rays} compared");
    }

    /// The box holds every point, and no smaller one does. `extremes`: points of the surface, the outermost among them.
    pub fn bounds_are_tight(&self, points: usize, extremes: &dyn Fn(f64) -> DVec3) {
        let bounds = self.solid.bounds().expect("it has an end");
        let mut random = Random::new(13);
        let mut met = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for _ in 0..points {
            let extreme = extremes(random.unit());
            let ray = self.ray(&mut random);
            let hit = self.solid.intersect(&ray, 0.0, f64::INFINITY, false);
            for p in [Some(extreme), hit.map(|hit| self.solid.point(&ray, &hit).p)].into_iter().flatten() {
                met = [met[0].min(p), met[1].max(p)];
            }
        }
        let rounding = DVec3::splat(1e-14 * (self.size + self.center.length()));
        assert!((bounds[0] - rounding).cmple(met[0]).all() && (bounds[1] + rounding).cmpge(met[1]).all());
        let room = DVec3::splat(1e-3 * self.size);
        assert!((met[0] - bounds[0]).cmple(room).all() && (bounds[1] - met[1]).cmple(room).all(), "{bounds:?} {met:?}");
    }

    /// No ray from inside gets out unseen, and from outside as many ends are met going in as coming out. `rims`: points
    /// that rays are aimed at besides others, where sides meet; `inside`: points well inside.
    pub fn is_closed(&self, rays: usize, rims: &dyn Fn(f64) -> DVec3, inside: &dyn Fn(f64) -> DVec3) {
        let mut random = Random::new(17);
        for i in 0..rays {
            let rim = rims(random.unit());
            let aim = if i % 4 == 0 { rim + random.in_ball() * (1e-9 * self.size) } else { rim };
            // From inside
            let o = inside(random.unit());
            let ray = DRay { o, d: aim - o };
            let out = self.solid.intersect(&ray, 0.0, f64::INFINITY, false);
            assert!(out.is_some(), "{ray:?} leaves {:?} unseen", self.solid);
            // From outside
            let o = self.center + random.direction() * (random.between(2.0, 5.0) * self.size);
            let ray = DRay { o, d: aim - o };
            let (mut count, mut after, mut met) = (0, 0.0, Vec::new());
            while let Some(hit) = self.solid.intersect(&ray, after, f64::INFINITY, false) {
                (count, after) = (count + 1, hit.t);
                met.push(hit);
                assert!(count <= 4, "{met:?}");
            }
            if count % 2 == 1 {
                // Both ends in the same place: touched, no more
                let deep = (self.distance)(ray.at(met[0].t));
                assert!(deep.abs() < 10.0 * self.rounding(&ray), "{ray:?} meets {:?} in {met:?}", self.solid);
                assert!(count == 1 && self.solid.is_convex() || count == 3);
            }
        }
    }

    /// A ray that leaves a point of the surface, as rays of light do, does not find that point again. `clear`: how long
    /// a ray with this cosine to the normal is free at least, in sizes.
    pub fn is_left_by_rays(&self, rays: usize, clear: &dyn Fn(f64) -> f64) {
        let mut random = Random::new(19);
        for _ in 0..rays {
            let ray = self.ray(&mut random);
            let Some(hit) = self.solid.intersect(&ray, 0.0, f64::INFINITY, false) else { continue };
            let point = self.solid.point(&ray, &hit);
            let flat = self.solid.is_flat();
            let viewer = if flat && point.normal.dot(ray.d) > 0.0 { -point.normal } else { point.normal };
            let (p, ng) = (point.p.as_vec3(), viewer.as_vec3());
            let error = ErrorBound::of_rounded(p, point.terms);
            let far = ErrorBound::of_rounded(p, point.terms).0.length() as f64;
            if !self.solid.is_convex() && far > 1e-4 * self.size {
                continue;
            }
            let start = error.offset(p, ng);
            for _ in 0..4 {
                let d = random.in_ball().normalize();
                // Sometimes very low
                let low = d - ng.as_dvec3() * d.dot(ng.as_dvec3()) * (1.0 - 1e-5);
                let d = (if random.unit() < 0.5 { d } else { low }).normalize();
                let cos = d.dot(ng.as_dvec3());
                let d = if cos < 0.0 { -d } else { d };
                // What the rounding of the normal to f32 decides
                if cos.abs() < 2e-7 {
                    continue;
                }
                let leaving = DRay { o: start, d };
                let again = self.solid.intersect(&leaving, 0.0, f64::INFINITY, false);
                if let Some(again) = again {
                    let free = clear(cos.abs()) * self.size;
                    assert!(again.t > free, "{leaving:?} from {point:?} meets {:?} again: {again:?}", self.solid);
                }
            }
        }
    }
}

/// For shapes that curve outwards everywhere: never.
pub(super) fn never(_cos: f64) -> f64 {
    f64::INFINITY
}
