//! Interpolation of light behind trees over squares of pixels, where penumbrae are wider than pixels.
//!
//! A square that sees one smooth surface is lit in nine pixels, its nodes, at all camera rays of each: its first
//! corner, the three corners that it shares with its neighbours, and the pixels half way. Where bilinear interpolation
//! of the four corners reproduces the other five nodes, and the visible fractions by pilot rays from every pixel agree
//! with it, the other pixels get the biquadratic through the nodes. Elsewhere the square is quartered, down to four
//! pixels.

use std::ops::ControlFlow;

use arrayvec::ArrayVec;

use super::behind::{FragmentLight, NONE};
use super::{CELL, Cells};
use crate::color::Rgb;
use crate::film::tile::Tile;
use crate::ids::LightId;
use crate::integrate::{Emitter, TOLERANCE};
use crate::light::FEW_LIGHTS;
use crate::material::{Moments, ShadingPoint};
use crate::math::{LANES, Vec3};
use crate::render::Counts;
use crate::render::fragment::{Contrast, Fragment};
use crate::render::pooled::Packet;
use crate::render::square::Square;
use crate::visibility::{Viewpoint, Visibility};

/// Pixels across the largest and the smallest squares.
const LARGEST: u32 = 16;
const SMALLEST: u32 = 4;
/// Pilot rays of a pixel: they detect what the nodes miss.
const LOOKING: usize = 16;
/// Pixels across a block, of which those rays go together.
const BLOCK: u32 = 4;
/// A node: the mean of a light over the camera rays of its pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SquareNode {
    sums: Moments,
    share: f32,
}

/// The positions of the nodes along one axis, in pixels from the first of the square.
#[derive(Clone, Copy)]
struct Places([u32; 3]);

impl Places {
    /// Of a square that begins at `from` in a cell that ends there: the last is the next square's first, where there is
    /// one.
    fn new(from: u32, side: u32, end: u32) -> Places {
        Places([0, side / 2, if from + side < end { side } else { side - 1 }])
    }

    /// What each is worth for a pixel, on the parabola through them.
    fn weights(self, at: u32) -> [f32; 3] {
        let ([a, b, c], t) = (self.0.map(|place| place as f32), at as f32);
        [
            (t - b) * (t - c) / ((a - b) * (a - c)),
            (t - a) * (t - c) / ((b - a) * (b - c)),
            (t - a) * (t - b) / ((c - a) * (c - b)),
        ]
    }

    /// What the first and the last make of each, on the line through them.
    fn line(self) -> [[f32; 2]; 3] {
        let t = self.0[1] as f32 / self.0[2] as f32;
        [[1.0, 0.0], [1.0 - t, t], [0.0, 1.0]]
    }
}

/// How far a few rays of each pixel are from what the nine make of it: where it is more than chance explains, for a
/// pixel, a row, a column or all of a square, something lies between the nine.
struct Misses {
    /// Of each row, of each column, and of all: the sum of differences, and of their variances.
    sums: ArrayVec<[f32; 2], { 2 * LARGEST as usize + 1 }>,
    side: usize,
    is_missed: bool,
}

impl Misses {
    fn new(side: u32) -> Misses {
        let side = side as usize;
        Misses { sums: (0..=2 * side).map(|_| [0.0; 2]).collect(), side, is_missed: false }
    }

    /// A pixel that sees a share of a light, as foretold and by its rays; the latter not a number where none say.
    fn add(&mut self, [i, j]: [u32; 2], foretold: f32, seen: f32) {
        if seen.is_nan() {
            return;
        }
        // Of independent points; none of them is sure of what so few do not see
        let one = 1.0 / LOOKING as f32;
        let share = foretold.clamp(one, 1.0 - one);
        let (off, variance) = (seen - foretold, share * (1.0 - share) * one);
        self.is_missed |= Self::is_miss([off, variance]);
        for sum in [i as usize, self.side + j as usize, 2 * self.side] {
            self.sums[sum][0] += off;
            self.sums[sum][1] += variance;
        }
    }

    /// Whether chance does so once in a thousand times at most.
    fn is_miss([off, variance]: [f32; 2]) -> bool {
        off * off > 10.0 * variance
    }

    fn are_there(&self) -> bool {
        self.is_missed || self.sums.iter().copied().any(Self::is_miss)
    }
}

impl Cells<'_> {
    /// Interpolates lights over the squares of the cell.
    pub(super) fn squares(&mut self, counts: &mut Counts, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        let scene = self.scene;
        let [x, y] = self.corner;
        let cell = Square { x, y, side: CELL };
        let mut squares = vec![cell];
        while let Some(square) = squares.pop() {
            if square.side > LARGEST {
                squares.extend(square.quarters_on([scene.width, scene.height]));
                continue;
            }
            let lights: ArrayVec<usize, FEW_LIGHTS> =
                (0..scene.lights.len()).filter(|light| self.lights.is_behind(*light)).collect();
            self.square(square, &lights, counts);
            go_on()?;
        }
        ControlFlow::Continue(())
    }

    /// Interpolates some lights over a square, or over its quarters where the test of the square fails.
    fn square(&mut self, square: Square, lights: &[usize], counts: &mut Counts) {
        let mut left = ArrayVec::<usize, FEW_LIGHTS>::new();
        let is_open = |light: &usize| square.pixels().any(|at| self.is_unknown(at, *light));
        let lights: ArrayVec<usize, FEW_LIGHTS> = lights.iter().copied().filter(is_open).collect();
        if lights.is_empty() {
            return;
        }
        if self.is_smooth(square) {
            let behind: ArrayVec<usize, FEW_LIGHTS> =
                lights.iter().copied().filter(|light| !self.is_clear(square, *light, counts)).collect();
            behind.iter().for_each(|light| self.look_around(square, *light, counts));
            let mut is_told = |light: &usize| {
                !self.is_parted(square, *light)
                    && !self.is_on_border(square, *light)
                    && self.is_foretold(square, *light, counts)
            };
            left.extend(behind.into_iter().filter(|light| !is_told(light)));
        } else {
            left.extend(lights.iter().copied());
        }
        if left.is_empty() || square.side == SMALLEST {
            return;
        }
        for quarter in square.quarters_on([self.scene.width, self.scene.height]) {
            self.square(quarter, &left, counts);
        }
    }

    /// The fragment that fills a pixel of the cell and has all of its rays.
    fn whole(&self, at: [u32; 2]) -> Option<(usize, &Fragment)> {
        let [x, y] = self.corner;
        if !(Tile { x, y, width: CELL, height: CELL }).contains(at) {
            return None;
        }
        match self.behind.only[self.index(at)] {
            NONE => None,
            number => Some((number as usize, &self.fragments.all[number as usize])),
        }
    }

    /// Whether nothing is known of what a pixel's only fragment sees of a light.
    fn is_unknown(&self, at: [u32; 2], light: usize) -> bool {
        self.whole(at).is_some_and(|(number, _)| {
            matches!(self.fragment_light(number, light), FragmentLight::Seen(Visibility::Partial))
        })
    }

    /// The middle between two opposite rays of a pixel that is filled.
    fn standing(&self, at: [u32; 2]) -> Option<ShadingPoint> {
        let (_, fragment) = self.whole(at)?;
        let [one, other] = [0, fragment.rays.len() - 1].map(|k| self.fragments.place(self.scene, fragment, k));
        let mean = |a: Vec3, b: Vec3| (a + b) * 0.5;
        let mut place = one;
        place.p = mean(one.p, other.p);
        place.ns = mean(one.ns, other.ns).normalize_or_zero();
        place.ng = mean(one.ng, other.ng).normalize_or_zero();
        Some(place)
    }

    /// Whether one smooth surface fills all pixels of a square, and its nodes beside it.
    fn is_smooth(&self, square: Square) -> bool {
        let Square { x, y, side } = square;
        if x + side > self.scene.width || y + side > self.scene.height {
            return false;
        }
        let at = |i: u32, j: u32| self.standing([x + i, y + j]);
        let Some(middle) = at(side / 2, side / 2) else { return false };
        let is_like = |place: &ShadingPoint| middle.surface == place.surface && middle.bsdf.lobe == place.bsdf.lobe;
        // With the first of what lies beside it
        let across = side + 1;
        let mut normals = Vec::with_capacity((across * across) as usize);
        let [columns, rows] = self.places(square);
        for (j, i) in (0..across).flat_map(|j| (0..across).map(move |i| (j, i))) {
            let is_asked = columns.0.contains(&i) && rows.0.contains(&j);
            if (i == side || j == side) && !is_asked {
                normals.push(Vec3::ZERO);
                continue;
            }
            match at(i, j) {
                Some(place) if is_like(&place) => normals.push(place.ns),
                _ => return false,
            }
        }
        let normal = |i: u32, j: u32| normals[(j * across + i) as usize];
        let nodes = rows.0.map(|j| columns.0.map(|i| normal(i, j)));
        (0..side).all(|j| {
            let down = rows.weights(j);
            (0..side).all(|i| {
                let mut foretold = Vec3::ZERO;
                for (row, down) in nodes.iter().zip(down) {
                    for (n, across) in row.iter().zip(columns.weights(i)) {
                        foretold += *n * (across * down);
                    }
                }
                (foretold - normal(i, j)).length() <= TOLERANCE.even
            })
        })
    }

    /// The columns and rows of a square that have nodes.
    fn places(&self, Square { x, y, side }: Square) -> [Places; 2] {
        let end = |axis: usize| (self.corner[axis] + CELL).min([self.scene.width, self.scene.height][axis]);
        [Places::new(x, side, end(0)), Places::new(y, side, end(1))]
    }

    /// Whether nothing in trees is in the way of a light from a square, which is noted, or it does not shine there.
    fn is_clear(&mut self, square: Square, light: usize, counts: &mut Counts) -> bool {
        let scene = self.scene;
        let Some((_, fragment)) = self.whole([square.x, square.y]) else { return true };
        let lights = scene.geometry.lights_of(fragment.surface);
        let receives_shadow = scene.geometry.surfaces[fragment.surface.index()].receives_shadow;
        if !scene.geometry.links.contains(lights, LightId(light as u32)) || !receives_shadow {
            return true;
        }
        let mut points = std::mem::take(&mut self.behind.points);
        self.viewpoints(square, &mut points);
        let visibility = self.lights.gather_for(light, &points, counts);
        self.behind.points = points;
        if visibility == Visibility::Partial {
            return false;
        }
        for at in square.pixels() {
            self.note_at(at, light, FragmentLight::Seen(visibility));
        }
        true
    }

    /// Whether the plane or the surface of a light passes through a square and its nodes, so that they may pass the
    /// bilinear test by chance.
    fn is_parted(&self, square: Square, light: usize) -> bool {
        let [columns, rows] = self.places(square);
        let nodes = rows.0.iter().flat_map(|j| columns.0.map(|i| [square.x + i, square.y + j]));
        let fragments = nodes.chain(square.pixels()).filter_map(|at| self.whole(at));
        let places = fragments.flat_map(|(_, fragment)| {
            (0..fragment.rays.len()).map(|k| self.fragments.place(self.scene, fragment, k).p)
        });
        self.lights.lights.emitters[light].is_some_and(|emitter| emitter.parts(places))
    }

    /// Where the rays of a square end, pixel by pixel.
    fn viewpoints(&self, square: Square, points: &mut Vec<Viewpoint>) {
        points.clear();
        for at in square.pixels() {
            if let Some((_, fragment)) = self.whole(at) {
                let rays = 0..fragment.rays.len();
                points.extend(rays.map(|k| Viewpoint::of(&self.fragments.place(self.scene, fragment, k))));
            }
        }
    }

    /// Notes what a pixel's only fragment sees of a light, if that is not known.
    fn note_at(&mut self, at: [u32; 2], light: usize, known: FragmentLight) {
        if let Some((number, _)) = self.whole(at) {
            self.note(number, light, known);
        }
    }

    /// Finds out which share of a light each pixel of a square sees, and those around it in the cell, by a few of its
    /// rays.
    fn look_around(&mut self, square: Square, light: usize, counts: &mut Counts) {
        let blocks = |axis: usize| {
            let (from, start) = ([square.x, square.y][axis], self.corner[axis]);
            let first = from.saturating_sub(1).max(start) / BLOCK;
            first..((from + square.side).min(start + CELL - 1) / BLOCK + 1)
        };
        for (j, i) in blocks(1).flat_map(|j| blocks(0).map(move |i| (j, i))).collect::<ArrayVec<_, 64>>() {
            let at = [i * BLOCK, j * BLOCK];
            let known = self.index(at) * self.scene.lights.len() + light;
            if !self.behind.voted[known] {
                self.behind.voted[known] = true;
                self.vote(at, light, counts);
            }
        }
    }

    /// Asks a few rays of each pixel of a block for a light: every pixel a point of one cell of the light after the
    /// other.
    fn vote(&mut self, [x, y]: [u32; 2], light: usize, counts: &mut Counts) {
        let scene = self.scene;
        let sampler = self.lights.sampler(light);
        let at = |inner: usize| [x + inner as u32 % BLOCK, y + inner as u32 / BLOCK];
        let pixels: [Option<(usize, &Fragment)>; LANES] = std::array::from_fn(|inner| self.whole(at(inner)));
        let mut packet: Option<Packet> = None;
        let mut asked = [[0u32; 2]; LANES];
        for cell in 0..LOOKING {
            for (inner, pixel) in pixels.iter().enumerate() {
                let Some((_, fragment)) = pixel else { continue };
                // Each ray once, if there are as many
                let turn = (at(inner)[0] * 7 + at(inner)[1] * 3) as usize % LOOKING;
                let ray = (cell ^ turn) % fragment.rays.len();
                let point = Viewpoint::of(&self.fragments.place(scene, fragment, ray));
                let l = sampler.point(inner, LOOKING, cell) - point.p;
                if point.horizon.dot(l) > 0.0 && point.ns.dot(l) > 0.0 {
                    asked[inner][0] += 1;
                    if scene.occluded_by_lists(&point.ray(sampler.end(), l, true)) {
                        asked[inner][1] += 1;
                    } else {
                        let packet = packet.get_or_insert_with(|| Packet::new(sampler.end(), &point));
                        packet.add((inner * LOOKING + cell) as u32, &point, l, inner as u32);
                    }
                }
            }
            if let Some(packet) = &mut packet {
                counts.visibility.traced += packet.trace(scene, |_, inner| asked[inner as usize][1] += 1);
            }
        }
        for (inner, [asked, hidden]) in asked.into_iter().enumerate() {
            let index = self.index(at(inner));
            self.behind.votes[index * scene.lights.len() + light] = (asked - hidden) as f32 / asked as f32;
        }
    }

    /// Whether the border of a penumbra runs through a square: pixels around which all rays see a light, or none does,
    /// and others.
    fn is_on_border(&self, square: Square, light: usize) -> bool {
        let vote = |at: [u32; 2]| self.behind.votes[self.index(at) * self.scene.lights.len() + light];
        let [x, y] = self.corner;
        let cell = Tile { x, y, width: CELL, height: CELL };
        let inside = |at: [u32; 2]| cell.contains(at) && self.whole(at).is_some();
        let mut kinds = [false; 3];
        for [i, j] in square.pixels() {
            let around = (0..9).map(|k| [(i + k % 3).wrapping_sub(1), (j + k / 3).wrapping_sub(1)]);
            let (mut lit, mut dark) = (true, true);
            for share in around.filter(|at| inside(*at)).map(vote).filter(|share| !share.is_nan()) {
                (lit, dark) = (lit && share == 1.0, dark && share == 0.0);
            }
            kinds[if lit { 0 } else { 1 + usize::from(dark) }] = true;
        }
        kinds.into_iter().filter(|kind| *kind).count() > 1
    }

    /// The visible fraction of a light from a fragment, by the pilot rays of its pixel; not a number without those.
    pub(super) fn share_seen(&self, fragment: usize, light: usize) -> f32 {
        let index = self.pixels[self.fragments.all[fragment].pixel as usize].index as usize;
        if self.behind.only[index] != fragment as u32 {
            return f32::NAN;
        }
        self.behind.votes[index * self.scene.lights.len() + light]
    }

    /// Whether the nodes of a square pass the bilinear test, and the pilot rays of its pixels agree with them; then the
    /// interpolated light of all its pixels is stored.
    fn is_foretold(&mut self, square: Square, light: usize, counts: &mut Counts) -> bool {
        let Square { x, y, side } = square;
        let rays = (self.scene.antialiasing * self.scene.antialiasing) as f32;
        let mut nodes = [[SquareNode::default(); 3]; 3];
        let [columns, rows] = self.places(square);
        for (row, j) in nodes.iter_mut().zip(rows.0) {
            for (node, i) in row.iter_mut().zip(columns.0) {
                *node = self.node([x + i, y + j], light, counts);
            }
        }
        // Where nothing is in the way, each pixel has its closed form
        let vote = |at: [u32; 2]| self.behind.votes[self.index(at) * self.scene.lights.len() + light];
        if nodes.as_flattened().iter().all(|node| node.share == 1.0) && square.pixels().all(|at| vote(at) == 1.0) {
            for at in square.pixels() {
                self.note_at(at, light, FragmentLight::Seen(Visibility::Listed));
            }
            return true;
        }
        if nodes.as_flattened().iter().any(|node| node.share.is_nan()) {
            return false;
        }
        let wide = (side / SMALLEST) as f32;
        // Where a light sets in between them it bends at once
        let sets_in = nodes.as_flattened().iter().any(|node| node.sums == Moments::default());
        let allowed = if sets_in { TOLERANCE.foretold * TOLERANCE.bends_at_once } else { TOLERANCE.foretold };
        let foretold_to = allowed / (wide * (self.scene.lights.len() as f32).sqrt());
        // What the corners foretell
        for ((row, j), down) in nodes.iter().zip(rows.0).zip(rows.line()) {
            for ((node, i), across) in row.iter().zip(columns.0).zip(columns.line()) {
                let mut foretold = Moments::default();
                for (corners, down) in [nodes[0], nodes[2]].iter().zip(down) {
                    for (corner, across) in [corners[0], corners[2]].iter().zip(across) {
                        foretold += corner.sums * (across * down);
                    }
                }
                let off = foretold.apart(node.sums);
                if self.steps_of([x + i, y + j], light, &node.sums, &off, counts) > foretold_to {
                    return false;
                }
            }
        }
        // What the others see
        let mut told = [Moments::default(); (LARGEST * LARGEST) as usize];
        let mut misses = Misses::new(side);
        // Of a ball that shines on one side, rays see points that do not shine to them
        let emitter = &self.lights.lights.emitters[light];
        let is_telling = !matches!(emitter, Some(Emitter::Ball { both_sides: false, .. }));
        for (number, told) in told.iter_mut().enumerate().take((side * side) as usize) {
            let [i, j] = [number as u32 % side, number as u32 / side];
            let [across, down] = [columns.weights(i), rows.weights(j)];
            let (mut sums, mut share) = (Moments::default(), 0.0);
            for (row, down) in nodes.iter().zip(down) {
                for (node, across) in row.iter().zip(across) {
                    sums += node.sums * (across * down);
                    share += node.share * (across * down);
                }
            }
            *told = sums.at_least_0();
            let seen = self.behind.votes[self.index([x + i, y + j]) * self.scene.lights.len() + light];
            if is_telling {
                misses.add([i, j], share, seen);
            }
        }
        if misses.are_there() {
            return false;
        }
        for (at, sums) in square.pixels().zip(told) {
            let Some((fragment, of)) = self.whole(at) else { continue };
            if matches!(self.fragment_light(fragment, light), FragmentLight::Summed(_) | FragmentLight::Done) {
                continue;
            }
            // Of two colours that meet different light the mean is no product of means
            if of.contrast != Contrast::default() {
                let number = ((at[1] - y) * side + at[0] - x) as usize;
                let beside =
                    |step: usize, place: u32| told[if place + 1 < side { number + step } else { number - step }];
                let mut slope = Moments::default();
                for other in [beside(1, at[0] - x), beside(side as usize, at[1] - y)] {
                    slope += other.apart(sums);
                }
                let mingled = of.contrast.of(&slope) * 0.125;
                let scale = self.lights.scale(light);
                let value = scale * of.bsdf.colors.of(&sums);
                if self.lights.steps(value, scale * mingled) > TOLERANCE.mingled {
                    continue;
                }
            }
            let all = sums * rays;
            let terms = of.bsdf.colors.each(&all);
            self.note(fragment, light, FragmentLight::Summed(terms));
        }
        true
    }

    /// What a pixel sees of a light by all of its rays.
    fn node(&mut self, at: [u32; 2], light: usize, counts: &mut Counts) -> SquareNode {
        let index = self.index(at);
        let rays = (self.scene.antialiasing * self.scene.antialiasing) as f32;
        let known = self.behind.nodes.iter().find(|(of, by, _)| (*of, *by) == (index, light)).map(|(_, _, node)| *node);
        if let Some(node) = known {
            return node;
        }
        let Some((fragment, _)) = self.whole(at) else { unreachable!("smooth squares are filled") };
        let pooled = self.settled(fragment, light, counts);
        self.note(fragment, light, FragmentLight::Summed(pooled.terms));
        let node = SquareNode { sums: pooled.moments * (1.0 / rays), share: pooled.visible_fraction };
        self.behind.nodes.push((index, light, node));
        node
    }

    /// How many display steps an error makes of what a light sends to a pixel.
    fn steps_of(&mut self, at: [u32; 2], light: usize, sums: &Moments, error: &Moments, counts: &mut Counts) -> f32 {
        let Some((fragment, bsdf)) = self.whole(at).map(|(number, of)| (number, of.bsdf)) else { return f32::INFINITY };
        let scale = self.lights.scale(light);
        let color = |sums: &Moments| scale * bsdf.colors.of(sums);
        let others = self.others(fragment, light, counts);
        let value: Rgb = bsdf.base(self.scene.ambient) + others + color(sums);
        self.lights.steps(value, color(error))
    }
}
