//! What each pixel sees, without a picture: its depth, and how much of each light reaches it.
//!
//! ```sh
//! cargo run --release -p firstlight --example depth -- depth.png visible.png
//! ```

use std::error::Error;
use std::path::Path;

use firstlight::{
    CameraHit, CompileOptions, Display, Encoding, Format, Image, NoAssets, Receipt, Scene, SceneDesc, Window,
    builtin_scenes, write_whole,
};

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let files = [args.next().unwrap_or("depth.png".into()), args.next().unwrap_or("visible.png".into())];
    let scene = config11(256)?;
    let [depth, visible] = look(&scene);
    // White is 8 m away, black 24 m
    let gray = |d: f64| if d.is_finite() { ((24.0 - d) / 16.0).clamp(0.0, 1.0) } else { 0.0 };
    write(Path::new(&files[0]), &scene, &depth.iter().map(|d| gray(*d)).collect::<Vec<_>>())?;
    write(Path::new(&files[1]), &scene, &visible)
}

/// Four spheres in a box under a square light; it is sampled at 64 points.
fn config11(size: u32) -> Result<Scene, Box<dyn Error>> {
    let text = builtin_scenes().iter().find(|scene| scene.name == "config11").ok_or("it is built in")?.text;
    let mut parsed = SceneDesc::parse("config11.toml", text.as_bytes(), &NoAssets);
    (parsed.desc.render.width, parsed.desc.render.height) = (size, size);
    parsed.desc.render.samples = 64.into();
    Ok(parsed.compile(&NoAssets, &CompileOptions::default())?.scene)
}

/// For the middle of each pixel, row by row from the top: the depth in metres, infinite where nothing is, and the
/// visible fraction of all lights.
fn look(scene: &Scene) -> [Vec<f64>; 2] {
    let (mut depth, mut visible) = (Vec::new(), Vec::new());
    let points: usize = scene.lights().map(|light| scene.light_points(light)).sum();
    for y in 0..scene.height() {
        for x in 0..scene.width() {
            let (ray, differential) = scene.camera().ray(x as f32 + 0.5, y as f32 + 0.5, 1.0);
            // Depth is measured along the line of sight, not along the ray
            let along = f64::from(ray.d.dot(scene.camera().frame().forward));
            let hit = scene.intersect(&ray);
            depth.push(hit.map_or(f64::INFINITY, |hit| hit.t * along));
            visible.push(match scene.look(&ray, &differential) {
                CameraHit::Surface(surface) => {
                    let rays = scene.lights().flat_map(|light| scene.shadow_rays(&surface, light));
                    rays.filter(|ray| !scene.occluded(ray)).count() as f64 / points as f64
                }
                CameraHit::Emission(_) => 1.0,
                CameraHit::Background => 0.0,
            });
        }
    }
    [depth, visible]
}

/// Writes numbers from 0 to 1 as a gray picture, as they are.
fn write(file: &Path, scene: &Scene, gray: &[f64]) -> Result<(), Box<dyn Error>> {
    let (width, height) = (scene.width(), scene.height());
    let pixels = gray.iter().map(|v| [*v as f32, *v as f32, *v as f32, 1.0]).collect();
    let image = Image { film: [width, height], window: Window { x: 0, y: 0, width, height }, pixels };
    let display = Display { encoding: Encoding::Linear, ..Display::default() };
    write_whole(file, &image.encode(Format::Png16, &display, &Receipt::default())?)?;
    Ok(())
}

#[test]
fn the_back_wall_is_20_m_away_and_the_whole_light_is_seen_from_some_of_it() {
    let scene = config11(32).unwrap();
    let [depth, visible] = look(&scene);
    let nearest = depth.iter().copied().fold(f64::INFINITY, f64::min);
    let farthest = depth.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
    assert!((farthest - 20.0).abs() < 1e-3 && nearest < 18.0, "{nearest} to {farthest}");
    // Lit, in the umbra, in the penumbra
    assert!(visible.contains(&1.0) && visible.contains(&0.0));
    assert!(visible.iter().any(|v| 0.2 < *v && *v < 0.8));
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("visible.png"), &scene, &visible).unwrap();
}
