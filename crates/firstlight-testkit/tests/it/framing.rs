//! The camera that is found for a model: its outline is in the middle of the picture, and touches the margin.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use firstlight::{
    CompileOptions, DVec3, FolderAssets, Framing, Scene, SceneDesc, Studio, StudioSettings, UpAxis, View, read_mesh,
};

/// Pixels across and down.
const SIZE: [u32; 2] = [320, 220];

/// All models that are kept here, by their endings.
fn models() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let models = root.join("../firstlight/tests/models");
    let mut folders =
        vec![models.join("ply"), models.join("stl"), models.join("obj"), root.join("../../scenes/gallery/meshes")];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| ["ply", "stl", "obj"].iter().any(|known| e == *known)) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn compiled(model: &Path, framing: Framing, up: UpAxis) -> Scene {
    let assets = FolderAssets::new(model.parent().unwrap(), &[]).unwrap();
    let settings = StudioSettings { studio: Studio::Hard, up: Some(up), ..StudioSettings::default() };
    let mut desc = SceneDesc::of_model(model.file_name().unwrap().to_str().unwrap(), &settings);
    [desc.render.width, desc.render.height] = SIZE;
    let options = CompileOptions { framing, studio: Some(settings), ..CompileOptions::default() };
    desc.compile(&assets, &options).unwrap_or_else(|e| panic!("{}: {e}", model.display())).scene
}

/// The least and the most place of points in the picture, from its left and from its top, in parts of it.
fn project(scene: &Scene, points: impl Iterator<Item = DVec3>) -> [[f64; 2]; 2] {
    let (camera, mut found) = (scene.camera(), [[f64::INFINITY, f64::NEG_INFINITY]; 2]);
    let (frame, half) = (camera.frame(), camera.film_half_size().map(f64::from));
    let [right, up, forward] = [frame.right, frame.up, frame.forward].map(|v| v.as_dvec3());
    for point in points {
        let from = point - frame.position;
        let depth = from.dot(forward);
        let at = [from.dot(right) / depth / half[0], -from.dot(up) / depth / half[1]];
        for (found, at) in found.iter_mut().zip(at) {
            let at = 0.5 + 0.5 * at;
            *found = [found[0].min(at), found[1].max(at)];
        }
    }
    found
}

/// The columns and rows in which a ray through the middle of a pixel meets the model: the first of each, and the one
/// after the last.
fn seen(scene: &Scene) -> Option<[[u32; 2]; 2]> {
    let mut found = [[u32::MAX, 0]; 2];
    for (y, x) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (y, x))) {
        let (ray, _) = scene.camera().ray(x as f32 + 0.5, y as f32 + 0.5, 1.0);
        if scene.intersect(&ray).is_some() {
            for (found, at) in found.iter_mut().zip([x, y]) {
                *found = [found[0].min(at), found[1].max(at + 1)];
            }
        }
    }
    (found[0][1] > 0).then_some(found)
}

#[test]
fn every_model_is_in_the_middle_of_its_picture() {
    let models = models();
    assert!(models.len() >= 15, "{} models", models.len());
    for model in models {
        let name = model.file_name().unwrap().to_string_lossy().into_owned();
        let mesh = read_mesh(&name, &std::fs::read(&model).unwrap(), &|_, _| ControlFlow::Continue(())).unwrap();
        for (view, margin) in
            [(View::default(), 0.04), (View::from_name("iso").unwrap(), 0.0), (View::new(-100.0, -35.0), 0.1)]
        {
            let scene = compiled(&model, Framing { view, margin, ..Framing::default() }, UpAxis::Y);
            let free = SIZE.map(|side| margin * f64::from(SIZE[1]) / f64::from(side));
            // The corners of its triangles, projected: equal on both sides, the margin where it is narrowest
            let corners = mesh
                .triangles
                .iter()
                .flatten()
                .map(|i| DVec3::from(mesh.origin) + DVec3::from(mesh.positions[*i as usize].map(f64::from)));
            let at = project(&scene, corners);
            let mut least = f64::INFINITY;
            for (at, free) in at.iter().zip(free) {
                assert!((at[0] - (1.0 - at[1])).abs() < 1e-3, "{name} {view:?}: {at:?}");
                least = least.min(at[0] - free);
            }
            assert!(least.abs() < 1e-3, "{name} {view:?}: {at:?}, {free:?}");
            if view != View::default() {
                continue;
            }
            // And the picture itself, to one part in a hundred: up to two pixels of a tip lie between the rays
            let Some(seen) = seen(&scene) else { panic!("{name} {view:?}: nothing is seen") };
            for (seen, size) in seen.iter().zip(SIZE) {
                let [one, other] = [seen[0], size - seen[1]];
                assert!(one.abs_diff(other) <= 3, "{name} {view:?}: {seen:?} of {size}");
            }
        }
    }
}

#[test]
fn upwards_is_what_is_said() {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/gallery/meshes/spot.obj");
    let of = |up| {
        seen(&compiled(&model, Framing { view: View::new(0.0, 0.0), margin: 0.0, ..Framing::default() }, up)).unwrap()
    };
    // The calf from the front, and from above with its head on the near side: another outline
    let ([x, y], [other_x, other_y]) = (of(UpAxis::Y), of(UpAxis::Z));
    assert_eq!((y[0], y[1]), (0, SIZE[1]));
    assert!(x != other_x || y != other_y);
}
