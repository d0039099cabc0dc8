//! Surfaces that are not opaque: layers of camera rays, and what is left of light behind them.

use std::num::NonZeroUsize;

use firstlight::*;

use crate::buffers::{film, floats, scene, wholes};
use crate::converged;
use crate::scenes::{bits, every_ray, one_thread, picture};

/// A camera at height 0 that looks along -z.
const CAMERA: &str = "[camera]\nposition = [0, 0, 10]\nlook_at = [0, 0, 0]\nfov_y_deg = 0.5\n";
const MATERIALS: &str = r#"
    [texture.checkerboard.holes]
    counts = [7, 5]
    colors = [1, 0]
    [texture.checkerboard.veil]
    counts = [3, 4]
    colors = [0.9, 0.2]
    [material.phong.sheet]
    diffuse = 0.6
    alpha = 0.5
    alpha_mode = "blend"
    [material.blinn-phong.veil]
    diffuse = [0.7, 0.3, 0.2]
    specular = 0.4
    alpha = { texture = "veil" }
    alpha_mode = "blend"
    [material.phong.leaf]
    diffuse = [0.2, 0.6, 0.1]
    specular = 0.2
    alpha = { texture = "holes" }
    alpha_mode = "mask"
"#;

/// Shapes of all kinds that are not opaque, between lights of all kinds and things that are.
fn every_kind(samples: &str) -> String {
    format!(
        r#"
        [render]
        width = 36
        height = 30
        antialiasing = 3
        ambient = 0.1
        background = [0.2, 0.3, 0.5]
        {samples}
        [camera]
        position = [0.3, 1.5, 6]
        look_at = [0, 0.6, 0]
        [[light.rectangle]]
        center = [1, 5, 2]
        e0 = [1.5, 0, 0]
        e1 = [0, 0, 1.5]
        strength = 8
        [[light.sphere]]
        name = "ball"
        center = [-0.4, 1.3, -0.6]
        radius = 0.3
        strength = 2
        [[light.point]]
        position = [-3, 4, 2]
        strength = 10
        [[light.directional]]
        direction = [0.3, -1, -0.5]
        strength = 0.5
        {MATERIALS}
        [[plane]]
        [[parallelogram]]
        p = [-1.5, 0.2, 0.5]
        e0 = [1.2, 0, 0.3]
        e1 = [0, 1.4, 0]
        material = "leaf"
        [[sphere]]
        center = [1, 0.8, 0]
        radius = 0.6
        material = "veil"
        [[box]]
        center = [-0.2, 0.5, -1]
        size = [0.8, 1, 0.6]
        material = "sheet"
        [[box]]
        center = [1.5, 0.3, -1.2]
        size = [0.6, 0.6, 0.6]
        [[torus]]
        center = [-1.4, 0.4, -1]
        major_radius = 0.5
        minor_radius = 0.2
        material = "sheet"
        [[disk]]
        center = [0.3, 1.9, 0.5]
        normal = [0.2, 1, 0]
        radius = 0.4
        material = "leaf"
        [[point_set]]
        positions = [[-0.6, 0.9, 1.5], [-0.3, 1.1, 1.4]]
        radius = 0.15
        material = "veil"
        [[mesh]]
        positions = [[0.2, 0.1, 1.5], [0.8, 0.1, 1.5], [0.8, 0.9, 1.4], [0.2, 0.9, 1.4]]
        uvs = [[0, 0], [1, 0], [1, 1], [0, 1]]
        triangles = [[0, 1, 2], [0, 2, 3]]
        material = "leaf"
        [[mesh]]
        positions = [[-0.6, 0.1, 1.8], [0.1, 0.1, 1.7], [0.1, 0.7, 1.7], [-0.6, 0.7, 1.8]]
        uvs = [[0, 0], [1, 0], [1, 1], [0, 1]]
        alphas = [1, 0.2, 0.6, 0.9]
        triangles = [[0, 1, 2], [0, 2, 3]]
        materials = ["sheet", "leaf"]
        face_materials = [0, 1]
        [[instance]]
        of = "pair"
        transform = {{ translate = [1.2, 0.1, 1.3], rotate_deg = [0, 30, 10] }}
        [[instance]]
        of = "pair"
        material = "sheet"
        transform = {{ translate = [-1.3, 0.1, 1.5], scale = 0.7 }}
        [[group.pair.sphere]]
        center = [0, 0.3, 0]
        radius = 0.2
        material = "leaf"
        [[group.pair.mesh]]
        positions = [[-0.3, 0, 0], [0.3, 0, 0], [0, 0.6, 0], [-0.3, 0, -0.3], [0.3, 0, -0.3], [0, 0.6, -0.3]]
        triangles = [[0, 1, 2], [3, 4, 5]]
        materials = ["leaf", "sheet"]
        face_materials = [0, 1]
        "#
    )
}

fn reference() -> RenderSettings {
    RenderSettings { reference: true, ..one_thread() }
}

/// The pixel in the middle of a picture of one pixel, by every renderer, which agree.
fn pixel(shapes: &str, render: &str) -> [f32; 4] {
    let of = |samples: &str| {
        let head = format!("[render]\nwidth = 1\nheight = 1\nantialiasing = 2\nsamples = {samples}\n{render}\n");
        scene(&format!("{head}{CAMERA}{MATERIALS}{shapes}"))
    };
    let (sampled, exact) = (of("36"), of("\"exact\""));
    let [plain, fast] = [reference(), every_ray()].map(|settings| picture(&sampled, &settings).pixels[0]);
    let default = picture(&exact, &one_thread()).pixels[0];
    assert_eq!(plain, fast);
    let apart = plain.iter().zip(&default).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(apart < 2e-3, "{plain:?} {default:?}");
    plain
}

fn wall(z: f64, material: &str) -> String {
    format!("[[parallelogram]]\np = [-3, -3, {z}]\ne0 = [6, 0, 0]\ne1 = [0, 6, 0]\nmaterial = \"{material}\"\n")
}

#[test]
fn five_sheets_of_one_half_leave_a_thirty_second() {
    let sheets: String = (0..5).map(|k| wall(f64::from(k) * 0.5, "sheet")).collect();
    let [.., alpha] = pixel(&sheets, "transparent = true");
    assert_eq!(alpha, 1.0 - 0.03125);
    // Ambient light of each, in front of the background
    let [r, ..] = pixel(&sheets, "ambient = 1\nbackground = [1, 1, 1]");
    assert!((r - (0.6 * (1.0 - 0.03125) + 0.03125)).abs() < 1e-6, "{r}");
    // Both sides of a closed shape, and of a point of a set, are layers
    for shape in [
        "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"sheet\"",
        "[[box]]\ncenter = [0, 0, 0]\nmaterial = \"sheet\"",
        "[[point_set]]\npositions = [[0, 0, 0]]\nradius = 1\nmaterial = \"sheet\"",
    ] {
        assert_eq!(pixel(shape, "transparent = true")[3], 0.75, "{shape}");
        assert_eq!(pixel(&format!("{shape}\nsingle_sided = true"), "transparent = true")[3], 0.5, "{shape}");
    }
    // Twenty leave next to nothing, which the last takes
    let sheets: String = (0..20).map(|k| wall(f64::from(k) * 0.1, "sheet")).collect();
    assert_eq!(pixel(&sheets, "transparent = true")[3], 1.0);
    // A sheet of two triangles, with a ray right on their common edge
    let quad = "[[mesh]]\npositions = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]\n\
                triangles = [[0, 1, 2], [0, 2, 3]]\nmaterial = \"sheet\"";
    assert_eq!(pixel(quad, "transparent = true")[3], 0.5);
}

#[test]
fn a_material_may_be_single_sided_for_some_faces() {
    let faces = |material: &str| {
        format!(
            "[material.phong.thin]\nsingle_sided = true\n[[mesh]]\n\
             positions = [[-1, -1, 0], [1, -1, 0], [0, 1, 0], [-1, -1, -1], [1, -1, -1], [0, 1, -1]]\n\
             triangles = [[0, 2, 1], [3, 5, 4]]\nmaterials = [\"thin\", \"{material}\"]\nface_materials = [0, 1]\n"
        )
    };
    let alpha = |material: &str| pixel(&faces(material), "transparent = true")[3];
    assert_eq!([alpha("thin"), alpha("sheet"), alpha("leaf")], [0.0, 0.5, 1.0]);
}

#[test]
fn the_alpha_of_vertices_multiplies() {
    let mesh = |material: &str, alphas: [f64; 3]| {
        let mesh = "[[mesh]]\npositions = [[-3, -3, 0], [3, -3, 0], [0, 3, 0]]\ntriangles = [[0, 1, 2]]";
        pixel(&format!("{mesh}\nalphas = {alphas:?}\nmaterial = \"{material}\"\n"), "transparent = true")[3]
    };
    assert!((mesh("sheet", [0.4; 3]) - 0.2).abs() < 1e-6);
    // At the middle of the picture the third corner counts half
    assert!((mesh("sheet", [0.2, 0.2, 1.0]) - 0.5 * 0.6).abs() < 1e-6);
    let cut = "[material.phong.cut]\nalpha_mode = \"mask\"\ncutoff = 0.3\n";
    let mesh = |alpha: f64| {
        let mesh = "[[mesh]]\npositions = [[-3, -3, 0], [3, -3, 0], [0, 3, 0]]\ntriangles = [[0, 1, 2]]\n";
        pixel(&format!("{cut}{mesh}alphas = [{alpha}, {alpha}, {alpha}]\nmaterial = \"cut\"\n"), "transparent = true")
            [3]
    };
    assert_eq!([mesh(0.29), mesh(0.31)], [0.0, 1.0]);
}

/// The alpha of a texture and that of vertices are multiplied before the cutoff: each by itself is above it.
#[test]
fn a_mask_cuts_off_the_product_with_the_alpha_of_vertices() {
    let mask = "[texture.checkerboard.gray]\ncounts = [1, 1]\ncolors = [0.8, 0.8]\n\
                [material.phong.cut]\nalpha = { texture = \"gray\" }\nalpha_mode = \"mask\"\ncutoff = 0.5\n";
    let corners = "positions = [[-3, -3, 0], [3, -3, 0], [0, 3, 0]]\ntriangles = [[0, 1, 2]]\n\
                   uvs = [[0, 0], [1, 0], [0.5, 1]]\n";
    let mesh =
        |alpha: f64| format!("{mask}[[mesh]]\n{corners}alphas = [{alpha}, {alpha}, {alpha}]\nmaterial = \"cut\"\n");
    let seen = |alpha: f64| pixel(&mesh(alpha), "transparent = true")[3];
    assert_eq!([seen(0.6), seen(0.65), seen(1.0)], [0.0, 1.0, 1.0]);
    // And so its shadow
    let floor = "[[parallelogram]]\np = [-3, -3, -1]\ne0 = [6, 0, 0]\ne1 = [0, 6, 0]\n\
                 [[light.directional]]\ndirection = [0, 0, -1]\n";
    let lit = |alpha: f64| {
        let text =
            format!("[camera]\nposition = [9, 0, 1]\nlook_at = [0, 0, -1]\nfov_y_deg = 0.5\n{}{floor}", mesh(alpha));
        let scene = scene(&format!("[render]\nwidth = 1\nheight = 1\n{text}"));
        picture(&scene, &one_thread()).pixels[0][0] > 0.0
    };
    assert_eq!([lit(0.6), lit(0.65)], [true, false]);
}

#[test]
fn light_behind_a_sheet_is_half_and_behind_a_mask_has_holes() {
    let floor = "[[parallelogram]]\np = [-3, -3, 0]\ne0 = [6, 0, 0]\ne1 = [0, 6, 0]\n";
    let lid = |material: &str| {
        format!(
            "[[parallelogram]]\np = [-3, -3, 2]\ne0 = [6, 0, 0]\ne1 = [0, 6, 0]\n\
             material = \"{material}\"\nvisible = false\n"
        )
    };
    for light in [
        "[[light.rectangle]]\ncenter = [0, 0, 4]\ne0 = [1, 0, 0]\ne1 = [0, 1, 0]\nsides = \"both\"\nvisible = false\n",
        "[[light.sphere]]\ncenter = [0, 1, 4]\nradius = 0.4\nvisible = false\n",
        "[[light.point]]\nposition = [0.5, 0, 4]\n",
        "[[light.directional]]\ndirection = [0.1, 0.2, -1]\n",
    ] {
        let open = pixel(&format!("{floor}{light}"), "")[0];
        let behind = pixel(&format!("{floor}{light}{}", lid("sheet")), "")[0];
        assert!((behind - 0.5 * open).abs() < 1e-4 * open, "{light}: {behind} of {open}");
        let twice =
            pixel(&format!("{floor}{light}{}{}", lid("sheet"), lid("sheet").replace("-3, 2]", "-3, 1]")), "")[0];
        assert!((twice - 0.25 * open).abs() < 1e-4 * open, "{light}: {twice} of {open}");
    }
    // A lamp far above a mask: dark squares of its size, and lit ones
    let text = format!(
        "[render]\nwidth = 70\nheight = 50\nantialiasing = 1\n[camera]\n\
         position = [0, 0, 9]\nprojection = \"orthographic\"\n\
         height = 5\n[[light.directional]]\ndirection = [0, 0, -1]\n{MATERIALS}[[parallelogram]]\np = [-9, -9, 0]\n\
         e0 = [18, 0, 0]\ne1 = [0, 18, 0]\n[[parallelogram]]\np = [-3.5, -2.5, 2]\ne0 = [7, 0, 0]\ne1 = [0, 5, 0]\n\
         material = \"leaf\"\nvisible = false\n"
    );
    let image = picture(&scene(&text), &one_thread());
    for (i, pixel) in image.pixels.iter().enumerate() {
        let (column, row) = (i % 70 / 10, i / 70 / 10);
        // The first colour, which stops light, is at the lower left, and there is an odd number of rows
        let is_hole = (column + row) % 2 == 1;
        assert_eq!(pixel[0] > 0.0, is_hole, "{i}");
    }
}

/// A picture of stripes whose numbers are above one half on `solid` of `of`.
fn stripes(solid: usize, of: usize) -> MemoryAssets {
    let value = |x: usize| if x % of < solid { 0.8 } else { 0.1 };
    let window = Window { x: 0, y: 0, width: 256, height: 4 };
    let pixels = (0..256 * 4).map(|i| [value(i % 256), 0.0, 0.0, 1.0]).collect();
    let image = Image { film: [256, 4], window, pixels };
    let display = Display { encoding: Encoding::Linear, ..Display::default() };
    let png = image.encode(Format::Png8, &display, &Receipt::default()).unwrap();
    MemoryAssets { files: [("stripes.png".to_owned(), png)].into() }
}

#[test]
fn a_fence_to_the_horizon_is_its_share() {
    let text = "[render]\nwidth = 200\nheight = 20\nantialiasing = 4\ntransparent = true\n\
        [camera]\nposition = [0, 1, 0]\nlook_at = [0, 0.92, -1]\nfov_y_deg = 8\n\
        [texture.image.stripes]\nfile = \"stripes.png\"\n[material.phong.fence]\n\
        alpha = { texture = \"stripes\" }\nalpha_mode = \"mask\"\n[[parallelogram]]\np = [-4000, 0, 0]\n\
        e0 = [8000, 0, 0]\ne1 = [0, 0, -8000]\nmaterial = \"fence\"\ntransform = { translate = [0, 0, 0] }\n";
    let text = text.replace(
        "[[parallelogram]]\np = [-4000, 0, 0]\ne0 = [8000, 0, 0]\ne1 = [0, 0, -8000]",
        "[[mesh]]\npositions = [[-4000, 0, 0], [4000, 0, 0], [4000, 0, -8000], [-4000, 0, -8000]]\n\
         uvs = [[0, 0], [1000, 0], [1000, 1000], [0, 1000]]\ntriangles = [[0, 1, 2], [0, 2, 3]]",
    );
    for (solid, of) in [(1, 4), (2, 4), (5, 8)] {
        let parsed = SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets);
        let scene = parsed.compile(&stripes(solid, of), &CompileOptions::default()).unwrap().scene;
        let image = picture(&scene, &one_thread());
        // The rows near the horizon, where a pixel is wider than a stripe, and the fence is all there is
        let rows = |a: usize, b: usize| {
            let sum: f64 = image.pixels[a * 200..b * 200].iter().map(|pixel| f64::from(pixel[3])).sum();
            sum / ((b - a) * 200) as f64
        };
        let share = solid as f64 / of as f64;
        for (a, b) in [(1, 6), (6, 12), (12, 20)] {
            assert!((rows(a, b) - share).abs() < 0.01, "{solid} of {of}: {} of {share}, rows {a}..{b}", rows(a, b));
        }
    }
}

#[test]
fn crossed_sheets_are_the_same_in_any_order() {
    let first = "[[parallelogram]]\np = [-1, -1, -1]\ne0 = [2, 0, 2]\ne1 = [0, 2, 0]\nmaterial = \"veil\"\n";
    let second = "[[parallelogram]]\np = [-1, -1, 1]\ne0 = [2, 0, -2]\ne1 = [0, 2, 0]\nmaterial = \"sheet\"\n";
    let light =
        "[[light.rectangle]]\ncenter = [0, 4, 4]\ne0 = [1, 0, 0]\ne1 = [0, 0, 1]\nsides = \"both\"\nsamples = 9\n";
    let of = |shapes: [&str; 2]| {
        let head = "[render]\nwidth = 40\nheight = 40\nantialiasing = 2\nbackground = [0.1, 0.2, 0.4]\nambient = 0.2\n";
        let camera = CAMERA.replace("0.5", "20");
        scene(&format!("{head}{camera}{MATERIALS}{light}{}{}", shapes[0], shapes[1]))
    };
    let (one, other) = (of([first, second]), of([second, first]));
    assert_eq!(bits(&picture(&one, &every_ray())), bits(&picture(&other, &every_ray())));
}

#[test]
fn all_renderers_of_samples_give_the_same_bits() {
    let scene = scene(&every_kind("samples = 16"));
    let plain = bits(&picture(&scene, &reference()));
    for simd in SimdLevel::available() {
        for (threads, visibility) in [(1, VisibilityMode::Shafts), (3, VisibilityMode::Traced)] {
            let threads = NonZeroUsize::new(threads);
            let settings = RenderSettings { simd, threads, visibility, aa_mode: AaMode::Full, ..one_thread() };
            assert!(bits(&picture(&scene, &settings)) == plain, "{simd:?} {threads:?} {visibility:?}");
        }
    }
}

#[test]
fn the_default_is_the_converged_picture() {
    for samples in ["samples = \"exact\"", "samples = 9"] {
        let scene = scene(&every_kind(samples));
        let many = if samples == "samples = 9" { samples } else { "samples = 1024" };
        let truth = picture(&self::scene(&every_kind(many)), &every_ray());
        let image = picture(&scene, &one_thread());
        let shown = |image: &Image| -> Vec<f64> {
            image.pixels.iter().flat_map(|pixel| converged::displayed(&scene, *pixel)).collect()
        };
        let off: Vec<f64> = shown(&truth).iter().zip(&shown(&image)).map(|(a, b)| (a - b).abs()).collect();
        let worst = off.iter().copied().fold(0.0, f64::max);
        let rms = (off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt();
        assert!(worst < 2.0 && rms < 0.2, "{samples}: {worst} steps at worst, rms {rms}");
        // Also where threads differ
        let two = RenderSettings { threads: NonZeroUsize::new(2), ..one_thread() };
        assert!(bits(&image) == bits(&picture(&scene, &two)));
    }
}

#[test]
fn ids_and_depth_are_of_the_first_layer_that_is_half_there() {
    let veil = "[material.phong.faint]\nalpha = 0.4\nalpha_mode = \"blend\"\n";
    let text = format!(
        "[render]\nwidth = 1\nheight = 1\nantialiasing = 2\ntransparent = true\n{CAMERA}{MATERIALS}{veil}{}{}{}",
        wall(4.0, "faint"),
        wall(2.0, "sheet"),
        wall(0.0, "sheet").replace("material = \"sheet\"", "")
    );
    let scene = scene(&text);
    let objects = (0..3).map(|id| Buffer::Coverage(SurfaceId(id)));
    let planes = [Plane::Color, Plane::ObjectId, Plane::Depth, Plane::BackgroundCoverage, Plane::Alpha, Plane::Opacity];
    let buffers: Vec<Buffer> = planes.into_iter().map(Buffer::from).chain(objects).collect();
    let film = film(&scene, &RenderSettings { buffers, ..one_thread() });
    assert_eq!(wholes(&film, Plane::ObjectId), [2]);
    assert!((floats(&film, Plane::Depth)[0] - 8.0).abs() < 1e-5);
    let share = |id: u32| floats(&film, Buffer::Coverage(SurfaceId(id)))[0];
    assert_eq!([share(0), share(1), share(2)], [0.4, 0.6 * 0.5, 0.6 * 0.5]);
    assert_eq!(floats(&film, Plane::BackgroundCoverage), [0.0]);
    assert_eq!(floats(&film, Plane::Alpha), [1.0]);
    // But the opacity is that of the very first
    assert_eq!(floats(&film, Plane::Opacity), [0.4]);
    // Rays of the library see the same
    let (ray, _) = scene.camera().ray(0.5, 0.5, 1.0);
    assert_eq!(scene.intersect(&ray).map(|hit| hit.surface), Some(SurfaceId(1)));
}

#[test]
fn light_passes_solids_that_a_mask_leaves_out() {
    let room = |things: &str| {
        let text = format!(
            "[render]\nwidth = 64\nheight = 48\n[camera]\nposition = [0, 3, 6]\nlook_at = [0, 0, 0]\nfov_y_deg = 40\n\
             [[light.sphere]]\ncenter = [0, 4, 0]\nradius = 0.5\nstrength = 20\n[material.phong.clear]\n\
             alpha = 0.5\nalpha_mode = \"mask\"\ncutoff = 0.8\n[[parallelogram]]\np = [-3, 0, 3]\n\
             e0 = [6, 0, 0]\ne1 = [0, 0, -6]\n{things}"
        );
        picture(&scene(&text), &one_thread()).pixels
    };
    let empty = room("");
    for thing in [
        "[[plane]]\npoint = [0, 1, 0]\nnormal = [0.2, 1, 0.1]",
        "[[box]]\ncenter = [0, 1, 0]\nsize = [3, 0.5, 3]",
        "[[disk]]\ncenter = [0, 1, 0]\nradius = 2",
        "[[sphere]]\ncenter = [0, 1, 0]\nradius = 0.8",
        "[[parallelogram]]\np = [-1, 1, 1]\ne0 = [2, 0, 0]\ne1 = [0, 0.3, -2]",
    ] {
        let clear = room(&format!("{thing}\nmaterial = \"clear\"\n"));
        let off = clear.iter().flatten().zip(empty.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 0.003, "{thing}: {off}");
    }
}

#[test]
fn shadow_rays_through_edges_meet_each_place_once() {
    // Through the middles of two edges of a tetrahedron that do not touch: two layers, of two triangles each
    let text = format!(
        "{CAMERA}{MATERIALS}[[light.point]]\nposition = [0, 4, 0]\n[[mesh]]\n\
         positions = [[-1, 1, 0], [1, 1, 0], [0, 2, -1], [0, 2, 1]]\n\
         triangles = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]\nmaterial = \"sheet\"\n"
    );
    let scene = scene(&text);
    let fractions = scene.visible_fractions(LightId(0), 1, |_| (DVec3::ZERO, Some(Vec3::Y)));
    assert_eq!(fractions, [0.25]);
}

#[test]
fn points_see_a_part_of_a_light_through_a_sheet() {
    let text = format!(
        "{CAMERA}{MATERIALS}[[light.rectangle]]\ncenter = [0, 4, 0]\ne0 = [1, 0, 0]\ne1 = [0, 0, 1]\n\
         samples = 16\n[[rectangle]]\ncenter = [0, 2, 0]\nsize = [9, 9]\nnormal = [0, 1, 0]\nmaterial = \"sheet\"\n"
    );
    let scene = scene(&text);
    let up = Some(Vec3::Y);
    let fractions =
        scene.visible_fractions(LightId(0), 2, |i| (DVec3::new(0.0, if i == 0 { 0.0 } else { 3.0 }, 0.0), up));
    assert_eq!(fractions, [0.5, 1.0]);
}

#[test]
fn pictures_with_layers_are_lit_again() {
    let of = |strength: f64| {
        let text = every_kind("samples = 9\nbuffers = [\"color\", \"relight\"]");
        scene(&text.replace("strength = 2\n", &format!("strength = {strength}\n")))
    };
    let sampled = every_ray();
    let before = of(2.0);
    let settings = RenderSettings { buffers: before.buffers().to_vec(), ..sampled.clone() };
    let first = film(&before, &settings);
    let receipt = before.buffers_receipt(&settings, before.buffers());
    let bytes = first.encode(before.buffers(), Format::Npz, &FileSettings::default(), &receipt).unwrap();
    let file = StoredPlanes::read(&bytes).unwrap();
    let relit = relight(&file, &[("ball".into(), LightChange::Strength(3.0))]).unwrap();
    let truth = picture(&of(3.0), &sampled);
    let off = relit.image.pixels.as_flattened().iter().zip(truth.pixels.as_flattened());
    let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    // The emission of a light that is seen through layers is known by its share, in single precision
    assert!(off < 1e-6, "{off}");
    let same = relight(&file, &[("ball".into(), LightChange::Times(1.0))]).unwrap();
    assert!(same.image.pixels == picture(&before, &sampled).pixels);
}

#[test]
fn many_lights_are_half_behind_a_sheet() {
    let lamps: String = (0..20)
        .map(|k| format!("[[light.point]]\nposition = [{}, 1, 4]\nstrength = 0.5\n", f64::from(k) * 0.1 - 1.0))
        .collect();
    let floor = "[[parallelogram]]\np = [-3, -3, 0]\ne0 = [6, 0, 0]\ne1 = [0, 6, 0]\n";
    let lid = |material: &str| wall(2.0, material) + "visible = false\n";
    let open = pixel(&format!("{floor}{lamps}"), "")[0];
    let behind = pixel(&format!("{floor}{lamps}{}", lid("sheet")), "")[0];
    assert!((behind - 0.5 * open).abs() < 1e-4 * open, "{behind} of {open}");
}

#[test]
fn what_is_out_of_range_is_refused_and_what_does_nothing_is_spoken_of() {
    let compiled = |fields: &str| {
        let text = format!(
            "{CAMERA}[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"m\"\n[material.phong.m]\n{fields}"
        );
        SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets).compile(&NoAssets, &CompileOptions::default())
    };
    for (fields, path) in [
        ("alpha_mode = \"mask\"\ncutoff = 1.5", "material.phong.m.cutoff"),
        ("alpha_mode = \"blend\"\nalpha = -0.1", "material.phong.m.alpha"),
        ("alpha_mode = \"veil\"", "material.phong.m.alpha_mode"),
    ] {
        let error = compiled(fields).expect_err(fields);
        assert_eq!(error.faults.iter().map(|fault| &fault.path[..]).collect::<Vec<_>>(), [path], "{fields}");
    }
    let advice = compiled("alpha = 0.5").unwrap().advice;
    assert!(advice.iter().any(|one| one.path == "material.phong.m.alpha"), "{advice:?}");
}
