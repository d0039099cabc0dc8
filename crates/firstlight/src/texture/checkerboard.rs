//! The checkerboard, exact over the footprint.

use arrayvec::ArrayVec;
use glam::DVec2;

use super::check_uv_set;
use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::{ColorDesc, table};
use crate::math::{Vec2, floor};
use crate::shape::{Footprint, UvEdge};

table! {
    /// Squares of two colours, `counts[0]` across u in 0..1 and `counts[1]` across v in 0..1: the first colour where
    /// floor(u n) + floor(v m) is even. On a plane without end u and v are metres, and the squares go on. A function,
    /// not an image: its value is the area mean over the pixel's footprint, so its edges are sharp from near and gray
    /// from far, for every count.
    ///
    /// ```toml
    /// [texture.checkerboard.tiles]
    /// counts = [8, 8]
    /// colors = ["#ffffff", "#202020"]
    /// ```
    pub struct CheckerboardDesc {
        /// Squares along u and along v, 1 to 65536 each.
        pub counts: [u32; 2] = [8, 8],
        /// The first colour, that of the square at (0, 0), and the second.
        pub colors: [ColorDesc; 2] = [ColorDesc::WHITE, ColorDesc::BLACK],
        /// Which set of a mesh's texture coordinates the texture is laid by, 0 to 3; without it the mesh's own
        /// `uv_set`. Shapes of other kinds have set 0 alone.
        pub uv_set: Option<u32> = None,
    }
}

/// A checkerboard, ready to be looked up.
#[derive(Clone, Debug)]
pub struct Checkerboard {
    counts: [u32; 2],
    colors: [Rgb; 2],
}

impl CheckerboardDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Checkerboard {
        for (i, count) in self.counts.iter().enumerate() {
            cx.count(&format!("counts[{i}]"), *count, 1, MAX_COUNT, Some("squares along that axis"));
        }
        let colors = [0, 1].map(|i| cx.color(&format!("colors[{i}]"), self.colors[i]));
        check_uv_set(cx, self.uv_set);
        Checkerboard { counts: self.counts, colors }
    }
}

const MAX_COUNT: u32 = 65536;

/// A footprint that reaches over more squares than this from its middle, on both axes, is not cut into strips: the
/// board is gray there. Over a floor up to the horizon that is off by 0.17 of a display step at most (squares of 0.2 to
/// 100 m, 1.5 m below the camera, 400 rows).
const MAX_STRIPS: f64 = 128.0;

/// Where a footprint goes farther than this from the first square, in squares, the board is gray: 32 bits of u and v do
/// not tell squares apart there.
const MAX_REACH: f64 = 1e9;

/// A footprint whose area is smaller than this fraction of its sides' squares is a line.
const MIN_AREA: f64 = 1e-9;

impl Checkerboard {
    /// The mean colour over the footprint around `uv`.
    pub fn color(&self, uv: Vec2, footprint: &Footprint) -> Rgb {
        let mean = self.mean(uv, footprint) as f32;
        self.colors[0] * (0.5 * (1.0 + mean)) + self.colors[1] * (0.5 * (1.0 - mean))
    }

    /// How far its two colours differ.
    pub(crate) fn contrast(&self) -> Rgb {
        (self.colors[0] + self.colors[1] * -1.0).map(f32::abs)
    }

    /// Whether all within a step of the footprint lies in one square: the footprint itself reaches half as far.
    pub(crate) fn is_even(&self, uv: Vec2, footprint: &Footprint) -> bool {
        let scale = self.scale();
        let reach = (footprint.dx.abs() + footprint.dy.abs()).as_dvec2() * scale;
        Self::square(uv.as_dvec2() * scale - reach) == Self::square(uv.as_dvec2() * scale + reach)
    }

    /// Squares in a unit of u and of v.
    fn scale(&self) -> DVec2 {
        DVec2::new(f64::from(self.counts[0]), f64::from(self.counts[1]))
    }

    /// Which square a place is in, counted in squares.
    #[inline(always)]
    fn square(p: DVec2) -> [f64; 2] {
        [floor(p.x), floor(p.y)]
    }

    /// The mean over the footprint, as far as the surface goes, of +1 on the first colour's squares and -1 on the
    /// second's. In f64: the integral is a small difference of larger numbers where the footprint is thin.
    fn mean(&self, uv: Vec2, footprint: &Footprint) -> f64 {
        // Count in squares: the lines of the board are the whole numbers
        let scale = self.scale();
        let waves = [0, 1].map(|i| Wave::new(self.counts[i], footprint.edges[i]));
        let center = uv.as_dvec2() * scale;
        let (a, b) = (footprint.dx.as_dvec2() * scale, footprint.dy.as_dvec2() * scale);
        // All in one square: from near, nearly always
        let reach = (a.abs() + b.abs()) * 0.5;
        if Self::square(center - reach) == Self::square(center + reach) {
            return waves[0].sign(center.x) * waves[1].sign(center.y);
        }
        if !((center.abs() + reach).max_element() < MAX_REACH) {
            return 0.0;
        }
        let leaves = |i: usize| center[i] - reach[i] < 0.0 || center[i] + reach[i] > scale[i];
        if (0..2).any(|i| footprint.edges[i] == UvEdge::Bounded && leaves(i)) {
            return mean_within(&waves, center, a, b);
        }
        if !(reach.min_element() < MAX_STRIPS) {
            return 0.0;
        }
        let area = a.perp_dot(b);
        if area.abs() > MIN_AREA * (a.length_squared() + b.length_squared()) {
            mean_over(&waves, &corners(center, a, b), area, 2.0 * reach)
        } else {
            let along = if a.length_squared() > b.length_squared() { a } else { b };
            mean_over_line(&waves, center - along * 0.5, center + along * 0.5)
        }
    }
}

/// The corners of a parallelogram around `c` with sides `a` and `b`.
fn corners(c: DVec2, a: DVec2, b: DVec2) -> [DVec2; 4] {
    [-a - b, a - b, a + b, b - a].map(|d| c + d * 0.5)
}

/// A parallelogram, cut at both ends of both axes: no more than 8 corners, but what rounding adds.
type Polygon = ArrayVec<DVec2, 16>;

/// The mean over what of a footprint lies on the surface, where that ends within it.
fn mean_within(waves: &[Wave; 2], c: DVec2, a: DVec2, b: DVec2) -> f64 {
    // The line along the footprint, for one that is no more than that
    let along = if a.length_squared() > b.length_squared() { a } else { b };
    let (mut outline, mut line) = (Polygon::new(), Polygon::new());
    outline.extend(corners(c, a, b));
    line.extend([c - along * 0.5, c + along * 0.5]);
    for (axis, wave) in waves.iter().enumerate().filter(|(_, wave)| wave.edge == UvEdge::Bounded) {
        for (end, sign) in [(0.0, 1.0), (wave.count, -1.0)] {
            (outline, line) = (cut(&outline, axis, end, sign, true), cut(&line, axis, end, sign, false));
        }
    }
    let none = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (low, high) = outline.iter().fold(none, |(low, high), p| (low.min(*p), high.max(*p)));
    let size = high - low;
    // Also where nothing is left
    if !(size.min_element() * 0.5 < MAX_STRIPS) {
        return 0.0;
    }
    let area = (0..outline.len()).map(|i| outline[i].perp_dot(outline[(i + 1) % outline.len()])).sum::<f64>() * 0.5;
    if area.abs() > MIN_AREA * size.length_squared() {
        return mean_over(waves, &outline, area, size);
    }
    match line[..] {
        [from, to] if from != to => mean_over_line(waves, from, to),
        _ => waves[0].sign(c.x) * waves[1].sign(c.y),
    }
}

/// What of an outline, closed or not, lies where (p[axis] - end) `sign` >= 0.
///
/// Source: Sutherland and Hodgman, "Reentrant polygon clipping", 1974.
fn cut(outline: &[DVec2], axis: usize, end: f64, sign: f64, closed: bool) -> Polygon {
    let mut left = Polygon::new();
    let height = |p: DVec2| (p[axis] - end) * sign;
    for (i, &p) in outline.iter().enumerate() {
        if height(p) >= 0.0 {
            let _ = left.try_push(p);
        }
        if !closed && i + 1 == outline.len() {
            break;
        }
        let q = outline[(i + 1) % outline.len()];
        if (height(p) < 0.0) != (height(q) < 0.0) {
            let mut at = p + (q - p) * (height(p) / (height(p) - height(q)));
            at[axis] = end;
            let _ = left.try_push(at);
        }
    }
    left
}

/// The mean of w0(x) w1(y) over a convex outline with that area and size, by Green's theorem: the integral over an area
/// of w0(x) w1(y) is that along its outline of W0(x) w1(y) dy, where W0 is an integral of w0. In a strip of the board,
/// between two of its lines, w1 is constant, and an edge of the outline runs through it at an even pace. Strips are cut
/// along the axis that has fewer of them, x and y exchanged if need be: toward a horizon a footprint is narrow and
/// long.
fn mean_over(waves: &[Wave; 2], outline: &[DVec2], area: f64, size: DVec2) -> f64 {
    let across = usize::from(size.y <= size.x);
    let along = 1 - across;
    let mut integral = 0.0;
    for (i, &from) in outline.iter().enumerate() {
        let to = outline[(i + 1) % outline.len()];
        let mut begin = waves[along].second_integral(from[along]);
        for_each_strip(from, to, across, |p, q| {
            let end = waves[along].second_integral(q[along]);
            let sign = waves[across].sign((p[across] + q[across]) * 0.5);
            let mean = mean_between(p[along], q[along], |x| waves[along].integral(x), end - begin);
            integral += mean * sign * (q[across] - p[across]);
            begin = end;
        });
    }
    let turn = if across == 1 { 1.0 } else { -1.0 };
    (turn * integral / area).clamp(-1.0, 1.0)
}

/// The mean along a line.
fn mean_over_line(waves: &[Wave; 2], from: DVec2, to: DVec2) -> f64 {
    let line = to - from;
    let across = usize::from(line.y.abs() <= line.x.abs());
    let along = 1 - across;
    let mut integral = 0.0;
    for_each_strip(from, to, across, |p, q| {
        let sign = waves[across].sign((p[across] + q[across]) * 0.5);
        // Of a line the longer axis has a length
        let of_piece = waves[along].integral(q[along]) - waves[along].integral(p[along]);
        let mean = mean_between(p[along], q[along], |x| waves[along].sign(x), of_piece);
        integral += mean * sign * (q[along] - p[along]);
    });
    (integral / line[along]).clamp(-1.0, 1.0)
}

/// Cuts the line from `from` to `to` where it crosses a line of the board, of those that are whole numbers of an axis.
fn for_each_strip(from: DVec2, to: DVec2, axis: usize, mut piece: impl FnMut(DVec2, DVec2)) {
    let (way, rise) = (to - from, to[axis] - from[axis]);
    let first = if rise > 0.0 { floor(from[axis]) + 1.0 } else { -floor(-from[axis]) - 1.0 };
    let (mut line, mut start) = (first, from);
    while (to[axis] - line) * rise > 0.0 {
        let mut end = from + way * ((line - from[axis]) / rise);
        end[axis] = line;
        piece(start, end);
        (start, line) = (end, line + rise.signum());
    }
    piece(start, to);
}

/// The wave that is +1 on even squares and -1 on odd ones, and what it does beyond the shape.
#[derive(Clone, Copy)]
struct Wave {
    count: f64,
    edge: UvEdge,
}

impl Wave {
    fn new(count: u32, edge: UvEdge) -> Self {
        Wave { count: count as f64, edge }
    }

    /// +1 or -1: the square that holds `x`.
    #[inline(always)]
    fn sign(&self, x: f64) -> f64 {
        let square = match self.edge {
            UvEdge::Bounded | UvEdge::Folded => floor(x).clamp(0.0, self.count - 1.0),
            // Once around is what is asked for as a rule
            UvEdge::Periodic if x >= 0.0 && x < self.count => floor(x),
            UvEdge::Periodic => floor(x).rem_euclid(self.count),
            UvEdge::Unbounded => floor(x),
        };
        let half = 0.5 * square;
        if half == floor(half) { 1.0 } else { -1.0 }
    }

    /// An integral of the wave.
    #[inline(always)]
    fn integral(&self, x: f64) -> f64 {
        let (from, rounds) = self.begin(x);
        let (one_round, beyond) = (triangle(self.count) - triangle(0.0), self.beyond(x));
        rounds * one_round + triangle(x - from - beyond) + beyond * self.sign(x)
    }

    /// An integral of that.
    #[inline(always)]
    fn second_integral(&self, x: f64) -> f64 {
        let (from, rounds) = self.begin(x);
        let (one_round, beyond) = (triangle(self.count) - triangle(0.0), self.beyond(x));
        let within = x - from - beyond;
        let before = rounds * (parabola(self.count) + one_round * (0.5 * (rounds - 1.0) * self.count + within));
        before + parabola(within) + beyond * (triangle(within) + 0.5 * beyond * self.sign(x))
    }

    /// Where the round that holds `x` begins, and how many are before it.
    #[inline(always)]
    fn begin(&self, x: f64) -> (f64, f64) {
        match self.edge {
            UvEdge::Periodic => {
                let rounds = floor(x / self.count);
                (rounds * self.count, rounds)
            }
            UvEdge::Bounded | UvEdge::Folded | UvEdge::Unbounded => (0.0, 0.0),
        }
    }

    /// How far `x` is beyond the outermost squares, which go on for ever: of what ends there nothing asks.
    #[inline(always)]
    fn beyond(&self, x: f64) -> f64 {
        match self.edge {
            UvEdge::Bounded | UvEdge::Folded => x - x.clamp(0.0, self.count),
            UvEdge::Periodic | UvEdge::Unbounded => 0.0,
        }
    }
}

/// The mean between two places of a function that is straight between whole numbers, from its integral between them.
/// Over less than a unit from two straight pieces: differences of integrals have no digits there.
#[inline(always)]
fn mean_between(a: f64, b: f64, function: impl Fn(f64) -> f64, integral: f64) -> f64 {
    let width = b - a;
    if width.abs() > 1.0 {
        return integral / width;
    }
    let line = floor(a.max(b));
    if a.min(b) >= line {
        return function((a + b) * 0.5);
    }
    let share = (b - line) / width;
    function((a + line) * 0.5) * (1.0 - share) + function((line + b) * 0.5) * share
}

/// An integral of the wave without edges, with the mean 0: -1/2 at even numbers, 1/2 at odd ones, straight between.
#[inline(always)]
fn triangle(x: f64) -> f64 {
    let phase = x - 2.0 * floor(x * 0.5);
    if phase <= 1.0 { phase - 0.5 } else { 1.5 - phase }
}

/// The integral of that from 0 to `x`: 0 at whole numbers, parabolas between.
#[inline(always)]
fn parabola(x: f64) -> f64 {
    let phase = x - 2.0 * floor(x * 0.5);
    if phase <= 1.0 { 0.5 * phase * (phase - 1.0) } else { 0.5 * (phase - 1.0) * (2.0 - phase) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn footprint(dx: Vec2, dy: Vec2, edge: UvEdge) -> Footprint {
        Footprint { dx, dy, edges: [edge; 2] }
    }

    fn board(n: u32) -> Checkerboard {
        Checkerboard { counts: [n, n], colors: [Rgb::WHITE, Rgb::BLACK] }
    }

    /// The mean over 512 x 512 points of the footprint.
    fn by_counting(n: u32, uv: Vec2, f: &Footprint) -> f64 {
        let steps = 512;
        let (mut sum, mut count) = (0.0, 0.0);
        for i in 0..steps {
            for j in 0..steps {
                let at = |k: i32| ((k as f64) + 0.5) / steps as f64 - 0.5;
                let p = uv.as_dvec2() + f.dx.as_dvec2() * at(i) + f.dy.as_dvec2() * at(j);
                if f.edges[0] == UvEdge::Bounded && p.clamp(DVec2::ZERO, DVec2::ONE) != p {
                    continue;
                }
                let square = |x: f64| match f.edges[0] {
                    UvEdge::Bounded | UvEdge::Folded => (x * n as f64).floor().clamp(0.0, n as f64 - 1.0),
                    UvEdge::Periodic => ((x - x.floor()) * n as f64).floor(),
                    UvEdge::Unbounded => (x * n as f64).floor(),
                };
                sum += if (square(p.x) + square(p.y)).rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
                count += 1.0;
            }
        }
        sum / count
    }

    #[test]
    fn the_mean_is_that_of_many_points() {
        for edge in [UvEdge::Bounded, UvEdge::Folded, UvEdge::Periodic, UvEdge::Unbounded] {
            for n in 1..=9 {
                for (k, size) in [0.02, 0.3, 1.7].into_iter().enumerate() {
                    let f = footprint(Vec2::new(size, 0.3 * size), Vec2::new(-0.2 * size, 0.8 * size), edge);
                    for uv in [Vec2::new(0.01, 0.99), Vec2::new(0.5, 0.333), Vec2::new(0.9 + 0.01 * k as f32, 0.2)] {
                        let (exact, counted) = (board(n).mean(uv, &f), by_counting(n, uv, &f));
                        assert!((exact - counted).abs() < 0.01, "{n} {edge:?} {uv} {size}: {exact} {counted}");
                    }
                }
            }
        }
    }

    /// Halves of a footprint make its mean, and turned or exchanged axes the same: also where it is long and narrow, as
    /// toward a horizon.
    #[test]
    fn halves_make_the_whole() {
        for edge in [UvEdge::Folded, UvEdge::Periodic, UvEdge::Unbounded] {
            for n in 1..=4 {
                for (dx, dy) in [([0.5, 0.2], [7.0, 300.3]), ([90.0, 0.0], [0.3, 4.0]), ([20.0, 21.0], [-1.0, 1.5])] {
                    let (dx, dy) = (Vec2::from(dx), Vec2::from(dy));
                    for at in [Vec2::new(0.3, 0.6), Vec2::new(-7.1, 31.2)] {
                        let mean = |at: Vec2, dx: Vec2, dy: Vec2| board(n).mean(at, &footprint(dx, dy, edge));
                        let whole = mean(at, dx, dy);
                        let halves = [0.25, -0.25].map(|k| mean(at + dy * k, dx, dy * 0.5));
                        let thirds = [-1.0, 0.0, 1.0].map(|k| mean(at + dx * (k / 3.0), dx / 3.0, dy));
                        let exchanged = mean(Vec2::new(at.y, at.x), Vec2::new(dy.y, dy.x), Vec2::new(dx.y, dx.x));
                        let means = [halves.iter().sum::<f64>() / 2.0, thirds.iter().sum::<f64>() / 3.0, exchanged];
                        for mean in means {
                            assert!((mean - whole).abs() < 1e-5, "{edge:?} {n} {at} {dx} {dy}: {whole} {means:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn one_square_is_one_colour_everywhere() {
        let f = footprint(Vec2::new(0.3, 0.1), Vec2::new(0.0, 0.4), UvEdge::Bounded);
        for uv in [Vec2::ZERO, Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::new(0.5, 0.999)] {
            assert_eq!(board(1).color(uv, &f), Rgb::WHITE);
        }
    }

    /// A plate of 3 x 1 squares: what is seen of it from the side, from far away, at its corners.
    #[test]
    fn nothing_beyond_the_rim_counts() {
        let plate = Checkerboard { counts: [3, 1], colors: [Rgb::WHITE, Rgb::BLACK] };
        // Two squares of one colour and one of the other, however far beyond the rim it goes
        for size in [2.0, 30.0, 3e3, 3e5] {
            let f = footprint(Vec2::new(size, 0.0), Vec2::new(0.0, size), UvEdge::Bounded);
            let mean = plate.mean(Vec2::new(0.5, 0.5), &f);
            assert!((mean - 1.0 / 3.0).abs() < 1e-6, "{size}: {mean}");
            let thin = footprint(Vec2::new(size, 0.0), Vec2::ZERO, UvEdge::Bounded);
            let mean = plate.mean(Vec2::new(0.5, 0.5), &thin);
            assert!((mean - 1.0 / 3.0).abs() < 1e-6, "a line of {size}: {mean}");
        }
        // From a corner a quarter is left: half a square of the first colour along u
        let f = footprint(Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0), UvEdge::Bounded);
        let mean = plate.mean(Vec2::ZERO, &f);
        assert!((mean - (1.0 / 3.0 - 1.0 / 6.0) / 0.5).abs() < 1e-6, "{mean}");
        // A line along the rim, and one that only touches a corner
        let line = footprint(Vec2::new(2.0, 0.0), Vec2::ZERO, UvEdge::Bounded);
        assert!((plate.mean(Vec2::new(0.5, 1.0), &line) - 1.0 / 3.0).abs() < 1e-6);
        let touching = footprint(Vec2::new(1.0, -1.0), Vec2::ZERO, UvEdge::Bounded);
        assert_eq!(plate.mean(Vec2::ZERO, &touching), 1.0);
    }

    #[test]
    fn thin_and_hostile_footprints_are_finite() {
        let vs = [0.0, 1e-30, 1e-7, 0.4, 3.0, 1e6, 1e30, f32::INFINITY, f32::NAN];
        for x in vs {
            for y in vs {
                let f = footprint(Vec2::new(x, y), Vec2::new(y, -x * 0.5), UvEdge::Periodic);
                let c = board(5).color(Vec2::new(0.3, 0.6), &f);
                assert!((0.0..=1.0).contains(&c.r), "{x} {y}: {c:?}");
            }
        }
        // A line across four squares, two of each colour
        let line = footprint(Vec2::new(1.0, 0.0), Vec2::ZERO, UvEdge::Bounded);
        assert_eq!(board(4).mean(Vec2::new(0.5, 0.1), &line), 0.0);
    }

    #[test]
    fn from_far_it_is_gray() {
        let f = footprint(Vec2::new(40.0, 1.0), Vec2::new(-2.0, 30.0), UvEdge::Periodic);
        assert!(board(8).mean(Vec2::new(0.4, 0.7), &f).abs() < 0.01);
    }
}
