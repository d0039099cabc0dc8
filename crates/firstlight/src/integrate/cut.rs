//! Things that reach into a light that is a ball, for sixteen points at once.
//!
//! The disk that stands for a ball has its directions, but not its depth: what is behind a thing has to be asked of the
//! ball's own surface, the near half of it or the far one. On a row, a plane cuts it in two places at most, where it
//! meets the circle in which plane and ball meet; so does the surface of another ball, in the circle of both. Between
//! them nothing changes. Where what is round meets it in no circle, those places are looked for.

use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::batch::{Exact, Linear16};
use super::breaks::Breaks;
use super::hull::{Hull, Rim};
use super::occluder::{Occluder, corners_from};
use super::row::{FAR, Interval16, Quadratic16, Roots, edges, root_between, roots};
use crate::math::Vec3x16;
use crate::shape::Canonical;

/// The most intervals that one thing hides of a row.
pub(crate) const MOST: usize = 2 * FACES;
const FACES: usize = 3;

/// A ball as sixteen points see it: the way to its middle, and the square of the way to where it is touched.
struct BallView<S: Simd> {
    middle: Vec3x16<S>,
    touch2: f32x16<S>,
    /// |l|^2, and the product of l with the way to the middle.
    length2: Quadratic16<S>,
    along: Linear16<S>,
}

impl<S: Simd> BallView<S> {
    #[inline(always)]
    fn new(middle: Vec3x16<S>, r: f32x16<S>, l: &[Vec3x16<S>; 3]) -> BallView<S> {
        let distance2 = middle.dot(middle);
        let distance = distance2.sqrt();
        BallView {
            middle,
            touch2: (distance - r) * (distance + r),
            length2: Quadratic16::dot(*l, *l),
            along: Linear16::along(middle, l),
        }
    }

    /// How many times l leads to where a ray enters it, or to where it leaves it.
    #[inline(always)]
    fn meets(&self, half: Half, x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
        let (length2, along) = (self.length2.at(x, y), self.along.at(x, y));
        let half2 = along * along - length2 * self.touch2;
        let root = half2.max(x.token().splat_f32x16(0.0)).sqrt();
        match half {
            Half::Near => self.touch2 / (along + root),
            Half::Far => (along + root) / length2,
            // Nothing cancels
            Half::Around => along.simd_lt(0.0).select(-self.touch2 / (root - along), (along + root) / length2),
        }
    }

    /// Where l meets it: (l.s)^2 - |l|^2 (|s|^2 - r^2) >= 0.
    #[inline(always)]
    fn cone(&self) -> Quadratic16<S> {
        let one = self.touch2.token().splat_f32x16(1.0);
        Quadratic16::square(&self.along).combined(one, self.length2, -self.touch2)
    }

    /// Where l leads to the circle in which a plane, `plane` = `height` on it, meets the ball.
    #[inline(always)]
    fn circle(&self, plane: &Linear16<S>, height: f32x16<S>) -> Quadratic16<S> {
        let simd = height.token();
        let one = simd.splat_f32x16(1.0);
        let product = Quadratic16::product(plane, &self.along);
        self.length2.combined(height * height, product, height * -2.0).combined(
            one,
            Quadratic16::square(plane),
            self.touch2,
        )
    }

    /// The places of that circle on a row, counted from where the row is nearest to the plane's own trace: both lie
    /// close to it where a point is close to the plane, and all that differs is lost in numbers that are counted from
    /// elsewhere.
    #[inline(always)]
    fn circle_on_row(&self, plane: &Linear16<S>, height: f32x16<S>, y: f32x16<S>) -> Roots<S> {
        let simd = height.token();
        let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
        let is_level = plane.x.abs().simd_lt(f32::MIN_POSITIVE);
        let trace = -(y * plane.y + plane.c) / is_level.select(one, plane.x);
        let x = is_level.select(zero, trace.max(-one).min(one));
        let (plane_at, along_at) = (plane.at(x, y), self.along.at(x, y));
        let (length2, t) = (&self.length2, self.touch2);
        let slope = length2.x + y * length2.xy + x * length2.xx;
        let (h2, xt) = (height * height, plane.x * t);
        let Roots { low, high, any } = roots(
            h2 * length2.xx - height * plane.x * self.along.x * 2.0 + plane.x * xt,
            h2 * slope - height * (plane.x * along_at + plane_at * self.along.x) + plane_at * xt,
            h2 * length2.at(x, y) - height * plane_at * along_at * 2.0 + plane_at * plane_at * t,
        );
        Roots { low: low + x, high: high + x, any }
    }
}

/// Which half of a ball, as a point sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Half {
    Near,
    Far,
    /// All of it: the point is inside.
    Around,
}

/// Where on the rows of a ball something changes: at both places of a circle that are on one half of it.
struct HalfCircle<S: Simd> {
    plane: Linear16<S>,
    height: f32x16<S>,
    circle: Quadratic16<S>,
}

impl<S: Simd> HalfCircle<S> {
    #[inline(always)]
    fn new(ball: &BallView<S>, plane: Linear16<S>, height: f32x16<S>) -> HalfCircle<S> {
        HalfCircle { plane, height, circle: ball.circle(&plane, height) }
    }

    /// The parts of a range of each row that are hidden: between the places of the circle all is hidden or nothing is,
    /// as `hides` says of the middle. So what rounding makes of a place near an end changes no more than what lies
    /// between them.
    #[inline(always)]
    fn parts(
        &self,
        simd: S,
        ball: &BallView<S>,
        y: f32x16<S>,
        range: &Interval16<S>,
        hides: impl Fn(f32x16<S>) -> mask32x16<S>,
    ) -> [Interval16<S>; 2] {
        let Interval16 { from, to } = *range;
        let far = simd.splat_f32x16(FAR);
        let Roots { low, high, any } = ball.circle_on_row(&self.plane, self.height, y);
        let [low, high] = [low, high].map(|root| any.select(root.max(from).min(to), from));
        let first = hides((from + low) * 0.5);
        let middle = hides((low + high) * 0.5);
        let last = hides((high + to) * 0.5);
        let one = Interval16 {
            from: first.select(from, middle.select(low, last.select(high, far))),
            to: (first & !middle).select(low, (middle & !last).select(high, to)),
        };
        let other = Interval16 { from: (first & !middle & last).select(high, far), to };
        [one, other]
    }
}

/// A thing that reaches into a ball, as sixteen points see both.
pub(crate) struct BallCut<S: Simd> {
    ball: BallView<S>,
    half: Half,
    shape: CutShape<S>,
}

/// The lines of a flat thing, and where its plane cuts the ball; or nothing.
type FlatLines<S> = ([Linear16<S>; 5], Option<HalfCircle<S>>);

enum CutShape<S: Simd> {
    /// What is inside of the sides of flat things, behind their planes.
    Flat {
        faces: [FlatLines<S>; FACES],
    },
    /// A disk; what is inside of its hole, if it has one, is not hidden.
    Rim {
        rim: Rim<S>,
        hole: Option<Rim<S>>,
        arc: HalfCircle<S>,
    },
    Sphere {
        other: BallView<S>,
        cone: Quadratic16<S>,
        arc: HalfCircle<S>,
    },
    /// What is round otherwise.
    Round {
        entry: Entrance<S>,
    },
}

/// Where ways to a light enter something convex, in a space of its own.
enum Entrance<S: Simd> {
    Ball {
        ball: BallView<S>,
        cone: Quadratic16<S>,
    },
    Frustum {
        hull: Hull<S>,
        radii: [f32; 2],
        /// From its origin to the points, and the light's ways.
        from: Vec3x16<S>,
        l: [Vec3x16<S>; 3],
    },
}

/// Places of a row at which it is asked whether what is round is entered before the light is met: from one end of what
/// it fills to the other, closer at the ends.
const PLACES: usize = 13;
const ALONG: [f32; PLACES] = [-1.0, -0.985, -0.94, -0.866, -0.707, -0.5, 0.0, 0.5, 0.707, 0.866, 0.94, 0.985, 1.0];

impl<S: Simd> Entrance<S> {
    /// From where to where a row goes through it.
    #[inline(always)]
    fn on_row(&self, simd: S, y: f32x16<S>) -> Interval16<S> {
        match self {
            Entrance::Ball { ball, cone } => cone.cone_on_row(simd, &ball.along, y),
            Entrance::Frustum { hull, .. } => {
                let mut band = Interval16::all(simd);
                for line in &hull.faces[0][1..] {
                    band.clip(y * line.y + line.c, line.x);
                }
                // Nothing where no planes touch the mantle
                let touches = hull.faces[0][0].c.simd_gt(-FAR);
                band.to = touches.select(band.to, simd.splat_f32x16(-FAR));
                let mut all = Interval16::none(simd);
                all.join(&band);
                for rim in &hull.rims {
                    all.join(&rim.quadratic.cone_on_row(simd, &rim.ahead, y));
                }
                all
            }
        }
    }

    /// How many times l leads to where it is entered.
    #[inline(always)]
    fn enters(&self, x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
        match self {
            Entrance::Ball { ball, .. } => ball.meets(Half::Near, x, y),
            Entrance::Frustum { radii: [first, last], from: o, l, .. } => {
                let simd = x.token();
                let (zero, one, far) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0), simd.splat_f32x16(FAR));
                let d: Vec3x16<S> = l[0] + (l[1] * x + l[2] * y);
                // The end that is met first
                let flat = d.z.simd_eq(zero);
                let inverse = one / flat.select(one, d.z);
                let end = flat.select(-far, (-o.z * inverse).min((one - o.z) * inverse));
                let wider = last - first;
                let (wide, grows) = (o.z * wider + *first, d.z * wider);
                let a = d.x * d.x + d.y * d.y - grows * grows;
                let b = o.x * d.x + o.y * d.y - wide * grows;
                let c = o.x * o.x + o.y * o.y - wide * wide;
                let root = (b * b - a * c).max(zero).sqrt();
                // From outside of the mantle, of it, or of what it is beyond its apex
                let beyond = wide.simd_lt(zero).select(-(b + root) / a.min(-f32::MIN_POSITIVE), -far);
                end.max(c.simd_gt(zero).select(c / (root - b), beyond))
            }
        }
    }
}

/// Puts intervals into the first of some that are empty, in those lanes.
#[inline(always)]
fn put<S: Simd>(parts: &mut [Interval16<S>; MOST], of: mask32x16<S>, interval: Interval16<S>) {
    let mut of = of;
    for part in parts {
        let is_free = of & part.from.simd_ge(FAR);
        part.from = is_free.select(interval.from, part.from);
        part.to = is_free.select(interval.to, part.to);
        of &= !is_free;
    }
}

/// How many intervals of a row `occluder` may hide of a ball that it reaches into.
pub(crate) fn parts(occluder: &Occluder) -> usize {
    match occluder {
        Occluder::Sphere { .. } | Occluder::Flat { .. } => 2,
        Occluder::Solid(solid) => match solid.kind {
            Canonical::Plane => 2,
            Canonical::Disk { hole: 0.0 } => 2,
            _ => MOST,
        },
    }
}

/// Whether rows tell what `occluder` hides of a ball that it reaches into.
pub(crate) fn knows(occluder: &Occluder) -> bool {
    match occluder {
        Occluder::Sphere { .. } | Occluder::Flat { .. } => true,
        Occluder::Solid(solid) => match solid.kind {
            Canonical::Plane | Canonical::Box | Canonical::Disk { .. } | Canonical::Ball => true,
            Canonical::Frustum { open, .. } => !open,
            Canonical::Torus { .. } => false,
        },
    }
}

impl<S: Simd> BallCut<S> {
    /// `None` if that is not known. Not inlined, as what it is asked is not: one copy of each for each instruction set
    /// is enough.
    #[inline(never)]
    pub fn new(
        simd: S,
        occluder: &Occluder,
        ball: (Exact, f32, Half),
        p: Vec3x16<S>,
        l: &[Vec3x16<S>; 3],
    ) -> Option<BallCut<S>> {
        simd.vectorize(
            #[inline(always)]
            || BallCut::new_now(simd, occluder, ball, p, l),
        )
    }

    #[inline(always)]
    fn new_now(
        simd: S,
        occluder: &Occluder,
        (center, radius, half): (Exact, f32, Half),
        p: Vec3x16<S>,
        l: &[Vec3x16<S>; 3],
    ) -> Option<BallCut<S>> {
        let (zero, one) = (simd.splat_f32x16(0.0), simd.splat_f32x16(1.0));
        // Where the light is counts, not how far off: powers of that would be too large
        let middle = center.seen_from(simd, p);
        let scale = one / middle.dot(middle).sqrt().max(simd.splat_f32x16(radius));
        let near = &[l[0] * scale, l[1] * scale, l[2] * scale];
        let ball = BallView::new(middle * scale, scale * radius, near);
        let face = |lines: [Linear16<S>; 5], height: f32x16<S>, length: f32x16<S>| {
            let inverse = one / length.max(simd.splat_f32x16(f32::MIN_POSITIVE));
            let Linear16 { c, x, y } = lines[0];
            let plane = Linear16 { c: (c + height) * inverse, x: x * inverse, y: y * inverse };
            (lines, Some(HalfCircle::new(&ball, plane, height * inverse)))
        };
        let nothing = [Linear16 { c: zero, x: zero, y: zero }; 5];
        let shape = match occluder {
            Occluder::Flat { corners } => {
                let mut q = corners_from(simd, corners, p);
                for q in &mut q {
                    *q = *q * scale;
                }
                let n = (q[1] - q[0]).cross(q[3] - q[0]);
                let face = face(edges(q, near), n.dot(q[0]).abs(), n.dot(n).sqrt());
                CutShape::Flat { faces: [face, (nothing, None), (nothing, None)] }
            }
            Occluder::Solid(solid) if solid.kind == Canonical::Ball => {
                let (to, local) = solid.seen_from(simd, p, l);
                let other = BallView::new(to, one, &local);
                let cone = other.cone();
                CutShape::Round { entry: Entrance::Ball { ball: other, cone } }
            }
            Occluder::Solid(solid) => {
                let (to, local) = solid.seen_from(simd, p, l);
                let hull = Hull::new(solid, to, &local);
                match solid.kind {
                    Canonical::Plane => {
                        let face = face(hull.faces[0], to.z.abs(), one);
                        CutShape::Flat { faces: [face, (nothing, None), (nothing, None)] }
                    }
                    Canonical::Box => {
                        let [x, y, z] = hull.faces;
                        // Four times as far as in its own space, by the length of its edges
                        let height = |w: f32x16<S>| ((w.abs() - one) * 4.0).abs();
                        CutShape::Flat {
                            faces: [face(x, height(to.x), one), face(y, height(to.y), one), face(z, height(to.z), one)],
                        }
                    }
                    Canonical::Disk { hole } => {
                        let [rim, inner] = hull.rims;
                        let arc = HalfCircle::new(&ball, rim.ahead, to.z.abs());
                        CutShape::Rim { rim, hole: (hole > 0.0).then_some(inner), arc }
                    }
                    Canonical::Frustum { radii, open: false } => CutShape::Round {
                        entry: Entrance::Frustum { hull, radii, from: to * simd.splat_f32x16(-1.0), l: local },
                    },
                    Canonical::Ball | Canonical::Frustum { .. } | Canonical::Torus { .. } => return None,
                }
            }
            Occluder::Sphere { center, radius } => {
                let other = BallView::new(center.seen_from(simd, p) * scale, scale * *radius, near);
                let cone = other.cone();
                let between = ball.middle - other.middle;
                let plane = Linear16::along(between, near);
                let arc = HalfCircle::new(&ball, plane, (ball.touch2 - other.touch2) * 0.5);
                CutShape::Sphere { other, cone, arc }
            }
        };
        Some(BallCut { ball, half, shape })
    }

    /// Hands over what is hidden of sixteen rows, of which `rim` is what is on the ball; from inside of a sphere, of
    /// those points that are `within`.
    #[inline(never)]
    pub fn hidden(&self, simd: S, y: f32x16<S>, rim: &Interval16<S>, within: mask32x16<S>) -> [Interval16<S>; MOST] {
        simd.vectorize(
            #[inline(always)]
            || self.hidden_now(simd, y, rim, within),
        )
    }

    #[inline(always)]
    fn hidden_now(&self, simd: S, y: f32x16<S>, rim: &Interval16<S>, within: mask32x16<S>) -> [Interval16<S>; MOST] {
        let mut all = [Interval16::none(simd); MOST];
        match &self.shape {
            CutShape::Flat { faces } => {
                for (k, (lines, arc)) in faces.iter().enumerate() {
                    let Some(arc) = arc else { break };
                    let parts = self.before(simd, arc, y, rim);
                    for (i, mut part) in parts.into_iter().enumerate() {
                        for line in &lines[1..] {
                            part.clip(y * line.y + line.c, line.x);
                        }
                        all[2 * k + i] = part;
                    }
                }
            }
            CutShape::Rim { rim: outer, hole, arc } => {
                let inside = outer.quadratic.cone_on_row(simd, &arc.plane, y);
                let parts = self.before(simd, arc, y, rim);
                for (i, part) in parts.into_iter().enumerate() {
                    all[i] = Interval16 { from: part.from.max(inside.from), to: part.to.min(inside.to) };
                }
                if let Some(hole) = hole {
                    let hole = hole.quadratic.cone_on_row(simd, &arc.plane, y);
                    let is_there = hole.from.simd_lt(hole.to);
                    let far = simd.splat_f32x16(FAR);
                    for i in 0..2 {
                        let Interval16 { from, to } = all[i];
                        all[i].to = is_there.select(to.min(hole.from), to);
                        all[i + 2] = Interval16 { from: is_there.select(from.max(hole.to), far), to };
                    }
                }
            }
            CutShape::Sphere { other, cone, arc } => {
                let inside = cone.cone_on_row(simd, &other.along, y);
                // From inside it hides what is beyond it
                let range = Interval16 {
                    from: within.select(rim.from, rim.from.max(inside.from)),
                    to: within.select(rim.to, rim.to.min(inside.to)),
                };
                let some_within = within.any_true();
                let parts = arc.parts(
                    simd,
                    &self.ball,
                    y,
                    &range,
                    #[inline(always)]
                    |x| {
                        let meets = self.ball.meets(self.half, x, y);
                        let outside = other.meets(Half::Near, x, y).simd_lt(meets);
                        if !some_within {
                            return outside;
                        }
                        within & other.meets(Half::Around, x, y).simd_lt(meets) | !within & outside
                    },
                );
                (all[0], all[1]) = (parts[0], parts[1]);
            }
            CutShape::Round { entry } => {
                let inside = entry.on_row(simd, y);
                let range = Interval16 { from: rim.from.max(inside.from), to: rim.to.min(inside.to) };
                self.look_for(simd, entry, y, &range, &mut all);
            }
        }
        all
    }

    /// Finds the parts of a range of each row on which something is entered before the ball is met.
    #[inline(always)]
    fn look_for(
        &self,
        simd: S,
        entry: &Entrance<S>,
        y: f32x16<S>,
        range: &Interval16<S>,
        parts: &mut [Interval16<S>; MOST],
    ) {
        let is_there = range.from.simd_lt(range.to);
        if !is_there.any_true() {
            return;
        }
        let (zero, far) = (simd.splat_f32x16(0.0), simd.splat_f32x16(FAR));
        let from = is_there.select(range.from, zero);
        let (middle, half) = ((from + range.to) * 0.5, (range.to - from) * 0.5);
        let mut before = self.later(entry, middle - half, y);
        let mut x_before = middle - half;
        let mut begun = (is_there & before.simd_lt(zero)).select(range.from, far);
        for along in &ALONG[1..] {
            let x = middle + half * *along;
            let here = self.later(entry, x, y);
            let changes = is_there & (here.simd_lt(zero) ^ before.simd_lt(zero));
            if changes.any_true() {
                let root = root_between(
                    [x_before, x],
                    [before, here],
                    #[inline(always)]
                    |x| self.later(entry, x, y),
                );
                let ends = changes & begun.simd_lt(far);
                put(parts, ends, Interval16 { from: begun, to: root });
                begun = ends.select(far, (changes & !ends).select(root, begun));
            }
            (before, x_before) = (here, x);
        }
        put(parts, begun.simd_lt(far), Interval16 { from: begun, to: range.to });
    }

    /// By how much later something is entered than the ball is met: below 0 where it hides.
    #[inline(always)]
    fn later(&self, entry: &Entrance<S>, x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
        entry.enters(x, y) - self.ball.meets(self.half, x, y)
    }

    /// The parts of a range of each row on which a plane is before the ball.
    #[inline(always)]
    fn before(&self, simd: S, arc: &HalfCircle<S>, y: f32x16<S>, range: &Interval16<S>) -> [Interval16<S>; 2] {
        arc.parts(
            simd,
            &self.ball,
            y,
            range,
            #[inline(always)]
            |x| self.is_before(arc, x, y),
        )
    }

    /// Whether a plane is before the ball at a place of a row.
    #[inline(always)]
    fn is_before(&self, arc: &HalfCircle<S>, x: f32x16<S>, y: f32x16<S>) -> mask32x16<S> {
        (arc.plane.at(x, y) * self.ball.meets(self.half, x, y)).simd_ge(arc.height)
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
        let of = breaks.of;
        match &self.shape {
            CutShape::Flat { faces } => {
                for (lines, arc) in faces {
                    if let Some(arc) = arc {
                        breaks.polygon(lines);
                        breaks.quadratic(&arc.circle, of);
                    }
                }
            }
            CutShape::Rim { rim, hole, arc } => {
                breaks.quadratic(&rim.quadratic, of);
                if let Some(hole) = hole {
                    breaks.quadratic(&hole.quadratic, of);
                }
                breaks.quadratic(&arc.circle, of);
            }
            CutShape::Sphere { cone, arc, .. } => {
                breaks.quadratic(cone, of);
                breaks.quadratic(&arc.circle, of);
            }
            CutShape::Round { entry: Entrance::Ball { cone, .. } } => breaks.quadratic(cone, of),
            CutShape::Round { entry: Entrance::Frustum { hull, .. } } => {
                breaks.polygon(&hull.faces[0]);
                for rim in &hull.rims {
                    breaks.quadratic(&rim.quadratic, of);
                }
            }
        }
    }
}
