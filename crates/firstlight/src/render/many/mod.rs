//! More than [`FEW_LIGHTS`](crate::light::FEW_LIGHTS) lights: what arrives at the fragments of a cell, where not every
//! light is evaluated at every one.
//!
//! For each block of pixels, and for its quarters where many lights are near, a [`Cut`] says which lights count: nodes
//! of the [`LightTree`](crate::light::LightTree), each of which one light stands for or their middle, and lights that
//! are integrated one by one. What may be wrong is `TOLERANCE.crowd` display steps, as the root of a sum of squares.
//! Cells and blocks lie on a grid of the film, so nothing depends on tiles, crops or threads.

mod apart;
mod block;
mod finish;
mod neighbours;
mod patch;
mod places;

use std::ops::{ControlFlow, Range};

use super::arrival::Arrivals;
use super::cell::CELL;
use super::change::Arrival;
use super::counts::Counts;
use super::cut::Cut;
use super::fence::Fence;
use super::fragment::Fragments;
use crate::color::Rgb;
use crate::film::resolve::ScaledTerm;
use crate::image::Buffer;
use crate::light::LightTree;
use crate::material::{Colors, Lobe};
use crate::math::{Vec3, square};
use crate::scene::Scene;
use crate::visibility::Outlook;
use apart::{Apart, SentApart};
use block::{Dot, sent};
use finish::Doubt;
use patch::{Patch, Patches};
use places::is_alike;

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
    eye: Vec3,
    outlook: Outlook,
    cut: Cut,
    fence: Fence,
    /// What arrives at each patch.
    stored: Vec<Stored>,
    /// The lights that were asked for one by one, patch by patch, in scene order.
    singles: Vec<Single>,
    /// Nodes that are taken for one, list by list.
    lit: Vec<u32>,
    /// Nodes that count where they are seen, block by block.
    dots: Vec<Dot>,
    terms: Vec<(u32, Colors)>,
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
    /// The nodes of its block, and its own.
    lit: [Range<u32>; 2],
    /// The dots of its block; those that are seen are among its own nodes.
    maybe: Range<u32>,
    /// What those send, and how far the mean over the patch can be from it.
    sent: Colors,
    bend: Colors,
    value: Rgb,
}

impl<'a> Many<'a> {
    /// `buffers` say which lights are kept apart.
    pub fn new(scene: &'a Scene, tree: &'a LightTree, buffers: &[Buffer]) -> Self {
        Many {
            scene,
            tree,
            eye: scene.camera.frame().eye,
            outlook: Outlook::default(),
            cut: Cut::default(),
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
                self.block(&patches.all, group, 0, None, arrivals, counts);
            }
        }
        ControlFlow::Continue(())
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
                let swing = patch.turn + patch.reach / node.distance_from(si.lit_from).max(patch.reach);
                // No second derivative of what a far light sends is more, over the square of its distance and what it
                // sends
                let smooth = (swing * swing).min(1.0) * 3.0;
                let weight = node.weight_at(si.lit_from);
                let moved = swing + patch.turn;
                let narrow = (lobe.sharpness(si.ns.dot(si.wo)) * square(moved)).min(1.0);
                let specular = if matches!(lobe, Lobe::None) { 0.0 } else { (narrow + smooth).min(1.0) };
                stored.bend += Colors::bounds(node.power * (weight * smooth), node.power * (weight * specular));
            }
        }
    }
}
