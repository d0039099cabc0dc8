//! More than [`FEW`] lights: what arrives at the fragments of a cell where not every light is asked for at every one.
//!
//! For each block of pixels, and for its quarters and theirs, a [`Cut`] says which lights count: nodes of the
//! [`LightTree`](crate::light::LightTree) that are seen whole from all of it, and nodes that have to be looked at from
//! each patch. What is dropped, and what is lost by taking many lights for one, stays below
//! `TOLERANCE.many` for blocks and for patches, in display steps.
//!
//! Up to [`SINGLY`] lights are all taken one by one. Of more, one may stand for many: for which, the cut says for each
//! block, and what may be wrong is `TOLERANCE.crowd` as the root of a sum of squares. Cells and blocks lie on a
//! grid of the film, so nothing depends on tiles, crops or threads.

mod apart;
mod dense;
mod finish;
mod neighbours;
mod patch;
mod places;

use std::ops::{ControlFlow, Range};

use super::arrival::{ArrivalPlace, Arrivals};
use super::cell::CELL;
use super::change::Arrival;
use super::counts::Counts;
use super::cut::{Cut, CutRules, Squares, Sum};
use super::fence::Fence;
use super::fragment::Fragments;
use super::resolve::ScaledTerm;
use crate::color::Rgb;
use crate::ids::LightId;
use crate::image::Buffer;
use crate::integrate::TOLERANCE;
use crate::light::{LightTree, Sent};
use crate::material::Lobe;
use crate::math::{Vec3, square};
use crate::scene::Scene;
use crate::visibility::{Outlook, Seen};
use apart::{Apart, SentApart};
use dense::{Dot, sent};
use finish::Doubt;
use patch::{Patch, Patches};
use places::{is_alike, standing, tone, tones, zone};

/// So few lights are all asked for everywhere, and none is left out.
pub(crate) const FEW: usize = 16;
/// So many lights are at most taken one by one; of more, many may be taken for one.
pub(crate) const SINGLY: usize = 1000;
/// Blocks that ask for more lights by themselves are quartered.
const CLOSE: usize = 24;
/// An error that shows whatever is there.
const ANYTHING: f32 = 1e30;
/// In a list of nodes: one light stands for this one.
const ONE: u32 = 1 << 31;
/// Pixels across a block.
const BLOCK: usize = 8;
const BLOCKS: usize = CELL as usize / BLOCK;
/// Sizes of blocks: each has four of the next.
const LEVELS: usize = 3;
/// Colours of a block that are told apart.
const TONES: usize = 8;

/// What arrives at the fragments of one cell. Keeps its memory.
pub(super) struct Many<'a> {
    scene: &'a Scene,
    patches: Patches,
    tree: &'a LightTree,
    together: bool,
    eye: Vec3,
    outlook: Outlook,
    cut: Cut<Sum>,
    crowd: Cut<Squares>,
    fence: Fence,
    /// What arrives at each patch.
    stored: Vec<Stored>,
    /// The lights that were asked for one by one, patch by patch, in scene order.
    singles: Vec<Single>,
    /// Nodes that are taken for one, list by list.
    lit: Vec<u32>,
    /// Nodes that count where they are seen, block by block.
    dots: Vec<Dot>,
    terms: Vec<(u32, Sent)>,
    doubts: Vec<Doubt>,
    apart: Apart<'a>,
    kept: SentApart,
}

/// One light at one patch.
#[derive(Clone, Copy)]
struct Single {
    light: u32,
    arrival: Arrival,
}

/// What arrives at one patch.
#[derive(Clone, Default)]
struct Stored {
    singles: Range<u32>,
    /// The nodes of its blocks, the largest first, and its own.
    lit: [Range<u32>; LEVELS + 1],
    /// The dots of its block; those that are seen are among its own nodes.
    maybe: Range<u32>,
    /// What those send, and how far the mean over the patch can be from it.
    sent: Sent,
    bend: Sent,
    value: Rgb,
}

/// What larger blocks say of the lights, to those in them.
struct Above {
    level: usize,
    /// Nodes that they could not settle.
    open: Vec<u32>,
    /// What is sent, thereabouts, and how far what they settled can be wrong, before the colours of the surface.
    known: [f64; 3],
    error: Sent,
    lit: [Range<u32>; LEVELS + 1],
}

impl<'a> Many<'a> {
    /// `buffers` say which lights are kept apart.
    pub fn new(scene: &'a Scene, tree: &'a LightTree, buffers: &[Buffer]) -> Self {
        Many {
            scene,
            tree,
            together: scene.lights.len() > SINGLY && scene.geometry.links.is_empty(),
            eye: scene.camera.frame().eye,
            outlook: Outlook::default(),
            cut: Cut::default(),
            crowd: Cut::default(),
            fence: Fence::default(),
            patches: Patches::default(),
            stored: Vec::new(),
            singles: Vec::new(),
            lit: Vec::new(),
            dots: Vec::new(),
            terms: Vec::new(),
            doubts: Vec::new(),
            apart: Apart::new(scene, tree, buffers),
            kept: SentApart::new(),
        }
    }

    /// Begins a cell of which the film has so much; `pixel` says where in it a fragment is.
    pub fn begin(&mut self, fragments: &Fragments, size: [u32; 2], pixel: impl Fn(usize) -> u32) {
        self.patches.begin(self.scene, fragments, size, pixel);
    }

    /// Lights the fragments of the cell. `add` hears, pixel by pixel, one of its fragments; of each light in scene
    /// order what it sends and its scale, and last what is taken together; what of that is of lights that are kept
    /// apart; and the work that this took.
    pub fn light(
        &mut self,
        fragments: &Fragments,
        arrivals: &mut Arrivals<'a>,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
        mut add: impl FnMut(usize, [&[ScaledTerm]; 2], f32),
    ) -> ControlFlow<()> {
        let patches = std::mem::take(&mut self.patches);
        let before = counts.work();
        let looked = self.look(&patches, arrivals, counts, go_on);
        if looked.is_continue() {
            let each = (counts.work() - before) / (CELL * CELL) as f32;
            let (mut terms, mut apart) = (Vec::new(), Vec::new());
            let mut first = 0;
            for same in patches.all.chunk_by(|a, b| a.pixel == b.pixel) {
                let before = counts.work();
                terms.clear();
                let pixel = first..first + same.len();
                self.finish(fragments, &patches, pixel, arrivals, counts, [&mut terms, &mut apart]);
                add(same[0].fragment as usize, [&terms, &apart], each + counts.work() - before);
                first += same.len();
            }
        }
        self.patches = patches;
        looked
    }

    /// Finds out what arrives at each patch of a cell.
    fn look(
        &mut self,
        patches: &Patches,
        arrivals: &mut Arrivals<'a>,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.stored.clear();
        self.stored.resize(patches.all.len(), Stored::default());
        self.singles.clear();
        self.lit.clear();
        self.dots.clear();
        let all = Above {
            level: 0,
            open: self.tree.roots.clone(),
            known: [0.0; 3],
            error: Sent::BLACK,
            lit: Default::default(),
        };
        let mut blocks: [Vec<usize>; BLOCKS * BLOCKS] = Default::default();
        for (number, patch) in patches.all.iter().enumerate() {
            let [x, y] = patch.at().map(|at| at as usize / BLOCK);
            blocks[y * BLOCKS + x].push(number);
        }
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for block in &blocks {
            go_on()?;
            groups.clear();
            for number in block {
                let same = |group: &&mut Vec<usize>| is_alike(&patches.all[group[0]], &patches.all[*number]);
                match groups.iter_mut().find(same) {
                    Some(group) => group.push(*number),
                    None => groups.push(vec![*number]),
                }
            }
            for group in &groups {
                if self.together {
                    self.crowd(&patches.all, group, 0, None, arrivals, counts);
                } else {
                    self.group(&patches.all, group, &all, arrivals, counts);
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// The places of a block that lie on one surface.
    fn group(
        &mut self,
        patches: &[Patch],
        group: &[usize],
        above: &Above,
        arrivals: &mut Arrivals<'a>,
        counts: &mut Counts,
    ) {
        let (scene, tree) = (self.scene, self.tree);
        let patch = |number: &usize| &patches[*number];
        let zone = zone(group.iter().map(patch), self.eye);
        let tones = tones(scene, group.iter().map(patch));
        let receives = group.iter().any(|at| patch(at).si.receives_shadow);
        let places = group.iter().map(|at| standing(patch(at)));
        self.outlook.stand(scene, places);
        let (outlook, level) = (&mut self.outlook, arrivals.level());
        let share = if above.level == 0 { 2.0 * TOLERANCE.block } else { TOLERANCE.block };
        let (steps, budget) = (arrivals.display_steps(), TOLERANCE.many * share);
        let links = scene.geometry.lights_of(patch(&group[0]).si.surface);
        let shines = |light: u32| scene.geometry.links.contains(links, LightId(light));
        let rules = CutRules { tree, steps, zone: &zone, tones: &tones, shines: &shines, budget, leaves_open: true };
        self.cut.of_block(&rules, &above.open, above.known, &mut |node, light| {
            if !(receives && node.shadows) {
                return Seen::Whole;
            }
            outlook.look(level, scene, node.shine.low, node.shine.high, LightId(light))
        });
        let start = self.lit.len() as u32;
        self.lit.extend(self.cut.nodes.iter().map(|(node, _)| node));
        let mut lit = above.lit.clone();
        lit[above.level] = start..self.lit.len() as u32;
        let here = Above {
            level: above.level + 1,
            open: std::mem::take(&mut self.cut.open),
            known: self.cut.known(),
            error: above.error + self.cut.errors(),
            lit,
        };
        if here.level == LEVELS || here.open.is_empty() {
            for at in group {
                self.stored[*at] = self.settle(patch(at), &here, arrivals, counts);
            }
            return;
        }
        let half = BLOCK as u32 >> here.level;
        for quarter in 0..4 {
            let part: Vec<usize> = group.iter().filter(|at| patch(at).quarter(half) == quarter).copied().collect();
            if !part.is_empty() {
                self.group(patches, &part, &here, arrivals, counts);
            }
        }
    }

    /// What arrives at one patch of a block.
    fn settle(&mut self, patch: &Patch, above: &Above, arrivals: &mut Arrivals<'a>, counts: &mut Counts) -> Stored {
        let singles = self.singles.len();
        let mut stored = self.patch(patch, &above.lit, &above.open, arrivals, counts);
        let bsdf = &patch.bsdf;
        let shown = arrivals.steps(stored.value, (bsdf.colors * above.error).sum());
        if shown > TOLERANCE.many {
            // Darker than was guessed: by itself, from the beginning
            self.singles.truncate(singles);
            stored = self.patch(patch, &Default::default(), &self.tree.roots, arrivals, counts);
        }
        self.count(&stored, counts);
        stored
    }

    /// What arrives at one patch.
    fn patch(
        &mut self,
        patch: &Patch,
        blocks: &[Range<u32>; LEVELS + 1],
        open: &[u32],
        arrivals: &mut Arrivals<'a>,
        counts: &mut Counts,
    ) -> Stored {
        let (scene, tree) = (self.scene, self.tree);
        let (si, bsdf) = (&patch.si, &patch.bsdf);
        let mut stored = Stored { lit: blocks.clone(), ..Stored::default() };
        for list in 0..LEVELS {
            self.add(patch, list, &mut stored);
        }
        let base = scene.ambient * bsdf.ambient;
        let value = (bsdf.colors * stored.sent).0.into_iter().fold(base, |sum, part| sum + part);
        let from = self.singles.len();
        stored.value = value;
        if !open.is_empty() {
            arrivals.tolerate(TOLERANCE.integrals / (open.len() as f32).sqrt());
            let zone = zone(std::iter::once(patch), self.eye);
            let tones = [tone(scene, bsdf)];
            let steps = arrivals.display_steps();
            let links = scene.geometry.lights_of(si.surface);
            let shines = |light: u32| scene.geometry.links.contains(links, LightId(light));
            let rules = CutRules {
                tree,
                steps,
                zone: &zone,
                tones: &tones,
                shines: &shines,
                budget: TOLERANCE.many,
                leaves_open: false,
            };
            let (outlook, singles, level) = (&mut self.outlook, &mut self.singles, arrivals.level());
            let mut stands = false;
            stored.value = self.cut.of_patch(
                &rules,
                open,
                value,
                &mut |node, light| {
                    if !(si.receives_shadow && node.shadows) {
                        return Seen::Whole;
                    }
                    if !stands {
                        outlook.stand(scene, std::iter::once(standing(patch)));
                        stands = true;
                    }
                    outlook.look(level, scene, node.shine.low, node.shine.high, LightId(light))
                },
                &mut |light, value| {
                    let place = ArrivalPlace {
                        base: value,
                        reach: patch.reach,
                        turn: patch.turn,
                        ..arrivals.place(light as usize, si, bsdf)
                    };
                    let arrival = arrivals.arrival(light as usize, &place, counts);
                    singles.push(Single { light, arrival });
                    place.color(&arrival.sums)
                },
            );
            let start = self.lit.len() as u32;
            self.lit.extend(self.cut.nodes.iter().map(|(node, _)| node));
            stored.lit[LEVELS] = start..self.lit.len() as u32;
            let before = stored.sent;
            self.add(patch, LEVELS, &mut stored);
            for part in (bsdf.colors * (stored.sent + before * -1.0)).0 {
                stored.value += part;
            }
        }
        self.singles[from..].sort_unstable_by_key(|single| single.light);
        stored.singles = from as u32..self.singles.len() as u32;
        stored
    }

    fn count(&self, stored: &Stored, counts: &mut Counts) {
        let together: u32 = self.nodes(stored).map(|node| self.tree.nodes[(node & !ONE) as usize].count).sum();
        counts.lights.pairs += self.scene.lights.len() as u64;
        counts.lights.singly += stored.singles.len() as u64;
        counts.lights.nodes += stored.lit.iter().map(Range::len).sum::<usize>() as u64;
        counts.lights.together += u64::from(together);
    }

    /// The nodes that are taken for one.
    fn nodes(&self, stored: &Stored) -> impl Iterator<Item = u32> + '_ {
        stored.lit.clone().into_iter().flat_map(|range| &self.lit[range.start as usize..range.end as usize]).copied()
    }

    /// Adds what the nodes of one list send.
    fn add(&self, patch: &Patch, list: usize, stored: &mut Stored) {
        let (si, lobe) = (&patch.si, &patch.bsdf.lobe);
        let range = &stored.lit[list];
        for entry in &self.lit[range.start as usize..range.end as usize] {
            let sent = sent(self.scene, self.tree, *entry, si, lobe);
            let node = &self.tree.nodes[(entry & !ONE) as usize];
            stored.sent += sent;
            if patch.reach > 0.0 {
                let swing = patch.turn + patch.reach / node.distance(si.lit_from).max(patch.reach);
                // No second derivative of what a far light sends is more, over the square of its distance and what it
                // sends
                let smooth = (swing * swing).min(1.0) * 3.0;
                let weight = node.weight(si.lit_from);
                let moved = swing + patch.turn;
                let narrow = (lobe.sharpness(si.ns.dot(si.wo)) * square(moved)).min(1.0);
                let specular = if matches!(lobe, Lobe::None) { 0.0 } else { (narrow + smooth).min(1.0) };
                stored.bend += Sent::bounds(node.power * (weight * smooth), node.power * (weight * specular));
            }
        }
    }
}
