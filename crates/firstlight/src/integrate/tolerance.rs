//! The error a picture may have, and every constant that decides it.

use crate::color::{DisplaySteps, Rgb};
use crate::material::{Colors, MOMENTS};

/// Constants that decide whether an estimate is accepted, and whether one point stands for others. Errors are in
/// display steps unless a comment gives another unit, for the default tolerance of 1; for others they are scaled by it.
/// Larger values trade error for time.
///
/// The values were set by the runs of random scenes on the page *Integrated light, verified*. Where a comment has two
/// runs, they are with half of the constant and with twice as much. The rms is that of `firstlight-tools verify exact
/// --seeds 0..200 --size 16 --as-kept`, 0.104 with the values below; squares of pixels hardly occur at that size. Times
/// are those of the processor, as parts of the default's, on four scenes of the gallery at 96 pixels unless a comment
/// names others; the machine was busy, so differences below 0.05 are noise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tolerance {
    /// In display steps: the error of all lights together at a point that represents a pixel. Runs: rms 0.080 and
    /// 0.168, time 1.30 and 0.87.
    pub point: f32,
    /// A factor of that for errors that are independent from point to point: they show no step or edge. Runs: rms 0.079
    /// and 0.170, time 1.25 and 0.87.
    pub by_chance: f32,
    /// A part of a pixel: smaller parts are judged as if they were as large.
    pub least_share: f32,

    // Closed forms
    /// A part of the allowed error: that of one cell of a light or one panel. Error estimates are mostly many times the
    /// errors. Runs: rms 0.106 and 0.103, time 1.04 and 0.97.
    pub part: f32,
    /// A part of the last coefficients of a cell's series: the error estimate of partially visible cells. On fully
    /// visible ones errors cancel at Gauss nodes.
    pub fit_cut: f32,
    /// In exponents of a lobe's decay: the largest width of a cell across a highlight, and the distance from the
    /// highlight beyond which its width does not matter.
    pub highlight: f32,

    // One point in place of others
    /// In display steps: the interpolation error from the corners of a square at its other nodes, for one light. Runs:
    /// of 0.4, 0.8 and 1.6: rms 0.104, 0.104 and 0.105; time 1.14, 1 and 0.82 on config 11 at 384 pixels.
    pub bilinear_error: f32,
    /// A factor of that and of [`spread`](Self::spread) where irradiance may have a discontinuous derivative: behind
    /// occluders in trees, at the horizon, and at the edge of a penumbra. A quadratic interpolates worse there than the
    /// corners show. Runs: rms 0.104 and 0.104, time 0.98 and 0.99.
    pub bends_at_once: f32,
    /// In display steps: the difference between quadrants of a surface in one pixel. Runs: rms 0.105 and 0.104; time
    /// 1.10 and 0.96 on config 11, 1.02 and 1.00 on the gallery.
    pub spread: f32,
    /// A part of the light's size: the motion of silhouettes over a quadrant, and over a square of more than four
    /// pixels that is not judged by `bends_at_once`. Runs: rms 0.104 and 0.104; time 1.03 and 0.95 on config 11.
    pub motion: f32,
    /// In radians or widths of a highlight: the change of direction over a fragment whose middle stands for all of it.
    pub middle_turn: f32,
    /// The same of microfacets, and of their quadrants: within an eighth of the width of the lobe the second derivative
    /// at the middle stands for that of all rays.
    pub ggx_turn: f32,
    /// In display steps: the second-order change from a middle to its farthest ray, and from that of a quadrant. The
    /// mean over the rays of a quadrant is off by far less: signs differ. Runs: of the first, rms 0.104 and 0.104, time
    /// 1.02 and 1.00; of the second, the same rms, time 1.04 and 0.96 on config 11.
    pub middle_bend: f32,
    pub quadrant_bend: f32,
    /// In display steps: the effect of colours that vary together with irradiance.
    pub color_light_covariance: f32,
    /// The length of a difference of unit normals: their deviation from linear variation or from their mean. Beyond it
    /// there is a crease.
    pub even: f32,
    /// A part of the colour: the deviation from their mean of colours that are replaced by it; and of a highlight in a
    /// pixel of a block whose lobe has another width.
    pub same_mean: f32,
    /// A part of the width of a lobe: the deviation from their mean of widths that are replaced by it. A peak falls as
    /// the square of its width, so where widths vary evenly over a pixel the mean of peaks is off by half the square of
    /// that, 0.003 of a highlight: 0.3 display steps of the brightest.
    pub same_lobe: f32,

    // Rays of a pixel
    /// In display steps, the tolerance from which every second ray of a pixel samples an area light for all of them.
    /// Not less: shadows that are narrower than a pixel are off by up to twenty.
    pub half_of_rays: f32,

    // Samples of a light
    /// In samples, for a tolerance of 1: the first of a pixel; for others it is divided by the tolerance. Runs: rms
    /// 0.105 and 0.101, time 0.96 and 1.14.
    pub first_points: f32,
    /// A factor of that where the light is nearer than its samples are apart. Runs: rms 0.104 and 0.104, time 1.02 and
    /// 1.05.
    pub nearer: f32,
    /// In effective samples: as many unoccluded ones of a pixel count as full visibility; and as many of all rays
    /// together give an estimate.
    pub clear: f32,
    pub enough_samples: f32,
    /// A part of the allowed error: that of moments with fewer effective samples than that, or of which the samples
    /// find too small a part.
    pub undersampled: f32,
    /// A part of its contribution: the error of a group of samples that a silhouette crosses. Runs: rms 0.142 and
    /// 0.087, time 0.91 and 1.20.
    pub silhouette_groups: f32,
    /// A factor of the variation within other groups: their error.
    pub smooth_groups: f32,
    /// Over the root of the number of groups, a part: the error of the variance.
    pub few_groups: f32,
    /// A part of the deviation of independent samples: that of all rays together, which are stratified.
    pub stratified: f32,
    /// A factor of the mean contribution: strata beyond it are split.
    pub heavy: f32,
    /// In pixels: the weight of a pixel at which others are interpolated. It is the mean sum of squares of the nine
    /// interpolation weights, so that noise makes the same error as in a pixel of its own.
    pub node_pixels: f32,

    // Many lights: the errors of runs are those of the gallery's fairy lights at 64 pixels, 0.059 rms by default, and
    // times are at 128 pixels
    /// In display steps: the root of the sum of squared errors of the nodes of a cut. Runs: rms 0.047 and 0.107, time
    /// 1.40 and 0.63.
    pub cut_error: f32,
    /// A factor of that: patches at whose own brightness the error is larger get another cut. Runs, with 1 and 2.5: no
    /// change.
    pub lenient: f32,
    /// A part of the first estimate of brightness: its lower bound. With half of it: rms 0.055, time 1.14.
    pub sure: f32,
    /// In display steps: the error of all lights that are integrated one by one, with independent errors. No run has
    /// set it: fairy lights have none.
    pub integrals: f32,
    /// A part of the second difference over three: the change of irradiance within a pixel. A corner in the middle of a
    /// pixel makes an eighth, the onset of a square root nearly a fourth. Runs: rms 0.060 and 0.059, time 0.95 and
    /// 1.05.
    pub within: f32,
}

/// The constants that decide an error.
pub(crate) const TOLERANCE: Tolerance = Tolerance {
    point: 0.15,
    by_chance: 3.1,
    least_share: 1.0 / 16.0,
    part: 0.5,
    fit_cut: 0.1,
    highlight: 8.0,
    bilinear_error: 1.6,
    bends_at_once: 0.35,
    spread: 5.0,
    motion: 0.3,
    middle_turn: 0.06,
    ggx_turn: 0.25,
    middle_bend: 0.1,
    quadrant_bend: 3.0,
    color_light_covariance: 0.4,
    even: 0.01,
    same_mean: 0.004,
    same_lobe: 0.08,
    half_of_rays: 16.0,
    first_points: 256.0,
    nearer: 4.0,
    clear: 96.0,
    enough_samples: 16.0,
    undersampled: 0.2,
    silhouette_groups: 0.041,
    smooth_groups: 2.3,
    few_groups: 14.0,
    stratified: 0.5,
    heavy: 2.0,
    node_pixels: 0.64,
    cut_error: 1.5,
    lenient: 1.25,
    sure: 0.8,
    integrals: 0.225,
    within: 0.2,
};

/// Constants that decide how long a picture takes, and which of two methods is used that are both exact enough.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Costs {
    /// In evaluations of cells and panels: those of a light at a pixel after which it is sampled, and so many more for
    /// each display step that the light contributes. Sampling takes some 300 samples, and 35 for each step (60,000
    /// pixels of 200 random scenes); a panel takes as long as about 8 samples.
    pub asked: f32,
    pub asked_per_step: f32,
    /// A part of the power: nodes of lights whose clustering error is no larger are tested for full visibility; and the
    /// sine of the half angle beyond which they are not. Runs on fairy lights, of both: rms 0.058 to 0.059, time 0.99
    /// to 1.02.
    pub looked_at: f32,
    pub wide: f32,
    /// A part of the unoccluded light: the estimate where visibility is not known. Runs: rms 0.059 and 0.059, time 0.99
    /// and 0.98.
    pub maybe: f32,
    /// A factor of the error of a cut: that of the first cut, which estimates the brightness of its block. Runs: rms
    /// 0.057 and 0.059, time 1.06 and 0.94.
    pub pilot: f32,
}

/// The constants that decide how long a picture takes.
pub(crate) const COSTS: Costs =
    Costs { asked: 32.0, asked_per_step: 2.0, looked_at: 0.25, wide: 0.7, maybe: 0.3, pilot: 4.0 };

/// The part of the allowed error that a unit of error of each moment uses up, at one point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Weight(pub [f32; MOMENTS]);

impl Weight {
    /// For light of colours `worth` times the moments, within the total `value`, and an allowed error in display steps.
    /// `least`: see [`DisplaySteps::slopes`].
    #[inline(always)]
    pub fn new(steps: &DisplaySteps, value: Rgb, worth: &Colors, allowed: f32, least: f32) -> Weight {
        let slopes = steps.slopes(value, least, allowed);
        Weight(worth.0.map(|worth| slopes.of(worth)))
    }

    /// The part of the allowed error that `errors` use up.
    #[inline(always)]
    pub fn of(self, errors: [f32; MOMENTS]) -> f32 {
        let used: [f32; MOMENTS] = std::array::from_fn(|k| self.0[k] * errors[k]);
        used[1..].iter().fold(used[0], |sum, used| sum + used)
    }
}
