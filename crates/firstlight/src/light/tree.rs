//! A tree over the lights of a scene. A node knows what its lights send together, and how far it can be wrong to take
//! them for one.
//!
//! The lights of a node are taken for one that stands, for each channel of colour, in the middle of their power, and
//! how they are spread around it is counted to the second order of Taylor's series. What diffuse light differs from
//! that is of the third: a sixth of the power-weighted sum of the cubes of their distances from the middle, times the
//! largest third derivative between them. Of the light of a point, cos / d^2, and that of a flat light, cos cos' / d^2,
//! no third derivative is above 24 / d^5; of cos alone, none is above 4 / d^3. Highlights are counted to the first
//! order.
//!
//! Nothing here depends on the camera: what a node stands for is settled when the tree is built.

use super::bound::{MOST, Sends, Shine, ZoneSight};
use super::{AreaShape, Light, LightKind};
use crate::color::Rgb;
use crate::material::{Colors, Lobe, Moments};
use crate::math::{DVec3, Vec3};

/// Up to so many lights are all evaluated at every point; a scene with more has a light tree.
pub(crate) const FEW_LIGHTS: usize = 16;

/// All lights of a scene, in a tree for each way of sending light.
#[derive(Debug)]
pub(crate) struct LightTree {
    pub nodes: Vec<LightNode>,
    pub roots: Vec<u32>,
}

/// Lights that are near each other, or one.
#[derive(Clone, Debug)]
pub(crate) struct LightNode {
    pub shine: Shine,
    pub held: Held,
    /// How many lights.
    pub count: u32,
    /// The sum of intensity x strength.
    pub power: Rgb,
    /// For each channel, the middle of the power, in metres, world space; of a parallel light its direction.
    middle: [Vec3; 3],
    /// For each channel, the power-weighted mean of the normals, where they send [`Sends::Flat`].
    facing: [Vec3; 3],
    /// Whether all channels have the same `middle` and `facing`.
    gray: bool,
    /// For each channel, the mean of the products of coordinates of the lights from its middle, in square metres,
    /// weighted by power, the lights' own extent included: xx, yy, zz, xy, yz, zx.
    square: [[f32; 6]; 3],
    /// For each channel, the sum of power x distance^2 from its middle, the lights' own extent included.
    spread: Rgb,
    /// The same of distance^3.
    cubes: Rgb,
    /// For each channel, the sum of power x distance x difference from `facing`.
    cross: Rgb,
    /// Whether things can stand in the way of all of them.
    pub shadows: bool,
    /// The node of one of its lights, chosen by chance as their powers are, that can stand for all.
    pub one: u32,
}

/// What a node holds.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Held {
    /// One light, by its index.
    Light(u32),
    /// Two nodes.
    Two([u32; 2]),
}

/// What arrives of a node, in colour, before the colours of the surface: diffuse and specular.
pub(crate) type Sent = Colors;

/// No second derivative of 1 / d^2 is above this over d^4, nor one of cos' / d^2.
const CURVE: f32 = 6.0;
/// No third derivative of cos / d^2 is above this over d^5, nor one of cos cos' / d^2.
const TWIST: f32 = 24.0;
/// Nor one of cos above this over d^3.
const TWIST_EVEN: f32 = 4.0;

/// One light while the tree is built.
struct Seed {
    light: u32,
    shine: Shine,
    center: Vec3,
    order: (u32, u8),
}

impl LightTree {
    /// `classes` has the link class of each light. All lights of a node have the same class, so that a surface receives
    /// light from all of them or from none.
    pub fn new(lights: &[Light], classes: &[u32]) -> LightTree {
        let mut seeds: Vec<Seed> = lights
            .iter()
            .enumerate()
            .map(|(index, light)| {
                let (shine, _) = Shine::of(light);
                let kind = shine.sends as u8 * 2 + u8::from(light.shadows);
                let order = (classes[index], kind * 2 + u8::from(shine.constant));
                Seed { light: index as u32, center: shine.ball().0, order, shine }
            })
            .collect();
        seeds.sort_by_key(|seed| seed.order);
        let mut tree = LightTree { nodes: Vec::with_capacity(2 * lights.len()), roots: Vec::new() };
        for same in seeds.chunk_by_mut(|a, b| a.order == b.order) {
            if same[0].shine.sends == Sends::Parallel {
                for seed in same {
                    let root = tree.grow(lights, std::slice::from_mut(seed)).0;
                    tree.roots.push(root);
                }
            } else {
                let root = tree.grow(lights, same).0;
                tree.roots.push(root);
            }
        }
        tree
    }

    /// Grows the node of some lights, and says which it is and which lights it holds, in its order.
    fn grow(&mut self, lights: &[Light], seeds: &mut [Seed]) -> (u32, Vec<TreeLight>) {
        if let [seed] = seeds {
            let source = TreeLight::of(seed.light, &lights[seed.light as usize], seed.shine);
            let sources = vec![source];
            let held = Held::Light(seed.light);
            let one = self.nodes.len() as u32;
            return (self.push(LightNode { one, ..LightNode::of(seed.shine, held, &sources) }), sources);
        }
        // Halve them where they are farthest apart; where all are at one place, by their order
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) = seeds.iter().fold(none, |(a, b), seed| (a.min(seed.center), b.max(seed.center)));
        let size = high - low;
        let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
        let half = seeds.len() / 2;
        seeds
            .select_nth_unstable_by(half, |a, b| a.center[axis].total_cmp(&b.center[axis]).then(a.light.cmp(&b.light)));
        let (left, right) = seeds.split_at_mut(half);
        let (a, mut sources) = self.grow(lights, left);
        let (b, others) = self.grow(lights, right);
        sources.extend(others);
        let shine = self.nodes[a as usize].shine.union(&self.nodes[b as usize].shine);
        let [left, right] = [a, b].map(|child| &self.nodes[child as usize]);
        let share = |node: &LightNode| f64::from(node.power.r) + f64::from(node.power.g) + f64::from(node.power.b);
        let all = share(left) + share(right);
        let one = if chance(self.nodes.len() as u64) * all < share(left) { left.one } else { right.one };
        let node = LightNode { one, ..LightNode::of(shine, Held::Two([a, b]), &sources) };
        (self.push(node), sources)
    }

    fn push(&mut self, node: LightNode) -> u32 {
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }
}

/// A number from 0 to 1 that looks like chance, the same for the same place.
///
/// Source: Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014: the mixing of
/// SplitMix64.
fn chance(place: u64) -> f64 {
    let mut z = (place + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// One light, as its nodes count it.
#[derive(Clone, Copy)]
struct TreeLight {
    power: Rgb,
    at: Vec3,
    n: Vec3,
    /// The mean of the products of coordinates of its own points, from its middle.
    own: [f64; 6],
    /// How far they are from there, at most.
    reach: f64,
    shadows: bool,
}

impl TreeLight {
    fn of(_: u32, light: &Light, shine: Shine) -> TreeLight {
        let (_, strength) = Shine::of(light);
        let product = |v: DVec3| [v.x * v.x, v.y * v.y, v.z * v.z, v.x * v.y, v.y * v.z, v.z * v.x];
        let sum = |a: DVec3, b: DVec3, factor: f64| {
            let (a, b) = (product(a), product(b));
            std::array::from_fn(|i| (a[i] + b[i]) * factor)
        };
        let (own, reach) = match &light.kind {
            LightKind::Area(area) => match &area.shape {
                AreaShape::Rectangle(r) => (sum(r.e0, r.e1, 1.0 / 12.0), 0.5 * (r.e0.length() + r.e1.length())),
                AreaShape::Disk(disk) => (sum(disk.a, disk.b, 0.25), disk.radius),
                // From outside its light is that of a point
                AreaShape::Sphere(sphere) if area.physical => ([0.0; 6], sphere.radius),
                AreaShape::Sphere(sphere) => {
                    let third = sphere.radius * sphere.radius / 3.0;
                    ([third, third, third, 0.0, 0.0, 0.0], sphere.radius)
                }
            },
            LightKind::Point(_) | LightKind::Directional(_) | LightKind::Spot(_) => ([0.0; 6], 0.0),
        };
        let at = if shine.sends == Sends::Parallel { shine.low } else { shine.ball().0 };
        let power = light.intensity * strength;
        TreeLight { power, at, n: shine.axis, own, reach, shadows: light.shadows }
    }
}

/// The channels of a colour.
fn channels(color: Rgb) -> [f32; 3] {
    [color.r, color.g, color.b]
}

impl LightNode {
    fn of(shine: Shine, held: Held, sources: &[TreeLight]) -> LightNode {
        let (mut middle, mut facing) = ([Vec3::ZERO; 3], [Vec3::ZERO; 3]);
        let (mut power, mut spread, mut cubes, mut cross) = ([0.0f32; 3], [0.0f32; 3], [0.0f32; 3], [0.0f32; 3]);
        let mut square = [[0.0f32; 6]; 3];
        for channel in 0..3 {
            // In f64: a hundred thousand lights far from the origin
            let mut sum = 0.0f64;
            let (mut at, mut n) = (DVec3::ZERO, DVec3::ZERO);
            for source in sources {
                let p = f64::from(channels(source.power)[channel]);
                sum += p;
                at += source.at.as_dvec3() * p;
                n += source.n.as_dvec3() * p;
            }
            if !(sum > 0.0) {
                (middle[channel], facing[channel]) = (sources[0].at, sources[0].n);
                continue;
            }
            (middle[channel], facing[channel]) = ((at / sum).as_vec3(), (n / sum).as_vec3());
            power[channel] = sum as f32;
            let (mut two, mut three, mut c, mut products) = (0.0f64, 0.0f64, 0.0f64, [0.0f64; 6]);
            for source in sources {
                let p = f64::from(channels(source.power)[channel]);
                let v = (source.at - middle[channel]).as_dvec3();
                let own = [v.x * v.x, v.y * v.y, v.z * v.z, v.x * v.y, v.y * v.z, v.z * v.x];
                for i in 0..6 {
                    products[i] += p * (own[i] + source.own[i]);
                }
                let far = v.length() + source.reach;
                two += p * far * far;
                three += p * far * far * far;
                c += p * far * f64::from((source.n - facing[channel]).length());
            }
            square[channel] = products.map(|v| (v / sum) as f32);
            // Positions are rounded
            let rounding = if sources.len() > 1 { f64::from(middle[channel].abs().max_element() * 1e-6) } else { 0.0 };
            spread[channel] = (two * 1.001 + sum * rounding * rounding) as f32;
            cubes[channel] = (three * 1.001 + sum * rounding * rounding * rounding) as f32;
            cross[channel] = if shine.sends == Sends::Flat && sources.len() > 1 { (c * 1.001) as f32 } else { 0.0 };
        }
        // Of one colour: what is left is rounding
        let size = (shine.high - shine.low).length();
        let near = |a: Vec3, b: Vec3, size: f32| (a - b).length() <= size * 1e-6;
        let gray = (1..3)
            .all(|i| power[i] == 0.0 || near(middle[i], middle[0], size) && near(facing[i], facing[0], 1.0))
            && power[0] > 0.0;
        let rgb = |v: [f32; 3]| Rgb::new(v[0], v[1], v[2]);
        LightNode {
            shine,
            held,
            count: sources.len() as u32,
            power: rgb(power),
            middle,
            facing,
            gray,
            square,
            spread: rgb(spread),
            cubes: rgb(cubes),
            cross: rgb(cross),
            shadows: sources.iter().all(|source| source.shadows),
            one: 0,
        }
    }

    /// One of its lights.
    pub fn first(&self, tree: &LightTree) -> u32 {
        let mut held = self.held;
        loop {
            match held {
                Held::Light(light) => return light,
                Held::Two([left, _]) => held = tree.nodes[left as usize].held,
            }
        }
    }

    /// Whether it has no extent.
    pub fn is_point(&self) -> bool {
        self.shine.low == self.shine.high
    }

    /// Whether its lights can be taken for one, where a zone sees them whole.
    pub fn is_smooth(&self) -> bool {
        !matches!(self.shine.sends, Sends::Other)
    }

    /// What its lights send at most, as `sight` says, whatever stands in the way.
    pub fn most(&self, sight: &ZoneSight) -> Sent {
        let cut = |color: Rgb| Rgb::new(color.r.min(MOST), color.g.min(MOST), color.b.min(MOST));
        Moments::bounds(sight.diffuse, sight.weight * sight.highlight.most).colors(|most| cut(self.power * most))
    }

    /// How far what [`send`](Self::send) says can be from what its lights send, where a zone sees all of them whole.
    pub fn error(&self, sight: &ZoneSight) -> Sent {
        if self.spread.is_black() {
            return Sent::BLACK;
        }
        let one = 1.0 / sight.near;
        let two = one * one;
        let glint = sight.highlight;
        let (diffuse, specular, crossed) = if self.shine.constant {
            (TWIST_EVEN / 6.0 * two * one, 0.5 * glint.curve * two, [0.0; 2])
        } else {
            let curve = CURVE * glint.most + 4.0 * glint.slope + glint.curve;
            let crossed = [3.0, 3.0 * glint.most + glint.slope].map(|c| c * two * one);
            (TWIST / 6.0 * two * two * one, 0.5 * curve * two * two, crossed)
        };
        let of = |spread: Rgb, factor: f32, crossed: f32| spread * factor + self.cross * crossed;
        // No number is no bound
        let least = |error: f32, most: f32| if error < most { error } else { most };
        let least = |e: Rgb, m: Rgb| Rgb::new(least(e.r, m.r), least(e.g, m.g), least(e.b, m.b));
        Sent::bounds(of(self.cubes, diffuse, crossed[0]), of(self.spread, specular, crossed[1]))
            .zip(self.most(sight), least)
    }

    /// What its lights, taken for one, send to a place that sees all of them whole.
    #[inline(always)]
    pub fn send(&self, p: Vec3, ns: Vec3, wo: Vec3, lobe: &Lobe) -> Sent {
        let one = |channel: usize| self.send_channel(channel, p, ns, wo, lobe);
        if self.gray {
            return one(0).colors(|sent| self.power * sent);
        }
        let [r, g, b] = [one(0), one(1), one(2)];
        Colors(std::array::from_fn(|i| Rgb::new(self.power.r * r.0[i], self.power.g * g.0[i], self.power.b * b.0[i])))
    }

    #[inline(always)]
    fn send_channel(&self, channel: usize, p: Vec3, ns: Vec3, wo: Vec3, lobe: &Lobe) -> Moments {
        let middle = self.middle[channel];
        let l = if self.shine.sends == Sends::Parallel { middle } else { middle - p };
        let one = 1.0 / l.length().max(f32::MIN_POSITIVE);
        let d = l * one;
        let (cos, facing) = (ns.dot(d), self.facing[channel]);
        // The second derivatives, contracted with how the lights are spread
        let [xx, yy, zz, xy, yz, zx] = self.square[channel];
        let times = |v: Vec3| {
            Vec3::new(xx * v.x + xy * v.y + zx * v.z, xy * v.x + yy * v.y + yz * v.z, zx * v.x + yz * v.y + zz * v.z)
        };
        let (along, trace) = (times(d), xx + yy + zz);
        let (across, deep) = (ns.dot(along), d.dot(along));
        let two = one * one;
        let (weight, diffuse) = match self.shine.sends {
            // cos
            _ if self.shine.constant => (1.0, cos + two * (cos * (1.5 * deep - 0.5 * trace) - across)),
            // cos cos' / d^2
            Sends::Flat => {
                let out = -facing.dot(d);
                let (across_out, both) = (-facing.dot(along), -ns.dot(times(facing)));
                let second = both - 4.0 * (cos * across_out + out * across) + cos * out * (12.0 * deep - 2.0 * trace);
                (out.max(0.0) * two, (cos * out + two * second) * two)
            }
            // cos / d^2
            _ => (two, (cos + two * (cos * (7.5 * deep - 1.5 * trace) - 3.0 * across)) * two),
        };
        lobe.moments_around(diffuse.max(0.0), cos.max(0.0), ns.dot(wo), wo.dot(d), weight)
    }

    /// What arrives of a power of 1 in its middle: diffuse and specular.
    pub fn send_one(&self, p: Vec3, ns: Vec3, wo: Vec3, lobe: &Lobe) -> Moments {
        self.send_channel(0, p, ns, wo, lobe)
    }

    /// What a light of strength 1 in its middle sends, before the cosine at the surface.
    #[inline(always)]
    pub fn weight(&self, p: Vec3) -> f32 {
        if self.shine.constant {
            return 1.0;
        }
        let l = self.middle[0] - p;
        1.0 / l.dot(l).max(f32::MIN_POSITIVE)
    }

    /// How far it is from a place, in metres.
    #[inline(always)]
    pub fn distance(&self, p: Vec3) -> f32 {
        if self.shine.sends == Sends::Parallel { f32::INFINITY } else { (self.middle[0] - p).length() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::bound::Sends;
    use super::super::{
        Area, AreaShape, Falloff, Light, LightDesc, LightSample, PointDesc, RectangleDesc, SampleSet, SphereLightDesc,
        SpotDesc, Zone,
    };
    use super::*;
    use crate::context::CompileContext;
    use crate::describe::{ColorDesc, SamplesDesc};
    use crate::material::{BlinnPhongLobe, PhongLobe};
    use crate::math::Arc;

    /// The same numbers for the same seed.
    struct Random(firstlight_testkit::Random);

    impl Random {
        fn new(seed: u64) -> Self {
            Random(firstlight_testkit::Random::new(seed))
        }

        fn next(&mut self) -> f64 {
            self.0.unit()
        }

        fn between(&mut self, low: f64, high: f64) -> f64 {
            low + (high - low) * self.next()
        }

        fn direction(&mut self) -> Vec3 {
            loop {
                let v = DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
                if v.length() > 0.1 && v.length() < 1.0 {
                    return v.normalize().as_vec3();
                }
            }
        }
    }

    fn compiled(desc: &LightDesc) -> Light {
        let cx = &mut CompileContext::default();
        let light = match desc {
            LightDesc::Point(light) => light.compile(cx),
            LightDesc::Directional(light) => light.compile(cx),
            LightDesc::Spot(light) => light.compile(cx),
            LightDesc::Rectangle(light) => light.compile(cx, SamplesDesc::Exact),
            LightDesc::Disk(light) => light.compile(cx, SamplesDesc::Exact),
            LightDesc::Sphere(light) => light.compile(cx, SamplesDesc::Exact),
        };
        assert!(!cx.has_errors());
        light
    }

    /// Some lights of one kind in a ball.
    fn lights(random: &mut Random, kind: u32, count: u32, size: f64) -> Vec<Light> {
        let falloff = if kind.is_multiple_of(2) { Falloff::Physical } else { Falloff::Constant };
        let (front, wild) = (random.direction().as_dvec3(), random.between(0.0, 1.0));
        (0..count)
            .map(|_| {
                let at = (random.direction().as_dvec3() * size * random.next()).to_array();
                let color = ColorDesc::linear(random.next(), random.next(), random.next());
                let aim = (front + random.direction().as_dvec3() * wild).normalize();
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
        match (random.next() * 3.0) as u32 {
            0 => Lobe::None,
            1 => Lobe::Phong(PhongLobe::new(shininess)),
            _ => Lobe::BlinnPhong(BlinnPhongLobe::new(shininess)),
        }
    }

    /// What one light sends, point by point of it: the definition.
    fn truth(light: &Light, p: Vec3, ns: Vec3, wo: Vec3, lobe: &Lobe) -> [[f64; 3]; 2] {
        let area = if let LightKind::Area(area) = &light.kind { Some(area) } else { None };
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
            let specular = lobe.eval(cos_i, ns.dot(wo), wo.dot(l) * sample.inverse_distance);
            sums[1] += f64::from(specular * sample.weight);
        }
        let measure = match &light.kind {
            LightKind::Area(Area { shape, physical: true, .. }) => shape.measure(),
            _ => 1.0,
        };
        let own = sums.map(|sum| sum * measure / f64::from(count));
        own.map(|sum| channels(light.intensity).map(|c| f64::from(c) * sum))
    }

    #[test]
    fn no_bound_is_broken() {
        let mut random = Random::new(5);
        let (mut smooth, mut told) = (0, 0);
        for round in 0..600 {
            let kind = round % 8;
            let size = random.between(0.01, 1.0);
            let some = 1 + (random.next() * 8.0) as u32;
            let lights = lights(&mut random, kind, some, size);
            let tree = LightTree::new(&lights, &vec![0; lights.len()]);
            // A zone somewhere around
            let distance = random.between(0.3, 8.0) as f32;
            let center = random.direction() * distance;
            let n = random.direction();
            let n = if n.dot(center) > 0.0 { -n } else { n };
            let reach = random.between(0.0, 0.3) as f32 * random.next() as f32;
            let turn = random.between(0.0, 0.4) as f32 * random.next() as f32;
            let wo = (n + random.direction() * 0.9).normalize();
            let mirror = n * (2.0 * n.dot(wo)) - wo;
            let lobe = lobe(&mut random);
            let zone = Zone {
                center,
                reach,
                n,
                turn: Arc::of_chord(turn),
                mirror,
                blur: Arc::of_chord(3.0 * turn),
                wo,
                wo_turn: Arc::of_chord(turn),
                lobe,
            };
            for _ in 0..4 {
                let p = center + random.direction() * (reach * random.next() as f32);
                let ns = (n + random.direction() * (turn * 0.4)).normalize();
                let wo = (wo + random.direction() * (turn * 0.4)).normalize();
                if ns.dot(wo) <= 0.0 {
                    continue;
                }
                for node in &tree.nodes {
                    let sight = node.shine.sight(&zone);
                    let mut held = Vec::new();
                    let mut open = vec![node.held];
                    while let Some(one) = open.pop() {
                        match one {
                            Held::Light(light) => held.push(light),
                            Held::Two(two) => open.extend(two.map(|node| tree.nodes[node as usize].held)),
                        }
                    }
                    let mut sum = [[0.0f64; 3]; 2];
                    for light in held {
                        let one = truth(&lights[light as usize], p, ns, wo, &lobe);
                        for (sum, one) in sum.iter_mut().flatten().zip(one.iter().flatten()) {
                            *sum += one;
                        }
                    }
                    let flat = |sent: Sent| sent.0.map(|color| channels(color).map(f64::from));
                    let most = flat(node.most(&sight));
                    for (sum, most) in sum.iter().flatten().zip(most.iter().flatten()) {
                        assert!(*sum <= most * 1.001 + 1e-12, "{round}: {sum} is more than {most}, {node:?}");
                    }
                    if !(sight.whole && node.is_smooth()) || sight.weight == 0.0 {
                        continue;
                    }
                    smooth += 1;
                    let (sent, error) = (flat(node.send(p, ns, wo, &lobe)), flat(node.error(&sight)));
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
                    assert!(f64::from(sight.least) <= f64::from(sight.diffuse));
                }
            }
        }
        assert!(smooth > 1000 && told > 2000, "{smooth} {told}");
    }

    #[test]
    fn lights_are_all_there_once() {
        let mut random = Random::new(9);
        let mut all = Vec::new();
        for kind in 0..8 {
            all.extend(lights(&mut random, kind, 50, 1.0));
        }
        let tree = LightTree::new(&all, &vec![0; all.len()]);
        let mut seen = vec![0; all.len()];
        let mut open = tree.roots.clone();
        while let Some(node) = open.pop() {
            match tree.nodes[node as usize].held {
                Held::Light(light) => seen[light as usize] += 1,
                Held::Two(two) => open.extend(two),
            }
        }
        assert!(seen.iter().all(|times| *times == 1));
        assert!(tree.nodes.iter().any(|node| node.shine.sends == Sends::Flat && node.count > 1));
    }

    #[test]
    fn third_derivatives_are_bounded() {
        // Along all lines through points at distance 1, by differences in f64
        let mut random = Random::new(3);
        let mut most = [0.0f64; 3];
        for _ in 0..20000 {
            let [l, n, m, u] = [0; 4].map(|_| random.direction().as_dvec3());
            let kernels: [&dyn Fn(DVec3) -> f64; 3] = [
                &|l| n.dot(l) / (l.length_squared() * l.length()),
                &|l| n.dot(l) * m.dot(l) / (l.length_squared() * l.length_squared()),
                &|l| n.dot(l) / l.length(),
            ];
            let h = 1e-3;
            for (most, f) in most.iter_mut().zip(kernels) {
                let third = (f(l + u * 2.0 * h) - 2.0 * f(l + u * h) + 2.0 * f(l - u * h) - f(l - u * 2.0 * h))
                    / (2.0 * h * h * h);
                *most = most.max(third.abs());
            }
        }
        assert!(
            most[0] <= f64::from(TWIST) && most[1] <= f64::from(TWIST) && most[2] <= f64::from(TWIST_EVEN),
            "{most:?}"
        );
        assert!(most[0] > 20.0, "{most:?}");
    }

    #[test]
    fn a_sphere_is_its_shape() {
        let light = compiled(&LightDesc::Sphere(SphereLightDesc::new([0.0; 3], 0.5)));
        let LightKind::Area(area) = &light.kind else { panic!("a sphere has an area") };
        assert!(matches!(area.shape, AreaShape::Sphere(_)));
        let (shine, strength) = Shine::of(&light);
        assert_eq!(shine.sends, Sends::Round);
        assert!((strength - std::f32::consts::PI * 0.25).abs() < 1e-6);
    }
}
