//! What a compiled scene answers besides pictures: what a ray sees, what of a light is seen, and the view of another
//! camera.

use std::ops::ControlFlow;

use firstlight::{
    CameraDesc, CameraHit, CompileOptions, DVec3, Film, LightId, NoAssets, RayDifferential, RenderSettings, Scene,
    SceneDesc, SurfacePoint, TransformDesc, TransformKeyDesc, Vec3, WorldRay, render, render_image,
};

fn compiled(text: &str, time: f64) -> Scene {
    let options = CompileOptions { time, ..CompileOptions::default() };
    SceneDesc::parse("scene.toml", text.as_bytes(), &NoAssets).compile(&NoAssets, &options).unwrap().scene
}

/// A floor at height 0 below a square light, of which the point above the origin sees the right half past a board; and
/// a light behind the floor.
const HALF: &str = "\
[render]
width = 16
height = 12
[camera]
position = [0, 3, 6]
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
lights_exclude = []
[[parallelogram]]
p = [-5, 1, -5]
e0 = [5, 0, 0]
e1 = [0, 0, 10]
visible = false
shadow_exclude = [\"unhindered\"]
[[light.point]]
position = [-1, 2, 0]
name = \"unhindered\"
[[light.directional]]
direction = [0, 1, 0]
[[light.rectangle]]
center = [0, 2, 0]
e0 = [1, 0, 0]
e1 = [0, 0, 1]
samples = 64
set = \"grid\"
";

/// The floor at the origin, seen from above.
fn floor(scene: &Scene) -> SurfacePoint {
    let ray = WorldRay { o: DVec3::new(0.0, 0.5, 0.0), d: Vec3::NEG_Y };
    match scene.look(&ray, &RayDifferential::default()) {
        CameraHit::Surface(surface) => surface,
        seen => panic!("{seen:?}"),
    }
}

#[test]
fn half_of_a_light_is_seen_past_a_board() {
    let scene = compiled(HALF, 0.0);
    let surface = floor(&scene);
    let seen = |light: LightId| {
        let rays = scene.shadow_rays(&surface, light).map(|ray| (ray.light(), scene.occluded(&ray)));
        rays.inspect(|(of, _)| assert_eq!(*of, light)).filter(|(_, occluded)| !occluded).count()
    };
    let points: Vec<_> = scene.lights().map(|light| scene.light_points(light)).collect();
    assert_eq!(points, [1, 1, 64]);
    // Nothing is in the way of the point light, the directional one is below the horizon
    assert_eq!(scene.lights().map(seen).collect::<Vec<_>>(), [1, 0, 32]);
    assert_eq!(scene.shadow_rays(&surface, LightId(1)).count(), 0);
    // The ways to the points end on the light
    for ray in scene.shadow_rays(&surface, LightId(2)) {
        assert!(ray.is_finite() && (ray.direction().y - 2.0).abs() < 1e-5);
        assert_eq!(scene.occluded(&ray), ray.direction().x < 0.0);
    }
}

#[test]
fn two_points_see_each_other_or_not() {
    let scene = compiled(HALF, 0.0);
    let surface = floor(&scene);
    let hidden =
        |light: u32, p: [f64; 3]| scene.occluded(&scene.shadow_ray_to(&surface, LightId(light), DVec3::from(p)));
    assert!(hidden(2, [-1.0, 2.0, 0.3]));
    assert!(!hidden(2, [-1.0, 0.9, 0.3]));
    assert!(!hidden(2, [1.0, 2.0, 0.3]));
    // For this light the board casts no shadow
    assert!(!hidden(0, [-1.0, 2.0, 0.3]));
}

fn film(scene: &Scene) -> Film {
    match render(scene, &RenderSettings::default(), &|_, _| ControlFlow::Continue(())) {
        ControlFlow::Continue((film, _)) => film,
        ControlFlow::Break(()) => panic!("nobody stops it"),
    }
}

#[test]
fn an_image_is_the_film_of_the_default_settings() {
    let scene = compiled(HALF, 0.0);
    assert_eq!(render_image(&scene), film(&scene).develop());
}

/// Far from the origin, so that a camera of another place would show.
const FAR: &str = "\
[render]
width = 16
height = 12
[camera]
POSE
[[sphere]]
center = [40000.25, 1, 0]
radius = 1
[[parallelogram]]
p = [39995, 0, 5]
e0 = [10, 0, 0]
e1 = [0, 0, -10]
[[light.rectangle]]
center = [40000, 5, 3]
e0 = [1, 0, 0]
e1 = [0, 0, 1]
strength = 40
";

#[test]
fn a_scene_seen_by_another_camera_has_the_bits_of_one_compiled_with_it() {
    let first = compiled(&FAR.replace("POSE", "position = [40000, 2, 9]\nlook_at = [40000, 1, 0]"), 0.0);
    let other =
        compiled(&FAR.replace("POSE", "position = [40006.5, 3, 4]\nlook_at = [40000, 1, 0]\nfov_y_deg = 30"), 0.0);
    let camera =
        CameraDesc { look_at: [40000.0, 1.0, 0.0], fov_y_deg: Some(30.0), ..CameraDesc::new([40006.5, 3.0, 4.0]) };
    let seen = first.with_camera(&camera).unwrap();
    let bits = |scene: &Scene| {
        let image = render_image(scene);
        image.pixels.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>()
    };
    assert!(bits(&seen) == bits(&other));
    assert!(bits(&seen) != bits(&first));
    assert_ne!(seen.hash(), first.hash());
    assert_eq!(first.with_camera(&camera).unwrap().hash(), seen.hash());
    assert_eq!(seen.time(), None);
}

#[test]
fn another_camera_moves_with_time() {
    let scene = compiled(&FAR.replace("POSE", "position = [40000, 2, 9]\nlook_at = [40000, 1, 0]"), 2.0);
    assert_eq!(scene.time(), None);
    let key = |time: f64, x: f64| TransformKeyDesc { translate: Some([x, 0.0, 0.0]), ..TransformKeyDesc::new(time) };
    let transform = TransformDesc { keys: vec![key(0.0, 0.0), key(4.0, 8.0)], ..TransformDesc::default() };
    let camera = CameraDesc { transform: Some(Box::new(transform)), ..CameraDesc::new([40000.0, 2.0, 9.0]) };
    let seen = scene.with_camera(&camera).unwrap();
    assert_eq!(seen.time(), Some(2.0));
    // Half way between the keys
    let moved = CameraDesc { look_at: [4.0, 0.0, 0.0], ..CameraDesc::new([40004.0, 2.0, 9.0]) };
    assert_eq!(render_image(&seen), render_image(&scene.with_camera(&moved).unwrap()));
}

#[test]
fn faults_of_another_camera_say_what_is_wrong() {
    let scene = compiled(HALF, 0.0);
    let bad = CameraDesc { fov_y_deg: Some(200.0), ..CameraDesc::new([0.0, 0.0, 0.0]) };
    let faults = scene.with_camera(&bad).unwrap_err().faults;
    assert!(faults.iter().any(|fault| fault.path == "camera.fov_y_deg"), "{faults:?}");
    assert_eq!(faults.len(), 2, "{faults:?}");
}
