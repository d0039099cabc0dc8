//! The border of light and dark on facets that stand for something round.

use firstlight::{
    CameraDesc, DirectionalDesc, Falloff, Image, LightDesc, MeshDesc, Projection, RectangleDesc, RenderSettings,
    SampleSet, SceneDesc, ShadowTerminator, ShapeDesc,
};

use crate::scenes::*;

/// A unit ball of 8 rings of 12 facets, with the normals of a sphere.
fn coarse_ball() -> MeshDesc {
    let (rings, around) = (8u32, 12u32);
    let mut directions = vec![[0.0, 1.0, 0.0]];
    for ring in 1..rings {
        let theta = std::f64::consts::PI * ring as f64 / rings as f64;
        for i in 0..around {
            let phi = std::f64::consts::TAU * i as f64 / around as f64;
            let sin = pxfm::f_sin(theta);
            directions.push([sin * pxfm::f_cos(phi), pxfm::f_cos(theta), sin * pxfm::f_sin(phi)]);
        }
    }
    directions.push([0.0, -1.0, 0.0]);
    let last = directions.len() as u32 - 1;
    let at = |ring: u32, i: u32| match ring {
        0 => 0,
        8 => last,
        ring => 1 + (ring - 1) * around + i % around,
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for i in 0..around {
            let (a, b, c, d) = (at(ring, i), at(ring, i + 1), at(ring + 1, i), at(ring + 1, i + 1));
            triangles.extend([[a, b, c], [b, d, c]].iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[0] != t[2]));
        }
    }
    MeshDesc { normals: directions.clone(), ..mesh(directions, triangles) }
}

const SIZE: u32 = 96;

/// From +z, without perspective: 2.2 m across.
fn front() -> CameraDesc {
    let base = camera([0.0, 0.0, 5.0], [0.0; 3], 1.0);
    CameraDesc { projection: Projection::Orthographic, fov_y_deg: None, height: Some(2.2), ..base }
}

fn sun(direction: V) -> LightDesc {
    LightDesc::Directional(DirectionalDesc { falloff: Falloff::Constant, ..directional(direction, 1.0) })
}

/// A small square from where the sun of that direction would shine.
fn small_light(direction: V) -> LightDesc {
    let [a, b] = across(unit(direction)).map(|side| mul(side, 0.6));
    let light = rectangle(mul(unit(direction), -6.0), a, b, SampleSet::Sobol, 64);
    LightDesc::Rectangle(RectangleDesc { falloff: Falloff::Constant, visible: false, ..light })
}

fn scene(shape: ShapeDesc, light: LightDesc, terminator: ShadowTerminator) -> SceneDesc {
    let mut scene = empty(SIZE, SIZE, 1).with_camera(front()).with_shape(shape).lit_by(&[light]);
    scene.render.shadow_terminator = terminator;
    scene
}

/// The fast picture, after the reference was seen to have the same bits.
fn both(desc: &SceneDesc) -> Image {
    let scene = compile(desc);
    let fast = picture(&scene, &every_ray());
    let plain = picture(&scene, &RenderSettings { reference: true, ..one_thread() });
    assert!(bits(&fast) == bits(&plain), "fast and plain differ: {desc:#?}");
    fast
}

/// How far the first is from the second near the border of light and dark, in the middle of the ball, and by how much
/// it grows from one pixel to the next on rows that lead from light to dark.
fn steps(facets: &Image, round: &Image) -> [f32; 2] {
    let value = |image: &Image, x: u32, y: u32| image.pixels[(y * SIZE + x) as usize][0];
    let (mut apart, mut growth) = (0.0f32, 0.0f32);
    for y in 0..SIZE {
        // The light is on the right
        let mut before = f32::INFINITY;
        for x in (0..SIZE).rev() {
            let place = |i: u32| 2.2 * ((i as f32 + 0.5) / SIZE as f32 - 0.5);
            if (place(x) * place(x) + place(y) * place(y)).sqrt() > 0.75 {
                continue;
            }
            let (now, there) = (value(facets, x, y), value(round, x, y));
            if there < 0.3 {
                apart = apart.max((now - there).abs());
            }
            growth = growth.max(now - before);
            before = now;
        }
    }
    [apart, growth]
}

#[test]
fn a_coarse_ball_is_lit_as_a_round_one() {
    for name in ["sun", "small light"] {
        let mut worst = 0.0f32;
        for direction in [[-1.0, 0.0, 0.0], [-1.0, 0.0, 0.3], [-1.0, -0.2, -0.2], [-1.0, 0.0, 0.5]] {
            let light = if name == "sun" { sun(direction) } else { small_light(direction) };
            let round = ShapeDesc::Sphere(sphere([0.0; 3], 1.0));
            let round = both(&scene(round, light.clone(), ShadowTerminator::Smooth));
            let of = |terminator| {
                let turned = moved(ShapeDesc::Mesh(coarse_ball()), [0.0; 3], [13.0, 7.0, 0.0], [1.0; 3]);
                steps(&both(&scene(turned, light.clone(), terminator)), &round)
            };
            // A facet lies up to 5 % nearer to the middle of the ball than the sphere, and what is seen there has its
            // normal
            let [apart, growth] = of(ShadowTerminator::Smooth);
            assert!(apart < 0.05, "{name} {direction:?}: {apart} from the round ball");
            assert!(growth < 0.01, "{name} {direction:?}: {growth} brighter on the way to the dark");
            let [hard, _] = of(ShadowTerminator::Hard);
            worst = worst.max(hard);
        }
        // And the check can fail
        assert!(worst > 0.1, "{name}: {worst} from the round ball");
    }
}

#[test]
fn what_is_flat_keeps_its_bits() {
    let corners = [[-0.71, -0.53, 0.12], [0.83, -0.61, -0.2], [0.79, 0.66, 0.31], [-0.75, 0.74, 0.63]];
    let e = [sub(corners[1], corners[0]), sub(corners[2], corners[0])];
    let flat = mesh(
        vec![corners[0], corners[1], corners[2], sub(add(corners[0], corners[2]), corners[1])],
        vec![[0, 1, 2], [0, 2, 3]],
    );
    let normal = unit(cross(e[0], e[1]));
    let written = MeshDesc { normals: vec![normal; 4], ..flat.clone() };
    let smoothed = MeshDesc { smooth_deg: Some(180.0), ..flat.clone() };
    let turn = |shape| moved(shape, [0.1, 0.2, -0.3], [20.0, 30.0, 40.0], [0.9, -0.7, 0.8]);
    for shape in [flat, written, smoothed].map(ShapeDesc::Mesh) {
        for light in [sun([-1.0, 0.0, -0.1]), small_light([-1.0, 0.2, -0.3])] {
            for group in [false, true] {
                let of = |terminator| {
                    let desc = if group {
                        let inside = scene(turn(instance("g")), light.clone(), terminator);
                        inside.with_group("g", vec![shape.clone()])
                    } else {
                        scene(turn(shape.clone()), light.clone(), terminator)
                    };
                    bits(&both(&desc))
                };
                assert!(of(ShadowTerminator::Smooth) == of(ShadowTerminator::Hard), "{shape:#?}");
            }
        }
    }
}

#[test]
fn a_closed_sheet_lit_from_behind_stays_dark() {
    let sheet = |deg| ShapeDesc::Mesh(MeshDesc { smooth_deg: Some(deg), ..box_mesh([0.0; 3], [1.6, 1.6, 0.01]) });
    // The rounder it is made, the farther its normals reach around the edge: those of a corner by 55 degrees
    for (deg, direction) in
        [(60.0, [0.0, 0.0, 1.0]), (60.0, [-0.9, 0.0, 0.3]), (180.0, [0.0, 0.0, 1.0]), (180.0, [-0.6, 0.0, 0.8])]
    {
        for light in [sun(direction), small_light(direction)] {
            let image = both(&scene(sheet(deg), light, ShadowTerminator::Smooth));
            assert!(image.pixels.iter().all(|p| p[0] == 0.0), "{deg} {direction:?}");
        }
    }
    // Nor does the far half of a ball see the light
    let image = both(&scene(ShapeDesc::Mesh(coarse_ball()), sun([-0.2, 0.0, 1.0]), ShadowTerminator::Smooth));
    let middle = &image.pixels[(SIZE * SIZE / 2 + SIZE / 2) as usize];
    assert_eq!(middle[0], 0.0);
}

#[test]
fn an_instance_is_lifted_as_the_mesh_in_the_world_is() {
    let turn = |shape| moved(shape, [0.05, 0.0, 0.0], [10.0, 20.0, 30.0], [-0.9, 0.6, 0.8]);
    for direction in [[-1.0, 0.0, 0.1], [-1.0, -0.5, -0.2]] {
        let written = scene(turn(ShapeDesc::Mesh(coarse_ball())), sun(direction), ShadowTerminator::Smooth);
        let placed = scene(turn(instance("ball")), sun(direction), ShadowTerminator::Smooth)
            .with_group("ball", vec![ShapeDesc::Mesh(coarse_ball())]);
        let (written, placed) = (both(&written), both(&placed));
        // Normals are blended before the transform there and after it here: the same only where it keeps angles
        let lit = |image: &Image| image.pixels.iter().filter(|p| p[0] > 0.05).count();
        let (a, b) = (lit(&written), lit(&placed));
        assert!(a > 500 && a.abs_diff(b) < a / 50, "{a} {b}");
        let apart = written.pixels.iter().zip(&placed.pixels).filter(|(a, b)| (a[0] - b[0]).abs() > 0.06).count();
        assert!(apart < a / 50, "{apart} of {a}");
    }
}
