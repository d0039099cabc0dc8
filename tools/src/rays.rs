//! `cargo xtask rays`: rays through meshes, ours and Embree's in turns, on one thread.
//!
//! Embree is driven by `tools/embree/embree.cc`, which is compiled if a C++ compiler and libembree-dev (3) are there.
//! Scenes and rays go through files in a temporary folder, orders and times through its standard input and output.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

use firstlight::bench::{HitBits, Instances, MeshTree, RayBits, Soft};
use serde_json::json;

use crate::bench::{commit, median, processor};
use crate::{Outcome, root, write};

/// What to measure, and where to write it.
#[derive(clap::Args)]
pub struct Options {
    /// Fewer rays, and only the scenes of up to a million triangles.
    #[arg(long)]
    quick: bool,
    /// Rounds: each runs every way once, one after the other.
    #[arg(long, default_value_t = 5)]
    rounds: usize,
    /// Only soft shadows: points of a camera's picture and samples of a square light.
    #[arg(long)]
    soft: bool,
    /// Only scenes whose name contains this.
    #[arg(long)]
    scene: Option<String>,
    /// The folder under docs/benchmarks, usually the date and the machine.
    #[arg(long)]
    name: Option<String>,
}

/// A shadow ray goes from a point to a light, but not quite.
const SHADOW_END: f32 = 0.999;

struct Scene {
    name: &'static str,
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Copies of the mesh; none: the mesh itself.
    offsets: Vec<[f32; 3]>,
    /// Where the camera stands, and what it looks at.
    eye: [f32; 3],
    at: [f32; 3],
    /// The middle of the light, and half its side.
    light: ([f32; 3], f32),
}

pub fn run(options: &Options) -> Outcome {
    let folder = std::env::temp_dir().join(format!("firstlight-rays-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    let embree = compile(&folder);
    if let Err(why) = &embree {
        eprintln!("Embree not found, so only firstlight is timed: {why}");
    }
    let mut rows = Vec::new();
    for name in SCENES {
        let large = matches!(*name, "terrain, 10 M" | "copies");
        if options.scene.as_ref().is_some_and(|wanted| !name.contains(wanted)) || options.quick && large {
            continue;
        }
        let scene = scene(name);
        if !options.soft {
            rows.extend(measure(&scene, options, &folder, embree.as_deref().ok())?);
        }
        if scene.offsets.is_empty() && scene.triangles.len() < 2_000_000 {
            for samples in [64, 256] {
                rows.push(measure_soft(&scene, samples, options, &folder, embree.as_deref().ok())?);
            }
        }
    }
    std::fs::remove_dir_all(&folder).map_err(|e| e.to_string())?;
    let page = page(options, &rows);
    println!("{page}");
    if let Some(name) = &options.name {
        let folder = root().join("docs/benchmarks").join(name);
        write(&folder.join("README.md"), page.as_bytes())?;
        let rows: Vec<_> = rows.iter().map(Row::json).collect();
        let data = json!({ "rows": rows, "commit": commit(), "processor": processor() });
        let text = serde_json::to_string_pretty(&data).map_err(|e| e.to_string())?;
        write(&folder.join("rays.json"), format!("{text}\n").as_bytes())?;
    }
    Ok(())
}

// Scenes

const SCENES: &[&str] = &["ball, 7 k", "terrain, 1 M", "balls, 1 M", "terrain, 10 M", "copies"];

fn scene(name: &'static str) -> Scene {
    let mut scene = Scene {
        name,
        positions: Vec::new(),
        triangles: Vec::new(),
        offsets: Vec::new(),
        eye: [0.6, 0.8, 2.2],
        at: [0.0; 3],
        light: ([0.0, 3.0, 1.0], 0.5),
    };
    match name {
        "ball, 7 k" => ball(&mut scene, 60, [0.0; 3], 1.0),
        "terrain, 1 M" => terrain(&mut scene, 707),
        "terrain, 10 M" => terrain(&mut scene, 2236),
        "balls, 1 M" => {
            for i in 0..144 {
                let at = place(i);
                ball(&mut scene, 60, at, 0.12);
            }
        }
        _ => {
            ball(&mut scene, 71, [0.0; 3], 0.012);
            scene.offsets = (0..100_000).map(place).collect();
        }
    }
    if name.starts_with("terrain") {
        (scene.eye, scene.light) = ([0.5, 1.6, 2.0], ([1.5, 0.6, 0.4], 0.4));
    }
    scene
}

/// A number from 0 to 1 that looks random.
fn hash(i: u32) -> f32 {
    let mut x = u64::from(i).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x >> 40) as f32) / (1 << 24) as f32
}

/// Somewhere in a cube of half side 1.
fn place(i: u32) -> [f32; 3] {
    [0, 1, 2].map(|axis| 2.0 * hash(3 * i + axis) - 1.0)
}

/// Something like a sine of `turns`, of parabolas.
fn wave(turns: f32) -> f32 {
    let x = 2.0 * (turns - turns.floor()) - 1.0;
    4.0 * x * (1.0 - x.abs())
}

/// A closed, bumpy ball of 2 n (n - 1) triangles.
fn ball(scene: &mut Scene, n: u32, center: [f32; 3], radius: f32) {
    let first = scene.positions.len() as u32;
    for ring in 0..=n {
        for i in 0..n {
            let (u, v) = (i as f32 / n as f32, ring as f32 / n as f32);
            let bump = 1.0 + 0.05 * wave(7.0 * u) * wave(2.5 * v) + 0.02 * wave(19.0 * u + 5.0 * v);
            let (mut x, mut y, mut z) = (wave(u), wave(v * 0.5 + 0.75), wave(u + 0.25));
            let around = (1.0 - y * y).max(0.0).sqrt() / (x * x + z * z).sqrt();
            (x, z) = (x * around, z * around);
            y = -y;
            let r = radius * if ring == 0 || ring == n { 1.0 } else { bump };
            scene.positions.push([center[0] + r * x, center[1] + r * y, center[2] + r * z]);
        }
    }
    for ring in 0..n {
        for i in 0..n {
            let j = (i + 1) % n;
            let [a, b, c, d] = [ring * n + i, ring * n + j, (ring + 1) * n + i, (ring + 1) * n + j].map(|v| first + v);
            if ring > 0 {
                scene.triangles.push([a, b, c]);
            }
            if ring + 1 < n {
                scene.triangles.push([b, d, c]);
            }
        }
    }
}

/// A hilly square of 2 n n triangles.
/// The terrain of `n` x `n` squares: positions and triangles.
pub(crate) fn terrain_mesh(n: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let mut scene = Scene {
        name: "",
        positions: Vec::new(),
        triangles: Vec::new(),
        offsets: Vec::new(),
        eye: [0.0; 3],
        at: [0.0; 3],
        light: ([0.0; 3], 0.0),
    };
    terrain(&mut scene, n);
    (scene.positions, scene.triangles)
}

fn terrain(scene: &mut Scene, n: u32) {
    for j in 0..=n {
        for i in 0..=n {
            let (x, z) = (2.0 * i as f32 / n as f32 - 1.0, 2.0 * j as f32 / n as f32 - 1.0);
            let (mut height, mut size, mut turns) = (0.0, 0.15, 0.5);
            for octave in 0..7 {
                let octave = octave as f32;
                height += size * wave(turns * x + octave * 0.27) * wave(turns * z - octave * 0.14);
                (size, turns) = (size * 0.5, turns * 2.03);
            }
            scene.positions.push([x, height, z]);
        }
    }
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i;
            let (b, c, d) = (a + 1, a + n + 1, a + n + 2);
            scene.triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
}

// Rays

fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: [f32; 3]) -> [f32; 3] {
    let length = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
    a.map(|x| x / length)
}

/// Camera rays in tiles of 8 x 8 pixels, these in blocks of 4 x 4.
fn camera_rays(scene: &Scene, size: u32) -> Vec<RayBits> {
    let forward = unit(sub(scene.at, scene.eye));
    let right = unit(cross(forward, [0.0, 1.0, 0.0]));
    let up = cross(right, forward);
    let mut rays = Vec::new();
    for tile in 0..size * size / 64 {
        let (tx, ty) = (tile % (size / 8) * 8, tile / (size / 8) * 8);
        for k in 0..64 {
            let (block, k) = (k / 16, k % 16);
            let (x, y) = (tx + block % 2 * 4 + k % 4, ty + block / 2 * 4 + k / 4);
            let half = 0.414_213_57;
            let sx = (2.0 * (x as f32 + 0.5) / size as f32 - 1.0) * half;
            let sy = (1.0 - 2.0 * (y as f32 + 0.5) / size as f32) * half;
            let d = unit([0, 1, 2].map(|i| forward[i] + sx * right[i] + sy * up[i]));
            rays.push([scene.eye[0], scene.eye[1], scene.eye[2], d[0], d[1], d[2]]);
        }
    }
    rays
}

/// Sixteen rays from each of some of the points the camera sees to the light, in an order without rhyme.
fn shadow_rays(scene: &Scene, camera: &[RayBits], hits: &[HitBits]) -> Vec<RayBits> {
    let seen: Vec<_> = camera.iter().zip(hits).filter(|(_, hit)| hit.0.is_finite()).collect();
    let mut rays = Vec::new();
    let (middle, half) = scene.light;
    for i in 0..(camera.len() / 16) as u32 {
        let Some((ray, (t, _))) = seen.get((hash(7 * i) * seen.len() as f32) as usize) else { continue };
        // A little before the surface: what a renderer does about it is not measured here
        let p = [0, 1, 2].map(|k| ray[k] + ray[k + 3] * t * 0.9995);
        for k in 0..16 {
            let (u, v) = ((k % 4) as f32 + hash(16 * i + k), (k / 4) as f32 + hash(16 * i + k + 1_000_000));
            let to = [middle[0] + half * (0.5 * u - 1.0), middle[1], middle[2] + half * (0.5 * v - 1.0)];
            let d = sub(to, p);
            rays.push([p[0], p[1], p[2], d[0], d[1], d[2]]);
        }
    }
    rays
}

// Embree

/// Compiles the peer; the fault is why there is none.
fn compile(folder: &Path) -> Result<PathBuf, String> {
    let program = folder.join("embree");
    let source = root().join("tools/embree/embree.cc");
    let output =
        Command::new("c++").args(["-O3", "-march=native", "-o"]).arg(&program).arg(source).arg("-lembree3").output();
    let output = output.map_err(|e| format!("c++: {e}"))?;
    let words = String::from_utf8_lossy(&output.stderr);
    if output.status.success() { Ok(program) } else { Err(words.lines().next().unwrap_or("c++ failed").to_owned()) }
}

struct Embree {
    child: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
    /// Memory, robust and fast.
    bytes: [f64; 2],
    /// Build times, robust and fast.
    seconds: [f64; 2],
}

impl Embree {
    fn start(program: &Path, folder: &Path) -> Result<Embree, String> {
        let mut child = Command::new(program)
            .arg(folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| e.to_string())?;
        let orders = child.stdin.take().ok_or("no standard input")?;
        let mut answers = BufReader::new(child.stdout.take().ok_or("no standard output")?);
        let mut line = String::new();
        answers.read_line(&mut line).map_err(|e| e.to_string())?;
        let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let &[fast, robust, fast_seconds, robust_seconds] = &numbers[..] else {
            return Err(format!("Embree said {line:?}"));
        };
        Ok(Embree { child, orders, answers, bytes: [robust, fast], seconds: [robust_seconds, fast_seconds] })
    }

    fn time(&mut self, mode: &str, flags: &str, width: u32) -> Result<f64, String> {
        writeln!(self.orders, "{mode} {flags} {width}").map_err(|e| e.to_string())?;
        let mut line = String::new();
        self.answers.read_line(&mut line).map_err(|e| e.to_string())?;
        line.trim().parse().map_err(|e| format!("Embree said {line:?}: {e}"))
    }
}

fn write_rays(path: &Path, rays: &[RayBits]) -> Outcome {
    let mut bytes = (rays.len() as u64).to_ne_bytes().to_vec();
    bytes.extend(rays.iter().flatten().flat_map(|v| v.to_ne_bytes()));
    write(path, &bytes)
}

fn write_mesh(path: &Path, scene: &Scene) -> Outcome {
    let mut bytes = Vec::new();
    for count in [scene.positions.len(), scene.triangles.len(), scene.offsets.len()] {
        bytes.extend((count as u64).to_ne_bytes());
    }
    bytes.extend(scene.positions.iter().flatten().flat_map(|v| v.to_ne_bytes()));
    bytes.extend(scene.triangles.iter().flatten().flat_map(|v| v.to_ne_bytes()));
    bytes.extend(scene.offsets.iter().flatten().flat_map(|v| v.to_ne_bytes()));
    write(path, &bytes)
}

fn read_hits(path: &Path) -> Result<Vec<HitBits>, String> {
    let bytes = std::fs::read(path).map_err(|e| e.to_string())?;
    let word = |b: &[u8], at: usize| [b[at], b[at + 1], b[at + 2], b[at + 3]];
    Ok(bytes.chunks_exact(8).map(|b| (f32::from_ne_bytes(word(b, 0)), u32::from_ne_bytes(word(b, 4)))).collect())
}

// Measuring

/// Seconds of processor time of this thread, or of the clock where that is not to be had.
fn seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    match text.split_whitespace().next().and_then(|word| word.parse::<f64>().ok()) {
        Some(nanoseconds) => nanoseconds * 1e-9,
        None => {
            static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
            START.get_or_init(Instant::now).elapsed().as_secs_f64()
        }
    }
}

fn time(work: impl FnOnce()) -> f64 {
    let start = seconds();
    work();
    seconds() - start
}

/// One kind of query in one scene: rays a second, ours and theirs.
struct Row {
    scene: &'static str,
    what: &'static str,
    ours: Vec<f64>,
    robust: Vec<(String, Vec<f64>)>,
    fast: Vec<(String, Vec<f64>)>,
    /// Hits that are not the same as those of the robust Embree.
    differing: Option<usize>,
    unit: &'static str,
}

impl Row {
    /// The best of Embree's ways.
    fn best(ways: &[(String, Vec<f64>)]) -> Option<(&str, f64)> {
        ways.iter().map(|(name, rates)| (name.as_str(), median(rates))).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn json(&self) -> serde_json::Value {
        json!({
            "scene": self.scene, "what": self.what, "unit": self.unit, "firstlight": self.ours,
            "embree_robust": self.robust, "embree_fast": self.fast, "differing": self.differing,
        })
    }
}

fn pool(threads: usize) -> Result<rayon::ThreadPool, String> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| e.to_string())
}

fn measure(scene: &Scene, options: &Options, folder: &Path, program: Option<&Path>) -> Result<Vec<Row>, String> {
    eprintln!("{}: {} triangles", scene.name, scene.triangles.len());
    // Build, on one thread and on two
    let millions = scene.triangles.len() as f64 / 1e6;
    let (one, two) = (pool(1)?, pool(2)?);
    let mut builds = [Vec::new(), Vec::new()];
    let build = || drop(MeshTree::build(&scene.positions, &scene.triangles));
    for _ in 0..3 {
        // Processor time as Embree's; of two threads only the clock knows
        builds[0].push(millions / one.install(|| time(build)));
        let start = Instant::now();
        two.install(build);
        builds[1].push(millions / start.elapsed().as_secs_f64());
    }
    let mesh = MeshTree::build(&scene.positions, &scene.triangles);
    let copies = (!scene.offsets.is_empty()).then(|| Instances::build(&mesh, &scene.offsets));
    // Make the rays
    let camera = camera_rays(scene, if options.quick { 256 } else { 1024 });
    let mut hits = vec![(0.0, 0); camera.len()];
    let closest = |rays: &[RayBits], hits: &mut [HitBits]| match &copies {
        Some(copies) => copies.closest(rays, hits),
        None => mesh.closest(rays, hits),
    };
    let any = |rays: &[RayBits], hidden: &mut [bool]| match &copies {
        Some(copies) => copies.any(rays, SHADOW_END, hidden),
        None => mesh.any(rays, SHADOW_END, hidden),
    };
    closest(&camera, &mut hits);
    let shadow = shadow_rays(scene, &camera, &hits);
    let mut embree = None;
    if let Some(program) = program {
        write_mesh(&folder.join("mesh"), scene)?;
        write_rays(&folder.join("camera"), &camera)?;
        write_rays(&folder.join("shadow"), &shadow)?;
        embree = Some(Embree::start(program, folder)?);
    }
    // Time them, in turns
    let row = |what, unit| Row {
        scene: scene.name,
        what,
        ours: Vec::new(),
        robust: Vec::new(),
        fast: Vec::new(),
        differing: None,
        unit,
    };
    let mut rows = vec![
        row("camera, single", "M rays/s"),
        row("shadow, single", "M rays/s"),
        row("camera, together", "M rays/s"),
        row("shadow, together", "M rays/s"),
    ];
    if copies.is_some() {
        rows.truncate(2);
    }
    let mut hidden = vec![false; shadow.len()];
    for round in 0..options.rounds {
        for (i, row) in rows.iter_mut().enumerate() {
            let (mode, rays) = if i % 2 == 0 { ("camera", &camera) } else { ("shadow", &shadow) };
            let millions = rays.len() as f64 / 1e6;
            let seconds = match i {
                0 => time(|| closest(&camera, &mut hits)),
                1 => time(|| any(&shadow, &mut hidden)),
                2 => time(|| mesh.tiles(&camera, &mut hits)),
                _ => time(|| mesh.packets(&shadow, SHADOW_END, &mut hidden)),
            };
            row.ours.push(millions / seconds);
            let Some(embree) = &mut embree else { continue };
            for (flags, ways) in [("robust", &mut row.robust), ("fast", &mut row.fast)] {
                let widths: &[u32] = if i < 2 { &[1] } else { &[4, 8, 16] };
                for (way, width) in widths.iter().enumerate() {
                    let rate = millions / embree.time(mode, flags, *width)?;
                    if ways.len() <= way {
                        ways.push((format!("{width} wide"), Vec::new()));
                    }
                    ways[way].1.push(rate);
                    if round == 0 && flags == "robust" && *width != 4 {
                        let theirs = read_hits(&folder.join("embree.hits"))?;
                        row.differing = Some(match mode {
                            "camera" => hits.iter().zip(&theirs).filter(|(a, b)| is_other(**a, **b)).count(),
                            _ => hidden.iter().zip(&theirs).filter(|(a, b)| **a != (b.0 < 0.0)).count(),
                        });
                    }
                }
            }
        }
    }
    // Memory and building
    let mut memory = row("memory of the tree", "bytes per triangle");
    let count = scene.triangles.len() as f64;
    memory.ours.push(mesh.bytes() as f64 / count);
    let [one, two] = builds;
    let mut build = [row("build, one thread", "M triangles/s"), row("build, two threads", "M triangles/s")];
    (build[0].ours, build[1].ours) = (one, two);
    if let Some(Embree { mut child, orders, bytes, seconds, .. }) = embree {
        drop(orders);
        child.wait().map_err(|e| e.to_string())?;
        for (i, ways) in [&mut memory.robust, &mut memory.fast].into_iter().enumerate() {
            ways.push((String::new(), vec![bytes[i] / count]));
        }
        for (i, ways) in [&mut build[0].robust, &mut build[0].fast].into_iter().enumerate() {
            if copies.is_none() {
                ways.push((String::new(), vec![millions / seconds[i]]));
            }
        }
    }
    rows.extend(build);
    rows.push(memory);
    Ok(rows)
}

/// Soft shadows: all samples of a square light from each point that a camera sees.
fn measure_soft(
    scene: &Scene,
    samples: u32,
    options: &Options,
    folder: &Path,
    program: Option<&Path>,
) -> Result<Row, String> {
    let camera = camera_rays(scene, if options.quick { 128 } else { 256 });
    let mut soft = Soft::new(&scene.positions, &scene.triangles, scene.light, samples, &camera)
        .ok_or("the scene does not compile")?;
    let (points, lights) = (soft.points(), soft.samples());
    let mut embree = None;
    if let Some(program) = program {
        write_mesh(&folder.join("mesh"), scene)?;
        write_rays(&folder.join("camera"), &[])?;
        write_rays(&folder.join("shadow"), &[])?;
        let mut bytes = Vec::new();
        for count in [points.len(), lights.len()] {
            bytes.extend((count as u64).to_ne_bytes());
        }
        bytes.extend(points.iter().flatten().flat_map(|v| v.to_ne_bytes()));
        bytes.extend(lights.iter().flatten().flat_map(|v| v.to_ne_bytes()));
        write(&folder.join("soft"), &bytes)?;
        embree = Some(Embree::start(program, folder)?);
    }
    let mut row = Row {
        scene: scene.name,
        what: if samples == 64 { "soft, 64 samples" } else { "soft, 256 samples" },
        ours: Vec::new(),
        robust: Vec::new(),
        fast: Vec::new(),
        differing: None,
        unit: "M samples/s",
    };
    let millions = (points.len() * soft.count()) as f64 / 1e6;
    let (mut hidden, mut traced) = (Vec::new(), Vec::new());
    let mut rates = Vec::new();
    for round in 0..options.rounds {
        row.ours.push(millions / time(|| soft.shafts(&mut hidden)));
        rates.push(millions / time(|| soft.traced(&mut traced)));
        let Some(embree) = &mut embree else { continue };
        for (flags, ways) in [("robust", &mut row.robust), ("fast", &mut row.fast)] {
            for (way, width) in [8, 16].into_iter().enumerate() {
                let rate = millions / embree.time("soft", flags, width)?;
                if ways.len() <= way {
                    ways.push((format!("{width} wide"), Vec::new()));
                }
                ways[way].1.push(rate);
                if round == 0 && flags == "robust" && width == 16 {
                    let bytes = std::fs::read(folder.join("embree.hits")).map_err(|e| e.to_string())?;
                    let theirs: Vec<u16> = bytes.chunks_exact(2).map(|b| u16::from_ne_bytes([b[0], b[1]])).collect();
                    let theirs = soft.in_order(&theirs);
                    let counts = hidden.iter().zip(&theirs).zip(soft.below());
                    row.differing = Some(counts.map(|((a, b), below)| ((a ^ b) & !below).count_ones() as usize).sum());
                }
            }
        }
    }
    let differing: u32 =
        hidden.iter().zip(&traced).zip(soft.below()).map(|((a, b), below)| ((a ^ b) & !below).count_ones()).sum();
    let [lit, umbra, below, cut, shafts, occluders, asked] = soft.settled();
    let all = points.len() as f64 * 0.01;
    eprintln!(
        "{}, {samples} samples: {} points, {:.0} % lit, {:.0} % hidden, {:.0} % below, {:.0} % cut; {shafts} shafts, \
         {:.1} occluders in each; {:.1} % of the samples traced; {differing} differ from the traced ones, which took \
         {:.1} M samples/s",
        scene.name,
        points.len(),
        lit as f64 / all,
        umbra as f64 / all,
        below as f64 / all,
        cut as f64 / all,
        occluders as f64 / shafts.max(1) as f64,
        asked as f64 / (points.len() * soft.count()) as f64 * 100.0,
        median(&rates),
    );
    if differing > 0 {
        return Err(format!("{differing} samples are not what tracing says"));
    }
    Ok(row)
}

/// Whether two hits are not the same one: neither the same triangle nor the same distance up to rounding.
fn is_other(a: HitBits, b: HitBits) -> bool {
    a.1 != b.1 && !((a.0 - b.0).abs() <= 1e-5 * a.0.abs())
}

fn page(options: &Options, rows: &[Row]) -> String {
    let mut page = String::from("## Rays through meshes\n\n");
    let size = if options.quick { 256 } else { 1024 };
    let _ = writeln!(
        page,
        "{size} x {size} camera rays, and as many from points the camera sees to a square light, sixteen from each, \
         the points in random order. One thread, processor time; medians of {} rounds, in each of which every way ran \
         once, one after the other. Together: tiles of 64 and packets of 16, against the best of Embree's 4, 8 and 16 \
         wide packets, marked coherent.\n",
        options.rounds
    );
    let _ = writeln!(page, "- processor: {}", processor());
    let _ = writeln!(page, "- commit: {}", commit());
    let mut command = String::from("cargo xtask rays");
    if options.quick {
        command.push_str(" --quick");
    }
    if let Some(scene) = &options.scene {
        let _ = write!(command, " --scene '{scene}'");
    }
    let _ = write!(command, " --rounds {}", options.rounds);
    if let Some(name) = &options.name {
        let _ = write!(command, " --name {name}");
    }
    let _ = writeln!(page, "- command: `{command}`\n");
    let _ = writeln!(
        page,
        "| scene | what | unit | firstlight | Embree, robust | times | Embree, fast | times | other hits |"
    );
    let _ = writeln!(page, "|---|---|---|---|---|---|---|---|---|");
    for row in rows {
        let ours = median(&row.ours);
        let theirs = |ways: &[(String, Vec<f64>)]| match Row::best(ways) {
            Some((name, rate)) => format!("{rate:.1} {name} | {:.2}", ours / rate),
            None => "| ".to_owned(),
        };
        let (robust, fast) = (theirs(&row.robust), theirs(&row.fast));
        let differing = row.differing.map(|n| n.to_string()).unwrap_or_default();
        let Row { scene, what, unit, .. } = row;
        let _ = writeln!(page, "| {scene} | {what} | {unit} | {ours:.1} | {robust} | {fast} | {differing} |");
    }
    page
}
