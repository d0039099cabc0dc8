//! Scenes far from the origin: the same pictures, and answers in the coordinates of the world.

use firstlight::{
    BoxDesc, CameraDesc, CameraHit, ColorParam, CompileOptions, CylinderDesc, DVec3, DiskLightDesc, Image, LightDesc,
    LightId, MemoryAssets, MeshDesc, NoAssets, PlaneDesc, PointSetDesc, RayDifferential, RenderSettings, SampleSet,
    Scene, SceneDesc, ShapeDesc, SphereLightDesc, Studio, StudioSettings, WorldRay, read_mesh,
};

use firstlight_testkit::Random;
use firstlight_testkit::scenes::*;

/// Where the scene is put: a ten-thousandth of a metre is what 64 bits still tell there, and more than what 32 do.
const PLACES: [V; 4] = [[1e6, 0.0, 0.0], [-5e6, 5e6, 5e6], [1e8, 1e8, -1e8], [0.0, -2.4e8, 0.0]];

/// A plate of 1 m with furrows 1 mm deep and some mm wide.
fn furrows(at: V) -> MeshDesc {
    const N: u32 = 120;
    let mut positions = Vec::new();
    for j in 0..=N {
        for i in 0..=N {
            let [x, z] = [i, j].map(|k| f64::from(k) / f64::from(N) - 0.5);
            positions.push(add(at, [x, 0.001 * f64::from((i / 3 + j / 5) % 2), z]));
        }
    }
    let quads = (0..N).flat_map(|j| (0..N).map(move |i| j * (N + 1) + i));
    let triangles = quads.flat_map(|k| [[k, k + N + 1, k + 1], [k + 1, k + N + 1, k + N + 2]]).collect();
    mesh(positions, triangles)
}

/// A metre of everything around `at`: written there, or moved there from 0.
fn scene(at: V, is_moved: bool) -> SceneDesc {
    let own = if is_moved { [0.0; 3] } else { at };
    let there = |p: V| add(own, p);
    let place = |shape: ShapeDesc| if is_moved { moved(shape, at, [0.0; 3], [1.0; 3]) } else { shape };
    let random = &mut Random::new(3);
    let ball = ball_mesh(0.08, 12, 0.05, true, random);
    let points = PointSetDesc {
        positions: (0..40).map(|_| there(add([-0.25, 0.1, 0.25], mul(random.vector(1.0), 0.08)))).collect(),
        radius: Some(0.012),
        ..PointSetDesc::default()
    };
    // What is in a group is written at 0: its instance is what is far
    let in_group = |p: V| moved(instance("ball"), add(at, p), [0.0; 3], [1.0; 3]);
    let mut ground = parallelogram(there([-2.0, -0.2, 2.0]), [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]);
    ground.material = Some("board".into());
    let mut cylinder = CylinderDesc::new(there([0.3, 0.0, -0.3]), there([0.3, 0.25, -0.3]), 0.07);
    cylinder.material = Some("board".into());
    let wall = PlaneDesc {
        point: there([0.0, 0.0, -1.5]),
        normal: [0.0, 0.0, 1.0],
        material: Some("board".into()),
        ..PlaneDesc::default()
    };
    let cube = BoxDesc { size: [0.12, 0.16, 0.12], ..BoxDesc::new(there([-0.3, 0.08, -0.2])) };
    let disk = DiskLightDesc::with_normal(add(at, [-0.6, 1.0, 0.6]), [0.4, -1.0, -0.4], 0.1);
    let mut lamp = SphereLightDesc::new(add(at, [-0.05, 0.3, -0.45]), 0.04);
    lamp.strength = 3.0;
    let shadow = rectangle(add(at, [0.2, 1.2, 0.3]), [0.3, 0.0, 0.0], [0.0, 0.0, 0.3], SampleSet::Sobol, 64);
    empty(64, 48, 2)
        .with_camera(camera(add(at, [0.5, 0.9, 1.4]), add(at, [0.0, 0.05, 0.0]), 40.0))
        .with_texture("tiles", checkerboard([6, 6], [[0.9; 3], [0.2, 0.3, 0.6]]))
        .with_material("board", phong(ColorParam::texture("tiles"), ColorParam::gray(0.1), 20.0))
        .with_group("ball", vec![ShapeDesc::Mesh(ball), ShapeDesc::Sphere(sphere([0.14, 0.0, 0.0], 0.05))])
        .with_shape(place(ShapeDesc::Parallelogram(ground)))
        .with_shape(place(ShapeDesc::Mesh(furrows(own))))
        .with_shape(place(ShapeDesc::Box(cube)))
        .with_shape(place(ShapeDesc::Cylinder(cylinder)))
        .with_shape(place(ShapeDesc::Plane(wall)))
        .with_shape(place(ShapeDesc::PointSet(points)))
        .with_shape(in_group([0.1, 0.12, 0.25]))
        .with_shape(in_group([-0.1, 0.2, -0.1]))
        .with_light(LightDesc::Point(point(add(at, [1.0, 0.5, 0.5]), 0.5)))
        .with_light(LightDesc::Spot(spot(add(at, [0.3, 1.0, 0.8]), at, 30.0, Some(20.0), 1.0)))
        .with_light(LightDesc::Disk(DiskLightDesc { strength: 8.0, ..disk }))
        .with_light(LightDesc::Sphere(lamp))
        .with_light(LightDesc::Rectangle(shadow))
}

/// How many pixels differ by more than two steps of 255, as they are displayed, and by how much all do in the mean.
fn difference(scene: &Scene, a: &Image, b: &Image) -> (usize, f64) {
    let steps = |p: &[f32; 4]| [0, 1, 2].map(|c| 255.0 * scene.display().encode(p[c]));
    let each = a.pixels.iter().zip(&b.pixels).map(|(a, b)| {
        let (a, b) = (steps(a), steps(b));
        (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max)
    });
    let each: Vec<f64> = each.collect();
    (each.iter().filter(|d| **d > 2.0).count(), each.iter().sum::<f64>() / each.len() as f64)
}

/// As pictures are made unless something else is asked for.
fn adaptive() -> RenderSettings {
    RenderSettings { threads: std::num::NonZeroUsize::new(2), ..RenderSettings::default() }
}

fn compiled(desc: &SceneDesc) -> Scene {
    match desc.compile(&NoAssets, &CompileOptions::default()) {
        Ok(compiled) => compiled.scene,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn a_detailed_model_is_the_same_wherever_it_is() {
    let here = compiled(&scene([0.0; 3], false));
    assert_eq!(here.origin(), DVec3::ZERO);
    let expected = picture(&here, &adaptive());
    // The furrows are seen: without them the picture is another
    let mut flat = scene([0.0; 3], false);
    for shape in &mut flat.shapes {
        if let ShapeDesc::Mesh(plate) = shape {
            plate.positions.iter_mut().for_each(|p| p[1] = 0.0);
        }
    }
    let (off, _) = difference(&here, &picture(&compiled(&flat), &adaptive()), &expected);
    assert!(off > 30, "the detail does not show: {off} pixels");
    for at in PLACES {
        for is_moved in [false, true] {
            let there = compiled(&scene(at, is_moved));
            assert!((there.origin() - DVec3::from(at)).length() < 8.0, "{}", there.origin());
            let (off, mean) = difference(&here, &picture(&there, &adaptive()), &expected);
            println!("{at:?}, moved: {is_moved}: {off} pixels differ, {mean} in the mean");
            assert!(off <= 10 && mean < 0.05, "{at:?}, moved: {is_moved}: {off} pixels differ, {mean} in the mean");
        }
    }
}

#[test]
fn rays_and_answers_are_in_the_coordinates_of_the_world() {
    let still = RayDifferential::default();
    let here = compiled(&scene([0.0; 3], false));
    for at in PLACES {
        let there = compiled(&scene(at, true));
        let far = DVec3::from(at);
        let random = &mut Random::new(9);
        let mut met = 0;
        for _ in 0..500 {
            let o = DVec3::from(mul(random.direction(), 1.5));
            let d = (DVec3::from(random.vector(0.3)) - o).normalize().as_vec3();
            let [a, b] = [(&here, o), (&there, far + o)].map(|(scene, o)| {
                let ray = WorldRay { o, d };
                scene.intersect(&ray).map(|hit| (hit, ray))
            });
            let (Some((a, ray)), Some((b, far_ray))) = (a, b) else { continue };
            // At an edge one may meet what the other misses
            if a.surface != b.surface || (a.t - b.t).abs() > 1e-4 {
                continue;
            }
            met += 1;
            if a.surface.index() >= here.surfaces() - 5 {
                continue;
            }
            let (p, q) = (here.surface(&ray, &a, &still), there.surface(&far_ray, &b, &still));
            assert!((p.p + far - q.p).length() < 1e-5, "{} {} at {at:?}", p.p, q.p);
            assert!((q.p - (far_ray.o + far_ray.d.as_dvec3() * b.t)).length() < 1e-5);
            assert!((p.ns - q.ns).length() < 1e-2 && (p.uv - q.uv).length() < 1e-3, "{p:?} {q:?}");
            let CameraHit::Surface(seen) = there.look(&far_ray, &still) else { panic!("there is a surface") };
            assert_eq!((seen.p, seen.surface), (q.p, q.surface));
            let moves = [here.tangents(&ray, &a), there.tangents(&far_ray, &b)];
            assert!((moves[0][0] - moves[1][0]).length() < 1e-2 * moves[0][0].length().max(0.1));
            // The same is hidden from the first light
            let lamp = DVec3::new(1.0, 0.5, 0.5);
            let hidden = [
                here.occluded(&here.shadow_ray_to(&p, LightId(0), lamp)),
                there.occluded(&there.shadow_ray_to(&q, LightId(0), far + lamp)),
            ];
            met -= i32::from(hidden[0] != hidden[1]);
        }
        assert!(met > 250, "{met} at {at:?}");
        // The camera
        let [(a, _), (b, _)] = [&here, &there].map(|scene| scene.camera().ray(20.0, 30.0, 1.0));
        assert!((a.o + far - b.o).length() < 1e-6 && (a.d - b.d).length() < 1e-6, "{a:?} {b:?}");
        assert!((there.camera().frame().position - far - DVec3::new(0.5, 0.9, 1.4)).length() < 1e-6);
        let matrix = there.camera().world_from_camera();
        assert!((matrix[3] - (at[0] + 0.5)).abs() < 1e-6, "{matrix:?}");
        // What is reported
        let [low, high] = there.summary().bounds.expect("there are shapes").map(DVec3::from);
        assert!((low - far).abs().max_element() < 2.01 && (high - far).abs().max_element() < 2.01, "{low} {high}");
        let receipt = there.receipt(&RenderSettings::default());
        let said = receipt.entries.iter().find(|(key, _)| key == "world_from_camera").expect("it is there");
        let x: f64 = said.1.split(' ').nth(3).expect("the fourth number").parse().expect("a number");
        assert!((x - (at[0] + 0.5)).abs() < 1e-6, "{}", said.1);
    }
}

/// A box of that size in metres as an OBJ file, with a millimetre taken off one corner.
fn obj(at: V, size: f64) -> Vec<u8> {
    let mesh = box_mesh(at, [size; 3]);
    let vertex = |(i, p): (usize, &V)| {
        let [x, y, z] = if i == 0 { sub(*p, [0.0, 0.001, 0.0]) } else { *p };
        format!("v {x:.4} {y:.4} {z:.4}\n")
    };
    let face = |t: &[u32; 3]| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    let text: String = mesh.positions.iter().enumerate().map(vertex).chain(mesh.triangles.iter().map(face)).collect();
    text.into_bytes()
}

#[test]
fn a_file_keeps_its_digits_far_from_0() {
    let read = |name: &str, bytes: &[u8]| {
        read_mesh(name, bytes, &|_, _| std::ops::ControlFlow::Continue(())).expect("it is a mesh")
    };
    let near = read("near.obj", &obj([0.0; 3], 1.0));
    assert_eq!(near.origin, [0.0; 3]);
    for at in PLACES {
        let far = read("far.obj", &obj(at, 1.0));
        assert_eq!(far.triangles, near.triangles);
        for (p, q) in near.positions.iter().zip(&far.positions) {
            let q = DVec3::from(q.map(f64::from)) + DVec3::from(far.origin) - DVec3::from(at);
            assert!((DVec3::from(p.map(f64::from)) - q).length() < 1e-6, "{p:?} {q}");
        }
        let bounds = far.report().bounds.expect("there are vertices").map(DVec3::from);
        assert!((bounds[0] - DVec3::from(at) + 0.5).length() < 2e-3, "{bounds:?}");
        // PLY in text and in binary, of 64 bits
        let number = |p: &[f32; 3], i: usize| f64::from(p[i]) + at[i];
        let header = |format: &str| {
            let n = near.positions.len();
            format!(
                "ply\nformat {format} 1.0\nelement vertex {n}\nproperty double x\nproperty double y\n\
                 property double z\n\
                 element face 0\nproperty list uchar int vertex_indices\nend_header\n"
            )
        };
        let rows = near.positions.iter().map(|p| format!("{} {} {}\n", number(p, 0), number(p, 1), number(p, 2)));
        let text = header("ascii") + &rows.collect::<String>();
        let mut binary = header("binary_little_endian").into_bytes();
        binary.extend(near.positions.iter().flat_map(|p| [0, 1, 2].map(|i| number(p, i).to_le_bytes())).flatten());
        for bytes in [text.as_bytes(), &binary] {
            let far = read("far.ply", bytes);
            for (p, q) in near.positions.iter().zip(&far.positions) {
                let q = DVec3::from(q.map(f64::from)) + DVec3::from(far.origin) - DVec3::from(at);
                assert!((DVec3::from(p.map(f64::from)) - q).length() < 1e-6, "{p:?} {q}");
            }
        }
    }
}

#[test]
fn the_automatic_camera_takes_every_model_that_the_reader_takes() {
    let shot = |at: V, size: f64| {
        let files = [("box.obj".to_owned(), obj(at, size))].into_iter().collect();
        let studio = StudioSettings { studio: Studio::Hard, ..StudioSettings::default() };
        let mut desc = SceneDesc::of_model("box.obj", &studio);
        (desc.render.width, desc.render.height) = (64, 64);
        let options = CompileOptions { studio: Some(studio), ..CompileOptions::default() };
        match desc.compile(&MemoryAssets { files }, &options) {
            Ok(compiled) => picture(&compiled.scene, &adaptive()),
            Err(error) => panic!("{size} m at {at:?}: {error}"),
        }
    };
    let expected = shot([0.0; 3], 1.0);
    let here = compiled(&scene([0.0; 3], false));
    for (at, size) in [
        ([2e8, 0.0, 0.0], 1.0),
        ([2e8, -2e8, 2.4e8], 1.0),
        ([0.0; 3], 4.9e8),
        ([2e8; 3], 9e7),
        ([0.0, 2.4e8, 0.0], 1e7),
    ] {
        let (off, mean) = difference(&here, &shot(at, size), &expected);
        assert!(off < 100 && mean < 0.3, "{size} m at {at:?}: {off} pixels differ, {mean} in the mean");
    }
}

#[test]
fn a_camera_may_stand_back_from_what_is_farthest_but_not_farther() {
    let at = |x: f64| {
        let desc = empty(4, 4, 1).with_camera(CameraDesc::new([x, 0.0, 5.0])).with_sphere(sphere([0.0; 3], 2e8));
        desc.compile(&NoAssets, &CompileOptions::default())
    };
    assert!(at(2.4e9).is_ok());
    let fault = at(2.6e9).expect_err("too far").to_string();
    assert!(fault.contains("camera.position") && fault.contains("-2.5e9 to 2.5e9"), "{fault}");
}
