//! Light at many places: each light of a scene is asked for all that want it together.

use std::ops::ControlFlow;

use super::Counts;
use super::arrival::{ArrivalPlace, Arrivals};
use super::change::Arrival;
use super::tiled::BEND;
use crate::color::Rgb;
use crate::ids::{LightId, MaterialId, SurfaceId};
use crate::integrate::{Arrived, Illumination, ShadingPoint};
use crate::light::LightKind;
use crate::material::{Bsdf, Lobe, Moments};
use crate::math::{Facet, Vec2};
use crate::scene::Scene;
use crate::shape::{Footprint, SurfaceInteraction, UvEdge};
use crate::visibility::Visibility;

/// A place of a surface that wants light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// Where, and what it stands for; the colours in it are filled in light by light.
    pub point: ShadingPoint,
    pub surface: SurfaceId,
    pub receives_shadow: bool,
    /// Its material; of what it stands for, the brightest colours and the darkest ambient one.
    pub bsdf: Bsdf,
}

impl Place {
    pub fn new(scene: &Scene, point: ShadingPoint, surface: SurfaceId, bsdf: &Bsdf) -> Place {
        let receives_shadow = scene.geometry.surfaces[surface.index()].receives_shadow;
        Place { point, surface, receives_shadow, bsdf: *bsdf }
    }

    /// The same as a surface, without its texture.
    pub fn surface(&self) -> SurfaceInteraction {
        let ShadingPoint { p, error, horizon, ns, wo, .. } = self.point;
        SurfaceInteraction {
            p,
            error,
            ng: horizon,
            ns,
            lit_from: p,
            horizon,
            facet: Facet::NONE,
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

/// One light at one place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    pub place: u32,
    pub light: u32,
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
}

impl Answer {
    /// Of what no batch knows.
    const UNKNOWN: Answer =
        Answer { sums: Moments::UNKNOWN, smooth: false, motion: f32::INFINITY, turn: f32::INFINITY };
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
}

impl<'a> LightQueue<'a> {
    pub fn new(scene: &'a Scene, arrivals: Arrivals<'a>) -> Self {
        LightQueue { scene, arrivals, lobes: Vec::new(), groups: Vec::new(), points: Vec::new(), arrived: Vec::new() }
    }

    /// Answers each request.
    pub fn ask(
        &mut self,
        places: &[Place],
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
            let group = (lobe * scene.lights.len() + request.light as usize) * 2 + usize::from(place.receives_shadow);
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
            let lobe = self.lobes[group / 2 / scene.lights.len()];
            let members = std::mem::take(&mut self.groups[group]);
            match self.arrivals.lights.asked(light, &lobe, scene.lights[light].shadows && group % 2 == 1) {
                Some(asked) => {
                    let emitter = asked.emitter;
                    self.points.clear();
                    let scale = self.arrivals.scale(light);
                    self.points.extend(members.iter().map(|k| {
                        let place = &places[requests[*k as usize].place as usize];
                        ShadingPoint {
                            worth: scale * place.bsdf.colors,
                            base: scene.ambient * place.bsdf.ambient,
                            ..place.point
                        }
                    }));
                    self.arrived.clear();
                    self.arrivals.evaluate(&asked, &self.points, &mut self.arrived);
                    for (i, k) in members.iter().enumerate() {
                        let place = &places[requests[*k as usize].place as usize];
                        let arrived = self.arrived[i];
                        let settled = &mut counts.settled.visibility;
                        match arrived.illumination {
                            Illumination::Below => settled[Visibility::BelowHorizon as usize] += 1,
                            Illumination::Hidden => settled[Visibility::Hidden as usize] += 1,
                            Illumination::Full => settled[Visibility::Lit as usize] += 1,
                            Illumination::Partial => counts.closed_form += 1,
                            Illumination::Unknown => {}
                        }
                        answers[*k as usize] = if arrived.illumination == Illumination::Unknown {
                            Answer::UNKNOWN
                        } else {
                            let is_near = place.point.reach > 0.4 * arrived.distance
                                || emitter.is_one_sided() && arrived.height <= place.point.reach;
                            Answer {
                                sums: arrived.sums,
                                smooth: arrived.proved,
                                motion: arrived.motion,
                                turn: if is_near && !arrived.proved {
                                    f32::INFINITY
                                } else {
                                    self.turn(place, &lobe, arrived.distance)
                                },
                            }
                        };
                    }
                }
                None => {
                    for k in &members {
                        go_on()?;
                        let place = &places[requests[*k as usize].place as usize];
                        answers[*k as usize] = self.one(light, place, counts);
                    }
                }
            }
            self.groups[group] = members;
        }
        ControlFlow::Continue(())
    }

    /// How far directions turn within a place's reach, times how fast a highlight falls.
    fn turn(&self, place: &Place, lobe: &Lobe, distance: f32) -> f32 {
        if place.point.reach == 0.0 {
            return 0.0;
        }
        let sway = self.scene.camera.sway(place.point.p, place.point.reach);
        let angle = place.point.turn + 0.5 * (place.point.reach / distance + sway);
        // As the exponent of Blinn's model
        angle * (8.0 * lobe.sharpness(1.0)).max(1.0).sqrt()
    }

    /// One light at one place, by itself.
    fn one(&mut self, light: usize, place: &Place, counts: &mut Counts) -> Answer {
        let si = place.surface();
        let wanted = ArrivalPlace {
            reach: place.point.reach,
            turn: place.point.turn,
            share: place.point.share,
            ..self.arrivals.place(light, &si, &place.bsdf)
        };
        let arrival = self.arrivals.arrival(light, &wanted, counts);
        // A light of one point sets in at once where it passes the horizon
        let kind = &self.scene.lights[light];
        let ShadingPoint { p, ns, horizon, reach, turn, .. } = place.point;
        let is_kinked = !matches!(kind.kind, LightKind::Area(_)) && {
            let to = kind.towards(0, p).l;
            ns.dot(to).min(horizon.dot(to)).abs() < reach + turn * to.length()
        };
        let is_even = self.is_even(&wanted, &arrival);
        Answer {
            sums: arrival.sums,
            smooth: place.point.reach == 0.0 || arrival.smooth && arrival.drift == 0.0,
            motion: arrival.drift,
            turn: if is_kinked || !is_even && !arrival.resolved {
                f32::INFINITY
            } else if arrival.sharp {
                0.5
            } else if is_even {
                0.0
            } else {
                // One place does not tell what it does, but some do together
                0.1
            },
        }
    }

    /// Whether what a light sends changes so little within a place's reach that nothing of that shows.
    fn is_even(&self, place: &ArrivalPlace, arrival: &Arrival) -> bool {
        let colors = place.colors();
        let value = colors.onto(place.base, &arrival.sums);
        let error = colors.of(&arrival.bend);
        self.arrivals.steps(value, error) <= BEND / (self.scene.lights.len() as f32).sqrt()
    }
}
