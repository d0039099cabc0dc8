//! More than [`FEW_LIGHTS`](crate::light::FEW_LIGHTS) lights: direct lighting of the fragments of a cell by light cuts.
//!
//! Each block of pixels, or each of its quarters where many lights are near, has a [`Cut`]: nodes of the
//! [`LightTree`], estimated by their centroid or by a representative light, and single lights
//! that are integrated. Its error is at most `TOLERANCE.cut_error` display steps, as the root of a sum of squares.
//! Cells and blocks lie on a grid of the film, so nothing depends on tiles, crops or threads.

mod apart;
mod block;
mod finish;
mod neighbours;
mod patch;
mod receivers;

use std::ops::{ControlFlow, Range};

use super::cell::CELL;
use super::counts::Counts;
use super::cut::Cut;
use super::direct::DirectLighting;
use super::fragment::Fragments;
use super::listed_occluder_cache::ListedOccluderCache;
use crate::color::Rgb;
use crate::film::resolve::ScaledTerm;
use crate::image::Buffer;
use crate::light::LightTree;
use crate::material::{Colors, LightTerm, Lobe, Moments};
use crate::math::{Vec3, square};
use crate::scene::Scene;
use crate::visibility::ClusterVisibility;
use apart::{Apart, SentApart};
use block::{RepresentativeLight, sent};
use finish::UncertainTerm;
use patch::{Patch, Patches};
use receivers::is_alike;

/// Blocks whose cuts have more single lights are quartered. On fairy lights half and twice as many: rms 0.080 and 0.052
/// in place of 0.059 (64 pixels), time 0.93 and 1.15 (128 pixels).
const MAX_SINGLE_LIGHTS: usize = 24;
/// An error that exceeds every tolerance.
const ANYTHING: f32 = 1e30;
/// In an entry of a list of nodes: the estimator is the representative light.
const BY_REPRESENTATIVE: u32 = 1 << 31;
/// Pixels across a block.
const BLOCK: usize = 8;
const BLOCKS: usize = CELL as usize / BLOCK;
/// Sizes of blocks: each has four of the next.
const LEVELS: usize = 3;
/// Different colours of a block that are kept; all others are joined with the last.
const MAX_COLORS: usize = 8;

/// Direct lighting of the fragments of one cell. Keeps its memory.
pub(super) struct Many<'a> {
    scene: &'a Scene,
    patches: Patches,
    tree: &'a LightTree,
    eye: Vec3,
    cluster_visibility: ClusterVisibility,
    cut: Cut,
    cache: ListedOccluderCache,
    /// The light at each patch.
    stored: Vec<PatchLight>,
    /// The single lights, patch by patch, in scene order.
    singles: Vec<SingleLight>,
    /// Entries of the nodes that contribute, list by list.
    lit: Vec<u32>,
    /// The representatives whose visibility is unknown, block by block.
    representatives: Vec<RepresentativeLight>,
    terms: Vec<(u32, LightTerm)>,
    uncertain: Vec<UncertainTerm>,
    apart: Apart<'a>,
    kept: SentApart,
}

/// One light at one patch.
#[derive(Clone, Copy)]
struct SingleLight {
    light: u32,
    moments: Moments,
    /// The difference between the mean of its moments over the patch and those at the point.
    bend: f32,
}

/// The light that arrives at one patch.
#[derive(Clone, Default)]
struct PatchLight {
    singles: Range<u32>,
    /// The nodes of its block, and its own.
    lit: [Range<u32>; 2],
    /// The representatives of its block; the visible ones are among its own nodes.
    maybe: Range<u32>,
    /// The contribution of those nodes at the middle, and the error bound of its difference from the mean over the
    /// patch.
    sent: Colors,
    bend: Colors,
    value: Rgb,
}

impl<'a> Many<'a> {
    /// `buffers` are those of the render: some lights may have buffers of their own.
    pub fn new(scene: &'a Scene, tree: &'a LightTree, buffers: &[Buffer]) -> Self {
        Many {
            scene,
            tree,
            eye: scene.camera.frame().eye,
            cluster_visibility: ClusterVisibility::default(),
            cut: Cut::default(),
            cache: ListedOccluderCache::default(),
            patches: Patches::default(),
            stored: Vec::new(),
            singles: Vec::new(),
            lit: Vec::new(),
            representatives: Vec::new(),
            terms: Vec::new(),
            uncertain: Vec::new(),
            apart: Apart::new(scene, tree, buffers),
            kept: SentApart::new(),
        }
    }

    /// Begins a cell, of which `size` columns and rows are on the film; `pixel` returns the pixel of a fragment.
    pub fn begin(&mut self, fragments: &Fragments, size: [u32; 2], pixel: impl Fn(usize) -> u32) {
        self.patches.begin(self.scene, fragments, size, pixel);
    }

    /// Lights the fragments of the cell. Calls `add` for each pixel with one of its fragments, the terms of single
    /// lights in scene order and last that of all nodes, the terms of lights that have buffers of their own, and the
    /// work.
    pub fn light(
        &mut self,
        fragments: &Fragments,
        lights: &mut DirectLighting<'a>,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
        mut add: impl FnMut(usize, [&[ScaledTerm]; 2], f32),
    ) -> ControlFlow<()> {
        let patches = std::mem::take(&mut self.patches);
        let before = counts.work();
        let lit = self.light_patches(&patches, lights, counts, go_on);
        if lit.is_continue() {
            let each = (counts.work() - before) / (CELL * CELL) as f32;
            let (mut terms, mut apart) = (Vec::new(), Vec::new());
            let mut first = 0;
            for same in patches.all.chunk_by(|a, b| a.pixel == b.pixel) {
                let before = counts.work();
                terms.clear();
                let pixel = first..first + same.len();
                self.finish(fragments, &patches, pixel, lights, counts, [&mut terms, &mut apart]);
                add(same[0].fragment as usize, [&terms, &apart], each + counts.work() - before);
                first += same.len();
            }
        }
        self.patches = patches;
        lit
    }

    /// Evaluates the light at each patch of a cell.
    fn light_patches(
        &mut self,
        patches: &Patches,
        lights: &mut DirectLighting<'a>,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.stored.clear();
        self.stored.resize(patches.all.len(), PatchLight::default());
        self.singles.clear();
        self.lit.clear();
        self.representatives.clear();
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
                self.block(&patches.all, group, 0, None, lights, counts);
            }
        }
        ControlFlow::Continue(())
    }

    fn count(&self, stored: &PatchLight, counts: &mut Counts) {
        let together: u32 =
            self.nodes(stored).map(|node| self.tree.nodes[(node & !BY_REPRESENTATIVE) as usize].count).sum();
        counts.lights.pairs += self.scene.lights.len() as u64;
        counts.lights.singly += stored.singles.len() as u64;
        counts.lights.nodes += stored.lit.iter().map(Range::len).sum::<usize>() as u64;
        counts.lights.together += u64::from(together);
    }

    /// The entries of the nodes that contribute.
    fn nodes(&self, stored: &PatchLight) -> impl Iterator<Item = u32> + '_ {
        stored.lit.clone().into_iter().flat_map(|range| &self.lit[range.start as usize..range.end as usize]).copied()
    }

    /// Adds the contributions of the nodes of one list.
    fn add(&self, patch: &Patch, list: usize, stored: &mut PatchLight) {
        let (point, lobe) = (&patch.point, &patch.point.bsdf.lobe);
        let range = &stored.lit[list];
        for entry in &self.lit[range.start as usize..range.end as usize] {
            let sent = sent(self.scene, self.tree, *entry, point);
            let node = &self.tree.nodes[(entry & !BY_REPRESENTATIVE) as usize];
            stored.sent += sent;
            if point.reach > 0.0 {
                let swing = point.turn + point.reach / node.distance_from(point.p).max(point.reach);
                // Bound of the second derivatives of a far light's contribution, relative to the contribution over the
                // squared distance
                let smooth = (swing * swing).min(1.0) * 3.0;
                let weight = node.weight_at(point.p);
                let moved = swing + point.turn;
                let narrow = (lobe.sharpness(point.ns.dot(point.wo)) * square(moved)).min(1.0);
                let specular = if matches!(lobe, Lobe::None) { 0.0 } else { (narrow + smooth).min(1.0) };
                stored.bend += Colors::bounds(node.power * (weight * smooth), node.power * (weight * specular));
            }
        }
    }
}
