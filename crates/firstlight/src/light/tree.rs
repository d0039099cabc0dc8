//! A tree of clusters of lights, with bounds of the error of an estimate that takes a cluster for one light.
//!
//! The estimate places the power of the cluster, for each channel of colour, at its centroid, and adds the second-order
//! term of the Taylor series, from the second moments of the lights about the centroid. Its error for diffuse light is
//! bounded by the third-order remainder: a sixth of the power-weighted sum of the cubed distances from the centroid,
//! times the largest third derivative between the lights. For the kernel of a point light, cos / d^2, and for that of a
//! flat one, cos cos' / d^2, no third derivative exceeds 24 / d^5; for cos alone none exceeds 4 / d^3. Highlights are
//! estimated to first order.
//!
//! Nothing here depends on the camera: the estimates and the representative lights are fixed when the tree is built.

use super::area::products;
use super::bounds::{ContributionBounds, EmissionProfile, LightBounds, MAX_CONTRIBUTION};
use super::samples::mix;
use super::{Area, Light};
use crate::color::Rgb;
use crate::material::{Colors, Moments, PerMoment, ShadingPoint};
use crate::math::{DMat3, DVec3, Mat3, Vec3};

/// Up to so many lights are all evaluated at every point; a scene with more has a light tree.
pub(crate) const FEW_LIGHTS: usize = 16;

/// The light trees of a scene: one for each link class, emission profile, distance falloff and casting of shadows.
#[derive(Debug)]
pub(crate) struct LightTree {
    pub nodes: Vec<LightNode>,
    pub roots: Vec<u32>,
}

/// A cluster of lights, or a single light. Values for each channel of colour are weighted by power in that channel.
#[derive(Clone, Debug)]
pub(crate) struct LightNode {
    pub bounds: LightBounds,
    pub contents: NodeContents,
    /// The number of lights.
    pub count: u32,
    /// The sum of intensity x strength, see [`LightBounds::of`].
    pub power: Rgb,
    /// For each channel, the mean position, in metres, world space; of a directional light its direction.
    centroid: [Vec3; 3],
    /// For each channel, the mean normal, for [`EmissionProfile::Cosine`].
    mean_normal: [Vec3; 3],
    /// Whether all channels have the same `centroid` and `mean_normal`.
    is_gray: bool,
    /// For each channel, the mean of the products of coordinates about the centroid, in square metres, the lights' own
    /// extent included.
    covariance: [Mat3; 3],
    /// For each channel, the sum of power x distance^2 from the centroid, the lights' own extent included.
    second_moment: Rgb,
    /// The same of distance^3.
    third_moment: Rgb,
    /// For each channel, the sum of power x distance x difference from `mean_normal`.
    normal_moment: Rgb,
    /// Whether all of the lights cast shadows.
    pub shadows: bool,
    /// The node of one of the lights, chosen at random with a probability proportional to power.
    pub representative: u32,
}

/// What a node of the tree consists of.
#[derive(Clone, Copy, Debug)]
pub(crate) enum NodeContents {
    /// One light, by its index.
    Light(u32),
    /// Two nodes.
    Children([u32; 2]),
}

/// No second derivative of 1 / d^2 or of cos' / d^2 exceeds this over d^4.
const MAX_SECOND_DERIVATIVE: f32 = 6.0;
/// No third derivative of cos / d^2 or of cos cos' / d^2 exceeds this over d^5.
const MAX_THIRD_DERIVATIVE: f32 = 24.0;
/// No third derivative of cos exceeds this over d^3.
const MAX_THIRD_DERIVATIVE_OF_COS: f32 = 4.0;

impl LightTree {
    /// `classes` has the link class of each light. All lights of a node have the same class, so that a surface receives
    /// light from all of them or from none.
    pub fn new(lights: &[Light], classes: &[u32]) -> LightTree {
        let mut leaves: Vec<TreeLight> = (0..)
            .zip(lights)
            .zip(classes)
            .map(|((index, light), class)| TreeLight::new(index, light, *class))
            .collect();
        leaves.sort_by_key(|leaf| leaf.group);
        let mut tree = LightTree { nodes: Vec::with_capacity(2 * lights.len()), roots: Vec::new() };
        for group in leaves.chunk_by_mut(|a, b| a.group == b.group) {
            // Directional lights have no common centroid
            let is_directional = group[0].bounds.profile == EmissionProfile::Directional;
            let size = if is_directional { 1 } else { group.len() };
            for cluster in group.chunks_mut(size) {
                let root = tree.build(cluster);
                tree.roots.push(root);
            }
        }
        tree
    }

    /// Builds the node of some lights, puts them into the order of the tree, and returns the index of the node.
    fn build(&mut self, lights: &mut [TreeLight]) -> u32 {
        let node = if let [light] = lights {
            let representative = self.nodes.len() as u32;
            LightNode::new(light.bounds, NodeContents::Light(light.index), representative, lights)
        } else {
            // Split at the median along the longest axis; equal centers by index
            let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            let (low, high) = lights.iter().fold(none, |(a, b), light| (a.min(light.center), b.max(light.center)));
            let axis = (high - low).max_position();
            let half = lights.len() / 2;
            lights.select_nth_unstable_by(half, |a, b| {
                a.center[axis].total_cmp(&b.center[axis]).then(a.index.cmp(&b.index))
            });
            let (left, right) = lights.split_at_mut(half);
            let children = [self.build(left), self.build(right)];
            let [left, right] = children.map(|child| &self.nodes[child as usize]);
            let power = |node: &LightNode| node.power.to_array().map(f64::from).iter().sum::<f64>();
            let (share, all) = (power(left), power(left) + power(right));
            let is_left = uniform(self.nodes.len() as u64) * all < share;
            let representative = if is_left { left.representative } else { right.representative };
            let bounds = left.bounds.union(&right.bounds);
            LightNode::new(bounds, NodeContents::Children(children), representative, lights)
        };
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }
}

/// A hash of a number, uniform in [0, 1).
fn uniform(number: u64) -> f64 {
    (mix(number) >> 11) as f64 / (1u64 << 53) as f64
}

/// One light while the tree is built.
struct TreeLight {
    index: u32,
    bounds: LightBounds,
    /// Lights of different groups share no tree.
    group: (u32, u8),
    power: Rgb,
    center: Vec3,
    /// The mean of the products of coordinates of its own points about its center, in square metres.
    covariance: DMat3,
    /// The largest distance of its points from its center, in metres.
    radius: f64,
    shadows: bool,
}

impl TreeLight {
    fn new(index: u32, light: &Light, class: u32) -> TreeLight {
        let (bounds, strength) = LightBounds::of(light);
        let (covariance, radius) = light.area().map_or((DMat3::ZERO, 0.0), Area::spread);
        let kind = bounds.profile as u8 * 2 + u8::from(light.shadows);
        TreeLight {
            index,
            bounds,
            group: (class, kind * 2 + u8::from(bounds.constant)),
            power: light.intensity * strength,
            center: bounds.ball().0,
            covariance,
            radius,
            shadows: light.shadows,
        }
    }
}

impl LightNode {
    fn new(bounds: LightBounds, contents: NodeContents, representative: u32, lights: &[TreeLight]) -> LightNode {
        let (mut centroid, mut mean_normal) = ([lights[0].center; 3], [lights[0].bounds.axes.axis; 3]);
        let [mut power, mut second, mut third, mut normal] = [[0.0f32; 3]; 4];
        let mut covariance = [Mat3::ZERO; 3];
        for channel in 0..3 {
            // In f64: a hundred thousand lights far from the origin
            let power_of = |light: &TreeLight| f64::from(light.power.to_array()[channel]);
            let mut sum = 0.0f64;
            let (mut at, mut n) = (DVec3::ZERO, DVec3::ZERO);
            for light in lights {
                let p = power_of(light);
                sum += p;
                at += light.center.as_dvec3() * p;
                n += light.bounds.axes.axis.as_dvec3() * p;
            }
            if !(sum > 0.0) {
                continue;
            }
            (centroid[channel], mean_normal[channel]) = ((at / sum).as_vec3(), (n / sum).as_vec3());
            power[channel] = sum as f32;
            let (mut two, mut three, mut c, mut moments) = (0.0f64, 0.0f64, 0.0f64, DMat3::ZERO);
            for light in lights {
                let p = power_of(light);
                let v = (light.center - centroid[channel]).as_dvec3();
                moments += (products(v) + light.covariance) * p;
                let far = v.length() + light.radius;
                two += p * far * far;
                three += p * far * far * far;
                c += p * far * f64::from((light.bounds.axes.axis - mean_normal[channel]).length());
            }
            covariance[channel] = (moments / sum).as_mat3();
            // Positions are rounded
            let rounding = if lights.len() > 1 { f64::from(centroid[channel].abs().max_element() * 1e-6) } else { 0.0 };
            second[channel] = (two * 1.001 + sum * rounding * rounding) as f32;
            third[channel] = (three * 1.001 + sum * rounding * rounding * rounding) as f32;
            let is_cosine = bounds.profile == EmissionProfile::Cosine && lights.len() > 1;
            normal[channel] = if is_cosine { (c * 1.001) as f32 } else { 0.0 };
        }
        // Differences between the channels of lights of one colour are rounding
        let size = (bounds.high - bounds.low).length();
        let near = |a: Vec3, b: Vec3, size: f32| (a - b).length() <= size * 1e-6;
        let is_same = |i: usize| near(centroid[i], centroid[0], size) && near(mean_normal[i], mean_normal[0], 1.0);
        LightNode {
            bounds,
            contents,
            count: lights.len() as u32,
            power: Rgb::from_array(power),
            centroid,
            mean_normal,
            is_gray: power[0] > 0.0 && (1..3).all(|i| power[i] == 0.0 || is_same(i)),
            covariance,
            second_moment: Rgb::from_array(second),
            third_moment: Rgb::from_array(third),
            normal_moment: Rgb::from_array(normal),
            shadows: lights.iter().all(|light| light.shadows),
            representative,
        }
    }

    /// The index of the first of its lights, in the order of the tree.
    pub fn first(&self, tree: &LightTree) -> u32 {
        let mut contents = self.contents;
        loop {
            match contents {
                NodeContents::Light(light) => return light,
                NodeContents::Children([left, _]) => contents = tree.nodes[left as usize].contents,
            }
        }
    }

    /// Whether it has no extent.
    pub fn is_point(&self) -> bool {
        self.bounds.low == self.bounds.high
    }

    /// Whether [`estimate`](Self::estimate) and [`error`](Self::error) hold where the lights' contribution is smooth.
    pub fn has_estimate(&self) -> bool {
        self.bounds.profile != EmissionProfile::Other
    }

    /// An upper bound of what its lights contribute within `bounds`, whatever occludes them: diffuse and specular,
    /// before the colours of the surface.
    pub fn max_contribution(&self, bounds: &ContributionBounds) -> Colors {
        let capped = |color: Rgb| color.min(Rgb::WHITE * MAX_CONTRIBUTION);
        Moments::bounds(bounds.max_diffuse, bounds.max_weight * bounds.highlight.most)
            .map(|most| capped(self.power * most))
    }

    /// An upper bound of the difference between [`estimate`](Self::estimate) and what its lights contribute, where
    /// nothing occludes them and their contribution is smooth.
    pub fn error(&self, bounds: &ContributionBounds) -> Colors {
        if self.second_moment.is_black() {
            return Colors::BLACK;
        }
        let one = 1.0 / bounds.min_distance;
        let two = one * one;
        let highlight = bounds.highlight;
        let (diffuse, specular, crossed) = if self.bounds.constant {
            (MAX_THIRD_DERIVATIVE_OF_COS / 6.0 * two * one, 0.5 * highlight.curve * two, [0.0; 2])
        } else {
            let curve = MAX_SECOND_DERIVATIVE * highlight.most + 4.0 * highlight.slope + highlight.curve;
            let crossed = [3.0, 3.0 * highlight.most + highlight.slope].map(|c| c * two * one);
            (MAX_THIRD_DERIVATIVE / 6.0 * two * two * one, 0.5 * curve * two * two, crossed)
        };
        let of = |moment: Rgb, factor: f32, crossed: f32| moment * factor + self.normal_moment * crossed;
        // A remainder that is not a number bounds nothing
        let least = |error: f32, most: f32| if error < most { error } else { most };
        let least = |e: Rgb, m: Rgb| Rgb::new(least(e.r, m.r), least(e.g, m.g), least(e.b, m.b));
        Colors::bounds(of(self.third_moment, diffuse, crossed[0]), of(self.second_moment, specular, crossed[1]))
            .zip(self.max_contribution(bounds), least)
    }

    /// What its lights, taken for one at the centroid, contribute to a point where nothing occludes them: diffuse and
    /// specular, before the colours of the surface.
    #[inline(always)]
    pub fn estimate(&self, point: &ShadingPoint) -> Colors {
        let one = |channel: usize| self.channel_estimate(channel, point);
        if self.is_gray {
            return one(0).map(|moment| self.power * moment);
        }
        let [r, g, b] = [one(0), one(1), one(2)];
        PerMoment(std::array::from_fn(|i| {
            Rgb::new(self.power.r * r.0[i], self.power.g * g.0[i], self.power.b * b.0[i])
        }))
    }

    #[inline(always)]
    fn channel_estimate(&self, channel: usize, point: &ShadingPoint) -> Moments {
        let ShadingPoint { p, ns, wo, ref bsdf, .. } = *point;
        let centroid = self.centroid[channel];
        let l = if self.bounds.profile == EmissionProfile::Directional { centroid } else { centroid - p };
        let one = 1.0 / l.length().max(f32::MIN_POSITIVE);
        let d = l * one;
        let (cos, normal) = (ns.dot(d), self.mean_normal[channel]);
        // The second derivatives, contracted with the covariance
        let covariance = &self.covariance[channel];
        let (along, trace) = (*covariance * d, covariance.diagonal().element_sum());
        let (across, deep) = (ns.dot(along), d.dot(along));
        let two = one * one;
        let (weight, diffuse) = match self.bounds.profile {
            // cos
            _ if self.bounds.constant => (1.0, cos + two * (cos * (1.5 * deep - 0.5 * trace) - across)),
            // cos cos' / d^2
            EmissionProfile::Cosine => {
                let out = -normal.dot(d);
                let (across_out, both) = (-normal.dot(along), -ns.dot(*covariance * normal));
                let second = both - 4.0 * (cos * across_out + out * across) + cos * out * (12.0 * deep - 2.0 * trace);
                (out.max(0.0) * two, (cos * out + two * second) * two)
            }
            // cos / d^2
            _ => (two, (cos + two * (cos * (7.5 * deep - 1.5 * trace) - 3.0 * across)) * two),
        };
        let let_through = point.bump_shadowing.factor(point.horizon.dot(d));
        bsdf.lobe.moments_around(diffuse.max(0.0), cos.max(0.0), ns.dot(wo), wo.dot(d), weight) * let_through
    }

    /// The estimate for a power of 1, of a light without colour.
    pub fn unit_estimate(&self, point: &ShadingPoint) -> Moments {
        self.channel_estimate(0, point)
    }

    /// What a light of strength 1 at the centroid contributes at `p`, before the cosine at the surface.
    #[inline(always)]
    pub fn weight_at(&self, p: Vec3) -> f32 {
        if self.bounds.constant {
            return 1.0;
        }
        let l = self.centroid[0] - p;
        1.0 / l.dot(l).max(f32::MIN_POSITIVE)
    }

    /// The distance of the centroid from `p`, in metres.
    #[inline(always)]
    pub fn distance_from(&self, p: Vec3) -> f32 {
        if self.bounds.profile == EmissionProfile::Directional {
            f32::INFINITY
        } else {
            (self.centroid[0] - p).length()
        }
    }
}

#[cfg(test)]
mod tests;
