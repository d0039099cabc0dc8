//! How much of one light arrives at one place of a surface, and how much that bends over the patch around it.

use std::cell::Cell;
use std::f32::consts::FRAC_PI_2;

use fearless_simd::Level;

use super::Counts;
use super::change::{Arrival, Change, change, horizon_change, unseen};
use super::ladder::{Asker as LadderAsker, Ladder};
use super::many::FEW;
use super::patch::Patch;
use super::sampled::Sampled;
use super::together::Together;
use crate::color::{DisplaySteps, Rgb};
use crate::ids::LightId;
use crate::integrate::{
    Arrived, Asked, Asker, Between, Emitter, Evaluator, Illumination, Masked, Obstacles, Outline, Receiver,
    ShadingPoint, Sums, Tolerance, View, integrate, unshadowed,
};
use crate::light::{Area, AreaShape, Light, LightKind, LightTree};
use crate::material::{Bsdf, Lobe};
use crate::math::dispatch_wide;
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;
use crate::visibility::{Occluders, Settler, Target, View as ShadowView, Viewpoint, Visibility};

/// A place of a surface that asks for one light, by itself.
#[derive(Clone, Copy)]
pub(crate) struct ArrivalPlace<'a> {
    pub si: &'a SurfaceInteraction,
    pub lobe: &'a Lobe,
    /// How far the patch reaches from its middle, in metres; 0 for a point.
    pub reach: f32,
    /// How far the normal turns on the way, in radians.
    pub turn: f32,
    /// How far off the patch's middle the place is, as a part of `reach`.
    pub off: f32,
    /// The share of the pixel that it stands for: errors of its parts are as good as independent.
    pub share: f32,
    /// Whether it is known that nothing is in the way of the light, or nothing in trees.
    pub lit: bool,
    pub clear: bool,
    /// Whether it stands for a patch, of which points of the light are asked at each ray, if at all.
    pub parted: bool,
    /// What is there beside this light, at least.
    pub base: Rgb,
    /// What the two sums are multiplied with.
    pub colors: [Rgb; 2],
}

impl<'a> ArrivalPlace<'a> {
    /// One point, by itself; `base` and `colors` as in the struct.
    pub fn point(si: &'a SurfaceInteraction, lobe: &'a Lobe, base: Rgb, colors: [Rgb; 2]) -> Self {
        ArrivalPlace {
            si,
            lobe,
            reach: 0.0,
            turn: 0.0,
            off: 0.0,
            share: 1.0,
            lit: false,
            clear: false,
            parted: false,
            base,
            colors,
        }
    }

    /// The same for all of a patch that is shaded there.
    pub fn over(self, patch: &Patch) -> Self {
        ArrivalPlace { reach: patch.reach, turn: patch.turn, off: patch.off, ..self }
    }
}

/// What one place sees of an area light that is integrated.
pub(crate) enum Seen {
    /// This arrives.
    Known(Sums),
    /// Things are in the way; points of the light have to be asked. This would arrive if nothing were, if that is
    /// known.
    Behind(Option<Sums>),
}

/// What all tiles share: the lights as they are integrated, and how errors show.
pub(crate) struct Lights<'a> {
    /// For each light, if it is integrated.
    pub emitters: Vec<Option<Emitter>>,
    pub steps: DisplaySteps,
    /// In display steps: how far one light may be wrong at a place.
    tolerance: f32,
    /// Where there are many.
    tree: Option<LightTree>,
    /// The lights as shafts lead to them.
    targets: Vec<Target>,
    /// The points of those that are integrated.
    ladders: Vec<Ladder>,
    /// What may stand in the way of those in closed form, where that is not too much.
    obstacles: Vec<Option<Obstacles<'a>>>,
    /// In display steps: how far one light may be wrong at a point that stands for a pixel; and the value that many
    /// steps above black.
    allowed: f32,
    least: f32,
}

/// Parts of a pixel smaller than this are judged as if they were as large.
const LEAST_SHARE: f32 = 1.0 / 8.0;
/// In display steps: how far all lights together may be wrong.
const TOLERANCE: f32 = 0.1;
/// The same where each place is wrong by itself, as by chance: nothing of that shows as a step or an edge.
const BY_CHANCE: f32 = 0.2;
const LEAST_SHARE_BY_CHANCE: f32 = 1.0 / 16.0;

impl<'a> Lights<'a> {
    pub fn new(scene: &'a Scene) -> Lights<'a> {
        let emitter = |light: &Light| match &light.kind {
            LightKind::Area(area) if light.exact => Some(Emitter::new(area)),
            _ => None,
        };
        let emitters: Vec<_> = scene.lights.iter().map(emitter).collect();
        let tolerance = TOLERANCE / (emitters.len().max(1) as f32).sqrt();
        let targets = Target::of_all(scene);
        let ladders = emitters.iter().map(|_| Ladder::default()).collect();
        let tree = (scene.lights.len() > FEW).then(|| LightTree::new(&scene.lights));
        let obstacles = (0..scene.lights.len())
            .map(|index| emitters[index].as_ref().and_then(|emitter| Obstacles::new(scene, index, emitter)))
            .collect();
        let steps = DisplaySteps::new(&scene.display);
        let allowed = Tolerance::DEFAULT.point / (scene.lights.len().max(1) as f32).sqrt();
        let least = steps.value_of(allowed);
        Lights { emitters, steps, tolerance, tree, targets, ladders, obstacles, allowed, least }
    }

    /// Whether all of these placed things are told row by row where they are in the way of light `index`.
    fn know(&self, index: usize, placed: &[u32]) -> bool {
        let knows = |obstacles: &Obstacles| placed.iter().all(|thing| obstacles.has_placed(*thing));
        placed.is_empty() || self.obstacles[index].as_ref().is_some_and(knows)
    }

    /// Light `index` as batches ask for it, with one highlight, with or without what stands in its way; `None` if that
    /// is not known in closed form.
    pub fn asked<'b>(&'b self, index: usize, lobe: &'b Lobe, shadows: bool) -> Option<Asked<'b>> {
        Some(Asked {
            emitter: self.emitters[index].as_ref()?,
            obstacles: self.obstacles[index].as_ref()?,
            lobe,
            steps: &self.steps,
            tolerance: &Tolerance::DEFAULT,
            allowed: self.allowed,
            least: self.least,
            shadows,
        })
    }
}

/// The lights, as one thread asks for them.
pub(crate) struct Arrivals<'a> {
    pub(super) scene: &'a Scene,
    pub(super) lights: &'a Lights<'a>,
    level: Level,
    evaluator: Evaluator,
    arrived: Vec<Arrived>,
    /// Of lights that are sampled.
    settler: Settler,
    pub(super) occluders: Occluders,
    /// Views that are not used any more.
    views: Vec<ShadowView>,
    indices: Vec<u32>,
    tolerance: f32,
}

/// Patches whose normal turns by less than this, in radians, are flat.
const FLAT: f32 = 1e-4;
/// Highlights narrower than this part of a sphere light, both as angles, are not found by points all over it.
const NARROW: f32 = 1.0 / 6.0;
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
            settler: Settler::default(),
            occluders: Occluders::default(),
            views: Vec::new(),
            indices: Vec::new(),
            tolerance: lights.tolerance,
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
    pub fn tolerate(&mut self, tolerance: f32) {
        self.tolerance = tolerance;
    }

    /// How many display steps a value can be off by an error.
    pub fn steps(&self, value: Rgb, error: Rgb) -> f32 {
        self.lights.steps.of_color(value, error)
    }

    /// What the sums of light `index` are multiplied with, before the colours of the surface.
    pub fn scale(&self, index: usize) -> Rgb {
        let light = &self.scene.lights[index];
        if self.lights.emitters[index].is_some() { light.intensity } else { light.scale }
    }

    /// What of light `index` arrives.
    pub fn arrival(&mut self, index: usize, place: &ArrivalPlace, counts: &mut Counts) -> Arrival {
        let light = &self.scene.lights[index];
        let links = self.scene.geometry.lights_of(place.si.surface);
        if !self.scene.geometry.links.contains(links, LightId(index as u32)) {
            return Arrival::even(Sums::default());
        }
        match (&self.lights.emitters[index], &light.kind) {
            (Some(emitter), _) => {
                let (change, seen) = self.look(index, emitter, place, counts);
                match seen {
                    Seen::Known(sums) => change.with(sums),
                    Seen::Behind(_) if place.parted => Arrival { skipped: true, ..change.with(Sums::default()) },
                    Seen::Behind(whole) => change.with(self.one(index, place, whole, counts)),
                }
            }
            (None, LightKind::Area(area)) => {
                let light = Sampled::new(self.scene, self.level, index, &self.lights.targets);
                let [diffuse, specular] = light.to_point(&mut self.settler, place.si, place.lobe, counts);
                let sums = Sums { diffuse, specular };
                if place.reach == 0.0 {
                    return Arrival::even(sums);
                }
                // As it would be if it were integrated, in the unit of samples
                let emitter = Emitter::new(area);
                let one = area.samples() as f32 / if area.physical { area.measure() as f32 } else { 1.0 };
                let mut change = self.change_of(index, &emitter, place);
                change.bend = change.bend * one;
                change.with(sums)
            }
            (None, _) => self.single(index, light, place, counts),
        }
    }

    /// A point that asks for light `index`, beside nothing but ambient light.
    pub fn place<'p>(&self, index: usize, si: &'p SurfaceInteraction, bsdf: &'p Bsdf) -> ArrivalPlace<'p> {
        let scale = self.scale(index);
        let colors = [scale * bsdf.diffuse, scale * bsdf.specular];
        ArrivalPlace::point(si, &bsdf.lobe, self.scene.ambient * bsdf.ambient, colors)
    }

    /// What light `index` sends to one point, which stands for `share` of a pixel: diffuse and specular, with all
    /// colours.
    pub fn at_point(
        &mut self,
        index: usize,
        si: &SurfaceInteraction,
        bsdf: &Bsdf,
        share: f32,
        counts: &mut Counts,
    ) -> [Rgb; 2] {
        let place = ArrivalPlace { share, ..self.place(index, si, bsdf) };
        let sums = self.arrival(index, &place, counts).sums;
        [place.colors[0] * sums.diffuse, place.colors[1] * sums.specular]
    }

    fn view(&self, emitter: &Emitter, place: &ArrivalPlace) -> Option<View> {
        let si = place.si;
        let flat = emitter.flat(si.lit_from)?;
        Some(View::new(
            &flat,
            &Receiver { p: si.lit_from, error: si.error, horizon: si.horizon, ns: si.ns, wo: si.wo, lobe: *place.lobe },
        ))
    }

    /// What of light `index` arrives at one point, if that is known without a mask over points of the light.
    pub fn seen(&mut self, index: usize, place: &ArrivalPlace, counts: &mut Counts) -> Seen {
        let links = self.scene.geometry.lights_of(place.si.surface);
        match &self.lights.emitters[index] {
            Some(emitter) if self.scene.geometry.links.contains(links, LightId(index as u32)) => {
                self.look(index, emitter, place, counts).1
            }
            _ => Seen::Known(self.arrival(index, place, counts).sums),
        }
    }

    /// Looks at an area light that is integrated.
    fn look(&mut self, index: usize, emitter: &Emitter, place: &ArrivalPlace, counts: &mut Counts) -> (Change, Seen) {
        let (scene, si) = (self.scene, place.si);
        let light = &scene.lights[index];
        let Some(view) = self.view(emitter, place) else {
            let seen = if emitter.surrounds(si.lit_from) { Seen::Behind(None) } else { Seen::Known(Sums::default()) };
            return (unseen(emitter, place), seen);
        };
        if !view.arrives() {
            counts.settled.visibility[Visibility::BelowHorizon as usize] += 1;
            return (horizon_change(&view, place), Seen::Known(Sums::default()));
        }
        if view.outline == Outline::Sphere || self.lights.obstacles[index].as_ref().is_some_and(Obstacles::has_solids) {
            return self.look_in_lanes(index, &view, place, counts);
        }
        let between = if light.shadows && si.receives_shadow && !place.lit {
            self.between(index, emitter, &view, place)
        } else {
            Between::default()
        };
        let change = change(&view, place, &between, scene.camera.sway(si.lit_from, place.reach));
        if between.hidden {
            counts.settled.visibility[Visibility::Hidden as usize] += 1;
            return (change, Seen::Known(Sums::default()));
        }
        let behind = between.ask || between.ask_trees;
        match (behind, between.hiders.is_empty()) {
            (true, _) => counts.settled.visibility[Visibility::Mask as usize] += 1,
            (false, true) => counts.settled.visibility[Visibility::Lit as usize] += 1,
            (false, false) => counts.closed_form += 1,
        }
        let hiders = if behind { &[][..] } else { &between.hiders[..] };
        let enough = self.enough(place);
        let (whole, _) = dispatch_wide!(self.level, simd => integrate(simd, &view, hiders, &enough));
        (change, if behind { Seen::Behind(Some(whole)) } else { Seen::Known(whole) })
    }

    /// The same of a light that only batches know.
    fn look_in_lanes(
        &mut self,
        index: usize,
        view: &View,
        place: &ArrivalPlace,
        counts: &mut Counts,
    ) -> (Change, Seen) {
        let (scene, si) = (self.scene, place.si);
        let shadows = scene.lights[index].shadows && si.receives_shadow && !place.lit;
        let Some(arrived) = self.in_lanes(index, place, shadows) else { return (Change::UNKNOWN, Seen::Behind(None)) };
        let hidden = arrived.illumination == Illumination::Hidden;
        let trees = shadows && !hidden && !place.clear && self.gather(index, place) && {
            let Occluders { spheres, flats, leaves, others, too_many, .. } = &self.occluders;
            let is_known = spheres.is_empty() && flats.is_empty() && leaves.is_empty() && !too_many;
            !(is_known && self.lights.know(index, others))
        };
        let behind = trees || arrived.illumination == Illumination::Unknown;
        let ask = behind || arrived.illumination == Illumination::Partial;
        let drift = if behind { f32::INFINITY } else { arrived.motion };
        let between = Between { hidden, ask, drift, ..Between::default() };
        let change = change(view, place, &between, scene.camera.sway(si.lit_from, place.reach));
        let visibility = match arrived.illumination {
            _ if behind => Visibility::Mask,
            Illumination::Below => Visibility::BelowHorizon,
            Illumination::Hidden => Visibility::Hidden,
            _ => Visibility::Lit,
        };
        if arrived.illumination == Illumination::Partial && !behind {
            counts.closed_form += 1;
        } else {
            counts.settled.visibility[visibility as usize] += 1;
        }
        (change, if behind { Seen::Behind(self.whole(index, place)) } else { Seen::Known(arrived.sums) })
    }

    /// What a batch of one knows of light `index`, if it is known in closed form at all.
    fn in_lanes(&mut self, index: usize, place: &ArrivalPlace, shadows: bool) -> Option<Arrived> {
        let asked = self.lights.asked(index, place.lobe, shadows)?;
        let point = ShadingPoint {
            p: place.si.lit_from,
            error: place.si.error,
            horizon: place.si.horizon,
            ns: place.si.ns,
            wo: place.si.wo,
            reach: place.reach,
            turn: place.turn,
            worth: place.colors,
            base: place.base,
            share: place.share,
        };
        self.arrived.clear();
        self.evaluator.evaluate(self.level, &asked, &[point], &mut self.arrived);
        self.arrived.first().copied()
    }

    /// Adds to `arrived` what arrives of a light at many points.
    pub fn evaluate(&mut self, asked: &Asked, points: &[ShadingPoint], arrived: &mut Vec<Arrived>) {
        self.evaluator.evaluate(self.level, asked, points, arrived);
    }

    /// What light `index` would send to a place if nothing were in the way, if it is better to know that than to ask
    /// points alone.
    fn whole(&mut self, index: usize, place: &ArrivalPlace) -> Option<Sums> {
        let emitter = self.lights.emitters[index].as_ref()?;
        match self.view(emitter, place) {
            None if emitter.surrounds(place.si.lit_from) => None,
            None => Some(Sums::default()),
            Some(view) if !view.arrives() => Some(Sums::default()),
            Some(_) if matches!(emitter, Emitter::Ball { .. }) && self.lights.obstacles[index].is_some() => {
                let arrived = self.in_lanes(index, place, false)?;
                (arrived.illumination != Illumination::Unknown).then_some(arrived.sums)
            }
            Some(view) => {
                let enough = self.enough(place);
                dispatch_wide!(self.level, simd => unshadowed(simd, &view, &enough))
            }
        }
    }

    /// Whether sums with such an error will do for one light at a place.
    pub fn enough<'b>(&self, place: &'b ArrivalPlace) -> impl Fn(&Sums, &Sums) -> bool + use<'a, 'b> {
        let (steps, tolerance) = (&self.lights.steps, self.tolerance_of(place.share));
        let [diffuse, specular] = place.colors;
        let base = place.base;
        move |sums, error| {
            let value = base + diffuse * sums.diffuse + specular * sums.specular;
            let wrong = diffuse * error.diffuse + specular * error.specular;
            steps.of_color(value, wrong) <= tolerance
        }
    }

    /// In display steps: how far one light may be wrong at a place that stands for such a share of a pixel.
    pub fn tolerance_of(&self, share: f32) -> f32 {
        self.tolerance / share.max(LEAST_SHARE).sqrt()
    }

    /// The same where the errors of neighbours are as good as independent.
    pub fn tolerance_by_chance(&self, share: f32) -> f32 {
        self.tolerance * (BY_CHANCE / TOLERANCE) / share.max(LEAST_SHARE_BY_CHANCE).sqrt()
    }

    /// Whether it is worth to look for light `index` from all rays of a block of pixels together: not where its samples
    /// are fixed.
    pub fn looks_for(&self, index: usize) -> bool {
        let is_area = matches!(self.scene.lights[index].kind, LightKind::Area(_));
        self.lights.emitters[index].is_some() || !is_area
    }

    /// What light `index` would send to a place if nothing were in the way, with all colours; black where that is not
    /// known in closed form.
    pub fn unshadowed(&mut self, index: usize, place: &ArrivalPlace) -> Rgb {
        let sums = self.whole(index, place).unwrap_or_default();
        place.colors[0] * sums.diffuse + place.colors[1] * sums.specular
    }

    /// Whether a light is integrated and can be hidden: then points of it are asked behind what is in trees.
    pub fn is_behind(&self, index: usize) -> bool {
        self.lights.emitters[index].is_some() && self.scene.lights[index].shadows
    }

    /// Whether anything in trees may be in the way of light `index` from some points, and else whether nothing at all
    /// is.
    pub fn gather_for(&mut self, index: usize, points: &[Viewpoint], counts: &mut Counts) -> (bool, bool) {
        self.indices.clear();
        self.indices.extend(0..points.len() as u32);
        let occluders = &mut self.occluders;
        occluders.gather(self.level, self.scene, &self.lights.targets[index], points, &self.indices, 0);
        counts.settled.shafts += 1;
        let is_known = self.lights.know(index, &occluders.others) && !occluders.has_meshes();
        (occluders.has_trees() && !is_known, occluders.count() == 0)
    }

    /// Hears what of light `index` is seen from those `points` whose numbers are in `order`. `each` may take what is in
    /// the way, if something in trees is.
    pub fn sights(
        &mut self,
        index: usize,
        points: &[Viewpoint],
        order: &mut [u32],
        counts: &mut Counts,
        mut each: impl FnMut(usize, Visibility, &mut dyn FnMut() -> Option<ShadowView>),
    ) {
        let (lights, views) = (self.lights, &mut self.views);
        let (target, listed) = (&lights.targets[index], self.scene.geometry.listed);
        let settled = &mut counts.settled;
        self.settler.settle(self.level, self.scene, target, points, order, settled, |k, visibility, view| {
            each(k, visibility, &mut || {
                let is_listed = listed || view.spheres.is_empty() && view.flats.is_empty();
                let is_known = is_listed && !view.has_meshes() && lights.know(index, &view.others);
                (!is_known).then(|| std::mem::replace(view, views.pop().unwrap_or_default()))
            });
        });
    }

    /// Has rays that are asked together ask past what is in `view`.
    pub fn ask_behind(
        &mut self,
        together: &mut Together,
        index: usize,
        place: &ArrivalPlace,
        view: ShadowView,
        counts: &mut Counts,
    ) {
        match &self.lights.emitters[index] {
            Some(_) => {
                let whole = self.whole(index, place);
                together.behind(self, place, whole, view);
            }
            // One ray tells
            None => {
                let sums = self.of_single(index, &ArrivalPlace { lit: false, ..*place });
                counts.points += 1;
                together.know(place, &sums);
                self.keep(view);
            }
        }
    }

    /// What arrives at one point, past what is in the way.
    fn one(&mut self, index: usize, place: &ArrivalPlace, whole: Option<Sums>, counts: &mut Counts) -> Sums {
        let Some(view) = self.settle(index, place.si, counts) else { return Sums::default() };
        let mut together = Together::new(index, 1, place.share, 0, Rgb::BLACK);
        together.behind(self, place, whole, view);
        together.finish(self, counts).sums
    }

    /// Area light `index`, as its points are asked for.
    pub fn asker(&self, index: usize) -> LadderAsker<'a> {
        let (scene, level) = (self.scene, self.level);
        let LightKind::Area(area) = &scene.lights[index].kind else {
            unreachable!("lights of one point are not integrated")
        };
        let (target, ladder) = (&self.lights.targets[index], &self.lights.ladders[index]);
        LadderAsker { scene, level, area, target, ladder }
    }

    /// Whether points spread evenly over a sphere light may miss most of what it sends to a place: what is near sends
    /// far more than the rest where light weakens on its way, and a highlight may lie on it that is narrow beside it.
    pub fn may_miss(&self, index: usize, place: &ArrivalPlace) -> bool {
        let LightKind::Area(Area { shape: AreaShape::Sphere(sphere), physical, .. }) = &self.scene.lights[index].kind
        else {
            return false;
        };
        let SurfaceInteraction { ns, wo, lit_from, .. } = *place.si;
        let cos_o = ns.dot(wo);
        let spread = 1.0 / (2.0 * place.lobe.sharpness(cos_o)).sqrt();
        let to = (sphere.center - lit_from.as_dvec3()).as_vec3();
        let wide = sphere.radius as f32 / to.length();
        if *physical || wide >= 1.0 {
            return *physical || spread < NARROW;
        }
        // The chord of the angle between the mirrored direction and the light's middle is at most that angle; at the
        // end of its reach a highlight has fallen to e^-18
        let apart = (ns * (2.0 * cos_o) - wo - to.normalize()).length();
        spread < NARROW * wide && apart < wide * FRAC_PI_2 + 6.0 * spread
    }

    /// What all points of area light `index` together stand for.
    pub fn measure(&self, index: usize) -> f32 {
        match &self.scene.lights[index].kind {
            LightKind::Area(area) if area.physical => area.measure() as f32,
            _ => 1.0,
        }
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

    /// What arrives at one point, past anything, by cells of the light: where few of its points send nearly all.
    pub fn by_cells(&self, index: usize, place: &ArrivalPlace, counts: &mut Counts) -> Sums {
        let emitter = self.lights.emitters[index].as_ref().expect("only lights that are integrated are asked by cells");
        let light = &self.scene.lights[index];
        let ask = light.shadows && place.si.receives_shadow;
        let between = Between { ask, ask_trees: ask && self.scene.geometry.has_trees(), ..Between::default() };
        let ArrivalPlace { si, lobe, .. } = *place;
        let asked = Cell::new(0);
        let masked = Masked { scene: self.scene, light: index, emitter, si, lobe, between: &between, asked: &asked };
        let enough = self.enough(place);
        let is_round = matches!(emitter, Emitter::Ball { physical, both_sides, .. } if !physical || *both_sides);
        let sums = match self.view(emitter, place) {
            None if !emitter.surrounds(si.lit_from) => Sums::default(),
            Some(view) if !view.arrives() => Sums::default(),
            _ if is_round => masked.by_points(light, &enough),
            None => Sums::default(),
            Some(view) => {
                let (whole, _) = dispatch_wide!(self.level, simd => integrate(simd, &view, &[], &enough));
                masked.by_cells(&view, &whole, &enough)
            }
        };
        counts.points += asked.get();
        sums
    }

    /// What stands between a place and an area light.
    fn between(&mut self, index: usize, emitter: &Emitter, view: &View, place: &ArrivalPlace) -> Between {
        let trees = !place.clear && self.gather(index, place);
        let asker = Asker { si: place.si, reach: place.reach };
        Between::look(self.scene, index, emitter, view, &asker, trees.then_some(&self.occluders))
    }

    /// Gathers what of the trees may be in the way of a light; whether there are any.
    pub(super) fn gather(&mut self, index: usize, place: &ArrivalPlace) -> bool {
        if !self.scene.geometry.has_trees() {
            return false;
        }
        let (target, point) = (&self.lights.targets[index], Viewpoint::of(place.si));
        self.occluders.gather_around(self.level, self.scene, target, &point, place.reach, place.turn > FLAT, LEAVES);
        true
    }

    /// How an area light would change if it were integrated.
    fn change_of(&mut self, index: usize, emitter: &Emitter, place: &ArrivalPlace) -> Change {
        let light = &self.scene.lights[index];
        let Some(view) = self.view(emitter, place) else { return unseen(emitter, place) };
        if !view.arrives() {
            return horizon_change(&view, place);
        }
        let between = if light.shadows && place.si.receives_shadow {
            self.between(index, emitter, &view, place)
        } else {
            Between::default()
        };
        change(&view, place, &between, self.scene.camera.sway(place.si.lit_from, place.reach))
    }
}
