//! The visibility of each light from all camera rays of a group of fragments, past the meshes and instances in trees.
//! A fragment whose rays all see the light unoccluded is lit once; where occluders hide some of it from some rays, the
//! light is sampled for all rays of the fragment together ([`PooledVisibility`]).

use std::ops::{ControlFlow, Range};

use super::{Cells, PIXELS, Pixel, Wanted};
use crate::color::Rgb;
use crate::film::resolve::LightTerm;
use crate::ids::LightId;
use crate::integrate::TOLERANCE;
use crate::material::{Moments, ShadingPoint};
use crate::render::direct::DirectLighting;
use crate::render::fragment::{Fragment, Fragments};
use crate::render::pooled::{PooledLight, PooledVisibility, salt};
use crate::render::{AaMode, Counts};
use crate::scene::Scene;
use crate::visibility::{ShadowView, Viewpoint, Visibility};

/// What is known of one light at the camera rays of one fragment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) enum FragmentLight {
    /// It is interpolated, and nothing is to be done.
    #[default]
    Done,
    /// The visibility of the light from all rays.
    Seen(Visibility),
    /// Rays differ: each is lit by itself.
    PerRay,
    /// The sum over the rays, with the colours of their surfaces.
    Summed(LightTerm),
}

/// What is known of the ways past trees. Keeps its memory.
pub(super) struct Behind {
    /// Fragment by fragment, light by light.
    known: Vec<FragmentLight>,
    /// The fragment that fills a pixel of the cell, or [`NONE`].
    pub(super) only: Vec<u32>,
    block: RayBlock,
    sights: Vec<RaySights>,
    /// What each light would send to each fragment of the cell if nothing were in the way, once that is known.
    wholes: Vec<Vec<Moments>>,
    /// The visible fraction of each light from each pixel, by pilot rays, and which blocks of pixels have shot theirs.
    pub(super) votes: Vec<f32>,
    pub(super) voted: Vec<bool>,
    /// The shading points of a square; the interpolation nodes of the cell: pixel, light, and what it receives.
    pub(super) points: Vec<Viewpoint>,
    pub(super) nodes: Vec<(usize, usize, super::squares::SquareNode)>,
}

/// No fragment.
pub(super) const NONE: u32 = u32::MAX;
/// The most camera rays that are classified together, unless one fragment has more.
const TOGETHER: usize = 64;

impl Behind {
    pub fn new(scene: &Scene, lights: usize) -> Self {
        let across = if scene.geometry.has_boxes() { PIXELS * lights } else { 0 };
        Behind {
            known: Vec::new(),
            only: vec![NONE; PIXELS],
            block: RayBlock::default(),
            sights: Vec::new(),
            wholes: vec![Vec::new(); lights],
            votes: vec![f32::NAN; across],
            voted: vec![false; across],
            points: Vec::new(),
            nodes: Vec::new(),
        }
    }
}

/// Whether ray `k` of a pixel of n x n is one of those that sample area lights for all.
fn is_kept(k: u32, n: u32, tolerance: f32) -> bool {
    tolerance < TOLERANCE.half_of_rays || (k % n + k / n).is_multiple_of(2)
}

/// The shading points of the camera rays of some fragments. Keeps its memory.
#[derive(Default)]
struct RayBlock {
    places: Vec<ShadingPoint>,
    points: Vec<Viewpoint>,
    fragments: Vec<FragmentRays>,
}

/// What the rays of a block see of one light. Keeps its memory.
#[derive(Default)]
struct RaySights {
    /// Which fragments have rays to be classified.
    open: Vec<bool>,
    order: Vec<u32>,
    sights: Vec<Option<Visibility>>,
    /// Of those that are behind things, what is in the way.
    views: Vec<Option<ShadowView>>,
}

/// A fragment of the block.
#[derive(Clone, Copy)]
struct FragmentRays {
    /// Its number in the cell.
    fragment: u32,
    /// The first of its rays in the block, and how many.
    first: u32,
    count: u32,
}

impl Cells<'_> {
    /// Classifies the visibility of the queued lights past what lies in trees, and takes those off the queue whose
    /// contribution is known by that.
    pub(super) fn behind(&mut self, counts: &mut Counts, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        if !self.scene.geometry.has_boxes() {
            return ControlFlow::Continue(());
        }
        self.begin_looking(counts);
        if self.mode == AaMode::Adaptive {
            self.squares(counts, go_on)?;
        }
        let mut next = 0;
        while next < self.fragments.all.len() {
            next = self.look(next, counts);
            go_on()?;
        }
        let mut wanted = std::mem::take(&mut self.wanted);
        self.tell_wanted(&mut wanted);
        self.wanted = wanted;
        let mut parted = std::mem::take(&mut self.parted);
        self.tell_wanted(&mut parted);
        self.parted = parted;
        ControlFlow::Continue(())
    }

    /// Keeps the queued lights whose contribution is not known, with their visibility, and adds the others.
    fn tell_wanted(&mut self, wanted: &mut Vec<Wanted>) {
        wanted.retain_mut(|Wanted { fragment, light, visibility, .. }| {
            *visibility = match self.fragment_light(*fragment as usize, *light as usize) {
                FragmentLight::Done => Visibility::Partial,
                FragmentLight::Seen(Visibility::None) => return false,
                FragmentLight::Seen(visibility) => visibility,
                FragmentLight::PerRay => {
                    self.refused.push(Wanted::new(*fragment, *light));
                    return false;
                }
                FragmentLight::Summed(terms) => {
                    let pixel = self.fragments.all[*fragment as usize].pixel as usize;
                    self.terms[pixel * self.scene.lights.len() + *light as usize] += terms;
                    return false;
                }
            };
            true
        });
    }

    /// Makes room for what the rays of each fragment of the cell see.
    fn begin_looking(&mut self, counts: &mut Counts) {
        let scene = self.scene;
        let lights = scene.lights.len();
        self.behind.wholes.iter_mut().for_each(Vec::clear);
        self.behind.nodes.clear();
        self.behind.voted.fill(false);
        self.behind.votes.fill(f32::NAN);
        self.behind.only.fill(NONE);
        self.behind.known.clear();
        self.behind.known.resize(self.fragments.all.len() * lights, FragmentLight::Done);
        for Wanted { fragment, light, .. } in self.wanted.iter().chain(&self.parted) {
            self.behind.known[*fragment as usize * lights + *light as usize] = FragmentLight::Seen(Visibility::Partial);
        }
        for number in 0..self.fragments.all.len() {
            let Fragment { pixel, .. } = self.fragments.all[number];
            let Pixel { index, .. } = self.pixels[pixel as usize];
            if self.is_open(number) {
                self.trace_rays(number, counts);
            }
            let fragment = &self.fragments.all[number];
            if fragment.count == scene.antialiasing * scene.antialiasing
                && !fragment.uneven
                && !fragment.rays.is_empty()
            {
                self.behind.only[index as usize] = number as u32;
            }
        }
    }

    /// Whether the visibility of any light from a fragment is unknown.
    fn is_open(&self, fragment: usize) -> bool {
        let lights = self.scene.lights.len();
        let known = &self.behind.known[fragment * lights..][..lights];
        known.iter().any(|sight| matches!(sight, FragmentLight::Seen(Visibility::Partial)))
    }

    /// Looks from all rays of some fragments, from number `from` on, for all lights that nothing is known of yet; the
    /// number of the next.
    fn look(&mut self, from: usize, counts: &mut Counts) -> usize {
        let scene = self.scene;
        let lights = scene.lights.len();
        let mut block = std::mem::take(&mut self.behind.block);
        block.clear();
        let mut next = from;
        while next < self.fragments.all.len()
            && (block.points.is_empty() || block.points.len() + self.fragments.all[next].count() <= TOGETHER)
        {
            // Roundings may let all rays of one miss
            if self.is_open(next) && self.fragments.all[next].count > 0 {
                block.add(scene, &self.fragments, next);
            }
            next += 1;
        }
        let mut sights = std::mem::take(&mut self.behind.sights);
        sights.resize_with(lights, RaySights::default);
        for (light, sights) in sights.iter_mut().enumerate() {
            sights.open.clear();
            let is_open = |of: &FragmentRays| {
                let sight = self.fragment_light(of.fragment as usize, light);
                self.lights.is_classified_by_blocks(light) && matches!(sight, FragmentLight::Seen(Visibility::Partial))
            };
            sights.open.extend(block.fragments.iter().map(is_open));
            if !sights.open.contains(&true) {
                continue;
            }
            self.look_for(&block, light, sights, counts);
            for (of, _) in block.fragments.iter().zip(&sights.open).filter(|(_, is_open)| **is_open) {
                self.behind.known[of.fragment as usize * lights + light] = sights.all(of);
            }
        }
        // With all that is known of other lights
        for (light, sights) in sights.iter_mut().enumerate() {
            let is_wanted = |k: &usize| {
                sights.open[*k]
                    && sights.is_sampled(&block.fragments[*k])
                    && matches!(
                        self.fragment_light(block.fragments[*k].fragment as usize, light),
                        FragmentLight::PerRay
                    )
            };
            let wanted: Vec<usize> = (0..block.fragments.len()).filter(is_wanted).collect();
            let before = counts.work();
            let pool = |k: &usize| self.pool(&block, *k, light, false, sights, counts);
            let mut all: Vec<PooledVisibility> = wanted.iter().map(pool).collect();
            PooledVisibility::resolve(&mut all, &mut self.lights, counts);
            let each = (counts.work() - before) / wanted.len().max(1) as f32;
            for (k, pooled) in wanted.into_iter().zip(all) {
                let of = &block.fragments[k];
                let (fragment, per_kept) = (of.fragment as usize, of.count as f32 / sights.kept(of) as f32);
                let index = self.pixel_of(fragment);
                let before = counts.work();
                let terms = pooled.estimate(&mut self.lights, counts).terms;
                self.sums.work[index] += each + counts.work() - before;
                self.behind.known[fragment * lights + light] = FragmentLight::Summed(terms * per_kept);
            }
            sights.views.iter_mut().filter_map(Option::take).for_each(|view| self.lights.keep(view));
        }
        self.behind.sights = sights;
        self.behind.block = block;
        next
    }

    /// What the rays of a fragment see of a light past what is in trees.
    pub(super) fn fragment_light(&self, fragment: usize, light: usize) -> FragmentLight {
        self.behind.known[fragment * self.scene.lights.len() + light]
    }

    /// How many lights that are integrated a fragment sees in such a way.
    fn count_lights(&self, fragment: usize, is: impl Fn(FragmentLight) -> bool) -> usize {
        let is = |light: &usize| self.lights.is_integrated(*light) && is(self.fragment_light(fragment, *light));
        (0..self.scene.lights.len()).filter(is).count()
    }

    /// The number of lights that were sampled for the rays of a fragment.
    pub(super) fn count_settled(&self, fragment: usize) -> usize {
        self.count_lights(fragment, |sight| matches!(sight, FragmentLight::Summed(_)))
    }

    /// Notes that, if nothing is known of it yet.
    pub(super) fn note(&mut self, fragment: usize, light: usize, sight: FragmentLight) {
        let known = &mut self.behind.known[fragment * self.scene.lights.len() + light];
        if matches!(known, FragmentLight::Seen(Visibility::Partial) | FragmentLight::Seen(Visibility::Listed)) {
            *known = sight;
        }
    }

    /// The pixel of a fragment, as the cell counts them.
    fn pixel_of(&self, fragment: usize) -> usize {
        self.pixels[self.fragments.all[fragment].pixel as usize].index as usize
    }

    /// What lights other than one send to each ray of a fragment, at least, as far as that is known by now.
    pub(super) fn others(&mut self, fragment: usize, light: usize, counts: &mut Counts) -> Rgb {
        let lights = self.scene.lights.len();
        let Fragment { pixel, count, .. } = self.fragments.all[fragment];
        let rays = count as f32;
        let mut others = Rgb::BLACK;
        for other in (0..lights).filter(|other| *other != light) {
            let scale = self.lights.scale(other);
            let share = match self.fragment_light(fragment, other) {
                FragmentLight::Summed(terms) => {
                    others += scale * terms.sum() * (1.0 / rays);
                    continue;
                }
                FragmentLight::Done => {
                    others += scale * self.terms[pixel as usize * lights + other].sum() * (1.0 / rays);
                    continue;
                }
                FragmentLight::Seen(Visibility::Full) => 1.0,
                FragmentLight::Seen(Visibility::Partial) => self.share_seen(fragment, other),
                FragmentLight::Seen(_) | FragmentLight::PerRay => 0.0,
            };
            if share > 0.0 {
                others += self.unshadowed(fragment, other, counts) * share;
            }
        }
        others
    }

    /// What a light would send to a fragment if nothing were in the way, with all colours; black where that is not
    /// known. The integrals of all fragments of the cell are evaluated in one call.
    fn unshadowed(&mut self, fragment: usize, light: usize, counts: &mut Counts) -> Rgb {
        let (scene, lights) = (self.scene, &mut self.lights);
        if !(lights.is_integrated(light) && lights.has_closed_form(light)) {
            return Rgb::BLACK;
        }
        let (fragments, wholes) = (&self.fragments, &mut self.behind.wholes[light]);
        if wholes.is_empty() {
            let points = fragments.all.iter().map(|fragment| match fragment.rays.is_empty() {
                true => fragments.places[fragments.quadrants(fragment)[0].place as usize],
                false => fragments.place(scene, fragment, 0),
            });
            let alone = |point| ShadingPoint { reach: 0.0, turn: 0.0, share: 1.0, ..point };
            let points: Vec<ShadingPoint> = points.map(alone).collect();
            let estimates = lights.estimate_each(light, &points, |_| Visibility::Full, counts);
            wholes.extend(estimates.iter().map(|estimate| estimate.moments));
        }
        lights.scale(light) * fragments.all[fragment].bsdf.colors.of(&wholes[fragment])
    }

    /// What all rays of a fragment see of a light, ray by ray.
    pub(super) fn settled(&mut self, fragment: usize, light: usize, counts: &mut Counts) -> PooledLight {
        let mut block = std::mem::take(&mut self.behind.block);
        block.clear();
        block.add(self.scene, &self.fragments, fragment);
        let mut sights = self.behind.sights.pop().unwrap_or_default();
        sights.open.clear();
        sights.open.push(true);
        self.look_for(&block, light, &mut sights, counts);
        let before = counts.work();
        let pooled = self.pool(&block, 0, light, true, &mut sights, counts);
        let mut pooled = pooled.estimate(&mut self.lights, counts);
        let per_kept = block.fragments[0].count as f32 / sights.kept(&block.fragments[0]) as f32;
        (pooled.terms, pooled.moments) = (pooled.terms * per_kept, pooled.moments * per_kept);
        let index = self.pixel_of(fragment);
        self.sums.work[index] += counts.work() - before;
        sights.views.iter_mut().filter_map(Option::take).for_each(|view| self.lights.keep(view));
        self.behind.sights.push(sights);
        self.behind.block = block;
        pooled
    }

    /// A light at all rays of a fragment of the block, whose pixel may be interpolated for others.
    fn pool(
        &mut self,
        block: &RayBlock,
        k: usize,
        light: usize,
        is_node: bool,
        sights: &mut RaySights,
        counts: &mut Counts,
    ) -> PooledVisibility {
        let of = block.fragments[k];
        let others = self.others(of.fragment as usize, light, counts);
        let Fragment { surface, share, .. } = self.fragments.all[of.fragment as usize];
        let salt = salt(self.at(self.pixel_of(of.fragment as usize)), surface);
        // The most lights that may be sampled for the fragment, by what is known so far
        let asked = self.count_lights(of.fragment as usize, |sight| {
            !matches!(sight, FragmentLight::Done | FragmentLight::Seen(Visibility::Full | Visibility::None))
        });
        let share = if is_node { share * TOLERANCE.node_pixels } else { share };
        let mut pooled =
            PooledVisibility::new(light, self.lights.scale(light), sights.kept(&of), share, salt, others, asked);
        for (place, k) in block.places[of.rays()].iter().zip(of.rays()) {
            sights.settle(k, place, &mut self.lights, light, &mut pooled, counts);
        }
        pooled
    }

    /// Finds out what each ray of the block sees of a light.
    fn look_for(&mut self, block: &RayBlock, light: usize, sights: &mut RaySights, counts: &mut Counts) {
        let scene = self.scene;
        let shadows = scene.lights[light].shadows;
        let RaySights { open, order, sights, views } = sights;
        order.clear();
        sights.clear();
        views.clear();
        views.resize_with(block.points.len(), || None);
        for (of, is_open) in block.fragments.iter().zip(open) {
            let ShadingPoint { surface, receives_shadow, .. } = block.places[of.first as usize];
            let shines = scene.geometry.links.contains(scene.geometry.lights_of(surface), LightId(light as u32));
            // Where a pixel is one surface, and shadows are as wide as the light
            let n = scene.antialiasing;
            let may_skip = of.count == n * n && self.lights.is_integrated(light);
            for k in of.first..of.first + of.count {
                if may_skip && !is_kept(k - of.first, n, scene.tolerance() as f32) {
                    sights.push(None);
                    continue;
                }
                sights.push(Some(if shines { Visibility::Full } else { Visibility::BelowHorizon }));
                if *is_open && shines && shadows && receives_shadow {
                    order.push(k);
                }
            }
        }
        self.lights.classify(light, &block.points, order, counts, |k, visibility, view| {
            sights[k] = Some(visibility);
            views[k] = view;
        });
    }
}

impl FragmentRays {
    /// Its rays, as the block counts them.
    fn rays(&self) -> Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

impl RayBlock {
    fn clear(&mut self) {
        self.places.clear();
        self.points.clear();
        self.fragments.clear();
    }

    /// Adds a fragment of the cell.
    fn add(&mut self, scene: &Scene, fragments: &Fragments, number: usize) {
        let fragment = &fragments.all[number];
        let (first, count) = (self.points.len() as u32, fragment.count);
        self.fragments.push(FragmentRays { fragment: number as u32, first, count });
        self.places.extend((0..fragment.rays.len()).map(|k| fragments.place(scene, fragment, k)));
        self.points.extend(self.places[first as usize..].iter().map(Viewpoint::of));
    }
}

impl RaySights {
    /// What the rays of a fragment see together.
    fn all(&self, fragment: &FragmentRays) -> FragmentLight {
        let of = |visibility| self.sights[fragment.rays()].iter().filter(|seen| **seen == Some(visibility)).count();
        let hidden = of(Visibility::None);
        if hidden + of(Visibility::BelowHorizon) == self.kept(fragment) {
            FragmentLight::Seen(Visibility::None)
        } else if hidden > 0 || of(Visibility::Partial) > 0 {
            FragmentLight::PerRay
        } else if of(Visibility::Listed) > 0 {
            FragmentLight::Seen(Visibility::Listed)
        } else {
            FragmentLight::Seen(Visibility::Full)
        }
    }

    /// How many rays of a fragment stand for all.
    fn kept(&self, fragment: &FragmentRays) -> usize {
        self.sights[fragment.rays()].iter().flatten().count()
    }

    /// Whether some ray of a fragment has to sample the light.
    fn is_sampled(&self, fragment: &FragmentRays) -> bool {
        self.views[fragment.rays()].iter().any(Option::is_some)
    }

    /// Adds what ray `k` of the block sees of a light to that of the others of its fragment.
    fn settle(
        &mut self,
        k: usize,
        point: &ShadingPoint,
        lights: &mut DirectLighting,
        light: usize,
        pooled: &mut PooledVisibility,
        counts: &mut Counts,
    ) {
        match self.sights[k] {
            None => {}
            Some(Visibility::None) => pooled.add_known(point, &Moments::default(), Some(0.0)),
            Some(Visibility::BelowHorizon) => pooled.add_known(point, &Moments::default(), None),
            Some(Visibility::Partial) if lights.is_integrated(light) => {
                let view = self.views[k].take().expect("what is sampled has a view");
                pooled.add_behind(point, view);
            }
            Some(visibility) => pooled.add(lights, point, visibility, counts),
        }
    }
}
