//! What a convex thing hides of a flat light, row by row.
//!
//! Seen from one point, what a convex thing hides of a flat light is convex as well: on every row y of the light it is
//! one interval of x. Straight edges give linear inequalities in x, spheres one quadratic.

use fearless_simd::{f32x16, prelude::*};

use super::view::{Linear, View};
use crate::math::{DVec3, Vec3};
use crate::shape::DiskBounds;

/// The most edges, with the plane.
const EDGES: usize = 5;

/// A convex thing that may stand between a point and a light.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Hider {
    /// A triangle or a parallelogram.
    Edges(Edges),
    /// A sphere that the point is outside of, or a disk.
    Cone(Cone),
    /// Half of a sphere that the point is inside of: what of the light is outside.
    Shell(Shell),
}

/// Hidden is what is not inside a sphere: of each row all, or what is before the sphere, or what is beyond it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shell {
    /// r^2 - |l - s|^2, s leading to the centre.
    inside: Quadratic,
    is_beyond: bool,
}

/// Hidden is where all of these are 0 or more.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edges {
    sides: [Linear; EDGES],
    count: usize,
    /// What a side is divided by to be a distance, or less: at the light, not at the edge, which is nearer.
    lengths: [f32; EDGES],
}

/// Hidden is where `quadratic` and `ahead` are 0 or more; and, of a sphere that the light's plane cuts, only where that
/// happens before the light is reached, or the light itself is inside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    /// r^2 |l|^2 - |l x s|^2, s leading to the centre: whether the line meets the sphere. Of a disk (n.l)^2 - (x.l)^2 -
    /// (y.l)^2.
    quadratic: Quadratic,
    /// l.s; of a disk, how far beyond its plane l ends.
    ahead: Linear,
    /// |l|^2 - l.s, which is below 0 where the sphere's middle is behind the light, and r^2 - |l - s|^2.
    cut: Option<[Quadratic; 2]>,
}

/// c + 2 x X + 2 y Y + x^2 XX + 2 x y XY + y^2 YY.
#[derive(Clone, Copy, Debug)]
struct Quadratic {
    c: f32,
    x: f32,
    y: f32,
    xx: f32,
    xy: f32,
    yy: f32,
}

impl Linear {
    fn squared(self) -> Quadratic {
        let Linear { c, x, y } = self;
        Quadratic { c: c * c, x: c * x, y: c * y, xx: x * x, xy: x * y, yy: y * y }
    }
}

impl Quadratic {
    /// The product of two vectors that are linear over the light.
    fn dot(p: [Vec3; 3], q: [Vec3; 3]) -> Quadratic {
        Quadratic {
            c: p[0].dot(q[0]),
            x: 0.5 * (p[0].dot(q[1]) + p[1].dot(q[0])),
            y: 0.5 * (p[0].dot(q[2]) + p[2].dot(q[0])),
            xx: p[1].dot(q[1]),
            xy: 0.5 * (p[1].dot(q[2]) + p[2].dot(q[1])),
            yy: p[2].dot(q[2]),
        }
    }

    fn combined(self, k: f32, other: Quadratic, m: f32) -> Quadratic {
        let f = |a: f32, b: f32| a * k + b * m;
        Quadratic {
            c: f(self.c, other.c),
            x: f(self.x, other.x),
            y: f(self.y, other.y),
            xx: f(self.xx, other.xx),
            xy: f(self.xy, other.xy),
            yy: f(self.yy, other.yy),
        }
    }

    fn at(&self, x: f32, y: f32) -> f32 {
        self.c + 2.0 * (x * self.x + y * self.y) + x * x * self.xx + 2.0 * x * y * self.xy + y * y * self.yy
    }

    /// On row `y`: half the slope, and the constant.
    #[inline(always)]
    fn row<S: Simd>(&self, y: f32x16<S>) -> [f32x16<S>; 2] {
        [y * self.xy + self.x, y * (y * self.yy + 2.0 * self.y) + self.c]
    }

    /// The rows on which the line x = `x` crosses 0.
    fn crossings(&self, x: f64) -> [Option<f64>; 2] {
        let [c, b] = [
            f64::from(self.c) + 2.0 * x * f64::from(self.x) + x * x * f64::from(self.xx),
            f64::from(self.y) + x * f64::from(self.xy),
        ];
        roots(f64::from(self.yy), b, c)
    }

    /// Calls `row` with the rows of [`Hider::corners`], where x goes from `x0` to `x1`.
    fn corners(&self, [x0, x1]: [f64; 2], row: &mut impl FnMut(f64)) {
        let rows = [self.tangents(), self.crossings(x0), self.crossings(x1)];
        rows.into_iter().flatten().flatten().for_each(row);
    }

    /// The rows that only touch 0.
    fn tangents(&self) -> [Option<f64>; 2] {
        let [c, x, y, xx, xy, yy] = [self.c, self.x, self.y, self.xx, self.xy, self.yy].map(f64::from);
        roots(xy * xy - xx * yy, x * xy - xx * y, x * x - xx * c)
    }
}

/// r^2 - |l - s|^2: whether a place of the light is inside of a sphere around `s`.
fn inside(view: &View, s: DVec3, r: f64) -> Quadratic {
    let from_center = [(view.l0.as_dvec3() - s).as_vec3(), view.a, view.b];
    let Quadratic { c, x, y, xx, xy, yy } = Quadratic::dot(from_center, from_center);
    Quadratic { c: (r * r) as f32 - c, x: -x, y: -y, xx: -xx, xy: -xy, yy: -yy }
}

/// Where a y^2 + 2 b y + c is 0.
fn roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    let discriminant = b * b - a * c;
    if !(discriminant >= 0.0) {
        return [None, None];
    }
    let q = -(b + discriminant.sqrt().copysign(b));
    let finite = |y: f64| y.is_finite().then_some(y);
    [finite(q / a), finite(c / q)]
}

/// An interval of x on each of sixteen rows; empty where it ends before it begins.
#[derive(Clone, Copy)]
pub(crate) struct Interval<S: Simd> {
    pub from: f32x16<S>,
    pub to: f32x16<S>,
}

/// Farther than any x that is asked about.
const FAR: f32 = 1e30;
/// Slopes below this are none: their reciprocals have no bound.
const FLAT: f32 = 1e-30;

impl<S: Simd> Interval<S> {
    #[inline(always)]
    pub fn all(simd: S) -> Self {
        Interval { from: simd.splat_f32x16(-FAR), to: simd.splat_f32x16(FAR) }
    }

    /// What is left where `slope` x + `c` >= 0.
    #[inline(always)]
    pub fn clip(&mut self, c: f32x16<S>, slope: f32) {
        let simd = c.token();
        if slope > FLAT {
            self.from = self.from.max(c * (-1.0 / slope));
        } else if slope < -FLAT {
            self.to = self.to.min(c * (-1.0 / slope));
        } else {
            self.to = c.simd_ge(0.0).select(self.to, simd.splat_f32x16(-FAR));
        }
    }
}

impl Hider {
    /// A flat thing with these corners, around, as seen from the point; `None` if the point is in its plane.
    pub fn polygon(view: &View, corners: &[Vec3]) -> Option<Hider> {
        let count = corners.len();
        let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let n = n / n.length();
        // The plane: l has to pass it
        let mut distance = n.dot(corners[0]);
        let mut normal = n;
        if distance < 0.0 {
            (distance, normal) = (-distance, -n);
        }
        if !(distance > 0.0) {
            return None;
        }
        let linear = |v: Vec3, c: f32| Linear { c: v.dot(view.l0) - c, x: v.dot(view.a), y: v.dot(view.b) };
        let mut sides = [Linear::default(); EDGES];
        sides[0] = linear(normal, distance);
        let mut lengths = [1.0; EDGES];
        let turn = corners[0].cross(corners[1]).dot(corners[2]);
        for i in 0..count {
            let plane = corners[i].cross(corners[(i + 1) % count]);
            lengths[i + 1] = plane.length();
            sides[i + 1] = linear(if turn < 0.0 { -plane } else { plane }, 0.0);
        }
        Some(Hider::Edges(Edges { sides, count: count + 1, lengths }))
    }

    /// All that is farther than `distance` along the unit vector `n`.
    pub fn beyond(view: &View, n: Vec3, distance: f32) -> Hider {
        Hider::side(Linear { c: n.dot(view.l0) - distance, x: n.dot(view.a), y: n.dot(view.b) })
    }

    /// All of the light where that is below 0.
    pub fn below(Linear { c, x, y }: Linear) -> Hider {
        Hider::side(Linear { c: -c, x: -x, y: -y })
    }

    fn side(side: Linear) -> Hider {
        let mut sides = [Linear::default(); EDGES];
        sides[0] = side;
        Hider::Edges(Edges { sides, count: 1, lengths: [1.0; EDGES] })
    }

    /// A sphere whose centre is at `s` from the point, which is outside of it. `None` if it is wholly behind the
    /// light's plane.
    pub fn sphere(view: &View, s: DVec3, r: f64) -> Option<Hider> {
        let normal = view.a.cross(view.b);
        let normal = (normal / normal.length()).as_dvec3();
        let to_plane = normal.dot(view.l0.as_dvec3());
        let beyond = (normal.dot(s) - to_plane) * to_plane.signum();
        if beyond > r {
            return None;
        }
        let (center, s, r2) = (s, s.as_vec3(), (r * r) as f32);
        let l = [view.l0, view.a, view.b];
        let cross = l.map(|v| v.cross(s));
        let ll = Quadratic::dot(l, l);
        let ahead = Linear { c: s.dot(view.l0), x: s.dot(view.a), y: s.dot(view.b) };
        let cut = (beyond > -r).then(|| {
            let ls = Quadratic { c: ahead.c, x: 0.5 * ahead.x, y: 0.5 * ahead.y, xx: 0.0, xy: 0.0, yy: 0.0 };
            [ll.combined(1.0, ls, -1.0), inside(view, center, r)]
        });
        // The same as (r^2 - |s|^2) |l|^2 + (l.s)^2, which is small by itself where the point is close to the sphere
        let power = r * r - center.length_squared();
        let quadratic = if power.abs() < 0.5 * r * r {
            ll.combined(power as f32, ahead.squared(), 1.0)
        } else {
            ll.combined(r2, Quadratic::dot(cross, cross), -1.0)
        };
        Some(Hider::Cone(Cone { quadratic, ahead, cut }))
    }

    /// A sphere around the point, whose centre is at `s` from it: together, all that is outside.
    pub fn shells(view: &View, s: DVec3, r: f64) -> [Hider; 2] {
        let inside = inside(view, s, r);
        [false, true].map(|is_beyond| Hider::Shell(Shell { inside, is_beyond }))
    }

    /// A disk, as the point sees it.
    pub fn disk(view: &View, disk: &DiskBounds) -> Hider {
        let l = [view.l0, view.a, view.b];
        let square = |v: Vec3| {
            let [c, x, y] = l.map(|l| v.dot(l));
            Linear { c, x, y }.squared()
        };
        let across = square(disk.x).combined(1.0, square(disk.y), 1.0);
        let beyond = disk.height + disk.room;
        let ahead = Linear { c: -disk.n.dot(view.l0) - beyond, x: -disk.n.dot(view.a), y: -disk.n.dot(view.b) };
        Hider::Cone(Cone { quadratic: square(disk.n).combined(1.0, across, -1.0), ahead, cut: None })
    }

    /// What is hidden of sixteen rows.
    #[inline(always)]
    pub fn hidden<S: Simd>(&self, simd: S, y: f32x16<S>) -> Interval<S> {
        match self {
            Hider::Edges(edges) => {
                let mut interval = Interval::all(simd);
                for side in &edges.sides[..edges.count] {
                    interval.clip(y * side.y + side.c, side.x);
                }
                interval
            }
            Hider::Cone(cone) => cone.hidden(simd, y),
            Hider::Shell(shell) => {
                let (zero, far) = (simd.splat_f32x16(0.0), simd.splat_f32x16(FAR));
                let [low, high, meets] = real_roots(simd, &shell.inside, y);
                let meets = meets.simd_gt(zero);
                match shell.is_beyond {
                    false => Interval { from: -far, to: meets.select(low, far) },
                    true => Interval { from: meets.select(high, -far), to: far },
                }
            }
        }
    }

    /// Whether the point (x, y) of the light is hidden.
    pub fn hides(&self, x: f32, y: f32) -> bool {
        match self {
            Hider::Edges(edges) => edges.sides[..edges.count].iter().all(|side| side.at(x, y) >= 0.0),
            Hider::Cone(cone) => {
                let q = |q: &Quadratic| q.at(x, y);
                let on_line = q(&cone.quadratic) >= 0.0 && cone.ahead.at(x, y) > 0.0;
                match &cone.cut {
                    None => on_line,
                    Some([before, inside]) => on_line && q(before) > 0.0 || q(inside) >= 0.0,
                }
            }
            Hider::Shell(shell) => shell.inside.at(x, y) < 0.0,
        }
    }

    /// Calls `row` with the rows at which the hidden part begins, ends, or has a corner, and those at which its outline
    /// crosses both ends of x: between them, what is left of a row changes smoothly. Some may be told in vain.
    pub fn corners(&self, view: &View, mut row: impl FnMut(f64)) {
        let ([x0, x1], [y0, y1]) = (view.x.map(f64::from), view.y.map(f64::from));
        let mut row = |y: f64| {
            if y > y0 && y < y1 {
                row(y);
            }
        };
        match self {
            Hider::Edges(edges) => {
                let sides = &edges.sides[..edges.count];
                let inside = |x: f64, y: f64, but: [usize; 2]| {
                    sides.iter().enumerate().all(|(i, side)| {
                        let [c, sx, sy] = [side.c, side.x, side.y].map(f64::from);
                        but.contains(&i) || c + sx * x + sy * y >= -1e-6 * (c.abs() + sx.abs() + sy.abs())
                    })
                };
                for (i, p) in sides.iter().enumerate() {
                    let [c, px, py] = [p.c, p.x, p.y].map(f64::from);
                    for x in [x0, x1] {
                        let y = -(c + px * x) / py;
                        if inside(x, y, [i, i]) {
                            row(y);
                        }
                    }
                    for (j, q) in sides.iter().enumerate().skip(i + 1) {
                        let [d, qx, qy] = [q.c, q.x, q.y].map(f64::from);
                        let area = px * qy - py * qx;
                        let (x, y) = ((py * d - c * qy) / area, (c * qx - px * d) / area);
                        if (x0..=x1).contains(&x) && inside(x, y, [i, j]) {
                            row(y);
                        }
                    }
                }
            }
            Hider::Cone(cone) => {
                cone.quadratic.corners([x0, x1], &mut row);
                if let Some(cut) = &cone.cut {
                    cut.iter().for_each(|quadratic| quadratic.corners([x0, x1], &mut row));
                }
            }
            Hider::Shell(shell) => shell.inside.corners([x0, x1], &mut row),
        }
    }
}

impl Edges {
    /// How far inside the edges, in metres, the way to the point (x, y) of the light passes; below 0 outside.
    pub fn depth(&self, x: f32, y: f32) -> f32 {
        self.sides[..self.count]
            .iter()
            .zip(&self.lengths)
            .fold(f32::INFINITY, |depth, (side, length)| depth.min(side.at(x, y) / length))
    }
}

impl Cone {
    #[inline(always)]
    fn hidden<S: Simd>(&self, simd: S, y: f32x16<S>) -> Interval<S> {
        let (zero, far) = (simd.splat_f32x16(0.0), simd.splat_f32x16(FAR));
        let empty = Interval { from: far, to: -far };
        let [low, high, is_real] = real_roots(simd, &self.quadratic, y);
        let is_real = is_real.simd_gt(zero);
        let mut interval = Interval::all(simd);
        if self.quadratic.xx < 0.0 {
            interval = Interval { from: is_real.select(low, empty.from), to: is_real.select(high, empty.to) };
        } else if self.ahead.x > 0.0 {
            interval.from = is_real.select(high, interval.from);
        } else {
            interval.to = is_real.select(low, interval.to);
        }
        interval.clip(y * self.ahead.y + self.ahead.c, self.ahead.x);
        let Some([before, inside]) = &self.cut else { return interval };
        // Without what is behind the light, and with what is inside the sphere: together they are convex again
        let [b0, b1, cuts] = real_roots(simd, before, y);
        let cuts = cuts.simd_gt(zero);
        let from = (cuts & interval.from.simd_gt(b0) & interval.from.simd_lt(b1)).select(b1, interval.from);
        let to = (cuts & interval.to.simd_gt(b0) & interval.to.simd_lt(b1)).select(b0, interval.to);
        let is_left = from.simd_lt(to);
        let [i0, i1, meets] = real_roots(simd, inside, y);
        let meets = meets.simd_gt(zero);
        let (i0, i1) = (meets.select(i0, far), meets.select(i1, -far));
        Interval { from: is_left.select(from, far).min(i0), to: is_left.select(to, -far).max(i1) }
    }
}

/// The smaller and the larger x at which a quadratic is 0 on each row, and a number above 0 where there are any.
#[inline(always)]
fn real_roots<S: Simd>(simd: S, quadratic: &Quadratic, y: f32x16<S>) -> [f32x16<S>; 3] {
    let zero = simd.splat_f32x16(0.0);
    let [b, c] = quadratic.row(y);
    // Not quite 0, so that one root may be far away and nothing is divided by 0
    let least = (quadratic.xy.abs() + quadratic.x.abs() + quadratic.c.abs()) * 1e-12 + f32::MIN_POSITIVE;
    let a = if quadratic.xx.abs() < least { least.copysign(quadratic.xx) } else { quadratic.xx };
    let discriminant = b * b - c * a;
    let root = discriminant.max(zero).sqrt();
    // -(b + sign(b) root): nothing cancels
    let q = b.simd_lt(zero).select(root - b, -(root + b));
    let one = q / a;
    let other = q.simd_eq(zero).select(zero, c / q.simd_eq(zero).select(simd.splat_f32x16(1.0), q));
    [one.min(other), one.max(other), discriminant]
}
