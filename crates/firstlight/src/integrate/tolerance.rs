//! How wrong a picture may be, and every number that decides it.

use crate::color::{DisplaySteps, Rgb};
use crate::material::{Colors, MOMENTS};

/// What decides whether an estimate is good enough, and whether one place tells what others see. Errors are in display
/// steps unless a comment says otherwise; those of the default tolerance of 1 are listed, others scale with it.
///
/// The figures come from the runs of random scenes that the page *Exactness, verified* describes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tolerance {
    /// How far all lights together may be wrong at a point that stands for a pixel.
    pub point: f32,
    /// How many times that may be wrong where each place is wrong by itself, as by chance: nothing of that shows as a
    /// step or an edge.
    pub by_chance: f32,
    /// Parts of a pixel smaller than this are judged as if they were as large.
    pub least_share: f32,

    // Closed forms
    /// The part of what is allowed that one cell of a light, or one panel of its rows, may use up: their estimates are
    /// larger than their errors, mostly many times.
    pub part: f32,
    /// What a fit can be wrong where a part of a cell is seen, as a part of the last coefficients of its series. Where
    /// all of it is, errors cancel at Gauss nodes.
    pub fit_cut: f32,
    /// In exponents of the highlight's fall: how far a cell may reach across a highlight, and how far from one it does
    /// not matter.
    pub highlight: f32,

    // One place for others
    /// What the corners of a square may be wrong about its other places, where there is one light.
    pub foretold: f32,
    /// The part of that, and of [`spread`](Self::spread), where what arrives bends at once, and a quadratic is farther
    /// off than the corners are: behind what is in trees, whose shadows have corners, where a light sets in, and where
    /// the edge of a penumbra may run.
    pub bends_at_once: f32,
    /// How far the places of a surface in a pixel may differ.
    pub spread: f32,
    /// As a part of the light: how far outlines may move on it over a quadrant, and over a square of more than four
    /// pixels that is not judged as bending at once.
    pub motion: f32,
    /// How far light may turn where the middle of a fragment stands for all of it, in radians or widths of a highlight.
    pub middle_turn: f32,
    /// By how much that may bend it at most, from a middle to the farthest ray, and from that of a quadrant. The mean
    /// over the rays is off by far less of what bends over a quadrant: some of it lies below.
    pub middle_bend: f32,
    pub quadrant_bend: f32,
    /// What colours that differ may make together with light that does.
    pub mingled: f32,
    /// As lengths of differences: how far normals may be from turning evenly, or from their mean. Farther off there is
    /// a crease.
    pub even: f32,
    /// As a part of it: how far colours may be from their mean that are taken for one.
    pub same_mean: f32,

    // Rays of a pixel
    /// In display steps, the tolerance from which every second ray of a pixel samples an area light for all of them.
    /// Not less: shadows that are narrower than a pixel are off by up to twenty.
    pub half_of_rays: f32,

    // Points of a light
    /// In points, with a tolerance of 1: those of a pixel that are asked first; with others a root of it fewer.
    pub first_points: f32,
    /// So many times as many, where the light is nearer than those are apart.
    pub nearer: f32,
    /// In effective points: so many that find nothing in the way of a pixel find that nothing is, and so many of all
    /// rays together tell something.
    pub clear: f32,
    pub told: f32,
    /// The part of what may be wrong that points may tell nothing about.
    pub untold: f32,
    /// The part that a packet of points through which an edge runs is wrong by.
    pub mixed: f32,
    /// How many times what their points send varies other packets are wrong by.
    pub alike: f32,
    /// Over a root of the number of packets: the part that the square of what they say is off by.
    pub few_packets: f32,
    /// The part of the deviation of as many random points that those of all rays have, which are stratified.
    pub stratified: f32,
    /// Cells that send more than so many times the mean of as many equal ones are heavy.
    pub heavy: f32,
    /// A pixel that tells what others in its square see counts for so many: the mean sum of squares of what the nine
    /// are worth for a pixel, so that chance puts that one off by as much as if it had been asked.
    pub node_pixels: f32,

    // Many lights
    /// The root of the sum of squares of all that may be wrong where many are taken for one.
    pub crowd: f32,
    /// A patch that is darker than was guessed is looked at again beyond this factor of that.
    pub lenient: f32,
    /// The part of what a first look finds that is taken for sure.
    pub sure: f32,
    /// How far all lights that are integrated one by one may be wrong together, if their errors are independent.
    pub integrals: f32,
    /// What light does within a pixel, at most, as a part of its second difference over three: a corner in the middle
    /// of the pixel makes an eighth, the onset of a root nearly a fourth.
    pub within: f32,
}

/// All numbers that decide an error.
pub(crate) const TOLERANCE: Tolerance = Tolerance {
    point: 0.15,
    by_chance: 3.3,
    least_share: 1.0 / 16.0,
    part: 0.5,
    fit_cut: 0.1,
    highlight: 8.0,
    foretold: 0.8,
    bends_at_once: 0.35,
    spread: 5.0,
    motion: 0.3,
    middle_turn: 0.06,
    middle_bend: 0.1,
    quadrant_bend: 3.0,
    mingled: 0.4,
    even: 0.01,
    same_mean: 0.004,
    half_of_rays: 16.0,
    first_points: 256.0,
    nearer: 4.0,
    clear: 96.0,
    told: 16.0,
    untold: 0.2,
    mixed: 0.041,
    alike: 2.3,
    few_packets: 14.0,
    stratified: 0.5,
    heavy: 2.0,
    node_pixels: 0.64,
    crowd: 1.5,
    lenient: 1.25,
    sure: 0.8,
    integrals: 0.225,
    within: 0.2,
};

/// What decides how long a picture takes, and which of two ways to a light is taken that are both exact enough.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Costs {
    /// In points: what a pixel asks of a light where closed forms do not tell, and so many more for each display step
    /// that the light makes. A pixel asks some 300, and 35 for each step (60,000 pixels of 200 random scenes); a panel
    /// takes as long as about 8 of them.
    pub asked: f32,
    pub asked_per_step: f32,
    /// Nodes of lights whose error, taken for one, is no more than this part of all they send are looked at whether
    /// they are seen whole; those wider than this sine are not.
    pub looked_at: f32,
    pub wide: f32,
    /// The part of what nothing is known of that is guessed to arrive.
    pub maybe: f32,
    /// How much wider the first look at a block is, that says how bright it is.
    pub pilot: f32,
}

/// All numbers that decide how long a picture takes.
pub(crate) const COSTS: Costs =
    Costs { asked: 32.0, asked_per_step: 2.0, looked_at: 0.25, wide: 0.7, maybe: 0.3, pilot: 4.0 };

/// What a unit of each moment's error uses up of what is allowed, at one point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Weight(pub [f32; MOMENTS]);

impl Weight {
    /// Where light of `worth` times moments is added to what makes `value` together, and may be off by `allowed` steps.
    /// `least`: see [`DisplaySteps::slope`].
    pub fn new(steps: &DisplaySteps, value: Rgb, worth: &Colors, allowed: f32, least: f32) -> Weight {
        let used = if value.r == value.g && value.g == value.b {
            [steps.slope(value.r, least) / allowed; 3]
        } else {
            [value.r, value.g, value.b].map(|value| steps.slope(value, least) / allowed)
        };
        Weight(worth.0.map(|worth| (worth.r * used[0]).max(worth.g * used[1]).max(worth.b * used[2])))
    }

    /// The share of what is allowed that errors use up.
    #[inline(always)]
    pub fn of(self, errors: [f32; MOMENTS]) -> f32 {
        let used: [f32; MOMENTS] = std::array::from_fn(|k| self.0[k] * errors[k]);
        used[1..].iter().fold(used[0], |sum, used| sum + used)
    }
}
