//! `cargo xtask meshes`: how long integrated light takes behind meshes, against 256 points traced at each camera ray
//! and against 1,024 points by shafts: a smooth model in a studio, a bumpy ball, a terrain, grass.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::num::NonZeroUsize;

use firstlight::{
    AaMode, BlinnPhongDesc, CameraDesc, ColorDesc, ColorParam, CompileOptions, LightDesc, MaterialDesc, MeshDesc,
    NoAssets, NumberParam, ParallelogramDesc, RectangleDesc, RenderDesc, SamplesDesc, Scene, SceneDesc, ShapeDesc,
    VisibilityMode, Window,
};
use pxfm::{f_cos, f_sin, f_sincos};

use crate::bench::{commit, processor};
use crate::engine::{self, AA, CONVERGED, Way, measure, table, way};
use crate::{Outcome, root, write};

/// What to measure, and where to write it.
#[derive(clap::Args)]
pub struct Options {
    /// Rounds: each runs every way once, one after the other.
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    /// Width and height of the pictures.
    #[arg(long, default_value_t = 1024)]
    size: u32,
    /// Width and height of the square in the middle that is rendered.
    #[arg(long, default_value_t = 256)]
    part: u32,
    /// Threads.
    #[arg(long, default_value_t = NonZeroUsize::MIN)]
    threads: NonZeroUsize,
    /// Only these: studio, ball, terrain, grass.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// The folder under docs/benchmarks, usually the date and the machine.
    #[arg(long)]
    name: Option<String>,
}

/// A scene by its name, of so many pixels across.
type Maker = fn(u32, SamplesDesc) -> Result<Scene, String>;

const SCENES: [(&str, &str, Maker); 4] = [
    ("studio", "a smooth torus knot of 70,000 triangles on a floor, key and fill light", studio),
    ("ball", "a bumpy ball of 14,000 flat triangles on a floor, one light", ball),
    ("terrain", "a terrain of a million triangles, three lights", terrain),
    ("grass", "100,000 blades of grass, one light behind them", grass),
];

pub fn run(options: &Options) -> Outcome {
    use {AaMode::*, VisibilityMode::*};
    let mut page = String::new();
    let Options { rounds, size, part, threads, .. } = options;
    let _ = writeln!(page, "## Integrated light behind meshes\n");
    let _ = writeln!(
        page,
        "The {part} x {part} pixels in the middle of {size} x {size}, {AA} x {AA} camera rays in each, {threads} \
         threads, {rounds} rounds. In each round every way ran once, one after the other, in one process; times are \
         medians of the render stage. Errors are against {} points on each light, which have an error of their \
         own.\n",
        CONVERGED[1]
    );
    let _ = writeln!(page, "- processor: {}", processor());
    let _ = writeln!(page, "- commit: {}\n", commit());
    for (name, what, maker) in SCENES {
        if !options.only.is_empty() && options.only.iter().all(|only| only != name) {
            continue;
        }
        let mut ways: Vec<Way> = vec![
            way("256 points traced, every camera ray", 256.into(), Traced, Full),
            way("1,024 points, shafts, every camera ray", 1024.into(), Shafts, Full),
            way("integrated: the default", SamplesDesc::Exact, Shafts, Adaptive),
        ];
        let part = (*part).clamp(1, *size);
        let from = (size - part) / 2;
        for way in &mut ways {
            way.settings.threads = Some(*threads);
            way.settings.crop = Some(Window { x: from, y: from, width: part, height: part });
        }
        measure(&mut ways, *rounds, CONVERGED[1], &|samples| maker(*size, samples))?;
        let _ = writeln!(page, "### {name}: {what}\n");
        table(&mut page, &ways);
        page.push('\n');
    }
    println!("{page}");
    match &options.name {
        Some(name) => write(&root().join("docs/benchmarks").join(name).join("meshes.md"), page.as_bytes()),
        None => Ok(()),
    }
}

/// Positions, normals if they are blended, triangles.
#[derive(Default)]
struct Model {
    positions: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Model {
    /// Rows of points, `across` in each, around and around: two triangles between each four.
    fn join(&mut self, rows: u32, across: u32, closed: bool) {
        let row = |j: u32, i: u32| j % rows * across + i % across;
        for (j, i) in (0..rows - u32::from(!closed)).flat_map(|j| (0..across).map(move |i| (j, i))) {
            let [a, b, c, d] = [row(j, i), row(j + 1, i), row(j + 1, i + 1), row(j, i + 1)];
            self.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

fn material(diffuse: f64, specular: f64) -> MaterialDesc {
    MaterialDesc::BlinnPhong(BlinnPhongDesc {
        diffuse: ColorParam::gray(diffuse),
        specular: ColorParam::gray(specular),
        shininess: NumberParam::constant(40.0),
        ..BlinnPhongDesc::default()
    })
}

/// A light of `width` x `height` at `center` that faces `at`.
fn lamp(center: [f64; 3], at: [f64; 3], [width, height]: [f64; 2], color: [f64; 3], strength: f64) -> LightDesc {
    let way = sub(at, center);
    let e0 = unit(cross(way, [0.0, 1.0, 0.0]));
    let e1 = unit(cross(way, e0));
    LightDesc::Rectangle(RectangleDesc {
        color: ColorDesc::linear(color[0], color[1], color[2]),
        strength,
        ..RectangleDesc::with_edges(center, e0.map(|v| v * width), e1.map(|v| v * height))
    })
}

/// A model on a floor.
fn on_floor(
    model: Model,
    lights: Vec<LightDesc>,
    (eye, at, fov): ([f64; 3], [f64; 3], f64),
    size: u32,
    samples: SamplesDesc,
) -> Result<Scene, String> {
    let mesh = MeshDesc {
        positions: model.positions,
        normals: model.normals,
        triangles: model.triangles,
        material: Some("model".into()),
        ..MeshDesc::default()
    };
    let floor = ParallelogramDesc {
        material: Some("floor".into()),
        ..ParallelogramDesc::new([-8.0, 0.0, 8.0], [16.0, 0.0, 0.0], [0.0, 0.0, -16.0])
    };
    let desc = SceneDesc {
        render: RenderDesc { width: size, height: size, antialiasing: AA, samples, ..RenderDesc::default() },
        materials: vec![("model".into(), material(0.6, 0.3)), ("floor".into(), material(0.5, 0.0))],
        shapes: vec![ShapeDesc::Mesh(mesh), ShapeDesc::Parallelogram(floor)],
        lights,
        cameras: vec![(String::new(), CameraDesc { look_at: at, fov_y_deg: Some(fov), ..CameraDesc::new(eye) })],
        ..SceneDesc::default()
    };
    Ok(desc.compile(&NoAssets, &CompileOptions::default()).map_err(|e| e.to_string())?.scene)
}

fn studio(size: u32, samples: SamplesDesc) -> Result<Scene, String> {
    const AROUND: u32 = 700;
    const ACROSS: u32 = 50;
    let center = |u: f64| {
        let r = 0.35 * f_cos(3.0 * u) + 0.8;
        [r * f_cos(2.0 * u), -0.35 * f_sin(3.0 * u), r * f_sin(2.0 * u)]
    };
    let mut model = Model::default();
    for j in 0..AROUND {
        let u = TAU * f64::from(j) / f64::from(AROUND);
        let (c, along) = (center(u), unit(sub(center(u + 1e-4), center(u - 1e-4))));
        let aside = unit(cross(along, c));
        let up = cross(aside, along);
        for i in 0..ACROSS {
            let (sin, cos) = f_sincos(TAU * f64::from(i) / f64::from(ACROSS));
            let n: [f64; 3] = std::array::from_fn(|k| up[k] * cos + aside[k] * sin);
            model.positions.push(std::array::from_fn(|k| c[k] + 0.18 * n[k] + if k == 1 { 0.56 } else { 0.0 }));
            model.normals.push(n);
        }
    }
    model.join(AROUND, ACROSS, true);
    let at = [0.0, 0.5, 0.0];
    let lights = vec![
        lamp([1.8, 2.9, 1.4], at, [1.3, 1.3], [1.0; 3], 14.0),
        lamp([-2.6, 2.2, 1.6], at, [1.6, 1.2], [0.8, 0.9, 1.0], 4.0),
    ];
    on_floor(model, lights, ([2.2, 2.0, 3.4], at, 32.0), size, samples)
}

fn ball(size: u32, samples: SamplesDesc) -> Result<Scene, String> {
    const ROWS: u32 = 60;
    const ACROSS: u32 = 120;
    let mut model = Model::default();
    for j in 0..ROWS {
        let (sin, cos) = f_sincos(TAU * 0.5 * (f64::from(j) + 0.5) / f64::from(ROWS));
        for i in 0..ACROSS {
            let around = TAU * f64::from(i) / f64::from(ACROSS);
            let [x, y, z] = [sin * f_cos(around), cos, -sin * f_sin(around)];
            let r = 0.8 * (1.0 + 0.12 * f_sin(7.0 * x + 1.0) * f_sin(6.0 * y) * f_sin(8.0 * z + 2.0));
            model.positions.push([x * r, y * r + 0.85, z * r]);
        }
    }
    model.join(ROWS, ACROSS, false);
    let lights = vec![lamp([1.4, 2.9, 1.0], [0.0, 0.6, 0.0], [1.2, 1.2], [1.0; 3], 14.0)];
    on_floor(model, lights, ([2.0, 1.9, 3.2], [0.0, 0.7, 0.0], 36.0), size, samples)
}

fn terrain(size: u32, samples: SamplesDesc) -> Result<Scene, String> {
    engine::terrain(707, size, &engine::LIGHTS, samples)
}

fn grass(size: u32, samples: SamplesDesc) -> Result<Scene, String> {
    let mut state = 1u64;
    let mut random = |low: f64, high: f64| {
        // Knuth's linear congruential generator
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut model = Model::default();
    for blade in 0..100_000 {
        let (x, z, height) = (random(-6.0, 6.0), random(-6.0, 6.0), random(0.12, 0.3));
        let (sin, cos) = f_sincos(random(0.0, TAU));
        let lean = [random(-0.1, 0.1), random(-0.1, 0.1)];
        let (dx, dz) = (0.006 * cos, 0.006 * sin);
        model.positions.extend([[x - dx, 0.0, z - dz], [x + dx, 0.0, z + dz], [x + lean[0], height, z + lean[1]]]);
        model.triangles.push([3 * blade, 3 * blade + 1, 3 * blade + 2]);
    }
    let lights = vec![lamp([-1.5, 3.0, -3.0], [0.0; 3], [1.5, 1.5], [1.0; 3], 25.0)];
    on_floor(model, lights, ([2.5, 1.0, 3.5], [0.0, 0.1, 0.0], 30.0), size, samples)
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / length)
}
