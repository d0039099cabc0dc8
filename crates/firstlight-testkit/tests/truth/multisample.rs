//! Multisampling: one shading point for each smooth part of a surface in a pixel. What is seen is as always; light is
//! near that of every camera ray where it varies smoothly.

use firstlight::{AaMode, LightDesc, RenderSettings, SampleSet, SamplesDesc, Scene, SceneDesc, ShapeDesc, Window};
use firstlight_testkit::Random;

use crate::scenes::*;

fn multisampled() -> RenderSettings {
    RenderSettings { aa_mode: AaMode::Multisample, ..one_thread() }
}

/// A smooth ball and a box of facets on a plate, under two wide lights and one without size that casts no shadow.
fn still_life() -> SceneDesc {
    let ball = ball_mesh(1.0, 48, 0.0, true, &mut Random::new(3));
    let light = |center, e0, e1, strength| {
        let light = rectangle(center, e0, e1, SampleSet::Sobol, 64);
        LightDesc::Rectangle(firstlight::RectangleDesc { strength, visible: false, ..light })
    };
    let fill = firstlight::PointDesc { shadows: false, ..point([4.0, 2.0, 5.0], 4.0) };
    let mut desc = empty(96, 72, 4)
        .with_camera(camera([2.0, 2.5, 6.0], [0.0, 0.2, 0.0], 40.0))
        .with_parallelogram(square([0.0, -1.0, 0.0], [0.0, 1.0, 0.0], 4.0))
        .with_shape(ShapeDesc::Mesh(ball))
        .with_shape(moved(ShapeDesc::Mesh(box_mesh([0.0; 3], [0.9; 3])), [1.8, -0.55, 0.4], [0.0, 30.0, 0.0], [1.0; 3]))
        .with_light(light([-3.0, 5.0, 3.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0], 6.0))
        .with_light(light([4.0, 4.0, -1.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0], 2.0))
        .with_light(LightDesc::Point(fill));
    desc.render.samples = SamplesDesc::Exact;
    desc.lights.iter_mut().for_each(|light| light.set_samples(SamplesDesc::Exact));
    desc.render.transparent = true;
    desc
}

/// The root of the mean squared difference in steps of 1/255, and the largest.
fn steps(one: &Scene, settings: &RenderSettings, other: &RenderSettings) -> [f32; 2] {
    let [a, b] = [settings, other].map(|settings| picture(one, settings).pixels);
    let off: Vec<f32> = a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| 255.0 * (a - b).abs()).collect();
    let squares = off.iter().map(|off| off * off).sum::<f32>();
    [(squares / off.len() as f32).sqrt(), off.iter().copied().fold(0.0, f32::max)]
}

#[test]
fn what_is_seen_is_what_all_rays_see() {
    let scene = compile(&still_life());
    let [few, all] = [multisampled(), every_ray()].map(|settings| picture(&scene, &settings).pixels);
    for (few, all) in few.iter().zip(&all) {
        assert_eq!(few[3].to_bits(), all[3].to_bits());
    }
}

#[test]
fn smooth_light_is_near_that_of_all_rays() {
    let scene = compile(&still_life());
    let [rms, worst] = steps(&scene, &multisampled(), &every_ray());
    assert!(rms < 0.6 && worst < 16.0, "{rms} {worst}");
    assert!(rms > 0.0);
}

#[test]
fn facets_that_meet_in_a_pixel_are_lit_apart() {
    // An edge of a box in the middle of a picture of one pixel: one face is lit, the other is not
    let mut desc = empty(1, 1, 4)
        .with_camera(camera([0.0, 0.0, 5.0], [0.0; 3], 0.5))
        .with_shape(moved(ShapeDesc::Mesh(box_mesh([0.0; 3], [1.0; 3])), [0.0; 3], [0.0, 45.0, 0.0], [1.0; 3]))
        .with_light(LightDesc::Directional(directional([1.0, 0.0, -1.0], std::f64::consts::PI)));
    desc.render.transparent = true;
    let [pixel] = picture(&compile(&desc), &multisampled()).pixels[..] else { panic!("is one pixel") };
    // Matte gray 0.8, faced by the light
    assert!((pixel[0] - 0.4).abs() < 1e-5, "{pixel:?}");
}

#[test]
fn parts_of_the_picture_and_threads_do_not_matter() {
    let scene = compile(&still_life());
    let whole = bits(&picture(&scene, &multisampled()));
    let crop = Window { x: 21, y: 13, width: 50, height: 40 };
    let part = bits(&picture(&scene, &RenderSettings { crop: Some(crop), ..multisampled() }));
    for (i, pixel) in part.iter().enumerate() {
        let (x, y) = (i as u32 % crop.width + crop.x, i as u32 / crop.width + crop.y);
        assert_eq!(*pixel, whole[(y * 96 + x) as usize], "{x} {y}");
    }
    let threads = RenderSettings { threads: std::num::NonZeroUsize::new(3), tile_size: 8, ..multisampled() };
    assert!(bits(&picture(&scene, &threads)) == whole);
}

#[test]
fn layers_are_near_those_of_all_rays() {
    let mut desc = still_life();
    let mut veil = matte(0.6);
    let common = common_of(&mut veil).expect("has common fields");
    (common.alpha, common.alpha_mode) = (0.4.into(), firstlight::AlphaMode::Blend);
    desc.materials.push(("veil".to_owned(), veil));
    let mut sheet = square([0.5, 0.5, 2.0], [0.2, 0.1, 1.0], 1.0);
    sheet.material = Some("veil".to_owned());
    let scene = compile(&desc.with_parallelogram(sheet));
    let [rms, worst] = steps(&scene, &multisampled(), &every_ray());
    assert!(rms < 0.8 && worst < 24.0, "{rms} {worst}");
}
