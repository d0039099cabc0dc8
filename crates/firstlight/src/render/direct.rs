//! Direct light at shading points: each light is estimated for all points that need it together.
//!
//! Lights that are integrated are evaluated in batches of sixteen points ([`AreaLightIntegrator`]), past the listed
//! occluders. Where anything in the BVHs may occlude a light, the estimate is unknown, and callers sample the light
//! ([`pooled`](super::pooled)).

mod gather;
mod sampled;
mod single;

use std::ops::ControlFlow;

use fearless_simd::Level;

use super::lights::{JudgedSteps, Lights};
use super::pooled::LightSampler;
use super::{Counts, QUESTION_EVERY};
use crate::color::{DisplaySteps, Rgb};
use crate::ids::LightId;
use crate::integrate::{AreaLightIntegrator, Emitter, LightIntegral, LightTask, TOLERANCE};
use crate::light::LightTree;
use crate::material::{LobeKind, Moments, ShadingPoint};
use crate::math::LANES;
use crate::scene::Scene;
use crate::visibility::{OccluderList, ShadowView, Visibility, VisibilityResolver};
pub(super) use sampled::Sampled;

/// The most points that a sampled light is summed for between two calls of `go_on`.
const AT_ONCE: u64 = 256;

/// One light at one shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightQuery {
    /// The number of the point among those of the call.
    pub point: u32,
    pub light: u32,
    /// What is known of its visibility from all of the footprint.
    pub visibility: Visibility,
}

/// What one light sends to a shading point, and how much that varies over the point's footprint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightEstimate {
    /// At the point; not a number where the light has to be sampled, or varies too much over the footprint.
    pub moments: Moments,
    /// Whether the light is fully visible, or invisible, from all of the footprint.
    pub is_uniform: bool,
    /// The motion of silhouettes on the light over the footprint, as a part of the light's size.
    pub motion: f32,
    /// In radians: the rotation of the light's direction against the normal over the footprint, times the square root
    /// of the lobe's exponent; infinite near the light or its plane.
    pub turn: f32,
    /// The approximate maximum of a moment of the light here: its measure over the squared distance.
    pub most: f32,
    /// What is known by now of its visibility from all of the footprint.
    pub visibility: Visibility,
}

impl LightEstimate {
    /// A light of which nothing arrives, anywhere on the footprint.
    pub const NOTHING: LightEstimate = LightEstimate {
        moments: Moments::ZERO,
        is_uniform: true,
        motion: 0.0,
        turn: 0.0,
        most: 0.0,
        visibility: Visibility::Partial,
    };
    /// A light that has to be sampled.
    pub const UNKNOWN: LightEstimate = LightEstimate {
        moments: Moments::UNKNOWN,
        is_uniform: false,
        motion: f32::INFINITY,
        turn: f32::INFINITY,
        ..LightEstimate::NOTHING
    };

    /// The difference between the mean over the footprint and the value at the point by the rotation of the light, as
    /// a part of [`most`](Self::most).
    pub fn turned(&self) -> f32 {
        0.5 * self.turn * self.turn
    }

    /// The same by a discontinuous derivative of the visible fraction, where a silhouette or the horizon leaves the
    /// light: an eighth of the motion.
    pub fn kink(&self) -> f32 {
        let moved = if self.is_uniform { self.motion } else { self.motion.max(self.turn) };
        if self.moments.cosine() > moved * self.most { 0.0 } else { 0.125 * moved }
    }

    /// The difference between the mean of a moment over the footprint and its value at the point.
    pub fn bend(&self) -> f32 {
        if self.turn == f32::INFINITY { f32::MAX } else { (self.turned() + self.kink()).min(1.0) * self.most }
    }
}

/// The kind of lobe and the light of a query, and whether occluders count.
type GroupKey = (Option<LobeKind>, u32, bool);

/// Queries for one light at points whose lobes are of one kind.
struct Group<'p> {
    light: usize,
    lobe: Option<LobeKind>,
    points: &'p [ShadingPoint],
    queries: &'p [LightQuery],
}

impl<'p> Group<'p> {
    fn query(&self, k: u32) -> &'p LightQuery {
        &self.queries[k as usize]
    }

    fn point(&self, k: u32) -> &'p ShadingPoint {
        &self.points[self.query(k).point as usize]
    }
}

/// Direct lighting by one thread. Keeps its memory.
pub(crate) struct DirectLighting<'a> {
    pub(super) scene: &'a Scene,
    pub(super) lights: &'a Lights<'a>,
    pub(super) level: Level,
    pub(super) evaluator: AreaLightIntegrator,
    /// By which errors are weighed.
    steps: &'a JudgedSteps,
    /// In display steps: the allowed error of one light at a point.
    allowed: f32,
    /// The numbers of queries, by kind of lobe, light, and whether occluders count.
    order: Vec<(GroupKey, u32)>,
    points: Vec<ShadingPoint>,
    integrals: Vec<LightIntegral>,
    /// Of a group: the queries whose light only listed shapes may occlude.
    listed: Vec<u32>,
    pub(super) occluders: OccluderList,
    pub(super) resolver: VisibilityResolver,
    indices: Vec<u32>,
    /// Views that are not used any more.
    views: Vec<ShadowView>,
}

impl<'a> DirectLighting<'a> {
    pub fn new(scene: &'a Scene, lights: &'a Lights<'a>, level: Level) -> Self {
        DirectLighting {
            scene,
            lights,
            level,
            evaluator: AreaLightIntegrator::default(),
            steps: &lights.steps,
            allowed: lights.allowed,
            order: Vec::new(),
            points: Vec::new(),
            integrals: Vec::new(),
            listed: Vec::new(),
            occluders: OccluderList::default(),
            resolver: VisibilityResolver::default(),
            indices: Vec::new(),
            views: Vec::new(),
        }
    }

    /// The tree of all lights, where there are many.
    pub fn tree(&self) -> Option<&'a LightTree> {
        self.lights.tree.as_ref()
    }

    /// The instruction set.
    pub fn level(&self) -> Level {
        self.level
    }

    /// The display curve, by which errors are weighed.
    pub fn display_steps(&self) -> &'a DisplaySteps {
        &self.steps.curve
    }

    /// Weighs errors of light as if it was raised by so many stops, in place of the exposure of the scene.
    pub fn judge_at(&mut self, stop: i32) {
        self.steps = self.lights.steps_at(stop);
    }

    /// Sets the allowed error of each light, in display steps.
    pub fn tolerate(&mut self, allowed: f32) {
        self.allowed = allowed;
    }

    /// The display steps between a value and the same value less an error.
    pub fn steps(&self, value: Rgb, error: Rgb) -> f32 {
        self.steps.curve.of_color(value, error)
    }

    /// The factor of the moments of light `index`, before the colours of the surface.
    pub fn scale(&self, index: usize) -> Rgb {
        self.lights.scales[index]
    }

    /// The same for all lights.
    pub fn scales(&self) -> &'a [Rgb] {
        &self.lights.scales
    }

    /// Whether a light is integrated.
    pub fn is_integrated(&self, index: usize) -> bool {
        self.scene.lights[index].is_integrated()
    }

    /// Whether that is so of all lights.
    pub fn are_all_integrated(&self) -> bool {
        (0..self.scene.lights.len()).all(|light| self.is_integrated(light))
    }

    /// Whether what an area light sends past no occluders is integrated without samples.
    pub fn has_closed_form(&self, index: usize) -> bool {
        self.lights.emitters[index].is_some()
    }

    /// Whether a light is integrated and casts shadows: then it is sampled behind occluders in BVHs.
    pub fn is_sampled_past_trees(&self, index: usize) -> bool {
        self.is_integrated(index) && self.scene.lights[index].shadows
    }

    /// Whether the visibility of light `index` is classified for all rays of a block of pixels together: not that of
    /// area lights that are sampled at fixed points.
    pub fn is_classified_by_blocks(&self, index: usize) -> bool {
        let light = &self.scene.lights[index];
        light.area().is_none() || light.is_integrated()
    }

    /// In display steps: the allowed error of one light at a point that represents such a share of a pixel, where the
    /// errors of neighbours are nearly independent.
    pub fn tolerance_by_chance(&self, share: f32) -> f32 {
        self.allowed * TOLERANCE.by_chance / share.max(TOLERANCE.least_share).sqrt()
    }

    /// Whether a light illuminates the surface of a point.
    pub(super) fn is_linked(&self, index: usize, point: &ShadingPoint) -> bool {
        let geometry = &self.scene.geometry;
        geometry.links.contains(geometry.lights_of(point.surface), LightId(index as u32))
    }

    /// Estimates one light at one point.
    pub fn estimate_one(
        &mut self,
        light: usize,
        point: &ShadingPoint,
        visibility: Visibility,
        counts: &mut Counts,
    ) -> LightEstimate {
        self.estimate_each(light, std::slice::from_ref(point), |_| visibility, counts)[0]
    }

    /// Estimates one light at each point.
    pub fn estimate_each(
        &mut self,
        light: usize,
        points: &[ShadingPoint],
        visibility: impl Fn(usize) -> Visibility,
        counts: &mut Counts,
    ) -> Vec<LightEstimate> {
        let query = |k| LightQuery { point: k as u32, light: light as u32, visibility: visibility(k) };
        let queries: Vec<LightQuery> = (0..points.len()).map(query).collect();
        let mut estimates = Vec::with_capacity(points.len());
        self.estimate_all(points, &queries, &mut estimates, counts);
        estimates
    }

    /// Estimates each query, without a break.
    pub fn estimate_all(
        &mut self,
        points: &[ShadingPoint],
        queries: &[LightQuery],
        estimates: &mut Vec<LightEstimate>,
        counts: &mut Counts,
    ) {
        let go_on = || ControlFlow::Continue(());
        let ControlFlow::Continue(()) = self.estimate(points, queries, estimates, counts, &go_on) else {
            unreachable!("it always goes on")
        };
    }

    /// Replaces `estimates` by the estimate of each query. `go_on` is called between groups and batches.
    pub fn estimate(
        &mut self,
        points: &[ShadingPoint],
        queries: &[LightQuery],
        estimates: &mut Vec<LightEstimate>,
        counts: &mut Counts,
        go_on: &dyn Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let scene = self.scene;
        estimates.clear();
        estimates.resize(queries.len(), LightEstimate::NOTHING);
        // Sort the queries by kind of lobe, light and shadows
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        for (k, query) in queries.iter().enumerate() {
            let point = &points[query.point as usize];
            if !self.is_linked(query.light as usize, point) {
                continue;
            }
            let shadows = scene.lights[query.light as usize].shadows
                && point.receives_shadow
                && query.visibility != Visibility::Full;
            order.push(((point.bsdf.lobe.kind(), query.light, shadows), k as u32));
        }
        order.sort_unstable();
        let mut members = Vec::new();
        for group in order.chunk_by(|(one, _), (other, _)| one == other) {
            let ((lobe, light, shadows), _) = group[0];
            let light = light as usize;
            members.clear();
            members.extend(group.iter().map(|(_, k)| *k));
            let of = Group { light, lobe, points, queries };
            match scene.lights[light].area() {
                None => {
                    for k in &members {
                        estimates[*k as usize] = self.single(&of, *k, counts);
                    }
                    go_on()?;
                }
                Some(_) if self.is_integrated(light) => {
                    self.evaluate(&of, shadows, &members, estimates, counts, go_on)?;
                }
                Some(area) => {
                    let varying: Vec<u32> = members.iter().copied().filter(|k| of.point(*k).reach > 0.0).collect();
                    self.evaluate(&of, shadows, &varying, estimates, counts, go_on)?;
                    let at_once = (QUESTION_EVERY / area.samples() as u64).clamp(1, AT_ONCE) as usize;
                    for some in members.chunks(at_once) {
                        go_on()?;
                        self.add_samples(&of, area, some, estimates, counts);
                    }
                }
            }
        }
        self.order = order;
        ControlFlow::Continue(())
    }

    /// Evaluates an area light at some points of a group, past its occluders: its moments if it is integrated, and its
    /// variation over the footprints.
    fn evaluate(
        &mut self,
        of: &Group,
        shadows: bool,
        members: &[u32],
        estimates: &mut [LightEstimate],
        counts: &mut Counts,
        go_on: &dyn Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if !self.has_closed_form(of.light) {
            members.iter().for_each(|k| estimates[*k as usize] = LightEstimate::UNKNOWN);
            return ControlFlow::Continue(());
        }
        let visibility = if shadows { Visibility::Listed } else { Visibility::Full };
        if !(shadows && self.lights.has_trees(self.scene, of.light)) {
            self.batch(of, visibility, members, estimates, counts);
            return ControlFlow::Continue(());
        }
        // Where something in the BVHs may occlude the light, the estimate is unknown
        let mut listed = std::mem::take(&mut self.listed);
        listed.clear();
        for k in members {
            if of.query(*k).visibility == Visibility::Listed {
                listed.push(*k);
                continue;
            }
            go_on()?;
            if self.is_clear_of_trees(of.light, of.point(*k)) {
                listed.push(*k);
            } else {
                self.unknown(of, *k, estimates, counts);
            }
        }
        self.batch(of, visibility, &listed, estimates, counts);
        self.listed = listed;
        ControlFlow::Continue(())
    }

    /// The same for any number of points, past known occluders.
    fn batch(
        &mut self,
        of: &Group,
        visibility: Visibility,
        members: &[u32],
        estimates: &mut [LightEstimate],
        counts: &mut Counts,
    ) {
        let sums = self.is_integrated(of.light);
        self.arrive(of, visibility, sums, members, counts);
        for (integral, k) in self.integrals.iter().zip(members) {
            if sums {
                counts.note(integral.visibility);
            }
            estimates[*k as usize] = LightEstimate { visibility, ..self.variation(of, *k, integral) };
        }
    }

    /// Notes that a light has to be sampled at a point. If its value is needed whatever the motion of silhouettes over
    /// the footprint, its rotation and its maximum are estimated.
    fn unknown(&mut self, of: &Group, k: u32, estimates: &mut [LightEstimate], counts: &mut Counts) {
        let point = of.point(k);
        estimates[k as usize] = LightEstimate::UNKNOWN;
        if point.reach > 0.0 && point.most_motion == f32::INFINITY {
            self.arrive(of, Visibility::Full, false, &[k], counts);
            let LightEstimate { turn, most, .. } = self.variation(of, k, &self.integrals[0]);
            estimates[k as usize] = LightEstimate { turn, most, ..LightEstimate::UNKNOWN };
        }
    }

    /// Evaluates an area light at some points of a group: its moments only with `sums`.
    fn arrive(&mut self, of: &Group, visibility: Visibility, sums: bool, members: &[u32], counts: &mut Counts) {
        counts.batches += members.len().div_ceil(LANES) as u64;
        counts.batched_points += members.len() as u64;
        self.points.clear();
        self.points.extend(members.iter().map(|k| *of.point(*k)));
        self.integrals.clear();
        let shadows = visibility != Visibility::Full;
        let Some(task) = self.lights.task(of.light, of.lobe, shadows, self.steps) else {
            unreachable!("it has an area")
        };
        let task = LightTask { sums, allowed: self.allowed, ..task };
        self.evaluator.evaluate(self.level, &task, &self.points, &mut self.integrals);
    }

    /// The estimate of an integrated light: its moments and its variation over the footprint.
    fn variation(&self, of: &Group, k: u32, integral: &LightIntegral) -> LightEstimate {
        let LightIntegral { sums, visibility, proved, motion, distance, height } = *integral;
        let (light, point) = (&self.scene.lights[of.light], of.point(k));
        let most = light.area().map_or(1.0, |area| area.most(distance));
        if visibility == Visibility::Partial {
            return LightEstimate { most, ..LightEstimate::UNKNOWN };
        }
        let is_one_sided = self.lights.emitters[of.light].as_ref().is_some_and(Emitter::is_one_sided);
        let is_near = is_one_sided && height <= point.reach;
        let turn = if is_near && !proved { f32::INFINITY } else { self.turn(point, distance) };
        LightEstimate { moments: sums, is_uniform: proved, motion, turn, most, visibility: Visibility::Partial }
    }

    /// The samples of area light `index`.
    pub fn sampler(&self, index: usize) -> LightSampler<'a> {
        let (scene, level) = (self.scene, self.level);
        let area = scene.lights[index].area().expect("lights that are integrated have an area");
        let Lights { emitters, targets, point_sets, .. } = self.lights;
        let (emitter, target, sets) = (emitters[index].as_ref(), &targets[index], &point_sets[index]);
        LightSampler { scene, level, area, emitter, target, sets }
    }

    /// In radians: the rotation of directions over the footprint of a point, over the width of its lobe.
    pub(super) fn turn(&self, point: &ShadingPoint, distance: f32) -> f32 {
        if point.reach == 0.0 {
            return 0.0;
        }
        let sway = self.scene.camera.sway(point.p, point.reach);
        let angle = point.turn + 0.5 * (point.reach / distance + sway);
        // As the exponent of Blinn's model
        angle * (8.0 * point.bsdf.lobe.sharpness(1.0)).max(1.0).sqrt()
    }
}
