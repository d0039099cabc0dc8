//! From the light at patches to the terms of a pixel: those with too large an error are evaluated at each camera ray.

use std::ops::Range;

use super::apart::Apart;
use super::block::sent;
use super::patch::Patches;
use super::{ANYTHING, Many, PatchLight, SingleLight};
use crate::color::Rgb;
use crate::film::resolve::ScaledTerm;
use crate::integrate::TOLERANCE;
use crate::material::{Colors, LightTerm, Moments, PerMoment, ShadingPoint};
use crate::render::counts::Counts;
use crate::render::direct::DirectLighting;
use crate::render::fragment::Fragments;
use crate::render::listed_occluder_cache::ListedOccluderCache;
use crate::render::pooled::PooledVisibility;

/// A single light, or all nodes together, whose value at the middle of a patch may differ too much from the mean.
#[derive(Clone, Copy)]
pub(super) struct UncertainTerm {
    shown: f32,
    /// The index among single lights; `None` for the nodes.
    single: Option<u32>,
    error: Rgb,
}

impl<'a> Many<'a> {
    /// Computes the terms of a pixel from its patches, as sums over camera rays. `scaled` receives those of each single
    /// light in scene order, and last that of all nodes; `apart` those of the lights that have buffers of their own,
    /// which are parts of the last.
    pub(super) fn finish(
        &mut self,
        fragments: &Fragments,
        patches: &Patches,
        pixel: Range<usize>,
        lights: &mut DirectLighting<'a>,
        counts: &mut Counts,
        [scaled, apart]: [&mut Vec<ScaledTerm>; 2],
    ) {
        let scene = self.scene;
        let mut terms = std::mem::take(&mut self.terms);
        let mut cache = std::mem::take(&mut self.cache);
        let mut uncertain = std::mem::take(&mut self.uncertain);
        terms.clear();
        let mut kept = std::mem::take(&mut self.kept);
        kept.clear();
        let mut rays = Vec::new();
        let mut together = Colors::BLACK;
        for number in pixel {
            let patch = &patches.all[number];
            let count = patch.count as f32;
            let stored = &self.stored[number];
            self.uncertain_terms(patches, number, lights, &mut uncertain);
            uncertain.sort_unstable_by_key(|term| term.single);
            let is_uncertain =
                |single: Option<u32>| uncertain.binary_search_by_key(&single, |term| term.single).is_ok();
            let bsdf = &patch.point.bsdf;
            if !is_uncertain(None) {
                together += bsdf.colors * stored.sent * count;
                self.nodes(stored).for_each(|entry| self.apart.add(&mut kept, entry, &patch.point, count));
            }
            for i in stored.singles.clone() {
                if !is_uncertain(Some(i)) {
                    let SingleLight { light, moments, .. } = self.singles[i as usize];
                    let sums = moments * count;
                    terms.push((light, bsdf.colors.reflected(&sums)));
                }
            }
            if uncertain.is_empty() {
                continue;
            }
            lights.tolerate(TOLERANCE.integrals / (uncertain.len() as f32).sqrt());
            rays.clear();
            patch.for_each(fragments, |point| rays.push(point));
            for term in &uncertain {
                let Some(i) = term.single else {
                    for point in &rays {
                        let mut sum = Colors::BLACK;
                        self.visible_nodes(stored, &mut cache, point, |entry| {
                            sum += sent(scene, self.tree, entry, point);
                            self.apart.add(&mut kept, entry, point, 1.0);
                        });
                        together += point.bsdf.colors * sum;
                    }
                    continue;
                };
                let light = self.singles[i as usize].light;
                terms.push((
                    light,
                    PooledVisibility::of_points(light as usize, &rays, patch.salt(), lights, counts).terms,
                ));
            }
        }
        // In scene order
        terms.sort_by_key(|(light, _)| *light);
        for same in terms.chunk_by(|a, b| a.0 == b.0) {
            let mut term = LightTerm::BLACK;
            same.iter().for_each(|(_, part)| term += *part);
            let light = same[0].0;
            scaled.push(ScaledTerm { light: Some(light), scale: lights.scale(light as usize), term });
        }
        // Nodes hold lights of different scales, which are in their powers
        scaled.push(ScaledTerm { light: None, scale: Rgb::WHITE, term: together.term() });
        Apart::finish(&mut kept, lights, apart);
        (self.terms, self.cache, self.uncertain, self.kept) = (terms, cache, uncertain, kept);
    }

    /// Calls `each` with the nodes that are visible from the end of one camera ray.
    fn visible_nodes(
        &self,
        stored: &PatchLight,
        cache: &mut ListedOccluderCache,
        point: &ShadingPoint,
        mut each: impl FnMut(u32),
    ) {
        if stored.maybe.is_empty() {
            return self.nodes(stored).for_each(each);
        }
        let list = |range: &Range<u32>| &self.lit[range.start as usize..range.end as usize];
        list(&stored.lit[0]).iter().for_each(|entry| each(*entry));
        cache.set_receiver(self.scene, point);
        let representatives = &self.representatives[stored.maybe.start as usize..stored.maybe.end as usize];
        representatives
            .iter()
            .filter(|light| light.is_visible(self.scene, cache, point))
            .for_each(|light| each(light.entry));
    }

    /// The error of a patch where representatives are visible from parts of it: estimated from neighbouring pixels, or
    /// [`ANYTHING`] where they cannot be compared.
    fn visibility_error(&self, patches: &Patches, number: usize) -> Rgb {
        let (patch, stored) = (&patches.all[number], &self.stored[number]);
        if patch.point.reach == 0.0 || stored.maybe.is_empty() {
            return Rgb::BLACK;
        }
        let anything = Rgb::new(ANYTHING, ANYTHING, ANYTHING);
        if !patch.is_whole {
            return anything;
        }
        let mut all = Rgb::BLACK;
        for channel in 0..3 {
            let of = |color: Rgb| [color.r, color.g, color.b][channel];
            let arrived = |number: usize| Some(PerMoment(self.stored[number].sent.0.map(of)));
            let Some(bend) = patches.within(patch, arrived) else { return anything };
            let one = |channel_of: usize| if channel_of == channel { 1.0 } else { 0.0 };
            let mask = Rgb::new(one(0), one(1), one(2));
            all += mask * patch.point.bsdf.colors.of(&bend);
        }
        all
    }

    /// The terms of a patch that have to be evaluated at each ray. The errors of all others together are within the
    /// tolerance for one point.
    fn uncertain_terms(
        &self,
        patches: &Patches,
        number: usize,
        lights: &DirectLighting,
        uncertain: &mut Vec<UncertainTerm>,
    ) {
        uncertain.clear();
        let (patch, stored) = (&patches.all[number], &self.stored[number]);
        let (bsdf, value) = (&patch.point.bsdf, stored.value);
        let mut all = Rgb::BLACK;
        let mut push = |single: Option<u32>, error: Rgb| {
            all += error;
            uncertain.push(UncertainTerm { shown: 0.0, single, error });
        };
        if stored.lit.iter().any(|range| !range.is_empty()) {
            let smooth = (bsdf.colors * stored.bend).sum();
            push(None, smooth + self.visibility_error(patches, number));
        }
        for i in stored.singles.clone() {
            let SingleLight { light, bend, .. } = self.singles[i as usize];
            push(Some(i), (lights.scale(light as usize) * bsdf.colors).of(&Moments::bounds(bend, bend)));
        }
        if lights.steps(value, all) <= TOLERANCE.point {
            uncertain.clear();
            return;
        }
        for term in &mut *uncertain {
            term.shown = lights.steps(value, term.error);
        }
        // Leave out the smallest errors, as long as their sum is within the tolerance
        uncertain.sort_unstable_by(|a, b| a.shown.total_cmp(&b.shown).then(a.single.cmp(&b.single)));
        let mut sum = Rgb::BLACK;
        uncertain.retain(|term| {
            if lights.steps(value, sum + term.error) <= TOLERANCE.point {
                sum += term.error;
                return false;
            }
            true
        });
    }
}
