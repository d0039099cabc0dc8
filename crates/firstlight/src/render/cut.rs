//! Light cuts: from all lights of a scene to those that count at the places of a block of pixels.
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
use crate::visibility::Seen;

/// The colours that a zone's places make of light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tone {
    /// What is there whatever the lights do, at least.
    pub base: Rgb,
    /// What diffuse light is multiplied with, at least.
    pub known: Rgb,
    /// What an error of diffuse light and of highlights is multiplied with, at most.
    pub error: Colors,
}

/// What the walk goes through, and by which rules.
#[derive(Clone, Copy)]
pub(super) struct CutRules<'a> {
    pub tree: &'a LightTree,
    pub steps: &'a DisplaySteps,
    pub receivers: &'a ReceiverBounds,
    pub tones: &'a [Tone],
    /// In display steps.
    pub budget: f32,
}

/// How a node counts at all places of a zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum By {
    /// As its middle, seen from everywhere.
    Middle,
    /// As its middle, where the light that stands for it is seen.
    MiddleIfSeen,
    /// As the light that stands for it, seen from everywhere.
    One,
    /// As the light that stands for it, where that is seen.
    OneIfSeen,
}

/// A node in question.
#[derive(Clone, Copy)]
pub(super) struct CutItem {
    node: u32,
    by: By,
    /// How far it can be wrong to take it as it is, and how much of that shows at most.
    error: Colors,
    key: f32,
    /// What it sends to the zone, thereabouts, if its power were 1.
    typical: f32,
    /// Whether it was asked what is seen of it.
    looked: bool,
    bounds: ContributionBounds,
}

/// Sums of products of errors, channel by channel: diffuse with itself, with highlights, highlights with themselves.
#[derive(Default)]
struct Squares([[f64; 3]; PAIRS.len()]);

/// Each moment with each, once.
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

/// A walk through the tree. Keeps its memory.
#[derive(Default)]
pub(super) struct Cut {
    items: Vec<CutItem>,
    /// The worst first: the bits of its key, and which item, the one first that was made first.
    heap: BinaryHeap<u64>,
    errors: Squares,
    /// What the nodes in question send, thereabouts.
    known: [f64; 3],
    /// What is sent to the places, where that is known better.
    guess: Option<Rgb>,
    /// Nodes that count, and how.
    pub nodes: Vec<(u32, By)>,
    /// Lights that have to be integrated for themselves.
    pub open: Vec<u32>,
}

/// From fewer places than this each asks for itself.
const WORTH_A_LOOK: usize = 6;

fn of(color: Rgb) -> [f64; 3] {
    [color.r, color.g, color.b].map(f64::from)
}

fn color([r, g, b]: [f64; 3]) -> Rgb {
    Rgb::new(r.max(0.0) as f32, g.max(0.0) as f32, b.max(0.0) as f32)
}

impl By {
    /// Whether it counts wherever the places are.
    pub fn is_everywhere(self) -> bool {
        matches!(self, By::Middle | By::One)
    }
}

impl CutRules<'_> {
    fn key(&self, error: &Colors) -> f32 {
        self.tones.iter().fold(0.0, |key, tone| {
            let shown = (tone.error * *error).sum();
            shown.r.max(shown.g).max(shown.b).max(key)
        })
    }

    fn node(&self, item: &CutItem) -> &LightNode {
        &self.tree.nodes[item.node as usize]
    }
}

impl Squares {
    /// Adds an error, or takes it away, `sign` being 1 or -1.
    fn add(&mut self, error: &Colors, sign: f64) {
        let errors = error.0.map(of);
        for (sum, [a, b]) in self.0.iter_mut().zip(PAIRS) {
            (0..3).for_each(|i| sum[i] += errors[a][i] * errors[b][i] * sign);
        }
    }

    /// How far all can be wrong together where diffuse light and highlights are multiplied with `colors`.
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
    /// A node as it counts, `lit` if it is known to be seen whole.
    fn new(rules: &CutRules, index: u32, bounds: ContributionBounds, lit: bool) -> CutItem {
        let node = &rules.tree.nodes[index as usize];
        let by = match (lit, bounds.is_smooth) {
            (true, true) => By::Middle,
            (true, false) => By::One,
            (false, true) => By::MiddleIfSeen,
            (false, false) => By::OneIfSeen,
        };
        let error = match (by, node.contents) {
            (By::Middle, _) => node.error(&bounds),
            // Asked at each place, it is what it is
            (_, NodeContents::Light(_)) if node.is_point() => Colors::default(),
            // Between nothing and the most nothing is farther off its mean, in the mean, than half of that
            _ => node.max_contribution(&bounds) * 0.5,
        };
        let part = if by.is_everywhere() { 1.0 } else { COSTS.maybe };
        let typical = part * 0.5 * (bounds.min_diffuse + bounds.max_diffuse.min(1e3 * bounds.min_diffuse));
        CutItem { node: index, by, error, key: rules.key(&error), typical, looked: lit, bounds }
    }

    /// The item as one that is seen whole, if it counts as its middle then.
    fn as_middle(&self, rules: &CutRules) -> Option<CutItem> {
        (self.by == By::MiddleIfSeen).then(|| CutItem::new(rules, self.node, self.bounds, true))
    }

    /// Whether it is worth a look how much of it is seen.
    fn is_worth_a_look(&self, rules: &CutRules, node: &LightNode) -> bool {
        self.bounds.sin_half_angle < COSTS.wide
            || self.by == By::MiddleIfSeen && rules.key(&node.error(&self.bounds)) <= COSTS.looked_at * self.key
    }
}

impl Cut {
    /// Begins with some nodes.
    pub fn begin<'n>(&mut self, rules: &CutRules, nodes: impl Iterator<Item = &'n u32>) {
        self.items.clear();
        self.heap.clear();
        self.nodes.clear();
        self.open.clear();
        (self.errors, self.known, self.guess) = (Squares::default(), [0.0; 3], None);
        nodes.for_each(|node| self.push(rules, *node, false));
    }

    /// Adds a node, but for one that sends nothing.
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

    /// Sums up anew: what was taken away leaves rounding behind.
    fn recount(&mut self, rules: &CutRules) {
        (self.errors, self.known) = (Squares::default(), [0.0; 3]);
        let heap = std::mem::take(&mut self.heap);
        for place in &heap {
            let item = self.items[at(*place)];
            self.count(rules, &item, 1.0);
        }
        self.heap = heap;
    }

    /// How far all that is in question can be wrong where diffuse light and highlights are multiplied with `colors`.
    pub fn error(&self, colors: &Colors) -> Rgb {
        self.errors.of(colors)
    }

    fn shown(&self, rules: &CutRules) -> f32 {
        let known = self.guess.unwrap_or_else(|| color(self.known));
        rules.tones.iter().fold(0.0, |worst, tone| {
            rules.steps.of_color(tone.base + tone.known * known, self.error(&tone.error)).max(worst)
        })
    }

    /// Whether what is in question shows by no more than is allowed. `counted` was the worst when sums were made anew.
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
    /// nodes of the cut. `look` classifies the visibility of a node; its second argument is one of the node's lights.
    pub fn refine(&mut self, rules: &CutRules, guess: Option<Rgb>, look: &mut dyn FnMut(&LightNode, u32) -> Seen) {
        self.guess = guess;
        let mut counted = f32::INFINITY;
        for turn in 0.. {
            if self.is_enough(rules, turn, &mut counted) {
                break;
            }
            let Some(item) = self.pop(rules) else { break };
            let node = rules.node(&item);
            let mut lit = item.by.is_everywhere();
            if !lit && !item.looked && item.is_worth_a_look(rules, node) {
                match look(node, node.first(rules.tree)) {
                    Seen::Nothing => continue,
                    Seen::Whole => {
                        lit = true;
                        if let Some(item) = item.as_middle(rules) {
                            self.add(rules, item);
                            continue;
                        }
                    }
                    Seen::Unknown => {}
                }
            }
            match node.contents {
                NodeContents::Light(light) => self.open.push(light),
                NodeContents::Children(children) => children.into_iter().for_each(|child| self.push(rules, child, lit)),
            }
        }
    }

    /// How all nodes in question would count as they are.
    pub fn peek(&mut self) {
        self.nodes.clear();
        self.nodes.extend(self.heap.iter().map(|place| &self.items[at(*place)]).map(|item| (item.node, item.by)));
        self.nodes.sort_unstable_by_key(|(node, _)| *node);
    }

    /// Looks at what was not looked at yet, and says how all nodes count.
    ///
    /// Where `places` are few, asking from each is less work than looking.
    pub fn settle(&mut self, rules: &CutRules, places: usize, look: &mut dyn FnMut(&LightNode, u32) -> Seen) {
        self.nodes.clear();
        for place in std::mem::take(&mut self.heap) {
            let mut item = self.items[at(place)];
            let node = rules.node(&item);
            if !item.by.is_everywhere() && !item.looked && places >= WORTH_A_LOOK {
                let seen = look(node, node.first(rules.tree));
                if seen == Seen::Nothing {
                    self.count(rules, &item, -1.0);
                    continue;
                }
                if seen == Seen::Whole {
                    self.count(rules, &item, -1.0);
                    item = item.as_middle(rules).unwrap_or(CutItem { by: By::One, ..item });
                    self.count(rules, &item, 1.0);
                }
            }
            self.nodes.push((item.node, item.by));
        }
        self.nodes.sort_unstable_by_key(|(node, _)| *node);
        self.open.sort_unstable();
    }
}

/// Which item a place of the heap means.
fn at(place: u64) -> usize {
    !(place as u32) as usize
}
