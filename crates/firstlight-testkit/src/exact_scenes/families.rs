//! Scenes of one kind each: what people bring, and what was wrong once.

use super::*;

/// What a family's scenes have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Family {
    /// Valleys, hills and bumpy balls of facets with blended normals.
    Smooth,
    /// Blades of grass, leaves and fences.
    Thin,
    /// Meshes that reach into a light.
    Crossing,
    /// Lights that cut floors and walls at a shallow angle.
    Shallow,
    /// Lights from a millionth to all of a unit above a floor.
    Close,
    /// Specks on a floor, or on the way from it to a light that is as near.
    Specks,
    /// The hard edges of shadows, of lights that are points.
    Hard,
    /// Small plates with checkers, of which the rims are seen.
    Rims,
    /// Metals and dielectrics.
    Surfaces,
}

/// How many seeds each of the first has.
const SEEDS: u64 = 75;

const FAMILIES: [Family; 8] = [
    Family::Smooth,
    Family::Thin,
    Family::Crossing,
    Family::Shallow,
    Family::Close,
    Family::Specks,
    Family::Hard,
    Family::Rims,
];

impl Family {
    /// That of a seed; `None` of the first thousand.
    pub fn of(seed: u64) -> Option<Family> {
        if seed >= SURFACES {
            return Some(Family::Surfaces);
        }
        let index = (seed.checked_sub(SMOOTH)? / SEEDS) as usize;
        Some(FAMILIES[index.min(FAMILIES.len() - 1)])
    }

    /// Whether there are lights to be integrated.
    pub fn is_integrated(self) -> bool {
        self != Family::Hard
    }

    pub fn scene(self, random: &mut Random) -> SceneDesc {
        match self {
            Family::Smooth => smooth(random),
            Family::Thin => thin(random),
            Family::Crossing => crossing(random),
            Family::Shallow => shallow(random),
            Family::Close => close(random),
            Family::Specks => specks(random),
            Family::Hard => hard(random),
            Family::Rims => rims(random),
            Family::Surfaces => surfaces::surfaces(random),
        }
    }
}

/// A scene with a few materials, and its stage.
fn begun(random: &mut Random) -> (SceneDesc, Stage) {
    let mut scene = empty(48, 48, random.pick(&[1, 2, 2, 3]));
    if random.chance(0.3) {
        scene = scene.with_texture("checkers", checkers(random));
    }
    for i in 0..1 + random.below(3) {
        let material = material(random, &scene);
        scene = scene.with_material(&format!("material {i}"), material);
    }
    (scene, Stage::new(random))
}

fn checkers(random: &mut Random) -> firstlight::TextureDesc {
    let counts = [1 + random.below(12), 1 + random.below(12)];
    checkerboard(counts, [tint(random), tint(random)].map(|color| color.linear))
}

fn with(random: &mut Random, stage: &Stage, scene: SceneDesc, shape: impl Into<ShapeDesc>) -> SceneDesc {
    let shape = stage.dressed(random, &scene, shape.into());
    scene.with_shape(shape)
}

fn lit(random: &mut Random, stage: &Stage, scene: SceneDesc, lamp: Lamp) -> SceneDesc {
    let light = stage.light(random, &scene, lamp);
    scene.with_light(light)
}

/// A light above the stage, as rooms have them.
fn overhead(random: &mut Random, stage: &Stage) -> Lamp {
    let center = stage.at(random.between(-2.0, 2.0), random.between(-2.0, 2.0), random.between(1.5, 4.0));
    let target = stage.at(random.between(-0.5, 0.5), random.between(-0.5, 0.5), 0.0);
    Lamp { center, reach: stage.unit * random.between(0.2, 1.2), front: unit(sub(target, center)) }
}

/// What a camera sees that is `away` from a point of the floor.
fn close_up(random: &mut Random, stage: &Stage, middle: V, away: f64) -> firstlight::CameraDesc {
    let [x, z] = [0; 2].map(|_| random.between(-1.0, 1.0));
    let way = add(add(mul(stage.a, x), mul(stage.b, z)), mul(stage.n, random.between(0.1, 1.5)));
    camera(add(middle, mul(unit(way), away)), middle, random.between(10.0, 50.0))
}

fn thin(random: &mut Random) -> SceneDesc {
    let (mut scene, stage) = begun(random);
    scene = stage.set(random, scene);
    let kind = random.below(4);
    if kind < 2 {
        // Blades, and leaves of two triangles
        let (count, wide) = (10 + random.below(150), random.scale(0.004, 0.08));
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for _ in 0..count {
            let foot = stage.at(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 0.0);
            let lean = add(mul(stage.n, random.between(0.3, 1.0)), mul(random.direction(), 0.4));
            let (tip, side) = (add(foot, mul(lean, stage.unit)), mul(random.direction(), 0.5 * wide * stage.unit));
            let first = positions.len() as u32;
            positions.extend([sub(foot, side), add(foot, side), tip]);
            triangles.push([first, first + 1, first + 2]);
            if kind == 1 {
                let middle = mul(add(foot, tip), 0.5);
                positions.push(add(middle, mul(random.direction(), 3.0 * wide * stage.unit)));
                triangles.push([first, first + 2, first + 3]);
            }
        }
        let smooth_deg = random.pick(&[None, None, Some(180.0)]);
        scene = with(random, &stage, scene, ShapeDesc::Mesh(MeshDesc { smooth_deg, ..mesh(positions, triangles) }));
    } else {
        // Slats in a row: boxes, poles or plates
        let (count, gap) = (4 + random.below(24), random.between(0.05, 0.3));
        let (wide, high) = (gap * random.between(0.05, 0.7), random.between(0.3, 1.5));
        let part = random.below(3);
        for i in 0..count {
            let x = gap * (f64::from(i) - 0.5 * f64::from(count));
            let (foot, top) = (stage.at(x, 0.2, 0.0), stage.at(x, 0.2, high));
            let shape = match part {
                0 => ShapeDesc::Cylinder(CylinderDesc::new(foot, top, 0.5 * wide * stage.unit)),
                1 => {
                    let half = [0.5 * wide * stage.unit, 0.5 * high * stage.unit];
                    stage.plate(mul(add(foot, top), 0.5), stage.b, stage.a, half)
                }
                _ => ShapeDesc::Mesh(box_mesh(mul(add(foot, top), 0.5), [wide * stage.unit; 3])),
            };
            scene = with(random, &stage, scene, shape);
        }
    }
    for _ in 0..1 + random.below(2) {
        let lamp = overhead(random, &stage);
        scene = lit(random, &stage, scene, lamp);
    }
    let camera = stage.camera(random);
    scene.with_camera(camera)
}

fn crossing(random: &mut Random) -> SceneDesc {
    let (mut scene, stage) = begun(random);
    scene = stage.set(random, scene);
    let lamp = if random.chance(0.5) { overhead(random, &stage) } else { stage.place_light(random) };
    let center = add(lamp.center, mul(random.direction(), lamp.reach * random.between(0.0, 1.2)));
    let size = lamp.reach * random.scale(0.2, 2.0);
    let shape = match random.below(3) {
        0 => box_mesh(center, [0; 3].map(|_| size * random.between(0.3, 1.5))),
        1 => {
            let corners = [0; 3].map(|_| add(center, mul(random.direction(), 2.0 * size)));
            mesh(corners.to_vec(), vec![[0, 1, 2]])
        }
        _ => {
            let (n, normals) = (4 + random.below(10), random.chance(0.4));
            let mut ball = ball_mesh(size, n, random.pick(&[0.0, 0.1, 0.3]), normals, random);
            ball.positions.iter_mut().for_each(|p| *p = add(*p, center));
            ball
        }
    };
    scene = with(random, &stage, scene, ShapeDesc::Mesh(shape));
    scene = lit(random, &stage, scene, lamp);
    let camera = stage.camera(random);
    scene.with_camera(camera)
}

fn shallow(random: &mut Random) -> SceneDesc {
    let (mut scene, stage) = begun(random);
    scene = stage.set(random, scene);
    // Turned out of the floor, or out of a wall, by a little
    let tilt = radians(random.scale(0.2, 25.0));
    let (sin, cos) = pxfm::f_sincos(tilt);
    let (n, along) = random.pick(&[(stage.n, stage.a), (stage.a, stage.n)]);
    let front = add(mul(n, cos * random.pick(&[1.0, -1.0])), mul(along, sin));
    let reach = stage.unit * random.between(0.2, 1.0);
    let center = add(stage.middle, mul(stage.b, random.between(-1.0, 1.0) * stage.unit));
    let center = add(center, mul(n, random.between(-0.8, 0.8) * reach * sin));
    scene = lit(random, &stage, scene, Lamp { center, reach, front });
    if random.chance(0.4) {
        let at = stage.at(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(0.1, 0.5));
        let shape = stage.solid(random, at, 0.3 * stage.unit);
        scene = with(random, &stage, scene, shape);
    }
    let camera = if random.chance(0.5) {
        let away = reach * random.between(1.0, 4.0);
        close_up(random, &stage, center, away)
    } else {
        stage.camera(random)
    };
    scene.with_camera(camera)
}

/// A light over the floor, `height` above it, that lets the camera see below.
fn low_light(random: &mut Random, stage: &Stage, scene: &SceneDesc, height: f64) -> (LightDesc, V, f64) {
    let reach = stage.unit * random.between(0.1, 1.0);
    let foot = stage.at(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 0.0);
    let front = mul(stage.n, -1.0);
    let lamp = Lamp { center: add(foot, mul(stage.n, height * stage.unit)), reach, front };
    let mut light = stage.light(random, scene, lamp);
    match &mut light {
        LightDesc::Rectangle(light) => (light.visible, light.blocks, light.sides) = (false, false, None),
        LightDesc::Disk(light) => (light.visible, light.blocks, light.sides) = (false, false, None),
        LightDesc::Sphere(light) => {
            (light.visible, light.blocks) = (false, false);
            light.center = add(light.center, mul(stage.n, light.radius));
        }
        LightDesc::Point(_) | LightDesc::Directional(_) | LightDesc::Spot(_) => {}
    }
    (light, foot, reach)
}

fn close(random: &mut Random) -> SceneDesc {
    let (mut scene, stage) = begun(random);
    scene = stage.set(random, scene);
    let height = random.scale(1e-6, 1.0);
    let (light, foot, reach) = low_light(random, &stage, &scene, height);
    scene = scene.with_light(light);
    if random.chance(0.5) {
        let at = add(foot, mul(stage.a, reach * random.between(-1.0, 1.0)));
        let size = reach * random.between(0.05, 0.3);
        let shape = stage.solid(random, at, size);
        scene = with(random, &stage, scene, shape);
    }
    let away = reach * random.between(1.0, 5.0);
    let camera = close_up(random, &stage, foot, away);
    scene.with_camera(camera)
}

fn specks(random: &mut Random) -> SceneDesc {
    let (mut scene, stage) = begun(random);
    scene = stage.set(random, scene);
    let (size, height) = (random.scale(1e-4, 0.02), random.scale(1e-3, 1.0));
    let (light, foot, reach) = low_light(random, &stage, &scene, height);
    scene = scene.with_light(light);
    let around = reach.min(20.0 * size * stage.unit);
    for _ in 0..1 + random.below(6) {
        let off = add(mul(stage.a, random.between(-1.0, 1.0)), mul(stage.b, random.between(-1.0, 1.0)));
        // At contact, a hair above it, or anywhere up to the light
        let r = size * stage.unit * random.scale(0.2, 1.0);
        let up = match random.below(3) {
            0 => r,
            1 => r * random.between(0.2, 1.1),
            _ => height * stage.unit * random.unit(),
        };
        let center = add(add(foot, mul(off, around)), mul(stage.n, up));
        let shape = match random.below(4) {
            0 => ShapeDesc::Box(BoxDesc { size: [2.0 * r; 3], ..BoxDesc::new(center) }),
            1 => stage.plate(center, stage.n, stage.a, [r, r * random.between(0.2, 1.0)]),
            _ => ShapeDesc::Sphere(sphere(center, r)),
        };
        scene = with(random, &stage, scene, shape);
    }
    let away = around * random.between(1.5, 6.0);
    let camera = close_up(random, &stage, foot, away);
    scene.with_camera(camera)
}

fn hard(random: &mut Random) -> SceneDesc {
    let (mut scene, stage) = begun(random);
    scene.render.antialiasing = random.pick(&[2, 3, 4]);
    scene = stage.set(random, scene);
    for _ in 0..1 + random.below(3) {
        let at = stage.at(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(0.0, 1.5));
        let size = stage.unit * random.between(0.1, 0.8);
        let shape = if random.chance(0.3) { stage.hollow(random) } else { stage.solid(random, at, size) };
        scene = with(random, &stage, scene, shape);
    }
    for _ in 0..1 + random.below(2) {
        let light = stage.small_light(random);
        scene = scene.with_light(light);
    }
    let camera = stage.camera(random);
    scene.with_camera(camera)
}

fn rims(random: &mut Random) -> SceneDesc {
    let (mut scene, stage) = begun(random);
    scene = stage.set(random, scene);
    let texture = ColorParam { texture: Some("rims".into()), ..ColorParam::gray(1.0) };
    let specular = if random.chance(0.5) { ColorParam::gray(0.0) } else { texture.clone() };
    let board = checkers(random);
    scene = scene.with_texture("rims", board);
    scene = scene.with_material("rims", phong(texture, specular, random.scale(2.0, 200.0)));
    for _ in 0..1 + random.below(5) {
        let at = stage.at(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(0.0, 1.0));
        let (n, size) = (random.direction(), stage.unit * random.scale(0.02, 1.0));
        let mut shape = match random.below(4) {
            0 => ShapeDesc::Disk(DiskDesc { normal: n, ..DiskDesc::new(at, size) }),
            1 => ShapeDesc::Box(BoxDesc { size: [size, 0.5 * size, size], ..BoxDesc::new(at) }),
            _ => stage.plate(at, n, across(n)[0], [size, size * random.scale(0.1, 1.0)]),
        };
        *common(&mut shape).material = Some("rims".into());
        scene = scene.with_shape(shape);
    }
    let lamp = overhead(random, &stage);
    scene = lit(random, &stage, scene, lamp);
    let camera = stage.camera(random);
    scene.with_camera(camera)
}
