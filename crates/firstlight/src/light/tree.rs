//! A tree over the lights of a scene. A node knows what its lights send together, and how far it can be wrong to take them
//! for one.
//!
//! The lights of a node are taken for one that stands, for each channel of colour, in the middle of their power. What they
//! send differs from that by the second order of their distance from that middle: half the power-weighted sum of its squares,
//! times the largest second derivative between them. Of the light of a point, cos / d^2, and that of a flat light,
//! cos cos' / d^2, no second derivative is above 6 / d^4; of cos alone, none is above 1.16 / d^2.
//!
//! Nothing here depends on the camera: what a node stands for is settled when the tree is built.

use super::bound::{MOST, Sends, Shine, Sight};
use super::{AreaShape, Light, LightKind};
use crate::color::Rgb;
use crate::material::Lobe;
use crate::math::Vec3;

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
    /// For each channel, the sum of power x distance^2 from its middle, the lights' own extent included.
    spread: Rgb,
    /// For each channel, the sum of power x distance x difference from `facing`.
    cross: Rgb,
    /// Whether things can stand in the way of all of them.
    pub shadows: bool,
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
pub(crate) type Sent = [Rgb; 2];

/// No second derivative of cos / d^2 is above this over d^4, nor one of cos cos' / d^2.
const CURVE: f32 = 6.0;
/// Nor one of cos above this over d^2.
const CURVE_EVEN: f32 = 1.16;

/// One light while the tree is built.
struct Seed {
    light: u32,
    shine: Shine,
    center: Vec3,
    order: u8,
}

impl LightTree {
    pub fn new(lights: &[Light]) -> LightTree {
        let mut seeds: Vec<Seed> = lights
            .iter()
            .enumerate()
            .map(|(index, light)| {
                let (shine, _) = Shine::of(light);
                let kind = shine.sends as u8 * 2 + u8::from(light.shadows);
                Seed { light: index as u32, center: shine.ball().0, order: kind * 2 + u8::from(shine.constant), shine }
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
    fn grow(&mut self, lights: &[Light], seeds: &mut [Seed]) -> (u32, Vec<Source>) {
        if let [seed] = seeds {
            let source = Source::of(seed.light, &lights[seed.light as usize], seed.shine);
            let sources = vec![source];
            let held = Held::Light(seed.light);
            return (self.push(LightNode::of(seed.shine, held, &sources)), sources);
        }
        // Halve them where they are farthest apart; where all are at one place, by their order
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) = seeds.iter().fold(none, |(a, b), seed| (a.min(seed.center), b.max(seed.center)));
        let size = high - low;
        let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
        let half = seeds.len() / 2;
        seeds.select_nth_unstable_by(half, |a, b| {
            a.center[axis].total_cmp(&b.center[axis]).then(a.light.cmp(&b.light))
        });
        let (left, right) = seeds.split_at_mut(half);
        let (a, mut sources) = self.grow(lights, left);
        let (b, others) = self.grow(lights, right);
        sources.extend(others);
        let shine = self.nodes[a as usize].shine.union(&self.nodes[b as usize].shine);
        let node = LightNode::of(shine, Held::Two([a, b]), &sources);
        (self.push(node), sources)
    }

    fn push(&mut self, node: LightNode) -> u32 {
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }
}

/// One light, as its nodes count it.
#[derive(Clone, Copy)]
struct Source {
    power: Rgb,
    at: Vec3,
    n: Vec3,
    /// Its own mean square distance from its middle, in square metres.
    own: f32,
    shadows: bool,
}

impl Source {
    fn of(_: u32, light: &Light, shine: Shine) -> Source {
        let (_, strength) = Shine::of(light);
        let own = match &light.kind {
            LightKind::Area(area) => match &area.shape {
                AreaShape::Rectangle(r) => (r.e0.length_squared() + r.e1.length_squared()) / 12.0,
                AreaShape::Disk(disk) => disk.radius * disk.radius * 0.5,
                AreaShape::Sphere(sphere) if area.physical => sphere.radius * sphere.radius * 0.5,
                AreaShape::Sphere(sphere) => sphere.radius * sphere.radius,
            },
            LightKind::Point(_) | LightKind::Directional(_) | LightKind::Spot(_) => 0.0,
        };
        let at = if shine.sends == Sends::Parallel { shine.low } else { shine.ball().0 };
        let power = light.intensity * strength;
        Source { power, at, n: shine.axis, own: own as f32 * 1.0001, shadows: light.shadows }
    }
}

/// The channels of a colour.
fn channels(color: Rgb) -> [f32; 3] {
    [color.r, color.g, color.b]
}

impl LightNode {
    fn of(shine: Shine, held: Held, sources: &[Source]) -> LightNode {
        let (mut middle, mut facing) = ([Vec3::ZERO; 3], [Vec3::ZERO; 3]);
        let (mut power, mut spread, mut cross) = ([0.0f32; 3], [0.0f32; 3], [0.0f32; 3]);
        for channel in 0..3 {
            // In f64: a hundred thousand lights far from the origin
            let mut sum = 0.0f64;
            let (mut at, mut n) = (crate::math::DVec3::ZERO, crate::math::DVec3::ZERO);
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
            let (mut s, mut c) = (0.0f64, 0.0f64);
            for source in sources {
                let p = f64::from(channels(source.power)[channel]);
                let off2 = f64::from((source.at - middle[channel]).length_squared() + source.own);
                s += p * off2;
                c += p * off2.sqrt() * f64::from((source.n - facing[channel]).length());
            }
            // Positions are rounded
            let rounding = f64::from(middle[channel].abs().max_element() * 1e-6);
            spread[channel] = (s * 1.001 + if sources.len() > 1 { sum * rounding * rounding } else { 0.0 }) as f32;
            cross[channel] = if shine.sends == Sends::Flat && sources.len() > 1 { (c * 1.001) as f32 } else { 0.0 };
        }
        let gray = sources.len() == 1 || {
            let near = |a: Vec3, b: Vec3| a == b;
            near(middle[0], middle[1]) && near(middle[1], middle[2]) && facing[0] == facing[1] && facing[1] == facing[2]
        };
        let rgb = |v: [f32; 3]| Rgb::new(v[0], v[1], v[2]);
        LightNode {
            shine,
            held,
            count: sources.len() as u32,
            power: rgb(power),
            middle,
            facing,
            gray,
            spread: rgb(spread),
            cross: rgb(cross),
            shadows: sources.iter().all(|source| source.shadows),
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

    /// Whether its lights can be taken for one, where a zone sees them whole.
    pub fn is_smooth(&self) -> bool {
        !matches!(self.shine.sends, Sends::Other)
    }

    /// What its lights send at most, as `sight` says, whatever stands in the way.
    pub fn most(&self, sight: &Sight) -> Sent {
        let cut = |color: Rgb| Rgb::new(color.r.min(MOST), color.g.min(MOST), color.b.min(MOST));
        [cut(self.power * sight.diffuse), cut(self.power * (sight.weight * sight.highlight.most))]
    }

    /// How far what [`send`](Self::send) says can be from what its lights send, where a zone sees all of them whole.
    pub fn error(&self, sight: &Sight) -> Sent {
        let most = self.most(sight);
        if self.spread.is_black() {
            return [Rgb::BLACK; 2];
        }
        let one = 1.0 / sight.near;
        let two = one * one;
        let glint = sight.highlight;
        let (diffuse, specular, crossed) = if self.shine.constant {
            (0.5 * CURVE_EVEN * two, 0.5 * glint.curve * two, [0.0; 2])
        } else {
            let curve = CURVE * glint.most + 4.0 * glint.slope + glint.curve;
            let crossed = [3.0, 3.0 * glint.most + glint.slope].map(|c| c * two * one);
            (0.5 * CURVE * two * two, 0.5 * curve * two * two, crossed)
        };
        let of = |factor: f32, crossed: f32, most: Rgb| {
            let error = self.spread * factor + self.cross * crossed;
            // No number is no bound
            let least = |error: f32, most: f32| if error < most { error } else { most };
            Rgb::new(least(error.r, most.r), least(error.g, most.g), least(error.b, most.b))
        };
        [of(diffuse, crossed[0], most[0]), of(specular, crossed[1], most[1])]
    }

    /// What its lights, taken for one, send to a place that sees all of them whole.
    #[inline(always)]
    pub fn send(&self, p: Vec3, ns: Vec3, wo: Vec3, lobe: &Lobe) -> Sent {
        let one = |channel: usize| self.send_channel(channel, p, ns, wo, lobe);
        if self.gray {
            let [diffuse, specular] = one(0);
            return [self.power * diffuse, self.power * specular];
        }
        let [r, g, b] = [one(0), one(1), one(2)];
        let color = |i: usize| Rgb::new(self.power.r * r[i], self.power.g * g[i], self.power.b * b[i]);
        [color(0), color(1)]
    }

    #[inline(always)]
    fn send_channel(&self, channel: usize, p: Vec3, ns: Vec3, wo: Vec3, lobe: &Lobe) -> [f32; 2] {
        let middle = self.middle[channel];
        let l = if self.shine.sends == Sends::Parallel { middle } else { middle - p };
        let inverse = 1.0 / l.length().max(f32::MIN_POSITIVE);
        let weight = match self.shine.sends {
            _ if self.shine.constant => 1.0,
            Sends::Flat => (-self.facing[channel].dot(l)).max(0.0) * (inverse * inverse * inverse),
            _ => inverse * inverse,
        };
        let cos_i = (ns.dot(l) * inverse).max(0.0);
        let specular = match lobe {
            Lobe::None => 0.0,
            lobe => lobe.eval(cos_i, ns.dot(wo), wo.dot(l) * inverse),
        };
        [weight * cos_i, weight * specular]
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
