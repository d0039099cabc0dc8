//! Shadow catchers: what is left of what is behind them.

use firstlight::*;

use crate::buffers::{film, floats, scene, wholes};
use crate::scenes::{every_ray, picture};

/// A pixel that looks straight down at the origin.
const DOWN: &str = "[camera]\nposition = [0, 10, 0]\nlook_at = [0, 0, 0]\nup = [0, 0, 1]\nfov_y_deg = 0.02\n";
const GROUND: &str = "[material.shadow-catcher.ground]\n[material.shadow-catcher.light]\nalpha = 0.6\n\
    [[rectangle]]\ncenter = [0, 0, 0]\nsize = [40, 40]\nnormal = [0, 1, 0]\nmaterial = \"ground\"\n";
/// Two point lights, at either side.
const LAMPS: &str = "[[light.point]]\nname = \"a\"\nposition = [1, 3, 0]\n[[light.point]]\nname = \"b\"\n\
    position = [-1, 3, 0]\n";
/// What hides lamp `a`.
const BALL: &str = "[[sphere]]\ncenter = [0.5, 1.5, 0]\nradius = 0.2\nvisible = false\n";
/// Half of the light above, and the plate that hides the other half.
const HALF: &str = "[[light.rectangle]]\ncenter = [0, 4, 0]\ne0 = [1, 0, 0]\ne1 = [0, 0, 1]\nvisible = false\n\
    strength = 30\n[[rectangle]]\ncenter = [2, 2, 0]\nsize = [4, 4]\nnormal = [0, 1, 0]\nvisible = false\n";

fn pixel_of(text: &str, render: &str, settings: &RenderSettings) -> [f32; 4] {
    let all = format!("[render]\nwidth = 1\nheight = 1\nantialiasing = 4\n{render}\n{text}");
    picture(&scene(&all), settings).pixels[0]
}

/// The alpha of the pixel, by all renderers.
fn alpha(text: &str) -> f32 {
    let text = format!("{DOWN}{GROUND}{text}");
    let settings = RenderSettings::default();
    let reference = RenderSettings { reference: true, ..settings.clone() };
    let [exact, sampled] = [&settings, &reference].map(|settings| pixel_of(&text, "transparent = true", settings));
    assert_eq!([exact, sampled].map(|[r, g, b, _]| [r, g, b]), [[0.0; 3]; 2], "it is black");
    assert!((exact[3] - sampled[3]).abs() < 2e-3, "{exact:?} {sampled:?}");
    // Over a background, what is left of that
    let over = pixel_of(&text, "background = [0.5, 0.25, 1]", &settings);
    for (channel, background) in over.into_iter().zip([0.5, 0.25, 1.0]) {
        assert!((channel - background * (1.0 - exact[3])).abs() < 1e-6, "{over:?} {exact:?}");
    }
    assert_eq!(over[3], 1.0);
    exact[3]
}

#[test]
fn alpha_is_the_part_of_the_light_that_is_hidden() {
    assert_eq!(alpha(LAMPS), 0.0);
    assert_eq!(alpha(""), 0.0, "without light there is no shadow");
    assert!((alpha(&format!("{LAMPS}{BALL}")) - 0.5).abs() < 1e-6);
    // Lamp `a` is the first
    let stronger = LAMPS.replacen("[1, 3, 0]", "[1, 3, 0]\nstrength = 3", 1);
    assert!((alpha(&format!("{stronger}{BALL}")) - 0.75).abs() < 1e-6);
    let red_and_green = LAMPS.replacen("[1, 3, 0]", "[1, 3, 0]\ncolor = [1, 0, 0]", 1).replacen(
        "[-1, 3, 0]",
        "[-1, 3, 0]\ncolor = [0, 1, 0]",
        1,
    );
    assert!((alpha(&format!("{red_and_green}{BALL}")) - 0.2126 / (0.2126 + 0.7152)).abs() < 1e-5);
    let unblocked = LAMPS.replacen("[1, 3, 0]", "[1, 3, 0]\nshadows = false", 1);
    assert_eq!(alpha(&format!("{unblocked}{BALL}")), 0.0);
    let unhurt = BALL.replace("visible", "casts_shadow = false\nvisible");
    assert_eq!(alpha(&format!("{LAMPS}{unhurt}")), 0.0);
    // Half of a light; a sheet that lets a half through
    assert!((alpha(HALF) - 0.5).abs() < 1e-3);
    let sheet = "[material.phong.sheet]\nalpha = 0.5\nalpha_mode = \"blend\"\n";
    let through = BALL
        .replace("visible", "material = \"sheet\"\nvisible")
        .replace("sphere", "disk")
        .replace("radius = 0.2", "radius = 0.2\nnormal = [0, 1, 0]");
    assert!((alpha(&format!("{LAMPS}{sheet}{through}")) - 0.25).abs() < 1e-6);
}

#[test]
fn an_umbra_is_black_and_alpha_makes_it_lighter() {
    let umbra = "[[light.sphere]]\ncenter = [0, 6, 0]\nradius = 0.3\nvisible = false\n[[sphere]]\ncenter = [0, 2, 0]\n\
        radius = 1\nvisible = false\n";
    assert_eq!(alpha(umbra), 1.0);
    let lighter = format!("{DOWN}{}{umbra}", GROUND.replace("material = \"ground\"", "material = \"light\""));
    assert_eq!(pixel_of(&lighter, "transparent = true", &RenderSettings::default()), [0.0, 0.0, 0.0, 0.6]);
    let over_white = pixel_of(&lighter, "ambient = 9\nbackground = 1", &RenderSettings::default());
    assert!(
        over_white[..3].iter().all(|channel| (channel - 0.4).abs() < 1e-6) && over_white[3] == 1.0,
        "{over_white:?}"
    );
}

#[test]
fn what_is_behind_shows_through_and_what_is_before_does_not_change() {
    let settings = RenderSettings::default();
    let shadowed = format!("{DOWN}{GROUND}{LAMPS}{BALL}");
    let near = |got: [f32; 4], expected: [f32; 4]| {
        assert!(got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{got:?} for {expected:?}");
    };
    let of = |more: &str| pixel_of(&format!("{shadowed}{more}"), "transparent = true", &settings);
    let sign = "[material.unlit.sign]\ncolor = 0.8\n";
    let disk = |y: f64, more: &str| {
        format!("[[disk]]\ncenter = [0, {y}, 0]\nnormal = [0, 1, 0]\nradius = 1\ncasts_shadow = false\n{more}\n")
    };
    // Half of the light is hidden
    near(of(&format!("{sign}{}", disk(-1.0, "material = \"sign\""))), [0.4, 0.4, 0.4, 1.0]);
    near(of(&format!("{sign}{}", disk(1.0, "material = \"sign\""))), [0.8, 0.8, 0.8, 1.0]);
    // Behind and before a sheet
    let veil = "[material.unlit.veil]\ncolor = 0.8\nalpha = 0.5\nalpha_mode = \"blend\"\n";
    near(of(&format!("{veil}{}", disk(1.0, "material = \"veil\""))), [0.4, 0.4, 0.4, 0.75]);
    near(of(&format!("{veil}{}", disk(-1.0, "material = \"veil\""))), [0.2, 0.2, 0.2, 0.75]);
    // Through the hole of a mask
    let mask = "[material.unlit.veil]\ncolor = 0.8\nalpha = 0.1\nalpha_mode = \"mask\"\n";
    near(of(&format!("{mask}{}", disk(1.0, "material = \"veil\""))), [0.0, 0.0, 0.0, 0.5]);
    // The first of two catchers counts
    near(of(&disk(-0.5, "material = \"ground\"")), [0.0, 0.0, 0.0, 0.5]);
    near(of(&disk(0.5, "material = \"light\"")), [0.0, 0.0, 0.0, 0.3]);
    // No ray ends there, and none but those of light is stopped
    let scene = scene(&format!("[render]\nwidth = 3\nheight = 3\n{shadowed}"));
    let asked = [Plane::ObjectId, Plane::Depth].map(Buffer::from).to_vec();
    let film = film(&scene, &RenderSettings { buffers: asked, ..settings });
    assert!(wholes(&film, Plane::ObjectId).iter().all(|id| *id == 0));
    assert!(floats(&film, Plane::Depth).iter().all(|depth| !depth.is_finite() || *depth == 0.0));
}

/// Things on a ground of a kind, in front of a background.
fn set(ground: &str, render: &str, lights: &str) -> String {
    format!(
        r#"
        [render]
        width = 36
        height = 30
        antialiasing = 2
        {render}
        [camera]
        position = [1, 2.4, 6]
        look_at = [0, 0.3, 0]
        [material.shadow-catcher.catcher]
        [material.shadow-catcher.pale]
        alpha = 0.7
        [material.phong.red]
        diffuse = [0.8, 0.2, 0.1]
        specular = 0.2
        [material.phong.veil]
        diffuse = 0.6
        alpha = 0.4
        alpha_mode = "blend"
        [material.metallic-roughness.metal]
        base_color = [0.9, 0.7, 0.4]
        roughness = 0.4
        [[rectangle]]
        center = [0, 0, 0]
        size = [9, 9]
        normal = [0, 1, 0]
        {ground}
        [[mesh]]
        positions = [[-3, 0, -3], [3, 0, -3], [3, 3, -3], [-3, 3, -3]]
        triangles = [[0, 1, 2], [0, 2, 3]]
        {ground}
        [[sphere]]
        center = [0, 0.7, 0]
        radius = 0.7
        material = "red"
        [[sphere]]
        center = [1.6, -0.1, 0.4]
        radius = 0.5
        material = "metal"
        [[disk]]
        center = [-1.2, 0.8, 1]
        normal = [0.3, 0.2, 1]
        radius = 0.7
        material = "veil"
        [[group.post.box]]
        center = [0, 0.5, 0]
        size = [0.4, 1, 0.4]
        material = "metal"
        [[group.post.disk]]
        center = [0, 1.01, 0]
        normal = [0, 1, 0]
        radius = 0.4
        material = "pale"
        [[instance]]
        of = "post"
        transform = {{ translate = [-2, 0, -0.6], rotate_deg = [0, 30, 0] }}
        {lights}
        "#
    )
}

/// Three lights, of which two have an extent.
fn three(samples: &str) -> String {
    format!(
        "[[light.rectangle]]\ncenter = [2, 4, 2]\ne0 = [1.5, 0, 0]\ne1 = [0, 0, 1.5]\nstrength = 9\n{samples}\n\
         [[light.sphere]]\ncenter = [-3, 3, 1]\nradius = 0.4\ncolor = [0.6, 0.8, 1]\nstrength = 9\n{samples}\n\
         [[light.point]]\nposition = [0.5, 3, 3]\nstrength = 6\n"
    )
}

const CATCHER: &str = "material = \"catcher\"";
const NOT_THERE: &str = "visible = false";

/// Twenty small lamps.
fn many() -> String {
    let lamp = |k: u32| {
        let x = 0.4 * f64::from(k) - 4.0;
        format!("[[light.sphere]]\ncenter = [{x}, {}, 2]\nradius = 0.1\nstrength = 9\n", 2.0 + 0.3 * f64::from(k % 3))
    };
    (0..20).map(lamp).collect()
}

#[test]
fn all_renderers_of_sampled_lights_agree() {
    let reference = RenderSettings { reference: true, ..RenderSettings::default() };
    let traced = RenderSettings { visibility: VisibilityMode::Traced, ..RenderSettings::default() };
    for render in ["transparent = true", "background = [0.2, 0.4, 0.9]"] {
        for lights in [three("samples = 9"), many().replace("radius", "samples = 4\nradius")] {
            let scene = scene(&set(CATCHER, render, &lights));
            let truth = picture(&scene, &reference);
            assert!(truth.pixels == picture(&scene, &every_ray()).pixels);
            assert!(truth.pixels == picture(&scene, &traced).pixels);
        }
    }
}

#[test]
fn where_nothing_is_in_shadow_the_picture_is_that_without_catchers() {
    for (kind, lights) in [("sampled", three("samples = 9")), ("few", three("")), ("many", many())] {
        let lights = lights.replace("strength", "shadows = false\nstrength");
        for render in ["transparent = true", "background = [0.2, 0.4, 0.9]"] {
            for settings in [RenderSettings::default(), every_ray()] {
                let of = |ground: &str| picture(&scene(&set(ground, render, &lights)), &settings).pixels;
                let (with, without) = (of(CATCHER), of(NOT_THERE));
                let pairs = with.as_flattened().iter().zip(without.as_flattened());
                let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                // Integrated light with shadows and without is off by errors of its own, each within the tolerance
                let allowed = if kind == "sampled" { 0.0 } else { 2.0 / 255.0 };
                assert!(off <= allowed, "{kind}, {render}: {off}");
            }
        }
    }
}

#[test]
fn the_background_beside_things_in_light_is_untouched() {
    // What hangs above casts its shadow aside, beyond the plate
    let of = |ground: &str, render: &str| {
        let text = format!(
            "[render]\nwidth = 40\nheight = 40\n{render}\n[camera]\nposition = [0, 6, 6]\nlook_at = [0, 0, 0]\n\
             fov_y_deg = 30\n[material.shadow-catcher.catcher]\n[[rectangle]]\ncenter = [0, 0, 0]\nsize = [3, 3]\n\
             normal = [0, 1, 0]\n{ground}\n[[sphere]]\ncenter = [0, 2, 1]\nradius = 0.6\n\
             [[mesh]]\npositions = [[-2, 3, 0], [2, 3, 0], [0, 3.4, 0]]\ntriangles = [[0, 1, 2]]\n\
             [[light.rectangle]]\ncenter = [-9, 3, 0]\ne0 = [0, 1, 0]\ne1 = [0, 0, 1]\nstrength = 60\n\
             visible = false\n\
             [[light.rectangle]]\ncenter = [9, 3.2, 0]\ne0 = [0, 1, 0]\ne1 = [0, 0, 1]\nstrength = 60\n\
             visible = false\n"
        );
        picture(&scene(&text), &RenderSettings::default()).pixels
    };
    for render in ["transparent = true", "background = [0.2, 0.4, 0.9]"] {
        let (with, without) = (of(CATCHER, render), of(NOT_THERE, render));
        let off = with.iter().zip(&without).filter(|(a, b)| a != b).count();
        assert_eq!(off, 0, "pixels differ");
    }
}

#[test]
fn pictures_of_integrated_light_are_near_the_converged_ones() {
    for (lights, samples) in [(three(""), "samples = 1024"), (many(), "samples = 64")] {
        let render = "transparent = true";
        let exact = picture(&scene(&set(CATCHER, render, &lights)), &RenderSettings::default());
        // The last one of three has no extent
        let sampled = lights.replace("strength", &format!("{samples}\nstrength"));
        let sampled = sampled.replace(&format!("{samples}\nstrength = 6"), "strength = 6");
        let truth = picture(&scene(&set(CATCHER, render, &sampled)), &every_ray());
        let off: Vec<f64> =
            exact.pixels.iter().zip(&truth.pixels).map(|(a, b)| f64::from(255.0 * (a[3] - b[3]).abs())).collect();
        let rms = (off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt();
        let worst = off.iter().copied().fold(0.0, f64::max);
        assert!(rms < 0.35 && worst < 3.0, "rms {rms}, worst {worst}");
        let shadows = truth.pixels.iter().filter(|pixel| pixel[..3] == [0.0; 3] && pixel[3] > 0.1).count();
        assert!(shadows > 25, "{shadows} pixels are shadow alone");
    }
}

#[test]
fn parts_of_a_picture_are_those_of_the_whole_and_threads_change_nothing() {
    let scene = scene(&set(CATCHER, "background = [0.2, 0.4, 0.9]", &three("")));
    let whole = picture(&scene, &RenderSettings::default());
    let crop = Window { x: 7, y: 11, width: 20, height: 15 };
    let settings =
        RenderSettings { crop: Some(crop), threads: std::num::NonZeroUsize::new(1), ..RenderSettings::default() };
    let part = picture(&scene, &settings);
    for (k, pixel) in part.pixels.iter().enumerate() {
        let (x, y) = (7 + k % 20, 11 + k / 20);
        assert_eq!(*pixel, whole.pixels[y * 36 + x], "{x} {y}");
    }
}

#[test]
fn the_order_of_lights_matters_to_rounding_alone() {
    let lights = three("samples = 9");
    let (rectangle, rest) = lights.split_once("[[light.sphere]]").unwrap();
    let more = rectangle.replace("center = [2, 4, 2]", "center = [-2, 4, 2]").replace("strength = 9", "strength = 3");
    let of = |lights: String| picture(&scene(&set(CATCHER, "transparent = true", &lights)), &every_ray()).pixels;
    let rest = format!("[[light.sphere]]{rest}");
    let (one, other) = (of(format!("{rectangle}{more}{rest}")), of(format!("{more}{rectangle}{rest}")));
    let off = one.as_flattened().iter().zip(other.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off < 1e-5, "{off}");
}

#[test]
fn terms_add_up_to_the_colour_and_lights_send_nothing_to_catchers() {
    let text = set(
        CATCHER,
        "background = [0.2, 0.4, 0.9]\nambient = 0.1\nbuffers = [\"color\", \"relight\"]",
        &three("samples = 9"),
    );
    let scene = scene(&text);
    let settings = RenderSettings { buffers: scene.buffers().to_vec(), ..every_ray() };
    let first = film(&scene, &settings);
    let receipt = scene.buffers_receipt(&settings, scene.buffers());
    let bytes = first.encode(scene.buffers(), Format::Npz, &FileSettings::default(), &receipt).unwrap();
    let file = StoredPlanes::read(&bytes).unwrap();
    let relit = relight(&file, &[("#1".into(), LightChange::Times(1.0))]).unwrap();
    let picture = picture(&scene, &every_ray());
    let off = relit.image.pixels.as_flattened().iter().zip(picture.pixels.as_flattened());
    let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off < 1e-6, "{off}");
    assert!(relit.keeps_shadows, "the shadows on catchers are those of the file");
}
