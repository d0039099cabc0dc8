//! The course's configuration files.

use std::num::NonZeroU32;

use firstlight::{LightDesc, NoAssets, Parsed, RectangleDesc, SampleSet, SceneDesc, builtin_scenes};

fn parse(name: &str, text: &str) -> Parsed {
    let parsed = SceneDesc::parse(name, text.as_bytes(), &NoAssets);
    assert_eq!(parsed.faults(), []);
    parsed
}

fn builtin(name: &str) -> SceneDesc {
    let builtin = builtin_scenes().iter().find(|b| b.name == name).unwrap();
    parse("scene.toml", builtin.text).desc
}

fn light(desc: &SceneDesc) -> &RectangleDesc {
    let [LightDesc::Rectangle(light)] = desc.lights.as_slice() else { panic!("{:?}", desc.lights) };
    light
}

#[test]
fn a_whole_file_is_a_built_in_scene_with_changes() {
    let text = "output_resolution 320\r\noutput_file pictures/out.png\r\n\r\n  camera_id 2\r\nlight_id\t3\r\n\
                num_samples 3\r\narea_light_resolution 20\r\nnum_threads 8";
    let parsed = parse("config.txt", text);
    assert_eq!(parsed.output.as_deref(), Some("pictures/out.png"));
    assert_eq!(parsed.threads.and_then(NonZeroU32::new), NonZeroU32::new(8));
    let mut expected = builtin("config23");
    (expected.render.width, expected.render.height, expected.render.antialiasing) = (320, 320, 3);
    let [LightDesc::Rectangle(rectangle)] = expected.lights.as_mut_slice() else { panic!() };
    (rectangle.samples, rectangle.set) = (Some(400.into()), SampleSet::Grid);
    assert_eq!(parsed.desc, expected);
    assert_eq!(light(&parsed.desc).center, [-3.0, 5.9, -6.0]);
}

#[test]
fn what_is_left_out_is_as_in_config11() {
    for text in ["", "\n \n\t\n", "camera_id 1\n"] {
        let parsed = parse("config.txt", text);
        assert_eq!(parsed.desc, builtin("config11"));
        assert_eq!((parsed.output, parsed.threads), (None, None));
    }
}

#[test]
fn it_is_known_by_its_name_or_its_first_line() {
    for name in ["config.txt", "CONFIG.TXT", "config", "-", "config.cfg"] {
        assert_eq!(parse(name, "\n\nlight_id 2\n").desc, builtin("config12"), "{name}");
    }
    // TOML says it with an equals sign, and its name says it too
    assert!(!SceneDesc::parse("config", b"light_id = 2\n", &NoAssets).faults().is_empty());
    assert!(!SceneDesc::parse("config.toml", b"light_id 2\n", &NoAssets).faults().is_empty());
}

#[test]
fn the_nine_scenes_say_what_they_are() {
    let names: Vec<&str> = builtin_scenes().iter().map(|b| b.name).collect();
    assert_eq!(
        names,
        ["config11", "config12", "config13", "config21", "config22", "config23", "config31", "config32", "config33"]
    );
    let positions = [[0.0, 0.0, 10.0], [5.0, 3.0, 12.0], [0.0, -4.0, 15.0]];
    let lights = [
        ([0.0, 5.9, -6.0], [1.0, 1.0, 1.0]),
        ([3.0, 5.9, -6.0], [0.9, 0.8, 0.0]),
        ([-3.0, 5.9, -6.0], [0.0, 0.9, 0.7]),
    ];
    for (i, scene) in builtin_scenes().iter().enumerate() {
        let desc = builtin(scene.name);
        let [(name, camera)] = desc.cameras.as_slice() else { panic!() };
        assert_eq!((name.as_str(), camera.position), ("", positions[i / 3]));
        assert_eq!((light(&desc).center, light(&desc).color.linear), lights[i % 3]);
        assert_eq!((desc.shapes.len(), desc.materials.len(), desc.textures.len()), (9, 7, 4));
        // All else is the same
        let mut same = desc.clone();
        same.cameras.clone_from(&builtin("config11").cameras);
        same.lights.clone_from(&builtin("config11").lights);
        assert_eq!(same, builtin("config11"));
    }
}
