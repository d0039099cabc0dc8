//! The roads against brute force: many points on the light, each decided by itself.

use fearless_simd::Level;

use super::view::FlatLight;
use super::*;
use crate::material::{BlinnPhongLobe, PhongLobe};
use crate::math::dispatch_wide;
use crate::math::{DVec3, ErrorBound, Vec3};

struct Random(firstlight_testkit::Random);

impl Random {
    fn new(seed: u64) -> Self {
        Random(firstlight_testkit::Random::new(seed))
    }

    fn unit(&mut self) -> f64 {
        self.0.unit()
    }

    fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.unit()
    }

    fn scale(&mut self, a: f64, b: f64) -> f64 {
        a * pxfm::f_pow(b / a, self.unit())
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            if (0.01..1.0).contains(&v.length()) {
                return v.normalize();
            }
        }
    }
}

/// A light and a point near the origin, and things between them.
struct Case {
    light: FlatLight,
    receiver: Receiver,
    view: View,
    hiders: Vec<Hider>,
}

fn case(seed: u64, hiders: usize, sharpest: f64) -> Option<Case> {
    let mut random = Random::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 77);
    let random = &mut random;
    for _ in 0..4 {
        random.unit();
    }
    let distance = if random.unit() < 0.3 { random.scale(0.02, 1.0) } else { random.between(1.0, 8.0) };
    let c = random.direction() * distance;
    let a = random.direction() * random.scale(0.1, 2.0);
    let outline = if random.unit() < 0.4 { Outline::Disk } else { Outline::Parallelogram };
    let mut b = a.cross(random.direction()).normalize();
    b *= if outline == Outline::Disk { a.length() } else { random.scale(0.1, 2.0) };
    if outline == Outline::Parallelogram && random.unit() < 0.3 {
        b += a * random.between(-1.0, 1.0);
    }
    let n = a.cross(b).normalize();
    let light = FlatLight::new(c, a, b, n, outline, random.unit() < 0.5, random.unit() < 0.5);
    let ns = random.direction();
    let mut wo = random.direction();
    if wo.dot(ns) < 0.0 {
        wo = -wo;
    }
    let shininess = random.scale(1.0, sharpest) as f32;
    let lobe = match (random.unit() * 3.0) as u32 {
        0 => Lobe::None,
        1 => Lobe::Phong(PhongLobe::new(shininess.round())),
        _ => Lobe::BlinnPhong(BlinnPhongLobe::new(shininess.round())),
    };
    // Often the highlight is somewhere on the light
    let ns = if random.unit() < 0.6 && wo.dot(c.normalize()) > -0.9 {
        (wo + (c + a * random.between(-1.0, 1.0) + b * random.between(-1.0, 1.0)).normalize()).normalize()
    } else {
        ns
    };
    let p = Vec3::ZERO;
    let (ns, wo) = (ns.as_vec3(), wo.as_vec3());
    let receiver = Receiver { p, error: ErrorBound(Vec3::ZERO), horizon: ns, ns, wo, lobe };
    let view = View::new(&light, &receiver);
    if !view.arrives() {
        return None;
    }
    let mut made = Vec::new();
    for _ in 0..hiders {
        let at = c * random.between(0.1, 1.1) + random.direction() * random.unit();
        if random.unit() < 0.5 {
            let r = random.scale(0.05, 1.0);
            if at.length() > r {
                made.extend(Hider::sphere(&view, at, r));
            }
        } else {
            let (e0, e1) = (random.direction() * random.scale(0.1, 3.0), random.direction() * random.scale(0.1, 3.0));
            let corner = at - (e0 + e1) * 0.5;
            let mut corners = vec![corner, corner + e0, corner + e0 + e1, corner + e1];
            if random.unit() < 0.5 {
                corners.remove(1);
            }
            let corners: Vec<Vec3> = corners.iter().map(|v| v.as_vec3()).collect();
            made.extend(Hider::polygon(&view, &corners));
        }
    }
    Some(Case { light, receiver, view, hiders: made })
}

/// The mean of `n` x `n` points, in f64.
fn brute(case: &Case, n: usize) -> Sums {
    let (light, at) = (&case.light, &case.receiver);
    let (mut diffuse, mut specular) = (0.0, 0.0);
    for i in 0..n {
        for j in 0..n {
            let at_node = |k: usize| (2 * k + 1) as f32 / n as f32 - 1.0;
            let (x, y) = (at_node(i), at_node(j));
            if light.outline == Outline::Disk && x * x + y * y > 1.0 {
                continue;
            }
            // Places are counted from the view's origin
            let [x, y] = [x - case.view.origin[0], y - case.view.origin[1]];
            let l = case.view.l(x, y);
            let (height, distance) = (at.ns.dot(l), l.length());
            if height <= 0.0 || case.hiders.iter().any(|hider| hider.hides(x, y)) {
                continue;
            }
            let mut weight = 4.0 / (n * n) as f64 * f64::from(case.view.measure);
            if light.physical {
                weight *= f64::from(light.n.dot(l).abs() / (distance * distance * distance));
            }
            let cos_i = height / distance;
            diffuse += weight * f64::from(cos_i);
            specular += weight * f64::from(at.lobe.eval(cos_i, at.ns.dot(at.wo), at.wo.dot(l) / distance));
        }
    }
    Sums { diffuse: diffuse as f32, specular: specular as f32 }
}

fn integrated(case: &Case, most: f32) -> (Sums, Sums) {
    let enough = |_: &Sums, error: &Sums| error.diffuse + error.specular <= most;
    dispatch_wide!(Level::new(), simd => integrate(simd, &case.view, &case.hiders, &enough))
}

fn check(seeds: std::ops::Range<u64>, hiders: usize, sharpest: f64, n: usize, allowed: f32) {
    let (mut asked, mut worst) = (0, 0.0f32);
    for seed in seeds {
        let Some(case) = case(seed, hiders, sharpest) else { continue };
        let unshadowed = brute(&Case { hiders: Vec::new(), ..case_again(&case) }, 64);
        // Nearer than a few points are apart they tell nothing
        let apart = 2.0 * case.view.la.max(case.view.lb + case.view.skew.abs()) / n as f32;
        if case.view.height < 8.0 * apart {
            continue;
        }
        let scale = (unshadowed.diffuse + unshadowed.specular).max(0.02);
        let (found, _) = integrated(&case, 1e-4 * scale);
        let truth = brute(&case, n);
        let off = (found.diffuse - truth.diffuse).abs().max((found.specular - truth.specular).abs()) / scale;
        worst = worst.max(off);
        asked += 1;
        assert!(off <= allowed, "seed {seed}: {found:?} is not {truth:?}, off by {off} of {scale}\n{:?}", case.view);
    }
    assert!(asked > 100, "{asked}");
    println!("{hiders} hiders, {asked} cases: worst {worst}");
}

fn case_again(case: &Case) -> Case {
    Case { light: case.light, receiver: case.receiver, view: case.view, hiders: case.hiders.clone() }
}

#[test]
fn lights_seen_whole() {
    check(0..400, 0, 40.0, 400, 2e-3);
}

#[test]
fn narrow_highlights() {
    check(1000..1300, 0, 2000.0, 800, 4e-3);
}

#[test]
fn one_thing_in_the_way() {
    check(2000..2400, 1, 40.0, 500, 4e-3);
}

#[test]
fn several_things_in_the_way() {
    check(3000..3400, 5, 100.0, 500, 5e-3);
}
