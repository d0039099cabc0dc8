//! Many lights: what arrives at the patches of a cell where not every light is asked for at every one.
//!
//! For each block of pixels, and for its quarters and theirs, a [`Cut`] says which lights count: nodes of the [`LightTree`](crate::light::LightTree) that are seen
//! whole from all of it, and nodes that have to be looked at from each patch. What is dropped, and what is lost by taking many
//! lights for one, stays below [`BLOCK_BUDGET`] and [`PATCH_BUDGET`] together, in display steps.
//!
//! Up to [`SINGLY`] lights are all taken one by one. Of more, one may stand for many: a [`Crowd`] says for which, for each block, and
//! what may be wrong is [`CROWD`] as the root of a sum of squares. Cells and blocks lie on a grid of the film, so nothing depends on
//! tiles, crops or threads.

use std::ops::{ControlFlow, Range};

use super::Counts;
use super::arrival::{Arrival, Arrivals, Place};
use super::crowd::{By, Crowd};
use super::cut::{Cut, Tone, Walk};
use super::fence::Fence;
use super::patch::{Patch, PixelPatches};
use super::tiled::{ACROSS, BEND, CELL, second_difference};
use crate::color::Rgb;
use crate::ids::LightId;
use crate::integrate::Sums;
use crate::light::{Held, LightKind, LightNode, LightTree, Sends, Sent, Zone};
use crate::material::{Bsdf, Lobe};
use crate::math::{Arc, Vec3, square};
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;
use crate::visibility::{Outlook, Seen, Viewpoint};

/// So few lights are all asked for everywhere, and none is left out.
pub(crate) const FEW: usize = 16;
/// So many lights are at most taken one by one; of more, many may be taken for one.
pub(crate) const SINGLY: usize = 1000;
/// In display steps: how far what is settled for a block may be wrong, and what is settled for a patch.
const BLOCK_BUDGET: f32 = 0.45;
const PATCH_BUDGET: f32 = 0.4;
/// In display steps: the root of the sum of squares of all that may be wrong where many are taken for one.
const CROWD: f32 = 1.5;
/// A patch that is darker than was guessed is looked at again beyond this factor of it.
const LENIENT: f32 = 1.25;
/// How much wider the first look at a block is, that says how bright it is.
const PILOT: f32 = 4.0;
/// The part of what that look finds that is taken for sure.
const SURE: f32 = 0.8;
/// Blocks that ask for more lights by themselves are quartered.
const CLOSE: usize = 24;
/// An error that shows whatever is there.
const ANYTHING: f32 = 1e30;
/// In a list of nodes: one light stands for this one.
const ONE: u32 = 1 << 31;
/// In display steps: how far all lights that are integrated one by one may be wrong together, if their errors are independent.
const INTEGRALS: f32 = 0.15;
/// Pixels across a block.
const BLOCK: usize = 8;
const BLOCKS: usize = CELL as usize / BLOCK;
/// Sizes of blocks: each has four of the next.
const LEVELS: usize = 3;
/// What each of those may have of [`BLOCK_BUDGET`]. Together less than all: a patch may be darker than its block was guessed to be.
const SHARES: [f32; LEVELS] = [0.3, 0.15, 0.15];
/// Colours of a block that are told apart.
const TONES: usize = 8;

/// What arrives at the patches of one cell. Keeps its memory.
pub(super) struct Many<'a> {
    scene: &'a Scene,
    tree: &'a LightTree,
    together: bool,
    eye: Vec3,
    outlook: Outlook,
    cut: Cut,
    crowd: Crowd,
    fence: Fence,
    /// Of each patch of the cell, in the order of pixels.
    patches: Vec<Stored>,
    /// The lights that were asked for one by one, patch by patch, in scene order.
    singles: Vec<Single>,
    /// Nodes that are taken for one, list by list.
    lit: Vec<u32>,
    /// Nodes that count where they are seen, block by block.
    dots: Vec<Dot>,
    terms: Vec<(u32, [Rgb; 2])>,
    doubts: Vec<Doubt>,
}

/// One light at one patch.
#[derive(Clone, Copy)]
struct Single {
    light: u32,
    arrival: Arrival,
}

/// A node that counts where the light that stands for it is seen.
#[derive(Clone, Copy)]
struct Dot {
    entry: u32,
    light: u32,
    /// Where the light is; of one that is infinitely far away, its direction.
    at: Vec3,
    finite: bool,
    shadows: bool,
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

/// A light, or all that are taken together, whose mean over a patch is in doubt.
#[derive(Clone, Copy)]
struct Doubt {
    shown: f32,
    /// Among the singles; `None` for the rest.
    single: Option<u32>,
    error: Rgb,
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

/// Where a patch is: its pixel in the cell with its rim, and which of the pixel's it is.
type At = (usize, usize);

impl<'a> Many<'a> {
    pub fn new(scene: &'a Scene, tree: &'a LightTree) -> Self {
        Many {
            scene,
            tree,
            together: scene.lights.len() > SINGLY && scene.geometry.links.is_empty(),
            eye: scene.camera.frame().position,
            outlook: Outlook::default(),
            cut: Cut::default(),
            crowd: Crowd::default(),
            fence: Fence::default(),
            patches: Vec::new(),
            singles: Vec::new(),
            lit: Vec::new(),
            dots: Vec::new(),
            terms: Vec::new(),
            doubts: Vec::new(),
        }
    }

    /// Finds out what arrives at the middle of each patch of a cell and its rim. `first` says where each pixel's patches begin among
    /// all.
    pub fn look(
        &mut self,
        pixels: &[PixelPatches],
        first: &mut [usize],
        arrivals: &mut Arrivals<'a>,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut all = 0;
        for (first, pixel) in first.iter_mut().zip(pixels) {
            *first = all;
            all += pixel.patches.len();
        }
        self.patches.clear();
        self.patches.resize(all, Stored::default());
        self.singles.clear();
        self.lit.clear();
        self.dots.clear();
        let mut groups: Vec<Vec<At>> = Vec::new();
        let all = Above {
            level: 0,
            open: self.tree.roots.clone(),
            known: [0.0; 3],
            error: [Rgb::BLACK; 2],
            lit: Default::default(),
        };
        for block in 0..BLOCKS * BLOCKS {
            go_on()?;
            groups.iter_mut().for_each(Vec::clear);
            // The rim belongs to the blocks beside it
            let side = |b: usize| {
                let from = if b == 0 { 0 } else { 1 + b * BLOCK };
                from..if b + 1 == BLOCKS { ACROSS } else { 1 + (b + 1) * BLOCK }
            };
            for y in side(block / BLOCKS) {
                for x in side(block % BLOCKS) {
                    let index = y * ACROSS + x;
                    for (k, patch) in pixels[index].patches.iter().enumerate() {
                        let same = |group: &&mut Vec<At>| {
                            group.first().is_none_or(|(i, k)| is_alike(&pixels[*i].patches[*k], patch))
                        };
                        match groups.iter_mut().find(same) {
                            Some(group) => group.push((index, k)),
                            None => groups.push(vec![(index, k)]),
                        }
                    }
                }
            }
            for group in groups.iter().filter(|group| !group.is_empty()) {
                if self.together {
                    self.crowd(pixels, first, group, 0, None, arrivals, counts);
                } else {
                    self.group(pixels, first, group, &all, arrivals, counts);
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// The places of a block that lie on one surface.
    fn group(
        &mut self,
        pixels: &[PixelPatches],
        first: &[usize],
        group: &[At],
        above: &Above,
        arrivals: &mut Arrivals<'a>,
        counts: &mut Counts,
    ) {
        let (scene, tree) = (self.scene, self.tree);
        let patch = |(index, k): &At| &pixels[*index].patches[*k];
        let zone = zone(group.iter().map(patch), self.eye);
        let tones = tones(scene, group.iter().map(patch));
        let one = patch(&group[0]);
        let receives = group.iter().any(|at| patch(at).si.receives_shadow);
        let places = group.iter().map(|at| standing(patch(at)));
        self.outlook.stand(scene, places);
        let (outlook, level) = (&mut self.outlook, arrivals.level());
        let (steps, budget) = (arrivals.display_steps(), BLOCK_BUDGET * SHARES[above.level]);
        let walk = Walk { tree, steps, zone: &zone, tones: &tones, budget };
        let links = scene.geometry.lights_of(one.si.surface);
        let shines = |light: u32| scene.geometry.links.contains(links, LightId(light));
        self.cut.of_block(
            &walk,
            &above.open,
            above.known,
            &mut |node, light| {
                if !(receives && node.shadows) {
                    return Seen::Whole;
                }
                outlook.look(level, scene, node.shine.low, node.shine.high, LightId(light))
            },
            &shines,
        );
        let start = self.lit.len() as u32;
        self.lit.extend(&self.cut.lit);
        let mut lit = above.lit.clone();
        lit[above.level] = start..self.lit.len() as u32;
        let error = self.cut.error();
        let here = Above {
            level: above.level + 1,
            open: std::mem::take(&mut self.cut.open),
            known: self.cut.known(),
            error: [above.error[0] + error[0], above.error[1] + error[1]],
            lit,
        };
        if here.level == LEVELS || here.open.is_empty() {
            for at in group {
                self.patches[first[at.0] + at.1] = self.settle(patch(at), &here, arrivals, counts);
            }
            return;
        }
        // In four, by where they are in the block
        let half = BLOCK >> here.level;
        for quarter in 0..4 {
            let is_in = |(index, _): &&At| {
                let part = |v: usize| (v.clamp(1, CELL as usize) - 1) / half % 2;
                part(index / ACROSS) * 2 + part(index % ACROSS) == quarter
            };
            let part: Vec<At> = group.iter().filter(is_in).copied().collect();
            if !part.is_empty() {
                self.group(pixels, first, &part, &here, arrivals, counts);
            }
        }
    }

    /// The places of a block that lie on one surface, where lights are so many that one may stand for others. `guess` is what is
    /// known to be sent there.
    #[allow(clippy::too_many_arguments, reason = "a block of a cell, and what it asks with")]
    fn crowd(
        &mut self,
        pixels: &[PixelPatches],
        first: &[usize],
        group: &[At],
        level: usize,
        guess: Option<Rgb>,
        arrivals: &mut Arrivals<'a>,
        counts: &mut Counts,
    ) {
        let (scene, tree) = (self.scene, self.tree);
        let patch = |(index, k): &At| &pixels[*index].patches[*k];
        let zone = zone(group.iter().map(patch), self.eye);
        let tones = tones(scene, group.iter().map(patch));
        let receives = group.iter().any(|at| patch(at).si.receives_shadow);
        self.outlook.stand(scene, group.iter().map(|at| standing(patch(at))));
        let steps = arrivals.display_steps();
        let walk = Walk { tree, steps, zone: &zone, tones: &tones, budget: CROWD };
        let mut crowd = std::mem::take(&mut self.crowd);
        let (simd, outlook, fence) = (arrivals.level(), &mut self.outlook, &mut self.fence);
        let mut look = |node: &LightNode, light: u32| {
            if !(receives && node.shadows) {
                return Seen::Whole;
            }
            outlook.look(simd, scene, node.shine.low, node.shine.high, LightId(light))
        };
        crowd.begin(&walk);
        let guess = guess.unwrap_or_else(|| {
            crowd.refine(&Walk { budget: CROWD * PILOT, ..walk }, None, &mut look);
            crowd.peek();
            let some = [0, group.len() / 2, group.len() - 1].map(|i| patch(&group[i]));
            let all = some.map(|patch| {
                fence.stand(scene, &patch.si);
                crowd.nodes.iter().fold(Rgb::BLACK, |sum, (node, by)| match entry(*node, *by) {
                    entry
                        if matches!(by, By::Middle | By::One)
                            || Dot::new(tree, entry).arrives(scene, fence, &patch.si) =>
                    {
                        sum + sent(scene, tree, entry, &patch.si, &patch.bsdf.lobe)[0]
                    }
                    _ => sum,
                })
            });
            all.into_iter().reduce(Rgb::min).unwrap_or(Rgb::BLACK) * SURE
        });
        crowd.refine(&walk, Some(guess), &mut look);
        let is_close = crowd.singles.len() > CLOSE && level < LEVELS && group.len() > 1;
        let (mut again, mut darkest) = (Vec::new(), guess);
        if is_close {
            again.extend_from_slice(group);
        } else {
            crowd.settle(&walk, group.len(), &mut look);
            let start = self.lit.len() as u32;
            let everywhere = crowd.nodes.iter().filter(|(_, by)| matches!(by, By::Middle | By::One));
            self.lit.extend(everywhere.map(|(node, by)| entry(*node, *by)));
            let lit = start..self.lit.len() as u32;
            let start = self.dots.len() as u32;
            let sometimes = crowd.nodes.iter().filter(|(_, by)| matches!(by, By::MiddleIfSeen | By::OneIfSeen));
            self.dots.extend(sometimes.map(|(node, by)| Dot::new(tree, entry(*node, *by))));
            let maybe = start..self.dots.len() as u32;
            let mut found: Option<Rgb> = None;
            for at in group {
                let patch = patch(at);
                let singles = self.singles.len();
                let lists = [lit.clone(), maybe.clone()];
                let (stored, light) = self.in_crowd(patch, &crowd.singles, lists, arrivals, counts);
                let error = crowd.error([patch.bsdf.diffuse, patch.bsdf.specular]);
                if arrivals.steps(stored.value, error) > CROWD * LENIENT && guess != Rgb::BLACK {
                    // Darker than was guessed
                    self.singles.truncate(singles);
                    found = Some(found.map_or(light, |found| found.min(light)));
                    again.push(*at);
                    continue;
                }
                self.count(&stored, counts);
                self.patches[first[at.0] + at.1] = stored;
            }
            darkest = if level < LEVELS {
                found.unwrap_or(guess) * SURE
            } else if level < 2 * LEVELS {
                found.unwrap_or(guess).min(guess) * 0.5
            } else {
                Rgb::BLACK
            };
        }
        self.crowd = crowd;
        if again.is_empty() {
            return;
        }
        let half = (BLOCK >> (level + 1)).max(1);
        for quarter in 0..4 {
            let is_in = |(index, _): &&At| {
                let part = |v: usize| (v.clamp(1, CELL as usize) - 1) / half % 2;
                part(index / ACROSS) * 2 + part(index % ACROSS) == quarter
            };
            let part: Vec<At> = again.iter().filter(is_in).copied().collect();
            if !part.is_empty() {
                self.crowd(pixels, first, &part, level + 1, Some(darkest), arrivals, counts);
            }
        }
    }

    /// What arrives at one patch of a block, as its block says; and what of it is diffuse light.
    fn in_crowd(
        &mut self,
        patch: &Patch,
        singles: &[u32],
        [everywhere, maybe]: [Range<u32>; 2],
        arrivals: &mut Arrivals<'a>,
        counts: &mut Counts,
    ) -> (Stored, Rgb) {
        let scene = self.scene;
        let (si, bsdf) = (&patch.si, &patch.bsdf);
        let mut stored = Stored::default();
        let start = self.lit.len() as u32;
        counts.points += maybe.len() as u64;
        if !maybe.is_empty() {
            self.fence.stand(scene, si);
        }
        let dots = &self.dots[maybe.start as usize..maybe.end as usize];
        let seen = dots.iter().filter(|dot| dot.arrives(scene, &self.fence, si));
        self.lit.extend(seen.map(|dot| dot.entry));
        (stored.lit[0], stored.maybe) = (everywhere, maybe);
        stored.lit[LEVELS] = start..self.lit.len() as u32;
        self.add(patch, 0, &mut stored);
        self.add(patch, LEVELS, &mut stored);
        stored.value = scene.ambient * bsdf.ambient + bsdf.diffuse * stored.sent[0] + bsdf.specular * stored.sent[1];
        let from = self.singles.len() as u32;
        let mut light = stored.sent[0];
        if !singles.is_empty() {
            arrivals.look_around(si);
            arrivals.tolerate(INTEGRALS / (singles.len() as f32).sqrt());
        }
        for index in singles {
            let scale = arrivals.scale(*index as usize);
            let colors = [scale * bsdf.diffuse, scale * bsdf.specular];
            let (reach, turn, off) = (patch.reach, patch.turn, patch.off);
            let place = Place { si, lobe: &bsdf.lobe, reach, turn, off, share: 1.0, base: stored.value, colors };
            let arrival = arrivals.arrival(*index as usize, &place, counts);
            light += scale * arrival.sums.diffuse;
            stored.value += colors[0] * arrival.sums.diffuse + colors[1] * arrival.sums.specular;
            self.singles.push(Single { light: *index, arrival });
        }
        stored.singles = from..self.singles.len() as u32;
        (stored, light)
    }

    /// What arrives at one patch of a block.
    fn settle(&mut self, patch: &Patch, above: &Above, arrivals: &mut Arrivals<'a>, counts: &mut Counts) -> Stored {
        let singles = self.singles.len();
        let mut stored = self.patch(patch, &above.lit, &above.open, arrivals, counts);
        let bsdf = &patch.bsdf;
        let shown = arrivals.steps(stored.value, bsdf.diffuse * above.error[0] + bsdf.specular * above.error[1]);
        if shown > BLOCK_BUDGET {
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
        let value = base + bsdf.diffuse * stored.sent[0] + bsdf.specular * stored.sent[1];
        let from = self.singles.len();
        stored.value = value;
        if !open.is_empty() {
            arrivals.look_around(si);
            arrivals.tolerate(INTEGRALS / (open.len() as f32).sqrt());
            let zone = zone(std::iter::once(patch), self.eye);
            let tones = [tone(scene, bsdf)];
            let steps = arrivals.display_steps();
            let walk = Walk { tree, steps, zone: &zone, tones: &tones, budget: PATCH_BUDGET };
            let (outlook, singles, level) = (&mut self.outlook, &mut self.singles, arrivals.level());
            let mut stands = false;
            stored.value = self.cut.of_patch(
                &walk,
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
                    let scale = arrivals.scale(light as usize);
                    let colors = [scale * bsdf.diffuse, scale * bsdf.specular];
                    let (reach, turn, off) = (patch.reach, patch.turn, patch.off);
                    let place = Place { si, lobe: &bsdf.lobe, reach, turn, off, share: 1.0, base: value, colors };
                    let arrival = arrivals.arrival(light as usize, &place, counts);
                    singles.push(Single { light, arrival });
                    colors[0] * arrival.sums.diffuse + colors[1] * arrival.sums.specular
                },
            );
            let start = self.lit.len() as u32;
            self.lit.extend(&self.cut.lit);
            stored.lit[LEVELS] = start..self.lit.len() as u32;
            let before = stored.sent;
            self.add(patch, LEVELS, &mut stored);
            for (color, i) in [(bsdf.diffuse, 0), (bsdf.specular, 1)] {
                stored.value += color * (stored.sent[i] + before[i] * -1.0);
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
            stored.sent = [stored.sent[0] + sent[0], stored.sent[1] + sent[1]];
            if patch.reach > 0.0 {
                let swing = patch.turn + patch.reach / node.distance(si.lit_from).max(patch.reach);
                let smooth = (swing * swing + 2.0 * swing * patch.off).min(1.0) * SMOOTH;
                let weight = node.weight(si.lit_from);
                let moved = swing + patch.turn;
                let narrow = (lobe.sharpness(si.ns.dot(si.wo)) * square(moved)).min(1.0);
                let narrow = (narrow + 2.0 * narrow.sqrt() * patch.off).min(1.0);
                let specular = if matches!(lobe, Lobe::None) { 0.0 } else { (narrow + smooth).min(1.0) };
                stored.bend = [
                    stored.bend[0] + node.power * (weight * smooth),
                    stored.bend[1] + node.power * (weight * specular),
                ];
            }
        }
    }

    /// The colour of a pixel's surfaces, but for emission and ambient light: what each ray sees, added up. `add` hears each
    /// light's diffuse part and highlight, in scene order, and last what is taken together.
    #[allow(clippy::too_many_arguments, reason = "a pixel among those of a cell, and what it asks with")]
    pub fn finish(
        &mut self,
        pixels: &[PixelPatches],
        first: &[usize],
        index: usize,
        at: [u32; 2],
        arrivals: &mut Arrivals<'a>,
        counts: &mut Counts,
        mut add: impl FnMut([Rgb; 2]),
    ) {
        let scene = self.scene;
        let mut terms = std::mem::take(&mut self.terms);
        let mut fence = std::mem::take(&mut self.fence);
        terms.clear();
        let mut together = [Rgb::BLACK; 2];
        for (k, patch) in pixels[index].patches.iter().enumerate() {
            let count = patch.count(scene) as f32;
            let stored = &self.patches[first[index] + k];
            let mut doubts = std::mem::take(&mut self.doubts);
            self.doubts_of(pixels, first, (index, k), arrivals, &mut doubts);
            doubts.sort_unstable_by_key(|doubt| doubt.single);
            let in_doubt = |single: Option<u32>| doubts.binary_search_by_key(&single, |doubt| doubt.single).is_ok();
            let bsdf = &patch.bsdf;
            if !in_doubt(None) {
                together[0] += bsdf.diffuse * stored.sent[0] * count;
                together[1] += bsdf.specular * stored.sent[1] * count;
            }
            for i in stored.singles.clone() {
                if !in_doubt(Some(i)) {
                    let Single { light, arrival } = self.singles[i as usize];
                    let scale = arrivals.scale(light as usize) * count;
                    let diffuse = scale * bsdf.diffuse * arrival.sums.diffuse;
                    terms.push((light, [diffuse, scale * bsdf.specular * arrival.sums.specular]));
                }
            }
            if !doubts.is_empty() {
                arrivals.tolerate(INTEGRALS / (doubts.len() as f32).sqrt());
                patch.for_each(scene, at, |si, bsdf| {
                    arrivals.look_around(si);
                    for doubt in &doubts {
                        match doubt.single {
                            Some(i) => {
                                let light = self.singles[i as usize].light;
                                terms.push((light, arrivals.at_point(light as usize, si, bsdf, 1.0, counts)));
                            }
                            None => {
                                let [diffuse, specular] = self.sent_at(stored, &mut fence, si, &bsdf.lobe);
                                together[0] += bsdf.diffuse * diffuse;
                                together[1] += bsdf.specular * specular;
                            }
                        }
                    }
                });
            }
            self.doubts = doubts;
        }
        // In scene order
        terms.sort_by_key(|(light, _)| *light);
        for same in terms.chunk_by(|a, b| a.0 == b.0) {
            add(same.iter().fold([Rgb::BLACK; 2], |sum, (_, term)| [sum[0] + term[0], sum[1] + term[1]]));
        }
        add(together);
        (self.terms, self.fence) = (terms, fence);
    }

    /// What nodes send to where one camera ray ends.
    fn sent_at(&self, stored: &Stored, fence: &mut Fence, si: &SurfaceInteraction, lobe: &Lobe) -> Sent {
        let (scene, tree) = (self.scene, self.tree);
        let mut sum = [Rgb::BLACK; 2];
        let mut add = |entry: u32| {
            let sent = sent(scene, tree, entry, si, lobe);
            sum = [sum[0] + sent[0], sum[1] + sent[1]];
        };
        if stored.maybe.is_empty() {
            self.nodes(stored).for_each(&mut add);
            return sum;
        }
        let list = |range: &Range<u32>| &self.lit[range.start as usize..range.end as usize];
        list(&stored.lit[0]).iter().for_each(|entry| add(*entry));
        fence.stand(scene, si);
        let dots = &self.dots[stored.maybe.start as usize..stored.maybe.end as usize];
        dots.iter().filter(|dot| dot.arrives(scene, fence, si)).for_each(|dot| add(dot.entry));
        sum
    }

    /// How far the mean over a patch can be from what arrives at its middle because other lights are seen from elsewhere on it:
    /// as its neighbours tell, and anything where they do not.
    fn flicker(&self, pixels: &[PixelPatches], first: &[usize], (index, k): At) -> Rgb {
        let patch = &pixels[index].patches[k];
        let stored = &self.patches[first[index] + k];
        if patch.reach == 0.0 || stored.maybe.is_empty() {
            return Rgb::BLACK;
        }
        let anything = Rgb::new(ANYTHING, ANYTHING, ANYTHING);
        if !patch.is_whole(self.scene) {
            return anything;
        }
        let mut all = Rgb::BLACK;
        for channel in 0..3 {
            let of = |color: Rgb| [color.r, color.g, color.b][channel];
            let sums = |stored: &Stored| Sums { diffuse: of(stored.sent[0]), specular: of(stored.sent[1]) };
            let arrived = |index: usize| Some(sums(&self.patches[first[index]]));
            let Some(bend) = second_difference(self.scene, pixels, index, patch, &sums(stored), arrived) else {
                return anything;
            };
            let one = |channel_of: usize| if channel_of == channel { 1.0 } else { 0.0 };
            let mask = Rgb::new(one(0), one(1), one(2));
            all += mask * (patch.bsdf.diffuse * bend.diffuse + patch.bsdf.specular * bend.specular);
        }
        all
    }

    /// What of the light at a patch has to be asked for at each ray. All the rest may together bend by as much as one may.
    fn doubts_of(
        &self,
        pixels: &[PixelPatches],
        first: &[usize],
        (index, k): At,
        arrivals: &Arrivals,
        doubts: &mut Vec<Doubt>,
    ) {
        doubts.clear();
        let patch = &pixels[index].patches[k];
        let stored = &self.patches[first[index] + k];
        let (bsdf, value) = (&patch.bsdf, stored.value);
        let mut all = Rgb::BLACK;
        let mut doubt = |single: Option<u32>, error: Rgb| {
            all += error;
            doubts.push(Doubt { shown: 0.0, single, error });
        };
        if stored.lit.iter().any(|range| !range.is_empty()) {
            let smooth = bsdf.diffuse * stored.bend[0] + bsdf.specular * stored.bend[1];
            doubt(None, smooth + self.flicker(pixels, first, (index, k)));
        }
        let shown = |light: u32, bend: &Sums| {
            let scale = arrivals.scale(light as usize);
            scale * bsdf.diffuse * bend.diffuse + scale * bsdf.specular * bend.specular
        };
        for i in stored.singles.clone() {
            let Single { light, arrival } = &self.singles[i as usize];
            doubt(Some(i), shown(*light, &arrival.bend));
        }
        if patch.uneven {
            return;
        }
        if arrivals.steps(value, all) <= BEND {
            doubts.clear();
            return;
        }
        for doubt in &mut *doubts {
            doubt.shown = arrivals.steps(value, doubt.error);
        }
        // The least first: as many as will do together
        doubts.sort_unstable_by(|a, b| a.shown.total_cmp(&b.shown).then(a.single.cmp(&b.single)));
        let mut sum = Rgb::BLACK;
        doubts.retain(|doubt| {
            if arrivals.steps(value, sum + doubt.error) <= BEND {
                sum += doubt.error;
                return false;
            }
            let Some(i) = doubt.single else { return true };
            let here = &self.singles[i as usize];
            if !here.arrival.resolved || !patch.is_whole(self.scene) {
                return true;
            }
            let arrived = |index: usize| {
                let stored = &self.patches[first[index]];
                let range = stored.singles.start as usize..stored.singles.end as usize;
                let singles = &self.singles[range];
                let found = singles.binary_search_by_key(&here.light, |single| single.light).ok()?;
                Some(singles[found].arrival.sums)
            };
            let Some(bend) = second_difference(self.scene, pixels, index, patch, &here.arrival.sums, arrived) else {
                return true;
            };
            let error = shown(here.light, &bend);
            if arrivals.steps(value, sum + error) <= BEND {
                sum += error;
                return false;
            }
            true
        });
    }
}

/// No second derivative of what a far light sends is above this, over the square of its distance, and what it sends.
const SMOOTH: f32 = 3.0;

/// A node as lists of nodes name it.
fn entry(node: u32, by: By) -> u32 {
    if matches!(by, By::One | By::OneIfSeen) { node | ONE } else { node }
}

impl Dot {
    fn new(tree: &LightTree, entry: u32) -> Dot {
        let node = &tree.nodes[(entry & !ONE) as usize];
        let one = &tree.nodes[node.one as usize];
        let light = match one.held {
            Held::Light(light) => light,
            Held::Two(_) => one.first(tree),
        };
        let finite = one.shine.sends != Sends::Parallel;
        let at = if finite { one.shine.ball().0 } else { one.shine.low };
        Dot { entry, light, at, finite, shadows: node.shadows }
    }

    /// Whether its light is seen from where `fence` stands.
    #[inline]
    fn arrives(&self, scene: &Scene, fence: &Fence, si: &SurfaceInteraction) -> bool {
        if !(si.receives_shadow && self.shadows) {
            return true;
        }
        let l = if self.finite { self.at - si.lit_from } else { self.at };
        si.horizon.dot(l) > 0.0 && si.ns.dot(l) > 0.0 && !fence.blocks(scene, LightId(self.light), l, self.finite)
    }
}

/// What an entry of a list of nodes sends: diffuse and specular, before the colours of the surface.
#[inline(always)]
fn sent(scene: &Scene, tree: &LightTree, entry: u32, si: &SurfaceInteraction, lobe: &Lobe) -> Sent {
    let node = &tree.nodes[(entry & !ONE) as usize];
    if entry & ONE == 0 {
        return node.send(si.lit_from, si.ns, si.wo, lobe);
    }
    let [diffuse, specular] = sent_by_one(scene, &tree.nodes[node.one as usize], si, lobe);
    [node.power * diffuse, node.power * specular]
}

/// What one light would send if its power were 1.
fn sent_by_one(scene: &Scene, one: &LightNode, si: &SurfaceInteraction, lobe: &Lobe) -> [f32; 2] {
    let Held::Light(light) = one.held else { return [0.0; 2] };
    let light = &scene.lights[light as usize];
    let k = light.samples() / 2;
    let l = light.towards(k, si.lit_from).l;
    let height = si.ns.dot(l);
    if !(si.horizon.dot(l) > 0.0 && height > 0.0) {
        return [0.0; 2];
    }
    if matches!(light.kind, LightKind::Area(_)) && one.is_smooth() {
        return one.send_one(si.lit_from, si.ns, si.wo, lobe);
    }
    let Some(sample) = light.sample(k, l) else { return [0.0; 2] };
    let (cos_i, cos_io) = (height * sample.inverse_distance, si.wo.dot(l) * sample.inverse_distance);
    [cos_i * sample.weight, lobe.eval(cos_i, si.ns.dot(si.wo), cos_io) * sample.weight]
}

/// Whether two patches can be looked at together.
fn is_alike(a: &Patch, b: &Patch) -> bool {
    a.si.surface == b.si.surface && a.bsdf.lobe == b.bsdf.lobe && a.si.ns.dot(b.si.ns) > 0.8
}

fn standing(patch: &Patch) -> (Viewpoint, f32, bool) {
    (Viewpoint::of(&patch.si), patch.reach, patch.turn > 0.0)
}

/// The direction that the middle of a highlight comes from.
fn mirror(si: &SurfaceInteraction) -> Vec3 {
    si.ns * (2.0 * si.ns.dot(si.wo)) - si.wo
}

/// The zone of some patches, of one surface and one highlight.
fn zone<'p>(patches: impl Iterator<Item = &'p Patch> + Clone, eye: Vec3) -> Zone {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (mut n, mut m, mut w) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
    let mut lobe = Lobe::None;
    for Patch { si, bsdf, .. } in patches.clone() {
        (low, high) = (low.min(si.lit_from), high.max(si.lit_from));
        (n, m, w) = (n + si.ns, m + mirror(si), w + si.wo);
        lobe = bsdf.lobe;
    }
    let center = low + (high - low) * 0.5;
    let (n, m, w) = (n.normalize_or(Vec3::Y), m.normalize_or(Vec3::Y), w.normalize_or(Vec3::Y));
    let (mut reach, mut turn, mut blur, mut wo_turn) = (0.0f32, 0.0f32, 0.0f32, 0.0f32);
    for Patch { si, reach: around, turn: turns, .. } in patches {
        let swing = around / (si.lit_from - eye).length().max(*around).max(f32::MIN_POSITIVE);
        reach = reach.max((si.lit_from - center).length() + around);
        turn = turn.max((si.ns - n).length().max((si.horizon - n).length()) + turns);
        blur = blur.max((mirror(si) - m).length() + 2.0 * turns + swing);
        wo_turn = wo_turn.max((si.wo - w).length() + swing);
    }
    Zone {
        center,
        reach,
        n,
        turn: Arc::of_chord(turn),
        mirror: m,
        blur: Arc::of_chord(blur),
        wo: w,
        wo_turn: Arc::of_chord(wo_turn),
        lobe,
    }
}

fn tone(scene: &Scene, bsdf: &Bsdf) -> Tone {
    Tone { base: scene.ambient * bsdf.ambient, known: bsdf.diffuse, error: [bsdf.diffuse, bsdf.specular] }
}

/// The colours of some patches: each once, or where they are too many the rest as one.
fn tones<'p>(scene: &Scene, patches: impl Iterator<Item = &'p Patch>) -> Vec<Tone> {
    let mut tones: Vec<Tone> = Vec::with_capacity(TONES);
    for patch in patches {
        let new = tone(scene, &patch.bsdf);
        let same = |tone: &Tone| tone.known == new.known && tone.error == new.error && tone.base == new.base;
        if tones.iter().any(same) {
            continue;
        }
        if tones.len() < TONES {
            tones.push(new);
            continue;
        }
        let last = &mut tones[TONES - 1];
        *last = Tone {
            base: last.base.min(new.base),
            known: last.known.min(new.known),
            error: [last.error[0].max(new.error[0]), last.error[1].max(new.error[1])],
        };
    }
    tones
}
