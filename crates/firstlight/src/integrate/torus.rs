//! Tori in the way of a light, for sixteen points at once.
//!
//! A point and a row of the light lie in a plane. A half plane that ends in the torus' axis meets that plane in a line,
//! and the tube in a disk: what they have in common is a chord, and the chords of all half planes are what the plane
//! cuts out of the torus. Where there is one is told by a quadratic in the cosine of the angle around the axis; so the
//! plane cuts out two parts that mirror each other, which may meet on the mirror. The ends of chords run around each
//! part, and where the way to them turns around, the part begins and ends as the point sees it.
//!
//! In the torus' own space its circle has radius 1 around z.

use std::f32::consts::{FRAC_PI_2, PI};

use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::batch::Linear16;
use super::breaks::Breaks;
use super::row::{FAR, Interval16, root_between};
use crate::math::{Vec3x16, sin_cos};

/// Places around a part at which it is looked at, by an angle whose cosine is that around the axis as it goes from one
/// end of the part to the other and back: steps of 30 degrees, and closer to the ends, where the tube turns quickly if
/// another part is near.
const PLACES: usize = 18;

/// One of them.
struct AroundPlace {
    /// Its angle, as a part of pi, and the cosine of that.
    part: f32,
    cos: f32,
    /// On which side of the tube it is.
    side: f32,
    /// Which are before and after it, and how far.
    before: usize,
    after: usize,
    apart: [f32; 2],
}

const AROUND: [AroundPlace; PLACES] = {
    const STEPS: [(f32, f32); 9] = [
        (1.0 / 96.0, 0.999_464_6),
        (1.0 / 24.0, 0.991_444_9),
        (1.0 / 6.0, 0.866_025_4),
        (1.0 / 3.0, 0.5),
        (0.5, 0.0),
        (2.0 / 3.0, -0.5),
        (5.0 / 6.0, -0.866_025_4),
        (23.0 / 24.0, -0.991_444_9),
        (95.0 / 96.0, -0.999_464_6),
    ];
    const NONE: AroundPlace = AroundPlace { part: 0.0, cos: 0.0, side: 0.0, before: 0, after: 0, apart: [0.0; 2] };
    let mut all = [NONE; PLACES];
    let mut k = 0;
    while k < PLACES {
        // There, on one side of the tube, and back on the other
        let (part, cos) = if k < 9 { STEPS[k] } else { STEPS[17 - k] };
        let (part, side) = if k < 9 { (part, 1.0) } else { (2.0 - part, -1.0) };
        let (before, after) = ((k + PLACES - 1) % PLACES, (k + 1) % PLACES);
        all[k] = AroundPlace { part, cos, side, before, after, apart: [0.0; 2] };
        k += 1;
    }
    k = 0;
    while k < PLACES {
        let [before, after] = [all[k].part - all[all[k].before].part, all[all[k].after].part - all[k].part];
        all[k].apart =
            [if before < 0.0 { before + 2.0 } else { before }, if after < 0.0 { after + 2.0 } else { after }];
        k += 1;
    }
    all
};
/// Rows at which the parts of a cell's rows are looked at, to find where they begin, end and meet.
const LOOKS: usize = 8;
/// How often the end of a part is looked for between three places.
const TURNS: usize = 4;
/// Beyond any x of a light.
const BESIDE: f32 = 4.0;
/// In ways to the light: what is nearer to a point than this, or behind it, is not in front of it.
const AHEAD: f32 = 1e-6;

/// A torus as sixteen points see it from outside.
#[derive(Clone, Copy)]
pub(crate) struct TorusShadow<S: Simd> {
    /// The points, and the ways to the light, in the torus' own space.
    o: Vec3x16<S>,
    l: [Vec3x16<S>; 3],
    /// The radius of the tube.
    tube: f32,
}

/// The plane of a point and a row.
struct RowPlane<S: Simd> {
    /// Its unit normal, how long that is across the axis, and its direction there.
    n: Vec3x16<S>,
    h: f32x16<S>,
    e: [f32x16<S>; 2],
    /// How far it is from the middle.
    off: f32x16<S>,
    /// Their products with the way from the point are how far along the row's first way, and its second, that goes.
    along: [Vec3x16<S>; 2],
    /// From where to where the cosine goes around a part, as its middle and half of its length.
    middle: f32x16<S>,
    half: f32x16<S>,
}

impl<S: Simd> TorusShadow<S> {
    /// `to` is the way to the middle, `l` are the light's.
    #[inline(always)]
    pub fn new(to: Vec3x16<S>, l: &[Vec3x16<S>; 3], tube: f32) -> Self {
        TorusShadow { o: Vec3x16 { x: -to.x, y: -to.y, z: -to.z }, l: *l, tube }
    }

    /// What is hidden of sixteen rows. Not inlined: one copy for each instruction set is enough.
    #[inline(never)]
    pub fn hidden(&self, simd: S, y: f32x16<S>) -> [Interval16<S>; 2] {
        simd.vectorize(
            #[inline(always)]
            || self.hidden_now(simd, y),
        )
    }

    #[inline(always)]
    fn hidden_now(&self, simd: S, y: f32x16<S>) -> [Interval16<S>; 2] {
        let (zero, one, far) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0), simd.splat_f32x16(FAR));
        let (first, second) = (self.l[0] + self.l[2] * y, self.l[1]);
        let across = first.cross(second);
        let length2 = across.dot(across).max(simd.splat_f32x16(f32::MIN_POSITIVE));
        let n = across * (1.0 / length2.sqrt());
        let off = n.dot(self.o);
        let h = (n.x * n.x + n.y * n.y).sqrt();
        let is_tilted = h.simd_gt(f32::MIN_POSITIVE);
        let inverse = 1.0 / is_tilted.select(h, one);
        let e = [is_tilted.select(n.x * inverse, one), is_tilted.select(n.y * inverse, zero)];
        let along = [second.cross(across) * (1.0 / length2), across.cross(first) * (1.0 / length2)];
        // A chord where (off - c)^2 <= tube^2 (c^2 + n.z^2), c being h times the cosine
        let rest = 1.0 - self.tube * self.tube;
        let root = (off * off + n.z * n.z * rest).max(zero).sqrt() * self.tube;
        let (low, high) = ((off - root) * (1.0 / rest), (off + root) * (1.0 / rest));
        let is_there = low.simd_le(h) & high.simd_ge(-h);
        if !is_there.any_true() {
            return [Interval16::none(simd); 2];
        }
        let (first, last) = (low.simd_le(-h), high.simd_ge(h));
        let least = first.select(-one, low * inverse);
        let most = last.select(one, high * inverse);
        let (middle, half) = ((most + least) * 0.5, (most - least) * 0.5);
        let plane = RowPlane { n, h, e, off, along, middle, half };
        // Where the chord in which they meet is not seen on the light they are seen apart: they may run around the
        // point
        let mut is_one = zero.simd_gt(zero);
        for (cos, is_end) in [(-one, first), (one, last)] {
            let chord = [one, -one].map(
                #[inline(always)]
                |side| self.place(simd, &plane, cos, 1.0, side),
            );
            let mut seen = Interval16 { from: far, to: -far };
            for [t, x] in chord {
                let on_row = x / t.max(simd.splat_f32x16(AHEAD));
                seen.from = is_between(t).select(seen.from.min(on_row), seen.from);
                seen.to = is_between(t).select(seen.to.max(on_row), seen.to);
            }
            pass(&mut seen, chord);
            is_one |= is_end & seen.from.simd_lt(BESIDE) & seen.to.simd_gt(-BESIDE);
        }
        let (left, right) = (self.extent(simd, &plane, 1.0), self.extent(simd, &plane, -1.0));
        let from = is_one.select(left.from.min(right.from), left.from);
        let to = is_one.select(left.to.max(right.to), left.to);
        let is_other = is_there & !is_one;
        [
            Interval16 { from: is_there.select(from, far), to: is_there.select(to, -far) },
            Interval16 { from: is_other.select(right.from, far), to: is_other.select(right.to, -far) },
        ]
    }

    /// How far along both ways of a row the end of a chord is, by the cosine around the axis, on one side of the mirror
    /// and one of the tube.
    #[inline(always)]
    fn place(&self, simd: S, plane: &RowPlane<S>, cos: f32x16<S>, mirror: f32, side: f32x16<S>) -> [f32x16<S>; 2] {
        let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
        let sin = (one - cos * cos).max(zero).sqrt() * mirror;
        // In the half plane: the line's normal, the middle of the chord from that of the tube, and half of its length
        let (nr, nz) = (plane.h * cos, plane.n.z);
        let inverse = 1.0 / (nr * nr + nz * nz).max(simd.splat_f32x16(f32::MIN_POSITIVE)).sqrt();
        let (ur, uz) = (nr * inverse, nz * inverse);
        let apart = (plane.off - nr) * inverse;
        let long = (self.tube * self.tube - apart * apart).max(zero).sqrt() * side;
        let (out, z) = (one + apart * ur - long * uz, apart * uz + long * ur);
        let [ex, ey] = plane.e;
        let way = Vec3x16 { x: (ex * cos - ey * sin) * out, y: (ey * cos + ex * sin) * out, z } - self.o;
        [plane.along[0].dot(way), plane.along[1].dot(way)]
    }

    /// From where to where on the row one part is seen.
    #[inline(always)]
    fn extent(&self, simd: S, plane: &RowPlane<S>, mirror: f32) -> Interval16<S> {
        let zero = simd.splat_f32x16(0.0);
        let mut places = [[zero; 2]; PLACES];
        let mut on_row = [zero; PLACES];
        let mut all = zero.simd_eq(zero);
        for (k, AroundPlace { cos, side, .. }) in AROUND.iter().enumerate() {
            let cos = plane.half * *cos + plane.middle;
            places[k] = self.place(simd, plane, cos, mirror, simd.splat_f32x16(*side));
            on_row[k] = places[k][1] / places[k][0].max(simd.splat_f32x16(AHEAD));
            all &= is_between(places[k][0]);
        }
        let from = self.least(simd, plane, mirror, &places, &on_row, 1.0);
        let to = -self.least(simd, plane, mirror, &places, &on_row, -1.0);
        if all.all_true() {
            return Interval16 { from, to };
        }
        let mut extent = Interval16 { from, to };
        for k in 0..PLACES {
            pass(&mut extent, [places[k], places[AROUND[k].after]]);
        }
        extent
    }

    /// The least place of a part on the row, or, with `sign` -1, the opposite of the greatest: from the least of those
    /// that were looked at, by parabolas through three, between which it lies.
    #[inline(always)]
    fn least(
        &self,
        simd: S,
        plane: &RowPlane<S>,
        mirror: f32,
        places: &[[f32x16<S>; 2]; PLACES],
        on_row: &[f32x16<S>; PLACES],
        sign: f32,
    ) -> f32x16<S> {
        let (zero, far) = (simd.splat_f32x16(0.0), simd.splat_f32x16(FAR));
        let (mut x, mut s) = ([zero, far, zero], [zero; 3]);
        for (k, AroundPlace { part, before, after, apart, .. }) in AROUND.iter().enumerate() {
            let here = on_row[k] * sign;
            let is = is_between(places[k][0]) & here.simd_lt(x[1]);
            x[0] = is.select(on_row[*before] * sign, x[0]);
            x[1] = is.select(here, x[1]);
            x[2] = is.select(on_row[*after] * sign, x[2]);
            s[0] = is.select(simd.splat_f32x16(*part - apart[0]), s[0]);
            s[1] = is.select(simd.splat_f32x16(*part), s[1]);
            s[2] = is.select(simd.splat_f32x16(*part + apart[1]), s[2]);
        }
        for _ in 0..TURNS {
            let (back, on) = (s[1] - s[0], s[2] - s[1]);
            let (fall, rise) = (x[0] - x[1], x[2] - x[1]);
            let way = (back * back * rise - on * on * fall) * -0.5 / (back * rise + on * fall);
            // Into the wider side where the parabola says nothing new
            let wider = on.simd_gt(back).select(on, -back) * 0.4;
            let is_new = way.simd_gt(back * -0.9) & way.simd_lt(on * 0.9) & way.abs().simd_gt((back + on) * 0.01);
            let part = s[1] + is_new.select(way, wider);
            let is_back = part.simd_lt(zero) | part.simd_gt(1.0) & part.simd_lt(2.0);
            let side = is_back.select(simd.splat_f32x16(-1.0), simd.splat_f32x16(1.0));
            // From -1 to 3, the cosine of which is that of what is left to 0 or 2
            let turned = ((part.abs() - 1.0).abs() - 0.5) * PI;
            let turned = turned.min(simd.splat_f32x16(FRAC_PI_2));
            let cos = sin_cos(turned).0;
            let [t, across] = self.place(simd, plane, plane.half * cos + plane.middle, mirror, side);
            let there = (across / t.max(simd.splat_f32x16(AHEAD))) * sign;
            let is_less = is_between(t) & there.simd_lt(x[1]);
            let is_after = part.simd_gt(s[1]);
            // What lies on the other side of the lesser one is the new end there
            let (above, below) = (is_less ^ is_after, is_less ^ !is_after);
            let ends = [is_less.select(x[1], there), is_less.select(s[1], part)];
            (x[0], s[0]) = (below.select(ends[0], x[0]), below.select(ends[1], s[0]));
            (x[2], s[2]) = (above.select(ends[0], x[2]), above.select(ends[1], s[2]));
            (x[1], s[1]) = (is_less.select(there, x[1]), is_less.select(part, s[1]));
        }
        x[1]
    }

    /// Whether a place of the light is hidden.
    #[inline(always)]
    pub fn hides(&self, x: f32x16<S>, y: f32x16<S>) -> mask32x16<S> {
        let [one, other] = self.hidden(x.token(), y);
        x.simd_gt(one.from) & x.simd_lt(one.to) | x.simd_gt(other.from) & x.simd_lt(other.to)
    }

    /// See [`Shadow::breaks`](super::occluder::Shadow::breaks): the planes of these rows touch the torus.
    #[inline(never)]
    pub fn breaks(&self, breaks: &mut Breaks<S>) {
        breaks.of.token().vectorize(
            #[inline(always)]
            || self.breaks_now(breaks),
        );
    }

    #[inline(always)]
    fn breaks_now(&self, breaks: &mut Breaks<S>) {
        let simd = breaks.of.token();
        let zero = simd.splat_f32x16(0.0);
        let lines = [self.l[0].cross(self.l[1]), self.l[2].cross(self.l[1])];
        let line = |c: f32x16<S>, y: f32x16<S>| Linear16 { c, x: zero, y };
        let normal = [line(lines[0].x, lines[1].x), line(lines[0].y, lines[1].y), line(lines[0].z, lines[1].z)];
        let off = line(lines[0].dot(self.o), lines[1].dot(self.o));
        let [low, high] = breaks.y;
        let step = (high - low) * (1.0 / LOOKS as f32);
        // The plane is as far from the middle as the circle reaches, more or less the tube
        for [of_circle, of_tube] in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let touch = [of_circle, of_tube * self.tube];
            let mut before = zero;
            for k in 0..=LOOKS {
                let here = gap(&normal, &off, low + step * k as f32, touch);
                let changes = breaks.of & (here.simd_lt(zero) ^ before.simd_lt(zero));
                if k > 0 && changes.any_true() {
                    let between = [low + step * (k as f32 - 1.0), low + step * k as f32];
                    let root = root_between(
                        between,
                        [before, here],
                        #[inline(always)]
                        |y| gap(&normal, &off, y, touch),
                    );
                    breaks.tell_if(root, changes);
                }
                before = here;
            }
        }
    }
}

/// Whether a place so far along the first way of a row is between the point and the light.
#[inline(always)]
fn is_between<S: Simd>(t: f32x16<S>) -> mask32x16<S> {
    t.simd_gt(AHEAD) & t.simd_lt(1.0)
}

/// Extends what is seen of something that runs between two places straight on: from before the point to behind it, no
/// row ends before it does; nor, through the light's plane, before it gets there.
#[inline(always)]
fn pass<S: Simd>(seen: &mut Interval16<S>, [[t0, x0], [t1, x1]]: [[f32x16<S>; 2]; 2]) {
    let simd = t0.token();
    let (zero, far) = (simd.splat_f32x16(0.0), simd.splat_f32x16(FAR));
    let crosses = t0.simd_gt(AHEAD) ^ t1.simd_gt(AHEAD);
    let x = (x0 * t1 - x1 * t0) * (t1 - t0);
    seen.from = (crosses & x.simd_lt(zero)).select(-far, seen.from);
    seen.to = (crosses & x.simd_gt(zero)).select(far, seen.to);
    let crosses = t0.simd_lt(1.0) ^ t1.simd_lt(1.0);
    let x = (x0 * (t1 - 1.0) + x1 * (1.0 - t0)) / (t1 - t0);
    seen.from = crosses.select(seen.from.min(x), seen.from);
    seen.to = crosses.select(seen.to.max(x), seen.to);
}

/// How far the plane of a row is from touching a torus, times the length of its normal.
#[inline(always)]
fn gap<S: Simd>(normal: &[Linear16<S>; 3], off: &Linear16<S>, y: f32x16<S>, [circle, tube]: [f32; 2]) -> f32x16<S> {
    let [nx, ny, nz] = [normal[0].c + y * normal[0].y, normal[1].c + y * normal[1].y, normal[2].c + y * normal[2].y];
    let across2 = nx * nx + ny * ny;
    off.c + y * off.y - across2.sqrt() * circle - (across2 + nz * nz).sqrt() * tube
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;
    use glam::DVec2;

    use super::*;
    use crate::math::{DVec3, LANES, Vec2, Vec3, dispatch_wide};

    /// Whether the way from `o` to `o` + `l` passes within the tube, by many places on it.
    fn is_hidden(o: Vec3, l: Vec3, tube: f32) -> Option<bool> {
        let (o, l) = (o.as_dvec3(), l.as_dvec3());
        let distance = |t: f64| {
            let p = o + l * t;
            DVec2::new(p.truncate().length() - 1.0, p.z).length() - f64::from(tube)
        };
        let mut nearest = f64::INFINITY;
        let steps = 4000;
        for k in 0..=steps {
            nearest = nearest.min(distance(f64::from(k) / f64::from(steps)));
        }
        (nearest.abs() > 4e-4 * (1.0 + l.length() * 0.1)).then_some(nearest < 0.0)
    }

    #[test]
    fn rows_are_hidden_as_rays_are() {
        let mut random = firstlight_testkit::Random::new(1);
        let (mut asked, mut seen) = (0, 0);
        for round in 0..400 {
            let tube = random.between(0.05, 0.85) as f32;
            let mut vector = |reach: f64| DVec3::from(random.vector(reach)).as_vec3();
            // From far away, from near, and from the plane that the torus lies on
            let mut o = vector(if round % 2 == 0 { 8.0 } else { 2.5 });
            if round % 3 == 0 {
                o = Vec3::new(o.x, o.y, -tube * 1.001);
            }
            if Vec2::new(o.truncate().length() - 1.0, o.z).length() < tube * 1.0005 {
                continue;
            }
            let to = if round % 5 == 0 { Vec3::new(0.0, 0.0, 6.0) + vector(2.0) } else { vector(0.5) - o * 1.5 };
            let (c, a, b) = (o + to, vector(3.0), vector(3.0));
            if a.cross(b).normalize().dot(c - o).abs() < 0.01 {
                continue;
            }
            let y: [f32; LANES] = std::array::from_fn(|k| k as f32 / 7.5 - 1.0);
            let intervals: [[[f32; LANES]; 2]; 2] = dispatch_wide!(Level::new(), simd => {
                let splat = |v: Vec3| Vec3x16::splat(simd, v);
                let shadow = TorusShadow::new(splat(-o), &[splat(c - o), splat(a), splat(b)], tube);
                shadow.hidden(simd, f32x16::simd_from(simd, y)).map(|i| [i.from.to_array(), i.to.to_array()])
            });
            for row in 0..LANES {
                // No part of the light is inside
                let at = |x: f32| c + a * x + b * y[row];
                let outside = |q: Vec3| Vec2::new(q.truncate().length() - 1.0, q.z).length() - tube;
                if (0..=40).any(|k| outside(at(k as f32 / 20.0 - 1.0)) < 0.15 * a.length()) {
                    continue;
                }
                for k in 0..=20 {
                    let x = k as f32 / 10.0 - 1.0;
                    let Some(is) = is_hidden(o, c - o + a * x + b * y[row], tube) else { continue };
                    let told = intervals.iter().any(|[from, to]| from[row] < x && x < to[row]);
                    (asked, seen) = (asked + 1, seen + usize::from(is));
                    assert_eq!(told, is, "round {round}, row {row}, x {x}, {o} {c} {a} {b} {tube} {intervals:?}");
                }
            }
        }
        assert!(asked > 50_000 && seen > 2_000, "{asked} {seen}");
    }
}
