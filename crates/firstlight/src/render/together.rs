//! One light, asked for at every ray of a patch, and judged by what all of them make together.
//!
//! Behind things a light is asked point by point ([`ladder`](super::ladder)). The rays ask different points, which are
//! stratified together: n rays need far fewer each than one that stands for all of them, and what one ray's points pass
//! by, those of others meet. Their number grows until what they say together will do.

use std::f32::consts::SQRT_2;

use super::Counts;
use super::arrival::{ArrivalPlace, Arrivals, Sighting};
use super::asking::{AskedLeaves, Asking, EVENLY, MOST, largest, parts};
use super::evidence::{Evidence, Met};
use super::ladder::{FIRST, LAST};
use super::packets::{Packets, of_edge};
use super::resolve::LightTerm;
use super::tally::Tally;
use crate::color::Rgb;
use crate::ids::SurfaceId;
use crate::light::SERIES;
use crate::material::{Bsdf, MOMENTS, Moments};
use crate::shape::SurfaceInteraction;
use crate::visibility::{ShadowView, Visibility};

/// How many times what is allowed by chance a deviation may be; more after more than so many times the points that are
/// asked [first](BEGIN), by the fourth root of their number, up to so many times as many again. A picture of so much
/// error in all takes least where pixels that take long are off by more than others.
const DEVIATION: f32 = 1.25;
const LONG: f32 = 2.0;
const LONGEST: f32 = 4.0;
/// How many times what is overlooked behind edges counts: it is off to one side everywhere.
const OVERLOOKED: f32 = SQRT_2;
/// The points of a pixel that are asked first, with a tolerance of 1; with others a root of it fewer.
const BEGIN: f32 = 1024.0;
/// Points that find what is in the way of a pixel.
const POINTS: f32 = 512.0;
/// The effective part of them, none of which is hidden where nothing is.
const CLEAR: f64 = 0.75;
/// In display steps: what one point may send where none is hidden.
const UNMET: f32 = 1.0;
/// A pixel that tells what others in its square see counts for so many: the mean sum of squares of what the nine are
/// worth for a pixel, so that chance puts that one off by as much as if it had been asked.
const NODE_PIXELS: f32 = 0.64;
/// The part of what may be wrong that points may tell nothing about.
const UNTOLD: f32 = 0.5;
/// How many of those that send it what few points send may be off by.
const FEW: f32 = 2.0;
/// Effective points of all rays together that tell something.
const TOLD: f64 = 32.0;
/// The same of the diffuse part, as a part of all points that send: fewer, and the light is so near that its points
/// miss where it is nearest.
const UNEVEN: f64 = 1.0 / 16.0;
/// So many points of a ray tell that nothing is hidden.
const MANY: usize = 1 << 10;
/// So many points of all rays tell that all of the light is hidden: near black, anything shows.
const ALL_HIDDEN: usize = 1 << 14;

/// A ray of which nothing is known yet but that nothing is in the way, if that is, or nothing in trees.
struct Looking {
    si: SurfaceInteraction,
    bsdf: Bsdf,
    lit: bool,
    clear: bool,
}

/// What the rays of one patch ask of one light.
pub(crate) struct Together {
    light: usize,
    /// The share of the pixel that a ray has, and that of the patch.
    each: f32,
    share: f32,
    /// Whether they tell what other pixels see.
    is_node: bool,
    /// How many times more this light may be wrong, as points of some others are not asked: their errors are none, or
    /// small.
    room: f32,
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
#[derive(Debug)]
pub(super) struct Outcome {
    /// Added up.
    pub terms: LightTerm,
    /// Added up, without colours.
    pub sums: Moments,
    /// The part of the light that is not hidden, by its points, the mean over the rays; no number where that is not
    /// known.
    pub share: f32,
    /// What its points met, if any were asked.
    pub evidence: Evidence,
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
            is_node: false,
            room: 1.0,
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

    /// The same of a pixel that tells what others in its square see.
    pub fn of_node(mut self) -> Self {
        self.share *= NODE_PIXELS;
        self.each *= NODE_PIXELS;
        self.is_node = true;
        self
    }

    /// The same where so many of all lights that are integrated are asked for points.
    pub fn of_lights(mut self, asked: usize, arrivals: &Arrivals) -> Self {
        let all = arrivals.lights.integrated.max(1);
        self.room = (all as f32 / asked.clamp(1, all) as f32).sqrt();
        self
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
        if arrivals.is_integrated(self.light) {
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
        self.hear(&place, Sighting::Behind, arrivals, counts);
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
            known: None,
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
        one.settle(&[], arrivals, counts)
    }

    /// Has the rays of some patches, which ask the same light, told all that batches know of it.
    pub fn tell(all: &mut [Together], arrivals: &mut Arrivals, counts: &mut Counts) {
        let Some(light) = all.first().map(|one| one.light) else { return };
        let looking: Vec<Vec<Looking>> = all.iter_mut().map(|one| std::mem::take(&mut one.looking)).collect();
        let mut places = Vec::new();
        for (one, looking) in all.iter().zip(&looking) {
            let part_of_points = 1.0 / (one.asking.len() + looking.len()) as f32;
            places.extend(looking.iter().map(|Looking { si, bsdf, lit, clear }| {
                // What is integrated is wrong alike at all rays: that much by no more than if one stood for all
                let (share, lit, clear) = (one.share, *lit, *clear);
                ArrivalPlace { share, lit, clear, part_of_points, ..arrivals.place(light, si, bsdf) }
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
    }

    fn hear(&mut self, place: &ArrivalPlace, seen: Sighting, arrivals: &mut Arrivals, counts: &mut Counts) {
        match seen {
            Sighting::Known(sums) => {
                self.know(place, &sums);
                self.shares += if place.lit { 1.0 } else { f32::NAN };
                self.sharing += 1;
            }
            Sighting::Behind => match arrivals.settle(self.light, place.si, counts) {
                Some(view) => self.behind(place, view),
                None => self.dark(place),
            },
        }
    }

    /// Asks points of the light, as it is known by now what batches know, and what the points of patches `around` met.
    pub fn settle(mut self, around: &[&Evidence], arrivals: &mut Arrivals, counts: &mut Counts) -> Outcome {
        let mut evidence = Evidence::default();
        if !self.asking.is_empty() {
            let mut asking = std::mem::take(&mut self.asking);
            asking.iter_mut().for_each(|one| one.tally = arrivals.tally());
            let measure = arrivals.measure(self.light);
            evidence = self.points(around, arrivals, &mut asking, counts);
            let shares = parts(&asking, |tally| &tally.lit);
            for one in asking {
                let place = one.place(self.each);
                let sums = one.known.unwrap_or_else(|| one.tally.arrives(&one.sent(measure), &shares));
                if one.tally.sending > 0.0 {
                    self.shares += 1.0 - (one.tally.hidden / one.tally.sending) as f32;
                    self.sharing += 1;
                }
                self.add(&place, &sums);
                arrivals.keep(one.view);
                arrivals.keep_tally(one.tally);
            }
        }
        let share = self.shares / self.sharing.max(1) as f32;
        Outcome { terms: self.terms, sums: self.sums, share, evidence }
    }

    /// Asks points of the light, more and more, until what they say together will do, and says what they met. What the
    /// most will not settle is asked in closed form.
    fn points(
        &self,
        around: &[&Evidence],
        arrivals: &mut Arrivals,
        asking: &mut [Asking],
        counts: &mut Counts,
    ) -> Evidence {
        let asker = arrivals.asker(self.light);
        let measure = asker.area.stands_for();
        let wanted = POINTS * self.share.sqrt();
        let begin = BEGIN / (arrivals.scene.tolerance() as f32).sqrt();
        let first = (begin * self.share.sqrt() / asking.len() as f32) as usize;
        let first = first.next_power_of_two().clamp(FIRST, LAST);
        let tolerance = arrivals.tolerance_by_chance(self.share) * self.room;
        let part = 1.0 / self.rays as f32;
        let mut is_tried = false;
        let mut evidence = Evidence::new(asking[0].si.p);
        let mut asked = AskedLeaves::new(asker, first, asking, counts);
        let mut packets = None;
        let (mut is_plain, mut is_halved) = (true, true);
        loop {
            asking.iter_mut().for_each(|one| one.tally.sum(asker.level, &asked.leaves));
            let shares = parts(asking, |tally| &tally.lit);
            let mut value = self.value + self.others * self.rays as f32;
            // What would arrive if nothing were in the way, of each kind; by how many effective points that is told,
            // and how many send anything
            let mut all = [Rgb::BLACK; MOMENTS];
            let (mut effective, mut sending, mut is_hidden) = ([0.0; MOMENTS], 0.0, false);
            // That of rays whose points find less than half of it
            let mut missing = [Rgb::BLACK; MOMENTS];
            for one in asking.iter() {
                let sent = one.sent(measure);
                value += one.color(&one.tally.arrives(&sent, &shares));
                for (k, (color, points)) in one.each(&sent).0.into_iter().zip(one.tally.effective()).enumerate() {
                    all[k] += color;
                    effective[k] += points;
                    if one.tally.all[k] as f32 * measure < 0.5 * sent.0[k] {
                        missing[k] += color;
                    }
                }
                sending += one.tally.effective_sending();
                is_hidden |= one.tally.hidden > 0.0;
            }
            let met = Met {
                points: effective.map(|points| points as f32),
                surprises: parts(asking, |tally| &tally.surprises),
            };
            evidence.note(asked.everywhere, met);
            let steps = arrivals.display_steps();
            let shows = |error: Rgb| steps.of_color(value * part, error * part);
            // What few points send, or none, can be off by what some of them do
            let sum = |of: &dyn Fn(usize) -> Rgb| (1..MOMENTS).fold(of(0), |sum, k| sum + of(k));
            let least = |k: usize| if k == 0 { TOLD.max(sending * UNEVEN) } else { TOLD };
            let one = |k: usize| all[k] * (1.0 / effective[k].max(1.0) as f32);
            let untold = |k: usize| if effective[k] < least(k) { all[k].min(one(k) * FEW) } else { missing[k] };
            let is_told = shows(sum(&untold)) <= tolerance * UNTOLD;
            let found = effective.iter().copied().fold(0.0, f64::max);
            // What none of so many points meets may hide what one of them sends
            let is_clear = found >= f64::from(wanted) * CLEAR && shows(sum(&one)) <= UNMET;
            // As much as packets are wrong by, and what nobody met. Of small things that are in the way each point says
            // what it sends; where leaves near those that were found are smaller, all that were not found are missing
            let tallies: Vec<&Tally> = asking.iter().map(|one| &one.tally).collect();
            let new = asked.take_new();
            let packets = packets.get_or_insert_with(|| Packets::new(Together::sent(asking, measure)));
            packets.hear(asker.level, &tallies, &asked.leaves, &new);
            let found = (!is_plain).then(|| Together::found(asking, measure));
            let packets = packets.errors(&tallies, &asked.leaves, found, all.map(largest));
            let leaf = asker.area.measure() as f32 / (1u64 << asked.everywhere) as f32;
            let met: [f32; MOMENTS] = std::array::from_fn(|k| evidence.overlooked(k, around, leaf));
            let smooth = shows(sum(&|k| all[k] * packets.smooth[k]));
            let noise = |k: usize| (met[k] / effective[k].max(1.0) as f32).sqrt();
            let overlooked = OVERLOOKED * shows(sum(&|k| all[k] * met[k]));
            let unmet = shows(sum(&|k| all[k] * noise(k).max(packets.smooth[k])));
            let unmet = if asked.is_even() { unmet } else { unmet.max(overlooked) };
            let edges = shows(sum(&|k| all[k] * packets.edges[k]));
            let points = asked.leaves.count() * asking.len();
            let allowed = tolerance * self.deviation(points as f32 / begin);
            let error = (edges * edges + unmet * unmet).sqrt();
            let is_lit = !is_hidden && (is_clear || asked.leaves.count() >= MANY);
            let is_dark = shares.iter().all(|share| *share == 0.0) && points >= ALL_HIDDEN;
            let is_last = points >= MOST || !is_halved;
            let is_enough = is_last || is_told && (is_lit || is_dark || error <= allowed);
            // Points are taken at their word for what would arrive if nothing were in the way, if they cannot miss any
            // of it
            let is_wanted = is_enough || (!is_told || smooth > allowed) && (edges <= allowed || points >= EVENLY);
            if is_plain && is_wanted {
                let apart = asker.area.extent() / (points as f32).sqrt();
                let is_unseen = |k: usize| effective[k] < least(k) && asking.iter().any(|one| one.reflects(k));
                let is_near = asking.iter().any(|one| !arrivals.varies_over(self.light, &one.place(self.each), apart));
                if smooth > allowed || is_near || (0..MOMENTS).any(is_unseen) {
                    self.ask_wholes(asking, arrivals);
                    is_plain = false;
                    continue;
                }
            }
            if is_enough {
                arrivals.took(self.light, asking.len(), points);
                return evidence;
            }
            // Errors shrink as they do where an edge is
            if !is_tried && error * of_edge(MOST as f64) > allowed * of_edge(points as f64) {
                is_tried = true;
                let places: Vec<_> = asking.iter().map(|one| one.place(self.each)).collect();
                let known = arrivals.in_closed_form(self.light, &places, counts);
                asking.iter_mut().zip(known).for_each(|(one, known)| one.known = known);
                if asking.iter().all(|one| one.known.is_some()) {
                    return evidence;
                }
            }
            // More everywhere as long as there is room for more near edges
            let is_raised = !is_told || unmet.max(overlooked) > allowed || !asked.is_raised;
            let is_raised = is_raised && (4 * points <= MOST || edges <= allowed);
            is_halved = asked.halve(&packets.near, is_raised, is_told, asking, counts);
        }
    }

    /// How many times what is allowed by chance these rays may deviate by, after so many times the first points.
    fn deviation(&self, times: f32) -> f32 {
        // What is off at a node is off at all pixels that it tells
        if self.is_node { DEVIATION } else { DEVIATION * (times / LONG).clamp(1.0, LONGEST).sqrt().sqrt() }
    }

    /// Asks what would arrive at all rays if nothing were in the way.
    fn ask_wholes(&self, asking: &mut [Asking], arrivals: &mut Arrivals) {
        let places: Vec<_> = asking.iter().map(|one| one.place(self.share)).collect();
        let wholes = arrivals.wholes(self.light, &places);
        asking.iter_mut().zip(wholes).for_each(|(one, whole)| one.whole = Some(whole));
    }

    /// What would arrive at all rays if nothing were in the way, in the unit of points.
    fn sent(asking: &[Asking], measure: f32) -> [f32; MOMENTS] {
        std::array::from_fn(|k| asking.iter().map(|one| one.sent(measure).0[k]).sum::<f32>() / measure)
    }

    /// The part of that which points find.
    fn found(asking: &[Asking], measure: f32) -> [f32; MOMENTS] {
        let sent = Together::sent(asking, measure);
        std::array::from_fn(|k| asking.iter().map(|one| one.tally.all[k]).sum::<f64>() as f32 / sent[k])
    }
}
