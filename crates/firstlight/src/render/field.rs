//! The light over a square of pixels that see one shape, from few places.
//!
//! Where nothing that a light does is narrow beside the square, nine places tell it all: the corners, the middles of
//! the sides and the middle. The corners alone foretell what the other five hold, as if light changed evenly. Where
//! that shows no error, the quadratic through all nine is nearer still, and every pixel takes its light from it.
//! Elsewhere the square is quartered; what is left at the end is lit pixel by pixel.
//!
//! What can be narrow is known before: how far the outline of a shadow moves on the light across the square
//! ([`Arrival::drift`]), and how the light's direction and the highlight turn ([`Arrival::resolved`]).

use super::Counts;
use super::arrival::{Arrivals, Place};
use super::change::Arrival;
use super::solo::Candidate;
use super::square::Square;
use super::tiled::CELL;
use crate::color::Rgb;
use crate::integrate::Sums;
use crate::material::{Bsdf, Lobe};
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;

/// In display steps: what the corners of a square may be wrong about its middle. The quadratic is wrong by a tenth of
/// that where the slope of light has a corner, by a third where light itself has one.
const SHOWS: f32 = 0.4;
/// The same under a highlight that is not wide.
const SHOWS_SHARP: f32 = 0.1;
/// The same where light is smooth: the quadratic's error is a small part of that.
const SHOWS_SMOOTH: f32 = 1.0;
/// Outlines of shadows that move over a larger part of a light than this are narrow beside the square.
const WIDE: f32 = 0.3;
/// Pixels across the smallest square that is lit from nine places.
const SMALLEST: u32 = 4;
/// Pixels between two places, at least.
const STEP: u32 = SMALLEST / 2;
/// Places across a cell.
const ACROSS: usize = (CELL / STEP) as usize + 1;

/// What a square of one shape is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shade {
    pub candidate: Candidate,
    /// Its highlight; all pixels have the same, or none.
    pub lobe: Lobe,
    /// The brightest of its colours, channel by channel.
    pub diffuse: Rgb,
    pub specular: Rgb,
    /// The least light beside that of lights.
    pub base: Rgb,
}

impl Shade {
    /// Of pixels that are all alike.
    pub fn even(scene: &Scene, candidate: Candidate, bsdf: &Bsdf) -> Shade {
        let Bsdf { diffuse, specular, ambient, lobe } = *bsdf;
        Shade { candidate, lobe, diffuse, specular, base: scene.ambient * ambient }
    }

    /// Of pixels that are these; `None` if one is not known, or if their highlights differ in more than colour.
    pub fn of(scene: &Scene, candidate: Candidate, mut bsdfs: impl Iterator<Item = Option<Bsdf>>) -> Option<Shade> {
        let mut all = Shade::even(scene, candidate, &bsdfs.next()??);
        for bsdf in bsdfs {
            let shade = Shade::even(scene, candidate, &bsdf?);
            match (all.lobe, shade.lobe) {
                (_, Lobe::None) => {}
                (Lobe::None, lobe) => all.lobe = lobe,
                (one, other) if one == other => {}
                _ => return None,
            }
            all.diffuse = all.diffuse.max(shade.diffuse);
            all.specular = all.specular.max(shade.specular);
            all.base = all.base.min(shade.base);
        }
        Some(all)
    }
}

/// A place where the film's rays meet a shape.
#[derive(Clone, Default)]
struct Node {
    /// Which shape was asked.
    of: Option<Candidate>,
    si: Option<SurfaceInteraction>,
}

/// The places of a cell, and the light there.
pub(crate) struct Field {
    corner: [u32; 2],
    nodes: Vec<Node>,
    /// Light by light: for which of the shades, and what arrives.
    sums: Vec<(u32, Sums)>,
    shades: Vec<Shade>,
    /// Light by light, pixel by pixel of the cell: what arrives, no number where that is not known.
    arrived: Vec<Sums>,
}

/// What is not known.
const UNKNOWN: Sums = Sums { diffuse: f32::NAN, specular: f32::NAN };
/// Of no shade.
const NONE: u32 = u32::MAX;

impl Field {
    pub fn new(lights: usize) -> Self {
        Field {
            corner: [0; 2],
            nodes: vec![Node::default(); ACROSS * ACROSS],
            sums: vec![(NONE, UNKNOWN); lights * ACROSS * ACROSS],
            shades: Vec::new(),
            arrived: vec![UNKNOWN; lights * (CELL * CELL) as usize],
        }
    }

    /// Forgets all, for the cell at `corner`.
    pub fn begin(&mut self, corner: [u32; 2]) {
        self.corner = corner;
        self.nodes.iter_mut().for_each(|node| node.of = None);
        self.sums.fill((NONE, UNKNOWN));
        self.shades.clear();
        self.arrived.fill(UNKNOWN);
    }

    /// What arrives of a light at a pixel of the cell, if that is known.
    pub fn arrived(&self, light: usize, [i, j]: [u32; 2]) -> Option<Sums> {
        let sums = self.arrived[self.place(light, [i, j])];
        (!sums.diffuse.is_nan()).then_some(sums)
    }

    fn place(&self, light: usize, [i, j]: [u32; 2]) -> usize {
        light * (CELL * CELL) as usize + ((j - self.corner[1]) * CELL + i - self.corner[0]) as usize
    }

    /// Finds the light over a square, all of whose pixels see one shape.
    pub fn light<'a>(
        &mut self,
        scene: &'a Scene,
        arrivals: &mut Arrivals<'a>,
        square: Square,
        shade: &Shade,
        counts: &mut Counts,
    ) {
        if square.side < SMALLEST {
            return;
        }
        let id = self.shades.iter().position(|known| known == shade).unwrap_or_else(|| {
            self.shades.push(*shade);
            self.shades.len() - 1
        });
        for light in 0..scene.lights.len() {
            let mut one = OneLight { scene, arrivals, shade, id: id as u32, light, field: self, counts };
            one.square(square);
        }
    }

    /// Which node lies at a corner of pixels.
    fn node(&self, [x, y]: [u32; 2]) -> usize {
        ((y - self.corner[1]) / STEP) as usize * ACROSS + ((x - self.corner[0]) / STEP) as usize
    }

    /// The surface at a node.
    fn surface(&mut self, scene: &Scene, candidate: Candidate, at: [u32; 2]) -> Option<SurfaceInteraction> {
        let node = self.node(at);
        if self.nodes[node].of != Some(candidate) {
            let (ray, differential) = scene.camera.local_ray(at[0] as f32, at[1] as f32, 1.0);
            let hit = candidate.hit(scene, &ray);
            let si = hit.map(|hit| scene.local_surface(&ray, &hit, &differential));
            self.nodes[node] = Node { of: Some(candidate), si };
        }
        self.nodes[node].si
    }

    /// Lays the quadratic through nine sums over the pixels of a square.
    fn fill(&mut self, light: usize, square: Square, nodes: &[[Sums; 3]; 3]) {
        let side = square.side as usize;
        let mut weights = [[0.0f32; 3]; CELL as usize];
        for (i, weights) in weights.iter_mut().enumerate().take(side) {
            let t = (i as f32 + 0.5) / square.side as f32;
            *weights = [(2.0 * t - 1.0) * (t - 1.0), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)];
        }
        let start = self.place(light, [square.x, square.y]);
        for (row, [a, b, c]) in weights[..side].iter().enumerate() {
            let column = |k: usize| {
                let [n, m, s] = [nodes[0][k], nodes[1][k], nodes[2][k]];
                [n.diffuse * a + m.diffuse * b + s.diffuse * c, n.specular * a + m.specular * b + s.specular * c]
            };
            let [w, m, e] = [column(0), column(1), column(2)];
            let line = &mut self.arrived[start + row * CELL as usize..][..side];
            for (sums, [a, b, c]) in line.iter_mut().zip(&weights) {
                sums.diffuse = (w[0] * a + m[0] * b + e[0] * c).max(0.0);
                sums.specular = (w[1] * a + m[1] * b + e[1] * c).max(0.0);
            }
        }
    }
}

/// One light over one square.
struct OneLight<'b, 'a> {
    scene: &'a Scene,
    arrivals: &'b mut Arrivals<'a>,
    shade: &'b Shade,
    id: u32,
    light: usize,
    field: &'b mut Field,
    counts: &'b mut Counts,
}

impl OneLight<'_, '_> {
    fn square(&mut self, square: Square) {
        if !self.at_once(square) && square.side > SMALLEST {
            square.quarters().into_iter().for_each(|quarter| self.square(quarter));
        }
    }

    /// Lights a square from nine places, if that will do.
    fn at_once(&mut self, square: Square) -> bool {
        let Square { x, y, side } = square;
        let half = side / 2;
        let at = |column: u32, row: u32| [x + column * half, y + row * half];
        let candidate = self.shade.candidate;
        let Some(middle) = self.field.surface(self.scene, candidate, at(1, 1)) else { return false };
        let (mut reach, mut turn) = (0.0f32, 0.0f32);
        for corner in [at(0, 0), at(2, 0), at(0, 2), at(2, 2)] {
            let Some(si) = self.field.surface(self.scene, candidate, corner) else { return false };
            reach = reach.max((si.lit_from - middle.lit_from).length());
            turn = turn.max((si.ns - middle.ns).length());
        }
        // The arc, not the chord
        let arrival = self.arrival(&middle, reach * 1.01, turn * 1.05);
        let zero = Sums::default();
        if arrival.skipped {
            return false;
        }
        if arrival.sums == zero && arrival.bend == zero {
            self.field.fill(self.light, square, &[[zero; 3]; 3]);
            return true;
        }
        if !(arrival.resolved && arrival.drift <= WIDE) {
            return false;
        }
        self.keep(at(1, 1), arrival.sums);
        let mut nodes = [[arrival.sums; 3]; 3];
        for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
            let Some(sums) = self.sums(at(column, row)) else { return false };
            nodes[row as usize][column as usize] = sums;
        }
        let shows = match (arrival.sharp, arrival.smooth) {
            (true, _) => SHOWS_SHARP,
            (_, true) => SHOWS_SMOOTH,
            _ => SHOWS,
        };
        if !self.is_foretold(&nodes, shows) {
            return false;
        }
        self.field.fill(self.light, square, &nodes);
        true
    }

    /// Whether the corners foretell the other five.
    fn is_foretold(&self, nodes: &[[Sums; 3]; 3], shows: f32) -> bool {
        let scale = self.arrivals.scale(self.light);
        let [diffuse, specular] = [scale * self.shade.diffuse, scale * self.shade.specular];
        let allowed = shows / (self.scene.lights.len() as f32).sqrt();
        let mean = |a: Sums, b: Sums| Sums {
            diffuse: 0.5 * (a.diffuse + b.diffuse),
            specular: 0.5 * (a.specular + b.specular),
        };
        let [[nw, n, ne], [w, m, e], [sw, s, se]] = *nodes;
        let middle = mean(mean(nw, ne), mean(sw, se));
        let foretold = [(n, mean(nw, ne)), (w, mean(nw, sw)), (m, middle), (e, mean(ne, se)), (s, mean(sw, se))];
        foretold.iter().all(|(is, said)| {
            let value = self.shade.base + diffuse * is.diffuse + specular * is.specular;
            let error = diffuse * (is.diffuse - said.diffuse).abs() + specular * (is.specular - said.specular).abs();
            self.arrivals.steps(value, error) <= allowed
        })
    }

    fn arrival(&mut self, si: &SurfaceInteraction, reach: f32, turn: f32) -> Arrival {
        let scale = self.arrivals.scale(self.light);
        let colors = [scale * self.shade.diffuse, scale * self.shade.specular];
        let parted = reach > 0.0;
        let place = Place { reach, turn, parted, ..Place::point(si, &self.shade.lobe, self.shade.base, colors) };
        self.arrivals.arrival(self.light, &place, self.counts)
    }

    /// What arrives at a node.
    fn sums(&mut self, at: [u32; 2]) -> Option<Sums> {
        let place = self.light * ACROSS * ACROSS + self.field.node(at);
        let (id, sums) = self.field.sums[place];
        if id == self.id {
            return Some(sums);
        }
        let si = self.field.surface(self.scene, self.shade.candidate, at)?;
        let sums = self.arrival(&si, 0.0, 0.0).sums;
        self.keep(at, sums);
        Some(sums)
    }

    fn keep(&mut self, at: [u32; 2], sums: Sums) {
        let place = self.light * ACROSS * ACROSS + self.field.node(at);
        self.field.sums[place] = (self.id, sums);
    }
}
