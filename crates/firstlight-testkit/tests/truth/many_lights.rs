//! Many lights: what is left out, and what is taken for one, against all lights evaluated.

use std::num::NonZeroUsize;

use firstlight::{
    AaMode, CameraDesc, ColorDesc, ColorParam, EmitSides, Falloff, Image, LightDesc, PointDesc, Projection,
    RectangleDesc, RenderSettings, SamplesDesc, SceneDesc, ShapeDesc, SimdLevel, SphereLightDesc, SpotDesc, Window,
};

use crate::converged::displayed;
use crate::scenes::*;

/// In display steps: what may be wrong where one light may stand for others, in any pixel; and the root of the mean of
/// squares.
const CROWDED: f64 = 2.0;
const CROWDED_RMS: f64 = 0.5;

/// The fast way, one thread.
fn adaptive() -> RenderSettings {
    RenderSettings { aa_mode: AaMode::Adaptive, ..one_thread() }
}

/// What lights may be: points and spots, or these and such with areas.
#[derive(Clone, Copy, PartialEq)]
enum Kinds {
    Points,
    Areas,
}

/// A floor, a wall and things to stand in the way; black where no light is, unless there is ambient light.
fn stage(seed: u64) -> SceneDesc {
    let random = &mut Random::new(seed);
    let mut scene = empty(32, 32, 1)
        .with_camera(camera([random.between(-2.0, 2.0), random.between(1.0, 4.0), 7.0], [0.0, 0.5, 0.0], 50.0))
        .with_material("floor", matte(0.7))
        .with_material("shiny", blinn_phong(ColorParam::gray(0.4), ColorParam::gray(0.5), random.scale(2.0, 300.0)))
        .with_material("glossy", phong(ColorParam::gray(0.1), ColorParam::gray(0.8), random.scale(2.0, 60.0)));
    let mut floor = ShapeDesc::Parallelogram(square([0.0, 0.0, 0.0], [0.0, 1.0, 0.0], 6.0));
    *common(&mut floor).material = Some(if random.chance(0.5) { "floor" } else { "shiny" }.into());
    let mut wall = ShapeDesc::Parallelogram(square([0.0, 2.0, -3.0], [0.0, 0.0, 1.0], 4.0));
    *common(&mut wall).material = Some("glossy".into());
    scene = scene.with_shape(floor).with_shape(wall);
    for _ in 0..6 {
        let r = random.between(0.1, 0.8);
        let mut ball = ShapeDesc::Sphere(sphere([random.between(-2.5, 2.5), r, random.between(-2.0, 3.0)], r));
        *common(&mut ball).material = Some(if random.chance(0.5) { "floor" } else { "shiny" }.into());
        scene = scene.with_shape(ball);
    }
    // A screen in the middle, and on every other stage a block of triangles
    scene = scene.with_parallelogram(square([0.0, 1.5, 1.0], [0.3, 0.2, 1.0], random.between(0.2, 0.8)));
    if seed % 2 == 1 {
        scene = scene.with_shape(ShapeDesc::Mesh(box_mesh([-1.5, 0.6, 1.5], [0.8, 1.2, 0.5])));
    }
    if seed % 3 == 1 {
        scene.render.ambient = ColorDesc::gray(0.03).into();
    }
    scene
}

/// Lights in clumps and alone, far and near, some of them next to the floor.
fn lit(mut scene: SceneDesc, seed: u64, count: u32, kinds: Kinds) -> SceneDesc {
    let random = &mut Random::new(seed ^ 0x1234_5678);
    scene.render.samples = SamplesDesc::Exact;
    let strength = 12.0 / f64::from(count);
    let mut clump = [0.0; 3];
    for i in 0..count {
        if i % 20 == 0 {
            clump = [random.between(-5.0, 5.0), random.between(0.3, 6.0), random.between(-2.5, 6.0)];
        }
        let size = if i % 40 < 20 { 0.3 } else { 4.0 };
        let mut p = add(clump, [0; 3].map(|_| random.between(-size, size)));
        p[1] = if random.chance(0.03) { random.scale(0.01, 0.1) } else { p[1].abs().max(0.02) };
        let color = ColorDesc::linear(random.unit(), random.unit(), random.unit());
        // Near the floor a light is weak, or all is white
        let strength = strength * (p[1] * p[1]).min(1.0) * random.scale(0.1, 3.0);
        let kind = random.below(if kinds == Kinds::Points { 5 } else { 8 });
        scene = scene.with_light(match kind {
            0..=2 => LightDesc::Point(PointDesc { color, ..point(p, strength) }),
            3 => {
                let at = add(p, [random.between(-1.0, 1.0), -1.0, random.between(-1.0, 1.0)]);
                LightDesc::Spot(SpotDesc {
                    color,
                    ..spot(p, at, 80.0, Some(random.between(1.0, 80.0)), strength * 2.0)
                })
            }
            4 => {
                let falloff = Falloff::Constant;
                LightDesc::Point(PointDesc { color, falloff, ..point(p, 0.3 * strength) })
            }
            5 => {
                let r = random.between(0.01, 0.05);
                let strength = strength / (std::f64::consts::PI * r * r);
                LightDesc::Sphere(SphereLightDesc { color, strength, visible: false, ..SphereLightDesc::new(p, r) })
            }
            _ => {
                let [a, b] = across(random.direction());
                let (side, sides) = (random.between(0.02, 0.1), [EmitSides::Front, EmitSides::Both]);
                LightDesc::Rectangle(RectangleDesc {
                    color,
                    strength: strength / (side * side),
                    visible: false,
                    sides: Some(random.pick(&sides)),
                    ..RectangleDesc::with_edges(p, mul(a, side), mul(b, side))
                })
            }
        });
    }
    scene
}

/// The same picture from pictures of few lights each, in which every light is asked for everywhere.
fn all_lights(desc: &SceneDesc) -> Image {
    let mut sum: Option<Image> = None;
    for lights in desc.lights.chunks(16) {
        let mut part = desc.clone();
        part.lights = lights.to_vec();
        if sum.is_some() {
            part.render.ambient = ColorDesc::gray(0.0).into();
        }
        let image = picture(&compile(&part), &adaptive());
        match &mut sum {
            None => sum = Some(image),
            Some(sum) => {
                for (a, b) in sum.pixels.iter_mut().zip(&image.pixels) {
                    *a = [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3]];
                }
            }
        }
    }
    sum.expect("there are lights")
}

#[track_caller]
fn assert_same(desc: &SceneDesc, is: &Image, should: &Image, what: &str) {
    let scene = compile(desc);
    let (mut lit, mut squares) = (0, 0.0);
    for (i, (a, b)) in is.pixels.iter().zip(&should.pixels).enumerate() {
        let (x, y) = (displayed(&scene, *a), displayed(&scene, *b));
        for channel in 0..3 {
            let off = (x[channel] - y[channel]).abs();
            assert!(off <= CROWDED, "{what}, pixel {i}: {a:?} is not {b:?}, off by {off} steps");
            squares += off * off / 3.0;
        }
        lit += u32::from(x[0] > 8.0);
    }
    assert!(lit > 100, "{what}: only {lit} pixels are lit");
    let rms = (squares / is.pixels.len() as f64).sqrt();
    assert!(rms <= CROWDED_RMS, "{what}: off by {rms} steps, rms");
}

fn hold(seeds: std::ops::Range<u64>, count: u32, kinds: Kinds) {
    for seed in seeds {
        let desc = lit(stage(seed), seed, count, kinds);
        let is = picture(&compile(&desc), &adaptive());
        assert_same(&desc, &is, &all_lights(&desc), &format!("{count} lights, scene {seed}"));
    }
}

#[test]
fn lights_taken_for_one_do_not_show() {
    hold(0..6, 100, Kinds::Points);
    hold(20..24, 1500, Kinds::Points);
}

#[test]
fn area_lights_taken_for_one_do_not_show() {
    hold(10..13, 100, Kinds::Areas);
    hold(30..32, 1200, Kinds::Areas);
}

/// Of lights that a surface leaves out, none stands for others there.
#[test]
fn lights_that_surfaces_choose_are_taken_for_one_among_themselves() {
    let mut unlike = 0;
    for seed in 50..53 {
        let mut desc = lit(stage(seed), seed, 120, Kinds::Points);
        for (i, light) in desc.lights.iter_mut().enumerate() {
            let name = Some(if i % 3 == 0 { "few" } else { "most" }.to_owned());
            match light {
                LightDesc::Point(light) => light.name = name,
                LightDesc::Spot(light) => light.name = name,
                _ => unreachable!("there are no others"),
            }
        }
        let plain = picture(&compile(&desc), &adaptive());
        let [few, most] = ["few", "most"].map(|name| Some(vec![name.to_owned()]));
        for (i, shape) in desc.shapes.iter_mut().enumerate() {
            let [include, exclude, _, shadows] = common(shape).links;
            match i {
                0 => *include = few.clone(),
                1 => *exclude = few.clone(),
                2..5 => *shadows = most.clone(),
                _ => {}
            }
        }
        let is = picture(&compile(&desc), &adaptive());
        assert_same(&desc, &is, &picture(&compile(&desc), &every_ray()), &format!("scene {seed}"));
        unlike += plain.pixels.iter().zip(&is.pixels).filter(|(a, b)| (a[0] - b[0]).abs() > 0.02).count();
    }
    assert!(unlike > 200, "{unlike}");
}

/// An orthographic camera that moves by whole pixels sees the same places: each may differ by the bound, and no more.
#[test]
fn nothing_swims_with_the_camera() {
    let pixel = 6.0 / 32.0;
    let seen = |shift: f64| {
        let mut desc = lit(stage(2), 2, 1500, Kinds::Points);
        desc.cameras.clear();
        let position = [shift * pixel, 6.0, 6.0];
        let desc = desc.with_camera(CameraDesc {
            look_at: [shift * pixel, 0.0, 0.0],
            projection: Projection::Orthographic,
            height: Some(6.0),
            fov_y_deg: None,
            ..CameraDesc::new(position)
        });
        (picture(&compile(&desc), &adaptive()), desc)
    };
    let (still, desc) = seen(0.0);
    let scene = compile(&desc);
    for shift in [1usize, 3, 8] {
        let (moved, _) = seen(shift as f64);
        let mut compared = 0;
        for (y, x) in (0..32).flat_map(|y| (0..32 - shift).map(move |x| (y, x))) {
            let a = displayed(&scene, still.pixels[y * 32 + x + shift]);
            let b = displayed(&scene, moved.pixels[y * 32 + x]);
            let off = (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
            // At the outlines of things and shadows another place is seen
            compared += u32::from(off <= CROWDED);
        }
        assert!(compared as f64 >= 0.995 * (32 * (32 - shift)) as f64, "{shift}: only {compared} are the same");
    }
}

/// No decision depends on tiles, crops, threads or the instruction set.
#[test]
fn many_lights_have_the_same_bits() {
    for (seed, count) in [(40, 100), (41, 1200)] {
        let mut desc = lit(stage(seed), seed, count, Kinds::Areas);
        (desc.render.width, desc.render.height, desc.render.antialiasing) = (45, 37, 2);
        let scene = compile(&desc);
        let whole = picture(&scene, &adaptive());
        let threads = NonZeroUsize::new(3);
        let other = picture(&scene, &RenderSettings { threads, tile_size: 8, ..adaptive() });
        assert!(bits(&whole) == bits(&other), "{count} lights: threads and tiles");
        for simd in SimdLevel::available() {
            let other = picture(&scene, &RenderSettings { simd, ..adaptive() });
            assert!(bits(&whole) == bits(&other), "{count} lights: {simd:?}");
        }
        let window = Window { x: 7, y: 11, width: 20, height: 13 };
        let part = picture(&scene, &RenderSettings { crop: Some(window), ..adaptive() });
        for (i, pixel) in bits(&part).iter().enumerate() {
            let (x, y) = (7 + i % 20, 11 + i / 20);
            assert!(*pixel == bits(&whole)[y * 45 + x], "{count} lights: crop, pixel {x} {y}");
        }
    }
}
