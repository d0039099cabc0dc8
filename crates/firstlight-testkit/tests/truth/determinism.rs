//! Same bits: whatever the threads, the tiles, the instruction set and the renderer, every picture is the same to the
//! last bit. `FIRSTLIGHT_SCENES` is the number of random scenes, 200 unless said.

use std::num::NonZeroUsize;

use firstlight::{
    AaMode, Image, LightDesc, RenderSettings, SampleSet, SamplesDesc, Scene, SceneDesc, ShapeDesc, SimdLevel,
    VisibilityMode, Window,
};

use crate::random;
use crate::scenes::*;

/// Pictures that use everything, small ones.
fn scenes() -> Vec<SceneDesc> {
    let mut scenes = vec![config11(50, 2, 33)];
    scenes[0].render.height = 41;
    scenes.extend((0..4).map(|seed| {
        let mut scene = random::scene(1_000_000 + seed);
        (scene.render.width, scene.render.height) = (45, 37);
        scene
    }));
    scenes.push(meshes());
    scenes
}

/// Some thousand triangles in the world, and some thousand more by instances within instances, under an area light.
fn meshes() -> SceneDesc {
    let random = &mut Random::new(77);
    let world = ball_mesh(1.2, 40, 0.05, true, random);
    let inner = ball_mesh(0.4, 24, 0.1, false, random);
    assert!(world.triangles.len() + inner.triangles.len() > 4000);
    let ring = (0..5)
        .map(|i| moved(instance("ball"), [i as f64 * 0.8 - 1.6, 0.0, 0.0], [0.0, 40.0 * i as f64, 0.0], [1.0; 3]));
    let light = rectangle([0.5, 5.0, 1.0], [1.5, 0.0, 0.0], [0.0, 0.0, 1.5], SampleSet::Sobol, 33);
    empty(70, 50, 2)
        .with_camera(camera([1.0, 2.5, 6.0], [0.0; 3], 50.0))
        .with_parallelogram(square([0.0, -1.3, 0.0], [0.0, 1.0, 0.0], 6.0))
        .with_group("ball", vec![ShapeDesc::Mesh(inner)])
        .with_group("ring", ring.collect())
        .with_shape(ShapeDesc::Mesh(world))
        .with_shape(moved(instance("ring"), [0.0, -0.6, 2.0], [0.0; 3], [1.0; 3]))
        .with_shape(moved(instance("ring"), [0.0, 1.2, -1.0], [0.0, 30.0, 20.0], [-0.8, 0.6, 0.8]))
        .with_light(LightDesc::Rectangle(firstlight::RectangleDesc { strength: 10.0, ..light }))
        .with_light(LightDesc::Point(point([-3.0, 3.0, 3.0], 10.0)))
}

/// The same with every light integrated.
fn integrated_scenes() -> Vec<SceneDesc> {
    let integrated = |mut desc: SceneDesc| {
        desc.render.samples = SamplesDesc::Exact;
        desc.lights.iter_mut().for_each(|light| light.set_samples(SamplesDesc::Exact));
        desc
    };
    scenes().into_iter().map(integrated).collect()
}

/// Light once for each surface in a pixel.
fn adaptive() -> RenderSettings {
    RenderSettings { aa_mode: AaMode::Adaptive, ..one_thread() }
}

fn with(settings: RenderSettings, scene: &Scene) -> Vec<[u32; 4]> {
    bits(&picture(scene, &settings))
}

#[test]
fn threads_and_tiles_do_not_matter() {
    for desc in scenes().into_iter().chain(integrated_scenes()) {
        let scene = compile(&desc);
        for one in [adaptive(), every_ray()] {
            let expected = with(one.clone(), &scene);
            for (threads, tile_size) in [(1, 23), (2, 8), (2, 64), (8, 16)] {
                let threads = NonZeroUsize::new(threads);
                let got = with(RenderSettings { threads, tile_size, ..one.clone() }, &scene);
                assert!(got == expected, "{threads:?} threads, tiles of {tile_size}: {desc:#?}");
            }
            let all = RenderSettings { threads: None, ..one };
            assert!(with(all, &scene) == expected, "all threads: {desc:#?}");
        }
    }
}

#[test]
fn instruction_sets_do_not_matter() {
    let levels = SimdLevel::available();
    assert!(!levels.is_empty());
    for desc in scenes() {
        let scene = compile(&desc);
        let expected = with(RenderSettings { reference: true, ..one_thread() }, &scene);
        for simd in &levels {
            for visibility in [VisibilityMode::Shafts, VisibilityMode::Traced] {
                let got = with(RenderSettings { simd: *simd, visibility, ..every_ray() }, &scene);
                assert!(got == expected, "{}, {}: {desc:#?}", simd.name(), visibility.name());
            }
        }
    }
}

#[test]
fn instruction_sets_do_not_matter_to_integrals() {
    let multisampled = RenderSettings { aa_mode: AaMode::Multisample, ..one_thread() };
    for desc in integrated_scenes() {
        let scene = compile(&desc);
        for one in [adaptive(), multisampled.clone(), every_ray()] {
            let expected = with(one.clone(), &scene);
            for simd in SimdLevel::available() {
                let got = with(RenderSettings { simd, ..one.clone() }, &scene);
                assert!(got == expected, "{}: {desc:#?}", simd.name());
            }
        }
    }
}

#[test]
fn a_crop_is_a_part_of_the_whole() {
    for desc in scenes().into_iter().chain(integrated_scenes()) {
        let scene = compile(&desc);
        let whole = [adaptive(), every_ray()].map(|settings| picture(&scene, &settings));
        let (width, height) = (scene.width(), scene.height());
        for window in [
            Window { x: 0, y: 0, width: 1, height: 1 },
            Window { x: 3, y: 5, width: 20, height: 17 },
            Window { x: width - 9, y: 0, width: 9, height },
            Window { x: 0, y: height - 1, width, height: 1 },
        ] {
            // The plain renderer gives the bits of every ray where no light is integrated
            let plain = RenderSettings { reference: true, ..one_thread() };
            let plain = (desc.render.samples != SamplesDesc::Exact).then_some((plain, &whole[1]));
            for (settings, whole) in [(adaptive(), &whole[0]), (every_ray(), &whole[1])].into_iter().chain(plain) {
                let settings = RenderSettings { crop: Some(window), tile_size: 8, ..settings };
                let part = picture(&scene, &settings);
                assert_eq!(part.window, window);
                for y in 0..window.height {
                    for x in 0..window.width {
                        let of_whole = whole.pixels[((window.y + y) * width + window.x + x) as usize];
                        let of_part = part.pixels[(y * window.width + x) as usize];
                        assert_eq!(of_whole.map(f32::to_bits), of_part.map(f32::to_bits), "{x}, {y} of {window:?}");
                    }
                }
            }
        }
    }
}

/// What is wrong with the pictures of a scene, if anything is.
fn fault(desc: &SceneDesc) -> Option<String> {
    let scene = compile(desc);
    let plain = picture(&scene, &RenderSettings { reference: true, ..one_thread() });
    let describe = |name: &str, film: &Image| {
        let wrong = |p: &[f32; 4]| p.iter().any(|c| !c.is_finite() || *c < 0.0) || p[3] > 1.0;
        film.pixels.iter().position(wrong).map(|i| format!("{name}: pixel {i} is {:?}", film.pixels[i]))
    };
    if let Some(fault) = describe("plain", &plain) {
        return Some(fault);
    }
    use VisibilityMode::{Shafts, Traced};
    let (best, least) = (SimdLevel::Auto, SimdLevel::available()[0]);
    let avx2 = if SimdLevel::Avx2.is_available() { SimdLevel::Avx2 } else { best };
    for (simd, threads, tile_size, visibility) in [
        (best, 1, 16, Shafts),
        (best, 1, 16, Traced),
        (avx2, 1, 16, Shafts),
        (least, 1, 16, Shafts),
        (least, 1, 16, Traced),
        (best, 2, 8, Shafts),
    ] {
        let threads = NonZeroUsize::new(threads);
        // Where every sample is traced, it is of no account
        let aa_mode = if visibility == Traced { AaMode::Adaptive } else { AaMode::Full };
        let settings = RenderSettings { simd, threads, tile_size, visibility, aa_mode, ..RenderSettings::default() };
        let fast = picture(&scene, &settings);
        let differs =
            (0..plain.pixels.len()).find(|i| plain.pixels[*i].map(f32::to_bits) != fast.pixels[*i].map(f32::to_bits));
        if let Some(i) = differs {
            let (simd, visibility) = (simd.name(), visibility.name());
            return Some(format!("pixel {i}: plain {:?}, {simd} {visibility} {:?}", plain.pixels[i], fast.pixels[i]));
        }
    }
    None
}

/// The smallest scene with a fault that is left when shapes and lights are taken out one by one, those of groups too.
fn reduced(mut desc: SceneDesc) -> SceneDesc {
    /// Without the `i`th of them all.
    fn without(desc: &SceneDesc, mut i: usize) -> Option<SceneDesc> {
        let mut without = desc.clone();
        let groups = without.groups.iter_mut().map(|(_, group)| &mut group.shapes);
        for shapes in std::iter::once(&mut without.shapes).chain(groups) {
            if i < shapes.len() {
                shapes.remove(i);
                return Some(without);
            }
            i -= shapes.len();
        }
        (i < without.lights.len()).then(|| {
            without.lights.remove(i);
            without
        })
    }
    loop {
        let smaller = (0..).map_while(|i| without(&desc, i)).find(|smaller| fault(smaller).is_some());
        match smaller {
            Some(smaller) => desc = smaller,
            None => return desc,
        }
    }
}

/// Checks scenes 0 to `count`; most of them have to show something.
fn compare(count: u64, scene: impl Fn(u64) -> SceneDesc) {
    let mut lit = 0;
    for seed in 0..count {
        let desc = scene(seed);
        if let Some(fault) = fault(&desc) {
            panic!("seed {seed}: {fault}\n{:#?}", reduced(desc));
        }
        lit += u64::from(shoot(&desc).pixels.iter().any(|p| p[0] + p[1] + p[2] > 0.0));
    }
    assert!(lit * 10 > count * 6, "only {lit} of {count} scenes show anything");
}

#[test]
fn plain_and_fast_agree_on_random_scenes() {
    compare(times(200), random::scene);
}

#[test]
fn plain_and_fast_agree_under_grazing_light() {
    compare(times(200), random::grazing);
}

#[test]
fn a_crop_outside_the_film_is_refused_whatever_its_size() {
    let scene = compile(&config11(16, 1, 1));
    let most = u32::MAX;
    for [x, y, width, height] in [[0, 0, most, most], [most, 0, 1, 1], [0, most, 1, most], [0, 0, 0, 4], [8, 8, 9, 8]] {
        let crop = Some(firstlight::Window { x, y, width, height });
        let refused = RenderSettings { crop, ..RenderSettings::default() }.check(&scene);
        assert!(refused.unwrap_err().contains("does not lie inside"), "{x},{y},{width},{height}");
    }
}
