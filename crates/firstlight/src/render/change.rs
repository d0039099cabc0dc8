//! What of one light arrives at a place, and how much that bends over the patch around it.

use super::arrival::ArrivalPlace;
use crate::integrate::{Arrived, Emitter, FlatView, Illumination, TOLERANCE};
use crate::material::{Lobe, Moments};
use crate::math::{Vec3, square};

/// What of one light arrives.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Arrival {
    pub sums: Moments,
    /// How far the mean over the patch can be from what arrives at its middle.
    pub bend: Moments,
    /// Over how much of the light's size the outlines of shadows move across the patch; see [`Arrived::motion`].
    pub drift: f32,
    /// Whether all that light does here is wide beside the patch, so that neighbours tell what it does.
    pub resolved: bool,
    /// Whether nothing of it has a corner, and what curves does so little that a quadratic in the place follows it.
    pub smooth: bool,
}

/// How a light changes over a patch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Change {
    /// See [`Arrival::bend`], and so on.
    pub bend: Moments,
    pub drift: f32,
    pub resolved: bool,
    pub smooth: bool,
}

impl Change {
    /// Not at all.
    pub const NONE: Change = Change { bend: Moments::ZERO, drift: 0.0, resolved: true, smooth: true };
    /// Nobody knows.
    pub const UNKNOWN: Change = Change { bend: Moments::MOST, drift: f32::INFINITY, resolved: false, smooth: false };

    pub fn with(self, sums: Moments) -> Arrival {
        let Change { bend, drift, resolved, smooth } = self;
        Arrival { sums, bend, drift, resolved, smooth }
    }
}

impl Arrival {
    /// At a point, or where nothing bends.
    pub fn even(sums: Moments) -> Arrival {
        Change::NONE.with(sums)
    }
}

/// Of a light that nothing is seen of, or that has no view: from inside of a ball nothing of its outside.
pub(super) fn unseen(emitter: &Emitter, place: &ArrivalPlace) -> Change {
    let is_known = match emitter {
        Emitter::Flat(_) => true,
        Emitter::Ball { both_sides: true, .. } | Emitter::Face { .. } => false,
        Emitter::Ball { center, radius, .. } => {
            (*center - place.si.lit_from.as_dvec3()).length() + f64::from(place.reach) < radius * (1.0 - 1e-6)
        }
    };
    if is_known || place.reach == 0.0 {
        Change { drift: f32::INFINITY, resolved: false, smooth: false, ..Change::NONE }
    } else {
        Change::UNKNOWN
    }
}

/// What arrives on a patch whose middle sees nothing of a light, at most.
pub(super) fn horizon_change(view: &FlatView, place: &ArrivalPlace) -> Change {
    if place.reach == 0.0 {
        return Change::NONE;
    }
    let far = view.middle().length() + view.la + view.lb + view.skew.abs();
    let behind = place.reach + place.turn * far;
    if view.facing < -place.reach || view.max(&view.cos) < -behind || view.max(&view.horizon) < -behind {
        return Change::NONE;
    }
    let swing = place.turn + place.reach / view.nearest().max(place.reach);
    let crossing = view.crossing(place.reach);
    let cos = (view.max(&view.cos).max(0.0) / view.middle().length() + swing).min(1.0);
    let all = view.most(place.reach) * (swing.min(1.0) * 0.5 + cos * crossing).min(1.0);
    let bend = Moments::bounds(all, all);
    let resolved = swing < TOLERANCE.resolved && crossing == 0.0;
    Change { bend, drift: 0.0, resolved, smooth: false }
}

/// How far the mean over a patch can be from what arrives at its middle, and so on. `sway` is by how much the way to
/// the viewer turns over it.
pub(super) fn change(view: &FlatView, place: &ArrivalPlace, arrived: &Arrived, sway: f32) -> Change {
    let (drift, illumination) = (arrived.motion, arrived.illumination);
    if place.reach == 0.0 || illumination == Illumination::Hidden && drift == 0.0 {
        return Change::NONE;
    }
    let (most, nearest, crossing) = (view.most(place.reach), view.nearest(), view.crossing(place.reach));
    let swing = place.turn + place.reach / nearest.max(place.reach);
    let cuts = !view.is_above_horizon() || view.min(&view.cos) < place.reach + place.turn * view.middle().length();
    // Where the outline of a shadow comes in, the share it hides begins to grow at once: an eighth of the way it moves
    let kink = (drift * 0.125).min(1.0);
    let cos = (view.max(&view.cos) / view.middle().length()).min(1.0) + swing;
    let horizon = if cuts { swing * swing.min(1.0) } else { 0.0 };
    let smooth = square(place.reach / nearest.max(place.reach)) * 2.0 + place.turn * place.turn * 0.5;
    let diffuse = most * (cos * (kink + smooth.min(1.0) + crossing) + horizon).min(1.0);
    let resolved = drift < TOLERANCE.resolved && swing < TOLERANCE.resolved && crossing == 0.0;
    let is_clear = resolved && drift == 0.0 && illumination == Illumination::Full && !cuts;
    if matches!(view.lobe, Lobe::None) {
        let bend = Moments::bounds(diffuse, 0.0);
        return Change { bend, drift, resolved, smooth: is_clear };
    }
    let moved = 2.0 * place.turn + place.reach / nearest.max(place.reach) + sway;
    let lobe = view.sharpness() * moved * moved;
    let narrow = lobe.min(1.0);
    let specular = most * brightest(view, lobe) * (kink + smooth + narrow + horizon + crossing).min(1.0);
    let bend = Moments::bounds(diffuse, specular);
    let is_wide = lobe < TOLERANCE.resolved;
    Change { bend, drift, resolved: resolved && is_wide, smooth: is_clear && is_wide }
}

/// How bright a highlight can be on a light, at most, or thereabouts, from all over a patch; `moved` is what the
/// highlight moves by over the patch, as a part of its width, squared.
fn brightest(view: &FlatView, moved: f32) -> f32 {
    let size2 = square(view.la.max(view.lb));
    let distance2 = square(view.nearest());
    let sharp = view.sharpness() * size2;
    if sharp > 0.5 * distance2 || moved > 1.0 {
        return 1.0;
    }
    let at = |l: Vec3| {
        let inverse = 1.0 / l.length();
        view.lobe.eval((view.ns.dot(l) * inverse).max(0.0), view.cos_o, view.wo.dot(l) * inverse)
    };
    let [a, b, c, d] = view.corners().map(at);
    let corners = a.max(b).max(c).max(d);
    let here = (corners.max(at(view.middle())) * 1.5).min(1.0);
    // exp(-(a - m)^2) is at most exp(-(1 - e) a^2) exp((1/e - 1) m^2), for any share e, as for a half
    (here.sqrt() * (1.0 + 2.0 * moved)).min(1.0)
}
