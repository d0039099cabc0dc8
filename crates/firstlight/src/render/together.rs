//! One light, asked for at every ray of a patch, and judged by what all of them make together.
//!
//! Behind things a light is asked point by point ([`ladder`](super::ladder)). The rays ask different points, which are
//! stratified together: n rays need far fewer each than one that stands for all of them, and what one ray's points pass
//! by, those of others meet. Their number grows until what they say together will do. What points cannot settle, since
//! few of them send nearly all, is left to cells.

use super::Counts;
use super::arrival::{Arrivals, Place, Seen};
use super::ladder::{FIRST, GROWTH, MOST, Tally, of_edge};
use crate::color::Rgb;
use crate::integrate::Sums;
use crate::light::SERIES;
use crate::material::{Bsdf, Lobe};
use crate::shape::SurfaceInteraction;
use crate::visibility::View;

/// Points that find what is in the way of a pixel.
const POINTS: f32 = 512.0;
/// The effective part of them, none of which is hidden where nothing is.
const CLEAR: f64 = 0.75;
/// How much farther off the sums may be than two numbers of points tell: of many rays, and of one more, which can agree
/// by chance.
const DOUBT: [f32; 2] = [2.0, 4.0];
/// The same of what the rays would make together by chance. Points of different series share a light better than by
/// chance: behind the same straight edge sixteen are wrong by half as much.
const DOUBT_BY_CHANCE: [f32; 2] = [1.0, 5.0];
/// The part of what may be wrong that points may tell nothing about.
const UNTOLD: f32 = 0.5;
/// Effective points of all rays together that tell something.
const TOLD: f64 = 32.0;
/// The same of the diffuse part, as a part of all points: fewer, and the light is so near that its points miss where it
/// is nearest.
const UNEVEN: f64 = 1.0 / 16.0;
/// The part of what chance makes of an edge that is wrong at the least: two numbers of points may agree for no reason.
const OF_EDGE: f32 = 0.4;
/// Points cost more the more there are: the tolerance grows with their number, to so many times what it is for few at
/// [`MOST`] of a ray. Where that is not met either, there are more, up to so many of a pixel.
const COARSE: f32 = 3.5;
const MOST_OF_ALL: usize = MOST * SERIES;

/// A ray whose light is behind things.
struct Asking {
    si: SurfaceInteraction,
    lobe: Lobe,
    base: Rgb,
    colors: [Rgb; 2],
    series: usize,
    view: View,
    /// What would arrive if nothing were in the way, if that is known.
    whole: Option<Sums>,
    /// Whether points of the light may miss most of what it sends.
    may_miss: bool,
    tally: Tally,
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
    asking: Vec<Asking>,
    /// What is known, all rays together: the light, before colours and with them, and with what is there beside it.
    sums: Sums,
    known: [Rgb; 2],
    value: Rgb,
}

impl Together {
    /// Of a patch with so many rays, `share` of its pixel. `salt` is anything that other pixels have other values of.
    pub fn new(light: usize, rays: usize, share: f32, salt: u32) -> Self {
        // Which of the series is first: any, but not by a pattern
        let series = (salt.wrapping_mul(0x9e37_79b9) >> 16) as usize % SERIES;
        let each = share / rays as f32;
        let (sums, known) = (Sums::default(), [Rgb::BLACK; 2]);
        Together { light, each, share, series, rays: 0, asking: Vec::new(), sums, known, value: Rgb::BLACK }
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
        // What is integrated is wrong alike at all rays: that much by no more than if one stood for all
        let place = Place { share: self.share, lit, clear, ..arrivals.place(self.light, si, bsdf) };
        match arrivals.seen(self.light, &place, counts) {
            Seen::Known(sums) => self.know(&place, &sums),
            Seen::Behind(whole) => match arrivals.settle(self.light, si, counts) {
                Some(view) => self.behind(arrivals, &place, whole, view),
                None => self.know(&place, &Sums::default()),
            },
        }
    }

    /// Hears what one ray sees.
    pub fn know(&mut self, place: &Place, sums: &Sums) {
        self.rays += 1;
        self.value += place.base;
        self.add(&place.colors, sums);
    }

    /// Asks for what one ray sees past what is in `view`. `whole` is what would arrive if nothing were in the way, if
    /// that is known.
    pub fn behind(&mut self, arrivals: &Arrivals, place: &Place, whole: Option<Sums>, view: View) {
        let series = self.series ^ (self.rays % SERIES);
        self.rays += 1;
        self.value += place.base;
        let Place { si, lobe, base, colors, .. } = *place;
        let tally = Tally::default();
        let may_miss = whole.is_none() && arrivals.may_miss(self.light, place);
        self.asking.push(Asking { si: *si, lobe: *lobe, base, colors, series, view, whole, may_miss, tally });
    }

    fn add(&mut self, colors: &[Rgb; 2], sums: &Sums) {
        let light = [colors[0] * sums.diffuse, colors[1] * sums.specular];
        self.known = [self.known[0] + light[0], self.known[1] + light[1]];
        self.value += light[0] + light[1];
        self.sums = self.sums + *sums;
    }

    /// What all rays see of the light, added up: diffuse and specular, with all colours and without.
    pub fn finish(mut self, arrivals: &mut Arrivals, counts: &mut Counts) -> ([Rgb; 2], Sums) {
        if !self.asking.is_empty() {
            let mut asking = std::mem::take(&mut self.asking);
            let settled = self.points(arrivals, &mut asking, counts);
            let measure = arrivals.measure(self.light);
            for Asking { si, lobe, base, colors, tally, whole, view, .. } in asking {
                let place = Place { share: self.each, ..Place::point(&si, &lobe, base, colors) };
                let sums = if settled {
                    tally.sums(whole.as_ref(), measure)
                } else {
                    arrivals.by_cells(self.light, &place, counts)
                };
                self.add(&colors, &sums);
                arrivals.keep(view);
            }
        }
        (self.known, self.sums)
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
        let most = (MOST_OF_ALL / stride).max(MOST);
        let first = (0.5 * wanted / asking.len() as f32) as usize;
        let mut to = if first <= FIRST { FIRST } else { FIRST * GROWTH };
        let tolerance = arrivals.tolerance_by_chance(self.share);
        let part = 1.0 / self.rays as f32;
        loop {
            let (mut value, mut moved, mut squares) = (self.value, Rgb::BLACK, Rgb::BLACK);
            // What would arrive if nothing were in the way, of each kind, and by how many effective points that is told
            let (mut all, mut effective) = ([Rgb::BLACK; 2], [0.0; 2]);
            let (mut hidden, mut is_known) = (0, true);
            for one in asking.iter_mut() {
                let colors = one.colors;
                let before = one.tally.count;
                let (half, traced) = one.tally.ask(&asker, &mut one.view, &one.si, &one.lobe, (one.series, stride), to);
                counts.settled.traced += traced;
                counts.shadow_rays += (one.tally.count - before) as u64;
                counts.shadow_rays_skipped += (one.tally.count - before) as u64;
                let now = one.tally.sums(one.whole.as_ref(), measure);
                let of = |sums: &Sums| colors[0] * sums.diffuse + colors[1] * sums.specular;
                let off = of(&now) + of(&half.sums(one.whole.as_ref(), measure)) * -1.0;
                (value, moved, squares) = (value + of(&now), moved + off, squares + off * off);
                let whole = one.whole.unwrap_or_else(|| one.tally.whole(measure));
                all = [all[0] + colors[0] * whole.diffuse, all[1] + colors[1] * whole.specular];
                for (sum, one) in effective.iter_mut().zip(one.tally.effective()) {
                    *sum += one;
                }
                hidden += one.tally.hidden;
                is_known &= one.whole.is_some();
            }
            let shows = |error: Rgb| arrivals.steps(value * part, error * part);
            // What few points send, or none, can be anything
            let least = [TOLD.max((to * asking.len()) as f64 * UNEVEN), TOLD];
            let untold = [0, 1].map(|k| if effective[k] < least[k] { all[k] } else { Rgb::BLACK });
            let is_told = shows(untold[0] + untold[1]) <= tolerance * UNTOLD;
            let found = effective[0].max(effective[1]);
            if is_told && is_known && hidden == 0 && (found >= f64::from(wanted) * CLEAR || to >= MOST) {
                return true;
            }
            // By how much the sum moved, or by as much as its parts would together if they moved by chance
            let doubt = |[many, one]: [f32; 2]| many + one / asking.len() as f32;
            let off = Rgb::max(moved.map(f32::abs) * doubt(DOUBT), squares.map(f32::sqrt) * doubt(DOUBT_BY_CHANCE));
            let edge = (all[0] * of_edge(effective[0]) + all[1] * of_edge(effective[1])) * OF_EDGE;
            let error = shows(off.max(edge));
            let allowed = |to: usize| tolerance * (1.0 + (COARSE - 1.0) * (to.min(MOST) as f32 / MOST as f32));
            if is_told && error <= allowed(to) {
                return true;
            }
            if to == most {
                return is_told;
            }
            // The next that will do, as errors shrink where an edge is
            let mut next = (to * GROWTH).min(most);
            let ratio = |next: usize| of_edge(next as f64) / of_edge(to as f64);
            while next < MOST && error * ratio(next) > allowed(next) {
                next *= GROWTH;
            }
            to = next;
        }
    }
}
