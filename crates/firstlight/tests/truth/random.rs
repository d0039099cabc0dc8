//! Random scenes, the same for the same seed: the harder for a renderer, the better.

use firstlight::{
    ColorDesc, ColorParam, EmitSides, Falloff, LightDesc, MaterialDesc, ParallelogramDesc, RectangleDesc, SampleSet,
    SceneDesc, ShapeDesc, SphereDesc, SphereUv,
};

use crate::scenes::*;

/// Scene number `seed`: a small picture of shapes that are huge and tiny, that overlap, touch and lie in one plane, under
/// lights of every kind that touch and cut them.
pub fn scene(seed: u64) -> SceneDesc {
    let mut random = Random::new(seed);
    let random = &mut random;
    let unit_length = match random.below(4) {
        0 => random.scale(1e-5, 1e5),
        _ => 1.0,
    };
    let origin = if random.chance(0.15) { mul(random.direction(), 1000.0 * unit_length) } else { [0.0; 3] };
    let antialiasing = 1 + random.below(3);
    let mut scene = empty(12, 12, antialiasing);
    scene.render.samples = 1 + random.below(70);
    scene.render.transparent = random.chance(0.2);
    if random.chance(0.4) {
        scene.render.background = color(random);
        scene.render.ambient = color(random);
    }
    for i in 0..1 + random.below(4) {
        if random.chance(0.4) {
            let counts = [1 + random.below(9), 1 + random.below(9)];
            let colors = [color(random), color(random)].map(|c| c.linear);
            scene = scene.with_texture(&format!("texture {i}"), checkerboard(counts, colors));
        }
        scene = {
            let material = material(random, &scene);
            scene.with_material(&format!("material {i}"), material)
        };
    }
    let place = Place { unit: unit_length, origin };
    for _ in 0..random.below(6) {
        let sphere = place.sphere(random, &scene);
        scene = scene.with_sphere(sphere);
    }
    for _ in 0..random.below(6) {
        let parallelogram = place.parallelogram(random, &scene);
        scene = scene.with_parallelogram(parallelogram);
    }
    for _ in 0..1 + random.below(4) {
        let light = place.light(random, &scene);
        scene = scene.with_light(light);
    }
    let camera = place.camera(random, &scene);
    scene.with_camera(camera)
}

/// Balls almost sunk in a floor, and ones that just touch it from below, under lights that graze it: what of a ball is
/// above the horizon decides.
pub fn grazing(seed: u64) -> SceneDesc {
    let mut random = Random::new(seed ^ 0x5eed);
    let random = &mut random;
    let n = random.direction();
    let [a, b] = across(n);
    let middle = if random.chance(0.3) { random.vector(100.0) } else { [0.0; 3] };
    let on_floor = |random: &mut Random, reach: f64| {
        add(middle, add(mul(a, random.between(-reach, reach)), mul(b, random.between(-reach, reach))))
    };
    let mut scene = empty(12, 12, 1).with_parallelogram(square(middle, n, 20.0));
    for _ in 0..3 {
        let r = random.scale(0.3, 30.0);
        let depth = r * (1.0 - random.pick(&[1.0, 1.0, -1.0]) * random.scale(1e-6, 0.05));
        scene = scene.with_sphere(sphere(sub(on_floor(random, 2.0), mul(n, depth)), r));
    }
    for _ in 0..3 {
        let at = add(on_floor(random, 4.0), mul(n, random.scale(1e-4, 0.5)));
        let sides = [mul(a, random.scale(0.1, 2.0)), mul(b, random.scale(0.1, 2.0))];
        let light = rectangle(at, sides[0], sides[1], SampleSet::Sobol, 1 + random.below(60));
        scene = scene.with_light(LightDesc::Rectangle(RectangleDesc { falloff: Falloff::Constant, ..light }));
    }
    let eye = add(on_floor(random, 2.0), mul(n, random.between(0.5, 4.0)));
    scene.with_camera(camera(eye, on_floor(random, 1.0), 70.0))
}

fn color(random: &mut Random) -> ColorDesc {
    match random.below(4) {
        0 => ColorDesc::gray(random.unit()),
        1 => ColorDesc::linear(random.pick(&[0.0, 1.0]), random.pick(&[0.0, 0.5]), 1.0),
        _ => ColorDesc::linear(random.unit(), random.unit(), random.unit()),
    }
}

fn color_param(random: &mut Random, scene: &SceneDesc) -> ColorParam {
    let mut param = ColorParam::constant(color(random));
    if !scene.textures.is_empty() && random.chance(0.6) {
        param.texture = Some(scene.textures[random.below(scene.textures.len() as u32) as usize].0.clone());
    }
    param
}

fn material(random: &mut Random, scene: &SceneDesc) -> MaterialDesc {
    let shininess = match random.below(5) {
        0 => random.below(200) as f64,
        1 => random.below(100) as f64 + 0.5,
        2 => random.between(0.0, 150.0),
        3 => random.pick(&[0.0, 1.0, 2.0, 3.0, 65536.0, 65537.0, 1e6]),
        _ => random.scale(1e-3, 1e5),
    };
    let diffuse = color_param(random, scene);
    let specular = if random.chance(0.3) { ColorParam::gray(0.0) } else { color_param(random, scene) };
    if random.chance(0.5) { phong(diffuse, specular, shininess) } else { blinn_phong(diffuse, specular, shininess) }
}

/// Where the world is and how large.
struct Place {
    unit: f64,
    origin: V,
}

impl Place {
    fn point(&self, random: &mut Random, reach: f64) -> V {
        let mut p = random.vector(reach);
        if random.chance(0.4) {
            // On whole and half numbers things touch and lie in one plane
            p = p.map(|x| (x * 2.0).round() / 2.0);
        }
        add(self.origin, mul(p, self.unit))
    }

    fn material(&self, random: &mut Random, scene: &SceneDesc) -> Option<String> {
        random.chance(0.9).then(|| scene.materials[random.below(scene.materials.len() as u32) as usize].0.clone())
    }

    fn sphere(&self, random: &mut Random, scene: &SceneDesc) -> SphereDesc {
        let center = self.point(random, 3.0);
        let radius = match random.below(6) {
            0 => random.scale(1e-3, 1e-1),
            1 => random.scale(5.0, 1e3),
            2 => random.pick(&[0.5, 1.0, 1.5]),
            _ => random.between(0.2, 1.8),
        } * self.unit;
        let mut desc = SphereDesc {
            uv: random.pick(&[SphereUv::Equirectangular, SphereUv::Angles]),
            material: self.material(random, scene),
            single_sided: random.chance(0.1),
            ..sphere(center, radius)
        };
        match scene.shapes.last() {
            // Touching the one before, from outside or from inside, or standing in the same place
            Some(ShapeDesc::Sphere(other)) if random.chance(0.4) => {
                let way = random.direction();
                let apart = random.pick(&[other.radius + radius, (other.radius - radius).abs(), 0.0]);
                desc.center = add(other.center, mul(way, apart));
            }
            _ => {}
        }
        desc
    }

    fn edges(&self, random: &mut Random) -> [V; 2] {
        let size = match random.below(5) {
            0 => random.scale(1e-3, 0.1),
            1 => random.scale(5.0, 1e3),
            _ => random.between(0.3, 6.0),
        } * self.unit;
        if random.chance(0.5) {
            // Along the axes, as people build
            let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let k = random.below(3) as usize;
            [mul(axes[k], size), mul(axes[(k + 1) % 3], size * random.pick(&[1.0, -1.0, 2.0]))]
        } else {
            let e0 = random.direction();
            let e1 = add(e0, mul(random.direction(), random.scale(0.01, 3.0)));
            [mul(e0, size), mul(e1, size)]
        }
    }

    fn parallelogram(&self, random: &mut Random, scene: &SceneDesc) -> ParallelogramDesc {
        let [e0, e1] = self.edges(random);
        let center = self.point(random, 3.0);
        let mut desc = ParallelogramDesc {
            flip: random.chance(0.5),
            material: self.material(random, scene),
            single_sided: random.chance(0.15),
            ..parallelogram(sub(center, mul(add(e0, e1), 0.5)), e0, e1)
        };
        match scene.shapes.last() {
            // Tangent to a sphere
            Some(ShapeDesc::Sphere(ball)) if random.chance(0.5) => {
                let n = unit(cross(e0, e1));
                let touch = add(ball.center, mul(n, ball.radius));
                desc.p = sub(touch, mul(add(e0, e1), random.unit()));
            }
            // In the plane of the one before, or sharing an edge with it, or the same once more
            Some(ShapeDesc::Parallelogram(other)) if random.chance(0.5) => match random.below(3) {
                0 => {
                    desc.p = add(other.p, mul(other.e0, random.between(-1.0, 1.0)));
                    (desc.e0, desc.e1) = (other.e0, add(other.e1, mul(other.e0, random.pick(&[0.0, 0.5]))));
                }
                1 => (desc.p, desc.e0) = (other.p, other.e0),
                _ => (desc.p, desc.e0, desc.e1) = (other.p, other.e0, other.e1),
            },
            _ => {}
        }
        // What is too thin or too short for a description
        let shortest = length(desc.e0).min(length(desc.e1));
        if shortest < 1e-8 || length(cross(unit(desc.e0), unit(desc.e1))) < 1e-4 {
            (desc.e0, desc.e1) = ([self.unit, 0.0, 0.0], [0.0, 0.0, self.unit]);
        }
        desc
    }

    /// A point on a shape of the scene, if there is one.
    fn on_a_shape(&self, random: &mut Random, scene: &SceneDesc) -> Option<V> {
        if scene.shapes.is_empty() {
            return None;
        }
        Some(match &scene.shapes[random.below(scene.shapes.len() as u32) as usize] {
            ShapeDesc::Sphere(ball) => add(ball.center, mul(random.direction(), ball.radius)),
            ShapeDesc::Parallelogram(flat) => {
                add(flat.p, add(mul(flat.e0, random.between(-0.2, 1.2)), mul(flat.e1, random.unit())))
            }
            #[allow(unreachable_patterns)]
            _ => unreachable!("no test here uses another shape"),
        })
    }

    fn light(&self, random: &mut Random, scene: &SceneDesc) -> LightDesc {
        let touching = if random.chance(0.3) { self.on_a_shape(random, scene) } else { None };
        let at = touching.unwrap_or_else(|| self.point(random, 5.0));
        let (color, shadows) = (color(random), random.chance(0.85));
        let falloff = random.pick(&[Falloff::Physical, Falloff::Constant]);
        let strength =
            random.scale(0.1, 100.0) * if falloff == Falloff::Physical { self.unit * self.unit } else { 1.0 };
        match random.below(6) {
            0 => LightDesc::Point(firstlight::PointDesc { color, falloff, shadows, ..point(at, strength) }),
            1 => {
                let any = random.direction();
                let direction = random.pick(&[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], any, any]);
                LightDesc::Directional(firstlight::DirectionalDesc {
                    color,
                    falloff,
                    shadows,
                    ..directional(direction, 2.0)
                })
            }
            2 => {
                let cone = random.between(5.0, 180.0);
                let inner = random.chance(0.6).then(|| cone * random.unit());
                let target = add(at, mul(random.direction(), self.unit));
                let desc = spot(at, target, cone, inner, strength);
                LightDesc::Spot(firstlight::SpotDesc { color, falloff, shadows, ..desc })
            }
            _ => {
                let ([e0, e1], center) = self.rectangle_frame(random, scene, at);
                let set = random.pick(&[
                    SampleSet::Sobol,
                    SampleSet::Sobol,
                    SampleSet::Uniform,
                    SampleSet::Grid,
                    SampleSet::Stratified,
                ]);
                let samples = match set {
                    SampleSet::Sobol | SampleSet::Uniform => random.chance(0.5).then(|| 1 + random.below(70)),
                    SampleSet::Grid | SampleSet::Stratified => {
                        let side = 1 + random.below(8);
                        Some(side * side)
                    }
                };
                let area = length(cross(e0, e1));
                LightDesc::Rectangle(RectangleDesc {
                    color,
                    strength: if falloff == Falloff::Physical { strength / area } else { strength },
                    falloff,
                    sides: random.pick(&[None, None, Some(EmitSides::Front), Some(EmitSides::Both)]),
                    visible: random.chance(0.7),
                    blocks: random.chance(0.3),
                    shadows,
                    samples,
                    seed: random.below(100),
                    ..rectangle(center, e0, e1, set, 1)
                })
            }
        }
    }

    /// Edges and centre of a rectangle light: anyhow, or in the plane of a parallelogram.
    fn rectangle_frame(&self, random: &mut Random, scene: &SceneDesc, at: V) -> ([V; 2], V) {
        let flats: Vec<_> = scene
            .shapes
            .iter()
            .filter_map(|shape| if let ShapeDesc::Parallelogram(flat) = shape { Some(flat) } else { None })
            .collect();
        let (width, depth) = (random.scale(0.05, 4.0) * self.unit, random.scale(0.05, 4.0) * self.unit);
        if !flats.is_empty() && random.chance(0.4) {
            let flat = flats[random.below(flats.len() as u32) as usize];
            let n = unit(cross(flat.e0, flat.e1));
            let a = unit(flat.e0);
            let sides = [mul(a, width), mul(cross(n, a), depth)];
            let center = add(flat.p, add(mul(flat.e0, random.unit()), mul(flat.e1, random.unit())));
            // In it, just in front of it, or cutting it
            return match random.below(3) {
                0 => (sides, center),
                1 => (sides, add(center, mul(n, random.scale(1e-6, 1.0) * self.unit))),
                _ => ([mul(n, width), mul(a, depth)], center),
            };
        }
        let n = if random.chance(0.4) { [0.0, 1.0, 0.0] } else { random.direction() };
        let [a, b] = across(n);
        ([mul(a, width), mul(b, depth)], at)
    }

    fn camera(&self, random: &mut Random, scene: &SceneDesc) -> firstlight::CameraDesc {
        let mut eye = self.point(random, 6.0);
        if random.chance(0.25) {
            // Inside a sphere
            if let Some(ShapeDesc::Sphere(ball)) = scene.shapes.first() {
                eye = add(ball.center, mul(random.direction(), ball.radius * random.unit() * 0.95));
            }
        }
        let target = self.on_a_shape(random, scene).unwrap_or(self.origin);
        let way = sub(target, eye);
        let target = if length(way) < 1e-3 * self.unit { add(eye, mul(random.direction(), self.unit)) } else { target };
        camera(eye, target, random.scale(0.5, 130.0))
    }
}
