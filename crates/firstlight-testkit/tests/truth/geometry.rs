//! Meshes, solids, groups and instances: pictures of scenes that say the same in two ways, and rays that must not meet
//! what they start from.

use std::num::NonZeroUsize;

use firstlight::{
    BoxDesc, CompileOptions, ConeDesc, CylinderDesc, DiskDesc, Image, LightDesc, MemoryAssets, MeshDesc, PlaneDesc,
    RectangleDesc, RectangleShapeDesc, RenderSettings, SampleSet, SceneDesc, ShapeDesc, SphereDesc, TorusDesc,
    TransformDesc, Vec3, Window, WorldRay,
};

use crate::scenes::*;

/// How many pixels of two pictures differ by more than `tolerance`.
fn differing(a: &Image, b: &Image, tolerance: f32) -> usize {
    assert_eq!(a.pixels.len(), b.pixels.len());
    let differs = |(a, b): (&[f32; 4], &[f32; 4])| a.iter().zip(b).any(|(a, b)| (a - b).abs() > tolerance);
    a.pixels.iter().zip(&b.pixels).map(differs).filter(|differs| *differs).count()
}

fn lit(image: &Image) -> usize {
    image.pixels.iter().filter(|p| p[0] > 0.0).count()
}

/// The fast picture, after the reference was seen to have the same bits.
#[track_caller]
fn both(desc: &SceneDesc) -> Image {
    let scene = compile(desc);
    let fast = picture(&scene, &every_ray());
    let plain = picture(&scene, &RenderSettings { reference: true, ..one_thread() });
    assert!(bits(&fast) == bits(&plain), "fast and plain differ: {desc:#?}");
    fast
}

fn corner_light(at: V, strength: f64) -> LightDesc {
    LightDesc::Point(point(at, strength))
}

fn area_light(at: V, size: f64, strength: f64) -> LightDesc {
    let light = rectangle(at, [size, 0.0, 0.0], [0.0, 0.0, size], SampleSet::Sobol, 20);
    LightDesc::Rectangle(RectangleDesc { strength, ..light })
}

/// Where and how the copies stand: whole steps, quarter turns, sizes that are powers of two.
const COPIES: [(V, V, f64); 5] = [
    ([-2.5, 0.0, 0.0], [0.0, 0.0, 0.0], 1.0),
    ([2.5, 0.25, 0.0], [0.0, 90.0, 0.0], 0.5),
    ([0.0, 1.5, -2.0], [90.0, 0.0, 0.0], 1.0),
    ([0.0, -1.0, 2.0], [0.0, 0.0, 180.0], 0.25),
    ([0.5, 2.0, 1.0], [0.0, -90.0, 90.0], 0.5),
];

fn things() -> Vec<ShapeDesc> {
    let random = &mut Random::new(3);
    vec![
        ShapeDesc::Sphere(sphere([0.0, 1.0, 0.0], 0.5)),
        ShapeDesc::Box(BoxDesc { size: [1.0, 0.5, 0.75], ..BoxDesc::new([-1.0, 0.0, 0.0]) }),
        ShapeDesc::Torus(TorusDesc { axis: [0.0, 1.0, 0.5], ..TorusDesc::new([0.5, 0.0, 0.5], 0.75, 0.25) }),
        ShapeDesc::Mesh(ball_mesh(0.6, 9, 0.15, true, random)),
    ]
}

/// The same things by instances, and written out, in [`COPIES`].
fn by_instances_and_written_out(things: &[ShapeDesc]) -> [SceneDesc; 2] {
    let base = empty(64, 48, 1)
        .with_camera(camera([1.0, 3.0, 9.0], [0.0, 0.3, 0.0], 45.0))
        .with_parallelogram(square([0.0, -2.0, 0.0], [0.0, 1.0, 0.0], 8.0))
        .lit_by(&[corner_light([3.0, 6.0, 5.0], 30.0), area_light([-2.0, 5.0, 1.0], 1.0, 20.0)]);
    let mut instances = base.clone().with_group("things", things.to_vec());
    let mut written = base;
    for (at, turn, size) in COPIES {
        instances = instances.with_shape(moved(instance("things"), at, turn, [size; 3]));
    }
    for thing in things {
        for (at, turn, size) in COPIES {
            written = written.with_shape(moved(thing.clone(), at, turn, [size; 3]));
        }
    }
    [instances, written]
}

#[test]
fn solids_of_instances_are_copies_to_the_bit() {
    // What is no mesh is placed the same way, by an instance or by itself
    let things: Vec<_> = things().into_iter().filter(|thing| !matches!(thing, ShapeDesc::Mesh(_))).collect();
    let [instances, written] = by_instances_and_written_out(&things).map(|desc| both(&desc));
    assert!(lit(&instances) > 1000);
    assert!(bits(&instances) == bits(&written), "{} pixels differ", differing(&instances, &written, 0.0));
}

#[test]
fn meshes_of_instances_are_copies() {
    // A mesh by itself is taken to the world vertex by vertex and rounded to f32 there; a ray is taken to the instance.
    // So the last bits differ: of hits, and at silhouettes and edges of shadows what is hit at all
    let [instances, written] = by_instances_and_written_out(&things()).map(|desc| both(&desc));
    assert!(lit(&instances) > 1000);
    let wrong = differing(&instances, &written, 2e-5);
    assert!(wrong <= instances.pixels.len() / 100, "{wrong} pixels differ");
}

#[test]
fn instances_of_instances_are_moved_twice() {
    // Outside and inside do not commute
    let (inner, inner_turn, inner_scale) = ([1.0, 0.5, 0.0], [90.0, 0.0, 0.0], [1.0, 0.5, 2.0]);
    let (outer, outer_turn, outer_scale) = ([-0.5, 0.25, 1.0], [0.0, 90.0, 0.0], [0.5, 2.0, -1.0]);
    // Turned by a quarter about x: y to z, z to -y; about y: z to x, x to -z
    let first = |[x, y, z]: V| add([x, -2.0 * z, 0.5 * y], inner);
    let second = |[x, y, z]: V| add([-z, 2.0 * y, -0.5 * x], outer);
    let both_ways = |p: V| second(first(p));
    let origin = both_ways([0.0; 3]);
    let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| sub(both_ways(axis), origin));
    let row = |i: usize| [columns[0][i], columns[1][i], columns[2][i], origin[i]];
    let matrix = [row(0), row(1), row(2)].concat().try_into().expect("three rows of four");
    let mut once = instance("things");
    *common(&mut once).transform = Some(Box::new(TransformDesc { matrix: Some(matrix), ..TransformDesc::default() }));
    let base = empty(48, 48, 1)
        .with_camera(camera([3.0, 4.0, 8.0], [0.0; 3], 45.0))
        .lit_by(&[corner_light([4.0, 6.0, 5.0], 40.0), area_light([-2.0, 5.0, 1.0], 1.0, 20.0)])
        .with_group("things", things())
        .with_group("turned", vec![moved(instance("things"), inner, inner_turn, inner_scale)]);
    let twice = both(&base.clone().with_shape(moved(instance("turned"), outer, outer_turn, outer_scale)));
    let once = both(&base.with_shape(once));
    assert!(lit(&twice) > 200, "{}", lit(&twice));
    let wrong = differing(&twice, &once, 2e-5);
    assert!(wrong <= 8, "{wrong} pixels differ");
}

#[test]
fn ids_of_instances_are_in_scene_order() {
    let descs = by_instances_and_written_out(&things());
    let [instances, written] = descs.map(|desc| compile(&desc));
    let (kinds, copies) = (things().len() as u32, COPIES.len() as u32);
    // The floor and the lights have ids too
    assert_eq!([instances.surfaces(), written.surfaces()], [3 + (kinds * copies) as usize; 2]);
    let random = &mut Random::new(4);
    let (mut met, mut other) = (vec![0; (kinds * copies) as usize], 0);
    for _ in 0..40_000 {
        let eye = mul(random.direction(), 8.0);
        let way = unit(sub(random.vector(3.0), eye));
        let [o, d] = [eye, way].map(|v| Vec3::from_array(v.map(|x| x as f32)));
        let ray = WorldRay { o: o.as_dvec3(), d: d.normalize() };
        let [a, b] = [&instances, &written].map(|scene| scene.intersect(&ray));
        // What comes first in the text of the scene, kind by kind, is the floor in the one and a sphere in the other:
        // number the things without it
        let floor_of_written = copies;
        match (a, b) {
            (Some(a), Some(b)) => {
                // The floor has id 0 where all else is in instances
                let of_a = a.surface.0.checked_sub(1).map(|id| (id % kinds, id / kinds));
                let of_b = match b.surface.0 {
                    id if id == floor_of_written => None,
                    id if id > floor_of_written => Some(((id - 1) / copies, (id - 1) % copies)),
                    id => Some((id / copies, id % copies)),
                };
                other += u32::from(of_a != of_b || (a.t - b.t).abs() > 1e-5);
                if let Some((kind, copy)) = of_a {
                    met[(kind * copies + copy) as usize] += 1;
                }
            }
            (a, b) => other += u32::from(a.is_some() != b.is_some()),
        }
    }
    assert!(met.iter().all(|times| *times > 20), "not all were met: {met:?}");
    assert!(other <= 4, "{other} rays of 40000 meet something else");
}

#[test]
fn a_mirrored_thing_has_the_mirrored_picture() {
    for (normals, in_group) in [(false, true), (true, true), (false, false), (true, false)] {
        let ball = ball_mesh(1.0, 14, 0.2, normals, &mut Random::new(5));
        let ball = MeshDesc { single_sided: true, ..ball };
        let scene = |x: f64| {
            let eye = [x * 2.0, 1.0, 4.0];
            let base = empty(48, 48, 1)
                .with_camera(camera_up(eye, [0.0; 3], [0.0, 1.0, 0.0], 40.0))
                .with_light(corner_light([x * 4.0, 3.0, 3.0], 20.0))
                .with_light(corner_light([x * -3.0, 1.0, 0.5], 5.0));
            let place = |shape| moved(shape, [x * 0.25, 0.0, 0.0], [0.0, 0.0, 0.0], [x, 1.0, 1.0]);
            match in_group {
                true => {
                    base.with_group("ball", vec![ShapeDesc::Mesh(ball.clone())]).with_shape(place(instance("ball")))
                }
                false => base.with_shape(place(ShapeDesc::Mesh(ball.clone()))),
            }
        };
        let [straight, mut mirrored] = [1.0, -1.0].map(|x| both(&scene(x)));
        for row in mirrored.pixels.chunks_mut(48) {
            row.reverse();
        }
        // The front is outside: one-sided, it is seen, and lit
        assert!(lit(&straight) > 500, "{}: normals {normals}", lit(&straight));
        let wrong = differing(&straight, &mirrored, 2e-5);
        assert!(wrong <= 12, "{wrong} pixels differ, normals {normals}, in a group {in_group}");
    }
}

#[test]
fn a_million_instances_of_one_triangle() {
    let row = |of: &str, step: V| -> Vec<ShapeDesc> {
        let place = |i: u32| moved(instance(of), mul(step, i as f64 - 49.5), [0.0; 3], [1.0; 3]);
        (0..100).map(place).collect()
    };
    let triangle = mesh(vec![[0.0; 3], [0.7, 0.0, 0.0], [0.0, 0.7, 0.0]], vec![[0, 1, 2]]);
    let mut scene = empty(32, 32, 1)
        .with_camera(camera([3.0, 2.0, 90.0], [0.0; 3], 50.0))
        .with_group("one", vec![ShapeDesc::Mesh(triangle)])
        .with_group("row", row("one", [1.0, 0.0, 0.0]))
        .with_group("wall", row("row", [0.0, 1.0, 0.0]))
        .with_light(corner_light([20.0, 30.0, 120.0], 1e4));
    for shape in row("wall", [0.01, 0.02, -1.0]) {
        scene = scene.with_shape(shape);
    }
    let scene = compile(&scene);
    let summary = scene.summary();
    assert_eq!((summary.placed, summary.triangles), (1_000_000, 1));
    // A place and a box for each
    let [geometry, trees] = summary.geometry_bytes;
    assert!(geometry < 10_000 && trees < 400_000_000, "{geometry} and {trees} bytes");
    let whole = picture(&scene, &RenderSettings { threads: NonZeroUsize::new(2), ..RenderSettings::default() });
    assert!(lit(&whole) > 300, "{}", lit(&whole));
    let crop = Some(Window { x: 10, y: 12, width: 9, height: 8 });
    let [fast, plain] =
        [false, true].map(|reference| picture(&scene, &RenderSettings { reference, crop, ..every_ray() }));
    assert!(bits(&fast) == bits(&plain));
}

/// Shapes without hollows, about 1 in size around the origin, each with a group if it is an instance.
fn convex(size: f64) -> Vec<(&'static str, ShapeDesc, Option<ShapeDesc>)> {
    let s = |v: V| mul(v, size);
    let sphere = ShapeDesc::Sphere(sphere([0.0; 3], size));
    let cuboid = ShapeDesc::Box(BoxDesc { size: s([1.0, 1.5, 0.7]), ..BoxDesc::new([0.0; 3]) });
    let cylinder = ShapeDesc::Cylinder(CylinderDesc::new(s([-0.5, -0.5, 0.2]), s([0.4, 0.6, -0.1]), 0.6 * size));
    let cone = ShapeDesc::Cone(ConeDesc::new(s([-0.3, -0.6, 0.2]), s([0.2, 0.9, -0.1]), 0.8 * size));
    let frustum =
        ConeDesc { radius1: 0.3 * size, ..ConeDesc::new(s([0.1, -0.6, 0.2]), s([-0.2, 0.7, 0.3]), 0.8 * size) };
    let frustum = ShapeDesc::Cone(frustum);
    let disk = ShapeDesc::Disk(DiskDesc { normal: [0.3, 1.0, 0.2], ..DiskDesc::new([0.0; 3], size) });
    let board =
        RectangleShapeDesc { normal: [-0.2, 1.0, 0.3], ..RectangleShapeDesc::new([0.0; 3], [2.0 * size, size]) };
    let board = ShapeDesc::Rectangle(board);
    let plane = ShapeDesc::Plane(PlaneDesc { normal: [0.1, 1.0, 0.2], ..PlaneDesc::default() });
    // Flat faces that are planes whatever the rounding: triangles
    let tips =
        [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let faces = vec![[0, 2, 4], [4, 2, 1], [1, 2, 5], [5, 2, 0], [4, 3, 0], [1, 3, 4], [5, 3, 1], [0, 3, 5]];
    let crystal = ShapeDesc::Mesh(mesh(tips.iter().map(|tip| s(*tip)).collect(), faces));
    let turned = |shape: &ShapeDesc| moved(shape.clone(), [0.0; 3], [20.0, -50.0, 35.0], [1.0, 0.4, 1.7]);
    let grouped = |shape: &ShapeDesc| (turned(&instance("group")), Some(shape.clone()));
    let mut all = Vec::new();
    for (name, shape) in [
        ("sphere", sphere),
        ("box", cuboid),
        ("cylinder", cylinder),
        ("cone", cone),
        ("frustum", frustum),
        ("disk", disk),
        ("rectangle", board),
        ("plane", plane),
        ("crystal", crystal),
    ] {
        let (by_instance, group) = grouped(&shape);
        all.push((name, turned(&shape), None));
        all.push((name, by_instance, group));
        all.push((name, shape, None));
    }
    all
}

/// Moves it, after all else.
fn carried(mut shape: ShapeDesc, by: V) -> ShapeDesc {
    let transform = common(&mut shape).transform;
    let before = transform.take().map_or_else(TransformDesc::default, |transform| *transform);
    *transform = Some(Box::new(TransformDesc { translate: by, ..before }));
    shape
}

#[test]
fn what_has_no_hollows_never_shadows_itself() {
    let mut random = Random::new(21);
    let random = &mut random;
    let (mut seen, mut faults) = (0, Vec::new());
    for size in [1e-6_f64, 1e-3, 0.1, 1.0, 30.0, 1e3, 1e6] {
        for far in [0.0_f64, 3.0, 1e3, 1e5] {
            // No coordinate may pass 2.5e8
            let middle = mul(random.direction(), f64::min(size * far, 1e8));
            for (name, shape, group) in convex(size) {
                for _ in 0..times(2).min(400) {
                    // Outside of it: who is inside a thing sees its shadowed side
                    let mut above = |up: f64| {
                        let way = unit(add(random.direction(), [0.0, up, 0.0]));
                        add(middle, mul(way, size * random.between(2.2, 6.0)))
                    };
                    let (eye, a, b) = (above(0.8), above(0.5), above(0.9));
                    let side = (size * 0.5).max(2e-9);
                    let area = rectangle(b, [side, 0.0, 0.0], [0.0, 0.0, side], SampleSet::Sobol, 20);
                    let mut desc = empty(10, 10, 1)
                        .with_camera(camera(eye, middle, random.scale(5.0, 50.0)))
                        .with_light(corner_light(a, size * size))
                        .with_light(LightDesc::Rectangle(RectangleDesc {
                            sides: Some(firstlight::EmitSides::Both),
                            ..area
                        }));
                    if let Some(group) = &group {
                        desc = desc.with_group("group", vec![group.clone()]);
                    }
                    let mut shape = carried(shape.clone(), middle);
                    let with = both(&desc.clone().with_shape(shape.clone()));
                    *common(&mut shape).casts_shadow = false;
                    let without = both(&desc.clone().with_shape(shape.clone()));
                    seen += lit(&without);
                    let wrong = differing(&with, &without, 0.0);
                    if wrong > 0 {
                        let kind = if group.is_some() { "instance of" } else { "" };
                        faults.push(format!("{kind} {name} of {size}, {far} sizes away: {wrong} pixels\n"));
                    }
                }
            }
        }
    }
    assert!(seen > 10_000, "only {seen} pixels are lit at all");
    assert!(faults.is_empty(), "{} shadow themselves:\n{}", faults.len(), faults.concat());
}

/// Two boards side by side over a floor, as two meshes that are joined: `left` from x = -2 to 0, `right` from 0 to 2,
/// seen from above under a light high up.
fn boards(change: impl Fn(&mut MeshDesc, &mut MeshDesc), in_group: bool) -> SceneDesc {
    let board = |x: f64| {
        // Faces up
        let corners = vec![[x, 1.0, -2.0], [x, 1.0, 2.0], [x + 2.0, 1.0, 2.0], [x + 2.0, 1.0, -2.0]];
        MeshDesc { material: Some("board".into()), ..mesh(corners, vec![[0, 1, 2], [0, 2, 3]]) }
    };
    let (mut left, mut right) = (board(-2.0), board(0.0));
    change(&mut left, &mut right);
    let meshes = [left, right].map(ShapeDesc::Mesh);
    let scene = empty(1, 1, 1)
        .with_material("board", matte(0.25))
        .with_parallelogram(square([0.0; 3], [0.0, 1.0, 0.0], 10.0))
        .with_light(LightDesc::Directional(directional([0.0, -1.0, 0.0], 1.0)));
    match in_group {
        true => scene.with_group("boards", meshes.to_vec()).with_shape(instance("boards")),
        false => meshes.into_iter().fold(scene, |scene, mesh| scene.with_shape(mesh)),
    }
}

#[test]
fn every_mesh_of_several_keeps_its_own_flags() {
    // What is seen, by its brightness: the floor in the light is 0.8 / pi, a board 0.25 / pi
    let look =
        |scene: &SceneDesc, from: V, at: V| (probe(scene, from, at)[0] as f64 * std::f64::consts::PI * 100.0).round();
    let (floor, board, dark) = (80.0, 25.0, 0.0);
    for in_group in [false, true] {
        let check = |change: &dyn Fn(&mut MeshDesc, &mut MeshDesc), expected: [f64; 4], what: &str| {
            let scene = boards(change, in_group);
            // Each board from above, then the floor below each, from aside and below the boards
            let seen = [-1.0, 1.0].map(|x| look(&scene, [x, 5.0, 0.1], [x, 1.0, 0.1]));
            let under = [-1.0, 1.0].map(|x| look(&scene, [x, 0.5, 4.0], [x, 0.0, 0.1]));
            assert_eq!([seen[0], seen[1], under[0], under[1]], expected, "{what}, in a group: {in_group}");
        };
        check(&|_, _| {}, [board, board, dark, dark], "as it is");
        check(&|_, right| right.visible = false, [board, dark, dark, dark], "invisible");
        check(&|left, _| left.casts_shadow = false, [board, board, floor, dark], "casts no shadow");
        let ghost = |_: &mut MeshDesc, right: &mut MeshDesc| (right.visible, right.casts_shadow) = (false, false);
        check(&ghost, [board, floor, dark, floor], "neither");
        let all = |left: &mut MeshDesc, right: &mut MeshDesc| (left.visible, right.visible) = (false, false);
        check(&all, [dark, dark, dark, dark], "both invisible");
        let none = |left: &mut MeshDesc, right: &mut MeshDesc| (left.casts_shadow, right.casts_shadow) = (false, false);
        check(&none, [board, board, floor, floor], "neither casts");
        // From below, one-sided boards are not there: the lamp above would be seen, were it not directional
        for single_sided in [false, true] {
            let scene = boards(|_, right| right.single_sided = single_sided, in_group)
                .with_parallelogram(square([1.0, 3.0, 0.0], [0.0, 1.0, 0.0], 0.4))
                .with_light(corner_light([1.0, 2.0, 0.0], 100.0));
            let up = probe(&scene, [1.0, 0.5, 0.1], [1.0, 3.0, 0.1])[0];
            assert_eq!(up > 1.0, single_sided, "{up}");
            // It blocks the light of the lamp all the same
            assert_eq!(look(&scene, [1.0, 0.5, 4.0], [1.0, 0.0, 0.1]), dark);
        }
        // Under a roof, what receives no shadow is lit
        let scene = boards(|left, _| left.receives_shadow = false, in_group).with_parallelogram(square(
            [0.0, 2.0, 0.0],
            [0.0, 1.0, 0.0],
            3.0,
        ));
        let seen = [-1.0, 1.0].map(|x| look(&scene, [x, 1.5, 4.0], [x, 1.0, 0.1]));
        assert_eq!(seen, [board, dark], "in a group: {in_group}");
    }
}

#[test]
fn an_instance_hands_its_flags_on() {
    let flagged = |change: &dyn Fn(Common<'_>)| {
        let mut scene = boards(|_, _| {}, true);
        change(common(scene.shapes.last_mut().expect("the instance")));
        let seen = probe(&scene, [-1.0, 5.0, 0.1], [-1.0, 1.0, 0.1])[0] > 0.0;
        let under = probe(&scene, [-1.0, 0.5, 4.0], [-1.0, 0.0, 0.1])[0] > 0.0;
        let below = probe(&scene.with_light(corner_light([0.0, 0.5, 3.0], 1.0)), [-1.0, 0.2, 0.1], [-1.0, 1.0, 0.1])[0];
        [seen, under, below > 0.0]
    };
    assert_eq!(flagged(&|_| {}), [true, false, true]);
    assert_eq!(flagged(&|all| *all.visible = false), [false, false, false]);
    assert_eq!(flagged(&|all| *all.casts_shadow = false), [true, true, true]);
    assert_eq!(flagged(&|all| *all.single_sided = true), [true, false, false]);
}

/// A binary PLY file.
fn ply(positions: &[V], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        positions.len(),
        triangles.len()
    )
    .into_bytes();
    for x in positions.iter().flatten() {
        bytes.extend((*x as f32).to_le_bytes());
    }
    for triangle in triangles {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes
}

/// A name, positions and triangles.
type Hostile = (&'static str, Vec<V>, Vec<[u32; 3]>);

#[test]
fn hostile_triangles_change_no_bit() {
    let ball = ball_mesh(1.0, 16, 0.1, false, &mut Random::new(8));
    let vertices = ball.positions.len() as u32;
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    let own = |i: usize| ball.triangles[i];
    let positions = |more: &[V]| [ball.positions.as_slice(), more].concat();
    let cases: [Hostile; 5] = [
        ("without area", vec![], (0..60).map(|i| [i, i, i + 1]).chain((0..60).map(|i| [i; 3])).collect()),
        ("lines", vec![[-2.0; 3], [0.0; 3], [2.0; 3]], vec![[vertices, vertices + 1, vertices + 2]; 3]),
        // Of two at the same distance the first is taken
        ("twice", vec![], (0..ball.triangles.len()).map(own).collect()),
        ("nowhere", vec![[nan; 3], [inf, 0.0, 0.0], [0.0, -inf, nan]], {
            let n = vertices;
            vec![[0, 1, n], [n, n + 1, n + 2], [5, n + 1, 9], [n + 2, 3, 70], [n, n, n]]
        }),
        // Inside, where nobody looks
        ("slivers", vec![[-0.5, 0.1, 0.0], [0.5, 0.1, 0.0], [0.0, 0.1, 1e-30], [0.1, 0.1 + 1e-7, 0.0]], {
            let n = vertices;
            vec![[n, n + 1, n + 2], [n, n + 1, n + 3], [n + 2, n + 3, n]]
        }),
    ];
    let shoot = |positions: &[V], triangles: &[[u32; 3]], in_group: bool| {
        let file = MeshDesc { file: Some(firstlight::FilePath("ball.ply".into())), ..MeshDesc::default() };
        let base = empty(40, 40, 1)
            .with_camera(camera([2.0, 1.5, 4.0], [0.0; 3], 35.0))
            .with_parallelogram(square([0.0, -1.2, 0.0], [0.0, 1.0, 0.0], 4.0))
            .lit_by(&[corner_light([3.0, 4.0, 2.0], 20.0), area_light([-1.0, 3.0, 1.0], 1.0, 10.0)]);
        let desc = match in_group {
            true => base.with_group("ball", vec![ShapeDesc::Mesh(file)]).with_shape(instance("ball")),
            false => base.with_shape(ShapeDesc::Mesh(file)),
        };
        let assets = MemoryAssets { files: [("ball.ply".to_owned(), ply(positions, triangles))].into() };
        let scene = desc.compile(&assets, &CompileOptions::default()).expect("it compiles").scene;
        let fast = picture(&scene, &every_ray());
        assert!(bits(&fast) == bits(&picture(&scene, &RenderSettings { reference: true, ..one_thread() })));
        fast
    };
    for in_group in [false, true] {
        let clean = shoot(&ball.positions, &ball.triangles, in_group);
        assert!(lit(&clean) > 600);
        for (what, more, extra) in &cases {
            let triangles = [ball.triangles.as_slice(), extra].concat();
            let hostile = shoot(&positions(more), &triangles, in_group);
            let wrong = differing(&clean, &hostile, 0.0);
            assert_eq!(wrong, 0, "{what}: {wrong} pixels differ, in a group: {in_group}");
            assert!(bits(&clean) == bits(&hostile), "{what}");
        }
    }
}

#[test]
fn many_shapes_give_the_bits_of_few() {
    // Forty shapes are asked one by one, a hundred by a tree
    for seed in 0..12 {
        let mut random = Random::new(900 + seed);
        let random = &mut random;
        let mut few = empty(24, 24, 1)
            .with_material("shiny", phong(firstlight::ColorParam::gray(0.5), firstlight::ColorParam::gray(0.4), 30.0))
            .with_camera(camera([0.0, 2.0, 9.0], [0.0; 3], 60.0))
            .with_parallelogram(square([0.0, -2.0, 0.0], [0.0, 1.0, 0.0], 8.0))
            .lit_by(&[
                corner_light(add([0.0, 5.0, 0.0], random.vector(2.0)), 20.0),
                area_light([1.0, 6.0, 2.0], 2.0, 10.0),
                LightDesc::Directional(directional(sub(random.vector(0.5), [0.0, 1.0, 0.0]), 0.5)),
            ]);
        for _ in 0..30 {
            let ball =
                SphereDesc { material: Some("shiny".into()), ..sphere(random.vector(3.0), random.scale(0.05, 1.5)) };
            few = few.with_sphere(SphereDesc {
                visible: !random.chance(0.1),
                casts_shadow: !random.chance(0.1),
                single_sided: random.chance(0.1),
                ..ball
            });
        }
        for _ in 0..9 {
            few = few.with_parallelogram(parallelogram(random.vector(3.0), random.vector(1.0), random.vector(1.0)));
        }
        // Far behind the camera, and away from all lights
        let mut many = few.clone();
        for _ in 0..60 {
            let at = add([0.0, -500.0, 1000.0], random.vector(200.0));
            many = match random.chance(0.5) {
                true => many.with_sphere(sphere(at, 1.0)),
                false => many.with_parallelogram(square(at, [0.0, 1.0, 0.0], 1.0)),
            };
        }
        let [few, many] = [few, many].map(|desc| both(&desc));
        assert!(lit(&few) > 200, "{}", lit(&few));
        assert!(bits(&few) == bits(&many), "seed {seed}: {} pixels differ", differing(&few, &many, 0.0));
    }
}

#[test]
fn tangents_are_the_steps_from_one_hit_to_the_next() {
    let random = &mut Random::new(11);
    let turn = |shape: ShapeDesc| moved(shape, [0.1, -0.2, 0.3], [20.0, 30.0, 40.0], [0.8, 1.1, 0.9]);
    let flat = parallelogram([-1.0, -1.0, 0.0], [2.0, 0.3, 0.1], [0.2, 2.0, -0.4]);
    let shapes = [
        ShapeDesc::Sphere(sphere([0.0; 3], 1.0)),
        turn(ShapeDesc::Sphere(sphere([0.0; 3], 1.0))),
        ShapeDesc::Parallelogram(flat),
        turn(ShapeDesc::Torus(TorusDesc::new([0.0; 3], 0.75, 0.25))),
        ShapeDesc::Mesh(ball_mesh(1.0, 6, 0.1, true, random)),
    ];
    for shape in shapes {
        let desc = empty(64, 64, 1)
            .with_camera(camera([0.0, 0.0, 3.0], [0.0; 3], 40.0))
            .with_shape(shape)
            .lit_by(&[corner_light([0.0, 5.0, 5.0], 1.0)]);
        let scene = compile(&desc);
        let step = 1.0 / 256.0;
        let mut compared = 0;
        for _ in 0..400 {
            let (x, y) = (random.between(20.0, 44.0) as f32, random.between(20.0, 44.0) as f32);
            let see = |x: f32, y: f32| {
                let (ray, differential) = scene.camera().ray(x, y, step);
                scene.intersect(&ray).map(|hit| (scene.surface(&ray, &hit, &differential), hit, ray))
            };
            let (Some((a, hit, ray)), Some((b, other, _))) = (see(x, y), see(x + step, y)) else { continue };
            // The same triangle, and not seen edge-on
            if scene.primitive(&hit) != scene.primitive(&other) || a.ng.dot(a.wo) < 0.2 {
                continue;
            }
            let [u, v] = scene.tangents(&ray, &hit);
            let (duv, moved) = (b.uv - a.uv, (b.p - a.p).as_vec3());
            // Not across a seam
            if duv.length() > 0.1 {
                continue;
            }
            let wrong = (u * duv.x + v * duv.y - moved).length();
            assert!(wrong < 0.05 * moved.length() + 2e-6, "{desc:#?}: {wrong}, {moved}");
            compared += 1;
        }
        assert!(compared > 50, "{compared}: {desc:#?}");
    }
}
