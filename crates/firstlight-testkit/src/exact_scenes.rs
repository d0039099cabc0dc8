//! Random scenes for lights that are integrated, the same for the same seed: whatever makes soft light hard, in
//! pictures that are neither black nor blown out.

mod families;
mod surfaces;

use firstlight::{
    BoxDesc, ColorDesc, ColorParam, ConeDesc, CylinderDesc, DiskDesc, DiskLightDesc, DisplayEncoding, EmitSides,
    Falloff, LightDesc, MaterialDesc, MeshDesc, ParallelogramDesc, PlaneDesc, Projection, RectangleDesc, SampleSet,
    SceneDesc, ShapeDesc, SphereLightDesc, TorusDesc,
};

use crate::converged::{traced, with_samples};
use crate::random::Place;
use crate::scenes::*;
use families::Family;

/// How often a seed may try for a picture that shows something.
const TRIES: u64 = 64;

/// From this number on scenes are of one kind each, 75 of each: smooth meshes, thin things, meshes that reach into the
/// light, lights that cut floors at a shallow angle, lights close to floors, specks, hard shadows, rims of checkers.
pub const SMOOTH: u64 = 1000;

/// From this number on scenes are like the first thousand, of metals and dielectrics with pictures, normal maps, masks,
/// veils and clear coats.
pub const SURFACES: u64 = 2000;

/// Scene number `seed`, `size` x `size` pixels. The size decides nothing else.
pub fn scene(seed: u64, size: u32) -> SceneDesc {
    let mut tries = (0..TRIES).map(|i| {
        let mut random = Random::new((seed << 8) + i);
        match Family::of(seed) {
            None => exposed(composed(&mut random), &mut random, true),
            Some(family) => exposed(family.scene(&mut random), &mut random, family.is_integrated()),
        }
    });
    let Some(mut scene) = tries.find_map(|scene| scene) else { panic!("scene {seed} shows nothing, try as it may") };
    (scene.render.width, scene.render.height) = (size, size);
    scene
}

/// The scene with its light or its exposure set so that what is lit is neither black nor white; `None` if next to
/// nothing is lit.
fn exposed(mut scene: SceneDesc, random: &mut Random, is_integrated: bool) -> Option<SceneDesc> {
    // A small picture; where other points make no other one, there is nothing to integrate
    let mut small = with_samples(&scene, 36, SampleSet::Grid, 0);
    (small.render.width, small.render.height, small.render.antialiasing) = (16, 16, 1);
    (small.render.ambient, small.render.exposure) = (ColorDesc::gray(0.0).into(), 0.0);
    emission(&mut small).for_each(|strength| *strength = 0.0);
    let one = picture(&compile(&small), &traced());
    let other = picture(&compile(&with_samples(&small, 36, SampleSet::Uniform, 1)), &traced());
    let differs = |(a, b): (&[f32; 4], &[f32; 4])| (0..3).any(|k| (a[k] - b[k]).abs() > 0.01 * a[k].max(b[k]));
    let differ = one.pixels.iter().zip(&other.pixels).filter(|pair| differs(*pair)).count();
    if is_integrated && differ < one.pixels.len() / 10 {
        return None;
    }
    // Without the lights themselves
    for light in &mut small.lights {
        match light {
            LightDesc::Rectangle(light) => light.visible = false,
            LightDesc::Disk(light) => light.visible = false,
            LightDesc::Sphere(light) => light.visible = false,
            _ => {}
        }
    }
    let film = picture(&compile(&small), &traced());
    let mut lit: Vec<f32> = film.pixels.iter().map(|p| p[0].max(p[1]).max(p[2])).collect();
    lit.sort_by(f32::total_cmp);
    let darkest = lit.partition_point(|v| *v <= 1e-3 * lit[lit.len() - 1]);
    let lit = &lit[darkest..];
    if lit.len() < film.pixels.len() / 8 {
        return None;
    }
    // In quarters of a stop, so that no rounding anywhere else makes another scene of it
    let bright = lit[lit.len() * 4 / 5] as f64;
    let stops = (4.0 * pxfm::f_log2(random.between(0.25, 0.9) / bright)).round() / 4.0;
    if random.chance(0.4) && stops.abs() < 60.0 {
        scene.render.exposure = stops;
        emission(&mut scene).for_each(|strength| *strength *= pxfm::f_exp2(-stops));
    } else {
        let gain = pxfm::f_exp2(stops);
        for light in &mut scene.lights {
            match light {
                LightDesc::Point(light) => light.strength *= gain,
                LightDesc::Directional(light) => light.strength *= gain,
                LightDesc::Spot(light) => light.strength *= gain,
                LightDesc::Rectangle(light) => light.strength *= gain,
                LightDesc::Disk(light) => light.strength *= gain,
                LightDesc::Sphere(light) => light.strength *= gain,
            }
        }
    }
    Some(scene)
}

/// What multiplies the radiance of materials that emit.
fn emission(scene: &mut SceneDesc) -> impl Iterator<Item = &mut f64> {
    let all = scene.materials.iter_mut().filter_map(|(_, material)| common_of(material));
    let emissive = all.filter(|common| common.emissive != ColorParam::gray(0.0));
    emissive.map(|common| &mut common.emissive_strength)
}

fn composed(random: &mut Random) -> SceneDesc {
    let mut scene = empty(48, 48, random.pick(&[1, 1, 2, 2, 3, 4]));
    scene.render.display =
        random.pick(&[DisplayEncoding::Gamma, DisplayEncoding::Srgb, DisplayEncoding::Srgb, DisplayEncoding::Linear]);
    for i in 0..1 + random.below(4) {
        if random.chance(0.4) {
            let counts = [1 + random.below(20), 1 + random.below(20)];
            let colors = [tint(random), tint(random)].map(|color| color.linear);
            scene = scene.with_texture(&format!("texture {i}"), checkerboard(counts, colors));
        }
        let material = material(random, &scene);
        scene = scene.with_material(&format!("material {i}"), material);
    }
    if random.chance(0.3) {
        let mut ambient = tint(random);
        ambient.linear = ambient.linear.map(|channel| channel * 0.1);
        scene.render.ambient = ambient.into();
    }
    let stage = Stage::new(random);
    staged(random, &stage, scene)
}

/// A scene with materials gets shapes, lights and a camera.
fn staged(random: &mut Random, stage: &Stage, mut scene: SceneDesc) -> SceneDesc {
    scene = stage.set(random, scene);
    // What stands between light and stage
    let lights: Vec<_> = (0..1 + random.below(2) * random.below(4)).map(|_| stage.place_light(random)).collect();
    for _ in 0..1 + random.below(4) {
        let lamp = lights[random.below(lights.len() as u32) as usize];
        scene = stage.obstruct(random, scene, lamp);
    }
    for lamp in lights {
        let light = stage.light(random, &scene, lamp);
        scene = scene.with_light(light);
    }
    if random.chance(0.2) {
        let light = stage.small_light(random);
        scene = scene.with_light(light);
    }
    let camera = stage.camera(random);
    scene.with_camera(camera)
}

/// Valleys, hills and bumpy balls of facets with blended normals, under what lights there are.
fn smooth(random: &mut Random) -> SceneDesc {
    let mut scene = empty(48, 48, random.pick(&[1, 1, 2, 3]));
    for i in 0..1 + random.below(3) {
        let material = material(random, &scene);
        scene = scene.with_material(&format!("material {i}"), material);
    }
    let stage = Stage::new(random);
    if random.chance(0.6) {
        scene = stage.set(random, scene);
    }
    for _ in 0..1 + random.below(2) {
        let shape = stage.hollow(random);
        let shape = stage.dressed(random, &scene, shape);
        scene = scene.with_shape(shape);
    }
    let lights: Vec<_> = (0..1 + random.below(2)).map(|_| stage.place_light(random)).collect();
    if random.chance(0.3) {
        scene = stage.obstruct(random, scene, lights[0]);
    }
    for lamp in lights {
        let light = stage.light(random, &scene, lamp);
        scene = scene.with_light(light);
    }
    let camera = stage.camera(random);
    scene.with_camera(camera)
}

/// A colour that is neither black nor white.
fn tint(random: &mut Random) -> ColorDesc {
    if random.chance(0.3) {
        return ColorDesc::gray(random.between(0.2, 0.9));
    }
    ColorDesc::linear(random.between(0.05, 0.9), random.between(0.05, 0.9), random.between(0.05, 0.9))
}

fn material(random: &mut Random, scene: &SceneDesc) -> MaterialDesc {
    let param = |random: &mut Random| {
        let mut param = ColorParam::constant(tint(random));
        if !scene.textures.is_empty() && random.chance(0.5) {
            param.texture = Some(scene.textures[random.below(scene.textures.len() as u32) as usize].0.clone());
        }
        param
    };
    let diffuse = if random.chance(0.1) { ColorParam::gray(0.0) } else { param(random) };
    let specular = if random.chance(0.35) { ColorParam::gray(0.0) } else { param(random) };
    let shininess = random.scale(1.0, 2000.0);
    if random.chance(0.5) { phong(diffuse, specular, shininess) } else { blinn_phong(diffuse, specular, shininess) }
}

/// Where a light is and how large.
#[derive(Clone, Copy)]
struct Lamp {
    center: V,
    /// Half of its longest side, or its radius.
    reach: f64,
    /// Where its front looks.
    front: V,
}

/// The floor that the camera looks at, and which way is up. Everything is measured in its unit.
struct Stage {
    middle: V,
    unit: f64,
    n: V,
    a: V,
    b: V,
}

impl Stage {
    fn new(random: &mut Random) -> Self {
        let unit = if random.chance(0.2) { random.scale(1e-2, 1e2) } else { 1.0 };
        let n = if random.chance(0.6) { [0.0, 1.0, 0.0] } else { random.direction() };
        let [a, b] = across(n);
        let middle = if random.chance(0.2) { mul(random.direction(), 30.0 * unit) } else { [0.0; 3] };
        Stage { middle, unit, n, a, b }
    }

    /// A point: along the floor, along the floor, above it.
    fn at(&self, x: f64, z: f64, y: f64) -> V {
        let offset = add(add(mul(self.a, x), mul(self.b, z)), mul(self.n, y));
        add(self.middle, mul(offset, self.unit))
    }

    /// A mesh of few or many facets that curves inwards somewhere, its normals blended.
    fn hollow(&self, random: &mut Random) -> ShapeDesc {
        let smooth_deg = Some(random.pick(&[45.0, 60.0, 180.0]));
        if random.chance(0.35) {
            let (n, bumps) = (4 + random.below(16), random.pick(&[0.05, 0.2, 0.4]));
            let mut ball = ball_mesh(self.unit * random.between(0.4, 1.2), n, bumps, random.chance(0.3), random);
            let center = self.at(random.between(-0.5, 0.5), random.between(-0.5, 0.5), random.between(0.0, 1.2));
            ball.positions.iter_mut().for_each(|p| *p = add(*p, center));
            return ShapeDesc::Mesh(if ball.normals.is_empty() { MeshDesc { smooth_deg, ..ball } } else { ball });
        }
        // Heights over a grid: a gutter, folds, a bowl, hills, rubble
        let (n, kind) = (2 + random.below(12), random.below(5));
        let (half, depth, power) = (random.between(0.6, 2.0), random.between(0.1, 0.9), random.pick(&[1.0, 2.0]));
        let waves = random.between(1.0, 4.0);
        let grow = |x: f64| if power == 1.0 { x.abs() } else { x * x };
        let mut positions = Vec::new();
        for (i, j) in (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))) {
            let [x, z] = [i, j].map(|k| 2.0 * k as f64 / n as f64 - 1.0);
            let height = match kind {
                0 => grow(x),
                1 => f64::from(i % 2),
                2 => 0.5 * (grow(x) + grow(z)),
                3 => 0.5 + 0.5 * pxfm::f_sin(2.0 * waves * x) * pxfm::f_cos(2.0 * waves * z),
                _ => random.unit(),
            };
            positions.push(self.at(half * x, half * z, depth * height));
        }
        let corner = |i: u32, j: u32| j * (n + 1) + i;
        let quads = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
        let triangles = quads.flat_map(|(i, j)| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
        });
        let smooth_deg = Some(random.pick(&[60.0, 180.0]));
        ShapeDesc::Mesh(MeshDesc { smooth_deg, ..mesh(positions, triangles.collect()) })
    }

    fn material(&self, random: &mut Random, scene: &SceneDesc) -> Option<String> {
        random.chance(0.95).then(|| scene.materials[random.below(scene.materials.len() as u32) as usize].0.clone())
    }

    fn dressed(&self, random: &mut Random, scene: &SceneDesc, mut shape: ShapeDesc) -> ShapeDesc {
        *common(&mut shape).material = self.material(random, scene);
        shape
    }

    /// A flat thing around `center` facing `n`, its sides along `a` and across.
    fn plate(&self, center: V, n: V, a: V, half: [f64; 2]) -> ShapeDesc {
        let b = unit(cross(n, a));
        let (e0, e1) = (mul(a, 2.0 * half[0]), mul(b, 2.0 * half[1]));
        ShapeDesc::Parallelogram(ParallelogramDesc::new(sub(center, mul(add(e0, e1), 0.5)), e0, e1))
    }

    /// The floor, and sometimes a wall, a second one, or a shelf.
    fn set(&self, random: &mut Random, mut scene: SceneDesc) -> SceneDesc {
        let floor = match random.below(8) {
            0 => ShapeDesc::Plane(PlaneDesc { point: self.middle, normal: self.n, ..PlaneDesc::default() }),
            1 => {
                let r = random.scale(2.0, 200.0);
                ShapeDesc::Sphere(sphere(self.at(0.0, 0.0, -r), r * self.unit))
            }
            2 => ShapeDesc::Disk(DiskDesc { normal: self.n, ..DiskDesc::new(self.middle, 5.0 * self.unit) }),
            3 => ShapeDesc::Mesh(box_mesh(self.at(0.0, 0.0, -0.5), [8.0 * self.unit, self.unit, 8.0 * self.unit])),
            _ => self.plate(self.middle, self.n, self.a, [5.0 * self.unit; 2]),
        };
        let floor = self.dressed(random, &scene, floor);
        scene = scene.with_shape(floor);
        for (toward, across) in [(self.a, self.b), (self.b, self.a)] {
            if random.chance(0.25) {
                let center = add(self.middle, mul(toward, -random.between(0.5, 3.0) * self.unit));
                let wall = self.plate(center, toward, across, [5.0 * self.unit; 2]);
                let wall = self.dressed(random, &scene, wall);
                scene = scene.with_shape(wall);
            }
        }
        scene
    }

    fn place_light(&self, random: &mut Random) -> Lamp {
        let reach = match random.below(6) {
            0 => random.scale(0.01, 0.2),
            1 => random.scale(2.0, 8.0),
            _ => random.between(0.2, 1.5),
        };
        let near = |random: &mut Random| random.between(-2.0, 2.0);
        let (center, mut front) = match random.below(12) {
            // Nearly touching the floor: facing it, facing away, on edge, anyhow
            0 => {
                let center = self.at(near(random), near(random), random.scale(1e-4, 0.3));
                let any = random.direction();
                (center, random.pick(&[mul(self.n, -1.0), self.n, self.a, any]))
            }
            // Cutting it
            1 => {
                let center = self.at(near(random), near(random), reach * random.between(-0.8, 0.8));
                let any = random.direction();
                (center, random.pick(&[self.a, self.b, any]))
            }
            // Low, far aside
            2 => {
                let center = self.at(random.between(3.0, 8.0), near(random), random.between(0.0, 0.6));
                (center, mul(self.a, -1.0))
            }
            // In the plane of a wall that might be there
            3 => (self.at(-random.between(0.5, 3.0), near(random), random.between(0.2, 3.0)), self.a),
            _ => {
                let center = self.at(2.0 * near(random), 2.0 * near(random), random.between(0.5, 5.0));
                (center, unit(sub(self.at(0.3 * near(random), 0.3 * near(random), 0.0), center)))
            }
        };
        if random.chance(0.15) {
            let any = random.direction();
            // Seen on edge from the middle, from behind, or anyhow
            let to_middle = sub(self.middle, center);
            let on_edge = if length(to_middle) > 1e-6 * self.unit { across(to_middle)[0] } else { any };
            front = random.pick(&[on_edge, mul(front, -1.0), any]);
        }
        Lamp { center, reach: reach * self.unit, front }
    }

    fn light(&self, random: &mut Random, scene: &SceneDesc, lamp: Lamp) -> LightDesc {
        let falloff = random.pick(&[Falloff::Physical, Falloff::Physical, Falloff::Constant]);
        let color = tint(random);
        // A light of a small area is a strong one, a near one is weak: about as much from each
        let toward = sub(self.middle, lamp.center);
        let (square, distance) = (lamp.reach * lamp.reach, dot(toward, toward));
        let strength = random.scale(0.3, 3.0)
            * match falloff {
                Falloff::Physical => (square + distance) / square,
                Falloff::Constant => 1.0,
            };
        let sides = random.pick(&[None, None, Some(EmitSides::Front), Some(EmitSides::Both)]);
        let (visible, blocks) = (random.chance(0.6), random.chance(0.25));
        let center = match self.touching(random, scene) {
            Some(center) if random.chance(0.08) => center,
            _ => lamp.center,
        };
        macro_rules! light {
            ($kind:ident, $desc:ident::$new:ident($($argument:expr),*)) => {
                LightDesc::$kind($desc {
                    color, strength, falloff, sides, visible, blocks,
                    ..$desc::$new($($argument),*)
                })
            };
        }
        match random.below(8) {
            0 | 1 => light!(Disk, DiskLightDesc::with_normal(center, lamp.front, lamp.reach)),
            2 | 3 => light!(Sphere, SphereLightDesc::new(center, lamp.reach)),
            _ => {
                // e0 x e1 is the front
                let [a, b] = across(lamp.front);
                let wide = 2.0 * lamp.reach * if random.chance(0.5) { 1.0 } else { random.scale(0.02, 1.0) };
                let turn = radians(random.between(0.0, 360.0));
                let (sin, cos) = if random.chance(0.5) { (0.0, 1.0) } else { pxfm::f_sincos(turn) };
                let (a, b) = (add(mul(a, cos), mul(b, sin)), sub(mul(b, cos), mul(a, sin)));
                light!(Rectangle, RectangleDesc::with_edges(center, mul(a, 2.0 * lamp.reach), mul(b, wide)))
            }
        }
    }

    /// A point on a shape that is not the floor.
    fn touching(&self, random: &mut Random, scene: &SceneDesc) -> Option<V> {
        Place { unit: self.unit, origin: self.middle }.on_a_shape(random, scene)
    }

    /// One that needs no integration.
    fn small_light(&self, random: &mut Random) -> LightDesc {
        let at = self.at(random.between(-3.0, 3.0), random.between(-3.0, 3.0), random.between(1.0, 5.0));
        let d = sub(at, self.middle);
        let strength = random.scale(0.1, 1.0) * dot(d, d);
        match random.below(3) {
            0 => LightDesc::Point(point(at, strength)),
            1 => LightDesc::Directional(directional(mul(d, -1.0 / length(d)), random.scale(0.1, 1.0))),
            _ => LightDesc::Spot(spot(at, self.middle, random.between(20.0, 90.0), Some(10.0), strength)),
        }
    }

    /// Puts something between a light and the middle.
    fn obstruct(&self, random: &mut Random, mut scene: SceneDesc, lamp: Lamp) -> SceneDesc {
        // Most light passes near here, at a share `t` of the way from the floor to the light
        let target = self.at(random.between(-0.8, 0.8), random.between(-0.8, 0.8), 0.0);
        let way = sub(lamp.center, target);
        let t = random.between(0.05, 0.95);
        let at = add(target, mul(way, t));
        let distance = length(way).max(1e-6 * self.unit);
        let toward = if length(way) > 1e-6 * self.unit { unit(way) } else { self.n };
        // As wide as the light seems from the floor
        let cone = lamp.reach * t;
        let size = match random.below(6) {
            0 => self.unit * random.scale(0.005, 0.1),
            1 => self.unit * random.scale(1.0, 4.0),
            2 => cone * random.between(0.2, 1.5),
            _ => self.unit * random.between(0.1, 0.8),
        };
        let [u, v] = across(toward);
        let turn = radians(random.between(0.0, 360.0));
        let (sin, cos) = if random.chance(0.4) { (0.0, 1.0) } else { pxfm::f_sincos(turn) };
        let u = add(mul(u, cos), mul(v, sin));
        let far = 6.0 * self.unit;
        match random.below(16) {
            // A slit
            0 => {
                let gap = (cone + 0.05 * self.unit) * random.scale(1e-3, 1.0);
                for side in [-1.0, 1.0] {
                    let center = add(at, mul(u, side * (far + 0.5 * gap)));
                    let plate = self.plate(center, toward, u, [far; 2]);
                    let plate = self.dressed(random, &scene, plate);
                    scene = scene.with_shape(plate);
                }
                scene
            }
            // A sliver of the light over an edge
            1 | 2 => {
                let edge = cone * (1.0 - random.scale(1e-3, 1.0));
                let plate = self.plate(add(at, mul(u, edge - far)), toward, u, [far; 2]);
                let plate = self.dressed(random, &scene, plate);
                scene.with_shape(plate)
            }
            // A straight edge that stands on the floor, as people build
            3 => {
                let side = random.pick(&[self.a, self.b]);
                let foot = add(self.middle, mul(side, random.between(-1.0, 1.0) * self.unit));
                let height = random.scale(0.02, 3.0) * self.unit;
                let plate = self.plate(
                    add(foot, mul(self.n, height)),
                    side,
                    self.n,
                    [height, random.between(0.2, 3.0) * self.unit],
                );
                let plate = self.dressed(random, &scene, plate);
                scene.with_shape(plate)
            }
            // A ball so large that it is nearly a wall, grazed by the light
            4 => {
                let r = self.unit * random.scale(3.0, 60.0);
                let center = add(at, mul(u, r + cone * random.between(-1.0, 1.0)));
                let ball = self.dressed(random, &scene, ShapeDesc::Sphere(sphere(center, r)));
                scene.with_shape(ball)
            }
            // Something that touches the light or holds part of it
            5 => {
                let center = add(lamp.center, mul(random.direction(), lamp.reach * random.between(0.3, 1.1)));
                let small = lamp.reach * random.scale(0.05, 1.0);
                let shape = self.solid(random, center, small);
                let shape = self.dressed(random, &scene, shape);
                scene.with_shape(shape)
            }
            // A grille, or a row of balls, as instances
            6 | 7 => {
                let count = 3 + random.below(9);
                let name = format!("group {}", scene.groups.len());
                let part = if random.chance(0.5) {
                    ShapeDesc::Sphere(sphere([0.0; 3], 0.3 * size))
                } else {
                    self.solid(random, [0.0; 3], 0.3 * size)
                };
                let part = self.dressed(random, &scene, part);
                scene = scene.with_group(&name, vec![part]);
                for i in 0..count {
                    let along = mul(u, size * (i as f64 - 0.5 * count as f64));
                    let turn = random.vector(90.0);
                    scene = scene.with_shape(moved(instance(&name), add(at, along), turn, [1.0; 3]));
                }
                scene
            }
            // A crowd of balls
            8 => {
                for _ in 0..2 + random.below(20) {
                    let center = add(at, mul(random.vector(1.0), 0.4 * distance));
                    let r = size * random.scale(0.1, 1.0);
                    let ball = self.dressed(random, &scene, ShapeDesc::Sphere(sphere(center, r)));
                    scene = scene.with_shape(ball);
                }
                scene
            }
            // A mesh with bumps
            9 => {
                let (n, normals) = (4 + random.below(20), random.chance(0.5));
                let mut ball = ball_mesh(size, n, random.pick(&[0.0, 0.05, 0.3]), normals, random);
                ball.positions.iter_mut().for_each(|p| *p = add(*p, at));
                let ball = self.dressed(random, &scene, ShapeDesc::Mesh(ball));
                scene.with_shape(ball)
            }
            // Anything
            10 => {
                let place = Place { unit: 0.5 * size, origin: at };
                let shape = place.dressed(random, &scene);
                scene.with_shape(shape)
            }
            // One in the other
            11 => {
                for _ in 0..2 {
                    let center = add(at, mul(random.direction(), size * random.between(0.0, 1.0)));
                    let shape = self.solid(random, center, size);
                    let shape = self.dressed(random, &scene, shape);
                    scene = scene.with_shape(shape);
                }
                scene
            }
            _ => {
                let shape = self.solid(random, at, size);
                let shape = self.dressed(random, &scene, shape);
                scene.with_shape(shape)
            }
        }
    }

    /// One thing of about that size.
    fn solid(&self, random: &mut Random, at: V, size: f64) -> ShapeDesc {
        let any = random.direction();
        let axis = random.pick(&[self.n, self.a, any, any]);
        let other = add(at, mul(axis, size * random.scale(0.2, 4.0)));
        let capped = random.chance(0.7);
        match random.below(9) {
            0 => {
                let inner_radius = size * random.pick(&[0.0, 0.5, 0.95]);
                ShapeDesc::Disk(DiskDesc { normal: axis, inner_radius, ..DiskDesc::new(at, size) })
            }
            1 => {
                let size = [0; 3].map(|_| size * random.pick(&[0.05, 0.5, 1.0, 2.0]));
                ShapeDesc::Box(BoxDesc { size, ..BoxDesc::new(at) })
            }
            2 => ShapeDesc::Cylinder(CylinderDesc { capped, ..CylinderDesc::new(at, other, size * 0.3) }),
            3 => {
                let radius1 = size * random.pick(&[0.0, 0.0, 0.5]);
                ShapeDesc::Cone(ConeDesc { radius1, capped, ..ConeDesc::new(at, other, size * 0.7) })
            }
            4 => {
                let tube = size * random.pick(&[0.05, 0.3, 0.6]);
                ShapeDesc::Torus(TorusDesc { axis, ..TorusDesc::new(at, size, tube) })
            }
            5 | 6 => {
                let half = [size, size * random.scale(0.05, 1.0)];
                self.plate(at, axis, across(axis)[0], half)
            }
            _ => ShapeDesc::Sphere(sphere(at, size)),
        }
    }

    fn camera(&self, random: &mut Random) -> firstlight::CameraDesc {
        let eye = self.at(random.between(-4.0, 4.0), random.between(-4.0, 4.0), random.between(0.5, 6.0));
        let target = self.at(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-0.2, 0.5));
        // From afar, or so near that an edge of a shadow fills the picture
        let fov = if random.chance(0.25) { random.scale(0.5, 10.0) } else { random.between(15.0, 70.0) };
        if random.chance(0.1) {
            let height = Some(random.scale(0.2, 6.0) * self.unit);
            return firstlight::CameraDesc {
                projection: Projection::Orthographic,
                fov_y_deg: None,
                height,
                ..camera(eye, target, 1.0)
            };
        }
        camera(eye, target, fov)
    }
}
