use firstlight_testkit::Random;

use super::super::bounds::{EmissionProfile, ReceiverBounds};
use super::super::{
    Falloff, Light, LightDesc, LightSample, PointDesc, RectangleDesc, SampleSet, SphereLightDesc, SpotDesc,
};
use super::*;
use crate::context::CompileContext;
use crate::describe::{ColorDesc, SamplesDesc};
use crate::material::{BlinnPhongLobe, Bsdf, Lobe, PhongLobe};
use crate::math::{Arc, DirectionCone, ErrorBound};

fn direction(random: &mut Random) -> Vec3 {
    DVec3::from(random.direction()).as_vec3()
}

fn compiled(desc: &LightDesc) -> Light {
    let cx = &mut CompileContext::default();
    let light = desc.compile(cx, SamplesDesc::Exact);
    assert!(!cx.has_errors());
    light
}

/// Some lights of one kind in a ball.
fn lights(random: &mut Random, kind: u32, count: u32, size: f64) -> Vec<Light> {
    let falloff = if kind.is_multiple_of(2) { Falloff::Physical } else { Falloff::Constant };
    let (front, wild) = (direction(random).as_dvec3(), random.between(0.0, 1.0));
    (0..count)
        .map(|_| {
            let at = (direction(random).as_dvec3() * size * random.unit()).to_array();
            let color = ColorDesc::linear(random.unit(), random.unit(), random.unit());
            let aim = (front + direction(random).as_dvec3() * wild).normalize();
            let reach = size * random.between(0.001, 0.2);
            let desc = match kind / 2 {
                0 => LightDesc::Point(PointDesc { color, falloff, ..PointDesc::new(at) }),
                1 => LightDesc::Spot(SpotDesc {
                    look_at: (DVec3::from(at) + aim).to_array(),
                    cone_deg: random.between(1.0, 180.0),
                    inner_cone_deg: Some(0.5),
                    color,
                    falloff,
                    ..SpotDesc::new(at)
                }),
                2 => LightDesc::Sphere(SphereLightDesc { color, falloff, ..SphereLightDesc::new(at, reach) }),
                _ => {
                    let side = aim.any_orthonormal_vector();
                    let (e0, e1) = (side * reach, aim.cross(side) * reach);
                    LightDesc::Rectangle(RectangleDesc {
                        color,
                        falloff,
                        ..RectangleDesc::with_edges(at, e0.to_array(), e1.to_array())
                    })
                }
            };
            compiled(&desc)
        })
        .collect()
}

fn lobe(random: &mut Random) -> Lobe {
    let shininess = (random.between(0.0, 5.0) * random.between(0.0, 5.0) * random.between(1.0, 20.0)) as f32;
    match (random.unit() * 3.0) as u32 {
        0 => Lobe::None,
        1 => Lobe::Phong(PhongLobe::new(shininess)),
        _ => Lobe::BlinnPhong(BlinnPhongLobe::new(shininess)),
    }
}

/// What one light sends, point by point of it: the definition.
fn truth(light: &Light, p: Vec3, ns: Vec3, wo: Vec3, lobe: &Lobe) -> [[f64; 3]; 2] {
    let area = light.area();
    let count = if area.is_some() { 1024 } else { 1 };
    let mut sums = [0.0f64; 2];
    for k in 0..count {
        let (l, sample) = match area {
            Some(area) => {
                let uv = SampleSet::Sobol.point(k, count, 0);
                let (l, inverse_distance, weight) = area.at(uv, p);
                (l, Some(LightSample { inverse_distance, weight }))
            }
            None => {
                let l = light.towards(0, p).l;
                (l, light.sample(0, l))
            }
        };
        let height = ns.dot(l);
        let Some(sample) = sample.filter(|_| height > 0.0) else { continue };
        let cos_i = height * sample.inverse_distance;
        sums[0] += f64::from(cos_i * sample.weight);
        let specular = lobe.eval(cos_i, ns.dot(wo), wo.dot(l) * sample.inverse_distance).0[1];
        sums[1] += f64::from(specular * sample.weight);
    }
    let measure = area.filter(|area| area.physical).map_or(1.0, |area| area.shape.measure());
    let own = sums.map(|sum| sum * measure / f64::from(count));
    own.map(|sum| light.intensity.to_array().map(|c| f64::from(c) * sum))
}

#[test]
fn no_bound_is_broken() {
    let random = &mut Random::new(5);
    let (mut smooth, mut told) = (0, 0);
    for round in 0..600 {
        let kind = round % 8;
        let size = random.between(0.01, 1.0);
        let some = 1 + (random.unit() * 8.0) as u32;
        let lights = lights(random, kind, some, size);
        let tree = LightTree::new(&lights, &vec![0; lights.len()]);
        // Receivers somewhere around
        let distance = random.between(0.3, 8.0) as f32;
        let center = direction(random) * distance;
        let n = direction(random);
        let n = if n.dot(center) > 0.0 { -n } else { n };
        let reach = random.between(0.0, 0.3) as f32 * random.unit() as f32;
        let turn = random.between(0.0, 0.4) as f32 * random.unit() as f32;
        let wo = (n + direction(random) * 0.9).normalize();
        let mirror = n * (2.0 * n.dot(wo)) - wo;
        let lobe = lobe(random);
        let cone = |axis: Vec3, chord: f32| DirectionCone { axis, angle: Arc::of_chord(chord) };
        let receivers = ReceiverBounds {
            center,
            radius: reach,
            normals: cone(n, turn),
            mirrors: cone(mirror, 3.0 * turn),
            wo: cone(wo, turn),
            lobe,
            is_bumpy: false,
        };
        for _ in 0..4 {
            let p = center + direction(random) * (reach * random.unit() as f32);
            let ns = (n + direction(random) * (turn * 0.4)).normalize();
            let wo = (wo + direction(random) * (turn * 0.4)).normalize();
            if ns.dot(wo) <= 0.0 {
                continue;
            }
            let bsdf = Bsdf { colors: Colors::BLACK, ambient: Rgb::BLACK, lobe };
            let point = ShadingPoint::new(p, ErrorBound(Vec3::ZERO), ns, wo, &bsdf);
            for node in &tree.nodes {
                let bounds = node.bounds.contribution(&receivers);
                let mut held = Vec::new();
                let mut open = vec![node.contents];
                while let Some(one) = open.pop() {
                    match one {
                        NodeContents::Light(light) => held.push(light),
                        NodeContents::Children(two) => open.extend(two.map(|node| tree.nodes[node as usize].contents)),
                    }
                }
                let mut sum = [[0.0f64; 3]; 2];
                for light in held {
                    let one = truth(&lights[light as usize], p, ns, wo, &lobe);
                    for (sum, one) in sum.iter_mut().flatten().zip(one.iter().flatten()) {
                        *sum += one;
                    }
                }
                let flat = |sent: Colors| sent.0.map(|color| color.to_array().map(f64::from));
                let most = flat(node.max_contribution(&bounds));
                for (sum, most) in sum.iter().flatten().zip(most.iter().flatten()) {
                    assert!(*sum <= most * 1.001 + 1e-12, "{round}: {sum} is more than {most}, {node:?}");
                }
                if !(bounds.is_smooth) || bounds.max_weight == 0.0 {
                    continue;
                }
                smooth += 1;
                let (sent, error) = (flat(node.estimate(&point)), flat(node.error(&bounds)));
                let power = f64::from(node.power.r + node.power.g + node.power.b);
                for ((sum, sent), (error, most)) in sum
                    .iter()
                    .flatten()
                    .zip(sent.iter().flatten())
                    .zip(error.iter().flatten().zip(most.iter().flatten()))
                {
                    told += u32::from(*error < 0.1 * most);
                    // The points that stand for the truth are few
                    let noise = if kind >= 4 { 5e-3 * sum } else { 3e-4 * sum } + 1e-8 * power;
                    assert!(
                        (sum - sent).abs() <= error + noise,
                        "{round}: {sent} is not {sum}, by more than {error}, {node:?}"
                    );
                }
                assert!(f64::from(bounds.min_diffuse) <= f64::from(bounds.max_diffuse));
            }
        }
    }
    assert!(smooth > 1000 && told > 2000, "{smooth} {told}");
}

#[test]
fn lights_are_all_there_once() {
    let random = &mut Random::new(9);
    let mut all = Vec::new();
    for kind in 0..8 {
        all.extend(lights(random, kind, 50, 1.0));
    }
    let tree = LightTree::new(&all, &vec![0; all.len()]);
    let mut seen = vec![0; all.len()];
    let mut open = tree.roots.clone();
    while let Some(node) = open.pop() {
        match tree.nodes[node as usize].contents {
            NodeContents::Light(light) => seen[light as usize] += 1,
            NodeContents::Children(two) => open.extend(two),
        }
    }
    assert!(seen.iter().all(|times| *times == 1));
    assert!(tree.nodes.iter().any(|node| node.bounds.profile == EmissionProfile::Cosine && node.count > 1));
}

#[test]
fn third_derivatives_are_bounded() {
    // Along all lines through points at distance 1, by differences in f64
    let random = &mut Random::new(3);
    let mut most = [0.0f64; 3];
    for _ in 0..20000 {
        let [l, n, m, u] = [0; 4].map(|_| direction(random).as_dvec3());
        let kernels: [&dyn Fn(DVec3) -> f64; 3] = [
            &|l| n.dot(l) / (l.length_squared() * l.length()),
            &|l| n.dot(l) * m.dot(l) / (l.length_squared() * l.length_squared()),
            &|l| n.dot(l) / l.length(),
        ];
        let h = 1e-3;
        for (most, f) in most.iter_mut().zip(kernels) {
            let third =
                (f(l + u * 2.0 * h) - 2.0 * f(l + u * h) + 2.0 * f(l - u * h) - f(l - u * 2.0 * h)) / (2.0 * h * h * h);
            *most = most.max(third.abs());
        }
    }
    assert!(
        most[0] <= f64::from(MAX_THIRD_DERIVATIVE)
            && most[1] <= f64::from(MAX_THIRD_DERIVATIVE)
            && most[2] <= f64::from(MAX_THIRD_DERIVATIVE_OF_COS),
        "{most:?}"
    );
    assert!(most[0] > 20.0, "{most:?}");
}

#[test]
fn a_sphere_is_its_shape() {
    let light = compiled(&LightDesc::Sphere(SphereLightDesc::new([0.0; 3], 0.5)));
    assert!(light.area().is_some_and(|area| area.shape.is_ball()));
    let (bounds, strength) = LightBounds::of(&light);
    assert_eq!(bounds.profile, EmissionProfile::Isotropic);
    assert!((strength - std::f32::consts::PI * 0.25).abs() < 1e-6);
}
