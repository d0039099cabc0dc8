//! How much of one light arrives at one place of a surface, and how much that bends over the patch around it.

mod place;

use arrayvec::ArrayVec;
use fearless_simd::Level;

use super::Counts;
use super::change::{Arrival, Change, change, horizon_change, unseen};
use super::lights::Lights;
use super::pooled::{LightSampler, PooledVisibility};
use crate::accel::Aabb;
use crate::color::{DisplaySteps, Rgb};
use crate::ids::LightId;
use crate::integrate::{
    Arrived, Asked, Emitter, Evaluator, FlatView, Illumination, Obstacles, Receiver, ShadingPoint, TOLERANCE,
};
use crate::light::{Area, Extent, LightTree};
use crate::material::{Bsdf, Lobe, Moments};
use crate::math::{DVec3, Facet, LANES};
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;
use crate::visibility::{OccluderList, Settler, ShadowMesh, ShadowView, Shaft, Target, Viewpoint, Visibility};

pub(crate) use place::ArrivalPlace;

/// What of the trees may be in the way.
pub(super) enum Trees {
    /// Nothing that batches do not know anyway.
    Nothing,
    /// So little that a batch is asked past it.
    Known,
    /// More, or something that has no closed form.
    Unknown,
}

/// What of the trees is in the way from one point.
pub(super) enum Past {
    /// Nothing that batches do not know anyway.
    Nothing,
    /// So little that a batch is asked past it.
    Known,
    /// This has to be asked.
    Unknown(ShadowView),
}

/// What one place sees of an area light that is integrated.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Sighting {
    /// This arrives.
    Known(Moments),
    /// Things are in the way; points of the light have to be asked.
    Behind,
}

/// The lights, as one thread asks for them.
pub(crate) struct Arrivals<'a> {
    pub(super) scene: &'a Scene,
    pub(super) lights: &'a Lights<'a>,
    pub(super) level: Level,
    pub(super) evaluator: Evaluator,
    arrived: Vec<Arrived>,
    points: Vec<ShadingPoint>,
    seen: Vec<(Change, Sighting)>,
    found: Vec<Arrival>,
    /// What of trees is in the way of one place.
    pub(super) near: Obstacles<'a>,
    /// Of lights that are sampled.
    pub(super) settler: Settler,
    pub(super) occluders: OccluderList,
    /// Views that are not used any more.
    views: Vec<ShadowView>,
    indices: Vec<u32>,
    /// In display steps: how far one light may be wrong at a place.
    allowed: f32,
}

/// The most triangles in the way of a ray that batches are asked past.
const FEW_TRIANGLES: usize = 6;
/// Leaves of triangles that are worth looking at one by one.
const LEAVES: usize = 12;

impl<'a> Arrivals<'a> {
    pub fn new(scene: &'a Scene, lights: &'a Lights<'a>, level: Level) -> Self {
        Arrivals {
            scene,
            lights,
            level,
            evaluator: Evaluator::default(),
            arrived: Vec::new(),
            points: Vec::new(),
            seen: Vec::new(),
            found: Vec::new(),
            near: Obstacles::default(),
            settler: Settler::default(),
            occluders: OccluderList::default(),
            views: Vec::new(),
            indices: Vec::new(),
            allowed: lights.allowed,
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

    /// How errors show.
    pub fn display_steps(&self) -> &'a DisplaySteps {
        &self.lights.steps
    }

    /// From now on each light may be wrong by so many display steps.
    pub fn tolerate(&mut self, allowed: f32) {
        self.allowed = allowed;
    }

    /// How many display steps a value can be off by an error.
    pub fn steps(&self, value: Rgb, error: Rgb) -> f32 {
        self.lights.steps.of_color(value, error)
    }

    /// What the sums of light `index` are multiplied with, before the colours of the surface.
    pub fn scale(&self, index: usize) -> Rgb {
        self.lights.scales[index]
    }

    /// The same of all lights.
    pub fn scales(&self) -> &'a [Rgb] {
        &self.lights.scales
    }

    /// What of light `index` arrives.
    pub fn arrival(&mut self, index: usize, place: &ArrivalPlace, counts: &mut Counts) -> Arrival {
        let mut found = std::mem::take(&mut self.found);
        self.arrivals(index, std::slice::from_ref(place), &mut found, counts);
        let arrival = found[0];
        self.found = found;
        arrival
    }

    /// What of light `index` arrives at each place, in place of what was in `found`.
    pub fn arrivals(&mut self, index: usize, places: &[ArrivalPlace], found: &mut Vec<Arrival>, counts: &mut Counts) {
        found.clear();
        if !self.is_integrated(index) {
            self.of_other(index, places, true, found, counts);
            return;
        }
        let mut seen = std::mem::take(&mut self.seen);
        self.look(index, places, &mut seen, counts);
        found.extend(places.iter().zip(&seen).map(|(place, seen)| self.arrival_of(index, place, *seen, counts)));
        self.seen = seen;
    }

    /// What arrives of a light that is integrated where so much is known.
    pub fn arrival_of(
        &mut self,
        index: usize,
        place: &ArrivalPlace,
        (change, seen): (Change, Sighting),
        counts: &mut Counts,
    ) -> Arrival {
        match seen {
            Sighting::Known(sums) => change.with(sums),
            Sighting::Behind => change.with(self.one(index, place, counts)),
        }
    }

    /// Whether a light shines on the surface of a place.
    pub(super) fn is_linked(&self, index: usize, place: &ArrivalPlace) -> bool {
        let geometry = &self.scene.geometry;
        geometry.links.contains(geometry.lights_of(place.si.surface), LightId(index as u32))
    }

    /// A point that asks for light `index`, beside nothing but ambient light.
    pub fn place<'p>(&self, index: usize, si: &'p SurfaceInteraction, bsdf: &'p Bsdf) -> ArrivalPlace<'p> {
        let base = self.scene.ambient * bsdf.ambient;
        ArrivalPlace::point(si, &bsdf.lobe, base, self.scale(index), bsdf.colors)
    }

    fn view(&self, emitter: &Emitter, place: &ArrivalPlace) -> Option<FlatView> {
        let si = place.si;
        let flat = emitter.flat(si.lit_from)?;
        Some(FlatView::new(
            &flat,
            &Receiver { p: si.lit_from, error: si.error, horizon: si.horizon, ns: si.ns, wo: si.wo, lobe: *place.lobe },
        ))
    }

    /// Whether what light `index` sends to a place varies over no less than `apart`, on the light.
    pub fn varies_over(&self, index: usize, place: &ArrivalPlace, apart: f32) -> bool {
        let Some(emitter) = &self.lights.emitters[index] else { return false };
        let nearest = emitter.depth(place.si.lit_from);
        nearest.or_else(|| self.view(emitter, place).map(|view| view.nearest())).is_some_and(|nearest| nearest >= apart)
    }

    /// What places see of area light `index`, which is integrated, without asking points of it; in place of what was in
    /// `found`.
    pub fn look(
        &mut self,
        index: usize,
        places: &[ArrivalPlace],
        found: &mut Vec<(Change, Sighting)>,
        counts: &mut Counts,
    ) {
        let (scene, lights) = (self.scene, self.lights);
        let Some(emitter) = &lights.emitters[index] else { unreachable!("lights that are sampled have no cells") };
        found.clear();
        found.resize(places.len(), (Change::NONE, Sighting::Known(Moments::default())));
        // Those that are asked: past what nothing in trees is added to, and without shadows
        let mut asked: [Vec<u32>; 2] = Default::default();
        let has_trees = lights.has_trees(scene, index);
        let mut next = 0;
        while next < places.len() {
            let (from, place) = (next, &places[next]);
            next += 1;
            if !self.is_linked(index, place) {
                continue;
            }
            let shadows = |place: &ArrivalPlace| scene.lights[index].shadows && place.si.receives_shadow && !place.lit;
            if !shadows(place) || place.clear || !has_trees {
                asked[usize::from(!shadows(place))].push(from as u32);
                continue;
            }
            // What is in trees is gathered for rays of one surface together
            let is_like = |other: &ArrivalPlace| {
                other.reach + place.reach == 0.0
                    && shadows(other)
                    && !other.clear
                    && (other.si.surface, other.lobe) == (place.si.surface, place.lobe)
            };
            let rest = &places[from..places.len().min(from + LANES)];
            let mut run = 1 + rest[1..].iter().take_while(|other| is_like(other)).count();
            let mut trees = self.gather_places(index, &places[from..from + run]);
            if run > 1 && matches!(trees, Trees::Unknown) {
                run = 1;
                trees = self.gather_places(index, &places[from..=from]);
            }
            next = from + run;
            match trees {
                Trees::Known => {
                    let mut arrived = std::mem::take(&mut self.arrived);
                    arrived.clear();
                    self.ask(index, emitter, places[from..next].iter(), [true, true], &mut arrived);
                    for (k, arrived) in (from..next).zip(&arrived) {
                        found[k] = self.found(index, &places[k], *arrived, counts);
                    }
                    self.arrived = arrived;
                }
                Trees::Nothing => asked[0].extend(from as u32..next as u32),
                Trees::Unknown => {
                    // Points tell all of a ray; of a patch it is asked how the light bends
                    if place.reach > 0.0 {
                        asked[1].push(from as u32);
                    } else {
                        counts.settled.visibility[Visibility::Mask as usize] += 1;
                    }
                    found[from].1 = Sighting::Behind;
                }
            }
        }
        let mut arrived = std::mem::take(&mut self.arrived);
        for (numbers, shadows) in asked.iter().zip([true, false]) {
            arrived.clear();
            self.ask(index, emitter, numbers.iter().map(|k| &places[*k as usize]), [shadows, false], &mut arrived);
            for (k, arrived) in numbers.iter().zip(&arrived) {
                let (k, mut arrived) = (*k as usize, *arrived);
                if matches!(found[k].1, Sighting::Behind) && arrived.illumination != Illumination::Below {
                    arrived.motion = f32::INFINITY;
                    counts.settled.visibility[Visibility::Mask as usize] += 1;
                    found[k] = (self.change(index, &places[k], &arrived), Sighting::Behind);
                } else {
                    found[k] = self.found(index, &places[k], arrived, counts);
                }
            }
        }
        self.arrived = arrived;
    }

    /// Adds what batches know of some places, with or without what is in lists, and in what was gathered in trees.
    fn ask<'p, 'q: 'p>(
        &mut self,
        index: usize,
        emitter: &Emitter,
        places: impl Iterator<Item = &'p ArrivalPlace<'q>> + Clone,
        [shadows, near]: [bool; 2],
        arrived: &mut Vec<Arrived>,
    ) {
        let near = near.then_some(&self.near);
        // Batches are of one highlight
        let mut places = places.peekable();
        while let Some(lobe) = places.peek().map(|place| place.lobe) {
            let asked = Asked { near, allowed: self.allowed, ..self.lights.asked_of(index, emitter, lobe, shadows) };
            self.points.clear();
            while let Some(place) = places.next_if(|place| place.lobe == lobe) {
                self.points.push(place.point_of_surface());
            }
            self.evaluator.evaluate(self.level, &asked, &self.points, arrived);
        }
    }

    /// What a batch says of a place.
    pub fn found(
        &mut self,
        index: usize,
        place: &ArrivalPlace,
        mut arrived: Arrived,
        counts: &mut Counts,
    ) -> (Change, Sighting) {
        counts.note(arrived.illumination);
        if arrived.illumination == Illumination::Unknown {
            counts.settled.visibility[Visibility::Mask as usize] += 1;
            arrived.motion = f32::INFINITY;
            return (self.change(index, place, &arrived), Sighting::Behind);
        }
        (self.change(index, place, &arrived), Sighting::Known(arrived.sums))
    }

    /// How a light that is integrated changes over a patch.
    fn change(&self, index: usize, place: &ArrivalPlace, arrived: &Arrived) -> Change {
        let Some(emitter) = self.lights.emitters[index].as_ref().filter(|_| place.reach > 0.0) else {
            return Change::NONE;
        };
        self.change_of(emitter, place, arrived)
    }

    pub(super) fn change_of(&self, emitter: &Emitter, place: &ArrivalPlace, arrived: &Arrived) -> Change {
        match self.view(emitter, place) {
            None => unseen(emitter, place),
            Some(view) if !view.arrives() => horizon_change(&view, place),
            Some(view) => change(&view, place, arrived, self.scene.camera.sway(place.si.lit_from, place.reach)),
        }
    }

    /// What of a light that is integrated would arrive at each place if nothing were in the way.
    pub fn wholes(&mut self, index: usize, places: &[ArrivalPlace]) -> Vec<Moments> {
        let lights = self.lights;
        let Some(emitter) = &lights.emitters[index] else { unreachable!("lights that are sampled have no whole") };
        let mut arrived = Vec::with_capacity(places.len());
        self.ask(index, emitter, places.iter(), [false; 2], &mut arrived);
        arrived.into_iter().map(|arrived| arrived.sums).collect()
    }

    /// Adds to `arrived` what arrives at many points of light `index`, which is integrated: with or without shadows,
    /// and with what was gathered in trees.
    pub fn evaluate(
        &mut self,
        index: usize,
        lobe: &Lobe,
        [shadows, near]: [bool; 2],
        points: &[ShadingPoint],
        arrived: &mut Vec<Arrived>,
    ) {
        let Some(asked) = self.lights.asked(index, lobe, shadows) else {
            unreachable!("lights that are sampled have no cells")
        };
        let asked = Asked { near: near.then_some(&self.near), allowed: self.allowed, ..asked };
        self.evaluator.evaluate(self.level, &asked, points, arrived);
    }

    /// In display steps: how far one light may be wrong at a place that stands for such a share of a pixel, where the
    /// errors of neighbours are as good as independent.
    pub fn tolerance_by_chance(&self, share: f32) -> f32 {
        self.allowed * TOLERANCE.by_chance / share.max(TOLERANCE.least_share).sqrt()
    }

    /// Whether it is worth to look for light `index` from all rays of a block of pixels together: not where its samples
    /// are fixed.
    pub fn looks_for(&self, index: usize) -> bool {
        match self.scene.lights[index].extent() {
            Extent::Area(_) => self.is_integrated(index),
            Extent::Point => true,
        }
    }

    /// Whether a light is integrated.
    pub fn is_integrated(&self, index: usize) -> bool {
        self.lights.emitters[index].is_some()
    }

    /// Whether a light is integrated and can be hidden: then points of it are asked behind what is in trees.
    pub fn is_behind(&self, index: usize) -> bool {
        self.is_integrated(index) && self.scene.lights[index].shadows
    }

    /// Whether anything in trees may be in the way of light `index` from some points, and else whether nothing at all
    /// is.
    pub fn gather_for(&mut self, index: usize, points: &[Viewpoint], counts: &mut Counts) -> (bool, bool) {
        self.indices.clear();
        self.indices.extend(0..points.len() as u32);
        let occluders = &mut self.occluders;
        occluders.gather(self.level, self.scene, &self.lights.targets[index], points, &self.indices, 0);
        counts.settled.shafts += 1;
        let is_known = self.lights.know(index, occluders.others.iter().copied()) && !occluders.has_meshes();
        (occluders.has_trees() && !is_known, occluders.count() == 0)
    }

    /// Hears what of light `index` is seen from those `points` whose numbers are in `order`. `each` may ask what of
    /// trees is in the way.
    pub fn sights(
        &mut self,
        index: usize,
        points: &[Viewpoint],
        order: &mut [u32],
        counts: &mut Counts,
        mut each: impl FnMut(usize, Visibility, &mut dyn FnMut() -> Past),
    ) {
        let (lights, views) = (self.lights, &mut self.views);
        let (target, listed) = (&lights.targets[index], self.scene.geometry.listed);
        let settled = &mut counts.settled;
        self.settler.settle(self.level, self.scene, target, points, order, settled, |k, visibility, view| {
            each(k, visibility, &mut || {
                let is_listed = listed || view.spheres.is_empty() && view.flats.is_empty();
                if view.trees
                    || !lights.know(index, view.others.iter().map(|(thing, _)| *thing))
                    || view.triangles.len() > FEW_TRIANGLES
                {
                    Past::Unknown(std::mem::replace(view, views.pop().unwrap_or_default()))
                } else if is_listed && view.triangles.is_empty() {
                    Past::Nothing
                } else {
                    Past::Known
                }
            });
        });
    }

    /// What arrives at one point, past what is in the way.
    fn one(&mut self, index: usize, place: &ArrivalPlace, counts: &mut Counts) -> Moments {
        let mut pooled = PooledVisibility::new(index, 1, place.share, 0, Rgb::BLACK, usize::MAX);
        pooled.add_sampled(place, self, counts);
        pooled.estimate(self, counts).moments
    }

    /// Area light `index`, as it is sampled.
    pub fn sampler(&self, index: usize) -> LightSampler<'a> {
        let (scene, level) = (self.scene, self.level);
        let area = scene.lights[index].area().expect("lights that are integrated have an area");
        let (target, sets) = (&self.lights.targets[index], &self.lights.point_sets[index]);
        LightSampler { scene, level, area, target, sets }
    }

    /// What all points of area light `index` together stand for.
    pub fn measure(&self, index: usize) -> f32 {
        self.scene.lights[index].area().map_or(1.0, Area::stands_for)
    }

    /// What may be in the way of light `index` from one point; `None` if nothing of it is seen.
    pub fn settle(&mut self, index: usize, si: &SurfaceInteraction, counts: &mut Counts) -> Option<ShadowView> {
        let mut kept = self.views.pop().unwrap_or_default();
        if !(self.scene.lights[index].shadows && si.receives_shadow) {
            kept.clear();
            return Some(kept);
        }
        let mut found = None;
        let (target, points) = (&self.lights.targets[index], [Viewpoint::of(si)]);
        let settled = &mut counts.settled;
        self.settler.settle(self.level, self.scene, target, &points, &mut [0], settled, |_, visibility, view| {
            found = Some(visibility);
            std::mem::swap(&mut kept, view);
        });
        match found {
            Some(Visibility::Hidden | Visibility::BelowHorizon) | None => {
                self.views.push(kept);
                None
            }
            Some(Visibility::Lit | Visibility::Mask) => Some(kept),
        }
    }

    /// Takes a view back, for its memory.
    pub fn keep(&mut self, view: ShadowView) {
        self.views.push(view);
    }

    /// Gathers what of the trees may be in the way of a light: from one point and what lies within `reach` of it, over
    /// which normals turn by `turn`; or from several points.
    pub(super) fn gather(&mut self, index: usize, points: &[Viewpoint], reach: f32, turn: f32) -> Trees {
        let (scene, lights) = (self.scene, self.lights);
        if !lights.has_trees(scene, index) {
            return Trees::Nothing;
        }
        let (target, trees) = (&lights.targets[index], &mut self.occluders);
        match points {
            [point] => {
                trees.gather_around(self.level, scene, target, point, reach, turn > 0.0, LEAVES);
                trees.others.retain(|thing| !is_beside(scene, target, point, reach, turn, *thing));
                // All of a flat patch has one horizon, and what does not rise over it is in nobody's way
                if reach > 0.0 && turn == 0.0 && point.but != Facet::NONE {
                    trees.leaves.retain(|(source, leaf)| rises(scene, point, *source, *leaf));
                }
            }
            points => {
                self.indices.clear();
                self.indices.extend(0..points.len() as u32);
                let shaft = Shaft::of(points, &self.indices, &target.hull);
                trees.gather_in(self.level, scene, target, &shaft, points, &self.indices, LEAVES);
            }
        }
        if !trees.has_meshes() && lights.know(index, trees.others.iter().copied()) {
            Trees::Nothing
        } else if trees.too_many || !lights.know(index, trees.others.iter().copied()) {
            Trees::Unknown
        } else if let Some(emitter) = &lights.emitters[index]
            && self.near.gather(scene, target.light, emitter, trees, lights.obstacles[index].occluders.len())
        {
            Trees::Known
        } else {
            Trees::Unknown
        }
    }

    /// The same of places: one, or several points.
    pub(super) fn gather_places(&mut self, index: usize, places: &[ArrivalPlace]) -> Trees {
        let points: ArrayVec<Viewpoint, LANES> = places.iter().map(|place| Viewpoint::of(place.si)).collect();
        self.gather(index, &points, places[0].reach, places[0].turn)
    }
}

/// Whether something placed is a plane that has a light and all within `reach` of a place on one side, or that the
/// place lies on, if its normal does not turn.
fn is_beside(scene: &Scene, target: &Target, place: &Viewpoint, reach: f32, turn: f32, thing: u32) -> bool {
    if !scene.geometry.is_plane(thing) {
        return false;
    }
    let (thing, plane) = scene.geometry.plane(thing);
    let (p, n) = plane.place();
    let (p, n) = (thing.placement.world_from_object.transform_point3(p), thing.placement.normal(n).normalize_or_zero());
    let height = n.dot(place.p.as_dvec3() - p);
    let (room, n) = (n.abs().dot(place.error.0.as_dvec3()), n * height.signum());
    if height.abs() <= room {
        return turn == 0.0 && n.cross(place.horizon.as_dvec3()).length() < 1e-6;
    }
    let beside = if target.hull.finite {
        let Aabb { min, max } = target.hull.bounds();
        n.max(DVec3::ZERO).dot(min.as_dvec3() - p) + n.min(DVec3::ZERO).dot(max.as_dvec3() - p)
    } else {
        n.dot(target.hull.center.as_dvec3())
    };
    height.abs() > f64::from(reach) + room && beside >= 0.0
}

/// Whether anything in a leaf of a mesh rises over the horizon of a flat place.
fn rises(scene: &Scene, place: &Viewpoint, source: u32, leaf: u32) -> bool {
    let Some(mesh) = ShadowMesh::of(&scene.geometry, source, LightId(0)) else { return true };
    mesh.mesh.tree.leaf(leaf).any(|(_, corners)| {
        corners.iter().any(|q| {
            let q = mesh.placement.map_or(q.as_dvec3(), |at| at.world_from_object.transform_point3(q.as_dvec3()));
            let way = q - place.p.as_dvec3();
            let room = way.abs().max_element() * 1e-6 + f64::from(place.error.0.max_element());
            place.horizon.as_dvec3().dot(way) > room
        })
    })
}
