//! Buffers of the centre rays: closed forms, and what leads from pixels to the world and back.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;

use firstlight::*;

use crate::scenes::bits;

/// A little of everything: a sphere, a wall seen from behind, two meshes that are joined into one tree, two instances
/// of a group with a mesh and a torus, a point set, lights that are seen.
pub const SCENE: &str = r#"
    [render]
    width = 90
    height = 70
    antialiasing = 2
    transparent = true
    motion_to = "next"
    [camera]
    position = [0.3, 0.7, 10]
    look_at = [0.1, 0, 0]
    shift = [0.1, -0.05]
    [material.phong.red]
    diffuse = [1, 0, 0]
    [material.phong.green]
    diffuse = [0, 1, 0]
    [[sphere]]
    name = "ball"
    center = [-2, 0, 0]
    radius = 1
    material = "red"
    [[parallelogram]]
    name = "wall"
    p = [-3, -2, -4]
    e0 = [0, 5, 0]
    e1 = [6, 0, 0]
    material = "green"
    [[mesh]]
    positions = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    triangles = [[0, 1, 2], [0, 2, 3]]
    material = "red"
    [[mesh]]
    name = "second"
    positions = [[1.5, 0, 0], [2.5, 0, 0.5], [2.5, 1, 0.5], [1.5, 1, 0]]
    triangles = [[0, 1, 2], [0, 2, 3]]
    normals = [[0, 0, 1], [0.3, 0, 0.95], [0.3, 0.2, 0.9], [0, 0, 1]]
    uvs = [[0, 0], [1, 0], [1, 1], [0, 1]]
    material = "green"
    [[point_set]]
    positions = [[-0.6, 1.6, 0], [-0.2, 1.7, 0]]
    radius = 0.15
    [[instance]]
    name = "one"
    of = "pair"
    transform = { translate = [-0.5, -1.5, 0] }
    [[instance]]
    of = "pair"
    transform = { translate = [1.5, -1.5, 0], rotate_deg = [0, 30, 0] }
    [[group.pair.torus]]
    name = "ring"
    center = [0, 0, 0]
    axis = [0, 0, 1]
    major_radius = 0.4
    minor_radius = 0.1
    [[group.pair.mesh]]
    positions = [[-0.2, -0.2, 0.1], [0.2, -0.2, 0.1], [0, 0.2, 0.1]]
    triangles = [[0, 1, 2]]
    [[light.rectangle]]
    name = "panel"
    center = [2, 2, 0]
    e0 = [0.8, 0, 0]
    e1 = [0, 0.6, 0.2]
    sides = "both"
    [[light.sphere]]
    center = [-2, 2, 1]
    radius = 0.3
"#;

pub fn scene(text: &str) -> Scene {
    let parsed = SceneDesc::parse("scene.toml", text.as_bytes(), &NoAssets);
    parsed.compile(&NoAssets, &CompileOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene
}

pub fn film(scene: &Scene, settings: &RenderSettings) -> Film {
    settings.check(scene).unwrap_or_else(|fault| panic!("{fault}"));
    match render(scene, settings, &|_, _| ControlFlow::Continue(())) {
        ControlFlow::Continue((film, _)) => film,
        ControlFlow::Break(()) => unreachable!("nothing stops this render"),
    }
}

fn of(buffers: &[Plane]) -> RenderSettings {
    RenderSettings { buffers: buffers.iter().map(|plane| (*plane).into()).collect(), ..RenderSettings::default() }
}

pub fn floats(film: &Film, of: impl Into<Buffer>) -> &[f32] {
    let of = of.into();
    match film.numbers(of) {
        Some(PlaneNumbers::Floats(numbers)) => numbers,
        other => panic!("{of:?}: {other:?}"),
    }
}

pub fn wholes(film: &Film, plane: Plane) -> &[u32] {
    match film.numbers(plane) {
        Some(PlaneNumbers::Wholes(numbers)) => numbers,
        other => panic!("{plane:?}: {other:?}"),
    }
}

/// The numbers of an entry of a receipt.
fn entry<const N: usize>(receipt: &Receipt, key: &str) -> [f64; N] {
    let (_, value) = receipt.entries.iter().find(|(k, _)| k == key).unwrap_or_else(|| panic!("no {key}"));
    let numbers: Vec<f64> = value.split(' ').map(|n| n.parse().unwrap()).collect();
    numbers.try_into().unwrap_or_else(|all| panic!("{key}: {all:?}"))
}

#[test]
fn each_is_what_the_centre_ray_meets() {
    let scene = scene(SCENE);
    let film = film(&scene, &of(Plane::ALL));
    assert!(film.planes().eq(Plane::ALL.iter().map(|plane| Buffer::from(*plane))));
    let frame = scene.camera().frame();
    let names = scene.buffers_receipt(&RenderSettings::default(), &of(Plane::ALL).buffers);
    let names = &names.entries.iter().find(|(key, _)| key == "object_names").unwrap().1;
    let names: Vec<Option<String>> = serde_json::from_str(names).unwrap();
    let mut met = vec![0; names.len()];
    let mut triangles = std::collections::BTreeSet::new();
    let width = scene.width() as usize;
    for pixel in 0..width * scene.height() as usize {
        let three = |plane| <[f32; 3]>::try_from(&floats(&film, plane)[3 * pixel..][..3]).unwrap();
        let whole = |plane| wholes(&film, plane)[pixel];
        let (x, y) = ((pixel % width) as f32 + 0.5, (pixel / width) as f32 + 0.5);
        let (ray, differential) = scene.camera().ray(x, y, 1.0);
        let Some(hit) = scene.intersect(&ray) else {
            assert_eq!(
                (floats(&film, Plane::Depth)[pixel], floats(&film, Plane::Distance)[pixel]),
                (f32::INFINITY, f32::INFINITY)
            );
            assert_eq!(
                [Plane::ObjectId, Plane::MaterialId, Plane::PrimitiveId, Plane::FaceOrientation].map(whole),
                [0; 4]
            );
            assert_eq!([Plane::Position, Plane::Normal, Plane::NormalCamera, Plane::Tangent].map(three), [[0.0; 3]; 4]);
            continue;
        };
        let id = whole(Plane::ObjectId) as usize;
        met[id - 1] += 1;
        assert_eq!(id, hit.surface.index() + 1);
        // Where it is, by its distance
        let p = ray.o + ray.d.as_dvec3() * hit.t;
        let near = |a: DVec3, b: [f32; 3]| (a - DVec3::from(b.map(f64::from))).length() < 3e-5;
        assert!(near(p, three(Plane::Position)), "{p} {:?}", three(Plane::Position));
        let from_eye = p - frame.position;
        let axes = [frame.right, frame.up, -frame.forward].map(|axis| axis.as_dvec3());
        let seen = |v: DVec3| DVec3::from(axes.map(|axis| axis.dot(v)));
        assert!(near(seen(from_eye), three(Plane::PositionCamera)));
        assert!((f64::from(floats(&film, Plane::Distance)[pixel]) - from_eye.length()).abs() < 1e-5);
        assert!((f64::from(floats(&film, Plane::Depth)[pixel]) + seen(from_eye).z).abs() < 1e-5);
        // Normals are unit and turned to the viewer, and the same in both spaces
        for (world, camera) in
            [(Plane::Normal, Plane::NormalCamera), (Plane::NormalGeometric, Plane::NormalGeometricCamera)]
        {
            let n = DVec3::from(three(world).map(f64::from));
            assert!((n.length() - 1.0).abs() < 1e-5 && near(seen(n), three(camera)));
        }
        let ng = Vec3::from(three(Plane::NormalGeometric));
        assert!(ng.dot(ray.d) <= 0.0);
        if id > scene.surfaces() - scene.lights().count() {
            assert_eq!((whole(Plane::MaterialId), whole(Plane::PrimitiveId)), (0, 0));
            continue;
        }
        let surface = scene.surface(&ray, &hit, &differential);
        assert_eq!(three(Plane::Normal), surface.ns.to_array());
        assert_eq!(ng, surface.ng);
        assert_eq!(floats(&film, Plane::Uv)[2 * pixel..][..2], surface.uv.to_array());
        assert_eq!(whole(Plane::MaterialId), surface.material.0 + 1);
        let tangent = Vec3::from(three(Plane::Tangent));
        assert!((tangent.length() - 1.0).abs() < 1e-5 && tangent.dot(ng).abs() < 1e-4);
        // The corners weighed are where it is
        if names[id - 1].as_deref() == Some("second") {
            let corners = [[1.5, 0.0, 0.0], [2.5, 0.0, 0.5], [2.5, 1.0, 0.5], [1.5, 1.0, 0.0]].map(DVec3::from);
            let [a, b, c] = [[0, 1, 2], [0, 2, 3]][whole(Plane::PrimitiveId) as usize - 1].map(|k: usize| corners[k]);
            let [u, v] =
                <[f32; 2]>::try_from(&floats(&film, Plane::Barycentric)[2 * pixel..][..2]).unwrap().map(f64::from);
            assert!((a * (1.0 - u - v) + b * u + c * v - p).length() < 1e-5);
            triangles.insert(whole(Plane::PrimitiveId));
        }
        match names[id - 1].as_deref() {
            // It faces away: e0 x e1 points backwards
            Some("wall") => assert_eq!(whole(Plane::FaceOrientation), 2),
            Some("ball") => assert_eq!((whole(Plane::FaceOrientation), whole(Plane::PrimitiveId)), (1, 0)),
            _ => {}
        }
    }
    assert!(met.iter().all(|pixels| *pixels > 3), "{names:?} {met:?}");
    assert_eq!(triangles.into_iter().collect::<Vec<_>>(), [1, 2]);
    assert_eq!(names[0].as_deref(), Some("ball"));
    assert!(
        names.iter().flatten().any(|name| name == "one/ring") && names.iter().flatten().any(|name| name == "panel")
    );
}

#[test]
fn objects_are_told_in_their_own_space() {
    let scene = scene(SCENE);
    let film = film(&scene, &of(Plane::ALL));
    let receipt = scene.buffers_receipt(&RenderSettings::default(), &of(Plane::ALL).buffers);
    let list = |key: &str| -> Vec<Option<String>> {
        serde_json::from_str(&receipt.entries.iter().find(|(k, _)| k == key).unwrap().1).unwrap()
    };
    let (names, instances) = (list("object_names"), list("instance_names"));
    assert_eq!(instances, [Some("one".to_owned()), None]);
    let (sin, cos) = (0.5, 0.75f64.sqrt());
    let mut placed = [0; 3];
    for pixel in 0..90 * 70 {
        let three = |plane| {
            let numbers = <[f32; 3]>::try_from(&floats(&film, plane)[3 * pixel..][..3]).unwrap();
            Vec3::from(numbers).as_dvec3()
        };
        let id = wholes(&film, Plane::ObjectId)[pixel] as usize;
        let instance = wholes(&film, Plane::InstanceId)[pixel];
        let (p, n) = (three(Plane::PositionObject), three(Plane::NormalObject));
        let shapes = names.len() - 2;
        if id == 0 || id > shapes {
            assert_eq!((instance, p, n, three(Plane::Albedo)), (0, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO));
            continue;
        }
        // As the scene says: moved, and around y first
        let turned = |v: DVec3| DVec3::new(cos * v.x + sin * v.z, v.y, cos * v.z - sin * v.x);
        let (there, normal) = match instance {
            0 => (p, n),
            1 => (p + DVec3::new(-0.5, -1.5, 0.0), n),
            _ => (turned(p) + DVec3::new(1.5, -1.5, 0.0), turned(n)),
        };
        assert!((there - three(Plane::Position)).length() < 2e-6, "{instance}: {there} {}", three(Plane::Position));
        assert!((normal - three(Plane::Normal)).length() < 2e-6, "{instance}: {normal} {}", three(Plane::Normal));
        // Those without a material have the one that is white
        let albedo = [DVec3::X, DVec3::Y].get(wholes(&film, Plane::MaterialId)[pixel] as usize - 1).copied();
        assert!(albedo.is_none_or(|albedo| albedo == three(Plane::Albedo)), "{}", three(Plane::Albedo));
        let within = names[id - 1].as_deref().is_some_and(|name| name.starts_with("one/"));
        assert!(!within || instance == 1);
        placed[instance as usize] += 1;
    }
    assert!(placed.iter().all(|pixels| *pixels > 20), "{placed:?}");
}

#[test]
fn materials_are_seen_in_their_numbers() {
    let of_material = |material: &str| {
        let text = format!(
            "[render]\nwidth = 2\nheight = 1\nantialiasing = 1\n[camera]\nposition = [0, 0, 5]\n\
             [texture.checkerboard.half]\ncounts = [2, 1]\ncolors = [0.25, 0.75]\n[material.{material}\n\
             [[rectangle]]\ncenter = [0, 0, 0]\nsize = [20, 20]\nnormal = [0, 0, 1]\n"
        );
        let text = text.replace("normal = [0, 0, 1]\n", "normal = [0, 0, 1]\nmaterial = \"m\"\n");
        let film =
            film(&scene(&text), &of(&[Plane::Roughness, Plane::Metallic, Plane::Opacity, Plane::FilteredMetallic]));
        let of = |plane| [floats(&film, plane)[0], floats(&film, plane)[1]];
        assert_eq!(of(Plane::Metallic), of(Plane::FilteredMetallic));
        assert_eq!(of(Plane::Opacity), [1.0; 2]);
        [of(Plane::Roughness), of(Plane::Metallic)]
    };
    assert_eq!(of_material("metallic-roughness.m]\nroughness = 0.3\nmetallic = 0.75"), [[0.3; 2], [0.75; 2]]);
    let textured = of_material("metallic-roughness.m]\nroughness = { texture = \"half\" }\nmetallic = 1");
    let [mut left, mut right] = textured[0];
    if left > right {
        std::mem::swap(&mut left, &mut right);
    }
    // The area mean over a footprint is rounded
    assert!((left - 0.25).abs() < 1e-6 && (right - 0.75).abs() < 1e-6, "{left} {right}");
    assert_eq!(textured[1], [1.0; 2]);
    // Blinn-Phong of exponent 30: alpha^2 = 2 / 32; Phong of a quarter of the exponent is as wide
    let [blinn, phong] = [("blinn-phong", "30"), ("phong", "7.5")]
        .map(|(kind, s)| of_material(&format!("{kind}.m]\nspecular = 0.5\nshininess = {s}")));
    assert_eq!((blinn, phong), ([[0.5; 2], [0.0; 2]], [[0.5; 2], [0.0; 2]]));
    assert_eq!(of_material("phong.m]\ndiffuse = 0.5"), [[1.0; 2], [0.0; 2]]);
    assert_eq!(of_material("unlit.m]\ncolor = 0.5"), [[1.0; 2], [0.0; 2]]);
}

#[test]
fn pixels_lead_to_the_world_and_back() {
    let turned = SCENE.replace("look_at = [0.1, 0, 0]", "look_at = [-3, 2, 1]\nup = [0.4, 1, 0.2]\nfov_y_deg = 80");
    for text in [SCENE, &turned] {
        let scene = scene(text);
        let buffers = [Plane::Position, Plane::Depth];
        let film = film(&scene, &of(&buffers));
        let receipt = scene.buffers_receipt(&RenderSettings::default(), &of(&buffers).buffers);
        let k: [f64; 9] = entry(&receipt, "intrinsics");
        let (width, mut compared) = (scene.width() as usize, 0);
        for (pixel, depth) in floats(&film, Plane::Depth).iter().enumerate().filter(|(_, depth)| depth.is_finite()) {
            let p: Vec<f64> = floats(&film, Plane::Position)[3 * pixel..][..3].iter().copied().map(f64::from).collect();
            let moved = |key| {
                let m: [f64; 16] = entry(&receipt, key);
                [0, 4, 8].map(|row| m[row] * p[0] + m[row + 1] * p[1] + m[row + 2] * p[2] + m[row + 3])
            };
            let [x, y, z] = moved("opencv_camera_from_world");
            assert_eq!(moved("opengl_camera_from_world").map(|v| v as f32), [x, -y, -z].map(|v| v as f32));
            assert!((z - f64::from(*depth)).abs() < 1e-5, "{z} {depth}");
            let (u, v) = (k[0] * x / z + k[2], k[4] * y / z + k[5]);
            let middle = ((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
            assert!((u - middle.0).abs() < 2e-3 && (v - middle.1).abs() < 2e-3, "{u} {v} {middle:?}");
            compared += 1;
        }
        assert!(compared > 200);
    }
}

#[test]
fn the_depth_of_a_facing_wall_is_the_same_everywhere() {
    let wall = "[camera]\nposition = [0, 0, 5]\nPROJECTION\n[[parallelogram]]\np = [-9, -9, -2]\ne0 = [18, 0, 0]\n\
                e1 = [0, 18, 0]\n[render]\nwidth = 40\nheight = 30\n";
    for projection in ["", "projection = \"orthographic\"\nheight = 3"] {
        let film = film(&scene(&wall.replace("PROJECTION", projection)), &of(&[Plane::Depth, Plane::Distance]));
        assert!(floats(&film, Plane::Depth).iter().all(|depth| (depth - 7.0).abs() < 1e-6));
        // At the corner of the picture, along the diagonal of a box
        let distance = floats(&film, Plane::Distance)[0];
        // tan 22.5 degrees
        let half = (2.0f32.sqrt() - 1.0) * 7.0;
        let [right, up] = [half * 39.0 / 30.0, half * 29.0 / 30.0];
        let expected = if projection.is_empty() { (49.0 + right * right + up * up).sqrt() } else { 7.0 };
        assert!((distance - expected).abs() < 1e-5, "{distance} {expected}");
    }
}

#[test]
fn nothing_else_decides_them() {
    let scene_of = |n: u32| scene(&SCENE.replace("antialiasing = 2", &format!("antialiasing = {n}")));
    let centers: Vec<Plane> = Plane::ALL.iter().copied().filter(|plane| plane.sampling() == Sampling::Center).collect();
    let bytes = |film: &Film| -> Vec<Vec<u8>> {
        centers.iter().map(|plane| film.numbers(*plane).unwrap().to_le_bytes()).collect()
    };
    let two = scene_of(2);
    let expected = bytes(&film(&two, &of(&centers)));
    // With the picture, by other renderers, in other tiles
    let base = of(Plane::ALL);
    for settings in [
        RenderSettings { threads: NonZeroUsize::new(3), tile_size: 11, ..base.clone() },
        RenderSettings { reference: true, simd: SimdLevel::Fallback, ..base.clone() },
        RenderSettings { aa_mode: AaMode::Full, visibility: VisibilityMode::Traced, ..base.clone() },
    ] {
        assert!(bytes(&film(&two, &settings)) == expected, "{settings:?}");
    }
    for n in [1, 5] {
        assert!(bytes(&film(&scene_of(n), &of(&centers))) == expected, "{n}");
    }
    // A part is the same part
    let window = Window { x: 13, y: 7, width: 40, height: 50 };
    let part = film(&two, &RenderSettings { crop: Some(window), ..of(&[Plane::Depth]) });
    let whole = film(&two, &of(&[Plane::Depth]));
    for j in 0..50 {
        let row = &floats(&whole, Plane::Depth)[(j + 7) * 90 + 13..][..40];
        assert_eq!(&floats(&part, Plane::Depth)[j * 40..][..40], row);
    }
    // And the picture knows nothing of them
    let (alone, with) = (film(&two, &RenderSettings::default()).develop(), film(&two, &base).develop());
    assert_eq!(bits(&alone), bits(&with));
    let alpha = film(&two, &of(&[Plane::Alpha]));
    assert!(floats(&alpha, Plane::Alpha).iter().zip(&alone.pixels).all(|(alpha, pixel)| *alpha == pixel[3]));
    assert!(floats(&alpha, Plane::Alpha).contains(&0.0));
}

#[test]
fn lists_that_ask_for_nothing_or_twice_are_refused_and_centre_rays_counted() {
    let scene = scene(SCENE);
    assert!(of(&[]).check(&scene).unwrap_err().contains("asks for nothing"));
    assert!(of(&[Plane::Depth, Plane::Uv, Plane::Depth]).check(&scene).unwrap_err().contains("\"depth\""));
    let rays = |settings: &RenderSettings| match render(&scene, settings, &|_, _| ControlFlow::Continue(())) {
        ControlFlow::Continue((_, stats)) => stats.camera_rays,
        ControlFlow::Break(()) => unreachable!("nothing stops this render"),
    };
    let pixels = 90 * 70;
    assert_eq!(rays(&of(&[Plane::Depth])), pixels);
    assert_eq!(rays(&of(&[Plane::Color, Plane::Depth])), rays(&of(&[Plane::Color])) + pixels);
}
