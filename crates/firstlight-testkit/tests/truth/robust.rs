//! Where floating point is at its end: surfaces must not shadow themselves, whatever their size and place, and shapes
//! stay whole seen from far, from near, from inside and edge-on.

use std::f64::consts::PI;

use firstlight::{
    ColorParam, CompileOptions, Falloff, LightDesc, NoAssets, ParallelogramDesc, PointDesc, RectangleDesc,
    RenderSettings, SampleSet, SceneDesc, SphereDesc, SphereUv,
};
use pxfm::{f_asin, f_cos, f_sin, f_tan};

use crate::scenes::*;

/// A light of each kind around `c`, `reach` away, as bright there as 1 m from a candela.
fn lights_around(random: &mut Random, c: V, reach: f64) -> Vec<LightDesc> {
    let strength = (reach * reach).min(1e15);
    let place = |random: &mut Random| add(c, mul(random.direction(), reach));
    let [e0, e1] = across(random.direction()).map(|v| mul(v, (reach * 0.2).max(2e-9)));
    vec![
        LightDesc::Point(point(place(random), strength)),
        LightDesc::Directional(directional(random.direction(), 1.0)),
        LightDesc::Spot(spot(place(random), c, 120.0, None, strength)),
        LightDesc::Rectangle(RectangleDesc {
            falloff: Falloff::Constant,
            ..rectangle(place(random), e0, e1, SampleSet::Sobol, 20)
        }),
    ]
}

/// Renders with and without shadows, both renderers; all four pictures must have the same bits. Answers how many pixels
/// are lit.
#[track_caller]
fn assert_unshadowed(scene: &SceneDesc, what: &str) -> usize {
    let with = compile(scene);
    let fast = picture(&with, &every_ray());
    let plain = picture(&with, &RenderSettings { reference: true, ..one_thread() });
    let without = picture(&compile(&scene.clone().without_shadows()), &every_ray());
    assert_eq!(bits(&fast), bits(&plain), "fast and plain differ: {what}\n{scene:#?}");
    for (i, (a, b)) in fast.pixels.iter().zip(&without.pixels).enumerate() {
        assert_eq!(a, b, "pixel {i} shadows itself: {what}\n{scene:#?}");
        assert!(a.iter().all(|c| c.is_finite() && *c >= 0.0), "pixel {i}: {a:?}: {what}");
    }
    fast.pixels.iter().filter(|p| p[0] > 0.0).count()
}

/// A size from 1e-8 to 2.5e7, and a place: up to a few sizes from the origin, so up to 1e8, or a million away.
fn size_and_place(random: &mut Random) -> (f64, V) {
    if random.chance(0.3) {
        // 1e6 is known to 0.03: nothing smaller than a few metres has a shape there
        (random.scale(1.0, 1e5), mul(random.direction(), 1e6))
    } else {
        // Lights and cameras stand up to six sizes away, and no coordinate may pass 2.5e8
        let size = random.scale(1e-8, 2.5e7);
        let reach = size * random.pick(&[1.0, 3.0]);
        (size, random.vector(reach))
    }
}

#[test]
fn a_sphere_does_not_shadow_its_lit_side() {
    let mut random = Random::new(10);
    let mut lit = 0;
    for i in 0..times(300) {
        let (r, c) = size_and_place(&mut random);
        let at = random.direction();
        // From just above the surface to many radii away
        let eye = add(c, mul(at, r * (1.0 + random.scale(0.02, 5.0))));
        let target = add(c, mul(random.direction(), r * 0.9));
        let reach = r * random.scale(1.01, 6.0);
        let scene = empty(6, 6, 1)
            .with_camera(camera(eye, target, random.scale(0.5, 90.0)))
            .with_sphere(sphere(c, r))
            .lit_by(&lights_around(&mut random, c, reach));
        lit += assert_unshadowed(&scene, &format!("sphere {i}"));
    }
    assert!(lit > 2000, "only {lit} pixels were lit at all");
}

#[test]
fn a_parallelogram_does_not_shadow_itself() {
    let mut random = Random::new(11);
    let mut lit = 0;
    for i in 0..times(300) {
        let (size, p) = size_and_place(&mut random);
        let e0 = mul(random.direction(), size);
        let e1 = mul(add(unit(e0), mul(random.direction(), random.scale(0.05, 2.0))), size);
        let middle = add(p, mul(add(e0, e1), 0.5));
        let eye = add(middle, mul(random.direction(), size * random.scale(0.02, 5.0)));
        let inside = add(p, add(mul(e0, random.unit()), mul(e1, random.unit())));
        let reach = size * random.scale(0.1, 6.0);
        if length(sub(eye, inside)) < 2e-9 {
            continue;
        }
        let scene = empty(6, 6, 1)
            .with_camera(camera(eye, inside, random.scale(0.5, 90.0)))
            .with_parallelogram(parallelogram(p, e0, e1))
            .lit_by(&lights_around(&mut random, middle, reach));
        lit += assert_unshadowed(&scene, &format!("parallelogram {i}"));
    }
    assert!(lit > 2000, "only {lit} pixels were lit at all");
}

#[test]
fn a_flat_mesh_does_not_shadow_itself() {
    let mut random = Random::new(13);
    let mut lit = 0;
    for i in 0..times(200) {
        let size = random.scale(1e-4, 1e4);
        // Along the axes, at height 0 and elsewhere: along one axis there is then nothing to round
        let aligned = random.chance(0.6);
        let n = if aligned { random.pick(&[[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]) } else { random.direction() };
        let height = random.pick(&[0.0, 0.0, 0.3 * size, -2.0 * size]);
        let middle = mul(n, height);
        let [a, b] = across(n).map(|side| mul(side, size));
        let corners = [sub(sub(middle, a), b), add(sub(middle, a), b), add(add(middle, a), b), sub(add(middle, a), b)];
        let eye = add(middle, mul(add(n, random.vector(0.6)), size * random.scale(0.1, 3.0)));
        let inside = add(middle, add(mul(a, random.between(-0.9, 0.9)), mul(b, random.between(-0.9, 0.9))));
        let reach = size * random.scale(0.1, 6.0);
        let scene = empty(6, 6, 1)
            .with_camera(camera(eye, inside, random.scale(0.5, 60.0)))
            .with_shape(firstlight::ShapeDesc::Mesh(mesh(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]])))
            .lit_by(&lights_around(&mut random, middle, reach));
        lit += assert_unshadowed(&scene, &format!("flat mesh {i}"));
    }
    assert!(lit > 1500, "only {lit} pixels were lit at all");
}

#[test]
fn inside_a_sphere_light_stays_inside() {
    let mut random = Random::new(12);
    for i in 0..times(100) {
        let r = random.scale(1e-6, 1e6);
        let c = random.vector(r);
        let eye = add(c, mul(random.direction(), r * random.unit() * 0.9));
        let scene = empty(6, 6, 1)
            .with_camera(camera(eye, add(c, mul(random.direction(), r)), 70.0))
            .with_material("white", matte(1.0))
            .with_sphere(SphereDesc { material: Some("white".into()), ..sphere(c, r) });
        // A light inside reaches all of the wall
        let reach = r * random.between(0.01, 0.7);
        let inside = lights_around(&mut random, c, reach);
        let inside: Vec<_> = inside.into_iter().filter(|l| !matches!(l, LightDesc::Directional(_))).collect();
        let lit = assert_unshadowed(&scene.clone().lit_by(&inside), &format!("inside {i}"));
        assert_eq!(lit, 36, "the wall around the camera has a hole: {i}");
        // From the middle it is the same everywhere: I / r^2
        let central = shoot(&scene.clone().lit_by(&[LightDesc::Point(point(c, r * r))]));
        for p in central.pixels {
            assert!((p[0] as f64 * PI - 1.0).abs() < 3e-6, "{p:?} in sphere {i}");
        }
        // Light from outside does not come in. Where it grazes the wall to within rounding, the wall cannot tell that
        // from its own starting point: a cosine of 3e-6 at most, of light that is up to 6 here
        let reach = r * random.scale(1.3, 10.0);
        let scene = scene.lit_by(&lights_around(&mut random, c, reach));
        let brightest = shoot(&scene).pixels.iter().map(|p| p[0]).fold(0.0, f32::max);
        assert!(brightest < 2e-5, "light comes in through the wall of sphere {i}: {brightest}\n{scene:#?}");
    }
}

#[test]
fn one_sided_shapes_are_seen_from_one_side_and_block_from_both() {
    // A camera inside the sphere looks through it at a floor; the floor is in its shadow all the same
    let ball = |single_sided| SphereDesc { single_sided, ..sphere([0.0, 1.5, 0.0], 1.0) };
    let scene = |single_sided| {
        empty(1, 1, 1)
            .with_camera(camera([0.0, 1.5, 0.0], [0.0; 3], 1.0))
            .with_parallelogram(square([0.0; 3], [0.0, 1.0, 0.0], 5.0))
            .with_sphere(ball(single_sided))
    };
    let overhead = LightDesc::Directional(directional([0.0, -1.0, 0.0], 1.0));
    let from_aside = LightDesc::Directional(directional([1.0, -1.0, 0.0], 1.0));
    assert_eq!(shoot(&scene(true).lit_by(std::slice::from_ref(&overhead))).pixels[0][0], 0.0);
    let through = shoot(&scene(true).lit_by(std::slice::from_ref(&from_aside))).pixels[0][0];
    assert!((through as f64 - 0.8 / PI * f_cos(PI / 4.0)).abs() < 1e-6, "{through}");
    // With both sides, the camera sees the inner wall
    assert_eq!(shoot(&scene(false).lit_by(&[from_aside])).pixels[0][0], 0.0);

    // A pane above the floor, its front up: from below and from above
    for (flip, seen_from_below) in [(true, false), (false, true)] {
        // e0 x e1 points down
        let pane = ParallelogramDesc {
            single_sided: true,
            flip,
            ..parallelogram([-1.0, 1.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0])
        };
        let look = |eye: V, target: V| {
            let scene = empty(1, 1, 1)
                .with_camera(camera(eye, target, 1.0))
                .with_parallelogram(pane.clone())
                .with_parallelogram(square([0.0, 2.0, 0.0], [0.0, 1.0, 0.0], 0.5))
                .with_parallelogram(square([0.0; 3], [0.0, 1.0, 0.0], 5.0))
                .with_light(LightDesc::Point(point([0.3, 1.5, 0.0], 1.0)))
                .with_light(LightDesc::Point(point([0.3, 0.5, 0.0], 100.0)));
            shoot(&scene).pixels[0][0]
        };
        // Straight up: the pane's underside under 100 candela, or through it the dim board above
        let up = look([0.0, 0.4, 0.0], [0.0, 5.0, 0.0]);
        assert_eq!(up > 5.0, seen_from_below, "{up}");
        // Straight down: the pane's dim upper side, or through it the bright floor
        let down = look([0.0, 1.8, 0.0], [0.0, -5.0, 0.0]);
        assert_eq!(down > 5.0, seen_from_below, "{down}");
        // The floor has nothing of the upper light, the board nothing of the lower one, in either case
        let exact = |cos: f64, d2: f64, strength: f64| 0.8 / PI * strength * cos / d2;
        let board = look([0.1, 1.9, 0.0], [0.1, 5.0, 0.0]) as f64;
        let d2: f64 = 0.04 + 0.25;
        assert!((board - exact(0.5 / d2.sqrt(), d2, 1.0)).abs() < 1e-5, "{board}");
        let floor = look([0.1, 0.1, 0.0], [0.1, -5.0, 0.0]) as f64;
        assert!((floor - exact(0.5 / d2.sqrt(), d2, 100.0)).abs() < 1e-3, "{floor}");
    }
}

#[test]
fn silhouettes_are_circles_at_every_size() {
    // Radius, distance; an f32 direction is known to 1e-7, so the far ones have rough rims
    for (r, d) in
        [(1.0, 1.0001), (1.0, 3.0), (1e-4, 2e-4), (1e-4, 0.1), (1.0, 1e4), (1e4, 1e8), (1e-6, 1e-3), (5e7, 1e8)]
    {
        let at = unit([0.3, -0.5, 0.8]);
        let eye = mul(at, d);
        // The circle has a radius of about 20 of 64 pixels
        let tangent = r / (d * d - r * r).sqrt();
        let half = (tangent * 1.6).min(f_tan(radians(85.0)));
        let fov = pxfm::f_atan(half) * 2.0 * 180.0 / PI;
        let radius = tangent / half * 32.0;
        let mut scene = empty(64, 64, 1)
            .with_camera(camera(eye, [0.0; 3], fov))
            .with_sphere(sphere([0.0; 3], r))
            .with_light(LightDesc::Point(PointDesc { falloff: Falloff::Constant, ..point(eye, 1.0) }));
        scene.render.transparent = true;
        let film = shoot(&scene);
        let allowed = 0.01 + radius * (d / r) * 4e-7 + if d < 2.0 * r { radius * 1e-3 } else { 0.0 };
        assert!(allowed < 0.3);
        for (i, p) in film.pixels.iter().enumerate() {
            let (x, y) = ((i % 64) as f64 - 31.5, (i / 64) as f64 - 31.5);
            let from_center = (x * x + y * y).sqrt();
            if from_center < radius - allowed {
                assert_eq!(p[3], 1.0, "a hole at {x}, {y} in the sphere {r} from {d}: {from_center} of {radius}");
            }
            if from_center > radius + allowed {
                assert_eq!(p[3], 0.0, "the sphere {r} from {d} sticks out at {x}, {y}: {from_center} of {radius}");
            }
            // Under a light at the eye nothing seen is in shadow but the very rim
            if from_center < radius - 0.3 {
                assert!(p[0] > 0.0, "the sphere {r} from {d} is dark at {x}, {y}");
            }
        }
    }
}

#[test]
fn tiny_and_far_spheres_have_their_shadow() {
    let down = LightDesc::Directional(directional([0.0, -1.0, 0.0], 1.0));
    let aslant = LightDesc::Directional(directional([1.0, -1.0, 0.0], 1.0));
    let small_rectangle = |h: f64, size: f64| {
        let light = rectangle([0.0, h, 0.0], [size, 0.0, 0.0], [0.0, 0.0, size], SampleSet::Sobol, 20);
        LightDesc::Rectangle(RectangleDesc { falloff: Falloff::Constant, ..light })
    };
    // Centre, radius, light, where the shadow's middle is, and its half length along z
    let cases = [
        ([0.0, 1e-3, 0.0], 1e-4, down.clone(), 0.0, 1e-4),
        ([0.0, 1.0, 0.0], 1e-4, down.clone(), 0.0, 1e-4),
        ([-1.0, 1.0, 0.0], 1e-3, aslant, 0.0, 1e-3),
        ([0.0, 100.0, 0.0], 1e-2, down, 0.0, 1e-2),
        ([0.0, 1e4, 0.0], 1.0, LightDesc::Point(point([0.0, 2e4, 0.0], 4e8)), 0.0, 2.0),
        ([0.0, 1e4, 0.0], 1.0, small_rectangle(2e4, 1e-2), 0.0, 2.0),
        ([0.0, 1e-3, 0.0], 1e-4, small_rectangle(1.0, 1e-3), 0.0, 1e-4),
    ];
    for (i, (center, r, light, x, half)) in cases.into_iter().enumerate() {
        let scene = empty(1, 1, 1)
            .with_parallelogram(square([0.0; 3], [0.0, 1.0, 0.0], half * 100.0))
            .with_sphere(sphere(center, r))
            .with_light(light);
        for (at, dark) in [(0.0, true), (0.95, true), (-0.95, true), (1.06, false), (-1.06, false)] {
            let p = [x, 0.0, at * half];
            let seen = probe(&scene, add(p, [0.0, half * 0.5, 0.0]), p)[0];
            assert_eq!(seen == 0.0, dark, "case {i} at {at} of the shadow's radius: {seen}");
        }
    }
}

#[test]
fn poles_and_seams_are_finite() {
    for uv in [SphereUv::Equirectangular, SphereUv::Angles] {
        for at in
            [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]
        {
            for (distance, fov) in [(4.0, 40.0), (1.01, 90.0), (1e3, 0.2), (0.3, 120.0)] {
                // An odd size: the middle ray ends exactly at the pole
                let texture = ColorParam::texture("board");
                let scene = empty(33, 33, 1)
                    .with_camera(camera(mul(at, distance), [0.0; 3], fov))
                    .with_texture("board", checkerboard([7, 5], [[1.0, 0.8, 0.6], [0.1, 0.2, 0.3]]))
                    .with_material("board", phong(texture.clone(), texture, 9.0))
                    .with_sphere(SphereDesc { uv, material: Some("board".into()), ..sphere([0.0; 3], 1.0) })
                    .with_light(LightDesc::Point(PointDesc {
                        falloff: Falloff::Constant,
                        ..point(mul(at, distance), 1.0)
                    }));
                let mut ambient = scene.clone().lit_by(&[]);
                ambient.render.ambient = firstlight::ColorDesc::WHITE.into();
                for (i, p) in shoot(&scene).pixels.iter().enumerate() {
                    assert!(p.iter().all(|c| c.is_finite() && *c >= 0.0), "{uv:?} {at:?} {distance} pixel {i}: {p:?}");
                }
                for (i, p) in shoot(&ambient).pixels.iter().enumerate() {
                    let inside = p[0] == 0.0 || (0.1..=1.0).contains(&p[0]);
                    assert!(inside, "{uv:?} {at:?} {distance} pixel {i}: {p:?} is not between the two colours");
                }
            }
        }
    }
}

#[test]
fn texture_coordinates_follow_skewed_edges() {
    let (p, e0, e1) = ([0.4, -0.2, 0.3], [2.0, 0.4, -0.3], [1.7, 0.1, 1.1]);
    let n = unit(cross(e0, e1));
    for flip in [false, true] {
        for side in [1.0, -1.0] {
            let mut scene = empty(1, 1, 1)
                .with_texture("board", checkerboard([5, 3], [[1.0; 3], [0.0; 3]]))
                .with_material("board", phong(ColorParam::texture("board"), ColorParam::gray(0.0), 1.0))
                .with_parallelogram(ParallelogramDesc {
                    flip,
                    material: Some("board".into()),
                    ..parallelogram(p, e0, e1)
                });
            scene.render.ambient = firstlight::ColorDesc::WHITE.into();
            for i in 0..5 {
                for j in 0..3 {
                    // The middle of a square and places near its corners
                    for (s, t) in [(0.5, 0.5), (0.03, 0.04), (0.97, 0.03), (0.02, 0.96), (0.98, 0.98)] {
                        let (u, v) = ((i as f64 + s) / 5.0, (j as f64 + t) / 3.0);
                        let at = add(p, add(mul(e0, u), mul(e1, v)));
                        let eye = add(at, add(mul(n, side * 2.0), [0.1, 0.3, -0.2]));
                        let seen = probe(&scene, eye, at)[0];
                        let should = if (i + j) % 2 == 0 { 1.0 } else { 0.0 };
                        assert_eq!(seen, should, "uv {u}, {v}, flip {flip}, side {side}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_parallelogram_seen_edge_on_is_finite() {
    for tilt in [0.0, 1e-7, 1e-5, -1e-6, 1e-3] {
        for eye in [[-5.0, 0.0, 0.3], [0.5, 0.0, 0.5], [-5.0, 1e-6, 0.3], [1.0, 0.0, 1.0]] {
            let mut scene = empty(16, 17, 2)
                .with_camera(camera_up(eye, add(eye, [1.0, tilt, 0.1]), [0.0, 1.0, 0.0], 20.0))
                .with_texture("board", checkerboard([9, 9], [[1.0; 3], [0.5; 3]]))
                .with_material("board", phong(ColorParam::texture("board"), ColorParam::gray(0.5), 30.0))
                .with_parallelogram(ParallelogramDesc {
                    material: Some("board".into()),
                    ..parallelogram([0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
                })
                .with_light(LightDesc::Point(point([0.5, 1.0, 0.5], 1.0)))
                .with_light(LightDesc::Point(point([0.5, 0.0, 0.5], 1.0)));
            scene.render.ambient = firstlight::ColorDesc::gray(0.1).into();
            for (i, p) in shoot(&scene).pixels.iter().enumerate() {
                assert!(p.iter().all(|c| c.is_finite() && *c >= 0.0), "from {eye:?}, tilt {tilt}, pixel {i}: {p:?}");
            }
        }
    }
}

#[test]
fn shapes_without_size_are_refused() {
    let refused = |scene: SceneDesc| {
        let scene = scene.with_camera(camera([0.0, 0.0, 5.0], [0.0; 3], 40.0));
        scene.compile(&NoAssets, &CompileOptions::default()).is_err()
    };
    let flat = |e0, e1| empty(1, 1, 1).with_parallelogram(parallelogram([0.0; 3], e0, e1));
    assert!(!refused(flat([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])));
    assert!(refused(flat([1.0, 0.0, 0.0], [2.0, 0.0, 0.0])));
    assert!(refused(flat([1.0, 0.0, 0.0], [-3.0, 1e-9, 0.0])));
    assert!(refused(flat([0.0; 3], [2.0, 0.0, 0.0])));
    assert!(refused(flat([f64::NAN, 0.0, 0.0], [0.0, 1.0, 0.0])));
    for r in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(empty(1, 1, 1).with_sphere(sphere([0.0; 3], r))), "radius {r}");
    }
}

#[test]
fn a_light_in_the_plane_of_a_ceiling_is_not_blocked_by_it() {
    let mut random = Random::new(13);
    for i in 0..times(60) {
        // A floor and a ceiling of any tilt, `h` apart, and a light in the ceiling
        let n = if i == 0 { [0.0, 1.0, 0.0] } else { random.direction() };
        let [a, b] = if i == 0 { [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] } else { across(n) };
        let h = random.scale(0.1, 100.0);
        let floor = random.vector(h);
        let top = add(floor, mul(n, h));
        let light = RectangleDesc {
            falloff: Falloff::Constant,
            ..rectangle(add(top, mul(a, 0.3 * h)), mul(a, 0.7 * h), mul(b, 0.4 * h), SampleSet::Sobol, 50)
        };
        let scene = empty(8, 8, 1)
            .with_camera(camera(add(floor, mul(n, 0.5 * h)), floor, 80.0))
            .with_parallelogram(square(floor, n, 3.0 * h))
            .with_light(LightDesc::Rectangle(light.clone()))
            .with_light(LightDesc::Point(point(add(light.center, mul(b, 0.1 * h)), h * h)));
        let open = shoot_every_ray(&scene);
        assert!(open.pixels.iter().all(|p| p[0] > 0.0));
        let covered = shoot_every_ray(&scene.clone().with_parallelogram(square(top, n, 2.0 * h)));
        assert_eq!(bits(&open), bits(&covered), "ceiling {i} blocks its own light\n{scene:#?}");
        // Nor does the light's own rectangle, when it blocks
        let mut blocking = scene.clone();
        blocking.lights[0] = LightDesc::Rectangle(RectangleDesc { blocks: true, ..light });
        blocking.lights.truncate(1);
        let mut alone = scene.clone();
        alone.lights.truncate(1);
        assert_eq!(
            bits(&shoot_every_ray(&alone)),
            bits(&shoot_every_ray(&blocking)),
            "light {i} blocks itself\n{scene:#?}"
        );
    }
}

#[test]
fn shapes_in_one_plane_do_not_shadow_each_other() {
    // A large square, tilted, far from its corners and from the origin, and small ones in its plane
    let mut random = Random::new(16);
    for i in 0..times(100) {
        let n = random.direction();
        let [a, b] = across(n);
        let half = random.scale(1.0, 1e5);
        let middle = random.vector(random.clone().scale(1e-3, 1e3));
        let mut scene = empty(8, 8, 1)
            .with_camera(camera(add(middle, add(mul(n, 3.0), mul(a, random.between(0.0, 10.0)))), middle, 60.0))
            .with_parallelogram(parallelogram(
                sub(middle, mul(add(a, b), half)),
                mul(a, 2.0 * half),
                mul(b, 2.0 * half),
            ));
        for _ in 0..3 {
            let at = add(middle, add(mul(a, random.between(-2.0, 2.0)), mul(b, random.between(-2.0, 2.0))));
            scene = scene.with_parallelogram(square(at, n, random.scale(0.1, 10.0)));
        }
        // Lights on either side of the plane
        assert_unshadowed(&scene.lit_by(&lights_around(&mut random, middle, 4.0)), &format!("plane {i}"));
    }
}

#[test]
fn a_light_that_touches_the_floor_lights_it() {
    // A wall that shines, standing on the floor, and one that cuts through it; close to it the floor sees half of a
    // hemisphere of radiance 1 from a plane at a right angle: E tends to pi / 2
    for below in [0.0, 1.0] {
        let light = rectangle([0.0, 5.0 - below, 0.0], [0.0, 0.0, 40.0], [0.0, -10.0, 0.0], SampleSet::Grid, 128 * 128);
        let scene = empty(1, 1, 1)
            .with_parallelogram(square([0.0; 3], [0.0, 1.0, 0.0], 10.0))
            .with_light(LightDesc::Rectangle(light));
        for x in [2.0, 4.0] {
            let e = probe(&scene, [x, 0.5, 0.0], [x, 0.0, 0.0])[0] as f64 * PI / 0.8;
            // An infinitely wide wall from the floor to the angle t above it: E = pi / 2 (1 - cos t)
            let top = 10.0 - below;
            let infinite = PI / 2.0 * (1.0 - x / (x * x + top * top).sqrt());
            assert!((e / infinite - 1.0).abs() < 0.02, "{e} is not {infinite} at {x}");
        }
    }
}

#[test]
fn wall_joints_have_no_dark_dots() {
    // The joints of side walls with floor and ceiling lie exactly on the diagonals of the picture
    for (size, antialiasing) in [(256u32, 1), (192, 1), (128, 4)] {
        let film = shoot(&config11(size, antialiasing, 256));
        let at = |x: u32, y: u32| film.pixels[(y * size + x) as usize];
        let last = size - 1;
        for k in 0..size * 135 / 1024 {
            for (x, y) in [(k, k), (last - k, k), (k, last - k), (last - k, last - k)] {
                // Down or up along the side wall
                let step = |n: u32| if y < size / 2 { y + n } else { y - n };
                let channel = if x < size / 2 { 0 } else { 1 };
                let (here, next, after) = (at(x, y), at(x, step(1))[channel], at(x, step(2))[channel]);
                let what = format!("{size}: {here:?} at {x}, {y}, then {next}, {after}");
                if antialiasing == 1 {
                    // The joint belongs to the side wall, the lower id, and is as bright as the wall beside it
                    assert!(here[1 - channel] == 0.0 && here[2] == 0.0, "{what}");
                    assert!(here[channel] > 0.9 * next.min(after) && here[channel] < 1.1 * next.max(after), "{what}");
                } else {
                    // Five eighths of the wall and three of floor or ceiling
                    assert!(here[channel] > 0.6 * next.min(after), "{what}");
                }
            }
        }
    }
}

#[test]
fn shadows_of_turned_shapes_fall_where_they_should() {
    // A pane lit from a point: the shadow on a plane behind it is its central projection
    let mut random = Random::new(14);
    for i in 0..times(40) {
        let [center, light] = [random.vector(0.5), mul(random.direction(), 6.0)];
        let n = unit(light);
        let e0 = mul(random.direction(), random.between(0.5, 2.0));
        let e1 = mul(random.direction(), random.between(0.5, 2.0));
        if length(cross(unit(e0), unit(e1))) < 0.2 || dot(unit(cross(e0, e1)), n).abs() < 0.2 {
            continue;
        }
        let p = sub(center, mul(add(e0, e1), 0.5));
        let plane = mul(n, -4.0);
        let scene = empty(1, 1, 1)
            .with_parallelogram(square(plane, n, 40.0))
            .with_parallelogram(parallelogram(p, e0, e1))
            .with_light(LightDesc::Point(point(light, 100.0)));
        for _ in 0..12 {
            // A point on the pane's plane, well inside or well outside of the pane, and its projection
            let side = |random: &mut Random| random.pick(&[-0.3, -0.004, 0.004, 0.2, 0.7, 0.996, 1.004, 1.4]);
            let (u, v) = (side(&mut random), side(&mut random));
            let on_pane = add(p, add(mul(e0, u), mul(e1, v)));
            let along = sub(on_pane, light);
            let t = dot(sub(plane, light), n) / dot(along, n);
            let at = add(light, mul(along, t));
            let seen = probe(&scene, add(at, mul(n, 1.0)), at)[0];
            let dark = (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v);
            assert_eq!(seen == 0.0, dark, "pane {i} at {u}, {v}: {seen}");
        }
    }
}

#[test]
fn a_camera_next_to_a_sphere_sees_past_it() {
    // A ray that only just misses or hits, aimed at the tangent circle from any distance
    let mut random = Random::new(15);
    for _ in 0..times(300) {
        let (r, c) = (random.scale(1e-3, 1e3), random.vector(10.0));
        let d = r * (1.0 + random.scale(1e-2, 1e2));
        let eye = add(c, mul(random.direction(), d));
        let to = unit(sub(c, eye));
        let [a, b] = across(to);
        let turn = radians(random.between(0.0, 360.0));
        let aside = add(mul(a, f_cos(turn)), mul(b, f_sin(turn)));
        let limit = f_asin(r / d);
        let mut scene = empty(1, 1, 1).with_sphere(sphere(c, r));
        scene.render.background = firstlight::ColorDesc::WHITE;
        // The eye is known to 1e-7 of its coordinates: that is the angle by which the rim is uncertain
        let rim = 1e-4 * limit + 2e-6 * (length(eye) + length(c)) / d;
        for (angle, hit) in [(limit - rim, true), (limit + rim, false)] {
            let target = add(eye, mul(add(mul(to, f_cos(angle)), mul(aside, f_sin(angle))), d));
            let seen = probe(&scene, eye, target)[0];
            assert_eq!(seen == 0.0, hit, "sphere {r} at {c:?} from {eye:?}, {angle} of {limit}");
        }
    }
}

#[test]
fn a_shadow_does_not_depend_on_where_the_camera_stands() {
    // A plate 4 mm above a floor, under a high sun, seen from 10 m and from 7 km
    let scene = |eye: V, fov| {
        empty(32, 32, 1)
            .with_camera(camera(eye, [0.0; 3], fov))
            .with_parallelogram(square([0.0; 3], [0.0, 1.0, 0.0], 20.0))
            .with_parallelogram(square([0.0, 0.004, 0.0], [0.0, 1.0, 0.0], 0.05))
            .with_light(LightDesc::Directional(directional([0.7, -0.1, 0.0], 1.0)))
    };
    let dark = |film: firstlight::Image| film.pixels.iter().filter(|p| p[0] == 0.0).count();
    let near = dark(shoot(&scene([0.0, 7.0, 7.0], 2.0)));
    let far = dark(shoot(&scene([0.0, 5000.0, 5000.0], 2.0 * 9.9 / 7071.0)));
    assert!(near > 5 && near.abs_diff(far) <= 3 + near / 4, "{near} dark pixels from near, {far} from far");
}

#[test]
fn a_ball_on_a_planet_has_its_shadow() {
    for r in [1e4, 1e6, 6.4e6, 1e8] {
        let scene = empty(1, 1, 1)
            .with_sphere(sphere([0.0, -r, 0.0], r))
            .with_sphere(sphere([0.0, 0.5, 0.0], 0.5))
            .with_light(LightDesc::Directional(directional([1.0, -1.0, 0.0], 1.0)));
        // The ball's shadow reaches from under it to (1.2, 0, 0)
        let at = |x: f64| probe(&scene, [x, 0.7, 1.5], [x, 0.0, 0.0])[0];
        assert_eq!(at(0.7), 0.0, "planet of {r}");
        assert!(at(2.0) > 0.1 && at(-1.5) > 0.1, "planet of {r}");
    }
}

#[test]
fn a_planet_is_seen_from_a_man_s_height() {
    let r = 6.4e6;
    let scene = empty(1, 1, 1)
        .with_sphere(sphere([0.0, -r, 0.0], r))
        .with_light(LightDesc::Point(PointDesc { falloff: Falloff::Constant, ..point([0.0, 1.7, 0.0], 1.0) }))
        .with_parallelogram(square([0.0, 0.01, -3.0], [0.0, 1.0, 0.0], 0.5));
    // The square lies on the ground, a centimetre above it, and hides it
    let scene = compile(&scene.with_camera(camera([0.0, 1.7, 0.0], [0.0, 0.0, -3.0], 45.0)));
    let (ray, differential) = scene.camera().ray(0.5, 0.5, 1.0);
    match scene.look(&ray, &differential) {
        firstlight::CameraHit::Surface(si) => assert!((si.p.y - 0.01).abs() < 1e-6, "{}", si.p),
        other => panic!("{other:?}"),
    }
}

#[test]
fn narrow_spots_fade_and_highlights_keep_below_their_maximum() {
    let spot_at = |x: f64| {
        let light = LightDesc::Spot(spot([0.0, 10.0, 0.0], [0.0; 3], 0.06, Some(0.0), 100.0));
        let scene = empty(1, 1, 1).with_parallelogram(square([0.0; 3], [0.0, 1.0, 0.0], 1.0)).with_light(light);
        probe(&scene, [0.5, 1.0, 0.0], [x, 0.0, 0.0])[0] as f64
    };
    let full = spot_at(0.0);
    for k in 0..10 {
        // Half the cone is 5.236 mm wide; cosines of small angles make the fade a parabola, squared
        let x = k as f64 * 5e-4;
        let share = x / (10.0 * radians(0.03));
        let fade = 1.0 - share * share;
        assert!((spot_at(x) / full - fade * fade).abs() < 0.02, "{} is not {} at {x}", spot_at(x) / full, fade * fade);
    }
    let glossy = phong(ColorParam::gray(0.0), ColorParam::gray(1.0), 1e6);
    let scene = empty(48, 48, 1)
        .with_material("glossy", glossy)
        .with_camera(camera([0.0, 0.0, 3.0], [0.0; 3], 1.0))
        .with_sphere(SphereDesc { material: Some("glossy".into()), ..sphere([0.0; 3], 1.0) })
        .with_light(LightDesc::Point(PointDesc { falloff: Falloff::Constant, ..point([0.0, 0.0, 3.0], 1.0) }));
    assert!(shoot(&scene).pixels.iter().all(|p| p[0] <= 1.0));
}

#[test]
fn the_strongest_light_allowed_gives_numbers() {
    let light = |strength, color| {
        let color = firstlight::ColorDesc::linear(color, 0.0, color);
        LightDesc::Point(PointDesc { color, falloff: Falloff::Constant, ..point([0.0, 1.0, 0.0], strength) })
    };
    let scene = |light| {
        empty(1, 1, 1)
            .with_material(
                "red",
                phong(ColorParam::constant(firstlight::ColorDesc::linear(1e6, 0.0, 0.0)), ColorParam::gray(0.0), 1.0),
            )
            .with_parallelogram(ParallelogramDesc {
                material: Some("red".into()),
                ..square([0.0; 3], [0.0, 1.0, 0.0], 1.0)
            })
            .with_light(light)
    };
    let seen = probe(&scene(light(1e15, 1e6)), [0.1, 0.5, 0.0], [0.0; 3]);
    assert!(seen.iter().all(|c| !c.is_nan()) && seen[0] > 1e26, "{seen:?}");
    let refused = scene(light(1e15, 1e7)).compile(&firstlight::NoAssets, &Default::default());
    assert!(
        refused
            .unwrap_err()
            .to_string()
            .contains("light.point[0].color: [10000000, 0, 10000000] has a channel above 1e6")
    );
}
