//! Checkerboards: sharp from near, gray from far, and no line anywhere but at the squares' own edges. Under ambient
//! light alone a picture is its texture, and where all that a pixel sees lies in one square, the pixel has that
//! square's colour.

use std::f64::consts::PI;

use firstlight::{CameraDesc, ColorDesc, ColorParam, ParallelogramDesc, SceneDesc, SphereDesc, SphereUv};
use pxfm::{f_acos, f_asin, f_atan2, f_tan};

use crate::scenes::*;

const COLORS: [V; 2] = [[0.875, 0.25, 0.5], [0.0625, 0.75, 0.375]];

/// Nothing but ambient light on a checkerboard called "board".
fn board(width: u32, height: u32, counts: [u32; 2], colors: [V; 2]) -> SceneDesc {
    let mut scene = empty(width, height, 1)
        .with_texture("board", checkerboard(counts, colors))
        .with_material("board", phong(ColorParam::texture("board"), ColorParam::gray(0.0), 1.0));
    scene.render.ambient = ColorDesc::WHITE.into();
    scene.render.transparent = true;
    scene
}

/// Rays of the contract's camera, in f64.
struct Eye {
    position: V,
    right: V,
    up: V,
    forward: V,
    size: [f64; 2],
    half: f64,
}

impl Eye {
    fn new(camera: &CameraDesc, width: u32, height: u32) -> Self {
        let forward = unit(sub(camera.look_at, camera.position));
        let right = unit(cross(forward, camera.up));
        let half = f_tan(radians(camera.fov_y_deg.expect("these tests give it")) / 2.0);
        Eye {
            position: camera.position,
            right,
            up: cross(right, forward),
            forward,
            size: [width as f64, height as f64],
            half,
        }
    }

    fn direction(&self, x: f64, y: f64) -> V {
        let film_x = (2.0 * x / self.size[0] - 1.0) * self.half * self.size[0] / self.size[1];
        let film_y = (1.0 - 2.0 * y / self.size[1]) * self.half;
        unit(add(add(mul(self.right, film_x), mul(self.up, film_y)), self.forward))
    }
}

/// The square that holds `w` of `n` along one coordinate, the shape's own rim belonging to the outermost.
fn square_of(w: f64, n: u32) -> u32 {
    (w * n as f64).floor().clamp(0.0, n as f64 - 1.0) as u32
}

/// Whether the squares met in a pixel have one colour because they are one square, or the two on either side of a seam
/// where the first and the last have the same colour.
fn one_color(squares: &[[u32; 2]], counts: [u32; 2], seam: bool) -> Option<usize> {
    let [first, ..] = squares else { return None };
    let same = squares.iter().all(|s| s == first);
    let last = counts[0] - 1;
    let across = seam && counts[0] % 2 == 1 && squares.iter().all(|s| s[1] == first[1] && (s[0] == 0 || s[0] == last));
    (same || across).then_some(((first[0] + first[1]) % 2) as usize)
}

/// Where in pixel (i, j), and a little around it, the test looks.
fn places(i: u32, j: u32) -> impl Iterator<Item = (f64, f64)> {
    let steps = 7;
    (0..=steps * steps).map(move |k| {
        let at = |k: u32| 0.5 + 1.6 * (k as f64 / (steps - 1) as f64 - 0.5);
        // The middle itself once more at the end
        let (s, t) = if k == steps * steps { (0.5, 0.5) } else { (at(k % steps), at(k / steps)) };
        (i as f64 + s, j as f64 + t)
    })
}

/// Compares each pixel whose surroundings show one square with that square's colour; answers how many there were, and
/// checks that all others lie between the two colours.
#[track_caller]
fn compare(
    scene: &SceneDesc,
    counts: [u32; 2],
    seam: bool,
    uv_at: impl Fn(V, V) -> Option<[f64; 2]>,
    what: &str,
) -> usize {
    let (width, height) = (scene.render.width, scene.render.height);
    let eye = Eye::new(&scene.cameras[0].1, width, height);
    let film = shoot(scene);
    let mut plain = 0;
    for (k, p) in film.pixels.iter().enumerate() {
        let (i, j) = (k as u32 % width, k as u32 / width);
        if p[3] == 0.0 {
            continue;
        }
        for c in 0..3 {
            let (low, high) = (COLORS[0][c].min(COLORS[1][c]) as f32, COLORS[0][c].max(COLORS[1][c]) as f32);
            assert!(p[c] >= low && p[c] <= high, "{p:?} at {i}, {j} is not between the two colours: {what}");
        }
        let uvs: Option<Vec<_>> = places(i, j).map(|(x, y)| uv_at(eye.position, eye.direction(x, y))).collect();
        let Some(uvs) = uvs else { continue };
        let squares: Vec<_> = uvs.iter().map(|uv| [square_of(uv[0], counts[0]), square_of(uv[1], counts[1])]).collect();
        if let Some(color) = one_color(&squares, counts, seam) {
            plain += 1;
            let should = COLORS[color].map(|c| c as f32);
            assert_eq!(p[..3], should, "a line at {i}, {j}, uv {:?}, {counts:?} squares: {what}", uvs[uvs.len() - 1]);
        }
    }
    plain
}

/// Where a ray first meets the sphere, as a unit normal: both roots, in f64.
fn sphere_normal(o: V, d: V, c: V, r: f64) -> Option<V> {
    let f = sub(o, c);
    let b = -dot(f, d);
    let root = r * r - (dot(f, f) - b * b);
    if root < 0.0 {
        return None;
    }
    let t = [b - root.sqrt(), b + root.sqrt()].into_iter().find(|t| *t > 0.0)?;
    Some(mul(sub(add(o, mul(d, t)), c), 1.0 / r))
}

fn sphere_uv(uv: SphereUv, n: V) -> [f64; 2] {
    match uv {
        SphereUv::Equirectangular => {
            [0.5 + f_atan2(-n[2], n[0]) / (2.0 * PI), 0.5 + f_asin(n[1].clamp(-1.0, 1.0)) / PI]
        }
        SphereUv::Angles => [f_acos(n[0].clamp(-1.0, 1.0)) / PI, f_acos(n[1].clamp(-1.0, 1.0)) / PI],
    }
}

#[test]
fn spheres_have_no_line_but_at_the_squares_edges() {
    for uv in [SphereUv::Equirectangular, SphereUv::Angles] {
        for n in 1..=9 {
            let counts = [n, if n % 3 == 0 { 10 - n } else { n }];
            let mut plain = 0;
            // The front, a pole, the seam at u = 0 and 1, from near, from far, from inside
            for (eye, look_at, fov) in [
                ([0.3, 0.4, 4.0], [0.0; 3], 32.0),
                ([0.2, 4.0, 0.3], [0.0; 3], 32.0),
                ([-4.0, 0.2, 0.3], [0.0; 3], 32.0),
                ([-1.2, 0.1, 0.02], [-1.0, 0.05, 0.0], 60.0),
                ([-1.0, -1.2, 0.4], [0.0; 3], 70.0),
                ([-9.0, -20.0, 15.0], [0.0; 3], 20.0),
                ([0.1, 0.2, -0.1], [-1.0, 0.3, 0.1], 100.0),
            ] {
                let scene = board(40, 40, counts, COLORS)
                    .with_camera(camera(eye, look_at, fov))
                    .with_sphere(SphereDesc { uv, material: Some("board".into()), ..sphere([0.0; 3], 1.0) });
                let uv_at = |o, d| sphere_normal(o, d, [0.0; 3], 1.0).map(|n| sphere_uv(uv, n));
                let seam = uv == SphereUv::Equirectangular;
                plain += compare(&scene, counts, seam, uv_at, &format!("{uv:?} from {eye:?}"));
            }
            assert!(plain > 600, "{uv:?} {n}: only {plain} pixels were compared");
        }
    }
}

#[test]
fn one_square_is_one_colour_up_to_the_rim() {
    for uv in [SphereUv::Equirectangular, SphereUv::Angles] {
        for fov in [3.0, 35.0, 100.0] {
            let scene = board(33, 33, [1, 1], COLORS)
                .with_camera(camera([-2.0, 3.0, 0.0], [0.0; 3], fov))
                .with_sphere(SphereDesc { uv, material: Some("board".into()), ..sphere([0.0; 3], 1.0) });
            for p in shoot(&scene).pixels {
                assert!(p[3] == 0.0 || p[..3] == COLORS[0].map(|c| c as f32), "{p:?} {uv:?} {fov}");
            }
        }
    }
}

/// Where a ray meets the plane of a parallelogram, as its coordinates; outside they are those of the nearest rim.
fn plane_uv(o: V, d: V, p: V, e0: V, e1: V) -> Option<[f64; 2]> {
    let n = cross(e0, e1);
    let t = dot(sub(p, o), n) / dot(d, n);
    if !(t > 0.0) {
        return None;
    }
    let hit = sub(add(o, mul(d, t)), p);
    let area2 = dot(n, n);
    Some([dot(hit, cross(e1, n)) / area2, dot(hit, cross(n, e0)) / area2])
}

#[test]
fn parallelograms_have_no_line_but_at_the_squares_edges() {
    let (p, e0, e1) = ([-1.0, -0.3, -1.2], [2.0, 0.3, 0.1], [0.8, -0.2, 2.1]);
    for n in 1..=9 {
        let counts = [n, if n % 2 == 0 { 10 - n } else { n }];
        let mut plain = 0;
        // From above, aslant, along, near a corner, near an edge, from far
        for (eye, look_at, fov) in [
            ([0.4, 4.0, 0.1], [0.4, -0.3, 0.0], 45.0),
            ([3.0, 1.0, 2.5], [0.4, -0.3, 0.0], 45.0),
            ([-4.0, 0.2, -1.5], [0.0, -0.2, 0.0], 30.0),
            ([-1.0, 0.0, -1.25], [-0.99, -0.3, -1.19], 50.0),
            ([0.0, -0.6, -1.3], [0.0, -0.2, -1.0], 90.0),
            ([8.0, 30.0, -9.0], [0.4, -0.3, 0.0], 12.0),
        ] {
            let scene = board(40, 40, counts, COLORS)
                .with_camera(camera(eye, look_at, fov))
                .with_parallelogram(ParallelogramDesc { material: Some("board".into()), ..parallelogram(p, e0, e1) });
            let uv_at = |o, d| plane_uv(o, d, p, e0, e1);
            plain += compare(&scene, counts, false, uv_at, &format!("from {eye:?}"));
        }
        assert!(plain > 600, "{n}: only {plain} pixels were compared");
    }
}

/// Compares every pixel whose rays all meet the shape with the mean over 32 x 32 of them.
#[track_caller]
fn compare_means(scene: &SceneDesc, counts: [u32; 2], uv_at: impl Fn(V, V) -> Option<[f64; 2]>, what: &str) {
    let (width, height) = (scene.render.width, scene.render.height);
    let eye = Eye::new(&scene.cameras[0].1, width, height);
    let film = shoot(scene);
    let (mut compared, mut mixed) = (0, 0);
    for (k, p) in film.pixels.iter().enumerate() {
        let (i, j) = (k as u32 % width, k as u32 / width);
        let first = (0..1024u32).map(|s| {
            let at = |s: u32| (s as f64 + 0.5) / 32.0;
            let [u, v] = uv_at(eye.position, eye.direction(i as f64 + at(s % 32), j as f64 + at(s / 32)))?;
            Some((square_of(u, counts[0]) + square_of(v, counts[1])).is_multiple_of(2))
        });
        let Some(first) = first.collect::<Option<Vec<_>>>() else { continue };
        let share = first.iter().filter(|first| **first).count() as f64 / 1024.0;
        compared += 1;
        mixed += usize::from(share > 0.05 && share < 0.95);
        let should = COLORS[0][0] * share + COLORS[1][0] * (1.0 - share);
        // An edge along a column of places is known to 1/32 of the pixel; the footprint is straight, the sphere is not
        let allowed = 0.05 * (COLORS[0][0] - COLORS[1][0]).abs();
        assert!((p[0] as f64 - should).abs() < allowed, "{} at {i}, {j} is not {should}: {what}", p[0]);
    }
    assert!(compared > 300 && mixed > 10, "{mixed} mixed pixels of {compared}: {what}");
}

#[test]
fn the_squares_edges_are_the_mean_over_the_pixel() {
    for n in [2, 4, 5] {
        // The seam at u = 0 and 1 lies at -x; there it is an edge for even counts only
        for (uv, eye, look_at) in [
            (SphereUv::Equirectangular, [-1.5, 0.35, 0.1], [-1.0, 0.3, 0.05]),
            (SphereUv::Equirectangular, [0.9, 0.6, 1.2], [0.6, 0.3, 0.7]),
            (SphereUv::Angles, [0.3, 0.4, 1.5], [0.25, 0.25, 0.9]),
        ] {
            let scene = board(24, 24, [n, n + 1], COLORS)
                .with_camera(camera(eye, look_at, 50.0))
                .with_sphere(SphereDesc { uv, material: Some("board".into()), ..sphere([0.0; 3], 1.0) });
            let uv_at = |o, d| sphere_normal(o, d, [0.0; 3], 1.0).map(|n| sphere_uv(uv, n));
            compare_means(&scene, [n, n + 1], uv_at, &format!("{uv:?} from {eye:?}, {n}"));
        }
        let (p, e0, e1) = ([-1.0, -0.3, -1.2], [2.0, 0.3, 0.1], [0.8, -0.2, 2.1]);
        let scene = board(24, 24, [n, n + 1], COLORS)
            .with_camera(camera([1.2, 1.0, 1.5], [0.4, -0.3, 0.0], 25.0))
            .with_parallelogram(ParallelogramDesc { material: Some("board".into()), ..parallelogram(p, e0, e1) });
        compare_means(&scene, [n, n + 1], |o, d| plane_uv(o, d, p, e0, e1), &format!("parallelogram, {n}"));
    }
}

#[test]
fn a_board_to_the_horizon_is_gray() {
    // A square kilometre and more of squares of 1 m, seen from 1.6 m above
    let half = 2000.0;
    let scene = board(64, 96, [4000, 4000], [[1.0; 3], [0.0; 3]])
        .with_camera(camera_up([0.3, 1.6, 0.2], [0.5, 1.6, -0.9], [0.0, 1.0, 0.0], 40.0))
        .with_parallelogram(ParallelogramDesc {
            material: Some("board".into()),
            ..parallelogram([-half, 0.0, half], [2.0 * half, 0.0, 0.0], [0.0, 0.0, -2.0 * half])
        });
    let film = shoot(&scene);
    let row = |y: u32| &film.pixels[(y * 64) as usize..((y + 1) * 64) as usize];
    // Row 48 begins at the horizon. A pixel's footprint at depth d is d^2 / 1.6 pixels long and d pixels wide
    let pixel = 2.0 * f_tan(radians(20.0)) / 96.0;
    let mut sharp = false;
    for y in 48..96 {
        let depth = 1.6 / ((y as f64 + 0.5 - 48.0) * pixel);
        if depth > 1900.0 {
            continue;
        }
        let (long, wide) = (depth * depth * pixel / 1.6, depth * pixel);
        for p in row(y) {
            // A footprint of many squares: what it has too much of one colour is a rest along its outline
            if wide > 1.0 {
                assert!((p[0] - 0.5).abs() < (0.1 / wide) as f32, "{} in row {y}, {wide} squares wide", p[0]);
            }
        }
        // A long and narrow one may follow a diagonal; a row of them does not
        let mean = row(y).iter().map(|p| p[0]).sum::<f32>() / 64.0;
        assert!(long < 4.0 || (mean - 0.5).abs() < 0.02, "row {y} has the mean {mean}, {long} squares long");
        sharp |= row(y).iter().any(|p| p[0] == 0.0) && row(y).iter().any(|p| p[0] == 1.0);
    }
    assert!(sharp, "and in front it is black and white");
}

#[test]
fn the_mean_over_whole_squares_is_kept() {
    // The board fills the film exactly, so the footprints tile it
    for n in 1..=9u32 {
        for (width, height) in [(40, 40), (37, 23), (7, 5), (3, 2), (1, 1)] {
            for antialiasing in [1, 2, 3] {
                let aspect = width as f64 / height as f64;
                let mut scene = board(width, height, [n, n], [[1.0; 3], [0.0; 3]])
                    .with_camera(camera_up([0.0, 0.0, 1.0], [0.0; 3], [0.0, 1.0, 0.0], 90.0))
                    .with_parallelogram(ParallelogramDesc {
                        material: Some("board".into()),
                        ..parallelogram([-aspect, -1.0, 0.0], [2.0 * aspect, 0.0, 0.0], [0.0, 2.0, 0.0])
                    });
                scene.render.antialiasing = antialiasing;
                let film = shoot(&scene);
                let mean = film.pixels.iter().map(|p| p[0] as f64).sum::<f64>() / film.pixels.len() as f64;
                // An odd board has one square more of the first colour
                let n2 = (n * n) as f64;
                let should = if n % 2 == 0 { 0.5 } else { (n2 + 1.0) / (2.0 * n2) };
                assert!(
                    (mean - should).abs() < 2e-5,
                    "{n} squares on {width} x {height} x {antialiasing}: {mean}, not {should}"
                );
            }
        }
    }
}
