//! From all lights of a scene to those that count at some places: a cut through the tree of lights.
//!
//! A walk begins with all lights and takes the worst node apart, again and again, until all that is left out and all
//! that is taken for one shows by no more than is allowed. What that is together, an [`ErrorSum`] says: up to a
//! thousand lights it is proved, as a [`Sum`]; of a great crowd errors are independent of each other, and their squares
//! are added ([`Squares`]). Each is counted as large as it can be: where many lights are taken for one, by the bound of
//! Taylor's series; where it is not known what is seen of a node, by all that the node can send.
//!
//! Walks of a [`Sum`] go over a block of pixels ([`Cut::of_block`]), and over its quarters, which settles what is the
//! same for all their places, then over each patch ([`Cut::of_patch`]), with what the first left open. The first
//! guesses how bright the block is; whether its error does at each patch is known after the second.

use std::collections::BinaryHeap;

use crate::color::{DisplaySteps, Rgb};
use crate::integrate::COSTS;
use crate::light::{Held, LightNode, LightTree, Sent, Zone, ZoneSight};
use crate::material::MOMENTS;
use crate::visibility::Seen;

/// The colours that a zone's places make of light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tone {
    /// What is there whatever the lights do, at least.
    pub base: Rgb,
    /// What diffuse light is multiplied with, at least.
    pub known: Rgb,
    /// What an error of diffuse light and of highlights is multiplied with, at most.
    pub error: Sent,
}

/// What the walk goes through, and by which rules.
#[derive(Clone, Copy)]
pub(super) struct CutRules<'a> {
    pub tree: &'a LightTree,
    pub steps: &'a DisplaySteps,
    pub zone: &'a Zone,
    pub tones: &'a [Tone],
    /// Whether a light shines on the surface at all.
    pub shines: &'a dyn Fn(u32) -> bool,
    /// In display steps.
    pub budget: f32,
    /// Whether what cannot be told of the zone is left open, to who looks from nearer.
    pub leaves_open: bool,
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
    error: Sent,
    key: f32,
    /// What it sends to the zone, thereabouts, if its power were 1.
    typical: f32,
    /// Whether it was asked what is seen of it.
    looked: bool,
    sight: ZoneSight,
}

/// How the errors of nodes become one.
pub(super) trait ErrorSum: Default {
    /// So many nodes are taken apart between two looks at the sum.
    const STRIDE: u32;
    /// Sums are made anew where the worst in question has become so much less: what was taken away has left its
    /// rounding behind.
    const AGAIN: f32;

    /// Adds an error, or takes it away, `sign` being 1 or -1.
    fn add(&mut self, error: &Sent, sign: f64);
    /// How far all can be wrong together where diffuse light and highlights are multiplied with `colors`.
    fn of(&self, colors: &Sent) -> Rgb;
    /// The node as it counts, `lit` if it is known to be seen whole: its error, and what it sends. `None` where it
    /// counts for nothing.
    fn item(rules: &CutRules, index: u32, sight: ZoneSight, lit: bool) -> Option<CutItem>;
    /// The item as one that is seen whole and counts as its middle, if that is worth it.
    fn as_middle(rules: &CutRules, item: &CutItem, node: &LightNode) -> Option<CutItem>;
    /// Whether it is worth a look what is seen of an item.
    fn is_worth_a_look(rules: &CutRules, item: &CutItem, node: &LightNode) -> bool;
}

/// Errors that add up.
#[derive(Default)]
pub(super) struct Sum([[f64; 3]; MOMENTS]);

/// Sums of products of errors, channel by channel: diffuse with itself, with highlights, highlights with themselves.
#[derive(Default)]
pub(super) struct Squares([[f64; 3]; PAIRS.len()]);

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

/// A walk through the tree. Keeps its memory.
#[derive(Default)]
pub(super) struct Cut<E> {
    items: Vec<CutItem>,
    /// The worst first: the bits of its key, and which item, the one first that was made first.
    heap: BinaryHeap<u64>,
    errors: E,
    /// What is sent, thereabouts, by what is in question, and what was before that.
    known: [f64; 3],
    done: [f64; 3],
    /// What of `done` is sent, thereabouts, by what was left open.
    maybe: [f64; 3],
    /// What the places look like, or what is sent to them, where that is known better.
    value: Option<Rgb>,
    guess: Option<Rgb>,
    /// Nodes that count, and how.
    pub nodes: Vec<(u32, By)>,
    /// Nodes that have to be looked at from nearer; of a crowd, lights that have to be asked for themselves.
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

fn add(sum: &mut [f64; 3], color: Rgb, factor: f64) {
    sum.iter_mut().zip(of(color)).for_each(|(sum, v)| *sum += v * factor);
}

impl By {
    /// Whether it counts wherever the places are.
    pub fn is_everywhere(self) -> bool {
        matches!(self, By::Middle | By::One)
    }
}

impl CutRules<'_> {
    fn key(&self, error: &Sent) -> f32 {
        self.tones.iter().fold(0.0, |key, tone| {
            let shown = (tone.error * *error).sum();
            shown.r.max(shown.g).max(shown.b).max(key)
        })
    }

    /// Whether its parts would tell no more: smaller lights do not help where it is the places that are too far apart.
    fn is_stuck(&self, node: &LightNode) -> bool {
        node.shine.ball().1 < 0.5 * self.zone.reach
    }

    fn node(&self, item: &CutItem) -> &LightNode {
        &self.tree.nodes[item.node as usize]
    }
}

impl ErrorSum for Sum {
    const STRIDE: u32 = 1;
    const AGAIN: f32 = 1e-8;

    fn add(&mut self, error: &Sent, sign: f64) {
        self.0.iter_mut().zip(error.0).for_each(|(sum, error)| add(sum, error, sign));
    }

    fn of(&self, colors: &Sent) -> Rgb {
        (*colors * self.errors()).sum()
    }

    fn item(rules: &CutRules, index: u32, sight: ZoneSight, lit: bool) -> Option<CutItem> {
        let node = &rules.tree.nodes[index as usize];
        let lit = lit && sight.whole && node.is_smooth();
        let (by, error, typical) = if lit {
            (By::Middle, node.error(&sight), middling(&sight))
        } else {
            (By::OneIfSeen, node.most(&sight), 0.0)
        };
        let key = rules.key(&error);
        (lit || key != 0.0).then_some(CutItem { node: index, by, error, key, typical, looked: false, sight })
    }

    fn as_middle(rules: &CutRules, item: &CutItem, node: &LightNode) -> Option<CutItem> {
        if !(node.is_smooth() && node.count == 1 && item.sight.whole) {
            return None;
        }
        let error = node.error(&item.sight);
        let key = rules.key(&error);
        let typical = middling(&item.sight);
        (key <= COSTS.looked_at * item.key).then_some(CutItem { by: By::Middle, error, key, typical, ..*item })
    }

    fn is_worth_a_look(rules: &CutRules, item: &CutItem, node: &LightNode) -> bool {
        match node.held {
            // Most are seen whole, as points, or not at all
            Held::Light(_) => rules.leaves_open || node.is_point() || Self::as_middle(rules, item, node).is_some(),
            Held::Two(_) => item.sight.width < COSTS.wide,
        }
    }
}

impl Sum {
    /// Diffuse and specular, before the colours of the surface.
    fn errors(&self) -> Sent {
        let mut errors = Sent::default();
        errors.0.iter_mut().zip(self.0).for_each(|(error, sum)| *error = color(sum));
        errors
    }
}

/// What a node of power 1 sends to a place of a zone that sees it whole, thereabouts.
fn middling(sight: &ZoneSight) -> f32 {
    0.5 * (sight.least + sight.diffuse)
}

impl ErrorSum for Squares {
    const STRIDE: u32 = 8;
    const AGAIN: f32 = 1e-4;

    fn add(&mut self, error: &Sent, sign: f64) {
        let errors = error.0.map(of);
        for (sum, [a, b]) in self.0.iter_mut().zip(PAIRS) {
            (0..3).for_each(|i| sum[i] += errors[a][i] * errors[b][i] * sign);
        }
    }

    fn of(&self, colors: &Sent) -> Rgb {
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

    fn item(rules: &CutRules, index: u32, sight: ZoneSight, lit: bool) -> Option<CutItem> {
        let node = &rules.tree.nodes[index as usize];
        let by = match (lit, sight.whole && node.is_smooth()) {
            (true, true) => By::Middle,
            (true, false) => By::One,
            (false, true) => By::MiddleIfSeen,
            (false, false) => By::OneIfSeen,
        };
        let error = match (by, node.held) {
            (By::Middle, _) => node.error(&sight),
            // Asked at each place, it is what it is
            (_, Held::Light(_)) if node.is_point() => Sent::default(),
            // Between nothing and the most nothing is farther off its mean, in the mean, than half of that
            _ => node.most(&sight) * 0.5,
        };
        let part = if by.is_everywhere() { 1.0 } else { COSTS.maybe };
        let typical = part * 0.5 * (sight.least + sight.diffuse.min(1e3 * sight.least));
        Some(CutItem { node: index, by, error, key: rules.key(&error), typical, looked: lit, sight })
    }

    fn as_middle(rules: &CutRules, item: &CutItem, _: &LightNode) -> Option<CutItem> {
        if item.by == By::MiddleIfSeen { Self::item(rules, item.node, item.sight, true) } else { None }
    }

    fn is_worth_a_look(rules: &CutRules, item: &CutItem, node: &LightNode) -> bool {
        item.sight.width < COSTS.wide
            || item.by == By::MiddleIfSeen && rules.key(&node.error(&item.sight)) <= COSTS.looked_at * item.key
    }
}

impl<E: ErrorSum> Cut<E> {
    /// Begins with some nodes. `known` is what is sent besides them.
    pub fn begin(&mut self, rules: &CutRules, nodes: &[u32], known: [f64; 3]) {
        self.items.clear();
        self.heap.clear();
        self.nodes.clear();
        self.open.clear();
        (self.errors, self.known, self.done, self.maybe) = (E::default(), known, known, [0.0; 3]);
        (self.value, self.guess) = (None, None);
        nodes.iter().for_each(|node| self.push(rules, *node, false));
    }

    /// Adds a node, and says nothing of one that sends nothing.
    fn push(&mut self, rules: &CutRules, index: u32, lit: bool) {
        let sight = rules.tree.nodes[index as usize].shine.sight(rules.zone);
        if sight.weight != 0.0
            && let Some(item) = E::item(rules, index, sight, lit)
        {
            self.add(rules, item);
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
        add(&mut self.known, rules.node(item).power, f64::from(item.typical) * sign);
    }

    /// Sums up anew: what was taken away leaves rounding behind.
    fn recount(&mut self, rules: &CutRules) {
        (self.errors, self.known) = (E::default(), self.done);
        let heap = std::mem::take(&mut self.heap);
        for place in &heap {
            let item = self.items[at(*place)];
            self.count(rules, &item, 1.0);
        }
        self.heap = heap;
    }

    /// How far all that is in question can be wrong where diffuse light and highlights are multiplied with `colors`.
    pub fn error(&self, colors: &Sent) -> Rgb {
        self.errors.of(colors)
    }

    fn shown(&self, rules: &CutRules) -> f32 {
        let known = self.guess.unwrap_or_else(|| color(self.known));
        rules.tones.iter().fold(0.0, |worst, tone| {
            let value = self.value.unwrap_or_else(|| tone.base + tone.known * known);
            rules.steps.of_color(value, self.error(&tone.error)).max(worst)
        })
    }

    /// Whether what is in question shows by no more than is allowed. `counted` was the worst when sums were made anew.
    fn is_enough(&mut self, rules: &CutRules, turn: u32, counted: &mut f32) -> bool {
        let worst = self.heap.peek().map_or(0.0, |place| f32::from_bits((place >> 32) as u32));
        let due = worst < *counted * E::AGAIN;
        if due {
            self.recount(rules);
            *counted = worst;
        }
        if worst > 0.0 && !((due || turn.is_multiple_of(E::STRIDE)) && self.shown(rules) <= rules.budget) {
            return false;
        }
        self.recount(rules);
        worst == 0.0 || self.shown(rules) <= rules.budget
    }

    /// Takes nodes apart until what is wrong shows by no more than is allowed. `look` says what is seen of a node, of
    /// which one light is named; `leaf` hears of lights that do not count as they are.
    fn walk(
        &mut self,
        rules: &CutRules,
        look: &mut dyn FnMut(&LightNode, u32) -> Seen,
        leaf: &mut dyn FnMut(&mut Self, &CutItem, u32),
    ) {
        let mut counted = f32::INFINITY;
        for turn in 0.. {
            if self.is_enough(rules, turn, &mut counted) {
                break;
            }
            let Some(item) = self.pop(rules) else { break };
            let node = rules.node(&item);
            if matches!(node.held, Held::Light(light) if !(rules.shines)(light)) {
                continue;
            }
            let mut lit = item.by.is_everywhere();
            if !lit && !item.looked && E::is_worth_a_look(rules, &item, node) {
                match look(node, node.first(rules.tree)) {
                    Seen::Nothing => continue,
                    Seen::Whole => {
                        lit = true;
                        if let Some(item) = E::as_middle(rules, &item, node) {
                            self.add(rules, item);
                            continue;
                        }
                    }
                    Seen::Unknown if rules.leaves_open && rules.is_stuck(node) => {
                        self.leave_open(rules, &item);
                        continue;
                    }
                    Seen::Unknown => {}
                }
            }
            match node.held {
                Held::Light(light) => leaf(self, &item, light),
                Held::Two(children) => children.into_iter().for_each(|child| self.push(rules, child, lit)),
            }
        }
    }

    /// Leaves a node to who looks from nearer. A part of what it may send counts as known.
    fn leave_open(&mut self, rules: &CutRules, item: &CutItem) {
        let sent = rules.node(item).power * (COSTS.maybe * middling(&item.sight));
        [&mut self.done, &mut self.known, &mut self.maybe].into_iter().for_each(|sum| add(sum, sent, 1.0));
        self.open.push(item.node);
    }

    /// How all nodes in question would count as they are.
    pub fn peek(&mut self) {
        self.nodes.clear();
        self.nodes.extend(self.heap.iter().map(|place| &self.items[at(*place)]).map(|item| (item.node, item.by)));
        self.nodes.sort_unstable_by_key(|(node, _)| *node);
    }
}

impl Cut<Sum> {
    /// What is sent, thereabouts, before the colours of the surface. What is open yet is not in it.
    pub fn known(&self) -> [f64; 3] {
        std::array::from_fn(|i| (self.known[i] - self.maybe[i]).max(0.0))
    }

    /// How far what is settled can be wrong: diffuse and specular, before the colours of the surface.
    pub fn errors(&self) -> Sent {
        self.errors.errors()
    }

    /// Settles what it can of some nodes for all places of a block. `known` is what larger blocks around it know
    /// already.
    pub fn of_block(
        &mut self,
        rules: &CutRules,
        from: &[u32],
        known: [f64; 3],
        look: &mut dyn FnMut(&LightNode, u32) -> Seen,
    ) {
        self.begin(rules, from, known);
        self.walk(rules, look, &mut |cut, item, _| {
            if item.by == By::Middle && item.key == 0.0 {
                // Nothing is lost
                let sent = rules.node(item).power * item.typical;
                [&mut cut.done, &mut cut.known].into_iter().for_each(|sum| add(sum, sent, 1.0));
                cut.nodes.push((item.node, item.by));
            } else {
                cut.leave_open(rules, item);
            }
        });
        self.recount(rules);
        self.finish();
    }

    /// Settles at one patch what the block left `open`. `value` is what is known to be there already; `ask` evaluates a
    /// light and says what it adds.
    pub fn of_patch(
        &mut self,
        rules: &CutRules,
        open: &[u32],
        value: Rgb,
        look: &mut dyn FnMut(&LightNode, u32) -> Seen,
        ask: &mut dyn FnMut(u32, Rgb) -> Rgb,
    ) -> Rgb {
        self.begin(rules, open, [0.0; 3]);
        self.value = Some(value);
        self.walk(rules, look, &mut |cut, _, light| {
            let value = cut.value.unwrap_or(Rgb::BLACK);
            cut.value = Some(value + ask(light, value));
        });
        self.finish();
        self.value.unwrap_or(Rgb::BLACK)
    }

    /// Says which nodes in question count.
    fn finish(&mut self) {
        let items = self.heap.drain().map(|place| &self.items[at(place)]).filter(|item| item.by == By::Middle);
        self.nodes.extend(items.map(|item| (item.node, item.by)));
        self.nodes.sort_unstable_by_key(|(node, _)| *node);
        self.open.sort_unstable();
    }
}

impl Cut<Squares> {
    /// Takes nodes apart. `guess` is what is known to be sent; else it is guessed.
    pub fn refine(&mut self, rules: &CutRules, guess: Option<Rgb>, look: &mut dyn FnMut(&LightNode, u32) -> Seen) {
        self.guess = guess;
        self.walk(rules, look, &mut |cut, _, light| cut.open.push(light));
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
                    item = Squares::as_middle(rules, &item, node).unwrap_or(CutItem { by: By::One, ..item });
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
