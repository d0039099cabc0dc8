//! From all lights of a scene to those that count at some places: a cut through the tree of lights.
//!
//! The walk begins with all lights and takes the worst node apart, again and again, until what is left out and what is
//! taken for one can together be wrong by no more than is allowed. Two walks, one after the other: for a block of
//! pixels ([`Cut::of_block`]), and for its quarters, which settles what is the same for all their places, then for each
//! patch ([`Cut::of_patch`]), with what the first left open. The first guesses how bright the block is; whether its
//! error does at each patch is known after the second.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::color::{DisplaySteps, Rgb};
use crate::integrate::COSTS;
use crate::light::{Held, LightNode, LightTree, Sent, Zone, ZoneSight};
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
    pub error: Sent,
}

/// A node in question.
struct CutItem {
    key: f32,
    node: u32,
    /// How far it can be wrong to take it as it is.
    error: Sent,
    /// What it sends, thereabouts; 0 where that is not known to arrive.
    typical: f32,
    /// Whether it is seen whole.
    lit: bool,
    sight: ZoneSight,
}

impl PartialEq for CutItem {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for CutItem {}

impl PartialOrd for CutItem {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for CutItem {
    /// The worst is the greatest; of equals, the one that was made first.
    fn cmp(&self, other: &Self) -> Ordering {
        self.key.total_cmp(&other.key).then(other.node.cmp(&self.node))
    }
}

/// A walk through the tree. Keeps its memory.
#[derive(Default)]
pub(super) struct Cut {
    heap: BinaryHeap<CutItem>,
    /// The sum of all errors in question, kept up to date roughly.
    error: [[f64; 3]; MOMENTS],
    /// What is sent, thereabouts, by what is seen whole, and a part of what may be.
    known: [f64; 3],
    /// That part of it.
    maybe: [f64; 3],
    /// Nodes that are seen whole and taken for one.
    pub lit: Vec<u32>,
    /// Nodes that have to be looked at from nearer.
    pub open: Vec<u32>,
}

/// What the walk goes through, and by which rules.
#[derive(Clone, Copy)]
pub(super) struct CutRules<'a> {
    pub tree: &'a LightTree,
    pub steps: &'a DisplaySteps,
    pub zone: &'a Zone,
    pub tones: &'a [Tone],
    /// In display steps.
    pub budget: f32,
}

/// Sums are made anew where what is in question has become so much less: what was taken away has left its rounding
/// behind.
const AGAIN: f32 = 1e-8;

fn add(sum: &mut [f64; 3], color: Rgb, sign: f64) {
    for (sum, v) in sum.iter_mut().zip([color.r, color.g, color.b]) {
        *sum += f64::from(v) * sign;
    }
}

fn color([r, g, b]: &[f64; 3]) -> Rgb {
    Rgb::new(r.max(0.0) as f32, g.max(0.0) as f32, b.max(0.0) as f32)
}

/// What a node of power 1 sends to a place of a zone that sees it whole, thereabouts.
fn typical(sight: &ZoneSight) -> f32 {
    0.5 * (sight.least + sight.diffuse)
}

impl CutRules<'_> {
    pub fn key(&self, error: &Sent) -> f32 {
        self.tones.iter().fold(0.0, |key, tone| {
            let shown = (tone.error * *error).sum();
            shown.r.max(shown.g).max(shown.b).max(key)
        })
    }

    fn item(&self, index: u32, lit: bool) -> Option<CutItem> {
        let node = &self.tree.nodes[index as usize];
        let sight = node.shine.sight(self.zone);
        if sight.weight == 0.0 {
            return None;
        }
        let lit = lit && sight.whole && node.is_smooth();
        let error = if lit { node.error(&sight) } else { node.most(&sight) };
        let key = self.key(&error);
        if key == 0.0 && !lit {
            return None;
        }
        Some(CutItem { key, node: index, error, typical: if lit { typical(&sight) } else { 0.0 }, lit, sight })
    }

    /// The node as one that is seen whole, and whether that would be worth the look.
    fn as_lit(&self, item: &CutItem, node: &LightNode) -> Option<CutItem> {
        if !node.is_smooth() || node.count > 1 {
            return None;
        }
        let sight = item.sight;
        if !sight.whole {
            return None;
        }
        let error = node.error(&sight);
        let key = self.key(&error);
        (key <= COSTS.looked_at * item.key).then_some(CutItem {
            key,
            node: item.node,
            error,
            typical: typical(&sight),
            lit: true,
            sight,
        })
    }
}

impl Cut {
    /// What is sent, thereabouts, before the colours of the surface.
    /// What is open yet is not in it.
    pub fn known(&self) -> [f64; 3] {
        std::array::from_fn(|i| (self.known[i] - self.maybe[i]).max(0.0))
    }

    /// How far what is settled can be wrong: diffuse and specular, before the colours of the surface.
    pub fn error(&self) -> Sent {
        Colors(std::array::from_fn(|k| color(&self.error[k])))
    }

    fn clear(&mut self) {
        self.heap.clear();
        self.lit.clear();
        self.open.clear();
        (self.error, self.known, self.maybe) = ([[0.0; 3]; MOMENTS], [0.0; 3], [0.0; 3]);
    }

    fn push(&mut self, walk: &CutRules, item: Option<CutItem>) {
        let Some(item) = item else { return };
        self.count(walk, &item, 1.0);
        self.heap.push(item);
    }

    fn count(&mut self, walk: &CutRules, item: &CutItem, sign: f64) {
        self.error.iter_mut().zip(item.error.0).for_each(|(sum, error)| add(sum, error, sign));
        if item.typical > 0.0 {
            add(&mut self.known, walk.tree.nodes[item.node as usize].power * item.typical, sign);
        }
    }

    /// Sums up anew: what was taken away leaves rounding behind.
    fn recount(&mut self, walk: &CutRules, done: &[f64; 3]) {
        (self.error, self.known) = ([[0.0; 3]; MOMENTS], *done);
        let heap = std::mem::take(&mut self.heap);
        for item in &heap {
            self.count(walk, item, 1.0);
        }
        self.heap = heap;
    }

    /// Sums up anew where that is due. `worst` was the worst in question when it was done last.
    fn keep_exact(&mut self, walk: &CutRules, done: &[f64; 3], worst: &mut f32) {
        let now = self.heap.peek().map_or(0.0, |item| item.key);
        if now < *worst * AGAIN {
            self.recount(walk, done);
            *worst = now;
        }
    }

    fn shown(&self, walk: &CutRules, value: Option<Rgb>) -> f32 {
        let (all, known) = (self.error(), color(&self.known));
        let mut worst: f32 = 0.0;
        for tone in walk.tones {
            let error = (tone.error * all).sum();
            let value = value.unwrap_or_else(|| tone.base + tone.known * known);
            worst = worst.max(walk.steps.of_color(value, error));
        }
        worst
    }

    /// Settles what it can for all places of a block. `look` says what is seen of a node; `shines` whether a light
    /// shines on the surface at all.
    /// Of the nodes `from`; `known` is what larger blocks around it know already.
    pub fn of_block(
        &mut self,
        walk: &CutRules,
        from: &[u32],
        known: [f64; 3],
        look: &mut dyn FnMut(&LightNode, u32) -> Seen,
        shines: &dyn Fn(u32) -> bool,
    ) {
        self.clear();
        let mut done = known;
        self.known = known;
        for node in from {
            self.push(walk, walk.item(*node, false));
        }
        let later = |done: &mut [f64; 3], [known, maybe]: [&mut [f64; 3]; 2], node: &LightNode, sight: &ZoneSight| {
            let share = COSTS.maybe * typical(sight);
            add(done, node.power * share, 1.0);
            add(maybe, node.power * share, 1.0);
            add(known, node.power * share, 1.0);
        };
        let mut worst = f32::INFINITY;
        loop {
            self.keep_exact(walk, &done, &mut worst);
            if self.shown(walk, None) <= walk.budget {
                self.recount(walk, &done);
                if self.shown(walk, None) <= walk.budget {
                    break;
                }
            }
            let Some(item) = self.heap.pop() else { break };
            self.count(walk, &item, -1.0);
            let node = &walk.tree.nodes[item.node as usize];
            match node.held {
                Held::Light(light) if !shines(light) => {}
                Held::Light(_) if item.lit && item.key == 0.0 => {
                    // Nothing is lost
                    add(&mut done, node.power * item.typical, 1.0);
                    add(&mut self.known, node.power * item.typical, 1.0);
                    self.lit.push(item.node);
                }
                Held::Light(_) if item.lit => {
                    later(&mut done, [&mut self.known, &mut self.maybe], node, &item.sight);
                    self.open.push(item.node);
                }
                Held::Light(light) => match look(node, light) {
                    Seen::Nothing => {}
                    Seen::Whole => match walk.as_lit(&item, node) {
                        Some(lit) => self.push(walk, Some(lit)),
                        None => {
                            later(&mut done, [&mut self.known, &mut self.maybe], node, &item.sight);
                            self.open.push(item.node);
                        }
                    },
                    Seen::Unknown => {
                        later(&mut done, [&mut self.known, &mut self.maybe], node, &item.sight);
                        self.open.push(item.node);
                    }
                },
                Held::Two(children) => {
                    let (mut lit, mut hidden, mut stuck) = (item.lit, false, false);
                    if !lit {
                        let as_lit = walk.as_lit(&item, node);
                        if as_lit.is_some() || item.sight.width < COSTS.wide {
                            match look(node, node.first(walk.tree)) {
                                Seen::Whole => match as_lit {
                                    Some(item) => {
                                        self.push(walk, Some(item));
                                        continue;
                                    }
                                    None => lit = true,
                                },
                                Seen::Nothing => hidden = true,
                                // Smaller lights do not help where it is the places that are too far apart
                                Seen::Unknown => stuck = node.shine.ball().1 < 0.5 * walk.zone.reach,
                            }
                        }
                    }
                    if stuck {
                        later(&mut done, [&mut self.known, &mut self.maybe], node, &item.sight);
                        self.open.push(item.node);
                    } else if !hidden {
                        for child in children {
                            self.push(walk, walk.item(child, lit));
                        }
                    }
                }
            }
        }
        self.recount(walk, &done);
        while let Some(item) = self.heap.pop() {
            if item.lit {
                self.lit.push(item.node);
            }
        }
        self.lit.sort_unstable();
        self.open.sort_unstable();
    }

    /// Settles at one patch what the block left `open`. `value` is what is known to be there already; `ask` evaluates a
    /// light and says what it adds.
    pub fn of_patch(
        &mut self,
        walk: &CutRules,
        open: &[u32],
        mut value: Rgb,
        look: &mut dyn FnMut(&LightNode, u32) -> Seen,
        ask: &mut dyn FnMut(u32, Rgb) -> Rgb,
    ) -> Rgb {
        self.clear();
        for node in open {
            self.push(walk, walk.item(*node, false));
        }
        let mut worst = f32::INFINITY;
        loop {
            self.keep_exact(walk, &[0.0; 3], &mut worst);
            if self.shown(walk, Some(value)) <= walk.budget {
                self.recount(walk, &[0.0; 3]);
                if self.shown(walk, Some(value)) <= walk.budget {
                    break;
                }
            }
            let Some(item) = self.heap.pop() else { break };
            self.count(walk, &item, -1.0);
            let node = &walk.tree.nodes[item.node as usize];
            match node.held {
                Held::Light(light) if item.lit => value += ask(light, value),
                Held::Light(light) => {
                    // Most are seen whole, as points, or not at all
                    let as_lit = walk.as_lit(&item, node);
                    let seen = if as_lit.is_some() || node.is_point() { look(node, light) } else { Seen::Unknown };
                    match (seen, as_lit) {
                        (Seen::Nothing, _) => {}
                        (Seen::Whole, Some(item)) => self.push(walk, Some(item)),
                        _ => value += ask(light, value),
                    }
                }
                Held::Two(children) => {
                    let mut lit = item.lit;
                    if !lit {
                        let as_lit = walk.as_lit(&item, node);
                        if as_lit.is_some() || item.sight.width < COSTS.wide {
                            match look(node, node.first(walk.tree)) {
                                Seen::Whole => match as_lit {
                                    Some(item) => {
                                        self.push(walk, Some(item));
                                        continue;
                                    }
                                    None => lit = true,
                                },
                                Seen::Nothing => continue,
                                Seen::Unknown => {}
                            }
                        }
                    }
                    for child in children {
                        self.push(walk, walk.item(child, lit));
                    }
                }
            }
        }
        while let Some(item) = self.heap.pop() {
            if item.lit {
                self.lit.push(item.node);
            }
        }
        self.lit.sort_unstable();
        value
    }
}
