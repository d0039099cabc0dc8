//! Disk and sphere lights against what is known of them on paper.

use std::f64::consts::PI;

use firstlight::{CameraHit, DiskLightDesc, EmitSides, Falloff, LightDesc, SampleSet, SceneDesc, SphereLightDesc};

use crate::analytic::{first, irradiance, white};
use crate::scenes::*;

const UP: V = [0.0, 1.0, 0.0];
pub(crate) const DOWN: V = [0.0, -1.0, 0.0];

/// Physical, strength 1, invisible.
pub(crate) fn disk(center: V, normal: V, radius: f64, samples: u32) -> DiskLightDesc {
    DiskLightDesc {
        visible: false,
        samples: Some(samples.into()),
        ..DiskLightDesc::with_normal(center, normal, radius)
    }
}

/// Physical, strength 1, invisible.
pub(crate) fn ball(center: V, radius: f64, samples: u32) -> SphereLightDesc {
    SphereLightDesc { visible: false, samples: Some(samples.into()), ..SphereLightDesc::new(center, radius) }
}

#[track_caller]
fn assert_near(is: f64, should: f64, relative: f64) {
    assert!((is - should).abs() <= relative * should.abs(), "{is} is not {should}: off by {:e}", is / should - 1.0);
}

/// pi L/2 [1 - (d^2 + h^2 - R^2) / sqrt((d^2 + h^2 + R^2)^2 - 4 R^2 d^2)], L = 1.
pub(crate) fn disk_overhead(r: f64, h: f64, d: f64) -> f64 {
    let sum = d * d + h * h;
    let all = sum + r * r;
    PI / 2.0 * (1.0 - (sum - r * r) / (all * all - 4.0 * r * r * d * d).sqrt())
}

#[test]
fn a_disk_tends_to_its_closed_form() {
    assert_near(disk_overhead(1.0, 2.0, 1.5), 0.3213351, 1e-6);
    for (r, h, d) in [(1.0, 2.0, 0.0), (1.0, 2.0, 1.5), (3.0, 1.0, 0.5), (0.01, 2.0, 1.0)] {
        for (set, samples, allowed) in
            [(SampleSet::Sobol, 4096, 1e-3), (SampleSet::Grid, 4096, 2e-3), (SampleSet::Sobol, 65536, 1e-4)]
        {
            let light = DiskLightDesc { set, ..disk([d, h, 0.0], [0.0, -3.0, 0.0], r, samples) };
            let e = irradiance([0.0; 3], UP, &[LightDesc::Disk(light)]);
            assert_near(e, disk_overhead(r, h, d), allowed);
        }
    }
}

#[test]
fn a_sphere_above_the_horizon_tends_to_its_closed_form() {
    for (center, r) in
        [([0.0, 2.0, 0.0], 0.5), ([1.0, 1.0, -0.5], 0.9), ([3.0, 40.0, 7.0], 0.001), ([0.0, 2.0, 0.0], 1.5)]
    {
        let (d, cos) = (length(center), unit(center)[1]);
        let truth = PI * (r / d) * (r / d) * cos;
        let light = ball(center, r, 16384);
        let e = |sides| {
            let light = SphereLightDesc { sides, ..light.clone() };
            irradiance([0.0; 3], UP, &[LightDesc::Sphere(light)])
        };
        assert_near(e(None), truth, 3e-3);
        // Its inside is seen at the same solid angle
        assert_near(e(Some(EmitSides::Both)), 2.0 * truth, 3e-3);
    }
}

#[test]
fn a_small_sphere_far_from_the_origin_keeps_its_light() {
    let far = [148_376.0, 1234.0, -223_423.0];
    let light = ball(add(far, [0.0, 512.0, 0.0]), 0.001, 1024);
    let scene = white(far, UP, 100.0).with_light(LightDesc::Sphere(SphereLightDesc { strength: 1e9, ..light }));
    let film = probe(&scene, add(far, [0.0, 32.0, 1.0]), far);
    assert_near(film[0] as f64 * PI, 1e9 * PI * (0.001 / 512.0) * (0.001 / 512.0), 1e-3);
}

#[test]
fn the_inside_of_a_sphere_sees_it_only_where_both_sides_emit() {
    for p in [[0.0; 3], [0.3, 0.1, -0.5]] {
        let e = |sides, falloff| {
            let light = SphereLightDesc { sides: Some(sides), falloff, ..ball([0.0; 3], 1.0, 16384) };
            irradiance(p, UP, &[LightDesc::Sphere(light)])
        };
        assert_eq!(e(EmitSides::Front, Falloff::Physical), 0.0);
        assert_eq!(e(EmitSides::Front, Falloff::Constant), 0.0);
        assert_near(e(EmitSides::Both, Falloff::Physical), PI, 2e-2);
    }
}

#[test]
fn a_constant_sphere_is_the_mean_over_its_area() {
    // The mean of the unit vectors to its points is the gradient of the mean distance, d + r^2 / 3 d
    for (center, r) in [([0.0, 2.0, 0.0], 0.5), ([1.0, 1.0, -0.5], 0.9)] {
        let light = SphereLightDesc { falloff: Falloff::Constant, ..ball(center, r, 16384) };
        let (d, cos) = (length(center), unit(center)[1]);
        let film =
            probe(&white([0.0; 3], UP, 1e-2).with_light(LightDesc::Sphere(light.clone())), [0.0, 5e-3, 0.0], [0.0; 3]);
        assert_near(film[0] as f64, cos * (1.0 - r * r / (3.0 * d * d)), 1e-3);
        // It is not in its own way
        let blocking = SphereLightDesc { blocks: true, ..light };
        let own = probe(&white([0.0; 3], UP, 1e-2).with_light(LightDesc::Sphere(blocking)), [0.0, 5e-3, 0.0], [0.0; 3]);
        assert_eq!(film, own);
    }
}

#[test]
fn a_disk_shines_to_its_front_or_to_both_sides() {
    for (falloff, sides, behind) in [
        (Falloff::Physical, None, false),
        (Falloff::Physical, Some(EmitSides::Both), true),
        (Falloff::Constant, None, true),
        (Falloff::Constant, Some(EmitSides::Front), false),
    ] {
        let e = |normal| {
            let light = DiskLightDesc { falloff, sides, ..disk([0.2, 1.0, 0.0], normal, 0.4, 64) };
            irradiance([0.0; 3], UP, &[LightDesc::Disk(light)])
        };
        let (front, back) = (e(DOWN), e(UP));
        assert!(front > 0.0);
        assert_eq!(back > 0.0, behind, "{falloff:?} {sides:?}");
        assert!(!behind || (front - back).abs() < 0.02 * front, "{front} {back}");
    }
}

/// What a ray from `eye` towards `target` sees of a scene with nothing but a light.
fn seen(light: LightDesc, eye: V, target: V) -> Option<f32> {
    let scene = compile(&empty(1, 1, 1).with_light(light).with_camera(camera(eye, target, 1.0)));
    let d = unit(sub(target, eye)).map(|x| x as f32);
    let ray = firstlight::WorldRay { o: eye.into(), d: d.into() };
    let still = firstlight::RayDifferential::default();
    match scene.look(&ray, &still) {
        CameraHit::Emission(color) => Some(color.r),
        CameraHit::Background => None,
        CameraHit::Surface(_) => panic!("there is no surface"),
    }
}

#[test]
fn the_camera_sees_sides_that_emit() {
    for (sides, front_only) in [(None, true), (Some(EmitSides::Both), false)] {
        let lamp = DiskLightDesc { sides, strength: 3.0, ..DiskLightDesc::with_normal([0.0, 1.0, 0.0], DOWN, 0.5) };
        let at = |x: f64, y: f64| seen(LightDesc::Disk(lamp.clone()), [x, y, 0.0], [x, 1.0, 0.0]);
        assert_eq!((at(0.49, 0.0), at(0.51, 0.0)), (Some(3.0), None));
        assert_eq!(at(0.1, 2.0), if front_only { None } else { Some(3.0) });
        let lamp = SphereLightDesc { sides, strength: 3.0, ..SphereLightDesc::new([0.0, 1.0, 0.0], 0.5) };
        let at = |x: f64, y: f64| seen(LightDesc::Sphere(lamp.clone()), [x, y, 0.0], [x, y + 1.0, 0.0]);
        assert_eq!((at(0.49, 0.0), at(0.51, 0.0)), (Some(3.0), None));
        assert_eq!(at(0.1, 1.0), if front_only { None } else { Some(3.0) });
        let unseen = SphereLightDesc { visible: false, ..lamp.clone() };
        assert_eq!(seen(LightDesc::Sphere(unseen), [0.0; 3], UP), None);
    }
}

#[test]
fn lights_that_block_stop_others_and_not_themselves() {
    let above = LightDesc::Point(point([0.0, 4.0, 0.0], 100.0));
    let p = [0.0; 3];
    let alone = irradiance(p, UP, std::slice::from_ref(&above));
    for blocks in [false, true] {
        for falloff in [Falloff::Physical, Falloff::Constant] {
            let disk =
                |x: f64| LightDesc::Disk(DiskLightDesc { blocks, falloff, ..disk([x, 1.0, 0.0], DOWN, 0.3, 256) });
            let ball = |x: f64| LightDesc::Sphere(SphereLightDesc { blocks, falloff, ..ball([x, 1.0, 0.0], 0.3, 256) });
            let in_the_way: [(&dyn Fn(f64) -> LightDesc, f64); 4] =
                [(&disk, 0.0), (&ball, 0.0), (&disk, 0.35), (&ball, 0.35)];
            for (light, x) in in_the_way {
                let own = irradiance(p, UP, &[light(x)]);
                assert!(own > 0.0);
                let both = irradiance(p, UP, &[light(x), above.clone()]);
                let expected = if blocks && x == 0.0 { own } else { own + alone };
                assert_near(both, expected, 1e-5);
            }
        }
    }
}

#[test]
fn the_shadow_of_a_sphere_under_a_sphere_light_has_its_radii() {
    let scene = white([0.0; 3], UP, 5.0).with_sphere(sphere([0.0, 2.0, 0.0], 1.0)).with_light(LightDesc::Sphere(ball(
        [0.0, 6.0, 0.0],
        0.5,
        16384,
    )));
    let open = |scene: &SceneDesc| SceneDesc { shapes: scene.shapes[..1].to_vec(), ..scene.clone() };
    let bare = open(&scene);
    let at = |scene: &SceneDesc, r: f64| probe(scene, [r, 0.5, 0.0], [r, 0.0, 0.0])[0];
    let umbra = first(1.0, 1.6, |r| at(&scene, r) > 0.0);
    let penumbra = first(1.6, 2.2, |r| at(&scene, r) >= at(&bare, r));
    assert!((umbra - 1.259882).abs() < 5e-3 && umbra > 1.259, "{umbra}");
    assert!((penumbra - 1.887760).abs() < 5e-3 && penumbra < 1.888, "{penumbra}");
}

#[test]
fn a_light_that_is_exact_has_its_points_for_those_who_sample() {
    use firstlight::SamplesDesc::{Count, Exact};
    let e = |samples| {
        let light = SphereLightDesc { samples: Some(samples), ..ball([0.3, 2.0, 0.0], 0.5, 1) };
        irradiance([0.0; 3], UP, &[LightDesc::Sphere(light)])
    };
    assert_near(e(Exact), e(Count(4096)), 1e-3);
}

#[test]
fn transforms_move_round_lights_as_their_numbers_do() {
    let moved = |scale: f64| {
        Some(Box::new(firstlight::TransformDesc {
            translate: [1.0, 2.0, 0.5],
            rotate_deg: [90.0, 0.0, 0.0],
            scale: scale.into(),
            ..Default::default()
        }))
    };
    for scale in [2.0, -2.0] {
        let (p, n) = ([0.0; 3], UP);
        let light = SphereLightDesc { transform: moved(scale), ..ball([0.1, 0.0, 0.2], 0.2, 4096) };
        let at = add([1.0, 2.0, 0.5], mul([0.1, -0.2, 0.0], scale));
        assert_near(
            irradiance(p, n, &[LightDesc::Sphere(light)]),
            irradiance(p, n, &[LightDesc::Sphere(ball(at, 0.4, 4096))]),
            1e-5,
        );
        // Turned by a quarter about x, -z is up: the front of what faces +z faces the floor; mirrored it keeps its
        // front
        let normal = [0.0, 0.0, scale];
        let light = DiskLightDesc { transform: moved(scale), ..disk([0.1, 0.0, 0.2], normal, 0.2, 4096) };
        let moved = disk(at, DOWN, 0.4, 4096);
        assert_near(irradiance(p, n, &[LightDesc::Disk(light)]), irradiance(p, n, &[LightDesc::Disk(moved)]), 1e-3);
    }
}
