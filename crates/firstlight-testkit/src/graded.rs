//! Points on area lights that lie the closer together the nearer the light is: where a light touches what it lights,
//! points of equal shares of its area would all miss the small part that sends nearly everything.
//!
//! A light is cut in two, and each part again, until every part is small beside its distance; then each part gets the
//! same number of random points, one in each of m x m cells. Nothing is assumed of what a light sends, only where it
//! is.
//!

use firstlight::Scene;
use firstlight::bench::{self, LightPoint};

use crate::Random;
use crate::scenes::{V, length, sub};

/// A part's radius over the distance to its middle, at most.
const WIDTH: f64 = 0.5;
/// A part's radius over the size of the coordinates, from which on it is not cut further: numbers of 24 bits do not
/// tell its points apart.
const FINEST: f64 = 1e-6;

/// A part of the unit square that stands for a light: from, to.
type Part = [[f64; 2]; 2];

/// Whether [`pixel`] does better than points of equal shares, for a light of that size at that distance: so near that
/// 256 of them are farther apart than it is away.
pub fn is_near(distance: f64, size: f64) -> bool {
    16.0 * distance < size
}

/// The parts of a light whose point at `uv` is `at(uv)`, as seen from a point.
fn parts(from: V, at: &dyn Fn([f64; 2]) -> V) -> Vec<Part> {
    let (mut left, mut parts): (Vec<Part>, Vec<Part>) = (vec![[[0.0; 2], [1.0; 2]]], Vec::new());
    while let Some(part) = left.pop() {
        let [[u0, v0], [u1, v1]] = part;
        let (u, v) = (0.5 * (u0 + u1), 0.5 * (v0 + v1));
        let middle = at([u, v]);
        let away = |uv: [f64; 2]| length(sub(at(uv), middle));
        let across = away([u0, v]).max(away([u1, v]));
        let along = away([u, v0]).max(away([u, v1]));
        let corners = [[u0, v0], [u0, v1], [u1, v0], [u1, v1]].map(away);
        let radius = corners.into_iter().fold(across.max(along), f64::max);
        let distance = length(sub(middle, from));
        if radius <= WIDTH * distance || radius <= FINEST * length(middle).max(length(from)) {
            parts.push(part);
        } else if across > along {
            left.extend([[[u0, v0], [u, v1]], [[u, v0], [u1, v1]]]);
        } else {
            left.extend([[[u0, v0], [u1, v]], [[u0, v], [u1, v1]]]);
        }
    }
    parts
}

/// A pixel of the film with about 2^`level` points on each area light at each camera ray, others for each `set`.
pub fn pixel(scene: &Scene, at: [u32; 2], level: u32, set: u32) -> [f32; 4] {
    let seed = u64::from(at[0]) << 40 ^ u64::from(at[1]) << 16 ^ u64::from(level) << 8 ^ u64::from(set);
    let mut numbers = Random::new(seed);
    let choose = &mut |_: usize, from: V, position: &dyn Fn([f64; 2]) -> V, points: &mut Vec<LightPoint>| {
        let parts = parts(from, position);
        let m = (f64::from(1u32 << level) / parts.len() as f64).sqrt().ceil().max(1.0) as u32;
        for [[u0, v0], [u1, v1]] in parts {
            let step = [(u1 - u0) / f64::from(m), (v1 - v0) / f64::from(m)];
            for (row, column) in (0..m).flat_map(|row| (0..m).map(move |column| (row, column))) {
                let u = u0 + step[0] * (f64::from(column) + numbers.unit());
                let v = v0 + step[1] * (f64::from(row) + numbers.unit());
                points.push(([u, v], step[0] * step[1]));
            }
        }
    };
    bench::pixel(scene, at, choose)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::dot;

    #[test]
    fn the_parts_of_a_square_give_the_form_factor_however_near_it_is() {
        // Lambert's sum over the edges, for a point on the axis of a square of side 1
        for height in [1e-4, 1e-2, 0.3, 2.0] {
            let at = |[u, v]: [f64; 2]| [u - 0.5, v - 0.5, height];
            let mut numbers = Random::new(1);
            let (mut sum, mut area) = (0.0, 0.0);
            for [[u0, v0], [u1, v1]] in parts([0.0; 3], &at) {
                let m = 24;
                let share = (u1 - u0) * (v1 - v0) / f64::from(m * m);
                for (i, j) in (0..m).flat_map(|i| (0..m).map(move |j| (i, j))) {
                    let u = u0 + (u1 - u0) * (f64::from(i) + numbers.unit()) / f64::from(m);
                    let v = v0 + (v1 - v0) * (f64::from(j) + numbers.unit()) / f64::from(m);
                    let l = at([u, v]);
                    sum += share * height * height / (dot(l, l) * dot(l, l));
                    area += share;
                }
            }
            let slant = length([0.5, 0.0, height]);
            let known = 2.0 / slant * pxfm::f_atan(0.5 / slant);
            assert!((area - 1.0).abs() < 1e-9, "{area}");
            assert!((sum - known).abs() < 2e-3 * known, "{height}: {sum}, not {known}");
        }
    }
}
