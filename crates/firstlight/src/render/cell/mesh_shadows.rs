//! The visibility of each light from all camera rays of a group of fragments, past the meshes and instances in trees.
//! A fragment whose rays all see the light unoccluded is lit once; where occluders hide some of it from some rays, the
//! light is sampled for all rays of the fragment together ([`PooledVisibility`]).

use std::ops::{ControlFlow, Range};

use super::{CellRenderer, FragmentQuery, PIXELS};
use crate::color::Rgb;
use crate::ids::LightId;
use crate::integrate::TOLERANCE;
use crate::material::{LightTerm, Moments, ShadingPoint};
use crate::render::fragment::{Fragment, ShadingRate};
use crate::render::pooled::{PooledLight, PooledVisibility, salt};
use crate::render::{AaMode, Counts};
use crate::scene::Scene;
use crate::visibility::{ShadowView, Viewpoint, Visibility};

/// What is known of one light at the camera rays of one fragment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) enum FragmentLight {
    /// The lighting grid has it.
    #[default]
    Done,
    /// The visibility of the light from all rays.
    Seen(Visibility),
    /// Visibility differs between the rays: the light is sampled for all of them together.
    PerRay,
    /// The sum over the rays, with the colours of their surfaces.
    Summed(LightTerm),
}

/// What is known of lights behind trees at the fragments of a cell.
pub(super) struct MeshShadows {
    /// Fragment by fragment, light by light.
    known: Vec<FragmentLight>,
    /// The fragment that fills a pixel of the cell, or [`NONE`].
    pub(super) only: Vec<u32>,
    /// The unoccluded light of each light at each fragment; empty before it is needed.
    unoccluded: Vec<Vec<Moments>>,
    /// The visible fraction of each light from each pixel by pilot rays; `None` before they are traced.
    pub(super) pilot: Vec<Option<f32>>,
    /// The interpolation nodes: pixel, light, its mean over the camera rays, and its visible fraction.
    pub(super) nodes: Vec<(usize, usize, (Moments, f32))>,
}

/// No fragment.
pub(super) const NONE: u32 = u32::MAX;
/// The most camera rays that are classified together, unless one fragment has more.
const TOGETHER: usize = 64;

impl MeshShadows {
    pub fn new(scene: &Scene, lights: usize) -> Self {
        MeshShadows {
            known: Vec::new(),
            only: vec![NONE; PIXELS],
            unoccluded: vec![Vec::new(); lights],
            pilot: vec![None; if scene.geometry.is_sampled_past() { PIXELS * lights } else { 0 }],
            nodes: Vec::new(),
        }
    }
}

/// The visibility of one light from the rays of some fragments.
struct RayVisibility {
    light: usize,
    /// The fragments, each with its rays.
    fragments: Vec<(usize, Range<usize>)>,
    /// Ray by ray; `None` where others represent it.
    visibility: Vec<Option<Visibility>>,
    /// Ray by ray, what may occlude a light that has to be sampled.
    views: Vec<Option<ShadowView>>,
}

impl CellRenderer<'_> {
    /// Classifies the visibility of the queued lights past what is in the trees, and removes those from the queues
    /// whose contribution is known thereby.
    pub(super) fn mesh_shadows(
        &mut self,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if !self.scene.geometry.is_sampled_past() {
            return ControlFlow::Continue(());
        }
        self.begin_shadows(counts);
        if self.mode != AaMode::Full {
            self.penumbra_grid(counts, go_on)?;
        }
        let mut next = 0;
        while next < self.fragments.all.len() {
            next = self.classify_fragments(next, counts);
            go_on()?;
        }
        for rate in [ShadingRate::Fragment, ShadingRate::Quadrant] {
            let mut queue = std::mem::take(&mut self.queues[rate as usize]);
            queue.retain_mut(|query| self.is_left(query));
            self.queues[rate as usize] = queue;
        }
        ControlFlow::Continue(())
    }

    /// Whether a queued light stays in its queue, with its visibility; the contributions of others are added.
    fn is_left(&mut self, query: &mut FragmentQuery) -> bool {
        let FragmentQuery { fragment, light, visibility } = query;
        *visibility = match self.fragment_light(*fragment as usize, *light as usize) {
            FragmentLight::Done => Visibility::Partial,
            FragmentLight::Seen(Visibility::None) => return false,
            FragmentLight::Seen(visibility) => visibility,
            FragmentLight::PerRay => {
                self.queues[ShadingRate::Ray as usize].push(FragmentQuery::new(*fragment, *light));
                return false;
            }
            FragmentLight::Summed(terms) => {
                *self.term(*fragment, *light) += terms;
                return false;
            }
        };
        true
    }

    /// Clears what is known of lights, and traces the rays of all fragments with queued lights.
    fn begin_shadows(&mut self, counts: &mut Counts) {
        let lights = self.scene.lights.len();
        self.shadows.unoccluded.iter_mut().for_each(Vec::clear);
        self.shadows.nodes.clear();
        self.shadows.pilot.fill(None);
        self.shadows.only.fill(NONE);
        self.shadows.known.clear();
        self.shadows.known.resize(self.fragments.all.len() * lights, FragmentLight::Done);
        for FragmentQuery { fragment, light, .. } in self.queues.iter().flatten() {
            self.shadows.known[*fragment as usize * lights + *light as usize] =
                FragmentLight::Seen(Visibility::Partial);
        }
        for number in 0..self.fragments.all.len() {
            if self.is_open(number) {
                self.trace_rays(number, counts);
            }
            let Fragment { count, mean, rays, is_layered, .. } = &self.fragments.all[number];
            if !is_layered && *count == self.rays_per_pixel() && !mean.lobes_differ && !rays.is_empty() {
                let pixel = self.pixel_of(number);
                self.shadows.only[pixel] = number as u32;
            }
        }
    }

    /// Whether the visibility of any light from a fragment is unknown.
    fn is_open(&self, fragment: usize) -> bool {
        let lights = self.scene.lights.len();
        let known = &self.shadows.known[fragment * lights..][..lights];
        known.iter().any(|light| matches!(light, FragmentLight::Seen(Visibility::Partial)))
    }

    /// Classifies the lights of which nothing is known from all rays of some fragments, from number `first` on, and
    /// samples them where that is needed. Returns the number of the next fragment.
    fn classify_fragments(&mut self, first: usize, counts: &mut Counts) -> usize {
        let (mut fragments, mut rays, mut next) = (Vec::new(), 0, first);
        while let Some(fragment) = self.fragments.all.get(next)
            && (rays == 0 || rays + fragment.rays.len() <= TOGETHER)
        {
            // By roundings all rays may miss the fragment
            if fragment.count > 0 && self.is_open(next) {
                rays += fragment.rays.len();
                fragments.push(next);
            }
            next += 1;
        }
        let mut classified = Vec::new();
        for light in 0..self.scene.lights.len() {
            let is_open = |fragment: &usize| {
                self.lights.is_classified_by_blocks(light)
                    && matches!(self.fragment_light(*fragment, light), FragmentLight::Seen(Visibility::Partial))
            };
            let open: Vec<usize> = fragments.iter().copied().filter(is_open).collect();
            if !open.is_empty() {
                let rays = self.classify_rays(&open, light, counts);
                for (fragment, rays_of) in &rays.fragments {
                    let known = rays.of_fragment(rays_of);
                    self.shadows.known[*fragment * self.scene.lights.len() + light] = known;
                }
                classified.push(rays);
            }
        }
        // With all that is known of other lights
        for rays in classified {
            let light = rays.light;
            let is_sampled = |(fragment, rays_of): &(usize, Range<usize>)| {
                rays.views[rays_of.clone()].iter().any(Option::is_some)
                    && matches!(self.fragment_light(*fragment, light), FragmentLight::PerRay)
            };
            let sampled = rays.fragments.iter().filter(|of| is_sampled(of)).cloned().collect();
            for (fragment, PooledLight { terms, .. }) in self.sample(rays, sampled, false, counts) {
                self.shadows.known[fragment * self.scene.lights.len() + light] = FragmentLight::Summed(terms);
            }
        }
        next
    }

    /// What is known of a light at a fragment.
    pub(super) fn fragment_light(&self, fragment: usize, light: usize) -> FragmentLight {
        self.shadows.known[fragment * self.scene.lights.len() + light]
    }

    /// The number of integrated lights of a fragment of which such a thing is known.
    fn count_lights(&self, fragment: usize, is: impl Fn(FragmentLight) -> bool) -> usize {
        let is = |light: &usize| self.lights.is_integrated(*light) && is(self.fragment_light(fragment, *light));
        (0..self.scene.lights.len()).filter(is).count()
    }

    /// The number of lights that were sampled for the rays of a fragment.
    pub(super) fn count_sampled(&self, fragment: usize) -> usize {
        self.count_lights(fragment, |light| matches!(light, FragmentLight::Summed(_)))
    }

    /// Stores what is known of a light at a fragment, unless its contribution is known already.
    pub(super) fn note(&mut self, fragment: usize, light: usize, now: FragmentLight) {
        let known = &mut self.shadows.known[fragment * self.scene.lights.len() + light];
        if matches!(known, FragmentLight::Seen(Visibility::Partial | Visibility::Listed)) {
            *known = now;
        }
    }

    /// A lower bound of the radiance of a fragment by other lights than one, as far as it is known by now.
    pub(super) fn others(&mut self, fragment: usize, light: usize, counts: &mut Counts) -> Rgb {
        let lights = self.scene.lights.len();
        let per_ray = 1.0 / self.fragments.all[fragment].count as f32;
        let mut others = Rgb::BLACK;
        for other in (0..lights).filter(|other| *other != light) {
            let scale = self.lights.scale(other);
            let fraction = match self.fragment_light(fragment, other) {
                FragmentLight::Summed(terms) => {
                    others += scale * terms.sum() * per_ray;
                    continue;
                }
                FragmentLight::Done => {
                    others += scale * self.term(fragment as u32, other as u32).sum() * per_ray;
                    continue;
                }
                FragmentLight::Seen(Visibility::Full) => 1.0,
                FragmentLight::Seen(Visibility::Partial) => {
                    let pixel = self.pixel_of(fragment);
                    if self.shadows.only[pixel] == fragment as u32 { self.pilot(pixel, other) } else { 0.0 }
                }
                FragmentLight::Seen(_) | FragmentLight::PerRay => 0.0,
            };
            if fraction > 0.0 {
                others += self.unoccluded(fragment, other, counts) * fraction;
            }
        }
        others
    }

    /// The unoccluded radiance of a fragment by an integrated light; black for other lights. The integrals at all
    /// fragments of the cell are evaluated in one call.
    fn unoccluded(&mut self, fragment: usize, light: usize, counts: &mut Counts) -> Rgb {
        let lights = &mut self.lights;
        if !(lights.is_integrated(light) && lights.has_closed_form(light)) {
            return Rgb::BLACK;
        }
        let (fragments, unoccluded) = (&self.fragments, &mut self.shadows.unoccluded[light]);
        if unoccluded.is_empty() {
            let points = fragments.all.iter().map(|fragment| {
                let rate = if fragment.rays.is_empty() { ShadingRate::Quadrant } else { ShadingRate::Ray };
                let point = fragments.points_of(rate)[fragment.range(rate).start];
                ShadingPoint { reach: 0.0, turn: 0.0, share: 1.0, ..point }
            });
            let points: Vec<ShadingPoint> = points.collect();
            let estimates = lights.estimate_each(light, &points, |_| Visibility::Full, counts);
            unoccluded.extend(estimates.iter().map(|estimate| estimate.moments));
        }
        lights.scale(light) * fragments.all[fragment].mean.bsdf.colors.of(&unoccluded[fragment])
    }

    /// Samples a light at all rays of the fragment of a pixel that is an interpolation node.
    pub(super) fn pool_alone(&mut self, fragment: usize, light: usize, counts: &mut Counts) -> PooledLight {
        let rays = self.classify_rays(&[fragment], light, counts);
        let sampled = rays.fragments.clone();
        self.sample(rays, sampled, true, counts).swap_remove(0).1
    }

    /// Samples a light at all rays of some of the classified fragments: the sums over the rays. `are_nodes` if their
    /// pixels are interpolation nodes.
    fn sample(
        &mut self,
        mut rays: RayVisibility,
        fragments: Vec<(usize, Range<usize>)>,
        are_nodes: bool,
        counts: &mut Counts,
    ) -> Vec<(usize, PooledLight)> {
        let before = counts.work();
        let pool = |of: &(usize, Range<usize>)| self.pool(&mut rays, of, are_nodes, counts);
        let mut pools: Vec<PooledVisibility> = fragments.iter().map(pool).collect();
        PooledVisibility::resolve(&mut pools, &mut self.lights, counts);
        let each = (counts.work() - before) / fragments.len().max(1) as f32;
        let mut sampled = Vec::new();
        for ((fragment, rays_of), pooled) in fragments.into_iter().zip(pools) {
            let before = counts.work();
            let mut pooled = pooled.estimate(&mut self.lights, counts);
            let per_kept = self.fragments.all[fragment].count as f32 / rays.kept(&rays_of) as f32;
            (pooled.terms, pooled.moments) = (pooled.terms * per_kept, pooled.moments * per_kept);
            let pixel = self.pixel_of(fragment);
            self.sums.work[pixel] += each + counts.work() - before;
            sampled.push((fragment, pooled));
        }
        rays.views.into_iter().flatten().for_each(|view| self.lights.keep(view));
        sampled
    }

    /// A light at all rays of a fragment.
    fn pool(
        &mut self,
        rays: &mut RayVisibility,
        (number, rays_of): &(usize, Range<usize>),
        is_node: bool,
        counts: &mut Counts,
    ) -> PooledVisibility {
        let light = rays.light;
        let others = self.others(*number, light, counts);
        // The most lights that may be sampled for the fragment, by what is known so far
        let sampled = self.count_lights(*number, |light| {
            !matches!(light, FragmentLight::Done | FragmentLight::Seen(Visibility::Full | Visibility::None))
        });
        let fragment = &self.fragments.all[*number];
        let salt = salt(self.at(self.pixel_of(*number)), fragment.surface);
        let share = if is_node { fragment.share * TOLERANCE.node_pixels } else { fragment.share };
        let (scale, kept) = (self.lights.scale(light), rays.kept(rays_of));
        let mut pooled = PooledVisibility::new(light, scale, kept, share, salt, others, sampled);
        for (point, ray) in self.fragments.rays[fragment.rays.clone()].iter().zip(rays_of.clone()) {
            match rays.visibility[ray] {
                None => {}
                Some(Visibility::None) => pooled.add_known(point, &Moments::ZERO, Some(0.0)),
                Some(Visibility::BelowHorizon) => pooled.add_known(point, &Moments::ZERO, None),
                Some(Visibility::Partial) if self.lights.is_integrated(light) => {
                    pooled.add_behind(point, rays.views[ray].take().expect("lights to be sampled have a view"));
                }
                Some(visibility) => pooled.add(&mut self.lights, point, visibility, counts),
            }
        }
        pooled
    }

    /// Classifies the visibility of a light from each ray of some fragments.
    fn classify_rays(&mut self, fragments: &[usize], light: usize, counts: &mut Counts) -> RayVisibility {
        let scene = self.scene;
        let n = scene.antialiasing;
        let (mut points, mut order, mut visibility) = (Vec::new(), Vec::new(), Vec::new());
        let mut ranges = Vec::new();
        for number in fragments {
            let Fragment { surface, count, rays, .. } = &self.fragments.all[*number];
            let shines = scene.geometry.links.contains(scene.geometry.lights_of(*surface), LightId(light as u32));
            // Where one surface fills a pixel, every second ray may represent all: shadows are as wide as the light
            let may_skip = *count == n * n
                && self.lights.is_integrated(light)
                && scene.tolerance() as f32 >= TOLERANCE.half_of_rays;
            let first = points.len();
            for (k, point) in (0..n * n).cycle().zip(&self.fragments.rays[rays.clone()]) {
                if may_skip && (k % n + k / n) % 2 == 1 {
                    visibility.push(None);
                } else {
                    if shines && scene.lights[light].shadows && point.receives_shadow {
                        order.push(points.len() as u32);
                    }
                    visibility.push(Some(if shines { Visibility::Full } else { Visibility::BelowHorizon }));
                }
                points.push(Viewpoint::of(point));
            }
            ranges.push((*number, first..points.len()));
        }
        let mut views: Vec<Option<ShadowView>> = Vec::new();
        views.resize_with(points.len(), || None);
        self.lights.classify(light, &points, &mut order, counts, |ray, now, view| {
            visibility[ray] = Some(now);
            views[ray] = view;
        });
        RayVisibility { light, fragments: ranges, visibility, views }
    }
}

impl RayVisibility {
    /// What is known by it of the light at a fragment with such rays.
    fn of_fragment(&self, rays: &Range<usize>) -> FragmentLight {
        let of = |visibility| self.visibility[rays.clone()].iter().filter(|one| **one == Some(visibility)).count();
        let hidden = of(Visibility::None);
        if hidden + of(Visibility::BelowHorizon) == self.kept(rays) {
            FragmentLight::Seen(Visibility::None)
        } else if hidden > 0 || of(Visibility::Partial) > 0 {
            FragmentLight::PerRay
        } else if of(Visibility::Listed) > 0 {
            FragmentLight::Seen(Visibility::Listed)
        } else {
            FragmentLight::Seen(Visibility::Full)
        }
    }

    /// The number of rays of a fragment that represent all.
    fn kept(&self, rays: &Range<usize>) -> usize {
        self.visibility[rays.clone()].iter().flatten().count()
    }
}
