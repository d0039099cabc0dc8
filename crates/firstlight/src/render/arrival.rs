//! How much of one light arrives at one place of a surface, and how much that bends over the patch around it.

use std::cell::Cell;

use fearless_simd::Level;

use super::Counts;
use super::lanes::Lanes;
use super::many::FEW;
use super::pixel::Lighting;
use super::plain::Plain;
use crate::color::{DisplaySteps, Rgb};
use crate::ids::LightId;
use crate::integrate::{Asker, Between, Emitter, Masked, Receiver, Sums, View, integrate, sharpness};
use crate::light::{Light, LightKind, LightTree};
use crate::material::{Bsdf, Lobe};
use crate::math::{Vec3, dispatch_wide, square};
use crate::scene::Scene;
use crate::shape::{PlaneSide, SurfaceInteraction};
use crate::visibility::{Occluders, Target, Viewpoint, Visibility};

/// What of one light arrives.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Arrival {
    pub sums: Sums,
    /// Whether that was not asked, since it would not do for the patch.
    pub skipped: bool,
    /// How far the mean over the patch can be from what arrives at its middle.
    pub bend: Sums,
    /// Over how much of the light's size the outlines of shadows move across the patch; see [`Between::drift`].
    pub drift: f32,
    /// Whether all that light does here is wide beside the patch, so that neighbours tell what it does.
    pub resolved: bool,
    /// Whether nothing of it has a corner, and what curves does so little that a quadratic in the place follows it.
    pub smooth: bool,
    /// Whether a highlight is not wide beside the patch.
    pub sharp: bool,
}

/// How a light changes over a patch.
#[derive(Clone, Copy, Debug, Default)]
struct Change {
    /// See [`Arrival::bend`], and so on.
    bend: Sums,
    drift: f32,
    resolved: bool,
    smooth: bool,
    sharp: bool,
}

impl Change {
    /// Not at all.
    const NONE: Change =
        Change { bend: Sums { diffuse: 0.0, specular: 0.0 }, drift: 0.0, resolved: true, smooth: true, sharp: false };
    /// Nobody knows.
    const UNKNOWN: Change = Change {
        bend: Sums { diffuse: f32::MAX, specular: f32::MAX },
        drift: f32::INFINITY,
        resolved: false,
        smooth: false,
        sharp: true,
    };

    fn with(self, sums: Sums) -> Arrival {
        let Change { bend, drift, resolved, smooth, sharp } = self;
        Arrival { sums, skipped: false, bend, drift, resolved, smooth, sharp }
    }
}

impl Arrival {
    /// At a point, or where nothing bends.
    pub fn even(sums: Sums) -> Arrival {
        Change::NONE.with(sums)
    }
}

/// Outlines that move over a larger part of the light than this, and highlights that move by more of their width, squared, are
/// not wide beside the patch.
const RESOLVED: f32 = 0.5;
/// The same for the angle by which the light's direction and the normal turn.
const RESOLVED_SWING: f32 = 0.2;

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
    /// Where it stands for a patch: how much may bend over it, in display steps, and whether its neighbours may tell that less
    /// does. If it will not do for the patch, points of the light are not asked.
    pub allowed: f32,
    pub beside: bool,
    /// What is there beside this light, at least.
    pub base: Rgb,
    /// What the two sums are multiplied with.
    pub colors: [Rgb; 2],
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
    /// Whether any light with an area is not.
    sampled: bool,
    pub steps: DisplaySteps,
    /// In display steps: how far one light may be wrong at a place.
    tolerance: f32,
    /// Where there are many.
    tree: Option<LightTree>,
    /// The lights as shafts lead to them; none where there are no trees to lead through.
    targets: Vec<Target>,
}

/// Parts of a pixel smaller than this are judged as if they were as large.
const LEAST_SHARE: f32 = 1.0 / 8.0;
/// In display steps: how far all lights together may be wrong.
const TOLERANCE: f32 = 0.1;
/// The same where each place is wrong by itself, as by chance: nothing of that shows as a step or an edge.
const BY_CHANCE: f32 = 0.15;

impl Lights {
    pub fn new(scene: &Scene) -> Lights {
        let emitter = |light: &Light| match &light.kind {
            LightKind::Area(area) if light.exact => Some(Emitter::new(area)),
            _ => None,
        };
        let emitters: Vec<_> = scene.lights.iter().map(emitter).collect();
        let tolerance = TOLERANCE / (emitters.len().max(1) as f32).sqrt();
        let targets = if scene.geometry.has_trees() { Target::of_all(scene) } else { Vec::new() };
        let is_area = |light: &Light| matches!(light.kind, LightKind::Area(_));
        let sampled = scene.lights.iter().zip(&emitters).any(|(light, emitter)| is_area(light) && emitter.is_none());
        let tree = (scene.lights.len() > FEW).then(|| LightTree::new(&scene.lights));
        Lights { emitters, sampled, steps: DisplaySteps::new(&scene.display), tolerance, tree, targets }
    }
}

/// The lights, as one thread asks for them.
pub(crate) struct Arrivals<'a> {
    scene: &'a Scene,
    lights: &'a Lights,
    level: Level,
    sampled: Lanes,
    occluders: Occluders,
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
            sampled: Lanes::new(level),
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

    /// The light that is everywhere.
    pub fn ambient(&self) -> Rgb {
        self.scene.ambient
    }

    /// How errors show.
    pub fn display_steps(&self) -> &'a DisplaySteps {
        &self.lights.steps
    }

    /// From now on each light may be wrong by so many display steps.
    pub fn tolerate(&mut self, tolerance: f32) {
        self.tolerance = tolerance;
    }

    /// Has to be called first at each place.
    pub fn look_around(&mut self, si: &SurfaceInteraction) {
        if self.lights.sampled {
            self.sampled.look_around(self.scene, si);
        }
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
                let sums = self.sampled.gather(self.scene, index, place.si, place.lobe, counts);
                let sums = Sums { diffuse: sums.diffuse.total(), specular: sums.specular.total() };
                if place.reach == 0.0 {
                    return Arrival::even(sums);
                }
                // As it would be if it were integrated, in the unit of samples
                let emitter = Emitter::new(area);
                let one = area.samples() as f32 / if area.physical { area.measure() as f32 } else { 1.0 };
                let mut change = self.change_of(index, &emitter, place);
                change.bend = Sums { diffuse: change.bend.diffuse * one, specular: change.bend.specular * one };
                change.with(sums)
            }
            (None, _) => self.single(index, light, place, counts),
        }
    }

    /// What light `index` sends to one point, which stands for `share` of a pixel: diffuse and specular, with all colours.
    pub fn at_point(
        &mut self,
        index: usize,
        si: &SurfaceInteraction,
        bsdf: &Bsdf,
        share: f32,
        counts: &mut Counts,
    ) -> [Rgb; 2] {
        let scale = self.scale(index);
        let colors = [scale * bsdf.diffuse, scale * bsdf.specular];
        let base = self.scene.ambient * bsdf.ambient;
        let lobe = &bsdf.lobe;
        let place = Place {
            si,
            lobe,
            reach: 0.0,
            turn: 0.0,
            off: 0.0,
            share,
            series: 0,
            allowed: f32::INFINITY,
            beside: false,
            base,
            colors,
        };
        let sums = self.arrival(index, &place, counts).sums;
        [colors[0] * sums.diffuse, colors[1] * sums.specular]
    }

    /// A light of one point.
    fn single(&mut self, index: usize, light: &Light, place: &Place, counts: &mut Counts) -> Arrival {
        let si = place.si;
        let sums = Plain.gather(self.scene, index, si, place.lobe, counts);
        let sums = Sums { diffuse: sums.diffuse.total(), specular: sums.specular.total() };
        if place.reach == 0.0 {
            return Arrival::even(sums);
        }
        let to = light.towards(0, si.lit_from);
        let distance = if to.finite { to.l.length() } else { f32::INFINITY };
        // The most that can arrive on the patch, the cosine being 1
        let near = (distance - place.reach).max(0.0);
        let (height, behind) = (si.ns.dot(to.l).min(si.horizon.dot(to.l)), place.reach + place.turn * to.l.length());
        if height < -behind {
            return Arrival::even(sums);
        }
        let Some(sample) = light.sample(0, to.l) else {
            return Change::UNKNOWN.with(sums);
        };
        let weight = sample.weight.max(sums.diffuse) * 1.2;
        // A spot's rim, a terminator, a shadow's edge
        let rim = match &light.kind {
            LightKind::Spot(spot) => {
                let toward = (-to.l).normalize_or_zero();
                let cos = 1.0 - toward.dot(spot.axis);
                let swing = 2.0 * place.reach / near.max(f32::MIN_POSITIVE);
                if (cos - spot.outer).abs() < swing * 2.0 { 1.0 } else { swing * spot.inverse_fade.min(1e6) * swing }
            }
            _ => 0.0,
        };
        let weight = if rim >= 1.0 { weight.max(1.0 / (near * near).max(f32::MIN_POSITIVE)) } else { weight };
        let edge = if light.shadows && si.receives_shadow { self.edge(index, to.l, to.finite, place) } else { 0.0 };
        let swing = place.turn + place.reach / distance;
        let terminator = if height < behind { swing * 0.5 } else { 0.0 };
        let smooth = swing * swing + 2.0 * swing * place.off;
        let share = (edge + rim + terminator + smooth).min(1.0);
        let moved = 2.0 * place.turn + place.reach / distance + self.scene.camera.sway(si.lit_from, place.reach);
        let lobe = (place.lobe.sharpness(si.ns.dot(si.wo)) * square(moved)).min(1.0);
        let specular =
            if matches!(place.lobe, Lobe::None) { 0.0 } else { weight * (edge + rim + terminator + lobe).min(1.0) };
        let resolved = edge == 0.0 && rim == 0.0 && swing < RESOLVED_SWING && lobe < RESOLVED;
        let drift = if edge == 0.0 { 0.0 } else { f32::INFINITY };
        let smooth = resolved && terminator == 0.0 && is_smooth(swing, lobe);
        Change { bend: Sums { diffuse: weight * share, specular }, drift, resolved, smooth, sharp: is_sharp(lobe) }
            .with(sums)
    }

    /// Whether the edge of a shadow, of a light of one point, may run through the patch: 1, or 0 if that is excluded.
    fn edge(&mut self, light: usize, l: Vec3, finite: bool, place: &Place) -> f32 {
        let (scene, si) = (self.scene, place.si);
        if !scene.light_obstacles.disks.is_empty()
            || self.gather(light, place) && (self.occluders.too_many || self.occluders.count() > 0)
        {
            return 1.0;
        }
        let length = l.length();
        let d = l / length;
        let end = if finite { length } else { f32::INFINITY };
        let id = LightId(light as u32);
        let [sphere_links, flat_links] = &scene.obstacle_links;
        let spheres = scene.obstacles.iter().enumerate().filter(|(i, _)| scene.casts(sphere_links, *i, id));
        let spheres = spheres.map(|(_, sphere)| sphere);
        let lights =
            scene.light_obstacles.spheres.iter().filter(|(index, _)| *index != light).map(|(_, sphere)| sphere);
        for sphere in spheres.chain(lights) {
            let s = (sphere.c - si.lit_from.as_dvec3()).as_vec3();
            let (r, distance) = (sphere.r as f32, s.length());
            // The surface's own sphere, from outside
            if (distance - r).abs() <= r * 1e-3 && s.dot(si.horizon) < 0.0 {
                continue;
            }
            let t = s.dot(d).clamp(0.0, end);
            let miss = (s - d * t).length();
            let through = distance > r + place.reach && end - s.dot(d) > r + place.reach && s.dot(d) > 0.0;
            let slack = place.reach + (distance + length.min(1e30)) * 1e-5;
            if miss > r + slack {
                continue;
            }
            if through && miss < r - slack {
                return 0.0;
            }
            return 1.0;
        }
        let mut edge = 0.0;
        for (i, flat) in scene.flat_obstacles.iter().enumerate() {
            if !scene.casts(flat_links, i, id) {
                continue;
            }
            let n = flat.n.as_vec3();
            let height = flat.n.dot(si.lit_from.as_dvec3() - flat.p) as f32;
            let tip = if finite {
                height + n.dot(l)
            } else if n.dot(l) * height < 0.0 {
                -height
            } else {
                height
            };
            let slack = place.reach + (height.abs() + length.min(1e30)) * 1e-5;
            if height.abs() <= slack && flat.shadow(si.lit_from, si.error).is_one_sided(PlaneSide::Both) {
                // The surface's own
                continue;
            }
            if height > slack && tip > slack || height < -slack && tip < -slack {
                continue;
            }
            let t = -f64::from(height) / f64::from(n.dot(l));
            let hit = si.lit_from.as_dvec3() + l.as_dvec3() * t;
            let aside = flat.outside(hit) as f32;
            // Where the way meets the plane at a small angle, it moves there by more than the point
            let wide = slack * (length / n.dot(l).abs()).max(1.0) * 1.25;
            if aside > wide {
                continue;
            }
            if aside < -wide && height.abs() > slack && (!finite || tip.abs() > slack) {
                return 0.0;
            }
            edge = 1.0;
        }
        edge
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
    fn gather(&mut self, index: usize, place: &Place) -> bool {
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

/// Patches over which the light's direction and the normal turn by less than the first, in radians, and a highlight by less
/// than the second of its width, squared, are followed by a quadratic: its error is that of the third order, about a
/// hundredth of the highlight times the second to the power of 3/2.
fn is_smooth(swing: f32, lobe: f32) -> bool {
    swing < 0.1 && !is_sharp(lobe)
}

fn is_sharp(lobe: f32) -> bool {
    lobe >= 0.05
}

/// Of a light that nothing is seen of, or that has no view.
fn unseen(emitter: &Emitter, place: &Place) -> Change {
    let is_known = !matches!(emitter, Emitter::Points) || place.reach == 0.0;
    if is_known {
        Change { drift: f32::INFINITY, resolved: false, smooth: false, ..Change::NONE }
    } else {
        Change::UNKNOWN
    }
}

/// What arrives on a patch whose middle sees nothing of a light, at most.
fn horizon_change(view: &View, place: &Place) -> Change {
    if place.reach == 0.0 {
        return Change::NONE;
    }
    let far = view.l0.length() + view.la + view.lb + view.skew.abs();
    let behind = place.reach + place.turn * far;
    if view.facing < -place.reach || view.cos.max() < -behind || view.horizon.max() < -behind {
        return Change::NONE;
    }
    let swing = place.turn + place.reach / view.nearest().max(place.reach);
    let crossing = view.crossing(place.reach);
    let cos = (view.cos.max().max(0.0) / view.l0.length() + swing).min(1.0);
    let all = view.most(place.reach) * (swing.min(1.0) * 0.5 + cos * crossing).min(1.0);
    let bend = Sums { diffuse: all, specular: all };
    let resolved = swing < RESOLVED_SWING && crossing == 0.0;
    Change { bend, drift: 0.0, resolved, smooth: false, sharp: false }
}

/// How far the mean over a patch can be from what arrives at its middle, and so on. `sway` is by how much the way to the viewer
/// turns over it.
fn change(view: &View, place: &Place, between: &Between, sway: f32) -> Change {
    let drift = between.drift;
    if place.reach == 0.0 || between.hidden && drift == 0.0 {
        return Change::NONE;
    }
    let (most, nearest, crossing) = (view.most(place.reach), view.nearest(), view.crossing(place.reach));
    let swing = place.turn + place.reach / nearest.max(place.reach);
    let cuts = !view.is_above_horizon() || view.cos.min() < place.reach + place.turn * view.l0.length();
    // Where the outline of a shadow comes in, the share it hides begins to grow at once: an eighth of the way it moves
    let kink = (drift * (0.125 + 0.5 * place.off)).min(1.0);
    let cos = (view.cos.max() / view.l0.length()).min(1.0) + swing;
    let horizon = if cuts { swing * swing.min(1.0) } else { 0.0 };
    let smooth = square(place.reach / nearest.max(place.reach)) * 2.0 + place.turn * place.turn * 0.5;
    let smooth = smooth + 2.0 * swing * place.off;
    let diffuse = most * (cos * (kink + smooth.min(1.0) + crossing) + horizon).min(1.0);
    let resolved = drift < RESOLVED && swing < RESOLVED_SWING && crossing == 0.0;
    let is_clear = resolved && drift == 0.0 && between.hiders.is_empty() && !between.ask && !between.ask_trees && !cuts;
    if matches!(view.lobe, Lobe::None) {
        let bend = Sums { diffuse, specular: 0.0 };
        return Change { bend, drift, resolved, smooth: is_clear && is_smooth(swing, 0.0), sharp: false };
    }
    let moved = 2.0 * place.turn + place.reach / nearest.max(place.reach) + sway;
    let lobe = sharpness(view) * moved * moved;
    let narrow = lobe.min(1.0);
    let narrow = (narrow + 2.0 * narrow.sqrt() * place.off).min(1.0);
    let specular = most * brightest(view, lobe) * (kink + smooth + narrow + horizon + crossing).min(1.0);
    let bend = Sums { diffuse, specular };
    let resolved = resolved && narrow < RESOLVED;
    Change { bend, drift, resolved, smooth: is_clear && is_smooth(swing, lobe), sharp: is_sharp(lobe) }
}

/// How bright a highlight can be on a light, at most, or thereabouts, from all over a patch; `moved` is what the highlight
/// moves by over the patch, as a part of its width, squared.
fn brightest(view: &View, moved: f32) -> f32 {
    let size2 = square(view.la.max(view.lb));
    let distance2 = square(view.nearest());
    let sharp = sharpness(view) * size2;
    if sharp > 0.5 * distance2 || moved > 1.0 {
        return 1.0;
    }
    let at = |x: f32, y: f32| {
        let l = view.l(x, y);
        let inverse = 1.0 / l.length();
        view.lobe.eval((view.ns.dot(l) * inverse).max(0.0), view.cos_o, view.wo.dot(l) * inverse)
    };
    let corners = at(-1.0, -1.0).max(at(1.0, -1.0)).max(at(1.0, 1.0)).max(at(-1.0, 1.0));
    let here = (corners.max(at(0.0, 0.0)) * 1.5).min(1.0);
    // exp(-(a - m)^2) is at most exp(-(1 - e) a^2) exp((1/e - 1) m^2), for any share e
    let root = here.sqrt();
    let there = if moved < 1e-3 {
        here
    } else if moved < 0.1 {
        root * root.sqrt() * (1.0 + 4.0 * moved)
    } else {
        root * (1.0 + 2.0 * moved)
    };
    there.min(1.0)
}
