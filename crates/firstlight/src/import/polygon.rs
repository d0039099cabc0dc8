//! Polygons to triangles.
//!
//! A polygon is laid onto the axis plane that its own plane (Newell's method) is nearest to. Where all triangles of the
//! fan from its first corner turn the same way, the fan is taken; that is so for every convex polygon without corners
//! on straight edges. Otherwise ears are cut off, always the first in order (G. H. Meisters 1975, "Polygons have
//! ears"). Which corners are ears is remembered, so that cutting takes quadratic time, not cubic. Polygons of more than
//! [`SMALL`] corners are cut in [`rounds`] instead.
//!
//! **Corners on straight edges stay corners.** A triangle without area has no place in the surface: one that is cut off
//! at a corner on a straight edge leaves that edge whole, and a neighbour that has the corner too meets it in a
//! T-junction, through which rays pass. So neither a fan nor an ear has a triangle that is flat within the rounding of
//! its coordinates ([`Flatness`]), and an ear has no other corner on its edges. Every polygon that does not cross
//! itself has such ears until all of it is cut, unless all corners are in one line: in G. H. Meisters' proof, a corner
//! on a diagonal parts the polygon as a corner inside of it does.

mod flatness;
mod rounds;

use crate::parallel;
use flatness::Flatness;
use rounds::Rounds;

/// The largest polygon that is a fan, or whose ears are cut in order.
const SMALL: usize = 64;

/// What was done to the polygons of a file, for its notes.
#[derive(Clone, Copy, Default)]
pub(super) struct PolygonCounts {
    /// Faces of less than 3 corners, left out.
    pub(super) small: u64,
    /// Large polygons that cross themselves.
    pub(super) tangled: u64,
}

impl PolygonCounts {
    pub(super) fn add(&mut self, other: PolygonCounts) {
        self.small += other.small;
        self.tangled += other.tangled;
    }

    /// In words for a user.
    pub(super) fn notes(&self, notes: &mut Vec<String>) {
        if self.small > 0 {
            notes.push(format!("{} faces of less than 3 corners are left out", self.small));
        }
        if self.tangled > 0 {
            notes.push(format!(
                "{} polygons of more than {SMALL} corners cross themselves: some of their triangles overlap",
                self.tangled
            ));
        }
    }
}

/// How many triangles a polygon of so many corners becomes.
pub(super) fn triangles_of(corners: u32) -> usize {
    (corners as usize).saturating_sub(2)
}

/// Triangles of polygons that lie one after another, as numbers of corners. `position`: of a corner.
pub(super) fn triangulate(
    sizes: &[u32],
    position: impl Fn(usize) -> [f32; 3] + Sync,
) -> (Vec<[u32; 3]>, PolygonCounts) {
    const BLOCK: usize = 4096;
    // Where each block of polygons begins
    let mut start = 0usize;
    let blocks: Vec<(usize, &[u32])> = sizes
        .chunks(BLOCK)
        .map(|block| {
            let begin = (start, block);
            start += block.iter().map(|&s| s as usize).sum::<usize>();
            begin
        })
        .collect();
    let parts: Vec<(Vec<[u32; 3]>, PolygonCounts)> = parallel::collect(blocks.len(), |i| {
        let (mut start, block) = blocks[i];
        let mut triangles = Vec::with_capacity(block.iter().map(|&s| triangles_of(s)).sum());
        let mut counts = PolygonCounts::default();
        let mut work = Ears::default();
        for &size in block {
            work.polygon(start, size as usize, &position, &mut triangles, &mut counts);
            start += size as usize;
        }
        (triangles, counts)
    });
    let mut counts = PolygonCounts::default();
    let mut triangles = Vec::with_capacity(parts.iter().map(|p| p.0.len()).sum());
    for (part, count) in parts {
        triangles.extend_from_slice(&part);
        counts.add(count);
    }
    (triangles, counts)
}

type FlatPoint = [f64; 2];

/// Twice the signed area of a triangle.
fn area(a: FlatPoint, b: FlatPoint, c: FlatPoint) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Room for one polygon at a time.
#[derive(Default)]
struct Ears {
    points: Vec<FlatPoint>,
    flatness: Flatness,
    next: Vec<u32>,
    previous: Vec<u32>,
    ear: Vec<bool>,
    rounds: Rounds,
}

impl Ears {
    /// Adds the triangles of one polygon.
    fn polygon(
        &mut self,
        start: usize,
        size: usize,
        position: &impl Fn(usize) -> [f32; 3],
        triangles: &mut Vec<[u32; 3]>,
        counts: &mut PolygonCounts,
    ) {
        counts.small += u64::from(size < 3);
        if size > 3 && self.lay(start, size, position) {
            if size > SMALL {
                counts.tangled +=
                    u64::from(self.rounds.cut(&self.points, self.flatness, start as u32, triangles).tangled);
                return;
            }
            if !self.is_fan() {
                self.cut(start as u32, triangles);
                return;
            }
        }
        if size > SMALL {
            rounds::halve(start as u32, size as u32, triangles);
            return;
        }
        let corner = |i: usize| (start + i) as u32;
        triangles.extend((2..size).map(|i| [corner(0), corner(i - 1), corner(i)]));
    }

    /// Lays the polygon into a plane, counter-clockwise. Not one without an area or with a corner that is not finite:
    /// for those nothing is better than a fan.
    fn lay(&mut self, start: usize, size: usize, position: &impl Fn(usize) -> [f32; 3]) -> bool {
        let at = |i: usize| position(start + i).map(f64::from);
        // The normal, by Newell's method, from the first corner
        let origin = at(0);
        let from_origin = |i: usize| {
            let p = at(i);
            [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]]
        };
        let mut normal = [0.0; 3];
        let mut p = [0.0; 3];
        for i in 1..size {
            let q = from_origin(i);
            for (axis, n) in normal.iter_mut().enumerate() {
                let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
                *n += p[j] * q[k] - p[k] * q[j];
            }
            p = q;
        }
        let sizes = normal.map(f64::abs);
        let largest = sizes[0].max(sizes[1]).max(sizes[2]);
        if !(largest > 0.0 && largest.is_finite()) || sizes.iter().any(|s| s.is_nan()) {
            return false;
        }
        self.flatness = Flatness::of_coordinates((0..size).flat_map(at));
        let axis = if sizes[2] == largest {
            2
        } else if sizes[1] == largest {
            1
        } else {
            0
        };
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let turned = normal[axis] < 0.0;
        self.points.clear();
        self.points.extend((0..size).map(|i| {
            let p = from_origin(i);
            if turned { [p[k], p[j]] } else { [p[j], p[k]] }
        }));
        true
    }

    /// Whether the fan from the first corner is right.
    fn is_fan(&self) -> bool {
        let points = &self.points;
        (2..points.len()).all(|i| {
            let triangle @ [a, b, c] = [points[0], points[i - 1], points[i]];
            // A triangle with two corners at one place leaves no edge whole that has a corner on it
            self.flatness.is_forward(triangle) || a == b || b == c || c == a
        })
    }

    /// Cuts ears off the polygon in `points`.
    fn cut(&mut self, start: u32, triangles: &mut Vec<[u32; 3]>) {
        let size = self.points.len() as u32;
        self.next.clear();
        self.next.extend((0..size).map(|i| (i + 1) % size));
        self.previous.clear();
        self.previous.extend((0..size).map(|i| (i + size - 1) % size));
        self.ear.clear();
        self.ear.resize(size as usize, false);
        self.find_ears(0);
        let mut at = 0;
        for _ in 0..size - 2 {
            // The next ear from here; where there is none, the exact signs decide. If none is left then, the polygon
            // crosses itself: any corner that turns forwards, or any
            let begin = at;
            while !self.ear[at as usize] {
                at = self.next[at as usize];
                if at == begin && self.flatness != Flatness::EXACT {
                    self.flatness = Flatness::EXACT;
                    self.find_ears(begin);
                } else if at == begin {
                    at = self.forward(begin);
                    break;
                }
            }
            let (before, after) = (self.previous[at as usize], self.next[at as usize]);
            triangles.push([start + before, start + at, start + after]);
            self.next[before as usize] = after;
            self.previous[after as usize] = before;
            self.ear[before as usize] = self.is_ear(before);
            self.ear[after as usize] = self.is_ear(after);
            at = after;
        }
    }

    fn corner(&self, i: u32) -> [FlatPoint; 3] {
        [self.previous[i as usize], i, self.next[i as usize]].map(|i| self.points[i as usize])
    }

    /// Finds out of every corner that is left whether it is an ear, `begin` being one of them.
    fn find_ears(&mut self, begin: u32) {
        let mut i = begin;
        loop {
            self.ear[i as usize] = self.is_ear(i);
            i = self.next[i as usize];
            if i == begin {
                return;
            }
        }
    }

    /// Whether the triangle at a corner is forward and no other corner is in it.
    fn is_ear(&self, i: u32) -> bool {
        let corner = self.corner(i);
        if !self.flatness.is_forward(corner) {
            return false;
        }
        let reach = self.flatness.reach(corner);
        let mut other = self.next[self.next[i as usize] as usize];
        while other != self.previous[i as usize] {
            if reach.holds(self.points[other as usize]) {
                return false;
            }
            other = self.next[other as usize];
        }
        true
    }

    /// The first corner from `begin` that turns forwards, otherwise `begin`.
    fn forward(&self, begin: u32) -> u32 {
        let mut i = begin;
        loop {
            let [a, b, c] = self.corner(i);
            if area(a, b, c) > 0.0 {
                return i;
            }
            i = self.next[i as usize];
            if i == begin {
                return begin;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of a flat polygon, and their areas.
    fn split(points: &[[f32; 2]], place: impl Fn([f32; 2]) -> [f32; 3] + Sync) -> (Vec<[u32; 3]>, Vec<f64>) {
        let (triangles, _) = triangulate(&[points.len() as u32], |i| place(points[i]));
        let at = |i: u32| points[i as usize].map(f64::from);
        let areas = triangles.iter().map(|t| area(at(t[0]), at(t[1]), at(t[2])) / 2.0).collect();
        (triangles, areas)
    }

    #[test]
    fn convex_polygons_are_fans() {
        let (triangles, _) = split(&[[0.0, 0.0], [2.0, 0.0], [3.0, 1.0], [1.0, 2.0]], |p| [p[0], p[1], 5.0]);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn corners_at_one_place_leave_a_fan() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        for twice in 0..4 {
            let mut points = square.to_vec();
            points.insert(twice, square[twice]);
            let (triangles, areas) = split(&points, |p| [p[1], 3.0, p[0]]);
            assert_eq!(triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
            assert_eq!(areas.iter().filter(|area| **area == 2.0).count(), 2, "{areas:?}");
        }
    }

    #[test]
    fn a_dart_is_split_at_its_notch() {
        let dart = [[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [1.0, 1.0]];
        for turn in 0..4 {
            let mut points = dart;
            points.rotate_left(turn);
            let places: [fn([f32; 2]) -> [f32; 3]; 3] =
                [|p| [p[0], p[1], 1.0], |p| [1.0, p[0], p[1]], |p| [p[1], 0.0, p[0]]];
            for place in places {
                let (triangles, areas) = split(&points, place);
                assert_eq!(triangles.len(), 2);
                assert!(areas.iter().all(|&a| a > 0.0), "{triangles:?}");
                assert_eq!(areas.iter().sum::<f64>(), 1.0);
            }
        }
    }

    #[test]
    fn combs_and_spirals_are_covered_once() {
        let mut comb = vec![[0.0, -1.0], [100.0, -1.0]];
        comb.extend((0..=100).rev().map(|i| [i as f32, if i % 2 == 0 { 5.0 } else { 0.0 }]));
        let mut spiral: Vec<[f32; 2]> = Vec::new();
        let square = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        spiral.extend((0..40).map(|i| square[i % 4].map(|x: f32| x * (10.0 + i as f32))));
        spiral.extend((0..40).rev().map(|i| square[i % 4].map(|x: f32| x * (9.0 + i as f32))));
        for polygon in [comb, spiral] {
            let whole: f64 = (0..polygon.len())
                .map(|i| {
                    let (p, q) = (polygon[i].map(f64::from), polygon[(i + 1) % polygon.len()].map(f64::from));
                    (p[0] * q[1] - p[1] * q[0]) / 2.0
                })
                .sum();
            let (triangles, areas) = split(&polygon, |p| [p[0], p[1], p[0] + p[1]]);
            assert_eq!(triangles.len(), polygon.len() - 2);
            assert!(areas.iter().all(|&a| a * whole.signum() >= 0.0));
            assert!((areas.iter().sum::<f64>() - whole).abs() < 1e-6);
        }
    }

    /// What must hold of the triangles of a polygon that does not cross itself: each edge of it is in one of them, each
    /// other edge in two that lie on both sides of it, and none is flat: all are higher than `least`.
    fn check_edges(triangles: &[[u32; 3]], positions: &[[f32; 3]], least: f64) {
        let size = positions.len() as u32;
        assert_eq!(triangles.len(), triangles_of(size));
        let edges: Vec<[u32; 2]> = triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect();
        for (i, edge @ [a, b]) in edges.iter().enumerate() {
            assert!(!edges[..i].contains(edge), "{edge:?} twice: {triangles:?}");
            let is_boundary = *b == (a + 1) % size;
            assert_eq!(edges.contains(&[*b, *a]), !is_boundary, "{edge:?}: {triangles:?}");
        }
        for triangle in triangles {
            let [a, b, c] = triangle.map(|i| crate::math::DVec3::from(positions[i as usize].map(f64::from)));
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            let height = (b - a).cross(c - a).length() / longest;
            assert!(height > least, "{triangle:?} is {height:e} high: {triangles:?} {positions:?}");
        }
    }

    /// Each edge of a polygon, cut into parts of equal length.
    fn subdivided(polygon: &[[f32; 2]], parts: usize) -> Vec<[f32; 2]> {
        let next = |i: usize| polygon[(i + 1) % polygon.len()];
        let along = |i: usize, k: usize| {
            let t = k as f32 / parts as f32;
            [0, 1].map(|axis| polygon[i][axis] * (1.0 - t) + next(i)[axis] * t)
        };
        (0..polygon.len()).flat_map(|i| (0..parts).map(move |k| (i, k))).map(|(i, k)| along(i, k)).collect()
    }

    #[test]
    fn corners_on_straight_edges_stay_corners() {
        let square = vec![[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
        // One corner, two and three on one edge, some on each edge of a triangle, the most that are possible
        let half = vec![[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [0.0, 0.0]];
        let three = vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [4.0, 0.0], [4.0, 3.0]];
        let triangle = vec![[0.0, 0.0], [2.0, 0.0], [1.0, 3.0]];
        // Concave ones: corners beside the notch, on the line of two others, and on a line that passes by
        let corner = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let cross: Vec<[f32; 2]> =
            [[1, 0], [2, 0], [2, 1], [3, 1], [3, 2], [2, 2], [2, 3], [1, 3], [1, 2], [0, 2], [0, 1], [1, 1]]
                .map(|p: [u8; 2]| p.map(f32::from))
                .to_vec();
        let comb = vec![
            [0.0, 0.0],
            [8.0, 0.0],
            [8.0, 2.0],
            [7.0, 1.0],
            [6.0, 2.0],
            [5.0, 1.0],
            [4.0, 2.0],
            [3.0, 1.0],
            [2.0, 2.0],
            [1.0, 1.0],
            [0.0, 2.0],
        ];
        let mut polygons = vec![square.clone(), half, three];
        for polygon in [square, triangle, corner, cross, comb] {
            polygons.extend([2, 3, 7, 40].map(|parts| subdivided(&polygon, parts)));
        }
        let mut random = firstlight_testkit::Random::new(11);
        for polygon in polygons {
            let turns = polygon.len().min(12);
            for tilt in 0..100 {
                let mut points = polygon.clone();
                points.rotate_left(tilt % turns);
                // In the axis plane, then anywhere: corners are off their edges by the rounding of coordinates
                let z = crate::math::DVec3::from(random.direction());
                let [x, y] = [z.any_orthonormal_vector(), z.cross(z.any_orthonormal_vector())];
                let shift = crate::math::DVec3::from(random.vector(2.0));
                let place = |[u, v]: [f32; 2]| match tilt < turns {
                    true => [u, v, 0.5],
                    false => (shift + x * f64::from(u) + y * f64::from(v)).as_vec3().to_array(),
                };
                let positions: Vec<[f32; 3]> = points.iter().map(|p| place(*p)).collect();
                let (triangles, counts) = triangulate(&[points.len() as u32], |i| positions[i]);
                assert_eq!((counts.small, counts.tangled), (0, 0));
                check_edges(&triangles, &positions, 1e-4);
            }
        }
    }

    #[test]
    fn corners_that_all_lie_in_one_line_are_triangles_without_an_area() {
        for size in [4, 5, 30, 64, 65, 300] {
            for direction in [[1.0, 0.0, 0.0], [0.3, 0.7, -0.2]] {
                // To and fro, so that some corners are at one place
                let along = |i: usize| i.min(size - i) as f64;
                let position = |i: usize| direction.map(|d: f64| (d * along(i)) as f32);
                let (triangles, counts) = triangulate(&[size as u32], position);
                assert_eq!((triangles.len(), counts.tangled), (size - 2, 0));
                assert!(triangles.iter().flatten().all(|&i| (i as usize) < size));
            }
        }
    }

    #[test]
    fn what_is_fine_is_a_fan_however_coarse_its_coordinates() {
        // Quads of a tenth of a millimetre, 2 m from the origin, and one a thousand times as long as high
        let small = [[2.0, 1.0], [2.0001, 1.0], [2.0001, 1.0001], [2.0, 1.0001]];
        let thin = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.001], [0.0, 0.001]];
        for points in [small, thin] {
            assert_eq!(split(&points, |p| [0.0, p[0], p[1]]).0, [[0, 1, 2], [0, 2, 3]]);
        }
    }

    #[test]
    fn any_polygon_has_two_triangles_less_than_corners() {
        let mut random = firstlight_testkit::Random::new(7);
        for size in 0..200 {
            let points: Vec<[f32; 3]> = (0..size)
                .map(|_| {
                    [0; 3].map(|_| match random.below(32) {
                        0 => f32::NAN,
                        1 => f32::MAX,
                        _ => random.below(4096) as f32,
                    })
                })
                .collect();
            let (triangles, counts) = triangulate(&[size], |i| points[i]);
            assert_eq!(triangles.len(), triangles_of(size));
            assert_eq!(counts.small, u64::from(size < 3));
            assert!(triangles.iter().flatten().all(|&i| i < size));
        }
    }
}
