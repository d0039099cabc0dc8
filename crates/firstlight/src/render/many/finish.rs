//! From what arrives at patches to the colour of a pixel: what is in doubt is asked at each ray.

use std::ops::Range;

use super::apart::Apart;
use super::block::sent;
use super::patch::Patches;
use super::{ANYTHING, Many, Single, Stored};
use crate::color::Rgb;
use crate::film::resolve::ScaledTerm;
use crate::integrate::TOLERANCE;
use crate::material::{Colors, Moments};
use crate::render::arrival::{ArrivalPlace, Arrivals};
use crate::render::counts::Counts;
use crate::render::fence::Fence;
use crate::render::fragment::Fragments;
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
    /// What lights send to the patches of a pixel, by their numbers: what each ray sees, added up. `scaled` gets each
    /// light's diffuse part and highlight with its scale, in scene order, and last what is taken together. `apart` gets
    /// what of that is of lights that are kept apart.
    pub(super) fn finish(
        &mut self,
        fragments: &Fragments,
        patches: &Patches,
        pixel: Range<usize>,
        arrivals: &mut Arrivals<'a>,
        counts: &mut Counts,
        [scaled, apart]: [&mut Vec<ScaledTerm>; 2],
    ) {
        let scene = self.scene;
        let mut terms = std::mem::take(&mut self.terms);
        let mut fence = std::mem::take(&mut self.fence);
        let mut doubts = std::mem::take(&mut self.doubts);
        terms.clear();
        let mut kept = std::mem::take(&mut self.kept);
        kept.clear();
        let (mut rays, mut found) = (Vec::new(), Vec::new());
        let mut together = Colors::BLACK;
        for number in pixel {
            let patch = &patches.all[number];
            let count = patch.count as f32;
            let stored = &self.stored[number];
            self.doubts_of(patches, number, arrivals, &mut doubts);
            doubts.sort_unstable_by_key(|doubt| doubt.single);
            let in_doubt = |single: Option<u32>| doubts.binary_search_by_key(&single, |doubt| doubt.single).is_ok();
            let bsdf = &patch.bsdf;
            if !in_doubt(None) {
                together += bsdf.colors * stored.sent * count;
                self.nodes(stored).for_each(|entry| self.apart.add(&mut kept, entry, &patch.si, bsdf, count));
            }
            for i in stored.singles.clone() {
                if !in_doubt(Some(i)) {
                    let Single { light, arrival } = self.singles[i as usize];
                    let sums = arrival.sums * count;
                    terms.push((light, bsdf.colors.each(&sums)));
                }
            }
            if doubts.is_empty() {
                continue;
            }
            arrivals.tolerate(TOLERANCE.integrals / (doubts.len() as f32).sqrt());
            rays.clear();
            patch.for_each(scene, fragments, |si, bsdf| rays.push((*si, *bsdf)));
            for doubt in &doubts {
                let Some(i) = doubt.single else {
                    for (si, bsdf) in &rays {
                        let mut sum = Colors::BLACK;
                        self.seen_at(stored, &mut fence, si, |entry| {
                            sum += sent(scene, self.tree, entry, si, &bsdf.lobe);
                            self.apart.add(&mut kept, entry, si, bsdf, 1.0);
                        });
                        together += bsdf.colors * sum;
                    }
                    continue;
                };
                let light = self.singles[i as usize].light;
                let places: Vec<ArrivalPlace> =
                    rays.iter().map(|(si, bsdf)| arrivals.place(light as usize, si, bsdf)).collect();
                arrivals.arrivals(light as usize, &places, &mut found, counts);
                let sums = found.iter().map(|arrival| arrival.sums);
                terms.extend(places.iter().zip(sums).map(|(place, sums)| (light, place.reflected.each(&sums))));
            }
        }
        // In scene order
        terms.sort_by_key(|(light, _)| *light);
        for same in terms.chunk_by(|a, b| a.0 == b.0) {
            let term = same.iter().fold(Colors::BLACK, |sum, (_, term)| sum + *term);
            let light = same[0].0;
            scaled.push(ScaledTerm { light: Some(light), scale: arrivals.scale(light as usize), term });
        }
        // Of many scales
        scaled.push(ScaledTerm { light: None, scale: Rgb::WHITE, term: together });
        Apart::finish(&mut kept, arrivals, apart);
        (self.terms, self.fence, self.doubts, self.kept) = (terms, fence, doubts, kept);
    }

    /// Calls `each` with the nodes that are seen from where one camera ray ends.
    fn seen_at(&self, stored: &Stored, fence: &mut Fence, si: &SurfaceInteraction, mut each: impl FnMut(u32)) {
        if stored.maybe.is_empty() {
            return self.nodes(stored).for_each(each);
        }
        let list = |range: &Range<u32>| &self.lit[range.start as usize..range.end as usize];
        list(&stored.lit[0]).iter().for_each(|entry| each(*entry));
        fence.stand(self.scene, si);
        let dots = &self.dots[stored.maybe.start as usize..stored.maybe.end as usize];
        dots.iter().filter(|dot| dot.arrives(self.scene, fence, si)).for_each(|dot| each(dot.entry));
    }

    /// How far the mean over a patch can be from what arrives at its middle because other lights are seen from
    /// elsewhere on it: as its neighbours tell, and anything where they do not.
    fn flicker(&self, patches: &Patches, number: usize) -> Rgb {
        let (patch, stored) = (&patches.all[number], &self.stored[number]);
        if patch.reach == 0.0 || stored.maybe.is_empty() {
            return Rgb::BLACK;
        }
        let anything = Rgb::new(ANYTHING, ANYTHING, ANYTHING);
        if !patch.is_whole {
            return anything;
        }
        let mut all = Rgb::BLACK;
        for channel in 0..3 {
            let of = |color: Rgb| [color.r, color.g, color.b][channel];
            let arrived = |number: usize| Some(Moments(self.stored[number].sent.0.map(of)));
            let Some(bend) = patches.within(patch, arrived) else { return anything };
            let one = |channel_of: usize| if channel_of == channel { 1.0 } else { 0.0 };
            let mask = Rgb::new(one(0), one(1), one(2));
            all += mask * patch.bsdf.colors.of(&bend);
        }
        all
    }

    /// What of the light at a patch has to be asked for at each ray. All the rest may together bend by as much as one
    /// may.
    fn doubts_of(&self, patches: &Patches, number: usize, arrivals: &Arrivals, doubts: &mut Vec<Doubt>) {
        doubts.clear();
        let (patch, stored) = (&patches.all[number], &self.stored[number]);
        let (bsdf, value) = (&patch.bsdf, stored.value);
        let mut all = Rgb::BLACK;
        let mut doubt = |single: Option<u32>, error: Rgb| {
            all += error;
            doubts.push(Doubt { shown: 0.0, single, error });
        };
        if stored.lit.iter().any(|range| !range.is_empty()) {
            let smooth = (bsdf.colors * stored.bend).sum();
            doubt(None, smooth + self.flicker(patches, number));
        }
        let shown = |light: u32, bend: &Moments| {
            let scale = arrivals.scale(light as usize);
            (scale * bsdf.colors).of(bend)
        };
        for i in stored.singles.clone() {
            let Single { light, arrival } = &self.singles[i as usize];
            doubt(Some(i), shown(*light, &arrival.bend));
        }
        if arrivals.steps(value, all) <= TOLERANCE.point {
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
            if arrivals.steps(value, sum + doubt.error) <= TOLERANCE.point {
                sum += doubt.error;
                return false;
            }
            true
        });
    }
}
