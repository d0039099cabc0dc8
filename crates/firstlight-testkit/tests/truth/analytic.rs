//! Pixels known on paper: the closed forms that every renderer of direct light must meet.

use std::f64::consts::PI;

use firstlight::{ColorDesc, ColorParam, Falloff, LightDesc, SampleSet, SceneDesc};
use pxfm::{f_acos, f_asinh, f_atan, f_cos, f_sin};

use crate::scenes::*;

/// A few rounded operations in a row.
const ROUNDING: f64 = 2e-6;

#[track_caller]
fn assert_close(is: f32, should: f64, relative: f64) {
    assert!(
        (is as f64 - should).abs() <= relative * should.abs(),
        "{is} is not {should}: off by {:e}",
        is as f64 / should - 1.0
    );
}

/// A white matte square around `p`, facing `n`.
pub(crate) fn white(p: V, n: V, half: f64) -> SceneDesc {
    empty(1, 1, 1)
        .with_material("white", matte(1.0))
        .with_parallelogram(firstlight::ParallelogramDesc { material: Some("white".into()), ..square(p, n, half) })
}

/// What arrives at `p` on a surface facing `n`, in lux: the film is E / pi for white.
#[track_caller]
pub(crate) fn irradiance(p: V, n: V, lights: &[LightDesc]) -> f64 {
    let scene = white(p, n, 1e-2).lit_by(lights);
    // Close by and off the normal: nothing but the light decides the answer
    let from = add(p, add(mul(unit(n), 5e-3), mul(across(n)[0], 2e-3)));
    probe(&scene, from, p)[0] as f64 * PI
}

#[test]
fn a_point_light_follows_the_inverse_square() {
    let mut random = Random::new(1);
    for _ in 0..times(100) {
        let n = random.direction();
        let to_light = random.direction();
        let cos = dot(n, to_light);
        if cos < 0.05 {
            continue;
        }
        let (d, strength) = (random.scale(0.1, 100.0), random.scale(1e-3, 1e6));
        let e = |d: f64| irradiance([0.0; 3], n, &[LightDesc::Point(point(mul(to_light, d), strength))]);
        assert_close(e(d) as f32, strength * cos / (d * d), 2.0 * ROUNDING / cos);
        // Ten times the distance, a hundredth of the light
        assert_close((e(d) / e(10.0 * d)) as f32, 100.0, 4.0 * ROUNDING / cos);
    }
}

#[test]
fn a_constant_point_light_knows_no_distance() {
    for d in [0.1, 1.0, 1e4] {
        let light = firstlight::PointDesc { falloff: Falloff::Constant, ..point([0.6 * d, 0.8 * d, 0.0], 0.5) };
        let film = probe(
            &white([0.0; 3], [0.0, 1.0, 0.0], 1e-2).with_light(LightDesc::Point(light)),
            [0.0, 0.01, 0.0],
            [0.0; 3],
        );
        assert_close(film[0], 0.5 * 0.8, ROUNDING);
    }
}

#[test]
fn a_directional_light_is_lux_times_the_cosine() {
    let mut random = Random::new(2);
    for _ in 0..60 {
        let (n, direction, lux) = (random.direction(), random.direction(), random.scale(0.01, 1e5));
        let cos = -dot(n, direction);
        let e = irradiance(
            [3.0, -2.0, 1.0],
            n,
            &[LightDesc::Directional(directional(mul(direction, random.scale(1e-3, 1e3)), lux))],
        );
        if cos <= 0.0 {
            assert_eq!(e, 0.0, "light from behind");
        } else {
            assert!((e - lux * cos).abs() < lux * ROUNDING, "{e} is not {}", lux * cos);
        }
    }
}

#[test]
fn reflected_is_the_diffuse_fraction_in_each_channel() {
    let scene = empty(1, 1, 1)
        .with_material(
            "tinted",
            phong(ColorParam::constant(ColorDesc::linear(0.7, 0.2, 0.05)), ColorParam::gray(0.0), 1.0),
        )
        .with_parallelogram(firstlight::ParallelogramDesc {
            material: Some("tinted".into()),
            ..square([0.0; 3], [0.0, 1.0, 0.0], 1.0)
        })
        .with_light(LightDesc::Directional(firstlight::DirectionalDesc {
            color: ColorDesc::linear(1.0, 0.5, 3.0),
            ..directional([0.0, -1.0, 0.0], 10.0)
        }));
    let film = probe(&scene, [0.0, 2.0, 0.0], [0.1, 0.0, 0.2]);
    for (is, should) in film.into_iter().zip([7.0, 1.0, 1.5]) {
        assert_close(is, should / PI, ROUNDING);
    }
}

/// The light of a spot 2 m above a floor, at `deg` from its axis, in candela.
fn spot_intensity(deg: f64, cone: f64, inner: Option<f64>) -> f64 {
    let (cos, sin) = (f_cos(radians(deg)), f_sin(radians(deg)));
    let p = [2.0 * sin / cos, 0.0, 0.0];
    let light = spot([0.0, 2.0, 0.0], [0.0; 3], cone, inner, 5.0);
    let d = 2.0 / cos;
    irradiance(p, [0.0, 1.0, 0.0], &[LightDesc::Spot(light)]) * d * d / cos / 5.0
}

#[test]
fn a_spot_fades_by_its_formula() {
    for (cone, inner) in [(60.0, 20.0), (100.0, 0.0), (40.0, 36.0)] {
        let (outer_cos, inner_cos) = (f_cos(radians(cone / 2.0)), f_cos(radians(inner / 2.0)));
        for k in 0..40 {
            let deg = k as f64 * 0.02 * cone;
            let fade = ((f_cos(radians(deg)) - outer_cos) / (inner_cos - outer_cos)).clamp(0.0, 1.0);
            let is = spot_intensity(deg, cone, Some(inner));
            // Cosines near 1 are known to 1e-7 each; the fade divides by their difference
            let allowed = 1e-6 / (inner_cos - outer_cos) + 1e-5;
            assert!((is - fade * fade).abs() < allowed, "{cone}/{inner} at {deg}: {is} is not {}", fade * fade);
            if deg < inner / 2.0 - 0.01 {
                assert!((is - 1.0).abs() < 1e-5, "full strength inside: {is}");
            }
            if deg > cone / 2.0 + 0.01 {
                assert_eq!(is, 0.0, "dark outside");
            }
        }
    }
}

#[test]
fn a_spot_without_an_inner_cone_has_a_hard_rim() {
    for cone in [10.0, 60.0, 120.0] {
        assert!((spot_intensity(cone / 2.0 - 0.01, cone, None) - 1.0).abs() < 1e-5);
        assert_eq!(spot_intensity(cone / 2.0 + 0.01, cone, None), 0.0);
    }
    // A cone of 180 degrees lights its half of the world
    assert!((spot_intensity(80.0, 180.0, None) - 1.0).abs() < 2e-5);
}

/// The irradiance from a polygon of radiance 1 at `p` on a surface facing `n`, counterclockwise or not; clipped at the
/// horizon. Source: Lambert, "Photometria", 1760.
pub(crate) fn lambert(polygon: &[V], p: V, n: V) -> f64 {
    let v: Vec<V> = polygon.iter().map(|q| sub(*q, p)).collect();
    let mut above = Vec::new();
    for i in 0..v.len() {
        let (a, b) = (v[i], v[(i + 1) % v.len()]);
        let (ha, hb) = (dot(a, n), dot(b, n));
        if ha > 0.0 {
            above.push(a);
        }
        if (ha > 0.0) != (hb > 0.0) {
            above.push(add(a, mul(sub(b, a), ha / (ha - hb))));
        }
    }
    let mut sum = 0.0;
    for i in 0..above.len() {
        let (a, b) = (above[i], above[(i + 1) % above.len()]);
        let normal = cross(a, b);
        if length(normal) > 0.0 {
            sum += f_acos((dot(a, b) / (length(a) * length(b))).clamp(-1.0, 1.0)) * dot(n, unit(normal));
        }
    }
    sum.abs() / 2.0
}

pub(crate) fn corners(center: V, e0: V, e1: V) -> [V; 4] {
    let c = sub(center, mul(add(e0, e1), 0.5));
    [c, add(c, e0), add(add(c, e0), e1), add(c, e1)]
}

#[test]
fn lambert_knows_the_published_number() {
    let light = corners([0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]);
    assert!((lambert(&light, [0.0; 3], [0.0, 1.0, 0.0]) - 1.7408395).abs() < 5e-8);
}

/// Light, lit point, normal: straight above, aside, tilted, and partly below the horizon.
const RECTANGLES: [(V, V, V, V, V); 5] = [
    ([0.0, 1.0, 0.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0], [0.0; 3], [0.0, 1.0, 0.0]),
    ([1.5, 2.0, -0.7], [0.0, 0.0, -2.0], [-1.0, 0.0, 0.0], [0.3, 0.0, 0.1], [0.0, 1.0, 0.0]),
    ([0.5, 1.0, 0.2], [1.2, -0.6, 0.0], [0.3, 0.6, -2.0], [-0.4, 0.0, 0.3], [0.0, 1.0, 0.0]),
    ([0.0, 1.0, 0.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.6, 0.48, 0.64]),
    ([2.0, 0.3, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0], [0.0; 3], [0.0, 1.0, 0.0]),
];

#[test]
fn a_rectangle_tends_to_lamberts_formula() {
    for (i, (center, e0, e1, p, n)) in RECTANGLES.into_iter().enumerate() {
        let truth = lambert(&corners(center, e0, e1), p, n);
        // The front has to be on the point's side: turn the light around where it is not
        let (e0, e1) = if dot(cross(e0, e1), sub(p, center)) > 0.0 { (e0, e1) } else { (e1, e0) };
        for set in [SampleSet::Grid, SampleSet::Sobol, SampleSet::Stratified] {
            let error = |samples| {
                let e = irradiance(p, n, &[LightDesc::Rectangle(rectangle(center, e0, e1, set, samples))]);
                ((e - truth) / truth).abs()
            };
            let (few, many) = (error(64), error(16384));
            assert!(few < 0.05, "{i} {set:?}: {few} with 64 points");
            assert!(many < 1e-3, "{i} {set:?}: {many} with 16384 points");
            // The middles of cells are of second order where nothing cuts the light off: 256 times the points, a
            // 256th of the error, down to rounding. The horizon cuts the light in the last two.
            if set == SampleSet::Grid && i < 3 {
                assert!(many < few / 200.0 + ROUNDING, "{i}: {few} became {many} only");
            }
        }
    }
}

#[test]
fn a_rectangle_shines_to_its_front_or_to_both_sides() {
    for (falloff, sides, behind) in [
        (Falloff::Physical, None, false),
        (Falloff::Physical, Some(firstlight::EmitSides::Both), true),
        (Falloff::Constant, None, true),
        (Falloff::Constant, Some(firstlight::EmitSides::Front), false),
    ] {
        // e0 x e1 points up, away from the floor
        let light = rectangle([0.2, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], SampleSet::Grid, 64);
        let light = firstlight::RectangleDesc { falloff, sides, ..light };
        let back = irradiance([0.0; 3], [0.0, 1.0, 0.0], &[LightDesc::Rectangle(light.clone())]);
        let light = firstlight::RectangleDesc { e0: light.e1, e1: light.e0, ..light };
        let front = irradiance([0.0; 3], [0.0, 1.0, 0.0], &[LightDesc::Rectangle(light)]);
        assert!(front > 0.0);
        assert_eq!(back > 0.0, behind, "{falloff:?} {sides:?}");
        if behind {
            assert!((front - back).abs() < ROUNDING * front);
        }
    }
}

/// The integral of h / sqrt(x^2 + y^2 + h^2) over x from 0 to `a` and y from 0 to `b`.
fn integral_of_cosine(a: f64, b: f64, h: f64) -> f64 {
    let side = |a: f64, b: f64| a * f_asinh(b / (a * a + h * h).sqrt());
    h * (side(a, b) + side(b, a) - h * f_atan(a * b / (h * (a * a + b * b + h * h).sqrt())))
}

#[test]
fn a_constant_rectangle_is_the_mean_over_its_area() {
    for (x, z, a, b, h) in [(0.0, 0.0, 2.0, 2.0, 1.0), (1.0, -0.5, 3.0, 0.5, 0.7), (-4.0, 2.0, 1.0, 6.0, 3.0)] {
        let light = rectangle([x, h, z], [a, 0.0, 0.0], [0.0, 0.0, b], SampleSet::Grid, 4096);
        let light = firstlight::RectangleDesc { falloff: Falloff::Constant, strength: 0.9, ..light };
        let film = probe(
            &white([0.0; 3], [0.0, 1.0, 0.0], 1e-2).with_light(LightDesc::Rectangle(light)),
            [0.0, 5e-3, 0.0],
            [0.0; 3],
        );
        // From -x to x is twice from 0 to x: the integral is odd in both
        let over = |x: f64, z: f64| x.signum() * z.signum() * integral_of_cosine(x.abs(), z.abs(), h);
        let (x0, x1, z0, z1) = (x - a / 2.0, x + a / 2.0, z - b / 2.0, z + b / 2.0);
        let mean = (over(x1, z1) - over(x0, z1) - over(x1, z0) + over(x0, z0)) / (a * b);
        // 4096 middles of cells: second order
        assert_close(film[0], 0.9 * mean, 5e-4);
    }
}

/// Where, between `dark` and `bright`, the light begins.
pub(crate) fn first(mut dark: f64, mut bright: f64, lit: impl Fn(f64) -> bool) -> f64 {
    assert!(lit(bright) && !lit(dark));
    for _ in 0..22 {
        let middle = (dark + bright) / 2.0;
        if lit(middle) {
            bright = middle;
        } else {
            dark = middle;
        }
    }
    bright
}

#[test]
fn the_hard_shadow_of_a_sphere_has_its_radius() {
    let scene = white([0.0; 3], [0.0, 1.0, 0.0], 5.0)
        .with_sphere(sphere([0.0, 2.0, 0.0], 1.0))
        .with_light(LightDesc::Point(point([0.0, 6.0, 0.0], 100.0)));
    let truth = 1.5491933;
    let mut random = Random::new(3);
    for _ in 0..6 {
        // Bisect along a direction on the floor
        let deg = random.between(0.0, 360.0);
        let along = [f_cos(radians(deg)), 0.0, f_sin(radians(deg))];
        let lit = |r: f64| {
            let p = mul(along, r);
            probe(&scene, add(p, [0.0, 0.5, 0.0]), p)[0] > 0.0
        };
        let radius = first(1.4, 1.7, lit);
        assert!((radius - truth).abs() < 1e-5, "{radius} along {deg} degrees");
    }
}

/// A floor and a sphere, with and without a highlight.
fn still_life(specular: f64) -> SceneDesc {
    let name = || Some("glossy".to_owned());
    empty(24, 24, 2)
        .with_camera(camera([0.0, 2.5, 4.0], [0.0, 0.5, 0.0], 45.0))
        .with_material("glossy", blinn_phong(ColorParam::gray(0.6), ColorParam::gray(specular), 20.0))
        .with_sphere(firstlight::SphereDesc { material: name(), ..sphere([0.3, 0.8, 0.0], 0.7) })
        .with_parallelogram(firstlight::ParallelogramDesc {
            material: name(),
            ..square([0.0; 3], [0.0, 1.0, 0.0], 4.0)
        })
}

fn every_light() -> Vec<LightDesc> {
    vec![
        LightDesc::Point(point([1.0, 3.0, 2.0], 20.0)),
        LightDesc::Directional(directional([1.0, -2.0, -0.5], 3.0)),
        LightDesc::Spot(spot([-2.0, 3.0, 1.0], [0.0; 3], 50.0, Some(20.0), 30.0)),
        LightDesc::Rectangle(rectangle([-1.0, 3.0, -1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], SampleSet::Sobol, 50)),
    ]
}

#[test]
fn lights_add() {
    for specular in [0.0, 0.5] {
        let scene = still_life(specular);
        let lights = every_light();
        for i in 0..lights.len() {
            for j in 0..i {
                let [a, b] =
                    [&lights[i], &lights[j]].map(|l| shoot_every_ray(&scene.clone().lit_by(std::slice::from_ref(l))));
                let both = shoot_every_ray(&scene.clone().lit_by(&[lights[i].clone(), lights[j].clone()]));
                for ((a, b), both) in a.pixels.iter().zip(&b.pixels).zip(&both.pixels) {
                    let sum = a[0] + b[0];
                    // Diffuse light has two terms, and a sum of two has no order. With highlights there are four
                    let allowed = if specular == 0.0 { 0.0 } else { 2.0 * f32::EPSILON * sum };
                    assert!((both[0] - sum).abs() <= allowed, "{i} and {j}: {} is not {} + {}", both[0], a[0], b[0]);
                }
            }
        }
    }
}

#[test]
fn light_is_linear_in_strength() {
    let scale = |light: &LightDesc, s: f64| {
        let mut light = light.clone();
        match &mut light {
            LightDesc::Point(l) => l.strength *= s,
            LightDesc::Directional(l) => l.strength *= s,
            LightDesc::Spot(l) => l.strength *= s,
            LightDesc::Rectangle(l) => l.strength *= s,
            #[allow(unreachable_patterns)]
            _ => unreachable!("no test here uses another light"),
        }
        light
    };
    let scene = still_life(0.5);
    let base = shoot_every_ray(&scene.clone().lit_by(&every_light()));
    assert!(base.pixels.iter().any(|p| p[0] > 0.1));
    // Powers of two change no digit, so the whole picture scales exactly
    for s in [2.0, 1024.0, 0.25] {
        let lights: Vec<_> = every_light().iter().map(|l| scale(l, s)).collect();
        let scaled = shoot_every_ray(&scene.clone().lit_by(&lights));
        for (a, b) in base.pixels.iter().zip(&scaled.pixels) {
            assert_eq!(a[0] * s as f32, b[0]);
        }
    }
    let lights: Vec<_> = every_light().iter().map(|l| scale(l, 3.0)).collect();
    for (a, b) in base.pixels.iter().zip(&shoot_every_ray(&scene.lit_by(&lights)).pixels) {
        assert_close(b[0], 3.0 * a[0] as f64, ROUNDING);
    }
}

#[test]
fn splitting_a_light_changes_nothing() {
    // The middles of 16 x 16 cells are those of 4 x 4 lights with 4 x 4 cells each, and of 2 x 8 with 8 x 2
    let whole = rectangle([0.5, 3.0, 0.3], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0], SampleSet::Grid, 256);
    let parts = |n: u32| {
        let (e0, e1) = (whole.e0.unwrap(), whole.e1.unwrap());
        let (a, b) = (mul(e0, 1.0 / n as f64), mul(e1, 1.0 / n as f64));
        let corner = sub(whole.center, mul(add(e0, e1), 0.5));
        let mut lights = Vec::new();
        for i in 0..n {
            for j in 0..n {
                let center = add(corner, add(mul(a, i as f64 + 0.5), mul(b, j as f64 + 0.5)));
                lights.push(LightDesc::Rectangle(rectangle(center, a, b, SampleSet::Grid, 256 / (n * n))));
            }
        }
        lights
    };
    let scene = still_life(0.5);
    let one = shoot_every_ray(&scene.clone().lit_by(&parts(1)));
    for n in [2, 4, 16] {
        let many = shoot_every_ray(&scene.clone().lit_by(&parts(n)));
        let mut flips = 0;
        for (a, b) in one.pixels.iter().zip(&many.pixels) {
            // The points agree to rounding, so a shadow's edge may fall on the other side of one of them
            flips += usize::from((a[0] - b[0]).abs() > 3e-6 * a[0]);
            assert!((a[0] - b[0]).abs() <= 0.01 * a[0].max(b[0]), "{n}: {} became {}", a[0], b[0]);
        }
        assert!(flips <= 6, "{n} x {n} parts: {flips} pixels of {} differ", one.pixels.len());
    }
}

/// Six walls around the parallelepiped with the corner `p` and the edges `e`, without overlap.
fn walls(p: V, e: [V; 3]) -> Vec<firstlight::ParallelogramDesc> {
    let mut walls = Vec::new();
    for k in 0..3 {
        let (a, b) = (e[(k + 1) % 3], e[(k + 2) % 3]);
        walls.push(parallelogram(p, a, b));
        walls.push(parallelogram(add(p, e[k]), a, b));
    }
    walls
}

#[test]
fn nothing_outside_a_closed_box_is_lit() {
    let mut random = Random::new(4);
    let boxes: [(V, [V; 3]); 5] = [
        ([-1.0, -1.0, -1.0], [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]]),
        // Turned
        ([0.3, -0.8, 0.1], [[1.2, 1.6, 0.0], [-1.6, 1.2, 0.0], [0.0, 0.0, 2.0]]),
        // Skewed
        ([-0.7, -0.9, -1.1], [[2.0, 0.3, 0.1], [0.7, 1.9, -0.4], [-0.3, 0.6, 2.1]]),
        // Far from the origin, and very far: f32 knows these coordinates to 0.1 and to 8 mm
        ([148376.1, 1234.3, -223423.7], [[1.2, 1.6, 0.0], [-1.6, 1.2, 0.0], [0.0, 0.0, 2.0]]),
        ([1483.76, 12.34, -2234.23], [[1.2, 1.6, 0.0], [-1.6, 1.2, 0.0], [0.0, 0.0, 2.0]]),
    ];
    for (corner, e) in boxes {
        let inside = |u: f64, v: f64, w: f64| add(corner, add(mul(e[0], u), add(mul(e[1], v), mul(e[2], w))));
        let middle = inside(0.5, 0.5, 0.5);
        let mut scene = empty(1, 1, 1)
            .with_sphere(sphere(middle, 6.0))
            .with_light(LightDesc::Point(point(inside(0.4, 0.55, 0.6), 1e6)))
            .with_light(LightDesc::Rectangle(firstlight::RectangleDesc {
                sides: Some(firstlight::EmitSides::Both),
                strength: 1e6,
                ..rectangle(inside(0.5, 0.6, 0.5), [0.3, 0.0, 0.0], [0.0, 0.0, 0.3], SampleSet::Sobol, 100)
            }));
        for wall in walls(corner, e) {
            scene = scene.with_parallelogram(wall);
        }
        // The light is there
        assert!(probe(&scene, middle, inside(0.9, 0.3, 0.5))[0] > 100.0);
        // From outside, at points of the shell that lie behind edges, corners and walls as the light sees them
        let light = inside(0.4, 0.55, 0.6);
        for k in 0..times(400) as usize {
            let mut at = [0.0; 3].map(|_: f64| random.unit());
            // On a wall, on an edge, on a corner
            for axis in 0..[1, 2, 2, 3][k % 4] {
                at[(axis + k) % 3] = random.below(2) as f64;
            }
            let through = inside(at[0], at[1], at[2]);
            let away = unit(sub(through, light));
            // Onto the shell
            let f = sub(light, middle);
            let b = dot(f, away);
            let t = -b + (b * b - dot(f, f) + 36.0).sqrt();
            let shell = add(light, mul(away, t));
            let seen = probe(&scene, add(shell, mul(sub(middle, shell), 0.1)), shell);
            assert_eq!(seen, [0.0; 3], "light comes out at {through:?} of the box at {corner:?}");
            // And looking in where the walls meet: the inside is not seen, but for the hair's breadth by which walls
            // overlap
            let from = add(middle, mul(random.direction(), 5.0));
            let compiled = compile(&scene.clone().with_camera(camera(from, through, 0.01)));
            let (ray, differential) = compiled.camera().ray(0.5, 0.5, 1.0);
            let Some(hit) = compiled.intersect(&ray) else { panic!("the shell is closed") };
            let Some(wall) = (hit.surface.0 as usize).checked_sub(1) else { continue };
            let (a, b) = (e[(wall / 2 + 1) % 3], e[(wall / 2 + 2) % 3]);
            let outward =
                mul(cross(a, b), dot(cross(a, b), e[wall / 2]).signum() * if wall % 2 == 1 { 1.0 } else { -1.0 });
            if dot(outward, ray.d.to_array().map(f64::from)) > 0.0 {
                let uv = compiled.surface(&ray, &hit, &differential).uv.to_array();
                let to_edge = uv.map(|w| w.min(1.0 - w)).into_iter().fold(1.0, f32::min);
                assert!(to_edge < 1e-3, "{from:?} sees the inside at {uv:?} of wall {wall}, aimed at {through:?}");
            }
        }
    }
}

#[test]
fn a_knife_edge_hides_half_of_a_light() {
    // Light 4 m up, a blade 2 m up that covers x < 0: at x = t on the floor, light points with x < -t are hidden
    let light = rectangle([0.0, 4.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0], SampleSet::Grid, 64 * 64);
    let blade = parallelogram([-20.0, 2.0, -10.0], [20.0, 0.0, 0.0], [0.0, 0.0, 20.0]);
    for t in [0.0, 0.25, -0.5, 0.75, -0.9375, 1.5, -1.5] {
        let p = [t, 0.0, 0.0];
        let scene = |blade: Option<&firstlight::ParallelogramDesc>| {
            let mut scene = white(p, [0.0, 1.0, 0.0], 0.01).with_light(LightDesc::Rectangle(light.clone()));
            scene.lights[0] =
                LightDesc::Rectangle(firstlight::RectangleDesc { e0: light.e0, e1: light.e1, ..light.clone() });
            if let Some(blade) = blade {
                scene = scene.with_parallelogram(blade.clone());
            }
            probe(&scene, add(p, [0.0, 0.005, 0.0]), p)[0] as f64 * PI
        };
        let (open, cut) = (scene(None), scene(Some(&blade)));
        let from = (-t).clamp(-1.0, 1.0);
        let truth = match 1.0 - from {
            width if width > 0.0 => lambert(
                &corners([from + width / 2.0, 4.0, 0.0], [width, 0.0, 0.0], [0.0, 0.0, 2.0]),
                p,
                [0.0, 1.0, 0.0],
            ),
            _ => 0.0,
        };
        assert!((cut - truth).abs() < 1e-4, "at {t}: {cut} is not {truth}");
        if t == 0.0 {
            assert!((cut - open / 2.0).abs() < ROUNDING, "half of {open} is not {cut}");
        }
    }
}
