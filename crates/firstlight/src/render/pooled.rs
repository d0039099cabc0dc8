//! One light at all camera rays of a patch, sampled until the error of what they receive together is small enough.
//!
//! Where occluders have no closed form, the visible fraction of a light is sampled
//! ([`LightSampler`](light_sampler::LightSampler)). The rays sample different points, which are stratified together:
//! n rays need far fewer each than one that stands for all of them. The strata are halved
//! ([`Strata`](strata::Strata)) until the error estimate of the sum over all rays ([`VarianceEstimate`]) is small
//! enough.

mod light_sampler;
mod strata;
mod variance;

use light_sampler::{FEWEST, MOST_KEPT, SampledReceiver};
pub(super) use light_sampler::{LightPointSets, LightSampler, Packet};
use strata::{MOST, MOST_UNIFORM, Strata, StratumSums};
use variance::VarianceEstimate;

use super::Counts;
use super::direct::DirectLighting;
use crate::color::Rgb;
use crate::ids::SurfaceId;
use crate::integrate::TOLERANCE;
use crate::light::{SERIES, mix};
use crate::material::{LightTerm, MOMENTS, Moments, ShadingPoint};
use crate::visibility::{ShadowView, Visibility};

/// So many samples of all rays prove that all of the light is hidden: the display curve is steepest at black.
const ALL_HIDDEN: usize = 1 << 14;

/// What all rays of a patch receive of a light.
#[derive(Debug)]
pub(super) struct PooledLight {
    /// Summed over the rays: with the colours of their surfaces, and without.
    pub terms: LightTerm,
    pub moments: Moments,
    /// The mean over the rays of the visible fraction; not a number where that is not known of a ray.
    pub visible_fraction: f32,
}

/// A ray whose light may have a closed form.
struct Pending {
    point: ShadingPoint,
    visibility: Visibility,
}

/// One light, sampled at all rays of a fragment together.
pub(crate) struct PooledVisibility {
    light: usize,
    /// What its moments are multiplied with, before the colours of the surface.
    scale: Rgb,
    /// The parts of the pixel that the patch and each of its rays are.
    share: f32,
    each: f32,
    /// What other lights send to each ray, at least: errors show less beside it.
    others: Rgb,
    /// How many lights are sampled in the pixel, at most.
    sampled_lights: usize,
    /// The series of the first ray.
    series: usize,
    pending: Vec<Pending>,
    /// The rays that sample the light.
    receivers: Vec<SampledReceiver>,
    rays: usize,
    /// Over the rays whose light is known: that light, how many have a known fraction, and all that reaches them.
    sum: PooledLight,
    with_fraction: u32,
    value: Rgb,
}

/// A number that decides which series of points a pixel samples: different in the four pixels of a block of two by two,
/// so that their errors differ, and without a pattern from block to block, which errors would show.
pub(crate) fn salt([i, j]: [u32; 2], surface: SurfaceId) -> u64 {
    let block = mix(mix(u64::from(i / 2) << 32 | u64::from(j / 2)) ^ surface.index() as u64);
    block ^ u64::from((i & 1) << 2 | (j & 1) << 3)
}

impl PooledVisibility {
    /// Of a patch with so many rays, `share` of its pixel. Its [`salt`] decides which points it samples. Of
    /// `sampled_lights`, the others send at least `others` to each ray.
    pub fn new(
        light: usize,
        scale: Rgb,
        rays: usize,
        share: f32,
        salt: u64,
        others: Rgb,
        sampled_lights: usize,
    ) -> Self {
        let terms = LightTerm::BLACK;
        PooledVisibility {
            light,
            scale,
            share,
            each: share / rays as f32,
            others,
            sampled_lights,
            series: salt as usize % SERIES,
            pending: Vec::new(),
            receivers: Vec::new(),
            rays: 0,
            sum: PooledLight { terms, moments: Moments::default(), visible_fraction: 0.0 },
            with_fraction: 0,
            value: Rgb::BLACK,
        }
    }

    /// Adds a ray that receives so much, and sees that fraction of the light, if it is known.
    pub fn add_known(&mut self, point: &ShadingPoint, moments: &Moments, visible_fraction: Option<f32>) {
        self.rays += 1;
        self.value += point.base;
        self.receive(point, moments, visible_fraction);
    }

    /// Adds a ray whose light may have a closed form past what may occlude it.
    pub fn add(
        &mut self,
        lights: &mut DirectLighting,
        point: &ShadingPoint,
        visibility: Visibility,
        counts: &mut Counts,
    ) {
        let point = ShadingPoint { share: self.share, closed_form_budget: f32::INFINITY, ..*point };
        if lights.is_integrated(self.light) {
            self.pending.push(Pending { point, visibility });
        } else {
            let moments = lights.estimate_one(self.light, &point, visibility, counts).moments;
            self.add_known(&point, &moments, Some(Self::fraction(visibility)));
        }
    }

    /// The visible fraction of an integrated light; not a number where only its integral is known.
    fn fraction(visibility: Visibility) -> f32 {
        if visibility == Visibility::Full { 1.0 } else { f32::NAN }
    }

    /// Adds a ray that samples the light, unless one thing hides all of it.
    pub fn add_sampled(&mut self, point: &ShadingPoint, lights: &mut DirectLighting, counts: &mut Counts) {
        match lights.classify_one(self.light, point, counts) {
            Some(view) => self.add_behind(point, view),
            None => self.add_known(point, &Moments::default(), Some(0.0)),
        }
    }

    /// Adds a ray that samples the light past what is in `view`.
    pub fn add_behind(&mut self, point: &ShadingPoint, view: ShadowView) {
        let series = self.series ^ (self.rays % SERIES);
        self.rays += 1;
        self.value += point.base;
        self.receivers.push(SampledReceiver::new(point, self.scale, series, view));
    }

    fn receive(&mut self, point: &ShadingPoint, moments: &Moments, visible_fraction: Option<f32>) {
        self.sum.terms += point.bsdf.colors.reflected(moments);
        self.sum.moments += *moments;
        self.value += (self.scale * point.bsdf.colors).of(moments);
        if let Some(visible) = visible_fraction {
            self.sum.visible_fraction += visible;
            self.with_fraction += 1;
        }
    }

    /// Evaluates the closed forms of the rays of some patches, of one light.
    pub fn resolve(all: &mut [PooledVisibility], lights: &mut DirectLighting, counts: &mut Counts) {
        let Some(light) = all.first().map(|one| one.light) else { return };
        let pending: Vec<Vec<Pending>> = all.iter_mut().map(|one| std::mem::take(&mut one.pending)).collect();
        let mut points = Vec::new();
        for (one, pending) in all.iter().zip(&pending) {
            // Closed forms are off alike at all rays: by no more than if one stood for all
            let closed_form_budget = 1.0 / (one.receivers.len() + pending.len()) as f32;
            points.extend(pending.iter().map(|ray| ShadingPoint { closed_form_budget, ..ray.point }));
        }
        if points.is_empty() {
            return;
        }
        let visibilities: Vec<Visibility> = pending.iter().flatten().map(|ray| ray.visibility).collect();
        let estimates = lights.estimate_each(light, &points, |k| visibilities[k], counts);
        let mut rays = points.iter().zip(&estimates).zip(&visibilities);
        for (one, pending) in all.iter_mut().zip(&pending) {
            for ((point, estimate), visibility) in rays.by_ref().take(pending.len()) {
                if estimate.moments.is_known() {
                    one.add_known(point, &estimate.moments, Some(Self::fraction(*visibility)));
                } else {
                    counts.visibility.classes[Visibility::Partial as usize] += 1;
                    one.add_sampled(point, lights, counts);
                }
            }
        }
    }

    /// What some points of one pixel receive of a light of whose visibility nothing is known.
    pub fn of_points(
        light: usize,
        points: &[ShadingPoint],
        salt: u64,
        lights: &mut DirectLighting,
        counts: &mut Counts,
    ) -> PooledLight {
        let share = points.iter().map(|point| point.share).fold(0.0, f32::max);
        let scale = lights.scale(light);
        let mut pooled = PooledVisibility::new(light, scale, points.len(), share, salt, Rgb::BLACK, usize::MAX);
        points.iter().for_each(|point| pooled.add(lights, point, Visibility::Partial, counts));
        pooled.estimate(lights, counts)
    }

    /// Samples the light as far as the error of all rays together needs it.
    pub fn estimate(mut self, lights: &mut DirectLighting, counts: &mut Counts) -> PooledLight {
        PooledVisibility::resolve(std::slice::from_mut(&mut self), lights, counts);
        if !self.receivers.is_empty() {
            let mut receivers = std::mem::take(&mut self.receivers);
            let fractions = self.sample(lights, &mut receivers, counts);
            let measure = lights.sampler(self.light).measure();
            for receiver in receivers {
                let unoccluded = receiver.unoccluded(measure);
                let moments = receiver.sums.arriving(&unoccluded, &fractions);
                let visible = 1.0 - (receiver.sums.hidden / receiver.sums.sending) as f32;
                self.receive(&receiver.place(self.each), &moments, (receiver.sums.sending > 0.0).then_some(visible));
                lights.keep(receiver.view);
            }
        }
        self.sum.visible_fraction /= self.with_fraction.max(1) as f32;
        self.sum
    }

    /// Samples the light in more and more strata until the error of all rays together is small enough. Returns the
    /// visible fractions of the moments.
    fn sample(
        &self,
        lights: &mut DirectLighting,
        receivers: &mut [SampledReceiver],
        counts: &mut Counts,
    ) -> [f32; MOMENTS] {
        let sampler = lights.sampler(self.light);
        let mut first = TOLERANCE.first_points / lights.scene.tolerance() as f32;
        if !sampler.varies_over(&receivers[0].place(self.each), sampler.spacing(first)) {
            first *= TOLERANCE.nearer;
        }
        let first = (first * self.share.sqrt() / receivers.len() as f32) as usize;
        let first = first.next_power_of_two().clamp(FEWEST, MOST_KEPT);
        // Errors of the lights that are not sampled are none, or small
        let integrated = lights.lights.integrated.max(1);
        let room = (integrated as f32 / self.sampled_lights.clamp(1, integrated) as f32).sqrt();
        let allowed = lights.tolerance_by_chance(self.share) * room;
        let mut strata = Strata::new(sampler, first, receivers, counts);
        let mut is_split = true;
        loop {
            receivers.iter_mut().enumerate().for_each(|(k, receiver)| receiver.sums = strata.sums(k));
            let pooled = self.pool(receivers, &strata, sampler.measure());
            let error = pooled.error(&strata, receivers, lights);
            let samples = strata.count();
            let is_sure = pooled.steps(lights, |k| pooled.undersampled(k)) <= allowed * TOLERANCE.undersampled;
            let is_lit = !pooled.is_hidden && self.is_clear(&pooled);
            let is_dark = pooled.is_dark && samples >= ALL_HIDDEN;
            let is_last = samples >= MOST || !is_split;
            let is_enough = is_last || is_sure && (is_lit || is_dark || error.all() <= allowed);
            // The samples' own estimate of the unoccluded integral will do where they cannot miss any of it
            let is_wanted = is_enough
                || (!is_sure || error.smooth > allowed) && (error.edges <= allowed || samples >= MOST_UNIFORM);
            if pooled.found.is_none()
                && sampler.emitter.is_some()
                && is_wanted
                && (error.smooth > allowed || self.may_miss(&pooled, &strata, receivers))
            {
                let places: Vec<_> = receivers.iter().map(|one| one.place(self.each)).collect();
                let unoccluded = lights.estimate_each(self.light, &places, |_| Visibility::Full, counts);
                receivers.iter_mut().zip(unoccluded).for_each(|(one, known)| one.unoccluded = Some(known.moments));
                continue;
            }
            if is_enough {
                return pooled.fractions;
            }
            // More strata everywhere as long as there is room for more near silhouettes
            let is_raised = !is_sure || error.unmet.max(error.overlooked) > allowed || !strata.is_halved;
            let is_raised = is_raised && (4 * samples <= MOST || error.edges <= allowed);
            is_split = strata.refine(&error.near, is_raised, is_sure, receivers, counts);
        }
    }

    /// Sums up the samples of all rays of a light of such a measure.
    fn pool(&self, receivers: &[SampledReceiver], strata: &Strata, measure: f32) -> PooledEstimate {
        let [sent, lit] = StratumSums::pooled(receivers);
        let part = |of: [f64; MOMENTS], k: usize| if sent[k] > 0.0 { (of[k] / sent[k]) as f32 } else { 0.0 };
        let fractions = std::array::from_fn(|k| part(lit, k));
        let mut pooled = PooledEstimate {
            part: 1.0 / self.rays as f32,
            value: self.value + self.others * self.rays as f32,
            all: [Rgb::BLACK; MOMENTS],
            missing: [Rgb::BLACK; MOMENTS],
            effective: [0.0; MOMENTS],
            is_hidden: receivers.iter().any(|one| one.sums.hidden > 0.0),
            is_dark: fractions.iter().all(|visible| *visible == 0.0),
            fractions,
            sent: [0.0; MOMENTS],
            found: None,
            surprises: std::array::from_fn(|k| part(strata.surprises, k)),
        };
        for one in receivers {
            let unoccluded = one.unoccluded(measure);
            pooled.value += one.each(&one.sums.arriving(&unoccluded, &fractions)).sum();
            for (k, (color, effective)) in one.each(&unoccluded).0.into_iter().zip(one.sums.effective()).enumerate() {
                pooled.all[k] += color;
                pooled.effective[k] += effective;
                pooled.sent[k] += unoccluded.0[k];
                if one.sums.sent[k] as f32 * measure < 0.75 * unoccluded.0[k] {
                    pooled.missing[k] += color;
                }
            }
        }
        pooled.sent = pooled.sent.map(|all| all / measure);
        let is_known = receivers.iter().any(|one| one.unoccluded.is_some());
        pooled.found = is_known.then(|| std::array::from_fn(|k| sent[k] as f32 / pooled.sent[k]));
        pooled
    }

    /// Whether so many samples find what occludes the light.
    fn is_clear(&self, pooled: &PooledEstimate) -> bool {
        pooled.effective.iter().copied().fold(0.0, f64::max) >= f64::from(TOLERANCE.clear * self.share.sqrt())
    }

    /// Whether samples may miss some of the unoccluded integral.
    fn may_miss(&self, pooled: &PooledEstimate, strata: &Strata, receivers: &[SampledReceiver]) -> bool {
        let spacing = strata.sampler.spacing(strata.count() as f32);
        let is_unseen = |k: usize| {
            pooled.effective[k] < f64::from(TOLERANCE.enough_samples) && receivers.iter().any(|one| one.reflects(k))
        };
        (0..MOMENTS).any(is_unseen)
            || receivers.iter().any(|one| !strata.sampler.varies_over(&one.place(self.each), spacing))
    }
}

/// What the samples of all rays of a patch estimate together, moment by moment.
struct PooledEstimate {
    /// One over the rays of the patch.
    part: f32,
    /// All that reaches the rays.
    value: Rgb,
    /// The unoccluded integral, and that of rays whose samples find less than three quarters of it.
    all: [Rgb; MOMENTS],
    missing: [Rgb; MOMENTS],
    /// The effective sample size.
    effective: [f64; MOMENTS],
    /// Whether any of the light is hidden from any ray, and whether all of it is from all.
    is_hidden: bool,
    is_dark: bool,
    /// The visible fractions.
    fractions: [f32; MOMENTS],
    /// The unoccluded integral over the measure of the light and, where it is known in closed form, the part of it that
    /// samples find.
    sent: [f32; MOMENTS],
    found: Option<[f32; MOMENTS]>,
    /// The part of it that [surprising](Strata::surprises) samples send.
    surprises: [f32; MOMENTS],
}

impl PooledEstimate {
    /// The display steps that an error makes, moment by moment.
    fn steps(&self, lights: &DirectLighting, error: impl Fn(usize) -> Rgb) -> f32 {
        let sum = (1..MOMENTS).fold(error(0), |sum, k| sum + error(k));
        lights.steps(self.value * self.part, sum * self.part)
    }

    /// What too few samples send to be sure of it: it can be off by what one of them sends.
    fn undersampled(&self, k: usize) -> Rgb {
        if self.effective[k] < f64::from(TOLERANCE.enough_samples) {
            self.all[k].min(self.all[k] * (1.0 / self.effective[k].max(1.0) as f32))
        } else {
            self.missing[k]
        }
    }

    /// How far off the estimate may be, by the variance of the samples and by what they surprisingly met.
    fn error(&self, strata: &Strata, receivers: &[SampledReceiver], lights: &DirectLighting) -> ErrorEstimate {
        let variance = VarianceEstimate::new(lights.level(), strata, receivers, self.sent, self.found);
        let effective = self.effective.map(|samples| samples.max(1.0) as f32);
        let met: [f32; MOMENTS] = std::array::from_fn(|k| self.surprises[k] + 1.0 / effective[k]);
        let steps = |part: &dyn Fn(usize) -> f32| self.steps(lights, |k| self.all[k] * part(k));
        // Small occluders that no sample met: about as many as surprising samples met, and one more (Good, "The
        // population frequencies of species and the estimation of population parameters", 1953). Each sample stands for
        // what it sends; where strata near those that were found are smaller, all that were not found are missing
        let noise = |k: usize| TOLERANCE.stratified * (met[k] / effective[k]).sqrt();
        let overlooked = steps(&|k| met[k]);
        let unmet = steps(&|k| noise(k).max(variance.smooth[k]));
        ErrorEstimate {
            edges: steps(&|k| variance.edges[k]),
            smooth: steps(&|k| variance.smooth[k]),
            unmet: if strata.is_uniform() { unmet } else { unmet.max(overlooked) },
            overlooked,
            near: variance.near,
        }
    }
}

/// Error estimates of the sum over all receivers, in display steps.
struct ErrorEstimate {
    /// By silhouettes: groups of samples of which some are hidden.
    edges: f32,
    /// By the variation of the light within other groups.
    smooth: f32,
    /// By that variation and by occluders that no sample met.
    unmet: f32,
    /// By occluders that no sample met in strata that are not halved.
    overlooked: f32,
    /// The blocks of strata near silhouettes.
    near: Vec<bool>,
}

impl ErrorEstimate {
    fn all(&self) -> f32 {
        (self.edges * self.edges + self.unmet * self.unmet).sqrt()
    }
}
