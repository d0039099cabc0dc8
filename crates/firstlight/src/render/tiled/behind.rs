//! What of each light the rays of a block of pixels see past what lies in trees: gathered for all of them together, so
//! that a patch is asked once where nothing is in the way from any of its rays, and its rays are asked together where
//! something is.

use std::ops::Range;

use super::{CELL, Tiled};
use crate::color::Rgb;
use crate::ids::LightId;
use crate::integrate::Sums;
use crate::render::Counts;
use crate::render::arrival::{ArrivalPlace, Arrivals};
use crate::render::patch::{Member, PixelPatches, Rays};
use crate::render::tile::Tile;
use crate::render::together::Together;
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
    Settled([Rgb; 2]),
}

/// What one ray sees of one light.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sight {
    Lit,
    Clear,
    Dark,
    BelowHorizon,
    Behind,
}

/// The rays of a block of pixels, as they look for lights. Keeps its memory.
#[derive(Default)]
pub(super) struct Block {
    points: Vec<Viewpoint>,
    order: Vec<u32>,
    sights: Vec<Sight>,
    /// Of those that are behind things, what is in the way.
    views: Vec<Option<View>>,
    patches: Vec<BlockPatch>,
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
    /// Looks from all rays of the pixels from `from`, `size` of them across and down, for all lights.
    pub(super) fn look(&mut self, tile: &Tile, from: [u32; 2], size: [u32; 2], counts: &mut Counts) {
        let mut block = std::mem::take(&mut self.block);
        block.points.clear();
        block.patches.clear();
        let lights = self.scene.lights.len();
        for (y, x) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y, x))) {
            let index = self.index([from[0] + x, from[1] + y]);
            self.seen[index] = self.outlooks.len();
            for (k, patch) in self.pixels[index].patches.iter().enumerate() {
                let Rays::Some(members) = &patch.rays else { continue };
                let (first, count) = (block.points.len() as u32, members.len() as u32);
                block.patches.push(BlockPatch { pixel: index as u32, patch: k as u32, first, count });
                block.points.extend(members.iter().map(|member| Viewpoint::of(&member.si)));
                self.outlooks.extend(std::iter::repeat_n(Outlook::Unknown, lights));
            }
        }
        let first = self.outlooks.len() - block.patches.len() * lights;
        for light in 0..lights {
            if !self.arrivals.looks_for(light) {
                continue;
            }
            self.sights(&mut block, light, counts);
            for k in 0..block.patches.len() {
                let patch = block.patches[k];
                let (index, range) = (patch.pixel as usize, patch.rays());
                let of = |sight: Sight| block.sights[range.clone()].iter().filter(|s| **s == sight).count();
                let dark = of(Sight::Dark);
                let outlook = if dark + of(Sight::BelowHorizon) == patch.count as usize {
                    Outlook::Dark
                } else if dark > 0 || of(Sight::Behind) > 0 {
                    let at = [0, 1].map(|axis| {
                        let place = [index % super::ACROSS, index / super::ACROSS][axis];
                        (self.corner[axis] + place as u32).wrapping_sub(1)
                    });
                    let inside = [0, 1].into_iter().all(|axis| {
                        let (start, length) = [(tile.x, tile.width), (tile.y, tile.height)][axis];
                        (start..start + length).contains(&at[axis])
                            && (self.corner[axis]..self.corner[axis] + CELL).contains(&at[axis])
                    });
                    if inside {
                        let members = patch.members(&self.pixels);
                        let share = self.share_of(patch.count);
                        let salt = at[0] ^ at[1].rotate_left(16) ^ members[0].si.surface.index() as u32;
                        let before = counts.work();
                        let mut together = Together::new(light, members.len(), share, salt);
                        for (member, k) in members.iter().zip(range.clone()) {
                            block.settle(k, member, &mut self.arrivals, light, share, &mut together, counts);
                        }
                        let (terms, _) = together.finish(&mut self.arrivals, counts);
                        self.work[index] += counts.work() - before;
                        Outlook::Settled(terms)
                    } else {
                        Outlook::Parted
                    }
                } else if of(Sight::Clear) > 0 {
                    Outlook::Clear
                } else {
                    Outlook::Lit
                };
                block.views[range].iter_mut().filter_map(Option::take).for_each(|view| self.arrivals.keep(view));
                self.outlooks[first + k * lights + light] = outlook;
            }
        }
        self.block = block;
    }

    /// Finds out what each ray of the block sees of a light.
    fn sights(&mut self, block: &mut Block, light: usize, counts: &mut Counts) {
        let scene = self.scene;
        let shadows = scene.lights[light].shadows;
        block.order.clear();
        block.sights.clear();
        block.views.clear();
        block.views.resize_with(block.points.len(), || None);
        for patch in &block.patches {
            // A patch is of one surface
            let surface = self.pixels[patch.pixel as usize].patches[patch.patch as usize].si.surface;
            let shines = scene.geometry.links.contains(scene.geometry.lights_of(surface), LightId(light as u32));
            for (member, k) in patch.members(&self.pixels).iter().zip(patch.first..) {
                block.sights.push(if shines { Sight::Lit } else { Sight::BelowHorizon });
                if shines && shadows && member.si.receives_shadow {
                    block.order.push(k);
                }
            }
        }
        let Block { points, order, sights, views, .. } = block;
        self.arrivals.sights(light, points, order, counts, |k, visibility, take| {
            sights[k] = match visibility {
                Visibility::Lit => Sight::Lit,
                Visibility::Hidden => Sight::Dark,
                Visibility::BelowHorizon => Sight::BelowHorizon,
                Visibility::Mask => match take() {
                    Some(view) => {
                        views[k] = Some(view);
                        Sight::Behind
                    }
                    None => Sight::Clear,
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
            Sight::Dark | Sight::BelowHorizon => {
                let place = arrivals.place(light, si, bsdf);
                together.know(&place, &Sums::default());
            }
            sight @ (Sight::Lit | Sight::Clear) => {
                together.ask(arrivals, si, bsdf, sight == Sight::Lit, true, counts);
            }
            Sight::Behind => {
                let view = self.views[k].take().expect("what is behind things has a view");
                let place = ArrivalPlace { share, lit: true, clear: true, ..arrivals.place(light, si, bsdf) };
                arrivals.ask_behind(together, light, &place, view, counts);
            }
        }
    }
}
