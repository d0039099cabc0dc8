//! `cargo xtask lights`: a hall full of small lights, its time, and how far its picture is from one in which every
//! light is asked for.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Instant;

use firstlight::{
    AaMode, BlinnPhongDesc, CameraDesc, ColorDesc, ColorParam, CompileOptions, EmitSides, LightDesc, MaterialDesc,
    NoAssets, NumberParam, ParallelogramDesc, PointDesc, RectangleDesc, RenderSettings, SamplesDesc, SceneDesc,
    ShapeDesc, SphereDesc, SphereLightDesc, SpotDesc, VisibilityMode, Window,
};
use firstlight_testkit::scenes::{self, Random};

use crate::bench::{Difference, picture};
use crate::{Outcome, write};

/// What to measure.
#[derive(clap::Args)]
pub struct Options {
    /// How many lights.
    #[arg(long, default_value_t = 1000)]
    lights: u32,
    /// Width and height of the picture.
    #[arg(long, default_value_t = 512)]
    size: u32,
    /// Antialiasing.
    #[arg(long, default_value_t = 4)]
    aa: u32,
    /// Threads.
    #[arg(long, default_value_t = NonZeroUsize::new(2).expect("it is 2"))]
    threads: NonZeroUsize,
    /// Points and spots alone.
    #[arg(long)]
    points: bool,
    /// Shapes are a mesh, in a tree.
    #[arg(long)]
    mesh: bool,
    /// Asks for every light at every ray as well, and compares.
    #[arg(long)]
    all: bool,
    /// Renders only a square of so many pixels in the middle.
    #[arg(long)]
    part: Option<u32>,
    /// Writes the scene there, and measures nothing.
    #[arg(long)]
    write: Option<PathBuf>,
}

pub fn run(options: &Options) -> Outcome {
    let desc = hall(options);
    if let Some(path) = &options.write {
        return write(path, desc.to_toml().as_bytes());
    }
    let start = Instant::now();
    let compiled = desc.compile(&NoAssets, &CompileOptions::default()).map_err(|e| e.to_string())?;
    let scene = compiled.scene;
    println!("{} lights: compiled in {:.2} s", options.lights, start.elapsed().as_secs_f64());
    let crop = options.part.map(|part| {
        let from = options.size.saturating_sub(part) / 2;
        Window { x: from, y: from, width: part.min(options.size), height: part.min(options.size) }
    });
    let fast =
        RenderSettings { threads: Some(options.threads), aa_mode: AaMode::Adaptive, crop, ..RenderSettings::default() };
    let (image, stats, seconds) = picture(&scene, &fast)?;
    let lights = stats.lights;
    let places = (lights.pairs / u64::from(options.lights).max(1)).max(1) as f64;
    println!(
        "exact, adaptive: {seconds:.2} s; at each place {:.1} lights by themselves and {:.1} points for {:.1} lights",
        lights.singly as f64 / places,
        lights.nodes as f64 / places,
        lights.together as f64 / places
    );
    if options.all {
        let traced = RenderSettings { visibility: VisibilityMode::Traced, ..fast };
        let (all, _, seconds) = picture(&scene, &traced)?;
        let Difference { worst, rms, over } = Difference::between(&image, &all, &scene.display());
        println!(
            "every light at every ray: {seconds:.2} s; off by {worst:.3} steps at worst, {rms:.4} rms, {over} of {} \
             pixels by more than 1",
            image.pixels.len()
        );
    }
    Ok(())
}

/// A hall of 40 x 40 metres with pillars, balls and walls, and small lights everywhere.
fn hall(options: &Options) -> SceneDesc {
    let mut random = Random::new(7);
    let size = options.size;
    let mut scene = scenes::empty(size, size, options.aa);
    scene.render.samples = SamplesDesc::Exact;
    let paint = |color: [f64; 3], specular: f64, shininess: f64| {
        MaterialDesc::BlinnPhong(BlinnPhongDesc {
            diffuse: ColorParam::constant(ColorDesc::linear(color[0], color[1], color[2])),
            specular: ColorParam::gray(specular),
            shininess: NumberParam::constant(shininess),
            ..BlinnPhongDesc::default()
        })
    };
    scene.materials.push(("floor".into(), paint([0.6, 0.6, 0.6], 0.0, 1.0)));
    scene.materials.push(("wall".into(), paint([0.7, 0.6, 0.5], 0.0, 1.0)));
    scene.materials.push(("ball".into(), paint([0.5, 0.5, 0.7], 0.3, 40.0)));
    let flat = |p: [f64; 3], e0: [f64; 3], e1: [f64; 3], material: &str| {
        ShapeDesc::Parallelogram(ParallelogramDesc {
            material: Some(material.into()),
            ..ParallelogramDesc::new(p, e0, e1)
        })
    };
    scene.shapes.push(flat([-20.0, 0.0, -20.0], [0.0, 0.0, 40.0], [40.0, 0.0, 0.0], "floor"));
    scene.shapes.push(flat([-20.0, 0.0, -20.0], [40.0, 0.0, 0.0], [0.0, 12.0, 0.0], "wall"));
    scene.shapes.push(flat([-20.0, 0.0, -20.0], [0.0, 12.0, 0.0], [0.0, 0.0, 40.0], "wall"));
    for i in 0..4 {
        let x = -12.0 + 8.0 * f64::from(i);
        scene.shapes.push(flat([x, 0.0, -10.0], [3.0, 0.0, 2.0], [0.0, 3.0, 0.0], "wall"));
    }
    for _ in 0..24 {
        let r = random.between(0.3, 1.2);
        let center = [random.between(-15.0, 15.0), r, random.between(-15.0, 12.0)];
        scene
            .shapes
            .push(ShapeDesc::Sphere(SphereDesc { material: Some("ball".into()), ..SphereDesc::new(center, r) }));
    }
    if options.mesh {
        let box_at = scenes::box_mesh([2.0, 1.0, 6.0], [2.0, 2.0, 2.0]);
        scene.shapes.push(ShapeDesc::Mesh(box_at));
    }
    let strength = 600.0 / f64::from(options.lights);
    for i in 0..options.lights {
        let p = [random.between(-19.0, 19.0), random.between(0.5, 11.0), random.between(-19.0, 19.0)];
        let color = ColorDesc::linear(random.between(0.2, 1.0), random.between(0.2, 1.0), random.between(0.2, 1.0));
        let kind = if options.points { i % 8 } else { i % 10 };
        scene.lights.push(match kind {
            0..=5 => LightDesc::Point(PointDesc { color, strength, ..PointDesc::new(p) }),
            6 | 7 => LightDesc::Spot(SpotDesc {
                look_at: [p[0] + random.between(-1.0, 1.0), p[1] - 1.0, p[2] + random.between(-1.0, 1.0)],
                cone_deg: 70.0,
                inner_cone_deg: Some(50.0),
                color,
                strength: 2.0 * strength,
                ..SpotDesc::new(p)
            }),
            8 => LightDesc::Sphere(SphereLightDesc {
                color,
                strength: strength / (std::f64::consts::PI * 9e-4),
                ..SphereLightDesc::new(p, 0.03)
            }),
            _ => LightDesc::Rectangle(RectangleDesc {
                color,
                strength: strength / 6.4e-3,
                sides: Some(EmitSides::Front),
                ..RectangleDesc::with_edges(p, [0.08, 0.0, 0.0], [0.0, 0.0, 0.08])
            }),
        });
    }
    scene.cameras.push((
        String::new(),
        CameraDesc { look_at: [0.0, 1.5, 0.0], fov_y_deg: Some(50.0), ..CameraDesc::new([3.0, 5.0, 19.0]) },
    ));
    scene
}
