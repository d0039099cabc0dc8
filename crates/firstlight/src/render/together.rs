//! One light, asked for at every ray of a patch, and judged by what all of them make together.
//!
//! Behind things a light is asked point by point ([`ladder`](super::ladder)). The rays ask different points, which are
//! stratified together: n rays need far fewer each than one that stands for all of them, and what one ray's points pass
//! by, those of others meet. Their number grows until what they say together will do.

use super::Counts;
use super::asking::{AskedLeaves, Asking, EVENLY, MOST, parts};
use super::direct::{DirectLighting, Occlusion};
use super::ladder::{FIRST, LAST};
use super::packets::{Packets, of_edge};
use super::tally::Tally;
use crate::color::Rgb;
use crate::film::resolve::LightTerm;
use crate::ids::SurfaceId;
use crate::integrate::TOLERANCE;
use crate::light::SERIES;
use crate::material::{MOMENTS, Moments, ShadingPoint};
use crate::visibility::{ShadowView, Visibility};

/// So many points of all rays tell that all of the light is hidden: near black, anything shows.
const ALL_HIDDEN: usize = 1 << 14;

/// A ray of which nothing is known yet but that nothing is in the way, if that is, or nothing in trees.
struct Looking {
    point: ShadingPoint,
    occlusion: Occlusion,
}

/// What the rays of one patch ask of one light.
pub(crate) struct Together {
    light: usize,
    /// What its moments are multiplied with.
    scale: Rgb,
    /// The share of the pixel that a ray has, and that of the patch.
    each: f32,
    share: f32,
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
}

/// Anything that other pixels have other values of, and other surfaces in them.
pub(crate) fn salt([i, j]: [u32; 2], surface: SurfaceId) -> u32 {
    i ^ j.rotate_left(16) ^ surface.index() as u32
}

impl Together {
    /// Of a patch with so many rays, `share` of its pixel. By its [`salt`] it asks other points than others; `others`
    /// is what other lights send to a ray, at least.
    pub fn new(lights: &DirectLighting, light: usize, rays: usize, share: f32, salt: u32, others: Rgb) -> Self {
        // Which of the series is first: any, but not by a pattern
        let series = (salt.wrapping_mul(0x9e37_79b9) >> 16) as usize % SERIES;
        let each = share / rays as f32;
        let (sums, terms) = (Moments::default(), LightTerm::BLACK);
        Together {
            light,
            scale: lights.scale(light),
            each,
            share,
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
        self.share *= TOLERANCE.node_pixels;
        self.each *= TOLERANCE.node_pixels;
        self
    }

    /// The same where so many of all lights that are integrated are asked for points.
    pub fn of_lights(mut self, asked: usize, lights: &DirectLighting) -> Self {
        let all = lights.lights.integrated.max(1);
        self.room = (all as f32 / asked.clamp(1, all) as f32).sqrt();
        self
    }

    /// Asks for what one ray sees, past what may occlude the light.
    pub fn ask(
        &mut self,
        lights: &mut DirectLighting,
        point: &ShadingPoint,
        occlusion: Occlusion,
        counts: &mut Counts,
    ) {
        let point = ShadingPoint { share: self.share, part_of_points: f32::INFINITY, ..*point };
        if lights.is_integrated(self.light) {
            self.looking.push(Looking { point, occlusion });
        } else {
            let moments = lights.estimate_one(self.light, &point, occlusion, counts).moments;
            self.know(&point, &moments);
            self.shares += if occlusion == Occlusion::None { 1.0 } else { f32::NAN };
            self.sharing += 1;
        }
    }

    /// Asks points of the light for one ray, as nobody knows what it sees.
    pub fn ask_points(&mut self, lights: &mut DirectLighting, point: &ShadingPoint, counts: &mut Counts) {
        counts.visibility.classes[Visibility::Partial as usize] += 1;
        match lights.classify_one(self.light, point, counts) {
            Some(view) => self.behind(point, view),
            None => self.dark(point),
        }
    }

    /// Hears what one ray sees.
    pub fn know(&mut self, point: &ShadingPoint, sums: &Moments) {
        self.rays += 1;
        self.value += point.base;
        self.add(point, sums);
    }

    /// Hears that something hides all of the light from a ray.
    pub fn dark(&mut self, point: &ShadingPoint) {
        self.know(point, &Moments::default());
        self.sharing += 1;
    }

    /// Asks for what one ray sees past what is in `view`.
    pub fn behind(&mut self, point: &ShadingPoint, view: ShadowView) {
        let series = self.series ^ (self.rays % SERIES);
        self.rays += 1;
        self.value += point.base;
        self.asking.push(Asking {
            point: ShadingPoint { part_of_points: f32::INFINITY, ..*point },
            scale: self.scale,
            series,
            view,
            whole: None,
            known: None,
            tally: Tally::default(),
        });
    }

    fn add(&mut self, point: &ShadingPoint, sums: &Moments) {
        self.terms += point.bsdf.colors.each(sums);
        self.value += (self.scale * point.bsdf.colors).of(sums);
        self.sums += *sums;
    }

    /// What some points of one pixel see of a light, of which nothing is known.
    pub fn of_points(
        light: usize,
        points: &[ShadingPoint],
        salt: u32,
        lights: &mut DirectLighting,
        counts: &mut Counts,
    ) -> Outcome {
        let share = points.iter().map(|point| point.share).fold(0.0, f32::max);
        let mut together = Together::new(lights, light, points.len(), share, salt, Rgb::BLACK);
        points.iter().for_each(|point| together.ask(lights, point, Occlusion::Unknown, counts));
        together.finish(lights, counts)
    }

    /// What all rays see of the light.
    pub fn finish(self, lights: &mut DirectLighting, counts: &mut Counts) -> Outcome {
        let mut one = [self];
        Together::tell(&mut one, lights, counts);
        let [one] = one;
        one.settle(lights, counts)
    }

    /// Has the rays of some patches, which ask the same light, told all that batches know of it.
    pub fn tell(all: &mut [Together], lights: &mut DirectLighting, counts: &mut Counts) {
        let Some(light) = all.first().map(|one| one.light) else { return };
        let looking: Vec<Vec<Looking>> = all.iter_mut().map(|one| std::mem::take(&mut one.looking)).collect();
        let mut points = Vec::new();
        for (one, looking) in all.iter().zip(&looking) {
            // What is integrated is wrong alike at all rays: by no more than if one represented all
            let (share, part_of_points) = (one.share, 1.0 / (one.asking.len() + looking.len()) as f32);
            points.extend(looking.iter().map(|one| ShadingPoint { share, part_of_points, ..one.point }));
        }
        if points.is_empty() {
            return;
        }
        let occlusions: Vec<Occlusion> = looking.iter().flatten().map(|one| one.occlusion).collect();
        let estimates = lights.estimate_each(light, &points, |k| occlusions[k], counts);
        let mut seen = points.iter().zip(&estimates).zip(&occlusions);
        for (one, looking) in all.iter_mut().zip(&looking) {
            for ((point, estimate), occlusion) in seen.by_ref().take(looking.len()) {
                if !estimate.moments.is_known() {
                    one.ask_points(lights, point, counts);
                    continue;
                }
                one.know(point, &estimate.moments);
                one.shares += if *occlusion == Occlusion::None { 1.0 } else { f32::NAN };
                one.sharing += 1;
            }
        }
    }

    /// Asks points of the light, as it is known by now what batches know.
    pub fn settle(mut self, lights: &mut DirectLighting, counts: &mut Counts) -> Outcome {
        if !self.asking.is_empty() {
            let mut asking = std::mem::take(&mut self.asking);
            asking.iter_mut().for_each(|one| one.tally = lights.tally());
            let measure = lights.measure(self.light);
            self.points(lights, &mut asking, counts);
            let shares = parts(&asking, |tally| &tally.lit);
            for one in asking {
                let place = one.place(self.each);
                let sums = one.known.unwrap_or_else(|| one.tally.arrives(&one.sent(measure), &shares));
                if one.tally.sending > 0.0 {
                    self.shares += 1.0 - (one.tally.hidden / one.tally.sending) as f32;
                    self.sharing += 1;
                }
                self.add(&place, &sums);
                lights.keep(one.view);
                lights.keep_tally(one.tally);
            }
        }
        let share = self.shares / self.sharing.max(1) as f32;
        Outcome { terms: self.terms, sums: self.sums, share }
    }

    /// Asks points of the light, more and more, until what they say together will do. What the most will not settle is
    /// asked in closed form.
    fn points(&self, lights: &mut DirectLighting, asking: &mut [Asking], counts: &mut Counts) {
        let asker = lights.asker(self.light);
        let mut begin = TOLERANCE.first_points / (lights.scene.tolerance() as f32).sqrt();
        let place = asking[0].place(self.each);
        if !lights.varies_over(self.light, &place, asker.area.diagonal() / begin.sqrt()) {
            begin *= TOLERANCE.nearer;
        }
        let first = (begin * self.share.sqrt() / asking.len() as f32) as usize;
        let first = first.next_power_of_two().clamp(FIRST, LAST);
        let allowed = lights.tolerance_by_chance(self.share) * self.room;
        let mut is_tried = false;
        let mut asked = AskedLeaves::new(asker, first, asking, counts);
        let mut packets = None;
        let (mut is_plain, mut is_halved) = (true, true);
        loop {
            asking.iter_mut().for_each(|one| one.tally.sum(asker.level, &asked.leaves));
            let said = self.said(asking, is_plain, asker.area.stands_for());
            let packets = packets.get_or_insert_with(|| Packets::new(said.sent));
            let wrong = self.wrong(&said, packets, &mut asked, asking, lights);
            let points = asked.leaves.count() * asking.len();
            let is_told = said.shows(lights, &|k| said.untold(k)) <= allowed * TOLERANCE.untold;
            let is_lit = !said.is_hidden && self.is_clear(&said);
            let is_dark = said.is_dark && points >= ALL_HIDDEN;
            let is_last = points >= MOST || !is_halved;
            let is_enough = is_last || is_told && (is_lit || is_dark || wrong.error() <= allowed);
            // Points are taken at their word for what would arrive if nothing were in the way, if they cannot miss any
            // of it
            let is_wanted =
                is_enough || (!is_told || wrong.smooth > allowed) && (wrong.edges <= allowed || points >= EVENLY);
            if is_plain && is_wanted && (wrong.smooth > allowed || self.may_miss(&said, points, asking, lights)) {
                self.ask_wholes(asking, lights, counts);
                is_plain = false;
                continue;
            }
            if is_enough {
                return;
            }
            // Errors shrink as they do where an edge is
            if !is_tried && wrong.error() * of_edge(MOST as f64) > allowed * of_edge(points as f64) {
                is_tried = true;
                let places: Vec<_> = asking.iter().map(|one| one.place(self.each)).collect();
                let estimates = lights.estimate_each(self.light, &places, |_| Occlusion::Unknown, counts);
                let known = estimates.iter().map(|one| one.moments.is_known().then_some(one.moments));
                asking.iter_mut().zip(known).for_each(|(one, known)| one.known = known);
                if asking.iter().all(|one| one.known.is_some()) {
                    return;
                }
            }
            // More everywhere as long as there is room for more near edges
            let is_raised = !is_told || wrong.unmet.max(wrong.overlooked) > allowed || !asked.is_raised;
            let is_raised = is_raised && (4 * points <= MOST || wrong.edges <= allowed);
            is_halved = asked.halve(&wrong.near, is_raised, is_told, asking, counts);
        }
    }

    /// What points of all rays say of a light of such a measure, and, where `is_plain`, what would arrive if nothing
    /// were in the way.
    fn said(&self, asking: &[Asking], is_plain: bool, measure: f32) -> PointsSaid {
        let shares = parts(asking, |tally| &tally.lit);
        let value = self.value + self.others * self.rays as f32;
        let surprises = parts(asking, |tally| &tally.surprises);
        let mut said = PointsSaid {
            part: 1.0 / self.rays as f32,
            value,
            all: [Rgb::BLACK; MOMENTS],
            missing: [Rgb::BLACK; MOMENTS],
            effective: [0.0; MOMENTS],
            is_hidden: false,
            is_dark: shares.iter().all(|share| *share == 0.0),
            sent: [0.0; MOMENTS],
            found: None,
            surprises,
        };
        for one in asking {
            let sent = one.sent(measure);
            said.value += one.color(&one.tally.arrives(&sent, &shares));
            for (k, (color, points)) in one.each(&sent).0.into_iter().zip(one.tally.effective()).enumerate() {
                said.all[k] += color;
                said.effective[k] += points;
                said.sent[k] += sent.0[k];
                if one.tally.all[k] as f32 * measure < 0.75 * sent.0[k] {
                    said.missing[k] += color;
                }
            }
            said.is_hidden |= one.tally.hidden > 0.0;
        }
        said.sent = said.sent.map(|sent| sent / measure);
        let found = |k: usize| asking.iter().map(|one| one.tally.all[k]).sum::<f64>() as f32 / said.sent[k];
        said.found = (!is_plain).then(|| std::array::from_fn(found));
        said
    }

    /// How far off that may be, by their packets and by what points met.
    fn wrong(
        &self,
        said: &PointsSaid,
        packets: &mut Packets,
        asked: &mut AskedLeaves,
        asking: &[Asking],
        lights: &DirectLighting,
    ) -> Wrong {
        let tallies: Vec<&Tally> = asking.iter().map(|one| &one.tally).collect();
        let new = asked.take_new();
        packets.hear(lights.level(), &tallies, &asked.leaves, &new);
        let packets = packets.errors(&tallies, &asked.leaves, said.found);
        let effective = said.effective.map(|points| points.max(1.0) as f32);
        let met: [f32; MOMENTS] = std::array::from_fn(|k| said.surprises[k] + 1.0 / effective[k]);
        let shows = |part: &dyn Fn(usize) -> f32| said.shows(lights, &|k| said.all[k] * part(k));
        // As much as packets are wrong by, and what nobody met: about what points found away from edges that nobody
        // expected, and one more (Good, "The population frequencies of species and the estimation of population
        // parameters", 1953). Of small things that are in the way each point says what it sends; where leaves near
        // those that were found are smaller, all that were not found are missing
        let noise = |k: usize| TOLERANCE.stratified * (met[k] / effective[k]).sqrt();
        let overlooked = shows(&|k| met[k]);
        let unmet = shows(&|k| noise(k).max(packets.smooth[k]));
        Wrong {
            edges: shows(&|k| packets.edges[k]),
            smooth: shows(&|k| packets.smooth[k]),
            unmet: if asked.is_even() { unmet } else { unmet.max(overlooked) },
            overlooked,
            near: packets.near,
        }
    }

    /// Whether enough points are asked to find what is in the way.
    fn is_clear(&self, said: &PointsSaid) -> bool {
        said.effective.iter().copied().fold(0.0, f64::max) >= f64::from(TOLERANCE.clear * self.share.sqrt())
    }

    /// Whether so many points may miss some of what would arrive if nothing were in the way.
    fn may_miss(&self, said: &PointsSaid, points: usize, asking: &[Asking], lights: &DirectLighting) -> bool {
        let apart = lights.asker(self.light).area.diagonal() / (points as f32).sqrt();
        let is_unseen =
            |k: usize| said.effective[k] < f64::from(TOLERANCE.told) && asking.iter().any(|one| one.reflects(k));
        (0..MOMENTS).any(is_unseen)
            || asking.iter().any(|one| !lights.varies_over(self.light, &one.place(self.each), apart))
    }

    /// Asks what would arrive at all rays if nothing were in the way.
    fn ask_wholes(&self, asking: &mut [Asking], lights: &mut DirectLighting, counts: &mut Counts) {
        let places: Vec<_> = asking.iter().map(|one| one.place(self.each)).collect();
        let wholes = lights.estimate_each(self.light, &places, |_| Occlusion::None, counts);
        asking.iter_mut().zip(wholes).for_each(|(one, whole)| one.whole = Some(whole.moments));
    }
}

/// What points of a light say, of all rays of a patch together, and of each kind.
struct PointsSaid {
    /// One over the rays of the patch.
    part: f32,
    /// All that is there.
    value: Rgb,
    /// What would arrive if nothing were in the way, and that of rays whose points find less than three quarters of it.
    all: [Rgb; MOMENTS],
    missing: [Rgb; MOMENTS],
    /// By how many effective points that is told.
    effective: [f64; MOMENTS],
    /// Whether any of the light is hidden from any ray, and whether all of it is from all.
    is_hidden: bool,
    is_dark: bool,
    /// What would arrive, in the unit of points, and the part of it that they find, if they do not tell themselves.
    sent: [f32; MOMENTS],
    found: Option<[f32; MOMENTS]>,
    /// The part of what all send that points sent which found what nobody expected.
    surprises: [f32; MOMENTS],
}

impl PointsSaid {
    /// How many display steps an error makes, which is so much of each kind.
    fn shows(&self, lights: &DirectLighting, error: &dyn Fn(usize) -> Rgb) -> f32 {
        let sum = (1..MOMENTS).fold(error(0), |sum, k| sum + error(k));
        lights.steps(self.value * self.part, sum * self.part)
    }

    /// What one of the points sends.
    fn one(&self, k: usize) -> Rgb {
        self.all[k] * (1.0 / self.effective[k].max(1.0) as f32)
    }

    /// What few points send, or none, can be off by what some of them do.
    fn untold(&self, k: usize) -> Rgb {
        if self.effective[k] < f64::from(TOLERANCE.told) { self.all[k].min(self.one(k)) } else { self.missing[k] }
    }
}

/// In display steps: how far off what points say may be.
struct Wrong {
    /// By edges that they see, by what varies, by that and what they did not meet yet, and by what is overlooked in
    /// leaves that stay as they are.
    edges: f32,
    smooth: f32,
    unmet: f32,
    overlooked: f32,
    /// Where edges are.
    near: Vec<bool>,
}

impl Wrong {
    /// All in all.
    fn error(&self) -> f32 {
        (self.edges * self.edges + self.unmet * self.unmet).sqrt()
    }
}
