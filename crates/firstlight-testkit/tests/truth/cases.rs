//! Scenes that were wrong once, held to what they should show: see `cases/README.md`.

use std::path::Path;

use firstlight::{
    CompileOptions, FolderAssets, Image, NoAssets, RenderSettings, SampleSet, SamplesDesc, Scene, SceneDesc, Window,
    builtin_scenes,
};

use crate::converged::{displayed, exact, integrated, sampled, traced, with_samples};
use crate::scenes::*;

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/truth/cases"))
}

/// The files beside a scene.
fn assets(name: &str) -> FolderAssets {
    FolderAssets::new(folder().join(name).parent().expect("it lies in a folder"), &[]).expect("the folder is there")
}

fn case(name: &str) -> SceneDesc {
    let path = folder().join(name);
    let text = std::fs::read(&path).unwrap_or_else(|fault| panic!("{}: {fault}", path.display()));
    let assets = assets(name);
    let parsed = SceneDesc::parse(name, &text, &assets);
    assert!(parsed.faults().is_empty(), "{name}: {:?}", parsed.faults());
    parsed.desc
}

/// By how many steps of 255 two pictures differ at most.
fn apart(scene: &Scene, one: &Image, other: &Image) -> f64 {
    let steps = |(a, b): (&[f32; 4], &[f32; 4])| {
        let [a, b] = [a, b].map(|pixel| displayed(scene, *pixel));
        (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
    };
    one.pixels.iter().zip(&other.pixels).map(steps).fold(0.0, f64::max)
}

#[test]
fn hollow_meshes_do_not_hide_light_from_themselves() {
    let desc = case("smooth_valley_black.toml");
    let exact = exact(&desc);
    let off = apart(&compile(&desc), &exact, &sampled(&desc, SampleSet::Sobol, 4096));
    assert!(off < 0.25, "{off} steps off");
    let black = exact.pixels.iter().filter(|pixel| pixel[0] == 0.0).count();
    assert_eq!(black, sampled(&desc, SampleSet::Sobol, 4).pixels.iter().filter(|pixel| pixel[0] == 0.0).count());
}

#[test]
fn lights_that_nearly_touch_are_whole() {
    for name in ["near_contact_rect_1e-5.toml", "near_contact_speck.toml"] {
        let [red, ..] = exact(&case(name)).pixels[0];
        assert!((red - 0.8).abs() < 2e-4, "{name}: {red}");
    }
}

#[test]
fn a_disk_that_cuts_the_floor_sheds_its_light_on_both_sides() {
    let desc = case("near_contact_disk.toml");
    let image = exact(&desc);
    let cos = 0.957_826_288;
    let (mut brighter, mut darker) = (0, 0);
    for pixel in &image.pixels {
        let near = |should: f64| (f64::from(pixel[0]) - 0.8 * should).abs() < 1.5e-3;
        // The disk ends a metre away: it is not quite all of a half plane
        (brighter, darker) = (brighter + i32::from(near(0.5 + 0.5 * cos)), darker + i32::from(near(0.5 - 0.5 * cos)));
    }
    assert_eq!(brighter + darker, 16 * 16, "{brighter} on one side, {darker} on the other");
    assert!(brighter == darker, "{brighter} on one side, {darker} on the other");
}

#[test]
fn pixels_beside_a_hard_edge_are_what_their_rays_say() {
    let desc = case("adaptive_directional_edge.toml");
    for antialiasing in [2, 3, 4] {
        let mut desc = desc.clone();
        desc.render.antialiasing = antialiasing;
        let off = apart(&compile(&desc), &shoot(&desc), &shoot_every_ray(&desc));
        assert!(off < 0.5, "{antialiasing} x {antialiasing} rays: {off} steps off");
    }
}

/// The mean of a checkerboard over what of a pixel's footprint lies within 0 to 1 of u and v, by 256 x 256 points of
/// it.
fn by_counting(scene: &Scene, [x, y]: [u32; 2], counts: [f64; 2]) -> Option<f64> {
    let (ray, differential) = scene.camera().ray(x as f32 + 0.5, y as f32 + 0.5, 1.0);
    let si = scene.surface(&ray, &scene.intersect(&ray)?, &differential);
    let (mut sum, mut count) = (0.0, 0.0);
    for (i, j) in (0..256).flat_map(|j| (0..256).map(move |i| (i, j))) {
        let [a, b] = [i, j].map(|k| (f64::from(k) + 0.5) / 256.0 - 0.5);
        let at = |uv: f32, dx: f32, dy: f32| f64::from(uv) + a * f64::from(dx) + b * f64::from(dy);
        let u = at(si.uv.x, si.footprint.dx.x, si.footprint.dy.x);
        let v = at(si.uv.y, si.footprint.dx.y, si.footprint.dy.y);
        if (0.0..1.0).contains(&u) && (0.0..1.0).contains(&v) {
            let square = (u * counts[0]).floor() + (v * counts[1]).floor();
            (sum, count) = (sum + f64::from(square.rem_euclid(2.0) == 0.0), count + 1.0);
        }
    }
    Some(sum / count)
}

/// The floor is so flat to the eye that a pixel is long: in one half of it nothing is seen of the light, and in the
/// other it comes out from behind a ball.
#[test]
fn light_that_sets_in_within_a_long_pixel_is_told() {
    let builtin = builtin_scenes().iter().find(|builtin| builtin.name == "config31").expect("it is built in");
    let mut desc = SceneDesc::parse(builtin.name, builtin.text.as_bytes(), &NoAssets).desc;
    (desc.render.width, desc.render.height) = (256, 256);
    let crop = Some(Window { x: 160, y: 236, width: 16, height: 10 });
    let [integrated, sampled] =
        [(SamplesDesc::Exact, integrated()), (SamplesDesc::Count(1024), traced())].map(|(samples, settings)| {
            let scene = compile(&with_samples(&desc, samples, SampleSet::Sobol, 1));
            picture(&scene, &RenderSettings { crop, ..settings })
        });
    let off = apart(&compile(&desc), &integrated, &sampled);
    assert!(off <= 2.0, "{off} steps off");
}

#[test]
fn a_plate_has_nothing_beyond_its_rim() {
    let desc = case("checker_plate_edge.toml");
    let (scene, image) = (compile(&desc), shoot_every_ray(&desc));
    let (mut seen, mut mixed) = (0, 0);
    for (pixel, i) in image.pixels.iter().zip(0..) {
        let at = [i % 24, i / 24];
        let Some(should) = by_counting(&scene, at, [108.0, 68.0]) else { continue };
        let is = f64::from(pixel[0]);
        assert!((is - should).abs() < 0.02, "{at:?}: {is} is not {should}");
        (seen, mixed) = (seen + 1, mixed + i32::from((0.05..0.95).contains(&should)));
    }
    assert!(seen > 100 && mixed > 50, "{seen} pixels, {mixed} of both colours");
}

#[test]
fn what_took_too_long_is_right() {
    for (name, size) in
        [("blades_256_n4.toml", 12), ("bumpy_ball/scene.toml", 16), ("constant_sphere_light_over_plane.toml", 12)]
    {
        let mut desc = case(name);
        (desc.render.width, desc.render.height) = (size, size);
        let assets = assets(name);
        let compiled = |samples: SamplesDesc| {
            let desc = with_samples(&desc, samples, SampleSet::Sobol, 1);
            desc.compile(&assets, &CompileOptions::default()).expect("it is fine").scene
        };
        let scene = compiled(SamplesDesc::Exact);
        let truth = picture(&compiled(SamplesDesc::Count(4096)), &every_ray());
        let off = apart(&scene, &picture(&scene, &integrated()), &truth);
        assert!(off < 1.0, "{name}: {off} steps off");
    }
}

/// What is seen of this text by default, and by how many steps 4,096 points for each camera ray differ from it at most.
fn off_by(text: &str) -> f64 {
    let desc = SceneDesc::parse("s.toml", text.as_bytes(), &firstlight::NoAssets);
    assert!(desc.faults().is_empty(), "{:?}", desc.faults());
    let desc = desc.desc;
    apart(&compile(&desc), &exact(&desc), &sampled(&desc, SampleSet::Sobol, 4096))
}

const ROOM: &str = r#"
[render]
width = 32
height = 32
[camera]
position = [0, 3, 9]
look_at = [0, 0.5, 0]
fov_y_deg = 45
[material.phong.m]
diffuse = 0.7
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = "m"
"#;

#[test]
fn more_shapes_than_are_listed_cast_shadows_all_the_same() {
    let light = "[[light.rectangle]]\ncenter = [2, 5, 2]\ne0 = [1.5, 0, 0]\ne1 = [0, 0, 1.5]\nstrength = 8\n";
    let sphere = |k: i32| {
        let (x, y, z) = (k % 8 - 4, k % 3, k / 8 - 4);
        format!("[[sphere]]\ncenter = [{x}, 0.{}, {z}]\nradius = 0.25\nmaterial = \"m\"\n", 3 + 2 * y)
    };
    let spheres: String = (0..60).map(sphere).collect();
    let off = off_by(&format!("{ROOM}{light}{spheres}"));
    assert!(off < 1.0, "{off} steps off");
}

#[test]
fn solids_cast_shadows_of_closed_form() {
    let solids = r#"
[[box]]
center = [-1.6, 0.4, 0]
size = [0.8, 0.8, 0.8]
transform = { rotate_deg = [10, 30, 0] }
material = "m"
[[disk]]
center = [0, 1.2, 0.4]
normal = [0.2, 1, 0.1]
radius = 0.7
inner_radius = 0.3
material = "m"
[[cylinder]]
p0 = [1.4, 0.7, 0.3]
p1 = [2.3, 1.0, -0.3]
radius = 0.35
capped = false
material = "m"
[[cylinder]]
p0 = [-2.8, 0, -0.9]
p1 = [-2.8, 1.1, -0.9]
radius = 0.4
material = "m"
[[cone]]
p0 = [0.3, 0, 1.6]
p1 = [0.4, 0.9, 1.5]
radius0 = 0.4
material = "m"
[[sphere]]
center = [-0.6, 0.4, 1.4]
radius = 0.3
transform = { scale = [1, 0.5, 1.5] }
material = "m"
"#;
    let lights = [
        "[[light.rectangle]]\ncenter = [1, 4, 1]\ne0 = [1.5, 0, 0]\ne1 = [0, 0, 1.5]\nstrength = 8\n",
        // It cuts the box
        "[[light.rectangle]]\ncenter = [-1.4, 0.9, 0]\ne0 = [0.9, 0.3, 0]\ne1 = [0, 0, 0.9]\nstrength = 3\n",
        "[[light.sphere]]\ncenter = [1, 3, 1]\nradius = 0.5\nstrength = 8\n",
        "[[light.sphere]]\ncenter = [1, 3, 1]\nradius = 0.5\nstrength = 1\nfalloff = \"constant\"\n",
        // The box and the ring reach into it
        "[[light.sphere]]\ncenter = [-1, 1.2, 0.2]\nradius = 0.5\nsides = \"front\"\nstrength = 3\n",
    ];
    let room = ROOM.replace("= 32", "= 24");
    for light in lights {
        let off = off_by(&format!("{room}{light}{solids}"));
        assert!(off < 1.5, "{off} steps off with {light}");
    }
}

/// A cube and a corner of two walls, as meshes.
const MESHES: &str = r#"
[[mesh]]
positions = [
    [-0.5, 0, -0.5], [0.5, 0, -0.5], [0.5, 0, 0.5], [-0.5, 0, 0.5],
    [-0.5, 1, -0.5], [0.5, 1, -0.5], [0.5, 1, 0.5], [-0.5, 1, 0.5],
]
triangles = [
    [0, 1, 2], [0, 2, 3], [4, 7, 6], [4, 6, 5], [0, 4, 5], [0, 5, 1],
    [1, 5, 6], [1, 6, 2], [2, 6, 7], [2, 7, 3], [3, 7, 4], [3, 4, 0],
]
transform = { rotate_deg = [0, 25, 0], translate = [-1, 0, 0] }
material = "m"
[[mesh]]
positions = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 2], [0, 1, 2]]
triangles = [[0, 1, 2], [0, 2, 3], [0, 4, 5], [0, 5, 3]]
material = "m"
"#;

#[test]
fn few_triangles_cast_shadows_of_closed_form() {
    let lights = [
        "[[light.rectangle]]\ncenter = [1, 4, 1]\ne0 = [1.5, 0, 0]\ne1 = [0, 0, 1.5]\nstrength = 8\n",
        "[[light.disk]]\ncenter = [1, 2.5, 2]\nnormal = [0, -1, -0.3]\nradius = 1\nstrength = 4\n",
        "[[light.sphere]]\ncenter = [1, 2.5, 2]\nradius = 0.8\nstrength = 4\nfalloff = \"constant\"\n",
    ];
    for light in lights {
        let off = off_by(&format!("{ROOM}{light}{MESHES}"));
        assert!(off < 1.0, "{off} steps off under {light}");
    }
}

#[test]
fn a_sliver_of_a_ball_light_is_seen_past_a_ball() {
    // Far behind the ball, where its shadow on the floor ends
    let scene = r#"
[render]
width = 96
height = 24
[camera]
position = [-4.4, 0.6, -1]
look_at = [-2.6, 0, -3]
fov_y_deg = 12
[material.phong.m]
diffuse = 0.8
[[sphere]]
center = [-0.9, 0.9, 0]
radius = 0.9
material = "m"
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = "m"
[[light.sphere]]
center = [0.3, 1.9, 0.2]
radius = 0.25
strength = 0.9
falloff = "constant"
"#;
    let off = off_by(scene);
    assert!(off < 0.8, "{off} steps off");
}

#[test]
fn a_box_around_a_light_and_all_else_hides_nothing() {
    let light = "[[light.rectangle]]\ncenter = [1, 4, 1]\ne0 = [1.5, 0, 0]\ne1 = [0, 0, 1.5]\nstrength = 8\n";
    let ball = "[[sphere]]\ncenter = [0, 0.5, 0]\nradius = 0.5\nmaterial = \"m\"\n";
    let walls = "[[box]]\ncenter = [0, 4, 0]\nsize = [12, 8.2, 24]\nmaterial = \"m\"\n";
    let off = off_by(&format!("{ROOM}{light}{ball}{walls}"));
    assert!(off < 0.5, "{off} steps off");
}

#[test]
fn things_that_reach_into_a_ball_light_of_both_sides_are_told() {
    let light = "[[light.sphere]]\ncenter = [0.6, 1.1, 0]\nradius = 0.5\nstrength = 2\nsides = \"both\"\n\
        falloff = \"constant\"\n";
    let things = "[[sphere]]\ncenter = [0.3, 1.3, 0.2]\nradius = 0.4\nmaterial = \"m\"\n\
        [[parallelogram]]\np = [0.5, 0.9, -1]\ne0 = [1, 0.3, 0]\ne1 = [0, 0, 2]\nmaterial = \"m\"\n";
    let off = off_by(&format!("{ROOM}{light}{things}"));
    assert!(off < 1.0, "{off} steps off");
}
