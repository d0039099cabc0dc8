//! Occluders projected onto a light, row by row, for sixteen points at once.
//!
//! The projection of a convex occluder is convex, so it hides at most one interval of a row, whose ends are roots
//! of a linear function or of a quadratic. An occluder with a hole hides two.
//!
//! Source of the quadratic of a sphere: the tangent cone, r^2 |l|^2 - |l x s|^2 >= 0, as in Heidrich, Brabec,
//! Seidel, "Soft Shadow Maps for Linear Lights", 2000, for one row; the rest is ours.

use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::batch::{Exact, Linear16};
use super::breaks::Breaks;
use super::hull::{Hull, SolidOccluder};
use super::row::{FAR, Interval16, Quadratic16, edges};
use crate::math::Vec3x16;
use crate::shape::Canonical;

/// An occluder in world space, as it is projected.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Occluder {
    Sphere {
        center: Exact,
        radius: f32,
    },
    /// A parallelogram, by its corners in order.
    Flat {
        corners: [Exact; 4],
    },
    Solid(SolidOccluder),
}

/// The vectors from sixteen points to four corners.
#[inline(always)]
pub(crate) fn corners_from<S: Simd>(simd: S, [a, b, c, d]: &[Exact; 4], p: Vec3x16<S>) -> [Vec3x16<S>; 4] {
    [a.seen_from(simd, p), b.seen_from(simd, p), c.seen_from(simd, p), d.seen_from(simd, p)]
}

/// An occluder projected onto a light from sixteen points.
pub(crate) enum Shadow<S: Simd> {
    /// Of a sphere.
    Cone {
        quadratic: Quadratic16<S>,
        ahead: Linear16<S>,
        /// Where the light's plane intersects the sphere of any of the points: the places of the light before the
        /// sphere's polar plane, those inside of the sphere; and the lanes concerned.
        cut: Option<([Quadratic16<S>; 2], mask32x16<S>)>,
        /// Positive inside of the sphere, for points within it.
        inside: Quadratic16<S>,
    },
    /// Of a polygon: positive on all of these lines, the first of which is that of its plane.
    Edges {
        lines: [Linear16<S>; 5],
    },
    Hull(Hull<S>),
}

impl<S: Simd> Shadow<S> {
    /// The projection of `occluder` from `p` onto lights with the vectors `l`.
    #[inline(always)]
    pub fn new(simd: S, occluder: &Occluder, p: Vec3x16<S>, l: &[Vec3x16<S>; 3]) -> Shadow<S> {
        match occluder {
            Occluder::Sphere { center, radius } => Shadow::cone(simd, center.seen_from(simd, p), *radius, l),
            Occluder::Flat { corners } => Shadow::Edges { lines: edges(corners_from(simd, corners, p), l) },
            Occluder::Solid(solid) => {
                let (to, l) = solid.seen_from(simd, p, l);
                match solid.kind {
                    Canonical::Ball => Shadow::cone(simd, to, 1.0, &l),
                    _ => Shadow::Hull(Hull::new(solid, to, &l)),
                }
            }
        }
    }

    /// Of a sphere, `s` the vector to its middle. Not inlined: one copy for each instruction set is enough.
    #[inline(never)]
    pub fn cone(simd: S, s: Vec3x16<S>, r: f32, l: &[Vec3x16<S>; 3]) -> Shadow<S> {
        simd.vectorize(
            #[inline(always)]
            || Shadow::cone_now(simd, s, r, l),
        )
    }

    #[inline(always)]
    fn cone_now(simd: S, s: Vec3x16<S>, r: f32, l: &[Vec3x16<S>; 3]) -> Shadow<S> {
        let r2 = r * r;
        let cross = [l[0].cross(s), l[1].cross(s), l[2].cross(s)];
        let ll = Quadratic16::dot(*l, *l);
        let ahead = Linear16 { c: s.dot(l[0]), x: s.dot(l[1]), y: s.dot(l[2]) };
        // r^2 |l|^2 - |l x s|^2 is (r^2 - |s|^2) |l|^2 + (l.s)^2, which is small by itself where the point is close
        let power = simd.splat_f32x16(r2) - s.dot(s);
        let squared = Quadratic16::square(&ahead);
        let (one, minus) = (simd.splat_f32x16(1.0), simd.splat_f32x16(-1.0));
        let near = ll.combined(power, squared, one);
        let far = ll.combined(simd.splat_f32x16(r2), Quadratic16::dot(cross, cross), minus);
        let quadratic = Quadratic16::select(power.abs().simd_lt(0.5 * r2), near, far);
        // r^2 - |l - s|^2
        let from_center = [l[0] - s, l[1], l[2]];
        let inside = Quadratic16::dot(from_center, from_center);
        let inside = Quadratic16 {
            c: simd.splat_f32x16(r2) - inside.c,
            x: -inside.x,
            y: -inside.y,
            xx: -inside.xx,
            xy: -inside.xy,
            yy: -inside.yy,
        };
        // How far the middle is from the light's plane
        let n = l[1].cross(l[2]);
        let off = n.dot(from_center[0]);
        let cuts = (off * off).simd_lt(n.dot(n) * r2);
        // What is all beyond that plane hides nothing
        let is_beyond = (off * n.dot(l[0])).simd_lt(0.0) & !cuts;
        let quadratic = Quadratic16::select(is_beyond, Quadratic16::below_0(simd), quadratic);
        let cut = if cuts.any_true() {
            let zero = simd.splat_f32x16(0.0);
            let ls = Quadratic16 { c: ahead.c, x: ahead.x * 0.5, y: ahead.y * 0.5, xx: zero, xy: zero, yy: zero };
            Some(([ll.combined(one, ls, minus), inside], cuts))
        } else {
            None
        };
        Shadow::Cone { quadratic, ahead, cut, inside }
    }

    /// The hidden intervals of sixteen rows, for points outside: one, or two around a hole.
    #[inline(always)]
    pub fn hidden(&self, simd: S, y: f32x16<S>) -> [Interval16<S>; 2] {
        match self {
            Shadow::Hull(hull) => hull.hidden(simd, y),
            Shadow::Edges { .. } | Shadow::Cone { .. } => [self.interval(simd, y), Interval16::none(simd)],
        }
    }

    /// Whether rows may have two hidden intervals.
    pub fn has_hole(&self) -> bool {
        match self {
            Shadow::Hull(hull) => hull.has_hole(),
            Shadow::Cone { .. } | Shadow::Edges { .. } => false,
        }
    }

    /// The interval of sixteen rows that a convex occluder hides.
    #[inline(always)]
    fn interval(&self, simd: S, y: f32x16<S>) -> Interval16<S> {
        match self {
            Shadow::Hull(hull) => hull.hidden(simd, y)[0],
            Shadow::Edges { lines } => {
                let mut interval = Interval16::all(simd);
                for line in lines {
                    interval.clip(y * line.y + line.c, line.x);
                }
                interval
            }
            Shadow::Cone { quadratic, ahead, cut, .. } => {
                let far = simd.splat_f32x16(FAR);
                let interval = quadratic.cone_on_row(simd, ahead, y);
                let Some(([before, inside], cuts)) = cut else { return interval };
                // Without what is behind the light, and with what is inside the sphere: together they are convex again
                let b = before.on_row(y);
                let any = b.any & *cuts;
                let from =
                    (any & interval.from.simd_gt(b.low) & interval.from.simd_lt(b.high)).select(b.high, interval.from);
                let to = (any & interval.to.simd_gt(b.low) & interval.to.simd_lt(b.high)).select(b.low, interval.to);
                let is_left = from.simd_lt(to);
                let i = inside.on_row(y);
                let any = i.any & *cuts;
                let (i0, i1) = (any.select(i.low, far), any.select(i.high, -far));
                Interval16 { from: is_left.select(from, far).min(i0), to: is_left.select(to, -far).max(i1) }
            }
        }
    }

    /// The visible interval of sixteen rows, for points within a sphere.
    #[inline(always)]
    pub fn within(&self, simd: S, y: f32x16<S>) -> Interval16<S> {
        let far = simd.splat_f32x16(FAR);
        match self {
            Shadow::Edges { .. } | Shadow::Hull(_) => Interval16::all(simd),
            Shadow::Cone { inside, .. } => {
                let i = inside.on_row(y);
                Interval16 { from: i.any.select(i.low, far), to: i.any.select(i.high, -far) }
            }
        }
    }

    /// Whether a place of the light is hidden, for points outside.
    #[inline(always)]
    pub fn hides(&self, x: f32x16<S>, y: f32x16<S>) -> mask32x16<S> {
        let zero = x.token().splat_f32x16(0.0);
        match self {
            Shadow::Edges { lines } => {
                let mut all = x.simd_eq(x);
                for line in lines {
                    all &= line.at(x, y).simd_ge(zero);
                }
                all
            }
            Shadow::Hull(hull) => hull.hides(x, y),
            Shadow::Cone { quadratic, ahead, cut, .. } => {
                let on_line = quadratic.at(x, y).simd_ge(zero) & ahead.at(x, y).simd_gt(zero);
                match cut {
                    None => on_line,
                    Some(([before, inside], cuts)) => {
                        on_line & (before.at(x, y).simd_gt(zero) | !*cuts) | inside.at(x, y).simd_ge(zero) & *cuts
                    }
                }
            }
        }
    }

    /// The quadratic of a disk light, with coordinates counted from `origin`: x^2 + y^2 <= 1.
    #[inline(always)]
    pub fn rim(origin: [f32x16<S>; 2]) -> Quadratic16<S> {
        let [x, y] = origin;
        let simd = x.token();
        let (zero, minus) = (simd.splat_f32x16(0.0), simd.splat_f32x16(-1.0));
        Quadratic16 { c: simd.splat_f32x16(1.0) - (x * x + y * y), x: -x, y: -y, xx: minus, xy: zero, yy: minus }
    }

    /// Whether a place of the light is inside of a sphere; false for other occluders.
    #[inline(always)]
    pub fn holds(&self, x: f32x16<S>, y: f32x16<S>) -> mask32x16<S> {
        let zero = x.token().splat_f32x16(0.0);
        match self {
            Shadow::Edges { .. } | Shadow::Hull(_) => x.simd_lt(x),
            Shadow::Cone { inside, .. } => inside.at(x, y).simd_gt(zero),
        }
    }

    /// Adds the rows at which the projection begins, ends, has a corner or meets the sides of a cell, and possibly
    /// others.
    #[inline(always)]
    pub fn breaks(&self, breaks: &mut Breaks<S>) {
        match self {
            Shadow::Cone { quadratic, cut, .. } => {
                breaks.quadratic(quadratic, breaks.of);
                if let Some(([before, inside], cuts)) = cut {
                    breaks.quadratic(before, *cuts);
                    breaks.quadratic(inside, *cuts);
                }
            }
            Shadow::Edges { lines } => breaks.polygon(lines),
            Shadow::Hull(hull) => hull.breaks(breaks),
        }
    }
}
