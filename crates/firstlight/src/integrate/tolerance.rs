//! How wrong a picture may be, and every number that decides it.

use crate::color::{DisplaySteps, Rgb};
use crate::material::{Colors, MOMENTS};

/// What decides whether an estimate is good enough. Errors are in display steps unless a comment says otherwise; those
/// of the default tolerance of 1 are listed, others scale with it.
///
/// The figures come from the runs of random scenes that the page *Exactness, verified* describes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tolerance {
    /// How far all lights together may be wrong at a point that stands for a pixel.
    pub point: f32,
    /// The part of that which one cell of a light, or one panel of its rows, may use up. Cells are few, and their
    /// estimates are larger than their errors, mostly ten times and more.
    pub part: f32,
    /// Where a light is cut into more cells than this, each may use up less.
    pub few_cells: f32,
    /// Parts of a pixel smaller than this are judged as if they were as large.
    pub least_share: f32,
    /// What a fit can be wrong as a part of the last coefficients of its series: where all of a cell is seen, whose
    /// errors cancel at Gauss nodes, and where a part of it is.
    pub fit_seen: f32,
    pub fit_cut: f32,
    /// The same for each share of the cell that those coefficients are: a series that falls slowly goes on beyond them.
    pub fit_seen_slow: f32,
    pub fit_cut_slow: f32,
    /// The same where few nodes are asked, for the third power of the end of the series.
    pub fit_coarse: f32,
    /// What is left of the end of a series in half of a cell, along the axis that was halved and along the other.
    pub halved_along: f32,
    pub halved_across: f32,
    /// In half diagonals over distances, squared, or the exponent of the highlight's fall: cells narrower than that are
    /// asked by few nodes first.
    pub smooth_cell: f32,
    /// How often cells and panels are halved at most.
    pub cell_depth: u32,
    pub panel_depth: u32,
    /// In half diagonals over distances: cells wider than that are halved before they are asked.
    pub widest_cell: f32,
    /// In exponents of the highlight's fall: how far a cell may reach across a highlight, and how far from one it does
    /// not matter.
    pub widest_highlight: f32,
    pub highlight_end: f32,
    /// The most cells that one light is cut into for one point.
    pub most_cells: u32,
    /// As a part of a cell: differences of two rules below this are rounding.
    pub rounding: f32,
}

impl Tolerance {
    pub const DEFAULT: Tolerance = Tolerance {
        point: 0.15,
        part: 0.9,
        few_cells: 4.0,
        least_share: 0.125,
        fit_seen: 0.02,
        fit_cut: 0.25,
        fit_seen_slow: 0.2,
        fit_cut_slow: 2.0,
        fit_coarse: 1.0,
        halved_along: 1.0 / 16.0,
        halved_across: 0.5,
        smooth_cell: 1.0,
        cell_depth: 64,
        panel_depth: 12,
        widest_cell: 2.0,
        widest_highlight: 8.0,
        highlight_end: 12.0,
        most_cells: 2048,
        rounding: 3e-7,
    };
}

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
