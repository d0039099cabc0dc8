//! Random scenes, the same for the same seed: the harder for a renderer, the better.

use firstlight::{
    BoxDesc, ColorDesc, ColorParam, ConeDesc, CylinderDesc, DiskDesc, DiskLightDesc, EmitSides, Falloff, LightDesc,
    MaterialDesc, MeshDesc, ParallelogramDesc, PlaneDesc, PointSetDesc, Projection, RectangleDesc, RectangleShapeDesc,
    SampleSet, SceneDesc, ShapeDesc, SphereDesc, SphereLightDesc, SphereUv, TorusDesc,
};

use crate::scenes::*;

/// Scene number `seed`: a small picture of shapes that are huge and tiny, that overlap, touch and lie in one plane,
/// under lights of every kind that touch and cut them. Every other one has shapes of all kinds, meshes and instances.
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
    scene.render.samples = (1 + random.below(70)).into();
    scene.render.transparent = random.chance(0.2);
    if random.chance(0.4) {
        scene.render.background = color(random);
        scene.render.ambient = color(random).into();
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
    if seed % 2 == 1 {
        scene = place.furnish(random, scene);
    }
    for _ in 0..1 + random.below(4) {
        let light = place.light(random, &scene);
        scene = scene.with_light(light);
    }
    let camera = place.camera(random, &scene);
    let mut scene = scene.with_camera(camera);
    if seed % 4 >= 2 {
        link(&mut Random::new(seed ^ 0x117c), &mut scene);
    }
    scene
}

/// Names the lights, some of them alike, and has shapes and instances choose among them.
fn link(random: &mut Random, scene: &mut SceneDesc) {
    let names = ["a", "b", "c"];
    let mut said = Vec::new();
    for light in &mut scene.lights {
        let name = random.chance(0.9).then(|| random.pick(&names).to_owned());
        said.extend(name.clone());
        match light {
            LightDesc::Point(light) => light.name = name,
            LightDesc::Directional(light) => light.name = name,
            LightDesc::Spot(light) => light.name = name,
            LightDesc::Rectangle(light) => light.name = name,
            LightDesc::Disk(light) => light.name = name,
            LightDesc::Sphere(light) => light.name = name,
        }
    }
    for shape in scene.shapes.iter_mut().chain(scene.groups.iter_mut().flat_map(|(_, group)| &mut group.shapes)) {
        let links = common(shape).links;
        // Included or excluded: of lights, and of shadows
        for (kind, list) in links.into_iter().enumerate() {
            let other = kind % 2 == 1 && random.chance(0.5);
            if random.chance(0.2) || other {
                let chosen = said.iter().filter(|_| random.chance(0.5)).cloned().collect();
                *list = Some(chosen);
            }
        }
        let [lights_include, lights_exclude, shadow_include, shadow_exclude] = common(shape).links;
        for (include, exclude) in [(lights_include, lights_exclude), (shadow_include, shadow_exclude)] {
            if include.is_some() {
                *exclude = None;
            }
        }
    }
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

pub fn color(random: &mut Random) -> ColorDesc {
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
pub struct Place {
    pub unit: f64,
    pub origin: V,
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

    pub fn material(&self, random: &mut Random, scene: &SceneDesc) -> Option<String> {
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
    pub fn on_a_shape(&self, random: &mut Random, scene: &SceneDesc) -> Option<V> {
        if scene.shapes.is_empty() {
            return None;
        }
        Some(match &scene.shapes[random.below(scene.shapes.len() as u32) as usize] {
            ShapeDesc::Sphere(ball) => add(ball.center, mul(random.direction(), ball.radius)),
            ShapeDesc::Parallelogram(flat) => {
                add(flat.p, add(mul(flat.e0, random.between(-0.2, 1.2)), mul(flat.e1, random.unit())))
            }
            // Somewhere near
            _ => self.point(random, 1.5),
        })
    }

    /// Adds shapes of all kinds, by themselves and in groups.
    fn furnish(&self, random: &mut Random, mut scene: SceneDesc) -> SceneDesc {
        for _ in 0..random.below(6) {
            let shape = self.dressed(random, &scene);
            scene = scene.with_shape(shape);
        }
        // Each group may hold instances of those before
        let local = Place { unit: self.unit, origin: [0.0; 3] };
        let groups = random.below(4);
        for i in 0..groups {
            let mut shapes: Vec<_> = (0..1 + random.below(3)).map(|_| local.dressed(random, &scene)).collect();
            for _ in 0..random.below(3).min(i * 2) {
                shapes.push(local.instance(random, &scene, i));
            }
            scene = scene.with_group(&format!("group {i}"), shapes);
        }
        for _ in 0..random.below(5).min(groups * 4) {
            let instance = self.instance(random, &scene, groups);
            scene = scene.with_shape(instance);
        }
        // Sometimes more than are listed
        if random.chance(0.1) {
            for _ in 0..50 {
                let ball = self.sphere(random, &scene);
                scene = scene.with_sphere(ball);
            }
        }
        scene
    }

    /// An instance of one of the first groups.
    pub fn instance(&self, random: &mut Random, scene: &SceneDesc, groups: u32) -> ShapeDesc {
        let shape = self.placed(random, instance(&format!("group {}", random.clone().below(groups))));
        self.flagged(random, scene, shape, 0.3)
    }

    /// Scaled, mirrored, turned, moved.
    pub fn placed(&self, random: &mut Random, shape: ShapeDesc) -> ShapeDesc {
        let quarter = random.chance(0.5);
        let turn = random.vector(180.0).map(|deg| if quarter { (deg / 90.0).round() * 90.0 } else { deg });
        let scale = match random.below(4) {
            0 => [1.0; 3],
            1 => [random.scale(0.3, 2.0); 3],
            2 => [0; 3].map(|_| random.pick(&[-1.0, 1.0, 0.5])),
            _ => [0; 3].map(|_| random.scale(0.3, 2.0) * random.pick(&[1.0, 1.0, -1.0])),
        };
        moved(shape, self.point(random, 2.5), turn, scale)
    }

    /// With a material, and now and then a flag.
    fn flagged(&self, random: &mut Random, scene: &SceneDesc, mut shape: ShapeDesc, named: f64) -> ShapeDesc {
        let common = common(&mut shape);
        *common.material = self.material(random, scene).filter(|_| random.chance(named));
        *common.visible = !random.chance(0.07);
        *common.casts_shadow = !random.chance(0.07);
        *common.receives_shadow = !random.chance(0.07);
        *common.single_sided = random.chance(0.1);
        shape
    }

    /// A shape of any kind, with or without a transform.
    pub fn dressed(&self, random: &mut Random, scene: &SceneDesc) -> ShapeDesc {
        let shape = if random.chance(0.5) {
            let local = Place { unit: self.unit, origin: [0.0; 3] };
            let shape = local.shape(random, scene);
            self.placed(random, shape)
        } else {
            self.shape(random, scene)
        };
        self.flagged(random, scene, shape, 0.9)
    }

    fn shape(&self, random: &mut Random, scene: &SceneDesc) -> ShapeDesc {
        let size = self.unit * if random.chance(0.2) { random.scale(0.01, 50.0) } else { random.between(0.2, 2.0) };
        let at = self.point(random, 2.0);
        let any = random.direction();
        let normal = random.pick(&[[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], any, any]);
        let other = add(at, mul(normal, size * random.scale(0.1, 3.0)));
        let capped = random.chance(0.7);
        match random.below(12) {
            0 => ShapeDesc::Plane(PlaneDesc { point: at, normal, ..PlaneDesc::default() }),
            1 => {
                let inner_radius = size * random.pick(&[0.0, 0.3, 0.95]);
                ShapeDesc::Disk(DiskDesc { normal, inner_radius, ..DiskDesc::new(at, size) })
            }
            2 => {
                let sides = [size, size * random.scale(0.1, 3.0)];
                ShapeDesc::Rectangle(RectangleShapeDesc { normal, ..RectangleShapeDesc::new(at, sides) })
            }
            3 => {
                let size = [0; 3].map(|_| size * random.pick(&[0.01, 0.5, 1.0, 2.0]));
                ShapeDesc::Box(BoxDesc { size, ..BoxDesc::new(at) })
            }
            4 => ShapeDesc::Cylinder(CylinderDesc { capped, ..CylinderDesc::new(at, other, size * 0.5) }),
            5 => {
                let radius1 = size * random.pick(&[0.0, 0.0, 0.3, 0.8]);
                ShapeDesc::Cone(ConeDesc { radius1, capped, ..ConeDesc::new(at, other, size * 0.8) })
            }
            6 => {
                let tube = size * random.pick(&[0.1, 0.3, 1.0, 1.2]);
                ShapeDesc::Torus(TorusDesc { axis: normal, ..TorusDesc::new(at, size, tube) })
            }
            7 => {
                let count = 1 + random.below(60) as usize;
                let positions: Vec<V> = (0..count).map(|_| add(at, random.vector(size))).collect();
                let radii = (0..count).map(|_| size * random.scale(0.01, 0.5)).collect();
                let colors = if random.chance(0.5) { self.colors(random, count) } else { Vec::new() };
                ShapeDesc::PointSet(PointSetDesc { positions, radii, colors, ..PointSetDesc::default() })
            }
            8 => ShapeDesc::Sphere(SphereDesc { center: at, ..self.sphere(random, scene) }),
            9 => ShapeDesc::Mesh(box_mesh(at, [size, size * 0.5, size * random.pick(&[0.01, 1.0])])),
            10 => {
                // Triangles anyhow
                let count = 1 + random.below(20);
                let positions = (0..3 * count).map(|_| add(at, random.vector(size))).collect();
                let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
                self.mesh(random, mesh(positions, triangles))
            }
            _ => {
                let (n, normals) = (3 + random.below(6), random.chance(0.5));
                let mut ball = ball_mesh(size, n, random.pick(&[0.0, 0.2]), normals, random);
                ball.positions.iter_mut().for_each(|p| *p = add(*p, at));
                self.mesh(random, ball)
            }
        }
    }

    fn colors(&self, random: &mut Random, count: usize) -> Vec<V> {
        (0..count).map(|_| color(random).linear).collect()
    }

    /// With more than positions.
    fn mesh(&self, random: &mut Random, mut mesh: MeshDesc) -> ShapeDesc {
        let count = mesh.positions.len();
        if random.chance(0.3) {
            mesh.uvs = (0..count).map(|_| [random.between(-2.0, 2.0), random.unit()]).collect();
        }
        if random.chance(0.4) {
            mesh.colors = self.colors(random, count);
        }
        if random.chance(0.2) {
            mesh.normals = (0..count).map(|_| random.direction()).collect();
        } else if random.chance(0.3) {
            mesh.smooth_deg = Some(random.between(0.0, 180.0));
        }
        ShapeDesc::Mesh(mesh)
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
                let set = random.pick(&[
                    SampleSet::Sobol,
                    SampleSet::Sobol,
                    SampleSet::Uniform,
                    SampleSet::Grid,
                    SampleSet::Stratified,
                ]);
                let samples = match set {
                    SampleSet::Sobol | SampleSet::Uniform => random.chance(0.5).then(|| (1 + random.below(70)).into()),
                    SampleSet::Grid | SampleSet::Stratified => {
                        let side = 1 + random.below(8);
                        Some((side * side).into())
                    }
                };
                let over = |area: f64| if falloff == Falloff::Physical { strength / area } else { strength };
                let sides = random.pick(&[None, None, Some(EmitSides::Front), Some(EmitSides::Both)]);
                let (visible, blocks, seed) = (random.chance(0.7), random.chance(0.3), random.below(100));
                macro_rules! light {
                    ($kind:ident, $area:expr, $desc:ident::$new:ident($($argument:expr),*)) => {
                        LightDesc::$kind($desc {
                            color, strength: over($area), falloff, sides, visible, blocks, shadows, samples, set, seed,
                            ..$desc::$new($($argument),*)
                        })
                    };
                }
                let kind = random.below(4);
                if kind == 0 {
                    let (center, radius) = self.ball_frame(random, scene, at);
                    return light!(Sphere, radius * radius, SphereLightDesc::new(center, radius));
                }
                let ([e0, e1], center) = self.rectangle_frame(random, scene, at);
                let area = length(cross(e0, e1));
                match kind {
                    1 => light!(
                        Disk,
                        area,
                        DiskLightDesc::with_normal(center, cross(unit(e0), unit(e1)), area.sqrt() * 0.5)
                    ),
                    _ => light!(Rectangle, area, RectangleDesc::with_edges(center, e0, e1)),
                }
            }
        }
    }

    /// Centre and radius of a sphere light: anyhow, or that of a sphere of the scene.
    fn ball_frame(&self, random: &mut Random, scene: &SceneDesc, at: V) -> (V, f64) {
        if random.chance(0.3)
            && let Some(ShapeDesc::Sphere(ball)) = scene.shapes.first()
        {
            return (ball.center, ball.radius * random.pick(&[1.0, 0.5, 1.5]));
        }
        (at, random.scale(0.02, 2.0) * self.unit)
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
        if random.chance(0.2) {
            let height = Some(random.scale(0.05, 20.0) * self.unit);
            return firstlight::CameraDesc {
                projection: Projection::Orthographic,
                fov_y_deg: None,
                height,
                ..camera(eye, target, 1.0)
            };
        }
        camera(eye, target, random.scale(0.5, 130.0))
    }
}
