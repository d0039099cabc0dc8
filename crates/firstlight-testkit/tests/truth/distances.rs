//! Cameras and scenes of all distances: depth, distance, position and ids of centre rays against closed forms.

use firstlight::{DVec3, Plane, RenderSettings, WorldRay};

use crate::buffers::{film, floats, scene, wholes};
use crate::scenes::*;

const SIDE: usize = 32;

/// The centre rays of a picture that shows `height` metres at `distance`, seen along -`back`, in f64: where each begins
/// and leads.
fn rays(back: V, distance: f64, height: f64, parallel: bool) -> Vec<[DVec3; 2]> {
    let back = DVec3::from(unit(back));
    let forward = -back;
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let place = |k: usize| (2.0 * k as f64 + 1.0) / SIDE as f64 - 1.0;
    let pixels = (0..SIDE).flat_map(|j| (0..SIDE).map(move |i| [place(i), -place(j)]));
    let ray = |[x, y]: [f64; 2]| {
        let aside = (right * x + up * y) * (0.5 * height);
        if parallel {
            [back * distance + aside, forward]
        } else {
            [back * distance, (forward * distance + aside).normalize()]
        }
    };
    pixels.map(ray).collect()
}

/// Where a ray meets the unit ball around the origin: t, and how near it comes to the middle.
fn on_ball([o, d]: [DVec3; 2]) -> (f64, f64) {
    let along = -d.dot(o);
    let nearest = o + d * along;
    (along - (1.0 - nearest.length_squared()).max(0.0).sqrt(), nearest.length())
}

#[test]
fn cameras_see_the_same_from_all_distances() {
    let settings = RenderSettings {
        buffers: [Plane::Depth, Plane::Distance, Plane::Position, Plane::ObjectId].map(Into::into).to_vec(),
        ..one_thread()
    };
    for back in [[0.0, 0.0, 1.0], [0.3, 0.4, 1.0]] {
        for distance in [1e2, 1e3, 1e4, 1e6, 1e8, 5e8, 1e9] {
            for parallel in [false, true] {
                // Planes, which have no end, hold nothing up
                for more in ["", "[[plane]]\npoint = [0, -1.5, 0]\n"] {
                    let position = mul(unit(back), distance);
                    let lens = match parallel {
                        true => "projection = \"orthographic\"\nheight = 3\n".to_owned(),
                        false => format!("focal_length_px = [{0:?}, {0:?}]\n", SIDE as f64 * distance / 3.0),
                    };
                    let text = format!(
                        "[render]\nwidth = {SIDE}\nheight = {SIDE}\n[camera]\nposition = {position:?}\n{lens}\
                         [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n\
                         [[mesh]]\npositions = [[-1.4, 1.1, 0], [-1.1, 1.1, 0], [-1.3, 1.4, 0]]\n\
                         triangles = [[0, 1, 2]]\n{more}"
                    );
                    if !parallel && SIDE as f64 * distance / 3.0 > 1e10 {
                        continue;
                    }
                    let scene = scene(&text);
                    let film = film(&scene, &settings);
                    let what = format!("from {distance:e} m along {back:?}, parallel: {parallel}, {more:?}");
                    let forward = -DVec3::from(unit(back));
                    let mut met = 0;
                    for (k, ray) in rays(back, distance, 3.0, parallel).into_iter().enumerate() {
                        let (t, near) = on_ball(ray);
                        let is_ball = wholes(&film, Plane::ObjectId)[k] == 1;
                        // A pixel is a tenth of a metre wide
                        assert!(near > 0.999 || is_ball, "{what}: pixel {k} misses the ball");
                        assert!(near < 1.001 || !is_ball, "{what}: pixel {k} sees its neighbour");
                        if near > 0.98 {
                            continue;
                        }
                        met += 1;
                        let p = ray[0] + ray[1] * t;
                        let at = |plane: Plane, i: usize| f64::from(floats(&film, plane)[i]);
                        let seen = DVec3::from([0, 1, 2].map(|axis| at(Plane::Position, 3 * k + axis)));
                        assert!((seen - p).length() < 1e-4, "{what}: {seen} is not {p}");
                        let depth = forward.dot(ray[1]) * t;
                        assert!((at(Plane::Depth, k) - depth).abs() < 1e-6 * distance, "{what}: depth of {k}");
                        assert!((at(Plane::Distance, k) - t).abs() < 1e-6 * distance, "{what}: distance of {k}");
                        // `Scene::intersect` finds the same point, for the ray whose direction is rounded to f32
                        let own = WorldRay { o: ray[0], d: ray[1].as_vec3() };
                        let ([o, d], hit) = ([own.o, own.d.as_dvec3().normalize()], scene.intersect(&own));
                        let (t, near) = on_ball([o, d]);
                        if near < 0.9 {
                            let hit = hit.unwrap_or_else(|| panic!("{what}: the ray of {k} meets nothing"));
                            assert!((hit.t - t).abs() < 1e-6 * distance, "{what}: {} is not {t}", hit.t);
                        }
                    }
                    assert!(met > 200, "{what}: {met}");
                }
            }
        }
    }
}

#[test]
fn what_a_camera_is_near_to_is_exact_whatever_else_there_is() {
    // A ball at map coordinates, by itself at the origin, and with what reaches far beyond it
    let ball = |at: V, more: &str| {
        let [x, y, z] = at;
        format!(
            "[render]\nwidth = 48\nheight = 48\nantialiasing = 2\n[camera]\nposition = [{x:?}, {:?}, {:?}]\n\
             look_at = {at:?}\n[[light.directional]]\ndirection = [-1, -2, -1]\n\
             [[sphere]]\ncenter = {at:?}\nradius = 2\n\
             [[cylinder]]\np0 = [{x:?}, {:?}, {z:?}]\np1 = {at:?}\nradius = 1\n\
             [[mesh]]\npositions = [[{:?}, {:?}, {z:?}], [{:?}, {:?}, {z:?}], [{x:?}, {:?}, {z:?}]]\n\
             triangles = [[0, 1, 2]]\n{more}",
            y + 3.0,
            z + 12.0,
            y - 4.0,
            x - 3.0,
            y - 2.0,
            x - 1.0,
            y - 2.0,
            y + 3.0,
        )
    };
    let settings = RenderSettings { buffers: [Plane::Color, Plane::Depth].map(Into::into).to_vec(), ..every_ray() };
    let town = [450_000.0, 120.0, -5_400_000.0];
    let floor = |[x, y, z]: V| format!("[[rectangle]]\ncenter = [{x:?}, {:?}, {z:?}]\nsize = [1e5, 1e5]\n", y - 9.0);
    let marker = "[[sphere]]\nname = \"marker\"\ncenter = [0, 0, 0]\nradius = 1\n";
    for (here, there) in [
        (String::new(), marker.to_owned()),
        (floor([0.0; 3]), floor(town)),
        (floor([0.0; 3]), format!("{}{marker}", floor(town))),
    ] {
        let [one, other] = [ball([0.0; 3], &here), ball(town, &there)].map(|text| film(&scene(&text), &settings));
        // The pixel is 0.2 m wide
        let depths = floats(&one, Plane::Depth).iter().zip(floats(&other, Plane::Depth));
        for (k, (a, b)) in depths.enumerate() {
            let is_near = *a < 20.0;
            assert!(!is_near || (a - b).abs() < 2e-5, "{there}: depth of {k}: {a} and {b}");
        }
        let colors = floats(&one, Plane::Color).iter().zip(floats(&other, Plane::Color));
        let off = colors.filter(|(a, b)| (*a - *b).abs() > 1e-3).count();
        assert!(off < 40, "{there}: {off} of {} channels differ", 48 * 48 * 4);
    }
}
