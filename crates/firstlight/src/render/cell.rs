//! The renderer that pictures are made with. A cell of 32 x 32 pixels goes through its stations as a whole:
//!
//! ```text
//! primary    squares of pixels that are proved to see one surface; the rays of all others
//! grid       light over such squares, from nine places of each: 16, 8, 4, 2 pixels wide
//! behind     what rays see of the lights past what lies in trees, and light over squares of pixels behind that
//! middles    what a surface in a pixel gets of a light, from its middle
//! quadrants  the same, from four places of it
//! rays       the same, from all of its camera rays; lights without a closed form there are sampled for all of them
//! resolve    the pixel's sum, once
//! ```
//!
//! Each station has [`DirectLighting`] estimate all of its shading points in one call. Pixels whose error estimate is
//! too large go on to the next station.
//! Where lights are many, [`Many`] stands for all stations after the first. Cells lie on a grid of the film and are
//! always rendered whole, so no decision depends on tiles, crops or threads.

mod behind;
mod primary;
mod squares;

use std::iter;
use std::ops::{ControlFlow, Range};

use super::Counts;
use super::direct::{DirectLighting, LightEstimate, LightQuery};
use super::fragment::{Contrast, Fragment, Fragments, Member, Quadrant, RayHit};
use super::grid::{Block, Grid};
use super::many::Many;
use super::pooled::{PooledVisibility, salt};
use super::solo::{self, Candidate};
use super::square::Square;
use crate::color::Rgb;
use crate::film::FilmTile;
use crate::film::hits::{PixelHits, PixelRays};
use crate::film::resolve::{LightTerm, PixelTerms, ScaledTerm, Term, TermSums};
use crate::film::tile::Tile;
use crate::film::{AaMode, Heat};
use crate::image::Buffer;
use crate::integrate::TOLERANCE;
use crate::material::{Bsdf, MOMENTS, Moments, ShadingPoint};
use crate::scene::Scene;
use crate::visibility::Visibility;
use behind::Behind;

/// The number of pairs of a fragment and a light whose camera rays are estimated in one call.
const AT_ONCE: usize = 8;
/// Pixels across a cell.
pub(crate) const CELL: u32 = 32;
const PIXELS: usize = (CELL * CELL) as usize;
/// Lists of candidates: of the cell, its quarters, their quarters, down to one pixel.
const DEPTHS: usize = CELL.ilog2() as usize + 2;

/// What is known of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PixelState {
    /// Its colour is summed, or the film does not have it.
    Done,
    /// It is in this of the blocks.
    Block(u32),
    /// All of its rays meet this shape.
    Only(Candidate),
    /// Its rays were traced.
    Traced,
}

/// A pixel whose rays were traced, and what it sees beside fragments.
#[derive(Clone, Copy, Debug, Default)]
struct Pixel {
    /// Its number in the cell.
    index: u32,
    terms: PixelTerms,
}

/// A fragment and a light whose contribution is not known yet.
#[derive(Clone, Copy, Debug)]
struct Wanted {
    fragment: u32,
    light: u32,
    visibility: Visibility,
    /// Whether each camera ray needs its own estimate: no shading point represents several of them.
    is_parted: bool,
}

impl Wanted {
    fn new(fragment: u32, light: u32) -> Wanted {
        Wanted { fragment, light, visibility: Visibility::Partial, is_parted: false }
    }
}

/// One thread's way from tiles to film.
pub(crate) struct Cells<'a> {
    scene: &'a Scene,
    mode: AaMode,
    lights: DirectLighting<'a>,
    /// All that can be seen, and what squares may see of it.
    listed: Vec<Candidate>,
    near: [Vec<Candidate>; DEPTHS],
    corner: [u32; 2],
    /// Pixel by pixel of the cell.
    states: Vec<PixelState>,
    sums: TermSums,
    blocks: Vec<Block>,
    /// The materials of blocks whose pixels differ, pixel by pixel.
    patchwork: Vec<(Option<Bsdf>, Contrast)>,
    /// Those whose rays were traced, and their sums: light by light, diffuse and specular, of so few lights; none where
    /// they are many.
    pixels: Vec<Pixel>,
    terms: Vec<LightTerm>,
    few: usize,
    grid: Grid,
    places: Vec<ShadingPoint>,
    requests: Vec<LightQuery>,
    answers: Vec<LightEstimate>,
    fragments: Fragments,
    pixel_rays: PixelRays,
    hits: PixelHits,
    /// The rays of one pixel, each with what it meets: a candidate by its number, or something in trees.
    rays: Vec<(u32, RayHit)>,
    seen: Vec<Member>,
    shapes: Vec<Candidate>,
    /// The pairs of a fragment and a light to be estimated by middles, by quadrants and by rays.
    wanted: Vec<Wanted>,
    parted: Vec<Wanted>,
    refused: Vec<Wanted>,
    /// The number of lights that are estimated at the camera rays of each fragment.
    asked: Vec<usize>,
    behind: Behind,
    /// What arrives where lights are many, in place of the stations after the first.
    many: Option<Many<'a>>,
}

impl<'a> Cells<'a> {
    pub fn new(scene: &'a Scene, mode: AaMode, lights: DirectLighting<'a>, buffers: &[Buffer]) -> Self {
        let pixel_rays = PixelRays::new(lights.level(), scene.antialiasing);
        let hits = PixelHits::new(lights.level(), scene.antialiasing);
        let many = lights.tree().map(|tree| Many::new(scene, tree, buffers));
        let few = if many.is_some() { 0 } else { scene.lights.len() };
        Cells {
            scene,
            mode,
            lights,
            listed: solo::all(scene),
            near: Default::default(),
            corner: [0; 2],
            states: vec![PixelState::Done; PIXELS],
            sums: TermSums::new(scene, PIXELS, buffers),
            blocks: Vec::new(),
            patchwork: Vec::new(),
            pixels: Vec::new(),
            terms: Vec::new(),
            few,
            grid: Grid::new(few),
            places: Vec::new(),
            requests: Vec::new(),
            answers: Vec::new(),
            fragments: Fragments::new(scene, many.is_some()),
            pixel_rays,
            hits,
            rays: Vec::new(),
            seen: Vec::new(),
            shapes: Vec::new(),
            wanted: Vec::new(),
            parted: Vec::new(),
            refused: Vec::new(),
            asked: Vec::new(),
            behind: Behind::new(scene, few),
            many,
        }
    }

    /// Renders one tile. It calls `go_on` between the stations of a cell, and stops where that breaks.
    pub fn render(&mut self, film: &mut FilmTile, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<(), Counts> {
        let mut counts = Counts::default();
        for part in film.tile.parts(CELL, CELL) {
            go_on()?;
            self.cell([part.x, part.y].map(|at| at / CELL * CELL), &mut counts, go_on)?;
            self.deliver(part, film, &mut counts);
        }
        ControlFlow::Continue(counts)
    }

    /// Renders a cell.
    fn cell(&mut self, corner: [u32; 2], counts: &mut Counts, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        self.begin(corner);
        self.primary(counts);
        go_on()?;
        if let Some(mut many) = self.many.take() {
            let lit = self.many(&mut many, counts, go_on);
            self.many = Some(many);
            return lit;
        }
        self.grid.light(self.scene, &mut self.lights, &self.blocks, counts, go_on)?;
        self.sums.work.iter_mut().zip(self.grid.work()).for_each(|(work, more)| *work += more);
        self.fragments(counts);
        self.behind(counts, go_on)?;
        self.middles(counts, go_on)?;
        self.quadrants(counts, go_on)?;
        self.rays(counts, go_on)?;
        self.resolve();
        ControlFlow::Continue(())
    }

    fn begin(&mut self, corner: [u32; 2]) {
        self.corner = corner;
        self.states.fill(PixelState::Done);
        self.sums.work.fill(0.0);
        self.blocks.clear();
        self.patchwork.clear();
        self.pixels.clear();
        self.terms.clear();
        self.grid.begin(corner);
        self.fragments.clear();
        self.wanted.clear();
        self.parted.clear();
        self.refused.clear();
    }

    fn index(&self, [i, j]: [u32; 2]) -> usize {
        ((j - self.corner[1]) * CELL + i - self.corner[0]) as usize
    }

    /// Lights the fragments of a scene with many lights.
    fn many(
        &mut self,
        many: &mut Many<'a>,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let scene = self.scene;
        let [x, y] = self.corner;
        let size = [(scene.width - x).min(CELL), (scene.height - y).min(CELL)];
        for at in (Square { x, y, side: CELL }).pixels().filter(|[i, j]| *i < scene.width && *j < scene.height) {
            let index = self.index(at);
            if let PixelState::Only(only) = self.states[index] {
                self.trace(at, &[only], counts);
            }
        }
        self.add_ambient();
        let Cells { fragments, pixels, sums, lights, .. } = self;
        for Pixel { index, terms } in pixels.iter() {
            terms.resolve(scene, iter::empty(), *index as usize, sums);
        }
        let pixel = |fragment: usize| &pixels[fragments.all[fragment].pixel as usize];
        many.begin(fragments, size, |fragment| pixel(fragment).index);
        many.light(fragments, lights, counts, go_on, |fragment, [sent, apart], took| {
            let Pixel { index, terms } = *pixel(fragment);
            terms.resolve(scene, sent.iter().copied(), index as usize, sums);
            PixelTerms::keep_apart(scene, apart, index as usize, sums);
            sums.work[index as usize] += took;
        })
    }

    /// Makes fragments of the pixels that the grid does not light, and queues their lights.
    fn fragments(&mut self, counts: &mut Counts) {
        let scene = self.scene;
        let [x, y] = self.corner;
        let lights = 0..scene.lights.len() as u32;
        // Fragments of traced pixels have no light from the grid
        for fragment in 0..self.fragments.all.len() as u32 {
            self.wanted.extend(lights.clone().map(|light| Wanted::new(fragment, light)));
        }
        for block in 0..self.blocks.len() {
            let block = self.blocks[block];
            if block.first.is_none() {
                self.tell(&block);
            }
        }
        for at in (Square { x, y, side: CELL }).pixels().filter(|[i, j]| *i < scene.width && *j < scene.height) {
            let index = self.index(at);
            let (only, even) = match self.states[index] {
                PixelState::Done | PixelState::Traced => continue,
                PixelState::Only(only) => (only, None),
                PixelState::Block(block) => {
                    let Block { square, of, bsdf, first } = self.blocks[block as usize];
                    if first.is_some_and(|first| self.is_told(at, square, first)) {
                        continue;
                    }
                    (of, first.is_none().then_some(bsdf))
                }
            };
            let fragment = self.fragments.all.len();
            let number = self.pixels.len() as u32;
            match even {
                Some(bsdf) if self.fragments.add_whole(scene, number, at, only, bsdf) => {
                    let pixel = self.pixel(at, QUADRANTS, counts);
                    self.pixels.push(pixel);
                }
                _ => self.trace(at, &[only], counts),
            }
            if fragment == self.fragments.all.len() {
                continue;
            }
            let is_even = !self.fragments.all[fragment].is_textured;
            for light in lights.clone() {
                match self.grid.arrived(light as usize, at).filter(|_| is_even) {
                    Some(sums) => self.add(fragment, light as usize, sums),
                    None => self.parted.push(Wanted::new(fragment as u32, light)),
                }
            }
        }
    }

    /// Sums the pixels of a block of one material; those that need nothing beside the grid are done.
    fn tell(&mut self, block: &Block) {
        let scene = self.scene;
        let Square { x, y, side } = block.square;
        let columns = side.min(scene.width - x) as usize;
        for j in y..(y + side).min(scene.height) {
            let first = self.index([x, j]);
            let mut told = [true; CELL as usize];
            self.sums.begin(first..first + columns, Rgb::BLACK, 1.0);
            let ambient = iter::repeat_n(block.bsdf.base(scene.ambient), columns);
            self.sums.add(first, Term::Ambient, Rgb::WHITE, ambient);
            for light in 0..scene.lights.len() {
                let scale = self.lights.scale(light);
                let row = self.grid.row(light, [x, j], columns);
                told.iter_mut().zip(row).for_each(|(told, arrived)| *told &= arrived.is_known());
                for moment in 0..MOMENTS {
                    let part = |arrived: &Moments| block.bsdf.colors.each(arrived).0[moment];
                    self.sums.add(first, Term::Light(Some(light as u32), moment), scale, row.iter().map(part));
                }
            }
            for k in (0..columns).filter(|k| told[*k]) {
                self.states[first + k] = PixelState::Done;
            }
        }
    }

    /// Whether a pixel of a block whose materials differ, the first of which has that number, needs nothing beside the
    /// grid; it is summed as far as that is known.
    fn is_told(&mut self, at: [u32; 2], square: Square, first: usize) -> bool {
        let scene = self.scene;
        let index = self.index(at);
        let Square { x, y, side } = square;
        let (bsdf, contrast) = self.patchwork[first + ((at[1] - y) * side + at[0] - x) as usize];
        let Some(bsdf) = bsdf else { return false };
        self.sums.begin(index..index + 1, Rgb::BLACK, 1.0);
        self.sums.add(index, Term::Ambient, Rgb::WHITE, iter::once(bsdf.base(scene.ambient)));
        let mut slopes = Rgb::BLACK;
        for light in 0..scene.lights.len() {
            let Some(arrived) = self.grid.arrived(light, at) else { return false };
            let scale = self.lights.scale(light);
            for (moment, part) in bsdf.colors.each(&arrived).0.into_iter().enumerate() {
                self.sums.add(index, Term::Light(Some(light as u32), moment), scale, iter::once(part));
            }
            if contrast != Contrast::default() {
                let Some(slope) = self.grid.slope(light, at, square) else { return false };
                slopes += scale * contrast.of(&slope) * 0.125;
            }
        }
        if contrast != Contrast::default() && self.lights.steps(self.sums.color(index), slopes) > TOLERANCE.mingled {
            return false;
        }
        self.states[index] = PixelState::Done;
        true
    }

    /// Adds what arrives of a light all over a fragment.
    fn add(&mut self, fragment: usize, light: usize, sums: Moments) {
        let fragment = &self.fragments.all[fragment];
        let sums = sums * fragment.count() as f32;
        let term = &mut self.terms[fragment.pixel as usize * self.scene.lights.len() + light];
        *term += fragment.bsdf.colors.each(&sums);
    }

    /// Where a pixel of the cell is on the film.
    fn at(&self, index: usize) -> [u32; 2] {
        [self.corner[0] + index as u32 % CELL, self.corner[1] + index as u32 / CELL]
    }

    /// Asks for the light of fragments, from their middles.
    fn middles(&mut self, counts: &mut Counts, go_on: &dyn Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        let wanted = std::mem::take(&mut self.wanted);
        let middle = |wanted: &Wanted, fragments: &Fragments| fragments.all[wanted.fragment as usize].middle;
        self.requests.clear();
        for wanted in &wanted {
            let Wanted { light, visibility, .. } = *wanted;
            self.requests.extend(middle(wanted, &self.fragments).map(|point| LightQuery { point, light, visibility }));
        }
        self.lights.estimate(&self.fragments.places, &self.requests, &mut self.answers, counts, go_on)?;
        let mut next = 0;
        for wanted in &wanted {
            let Wanted { fragment, light, .. } = *wanted;
            if middle(wanted, &self.fragments).is_none() {
                self.parted.push(*wanted);
                continue;
            }
            let answer = self.answers[next];
            next += 1;
            let Fragment { pixel, count, .. } = self.fragments.all[fragment as usize];
            self.sums.work[self.pixels[pixel as usize].index as usize] += Heat::PLACE;
            let is_dark = answer.moments == Moments::default();
            let is_known = answer.moments.is_known();
            if is_known
                && (count == 1 || answer.is_uniform && (is_dark || self.is_nearly_even(fragment, light, &answer)))
            {
                self.add(fragment as usize, light as usize, answer.moments);
            } else {
                let is_parted = !is_known && !self.lights.is_integrated(light as usize);
                self.parted.push(Wanted { visibility: answer.visibility, is_parted, ..*wanted });
            }
        }
        self.wanted = wanted;
        ControlFlow::Continue(())
    }

    /// Asks for the light of fragments, from the middles of their quadrants.
    fn quadrants(&mut self, counts: &mut Counts, go_on: &dyn Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        let scene = self.scene;
        let wanted = std::mem::take(&mut self.parted);
        self.requests.clear();
        for Wanted { fragment, light, visibility, .. } in wanted.iter().copied().filter(|wanted| !wanted.is_parted) {
            let pixel = self.fragments.all[fragment as usize].pixel;
            let at = self.at(self.pixels[pixel as usize].index as usize);
            self.fragments.find_quadrants(scene, fragment as usize, at);
            let quadrants = self.fragments.quadrants(&self.fragments.all[fragment as usize]);
            self.requests.extend(quadrants.iter().map(|q| LightQuery { point: q.place, light, visibility }));
        }
        let fragments = &self.fragments;
        self.lights.estimate(&fragments.places, &self.requests, &mut self.answers, counts, go_on)?;
        let mut next = 0;
        for wanted in &wanted {
            if wanted.is_parted {
                self.refused.push(*wanted);
                continue;
            }
            let fragment = &fragments.all[wanted.fragment as usize];
            let quadrants = fragments.quadrants(fragment);
            let answers = &self.answers[next..next + quadrants.len()];
            next += answers.len();
            self.sums.work[self.pixels[fragment.pixel as usize].index as usize] += Heat::PLACE * answers.len() as f32;
            if answers.is_empty() || !self.is_even(fragment, wanted.light as usize, answers) {
                self.refused.push(*wanted);
                continue;
            }
            let term = &mut self.terms[fragment.pixel as usize * scene.lights.len() + wanted.light as usize];
            for (quadrant, answer) in quadrants.iter().zip(answers) {
                let (sums, bsdf) =
                    (answer.moments * quadrant.rays as f32, &fragments.places[quadrant.place as usize].bsdf);
                *term += bsdf.colors.each(&sums);
            }
        }
        self.parted = wanted;
        ControlFlow::Continue(())
    }

    /// Whether the middle of a fragment stands for all of it: what it sees of a light changes but by what that turns.
    fn is_nearly_even(&self, fragment: u32, light: u32, answer: &LightEstimate) -> bool {
        let fragment = &self.fragments.all[fragment as usize];
        answer.turn <= TOLERANCE.middle_turn
            && self.bend(fragment, light as usize, answer, answer.turned()) <= TOLERANCE.middle_bend
    }

    /// In display steps: by how much such a part of all that a light could send may bend it within the reach of a place
    /// of a fragment.
    fn bend(&self, fragment: &Fragment, light: usize, answer: &LightEstimate, part: f32) -> f32 {
        let bend = part * answer.most;
        let bsdf = &fragment.bsdf;
        let colors = self.lights.scale(light) * bsdf.colors;
        let value = colors.onto(bsdf.base(self.scene.ambient), &answer.moments);
        self.lights.steps(value, colors.of(&Moments::bounds(bend, bend)))
    }

    /// Whether a light is even enough over the quadrants of a fragment.
    fn is_even(&self, fragment: &Fragment, light: usize, answers: &[LightEstimate]) -> bool {
        let scene = self.scene;
        if answers.iter().any(|answer| answer.motion > TOLERANCE.motion || answer.turn == f32::INFINITY) {
            return false;
        }
        let bends = |answer: &LightEstimate| {
            let part =
                if answer.moments == Moments::default() { answer.kink() } else { answer.turned() + answer.kink() };
            self.bend(fragment, light, answer, part) * fragment.share > TOLERANCE.quadrant_bend
        };
        if answers.iter().any(bends) {
            return false;
        }
        let scale = self.lights.scale(light);
        let (mut least, mut most) = (answers[0].moments, answers[0].moments);
        for answer in answers {
            (least, most) = (least.min(answer.moments), most.max(answer.moments));
        }
        // Between places that see nothing a light can come in
        if most.cosine() == 0.0 && !answers.iter().all(|answer| answer.is_uniform) {
            return false;
        }
        let apart = most + least * -1.0;
        let bsdf = &fragment.bsdf;
        let colors = scale * bsdf.colors;
        let value = colors.onto(bsdf.base(scene.ambient), &most);
        let spread = self.lights.steps(value, colors.of(&apart));
        let sets_in = answers.iter().any(|answer| answer.moments == Moments::default());
        let allowed = if sets_in { TOLERANCE.spread * TOLERANCE.bends_at_once } else { TOLERANCE.spread };
        let weight = fragment.share * (scene.lights.len() as f32).sqrt();
        if spread * weight > allowed {
            return false;
        }
        // Fewer than four quadrants do not show how light varies along both axes
        self.fragments.quadrants(fragment).iter().all(|Quadrant { contrast, .. }| {
            let mingled = contrast.of(&apart);
            *contrast == Contrast::default()
                || answers.len() == 4 && self.lights.steps(value, scale * mingled * 0.125) * weight <= TOLERANCE.mingled
        })
    }

    /// Asks for the light of fragments at each of their rays.
    fn rays(&mut self, counts: &mut Counts, go_on: &dyn Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        let refused = std::mem::take(&mut self.refused);
        self.asked.clear();
        self.asked.resize(self.fragments.all.len(), 0);
        for Wanted { fragment, light, .. } in &refused {
            self.asked[*fragment as usize] += usize::from(self.lights.is_integrated(*light as usize));
        }
        if self.scene.geometry.has_boxes() {
            for fragment in 0..self.fragments.all.len() {
                self.asked[fragment] += self.count_settled(fragment);
            }
        }
        // A few at a time: each call holds the shading points of all their camera rays
        for some in refused.chunks(AT_ONCE) {
            self.rays_of(some, counts, go_on)?;
        }
        self.refused = refused;
        ControlFlow::Continue(())
    }

    fn rays_of(
        &mut self,
        refused: &[Wanted],
        counts: &mut Counts,
        go_on: &dyn Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let scene = self.scene;
        self.places.clear();
        self.requests.clear();
        // Places of a fragment serve all lights
        let mut last: Option<(u32, Range<usize>)> = None;
        for Wanted { fragment: number, light, visibility, .. } in refused {
            self.trace_rays(*number as usize, counts);
            let fragment = &self.fragments.all[*number as usize];
            if last.as_ref().is_none_or(|(before, _)| before != number) {
                let first = self.places.len();
                self.places.extend((0..fragment.rays.len()).map(|k| self.fragments.place(scene, fragment, k)));
                last = Some((*number, first..self.places.len()));
            }
            let places = last.as_ref().map_or(0..0, |(_, places)| places.clone());
            self.requests.extend(places.map(|place| LightQuery {
                point: place as u32,
                light: *light,
                visibility: *visibility,
            }));
        }
        self.lights.estimate(&self.places, &self.requests, &mut self.answers, counts, go_on)?;
        // Requests of a fragment lie together
        let mut answers = self.requests.iter().zip(&self.answers);
        for Wanted { fragment, light, .. } in refused {
            let asked = self.asked[*fragment as usize];
            let fragment = &self.fragments.all[*fragment as usize];
            let index = self.pixels[fragment.pixel as usize].index as usize;
            self.sums.work[index] += Heat::PLACE * fragment.count() as f32;
            let at = self.at(index);
            let term = &mut self.terms[fragment.pixel as usize * scene.lights.len() + *light as usize];
            // Rays of which no batch knows what they see sample the light together
            let mut unknown = None;
            for (request, answer) in answers.by_ref().take(fragment.count()) {
                let place = &self.places[request.point as usize];
                if answer.moments.is_known() {
                    *term += place.bsdf.colors.each(&answer.moments);
                    continue;
                }
                let salt = salt(at, place.surface);
                let (light, rays, share) = (*light as usize, fragment.count(), fragment.share);
                let scale = self.lights.scale(light);
                let new = || PooledVisibility::new(light, scale, rays, share, salt, Rgb::BLACK, asked);
                counts.visibility.classes[Visibility::Partial as usize] += 1;
                unknown.get_or_insert_with(new).add_sampled(place, &mut self.lights, counts);
            }
            if let Some(pooled) = unknown {
                go_on()?;
                let before = counts.work();
                *term += pooled.estimate(&mut self.lights, counts).terms;
                self.sums.work[index] += counts.work() - before;
            }
        }
        ControlFlow::Continue(())
    }

    /// Makes sure that it is known where the rays of a fragment end.
    fn trace_rays(&mut self, fragment: usize, counts: &mut Counts) {
        if self.fragments.all[fragment].rays.is_empty() {
            let index = self.pixels[self.fragments.all[fragment].pixel as usize].index as usize;
            let at = self.at(index);
            self.fragments.trace(self.scene, fragment, self.pixel_rays.of(self.scene, at));
            self.sums.work[index] += self.fragments.all[fragment].count() as f32;
            counts.looks += self.fragments.all[fragment].count() as u64;
        }
    }

    /// Adds ambient light to the sums of pixels.
    fn add_ambient(&mut self) {
        for fragment in &self.fragments.all {
            let pixel = &mut self.pixels[fragment.pixel as usize];
            pixel.terms.ambient += fragment.bsdf.base(self.scene.ambient) * fragment.count() as f32;
        }
    }

    /// Sums what is known of pixels.
    fn resolve(&mut self) {
        self.add_ambient();
        let scene = self.scene;
        let lights = scene.lights.len();
        for (number, pixel) in self.pixels.iter().enumerate() {
            let scales = self.lights.scales().iter().copied();
            let lit = ScaledTerm::of_all(scales, &self.terms[number * lights..][..lights]);
            pixel.terms.resolve(scene, lit, pixel.index as usize, &mut self.sums);
        }
    }

    /// Hands over the part of the cell that is in the tile.
    fn deliver(&mut self, part: Tile, film: &mut FilmTile, counts: &mut Counts) {
        let rays = (self.scene.antialiasing * self.scene.antialiasing) as u64;
        for y in part.y..part.y + part.height {
            let first = self.index([part.x, y]);
            counts.camera_rays += rays * u64::from(part.width);
            film.set_row([part.x, y], &self.sums, first..first + part.width as usize);
        }
    }
}

/// Camera rays of a pixel that is lit at its quadrants alone.
const QUADRANTS: u32 = 4;
