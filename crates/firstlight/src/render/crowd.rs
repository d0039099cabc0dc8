//! Which lights of a great crowd count at the places of a block, and how: by nodes of the tree that are seen whole, by
//! nodes of which one light stands for all, and by lights that are asked for themselves.
//!
//! Here errors are added as independent ones are: by their squares. Each is counted as large as it can be: where many
//! are taken for one, by the bound of Taylor's series; where one light's shadow stands for a node's, by all that the
//! node can send.

use std::collections::BinaryHeap;

use super::cut::{CutRules, Tone};
use crate::color::Rgb;
use crate::integrate::COSTS;
use crate::light::{Held, LightNode, Sent, ZoneSight};
use crate::material::MOMENTS;
use crate::visibility::Seen;

/// How a node counts at all places of a block.
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
struct CrowdItem {
    node: u32,
    /// How far it can be wrong to take it as it is.
    error: Sent,
    /// What is sent to the zone, thereabouts, before the cosine's rest.
    typical: f32,
    by: By,
    /// Whether it was asked what is seen of it.
    looked: bool,
    sight: ZoneSight,
}

/// Sums of products of errors, channel by channel: diffuse with itself, with highlights, highlights with themselves.
type Squares = [[f64; 3]; PAIRS.len()];
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

/// The lights of a block. Keeps its memory.
#[derive(Default)]
pub(super) struct Crowd {
    items: Vec<CrowdItem>,
    /// The worst first: the bits of its key, and which item, the first one first.
    heap: BinaryHeap<u64>,
    squares: Squares,
    known: [f64; 3],
    /// Nodes that count, and how.
    pub nodes: Vec<(u32, By)>,
    /// Lights that have to be asked for themselves.
    pub singles: Vec<u32>,
}

/// From fewer places than this each asks for itself.
const WORTH_A_LOOK: usize = 6;
/// So many nodes are taken apart between two looks at the sum.
const STRIDE: u32 = 8;
/// Sums are made anew where the worst in question has become so much less.
const AGAIN: f32 = 1e-4;

fn of(color: Rgb) -> [f64; 3] {
    [color.r, color.g, color.b].map(f64::from)
}

impl Crowd {
    /// Begins a block with all lights.
    pub fn begin(&mut self, walk: &CutRules) {
        self.items.clear();
        self.heap.clear();
        self.singles.clear();
        (self.squares, self.known) = Default::default();
        for root in &walk.tree.roots {
            self.push(walk, *root, false);
        }
    }

    /// Adds a node, and says nothing of one that sends nothing.
    fn push(&mut self, walk: &CutRules, index: u32, lit: bool) {
        let node = &walk.tree.nodes[index as usize];
        let sight = node.shine.sight(walk.zone);
        if sight.weight == 0.0 {
            return;
        }
        let smooth = sight.whole && node.is_smooth();
        let by = match (lit, smooth) {
            (true, true) => By::Middle,
            (true, false) => By::One,
            (false, true) => By::MiddleIfSeen,
            (false, false) => By::OneIfSeen,
        };
        self.add(walk, CrowdItem { node: index, error: Default::default(), typical: 0.0, by, looked: lit, sight });
    }

    fn add(&mut self, walk: &CutRules, mut item: CrowdItem) {
        let node = &walk.tree.nodes[item.node as usize];
        let sight = &item.sight;
        item.error = match (item.by, node.held) {
            (By::Middle, _) => node.error(sight),
            // Asked at each place, it is what it is
            (_, Held::Light(_)) if node.is_point() => Sent::default(),
            // Between nothing and the most nothing is farther off its mean, in the mean, than half of that
            _ => node.most(sight) * 0.5,
        };
        let typical = 0.5 * (sight.least + sight.diffuse.min(1e3 * sight.least));
        item.typical = if matches!(item.by, By::Middle | By::One) { typical } else { COSTS.maybe * typical };
        let key = walk.key(&item.error);
        self.count(walk, &item, 1.0);
        let index = self.items.len() as u32;
        self.heap.push(u64::from(key.max(0.0).to_bits()) << 32 | u64::from(!index));
        self.items.push(item);
    }

    fn count(&mut self, walk: &CutRules, item: &CrowdItem, sign: f64) {
        let errors = item.error.0.map(of);
        let power = of(walk.tree.nodes[item.node as usize].power);
        for i in 0..3 {
            for (squares, [a, b]) in self.squares.iter_mut().zip(PAIRS) {
                squares[i] += errors[a][i] * errors[b][i] * sign;
            }
            self.known[i] += power[i] * f64::from(item.typical) * sign;
        }
    }

    /// Sums up anew: what was taken away leaves rounding behind.
    fn recount(&mut self, walk: &CutRules) {
        (self.squares, self.known) = Default::default();
        let (items, heap) = (std::mem::take(&mut self.items), std::mem::take(&mut self.heap));
        for place in &heap {
            self.count(walk, &items[at(*place)], 1.0);
        }
        (self.items, self.heap) = (items, heap);
    }

    /// What is sent, thereabouts, before the colours of the surface.
    pub fn known(&self) -> Rgb {
        let [r, g, b] = self.known.map(|v| v.max(0.0) as f32);
        Rgb::new(r, g, b)
    }

    /// How far all that counts can be wrong together where diffuse light and highlights are multiplied with `colors`:
    /// the root of the sum of squares.
    pub fn error(&self, colors: &Sent) -> Rgb {
        let colors = colors.0.map(of);
        let [r, g, b] = std::array::from_fn(|i| {
            let parts = self.squares.iter().zip(PAIRS).map(|(sum, [a, b])| {
                let twice = if a == b { 1.0 } else { 2.0 };
                twice * colors[a][i] * colors[b][i] * sum[i].max(0.0)
            });
            parts.sum::<f64>().sqrt() as f32
        });
        Rgb::new(r, g, b)
    }

    fn shown(&self, walk: &CutRules, tones: &[Tone], guess: Option<Rgb>) -> f32 {
        let known = guess.unwrap_or_else(|| self.known());
        tones.iter().fold(0.0, |worst, tone| {
            walk.steps.of_color(tone.base + tone.known * known, self.error(&tone.error)).max(worst)
        })
    }

    /// Takes nodes apart until what is wrong shows by no more than `walk.budget`. `guess` is what is known to be sent;
    /// else it is guessed. `look` says what is seen of a node.
    pub fn refine(&mut self, walk: &CutRules, guess: Option<Rgb>, look: &mut dyn FnMut(&LightNode, u32) -> Seen) {
        let mut counted = f32::INFINITY;
        for turn in 0u32.. {
            let worst = self.heap.peek().map_or(0.0, |place| f32::from_bits((place >> 32) as u32));
            let due = worst < counted * AGAIN;
            if due {
                self.recount(walk);
                counted = worst;
            }
            if worst == 0.0 || (due || turn % STRIDE == 0) && self.shown(walk, walk.tones, guess) <= walk.budget {
                self.recount(walk);
                if worst == 0.0 || self.shown(walk, walk.tones, guess) <= walk.budget {
                    break;
                }
            }
            let Some(place) = self.heap.pop() else { break };
            let item = self.items[at(place)];
            self.count(walk, &item, -1.0);
            let node = &walk.tree.nodes[item.node as usize];
            let mut lit = matches!(item.by, By::Middle | By::One);
            if !lit && !item.looked && self.is_worth_it(walk, &item, node) {
                match look(node, node.first(walk.tree)) {
                    Seen::Nothing => continue,
                    Seen::Whole => {
                        lit = true;
                        if item.by == By::MiddleIfSeen {
                            self.add(walk, CrowdItem { by: By::Middle, looked: true, ..item });
                            continue;
                        }
                    }
                    Seen::Unknown => {}
                }
            }
            match node.held {
                Held::Light(light) => self.singles.push(light),
                Held::Two(children) => children.into_iter().for_each(|child| self.push(walk, child, lit)),
            }
        }
    }

    fn is_worth_it(&self, walk: &CutRules, item: &CrowdItem, node: &LightNode) -> bool {
        item.sight.width < COSTS.wide
            || item.by == By::MiddleIfSeen
                && walk.key(&node.error(&item.sight)) <= COSTS.looked_at * walk.key(&item.error)
    }

    /// Looks at what was not looked at yet, and says how all nodes count.
    ///
    /// Where `places` are few, asking from each is less work than looking.
    pub fn settle(&mut self, walk: &CutRules, places: usize, look: &mut dyn FnMut(&LightNode, u32) -> Seen) {
        self.nodes.clear();
        let heap = std::mem::take(&mut self.heap);
        for place in &heap {
            let item = self.items[at(*place)];
            let node = &walk.tree.nodes[item.node as usize];
            let mut by = item.by;
            if matches!(by, By::MiddleIfSeen | By::OneIfSeen) && !item.looked && places >= WORTH_A_LOOK {
                match look(node, node.first(walk.tree)) {
                    Seen::Nothing => {
                        self.count(walk, &item, -1.0);
                        continue;
                    }
                    Seen::Whole if by == By::MiddleIfSeen => {
                        self.count(walk, &item, -1.0);
                        by = By::Middle;
                        self.count(walk, &CrowdItem { error: node.error(&item.sight), ..item }, 1.0);
                    }
                    Seen::Whole => by = By::One,
                    Seen::Unknown => {}
                }
            }
            self.nodes.push((item.node, by));
        }
        self.heap = heap;
        self.heap.clear();
        self.nodes.sort_unstable_by_key(|(node, _)| *node);
        self.singles.sort_unstable();
    }

    /// How all nodes in question would count as they are.
    pub fn peek(&mut self) {
        self.nodes.clear();
        self.nodes.extend(self.heap.iter().map(|place| &self.items[at(*place)]).map(|item| (item.node, item.by)));
        self.nodes.sort_unstable_by_key(|(node, _)| *node);
    }
}

/// Which item a place of the heap means.
fn at(place: u64) -> usize {
    !(place as u32) as usize
}
