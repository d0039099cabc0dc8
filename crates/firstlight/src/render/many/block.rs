//! The light cut of a block of patches, and the contributions of its nodes to each of them.

use std::ops::Range;

use super::patch::Patch;
use super::receivers::{colors, receiver, receiver_bounds};
use super::{BLOCK, BY_REPRESENTATIVE, LEVELS, MAX_SINGLE_LIGHTS, Many, PatchLight, SingleLight};
use crate::accel::Aabb;
use crate::color::Rgb;
use crate::ids::LightId;
use crate::integrate::{COSTS, TOLERANCE};
use crate::light::{EmissionProfile, LightNode, LightTree, NodeContents};
use crate::material::{Colors, Moments, ShadingPoint};
use crate::math::Vec3;
use crate::render::counts::Counts;
use crate::render::cut::{CutRules, NodeEstimator};
use crate::render::direct::{DirectLighting, LightQuery};
use crate::render::listed_occluder_cache::ListedOccluderCache;
use crate::render::pooled::PooledVisibility;
use crate::scene::Scene;
use crate::visibility::Visibility;

/// The representative light of a node, which contributes where that light is visible.
#[derive(Clone, Copy)]
pub(super) struct RepresentativeLight {
    pub(super) entry: u32,
    light: u32,
    /// The position of the light; of a directional one, its direction.
    at: Vec3,
    finite: bool,
    shadows: bool,
}

impl<'a> Many<'a> {
    /// Lights the patches of a block that lie on one surface. `guess` is a lower estimate of their incident light.
    #[allow(clippy::too_many_arguments, reason = "a block of a cell, and what lights it")]
    pub(super) fn block(
        &mut self,
        patches: &[Patch],
        group: &[usize],
        level: usize,
        guess: Option<Rgb>,
        lights: &mut DirectLighting<'a>,
        counts: &mut Counts,
    ) {
        let (scene, tree) = (self.scene, self.tree);
        let patch = |number: &usize| &patches[*number];
        let receivers = receiver_bounds(group.iter().map(patch), self.eye);
        let colors = colors(scene, group.iter().map(patch));
        let receives = group.iter().any(|at| patch(at).point.receives_shadow);
        self.cluster_visibility.set_receivers(scene, group.iter().map(|at| receiver(patch(at))));
        let steps = lights.display_steps();
        let rules = CutRules { tree, steps, receivers: &receivers, colors: &colors, budget: TOLERANCE.cut_error };
        let mut cut = std::mem::take(&mut self.cut);
        let (simd, cluster_visibility, cache) = (lights.level(), &mut self.cluster_visibility, &mut self.cache);
        let mut classify = |node: &LightNode| {
            if !(receives && node.shadows) {
                return Some(Visibility::Full);
            }
            let around = Aabb { min: node.bounds.low, max: node.bounds.high };
            cluster_visibility.classify(simd, scene, around, LightId(node.first(tree)))
        };
        let links = scene.geometry.lights_of(patch(&group[0]).point.surface);
        let shines = |root: &&u32| {
            let light = tree.nodes[**root as usize].first(tree);
            scene.geometry.links.contains(links, LightId(light))
        };
        cut.begin(&rules, tree.roots.iter().filter(shines));
        let guess = guess.unwrap_or_else(|| {
            cut.refine(&CutRules { budget: TOLERANCE.cut_error * COSTS.pilot, ..rules }, None, &mut classify);
            cut.list_nodes();
            let some = [0, group.len() / 2, group.len() - 1].map(|i| patch(&group[i]));
            let all = some.map(|patch| {
                cache.set_receiver(scene, &patch.point);
                cut.nodes.iter().fold(Rgb::BLACK, |sum, (node, estimator)| match entry(*node, *estimator) {
                    entry
                        if estimator.is_unoccluded
                            || RepresentativeLight::new(tree, entry).is_visible(scene, cache, &patch.point) =>
                    {
                        sum + sent(scene, tree, entry, &patch.point).cosine()
                    }
                    _ => sum,
                })
            });
            all.into_iter().reduce(Rgb::min).unwrap_or(Rgb::BLACK) * TOLERANCE.sure
        });
        cut.refine(&rules, Some(guess), &mut classify);
        let is_close = cut.single_lights.len() > MAX_SINGLE_LIGHTS && level < LEVELS && group.len() > 1;
        let (mut again, mut darkest) = (Vec::new(), guess);
        if is_close {
            again.extend_from_slice(group);
        } else {
            cut.finish(&rules, group.len(), &mut classify);
            let start = self.lit.len() as u32;
            let everywhere = cut.nodes.iter().filter(|(_, estimator)| estimator.is_unoccluded);
            self.lit.extend(everywhere.map(|(node, estimator)| entry(*node, *estimator)));
            let lit = start..self.lit.len() as u32;
            let start = self.representatives.len() as u32;
            let sometimes = cut.nodes.iter().filter(|(_, estimator)| !estimator.is_unoccluded);
            self.representatives
                .extend(sometimes.map(|(node, estimator)| RepresentativeLight::new(tree, entry(*node, *estimator))));
            let maybe = start..self.representatives.len() as u32;
            let mut found: Option<Rgb> = None;
            for at in group {
                let patch = patch(at);
                let singles = self.singles.len();
                let lists = [lit.clone(), maybe.clone()];
                let (stored, light) = self.patch(patch, &cut.single_lights, lists, lights, counts);
                let error = cut.error(&patch.point.bsdf.colors);
                if lights.steps(stored.value, error) > TOLERANCE.cut_error * TOLERANCE.lenient && guess != Rgb::BLACK {
                    // Darker than the guess
                    self.singles.truncate(singles);
                    found = Some(found.map_or(light, |found| found.min(light)));
                    again.push(*at);
                    continue;
                }
                self.count(&stored, counts);
                self.stored[*at] = stored;
            }
            darkest = if level < LEVELS {
                found.unwrap_or(guess) * TOLERANCE.sure
            } else if level < 2 * LEVELS {
                found.unwrap_or(guess).min(guess) * 0.5
            } else {
                Rgb::BLACK
            };
        }
        self.cut = cut;
        if again.is_empty() {
            return;
        }
        let half = (BLOCK as u32 >> (level + 1)).max(1);
        for quarter in 0..4 {
            let part: Vec<usize> = again.iter().filter(|at| patch(at).quarter(half) == quarter).copied().collect();
            if !part.is_empty() {
                self.block(patches, &part, level + 1, Some(darkest), lights, counts);
            }
        }
    }

    /// The light at one patch of a block from the nodes and single lights of its cut; and the diffuse part of it.
    pub(super) fn patch(
        &mut self,
        patch: &Patch,
        singles: &[u32],
        [everywhere, maybe]: [Range<u32>; 2],
        lights: &mut DirectLighting<'a>,
        counts: &mut Counts,
    ) -> (PatchLight, Rgb) {
        let scene = self.scene;
        let (point, bsdf) = (&patch.point, &patch.point.bsdf);
        let mut stored = PatchLight::default();
        let start = self.lit.len() as u32;
        counts.points += maybe.len() as u64;
        if !maybe.is_empty() {
            self.cache.set_receiver(scene, point);
        }
        let representatives = &self.representatives[maybe.start as usize..maybe.end as usize];
        let seen = representatives.iter().filter(|light| light.is_visible(scene, &self.cache, point));
        self.lit.extend(seen.map(|light| light.entry));
        (stored.lit[0], stored.maybe) = (everywhere, maybe);
        stored.lit[1] = start..self.lit.len() as u32;
        self.add(patch, 0, &mut stored);
        self.add(patch, 1, &mut stored);
        stored.value =
            (bsdf.colors * stored.sent).0.into_iter().fold(bsdf.base(&scene.ambient), |sum, part| sum + part);
        let from = self.singles.len() as u32;
        let mut light = stored.sent.cosine();
        if !singles.is_empty() {
            lights.tolerate(TOLERANCE.integrals / (singles.len() as f32).sqrt());
        }
        let point = ShadingPoint { base: stored.value, ..*point };
        let query = |light: &u32| LightQuery { point: 0, light: *light, visibility: Visibility::Partial };
        let queries: Vec<LightQuery> = singles.iter().map(query).collect();
        let mut estimates = Vec::with_capacity(queries.len());
        lights.estimate_all(&[point], &queries, &mut estimates, counts);
        for (index, estimate) in singles.iter().zip(&estimates) {
            let moments = match estimate.moments.is_known() {
                true => estimate.moments,
                false => {
                    let (index, points) = (*index as usize, std::slice::from_ref(&point));
                    PooledVisibility::of_points(index, points, patch.salt(), lights, counts).moments
                }
            };
            let scale = lights.scale(*index as usize);
            light += scale * moments.cosine();
            stored.value += (scale * bsdf.colors).of(&moments);
            self.singles.push(SingleLight { light: *index, moments, bend: estimate.bend() });
        }
        stored.singles = from..self.singles.len() as u32;
        (stored, light)
    }
}

impl RepresentativeLight {
    pub(super) fn new(tree: &LightTree, entry: u32) -> RepresentativeLight {
        let node = &tree.nodes[(entry & !BY_REPRESENTATIVE) as usize];
        let one = &tree.nodes[node.representative as usize];
        let finite = one.bounds.profile != EmissionProfile::Directional;
        let at = if finite { one.bounds.ball().0 } else { one.bounds.low };
        RepresentativeLight { entry, light: one.first(tree), at, finite, shadows: node.shadows }
    }

    /// Whether the light is visible from `point`, the receiver of `cache`.
    #[inline]
    pub(super) fn is_visible(&self, scene: &Scene, cache: &ListedOccluderCache, point: &ShadingPoint) -> bool {
        if !(point.receives_shadow && self.shadows) {
            return true;
        }
        let l = if self.finite { self.at - point.p } else { self.at };
        point.horizon.dot(l) > 0.0 && point.ns.dot(l) > 0.0 && !cache.blocks(scene, LightId(self.light), l, self.finite)
    }
}

/// An entry of a list of nodes.
pub(super) fn entry(node: u32, estimator: NodeEstimator) -> u32 {
    if estimator.by_centroid { node } else { node | BY_REPRESENTATIVE }
}

/// The contribution of the node of an entry: diffuse and specular, before the colours of the surface.
#[inline(always)]
pub(super) fn sent(scene: &Scene, tree: &LightTree, entry: u32, point: &ShadingPoint) -> Colors {
    let node = &tree.nodes[(entry & !BY_REPRESENTATIVE) as usize];
    if entry & BY_REPRESENTATIVE == 0 {
        return node.estimate(point);
    }
    sent_by_one(scene, &tree.nodes[node.representative as usize], point).map(|sent| node.power * sent)
}

/// The moments of one light for a power of 1.
pub(super) fn sent_by_one(scene: &Scene, one: &LightNode, point: &ShadingPoint) -> Moments {
    let NodeContents::Light(light) = one.contents else { return Moments::ZERO };
    let light = &scene.lights[light as usize];
    let k = light.samples() / 2;
    let l = light.towards(k, point.p).l;
    if !(point.horizon.dot(l) > 0.0 && point.ns.dot(l) > 0.0) {
        return Moments::ZERO;
    }
    if light.area().is_some() && one.has_estimate() {
        return one.unit_estimate(point);
    }
    let Some(sample) = light.sample(k, l) else { return Moments::ZERO };
    point.moments(l, sample.inverse_distance, sample.weight)
}
