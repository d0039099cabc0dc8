//! Motion: against positions projected at both ends, by closed forms of what moves.

use std::num::NonZeroUsize;

use firstlight::*;

use crate::buffers::{film, floats};

fn at(text: &str, time: f64) -> Scene {
    let parsed = SceneDesc::parse("scene.toml", text.as_bytes(), &NoAssets);
    let options = CompileOptions { time, ..CompileOptions::default() };
    parsed.compile(&NoAssets, &options).unwrap_or_else(|e| panic!("{e}")).scene
}

fn of(buffers: &[Plane]) -> RenderSettings {
    RenderSettings { buffers: buffers.iter().map(|plane| (*plane).into()).collect(), ..RenderSettings::default() }
}

/// `motion`, pixel by pixel.
fn motion(scene: &Scene, plane: Plane) -> Vec<[f32; 3]> {
    floats(&film(scene, &of(&[plane])), plane).as_chunks().0.to_vec()
}

fn ids(scene: &Scene) -> Vec<u32> {
    match film(scene, &of(&[Plane::ObjectId])).numbers(Plane::ObjectId) {
        Some(PlaneNumbers::Wholes(ids)) => ids.to_vec(),
        other => panic!("{other:?}"),
    }
}

/// Of each pixel: where in its object's own space it is, in the world, and its object.
fn places(scene: &Scene) -> Vec<(DVec3, DVec3, u32)> {
    let planes = [Plane::PositionObject, Plane::Position];
    let film = film(scene, &of(&planes));
    let [own, world] = planes.map(|plane| {
        let numbers = floats(&film, plane).as_chunks::<3>().0;
        numbers.iter().map(|p| Vec3::from(*p).as_dvec3()).collect::<Vec<_>>()
    });
    own.into_iter().zip(world).zip(ids(scene)).map(|((own, world), id)| (own, world, id)).collect()
}

/// A projection as OpenCV has it, by the receipt's matrices: pixels right and down, and the depth.
fn projected(scene: &Scene, p: DVec3) -> [f64; 3] {
    let receipt = scene.buffers_receipt(&RenderSettings::default(), &[Plane::Depth.into()]);
    let numbers = |key: &str| -> Vec<f64> {
        let (_, value) = receipt.entries.iter().find(|(k, _)| k == key).unwrap();
        value.split(' ').map(|n| n.parse().unwrap()).collect()
    };
    let (k, e) = (numbers("intrinsics"), numbers("opencv_camera_from_world"));
    let row = |i: usize| e[i] * p.x + e[i + 1] * p.y + e[i + 2] * p.z + e[i + 3];
    let [x, y, z] = [row(0), row(4), row(8)];
    [k[0] * x / z + k[2], k[4] * y / z + k[5], z]
}

/// Around y, by degrees.
fn turned(v: DVec3, degrees: f64) -> DVec3 {
    let (sin, cos) = pxfm::f_sincos(degrees.to_radians());
    DVec3::new(cos * v.x + sin * v.z, v.y, cos * v.z - sin * v.x)
}

/// A bit of all that moves: a sphere that is shifted, one that grows into an ellipsoid, a wall that turns, meshes of
/// the world and of groups that are parented twice, a box, points, a light that is seen; a camera that moves, too.
const MOVING: &str = r#"
    [render]
    width = 120
    height = 90
    fps = 10
    MOTION
    [camera]
    position = [0.3, 0.7, 10]
    look_at = [0.1, 0, 0]
    fov_y_deg = 40
    shift = [0.1, -0.05]
    transform = { keys = [{ time = 0, translate = [0, 0, 0] }, { time = 1, translate = [0.5, 0.2, -1] }] }
    [[sphere]]
    center = [-2, 0, 0]
    radius = 0.8
    transform = { keys = [{ time = 0, translate = [0, 0, 0] }, { time = 1, translate = [1, 0.5, 2] }] }
    [[sphere]]
    center = [0, 0, 0]
    radius = 0.5
    transform = { translate = [-2, 1.9, 0], keys = [{ time = 0, scale = 1 }, { time = 1, scale = [1, 2, 3] }] }
    [[parallelogram]]
    p = [-4, -3, 0]
    e0 = [8, 0, 0]
    e1 = [0, 6, 0]
    transform = { translate = [0, 0, -4], keys = [
        { time = 0, rotate_deg = [0, 0, 0] }, { time = 1, rotate_deg = [0, 20, 0] },
    ] }
    [[box]]
    center = [0, 0, 0]
    size = [0.8, 0.8, 0.8]
    transform = { translate = [2.4, 1.2, 0], keys = [
        { time = 0, rotate_deg = [0, 10, 0] }, { time = 1, rotate_deg = [0, 60, 0] },
    ] }
    [[mesh]]
    positions = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    triangles = [[0, 1, 2], [0, 2, 3]]
    transform = { keys = [{ time = 0, translate = [0, 0.8, 1] }, { time = 1, translate = [-0.5, 1, 1.5] }] }
    [[point_set]]
    positions = [[0, 0, 0], [0.5, 0.1, 0]]
    radius = 0.2
    transform = { keys = [{ time = 0, translate = [-0.6, 2.2, 0] }, { time = 1, translate = [0, 2.2, 0] }] }
    [[instance]]
    of = "arm"
    transform = { translate = [0.8, -1.5, 0], keys = [
        { time = 0, rotate_deg = [0, 0, 0] }, { time = 1, rotate_deg = [0, 40, 0] },
    ] }
    [[group.arm.instance]]
    of = "hand"
    transform = { keys = [{ time = 0, translate = [0.5, 0, 0] }, { time = 1, translate = [0.5, 0.6, 0] }] }
    [[group.hand.mesh]]
    positions = [[-0.6, -0.6, 0.1], [0.6, -0.6, 0.1], [0, 0.8, 0.1]]
    triangles = [[0, 1, 2]]
    [[group.hand.torus]]
    center = [0, 0, 0]
    axis = [0, 0, 1]
    major_radius = 0.4
    minor_radius = 0.15
    [[light.rectangle]]
    center = [0, 0, 0]
    e0 = [0.8, 0, 0]
    e1 = [0, 0.6, 0]
    sides = "both"
    transform = { translate = [-2.5, -1.6, 0], keys = [
        { time = 0, rotate_deg = [0, 0, 0] }, { time = 1, rotate_deg = [0, 35, 0] },
    ] }
"#;

/// Where a point of an object is at a moment, by its place in its own space, or in the world at 0 s on the light.
fn moved(object: u32, own: DVec3, world_at_0: DVec3, time: f64) -> DVec3 {
    let v = DVec3::new;
    match object {
        1 => own + v(1.0, 0.5, 2.0) * time,
        2 => own * (DVec3::ONE + v(0.0, 1.0, 2.0) * time) + v(-2.0, 1.9, 0.0),
        3 => turned(own, 20.0 * time) + v(0.0, 0.0, -4.0),
        4 => turned(own, 10.0 + 50.0 * time) + v(2.4, 1.2, 0.0),
        5 => own + v(0.0, 0.8, 1.0) + v(-0.5, 0.2, 0.5) * time,
        6 => own + v(-0.6, 2.2, 0.0) + v(0.6, 0.0, 0.0) * time,
        7 | 8 => turned(own + v(0.5, 0.6 * time, 0.0), 40.0 * time) + v(0.8, -1.5, 0.0),
        9 => turned(world_at_0 - v(-2.5, -1.6, 0.0), 35.0 * time) + v(-2.5, -1.6, 0.0),
        other => panic!("there is no object {other}"),
    }
}

#[test]
fn it_is_the_way_between_positions_projected_at_both_times() {
    for (to, time) in [("0.5", 0.5), ("\"next\"", 0.1), ("\"previous\"", -0.1), ("1", 1.0)] {
        let here = at(&MOVING.replace("MOTION", &format!("motion_to = {to}")), 0.0);
        assert_eq!(here.motion_to(), Some(&MotionTo::Time(time)));
        let there = at(&MOVING.replace("MOTION", ""), time);
        let flow = motion(&here, Plane::Motion);
        let mut met = [0; 10];
        // Before the first key all is as at it
        let clamped = time.max(0.0);
        for ((own, world, object), [x, y, visible]) in places(&here).into_iter().zip(&flow) {
            met[object as usize] += 1;
            if object == 0 {
                continue;
            }
            let to = moved(object, own, world, clamped);
            let ([x0, y0, _], [x1, y1, z]) = (projected(&here, world), projected(&there, to));
            assert!(z > 0.0);
            let off = (f64::from(*x) - (x1 - x0)).abs().max((f64::from(*y) - (y1 - y0)).abs());
            assert!(off < 1e-3, "{to}: object {object}: {x} {y} are not {} {}", x1 - x0, y1 - y0);
            // What is seen there is the first on the way from the camera
            let (eye, inside) =
                (there.camera().frame().position, (0.0..120.0).contains(&x1) && (0.0..90.0).contains(&y1));
            let hit = there.intersect(&WorldRay { o: eye, d: (to - eye).normalize().as_vec3() });
            let gap = hit.map_or(0.0, |hit| (to - eye).length() - hit.t);
            if !inside || gap.abs() > 1e-3 {
                assert_eq!(*visible == 1.0, inside && gap < 0.0, "{to}: object {object} at {x1} {y1}, {gap}");
            } else if gap.abs() < 1e-5 {
                assert_eq!(*visible, 1.0, "{to}: object {object} at {x1} {y1}, {gap}");
            }
        }
        assert!(met[1..].iter().all(|pixels| *pixels > 15), "{met:?}");
        let count = |mark: f32| flow.iter().filter(|[_, _, visible]| *visible == mark).count();
        assert!(count(1.0) > 8000 && count(-1.0) == 0, "{} {}", count(1.0), count(-1.0));
        assert!(time < 0.5 || count(0.0) > 200);
    }
}

#[test]
fn backward_is_the_motion_of_the_other_picture() {
    for (time, to) in [(0.0, 0.7), (0.7, 0.2)] {
        let text = |to: f64| MOVING.replace("MOTION", &format!("motion_to = {to}"));
        let (here, there) = (at(&text(to), time), at(&text(time), to));
        // Both planes of one render, beside others
        let both = film(&here, &of(&[Plane::Motion, Plane::Depth, Plane::MotionBackward]));
        let bits = |numbers: &[f32]| numbers.iter().map(|n| n.to_bits()).collect::<Vec<_>>();
        assert!(bits(floats(&both, Plane::Motion)) == bits(motion(&here, Plane::Motion).as_flattened()));
        assert!(bits(floats(&both, Plane::MotionBackward)) == bits(motion(&there, Plane::Motion).as_flattened()));
        assert!(bits(motion(&there, Plane::MotionBackward).as_flattened()) == bits(floats(&both, Plane::Motion)));
    }
}

#[test]
fn there_and_back_again() {
    // Parallel rays and an affine motion: between pixels of one thing the way changes linearly
    let text = "[render]\nwidth = 80\nheight = 60\nmotion_to = 1\n[camera]\nposition = [0, 0, 10]\n\
        projection = \"orthographic\"\nheight = 6\n\
        [[parallelogram]]\np = [-9, -9, -3]\ne0 = [18, 0, 0]\ne1 = [0, 18, 0]\n\
        [[parallelogram]]\np = [-2, -1, 0]\ne0 = [3, 0, 0.5]\ne1 = [0, 2, 1]\n\
        transform = { keys = [{ time = 0, rotate_deg = [0, 0, 0] }, \
        { time = 1, rotate_deg = [12, 25, -8], translate = [0.5, 0.2, 0] }] }\n";
    let here = at(text, 0.0);
    let (forward, backward) = (motion(&here, Plane::Motion), motion(&here, Plane::MotionBackward));
    let objects = [ids(&here), ids(&at(&text.replace("motion_to = 1\n", ""), 1.0))];
    let mut compared = [0; 3];
    for (pixel, [x, y, visible]) in forward.iter().enumerate().filter(|(_, [_, _, visible])| *visible == 1.0) {
        assert_eq!(*visible, 1.0);
        let from = [(pixel % 80) as f64 + 0.5, (pixel / 80) as f64 + 0.5];
        let [u, v] = [from[0] + f64::from(*x) - 0.5, from[1] + f64::from(*y) - 0.5];
        let corner = [u.floor(), v.floor()];
        if corner[0] < 0.0 || corner[1] < 0.0 || corner[0] >= 79.0 || corner[1] >= 59.0 {
            continue;
        }
        let first = corner[1] as usize * 80 + corner[0] as usize;
        let corners = [first, first + 1, first + 80, first + 81];
        if corners.iter().any(|corner| objects[1][*corner] != objects[0][pixel] || backward[*corner][2] != 1.0) {
            continue;
        }
        let [a, b] = [u - corner[0], v - corner[1]];
        let weights = [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b];
        let back = |axis: usize| (0..4).map(|k| weights[k] * f64::from(backward[corners[k]][axis])).sum::<f64>();
        assert!((f64::from(*x) + back(0)).abs() < 1e-3 && (f64::from(*y) + back(1)).abs() < 1e-3, "{from:?}");
        compared[objects[0][pixel] as usize] += 1;
    }
    assert!(compared[1] > 2000 && compared[2] > 400, "{compared:?}");
}

/// A wall and, 2 m before it, a card of 1 m that moves to the right by 0.7 m in a second; ten pixels are a metre.
const CARD: &str = "[render]\nwidth = 60\nheight = 40\nmotion_to = 1\n[camera]\nposition = [0, 0, 10]\n\
    projection = \"orthographic\"\nheight = 4\n\
    [[parallelogram]]\np = [-5, -5, -2]\ne0 = [10, 0, 0]\ne1 = [0, 10, 0]\n\
    [[parallelogram]]\np = [-0.5, -0.5, 0]\ne0 = [1, 0, 0]\ne1 = [0, 1, 0]\n\
    transform = { keys = [{ time = 0, translate = [0, 0, 0] }, { time = 1, translate = [0.7, 0, 0] }] }\n";

#[test]
fn what_gets_hidden_is_marked_and_nothing_else() {
    let inside =
        |pixel: usize, left: usize| (left..left + 10).contains(&(pixel % 60)) && (15..25).contains(&(pixel / 60));
    let forward = motion(&at(CARD, 0.0), Plane::Motion);
    for (pixel, [x, y, visible]) in forward.into_iter().enumerate() {
        let is_card = inside(pixel, 25);
        assert!((x - if is_card { 7.0 } else { 0.0 }).abs() < 1e-5 && y == 0.0, "{pixel}: {x} {y}");
        assert_eq!(visible == 1.0, is_card || !inside(pixel, 32), "{pixel}");
    }
    // Of the picture a second later what the card covered was hidden
    let backward = motion(&at(CARD, 0.0), Plane::MotionBackward);
    for (pixel, [x, _, visible]) in backward.into_iter().enumerate() {
        let is_card = inside(pixel, 32);
        assert!((x + if is_card { 7.0 } else { 0.0 }).abs() < 1e-5);
        assert_eq!(visible == 1.0, is_card || !inside(pixel, 25), "{pixel}");
    }
    // Out of the picture on the right, by 70 pixels
    let gone = motion(&at(&CARD.replace("[0.7, 0, 0]", "[7, 0, 0]"), 0.0), Plane::Motion);
    for (pixel, [x, _, visible]) in gone.into_iter().enumerate() {
        let is_card = inside(pixel, 25);
        assert!(visible == f32::from(u8::from(!is_card)) && (!is_card || (x - 70.0).abs() < 1e-5), "{pixel}");
    }
}

#[test]
fn what_turns_away_hides_itself() {
    // Half a turn: the left comes from the front to the back, all of it
    let text = |shape: &str, degrees: f64| {
        format!(
            "[render]\nwidth = 40\nheight = 40\nmotion_to = 1\n[camera]\nposition = [0, 0, 10]\nfov_y_deg = 20\n\
             {shape}\ntransform = {{ keys = [{{ time = 0, rotate_deg = [0, 0, 0] }}, \
             {{ time = 1, rotate_deg = [0, {degrees}, 0] }}] }}\n"
        )
    };
    let ball = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1";
    let card = "[[parallelogram]]\np = [-1, -1, 0]\ne0 = [2, 0, 0]\ne1 = [0, 2, 0]";
    let one_sided = "[[parallelogram]]\np = [-1, -1, 0]\ne0 = [2, 0, 0]\ne1 = [0, 2, 0]\nsingle_sided = true";
    let front_light = "[[light.rectangle]]\ncenter = [0, 0, 0]\ne0 = [2, 0, 0]\ne1 = [0, 2, 0]\nsides = \"front\"";
    for (shape, degrees, seen) in [
        (ball, 180.0, false),
        (ball, 5.0, true),
        (card, 180.0, true),
        (card, 30.0, true),
        (one_sided, 180.0, false),
        (one_sided, 30.0, true),
        (front_light, 180.0, false),
        (front_light, 30.0, true),
    ] {
        let scene = at(&text(shape, degrees), 0.0);
        let (ids, flow) = (ids(&scene), motion(&scene, Plane::Motion));
        let (mut on, mut as_said) = (0, 0);
        for ([_, _, visible], _) in flow.iter().zip(&ids).filter(|(_, id)| **id == 1) {
            on += 1;
            as_said += usize::from((*visible == 1.0) == seen);
        }
        // Of a ball that turns a little one edge goes behind it
        assert!(
            on > 300 && as_said >= on - if degrees == 5.0 { 25 } else { 0 },
            "{shape} {degrees}: {as_said} of {on}"
        );
    }
}

#[test]
fn what_is_far_away_turns_with_the_camera_and_does_not_shift() {
    let text = |camera: &str| {
        format!(
            "[render]\nwidth = 50\nheight = 40\nmotion_to = 1\n[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\n\
             fov_y_deg = 50\ntransform = {{ keys = [{{ time = 0, {camera} }}, {{ time = 1, {} }}] }}\n\
             [[sphere]]\ncenter = [0, 0, -50]\nradius = 0.01\n",
            camera.replace('0', "3")
        )
    };
    let shifted = motion(&at(&text("translate = [0, 0, 0]"), 0.0), Plane::Motion);
    assert!(shifted.iter().all(|flow| *flow == [0.0, 0.0, 1.0]));
    // By three degrees around each axis: as with points a long way off
    let scene = at(&text("rotate_deg = [0, 0, 0]"), 0.0);
    let there = at(&text("rotate_deg = [0, 0, 0]").replace("motion_to = 1\n", ""), 1.0);
    for (pixel, [x, y, visible]) in motion(&scene, Plane::Motion).into_iter().enumerate() {
        let (i, j) = ((pixel % 50) as f32 + 0.5, (pixel / 50) as f32 + 0.5);
        let (ray, _) = scene.camera().ray(i, j, 1.0);
        let [u, v] = there.camera().project(ray.o + ray.d.as_dvec3() * 1e12).unwrap();
        assert!((u - f64::from(i) - f64::from(x)).abs() < 1e-3 && (v - f64::from(j) - f64::from(y)).abs() < 1e-3);
        let inside = (0.0..50.0).contains(&u) && (0.0..40.0).contains(&v);
        assert!((x, y) != (0.0, 0.0) && (visible == 1.0) == inside && visible >= 0.0, "{pixel}");
    }
}

#[test]
fn what_comes_behind_the_eye_has_no_place() {
    let text = |projection: &str| {
        format!(
            "[render]\nwidth = 30\nheight = 20\nmotion_to = 1\n[camera]\nposition = [0, 0, 5]\n{projection}\n\
             [[parallelogram]]\np = [-9, -9, 0]\ne0 = [18, 0, 0]\ne1 = [0, 18, 0]\n\
             transform = {{ keys = [{{ time = 0, translate = [0, 0, 0] }}, \
             {{ time = 1, translate = [0, 0, 5.5] }}] }}\n"
        )
    };
    assert!(motion(&at(&text(""), 0.0), Plane::Motion).iter().all(|flow| *flow == [0.0, 0.0, -1.0]));
    // Behind the film of an orthographic camera it is where it was, unseen
    let flow = motion(&at(&text("projection = \"orthographic\"\nheight = 3"), 0.0), Plane::Motion);
    assert!(flow.iter().all(|[x, y, visible]| x.abs() < 1e-5 && y.abs() < 1e-5 && *visible == 0.0));
    // Exactly in the plane of the eye, where a projection divides by 0
    let flow = motion(&at(&text("").replace("5.5", "5"), 0.0), Plane::Motion);
    assert!(flow.iter().flatten().all(|number| number.is_finite()) && flow.iter().all(|[.., visible]| *visible < 1.0));
}

#[test]
fn what_stands_still_does_not_move() {
    // Whatever else moves, and at whatever slant it is seen
    let still = "[render]\nwidth = 101\nheight = 101\nmotion_to = 1\n[camera]\nposition = [0, 0, 10]\n\
        [[sphere]]\ncenter = [-2, 0, 0]\nradius = 1\n\
        [[sphere]]\ncenter = [2, 0, 0]\nradius = 1\ntransform = { scale = [1, 1.5, 1] }\n\
        [[box]]\ncenter = [0, 0, -6]\nsize = [12, 4, 12]\n\
        [[cylinder]]\np0 = [0, 1.8, 0]\np1 = [0, 2.6, 0]\nradius = 0.4\n\
        [[mesh]]\npositions = [[-9, -3, 9], [9, -3, 9], [9, -3, -90], [-9, -3, -90]]\n\
        triangles = [[0, 1, 2], [0, 2, 3]]\n\
        [[plane]]\npoint = [0, 9, 0]\n\
        [[point_set]]\npositions = [[0, -2.5, 0], [0.3, -2.5, 0]]\nradius = 0.3\n\
        [[torus]]\ncenter = [0, 0, 1]\nmajor_radius = 1\nminor_radius = 0.3\naxis = [0, 1, 0.3]\n";
    let moving = "[[sphere]]\ncenter = [0, 50, 0]\nradius = 1\n\
        transform = { keys = [{ time = 0, translate = [0, 0, 0] }, { time = 1, translate = [1, 0, 0] }] }\n";
    for text in [still.to_owned(), format!("{still}{moving}")] {
        let flow = motion(&at(&text, 0.0), Plane::Motion);
        for (pixel, flow) in flow.iter().enumerate() {
            assert_eq!(*flow, [0.0, 0.0, 1.0], "{} {}", pixel % 101, pixel / 101);
        }
    }
    // The built-in scene has joints on the diagonals of pixels
    let mut desc = SceneDesc::parse("config11.toml", builtin_scenes()[0].text.as_bytes(), &NoAssets).desc;
    (desc.render.motion_to, desc.render.width, desc.render.height) = (Some(MotionTo::Time(3.0)), 256, 256);
    let scene = desc.compile(&NoAssets, &CompileOptions::default()).unwrap().scene;
    assert!(motion(&scene, Plane::Motion).iter().all(|flow| *flow == [0.0, 0.0, 1.0]));
}

/// Two cameras a hand's width apart.
const PAIR: &str = "[render]\nwidth = 64\nheight = 48\ncamera = \"left\"\nmotion_to = \"right\"\n\
    [camera.left]\nposition = [-0.1, 0, 5]\nlook_at = [-0.1, 0, 0]\nfocal_length_px = [60, 60]\n\
    [camera.right]\nposition = [0.1, 0, 5]\nlook_at = [0.1, 0, 0]\nfocal_length_px = [60, 60]\n\
    [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n\
    [[parallelogram]]\np = [-9, -9, -3]\ne0 = [18, 0, 0]\ne1 = [0, 18, 0]\n";

#[test]
fn between_two_cameras_it_is_the_disparity() {
    let scene = at(PAIR, 0.0);
    assert_eq!(scene.motion_to(), Some(&MotionTo::Camera("right".into())));
    let film = film(&scene, &of(&[Plane::Motion, Plane::Depth]));
    let depth = floats(&film, Plane::Depth);
    let mut hidden = 0;
    for (pixel, [x, y, visible]) in floats(&film, Plane::Motion).as_chunks::<3>().0.iter().enumerate() {
        // f b / z
        assert!((x + 60.0 * 0.2 / depth[pixel]).abs() < 1e-4 && y.abs() < 1e-4, "{pixel}");
        hidden += usize::from(*visible == 0.0);
    }
    assert!(hidden > 20 && hidden < 300, "{hidden}");
    let receipt = scene.buffers_receipt(&RenderSettings::default(), &of(&[Plane::Motion]).buffers);
    let entry = |key: &str| receipt.entries.iter().find(|(k, _)| k == key).map(|(_, value)| value.as_str());
    assert_eq!(entry("motion_to"), Some("\"right\""));
    assert_eq!(entry("motion_intrinsics"), Some("60 0 32 0 60 24 0 0 1"));
    assert_eq!(entry("motion_opencv_camera_from_world"), Some("1 0 0 -0.1 0 -1 0 0 0 0 -1 5 0 0 0 1"));
    // What leads nowhere is said; what is not asked for is not
    let plain = scene.buffers_receipt(&RenderSettings::default(), &of(&[Plane::Depth]).buffers);
    assert!(!plain.entries.iter().any(|(key, _)| key.starts_with("motion")));
    let nowhere = at(&PAIR.replace("motion_to = \"right\"", ""), 0.0);
    assert!(of(&[Plane::Motion]).check(&nowhere).unwrap_err().contains("motion_to"));
    assert_eq!(nowhere.hash(), scene.hash());
}

#[test]
fn another_camera_of_a_moving_scene_sees_the_same_motion() {
    let text = MOVING.replace("MOTION", "motion_to = 0.6");
    let parsed = SceneDesc::parse("scene.toml", text.as_bytes(), &NoAssets);
    let mut other = parsed.desc.clone();
    other.cameras[0].1.position = [2.0, 1.0, 9.0];
    let expected = other.compile(&NoAssets, &CompileOptions::default()).unwrap().scene;
    let scene = at(&text, 0.0).with_camera(&other.cameras[0].1).unwrap();
    for plane in [Plane::Motion, Plane::MotionBackward] {
        assert!(motion(&scene, plane) == motion(&expected, plane));
    }
}

#[test]
fn nothing_else_decides_its_bits() {
    let text = MOVING.replace("MOTION", "motion_to = 0.6\nantialiasing = 2");
    let scene = at(&text, 0.2);
    let planes = of(&[Plane::Motion, Plane::MotionBackward]);
    let bits = |settings: &RenderSettings| {
        let film = film(&scene, settings);
        [Plane::Motion, Plane::MotionBackward].map(|plane| film.numbers(plane).unwrap().to_le_bytes())
    };
    let expected = bits(&planes);
    for settings in [
        RenderSettings { threads: NonZeroUsize::new(3), tile_size: 11, ..planes.clone() },
        RenderSettings { simd: SimdLevel::Fallback, ..planes.clone() },
        of(&[Plane::Color, Plane::MotionBackward, Plane::Motion]),
    ] {
        assert!(bits(&settings) == expected, "{settings:?}");
    }
    // A part is the same part
    let window = Window { x: 13, y: 7, width: 40, height: 50 };
    let [part, _] = bits(&RenderSettings { crop: Some(window), ..planes });
    for j in 0..50 {
        assert_eq!(part[j * 480..][..480], expected[0][((j + 7) * 120 + 13) * 12..][..480]);
    }
}
