//! The integral of a light behind anything: a mask over fixed points, their number doubled until the answer stands still.
//!
//! The points say what share of the light arrives; how much the whole would be is known exactly. So where nothing is in
//! the way, or everything, the points' own error is nothing. Where as many points as are worth while do not do, cells take
//! over: [`cells`].

use std::cell::Cell;
use std::sync::OnceLock;

use super::Sums;
use super::between::Between;
use super::cells::{self, Sent, Source};
use super::emitter::Emitter;
use super::near::Near;
use super::view::{Outline, View};
use crate::accel::RayPacket16;
use crate::ids::LightId;
use crate::light::{SERIES, point_of_series};
use crate::material::Lobe;
use crate::math::{LANES, ShadowRay, Vec3};
use crate::scene::{Scene, ShadowRays};
use crate::shape::SurfaceInteraction;

/// The fewest and the most points.
const FEWEST: usize = 256;
/// Parts of a pixel up to this share are small.
const SMALL: f32 = 0.25;
pub(crate) const MOST: usize = 1 << 10;
/// How much farther off the share may be than two numbers of points tell: both can be off to the same side, and are so all over
/// a surface, since all of it asks the same points.
const DOUBT: f32 = 4.0;
/// Three standard deviations of the share of a light that the edge of a shadow cuts off, for each n^(-3/4): by that n points are
/// wrong, chosen by chance in as many squares, since the edge runs through a root of n of them.
const EDGE: f32 = 1.0;
/// Where none of so many times the first points is hidden, of points that send alike, nothing is.
const CLEAR: f64 = 1.5;
/// The share of points that have to be as good as alike.
const UNEVEN: f64 = 1.0 / 16.0;

/// Points of the square [-1, 1]^2, and what they are on a disk: series by series.
struct Points {
    square: Vec<[f32; 2]>,
    disk: Vec<[f32; 2]>,
}

fn points() -> &'static Points {
    static POINTS: OnceLock<Points> = OnceLock::new();
    POINTS.get_or_init(|| {
        let each = |series| (0..MOST as u32).map(move |k| point_of_series(k, series).map(|w| (2.0 * w - 1.0) as f32));
        let mut square: Vec<[f32; 2]> = (0..SERIES).flat_map(each).collect();
        // Those that are asked together are near each other: so are the ways to them
        for series in square.chunks_exact_mut(MOST) {
            let (mut from, mut to) = (0, LANES);
            while from < MOST {
                series[from..to].sort_by_key(|place| curve(*place));
                (from, to) = (to, to * 2);
            }
        }
        let disk = square.iter().map(|p| crate::light::concentric(p.map(f64::from)).map(|w| w as f32)).collect();
        Points { square, disk }
    })
}

/// How far `count` points may be wrong about the share of a light on one side of an edge.
pub(crate) fn of_edge(count: f32) -> f32 {
    let root = count.sqrt();
    EDGE / (root * root.sqrt())
}

/// Where a point of the square [-1, 1]^2 lies on Morton's curve through 256 x 256 cells.
fn curve(place: [f32; 2]) -> u32 {
    let [x, y] = place.map(|w| ((w + 1.0) * 128.0) as u32);
    (0..8).fold(0, |code, bit| code | (x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1))
}

/// A light behind things, seen from a surface.
pub(crate) struct Masked<'a> {
    pub scene: &'a Scene,
    pub light: usize,
    pub emitter: &'a Emitter,
    pub si: &'a SurfaceInteraction,
    pub lobe: &'a Lobe,
    pub between: &'a Between,
    /// The share of a pixel that asks. Of small parts, each with an error of its own, less is asked.
    pub share: f32,
    /// Which of the [`SERIES`] is asked: what one passes by, others meet.
    pub series: usize,
    /// How many points were asked.
    pub asked: Cell<u64>,
}

/// What the first points of a series say: sums of what they would send, and of what of it arrives.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tally {
    all: [f64; 2],
    lit: [f64; 2],
    /// Of the squares of what they would send.
    squares: [f64; 2],
    /// How many points were asked, and how many of them are hidden.
    pub count: usize,
    pub hidden: usize,
}

impl Tally {
    /// `whole` is what arrives where nothing is in the way.
    pub fn sums(&self, whole: &Sums) -> Sums {
        let share =
            |i: usize, whole: f32| if self.all[i] > 0.0 { whole * (self.lit[i] / self.all[i]) as f32 } else { 0.0 };
        Sums { diffuse: share(0, whole.diffuse), specular: share(1, whole.specular) }
    }
}

impl Tally {
    /// Whether a few points send most of it, or none sends any, so that the others tell nothing: of the diffuse part, of a highlight.
    pub fn is_uneven(&self, whole: &Sums) -> [bool; 2] {
        let alike = self.alike();
        let is_uneven = |k: usize, whole: f32| {
            if self.squares[k] > 0.0 { alike[k] < UNEVEN * self.count as f64 } else { whole > 0.0 }
        };
        [is_uneven(0, whole.diffuse), is_uneven(1, whole.specular)]
    }

    /// As many points that send alike would be as good as these.
    fn alike(&self) -> [f64; 2] {
        [0, 1].map(|k| self.all[k] * self.all[k] / self.squares[k])
    }

    /// As many points that send alike as would be as good for the diffuse part.
    pub fn worth(&self) -> f64 {
        if self.squares[0] > 0.0 { self.alike()[0] } else { self.count as f64 }
    }
}

impl Masked<'_> {
    /// What arrives, and how far it may be wrong. `whole` is what would arrive if nothing were in the way.
    pub fn integrate(&self, view: &View, whole: &Sums, enough: &dyn Fn(&Sums, &Sums) -> bool) -> (Sums, Sums) {
        let seen = self.seen(view);
        let mut tally = Tally::default();
        let mut before: [Option<Sums>; 2] = [None; 2];
        let is_small = self.share <= SMALL;
        let (fewest, doubt) = if is_small { (FEWEST / 4, 2.0) } else { (FEWEST, DOUBT) };
        let mut to = fewest;
        loop {
            seen.ask(&mut tally, to);
            let now = tally.sums(whole);
            if let [Some(before), earlier] = before {
                let off = |of: fn(&Sums) -> f32| {
                    let earlier = earlier.map_or(0.0, |sums| (of(&sums) - of(&before)).abs() * 0.5);
                    (of(&now) - of(&before)).abs().max(earlier)
                };
                // What one more point could change is the least that can be wrong, and what points make of a shadow's edge
                let has_edge = !is_small && (1..to).contains(&tally.hidden);
                if has_edge && !enough(&now, &(*whole * of_edge(MOST as f32))) {
                    return cells::integrate(&seen, Some(whole), enough);
                }
                let one = if has_edge { of_edge(to as f32) } else { 1.0 / to as f32 };
                let error = Sums {
                    diffuse: (doubt * off(|sums| sums.diffuse)).max(whole.diffuse * one),
                    specular: (doubt * off(|sums| sums.specular)).max(whole.specular * one),
                };
                let [diffuse, highlight] = tally.is_uneven(whole);
                let shows = || !enough(&now, &Sums { diffuse: 0.0, specular: whole.specular });
                let is_uneven = diffuse || highlight && shows();
                // Where nothing is hidden, so many have to have said so
                let is_clear = tally.hidden == 0 && (tally.worth() >= fewest as f64 * CLEAR || to == MOST);
                if !is_uneven && (is_clear || tally.hidden > 0 && enough(&now, &error)) {
                    return (now, error);
                }
                if to == MOST {
                    return cells::integrate(&seen, Some(whole), enough);
                }
            }
            before = [Some(now), before[0]];
            to *= 2;
        }
    }

    /// Goes on with the points of the series, up to so many.
    pub fn ask(&self, view: &View, tally: &mut Tally, to: usize) {
        self.seen(view).ask(tally, to);
    }

    /// What arrives, by cells from the beginning.
    pub fn by_cells(&self, view: &View, whole: &Sums, enough: &dyn Fn(&Sums, &Sums) -> bool) -> Sums {
        cells::integrate(&self.seen(view), Some(whole), enough).0
    }

    fn seen<'b>(&'b self, view: &'b View) -> Seen<'b> {
        let ball = match self.emitter {
            Emitter::Ball { center, radius } => {
                let to = *center - self.si.lit_from.as_dvec3();
                Some((to.as_vec3(), (to.length_squared() - radius * radius).max(0.0) as f32))
            }
            _ => None,
        };
        Seen { masked: self, view, ball, near: Near::new(view) }
    }

    /// Which of sixteen ways something stands in.
    pub(super) fn hidden(&self, places: &[[f32; 2]], ways: &[Vec3; LANES], active: u16) -> u16 {
        let lanes = |mask: u16| (0..LANES).filter(move |lane| mask >> lane & 1 == 1);
        self.asked.set(self.asked.get() + u64::from(active.count_ones()));
        let mut hidden = 0;
        if self.between.ask {
            for lane in lanes(active) {
                let ray = self.si.shadow_ray(LightId(self.light as u32), ways[lane], 1.0);
                hidden |= u16::from(self.scene.occluded_by_lists(&ray)) << lane;
            }
        } else {
            for lane in lanes(active) {
                let [x, y] = places[lane];
                hidden |= u16::from(self.between.hiders.iter().any(|hider| hider.hides(x, y))) << lane;
            }
        }
        let geometry = &self.scene.geometry;
        let asking = active & !hidden;
        if asking == 0 || !self.between.ask_trees {
            return hidden;
        }
        let from = self.si.shadow_ray(LightId(self.light as u32), Vec3::ZERO, 1.0);
        let mut shadows = ShadowRays { from, rays: RayPacket16::ZERO, t_end: [0.0; LANES] };
        for (lane, way) in ways.iter().enumerate() {
            shadows.rays.set(lane, from.start, *way);
            shadows.t_end[lane] = ShadowRay { l: *way, ..from }.end();
        }
        hidden | geometry.are_blocked(self.scene.level, &shadows, asking)
    }
}

/// A flat light behind things, as one point sees it.
struct Seen<'a> {
    masked: &'a Masked<'a>,
    view: &'a View,
    /// Of a ball: the way to its middle, and the square of the way to where it is touched.
    ball: Option<(Vec3, f32)>,
    /// How points are spread over a light that is very near.
    near: Option<Near>,
}

impl Seen<'_> {
    /// Goes on with the points of the series, up to so many.
    fn ask(&self, tally: &mut Tally, to: usize) {
        let table = match self.view.outline {
            Outline::Disk if self.near.is_none() => &points().disk,
            _ => &points().square,
        };
        let table = &table[self.masked.series * MOST..][..MOST];
        for block in table[tally.count..to].chunks_exact(LANES) {
            let mut ways = [Vec3::ZERO; LANES];
            let mut sent = [[0.0f32; 2]; LANES];
            let mut active = 0u16;
            let mut places = [[0.0; 2]; LANES];
            for (lane, place) in block.iter().enumerate() {
                let (at, part) = match &self.near {
                    Some(near) => near.place(place.map(|w| 0.5 * w + 0.5)),
                    None => (self.counted(*place), 1.0),
                };
                places[lane] = at;
                if let Some(point) = self.point(at, part) {
                    (ways[lane], sent[lane]) = (point.way, point.sums);
                    active |= 1 << lane;
                }
            }
            let hidden = self.masked.hidden(&places, &ways, active);
            tally.hidden += hidden.count_ones() as usize;
            for (lane, [diffuse, specular]) in sent.iter().enumerate() {
                tally.all[0] += f64::from(*diffuse);
                tally.all[1] += f64::from(*specular);
                tally.squares[0] += f64::from(*diffuse) * f64::from(*diffuse);
                tally.squares[1] += f64::from(*specular) * f64::from(*specular);
                if hidden >> lane & 1 == 0 {
                    tally.lit[0] += f64::from(*diffuse);
                    tally.lit[1] += f64::from(*specular);
                }
            }
        }
        tally.count = to;
    }

    /// What a place of the light would send, if it stands for so much of it.
    fn point(&self, [x, y]: [f32; 2], part: f32) -> Option<Sent> {
        let view = self.view;
        let (height, cos) = (view.horizon.at(x, y), view.cos.at(x, y));
        if !(height > 0.0 && cos > 0.0) {
            return None;
        }
        let l = view.l(x, y);
        let inverse = 1.0 / l.length();
        let weight = part * if view.physical { view.height * inverse * (inverse * inverse) } else { 1.0 };
        let cos_i = cos * inverse;
        let lobe = self.masked.lobe.eval(cos_i, view.cos_o, view.wo.dot(l) * inverse);
        let way = match self.ball {
            None => l,
            // On to the ball's surface
            Some((center, cc)) => {
                let (a, b) = (l.length_squared(), l.dot(center));
                l * ((b - (b * b - a * cc).max(0.0).sqrt()) / a)
            }
        };
        Some(Sent { way, sums: [weight * cos_i, weight * lobe] })
    }

    /// From the unit square, and for how much of the light a place stands.
    fn place(&self, at: [f32; 2]) -> ([f32; 2], f32) {
        if let Some(near) = &self.near {
            return near.place(at);
        }
        let square = at.map(|w| 2.0 * w - 1.0);
        let place = match self.view.outline {
            Outline::Parallelogram => square,
            Outline::Disk => crate::light::concentric(square.map(f64::from)).map(|w| w as f32),
        };
        (self.counted(place), 1.0)
    }

    /// A place that is counted from the middle, as the view counts them.
    fn counted(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        [x - self.view.origin[0], y - self.view.origin[1]]
    }
}

impl Source for Seen<'_> {
    fn series(&self) -> u32 {
        self.masked.series as u32
    }

    fn sent(&self, at: [f32; 2]) -> Option<Sent> {
        let (place, part) = self.place(at);
        self.point(place, part)
    }

    fn hidden(&self, places: &[[f32; 2]; LANES], ways: &[Vec3; LANES], active: u16) -> u16 {
        self.masked.hidden(&places.map(|at| self.place(at).0), ways, active)
    }
}
