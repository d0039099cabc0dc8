//! What of each light the rays of a block of pixels see past what lies in trees: gathered for all of them together, so
//! that a patch is asked once where nothing is in the way from any of its rays, and its rays are asked together where
//! something is.

use std::ops::Range;

use super::{ACROSS, CELL, Tiled};
use crate::color::Rgb;
use crate::ids::LightId;
use crate::material::Moments;
use crate::render::Counts;
use crate::render::arrival::{ArrivalPlace, Arrivals, Past};
use crate::render::patch::{Member, Patch, PixelPatches, Rays};
use crate::render::resolve::LightTerm;
use crate::render::tile::Tile;
use crate::render::together::{Outcome, Together, salt};
use crate::visibility::{View, Viewpoint, Visibility};

/// What the rays of one patch see of one light.
#[derive(Clone, Copy, Debug, Default)]
pub(super) enum Outlook {
    /// Nobody looked: nothing is known.
    #[default]
    Unknown,
    /// All of it, but for what is below the horizon.
    Lit,
    /// Nothing in trees is in the way; what is in lists may be.
    Clear,
    /// Nothing of it.
    Dark,
    /// Rays differ, and nobody asked.
    Parted,
    /// Rays differ, and were asked: what all of them see, added up, diffuse and specular.
    Settled(LightTerm),
}

/// What one ray sees of one light.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sight {
    Lit,
    Clear,
    /// Something in trees is in the way that batches know.
    Near,
    Dark,
    BelowHorizon,
    Behind,
}

/// The rays of a block of pixels, as they look for lights. Keeps its memory.
#[derive(Default)]
pub(super) struct Block {
    points: Vec<Viewpoint>,
    patches: Vec<BlockPatch>,
}

/// What the rays of a block see of one light. Keeps its memory.
#[derive(Default)]
pub(super) struct Sights {
    /// Which patches are asked.
    open: Vec<bool>,
    order: Vec<u32>,
    sights: Vec<Sight>,
    /// Of those that are behind things, what is in the way.
    views: Vec<Option<View>>,
}

/// A patch of a pixel of the block.
#[derive(Clone, Copy)]
struct BlockPatch {
    /// The pixel, as the cell counts them, and which of its patches.
    pixel: u32,
    patch: u32,
    /// The first of its rays in the block, and how many.
    first: u32,
    count: u32,
}

impl Tiled<'_> {
    /// Makes room for what the rays of each patch of the cell see.
    pub(super) fn begin_looking(&mut self) {
        self.wholes.iter_mut().for_each(Vec::clear);
        for (pixel, seen) in self.pixels.iter().zip(&mut self.seen) {
            *seen = self.outlooks.len();
            let count = self.outlooks.len() + pixel.patches.len() * self.scene.lights.len();
            self.outlooks.resize(count, Outlook::Unknown);
        }
    }

    /// Looks from all rays of the pixels from `from`, `size` of them across and down, for all lights that nothing is
    /// known of yet.
    pub(super) fn look(&mut self, tile: &Tile, from: [u32; 2], size: [u32; 2], counts: &mut Counts) {
        let mut block = std::mem::take(&mut self.block);
        block.clear();
        for (y, x) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y, x))) {
            let index = self.index([from[0] + x, from[1] + y]);
            block.add(&self.pixels[index], index);
        }
        let lights = self.scene.lights.len();
        let mut sights = std::mem::take(&mut self.sights);
        sights.resize_with(lights, Sights::default);
        for (light, sights) in sights.iter_mut().enumerate() {
            sights.open.clear();
            let is_open = |patch: &BlockPatch| {
                let outlook = self.outlook(patch.pixel as usize, patch.patch as usize, light);
                self.arrivals.looks_for(light) && matches!(outlook, Outlook::Unknown)
            };
            sights.open.extend(block.patches.iter().map(is_open));
            if !sights.open.contains(&true) {
                continue;
            }
            self.look_for(&block, light, sights, counts);
            for (patch, _) in block.patches.iter().zip(&sights.open).filter(|(_, is_open)| **is_open) {
                let first = self.seen[patch.pixel as usize] + patch.patch as usize * lights;
                self.outlooks[first + light] = sights.outlook(patch);
            }
        }
        // With all that is known of other lights
        for (light, sights) in sights.iter_mut().enumerate() {
            let is_wanted = |k: &usize| {
                let patch = &block.patches[*k];
                let first = self.seen[patch.pixel as usize] + patch.patch as usize * lights;
                sights.open[*k]
                    && matches!(self.outlooks[first + light], Outlook::Parted)
                    && self.is_asked(tile, patch.pixel as usize)
            };
            let wanted: Vec<usize> = (0..block.patches.len()).filter(is_wanted).collect();
            let before = counts.work();
            let ask = |k: &usize| self.together(&block, *k, light, sights, counts);
            let mut all: Vec<Together> = wanted.iter().map(ask).collect();
            Together::tell(&mut all, &mut self.arrivals, counts);
            let each = (counts.work() - before) / wanted.len().max(1) as f32;
            for (k, together) in wanted.into_iter().zip(all) {
                let patch = &block.patches[k];
                let first = self.seen[patch.pixel as usize] + patch.patch as usize * lights;
                let before = counts.work();
                let terms = together.settle(&mut self.arrivals, counts).terms;
                self.work[patch.pixel as usize] += each + counts.work() - before;
                self.outlooks[first + light] = Outlook::Settled(terms);
            }
            sights.views.iter_mut().filter_map(Option::take).for_each(|view| self.arrivals.keep(view));
        }
        self.sights = sights;
        self.block = block;
    }

    /// What lights other than one send to each ray of a patch, at least, as far as that is known by now.
    pub(super) fn others(&mut self, index: usize, k: usize, light: usize) -> Rgb {
        let scene = self.scene;
        let rays = self.pixels[index].patches[k].count(scene) as f32;
        let mut others = Rgb::BLACK;
        for other in (0..scene.lights.len()).filter(|other| *other != light) {
            let share = match self.outlook(index, k, other) {
                Outlook::Settled(terms) => {
                    others += terms.sum() * (1.0 / rays);
                    continue;
                }
                Outlook::Lit => 1.0,
                Outlook::Unknown => self.share_seen(index, other),
                Outlook::Clear | Outlook::Dark | Outlook::Parted => 0.0,
            };
            if share > 0.0 {
                others += self.unshadowed(index, k, other) * share;
            }
        }
        others
    }

    /// What a light would send to the middle of a pixel's patch if nothing were in the way, with all colours; black
    /// where that is not known. All patches of the cell are asked together.
    fn unshadowed(&mut self, index: usize, k: usize, light: usize) -> Rgb {
        if self.arrivals.lights.emitters[light].is_none() {
            return Rgb::BLACK;
        }
        if self.wholes[light].is_empty() {
            let arrivals = &mut self.arrivals;
            let patches = self.pixels.iter().flat_map(|pixel| &pixel.patches);
            let places: Vec<_> = patches.map(|patch| arrivals.place(light, &patch.si, &patch.bsdf)).collect();
            self.wholes[light] = arrivals.wholes(light, &places);
        }
        let Patch { si, bsdf, .. } = &self.pixels[index].patches[k];
        let colors = self.arrivals.place(light, si, bsdf).colors();
        let number = self.seen[index] / self.scene.lights.len() + k;
        colors.of(&self.wholes[light][number].sums)
    }

    /// What all rays of a pixel's only patch see of a light, ray by ray.
    pub(super) fn settled(&mut self, index: usize, light: usize, counts: &mut Counts) -> Outcome {
        let mut block = std::mem::take(&mut self.block);
        block.clear();
        block.add(&self.pixels[index], index);
        let mut sights = self.sights.pop().unwrap_or_default();
        sights.open.clear();
        sights.open.push(true);
        self.look_for(&block, light, &mut sights, counts);
        let before = counts.work();
        let together = self.together(&block, 0, light, &mut sights, counts);
        let outcome = together.finish(&mut self.arrivals, counts);
        self.work[index] += counts.work() - before;
        sights.views.iter_mut().filter_map(Option::take).for_each(|view| self.arrivals.keep(view));
        self.sights.push(sights);
        self.block = block;
        outcome
    }

    /// Whether a pixel of the cell, by its place in it, is in a tile.
    fn is_asked(&self, tile: &Tile, index: usize) -> bool {
        let [x, y] = self.corner;
        let cell = Tile { x, y, width: CELL, height: CELL };
        let at = self.at(index);
        tile.contains(at) && cell.contains(at)
    }

    /// Where a pixel of the cell or its rim is on the film.
    fn at(&self, index: usize) -> [u32; 2] {
        [0, 1].map(|axis| {
            let place = [index % ACROSS, index / ACROSS][axis];
            (self.corner[axis] + place as u32).wrapping_sub(1)
        })
    }

    /// Asks for a light at all rays of a patch of the block.
    fn together(
        &mut self,
        block: &Block,
        k: usize,
        light: usize,
        sights: &mut Sights,
        counts: &mut Counts,
    ) -> Together {
        let patch = block.patches[k];
        let index = patch.pixel as usize;
        let others = self.others(index, patch.patch as usize, light);
        let members = patch.members(&self.pixels);
        let share = self.share_of(patch.count);
        let salt = salt(self.at(index), members[0].si.surface);
        let mut together = Together::new(light, members.len(), share, salt, others);
        for (member, k) in members.iter().zip(patch.rays()) {
            sights.settle(k, member, &mut self.arrivals, light, share, &mut together, counts);
        }
        together
    }

    /// Finds out what each ray of the block sees of a light.
    fn look_for(&mut self, block: &Block, light: usize, sights: &mut Sights, counts: &mut Counts) {
        let scene = self.scene;
        let shadows = scene.lights[light].shadows;
        let Sights { open, order, sights, views } = sights;
        order.clear();
        sights.clear();
        views.clear();
        views.resize_with(block.points.len(), || None);
        for (patch, is_open) in block.patches.iter().zip(open) {
            // A patch is of one surface
            let surface = self.pixels[patch.pixel as usize].patches[patch.patch as usize].si.surface;
            let shines = scene.geometry.links.contains(scene.geometry.lights_of(surface), LightId(light as u32));
            for (member, k) in patch.members(&self.pixels).iter().zip(patch.first..) {
                sights.push(if shines { Sight::Lit } else { Sight::BelowHorizon });
                if *is_open && shines && shadows && member.si.receives_shadow {
                    order.push(k);
                }
            }
        }
        self.arrivals.sights(light, &block.points, order, counts, |k, visibility, take| {
            sights[k] = match visibility {
                Visibility::Lit => Sight::Lit,
                Visibility::Hidden => Sight::Dark,
                Visibility::BelowHorizon => Sight::BelowHorizon,
                Visibility::Mask => match take() {
                    Past::Unknown(view) => {
                        views[k] = Some(view);
                        Sight::Behind
                    }
                    Past::Known => Sight::Near,
                    Past::Nothing => Sight::Clear,
                },
            };
        });
    }
}

impl BlockPatch {
    /// Its rays, as the block counts them.
    fn rays(&self) -> Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }

    /// What they see.
    fn members<'a>(&self, pixels: &'a [PixelPatches]) -> &'a [Member] {
        match &pixels[self.pixel as usize].patches[self.patch as usize].rays {
            Rays::Some(members) => members,
            Rays::All(_) | Rays::Mask(..) => unreachable!("patches of a block have their rays"),
        }
    }
}

impl Block {
    fn clear(&mut self) {
        self.points.clear();
        self.patches.clear();
    }

    /// Adds the patches of a pixel, number `index` of the cell.
    fn add(&mut self, pixel: &PixelPatches, index: usize) {
        for (k, patch) in pixel.patches.iter().enumerate() {
            let Rays::Some(members) = &patch.rays else { continue };
            let (first, count) = (self.points.len() as u32, members.len() as u32);
            let (pixel, patch) = (index as u32, k as u32);
            self.patches.push(BlockPatch { pixel, patch, first, count });
            self.points.extend(members.iter().map(|member| Viewpoint::of(&member.si)));
        }
    }
}

impl Sights {
    /// What the rays of a patch see together.
    fn outlook(&self, patch: &BlockPatch) -> Outlook {
        let of = |sight: Sight| self.sights[patch.rays()].iter().filter(|s| **s == sight).count();
        let dark = of(Sight::Dark);
        if dark + of(Sight::BelowHorizon) == patch.count as usize {
            Outlook::Dark
        } else if dark > 0 || of(Sight::Behind) > 0 {
            Outlook::Parted
        } else if of(Sight::Near) > 0 {
            Outlook::Unknown
        } else if of(Sight::Clear) > 0 {
            Outlook::Clear
        } else {
            Outlook::Lit
        }
    }

    /// Adds what ray `k` of the block sees of a light to that of the others of its patch.
    #[allow(clippy::too_many_arguments, reason = "a ray of a patch, a light, and where it goes")]
    fn settle(
        &mut self,
        k: usize,
        Member { si, bsdf, .. }: &Member,
        arrivals: &mut Arrivals,
        light: usize,
        share: f32,
        together: &mut Together,
        counts: &mut Counts,
    ) {
        match self.sights[k] {
            Sight::Dark => together.dark(&arrivals.place(light, si, bsdf)),
            Sight::BelowHorizon => together.know(&arrivals.place(light, si, bsdf), &Moments::default()),
            sight @ (Sight::Lit | Sight::Clear | Sight::Near) => {
                together.ask(arrivals, si, bsdf, sight == Sight::Lit, sight != Sight::Near, counts);
            }
            Sight::Behind => {
                let view = self.views[k].take().expect("what is behind things has a view");
                let place = ArrivalPlace { share, lit: true, clear: true, ..arrivals.place(light, si, bsdf) };
                arrivals.ask_behind(together, light, &place, view, counts);
            }
        }
    }
}
