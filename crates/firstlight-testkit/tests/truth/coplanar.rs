//! Surfaces in one plane, and lights in the plane of their wall: neither takes light from the other.
//!
//! Each scene is rendered twice, with and without the shadows of what lies in a plane: the pictures are the same. As
//! described, and moved, turned and scaled by a matrix, so that nothing stays where digits end.

use firstlight::{
    Buffer, DVec3, Image, LightId, LightPart, NoAssets, RenderSettings, SampleSet, Scene, SceneDesc, Vec3,
};

use crate::buffers::{film, floats};
use crate::converged::{displayed, exact, traced, with_samples};
use crate::scenes::*;

/// Where a scene is put: how large it is, where to, and three axes.
struct Pose {
    scale: f64,
    to: V,
    axes: [V; 3],
}

impl Pose {
    const HERE: Pose = Pose { scale: 1.0, to: [0.0; 3], axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };

    fn random(random: &mut Random) -> Pose {
        let scale = random.scale(1e-3, 1e3);
        let y = random.direction();
        let [x, z] = across(y);
        Pose { scale, to: mul(random.vector(8.0), scale), axes: [x, y, z] }
    }

    /// The field that puts a thing there.
    fn field(&self) -> String {
        let row = |k: usize| {
            format!(
                "{:?}, {:?}, {:?}, {:?}",
                self.axes[0][k] * self.scale,
                self.axes[1][k] * self.scale,
                self.axes[2][k] * self.scale,
                self.to[k]
            )
        };
        format!("transform = {{ matrix = [{}, {}, {}] }}\n", row(0), row(1), row(2))
    }

    fn point(&self, p: V) -> V {
        let turned = (0..3).fold([0.0; 3], |sum, k| add(sum, mul(self.axes[k], p[k])));
        add(mul(turned, self.scale), self.to)
    }
}

/// Kinds of shapes with a flat face.
const KINDS: [&str; 12] = [
    "plane",
    "parallelogram",
    "disk",
    "ring",
    "cylinder",
    "cone",
    "box",
    "mesh",
    "fan",
    "mesh box",
    "instance",
    "tiles",
];

/// A shape whose face at height `y` faces up or down, and reaches `size` from (x, z); `rest` is said of it too. Meshes
/// are described where they are, as files have them; `number` keeps names of groups apart.
#[allow(clippy::too_many_arguments, reason = "a face, where it is, and what is said of it")]
fn flat(kind: &str, pose: &Pose, [x, z]: [f64; 2], y: f64, up: f64, size: f64, rest: &str, number: u32) -> String {
    let (below, depth) = (y - up * 0.3, 0.3);
    let at = |p: V| {
        let [x, y, z] = pose.point(p);
        format!("[{x:?}, {y:?}, {z:?}]")
    };
    let mesh = |positions: &[V], triangles: &[[usize; 3]]| {
        let positions: Vec<String> = positions.iter().map(|p| at(*p)).collect();
        format!("positions = [{}]\ntriangles = {triangles:?}\n{rest}", positions.join(", "))
    };
    let square =
        |y: f64| [[x - size, y, z - size], [x + size, y, z - size], [x + size, y, z + size], [x - size, y, z + size]];
    let solid = format!("{}{rest}", pose.field());
    match kind {
        "plane" => format!("[[plane]]\npoint = [{x}, {y}, {z}]\nnormal = [0, {up}, 0]\n{solid}"),
        "parallelogram" => {
            let [p, s] = [[x - size, y, z - size], [2.0 * size; 3]];
            format!("[[parallelogram]]\np = {p:?}\ne0 = [{}, 0, 0]\ne1 = [0, 0, {}]\n{solid}", s[0], s[2])
        }
        "disk" => format!("[[disk]]\ncenter = [{x}, {y}, {z}]\nnormal = [0, {up}, 0]\nradius = {size}\n{solid}"),
        "ring" => format!("[[disk]]\ncenter = [{x}, {y}, {z}]\nradius = {size}\ninner_radius = 0.1\n{solid}"),
        "cylinder" => {
            format!("[[cylinder]]\np0 = [{x}, {below:?}, {z}]\np1 = [{x}, {y:?}, {z}]\nradius = {size}\n{solid}")
        }
        "cone" => format!(
            "[[cone]]\np0 = [{x}, {y:?}, {z}]\np1 = [{x}, {below:?}, {z}]\nradius0 = {size}\nradius1 = 0\n{solid}"
        ),
        "box" => {
            let middle = y - up * 0.5 * depth;
            format!(
                "[[box]]\ncenter = [{x}, {middle:?}, {z}]\nsize = [{}, {depth}, {}]\n{solid}",
                2.0 * size,
                2.0 * size
            )
        }
        "mesh" => format!("[[mesh]]\n{}", mesh(&square(y), &[[0, 1, 2], [0, 2, 3]])),
        "fan" => {
            let rim = |k: usize| {
                let (sin, cos) = pxfm::f_sincos(radians(k as f64 * 0.5));
                [x + size * cos, y, z + size * sin]
            };
            let positions: Vec<V> = std::iter::once([x, y, z]).chain((0..720).map(rim)).collect();
            let triangles: Vec<[usize; 3]> = (0..720).map(|k| [0, 1 + k, 1 + (k + 1) % 720]).collect();
            format!("[[mesh]]\n{}", mesh(&positions, &triangles))
        }
        "mesh box" => {
            let sides = (0..4).flat_map(|i| {
                let j = (i + 1) % 4;
                [[i, j, 4 + j], [i, 4 + j, 4 + i]]
            });
            let triangles: Vec<[usize; 3]> =
                [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]].into_iter().chain(sides).collect();
            format!("[[mesh]]\n{}", mesh(&[square(y), square(below)].concat(), &triangles))
        }
        "instance" => {
            let here = |p: &V| format!("{p:?}");
            let positions: Vec<String> = square(y).iter().map(here).collect();
            let group = format!(
                "[[group.g{number}.mesh]]\npositions = [{}]\ntriangles = [[0, 1, 2], [0, 2, 3]]\n",
                positions.join(", ")
            );
            format!("{group}[[instance]]\nof = \"g{number}\"\n{solid}")
        }
        "tiles" => {
            let place = |i: usize| -1.0 + 0.25 * i as f64;
            let positions: Vec<V> = (0..81).map(|i| [x + size * place(i / 9), y, z + size * place(i % 9)]).collect();
            let tile = |i: usize| {
                let a = i / 8 * 9 + i % 8;
                [[a, a + 1, a + 10], [a, a + 10, a + 9]]
            };
            let triangles: Vec<[usize; 3]> = (0..64).flat_map(tile).collect();
            format!("[[mesh]]\n{}", mesh(&positions, &triangles))
        }
        _ => unreachable!("{kind}"),
    }
}

/// A light above (x, z), at height `y`; `rest` is said of it too.
fn light(kind: &str, pose: &Pose, [x, z]: [f64; 2], y: f64, size: f64, rest: &str) -> String {
    let field = pose.field();
    let strength = 10.0 * pose.scale * pose.scale;
    let head = |kind: &str| format!("[[light.{kind}]]\n{field}{rest}");
    match kind {
        "rectangle" => {
            format!("{}center = [{x}, {y}, {z}]\nsize = [{}, {}]\nstrength = 10\n", head(kind), 2.0 * size, 2.0 * size)
        }
        "disk" => format!("{}center = [{x}, {y}, {z}]\nradius = {size}\nstrength = 10\n", head(kind)),
        "sphere" => format!("{}center = [{x}, {y}, {z}]\nradius = {size}\nstrength = 10\n", head(kind)),
        "point" => format!("{}position = [{x}, {y}, {z}]\nstrength = {strength:?}\n", head(kind)),
        "spot" => format!(
            "{}position = [{x}, {y}, {z}]\nlook_at = [0, 0, 0]\ncone_deg = 120\nstrength = {strength:?}\n",
            head(kind)
        ),
        "directional" => format!("{}direction = [{}, {}, {}]\nstrength = 3\n", head(kind), -x, -y, -z),
        _ => unreachable!("{kind}"),
    }
}

fn camera_at(pose: &Pose, eye: V, at: V, size: u32) -> String {
    format!(
        "[render]\nwidth = {size}\nheight = {size}\nantialiasing = 2\n[camera]\nposition = {eye:?}\nlook_at = {at:?}\n\
         up = [0, 0.1, 1]\nfov_y_deg = 50\n{}",
        pose.field()
    )
}

fn compiled(text: &str) -> Scene {
    let parsed = SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets);
    assert!(parsed.faults().is_empty(), "{:?}\n{text}", parsed.faults());
    compile(&parsed.desc)
}

/// The pictures of a scene by three renderers: lights integrated, sampled by the fast one, and by the plain one.
fn pictures(text: &str) -> [(&'static str, Image); 3] {
    let parsed = SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets);
    assert!(parsed.faults().is_empty(), "{:?}\n{text}", parsed.faults());
    let sampled = compile(&with_samples(&parsed.desc, 64, SampleSet::Sobol, 1));
    let plain = RenderSettings { reference: true, ..traced() };
    [
        ("integrated", exact(&parsed.desc)),
        ("sampled", picture(&sampled, &traced())),
        ("plain", picture(&sampled, &plain)),
    ]
}

/// By how many display steps two pictures differ at most, and how bright the second is in the mean.
fn apart(scene: &Scene, one: &Image, other: &Image) -> (f64, f64) {
    let shown =
        |image: &Image| -> Vec<[f64; 3]> { image.pixels.iter().map(|pixel| displayed(scene, *pixel)).collect() };
    let (a, b) = (shown(one), shown(other));
    let worst = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    (worst, b.iter().flatten().sum::<f64>() / (3 * b.len()) as f64)
}

/// That a scene is the same without the shadows of what is said with `shadows`.
fn is_the_same_without(what: &str, text: &str) {
    let [with, without] = ["true", "false"].map(|casts| pictures(&text.replace("SHADOWS", casts)));
    let scene = compiled(&text.replace("SHADOWS", "true"));
    for ((how, with), (_, without)) in with.iter().zip(&without) {
        let (worst, mean) = apart(&scene, with, without);
        assert!(mean > 4.0, "{what}, {how}: it is dark anyway\n{text}");
        let allowed = if *how == "integrated" { 1.0 } else { 1e-4 };
        assert!(worst <= allowed, "{what}, {how}: {worst} steps\n{text}");
    }
    assert_eq!(bits(&with[1].1), bits(&with[2].1), "{what}: the two renderers differ\n{text}");
}

fn poses(random: &mut Random) -> [Pose; 3] {
    [Pose::HERE, Pose::random(random), Pose::random(random)]
}

const SHADOWS: &str = "casts_shadow = SHADOWS\n";

#[test]
fn a_light_in_the_plane_of_its_wall_is_not_hidden_by_it() {
    let random = &mut Random::new(1);
    for (number, pose) in poses(random).iter().enumerate() {
        for kind in KINDS {
            for of in ["rectangle", "disk"] {
                let falloff = if random.chance(0.5) { "falloff = \"constant\"\n" } else { "" };
                let text = [
                    camera_at(pose, [0.0, 1.0, 4.0], [0.0, 0.5, 0.0], 8),
                    flat("parallelogram", pose, [0.0; 2], 0.0, 1.0, 3.0, "", 0),
                    flat(kind, pose, [0.0; 2], 2.0, -1.0, 1.2, SHADOWS, 1),
                    light(of, pose, [0.0; 2], 2.0, 0.5, falloff),
                ];
                is_the_same_without(&format!("a {of} in a {kind}, pose {number}"), &text.concat());
            }
        }
    }
}

#[test]
fn of_two_surfaces_in_one_plane_neither_shadows_the_other() {
    let random = &mut Random::new(2);
    let lights = ["directional", "point", "spot", "rectangle", "disk", "sphere"];
    for (number, pose) in poses(random).iter().enumerate() {
        for floor in KINDS {
            for coin in KINDS {
                // Every pair under half of the lights, over the three poses
                let of = random.pick(&lights);
                let text = [
                    camera_at(pose, [0.0, 3.0, 0.01], [0.0, 0.0, 0.0], 6),
                    flat(floor, pose, [0.2, 0.1], 0.0, 1.0, 1.5, SHADOWS, 0),
                    flat(coin, pose, [0.0; 2], 0.0, 1.0, 0.6, SHADOWS, 1),
                    light(of, pose, [1.0, 2.0], 2.5, 0.3, ""),
                ];
                is_the_same_without(&format!("a {coin} in a {floor} under a {of}, pose {number}"), &text.concat());
            }
        }
    }
}

#[test]
fn the_visibility_of_a_light_in_its_wall_is_1() {
    let buffers = [LightPart::Visibility, LightPart::Unshadowed].map(|part| Buffer::Light(LightId(0), Some(part)));
    for kind in KINDS {
        let text = [
            camera_at(&Pose::HERE, [0.0, 1.0, 6.0], [0.0, -0.6, 0.0], 28),
            flat("parallelogram", &Pose::HERE, [0.0; 2], -1.0, 1.0, 15.0, "", 0),
            flat(kind, &Pose::HERE, [0.0; 2], 2.0, -1.0, 2.0, "", 1),
            light("rectangle", &Pose::HERE, [0.0; 2], 2.0, 0.5, ""),
        ];
        let parsed = SceneDesc::parse("s.toml", text.concat().as_bytes(), &NoAssets);
        assert!(parsed.faults().is_empty(), "{:?}", parsed.faults());
        // Where lights are integrated, a pixel may be off by a display step: by this part of what is seen here
        let ways = [
            ("integrated", parsed.desc.clone(), RenderSettings::default(), 1.2e-2),
            ("sampled", with_samples(&parsed.desc, 1024, SampleSet::Sobol, 1), traced(), 1e-3),
        ];
        for (how, desc, settings, allowed) in ways {
            let film = film(&compile(&desc), &RenderSettings { buffers: buffers.to_vec(), ..settings });
            let arrives = floats(&film, buffers[1]).chunks(3).map(|rgb| rgb[1]);
            let lit = floats(&film, buffers[0]).iter().zip(arrives).filter(|(_, arrives)| *arrives > 0.1);
            let least = lit.clone().fold(1.0f32, |least, (seen, _)| least.min(*seen));
            assert!(lit.count() > 100, "{kind}, {how}: it is dark");
            assert!(least >= 1.0 - allowed, "{kind}, {how}: {least}");
        }
    }
}

#[test]
fn what_stands_in_a_lights_way_still_does() {
    // Just before the light, in a housing that bears it; and from behind, through the housing
    for kind in ["plane", "box", "cylinder", "mesh", "mesh box", "instance", "fan"] {
        let pose = &Pose::HERE;
        let lit = |height: f64, eye: V, sides: &str| {
            let text = [
                camera_at(pose, eye, [0.0, eye[1] - eye[1].signum(), 0.0], 4),
                flat("parallelogram", pose, [0.0; 2], if eye[1] > 2.0 { 4.0 } else { 0.0 }, 1.0, 3.0, "", 0),
                flat(kind, pose, [0.0; 2], height, -1.0, 2.0, "", 1),
                light("rectangle", pose, [0.0; 2], 2.0, 0.5, sides),
            ];
            pictures(&text.concat()).map(|(_, image)| image.pixels.iter().fold(0.0f32, |most, p| most.max(p[0])))
        };
        let (below, above) = ([0.0, 1.0, 0.3], [0.0, 3.0, 0.3]);
        assert!(lit(2.0, below, "").iter().all(|most| *most > 0.05), "{kind}");
        // A hundredth of a millimetre below the light it is before it
        assert_eq!(lit(1.9999, below, ""), [0.0; 3], "{kind}");
        // Above a both-sided light the housing is in the way of what looks down on it
        if kind != "mesh" && kind != "instance" && kind != "plane" && kind != "fan" {
            assert_eq!(lit(2.0, above, "sides = \"both\"\n"), [0.0; 3], "{kind}");
        }
    }
}

#[test]
fn a_flat_fan_sees_all_of_a_light() {
    for triangles in [2000, 5000] {
        let rim = |k: usize| {
            let (sin, cos) = pxfm::f_sincos(2.0 * std::f64::consts::PI * k as f64 / triangles as f64);
            [cos, 0.0, sin]
        };
        let random = &mut Random::new(3);
        for round in 0..4 {
            let pose = if round == 0 { Pose::HERE } else { Pose::random(random) };
            let positions: Vec<V> =
                std::iter::once([0.0; 3]).chain((0..triangles).map(rim)).map(|p| pose.point(p)).collect();
            let faces: Vec<[usize; 3]> = (0..triangles).map(|k| [0, 1 + (k + 1) % triangles, 1 + k]).collect();
            let text = [
                camera_at(&pose, [0.0, 3.0, 0.0], [0.0; 3], 16),
                format!("[[mesh]]\npositions = {positions:?}\ntriangles = {faces:?}\n"),
                light("point", &pose, [0.3, 0.2], 0.7, 0.0, ""),
                light("rectangle", &pose, [0.5, 0.5], 1.0, 0.5, ""),
            ];
            let scene = compiled(&text.concat());
            let n = DVec3::from(pose.axes[1]).as_vec3();
            let near = |k: usize| {
                // From the hub, where all slivers meet, to the rim
                let (sin, cos) = pxfm::f_sincos(k as f64);
                DVec3::from(pose.point(mul([cos, 0.0, sin], 0.99 / (1.0 + k as f64 * k as f64))))
            };
            for light in scene.lights() {
                let seen = scene.visible_fractions(light, 60, |k| (near(k), Some(n)));
                assert_eq!(seen, [1.0; 60], "{triangles} triangles, round {round}, light {light:?}");
            }
        }
    }
}

#[test]
fn visible_fractions_and_many_lights_know_lights_in_walls() {
    // A ceiling of lamps: more than are told one by one
    let lamps: String = (0..25)
        .map(|k| {
            let (x, z) = (f64::from(k % 5) - 2.0, f64::from(k / 5) - 2.0);
            format!("[[light.rectangle]]\ncenter = [{x}, 2, {z}]\nsize = [0.4, 0.4]\nstrength = 3\n")
        })
        .collect();
    for kind in KINDS {
        let pose = &Pose::HERE;
        let text = [
            camera_at(pose, [0.0, 1.0, 4.0], [0.0, 0.5, 0.0], 8),
            flat("parallelogram", pose, [0.0; 2], 0.0, 1.0, 3.0, "", 0),
            flat(kind, pose, [0.0; 2], 2.0, -1.0, 3.5, SHADOWS, 1),
            lamps.clone(),
        ];
        let text = text.concat();
        is_the_same_without(&format!("25 lamps in a {kind}"), &text);
        let scene = compiled(&text.replace("SHADOWS", "true"));
        for light in [0, 12, 24].map(LightId) {
            let seen =
                scene.visible_fractions(light, 9, |k| (DVec3::new(k as f64 * 0.3 - 1.0, 0.0, 0.7), Some(Vec3::Y)));
            assert_eq!(seen, [1.0; 9], "lamp {light:?} in a {kind}");
        }
    }
}

#[test]
fn renderers_agree_right_below_the_plane_of_a_light() {
    // Balls in a tree and in a list, plates and a mesh stand between; rays to the light are all but parallel to it
    let random = &mut Random::new(5);
    for (count, depth) in [(8, 1e-4), (60, 1e-4), (60, 1e-5), (60, 1e-2)] {
        let pose = &Pose::HERE;
        let mut text = camera_at(pose, [0.0, 4.0, 0.01], [0.0, 2.0, 0.0], 16);
        text += &flat("parallelogram", pose, [0.0; 2], 2.0 - depth, 1.0, 3.0, "", 0);
        for _ in 0..count {
            let [x, y, z] = random.vector(1.0);
            text +=
                &format!("[[sphere]]\ncenter = [{:?}, {:?}, {:?}]\nradius = 0.1\n", 2.0 * x, 2.0 + 0.1 * y, 2.0 * z);
        }
        text += &flat("box", pose, [1.2, 0.3], 2.1, 1.0, 0.1, "", 1);
        text += &flat("mesh box", pose, [-1.1, 0.6], 2.1, 1.0, 0.1, "", 2);
        text += &light("rectangle", pose, [0.0; 2], 2.0, 0.5, "sides = \"both\"\nvisible = false\n");
        let [_, (_, fast), (_, plain)] = pictures(&text);
        assert_eq!(bits(&fast), bits(&plain), "{count} balls, {depth} m");
        assert!(fast.pixels.iter().any(|pixel| pixel[0] > 0.0), "{count} balls, {depth} m: all is dark");
    }
}
