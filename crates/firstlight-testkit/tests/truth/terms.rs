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
    for seed in 0..times(200) {
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
    // Each by itself only where every light is sampled
    let asked = RenderSettings { buffers: vec![Buffer::Light(LightId(3), None)], ..RenderSettings::default() };
    assert!(asked.check(&scene).unwrap_err().contains("up to 16, and it has 22"));
    add_up("traced", &scene, &RenderSettings { visibility: VisibilityMode::Traced, ..RenderSettings::default() });
    let unknown = RenderSettings { buffers: vec![Buffer::Light(LightId(22), None)], ..asked };
    assert!(unknown.check(&scene).unwrap_err().contains("there is no light #23: the scene has 22"));
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
    ] {
        let said = asked(buffers, more).unwrap_err();
        assert!(said.contains(fault), "{said}");
    }
}
