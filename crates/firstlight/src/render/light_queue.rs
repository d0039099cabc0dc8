//! Light at many places: each light of a scene is asked for all that want it together.

use std::ops::ControlFlow;

use arrayvec::ArrayVec;

use super::arrival::{ArrivalPlace, Arrivals, Trees};
use super::change::Arrival;
use super::{Counts, QUESTION_EVERY};
use crate::color::Rgb;
use crate::ids::{LightId, MaterialId, SurfaceId};
use crate::integrate::{Arrived, Emitter, Illumination, ShadingPoint, TOLERANCE};
use crate::light::Extent;
use crate::material::{Bsdf, Lobe, Moments};
use crate::math::{LANES, Vec2};
use crate::scene::Scene;
use crate::shape::{Footprint, SurfaceInteraction, UvEdge};
use crate::visibility::Viewpoint;

/// The most places that ask for a light that is not integrated together.
const AT_ONCE: u64 = 256;

/// A place of a surface that wants light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LitPlace {
    /// Where, and what it stands for; the colours in it are filled in light by light.
    pub point: ShadingPoint,
    pub surface: SurfaceId,
    pub receives_shadow: bool,
    /// Its material; of what it stands for, the brightest colours and the darkest ambient one.
    pub bsdf: Bsdf,
}

impl LitPlace {
    pub fn new(scene: &Scene, point: ShadingPoint, surface: SurfaceId, bsdf: &Bsdf) -> LitPlace {
        let receives_shadow = scene.geometry.surfaces[surface.index()].receives_shadow;
        LitPlace { point, surface, receives_shadow, bsdf: *bsdf }
    }

    /// Where its rays begin.
    pub fn viewpoint(&self) -> Viewpoint {
        Viewpoint::of(&self.surface())
    }

    /// The same as a surface, without its texture.
    pub fn surface(&self) -> SurfaceInteraction {
        let ShadingPoint { p, error, horizon, ng, facet, ns, wo, .. } = self.point;
        SurfaceInteraction {
            p,
            error,
            ng,
            ns,
            lit_from: p,
            horizon,
            facet,
            wo,
            uv: Vec2::ZERO,
            footprint: Footprint { dx: Vec2::ZERO, dy: Vec2::ZERO, edges: [UvEdge::Unbounded; 2] },
            color: Rgb::WHITE,
            surface: self.surface,
            material: MaterialId(0),
            receives_shadow: self.receives_shadow,
        }
    }
}

/// What is known of the ways from a place, and from all that it stands for, to a light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum Sight {
    /// Nothing.
    #[default]
    Unknown,
    /// Nothing in trees is in the way.
    Clear,
    /// Nothing at all is in the way.
    Lit,
}

/// One light at one place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    pub place: u32,
    pub light: u32,
    pub sight: Sight,
}

/// What arrives of one light at one place.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Answer {
    /// No number where no batch knows it.
    pub sums: Moments,
    /// Whether the light is seen as a whole, or not at all, from all within the place's reach.
    pub smooth: bool,
    /// How far outlines of shadows move on the light within the reach, as a part of its size.
    pub motion: f32,
    /// How much light turns and grows within the reach: angles by which its direction turns, in radians, with what a
    /// highlight makes of it; more than any bound where the place is near the light or its plane.
    pub turn: f32,
    /// How much of the light could arrive there at most, thereabouts: what turns it away takes its share of that.
    pub most: f32,
    /// What is known by now of the ways to the light, from all within the reach.
    pub sight: Sight,
}

impl Answer {
    /// Of what no batch knows.
    const UNKNOWN: Answer = Answer {
        sums: Moments::UNKNOWN,
        smooth: false,
        motion: f32::INFINITY,
        turn: f32::INFINITY,
        most: 0.0,
        sight: Sight::Unknown,
    };

    /// How far the mean within the reach may be from what arrives in the middle because light turns, as a part of all
    /// that could.
    pub fn turned(&self) -> f32 {
        0.5 * self.turn * self.turn
    }

    /// The same because the light comes out from behind an outline, or above the horizon: what is seen of it begins to
    /// grow at once, an eighth of the way that the outline or the light moves.
    pub fn kink(&self) -> f32 {
        let moved = if self.smooth { self.motion } else { self.motion.max(self.turn) };
        if self.sums.cosine() <= moved * self.most { 0.125 * moved } else { 0.0 }
    }
}

/// Requests for one light at places of one highlight.
struct Group<'p> {
    light: usize,
    lobe: Lobe,
    places: &'p [LitPlace],
    requests: &'p [Request],
}

impl<'p> Group<'p> {
    fn request(&self, k: u32) -> &'p Request {
        &self.requests[k as usize]
    }

    fn place(&self, k: u32) -> &'p LitPlace {
        &self.places[self.request(k).place as usize]
    }
}

/// Asks for light.
pub(crate) struct LightQueue<'a> {
    scene: &'a Scene,
    pub arrivals: Arrivals<'a>,
    lobes: Vec<Lobe>,
    /// Requests in the order in which they are asked: those of one light, one highlight, with or without shadows.
    groups: Vec<Vec<u32>>,
    points: Vec<ShadingPoint>,
    arrived: Vec<Arrived>,
    /// Of a group: what is asked past nothing in trees.
    clear: Vec<u32>,
}

impl<'a> LightQueue<'a> {
    pub fn new(scene: &'a Scene, arrivals: Arrivals<'a>) -> Self {
        LightQueue {
            scene,
            arrivals,
            lobes: Vec::new(),
            groups: Vec::new(),
            points: Vec::new(),
            arrived: Vec::new(),
            clear: Vec::new(),
        }
    }

    /// Answers each request.
    pub fn ask(
        &mut self,
        places: &[LitPlace],
        requests: &[Request],
        answers: &mut Vec<Answer>,
        counts: &mut Counts,
        go_on: &dyn Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let scene = self.scene;
        answers.clear();
        answers.resize(requests.len(), Answer { smooth: true, ..Answer::default() });
        // Sort them by light, highlight and shadows
        self.lobes.clear();
        self.groups.iter_mut().for_each(Vec::clear);
        for (k, request) in requests.iter().enumerate() {
            let place = &places[request.place as usize];
            let links = scene.geometry.lights_of(place.surface);
            if !scene.geometry.links.contains(links, LightId(request.light)) {
                continue;
            }
            let lobe = self.lobes.iter().position(|lobe| *lobe == place.bsdf.lobe).unwrap_or_else(|| {
                self.lobes.push(place.bsdf.lobe);
                self.lobes.len() - 1
            });
            let shadows = place.receives_shadow && request.sight != Sight::Lit;
            let group = (lobe * scene.lights.len() + request.light as usize) * 2 + usize::from(shadows);
            if group >= self.groups.len() {
                self.groups.resize_with(group + 1, Vec::new);
            }
            self.groups[group].push(k as u32);
        }
        for group in 0..self.groups.len() {
            if self.groups[group].is_empty() {
                continue;
            }
            let light = group / 2 % scene.lights.len();
            let of = Group { light, lobe: self.lobes[group / 2 / scene.lights.len()], places, requests };
            let members = std::mem::take(&mut self.groups[group]);
            let shadows = scene.lights[light].shadows && group % 2 == 1;
            if !self.arrivals.is_integrated(light) {
                let at_once = (QUESTION_EVERY / scene.lights[light].samples() as u64).clamp(1, AT_ONCE) as usize;
                for some in members.chunks(at_once) {
                    go_on()?;
                    self.sampled(&of, some, answers, counts);
                }
            } else if shadows && self.arrivals.lights.has_trees(scene, light) {
                self.past_trees(&of, &members, answers, counts, go_on)?;
            } else {
                self.batch(&of, [shadows, false], &members, answers, counts);
            }
            self.groups[group] = members;
        }
        ControlFlow::Continue(())
    }

    /// Asks some places of one highlight for a light, by batches: with or without shadows, and with what was gathered
    /// in trees.
    fn batch(
        &mut self,
        of: &Group,
        [shadows, near]: [bool; 2],
        members: &[u32],
        answers: &mut [Answer],
        counts: &mut Counts,
    ) {
        let (scene, light) = (self.scene, of.light);
        let scale = self.arrivals.scale(light);
        self.points.clear();
        self.points.extend(members.iter().map(|k| {
            let place = of.place(*k);
            let (worth, base) = (scale * place.bsdf.colors, scene.ambient * place.bsdf.ambient);
            ShadingPoint { worth, base, ..place.point }
        }));
        self.arrived.clear();
        self.arrivals.evaluate(light, &of.lobe, [shadows, near], &self.points, &mut self.arrived);
        let measure = self.arrivals.measure(light);
        let is_physical = scene.lights[light].area().is_some_and(|area| area.physical);
        let is_one_sided = self.arrivals.lights.emitters[light].as_ref().is_some_and(Emitter::is_one_sided);
        for (arrived, k) in self.arrived.iter().zip(members) {
            let place = of.place(*k);
            counts.note(arrived.illumination);
            let sight = match (shadows, near) {
                (false, _) => Sight::Lit,
                (true, false) => Sight::Clear,
                (true, true) => Sight::Unknown,
            };
            answers[*k as usize] = if arrived.illumination == Illumination::Unknown {
                Answer { sight, ..Answer::UNKNOWN }
            } else {
                let is_near = is_one_sided && arrived.height <= place.point.reach;
                Answer {
                    sums: arrived.sums,
                    smooth: arrived.proved,
                    motion: arrived.motion,
                    turn: if is_near && !arrived.proved {
                        f32::INFINITY
                    } else {
                        self.turn(place, &of.lobe, arrived.distance)
                    },
                    most: if is_physical { measure / (arrived.distance * arrived.distance) } else { 1.0 },
                    sight,
                }
            };
        }
    }

    /// The same past what is in trees: what that is, is gathered for each place, and for neighbours that are points of
    /// one surface together. Nobody knows what arrives where that is too much.
    fn past_trees(
        &mut self,
        of: &Group,
        members: &[u32],
        answers: &mut [Answer],
        counts: &mut Counts,
        go_on: &dyn Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut clear = std::mem::take(&mut self.clear);
        clear.clear();
        let mut rest = members;
        while let Some(first) = rest.first().copied() {
            if of.request(first).sight == Sight::Clear {
                clear.push(first);
                rest = &rest[1..];
                continue;
            }
            go_on()?;
            let is_like = |k: &&u32| {
                of.place(first).point.reach + of.place(**k).point.reach == 0.0
                    && of.request(**k).sight == Sight::Unknown
                    && of.place(**k).surface == of.place(first).surface
            };
            let mut run = 1 + rest[1..].iter().take(LANES - 1).take_while(is_like).count();
            let mut trees = self.gather(of, &rest[..run]);
            while run > 1 && matches!(trees, Trees::Unknown) {
                run /= 2;
                trees = self.gather(of, &rest[..run]);
            }
            let (now, later) = rest.split_at(run);
            match trees {
                Trees::Nothing => clear.extend(now),
                Trees::Known => self.batch(of, [true, true], now, answers, counts),
                Trees::Unknown => answers[first as usize] = Answer::UNKNOWN,
            }
            rest = later;
        }
        self.batch(of, [true, false], &clear, answers, counts);
        self.clear = clear;
        ControlFlow::Continue(())
    }

    /// Gathers what of the trees may be in the way of a light.
    fn gather(&mut self, of: &Group, members: &[u32]) -> Trees {
        let points: ArrayVec<Viewpoint, LANES> = members.iter().map(|k| of.place(*k).viewpoint()).collect();
        let ShadingPoint { reach, turn, .. } = of.place(members[0]).point;
        self.arrivals.gather(of.light, &points, reach, turn)
    }

    /// How far directions turn within a place's reach, times how fast a highlight falls.
    fn turn(&self, place: &LitPlace, lobe: &Lobe, distance: f32) -> f32 {
        if place.point.reach == 0.0 {
            return 0.0;
        }
        let sway = self.scene.camera.sway(place.point.p, place.point.reach);
        let angle = place.point.turn + 0.5 * (place.point.reach / distance + sway);
        // As the exponent of Blinn's model
        angle * (8.0 * lobe.sharpness(1.0)).max(1.0).sqrt()
    }

    /// A light that is not integrated, at some places of one highlight.
    fn sampled(&mut self, of: &Group, members: &[u32], answers: &mut [Answer], counts: &mut Counts) {
        let surfaces: Vec<SurfaceInteraction> = members.iter().map(|k| of.place(*k).surface()).collect();
        let wanted = members.iter().zip(&surfaces).map(|(k, si)| {
            let (LitPlace { point, bsdf, .. }, sight) = (of.place(*k), of.request(*k).sight);
            ArrivalPlace {
                lit: sight == Sight::Lit,
                clear: sight != Sight::Unknown,
                reach: point.reach,
                turn: point.turn,
                share: point.share,
                ..self.arrivals.place(of.light, si, bsdf)
            }
        });
        let wanted: Vec<ArrivalPlace> = wanted.collect();
        let mut found = Vec::with_capacity(members.len());
        self.arrivals.of_other(of.light, &wanted, false, &mut found, counts);
        for ((k, wanted), arrival) in members.iter().zip(&wanted).zip(&found) {
            let Request { sight, .. } = *of.request(*k);
            let place = of.place(*k);
            if !arrival.sums.is_known() {
                answers[*k as usize] = Answer { sight, ..Answer::UNKNOWN };
                continue;
            }
            let is_even = self.is_even(wanted, arrival);
            answers[*k as usize] = Answer {
                sums: arrival.sums,
                smooth: place.point.reach == 0.0 || arrival.smooth && arrival.drift == 0.0,
                motion: arrival.drift,
                turn: if self.sets_in(of.light, &place.point) || !is_even && !arrival.resolved {
                    f32::INFINITY
                } else if is_even {
                    0.0
                } else {
                    // One place does not tell what it does, but some do together
                    1.0
                },
                most: 0.0,
                sight,
            };
        }
    }

    /// Whether a light of one point may pass the horizon within a place's reach, where it sets in at once.
    fn sets_in(&self, light: usize, ShadingPoint { p, ns, horizon, reach, turn, .. }: &ShadingPoint) -> bool {
        let light = &self.scene.lights[light];
        match light.extent() {
            Extent::Area(_) => false,
            Extent::Point => {
                let to = light.towards(0, *p).l;
                ns.dot(to).min(horizon.dot(to)).abs() < reach + turn * to.length()
            }
        }
    }

    /// Whether what a light sends changes so little within a place's reach that nothing of that shows.
    fn is_even(&self, place: &ArrivalPlace, arrival: &Arrival) -> bool {
        let colors = place.colors();
        let value = colors.onto(place.base, &arrival.sums);
        let error = colors.of(&arrival.bend);
        self.arrivals.steps(value, error) <= TOLERANCE.point / (self.scene.lights.len() as f32).sqrt()
    }
}
