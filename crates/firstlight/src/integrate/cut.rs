//! Things that reach into a light that is a ball, for sixteen points at once.
//!
//! The disk that stands for a ball has its directions, but not its depth: what is behind a thing has to be asked of the
//! ball's own surface, the near half of it or the far one. On a row, a plane cuts it in two places at most, where it
//! meets the circle in which plane and ball meet; so does the surface of another ball, in the circle of both. Between
//! them nothing changes.

use fearless_simd::{f32x16, mask32x16, prelude::*};

use super::batch::Linear16;
use super::hull::Hull;
use super::occluder::{Breaks, Exact, FAR, Interval16, Occluder, Quadratic16, Roots, corners_from, edges};
use crate::math::Vec3x16;
use crate::shape::Canonical;

/// The most intervals that one thing hides of a row.
pub(crate) const MOST: usize = 2 * FACES;
const FACES: usize = 3;

/// A ball as sixteen points see it: the way to its middle, and the square of the way to where it is touched.
struct Ball<S: Simd> {
    middle: Vec3x16<S>,
    touch2: f32x16<S>,
    /// |l|^2, and the product of l with the way to the middle.
    length2: Quadratic16<S>,
    along: Linear16<S>,
}

impl<S: Simd> Ball<S> {
    #[inline(always)]
    fn new(middle: Vec3x16<S>, r: f32, l: &[Vec3x16<S>; 3]) -> Ball<S> {
        let distance2 = middle.dot(middle);
        let distance = distance2.sqrt();
        Ball {
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

    /// Whether the way to the plane along l ends on that half.
    #[inline(always)]
    fn is_on(&self, half: Half, plane: &Linear16<S>, height: f32x16<S>, x: f32x16<S>, y: f32x16<S>) -> mask32x16<S> {
        let along = plane.at(x, y);
        let zero = x.token().splat_f32x16(0.0);
        let (way2, touch2) = (height * height * self.length2.at(x, y), self.touch2 * along * along);
        let is_on = match half {
            Half::Near => way2.simd_le(touch2),
            Half::Far | Half::Around => way2.simd_ge(touch2),
        };
        (height * along).simd_gt(zero) & is_on
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
struct Arc<S: Simd> {
    plane: Linear16<S>,
    height: f32x16<S>,
    circle: Quadratic16<S>,
}

impl<S: Simd> Arc<S> {
    #[inline(always)]
    fn new(ball: &Ball<S>, plane: Linear16<S>, height: f32x16<S>) -> Arc<S> {
        Arc { plane, height, circle: ball.circle(&plane, height) }
    }

    /// The parts of a range of each row that are hidden, where its beginning is (`begins`) or is not, and that changes
    /// at each place of the circle.
    #[inline(always)]
    fn parts(
        &self,
        simd: S,
        balls: &[(&Ball<S>, Half)],
        y: f32x16<S>,
        range: &Interval16<S>,
        begins: mask32x16<S>,
    ) -> [Interval16<S>; 2] {
        let far = simd.splat_f32x16(FAR);
        let Roots { low, high, any } = self.circle.on_row(y);
        let mut is_low = any & low.simd_gt(range.from) & low.simd_lt(range.to);
        let mut is_high = any & high.simd_gt(range.from) & high.simd_lt(range.to);
        for (ball, half) in balls {
            is_low &= ball.is_on(*half, &self.plane, self.height, low, y);
            is_high &= ball.is_on(*half, &self.plane, self.height, high, y);
        }
        // The first change, and the one after it
        let first = is_low.select(low, is_high.select(high, far));
        let second = (is_low & is_high).select(high, far);
        let one = Interval16 { from: begins.select(range.from, first), to: range.to.min(begins.select(first, second)) };
        let other = Interval16 { from: begins.select(second, far), to: range.to };
        [one, other]
    }
}

/// A thing that reaches into a ball, as sixteen points see both.
pub(crate) struct Cut<S: Simd> {
    ball: Ball<S>,
    half: Half,
    shape: CutShape<S>,
}

/// The lines of a flat thing, and where its plane cuts the ball; or nothing.
type Face<S> = ([Linear16<S>; 5], Option<Arc<S>>);

enum CutShape<S: Simd> {
    /// What is inside of the sides of flat things, behind their planes.
    Flat {
        faces: [Face<S>; FACES],
    },
    Rim {
        cone: Quadratic16<S>,
        arc: Arc<S>,
    },
    Sphere {
        other: Ball<S>,
        cone: Quadratic16<S>,
        arc: Arc<S>,
    },
}

/// Whether rows tell what `occluder` hides of a ball that it reaches into.
pub(crate) fn knows(occluder: &Occluder) -> bool {
    match occluder {
        Occluder::Sphere { .. } | Occluder::Flat { .. } => true,
        Occluder::Solid(solid) => match solid.kind {
            Canonical::Plane | Canonical::Box => true,
            Canonical::Disk { hole } => hole == 0.0,
            Canonical::Ball | Canonical::Frustum { .. } | Canonical::Torus { .. } => false,
        },
    }
}

impl<S: Simd> Cut<S> {
    /// `None` if that is not known. Not inlined, as what it is asked is not: one copy of each for each instruction set
    /// is enough.
    #[inline(never)]
    pub fn new(
        simd: S,
        occluder: &Occluder,
        ball: (Exact, f32, Half),
        p: Vec3x16<S>,
        l: &[Vec3x16<S>; 3],
    ) -> Option<Cut<S>> {
        simd.vectorize(
            #[inline(always)]
            || Cut::new_now(simd, occluder, ball, p, l),
        )
    }

    #[inline(always)]
    fn new_now(
        simd: S,
        occluder: &Occluder,
        (center, radius, half): (Exact, f32, Half),
        p: Vec3x16<S>,
        l: &[Vec3x16<S>; 3],
    ) -> Option<Cut<S>> {
        let ball = Ball::new(center.seen_from(simd, p), radius, l);
        let face = |lines: [Linear16<S>; 5], height: f32x16<S>| {
            let plane = Linear16 { c: lines[0].c + height, ..lines[0] };
            (lines, Some(Arc::new(&ball, plane, height)))
        };
        let zero = simd.splat_f32x16(0.0);
        let nothing = [Linear16 { c: zero, x: zero, y: zero }; 5];
        let shape = match occluder {
            Occluder::Flat { corners } => {
                let q = corners_from(simd, corners, p);
                let height = (q[1] - q[0]).cross(q[3] - q[0]).dot(q[0]).abs();
                CutShape::Flat { faces: [face(edges(q, l), height), (nothing, None), (nothing, None)] }
            }
            Occluder::Solid(solid) => {
                let (to, local) = solid.seen_from(simd, p, l);
                let hull = Hull::new(solid, to, &local);
                match solid.kind {
                    Canonical::Plane => {
                        CutShape::Flat { faces: [face(hull.faces[0], to.z.abs()), (nothing, None), (nothing, None)] }
                    }
                    Canonical::Box => {
                        let [x, y, z] = hull.faces;
                        let one = simd.splat_f32x16(1.0);
                        // Four times as far as in its own space, by the length of its edges
                        let height = |w: f32x16<S>| ((w.abs() - one) * 4.0).abs();
                        CutShape::Flat { faces: [face(x, height(to.x)), face(y, height(to.y)), face(z, height(to.z))] }
                    }
                    Canonical::Disk { hole: 0.0 } => {
                        let rim = hull.rims[0];
                        CutShape::Rim { cone: rim.quadratic, arc: Arc::new(&ball, rim.ahead, to.z.abs()) }
                    }
                    Canonical::Disk { .. } | Canonical::Ball | Canonical::Frustum { .. } | Canonical::Torus { .. } => {
                        return None;
                    }
                }
            }
            Occluder::Sphere { center, radius } => {
                let other = Ball::new(center.seen_from(simd, p), *radius, l);
                let one = simd.splat_f32x16(1.0);
                // (l.s)^2 - |l|^2 (|s|^2 - r^2)
                let cone = Quadratic16::square(&other.along).combined(one, other.length2, -other.touch2);
                let between = ball.middle - other.middle;
                let plane = Linear16::along(between, l);
                let arc = Arc::new(&ball, plane, (ball.touch2 - other.touch2) * 0.5);
                CutShape::Sphere { other, cone, arc }
            }
        };
        Some(Cut { ball, half, shape })
    }

    /// Hands over what is hidden of sixteen rows, of which `rim` is what is on the ball.
    #[inline(never)]
    pub fn hidden(&self, simd: S, y: f32x16<S>, rim: &Interval16<S>) -> [Interval16<S>; MOST] {
        simd.vectorize(
            #[inline(always)]
            || self.hidden_now(simd, y, rim),
        )
    }

    #[inline(always)]
    fn hidden_now(&self, simd: S, y: f32x16<S>, rim: &Interval16<S>) -> [Interval16<S>; MOST] {
        let mut all = [Interval16::none(simd); MOST];
        match &self.shape {
            CutShape::Flat { faces } => {
                for (k, (lines, arc)) in faces.iter().enumerate() {
                    let Some(arc) = arc else { break };
                    let begins = self.is_before(&arc.plane, arc.height, rim.from, y);
                    let parts = arc.parts(simd, &[(&self.ball, self.half)], y, rim, begins);
                    for (i, mut part) in parts.into_iter().enumerate() {
                        for line in &lines[1..] {
                            part.clip(y * line.y + line.c, line.x);
                        }
                        all[2 * k + i] = part;
                    }
                }
            }
            CutShape::Rim { cone, arc } => {
                let inside = cone.cone_on_row(simd, &arc.plane, y);
                let begins = self.is_before(&arc.plane, arc.height, rim.from, y);
                for (i, part) in arc.parts(simd, &[(&self.ball, self.half)], y, rim, begins).into_iter().enumerate() {
                    all[i] = Interval16 { from: part.from.max(inside.from), to: part.to.min(inside.to) };
                }
            }
            CutShape::Sphere { other, cone, arc } => {
                let inside = cone.cone_on_row(simd, &other.along, y);
                let range = Interval16 { from: rim.from.max(inside.from), to: rim.to.min(inside.to) };
                let begins = other.meets(Half::Near, range.from, y).simd_lt(self.ball.meets(self.half, range.from, y));
                let parts = arc.parts(simd, &[(&self.ball, self.half), (other, Half::Near)], y, &range, begins);
                (all[0], all[1]) = (parts[0], parts[1]);
            }
        }
        all
    }

    /// Whether a plane is before the ball where a row begins: at the rim, if points are outside.
    #[inline(always)]
    fn is_before(&self, plane: &Linear16<S>, height: f32x16<S>, x: f32x16<S>, y: f32x16<S>) -> mask32x16<S> {
        let along = plane.at(x, y);
        match self.half {
            Half::Near | Half::Far => along.simd_ge(height),
            Half::Around => (along * self.ball.meets(self.half, x, y)).simd_ge(height),
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
            CutShape::Rim { cone, arc } | CutShape::Sphere { cone, arc, .. } => {
                breaks.quadratic(cone, of);
                breaks.quadratic(&arc.circle, of);
            }
        }
    }
}
