//! Light cuts: the nodes of the light tree, and the single lights, that light a set of receivers.
//!
//! The traversal begins at the roots of the [`LightTree`] and splits the node with the largest error bound, until the
//! error of the cut is at most the budget. The error of a node that is fully visible and evaluated at its centroid is
//! bounded by the remainder of a Taylor series; that of a node whose visibility is unknown, by half of its largest
//! contribution. The errors of nodes are taken to be independent, so their squares add up.
//!
//! Source: Walter et al., "Lightcuts", SIGGRAPH 2005; the bounds and their sum are ours.

use std::collections::BinaryHeap;

use crate::color::{DisplaySteps, Rgb};
use crate::integrate::COSTS;
use crate::light::{ContributionBounds, LightNode, LightTree, NodeContents, ReceiverBounds};
use crate::material::{Colors, MOMENTS};
use crate::visibility::Visibility;

/// Bounds of the colours of the receivers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ReceiverColors {
    /// A lower bound of the radiance without the lights.
    pub base: Rgb,
    /// A lower bound of the factor of diffuse light.
    pub known: Rgb,
    /// Upper bounds of the factors of an error of diffuse light and of highlights.
    pub error: Colors,
}

/// The input of a light cut.
#[derive(Clone, Copy)]
pub(super) struct CutRules<'a> {
    pub tree: &'a LightTree,
    pub steps: &'a DisplaySteps,
    pub receivers: &'a ReceiverBounds,
    pub colors: &'a [ReceiverColors],
    /// The error that the cut may have, in display steps.
    pub budget: f32,
}

/// How the contribution of a node is estimated at all receivers.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeEstimator {
    /// By its centroid, or else by its representative light.
    pub by_centroid: bool,
    /// Nothing occludes the node, or else it contributes where its representative light is visible.
    pub is_unoccluded: bool,
}

/// A node of the cut.
#[derive(Clone, Copy)]
pub(super) struct CutItem {
    node: u32,
    estimator: NodeEstimator,
    /// The error bound of the estimator, and its largest channel for any of the receivers' colours.
    error: Colors,
    key: f32,
    /// The diffuse contribution to the receivers to expect for a power of 1.
    typical: f32,
    /// Whether its visibility was classified.
    is_classified: bool,
    bounds: ContributionBounds,
}

/// For each channel, the sums over nodes of the products of their errors: diffuse with diffuse, diffuse with highlight,
/// highlight with highlight.
#[derive(Default)]
struct Squares([[f64; 3]; PAIRS.len()]);

/// All pairs of moments.
const PAIRS: [[usize; 2]; MOMENTS * (MOMENTS + 1) / 2] = {
    let mut pairs = [[0; 2]; MOMENTS * (MOMENTS + 1) / 2];
    let (mut k, mut a) = (0, 0);
    while a < MOMENTS {
        let mut b = a;
        while b < MOMENTS {
            pairs[k] = [a, b];
            (k, b) = (k + 1, b + 1);
        }
        a += 1;
    }
    pairs
};

/// The number of nodes that are split between two evaluations of the error of the cut.
const STRIDE: u32 = 8;
/// The sums are recomputed once the largest error has fallen by this factor: subtraction leaves rounding errors behind.
const AGAIN: f32 = 1e-4;

/// A cut through the light tree. Keeps its memory.
#[derive(Default)]
pub(super) struct Cut {
    items: Vec<CutItem>,
    /// The bits of an item's key and the complement of its index: the largest key first, then the smallest index.
    heap: BinaryHeap<u64>,
    errors: Squares,
    /// The diffuse contribution of the nodes to expect, by channel.
    known: [f64; 3],
    /// The incident light, where the caller knows it better.
    guess: Option<Rgb>,
    /// The nodes of the finished cut, and their estimators.
    pub nodes: Vec<(u32, NodeEstimator)>,
    /// Lights that are to be integrated one by one.
    pub single_lights: Vec<u32>,
}

/// For fewer receivers than this a shadow ray from each takes less time than the classification of a node. Half and
/// twice as many: no change on fairy lights.
const FEW_RECEIVERS: usize = 6;

fn of(color: Rgb) -> [f64; 3] {
    [color.r, color.g, color.b].map(f64::from)
}

fn color([r, g, b]: [f64; 3]) -> Rgb {
    Rgb::new(r.max(0.0) as f32, g.max(0.0) as f32, b.max(0.0) as f32)
}

impl CutRules<'_> {
    fn key(&self, error: &Colors) -> f32 {
        self.colors.iter().fold(0.0, |key, colors| {
            let shown = (colors.error * *error).sum();
            shown.r.max(shown.g).max(shown.b).max(key)
        })
    }

    fn node(&self, item: &CutItem) -> &LightNode {
        &self.tree.nodes[item.node as usize]
    }
}

impl Squares {
    /// Adds the products of an error times `sign`, which is 1 or -1.
    fn add(&mut self, error: &Colors, sign: f64) {
        let errors = error.0.map(of);
        for (sum, [a, b]) in self.0.iter_mut().zip(PAIRS) {
            (0..3).for_each(|i| sum[i] += errors[a][i] * errors[b][i] * sign);
        }
    }

    /// The root of the sum of squares of all errors, where diffuse light and highlights have the factors `colors`.
    fn of(&self, colors: &Colors) -> Rgb {
        let colors = colors.0.map(of);
        let [r, g, b] = std::array::from_fn(|i| {
            let parts = self.0.iter().zip(PAIRS).map(|(sum, [a, b])| {
                let twice = if a == b { 1.0 } else { 2.0 };
                twice * colors[a][i] * colors[b][i] * sum[i].max(0.0)
            });
            parts.sum::<f64>().sqrt() as f32
        });
        Rgb::new(r, g, b)
    }
}

impl CutItem {
    /// A node with its estimator; `lit` if it is known to be fully visible.
    fn new(rules: &CutRules, index: u32, bounds: ContributionBounds, lit: bool) -> CutItem {
        let node = &rules.tree.nodes[index as usize];
        let estimator = NodeEstimator { by_centroid: bounds.is_smooth, is_unoccluded: lit };
        let error = match node.contents {
            _ if lit && bounds.is_smooth => node.error(&bounds),
            // Evaluated at each receiver, it has no error
            NodeContents::Light(_) if node.is_point() => Colors::default(),
            // The standard deviation of a number between 0 and the maximum is at most half of the maximum
            _ => node.max_contribution(&bounds) * 0.5,
        };
        let part = if lit { 1.0 } else { COSTS.maybe };
        let typical = part * 0.5 * (bounds.min_diffuse + bounds.max_diffuse.min(1e3 * bounds.min_diffuse));
        CutItem { node: index, estimator, error, key: rules.key(&error), typical, is_classified: lit, bounds }
    }

    /// The item as a fully visible one, if its centroid estimates it then.
    fn as_centroid(&self, rules: &CutRules) -> Option<CutItem> {
        let NodeEstimator { by_centroid, is_unoccluded } = self.estimator;
        (by_centroid && !is_unoccluded).then(|| CutItem::new(rules, self.node, self.bounds, true))
    }

    /// Whether a classification of its visibility is likely to save more time than it takes.
    fn is_worth_classifying(&self, rules: &CutRules, node: &LightNode) -> bool {
        self.bounds.sin_half_angle < COSTS.wide
            || self.estimator.by_centroid && rules.key(&node.error(&self.bounds)) <= COSTS.looked_at * self.key
    }
}

impl Cut {
    /// Begins a cut with some nodes.
    pub fn begin<'n>(&mut self, rules: &CutRules, nodes: impl Iterator<Item = &'n u32>) {
        self.items.clear();
        self.heap.clear();
        self.nodes.clear();
        self.single_lights.clear();
        (self.errors, self.known, self.guess) = (Squares::default(), [0.0; 3], None);
        nodes.for_each(|node| self.push(rules, *node, false));
    }

    /// Adds a node, unless it contributes nothing.
    fn push(&mut self, rules: &CutRules, index: u32, lit: bool) {
        let bounds = rules.tree.nodes[index as usize].bounds.contribution(rules.receivers);
        if bounds.max_weight != 0.0 {
            self.add(rules, CutItem::new(rules, index, bounds, lit));
        }
    }

    fn add(&mut self, rules: &CutRules, item: CutItem) {
        self.count(rules, &item, 1.0);
        let index = self.items.len() as u32;
        self.heap.push(u64::from((item.key + 0.0).to_bits()) << 32 | u64::from(!index));
        self.items.push(item);
    }

    fn pop(&mut self, rules: &CutRules) -> Option<CutItem> {
        let item = self.items[at(self.heap.pop()?)];
        self.count(rules, &item, -1.0);
        Some(item)
    }

    fn count(&mut self, rules: &CutRules, item: &CutItem, sign: f64) {
        self.errors.add(&item.error, sign);
        let sent = of(rules.node(item).power);
        self.known.iter_mut().zip(sent).for_each(|(sum, sent)| *sum += sent * f64::from(item.typical) * sign);
    }

    /// Recomputes the sums: subtraction leaves rounding errors behind.
    fn recount(&mut self, rules: &CutRules) {
        (self.errors, self.known) = (Squares::default(), [0.0; 3]);
        let heap = std::mem::take(&mut self.heap);
        for place in &heap {
            let item = self.items[at(*place)];
            self.count(rules, &item, 1.0);
        }
        self.heap = heap;
    }

    /// The error of the cut, where diffuse light and highlights have the factors `colors`.
    pub fn error(&self, colors: &Colors) -> Rgb {
        self.errors.of(colors)
    }

    fn shown(&self, rules: &CutRules) -> f32 {
        let known = self.guess.unwrap_or_else(|| color(self.known));
        rules.colors.iter().fold(0.0, |worst, colors| {
            rules.steps.of_color(colors.base + colors.known * known, self.error(&colors.error)).max(worst)
        })
    }

    /// Whether the error of the cut is within the budget. `counted` is the largest key at the last recomputation of the
    /// sums.
    fn is_enough(&mut self, rules: &CutRules, turn: u32, counted: &mut f32) -> bool {
        let worst = self.heap.peek().map_or(0.0, |place| f32::from_bits((place >> 32) as u32));
        let due = worst < *counted * AGAIN;
        if due {
            self.recount(rules);
            *counted = worst;
        }
        if worst > 0.0 && !((due || turn.is_multiple_of(STRIDE)) && self.shown(rules) <= rules.budget) {
            return false;
        }
        self.recount(rules);
        worst == 0.0 || self.shown(rules) <= rules.budget
    }

    /// Splits the node with the largest error bound, again and again, until the error of the cut is at most
    /// `rules.budget` display steps. The display steps depend on the incident light: `guess`, or else the sum over the
    /// nodes of the cut. `classify` returns the visibility of a node, if it can be proved.
    pub fn refine(
        &mut self,
        rules: &CutRules,
        guess: Option<Rgb>,
        classify: &mut dyn FnMut(&LightNode) -> Option<Visibility>,
    ) {
        self.guess = guess;
        let mut counted = f32::INFINITY;
        for turn in 0.. {
            if self.is_enough(rules, turn, &mut counted) {
                break;
            }
            let Some(item) = self.pop(rules) else { break };
            let node = rules.node(&item);
            let mut lit = item.estimator.is_unoccluded;
            if !lit && !item.is_classified && item.is_worth_classifying(rules, node) {
                match classify(node) {
                    Some(Visibility::None) => continue,
                    Some(Visibility::Full) => {
                        lit = true;
                        if let Some(item) = item.as_centroid(rules) {
                            self.add(rules, item);
                            continue;
                        }
                    }
                    _ => {}
                }
            }
            match node.contents {
                NodeContents::Light(light) => self.single_lights.push(light),
                NodeContents::Children(children) => children.into_iter().for_each(|child| self.push(rules, child, lit)),
            }
        }
    }

    /// Lists the nodes of the cut as it is.
    pub fn list_nodes(&mut self) {
        self.nodes.clear();
        self.nodes
            .extend(self.heap.iter().map(|place| &self.items[at(*place)]).map(|item| (item.node, item.estimator)));
        self.nodes.sort_unstable_by_key(|(node, _)| *node);
    }

    /// Classifies the nodes that were not classified yet, unless the receivers are few, and lists the nodes of the cut.
    pub fn finish(
        &mut self,
        rules: &CutRules,
        receivers: usize,
        classify: &mut dyn FnMut(&LightNode) -> Option<Visibility>,
    ) {
        self.nodes.clear();
        for place in std::mem::take(&mut self.heap) {
            let mut item = self.items[at(place)];
            let node = rules.node(&item);
            if !item.estimator.is_unoccluded && !item.is_classified && receivers >= FEW_RECEIVERS {
                let visibility = classify(node);
                if visibility == Some(Visibility::None) {
                    self.count(rules, &item, -1.0);
                    continue;
                }
                if visibility == Some(Visibility::Full) {
                    self.count(rules, &item, -1.0);
                    let unoccluded = NodeEstimator { is_unoccluded: true, ..item.estimator };
                    item = item.as_centroid(rules).unwrap_or(CutItem { estimator: unoccluded, ..item });
                    self.count(rules, &item, 1.0);
                }
            }
            self.nodes.push((item.node, item.estimator));
        }
        self.nodes.sort_unstable_by_key(|(node, _)| *node);
        self.single_lights.sort_unstable();
    }
}

/// The index of the item that an entry of the heap stands for.
fn at(place: u64) -> usize {
    !(place as u32) as usize
}
