//! From the faces, normals and colours of mesh files to what rays meet.

use std::fmt::Write as _;

use firstlight::{
    CastHit, CompileCache, CompileOptions, Compiled, DVec3, MemoryAssets, MeshData, MeshDesc, SceneDesc, ShapeDesc,
    Studio, StudioSettings, TransformDesc, Vec3, WorldRay,
};

use crate::scenes::*;

/// A scene with one mesh, `a.obj`, and that file.
fn compiled(mesh: MeshDesc, obj: &str, cache: Option<CompileCache>) -> Compiled {
    let desc = empty(40, 40, 1).with_shape(ShapeDesc::Mesh(mesh)).with_camera(camera([0.0, 0.0, 5.0], [0.0; 3], 30.0));
    let assets = MemoryAssets { files: [("a.obj".to_owned(), obj.as_bytes().to_vec())].into() };
    let compiled = desc.compile(&assets, &CompileOptions { strict: true, cache, ..CompileOptions::default() });
    compiled.unwrap_or_else(|error| panic!("{error}"))
}

fn file() -> MeshDesc {
    MeshDesc { file: Some("a.obj".into()), ..MeshDesc::default() }
}

/// What rays along -z meet that begin above these points.
fn seen_from_above(compiled: &Compiled, points: &[[f64; 2]]) -> Vec<Option<CastHit>> {
    let ray = |i: usize| WorldRay { o: DVec3::new(points[i][0], points[i][1], 3.0), d: Vec3::NEG_Z };
    compiled.scene.cast(points.len(), ray)
}

/// Points, given by two numbers each, in a plane that is tilted and shifted, as far as `digits` after the point say.
fn tilted(random: &mut Random, points: &[[f64; 2]], digits: usize) -> (Vec<V>, V) {
    let normal = random.direction();
    let [x, y] = across(normal);
    let shift = random.vector(1.0);
    let place = |p: &[f64; 2]| add(shift, add(mul(x, p[0]), mul(y, p[1])));
    let round = |x: f64| format!("{x:.digits$}").parse::<f64>().unwrap();
    (points.iter().map(|p| place(p).map(round)).collect(), normal)
}

fn obj(positions: &[V], faces: &[Vec<usize>]) -> String {
    let mut text = String::new();
    for [x, y, z] in positions {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for face in faces {
        text += "f";
        face.iter().for_each(|i| write!(text, " {i}").unwrap());
        text += "\n";
    }
    text
}

#[test]
fn polygons_that_share_a_corner_on_a_straight_edge_let_no_ray_through() {
    // A square of two triangles whose common edge has corners, in both of them; each face begins anywhere
    let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let mut random = Random::new(49);
    for tilt in 0..100 {
        let inner = 1 + tilt % 4;
        let mut points = square.to_vec();
        points.extend((1..=inner).map(|k| [2.0 * k as f64 / (inner + 1) as f64 - 1.0; 2]));
        let (positions, normal) = tilted(&mut random, &points, [6, 17][tilt % 2]);
        let mut faces = vec![vec![1, 2, 3], vec![3, 4, 1]];
        faces[0].extend((5..5 + inner).rev());
        faces[1].extend(5..5 + inner);
        for face in &mut faces {
            let begin = random.below(face.len() as u32) as usize;
            face.rotate_left(begin);
        }
        let compiled = compiled(file(), &obj(&positions, &faces), None);
        // Rays at that edge, from all around and from both sides
        let (from, to) = (DVec3::from(positions[0]), DVec3::from(positions[2]));
        let rays: Vec<WorldRay> = (0..4000)
            .map(|_| {
                let target = from + (to - from) * random.between(0.001, 0.999);
                let side = DVec3::from(normal) * random.pick(&[-2.0, 2.0]);
                let o = target + side + DVec3::from(random.vector(1.5));
                WorldRay { o, d: (target - o).as_vec3() }
            })
            .collect();
        let hits = compiled.scene.cast(rays.len(), |i| rays[i]);
        let through = hits.iter().filter(|hit| hit.is_none()).count();
        assert_eq!(through, 0, "of {} rays, tilt {tilt}: {faces:?} {positions:?}", rays.len());
        // And no facet of noise is among them
        let slanted = |hit: &CastHit| hit.ng.as_dvec3().dot(DVec3::from(normal)).abs() < 0.999;
        assert_eq!(hits.iter().flatten().filter(|hit| slanted(hit)).count(), 0, "tilt {tilt}");
    }
}

/// The three corners of the mesh of normals, and normals of unit length.
const CORNERS: [V; 3] = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]];
const NORMALS: [V; 3] = [[-0.6, 0.0, 0.8], [0.6, 0.0, 0.8], [0.0, 0.6, 0.8]];

/// The shading normals of a mesh of the three corners at many points, however it is given: as a file, as lists, as
/// numbers in memory, and transformed.
fn shading_normals(normals: [V; 3], points: &[[f64; 2]]) -> [Vec<Vec3>; 4] {
    let mut text = obj(&CORNERS, &[]);
    for [x, y, z] in normals {
        writeln!(text, "vn {x} {y} {z}").unwrap();
    }
    text += "f 1//1 2//2 3//3\n";
    let lists = MeshDesc { normals: normals.to_vec(), ..mesh(CORNERS.to_vec(), vec![[0, 1, 2]]) };
    let mut given = MeshData { triangles: vec![[0, 1, 2]], ..MeshData::default() };
    given.set_positions(3, |i| CORNERS[i]);
    given.normals = normals.map(|n| n.map(|x| x as f32)).to_vec();
    let cache = CompileCache::default();
    let given = MeshDesc { file: Some(cache.give_mesh(given).into()), ..MeshDesc::default() };
    let turned = TransformDesc { translate: [0.0, 0.0, -0.5], ..TransformDesc::default() };
    let moved = MeshDesc { transform: Some(Box::new(turned)), ..file() };
    let of = |mesh, cache| {
        let hits = seen_from_above(&compiled(mesh, &text, cache), points);
        hits.into_iter().map(|hit| hit.expect("a hit").ns).collect()
    };
    [of(file(), None), of(lists, None), of(given, Some(cache)), of(moved, None)]
}

/// Points within the triangle, and how much each corner counts there.
fn inner_points(random: &mut Random) -> (Vec<[f64; 2]>, Vec<[f64; 3]>) {
    let weights: Vec<[f64; 3]> = (0..100)
        .map(|_| {
            let w = [0; 3].map(|_| random.between(0.01, 1.0));
            w.map(|x| x / (w[0] + w[1] + w[2]))
        })
        .collect();
    let at = |w: &[f64; 3], axis: usize| (0..3).map(|i| w[i] * CORNERS[i][axis]).sum();
    (weights.iter().map(|w| [at(w, 0), at(w, 1)]).collect(), weights)
}

fn blend(normals: [V; 3], weights: [f64; 3]) -> Vec3 {
    let sum = (0..3).map(|i| DVec3::from(normals[i]) * weights[i]).sum::<DVec3>();
    sum.normalize().as_vec3()
}

#[test]
fn normals_of_any_length_are_blended_as_those_of_length_one() {
    let mut random = Random::new(4);
    let (points, weights) = inner_points(&mut random);
    for lengths in [[1.0, 1.0, 1.0], [1.0, 5.0, 1.0], [1e-20, 3.0, 1e15], [0.99, 1.0, 1.01]] {
        let normals = [0, 1, 2].map(|i| mul(NORMALS[i], lengths[i]));
        for found in shading_normals(normals, &points) {
            for (found, weights) in found.iter().zip(&weights) {
                let wanted = blend(NORMALS, *weights);
                assert!((*found - wanted).length() < 1e-5, "{lengths:?}: {found}, not {wanted}");
            }
        }
    }
}

#[test]
fn a_normal_without_a_direction_is_that_of_the_facet() {
    let mut random = Random::new(6);
    let (points, weights) = inner_points(&mut random);
    let [a, b, _] = NORMALS;
    let up = [0.0, 0.0, 1.0];
    for (normals, wanted) in [([a, b, [0.0; 3]], [a, b, up]), ([a, [0.0; 3], [0.0; 3]], [a, up, up])] {
        for found in shading_normals(normals, &points) {
            for (found, weights) in found.iter().zip(&weights) {
                assert!((*found - blend(wanted, *weights)).length() < 1e-5, "{found} {weights:?}");
            }
        }
    }
    // All of them: flat
    assert!(shading_normals([[0.0; 3]; 3], &points).iter().flatten().all(|found| *found == Vec3::Z));
}

#[test]
fn a_smooth_mesh_whose_faces_are_turned_at_random_is_as_smooth() {
    let ball = ball_mesh(1.0, 24, 0.1, false, &mut Random::new(1));
    let mut random = Random::new(2);
    let mut turned = ball.clone();
    turned.triangles.iter_mut().filter(|_| random.chance(0.4)).for_each(|t| t.swap(1, 2));
    let points: Vec<[f64; 2]> = (0..2000).map(|_| [random.between(-0.6, 0.6), random.between(-0.6, 0.6)]).collect();
    let smooth = |mesh: &MeshDesc| MeshDesc { smooth_deg: Some(60.0), ..mesh.clone() };
    let [right, found] = [&ball, &turned].map(|mesh| seen_from_above(&compiled(smooth(mesh), "", None), &points));
    for (right, found) in right.iter().flatten().zip(found.iter().flatten()) {
        assert!((right.ns - found.ns).length() < 1e-5, "{right:?} {found:?}");
        assert!(right.ns.dot(right.ng) < 1.0);
    }
    // What `info` says of it
    let mut data = MeshData { triangles: turned.triangles.clone(), ..MeshData::default() };
    data.set_positions(turned.positions.len(), |i| turned.positions[i]);
    assert!(data.report().turned_edges > 100);
}

#[test]
fn vertices_of_no_face_change_nothing() {
    let ball = ball_mesh(1.0, 12, 0.1, false, &mut Random::new(3));
    let faces: Vec<Vec<usize>> = ball.triangles.iter().map(|t| t.map(|v| v as usize + 1).to_vec()).collect();
    let clean = obj(&ball.positions, &faces);
    // After those that are used, so that no index changes
    let unused = "v nan 0 0\nv inf -inf inf\nv 1e30 1e30 1e30\nv 2e8 0 0 200 100 300\n";
    // Its own camera and light see all of it
    let picture_of = |text: &str| {
        let assets = MemoryAssets { files: [("a.obj".to_owned(), text.as_bytes().to_vec())].into() };
        let studio = StudioSettings { studio: Studio::Hard, ..StudioSettings::default() };
        let mut desc = SceneDesc::of_model("a.obj", &studio);
        (desc.render.width, desc.render.height) = (32, 32);
        let options = CompileOptions { strict: true, studio: Some(studio), ..CompileOptions::default() };
        let compiled = desc.compile(&assets, &options).unwrap_or_else(|error| panic!("{error}"));
        (bits(&picture(&compiled.scene, &one_thread())), compiled.advice, compiled.added)
    };
    assert_eq!(picture_of(&format!("{clean}{unused}")), picture_of(&clean));
    // Far from the origin all digits are kept as well
    let far: Vec<V> = ball.positions.iter().map(|p| add(*p, [4e6, 0.0, 0.0])).collect();
    let far = obj(&far, &faces);
    assert_eq!(picture_of(&format!("{far}v 0 0 0\n{unused}")), picture_of(&far));
    // In lists
    let mut listed = ball.clone();
    listed.positions.extend([[9e30, 0.0, 0.0], [0.0; 3]]);
    let mut colored = ball.clone();
    colored.colors = vec![[0.5; 3]; ball.positions.len()];
    let mut loud = MeshDesc { colors: colored.colors.clone(), ..listed.clone() };
    loud.colors.extend([[-1.0; 3], [2e9; 3]]);
    for (clean, unused) in [(ball, listed), (colored, loud)] {
        let [clean, unused] = [clean, unused].map(|mesh| compiled(mesh, "", None));
        assert_eq!(clean.advice, unused.advice);
        assert!(bits(&picture(&clean.scene, &one_thread())) == bits(&picture(&unused.scene, &one_thread())));
    }
}
