//! The converged picture of a scene, and how far others are from it.
//!
//! Every area light is sampled, under full antialiasing, by four sets of points that know nothing of each other: one
//! seeded point in each of m x m cells of the light. Where they do not agree, the pixel is rendered again with twice
//! the points, until they do or until there are too many points. Where a light is very near, its points are graded
//! ([`graded`]). Nothing of what integrates lights has a part in it.
//! (Turned copies of the `sobol` set were tried in their place, and settle no pixel sooner: it is edges that take
//! long.)

use std::collections::BTreeSet;
use std::f64::consts::PI;

use firstlight::{
    AaMode, AlphaMode, Falloff, Image, LightDesc, RenderSettings, SampleSet, SamplesDesc, Scene, SceneDesc, Window,
};

use crate::graded;
use crate::scenes::*;

/// Steps of an 8-bit picture by which the mean of two sets may differ from the mean of the other two; as a part of the
/// scene's tolerance where that is below 1, as are [`SPREAD`] and [`DISPUTED`].
const AGREEMENT: f64 = 0.25;
/// Steps by which one set may differ from the mean of all.
const SPREAD: f64 = 0.5;
/// Sets of points, all of one size.
const SETS: u32 = 4;
/// The logarithm to base 2 of the number of points of the smallest sets.
const FIRST: u32 = 8;
/// That of the largest.
const LAST: u32 = 20;
/// From how many points on, to base 2, a pixel takes long beside what else a picture takes.
const LONG: u32 = 13;
/// The logarithm to base 2 of how many times the points the sets have where a root mean square is out of bounds.
const AGAIN: u32 = 4;
/// Steps off at which a pixel of the converged picture is looked at again, at a tolerance of 1.
const DISPUTED: f64 = 0.75;

/// The settings that a converged picture is made with.
pub fn traced() -> RenderSettings {
    every_ray()
}

/// The settings that hold what is tested: lights that say so are integrated.
pub fn integrated() -> RenderSettings {
    RenderSettings { aa_mode: AaMode::Adaptive, ..one_thread() }
}

/// The scene with every area light given so many points of a set, or integrated. Lights differ in their seeds.
pub fn with_samples(desc: &SceneDesc, samples: impl Into<SamplesDesc>, set: SampleSet, seed: u32) -> SceneDesc {
    let (mut desc, samples) = (desc.clone(), samples.into());
    desc.render.samples = samples;
    for (light, i) in desc.lights.iter_mut().zip(0..) {
        let own = seed.wrapping_mul(0x9e37_79b9).wrapping_add(i);
        macro_rules! give {
            ($light:ident) => {
                ($light.samples, $light.set, $light.seed) = (Some(samples), set, own)
            };
        }
        match light {
            LightDesc::Rectangle(light) => give!(light),
            LightDesc::Disk(light) => give!(light),
            LightDesc::Sphere(light) => give!(light),
            LightDesc::Point(_) | LightDesc::Directional(_) | LightDesc::Spot(_) => {}
        }
    }
    desc
}

/// The picture with every area light integrated.
pub fn exact(desc: &SceneDesc) -> Image {
    picture(&compile(&with_samples(desc, SamplesDesc::Exact, SampleSet::Sobol, 0)), &integrated())
}

/// The picture with so many points of a set on every area light.
pub fn sampled(desc: &SceneDesc, set: SampleSet, count: u32) -> Image {
    picture(&compile(&with_samples(desc, count, set, 1)), &traced())
}

/// Red, green and blue as they are displayed, in steps of an 8-bit picture, not rounded. What is not a number is as far
/// off as can be.
pub fn displayed(scene: &Scene, [r, g, b, _]: [f32; 4]) -> [f64; 3] {
    let shown = scene.display().encode_color([r, g, b]);
    std::array::from_fn(|k| if [r, g, b][k].is_nan() { f64::INFINITY } else { 255.0 * shown[k] })
}

fn furthest(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
}

/// What a scene looks like when its lights have more points than anybody waits for.
pub struct Converged {
    desc: SceneDesc,
    /// With whatever points; for its display.
    scene: Scene,
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// As displayed, in steps of an 8-bit picture.
    pub pixels: Vec<[f64; 3]>,
    /// Half of what the two halves of the sets differ by, pixel by pixel.
    pub(crate) half_differences: Vec<[f64; 3]>,
    /// The size of the sets that settled each pixel: about 2^level points.
    pub levels: Vec<u32>,
    /// Whether the largest sets do not agree on a pixel.
    pub(crate) open: Vec<bool>,
    /// Whether a pixel shows something that a light is so near to that points are graded; see [`graded`].
    near: Vec<bool>,
}

/// What four sets of one size say of a pixel.
struct Opinion {
    mean: [f64; 3],
    half_difference: [f64; 3],
    agreed: bool,
}

fn opinion(scene: &Scene, films: &[[f32; 4]; SETS as usize]) -> Opinion {
    let mean_of = |films: &[[f32; 4]]| {
        let sum = films.iter().fold([0.0f64; 4], |sum, film| std::array::from_fn(|k| sum[k] + film[k] as f64));
        displayed(scene, sum.map(|x| (x / films.len() as f64) as f32))
    };
    let (one, other, mean) = (mean_of(&films[..2]), mean_of(&films[2..]), mean_of(films));
    let part = scene.tolerance().min(1.0);
    let is_near = |film: &[f32; 4]| furthest(displayed(scene, *film), mean) <= part * SPREAD;
    let agreed = furthest(one, other) <= part * AGREEMENT && films.iter().all(is_near);
    Opinion { mean, half_difference: std::array::from_fn(|k| 0.5 * (one[k] - other[k])), agreed }
}

/// The parts of a picture to render so that every wanted pixel is there: few, and not much more than wanted; where
/// pixels take long, nothing more.
fn windows(wanted: &[bool], width: u32, height: u32, level: u32) -> Vec<Window> {
    let side = if level < LONG { 4 } else { 1 };
    let count = wanted.iter().filter(|wanted| **wanted).count();
    if side > 1 && 2 * count > wanted.len() {
        return vec![Window { x: 0, y: 0, width, height }];
    }
    let mut windows = Vec::new();
    for (top, left) in
        (0..height).step_by(side as usize).flat_map(|y| (0..width).step_by(side as usize).map(move |x| (y, x)))
    {
        let cell = (top..(top + side).min(height)).flat_map(|y| (left..(left + side).min(width)).map(move |x| [x, y]));
        let inside = cell.filter(|[x, y]| wanted[(y * width + x) as usize]);
        let bounds = inside.fold(None, |bounds: Option<[[u32; 2]; 2]>, at| match bounds {
            None => Some([at, at]),
            Some([low, high]) => {
                Some([[low[0].min(at[0]), low[1].min(at[1])], [high[0].max(at[0]), high[1].max(at[1])]])
            }
        });
        windows.extend(bounds.map(|[[x, y], [right, bottom]]| Window {
            x,
            y,
            width: right - x + 1,
            height: bottom - y + 1,
        }));
    }
    windows
}

/// Whether a light that weakens with the square of the distance is so near to what a pixel shows that points of equal
/// shares of it can all miss the part that sends most, and agree.
fn is_near(desc: &SceneDesc, scenes: &[Scene], [i, j]: [u32; 2]) -> bool {
    let n = desc.render.antialiasing;
    let rays = (0..n * n).map(|k| [k % n, k / n].map(|w| (w as f32 + 0.5) / n as f32));
    let hits = rays.flat_map(|[x, y]| {
        scenes.iter().filter_map(move |scene| {
            let (ray, _) = scene.camera().ray(i as f32 + x, j as f32 + y, 1.0);
            let hit = scene.intersect(&ray)?;
            Some(add(ray.o.to_array(), mul(ray.d.to_array().map(f64::from), hit.t)))
        })
    });
    let shown: Vec<V> = hits.collect();
    let is_near = |light: &LightDesc| {
        let (size, distance): (f64, Box<dyn Fn(V) -> f64>) = match light {
            LightDesc::Rectangle(light) if light.falloff == Falloff::Physical => {
                let (e0, e1) =
                    light.e0.zip(light.e1).expect("scenes that are verified say their rectangles by e0 and e1");
                let [a, b] = [e0, e1].map(length);
                let (u, v, center) = (unit(e0), unit(e1), light.center);
                let n = unit(cross(u, v));
                let beyond = |x: f64, half: f64| (x.abs() - half).max(0.0);
                let far = move |p: V| {
                    let d = sub(p, center);
                    length([dot(d, n), beyond(dot(d, u), 0.5 * a), beyond(dot(d, v), 0.5 * b)])
                };
                (a.max(b), Box::new(far))
            }
            LightDesc::Disk(light) if light.falloff == Falloff::Physical => {
                let said = light.normal.zip(light.radius);
                let (normal, radius) = said.expect("scenes that are verified say their disks by normal and radius");
                let (n, center) = (unit(normal), light.center);
                let far = move |p: V| {
                    let d = sub(p, center);
                    let height = dot(d, n);
                    length([height, (length(sub(d, mul(n, height))) - radius).max(0.0), 0.0])
                };
                (2.0 * radius, Box::new(far))
            }
            LightDesc::Sphere(light) if light.falloff == Falloff::Physical => {
                let (center, radius) = (light.center, light.radius);
                (2.0 * PI.sqrt() * radius, Box::new(move |p: V| (length(sub(p, center)) - radius).abs()))
            }
            _ => return false,
        };
        shown.iter().any(|p| graded::is_near(distance(*p), size))
    };
    desc.lights.iter().any(is_near)
}

/// The scene without alpha, where it has any.
fn opaque(desc: &SceneDesc) -> Option<SceneDesc> {
    let mut desc = desc.clone();
    let modes = desc.materials.iter_mut().filter_map(|(_, material)| Some(&mut common_of(material)?.alpha_mode));
    let layered = modes.filter(|mode| **mode != AlphaMode::Opaque);
    let count = layered.map(|mode| *mode = AlphaMode::Opaque).count();
    (count > 0).then_some(desc)
}

/// The side m of the sets of m x m points, about 2^`level` points.
fn side(level: u32) -> u32 {
    let whole = 1u32 << (level / 2);
    if level.is_multiple_of(2) { whole } else { (2 * whole * whole).isqrt() }
}

impl Converged {
    /// With sets of up to 2^`cap` points; `cap` is 8 to 20.
    #[track_caller]
    pub fn new(desc: &SceneDesc, cap: u32) -> Self {
        let mut converged = Self::unknown(desc);
        converged.settle(FIRST, cap.max(FIRST));
        converged
    }

    /// Nothing is known yet: every pixel is open.
    #[track_caller]
    pub(crate) fn unknown(desc: &SceneDesc) -> Self {
        let (width, height) = (desc.render.width, desc.render.height);
        let count = (width * height) as usize;
        // What masks and veils are in front of, and they themselves
        let mut scenes = vec![compile(desc)];
        scenes.extend(opaque(desc).map(|desc| compile(&desc)));
        let near = (0..count).map(|i| is_near(desc, &scenes, [i as u32 % width, i as u32 / width])).collect();
        Converged {
            desc: desc.clone(),
            scene: scenes.swap_remove(0),
            near,
            width,
            height,
            pixels: vec![[0.0; 3]; count],
            half_differences: vec![[0.0; 3]; count],
            levels: vec![0; count],
            open: vec![true; count],
        }
    }

    /// Asks sets of 2^`first` points, then of twice as many and so on up to 2^`cap`, for the pixels that are open,
    /// until they agree.
    #[track_caller]
    pub fn settle(&mut self, first: u32, cap: u32) {
        let count = self.pixels.len();
        let mut before = vec![false; count];
        for level in first..=cap {
            let evenly: Vec<bool> = (0..count).map(|i| self.open[i] && !self.near[i]).collect();
            let mut films = self.films(&windows(&evenly, self.width, self.height, level), level);
            let mut now: Vec<bool> = self.open.iter().map(|open| !open).collect();
            for i in (0..count).filter(|i| self.open[*i]) {
                if self.near[i] {
                    let at = [i as u32 % self.width, i as u32 / self.width];
                    films[i] = std::array::from_fn(|set| graded::pixel(&self.scene, at, level, set as u32));
                }
                let opinion = opinion(&self.scene, &films[i]);
                (self.pixels[i], self.half_differences[i]) = (opinion.mean, opinion.half_difference);
                (self.levels[i], now[i]) = (level, opinion.agreed);
            }
            // Four sets can agree by chance. So their word is taken where they agree all around, or for the second time
            let last = level == cap;
            for i in 0..count {
                self.open[i] &= !(now[i] && (last || before[i] || self.around(i).all(|near| now[near])));
            }
            before = now;
        }
    }

    /// The parts under each set of about 2^`level` points; what is not in a part is 0.
    #[track_caller]
    fn films(&self, parts: &[Window], level: u32) -> Vec<[[f32; 4]; SETS as usize]> {
        let mut films = vec![[[0.0; 4]; SETS as usize]; self.pixels.len()];
        for set in (0..SETS).filter(|_| !parts.is_empty()) {
            let points = side(level) * side(level);
            let sampled = compile(&with_samples(&self.desc, points, SampleSet::Stratified, level * SETS + set));
            for part in parts {
                let image = picture(&sampled, &RenderSettings { crop: Some(*part), ..traced() });
                for (row, y) in (part.y..part.y + part.height).enumerate() {
                    for (column, x) in (part.x..part.x + part.width).enumerate() {
                        films[(y * self.width + x) as usize][set as usize] =
                            image.pixels[row * part.width as usize + column];
                    }
                }
            }
        }
        films
    }

    /// A pixel and those next to it.
    fn around(&self, i: usize) -> impl Iterator<Item = usize> {
        let (width, height) = (self.width, self.height);
        let (x, y) = (i as u32 % width, i as u32 / width);
        let columns = x.saturating_sub(1)..(x + 2).min(width);
        (y.saturating_sub(1)..(y + 2).min(height))
            .flat_map(move |y| columns.clone().map(move |x| (y * width + x) as usize))
    }

    /// Looks again where a picture is far off, with at least four and up to sixteen times the points, until it is not
    /// or there are no more: sets that agreed by chance shall be nobody's fault. All of them can miss a sliver of a
    /// light.
    #[track_caller]
    pub fn doubt(&mut self, image: &Image) {
        let allowed = DISPUTED * self.scene.tolerance();
        loop {
            let is_disputed = |i: usize| {
                let off = furthest(self.pixels[i], displayed(&self.scene, image.pixels[i]));
                !self.open[i] && self.levels[i] < LAST && !(off <= allowed)
            };
            let disputed: Vec<bool> = (0..self.pixels.len()).map(is_disputed).collect();
            let levels = (0..disputed.len()).filter(|i| disputed[*i]).map(|i| self.levels[i]);
            let Some(level) = levels.max() else { return };
            let unsettled = std::mem::replace(&mut self.open, disputed);
            self.settle((level + 2).min(LAST), (level + 4).min(LAST));
            for (open, before) in self.open.iter_mut().zip(unsettled) {
                *open |= before;
            }
        }
    }

    /// Looks again at all that is settled, with 2^`more` times the points of each pixel and up to four times as many,
    /// as far as there are any. Where all pixels look at the same, all are wrong alike, and then the two halves can be
    /// nearer to each other than to the truth in all of them at once.
    #[track_caller]
    pub fn again(&mut self, more: u32) {
        let settled: Vec<u32> = (0..self.open.len()).filter(|i| !self.open[*i]).map(|i| self.levels[i]).collect();
        let levels = BTreeSet::from_iter(settled);
        let mut unsettled = self.open.clone();
        // The finest first: what others are set to is not looked at again
        for level in levels.into_iter().rev().filter(|level| *level < LAST) {
            for (i, open) in self.open.iter_mut().enumerate() {
                *open = !unsettled[i] && self.levels[i] == level;
            }
            self.settle((level + more).min(LAST), (level + more + 2).min(LAST));
            for (unsettled, open) in unsettled.iter_mut().zip(&self.open) {
                *unsettled |= open;
            }
        }
        self.open = unsettled;
    }

    /// How many pixels the largest sets do not agree on.
    pub fn open(&self) -> usize {
        self.open.iter().filter(|open| **open).count()
    }

    /// Whether a pixel is settled.
    pub fn is_settled(&self, i: usize) -> bool {
        !self.open[i]
    }

    /// As displayed, in steps of an 8-bit picture, not rounded.
    pub fn pixel(&self, i: usize) -> [f64; 3] {
        self.pixels[i]
    }

    /// How far the converged picture itself may be off: the root mean square of half the difference of its two halves.
    pub fn own_error(&self) -> f64 {
        let settled = (0..self.pixels.len()).filter(|i| !self.open[*i]);
        let (count, squares) = settled.fold((0usize, 0.0), |(count, squares), i| {
            (count + 3, squares + self.half_differences[i].iter().map(|d| d * d).sum::<f64>())
        });
        (squares / count.max(1) as f64).sqrt()
    }

    /// How far a picture is from it, the pixels that are open left out.
    pub fn deviation(&self, image: &Image) -> Deviation {
        assert_eq!(image.pixels.len(), self.pixels.len());
        let settled = (0..self.pixels.len()).filter(|i| !self.open[*i]);
        let compared = settled.map(|i| (i, self.pixels[i], displayed(&self.scene, image.pixels[i])));
        Deviation::of(self.desc.render.tolerance, self.width, compared)
    }
}

/// How far a picture is from the converged one. In steps of an 8-bit picture, after display encoding, not rounded.
#[derive(Clone, Copy, Debug, Default)]
pub struct Deviation {
    /// Pixels compared.
    pub pixels: u64,
    /// The furthest channel of all pixels.
    pub worst: f64,
    /// Column and row of it.
    pub at: [u32; 2],
    /// Pixels of which a channel is off by more than the scene's tolerance.
    pub over: u64,
    /// Root of the mean square, over all channels.
    pub rms: f64,
}

impl Deviation {
    /// Of pixels by their number in a picture `width` pixels wide: what is true of them, and what they are.
    fn of(tolerance: f64, width: u32, pixels: impl Iterator<Item = (usize, [f64; 3], [f64; 3])>) -> Self {
        let (mut deviation, mut squares) = (Deviation::default(), 0.0);
        for (i, truth, is) in pixels {
            let off = furthest(truth, is);
            if off >= deviation.worst {
                (deviation.worst, deviation.at) = (off, [i as u32 % width, i as u32 / width]);
            }
            deviation.pixels += 1;
            deviation.over += u64::from(off > tolerance);
            squares += (0..3).map(|k| (truth[k] - is[k]) * (truth[k] - is[k])).sum::<f64>();
        }
        deviation.rms = (squares / (3 * deviation.pixels.max(1)) as f64).sqrt();
        deviation
    }

    /// Of one picture of a scene from another.
    pub fn between(scene: &Scene, tolerance: f64, truth: &Image, image: &Image) -> Self {
        let pixels = truth.pixels.iter().zip(&image.pixels).enumerate();
        let shown = pixels.map(|(i, (truth, is))| (i, displayed(scene, *truth), displayed(scene, *is)));
        Self::of(tolerance, image.window.width, shown)
    }
}

/// How far integrated pictures of many scenes may be off, in steps of 255.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// The root mean square of a scene: the first in 95 % of them, the second in 99 %.
    pub rms: [f64; 2],
    /// The worst pixel of a scene, in 99 % of them.
    pub worst: f64,
    /// The share of all pixels that may be off by more than the tolerance.
    pub over: f64,
}

/// What is promised of integrated light at the default tolerance.
pub const PROMISED: Bounds = Bounds { rms: [0.2, 0.5], worst: 2.0, over: 1e-3 };

/// The shares of scenes that may be beyond the first root mean square, and beyond the second or the worst pixel.
const BEYOND: [f64; 2] = [0.05, 0.01];

/// How far one scene is off.
#[derive(Clone, Copy, Debug)]
pub struct SceneError {
    pub seed: u64,
    pub deviation: Deviation,
    /// [`Converged::own_error`]: what the converged picture does not know itself cannot be held against another.
    pub doubt: f64,
}

impl SceneError {
    fn is_beyond(&self, rms: f64) -> bool {
        let Deviation { rms: is, .. } = self.deviation;
        !(is * is <= rms * rms + self.doubt * self.doubt)
    }

    /// What is beyond the bounds that most scenes are within.
    pub fn outside(&self, bounds: &Bounds) -> Option<String> {
        let Deviation { worst, at: [x, y], rms, .. } = self.deviation;
        if !(worst <= bounds.worst) {
            return Some(format!("pixel {x}, {y} is off by {worst:.2} steps of 255"));
        }
        self.is_beyond(bounds.rms[0]).then(|| format!("rms {rms:.3}"))
    }
}

impl Bounds {
    /// What is promised of a scene: it scales with its tolerance.
    pub fn promised(desc: &SceneDesc) -> Bounds {
        PROMISED.times(desc.render.tolerance)
    }

    /// So many times as far off.
    pub fn times(&self, tolerance: f64) -> Bounds {
        Bounds { rms: self.rms.map(|rms| tolerance * rms), worst: tolerance * self.worst, over: self.over }
    }

    /// What of all scenes together is out of bounds.
    pub fn faults(&self, scenes: &[SceneError]) -> Vec<String> {
        let mut faults = Vec::new();
        let mut hold = |what: String, share: f64, is_beyond: &dyn Fn(&SceneError) -> bool| {
            let beyond: Vec<u64> = scenes.iter().filter(|scene| is_beyond(scene)).map(|scene| scene.seed).collect();
            let allowed = (share * scenes.len() as f64).round() as usize;
            if beyond.len() > allowed {
                let count = beyond.len();
                faults.push(format!("{count} scenes have {what}, {allowed} of {} may: {beyond:?}", scenes.len()));
            }
        };
        for (rms, share) in self.rms.into_iter().zip(BEYOND) {
            hold(format!("an rms above {rms}"), share, &|scene| scene.is_beyond(rms));
        }
        let worst = format!("a pixel that is off by more than {}", self.worst);
        hold(worst, BEYOND[1], &|scene| !(scene.deviation.worst <= self.worst));
        let sum = |of: fn(&Deviation) -> u64| scenes.iter().map(|scene| of(&scene.deviation)).sum::<u64>();
        let (pixels, over) = (sum(|d| d.pixels), sum(|d| d.over));
        let allowed = (self.over * pixels as f64).ceil();
        if over as f64 > allowed {
            faults.push(format!("{over} of {pixels} pixels are off by more than the tolerance, {allowed} may be"));
        }
        faults
    }
}

/// All that is asked of one scene.
pub struct Report {
    pub exact: Deviation,
    /// With 400 points of `sobol` on every light.
    pub sobol: Deviation,
    /// With 400 points of `uniform`.
    pub uniform: Deviation,
    /// Pixels that are left out.
    pub open: usize,
    /// [`Converged::own_error`].
    pub doubt: f64,
}

impl Report {
    /// Renders the scene in all ways, and looks at the converged picture again where there is reason to doubt it.
    #[track_caller]
    pub fn beside(truth: &mut Converged, desc: &SceneDesc) -> Self {
        let exact = exact(desc);
        truth.doubt(&exact);
        let first = Self::of(truth, desc, &exact);
        let bounds = Bounds::promised(desc);
        let error = SceneError { seed: 0, deviation: first.exact, doubt: first.doubt };
        // All pixels off by a little is what a converged picture is as well whose points are too few
        if !error.is_beyond(bounds.rms[0]) || !(first.exact.worst <= bounds.worst) {
            return first;
        }
        truth.again(AGAIN);
        Self::of(truth, desc, &exact)
    }

    /// Renders the scene in all ways, beside a converged picture that is taken as it is.
    #[track_caller]
    pub fn as_kept(truth: &Converged, desc: &SceneDesc) -> Self {
        Self::of(truth, desc, &exact(desc))
    }

    #[track_caller]
    fn of(truth: &Converged, desc: &SceneDesc, exact: &Image) -> Self {
        Report {
            exact: truth.deviation(exact),
            sobol: truth.deviation(&sampled(desc, SampleSet::Sobol, 400)),
            uniform: truth.deviation(&sampled(desc, SampleSet::Uniform, 400)),
            open: truth.open(),
            doubt: truth.own_error(),
        }
    }
}
