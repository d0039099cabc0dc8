//! Masks of objects: seen, and alone.

use std::ops::ControlFlow;

use firstlight::{
    Coco, CompileOptions, Film, Mask, NoAssets, Plane, PlaneNumbers, RenderSettings, Scene, SceneDesc, Window, render,
};

const HEAD: &str = "[render]\nwidth = 61\nheight = 47\n[camera]\nposition = [2, 3, 14]\nlook_at = [0, 1, 0]\n";

/// Shapes of all the places that rays look for them in, by name.
const SHAPES: [(&str, &str); 10] = [
    ("ball", "[[sphere]]\ncenter = [0, 1, 0]\nradius = 1.5"),
    ("far", "[[sphere]]\ncenter = [-1, 1, -4]\nradius = 2"),
    ("wall", "[[parallelogram]]\np = [-3, -1, -2]\ne0 = [6, 0, 0]\ne1 = [0, 4, 0]\nsingle_sided = true"),
    ("away", "[[parallelogram]]\np = [-3, -1, -6]\ne0 = [0, 4, 0]\ne1 = [6, 0, 0]\nsingle_sided = true"),
    ("floor", "[[plane]]\npoint = [0, -1, 0]"),
    ("box", "[[box]]\ncenter = [3, 0, 1]\nsize = [2, 2, 2]\ntransform = { rotate_deg = [0, 30, 0] }"),
    ("one", "[[mesh]]\npositions = [[-4, -1, 2], [1, -1, 2], [-2, 4, 1]]\ntriangles = [[0, 1, 2]]"),
    ("two", "[[mesh]]\npositions = [[-2, 0, 3], [3, -1, -3], [0, 5, 0]]\ntriangles = [[0, 1, 2]]\nsingle_sided = true"),
    ("seeds", "[[point_set]]\npositions = [[-3, 2, 3], [-2, 3, 0], [2, 3, -3]]\nradius = 0.7"),
    ("placed", "[[instance]]\nof = \"g\""),
];

const GROUP: &str = "[[group.g.mesh]]\npositions = [[0, 0, 0], [4, 0, -2], [0, 4, 0]]\ntriangles = [[0, 1, 2]]\n";
const LIGHT: &str = "[[light.sphere]]\nname = \"lamp\"\ncenter = [-1, 3, -1]\nradius = 1\nvisible = true\n";

/// The scene with those that are seen.
fn compiled(is_seen: impl Fn(&str) -> bool, lamp: bool, more: &str) -> (Scene, Film) {
    let shapes = SHAPES.map(|(name, text)| format!("{text}\nname = \"{name}\"\nvisible = {}\n", is_seen(name)));
    let light = if lamp { LIGHT.to_owned() } else { LIGHT.replace("visible = true", "visible = false") };
    let text = format!("{HEAD}{light}{GROUP}{}{more}", shapes.concat());
    let parsed = SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets);
    let scene = parsed.compile(&NoAssets, &CompileOptions::default()).expect("is a scene").scene;
    let settings = RenderSettings { buffers: vec![Plane::ObjectId.into()], ..RenderSettings::default() };
    let ControlFlow::Continue((film, _)) = render(&scene, &settings, &|_, _| ControlFlow::Continue(())) else {
        unreachable!("nothing stops it")
    };
    (scene, film)
}

/// The pixels of a mask, row by row.
fn pixels(mask: &Mask) -> Vec<bool> {
    let [width, height] = mask.size().map(|side| side as usize);
    let mut columns = Vec::new();
    for (i, count) in mask.counts().into_iter().enumerate() {
        columns.extend(std::iter::repeat_n(i % 2 == 1, count as usize));
    }
    (0..width * height).map(|pixel| columns[pixel % width * height + pixel / width]).collect()
}

fn ids(film: &Film) -> &[u32] {
    let Some(PlaneNumbers::Wholes(ids)) = film.numbers(Plane::ObjectId) else { panic!("ids were asked for") };
    ids
}

/// Both masks of all objects, the second against a render in which nothing else is seen. `more` is added to the scene.
fn check(more: &str) {
    let (scene, film) = compiled(|_| true, true, more);
    let names = scene.object_names();
    let masks = scene.object_masks(&film).expect("ids were asked for");
    let named = |id: u32| names[id as usize - 1].unwrap_or_default().to_owned();
    let mut hidden = 0;
    for of in masks.iter().filter(|of| !named(of.id).is_empty()) {
        let name = named(of.id);
        assert_eq!(pixels(&of.visible), ids(&film).iter().map(|id| *id == of.id).collect::<Vec<_>>(), "{name}");
        let (_, alone) = compiled(|other| name.split('/').any(|part| part == other), name == "lamp", "");
        let alone: Vec<bool> = ids(&alone).iter().map(|id| *id > 0).collect();
        assert_eq!(pixels(&of.amodal), alone, "{name}");
        hidden += usize::from(of.amodal.area() > of.visible.area());
    }
    // All that face the camera are seen, and most of them are partly hidden
    assert!(masks.len() >= 9 && hidden >= 6, "{} {hidden}", masks.len());
    assert!(!masks.iter().any(|of| named(of.id) == "away"));
}

#[test]
fn an_object_alone_is_what_a_render_of_it_alone_shows() {
    check("");
}

#[test]
fn that_holds_where_shapes_lie_in_a_tree() {
    check(&"[[sphere]]\ncenter = [0, -9, 0]\nradius = 0.1\n[[sphere]]\ncenter = [0, -9, 1]\nradius = 0.2\n".repeat(30));
}

#[test]
fn a_data_set_counts_pictures_and_annotations() {
    let (scene, film) = compiled(|_| true, true, "");
    let mut coco = Coco::new();
    assert!(coco.add(&scene, &film, "a.png") && coco.add(&scene, &film, "b/\"c\".png"));
    let json: serde_json::Value = serde_json::from_str(&coco.to_json()).expect("is JSON");
    let list = |key: &str| json[key].as_array().expect("is a list").clone();
    let masks = scene.object_masks(&film).expect("ids were asked for");
    assert_eq!((list("images").len(), list("annotations").len()), (2, 2 * masks.len()));
    assert_eq!(list("images")[1]["file_name"], "b/\"c\".png");
    let categories: Vec<_> = list("categories").iter().map(|category| category["name"].clone()).collect();
    // The mesh of the group has no name of its own, and is called as its instance
    assert!(categories.contains(&"lamp".into()) && categories.contains(&"away".into()), "{categories:?}");
    for (i, annotation) in list("annotations").iter().enumerate() {
        let of = &masks[i % masks.len()];
        assert_eq!((&annotation["id"], &annotation["object_id"]), (&(i + 1).into(), &of.id.into()));
        assert_eq!(annotation["area"], of.visible.area());
        assert_eq!(annotation["bbox"], serde_json::json!(of.visible.bounds()));
        let category = annotation["category_id"].as_u64().expect("is a number") as usize;
        let name = annotation["object_name"].as_str().unwrap_or("unnamed");
        assert_eq!(categories[category - 1], name.rsplit('/').next().unwrap_or_default());
    }
    // Without ids there are no masks
    let ControlFlow::Continue((picture, _)) = render(
        &scene,
        &RenderSettings { crop: Some(Window { x: 0, y: 0, width: 4, height: 4 }), ..RenderSettings::default() },
        &|_, _| ControlFlow::Continue(()),
    ) else {
        unreachable!("nothing stops it")
    };
    assert!(!coco.add(&scene, &picture, "d.png") && scene.object_masks(&picture).is_none());
}
