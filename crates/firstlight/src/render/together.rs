//! One light, asked for at every ray of a patch, and judged by what all of them make together.
//!
//! Behind things a light is asked point by point ([`ladder`](super::ladder)). The rays ask different points, which are
//! stratified together: n rays need far fewer each than one that stands for all of them, and what one ray's points pass
//! by, those of others meet. Their number grows until what they say together will do. What points cannot settle, since
//! few of them send nearly all, is left to cells.

use super::Counts;
use super::arrival::{ArrivalPlace, Arrivals, Sighting};
use super::beams::{self, RungRays};
use super::fragment::most_asked;
use super::ladder::{AskedRung, Asker, CellBits, FIRST, is_in};
use super::packets::{PacketErrors, by_chance, of_edge};
use super::resolve::LightTerm;
use super::tally::Tally;
use crate::color::Rgb;
use crate::ids::SurfaceId;
use crate::integrate::{Arrived, Illumination};
use crate::light::SERIES;
use crate::material::{Bsdf, Lobe, MOMENTS, Moments};
use crate::math::LANES;
use crate::shape::SurfaceInteraction;
use crate::visibility::{ShadowView, Viewpoint, Visibility};

/// The part of what chance makes of an edge that is wrong at the least, where no packet says so.
const UNANIMOUS: f32 = 0.25;
/// How many times what is allowed by chance a deviation may be.
const DEVIATION: f32 = 1.25;
/// Points that find what is in the way of a pixel.
const POINTS: f32 = 512.0;
/// The effective part of them, none of which is hidden where nothing is.
const CLEAR: f64 = 0.75;
/// In display steps: what one point may send where none is hidden.
const UNMET: f32 = 1.0;
/// The part of what may be wrong that points may tell nothing about.
const UNTOLD: f32 = 0.5;
/// Effective points of all rays together that tell something.
const TOLD: f64 = 32.0;
/// The same of the diffuse part, as a part of all points that send: fewer, and the light is so near that its points
/// miss where it is nearest.
const UNEVEN: f64 = 1.0 / 16.0;
/// So many points of a ray tell that nothing is hidden.
const MANY: usize = 1 << 10;
/// In display steps: how far what would arrive at a ray in the middle of a pixel may be off what those in the corners
/// say, to tell it of all; and how far they may differ.
const EVEN: f32 = 0.1;
const EVEN_CORNERS: f32 = 4.0;
/// Where more points seem to be of no help, there are this part of as many as elsewhere.
const BEHIND: usize = 4;
/// The cells that a light is told by at most, of all rays of a pixel.
const MOST: usize = 1 << 16;

/// A ray whose light is behind things.
struct Asking {
    si: SurfaceInteraction,
    lobe: Lobe,
    base: Rgb,
    scale: Rgb,
    reflected: LightTerm,
    series: usize,
    view: ShadowView,
    /// What would arrive if nothing were in the way, if that is known.
    whole: Option<Moments>,
    /// Whether points of the light may miss most of what it sends.
    may_miss: bool,
    tally: Tally,
}

/// A ray of which nothing is known yet but that nothing is in the way, if that is, or nothing in trees.
struct Looking {
    si: SurfaceInteraction,
    bsdf: Bsdf,
    lit: bool,
    clear: bool,
}

impl Asking {
    fn place(&self, share: f32) -> ArrivalPlace<'_> {
        let place = ArrivalPlace::point(&self.si, &self.lobe, self.base, self.scale, self.reflected);
        ArrivalPlace { share, ..place }
    }

    /// What arrives, as far as points tell, and what would if nothing were in the way; `shares`: see [`Tally::sums`].
    fn sums(&self, measure: f32, shares: &[f32; MOMENTS]) -> (Moments, Moments) {
        let arrives = self.tally.sums(self.whole.as_ref(), measure, shares);
        (arrives, self.whole.unwrap_or_else(|| self.tally.whole(measure)))
    }

    /// The diffuse part and the highlight, with their colours.
    fn each(&self, sums: &Moments) -> LightTerm {
        (self.scale * self.reflected).each(sums)
    }

    fn color(&self, sums: &Moments) -> Rgb {
        self.each(sums).sum()
    }
}

/// The cells of a light that rays ask points in.
struct AskedCells<'a> {
    asker: Asker<'a>,
    count: usize,
    /// How often each was halved since a point in it was asked.
    ages: Vec<u8>,
    /// As many as these were asked everywhere, at least.
    everywhere: usize,
}

impl<'a> AskedCells<'a> {
    /// Has all rays ask a point in each of so many.
    fn new(asker: Asker<'a>, count: usize, asking: &mut [Asking], counts: &mut Counts) -> Self {
        let cells = AskedCells { asker, count, ages: vec![0; count], everywhere: count };
        asking.iter_mut().for_each(|one| one.tally.part(count));
        let first: Vec<AskedRung> = asking.iter().map(|one| asker.first(one.series, count)).collect();
        cells.ask(&first, count, &cells.all(), asking, counts);
        cells
    }

    fn all(&self) -> CellBits {
        vec![u16::MAX; self.count / LANES]
    }

    /// Halves all cells and has all rays ask one more point in each that is in `asked`, and as many fewer elsewhere as
    /// [`BEHIND`] says.
    fn halve(&mut self, asked: &CellBits, asking: &mut [Asking], counts: &mut Counts) {
        let left = self.left_behind(asked);
        asking.iter_mut().for_each(|one| one.tally.part(2 * self.count));
        self.ask_next(self.count, asked, asking, counts);
        if left.iter().any(|bits| *bits != 0) {
            self.ask_next(self.count / BEHIND, &left, asking, counts);
        }
        let age = |cell: usize| match (is_in(asked, cell), is_in(&left, cell / BEHIND)) {
            (true, _) => 0,
            (_, true) => BEHIND.ilog2() as u8,
            _ => self.ages[cell] + 1,
        };
        self.ages = (0..self.count).flat_map(|cell| [age(cell); 2]).collect();
        self.count *= 2;
        let behind = if asked.iter().all(|bits| *bits == u16::MAX) { 1 } else { BEHIND };
        self.everywhere = self.everywhere.max(self.count / behind);
    }

    /// Those of larger cells that none of `asked` is a part of, and that were halved as often as that since a point in
    /// them was asked.
    fn left_behind(&self, asked: &CellBits) -> CellBits {
        let mut left = vec![0; asked.len().div_ceil(BEHIND)];
        for (k, ages) in self.ages.chunks(BEHIND).enumerate() {
            let is_left = (k * BEHIND..(k + 1) * BEHIND).all(|cell| !is_in(asked, cell));
            if is_left && ages.iter().all(|age| 1 << age >= BEHIND) {
                left[k / LANES] |= 1 << (k % LANES);
            }
        }
        left
    }

    fn ask_next(&self, count: usize, asked: &CellBits, asking: &mut [Asking], counts: &mut Counts) {
        let next: Vec<AskedRung> = asking.iter().map(|one| self.asker.next(one.series, count, asked)).collect();
        // What is made for what is asked holds nothing else
        if let AskedRung::Made(rung) = &next[0] {
            let mut asked = vec![u16::MAX; rung.points.blocks.len()];
            // The last sixteen may be fewer
            if let (Some(last), more @ 1..) = (asked.last_mut(), rung.cells.len() % LANES) {
                *last = (1 << more) - 1;
            }
            self.ask(&next, 2 * count, &asked, asking, counts);
        } else {
            self.ask(&next, 2 * count, asked, asking, counts);
        }
    }

    /// Has each ray ask those of the points of its rung that are `asked`, each of which tells one of `count` cells.
    fn ask(&self, rungs: &[AskedRung], count: usize, asked: &[u16], asking: &mut [Asking], counts: &mut Counts) {
        let asker = &self.asker;
        let mut beams: Vec<RungRays> = Vec::new();
        for (one, rung) in asking.iter_mut().zip(rungs).filter(|(one, _)| one.view.trees) {
            beams.push(RungRays { point: Viewpoint::of(&one.si), rung, hidden: &mut one.view.hidden });
        }
        counts.settled.traced += beams::trace(asker.scene, asker.target.light, asked, &mut beams);
        for (one, rung) in asking.iter_mut().zip(rungs) {
            if !one.view.trees {
                counts.settled.traced += asker.mask(rung, asked, &mut one.view, &Viewpoint::of(&one.si));
            }
            one.tally.ask(asker, rung, count, asked, &one.view, &one.si, &one.lobe);
        }
        let points = asked.iter().map(|bits| u64::from(bits.count_ones())).sum::<u64>() * asking.len() as u64;
        counts.shadow_rays += points;
        counts.shadow_rays_skipped += points;
    }
}

/// The parts of what points of all rays send that arrive.
fn shares(asking: &[Asking]) -> [f32; MOMENTS] {
    std::array::from_fn(|k| {
        let sum = |of: fn(&Tally) -> &[f64; MOMENTS]| asking.iter().map(|one| of(&one.tally)[k]).sum::<f64>();
        let (lit, all) = (sum(|tally| &tally.lit), sum(|tally| &tally.all));
        if all > 0.0 { (lit / all) as f32 } else { 0.0 }
    })
}

/// What the rays of one patch ask of one light.
pub(crate) struct Together {
    light: usize,
    /// The share of the pixel that a ray has, and that of the patch.
    each: f32,
    share: f32,
    /// Which series the first ray asks.
    series: usize,
    rays: usize,
    /// Those of which nothing is known yet, and those that are behind things.
    looking: Vec<Looking>,
    asking: Vec<Asking>,
    /// What is known, all rays together: the light, before colours and with those of the surfaces, and all that is
    /// there.
    sums: Moments,
    terms: LightTerm,
    value: Rgb,
    /// What other lights send to each ray, at least: errors of packets show less beside it.
    others: Rgb,
    /// How much of the light is not hidden from the rays that see any of it but for that, added up, and their number;
    /// no number where that is not known.
    shares: f32,
    sharing: u32,
}

/// What all rays of a patch see of a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome {
    /// Added up.
    pub terms: LightTerm,
    /// Added up, without colours.
    pub sums: Moments,
    /// The part of the light that is not hidden, by its points, the mean over the rays; no number where that is not
    /// known.
    pub share: f32,
}

/// Anything that other pixels have other values of, and other surfaces in them.
pub(crate) fn salt([i, j]: [u32; 2], surface: SurfaceId) -> u32 {
    i ^ j.rotate_left(16) ^ surface.index() as u32
}

impl Together {
    /// Of a patch with so many rays, `share` of its pixel. By its [`salt`] it asks other points than others; `others`
    /// is what other lights send to a ray, at least.
    pub fn new(light: usize, rays: usize, share: f32, salt: u32, others: Rgb) -> Self {
        // Which of the series is first: any, but not by a pattern
        let series = (salt.wrapping_mul(0x9e37_79b9) >> 16) as usize % SERIES;
        let each = share / rays as f32;
        let (sums, terms) = (Moments::default(), LightTerm::BLACK);
        Together {
            light,
            each,
            share,
            series,
            rays: 0,
            looking: Vec::new(),
            asking: Vec::new(),
            sums,
            terms,
            value: Rgb::BLACK,
            others,
            shares: 0.0,
            sharing: 0,
        }
    }

    /// Asks for what one ray sees. It may be known that nothing is in the way, or nothing in trees: `lit`, `clear`.
    pub fn ask(
        &mut self,
        arrivals: &mut Arrivals,
        si: &SurfaceInteraction,
        bsdf: &Bsdf,
        lit: bool,
        clear: bool,
        counts: &mut Counts,
    ) {
        if arrivals.lights.emitters[self.light].is_some() {
            self.looking.push(Looking { si: *si, bsdf: *bsdf, lit, clear });
        } else {
            let place = ArrivalPlace { share: self.share, lit, clear, ..arrivals.place(self.light, si, bsdf) };
            let sums = arrivals.arrival(self.light, &place, counts).sums;
            self.know(&place, &sums);
            self.shares += if lit { 1.0 } else { f32::NAN };
            self.sharing += 1;
        }
    }

    /// Asks points of the light for one ray, as nobody knows what it sees.
    pub fn ask_points(&mut self, arrivals: &mut Arrivals, si: &SurfaceInteraction, bsdf: &Bsdf, counts: &mut Counts) {
        let place = ArrivalPlace { share: self.share, ..arrivals.place(self.light, si, bsdf) };
        counts.settled.visibility[Visibility::Mask as usize] += 1;
        self.hear(&place, Sighting::Behind(None), arrivals, counts);
    }

    /// Hears what one ray sees.
    pub fn know(&mut self, place: &ArrivalPlace, sums: &Moments) {
        self.rays += 1;
        self.value += place.base;
        self.add(place, sums);
    }

    /// Hears that something hides all of the light from a ray.
    pub fn dark(&mut self, place: &ArrivalPlace) {
        self.know(place, &Moments::default());
        self.sharing += 1;
    }

    /// Hears what would arrive at the only ray if nothing were in the way, if that is known.
    pub fn hear_whole(&mut self, arrivals: &Arrivals, whole: Option<Moments>) {
        for one in &mut self.asking {
            one.whole = whole;
            one.may_miss = whole.is_none() && arrivals.may_miss(self.light, &one.place(self.share));
        }
    }

    /// Asks for what one ray sees past what is in `view`.
    pub fn behind(&mut self, place: &ArrivalPlace, view: ShadowView) {
        let series = self.series ^ (self.rays % SERIES);
        self.rays += 1;
        self.value += place.base;
        let ArrivalPlace { si, lobe, base, scale, reflected, .. } = *place;
        self.asking.push(Asking {
            si: *si,
            lobe: *lobe,
            base,
            scale,
            reflected,
            series,
            view,
            whole: None,
            may_miss: false,
            tally: Tally::default(),
        });
    }

    fn add(&mut self, place: &ArrivalPlace, sums: &Moments) {
        self.terms += place.reflected.each(sums);
        self.value += place.color(sums);
        self.sums += *sums;
    }

    /// What all rays see of the light.
    pub fn finish(self, arrivals: &mut Arrivals, counts: &mut Counts) -> Outcome {
        let mut one = [self];
        Together::tell(&mut one, arrivals, counts);
        let [one] = one;
        one.settle(arrivals, counts)
    }

    /// Has the rays of some patches, which ask the same light, told all that batches know of it.
    pub fn tell(all: &mut [Together], arrivals: &mut Arrivals, counts: &mut Counts) {
        let Some(light) = all.first().map(|one| one.light) else { return };
        let looking: Vec<Vec<Looking>> = all.iter_mut().map(|one| std::mem::take(&mut one.looking)).collect();
        let mut places = Vec::new();
        for (one, looking) in all.iter().zip(&looking) {
            let most_asked = most_asked(one.asking.len() + looking.len());
            places.extend(looking.iter().map(|Looking { si, bsdf, lit, clear }| {
                // What is integrated is wrong alike at all rays: that much by no more than if one stood for all
                let (share, lit, clear) = (one.share, *lit, *clear);
                ArrivalPlace { share, lit, clear, most_asked, ..arrivals.place(light, si, bsdf) }
            }));
        }
        if !places.is_empty() {
            let mut seen = Vec::new();
            arrivals.look(light, &places, &mut seen, counts);
            let mut seen = places.iter().zip(seen);
            for (one, looking) in all.iter_mut().zip(&looking) {
                for (place, (_, seen)) in seen.by_ref().take(looking.len()) {
                    one.hear(place, seen, arrivals, counts);
                }
            }
        }
        // What would arrive behind things: where the rays in the corners of a pixel tell that of all, from those
        let n = arrivals.scene.antialiasing as usize;
        let mut corners: Vec<Option<[usize; 5]>> = Vec::new();
        let mut wanted = Vec::new();
        for (k, (one, looking)) in all.iter().zip(&looking).enumerate() {
            let is_in_order = looking.is_empty() || one.asking.len() == looking.len();
            corners.push(Some(n).filter(|n| is_in_order && *n > 2 && one.asking.len() == n * n).map(Together::corners));
            match &corners[k] {
                Some(corners) => wanted.extend(corners.map(|ray| (k, ray))),
                None => wanted.extend((0..one.asking.len()).map(|ray| (k, ray))),
            }
        }
        Together::ask_wholes(all, &wanted, arrivals);
        wanted.clear();
        for (k, (one, corners)) in all.iter_mut().zip(&corners).enumerate() {
            if let Some(corners) = corners
                && !one.spread(n, corners, arrivals)
            {
                wanted.extend((0..one.asking.len()).filter(|ray| !corners.contains(ray)).map(|ray| (k, ray)));
            }
        }
        Together::ask_wholes(all, &wanted, arrivals);
    }

    fn hear(&mut self, place: &ArrivalPlace, seen: Sighting, arrivals: &mut Arrivals, counts: &mut Counts) {
        match seen {
            Sighting::Known(sums) => {
                self.know(place, &sums);
                self.shares += if place.lit { 1.0 } else { f32::NAN };
                self.sharing += 1;
            }
            Sighting::Behind(_) => match arrivals.settle(self.light, place.si, counts) {
                Some(view) => self.behind(place, view),
                None => self.dark(place),
            },
        }
    }

    /// The rays in the corners of a pixel with `n` x `n`, and one near its middle.
    fn corners(n: usize) -> [usize; 5] {
        [0, n - 1, n * (n - 1), n * n - 1, (n + 1) * ((n - 1) / 2)]
    }

    /// Gives each ray the mean of what would arrive in the corners, by its place; `false` if that is not what would
    /// arrive in the middle.
    fn spread(&mut self, n: usize, corners: &[usize; 5], arrivals: &Arrivals) -> bool {
        let mut wholes = [Moments::default(); 5];
        for (whole, ray) in wholes.iter_mut().zip(corners) {
            let Some(found) = self.asking[*ray].whole else { return false };
            *whole = found;
        }
        let [a, b, c, d, middle] = wholes;
        let mean = |ray: usize| {
            let [x, y] = [ray % n, ray / n].map(|k| k as f32 / (n - 1) as f32);
            (a * (1.0 - x) + b * x) * (1.0 - y) + (c * (1.0 - x) + d * x) * y
        };
        let one = &self.asking[corners[4]];
        let colors = [a, b, c, d, middle, mean(corners[4])].map(|sums| one.base + one.color(&sums));
        let (least, most) = colors.iter().fold((colors[0], colors[0]), |(l, m), c| (l.min(*c), m.max(*c)));
        let off = Rgb::max(colors[4] + colors[5] * -1.0, colors[5] + colors[4] * -1.0);
        if arrivals.steps(most, most + least * -1.0) > EVEN_CORNERS || arrivals.steps(colors[4], off) > EVEN {
            return false;
        }
        for (ray, one) in self.asking.iter_mut().enumerate().filter(|(ray, _)| !corners.contains(ray)) {
            one.whole = Some(mean(ray));
        }
        true
    }

    /// Asks what would arrive at some rays if nothing were in the way: of which patch, and which of its rays.
    fn ask_wholes(all: &mut [Together], wanted: &[(usize, usize)], arrivals: &mut Arrivals) {
        let Some(light) = all.first().map(|one| one.light).filter(|_| !wanted.is_empty()) else { return };
        let places: Vec<_> = wanted.iter().map(|(k, ray)| all[*k].asking[*ray].place(all[*k].share)).collect();
        let known = |arrived: Arrived| (arrived.illumination != Illumination::Unknown).then_some(arrived.sums);
        let wholes: Vec<_> = arrivals.wholes(light, &places).into_iter().map(known).collect();
        let may_miss = |(place, whole): (_, &Option<Moments>)| whole.is_none() && arrivals.may_miss(light, place);
        let may_miss: Vec<bool> = places.iter().zip(&wholes).map(may_miss).collect();
        for (((k, ray), whole), may_miss) in wanted.iter().zip(wholes).zip(may_miss) {
            let one = &mut all[*k].asking[*ray];
            (one.whole, one.may_miss) = (whole, may_miss);
        }
    }

    /// Asks points of the light, as it is known by now what batches know.
    pub fn settle(mut self, arrivals: &mut Arrivals, counts: &mut Counts) -> Outcome {
        if !self.asking.is_empty() {
            let mut asking = std::mem::take(&mut self.asking);
            let is_told = self.points(arrivals, &mut asking, counts);
            let (measure, shares) = (arrivals.measure(self.light), shares(&asking));
            for one in asking {
                let place = one.place(self.each);
                let sums = match is_told {
                    true => one.tally.sums(one.whole.as_ref(), measure, &shares),
                    false => arrivals.beyond_points(self.light, &place, counts),
                };
                if one.tally.sending > 0 {
                    self.shares += 1.0 - one.tally.hidden as f32 / one.tally.sending as f32;
                    self.sharing += 1;
                }
                self.add(&place, &sums);
                arrivals.keep(one.view);
            }
        }
        Outcome { terms: self.terms, sums: self.sums, share: self.shares / self.sharing.max(1) as f32 }
    }

    /// Asks points of the light, more and more, until what they say together will do; whether it does in the end.
    fn points(&self, arrivals: &Arrivals, asking: &mut [Asking], counts: &mut Counts) -> bool {
        if asking.iter().any(|one| one.may_miss) {
            return false;
        }
        let asker = arrivals.asker(self.light);
        let measure = arrivals.measure(self.light);
        let wanted = POINTS * self.share.sqrt();
        let most = MOST / asking.len().next_power_of_two();
        let first = ((wanted / asking.len() as f32) as usize).next_power_of_two().max(FIRST);
        let tolerance = arrivals.tolerance_by_chance(self.share);
        let allowed = tolerance * DEVIATION;
        let part = 1.0 / self.rays as f32;
        let mut cells = AskedCells::new(asker, first, asking, counts);
        // By how many effective points each part of the light is told, of so many
        let (mut effective, mut told) = ([0.0; MOMENTS], 0);
        loop {
            asking.iter_mut().for_each(|one| one.tally.sum(asker.level));
            if cells.everywhere == cells.count {
                (effective, told) = ([0.0; MOMENTS], 0);
            }
            let shares = shares(asking);
            let mut value = self.value + self.others * self.rays as f32;
            // What would arrive if nothing were in the way, of each kind
            let mut all = [Rgb::BLACK; MOMENTS];
            let (mut sending, mut hidden, mut is_known) = (0, 0, true);
            for one in asking.iter() {
                let (now, whole) = one.sums(measure, &shares);
                value += one.color(&now);
                for (k, (color, points)) in one.each(&whole).0.into_iter().zip(one.tally.effective()).enumerate() {
                    all[k] += color;
                    effective[k] += if told == 0 { points } else { 0.0 };
                }
                sending += one.tally.sending;
                hidden += one.tally.hidden;
                is_known &= one.whole.is_some();
            }
            // Where fewer points are asked, as good as fewer everywhere
            let more = if told == 0 { 1.0 } else { cells.everywhere as f64 / told as f64 };
            effective.iter_mut().for_each(|points| *points *= more);
            told = cells.everywhere;
            let shows = |error: Rgb| arrivals.steps(value * part, error * part);
            // What few points send, or none, can be anything
            let sum = |of: &dyn Fn(usize) -> Rgb| (1..MOMENTS).fold(of(0), |sum, k| sum + of(k));
            let sending = sending as f64 * told as f64 / cells.count as f64;
            let least = |k: usize| if k == 0 { TOLD.max(sending * UNEVEN) } else { TOLD };
            let untold = |k: usize| if effective[k] < least(k) { all[k] } else { Rgb::BLACK };
            let is_told = shows(sum(&untold)) <= tolerance * UNTOLD;
            let found = effective.iter().copied().fold(0.0, f64::max);
            // What none of so many points meets may hide what one of them sends
            let one = |k: usize| all[k] * (1.0 / effective[k].max(1.0) as f32);
            let is_clear = found >= f64::from(wanted) * CLEAR && shows(sum(&one)) <= UNMET;
            if is_told && is_known && hidden == 0 && (is_clear || cells.count >= MANY) {
                return true;
            }
            // As much as packets are wrong by; or a part of what an edge may be that none of them tells
            let tallies: Vec<&Tally> = asking.iter().map(|one| &one.tally).collect();
            let mut sent = Moments::default();
            asking.iter().filter_map(|one| one.whole).for_each(|whole| sent += whole);
            let packets = PacketErrors::of(asker.level, &tallies, &cells.ages, measure, is_known.then_some(sent));
            let least = if is_known { UNANIMOUS } else { 1.0 };
            let unmet = shows(sum(&|k| all[k] * (least * by_chance(effective[k])).max(packets.smooth[k])));
            let error = shows(sum(&|k| all[k] * packets.edges[k])).max(unmet);
            if is_told && error <= allowed {
                return true;
            }
            // Errors shrink as they do where an edge is: what the most will not settle, cells do
            if cells.count == most || error * of_edge(most as f64) > allowed * of_edge(cells.count as f64) {
                return false;
            }
            let asked = if is_told && unmet <= allowed { packets.cells } else { cells.all() };
            cells.halve(&asked, asking, counts);
        }
    }
}
