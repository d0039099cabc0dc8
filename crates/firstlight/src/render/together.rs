//! One light, asked for at every ray of a patch, and judged by what all of them make together.
//!
//! Behind things a light is asked point by point. The rays ask different points, which are laid out together: n rays
//! need far fewer each than one that stands for all of them, and what one ray's points pass by, those of others meet.
//! What points cannot settle is left to each ray by itself.

use super::Counts;
use super::arrival::{Arrivals, Behind, Place, Seen};
use crate::color::Rgb;
use crate::integrate::{MOST, Masked, Sums, Tally, of_edge};
use crate::light::SERIES;
use crate::material::Bsdf;
use crate::math::LANES;
use crate::shape::SurfaceInteraction;

/// Points that find what is in the way of a pixel.
const POINTS: f32 = 512.0;
/// The part of them, of points that send alike, none of which is hidden where nothing is.
const CLEAR: f64 = 0.75;
/// The most that a ray begins with.
const FIRST: usize = 256;
/// How much farther off the sums may be than two numbers of points tell: of many rays, and of one more, which can agree
/// by chance.
const DOUBT: [f32; 2] = [2.0, 4.0];
/// The same of what the rays would make together by chance. Points of different series share a light better than by
/// chance: behind the same straight edge sixteen are wrong by half as much.
const DOUBT_BY_CHANCE: [f32; 2] = [1.0, 5.0];
/// The part of what may be wrong that points may tell nothing about.
const UNTOLD: f32 = 0.5;
/// The part of what chance makes of an edge that is wrong at the least: two numbers of points may agree for no reason.
const OF_EDGE: f32 = 0.4;

/// A ray whose light is behind things.
struct Asking {
    si: SurfaceInteraction,
    bsdf: Bsdf,
    series: usize,
    behind: Box<Behind>,
    tally: Tally,
    /// Of half as many points.
    before: Sums,
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
    /// What is known, all rays together: the light, and with what is there beside it.
    known: [Rgb; 2],
    value: Rgb,
}

impl Together {
    /// Of a patch with so many rays, `share` of its pixel. `salt` is anything that other pixels have other values of.
    pub fn new(light: usize, rays: usize, share: f32, salt: u32) -> Self {
        // Which of the series is first: any, but not by a pattern
        let series = (salt.wrapping_mul(0x9e37_79b9) >> 16) as usize % SERIES;
        let each = share / rays as f32;
        Together { light, each, share, series, rays: 0, asking: Vec::new(), known: [Rgb::BLACK; 2], value: Rgb::BLACK }
    }

    fn place<'a>(&self, arrivals: &Arrivals, si: &'a SurfaceInteraction, bsdf: &'a Bsdf, series: usize) -> Place<'a> {
        Place { share: self.each, series, ..arrivals.place(self.light, si, bsdf) }
    }

    /// Asks for what one ray sees.
    pub fn ask(&mut self, arrivals: &mut Arrivals, si: &SurfaceInteraction, bsdf: &Bsdf, counts: &mut Counts) {
        let series = self.series ^ (self.rays % SERIES);
        self.rays += 1;
        // What is integrated is wrong alike at all rays: that much by no more than if one stood for all
        let place = Place { share: self.share, ..self.place(arrivals, si, bsdf, series) };
        self.value += place.base;
        match arrivals.seen(self.light, &place, counts) {
            Seen::Known(sums) => self.add(&place.colors, &sums),
            Seen::Behind(behind) => {
                let (tally, before) = (Tally::default(), Sums::default());
                self.asking.push(Asking { si: *si, bsdf: *bsdf, series, behind, tally, before });
            }
        }
    }

    fn add(&mut self, colors: &[Rgb; 2], sums: &Sums) {
        let light = [colors[0] * sums.diffuse, colors[1] * sums.specular];
        self.known = [self.known[0] + light[0], self.known[1] + light[1]];
        self.value += light[0] + light[1];
    }

    /// What all rays see of the light, added up: diffuse and specular.
    pub fn finish(mut self, arrivals: &Arrivals, counts: &mut Counts) -> [Rgb; 2] {
        if self.asking.is_empty() {
            return self.known;
        }
        let mut asking = std::mem::take(&mut self.asking);
        let settled = self.points(arrivals, &mut asking, counts);
        for Asking { si, bsdf, series, behind, tally, .. } in &asking {
            let place = self.place(arrivals, si, bsdf, *series);
            let sums = if settled {
                tally.sums(&behind.whole)
            } else {
                let masked = arrivals.behind(self.light, &place, behind);
                let sums = masked.by_cells(&behind.view, &behind.whole, &arrivals.enough(&place));
                counts.points += masked.asked.get();
                sums
            };
            self.add(&place.colors, &sums);
        }
        self.known
    }

    /// Asks points of the light, more and more, until what they say together will do; whether it does in the end.
    fn points(&self, arrivals: &Arrivals, asking: &mut [Asking], counts: &mut Counts) -> bool {
        let wanted = POINTS * self.share.sqrt();
        let first = (0.5 * wanted / asking.len() as f32) as usize;
        let mut to = first.next_power_of_two().clamp(LANES, FIRST);
        let tolerance = arrivals.tolerance_by_chance(self.share);
        let part = 1.0 / self.rays as f32;
        let mut is_first = true;
        loop {
            let (mut value, mut moved, mut squares, mut all) = (self.value, Rgb::BLACK, Rgb::BLACK, Rgb::BLACK);
            let (mut hidden, mut worth, mut untold) = (0, 0.0, Rgb::BLACK);
            for one in asking.iter_mut() {
                let place = self.place(arrivals, &one.si, &one.bsdf, one.series);
                let masked: Masked = arrivals.behind(self.light, &place, &one.behind);
                masked.ask(&one.behind.view, &mut one.tally, to);
                counts.points += masked.asked.get();
                let now = one.tally.sums(&one.behind.whole);
                let of = |sums: &Sums| place.colors[0] * sums.diffuse + place.colors[1] * sums.specular;
                let off = of(&now) + of(&one.before) * -1.0;
                (value, moved, squares) = (value + of(&now), moved + off, squares + off * off);
                all += of(&one.behind.whole);
                hidden += one.tally.hidden;
                worth += one.tally.worth();
                let [diffuse, highlight] = one.tally.is_uneven(&one.behind.whole);
                let part = |is_uneven: bool, sum: f32| if is_uneven { sum } else { 0.0 };
                let whole = &one.behind.whole;
                untold +=
                    of(&Sums { diffuse: part(diffuse, whole.diffuse), specular: part(highlight, whole.specular) });
                one.before = now;
            }
            let points = (to * asking.len()) as f32;
            // What few points send, or none, can be anything
            if arrivals.steps(value * part, untold * part) > tolerance * UNTOLD {
                return false;
            }
            let is_clear = hidden == 0 && (worth >= f64::from(wanted) * CLEAR || to == MOST);
            if is_clear {
                return true;
            }
            // By how much the sum moved, or by as much as its parts would together if they moved by chance
            let doubt = |[many, one]: [f32; 2]| many + one / asking.len() as f32;
            let off = Rgb::max(moved.map(f32::abs) * doubt(DOUBT), squares.map(f32::sqrt) * doubt(DOUBT_BY_CHANCE));
            let error = off.max(all * (of_edge(points) * OF_EDGE));
            if hidden > 0 && !is_first && arrivals.steps(value * part, error * part) <= tolerance {
                return true;
            }
            if to == MOST {
                return false;
            }
            (to, is_first) = (to * 2, false);
        }
    }
}
