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
use super::ladder::{Asker, FIRST, LAST, PointAnswers, Tally, of_edge};
use super::resolve::LightTerm;
use crate::color::Rgb;
use crate::ids::SurfaceId;
use crate::integrate::{Arrived, Illumination};
use crate::light::SERIES;
use crate::material::{Bsdf, Lobe, MOMENTS, Moments};
use crate::math::LANES;
use crate::shape::SurfaceInteraction;
use crate::visibility::{ShadowView, Viewpoint, Visibility};

/// The points that a ray asks first where masks tell what is hidden, and how many times as many it asks next.
const MASKED: usize = 64;
const GROWTH: usize = 4;
/// The deviation of the share that a packet sees which some edge runs through: of sixteen points in as many parts of a
/// cell of the light the edge cuts about four, each of which it parts anywhere.
const MIXED: f32 = 0.035;
/// The deviation of the share that n stratified points find behind an edge, times n^3/4.
const EDGE: f32 = 0.46;
/// How many times that is where the points of a packet do not lie in different parts of a cell; and what is counted of
/// it for few rays, the errors of which are made good by few others.
const APART: f32 = 3.5;
const FEW: u32 = 9;
const OF_FEW: f32 = 1.5;
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
/// The most points of a pixel.
const MOST: usize = LAST * SERIES;

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
    /// Whether it needs no more points.
    settled: bool,
    tally: Tally,
    /// What the points asked last said.
    said: PointAnswers,
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

    /// What arrives, as far as points tell, and what would if nothing were in the way.
    fn sums(&self, measure: f32) -> (Moments, Moments) {
        (self.tally.sums(self.whole.as_ref(), measure), self.whole.unwrap_or_else(|| self.tally.whole(measure)))
    }

    /// The diffuse part and the highlight, with their colours.
    fn each(&self, sums: &Moments) -> LightTerm {
        (self.scale * self.reflected).each(sums)
    }

    fn color(&self, sums: &Moments) -> Rgb {
        self.each(sums).sum()
    }
}

/// Has all that are not settled ask so many points. `edges` hears of the packets of points behind what is in trees.
fn ask(asker: &Asker, asking: &mut [Asking], stride: usize, to: usize, edges: &mut PacketEdges, counts: &mut Counts) {
    // Masks take little longer for many points than for few; packets of rays want a point in each cell
    let by_beams = asking.iter().any(|one| !one.settled && one.view.trees);
    let growth = if by_beams { 2 } else { GROWTH };
    // All that are open have asked as many
    while let Some(count) = asking.iter().find(|one| !one.settled).map(|one| one.tally.count)
        && count < to
    {
        let rung = |series: usize| asker.rung(series, stride, count, to, growth);
        let mut beams: Vec<RungRays> = Vec::new();
        for one in asking.iter_mut().filter(|one| !one.settled && one.view.trees) {
            beams.push(RungRays {
                point: Viewpoint::of(&one.si),
                rung: rung(one.series),
                hidden: &mut one.view.hidden,
            });
        }
        counts.settled.traced += beams::trace(asker.scene, asker.target.light, &mut beams);
        for one in asking.iter_mut().filter(|one| !one.settled) {
            let rung = rung(one.series);
            if !one.view.trees {
                counts.settled.traced += asker.mask(rung, &mut one.view, &Viewpoint::of(&one.si));
            }
            let Asking { tally, view, si, lobe, said, .. } = one;
            tally.ask(asker, rung, view, si, lobe, said);
            let more = (one.tally.count - count) as u64;
            counts.shadow_rays += more;
            counts.shadow_rays_skipped += more;
        }
        edges.add(asking.iter().filter(|one| !one.settled).map(|one| &one.said));
    }
}

/// How many packets of points, neighbours on the light, the edge of a shadow runs through, of whatever that is.
#[derive(Clone, Copy, Debug, Default)]
struct PacketEdges {
    mixed: u32,
    /// The same of packets of sixteen points of one ray.
    mixed_alone: u32,
    /// Points that send anything.
    sending: u32,
    /// Rays that ask, and points of a packet: those of all of them in some cells of the light, sixteen or more in all.
    rays: u32,
    points: u32,
}

impl PacketEdges {
    /// Adds what all rays were told by the points of a rung.
    fn add<'a>(&mut self, said: impl Iterator<Item = &'a PointAnswers> + Clone) {
        let rays = said.clone().count();
        let Some(blocks) = said.clone().next().map(Vec::len) else { return };
        let cells = (LANES / rays.min(LANES)).next_power_of_two();
        (self.rays, self.points) = (rays as u32, (cells * rays) as u32);
        for block in 0..blocks {
            let (mut lit, mut hidden) = (0u16, 0u16);
            for [sends, hides] in said.clone().map(|said| said[block]) {
                (lit, hidden) = (lit | sends & !hides, hidden | hides);
                self.sending += sends.count_ones();
                self.mixed_alone += u32::from(hides != 0 && hides != sends);
            }
            // Cell by cell, or some cells together, told by their first
            let mut wide = 1;
            while wide < cells {
                (lit, hidden) = (lit | lit >> wide, hidden | hidden >> wide);
                wide *= 2;
            }
            let first = match cells {
                1 => 0xffff,
                2 => 0x5555,
                4 => 0x1111,
                8 => 0x0101,
                _ => 0x0001,
            };
            self.mixed += (lit & hidden & first).count_ones();
        }
    }

    /// The deviation of the share of the light that `effective` points find, if each packet is wrong by itself: those
    /// of all rays, `apart` times as wrong as if all saw the same, or, if that is less, those of each.
    fn deviation(&self, effective: f64, sending: usize, apart: f32) -> f32 {
        // Few packets send nearly all of a highlight: the edges may run through just those
        let heavier = sending as f32 / effective.max(1.0) as f32;
        let of = |mixed: u32, points: f32| {
            let mixed = ((mixed as f32 * points) / self.sending.max(1) as f32 * heavier).min(1.0);
            let packets = (effective as f32 / points).max(1.0);
            // Of one packet as that of sixteen points
            MIXED * of_edge(f64::from(points)) / of_edge(LANES as f64) * (mixed / packets).sqrt()
        };
        let alone = of(self.mixed_alone, LANES as f32);
        let together = alone.min(apart * of(self.mixed, self.points as f32));
        if self.rays <= FEW { together * OF_FEW } else { together }
    }
}

/// How much farther off the sum of all rays may be than if all saw the same: rays that see different shares of the
/// light are not stratified together.
fn apart(asking: &[Asking]) -> f32 {
    let (mut count, mut sum, mut squares, mut points) = (0.0f32, 0.0, 0.0, 0);
    for one in asking.iter().filter(|one| one.tally.sending > 0) {
        let share = one.tally.hidden as f32 / one.tally.sending as f32;
        (count, sum, squares, points) = (count + 1.0, sum + share, squares + share * share, points + one.tally.sending);
    }
    if count < 2.0 {
        return 1.0;
    }
    let deviation = ((squares - sum * sum / count) / count).max(0.0).sqrt();
    let by_chance = EDGE * of_edge(points as f64 / f64::from(count));
    1.0 + (APART - 1.0) * (0.5 * (deviation / by_chance - 1.0)).clamp(0.0, 1.0)
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
        let tally = Tally::default();
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
            settled: false,
            tally,
            said: PointAnswers::default(),
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
            let all_settled = self.points(arrivals, &mut asking, counts);
            let measure = arrivals.measure(self.light);
            for one in asking {
                let place = one.place(self.each);
                let sums = if all_settled || one.settled {
                    one.tally.sums(one.whole.as_ref(), measure)
                } else {
                    arrivals.beyond_points(self.light, &place, counts)
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
        let stride = asking.len().next_power_of_two();
        let most = MOST / stride;
        let by_beams = asking.iter().all(|one| one.view.trees);
        let (mut to, growth, part) = if by_beams { (FIRST, 2, 2.0) } else { (MASKED, GROWTH, 0.5) };
        let first = (part * wanted / asking.len() as f32) as usize;
        while to < first {
            to *= growth;
        }
        let tolerance = arrivals.tolerance_by_chance(self.share);
        let allowed = tolerance * DEVIATION;
        let part = 1.0 / self.rays as f32;
        let mut edges = PacketEdges::default();
        loop {
            let mut value = self.value + self.others * self.rays as f32;
            // What would arrive if nothing were in the way, of each kind, and by how many effective points that is told
            let (mut all, mut effective) = ([Rgb::BLACK; MOMENTS], [0.0; MOMENTS]);
            // The same of those rays only that may meet the edge of a shadow
            let (mut all_edge, mut effective_edge) = ([Rgb::BLACK; MOMENTS], [0.0; MOMENTS]);
            let (mut sending, mut hidden, mut is_known) = (0, 0, true);
            ask(&asker, asking, stride, to, &mut edges, counts);
            for one in asking.iter() {
                let (now, whole) = one.sums(measure);
                value += one.color(&now);
                for (k, (color, points)) in one.each(&whole).0.into_iter().zip(one.tally.effective()).enumerate() {
                    (all[k], effective[k]) = (all[k] + color, effective[k] + points);
                    if !one.settled {
                        (all_edge[k], effective_edge[k]) = (all_edge[k] + color, effective_edge[k] + points);
                    }
                }
                sending += one.tally.sending;
                hidden += one.tally.hidden;
                is_known &= one.whole.is_some();
            }
            let shows = |error: Rgb| arrivals.steps(value * part, error * part);
            // What few points send, or none, can be anything
            let sum = |of: &dyn Fn(usize) -> Rgb| (1..MOMENTS).fold(of(0), |sum, k| sum + of(k));
            let least = |k: usize| if k == 0 { TOLD.max(sending as f64 * UNEVEN) } else { TOLD };
            let untold = |k: usize| if effective[k] < least(k) { all[k] } else { Rgb::BLACK };
            let is_told = shows(sum(&untold)) <= tolerance * UNTOLD;
            let found = effective.iter().copied().fold(0.0, f64::max);
            // What none of so many points meets may hide what one of them sends
            let one = |k: usize| all[k] * (1.0 / effective[k].max(1.0) as f32);
            let is_clear = found >= f64::from(wanted) * CLEAR && shows(sum(&one)) <= UNMET;
            if is_told && is_known && hidden == 0 && (is_clear || to >= MANY) {
                return true;
            }
            // As much as packets that some edge runs through are wrong by; or a part of what one edge may be
            let apart = apart(asking);
            let least = if is_known { UNANIMOUS } else { EDGE };
            let wrong = |k: usize| {
                let (of, points) = (all_edge[k], effective_edge[k]);
                of * edges.deviation(points, sending, apart).max(least * of_edge(points))
            };
            let error = shows(sum(&wrong));
            if is_told && error <= allowed {
                return true;
            }
            // Rays are settled that nothing is in the way of, if enough points of them agree
            let is_clear = |one: &Asking| one.whole.is_some() && one.tally.hidden == 0;
            let agree: f64 = asking.iter().filter(|one| is_clear(one)).map(|one| one.tally.effective()[0]).sum();
            if agree >= f64::from(wanted) * CLEAR {
                asking.iter_mut().filter(|one| is_clear(one)).for_each(|one| one.settled = true);
            }
            // Errors shrink as they do where an edge is: what the most will not settle, cells do
            let asked = to;
            let ratio = |next: usize| of_edge(next as f64) / of_edge(asked as f64);
            if to == most {
                return false;
            }
            if error * ratio(most) > allowed {
                return false;
            }
            to *= growth;
            while to < most && error * ratio(to) > allowed {
                to *= growth;
            }
            to = to.min(most);
        }
    }
}
