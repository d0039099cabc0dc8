//! Lights that nearly touch what they shine on, or cut it: nothing of them may be lost, however near.

use std::f64::consts::PI;

use firstlight::{DiskLightDesc, EmitSides, Falloff, LightDesc, RectangleDesc, SceneDesc, ShapeDesc, SphereLightDesc};

use crate::converged::integrated;
use crate::scenes::*;

/// Red of a white floor at y = 0, at (x, 0, z), under a light that is integrated.
#[track_caller]
fn shine(light: LightDesc, things: &[ShapeDesc], [x, z]: [f64; 2]) -> f64 {
    let floor = parallelogram([-9.0, 0.0, -9.0], [0.0, 0.0, 18.0], [18.0, 0.0, 0.0]);
    let mut scene: SceneDesc = empty(1, 1, 1).with_material("white", matte(1.0)).with_light(light);
    scene = scene.with_shape(ShapeDesc::Parallelogram(firstlight::ParallelogramDesc {
        material: Some("white".into()),
        ..floor
    }));
    for thing in things {
        scene = scene.with_shape(thing.clone());
    }
    scene.render.samples = firstlight::SamplesDesc::Exact;
    // From so near that nothing is between
    let scene = scene.with_camera(camera_up([x, 1e-8, z], [x, 0.0, z], [0.0, 0.0, 1.0], 1.0));
    f64::from(picture(&compile(&scene), &integrated()).pixels[0][0])
}

fn plate(center: V, e0: V, e1: V, falloff: Falloff) -> LightDesc {
    let sides = Some(EmitSides::Both);
    LightDesc::Rectangle(RectangleDesc { sides, falloff, visible: false, ..RectangleDesc::with_edges(center, e0, e1) })
}

fn overhead(h: f64, falloff: Falloff) -> LightDesc {
    plate([0.0, h, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0], falloff)
}

const HEIGHTS: [f64; 8] = [1e-6, 1e-5, 1e-4, 1e-3, 5e-3, 1e-2, 2.5e-2, 3.5e-2];

#[test]
fn plates_above_a_floor_have_lamberts_form() {
    for h in HEIGHTS {
        for at in [[0.3, 0.2], [0.0, 0.0], [-0.7, 0.99], [0.999, -0.999]] {
            let corners = crate::analytic::corners([0.0, h, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]);
            let should = crate::analytic::lambert(&corners, [at[0], 0.0, at[1]], [0.0, 1.0, 0.0]).abs() / PI;
            let is = shine(overhead(h, Falloff::Physical), &[], at);
            // What rounding makes of a thousandth of a millimetre
            let allowed = if h < 1e-5 { 5e-3 } else { 5e-4 };
            assert!((is - should).abs() < allowed, "{h} m, {at:?}: {is} is not {should}");
        }
    }
}

/// The mean of h / r over the light.
fn mean_cosine(h: f64, [x, z]: [f64; 2]) -> f64 {
    let row = |dz: f64| {
        let width = (dz * dz + h * h).sqrt();
        h * (asinh((1.0 - x) / width) - asinh((-1.0 - x) / width))
    };
    // Rows by the hyperbolic sine
    let [from, to] = [-1.0, 1.0].map(|end| asinh((end - z) / h));
    let (count, mut sum) = (20_000, 0.0);
    for k in 0..count {
        let t = from + (to - from) * (f64::from(k) + 0.5) / f64::from(count);
        let (up, down) = (pxfm::f_exp(t), pxfm::f_exp(-t));
        sum += row(h * 0.5 * (up - down)) * h * 0.5 * (up + down);
    }
    sum * (to - from) / f64::from(count) / 4.0
}

fn asinh(x: f64) -> f64 {
    pxfm::f_log(x.abs() + (x * x + 1.0).sqrt()).copysign(x)
}

#[test]
fn the_classic_model_holds_as_near() {
    for h in [1e-5, 1e-4, 1e-3, 1e-2] {
        for at in [[0.3, 0.2], [-0.7, 0.99]] {
            let LightDesc::Rectangle(light) = overhead(h, Falloff::Constant) else { unreachable!() };
            let strength = 0.2 / h;
            let is = shine(LightDesc::Rectangle(RectangleDesc { strength, ..light }), &[], at);
            let should = strength * mean_cosine(h, at);
            assert!((is - should).abs() < 2e-3 * should, "{h} m, {at:?}: {is} is not {should}");
        }
    }
}

#[test]
fn what_cuts_the_floor_sheds_half_a_cosine_on_either_side() {
    for deg in [2.0, 10.0, 17.0, 30.0, 45.0] {
        let (sin, cos) = pxfm::f_sincos(radians(deg));
        for off in [1e-5, 3e-5, 2e-4, 1e-3] {
            for side in [-1.0, 1.0] {
                // Rising towards +x, both lights as large as a half plane beside how near they are
                let normal = [-sin, cos, 0.0];
                let disk = DiskLightDesc {
                    sides: Some(EmitSides::Both),
                    visible: false,
                    ..DiskLightDesc::with_normal([0.0; 3], normal, 1.0)
                };
                let rectangle = plate([0.0; 3], [2.0 * cos, 2.0 * sin, 0.0], [0.0, 0.0, 2.0], Falloff::Physical);
                for (light, name) in [(LightDesc::Disk(disk), "disk"), (rectangle, "rectangle")] {
                    let is = shine(light, &[], [side * off, 0.1]);
                    let should = 0.5 + 0.5 * side * cos;
                    // The light ends a metre away
                    let allowed = 1e-3 + 3.0 * off * off + 2.0 * off * sin;
                    assert!(
                        (is - should).abs() < allowed,
                        "{name}, {deg} degrees, {}: {is} is not {should}",
                        side * off
                    );
                }
            }
        }
    }
}

#[test]
fn specks_hide_what_they_hide() {
    for h in [1e-4, 1e-3, 1e-2, 0.1] {
        for (radius, share) in [(1e-3, 0.5), (0.02, 0.5), (0.1, 0.7), (0.02, 0.1)] {
            let r: f64 = radius * h;
            let ball = ShapeDesc::Sphere(sphere([0.3, share * h, 0.2], r));
            let is = shine(overhead(h, Falloff::Physical), &[ball], [0.3, 0.2]);
            let corners = crate::analytic::corners([0.0, h, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]);
            let whole = crate::analytic::lambert(&corners, [0.3, 0.0, 0.2], [0.0, 1.0, 0.0]).abs() / PI;
            // A cone around the normal: sin^2 of half its angle
            let should = whole - (r / (share * h)) * (r / (share * h));
            assert!((is - should).abs() < 5e-4, "{h} m, {radius}, {share}: {is} is not {should}");
        }
    }
}

#[test]
fn balls_that_nearly_touch_shine_as_far_ones_do() {
    for radius in [0.01, 0.3, 5.0] {
        for gap in [1e-6, 1e-4, 1e-2, 0.5] {
            for aside in [0.0, 1e-3, 0.1, 1.0] {
                let (up, aside) = (radius * (1.0 + gap), radius * aside);
                let d = f64::sqrt(aside * aside + up * up);
                let light = SphereLightDesc { visible: false, ..SphereLightDesc::new([0.3 + aside, up, 0.2], radius) };
                let is = shine(LightDesc::Sphere(light), &[], [0.3, 0.2]);
                let should = (radius / d) * (radius / d) * (up / d);
                assert!((is - should).abs() < 1e-3, "{radius} m, {gap}, {aside}: {is} is not {should}");
            }
        }
    }
}

/// A sheet of many triangles over all x above 0.3, half way up to the light.
#[test]
fn half_a_near_light_behind_a_mesh_is_half_of_it() {
    for h in [1e-4, 1e-3, 1e-2] {
        let n = 24u32;
        let corner = |i: u32, j: u32| [0.3 + f64::from(i) / 8.0, 0.5 * h, f64::from(j) / 8.0 - 1.5];
        let positions = (0..=n).flat_map(|j| (0..=n).map(move |i| corner(i, j))).collect();
        let at = |i: u32, j: u32| j * (n + 1) + i;
        let triangles = (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        });
        let sheet = ShapeDesc::Mesh(mesh(positions, triangles.collect()));
        let is = shine(overhead(h, Falloff::Physical), &[sheet], [0.3, 0.21]);
        assert!((is - 0.5).abs() < 4e-3, "{h} m: {is}");
    }
}
