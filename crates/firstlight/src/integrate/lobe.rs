//! The part of a light that a narrow highlight covers.

use super::hider::Hider;
use super::rows::Region;
use super::tensor::sharpness;
use super::view::{Linear, View};
use crate::material::Lobe;
use crate::math::{DVec3, Vec3, square};

/// Beyond the angle at which a highlight has fallen to exp(-FALL) it is left out.
const FALL: f32 = 11.0;
/// In the same measure, how far a light may reach across a highlight before the two are integrated apart.
const WIDE: f32 = 1.2;
/// In the same measure, how long a piece of a row may be, squared and from its middle.
const PIECE: f32 = 1.2;
/// The most pieces.
const MAX_PIECES: f32 = 12.0;

/// What a highlight covers of the light: `None` if it is not narrow beside the light, and has to be integrated with the
/// rest; `Some(None)` if it covers nothing of it.
pub(crate) fn region(view: &View) -> Option<Option<Region>> {
    if matches!(view.lobe, Lobe::None) {
        return None;
    }
    let sharpness = sharpness(view);
    let size2 = square((view.la + view.skew.abs()).max(view.lb));
    // The angle the light fills, seen from the nearest part of its plane that it can fill
    let [gap_x, gap_y] = view.gaps();
    let distance2 = (gap_x * gap_x + gap_y * gap_y + view.height * view.height).max(size2 * 1e-6);
    if sharpness * size2 <= WIDE * distance2 {
        return None;
    }
    let cone = covered(view);
    let region = match cone {
        Some(region) => region,
        None => Region::whole(view),
    };
    let ([x0, x1], [y0, y1]) = (region.x, region.y);
    let ([left, right], [low, high]) = (view.x, view.y);
    let clipped = Region { x: [x0.max(left), x1.min(right)], y: [y0.max(low), y1.min(high)], pieces: 1 };
    if !(clipped.x[0] < clipped.x[1] && clipped.y[0] < clipped.y[1]) {
        return Some(None);
    }
    let half = 0.5 * (clipped.x[1] - clipped.x[0]) * view.la;
    let reach = sharpness * half * half / distance2;
    let pieces = (reach / PIECE).sqrt().ceil().clamp(1.0, MAX_PIECES) as usize;
    Some(Some(Region { pieces, ..clipped }))
}

/// Highlights of lower exponents have a kink where they end.
const KINKED: f32 = 8.0;

/// Where a blunt highlight of Phong ends: what lies beyond, as if something hid it, if some of the light does;
/// `Some(None)` if all does; `None` if nothing does, or the end does not show.
pub(crate) fn end(view: &View) -> Option<Option<Hider>> {
    let Lobe::Phong(lobe) = view.lobe else { return None };
    // What is raised to 0 is 1 everywhere
    if lobe.exponent() >= KINKED || lobe.exponent() == 0.0 {
        return None;
    }
    // The cosine to the mirrored direction, times |l|
    let mirrored = |cos: f32, out: f32| 2.0 * view.cos_o * cos - out;
    let Linear { c, x, y } = view.cos;
    let along = Linear { c: mirrored(c, view.out.c), x: mirrored(x, view.out.x), y: mirrored(y, view.out.y) };
    if view.min(&along) >= 0.0 {
        return None;
    }
    Some((view.max(&along) > 0.0).then(|| Hider::below(along)))
}

/// The box around where the cone of a highlight meets the light's plane; `None` if that has no end.
fn covered(view: &View) -> Option<Region> {
    let (exponent, factor) = match view.lobe {
        Lobe::None => return None,
        Lobe::Phong(lobe) => (lobe.exponent(), 1.0),
        // The direction of light turns at most twice as fast as the half vector
        Lobe::BlinnPhong(lobe) => (lobe.exponent(), 2.0),
    };
    // cos^s t = exp(-FALL): t is a little smaller than this
    let angle = factor * (2.0 * FALL / exponent).sqrt();
    if !(angle < 1.2) {
        return None;
    }
    let cos2 = f64::from(square((1.0 - angle * angle * 0.5).max(0.0)));
    let mirror = view.mirror()?.as_dvec3();
    let [l0, a, b] = [view.l0, view.a, view.b].map(|v| v.as_dvec3());
    // The whole of the cone has to lie on the light's side of the point
    let normal = a.cross(b).normalize();
    let normal = normal * normal.dot(l0).signum();
    let sin = f64::from(angle);
    if !(normal.dot(mirror) > sin * 1.05) {
        // It may still miss the light's half of space altogether
        return None;
    }
    // (m.l)^2 >= cos^2 l.l as a conic in (x, y, 1), and the box around it from its dual
    let form = |p: DVec3, q: DVec3| mirror.dot(p) * mirror.dot(q) - cos2 * p.dot(q);
    let [xx, xy, yy, x, y, c] = [form(a, a), form(a, b), form(b, b), form(a, l0), form(b, l0), form(l0, l0)];
    let area = xx * yy - xy * xy;
    if !(xx < 0.0 && area > 0.0) {
        return None;
    }
    let range = |minor: f64, middle: f64| {
        let root = (middle * middle - area * minor).max(0.0).sqrt();
        [((middle - root) / area) as f32, ((middle + root) / area) as f32]
    };
    let x_range = range(yy * c - y * y, xy * y - yy * x);
    let y_range = range(xx * c - x * x, xy * x - xx * y);
    Some(Region { x: x_range, y: y_range, pieces: 1 })
}

impl View {
    /// The direction of a highlight's middle: the viewer's, mirrored at the shading normal.
    pub(super) fn mirror(&self) -> Option<Vec3> {
        let m = self.ns * (2.0 * self.cos_o) - self.wo;
        let length = m.length();
        (length > 0.5).then(|| m / length)
    }
}
