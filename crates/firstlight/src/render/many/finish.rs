//! From what arrives at patches to the colour of a pixel: what is in doubt is asked at each ray.

use std::ops::Range;

use super::dense::sent;
use super::{ANYTHING, At, INTEGRALS, Many, Single, Stored};
use crate::color::Rgb;
use crate::light::Sent;
use crate::material::{Lobe, Moments};
use crate::render::arrival::Arrivals;
use crate::render::counts::Counts;
use crate::render::fence::Fence;
use crate::render::patch::PixelPatches;
use crate::render::resolve::LightTerm;
use crate::render::tiled::{BEND, second_difference, within};
use crate::shape::SurfaceInteraction;

/// A light, or all that are taken together, whose mean over a patch is in doubt.
#[derive(Clone, Copy)]
pub(super) struct Doubt {
    shown: f32,
    /// Among the singles; `None` for the rest.
    single: Option<u32>,
    error: Rgb,
}

impl<'a> Many<'a> {
    /// The colour of a pixel's surfaces, but for emission and ambient light: what each ray sees, added up. `add` hears
    /// each light's diffuse part and highlight, in scene order, and last what is taken together.
    #[allow(clippy::too_many_arguments, reason = "a pixel among those of a cell, and what it asks with")]
    pub fn finish(
        &mut self,
        pixels: &[PixelPatches],
        first: &[usize],
        index: usize,
        at: [u32; 2],
        arrivals: &mut Arrivals<'a>,
        counts: &mut Counts,
        mut add: impl FnMut((Rgb, LightTerm)),
    ) {
        let scene = self.scene;
        let mut terms = std::mem::take(&mut self.terms);
        let mut fence = std::mem::take(&mut self.fence);
        terms.clear();
        let mut together = Sent::BLACK;
        for (k, patch) in pixels[index].patches.iter().enumerate() {
            let count = patch.count(scene) as f32;
            let stored = &self.patches[first[index] + k];
            let mut doubts = std::mem::take(&mut self.doubts);
            self.doubts_of(pixels, first, (index, k), arrivals, &mut doubts);
            doubts.sort_unstable_by_key(|doubt| doubt.single);
            let in_doubt = |single: Option<u32>| doubts.binary_search_by_key(&single, |doubt| doubt.single).is_ok();
            let bsdf = &patch.bsdf;
            if !in_doubt(None) {
                together += bsdf.colors * stored.sent * count;
            }
            for i in stored.singles.clone() {
                if !in_doubt(Some(i)) {
                    let Single { light, arrival } = self.singles[i as usize];
                    let sums = arrival.sums * count;
                    terms.push((light, bsdf.colors.each(&sums)));
                }
            }
            if !doubts.is_empty() {
                arrivals.tolerate(INTEGRALS / (doubts.len() as f32).sqrt());
                patch.for_each(scene, at, |si, bsdf| {
                    for doubt in &doubts {
                        match doubt.single {
                            Some(i) => {
                                let light = self.singles[i as usize].light;
                                terms.push((light, arrivals.at_point(light as usize, si, bsdf, 1.0, counts)));
                            }
                            None => {
                                together += bsdf.colors * self.sent_at(stored, &mut fence, si, &bsdf.lobe);
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
            let term = same.iter().fold(Sent::BLACK, |sum, (_, term)| sum + *term);
            add((arrivals.scale(same[0].0 as usize), term));
        }
        // Of many scales
        add((Rgb::WHITE, together));
        (self.terms, self.fence) = (terms, fence);
    }

    /// What nodes send to where one camera ray ends.
    pub(super) fn sent_at(&self, stored: &Stored, fence: &mut Fence, si: &SurfaceInteraction, lobe: &Lobe) -> Sent {
        let (scene, tree) = (self.scene, self.tree);
        let mut sum = Sent::BLACK;
        let mut add = |entry: u32| {
            sum += sent(scene, tree, entry, si, lobe);
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

    /// How far the mean over a patch can be from what arrives at its middle because other lights are seen from
    /// elsewhere on it: as its neighbours tell, and anything where they do not.
    pub(super) fn flicker(&self, pixels: &[PixelPatches], first: &[usize], (index, k): At) -> Rgb {
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
            let sums = |stored: &Stored| Moments(stored.sent.0.map(of));
            let arrived = |index: usize| Some(sums(&self.patches[first[index]]));
            let Some(differences) = second_difference(self.scene, pixels, index, patch, &sums(stored), arrived) else {
                return anything;
            };
            let bend = within(&differences);
            let one = |channel_of: usize| if channel_of == channel { 1.0 } else { 0.0 };
            let mask = Rgb::new(one(0), one(1), one(2));
            all += mask * patch.bsdf.colors.of(&bend);
        }
        all
    }

    /// What of the light at a patch has to be asked for at each ray. All the rest may together bend by as much as one
    /// may.
    pub(super) fn doubts_of(
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
            let smooth = (bsdf.colors * stored.bend).sum();
            doubt(None, smooth + self.flicker(pixels, first, (index, k)));
        }
        let shown = |light: u32, bend: &Moments| {
            let scale = arrivals.scale(light as usize);
            (scale * bsdf.colors).of(bend)
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
            let Some(differences) = second_difference(self.scene, pixels, index, patch, &here.arrival.sums, arrived)
            else {
                return true;
            };
            let error = shown(here.light, &within(&differences));
            if arrivals.steps(value, sum + error) <= BEND {
                sum += error;
                return false;
            }
            true
        });
    }
}
