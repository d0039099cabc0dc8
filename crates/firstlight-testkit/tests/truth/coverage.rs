//! Coverage, Cryptomatte and filtered buffers: against rays that are cast one by one, and against buffers of centre
//! rays where a pixel has no other.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;

use firstlight::*;

use crate::buffers::{SCENE, film, floats, scene};

fn of(buffers: impl IntoIterator<Item = Buffer>) -> RenderSettings {
    RenderSettings { buffers: buffers.into_iter().collect(), ..RenderSettings::default() }
}

/// The background and every object.
fn all_coverage(scene: &Scene) -> Vec<Buffer> {
    let objects = (0..scene.surfaces() as u32).map(|object| Buffer::Coverage(SurfaceId(object)));
    std::iter::once(Plane::BackgroundCoverage.into()).chain(objects).collect()
}

/// An entry of the receipt of buffers.
fn said(scene: &Scene, settings: &RenderSettings, key: &str) -> String {
    let receipt = scene.buffers_receipt(settings, &settings.buffers);
    let entry = receipt.entries.into_iter().find(|(k, _)| k == key);
    entry.unwrap_or_else(|| panic!("no {key}")).1
}

/// The names of things, that of id 1 first.
fn names(scene: &Scene, settings: &RenderSettings, of: &str) -> Vec<Option<String>> {
    serde_json::from_str(&said(scene, settings, &format!("{of}_names"))).unwrap()
}

/// Their ids in Cryptomatte, by name.
fn manifest(scene: &Scene, settings: &RenderSettings, of: &str) -> BTreeMap<String, u32> {
    let text = said(scene, settings, &format!("{of}_manifest"));
    let digits: BTreeMap<String, String> = serde_json::from_str(&text).unwrap();
    digits.into_iter().map(|(name, digits)| (name, u32::from_str_radix(&digits, 16).unwrap())).collect()
}

/// The shares of a pixel of a layer, by the bits of ids, in the order of the ranks.
fn ranks(layer: &[f32], pixel: usize) -> Vec<(u32, f32)> {
    let ranks = layer[12 * pixel..][..12].chunks(2).map(|rank| (rank[0].to_bits(), rank[1]));
    ranks.take_while(|(_, share)| *share > 0.0).collect()
}

#[test]
fn coverage_counts_the_rays_that_meet_each_object() {
    let scene = scene(SCENE);
    let (n, width) = (scene.antialiasing(), scene.width());
    let settings = of(all_coverage(&scene));
    let film = film(&scene, &settings);
    let planes: Vec<&[f32]> = settings.buffers.iter().map(|buffer| floats(&film, *buffer)).collect();
    let mut mixed = 0;
    for pixel in 0..width * scene.height() {
        let mut counts = vec![0; planes.len()];
        for sub in 0..n * n {
            let at = |first: u32, sub: u32| first as f32 + (sub as f32 + 0.5) / n as f32;
            let (x, y) = (at(pixel % width, sub % n), at(pixel / width, sub / n));
            let (ray, _) = scene.camera().ray(x, y, 1.0 / n as f32);
            counts[scene.intersect(&ray).map_or(0, |hit| hit.surface.index() + 1)] += 1;
        }
        for (plane, count) in planes.iter().zip(&counts) {
            assert_eq!(plane[pixel as usize], *count as f32 / (n * n) as f32);
        }
        mixed += i32::from(counts.iter().filter(|count| **count > 0).count() > 1);
    }
    assert!(mixed > 150, "{mixed}");
}

#[test]
fn coverage_adds_up_to_one_in_every_scene_that_is_built_in() {
    for builtin in builtin_scenes() {
        let mut desc = SceneDesc::parse(builtin.name, builtin.text.as_bytes(), &NoAssets).desc;
        (desc.render.width, desc.render.height, desc.render.antialiasing) = (48, 48, 3);
        desc.render.buffers = vec![
            BufferDesc::parse("coverage:*").unwrap(),
            BufferDesc::parse("coverage:background").unwrap(),
            BufferDesc::parse("crypto-object").unwrap(),
        ];
        let scene = desc.compile(&NoAssets, &CompileOptions::default()).unwrap().scene;
        let settings = of(scene.buffers().iter().copied());
        assert_eq!(settings.buffers.len(), scene.surfaces() + 2, "all of its lights are seen");
        let film = film(&scene, &settings);
        let layer = floats(&film, Plane::CryptoObject);
        let shares = &settings.buffers[..settings.buffers.len() - 1];
        for pixel in 0..48 * 48 {
            let total: f32 = shares.iter().map(|buffer| floats(&film, *buffer)[pixel]).sum();
            assert!((total - 1.0).abs() < 1e-6, "{}: {total}", builtin.name);
            let total: f32 = ranks(layer, pixel).iter().map(|(_, share)| share).sum();
            let background = floats(&film, Plane::BackgroundCoverage)[pixel];
            assert!((total + background - 1.0).abs() < 1e-6, "{}: {total}", builtin.name);
        }
    }
}

#[test]
fn cryptomatte_decodes_to_coverage() {
    let scene = scene(SCENE);
    let crypto = [Plane::CryptoObject, Plane::CryptoInstance, Plane::CryptoMaterial].map(Buffer::from);
    let settings = of(all_coverage(&scene).into_iter().chain(crypto));
    let film = film(&scene, &settings);
    let (names, objects) = (names(&scene, &settings, "object"), manifest(&scene, &settings, "object"));
    let instances = manifest(&scene, &settings, "instance");
    assert_eq!(instances.keys().collect::<Vec<_>>(), ["#2", "one"]);
    let one = instances["one"];
    for pixel in 0..90 * 70 {
        let mut expected: BTreeMap<u32, f32> = BTreeMap::new();
        let mut of_one = 0.0;
        for (place, name) in names.iter().enumerate() {
            let share = floats(&film, Buffer::Coverage(SurfaceId(place as u32)))[pixel];
            // What has the same name is one
            let name = name.clone().unwrap_or_else(|| format!("#{}", place + 1));
            *expected.entry(objects[&name]).or_default() += share;
            of_one += if name == "one" || name.starts_with("one/") { share } else { 0.0 };
        }
        expected.retain(|_, share| *share > 0.0);
        let found = ranks(floats(&film, Plane::CryptoObject), pixel);
        assert!(found.is_sorted_by(|a, b| a.1 >= b.1) && found.len() <= 4);
        assert_eq!(found.into_iter().collect::<BTreeMap<_, _>>(), expected);
        let of_instances: BTreeMap<u32, f32> = ranks(floats(&film, Plane::CryptoInstance), pixel).into_iter().collect();
        assert_eq!(of_instances.get(&one).copied().unwrap_or(0.0), of_one);
    }
}

/// The same, with a mesh whose triangles have materials of their own.
fn with_faces(antialiasing: u32) -> String {
    let scene = SCENE.replace("antialiasing = 2", &format!("antialiasing = {antialiasing}"));
    scene.replace(
        "    [[point_set]]",
        "    [[mesh]]\n    positions = [[-1, -2.5, 0], [1, -2.5, 0], [1, -1.8, 0], [-1, -1.8, 0]]\n    \
         triangles = [[0, 1, 2], [0, 2, 3]]\n    materials = [\"red\", \"green\"]\n    face_materials = [0, 1]\n    \
         [[point_set]]",
    )
}

#[test]
fn of_one_ray_a_pixel_they_are_what_the_centre_ray_meets() {
    let scene = scene(&with_faces(1));
    let settings = of(Plane::ALL.iter().filter(|plane| **plane != Plane::Color).map(|plane| (*plane).into()));
    let film = film(&scene, &settings);
    for (layer, id, key) in [
        (Plane::CryptoObject, Plane::ObjectId, "object"),
        (Plane::CryptoInstance, Plane::InstanceId, "instance"),
        (Plane::CryptoMaterial, Plane::MaterialId, "material"),
    ] {
        let (names, manifest) = (names(&scene, &settings, key), manifest(&scene, &settings, key));
        let Some(PlaneNumbers::Wholes(ids)) = film.numbers(id) else { panic!("{key}") };
        let mut met = vec![0; names.len() + 1];
        for (pixel, id) in ids.iter().map(|id| *id as usize).enumerate() {
            met[id] += 1;
            let name = (id > 0).then(|| names[id - 1].clone().unwrap_or_else(|| format!("#{id}")));
            let bits = name.map(|name| (manifest[&name], 1.0));
            assert_eq!(ranks(floats(&film, layer), pixel), Vec::from_iter(bits), "{key}");
        }
        assert!(met.iter().all(|pixels| *pixels > 3), "{key}: {met:?}");
    }
    let mut compared = 0;
    for mean in Plane::ALL {
        if let Some(of) = mean.name().strip_suffix(":filtered").and_then(Plane::from_name) {
            assert!(floats(&film, *mean) == floats(&film, of), "{}", mean.name());
            assert_eq!((mean.sampling(), mean.unit(), mean.space()), (Sampling::Filtered, of.unit(), of.space()));
            compared += 1;
        }
    }
    assert_eq!(compared, 12);
}

#[test]
fn filtered_buffers_are_means_over_the_rays_that_meet_something() {
    let means = Plane::ALL.iter().filter_map(|mean| {
        let of = Plane::from_name(mean.name().strip_suffix(":filtered")?)?;
        Some((*mean, of))
    });
    let means: Vec<(Plane, Plane)> = means.collect();
    let coarse = film(&scene(SCENE), &of(means.iter().map(|(mean, _)| (*mean).into())));
    // The centre rays of four times as many pixels
    let fine = SCENE.replace("width = 90", "width = 180").replace("height = 70", "height = 140");
    let fine = film(&scene(&fine), &of(means.iter().map(|(_, of)| (*of).into())));
    for (mean, of) in means {
        let channels = of.channels().len();
        let (found, fine_depth) = (floats(&coarse, mean), floats(&fine, Plane::Depth));
        // The rays of the two may differ in their last bit, and so at an edge in what they meet
        let mut off = 0;
        for pixel in 0..90 * 70 {
            let first = pixel / 90 * 2 * 180 + pixel % 90 * 2;
            let four = [first, first + 1, first + 180, first + 181];
            let met: Vec<usize> = four.into_iter().filter(|at| fine_depth[*at].is_finite()).collect();
            for channel in 0..channels {
                let all = floats(&fine, of);
                let total: f64 = met.iter().map(|at| f64::from(all[at * channels + channel])).sum();
                let expected =
                    if met.is_empty() { all[first * channels + channel] } else { total as f32 / met.len() as f32 };
                let found = found[pixel * channels + channel];
                off += usize::from(found != expected && !((found - expected).abs() < 1e-4));
            }
        }
        assert!(off < 12, "{}: {off}", mean.name());
    }
}

#[test]
fn nothing_else_decides_them_and_they_decide_nothing() {
    let scene = scene(&with_faces(3));
    let mut buffers = all_coverage(&scene);
    let rest = Plane::ALL.iter().copied().filter(|plane| plane.sampling() == Sampling::Filtered);
    buffers.extend(rest.filter(|plane| *plane != Plane::BackgroundCoverage).map(Buffer::from));
    let without_light = |buffer: &Buffer| match buffer {
        Buffer::Plane(plane) => plane.name().contains(':') || plane.name().starts_with("crypto"),
        _ => true,
    };
    let alone: Vec<Buffer> = buffers.iter().copied().filter(without_light).collect();
    let bytes = |film: &Film| alone.iter().map(|b| film.numbers(*b).unwrap().to_le_bytes()).collect::<Vec<_>>();
    let expected = bytes(&film(&scene, &of(alone.iter().copied())));
    let base = of(buffers);
    for settings in [
        RenderSettings { threads: NonZeroUsize::new(3), tile_size: 11, ..base.clone() },
        RenderSettings { reference: true, simd: SimdLevel::Fallback, ..base.clone() },
        RenderSettings { aa_mode: AaMode::Full, ..base.clone() },
    ] {
        assert!(bytes(&film(&scene, &settings)) == expected, "{settings:?}");
    }
    let with = film(&scene, &base);
    // The scene is transparent
    let alpha = floats(&with, Plane::Alpha).iter().zip(floats(&with, Plane::BackgroundCoverage));
    assert!(alpha.into_iter().all(|(alpha, background)| *alpha == 1.0 - background));
    let color: Vec<u32> = floats(&with, Plane::Color).iter().map(|number| number.to_bits()).collect();
    let picture = film(&scene, &RenderSettings::default()).develop();
    assert!(picture.pixels.as_flattened().iter().map(|number| number.to_bits()).eq(color));
    let rays = |settings: &RenderSettings| match render(&scene, settings, &|_, _| std::ops::ControlFlow::Continue(())) {
        std::ops::ControlFlow::Continue((_, stats)) => stats.camera_rays,
        std::ops::ControlFlow::Break(()) => unreachable!("nothing stops this render"),
    };
    assert_eq!(rays(&of([Plane::CryptoObject.into()])), 90 * 70 * 9);
}

#[test]
fn objects_are_asked_for_by_name_and_number() {
    let compiled = |buffer: &str| {
        let text = SCENE.replace("[render]", &format!("[render]\nbuffers = [\"{buffer}\"]"));
        let parsed = SceneDesc::parse("scene.toml", text.as_bytes(), &NoAssets);
        parsed.compile(&NoAssets, &CompileOptions::default()).map(|compiled| compiled.scene)
    };
    for (buffer, id, name) in [
        ("coverage:ball", 0, "coverage:ball"),
        ("coverage:#1", 0, "coverage:ball"),
        ("coverage:#3", 2, "coverage:#3"),
        // A slash can be in no file of an archive
        ("coverage:one/ring", 5, "coverage:#6"),
        ("coverage:panel", 9, "coverage:panel"),
    ] {
        let scene = compiled(buffer).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(scene.buffers(), [Buffer::Coverage(SurfaceId(id))], "{buffer}");
        assert_eq!(scene.buffer_name(scene.buffers()[0]), name);
    }
    assert_eq!(compiled("coverage:*").unwrap().buffers().len(), 11);
    for (buffer, fault) in [
        ("coverage:bal", "no object is called \"bal\"; did you mean \"ball\"?"),
        ("coverage:#12", "there is no object #12: the scene has 11"),
        ("coverage:ball\", \"coverage:#1", "\"coverage:ball\" is given twice"),
    ] {
        let said = compiled(buffer).unwrap_err().to_string();
        assert!(said.contains(fault) || fault.contains("did you mean") && said.contains("\"bal\""), "{said}");
    }
    let twins = SCENE.replace("name = \"wall\"", "name = \"ball\"");
    let text = twins.replace("[render]", "[render]\nbuffers = [\"coverage:ball\"]");
    let parsed = SceneDesc::parse("scene.toml", text.as_bytes(), &NoAssets);
    let said = parsed.compile(&NoAssets, &CompileOptions::default()).unwrap_err().to_string();
    assert!(said.contains("2 objects are called \"ball\"") && said.contains("coverage:#1, coverage:#2"), "{said}");
    let unknown = of([Buffer::Coverage(SurfaceId(11))]).check(&scene(SCENE)).unwrap_err();
    assert!(unknown.contains("there is no object #12"), "{unknown}");
}
