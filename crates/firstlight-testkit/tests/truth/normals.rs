//! Normal maps, bump maps, and highlights filtered by the normals within a pixel.

use firstlight::*;

use crate::scenes::{bits, every_ray, one_thread, picture};

/// Texels along a side of the maps.
const SIDE: u32 = 128;

/// A picture of `SIDE` x `SIDE` texels with such red, green and blue at (u, v).
fn texels(at: impl Fn(f64, f64) -> [f64; 3]) -> Vec<u8> {
    let window = Window { x: 0, y: 0, width: SIDE, height: SIDE };
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(SIDE);
    let pixels = (0..SIDE * SIDE).map(|i| {
        let [r, g, b] = at(middle(i % SIDE), 1.0 - middle(i / SIDE)).map(|c| c as f32);
        [r, g, b, 1.0]
    });
    let image = Image { film: [SIDE, SIDE], window, pixels: pixels.collect() };
    let display = Display { encoding: Encoding::Linear, ..Display::default() };
    image.encode(Format::Png16, &display, &Receipt::default()).unwrap()
}

/// The normal map of heights with such slopes along u and v.
fn normals(slopes: impl Fn(f64, f64) -> [f64; 2]) -> Vec<u8> {
    texels(|u, v| {
        let [du, dv] = slopes(u, v);
        let length = (du * du + dv * dv + 1.0).sqrt();
        [-du, -dv, 1.0].map(|c| 0.5 * c / length + 0.5)
    })
}

const TURN: f64 = std::f64::consts::TAU;

/// Waves along u and v: their height from -1 to 1, and its slopes.
fn wave(u: f64, v: f64) -> [f64; 3] {
    let (sin_u, cos_u) = pxfm::f_sincos(3.0 * TURN * u);
    let (sin_v, cos_v) = pxfm::f_sincos(2.0 * TURN * v + 0.5);
    [sin_u * sin_v, 3.0 * TURN * cos_u * sin_v, 2.0 * TURN * sin_u * cos_v]
}

/// Their height in metres where the sides of the picture are a metre.
const HEIGHT: f64 = 0.03;

fn slopes(u: f64, v: f64) -> [f64; 2] {
    let [_, du, dv] = wave(u, v);
    [du * HEIGHT, dv * HEIGHT]
}

/// The slope of a map that bends all normals by as much, towards -u.
const TILT: f64 = 0.75;

pub fn files() -> MemoryAssets {
    let mirrored = |u: f64, v: f64| {
        let [du, dv] = slopes(1.0 - u, v);
        [-du, dv]
    };
    // A noise of texels that no two have the same of
    let rough = |u: f64, v: f64| {
        let noise = |k: f64| pxfm::f_sin((u * 12.9898 + v * 78.233 + k) * 43758.5453) * 2.0;
        [noise(0.0), noise(1.0)]
    };
    let files = [
        ("wave.png", normals(slopes)),
        ("mirrored.png", normals(mirrored)),
        ("rough.png", normals(rough)),
        ("height.png", texels(|u, v| [0.5 * wave(u, v)[0] + 0.5; 3])),
        ("tilt.png", normals(|_, _| [TILT, 0.0])),
        ("flat.png", texels(|_, _| [128.0 / 255.0, 128.0 / 255.0, 1.0])),
        ("gloss.png", texels(|u, v| [0.5 + 0.3 * wave(u, v)[0]; 3])),
    ];
    MemoryAssets { files: files.into_iter().map(|(name, file)| (name.to_owned(), file)).collect() }
}

const TEXTURES: &str = r#"
    [texture.image.wave]
    file = "wave.png"
    [texture.image.mirrored]
    file = "mirrored.png"
    [texture.image.rough]
    file = "rough.png"
    [texture.image.height]
    file = "height.png"
    [texture.image.tilt]
    file = "tilt.png"
    [texture.image.flat]
    file = "flat.png"
    [texture.image.gloss]
    file = "gloss.png"
"#;

fn scene(text: &str) -> Scene {
    let text = format!("{text}{TEXTURES}");
    let parsed = SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets);
    parsed.compile(&files(), &CompileOptions::default()).unwrap_or_else(|fault| panic!("{fault}")).scene
}

fn reference() -> RenderSettings {
    RenderSettings { reference: true, ..one_thread() }
}

/// A square of a metre from above, with a material, lit from the side.
fn square(material: &str, shape: &str) -> Vec<[f32; 4]> {
    let text = format!(
        "[render]\nwidth = 48\nheight = 48\nantialiasing = 2\n[camera]\nposition = [0.5, 3, -0.5]\n\
         look_at = [0.5, 0, -0.5]\nup = [0, 0, -1]\nprojection = \"orthographic\"\nheight = 1\n\
         [[light.directional]]\ndirection = [-0.5, -1, 0.3]\nstrength = 2\n[material.phong.square]\n\
         diffuse = 0.5\n{material}\n{shape}\nmaterial = \"square\"\n"
    );
    picture(&scene(&text), &every_ray()).pixels
}

const SQUARE: &str = "[[parallelogram]]\np = [0, 0, 0]\ne0 = [1, 0, 0]\ne1 = [0, 0, -1]";

fn largest(one: &[[f32; 4]], other: &[[f32; 4]]) -> f32 {
    let apart = one.iter().flatten().zip(other.iter().flatten()).map(|(a, b)| (a - b).abs());
    apart.fold(0.0, |most, apart| if apart > most || apart.is_nan() { apart } else { most })
}

#[test]
fn a_map_has_the_normals_of_what_is_displaced() {
    let mapped = square("normal_map = \"wave\"", SQUARE);
    // The same normals at the corners of a fine mesh that is as flat
    let n = 96;
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..(n + 1) * (n + 1) {
        let [u, v] = [k % (n + 1), k / (n + 1)].map(|i| f64::from(i) / f64::from(n));
        let [du, dv] = slopes(u, v);
        positions.push([u, 0.0, -v]);
        normals.push([-du, 1.0, dv]);
        if u < 1.0 && v < 1.0 {
            triangles.extend([[k, k + 1, k + n + 2], [k, k + n + 2, k + n + 1]]);
        }
    }
    let mesh = format!("[[mesh]]\npositions = {positions:?}\nnormals = {normals:?}\ntriangles = {triangles:?}");
    let displaced = square("", &mesh);
    let off = largest(&mapped, &displaced);
    assert!(off < 0.012, "{off}");
    // Without the map, or with the other sign, it is something else
    assert!(largest(&square("", SQUARE), &displaced) > 0.05);
    assert!(largest(&square("normal_map = \"wave\"\nnormal_scale = -1", SQUARE), &displaced) > 0.1);
}

#[test]
fn a_bump_map_is_the_normal_map_of_its_heights() {
    let normal = square("normal_map = \"wave\"", SQUARE);
    let bump = format!("bump_map = {{ texture = \"height\", factor = 2, bias = -1 }}\nbump_scale = {HEIGHT}");
    let bump = square(&bump, SQUARE);
    // But for the rim, beyond which there are no heights
    let inner = |pixels: &[[f32; 4]]| -> Vec<[f32; 4]> {
        (2..46).flat_map(|row| pixels[row * 48 + 2..row * 48 + 46].iter().copied()).collect()
    };
    let off = largest(&inner(&normal), &inner(&bump));
    assert!(off < 0.015, "{off}");
    // On a sphere the sides of the picture are not as long as each other: heights are in metres, slopes are not
    let ball = |height: f64, radius: f64| {
        let text = format!(
            "[render]\nwidth = 40\nheight = 40\n[camera]\nposition = [0, 0, {}]\nlook_at = [0, 0, 0]\n\
             [[light.directional]]\ndirection = [-1, -1, -1]\n[material.phong.ball]\n\
             bump_map = {{ texture = \"height\" }}\nbump_scale = {height}\n\
             [[sphere]]\ncenter = [0, 0, 0]\nradius = {radius}\nmaterial = \"ball\"\n",
            4.0 * radius
        );
        picture(&scene(&text), &every_ray()).pixels
    };
    let (one, twice) = (ball(0.05, 1.0), ball(0.1, 2.0));
    assert!(largest(&one, &twice) < 1e-4);
    assert!(largest(&one, &ball(0.05, 2.0)) > 0.003);
}

#[test]
fn a_flat_map_is_nearly_none_and_a_factor_of_0_is_none() {
    for more in ["", "specular = 0.5\nshininess = 30"] {
        let plain = square(more, SQUARE);
        let flat = largest(&square(&format!("{more}\nnormal_map = \"flat\""), SQUARE), &plain);
        assert!(flat > 0.0 && flat < 0.01, "{flat}");
        for none in [
            "normal_map = \"wave\"\nnormal_scale = 0",
            "bump_map = { texture = \"height\" }\nbump_scale = 0",
            "bump_map = { texture = \"height\", factor = 0 }",
        ] {
            assert_eq!(square(&format!("{more}\n{none}"), SQUARE), plain);
        }
    }
}

#[test]
fn light_fades_where_the_surface_turns_away_from_it() {
    // A square from above, whose normals all lean towards a light that sinks
    for lobe in ["", "specular = 0.3\nshininess = 20", "specular = 0.3\nshininess = 20\nnormal_fix = \"none\""] {
        for height in [2.0f64, 0.5, 0.1, 0.02, 0.002] {
            let text = format!(
                "[render]\nwidth = 8\nheight = 8\n[camera]\nposition = [0.5, 3, -0.5]\nlook_at = [0.5, 0, -0.5]\n\
                 up = [0, 0, -1]\nprojection = \"orthographic\"\nheight = 1\n[[light.directional]]\n\
                 direction = [1, {}, 0]\n[material.blinn-phong.square]\ndiffuse = 0.5\nnormal_map = \"tilt\"\n\
                 {lobe}\n{SQUARE}\nmaterial = \"square\"\n",
                -height
            );
            let found = picture(&scene(&text), &every_ray()).pixels[8 * 4 + 4][0];
            let length = (1.0 + height * height).sqrt();
            // n = (-0.6, 0.8, 0), wi = (-1, height, 0) / length, wo = (0, 1, 0)
            let (cos_i, up) = ((0.6 + 0.8 * height) / length, height / length);
            let (hx, hy) = (-1.0 / length, up + 1.0);
            let cos_h = (0.8 * hy - 0.6 * hx) / (hx * hx + hy * hy).sqrt();
            let alpha2 = 0.125 * TILT * TILT;
            let tan2 = 1.0 / (height * height);
            let (mut base, mut highlight) = (0.5 * cos_i, 0.0);
            if !lobe.is_empty() {
                highlight = 0.3 * pxfm::f_pow(cos_h, 20.0);
            }
            if !lobe.contains("none") {
                let let_through = 2.0 / (1.0 + (1.0 + alpha2 * tan2).sqrt());
                (base, highlight) = (base * let_through, highlight * let_through);
            }
            // A strength is an irradiance
            let expected = (base + highlight) / std::f64::consts::PI;
            // The slopes of the picture are those of its 16 bits
            assert!(
                (f64::from(found) - expected).abs() < 2e-4 * expected + 2e-6,
                "{lobe} {height}: {found} {expected}"
            );
        }
    }
}

#[test]
fn the_terminator_of_a_mapped_ball_is_soft() {
    let row = |fix: &str| {
        let text = format!(
            "[render]\nwidth = 200\nheight = 200\n[camera]\nposition = [0, 0, 4.2]\nlook_at = [0, 0, 0]\n\
             fov_y_deg = 30\n[[light.point]]\nposition = [-8, 0, 1]\nstrength = 60\n\
             [material.metallic-roughness.metal]\nmetallic = 1\nroughness = 0.5\nnormal_map = \"tilt\"\n\
             normal_fix = \"{fix}\"\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"metal\"\n"
        );
        let pixels = picture(&scene(&text), &every_ray()).pixels;
        let row: Vec<f32> = pixels[100 * 200 + 80..100 * 200 + 120].iter().map(|pixel| pixel[0]).collect();
        let step = row.windows(2).map(|two| (two[0] - two[1]).abs()).fold(0.0, f32::max);
        step / row.iter().copied().fold(0.0, f32::max)
    };
    let (soft, hard) = (row("raise"), row("none"));
    assert!(soft < 0.15 && hard > 0.4, "{soft} {hard}");
}

#[test]
fn integrated_light_on_bent_normals_is_that_of_many_points() {
    // Lights that the surface cuts, on normals that lean towards them and away, of each kind of lobe
    for (k, material) in [
        "phong.square]\ndiffuse = 0.6",
        "phong.square]\ndiffuse = 0.4\nspecular = 0.4\nshininess = 12",
        "metallic-roughness.square]\nroughness = 0.5",
        "metallic-roughness.square]\nmetallic = 1\nroughness = 0.4",
        "metallic-roughness.square]\nclearcoat = 1\nclearcoat_roughness = 0.4\nclearcoat_normal_map = \"wave\"",
    ]
    .into_iter()
    .enumerate()
    {
        let of = |samples: &str| {
            let text = format!(
                "[render]\nwidth = 24\nheight = 24\nantialiasing = 1\n{samples}\n[camera]\nposition = [0.5, 1.5, 1]\n\
                 look_at = [0.5, 0, -0.5]\nfov_y_deg = 32\n[[light.rectangle]]\ncenter = [-0.8, 0.1, -0.4]\n\
                 look_at = [0.5, 0.1, -0.5]\nsize = [0.8, 0.8]\nstrength = 3\n[[light.sphere]]\n\
                 center = [1.5, 0.05, -0.7]\nradius = 0.2\nstrength = 6\n[material.{material}\n\
                 normal_map = \"wave\"\n{SQUARE}\nmaterial = \"square\"\n",
            );
            picture(&scene(&text), &every_ray()).pixels
        };
        let (exact, sampled) = (of(""), of("samples = 4096"));
        let encode =
            |c: f32| 255.0 * if c <= 0.0031308 { 12.92 * c } else { 1.055 * pxfm::f_powf(c, 1.0 / 2.4) - 0.055 };
        let steps = |one: &[f32; 4], other: &[f32; 4]| {
            (0..3).map(|c| (encode(one[c].min(1.0)) - encode(other[c].min(1.0))).abs()).fold(0.0, f32::max)
        };
        let mut off: Vec<f32> = exact.iter().zip(&sampled).map(|(one, other)| steps(one, other)).collect();
        off.sort_by(f32::total_cmp);
        let (most, worst) = (off[off.len() * 99 / 100], off[off.len() - 1]);
        assert!(most < 0.8 && worst < 1.5, "{k}: {most} {worst}");
    }
}

#[test]
fn mirrored_and_turned_texture_coordinates_move_no_bump() {
    let mesh = |uvs: [[f64; 2]; 4]| {
        format!(
            "[[mesh]]\npositions = [[0, 0, 0], [1, 0, 0], [1, 0, -1], [0, 0, -1]]\n\
             triangles = [[0, 1, 2], [0, 2, 3]]\nuvs = {uvs:?}"
        )
    };
    let straight = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let flat = square("normal_map = \"wave\"", SQUARE);
    let one = square("normal_map = \"wave\"", &mesh(straight));
    // But for the rim, where the footprints of plates end, and those of meshes do not
    assert!(largest(&flat, &one) < 0.005, "{}", largest(&flat, &one));
    // The mirrored picture on mirrored coordinates
    let mirrored = square("normal_map = \"mirrored\"", &mesh(straight.map(|[u, v]| [1.0 - u, v])));
    assert!(largest(&one, &mirrored) < 0.01, "{}", largest(&one, &mirrored));
    // Turned by half a turn, with the light: the same picture turned
    let turned = square("normal_map = \"wave\"", &mesh(straight.map(|[u, v]| [1.0 - u, 1.0 - v])));
    let lit = square("normal_map = \"wave\"\nnormal_scale = -1", &mesh(straight));
    let back: Vec<_> = lit.into_iter().rev().collect();
    assert!(largest(&turned, &back) < 0.01, "{}", largest(&turned, &back));
    // Instances turn and mirror normals with the rest
    let group = |transform: &str| {
        let mesh = mesh(straight).replace("[[mesh]]", "[[group.g.mesh]]");
        square("normal_map = \"wave\"", &format!("{mesh}\nmaterial = \"square\"\n[[instance]]\nof = \"g\"{transform}"))
    };
    let placed = group("\ntransform = { scale = [-1, 1, 1], translate = [1, 0, 0] }");
    let by_uv = square("normal_map = \"wave\"", &mesh(straight.map(|[u, v]| [1.0 - u, v])));
    assert!(largest(&placed, &by_uv) < 1e-3, "{}", largest(&placed, &by_uv));
    assert!(largest(&group(""), &one) < 1e-3);
}

#[test]
fn the_back_has_the_bumps_of_the_front() {
    let of = |y: f64| {
        let text = format!(
            "[render]\nwidth = 32\nheight = 32\n[camera]\nposition = [0.5, {}, -0.5]\nlook_at = [0.5, 0, -0.5]\n\
             up = [0, 0, -1]\nprojection = \"orthographic\"\nheight = 1\n[[light.directional]]\n\
             direction = [{}, {}, {}]\n[material.blinn-phong.square]\nnormal_map = \"wave\"\nspecular = 0.3\n\
             {SQUARE}\nmaterial = \"square\"\n",
            3.0 * y,
            -0.5 * y,
            -y,
            0.3 * y
        );
        picture(&scene(&text), &every_ray()).pixels
    };
    let (front, back) = (of(1.0), of(-1.0));
    // Seen from below left and right change places; every normal and the light point the other way
    let mirrored: Vec<_> = back.chunks(32).flat_map(|row| row.iter().rev().copied()).collect();
    assert!(largest(&front, &mirrored) < 1e-4, "{}", largest(&front, &mirrored));
}

/// All that can be mapped, with materials of all kinds.
fn every_kind(samples: &str) -> Scene {
    scene(&format!(
        r#"
        [render]
        width = 44
        height = 36
        antialiasing = 3
        ambient = {{ up = 0.2, down = 0.05 }}
        {samples}
        [camera]
        position = [0.3, 1.5, 5]
        look_at = [0, 0.6, 0]
        [[light.rectangle]]
        center = [1.5, 4, 2]
        look_at = [0, 0, 0]
        size = [1, 1]
        strength = 12
        [[light.point]]
        position = [-3, 2, 2]
        strength = 8
        [material.metallic-roughness.floor]
        base_color = 0.5
        normal_map = "wave"
        roughness = {{ texture = "gloss" }}
        [material.metallic-roughness.metal]
        metallic = 1
        roughness = {{ texture = "gloss", channel = "g" }}
        normal_map = "rough"
        normal_scale = 0.3
        [material.metallic-roughness.gloss]
        roughness = {{ texture = "gloss" }}
        [material.metallic-roughness.coated]
        base_color = [0.5, 0.1, 0.1]
        normal_map = "rough"
        clearcoat = 0.8
        clearcoat_roughness = {{ texture = "gloss", factor = 0.5 }}
        clearcoat_normal_map = "wave"
        [material.metallic-roughness.steel]
        metallic = 1
        roughness = 0.25
        [material.blinn-phong.both]
        diffuse = [0.6, 0.2, 0.1]
        specular = 0.4
        shininess = {{ texture = "gloss", factor = 80 }}
        normal_map = "wave"
        bump_map = {{ texture = "height" }}
        bump_scale = 0.05
        [material.phong.veil]
        specular = 0.4
        normal_map = "rough"
        alpha = 0.6
        alpha_mode = "blend"
        [[plane]]
        material = "floor"
        [[sphere]]
        center = [-1.1, 0.5, 0]
        radius = 0.5
        material = "metal"
        [[sphere]]
        center = [1.3, 0.4, 0.3]
        radius = 0.4
        material = "gloss"
        [[sphere]]
        center = [-0.3, 0.2, 1.6]
        radius = 0.2
        material = "steel"
        [[torus]]
        center = [0.2, 0.7, 0]
        axis = [0, 0.4, 1]
        major_radius = 0.5
        minor_radius = 0.18
        material = "both"
        [[box]]
        center = [1.6, 0.4, -1.3]
        size = [0.8, 0.8, 0.8]
        material = "coated"
        [[parallelogram]]
        p = [-2, 0.1, 0.9]
        e0 = [0.9, 0, 0.3]
        e1 = [0, 0.9, 0]
        material = "veil"
        [[point_set]]
        positions = [[0.5, 0.15, 1.7], [0.9, 0.15, 1.6]]
        radius = 0.15
        material = "metal"
        [[instance]]
        of = "pair"
        transform = {{ translate = [-0.6, 1.4, -0.6], rotate_deg = [20, 30, 10], scale = [-1, 1, 0.7] }}
        [[instance]]
        of = "pair"
        material = "both"
        transform = {{ translate = [0.9, 1.3, -0.6] }}
        [[group.pair.mesh]]
        positions = [[-0.4, 0, 0], [0.4, 0, 0], [0.4, 0.7, 0.2], [-0.4, 0.7, 0.1]]
        normals = [[-0.3, 0.1, 1], [0.3, 0, 1], [0.2, 0.3, 1], [-0.2, 0.2, 1]]
        uvs = [[0, 0], [1, 0], [1, 1], [0, 1]]
        triangles = [[0, 1, 2], [0, 2, 3]]
        material = "metal"
        "#
    ))
}

#[test]
fn every_renderer_has_the_bits_of_the_plain_one() {
    let scene = every_kind("samples = 9");
    let plain = picture(&scene, &reference());
    assert!(plain.pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
    for simd in SimdLevel::available() {
        let fast = picture(&scene, &RenderSettings { simd, ..every_ray() });
        assert_eq!(bits(&fast), bits(&plain), "{simd:?}");
    }
}

#[test]
fn integrated_light_is_that_of_many_points() {
    let exact = picture(&every_kind("samples = \"exact\""), &one_thread());
    let many = picture(&every_kind("samples = 4096"), &every_ray());
    let steps = |v: f32| 255.0 * pxfm::f_powf(v.clamp(0.0, 1.0), 1.0 / 2.2);
    let apart: Vec<f32> = exact
        .pixels
        .iter()
        .zip(&many.pixels)
        .map(|(a, b)| (0..3).map(|c| (steps(a[c]) - steps(b[c])).abs()).fold(0.0, f32::max))
        .collect();
    let mut sorted = apart.clone();
    sorted.sort_by(f32::total_cmp);
    let rms = (apart.iter().map(|v| v * v).sum::<f32>() / apart.len() as f32).sqrt();
    assert!(rms < 0.2 && sorted[sorted.len() * 995 / 1000] < 1.0, "{rms} {:?}", &sorted[sorted.len() - 20..]);
}

#[test]
fn a_coat_has_normals_of_its_own() {
    let coated = |more: &str| {
        let text = format!(
            "[render]\nwidth = 48\nheight = 32\n[camera]\nposition = [0.5, 2, 1]\nlook_at = [0.5, 0, -0.5]\n\
             [[light.directional]]\ndirection = [-0.1, -1, 0.75]\nstrength = 4\n\
             [material.metallic-roughness.coated]\nbase_color = 0\nspecular = 0\nclearcoat = 1\n\
             clearcoat_roughness = 0.4\n{more}\n{SQUARE}\nmaterial = \"coated\"\n"
        );
        picture(&scene(&text), &every_ray()).pixels
    };
    // Below a black material nothing is seen of its normals
    let plain = coated("");
    assert!(plain.iter().any(|pixel| pixel[0] > 0.01));
    assert_eq!(coated("normal_map = \"wave\""), plain);
    let bent = coated("clearcoat_normal_map = \"wave\"");
    assert!(largest(&bent, &plain) > 0.01);
    assert_eq!(coated("normal_map = \"mirrored\"\nclearcoat_normal_map = \"wave\""), bent);
    assert_eq!(coated("clearcoat_normal_map = \"wave\"\nclearcoat_normal_scale = 0"), plain);
}

#[test]
fn normals_that_face_away_leave_no_black_fringe() {
    let ball = |more: &str, material: &str| {
        let text = format!(
            "[render]\nwidth = 64\nheight = 64\nantialiasing = 1\n[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\n\
             fov_y_deg = 26\n[[light.point]]\nposition = [0, 0, 5]\nstrength = 60\nshadows = false\n\
             [material.{material}.ball]\nnormal_map = \"wave\"\nnormal_scale = 12\n{more}\n\
             [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"ball\"\n"
        );
        picture(&scene(&text), &every_ray()).pixels
    };
    let black = |pixels: &[[f32; 4]]| {
        let on_ball = (0..64 * 64usize).filter(|i| {
            let [x, y] = [i % 64, i / 64].map(|k| (k as f32 - 31.5) / 32.0);
            x * x + y * y < 0.7
        });
        on_ball.filter(|i| pixels[*i][0] <= 0.0).count()
    };
    for material in ["phong", "metallic-roughness"] {
        for more in ["", "specular = 0.5"] {
            let raised = ball(more, material);
            assert!(raised.iter().flatten().all(|v| v.is_finite()));
            assert_eq!(black(&raised), 0, "{material} {more}");
        }
        assert!(black(&ball("normal_fix = \"none\"", material)) > 100);
    }
}

#[test]
fn grazing_and_degenerate_maps_are_finite() {
    for (roughness, metallic) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        for map in
            ["normal_map = \"rough\"\nnormal_scale = 1000", "bump_map = { texture = \"height\" }\nbump_scale = 50"]
        {
            let text = format!(
                "[render]\nwidth = 40\nheight = 24\nantialiasing = 2\nambient = {{ up = 1, down = 0.1 }}\n\
                 [camera]\nposition = [0, 0.02, 4]\nlook_at = [0, 0.02, 0]\n[[light.rectangle]]\n\
                 center = [0, 0.05, -4]\nlook_at = [0, 0, 0]\nsize = [3, 0.1]\nstrength = 10\n[[light.directional]]\n\
                 direction = [0, -0.01, 1]\n[material.metallic-roughness.m]\nroughness = {roughness}\n\
                 metallic = {metallic}\n{map}\n[[plane]]\nmaterial = \"m\"\n[[sphere]]\ncenter = [0, 0.01, 0]\n\
                 radius = 0.5\nmaterial = \"m\"\n[[mesh]]\npositions = [[1, 0, 0], [2, 0, 0], [1, 1, 0]]\n\
                 uvs = [[0.5, 0.5], [0.5, 0.5], [0.5, 0.5]]\ntriangles = [[0, 1, 2]]\nmaterial = \"m\"\n"
            );
            let scene = scene(&text);
            for settings in [one_thread(), every_ray()] {
                let pixels = picture(&scene, &settings).pixels;
                assert!(pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0), "{map} {roughness}");
            }
        }
    }
}

#[test]
fn filtered_highlights_flicker_less() {
    // The light of a small shiny ball as it moves by parts of a pixel
    let swing = |more: &str| {
        let of = |shift: f64| {
            let text = format!(
                "[render]\nwidth = 24\nheight = 24\nantialiasing = 1\n[camera]\nposition = [0, 0, 20]\n\
                 look_at = [0, 0, 0]\nprojection = \"orthographic\"\nheight = 24\n[[light.directional]]\n\
                 direction = [-0.4, -0.3, -1]\n[material.metallic-roughness.ball]\nmetallic = 1\nroughness = 0.15\n\
                 {more}\n[[sphere]]\ncenter = [{shift}, {}, 0]\nradius = 6\nmaterial = \"ball\"\n",
                0.37 * shift
            );
            let pixels = picture(&scene(&text), &every_ray()).pixels;
            pixels.iter().map(|pixel| pixel[0]).sum::<f32>()
        };
        let sums: Vec<f32> = (0..16).map(|k| of(f64::from(k) / 16.0)).collect();
        let mean = sums.iter().sum::<f32>() / 16.0;
        let variance = sums.iter().map(|sum| (sum - mean) * (sum - mean)).sum::<f32>() / 16.0;
        (mean, variance.sqrt() / mean)
    };
    let ((mean, filtered), (_, plain)) = (swing(""), swing("specular_antialiasing = false"));
    assert!(filtered < 0.02 && plain > 0.15, "{filtered} {plain}");
    // It is as much light as a mirror ball sends: its reflectance times a quarter of the square of its radius
    assert!((mean / (0.8 * 9.0) - 1.0).abs() < 0.12, "{mean}");
}
