//! Many pictures of one scene: it is read and compiled once, and the camera goes around.
//!
//! ```sh
//! cargo run --release -p firstlight --example turntable -- scenes/gallery/meshes/spot.obj turn 36
//! ```

use std::error::Error;
use std::ops::ControlFlow;
use std::path::Path;

use firstlight::{
    CameraDesc, CompileOptions, DVec3, FolderAssets, Format, RenderSettings, SceneDesc, Studio, StudioSettings,
    TransformDesc, render, write_whole,
};

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let model = args.next().ok_or("usage: turntable MODEL [FOLDER] [PICTURES]")?;
    let folder = args.next().unwrap_or("turn".into());
    let pictures = args.next().map_or(Ok(36), |n| n.parse())?;
    std::fs::create_dir_all(&folder)?;
    turn(Path::new(&model), Path::new(&folder), pictures, 256)
}

/// Writes `pictures` pictures of a model (.glb, .gltf, .obj, .ply, .stl), seen from all around, to `000.png`, `001.png`
/// and so on.
fn turn(model: &Path, folder: &Path, pictures: u32, size: u32) -> Result<(), Box<dyn Error>> {
    let name = model.file_name().and_then(|name| name.to_str()).ok_or("the model's file has no name")?;
    let assets = FolderAssets::new(model.parent().unwrap_or(Path::new("")), &[]).map_err(|(_, why)| why)?;
    // A scene around the model. It is given lights, and a camera, which is replaced below
    let studio = StudioSettings { studio: Studio::Hard, ..StudioSettings::default() };
    let mut desc = SceneDesc::of_model(name, &studio);
    (desc.render.width, desc.render.height) = (size, size);
    let options = CompileOptions { studio: Some(studio), ..CompileOptions::default() };
    // Compiled once: the model is read and its tree built here and nowhere else
    let scene = desc.compile(&assets, &options)?.scene;
    let [low, high] = scene.summary().bounds.ok_or("the model is empty")?.map(DVec3::from);
    let (middle, radius) = ((low + high) * 0.5, (high - low).length() * 0.5);
    // A field of view of 30 degrees holds a ball that is 3.9 radii away
    let mut camera = CameraDesc::new([0.0, radius, 4.0 * radius]);
    camera.fov_y_deg = Some(30.0);
    let settings = RenderSettings::default();
    for i in 0..pictures {
        // Around the origin first, then to the model
        camera.transform = Some(Box::new(TransformDesc {
            rotate_deg: [0.0, 360.0 * f64::from(i) / f64::from(pictures), 0.0],
            translate: middle.to_array(),
            ..TransformDesc::default()
        }));
        let seen = scene.with_camera(&camera)?;
        let ControlFlow::Continue((film, stats)) = render(&seen, &settings, &|_, _| ControlFlow::Continue(())) else {
            return Ok(());
        };
        let bytes = film.develop().encode(Format::Png8, &seen.display(), &seen.receipt(&settings))?;
        write_whole(&folder.join(format!("{i:03}.png")), &bytes)?;
        println!("{} of {pictures}, {} rays", i + 1, stats.camera_rays + stats.shadow_rays);
    }
    Ok(())
}

#[test]
fn each_picture_is_another() {
    let folder = tempfile::tempdir().unwrap();
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/gallery/meshes/spot.obj");
    turn(&model, folder.path(), 3, 16).unwrap();
    let pictures: Vec<_> = (0..3).map(|i| std::fs::read(folder.path().join(format!("00{i}.png"))).unwrap()).collect();
    assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2]);
}
