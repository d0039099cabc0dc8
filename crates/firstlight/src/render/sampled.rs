//! One light that is sampled, settled by shafts: how much of it points see, what that sends to them, and how that
//! changes over places.
//!
//! The sums over the samples are those of [`Lanes`](super::lanes::Lanes), in the same order.

use fearless_simd::Level;

use super::Counts;
use super::arrival::{ArrivalPlace, Arrivals, Trees};
use super::change::{Arrival, Change};
use super::lanes::{PointObstacles, sum_area};
use super::pixel::{Lighting, LobeSums};
use super::plain::Plain;
use crate::integrate::{Arrived, Asked, Emitter, Illumination, ShadingPoint};
use crate::light::{Area, Extent, Light};
use crate::material::{Lobe, Moments};
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;
use crate::visibility::{ShadowView, Target, Viewpoint, Visibility, VisibilityResolver};

/// The shadows of a light of fewer samples than this show by themselves.
const FEW_SAMPLES: usize = 256;

/// A light, and how shafts lead to it.
pub(super) struct Sampled<'a> {
    scene: &'a Scene,
    level: Level,
    index: usize,
    target: &'a Target,
}

impl<'a> Sampled<'a> {
    /// Light `index`; `targets` has one for each light.
    pub fn new(scene: &'a Scene, level: Level, index: usize, targets: &'a [Target]) -> Self {
        Sampled { scene, level, index, target: &targets[index] }
    }

    fn light(&self) -> &'a Light {
        &self.scene.lights[self.index]
    }

    /// How many points it has.
    pub fn samples(&self) -> u64 {
        self.light().samples() as u64
    }

    /// Whether something may shadow a surface from it.
    pub fn is_shadowed(&self, si: &SurfaceInteraction) -> bool {
        self.light().shadows && si.receives_shadow
    }

    /// What it sends to a point that nothing shadows.
    pub fn unshadowed(&self, si: &SurfaceInteraction, lobe: &Lobe, counts: &mut Counts) -> Moments {
        counts.shadow_rays += self.samples();
        counts.shadow_rays_skipped += self.samples();
        self.lit(si, lobe)
    }

    /// Hears what of it is seen from those `points` whose numbers are in `part`; see [`VisibilityResolver::resolve`].
    pub fn settle(
        &self,
        resolver: &mut VisibilityResolver,
        points: &[Viewpoint],
        part: &mut [u32],
        counts: &mut Counts,
        each: impl FnMut(usize, Visibility, &mut ShadowView),
    ) {
        let all = self.samples() * part.len() as u64;
        let stats = &mut counts.visibility;
        let before = *stats;
        resolver.resolve(self.level, self.scene, self.target, points, part, stats, each);
        // Cut by shapes of the lists, which are asked for every sample, or by what is in the trees
        let cut = stats.classes[Visibility::Partial as usize] - before.classes[Visibility::Partial as usize];
        let traced = stats.traced - before.traced;
        let asked = if self.scene.geometry.has_trees() { traced } else { self.samples() * cut };
        counts.shadow_rays += all;
        counts.shadow_rays_skipped += all - asked;
    }

    /// What it sends to a point that sees so much of it.
    #[inline(always)]
    pub fn sent(&self, si: &SurfaceInteraction, lobe: &Lobe, visibility: Visibility, view: &ShadowView) -> Moments {
        match visibility {
            Visibility::None | Visibility::BelowHorizon => Moments::ZERO,
            Visibility::Full => self.lit(si, lobe),
            Visibility::Partial => self.masked(si, lobe, view),
        }
    }

    /// Where nothing hides any of it.
    #[inline(always)]
    fn lit(&self, si: &SurfaceInteraction, lobe: &Lobe) -> Moments {
        totals(match self.light().extent() {
            Extent::Area(area) => sum_area(self.level, area, si, lobe, &PointObstacles::default()),
            Extent::Point => {
                let unshadowed = SurfaceInteraction { receives_shadow: false, ..*si };
                Plain.gather(self.scene, self.index, &unshadowed, lobe, &mut Counts::default())
            }
        })
    }

    /// Past what is in `view`.
    #[inline(always)]
    fn masked(&self, si: &SurfaceInteraction, lobe: &Lobe, view: &ShadowView) -> Moments {
        totals(match self.light().extent() {
            Extent::Area(area) => sum_area(self.level, area, si, lobe, &PointObstacles::of(view)),
            Extent::Point => Plain.gather(self.scene, self.index, si, lobe, &mut Counts::default()),
        })
    }
}

impl Arrivals<'_> {
    /// What of light `index`, which is not integrated, arrives at each place. What is seen of its samples is settled
    /// for all places together. Sums are unknown where one place does not tell what others see, but for those who want
    /// all: `is_summed`.
    pub fn of_other(
        &mut self,
        index: usize,
        places: &[ArrivalPlace],
        is_summed: bool,
        found: &mut Vec<Arrival>,
        counts: &mut Counts,
    ) {
        let light = &self.scene.lights[index];
        let area = match light.extent() {
            Extent::Area(area) => area,
            Extent::Point => {
                found.extend(places.iter().map(|place| match self.is_linked(index, place) {
                    true => self.single(index, light, place, counts),
                    false => Arrival::even(Moments::default()),
                }));
                return;
            }
        };
        let changes = self.changes(index, area, places);
        let is_wanted = |change: &Change| is_summed || *change != Change::UNKNOWN;
        let wanted: Vec<bool> = changes.iter().map(is_wanted).collect();
        let sums = self.of_samples(index, places, &wanted, counts);
        found.extend(changes.into_iter().zip(sums).map(|(change, sums)| change.with(sums)));
    }

    /// How area light `index`, which is sampled, changes over places: as it would if it were integrated, in the unit of
    /// samples.
    fn changes(&mut self, index: usize, area: &Area, places: &[ArrivalPlace]) -> Vec<Change> {
        let emitter = Emitter::new(area);
        let mut changes = vec![Change::NONE; places.len()];
        // Past nothing in trees, and without shadows: what is seen of the light is asked for all of them at once
        let mut asked: [Vec<usize>; 2] = Default::default();
        for (k, place) in places.iter().enumerate() {
            if place.reach == 0.0 || !self.is_linked(index, place) {
                continue;
            }
            let shadows = self.scene.lights[index].shadows && place.si.receives_shadow;
            match if shadows { self.gather_places(index, std::slice::from_ref(place)) } else { Trees::Nothing } {
                Trees::Nothing => asked[usize::from(!shadows)].push(k),
                Trees::Known => {
                    let seen = self.seen_of(index, &emitter, std::iter::once(place), [true, true]);
                    changes[k] = self.change_of(&emitter, place, &seen[0]);
                }
                Trees::Unknown => changes[k] = self.change_of(&emitter, place, &Arrived::UNKNOWN),
            }
        }
        for (numbers, shadows) in asked.iter().zip([true, false]) {
            let seen = self.seen_of(index, &emitter, numbers.iter().map(|k| &places[*k]), [shadows, false]);
            for (k, seen) in numbers.iter().zip(&seen) {
                changes[*k] = self.change_of(&emitter, &places[*k], seen);
            }
        }
        let one = area.samples() as f32 / area.stands_for();
        for change in &mut changes {
            change.bend = change.bend * one;
            // Each of a fixed set of points throws a hard shadow, which shows where they are few
            if area.samples() < FEW_SAMPLES && change.drift > 0.0 {
                *change = Change::UNKNOWN;
            }
        }
        changes
    }

    /// What the samples of area light `index` send to those places where it is `wanted`.
    fn of_samples(
        &mut self,
        index: usize,
        places: &[ArrivalPlace],
        wanted: &[bool],
        counts: &mut Counts,
    ) -> Vec<Moments> {
        let light = Sampled::new(self.scene, self.level, index, &self.lights.targets);
        let points: Vec<Viewpoint> = places.iter().map(|place| Viewpoint::of(place.si)).collect();
        let mut sums = vec![Moments::ZERO; places.len()];
        let mut order = Vec::with_capacity(places.len());
        for (k, place) in places.iter().enumerate() {
            if !wanted[k] {
                sums[k] = Moments::UNKNOWN;
            } else if !self.is_linked(index, place) {
                continue;
            } else if light.is_shadowed(place.si) {
                order.push(k as u32);
            } else {
                sums[k] = light.unshadowed(place.si, place.lobe, counts);
            }
        }
        light.settle(&mut self.resolver, &points, &mut order, counts, |k, visibility, view| {
            sums[k] = light.sent(places[k].si, places[k].lobe, visibility, view);
        });
        sums
    }

    /// What places see of area light `index`, which is sampled: nothing is asked of what arrives.
    fn seen_of<'p, 'q: 'p>(
        &mut self,
        index: usize,
        emitter: &Emitter,
        places: impl Iterator<Item = &'p ArrivalPlace<'q>>,
        [shadows, near]: [bool; 2],
    ) -> Vec<Arrived> {
        let points: Vec<ShadingPoint> = places.map(ArrivalPlace::point_of_surface).collect();
        let mut seen = Vec::with_capacity(points.len());
        let near = near.then_some(&self.near);
        let asked = Asked { near, sums: false, ..self.lights.asked_of(index, emitter, &Lobe::None, shadows) };
        self.evaluator.evaluate(self.level, &asked, &points, &mut seen);
        let unknown = seen.iter_mut().filter(|seen| seen.illumination == Illumination::Unknown);
        unknown.for_each(|seen| seen.motion = f32::INFINITY);
        seen
    }
}

fn totals(sums: LobeSums) -> Moments {
    sums.total()
}
