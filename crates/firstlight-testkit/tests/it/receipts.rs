//! Receipts of real renders: what changes a bit of the film changes the receipt, and nothing else does.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;

use firstlight::{
    AaMode, CompileOptions, NoAssets, Plane, Receipt, ReceiptSettings, RenderSettings, SamplesDesc, SceneDesc,
    ShadowTerminator, ShapeDesc, SimdLevel, VisibilityMode, Window, render,
};

/// Everything that a setting can change: area lights with and without a word on samples, a smooth mesh, keys, two
/// cameras.
const SCENE: &str = r#"
    [render]
    width = 33
    height = 25
    antialiasing = 2
    background = [0.1, 0.2, 0.3]

    [camera.front]
    position = [0, 1, 7]
    look_at = [0, 1, 0]

    [camera.side]
    position = [6, 3, 4]
    look_at = [0, 1, 0]

    [[parallelogram]]
    p = [-3, 0, 3]
    e0 = [6, 0, 0]
    e1 = [0, 0, -6]

    [[sphere]]
    center = [-1, 1, 0]
    radius = 0.8
    transform = { keys = [{ time = 0, translate = [0, 0, 0] }, { time = 1, translate = [0.3, 0.2, 0] }] }

    [[mesh]]
    positions = [[1, 2, 0], [0.3, 0.5, 0.7], [1.7, 0.5, 0.7], [1, 0.5, -0.8]]
    normals = [[0, 1, 0], [-1, 0, 1], [1, 0, 1], [0, 0, -1]]
    triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 1]]

    [[light.rectangle]]
    center = [1, 4, 2]
    e0 = [2, 0, 0]
    e1 = [0, 0, 2]
    strength = 3

    [[light.sphere]]
    center = [-4, 3, 2]
    radius = 0.5
    strength = 5
    samples = 9

    [[light.point]]
    position = [2, 3, 5]
    strength = 8
"#;

fn scene() -> SceneDesc {
    let parsed = SceneDesc::parse("s.toml", SCENE.as_bytes(), &NoAssets);
    assert_eq!(parsed.faults(), []);
    parsed.desc
}

/// The bits of the film, and the receipt.
type Shot = (Vec<[u32; 4]>, Receipt);

fn shoot_at(desc: &SceneDesc, settings: &RenderSettings, time: f64) -> Shot {
    let options = CompileOptions { time, ..CompileOptions::default() };
    let scene = desc.compile(&NoAssets, &options).expect("it has no faults").scene;
    let ControlFlow::Continue((film, _)) = render(&scene, settings, &|_, _| ControlFlow::Continue(())) else {
        unreachable!("nothing stops it")
    };
    (film.develop().pixels.iter().map(|p| p.map(f32::to_bits)).collect(), scene.receipt(settings))
}

fn shoot(desc: &SceneDesc, settings: &RenderSettings) -> Shot {
    shoot_at(desc, settings, 0.0)
}

fn said<'a>(receipt: &'a Receipt, key: &str) -> &'a str {
    receipt.entries.iter().find(|(k, _)| k == key).map_or("", |(_, value)| value)
}

#[test]
fn how_the_work_is_done_changes_neither_film_nor_receipt() {
    let desc = scene();
    let one = RenderSettings::default;
    for base in [one(), RenderSettings { aa_mode: AaMode::Full, ..one() }] {
        let expected = shoot(&desc, &base);
        let whole = Window { x: 0, y: 0, width: 33, height: 25 };
        let mut others = vec![
            RenderSettings { threads: NonZeroUsize::new(3), ..base.clone() },
            RenderSettings { tile_size: 8, ..base.clone() },
            RenderSettings { tile_size: 64, ..base.clone() },
            RenderSettings {
                buffers: vec![Plane::Color.into(), Plane::Rays.into(), Plane::Depth.into()],
                ..base.clone()
            },
            RenderSettings { crop: Some(whole), ..base.clone() },
        ];
        others.extend(SimdLevel::available().into_iter().map(|simd| RenderSettings { simd, ..base.clone() }));
        for settings in others {
            assert!(shoot(&desc, &settings) == expected, "{settings:?}");
        }
        // Nothing that is of no account is part of it
        let mut same = desc.clone();
        (same.render.samples, same.render.camera) = (SamplesDesc::Exact, Some("front".into()));
        assert!(shoot(&same, &base) == expected);
    }
}

#[test]
fn renderers_of_the_same_bits_say_the_same() {
    let desc = scene();
    let reference = shoot(&desc, &RenderSettings { reference: true, ..RenderSettings::default() });
    assert_eq!(said(&reference.1, "light_samples"), "1 400 9");
    assert_eq!(said(&reference.1, "aa_mode"), "full");
    for aa_mode in [AaMode::Adaptive, AaMode::Full] {
        let traced = RenderSettings { visibility: VisibilityMode::Traced, aa_mode, ..RenderSettings::default() };
        assert!(shoot(&desc, &traced) == reference, "{traced:?}");
        assert!(shoot(&desc, &RenderSettings { reference: true, ..traced }) == reference);
    }
    // By shafts, with the number of points said once for the scene, or by the light
    let full = RenderSettings { aa_mode: AaMode::Full, ..RenderSettings::default() };
    let mut sampled = desc.clone();
    sampled.render.samples = SamplesDesc::Count(400);
    assert!(shoot(&sampled, &full) == reference);
    let mut by_light = desc.clone();
    let light = by_light.lights.iter_mut().find(|light| light.samples().is_some_and(|(own, _)| own.is_none()));
    light.expect("one says nothing of samples").set_samples(SamplesDesc::Count(400));
    assert!(shoot(&by_light, &full) == reference);
    // What is sampled at every ray knows no tolerance
    sampled.render.tolerance = 9.0;
    assert!(shoot(&sampled, &full) == reference);
}

/// Films of all kinds of one scene.
fn shots() -> Vec<(&'static str, Shot)> {
    let desc = scene();
    let base = RenderSettings::default();
    let full = RenderSettings { aa_mode: AaMode::Full, ..base.clone() };
    let with = |change: &dyn Fn(&mut SceneDesc)| {
        let mut desc = desc.clone();
        change(&mut desc);
        desc
    };
    let every_light = |samples| {
        with(&|desc| {
            desc.render.samples = samples;
            desc.lights.iter_mut().for_each(|light| light.set_samples(samples));
        })
    };
    let crop = |x, y, width, height| RenderSettings { crop: Some(Window { x, y, width, height }), ..base.clone() };
    vec![
        ("as it is", shoot(&desc, &base)),
        ("full", shoot(&desc, &full)),
        ("reference", shoot(&desc, &RenderSettings { reference: true, ..base.clone() })),
        ("all exact", shoot(&every_light(SamplesDesc::Exact), &base)),
        ("all exact, full", shoot(&every_light(SamplesDesc::Exact), &full)),
        ("16 samples", shoot(&every_light(SamplesDesc::Count(16)), &base)),
        ("17 samples, full", shoot(&every_light(SamplesDesc::Count(17)), &full)),
        ("antialiasing", shoot(&with(&|desc| desc.render.antialiasing = 3), &base)),
        ("width", shoot(&with(&|desc| desc.render.width = 34), &base)),
        ("height", shoot(&with(&|desc| desc.render.height = 24), &base)),
        ("camera", shoot(&with(&|desc| desc.render.camera = Some("side".into())), &base)),
        ("tolerance", shoot(&with(&|desc| desc.render.tolerance = 8.0), &base)),
        ("terminator", shoot(&with(&|desc| desc.render.shadow_terminator = ShadowTerminator::Hard), &base)),
        ("transparent", shoot(&with(&|desc| desc.render.transparent = true), &base)),
        ("time", shoot_at(&desc, &base, 1.0)),
        ("another time", shoot_at(&desc, &base, 0.5)),
        ("crop", shoot(&desc, &crop(0, 0, 20, 25))),
        ("another crop", shoot(&desc, &crop(13, 0, 20, 25))),
    ]
}

#[test]
fn a_receipt_leads_back_to_the_film() {
    for (name, (bits, receipt)) in shots() {
        let said = ReceiptSettings::read(&receipt).unwrap();
        assert!(said.is_of_this_version());
        let mut desc = scene();
        said.apply(&mut desc);
        let options = CompileOptions { time: said.time, ..CompileOptions::default() };
        let scene = desc.compile(&NoAssets, &options).expect("it has no faults").scene;
        assert_eq!(scene.hash(), said.scene_hash, "{name}");
        assert!(shoot_at(&desc, &said.settings(&scene), said.time) == (bits, receipt), "{name}");
    }
}

#[test]
fn what_changes_the_film_changes_the_receipt() {
    let shots = shots();
    for (i, (one, (bits, receipt))) in shots.iter().enumerate() {
        for (other, (other_bits, other_receipt)) in &shots[..i] {
            assert!(bits != other_bits, "{one} and {other} have the same film: the scene tests too little");
            assert!(receipt != other_receipt, "{one} and {other} have the same receipt");
        }
    }
}

/// In a scene with BVHs whose area lights are all sampled, the adaptive mode shades every camera ray: film and receipt
/// are those of the full mode.
#[test]
fn what_is_sampled_behind_trees_is_full() {
    let mut desc = scene();
    desc.render.samples = SamplesDesc::Count(16);
    let full = RenderSettings { aa_mode: AaMode::Full, ..RenderSettings::default() };
    let (film, receipt) = shoot(&desc, &RenderSettings::default());
    assert_eq!(said(&receipt, "aa_mode"), "full");
    assert!((film, receipt) == shoot(&desc, &full));
}

#[test]
fn a_time_of_which_nothing_depends_is_no_part_of_it() {
    let mut desc = scene();
    desc.shapes.retain(|shape| !matches!(shape, ShapeDesc::Sphere(_)));
    assert!(shoot_at(&desc, &RenderSettings::default(), 3.0) == shoot(&desc, &RenderSettings::default()));
}
