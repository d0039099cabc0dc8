//! Pictures that are lit again: what a render of the changed scene gives.

use firstlight::*;

use crate::buffers::{film, scene as compiled};

/// Two lights that are seen in part, one that has no extent, and a colour of each.
fn text(key: &str, fill: &str, lamp: &str, render: &str) -> String {
    format!(
        r#"
        [render]
        width = 44
        height = 36
        antialiasing = 3
        background = [0.1, 0.2, 0.3]
        ambient = 0.05
        exposure = 0.5
        {render}
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
        [[rectangle]]
        center = [0, -1, 0]
        size = [6, 6]
        normal = [0, 1, 0]
        material = "shiny"
        [[light.point]]
        position = [-2, 3, 2]
        {lamp}
        [[light.rectangle]]
        name = "key"
        center = [1.5, 1.5, 1]
        e0 = [0.8, 0, 0]
        e1 = [0, 0.6, 0.2]
        sides = "both"
        {key}
        [[light.sphere]]
        name = "fill"
        center = [-1.7, 1, 0]
        radius = 0.3
        {fill}
        "#
    )
}

const BEFORE: [&str; 3] = ["strength = 3", "strength = 2\ncolor = [1, 0.9, 0.7]", "strength = 8"];

/// What changes the lights of [`BEFORE`], and what is said then.
fn changes() -> (Vec<(String, LightChange)>, [&'static str; 3]) {
    let changes = [
        ("key", LightChange::Times(1.7)),
        ("fill", LightChange::Color(ColorDesc::linear(0.3, 0.6, 1.0))),
        ("fill", LightChange::Strength(2.9)),
        ("#1", LightChange::Times(0.3)),
    ];
    let said = ["strength = 5.1", "strength = 2.9\ncolor = [0.3, 0.6, 1]", "strength = 2.4"];
    (changes.map(|(name, change)| (name.to_owned(), change)).to_vec(), said)
}

/// The file of a render for relighting, read back.
fn rendered(scene: &Scene, settings: &RenderSettings) -> StoredPlanes {
    let settings = RenderSettings { buffers: scene.buffers().to_vec(), ..settings.clone() };
    let film = film(scene, &settings);
    let receipt = scene.buffers_receipt(&settings, scene.buffers());
    StoredPlanes::read(&film.encode(scene.buffers(), Format::Npz, &FileSettings::default(), &receipt).unwrap()).unwrap()
}

fn pixels(image: &Image) -> &[f32] {
    image.pixels.as_flattened()
}

#[test]
fn a_picture_lit_again_is_that_of_the_changed_scene() {
    let sampled = RenderSettings { aa_mode: AaMode::Full, ..RenderSettings::default() };
    let traced = RenderSettings { visibility: VisibilityMode::Traced, ..RenderSettings::default() };
    let (changes, [key, fill, lamp]) = changes();
    let relight_too = "buffers = [\"color\", \"relight\"]";
    for (settings, samples, is_exact) in [
        (&sampled, "samples = 9", true),
        (&traced, "samples = \"exact\"", true),
        (&RenderSettings::default(), "samples = 9", false),
        (&RenderSettings::default(), "samples = \"exact\"", false),
    ] {
        let of =
            |[key, fill, lamp]: [&str; 3], more: &str| compiled(&text(key, fill, lamp, &format!("{samples}\n{more}")));
        let (before, after) = (of(BEFORE, relight_too), of([key, fill, lamp], ""));
        let file = rendered(&before, settings);
        let relit = relight(&file, &changes).unwrap();
        let truth = film(&after, settings).develop();
        assert_eq!(relit.display, after.display());
        if is_exact {
            assert!(pixels(&relit.image) == pixels(&truth), "{samples}");
        }
        let codes = |image: &Image| {
            let png = image.encode(Format::Png8, &relit.display, &Receipt::default()).unwrap();
            StoredImage::read(&png).unwrap().pixels.into_flattened()
        };
        let (relit_codes, codes) = (codes(&relit.image), codes(&truth));
        let worst = relit_codes.iter().zip(&codes).map(|(a, b)| (a - b).abs() * 255.0).fold(0.0, f32::max);
        assert!(worst < 2.5, "{samples}: {worst} steps");
        // Nothing changed is the picture
        let same = relight(&file, &[("key".into(), LightChange::Times(1.0))]).unwrap();
        let color = film(&before, settings).develop();
        assert!(pixels(&same.image) == pixels(&color), "{samples}");
    }
}

#[test]
fn lights_that_share_a_pixel_are_lit_again() {
    let more = |strength: &str| {
        let [key, fill, lamp] = BEFORE;
        let wing = "[[light.rectangle]]\nname = \"wing\"\ncenter = [2.3, 1.5, 1]\ne0 = [0.8, 0, 0]\n\
                    e1 = [0, 0.6, 0.2]\nsides = \"both\"\n";
        let text = text(key, fill, lamp, "samples = 9\nbuffers = [\"relight\"]");
        compiled(&format!("{text}{wing}{strength}\n"))
    };
    let sampled = RenderSettings { aa_mode: AaMode::Full, ..RenderSettings::default() };
    let file = rendered(&more("color = [0.9, 0.7, 0.3]\nstrength = 1.3"), &sampled);
    let of = |name: &str| match &file.plane(name).unwrap().numbers {
        PlaneVec::Floats(shares) => shares.clone(),
        PlaneVec::Wholes(_) => panic!("{name} is whole"),
    };
    let both = of("coverage:key").into_iter().zip(of("coverage:wing")).filter(|(a, b)| *a > 0.0 && *b > 0.0).count();
    assert!(both >= 4, "{both}");
    let relit = relight(&file, &[("wing".into(), LightChange::Strength(0.7))]).unwrap();
    let truth = film(&more("color = [0.9, 0.7, 0.3]\nstrength = 0.7"), &sampled).develop();
    assert!(pixels(&relit.image) == pixels(&truth));
}

#[test]
fn lights_beside_surfaces_that_emit_light_are_lit_again() {
    let of = |strength: &str| {
        let [_, fill, lamp] = BEFORE;
        let sign = "[material.phong.sign]\ndiffuse = 0.2\nemissive = [0.7, 0.4, 0.1]\n\
                    [[rectangle]]\ncenter = [1.5, 1.2, 0.5]\nsize = [2, 1]\nnormal = [0, 0, 1]\nmaterial = \"sign\"\n";
        compiled(&(text(strength, fill, lamp, "samples = 9\nbuffers = [\"relight\"]") + sign))
    };
    let sampled = RenderSettings { aa_mode: AaMode::Full, ..RenderSettings::default() };
    let file = rendered(&of(BEFORE[0]), &sampled);
    let relit = relight(&file, &[("key".into(), LightChange::Strength(0.4))]).unwrap();
    let truth = film(&of("strength = 0.4"), &sampled).develop();
    let both = pixels(&relit.image).iter().zip(pixels(&truth));
    let worst = both.clone().map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst < 1e-6, "{worst}");
    let off = both.filter(|(a, b)| a != b).count();
    assert!(off < pixels(&truth).len() / 8, "{off} numbers differ: more than those of pixels that see the sign");
    // What surfaces emit is not the light's
    let dark = relight(&file, &[("key".into(), LightChange::Strength(0.0))]).unwrap();
    let sign = dark.image.pixels.iter().map(|pixel| pixel[0]).fold(0.0, f32::max);
    assert!(sign >= 0.7, "{sign}");
}

#[test]
fn many_lights_are_lit_again() {
    let lamps = |strength: f64| -> String {
        let lamp = |i: u32| {
            let x = f64::from(i) * 0.3 - 3.0;
            let strength = if i == 4 { strength } else { 0.3 };
            format!("[[light.point]]\nname = \"lamp {i}\"\nposition = [{x}, 2, 3]\nstrength = {strength}\n")
        };
        (0..20).map(lamp).collect()
    };
    let of = |strength: f64, more: &str| {
        let [key, fill, lamp] = BEFORE;
        compiled(&(text(key, fill, lamp, &format!("samples = 4\n{more}")) + &lamps(strength)))
    };
    let file = rendered(&of(0.3, "buffers = [\"relight\"]"), &RenderSettings::default());
    let relit = relight(&file, &[("lamp 4".into(), LightChange::Strength(2.0))]).unwrap();
    let truth = film(&of(2.0, ""), &RenderSettings::default()).develop();
    let apart = pixels(&relit.image).iter().zip(pixels(&truth)).map(|(a, b)| (a - b).abs());
    let worst = apart.fold(0.0, f32::max);
    assert!(worst < 0.01, "{worst}");
    let full = RenderSettings { aa_mode: AaMode::Full, ..RenderSettings::default() };
    let relit = relight(
        &rendered(&of(0.3, "buffers = [\"relight\"]"), &full),
        &[("lamp 4".into(), LightChange::Strength(2.0))],
    );
    assert!(pixels(&relit.unwrap().image) == pixels(&film(&of(2.0, ""), &full).develop()));
}

#[test]
fn what_cannot_be_lit_again_is_told() {
    let [key, fill, lamp] = BEFORE;
    let scene = compiled(&text(key, fill, lamp, "samples = 4\nbuffers = [\"color\", \"relight\", \"alpha\"]"));
    assert_eq!(scene.buffers().iter().filter(|buffer| **buffer == Plane::Alpha.into()).count(), 1);
    let file = rendered(&scene, &RenderSettings::default());
    let fault = |name: &str, change: LightChange| relight(&file, &[(name.into(), change)]).unwrap_err().to_string();
    for (name, change, expected) in [
        ("kee", LightChange::Times(2.0), "no light is called kee; did you mean key?"),
        ("#4", LightChange::Times(2.0), "there is no light #4: the file has 3"),
        ("key", LightChange::Strength(-1.0), "outside [0, 1e15]"),
        ("key", LightChange::Times(1e300), "outside [0, 1e15]"),
    ] {
        let said = fault(name, change);
        assert!(said.contains(expected), "{said}");
    }
    // What is not in the file
    for gone in ["ambient", "alpha", "light:fill:unscaled-specular", "coverage:key"] {
        let mut less = file.clone();
        less.planes.retain(|plane| plane.name != gone);
        let said = relight(&less, &[("key".into(), LightChange::Times(2.0))]).unwrap_err().to_string();
        assert!(said.contains(&format!("no buffer {gone}; render it with --buffers color,relight")), "{said}");
    }
    let mut less = file.clone();
    less.receipt.entries.retain(|(entry, _)| entry != "lights");
    assert!(relight(&less, &[]).unwrap_err().to_string().contains("does not say what its lights are"));
    // What no render writes
    for said in ["0", "65", "65536", "x"] {
        let mut odd = file.clone();
        odd.receipt.entries.iter_mut().find(|(key, _)| key == "antialiasing").unwrap().1 = said.into();
        let fault = relight(&odd, &[("key".into(), LightChange::Times(2.0))]).unwrap_err().to_string();
        assert!(fault.contains("antialiasing, 1 to 64"), "{fault}");
    }
    for share in [f32::INFINITY, f32::NAN, -0.5, 1e9] {
        let mut odd = file.clone();
        let seen = odd.planes.iter_mut().find(|plane| plane.name == "coverage:key").unwrap();
        seen.numbers = PlaneVec::Floats(vec![share; seen.numbers.numbers().count()]);
        let fault = relight(&odd, &[("key".into(), LightChange::Times(2.0))]).unwrap_err().to_string();
        assert!(fault.contains("coverage:key") && fault.contains("0 to 1"), "{fault}");
    }
    let bad = LightChange::Color(ColorDesc::linear(-1.0, f64::NAN, 1.0));
    assert!(fault("key", bad).contains("its colour would be -1"));
    // Nothing to multiply
    let dark = compiled(&text("strength = 0", fill, lamp, "samples = 4\nbuffers = [\"relight\"]"));
    let dark = rendered(&dark, &RenderSettings::default());
    let said = relight(&dark, &[("key".into(), LightChange::Strength(1.0))]).unwrap_err().to_string();
    assert!(said.contains("light key sent nothing"), "{said}");
}
