//! The mean of what a light sends to a patch of a pixel, from as little as tells it: the patch's middle; that and the
//! neighbours, where light is wider than a pixel; its quarters; each of its rays.

use arrayvec::ArrayVec;

use super::{ACROSS, Outlook, Tiled};
use crate::color::Rgb;
use crate::material::{Bsdf, Moments};
use crate::render::arrival::ArrivalPlace;
use crate::render::change::Arrival;
use crate::render::patch::{Contrast, Patch, PixelPatches};
use crate::render::together::{Together, salt};
use crate::render::{AaMode, Counts};
use crate::scene::Scene;

/// In display steps: how much may bend over a patch that is shaded once.
pub(in crate::render) const BEND: f32 = 0.25;
/// The part of that which needs no second look.
const FINE: f32 = 0.1;
/// The part of that which colours and light may make together.
const MINGLED: f32 = 0.5;
/// By how much the normals of three pixels in a row may differ from turning evenly, in radians.
const EVEN: f32 = 0.02;
/// The same of what normals make whose mean is not the one it is shaded with.
const SKEWED: f32 = 1.0;
/// What light does within a pixel, at most, as a part of its second difference over three: a corner in the middle of
/// the pixel makes an eighth, the onset of a root nearly a fourth.
const WITHIN: f32 = 0.2;

impl Tiled<'_> {
    /// Adds what all lights send to a pixel, each for itself.
    pub(super) fn light_by_light(&mut self, at: [u32; 2], counts: &mut Counts) {
        let scene = self.scene;
        self.ask(at, counts);
        let index = self.index(at);
        let patches = std::mem::take(&mut self.pixels[index].patches);
        for (k, patch) in patches.iter().enumerate() {
            let count = patch.count(scene) as f32;
            for light in 0..scene.lights.len() {
                if let Outlook::Settled(terms) = self.outlook(index, k, light) {
                    self.terms[light] += terms;
                } else if let Some(sums) = self.at_once(&patches, at, k, light, counts) {
                    let sums = sums * count;
                    self.terms[light] += patch.bsdf.colors.each(&sums);
                } else {
                    self.in_quarters(patch, at, k, light, counts);
                }
            }
        }
        self.pixels[index].patches = patches;
    }

    /// The mean of what arrives of a light over a patch, the `k`-th of its pixel, if what arrives at its middle tells
    /// it.
    fn at_once(
        &mut self,
        patches: &[Patch],
        at: [u32; 2],
        k: usize,
        light: usize,
        counts: &mut Counts,
    ) -> Option<Moments> {
        let scene = self.scene;
        let patch = &patches[k];
        if patch.uneven {
            return None;
        }
        let lights = scene.lights.len();
        let index = self.index(at);
        let (here, value) =
            (self.arrived[(self.first[index] + k) * lights + light], self.values[self.first[index] + k]);
        let allowed = BEND / (lights as f32).sqrt();
        if here.skipped {
            return None;
        }
        let is_dark = here.sums == Moments::default() && here.bend == Moments::default();
        if patch.contrast != Contrast::default() && !is_dark {
            // Light and dark colours get what arrives in the middle only if that is what arrives everywhere
            let slope = self.slope(patch, at, light, counts)?;
            if self.mingles(light, &patch.contrast, value, &slope) {
                return None;
            }
        }
        // A crease between facets is no parabola
        let Patch { skew, bsdf, si, .. } = *patch;
        if skew > 0.0 {
            let sharp = (2.0 * bsdf.lobe.sharpness(si.ns.dot(si.wo))).sqrt();
            let off = (here.sums * skew).zip(Moments::bounds(1.0, sharp), |sum, times| sum * times);
            if self.shown(light, &bsdf, value, &off) > SKEWED * allowed {
                return None;
            }
        }
        let shown = self.shown(light, &patch.bsdf, value, &here.bend);
        if shown <= FINE * allowed {
            return Some(here.sums);
        }
        let else_here = (shown <= allowed).then_some(here.sums);
        // The outline of a shadow makes no parabola, nor does a light's rim
        let breaks = |arrival: &Arrival| arrival.drift > 0.0 || !arrival.resolved;
        if !here.resolved || !patch.is_whole(scene) || else_here.is_some() && breaks(&here) {
            return else_here;
        }
        let [i, j] = at;
        let beside = [[i.wrapping_sub(1), j], [i + 1, j], [i, j.wrapping_sub(1)], [i, j + 1]];
        if !beside.into_iter().all(|neighbour| self.ask(neighbour, counts)) {
            return else_here;
        }
        let arrived = |index: usize| {
            let arrival = &self.arrived[self.first[index] * lights + light];
            (!arrival.skipped).then_some(arrival.sums)
        };
        let Some(differences) = second_difference(scene, &self.pixels, index, patch, &here.sums, arrived) else {
            return else_here;
        };
        if else_here.is_none() && self.shown(light, &patch.bsdf, value, &within(&differences)) > allowed {
            return None;
        }
        let beside = beside.map(|at| &self.arrived[self.first[self.index(at)] * lights + light]);
        if breaks(&here) || beside.into_iter().any(breaks) {
            return Some(here.sums);
        }
        // The mean of a parabola over the rays of a pixel
        let n = scene.antialiasing as f32;
        let part = (1.0 - 1.0 / (n * n)) / 24.0;
        let [x, y] = differences;
        let more = (x + y) * part;
        // More than it bends here: something ends between this pixel and the next, the edge of a hard shadow for one
        if self.shown(light, &patch.bsdf, value, &more.map(f32::abs)) > shown {
            return Some(here.sums);
        }
        Some((here.sums + more).at_least_0())
    }

    /// How much what arrives changes over a pixel, along both axes together, by its neighbours; `None` where they do
    /// not tell.
    fn slope(&mut self, patch: &Patch, [i, j]: [u32; 2], light: usize, counts: &mut Counts) -> Option<Moments> {
        if !patch.is_whole(self.scene) {
            return None;
        }
        let mut slope = Moments::default();
        for [before, after] in [[[i.wrapping_sub(1), j], [i + 1, j]], [[i, j.wrapping_sub(1)], [i, j + 1]]] {
            let mut arrived = [Moments::default(); 2];
            for (sums, at) in arrived.iter_mut().zip([before, after]) {
                if !self.ask(at, counts) {
                    return None;
                }
                let index = self.index(at);
                let [beside] = &self.pixels[index].patches[..] else { return None };
                let arrival = &self.arrived[self.first[index] * self.scene.lights.len() + light];
                if arrival.skipped || !is_same(self.scene, beside, patch) {
                    return None;
                }
                *sums = arrival.sums;
            }
            slope += apart(&arrived[0], &arrived[1]) * 0.5;
        }
        Some(slope)
    }

    /// By how much the mean of colours times light can differ from the mean of colours times that of light, where
    /// colours differ that much, and what arrives changes by `slope` along both axes together: two halves, one of each
    /// colour, make an eighth of both.
    fn mingled(&self, light: usize, contrast: &Contrast, slope: &Moments) -> Rgb {
        let colors = contrast.of(slope);
        self.arrivals.scale(light) * colors * 0.125
    }

    /// Whether that shows.
    fn mingles(&self, light: usize, contrast: &Contrast, value: Rgb, slope: &Moments) -> bool {
        let allowed = BEND / (self.scene.lights.len() as f32).sqrt();
        self.arrivals.steps(value, self.mingled(light, contrast, slope)) > MINGLED * allowed
    }

    /// Adds what one light sends to a patch, the `k`-th of its pixel, from parts of it: its quarters, where that may
    /// do, or each ray.
    fn in_quarters(&mut self, patch: &Patch, at: [u32; 2], k: usize, light: usize, counts: &mut Counts) {
        let scene = self.scene;
        let first = self.first[self.index(at)] + k;
        let (here, value) = (self.arrived[first * scene.lights.len() + light], self.values[first]);
        // What bends in one place, bends a fourth of that over half the way
        let allowed = BEND / (scene.lights.len() as f32).sqrt();
        let quarters =
            if patch.uneven || here.skipped || self.shown(light, &patch.bsdf, value, &here.bend) > 6.0 * allowed {
                ArrayVec::new()
            } else {
                patch.quarters(scene, at)
            };
        if quarters.is_empty() {
            let outlook = self.outlook(self.index(at), k, light);
            self.at_rays(patch, at, light, outlook, self.share(patch), counts);
        }
        let share = self.share(patch);
        let mut places: ArrayVec<ArrivalPlace, 4> = ArrayVec::new();
        for quarter in &quarters {
            let place = self.arrivals.place(light, &quarter.si, &quarter.bsdf).over(quarter);
            places.push(ArrivalPlace { share, parted: true, ..place });
        }
        let mut arrivals = Vec::new();
        self.arrivals.arrivals(light, &places, &mut arrivals, counts);
        for (quarter, arrival) in quarters.iter().zip(&arrivals) {
            // The others are as far away as it is wide
            let slope =
                arrivals.iter().fold(Moments::default(), |most, other| most.max(other.sums.apart(arrival.sums)));
            if quarter.uneven
                || arrival.skipped
                || self.shown(light, &quarter.bsdf, value, &arrival.bend) > allowed
                || self.mingles(light, &quarter.contrast, value, &slope)
            {
                self.at_rays(quarter, at, light, Outlook::Unknown, share, counts);
            } else {
                let sums = arrival.sums * quarter.count(scene) as f32;
                self.terms[light] += quarter.bsdf.colors.each(&sums);
            }
        }
    }

    /// The share of its pixel that a patch has, where each surface is lit once.
    pub(super) fn share(&self, patch: &Patch) -> f32 {
        self.share_of(patch.count(self.scene))
    }

    /// That of so many of its rays.
    pub(super) fn share_of(&self, rays: u32) -> f32 {
        match self.mode {
            AaMode::Adaptive => rays as f32 / (self.scene.antialiasing * self.scene.antialiasing) as f32,
            AaMode::Full => 1.0,
        }
    }

    /// How many display steps an error of the sums of a light makes.
    fn shown(&self, light: usize, bsdf: &Bsdf, value: Rgb, error: &Moments) -> f32 {
        let scale = self.arrivals.scale(light);
        self.arrivals.steps(value, (scale * bsdf.colors).of(error))
    }

    /// Adds what one light sends to a patch, asked at each of its rays. It is as good as `share` of the pixel.
    fn at_rays(
        &mut self,
        patch: &Patch,
        at: [u32; 2],
        light: usize,
        outlook: Outlook,
        share: f32,
        counts: &mut Counts,
    ) {
        let rays = patch.count(self.scene) as usize;
        let salt = salt(at, patch.si.surface);
        let mut together = Together::new(light, rays, share, salt, Rgb::BLACK);
        let lit = matches!(outlook, Outlook::Lit);
        let clear = lit || matches!(outlook, Outlook::Clear);
        patch.for_each(self.scene, at, |si, bsdf| together.ask(&mut self.arrivals, si, bsdf, lit, clear, counts));
        self.terms[light] += together.finish(&mut self.arrivals, counts).terms;
    }
}

/// Whether a patch fills its pixel and is of the same surface as another, so that one tells something of the other.
fn is_same(scene: &Scene, beside: &Patch, patch: &Patch) -> bool {
    beside.is_whole(scene) && beside.bsdf.lobe == patch.bsdf.lobe && patch.holds(&beside.si)
}

/// How far two sums are apart.
fn apart(one: &Moments, other: &Moments) -> Moments {
    one.apart(*other)
}

/// How far neighbours along each axis differ from what they foretell of a pixel in their middle, by what arrives `here`
/// and at them, as `arrived` says; `None` where they tell nothing.
pub(in crate::render) fn second_difference(
    scene: &Scene,
    pixels: &[PixelPatches],
    index: usize,
    patch: &Patch,
    here: &Moments,
    arrived: impl Fn(usize) -> Option<Moments>,
) -> Option<[Moments; 2]> {
    let mut differences = [Moments::default(); 2];
    for (difference, step) in differences.iter_mut().zip([1, ACROSS]) {
        let neighbours = [index - step, index + step];
        let same = |i: &usize| matches!(&pixels[*i].patches[..], [beside] if is_same(scene, beside, patch));
        if !neighbours.iter().all(same) {
            return None;
        }
        // Nor do they where an edge of the surface runs between
        let [before, after] = neighbours.map(|i| pixels[i].patches[0].si.ns);
        if !((before + after - patch.si.ns * 2.0).length() <= EVEN) {
            return None;
        }
        let (before, after) = (arrived(neighbours[0])?, arrived(neighbours[1])?);
        let less = |a: Moments, b: Moments| a.zip(b, |a, b| a - b);
        *difference = less(before, *here) + less(after, *here);
    }
    Some(differences)
}

/// How far what light does within a pixel can make its mean another, by its second differences.
pub(in crate::render) fn within(differences: &[Moments; 2]) -> Moments {
    let [x, y] = differences;
    x.zip(*y, |x, y| (x.abs() + y.abs()) * WITHIN)
}
