//! How much of one light arrives at one place of a surface, and how much that bends over the patch around it.

use std::cell::Cell;

use fearless_simd::Level;

use super::Counts;
use super::change::{Arrival, Change, change, horizon_change, unseen};
use super::many::FEW;
use super::patch::Patch;
use super::sampled::Sampled;
use crate::color::{DisplaySteps, Rgb};
use crate::ids::LightId;
use crate::integrate::{Asker, Between, Emitter, Masked, Receiver, Sums, View, integrate};
use crate::light::{Light, LightKind, LightTree};
use crate::material::{Bsdf, Lobe};
use crate::math::dispatch_wide;
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;
use crate::visibility::{Occluders, Settler, Target, Viewpoint, Visibility};

/// A place of a surface that asks for light.
#[derive(Clone, Copy)]
pub(crate) struct Place<'a> {
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
    /// Which points of lights it asks; see [`Masked::series`].
    pub series: usize,
    /// Where it stands for a patch: how much may bend over it, in display steps, and whether its neighbours may tell
    /// that less does. If it will not do for the patch, points of the light are not asked.
    pub allowed: f32,
    pub beside: bool,
    /// What is there beside this light, at least.
    pub base: Rgb,
    /// What the two sums are multiplied with.
    pub colors: [Rgb; 2],
}

impl<'a> Place<'a> {
    /// One point, by itself; `base` and `colors` as in the struct.
    pub fn point(si: &'a SurfaceInteraction, lobe: &'a Lobe, base: Rgb, colors: [Rgb; 2]) -> Self {
        Place {
            si,
            lobe,
            reach: 0.0,
            turn: 0.0,
            off: 0.0,
            share: 1.0,
            series: 0,
            allowed: f32::INFINITY,
            beside: false,
            base,
            colors,
        }
    }

    /// The same for all of a patch that is shaded there.
    pub fn over(self, patch: &Patch) -> Self {
        Place { reach: patch.reach, turn: patch.turn, off: patch.off, ..self }
    }
}

/// What one place sees of an area light that is integrated.
pub(crate) enum Seen {
    /// This arrives.
    Known(Sums),
    /// Things are in the way; points of the light have to be asked.
    Behind(Box<Behind>),
}

/// A light behind things.
pub(crate) struct Behind {
    pub view: View,
    between: Between,
    /// What would arrive if nothing were in the way.
    pub whole: Sums,
}

/// What all tiles share: the lights as they are integrated, and how errors show.
pub(crate) struct Lights {
    /// For each light, if it is integrated.
    pub emitters: Vec<Option<Emitter>>,
    pub steps: DisplaySteps,
    /// In display steps: how far one light may be wrong at a place.
    tolerance: f32,
    /// Where there are many.
    tree: Option<LightTree>,
    /// The lights as shafts lead to them; none where all are integrated, and there are no trees to lead through.
    targets: Vec<Target>,
}

/// Parts of a pixel smaller than this are judged as if they were as large.
const LEAST_SHARE: f32 = 1.0 / 8.0;
/// In display steps: how far all lights together may be wrong.
const TOLERANCE: f32 = 0.1;
/// The same where each place is wrong by itself, as by chance: nothing of that shows as a step or an edge.
const BY_CHANCE: f32 = 0.2;

impl Lights {
    pub fn new(scene: &Scene) -> Lights {
        let emitter = |light: &Light| match &light.kind {
            LightKind::Area(area) if light.exact => Some(Emitter::new(area)),
            _ => None,
        };
        let emitters: Vec<_> = scene.lights.iter().map(emitter).collect();
        let tolerance = TOLERANCE / (emitters.len().max(1) as f32).sqrt();
        let is_area = |light: &Light| matches!(light.kind, LightKind::Area(_));
        let sampled = scene.lights.iter().zip(&emitters).any(|(light, emitter)| is_area(light) && emitter.is_none());
        let targets = if sampled || scene.geometry.has_trees() { Target::of_all(scene) } else { Vec::new() };
        let tree = (scene.lights.len() > FEW).then(|| LightTree::new(&scene.lights));
        Lights { emitters, steps: DisplaySteps::new(&scene.display), tolerance, tree, targets }
    }
}

/// The lights, as one thread asks for them.
pub(crate) struct Arrivals<'a> {
    pub(super) scene: &'a Scene,
    lights: &'a Lights,
    level: Level,
    /// Of lights that are sampled.
    settler: Settler,
    pub(super) occluders: Occluders,
    tolerance: f32,
}

/// Patches whose normal turns by less than this, in radians, are flat.
const FLAT: f32 = 1e-4;
/// Leaves of triangles that are worth looking at one by one.
const LEAVES: usize = 12;

impl<'a> Arrivals<'a> {
    pub fn new(scene: &'a Scene, lights: &'a Lights, level: Level) -> Self {
        Arrivals {
            scene,
            lights,
            level,
            settler: Settler::default(),
            occluders: Occluders::default(),
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
    pub fn arrival(&mut self, index: usize, place: &Place, counts: &mut Counts) -> Arrival {
        let light = &self.scene.lights[index];
        let links = self.scene.geometry.lights_of(place.si.surface);
        if !self.scene.geometry.links.contains(links, LightId(index as u32)) {
            return Arrival::even(Sums::default());
        }
        match (&self.lights.emitters[index], &light.kind) {
            (Some(emitter), _) => {
                let (change, seen) = self.look(index, emitter, place, counts);
                change.with(match seen {
                    Seen::Known(sums) => sums,
                    Seen::Behind(behind) => {
                        let Behind { view, whole, .. } = &*behind;
                        let [diffuse, specular] = place.colors;
                        let of = |sums: &Sums| diffuse * sums.diffuse + specular * sums.specular;
                        let told = change.resolved && place.beside;
                        if !told && self.steps(place.base + of(whole), of(&change.bend)) > place.allowed {
                            return Arrival { skipped: true, ..change.with(Sums::default()) };
                        }
                        let masked = self.masked(index, emitter, place, &behind.between);
                        let sums = masked.integrate(view, whole, &self.enough(place)).0;
                        counts.points += masked.asked.get();
                        sums
                    }
                })
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
    pub fn place<'p>(&self, index: usize, si: &'p SurfaceInteraction, bsdf: &'p Bsdf) -> Place<'p> {
        let scale = self.scale(index);
        let colors = [scale * bsdf.diffuse, scale * bsdf.specular];
        Place::point(si, &bsdf.lobe, self.scene.ambient * bsdf.ambient, colors)
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
        let place = Place { share, ..self.place(index, si, bsdf) };
        let sums = self.arrival(index, &place, counts).sums;
        [place.colors[0] * sums.diffuse, place.colors[1] * sums.specular]
    }

    fn view(&self, emitter: &Emitter, place: &Place) -> Option<View> {
        let si = place.si;
        let flat = emitter.flat(si.lit_from)?;
        Some(View::new(
            &flat,
            &Receiver { p: si.lit_from, error: si.error, horizon: si.horizon, ns: si.ns, wo: si.wo, lobe: *place.lobe },
        ))
    }

    /// What of light `index` arrives at one point, if that is known without a mask over points of the light.
    pub fn seen(&mut self, index: usize, place: &Place, counts: &mut Counts) -> Seen {
        let links = self.scene.geometry.lights_of(place.si.surface);
        match &self.lights.emitters[index] {
            Some(emitter) if self.scene.geometry.links.contains(links, LightId(index as u32)) => {
                self.look(index, emitter, place, counts).1
            }
            _ => Seen::Known(self.arrival(index, place, counts).sums),
        }
    }

    /// Looks at an area light that is integrated.
    fn look(&mut self, index: usize, emitter: &Emitter, place: &Place, counts: &mut Counts) -> (Change, Seen) {
        let (scene, si) = (self.scene, place.si);
        let light = &scene.lights[index];
        let Some(view) = self.view(emitter, place) else {
            let ask = light.shadows && si.receives_shadow;
            let between = Between { ask, ask_trees: ask && scene.geometry.has_trees(), ..Between::default() };
            let masked = self.masked(index, emitter, place, &between);
            let is_points = matches!(emitter, Emitter::Points);
            let sums = if is_points { masked.by_points(light, &self.enough(place)) } else { Sums::default() };
            counts.points += masked.asked.get();
            return (unseen(emitter, place), Seen::Known(sums));
        };
        if !view.arrives() {
            counts.settled.visibility[Visibility::BelowHorizon as usize] += 1;
            return (horizon_change(&view, place), Seen::Known(Sums::default()));
        }
        let between = if light.shadows && si.receives_shadow {
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
        (change, if behind { Seen::Behind(Box::new(Behind { view, between, whole })) } else { Seen::Known(whole) })
    }

    /// Whether sums with such an error will do for one light at a place.
    pub fn enough<'b>(&self, place: &'b Place) -> impl Fn(&Sums, &Sums) -> bool + use<'a, 'b> {
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
        self.tolerance_of(share) * (BY_CHANCE / TOLERANCE)
    }

    fn masked<'b>(&'b self, light: usize, emitter: &'b Emitter, place: &'b Place, between: &'b Between) -> Masked<'b> {
        let Place { si, lobe, share, series, .. } = *place;
        Masked { scene: self.scene, light, emitter, si, lobe, between, share, series, asked: Cell::new(0) }
    }

    /// A light behind things, as a place sees it.
    pub fn behind<'b>(&'b self, light: usize, place: &'b Place, behind: &'b Behind) -> Masked<'b> {
        let emitter =
            self.lights.emitters[light].as_ref().expect("only lights that are integrated are seen behind things");
        self.masked(light, emitter, place, &behind.between)
    }

    /// What stands between a place and an area light.
    fn between(&mut self, index: usize, emitter: &Emitter, view: &View, place: &Place) -> Between {
        let trees = self.gather(index, place);
        let asker = Asker { si: place.si, reach: place.reach };
        Between::look(self.scene, index, emitter, view, &asker, trees.then_some(&self.occluders))
    }

    /// Gathers what of the trees may be in the way of a light; whether there are any.
    pub(super) fn gather(&mut self, index: usize, place: &Place) -> bool {
        if !self.scene.geometry.has_trees() {
            return false;
        }
        let (target, point) = (&self.lights.targets[index], Viewpoint::of(place.si));
        self.occluders.gather_around(self.level, self.scene, target, &point, place.reach, place.turn > FLAT, LEAVES);
        true
    }

    /// How an area light would change if it were integrated.
    fn change_of(&mut self, index: usize, emitter: &Emitter, place: &Place) -> Change {
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
