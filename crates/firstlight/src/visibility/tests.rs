use fearless_simd::Level;
use firstlight_testkit::Random;

use super::shaft::{Horizon, Shaft};
use super::target::LightHull;
use super::*;
use crate::accel::{Aabb, BoxNode, LEAF, SimdLevel, dispatch_eight};
use crate::math::{DVec3, Ray};
use crate::scene::{CompileOptions, Scene, SceneDesc};
use crate::shape::RayDifferential;
use crate::{
    CameraDesc, DirectionalDesc, DiskLightDesc, EmitSides, GroupDesc, InstanceDesc, LightDesc, MeshDesc, NoAssets,
    ParallelogramDesc, PlaneDesc, PointDesc, RectangleDesc, ShapeDesc, SphereDesc, SphereLightDesc, TransformDesc,
};

fn vector(random: &mut Random, reach: f64) -> DVec3 {
    random.vector(reach).into()
}

fn direction(random: &mut Random) -> DVec3 {
    random.direction().into()
}

/// On whole and half numbers things touch and lie in one plane.
fn place(random: &mut Random, reach: f64) -> DVec3 {
    let v = vector(random, reach);
    if random.chance(0.4) { (v * 2.0).round() * 0.5 } else { v }
}

/// Whether a segment meets a box, in f64.
fn meets(low: DVec3, high: DVec3, from: DVec3, to: DVec3) -> bool {
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    for axis in 0..3 {
        let d = to[axis] - from[axis];
        if d == 0.0 {
            if from[axis] < low[axis] || from[axis] > high[axis] {
                return false;
            }
            continue;
        }
        let (a, b) = ((low[axis] - from[axis]) / d, (high[axis] - from[axis]) / d);
        (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
    }
    enter <= leave
}

#[test]
fn a_shaft_leaves_out_no_box_that_a_way_to_the_light_meets() {
    let random = &mut Random::new(1);
    let mut left_out = 0;
    for round in 0..4000 {
        let unit = random.scale(1e-6, 1e6);
        let origin = if random.chance(0.3) { direction(random) * unit * 1000.0 } else { DVec3::ZERO };
        let at = |random: &mut Random, reach: f64| (origin + place(random, reach) * unit).as_vec3();
        let spread = random.pick(&[0.0, 0.01, 1.0, 5.0]);
        let first = at(random, 2.0);
        let points: Vec<Vec3> =
            (0..1 + random.below(4)).map(|_| first + (vector(random, spread) * unit).as_vec3()).collect();
        let finite = round % 5 != 0;
        let size = random.pick(&[0.0, 0.5, 20.0]);
        let reach = random.scale(0.1, 1e4);
        let mut axes = [Vec3::ZERO; 3];
        for axis in &mut axes {
            *axis = (place(random, 1.0) * unit * size).as_vec3();
        }
        let hull = if finite {
            LightHull { axes, ..LightHull::at(at(random, reach), true) }
        } else {
            LightHull::at(direction(random).as_vec3(), false)
        };
        let bounds = points.iter().fold(Aabb::EMPTY, |bounds, p| bounds.with(*p));
        let mut shaft = Shaft::between(bounds, &hull, Vec3::ZERO);
        let n = direction(random).as_vec3();
        let has_horizon = random.chance(0.5);
        if has_horizon {
            let least = points.iter().map(|p| n.as_dvec3().dot(p.as_dvec3())).fold(f64::INFINITY, f64::min);
            shaft.horizon = Some(Horizon { n, least });
        }
        // Boxes around places on ways to the light, and anywhere
        let mut node = BoxNode::EMPTY;
        let center = at(random, 2.0);
        let mut half = 0.0f32;
        let mut boxes = Vec::new();
        for place in 0..7 {
            let p = random.pick(&points).as_dvec3();
            let mut to = hull.center.as_dvec3();
            for axis in &hull.axes {
                let t = if random.chance(0.5) { random.between(-1.0, 1.0) } else { 1.0 };
                to += axis.as_dvec3() * t;
            }
            let to = if finite { to } else { p + to * unit * random.scale(1.0, 1e4) };
            let on = if random.chance(0.7) { p + (to - p) * random.unit() } else { at(random, 3.0).as_dvec3() };
            let size = vector(random, 1.0).abs() * unit * random.pick(&[0.0, 1e-3, 1.0]);
            let shift = size * DVec3::new(random.unit(), random.unit(), random.unit());
            let (low, high) = ((on - shift).as_vec3(), (on - shift + size).as_vec3());
            let (a, b) = (low - center, high - center);
            half = half.max(a.abs().max(b.abs()).max_element());
            node.set(place, a.to_array(), b.to_array(), LEAF);
            boxes.push((low.as_dvec3(), high.as_dvec3()));
        }
        let within = shaft.within(center, half);
        let mut first = None;
        for level in SimdLevel::available() {
            let met = dispatch_eight!(level.token(), simd => within.meet(simd, &node).0);
            assert_eq!(*first.get_or_insert(met), met, "round {round}, {}: all find the same", level.name());
            assert_eq!(met & 0x80, 0, "there is nothing there");
            for (i, (low, high)) in boxes.iter().enumerate() {
                let loose = shaft.meets(*low, *high, f64::from(half) * 1e-6);
                for p in &points {
                    for _ in 0..8 {
                        let mut to = hull.center.as_dvec3();
                        for axis in &hull.axes {
                            let any = random.between(-1.0, 1.0);
                            to += axis.as_dvec3() * random.pick(&[-1.0, 1.0, any]);
                        }
                        let p = p.as_dvec3();
                        let to = if finite { to } else { p + to * unit * 1e6 };
                        let above = !has_horizon || n.as_dvec3().dot(to - p) >= 0.0;
                        if above && meets(*low, *high, p, to) {
                            assert!(met >> i & 1 == 1, "round {round}, {}: {shaft:?} {low} {high}", level.name());
                            assert!(loose, "round {round}: {shaft:?} {low} {high}");
                        }
                    }
                }
                left_out += usize::from(met >> i & 1 == 0);
            }
        }
    }
    assert!(left_out > 10_000, "only {left_out} boxes are ever left out");
}

fn random_mesh(random: &mut Random, at: DVec3, unit: f64) -> MeshDesc {
    let mut mesh = MeshDesc::default();
    if random.chance(0.5) {
        // Triangles anyhow: crossing, thin, huge, small
        for i in 0..1 + random.below(60) {
            let size = unit * random.scale(0.01, 3.0);
            let first = at + place(random, 1.5) * unit;
            for k in 0..3 {
                let thin = if k == 2 && random.chance(0.2) { 1e-4 } else { 1.0 };
                mesh.positions.push((first + place(random, 1.0) * size * thin).to_array());
            }
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        return mesh;
    }
    // A bumpy sheet, finely cut
    let n = 3 + random.below(30);
    let (e0, e1) = (direction(random) * unit * 2.0, direction(random) * unit * 2.0);
    let up = e0.cross(e1).normalize_or(DVec3::Y) * unit * random.pick(&[0.0, 0.05, 0.5]);
    // Normals of something rounder, so that light is gathered above the triangles
    let smooth = random.chance(0.4);
    for j in 0..=n {
        for i in 0..=n {
            if smooth {
                let n = up.normalize_or(e0.cross(e1).normalize_or(DVec3::Y)) + vector(random, 0.3);
                mesh.normals.push(n.to_array());
            }
            let (x, y) = (f64::from(i) / f64::from(n) - 0.5, f64::from(j) / f64::from(n) - 0.5);
            mesh.positions.push((at + e0 * x + e1 * y + up * (random.unit() - 0.5)).to_array());
        }
    }
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i;
            mesh.triangles.extend([[a, a + 1, a + n + 1], [a + 1, a + n + 2, a + n + 1]]);
        }
    }
    mesh
}

/// Meshes, some placed, spheres, parallelograms, a plane and lights that touch them, cut them, or lie in one plane with
/// them.
fn random_scene(random: &mut Random) -> Scene {
    let unit = random.pick(&[1.0, 1.0, 1e-4, 1e4]);
    let origin = if random.chance(0.2) { direction(random) * 300.0 * unit } else { DVec3::ZERO };
    let mut desc = SceneDesc::default();
    let chosen = |random: &mut Random| random.chance(0.2).then(|| vec!["one".to_owned()]);
    for _ in 0..1 + random.below(2) {
        let mesh = random_mesh(random, origin, unit);
        desc.shapes.push(ShapeDesc::Mesh(MeshDesc { shadow_exclude: chosen(random), ..mesh }));
    }
    if random.chance(0.4) {
        let mesh = random_mesh(random, DVec3::ZERO, unit);
        desc.groups.push(("g".to_owned(), GroupDesc { shapes: vec![ShapeDesc::Mesh(mesh)] }));
        for _ in 0..1 + random.below(4) {
            let scale = [0; 3].map(|_| random.scale(0.2, 3.0) * if random.chance(0.2) { -1.0 } else { 1.0 });
            let transform = TransformDesc {
                translate: (origin + place(random, 2.0) * unit).to_array(),
                rotate_deg: vector(random, 180.0).to_array(),
                scale: crate::ScaleDesc::from(scale),
                ..TransformDesc::default()
            };
            let mut instance = InstanceDesc::new("g".to_owned());
            instance.transform = Some(Box::new(transform));
            instance.casts_shadow = random.chance(0.9);
            instance.shadow_exclude = chosen(random);
            desc.shapes.push(ShapeDesc::Instance(instance));
        }
    }
    for _ in 0..random.below(3) {
        let center = origin + place(random, 2.0) * unit;
        let sphere = SphereDesc::new(center.to_array(), random.scale(0.02, 2.0) * unit);
        desc.shapes.push(ShapeDesc::Sphere(SphereDesc { shadow_exclude: chosen(random), ..sphere }));
    }
    for _ in 0..random.below(3) {
        let p = origin + place(random, 2.0) * unit;
        let (e0, e1) = (direction(random) * unit * random.scale(0.1, 5.0), direction(random) * unit);
        if e0.cross(e1).length() > 1e-3 * e0.length() * e1.length() {
            let flat = ParallelogramDesc::new(p.to_array(), e0.to_array(), e1.to_array());
            desc.shapes.push(ShapeDesc::Parallelogram(ParallelogramDesc { shadow_exclude: chosen(random), ..flat }));
        }
    }
    if random.chance(0.3) {
        let point = (origin + place(random, 2.0) * unit).to_array();
        let shadow_exclude = chosen(random);
        desc.shapes.push(ShapeDesc::Plane(PlaneDesc { point, shadow_exclude, ..PlaneDesc::default() }));
    }
    for i in 0..3 {
        let reach = random.pick(&[0.5, 2.0, 5.0]);
        let center = (origin + place(random, reach) * unit).to_array();
        let a = direction(random);
        let b = a.cross(direction(random)).normalize_or(a.any_orthonormal_vector());
        let (x, y) = (random.scale(0.02, 4.0) * unit, random.scale(0.02, 4.0) * unit);
        let samples = Some((1 + random.below(300)).into());
        let (sides, blocks) = (Some(EmitSides::Both), random.chance(0.4));
        let name = (i == 0).then(|| "one".to_owned());
        desc.lights.push(match random.below(3) {
            0 => {
                let light = RectangleDesc::with_edges(center, (a * x).to_array(), (b * y).to_array());
                LightDesc::Rectangle(RectangleDesc { name, samples, sides, blocks, ..light })
            }
            1 => {
                let light = DiskLightDesc::with_normal(center, a.to_array(), x);
                LightDesc::Disk(DiskLightDesc { name, samples, sides, blocks, ..light })
            }
            _ => {
                let light = SphereLightDesc::new(center, x);
                LightDesc::Sphere(SphereLightDesc { name, samples, sides, blocks, ..light })
            }
        });
    }
    let position = (origin + place(random, 3.0) * unit).to_array();
    desc.lights.push(LightDesc::Point(PointDesc::new(position)));
    desc.lights.push(LightDesc::Directional(DirectionalDesc::new(direction(random).to_array())));
    let eye = origin + direction(random) * unit * 4.0;
    let camera = CameraDesc { look_at: origin.to_array(), ..CameraDesc::new(eye.to_array()) };
    desc.cameras.push((String::new(), camera));
    desc.compile(&NoAssets, &CompileOptions::default()).expect("it is a scene").scene
}

/// Points that neighbouring camera rays meet.
fn seen_points(random: &mut Random, scene: &Scene) -> Vec<Viewpoint> {
    let middle = [random.unit() as f32 * scene.width as f32, random.unit() as f32 * scene.height as f32];
    let apart = random.pick(&[0.3, 2.0, 40.0]);
    let mut points = Vec::new();
    for i in 0..24 {
        let (x, y) = (middle[0] + (i % 6) as f32 * apart, middle[1] + (i / 6) as f32 * apart);
        let (ray, differential): (Ray, RayDifferential) = scene.camera.local_ray(x, y, 1.0);
        if let Some(hit) = scene.intersect_local(&ray)
            && hit.surface.index() < scene.geometry.surfaces.len()
        {
            let si = scene.local_surface(&ray, &hit, &differential);
            let bsdf = scene.bsdf(&si);
            points.push(Viewpoint::of(&ShadingPoint::of(&si, &bsdf, &scene.ambient)));
        }
    }
    points
}

#[test]
fn every_sample_is_answered_as_by_its_own_ray() {
    let random = &mut Random::new(7);
    let mut seen = [0u64; 4];
    let mut traced = 0;
    let mut resolver = VisibilityResolver::default();
    let levels: Vec<Level> = SimdLevel::available().into_iter().rev().map(SimdLevel::token).collect();
    for round in 0..600 {
        let scene = random_scene(random);
        let points = seen_points(random, &scene);
        for (light, target) in scene.lights.iter().zip(Target::of_all(&scene)) {
            let index = target.light.index();
            let level = if round % 4 == 0 { random.pick(&levels) } else { levels[0] };
            let mut counts = VisibilityStats::default();
            let mut order: Vec<u32> = (0..points.len() as u32).collect();
            let mut asked = 0;
            resolver.resolve(level, &scene, &target, &points, &mut order, &mut counts, |k, visibility, view| {
                asked += 1;
                let point = &points[k];
                for s in 0..light.samples() {
                    let to = light.towards(s, point.p);
                    if !(point.horizon.dot(to.l) > 0.0 && point.ns.dot(to.l) > 0.0) {
                        continue;
                    }
                    let hidden = scene.occluded(&point.ray(target.end(), to.l, to.finite));
                    let answer = match visibility {
                        Visibility::Full => false,
                        Visibility::None | Visibility::BelowHorizon => true,
                        // One sample is traced as it is
                        Visibility::Partial if target.blocks.is_empty() => hidden,
                        _ => {
                            view.hidden.get(s / 16).is_some_and(|bits| bits >> (s % 16) & 1 == 1)
                                || view.spheres.iter().any(|sphere| sphere.blocks(to.l, true))
                                || view.flats.iter().any(|flat| flat.blocks(to.l, true))
                                || view.disks.iter().any(|disk| disk.blocks(to.l, true))
                        }
                    };
                    assert!(visibility != Visibility::BelowHorizon, "round {round}: a sample is above the horizon");
                    assert!(
                        answer == hidden,
                        "round {round}, light {index}, {point:?}, sample {s}, {visibility:?}: tracing says {hidden}"
                    );
                }
            });
            assert_eq!(asked, points.len());
            (0..4).for_each(|i| seen[i] += counts.classes[i]);
            traced += counts.traced;
        }
    }
    // Each answer was given, and few samples were traced
    assert!(seen.iter().all(|count| *count > 100), "{seen:?}");
    assert!(traced > 0, "nothing was ever too much");
}

#[test]
fn a_light_lies_in_its_hull() {
    let random = &mut Random::new(3);
    for _ in 0..60 {
        let scene = random_scene(random);
        for (light, target) in scene.lights.iter().zip(Target::of_all(&scene)) {
            let mut held: Vec<u32> = Vec::new();
            for block in &target.blocks {
                assert!(block.at.as_flattened().iter().all(|at| at.abs() <= 1.0));
                held.extend((0..16).filter(|lane| block.present >> lane & 1 == 1).map(|lane| block.sample[lane]));
            }
            held.sort_unstable();
            assert!(target.blocks.is_empty() || held.into_iter().eq(0..light.samples() as u32));
        }
    }
}
