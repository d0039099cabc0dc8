//! Large polygons to triangles: ears, cut in rounds.
//!
//! Cutting always the first ear looks at every corner for each, and makes long thin triangles that all meet in one
//! corner, which no tree of boxes can part: a disc of 20,000 corners as a fan took minutes to render. Here no two ears
//! that are neighbours are cut in one round, so that each round makes of a convex polygon one of half the corners, and
//! the triangles of all rounds but the last few are small. A corner is looked at again only when one of its neighbours
//! was cut: of a polygon that does not cross itself no other can have become an ear. Whether one is asks a tree of the
//! corners that do not turn forwards, which alone can lie in its triangle or on its edges. So n corners take n log n
//! steps, where they are not made to take more.

use super::FlatPoint;
use super::flatness::{Flatness, Reach};

/// Steps for each corner, on average, before the rest is cut without looking: a few hundred are usual.
const STEPS: u64 = 2048;
/// Corners of a leaf of the tree.
const LEAF: usize = 8;

/// Room for one polygon at a time.
#[derive(Default)]
pub(super) struct Rounds {
    next: Vec<u32>,
    previous: Vec<u32>,
    /// The round in which each corner is to be looked at.
    due: Vec<u32>,
    flatness: Flatness,
    backward: Backward,
}

/// Of corners that are cut.
const GONE: u32 = u32::MAX;

impl Rounds {
    /// Adds the triangles of a polygon that lies in a plane, counter-clockwise, as numbers of corners counted from
    /// `start`.
    pub(super) fn cut(
        &mut self,
        points: &[FlatPoint],
        flatness: Flatness,
        start: u32,
        triangles: &mut Vec<[u32; 3]>,
    ) -> Looked {
        let size = points.len() as u32;
        self.flatness = flatness;
        self.next.clear();
        self.next.extend((0..size).map(|i| (i + 1) % size));
        self.previous.clear();
        self.previous.extend((0..size).map(|i| (i + size - 1) % size));
        self.due.clear();
        self.due.resize(points.len(), 0);
        self.plant(points);
        let mut left = points.len();
        let mut looked = Looked { steps: 0, most: STEPS * u64::from(size), tangled: false };
        let mut current: Vec<u32> = (0..size).collect();
        let (mut coming, mut round) = (Vec::new(), 0);
        while left > 3 {
            for &i in &current {
                if left > 3 && self.due[i as usize] == round && self.is_ear(points, i, &mut looked) {
                    triangles.push(self.take(points, i, start, round, &mut coming));
                    left -= 1;
                }
            }
            if coming.is_empty() && self.flatness != Flatness::EXACT {
                // No ear is left within the rounding of coordinates: the exact signs decide
                self.flatness = Flatness::EXACT;
                self.plant(points);
                coming.extend((0..size).filter(|&i| self.due[i as usize] != GONE));
                coming.iter().for_each(|&i| self.due[i as usize] = round + 1);
                looked.steps += u64::from(size);
            } else if coming.is_empty() {
                // It crosses itself, or what remains has no area
                left -= self.force(points, start, left, round, triangles, &mut coming, &mut looked);
            }
            std::mem::swap(&mut current, &mut coming);
            coming.clear();
            round += 1;
        }
        if let Some(last) = (0..size).find(|&i| self.due[i as usize] != GONE) {
            triangles.push(self.corner(last).map(|i| start + i));
        }
        looked
    }

    fn corner(&self, i: u32) -> [u32; 3] {
        [self.previous[i as usize], i, self.next[i as usize]]
    }

    /// Builds the tree of the corners that are left and do not turn forwards.
    fn plant(&mut self, points: &[FlatPoint]) {
        let corners = (0..points.len() as u32).filter(|&i| self.due[i as usize] != GONE && !self.is_forward(points, i));
        let corners = corners.collect();
        self.backward.build(points, corners);
    }

    fn is_forward(&self, points: &[FlatPoint], i: u32) -> bool {
        self.flatness.is_forward(self.corner(i).map(|i| points[i as usize]))
    }

    /// Whether the triangle at a corner is forward and no other corner is in it.
    fn is_ear(&self, points: &[FlatPoint], i: u32, looked: &mut Looked) -> bool {
        let corner = self.corner(i).map(|i| points[i as usize]);
        self.flatness.is_forward(corner)
            && looked.steps <= looked.most
            && !self.backward.is_any_in(points, &self.flatness.reach(corner), &mut looked.steps)
    }

    /// Cuts a corner off; its neighbours are to be looked at in the coming round.
    fn take(&mut self, points: &[FlatPoint], i: u32, start: u32, round: u32, coming: &mut Vec<u32>) -> [u32; 3] {
        let [before, _, after] = self.corner(i);
        let triangle = [start + before, start + i, start + after];
        self.next[before as usize] = after;
        self.previous[after as usize] = before;
        self.due[i as usize] = GONE;
        self.backward.remove(i);
        for neighbour in [before, after] {
            if self.due[neighbour as usize] != round + 1 {
                self.due[neighbour as usize] = round + 1;
                coming.push(neighbour);
            }
            if self.is_forward(points, neighbour) {
                self.backward.remove(neighbour);
            }
        }
        triangle
    }

    /// Cuts corners that are no ears, once around, and says how many: those that turn forward, but if there are none,
    /// or too much was looked at, every second.
    #[expect(clippy::too_many_arguments, reason = "the rest of `cut`")]
    fn force(
        &mut self,
        points: &[FlatPoint],
        start: u32,
        left: usize,
        round: u32,
        triangles: &mut Vec<[u32; 3]>,
        coming: &mut Vec<u32>,
        looked: &mut Looked,
    ) -> usize {
        let first = (0..points.len() as u32).find(|&i| self.due[i as usize] != GONE).unwrap_or_default();
        looked.steps += points.len() as u64;
        let mut cut = 0;
        for any in [false, true] {
            let mut i = first;
            for _ in 0..left {
                let after = self.next[i as usize];
                let is_forward = self.is_forward(points, i);
                let is_free = ![GONE, round + 1].contains(&self.due[i as usize]);
                if left - cut > 3 && is_free && (any || is_forward) {
                    looked.tangled |= is_forward;
                    triangles.push(self.take(points, i, start, round, coming));
                    cut += 1;
                }
                i = after;
            }
            if cut > 0 && looked.steps <= looked.most {
                break;
            }
        }
        cut
    }
}

/// Triangles of corners from which no plane can be found.
pub(super) fn halve(start: u32, size: u32, triangles: &mut Vec<[u32; 3]>) {
    let mut corners: Vec<u32> = (start..start + size).collect();
    while corners.len() > 2 {
        // Every second corner is cut off
        let after = |i: usize| corners[(i + 1) % corners.len()];
        triangles.extend((1..corners.len()).step_by(2).map(|i| [corners[i - 1], corners[i], after(i)]));
        corners = corners.into_iter().step_by(2).collect();
    }
}

/// What looking has cost, and what came of it.
pub(super) struct Looked {
    pub(super) steps: u64,
    most: u64,
    /// It crosses itself, or seems to: some triangles overlap.
    pub(super) tangled: bool,
}

/// The corners that do not turn forwards, in a tree of boxes.
#[derive(Default)]
struct Backward {
    corners: Vec<u32>,
    nodes: Vec<LeafNode>,
    /// The leaf of each corner of the polygon; none where it turns forwards.
    leaf: Vec<Option<u32>>,
}

struct LeafNode {
    low: FlatPoint,
    high: FlatPoint,
    /// Of `corners`.
    range: [u32; 2],
    /// How many of them are still there.
    left: u32,
    parent: u32,
    /// The second child, the first being the node after this; none of a leaf.
    second: Option<u32>,
}

impl Backward {
    fn build(&mut self, points: &[FlatPoint], corners: Vec<u32>) {
        self.leaf.clear();
        self.leaf.resize(points.len(), None);
        self.nodes.clear();
        self.corners = corners;
        if !self.corners.is_empty() {
            self.node(points, [0, self.corners.len() as u32], 0);
        }
    }

    fn node(&mut self, points: &[FlatPoint], range: [u32; 2], parent: u32) {
        let own = range[0] as usize..range[1] as usize;
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for &i in &self.corners[own.clone()] {
            let p = points[i as usize];
            (low, high) = ([low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]);
        }
        let place = self.nodes.len();
        self.nodes.push(LeafNode { low, high, range, left: range[1] - range[0], parent, second: None });
        if own.len() <= LEAF {
            for &i in &self.corners[own] {
                self.leaf[i as usize] = Some(place as u32);
            }
            return;
        }
        let axis = usize::from(high[1] - low[1] > high[0] - low[0]);
        let half = own.len() / 2;
        let middle = range[0] + half as u32;
        let along = |i: &u32| points[*i as usize][axis];
        self.corners[own].select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
        self.node(points, [range[0], middle], place as u32);
        self.nodes[place].second = Some(self.nodes.len() as u32);
        self.node(points, [middle, range[1]], place as u32);
    }

    fn remove(&mut self, corner: u32) {
        let Some(mut at) = self.leaf[corner as usize].take() else { return };
        loop {
            let node = &mut self.nodes[at as usize];
            node.left -= 1;
            if at == 0 {
                break;
            }
            at = node.parent;
        }
    }

    /// Whether any is in a triangle or on its edges.
    fn is_any_in(&self, points: &[FlatPoint], reach: &Reach, steps: &mut u64) -> bool {
        if self.nodes.is_empty() {
            return false;
        }
        let &Reach { triangle: [a, b, c], margin, .. } = reach;
        let low = [0, 1].map(|axis: usize| a[axis].min(b[axis]).min(c[axis]) - margin);
        let high = [0, 1].map(|axis: usize| a[axis].max(b[axis]).max(c[axis]) + margin);
        let mut open = vec![0];
        while let Some(at) = open.pop() {
            let node = &self.nodes[at as usize];
            *steps += 1;
            let is_apart = (0..2).any(|axis| node.low[axis] > high[axis] || node.high[axis] < low[axis]);
            let is_beyond = [(a, b), (b, c), (c, a)].iter().any(|(p, q)| node.is_right_of(*p, *q, margin));
            if node.left == 0 || is_apart || is_beyond {
                continue;
            }
            if let Some(second) = node.second {
                open.extend([second, at + 1]);
                continue;
            }
            for &i in &self.corners[node.range[0] as usize..node.range[1] as usize] {
                if self.leaf[i as usize].is_some() && reach.holds(points[i as usize]) {
                    return true;
                }
            }
        }
        false
    }
}

impl LeafNode {
    /// Whether all of the box is clearly on the right of a line, by more than `margin`.
    fn is_right_of(&self, p: FlatPoint, q: FlatPoint, margin: f64) -> bool {
        let d = [q[0] - p[0], q[1] - p[1]];
        // The corner of the box that is farthest to the left
        let x = if d[1] > 0.0 { self.low[0] } else { self.high[0] } - p[0];
        let y = if d[0] > 0.0 { self.high[1] } else { self.low[1] } - p[1];
        let (s, t) = (d[0] * y, d[1] * x);
        s - t < -1e-9 * (s.abs() + t.abs()) - margin * (d[0].abs() + d[1].abs())
    }
}

#[cfg(test)]
mod tests {
    use super::super::area;
    use super::*;
    use std::f64::consts::TAU;

    /// Cuts a polygon that does not cross itself, and checks what must hold of any: its area is covered once.
    fn check(points: &[FlatPoint]) -> (Vec<[u32; 3]>, u64) {
        let mut triangles = Vec::new();
        let flatness = Flatness::of_coordinates(points.iter().flatten().copied());
        let looked = Rounds::default().cut(points, flatness, 0, &mut triangles);
        assert!(!looked.tangled);
        assert_eq!(triangles.len(), points.len() - 2);
        let areas = triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| points[i as usize]);
            area(a, b, c) / 2.0
        });
        let least = areas.clone().fold(f64::INFINITY, f64::min);
        let next = |i: usize| points[(i + 1) % points.len()];
        let whole: f64 = points.iter().enumerate().map(|(i, p)| (p[0] * next(i)[1] - p[1] * next(i)[0]) / 2.0).sum();
        let sum: f64 = areas.sum();
        assert!(least >= 0.0 && (sum - whole).abs() < 1e-9 * whole, "{least} {sum} {whole}");
        (triangles, looked.steps)
    }

    /// Around the origin, `radius` away.
    fn around(size: usize, radius: impl Fn(usize) -> f64) -> Vec<FlatPoint> {
        let at = |i: usize| {
            let (sin, cos) = pxfm::f_sincos(TAU * i as f64 / size as f64);
            [cos * radius(i), sin * radius(i)]
        };
        (0..size).map(at).collect()
    }

    #[test]
    fn a_hundred_thousand_corners_take_few_steps_each() {
        const SIZE: usize = 100_000;
        let random = |i: usize| (i.wrapping_mul(2_654_435_761) % 1000) as f64 / 1000.0;
        let mut comb = vec![[0.0, -1.0], [SIZE as f64, -1.0]];
        comb.extend((1..SIZE - 1).rev().map(|i| [i as f64, if i % 2 == 0 { 5.0 } else { 0.0 }]));
        let winding = |i: usize, out: f64| {
            let (sin, cos) = pxfm::f_sincos(i as f64 * 0.05);
            let radius = 10.0 + i as f64 * 0.01 + out;
            [cos * radius, sin * radius]
        };
        let mut spiral: Vec<FlatPoint> = (0..SIZE / 2).map(|i| winding(i, 0.0)).collect();
        spiral.extend((0..SIZE / 2).rev().map(|i| winding(i, -0.6)));
        let star = around(SIZE, |i| if i % 2 == 0 { 0.7 } else { 1.0 });
        for polygon in [star, around(SIZE, |i| 0.5 + 0.5 * random(i)), comb, spiral] {
            let (_, steps) = check(&polygon);
            assert!(steps < 400 * SIZE as u64, "{steps}");
        }
    }

    #[test]
    fn the_boxes_of_the_triangles_of_a_disc_overlap_little() {
        let disc = around(20_000, |_| 1.0);
        let (triangles, _) = check(&disc);
        let boxes = triangles.iter().map(|t| {
            let extent = |axis: usize| {
                let of = t.map(|i| disc[i as usize][axis]);
                of.iter().copied().fold(f64::MIN, f64::max) - of.iter().copied().fold(f64::MAX, f64::min)
            };
            extent(0) * extent(1)
        });
        // A fan would have 2,000 times its area
        let sum: f64 = boxes.sum();
        assert!(sum < 10.0 * TAU / 2.0, "{sum}");
    }

    #[test]
    fn what_crosses_itself_ends_and_is_told() {
        let wild: Vec<FlatPoint> = (0..5000u64)
            .map(|i| [i.wrapping_mul(48_271) % 1009, i.wrapping_mul(69_621) % 997].map(|x| x as f64))
            .collect();
        let mut triangles = Vec::new();
        let looked = Rounds::default().cut(&wild, Flatness::EXACT, 7, &mut triangles);
        assert!(looked.tangled);
        assert_eq!(triangles.len(), wild.len() - 2);
        assert!(triangles.iter().flatten().all(|&i| (7..7 + 5000).contains(&i)));
        // All in a line: nothing overlaps, for nothing has an area
        let line: Vec<FlatPoint> = (0..1000).map(|i| [f64::from(i), 0.0]).collect();
        triangles.clear();
        assert!(!Rounds::default().cut(&line, Flatness::EXACT, 0, &mut triangles).tangled);
        assert_eq!(triangles.len(), 998);
    }

    #[test]
    fn halves_are_two_less_than_corners() {
        for size in 3..200 {
            let mut triangles = Vec::new();
            halve(10, size, &mut triangles);
            assert_eq!(triangles.len(), size as usize - 2);
            assert!(triangles.iter().all(|[a, b, c]| a != b && b != c && a != c));
        }
    }
}
