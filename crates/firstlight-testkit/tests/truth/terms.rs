//! The terms of a picture: kept apart, they add up to it, bit for bit.

use firstlight::*;

use crate::buffers::{film, floats, scene as compiled};
use crate::exact_scenes;
use crate::scenes::times;

/// By default, each ray by itself, traced, and the plain renderer.
fn rules() -> [RenderSettings; 4] {
    let base = RenderSettings::default;
    [
        base(),
        RenderSettings { aa_mode: AaMode::Full, ..base() },
        RenderSettings { visibility: VisibilityMode::Traced, ..base() },
        RenderSettings { reference: true, ..base() },
    ]
}

/// What of a scene's picture lights send, all together and each: its whole, diffuse and specular.
fn parts_of(lights: usize) -> Vec<[Buffer; 3]> {
    let parts = [None, Some(LightPart::Diffuse), Some(LightPart::Specular)];
    (0..lights as u32).map(|light| parts.map(|part| Buffer::Light(LightId(light), part))).collect()
}

/// Sees that the terms add up. Their whole film.
fn add_up(name: &str, scene: &Scene, rules: &RenderSettings) -> Film {
    let lights = parts_of(scene.summary().lights.len());
    let first = [Plane::Background, Plane::Emission, Plane::Ambient].map(Buffer::from);
    let all = [Plane::Color, Plane::Diffuse, Plane::Specular].map(Buffer::from);
    let buffers = all.into_iter().chain(first).chain(lights.iter().copied().flatten()).collect();
    let film = film(scene, &RenderSettings { buffers, ..rules.clone() });
    let color = floats(&film, Plane::Color);
    let sum =
        |buffers: &[Buffer], at: usize| buffers.iter().fold(0.0f32, |sum, buffer| sum + floats(&film, *buffer)[at]);
    let terms: Vec<Buffer> = first.into_iter().chain(lights.iter().flat_map(|light| [light[1], light[2]])).collect();
    let part = |part: usize| lights.iter().map(|light| light[part]).collect::<Vec<_>>();
    let (diffuse, specular) = (part(1), part(2));
    for pixel in 0..color.len() / 4 {
        for channel in 0..3 {
            let at = 3 * pixel + channel;
            assert_eq!(color[4 * pixel + channel], sum(&terms, at), "{name}: pixel {pixel}, channel {channel}");
            assert_eq!(floats(&film, Plane::Diffuse)[at], sum(&diffuse, at), "{name}: pixel {pixel}");
            assert_eq!(floats(&film, Plane::Specular)[at], sum(&specular, at), "{name}: pixel {pixel}");
            for light in &lights {
                assert_eq!(floats(&film, light[0])[at], sum(&light[1..], at), "{name}: pixel {pixel}");
            }
        }
    }
    // The picture knows nothing of them
    let alone = crate::buffers::film(scene, rules);
    let bits = |film: &Film| floats(film, Plane::Color).iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert!(bits(&film) == bits(&alone), "{name}");
    film
}

#[test]
fn terms_add_up_to_the_picture() {
    for builtin in builtin_scenes() {
        let mut parsed = SceneDesc::parse(builtin.name, builtin.text.as_bytes(), &NoAssets);
        let render = &mut parsed.desc.render;
        (render.width, render.height, render.samples) = (40, 32, SamplesDesc::Count(9));
        let scene = parsed.compile(&NoAssets, &CompileOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
        for rules in rules() {
            add_up(builtin.name, &scene, &rules);
        }
    }
    // Traced pictures of these take long: the sums are the same ones
    for seed in 0..times(100) {
        let desc = exact_scenes::scene(seed, 8);
        let scene = desc.compile(&NoAssets, &CompileOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
        if scene.summary().lights.len() <= 16 {
            add_up(&seed.to_string(), &scene, &RenderSettings::default());
        }
    }
}

/// Two lights that are seen in part, a background that is seen, and a ball with a highlight.
const SCENE: &str = r#"
    [render]
    width = 48
    height = 40
    antialiasing = 3
    background = [0.1, 0.2, 0.3]
    ambient = 0.05
    [camera]
    position = [0, 0.5, 6]
    [material.phong.shiny]
    diffuse = [0.5, 0.25, 0.125]
    specular = 0.3
    shininess = 10
    [[sphere]]
    center = [0, 0, 0]
    radius = 1
    material = "shiny"
    [[light.rectangle]]
    name = "key"
    center = [1.5, 1.5, 1]
    e0 = [0.8, 0, 0]
    e1 = [0, 0.6, 0.2]
    sides = "both"
    strength = 3
    [[light.sphere]]
    center = [-1.7, 1, 0]
    radius = 0.3
    strength = 2
"#;

#[test]
fn each_term_is_the_picture_of_a_scene_with_nothing_else() {
    let scene = compiled(SCENE);
    for rules in rules() {
        let all = add_up("both lights", &scene, &rules);
        // A light alone, whose sight is not asked: the other light sends nothing
        for (light, dark) in [(0, "strength = 2"), (1, "strength = 3")] {
            let alone = SCENE.replace(dark, "strength = 0").replace("ambient = 0.05", "ambient = 0");
            let alone = add_up("one light", &compiled(&alone), &rules);
            let buffer = Buffer::Light(LightId(light), None);
            let (of_all, of_one) = (floats(&all, buffer), floats(&alone, buffer));
            // Each is told as closely as the picture needs, which shows more of one light where there is no other
            let worst = of_all.iter().zip(of_one).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 0.01, "light {light}: {worst}");
            assert!(of_one.iter().any(|v| *v > 0.02));
        }
        // What is seen where no surface is
        let [background, emission] = [Plane::Background, Plane::Emission].map(|plane| floats(&all, plane));
        assert_eq!(&background[..3], [0.1, 0.2, 0.3]);
        assert_eq!(&emission[..3], [0.0; 3]);
        assert!(emission.contains(&3.0) && emission.contains(&2.0));
        let ambient = floats(&all, Plane::Ambient);
        let middle = 3 * (22 * 48 + 24);
        assert_eq!(&background[middle..middle + 3], [0.0; 3]);
        assert!(ambient[middle..middle + 3].iter().all(|v| *v > 0.0), "{:?}", &ambient[middle..middle + 3]);
    }
}

#[test]
fn many_lights_are_told_together() {
    let lamps: String = (0..20)
        .map(|i| format!("[[light.point]]\nposition = [{}, 2, 3]\nstrength = 0.3\n", i as f64 * 0.3 - 3.0))
        .collect();
    let scene = compiled(&format!("{SCENE}{lamps}"));
    let parts = [Plane::Background, Plane::Emission, Plane::Ambient, Plane::Diffuse, Plane::Specular];
    let buffers = parts.into_iter().chain([Plane::Color]).map(Buffer::from).collect();
    let film = film(&scene, &RenderSettings { buffers, ..RenderSettings::default() });
    for (pixel, color) in floats(&film, Plane::Color).chunks(4).enumerate() {
        for (channel, color) in color[..3].iter().enumerate() {
            let terms = parts.map(|plane| floats(&film, plane)[3 * pixel + channel]);
            let sum: f32 = terms.iter().sum();
            assert!((sum - color).abs() <= 8.0 * f32::EPSILON * terms.into_iter().fold(0.0, f32::max), "{sum} {color}");
        }
    }
    add_up("traced", &scene, &RenderSettings { visibility: VisibilityMode::Traced, ..RenderSettings::default() });
    let unknown = RenderSettings { buffers: vec![Buffer::Light(LightId(22), None)], ..RenderSettings::default() };
    assert!(unknown.check(&scene).unwrap_err().contains("there is no light #23: the scene has 22"));
}

/// The film of a scene with some buffers, by the default settings.
fn film_of(scene: &Scene, buffers: Vec<Buffer>) -> Film {
    film(scene, &RenderSettings { buffers, ..RenderSettings::default() })
}

/// Sees that the background, emission, ambient light, some buffers and the rest are the picture.
fn is_closed(film: &Film, terms: &[Buffer]) {
    let first = [Plane::Background, Plane::Emission, Plane::Ambient].map(Buffer::from);
    let all: Vec<Buffer> = first.into_iter().chain(terms.iter().copied()).chain([Plane::Rest.into()]).collect();
    for (pixel, color) in floats(film, Plane::Color).chunks(4).enumerate() {
        for (channel, color) in color[..3].iter().enumerate() {
            let sum = all.iter().fold(0.0f32, |sum, term| sum + floats(film, *term)[3 * pixel + channel]);
            assert_eq!(sum, *color, "pixel {pixel}, channel {channel}");
        }
    }
}

#[test]
fn what_is_not_kept_apart_is_the_rest() {
    let lamps = |count: u32, more: &str| -> String {
        let at = |i: u32| [f64::from(i % 40) * 0.15 - 3.0, 2.0 + f64::from(i / 40) * 0.1, 3.0];
        (0..count)
            .map(|i| {
                format!("[[light.point]]\nposition = {:?}\nstrength = {}\n{more}\n", at(i), 6.0 / f64::from(count))
            })
            .collect()
    };
    let base = [Plane::Color, Plane::Background, Plane::Emission, Plane::Ambient, Plane::Rest].map(Buffer::from);
    for count in [0, 20, 1100] {
        let scene = compiled(&format!("{SCENE}{}", lamps(count, "group = \"lamps\"")));
        // Point lights come first
        let apart: &[u32] = if count == 0 { &[0] } else { &[0, count] };
        let some: Vec<Buffer> = apart.iter().flat_map(|light| parts_of(*light as usize + 1).pop().unwrap()).collect();
        let film = film_of(&scene, base.iter().chain(&some).copied().collect());
        let parts: Vec<Buffer> =
            some.iter().filter(|buffer| !matches!(buffer, Buffer::Light(_, None))).copied().collect();
        is_closed(&film, &parts);
        let alone = film_of(&scene, vec![Plane::Color.into()]);
        assert!(floats(&film, Plane::Color) == floats(&alone, Plane::Color), "{count}");
        if count == 0 {
            continue;
        }
        // A lamp kept apart is what it sends by itself
        let single = scene_with_one_lamp(&scene, &lamps(count, ""));
        let of_one = film_of(&single, vec![Buffer::Light(LightId(0), None)]);
        let (one, all) =
            (floats(&of_one, Buffer::Light(LightId(0), None)), floats(&film, Buffer::Light(LightId(0), None)));
        let worst = one.iter().zip(all).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 2e-3 && one.iter().any(|v| *v > 4.0 * worst), "{count}: {worst}");
        // What is asked for beside them changes no other buffer
        let totals = [Plane::Diffuse, Plane::Specular, Plane::Shadow].map(Buffer::from);
        let film = film_of(
            &scene,
            totals.iter().chain(&some).chain(&[Buffer::Group(LightGroupId(0), None)]).copied().collect(),
        );
        let alone = film_of(&scene, totals.to_vec());
        for total in totals {
            assert!(floats(&film, total) == floats(&alone, total), "{count}: {total:?}");
        }
        // A group, whatever else is told of its lights
        let beside = Buffer::Light(LightId(0), Some(LightPart::Visibility));
        let film =
            film_of(&scene, base.iter().copied().chain([Buffer::Group(LightGroupId(0), None), beside]).collect());
        is_closed(&film, &[Buffer::Group(LightGroupId(0), None)]);
        let group = Buffer::Group(LightGroupId(0), None);
        let film = film_of(&scene, base.iter().copied().chain([group]).collect());
        is_closed(&film, &[group]);
        assert_eq!(scene.buffer_name(group), "group:lamps");
        let (lamps, rest) = (floats(&film, group), floats(&film, Plane::Rest));
        let [lamps, rest] = [lamps, rest].map(|plane| plane.iter().map(|v| f64::from(*v)).sum::<f64>());
        assert!(lamps > 1.0 && rest > 1.0, "{lamps} {rest}");
    }
}

#[test]
fn a_weak_light_among_many_has_its_own_visibility() {
    let lamp = |i: u32| {
        let (name, strength) = if i == 7 { ("weak", 0.002) } else { ("lamp", 0.4) };
        let x = f64::from(i) * 0.2 - 3.0;
        format!("[[light.point]]\nname = \"{name} {i}\"\nposition = [{x}, 2, 3]\nstrength = {strength}\n")
    };
    let scene = compiled(&format!("{SCENE}{}", (0..30).map(lamp).collect::<String>()));
    let weak = Buffer::Light(LightId(7), None);
    let share = Buffer::Light(LightId(7), Some(LightPart::Visibility));
    let all = film_of(&scene, vec![weak, share]);
    let traced =
        RenderSettings { buffers: vec![weak, share], visibility: VisibilityMode::Traced, ..RenderSettings::default() };
    let traced = film(&scene, &traced);
    let (mut wrong, mut umbra) = (0, 0);
    for (pixel, share_of_it) in floats(&all, share).iter().enumerate() {
        let truth = floats(&traced, share)[pixel];
        let sent = floats(&traced, weak)[3 * pixel..][..3].iter().sum::<f32>();
        // Edges lie within pixels
        let is_whole = truth == 0.0 || truth == 1.0;
        wrong += u32::from(is_whole && (share_of_it - truth).abs() > 0.3);
        umbra += u32::from(truth == 0.0 && sent == 0.0);
    }
    // At silhouettes the middle may meet nothing
    assert!(wrong < 20 && umbra > 50, "{wrong} {umbra}");
}

/// The scene with the first of its lamps alone.
fn scene_with_one_lamp(scene: &Scene, lamps: &str) -> Scene {
    let first = lamps.split("[[").nth(1).unwrap();
    let one = compiled(&format!(
        "{}\n[[{first}",
        SCENE.replace("strength = 3", "strength = 0").replace("strength = 2", "strength = 0")
    ));
    assert_eq!(one.width(), scene.width());
    one
}

#[test]
fn shadows_are_told_from_what_casts_none() {
    let light = |part: Option<LightPart>| Buffer::Light(LightId(0), part);
    let text = |shadows: bool| {
        // What arrives without shadows is rendered at a quarter of the tolerance
        let tolerance = if shadows { 1.0 } else { 0.25 };
        format!(
            r#"
            [render]
            width = 40
            height = 32
            antialiasing = 2
            tolerance = {tolerance}
            [camera]
            position = [0, 3, 6]
            [material.phong.shiny]
            diffuse = 0.5
            specular = 0.3
            shininess = 10
            [[sphere]]
            center = [0, 0.5, 0]
            radius = 0.7
            material = "shiny"
            [[rectangle]]
            center = [0, -0.5, 0]
            size = [8, 8]
            normal = [0, 1, 0]
            material = "shiny"
            [[light.point]]
            position = [1, 4, 1]
            strength = 10
            shadows = {shadows}
            [[light.sphere]]
            center = [-2, 4, 1]
            radius = 0.5
            strength = 4
            shadows = {shadows}
            "#
        )
    };
    let [scene, open] = [true, false].map(|shadows| compiled(&text(shadows)));
    for rules in rules() {
        let buffers = vec![
            Plane::Shadow.into(),
            light(Some(LightPart::Visibility)),
            light(Some(LightPart::Unshadowed)),
            light(None),
            Plane::Color.into(),
            Plane::Diffuse.into(),
            Plane::Specular.into(),
        ];
        let film = film(&scene, &RenderSettings { buffers: buffers.clone(), ..rules.clone() });
        assert_eq!(film.planes().collect::<Vec<_>>(), buffers);
        let alone = crate::buffers::film(&scene, &rules);
        assert!(floats(&film, Plane::Color) == floats(&alone, Plane::Color));
        let all = vec![light(None), Plane::Diffuse.into(), Plane::Specular.into()];
        let without = crate::buffers::film(&open, &RenderSettings { buffers: all, ..rules.clone() });
        assert!(floats(&film, light(Some(LightPart::Unshadowed))) == floats(&without, light(None)));
        let [shadow, visibility] = [Plane::Shadow.into(), light(Some(LightPart::Visibility))].map(|b| floats(&film, b));
        // What all lights send, of which that which is seen of them is none
        let all = |film: &Film, pixel: usize| {
            let parts = [Plane::Diffuse, Plane::Specular].map(|plane| floats(film, plane));
            parts.iter().flat_map(|part| &part[3 * pixel..3 * pixel + 3]).sum::<f32>()
        };
        let (mut dark, mut bright) = (0, 0);
        for pixel in 0..shadow.len() {
            let of = |film: &Film| floats(film, light(None))[3 * pixel..3 * pixel + 3].iter().sum::<f32>();
            if of(&without) > 0.0 {
                assert!((visibility[pixel] - (of(&film) / of(&without)).min(1.0)).abs() < 1e-5, "pixel {pixel}");
                dark += usize::from(visibility[pixel] == 0.0);
                bright += usize::from(visibility[pixel] == 1.0);
            } else {
                assert_eq!(visibility[pixel], 0.0);
            }
            let arriving = all(&without, pixel);
            let share = if arriving > 0.0 { (all(&film, pixel) / arriving).min(1.0) } else { 0.0 };
            assert!((shadow[pixel] - share).abs() < 1e-5, "pixel {pixel}: {} {share}", shadow[pixel]);
        }
        assert!(dark > 10 && bright > 300, "{dark} {bright}");
    }
}

#[test]
fn scales_are_left_out_where_that_is_asked_for() {
    let parts = |part| Buffer::Light(LightId(0), Some(part));
    let all = [LightPart::Diffuse, LightPart::Specular, LightPart::UnscaledDiffuse, LightPart::UnscaledSpecular];
    let [weak, strong] = ["strength = 3", "strength = 6"].map(|strength| {
        let scene = compiled(&SCENE.replace("strength = 3", &format!("{strength}\nsamples = 9")));
        let settings =
            RenderSettings { aa_mode: AaMode::Full, buffers: all.map(parts).to_vec(), ..RenderSettings::default() };
        film(&scene, &settings)
    });
    for [scaled, unscaled] in [[all[0], all[2]], [all[1], all[3]]] {
        let of = |film| (floats(film, parts(scaled)), floats(film, parts(unscaled)));
        let ((a, a_unscaled), (b, b_unscaled)) = (of(&weak), of(&strong));
        assert!(a_unscaled == b_unscaled && a_unscaled.iter().any(|v| *v > 0.0));
        assert!(a.iter().zip(b).all(|(a, b)| 2.0 * a == *b));
    }
}

#[test]
fn lights_are_asked_for_by_name_by_number_and_all() {
    let asked = |buffers: &str, more: &str| {
        let text = format!("{SCENE}{more}").replace("[render]", &format!("[render]\nbuffers = {buffers}"));
        let parsed = SceneDesc::parse("scene.toml", text.as_bytes(), &NoAssets);
        let compiled = parsed.compile(&NoAssets, &CompileOptions::default());
        compiled.map(|compiled| compiled.scene).map_err(|e| e.to_string())
    };
    let names = |buffers: &str, more: &str| {
        let scene = asked(buffers, more).unwrap_or_else(|e| panic!("{e}"));
        scene.buffers().iter().map(|buffer| scene.buffer_name(*buffer)).collect::<Vec<_>>()
    };
    assert_eq!(names("[\"light:*\", \"color\"]", ""), ["light:key", "light:#2", "color"]);
    let parts = "[\"light:key:diffuse\", \"light:#1:specular\", \"light:#2\"]";
    assert_eq!(names(parts, ""), ["light:key:diffuse", "light:key:specular", "light:#2"]);
    // Of the same name
    let twin = "[[light.sphere]]\nname = \"key\"\ncenter = [9, 9, 9]\nradius = 0.1\n";
    assert_eq!(names("[\"light:*\"]", twin), ["light:#1", "light:#2", "light:#3"]);
    let odd = "[[light.sphere]]\nname = \"licht \u{fc}ber\"\ncenter = [9, 9, 9]\nradius = 0.1\n";
    assert_eq!(names("[\"light:licht \u{fc}ber\"]", odd), ["light:#3"]);
    for (buffers, more, fault) in [
        ("[\"light:key\"]", twin, "render.buffers[0]: 2 lights are called \"key\""),
        ("[\"light:kee\"]", "", "no light is called \"kee\"; did you mean \"key\"?"),
        ("[\"light:#3\"]", "", "there is no light #3: the scene has 2"),
        ("[\"light:*\", \"light:key\"]", "", "render.buffers[1]: \"light:key\" is given twice"),
        ("[\"light:\"]", "", "\"light:\" names no light"),
        ("[\"lihgt:key\"]", "", "is not \"color\""),
        ("[\"group:key\"]", "", "no group of lights is called \"key\"; the scene has none"),
        ("[\"group:#2\"]", &format!("{twin}group = \"a\"\n"), "there is no group of lights #2: the scene has 1"),
    ] {
        let said = asked(buffers, more).unwrap_err();
        assert!(said.contains(fault), "{said}");
    }
}
