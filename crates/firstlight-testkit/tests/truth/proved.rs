//! Squares of pixels that are proved to see one thing: planes and flat facets, beside every camera ray lit by itself.

use firstlight::{NoAssets, Plane, PlaneDesc, RenderSettings, Scene, SceneDesc, ShapeDesc, TransformDesc};

use crate::converged::{Deviation, PROMISED, integrated};
use crate::exact_scenes;
use crate::scenes::*;

/// In display steps, at any pixel of the scenes of this page: beside every ray.
const WORST: f64 = 0.75;

const LIGHTS: &str = "[[light.rectangle]]\ncenter = [-2, 4, 2]\ne0 = [1, 0, 0]\ne1 = [0, 0, 1]\nstrength = 14\n\
                      [[light.disk]]\ncenter = [2, 5, 2]\nnormal = [0, -1, 0]\nradius = 0.6\nstrength = 9\n";
const SUN: &str = "[[light.directional]]\ndirection = [-0.4, -1, -0.3]\nstrength = 2\n";
const LAMP: &str = "[[light.sphere]]\ncenter = [-1, 2.5, 1]\nradius = 0.4\nstrength = 30\nvisible = true\n";
const BALL: &str = "[[sphere]]\ncenter = [0.2, 0.8, 0]\nradius = 0.8\n";
const ABOVE: &str = "position = [0, 3, 5]\nlook_at = [0, 0, 0]\nfov_y_deg = 40";
const HORIZON: &str = "position = [0, 1.5, 6]\nlook_at = [0, 1, 0]";
const CHECKER: &str = "[texture.checkerboard.tiles]\ncounts = [2, 2]\ncolors = [0.9, 0.2]\n\
                       [material.phong.tiled]\ndiffuse = { texture = \"tiles\" }\nspecular = 0.3\nshininess = 40\n";

/// A scene of 80 x 56 pixels.
fn scene(camera: &str, rest: &str) -> Scene {
    let text = format!(
        "[render]\nwidth = 80\nheight = 56\nantialiasing = 3\nambient = 0.1\nbackground = [0.1, 0.2, 0.4]\n\
         [camera]\n{camera}\n{rest}"
    );
    let parsed = SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets);
    assert_eq!(parsed.faults(), [], "{text}");
    compile(&parsed.desc)
}

/// How much work the picture takes, in the unit of `--heat`.
fn work(scene: &Scene) -> f64 {
    let settings = RenderSettings { buffers: vec![Plane::Color.into(), Plane::Rays.into()], ..integrated() };
    let std::ops::ControlFlow::Continue((film, _)) =
        firstlight::render(scene, &settings, &|_, _| std::ops::ControlFlow::Continue(()))
    else {
        unreachable!("nobody stops it")
    };
    film.heat().expect("it was asked for").mean_and_most().0
}

/// Holds the picture to what every ray sees.
#[track_caller]
fn as_every_ray(name: &str, scene: &Scene) {
    let (found, truth) = (picture(scene, &integrated()), picture(scene, &every_ray()));
    let Deviation { worst, at, .. } = Deviation::between(scene, 1.0, &truth, &found);
    assert!(worst < WORST, "{name}: {worst} steps at {at:?}");
}

#[test]
fn planes_are_lit_as_every_ray_sees_them() {
    let tiled = format!("{CHECKER}[[plane]]\nmaterial = \"tiled\"\n");
    let plane = "[[plane]]\n";
    let two = "[[plane]]\n[[plane]]\npoint = [0, 0, -2]\nnormal = [0.3, 0, 1]\n";
    let corner = format!("{two}[[plane]]\npoint = [-2, 0, 0]\nnormal = [1, 0.1, 0]\n");
    let pierced = "[[plane]]\n[[plane]]\npoint = [0, 0.5, 0]\nnormal = [0.2, 1, 0.1]\n";
    let moved = "[[plane]]\ntransform = { translate = [0, -0.5, 0], rotate_deg = [20, 30, 5], scale = [2, 0.5, -1] }\n";
    let placed = "[[group.floor.plane]]\n[[instance]]\nof = \"floor\"\n\
                  [[instance]]\nof = \"floor\"\ntransform = { translate = [0, 0, -3], rotate_deg = [80, 0, 0] }\n";
    let behind = "[[plane]]\nnormal = [0, -1, 0]\nsingle_sided = true\n[[plane]]\npoint = [0, -1, 0]\n";
    let unseen = "[[plane]]\nvisible = false\n[[plane]]\npoint = [0, -0.3, 0]\n";
    let solid = "[[plane]]\n[[box]]\ncenter = [0.7, 0.4, 0.9]\nsize = [0.8, 0.8, 0.8]\n";
    let wide = "projection = \"orthographic\"\nheight = 5\nposition = [0, 3, 5]\nlook_at = [0, 0, 0]";
    let along = "projection = \"orthographic\"\nheight = 4\nposition = [0, 0.5, 5]\nlook_at = [0, 0.5, 0]";
    let grazing = "position = [0, 0.01, 6]\nlook_at = [0, 0.3, 0]\nfov_y_deg = 30";
    let within = "position = [0, 0, 6]\nlook_at = [0, 0.3, 0]\nfov_y_deg = 30";
    let far = "position = [0, 300, 900]\nlook_at = [0, 0, 0]\nfov_y_deg = 0.3";
    let down = "position = [0, 6, 0.01]\nlook_at = [0, 0, 0]";
    for (name, camera, planes, rest) in [
        ("a floor", ABOVE, plane, LIGHTS),
        ("a ball on a floor", ABOVE, plane, &[BALL, LIGHTS].concat()),
        ("the horizon", HORIZON, plane, &[BALL, LIGHTS].concat()),
        ("the sun", HORIZON, plane, &[BALL, SUN].concat()),
        ("a lamp in the picture", HORIZON, plane, &[BALL, LAMP].concat()),
        ("a checkerboard to the horizon", HORIZON, &tiled, &[BALL, LIGHTS].concat()),
        ("a checkerboard", ABOVE, &tiled, &[BALL, SUN].concat()),
        ("two planes", HORIZON, two, &[BALL, LIGHTS].concat()),
        ("three planes", HORIZON, &corner, &[BALL, LIGHTS].concat()),
        ("planes that cross", ABOVE, pierced, LIGHTS),
        ("a plane that is moved", HORIZON, moved, &[BALL, LIGHTS].concat()),
        ("instances", HORIZON, placed, &[BALL, LIGHTS].concat()),
        ("seen from behind", HORIZON, behind, LIGHTS),
        ("an invisible one", HORIZON, unseen, &[BALL, LIGHTS].concat()),
        ("beside what lies in trees", ABOVE, solid, &[BALL, LIGHTS].concat()),
        ("orthographic", wide, plane, &[BALL, LIGHTS].concat()),
        ("orthographic, along the plane", along, plane, &[BALL, LIGHTS].concat()),
        ("edge-on", grazing, plane, &[BALL, LIGHTS].concat()),
        ("from within the plane", within, plane, &[BALL, LIGHTS].concat()),
        ("from afar", far, plane, &[BALL, LIGHTS].concat()),
        ("straight down", down, plane, LIGHTS),
    ] {
        as_every_ray(name, &scene(camera, &[planes, rest].concat()));
    }
}

#[test]
fn planes_are_lit_as_parallelograms_are_and_take_no_longer() {
    let flat = "[[parallelogram]]\np = [-50, 0, 50]\ne0 = [100, 0, 0]\ne1 = [0, 0, -100]\n";
    let wall = "[[parallelogram]]\np = [-50, -50, -2]\ne0 = [100, 0, 0]\ne1 = [0, 100, 0]\n";
    let walls = [flat, wall].concat();
    let across = "projection = \"orthographic\"\nheight = 5\nposition = [0, 3, 5]\nlook_at = [0, 0, 0]";
    for (camera, planes, flats, rest) in [
        (ABOVE, "[[plane]]\n", flat, ""),
        (ABOVE, "[[plane]]\n", flat, LIGHTS),
        (ABOVE, "[[plane]]\n", flat, &[BALL, LIGHTS].concat()),
        (ABOVE, "[[plane]]\n", flat, &[BALL, SUN].concat()),
        (ABOVE, "[[plane]]\n", flat, &[BALL, LAMP].concat()),
        (across, "[[plane]]\n", flat, &[BALL, LIGHTS].concat()),
        (HORIZON, "[[plane]]\n[[plane]]\npoint = [0, 0, -2]\nnormal = [0, 0, 1]\n", &walls, &[BALL, LIGHTS].concat()),
    ] {
        let (plane, flat) = (scene(camera, &[planes, rest].concat()), scene(camera, &[flats, rest].concat()));
        let Deviation { worst, at, .. } =
            Deviation::between(&plane, 1.0, &picture(&flat, &integrated()), &picture(&plane, &integrated()));
        assert!(worst < WORST, "{planes}{rest}: {worst} steps at {at:?}");
        // At the edge of a hard shadow, what may be in the way of a ball's shadow is known a little later
        let times = if rest.contains("directional") { 1.25 } else { 1.1 };
        let (is, may) = (work(&plane), times * work(&flat));
        assert!(is <= may, "{planes}{rest}: {is} rays for a pixel in place of {may}");
    }
}

#[test]
fn random_scenes_of_planes_are_lit_as_every_ray_sees_them() {
    let (mut pixels, mut over, mut planes) = (0, 0, 0);
    for seed in 0..60 {
        let mut desc = exact_scenes::scene(seed, 24);
        desc.render.antialiasing = desc.render.antialiasing.max(2);
        // Every plate goes on for ever
        for shape in &mut desc.shapes {
            let ShapeDesc::Parallelogram(flat) = &*shape else { continue };
            let normal = unit(cross(flat.e0, flat.e1));
            let mut plane = ShapeDesc::Plane(PlaneDesc { point: flat.p, normal, ..PlaneDesc::default() });
            *common(&mut plane).material = flat.material.clone();
            // Some of them by a transform
            if seed % 3 == 0 {
                let at = TransformDesc { translate: flat.p, ..TransformDesc::default() };
                let ShapeDesc::Plane(own) = &mut plane else { unreachable!("it was made one") };
                own.point = [0.0; 3];
                own.transform = Some(Box::new(at));
            }
            *shape = plane;
            planes += 1;
        }
        let scene = compile(&desc);
        let deviation =
            Deviation::between(&scene, 1.0, &picture(&scene, &every_ray()), &picture(&scene, &integrated()));
        assert!(deviation.worst <= PROMISED.worst, "{seed}: {deviation:?}");
        (pixels, over) = (pixels + deviation.pixels, over + deviation.over);
    }
    assert!(planes > 60 && over * 1000 <= pixels, "{planes} planes; {over} of {pixels} pixels are off");
}

/// A unit cube of twelve triangles around the origin, in a text: its corners, and more of a mesh.
fn cube(table: &str, more: &str) -> String {
    format!(
        "[[{table}]]\npositions = [[-0.5, -0.5, -0.5], [0.5, -0.5, -0.5], [0.5, 0.5, -0.5], [-0.5, 0.5, -0.5], \
         [-0.5, -0.5, 0.5], [0.5, -0.5, 0.5], [0.5, 0.5, 0.5], [-0.5, 0.5, 0.5]]\n\
         triangles = [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4], [2, 3, 7], [2, 7, 6], \
         [0, 4, 7], [0, 7, 3], [1, 2, 6], [1, 6, 5]]\n{more}\n"
    )
}

/// Two triangles of a wall of 8 x 8, with more of a mesh.
fn wall(more: &str) -> String {
    format!(
        "[[mesh]]\npositions = [[-4, -1, -1.5], [4, -1, -1.5], [4, 7, -1.5], [-4, 7, -1.5]]\n\
         triangles = [[0, 1, 2], [0, 2, 3]]\n{more}\n"
    )
}

const CORNER: &str = "position = [2, 1.5, 3]\nlook_at = [0, 0, 0]\nfov_y_deg = 35";

#[test]
fn flat_facets_are_lit_as_every_ray_sees_them() {
    let floor = "[[plane]]\npoint = [0, -0.5, 0]\n";
    let turned = "transform = { translate = [0.1, 0, 0], rotate_deg = [20, 30, 5], scale = [0.7, 1.2, -0.8] }";
    let group = format!("{}[[instance]]\nof = \"box\"\n{turned}\n", cube("group.box.mesh", ""));
    let crowd = format!("{group}{}", "[[instance]]\nof = \"box\"\ntransform = { translate = [0.9, 0, -0.4] }\n");
    let uvs = "uvs = [[0, 0], [6, 0], [6, 6], [0, 6]]\nmaterial = \"tiled\"";
    let one_normal = "normals = [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1]]";
    let normals = "normals = [[0.5, 0, 1], [-0.5, 0, 1], [-0.5, 0.5, 1], [0.5, 0.5, 1]]";
    let one_color = "colors = [[0.9, 0.2, 0.1], [0.9, 0.2, 0.1], [0.9, 0.2, 0.1], [0.9, 0.2, 0.1]]";
    let colors = "colors = [[0.9, 0.2, 0.1], [0.1, 0.2, 0.9], [0.1, 0.9, 0.1], [0.9, 0.9, 0.1]]";
    let tiled = |more: &str| format!("{CHECKER}{}", wall(more));
    for (name, text) in [
        ("a cube", cube("mesh", "")),
        ("a cube on a floor", [&cube("mesh", ""), floor].concat()),
        ("a cube that is moved", [&cube("mesh", turned), floor].concat()),
        ("an instance", [&group, floor].concat()),
        ("instances", [&crowd, floor].concat()),
        ("a wall behind a cube", [cube("mesh", ""), wall("")].concat()),
        (
            "a wall in front of a plane",
            [&wall(""), "[[plane]]\npoint = [0, 0, -1.6]\nnormal = [0.05, 0, 1]\n"].concat(),
        ),
        ("the same wall twice", [wall(""), wall("")].concat()),
        ("seen from one side", [cube("mesh", "single_sided = true"), wall("")].concat()),
        ("a cube that is not seen", [cube("mesh", "visible = false"), wall("")].concat()),
        ("a texture", tiled(uvs)),
        ("one normal", wall(one_normal)),
        ("blended normals", wall(normals)),
        ("one colour", wall(one_color)),
        ("blended colours", wall(colors)),
        (
            "beside a solid",
            [&wall(""), "[[torus]]\ncenter = [0, 0, -1]\nmajor_radius = 0.4\nminor_radius = 0.1\n"].concat(),
        ),
    ] {
        for lights in [LIGHTS, SUN] {
            as_every_ray(name, &scene(CORNER, &[&text, lights].concat()));
        }
    }
}

#[test]
fn a_flat_mesh_takes_little_longer_than_the_same_parallelograms() {
    let sides = [([1, 0, 0], [0, 1, 0]), ([0, 1, 0], [0, 0, 1]), ([0, 0, 1], [1, 0, 0])].map(|(e0, e1)| {
        let far: [i32; 3] = std::array::from_fn(|axis| 1 - e0[axis] - e1[axis]);
        [0, 1].map(|side| {
            let p: [f64; 3] = std::array::from_fn(|axis| f64::from(side * far[axis]) - 0.5);
            format!("[[parallelogram]]\np = {p:?}\ne0 = {e0:?}\ne1 = {e1:?}\n")
        })
    });
    let sides = sides.concat().concat();
    for lights in [LIGHTS, SUN] {
        let (mesh, flats) =
            (scene(CORNER, &[&cube("mesh", ""), lights].concat()), scene(CORNER, &[&sides, lights].concat()));
        let Deviation { worst, at, .. } =
            Deviation::between(&mesh, 1.0, &picture(&flats, &integrated()), &picture(&mesh, &integrated()));
        assert!(worst < WORST, "{lights}: {worst} steps at {at:?}");
        // Ray by ray it took ten times as long: of triangles the diagonals are left
        let (is, may) = (work(&mesh), 2.0 * work(&flats));
        assert!(is <= may, "{lights}: {is} rays for a pixel in place of {may}");
    }
}
