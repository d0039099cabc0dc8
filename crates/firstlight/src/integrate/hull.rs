//! Solids projected onto a light, for sixteen points at once.
//!
//! Each solid is projected in its own space, in which it is a unit box, ball, disk or a frustum about z: an affine
//! map keeps lines. The silhouette of a solid is the hull of a few flat parts: three faces of a box; both ends of a
//! frustum and the quadrilateral between the lines in which tangent planes through the point touch its mantle. A
//! ring hides the inside of its rim less its hole; a tube hides its hull less the intersection of both ends.

use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::batch::{Exact, Linear16};
use super::breaks::Breaks;
use super::row::{FAR, Interval16, Quadratic16, edges};
use crate::math::{DAffine3, DVec3, Vec3, Vec3x16};
use crate::shape::Canonical;

/// A solid occluder.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SolidOccluder {
    /// The origin of its own space in the world, and the rows of the matrix from the world to it.
    center: Exact,
    rows: [Vec3; 3],
    pub kind: Canonical,
    /// Whether a part of the light may be inside.
    may_contain_light: bool,
}

impl SolidOccluder {
    pub fn new(world_from_canonical: &DAffine3, kind: Canonical, may_contain_light: bool) -> SolidOccluder {
        let inverse = world_from_canonical.matrix3.inverse().transpose();
        let rows = [inverse.x_axis, inverse.y_axis, inverse.z_axis].map(|row: DVec3| row.as_vec3());
        SolidOccluder { center: Exact::new(world_from_canonical.translation), rows, kind, may_contain_light }
    }

    #[inline(always)]
    fn local<S: Simd>(&self, simd: S, v: Vec3x16<S>) -> Vec3x16<S> {
        let [x, y, z] = &self.rows;
        Vec3x16 {
            x: Vec3x16::splat(simd, *x).dot(v),
            y: Vec3x16::splat(simd, *y).dot(v),
            z: Vec3x16::splat(simd, *z).dot(v),
        }
    }

    /// The vectors from `p` to the solid's middle and to the light, in the solid's own space.
    #[inline(always)]
    pub fn seen_from<S: Simd>(&self, simd: S, p: Vec3x16<S>, l: &[Vec3x16<S>; 3]) -> (Vec3x16<S>, [Vec3x16<S>; 3]) {
        let to = self.local(simd, self.center.seen_from(simd, p));
        (to, [self.local(simd, l[0]), self.local(simd, l[1]), self.local(simd, l[2])])
    }
}

/// A disk projected from sixteen points: inside of its cone, and behind its plane.
#[derive(Clone, Copy)]
pub(crate) struct Rim<S: Simd> {
    pub quadratic: Quadratic16<S>,
    pub ahead: Linear16<S>,
    plane: Linear16<S>,
}

impl<S: Simd> Rim<S> {
    /// Of a disk across z of radius `r` with its middle at `to`.
    #[inline(always)]
    fn new(to: Vec3x16<S>, r: f32, l: &[Vec3x16<S>; 3]) -> Rim<S> {
        let simd = to.x.token();
        let zero = simd.splat_f32x16(0.0);
        let sign = to.z.simd_lt(zero).select(simd.splat_f32x16(-1.0), simd.splat_f32x16(1.0));
        // Where the plane is met, the way from the disk's middle is l D / l.z - to: all times l.z
        let ahead = Linear16 { c: l[0].z * sign, x: l[1].z * sign, y: l[2].z * sign };
        let mut across = [ahead; 2];
        for (axis, line) in across.iter_mut().enumerate() {
            let of = |v: &Vec3x16<S>| if axis == 0 { v.x } else { v.y };
            let side = of(&to);
            line.c = of(&l[0]) * to.z - l[0].z * side;
            line.x = of(&l[1]) * to.z - l[1].z * side;
            line.y = of(&l[2]) * to.z - l[2].z * side;
        }
        let one = simd.splat_f32x16(1.0);
        let quadratic = Quadratic16::square(&ahead)
            .combined(simd.splat_f32x16(r * r), Quadratic16::square(&across[0]), -one)
            .combined(one, Quadratic16::square(&across[1]), -one);
        // Seen edge on it hides nothing, and its quadratic is 0 along rows that are parallel to it
        let is_edge = to.z.abs().simd_le((to.x.abs() + to.y.abs() + r) * 1e-6);
        let plane = Linear16 {
            c: is_edge.select(simd.splat_f32x16(-FAR), ahead.c - to.z.abs()),
            x: is_edge.select(zero, ahead.x),
            y: is_edge.select(zero, ahead.y),
        };
        Rim { quadratic, ahead, plane }
    }

    #[inline(always)]
    fn hidden(&self, simd: S, y: f32x16<S>) -> Interval16<S> {
        let mut interval = self.quadratic.cone_on_row(simd, &self.ahead, y);
        interval.clip(y * self.plane.y + self.plane.c, self.plane.x);
        interval
    }

    #[inline(always)]
    fn hides(&self, x: f32x16<S>, y: f32x16<S>) -> mask32x16<S> {
        let zero = x.token().splat_f32x16(0.0);
        self.quadratic.at(x, y).simd_ge(zero) & self.plane.at(x, y).simd_ge(zero)
    }
}

/// The most faces and rims of a silhouette.
const FACES: usize = 3;
const RIMS: usize = 2;

/// The silhouette of a solid, from sixteen points outside.
#[derive(Clone, Copy)]
pub(crate) struct Hull<S: Simd> {
    pub faces: [[Linear16<S>; 5]; FACES],
    pub rims: [Rim<S>; RIMS],
    count: [usize; 2],
    hole: Hole,
    inside: Option<Inside<S>>,
}

/// The intersection of a light's plane with a solid.
#[derive(Clone, Copy)]
struct Inside<S: Simd> {
    /// 0 or more inside.
    lines: [Linear16<S>; 6],
    /// The quadratic of the mantle, and the linear function that is positive before the apex.
    mantle: Option<(Quadratic16<S>, Linear16<S>)>,
}

impl<S: Simd> Inside<S> {
    #[inline(always)]
    fn new(kind: Canonical, to: Vec3x16<S>, l: &[Vec3x16<S>; 3]) -> Option<Inside<S>> {
        let simd = to.x.token();
        let nothing = Linear16 { c: simd.splat_f32x16(0.0), x: simd.splat_f32x16(0.0), y: simd.splat_f32x16(0.0) };
        let [x, y, z] = [
            Linear16 { c: l[0].x - to.x, x: l[1].x, y: l[2].x },
            Linear16 { c: l[0].y - to.y, x: l[1].y, y: l[2].y },
            Linear16 { c: l[0].z - to.z, x: l[1].z, y: l[2].z },
        ];
        let mut lines = [nothing; 6];
        match kind {
            Canonical::Box => {
                for (axis, w) in [x, y, z].iter().enumerate() {
                    lines[2 * axis] = w.times(1.0, 1.0);
                    lines[2 * axis + 1] = w.times(-1.0, 1.0);
                }
                Some(Inside { lines, mantle: None })
            }
            Canonical::Frustum { radii: [first, last], open: false } => {
                (lines[0], lines[1]) = (z, z.times(-1.0, 1.0));
                let wide = z.times(last - first, first);
                let one = simd.splat_f32x16(1.0);
                let mantle = Quadratic16::square(&wide).combined(one, Quadratic16::square(&x), -one).combined(
                    one,
                    Quadratic16::square(&y),
                    -one,
                );
                Some(Inside { lines, mantle: Some((mantle, wide)) })
            }
            Canonical::Frustum { .. } | Canonical::Plane | Canonical::Disk { .. } | Canonical::Ball => None,
        }
    }

    #[inline(always)]
    fn on_row(&self, simd: S, y: f32x16<S>) -> Interval16<S> {
        let mut interval = match &self.mantle {
            None => Interval16::all(simd),
            Some((quadratic, wide)) => quadratic.cone_on_row(simd, wide, y),
        };
        for line in &self.lines {
            interval.clip(y * line.y + line.c, line.x);
        }
        interval
    }

    #[inline(always)]
    fn holds(&self, x: f32x16<S>, y: f32x16<S>) -> mask32x16<S> {
        let zero = x.token().splat_f32x16(0.0);
        let mut all = x.simd_eq(x);
        for line in &self.lines {
            all &= line.at(x, y).simd_ge(zero);
        }
        if let Some((quadratic, wide)) = &self.mantle {
            all &= quadratic.at(x, y).simd_ge(zero) & wide.at(x, y).simd_ge(zero);
        }
        all
    }
}

/// The part of a hull that does not hide.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Hole {
    None,
    /// Inside of the second rim, which is not part of the hull.
    Ring,
    /// Inside of both rims.
    Tube,
}

impl<S: Simd> Hull<S> {
    /// `to`: the vector to the middle in the solid's space, `l`: those of the light. Not of a ball. Not inlined: one
    /// copy for each instruction set is enough.
    #[inline(never)]
    pub fn new(solid: &SolidOccluder, to: Vec3x16<S>, l: &[Vec3x16<S>; 3]) -> Hull<S> {
        to.x.token().vectorize(
            #[inline(always)]
            || Hull::new_now(solid, to, l),
        )
    }

    #[inline(always)]
    fn new_now(solid: &SolidOccluder, to: Vec3x16<S>, l: &[Vec3x16<S>; 3]) -> Hull<S> {
        let simd = to.x.token();
        let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
        let nothing = Linear16 { c: zero, x: zero, y: zero };
        let empty = Rim { quadratic: Quadratic16::square(&nothing), ahead: nothing, plane: nothing };
        let mut hull =
            Hull { faces: [[nothing; 5]; FACES], rims: [empty; RIMS], count: [0; 2], hole: Hole::None, inside: None };
        if solid.may_contain_light {
            hull.inside = Inside::new(solid.kind, to, l);
        }
        match solid.kind {
            Canonical::Plane => {
                let sign = to.z.simd_lt(zero).select(-one, one);
                hull.faces[0][0] = Linear16 { c: l[0].z * sign - to.z.abs(), x: l[1].z * sign, y: l[2].z * sign };
                hull.count = [1, 0];
            }
            Canonical::Disk { hole } => {
                hull.rims[0] = Rim::new(to, 1.0, l);
                hull.count = [0, 1];
                if hole > 0.0 {
                    hull.rims[1] = Rim::new(to, hole, l);
                    hull.hole = Hole::Ring;
                }
            }
            Canonical::Box => {
                // On each axis the face on the point's side; where it is beside both, either
                let s = Vec3x16 {
                    x: to.x.simd_gt(zero).select(-one, one),
                    y: to.y.simd_gt(zero).select(-one, one),
                    z: to.z.simd_gt(zero).select(-one, one),
                };
                let at = |x: f32x16<S>, y: f32x16<S>, z: f32x16<S>| Vec3x16 { x: to.x + x, y: to.y + y, z: to.z + z };
                let x = [at(s.x, -one, -one), at(s.x, one, -one), at(s.x, one, one), at(s.x, -one, one)];
                let y = [at(-one, s.y, -one), at(one, s.y, -one), at(one, s.y, one), at(-one, s.y, one)];
                let z = [at(-one, -one, s.z), at(one, -one, s.z), at(one, one, s.z), at(-one, one, s.z)];
                hull.faces = [edges(x, l), edges(y, l), edges(z, l)];
                hull.count = [3, 0];
            }
            Canonical::Frustum { radii: [first, last], open } => {
                hull.hole = if open { Hole::Tube } else { Hole::None };
                let top = Vec3x16 { z: to.z + one, ..to };
                hull.rims = [Rim::new(to, first, l), Rim::new(top, last, l)];
                hull.count = [1, 2];
                // Across the axis, in a frame that leads to the point: planes through it touch the mantle where it is
                // as far out as the mantle is wide at its height
                let wide = to.z * (first - last) + first;
                let distance2 = to.x * to.x + to.y * to.y;
                let touches = distance2.simd_gt(wide * wide);
                let inverse = 1.0 / touches.select(distance2, one).sqrt();
                let cos = touches.select(wide * inverse, zero);
                let sin = (1.0 - cos * cos).max(zero).sqrt();
                let (ux, uy) = (-to.x * inverse, -to.y * inverse);
                let out = [(ux * cos - uy * sin, uy * cos + ux * sin), (ux * cos + uy * sin, uy * cos - ux * sin)];
                let on = |(x, y): (f32x16<S>, f32x16<S>), r: f32, z: f32x16<S>| Vec3x16 {
                    x: to.x + x * r,
                    y: to.y + y * r,
                    z: to.z + z,
                };
                let corners =
                    [on(out[0], first, zero), on(out[1], first, zero), on(out[1], last, one), on(out[0], last, one)];
                hull.faces[0] = edges(corners, l);
                // No such planes: only an end is seen
                hull.faces[0][0].c = touches.select(hull.faces[0][0].c, simd.splat_f32x16(-FAR));
            }
            Canonical::Ball => unreachable!("it has a shadow of its own"),
        }
        hull
    }

    /// The hidden intervals of sixteen rows: before a hole, and after it.
    #[inline(never)]
    pub fn hidden(&self, simd: S, y: f32x16<S>) -> [Interval16<S>; 2] {
        simd.vectorize(
            #[inline(always)]
            || self.hidden_now(simd, y),
        )
    }

    #[inline(always)]
    fn hidden_now(&self, simd: S, y: f32x16<S>) -> [Interval16<S>; 2] {
        let far = simd.splat_f32x16(FAR);
        let mut all = Interval16::none(simd);
        for face in &self.faces[..self.count[0]] {
            let mut interval = Interval16::all(simd);
            for line in face {
                interval.clip(y * line.y + line.c, line.x);
            }
            all.join(&interval);
        }
        for rim in &self.rims[..self.count[1]] {
            all.join(&rim.hidden(simd, y));
        }
        if let Some(inside) = &self.inside {
            // With what is inside, what is hidden is convex as well
            all.join(&inside.on_row(simd, y));
        }
        let none = Interval16::none(simd);
        let mut hole = match self.hole {
            Hole::None => return [all, none],
            Hole::Ring => Interval16::all(simd),
            Hole::Tube => self.rims[0].hidden(simd, y),
        };
        let other = self.rims[1].hidden(simd, y);
        (hole.from, hole.to) = (hole.from.max(other.from), hole.to.min(other.to));
        let is_there = hole.from.simd_lt(hole.to);
        let before = Interval16 { from: all.from, to: is_there.select(all.to.min(hole.from), all.to) };
        [before, Interval16 { from: is_there.select(all.from.max(hole.to), far), to: all.to }]
    }

    pub fn has_hole(&self) -> bool {
        self.hole != Hole::None
    }

    /// Whether a place of the light is hidden.
    #[inline(never)]
    pub fn hides(&self, x: f32x16<S>, y: f32x16<S>) -> mask32x16<S> {
        x.token().vectorize(
            #[inline(always)]
            || self.hides_now(x, y),
        )
    }

    #[inline(always)]
    fn hides_now(&self, x: f32x16<S>, y: f32x16<S>) -> mask32x16<S> {
        let zero = x.token().splat_f32x16(0.0);
        let mut any = x.simd_lt(x);
        for face in &self.faces[..self.count[0]] {
            let mut all = x.simd_eq(x);
            for line in face {
                all &= line.at(x, y).simd_ge(zero);
            }
            any |= all;
        }
        for rim in &self.rims[..self.count[1]] {
            any |= rim.hides(x, y);
        }
        if let Some(inside) = &self.inside {
            any |= inside.holds(x, y);
        }
        match self.hole {
            Hole::None => any,
            Hole::Ring => any & !self.rims[1].hides(x, y),
            Hole::Tube => any & !(self.rims[0].hides(x, y) & self.rims[1].hides(x, y)),
        }
    }

    /// See [`Shadow::breaks`](super::occluder::Shadow::breaks).
    #[inline(never)]
    pub fn breaks(&self, breaks: &mut Breaks<S>) {
        breaks.of.token().vectorize(
            #[inline(always)]
            || self.breaks_now(breaks),
        );
    }

    #[inline(always)]
    fn breaks_now(&self, breaks: &mut Breaks<S>) {
        for face in &self.faces[..self.count[0]] {
            breaks.polygon(face);
        }
        let rims = if self.hole == Hole::None { self.count[1] } else { RIMS };
        for rim in &self.rims[..rims] {
            breaks.quadratic(&rim.quadratic, breaks.of);
            breaks.line(&rim.plane);
        }
        if let Some(inside) = &self.inside {
            for line in &inside.lines {
                breaks.line(line);
            }
            if let Some((quadratic, _)) = &inside.mantle {
                breaks.quadratic(quadratic, breaks.of);
            }
        }
    }
}
