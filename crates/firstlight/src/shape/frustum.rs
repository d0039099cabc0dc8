//! What cylinders and cones are: round about an axis, with a radius that changes evenly from one end to the other.

use std::f64::consts::PI;

use glam::DVec2;

use super::disk::ring_point;
use super::solid::{Chord, SolidHit, SolidPoint, turn};
use super::surface::UvEdge;
use crate::context::{CompileContext, show};
use crate::math::{DRay, DVec3, Frame};

/// A cylinder or a cone, ready to be hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frustum {
    /// The end where z = 0.
    p0: DVec3,
    /// z is the axis, angles are counted from x.
    frame: Frame,
    /// The length of the axis.
    height: f64,
    /// The radii at z = 0 and at z = `height`.
    radii: [f64; 2],
    /// (radii[1] - radii[0]) / height.
    slope: f64,
    /// Whether the ends are closed.
    pub capped: bool,
}

/// The round side.
const MANTLE: u8 = 0;
/// The end where z = 0.
const CAP0: u8 = 1;
/// The end where z = height.
const CAP1: u8 = 2;

/// Ends nearer to each other than this have no axis.
const MIN_LENGTH: f64 = 1e-9;

impl Frustum {
    /// From the ends of the axis, which are checked, and the radii there, which have been.
    pub(super) fn compile(cx: &mut CompileContext, p0: [f64; 3], p1: [f64; 3], radii: [f64; 2], capped: bool) -> Self {
        let before = cx.fault_count();
        cx.point("p0", p0);
        cx.point("p1", p1);
        let axis = DVec3::from(p1) - DVec3::from(p0);
        if cx.fault_count() == before && !(axis.length() >= MIN_LENGTH) {
            let message = format!("{} is p0 = {}: there is no axis between them", show(&p1), show(&p0));
            cx.error("p1", message, Some("the ends are 1e-9 m apart or more"));
        }
        let height = axis.length();
        Frustum {
            p0: p0.into(),
            frame: Frame::around(axis.normalize_or(DVec3::Y)),
            height,
            radii,
            slope: (radii[1] - radii[0]) / height,
            capped,
        }
    }

    /// The radius at z; negative beyond the apex.
    #[inline(always)]
    fn radius(&self, z: f64) -> f64 {
        self.radii[0] + (self.radii[1] - self.radii[0]) * (z / self.height)
    }

    #[inline(always)]
    pub fn intersect(&self, ray: &DRay, t_min: f64, t_max: f64, single_sided: bool) -> Option<SolidHit> {
        let middle = self.p0 + self.frame.z * (0.5 * self.height);
        let (near, shift) = ray.nearest_to(middle);
        let (mut o, d) = (self.frame.local(near.o), self.frame.local(near.d));
        o.z += 0.5 * self.height;
        let mantle = self.mantle(o, d);
        if self.capped {
            let mut chord = Chord::LINE;
            chord.cut_slab(o.z, d.z, 0.0, self.height, CAP0, CAP1);
            chord.cut(mantle.enter, mantle.leave);
            return chord.first(shift, t_min, t_max, single_sided);
        }
        // Open: the ends of what is inside the mantle, where they lie between the ends of the axis. Two tubes that share an
        // end overlap by the rounding, so that no ray slips between them
        if mantle.is_empty() {
            return None;
        }
        let slack = 8.0 * f64::EPSILON * (self.height + (ray.o - middle).length());
        let within = |hit: SolidHit| {
            let (z, t) = (o.z + d.z * hit.t, hit.t + shift);
            (z >= -slack && z <= self.height + slack && t > t_min && t < t_max).then_some(SolidHit { t, part: MANTLE })
        };
        within(mantle.enter).or_else(|| if single_sided { None } else { within(mantle.leave) })
    }

    /// The part of the line o + t d inside the mantle, which is thought to go on beyond the ends, up to the apex.
    ///
    /// In the plane across the axis, with the radius R + D t: |o + t d| = R + D t, or a t^2 + 2 b t + c = 0 with
    /// a = d.d - D^2, b = o.d - D R, c = o.o - R^2. The discriminant b^2 - a c cancels where the line grazes the mantle, and
    /// near the apex; written as |R d - D o|^2 - |o x d|^2 it does not.
    #[inline(always)]
    fn mantle(&self, o: DVec3, d: DVec3) -> Chord {
        let (radius, change) = (self.radius(o.z), self.slope * d.z);
        let (o, d) = (o.truncate(), d.truncate());
        let (width, speed) = (o.length(), d.length());
        let a = (speed - change.abs()) * (speed + change.abs());
        let b = o.dot(d) - change * radius;
        let c = (width - radius) * (width + radius);
        let (reach, miss) = ((d * radius - o * change).length(), o.perp_dot(d).abs());
        let discriminant = (reach - miss) * (reach + miss);
        let at = |t: f64| SolidHit { t, part: MANTLE };
        let none = at(f64::NEG_INFINITY);
        let all = at(f64::INFINITY);
        if a > 0.0 && !(discriminant >= 0.0) {
            return Chord::NOTHING;
        }
        if a == 0.0 {
            // Along the mantle, or along the axis of a cylinder: one end, or none
            let end = at(-0.5 * c / b);
            return match b {
                _ if b > 0.0 => Chord { enter: none, leave: end },
                _ if b < 0.0 => Chord { enter: end, leave: all },
                _ if c <= 0.0 && radius >= 0.0 => Chord::LINE,
                _ => Chord::NOTHING,
            };
        }
        let root = discriminant.max(0.0).sqrt();
        let q = if b > 0.0 { -b - root } else { root - b };
        let (t0, t1) = if q == 0.0 { (0.0, 0.0) } else { (q / a, c / q) };
        let (first, last) = (at(t0.min(t1)), at(t0.max(t1)));
        if a > 0.0 {
            // Both on the same side of the apex; beyond it there is nothing
            let middle = -b / a;
            return if radius + change * middle >= 0.0 || self.slope == 0.0 {
                Chord { enter: first, leave: last }
            } else {
                Chord::NOTHING
            };
        }
        // Steeper than the mantle: it comes in through one nappe, and the other is not part of the shape
        if change > 0.0 { Chord { enter: last, leave: all } } else { Chord { enter: none, leave: first } }
    }

    pub fn point(&self, ray: &DRay, hit: &SolidHit) -> SolidPoint {
        let at = self.frame.local(ray.o - self.p0 + ray.d * hit.t);
        let world = |v: DVec3| self.frame.world(v);
        let edges = [UvEdge::Periodic, UvEdge::Bounded];
        let terms = self.p0.abs()
            + self.frame.disk_reach() * self.radii[0].max(self.radii[1])
            + self.frame.z.abs() * self.height;
        if hit.part != MANTLE {
            let (z, radius, side) = match hit.part {
                CAP0 => (0.0, self.radii[0], -1.0),
                _ => (self.height, self.radii[1], 1.0),
            };
            let on = ring_point(at.truncate(), radius, 0.0);
            return SolidPoint {
                p: self.p0 + world(on.p.extend(z)),
                normal: self.frame.z * side,
                uv: on.uv,
                dpdu: world(on.dpdu.extend(0.0)),
                dpdv: world(on.dpdv.extend(0.0)),
                edges,
                terms,
            };
        }
        // Back to the mantle along its normal, which is (1, -slope) in the plane of the axis and the point
        let outwards = at.truncate().normalize_or(DVec2::X);
        let lean = 1.0 + self.slope * self.slope;
        let above = at.truncate().length() - self.radius(at.z);
        let z = (at.z + above * (self.slope / lean)).clamp(0.0, self.height);
        let radius = self.radius(z).max(0.0);
        SolidPoint {
            p: self.p0 + world((outwards * radius).extend(z)),
            normal: world(outwards.extend(-self.slope) / lean.sqrt()),
            uv: DVec2::new(turn(outwards.x, outwards.y), z / self.height),
            dpdu: world((outwards.perp() * (2.0 * PI * radius)).extend(0.0)),
            dpdv: world((outwards * (self.radii[1] - self.radii[0])).extend(self.height)),
            edges,
            terms,
        }
    }

    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let p1 = self.p0 + self.frame.z * self.height;
        let reach = self.radii.map(|r| self.frame.disk_reach() * r);
        Some([(self.p0 - reach[0]).min(p1 - reach[1]), (self.p0 + reach[0]).max(p1 + reach[1])])
    }
}
